//! The path, its corners enlarged.

use std::f64::consts::TAU;

use anyhow::Result;
use planner_core::units::TICK_S;

use super::canvas::{
    Area, BACKGROUND, COMMAND, CONTRAST, INK, LIMIT, Point, UNITS, axes, caption, dashed, dot,
    full, headed, limit, lines, note, picture, plot_size,
};
use super::polyline::{bounds, clip, equal_scale, thin, thin_to};
use crate::checker::hops::HopCheck;
use crate::checker::{CornerCheck, Program, Report};
use crate::paired_run::PairedRun;
use crate::vector::xyz;

const SIZE: (u32, u32) = (1280, 800);
const MAP_WIDTH: u32 = 600;

/// Corners that are enlarged: those missed most, among equals the sharpest.
const CORNERS: usize = 6;

/// Points of a line at the most, so that a long program's picture stays small.
const POINTS: usize = 20_000;

/// Half the side of an enlarged corner in tolerances, ...
const REACH: f64 = 2.2;

/// ... and in mm where the corner is an exact stop.
const REACH_AT_STOP_MM: f64 = 0.5;

/// The two axes of space that a picture shows.
#[derive(Clone, Copy)]
struct Plane([usize; 2]);

/// The lines that map and corners share.
struct Lines {
    plane: Plane,
    /// In parts: between the vertical ends of a hop no way is programmed.
    programmed: Vec<Vec<Point>>,
    commanded: Vec<Point>,
    tool: Vec<Point>,
}

/// Draws the picture.
pub fn draw(run: &PairedRun) -> Result<String> {
    let lines = Lines::new(run);
    let corners = enlarged_corners(run);
    let summary = &run.summary;
    let title = format!("{}: the path", summary.program_name());
    let subtitle = subtitle(run);
    let mut legend = vec![
        full(BACKGROUND, 6, "programmed"),
        full(COMMAND, 2, "commanded"),
        full(CONTRAST, 2, "tool, simulated"),
    ];
    if corners.iter().any(has_tolerance) {
        legend.push(limit("corner tolerance"));
    }
    picture(SIZE, |root| {
        let body = headed(root, &title, &subtitle, &legend)?;
        if corners.is_empty() {
            return map(&body, &lines, &corners);
        }
        let (left, right) = body.split_horizontally(MAP_WIDTH * UNITS);
        map(&left, &lines, &corners)?;
        let columns = if corners.len() > 2 { 2 } else { 1 };
        let tiles = right.split_evenly((corners.len().div_ceil(columns), columns));
        for (number, (tile, corner)) in (1..).zip(tiles.iter().zip(&corners)) {
            enlarged(tile, &lines, corner, number)?;
        }
        Ok(())
    })
}

fn subtitle(run: &PairedRun) -> String {
    let summary = &run.summary;
    let length = |mm: Option<f64>| mm.map_or("not measured".into(), |mm| format!("{mm:.4} mm"));
    format!(
        "{}, tolerance {} mm: corners missed by {} at the most, path left by {}",
        summary.prefilter_in_words(),
        summary.tolerance_mm,
        length(summary.figures.max_corner_error_mm),
        length(summary.figures.max_path_deviation_mm),
    )
}

/// Whether a corner has a tolerance to draw: no exact stop, and no given overlap.
fn has_tolerance(corner: &CornerCheck) -> bool {
    corner.tolerance_mm > 0.0 && corner.tolerance_mm.is_finite()
}

