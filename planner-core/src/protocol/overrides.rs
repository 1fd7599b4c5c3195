//! Feed and rapid overrides, by Grbl's realtime bytes.

use crate::motion::Order;

/// Lowest feed override in percent.
const FEED_MIN: u16 = 10;
/// Highest feed override in percent.
const FEED_MAX: u16 = 200;

/// Both overrides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rates {
    /// Part of the programmed feedrates, 10 to 200 %.
    pub feed_percent: u16,
    /// Part of the rapid's feedrate: 100, 50 or 25 %.
    pub rapid_percent: u8,
}

impl Rates {
    /// As programmed.
    pub const FULL: Self = Self {
        feed_percent: 100,
        rapid_percent: 100,
    };

    /// As the motion takes them.
    #[must_use]
    pub const fn order(self) -> Order {
        Order::Rates {
            feed_percent: self.feed_percent,
            rapid_percent: self.rapid_percent,
        }
    }
}

/// Takes an override's byte; `None` if it is none.
#[must_use]
pub fn overridden(rates: Rates, byte: u8) -> Option<Rates> {
    let feed = |change: i16| {
        let feed_percent = rates.feed_percent.saturating_add_signed(change);
        Rates {
            feed_percent: feed_percent.clamp(FEED_MIN, FEED_MAX),
            ..rates
        }
    };
    let rapid = |rapid_percent| Rates {
        rapid_percent,
        ..rates
    };
    Some(match byte {
        0x90 => Rates {
            feed_percent: 100,
            ..rates
        },
        0x91 => feed(10),
        0x92 => feed(-10),
        0x93 => feed(1),
        0x94 => feed(-1),
        0x95 => rapid(100),
        0x96 => rapid(50),
        0x97 => rapid(25),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_stay_within_their_range() {
        let mut rates = Rates::FULL;
        for (byte, times, feed, rapid) in [
            (0x91, 30, 200, 100),
            (0x94, 3, 197, 100),
            (0x92, 30, 10, 100),
            (0x93, 5, 15, 100),
            (0x96, 1, 15, 50),
            (0x90, 1, 100, 50),
            (0x97, 1, 100, 25),
            (0x95, 1, 100, 100),
        ] {
            for _ in 0..times {
                rates = overridden(rates, byte).unwrap();
            }
            assert_eq!((rates.feed_percent, rates.rapid_percent), (feed, rapid));
        }
        assert_eq!(overridden(rates, b'!'), None);
    }
}
