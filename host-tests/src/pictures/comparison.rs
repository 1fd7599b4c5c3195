//! Motions side by side: speed, acceleration and jerk of each in a row, and what is used of
//! limits that are not the path's.

use anyhow::Result;

use super::canvas::{
    Area, BACKGROUND, COMMAND, CONTRAST, LIMIT, Point, UNITS, axes, caption, dashed, full, headed,
    limit, lines, picture,
};
use super::polyline::envelope;
use crate::vector::{add, norm, scale, sub};
use planner_core::units::TICK_S;

/// Width of a column.
const COLUMN: u32 = 427;
/// Height of a row, and of the headline above them.
const ROW: u32 = 190;
const HEAD: u32 = 120;

/// Half the span in samples over which a derivative is taken: the first and second over 2 ms, the
/// third, where the setpoints' resolution shows, over 20 ms.
const SPANS: [usize; 3] = [1, 1, 10];

/// Motions that take longer than so many times the first one are shown in part.
const SHOWN: f64 = 1.6;

/// A motion to show.
#[derive(Clone, Debug)]
pub struct ShownMotion<'a> {
    /// Its name.
    pub name: &'a str,
    /// Where the tool is commanded to be, a sample a millisecond.
    pub positions: &'a [[f64; 3]],
    /// Limits that the motion keeps of itself: mm/s, mm/s², mm/s³.
    pub limits: [Option<f64>; 3],
    /// Values beyond these are cut off, since an impulse is as high as a sample is short: mm/s,
    /// mm/s², mm/s³.
    pub tops: [f64; 3],
    /// The largest part used of any limit of the joints and axes, a sample a millisecond; none
    /// where there are no such limits.
    pub limits_used: Option<&'a [f64]>,
}

const NAMES: [&str; 4] = ["mm/s", "mm/s²", "mm/s³", "%"];
const TITLES: [&str; 4] = [
    "speed",
    "acceleration",
    "jerk",
    "used of a limit of joints or axes",
];

/// How high the axis of what is used goes, in %.
const MOST_USED: f64 = 125.0;

