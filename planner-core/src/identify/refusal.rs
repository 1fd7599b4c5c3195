//! Why a record is not believed.

use core::fmt;

use super::record::{HIGHEST_RATE_HZ, LOWEST_RATE_HZ, SHORTEST_S};

/// Why nothing is identified from a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// The sampling rate is outside the range.
    Rate {
        /// What it is.
        rate_hz: f32,
    },
    /// The record is too short, altogether or for the mode it shows.
    TooShort {
        /// Its length in s.
        length_s: f32,
        /// The length wanted in s.
        wanted_s: f32,
    },
    /// All samples are the same.
    Flat,
    /// The crests are cut off by the range of the input.
    Clipped,
    /// Nothing stands out of the noise.
    OnlyNoise,
    /// What swings does not die away: something drives it.
    NotDecaying {
        /// Its frequency in Hz.
        frequency_hz: f32,
    },
    /// What was fitted is damped so heavily that it is no swing, but a drift.
    NoSwing {
        /// Its damping ratio.
        damping: f32,
    },
    /// There is a mode, but too much noise to tell its frequency and damping.
    Uncertain {
        /// Standard deviation of the frequency, relative.
        frequency_deviation: f32,
        /// Standard deviation of the damping ratio.
        damping_deviation: f32,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rate { rate_hz } => write!(
                f,
                "the record has {rate_hz:.1} samples a second: take from {LOWEST_RATE_HZ} to {HIGHEST_RATE_HZ}"
            ),
            Self::TooShort { length_s, wanted_s } => write!(
                f,
                "the record lasts {length_s:.3} s, and needs {wanted_s:.2} s at least: record for longer"
            ),
            Self::Flat => f.write_str(
                "all samples of the record are the same: check that the sensor is connected",
            ),
            Self::Clipped => f.write_str(
                "the crests of the record are cut off: take a larger range, or excite less",
            ),
            Self::OnlyNoise => f.write_str(
                "nothing stands out of the record's noise: excite more, or put the sensor where it swings",
            ),
            Self::NotDecaying { frequency_hz } => write!(
                f,
                "the swing at {frequency_hz:.2} Hz does not die away: find what drives it, and record after the stop"
            ),
            Self::NoSwing { damping } => write!(
                f,
                "the record shows a drift (damping {damping:.2}) and no swing: record after the stop, and excite more"
            ),
            Self::Uncertain {
                frequency_deviation,
                damping_deviation,
            } => write!(
                f,
                "the frequency is uncertain by {:.1} % and the damping by {damping_deviation:.4}: excite more, or record for longer",
                100.0 * frequency_deviation
            ),
        }
    }
}

impl core::error::Error for Refusal {}

/// The refusal of a record shorter than any may be.
pub(super) const fn too_short(length_s: f32) -> Refusal {
    Refusal::TooShort {
        length_s,
        wanted_s: SHORTEST_S,
    }
}
