//! Where a record's energy is: a coarse spectrum over several window lengths.

use crate::math::sin_cos_f32;

/// Lowest frequency looked for, in Hz.
const LOWEST_HZ: f32 = 1.2;

/// Highest frequency looked for, in Hz: a second mode at 2.2 times 45 Hz. Within 0.4 of the
/// sampling rate in any case.
const HIGHEST_HZ: f32 = 100.0;
const HIGHEST_CYCLES: f32 = 0.4;

/// Windows, all from the record's beginning: 1, 1/2, 1/4 and 1/8 of it. A mode of light damping
/// stands out over the whole record, one of heavy damping only while it lasts.
const WINDOWS: u32 = 4;

/// Shortest window, in samples.
const LEAST_SAMPLES: usize = 16;

/// From one frequency to the next, in reciprocal window lengths.
const STEP: f32 = 0.5;

/// Frequencies at a time, so that each sample is read once for all of them.
const AT_ONCE: usize = 4;

/// Where to begin fitting a mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Frequency in Hz, to a quarter of the reciprocal window length; half of it where the
    /// window has less than three periods.
    pub frequency_hz: f32,
    /// The part of the record over which it stands out most: 1, 1/2, 1/4 or 1/8.
    pub window: f32,
    /// What a sinusoid over that part takes off the record's sum of squares.
    pub energy: f32,
}

/// The frequency and the window whose sinusoid takes most off the sum of squares of the
/// `samples`, by Goertzel's recursion.
#[inline(never)]
pub fn highest_peak(samples: &[f32], period_s: f32) -> Peak {
    let mut highest = Peak {
        frequency_hz: LOWEST_HZ,
        window: 1.0,
        energy: 0.0,
    };
    for halvings in 0..WINDOWS {
        let (samples, _) = samples.split_at(samples.len() >> halvings);
        if samples.len() < LEAST_SAMPLES {
            break;
        }
        let count = samples.len() as f32;
        let mean = samples.iter().sum::<f32>() / count;
        let step_hz = STEP / (count * period_s);
        let top_hz = HIGHEST_HZ.min(HIGHEST_CYCLES / period_s);
        let mut first_hz = LOWEST_HZ.max(step_hz);
        while first_hz <= top_hz {
            let frequencies_hz: [f32; AT_ONCE] =
                core::array::from_fn(|place| first_hz + place as f32 * step_hz);
            let squares = goertzel(samples, mean, frequencies_hz.map(|hz| hz * period_s));
            for (frequency_hz, square) in frequencies_hz.into_iter().zip(squares) {
                let energy = square * 2.0 / count;
                if energy > highest.energy {
                    highest = Peak {
                        frequency_hz,
                        window: 1.0 / (1 << halvings) as f32,
                        energy,
                    };
                }
            }
            first_hz += AT_ONCE as f32 * step_hz;
        }
    }
    highest
}

/// `|Σ (x - mean) e^(-iωn)|²`, `ω` in cycles a sample, below 1/2.
fn goertzel(samples: &[f32], mean: f32, cycles: [f32; AT_ONCE]) -> [f32; AT_ONCE] {
    let twice_cos = cycles.map(|cycles| 2.0 * sin_cos_f32(cycles * core::f32::consts::TAU).1);
    let mut last = [0.0; AT_ONCE];
    let mut before = [0.0; AT_ONCE];
    for sample in samples {
        let sample = sample - mean;
        for place in 0..AT_ONCE {
            let next = sample + twice_cos[place] * last[place] - before[place];
            before[place] = last[place];
            last[place] = next;
        }
    }
    core::array::from_fn(|place| {
        let (last, before) = (last[place], before[place]);
        last * last + before * before - twice_cos[place] * last * before
    })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn decay(frequency_hz: f64, damping: f64) -> Vec<f32> {
        let turn = core::f64::consts::TAU * frequency_hz;
        (0..375)
            .map(|at| f64::from(at) * 0.004)
            .map(|t| ((-damping * turn * t).exp() * (turn * t + 1.0).sin()) as f32)
            .collect()
    }

    #[test]
    fn the_peak_is_next_to_the_mode() {
        for frequency_hz in [2.0, 3.3, 6.34, 12.3, 39.9, 59.0, 88.0] {
            for damping in [3e-4, 0.005, 0.02, 0.1] {
                let samples = decay(frequency_hz, damping);
                let peak = highest_peak(&samples, 0.004);
                // Below three periods in the window, what turns the other way shifts it further.
                let window_s = 1.5 * f64::from(peak.window);
                let error = (f64::from(peak.frequency_hz) - frequency_hz).abs() * window_s;
                let bound = if window_s * frequency_hz < 3.0 {
                    0.5
                } else {
                    0.26
                };
                assert!(
                    error < bound,
                    "{frequency_hz} Hz, damping {damping}: {peak:?}"
                );
            }
        }
    }

    #[test]
    fn heavy_damping_stands_out_in_a_short_window() {
        assert_eq!(highest_peak(&decay(20.0, 5e-4), 0.004).window, 1.0);
        assert_eq!(highest_peak(&decay(20.0, 0.1), 0.004).window, 0.125);
    }

    #[test]
    fn goertzel_is_the_fourier_sum() {
        let samples = decay(7.0, 0.01);
        let cycles = [0.01, 0.03, 0.1, 0.39];
        for (square, cycles) in goertzel(&samples, 0.1, cycles).into_iter().zip(cycles) {
            let (mut re, mut im) = (0.0, 0.0);
            for (at, sample) in samples.iter().enumerate() {
                let (sin, cos) = (core::f64::consts::TAU * f64::from(cycles) * at as f64).sin_cos();
                re += (f64::from(*sample) - 0.1) * cos;
                im += (f64::from(*sample) - 0.1) * sin;
            }
            let exact = re * re + im * im;
            assert!(
                (f64::from(square) / exact - 1.0).abs() < 1e-3,
                "{cycles}: {square} {exact}"
            );
        }
    }
}
