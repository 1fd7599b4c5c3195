//! Velocity profile overlap: a tool that moves and turns, its corners rounded by letting the
//! speed of one segment fall while that of the next one rises.
//!
//! config ([`ToolPose`]s, feedrates, a [`CornerRule`](crate::corner::CornerRule) for each corner) →
//! active ([`Segment`], [`SpeedCurve`], [`plan`]) → [`Plan::at`], which keeps no state. It is the same
//! construction as that of the tick, for any orientation and in `f64`.
//!
//! \[Li23\]: Li, Tsai, Zhang, Cheng: smooth interpolation design with corner tolerance
//! constraints for robotics. Appl. Sci. 2023, 13, 8789.

mod corner_overlap;
mod error;
mod plan;
mod segment;
mod speed_curve;
#[cfg(test)]
mod tests;

pub use corner_overlap::{Method, overlap_s};
pub use error::OverlapError;
pub use plan::{Move, Plan, ToolState, plan};
pub use segment::{Segment, ToolPose};
pub use speed_curve::{Demand, SpeedCurve};

fn add(vector: &mut [f64; 3], axis: usize, value: f64) {
    if let Some(part) = vector.get_mut(axis) {
        *part += value;
    }
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    libm::sqrt(x * x + y * y + z * z)
}
