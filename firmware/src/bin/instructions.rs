//! Counts instructions on the emulated Cortex-M4F: a line `name instructions` for
//! each piece of code, then `end`.
//!
//! Inputs and results go through `black_box`, or the compiler does the work beforehand.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::hint::black_box;

use firmware::board::{self, Console, Counter, Stopwatch};
use planner_core::config::{Robot, RobotConfig};
use planner_core::corner::{self, CornerRule, Side};
use planner_core::gcode::{Defaults, Interpreter, Line};
use planner_core::identify::{Record, identify};
use planner_core::kinematics::ArmKind;
use planner_core::limits::MotionLimits;
use planner_core::motion::{DelayLines, Motion, MotionState, Order};
use planner_core::orientation::Orientation;
use planner_core::overlap::{Method, Move, Segment, SpeedCurve, ToolPose, ToolState, plan};
use planner_core::planner::Planner;
use planner_core::pose::{JointState, Pose};
use planner_core::posture::{MapNode, ModeMapConfig};
use planner_core::prefilter::{Kind, PrefilterConfig};
use planner_core::protocol::{Controller, Identity, Report, Settings, Step};
use planner_core::queue::SegmentQueue;
use static_cell::ConstStaticCell;

/// The corner path, arcs in a row with a helix and yaw, half-millimetre segments, and a circle in
/// fifths of a millimetre.
const PROGRAMS: [(&str, &str); 4] = [
    (
        "corner-path",
        include_str!("../../../host-tests/programs/corner-path.gcode"),
    ),
    (
        "arcs",
        include_str!("../../../host-tests/programs/arcs.gcode"),
    ),
    (
        "half-millimetres",
        include_str!("../../../host-tests/programs/half-millimetres.gcode"),
    ),
    (
        "fifth-millimetres",
        include_str!("../../../host-tests/programs/fifth-millimetres.gcode"),
    ),
];

#[cortex_m_rt::entry]
fn main() -> ! {
    static FILTERS: ConstStaticCell<DelayLines> = ConstStaticCell::new(DelayLines::new());
    let (counter, console) = board::start_measuring();
    let mut bench = Bench { counter, console };
    bench.measure("nothing", || ());
    for (name, rounds) in [("thousand-rounds", 1000), ("three-thousand-rounds", 3000)] {
        bench.measure(name, || {
            let mut round = 0_u32;
            while round < rounds {
                round = black_box(round + 1);
            }
        });
    }
    for (name, text) in [
        ("gcode/line", "G1 X123.456 Y78.901"),
        ("gcode/feed", "N10 G1 X123.4 Y7.8 F9600"),
        ("gcode/arc", "G2 X4 Y4 I-4 J7"),
    ] {
        let worst = bench.interpret(text);
        bench.print(format_args!("{name}"), worst);
    }
    let filters = FILTERS.take();
    programs(&mut bench, filters);
    programs_with_map(&mut bench, filters);
    deltas(&mut bench, filters);
    limits(&mut bench, filters);
    link(&mut bench, filters);
    corners(&mut bench);
    bench.overlap();
    identifications(&mut bench);
    bench.end()
}

// Each on its own, so that one robot at a time is on the stack.

#[inline(never)]
fn programs(bench: &mut Bench, filters: &mut DelayLines) {
    for (program, text) in PROGRAMS {
        for (filter, kind, frequency_hz) in [
            ("fir-zvd", Kind::FirZvd, 6.34),
            ("fir-zvd-0.1s", Kind::FirZvd, 20.0),
            ("fir-zvd-1s", Kind::FirZvd, 2.0),
            ("ei", Kind::Ei, 6.34),
            ("s-curve", Kind::SCurve, 6.34),
        ] {
            let cost = bench.run(&robot(kind, frequency_hz), text, filters, 100);
            bench.print(format_args!("tick/{program}/{filter}"), cost.tick);
            bench.print(format_args!("line/{program}/{filter}"), cost.line);
            bench.print(format_args!("line-mean/{program}/{filter}"), cost.line_mean);
        }
        for percent in [63, 137] {
            let cost = bench.run(&robot(Kind::FirZvd, 6.34), text, filters, percent);
            bench.print(format_args!("tick/{program}/at-{percent}"), cost.tick);
        }
    }
}

