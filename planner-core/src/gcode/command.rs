//! What a line asks the planner to do.

use crate::path::PathSegment;
use crate::pose::Pose;

/// The action of one line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Nothing but modal state, or a move that ends where it starts.
    Nothing,
    /// Where the robot is: the first point of a program that began without a position.
    Reference(Pose),
    /// A motion.
    Move(Move),
    /// Stand still (G4).
    Dwell {
        /// For how long; zero or more.
        seconds: f32,
    },
    /// Stop (M0). The planner stops the robot there and goes on.
    Pause,
    /// The program is complete (M2, M30).
    End,
}

/// A motion from where the last one ended. It has a length: in space, or in yaw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Its path. It starts at the target of the motion before, bit for bit.
    pub path: PathSegment,
    /// How fast.
    pub feed: Feed,
    /// Largest miss of the corner at the **start** of this move; 0 is an exact stop.
    pub corner_tolerance_mm: f32,
    /// The N word, or the number of the line in its program.
    pub line: u32,
}

/// How fast a motion goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feed {
    /// As fast as the robot may (G0).
    Rapid,
    /// Along the path of X, Y and Z, above zero; in **deg/s** for a motion of the yaw alone.
    MmPerS(f32),
}
