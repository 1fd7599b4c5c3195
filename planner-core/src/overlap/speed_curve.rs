//! How the speed of a segment rises and falls.

use super::error::{OverlapError, positive};
use crate::prefilter::Prefilter;

/// A speed with the limits that it is reached within, in mm or in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Per second.
    pub speed: f64,
    /// Largest acceleration, per s².
    pub acceleration: f64,
    /// Largest jerk, per s³.
    pub jerk: f64,
}

/// How the speed of a segment rises and falls: a prefilter of one or two equal boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCurve {
    box_s: f64,
    is_s_curve: bool,
}

impl SpeedCurve {
    /// The S-curve, `box(T_rr) ∗ box(T_rr)`: the acceleration rises for `T_rr` and falls for
    /// `T_rr`. At speed `V` it takes the acceleration `V/T_rr` and the jerk `V/T_rr²`.
    ///
    /// # Errors
    /// [`OverlapError::Time`] outside 1 ms to 10 s.
    pub fn s_curve(box_s: f64) -> Result<Self, OverlapError> {
        Self::new(box_s, true)
    }

    /// ADAI, acceleration and deceleration after interpolation: one box of `τ`. At speed `V`
    /// it takes the acceleration `V/τ`, and the jerk is not limited.
    ///
    /// # Errors
    /// [`OverlapError::Time`] outside 1 ms to 10 s.
    pub fn adai(box_s: f64) -> Result<Self, OverlapError> {
        Self::new(box_s, false)
    }

    /// The shortest S-curve that keeps every demand.
    ///
    /// ```text
    /// T_rr = max(V/A, √(V/J))
    /// ```
    ///
    /// # Errors
    /// A speed or a limit that is not above zero; [`OverlapError::Time`].
    pub fn within(demands: &[Demand]) -> Result<Self, OverlapError> {
        let mut box_s = 0.0_f64;
        for demand in demands {
            let speed = positive("speed", demand.speed)?;
            let acceleration = positive("acceleration limit", demand.acceleration)?;
            let jerk = positive("jerk limit", demand.jerk)?;
            box_s = box_s
                .max(speed / acceleration)
                .max(libm::sqrt(speed / jerk));
        }
        Self::s_curve(box_s)
    }

    pub(super) fn new(box_s: f64, is_s_curve: bool) -> Result<Self, OverlapError> {
        if !(1e-3..=10.0).contains(&box_s) {
            return Err(OverlapError::Time { time_s: box_s });
        }
        Ok(Self { box_s, is_s_curve })
    }

    /// Length of a box in seconds: `T_rr` or `τ`.
    #[must_use]
    pub const fn box_s(&self) -> f64 {
        self.box_s
    }

    /// Whether it has two boxes.
    pub(super) const fn is_s_curve(&self) -> bool {
        self.is_s_curve
    }

    /// How long the speed rises, `2 T_rr` or `τ`, in seconds.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        if self.is_s_curve {
            2.0 * self.box_s
        } else {
            self.box_s
        }
    }

    /// The rise to speed 1, a time after its begin. Each piece is a polynomial of its own: exact
    /// to 1e-15 of its value at any time.
    #[must_use]
    pub(super) fn at(&self, t: f64) -> Rise {
        let (length_s, box_s) = (self.length_s(), self.box_s);
        if t <= 0.0 {
            return Rise::default();
        }
        if t >= length_s {
            return Rise {
                way: t - length_s / 2.0,
                speed: 1.0,
                acceleration: 0.0,
            };
        }
        if !self.is_s_curve {
            return Rise {
                way: t * t / (2.0 * box_s),
                speed: t / box_s,
                acceleration: 1.0 / box_s,
            };
        }
        let jerk = 1.0 / (box_s * box_s);
        let left = length_s - t;
        if t < box_s {
            Rise {
                way: jerk * t * t * t / 6.0,
                speed: jerk * t * t / 2.0,
                acceleration: jerk * t,
            }
        } else {
            Rise {
                way: t - box_s + jerk * left * left * left / 6.0,
                speed: 1.0 - jerk * left * left / 2.0,
                acceleration: jerk * left,
            }
        }
    }

    pub(super) fn prefilter(&self) -> Prefilter {
        if self.is_s_curve {
            Prefilter::of_boxes([self.box_s; 2])
        } else {
            Prefilter::of_box(self.box_s)
        }
    }
}

/// A rise of the speed from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rise {
    pub way: f64,
    pub speed: f64,
    pub acceleration: f64,
}
