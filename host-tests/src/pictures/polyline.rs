//! Polylines made fit for a picture: clipped, thinned, bounded.

use super::canvas::Point;

/// What axes show: lowest and highest X, lowest and highest Y.
pub type Window = [(f64, f64); 2];

/// The parts of a polyline within a window.
pub fn clip(points: &[Point], window: Window) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut open = false;
    for pair in points.windows(2) {
        let Some((from, to)) = clip_segment(pair[0], pair[1], window) else {
            open = false;
            continue;
        };
        match parts.last_mut() {
            Some(part) if open => part.push(to),
            _ => parts.push(vec![from, to]),
        }
        open = to == pair[1];
    }
    parts
}

/// The part of a segment within a window (Liang, Barsky).
fn clip_segment(a: Point, b: Point, [(x0, x1), (y0, y1)]: Window) -> Option<(Point, Point)> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for (step, room) in [
        (-dx, a.0 - x0),
        (dx, x1 - a.0),
        (-dy, a.1 - y0),
        (dy, y1 - a.1),
    ] {
        if step == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if step < 0.0 {
            enters = enters.max(room / step);
        } else {
            leaves = leaves.min(room / step);
        }
    }
    if enters > leaves {
        return None;
    }
    let at = |u: f64| (a.0 + u * dx, a.1 + u * dy);
    let from = if enters == 0.0 { a } else { at(enters) };
    let to = if leaves == 1.0 { b } else { at(leaves) };
    Some((from, to))
}

/// Leaves out points closer than `step` to the one before, ends excepted.
pub fn thin(points: impl IntoIterator<Item = Point>, step: f64) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    let mut pending = None;
    for point in points {
        match kept.last() {
            Some(last) if (point.0 - last.0).hypot(point.1 - last.1) < step => {
                pending = Some(point);
            }
            _ => {
                kept.push(point);
                pending = None;
            }
        }
    }
    kept.extend(pending);
    kept
}

/// As [`thin`], in steps that double until no more than `most` points are left.
pub fn thin_to(points: &[Point], step: f64, most: usize) -> Vec<Point> {
    let mut step = step;
    let mut kept = thin(points.iter().copied(), step);
    while kept.len() > most.max(2) {
        step *= 2.0;
        kept = thin(kept, step);
    }
    kept
}

/// A long signal as its lowest and highest value in each of `columns` stretches of time.
pub fn envelope(points: Vec<Point>, columns: usize) -> Vec<Point> {
    if points.len() <= 4 * columns {
        return points;
    }
    let stretch = points.len().div_ceil(columns);
    let mut kept = Vec::with_capacity(2 * columns);
    for part in points.chunks(stretch) {
        let by_value = |a: &&Point, b: &&Point| a.1.total_cmp(&b.1);
        let lowest = part.iter().min_by(by_value);
        let highest = part.iter().max_by(by_value);
        if let (Some(&low), Some(&high)) = (lowest, highest) {
            kept.extend(if low.0 < high.0 {
                [low, high]
            } else {
                [high, low]
            });
        }
    }
    kept
}

/// The smallest window around points; none if there are none.
pub fn bounds(points: &[Point]) -> Option<Window> {
    let &(x, y) = points.first()?;
    let widened = |(low, high): (f64, f64), value: f64| (low.min(value), high.max(value));
    Some(points.iter().fold([(x, x), (y, y)], |[xs, ys], point| {
        [widened(xs, point.0), widened(ys, point.1)]
    }))
}

/// Widens a window about its middle until a unit is as long in X as in Y on a plot of that
/// size in pixels, with room at the edges.
pub fn equal_scale([(x0, x1), (y0, y1)]: Window, (width, height): (f64, f64)) -> Window {
    const ROOM: f64 = 1.2;
    let unit = ((x1 - x0) / width).max((y1 - y0) / height).max(1e-6) * ROOM / 2.0;
    let about = |low: f64, high: f64, pixels: f64| {
        let middle = f64::midpoint(low, high);
        (middle - unit * pixels, middle + unit * pixels)
    };
    [about(x0, x1, width), about(y0, y1, height)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_at_the_window() {
        let zigzag = [(-1.0, 0.5), (0.5, 0.5), (0.5, 3.0), (0.2, 3.0), (0.2, 0.0)];
        let parts = clip(&zigzag, [(0.0, 1.0), (0.0, 1.0)]);
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0], [(0.0, 0.5), (0.5, 0.5), (0.5, 1.0)]);
        assert_eq!(parts[1], [(0.2, 1.0), (0.2, 0.0)]);
        assert!(clip(&[(2.0, 2.0), (3.0, 2.0)], [(0.0, 1.0), (0.0, 1.0)]).is_empty());
    }

    #[test]
    fn thinning_keeps_the_ends_and_an_envelope_the_peaks() {
        let points: Vec<_> = (0..1000)
            .map(|k| (f64::from(k), f64::from(k % 7)))
            .collect();
        let line = thin((0..=100).map(|k| (f64::from(k), 0.0)), 30.0);
        assert_eq!(
            line,
            [
                (0.0, 0.0),
                (30.0, 0.0),
                (60.0, 0.0),
                (90.0, 0.0),
                (100.0, 0.0)
            ]
        );
        let peaks = envelope(points.clone(), 50);
        assert!(peaks.len() <= 100 && peaks.iter().any(|p| p.1 == 6.0));
        assert!(peaks.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(envelope(points.clone(), 500), points);
    }

    #[test]
    fn circles_stay_round() {
        let [(x0, x1), (y0, y1)] = equal_scale([(0.0, 10.0), (0.0, 1.0)], (200.0, 100.0));
        assert!(((x1 - x0) / (y1 - y0) - 2.0).abs() < 1e-12 && x1 - x0 >= 10.0);
        assert_eq!(
            bounds(&[(1.0, 5.0), (3.0, 4.0)]),
            Some([(1.0, 3.0), (4.0, 5.0)])
        );
    }
}
