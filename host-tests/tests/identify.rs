//! Identification over records that it has not seen: how often frequency and damping are right,
//! and whether the confidence keeps its promise.

use std::f64::consts::TAU;

use planner_core::identify::{
    DAMPING_WITHIN, FREQUENCY_WITHIN, IdentifiedMode, Record, Refusal, identify,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Records of each series.
const RECORDS: u32 = 200;

/// Series, each from a seed of its own.
const SEEDS: u64 = 5;

/// Where the second mode is.
#[derive(Clone, Copy, Debug)]
enum Second {
    Above,
    Below,
    None,
}

/// A record's first mode, with the samples at 1 kHz.
struct Case {
    frequency_hz: f64,
    damping: f64,
    samples: Vec<f64>,
}

impl Case {
    /// 1 to 2 s; a mode of 2 to 40 Hz, damping 0.0003 to 0.1, amplitude 1; an offset up to that;
    /// a second mode of 5 to 30 % of it at 1.25 to 2.2 times the frequency, or its reciprocal.
    fn random(rng: &mut ChaCha8Rng, second: Second, noise: f64) -> Self {
        let frequency_hz = between_logarithms(rng, 2.0, 40.0);
        let damping = between_logarithms(rng, 3e-4, 0.1);
        let ratio: f64 = rng.random_range(1.25..2.2);
        let (second_hz, second_amplitude) = match second {
            Second::Above => (frequency_hz * ratio, rng.random_range(0.05..0.3)),
            Second::Below => (frequency_hz / ratio, rng.random_range(0.05..0.3)),
            Second::None => (frequency_hz, 0.0),
        };
        let second_damping = rng.random_range(0.003..0.05);
        let phases = [rng.random_range(0.0..TAU), rng.random_range(0.0..TAU)];
        let offset = rng.random_range(-1.0..1.0);
        let length_s = rng.random_range(1.0..2.0);
        let samples = (0..(length_s * 1000.0) as u32)
            .map(|at| {
                let time_s = f64::from(at) * 1e-3;
                offset
                    + swing(frequency_hz, damping, phases[0], time_s)
                    + second_amplitude * swing(second_hz, second_damping, phases[1], time_s)
                    + noise * normal(rng)
            })
            .collect();
        Self {
            frequency_hz,
            damping,
            samples,
        }
    }

    fn identified(&self) -> Result<IdentifiedMode, Refusal> {
        let mut record = Record::new();
        for &sample in &self.samples {
            record.push((1000.0 * sample) as f32);
        }
        identify(&mut record).map(|found| found.modes[0])
    }

    /// Relative error of the frequency, and error of the damping ratio.
    fn errors(&self, mode: &IdentifiedMode) -> (f64, f64) {
        (
            (f64::from(mode.frequency_hz) / self.frequency_hz - 1.0).abs(),
            (f64::from(mode.damping) - self.damping).abs(),
        )
    }
}

/// A free decay of amplitude 1.
fn swing(frequency_hz: f64, damping: f64, phase: f64, time_s: f64) -> f64 {
    let turn = TAU * frequency_hz;
    (-damping * turn * time_s).exp()
        * (turn * (1.0 - damping * damping).sqrt() * time_s + phase).cos()
}

fn between_logarithms(rng: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    rng.random_range(from.ln()..to.ln()).exp()
}

/// Normally distributed, standard deviation 1 (Box, Muller).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * rng.random_range(f64::MIN_POSITIVE..1.0).ln()).sqrt();
    radius * (TAU * rng.random::<f64>()).cos()
}

/// In percent of a series' records: frequency within 0.5 %, damping within `damping_within`. A
/// record that is refused is right in neither.
fn right(seed: u64, second: Second, noise: f64, damping_within: f64) -> (f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut frequency, mut damping) = (0, 0);
    for _ in 0..RECORDS {
        let case = Case::random(&mut rng, second, noise);
        if let Ok(mode) = case.identified() {
            let errors = case.errors(&mode);
            frequency += u32::from(errors.0 <= 0.005);
            damping += u32::from(errors.1 <= damping_within);
        }
    }
    let percent = |count: u32| f64::from(100 * count) / f64::from(RECORDS);
    (percent(frequency), percent(damping))
}

#[test]
fn at_2_percent_noise_every_frequency_is_right_and_nearly_every_damping() {
    for second in [Second::Above, Second::Below, Second::None] {
        for seed in 0..SEEDS {
            let (frequency, damping) = right(seed, second, 0.02, 0.002);
            println!("{second:?}, seed {seed}: {frequency} %, {damping} %");
            assert_eq!(frequency, 100.0);
            assert!(damping >= 97.0);
        }
    }
}

#[test]
fn at_10_percent_noise_95_percent_are_right() {
    for second in [Second::Above, Second::Below, Second::None] {
        for seed in 0..SEEDS {
            let (frequency, damping) = right(seed, second, 0.1, 0.005);
            println!("{second:?}, seed {seed}: {frequency} %, {damping} %");
            assert!(frequency >= 95.0 && damping >= 95.0);
        }
    }
}

/// Of the records that got a confidence, about as many are right as it says, for the sure and for
/// the unsure.
#[test]
fn the_confidence_is_the_probability_of_being_right() {
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    // sum of the confidences, how many were right, how many there are
    let mut bins = [(0.0, 0, 0); 3];
    for _ in 0..4000 {
        let noise = between_logarithms(&mut rng, 0.1, 1.0);
        let case = Case::random(&mut rng, Second::None, noise);
        let Ok(mode) = case.identified() else {
            continue;
        };
        let (frequency, damping) = case.errors(&mode);
        let is_right =
            frequency <= f64::from(FREQUENCY_WITHIN) && damping <= f64::from(DAMPING_WITHIN);
        let bin = &mut bins[match mode.confidence {
            ..0.6 => 0,
            ..0.95 => 1,
            _ => 2,
        }];
        bin.0 += f64::from(mode.confidence);
        bin.1 += i32::from(is_right);
        bin.2 += 1;
    }
    for (confidences, right, count) in bins {
        let count = f64::from(count);
        let (promised, kept) = (confidences / count, f64::from(right) / count);
        println!("{count}: promised {promised:.3}, kept {kept:.3}");
        assert!(count > 300.0);
        assert!((promised - kept).abs() < 0.06, "{promised} {kept}");
    }
}
