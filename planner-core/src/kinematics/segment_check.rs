//! Whether a whole path segment can be driven, found before motion starts.
//!
//! A limit may be violated between the ends of a segment, and between any two samples of it.
//! So the check walks along the segment by its **margins**: a pose that is 30 mm inside every
//! limit proves the next 30 mm. Sampled poses get rarer the further they are from a limit.
//!
//! What bounds the steps, per millimetre of horizontal travel:
//!
//! ```text
//! radius   |dr| <= 1         joint 2, reach and singularity margin are limits of the radius
//! joint 1  |dθ1| = |p·ds| / (l1 l2 sin θ2) <= 1 / (l1 sin θ2)
//! θ1 + θ2  |dθ12| = |e·ds| / (l1 l2 sin θ2) <= 1 / (l2 sin θ2),   for θ4 = c - θ12
//! ```
//!
//! with e and p the upper arm and forearm, and sin θ2 the smallest inside the limits.

use super::pose_check::{PoseError, root_mm};
use super::scara::{HALF_TURN, MM_PER_LSB, RAD_PER_LSB, Scara, TURN, squared_radius};
use crate::math::{ONE_Q30, sin_cos, turns};
use crate::pose::{JointPosition, Pose};
use crate::units::AngleRad;
use core::{f32::consts::PI, fmt};

/// Shortest step, in millimetres and in degrees of C. An excess beyond a limit shorter than
/// this can stay unseen: at most 0.025 mm deep.
const STEP_MIN: f32 = 0.05;

/// Shortest step as a fraction of the segment: bounds the work for a segment of 50 m.
const FRACTION_MIN: f32 = 1e-6;

/// A segment of a path, from `u` = 0 to `u` = 1.
pub trait Curve {
    /// Length of the path of X, Y, Z in millimetres.
    fn length_mm(&self) -> f64;

    /// X, Y, Z in millimetres and C in degrees at the fraction `u` (0 to 1) of the segment.
    /// X, Y and Z move at the constant rate [`Curve::length_mm`] per unit of `u`, C evenly.
    fn pose(&self, u: f64) -> [f64; 4];

    /// Largest rates per unit of `u`. The default is right for every curve; one that knows how
    /// little it moves vertically saves samples where Z is near its limit.
    fn travel(&self) -> Travel {
        let length = self.length_mm() as f32;
        let [_, _, _, c_start] = self.pose(0.0);
        let [_, _, _, c_end] = self.pose(1.0);
        Travel {
            xy_mm: length,
            z_mm: length,
            c_deg: (c_end - c_start).abs() as f32,
        }
    }
}

/// Bounds on what a [`Curve`] moves per unit of `u`, all positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Horizontally.
    pub xy_mm: f32,
    /// Vertically.
    pub z_mm: f32,
    /// Of the yaw.
    pub c_deg: f32,
}

/// Where on a segment a limit is violated first, and which.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentError {
    /// Fraction of the segment, 0 to 1, found to lie beyond the limit. Everything before it,
    /// to 0.05 mm, can be driven.
    pub fraction: f64,
    /// What is wrong there.
    pub cause: PoseError,
}

impl fmt::Display for SegmentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "at {:.1} % of the segment {}",
            self.fraction * 100.0,
            self.cause
        )
    }
}

impl core::error::Error for SegmentError {}

/// What bounds a step on this robot.
struct Bounds {
    radius_min_mm: f32,
    radius_max_mm: f32,
    joint1_rad_per_mm: f32,
    joint12_rad_per_mm: f32,
}

impl Scara {
    /// Checks every pose of a segment against reach, singularity margin and joint travels, and
    /// that joint 1 does not have to jump by a turn.
    ///
    /// Deterministic: poses come as `f64`, everything else is the fixed-point kinematics of the
    /// tick and single `f32` operations. Not for the tick: some 1500 instructions a sample on a
    /// Cortex-M4. A 50 mm line well inside the workspace takes 3 to 5 samples (5100 instructions
    /// on average, 6700 at most), one that ends at a limit some tens; one that follows a limit
    /// takes a sample every 0.05 mm.
    ///
    /// # Errors
    /// The first violation found and where it is.
    pub fn check_segment(&self, curve: &impl Curve) -> Result<(), SegmentError> {
        let bounds = self.bounds();
        let travel = curve.travel();
        let mut before: Option<JointPosition> = None;
        walk(curve, &travel, |pose| {
            let joints = self.check(pose)?;
            if let Some(before) = before {
                self.check_seam(before.joint1, joints.joint1)?;
            }
            before = Some(joints);
            Ok(self.clear_fraction(&bounds, &travel, pose, &joints))
        })
    }

