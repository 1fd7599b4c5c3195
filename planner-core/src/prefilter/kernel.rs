//! The prefilter in machine units: integer taps whose sum is exactly a power of two.

use heapless::Vec;

use super::response::has_room_for;
use super::{Impulse, Impulses, MAX_STAGES, Mode, Prefilter, PrefilterError, Stage};
use crate::raw::{ONE_TICK, TickTime, tick_time};
use crate::units::{TICK_HZ, TICK_S};

/// Slots of a delay line, one a tick: prefilters of up to 1 s and two slots a stage for
/// fractional delays. A power of two, so that an index is masked and never out of bounds.
pub const SLOTS: usize = 1024;

/// Slots of half a delay line, for each of two filters that share it: prefilters of up to 0.5 s.
pub const HALF_SLOTS: usize = SLOTS / 2;

/// Weights count in 2^-30; those of a stage sum to exactly 2^30.
pub(super) const WEIGHT_BITS: u32 = 30;

/// A box of so many seconds averages away what the ticks make of a stop between them.
const LONG_BOX_S: f64 = 16.0 * TICK_S;

const ONE: f64 = (1_i64 << WEIGHT_BITS) as f64;

/// The weight of one delayed sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tap {
    /// Slot within the delay line, counted from the newest sample of the first stage.
    pub slot: u16,
    /// Delay within the stage in ticks.
    pub delay: u16,
    /// Weight in 2^-30.
    pub weight: i32,
}

/// Taps of a cascade: two modes, each with five impulses and a box, have 28.
const MAX_TAPS: usize = 28;

/// What a stage does with its taps, and how many they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Two impulses, at zero and one split over two ticks: three taps.
    Two,
    /// Three impulses, all but the first split over two ticks: five taps.
    Three,
    /// Four impulses, likewise: seven taps.
    Four,
    /// Five impulses, likewise: nine taps.
    Five,
    /// A box: five taps, which give its output's change, to be summed up.
    Box,
}

/// One stage in machine units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StageShape {
    /// Slot of the stage's newest sample.
    pub first_slot: u16,
    /// What it does with its taps.
    pub shape: Shape,
}

/// The mean delay of a stage, exactly that of the rounded weights.
///
/// ```text
/// shaper: Σ w_i d_i        box: Σ n Σ_{d_j ≤ n} c_j = −Σ c_j d_j (d_j − 1) / 2,   as Σ c_j = 0
/// ```
fn centroid(shape: Shape, taps: &[Tap]) -> TickTime {
    let moments = taps.iter().map(|tap| {
        let (delay, weight) = (i64::from(tap.delay), i64::from(tap.weight));
        if shape == Shape::Box {
            -weight * (delay * (delay - 1) / 2)
        } else {
            weight * delay
        }
    });
    moments.sum::<i64>() << (32 - WEIGHT_BITS)
}

/// A prefilter's taps for the tick.
///
/// Fractional delays are kept: rounding an impulse to the tick would leave 1.3 % of the
/// vibration at 12.3 Hz.
///
/// - **ZV**: taps at `0, d, d + 1` ticks with `d = ⌊T_d/2⌋`, solved for unit area and a zero
///   at the mode's pole. The null is exact at the sampling rate.
/// - **Impulses**: each split linearly over its two neighbouring ticks.
/// - **Box** of `N + f` ticks: the integral of the linearly interpolated input,
///
///   ```text
///   y = [½ x₀ + x₁ + … + x_{N−1} + (½ + f − f²/2) x_N + f²/2 x_{N+1}] / (N + f)
///   ```
///   run as a sum of changes, so that its cost does not depend on its length. It has exactly
///   the ramp response of the continuous box.
///
/// Weights are rounded so that they sum to exactly 2^30: at rest the output is the input,
/// bit for bit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kernel {
    pub(super) stages: Vec<StageShape, MAX_STAGES>,
    /// Those of all stages, in their order; the first one of each has no delay.
    pub(super) taps: Vec<Tap, MAX_TAPS>,
    length_ticks: u16,
    delay_ticks: u16,
    length: TickTime,
    has_long_box: bool,
    centroid: TickTime,
}

impl Kernel {
    /// No filter.
    pub const NONE: Self = Self {
        stages: Vec::new(),
        taps: Vec::new(),
        length_ticks: 0,
        delay_ticks: 0,
        length: 0,
        has_long_box: false,
        centroid: 0,
    };

