//! What planning needs in single precision, on the same footing as the tick.

use super::{rsqrt, sin_cos};

/// `√x` for `x ≥ 0`, relative error at most 2e-7.
///
/// The reciprocal root, good to 5e-6, and one Newton step on the root itself.
#[must_use]
pub const fn sqrt_f32(x: f32) -> f32 {
    let reciprocal = rsqrt(x);
    let root = x * reciprocal;
    root + 0.5 * reciprocal * (x - root * root)
}

/// `(sin, cos)` of an angle in ±2π rad, error at most 5e-7; beyond, that of ±2π.
#[must_use]
pub const fn sin_cos_f32(angle_rad: f32) -> (f32, f32) {
    const HALF_TURNS: f32 = (1_i64 << 31) as f32 / core::f32::consts::TAU;
    const UNIT: f32 = 1.0 / (1 << 30) as f32;
    let turns = (angle_rad * HALF_TURNS) as i32 as u32;
    let (sin, cos) = sin_cos(turns.wrapping_mul(2));
    (sin as f32 * UNIT, cos as f32 * UNIT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn root_and_circle_agree_with_double_precision() {
        for i in 0..100_000 {
            let x = (i as f32 * 0.37).powi(2) * 1e-4;
            let exact = f64::from(x).sqrt();
            assert!((f64::from(sqrt_f32(x)) - exact).abs() <= 2e-7 * exact);
            let angle = (i as f32 / 100_000.0 - 0.5) * 12.5;
            let (sin, cos) = sin_cos_f32(angle);
            assert!((f64::from(sin) - f64::from(angle).sin()).abs() < 5e-7);
            assert!((f64::from(cos) - f64::from(angle).cos()).abs() < 5e-7);
        }
    }
}
