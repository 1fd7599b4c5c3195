//! Limits of velocity, acceleration and jerk hold at every tick, judged by the independent
//! checker; and nothing stalls because of them.

use host_tests::checker::limits::{Arm, JointRow, Rates, rates};
use host_tests::checker::{CheckOptions, Program, TraceRow, check};
use host_tests::random_program::{Shape, random_program};
use host_tests::software_loop::{Controller, ProgramError, run};
use host_tests::trace::{joints, pose};
use planner_core::config::{Robot, RobotConfig};
use planner_core::hop::HopError;
use planner_core::kinematics::JointRange;
use planner_core::limits::{LimitsConfig, MotionLimits};
use planner_core::motion::{DelayLines, Order, Setpoint};
use planner_core::planner::Cause;
use planner_core::prefilter::Kind;
use planner_core::queue::SegmentQueue;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// By how much a limit may be passed.
const SPARE: f64 = 1.001;

fn robot(change: impl FnOnce(&mut RobotConfig)) -> Robot {
    let mut config = RobotConfig::default();
    change(&mut config);
    Robot::new(&config).expect("the settings are within range")
}

fn setpoints(robot: &Robot, program: &str) -> Vec<Setpoint> {
    let mut all = Vec::new();
    run(robot, program, |setpoint| all.push(*setpoint)).expect("the program runs");
    all
}

fn rates_of(robot: &Robot, all: &[Setpoint], longest_arc_mm: f64) -> Vec<Rates> {
    let rows: Vec<_> = all
        .iter()
        .map(|setpoint| JointRow {
            position: joints(setpoint),
            velocity: setpoint.joints.velocity.map(f64::from),
            acceleration: setpoint.joints.acceleration.map(f64::from),
        })
        .collect();
    let arm = Arm {
        link1_mm: robot.config.scara.link1_mm.into(),
        link2_mm: robot.config.scara.link2_mm.into(),
        step_s: 1e-3,
        longest_arc_mm,
    };
    rates(&rows, &arm)
}

/// Limits in rad and mm; infinite where there is none.
fn highest(limits: &MotionLimits, unit: f64) -> [f64; 3] {
    [limits.velocity, limits.acceleration, limits.jerk].map(|limit| {
        if limit > 0.0 {
            f64::from(limit) * unit
        } else {
            f64::INFINITY
        }
    })
}

/// The largest part of each limit that is used: joints 1 to 4, path and axis, of each velocity,
/// acceleration and jerk. A jerk counts less what the resolution may have added.
fn used(robot: &Robot, all: &[Setpoint], longest_arc_mm: f64) -> [[f64; 3]; 6] {
    let config = &robot.config.limits;
    let turn = 1_f64.to_radians();
    let mut used = [[0.0_f64; 3]; 6];
    for found in rates_of(robot, all, longest_arc_mm) {
        let parts = [0, 1, 2, 3].map(|joint| {
            let unit = if joint == 2 { 1.0 } else { turn };
            let limits = highest(&config.joints[joint], unit);
            (found.joints[joint], found.joints_noise[joint], limits)
        });
        let tool = [
            (found.path, found.path_noise, highest(&config.path, 1.0)),
            (found.axis, found.path_noise, highest(&config.axis, 1.0)),
        ];
        for (part, (values, noise, limits)) in parts.into_iter().chain(tool).enumerate() {
            let [velocity, acceleration, jerk] = values;
            let values = [velocity, acceleration, (jerk - noise).max(0.0)];
            for order in 0..3 {
                used[part][order] = used[part][order].max(values[order] / limits[order]);
            }
        }
    }
    used
}

fn largest(used: &[[f64; 3]; 6]) -> f64 {
    used.iter().flatten().copied().fold(0.0, f64::max)
}

