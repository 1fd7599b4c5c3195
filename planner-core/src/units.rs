//! Machine units: what the planner counts in.
//!
//! Settings arrive in SI units and degrees; everything that the tick touches is
//! one of the fixed-point formats below, so that a trace has the same bits on
//! every machine.

use fixed::types::{I6F26, I13F19};

/// A length or coordinate in millimetres: ±4096 mm, resolution 1.9 nm.
pub type LengthMm = I13F19;

/// A programmed orientation in degrees: ±4096°, resolution 1.9e-6° (33 nrad).
pub type AngleDeg = I13F19;

/// A joint angle in radians: ±32 rad, resolution 15 nrad (5 nm at 350 mm).
pub type AngleRad = I6F26;

/// Control ticks per second.
pub const TICK_HZ: u32 = 1_000;

/// One control tick in seconds.
pub const TICK_S: f64 = 1.0 / TICK_HZ as f64;
