//! `stillpoint compare`: all prefilters side by side.

use std::path::PathBuf;
use std::sync::Mutex;
use std::thread;

use anyhow::{Result, anyhow};
use clap::Args;
use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{Attribute, Cell, CellAlignment, LineStyle, Table};
use planner_core::config::{ConfigError, Robot, RobotConfig};
use planner_core::hop::HopAxes;
use planner_core::prefilter::{Kind, Mode, PrefilterError};
use serde::Serialize;

use super::ScenarioArgs;
use super::output::write_picture;
use crate::limit_use::limits_used;
use crate::payload_search::{self, Fastest};
use crate::pictures::{ShownMotion, draw_comparison};
use crate::progress::Progress;
use crate::scenario::{Outcome, Scenario};
use crate::summary::{Figures, Ratios};
use crate::vector::xyz;

/// Arguments of `compare`.
#[derive(Args, Debug)]
#[command(allow_negative_numbers = true)]
pub struct CompareArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Directory for a picture of speed, acceleration and jerk of each.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// All prefilters on one program.
#[derive(Debug, Serialize)]
pub struct Comparison {
    program: String,
    frequency_hz: f32,
    damping: f32,
    tolerance_mm: f32,
    plant: &'static str,
    /// The largest feedrate that the program gives; none without the checker's reading of it.
    #[serde(skip)]
    feed_mm_s: Option<f64>,
    prefilters: Vec<Row>,
    /// The fastest hops that the payload allows; empty without payload or hops.
    fastest_hops: Vec<Fastest>,
}

/// One prefilter.
#[derive(Debug, Serialize)]
struct Row {
    prefilter: &'static str,
    /// Why it cannot be used at this frequency; null if it can.
    refused: Option<String>,
    /// Boxes in s that the prefilter was given because limits need them.
    added_boxes_s: Vec<f64>,
    #[serde(flatten)]
    measured: Option<Measured>,
}

#[derive(Debug, Serialize)]
struct Measured {
    /// Where the tool is commanded to be, until it has come to rest.
    #[serde(skip)]
    positions: Vec<[f64; 3]>,
    /// The largest part used of any limit of joints and axes; empty without any.
    #[serde(skip)]
    limits_used: Vec<f64>,
    #[serde(flatten)]
    figures: Figures,
    #[serde(flatten)]
    ratios: Ratios,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// Whatever stops the program from running to its end, in one sentence.
pub fn execute(args: &CompareArgs) -> Result<String> {
    let scenario = args.scenario.scenario()?;
    let progress = if args.json {
        Progress::Hidden
    } else {
        Progress::Shown
    };
    let comparison = Comparison::run(&scenario, progress)?;
    let written = args
        .out
        .as_deref()
        .map(|directory| {
            let picture = comparison.draw(&scenario.settings.robot)?;
            write_picture(directory, "prefilters.svg", &picture)
        })
        .transpose()?;
    if args.json {
        return Ok(serde_json::to_string_pretty(&comparison)?);
    }
    let mut text = comparison.table();
    if let Some(path) = written {
        text += &format!("\n\nLook at:\n  {}", path.display());
    }
    Ok(text)
}

impl Comparison {
    /// Runs a scenario with each prefilter, on all cores.
    ///
    /// # Errors
    /// The program or a setting is refused. A prefilter that is too long at this frequency
    /// is left out instead.
    pub fn run(scenario: &Scenario, progress: Progress) -> Result<Self> {
        let unfiltered = scenario.run_with(Kind::None, Progress::Hidden)?;
        let impulses = &scenario.settings.robot.prefilter.impulses;
        let has_list = impulses.iter().skip(1).any(|impulse| impulse.weight > 0.0);
        // a list of one impulse is no prefilter of its own
        let kinds = Kind::ALL.into_iter();
        let kinds: Vec<_> = kinds
            .filter(|kind| has_list || kind.follows_the_mode())
            .collect();
        let bar = progress.bar("prefilters", kinds.len());
        let next = Mutex::new(kinds.iter().copied());
        let rows = Mutex::new(Vec::new());
        let work = || {
            loop {
                let Some(kind) = next.lock().ok().and_then(|mut next| next.next()) else {
                    return;
                };
                let row = row(scenario, kind, &unfiltered);
                bar.inc(1);
                if let Ok(mut rows) = rows.lock() {
                    rows.push((kind as usize, row));
                }
            }
        };
        let threads = thread::available_parallelism().map_or(1, usize::from);
        thread::scope(|scope| {
            for _ in 0..threads.min(kinds.len()) {
                scope.spawn(work);
            }
        });
        bar.finish_and_clear();
        let mut rows = rows
            .into_inner()
            .map_err(|_| anyhow!("a comparison was cut short: run it again"))?;
        rows.sort_by_key(|(order, _)| *order);
        let robot = &scenario.settings.robot;
        Ok(Self {
            fastest_hops: fastest_hops(scenario)?,
            program: scenario.program.name.clone(),
            frequency_hz: robot.prefilter.frequency_hz,
            damping: robot.prefilter.damping,
            tolerance_mm: robot.corner_tolerance_mm,
            plant: scenario.plant.name(),
            feed_mm_s: unfiltered.checked.as_ref().ok().and_then(|(program, _)| {
                let feeds = program.blocks.iter().filter_map(|block| block.feed_mm_s);
                feeds.reduce(f64::max)
            }),
            prefilters: rows
                .into_iter()
                .map(|(_, row)| row)
                .collect::<Result<_>>()?,
        })
    }