/// A random choice of limits that bind at the feeds of random programs.
fn random_limits(rng: &mut ChaCha8Rng) -> LimitsConfig {
    let mut config = LimitsConfig::default();
    let mut some = |from: f32, to: f32, often: f64| {
        if rng.random_bool(often) {
            (rng.random_range(from.ln()..to.ln())).exp()
        } else {
            0.0
        }
    };
    for joint in [0, 1, 3] {
        config.joints[joint] = MotionLimits {
            velocity: some(5.0, 80.0, 0.5),
            acceleration: some(20.0, 500.0, 0.5),
            jerk: some(300.0, 10_000.0, 0.4),
        };
    }
    config.joints[2] = MotionLimits {
        velocity: some(2.0, 50.0, 0.4),
        acceleration: some(20.0, 500.0, 0.4),
        jerk: some(300.0, 10_000.0, 0.3),
    };
    config.path = MotionLimits {
        velocity: some(10.0, 200.0, 0.3),
        acceleration: some(50.0, 1000.0, 0.3),
        jerk: some(500.0, 20_000.0, 0.2),
    };
    config.axis = MotionLimits {
        velocity: some(10.0, 200.0, 0.3),
        acceleration: some(50.0, 1000.0, 0.3),
        jerk: some(500.0, 20_000.0, 0.2),
    };
    config
}

#[test]
fn no_limit_is_passed_on_random_programs() {
    no_limit_is_passed_on(0..70);
}

/// With a prefilter for a mode along X and one for a mode along Y or Z, limits give boxes to all
/// combinations that a move may have.
#[test]
fn no_limit_is_passed_where_prefilters_come_and_go_with_the_axes() {
    let mut binding = 0;
    for seed in 0..40_u64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let limits = random_limits(&mut rng);
        let kinds = [
            ["fir-zv", "zv", "none", "s-curve", "ei"][seed as usize % 5],
            ["zv", "fir", "none", "fir-zv", "zvd"][seed as usize / 4 % 5],
        ];
        let robot = robot(|config| {
            let [first, second] = kinds;
            let axes2 = if seed % 2 == 0 { "y" } else { "yz" };
            config
                .set_all(&format!(
                    "prefilter={first} frequency=7 axes=x prefilter2={second} frequency2=11 axes2={axes2}"
                ))
                .expect("settings that exist");
            config.limits = limits;
        });
        let mut program = String::from("G0 X200 Y0 Z0\n");
        let mut at = [200.0, 0.0, 0.0];
        for _ in 0..30 {
            let axis = rng.random_range(0..4);
            let way: f64 = rng.random_range(-60.0..60.0);
            for (place, value) in at.iter_mut().enumerate() {
                if axis == place || axis == 3 {
                    let low = [160.0, -80.0, -40.0][place];
                    let high = [280.0, 80.0, 40.0][place];
                    *value = (*value + way).clamp(low, high);
                }
            }
            let [x, y, z] = at;
            let feed = rng.random_range(600.0..20_000.0);
            program += &format!("G1 X{x:.3} Y{y:.3} Z{z:.3} F{feed:.0}\n");
            if rng.random_bool(0.3) {
                program += "G4 P0.01\n";
            }
        }
        let used = used(&robot, &setpoints(&robot, &program), 1.0);
        assert!(
            largest(&used) <= SPARE,
            "seed {seed}, {kinds:?}: {used:?}\n{limits:?}\n{program}"
        );
        binding += u32::from(largest(&used) > 0.5);
    }
    assert!(binding > 20, "{binding}");
}

#[test]
#[ignore = "long; runs with --include-ignored"]
fn no_limit_is_passed_on_a_thousand_random_programs() {
    no_limit_is_passed_on(70..1070);
}

