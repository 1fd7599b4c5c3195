//! Limits of velocity, acceleration and jerk hold at every tick, judged by the independent
//! checker; and nothing stalls because of them.

use host_tests::checker::limits::{Arm, Geometry, JointRow, Rates, rates};
use host_tests::judged_run::report;
use host_tests::random_program::{Shape, random_program};
use host_tests::software_loop::{Controller, ProgramError, plan, run};
use host_tests::trace::joints;
use planner_core::config::{Robot, RobotConfig};
use planner_core::hop::HopAxes;
use planner_core::kinematics::{ArmKind, JointRange};
use planner_core::limits::{Bound, LimitsConfig, MotionLimits, Part};
use planner_core::motion::{DelayLines, Order, Setpoint};
use planner_core::planner::Cause;
use planner_core::pose::JointUnit;
use planner_core::posture::{MapNode, ModeMapConfig, PostureMethod};
use planner_core::prefilter::Kind;
use planner_core::queue::SegmentQueue;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Random programs that an arm can reach.
fn shape_of(arm: ArmKind) -> Shape {
    match arm {
        ArmKind::Scara => Shape::default(),
        ArmKind::Delta => Shape::of_delta(),
    }
}

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

/// What a program holds that is resolved less well than lines are, in mm.
#[derive(Clone, Copy, Debug, Default)]
struct Longest {
    arc_mm: f64,
    /// Of hops, where nothing smooths an axis of them.
    hop_mm: f64,
}

impl Longest {
    fn arc(arc_mm: f64) -> Self {
        Self {
            arc_mm,
            ..Self::default()
        }
    }
}

