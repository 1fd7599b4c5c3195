//! The figures of a run, as `summary.json` and `--json` give them.

use std::path::Path;

use anyhow::Result;
use planner_core::pose::JointUnit;
use serde::Serialize;

use crate::checker::program::Block;
use crate::checker::{Program, Report};
use crate::limit_use::LimitUse;
use crate::mode_use::ModeUse;
use crate::plant::{PayloadConfig, PayloadSample};
use crate::prefilters_chosen::ChosenPrefilter;
use crate::scenario::{Outcome, Scenario};
use crate::trace::Trace;

/// Figures of a run.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Summary {
    /// The program's file.
    pub program: String,
    /// The prefilter's name.
    pub prefilter: &'static str,
    /// The prefilter's frequency.
    pub frequency_hz: f32,
    /// The prefilter's damping ratio.
    pub damping: f32,
    /// The modes that it is made for, with the axes on which it is.
    pub modes: Vec<ModeUse>,
    /// The prefilters that moves get by a map or automatically; empty where all have the same.
    pub prefilters_chosen: Vec<ChosenPrefilter>,
    /// Corner tolerance where the program sets none.
    pub tolerance_mm: f32,
    /// `full` or `ideal`.
    pub plant: &'static str,
    /// `host` or `emulator`.
    pub on: &'static str,
    /// The figures themselves.
    #[serde(flatten)]
    pub figures: Figures,
    /// Vibration as a fraction of that without a prefilter, on the same plant.
    #[serde(flatten)]
    pub ratios: Ratios,
    /// Instructions of the dearest tick; null on the host.
    pub tick_instructions_max: Option<u32>,
    /// What became of the robot's limits of motion; empty if it has none.
    pub limits: Vec<LimitUse>,
    /// Boxes that the prefilter was given because limits need them.
    pub added_boxes_s: Vec<f64>,
}

/// What is measured of each prefilter.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct Figures {
    /// Duration of the commanded motion.
    pub cycle_time_s: f64,
    /// From the commanded stop until the tool stays within 50 µm; null if it does not.
    pub settling_time_s: Option<f64>,
    /// Largest miss of a corner; null where the checker cannot read the program.
    pub max_corner_error_mm: Option<f64>,
    /// Largest distance of the command from the programmed path; null likewise.
    pub max_path_deviation_mm: Option<f64>,
    /// How far hops are bent where they have to be vertical; null where there are none.
    pub vertical_deviation_max_mm: Option<f64>,
    /// What the payload does; null where there is none.
    #[serde(flatten)]
    pub payload: PayloadFigures,
    /// Maximum of the tool's acceleration, motion and 3 s more.
    pub vibration_max_mm_s2: f64,
    /// RMS of the same.
    pub vibration_rms_mm_s2: f64,
    /// Maximum in motion.
    pub vibration_motion_max_mm_s2: f64,
    /// RMS in motion.
    pub vibration_motion_rms_mm_s2: f64,
    /// Maximum after the stop.
    pub vibration_residual_max_mm_s2: f64,
    /// RMS over 3 s after the stop.
    pub vibration_residual_rms_mm_s2: f64,
    /// Largest acceleration setpoint of joint 1.
    pub joint1_peak_rad_s2: f64,
    /// Likewise of joint 2.
    pub joint2_peak_rad_s2: f64,
    /// Likewise of joint 3, being a quill.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint3_peak_mm_s2: Option<f64>,
    /// Likewise of joint 3, being an arm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint3_peak_rad_s2: Option<f64>,
    /// Likewise of joint 4.
    pub joint4_peak_rad_s2: f64,
}

/// What the payload does, motion and 3 s more; null where there is none.
#[derive(Clone, Copy, Debug, Default, Serialize, PartialEq)]
pub struct PayloadFigures {
    /// Its largest acceleration, without gravity.
    pub payload_acceleration_max_mm_s2: Option<f64>,
    /// How far it is from where it hangs at rest, at the most.
    pub payload_swing_max_mm: Option<f64>,
    /// The same after the tool has been driven for the last time.
    pub payload_overshoot_max_mm: Option<f64>,
    /// Whether its acceleration exceeds what the gripper holds.
    pub peeled_off: Option<bool>,
}

impl PayloadFigures {
    /// The figures of a trace, with the gripper's limit.
    #[must_use]
    pub fn new(trace: &Trace, config: Option<&PayloadConfig>) -> Self {
        let Some(config) = config else {
            return Self::default();
        };
        let rows = trace.setpoints.len().min(trace.payload.len());
        let samples = &trace.payload[..rows];
        let after = &samples[trace.driven.min(rows)..];
        let swing = |list: &[PayloadSample]| list.iter().map(|s| s.swing_mm).fold(0.0, f64::max);
        let acceleration = samples
            .iter()
            .map(|s| s.acceleration_mm_s2)
            .fold(0.0, f64::max);
        Self {
            payload_acceleration_max_mm_s2: Some(acceleration),
            payload_swing_max_mm: Some(swing(samples)),
            payload_overshoot_max_mm: Some(swing(after)),
            peeled_off: Some(acceleration > config.peel_off_mm_s2),
        }
    }
}

