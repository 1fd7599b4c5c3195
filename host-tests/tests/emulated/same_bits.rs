//! The firmware's setpoints are the software loop's, in every bit of every tick.
//!
//! The software loop records from the first tick of the motion, which is at rest, to the
//! first one that found everything at rest again; [`EmulatorRun`] has exactly these ticks
//! of the firmware. So the two are compared as they are, tick by tick, and their numbers
//! must agree too.
//!
//! A program whose moves all fit into the queue is planned before it begins, and virtual
//! time may run as fast as it can; a longer one is streamed in real time.

use std::fmt;
use std::time::Instant;

use crate::support::emulator;
use host_tests::emulator::{Emulator, EmulatorRun, Pace};
use host_tests::machine::settings;
use host_tests::random_program::{Shape, random_program};
use host_tests::software_loop::{self, Controller};
use planner_core::config::{Robot, RobotConfig};
use planner_core::hop::HopAxes;
use planner_core::kinematics::{ArmKind, Elbow};
use planner_core::motion::{DelayLines, MotionState, Setpoint};
use planner_core::pose::Joint3;
use planner_core::posture::{MapNode, ModeMapConfig, PostureMethod};
use planner_core::prefilter::Kind;
use planner_core::queue::{LOOKAHEAD, SegmentQueue};
use planner_core::units::{AngleDeg, AngleRad, LengthMm};

const CORNER_PATH: &str = include_str!("../../programs/corner-path.gcode");

/// How often a program is sent that the PC was too busy to send in time.
const ATTEMPTS: u32 = 5;

/// Everything that a program can say about motion, on the default robot.
const EVERY_WORD: &str = "\
G21 G90 G17 G94
G0 X250 Y0 Z5 C10
G1 X260 Y20 F6000 (a line)
G1 C-80.5 (yaw alone)
G1 Z-12.25 (the quill alone)
G2 X240 Y20 I-10 J0 Z-2 (a helix)
G2 X240 Y20 I-15 J5 C45 (a full circle that turns)
G3 X230 Y40 R25 F12000
G91
G1 X-10.0001 Y-7.0003
X3.3333 Y3.3333
X-3.3333 Y-3.3333
G90 G61
G1 X250 Y-60 F9000
G4 P0.1234
G64 P0.05
X200 Y-80.5
G64 Q60 (a given overlap)
X210 Y-70
X220 Y-80
G64 Q100
X230 Y-70
G3 X240 Y-60 R10
X230 Y-50 R10
M0
G64
G20 G1 X9.5 Y-1 F300
G3 X9.5 Y1 I0.1 J1 C-10
G21
G0 X300 Y0 Z0 C0
M2
";

/// Where two recordings differ first.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Difference {
    Bits {
        tick: usize,
        field: &'static str,
        host: u32,
        board: u32,
    },
    Length {
        host: usize,
        board: usize,
    },
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Bits {
                tick,
                field,
                host,
                board,
            } => write!(
                f,
                "tick {tick}, {field}: {host:#010x} on the host, {board:#010x} on the board"
            ),
            Self::Length { host, board } => write!(
                f,
                "all ticks that both have are the same, but the host has {host}, the board {board}"
            ),
        }
    }
}

