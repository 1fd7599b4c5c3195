//! From a fit to modes that can be believed.

use core::f32::consts::{SQRT_2, TAU};

use heapless::Vec;

use crate::math::sqrt_f32;
use crate::sort::sort_by;

use super::decay::{Complex, Decay, Fit, exponential, product, quotient};
use super::noise::Noise;
use super::refusal::Refusal;

/// Modes at the most.
pub const MODES: usize = 2;

/// Relative error of the frequency within which an estimate counts as right.
pub const FREQUENCY_WITHIN: f32 = 0.005;

/// Error of the damping ratio within which an estimate counts as right.
pub const DAMPING_WITHIN: f32 = 0.005;

/// Least confidence of an estimate that is given.
pub const LEAST_CONFIDENCE: f32 = 0.15;

/// Damping ratio above which there is no swing, but a drift.
const MOST_DAMPING: f32 = 0.3;

/// Damping ratio that a decay has to reach, its uncertainty (three standard deviations) included.
const LEAST_DAMPING: f32 = 2e-4;

/// Periods that a record has to last.
const LEAST_PERIODS: f32 = 1.0;

/// A mode that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdentifiedMode {
    /// Natural frequency (undamped) in Hz.
    pub frequency_hz: f32,
    /// Damping ratio, 0 or more.
    pub damping: f32,
    /// 0 to 1: the probability that the frequency is right within 0.5 % and the damping ratio
    /// within 0.005, if what the fit leaves is noise.
    pub confidence: f32,
    /// The decay, from the record's first sample on.
    pub decay: Decay,
}

impl IdentifiedMode {
    /// Amplitude at the record's first sample, in the unit of the record.
    #[must_use]
    pub fn amplitude(&self) -> f32 {
        length(self.decay.amplitude)
    }
}

/// A decay and how well it is known.
#[derive(Clone, Copy)]
pub struct Found {
    decay: Decay,
    /// Natural frequency in Hz.
    pub frequency_hz: f32,
    damping: f32,
    /// Relative.
    frequency_deviation: f32,
    damping_deviation: f32,
}

/// The decays of a fit, the largest first. `group`: how many samples each one kept is the mean
/// of, and the time between them.
pub fn found<const N: usize>(
    fit: &Fit<N>,
    noise: &Noise,
    (group, sample_s): (u32, f32),
) -> Vec<Found, MODES> {
    let mut all = Vec::<Found, MODES>::new();
    for (decay, variances) in fit.model.decays.iter().zip(fit.variances) {
        // The mean of a group is a multiple of its first sample.
        let mut mean = [0.0; 2];
        let mut at = [1.0, 0.0];
        for _ in 0..group {
            mean = [mean[0] + at[0], mean[1] + at[1]];
            at = product(at, exponential(decay.rate, sample_s));
        }
        let mean = mean.map(|part| part / group as f32);
        let turn = length(decay.rate);
        let variance = noise.variance_at(decay.rate[1]);
        let [deviation_re, deviation_im] = variances.map(|part| sqrt_f32(part * variance));
        let found = Found {
            decay: Decay {
                rate: decay.rate,
                amplitude: quotient(decay.amplitude, mean),
            },
            frequency_hz: turn / TAU,
            damping: -decay.rate[0] / turn,
            frequency_deviation: deviation_im / turn,
            damping_deviation: deviation_re / turn,
        };
        let pushed = all.push(found);
        debug_assert!(pushed.is_ok());
    }
    sort_by(&mut all, |one, other| {
        length(one.decay.amplitude) > length(other.decay.amplitude)
    });
    all
}

/// The modes among the decays, one at least.
///
/// A drift or a hum beside a mode is left out, however large. A larger mode that is uncertain is
/// not: the smaller one would pass for it.
pub fn believed_modes(
    found: &[Found],
    length_s: f32,
) -> Result<Vec<IdentifiedMode, MODES>, Refusal> {
    let mut modes = Vec::new();
    let mut refusal = None;
    for found in found {
        match believed(found, length_s) {
            Ok(mode) => {
                let pushed = modes.push(mode);
                debug_assert!(pushed.is_ok());
            }
            Err(why) => {
                refusal = refusal.or(Some(why));
                if !matches!(why, Refusal::NoSwing { .. } | Refusal::NotDecaying { .. }) {
                    break;
                }
            }
        }
    }
    if modes.is_empty() {
        return Err(refusal.unwrap_or(Refusal::OnlyNoise));
    }
    Ok(modes)
}

/// A decay as a mode, if it is one.
fn believed(found: &Found, length_s: f32) -> Result<IdentifiedMode, Refusal> {
    let &Found {
        decay,
        frequency_hz,
        damping,
        frequency_deviation,
        damping_deviation,
    } = found;
    if damping > MOST_DAMPING {
        return Err(Refusal::NoSwing { damping });
    }
    if length_s * frequency_hz < LEAST_PERIODS {
        return Err(Refusal::TooShort {
            length_s,
            wanted_s: LEAST_PERIODS / frequency_hz,
        });
    }
    if damping + 3.0 * damping_deviation < LEAST_DAMPING {
        return Err(Refusal::NotDecaying { frequency_hz });
    }
    let confidence = probability_within(FREQUENCY_WITHIN, frequency_deviation)
        * probability_within(DAMPING_WITHIN, damping_deviation);
    // A NaN is no confidence either.
    if confidence.is_nan() || confidence < LEAST_CONFIDENCE {
        return Err(Refusal::Uncertain {
            frequency_deviation,
            damping_deviation,
        });
    }
    Ok(IdentifiedMode {
        frequency_hz,
        damping: damping.max(0.0),
        confidence,
        decay,
    })
}

/// That a normal error of this standard deviation stays within a bound.
fn probability_within(bound: f32, deviation: f32) -> f32 {
    if deviation > 0.0 {
        libm::erff(bound / (SQRT_2 * deviation))
    } else {
        1.0
    }
}

fn length(number: Complex) -> f32 {
    sqrt_f32(number[0] * number[0] + number[1] * number[1])
}
