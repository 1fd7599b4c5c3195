//! From where the tool is to where the joints are, and back.
//!
//! [`Arm`] is the robot's, whichever kind it is.
//!
//! [`ScaraConfig`] or [`DeltaConfig`] (millimetres, degrees) is validated once into a [`Scara`] or
//! [`Delta`] (machine units), which every tick maps poses to joint states: [`Arm::joint_state`]
//! cannot fail. What could fail, a path that leaves the workspace, is found before motion by
//! [`Arm::check`] for a pose and [`Arm::check_segment`] for everything between two.

mod arm;
mod config;
mod delta;
mod delta_bounds;
mod delta_check;
mod delta_config;
mod delta_forward;
mod pose_check;
mod rate_bounds;
mod scara;
mod segment_check;

pub use arm::{Arm, ArmBounds, ArmKind};
pub use config::{Elbow, JointRange, ScaraConfig, ScaraError};
pub use delta::Delta;
pub use delta_bounds::{DeltaBounds, Spans, Sweep};
pub use delta_config::{DeltaConfig, DeltaError};
pub use pose_check::PoseError;
pub use rate_bounds::{RateBounds, Ring, RingBounds};
pub use scara::Scara;
pub use segment_check::{Curve, SegmentError, Travel};
