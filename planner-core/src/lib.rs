#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

pub mod accelerometer;
mod arcs;
mod changeover;
mod chords;
pub mod config;
pub mod corner;
mod dense;
pub mod following_error;
pub mod framing;
pub mod gcode;
pub mod hop;
pub mod identify;
pub mod joint_space;
pub mod kinematics;
pub mod limits;
pub mod math;
pub mod motion;
pub mod orientation;
mod outline;
pub mod overlap;
mod passage;
pub mod path;
pub mod planner;
pub mod pose;
pub mod posture;
pub mod prefilter;
pub mod protocol;
pub mod queue;
pub mod rate;
pub mod raw;
mod schedule;
pub mod servo;
mod sort;
pub mod store;
pub mod telemetry;
pub mod units;
mod walker;
