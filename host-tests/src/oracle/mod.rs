//! The reference in double precision: what the planner should have computed.
//!
//! It shares no code with the planner and takes no short cuts: responses are sums
//! of truncated powers, the closest approach at a corner is searched over every
//! kink, and the command is the sum of the segments' displacements at a real time
//! `t`, without a tick.

pub mod corner;
pub mod path;
pub mod posture;
pub mod prefilter;
pub mod rotation;
pub mod servo;

pub use corner::{Corner, CornerSolution, Leg};
pub use path::{Geometry, Path, Schedule, Segment};
pub use prefilter::{NAMES, Options, Prefilter};
