//! A trace of a program with hops: the paths between the hops, and the hops.
//!
//! The path of a hop is the robot's to choose but for its vertical parts, so that a hop divides
//! the program: what is before it and what comes behind it are paths from rest to rest.

use super::hops::{HopCheck, HopDefaults};
use super::matching::match_in_order;
use super::program::{Block, Program};
use super::report::{self, CheckOptions, Outline, Report, TraceRow, cycle_time_s};
use crate::vector::{distance, xyz};

/// A command nearer to a place than this has arrived there, in mm.
const ARRIVED_MM: f64 = 2e-4;

/// What a path may leave out where it has no tolerance, in mm.
const LEFT_OUT_MM: f64 = 1e-3;

/// Measures a trace against its program. Distances of an empty trace are infinite.
#[must_use]
pub fn check(program: &Program, trace: &[TraceRow], options: &CheckOptions) -> Report {
    let (mut rest, mut start) = (trace, program.start);
    let mut whole: Option<Report> = None;
    let mut hops = Vec::new();
    for part in program.blocks.split_inclusive(Block::is_hop) {
        let (path, hop) = match part.split_last() {
            Some((hop, path)) if hop.is_hop() => (path, Some(hop)),
            _ => (part, None),
        };
        let section = Program {
            blocks: path.to_vec(),
            start,
        };
        let mut rows = rest;
        if let Some(hop) = hop {
            let way = find_hop(&section, hop, rest, options);
            rows = way.map_or(&[], |(begin, _)| &rest[..=begin]);
            hops.extend(hop_check(hop, way.map(|(b, e)| &rest[b..=e]), options.hops));
            rest = way.map_or(&[], |(_, end)| &rest[end..]);
            start = hop.to;
        }
        // nothing but standing between two hops is no path
        if !path.is_empty() || program.blocks.is_empty() {
            let report = report::check(&section, rows, options);
            whole = Some(match whole {
                None => report,
                Some(before) => joined(before, report),
            });
        }
    }
    let end = program.end();
    let last = trace.last().map_or([f64::INFINITY; 4], |row| row.pose);
    let mut whole = whole.unwrap_or_else(|| report::check(&Program::default(), trace, options));
    if program.blocks.iter().all(Block::is_hop) && !hops.is_empty() {
        (whole.max_path_deviation_mm, whole.max_missed_mm) = (0.0, 0.0);
        whole.feed_excess_mm_s = f64::NEG_INFINITY;
    }
    Report {
        cycle_time_s: cycle_time_s(trace),
        drift_mm: distance(xyz(last), xyz(end)),
        drift_deg: (last[3] - end[3]).abs(),
        hops,
        ..whole
    }
}

fn joined(mut before: Report, after: Report) -> Report {
    before.corners.extend(after.corners);
    Report {
        max_path_deviation_mm: before
            .max_path_deviation_mm
            .max(after.max_path_deviation_mm),
        max_missed_mm: before.max_missed_mm.max(after.max_missed_mm),
        peak_speed_mm_s: before.peak_speed_mm_s.max(after.peak_speed_mm_s),
        feed_excess_mm_s: before.feed_excess_mm_s.max(after.feed_excess_mm_s),
        ..before
    }
}

fn hop_check(hop: &Block, way: Option<&[TraceRow]>, defaults: HopDefaults) -> Option<HopCheck> {
    let hop = hop.as_hop(defaults)?;
    let bent_mm = way.map_or(f64::INFINITY, |rows| {
        let points: Vec<_> = rows.iter().map(|row| xyz(row.pose)).collect();
        hop.bent_mm(&points)
    });
    Some(HopCheck { hop, bent_mm })
}

