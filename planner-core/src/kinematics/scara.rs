//! Kinematics of a SCARA: two parallel revolute joints, a quill and a wrist.
//!
//! With `θ12 = θ1 + θ2` the tool is at
//!
//! ```text
//! x = l1 cos θ1 + l2 cos θ12,   y = l1 sin θ1 + l2 sin θ12,   z = d3,   c = θ12 + θ4
//! ```

use super::config::{Elbow, ScaraConfig, ScaraError};
use crate::math::{atan2, sin_cos, sine_from_cosine, turns};
use crate::pose::{AXES, Joint3, JointPosition, JointState, Pose};
use crate::units::{AngleDeg, AngleRad, LengthMm};

/// `π/180` from AngleDeg (2^-19 °) to AngleRad (2^-26 rad), Q29.
const RAD_PER_DEG_Q29: i64 = 1_199_381_129;
/// 32 rad in AngleDeg, rounded down: the furthest that an AngleRad holds.
const DEG_OF_32_RAD: i32 = 961_263_668;
/// `180/π` from AngleRad to AngleDeg, Q31.
pub(super) const DEG_PER_RAD_Q31: i64 = 961_263_669;
/// One turn and half a turn in AngleRad.
pub(super) const TURN: i32 = 421_657_428;
pub(super) const HALF_TURN: i32 = 210_828_714;

/// Degrees to radians, of rates.
pub(super) const RAD_S_PER_DEG_S: f32 = 0.017_453_292;
/// LengthMm, AngleRad and Q30 to plain numbers.
pub(super) const MM_PER_LSB: f32 = 1.0 / 524_288.0;
pub(super) const RAD_PER_LSB: f32 = 1.0 / 67_108_864.0;
const PER_Q30: f32 = 1.0 / 1_073_741_824.0;

/// Sine of joint 2, Q30, below which joint speeds are computed as if it were this (0.06°): a planned
/// path stays at 0.5° or more, and any other must not divide by zero.
const SINE2_MIN: i32 = 1 << 20;

/// How far inside of its range joint 2 is folded: 0.1° in AngleRad.
const FOLD_SPARE: i32 = 117_127;

/// A validated SCARA in machine units: immutable, shared by the planner and the tick.
#[derive(Clone, Debug)]
pub struct Scara {
    /// Link lengths in LengthMm (2^-19 mm), their squares in 2^-38 mm².
    pub(super) link1: i32,
    pub(super) link2: i32,
    /// `l1² + l2²`, less half a unit of what `cosine2` shifts out: this rounds it.
    links_squared: i64,
    /// `(l1 - l2)²` and `(l1 + l2)²`: between them is what the links can reach.
    pub(super) inner_squared: u64,
    pub(super) outer_squared: u64,
    /// `1 / (2 l1 l2)`, as a right shift and a factor in Q31; see `cosine2`.
    cosine_shift: u32,
    cosine_factor: i32,
    /// Sign of joint 2: -1 or 1.
    elbow_sign: i32,
    /// Joint 1 is in (first, second], one turn wide, AngleRad.
    joint1_turn: (i32, i32),
    /// Lowest and highest position: AngleRad, or LengthMm for joint 3.
    pub(super) limits: [(i32, i32); AXES],
    /// AngleRad.
    pub(super) singularity_margin: i32,
    link1_mm: f32,
    /// `1 / (l1 l2)`, with the sign of joint 2.
    per_links_mm2: f32,
}

/// The joints at a pose, with what their rates are computed from.
struct Posture {
    position: JointPosition,
    /// `|sin θ2|`, Q30.
    sine2: i32,
    /// `r² cos θ1`, `r² sin θ1` and `r²`, all scaled alike to below 2^31.
    upper_arm: (i32, i32),
    radius_squared: i32,
}

