//! Where the planner runs: in this process, or as firmware on an emulated board.

use anyhow::{Context, Result, ensure};
use planner_core::config::{Robot, RobotConfig};
use planner_core::motion::Setpoint;
use planner_core::pose::AXES;
use planner_core::protocol::SETTINGS;
use planner_core::servo::{GAINS, ServoConfig};

use crate::emulator::{Board, Emulator, build_image, check_qemu};
use crate::progress::Progress;
use crate::software_loop;

/// Longest motion that is recorded, in ticks: an hour, some 300 MB.
const LONGEST_TICKS: usize = 3_600_000;

/// Where the planner runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Machine {
    /// In this process.
    #[default]
    Host,
    /// As firmware on an emulated Cortex-M4F.
    Emulator,
}

impl Machine {
    /// The name by which the command line calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Host => "host",
            Self::Emulator => "emulator",
        }
    }

    /// Runs a program to its end.
    ///
    /// # Errors
    /// The line that is refused, before anything moves; a motion of more than an hour.
    pub fn record(self, robot: &Robot, program: &str, progress: Progress) -> Result<Recording> {
        match self {
            Self::Host => record_on_host(robot, program, progress),
            Self::Emulator => record_on_emulator(robot, program, progress),
        }
    }
}

/// What a machine sent to the drives.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// One setpoint a tick, from the program's first point at rest to its end at rest.
    pub setpoints: Vec<Setpoint>,
    /// Instructions of the dearest tick; the host does not count.
    pub tick_instructions_max: Option<u32>,
}

fn record_on_host(robot: &Robot, program: &str, progress: Progress) -> Result<Recording> {
    let bar = progress.counter("planner and tick");
    let mut setpoints = Vec::new();
    let mut ticks = 0_usize;
    software_loop::run(robot, program, |setpoint| {
        ticks += 1;
        if ticks <= LONGEST_TICKS {
            setpoints.push(*setpoint);
        }
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    ensure!(
        ticks <= LONGEST_TICKS,
        "the program moves for {} s, more than the hour that is recorded: split it",
        ticks / 1000
    );
    Ok(Recording {
        setpoints,
        tick_instructions_max: None,
    })
}

fn record_on_emulator(robot: &Robot, program: &str, progress: Progress) -> Result<Recording> {
    software_loop::check(robot, program)?;
    check_qemu()?;
    let bar = progress.counter("firmware in the emulator");
    let images = build_image(Board::Mps2An386)?;
    let image = images.first().context("the build made no image")?;
    let lines: Vec<&str> = program.lines().collect();
    let run = Emulator::start(image)?.run_program(&settings(&robot.config), &lines)?;
    bar.finish_and_clear();
    ensure!(
        run.overruns == 0 && run.starved == 0,
        "the emulated board missed {} ticks and ran out of path {} times: run it again on a less busy machine",
        run.overruns,
        run.starved
    );
    Ok(Recording {
        setpoints: run.setpoints.iter().map(|frame| frame.setpoint).collect(),
        tick_instructions_max: Some(run.worst_tick_instructions),
    })
}

/// The lines that give a controller the gains of its drives' servos, without their `$`.
#[must_use]
pub fn servo_settings(servos: &[ServoConfig; AXES]) -> Vec<String> {
    let servo_rows = SETTINGS.iter().filter(|row| row.name.starts_with("servo"));
    let rows: Vec<_> = servo_rows.collect();
    let lines = rows.chunks(GAINS.len()).zip(servos).map(|(rows, servo)| {
        let mut gains = servo.gains;
        let pairs = rows.iter().zip(gains.values());
        let pairs = pairs.map(|(row, value)| format!("{}={value}", row.name));
        pairs.collect::<Vec<_>>().join(" ")
    });
    lines.collect()
}

/// The lines that give a controller these settings, without their `$`; one line holds those
/// that must fit each other.
#[must_use]
pub fn settings(config: &RobotConfig) -> Vec<String> {
    let line = |group: &[&str]| {
        let pairs = group.iter().filter_map(|name| {
            let value = config.value(name)?;
            Some(format!("{name}={value}"))
        });
        pairs.collect::<Vec<_>>().join(" ")
    };
    let map = (0..).map_while(|line| config.map.line(line));
    let map = map.map(|line| line.to_string());
    RobotConfig::GROUPS
        .into_iter()
        .map(line)
        .chain(map)
        .collect()
}
