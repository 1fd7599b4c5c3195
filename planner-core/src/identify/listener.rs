//! A record of the samples that an accelerometer sends, from a certain tick on.

use crate::accelerometer::{SampleDecoder, SampleFrame};

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

/// What to record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Listen {
    /// Number of the setpoint whose answer counts first, or a later one.
    pub from: u32,
    /// Direction of the component that counts, X, Y and Z.
    pub direction: [f32; 3],
}

/// How far a record has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Listening {
    /// Nothing is to be recorded.
    #[default]
    Idle,
    /// Samples are awaited, or come: so many have come.
    Busy(u16),
    /// Too many samples were lost, so the record is none.
    Torn,
    /// The record is complete.
    Complete,
}

/// Takes the bytes of an accelerometer; 2.2 KiB.
#[derive(Debug, Default)]
pub struct Listener {
    decoder: SampleDecoder,
    record: Record,
    listen: Listen,
    progress: Listening,
    /// The last sample.
    last: f32,
    /// Samples lost.
    lost: u32,
}

impl Listener {
    /// A listener that has heard nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            decoder: SampleDecoder::new(),
            record: Record::new(),
            listen: Listen {
                from: 0,
                direction: [0.0; 3],
            },
            progress: Listening::Idle,
            last: 0.0,
            lost: 0,
        }
    }

    /// Whether samples are wanted.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        matches!(self.progress, Listening::Busy(_))
    }

    /// Begins a record, instead of any other.
    pub fn listen(&mut self, listen: Listen) {
        self.record.clear();
        self.listen = listen;
        self.progress = Listening::Busy(0);
        self.lost = 0;
    }

    /// How far the record has come.
    #[must_use]
    pub const fn progress(&self) -> Listening {
        self.progress
    }

    /// Takes bytes from the accelerometer. Cost on a Cortex-M4F: some 60 instructions a byte.
    pub fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(frame) = self.decoder.push(byte) {
                self.take(&frame);
            }
        }
    }

    fn take(&mut self, frame: &SampleFrame) {
        let Listening::Busy(count) = self.progress else {
            return;
        };
        let ahead = frame.sequence.wrapping_sub(self.listen.from);
        if ahead > u32::MAX / 2 {
            // an answer to a setpoint before the first one that counts
            return;
        }
        let parts = frame.acceleration_mm_s2.iter().zip(self.listen.direction);
        let sample: f32 = parts.map(|(value, share)| value * share).sum();
        if count > 0 {
            self.lost = self.lost.saturating_add(ahead);
            if ahead > LOST_IN_A_ROW || self.lost > LOST_AT_ALL {
                self.progress = Listening::Torn;
                return;
            }
            let step = (sample - self.last) / (ahead + 1) as f32;
            for place in 1..=ahead {
                self.record.push(self.last + place as f32 * step);
            }
        }
        self.record.push(sample);
        self.last = sample;
        self.listen.from = frame.sequence.wrapping_add(1);
        self.progress = Listening::Busy(count.saturating_add(1));
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
            direction: [0.6, 0.8, 0.0],
        });
        listener
    }

    #[test]
    fn the_record_begins_with_the_tick_that_is_wanted() {
        let mut listener = listening();
        for sequence in 40..1099 {
            listener.hear(&sample(sequence).encode());
            let count = u16::try_from(sequence.saturating_sub(99)).unwrap();
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
