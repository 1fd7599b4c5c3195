//! G-code from text to commands: what every line does, and what every wrong line is called.

mod support;

use std::collections::BTreeSet;

use planner_core::corner::CornerRule;
use planner_core::gcode::{
    BLOW_OFF, Command, Coolant, Defaults, Distance, Feed, FeedMode, GRIPPER, Interpreter, Line,
    Motion, Move, Plane, ProgramFlow, RobotChange, Spindle, Units,
};
use planner_core::kinematics::Elbow;
use planner_core::path::{PathSegment, Shape};
use planner_core::prefilter::{Kind, PrefilterConfig};
use support::{DEFAULTS, after, pose, run, run_move};

#[test]
fn every_wrong_line_has_its_code() {
    const RAPID: &[&str] = &["G0 X10 Y0"];
    const LINEAR: &[&str] = &["G0 X10 Y0", "G1 F600"];
    const ARC: &[&str] = &["G0 X10 Y0", "F600"];
    const G80: &[&str] = &["G0 X10 Y0", "G80"];
    const INVERSE_TIME: &[&str] = &["G0 X10 Y0", "G93 G1 X1 F60"];
    let mut codes = BTreeSet::new();
    for (before, text, code) in [
        (RAPID, "10", 1),
        (RAPID, "X", 2),
        (RAPID, "X1.2.3", 2),
        (RAPID, "F-1", 4),
        (RAPID, "N-1 M5 N-1", 4),
        (RAPID, "G4 P-1", 4),
        (RAPID, "S-1", 4),
        (RAPID, "T-1", 4),
        (RAPID, "G64 P-0.1", 4),
        (RAPID, "G5", 20),
        (RAPID, "G38.2 Z-1 F10", 20),
        (RAPID, "G41", 20),
        (RAPID, "G43 Z1", 20),
        (RAPID, "G43.2 Z1", 20),
        (RAPID, "G28.2", 20),
        (RAPID, "G30.2", 20),
        (RAPID, "G61.1", 20),
        (RAPID, "G90.1", 20),
        (RAPID, "G91.2", 20),
        (RAPID, "G92.2", 20),
        (RAPID, "G10 P1 X0", 20),
        (RAPID, "G10 L3 P1 X0", 20),
        (RAPID, "G10 L2 P1 X0 R0", 20),
        (RAPID, "G0 X1 Q1", 20),
        (RAPID, "G256", 20),
        (RAPID, "G-1", 20),
        (RAPID, "M10", 20),
        (RAPID, "M104", 20),
        (RAPID, "M110 X1", 20),
        (RAPID, "G0 X1 A1", 20),
        (RAPID, "G0 X1 B1", 20),
        (RAPID, "G0 X1 U1", 20),
        (RAPID, "G1 X1 E5", 20),
        (RAPID, "X1E5", 20),
        (RAPID, "O100", 20),
        (RAPID, "G0 G1 X1", 21),
        (RAPID, "G0 G0 X1", 21),
        (RAPID, "G0 G80", 21),
        (RAPID, "G17 G18", 21),
        (RAPID, "G20 G21", 21),
        (RAPID, "G43.1 G49 Z1", 21),
        (RAPID, "G4 G53 P1", 21),
        (RAPID, "G28 G92 X1", 21),
        (RAPID, "G54 G55", 21),
        (RAPID, "G90 G91", 21),
        (RAPID, "G93 G94", 21),
        (RAPID, "M101 M102", 21),
        (RAPID, "G61 G64", 21),
        (RAPID, "M0 M30", 21),
        (RAPID, "M3 M5", 21),
        (RAPID, "M7 M9", 21),
        (RAPID, "G1 X1", 22),
        (RAPID, "G1", 22),
        (RAPID, "G1 X1 F0", 22),
        (RAPID, "G2 X1 R5", 22),
        (LINEAR, "G93 G1 X1", 22),
        (LINEAR, "G93 X1", 22),
        (INVERSE_TIME, "X2", 22),
        (INVERSE_TIME, "X2 F0", 22),
        (INVERSE_TIME, "G94 X2", 22),
        (RAPID, "G1.5", 23),
        (RAPID, "G17.05", 23),
        (RAPID, "G10.1", 23),
        (RAPID, "G59.4", 23),
        (RAPID, "M3.1", 23),
        (RAPID, "M99.1", 23),
        (RAPID, "M100 P1.5", 23),
        (RAPID, "G49 G0 X1", 24),
        (RAPID, "G49 X1", 24),
        (RAPID, "G43.1 Z1 G0", 24),
        (RAPID, "G0 G10 L2 P1 X1", 24),
        (RAPID, "G1 G28 X1", 24),
        (RAPID, "G2 G30 X1", 24),
        (RAPID, "G92 G0 X1", 24),
        (RAPID, "G92 G43.1 Z1", 24),
        (RAPID, "X1 X1", 25),
        (RAPID, "F1 F1", 25),
        (ARC, "G2", 26),
        (ARC, "G2 I5", 26),
        (RAPID, "G10 L2 P1", 26),
        (RAPID, "G92", 26),
        (RAPID, "N10000001", 27),
        (RAPID, "G4", 28),
        (RAPID, "G4 X1", 28),
        (RAPID, "G10 X1", 28),
        (RAPID, "G10 L2 P7 X1", 29),
        (RAPID, "G10 L20 P7 X1", 29),
        (RAPID, "G59.1", 29),
        (RAPID, "G59.3", 29),
        (ARC, "G53 G2 X1 R5", 30),
        (&["G0 X10 Y0", "G2 X8 R4 F1"], "G53 X1", 30),
        (RAPID, "G53 G80", 30),
        (G80, "G53", 30),
        (G80, "X1", 31),
        (G80, "G10 L2 P1 X1", 31),
        (G80, "G28 X1", 31),
        (G80, "G92 X1", 31),
        (G80, "G43.1 Z1", 31),
        (G80, "G80 C1", 31),
        (ARC, "G2 Z1 I1", 32),
        (ARC, "G2 C1 I1", 32),
        (ARC, "G18 G2 Y1 I1", 32),
        (ARC, "G19 G2 X1 J1", 32),
        (ARC, "G2 X10 Y0 R5", 33),
        (ARC, "G2 X10 Y0 Z1 R5", 33),
        (ARC, "G2 X21 Y0 I5", 33),
        (ARC, "G2 X20.011 Y0 I5", 33),
        (ARC, "G2 X2010.6 Y0 I1000", 33),
        (ARC, "G2 X20 Y0 R4.99", 34),
        (ARC, "G2 X20 Y0 R0", 34),
        (ARC, "G2 X10 Y0 I0 J0", 34),
        (ARC, "G2 X20 Y0 R1000001", 34),
        (ARC, "G2 X10 Y0 I1000001", 34),
        (ARC, "G2 X20", 35),
        (ARC, "G2 X20 K5", 35),
        (LINEAR, "G1 X1 I5", 36),
        (LINEAR, "X1 P5", 36),
        (LINEAR, "L1", 36),
        (LINEAR, "R1", 36),
        (LINEAR, "K1", 36),
        (LINEAR, "G61 P0.1", 36),
        (ARC, "G2 X20 R5 I5", 36),
        (LINEAR, "G0 X1 L2", 36),
        (LINEAR, "G92 X1 P1", 36),
        (LINEAR, "G10 L20 P1 X0 R1", 36),
        (LINEAR, "G28 P1", 36),
        (LINEAR, "M100 P1 X1", 36),
        (LINEAR, "M101 P1", 36),
        (LINEAR, "M102 F1", 36),
        (RAPID, "G43.1", 37),
        (RAPID, "G43.1 X1", 37),
        (RAPID, "G43.1 Z1 X1", 37),
        (RAPID, "G43.1 Z1 C1", 37),
        (RAPID, "T256", 38),
        (RAPID, "X9999999999", 60),
        (RAPID, "G20 X99999999", 60),
        (RAPID, "X4095.000000001", 61),
        (RAPID, "Y-4096", 61),
        (RAPID, "Z999999999", 61),
        (RAPID, "C1440.1", 61),
        (RAPID, "G91 X4090", 61),
        (RAPID, "G20 X161.3", 61),
        (&["G10 L2 P2 X10", "G0 X10 Y0"], "G55 X4090", 61),
        (RAPID, "G10 L2 P2 X4096", 61),
        (RAPID, "G10 L20 P2 X-4090", 61),
        (RAPID, "G92 X-4090", 61),
        (RAPID, "G43.1 Z4096", 61),
        (&[], "G0 X1", 62),
        (&[], "G10 L20 P1 X0", 62),
        (&[], "G92 X0", 62),
        (&[], "G28", 62),
        (&[], "G30 X1", 62),
        (&[], "G28.1", 62),
        (&[], "G30.1", 62),
        (&["G10 L2 P2 X9"], "G91 G53 G0 Z1 X1", 62),
        (&[], "G0 Y1", 62),
        (&[], "G0 Z1", 62),
        (&[], "G91 G0 X1 Y1", 62),
        (&[], "G2 X1 Y1 R1 F1", 62),
        (RAPID, "G0 X1*0", 63),
        (RAPID, "G4 P1 G64", 65),
        (RAPID, "G64 P1 Q50", 80),
        (RAPID, "G64 Q100.1", 80),
        (RAPID, "G64 Q-1", 80),
        (RAPID, "G61 Q50", 20),
        (RAPID, "G10 L2 P1 X1 G64", 65),
        (RAPID, "M101 G0 X1", 65),
        (RAPID, "M100 P1 M3", 65),
        (RAPID, "M102 M30", 65),
        (ARC, "G18 G2 X1 I1", 75),
        (ARC, "G19 G3 Y1 R1", 75),
        (RAPID, "M100 P99", 76),
        (RAPID, "M100 P1000", 76),
    ] {
        let mut interpreter = after(before);
        let modal = *interpreter.modal();
        let offsets = interpreter.offsets().clone();
        match run(&mut interpreter, text) {
            Err(error) => assert_eq!(error.code(), code, "{text}: {error}"),
            Ok(command) => panic!("{text}: {command:?} instead of error {code}"),
        }
        assert_eq!(*interpreter.modal(), modal, "{text}");
        assert_eq!(*interpreter.offsets(), offsets, "{text}");
        codes.insert(code);
    }
    // Grbl's codes of G-code lines; 11 is the receiver's, 15 and 16 are those of jogs.
    let grbl = [1, 2, 4].into_iter().chain(20..=38);
    for code in grbl.chain([60, 61, 62, 63, 65, 75, 76]) {
        assert!(codes.contains(&code), "{code}");
    }
}

