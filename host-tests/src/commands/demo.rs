//! `stillpoint` without arguments: the built-in corner path, in plain words.

use std::path::Path;

use anyhow::Result;
use planner_core::prefilter::Kind;

use super::output::{percent, write_files};
use crate::machine::Machine;
use crate::paired_run::PairedRun;
use crate::program_file::ProgramFile;
use crate::progress::Progress;
use crate::robot_file::RobotSettings;
use crate::scenario::{Outcome, Scenario};
use crate::trace::PlantKind;

/// Where the pictures go.
const DIRECTORY: &str = "stillpoint-out";

/// Runs the corner path with FIR-ZVD at 0.5 mm and says what came of it.
///
/// # Errors
/// The directory cannot be written.
pub fn execute() -> Result<String> {
    let mut settings = RobotSettings::load(None)?;
    settings.robot.prefilter.kind = Kind::FirZvd;
    settings.robot.corner_tolerance_mm = 0.5;
    let scenario = Scenario {
        program: ProgramFile::corner_path(),
        settings,
        plant: PlantKind::Full,
        machine: Machine::Host,
    };
    let run = PairedRun::run(&scenario, Progress::Shown)?;
    let files = write_files(Path::new(DIRECTORY), &run)?;
    let files: String = files
        .iter()
        .map(|file| format!("  {}\n", file.display()))
        .collect();
    Ok(format!(
        "{}\n\nLook at:\n{files}\n\
         Other programs: stillpoint run PROGRAM --out DIR; all commands: stillpoint --help",
        story(&run)
    ))
}

fn story(run: &PairedRun) -> String {
    let (figures, ratios) = (&run.summary.figures, &run.summary.ratios);
    let lower = |ratio: Option<f64>| percent(1.0 - ratio.unwrap_or(1.0));
    format!(
        "Stillpoint ran its built-in corner path, an arc and four lines at 160 mm/s, on a \
         simulated\nSCARA whose tool swings at 6.34 Hz, with the prefilter FIR-ZVD and corners \
         rounded by up to 0.5 mm.\n\n\
         Vibration:  {} lower at its maximum and {} lower in RMS than without a prefilter,\n            \
         {} lower after the stop.\n\
         Settling:   {}.\n            \
         Without a prefilter: {}.\n\
         Corners:    missed by {:.4} mm at the most.\n\
         Time:       {:.3} s; {:.3} s without a prefilter.",
        lower(ratios.vibration_max_ratio),
        lower(ratios.vibration_rms_ratio),
        lower(ratios.vibration_residual_ratio),
        settling(&run.outcome),
        settling(&run.unfiltered),
        figures.max_corner_error_mm.unwrap_or(f64::NAN),
        figures.cycle_time_s,
        run.unfiltered.cycle_time_s,
    )
}

fn settling(outcome: &Outcome) -> String {
    match outcome.settling_time_s {
        Some(0.0) => "the tool is within 50 µm of its place as soon as the command stops".into(),
        Some(seconds) if seconds < 1.0 => {
            format!("{:.0} ms after the commanded stop", 1000.0 * seconds)
        }
        Some(seconds) => format!("{seconds:.1} s after the commanded stop"),
        None => "more than a minute after the commanded stop".into(),
    }
}
