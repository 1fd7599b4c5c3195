//! `stillpoint methods`: other methods of motion on the same program.

use anyhow::Result;
use clap::Args;
use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{Attribute, Cell, CellAlignment, LineStyle, Table};
use serde_json::json;

use super::ScenarioArgs;
use crate::methods::{Entry, compare};
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
    if args.json {
        return Ok(serde_json::to_string_pretty(&as_json(&scenario, &entries))?);
    }
    Ok(table(&scenario, &entries))
}

const HEADER: [&str; 5] = [
    "method",
    "cycle\ns",
    "residual\nmm/s²",
    "corner\nmm",
    "joints\nrad/s²",
];

fn as_json(scenario: &Scenario, entries: &[Entry]) -> serde_json::Value {
    let rows: Vec<_> = entries
        .iter()
        .map(|entry| json!({ "method": entry.method, "figures": entry.figures }))
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
    for Entry { method, figures } in entries {
        let numbers = [
            format!("{:.3}", figures.cycle_time_s),
            format!("{:.2}", figures.residual_mm_s2),
            format!("{:.3}", figures.corner_error_mm),
            format!("{:.1}", figures.joint_acceleration_rad_s2),
        ];
        let mut row = vec![Cell::new(method)];
        row.extend(numbers.map(|text| Cell::new(text).set_alignment(CellAlignment::Right)));
        table.add_row(row);
    }
    let tolerance_mm = scenario.settings.robot.corner_tolerance_mm;
    format!(
        "{}, tolerance {tolerance_mm} mm\n{table}",
        scenario.program.name
    )
}