#[test]
fn lines_without_motion_change_the_modal_state_only() {
    for text in [
        "",
        "N100",
        "G0",
        "G17 G21 G40 G49 G54 G80 G90 G91.1 G94",
        "M1",
        "G18",
        "G19",
        "G59",
        "G93",
        "G93 F60",
        "G53",
        "G53 X10",
        "G92.1",
        "G28.1",
        "G10 L2 P1 X5",
        "G43.1 Z5",
        "G92 X0 Y0",
        "M5 M9 S1000",
        "M6 T1",
        "M100",
        "M110 N7",
        "N-1 M110 N-1*125",
        "T255",
        "G1 F100",
        "X10 Y0",
        "G1 F100 X10",
    ] {
        let mut interpreter = after(&["G0 X10 Y0"]);
        assert_eq!(
            run(&mut interpreter, text),
            Ok(Command::default()),
            "{text}"
        );
        let position = interpreter.modal().position();
        assert_eq!(position, Some(pose(10.0, 0.0, 0.0, 0.0)));
    }
    let interpreter = after(&["G20 G91 G1 F1 G61"]);
    let modal = interpreter.modal();
    assert_eq!(modal.motion(), Motion::Linear);
    assert_eq!(modal.units(), Units::Inches);
    assert_eq!(modal.distance(), Distance::Incremental);
    assert_eq!(modal.feed_mm_per_min(), Some(25.4));
    assert_eq!(modal.corner(), CornerRule::EXACT_STOP);
    assert_eq!(modal.position(), None);
    assert_eq!(modal.lines(), 1);
}

