//! Roots by Newton's iteration.
//!
//! `core` offers no square root and `libm` computes it bit by bit on a Cortex-M, so the
//! reciprocal root is iterated from a guess: multiplications only, the same bits everywhere.

use super::ONE_Q30;

/// `1/√x` of a positive normal `x`: relative error at most 5e-6.
///
/// Two Newton steps `y ← y (3 - x y²)/2` from the exponent-halving guess of C. Lomont, "Fast
/// inverse square root" (2003), whose relative error of 3.4 % becomes 1.8e-3, then 4.7e-6.
/// Zero gives a large finite number, so that `x · rsqrt(x)` is 0.
/// Cost on a Cortex-M4: 14 instructions.
#[must_use]
pub const fn rsqrt(x: f32) -> f32 {
    let half = 0.5 * x;
    let guess = f32::from_bits(0x5f37_5a86_u32.wrapping_sub(x.to_bits() >> 1));
    let guess = guess * (1.5 - half * guess * guess);
    guess * (1.5 - half * guess * guess)
}

/// `√(1 - cosine²)`: the sine, in [0, 2^30], of the angle in [0, π] with this cosine, both Q30.
///
/// Error at most 0.6 units (5.6e-10) of the root of the given number, whatever its size.
/// (Near ±1 the *argument's* last bit is worth more: up to 4.3e-5.) A cosine beyond ±1
/// counts as ±1. Cost on a Cortex-M4: 45 instructions.
#[must_use]
pub const fn sine_from_cosine(cosine: i32) -> i32 {
    // 1 - c² = (1 - c)(1 + c): both factors are exact integers, none cancels.
    let below = ONE_Q30.saturating_sub(cosine);
    let above = ONE_Q30.saturating_add(cosine);
    if below <= 0 || above <= 0 {
        return 0;
    }
    let reciprocal = rsqrt(below as f32 * above as f32);
    let guess = (below as f32 * above as f32 * reciprocal) as i32;

    // One more step, s ← g + (n - g²)/(2g), on the exact remainder n - g². It is below 2^43 in
    // magnitude (g is good to 5e-6), so 2^-13 of it fits an i32.
    let square = below as i64 * above as i64;
    let remainder = square.wrapping_sub(guess as i64 * guess as i64);
    let correction = (remainder >> 13) as i32 as f32 * reciprocal * 4096.0;
    // Rounded to nearest: the conversion cuts off towards zero, so it is given a positive number.
    let rounded = (correction + ROUNDING_OFFSET + 0.5) as i32 - ROUNDING_OFFSET as i32;
    guess.wrapping_add(rounded)
}

/// `√n` for `n` below 2^63.
///
/// Error at most 0.7 units from 2^33 on, 2 units below.
/// Cost on a Cortex-M4: 40 instructions.
#[must_use]
pub const fn root(n: u64) -> u32 {
    const HALF: f32 = 4_294_967_296.0;
    let rough = (n >> 32) as u32 as f32 * HALF + n as u32 as f32;
    let reciprocal = rsqrt(rough);
    let guess = (rough * reciprocal) as u32;

    // One more step, s ← g + (n - g²)/(2g), on the exact remainder. It is below 2^47 in
    // magnitude (g is good to 5e-6), so 2^-16 of it fits an i32.
    let square = guess as u64 * guess as u64;
    let remainder = n.wrapping_sub(square) as i64;
    let correction = (remainder.wrapping_add(1 << 15) >> 16) as i32 as f32 * reciprocal * 32_768.0;
    let rounded = (correction + ROOT_OFFSET + 0.5) as i32 - ROOT_OFFSET as i32;
    guess.wrapping_add(rounded as u32)
}

/// More than any correction of that guess (5e-6 · 2^31.5 = 15 200), and exact in `f32`.
const ROOT_OFFSET: f32 = 65_536.0;

/// More than any correction of the guess (5e-6 · 2^30 = 5400), and exact in `f32`.
const ROUNDING_OFFSET: f32 = 16_384.0;

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::println;

    #[test]
    fn reciprocal_root() {
        let mut worst = 0.0_f64;
        for step in 0..1_000_000_u32 {
            // All mantissas of two octaves, then the exponents.
            let x = f32::from_bits(0x3f80_0000 + step * 16);
            worst = worst.max((f64::from(rsqrt(x)) * f64::from(x).sqrt() - 1.0).abs());
        }
        println!("rsqrt: max relative error {worst:.3e}");
        assert!((4e-6..5e-6).contains(&worst), "{worst:e}");
        for exponent in -100..100 {
            let x = 2f32.powi(exponent);
            assert!((f64::from(rsqrt(x)) * f64::from(x).sqrt() - 1.0).abs() < 5e-6);
        }
        assert_eq!(0.0 * rsqrt(0.0), 0.0);
    }

    #[test]
    fn error_over_all_sizes() {
        let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
        let mut check = |cosine: i32| {
            let n = (1_i64 << 60) - i64::from(cosine) * i64::from(cosine);
            let error = f64::from(sine_from_cosine(cosine)) - (n as f64).sqrt();
            worst = worst.max(error.abs());
            squares += error * error;
            count += 1.0;
        };
        for step in 0..1_000_000 {
            check(-ONE_Q30 + step * 2147);
        }
        for step in 0..1_000_000 {
            check(ONE_Q30 - step);
            check(-ONE_Q30 + step);
        }
        let rms = f64::sqrt(squares / count);
        println!("sine_from_cosine: max {worst:.3} units, RMS {rms:.3}");
        assert!((0.5..0.6).contains(&worst), "max {worst}");
        assert!((0.25..0.31).contains(&rms), "RMS {rms}");
    }

    #[test]
    fn root_of_any_size() {
        let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
        for bits in 0..63 {
            for step in 0..20_000_u64 {
                let n = (1 << bits) + ((1_u64 << bits) >> 15).wrapping_mul(step);
                let error = f64::from(root(n)) - (n as f64).sqrt();
                assert!(error.abs() <= 2.0, "{n}: {error}");
                if bits >= 33 {
                    worst = worst.max(error.abs());
                    squares += error * error;
                    count += 1.0;
                }
            }
        }
        let rms = f64::sqrt(squares / count);
        println!("root: max {worst:.3} units, RMS {rms:.3}");
        assert!((0.5..0.7).contains(&worst), "max {worst}");
        assert!((0.25..0.31).contains(&rms), "RMS {rms}");
        assert_eq!(root(0), 0);
    }

    #[test]
    fn beyond_the_ends() {
        for cosine in [
            ONE_Q30,
            -ONE_Q30,
            ONE_Q30 + 1,
            -ONE_Q30 - 1,
            i32::MAX,
            i32::MIN,
        ] {
            assert_eq!(sine_from_cosine(cosine), 0);
        }
        assert_eq!(sine_from_cosine(0), ONE_Q30);
    }
}
