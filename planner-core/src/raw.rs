//! The raw path in machine units: what the planner hands to the tick.
//!
//! Time counts in 2^-32 ticks, so that segments begin and end between ticks; progress along
//! a segment counts in 2^-62 of the segment; an arc is its chord, which is filtered with the
//! lines, plus its bow, which is a function of the filtered progress.

use crate::hop::Hop;
use crate::math::sin_cos;
use crate::path::PathSegment;
use crate::path::{Arc, Shape};
use crate::pose::{AXES, JointPosition, Pose};
use crate::rate::Rate;
use crate::units::{TICK_HZ, TICK_S};

/// A time in 2^-32 ticks (0.23 ps).
pub type TickTime = i64;

/// One tick as a [`TickTime`].
pub const ONE_TICK: TickTime = 1 << 32;

/// Progress along a whole segment: 1 in 2^-62.
pub const WHOLE: u64 = 1 << 62;

/// Progress along a whole segment as the filters see it: 1 in 2^-30.
pub const UNIT: i32 = 1 << 30;

/// Longest duration of a segment in seconds (a day), far within [`TickTime`].
pub const LONGEST_S: f64 = 86_400.0;

/// A time in seconds as a [`TickTime`], rounded to nearest.
#[must_use]
pub fn tick_time(seconds: f64) -> TickTime {
    libm::round(seconds * f64::from(TICK_HZ) * ONE_TICK as f64) as TickTime
}

/// A segment of the raw path: constant feedrate from start to target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawSegment {
    /// Pose at the start, in bits of [`Pose`].
    pub start: [i32; AXES],
    /// Pose at the end, in bits of [`Pose`].
    pub target: [i32; AXES],
    /// How long it lasts; at least one tick.
    pub duration: TickTime,
    /// Progress a tick, in 2^-62 of the segment.
    pub rate: u64,
    /// How long before the deceleration of the segment before ends it begins to accelerate;
    /// 0 after an exact stop, below 0 after one that lasts longer.
    pub overlap: TickTime,
    /// What an arc adds to its chord.
    pub bow: Option<Bow>,
    /// The highest rate at which it may be walked, from [`Rate::ONE`] on.
    pub top_rate: Rate,
    /// What sets its rate.
    pub pace: Pace,
    /// Whether the oldest kernel that waits becomes the prefilter on its way.
    pub changes_over: bool,
    /// It is a hop: the oldest one that waits beside the segments says where it goes.
    pub is_hop: bool,
    /// The number of the line that it comes from, for status reports.
    pub line: u32,
}

/// Which override a segment follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// That of feedrates (G1 to G3).
    Feed,
    /// That of rapids (G0).
    Rapid,
    /// None, because nothing moves (G4).
    #[default]
    StandStill,
}

impl RawSegment {
    /// A segment that takes `duration_s` (one tick to [`LONGEST_S`]), after an exact stop and
    /// no faster than that.
    #[must_use]
    pub fn new(path: &PathSegment, duration_s: f64) -> Self {
        let duration = tick_time(duration_s).max(ONE_TICK);
        let ticks = duration as f64 / ONE_TICK as f64;
        Self {
            start: path.start.to_bits(),
            target: path.target.to_bits(),
            duration,
            rate: (WHOLE as f64 / ticks) as u64,
            overlap: 0,
            bow: match path.shape {
                Shape::Line => None,
                Shape::Arc(arc) => Some(Bow::new(&arc)),
            },
            top_rate: Rate::ONE,
            pace: Pace::Feed,
            changes_over: false,
            is_hop: false,
            line: 0,
        }
    }

    /// A move of the joints from one position to another in `duration_s` (one tick to
    /// [`LONGEST_S`]), each at constant speed.
    #[must_use]
    pub fn of_joints(from: JointPosition, to: JointPosition, duration_s: f64) -> Self {
        let rest = PathSegment {
            start: Pose::default(),
            target: Pose::default(),
            shape: Shape::Line,
        };
        Self {
            start: from.to_bits(),
            target: to.to_bits(),
            ..Self::new(&rest, duration_s)
        }
    }

    /// A pick-and-place move, after an exact stop and no faster than planned.
    #[must_use]
    pub fn of_hop(hop: &Hop) -> Self {
        let ends = PathSegment {
            start: hop.start,
            target: hop.target,
            shape: Shape::Line,
        };
        Self {
            is_hop: true,
            ..Self::new(&ends, f64::from(hop.raw.ticks()) * TICK_S)
        }
    }

    /// A stand-still of `duration_s` at a pose.
    #[must_use]
    pub fn stand_still(pose: Pose, duration_s: f64) -> Self {
        let path = PathSegment {
            start: pose,
            target: pose,
            shape: Shape::Line,
        };
        Self {
            pace: Pace::StandStill,
            ..Self::new(&path, duration_s)
        }
    }

