//! A record of the samples that an accelerometer or the drives send, from a certain tick on.

use crate::accelerometer::SampleFrame;
use crate::following_error::{FOLLOWING_ERROR_BYTES, FollowingErrorFrame};
use crate::framing::Decoder;
use crate::telemetry::Wanted;
use crate::units::TICK_HZ;

use super::record::Record;
use super::refusal::Refusal;
use super::{Identified, identify};

/// Length of a record, in s.
pub const LISTENING_S: f32 = 1.0;

/// Samples that may be lost in a row: they are bridged by a straight line, which is close to
/// a swing of up to 40 Hz for so long.
const LOST_IN_A_ROW: u32 = 3;

/// Samples of a record that may be lost altogether.
const LOST_AT_ALL: u32 = 20;

/// Samples that are asked for: those of the record, and those that may be lost. Were they asked
/// for until the record is complete, a line that is slower than they come would still be busy
/// with what nobody wants when the next record begins.
const WANTED: u32 = (LISTENING_S * TICK_HZ as f32) as u32 + LOST_AT_ALL;

/// What a record is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// The acceleration along a direction, X, Y and Z, mm/s².
    Acceleration([f32; 3]),
    /// The following error of a joint, counted from 0, µrad or µm.
    FollowingError(u8),
}

impl Signal {
    /// What has to be asked for it.
    const fn wanted(self) -> Wanted {
        match self {
            Self::Acceleration(_) => Wanted::Acceleration,
            Self::FollowingError(_) => Wanted::FollowingErrors,
        }
    }

    /// Number and sample of a frame that tells it.
    fn sample(self, body: &[u8]) -> Option<(u32, f32)> {
        match self {
            Self::Acceleration(direction) => {
                let frame = SampleFrame::from_body(body)?;
                let parts = frame.acceleration_mm_s2.iter().zip(direction);
                let along = parts.map(|(value, share)| value * share).sum();
                Some((frame.sequence, along))
            }
            Self::FollowingError(joint) => {
                let frame = FollowingErrorFrame::from_body(body)?;
                Some((frame.sequence, *frame.error.get(usize::from(joint))?))
            }
        }
    }
}

/// What to record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Listen {
    /// Number of the setpoint whose answer counts first, or a later one.
    pub from: u32,
    /// What of.
    pub signal: Signal,
}

/// How far a record has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Listening {
    /// Nothing is to be recorded.
    #[default]
    Idle,
    /// Samples are awaited, or come: so many have been heard, those that are late for another
    /// record included. It wraps.
    Busy(u16),
    /// Too many samples were lost, so the record is none.
    Torn,
    /// The record is complete.
    Complete,
}

/// Takes the bytes of an accelerometer or of the drives; 2.2 KiB.
#[derive(Debug, Default)]
pub struct Listener {
    decoder: Decoder<FOLLOWING_ERROR_BYTES>,
    record: Record,
    signal: Option<Signal>,
    progress: Listening,
    /// Number of the setpoint whose answer is next.
    next: u32,
    /// The tick before which samples were first asked for.
    asked: Option<u32>,
    /// The last sample of the record.
    last: Option<f32>,
    /// Samples lost.
    lost: u32,
}

