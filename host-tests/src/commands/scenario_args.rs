//! Arguments that `run` and `compare` share.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::CascadeArgs;
use crate::machine::Machine;
use crate::program_file::ProgramFile;
use crate::robot_file::RobotSettings;
use crate::scenario::Scenario;
use crate::trace::PlantKind;

/// A program and the robot that runs it; flags override the robot's file.
#[derive(Args, Debug)]
pub struct ScenarioArgs {
    /// G-code file: millimetres, mm/min; it starts at its first G0 or G1 point.
    program: PathBuf,
    /// Robot file (TOML); the SCARA of 200 and 150 mm if there is none.
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// Natural frequency that the prefilter is made for.
    #[arg(long, value_name = "HZ")]
    frequency: Option<f32>,
    /// Damping ratio that the prefilter is made for.
    #[arg(long, value_name = "Z")]
    damping: Option<f32>,
    #[command(flatten)]
    cascade: CascadeArgs,
    /// Corner tolerance where the program sets none; 0 stops at corners.
    #[arg(long, value_name = "MM")]
    tolerance: Option<f32>,
    /// Which simulated robot answers; its own mode comes from the robot file.
    #[arg(long, value_enum, default_value_t)]
    plant: PlantKind,
}

impl ScenarioArgs {
    /// Reads the files and applies the flags.
    ///
    /// # Errors
    /// A file that cannot be used, or a flag out of its range.
    pub fn scenario(&self) -> Result<Scenario> {
        let mut settings = RobotSettings::load(self.robot.as_deref())?;
        let robot = &mut settings.robot;
        let flags = [
            (&mut robot.prefilter.frequency_hz, self.frequency),
            (&mut robot.prefilter.damping, self.damping),
            (&mut robot.corner_tolerance_mm, self.tolerance),
        ];
        for (setting, flag) in flags {
            *setting = flag.unwrap_or(*setting);
        }
        self.cascade.apply(&mut robot.prefilter)?;
        Ok(Scenario {
            program: ProgramFile::load(&self.program)?,
            settings,
            plant: self.plant,
            machine: Machine::Host,
        })
    }
}
