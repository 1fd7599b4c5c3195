//! G-code from text to commands: what every line does, and what every wrong line is called.

use planner_core::gcode::{
    Command, Defaults, Distance, Error, Feed, Interpreter, Line, Motion, Move, Units,
};
use planner_core::path::{PathSegment, Shape};
use planner_core::pose::Pose;
use planner_core::units::LengthMm;

const DEFAULTS: Defaults = Defaults {
    corner_tolerance_mm: 0.25,
};

/// Executes one line and commits it.
fn run(interpreter: &mut Interpreter, text: &str) -> Result<Command, Error> {
    let line = Line::parse(text.as_bytes())?;
    let (modal, command) = interpreter.interpret(&line)?;
    interpreter.commit(modal);
    Ok(command)
}

/// An interpreter after a program of good lines.
fn after(lines: &[&str]) -> Interpreter {
    let mut interpreter = Interpreter::new(DEFAULTS);
    for line in lines {
        run(&mut interpreter, line).unwrap_or_else(|error| panic!("{line}: {error}"));
    }
    interpreter
}

fn run_move(interpreter: &mut Interpreter, text: &str) -> Move {
    match run(interpreter, text) {
        Ok(Command::Move(motion)) => motion,
        other => panic!("{text}: {other:?}"),
    }
}

fn pose(x: f64, y: f64, z: f64, c: f64) -> Pose {
    let [x, y, z, c] = [x, y, z, c].map(LengthMm::from_num);
    Pose { x, y, z, c }
}

#[test]
fn every_wrong_line_has_its_code() {
    const RAPID: &[&str] = &["G0 X10 Y0"];
    const LINEAR: &[&str] = &["G0 X10 Y0", "G1 F600"];
    const ARC: &[&str] = &["G0 X10 Y0", "F600"];
    const G80: &[&str] = &["G0 X10 Y0", "G80"];
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
        (RAPID, "G10 L2 P1 X0", 20),
        (RAPID, "G18", 20),
        (RAPID, "G19", 20),
        (RAPID, "G28", 20),
        (RAPID, "G38.2 Z-1 F10", 20),
        (RAPID, "G41", 20),
        (RAPID, "G43.1 Z1", 20),
        (RAPID, "G53 G0 X1", 20),
        (RAPID, "G61.1", 20),
        (RAPID, "G90.1", 20),
        (RAPID, "G91.2", 20),
        (RAPID, "G92 X0", 20),
        (RAPID, "G93", 20),
        (RAPID, "G256", 20),
        (RAPID, "G-1", 20),
        (RAPID, "M10", 20),
        (RAPID, "M110", 20),
        (RAPID, "G0 X1 A1", 20),
        (RAPID, "G0 X1 B1", 20),
        (RAPID, "G0 X1 U1", 20),
        (RAPID, "G1 X1 E5", 20),
        (RAPID, "X1E5", 20),
        (RAPID, "O100", 20),
        (RAPID, "G0 G1 X1", 21),
        (RAPID, "G0 G0 X1", 21),
        (RAPID, "G0 G80", 21),
        (RAPID, "G20 G21", 21),
        (RAPID, "G90 G91", 21),
        (RAPID, "G61 G64", 21),
        (RAPID, "M0 M30", 21),
        (RAPID, "M3 M5", 21),
        (RAPID, "M7 M9", 21),
        (RAPID, "G1 X1", 22),
        (RAPID, "G1", 22),
        (RAPID, "G1 X1 F0", 22),
        (RAPID, "G2 X1 R5", 22),
        (RAPID, "G1.5", 23),
        (RAPID, "G17.05", 23),
        (RAPID, "G59.1", 23),
        (RAPID, "M3.1", 23),
        (RAPID, "G49 G0 X1", 24),
        (RAPID, "G49 X1", 24),
        (RAPID, "X1 X1", 25),
        (RAPID, "F1 F1", 25),
        (ARC, "G2", 26),
        (ARC, "G2 I5", 26),
        (RAPID, "N10000001", 27),
        (RAPID, "G4", 28),
        (RAPID, "G55", 29),
        (RAPID, "G59", 29),
        (G80, "X1", 31),
        (G80, "G80 C1", 31),
        (ARC, "G2 Z1 I1", 32),
        (ARC, "G2 C1 I1", 32),
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
        (RAPID, "T256", 38),
        (RAPID, "X9999999999", 60),
        (RAPID, "G20 X99999999", 60),
        (RAPID, "X4095.000000001", 61),
        (RAPID, "Y-4096", 61),
        (RAPID, "Z999999999", 61),
        (RAPID, "C1440.1", 61),
        (RAPID, "G91 X4090", 61),
        (RAPID, "G20 X161.3", 61),
        (&[], "G0 X1", 62),
        (&[], "G0 Y1", 62),
        (&[], "G0 Z1", 62),
        (&[], "G91 G0 X1 Y1", 62),
        (&[], "G2 X1 Y1 R1 F1", 62),
        (RAPID, "G0 X1*0", 63),
        (RAPID, "G4 P1 X1", 65),
        (RAPID, "X1 M30", 65),
        (RAPID, "G4 P1 M0", 65),
        (RAPID, "G4 P1 G64", 65),
    ] {
        let mut interpreter = after(before);
        let modal = *interpreter.modal();
        match run(&mut interpreter, text) {
            Err(error) => assert_eq!(error.code(), code, "{text}: {error}"),
            Ok(command) => panic!("{text}: {command:?} instead of error {code}"),
        }
        assert_eq!(*interpreter.modal(), modal, "{text}");
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
        "M3 S1000",
        "M4",
        "M5 M9",
        "M6 T1",
        "M7",
        "M8",
        "T255",
        "G1 F100",
        "X10 Y0",
        "G1 F100 X10",
    ] {
        let mut interpreter = after(&["G0 X10 Y0"]);
        assert_eq!(run(&mut interpreter, text), Ok(Command::Nothing), "{text}");
        let position = interpreter.modal().position();
        assert_eq!(position, Some(pose(10.0, 0.0, 0.0, 0.0)));
    }
    let interpreter = after(&["G20 G91 G1 F1 G61"]);
    let modal = interpreter.modal();
    assert_eq!(modal.motion(), Motion::Linear);
    assert_eq!(modal.units(), Units::Inches);
    assert_eq!(modal.distance(), Distance::Incremental);
    assert_eq!(modal.feed_mm_per_min(), Some(25.4));
    assert_eq!(modal.corner_tolerance_mm(), 0.0);
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
        let command = run(&mut interpreter, text);
        assert_eq!(command, Ok(Command::Reference(expected)), "{text}");
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
        run(&mut interpreter, "g1 x20 y-5 z1.5 c45 f9600 (go)"),
        Ok(Command::Move(Move {
            path: PathSegment {
                start: pose(10.0, 0.0, 0.0, 0.0),
                target: pose(20.0, -5.0, 1.5, 45.0),
                shape: Shape::Line,
            },
            feed: Feed::MmPerS(160.0),
            corner_tolerance_mm: 0.25,
            line: 2,
        }))
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
fn the_corner_tolerance_is_that_of_the_moves_start() {
    let mut interpreter = after(&["G0 X0 Y0"]);
    for (text, expected) in [
        ("X1", 0.25),
        ("G61 X2", 0.0),
        ("X3", 0.0),
        ("G64 P0.5 X4", 0.5),
        ("G20 G64 P1 X5", 25.4),
        ("G64 X6", 0.25),
        ("G64 P0 X7", 0.0),
    ] {
        let motion = run_move(&mut interpreter, text);
        assert_eq!(motion.corner_tolerance_mm, expected, "{text}");
    }
}

