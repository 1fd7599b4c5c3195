//! What is compared: the same measurements for every method.

use anyhow::{Context, Result};
use serde::Serialize;

use super::{Point, STEP_S, Task};
use crate::checker::{joint_peaks, matching::distance_to_chord};
use crate::plant::IdealPlant;
use crate::vibration::{Vibration, moving_samples};

/// Time recorded after the stop, in samples.
const REST: usize = 3000;

/// Figures of a command, sampled every [`STEP_S`].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Figures {
    /// From start to rest of the command.
    pub cycle_time_s: f64,
    /// Largest tool acceleration after the command has stopped, mm/s².
    pub residual_mm_s2: f64,
    /// Largest miss of a corner, mm.
    pub corner_error_mm: f64,
    /// Largest acceleration of joint 1 or 2, rad/s².
    pub joint_acceleration_rad_s2: f64,
}

impl Figures {
    /// Measures a command.
    ///
    /// # Errors
    /// It leaves the arm's reach.
    pub fn of(task: &Task, command: &[Point]) -> Result<Self> {
        let start = command.first().copied().unwrap_or_default();
        let end = command.last().copied().unwrap_or_default();
        let moving = moving_samples(command);
        let still = command.windows(2).position(|pair| pair[0] != pair[1]);
        let moving_from = still.unwrap_or(moving);

        let mut plant = IdealPlant::new(task.mode, STEP_S, start);
        let command_and_rest = command[..moving]
            .iter()
            .chain([&end].into_iter().cycle().take(REST));
        let accelerations: Vec<_> = command_and_rest
            .map(|&point| plant.step(point).tool_acceleration_mm_s2)
            .collect();

        let joints: Option<Vec<_>> = command[..moving]
            .iter()
            .map(|&[x, y, z]| task.body.inverse([x, y, z, 0.0]))
            .collect();
        let joints = joints.context("the command leaves the arm's reach")?;
        let [joint1, joint2, ..] = joint_peaks(&joints, STEP_S).acceleration;
        Ok(Self {
            cycle_time_s: moving.saturating_sub(moving_from + 1) as f64 * STEP_S,
            residual_mm_s2: Vibration::measure(&accelerations, moving).residual_max_mm_s2,
            corner_error_mm: corner_error_mm(task, command),
            joint_acceleration_rad_s2: joint1.max(joint2),
        })
    }
}

/// The largest miss of a corner by a command, straight from sample to sample, in mm.
#[must_use]
pub fn corner_error_mm(task: &Task, command: &[Point]) -> f64 {
    let miss = |corner: Point| {
        let chords = command.windows(2);
        chords
            .map(|pair| distance_to_chord(corner, pair[0], pair[1]))
            .fold(f64::INFINITY, f64::min)
    };
    task.corners().map(miss).fold(0.0, f64::max)
}
