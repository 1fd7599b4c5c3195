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

    /// This rate, changed towards another one by no more than a hundredth of [`Rate::ONE`].
    pub fn towards(self, wanted: Self) -> Self {
        const STEP: u32 = Rate::ONE.0 / 100;
        let (low, high) = (self.0.saturating_sub(STEP), self.0.saturating_add(STEP));
        Self(wanted.0.clamp(low, high))
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
    fn rates_are_within_their_range() {
        assert_eq!(Rate::from_percent(100), Rate::ONE);
        assert_eq!(Rate::from_percent(65_535), Rate::FASTEST);
        assert_eq!(Rate::at_least_one(0.3), Rate::ONE);
        assert_eq!(Rate::at_least_one(f64::NAN), Rate::ONE);
        assert_eq!(Rate::at_least_one(f64::INFINITY), Rate::FASTEST);
        assert!(Rate::at_least_one(1.5) == Rate::from_percent(150));
    }
}
