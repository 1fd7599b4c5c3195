//! Frequency and damping of a mode from a record of its free decay.
//!
//! | step | |
//! |---|---|
//! | [`Listener`] | takes the frames of an accelerometer or of the drives, from a certain tick on |
//! | [`Record`] | thins the samples out as they arrive |
//! | `scan` | finds where to begin, over windows of four lengths |
//! | `decay` | fits one mode; what it leaves is scanned again, and two modes are fitted |
//! | `noise` | says what is left |
//! | `mode` | says what is to be believed, and how much |
//!
//! The scan is that of \[vNoorden21\] as the project knows it. Where that goes on with logarithms
//! of a heterodyned signal, this fits the decays themselves: it is cheaper, it needs no band
//! between two modes, and with white noise it comes close to the Cramér-Rao bound, which no
//! estimate without prior knowledge beats.

mod decay;
mod listener;
mod mode;
mod noise;
mod record;
mod refusal;
mod scan;
mod triangle;

use core::f32::consts::TAU;

use heapless::Vec;

pub use decay::{Complex, Decay};
pub use listener::{LISTENING_S, Listen, Listener, Listening, Signal};
pub use mode::{DAMPING_WITHIN, FREQUENCY_WITHIN, IdentifiedMode, LEAST_CONFIDENCE, MODES};
pub use record::{CAPACITY, LONGEST_S, Record, SHORTEST_S};
pub use refusal::Refusal;

use crate::math::sqrt_f32;
use decay::{Fit, Model};
use mode::{believed_modes, found};
use noise::Noise;
use scan::Peak;

/// What a mode has to take off the squares, in variances of the noise. The highest of the 200
/// frequencies that a second of pure noise resolves takes off `2 ln 200` = 11 of them.
const SIGNIFICANT: f32 = 40.0;

// The parts are kept out of line, so that one's triangles are not on the stack while another works.

/// What a record shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Identified {
    /// The modes, one or two, the one of the larger amplitude first.
    pub modes: Vec<IdentifiedMode, MODES>,
    /// The constant under them, in the unit of the record.
    pub offset: f32,
    /// RMS of what they leave of the samples kept, in the unit of the record.
    pub residual: f32,
}

impl Identified {
    /// What the fit says of this time after the record's first sample.
    #[must_use]
    pub fn at(&self, time_s: f32) -> f32 {
        let modes = self.modes.iter();
        self.offset + modes.map(|mode| mode.decay.at(time_s)).sum::<f32>()
    }
}

/// Modes from a record of their free decay.
///
/// Frequencies from 1.2 to 100 Hz, damping ratios up to 0.3. What swings faster than 125 Hz
/// folds back, so the sensor must not pass it. The record is used up: it is empty afterwards.
///
/// # Errors
///
/// Nothing is given that cannot be believed, and the error says why.
pub fn identify(record: &mut Record) -> Result<Identified, Refusal> {
    let length_s = record.length_s();
    if length_s < SHORTEST_S {
        return Err(refusal::too_short(length_s));
    }
    let period_s = record.period_s();
    let group = record.group();
    let (samples, mean) = record.centred();
    let total: f32 = samples.iter().map(|sample| sample * sample).sum();
    if total <= mean * mean * 1e-10 {
        return Err(Refusal::Flat);
    }

    let rate = |peak: &Peak| start_rate(peak, length_s);
    let one = scan::highest_peak(samples, period_s);
    let one = Fit::new(Model::at_rates([rate(&one)]), samples, period_s);
    one.model.add_to(samples, period_s, -1.0);
    let second = scan::highest_peak(samples, period_s);
    one.model.add_to(samples, period_s, 1.0);
    let [first] = one.model.decays;
    let two = Model::at_rates([first.rate, rate(&second)]);
    let two = Fit::new(two, samples, period_s);

    let is_two = one.squares - two.squares > SIGNIFICANT * two.noise_variance(samples.len());
    let (found, offset, noise) = if is_two {
        let noise = Noise::of(&two, samples, period_s);
        (found(&two, &noise, group), two.model.offset, noise)
    } else {
        let noise = Noise::of(&one, samples, period_s);
        (found(&one, &noise, group), one.model.offset, noise)
    };
    let residual = sqrt_f32(noise.squares / samples.len() as f32);
    let stands_out = total - noise.squares > SIGNIFICANT * noise.variance;
    let is_clipped = (found.iter()).any(|found| record.is_clipped(found.frequency_hz));
    record.clear();
    if !stands_out {
        return Err(Refusal::OnlyNoise);
    }
    if is_clipped {
        return Err(Refusal::Clipped);
    }
    Ok(Identified {
        modes: believed_modes(&found, length_s)?,
        offset: offset + mean,
        residual,
    })
}

