//! Methods that overlap the segments' filtered feedrates: the hybrid method, VPO and ADAI.

use std::sync::Arc;

use super::{Point, STEP_S, Task, corner_error_mm};
use crate::oracle::{Path, Prefilter, Schedule, Segment};
use crate::vector::xyz;

/// Halvings of the feedrate's range.
const HALVINGS: u32 = 30;

fn path(task: &Task, prefilter: &Prefilter, tolerance_mm: f64, share: f64) -> Path {
    let prefilter = Arc::new(prefilter.clone());
    let segments = task.curves.iter().zip(&task.feeds_mm_s);
    let segments: Vec<_> = segments
        .map(|(&geometry, feed)| Segment {
            geometry,
            feed: feed * share,
            accelerate: Arc::clone(&prefilter),
            decelerate: Arc::clone(&prefilter),
        })
        .collect();
    let tolerances_mm = vec![tolerance_mm; segments.len().saturating_sub(1)];
    Path {
        segments,
        tolerances_mm,
    }
}

fn samples(schedule: &Schedule<'_>) -> Vec<Point> {
    let poses = schedule.sample(STEP_S, STEP_S);
    poses.into_iter().map(xyz).collect()
}

/// Overlaps as long as the tolerance allows.
pub fn within_tolerance(task: &Task, prefilter: &Prefilter) -> Vec<Point> {
    samples(&path(task, prefilter, task.tolerance_mm, 1.0).schedule())
}

/// The same overlaps, rounded up to the millisecond as \[Yeh26\] Table 2 does.
pub fn rounded_up(task: &Task, prefilter: &Prefilter) -> Vec<Point> {
    let path = path(task, prefilter, task.tolerance_mm, 1.0);
    let mut schedule = path.schedule();
    let mut earlier_s = 0.0;
    for i in 1..path.segments.len() {
        let overlap_s = schedule.stops_s[i - 1] + prefilter.length_s() - schedule.starts_s[i];
        let rounded_s = (overlap_s / STEP_S).ceil() * STEP_S;
        earlier_s += rounded_s.min(prefilter.length_s()) - overlap_s;
        shift(&mut schedule, i, earlier_s);
        earlier_s = 0.0;
    }
    samples(&schedule)
}

/// Begins segment `first` and all behind it earlier.
fn shift(schedule: &mut Schedule<'_>, first: usize, earlier_s: f64) {
    let times = schedule.starts_s.iter_mut().zip(&mut schedule.stops_s);
    for (start_s, stop_s) in times.skip(first) {
        *start_s -= earlier_s;
        *stop_s -= earlier_s;
    }
}

/// No dwell at any corner, at a share of the feedrates.
pub fn without_dwell(task: &Task, prefilter: &Prefilter, share: f64) -> Vec<Point> {
    samples(&path(task, prefilter, f64::INFINITY, share).schedule())
}

/// No dwell at any corner, at the highest share of the feedrates that keeps the tolerance.
pub fn without_dwell_within_tolerance(task: &Task, prefilter: &Prefilter) -> Vec<Point> {
    let run = |share| without_dwell(task, prefilter, share);
    let (mut low, mut high) = (1e-3, 1.0);
    if corner_error_mm(task, &run(high)) <= task.tolerance_mm {
        return run(high);
    }
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if corner_error_mm(task, &run(middle)) <= task.tolerance_mm {
            low = middle;
        } else {
            high = middle;
        }
    }
    run(low)
}
