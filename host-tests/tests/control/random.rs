//! Random programs under random control.

use std::fmt::Write;

use host_tests::random_program::{Shape, random_program};
use planner_core::config::Robot;
use planner_core::motion::Order;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::support::{KINDS, Orders, allowance_mm, report, robot, setpoints, top_speed_mm_s};

const FEED_LIMIT_MM_S: f64 = 400.0;

#[test]
fn random_programs_keep_their_promises_under_random_control() {
    keep_their_promises(0..105);
}

#[test]
#[ignore = "long: hundreds of programs"]
fn many_random_programs_keep_their_promises_under_random_control() {
    keep_their_promises(105..805);
}

/// The checker matches trace and path in order. Which corner a passage belongs to cannot be
/// told where a segment is shorter than the tolerance is wide, nor on a spike whose legs are
/// that close; there the distance from the path is judged alone.
fn keep_their_promises(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let (robot, program) = scenario(seed);
        let kind = robot.config.prefilter.kind;
        let undisturbed = setpoints(&robot, &program, &Orders::new());
        let orders = random_orders(seed, undisturbed.len());
        let controlled = setpoints(&robot, &program, &orders);
        let context = || format!("seed {seed}, {kind:?}\n{program}\n{orders:?}");

        assert_eq!(controlled.last(), undisturbed.last(), "{}", context());
        let report = report(&robot, &program, &controlled);
        let allowance_mm = allowance_mm(kind, FEED_LIMIT_MM_S);
        let tolerance_mm = f64::from(robot.config.corner_tolerance_mm);
        for corner in &report.corners {
            assert!(
                corner.shorter_side_mm < 2.0 * tolerance_mm
                    || corner.angle_deg > 140.0
                    || corner.error_mm <= tolerance_mm + allowance_mm,
                "{corner:?}, {}",
                context()
            );
        }
        assert!(
            report.max_path_deviation_mm <= tolerance_mm + allowance_mm,
            "{} mm, {}",
            report.max_path_deviation_mm,
            context()
        );
        let top_mm_s = top_speed_mm_s(&controlled);
        // positions have a resolution of 2 nm
        assert!(
            top_mm_s <= FEED_LIMIT_MM_S * (1.0 + 1e-6) + 0.01,
            "{top_mm_s} mm/s, {}",
            context()
        );
    }
}

/// Moves that last about as long as the prefilter: whether a corner is done when the next one
/// comes is a matter of the override.
#[test]
fn corners_a_filter_apart_keep_the_tolerance_when_hurried() {
    corners_a_filter_apart(0..3000);
}

#[test]
#[ignore = "long: ten thousand programs"]
fn many_corners_a_filter_apart_keep_the_tolerance_when_hurried() {
    corners_a_filter_apart(3000..13_000);
}

/// Corners closer together than three times the tolerance share it: there the distance from the
/// path is what is promised.
fn corners_a_filter_apart(seeds: std::ops::Range<u64>) {
    const FEED_MM_S: f64 = 160.0;
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let kind = KINDS[1 + seed as usize % (KINDS.len() - 1)];
        let mut robot = robot(|config| {
            config.prefilter.kind = kind;
            config.prefilter.frequency_hz = 12.0;
        });
        // what the tool travels while the prefilter settles
        let reach_mm = FEED_MM_S * robot.prefilter().length_s();
        robot.config.corner_tolerance_mm = (reach_mm * rng.random_range(0.01..0.2)) as f32;
        let program = staircase(&mut rng, reach_mm);
        let mut orders = Orders::new();
        let mut tick = 0;
        for _ in 0..60 {
            let percent = if rng.random_bool(0.3) {
                100
            } else {
                rng.random_range(100..=200)
            };
            orders.insert(
                tick,
                Order::Rates {
                    feed_percent: percent,
                    rapid_percent: 100,
                },
            );
            tick += rng.random_range(1..300);
        }
        let all = setpoints(&robot, &program, &orders);
        let tolerance_mm = f64::from(robot.config.corner_tolerance_mm);
        let allowance_mm = allowance_mm(kind, 2.0 * FEED_MM_S);
        let report = report(&robot, &program, &all);
        assert!(
            report.max_path_deviation_mm <= tolerance_mm + allowance_mm,
            "seed {seed}, {kind:?}: {} of {tolerance_mm} mm\n{program}{orders:?}",
            report.max_path_deviation_mm
        );
        for corner in &report.corners {
            assert!(
                corner.shorter_side_mm < 3.0 * tolerance_mm
                    || corner.error_mm <= tolerance_mm + allowance_mm,
                "seed {seed}, {kind:?}: {corner:?}\n{program}{orders:?}"
            );
        }
    }
}

/// Moves of 0.2 to 2 times `reach_mm` that turn by up to 140° either way.
fn staircase(rng: &mut ChaCha8Rng, reach_mm: f64) -> String {
    let mut program = String::from("G0 X230 Y0\nG1 F9600\n");
    let (mut at, mut heading) = ([230.0_f64, 0.0_f64], 0.0_f64);
    for _ in 0..25 {
        let length_mm = reach_mm * rng.random_range(0.2_f64.ln()..2.0_f64.ln()).exp();
        let turn = rng.random_range(20.0_f64..140.0).to_radians();
        heading += if rng.random_bool(0.7) { turn } else { -turn };
        // back towards the middle of the reach
        while (at[0] + length_mm * heading.cos() - 230.0).hypot(at[1] + length_mm * heading.sin())
            > 75.0
        {
            heading += 0.7;
        }
        at = [
            at[0] + length_mm * heading.cos(),
            at[1] + length_mm * heading.sin(),
        ];
        let _ = writeln!(program, "X{:.4} Y{:.4}", at[0], at[1]);
    }
    program + "M2\n"
}

fn scenario(seed: u64) -> (Robot, String) {
    let robot = robot(|config| {
        config.prefilter.kind = KINDS[seed as usize % KINDS.len()];
        config.prefilter.frequency_hz = 3.0 + (seed % 11) as f32;
        config.feed_limit_mm_s = FEED_LIMIT_MM_S as f32;
        config.corner_tolerance_mm = [0.01, 0.05, 0.2, 0.5, 2.0][seed as usize % 5];
    });
    let shape = Shape {
        tolerances: false,
        smooth: if seed.is_multiple_of(3) { 0.9 } else { 0.3 },
        longest_mm: if seed.is_multiple_of(2) { 3.0 } else { 150.0 },
        ..Shape::default()
    };
    (robot, random_program(seed, shape))
}

/// Holds, some of them short, and changes of the rates, 10 to 200 %; in the end all is as it was.
fn random_orders(seed: u64, ticks: usize) -> Orders {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut orders = Orders::new();
    let mut tick = 0;
    let rates = |feed_percent| Order::Rates {
        feed_percent,
        rapid_percent: 50,
    };
    while tick < ticks {
        tick += rng.random_range(1.0_f64.ln()..1000.0_f64.ln()).exp() as usize;
        if rng.random_bool(0.4) {
            orders.insert(tick, Order::Hold);
            tick += rng.random_range(1.0_f64.ln()..700.0_f64.ln()).exp() as usize;
            orders.insert(tick, Order::Resume);
        } else {
            let percent = if rng.random_bool(0.3) {
                10..=100
            } else {
                100..=200
            };
            orders.insert(tick, rates(rng.random_range(percent)));
        }
        tick += 1;
    }
    orders.insert(tick, Order::Resume);
    orders.insert(tick + 1, rates(100));
    orders
}
