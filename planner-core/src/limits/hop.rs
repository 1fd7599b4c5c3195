//! How much slower a pick-and-place move has to go.
//!
//! A hop goes from rest to rest, and nothing else moves the tool meanwhile: neither corners nor
//! what comes before or after count. Its three motions have peaks of their velocity, acceleration
//! and jerk ([`crate::hop::Ramp`]); up and down do not overlap. The prefilter, on whichever axes
//! it acts, makes means of them, which are no larger. X and Y stay on the line between the two
//! places and Z between the lowest and the highest point, so that with the largest g, h and d
//! over that
//!
//! ```text
//! g v ≤ V,   g a + h v² ≤ A,   g j + 3 h v a + d v³ ≤ J
//! ```
//!
//! keep the limits of each joint: `v`, `a`, `j` are those across for a SCARA, and the roots of the
//! sums of the squares of those across and vertical for a delta robot. Of A goes what the
//! resolution adds where nothing smooths an axis. If all motions take `k` times as long, the left
//! sides are at most `1/k`, `1/k²` and `1/k³` of what they were.

use super::config::{Bound, Order, Part};
use super::course::Course;
use super::feed::{Highest, Limits};
use crate::hop::HopPeaks;
use crate::kinematics::{ArmKind, RateBounds};
use crate::math::sqrt_f32;

/// Steps to a slow-down; times are whole ticks, so that a step can fail to be enough.
const ROUNDS: usize = 64;

/// The least step but the first.
const STEP: f32 = 1.02;

/// What a hop has to be slowed down for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HopSlowdown {
    /// How many times as long its motions take, from 1 on.
    pub slowdown: f64,
    /// The limit that takes the most time, if one does.
    pub bound: Option<Bound>,
}

/// A limit, and how many times as long something has to take because of it.
type Found = (f32, Option<Bound>);

impl Limits {
    /// How many times as long the motions of a hop have to take, that goes across as `course` says,
    /// at its lowest height, rises by `rise_mm` over that and has such peaks when slowed down so.
    ///
    /// Cost on a Cortex-M4F: some 10 000 instructions a round, of which there are few.
    #[must_use]
    #[inline(never)]
    pub fn hop_slowdown(
        &self,
        course: &Course,
        rise_mm: f32,
        peaks: impl Fn(f64) -> HopPeaks,
    ) -> HopSlowdown {
        let bounds = self.bounds(&self.place(&course.region.raised(rise_mm)), 0.0);
        let [x_mm, y_mm, _] = course.axes_mm;
        let share = if course.plane_mm > 0.0 {
            x_mm.max(y_mm) / course.plane_mm
        } else {
            0.0
        };
        let mut found = HopSlowdown {
            slowdown: 1.0,
            bound: None,
        };
        let mut step = 1.0_f32;
        for _ in 0..ROUNDS {
            let (longer, bound) = self.hop_overload(&bounds, share, &peaks(found.slowdown));
            if longer <= 1.0 {
                break;
            }
            found.slowdown *= f64::from(longer.max(step));
            found.bound = bound;
            step = STEP;
        }
        found
    }

    /// How many times as long a hop with these peaks has to take, and because of which limit.
    fn hop_overload(&self, bounds: &[RateBounds; 3], share: f32, peaks: &HopPeaks) -> Found {
        let HopPeaks {
            across,
            vertical,
            yaw,
            grain,
            ..
        } = *peaks;
        let both = [0, 1, 2].map(|order: usize| {
            let of = |peaks: [f32; 3]| peaks.get(order).copied().unwrap_or(0.0);
            let (across, vertical) = (of(across), of(vertical));
            sqrt_f32(across * across + vertical * vertical)
        });
        let [turn1, turn2, turn3] = bounds;
        let (yaw_grain, along) = (grain.to_radians(), across.map(|peak| peak * share));
        let turn = |joint, bounds: &RateBounds, peaks| {
            let grain = bounds.first * grain;
            (Part::Joint(joint), turned(bounds, peaks), grain)
        };
        let joints = match self.kind() {
            ArmKind::Scara => {
                let (part, mut sum, grain4) = turn(4, turn3, across);
                for (peak, yaw) in sum.iter_mut().zip(yaw) {
                    *peak += yaw;
                }
                [
                    turn(1, turn1, across),
                    turn(2, turn2, across),
                    (Part::Joint(3), vertical, grain),
                    (part, sum, grain4 + yaw_grain),
                ]
            }
            ArmKind::Delta => [
                turn(1, turn1, both),
                turn(2, turn2, both),
                turn(3, turn3, both),
                (Part::Joint(4), yaw, yaw_grain),
            ],
        };
        let tool = [
            ((Part::Path, both, grain), &self.path),
            ((Part::Axis, along, grain), &self.axis),
            ((Part::Axis, vertical, grain), &self.axis),
        ];
        let mut worst: Found = (1.0, None);
        for ((part, peaks, grain), highest) in joints.into_iter().zip(&self.joints).chain(tool) {
            let found = longer(part, peaks, grain, highest);
            if found.0 > worst.0 {
                worst = found;
            }
        }
        worst
    }
}

/// What a joint does at the most when the tool does that.
fn turned(bounds: &RateBounds, [v, a, j]: [f32; 3]) -> [f32; 3] {
    let RateBounds {
        first,
        second,
        third,
    } = *bounds;
    [
        first * v,
        first * a + second * v * v,
        first * j + (3.0 * second * a + third * v * v) * v,
    ]
}

/// How many times as long something with these peaks has to take, and to whose acceleration the
/// resolution adds `grain`; of a limit as low as that a quarter is left for it.
fn longer(
    part: Part,
    [velocity, acceleration, jerk]: [f32; 3],
    grain: f32,
    highest: &Highest,
) -> Found {
    let left = highest.acceleration - grain.min(0.25 * highest.acceleration);
    let longer = [
        (velocity / highest.velocity, Order::Velocity),
        (sqrt_f32(acceleration / left), Order::Acceleration),
        (libm::cbrtf(jerk / highest.jerk), Order::Jerk),
    ];
    let mut worst: Found = (0.0, None);
    for (longer, order) in longer {
        if longer > worst.0 {
            worst = (longer, Some(Bound { part, order }));
        }
    }
    worst
}
