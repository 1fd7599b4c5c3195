//! From the arms of a delta robot to its platform: where three spheres meet.
//!
//! Each forearm keeps the platform on a sphere of radius `l2` about its elbow, at
//! `c = (ρ u, h)` with `ρ = R + l1 cos θ`, `h = -l1 sin θ`:
//!
//! ```text
//! P² - 2ρ u·P - 2h z + w = 0,   w = R² + l1² - l2² + 2R l1 cos θ
//! ```
//!
//! The first guess, in `f32`: the differences of these equations give x and y as linear functions
//! of z, and the first one a quadratic equation for z, whose lower root it is. Then one step of
//! Newton's method on the exact integers `f² - l2²`.

use super::delta::{ARMS, Delta, HALF_ROOT_3};
use super::scara::{DEG_PER_RAD_Q31, MM_PER_LSB, saturate, scale_q30};
use crate::math::{ONE_Q30, sin_cos, sqrt_f32, turns};
use crate::pose::{AXES, JointPosition, Pose};
use crate::units::{AngleDeg, AngleRad, LengthMm};

/// `√3/2` and `1/2`, Q30, and the directions of the arms.
const DIRECTIONS_Q30: [(i32, i32); ARMS] = [
    (0, -ONE_Q30),
    (929_887_697, ONE_Q30 / 2),
    (-929_887_697, ONE_Q30 / 2),
];

/// The smallest part of `l2³` that the forearms may span for a step of Newton's method.
const VOLUME_MIN: f32 = 1e-3;

/// 2^19: millimetres to LengthMm.
const LSB_PER_MM: f32 = 524_288.0;

/// An elbow.
#[derive(Clone, Copy, Debug)]
struct Elbow {
    /// X, Y, Z in LengthMm.
    at: [i32; 3],
    /// `(sin θ, cos θ)`.
    sine_cosine: (f32, f32),
}

impl Delta {
    /// Where the tool is with the joints at `joints`; C saturates at ±1833°.
    ///
    /// Over the workspace within 20 nm. Arms so far apart that the forearms cannot meet give a
    /// point near where they almost would; infallible all the same.
    /// Cost on a Cortex-M4: 737 instructions.
    #[must_use]
    pub fn forward(&self, joints: &JointPosition) -> Pose {
        let elbows = self.elbows(joints);
        let (guess, meet) = self.guess(&elbows);
        let place = if meet {
            self.refined(guess, &elbows)
        } else {
            guess
        };
        let yaw = i64::from(joints.joint4.to_bits());
        Pose {
            x: LengthMm::from_bits(place[0]),
            y: LengthMm::from_bits(place[1]),
            z: LengthMm::from_bits(place[2]),
            c: AngleDeg::from_bits(saturate((yaw * DEG_PER_RAD_Q31 + (1 << 30)) >> 31)),
        }
    }

    /// Change of the pose per change of each joint.
    ///
    /// Rows: X, Y, Z in millimetres and C in **radians**; columns: joints 1 to 4 in radians.
    /// `f·P' = l1 s θ'` for each arm, so it is the inverse of the forearms' matrix, each column
    /// times `l1 s`. Good to 1e-5 of its largest entry over the workspace. In a parallel
    /// singularity entries are large and finite.
    #[must_use]
    pub fn jacobian(&self, joints: &JointPosition) -> [[f32; AXES]; AXES] {
        let tool = self.forward(joints);
        let place = [tool.x, tool.y, tool.z].map(LengthMm::to_bits);
        let elbows = self.elbows(joints);
        let forearms = elbows.map(|elbow| difference_mm(place, elbow.at));
        let (columns, volume) = cofactors(&forearms);
        let floor = VOLUME_MIN * self.forearm_mm * self.forearm_mm * self.forearm_mm;
        let volume = if volume.abs() < floor { -floor } else { volume };

        let mut jacobian = [[0.0; AXES]; AXES];
        jacobian[3][3] = 1.0;
        for (arm, ((column, forearm), elbow)) in
            columns.iter().zip(&forearms).zip(&elbows).enumerate()
        {
            let (ux, uy) = DIRECTIONS_Q30[arm];
            let outward = (forearm[0] * ux as f32 + forearm[1] * uy as f32) / ONE_Q30 as f32;
            let (sine, cosine) = elbow.sine_cosine;
            // s = f·t, and t = (-sin θ u, -cos θ)
            let root = -(outward * sine + forearm[2] * cosine);
            let scale = self.upper_arm_mm * root / volume;
            for (row, entry) in jacobian.iter_mut().zip(column) {
                row[arm] = entry * scale;
            }
        }
        jacobian
    }

    fn elbows(&self, joints: &JointPosition) -> [Elbow; ARMS] {
        let angles = [joints.joint1, joints.joint2, joints.joint3.as_angle()];
        let mut directions = DIRECTIONS_Q30.into_iter();
        angles.map(|angle| {
            let (ux, uy) = directions.next().unwrap_or_default();
            self.elbow(angle, ux, uy)
        })
    }

