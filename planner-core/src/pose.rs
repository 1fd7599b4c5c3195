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

/// What the position of a joint counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointUnit {
    /// Angles: [`AngleRad`], shown in degrees.
    Angle,
    /// Lengths: [`LengthMm`].
    Length,
}

impl JointUnit {
    /// Bits of a position in rad or mm, exactly.
    #[must_use]
    pub fn value(self, bits: i32) -> f64 {
        match self {
            Self::Angle => AngleRad::from_bits(bits).to_num(),
            Self::Length => LengthMm::from_bits(bits).to_num(),
        }
    }

    /// Bits of a position in ° or mm, for people.
    #[must_use]
    pub fn shown(self, bits: i32) -> f32 {
        match self {
            Self::Angle => AngleRad::from_bits(bits).to_num::<f32>().to_degrees(),
            Self::Length => LengthMm::from_bits(bits).to_num(),
        }
    }

    /// Bits of a position given in ° or mm; saturates.
    #[must_use]
    pub fn bits(self, shown: f32) -> i32 {
        match self {
            Self::Angle => AngleRad::saturating_from_num(f64::from(shown).to_radians()).to_bits(),
            Self::Length => LengthMm::saturating_from_num(shown).to_bits(),
        }
    }

    /// The unit's sign behind a number shown.
    #[must_use]
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Angle => "°",
            Self::Length => " mm",
        }
    }
}

/// Position of joint 3: an angle or a length, as the arm has it. Whoever reads it knows the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Joint3(i32);

impl Joint3 {
    /// A quill at this length.
    #[must_use]
    pub const fn from_length(length: LengthMm) -> Self {
        Self(length.to_bits())
    }

    /// An arm at this angle.
    #[must_use]
    pub const fn from_angle(angle: AngleRad) -> Self {
        Self(angle.to_bits())
    }

    /// Where it is, being a quill.
    #[must_use]
    pub const fn as_length(self) -> LengthMm {
        LengthMm::from_bits(self.0)
    }

    /// Where it is, being an arm.
    #[must_use]
    pub const fn as_angle(self) -> AngleRad {
        AngleRad::from_bits(self.0)
    }

    /// The raw bits of either.
    #[must_use]
    pub const fn to_bits(self) -> i32 {
        self.0
    }

    /// The inverse of [`Joint3::to_bits`].
    #[must_use]
    pub const fn from_bits(bits: i32) -> Self {
        Self(bits)
    }
}

/// Positions of a robot's joints; the doc of each names the SCARA's, then the delta's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JointPosition {
    /// Shoulder, about Z, zero along +X; first arm, zero when level, positive down.
    pub joint1: AngleRad,
    /// Elbow, relative to the upper arm, zero when stretched; second arm.
    pub joint2: AngleRad,
    /// Quill, equal to Z of the tool; third arm.
    pub joint3: Joint3,
    /// Wrist, relative to the forearm; the tool's yaw.
    pub joint4: AngleRad,
}

impl JointPosition {
    /// The raw bits in the order of the joints: 2^-26 rad or, for a quill, 2^-19 mm.
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
            joint3: Joint3::from_bits(joint3),
            joint4: AngleRad::from_bits(joint4),
        }
    }

    /// In rad and mm, exactly.
    #[must_use]
    pub fn values(self, units: [JointUnit; AXES]) -> [f64; AXES] {
        let bits = self.to_bits();
        core::array::from_fn(|joint| units[joint].value(bits[joint]))
    }

    /// In ° and mm, for people.
    #[must_use]
    pub fn shown(self, units: [JointUnit; AXES]) -> [f32; AXES] {
        let bits = self.to_bits();
        core::array::from_fn(|joint| units[joint].shown(bits[joint]))
    }
}

/// What the joints have to do at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointState {
    /// Joint positions.
    pub position: JointPosition,
    /// Joint velocities in rad/s; a quill's in mm/s.
    pub velocity: [f32; AXES],
    /// Joint accelerations in rad/s²; a quill's in mm/s².
    pub acceleration: [f32; AXES],
}
