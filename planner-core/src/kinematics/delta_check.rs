//! Whether a delta robot can take a pose, and drive a whole segment.
//!
//! A segment is checked as the SCARA's is, by walking along it by the margins of each pose. What
//! bounds the steps, per millimetre that the tool moves, with `q` from shoulder to platform
//! (`|q| <= l1 + l2`, the reach):
//!
//! ```text
//! s² / 2         |gradient| <= √(p² + z²) + |m| |q| / l1,   |second derivative| <= 1 + q²/l1² + |m|/l1
//! θ              |dθ| = |f·ds| / (l1 s) <= l2 / (l1 s)
//! forearm        |df| = |(1 - t fᵀ / s) ds| <= l2 / s
//! their volume   |dV| <= Σ 1/s, being linear in each of the three directions f / l2
//! ```
//!
//! The first line follows from `s² = p² + z² - m²` with `m' = (q·P')/l1`, and says how far `s²`
//! stays above its limit, and above a quarter of what it is here; for so far the others hold
//! with half of the `s` of here.

use super::delta::{ARMS, Delta, Limb, directions_of, place};
use super::delta_forward::cross;
use super::pose_check::{PoseError, joint_limit};
use super::scara::{MM_PER_LSB, RAD_PER_LSB};
use super::segment_check::{Curve, SegmentError, Travel, margin, walk};
use crate::math::sqrt_f32;
use crate::pose::{JointPosition, JointUnit, Pose};

/// The longest step as a part of the upper arm: what the second derivative is bounded for.
const STEP_MAX: f32 = 0.25;

/// A pose that the arm can take, with what its margins are computed from.
struct Posture {
    joints: JointPosition,
    limbs: [Limb; ARMS],
    volume: f32,
}

impl Delta {
    /// The joints at `pose`, if all limits hold there: reach, both singularities' margins, joint
    /// travels.
    ///
    /// # Errors
    /// The first limit that does not hold, in that order.
    pub fn check(&self, pose: &Pose) -> Result<JointPosition, PoseError> {
        self.checked(pose).map(|posture| posture.joints)
    }

    fn checked(&self, pose: &Pose) -> Result<Posture, PoseError> {
        let limbs = self.limbs(pose);
        for (arm, limb) in (1..).zip(&limbs) {
            if limb.squared < 0 {
                return Err(self.out_of_reach(arm, limb, pose));
            }
        }
        for (arm, limb) in (1..).zip(&limbs) {
            if limb.root < self.root_min {
                let sine = limb.root as f32 * MM_PER_LSB / self.forearm_mm;
                return Err(PoseError::NearSerial {
                    arm,
                    angle_deg: libm::asinf(sine).to_degrees(),
                    margin_deg: self.serial_margin_deg,
                });
            }
        }
        let volume = self.volume(pose, &limbs);
        if volume < self.parallel_margin {
            return Err(PoseError::NearParallel {
                volume,
                margin: self.parallel_margin,
            });
        }
        let joints = Self::position(pose, &limbs);
        for ((joint, value), (min, max)) in (1..).zip(joints.to_bits()).zip(self.limits) {
            if value < min || value > max {
                return Err(joint_limit(joint, value, (min, max), JointUnit::Angle));
            }
        }
        Ok(Posture {
            joints,
            limbs,
            volume,
        })
    }

    /// In the plane of an arm the platform is seen from the shoulder at a distance that upper
    /// arm and projected forearm do not span.
    fn out_of_reach(&self, arm: u8, limb: &Limb, pose: &Pose) -> PoseError {
        let [x, y, z] = place(pose).map(|bits| bits as f32 * MM_PER_LSB);
        let outward = limb.outward as f32 * MM_PER_LSB;
        let (ux, uy) = directions_of(arm);
        let across = x * uy - y * ux;
        let forearm = libm::sqrtf((self.forearm_mm * self.forearm_mm - across * across).max(0.0));
        PoseError::ArmUnreachable {
            arm,
            distance_mm: libm::hypotf(outward, z),
            min_mm: (self.upper_arm_mm - forearm).abs(),
            max_mm: self.upper_arm_mm + forearm,
        }
    }

