//! A scenario: a program on a robot, run, simulated and measured.

use anyhow::{Context, Result};
use planner_core::config::Robot;
use planner_core::corner::CornerRule;
use planner_core::prefilter::Kind;

use crate::checker::hops::{Hop, HopDefaults};
use crate::checker::{
    self, CheckOptions, JointPeaks, Program, Report, TraceRow, joint_peaks, settling_time_s,
};
use crate::limit_use::{LimitUse, limit_uses};
use crate::machine::Machine;
use crate::prefilters_chosen::{ChosenPrefilter, prefilters_chosen};
use crate::program_file::ProgramFile;
use crate::progress::Progress;
use crate::robot_file::RobotSettings;
use crate::software_loop;
use crate::summary::PayloadFigures;
use crate::trace::{PlantKind, SETTLED_MM, Trace};
use crate::vector::xyz;
use crate::vibration::Vibration;

/// What is to be run, where, and against which plant.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The program.
    pub program: ProgramFile,
    /// The robot, flags of the command line applied.
    pub settings: RobotSettings,
    /// Which plant answers.
    pub plant: PlantKind,
    /// Where the planner runs.
    pub machine: Machine,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The prefilter that was used.
    pub prefilter: Kind,
    /// Setpoints and tool.
    pub trace: Trace,
    /// The independent checker's findings; or why it cannot judge this program.
    pub checked: Result<(Program, Report), checker::ProgramError>,
    /// From the last setpoint at rest until the command has stopped.
    pub cycle_time_s: f64,
    /// From then until the tool stays within 50 µm of its end; none if it does not within
    /// a minute.
    pub settling_time_s: Option<f64>,
    /// Tool accelerations over the motion and 3 s more.
    pub vibration: Vibration,
    /// How far hops are bent where they have to be vertical; none where there are no hops.
    pub vertical_deviation_mm: Option<f64>,
    /// What the payload does.
    pub payload: PayloadFigures,
    /// Peaks of the joint setpoints.
    pub joint_peaks: JointPeaks,
    /// What became of the robot's limits; empty if it has none.
    pub limits: Vec<LimitUse>,
    /// Boxes in s that the prefilter was given because limits need them.
    pub added_boxes_s: Vec<f64>,
    /// The prefilters that moves get by a map or automatically; empty where all have the same.
    pub prefilters_chosen: Vec<ChosenPrefilter>,
    /// Instructions of the dearest tick; the host does not count.
    pub tick_instructions_max: Option<u32>,
}

impl Scenario {
    /// Runs it with the prefilter of its settings.
    ///
    /// # Errors
    /// Settings or lines that are refused, before anything moves.
    pub fn run(&self, progress: Progress) -> Result<Outcome> {
        let robot = Robot::new(&self.settings.robot)?;
        let recording = self
            .machine
            .record(&robot, &self.program.text, progress)
            .with_context(|| self.program.name.clone())?;
        let setpoints = &recording.setpoints;
        let trace = Trace::simulate(setpoints, self.plant, &self.settings.plant, progress);
        let motion = setpoints.len();
        let mut outcome = self.measure(&robot, trace, motion);
        let planned = software_loop::plan(&robot, &self.program.text)?;
        outcome.limits = limit_uses(&robot, &outcome.trace, &planned.limited);
        if robot.follower.is_some() {
            outcome.prefilters_chosen = prefilters_chosen(&robot, &planned.at_ends);
        }
        outcome.tick_instructions_max = recording.tick_instructions_max;
        Ok(outcome)
    }

    /// Runs it on this machine with another prefilter, for comparison.
    ///
    /// # Errors
    /// As [`Scenario::run`]; also where the prefilter is too long at this frequency.
    pub fn run_with(&self, prefilter: Kind, progress: Progress) -> Result<Outcome> {
        let mut other = self.clone();
        other.settings.robot.prefilter.kind = prefilter;
        other.machine = Machine::Host;
        other.run(progress)
    }

    fn measure(&self, robot: &Robot, trace: Trace, motion: usize) -> Outcome {
        let poses = trace.poses();
        let (start, stop) = (trace.start(), trace.stop());
        let times: Vec<_> = (0..trace.tool.len()).map(Trace::time_s).collect();
        let tool: Vec<_> = trace.tool.iter().map(|s| s.position_mm).collect();
        let end = xyz(poses.last().copied().unwrap_or_default());
        let rows: Vec<_> = times
            .iter()
            .zip(&poses)
            .take(motion)
            .map(|(&time_s, &pose)| TraceRow { time_s, pose })
            .collect();
        let options = self.check_options(robot);
        let checked = Program::parse(&self.program.text).map(|program| {
            let report = checker::check(&program, &rows, &options);
            (program, report)
        });
        let hops = checked.iter().flat_map(|(_, report)| &report.hops);
        let vertical_deviation_mm = hops.map(|hop| hop.bent_mm).reduce(f64::max);
        Outcome {
            prefilter: self.settings.robot.prefilter.kind,
            checked,
            cycle_time_s: Trace::time_s(stop) - Trace::time_s(start.min(stop)),
            settling_time_s: settling_time_s(&times, &tool, end, Trace::time_s(stop), SETTLED_MM),
            vibration: Vibration::measure(&trace.accelerations(), trace.driven),
            vertical_deviation_mm,
            payload: PayloadFigures::new(&trace, self.settings.plant.payload.as_ref()),
            joint_peaks: joint_peaks(&trace.joints(), Trace::time_s(1)),
            limits: limit_uses(robot, &trace, &[]),
            added_boxes_s: robot.added_boxes_s().collect(),
            prefilters_chosen: Vec::new(),
            tick_instructions_max: None,
            trace,
        }
    }

    /// The hops of the program, as the checker reads them.
    #[must_use]
    pub fn hops(&self) -> Vec<Hop> {
        let program = Program::parse(&self.program.text).unwrap_or_default();
        program.hops(self.hop_defaults())
    }

    fn hop_defaults(&self) -> HopDefaults {
        let own = self.settings.robot.hop;
        HopDefaults {
            height_mm: own.height_mm.into(),
            tolerance_mm: own.tolerance_mm.into(),
        }
    }

    fn check_options(&self, robot: &Robot) -> CheckOptions {
        let config = &self.settings.robot;
        let fastest_mm_s = config.feed_limit_mm_s.max(config.rapid_mm_s);
        CheckOptions {
            rapid_mm_s: config.rapid_mm_s.into(),
            tolerance_mm: match config.corner() {
                CornerRule::ToleranceMm(mm) => mm.into(),
                CornerRule::OverlapPercent(_) => f64::INFINITY,
            },
            feed_window_mm: f64::from(fastest_mm_s) * robot.prefilter().length_s(),
            hops: self.hop_defaults(),
        }
    }
}