    /// The fraction of the segment over which no limit can be reached from here.
    fn clear_fraction(
        &self,
        bounds: &Bounds,
        travel: &Travel,
        pose: &Pose,
        joints: &JointPosition,
    ) -> f32 {
        let [joint1, _, joint3, joint4] = self.limits;
        let radius_mm = root_mm(squared_radius(pose));
        let radius_margin =
            (radius_mm - bounds.radius_min_mm).min(bounds.radius_max_mm - radius_mm);
        let c_rad = travel.c_deg * (PI / 180.0);
        let margins = [
            (radius_margin, travel.xy_mm),
            (
                margin(joints.joint1.to_bits(), joint1) * RAD_PER_LSB,
                travel.xy_mm * bounds.joint1_rad_per_mm,
            ),
            (
                margin(joints.joint3.to_bits(), joint3) * MM_PER_LSB,
                travel.z_mm,
            ),
            (
                margin(joints.joint4.to_bits(), joint4) * RAD_PER_LSB,
                travel.xy_mm * bounds.joint12_rad_per_mm + c_rad,
            ),
        ];
        margins.into_iter().fold(1.0, |step: f32, (margin, rate)| {
            // Compared before dividing: a limit that is not approached has no rate.
            if margin < step * rate {
                margin / rate
            } else {
                step
            }
        })
    }

    /// Joint 1 follows its angle around; half a turn between two samples is a jump.
    fn check_seam(&self, before: AngleRad, now: AngleRad) -> Result<(), PoseError> {
        let change = i64::from(now.to_bits()) - i64::from(before.to_bits());
        if change > i64::from(HALF_TURN) {
            return Err(self.joint_limit_error(1, now.to_bits().wrapping_sub(TURN)));
        }
        if change < -i64::from(HALF_TURN) {
            return Err(self.joint_limit_error(1, now.to_bits().wrapping_add(TURN)));
        }
        Ok(())
    }

    fn bounds(&self) -> Bounds {
        let (bend_min, bend_max) = self.elbow_range();
        let (sine_a, cosine_a) = sin_cos(turns(AngleRad::from_bits(bend_min)));
        let (sine_b, cosine_b) = sin_cos(turns(AngleRad::from_bits(bend_max)));
        // The sine is concave from 0° to 180°: smallest at one of the ends.
        let sine_min = sine_a.min(sine_b) as f32 / ONE_Q30 as f32;
        // r² = (l1 + l2)² - 2 l1 l2 (1 - cos θ2)
        let radius_mm = |cosine: i32| {
            let product = (i64::from(self.link1) * i64::from(self.link2)) >> 29;
            let shortened = product * (i64::from(ONE_Q30) - i64::from(cosine));
            root_mm(self.outer_squared.saturating_sub(shortened.unsigned_abs()))
        };
        Bounds {
            radius_min_mm: radius_mm(cosine_b),
            radius_max_mm: radius_mm(cosine_a),
            joint1_rad_per_mm: 1.0 / (self.link1 as f32 * MM_PER_LSB * sine_min),
            joint12_rad_per_mm: 1.0 / (self.link2 as f32 * MM_PER_LSB * sine_min),
        }
    }
}

/// Walks along a segment: `clear` checks a pose and tells over which fraction of the segment no
/// limit can be reached from there.
pub(super) fn walk(
    curve: &impl Curve,
    travel: &Travel,
    mut clear: impl FnMut(&Pose) -> Result<f32, PoseError>,
) -> Result<(), SegmentError> {
    let fastest = travel.xy_mm.max(travel.z_mm).max(travel.c_deg);
    let step_min = (STEP_MIN / fastest).max(FRACTION_MIN);
    let mut fraction = 0.0;
    loop {
        let pose = pose_from_f64(curve.pose(fraction));
        let step = clear(&pose).map_err(|cause| SegmentError { fraction, cause })?;
        if fraction >= 1.0 {
            return Ok(());
        }
        fraction = (fraction + f64::from(step.max(step_min))).min(1.0);
    }
}

/// Distance to the nearer limit.
pub(super) fn margin(value: i32, (min, max): (i32, i32)) -> f32 {
    value.saturating_sub(min).min(max.saturating_sub(value)) as f32
}

/// To machine units, cut off towards zero and saturated.
fn pose_from_f64(pose: [f64; 4]) -> Pose {
    Pose::from_bits(pose.map(|value| (value * 524_288.0) as i32))
}