impl Scara {
    /// The SCARA that `config` describes, or the first parameter that is out of range.
    ///
    /// # Errors
    /// See [`ScaraError`].
    pub fn new(config: &ScaraConfig) -> Result<Self, ScaraError> {
        config.validate()?;
        let link1 = LengthMm::saturating_from_num(config.link1_mm).to_bits();
        let link2 = LengthMm::saturating_from_num(config.link2_mm).to_bits();
        let (wide1, wide2) = (i64::from(link1), i64::from(link2));
        let square = |length: i64| length.unsigned_abs() * length.unsigned_abs();

        // F = 2 l1 l2 / 2^shift is in about [2^30, 2^31), by a margin below 2^31 so that it can
        // be rounded up; the factor is 2^61 / F.
        let double_product = 2 * wide1 * wide2;
        let cosine_shift = 33 - (double_product + (double_product >> 30)).leading_zeros();
        let double_product = double_product as u128;
        let factor = ((1 << (61 + cosine_shift)) + double_product / 2) / double_product;

        let mut limits = config.joint_limits.map(|range| {
            (
                radians(AngleDeg::saturating_from_num(range.min)),
                radians(AngleDeg::saturating_from_num(range.max)),
            )
        });
        let quill = config.joint_limits[2];
        limits[2] = (
            LengthMm::saturating_from_num(quill.min).to_bits(),
            LengthMm::saturating_from_num(quill.max).to_bits(),
        );
        let (joint1_min, joint1_max) = limits[0];
        let joint1_mid = joint1_min + (joint1_max - joint1_min) / 2;

        let sign = config.elbow.sign();
        let scara = Self {
            link1,
            link2,
            links_squared: wide1 * wide1 + wide2 * wide2 - (1 << (cosine_shift - 1)),
            inner_squared: square(wide1 - wide2),
            outer_squared: square(wide1 + wide2),
            cosine_shift,
            cosine_factor: i32::try_from(factor).unwrap_or(i32::MAX),
            elbow_sign: sign,
            joint1_turn: (joint1_mid - HALF_TURN, joint1_mid - HALF_TURN + TURN),
            limits,
            singularity_margin: radians(AngleDeg::saturating_from_num(
                config.singularity_margin_deg,
            )),
            link1_mm: config.link1_mm,
            per_links_mm2: sign as f32 / (config.link1_mm * config.link2_mm),
        };
        let (joint2_min, joint2_max) = scara.elbow_range();
        if joint2_min >= joint2_max {
            return Err(ScaraError::ElbowSide);
        }
        Ok(scara)
    }

    /// Changes the side of the elbow: joint positions are those of that side from now on.
    pub fn set_elbow(&mut self, elbow: Elbow) {
        let sign = elbow.sign();
        if sign != self.elbow_sign {
            self.elbow_sign = sign;
            self.per_links_mm2 = -self.per_links_mm2;
        }
    }

    /// Joint positions at a pose: joint 1 within half a turn of the middle of its range, joint 2
    /// on the elbow's side.
    ///
    /// Stateless and infallible: beyond the reach the arm points at the pose, stretched or folded
    /// to 1e-4 rad, and C and joint 4 saturate at ±32 rad. Down to 5° from a singularity the tool
    /// is within 4e-8 of the reach (6 nm at 350 mm), the joints within 1.2e-7 rad.
    /// Cost on a Cortex-M4: 325 instructions.
    #[must_use]
    pub fn inverse(&self, pose: &Pose) -> JointPosition {
        self.posture(pose).position
    }

    fn posture(&self, pose: &Pose) -> Posture {
        let (x, y) = (i64::from(pose.x.to_bits()), i64::from(pose.y.to_bits()));
        let at_least = squared_radius(pose).max(self.inner_squared);
        let reached = at_least.min(self.outer_squared);

        // The elbow, by the law of cosines.
        let cosine2 = self.cosine2(reached);
        let sine2 = sine_from_cosine(cosine2);
        let bend = round_shift_3(atan2(sine2, cosine2));
        let joint2 = bend.wrapping_mul(self.elbow_sign);
        let signed_sine2 = sine2.wrapping_mul(self.elbow_sign);

        // In the upper arm's frame the tool is at (a, b) = (l1 + l2 cos θ2, l2 sin θ2), so
        //   r² cos θ1 = x a + y b,   r² sin θ1 = y a - x b.
        // Below 2^62: |x|, |y| are at most 2^31 and |a|, |b| at most 2^30.
        let a = i64::from(self.link1.wrapping_add(scale_q30(self.link2, cosine2)));
        let b = i64::from(scale_q30(self.link2, signed_sine2));
        let (along, across) = (x * a + y * b, y * a - x * b);

        // Their length is at most `at_least`, and r² where the arm reaches. Bring it below 2^31.
        let high = (at_least >> 32) as u32;
        let shift = (34 - high.leading_zeros()).min(31);
        let upper_arm = (shift_right(along, shift), shift_right(across, shift));

        let direction = round_shift_3(atan2(upper_arm.1, upper_arm.0));
        let joint1 = if direction <= self.joint1_turn.0 {
            direction.wrapping_add(TURN)
        } else if direction > self.joint1_turn.1 {
            direction.wrapping_sub(TURN)
        } else {
            direction
        };

        let joint4 = radians(pose.c)
            .saturating_sub(joint1)
            .saturating_sub(joint2);
        Posture {
            position: JointPosition {
                joint1: AngleRad::from_bits(joint1),
                joint2: AngleRad::from_bits(joint2),
                joint3: Joint3::from_length(pose.z),
                joint4: AngleRad::from_bits(joint4),
            },
            sine2,
            upper_arm,
            radius_squared: shift_right(reached as i64, shift),
        }
    }