#[inline(never)]
fn deltas(bench: &mut Bench, filters: &mut DelayLines) {
    let delta = delta(Kind::FirZvd, 6.34);
    let worst = bench.run(&delta, DELTA_PROGRAM, filters, 100);
    bench.print(format_args!("tick/delta"), worst.tick);
    bench.print(format_args!("line/delta"), worst.line);
    for (filter, frequency_hz) in [("", 6.34), ("-0.1s", 20.0)] {
        let robot = self::delta(Kind::FirZvd, frequency_hz);
        let worst = bench.run(&robot, DELTA_ARCS, filters, 100);
        bench.print(format_args!("tick/delta-arcs{filter}"), worst.tick);
    }
    let worst = bench.run(&delta, DELTA_HOP, filters, 100);
    bench.print(format_args!("tick/delta-hop"), worst.tick);
    for (name, robot, pose) in [
        (
            "scara",
            &robot(Kind::FirZvd, 6.34),
            [250 << 19, 50 << 19, 0, 0],
        ),
        ("delta", &delta, [150 << 19, -70 << 19, -717 << 19, 0]),
    ] {
        let worst = bench.arm(robot, Pose::from_bits(pose));
        bench.print(format_args!("joint-state/{name}"), worst.joint_state);
        bench.print(format_args!("forward/{name}"), worst.forward);
    }
}

/// Lines and hops of both robots without limits of motion, and with some that bind.
#[inline(never)]
fn limits(bench: &mut Bench, filters: &mut DelayLines) {
    for (name, arm, program) in [
        ("scara-lines", ArmKind::Scara, SCARA_LINES),
        ("scara-arcs", ArmKind::Scara, SCARA_ARCS),
        ("delta-lines", ArmKind::Delta, DELTA_PROGRAM),
        ("delta-arcs", ArmKind::Delta, DELTA_ARCS),
        ("delta-hop", ArmKind::Delta, DELTA_HOP),
    ] {
        let mut config = RobotConfig {
            arm,
            ..config(Kind::FirZvd, 6.34)
        };
        for limits in ["free", "limited"] {
            let cost = bench.run(&robot_of(config), program, filters, 100);
            bench.print(format_args!("line/{name}/{limits}"), cost.line);
            for joint in &mut config.limits.joints[..3] {
                *joint = MotionLimits {
                    velocity: 60.0,
                    acceleration: 400.0,
                    jerk: 6000.0,
                };
            }
        }
    }
}

#[inline(never)]
fn programs_with_map(bench: &mut Bench, filters: &mut DelayLines) {
    for (program, text) in PROGRAMS {
        for (filter, kind) in [("fir-zvd", Kind::FirZvd), ("ei", Kind::Ei)] {
            let worst = bench.run(&robot_with_map(kind), text, filters, 100);
            bench.print(format_args!("tick/{program}/map-{filter}"), worst.tick);
            bench.print(format_args!("changing-line/{program}/{filter}"), worst.line);
        }
    }
}

#[inline(never)]
fn link(bench: &mut Bench, filters: &mut DelayLines) {
    let (_, half_millimetres) = PROGRAMS[2];
    let served = bench.serve(&robot(Kind::FirZvd, 6.34), half_millimetres, filters);
    bench.print(format_args!("link/line"), served.line_mean);
    bench.print(format_args!("link/status"), served.status);
}

#[inline(never)]
fn corners(bench: &mut Bench) {
    for kind in Kind::ALL {
        let worst = bench.corners(&robot(kind, 6.34));
        bench.print(format_args!("corner/{}", kind.name()), worst);
    }
}

#[inline(never)]
fn identifications(bench: &mut Bench) {
    for (name, samples) in [("identify/1s", 1000), ("identify/2s", 2000)] {
        let worst = bench.identify(samples);
        bench.print(format_args!("{name}"), worst);
    }
}

/// A mode of 9 Hz at the near end of the corner path and 15 Hz at its far end.
#[inline(never)]
fn robot_with_map(kind: Kind) -> Robot {
    let mut config = config(kind, 10.0);
    config.map = ModeMapConfig {
        x_mm: [180.0, 315.0],
        columns: 2,
        rows: 1,
        ..ModeMapConfig::NONE
    };
    config.map.nodes[0] = MapNode::new(9.0, 0.022);
    config.map.nodes[1] = MapNode::new(15.0, 0.022);
    defmt::unwrap!(Robot::new(&config).ok(), "the settings are within range")
}

#[inline(never)]
fn robot(kind: Kind, frequency_hz: f32) -> Robot {
    robot_of(config(kind, frequency_hz))
}

#[inline(never)]
fn delta(kind: Kind, frequency_hz: f32) -> Robot {
    robot_of(RobotConfig {
        arm: ArmKind::Delta,
        ..config(kind, frequency_hz)
    })
}

