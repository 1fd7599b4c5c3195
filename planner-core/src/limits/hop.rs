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
//! keep the limits of each joint, less what the resolution of axes adds that nothing smooths, `v`, `a`, `j` being those across for a SCARA, and the roots of
//! the sums of the squares of those across and vertical for a delta robot. If all motions take `k`
//! times as long, the left sides are at most `1/k`, `1/k²` and `1/k³` of what they were.

use super::config::{Bound, Order, Part};
use super::course::{Region, ring_of_line};
use super::feed::{Highest, Limits};
use crate::hop::HopPeaks;
use crate::kinematics::{ArmKind, RateBounds, Sweep};
use crate::math::sqrt_f32;
use crate::pose::Pose;
use crate::units::LengthMm;

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
    /// How many times as long the motions of a hop between two poses have to take, that rises to
    /// `top` and has such peaks when slowed down so.
    ///
    /// Cost on a Cortex-M4F: some 10 000 instructions a round, of which there are few.
    #[must_use]
    #[inline(never)]
    pub fn hop_slowdown(
        &self,
        [start, target]: [&Pose; 2],
        top: LengthMm,
        peaks: impl Fn(f64) -> HopPeaks,
    ) -> HopSlowdown {
        let mm = |pose: &Pose| [pose.x, pose.y, pose.z].map(|value| value.to_num::<f32>());
        let ([x0, y0, z0], [x1, y1, z1]) = (mm(start), mm(target));
        let (dx, dy) = (x1 - x0, y1 - y0);
        let length_mm = sqrt_f32(dx * dx + dy * dy);
        let region = match self.kind() {
            ArmKind::Scara => Region::Ring(ring_of_line([x0, y0], [x1, y1])),
            ArmKind::Delta => {
                let low_mm = z0.min(z1);
                let rise_mm = (top.to_num::<f32>() - low_mm).max(0.0);
                Region::Sweep(Sweep::new(length_mm, 0.0, rise_mm, |u| {
                    [x0 + u * dx, y0 + u * dy, low_mm]
                }))
            }
        };
        let bounds = self.bounds(&self.place(&region), 0.0);
        let per_mm = if length_mm > 0.0 {
            1.0 / length_mm
        } else {
            0.0
        };
        let share = dx.abs().max(dy.abs()) * per_mm;
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
        let [joint1, joint2, joint3, joint4] = &self.joints;
        let along = across.map(|peak| peak * share);
        let mut worst: Found = (1.0, None);
        let mut take = |part, peaks: [f32; 3], grain: f32, highest: &Highest| {
            let found = longer(part, peaks, grain, highest);
            if found.0 > worst.0 {
                worst = found;
            }
        };
        take(Part::Path, both, grain, &self.path);
        take(Part::Axis, along, grain, &self.axis);
        take(Part::Axis, vertical, grain, &self.axis);
        let yaw_grain = grain.to_radians();
        let mut turn = |joint, bounds: &RateBounds, peaks, highest| {
            let peaks = turned(bounds, peaks);
            take(Part::Joint(joint), peaks, bounds.first * grain, highest);
        };
        match self.kind() {
            ArmKind::Scara => {
                turn(1, turn1, across, joint1);
                turn(2, turn2, across, joint2);
                take(Part::Joint(3), vertical, grain, joint3);
                let mut sum = turned(turn3, across);
                for (peak, yaw) in sum.iter_mut().zip(yaw) {
                    *peak += yaw;
                }
                let sum_grain = turn3.first * grain + yaw_grain;
                take(Part::Joint(4), sum, sum_grain, joint4);
            }
            ArmKind::Delta => {
                turn(1, turn1, both, joint1);
                turn(2, turn2, both, joint2);
                turn(3, turn3, both, joint3);
                take(Part::Joint(4), yaw, yaw_grain, joint4);
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