    /// `cos θ2 = (r² - l1² - l2²) / (2 l1 l2)` in Q30, at a radius within reach. May exceed ±1 by
    /// the last bit.
    fn cosine2(&self, radius_squared: u64) -> i32 {
        // At most 2 l1 l2 in magnitude, of which the shift leaves 31 bits and a sign.
        let difference = radius_squared as i64 - self.links_squared;
        let numerator = shift_right(difference, self.cosine_shift);
        ((i64::from(numerator) * i64::from(self.cosine_factor) + (1 << 30)) >> 31) as i32
    }

    /// Positions, velocities and accelerations of the joints, for a tool at `pose` that moves
    /// with `velocity` (mm/s, mm/s, mm/s, °/s) and `acceleration` (mm/s², mm/s², mm/s², °/s²).
    ///
    /// Velocities and accelerations are `f32`. Down to 20° from a singularity velocities are good
    /// to 1.5e-6 of the fastest joint's, accelerations to 1e-5 of the largest among themselves and
    /// the squared velocities (lopsided links, 333 and 42 mm: 3e-6 and 8e-5). Closer than 0.06°
    /// to a singularity they are those at 0.06°: finite for any finite arguments up to 1e6.
    /// Cost on a Cortex-M4: 405 instructions.
    #[must_use]
    pub fn joint_state(
        &self,
        pose: &Pose,
        velocity: [f32; AXES],
        acceleration: [f32; AXES],
    ) -> JointState {
        let posture = self.posture(pose);
        let [vx, vy, vz, vc] = velocity;
        let [ax, ay, az, ac] = acceleration;
        let (x, y) = (
            pose.x.to_bits() as f32 * MM_PER_LSB,
            pose.y.to_bits() as f32 * MM_PER_LSB,
        );

        // The tool r = (x, y) = e + p: upper arm e = l1 (cos θ1, sin θ1), forearm p.
        let (along, across) = posture.upper_arm;
        let unit = self.link1_mm / posture.radius_squared.max(1) as f32;
        let (ex, ey) = (along as f32 * unit, across as f32 * unit);
        let (px, py) = (x - ex, y - ey);

        // Inverse Jacobian, of determinant D = l1 l2 sin θ2:
        //   θ1' = p·v / D,   θ2' = -r·v / D
        let sine2 = posture.sine2.max(SINE2_MIN) as f32 * PER_Q30;
        let per_determinant = self.per_links_mm2 / sine2;
        let rate1 = (px * vx + py * vy) * per_determinant;
        let rate2 = -(x * vx + y * vy) * per_determinant;
        let rate12 = rate1 + rate2;

        // r'' = J θ'' - θ1'² e - θ12'² p, so the same inverse applies to
        //   w = a + θ1'² e + θ12'² p
        let (square1, square12) = (rate1 * rate1, rate12 * rate12);
        let wx = ax + square1 * ex + square12 * px;
        let wy = ay + square1 * ey + square12 * py;
        let acceleration1 = (px * wx + py * wy) * per_determinant;
        let acceleration2 = -(x * wx + y * wy) * per_determinant;

        JointState {
            position: posture.position,
            velocity: [rate1, rate2, vz, vc * RAD_S_PER_DEG_S - rate12],
            acceleration: [
                acceleration1,
                acceleration2,
                az,
                ac * RAD_S_PER_DEG_S - (acceleration1 + acceleration2),
            ],
        }
    }

