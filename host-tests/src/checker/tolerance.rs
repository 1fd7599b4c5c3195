//! How much of the tolerance a trace uses, where the tolerance changes on the way.

use super::matching::are_in_order;
use super::program::Program;
use super::report::{Outline, TraceRow};
use crate::vector::xyz;

/// How much more than the tolerance is looked for.
const MOST: f64 = 8.0;

/// How exactly it is found, as a part of the tolerance.
const RESOLUTION: f64 = 1e-2;

/// The largest parts of the tolerance that a trace uses: within it they are at most 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToleranceUse {
    /// By points of the trace that are off the path; infinite far outside.
    pub strayed: f64,
    /// By points where the path's segments join, or of its arcs, that the trace passes at a
    /// distance; infinite far outside.
    pub missed: f64,
}

/// What a trace uses of the tolerance along its program.
///
/// Along a segment the tolerance is the larger one of the corners at its ends, and nothing
/// where it begins or ends the path. `resolution_mm` comes on top of it; for what is missed
/// `cut_mm`, by which straight lines between rows cut a corner.
#[must_use]
pub fn tolerance_use(
    program: &Program,
    trace: &[TraceRow],
    tolerance_mm: f64,
    (resolution_mm, cut_mm): (f64, f64),
) -> ToleranceUse {
    let outline = Outline::new(program);
    let corner_mm = |block: usize| program.blocks[block].tolerance_mm.unwrap_or(tolerance_mm);
    let mut chords_mm = Vec::new();
    for (i, &(block, first, last)) in outline.ends.iter().enumerate() {
        let start_mm = if i > 0 { corner_mm(block) } else { 0.0 };
        let next = outline.ends.get(i + 1);
        let end_mm = next.map_or(0.0, |&(next, ..)| corner_mm(next));
        chords_mm.extend((first..last).map(|_| start_mm.max(end_mm)));
    }
    let chord_mm = |chord: usize| chords_mm.get(chord).copied().unwrap_or(0.0);
    let point_mm = |point: usize| chord_mm(point.saturating_sub(1)).max(chord_mm(point));
    let points: Vec<_> = trace.iter().map(|row| xyz(row.pose)).collect();
    ToleranceUse {
        strayed: least_part(|part| {
            are_in_order(&points, &outline.points, |_, chord| {
                part * chord_mm(chord) + resolution_mm
            })
        }),
        missed: least_part(|part| {
            are_in_order(&outline.points, &points, |point, _| {
                part * point_mm(point) + resolution_mm + cut_mm
            })
        }),
    }
}

/// The smallest part for which something holds; exactly 1 is looked at first.
fn least_part(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = match (holds(1.0), holds(MOST)) {
        (true, _) => (0.0, 1.0),
        (false, true) => (1.0, MOST),
        (false, false) => return f64::INFINITY,
    };
    while high - low > RESOLUTION {
        let middle = f64::midpoint(low, high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: &str = "G0 X0 Y0\nF600\nG64 P0.2\nG1 X10\nG1 Y10\nG64 P1\nG1 X0\nG1 Y20\nG1 X10";

    fn used(points: &[[f64; 2]]) -> ToleranceUse {
        let program = Program::parse(PROGRAM).unwrap();
        let trace: Vec<_> = points
            .iter()
            .zip(0_u32..)
            .map(|(&[x, y], i)| TraceRow {
                time_s: f64::from(i),
                pose: [x, y, 0.0, 0.0],
            })
            .collect();
        tolerance_use(&program, &trace, 0.5, (1e-9, 0.0))
    }

    #[test]
    fn each_segment_has_the_tolerance_of_its_corners() {
        let path = [
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 10.0],
            [0.0, 10.0],
            [0.0, 20.0],
            [10.0, 20.0],
        ];
        let exact = used(&path);
        assert!(exact.strayed <= RESOLUTION && exact.missed <= RESOLUTION);
        let with = |point| {
            let mut points = path.to_vec();
            points.insert(1, point);
            used(&points).strayed
        };
        assert!((with([5.0, 0.1]) - 0.5).abs() < 2e-3);
        assert!((with([5.0, 0.3]) - 1.5).abs() < 8e-3);
        // 15 times the tolerance here, 5 times that of the segment after the corner
        assert!((with([5.0, 3.0]) - 5.0).abs() < 8e-3);
        assert_eq!(with([5.0, -9.0]), f64::INFINITY);
        // the corner at (10, 10) has 1 mm
        let mut points = path.to_vec();
        points.insert(2, [10.5, 5.0]);
        assert!((used(&points).strayed - 0.5).abs() < 2e-3);
    }

    #[test]
    fn a_corner_cut_is_missed() {
        let cut = used(&[
            [0.0, 0.0],
            [9.7, 0.0],
            [10.0, 0.4],
            [10.0, 10.0],
            [0.0, 10.0],
            [0.0, 20.0],
            [10.0, 20.0],
        ]);
        // the corner is 0.24 mm from the line between the two points
        assert!(
            (cut.missed - 1.2).abs() < 0.02 || cut.missed < 1.0,
            "{cut:?}"
        );
    }
}
