//! An arm with limit switches, as far as homing sees it.

use planner_core::motion::Setpoint;
use planner_core::pose::{AXES, JointPosition};

/// Where a limit switch is.
#[derive(Clone, Copy, Debug)]
pub struct LimitSwitch {
    /// Where it becomes active, in bits of a [`JointPosition`].
    pub position: i32,
    /// Active from there up, not down.
    pub is_upper: bool,
    /// What it reads whatever the joint does.
    pub stuck: Option<bool>,
}

/// Follows the changes of the setpoints from a position that the controller is not told.
#[derive(Clone, Copy, Debug)]
pub struct SwitchedArm {
    joints: [i32; AXES],
    setpoint: Option<[i32; AXES]>,
    /// The limit switches of joints 1 to 4.
    pub switches: [LimitSwitch; AXES],
}

impl SwitchedArm {
    /// An arm that stands there.
    #[must_use]
    pub fn new(joints: JointPosition, switches: [LimitSwitch; AXES]) -> Self {
        Self {
            joints: joints.to_bits(),
            setpoint: None,
            switches,
        }
    }

    /// Where the joints are.
    #[must_use]
    pub fn joints(&self) -> JointPosition {
        JointPosition::from_bits(self.joints)
    }

    /// The limit inputs, joint 1 in bit 0.
    #[must_use]
    pub fn limits(&self) -> u8 {
        let pairs = self.joints.into_iter().zip(self.switches);
        pairs.enumerate().fold(0, |bits, (joint, (at, switch))| {
            let is_beyond = if switch.is_upper {
                at >= switch.position
            } else {
                at <= switch.position
            };
            bits | u8::from(switch.stuck.unwrap_or(is_beyond)) << joint
        })
    }

    /// Goes where the drives are sent, unless the setpoint only says where they are.
    pub fn follow(&mut self, setpoint: &Setpoint) {
        let position = setpoint.joints.position.to_bits();
        let last = self.setpoint.replace(position);
        if let Some(last) = last.filter(|_| !setpoint.placed) {
            for ((joint, to), from) in self.joints.iter_mut().zip(position).zip(last) {
                *joint += to - from;
            }
        }
    }
}
