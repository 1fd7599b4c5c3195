//! `stillpoint corner`: one corner, by the microcontroller's solver.

use anyhow::{Result, ensure};
use clap::Args;
use planner_core::corner::{self, Side};
use serde::Serialize;

use super::ModelArgs;

/// Arguments of `corner`.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct CornerArgs {
    #[command(flatten)]
    model: ModelArgs,
    /// Feedrate before and after the corner.
    #[arg(long, value_name = "MM_S")]
    feed: f32,
    /// Change of heading: 0 straight on, 180 back.
    #[arg(long, value_name = "DEG")]
    angle: f64,
    /// How far the corner may be missed.
    #[arg(long, value_name = "MM")]
    tolerance: f32,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Solution {
    t_dec1_s: f64,
    t_m_s: f64,
    t_c_s: f64,
    t_d_s: f64,
    e_c_mm: f64,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// An argument out of its range, in one sentence.
pub fn execute(args: &CornerArgs) -> Result<String> {
    let solution = solve(args)?;
    if args.json {
        return Ok(serde_json::to_string(&solution)?);
    }
    let Solution {
        t_dec1_s,
        t_m_s,
        t_c_s,
        t_d_s,
        e_c_mm,
    } = solution;
    let lines = [
        format!("deceleration     t_DEC1 {t_dec1_s:.6} s"),
        format!("delay            t_d    {t_d_s:.6} s"),
        format!("cornering        t_c    {t_c_s:.6} s"),
        format!("closest approach t_m    {t_m_s:.6} s"),
        format!("cornering error  e_c    {e_c_mm:.6} mm"),
    ];
    Ok(lines.join("\n"))
}

fn solve(args: &CornerArgs) -> Result<Solution> {
    let CornerArgs {
        feed,
        angle,
        tolerance,
        ..
    } = *args;
    ensure!(
        feed > 0.0 && feed <= 10_000.0,
        "the feedrate of {feed} mm/s is not above 0 and up to 10000: check --feed"
    );
    ensure!(
        (0.0..=180.0).contains(&angle),
        "the angle of {angle}° is not within 0 to 180: give the change of heading as --angle"
    );
    ensure!(
        (0.0..=100.0).contains(&tolerance),
        "the tolerance of {tolerance} mm is not within 0 to 100: check --tolerance"
    );
    let prefilter = args.model.prefilter()?;
    let (sin, cos) = angle.to_radians().sin_cos();
    let side = |tangent| Side {
        feed_mm_s: feed,
        tangent,
        heading_rate_per_mm: 0.0,
        length_mm: f32::INFINITY,
    };
    let found = corner::solve(
        &side([1.0, 0.0, 0.0]),
        &side([cos as f32, sin as f32, 0.0]),
        &prefilter.reversed_response(),
        &prefilter.response(),
        tolerance,
    );
    Ok(Solution {
        t_dec1_s: found.deceleration_s.into(),
        t_m_s: found.approach_s.into(),
        t_c_s: found.cornering_s.into(),
        t_d_s: found.dwell_s.into(),
        e_c_mm: found.error_mm.into(),
    })
}
