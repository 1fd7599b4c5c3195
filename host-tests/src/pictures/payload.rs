//! The payload: its way beside the tool's, seen from the side, its swing and its acceleration.

use anyhow::Result;

use super::canvas::{
    BACKGROUND, COMMAND, CONTRAST, LIMIT, Point, axes, dashed, full, headed, limit, lines, picture,
};
use super::polyline::envelope;
use crate::paired_run::PairedRun;
use crate::plant::{PayloadConfig, PayloadSample};
use crate::scenario::Outcome;
use crate::trace::Trace;

const SIZE: (u32, u32) = (1280, 1350);

/// Draws the picture of a robot with that payload.
pub fn draw(run: &PairedRun, config: &PayloadConfig) -> Result<String> {
    let summary = &run.summary;
    let title = format!("{}: the payload", summary.program_name());
    let figures = &summary.figures.payload;
    let subtitle = format!(
        "{:.1} m/s² and {:.1} mm at the most, {:.1} mm after the stop",
        figures.payload_acceleration_max_mm_s2.unwrap_or(0.0) / 1e3,
        figures.payload_swing_max_mm.unwrap_or(0.0),
        figures.payload_overshoot_max_mm.unwrap_or(0.0),
    );
    let legend = [
        full(BACKGROUND, 3, "tool"),
        full(CONTRAST, 1, "no prefilter"),
        full(COMMAND, 2, summary.prefilter),
        limit("limits"),
    ];
    let outcomes = [(&run.unfiltered, CONTRAST, 1), (&run.outcome, COMMAND, 2)];
    let end = outcomes
        .iter()
        .map(|(outcome, ..)| Trace::time_s(outcome.trace.setpoints.len()))
        .fold(0.0, f64::max);
    picture(SIZE, |root| {
        let body = headed(root, &title, &subtitle, &legend)?;
        let (_, height) = body.dim_in_pixel();
        let (side, rest) = body.split_vertically(height / 3);
        let (swings, accelerations) = rest.split_vertically(height / 3);

        let tool = from_the_side(run, &run.outcome.trace.poses(), 0.0);
        let ways = outcomes.map(|(outcome, ..)| {
            let samples = driven(outcome).map(|sample| sample.position_mm);
            let positions: Vec<_> = samples.map(|[x, y, z]| [x, y, z, 0.0]).collect();
            from_the_side(run, &positions, config.length_mm)
        });
        let all: Vec<Point> = ways.iter().flatten().chain(&tool).copied().collect();
        let names = ["way across, mm", "height, payload as high as the tool, mm"];
        let mut chart = axes(&side, around(&all), names, [10, 5])?;
        lines(&mut chart, [tool], BACKGROUND, 3)?;
        for (way, (_, colour, width)) in ways.into_iter().zip(outcomes) {
            lines(&mut chart, [way], colour, width)?;
        }

        let swing = outcomes.map(|(outcome, ..)| over_time(outcome, |sample| sample.swing_mm));
        let from = Trace::time_s(run.outcome.trace.driven);
        let limit_mm = config.overshoot_limit_mm;
        let ranges = [(0.0, end), (0.0, highest(&swing, limit_mm))];
        let mut chart = axes(&swings, ranges, ["time, s", "swing, mm"], [10, 5])?;
        dashed(&mut chart, [vec![(from, limit_mm), (end, limit_mm)]], LIMIT)?;
        for (curve, (_, colour, width)) in swing.into_iter().zip(outcomes) {
            lines(&mut chart, [envelope(curve, 2400)], colour, width)?;
        }

        let acceleration = outcomes
            .map(|(outcome, ..)| over_time(outcome, |sample| sample.acceleration_mm_s2 / 1e3));
        let peel_off = config.peel_off_mm_s2 / 1e3;
        let ranges = [(0.0, end), (0.0, highest(&acceleration, peel_off))];
        let names = ["time, s", "acceleration, m/s²"];
        let mut chart = axes(&accelerations, ranges, names, [10, 5])?;
        dashed(&mut chart, [vec![(0.0, peel_off), (end, peel_off)]], LIMIT)?;
        for (curve, (_, colour, width)) in acceleration.into_iter().zip(outcomes) {
            lines(&mut chart, [envelope(curve, 2400)], colour, width)?;
        }
        Ok(())
    })
}

/// Samples of the payload in the rows with setpoints.
fn driven(outcome: &Outcome) -> impl Iterator<Item = &PayloadSample> {
    let trace = &outcome.trace;
    trace.payload.iter().take(trace.setpoints.len())
}

fn over_time(outcome: &Outcome, value: impl Fn(&PayloadSample) -> f64) -> Vec<Point> {
    let rows = driven(outcome).enumerate();
    rows.map(|(row, sample)| (Trace::time_s(row), value(sample)))
        .collect()
}

/// The way across, along the line from the first to the furthest pose, and the height, which is
/// raised by so much.
fn from_the_side(run: &PairedRun, poses: &[[f64; 4]], raised_mm: f64) -> Vec<Point> {
    let command = run.outcome.trace.poses();
    let first = command.first().copied().unwrap_or_default();
    let away = |pose: &[f64; 4]| (pose[0] - first[0]).hypot(pose[1] - first[1]);
    let furthest = command
        .iter()
        .max_by(|a, b| away(a).total_cmp(&away(b)))
        .copied()
        .unwrap_or(first);
    let length = away(&furthest).max(1e-9);
    let [ux, uy] = [0, 1].map(|i| (furthest[i] - first[i]) / length);
    poses
        .iter()
        .map(|p| {
            let across = (p[0] - first[0]) * ux + (p[1] - first[1]) * uy;
            (across, p[2] + raised_mm)
        })
        .collect()
}

/// Ranges around points, with some room.
fn around(points: &[Point]) -> [(f64, f64); 2] {
    let range = |values: &dyn Fn(&Point) -> f64| {
        let low = points.iter().map(values).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(values).fold(f64::NEG_INFINITY, f64::max);
        let room = 0.05 * (high - low).max(1.0);
        (low - room, high + room)
    };
    [range(&|point| point.0), range(&|point| point.1)]
}

/// The top of an axis that holds curves and a limit.
fn highest(curves: &[Vec<Point>], limit: f64) -> f64 {
    let values = curves.iter().flatten().map(|point| point.1);
    1.1 * values.fold(limit, f64::max)
}