fn robot_of(config: RobotConfig) -> Robot {
    defmt::unwrap!(Robot::new(&config).ok(), "the settings are within range")
}

fn config(kind: Kind, frequency_hz: f32) -> RobotConfig {
    RobotConfig {
        prefilter: PrefilterConfig {
            kind,
            frequency_hz,
            damping: 0.022,
            ..PrefilterConfig::default()
        },
        ..RobotConfig::default()
    }
}

/// A pick and place of a delta.
const DELTA_PROGRAM: &str = include_str!("../../../host-tests/programs/delta-pick-and-place.gcode");

/// Arcs of a delta, two in flight all the time.
const DELTA_ARCS: &str = "G0 X0 Y0 Z-767\nF9600 G64 P0.5\nG2 X40 Y0 R22\nG3 X80 Y0 R22 Z-750\n\
    G2 X40 Y0 R22\nG3 X0 Y0 R22 Z-767\nM2\n";

/// Lines and arcs of a SCARA.
const SCARA_LINES: &str = "G0 X160 Y-110\nG1 X290 Y110 F9600\nX160\nX290 Y-110 Z10\nX160\nM2\n";
const SCARA_ARCS: &str =
    "G0 X200 Y0\nF9600\nG2 X240 Y0 R22\nG3 X280 Y0 R22 Z10\nG2 X240 Y0 R22\nM2\n";

/// A pick-and-place move of a delta.
const DELTA_HOP: &str = include_str!("../../../host-tests/programs/hop.gcode");

/// What the kinematics of a pose cost, in instructions.
struct ArmCost {
    joint_state: u32,
    forward: u32,
}

/// What a program costs, in instructions.
#[derive(Default)]
struct Cost {
    /// The dearest tick.
    tick: u32,
    /// The dearest line, from its text to the look-ahead.
    line: u32,
    /// The mean of the lines that add to the look-ahead.
    line_mean: u32,
}

/// What a link costs, in instructions.
#[derive(Default)]
struct Served {
    /// From a line's bytes to its `ok`, its way through the planner included: the mean.
    line_mean: u32,
    /// From a `?` to the report: the dearest.
    status: u32,
}

struct Bench {
    counter: Counter,
    console: Console,
}

impl Bench {
    /// Runs `code` once and prints its instructions, the call included.
    #[inline(never)]
    fn measure<R>(&mut self, name: &str, code: impl FnOnce() -> R) {
        let instructions = self.count(code);
        self.print(format_args!("{name}"), instructions);
    }

    #[inline(never)]
    fn count<R>(&self, code: impl FnOnce() -> R) -> u32 {
        let start = self.counter.now();
        let result = code();
        let instructions = self.counter.since(start);
        black_box(result);
        instructions
    }

    /// Ticks and lines of a program at a feed override.
    #[inline(never)]
    fn run(
        &self,
        robot: &Robot,
        program: &str,
        filters: &mut DelayLines,
        feed_percent: u16,
    ) -> Cost {
        let mut all = Cost::default();
        let (mut total, mut count) = (0, 0);
        let mut queue = SegmentQueue::new();
        let (producer, consumer) = queue.split();
        let mut planned = robot.clone();
        let mut planner = Planner::new(&mut planned, producer);
        let mut motion = Motion::new(robot, consumer, filters);
        motion.obey(Order::Rates {
            feed_percent,
            rapid_percent: 100,
        });
        let mut lines = program.lines();
        let mut more = true;
        loop {
            while more && planner.has_room() {
                let Some(line) = lines.next() else {
                    more = false;
                    break;
                };
                let mut accepted = None;
                let cost = self.count(|| accepted = planner.line(black_box(line).as_bytes()).ok());
                all.line = all.line.max(cost);
                let accepted = defmt::unwrap!(accepted, "the program is right");
                if accepted.queued {
                    total += cost;
                    count += 1;
                }
                if let Some(pose) = accepted.reference {
                    motion.obey(Order::Place(pose));
                }
                more = !accepted.ended;
            }
            motion.obey(Order::Start);
            let mut state = MotionState::Idle;
            let cost = self.count(|| state = motion.tick().state);
            all.tick = all.tick.max(cost);
            if state == MotionState::Idle && !more {
                all.line_mean = total / count;
                return all;
            }
        }
    }

