//! Angle of a vector.

/// π in Q29 rad, the format of [`atan2`].
pub const PI_Q29: i32 = 1_686_629_713;

/// A right angle in Q31 rad.
const HALF_PI_Q31: u32 = 3_373_259_426;

/// `atan(k/64)` in Q31 rad, `k` = 0 ..= 64.
#[rustfmt::skip]
const ATAN_Q31: [i32; 65] = [
    0, 33_551_702, 67_087_031, 100_589_665, 134_043_374, 167_432_071,
    200_739_859, 233_951_071, 267_050_317, 300_022_523, 332_852_969, 365_527_326,
    398_031_692, 430_352_617, 462_477_139, 494_392_799, 526_087_673, 557_550_384,
    588_770_118, 619_736_641, 650_440_302, 680_872_046, 711_023_411, 740_886_534,
    770_454_148, 799_719_575, 828_676_723, 857_320_075, 885_644_680, 913_646_139,
    941_320_595, 968_664_710, 995_675_659, 1_022_351_102, 1_048_689_175, 1_074_688_463,
    1_100_347_987, 1_125_667_181, 1_150_645_872, 1_175_284_259, 1_199_582_895, 1_223_542_667,
    1_247_164_773, 1_270_450_704, 1_293_402_227, 1_316_021_363, 1_338_310_370, 1_360_271_726,
    1_381_908_109, 1_403_222_383, 1_424_217_582, 1_444_896_894, 1_465_263_644, 1_485_321_285,
    1_505_073_381, 1_524_523_592, 1_543_675_670, 1_562_533_439, 1_581_100_789, 1_599_381_666,
    1_617_380_060, 1_635_099_998, 1_652_545_533, 1_669_720_742, 1_686_629_713,
];

/// Angle of the vector `(x, y)` in Q29 rad: in [-π, π], counter-clockwise from +X.
///
/// Q29 because π fits and a joint angle (2^-26 rad) is one rounding shift away. The vector's
/// length does not matter, but its components should be large: half a unit of a component is
/// `0.5 / length` rad. Error, besides that, at most 3e-9 rad. `atan2(0, 0)` is 0; every input
/// is allowed. Cost on a Cortex-M4: 62 instructions, two of them divisions of `f32`.
#[must_use]
pub const fn atan2(y: i32, x: i32) -> i32 {
    // Fold into the first octant: 0 <= opposite <= adjacent.
    let (width, height) = (x.unsigned_abs(), y.unsigned_abs());
    let steep = height > width;
    let (opposite, adjacent) = if steep {
        (width, height)
    } else {
        (height, width)
    };

    // The nearest k/64 to the slope o/a, then
    //   atan(o/a) = atan(k/64) + atan(z),   z = (64 o - k a) / (64 a + k o),   |z| <= 1/128.
    // The numerator is exact: it is below 2^31 even where its two terms wrap.
    // For the vector (0, 0) both quotients are NaN, which converts to the integer 0.
    let (opposite_f, adjacent_f) = (opposite as f32, adjacent as f32);
    let step = (opposite_f / adjacent_f * 64.0 + 0.5) as u32;
    let numerator = (opposite << 6).wrapping_sub(step.wrapping_mul(adjacent)) as i32;
    let z = numerator as f32 / (64.0 * adjacent_f + step as f32 * opposite_f);

    // atan(z) = z - z³/3 + ..., the next term below 6e-12.
    let residual = z - z * z * z * (1.0 / 3.0);
    let residual_q31 = (residual * 2_147_483_648.0) as i32;
    let step_q31 = if step < 65 {
        ATAN_Q31[step as usize]
    } else {
        0
    };
    let angle = step_q31.wrapping_add(residual_q31) as u32;

    // Unfold, rounding to Q29 on the way.
    let angle = if steep {
        HALF_PI_Q31.wrapping_sub(angle)
    } else {
        angle
    };
    let angle = (angle.wrapping_add(2) >> 2) as i32;
    let angle = if x < 0 { PI_Q29 - angle } else { angle };
    if y < 0 { -angle } else { angle }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::{f64::consts::TAU, println};

    const Q29: f64 = (1u32 << 29) as f64;

    fn error(y: i32, x: i32) -> f64 {
        f64::from(atan2(y, x)) / Q29 - f64::from(y).atan2(f64::from(x))
    }

    #[test]
    fn table() {
        for (k, angle) in ATAN_Q31.into_iter().enumerate() {
            assert_eq!(
                f64::from(angle),
                ((k as f64 / 64.0).atan() * 2f64.powi(31)).round()
            );
        }
    }

    #[test]
    fn error_over_the_circle() {
        let (mut worst, mut squares) = (0.0_f64, 0.0);
        let count = 4_000_000;
        for step in 0..count {
            let (s, c) = (TAU * f64::from(step) / f64::from(count) + 1e-7).sin_cos();
            let length = 2f64.powi(29) * (1.0 + f64::from(step % 997) / 997.0);
            let error = error((length * s) as i32, (length * c) as i32);
            worst = worst.max(error.abs());
            squares += error * error;
        }
        let rms = (squares / f64::from(count)).sqrt();
        println!("atan2: max {worst:.3e} rad, RMS {rms:.3e} rad");
        assert!((1e-9..2.9e-9).contains(&worst), "max {worst:e}");
        assert!((3e-10..8e-10).contains(&rms), "RMS {rms:e}");
    }

    #[test]
    fn axes_and_extremes() {
        assert_eq!(atan2(0, 0), 0);
        assert_eq!(atan2(0, 5), 0);
        assert_eq!(atan2(5, 0), 843_314_857);
        assert_eq!(atan2(-5, 0), -843_314_857);
        assert_eq!(atan2(0, -5), PI_Q29);
        for y in [i32::MIN, -1, 0, 1, i32::MAX] {
            for x in [i32::MIN, -1, 0, 1, i32::MAX] {
                assert!(error(y, x).abs() < 3e-9, "({y}, {x})");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100_000))]
        #[test]
        fn error_for_any_vector(y: i32, x: i32, shift in 0..31) {
            prop_assert!(error(y, x >> shift).abs() < 3e-9);
            prop_assert!(error(y >> shift, x).abs() < 3e-9);
        }
    }
}
