//! The firmware on the emulated board. Where QEMU or the target is missing these
//! tests say so and pass, except with `CI=true`, where they fail.

use std::path::Path;
use std::time::Duration;

use crate::support::{emulator, installed, is_ci};
use host_tests::emulator::{Answer, Board, Emulator, EmulatorError, Pace, build_image};
use host_tests::machine::settings;
use host_tests::random_program::{Shape, random_program};
use planner_core::config::RobotConfig;
use planner_core::hop::HopAxes;
use planner_core::kinematics::ArmKind;
use planner_core::motion::MotionState;
use planner_core::pose::Pose;
use planner_core::posture::{MapNode, ModeMapConfig};
use planner_core::prefilter::Kind;
use planner_core::telemetry::SetpointFrame;
use planner_core::units::LengthMm;

fn assert_contiguous(frames: &[SetpointFrame]) {
    for pair in frames.windows(2) {
        assert_eq!(pair[1].sequence, pair[0].sequence + 1);
    }
}

#[test]
fn both_images_build() {
    for (board, images) in [(Board::NucleoG474re, 1), (Board::Mps2An386, 2)] {
        if let Some(paths) = installed(build_image(board)) {
            assert_eq!(paths.len(), images);
            assert!(paths.iter().all(|path| path.is_file()));
        }
    }
}

#[test]
fn it_boots_and_answers_every_line_once() {
    let Some(mut emulator) = emulator(Pace::RealTime) else {
        return;
    };
    assert!(emulator.status().unwrap().starts_with("Idle|MPos:0.000,"));
    assert_eq!(emulator.ask(b"").unwrap(), Answer::Ok);
    assert!(matches!(
        emulator.ask(b"$nothing").unwrap(),
        Answer::Error { code: 3, .. }
    ));
    let Answer::Error { message, .. } = emulator.ask(b"G7777").unwrap() else {
        panic!("there is no G7777");
    };
    assert!(message.contains(' '), "a sentence: {message}");
    emulator.reset().unwrap();
    assert_eq!(emulator.ask(b"").unwrap(), Answer::Ok);
    assert!(emulator.is_silent_for(Duration::from_millis(200)));
}

#[test]
fn a_refused_setting_leaves_the_old_one() {
    let Some(mut emulator) = emulator(Pace::RealTime) else {
        return;
    };
    assert!(matches!(
        emulator.ask(b"$no_such_setting=1").unwrap(),
        Answer::Error { code: 3, .. }
    ));
    let run = emulator.run_program(&["no_such_setting=1".to_owned()], &["M2"]);
    let error = run.unwrap_err().to_string();
    assert!(error.starts_with("line 1 ($no_such_setting=1) was refused with error 3: "));
    assert_eq!(emulator.ask(b"G0 X250 Y0").unwrap(), Answer::Ok);
}

/// A megabyte in CI; a tenth elsewhere, because QEMU takes in a byte at a time and
/// needs a minute and a half for the whole.
#[test]
fn a_line_of_a_megabyte_is_refused_once_and_moves_nothing() {
    let length = if is_ci() { 1_000_000 } else { 100_000 };
    let Some(mut emulator) = emulator(Pace::Free) else {
        return;
    };
    let mut line = b"G1 X".to_vec();
    line.resize(length, b'1');
    line.push(b'\n');
    emulator.send(&line).unwrap();
    assert!(matches!(
        emulator.answer().unwrap(),
        Answer::Error { code: 11, .. }
    ));
    assert!(emulator.is_silent_for(Duration::from_millis(200)));
    let frames = emulator.frames_until_now().unwrap();
    assert_contiguous(&frames);
    let first = frames[0].setpoint;
    assert!(frames.iter().all(|frame| frame.setpoint == first));
    assert_eq!(emulator.damage(), (0, 0));
    assert_eq!(emulator.ask(b"").unwrap(), Answer::Ok);
}

