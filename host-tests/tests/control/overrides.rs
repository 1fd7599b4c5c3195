//! Feed and rapid override.

use host_tests::vector::{norm, sub, xyz};
use planner_core::motion::{Order, Setpoint};
use planner_core::prefilter::Kind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::support::{
    CORNER_PATH, KINDS, Orders, TICK_S, allowance_mm, pose, report, robot, setpoints,
    top_speed_mm_s,
};

fn rates(feed_percent: u16, rapid_percent: u8) -> Order {
    Order::Rates {
        feed_percent,
        rapid_percent,
    }
}

fn from_the_start(order: Order) -> Orders {
    Orders::from([(0, order)])
}

/// Mean speed over 100 ticks from one on.
fn speed_mm_s(setpoints: &[Setpoint], tick: usize) -> f64 {
    const TICKS: usize = 100;
    let way = sub(
        xyz(pose(&setpoints[tick + TICKS])),
        xyz(pose(&setpoints[tick])),
    );
    norm(way) / (TICKS as f64 * TICK_S)
}

#[test]
fn a_line_is_driven_at_its_part_of_the_feedrate() {
    let robot = robot(|config| config.feed_limit_mm_s = 150.0);
    let program = "G0 X200 Y-120\nG1 Y130 F6000\nM2";
    for (percent, expected_mm_s) in [
        (5, 10.0),
        (10, 10.0),
        (37, 37.0),
        (99, 99.0),
        (100, 100.0),
        (101, 101.0),
        (150, 150.0),
        // the robot's limit
        (200, 150.0),
        (999, 150.0),
    ] {
        let all = setpoints(&robot, program, &from_the_start(rates(percent, 25)));
        let found_mm_s = speed_mm_s(&all, 600);
        assert!(
            (found_mm_s / expected_mm_s - 1.0).abs() < 1e-4,
            "{percent} %: {found_mm_s} mm/s"
        );
    }
}

#[test]
fn rapids_follow_their_own_override() {
    let robot = robot(|config| config.rapid_mm_s = 160.0);
    let program = "G0 X200 Y-120\nG0 Y130\nM2";
    for (percent, expected_mm_s) in [(100, 160.0), (50, 80.0), (25, 40.0), (255, 160.0)] {
        let all = setpoints(&robot, program, &from_the_start(rates(200, percent)));
        let found_mm_s = speed_mm_s(&all, 600);
        assert!(
            (found_mm_s / expected_mm_s - 1.0).abs() < 2e-5,
            "{percent} %: {found_mm_s} mm/s"
        );
    }
}

#[test]
fn the_yaw_keeps_its_limit() {
    let robot = robot(|config| config.yaw_limit_deg_s = 90.0);
    for program in [
        "G0 X250 Y0\nG1 C90 F3000\nM2",
        "G0 X250 Y0\nG1 X260 C90 F300\nM2",
    ] {
        let all = setpoints(&robot, program, &from_the_start(rates(200, 100)));
        let steps = all.windows(2).map(|pair| {
            let [before, now] = [0, 1].map(|i| pair[i].pose.c.to_num::<f64>());
            (now - before) / TICK_S
        });
        let fastest_deg_s = steps.fold(0.0, f64::max);
        // a resolution of 2e-6°
        assert!((fastest_deg_s - 90.0).abs() < 0.01, "{fastest_deg_s}");
    }
}

#[test]
fn pauses_and_dwells_follow_none() {
    let robot = robot(|_| {});
    let program = "G0 X250 Y0\nG4 P1.5\nM2";
    let lengths = [10, 100, 200].map(|percent| {
        let all = setpoints(&robot, program, &from_the_start(rates(percent, 25)));
        all.len()
    });
    assert_eq!(lengths[0], lengths[1]);
    assert_eq!(lengths[1], lengths[2]);
}

/// All segments are long and all corners alone, so that the whole path is hurried.
#[test]
fn the_corner_path_keeps_its_tolerance_at_every_override() {
    for kind in KINDS {
        let robot = robot(|config| config.prefilter.kind = kind);
        let mut last_length = usize::MAX;
        for percent in [10, 33, 75, 100, 101, 130, 170, 200] {
            let all = setpoints(&robot, CORNER_PATH, &from_the_start(rates(percent, 100)));
            let context = format!("{kind:?} at {percent} %");
            let report = report(&robot, CORNER_PATH, &all);
            for corner in &report.corners {
                assert!(corner.error_mm <= 0.5, "{context}: {corner:?}");
            }
            let feed_mm_s = 160.0 * f64::from(percent) / 100.0;
            let allowance_mm = allowance_mm(kind, feed_mm_s);
            assert!(
                report.max_path_deviation_mm <= 0.5 + allowance_mm,
                "{context}: {report:?}"
            );
            assert_eq!((report.drift_mm, report.drift_deg), (0.0, 0.0));
            let top_mm_s = top_speed_mm_s(&all);
            assert!(
                (top_mm_s / feed_mm_s - 1.0).abs() < 2e-3,
                "{context}: {top_mm_s}"
            );
            assert!(all.len() < last_length, "{context}");
            last_length = all.len();
        }
    }
}