fn no_limit_is_passed_on(seeds: std::ops::Range<u64>) {
    let mut binding = 0;
    let count = seeds.end - seeds.start;
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let kind = Kind::ALL[seed as usize % Kind::ALL.len()];
        let limits = random_limits(&mut rng);
        let robot = robot(|config| {
            config.prefilter.kind = kind;
            config.prefilter.frequency_hz = 4.0 + (seed % 11) as f32;
            config.limits = limits;
        });
        let longest_mm = if seed % 2 == 0 { 3.0 } else { 150.0 };
        let program = random_program(
            seed,
            Shape {
                smooth: if seed % 3 == 0 { 0.9 } else { 0.3 },
                longest_mm,
                ..Shape::default()
            },
        );
        // a sweep of 6 rad around a centre half the longest length away
        let used = used(&robot, &setpoints(&robot, &program), 3.0 * longest_mm);
        assert!(
            largest(&used) <= SPARE,
            "seed {seed}, {kind:?}: {used:?}\n{limits:?}\n{program}"
        );
        binding += u32::from(largest(&used) > 0.5);
    }
    assert!(u64::from(binding) * 2 > count, "{binding} of {count}");
}

fn with_limits(kind: Kind, limits: &str) -> Robot {
    robot(|config| {
        config.prefilter.kind = kind;
        config.set_all(limits).expect("settings that exist");
    })
}

/// All limits at once, as a small robot has them.
const MANY: &str = "joint1-velocity=90 joint1-acceleration=600 joint1-jerk=9000 \
    joint2-velocity=120 joint2-acceleration=800 joint2-jerk=12000 \
    joint3-velocity=100 joint3-acceleration=1500 joint3-jerk=40000 \
    joint4-velocity=200 joint4-acceleration=2000 joint4-jerk=30000 \
    path-velocity=150 path-acceleration=1200 path-jerk=30000 \
    axis-velocity=140 axis-acceleration=1000 axis-jerk=20000";

fn assert_kept(robot: &Robot, all: &[Setpoint], longest_arc_mm: f64, what: &str) {
    let used = used(robot, all, longest_arc_mm);
    assert!(largest(&used) <= SPARE, "{what}: {used:?}");
}

/// Paths close to where the default arm is folded (52.23 mm) and stretched (349.67 mm):
/// radially up to there and back, along the circle, past it, and away from it.
fn near_singular_paths() -> Vec<String> {
    let mut programs = Vec::new();
    for (radius, other) in [(52.3_f64, 90.0_f64), (349.6, 310.0)] {
        let at = |radius: f64, angle_deg: f64| {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            format!("X{:.4} Y{:.4}", radius * cos, radius * sin)
        };
        let begin = |angle_deg: f64| format!("G0 {}\n", at(other, angle_deg));
        for angle_deg in [-40.0, 0.0, 75.0] {
            // radially up to the margin and back
            programs.push(format!(
                "{}G1 {} F60000\n{}\n",
                begin(angle_deg),
                at(radius, angle_deg),
                at(other, angle_deg)
            ));
            // along the circle of the margin
            programs.push(format!(
                "{}G1 {} F60000\nG3 {} R{radius}\nG1 {}\n",
                begin(angle_deg),
                at(radius, angle_deg),
                at(radius, angle_deg + 50.0),
                at(other, angle_deg + 50.0),
            ));
        }
        // along chords of the circle, short and long
        for turn_deg in [0.5, 8.0] {
            let mut program = begin(0.0);
            for step in 0..8 {
                let inner = if radius < 100.0 {
                    radius / (turn_deg / 2.0_f64).to_radians().cos()
                } else {
                    radius
                };
                program += &format!("G1 {} F60000\n", at(inner, turn_deg * f64::from(step)));
            }
            programs.push(program);
        }
        // past it in one line, with a turn of the yaw
        let far = if radius < 100.0 {
            (radius * radius + 120.0 * 120.0).sqrt()
        } else {
            radius
        };
        let aside_deg = if radius < 100.0 {
            (120.0 / radius).atan().to_degrees()
        } else {
            30.0
        };
        programs.push(format!(
            "G0 {}\nG1 {} F60000\nG1 {} C90\n",
            at(far, -aside_deg),
            at(far, aside_deg),
            at(far, -aside_deg),
        ));
        // a corner with its tip at the margin
        programs.push(format!(
            "G64 P2\nG0 {}\nG1 {} F60000\nG1 {}\n",
            at(other, -20.0),
            at(radius, 0.0),
            at(other, 20.0),
        ));
    }
    programs
}