    /// Whether it is a motion, and no stand-still.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.pace != Pace::StandStill
    }

    /// The point of the chord after `progress` in 2^-30 of the segment.
    ///
    /// It is exactly the start at 0 and the target at [`UNIT`]:
    ///
    /// ```text
    /// start + (target − start) u = start (1 − u) + target u,   two products of 32 bits
    /// ```
    #[must_use]
    pub fn chord_point(&self, progress: i32) -> [i32; AXES] {
        let left = UNIT - progress;
        let mut point = self.start;
        for (value, target) in point.iter_mut().zip(self.target) {
            let from_start = i64::from(*value) * i64::from(left) + i64::from(UNIT / 2);
            *value = ((from_start + i64::from(target) * i64::from(progress)) >> 30) as i32;
        }
        point
    }
}

/// The bow of an arc: what it adds to its chord.
///
/// ```text
/// bow(u) = R [cos, sin](θ₀ + φu) − R [cos, sin](θ₀) − u C,   C = R [cos, sin](θ₀ + φ) − R [cos, sin](θ₀)
/// ```
///
/// It is exactly zero at both ends, so that an arc ends at its programmed target bit for
/// bit; an arc whose ends differ in radius closes gradually along its way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bow {
    /// Radius in 2^-19 mm.
    radius: i32,
    /// Angle at the start in 2^-32 turns.
    start: u32,
    /// Sweep in 2^-30 turns, up to a full turn either way: to 3e-9 rad.
    sweep: i32,
    /// `R [cos, sin](θ₀)` in 2^-32 mm.
    origin: [i64; 2],
    /// `C`.
    chord: [Wide; 2],
}

/// 2^-32 turns a radian.
const TURNS_PER_RAD: f64 = (1_i64 << 32) as f64 / core::f64::consts::TAU;

impl Bow {
    fn new(arc: &Arc) -> Self {
        let radius = libm::round(arc.radius_mm * f64::from(1 << 19)) as i32;
        let start = libm::round(arc.start_angle_rad * TURNS_PER_RAD) as i64 as u32;
        let sweep = libm::round(arc.sweep_rad * (TURNS_PER_RAD / 4.0)) as i32;
        let origin = on_circle(radius, start);
        let [x1, y1] = on_circle(radius, start.wrapping_add((sweep as u32) << 2));
        Self {
            radius,
            start,
            sweep,
            origin,
            chord: [Wide::new(x1 - origin[0]), Wide::new(y1 - origin[1])],
        }
    }

    /// The same, value by value: the tick that takes it over has no time for `memmove`.
    #[must_use]
    pub fn copied(&self) -> Self {
        let Self {
            radius,
            start,
            sweep,
            origin,
            chord,
        } = *self;
        Self {
            radius,
            start,
            sweep,
            origin,
            chord,
        }
    }

    /// The bow in X and Y, in 2^-32 mm, after `progress` in 2^-30 of the segment.
    #[must_use]
    pub fn at(&self, progress: i32) -> [i64; 2] {
        let turned = (i64::from(self.sweep) * i64::from(progress)) >> 28;
        let [x, y] = on_circle(self.radius, self.start.wrapping_add(turned as u32));
        [
            x - self.origin[0] - self.chord[0].part(progress),
            y - self.origin[1] - self.chord[1].part(progress),
        ]
    }
}

/// `R [cos, sin]` in 2^-32 mm for a radius in 2^-19 mm.
#[inline(always)]
fn on_circle(radius: i32, turns: u32) -> [i64; 2] {
    let (sin, cos) = sin_cos(turns);
    let scaled = |value: i32| (i64::from(radius) * i64::from(value)) >> (19 + 30 - 32);
    [scaled(cos), scaled(sin)]
}

/// A length of up to ±8192 mm in 2^-32 mm, in two halves that a product of 32 bits takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Wide {
    high: i32,
    low: u16,
}

impl Wide {
    const LOW_BITS: u32 = 14;

    fn new(length: i64) -> Self {
        Self {
            high: (length >> Self::LOW_BITS) as i32,
            low: (length & ((1 << Self::LOW_BITS) - 1)) as u16,
        }
    }

    /// The part `progress` (2^-30) of it in 2^-32 mm; the whole length comes out exactly.
    fn part(self, progress: i32) -> i64 {
        let high = (i64::from(self.high) * i64::from(progress)) >> (30 - Self::LOW_BITS);
        // of the lower half the upper bits of the progress are enough: the product has 28 bits
        let low = (i32::from(self.low) * (progress >> 16)) >> (30 - 16);
        high + i64::from(low)
    }
}
