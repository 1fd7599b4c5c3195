//! Prefilters for a mode whose frequency depends on where the tool is.
//!
//! A move's [`Course`] holds the mode at its start and at its end; it and a [`Method`] give the
//! [`Zeros`] of two prefilters, one to accelerate through and one to decelerate through, and
//! these the [`Profile`].
//!
//! Tajima stands for: Tajima, Miyashita, Yoshioka: velocity profile generation for industrial robots
//! considering natural frequency variations. Int. J. Automation Technol.

mod course;
mod method;
mod profile;
mod ramp;
mod zeros;

pub use course::Course;
pub use method::{Method, MethodChoice, Reason};
pub use profile::{Profile, ProfileError, ProfileState};
pub use ramp::RawRamp;
pub use zeros::Zeros;