#[test]
fn the_first_point_is_the_reference() {
    for (text, expected) in [
        ("G0 X1 Y2", pose(1.0, 2.0, 0.0, 0.0)),
        ("X1 Y2 Z-3 C90", pose(1.0, 2.0, -3.0, 90.0)),
        ("G1 F100 X1 Y2", pose(1.0, 2.0, 0.0, 0.0)),
        ("G20 X1 Y-1 C-90", pose(25.4, -25.4, 0.0, -90.0)),
        (
            "X-4095 Y4095 Z4095 C1440",
            pose(-4095.0, 4095.0, 4095.0, 1440.0),
        ),
    ] {
        let mut interpreter = after(&[]);
        let command = Command {
            reference: Some(expected),
            ..Command::default()
        };
        assert_eq!(run(&mut interpreter, text), Ok(command), "{text}");
        assert_eq!(interpreter.modal().position(), Some(expected), "{text}");
    }
    // A robot that has been homed knows better.
    let mut interpreter = after(&[]);
    interpreter.set_position(Some(pose(1.0, 2.0, 3.0, 4.0)));
    let motion = run_move(&mut interpreter, "G0 Z5");
    assert_eq!(motion.path.start, pose(1.0, 2.0, 3.0, 4.0));
    assert_eq!(motion.path.target, pose(1.0, 2.0, 5.0, 4.0));
}

