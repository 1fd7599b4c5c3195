//! The prefilter: what turns a raw feedrate of steps into one that leaves no vibration.
//!
//! config ([`PrefilterConfig`]: name, frequency, damping) → active ([`Prefilter`]: the
//! cascade of impulses and boxes, in seconds) → machine units ([`Kernel`]: integer taps a
//! tick) → state ([`Convolver`]: the delay line). Planning reads the exact step and ramp
//! [`Response`]; nothing in planning needs a time grid.
//!
//! # Modes along axes
//! A mode may swing along some axes only ([`PrefilterConfig::axes`]): an arm that is soft across
//! and stiff along it, a quill that hangs on its belt. A move along none of them does not excite
//! it, and needs no prefilter for it. A move along the axes of both modes has both prefilters in
//! cascade, **on all of its coordinates**. Each coordinate with a kernel of its own, as 3-D
//! printers have it, would not keep to the line: at feedrate `F` and heading `φ`, with `I` the
//! ramp responses and `m` the mean delays of the kernels of X and Y, the command would be off by
//!
//! ```text
//! F |cos φ sin φ| |I_x(t) − I_y(t)|   →   ½ F |sin 2φ| |m_x − m_y|   at constant feedrate,
//! ```
//!
//! 6.7 mm at 160 mm/s and 45° between FIR-ZVD for 6 Hz and FIR-ZV for 9 Hz; no tolerance could
//! be promised.
//!
//! The planner knows a move when its line comes, and no move behind it. So a mode that comes in
//! is added where the path then stops, as a change of the prefilter in a program does; a mode that
//! is not needed any more is left out where the path stands anyway: at its begin, behind a dwell,
//! an output, a pause or an exact stop. A dense path thus stops once for each mode at the most. A
//! turn of the yaw counts as X and Y, an arc goes along both, and a helix along Z besides. Moves of
//! joints and hops have all modes: hops choose their axes by [`crate::hop::HopAxes`].

mod axis_set;
mod cascade;
mod config;
mod convolver;
mod kernel;
mod kind;
mod mode;
mod residual;
mod response;
mod shapers;

pub use axis_set::AxisSet;
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
