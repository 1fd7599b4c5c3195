//! Limits of velocity, acceleration and jerk: of the joints, along the path, along the axes.
//!
//! They hold at every tick, by the feed that a segment gets and by the time that the raw path
//! stands at its corners. Nothing looks ahead: a segment is timed when its line comes, from
//! itself and what came before it.
//!
//! # What the command does
//! The raw path moves with speed `F` or stands. The prefilter has boxes of length `T1 ≥ T2`; the
//! command's place c is a mean of raw points over the last `T_h`, and with `v` the raw velocity
//!
//! ```text
//! ċ  = mean of v                                       |ċ| ≤ max F
//! c̈  = mean of [v(t) − v(t − T1)] / T1                 |c̈| ≤ max Δ / T1
//! c⃛  = mean of [Δ(t) − Δ(t − T2)] / (T1 T2)            |c⃛| ≤ 2 max Δ / (T1 T2)
//! ```
//!
//! where `Δ = |v(t) − v(t − T1)|` is at most `F` while only one segment is started, held and
//! resumed, as often as one likes. On an arc of curvature κ the *progress* is filtered, and the
//! curve adds `κF²` to c̈ and `3κF·F/T1 + κ²F³` to c⃛. Both are put into one number, the **load**
//!
//! ```text
//! e = F + κF² T1 for accelerations,   e = F + 3/2 κF² T2 + κF² T1 + ½ κ²F³ T1 T2 for jerks:
//! |c̈| ≤ e / T1,   |c⃛| ≤ 2e / (T1 T2)
//! ```
//!
//! (On an arc shorter than `F T1` one factor F of κF², two of κ²F³, are its length by `T1`: the box
//! spreads it.)
//!
//! # The condition on a segment
//! With the bounds g, h and d of [`crate::kinematics::RateBounds`] each joint keeps its limits if
//!
//! ```text
//! g F ≤ V,   g e/T1 + h e² ≤ A,   g 2e/(T1 T2) + 3h e²/T1 + d e³ ≤ J
//! ```
//!
//! wherever the command can be. **It is required wherever the tool is within `e·m` of the
//! segment** (within `F_max m` if that is less, `F_max` the robot's fastest feedrate), m the largest
//! mean delay of the prefilter seen from either end. That is enough
//! without knowing what follows: of the segments that move the raw point within a window of
//! `T_h` take the one with the largest load e*. All loads and speeds are at most e*, so the
//! command is within `e*·m` of every raw point of the window, hence of that segment; there its
//! condition bounds the joints for load e*, the more so for what the window really holds.
//!
//! The joints of a SCARA follow the tool's way in the plane, and joint 3 is its height; the arms
//! of a delta robot follow its way in space, and joint 4 is the yaw alone.
//!
//! Joint 4 of a SCARA is `c − θ1 − θ2`. The yaw's part of its limits and the tool's add up: the duration is
//! that for the tool alone and that for the yaw alone together. All left sides grow at least in proportion
//! to the duration's inverse, so that shares of a limit add up to at most the whole also where
//! several segments share a window.
//!
//! # Corners
//! The above needs `Δ ≤ e` across corners too. It holds
//! - if the raw path stands for `T1` (for `T1 + T2` with a limit of jerk): then every pair of
//!   instants sees one segment only;
//! - if each of the segments keeps the limits at **twice** its load: Δ is at most the sum;
//! - between lines that turn, all corners together that a pair of instants can span, by at most
//!   60°: then `|v₂ − v₁| ≤ max F`. No axis may reverse in between and no yaw turn.
//!
//! [`Run`] keeps what is needed of the past, and chooses for each segment what is fastest:
//! its full feed with a stop where one must be, or half of it and no stop.
//!
//! # Prefilters that follow the mode
//! With a map of the mode, or a choice for each move, the prefilter changes. All of the above
//! still holds, because the command never is anything but the mean of one raw path through one
//! prefilter:
//! - **At rest** the next filter is put at the point where everything stands: its window holds
//!   nothing else.
//! - **On the way** of a line the command passes over once both windows have seen nothing but
//!   one even motion on it. Before that instant it is a mean through
//!   the first filter; from it on, through the second one, of a raw path that has always been on
//!   this line and goes on from where it is now. Both means agree there, with their derivatives,
//!   but for a rounding of 2^-19 mm, which is faded out. So no window and no pair of instants of
//!   the second filter reaches back before the line: [`Run`] begins anew on it.
//! - **Held, slowed or hurried**, a motion is not even: the second filter is fed anew, and if the
//!   line ends before it has seen enough, the next segment waits for the change at rest. An arc
//!   keeps its filter until it has settled, since the change waits for that as well.
//!
//! Which prefilters a segment goes through is chosen after its duration, and from it. So its
//! condition is required for all that they can be: the one in force before it, and those for
//! every mode along it. Their boxes are within a [`BoxRange`]: each is as long as the settings
//! say or a damped period, and of lengths that grow the n-th longest grows as well. Of the left
//! sides above, `1/T1` and `1/(T1 T2)` fall with the boxes' lengths, and the loads grow with them:
//! with the shortest boxes in the former and the longest in the latter (for the box that spreads
//! a short arc again the shortest) they are at least those of each prefilter in the range. m is
//! the largest that the map can make. What a corner asks for, the stop and the pairs of
//! instants, is a matter of the prefilter in force there.
//!
//! Limits give boxes to prefilters that have too few, as smoothing: the same lengths to all of
//! them, so that this goes for pure shapers too. One more box never leaves more of a mode, since V
//! is a product over the stages and `|∫₀ᵀ e^{(ζω ± jω_d)(t − T)} dt| / T ≤ 1`: the automatic choice
//! keeps its residual limit.
//!
//! # Never a stall
//! Conditions only get easier as the duration grows, and hold in the limit: the region shrinks to
//! the segment, over which the bounds are finite because the singularity margin has been
//! checked, and because corners are rounded within a part of what it leaves. A duration times the
//! largest quotient of left and right side always keeps them.
//!
//! Overrides above 100 % are capped at the duration that keeps the limits; below, and in holds,
//! everything only gets slower.
//!
//! # Hops
//! A pick-and-place move is slowed down as a whole, by [`Limits::hop_slowdown`].

mod box_range;
mod config;
mod course;
mod feed;
mod hop;
mod joint_move;
mod run;

pub use box_range::BoxRange;
pub use config::{Bound, Limited, LimitsConfig, MotionLimits, Order, Part};
pub use course::{Course, Region};
pub use feed::{Limits, add_boxes};
pub use hop::HopSlowdown;
pub use run::{Choice, Run};