#[test]
fn moves_carry_what_the_planner_needs() {
    let mut interpreter = after(&["G0 X10 Y0"]);
    assert_eq!(
        run_move(&mut interpreter, "g1 x20 y-5 z1.5 c45 f9600 (go)"),
        Move {
            path: PathSegment {
                start: pose(10.0, 0.0, 0.0, 0.0),
                target: pose(20.0, -5.0, 1.5, 45.0),
                shape: Shape::Line,
            },
            feed: Feed::MmPerS(160.0),
            corner: CornerRule::ToleranceMm(0.25),
            line: 2,
        }
    );
    // A motion mode persists, an axis that is not given stays.
    let motion = run_move(&mut interpreter, "N70.9 X21");
    assert_eq!(motion.path.target, pose(21.0, -5.0, 1.5, 45.0));
    assert_eq!(motion.feed, Feed::MmPerS(160.0));
    assert_eq!(motion.line, 70);
    let motion = run_move(&mut interpreter, "G0 X22");
    assert_eq!((motion.feed, motion.line), (Feed::Rapid, 4));
    interpreter.skip();
    // F is in mm/min in space, and in deg/min for the yaw alone, inches or not.
    let motion = run_move(&mut interpreter, "G20 G91 G1 X1 F60");
    assert_eq!((motion.feed, motion.line), (Feed::MmPerS(25.4), 6));
    for (text, feed) in [
        ("C90", 1.0),
        ("G21 C90", 1.0),
        ("Z1", 25.4),
        ("Z1 C1", 25.4),
    ] {
        assert_eq!(
            run_move(&mut interpreter, text).feed,
            Feed::MmPerS(feed),
            "{text}"
        );
    }
}

#[test]
fn the_corner_rule_is_that_of_the_moves_start() {
    use CornerRule::{OverlapPercent, ToleranceMm};
    let mut interpreter = after(&["G0 X0 Y0"]);
    for (text, expected) in [
        ("X1", ToleranceMm(0.25)),
        ("G61 X2", ToleranceMm(0.0)),
        ("X3", ToleranceMm(0.0)),
        ("G64 P0.5 X4", ToleranceMm(0.5)),
        ("G20 G64 P1 X5", ToleranceMm(25.4)),
        ("G64 X6", ToleranceMm(0.25)),
        ("G64 P0 X7", ToleranceMm(0.0)),
        ("G64 Q90 X8", OverlapPercent(90.0)),
        ("X9", OverlapPercent(90.0)),
        ("G64 Q0 X10", OverlapPercent(0.0)),
        ("G64 Q100 X11", OverlapPercent(100.0)),
        ("G64 X12", ToleranceMm(0.25)),
    ] {
        let motion = run_move(&mut interpreter, text);
        assert_eq!(motion.corner, expected, "{text}");
    }
}