/// The corners to enlarge, in the order of the path.
fn enlarged_corners(run: &PairedRun) -> Vec<CornerCheck> {
    let Ok((_, report)) = &run.outcome.checked else {
        return Vec::new();
    };
    // misses that differ by less than a hundredth of the tolerance are equal
    let miss = |corner: &CornerCheck| match corner.tolerance_mm {
        _ if has_tolerance(corner) => (100.0 * corner.error_mm / corner.tolerance_mm).round(),
        _ => 0.0,
    };
    let rank = |corner: &CornerCheck| (miss(corner), corner.angle_deg);
    let mut corners = report.corners.clone();
    corners.sort_by(|a, b| {
        let (a, b) = (rank(a), rank(b));
        b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    corners.truncate(CORNERS);
    corners.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    corners
}

impl Plane {
    /// The plane in which a path is widest: from above, or from a side if it is higher than it
    /// is wide in one direction.
    fn of(poses: &[[f64; 4]]) -> Self {
        let spread = |axis: usize| {
            let ends = poses
                .iter()
                .fold((f64::MAX, f64::MIN), |(low, high), pose| {
                    (low.min(pose[axis]), high.max(pose[axis]))
                });
            ends.1 - ends.0
        };
        let (x, y, z) = (spread(0), spread(1), spread(2));
        Self(match () {
            () if z <= x.min(y) => [0, 1],
            () if x >= y => [0, 2],
            () => [1, 2],
        })
    }

    fn point(self, point: [f64; 3]) -> Point {
        (point[self.0[0]], point[self.0[1]])
    }

    fn labels(self, rest: &str) -> [String; 2] {
        self.0
            .map(|axis| format!("{}{rest}", ["X", "Y", "Z"][axis]))
    }
}

/// The programmed path in parts: from hop to hop, with the vertical part at either end of one.
fn programmed(program: &Program, report: &Report) -> Vec<Vec<[f64; 3]>> {
    let mut parts = vec![vec![xyz(program.start)]];
    let mut hops = report.hops.iter();
    for block in &program.blocks {
        let hop = block.is_hop().then(|| hops.next()).flatten();
        if let Some(HopCheck { hop, .. }) = hop {
            let over = |[x, y, z]: [f64; 3]| [x, y, z + hop.height_mm];
            if let Some(part) = parts.last_mut() {
                part.push(over(hop.from));
            }
            parts.push(vec![over(hop.to)]);
        }
        if let Some(part) = parts.last_mut() {
            part.extend(block.points());
        }
    }
    parts
}

impl Lines {
    fn new(run: &PairedRun) -> Self {
        let trace = &run.outcome.trace;
        let plane = Plane::of(&trace.poses());
        let programmed = run
            .outcome
            .checked
            .as_ref()
            .map_or(Vec::new(), |(program, report)| {
                let parts = programmed(program, report).into_iter();
                parts
                    .map(|part| part.into_iter().map(|point| plane.point(point)).collect())
                    .collect()
            });
        Self {
            programmed,
            commanded: trace
                .poses()
                .into_iter()
                .map(|pose| plane.point(xyz(pose)))
                .collect(),
            tool: trace
                .tool
                .iter()
                .map(|sample| plane.point(sample.position_mm))
                .collect(),
            plane,
        }
    }
}

/// The whole path, corners numbered.
fn map(area: &Area<'_>, path: &Lines, corners: &[CornerCheck]) -> Result<()> {
    let Some(around) = bounds(&path.commanded) else {
        return Ok(());
    };
    let size = plot_size(area);
    let window = equal_scale(around, size);
    let unit = (window[0].1 - window[0].0) / size.0;
    let mut chart = axes(
        area,
        window,
        path.plane.labels(", mm").each_ref().map(String::as_str),
        [8, 8],
    )?;
    let programmed = path.programmed.iter().map(|part| (part, BACKGROUND, 6));
    let moved = [(&path.tool, CONTRAST, 1), (&path.commanded, COMMAND, 2)];
    for (points, colour, width) in programmed.chain(moved) {
        let points = thin_to(points, unit, POINTS);
        lines(&mut chart, clip(&points, window), colour, width)?;
    }
    let middle = (
        f64::midpoint(window[0].0, window[0].1),
        f64::midpoint(window[1].0, window[1].1),
    );
    for (name, at) in marks(path, corners, 16.0 * f64::from(UNITS) * unit) {
        let outward = (at.0 - middle.0, middle.1 - at.1);
        let length = outward.0.hypot(outward.1).max(unit);
        // (half a letter is less than 5 pixels wide)
        let away = (13.0 + 4.5 * name.len() as f64, 20.0);
        let offset = (
            (outward.0 / length * away.0).round() as i32,
            (outward.1 / length * away.1).round() as i32,
        );
        dot(&mut chart, at, INK)?;
        note(&chart, &name, at, offset, INK)?;
    }
    Ok(())
}

/// Start, end and corners with their names, those closer than `near` under one.
fn marks(path: &Lines, corners: &[CornerCheck], near: f64) -> Vec<(String, Point)> {
    let ends = [path.commanded.first(), path.commanded.last()];
    let ends = ["start", "end"].into_iter().zip(ends);
    let ends = ends.filter_map(|(name, at)| Some((name.to_owned(), *at?)));
    let corners = (1..).zip(corners).map(|(number, corner)| {
        let at = path.plane.point(corner.point_mm);
        (format!("{number}"), at)
    });
    let mut marks: Vec<(String, Point)> = Vec::new();
    for (name, at) in ends.chain(corners) {
        let same =
            |(_, other): &&mut (String, Point)| (at.0 - other.0).hypot(at.1 - other.1) < near;
        match marks.iter_mut().find(same) {
            Some((names, _)) => *names += &format!(", {name}"),
            None => marks.push((name, at)),
        }
    }
    marks
}

/// The part of a line that passes a corner, around the row `at`, while within `reach`.
fn passage(points: &[Point], at: usize, corner: Point, reach: f64) -> &[Point] {
    let outside = |point: &Point| (point.0 - corner.0).hypot(point.1 - corner.1) > reach;
    let at = at.min(points.len());
    let (before, after) = points.split_at(at);
    let from = before.iter().rposition(outside).unwrap_or(0);
    let to = after
        .iter()
        .position(outside)
        .map_or(points.len(), |row| at + row + 1);
    &points[from..to]
}

/// One corner, with the circle of its tolerance.
fn enlarged(area: &Area<'_>, path: &Lines, corner: &CornerCheck, number: usize) -> Result<()> {
    let text = format!(
        "{number}: {:.1}°, missed by {:.4} mm",
        corner.angle_deg, corner.error_mm
    );
    let area = caption(area, &text)?;
    let reach = match corner.tolerance_mm {
        _ if has_tolerance(corner) => REACH * corner.tolerance_mm,
        tolerance if tolerance > 0.0 => (REACH * corner.error_mm).max(REACH_AT_STOP_MM),
        _ => REACH_AT_STOP_MM,
    };
    let size = plot_size(&area);
    let side = [(-reach, reach), (-reach, reach)];
    let window = equal_scale(side, size);
    let unit = (window[0].1 - window[0].0) / size.0;
    let mut chart = axes(
        &area,
        window,
        path.plane
            .labels(" − corner, mm")
            .each_ref()
            .map(String::as_str),
        [5, 5],
    )?;
    let (x, y) = path.plane.point(corner.point_mm);
    let row = (corner.time_s / TICK_S).round() as usize;
    let seen = (window[0].1).hypot(window[1].1);
    let pass = |points| passage(points, row, (x, y), seen);
    let programmed = path.programmed.iter();
    let programmed = programmed.map(|part| (part.as_slice(), BACKGROUND, 6));
    let passed = [
        (pass(&path.tool), CONTRAST, 2),
        (pass(&path.commanded), COMMAND, 2),
    ];
    for (points, colour, width) in programmed.chain(passed) {
        let points: Vec<_> = points
            .iter()
            .map(|point| (point.0 - x, point.1 - y))
            .collect();
        let parts = clip(&points, window)
            .into_iter()
            .map(|part| thin(part, unit));
        lines(&mut chart, parts, colour, width)?;
    }
    if has_tolerance(corner) {
        let circle: Vec<_> = (0..=180)
            .map(|k| {
                let (sin, cos) = (f64::from(k) / 180.0 * TAU).sin_cos();
                (corner.tolerance_mm * cos, corner.tolerance_mm * sin)
            })
            .collect();
        dashed(&mut chart, clip(&circle, window), LIMIT)?;
    }
    Ok(())
}
