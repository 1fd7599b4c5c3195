//! Sine and cosine of a binary angle.

use super::{ONE_Q30, mul_high, mul_high_rounded};
use crate::units::AngleRad;

/// `sin(x π/4) / x` for `x` in [-1, 1] as a polynomial in `x²/4`, Q31.
///
/// Interpolates at the five Chebyshev nodes of `x²` in [0, 1]: error 3.4e-12.
const SIN_Q31: [i32; 5] = [1_686_629_713, -693_598_667, 85_569_259, -5_026_471, 169_873];

/// `(cos(x π/4) - 1) / x²` for `x` in [-1, 1] as a polynomial in `x²/4`, Q32.
///
/// Interpolates at the four Chebyshev nodes of `x²` in [0, 1]: error 1.9e-10.
const COS_Q32: [i32; 4] = [-1_324_675_878, 272_375_455, -22_399_895, 973_605];

/// `2^38 / (2π)`: AngleRad (2^-26 rad) to turns (2^-32 turn) is this times 2^-27.
const TURNS_PER_RAD_Q27: i64 = 1_367_130_551;

/// Sine and cosine of a binary angle.
///
/// `turns` counts 2^-32 of a turn, so that angles wrap as the integer does. Returns
/// `(sine, cosine)` in Q30, each in ±2^30.
///
/// Error at most 1.2e-9; `sin_cos(0)` is exactly `(0, 2^30)`, and so are the other
/// quarter turns. `sin(-t) = -sin(t)` to the last bit or one beside it.
/// Cost on a Cortex-M4: 46 instructions.
#[must_use]
pub const fn sin_cos(turns: u32) -> (i32, i32) {
    // The nearest quarter turn, and x in [-1, 1), Q31: what remains in eighths of a turn.
    let quarter = turns.wrapping_add(1 << 29) >> 30;
    let x = (turns << 2) as i32;
    // x² in Q30; as a Q32 number, it is x²/4.
    let z = mul_high_rounded(x, x);

    // sin = x (s0 + s1 z/4 + s2 (z/4)² + ...)
    let [s0, s1, s2, s3, s4] = SIN_Q31;
    let sum = s3.wrapping_add(mul_high(z, s4));
    let sum = s2.wrapping_add(mul_high(z, sum));
    let sum = s1.wrapping_add(mul_high(z, sum));
    let sum = s0.wrapping_add(mul_high(z, sum));
    let sine = mul_high_rounded(x, sum);

    // cos = 1 + z (c0 + c1 z/4 + c2 (z/4)² + ...)
    let [c0, c1, c2, c3] = COS_Q32;
    let sum = c2.wrapping_add(mul_high(z, c3));
    let sum = c1.wrapping_add(mul_high(z, sum));
    let sum = c0.wrapping_add(mul_high(z, sum));
    let cosine = ONE_Q30.wrapping_add(mul_high_rounded(z, sum));

    match quarter {
        0 => (sine, cosine),
        1 => (cosine, sine.wrapping_neg()),
        2 => (sine.wrapping_neg(), cosine.wrapping_neg()),
        _ => (cosine.wrapping_neg(), sine),
    }
}

/// A joint angle as a binary angle, 2^-32 of a turn, for [`sin_cos`].
///
/// Exact to 2 units (3e-9 rad) for angles in ±2π, to 5 units in ±32 rad.
/// Cost on a Cortex-M4: 5 instructions.
#[must_use]
pub const fn turns(angle: AngleRad) -> u32 {
    ((angle.to_bits() as i64 * TURNS_PER_RAD_Q27) >> 27) as u32
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::{f64::consts::TAU, println};

    const Q30: f64 = (1u32 << 30) as f64;

    #[test]
    fn error_over_the_circle() {
        let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
        for step in 0..2_000_000_u32 {
            let turns = step.wrapping_mul(2_147_483);
            let (sine, cosine) = sin_cos(turns);
            let (s, c) = (f64::from(turns) / 2f64.powi(32) * TAU).sin_cos();
            for error in [f64::from(sine) / Q30 - s, f64::from(cosine) / Q30 - c] {
                worst = worst.max(error.abs());
                squares += error * error;
                count += 1.0;
            }
        }
        let rms = f64::sqrt(squares / count);
        println!("sin_cos: max {worst:.3e}, RMS {rms:.3e}");
        assert!((5e-10..1.2e-9).contains(&worst), "max {worst:e}");
        assert!((1e-10..4.0e-10).contains(&rms), "RMS {rms:e}");
    }

    #[test]
    fn quarter_turns_are_exact() {
        assert_eq!(sin_cos(0), (0, ONE_Q30));
        assert_eq!(sin_cos(1 << 30), (ONE_Q30, 0));
        assert_eq!(sin_cos(1 << 31), (0, -ONE_Q30));
        assert_eq!(sin_cos(3 << 30), (-ONE_Q30, 0));
    }

    #[test]
    fn sine_is_odd_and_cosine_even() {
        for step in 0..1_000_000_u32 {
            let turns = step.wrapping_mul(4_294_967);
            let (sine, cosine) = sin_cos(turns);
            let (mirrored_sine, mirrored_cosine) = sin_cos(turns.wrapping_neg());
            assert!((sine + mirrored_sine).abs() <= 1, "at {turns}");
            assert!((cosine - mirrored_cosine).abs() <= 1, "at {turns}");
        }
    }

    #[test]
    fn turns_of_an_angle() {
        for (limit, units) in [(TAU, 2.0), (31.9, 5.0)] {
            for step in -1000..=1000 {
                let angle = AngleRad::from_num(limit * f64::from(step) / 1000.0);
                let exact = (angle.to_num::<f64>() / TAU * 2f64.powi(32)).rem_euclid(2f64.powi(32));
                let error = (f64::from(turns(angle)) - exact).abs();
                assert!(
                    error.min(2f64.powi(32) - error) <= units,
                    "{angle}: {error}"
                );
            }
        }
    }
}
