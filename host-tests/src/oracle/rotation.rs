//! Orientations as matrices: multiplied out, turned by Rodrigues' formula, differentiated by
//! differences.

use std::f64::consts::TAU;

/// A matrix by rows.
pub type Matrix = [[f64; 3]; 3];

/// `R = R_z(C) R_y(B) R_x(A)` of angles in degrees.
#[must_use]
pub fn matrix([a, b, c]: [f64; 3]) -> Matrix {
    let [(sa, ca), (sb, cb), (sc, cc)] = [a, b, c].map(|angle| angle.to_radians().sin_cos());
    [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]
}

/// A, B, C in degrees, away from `cos B = 0`.
#[must_use]
pub fn angles_deg(r: &Matrix) -> [f64; 3] {
    [
        r[2][1].atan2(r[2][2]).to_degrees(),
        (-r[2][0]).asin().to_degrees(),
        r[1][0].atan2(r[0][0]).to_degrees(),
    ]
}

/// The product of two matrices.
#[must_use]
pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Axis and angle in degrees of the rotation `to fromᵀ`, away from none and from half a turn.
#[must_use]
pub fn axis_and_angle_deg(from: &Matrix, to: &Matrix) -> ([f64; 3], f64) {
    let back = std::array::from_fn(|i| std::array::from_fn(|j| from[j][i]));
    let r = product(to, &back);
    let angle = ((r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0).acos();
    let skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    (
        skew.map(|part| part / (2.0 * angle.sin())),
        angle.to_degrees(),
    )
}

/// Rodrigues: `cos φ 1 + sin φ [u]× + (1 − cos φ) u uᵀ`.
#[must_use]
pub fn about([x, y, z]: [f64; 3], angle_deg: f64) -> Matrix {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let u = [x, y, z];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let one = f64::from(u8::from(i == j));
            cos * one + sin * cross[i][j] + (1.0 - cos) * u[i] * u[j]
        })
    })
}

/// From one angle to another the shorter way, in degrees.
#[must_use]
pub fn turn_deg(from: f64, to: f64) -> f64 {
    let turns = (to - from).to_radians() / TAU;
    360.0 * (turns - turns.round())
}