#[test]
fn dwell_pause_and_end() {
    let mut interpreter = after(&["G0 X10 Y0", "G91 G61 G20 F1", "G1"]);
    let dwell = Command::Dwell { seconds: 0.1 };
    assert_eq!(run(&mut interpreter, "G4 P.1"), Ok(dwell));
    assert_eq!(run(&mut interpreter, "M0"), Ok(Command::Pause));
    assert_eq!(run(&mut interpreter, "M30"), Ok(Command::End));
    let modal = *interpreter.modal();
    assert_eq!(modal.motion(), Motion::Linear);
    assert_eq!(modal.distance(), Distance::Absolute);
    assert_eq!(modal.corner_tolerance_mm(), 0.25);
    assert_eq!(modal.units(), Units::Inches);
    assert_eq!(modal.feed_mm_per_min(), Some(25.4));
    assert_eq!(modal.position(), Some(pose(10.0, 0.0, 0.0, 0.0)));
    assert_eq!(run_move(&mut interpreter, "X1").line, 1);
    assert_eq!(run(&mut interpreter, "M2"), Ok(Command::End));
}

#[test]
fn nothing_changes_before_commit() {
    let mut interpreter = after(&["G0 X10 Y0"]);
    let before = *interpreter.modal();
    let line = Line::parse(b"G91 G20 G61 G1 X1 F100").unwrap();
    let first = interpreter.interpret(&line).unwrap();
    assert_eq!(*interpreter.modal(), before);
    assert_eq!(interpreter.interpret(&line), Ok(first));
    interpreter.commit(first.0);
    assert_eq!(*interpreter.modal(), first.0);
    assert_ne!(first.0, before);
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