/// The fields of a setpoint, bit by bit.
fn fields(setpoint: &Setpoint) -> [(&'static str, u32); 18] {
    let Setpoint {
        pose,
        joints,
        // the robot's own, whatever it does
        arm: _,
        state,
        outputs,
        // The two are placed by different means.
        placed: _,
    } = setpoint;
    let [x, y, z, c] = pose.to_bits().map(i32::cast_unsigned);
    let [v1, v2, v3, v4] = joints.velocity.map(f32::to_bits);
    let [a1, a2, a3, a4] = joints.acceleration.map(f32::to_bits);
    let position = &joints.position;
    [
        ("state", *state as u32),
        ("outputs", u32::from(*outputs)),
        ("x", x),
        ("y", y),
        ("z", z),
        ("c", c),
        (
            "joint 1 position",
            position.joint1.to_bits().cast_unsigned(),
        ),
        (
            "joint 2 position",
            position.joint2.to_bits().cast_unsigned(),
        ),
        (
            "joint 3 position",
            position.joint3.to_bits().cast_unsigned(),
        ),
        (
            "joint 4 position",
            position.joint4.to_bits().cast_unsigned(),
        ),
        ("joint 1 velocity", v1),
        ("joint 2 velocity", v2),
        ("joint 3 velocity", v3),
        ("joint 4 velocity", v4),
        ("joint 1 acceleration", a1),
        ("joint 2 acceleration", a2),
        ("joint 3 acceleration", a3),
        ("joint 4 acceleration", a4),
    ]
}

fn first_difference(host: &[Setpoint], board: &[Setpoint]) -> Option<Difference> {
    for (tick, pair) in host.iter().zip(board).enumerate() {
        let both = fields(pair.0).into_iter().zip(fields(pair.1));
        for ((field, host), (_, board)) in both {
            if host != board {
                return Some(Difference::Bits {
                    tick,
                    field,
                    host,
                    board,
                });
            }
        }
    }
    let (host, board) = (host.len(), board.len());
    (host != board).then_some(Difference::Length { host, board })
}

fn on_host(robot: &Robot, program: &str) -> Vec<Setpoint> {
    let mut all = Vec::new();
    software_loop::run(robot, program, |setpoint| all.push(*setpoint)).expect(program);
    all
}

/// Nothing if the PC was too busy to send the moves in time: then the motion paused, which is
/// no question of bits.
fn on_board(emulator: &mut Emulator, config: &RobotConfig, program: &str) -> Option<Vec<Setpoint>> {
    let lines: Vec<&str> = program.lines().collect();
    let run: EmulatorRun = emulator
        .run_program(&settings(config), &lines)
        .unwrap_or_else(|error| panic!("{error} in\n{program}"));
    assert_eq!(run.overruns, 0, "{program}");
    (run.starved == 0).then(|| run.setpoints.iter().map(|frame| frame.setpoint).collect())
}

/// Runs a program on both, and yields the number of ticks that are the same; nothing where
/// a tool is missing.
fn ticks_alike(config: &RobotConfig, program: &str) -> Option<usize> {
    let moves = program
        .lines()
        .filter(|line| line.contains(['X', 'Y', 'Z', 'C']));
    let pace = if moves.count() < LOOKAHEAD {
        Pace::Free
    } else {
        Pace::RealTime
    };
    let host = on_host(&Robot::new(config).expect("valid settings"), program);
    let mut attempts = 0;
    let board = loop {
        if let Some(board) = on_board(&mut emulator(pace)?, config, program) {
            break board;
        }
        attempts += 1;
        assert!(
            attempts < ATTEMPTS,
            "the moves ran out again and again in\n{program}"
        );
    };
    if let Some(difference) = first_difference(&host, &board) {
        panic!("{difference}\nwith {config:?}, in\n{program}");
    }
    Some(host.len())
}

/// The settings and the program of a seed: every prefilter, elbow and tolerance comes up.
fn scenario(seed: u64) -> (RobotConfig, String) {
    let nth = seed as usize;
    let mut config = RobotConfig::default();
    // every fifth seed has the same tolerance
    config.prefilter.kind = Kind::ALL[(nth + nth / 5) % Kind::ALL.len()];
    config.prefilter.frequency_hz = 3.7 + 1.37 * (nth % 9) as f32;
    config.prefilter.damping = [0.0, 0.022, 0.1][nth % 3];
    config.corner_tolerance_mm = [0.0, 0.05, 0.2, 0.5, 2.0][nth % 5];
    config.feed_limit_mm_s = 400.0;
    if seed % 4 == 3 {
        config.scara.elbow = Elbow::Left;
    }
    if seed % 6 == 5 {
        config.scara.link1_mm = 210.37;
        config.scara.link2_mm = 160.11;
    }
    let usual = Shape {
        moves: 16,
        longest_mm: 40.0,
        arcs: 0.35,
        ..Shape::default()
    };
    let shape = match seed % 20 {
        // More moves than the queue holds.
        19 => Shape {
            moves: LOOKAHEAD + 20,
            smooth: 0.9,
            longest_mm: 10.0,
            ..usual
        },
        // Nothing but arcs, as many in flight as there can be.
        18 => Shape { arcs: 1.0, ..usual },
        _ => usual,
    };
    (config, random_program(seed, shape))
}

fn compare_seeds(seeds: std::ops::Range<u64>) {
    let started = Instant::now();
    let mut ticks = 0;
    for seed in seeds.clone() {
        let (config, program) = scenario(seed);
        let Some(alike) = ticks_alike(&config, &program) else {
            return;
        };
        ticks += alike;
    }
    let seconds = started.elapsed().as_secs();
    println!("programs {seeds:?}: {ticks} ticks are the same on both, in {seconds} s");
}

#[test]
fn the_corner_path_has_the_same_bits_with_every_prefilter() {
    for kind in Kind::ALL {
        let mut config = RobotConfig::default();
        config.prefilter.kind = kind;
        let Some(ticks) = ticks_alike(&config, CORNER_PATH) else {
            return;
        };
        println!("{}: {ticks} ticks are the same on both", kind.name());
        // 2.86 s of path at 160 mm/s, and corners
        assert!(ticks > 2_800, "{kind:?}: {ticks}");
    }
}

#[test]
fn twenty_random_programs_have_the_same_bits() {
    compare_seeds(0..20);
}

/// Some three minutes: `cargo test --release --test emulated sixty_more -- --ignored --nocapture`
#[test]
#[ignore = "a soak: some three minutes of real time"]
fn sixty_more_random_programs_have_the_same_bits() {
    compare_seeds(20..80);
}

/// A gentle curve in chords of half a millimetre, which last 12.5 ms each at 40 mm/s.
fn half_millimetre_chords() -> String {
    use std::fmt::Write;
    let mut program = String::from("G0 X240 Y0 Z0 C0\nG1 F2400\n");
    let (mut x, mut y, mut heading) = (240.0_f64, 0.0_f64, 1.5_f64);
    for n in 1..=4 * LOOKAHEAD {
        let n = n as f64;
        heading += 0.002 + 0.004 * (n * 0.11).sin();
        x += 0.5 * heading.cos();
        y += 0.5 * heading.sin();
        let (z, c) = (0.01 * n, 0.05 * n);
        let _ = writeln!(program, "X{x:.4} Y{y:.4} Z{z:.4} C{c:.4}");
    }
    program.push_str("M2\n");
    program
}

#[test]
fn half_millimetre_chords_have_the_same_bits() {
    let Some(ticks) = ticks_alike(&RobotConfig::default(), &half_millimetre_chords()) else {
        return;
    };
    println!("half-millimetre chords: {ticks} ticks are the same on both");
}

#[test]
fn every_word_has_the_same_bits() {
    for kind in [Kind::FirZvd, Kind::Ei, Kind::SCurve] {
        let mut config = RobotConfig::default();
        config.prefilter.kind = kind;
        if ticks_alike(&config, EVERY_WORD).is_none() {
            return;
        }
    }
}

/// Prefilters that come and go with the axes of the moves.
#[test]
fn a_program_of_modes_along_axes_has_the_same_bits() {
    let mut config = RobotConfig::default();
    config
        .set_all("axes=x prefilter2=zv frequency2=9.1 damping2=0.01 axes2=yz")
        .expect("these settings exist");
    // so few changes that all of the program is queued before it starts
    for program in [
        CORNER_PATH,
        "G0 X220 Y0 Z0\nG1 X240 F9000\nY20\nX230 Y30\nG2 X230 Y20 I0 J-5\nG1 X225\nM2\n",
        "G0 X220 Y0 Z0\nG1 Z10 F9000\nY20\nX230\nC20\nM2\n",
        "G0 X220 Y0 Z0\nG1 X240 F9000\nM103 X220 Y10 Q10 R20\nM2\n",
    ] {
        let Some(ticks) = ticks_alike(&config, program) else {
            return;
        };
        println!("{ticks} ticks are the same on both");
    }
}

/// Changes of the prefilter on the way and at rest, corners between them, and an arc.
#[test]
fn a_program_with_a_map_has_the_same_bits() {
    for (kind, method) in [
        (Kind::FirZvd, PostureMethod::Local),
        (Kind::Zv, PostureMethod::Local),
        (Kind::Fir, PostureMethod::Hybrid),
    ] {
        let mut config = RobotConfig::default();
        config.prefilter.kind = kind;
        config.posture_method = method;
        config.map = ModeMapConfig {
            x_mm: [180.0, 315.0],
            y_mm: [-120.0, 140.0],
            columns: 2,
            rows: 2,
            ..ModeMapConfig::NONE
        };
        for (node, hz) in config.map.nodes.iter_mut().zip([9.0, 14.3, 11.0, 15.6]) {
            *node = MapNode::new(hz, 0.022);
        }
        for program in [CORNER_PATH, EVERY_WORD] {
            let Some(ticks) = ticks_alike(&config, program) else {
                return;
            };
            println!("{kind:?}, {method:?}: {ticks} ticks are the same on both");
        }
    }
}

/// A hop's raw path is its own, and the prefilter acts on none, two or all of its axes.
#[test]
fn hops_have_the_same_bits() {
    const SCARA_HOPS: &str = "\
G21 G90
G0 X250 Y0 Z-20 C10
M103 X200 Y-80.5 C-30 Q20 R30
M103 X251.25 Y60 Z-12.5 Q15 R22 P0.2
G1 X240 Y60 F6000
M103 X250 Y0 Q20 R30
M2
";
    const DELTA_HOPS: &str = include_str!("../../programs/hop.gcode");
    for axes in HopAxes::ALL {
        for (arm, program, rapid_mm_s) in [
            (ArmKind::Scara, SCARA_HOPS, 160.0),
            (ArmKind::Delta, DELTA_HOPS, 1000.0),
        ] {
            let mut config = RobotConfig {
                arm,
                rapid_mm_s,
                feed_limit_mm_s: 10_000.0,
                ..RobotConfig::default()
            };
            config.hop.axes = axes;
            let Some(ticks) = ticks_alike(&config, program) else {
                return;
            };
            println!("{arm:?}, {axes:?}: {ticks} ticks are the same on both");
        }
    }
}

/// The second and third program begin where the one before ended, with other settings or
/// with the same.
#[test]
fn programs_one_after_the_other_have_the_same_bits() {
    let Some(mut emulator) = emulator(Pace::Free) else {
        return;
    };
    let first = RobotConfig::default();
    let mut second = first;
    second.prefilter.kind = Kind::Zv;
    second.corner_tolerance_mm = 0.2;
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut robot = Robot::new(&first).expect("valid settings");
    let mut host = Controller::new(&mut robot, &mut queue, &mut filters);
    for (nth, (config, program)) in [
        (first, CORNER_PATH),
        (second, EVERY_WORD),
        (second, CORNER_PATH),
    ]
    .into_iter()
    .enumerate()
    {
        host.set_config(&config).expect("valid settings");
        let mut all = Vec::new();
        host.run(program, |setpoint| all.push(*setpoint))
            .expect("the program runs");
        let board = on_board(&mut emulator, &config, program).expect("the queue holds it all");
        if let Some(difference) = first_difference(&all, &board) {
            panic!("program {nth}: {difference}");
        }
        assert!(nth == 0 || all[0].pose != all[all.len() - 1].pose);
    }
}

#[test]
fn a_single_bit_is_found_and_named() {
    let robot = Robot::new(&RobotConfig::default()).expect("valid settings");
    let host = on_host(&robot, CORNER_PATH);
    assert_eq!(first_difference(&host, &host), None);
    const TICK: usize = 1234;
    let flip = |value: &mut f32| *value = f32::from_bits(value.to_bits() ^ 1);
    let changes: [&dyn Fn(&mut Setpoint); 18] = [
        &|s| s.state = MotionState::Idle,
        &|s| s.outputs ^= 1,
        &|s| s.pose.x ^= LengthMm::DELTA,
        &|s| s.pose.y ^= LengthMm::DELTA,
        &|s| s.pose.z ^= LengthMm::DELTA,
        &|s| s.pose.c ^= AngleDeg::DELTA,
        &|s| s.joints.position.joint1 ^= AngleRad::DELTA,
        &|s| s.joints.position.joint2 ^= AngleRad::DELTA,
        &|s| s.joints.position.joint3 = Joint3::from_bits(1 ^ s.joints.position.joint3.to_bits()),
        &|s| s.joints.position.joint4 ^= AngleRad::DELTA,
        &|s| flip(&mut s.joints.velocity[0]),
        &|s| flip(&mut s.joints.velocity[1]),
        &|s| s.joints.velocity[2] = -0.0,
        &|s| flip(&mut s.joints.velocity[3]),
        &|s| flip(&mut s.joints.acceleration[0]),
        &|s| flip(&mut s.joints.acceleration[1]),
        &|s| s.joints.acceleration[2] = -0.0,
        &|s| flip(&mut s.joints.acceleration[3]),
    ];
    for (change, (name, bits)) in changes.into_iter().zip(fields(&host[TICK])) {
        let mut board = host.clone();
        change(&mut board[TICK]);
        let Some(Difference::Bits {
            tick,
            field,
            host,
            board,
        }) = first_difference(&host, &board)
        else {
            panic!("{name} is not compared");
        };
        assert_eq!((tick, field, host), (TICK, name, bits));
        assert_eq!((host ^ board).count_ones(), 1, "{name}");
    }
    let told = Difference::Bits {
        tick: TICK,
        field: "joint 2 velocity",
        host: 1,
        board: 0,
    };
    assert_eq!(
        told.to_string(),
        "tick 1234, joint 2 velocity: 0x00000001 on the host, 0x00000000 on the board"
    );
    let shorter = &host[..host.len() - 1];
    assert_eq!(
        first_difference(&host, shorter),
        Some(Difference::Length {
            host: host.len(),
            board: shorter.len()
        })
    );
}
