//! The rate at which raw time passes: 0 holds the raw path, below 1 slows it, above hurries it.

use crate::raw::TickTime;

/// Bits after the point of a rate.
const RATE_BITS: u32 = 16;

/// A rate of raw time against real time, in 2^-16.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rate(u32);

impl Rate {
    /// Raw time stands still.
    pub const ZERO: Self = Self(0);

    /// As programmed.
    pub const ONE: Self = Self(1 << RATE_BITS);

    /// Twice as fast as programmed; never more.
    pub const FASTEST: Self = Self(2 << RATE_BITS);

    /// A rate in percent, to the nearest 2^-16, [`Rate::FASTEST`] at the most.
    pub fn from_percent(percent: u16) -> Self {
        let scaled = (u32::from(percent) << RATE_BITS) + 50;
        Self(scaled / 100).min(Self::FASTEST)
    }

    /// The rate at which so much raw time passes in a tick, rounded down.
    fn of_tick(raw: TickTime) -> Self {
        Self((raw >> (32 - RATE_BITS)) as u32)
    }

    /// A ratio, rounded down, within [`Rate::ONE`] and [`Rate::FASTEST`].
    pub fn at_least_one(ratio: f64) -> Self {
        let scaled = ratio * f64::from(Self::ONE.0);
        Self(scaled as u32).clamp(Self::ONE, Self::FASTEST)
    }

    /// The raw time that passes in a real time of up to a tick; exact at [`Rate::ONE`], else
    /// rounded down.
    pub fn raw(self, real: TickTime) -> TickTime {
        if self == Self::ONE {
            return real;
        }
        (real * TickTime::from(self.0)) >> RATE_BITS
    }

    /// The real time in which a raw time passes, up to two ticks, or up to 2^14 ticks from
    /// [`Rate::ONE`] on. Exact at [`Rate::ONE`], else rounded down by up to 2^-15 of it. Zero at
    /// [`Rate::ZERO`], where it never does.
    pub fn real(self, raw: TickTime) -> TickTime {
        if self == Self::ONE {
            return raw;
        }
        // 32 bits, because a division of 64 would cost as much as the rest of the walk
        let inverse = u32::MAX.checked_div(self.0).unwrap_or(0);
        (raw * TickTime::from(inverse)) >> RATE_BITS
    }
}

/// A whole change of a [`GradualRate`], in 2^-31.
const CHANGED: u32 = 1 << 31;

/// A rate that changes without a jump of itself or its slope, for what nothing smooths.
///
/// From one rate to another one in N ticks, as a part `S(x) = x² (3 − 2x)` of the difference: the
/// slope is at most `3/2 / N` of it, the change of the slope within a tick `6 / N²`. What is
/// wanted anew meanwhile waits until then.
#[derive(Clone, Copy, Debug)]
pub struct GradualRate {
    from: Rate,
    to: Rate,
    /// How much of the change is over, in 2^-31.
    changed: u32,
}

impl GradualRate {
    /// How much of a change that takes so many ticks passes in each, for
    /// [`GradualRate::next_tick`].
    pub fn step(ticks: u32) -> u32 {
        CHANGED.div_ceil(ticks.max(1))
    }

    /// A rate that is steady so far.
    pub fn steady(rate: Rate) -> Self {
        Self {
            from: rate,
            to: rate,
            changed: CHANGED,
        }
    }

    /// The raw time of the next tick, on the way to the rate that is wanted, and the rate of it
    /// rounded down.
    pub fn next_tick(&mut self, wanted: Rate, step: u32) -> (TickTime, Rate) {
        if self.changed >= CHANGED && wanted != self.to {
            (self.from, self.to, self.changed) = (self.to, wanted, 0);
        }
        self.changed = self.changed.saturating_add(step).min(CHANGED);
        let x = u64::from(self.changed);
        let part = (((x * x) >> 31) * ((3 << 31) - 2 * x)) >> 31;
        let [from, to] = [self.from.0, self.to.0].map(i64::from);
        let raw = (from << 16) + (((to - from) * part as i64) >> (31 - 16));
        (raw, Rate::of_tick(raw))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raw::ONE_TICK;

    #[test]
    fn one_is_exact_and_others_are_rounded_down() {
        for time in [0, 1, 12_345, ONE_TICK - 1, ONE_TICK] {
            assert_eq!(Rate::ONE.raw(time), time);
            assert_eq!(Rate::ONE.real(time), time);
            for percent in [1, 10, 37, 99, 101, 150, 200] {
                let rate = Rate::from_percent(percent);
                let raw = rate.raw(time);
                assert!(rate.real(raw) <= time && rate.raw(rate.real(raw)) <= raw);
                let exact = time as f64 * f64::from(percent) / 100.0;
                assert!((raw as f64 - exact).abs() <= exact * 1e-3 + 1.0);
            }
        }
        assert_eq!(Rate::ZERO.raw(ONE_TICK), 0);
        assert_eq!(Rate::ZERO.real(ONE_TICK), 0);
    }

    #[test]
    fn a_gradual_change_is_smooth_and_complete() {
        let mut rate = GradualRate::steady(Rate::ONE);
        let step = GradualRate::step(200);
        assert_eq!(rate.next_tick(Rate::ONE, step), (ONE_TICK, Rate::ONE));
        let (mut before, mut slope) = (ONE_TICK, 0);
        let one = ONE_TICK as f64;
        let mut steepest = 0.0_f64;
        for tick in 0..200 {
            // what is wanted on the way waits
            let wanted = if tick == 70 { Rate::ONE } else { Rate::ZERO };
            let (raw, _) = rate.next_tick(wanted, step);
            let now = raw - before;
            let bend = (now - slope) as f64 / one * 200.0 * 200.0;
            assert!(now <= 0 && bend.abs() < 6.01, "{tick}: {bend}");
            steepest = steepest.max(-(now as f64) / one * 200.0);
            (before, slope) = (raw, now);
        }
        assert!((1.49..1.5).contains(&steepest), "{steepest}");
        assert_eq!(rate.next_tick(Rate::ZERO, step), (0, Rate::ZERO));
        for _ in 0..200 {
            rate.next_tick(Rate::ONE, step);
        }
        assert_eq!(rate.next_tick(Rate::ONE, step), (ONE_TICK, Rate::ONE));
    }

    #[test]
    fn rates_are_within_their_range() {
        assert_eq!(Rate::from_percent(100), Rate::ONE);
        assert_eq!(Rate::from_percent(65_535), Rate::FASTEST);
        assert_eq!(Rate::at_least_one(0.3), Rate::ONE);
        assert_eq!(Rate::at_least_one(f64::NAN), Rate::ONE);
        assert_eq!(Rate::at_least_one(f64::INFINITY), Rate::FASTEST);
        assert!(Rate::at_least_one(1.5) == Rate::from_percent(150));
    }
}
