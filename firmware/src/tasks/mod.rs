//! What the firmware does, on any board.

pub mod command;
pub mod control;
mod cycle_start;
mod inbox;
pub mod link;
pub mod setpoints;
mod text;
