//! A run beside the same run without a prefilter.

use anyhow::Result;
use planner_core::config::RobotConfig;
use planner_core::prefilter::Kind;

use crate::plant::PayloadConfig;
use crate::progress::Progress;
use crate::scenario::{Outcome, Scenario};
use crate::summary::Summary;

/// A run and the same without a prefilter.
#[derive(Clone, Debug)]
pub struct PairedRun {
    /// The run.
    pub outcome: Outcome,
    /// Without a prefilter, always on the host.
    pub unfiltered: Outcome,
    /// The run's figures.
    pub summary: Summary,
    /// What swings under the tool, if anything does.
    pub payload: Option<PayloadConfig>,
    /// The robot's settings.
    pub robot: RobotConfig,
}

impl PairedRun {
    /// Runs a scenario, and once more without a prefilter.
    ///
    /// # Errors
    /// Whatever stops the program from running to its end.
    pub fn run(scenario: &Scenario, progress: Progress) -> Result<Self> {
        let outcome = scenario.run(progress)?;
        let unfiltered = match outcome.prefilter {
            Kind::None => outcome.clone(),
            _ => scenario.run_with(Kind::None, progress)?,
        };
        let summary = Summary::new(scenario, &outcome, &unfiltered);
        Ok(Self {
            outcome,
            unfiltered,
            summary,
            payload: scenario.settings.plant.payload,
            robot: scenario.settings.robot,
        })
    }
}
