//! What a run leaves behind: lines of figures, and the files of `--out`.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::limit_use::LimitUse;
use crate::paired_run::PairedRun;
use crate::pictures;
use crate::summary::{PayloadFigures, Summary};

/// A figure in words.
pub struct Figure {
    /// What it is.
    pub name: &'static str,
    /// Its value with its unit.
    pub value: String,
}

/// The figures of a run, in words.
#[must_use]
pub fn figures(summary: &Summary) -> Vec<Figure> {
    let figures = &summary.figures;
    let ratios = &summary.ratios;
    let unknown = || "not measured".to_owned();
    let vibration = |value: f64, ratio: Option<f64>| match ratio {
        Some(ratio) if summary.prefilter != "none" => {
            format!("{value:.1} mm/s², {}", lower_than_unfiltered(ratio))
        }
        _ => format!("{value:.1} mm/s²"),
    };
    let length = |value: Option<f64>| value.map_or_else(unknown, |mm| format!("{mm:.4} mm"));
    let mut list = vec![
        ("cycle time", format!("{:.3} s", figures.cycle_time_s)),
        (
            "settling to ±50 µm",
            figures.settling_time_s.map_or_else(
                || "not within a minute".into(),
                |s| format!("{s:.3} s after the commanded stop"),
            ),
        ),
        ("largest corner error", length(figures.max_corner_error_mm)),
        ("largest deviation", length(figures.max_path_deviation_mm)),
        (
            "vibration maximum",
            vibration(figures.vibration_max_mm_s2, ratios.vibration_max_ratio),
        ),
        (
            "vibration RMS",
            vibration(figures.vibration_rms_mm_s2, ratios.vibration_rms_ratio),
        ),
        (
            "after the stop",
            vibration(
                figures.vibration_residual_max_mm_s2,
                ratios.vibration_residual_ratio,
            ),
        ),
    ];
    if figures.vertical_deviation_max_mm.is_some() {
        list.push((
            "bent where vertical",
            length(figures.vertical_deviation_max_mm),
        ));
    }
    list.extend(payload_figures(&figures.payload));
    if let Some(instructions) = summary.tick_instructions_max {
        list.push(("worst tick", format!("{instructions} instructions")));
    }
    if !summary.added_boxes_s.is_empty() {
        let boxes = summary.added_boxes_s.iter();
        let boxes: Vec<_> = boxes.map(|s| format!("{:.0} ms", s * 1e3)).collect();
        let text = format!(
            "{} of moving average, without which limits could not be kept",
            boxes.join(" and ")
        );
        list.push(("added to the prefilter", text));
    }
    let limits = summary.limits.iter();
    list.extend(limits.map(|limit| ("limit", limit_in_words(limit))));
    list.into_iter()
        .map(|(name, value)| Figure { name, value })
        .collect()
}

/// What the payload does, in words; nothing where there is none.
fn payload_figures(figures: &PayloadFigures) -> Vec<(&'static str, String)> {
    let (Some(acceleration), Some(swing), Some(overshoot), Some(peeled_off)) = (
        figures.payload_acceleration_max_mm_s2,
        figures.payload_swing_max_mm,
        figures.payload_overshoot_max_mm,
        figures.peeled_off,
    ) else {
        return Vec::new();
    };
    let held = if peeled_off { "it peels off" } else { "held" };
    vec![
        (
            "payload acceleration",
            format!("{acceleration:.0} mm/s², {held}"),
        ),
        (
            "payload swing",
            format!("{swing:.2} mm, {overshoot:.2} mm after the stop"),
        ),
    ]
}

/// A limit and what became of it.
fn limit_in_words(limit: &LimitUse) -> String {
    let LimitUse {
        limit: name,
        unit,
        allowed,
        largest,
        lowered_segments,
        lowest_feed_mm_s,
    } = limit;
    let lowered = match (lowered_segments, lowest_feed_mm_s) {
        (0, _) => String::new(),
        (count, None) => format!(", lowers the feed of {count} segments"),
        (count, Some(feed)) => {
            format!(", lowers the feed of {count} segments, down to {feed:.1} mm/s")
        }
    };
    format!("{name}: {largest:.1} of {allowed} {unit}{lowered}")
}

/// A ratio of vibrations as a sentence's end.
#[must_use]
pub fn lower_than_unfiltered(ratio: f64) -> String {
    if ratio <= 1.0 {
        format!("{} lower than without a prefilter", percent(1.0 - ratio))
    } else {
        format!("{} higher than without a prefilter", percent(ratio - 1.0))
    }
}

/// A fraction in percent, with as many digits as tell it from 100 %.
#[must_use]
pub fn percent(fraction: f64) -> String {
    let digits = if fraction > 0.99 { 2 } else { 0 };
    format!("{:.digits$} %", 100.0 * fraction)
}

/// Writes one picture into a directory; yields its path.
///
/// # Errors
/// A directory or file that cannot be written.
pub fn write_picture(directory: &Path, name: &str, picture: &str) -> Result<PathBuf> {
    let at = |path: &Path| format!("{} cannot be written", path.display());
    fs::create_dir_all(directory).with_context(|| at(directory))?;
    let path = directory.join(name);
    fs::write(&path, picture).with_context(|| at(&path))?;
    Ok(path)
}

/// Writes trace, summary and pictures; yields their paths.
///
/// # Errors
/// A directory or file that cannot be written.
pub fn write_files(directory: &Path, run: &PairedRun) -> Result<Vec<PathBuf>> {
    let at = |path: &Path| format!("{} cannot be written", path.display());
    fs::create_dir_all(directory).with_context(|| at(directory))?;
    let mut written = Vec::new();

    let path = directory.join("trace.csv");
    let file = File::create(&path).with_context(|| at(&path))?;
    let trace = &run.outcome.trace;
    trace
        .write_csv(BufWriter::new(file))
        .with_context(|| at(&path))?;
    written.push(path);

    let mut texts = vec![("summary.json", run.summary.json()? + "\n")];
    texts.extend(pictures::draw(run)?);
    for (name, text) in texts {
        let path = directory.join(name);
        fs::write(&path, text).with_context(|| at(&path))?;
        written.push(path);
    }
    Ok(written)
}
