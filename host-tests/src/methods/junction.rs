//! Junction velocities with a shaper for each axis, as 3D-printer firmware does it.
//!
//! The velocity along the path changes by a constant acceleration. At a corner that turns by
//! `β` it is at most that of a circle which misses the corner by a deviation `δ`,
//!
//! ```text
//! v² = a δ sin(φ/2) / (1 − sin(φ/2)),   φ = π − β
//! ```
//!
//! and on an arc `v² ≤ a R`. The shaper then works on X, Y and Z; nothing else makes room for
//! what it cuts off the corners.

use super::{Point, STEP_S, Task, corner_error_mm};
use crate::oracle::path::change_angle_deg;
use crate::oracle::{Geometry, Prefilter};
use crate::vector::xyz;

/// Deviations that tuning tries, as parts of the tolerance.
const DEVIATIONS: [f64; 6] = [0.0, 0.02, 0.1, 0.3, 0.6, 1.0];

/// Halvings of the acceleration's range.
const HALVINGS: u32 = 25;

/// The command with a junction deviation in mm.
pub fn run(
    task: &Task,
    shaper: &Prefilter,
    acceleration_mm_s2: f64,
    deviation_mm: f64,
) -> Vec<Point> {
    shaped(shaper, &unshaped(task, acceleration_mm_s2, deviation_mm))
}

/// The fastest command that keeps the corner tolerance, with up to an acceleration.
pub fn within_tolerance(task: &Task, shaper: &Prefilter, most_mm_s2: f64) -> Vec<Point> {
    let keeps = |command: &[Point]| corner_error_mm(task, command) <= task.tolerance_mm;
    let mut best: Option<Vec<Point>> = None;
    for part in DEVIATIONS {
        let at = |acceleration| run(task, shaper, acceleration, part * task.tolerance_mm);
        let (mut low, mut high) = (most_mm_s2 * 1e-4, most_mm_s2);
        if keeps(&at(high)) {
            low = high;
        }
        for _ in 0..HALVINGS {
            let middle = (low * high).sqrt();
            *(if keeps(&at(middle)) {
                &mut low
            } else {
                &mut high
            }) = middle;
        }
        let command = at(low);
        let is_better = best.as_ref().is_none_or(|best| command.len() < best.len());
        if keeps(&command) && is_better {
            best = Some(command);
        }
    }
    best.unwrap_or_else(|| run(task, shaper, most_mm_s2, 0.0))
}

/// Velocity at each corner, the start and the end included, by look-ahead both ways.
fn junctions(task: &Task, acceleration: f64, deviation_mm: f64) -> Vec<f64> {
    let count = task.curves.len();
    let mut squares = vec![0.0; count + 1];
    for (i, corner) in task.curves.windows(2).enumerate() {
        let (before, after) = (corner[0], corner[1]);
        let turn_deg = change_angle_deg(
            xyz(before.tangent(before.length())),
            xyz(after.tangent(0.0)),
        );
        let half_sin = ((180.0 - turn_deg) / 2.0).to_radians().sin();
        let slower = top(task, i, acceleration).min(top(task, i + 1, acceleration));
        let by_deviation = acceleration * deviation_mm * half_sin / (1.0 - half_sin).max(1e-9);
        squares[i + 1] = by_deviation.min(slower * slower);
    }
    let reach = |i: usize| 2.0 * acceleration * task.curves[i].length();
    for i in 0..count {
        squares[i + 1] = f64::min(squares[i + 1], squares[i] + reach(i));
    }
    for i in (0..count).rev() {
        squares[i] = f64::min(squares[i], squares[i + 1] + reach(i));
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// The highest velocity on a segment.
fn top(task: &Task, i: usize, acceleration: f64) -> f64 {
    match task.curves[i] {
        Geometry::Line { .. } => task.feeds_mm_s[i],
        Geometry::Arc { from, centre, .. } => {
            let radius_mm = (from[0] - centre[0]).hypot(from[1] - centre[1]);
            task.feeds_mm_s[i].min((acceleration * radius_mm).sqrt())
        }
    }
}

/// The command before the shaper.
fn unshaped(task: &Task, a: f64, deviation_mm: f64) -> Vec<Point> {
    let velocities = junctions(task, a, deviation_mm);
    let mut command = Vec::new();
    let mut begin_s = 0.0;
    for (i, curve) in task.curves.iter().enumerate() {
        let (v0, v1, length) = (velocities[i], velocities[i + 1], curve.length());
        // Where the accelerating and the decelerating branch meet, or the cruise between.
        let peak = f64::midpoint(v0 * v0 + 2.0 * a * length, v1 * v1).sqrt();
        let cruise = peak.min(top(task, i, a)).max(v0).max(v1);
        let (rise_s, fall_s) = ((cruise - v0) / a, (cruise - v1) / a);
        let rise = f64::midpoint(v0, cruise) * rise_s;
        let fall = f64::midpoint(v1, cruise) * fall_s;
        let cruise_s = ((length - rise - fall) / cruise).max(0.0);
        let end_s = begin_s + rise_s + cruise_s + fall_s;
        let mut time_s = command.len() as f64 * STEP_S;
        while time_s < end_s {
            let t = time_s - begin_s;
            let left = end_s - time_s;
            let way = if t < rise_s {
                v0 * t + a * t * t / 2.0
            } else if left > fall_s {
                rise + cruise * (t - rise_s)
            } else {
                length - (v1 * left + a * left * left / 2.0)
            };
            command.push(xyz(curve.at(way.clamp(0.0, length))));
            time_s = command.len() as f64 * STEP_S;
        }
        begin_s = end_s;
    }
    command.extend(task.curves.last().map(|last| xyz(last.at(last.length()))));
    command
}

/// Each axis through the shaper; between samples the command goes straight.
fn shaped(shaper: &Prefilter, command: &[Point]) -> Vec<Point> {
    let delay = (shaper.length_s() / STEP_S).ceil() as usize + 1;
    let at = |time: f64| {
        let whole = time.floor();
        let share = time - whole;
        let sample = |k: f64| command[(k.max(0.0) as usize).min(command.len() - 1)];
        let (a, b) = (sample(whole), sample(whole + 1.0));
        std::array::from_fn::<f64, 3, _>(|axis| a[axis] + share * (b[axis] - a[axis]))
    };
    let end = command.last().copied().unwrap_or_default();
    let mut result: Vec<_> = (0..command.len() + delay)
        .map(|tick| {
            let mut sum = [0.0; 3];
            for (time_s, amplitude) in shaper.impulses() {
                let point = at(tick as f64 - time_s / STEP_S);
                for (sum, value) in sum.iter_mut().zip(point) {
                    *sum += amplitude * value;
                }
            }
            sum
        })
        .collect();
    // Amplitudes sum to one but for rounding.
    for point in result.iter_mut().rev() {
        if crate::vector::distance(*point, end) > 1e-9 {
            break;
        }
        *point = end;
    }
    result
}
