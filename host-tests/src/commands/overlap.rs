//! `stillpoint overlap`: velocity profile overlap on a path of a tool that moves and turns.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{Attribute, Cell, CellAlignment, LineStyle, Table};
use planner_core::corner::CornerRule;
use planner_core::overlap::{Method, Segment, SpeedCurve};
use serde::Serialize;

use crate::tool_path::{Measured, ToolPath};

/// Arguments of `overlap`.
#[derive(Args, Debug)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
The table has a point a row: x_mm, y_mm, z_mm, a_deg, b_deg, c_deg (R = Rz(C) Ry(B) Rx(A)), \
feed_mm_s on the way there, and where wanted turn_deg_s, and tolerance_mm or overlap_percent \
of the corner there."
)]
pub struct OverlapArgs {
    /// Table of points (CSV).
    path: PathBuf,
    /// Box of the prefilter: the speed rises in two of them, or in one with --adai.
    #[arg(long, value_name = "S")]
    r#box: f64,
    /// Overlap of every corner in percent instead of the table's rules: 100 never dwells.
    #[arg(long, value_name = "PERCENT", value_parser = clap::value_parser!(f32))]
    overlap: Option<f32>,
    /// Solve corners exactly, where Eq. 35 of [Li23] is conservative at unequal feedrates.
    #[arg(long)]
    exact: bool,
    /// One box and no dwell at any corner: what [Li23] compares with.
    #[arg(long, conflicts_with_all = ["overlap", "exact"])]
    adai: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Row {
    length_mm: f64,
    rotation_deg: f64,
    duration_s: f64,
    /// Whether the rotation is the slower one.
    is_led_by_rotation: bool,
    /// At the corner behind it; none at the end.
    overlap_s: Option<f64>,
    overlap_percent: Option<f64>,
    corner_error_mm: Option<f64>,
}

#[derive(Serialize)]
struct Answer {
    box_s: f64,
    segments: Vec<Row>,
    #[serde(flatten)]
    measured: Measured,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// A table or an argument that cannot be used, in one sentence.
pub fn execute(args: &OverlapArgs) -> Result<String> {
    let mut path = ToolPath::load(&args.path)?;
    let percent = if args.adai { Some(100.0) } else { args.overlap };
    if let Some(percent) = percent {
        anyhow::ensure!(
            (0.0..=100.0).contains(&percent),
            "the overlap of {percent} is not within 0 to 100: check --overlap"
        );
        path = path.with_rule(CornerRule::OverlapPercent(percent));
    }
    let curve = if args.adai {
        SpeedCurve::adai(args.r#box)?
    } else {
        SpeedCurve::s_curve(args.r#box)?
    };
    let method = if args.exact {
        Method::Exact
    } else {
        Method::ClosedForm
    };
    let measured = path.measure(curve, method);
    let segments = path.segments().enumerate();
    let segments = segments.map(|(i, segment)| row(i, segment, &curve, &measured));
    let answer = Answer {
        box_s: curve.box_s(),
        segments: segments.collect(),
        measured,
    };
    if args.json {
        return Ok(serde_json::to_string(&answer)?);
    }
    Ok(table(&answer))
}

fn row(i: usize, segment: &Segment, curve: &SpeedCurve, measured: &Measured) -> Row {
    let overlap_s = measured.overlaps_s.get(i).copied();
    Row {
        length_mm: segment.length_mm(),
        rotation_deg: segment.rotation().angle_deg(),
        duration_s: segment.duration_s(),
        is_led_by_rotation: segment.is_led_by_rotation(),
        overlap_s,
        overlap_percent: overlap_s.map(|s| 100.0 * (s / curve.length_s()).powi(2)),
        corner_error_mm: measured.corner_errors_mm.get(i).copied(),
    }
}

const HEADER: [&str; 7] = [
    "segment",
    "length\nmm",
    "rotation\n°",
    "raw time\ns",
    "overlap\ns",
    "overlap\n%",
    "corner\nmm",
];

fn table(answer: &Answer) -> String {
    let mut table = Table::new();
    table
        .load_style(UTF8_HORIZONTAL_ONLY.row_separator(LineStyle::none()))
        .set_header(HEADER.map(|text| Cell::new(text).add_attribute(Attribute::Bold)));
    let or_none = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "-".into(), |value| format!("{value:.digits$}"))
    };
    for (number, row) in (1..).zip(&answer.segments) {
        let led = if row.is_led_by_rotation {
            "turns"
        } else {
            "moves"
        };
        table.add_row([
            format!("{number}, {led}"),
            format!("{:.3}", row.length_mm),
            format!("{:.2}", row.rotation_deg),
            format!("{:.3}", row.duration_s),
            or_none(row.overlap_s, 4),
            or_none(row.overlap_percent, 1),
            or_none(row.corner_error_mm, 3),
        ]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let Measured {
        cycle_s,
        tangential_mm_s2: [slows, speeds_up],
        axial_mm_s2: [least, most],
        acceleration_mm_s2,
        euler_rates_deg_s: [a, b, c],
        ..
    } = &answer.measured;
    format!(
        "{table}\n\
         cycle time               {cycle_s:.3} s\n\
         change of the speed      {slows:.1} to {speeds_up:.1} mm/s²\n\
         acceleration of an axis  {least:.1} to {most:.1} mm/s²\n\
         acceleration             {acceleration_mm_s2:.1} mm/s² at the most\n\
         Euler rates A', B', C'   {a:.2}, {b:.2}, {c:.2} °/s at the most"
    )
}
