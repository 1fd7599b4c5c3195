//! The moving parts of a robot behind its joints: which arm it is, and how it answers torques.

use super::arm::{ArmInertia, Elbow, ScaraArm};
use super::config::JOINTS;
use super::delta_arm::DeltaArm;

/// Links or arms of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    /// A SCARA: two links, a quill and a wrist.
    Scara {
        /// Lengths of the links.
        arm: ScaraArm,
        /// Inertia of the links.
        inertia: ArmInertia,
    },
    /// A delta robot: three arms, and yaw.
    Delta(DeltaArm),
}

/// What acts on a body, SI units.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    /// Torque, or a quill's force, at each joint.
    pub torque: [f64; JOINTS],
    /// Inertia of what turns, or of a quill, on its own.
    pub inertia: [f64; JOINTS],
    /// Force on the flange in X and Y, N.
    pub pull: [f64; 2],
}

/// How it moves under a load.
#[derive(Clone, Copy, Debug)]
pub struct Accelerations {
    /// Of the joints: rad/s², a quill's m/s².
    pub joints: [f64; JOINTS],
    /// Of the flange, m/s².
    pub flange: [f64; 3],
}

impl Body {
    /// SI units per unit of a joint: radians, and metres per millimetre of a quill.
    #[must_use]
    pub const fn si(&self) -> [f64; JOINTS] {
        match self {
            Self::Scara { .. } => [1.0, 1.0, 1e-3, 1.0],
            Self::Delta(_) => [1.0; JOINTS],
        }
    }

    /// Pose `[x, y, z, c]` (mm, degrees) at joints in rad, a quill's in mm.
    #[must_use]
    pub fn forward(&self, q: [f64; JOINTS]) -> [f64; 4] {
        match self {
            Self::Scara { arm, .. } => arm.forward(q),
            Self::Delta(delta) => delta.forward(q),
        }
    }

    /// Joints at a pose, a SCARA's elbow to the right; `None` out of reach.
    #[must_use]
    pub fn inverse(&self, pose: [f64; 4]) -> Option<[f64; JOINTS]> {
        match self {
            Self::Scara { arm, .. } => arm.inverse(pose, Elbow::Right),
            Self::Delta(delta) => delta.inverse(pose),
        }
    }

    /// Velocity of the flange in X and Y, m/s, at SI rates.
    #[must_use]
    pub fn flange_velocity(&self, q: [f64; JOINTS], rates: [f64; JOINTS]) -> [f64; 2] {
        match self {
            Self::Scara { arm, .. } => arm
                .jacobian(q)
                .map(|row| 1e-3 * (row[0] * rates[0] + row[1] * rates[1])),
            Self::Delta(delta) => {
                let [r1, r2, r3, _] = rates;
                let [x, y, _] = delta.velocity(q, [r1, r2, r3]);
                [x, y]
            }
        }
    }

    /// Kinetic energy in joules at SI rates.
    #[must_use]
    pub fn kinetic_j(&self, q: [f64; JOINTS], rates: [f64; JOINTS], inertia: [f64; JOINTS]) -> f64 {
        let own = |joint: usize| 0.5 * inertia[joint] * rates[joint].powi(2);
        match self {
            Self::Scara { inertia, .. } => {
                inertia.kinetic_j(q[1], [rates[0], rates[1]]) + own(2) + own(3)
            }
            Self::Delta(delta) => {
                let [r1, r2, r3, _] = rates;
                delta.kinetic_j(q, [r1, r2, r3]) + own(3)
            }
        }
    }

    /// Accelerations at SI rates.
    #[must_use]
    pub fn accelerations(
        &self,
        q: [f64; JOINTS],
        rates: [f64; JOINTS],
        load: &Load,
    ) -> Accelerations {
        let own = |joint: usize| load.torque[joint] / load.inertia[joint];
        let pull = load.pull;
        match self {
            Self::Scara { arm, inertia } => {
                let jacobian = arm.jacobian(q);
                let torque = |joint: usize| {
                    let lever = jacobian[0][joint] * pull[0] + jacobian[1][joint] * pull[1];
                    load.torque[joint] + 1e-3 * lever
                };
                let rates = [rates[0], rates[1]];
                let links = inertia.acceleration(q[1], rates, [torque(0), torque(1)]);
                let [x, y] = arm.tool_acceleration(q, rates, links);
                Accelerations {
                    joints: [links[0], links[1], own(2), own(3)],
                    flange: [x * 1e-3, y * 1e-3, own(2)],
                }
            }
            Self::Delta(delta) => {
                let [r1, r2, r3, _] = rates;
                let [t1, t2, t3, _] = load.torque;
                let pull = [pull[0], pull[1], 0.0];
                let (arms, flange) = delta.accelerations(q, [r1, r2, r3], [t1, t2, t3], pull);
                Accelerations {
                    joints: [arms[0], arms[1], arms[2], own(3)],
                    flange,
                }
            }
        }
    }
}
