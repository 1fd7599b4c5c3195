//! Plants: robots in double precision that answer the planner's setpoints.
//!
//! The *vibration* of either plant is the acceleration of its tool, as an
//! accelerometer there reads it ([`crate::vibration`]).

pub mod arm;
pub mod body;
pub mod config;
pub mod delta_arm;
pub mod full;
pub mod ideal;
pub mod mode;
pub mod pendulum;
pub mod travelling;

#[cfg(test)]
mod full_tests;

pub use arm::{Elbow, ScaraArm};
pub use body::Body;
pub use config::{FullConfig, ModeMap};
pub use delta_arm::DeltaArm;
pub use full::{FullPlant, JointSetpoint, PlantOutput};
pub use ideal::{IdealOutput, IdealPlant};
pub use mode::Mode;
pub use pendulum::{PayloadConfig, PayloadSample, Pendulum};
pub use travelling::{Answer, Base, Travel};