fn rates_of(robot: &Robot, all: &[Setpoint], longest: Longest) -> Vec<Rates> {
    let rows: Vec<_> = all
        .iter()
        .map(|setpoint| JointRow {
            position: joints(setpoint),
            velocity: setpoint.joints.velocity.map(f64::from),
            acceleration: setpoint.joints.acceleration.map(f64::from),
        })
        .collect();
    let arm = Arm {
        geometry: Geometry::of(&robot.config),
        step_s: 1e-3,
        longest_arc_mm: longest.arc_mm,
        longest_hop_mm: longest.hop_mm,
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
fn used(robot: &Robot, all: &[Setpoint], longest: Longest) -> [[f64; 3]; 6] {
    let config = &robot.config.limits;
    let turn = 1_f64.to_radians();
    let mut used = [[0.0_f64; 3]; 6];
    for found in rates_of(robot, all, longest) {
        let parts = [0, 1, 2, 3].map(|joint| {
            let unit = match robot.arm.kind().joint_units()[joint] {
                JointUnit::Angle => turn,
                JointUnit::Length => 1.0,
            };
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
fn random_limits(rng: &mut ChaCha8Rng, kind: ArmKind) -> LimitsConfig {
    let mut config = LimitsConfig::default();
    let mut some = |from: f32, to: f32, often: f64| {
        if rng.random_bool(often) {
            (rng.random_range(from.ln()..to.ln())).exp()
        } else {
            0.0
        }
    };
    let turning = match kind {
        ArmKind::Scara => [0, 1, 3],
        ArmKind::Delta => [0, 1, 2],
    };
    for joint in turning {
        config.joints[joint] = MotionLimits {
            velocity: some(5.0, 80.0, 0.5),
            acceleration: some(20.0, 500.0, 0.5),
            jerk: some(300.0, 10_000.0, 0.4),
        };
    }
    let alone = match kind {
        ArmKind::Scara => 2,
        ArmKind::Delta => 3,
    };
    config.joints[alone] = MotionLimits {
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
    no_limit_is_passed_on(ArmKind::Scara, 0..70);
}

#[test]
fn no_limit_is_passed_on_random_delta_programs() {
    no_limit_is_passed_on(ArmKind::Delta, 0..60);
}

#[test]
#[ignore = "long; runs with --include-ignored"]
fn no_limit_is_passed_on_a_thousand_random_delta_programs() {
    no_limit_is_passed_on(ArmKind::Delta, 60..1060);
}

/// With a prefilter for a mode along X and one for a mode along Y or Z, limits give boxes to all
/// combinations that a move may have.
#[test]
fn no_limit_is_passed_where_prefilters_come_and_go_with_the_axes() {
    let mut binding = 0;
    for seed in 0..40_u64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let limits = random_limits(&mut rng, ArmKind::Scara);
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
        let used = used(&robot, &setpoints(&robot, &program), Longest::arc(1.0));
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
    no_limit_is_passed_on(ArmKind::Scara, 70..1070);
}

fn no_limit_is_passed_on(arm: ArmKind, seeds: std::ops::Range<u64>) {
    let mut binding = 0;
    let count = seeds.end - seeds.start;
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let kind = Kind::ALL[seed as usize % Kind::ALL.len()];
        let limits = random_limits(&mut rng, arm);
        let robot = robot(|config| {
            config.arm = arm;
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
                ..shape_of(arm)
            },
        );
        // a sweep of 6 rad around a centre half the longest length away
        let longest = Longest::arc(3.0 * longest_mm);
        let used = used(&robot, &setpoints(&robot, &program), longest);
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

fn assert_kept(robot: &Robot, all: &[Setpoint], longest: Longest, what: &str) {
    let used = used(robot, all, longest);
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
                Longest::arc(310.0),
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

/// A delta whose serial margin is what ends its workspace.
fn near_serial(change: impl FnOnce(&mut RobotConfig)) -> Robot {
    robot(|config| {
        config.arm = ArmKind::Delta;
        config.delta.arm_limits = JointRange::symmetric(170.0);
        config.delta.parallel_margin = 0.01;
        config.delta.serial_margin_deg = 8.0;
        config.set_all(MANY).expect("settings that exist");
        change(config);
    })
}

/// Paths of a delta up to its serial margin and back, along it, with a corner at it, and down to
/// where all its arms come to it.
fn near_serial_paths(robot: &Robot) -> Vec<String> {
    let furthest = |direction: [f64; 3]| {
        let at = |distance: f64| {
            let [x, y, z] = direction.map(|part| part * distance);
            [x, y, z - 720.0]
        };
        let holds = |distance: f64| {
            let [x, y, z] = at(distance).map(planner_core::units::LengthMm::from_num);
            let pose = planner_core::pose::Pose {
                x,
                y,
                z,
                ..Default::default()
            };
            robot.arm.check(&pose).is_ok()
        };
        let (mut inside, mut outside) = (0.0, 700.0);
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            if holds(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        at(inside - 0.05)
    };
    let words = |[x, y, z]: [f64; 3]| format!("X{x:.3} Y{y:.3} Z{z:.3}");
    let mut programs = Vec::new();
    for angle_deg in [-90.0_f64, 0.0, 17.0, 30.0, 90.0, 210.0] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let edge = furthest([cos, sin, 0.0]);
        let inside = [0.7 * edge[0], 0.7 * edge[1], -720.0];
        programs.push(format!(
            "G0 {}\nG1 {} F60000\nG1 {}\n",
            words(inside),
            words(edge),
            words(inside)
        ));
        let (sin, cos) = (angle_deg + 2.0).to_radians().sin_cos();
        let next = furthest([cos, sin, 0.0]);
        programs.push(format!(
            "G64 P2\nG0 {}\nG1 {} F60000\nG1 {}\nG1 {} C40\n",
            words([0.5 * next[0], 0.5 * next[1], -720.0]),
            words(edge),
            words([0.99 * next[0], 0.99 * next[1], -720.0]),
            words(inside)
        ));
    }
    let deepest = furthest([0.0, 0.0, -1.0]);
    programs.push(format!(
        "G0 X0 Y0 Z-800\nG1 {} F60000\nG1 Z-800\n",
        words(deepest)
    ));
    programs.push(format!(
        "G0 X50 Y0 Z-800\nG3 X50 Y0 Z-840 I-50 J0 F60000\nG1 {}\n",
        words(deepest)
    ));
    programs
}

#[test]
fn paths_of_a_delta_near_serial_poses_run_to_their_end() {
    for kind in [Kind::FirZvd, Kind::Fir, Kind::Zv] {
        let robot = near_serial(|config| config.prefilter.kind = kind);
        let programs = near_serial_paths(&robot);
        assert_eq!(programs.len(), 14);
        let mut near = 0;
        for (number, program) in programs.iter().enumerate() {
            let all = setpoints(&robot, program);
            let what = format!("path {number}, {kind:?}\n{program}");
            assert_kept(&robot, &all, Longest::arc(330.0), &what);
            assert!(all.len() < 200_000, "{what}: {} ms", all.len());
            let Geometry::Delta(delta) = Geometry::of(&robot.config) else {
                panic!("a delta");
            };
            let turns = all
                .iter()
                .flat_map(|setpoint| delta.turns_per_mm(joints(setpoint)));
            let sine = 1.0 / (delta.upper_arm_mm * turns.fold(0.0, f64::max));
            near += u32::from(sine < 8.5_f64.to_radians().sin());
        }
        // elsewhere the other singularity is what ends the way
        assert!(near >= 6, "only {near} come near");
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
    let along = "G0 X-100 Y-60 Z-720 C0\nG1 X120 Y80 Z-690 F60000\n";
    let rise = "G0 X0 Y0 Z-780 C0\nG1 Z-660 F60000\n";
    let whirl = "G0 X0 Y0 Z-720 C0\nG1 C180 F60000\n";
    let ring = "G0 X80 Y0 Z-720 C0\nG3 X80 Y0 I-80 J0 F60000\n";
    let of_delta = [along, rise, whirl, ring];
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
        (along, "joint2-velocity=30", 1, 0, 0.4),
        (along, "path-velocity=80", 4, 0, 0.99),
        (along, "joint2-acceleration=200", 1, 1, 0.4),
        (rise, "joint1-velocity=20", 0, 0, 0.6),
        (rise, "joint3-acceleration=100", 2, 1, 0.6),
        (rise, "joint2-jerk=1000", 1, 2, 0.3),
        (whirl, "joint4-velocity=50", 3, 0, 0.99),
        (whirl, "joint4-acceleration=300", 3, 1, 0.99),
        (ring, "joint1-velocity=30", 0, 0, 0.5),
        (ring, "joint1-acceleration=300", 0, 1, 0.35),
    ];
    for (program, limit, part, order, least) in cases {
        let robot = robot(|config| {
            config.prefilter.kind = Kind::Fir;
            if of_delta.contains(&program) {
                config.arm = ArmKind::Delta;
            }
            config.set_all(limit).expect("settings that exist");
        });
        let longest = Longest::arc(if program.contains("G3") { 505.0 } else { 0.0 });
        let used = used(&robot, &setpoints(&robot, program), longest);
        println!("{limit:28} {:.3}", used[part][order]);
        assert!(used[part][order] >= least, "{limit}: {used:?}");
        assert!(largest(&used) <= SPARE, "{limit}: {used:?}");
    }
}

/// Holds, resumes and overrides at random instants.
fn disturbed(robot: &Robot, program: &str, rng: &mut ChaCha8Rng) -> Vec<Setpoint> {
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut all = Vec::new();
    let mut next = 0;
    let mut held = false;
    let order = |tick: usize| {
        if tick < next {
            return None;
        }
        let longest = [20, 400, 3000][rng.random_range(0..3)];
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
        .run_with_orders(program, order, |setpoint| all.push(*setpoint))
        .expect("the program runs");
    all
}

/// Programs that also change the elbow.
#[test]
fn no_limit_is_passed_with_holds_and_overrides() {
    for seed in 0..36 {
        let arm = [ArmKind::Scara, ArmKind::Scara, ArmKind::Delta][seed as usize % 3];
        let kind = Kind::ALL[seed as usize % Kind::ALL.len()];
        let robot = robot(|config| {
            config.arm = arm;
            config.prefilter.kind = kind;
            config.set_all(MANY).expect("settings that exist");
        });
        let mut program = random_program(seed, shape_of(arm));
        if arm == ArmKind::Scara {
            program = program.replace("M2\n", "M101\nG1 X230 Y40\nM102\nG1 X200 Y0\nM2\n");
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let all = disturbed(&robot, &program, &mut rng);
        let what = format!("seed {seed}, {kind:?}\n{program}");
        assert_kept(&robot, &all, Longest::arc(450.0), &what);
    }
}

/// 20 Hz at X 100 and 8 Hz at X 330.
fn map() -> ModeMapConfig {
    let mut map = ModeMapConfig {
        x_mm: [100.0, 330.0],
        columns: 2,
        rows: 1,
        ..ModeMapConfig::NONE
    };
    map.nodes[0] = MapNode::new(20.0, 0.02);
    map.nodes[1] = MapNode::new(8.0, 0.02);
    map
}

/// Robots whose prefilter follows a map: by name, of pure shapers to which limits add boxes, of
/// two boxes, and chosen automatically.
fn following(nth: u64, config: &mut RobotConfig) {
    config.map = map();
    config.prefilter.kind = match nth % 8 {
        0 | 1 => Kind::FirZvd,
        2 => Kind::Zv,
        3 => Kind::None,
        4 => Kind::FirEi,
        _ => Kind::Fir,
    };
    match nth % 8 {
        5 => config.posture_method = PostureMethod::Hybrid,
        6 => config.posture_method = PostureMethod::Auto,
        7 => config.automatic = true,
        _ => {}
    }
}

#[test]
fn no_limit_is_passed_where_the_prefilter_follows_a_map() {
    no_limit_is_passed_with_a_map(0..16);
}

#[test]
#[ignore = "long: a hundred programs, each twice"]
fn no_limit_is_passed_on_a_hundred_programs_where_the_prefilter_follows_a_map() {
    no_limit_is_passed_with_a_map(16..116);
}

/// Each program as it is, and with holds and overrides.
fn no_limit_is_passed_with_a_map(seeds: std::ops::Range<u64>) {
    let mut binding = 0;
    let count = seeds.end - seeds.start;
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let limits = random_limits(&mut rng, ArmKind::Scara);
        let robot = robot(|config| {
            following(seed, config);
            config.limits = limits;
            // full stops, from which prefilters change, among corners that share one
            config.corner_tolerance_mm = [0.5, 0.0, 0.05][seed as usize % 3];
        });
        let longest_mm = [150.0, 20.0][usize::from(seed % 5 == 0)];
        let shape = Shape {
            smooth: if seed % 3 == 0 { 0.9 } else { 0.3 },
            longest_mm,
            ..Shape::default()
        };
        let program = random_program(seed, shape);
        let longest = Longest::arc(3.0 * longest_mm);
        let smooth = used(&robot, &setpoints(&robot, &program), longest);
        let all = disturbed(&robot, &program, &mut rng);
        let disturbed = used(&robot, &all, longest);
        for used in [&smooth, &disturbed] {
            assert!(
                largest(used) <= SPARE,
                "seed {seed}: {used:?}\n{limits:?}\n{program}"
            );
        }
        binding += u64::from(largest(&smooth) > 0.4);
    }
    assert!(binding * 10 > count * 9, "{binding} of {count}");
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
        let report = report(&robot, &program, &setpoints(&robot, &program));
        let report = report.expect("the checker reads it");
        let tolerance_mm = f64::from(robot.config.corner_tolerance_mm);
        assert!(
            report.max_path_deviation_mm <= tolerance_mm + 1e-3,
            "seed {seed}, {kind:?}: {} mm\n{program}",
            report.max_path_deviation_mm
        );
    }
}

/// A program of hops between random places.
fn random_hops(rng: &mut ChaCha8Rng, arm: ArmKind) -> String {
    let (x, y, z, rise) = match arm {
        ArmKind::Scara => (150.0..300.0, -120.0..120.0, -20.0..20.0, 45.0),
        ArmKind::Delta => (-260.0..260.0, -260.0..260.0, -820.0..-740.0, 110.0),
    };
    let mut program = String::new();
    for hop in 0..4 {
        let mut within = |range: &std::ops::Range<f64>| rng.random_range(range.clone());
        let (x, y, z) = (within(&x), within(&y), within(&z));
        let place = format!("X{x:.3} Y{y:.3} Z{z:.3} C{:.2}", within(&(-90.0..90.0)));
        let height = within(&(0.0..0.6)) * rise;
        let rise = height + within(&(0.01..0.4)) * rise;
        let tolerance = [0.05, 0.5, 3.0, 1000.0][rng.random_range(0..4)];
        program += &match hop {
            0 => format!("G0 {place}\n"),
            _ => format!("M103 {place} Q{height:.3} R{rise:.3} P{tolerance}\n"),
        };
    }
    program + "M2\n"
}

/// Hops of both robots with the prefilter on all choices of axes, also held and slowed down on
/// their way.
#[test]
fn no_limit_is_passed_on_random_hops() {
    no_limit_is_passed_on_hops(0..120);
}

#[test]
#[ignore = "long; runs with --include-ignored"]
fn no_limit_is_passed_on_a_thousand_programs_of_hops() {
    no_limit_is_passed_on_hops(120..1128);
}

fn no_limit_is_passed_on_hops(seeds: std::ops::Range<u64>) {
    let mut most = [0.0_f64; 3];
    let mut binding = [0; 2];
    // of each robot, undisturbed
    let count = (seeds.end - seeds.start) / 4;
    for seed in seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let arm = [ArmKind::Scara, ArmKind::Delta][seed as usize % 2];
        let axes = HopAxes::ALL[seed as usize / 2 % 3];
        let limits = random_limits(&mut rng, arm);
        let kind = Kind::ALL[rng.random_range(0..Kind::ALL.len())];
        let robot = robot(|config| {
            config.arm = arm;
            config.prefilter.kind = kind;
            config.prefilter.frequency_hz = rng.random_range(4.0..15.0);
            config.limits = limits;
            config.hop.axes = axes;
            config.hop.acceleration_mm_s2 = rng.random_range(500.0..20_000.0);
        });
        let program = random_hops(&mut rng, arm);
        let is_disturbed = seed / 6 % 2 == 1;
        let all = if is_disturbed {
            disturbed(&robot, &program, &mut rng)
        } else {
            setpoints(&robot, &program)
        };
        let longest = Longest {
            hop_mm: if axes == HopAxes::All { 0.0 } else { 800.0 },
            ..Longest::default()
        };
        let used = used(&robot, &all, longest);
        assert!(
            largest(&used) <= SPARE,
            "seed {seed}, {kind:?}, {axes:?}: {used:?}\n{limits:?}\n{program}"
        );
        if !is_disturbed {
            for order in 0..3 {
                most[order] = used
                    .iter()
                    .fold(most[order], |most, part| most.max(part[order]));
            }
            binding[seed as usize % 2] += u32::from(largest(&used) > 0.4);
        }
    }
    println!("at the most {most:.3?} of a limit; above 0.4 in {binding:?} of {count}");
    // jerks this low are mostly below what the raw path resolves
    assert!(most[0] > 0.95 && most[1] > 0.7, "{most:?}");
    assert!(
        binding
            .iter()
            .all(|above| u64::from(*above) * 3 > count * 2),
        "{binding:?}"
    );
}

/// How near a limit a hop comes where a limit alone holds it back.
#[test]
fn limits_are_used_by_hops() {
    let scara = "G0 X180 Y-100 Z0 C0\nM103 X200 Y110 Q10 R40 C-60\nM2\n";
    let delta = "G0 X-200 Y-100 Z-780 C0\nM103 X150 Y120 Q30 R60 C60\nM2\n";
    // program, axes with the prefilter, limit, its part and order, least use
    let cases = [
        (scara, HopAxes::None, "joint1-velocity=30", 0, 0, 0.6),
        (scara, HopAxes::None, "joint2-acceleration=200", 1, 1, 0.4),
        (scara, HopAxes::All, "joint3-velocity=50", 2, 0, 0.9),
        (scara, HopAxes::None, "joint3-acceleration=500", 2, 1, 0.85),
        (scara, HopAxes::None, "joint4-velocity=80", 3, 0, 0.4),
        (scara, HopAxes::None, "path-jerk=200000", 4, 2, 0.5),
        (scara, HopAxes::None, "axis-acceleration=700", 5, 1, 0.85),
        (delta, HopAxes::None, "joint1-velocity=30", 0, 0, 0.4),
        (delta, HopAxes::Across, "joint2-velocity=30", 1, 0, 0.4),
        (delta, HopAxes::None, "joint3-acceleration=200", 2, 1, 0.4),
        (delta, HopAxes::All, "joint4-velocity=80", 3, 0, 0.8),
        (delta, HopAxes::None, "path-velocity=200", 4, 0, 0.65),
        (delta, HopAxes::None, "path-jerk=200000", 4, 2, 0.5),
    ];
    for (program, axes, limit, part, order, least) in cases {
        let robot = robot(|config| {
            if program == delta {
                config.arm = ArmKind::Delta;
            }
            config.hop.axes = axes;
            config.hop.acceleration_mm_s2 = 20_000.0;
            config.set_all(limit).expect("settings that exist");
        });
        let longest = Longest {
            hop_mm: if axes == HopAxes::All { 0.0 } else { 450.0 },
            ..Longest::default()
        };
        let used = used(&robot, &setpoints(&robot, program), longest);
        println!("{limit:28} {:.3}", used[part][order]);
        assert!(used[part][order] >= least, "{limit}: {used:?}");
        assert!(largest(&used) <= SPARE, "{limit}: {used:?}");
    }
}

#[test]
fn a_hop_that_a_limit_slows_down_says_so() {
    const PROGRAM: &str = "G0 X200 Y0\nM103 X240 Y20 Z5\nM2";
    let hop = |limits: &str| {
        let robot = robot(|config| config.set_all(limits).expect("settings that exist"));
        let limited = plan(&robot, PROGRAM).expect("it hops").limited;
        let ticks = setpoints(&robot, PROGRAM).len();
        (limited, ticks)
    };
    let (limited, slow) = hop("joint1-velocity=10 path-velocity=1000");
    let [limited] = limited.as_slice() else {
        panic!("{limited:?}");
    };
    let expected = Bound {
        part: Part::Joint(1),
        order: planner_core::limits::Order::Velocity,
    };
    assert_eq!(limited.bound, expected);
    assert!(limited.takes_s > 1.2 * limited.asked_s);
    let (limited, quick) = hop("joint1-velocity=10000");
    assert_eq!(limited, []);
    let (limited, free) = hop("");
    assert_eq!((limited, quick), (vec![], free));
    assert!(slow > free);
    // so slow that it would take days
    let robot = robot(|config| config.set_all("joint1-velocity=1e-5").expect("settings"));
    let refused = run(&robot, PROGRAM, |_| {}).expect_err("it takes too long");
    let ProgramError::Line(error) = refused else {
        panic!("{refused}");
    };
    assert!(matches!(error.cause, Cause::TooSlow { .. }), "{error}");
}