    /// The taps of a prefilter.
    ///
    /// # Errors
    /// [`PrefilterError::TooLong`] if the filter does not fit the delay line,
    /// [`PrefilterError::TooManyKinks`] if its response has too many pieces.
    pub fn new(prefilter: &Prefilter) -> Result<Self, PrefilterError> {
        if !has_room_for(prefilter.stages()) {
            return Err(PrefilterError::TooManyKinks);
        }
        let too_long = PrefilterError::TooLong {
            length_s: prefilter.length_s() as f32,
        };
        let mut kernel = Self {
            length: tick_time(prefilter.length_s()),
            has_long_box: prefilter.longest_box_s().unwrap_or(0.0) >= LONG_BOX_S,
            ..Self::NONE
        };
        for stage in prefilter.stages() {
            if stage.length_s() > SLOTS as f64 * TICK_S {
                return Err(too_long);
            }
            let pushed = match stage {
                Stage::Zv(mode) => kernel.push(Shape::Two, &zv_weights(mode)),
                Stage::Impulses(list) => match list.len() {
                    0..=2 => kernel.push(Shape::Two, &impulse_weights::<3>(list)),
                    3 => kernel.push(Shape::Three, &impulse_weights::<5>(list)),
                    4 => kernel.push(Shape::Four, &impulse_weights::<7>(list)),
                    _ => kernel.push(Shape::Five, &impulse_weights::<9>(list)),
                },
                Stage::Box(length_s) => kernel.push(Shape::Box, &box_changes(*length_s)),
            };
            if pushed.is_none() || usize::from(kernel.length_ticks) > SLOTS {
                return Err(too_long);
            }
        }
        Ok(kernel)
    }

    /// Adds a stage whose first weight is that of delay 0; none if there is no room for it.
    fn push(&mut self, shape: Shape, weights: &[(u16, i32)]) -> Option<()> {
        let first_slot = self.length_ticks;
        let place = self.taps.len();
        for &(delay, weight) in weights {
            let slot = first_slot + delay;
            self.taps
                .push(Tap {
                    slot,
                    delay,
                    weight,
                })
                .ok()?;
        }
        self.stages.push(StageShape { first_slot, shape }).ok()?;
        let last_delay = weights.iter().map(|(delay, _)| *delay).max().unwrap_or(0);
        self.length_ticks += last_delay + 1;
        self.delay_ticks += last_delay;
        self.centroid += centroid(shape, self.taps.get(place..)?);
        Some(())
    }

    /// `T_h`.
    #[must_use]
    pub fn length(&self) -> TickTime {
        self.length
    }

    /// `m`, the mean delay: how far the output of a steady motion is behind. It is exactly that
    /// of the integer taps.
    #[must_use]
    pub fn centroid(&self) -> TickTime {
        self.centroid
    }

    /// How long the raw path stands at an exact stop, when it arrives `until_tick` before a tick.
    ///
    /// `T_h`; without a box of `LONG_BOX_S` long enough that the last impulse, which is split
    /// over two ticks, is over at the first tick on the next segment: until then the output is
    /// not quite at the corner.
    #[must_use]
    pub fn stop_time(&self, until_tick: TickTime) -> TickTime {
        let split = if self.has_long_box {
            0
        } else {
            until_tick + ONE_TICK * (TickTime::from(self.delay_ticks) - 1)
        };
        split.max(self.length)
    }

    /// How long after the raw path stands the output has settled to the last bit.
    #[must_use]
    pub fn settling_time(&self) -> TickTime {
        ONE_TICK * (TickTime::from(self.length_ticks) + 2)
    }

    /// Ticks by which the oldest input of the output is behind: an input that has been constant
    /// for longer *is* the output.
    #[must_use]
    pub fn delay_ticks(&self) -> u16 {
        self.delay_ticks
    }

    /// Ticks after which a constant input has reached the output everywhere.
    #[must_use]
    pub fn length_ticks(&self) -> u16 {
        self.length_ticks
    }
}

/// Rounds weights to 2^-30; the first takes up what rounding leaves of the sum.
fn rounded<const N: usize>(weights: [(u16, f64); N]) -> [(u16, i32); N] {
    let mut list = weights.map(|(delay, weight)| (delay, libm::round(weight * ONE) as i32));
    let sum: i32 = list.iter().map(|(_, weight)| weight).sum();
    if let Some((_, first)) = list.first_mut() {
        *first += (1 << WEIGHT_BITS) - sum;
    }
    list
}

/// Three taps `w₀ + w₁ z^{−d} + w₂ z^{−(d+1)}` with sum 1 and a zero at the pole
/// `z = e^{(−ζω + jω_d) T_s}`.
fn zv_weights(mode: &Mode) -> [(u16, i32); 3] {
    let d = libm::floor(mode.damped_period_s() / 2.0 * f64::from(TICK_HZ));
    let delayed = |ticks: f64| {
        let time_s = ticks * TICK_S;
        let size = libm::exp(mode.decay_per_s() * time_s);
        let angle = mode.damped_rad_s() * time_s;
        (size * libm::cos(angle), size * libm::sin(angle))
    };
    let (re1, im1) = delayed(d);
    let (re2, im2) = delayed(d + 1.0);
    // d is at most half a period and d + 1 more than half: im1 ≥ 0 > im2
    let w1 = -im2;
    let w2 = im1;
    let w0 = -(w1 * re1 + w2 * re2);
    let sum = w0 + w1 + w2;
    let d = d as u16;
    rounded([(0, w0 / sum), (d, w1 / sum), (d + 1, w2 / sum)])
}

