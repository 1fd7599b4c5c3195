//! A record of a free decay, thinned out as it arrives.

use heapless::Vec;

use super::refusal::Refusal;

/// Longest record, in s. What comes later is left out.
pub const LONGEST_S: f32 = 2.0;

/// Shortest record, in s.
pub const SHORTEST_S: f32 = 0.25;

/// Lowest sampling rate, in Hz.
pub const LOWEST_RATE_HZ: f32 = 100.0;

/// Highest sampling rate, in Hz.
pub const HIGHEST_RATE_HZ: f32 = 20_000.0;

/// What a record is thinned out to: four samples of 1 kHz become one. Modes up to 100 Hz stay.
const KEPT_RATE_HZ: f32 = 250.0;

/// Samples kept at the most.
pub const CAPACITY: usize = (LONGEST_S * KEPT_RATE_HZ) as usize;

/// Equal samples in a row that count as flat.
const FLAT_SAMPLES: u32 = 4;

/// A crest is cut if it is flat for longer than this many steps of its resolution explain.
const STEPS_OF_A_FLAT: f32 = 6.0;

/// An extreme of the samples as they arrived.
#[derive(Clone, Copy, Debug)]
struct Extreme {
    value: f32,
    /// The nearest other value, which shows the resolution.
    next: f32,
    run: u32,
    longest_run: u32,
}

impl Extreme {
    const NONE: Self = Self {
        value: f32::NEG_INFINITY,
        next: f32::NEG_INFINITY,
        run: 0,
        longest_run: 0,
    };

    fn see(&mut self, sample: f32) {
        if sample > self.value {
            *self = Self {
                value: sample,
                next: self.value,
                run: 1,
                longest_run: 1,
            };
        } else if sample < self.value {
            self.run = 0;
            self.next = self.next.max(sample);
        } else {
            self.run += 1;
            self.longest_run = self.longest_run.max(self.run);
        }
    }
}

/// A record of a free decay: from 0.25 to 2 s of an acceleration, or of any other quantity that
/// swings with the mode.
///
/// It keeps means of as many samples as make 250 Hz of the sampling rate, which leaves every
/// decay with its frequency and damping as they are; 2 KiB.
#[derive(Clone, Debug)]
pub struct Record {
    kept: Vec<f32, CAPACITY>,
    rate_hz: f32,
    /// Samples to each one kept.
    group: u32,
    /// Sum of the group under way, and how many are in it.
    sum: f32,
    in_group: u32,
    highest: Extreme,
    /// Of the samples' negatives.
    lowest: Extreme,
}

impl Record {
    /// A record at 1 kHz with nothing in it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            kept: Vec::new(),
            rate_hz: 1000.0,
            group: 4,
            sum: 0.0,
            in_group: 0,
            highest: Extreme::NONE,
            lowest: Extreme::NONE,
        }
    }

    /// A record at another sampling rate, 100 Hz to 20 kHz.
    ///
    /// # Errors
    ///
    /// The rate is outside that range.
    pub fn at_rate(rate_hz: f32) -> Result<Self, Refusal> {
        if !(LOWEST_RATE_HZ..=HIGHEST_RATE_HZ).contains(&rate_hz) {
            return Err(Refusal::Rate { rate_hz });
        }
        Ok(Self {
            rate_hz,
            group: libm::roundf(rate_hz / KEPT_RATE_HZ).max(1.0) as u32,
            ..Self::new()
        })
    }

    /// Adds a sample, a finite number; the first ones decide if there are too many.
    pub fn push(&mut self, sample: f32) {
        if self.is_full() {
            return;
        }
        self.highest.see(sample);
        self.lowest.see(-sample);
        self.sum += sample;
        self.in_group += 1;
        if self.in_group == self.group {
            let mean = self.sum / self.group as f32;
            let pushed = self.kept.push(mean);
            debug_assert!(pushed.is_ok());
            self.sum = 0.0;
            self.in_group = 0;
        }
    }

    /// Forgets the samples, and keeps the rate.
    pub fn clear(&mut self) {
        self.kept.clear();
        self.sum = 0.0;
        self.in_group = 0;
        self.highest = Extreme::NONE;
        self.lowest = Extreme::NONE;
    }

    /// Whether it is as long as it can be.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.kept.is_full()
    }

    /// Its length in s.
    #[must_use]
    pub fn length_s(&self) -> f32 {
        self.kept.len() as f32 * self.period_s()
    }

    /// What is kept of the record, a sample each [`Record::period_s`], the first one the mean of
    /// the first group.
    #[must_use]
    pub fn samples(&self) -> &[f32] {
        &self.kept
    }

    /// Time from one sample kept to the next, in s.
    #[must_use]
    pub fn period_s(&self) -> f32 {
        self.group as f32 / self.rate_hz
    }

    /// Samples to each one kept, and the time from one to the next in s.
    pub(super) fn group(&self) -> (u32, f32) {
        (self.group, 1.0 / self.rate_hz)
    }

    /// The samples with their mean taken off, and that mean.
    pub(super) fn centred(&mut self) -> (&mut [f32], f32) {
        let mean = self.kept.iter().sum::<f32>() / (self.kept.len().max(1)) as f32;
        for sample in &mut self.kept {
            *sample -= mean;
        }
        (&mut self.kept, mean)
    }

    /// Whether the crests of a mode of this frequency are cut off: flat at the record's highest or
    /// lowest value, by more than the samples' resolution explains.
    pub(super) fn is_clipped(&self, frequency_hz: f32) -> bool {
        let amplitude = 0.5 * (self.highest.value + self.lowest.value);
        [&self.highest, &self.lowest].into_iter().any(|extreme| {
            // A crest that is flat for so long has lost A (1 - cos φ), φ its half width.
            let flat_s = extreme.longest_run.saturating_sub(1) as f32 / self.rate_hz;
            let half_width = (core::f32::consts::PI * frequency_hz * flat_s).min(1.5);
            let (_, cos) = crate::math::sin_cos_f32(half_width);
            let resolution = extreme.value - extreme.next;
            extreme.longest_run >= FLAT_SAMPLES
                && amplitude * (1.0 - cos) > STEPS_OF_A_FLAT * resolution
        })
    }
}

impl Default for Record {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_become_their_means_and_the_rest_is_left_out() {
        let mut record = Record::new();
        for sample in 0..10_u8 {
            record.push(sample.into());
        }
        assert_eq!(record.samples(), [1.5, 5.5]);
        assert_eq!(record.length_s(), 0.008);
        for _ in 0..3000 {
            record.push(1.0);
        }
        assert!(record.is_full());
        assert_eq!(record.length_s(), LONGEST_S);
        record.clear();
        assert!(record.samples().is_empty());
    }

    #[test]
    fn other_rates_are_thinned_out_likewise() {
        for (rate_hz, group) in [
            (100.0, 1),
            (250.0, 1),
            (500.0, 2),
            (1000.0, 4),
            (8000.0, 32),
        ] {
            let record = Record::at_rate(rate_hz).unwrap();
            assert_eq!(record.group().0, group);
            assert!((record.period_s() - group as f32 / rate_hz).abs() < 1e-9);
        }
        for rate_hz in [50.0, 1e6, f32::NAN] {
            assert!(matches!(
                Record::at_rate(rate_hz),
                Err(Refusal::Rate { .. })
            ));
        }
    }

    #[test]
    fn it_takes_little_memory() {
        assert!(size_of::<Record>() <= 2100);
    }
}
