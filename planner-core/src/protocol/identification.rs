//! Identification on the robot: a move that excites the mode, and what it leaves.
//!
//! | phase | until | then |
//! |---|---|---|
//! | move | the motion stands; nothing is listened to | settle |
//! | settle | the drives stand too, 50 ms later | listen |
//! | listen | the record of 1 s is complete | identify |
//!
//! The move goes through a prefilter that leaves what it excites: a box of 10 ms, which nulls
//! 100 Hz and bounds the acceleration. The one of the settings is in force again afterwards.
//!
//! Start and stop both excite. If the time between them is a whole number and a half of
//! periods they add up, if it is a whole number they nearly cancel: a record in which nothing
//! stands out calls for another length.
//!
//! A mode that changes with the posture is that of the place where the move ends.
//!
//! Where two modes are found the first one is that which is looked for: in an acceleration of the
//! tool the one of the larger amplitude, in a joint's following error the slower one, because the
//! joint's own mode is always the larger there, and faster than what swings at the arm's end.

use crate::identify::{Identified, IdentifiedMode, Listen, Listening, MODES, Signal};
use crate::prefilter::{Kind, PrefilterConfig};

/// After the motion stands, until the record begins, in ms.
const SETTLE_MS: u32 = 50;

/// Longest wait for a sample, in ms: who does not answer is not there.
const PATIENCE_MS: u32 = 5_000;

/// The prefilter of the move.
pub const EXCITING: PrefilterConfig = PrefilterConfig {
    kind: Kind::Fir,
    frequency_hz: 100.0,
    damping: 0.0,
    ..PrefilterConfig::DEFAULT
};

/// The message of one that was stopped on its way.
pub const CANCELLED: &str = "The identification was cancelled";

/// The message of one by an accelerometer that is not there.
pub const ACCELEROMETER_SILENT: &str =
    "The accelerometer is silent: check that it answers the setpoints";

/// The message of one by drives that do not tell their following errors.
pub const DRIVES_SILENT: &str =
    "The drives tell no following error: check that they answer the setpoints";

/// The messages that tell of no record, but that there is none.
pub const NO_RECORD: [&str; 3] = [CANCELLED, ACCELEROMETER_SILENT, DRIVES_SILENT];

/// A mode as it was identified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeFound {
    /// Natural frequency in Hz.
    pub frequency_hz: f32,
    /// Damping ratio.
    pub damping: f32,
    /// The probability of being right, 0 to 1.
    pub confidence: f32,
}

impl From<&IdentifiedMode> for ModeFound {
    fn from(mode: &IdentifiedMode) -> Self {
        Self {
            frequency_hz: mode.frequency_hz,
            damping: mode.damping,
            confidence: mode.confidence,
        }
    }
}

/// What an identification does now.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Move,
    /// Until this tick.
    Settle(u32),
    /// Until this tick at the latest, unless a sample comes.
    Listen(u32),
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    /// Nothing yet.
    Wait,
    /// Begin a record.
    Listen(Listen),
    /// The record is complete.
    Identify,
    /// Too many samples were lost.
    Torn,
    /// No samples come.
    Silent,
}

/// An identification under way.
#[derive(Clone, Copy, Debug)]
pub struct Identification {
    phase: Phase,
    signal: Signal,
    /// What was heard at the last look.
    heard: Listening,
}

impl Identification {
    /// One whose record is of this signal.
    #[must_use]
    pub const fn new(signal: Signal) -> Self {
        Self {
            phase: Phase::Move,
            signal,
            heard: Listening::Idle,
        }
    }

    /// What its record is of.
    #[must_use]
    pub const fn signal(&self) -> Signal {
        self.signal
    }

    /// The modes of a record, the one that is looked for first.
    #[must_use]
    pub fn modes(&self, found: &Identified) -> [Option<ModeFound>; MODES] {
        let mut modes = [None; MODES];
        for (place, mode) in modes.iter_mut().zip(&found.modes) {
            *place = Some(ModeFound::from(mode));
        }
        if let (Signal::FollowingError(_), [Some(first), Some(second)]) = (self.signal, &modes)
            && second.frequency_hz < first.frequency_hz
        {
            modes.reverse();
        }
        modes
    }

    /// What to do next. `ticks` is how many there were since the start, `stands` says whether
    /// the motion does.
    pub fn next(&mut self, ticks: u32, stands: bool, listening: Listening) -> Next {
        let is_over = |end: u32| ticks.wrapping_sub(end) <= u32::MAX / 2;
        match self.phase {
            Phase::Move if stands => {
                self.phase = Phase::Settle(ticks.wrapping_add(SETTLE_MS));
                Next::Wait
            }
            Phase::Settle(end) if is_over(end) => {
                self.phase = Phase::Listen(ticks.wrapping_add(PATIENCE_MS));
                Next::Listen(Listen {
                    from: ticks,
                    signal: self.signal,
                })
            }
            Phase::Listen(_) if listening == Listening::Complete => Next::Identify,
            Phase::Listen(_) if listening == Listening::Torn => Next::Torn,
            Phase::Listen(_) if listening != self.heard => {
                self.heard = listening;
                self.phase = Phase::Listen(ticks.wrapping_add(PATIENCE_MS));
                Next::Wait
            }
            Phase::Listen(end) if is_over(end) => Next::Silent,
            Phase::Move | Phase::Settle(_) | Phase::Listen(_) => Next::Wait,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Just before the count of ticks wraps.
    const START: u32 = u32::MAX - 20;

    fn listening() -> (Identification, u32) {
        let signal = Signal::Acceleration([0.0, 1.0, 0.0]);
        let mut identification = Identification::new(signal);
        let mut next = |ticks, stands| identification.next(ticks, stands, Listening::Idle);
        assert_eq!(next(START, false), Next::Wait);
        for ahead in 0..50 {
            assert_eq!(next(START.wrapping_add(ahead), true), Next::Wait);
        }
        let from = START.wrapping_add(50);
        assert_eq!(next(from, true), Next::Listen(Listen { from, signal }));
        (identification, from)
    }

    #[test]
    fn a_record_begins_when_the_drives_stand_and_ends_complete() {
        let (mut identification, from) = listening();
        let mut next = |progress| identification.next(from.wrapping_add(1500), true, progress);
        assert_eq!(next(Listening::Busy(7)), Next::Wait);
        assert_eq!(next(Listening::Torn), Next::Torn);
        assert_eq!(next(Listening::Complete), Next::Identify);
    }

    #[test]
    fn who_does_not_answer_is_not_awaited_for_ever() {
        let (mut identification, from) = listening();
        let mut after =
            |ms, count| identification.next(from.wrapping_add(ms), true, Listening::Busy(count));
        assert_eq!(after(10, 0), Next::Wait);
        assert_eq!(after(5_000, 0), Next::Wait);
        assert_eq!(after(5_005, 1), Next::Wait);
        assert_eq!(after(10_004, 1), Next::Wait);
        assert_eq!(after(10_005, 1), Next::Silent);
    }
}
