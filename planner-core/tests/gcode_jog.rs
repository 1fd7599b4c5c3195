//! Jogs: what follows `$J=`.

mod support;

use planner_core::corner::CornerRule;
use planner_core::gcode::{Command, Error, Feed, Interpreter, Line};
use support::{after, pose};

fn jog(interpreter: &mut Interpreter, text: &str) -> Result<Command, Error> {
    let line = Line::parse(text.as_bytes())?;
    let interpreted = interpreter.jog(&line)?;
    interpreter.commit(&interpreted);
    Ok(interpreted.command)
}

#[test]
fn jogs_move_and_leave_the_modes_alone() {
    let before = after(&["G0 X10 Y20", "G10 L2 P1 X1 Y2", "G20 G91 G93 G61"]);
    for (text, target, feed) in [
        ("X5F600", pose(137.0, 20.0, 0.0, 0.0), 254.0),
        ("G21 X5 F600", pose(15.0, 20.0, 0.0, 0.0), 10.0),
        ("G21 G90 X5 F600", pose(6.0, 20.0, 0.0, 0.0), 10.0),
        ("G21 G91 G53 X5 Y1 F600", pose(5.0, 1.0, 0.0, 0.0), 10.0),
        ("G21 Z-3 C45 F60 N7", pose(10.0, 20.0, -3.0, 45.0), 1.0),
        ("C90 F60", pose(10.0, 20.0, 0.0, 90.0), 1.0),
    ] {
        let mut interpreter = before.clone();
        let command = jog(&mut interpreter, text).unwrap();
        let motion = command.motion.unwrap();
        assert_eq!(motion.path.start, pose(10.0, 20.0, 0.0, 0.0), "{text}");
        assert_eq!(motion.path.target, target, "{text}");
        assert_eq!(motion.feed, Feed::MmPerS(feed), "{text}");
        assert_eq!(motion.line, if text.contains('N') { 7 } else { 0 });
        assert_eq!(motion.corner, CornerRule::EXACT_STOP);
        assert_eq!(interpreter.modal().position(), Some(target), "{text}");
        interpreter.set_position(before.modal().position());
        assert_eq!(interpreter.modal(), before.modal(), "{text}");
        assert_eq!(interpreter.offsets(), before.offsets(), "{text}");
    }
    let mut interpreter = before;
    let nothing = jog(&mut interpreter, "X0 F100");
    assert_eq!(nothing, Ok(Command::default()));
}

#[test]
fn wrong_jogs_have_their_codes() {
    const AT: &[&str] = &["G0 X10 Y20", "G1 F100"];
    for (before, text, code) in [
        (AT, "X4095 F100", 0),
        (AT, "X4096 F100", 15),
        (AT, "G91 X4090 F100", 15),
        (AT, "G91 C-1441 F100", 15),
        (AT, "G0 X1 F100", 16),
        (AT, "G1 X1 F100", 16),
        (AT, "G54 X1 F100", 16),
        (AT, "G28 X1 F100", 16),
        (AT, "G92 X1 F100", 16),
        (AT, "G4 P1 X1 F100", 16),
        (AT, "G10 L2 P1 X1 F100", 16),
        (AT, "G94 X1 F100", 16),
        (AT, "G64 X1 F100", 16),
        (AT, "M3 X1 F100", 16),
        (AT, "M101 F100", 16),
        (AT, "X1 F100 S1", 16),
        (AT, "X1 F100 T1", 16),
        (AT, "X1 F100 P1", 16),
        (AT, "X1 I1 F100", 16),
        (AT, "X1", 22),
        (AT, "X1 F0", 22),
        (AT, "F100", 26),
        (AT, "", 22),
        (AT, "X1 F-1", 4),
        (AT, "X1 X2 F1", 25),
        (AT, "G20 G21 X2 F1", 21),
        (AT, "G38.2 X1 F1", 20),
        (AT, "A1 F1", 20),
        (AT, "X1 F1 N99999999", 27),
        (AT, "G91.1.1", 2),
        (&[], "X1 Y1 F100", 62),
    ] {
        let mut interpreter = after(before);
        let modal = *interpreter.modal();
        let result = jog(&mut interpreter, text);
        let found = result.map_or_else(Error::code, |_| 0);
        assert_eq!(found, code, "{text}: {result:?}");
        if code != 0 {
            assert_eq!(*interpreter.modal(), modal, "{text}");
        }
    }
}