/// The first impulse at zero, the others split linearly over two ticks; taps that are left
/// over weigh nothing.
fn impulse_weights<const TAPS: usize>(impulses: &Impulses) -> [(u16, i32); TAPS] {
    let split = |impulse: &Impulse| {
        let ticks = impulse.time_s * f64::from(TICK_HZ);
        let whole = libm::floor(ticks);
        let late = impulse.amplitude * (ticks - whole);
        let delay = whole as u16;
        [(delay, impulse.amplitude - late), (delay + 1, late)]
    };
    let first = impulses.first().map_or(1.0, |impulse| impulse.amplitude);
    let later = impulses.iter().skip(1).flat_map(split);
    let mut weights = [(0, 0.0); TAPS];
    for (place, weight) in weights
        .iter_mut()
        .zip(core::iter::once((0, first)).chain(later))
    {
        *place = weight;
    }
    rounded(weights)
}

/// The weights of a box's changes, `y[n] − y[n−1]`: differences of its weights at delays
/// `0, 1, N, N + 1, N + 2`.
///
/// The weights themselves are an even `A` in the middle, `A/2` at zero, and at `N` and
/// `N + 1` what the fraction asks for, with the sum exactly 2^30.
fn box_changes(length_s: f64) -> [(u16, i32); 5] {
    let ticks = length_s * f64::from(TICK_HZ);
    let n = libm::floor(ticks);
    let f = ticks - n;
    let half = libm::round(ONE / ticks / 2.0) as i32;
    let full = 2 * half;
    let last = libm::round(ONE / ticks * f * f / 2.0) as i32;
    let before_last = (1 << WEIGHT_BITS) - half - full * (n as i32 - 1) - last;
    let n = n as u16;
    [
        (0, half),
        (1, full - half),
        (n, before_last - full),
        (n + 1, last - before_last),
        (n + 2, -last),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::{AxisSet, Kind, PrefilterConfig, SecondMode, residual};
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec as StdVec;

    impl Kernel {
        /// Each stage with its taps.
        fn with_taps(&self) -> impl Iterator<Item = (Shape, &[Tap])> {
            let mut left = self.taps.as_slice();
            self.stages.iter().map(move |stage| {
                let (own, others) = left.split_at(match stage.shape {
                    Shape::Two => 3,
                    Shape::Three | Shape::Box => 5,
                    Shape::Four => 7,
                    Shape::Five => 9,
                });
                left = others;
                (stage.shape, own)
            })
        }
    }

    /// The impulse response of a kernel, one value a tick, with its rounded weights in f64.
    fn impulse_response(kernel: &Kernel) -> StdVec<f64> {
        let mut response = std::vec![1.0];
        for (shape, taps) in kernel.with_taps() {
            let last = taps.iter().map(|tap| tap.delay).max().unwrap();
            let mut next = std::vec![0.0; response.len() + usize::from(last)];
            for (i, value) in response.iter().enumerate() {
                for tap in taps {
                    next[i + usize::from(tap.delay)] += value * f64::from(tap.weight) / ONE;
                }
            }
            if shape == Shape::Box {
                let mut sum = 0.0;
                for value in &mut next {
                    sum += *value;
                    *value = sum;
                }
            }
            response = next;
        }
        response
    }

    /// What is left of a mode at 1 kHz, seen at `end_s`.
    fn sampled_residual(response: &[f64], mode: &Mode, end_s: f64) -> f64 {
        let (mut re, mut im) = (0.0, 0.0);
        for (n, value) in response.iter().enumerate() {
            let time_s = n as f64 * TICK_S;
            let size = value * libm::exp(mode.decay_per_s() * time_s);
            re += size * libm::cos(mode.damped_rad_s() * time_s);
            im += size * libm::sin(mode.damped_rad_s() * time_s);
        }
        libm::hypot(re, im) * libm::exp(-mode.decay_per_s() * end_s)
    }

    fn prefilter(kind: Kind, frequency_hz: f32, damping: f32) -> Prefilter {
        Prefilter::new(&PrefilterConfig {
            kind,
            frequency_hz,
            damping,
            ..PrefilterConfig::default()
        })
        .unwrap()
    }

    proptest! {
        #[test]
        fn weights_sum_to_one_and_no_shaper_weight_is_negative(
            kind in 0..Kind::ALL.len(), frequency in 3.2_f32..60.0, damping in 0.0_f32..0.3
        ) {
            let kernel = Kernel::new(&prefilter(Kind::ALL[kind], frequency, damping)).unwrap();
            for (shape, taps) in kernel.with_taps() {
                if shape == Shape::Box {
                    let changes: i64 = taps.iter().map(|tap| i64::from(tap.weight)).sum();
                    // the sum of the weights, from their changes
                    let area: i64 = taps
                        .iter()
                        .map(|tap| -i64::from(tap.delay) * i64::from(tap.weight))
                        .sum();
                    prop_assert_eq!(changes, 0);
                    prop_assert_eq!(area, 1 << WEIGHT_BITS);
                } else {
                    let sum: i64 = taps.iter().map(|tap| i64::from(tap.weight)).sum();
                    prop_assert_eq!(sum, 1 << WEIGHT_BITS);
                    prop_assert!(taps.iter().all(|tap| tap.weight >= 0));
                }
            }
        }

        #[test]
        fn zv_nulls_its_mode_at_the_sampling_rate(
            frequency in 0.6_f32..80.0, damping in 0.0_f32..0.3
        ) {
            let zv = prefilter(Kind::Zv, frequency, damping);
            let response = impulse_response(&Kernel::new(&zv).unwrap());
            let mode = Mode { frequency_hz: frequency.into(), damping: damping.into() };
            prop_assert!(sampled_residual(&response, &mode, zv.length_s()) < 1e-8);
        }

        #[test]
        fn the_sampled_filter_leaves_what_the_continuous_one_leaves(
            kind in 1..Kind::ALL.len(), frequency in 3.2_f32..40.0, damping in 0.0_f32..0.1,
            ratio in 0.6_f64..1.6
        ) {
            let prefilter = prefilter(Kind::ALL[kind], frequency, damping);
            let response = impulse_response(&Kernel::new(&prefilter).unwrap());
            let mode = Mode {
                frequency_hz: f64::from(frequency) * ratio,
                damping: damping.into(),
            };
            let gap = sampled_residual(&response, &mode, prefilter.length_s())
                - residual(&prefilter, &mode);
            // linear interpolation between ticks costs (ωT)²/8 of a tap, once a stage
            let turn = core::f64::consts::TAU * mode.frequency_hz * TICK_S;
            let bound = prefilter.stages().len() as f64 * turn * turn / 8.0;
            prop_assert!(gap.abs() < bound + 1e-6, "{gap} of {bound}");
        }
    }

    #[test]
    fn the_longest_cascade_fits() {
        // eight stages of two modes, 1 s long; each stage adds its fractions of a tick
        let both = |frequency_hz| {
            Prefilter::new(&PrefilterConfig {
                kind: Kind::FirZvdd,
                frequency_hz,
                damping: 0.0,
                second: SecondMode {
                    kind: Kind::FirZvdd,
                    frequency_hz: 10.0,
                    damping: 0.0,
                    axes: AxisSet::ALL,
                },
                ..PrefilterConfig::default()
            })
            .unwrap()
        };
        let longest = both(10.0 / 3.0);
        assert!((longest.length_s() - 1.0).abs() < 1e-6);
        assert_eq!(longest.stages().len(), MAX_STAGES - 1);
        assert!(Kernel::new(&longest).is_ok());
        assert!(matches!(
            Kernel::new(&both(3.2)),
            Err(PrefilterError::TooLong { .. })
        ));
    }

    #[test]
    fn fractional_delays_are_kept() {
        // Rounding to the tick would leave 1.3 % at 12.3 Hz and 1.8 % at 35 Hz.
        for (kind, frequency_hz, bound) in [
            (Kind::Zv, 12.3, 1e-7),
            (Kind::Zvd, 35.0, 1e-7),
            (Kind::FirZvd, 12.3, 1e-7),
        ] {
            let prefilter = prefilter(kind, frequency_hz, 0.022);
            let kernel = Kernel::new(&prefilter).unwrap();
            let mode = Mode {
                frequency_hz: frequency_hz.into(),
                damping: f64::from(0.022_f32),
            };
            let left = sampled_residual(&impulse_response(&kernel), &mode, prefilter.length_s());
            assert!(left < bound, "{kind:?} at {frequency_hz} Hz leaves {left}");
        }
    }

    #[test]
    fn a_filter_longer_than_the_delay_line_is_refused() {
        let too_long = prefilter(Kind::FirZvd, 1.9, 0.0);
        assert!(matches!(
            Kernel::new(&too_long),
            Err(PrefilterError::TooLong { .. })
        ));
        let longest = prefilter(Kind::FirZvd, 2.0, 0.0);
        assert!((longest.length_s() - 1.0).abs() < 1e-12);
        assert!(Kernel::new(&longest).is_ok());
    }
}
