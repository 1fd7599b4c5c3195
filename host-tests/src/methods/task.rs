//! The task that every method gets.

use anyhow::{Context, Result, bail};

use super::Point;
use crate::checker::Program;
use crate::oracle::{Geometry, Prefilter};
use crate::plant::{Body, Mode};
use crate::scenario::Scenario;
use crate::vector::xyz;

/// Distance of the samples in seconds.
pub const STEP_S: f64 = 1e-3;

/// A path to go along.
#[derive(Clone, Debug)]
pub struct Task {
    /// The segments' curves, each from the end of the one before.
    pub curves: Vec<Geometry>,
    /// Their feedrates in mm/s.
    pub feeds_mm_s: Vec<f64>,
    /// Corner tolerance in mm.
    pub tolerance_mm: f64,
    /// The mode of the tool, the same along X, Y and Z.
    pub mode: Mode,
    /// The arm.
    pub body: Body,
}

impl Task {
    /// The program of a scenario, with its robot.
    ///
    /// # Errors
    /// The checker cannot read the program, or it has hops.
    pub fn new(scenario: &Scenario) -> Result<Self> {
        let name = || scenario.program.name.clone();
        let program = Program::parse(&scenario.program.text).with_context(name)?;
        if let Some(hop) = program.blocks.iter().find(|block| block.is_hop()) {
            bail!(
                "{}: line {} hops, on a way that no other method knows: go up, across and down by \
                 G1 moves",
                name(),
                hop.line
            );
        }
        let robot = &scenario.settings.robot;
        let rapid_mm_s = f64::from(robot.rapid_mm_s);
        let curve = |block: &crate::checker::program::Block| match block.arc() {
            None => Geometry::Line {
                from: block.from,
                to: block.to,
            },
            Some((centre, sweep_rad)) => Geometry::Arc {
                from: block.from,
                centre,
                sweep_rad,
                rise_mm: block.to[2] - block.from[2],
                turn_deg: block.to[3] - block.from[3],
            },
        };
        let blocks = program.blocks.iter();
        Ok(Self {
            curves: blocks.clone().map(curve).collect(),
            feeds_mm_s: blocks
                .map(|block| block.feed_mm_s.unwrap_or(rapid_mm_s))
                .collect(),
            tolerance_mm: robot.corner_tolerance_mm.into(),
            mode: scenario.settings.plant.mode,
            body: scenario.settings.plant.body(),
        })
    }

    /// The points between two segments.
    pub fn corners(&self) -> impl Iterator<Item = Point> {
        self.curves.iter().skip(1).map(|curve| xyz(curve.at(0.0)))
    }
}

/// Limits along the path.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Acceleration in mm/s².
    pub acceleration_mm_s2: f64,
    /// Jerk in mm/s³.
    pub jerk_mm_s3: f64,
}

impl Limits {
    /// The peak acceleration of a prefilter at the fastest feedrate; no jerk limit.
    pub fn of(task: &Task, prefilter: &Prefilter) -> Self {
        let fastest_mm_s = task.feeds_mm_s.iter().copied().fold(0.0, f64::max);
        let slope = |t_s: f64| (prefilter.step(t_s + STEP_S) - prefilter.step(t_s)) / STEP_S;
        let ticks = (prefilter.length_s() / STEP_S) as u32;
        let peak = (0..=ticks).map(|tick| slope(f64::from(tick) * STEP_S));
        Self {
            acceleration_mm_s2: fastest_mm_s * peak.fold(0.0, f64::max),
            jerk_mm_s3: f64::INFINITY,
        }
    }

    /// The same with a jerk that reaches the acceleration in so many seconds.
    pub fn with_jerk_time(self, time_s: f64) -> Self {
        Self {
            jerk_mm_s3: self.acceleration_mm_s2 / time_s,
            ..self
        }
    }
}
