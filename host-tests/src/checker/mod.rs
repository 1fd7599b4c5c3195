//! The independent checker: what a trace did, measured against its program.
//!
//! It shares nothing with the planner nor with the oracle: its own reading of the
//! G-code, its own geometry, no model of prefilters. All functions are pure.

pub mod hops;
pub mod joints;
pub mod limits;
pub mod matching;
pub mod program;
pub mod report;
pub mod sections;
pub mod tolerance;

pub use joints::{JointPeaks, joint_peaks, settling_time_s};
pub use program::{Program, ProgramError};
pub use report::{CheckOptions, CornerCheck, Report, TraceRow};
pub use sections::check;
pub use tolerance::{ToleranceUse, tolerance_use};
