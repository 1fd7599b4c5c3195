//! Why there is no motion.

use core::fmt;

/// Why there is no motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OverlapError {
    /// A time to accelerate in is not between 1 ms and 10 s.
    Time {
        /// What was given, or what the limits ask for.
        time_s: f64,
    },
    /// A limit or a speed is not above zero, or a length or an angle is no finite number.
    NotPositive {
        /// What it is.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A segment neither moves nor turns.
    Empty,
}

impl fmt::Display for OverlapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time { time_s } => write!(
                f,
                "the box of {time_s} s is outside 0.001 to 10 s: give another time, or other limits"
            ),
            Self::NotPositive { what, value } => {
                write!(
                    f,
                    "the {what} of {value} is no number above zero: give another one"
                )
            }
            Self::Empty => f.write_str(
                "a segment neither moves nor turns: leave out points that are given twice",
            ),
        }
    }
}

impl core::error::Error for OverlapError {}

/// The value, if it is a number above zero.
pub(super) fn positive(what: &'static str, value: f64) -> Result<f64, OverlapError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(OverlapError::NotPositive { what, value })
    }
}