/// 200 moves stream through a queue of fewer, while they run.
#[test]
fn a_streamed_program_arrives_whole() {
    let Some(mut emulator) = emulator(Pace::RealTime) else {
        return;
    };
    let moves: Vec<String> = (1..=200)
        .map(|n| format!("G1 X{} F6000", 250 + n % 2))
        .collect();
    let mut lines = vec!["G0 X250 Y0"];
    lines.extend(moves.iter().map(String::as_str));
    let run = emulator.run_program(&[], &lines).unwrap();
    assert_contiguous(&run.setpoints);
    assert_eq!((run.overruns, run.starved), (0, 0));
    assert_eq!(emulator.statistics().unwrap().unsent, 0);
    // 200 moves of 1 mm at 100 mm/s.
    assert!(run.setpoints.len() >= 2000, "{}", run.setpoints.len());
    let (last, running) = run.setpoints.split_last().unwrap();
    assert_eq!(last.setpoint.state, MotionState::Idle);
    assert_eq!(last.setpoint.pose.x.to_num::<f64>(), 250.0);
    assert!(
        running
            .iter()
            .all(|frame| frame.setpoint.state == MotionState::Running)
    );
    assert!(run.worst_tick_instructions > 0);
}

/// The same program, again, and at another pace of time: the same setpoints and
/// the same instructions in every tick.
#[test]
fn a_run_repeats_bit_for_bit() {
    let program = ["G0 X250 Y0", "G1 X260 F6000", "G1 X240", "M2"];
    let mut runs = Vec::new();
    for pace in [Pace::RealTime, Pace::Free] {
        let Some(mut emulator) = emulator(pace) else {
            return;
        };
        let run = emulator.run_program(&[], &program).unwrap();
        assert_eq!((run.overruns, run.starved), (0, 0), "{pace:?}");
        runs.push(run.setpoints);
    }
    assert_eq!(runs[0].len(), runs[1].len());
    for (first, second) in runs[0].iter().zip(&runs[1]) {
        assert_eq!(first.setpoint, second.setpoint);
        assert!(first.tick_cost.abs_diff(second.tick_cost) <= 1);
    }
}

#[test]
fn moves_that_run_out_before_the_end_are_counted() {
    let Some(mut emulator) = emulator(Pace::RealTime) else {
        return;
    };
    for line in ["G0 X250 Y0", "G1 X251 F6000"] {
        assert_eq!(emulator.ask(line.as_bytes()).unwrap(), Answer::Ok);
    }
    while !emulator.status().unwrap().starts_with("Idle") {}
    assert_eq!(emulator.statistics().unwrap().starved, 1);
    let run = emulator.run_program(&[], &["G1 X250 F6000", "M2"]).unwrap();
    assert_eq!(run.starved, 0);
}

/// The next move comes while the prefilter still settles: nothing stops, but the path is
/// late, and the setpoints are not those of the program sent in time.
#[test]
fn moves_that_come_a_little_late_are_counted_too() {
    let Some(mut emulator) = emulator(Pace::RealTime) else {
        return;
    };
    for line in ["G0 X250 Y0", "G1 X251 F6000"] {
        assert_eq!(emulator.ask(line.as_bytes()).unwrap(), Answer::Ok);
    }
    // The segment lasts 10 ms; a tenth of a millimetre takes the prefilter longer, and the
    // whole 0.3 s.
    while emulator.status().unwrap().contains("MPos:250.0") {}
    for line in ["G1 X252", "M2"] {
        assert_eq!(emulator.ask(line.as_bytes()).unwrap(), Answer::Ok);
    }
    while !emulator.status().unwrap().starts_with("Idle|MPos:252.000,") {}
    assert_eq!(emulator.statistics().unwrap().starved, 1);
}

/// What stands in for a sender: it stops at the first line that is refused.
fn first_refusal(emulator: &mut Emulator, program: &[u8]) -> Option<(u8, String)> {
    let lines = program.split(|&byte| byte == b'\n');
    for line in lines.filter(|line| !line.is_empty()) {
        if let Answer::Error { code, message } = emulator.ask(line).unwrap() {
            return Some((code, message));
        }
    }
    None
}

