//! The fastest hop that keeps the payload within a limit, by search.
//!
//! A payload's swing does not grow evenly with the acceleration: unshaped, it vanishes wherever
//! the motion lasts a whole number of its periods, and its frequency is known to some percent
//! only. An acceleration therefore counts as within a limit only if all lower ones of the grid
//! are.

use anyhow::{Result, ensure};
use planner_core::config::Robot;
use planner_core::hop::HopAxes;
use serde::Serialize;

use crate::machine::Machine;
use crate::plant::PayloadConfig;
use crate::progress::Progress;
use crate::scenario::Scenario;
use crate::summary::PayloadFigures;
use crate::trace::Trace;

/// The grid of accelerations in mm/s², each a twentieth above the one before.
const SLOWEST_MM_S2: f32 = 500.0;
const FASTEST_MM_S2: f32 = 60_000.0;
const STEP: f32 = 1.05;

/// What the payload must not exceed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// The acceleration at which it peels off the gripper.
    PeelOff,
    /// How far it may be from its place after the stop.
    Overshoot,
}

impl Limit {
    /// Both.
    pub const ALL: [Self; 2] = [Self::PeelOff, Self::Overshoot];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PeelOff => "peel-off",
            Self::Overshoot => "overshoot",
        }
    }

    fn is_kept(self, config: &PayloadConfig, run: &HopRun) -> bool {
        match self {
            Self::PeelOff => run.payload_acceleration_max_mm_s2 <= config.peel_off_mm_s2,
            Self::Overshoot => run.payload_overshoot_max_mm <= config.overshoot_limit_mm,
        }
    }
}

/// A program run with one acceleration of its hops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HopRun {
    /// The acceleration.
    pub acceleration_mm_s2: f32,
    /// Duration of the commanded motion.
    pub cycle_time_s: f64,
    /// Largest acceleration of the payload.
    pub payload_acceleration_max_mm_s2: f64,
    /// How far it swings, at the most.
    pub payload_swing_max_mm: f64,
    /// How far it is from its place after the stop, at the most.
    pub payload_overshoot_max_mm: f64,
}

/// The fastest run within a limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fastest {
    /// What the payload keeps.
    pub limit: Limit,
    /// Which axes are prefiltered: none, across, all.
    pub axes: &'static str,
    /// The run; null if not even the slowest acceleration of the search keeps the limit.
    #[serde(flatten)]
    pub run: Option<HopRun>,
}

/// Runs the program's hops on axes prefiltered so, with an acceleration.
///
/// # Errors
/// Settings or lines that are refused, or a robot without a payload.
pub fn run(scenario: &Scenario, axes: HopAxes, acceleration_mm_s2: f32) -> Result<HopRun> {
    let mut settings = scenario.settings.robot;
    settings.hop.axes = axes;
    settings.hop.acceleration_mm_s2 = acceleration_mm_s2;
    let robot = Robot::new(&settings)?;
    let recording = Machine::Host.record(&robot, &scenario.program.text, Progress::Hidden)?;
    let plant = &scenario.settings.plant;
    let trace = Trace::simulate(
        &recording.setpoints,
        scenario.plant,
        plant,
        Progress::Hidden,
    );
    let figures = PayloadFigures::new(&trace, plant.payload.as_ref());
    let (Some(acceleration), Some(swing), Some(overshoot)) = (
        figures.payload_acceleration_max_mm_s2,
        figures.payload_swing_max_mm,
        figures.payload_overshoot_max_mm,
    ) else {
        anyhow::bail!("the robot has no payload: give it a table [plant.payload]");
    };
    let (start, stop) = (trace.start(), trace.stop());
    Ok(HopRun {
        acceleration_mm_s2,
        cycle_time_s: Trace::time_s(stop) - Trace::time_s(start.min(stop)),
        payload_acceleration_max_mm_s2: acceleration,
        payload_swing_max_mm: swing,
        payload_overshoot_max_mm: overshoot,
    })
}

/// The fastest runs within either limit, on axes prefiltered so, in the order of [`Limit::ALL`].
///
/// # Errors
/// As [`run`]; also if the program itself says how fast its hops are.
pub fn fastest(scenario: &Scenario, axes: HopAxes) -> Result<[Fastest; 2]> {
    ensure!(
        scenario.hops().iter().all(|hop| !hop.sets_acceleration),
        "the program sets the acceleration of its hops itself: leave out the K of M103 to search for the fastest"
    );
    let Some(config) = scenario.settings.plant.payload else {
        anyhow::bail!("the robot has no payload: give it a table [plant.payload]");
    };
    let mut found = Limit::ALL.map(|limit| Fastest {
        limit,
        axes: axes.name(),
        run: None,
    });
    let mut open = [true; 2];
    let mut acceleration_mm_s2 = SLOWEST_MM_S2;
    while open.contains(&true) && acceleration_mm_s2 <= FASTEST_MM_S2 {
        let run = run(scenario, axes, acceleration_mm_s2)?;
        for (fastest, open) in found.iter_mut().zip(&mut open) {
            *open &= fastest.limit.is_kept(&config, &run);
            if *open {
                fastest.run = Some(run);
            }
        }
        acceleration_mm_s2 *= STEP;
    }
    Ok(found)
}
