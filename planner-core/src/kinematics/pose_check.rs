//! Whether the arm can take a pose.

use super::scara::{HALF_TURN, MM_PER_LSB, RAD_PER_LSB, Scara, squared_radius};
use crate::pose::{JointPosition, JointUnit, Pose};
use core::{f32::consts::PI, fmt};

/// Why a pose cannot be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PoseError {
    /// The tool would be further from the shoulder, or closer, than the links allow.
    Unreachable {
        /// Horizontal distance of the pose from the shoulder.
        distance_mm: f32,
        /// Closest distance that the links reach.
        min_mm: f32,
        /// Furthest distance that the links reach.
        max_mm: f32,
    },
    /// The arm would be nearly stretched or nearly folded.
    NearSingular {
        /// Joint 2 at this pose.
        joint2_deg: f32,
        /// What it must keep from 0° and 180°.
        margin_deg: f32,
    },
    /// A delta's arm would not reach the platform.
    ArmUnreachable {
        /// 1 to 3.
        arm: u8,
        /// Distance of the platform from the shoulder in the arm's plane.
        distance_mm: f32,
        /// Closest distance that the arm reaches there.
        min_mm: f32,
        /// Furthest distance that the arm reaches there.
        max_mm: f32,
    },
    /// A delta's forearm would nearly lie in the plane of its upper arm and its shoulder's axis.
    NearSerial {
        /// 1 to 3.
        arm: u8,
        /// Its angle to that plane.
        angle_deg: f32,
        /// What it must keep.
        margin_deg: f32,
    },
    /// A delta's three forearms would nearly lie in one plane.
    NearParallel {
        /// The volume that their directions span; 1 at right angles.
        volume: f32,
        /// What it must be.
        margin: f32,
    },
    /// A joint would be beyond its travel.
    JointLimit {
        /// 1 to 4.
        joint: u8,
        /// Its position at this pose in ° or mm.
        value: f32,
        /// Its lowest position, in the same unit.
        min: f32,
        /// Its highest position, in the same unit.
        max: f32,
        /// Which unit that is.
        unit: JointUnit,
    },
}

impl fmt::Display for PoseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Unreachable {
                distance_mm,
                min_mm,
                max_mm,
            } => write!(
                f,
                "the tool would be {distance_mm:.3} mm from the shoulder, the arm reaches from {min_mm:.3} to {max_mm:.3} mm"
            ),
            Self::NearSingular {
                joint2_deg,
                margin_deg,
            } => write!(
                f,
                "the elbow would be at {joint2_deg:.3}°, within {margin_deg:.3}° of stretched or folded"
            ),
            Self::ArmUnreachable {
                arm,
                distance_mm,
                min_mm,
                max_mm,
            } => write!(
                f,
                "the platform would be {distance_mm:.3} mm from the shoulder of arm {arm}, which reaches from {min_mm:.3} to {max_mm:.3} mm there"
            ),
            Self::NearSerial {
                arm,
                angle_deg,
                margin_deg,
            } => write!(
                f,
                "the forearm of arm {arm} would be {angle_deg:.3}° from the plane of its upper arm, closer than {margin_deg:.3}°"
            ),
            Self::NearParallel { volume, margin } => write!(
                f,
                "the forearms would nearly lie in one plane: they would span {volume:.4}, less than {margin:.4}"
            ),
            Self::JointLimit {
                joint,
                value,
                min,
                max,
                unit,
            } => {
                let unit = unit.sign();
                write!(
                    f,
                    "joint {joint} would be at {value:.3}{unit}, its travel is {min:.3} to {max:.3}{unit}"
                )
            }
        }
    }
}

impl core::error::Error for PoseError {}

impl Scara {
    /// The joints at `pose`, if all limits hold there: reach, singularity margin, joint travels.
    /// Cost on a Cortex-M4: 415 instructions.
    ///
    /// # Errors
    /// The first limit that does not hold, in that order.
    pub fn check(&self, pose: &Pose) -> Result<JointPosition, PoseError> {
        let squared = squared_radius(pose);
        if squared > self.outer_squared || squared < self.inner_squared {
            return Err(PoseError::Unreachable {
                distance_mm: root_mm(squared),
                min_mm: root_mm(self.inner_squared),
                max_mm: root_mm(self.outer_squared),
            });
        }
        let joints = self.inverse(pose);
        let bend = joints.joint2.to_bits().wrapping_abs();
        if bend < self.singularity_margin || bend > HALF_TURN - self.singularity_margin {
            return Err(PoseError::NearSingular {
                joint2_deg: degrees(joints.joint2.to_bits()),
                margin_deg: degrees(self.singularity_margin),
            });
        }
        for ((joint, value), (min, max)) in (1..).zip(joints.to_bits()).zip(self.limits) {
            if value < min || value > max {
                return Err(self.joint_limit_error(joint, value));
            }
        }
        Ok(joints)
    }

    /// Joint `joint` (1 to 4) at `value` is beyond its travel.
    pub(super) fn joint_limit_error(&self, joint: u8, value: i32) -> PoseError {
        let (min, max) = self
            .limits
            .get(usize::from(joint).wrapping_sub(1))
            .copied()
            .unwrap_or_default();
        let unit = if joint == 3 {
            JointUnit::Length
        } else {
            JointUnit::Angle
        };
        joint_limit(joint, value, (min, max), unit)
    }
}

/// Joint `joint` (1 to 4) at `value` is beyond its travel.
pub(super) fn joint_limit(
    joint: u8,
    value: i32,
    (min, max): (i32, i32),
    unit: JointUnit,
) -> PoseError {
    let shown = |bits: i32| match unit {
        JointUnit::Angle => degrees(bits),
        JointUnit::Length => bits as f32 * MM_PER_LSB,
    };
    PoseError::JointLimit {
        joint,
        value: shown(value),
        min: shown(min),
        max: shown(max),
        unit,
    }
}

/// The root in millimetres of a number of 2^-38 mm². Not for the tick: a root of `libm`.
pub(super) fn root_mm(squared: u64) -> f32 {
    libm::sqrtf(squared as f32) * MM_PER_LSB
}

/// AngleRad bits to degrees, for messages.
fn degrees(angle: i32) -> f32 {
    angle as f32 * RAD_PER_LSB * (180.0 / PI)
}