#[test]
fn twenty_paths_near_singular_poses_run_to_their_end() {
    let programs = near_singular_paths();
    assert_eq!(programs.len(), 20);
    for (number, program) in programs.iter().enumerate() {
        for kind in [Kind::FirZvd, Kind::Fir, Kind::Zv] {
            let robot = robot(|config| {
                config.prefilter.kind = kind;
                // so that the singularity margin is what stops the arm from folding
                config.scara.joint_limits[1] = JointRange::symmetric(175.0);
                config.set_all(MANY).expect("settings that exist");
            });
            let all = setpoints(&robot, program);
            assert_kept(
                &robot,
                &all,
                310.0,
                &format!("path {number}, {kind:?}\n{program}"),
            );
            // the last word pair of the program is where it ends
            let last = program.lines().last().expect("lines");
            let end: Vec<f64> = last
                .split_whitespace()
                .filter_map(|word| word.strip_prefix(['X', 'Y']))
                .filter_map(|number| number.parse().ok())
                .collect();
            let pose = all.last().expect("setpoints").pose;
            assert!(
                (pose.x.to_num::<f64>() - end[0]).abs() < 1e-5,
                "path {number}"
            );
            assert!(
                (pose.y.to_num::<f64>() - end[1]).abs() < 1e-5,
                "path {number}"
            );
            // some 300 mm, and 700 mm along the margin, in minutes: it does not creep
            assert!(
                all.len() < 200_000,
                "path {number}, {kind:?}: {} ms",
                all.len()
            );
        }
    }
}

#[test]
fn limits_that_do_not_bind_change_no_bit() {
    let high = "joint1-velocity=1e5 joint2-velocity=1e5 path-velocity=1e5 \
        joint1-acceleration=1e7 joint2-acceleration=1e7 joint4-acceleration=1e7 \
        axis-acceleration=1e7";
    for seed in 0..12 {
        let kind = [Kind::Fir, Kind::FirZv, Kind::FirZvd][seed as usize % 3];
        let program = random_program(
            seed,
            Shape {
                // tinier arcs are limited all the same: at their feeds they turn within a tick
                shortest_mm: 2.0,
                ..Shape::default()
            },
        );
        // at 1 m/s the tool may be anywhere 80 mm around, where the arm is stretched too
        let free = setpoints(&with_limits(kind, "feed-limit=200"), &program);
        let limited = setpoints(
            &with_limits(kind, &format!("feed-limit=200 {high}")),
            &program,
        );
        assert!(free == limited, "seed {seed}, {kind:?}");
    }
}

/// How near a limit the motion comes where a limit alone holds it back.
#[test]
fn limits_are_used() {
    let line = "G0 X180 Y-60 Z0 C0\nG1 X280 Y60 F60000\n";
    let lift = "G0 X200 Y0 Z-50 C0\nG1 Z50 F60000\n";
    let turn = "G0 X200 Y0 Z0 C0\nG1 C180 F60000\n";
    let circle = "G0 X250 Y0 Z0 C0\nG3 X250 Y0 I-50 J0 F60000\n";
    // program, limit, its part and order, least use: a jerk keeps half in reserve for what a
    // hold and a resume within the boxes' length can do
    let cases = [
        (line, "joint1-velocity=30", 0, 0, 0.6),
        (line, "joint2-velocity=30", 1, 0, 0.6),
        (line, "path-velocity=80", 4, 0, 0.99),
        (line, "path-acceleration=300", 4, 1, 0.99),
        (line, "axis-acceleration=300", 5, 1, 0.99),
        (line, "joint2-acceleration=80", 1, 1, 0.6),
        (line, "path-jerk=3000", 4, 2, 0.47),
        (lift, "joint3-velocity=40", 2, 0, 0.99),
        (lift, "joint3-acceleration=200", 2, 1, 0.99),
        (lift, "joint3-jerk=2000", 2, 2, 0.47),
        (turn, "joint4-velocity=50", 3, 0, 0.99),
        (turn, "joint4-acceleration=300", 3, 1, 0.99),
        (circle, "path-acceleration=500", 4, 1, 0.6),
    ];
    for (program, limit, part, order, least) in cases {
        let robot = with_limits(Kind::Fir, limit);
        let longest_arc_mm = if program.contains("G3") { 315.0 } else { 0.0 };
        let used = used(&robot, &setpoints(&robot, program), longest_arc_mm);
        println!("{limit:28} {:.3}", used[part][order]);
        assert!(used[part][order] >= least, "{limit}: {used:?}");
        assert!(largest(&used) <= SPARE, "{limit}: {used:?}");
    }
}

