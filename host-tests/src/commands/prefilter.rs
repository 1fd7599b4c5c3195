//! `stillpoint prefilter`: a prefilter's length and what it leaves.

use anyhow::{Result, ensure};
use clap::Args;
use planner_core::prefilter::{Mode, insensitivity, residual};
use serde::Serialize;

use super::ModelArgs;

/// The band is where less than `V_tol` is left, 5 % if it is not given. EI shapers touch it
/// within the band: the margin keeps rounding out of the answer.
const MARGIN: f64 = 1e-7;

/// Arguments of `prefilter`.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct PrefilterArgs {
    #[command(flatten)]
    model: ModelArgs,
    /// Natural frequency of the robot; the model's if there is none.
    #[arg(long, value_name = "HZ")]
    actual_frequency: Option<f64>,
    /// Damping ratio of the robot; the model's if there is none.
    #[arg(long, value_name = "Z")]
    actual_damping: Option<f64>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Answer {
    length_s: f64,
    #[serde(skip)]
    centroid_s: f64,
    #[serde(skip)]
    spread_s: f64,
    #[serde(skip)]
    boxes_s: Vec<f64>,
    residual_percent: f64,
    band_low_hz: Option<f64>,
    band_high_hz: Option<f64>,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// An argument out of its range, in one sentence.
pub fn execute(args: &PrefilterArgs) -> Result<String> {
    let answer = answer(args)?;
    if args.json {
        return Ok(serde_json::to_string(&answer)?);
    }
    let band = match (answer.band_low_hz, answer.band_high_hz) {
        (Some(low), Some(high)) => format!("{low:.4} to {high:.4} Hz"),
        _ => "nowhere around the model frequency".into(),
    };
    let boxes: Vec<_> = answer.boxes_s.iter().map(|s| format!("{s:.6} s")).collect();
    let boxes = if boxes.is_empty() {
        "none: the velocity jumps".into()
    } else {
        boxes.join(", ")
    };
    let limit = 100.0 * f64::from(args.model.config()?.v_tol);
    let limit = format!("residual below {limit:.4}")
        .trim_end_matches('0')
        .trim_end_matches('.')
        .to_owned();
    Ok(format!(
        "length             {:.6} s\ncentroid           {:.6} s\nspread             {:.6} s\n\
         boxes              {boxes}\nresidual           {:.4} %\n{limit} % {band}",
        answer.length_s, answer.centroid_s, answer.spread_s, answer.residual_percent
    ))
}

fn answer(args: &PrefilterArgs) -> Result<Answer> {
    let prefilter = args.model.prefilter()?;
    let model = Mode {
        frequency_hz: args.model.frequency.into(),
        damping: args.actual_damping.unwrap_or(args.model.damping.into()),
    };
    let actual = Mode {
        frequency_hz: args.actual_frequency.unwrap_or(model.frequency_hz),
        ..model
    };
    ensure!(
        actual.frequency_hz > 0.0 && actual.frequency_hz <= 10_000.0,
        "the robot's frequency of {} Hz is not above 0 and up to 10000: check --actual-frequency",
        actual.frequency_hz
    );
    ensure!(
        (0.0..1.0).contains(&actual.damping),
        "the robot's damping ratio of {} is not from 0 to below 1: check --actual-damping",
        actual.damping
    );
    let limit = f64::from(args.model.config()?.v_tol);
    let band = insensitivity(&prefilter, &model, limit + MARGIN);
    Ok(Answer {
        length_s: prefilter.length_s(),
        centroid_s: prefilter.centroid_s(),
        spread_s: prefilter.spread_s(),
        boxes_s: prefilter.boxes_s().to_vec(),
        residual_percent: 100.0 * residual(&prefilter, &actual),
        band_low_hz: band.map(|band| band.low_hz),
        band_high_hz: band.map(|band| band.high_hz),
    })
}
