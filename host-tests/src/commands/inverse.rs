//! `stillpoint inverse`: from a pose to the joints.

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::{Args, ValueEnum};
use fixed::types::I13F19;
use planner_core::config::Robot;
use planner_core::kinematics::{ArmKind, Elbow};
use planner_core::pose::{JointUnit, Pose};
use serde::Serialize;

use crate::robot_file::RobotSettings;

/// Arguments of `inverse`.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct InverseArgs {
    /// X in mm.
    x: f64,
    /// Y in mm.
    y: f64,
    /// Z in mm.
    z: f64,
    /// Yaw in degrees.
    c: f64,
    /// Robot file (TOML); the SCARA of 200 and 150 mm if there is none.
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// Side of the elbow; the robot file's if there is none.
    #[arg(long, value_enum)]
    elbow: Option<ElbowArg>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// The elbow on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum ElbowArg {
    /// Joint 2 negative.
    Left,
    /// Joint 2 positive.
    Right,
}

#[derive(Serialize)]
struct Joints {
    joint1: f64,
    joint2: f64,
    joint3: f64,
    joint4: f64,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// A pose that the arm cannot take, in one sentence.
pub fn execute(args: &InverseArgs) -> Result<String> {
    let mut config = RobotSettings::load(args.robot.as_deref())?.robot;
    if let Some(elbow) = args.elbow {
        if config.arm == ArmKind::Delta {
            return Err(anyhow!(
                "a delta robot has no elbow side: leave out --elbow"
            ));
        }
        config.scara.elbow = match elbow {
            ElbowArg::Left => Elbow::Left,
            ElbowArg::Right => Elbow::Right,
        };
    }
    let robot = Robot::new(&config)?;
    let pose = Pose {
        x: coordinate("X", args.x)?,
        y: coordinate("Y", args.y)?,
        z: coordinate("Z", args.z)?,
        c: coordinate("C", args.c)?,
    };
    let joints = robot.arm.check(&pose)?;
    let units = robot.arm.kind().joint_units();
    let mut values = joints.values(units);
    for (value, unit) in values.iter_mut().zip(units) {
        if unit == JointUnit::Angle {
            *value = value.to_degrees();
        }
    }
    let [joint1, joint2, joint3, joint4] = values;
    let joints = Joints {
        joint1,
        joint2,
        joint3,
        joint4,
    };
    if args.json {
        return Ok(serde_json::to_string(&joints)?);
    }
    let lines = [
        format!("joint1 {:.6}°", joints.joint1),
        format!("joint2 {:.6}°", joints.joint2),
        format!("joint3 {:.6}{}", joints.joint3, units[2].sign()),
        format!("joint4 {:.6}°", joints.joint4),
    ];
    Ok(lines.join("\n"))
}

/// A coordinate in the tick's format.
fn coordinate(name: &str, value: f64) -> Result<I13F19> {
    I13F19::checked_from_num(finite(name, value)?)
        .ok_or_else(|| anyhow!("{name} of {value} leaves the number range: keep within ±4095"))
}

/// Refuses what is no number.
pub(super) fn finite(name: &str, value: f64) -> Result<f64> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(anyhow!("{name} is {value}: give a number"))
    }
}
