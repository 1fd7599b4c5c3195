//! Prefilters for a mode whose frequency depends on where the tool is.
//!
//! config ([`ModeMapConfig`]: modes on a grid) → active ([`ModeMap`]). A move reads its
//! [`Course`] from the map, the mode at its start and at its end; the course and a
//! [`Method`] give the [`Zeros`] of two prefilters, one to accelerate through and one to
//! decelerate through, and these the [`Profile`].
//!
//! Where a named prefilter is wanted instead, [`choose`] takes the shortest one whose residual
//! keeps a limit over everything that the mode may be.
//!
//! Tajima stands for: Tajima, Miyashita, Yoshioka: velocity profile generation for industrial robots
//! considering natural frequency variations. Int. J. Automation Technol.

mod automatic;
mod course;
mod follow;
mod map;
mod map_text;
mod method;
mod profile;
mod ramp;
mod zeros;

pub use automatic::{Choice, ChoiceError, Requirement, Shortest, ShortestError, choose};
pub use course::Course;
pub use follow::{
    FollowConfig, FollowError, Follower, MoveToFollow, MoveTunings, PostureMethod, ShortestConfig,
    Tuning,
};
pub use map::{MAP_NODES, MapError, MapNode, ModeMap, ModeMapConfig};
pub use map_text::{MAP_BYTES, MapLine};
pub use method::{Method, MethodChoice, Reason};
pub use profile::{Profile, ProfileError, ProfileState};
pub use ramp::RawRamp;
pub use zeros::Zeros;