#[test]
fn dwell_pause_and_end() {
    let mut interpreter = after(&["G0 X10 Y0", "G91 G61 G20 F1", "G1"]);
    let dwell = Command {
        dwell_s: Some(0.1),
        ..Command::default()
    };
    let pause = Command {
        flow: Some(ProgramFlow::Pause),
        ..Command::default()
    };
    let end = Command {
        flow: Some(ProgramFlow::End),
        ..Command::default()
    };
    assert_eq!(run(&mut interpreter, "G4 P.1"), Ok(dwell));
    assert_eq!(run(&mut interpreter, "M0"), Ok(pause));
    assert_eq!(run(&mut interpreter, "M30"), Ok(end));
    let modal = *interpreter.modal();
    assert_eq!(modal.motion(), Motion::Linear);
    assert_eq!(modal.distance(), Distance::Absolute);
    assert_eq!(modal.corner(), CornerRule::ToleranceMm(0.25));
    assert_eq!(modal.units(), Units::Inches);
    assert_eq!(modal.feed_mm_per_min(), Some(25.4));
    assert_eq!(modal.position(), Some(pose(10.0, 0.0, 0.0, 0.0)));
    assert_eq!(run_move(&mut interpreter, "X1").line, 1);
    assert_eq!(run(&mut interpreter, "M2"), Ok(end));
}

#[test]
fn nothing_changes_before_commit() {
    let mut interpreter = after(&["G0 X10 Y0"]);
    let before = *interpreter.modal();
    let line = Line::parse(b"G91 G20 G61 G1 X1 F100").unwrap();
    let first = interpreter.interpret(&line).unwrap();
    assert_eq!(*interpreter.modal(), before);
    assert_eq!(interpreter.interpret(&line), Ok(first.clone()));
    interpreter.commit(&first);
    assert_eq!(interpreter.modal(), first.modal());
    assert_ne!(*first.modal(), before);
}

/// 0.1 mm is no multiple of 2^-19 mm: rounded move by move, it would drift by 11 µm.
#[test]
fn incremental_moves_do_not_drift() {
    let mut interpreter = after(&["G0 X0 Y0", "G91"]);
    for _ in 0..30_000 {
        run_move(&mut interpreter, "X.1 Y-.001");
    }
    let position = interpreter.modal().position();
    assert_eq!(position, Some(pose(3000.0, -30.0, 0.0, 0.0)));
}

/// Grbl's order of execution: outputs, dwell, motion, program flow.
#[test]
fn one_line_may_ask_for_several_actions() {
    let mut interpreter = after(&["G0 X10 Y0 F600"]);
    let command = run(&mut interpreter, "G4 P2 G1 X20 M3 M8 M0").unwrap();
    assert_eq!(command.outputs, Some(GRIPPER | BLOW_OFF));
    assert_eq!(command.dwell_s, Some(2.0));
    let motion = command.motion.unwrap();
    assert_eq!(motion.path.target, pose(20.0, 0.0, 0.0, 0.0));
    assert_eq!(command.outputs_after, None);
    assert_eq!(command.flow, Some(ProgramFlow::Pause));
    assert_eq!(command.moves().count(), 1);

    let command = run(&mut interpreter, "M5 X10 M30").unwrap();
    assert_eq!(command.outputs, Some(BLOW_OFF));
    assert!(command.motion.is_some());
    assert_eq!(command.outputs_after, Some(0));
    assert_eq!(command.flow, Some(ProgramFlow::End));

    let mut interpreter = after(&["G0 X10 Y0", "G10 L2 P1 X1"]);
    let command = run(&mut interpreter, "M3 G28 X5 M2").unwrap();
    assert_eq!(command.outputs, Some(GRIPPER));
    assert_eq!(command.moves().count(), 2);
    assert_eq!(command.outputs_after, Some(0));
}

