//! The motion law of a hop: from rest to rest with limited speed, acceleration and jerk.

use crate::raw::TickTime;
use crate::units::{TICK_HZ, TICK_S};

/// How long the acceleration takes to build up and to vanish, as a part of the time for which it
/// would have to act at its full size.
///
/// With a fifth, and a rise of twice the vertical height, the motion times of [vNoorden21]
/// come out: `T √A = 2.526 √m` over 0.7 m with 50 mm vertical at either end.
const EASE: f64 = 0.2;

/// By how much a change of the rate adds to the accelerations and jerks of a ramp, where it takes
/// as long as [`Ramp::change_ticks`] says.
pub(crate) const HELD: f32 = 1.1;

/// Bits of a progress after the point.
pub(super) const PROGRESS_BITS: u32 = 31;

/// A whole motion.
pub(super) const DONE: u64 = 1 << PROGRESS_BITS;

/// Bits after the point of a reciprocal of ticks, and of a time in ticks that goes with it.
const INVERSE_BITS: u32 = 42;
const TIME_BITS: u32 = 20;

/// Longest time in ticks (6 days): sums of some of them do not overflow.
const TICKS_MAX: f64 = (1 << 29) as f64;

/// `DONE / 6`.
const SIXTH: u64 = (DONE + 3) / 6;

/// A motion from rest to rest: a step through three boxes.
///
/// ```text
/// u(t) = step ∗ box(T_v) ∗ box(T_1) ∗ box(T_2),    T_2 ≤ T_1,  T_1 + T_2 ≤ T_v
/// v = L/T_v,   A = v/T_1,   jerk = A/T_2,   T = T_v + T_1 + T_2
/// ```
///
/// It reaches its speed `v` for `T_v = T_1 + T_2` in an instant only. The times are whole
/// ticks, rounded up, so that no limit is exceeded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ramp {
    /// `T_v` in ticks.
    cruise: u32,
    /// `T_1` in ticks.
    rise: u32,
    /// `T_2` in ticks.
    ease: u32,
    /// Their inverses in 2^-42.
    per_cruise: u64,
    per_rise: u64,
    per_ease: u64,
}

impl Ramp {
    /// The motion over `length`, above zero, within a speed per second and an acceleration per
    /// second squared; `slowest_s` is the least `T_v`. A length of zero takes one such time.
    #[must_use]
    pub fn new(length: f64, speed: f64, acceleration: f64, slowest_s: f64) -> Self {
        // L = A T₁ (T₁ + T₂)
        let unlimited_s = libm::sqrt(length / (acceleration * (1.0 + EASE)));
        let rise_s = unlimited_s.min(speed / acceleration);
        let ticks =
            |time_s: f64| libm::ceil(time_s * f64::from(TICK_HZ)).clamp(1.0, TICKS_MAX) as u32;
        let rise = ticks(rise_s);
        let ease = ticks(rise_s * EASE);
        let cruise = ticks((length / speed).max(slowest_s)).max(rise + ease);
        let inverse = |ticks: u32| (1 << INVERSE_BITS) / u64::from(ticks);
        Self {
            cruise,
            rise,
            ease,
            per_cruise: inverse(cruise),
            per_rise: inverse(rise),
            per_ease: inverse(ease),
        }
    }

    /// How long it takes.
    #[must_use]
    pub const fn ticks(&self) -> u32 {
        self.cruise + self.rise + self.ease
    }

    /// The lengths of its boxes in seconds.
    #[must_use]
    pub fn boxes_s(&self) -> [f64; 3] {
        [self.cruise, self.rise, self.ease].map(|ticks| f64::from(ticks) * TICK_S)
    }

    /// Its largest speed, acceleration and jerk over a length, per s, s² and s³.
    #[must_use]
    pub fn peaks(&self, length: f32) -> [f32; 3] {
        let [cruise, rise, ease] =
            [self.cruise, self.rise, self.ease].map(|ticks| TICK_HZ as f32 / ticks as f32);
        let speed = length * cruise;
        [speed, speed * rise, speed * rise * ease]
    }

    /// In how many ticks the rate of passing through it may change, so that with the terms
    /// `v ρ'` and `3 A ρ ρ' + v ρ''` acceleration and jerk come to at most [`HELD`] times those of
    /// the ramp: `ρ² + ρ'/4 ≤ 1.09` and `ρ³ + 0.15 ρρ' + |ρ''|/80 ≤ 1.09` where N is four times
    /// `T_1` and twenty times `T_2`.
    #[must_use]
    pub(super) fn change_ticks(&self) -> u32 {
        (4 * self.rise).max(20 * self.ease)
    }

