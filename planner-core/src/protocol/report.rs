//! What the control task tells the controller about its last tick.

use crate::motion::Setpoint;
use crate::pose::JointPosition;

/// Inputs of the board; a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Limit inputs of joints 1 to 4, from bit 0.
    pub limits: u8,
    /// The safety door is open.
    pub door: bool,
}

/// What the last tick was like.
#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    /// What left in the tick.
    pub setpoint: Setpoint,
    /// The tool's speed in mm/s.
    pub speed_mm_s: f32,
    /// Orders obeyed since the start.
    pub orders: u32,
    /// The board's inputs.
    pub inputs: Inputs,
    /// What absolute encoders read, if the board has any.
    pub encoders: Option<JointPosition>,
    /// How the controller fares.
    pub health: Health,
}

/// What `$I` tells about the control task and the memory.
#[derive(Clone, Copy, Debug, Default)]
pub struct Health {
    /// Ticks since the start.
    pub ticks: u32,
    /// The dearest tick, in the board's unit.
    pub worst_tick: u32,
    /// Control periods missed since the start.
    pub overruns: u32,
    /// Frames that found no room on their way out.
    pub unsent: u32,
    /// Times the moves ran out before the program ended.
    pub starved: u32,
}