/// The rate to begin with: what stands out over a part of the record dies away within it.
fn start_rate(peak: &Peak, length_s: f32) -> Complex {
    let decrease = if peak.window < 1.0 { 1.2 } else { 0.5 };
    [
        -decrease / (peak.window * length_s),
        peak.frequency_hz * TAU,
    ]
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec as List;

    /// A decay in `f64`: amplitude, frequency, damping, phase.
    #[derive(Clone, Copy, Debug)]
    struct Swing(f64, f64, f64, f64);

    impl Swing {
        fn at(self, time_s: f64) -> f64 {
            let Self(amplitude, frequency_hz, damping, phase) = self;
            let turn = core::f64::consts::TAU * frequency_hz;
            let damped = turn * (1.0 - damping * damping).sqrt();
            amplitude * (-damping * turn * time_s).exp() * (damped * time_s + phase).cos()
        }
    }

    /// The sum of swings and a constant, at 1 kHz.
    fn samples(length_s: f64, offset: f64, swings: &[Swing]) -> List<f64> {
        (0..(length_s * 1000.0) as u32)
            .map(|at| f64::from(at) * 1e-3)
            .map(|time_s| offset + swings.iter().map(|swing| swing.at(time_s)).sum::<f64>())
            .collect()
    }

    fn identified(samples: &[f64]) -> Result<Identified, Refusal> {
        let mut record = Record::new();
        for &sample in samples {
            record.push(sample as f32);
        }
        identify(&mut record)
    }

    /// Evenly distributed in ±1.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1 << 30) - 1.0
        }
    }

    proptest! {
        /// Without noise two modes are told apart, whatever the unit and the offset. Where the first
        /// one has died down before it has left the second one behind, the fit may stop earlier.
        #[test]
        fn two_clean_modes_are_found(
            frequency_hz in 2.0..40.0,
            damping in 3e-4..0.06,
            ratio in 1.25..2.2,
            second_damping in 3e-4..0.05,
            second in 0.1..0.5,
            phases in [0.0..core::f64::consts::TAU, 0.0..core::f64::consts::TAU],
            unit in prop_oneof![Just(1e-3), Just(1.0), Just(1e5)],
            offset in -1.0..1.0,
            length_s in 1.0..2.0,
        ) {
            let first = Swing(unit, frequency_hz, damping, phases[0]);
            let other = Swing(unit * second, frequency_hz * ratio, second_damping, phases[1]);
            let found = identified(&samples(length_s, unit * offset, &[first, other])).unwrap();
            prop_assert_eq!(found.modes.len(), 2);
            let offset_error: f64 = f64::from(found.offset) / unit - offset;
            prop_assert!(offset_error.abs() < 1e-3);
            for (mode, Swing(amplitude, frequency_hz, damping, _)) in found.modes.iter().zip([first, other]) {
                prop_assert!((f64::from(mode.frequency_hz) / frequency_hz - 1.0).abs() < 5e-4);
                prop_assert!((f64::from(mode.damping) - damping).abs() < 5e-4);
                prop_assert!((f64::from(mode.amplitude()) / amplitude - 1.0).abs() < 0.02);
                prop_assert!(mode.confidence > 0.99);
            }
        }
    }

    #[test]
    fn the_fit_is_the_record() {
        let swings = [Swing(100.0, 7.0, 0.02, 1.0), Swing(20.0, 11.0, 0.01, 2.0)];
        let all = samples(1.5, 30.0, &swings);
        let found = identified(&all).unwrap();
        for (at, sample) in all.iter().enumerate() {
            let fit = found.at(at as f32 * 1e-3);
            assert!(
                (f64::from(fit) - sample).abs() < 0.05,
                "{at}: {fit}, {sample}"
            );
        }
        assert!(found.residual < 0.05);
    }

    #[test]
    fn a_short_record_is_enough_for_a_fast_mode_and_not_for_a_slow_one() {
        let mode = |frequency_hz| [Swing(1.0, frequency_hz, 0.01, 1.0)];
        let found = identified(&samples(0.26, 0.0, &mode(20.0))).unwrap();
        assert!((found.modes[0].frequency_hz / 20.0 - 1.0).abs() < 1e-3);
        for (length_s, frequency_hz) in [(0.2, 20.0), (0.3, 2.0)] {
            let refusal = identified(&samples(length_s, 0.0, &mode(frequency_hz)));
            assert!(
                matches!(refusal, Err(Refusal::TooShort { .. })),
                "{refusal:?}"
            );
        }
    }

    #[test]
    fn nothing_is_found_where_nothing_is() {
        assert_eq!(identified(&[5.0; 1000]), Err(Refusal::Flat));
        let mut noise = noise();
        for _ in 0..500 {
            let only_noise: List<_> = (0..1000).map(|_| noise()).collect();
            assert_eq!(identified(&only_noise), Err(Refusal::OnlyNoise));
        }
    }

    #[test]
    fn a_random_walk_is_not_believed() {
        let mut noise = noise();
        let mut believed = 0;
        for _ in 0..200 {
            let mut position = 0.0;
            let walk: List<_> = (0..1500)
                .map(|_| {
                    position += noise();
                    position
                })
                .collect();
            believed += u32::from(identified(&walk).is_ok());
        }
        assert!(believed <= 2, "{believed}");
    }

    #[test]
    fn a_hum_and_a_growing_swing_are_refused() {
        let mut noise = noise();
        for damping in [0.0, -0.01] {
            let mut hum = samples(2.0, 0.0, &[Swing(1.0, 12.0, damping, 1.0)]);
            hum.iter_mut().for_each(|sample| *sample += 0.02 * noise());
            let refusal = identified(&hum);
            let Err(Refusal::NotDecaying { frequency_hz }) = refusal else {
                panic!("{refusal:?}");
            };
            assert!((frequency_hz - 12.0).abs() < 0.01);
        }
    }

    #[test]
    fn a_drift_is_no_swing() {
        let creep: List<_> = (0..1500).map(|at| (-f64::from(at) / 200.0).exp()).collect();
        let refusal = identified(&creep);
        assert!(
            matches!(refusal, Err(Refusal::NoSwing { .. })),
            "{refusal:?}"
        );
    }

    #[test]
    fn a_swing_beside_a_hum_is_found() {
        let swings = [Swing(1.0, 6.34, 0.022, 1.0), Swing(2.0, 50.0, 0.0, 0.0)];
        let found = identified(&samples(2.0, 0.0, &swings)).unwrap();
        assert_eq!(found.modes.len(), 1);
        assert!((found.modes[0].frequency_hz - 6.34).abs() < 0.01);
    }

    #[test]
    fn cut_crests_are_refused_and_coarse_ones_are_not() {
        let clean = samples(1.5, 3.0, &[Swing(100.0, 6.34, 0.01, 1.0)]);
        for range in [50.0, 60.0, 80.0, 90.0] {
            let cut: List<_> = clean
                .iter()
                .map(|sample| sample.clamp(-range, range))
                .collect();
            assert_eq!(identified(&cut), Err(Refusal::Clipped), "{range}");
            let cut: List<_> = clean.iter().map(|sample| sample.min(range)).collect();
            assert_eq!(identified(&cut), Err(Refusal::Clipped), "{range}");
        }
        for step in [0.01, 0.1, 1.0, 5.0] {
            let coarse: List<_> =
                (clean.iter().map(|sample| (sample / step).round() * step)).collect();
            let found = identified(&coarse).unwrap();
            assert!((found.modes[0].frequency_hz - 6.34).abs() < 0.01, "{step}");
        }
    }

    #[test]
    fn too_much_noise_is_refused_with_its_uncertainty() {
        let mut noise = noise();
        let mut noisy = samples(1.0, 0.0, &[Swing(1.0, 3.0, 0.08, 1.0)]);
        noisy.iter_mut().for_each(|sample| *sample += 1.5 * noise());
        let refusal = identified(&noisy);
        assert!(
            matches!(refusal, Err(Refusal::Uncertain { .. })),
            "{refusal:?}"
        );
    }
}
