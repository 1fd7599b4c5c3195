//! The seam between the robots: which arm it is, and what planning and the tick ask of it.

use super::config::Elbow;
use super::delta::Delta;
use super::delta_bounds::DeltaBounds;
use super::pose_check::PoseError;
use super::rate_bounds::RingBounds;
use super::scara::Scara;
use super::segment_check::{Curve, SegmentError};
use crate::pose::{AXES, JointPosition, JointState, JointUnit, Pose};

/// The kinds of robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ArmKind {
    /// Two links, a quill and a wrist.
    #[default]
    Scara,
    /// Three arms on a base, and yaw.
    Delta,
}

impl ArmKind {
    /// What the positions of joints 1 to 4 count.
    #[must_use]
    pub const fn joint_units(self) -> [JointUnit; AXES] {
        match self {
            Self::Scara => [
                JointUnit::Angle,
                JointUnit::Angle,
                JointUnit::Length,
                JointUnit::Angle,
            ],
            Self::Delta => [JointUnit::Angle; AXES],
        }
    }
}

/// A validated robot arm in machine units: immutable, shared by the planner and the tick.
///
/// One `match` a call and nothing dynamic, so that the tick knows what it costs.
#[derive(Clone, Debug)]
pub enum Arm {
    /// A SCARA.
    Scara(Scara),
    /// A delta robot.
    Delta(Delta),
}

/// The shape of an arm, for bounds on what its joints do.
#[derive(Clone, Copy, Debug)]
pub enum ArmBounds {
    /// Of a SCARA, which looks the same from every side: they depend on the radius.
    Scara(RingBounds),
    /// Of a delta robot, which does not.
    Delta(DeltaBounds),
}

impl ArmBounds {
    /// Which kind of robot it is.
    #[must_use]
    pub const fn kind(&self) -> ArmKind {
        match self {
            Self::Scara(_) => ArmKind::Scara,
            Self::Delta(_) => ArmKind::Delta,
        }
    }
}

impl Arm {
    /// Which kind of robot it is.
    #[must_use]
    pub const fn kind(&self) -> ArmKind {
        match self {
            Self::Scara(_) => ArmKind::Scara,
            Self::Delta(_) => ArmKind::Delta,
        }
    }

    /// Joint positions at a pose: [`Scara::inverse`], [`Delta::inverse`].
    #[must_use]
    pub fn inverse(&self, pose: &Pose) -> JointPosition {
        match self {
            Self::Scara(scara) => scara.inverse(pose),
            Self::Delta(delta) => delta.inverse(pose),
        }
    }

    /// Positions, velocities and accelerations of the joints for a moving tool:
    /// [`Scara::joint_state`], [`Delta::joint_state`].
    #[must_use]
    pub fn joint_state(
        &self,
        pose: &Pose,
        velocity: [f32; AXES],
        acceleration: [f32; AXES],
    ) -> JointState {
        match self {
            Self::Scara(scara) => scara.joint_state(pose, velocity, acceleration),
            Self::Delta(delta) => delta.joint_state(pose, velocity, acceleration),
        }
    }

    /// Where the tool is with the joints at `joints`: [`Scara::forward`], [`Delta::forward`].
    #[must_use]
    pub fn forward(&self, joints: &JointPosition) -> Pose {
        match self {
            Self::Scara(scara) => scara.forward(joints),
            Self::Delta(delta) => delta.forward(joints),
        }
    }

    /// Change of the pose per change of each joint: [`Scara::jacobian`], [`Delta::jacobian`].
    #[must_use]
    pub fn jacobian(&self, joints: &JointPosition) -> [[f32; AXES]; AXES] {
        match self {
            Self::Scara(scara) => scara.jacobian(joints),
            Self::Delta(delta) => delta.jacobian(joints),
        }
    }

    /// The joints at `pose`, if all limits hold there: [`Scara::check`], [`Delta::check`].
    ///
    /// # Errors
    /// The first limit that does not hold.
    pub fn check(&self, pose: &Pose) -> Result<JointPosition, PoseError> {
        match self {
            Self::Scara(scara) => scara.check(pose),
            Self::Delta(delta) => delta.check(pose),
        }
    }

    /// Checks every pose of a segment against all limits: [`Scara::check_segment`], [`Delta::check_segment`].
    ///
    /// # Errors
    /// The first violation found and where it is.
    pub fn check_segment(&self, curve: &impl Curve) -> Result<(), SegmentError> {
        match self {
            Self::Scara(scara) => scara.check_segment(curve),
            Self::Delta(delta) => delta.check_segment(curve),
        }
    }

    /// The shape of the arm, for bounds on what its joints do. Not for the tick.
    #[must_use]
    pub fn bounds(&self) -> ArmBounds {
        match self {
            Self::Scara(scara) => ArmBounds::Scara(scara.ring_bounds()),
            Self::Delta(delta) => ArmBounds::Delta(delta.bounds()),
        }
    }

    /// Changes the side of the elbow; a robot without one stays as it is.
    pub fn set_elbow(&mut self, elbow: Elbow) {
        match self {
            Self::Scara(scara) => scara.set_elbow(elbow),
            Self::Delta(_) => {}
        }
    }

    /// The side of the elbow with the joints at `joints`; `None` for a robot without one.
    #[must_use]
    pub fn elbow_at(&self, joints: &JointPosition) -> Option<Elbow> {
        match self {
            Self::Scara(_) => Some(Elbow::of(joints.joint2)),
            Self::Delta(_) => None,
        }
    }
}