/// No allowance for what the trace does within a tick, even where the velocity jumps.
#[test]
fn a_corner_of_any_angle_keeps_its_tolerance_when_hurried() {
    for kind in KINDS {
        let robot = robot(|config| config.prefilter.kind = kind);
        for angle_deg in (3..180).step_by(4) {
            let angle_rad = f64::from(angle_deg).to_radians();
            let program = format!(
                "G0 X200 Y0\nG1 X250 F9000\nX{:.4} Y{:.4}\nM2",
                250.0 + 50.0 * angle_rad.cos(),
                50.0 * angle_rad.sin(),
            );
            for percent in [100, 107, 150, 200] {
                let all = setpoints(&robot, &program, &from_the_start(rates(percent, 100)));
                let report = report(&robot, &program, &all);
                let corner = &report.corners[0];
                assert!(
                    corner.error_mm <= corner.tolerance_mm,
                    "{kind:?} at {percent} %: {corner:?}"
                );
            }
        }
    }
}

/// Short segments whose corners share the tolerance go as programmed, and lose next to nothing
/// by being asked to hurry.
#[test]
fn dense_polylines_are_not_hurried() {
    let program = include_str!("../../programs/half-millimetres.gcode");
    let robot = robot(|_| {});
    let [usual, hurried] =
        [100, 200].map(|percent| setpoints(&robot, program, &from_the_start(rates(percent, 100))));
    assert!(
        hurried.len() <= usual.len() + 320,
        "{} {}",
        usual.len(),
        hurried.len()
    );
    assert!(report(&robot, program, &hurried).max_path_deviation_mm <= 0.5);
}

/// Lower takes effect at once; higher as soon as the corner behind is done.
#[test]
fn rates_change_on_the_way() {
    let robot = robot(|config| config.prefilter.kind = Kind::Fir);
    let program = "G0 X200 Y-120\nG1 Y-110 F6000\nY130\nM2";
    let orders = Orders::from([(120, rates(200, 100)), (800, rates(50, 100))]);
    let all = setpoints(&robot, program, &orders);
    let length = usize::from(robot.kernel.length_ticks());
    // The corner is at tick 100; the new rate is there a filter's length after it is done.
    assert!((speed_mm_s(&all, 100 + 2 * length + 10) - 200.0).abs() < 0.1);
    assert!((speed_mm_s(&all, 800 + length + 3) - 50.0).abs() < 0.1);
    let speeds: Vec<f64> = (100..700).map(|tick| speed_mm_s(&all, tick)).collect();
    assert!(speeds.windows(2).all(|pair| pair[1] >= pair[0] - 0.01));
}

/// Full stops stay exact, whenever the raw path arrives within a tick.
#[test]
fn exact_stops_stay_exact_under_control() {
    for (kind, seed) in KINDS.into_iter().zip(0..) {
        let robot = robot(|config| {
            config.prefilter.kind = kind;
            config.corner_tolerance_mm = 0.0;
        });
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..10 {
            let orders: Orders = (0..8)
                .flat_map(|_| {
                    let tick = rng.random_range(0..6000);
                    let percent = rng.random_range(60..=200);
                    [
                        (tick, Order::Hold),
                        (tick + 1, rates(percent, 100)),
                        (tick + rng.random_range(2..400), Order::Resume),
                    ]
                })
                .chain([(7000, Order::Resume)])
                .collect();
            let all = setpoints(&robot, CORNER_PATH, &orders);
            let report = report(&robot, CORNER_PATH, &all);
            let context = format!("{kind:?}: {orders:?} {report:?}");
            assert!(report.max_path_deviation_mm < 1e-3, "{context}");
            let cut_mm = allowance_mm(kind, 320.0);
            assert!(report.max_corner_error_mm() <= cut_mm, "{context}");
            assert_eq!((report.drift_mm, report.drift_deg), (0.0, 0.0), "{context}");
        }
    }
}