fn is_at_rest(frame: &SetpointFrame) -> bool {
    let joints = &frame.setpoint.joints;
    joints.velocity == [0.0; 4] && joints.acceleration == [0.0; 4]
}

const GOOD_PROGRAM: [&str; 4] = ["G21 G90 G0 X300 Y0", "G1 Y20 F9600", "G3 Y40 J10", "M2"];

fn assert_a_good_program_runs(emulator: &mut Emulator) {
    let run = emulator.run_program(&[], &GOOD_PROGRAM).unwrap();
    let last = run.setpoints.last().unwrap().setpoint;
    let end = Pose {
        x: LengthMm::from_num(300),
        y: LengthMm::from_num(40),
        ..Pose::default()
    };
    assert_eq!((last.pose, last.state), (end, MotionState::Idle));
    assert!(run.setpoints.len() > 300);
    assert_eq!((run.overruns, run.starved), (0, 0));
}

/// Sent to the firmware itself, not to the program that checks first. It drops bytes
/// that are not ASCII, as every Grbl does, so that `not-text.gcode` is no bad program here.
#[test]
fn bad_programs_are_refused_by_number_and_move_nothing() {
    for (name, number, words) in [
        ("unreachable", 70, "line 1: the tool would be 400.000 mm"),
        ("singular", 71, "line 2: at 99."),
        ("open-arc", 33, "line 2: the arc does not close"),
        ("no-feed", 22, "line 2: no feedrate"),
        ("nan", 2, "line 2: word X: "),
        ("overflow", 60, "line 2: word X: the number is too large"),
        ("too-slow", 73, "line 2: the segment would take"),
        ("empty", 0, ""),
        ("no-motion", 0, ""),
    ] {
        let Some(mut emulator) = emulator(Pace::Free) else {
            return;
        };
        let (code, message) = first_refusal(&mut emulator, &bad_program(name)).unwrap_or_default();
        assert_eq!(code, number, "{name}: {message}");
        assert!(message.starts_with(words), "{name}: {message}");
        // longer than moves wait for their start when nobody says any more
        assert!(emulator.is_silent_for(Duration::from_millis(200)));
        let frames = emulator.frames_until_now().unwrap();
        assert_contiguous(&frames);
        assert!(frames.len() > 100, "{name}");
        assert!(frames.iter().all(is_at_rest), "{name}");
        // Where the tool is taken to be from the first point on.
        let poses = frames
            .windows(2)
            .filter(|pair| pair[0].setpoint.pose != pair[1].setpoint.pose);
        assert!(poses.count() <= 1, "{name}");
        assert_a_good_program_runs(&mut emulator);
    }
}

/// A sender that streams has seen `ok` for them.
#[test]
fn moves_before_a_refused_line_are_carried_out_and_no_more() {
    let Some(mut emulator) = emulator(Pace::Free) else {
        return;
    };
    let (code, message) = first_refusal(&mut emulator, &bad_program("joint-limit")).unwrap();
    assert_eq!(code, 72, "{message}");
    assert!(
        message.starts_with("line 3: at 42.3 % of the segment joint 1"),
        "{message}"
    );
    while !emulator
        .status()
        .unwrap()
        .starts_with("Idle|MPos:-250.000,0.000,")
    {}
    assert!(emulator.is_silent_for(Duration::from_millis(200)));
    let frames = emulator.frames_until_now().unwrap();
    let last = frames.last().unwrap();
    assert!(is_at_rest(last));
    assert_eq!(last.setpoint.pose.y, LengthMm::ZERO);
    // the straight way from (0, 250) to (-250, 0), and back across to the good program
    emulator
        .run_program(&[], &["G0 X-200 Y150", "X0 Y250", "X250 Y100", "M2"])
        .unwrap();
    assert_a_good_program_runs(&mut emulator);
}

