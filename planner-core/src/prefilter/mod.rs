//! The prefilter: what turns a raw feedrate of steps into one that leaves no vibration.
//!
//! config ([`PrefilterConfig`]: name, frequency, damping) → active ([`Prefilter`]: the
//! cascade of impulses and boxes, in seconds) → machine units ([`Kernel`]: integer taps a
//! tick) → state ([`Convolver`]: the delay line). Planning reads the exact step and ramp
//! [`Response`]; nothing in planning needs a time grid.

mod cascade;
mod convolver;
mod kernel;
mod mode;
mod residual;
mod response;

pub use cascade::{Impulse, MAX_STAGES, Prefilter, Stage};
pub use convolver::{Convolver, FINE_BITS};
pub use kernel::{Kernel, SLOTS};
pub use mode::Mode;
pub use residual::{Band, insensitivity, residual};
pub use response::Response;

use core::fmt;

/// The residual that an EI shaper allows at the nominal frequency.
pub const EI_RESIDUAL: f64 = 0.05;

/// The prefilters by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// No filter: the feedrate jumps.
    None,
    /// Two impulses half a damped period apart.
    Zv,
    /// ZV twice: three impulses over one damped period.
    Zvd,
    /// Three impulses that trade [`EI_RESIDUAL`] at the nominal frequency for a wider band.
    Ei,
    /// A moving average over one damped period.
    Fir,
    /// FIR and ZV in cascade.
    FirZv,
    /// FIR and ZVD in cascade: the widest band and the smoothest motion.
    #[default]
    FirZvd,
    /// FIR twice, the S-curve of velocity profile overlap: acceleration without jumps.
    SCurve,
}

impl Kind {
    /// Every prefilter, in the order of their numbers.
    pub const ALL: [Self; 8] = [
        Self::None,
        Self::Zv,
        Self::Zvd,
        Self::Ei,
        Self::Fir,
        Self::FirZv,
        Self::FirZvd,
        Self::SCurve,
    ];

    /// The name by which programs and settings call it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Zv => "zv",
            Self::Zvd => "zvd",
            Self::Ei => "ei",
            Self::Fir => "fir",
            Self::FirZv => "fir-zv",
            Self::FirZvd => "fir-zvd",
            Self::SCurve => "s-curve",
        }
    }

    /// The prefilter of that name, if there is one; upper and lower case are the same.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name().eq_ignore_ascii_case(name))
    }
}

/// Settings of a prefilter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrefilterConfig {
    /// Which prefilter.
    pub kind: Kind,
    /// Natural frequency (undamped) of the mode to suppress, 0.01 to 250 Hz.
    pub frequency_hz: f32,
    /// Damping ratio of the mode, 0 to 0.5.
    pub damping: f32,
}

impl Default for PrefilterConfig {
    fn default() -> Self {
        Self {
            kind: Kind::FirZvd,
            frequency_hz: 6.34,
            damping: 0.022,
        }
    }
}

/// Why a prefilter's settings are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PrefilterError {
    /// The frequency is not between 0.01 and 250 Hz.
    Frequency {
        /// What was given.
        frequency_hz: f32,
    },
    /// The damping ratio is not between 0 and 0.5.
    Damping {
        /// What was given.
        damping: f32,
    },
    /// The filter is longer than the delay line.
    TooLong {
        /// The filter's length.
        length_s: f32,
    },
}

impl fmt::Display for PrefilterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frequency { frequency_hz } => write!(
                f,
                "the prefilter's frequency of {frequency_hz} Hz is outside 0.01 to 250 Hz: give the natural frequency of the mode to suppress"
            ),
            Self::Damping { damping } => write!(
                f,
                "the prefilter's damping ratio of {damping} is outside 0 to 0.5: give the damping ratio of the mode to suppress"
            ),
            Self::TooLong { length_s } => write!(
                f,
                "the prefilter is {length_s:.3} s long and the delay line holds 1 s: choose a shorter prefilter or a higher frequency"
            ),
        }
    }
}

impl core::error::Error for PrefilterError {}
