//! Kinematics of a delta robot: three arms on a base, a platform that does not turn, and yaw.
//!
//! `R` is the base's radius less the platform's, so that the platform is a point `P = (x, y, z)`
//! on which three forearms of length `l2` end. Arm k points along the horizontal unit vector
//! `u`, and `p = u·P - R` is how far outward of its shoulder `P` is. Its elbow is at
//! `(R + l1 cos θ) u - l1 sin θ Z`; that the forearm `f` from there to `P` keeps its length says
//!
//! ```text
//! p cos θ - z sin θ = m,   m = (P² + R² + l1² - l2² - 2R u·P) / (2 l1)
//! ```
//!
//! [vNoorden21] solves it with `E = 2 l1 (u'·P + R)`, `G = 2 z l1` and `H` for an arm that points
//! the other way, `u' = -u`: `-E`, `G` and `H` are `p`, `z` and `m` times `2 l1`. The form of
//! `tan(θ/2)` that cancels nowhere in the workspace becomes
//!
//! ```text
//! tan(θ/2) = 2c / (-b + √(b² - 4ac)) = (m - p) / (-z + s),   s = √(p² + z² - m²)
//! ```
//!
//! The other form divides by `a`, that is by `m + p`, which crosses zero inside the workspace.
//! `s` is also `f·t`, with `t` the direction in which the elbow moves as θ grows.

use super::delta_config::{DeltaConfig, DeltaError};
use super::scara::{MM_PER_LSB, RAD_S_PER_DEG_S, radians, shift_right};
use crate::math::{atan2, root};
use crate::pose::{AXES, Joint3, JointPosition, JointState, Pose};
use crate::units::{AngleDeg, AngleRad, LengthMm};

/// Arms of a delta robot.
pub(super) const ARMS: usize = 3;

/// `√3/2`, Q30: arms 2 and 3 point along `(±√3/2, 1/2)`.
const HALF_ROOT_3_Q30: i64 = 929_887_697;
pub(super) const HALF_ROOT_3: f32 = 0.866_025_4;

/// Coordinates are computed within ±2048 mm; the arms reach 2000 at the most.
const FURTHEST: i32 = (1 << 30) - 1;

/// The smallest `s` as a part of the forearm that joint speeds are computed with (0.06°): a
/// planned path stays at 0.5° or more, and any other must not divide by zero.
const SINE_MIN: f32 = 1.0 / 1024.0;

/// A validated delta robot in machine units: immutable, shared by the planner and the tick.
#[derive(Clone, Debug)]
pub struct Delta {
    /// `R` and `l1` in LengthMm, `l2²` in 2^-38 mm².
    pub(super) offset: i32,
    pub(super) upper_arm: i32,
    pub(super) forearm_squared: i64,
    /// `R² + l1² - l2²`, and half a unit of what `mean` shifts out: this rounds it.
    constant: i64,
    /// `1 / (2 l1)`, as a right shift and a factor in Q30; see `mean`.
    shift: u32,
    factor: i32,
    /// Just below `2 l1` times 2^31: what `constant` and `P²` may come to.
    sum_max: i64,
    /// `R / l1`, Q30.
    lean: i32,
    /// Lowest and highest position of joints 1 to 4, AngleRad.
    pub(super) limits: [(i32, i32); AXES],
    /// The smallest `s` that the serial margin allows, LengthMm.
    pub(super) root_min: i32,
    pub(super) serial_margin_deg: f32,
    pub(super) parallel_margin: f32,
    pub(super) offset_mm: f32,
    pub(super) upper_arm_mm: f32,
    pub(super) forearm_mm: f32,
    /// The smallest `s` that joint speeds are computed with, LengthMm.
    slowest_root: i32,
    /// `l1` in mm times the resolution of a LengthMm: what a `s` of such units is multiplied by.
    upper_arm_mm_lsb: f32,
}

/// One arm at a pose, LengthMm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limb {
    /// `p`: the platform from the shoulder, outward.
    pub outward: i32,
    /// `m`: the same along the upper arm.
    pub along: i32,
    /// `p² + z² - m²` in 2^-38 mm²; negative out of reach.
    pub squared: i64,
    /// `s`; 0 out of reach.
    pub root: i32,
    /// `(-z + s, m - p)`: the direction of θ/2.
    pub half: (i32, i32),
}

impl Limb {
    /// θ in AngleRad.
    pub(super) fn angle(&self) -> i32 {
        // Twice the angle in Q29, which is an eighth of a unit.
        atan2(self.half.1, self.half.0).wrapping_add(2) >> 2
    }

