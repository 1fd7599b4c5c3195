//! The feedrate: the commanded speed of the tool over time.

use anyhow::Result;
use plotters::style::Color as _;

use super::canvas::{
    BACKGROUND, COMMAND, INK, LIMIT, Point, axes, dashed, full, headed, limit, lines, note, picture,
};
use super::polyline::envelope;
use crate::checker::TraceRow;
use crate::paired_run::PairedRun;
use crate::scenario::Outcome;
use crate::trace::Trace;
use crate::vector::{distance, xyz};

const SIZE: (u32, u32) = (1280, 520);

/// Corners that are marked; with more, none is.
const MARKS: usize = 12;

/// Draws the picture.
pub fn draw(run: &PairedRun) -> Result<String> {
    let summary = &run.summary;
    let (filtered, unfiltered) = (speeds(&run.outcome), speeds(&run.unfiltered));
    let feed = programmed_feed(run);
    let end = Trace::time_s(run.outcome.trace.stop());
    let highest = filtered
        .iter()
        .chain(&unfiltered)
        .map(|point| point.1)
        .chain(feed)
        .fold(1.0, f64::max);
    let title = format!("{}: the feedrate", summary.program_name());
    let subtitle = format!(
        "commanded speed of the tool; {} takes {:.3} s, no prefilter {:.3} s",
        summary.prefilter, run.outcome.cycle_time_s, run.unfiltered.cycle_time_s
    );
    let mut legend = vec![full(COMMAND, 2, summary.prefilter)];
    if summary.prefilter != "none" {
        legend.push(full(BACKGROUND, 2, "no prefilter"));
    }
    if feed.is_some() {
        legend.push(limit("programmed feedrate"));
    }
    picture(SIZE, |root| {
        let body = headed(root, &title, &subtitle, &legend)?;
        let ranges = [(0.0, end * 1.03), (0.0, highest * 1.16)];
        let mut chart = axes(&body, ranges, ["time, s", "speed, mm/s"], [10, 6])?;
        lines(&mut chart, [envelope(unfiltered, 2400)], BACKGROUND, 2)?;
        if let Some(feed) = feed {
            dashed(&mut chart, [vec![(0.0, feed), (ranges[0].1, feed)]], LIMIT)?;
        }
        lines(&mut chart, [envelope(filtered, 2400)], COMMAND, 2)?;
        for (number, time_s) in (1..).zip(corner_times(run)) {
            let top = ranges[1].1;
            let stroke = [vec![(time_s, 0.0), (time_s, top * 0.92)]];
            lines(&mut chart, stroke, INK.mix(0.25), 1)?;
            let text = if number == 1 {
                "corner 1".into()
            } else {
                format!("{number}")
            };
            note(&chart, &text, (time_s, top * 0.92), (0, -11), INK)?;
        }
        Ok(())
    })
}

/// Times at which corners are passed; none if there are too many to mark.
fn corner_times(run: &PairedRun) -> Vec<f64> {
    match &run.outcome.checked {
        Ok((_, report)) if report.corners.len() <= MARKS => {
            report.corners.iter().map(|corner| corner.time_s).collect()
        }
        _ => Vec::new(),
    }
}

/// The largest feedrate that the program gives.
fn programmed_feed(run: &PairedRun) -> Option<f64> {
    let (program, _) = run.outcome.checked.as_ref().ok()?;
    let feeds = program.blocks.iter().filter_map(|block| block.feed_mm_s);
    feeds.reduce(f64::max)
}

/// Speed between rows, until shortly after the stop.
fn speeds(outcome: &Outcome) -> Vec<Point> {
    let trace = &outcome.trace;
    let rows: Vec<_> = trace
        .poses()
        .into_iter()
        .take(trace.stop() + 50)
        .enumerate()
        .map(|(row, pose)| TraceRow {
            time_s: Trace::time_s(row),
            pose,
        })
        .collect();
    rows.windows(2)
        .map(|pair| {
            let moved = distance(xyz(pair[0].pose), xyz(pair[1].pose));
            (pair[1].time_s, moved / (pair[1].time_s - pair[0].time_s))
        })
        .collect()
}