/// Holds, resumes and overrides at random instants, of programs that also change the elbow.
#[test]
fn no_limit_is_passed_with_holds_and_overrides() {
    for seed in 0..24 {
        let kind = Kind::ALL[seed as usize % Kind::ALL.len()];
        let robot = with_limits(kind, MANY);
        let mut program = random_program(seed, Shape::default());
        program = program.replace("M2\n", "M101\nG1 X230 Y40\nM102\nG1 X200 Y0\nM2\n");
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut queue = SegmentQueue::new();
        let mut filters = Box::new(DelayLines::new());
        let mut all = Vec::new();
        let mut next = 0;
        let mut held = false;
        let order = |tick: usize| {
            if tick < next {
                return None;
            }
            let longest = [20, 400][rng.random_range(0..2)];
            next = tick + rng.random_range(1..longest);
            if held {
                held = false;
                return Some(Order::Resume);
            }
            if rng.random_bool(0.5) {
                held = true;
                return Some(Order::Hold);
            }
            Some(Order::Rates {
                feed_percent: rng.random_range(10..=200),
                rapid_percent: [25, 50, 100][rng.random_range(0..3)],
            })
        };
        Controller::new(&mut robot.clone(), &mut queue, &mut filters)
            .run_with_orders(&program, order, |setpoint| all.push(*setpoint))
            .expect("the program runs");
        assert_kept(
            &robot,
            &all,
            450.0,
            &format!("seed {seed}, {kind:?}\n{program}"),
        );
    }
}

#[test]
fn the_tolerance_holds_with_limits_too() {
    for seed in 0..40 {
        let kind = [Kind::Fir, Kind::FirZv, Kind::FirZvd, Kind::Zv][seed as usize % 4];
        let robot = with_limits(kind, MANY);
        let shape = Shape {
            tolerances: false,
            smooth: if seed % 3 == 0 { 0.9 } else { 0.3 },
            ..Shape::default()
        };
        let program = random_program(seed, shape);
        let rows: Vec<_> = setpoints(&robot, &program)
            .iter()
            .zip(0_u32..)
            .map(|(setpoint, tick)| TraceRow {
                time_s: f64::from(tick) * 1e-3,
                pose: pose(setpoint),
            })
            .collect();
        let options = CheckOptions {
            rapid_mm_s: 160.0,
            tolerance_mm: robot.config.corner_tolerance_mm.into(),
            ..CheckOptions::default()
        };
        let parsed = Program::parse(&program).expect("the checker reads it");
        let report = check(&parsed, &rows, &options);
        assert!(
            report.max_path_deviation_mm <= options.tolerance_mm + 1e-3,
            "seed {seed}, {kind:?}: {} mm\n{program}",
            report.max_path_deviation_mm
        );
    }
}

#[test]
fn a_hop_is_refused_where_limits_are_set() {
    const PROGRAM: &str = "G0 X200 Y0\nM103 X240 Y20 Z5\nM2";
    let hop = |limits: &str| {
        let robot = robot(|config| config.set_all(limits).expect("settings that exist"));
        run(&robot, PROGRAM, |_| {})
    };
    let refused = hop("joint1-velocity=90").expect_err("a hop keeps no limits");
    let ProgramError::Line(error) = refused else {
        panic!("{refused}");
    };
    assert_eq!(
        (error.line, error.cause),
        (2, Cause::Hop(HopError::Limited))
    );
    hop("").expect("without limits it hops");
}
