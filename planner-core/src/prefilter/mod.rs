//! The prefilter: what turns a raw feedrate of steps into one that leaves no vibration.
//!
//! config ([`PrefilterConfig`]: name, frequency, damping) → active ([`Prefilter`]: the
//! cascade of impulses and boxes, in seconds) → machine units ([`Kernel`]: integer taps a
//! tick) → state ([`Convolver`]: the delay line). Planning reads the exact step and ramp
//! [`Response`]; nothing in planning needs a time grid.

mod cascade;
mod config;
mod convolver;
mod kernel;
mod kind;
mod mode;
mod residual;
mod response;
mod shapers;

pub(crate) use cascade::add_box_s;
pub use cascade::{MAX_STAGES, Prefilter, Stage};
pub use config::{CustomImpulse, EI_RESIDUAL, PrefilterConfig, PrefilterError, SecondMode};
pub use convolver::{Convolver, ConvolverPair, FINE_BITS};
pub use kernel::{HALF_SLOTS, Kernel, SLOTS};
pub use kind::Kind;
pub use mode::Mode;
pub use residual::{Band, insensitivity, residual};
pub use response::Response;
pub(crate) use response::{Term, Terms, add_terms, boxes};
pub use shapers::{Impulse, Impulses, MAX_IMPULSES};