    /// How far it has come at a time since its begin, from 0 to [`DONE`].
    ///
    /// For the first half, the second one being its mirror image:
    /// ```text
    /// t < T₂:        u = t³ / (6 T₂ T₁ T_v)
    /// t < T₁:        u = (t² − T₂ t + T₂²/3) / (2 T₁ T_v)
    /// then:          u = (t − (T₁ + T₂)/2) / T_v + w³ / (6 T₂ T₁ T_v),   w = T₁ + T₂ − t ≥ 0, or 0
    /// ```
    ///
    /// Worst error 4e-9 of the motion, and what 2^-20 ticks make; at most eight products of 64 bits.
    #[must_use]
    pub(super) fn progress(&self, time: TickTime) -> u64 {
        let whole = TickTime::from(self.ticks()) << 32;
        let time = time.clamp(0, whole);
        let is_late = time > whole / 2;
        let nearer = if is_late { whole - time } else { time };
        let t = (nearer >> (32 - TIME_BITS)) as u64;
        let [rise, ease] = [self.rise, self.ease].map(|ticks| u64::from(ticks) << TIME_BITS);
        let cubic = |t: u64| {
            let product = times(part(t, self.per_cruise), part(t, self.per_rise));
            times(times(product, part(t, self.per_ease)), SIXTH)
        };
        let done = if t < ease {
            cubic(t)
        } else if t < rise {
            let square = times(part(t, self.per_cruise), part(t, self.per_rise));
            let product = times(part(ease, self.per_cruise), part(t, self.per_rise));
            let constant = times(part(ease, self.per_cruise), part(ease, self.per_rise));
            square
                .wrapping_sub(product)
                .wrapping_add(times(constant, 2 * SIXTH))
                / 2
        } else {
            let begun = rise + ease;
            let left = begun.saturating_sub(t);
            let straight = part(t.saturating_sub(begun / 2), self.per_cruise);
            straight.wrapping_add(cubic(left))
        };
        if is_late {
            DONE.wrapping_sub(done)
        } else {
            done
        }
    }
}

/// A time over the ticks whose inverse is given, at most 1.
const fn part(time: u64, inverse: u64) -> u64 {
    time.wrapping_mul(inverse) >> (INVERSE_BITS + TIME_BITS - PROGRESS_BITS)
}

/// The product of two parts.
const fn times(a: u64, b: u64) -> u64 {
    a.wrapping_mul(b) >> PROGRESS_BITS
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The law in double precision, from its own integrals of the jerk.
    fn exact(ramp: &Ramp, t: f64) -> f64 {
        let [tv, t1, t2] = [ramp.cruise, ramp.rise, ramp.ease].map(f64::from);
        let mut sum = 0.0;
        for (b, sign) in [
            (0.0, 1.0),
            (t2, -1.0),
            (t1, -1.0),
            (t1 + t2, 1.0),
            (tv, -1.0),
            (tv + t2, 1.0),
            (tv + t1, 1.0),
            (tv + t1 + t2, -1.0),
        ] {
            let since: f64 = f64::max(t - b, 0.0);
            sum += sign * since.powi(3) / (6.0 * tv * t1 * t2);
        }
        sum
    }

    proptest! {
        #[test]
        fn progress_is_the_law(
            length in 0.1_f64..2000.0, speed in 1.0_f64..10_000.0, acceleration in 10.0_f64..1e5,
            at in 0.0_f64..1.0
        ) {
            let ramp = Ramp::new(length, speed, acceleration, 0.0);
            let ticks = f64::from(ramp.ticks());
            let t = at * ticks;
            let found = ramp.progress((t * 4_294_967_296.0) as TickTime) as f64 / DONE as f64;
            // a time is cut to 2^-20 ticks, and cancellation costs the oracle 1e-16 (T/T₂)³
            let steepest = 1.0 / f64::from(ramp.cruise) / 1e6;
            let gap = (found - exact(&ramp, t)).abs();
            prop_assert!(gap < 4e-9 + steepest + 1e-15 * ticks.powi(3), "{gap} of {ramp:?}");
        }

        #[test]
        fn it_starts_at_rest_ends_at_one_and_never_turns_back(
            length in 0.01_f64..2000.0, speed in 1.0_f64..10_000.0, acceleration in 10.0_f64..1e6
        ) {
            let ramp = Ramp::new(length, speed, acceleration, 0.0);
            let end = TickTime::from(ramp.ticks()) << 32;
            prop_assert_eq!(ramp.progress(0), 0);
            prop_assert_eq!(ramp.progress(-5), 0);
            prop_assert_eq!(ramp.progress(end), DONE);
            prop_assert_eq!(ramp.progress(end + 77), DONE);
            let mut before = 0;
            for k in 0..=1000 {
                let now = ramp.progress(end / 1000 * k);
                prop_assert!(now + 8 >= before, "{k}: {now} after {before}");
                before = now;
            }
        }

        #[test]
        fn limits_are_kept(
            length in 10.0_f64..2000.0, speed in 50.0_f64..10_000.0, acceleration in 100.0_f64..1e5
        ) {
            let ramp = Ramp::new(length, speed, acceleration, 0.0);
            let [tv, t1, _] = ramp.boxes_s();
            prop_assert!(length / tv <= speed * 1.000_001);
            prop_assert!(length / tv / t1 <= acceleration * 1.000_001);
        }
    }

    #[test]
    fn a_fifth_of_ease_makes_the_published_times() {
        // Over 0.7 m at 5 m/s²: 2 √(1.2 · 0.7 / 5) s.
        let ramp = Ramp::new(700.0, 1e4, 5000.0, 0.0);
        let expected = 2.0 * (1.2_f64 * 0.7 / 5.0).sqrt();
        assert!((f64::from(ramp.ticks()) * TICK_S - expected).abs() < 2.5e-3);
    }
}
