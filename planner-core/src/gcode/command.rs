//! What a line asks the planner to do.

use crate::corner::CornerRule;
use crate::kinematics::Elbow;
use crate::path::PathSegment;
use crate::pose::Pose;
use crate::prefilter::PrefilterConfig;

/// Output of M3, M4 (on: the gripper closes) and M5.
pub const GRIPPER: u8 = 1 << 0;

/// Output of M7, M8 (on: blow-off) and M9.
pub const BLOW_OFF: u8 = 1 << 1;

/// Most actions that one line asks for: the end of joint moves, outputs, a dwell or an
/// intermediate point, a move, and at the program's end outputs again and the end.
pub const MAX_ACTIONS_A_LINE: usize = 6;

/// The actions of one line, in the order in which they are executed: Grbl's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// A change of the robot, which stands in a line of its own.
    pub robot: Option<RobotChange>,
    /// New state of all outputs, if it changes: [`GRIPPER`] and [`BLOW_OFF`].
    pub outputs: Option<u8>,
    /// Stand still for so many seconds, zero or more (G4).
    pub dwell_s: Option<f32>,
    /// Where the robot is: the first point of a program that began without a position.
    pub reference: Option<Pose>,
    /// A motion to the intermediate point of G28 and G30.
    pub via: Option<Move>,
    /// A motion.
    pub motion: Option<Move>,
    /// New state of all outputs after the motion, if it changes (M2, M30).
    pub outputs_after: Option<u8>,
    /// What becomes of the program.
    pub flow: Option<ProgramFlow>,
}

impl Command {
    /// The motions, in their order.
    pub fn moves(&self) -> impl Iterator<Item = &Move> {
        self.via.iter().chain(&self.motion)
    }

    /// The pick-and-place move.
    #[must_use]
    pub const fn hop(&self) -> Option<&HopMove> {
        match &self.robot {
            Some(RobotChange::Hop(hop)) => Some(hop),
            Some(RobotChange::Prefilter(_) | RobotChange::Elbow(_)) | None => None,
        }
    }
}

/// What M0, M2 and M30 do to the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgramFlow {
    /// M0: stop until the cycle start.
    Pause,
    /// M2, M30: the program is complete.
    End,
}

/// What the robot's own words ask for. It takes effect when everything before it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RobotChange {
    /// M100: this prefilter from here on. Its values are as given, unchecked.
    Prefilter(PrefilterConfig),
    /// M101, M102: the elbow on this side from here on.
    Elbow(Elbow),
    /// M103: a pick-and-place move, from an exact stop to an exact stop.
    Hop(HopMove),
}

/// A pick-and-place move; what is not given is the robot's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HopMove {
    /// Where it starts: at the target of the motion before, bit for bit.
    pub start: Pose,
    /// Where it ends.
    pub target: Pose,
    /// Q: the height over either place within which the path is vertical, in mm.
    pub height_mm: Option<f32>,
    /// R: how far it rises over the higher place, in mm.
    pub rise_mm: Option<f32>,
    /// P: how far the prefilter may bend the vertical parts, in mm.
    pub tolerance_mm: Option<f32>,
    /// K: the acceleration, in mm/s².
    pub acceleration_mm_s2: Option<f32>,
    /// The N word, or the number of the line in its program.
    pub line: u32,
}

/// A motion from where the last one ended. It has a length: in space, or in yaw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Its path. It starts at the target of the motion before, bit for bit.
    pub path: PathSegment,
    /// How fast.
    pub feed: Feed,
    /// How the corner at the **start** of this move is to be passed.
    pub corner: CornerRule,
    /// The N word, or the number of the line in its program; 0 for a jog without N.
    pub line: u32,
}

/// How fast a motion goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feed {
    /// As fast as the robot may (G0).
    Rapid,
    /// Along the path of X, Y and Z, above zero; in **deg/s** for a motion of the yaw alone.
    MmPerS(f32),
    /// The whole motion in so many seconds, above zero (G93).
    Seconds(f32),
}