    /// Speed, acceleration and jerk of each prefilter, the robot's own first.
    ///
    /// # Errors
    /// Never in practice: the drawing goes to memory.
    pub fn draw(&self, robot: &RobotConfig) -> Result<String> {
        let feed_mm_s = self.feed_mm_s.unwrap_or(1.0);
        let own = robot.prefilter.kind;
        let path = robot.limits.path;
        let [velocity, acceleration, jerk] = [path.velocity, path.acceleration, path.jerk]
            .map(|limit| (limit > 0.0).then_some(f64::from(limit)));
        let fastest = [self.feed_mm_s, velocity].into_iter().flatten();
        let mode = Mode {
            frequency_hz: self.frequency_hz.into(),
            damping: self.damping.into(),
        };
        let period_s = mode.damped_period_s();
        let top = |limit: Option<f64>, unlimited: f64| limit.map_or(3.0 * unlimited, |l| 1.25 * l);
        let limits = [fastest.reduce(f64::min), acceleration, jerk];
        let tops = [
            1.25 * feed_mm_s,
            top(acceleration, feed_mm_s / period_s),
            top(jerk, feed_mm_s / period_s / period_s),
        ];
        let mut rows: Vec<_> = self.prefilters.iter().collect();
        rows.sort_by_key(|row| row.prefilter != own.name());
        let motions: Vec<_> = rows
            .into_iter()
            .filter_map(|row| Some((row.prefilter, row.measured.as_ref()?)))
            .map(|(name, measured)| ShownMotion {
                name,
                positions: &measured.positions,
                limits,
                tops,
                limits_used: (!measured.limits_used.is_empty()).then_some(&measured.limits_used),
            })
            .collect();
        let title = format!("{}: prefilters", self.program);
        let subtitle = format!(
            "{} Hz, damping {}, corner tolerance {} mm; sizes of the commanded derivatives",
            self.frequency_hz, self.damping, self.tolerance_mm
        );
        draw_comparison(&title, &subtitle, &motions)
    }

