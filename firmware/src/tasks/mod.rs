//! What the firmware does, on any board.

pub mod command;
pub mod control;
pub mod link;
pub mod samples;
pub mod setpoints;
