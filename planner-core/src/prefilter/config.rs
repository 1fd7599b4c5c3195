//! The settings of a prefilter, and why they are refused.

use core::fmt;

use super::{AxisSet, Kind, MAX_IMPULSES};

/// The residual that EI shapers allow where nothing else is said.
pub const EI_RESIDUAL: f64 = 0.05;

/// Settings of a prefilter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrefilterConfig {
    /// Which prefilter.
    pub kind: Kind,
    /// Natural frequency (undamped) of the mode to suppress, 0.01 to 250 Hz.
    pub frequency_hz: f32,
    /// Damping ratio of the mode, 0 to 0.5.
    pub damping: f32,
    /// The axes along which the mode swings: a move along none of them needs no prefilter for it.
    pub axes: AxisSet,
    /// `V_tol`, the residual that EI shapers allow, as a fraction: 0.001 to 0.5.
    pub v_tol: f32,
    /// A second mode to suppress, by a prefilter of its own in cascade.
    pub second: SecondMode,
    /// Length of the boxes of `box` and `s-curve` in ms, 1 to 500; 0 for one damped period.
    pub box_ms: f32,
    /// The feedrate that `s-curve` reaches with [`Self::s_curve_jerk_mm_s3`], in mm/s, above 0
    /// to 10 000.
    pub s_curve_feed_mm_s: f32,
    /// The jerk `J` with which `s-curve` reaches the feedrate `F`, in mm/s³ up to 1e9: its
    /// boxes are then `T_rr = √(F/J)` \[Li23\]; 0 for boxes of [`Self::box_ms`].
    pub s_curve_jerk_mm_s3: f32,
    /// The list of impulses of `custom`.
    pub impulses: [CustomImpulse; MAX_IMPULSES],
    /// Boxes that smooth a feedrate that would jump otherwise, in ms, 1 to 500, 0 for none:
    /// the box of a prefilter that has none, and the second one of a prefilter with fewer
    /// than two.
    pub smoothing_ms: [f32; 2],
}

/// A second mode of vibration and its prefilter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondMode {
    /// Which prefilter.
    pub kind: Kind,
    /// Natural frequency (undamped), 0.01 to 250 Hz; 0 if there is no second mode.
    pub frequency_hz: f32,
    /// Damping ratio, 0 to 0.5.
    pub damping: f32,
    /// The axes along which it swings, likewise.
    pub axes: AxisSet,
}

/// An impulse of a list of one's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CustomImpulse {
    /// When, in ms after the first one, 0 to 1000; that of the first one is 0.
    pub time_ms: f32,
    /// Its part of the sum of all weights, 0 to 1000, that of the first one from 0.001; 0 if
    /// there is no such impulse.
    pub weight: f32,
}

impl Default for PrefilterConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl PrefilterConfig {
    /// FIR-ZVD for the mode of \[Yeh26\], and nothing else.
    pub const DEFAULT: Self = {
        let none = CustomImpulse {
            time_ms: 0.0,
            weight: 0.0,
        };
        let first = CustomImpulse {
            weight: 1.0,
            ..none
        };
        Self {
            kind: Kind::FirZvd,
            frequency_hz: 6.34,
            damping: 0.022,
            axes: AxisSet::ALL,
            v_tol: EI_RESIDUAL as f32,
            second: SecondMode {
                kind: Kind::Zv,
                frequency_hz: 0.0,
                damping: 0.0,
                axes: AxisSet::ALL,
            },
            box_ms: 0.0,
            s_curve_feed_mm_s: 160.0,
            s_curve_jerk_mm_s3: 0.0,
            impulses: [first, none, none, none, none],
            smoothing_ms: [0.0; 2],
        }
    };

    /// Whether a mode swings along some of the axes only.
    #[must_use]
    pub fn chooses_axes(&self) -> bool {
        let second = &self.second;
        self.axes != AxisSet::ALL || second.frequency_hz > 0.0 && second.axes != AxisSet::ALL
    }

    /// Which of both prefilters a path along these axes needs.
    #[must_use]
    pub fn modes_along(&self, axes: AxisSet) -> [bool; 2] {
        let second = &self.second;
        [
            self.kind != Kind::None && self.axes.meets(axes),
            second.frequency_hz > 0.0 && second.axes.meets(axes),
        ]
    }

    /// The settings without the prefilters that a path along these axes does not need; what smooths
    /// a prefilter without boxes stays.
    #[must_use]
    pub fn along(&self, axes: AxisSet) -> Self {
        let [first, second] = self.modes_along(axes);
        let mut settings = *self;
        if !first {
            settings.kind = Kind::None;
        }
        if !second {
            settings.second.frequency_hz = 0.0;
        }
        settings
    }

