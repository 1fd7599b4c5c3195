//! Limits of motion as settings give them, and what they are called.

use core::fmt;

/// Limits of one thing that moves, in mm or °; 0 is no limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionLimits {
    /// Largest velocity per s, 0 to 1e6.
    pub velocity: f32,
    /// Largest acceleration per s², 0 to 1e7.
    pub acceleration: f32,
    /// Largest jerk per s³, 0 to 1e9.
    pub jerk: f32,
}

/// All limits of motion; by default there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LimitsConfig {
    /// Of each joint: in °, joint 3 of a SCARA in mm.
    pub joints: [MotionLimits; 4],
    /// Of the tool along its path, in mm: tangential, after \[Li23\] Table 4.
    pub path: MotionLimits,
    /// Of the tool along each of X, Y and Z, in mm: axial, likewise.
    pub axis: MotionLimits,
}

impl LimitsConfig {
    /// Highest velocity, acceleration and jerk that may be set.
    pub const HIGHEST: [f32; 3] = [1e6, 1e7, 1e9];

    /// All of them, with their names.
    pub fn all(&self) -> impl Iterator<Item = (Part, &MotionLimits)> {
        let joints = (1..).map(Part::Joint).zip(&self.joints);
        joints.chain([(Part::Path, &self.path), (Part::Axis, &self.axis)])
    }

    /// Boxes that the prefilter has to have: one lets the velocity rise evenly, so that there
    /// is an acceleration to speak of, two the acceleration.
    #[must_use]
    pub fn boxes_needed(&self) -> usize {
        let is_set = |value: fn(&MotionLimits) -> f32| self.all().any(|(_, l)| value(l) > 0.0);
        match (is_set(|l| l.acceleration), is_set(|l| l.jerk)) {
            (_, true) => 2,
            (true, false) => 1,
            (false, false) => 0,
        }
    }
}

/// What a limit is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Joint 1 to 4.
    Joint(u8),
    /// The tool along its path.
    Path,
    /// The tool along X, Y or Z.
    Axis,
}

/// What of its motion a limit bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The first derivative.
    Velocity,
    /// The second.
    Acceleration,
    /// The third.
    Jerk,
}

/// One limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// What it is for.
    pub part: Part,
    /// What it bounds.
    pub order: Order,
}

/// A segment whose feed a limit lowers, or a hop that it slows down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limited {
    /// The limit.
    pub bound: Bound,
    /// How long the program gives it, in s; of a hop its motions one after the other, as
    /// [`Limited::takes_s`] is then.
    pub asked_s: f64,
    /// How long it takes.
    pub takes_s: f64,
    /// Its length in mm, of a hop up, across and down; 0 if it only turns.
    pub length_mm: f64,
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.part {
            Part::Joint(joint) => write!(f, "joint {joint} ")?,
            Part::Path => f.write_str("path ")?,
            Part::Axis => f.write_str("axis ")?,
        }
        f.write_str(match self.order {
            Order::Velocity => "velocity",
            Order::Acceleration => "acceleration",
            Order::Jerk => "jerk",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_follow_from_what_is_set() {
        let mut config = LimitsConfig::default();
        assert_eq!(config.boxes_needed(), 0);
        config.path.velocity = 1.0;
        assert_eq!(config.boxes_needed(), 0);
        config.joints[3].acceleration = 1.0;
        assert_eq!(config.boxes_needed(), 1);
        config.axis.jerk = 1.0;
        assert_eq!(config.boxes_needed(), 2);
    }
}
