//! What a drive does between two setpoints: from 1 kHz setpoints to a torque at 8 kHz.
//!
//! The structure is that of vNoorden21 (van Noorden: delta robot motion stabilization for
//! flexible packaging, MSc thesis, TU/e, 2021): a cubic between setpoints, a position loop
//! around a velocity loop, and feed-forward of velocity and acceleration. It runs on the
//! microcontroller of a drive, or against a simulated joint; nothing of the planner is needed.
//!
//! config ([`ServoConfig`]: SI units; of it the [`ServoGains`] are settings of the controller) → active and state ([`Servo`], one a joint). Setpoints
//! ([`Knot`]) and encoder readings are positions in machine units.

mod cascade;
mod config;
mod cubic;
mod observer;

pub use cascade::Servo;
pub use config::{GAINS, GainRange, ServoConfig, ServoError, ServoGains, Travel};
pub use cubic::{Cubic, Knot, SIXTEENTHS};

/// Drive cycles in a control tick.
pub const CYCLES_PER_TICK: u32 = 8;

/// Drive cycles a second.
pub const CYCLE_HZ: u32 = CYCLES_PER_TICK * crate::units::TICK_HZ;

/// A drive cycle in seconds.
const CYCLE_S: f32 = 1.0 / CYCLE_HZ as f32;