    /// The volume that the forearms' directions span: positive where the platform hangs below
    /// the elbows, 1 at right angles, 0 in a plane.
    fn volume(&self, pose: &Pose, limbs: &[Limb; ARMS]) -> f32 {
        let [x, y, z] = place(pose).map(|bits| bits as f32 * MM_PER_LSB);
        let per = 1.0 / self.forearm_mm;
        let mut arms = (1..).zip(limbs);
        let forearms = [(); ARMS].map(|()| {
            let Some((arm, limb)) = arms.next() else {
                return [0.0; 3];
            };
            let (sine, cosine) = limb.sine_cosine();
            let radius = self.offset_mm + self.upper_arm_mm * cosine;
            let (ux, uy) = directions_of(arm);
            [
                (x - radius * ux) * per,
                (y - radius * uy) * per,
                (z + self.upper_arm_mm * sine) * per,
            ]
        });
        let [a, b, c] = &forearms;
        let [nx, ny, nz] = cross(b, c);
        -(a[0] * nx + a[1] * ny + a[2] * nz)
    }

    /// Checks every pose of a segment against reach, both singularities' margins and joint
    /// travels.
    ///
    /// As [`super::Scara::check_segment`], and as rigorous; a sample costs more and steps are some
    /// 20 to 60 mm inside the workspace.
    ///
    /// # Errors
    /// The first violation found and where it is.
    pub fn check_segment(&self, curve: &impl Curve) -> Result<(), SegmentError> {
        let travel = curve.travel();
        let length_mm = curve.length_mm() as f32;
        walk(curve, &travel, |pose| {
            let posture = self.checked(pose)?;
            Ok(self.clear_fraction(length_mm, &travel, pose, &posture))
        })
    }

    /// The fraction of the segment over which no limit can be reached from here.
    fn clear_fraction(
        &self,
        length_mm: f32,
        travel: &Travel,
        pose: &Pose,
        posture: &Posture,
    ) -> f32 {
        let z_mm = place(pose)[2] as f32 * MM_PER_LSB;
        let mut way_mm = self.upper_arm_mm * STEP_MAX;
        let mut volume_per_mm = 0.0;
        let joints = posture.joints.to_bits().into_iter().zip(self.limits);
        for (limb, (joint, limits)) in posture.limbs.iter().zip(joints) {
            let root_mm = limb.root as f32 * MM_PER_LSB;
            let low_mm = 0.5 * root_mm;
            way_mm = way_mm
                .min(self.clear_way_mm(limb, z_mm, root_mm, low_mm))
                .min(self.clear_way_mm(limb, z_mm, root_mm, self.root_min as f32 * MM_PER_LSB));
            let joint_rad_per_mm = self.forearm_mm / (self.upper_arm_mm * low_mm);
            way_mm = way_mm.min(margin(joint, limits) * RAD_PER_LSB / joint_rad_per_mm);
            volume_per_mm += 1.0 / low_mm;
        }
        way_mm = way_mm.min((posture.volume - self.parallel_margin) / volume_per_mm);

        let yaw_rad = travel.c_deg.to_radians();
        let [_, _, _, yaw_limits] = self.limits;
        let yaw_margin = margin(posture.joints.joint4.to_bits(), yaw_limits) * RAD_PER_LSB;
        [(way_mm, length_mm), (yaw_margin, yaw_rad)]
            .into_iter()
            .fold(1.0, |step: f32, (margin, rate)| {
                if margin < step * rate {
                    margin / rate
                } else {
                    step
                }
            })
    }

    /// How far the tool can move before `s` can have come down to `low_mm`.
    fn clear_way_mm(&self, limb: &Limb, z_mm: f32, root_mm: f32, low_mm: f32) -> f32 {
        let outward_mm = limb.outward as f32 * MM_PER_LSB;
        let along_mm = (limb.along as f32 * MM_PER_LSB).abs();
        let per_arm = 1.0 / self.upper_arm_mm;
        let reach_mm = self.upper_arm_mm + self.forearm_mm;
        // |q| and |m| wherever a step ends; at its start both are within reach.
        let furthest_mm = reach_mm + STEP_MAX * self.upper_arm_mm;
        let along_max_mm = reach_mm + STEP_MAX * furthest_mm;

        let gradient =
            sqrt_f32(outward_mm * outward_mm + z_mm * z_mm) + along_mm * reach_mm * per_arm;
        let ratio = furthest_mm * per_arm;
        let bend = 1.0 + ratio * ratio + along_max_mm * per_arm;
        // The positive root of bend d² + 2 gradient d = s² - low², in its form without cancellation
        let spare = (root_mm - low_mm).max(0.0) * (root_mm + low_mm);
        spare / (gradient + sqrt_f32(gradient * gradient + bend * spare))
    }
}