#[test]
fn outputs_are_told_when_they_change() {
    let mut interpreter = after(&[]);
    for (text, outputs) in [
        ("M5", None),
        ("M9", None),
        ("M3", Some(GRIPPER)),
        ("M3 S500", None),
        ("M4", None),
        ("M7", Some(GRIPPER | BLOW_OFF)),
        ("M8", None),
        ("M5", Some(BLOW_OFF)),
        ("M4 M9", Some(GRIPPER)),
        ("M5 M9", Some(0)),
    ] {
        let command = Command {
            outputs,
            ..Command::default()
        };
        assert_eq!(run(&mut interpreter, text), Ok(command), "{text}");
    }
    let interpreter = after(&["M4 M7", "M8"]);
    let modal = interpreter.modal();
    let coolant = Coolant {
        mist: true,
        flood: true,
    };
    assert_eq!(modal.spindle(), Spindle::CounterClockwise);
    assert_eq!(modal.coolant(), coolant);
    assert_eq!(modal.outputs(), GRIPPER | BLOW_OFF);
}

#[test]
fn inverse_time_is_that_of_its_line() {
    let mut interpreter = after(&["G0 X10 Y0 F600"]);
    assert_eq!(
        run_move(&mut interpreter, "G93 G1 X11 F2").feed,
        Feed::Seconds(30.0)
    );
    assert_eq!(
        run_move(&mut interpreter, "G20 X12 F0.5").feed,
        Feed::Seconds(120.0)
    );
    assert_eq!(
        run_move(&mut interpreter, "G21 C90 F60").feed,
        Feed::Seconds(1.0)
    );
    assert_eq!(
        run_move(&mut interpreter, "G2 X300 R5 F6").feed,
        Feed::Seconds(10.0)
    );
    // Rapids need none, and nothing of G93 is left over for G94.
    assert_eq!(run_move(&mut interpreter, "G0 X13").feed, Feed::Rapid);
    assert_eq!(interpreter.modal().feed_mode(), FeedMode::InverseTime);
    assert_eq!(interpreter.modal().feed_mm_per_min(), None);
    assert_eq!(
        run_move(&mut interpreter, "G94 G1 X14 F60").feed,
        Feed::MmPerS(1.0)
    );
    run(&mut interpreter, "G93 G1 X15 F60").unwrap();
    run(&mut interpreter, "M30").unwrap();
    assert_eq!(interpreter.modal().feed_mode(), FeedMode::PerMinute);
    assert_eq!(interpreter.modal().feed_mm_per_min(), None);
}

/// The words and their order are Grbl's, those of the robot come last.
#[test]
fn the_parser_state_reads_as_grbls() {
    for (lines, text) in [
        (&[][..], "G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0 G64 P0.25"),
        (
            &[
                "G0 X10 Y0",
                "G91 G3 X5 R5 F2 G55 M3 M7 T12 S1000.6",
                "G18 G20 G93 G61 M8 F2",
            ],
            "G3 G55 G18 G20 G91 G93 M3 M7 M8 T12 F2 S1001 G61",
        ),
        (
            &["G80 G59 G19 M4 M8 F1234.5 G64 P1"],
            "G80 G59 G19 G21 G90 G94 M4 M8 T0 F1235 S0 G64 P1",
        ),
        (
            &["G64 Q62.5"],
            "G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0 G64 Q62.5",
        ),
        (
            &["G1 G20 F10 M7", "M30"],
            "G1 G54 G17 G20 G90 G94 M5 M9 T0 F254 S0 G64 P0.25",
        ),
    ] {
        assert_eq!(after(lines).parser_state().to_string(), text);
    }
    let interpreter = after(&["G0 X10 Y0", "G2 X5 R5 F2", "G56 G19 M7"]);
    let text = "G2 G56 G19 G21 G90 G94 M5 M7 T0 F2 S0 G64 P0.25";
    assert_eq!(interpreter.parser_state().to_string(), text);
}

#[test]
fn an_end_takes_back_what_grbls_does() {
    let mut interpreter = after(&[
        "G10 L2 P2 X5 Y5",
        "G0 X10 Y0 F600 T3 S9",
        "G55 G18 G91 G20 G61 M3 M8",
        "G92 Z3",
        "M30",
    ]);
    let modal = interpreter.modal();
    assert_eq!(modal.work_system(), 0);
    assert_eq!(modal.plane(), Plane::Xy);
    assert_eq!(modal.outputs(), 0);
    let state = interpreter.parser_state().to_string();
    assert_eq!(state, "G1 G54 G17 G20 G90 G94 M5 M9 T3 F600 S9 G64 P0.25");
    // G92 stays until a reset.
    assert_eq!(interpreter.work_offset(), pose(0.0, 0.0, -76.2, 0.0));
    run(&mut interpreter, "G21").unwrap();
}

