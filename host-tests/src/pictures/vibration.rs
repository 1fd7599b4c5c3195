//! The vibration: the tool's acceleration over time, against that without a prefilter.

use anyhow::Result;
use plotters::style::Color as _;

use super::canvas::{COMMAND, CONTRAST, INK, Point, axes, full, headed, lines, note, picture};
use super::polyline::envelope;
use crate::commands::output::percent;
use crate::paired_run::PairedRun;
use crate::scenario::Outcome;
use crate::trace::Trace;
use crate::vector::norm;

const SIZE: (u32, u32) = (1280, 560);

/// Draws the picture.
pub fn draw(run: &PairedRun) -> Result<String> {
    let summary = &run.summary;
    let filtered = summary.prefilter != "none";
    let (with, without) = (accelerations(&run.outcome), accelerations(&run.unfiltered));
    let end = with
        .iter()
        .chain(&without)
        .map(|point| point.0)
        .fold(1e-3, f64::max);
    let highest = with
        .iter()
        .chain(&without)
        .map(|point| point.1)
        .fold(1e-6, f64::max);
    let title = format!("{}: the vibration", summary.program_name());
    let lower = |ratio: Option<f64>| percent(1.0 - ratio.unwrap_or(1.0));
    let subtitle = if filtered {
        format!(
            "acceleration of the tool, motion and 3 s more: {} lower at its maximum, {} lower in RMS",
            lower(summary.ratios.vibration_max_ratio),
            lower(summary.ratios.vibration_rms_ratio)
        )
    } else {
        "acceleration of the tool, motion and 3 s more".into()
    };
    let label = |name: &str, outcome: &Outcome| {
        format!(
            "{name}: max {:.2}, RMS {:.2} m/s²",
            outcome.vibration.max_mm_s2 / 1e3,
            outcome.vibration.rms_mm_s2 / 1e3
        )
    };
    let labels = [
        label("no prefilter", &run.unfiltered),
        label(summary.prefilter, &run.outcome),
    ];
    let mut legend = vec![full(CONTRAST, 2, &labels[0])];
    if filtered {
        legend.push(full(COMMAND, 2, &labels[1]));
    }
    picture(SIZE, |root| {
        let body = headed(root, &title, &subtitle, &legend)?;
        let ranges = [(0.0, end), (0.0, highest * 1.14)];
        let names = ["time, s", "acceleration, m/s²"];
        let mut chart = axes(&body, ranges, names, [10, 6])?;
        lines(&mut chart, [envelope(without, 2400)], CONTRAST, 1)?;
        let stops = if filtered {
            lines(&mut chart, [envelope(with, 2400)], COMMAND, 2)?;
            vec![(&run.unfiltered, CONTRAST), (&run.outcome, COMMAND)]
        } else {
            vec![(&run.unfiltered, CONTRAST)]
        };
        for (outcome, colour) in stops {
            let stop = Trace::time_s(outcome.trace.stop());
            let top = ranges[1].1 * 0.93;
            lines(
                &mut chart,
                [vec![(stop, 0.0), (stop, top)]],
                INK.mix(0.35),
                1,
            )?;
            note(&chart, "stop", (stop, top), (0, -11), colour)?;
        }
        Ok(())
    })
}

/// Magnitude of the tool's acceleration in m/s².
fn accelerations(outcome: &Outcome) -> Vec<Point> {
    let rows = outcome.trace.accelerations().into_iter().enumerate();
    rows.map(|(row, a)| (Trace::time_s(row), norm(a) / 1e3))
        .collect()
}