    /// `(sin θ, cos θ)`, from the half angle; zeros without one.
    pub(super) fn sine_cosine(&self) -> (f32, f32) {
        let (h, k) = (self.half.0 as f32, self.half.1 as f32);
        let (hh, kk) = (h * h, k * k);
        // which adds nothing to the square of a whole number but 0
        let per = 1.0 / (hh + kk + f32::MIN_POSITIVE);
        (2.0 * h * k * per, (hh - kk) * per)
    }
}

impl Delta {
    /// The delta robot that `config` describes, or the first parameter that is out of range.
    ///
    /// # Errors
    /// See [`DeltaError`].
    pub fn new(config: &DeltaConfig) -> Result<Self, DeltaError> {
        config.validate()?;
        let length = |mm: f32| LengthMm::saturating_from_num(mm).to_bits();
        let angle = |degrees: f32| radians(AngleDeg::saturating_from_num(degrees));
        let offset_mm = config.base_radius_mm - config.platform_radius_mm;
        let (offset, upper_arm) = (length(offset_mm), length(config.upper_arm_mm));
        let forearm = i64::from(length(config.forearm_mm));
        let (wide_offset, wide_arm) = (i64::from(offset), i64::from(upper_arm));

        // 2 l1 / 2^shift is in (1/2, 1]; the factor is its inverse.
        let double = 2 * wide_arm;
        let shift = 64 - (double - 1).leading_zeros();
        let factor = ((1_i64 << (30 + shift)) + wide_arm) / double;

        let arm_limits = (angle(config.arm_limits.min), angle(config.arm_limits.max));
        let yaw_limits = (angle(config.yaw_limits.min), angle(config.yaw_limits.max));
        let serial_margin = libm::sinf(config.serial_margin_deg.to_radians());
        let squares = wide_offset * wide_offset + wide_arm * wide_arm - forearm * forearm;
        Ok(Self {
            offset,
            upper_arm,
            forearm_squared: forearm * forearm,
            constant: squares + (1 << (shift - 1)),
            shift,
            factor: i32::try_from(factor).unwrap_or(i32::MAX),
            sum_max: double * ((1 << 31) - 4),
            lean: i32::try_from((wide_offset << 30) / wide_arm).unwrap_or(i32::MAX),
            limits: [arm_limits, arm_limits, arm_limits, yaw_limits],
            root_min: length(config.forearm_mm * serial_margin),
            serial_margin_deg: config.serial_margin_deg,
            parallel_margin: config.parallel_margin,
            offset_mm,
            upper_arm_mm: config.upper_arm_mm,
            forearm_mm: config.forearm_mm,
            slowest_root: length(config.forearm_mm * SINE_MIN),
            upper_arm_mm_lsb: config.upper_arm_mm * MM_PER_LSB,
        })
    }

    /// Joint positions at a pose: elbows outward, the tool below the base.
    ///
    /// Stateless and infallible: beyond its reach an arm points at the platform, and beyond
    /// 2048 mm a coordinate counts as that. Over the workspace joints are within 3e-8 rad
    /// (2e-6°).
    #[must_use]
    pub fn inverse(&self, pose: &Pose) -> JointPosition {
        Self::position(pose, &self.limbs(pose))
    }

    pub(super) fn position(pose: &Pose, limbs: &[Limb; ARMS]) -> JointPosition {
        let [arm1, arm2, arm3] = limbs;
        JointPosition {
            joint1: AngleRad::from_bits(arm1.angle()),
            joint2: AngleRad::from_bits(arm2.angle()),
            joint3: Joint3::from_angle(AngleRad::from_bits(arm3.angle())),
            joint4: AngleRad::from_bits(radians(pose.c)),
        }
    }

    /// The three arms at a pose.
    pub(super) fn limbs(&self, pose: &Pose) -> [Limb; ARMS] {
        self.limbs_at(place(pose))
    }

    fn limbs_at(&self, [x, y, z]: [i32; 3]) -> [Limb; ARMS] {
        let square = |length: i32| i64::from(length) * i64::from(length);
        // Below 2^62: three squares below 2^60 and lengths of up to 2000 mm.
        let sum = square(x) + square(y) + square(z) + self.constant;
        let mean = self.mean(sum);
        directions(x, y).map(|outward| self.limb(outward, z, mean))
    }

    /// The part of `m` that the arms share: `(P² + R² + l1² - l2²) / (2 l1)`.
    fn mean(&self, sum: i64) -> i32 {
        // Of at most 31 bits and a sign after the shift, and so is the quotient.
        let within = sum.max(-self.sum_max).min(self.sum_max);
        let numerator = shift_right(within, self.shift);
        let wide = (i64::from(numerator) * i64::from(self.factor) + (1 << 29)) >> 30;
        wide as i32
    }

