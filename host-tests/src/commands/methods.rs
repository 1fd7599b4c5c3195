//! `stillpoint methods`: other methods of motion on the same program.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{Attribute, Cell, CellAlignment, LineStyle, Table};
use serde_json::json;

use super::ScenarioArgs;
use super::output::write_picture;
use crate::methods::{Entry, STILL_MM_S2, Task, compare, fastest_fit};
use crate::pictures::{ShownMotion, draw_comparison};
use crate::scenario::Scenario;

/// Arguments of `methods`.
#[derive(Args, Debug)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Every method gets the same path, feedrates and tolerance, and an ideal mode in X, Y and Z \
answers. Residual is the tool's largest acceleration after the command has stopped."
)]
pub struct MethodsArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Directory for a picture of speed, acceleration and jerk of each.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// Whatever stops the program from running to its end, in one sentence.
pub fn execute(args: &MethodsArgs) -> Result<String> {
    let scenario = args.scenario.scenario()?;
    let entries = compare(&scenario)?;
    let written = args
        .out
        .as_deref()
        .map(|directory| write_picture(directory, "methods.svg", &draw(&scenario, &entries)?))
        .transpose()?;
    if args.json {
        return Ok(serde_json::to_string_pretty(&as_json(&scenario, &entries))?);
    }
    let mut text = table(&scenario, &entries);
    if let Some(path) = written {
        text += &format!("\n\nLook at:\n  {}", path.display());
    }
    Ok(text)
}

/// Speed, acceleration and jerk of each method, with the limits that it was given.
fn draw(scenario: &Scenario, entries: &[Entry]) -> Result<String> {
    let task = Task::new(scenario)?;
    let feed_mm_s = task.feeds_mm_s.iter().copied().fold(0.0, f64::max);
    let given = entries.iter().find_map(|entry| entry.limits);
    let acceleration = given.map_or(feed_mm_s, |limits| limits.acceleration_mm_s2);
    let motions: Vec<_> = entries
        .iter()
        .map(|entry| ShownMotion {
            name: entry.method,
            positions: &entry.positions,
            limits: [
                Some(feed_mm_s),
                entry.limits.map(|limits| limits.acceleration_mm_s2),
                entry
                    .limits
                    .map(|limits| limits.jerk_mm_s3)
                    .filter(|jerk| jerk.is_finite()),
            ],
            tops: [
                1.25 * feed_mm_s,
                3.0 * acceleration,
                3.0 * acceleration / task.mode.damped_period_s(),
            ],
            limits_used: None,
        })
        .collect();
    let title = format!("{}: methods of motion", scenario.program.name);
    let subtitle = format!(
        "tolerance {} mm, a mode of {} Hz; sizes of the commanded derivatives",
        task.tolerance_mm, task.mode.frequency_hz
    );
    draw_comparison(&title, &subtitle, &motions)
}

const HEADER: [&str; 6] = [
    "method",
    "cycle\ns",
    "residual\nmm/s²",
    "corner\nmm",
    "joints\nrad/s²",
    "fit",
];

fn as_json(scenario: &Scenario, entries: &[Entry]) -> serde_json::Value {
    let rows: Vec<_> = entries
        .iter()
        .map(|entry| {
            json!({
                "method": entry.method,
                "figures": entry.figures,
                "is_fit": entry.is_fit(scenario.settings.robot.corner_tolerance_mm.into()),
            })
        })
        .collect();
    json!({
        "program": scenario.program.name,
        "tolerance_mm": scenario.settings.robot.corner_tolerance_mm,
        "methods": rows,
    })
}

fn table(scenario: &Scenario, entries: &[Entry]) -> String {
    let mut table = Table::new();
    let header = HEADER.map(|text| Cell::new(text).add_attribute(Attribute::Bold));
    table
        .load_style(UTF8_HORIZONTAL_ONLY.row_separator(LineStyle::none()))
        .set_header(header);
    let tolerance_mm = scenario.settings.robot.corner_tolerance_mm;
    for entry in entries {
        let Entry {
            method, figures, ..
        } = entry;
        let numbers = [
            format!("{:.3}", figures.cycle_time_s),
            format!("{:.2}", figures.residual_mm_s2),
            format!("{:.3}", figures.corner_error_mm),
            format!("{:.1}", figures.joint_acceleration_rad_s2),
            if entry.is_fit(tolerance_mm.into()) {
                "yes".into()
            } else {
                "no".into()
            },
        ];
        let mut row = vec![Cell::new(method)];
        row.extend(numbers.map(|text| Cell::new(text).set_alignment(CellAlignment::Right)));
        table.add_row(row);
    }
    let fastest = match fastest_fit(entries, tolerance_mm.into()) {
        Some(entry) => format!("{}, in {:.3} s", entry.method, entry.figures.cycle_time_s),
        None => "none".into(),
    };
    format!(
        "{}, tolerance {tolerance_mm} mm\n{table}\n\
         Fit: keeps the tolerance and leaves less than {STILL_MM_S2} mm/s². \
         The fastest of those: {fastest}.",
        scenario.program.name
    )
}