#[test]
fn a_reset_keeps_position_outputs_and_stored_offsets() {
    let mut interpreter = after(&[
        "G0 X10 Y20",
        "G10 L2 P1 X5",
        "G28.1",
        "G43.1 Z3",
        "G92 Y1",
        "G1 G20 G91 G55 G61 F100 M3 T1 S1",
        "M101",
    ]);
    let stored = interpreter.offsets().to_bytes();
    interpreter.reset();
    // A gripper must not open because a sender was reset, and the arm stays as it is.
    let mut fresh = after(&["M3", "M101"]);
    fresh.reset();
    fresh.set_position(Some(pose(10.0, 20.0, 0.0, 0.0)));
    assert_eq!(interpreter.modal(), fresh.modal());
    assert_eq!(interpreter.offsets().to_bytes(), stored);
    assert_eq!(interpreter.offsets().g92(), pose(0.0, 0.0, 0.0, 0.0));
    assert_eq!(interpreter.offsets().tool_length(), 0);
    assert_eq!(interpreter.work_offset(), pose(5.0, 0.0, 0.0, 0.0));
}

#[test]
fn the_robots_words_change_what_they_name() {
    let mut interpreter = after(&[]);
    let config = |kind, frequency_hz, damping| PrefilterConfig {
        kind,
        frequency_hz,
        damping,
        ..PrefilterConfig::default()
    };
    for (text, change) in [
        (
            "M100 P0",
            Some(RobotChange::Prefilter(config(Kind::None, 6.34, 0.022))),
        ),
        (
            "N5 M100 P1 Q12.5 R0.1",
            Some(RobotChange::Prefilter(config(Kind::Zv, 12.5, 0.1))),
        ),
        (
            "M100 Q8",
            Some(RobotChange::Prefilter(config(Kind::Zv, 8.0, 0.1))),
        ),
        ("M100 P1", None),
        ("M100", None),
        ("M102", Some(RobotChange::Elbow(Elbow::Right))),
        ("M101", Some(RobotChange::Elbow(Elbow::Left))),
        ("M102", Some(RobotChange::Elbow(Elbow::Right))),
    ] {
        let command = Command {
            robot: change,
            ..Command::default()
        };
        assert_eq!(run(&mut interpreter, text), Ok(command), "{text}");
    }
    for (place, kind) in Kind::ALL.into_iter().enumerate() {
        run(&mut interpreter, &format!("M100 P{place}")).unwrap();
        assert_eq!(interpreter.modal().prefilter().kind, kind);
    }
    run(&mut interpreter, "M101").unwrap();
    assert_eq!(interpreter.modal().elbow(), Elbow::Left);
    // New settings hold, whatever a program has said before.
    interpreter.set_defaults(Defaults {
        corner: CornerRule::OverlapPercent(30.0),
        ..DEFAULTS
    });
    assert_eq!(interpreter.modal().elbow(), Elbow::Right);
    assert_eq!(*interpreter.modal().prefilter(), DEFAULTS.prefilter);
    let corner = interpreter.modal().corner();
    assert_eq!(corner, CornerRule::OverlapPercent(30.0));
}

#[test]
fn the_first_point_declares_only_if_the_settings_say_so() {
    let mut interpreter = Interpreter::new(Defaults {
        first_point_declares: false,
        ..DEFAULTS
    });
    for text in ["G0 X1 Y2", "G53 X1 Y2", "G28"] {
        let error = run(&mut interpreter, text).unwrap_err();
        assert_eq!(error.code(), 62, "{text}");
    }
    interpreter.set_position(Some(pose(0.0, 0.0, 0.0, 0.0)));
    run_move(&mut interpreter, "G0 X1 Y2");
    // It counts from work zero, as any point does.
    let mut interpreter = after(&["G10 L2 P1 X10 Y20", "G43.1 Z5"]);
    let command = run(&mut interpreter, "G0 X1 Y2 Z3").unwrap();
    assert_eq!(command.reference, Some(pose(11.0, 22.0, 8.0, 0.0)));
}
