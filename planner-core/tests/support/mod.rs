//! Running lines of G-code.

// Each test file uses its part.
#![allow(dead_code)]

use planner_core::corner::CornerRule;
use planner_core::gcode::{Command, Defaults, Error, Interpreter, Line, Move};
use planner_core::kinematics::Elbow;
use planner_core::pose::Pose;
use planner_core::prefilter::{Kind, PrefilterConfig};
use planner_core::units::LengthMm;

/// Settings that differ from those of [`Defaults::default`].
pub const DEFAULTS: Defaults = Defaults {
    corner: CornerRule::ToleranceMm(0.25),
    prefilter: PrefilterConfig {
        kind: Kind::FirZvd,
        frequency_hz: 6.34,
        damping: 0.022,
        ..PrefilterConfig::DEFAULT
    },
    elbow: Elbow::Right,
    first_point_declares: true,
};

/// Executes one line and commits it.
pub fn run(interpreter: &mut Interpreter, text: &str) -> Result<Command, Error> {
    let line = Line::parse(text.as_bytes())?;
    let interpreted = interpreter.interpret(&line)?;
    interpreter.commit(&interpreted);
    Ok(interpreted.command)
}

/// An interpreter after a program of good lines.
pub fn after(lines: &[&str]) -> Interpreter {
    let mut interpreter = Interpreter::new(DEFAULTS);
    for line in lines {
        run(&mut interpreter, line).unwrap_or_else(|error| panic!("{line}: {error}"));
    }
    interpreter
}

/// Executes a line that does nothing but move.
pub fn run_move(interpreter: &mut Interpreter, text: &str) -> Move {
    match run(interpreter, text) {
        Ok(
            command @ Command {
                motion: Some(motion),
                ..
            },
        ) => {
            let alone = Command {
                motion: Some(motion),
                ..Command::default()
            };
            assert_eq!(command, alone, "{text}");
            motion
        }
        other => panic!("{text}: {other:?}"),
    }
}

pub fn pose(x: f64, y: f64, z: f64, c: f64) -> Pose {
    let [x, y, z, c] = [x, y, z, c].map(LengthMm::from_num);
    Pose { x, y, z, c }
}