    /// The kinematics at a pose.
    fn arm(&self, robot: &Robot, pose: Pose) -> ArmCost {
        let arm = black_box(&robot.arm);
        let (velocity, acceleration) = ([100.0, -200.0, 50.0, 10.0], [1e3, 2e3, -3e3, 50.0]);
        let mut state = JointState::default();
        let joint_state = self.count(|| {
            state = arm.joint_state(black_box(&pose), black_box(velocity), acceleration);
        });
        let joints = black_box(state.position);
        let forward = self.count(|| black_box(arm.forward(&joints)));
        ArmCost {
            joint_state,
            forward,
        }
    }

    /// Sends a program byte by byte through the controller, and asks for the status now and
    /// then.
    #[inline(never)]
    fn serve(&self, robot: &Robot, program: &str, filters: &mut DelayLines) -> Served {
        let mut queue = SegmentQueue::new();
        let (producer, consumer) = queue.split();
        let identity = Identity {
            board: "",
            cost_unit: "",
            blocks: 0,
            stack_use: || (0, 0),
        };
        let mut planned = robot.clone();
        let mut planner = Planner::new(&mut planned, producer);
        let mut controller = Controller::new(&mut planner, Settings::default(), identity);
        let mut motion = Motion::new(robot, consumer, filters);
        let mut report = Report::default();
        let mut served = Served::default();
        let (mut total, mut lines, mut now_ms) = (0, 0, 0);
        for line in program.lines() {
            total += self.count(|| {
                let bytes = black_box(line).bytes().chain([b'\n']);
                bytes.for_each(|byte| controller.receive(byte, now_ms));
            });
            let mut is_answered = false;
            while !is_answered {
                let mut step = Step::Wait(None);
                let cost = self.count(|| step = controller.step(now_ms, &report));
                // Waiting for room takes no time from anything.
                if !matches!(step, Step::Wait(_)) {
                    total += cost;
                }
                match step {
                    Step::Say(text) => is_answered = text.as_bytes().starts_with(b"ok"),
                    Step::Order(order) => {
                        motion.obey(order);
                        report.orders = report.orders.wrapping_add(1);
                    }
                    Step::Wait(_) => {
                        now_ms += 1;
                        report.setpoint = motion.tick();
                        report.health.ticks += 1;
                    }
                    Step::Robot
                    | Step::Keep(_)
                    | Step::ForgetRecords
                    | Step::Listen(_)
                    | Step::Identify => {}
                }
            }
            lines += 1;
            let mut step = Step::Wait(None);
            let cost = self.count(|| {
                controller.receive(black_box(b'?'), now_ms);
                step = controller.step(now_ms, &report);
            });
            defmt::assert!(matches!(step, Step::Say(_)), "a report");
            served.status = served.status.max(cost);
        }
        served.line_mean = total / lines;
        served
    }

    /// From the text of a line to its command, without the planner.
    fn interpret(&self, text: &str) -> u32 {
        let mut interpreter = Interpreter::new(Defaults::default());
        let mut execute = |text: &str| {
            let line = Line::parse(black_box(text).as_bytes())?;
            let interpreted = interpreter.interpret(&line)?;
            interpreter.commit(&interpreted);
            black_box(&interpreted.command);
            Ok::<_, planner_core::gcode::Error>(())
        };
        defmt::assert!(execute("G0 X10 Y10").is_ok());
        defmt::assert!(execute("G1 X1 Y1 F600").is_ok());
        let mut is_right = false;
        let cost = self.count(|| is_right = execute(text).is_ok());
        defmt::assert!(is_right, "the line is right");
        cost
    }

    /// A corner of a tool that moves and turns: its plan, the dearest instant of it, and what the
    /// bits of all instants come to.
    fn overlap(&mut self) {
        let pose = |x: f64, y: f64, angle_deg: f64| ToolPose {
            position_mm: [x, y, 0.0],
            orientation: Orientation::new(angle_deg, 20.0, -angle_deg),
        };
        let points = black_box([
            pose(0.0, 0.0, 10.0),
            pose(50.0, 0.0, 30.0),
            pose(50.0, 50.0, -15.0),
        ]);
        let mut segments = [None, None];
        let cost = self.count(|| {
            for (segment, pair) in segments.iter_mut().zip(points.windows(2)) {
                *segment = Segment::new(&pair[0], &pair[1], 150.0, 500.0).ok();
            }
        });
        self.print(format_args!("overlap/segment"), cost / 2);
        let [Some(first), Some(second)] = segments else {
            return;
        };
        let Ok(curve) = SpeedCurve::s_curve(0.125) else {
            return;
        };
        let rule = CornerRule::ToleranceMm(1.0);
        for (name, method) in [
            ("closed-form", Method::ClosedForm),
            ("exact", Method::Exact),
        ] {
            let mut moves = [Move::new(first, rule), Move::new(second, rule)];
            let cost = self.count(|| plan(curve, method, black_box(&mut moves)).cycle_s());
            self.print(format_args!("overlap/corner-{name}"), cost);
        }
        let mut moves = [Move::new(first, rule), Move::new(second, rule)];
        let plan = plan(curve, Method::ClosedForm, &mut moves);
        let mut cost = 0;
        let mut bits = 0;
        for k in 0..100 {
            let t = plan.cycle_s() * f64::from(k) / 100.0;
            let mut state = ToolState::default();
            cost = cost.max(self.count(|| state = plan.at(black_box(t))));
            let orientation = state.pose.orientation;
            for value in [
                state.pose.position_mm[1],
                state.acceleration_mm_s2[0],
                orientation.a_deg,
                orientation.b_deg,
                orientation.c_deg,
                state.euler_rates.a_deg_s,
            ] {
                let value = value.to_bits();
                bits = (bits ^ value as u32 ^ (value >> 32) as u32).rotate_left(5);
            }
        }
        self.print(format_args!("overlap/instant"), cost);
        self.print(format_args!("overlap/bits"), bits);
    }