    fn elbow(&self, angle: AngleRad, ux: i32, uy: i32) -> Elbow {
        let (sine, cosine) = sin_cos(turns(angle));
        let radius = self.offset + scale_q30(self.upper_arm, cosine);
        let unit = 1.0 / ONE_Q30 as f32;
        Elbow {
            at: [
                scale_q30(radius, ux),
                scale_q30(radius, uy),
                -scale_q30(self.upper_arm, sine),
            ],
            sine_cosine: (sine as f32 * unit, cosine as f32 * unit),
        }
    }

    /// Where the spheres meet, good to some 10 µm, and whether they do.
    fn guess(&self, elbows: &[Elbow; ARMS]) -> ([i32; 3], bool) {
        let (offset, arm, forearm) = (self.offset_mm, self.upper_arm_mm, self.forearm_mm);
        let squares = offset * offset + (arm - forearm) * (arm + forearm);
        let spheres = elbows.map(|elbow| {
            let (sine, cosine) = elbow.sine_cosine;
            let radius = offset + arm * cosine;
            (radius, -arm * sine, squares + 2.0 * offset * arm * cosine)
        });
        let [(r1, h1, w1), (r2, h2, w2), (r3, h3, w3)] = spheres;

        // 2 (ρ_k u_k - ρ_1 u_1)·(x, y) = w_k - w_1 - 2 (h_k - h_1) z, for arms 2 and 3
        let (a2, b2) = (HALF_ROOT_3 * r2, 0.5 * r2 + r1);
        let (a3, b3) = (-HALF_ROOT_3 * r3, 0.5 * r3 + r1);
        let determinant = a2 * b3 - a3 * b2;
        let determinant = if determinant.abs() < 1.0 {
            1.0
        } else {
            determinant
        };
        let per = 1.0 / determinant;
        let solve = |c2: f32, c3: f32| ((c2 * b3 - c3 * b2) * per, (a2 * c3 - a3 * c2) * per);
        let (x0, y0) = solve(0.5 * (w2 - w1), 0.5 * (w3 - w1));
        let (x1, y1) = solve(h1 - h2, h1 - h3);

        // x² + y² + z² + 2ρ_1 y - 2h_1 z + w_1 = 0
        let square = 1.0 + x1 * x1 + y1 * y1;
        let half = x0 * x1 + y0 * y1 + r1 * y1 - h1;
        let rest = x0 * x0 + y0 * y0 + 2.0 * r1 * y0 + w1;
        let discriminant = half * half - square * rest;
        let z = -(half + sqrt_f32(discriminant.max(0.0))) / square;
        let place = [x0 + x1 * z, y0 + y1 * z, z].map(|mm| (mm * LSB_PER_MM) as i32);
        (place, discriminant > 0.0)
    }

    /// One step of Newton's method: `f·δ = (l2² - f²) / 2` for each forearm.
    fn refined(&self, place: [i32; 3], elbows: &[Elbow; ARMS]) -> [i32; 3] {
        let forearms = elbows.map(|elbow| difference_mm(place, elbow.at));
        let (columns, volume) = cofactors(&forearms);
        let floor = VOLUME_MIN * self.forearm_mm * self.forearm_mm * self.forearm_mm;
        if volume.abs() < floor {
            return place;
        }
        let mut step = [0.0; 3];
        for (elbow, column) in elbows.iter().zip(&columns) {
            let missing = self.forearm_squared.wrapping_sub(squared(place, elbow.at));
            // Half of it, from 2^-38 mm² by way of 2^-22.
            let half_mm2 = saturate(missing >> 16) as f32 * (0.5 / 4_194_304.0);
            for (step, entry) in step.iter_mut().zip(column) {
                *step += entry * half_mm2;
            }
        }
        let per = LSB_PER_MM / volume;
        let mut result = place;
        for (value, step) in result.iter_mut().zip(step) {
            *value = value.saturating_add((step * per) as i32);
        }
        result
    }
}

/// Columns of the inverse of the matrix with these rows, times its determinant, and that.
fn cofactors(rows: &[[f32; 3]; ARMS]) -> ([[f32; 3]; ARMS], f32) {
    let [a, b, c] = rows;
    let columns = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = a[0] * columns[0][0] + a[1] * columns[0][1] + a[2] * columns[0][2];
    (columns, determinant)
}

pub(super) fn cross(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// `a - b` in millimetres.
fn difference_mm(a: [i32; 3], b: [i32; 3]) -> [f32; 3] {
    let mut difference = [0.0; 3];
    for ((result, a), b) in difference.iter_mut().zip(a).zip(b) {
        *result = a.saturating_sub(b) as f32 * MM_PER_LSB;
    }
    difference
}

/// `(a - b)²` in 2^-38 mm²; wraps beyond 5792 mm.
fn squared(a: [i32; 3], b: [i32; 3]) -> i64 {
    a.into_iter().zip(b).fold(0, |sum: i64, (a, b)| {
        let difference = i64::from(a.saturating_sub(b));
        sum.wrapping_add(difference * difference)
    })
}
