//! The corner solver of the microcontroller against the double-precision oracle.

use host_tests::oracle::{Corner, Prefilter as Oracle};
use planner_core::corner::{self, Side};
use planner_core::prefilter::{Kind, Prefilter, PrefilterConfig};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn random_corners_between_lines() {
    // the published prefilters, at feedrates of up to 4 m/s
    are_solved(&Kind::ALL[1..7], 1500, 4000.0);
}

#[test]
fn random_corners_with_more_prefilters() {
    let kinds = Kind::ALL[7..].iter().copied();
    let kinds: Vec<_> = kinds.filter(|kind| kind.follows_the_mode()).collect();
    are_solved(&kinds, 600, 1000.0);
}

fn are_solved(kinds: &[Kind], count: usize, fastest_mm_s: f32) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut worst_s = 0.0_f64;
    for (i, kind) in kinds.iter().copied().cycle().take(count).enumerate() {
        let frequency_hz = rng.random_range(0.8_f32.ln()..60_f32.ln()).exp();
        let is_humped = kind.name().contains("hump");
        let damping = rng.random_range(0.0_f32..if is_humped { 0.1 } else { 0.25 });
        let angle_deg = rng.random_range(0.5..179.5);
        let tolerance_mm = f64::from(rng.random_range(0.01_f32.ln()..2_f32.ln()).exp());
        let arriving_mm_s = rng.random_range(5_f32.ln()..800_f32.ln()).exp();
        // half of the corners keep their feedrate
        let leaving_mm_s = if i % 2 == 0 {
            arriving_mm_s
        } else {
            (arriving_mm_s * rng.random_range(0.2..5.0)).min(fastest_mm_s)
        };
        let config = PrefilterConfig {
            kind,
            frequency_hz,
            damping,
            ..PrefilterConfig::default()
        };
        let prefilter = Prefilter::new(&config).expect("within range");
        let (sin, cos) = f64::sin_cos(f64::to_radians(angle_deg));
        let side = |tangent, feed_mm_s| Side {
            feed_mm_s,
            tangent,
            heading_rate_per_mm: 0.0,
            length_mm: 1e4,
        };
        let found = corner::solve(
            &side([1.0, 0.0, 0.0], arriving_mm_s),
            &side([cos as f32, sin as f32, 0.0], leaving_mm_s),
            &prefilter.reversed_response(),
            &prefilter.response(),
            tolerance_mm as f32,
        );
        let filter = Oracle::named(kind.name(), frequency_hz.into(), damping.into())
            .expect("the same names");
        let oracle = Corner::of_lines(
            angle_deg,
            (arriving_mm_s.into(), &filter),
            (leaving_mm_s.into(), &filter),
        );
        let case = format!(
            "{i}: {config:?} {angle_deg}°, {arriving_mm_s} to {leaving_mm_s} mm/s, {tolerance_mm} mm: {found:?}"
        );
        // the promise: with the cornering time found, the exact error is within the tolerance
        let exact = oracle.at_overlap(found.cornering_s.into());
        assert!(exact.error_mm <= tolerance_mm, "{case}\n{exact:?}");
        let best = oracle.solve(tolerance_mm);
        let short_s = best.overlap_s - f64::from(found.cornering_s);
        worst_s = worst_s.max(short_s);
        assert!((-1e-6..20e-6).contains(&short_s), "{case}\n{best:?}");
        assert!(
            (f64::from(found.dwell_s) - best.dwell_s).abs() < 20e-6,
            "{case}"
        );
        assert!(
            (f64::from(found.approach_s) - best.closest_s).abs() < 20e-6,
            "{case}\n{best:?}"
        );
        assert!(
            (f64::from(found.error_mm) - exact.error_mm).abs() < 1e-4,
            "{case}\n{exact:?}"
        );
    }
    assert!(
        worst_s > 1e-9,
        "an exact root is not to be had in single precision"
    );
}