    /// The dearest record of so many samples, over frequencies, dampings and noise; nothing of
    /// it is taken before the last sample has come.
    fn identify(&self, samples: u16) -> u32 {
        let mut worst = 0;
        let mut noise = 1_u32;
        for step in 0..24_u16 {
            let frequency_hz = 2.0 + 1.6 * f32::from(step);
            let damping = [0.0005, 0.005, 0.02, 0.08][usize::from(step % 4)];
            let share = [0.0, 0.3, 0.1][usize::from(step % 3)];
            let mut record = Record::new();
            for at in 0..samples {
                let time_s = f32::from(at) * 0.001;
                let swing = |frequency_hz: f32, damping: f32| {
                    let turns = frequency_hz * time_s;
                    let turns = turns - turns as u32 as f32;
                    let (_, cos) = planner_core::math::sin_cos_f32(turns * core::f32::consts::TAU);
                    // e^-x, well enough for a decay
                    let x = core::f32::consts::TAU * damping * frequency_hz * time_s / 64.0;
                    let mut decay = 1.0 / (1.0 + x + 0.5 * x * x);
                    for _ in 0..6 {
                        decay *= decay;
                    }
                    decay * cos
                };
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = (noise >> 16) as f32 / 65_536.0 - 0.5;
                let value = swing(frequency_hz, damping) + share * swing(1.7 * frequency_hz, 0.01);
                record.push(1000.0 * (0.5 + value + 0.2 * noise));
            }
            let mut is_found = false;
            let cost = self.count(|| is_found = identify(black_box(&mut record)).is_ok());
            defmt::assert!(is_found, "a mode stands out");
            worst = worst.max(cost);
        }
        worst
    }

    /// The dearest corner over angles, feedrates, tolerances, lines and arcs.
    fn corners(&self, robot: &Robot) -> u32 {
        let mut worst = 0;
        for step in 0..200_u16 {
            // 0 to 180° and a spread of the rest that repeats with different periods
            let (sin, cos) = planner_core::math::sin_cos_f32(f32::from(step) * 0.0157);
            let heading_rate_per_mm = [0.0, 0.022, -0.1, 1.0][usize::from(step % 4)];
            let side = |tangent, feed_mm_s| Side {
                feed_mm_s,
                tangent,
                heading_rate_per_mm,
                length_mm: [100.0, 3.0, 0.2][usize::from(step % 3)],
            };
            let arriving = side(
                [1.0, 0.0, 0.0],
                [160.0, 20.0, 500.0][usize::from(step / 2 % 3)],
            );
            let leaving = side([cos, sin, 0.0], [160.0, 90.0][usize::from(step / 3 % 2)]);
            let tolerance_mm = [0.5, 0.05, 2.0, 0.01, 0.2][usize::from(step % 5)];
            let cost = self.count(|| {
                corner::solve(
                    black_box(&arriving),
                    black_box(&leaving),
                    &robot.decelerating,
                    &robot.accelerating,
                    tolerance_mm,
                )
            });
            worst = worst.max(cost);
        }
        worst
    }

    fn print(&mut self, name: core::fmt::Arguments<'_>, instructions: u32) {
        // The console cannot fail.
        let _ = writeln!(self.console, "{name} {instructions}");
    }

    fn end(&mut self) -> ! {
        let _ = writeln!(self.console, "end");
        loop {
            cortex_m::asm::wfi();
        }
    }
}