    /// Whether every value is within its range.
    ///
    /// # Errors
    /// [`PrefilterError`] names the first that is not.
    pub(super) fn check(&self) -> Result<(), PrefilterError> {
        let Self {
            kind: _,
            frequency_hz,
            damping,
            axes: _,
            v_tol,
            second,
            box_ms,
            s_curve_feed_mm_s: feed_mm_s,
            s_curve_jerk_mm_s3: jerk_mm_s3,
            impulses,
            smoothing_ms,
        } = *self;
        let is_box = |length_ms: f32| length_ms == 0.0 || (1.0..=500.0).contains(&length_ms);
        if !(0.01..=250.0).contains(&frequency_hz) {
            return Err(PrefilterError::Frequency { frequency_hz });
        }
        if !(0.0..=0.5).contains(&damping) {
            return Err(PrefilterError::Damping { damping });
        }
        if !(0.001..=0.5).contains(&v_tol) {
            return Err(PrefilterError::Residual { v_tol });
        }
        if second.frequency_hz != 0.0 && !(0.01..=250.0).contains(&second.frequency_hz) {
            return Err(PrefilterError::SecondFrequency {
                frequency_hz: second.frequency_hz,
            });
        }
        if !(0.0..=0.5).contains(&second.damping) {
            return Err(PrefilterError::SecondDamping {
                damping: second.damping,
            });
        }
        if !is_box(box_ms) {
            return Err(PrefilterError::Box { length_ms: box_ms });
        }
        if !(0.001..=10_000.0).contains(&feed_mm_s) || !(0.0..=1e9).contains(&jerk_mm_s3) {
            return Err(PrefilterError::SCurve {
                feed_mm_s,
                jerk_mm_s3,
            });
        }
        for (number, impulse) in (1..).zip(&impulses) {
            let (latest_ms, lightest) = if number == 1 {
                (0.0, 0.001)
            } else {
                (1000.0, 0.0)
            };
            let is_right = (0.0..=latest_ms).contains(&impulse.time_ms)
                && (lightest..=1000.0).contains(&impulse.weight);
            if !is_right {
                return Err(PrefilterError::Impulse { number });
            }
        }
        match smoothing_ms
            .into_iter()
            .find(|&length_ms| !is_box(length_ms))
        {
            Some(length_ms) => Err(PrefilterError::Smoothing { length_ms }),
            None => Ok(()),
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
    /// The second mode's frequency is neither 0 nor between 0.01 and 250 Hz.
    SecondFrequency {
        /// What was given.
        frequency_hz: f32,
    },
    /// The second mode's damping ratio is not between 0 and 0.5.
    SecondDamping {
        /// What was given.
        damping: f32,
    },
    /// The residual allowed is not between 0.001 and 0.5.
    Residual {
        /// What was given.
        v_tol: f32,
    },
    /// The box is neither 0 nor between 1 and 500 ms.
    Box {
        /// What was given.
        length_ms: f32,
    },
    /// The feedrate or the jerk of the S-curve is out of its range, or they make boxes
    /// shorter than 1 ms or longer than 500 ms.
    SCurve {
        /// What was given.
        feed_mm_s: f32,
        /// What was given.
        jerk_mm_s3: f32,
    },
    /// Time or weight of an impulse is out of its range.
    Impulse {
        /// Which, from 1.
        number: u8,
    },
    /// A smoothing box is neither 0 nor between 1 and 500 ms.
    Smoothing {
        /// What was given.
        length_ms: f32,
    },
    /// The filter is longer than the delay line.
    TooLong {
        /// The filter's length.
        length_s: f32,
    },
    /// The response has more kinks than there is room for.
    TooManyKinks,
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
            Self::SecondFrequency { frequency_hz } => write!(
                f,
                "the second mode's frequency of {frequency_hz} Hz is neither 0 nor within 0.01 to 250 Hz: give its natural frequency, or 0 if there is no second mode"
            ),
            Self::SecondDamping { damping } => write!(
                f,
                "the second mode's damping ratio of {damping} is outside 0 to 0.5: give the damping ratio of that mode"
            ),
            Self::Residual { v_tol } => write!(
                f,
                "the residual allowed of {v_tol} is outside 0.001 to 0.5: give EI shapers a fraction, as 0.05 for 5 %"
            ),
            Self::Box { length_ms } => write!(
                f,
                "the box of {length_ms} ms is neither 0 nor within 1 to 500 ms: give its length, or 0 for one period of the mode"
            ),
            Self::SCurve {
                feed_mm_s,
                jerk_mm_s3,
            } => write!(
                f,
                "the s-curve to {feed_mm_s} mm/s at {jerk_mm_s3} mm/s³ has no acceleration of 2 ms to 1 s: give a feedrate up to 10000 mm/s and a jerk that fits it, or a jerk of 0 for one period of the mode"
            ),
            Self::Impulse { number } => write!(
                f,
                "impulse {number} is out of range: give times of 0 to 1000 ms and weights of 0 to 1000, and the first one time 0 and at least a weight of 0.001"
            ),
            Self::Smoothing { length_ms } => write!(
                f,
                "the smoothing box of {length_ms} ms is neither 0 nor within 1 to 500 ms: give its length, or 0 for none"
            ),
            Self::TooLong { length_s } => write!(
                f,
                "the prefilter is {length_s:.3} s long and the delay line holds 1 s: choose a shorter prefilter or a higher frequency"
            ),
            Self::TooManyKinks => f.write_str(
                "the prefilter's response has too many kinks: give fewer impulses or fewer boxes",
            ),
        }
    }
}

impl core::error::Error for PrefilterError {}