    /// Where the tool is with the joints at `joints`; C saturates at ±4096°.
    ///
    /// Error at most 3e-9 of the reach and half a unit of each format.
    /// Cost on a Cortex-M4: 170 instructions.
    #[must_use]
    pub fn forward(&self, joints: &JointPosition) -> Pose {
        let turns1 = turns(joints.joint1);
        let (s1, c1) = sin_cos(turns1);
        let (s12, c12) = sin_cos(turns1.wrapping_add(turns(joints.joint2)));
        let (l1, l2) = (i64::from(self.link1), i64::from(self.link2));
        let sum = |first: i32, second: i32| {
            let wide = l1 * i64::from(first) + l2 * i64::from(second);
            LengthMm::from_bits(((wide + (1 << 29)) >> 30) as i32)
        };
        let angle = i64::from(joints.joint1.to_bits())
            + i64::from(joints.joint2.to_bits())
            + i64::from(joints.joint4.to_bits());
        Pose {
            x: sum(c1, c12),
            y: sum(s1, s12),
            z: joints.joint3.as_length(),
            c: AngleDeg::from_bits(saturate((angle * DEG_PER_RAD_Q31 + (1 << 30)) >> 31)),
        }
    }

    /// Where the tool is when joint 2 folds, on the elbow's side, as far as the singularity
    /// margin and its travel ask, and the other joints stay.
    #[must_use]
    pub fn folded(&self, joints: &JointPosition) -> Pose {
        let (min, max) = self.elbow_range();
        // Inside by a little, so that rounding does not matter.
        let spare = ((max - min) / 4).min(FOLD_SPARE);
        let bend = joints.joint2.to_bits().saturating_abs();
        let bend = bend.clamp(min + spare, (max - spare).max(min + spare));
        self.forward(&JointPosition {
            joint2: AngleRad::from_bits(bend.wrapping_mul(self.elbow_sign)),
            ..*joints
        })
    }

    /// Change of the pose per change of each joint.
    ///
    /// Rows: X, Y, Z in millimetres and C in **radians**; columns: joints 1 to 4 in radians, and
    /// joint 3 in millimetres. `jacobian[0][1]` is ∂x/∂θ2 in mm/rad. Good to 1e-6 of the reach.
    #[must_use]
    pub fn jacobian(&self, joints: &JointPosition) -> [[f32; AXES]; AXES] {
        let tool = self.forward(joints);
        let (s1, c1) = sin_cos(turns(joints.joint1));
        let (x, y) = (
            tool.x.to_bits() as f32 * MM_PER_LSB,
            tool.y.to_bits() as f32 * MM_PER_LSB,
        );
        let px = x - self.link1_mm * (c1 as f32 * PER_Q30);
        let py = y - self.link1_mm * (s1 as f32 * PER_Q30);
        [
            [-y, -py, 0.0, 0.0],
            [x, px, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0, 1.0],
        ]
    }

    /// Where `|θ2|` may be, AngleRad: the elbow's side of joint 2's travel, outside the margin.
    pub(super) fn elbow_range(&self) -> (i32, i32) {
        let (min, max) = self.limits[1];
        let (min, max) = if self.elbow_sign < 0 {
            (-max, -min)
        } else {
            (min, max)
        };
        (
            min.max(self.singularity_margin),
            max.min(HALF_TURN - self.singularity_margin),
        )
    }
}

/// `x² + y²` in 2^-38 mm²: at most 2^63.
pub(super) fn squared_radius(pose: &Pose) -> u64 {
    let square = |length: LengthMm| {
        let magnitude = u64::from(length.to_bits().unsigned_abs());
        magnitude * magnitude
    };
    square(pose.x) + square(pose.y)
}

/// `length · factor` for a factor in Q30, rounded to nearest.
pub(super) fn scale_q30(length: i32, factor: i32) -> i32 {
    ((i64::from(length) * i64::from(factor) + (1 << 29)) >> 30) as i32
}

/// Q29 rad to AngleRad (Q26), rounded to nearest.
const fn round_shift_3(angle_q29: i32) -> i32 {
    angle_q29.wrapping_add(4) >> 3
}

/// Degrees to AngleRad bits, rounded to nearest; saturates at ±32 rad.
pub(super) fn radians(angle: AngleDeg) -> i32 {
    let within = angle.to_bits().clamp(-DEG_OF_32_RAD, DEG_OF_32_RAD);
    ((i64::from(within) * RAD_PER_DEG_Q29 + (1 << 28)) >> 29) as i32
}

/// The low half of `value >> by`, for `by` from 1 to 31: three instructions where a shift of a
/// 64-bit number by any amount takes eight.
pub(super) fn shift_right(value: i64, by: u32) -> i32 {
    let (high, low) = ((value >> 32) as u32, value as u32);
    (low.wrapping_shr(by) | high.wrapping_shl(32_u32.wrapping_sub(by))) as i32
}

pub(super) fn saturate(value: i64) -> i32 {
    value.max(i64::from(i32::MIN)).min(i64::from(i32::MAX)) as i32
}