/// Vibration as a fraction of that without a prefilter; null if that is zero.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct Ratios {
    /// Of the maximum.
    pub vibration_max_ratio: Option<f64>,
    /// Of the RMS.
    pub vibration_rms_ratio: Option<f64>,
    /// Of the maximum after the stop.
    pub vibration_residual_ratio: Option<f64>,
}

impl Summary {
    /// The figures of `outcome`, beside those without a prefilter.
    #[must_use]
    pub fn new(scenario: &Scenario, outcome: &Outcome, unfiltered: &Outcome) -> Self {
        let robot = &scenario.settings.robot;
        Self {
            program: scenario.program.name.clone(),
            prefilter: outcome.prefilter.name(),
            frequency_hz: robot.prefilter.frequency_hz,
            damping: robot.prefilter.damping,
            modes: ModeUse::all(&robot.prefilter),
            prefilters_chosen: outcome.prefilters_chosen.clone(),
            tolerance_mm: robot.corner_tolerance_mm,
            plant: scenario.plant.name(),
            on: scenario.machine.name(),
            figures: Figures::new(outcome),
            ratios: Ratios::new(outcome, unfiltered),
            tick_instructions_max: outcome.tick_instructions_max,
            limits: outcome.limits.clone(),
            added_boxes_s: outcome.added_boxes_s.clone(),
        }
    }

    /// The program's file without its directory.
    #[must_use]
    pub fn program_name(&self) -> &str {
        let name = Path::new(&self.program).file_name();
        name.and_then(|name| name.to_str()).unwrap_or(&self.program)
    }

    /// The prefilter in words.
    #[must_use]
    pub fn prefilter_in_words(&self) -> String {
        match self.prefilter {
            "none" => "no prefilter".into(),
            name => format!(
                "{name} for {} Hz, damping {}",
                self.frequency_hz, self.damping
            ),
        }
    }

    /// As JSON, one key a line.
    ///
    /// # Errors
    /// Never in practice: all keys are text.
    pub fn json(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)?)
    }
}

impl Figures {
    /// The figures of a run.
    #[must_use]
    pub fn new(outcome: &Outcome) -> Self {
        // a program of hops alone has no path that could be left
        let has_path = |program: &Program| !program.blocks.iter().all(Block::is_hop);
        let checked = outcome.checked.as_ref().ok();
        let report = checked.and_then(|(program, report)| has_path(program).then_some(report));
        let vibration = outcome.vibration;
        let [joint1, joint2, joint3, joint4] = outcome.joint_peaks.acceleration;
        let [_, _, third, _] = outcome.trace.joint_units();
        Self {
            cycle_time_s: outcome.cycle_time_s,
            settling_time_s: outcome.settling_time_s,
            max_corner_error_mm: report.map(Report::max_corner_error_mm),
            max_path_deviation_mm: report.map(|report| report.max_path_deviation_mm),
            vertical_deviation_max_mm: outcome.vertical_deviation_mm,
            payload: outcome.payload,
            vibration_max_mm_s2: vibration.max_mm_s2,
            vibration_rms_mm_s2: vibration.rms_mm_s2,
            vibration_motion_max_mm_s2: vibration.motion_max_mm_s2,
            vibration_motion_rms_mm_s2: vibration.motion_rms_mm_s2,
            vibration_residual_max_mm_s2: vibration.residual_max_mm_s2,
            vibration_residual_rms_mm_s2: vibration.residual_rms_mm_s2,
            joint1_peak_rad_s2: joint1,
            joint2_peak_rad_s2: joint2,
            joint3_peak_mm_s2: (third == JointUnit::Length).then_some(joint3),
            joint3_peak_rad_s2: (third == JointUnit::Angle).then_some(joint3),
            joint4_peak_rad_s2: joint4,
        }
    }
}

impl Ratios {
    /// The ratios of a run to the one without a prefilter.
    #[must_use]
    pub fn new(outcome: &Outcome, unfiltered: &Outcome) -> Self {
        let (with, without) = (&outcome.vibration, &unfiltered.vibration);
        let ratio = |with: f64, without: f64| (without > 0.0).then_some(with / without);
        Self {
            vibration_max_ratio: ratio(with.max_mm_s2, without.max_mm_s2),
            vibration_rms_ratio: ratio(with.rms_mm_s2, without.rms_mm_s2),
            vibration_residual_ratio: ratio(with.residual_max_mm_s2, without.residual_max_mm_s2),
        }
    }
}