    fn limb(&self, u: i32, z: i32, mean: i32) -> Limb {
        let lean = (i64::from(u) * i64::from(self.lean) + (1 << 29)) >> 30;
        let outward = u.saturating_sub(self.offset);
        let along = mean.saturating_sub(lean as i32);
        let wide = |length: i32| i64::from(length) * i64::from(length);
        let squared = wide(outward) + wide(z) - wide(along);
        let root = root(squared.max(0).unsigned_abs()).min(i32::MAX.unsigned_abs()) as i32;
        Limb {
            outward,
            along,
            squared,
            root,
            half: (root.saturating_sub(z), along.saturating_sub(outward)),
        }
    }

    /// Positions, velocities and accelerations of the joints, for a tool at `pose` that moves
    /// with `velocity` (mm/s, mm/s, mm/s, °/s) and `acceleration` (mm/s², mm/s², mm/s², °/s²).
    ///
    /// The derivatives of `f² = l2²`, with `P' = v` and `P'' = a`:
    ///
    /// ```text
    /// θ'  = f·v / (l1 s)
    /// θ'' = (f·a + v² - 2 l1 θ' t·v + l1 m θ'²) / (l1 s)
    /// ```
    ///
    /// Velocities and accelerations are `f32`: over the workspace velocities are good to 1e-6 of
    /// the fastest joint's, accelerations to 2e-6 of the largest among themselves and the
    /// squared velocities. Closer than 0.06° to a serial singularity they are those at 0.06°:
    /// finite for any finite arguments up to 1e6.
    /// Cost on a Cortex-M4: 760 instructions.
    #[must_use]
    pub fn joint_state(
        &self,
        pose: &Pose,
        velocity: [f32; AXES],
        acceleration: [f32; AXES],
    ) -> JointState {
        let place = place(pose);
        let limbs = self.limbs_at(place);
        let [vx, vy, vz, vc] = velocity;
        let [ax, ay, az, ac] = acceleration;
        let [x, y, z] = place.map(|bits| bits as f32 * MM_PER_LSB);

        // What the arms share of f·v and f·a + v².
        let shared_velocity = x * vx + y * vy + z * vz;
        let shared_acceleration = (x * ax + y * ay + z * az) + (vx * vx + vy * vy + vz * vz);
        let outward_velocity = directions_f32(vx, vy);
        let outward_acceleration = directions_f32(ax, ay);

        let mut rates = [0.0; AXES];
        let mut accelerations = [0.0; AXES];
        let outward = outward_velocity.into_iter().zip(outward_acceleration);
        let results = rates.iter_mut().zip(&mut accelerations);
        for ((limb, (u_velocity, u_acceleration)), (rate, acceleration)) in
            limbs.iter().zip(outward).zip(results)
        {
            let (sine, cosine) = limb.sine_cosine();
            let lever = self.offset_mm + self.upper_arm_mm * cosine;
            let drop = self.upper_arm_mm * sine;
            let per = 1.0 / (self.upper_arm_mm_lsb * limb.root.max(self.slowest_root) as f32);
            *rate = (shared_velocity - u_velocity * lever + vz * drop) * per;
            // -2 t·v + m θ'
            let turning =
                2.0 * (u_velocity * sine + vz * cosine) + limb.along as f32 * MM_PER_LSB * *rate;
            let forearm = shared_acceleration - u_acceleration * lever + az * drop;
            *acceleration = (forearm + self.upper_arm_mm * *rate * turning) * per;
        }
        rates[3] = vc * RAD_S_PER_DEG_S;
        accelerations[3] = ac * RAD_S_PER_DEG_S;
        JointState {
            position: Self::position(pose, &limbs),
            velocity: rates,
            acceleration: accelerations,
        }
    }
}

/// `u` of an arm, 1 to 3.
pub(super) const fn directions_of(arm: u8) -> (f32, f32) {
    match arm {
        1 => (0.0, -1.0),
        2 => (HALF_ROOT_3, 0.5),
        _ => (-HALF_ROOT_3, 0.5),
    }
}

/// X, Y and Z of a pose, LengthMm within ±2048 mm.
pub(super) fn place(pose: &Pose) -> [i32; 3] {
    [pose.x, pose.y, pose.z].map(|length| length.to_bits().clamp(-FURTHEST, FURTHEST))
}

/// `u·(x, y)` of the three arms.
fn directions(x: i32, y: i32) -> [i32; ARMS] {
    let side = ((i64::from(x) * HALF_ROOT_3_Q30 + (1 << 29)) >> 30) as i32;
    let half = y >> 1;
    [-y, half.saturating_add(side), half.saturating_sub(side)]
}

/// The same of a velocity or an acceleration.
fn directions_f32(x: f32, y: f32) -> [f32; ARMS] {
    let side = HALF_ROOT_3 * x;
    let half = 0.5 * y;
    [-y, half + side, half - side]
}