fn bad_program(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("programs/bad");
    std::fs::read(path.join(name).with_extension("gcode")).unwrap()
}

/// Settings, maps, arcs, errors, full queues, questions: the stack keeps a quarter of a kilobyte.
#[test]
fn the_stack_keeps_its_distance_from_the_variables() {
    let Some(mut emulator) = emulator(Pace::Free) else {
        return;
    };
    let at_boot = emulator.stack_use().unwrap();
    // a map of the mode, with the prefilter chosen for each move
    let mut config = RobotConfig {
        automatic: true,
        ..RobotConfig::default()
    };
    config.map = ModeMapConfig {
        x_mm: [180.0, 315.0],
        columns: 2,
        rows: 1,
        ..ModeMapConfig::NONE
    };
    for (node, hz) in config.map.nodes.iter_mut().zip([9.0, 15.0]) {
        *node = MapNode::new(hz, 0.022);
    }
    let lines: Vec<&str> = include_str!("../../programs/corner-path.gcode")
        .lines()
        .collect();
    emulator.run_program(&settings(&config), &lines).unwrap();
    println!("stack with a map {:?}", emulator.stack_use().unwrap());
    for kind in [Kind::FirZvd, Kind::Ei, Kind::FirZv] {
        let mut config = RobotConfig::default();
        config.prefilter.kind = kind;
        config.corner_tolerance_mm = 0.2;
        let shape = Shape {
            moves: 70,
            arcs: 0.6,
            smooth: 0.9,
            longest_mm: 5.0,
            ..Shape::default()
        };
        let program = random_program(1, shape);
        let lines: Vec<&str> = program.lines().collect();
        emulator.run_program(&settings(&config), &lines).unwrap();
        for bad in [
            "$tolerance=-1",
            "$prefilter=x",
            "G1 X399 Y399",
            "G2 X1 Y1 I1",
            "G1 X1..2",
        ] {
            assert!(
                matches!(emulator.ask(bad.as_bytes()).unwrap(), Answer::Error { .. }),
                "{bad}"
            );
        }
    }
    for name in ["singular", "joint-limit", "too-slow", "overflow"] {
        first_refusal(&mut emulator, &bad_program(name));
    }
    let stack = emulator.stack_use().unwrap();
    println!("stack at boot {at_boot:?}, at the fullest moment {stack:?}");
    assert!(stack.used_bytes >= at_boot.used_bytes, "{stack:?}");
    assert!(stack.free_bytes >= 256, "{stack:?}");
}

/// A hop is the deepest that planning goes.
#[test]
fn the_stack_holds_hops() {
    let on_a_scara = "G0 X250 Y0 Z-20\nM103 X200 Y-80 Q20 R30\nM103 X250 Y0 Q20 R30\nM2";
    let on_a_delta = include_str!("../../programs/hop.gcode");
    for (arm, program) in [(ArmKind::Scara, on_a_scara), (ArmKind::Delta, on_a_delta)] {
        let Some(mut emulator) = emulator(Pace::Free) else {
            return;
        };
        let mut config = RobotConfig {
            arm,
            feed_limit_mm_s: 10_000.0,
            ..RobotConfig::default()
        };
        config.hop.axes = HopAxes::All;
        let lines: Vec<&str> = program.lines().collect();
        emulator.run_program(&settings(&config), &lines).unwrap();
        let stack = emulator.stack_use().unwrap();
        println!("stack on hops of a {arm:?}: {stack:?}");
        assert!(stack.free_bytes >= 256, "{arm:?}: {stack:?}");
    }
}

#[test]
fn what_is_missing_is_named() {
    let error = Emulator::start("/nowhere/firmware".as_ref()).err().unwrap();
    assert_eq!(
        error.to_string(),
        "there is no firmware image /nowhere/firmware"
    );
    assert_eq!(
        EmulatorError::NoQemu.to_string(),
        "QEMU for ARM is missing: install the package qemu-system-arm"
    );
}