/// The rows in which a hop begins and ends: where the command last stands at its start, once it
/// has passed the path before, and where it first arrives at its end.
fn find_hop(
    before: &Program,
    hop: &Block,
    rows: &[TraceRow],
    options: &CheckOptions,
) -> Option<(usize, usize)> {
    let is_at = |place: [f64; 4]| {
        move |row: &TraceRow| (0..3).all(|i| (row.pose[i] - place[i]).abs() < ARRIVED_MM)
    };
    let (at_start, at_end) = (is_at(hop.from), is_at(hop.to));
    let leaves = |row: &usize| at_start(&rows[*row]) && !rows.get(row + 1).is_some_and(&at_start);
    let outline = Outline::new(before);
    let left_out = |begin: usize| {
        let points: Vec<_> = rows[..=begin].iter().map(|row| xyz(row.pose)).collect();
        match_in_order(&outline.points, &points).distance_mm
    };
    let tolerances = before.blocks.iter().map(|block| block.tolerance_mm);
    let widest_mm = tolerances
        .map(|tolerance_mm| tolerance_mm.unwrap_or(options.tolerance_mm))
        .filter(|tolerance_mm| tolerance_mm.is_finite())
        .fold(0.0, f64::max);
    let mut best: Option<(f64, usize)> = None;
    for begin in (0..rows.len()).filter(leaves) {
        let left_out_mm = left_out(begin);
        if best.is_none_or(|(least_mm, _)| left_out_mm < least_mm) {
            best = Some((left_out_mm, begin));
        }
        if left_out_mm <= widest_mm + LEFT_OUT_MM {
            break;
        }
    }
    let (_, begin) = best?;
    let length = rows[begin + 1..].iter().position(at_end)?;
    Some((begin, begin + 1 + length))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight lines of a millimetre a row.
    fn walk(points: &[[f64; 3]]) -> Vec<TraceRow> {
        let mut poses = vec![points[0]; 3];
        for pair in points.windows(2) {
            let steps = distance(pair[0], pair[1]).ceil().max(1.0) as u32;
            poses.extend((1..=steps).map(|step| {
                let part = f64::from(step) / f64::from(steps);
                std::array::from_fn(|i| pair[0][i] + part * (pair[1][i] - pair[0][i]))
            }));
            // everything comes to rest there
            poses.extend([pair[1]; 3]);
        }
        let rows = poses.into_iter().zip(0_u32..);
        rows.map(|([x, y, z], k)| TraceRow {
            time_s: f64::from(k) * 1e-3,
            pose: [x, y, z, 0.0],
        })
        .collect()
    }

    const PROGRAM: &str = "G0 X0 Y0 Z0\nG1 X20 F60000\nX0\nM103 X100 Z10 Q20 R40\nM3\nG1 Y30\nX60\n\
                           M103 X0 Y0 Z0 Q30 P2\nM103 X100 Z10 Q5";

    /// Through A twice, a hop that leans by `lean_mm` at the height, two lines, and two hops.
    fn trace(lean_mm: f64) -> Vec<TraceRow> {
        walk(&[
            [0.0, 0.0, 0.0],
            [20.0, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [lean_mm, 0.0, 20.0],
            [0.0, 0.0, 50.0],
            [100.0, 0.0, 50.0],
            [100.0, 0.0, 10.0],
            [100.0, 30.0, 10.0],
            [60.0, 30.0, 10.0],
            [60.0, 30.0, 40.0],
            [0.0, 0.0, 40.0],
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 5.0],
            [100.0, 0.0, 15.0],
            [100.0, 0.0, 10.0],
        ])
    }

    const OPTIONS: CheckOptions = CheckOptions {
        rapid_mm_s: 1000.0,
        tolerance_mm: 0.5,
        feed_window_mm: 60.0,
        hops: HopDefaults {
            height_mm: 50.0,
            tolerance_mm: 0.5,
        },
    };

    #[test]
    fn paths_between_hops_and_the_hops_are_judged() {
        let program = Program::parse(PROGRAM).unwrap();
        let report = check(&program, &trace(0.3), &OPTIONS);
        assert_eq!(report.violations(1e-4, 1e-3), [""; 0], "{report:?}");
        assert_eq!(report.corners.len(), 2);
        let bends: Vec<_> = report.hops.iter().map(|hop| hop.bent_mm).collect();
        assert!((bends[0] - 0.3).abs() < 1e-4 && bends[1] < 1e-4 && bends[2] < 1e-4);
        assert_eq!(report.hops[1].hop.tolerance_mm, 2.0);
        assert!(report.drift_mm < 1e-9);

        let leant = check(&program, &trace(0.7), &OPTIONS);
        let found = leant.violations(1e-4, 1e-3);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("hop of line 4 bent by 0.7000 mm"),
            "{found:?}"
        );
    }

    #[test]
    fn a_path_left_and_a_hop_that_is_not_there_are_found() {
        let program = Program::parse(PROGRAM).unwrap();
        let mut rows = trace(0.0);
        let aside = rows
            .iter()
            .position(|row| row.pose[..3] == [80.0, 30.0, 10.0]);
        rows[aside.unwrap()].pose[1] += 0.6;
        let report = check(&program, &rows, &OPTIONS);
        assert!(
            (report.max_path_deviation_mm - 0.6).abs() < 1e-6,
            "{report:?}"
        );

        let end = rows
            .iter()
            .position(|row| row.pose[..3] == [60.0, 30.0, 10.0]);
        let report = check(&program, &rows[..end.unwrap()], &OPTIONS);
        let found = report.violations(1e-4, 1e-3);
        assert!(
            found.iter().any(|v| v.starts_with("hop of line 8")),
            "{found:?}"
        );
        assert!(
            !check(&program, &[], &OPTIONS)
                .violations(1.0, 1.0)
                .is_empty()
        );
    }

    #[test]
    fn a_program_of_hops_alone_has_no_path_to_leave() {
        let program = Program::parse("G0 X0 Y0 Z0\nM103 X100 Q10\nM2").unwrap();
        let rows = walk(&[
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 30.0],
            [100.0, 0.0, 30.0],
            [100.0, 0.0, 0.0],
        ]);
        let report = check(&program, &rows, &OPTIONS);
        assert_eq!(report.violations(1e-4, 1e-3), [""; 0], "{report:?}");
        assert_eq!((report.max_path_deviation_mm, report.hops.len()), (0.0, 1));
    }
}
