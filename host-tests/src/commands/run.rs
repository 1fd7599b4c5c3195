//! `stillpoint run`: one program, measured.

use std::fmt::Display;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use planner_core::config::Robot;
use planner_core::prefilter::Kind;

use super::output::{Figure, figures, write_files};
use super::{ScenarioArgs, prefilter_parser};
use crate::machine::Machine;
use crate::mode_use::axes_without_prefilter;
use crate::paired_run::PairedRun;
use crate::progress::Progress;
use crate::summary::Summary;

/// Arguments of `run`.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct RunArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Prefilter; the robot file's if there is none.
    #[arg(long, value_name = "NAME", value_parser = prefilter_parser(), ignore_case = true)]
    prefilter: Option<Kind>,
    /// Where the planner runs.
    #[arg(long, value_enum, default_value_t)]
    on: Machine,
    /// Directory for trace.csv, summary.json and the pictures.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the summary as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// Whatever stops the program from running to its end, in one sentence.
pub fn execute(args: &RunArgs) -> Result<String> {
    let mut scenario = args.scenario.scenario()?;
    scenario.machine = args.on;
    if let Some(prefilter) = args.prefilter {
        scenario.settings.robot.prefilter.kind = prefilter;
    }
    let progress = if args.json {
        Progress::Hidden
    } else {
        Progress::Shown
    };
    let run = PairedRun::run(&scenario, progress)?;
    if let Err(error) = &run.outcome.checked {
        eprintln!(
            "stillpoint: {}: the checker cannot judge this program ({error}), so corner errors \
             and path deviation are left out",
            scenario.program.name
        );
    }
    let files = match &args.out {
        Some(directory) => write_files(directory, &run)?,
        None => Vec::new(),
    };
    if args.json {
        return run.summary.json();
    }
    let mut lines = vec![headline(&run.summary)];
    let robot = Robot::new(&scenario.settings.robot)?;
    let row = |name: &str, value: &dyn Display| format!("  {name:22} {value}");
    if let Some(follower) = &robot.follower {
        lines.push(row("prefilters", follower));
        let chosen = run.summary.prefilters_chosen.iter();
        lines.extend(chosen.map(|one| row("", one)));
    }
    if robot.config.prefilter.chooses_axes() || run.summary.modes.len() > 1 {
        let modes = ["first mode", "second mode"]
            .into_iter()
            .zip(&run.summary.modes);
        lines.extend(modes.map(|(name, mode)| row(name, mode)));
        lines.extend(axes_without_prefilter(&robot).into_iter().map(|axis| {
            let name = format!("along {axis} alone");
            row(
                &name,
                &"no prefilter: its velocity jumps, unless smoothing1_ms gives it a box",
            )
        }));
    }
    for Figure { name, value } in figures(&run.summary) {
        lines.push(row(name, &value));
    }
    for file in files {
        lines.push(format!("wrote {}", file.display()));
    }
    Ok(lines.join("\n"))
}

fn headline(summary: &Summary) -> String {
    format!(
        "{}: {}, corner tolerance {} mm, {} plant, on the {}",
        summary.program,
        summary.prefilter_in_words(),
        summary.tolerance_mm,
        summary.plant,
        summary.on,
    )
}
