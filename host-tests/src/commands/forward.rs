//! `stillpoint forward`: from the joints to a pose.

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use fixed::types::{I6F26, I13F19};
use planner_core::config::Robot;
use planner_core::kinematics::{JointRange, PoseError};
use planner_core::pose::{Joint3, JointPosition, JointUnit};
use serde::Serialize;

use super::inverse::finite;
use crate::robot_file::RobotSettings;

/// Arguments of `forward`.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct ForwardArgs {
    /// Joint 1 in degrees.
    joint1: f64,
    /// Joint 2 in degrees.
    joint2: f64,
    /// Joint 3 in mm; a delta's in degrees.
    joint3: f64,
    /// Joint 4 in degrees.
    joint4: f64,
    /// Robot file (TOML); the SCARA of 200 and 150 mm if there is none.
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Place {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    c_deg: f64,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// A joint beyond its travel, in one sentence.
pub fn execute(args: &ForwardArgs) -> Result<String> {
    let robot = Robot::new(&RobotSettings::load(args.robot.as_deref())?.robot)?;
    let units = robot.arm.kind().joint_units();
    let joints = [args.joint1, args.joint2, args.joint3, args.joint4];
    let limits = robot.config.joint_limits();
    for (((joint, value), unit), limits) in (1..).zip(joints).zip(units).zip(limits) {
        let value = finite(&format!("joint {joint}"), value)?;
        within(joint, value, unit, limits)?;
    }
    let angle = |degrees: f64| {
        I6F26::checked_from_num(degrees.to_radians())
            .ok_or_else(|| anyhow!("{degrees}° leaves the number range: keep within ±1800°"))
    };
    let joint3 = match units[2] {
        JointUnit::Angle => Joint3::from_angle(angle(args.joint3)?),
        JointUnit::Length => Joint3::from_length(
            I13F19::checked_from_num(args.joint3)
                .ok_or_else(|| anyhow!("{} mm leaves the number range", args.joint3))?,
        ),
    };
    let pose = robot.arm.forward(&JointPosition {
        joint1: angle(args.joint1)?,
        joint2: angle(args.joint2)?,
        joint3,
        joint4: angle(args.joint4)?,
    });
    let place = Place {
        x_mm: pose.x.to_num(),
        y_mm: pose.y.to_num(),
        z_mm: pose.z.to_num(),
        c_deg: pose.c.to_num(),
    };
    if args.json {
        return Ok(serde_json::to_string(&place)?);
    }
    let lines = [
        format!("X {:.6} mm", place.x_mm),
        format!("Y {:.6} mm", place.y_mm),
        format!("Z {:.6} mm", place.z_mm),
        format!("C {:.6}°", place.c_deg),
    ];
    Ok(lines.join("\n"))
}

/// A joint's travel; half a unit of its format beyond is its end.
fn within(
    joint: u8,
    value: f64,
    unit: JointUnit,
    JointRange { min, max }: JointRange,
) -> Result<(), PoseError> {
    const HALF_UNIT: f64 = 1e-6;
    if (f64::from(min) - HALF_UNIT..=f64::from(max) + HALF_UNIT).contains(&value) {
        return Ok(());
    }
    Err(PoseError::JointLimit {
        joint,
        value: value as f32,
        min,
        max,
        unit,
    })
}