    /// As a table for a terminal.
    #[must_use]
    pub fn table(&self) -> String {
        let mut table = Table::new();
        let header = HEADER.map(|text| Cell::new(text).add_attribute(Attribute::Bold));
        table
            .load_style(UTF8_HORIZONTAL_ONLY.row_separator(LineStyle::none()))
            .set_header(header);
        for row in &self.prefilters {
            table.add_row(row.cells());
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        let refused: String = self
            .prefilters
            .iter()
            .filter_map(|row| Some(format!("\n{}: {}", row.prefilter, row.refused.as_ref()?)))
            .collect();
        let added: String = self
            .prefilters
            .iter()
            .filter_map(Row::added_in_words)
            .collect();
        format!(
            "{}: {} Hz, damping {}, corner tolerance {} mm, {} plant\n{table}\n\
             Settling to ±50 µm after the commanded stop; largest corner error; the tool's \
             acceleration in mm/s²\nin motion and in the 3 s after, and over both as a part of \
             that without a prefilter; peak joint accelerations.{added}{refused}{}",
            self.program,
            self.frequency_hz,
            self.damping,
            self.tolerance_mm,
            self.plant,
            self.hop_table()
        )
    }

    /// The fastest hops as a table of their own; nothing without any.
    fn hop_table(&self) -> String {
        if self.fastest_hops.is_empty() {
            return String::new();
        }
        let mut table = Table::new();
        let header = HOP_HEADER.map(|text| Cell::new(text).add_attribute(Attribute::Bold));
        table
            .load_style(UTF8_HORIZONTAL_ONLY.row_separator(LineStyle::none()))
            .set_header(header);
        for Fastest { limit, axes, run } in &self.fastest_hops {
            let mut cells = vec![limit.name().to_owned(), (*axes).to_owned()];
            cells.extend(run.map_or_else(
                || vec!["none".to_owned()],
                |run| {
                    vec![
                        format!("{:.0}", run.acceleration_mm_s2),
                        format!("{:.3}", run.cycle_time_s),
                        format!("{:.0}", run.payload_acceleration_max_mm_s2),
                        format!("{:.1}", run.payload_swing_max_mm),
                        format!("{:.1}", run.payload_overshoot_max_mm),
                    ]
                },
            ));
            table.add_row(cells);
        }
        for column in table.column_iter_mut().skip(2) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        format!(
            "\n\nThe fastest hops within the payload's limits, by the axes that are prefiltered; \
             slower ones keep the limit too:\n{table}"
        )
    }
}

/// The fastest hops by limit and axes. None if there is nothing to search.
fn fastest_hops(scenario: &Scenario) -> Result<Vec<Fastest>> {
    let hops = scenario.hops();
    let is_open = !hops.is_empty() && hops.iter().all(|hop| !hop.sets_acceleration);
    if scenario.settings.plant.payload.is_none() || !is_open {
        return Ok(Vec::new());
    }
    let search = |axes| move || payload_search::fastest(scenario, axes);
    let searched = thread::scope(|scope| {
        let threads = HopAxes::ALL.map(|axes| scope.spawn(search(axes)));
        threads.map(|thread| thread.join())
    });
    let mut found = Vec::new();
    for part in searched {
        let part = part.map_err(|_| anyhow!("a search was cut short: run it again"))?;
        found.extend(part?);
    }
    found.sort_by_key(|fastest| fastest.limit as usize);
    Ok(found)
}

const HOP_HEADER: [&str; 7] = [
    "limit",
    "axes",
    "acceleration\nmm/s²",
    "cycle\ns",
    "payload\nmm/s²",
    "swing\nmm",
    "after stop\nmm",
];

const HEADER: [&str; 10] = [
    "prefilter",
    "cycle\ns",
    "settling\ns",
    "corner\nmm",
    "in motion\nmax, RMS",
    "after stop\nmax, RMS",
    "of none\nmax",
    "of none\nRMS",
    "joint 1\nrad/s²",
    "joint 2\nrad/s²",
];

impl Row {
    /// What limits of acceleration and jerk have added to the prefilter.
    fn added_in_words(&self) -> Option<String> {
        let boxes = self.added_boxes_s.iter();
        let boxes: Vec<_> = boxes.map(|s| format!("{:.0} ms", s * 1e3)).collect();
        (!boxes.is_empty()).then(|| {
            let name = self.prefilter;
            format!(
                "\n{name}: with a moving average of {} besides, which its limits need",
                boxes.join(" and of ")
            )
        })
    }

    fn cells(&self) -> Vec<String> {
        let mut cells = vec![self.prefilter.to_owned()];
        let Some(Measured {
            figures, ratios, ..
        }) = &self.measured
        else {
            cells.push("refused".into());
            return cells;
        };
        let or_none = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".into(), |value| format!("{value:.digits$}"))
        };
        let percent = |ratio: Option<f64>| {
            ratio.map_or_else(|| "-".into(), |ratio| format!("{:.1} %", 100.0 * ratio))
        };
        cells.extend([
            format!("{:.3}", figures.cycle_time_s),
            or_none(figures.settling_time_s, 3),
            or_none(figures.max_corner_error_mm, 4),
            format!(
                "{:.0}, {:.0}",
                figures.vibration_motion_max_mm_s2, figures.vibration_motion_rms_mm_s2
            ),
            format!(
                "{:.1}, {:.1}",
                figures.vibration_residual_max_mm_s2, figures.vibration_residual_rms_mm_s2
            ),
            percent(ratios.vibration_max_ratio),
            percent(ratios.vibration_rms_ratio),
            format!("{:.1}", figures.joint1_peak_rad_s2),
            format!("{:.1}", figures.joint2_peak_rad_s2),
        ]);
        cells
    }
}

fn row(scenario: &Scenario, kind: Kind, unfiltered: &Outcome) -> Result<Row> {
    let mut config = scenario.settings.robot;
    config.prefilter.kind = kind;
    let robot = match Robot::new(&config) {
        Err(
            error @ ConfigError::Prefilter(
                PrefilterError::TooLong { .. } | PrefilterError::TooManyKinks,
            ),
        ) => {
            return Ok(Row {
                prefilter: kind.name(),
                refused: Some(error.to_string()),
                added_boxes_s: Vec::new(),
                measured: None,
            });
        }
        made => made?,
    };
    let outcome = match kind {
        Kind::None => unfiltered.clone(),
        _ => scenario.run_with(kind, Progress::Hidden)?,
    };
    Ok(Row {
        prefilter: kind.name(),
        refused: None,
        added_boxes_s: outcome.added_boxes_s.clone(),
        measured: Some(Measured {
            limits_used: limits_used(&robot, &outcome.trace),
            positions: outcome
                .trace
                .poses()
                .into_iter()
                .map(xyz)
                .take(outcome.trace.stop() + 1)
                .collect(),
            figures: Figures::new(&outcome),
            ratios: Ratios::new(&outcome, unfiltered),
        }),
    })
}