impl Listener {
    /// A listener that has heard nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            decoder: Decoder::new(),
            record: Record::new(),
            signal: None,
            progress: Listening::Idle,
            next: 0,
            asked: None,
            last: None,
            lost: 0,
        }
    }

    /// What is wanted of the setpoint frame that comes next; `ticks` is its number, or a little
    /// less.
    pub fn wants(&mut self, ticks: u32) -> Wanted {
        match (self.progress, self.signal) {
            (Listening::Busy(_), Some(signal)) => {
                let first = *self.asked.get_or_insert(ticks);
                if ticks.wrapping_sub(first) < WANTED {
                    signal.wanted()
                } else {
                    Wanted::Nothing
                }
            }
            _ => Wanted::Nothing,
        }
    }

    /// Begins a record, instead of any other.
    pub fn listen(&mut self, listen: Listen) {
        self.record.clear();
        self.signal = Some(listen.signal);
        self.next = listen.from;
        self.progress = Listening::Busy(0);
        self.asked = None;
        self.last = None;
        self.lost = 0;
    }

    /// How far the record has come.
    #[must_use]
    pub const fn progress(&self) -> Listening {
        self.progress
    }

    /// Takes bytes. Cost on a Cortex-M4F: some 60 instructions a byte.
    pub fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let Some(Ok(body)) = self.decoder.push(byte) else {
                continue;
            };
            let sample = self.signal.and_then(|signal| signal.sample(body));
            if let Some((sequence, sample)) = sample {
                self.take(sequence, sample);
            }
        }
    }

    fn take(&mut self, sequence: u32, sample: f32) {
        let Listening::Busy(heard) = self.progress else {
            return;
        };
        self.progress = Listening::Busy(heard.wrapping_add(1));
        let ahead = sequence.wrapping_sub(self.next);
        if ahead > u32::MAX / 2 {
            // an answer to a setpoint before the first one that counts
            return;
        }
        if let Some(last) = self.last {
            self.lost = self.lost.saturating_add(ahead);
            if ahead > LOST_IN_A_ROW || self.lost > LOST_AT_ALL {
                self.progress = Listening::Torn;
                return;
            }
            let step = (sample - last) / (ahead + 1) as f32;
            for place in 1..=ahead {
                self.record.push(last + place as f32 * step);
            }
        }
        self.record.push(sample);
        self.last = Some(sample);
        self.next = sequence.wrapping_add(1);
        if self.record.length_s() >= LISTENING_S {
            self.progress = Listening::Complete;
        }
    }

    /// What the record shows; it is used up then.
    ///
    /// # Errors
    /// It cannot be believed, or is not complete.
    pub fn identify(&mut self) -> Result<Identified, Refusal> {
        self.progress = Listening::Idle;
        identify(&mut self.record)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    fn sample(sequence: u32) -> SampleFrame {
        let time_s = f64::from(sequence) * 1e-3;
        let swing = (-6.0 * time_s).exp() * (60.0 * time_s).cos();
        SampleFrame {
            sequence,
            acceleration_mm_s2: [600.0 * swing as f32, 800.0 * swing as f32, 5.0],
        }
    }

    fn listening() -> Listener {
        let mut listener = Listener::new();
        listener.hear(&sample(1).encode());
        assert_eq!(listener.progress(), Listening::Idle);
        listener.listen(Listen {
            from: 100,
            signal: Signal::Acceleration([0.6, 0.8, 0.0]),
        });
        listener
    }

    #[test]
    fn the_record_begins_with_the_tick_that_is_wanted() {
        let mut listener = listening();
        for sequence in 40..1099 {
            listener.hear(&sample(sequence).encode());
            let count = u16::try_from(sequence - 39).unwrap();
            assert_eq!(listener.progress(), Listening::Busy(count));
        }
        listener.hear(&sample(1099).encode());
        assert_eq!(listener.progress(), Listening::Complete);
        let found = listener.identify().unwrap();
        let mode = found.modes[0];
        // 1000 mm/s² along the direction at the time 0, and 0.55 of it at 0.1 s
        assert!((mode.amplitude() - 548.8).abs() < 1.0, "{mode:?}");
        assert!((mode.decay.rate[1] - 60.0).abs() < 0.01);
        assert_eq!(listener.progress(), Listening::Idle);
        assert_eq!(
            listener.identify(),
            Err(Refusal::TooShort {
                length_s: 0.0,
                wanted_s: 0.25
            })
        );
    }

    /// However long the answers take, no more is asked for than the record can use.
    #[test]
    fn so_many_samples_are_asked_for_and_no_more() {
        let mut listener = listening();
        assert_eq!(listener.wants(u32::MAX - 99), Wanted::Acceleration);
        let wanted = (0..3000_u32).filter(|tick| {
            let ticks = tick.wrapping_add(u32::MAX - 98);
            listener.wants(ticks) == Wanted::Acceleration
        });
        assert_eq!(wanted.count(), 1019);
        listener.listen(Listen {
            from: 7,
            signal: Signal::FollowingError(2),
        });
        assert_eq!(listener.wants(9), Wanted::FollowingErrors);
    }

    #[test]
    fn a_joint_is_recorded_from_the_drives_frames_alone() {
        let mut listener = Listener::new();
        listener.listen(Listen {
            from: 1,
            signal: Signal::FollowingError(1),
        });
        for sequence in 1..=1000 {
            let SampleFrame {
                acceleration_mm_s2: [x, y, _],
                ..
            } = sample(sequence);
            let frame = FollowingErrorFrame {
                sequence,
                error: [3.0, 0.01 * (x + y), 7.0, 0.0],
            };
            listener.hear(&sample(sequence).encode());
            listener.hear(&frame.encode());
        }
        assert_eq!(listener.progress(), Listening::Complete);
        let mode = &listener.identify().unwrap().modes[0];
        assert!((mode.decay.rate[1] - 60.0).abs() < 0.01, "{mode:?}");
        assert!((mode.amplitude() - 13.9).abs() < 0.1, "{mode:?}");
    }

    /// What a record shows from which these samples are missing.
    fn without(is_lost: impl Fn(u32) -> bool) -> Result<f32, Listening> {
        let mut listener = listening();
        for sequence in (90..1200).filter(|&sequence| !is_lost(sequence)) {
            listener.hear(&sample(sequence).encode());
        }
        match listener.progress() {
            Listening::Complete => Ok(listener.identify().unwrap().modes[0].decay.rate[1]),
            progress => Err(progress),
        }
    }

    #[test]
    fn a_few_lost_samples_are_bridged_and_many_tear_the_record() {
        for found in [
            without(|sequence| sequence == 100),
            without(|sequence| (500..503).contains(&sequence)),
            without(|sequence| sequence % 50 == 7),
        ] {
            assert!((found.unwrap() - 60.0).abs() < 0.01, "{found:?}");
        }
        assert_eq!(
            without(|sequence| (500..504).contains(&sequence)),
            Err(Listening::Torn)
        );
        assert_eq!(without(|sequence| sequence % 40 == 7), Err(Listening::Torn));
    }
}
