//! Where the tool is, and where the joints are.

use crate::units::{AngleDeg, AngleRad, LengthMm};

/// Axes of a pose and joints of a robot.
pub const AXES: usize = 4;

/// Pose of the tool centre point: position and yaw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pose {
    /// X in the robot's frame.
    pub x: LengthMm,
    /// Y in the robot's frame.
    pub y: LengthMm,
    /// Z, positive up.
    pub z: LengthMm,
    /// Yaw about Z, positive counter-clockwise.
    pub c: AngleDeg,
}

impl Pose {
    /// The raw bits of X, Y, Z (2^-19 mm) and C (2^-19 °), as the tick adds them.
    #[must_use]
    pub const fn to_bits(self) -> [i32; AXES] {
        [
            self.x.to_bits(),
            self.y.to_bits(),
            self.z.to_bits(),
            self.c.to_bits(),
        ]
    }

    /// The inverse of [`Pose::to_bits`].
    #[must_use]
    pub const fn from_bits([x, y, z, c]: [i32; AXES]) -> Self {
        Self {
            x: LengthMm::from_bits(x),
            y: LengthMm::from_bits(y),
            z: LengthMm::from_bits(z),
            c: AngleDeg::from_bits(c),
        }
    }
}

/// Positions of a SCARA's joints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JointPosition {
    /// Shoulder, about Z, zero along +X.
    pub joint1: AngleRad,
    /// Elbow, relative to the upper arm, zero when stretched.
    pub joint2: AngleRad,
    /// Quill, equal to Z of the tool.
    pub joint3: LengthMm,
    /// Wrist, relative to the forearm.
    pub joint4: AngleRad,
}

impl JointPosition {
    /// The raw bits of joints 1, 2, 4 (2^-26 rad) and 3 (2^-19 mm), in the order of the joints.
    #[must_use]
    pub const fn to_bits(self) -> [i32; AXES] {
        [
            self.joint1.to_bits(),
            self.joint2.to_bits(),
            self.joint3.to_bits(),
            self.joint4.to_bits(),
        ]
    }

    /// The inverse of [`JointPosition::to_bits`].
    #[must_use]
    pub const fn from_bits([joint1, joint2, joint3, joint4]: [i32; AXES]) -> Self {
        Self {
            joint1: AngleRad::from_bits(joint1),
            joint2: AngleRad::from_bits(joint2),
            joint3: LengthMm::from_bits(joint3),
            joint4: AngleRad::from_bits(joint4),
        }
    }
}

/// What the joints have to do at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointState {
    /// Joint positions.
    pub position: JointPosition,
    /// Joint velocities: rad/s, rad/s, mm/s, rad/s.
    pub velocity: [f32; AXES],
    /// Joint accelerations: rad/s², rad/s², mm/s², rad/s².
    pub acceleration: [f32; AXES],
}