/// Draws the motions, the first of which is repeated in grey behind the others.
///
/// # Errors
/// Never in practice: the drawing goes to memory.
pub fn draw(title: &str, subtitle: &str, motions: &[ShownMotion<'_>]) -> Result<String> {
    let legend_name = motions.first().map_or("", |motion| motion.name);
    let mut legend = vec![
        full(COMMAND, 2, "the row's motion"),
        full(BACKGROUND, 3, legend_name),
        full(CONTRAST, 3, "higher than the axis"),
    ];
    let has_use = motions.iter().any(|motion| motion.limits_used.is_some());
    let mut limits = motions.iter().flat_map(|motion| motion.limits);
    if has_use || limits.any(|limit| limit.is_some()) {
        legend.push(limit("feedrate, or limit"));
    }
    let columns = if has_use { 4 } else { 3 };
    let rows = motions.len().max(1);
    let longest_s = motions.iter().map(rest_s).fold(0.0, f64::max);
    let first_s = motions.first().map_or(longest_s, rest_s);
    let end_s = 1.05 * longest_s.min(SHOWN * first_s);
    let reference = motions.first().map(curves).unwrap_or_default();
    picture((COLUMN * columns, HEAD + ROW * rows as u32), |root| {
        let body = headed(root, title, subtitle, &legend)?;
        for (row, motion) in body.split_evenly((rows, 1)).iter().zip(motions) {
            let own = curves(motion);
            for (which, panel) in row.split_evenly((1, columns as usize)).iter().enumerate() {
                let text = match which {
                    0 if rest_s(motion) > end_s => {
                        format!("{}, until {:.1} s: speed", motion.name, rest_s(motion))
                    }
                    0 => format!("{}: speed", motion.name),
                    _ => TITLES[which].to_owned(),
                };
                let panel = caption(panel, &text)?;
                draw_panel(
                    &panel,
                    motion,
                    which,
                    end_s,
                    [&reference[which], &own[which]],
                )?;
            }
        }
        Ok(())
    })
}

fn draw_panel(
    panel: &Area<'_>,
    motion: &ShownMotion<'_>,
    which: usize,
    end_s: f64,
    [reference, own]: [&Vec<Point>; 2],
) -> Result<()> {
    let [speed, acceleration, jerk] = motion.tops;
    let top = [speed, acceleration, jerk, MOST_USED][which];
    let [speed, acceleration, jerk] = motion.limits;
    let limit = [speed, acceleration, jerk, Some(100.0)][which];
    let ranges = [(0.0, end_s), (0.0, top)];
    let names = ["time, s", NAMES[which]];
    let mut chart = axes(panel, ranges, names, [5, 3])?;
    let within = |points: &[Point]| -> Vec<Point> {
        let shown = points.iter().take_while(|point| point.0 <= end_s);
        shown.map(|(t, value)| (*t, value.min(top))).collect()
    };
    lines(
        &mut chart,
        [envelope(within(reference), 900)],
        BACKGROUND,
        3,
    )?;
    if let Some(limit) = limit {
        dashed(&mut chart, [vec![(0.0, limit), (end_s, limit)]], LIMIT)?;
    }
    lines(&mut chart, [envelope(within(own), 900)], COMMAND, 2)?;
    // what is cut off shows as a bar at the top
    let parts = own
        .chunk_by(|a, b| (a.1 > top) == (b.1 > top))
        .filter(|part| part[0].1 > top && part[part.len() - 1].0 <= end_s)
        .map(|part| {
            let (from, to) = (part[0].0, part[part.len() - 1].0);
            vec![(from, top), (to.max(from + end_s / 200.0).min(end_s), top)]
        });
    let width = UNITS.min(3);
    lines(&mut chart, parts, CONTRAST, width)
}

/// When it has come to rest.
fn rest_s(motion: &ShownMotion<'_>) -> f64 {
    let changes = motion.positions.windows(2);
    let last = changes.rev().position(|pair| pair[0] != pair[1]);
    (motion.positions.len() - last.unwrap_or(0)) as f64 * TICK_S
}

/// Sizes of the first three derivatives over time, and the part used of a limit in %.
fn curves(motion: &ShownMotion<'_>) -> [Vec<Point>; 4] {
    let [speed, acceleration, jerk] = derivatives(motion);
    let used = motion.limits_used.unwrap_or_default().iter().enumerate();
    let used = used.map(|(k, part)| (k as f64 * TICK_S, 100.0 * part));
    [speed, acceleration, jerk, used.collect()]
}

fn derivatives(motion: &ShownMotion<'_>) -> [Vec<Point>; 3] {
    let positions = motion.positions;
    std::array::from_fn(|order| {
        let span = SPANS[order];
        let step_s = span as f64 * TICK_S;
        // central differences over -2, -1, 0, 1, 2 spans
        let at = |k: usize, by: isize| {
            let index = (k as isize + by * span as isize).max(0) as usize;
            positions[index.min(positions.len() - 1)]
        };
        (0..(rest_s(motion) / TICK_S).round() as usize)
            .map(|k| {
                let difference = match order {
                    0 => scale(0.5, sub(at(k, 1), at(k, -1))),
                    1 => add(sub(at(k, 1), at(k, 0)), sub(at(k, -1), at(k, 0))),
                    _ => {
                        let outer = sub(at(k, 2), at(k, -2));
                        let inner = sub(at(k, 1), at(k, -1));
                        scale(0.5, sub(outer, scale(2.0, inner)))
                    }
                };
                let size = norm(difference) / step_s.powi(order as i32 + 1);
                (k as f64 * TICK_S, size)
            })
            .collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_of_a_cubic_are_its_coefficients() {
        let positions: Vec<_> = (0..200)
            .map(|k| {
                let t = f64::from(k) * TICK_S;
                [1.0 + 3.0 * t, 0.0, 50.0 * t * t * t]
            })
            .collect();
        let motion = ShownMotion {
            name: "",
            positions: &positions,
            limits: [None; 3],
            tops: [1.0; 3],
            limits_used: None,
        };
        let [speed, acceleration, jerk, _] = curves(&motion);
        for k in 30..170 {
            let t = f64::from(k) * TICK_S;
            let near = |found: f64, expected: f64| {
                assert!(
                    (found - expected).abs() < 1e-3 * expected,
                    "{found} {expected}"
                );
            };
            near(speed[k as usize].1, 3.0_f64.hypot(150.0 * t * t));
            near(acceleration[k as usize].1, 300.0 * t);
            near(jerk[k as usize].1, 300.0);
        }
    }
}
