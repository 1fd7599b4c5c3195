//! Matches points in order to a polyline: the smallest distance within which every
//! point has a place on it, none before the place of the point before.
//!
//! Nearest points alone would be fooled by paths that cross or retrace themselves.

use crate::vector::{add, distance, dot, scale, sub};

/// Resolution of the distance found, millimetres.
const RESOLUTION_MM: f64 = 1e-9;

/// Rounding allowed in a share of a chord.
const ROUNDING: f64 = 1e-12;

/// A place on a polyline: the chord's number and the share of it, 0 to 1.
pub type Place = (usize, f64);

/// The match of points to a polyline.
#[derive(Clone, Debug, PartialEq)]
pub struct Match {
    /// Largest distance of a point to its place; infinite if it cannot be told.
    pub distance_mm: f64,
    /// The earliest places within that distance.
    pub places: Vec<Place>,
}

/// Matches `points` to `polyline` in order, with the smallest largest distance.
///
/// Taking the earliest place within ε of each point is optimal, so that an ε is
/// decided in one walk; the smallest ε is bisected.
#[must_use]
pub fn match_in_order(points: &[[f64; 3]], polyline: &[[f64; 3]]) -> Match {
    let finite = |list: &[[f64; 3]]| list.iter().flatten().all(|x| x.is_finite());
    let Some(&first) = polyline
        .first()
        .filter(|_| finite(points) && finite(polyline))
    else {
        return Match {
            distance_mm: f64::INFINITY,
            places: Vec::new(),
        };
    };
    let mut high = points
        .iter()
        .map(|&p| distance(p, first))
        .fold(0.0, f64::max);
    let mut best = vec![(0, 0.0); points.len()];
    let mut low = 0.0;
    let places_within = |reach_mm| places_within(points, polyline, |_, _| reach_mm);
    if let Some(places) = places_within(RESOLUTION_MM) {
        (high, best) = (RESOLUTION_MM.min(high), places);
    }
    while high - low > RESOLUTION_MM {
        let middle = f64::midpoint(low, high);
        match places_within(middle) {
            Some(places) => (high, best) = (middle, places),
            None => low = middle,
        }
    }
    Match {
        distance_mm: high,
        places: best,
    }
}

/// Whether every point has a place within reach, none before the place of the point before. How
/// far that is `reach_mm` says, of the numbers of a point and of a chord.
#[must_use]
pub fn are_in_order(
    points: &[[f64; 3]],
    polyline: &[[f64; 3]],
    reach_mm: impl Fn(usize, usize) -> f64,
) -> bool {
    let finite = |list: &[[f64; 3]]| list.iter().flatten().all(|x| x.is_finite());
    finite(points)
        && finite(polyline)
        && !polyline.is_empty()
        && places_within(points, polyline, reach_mm).is_some()
}

/// The earliest places within reach, or `None` where a point has none.
fn places_within(
    points: &[[f64; 3]],
    polyline: &[[f64; 3]],
    reach_mm: impl Fn(usize, usize) -> f64,
) -> Option<Vec<Place>> {
    let mut place = (0, 0.0);
    points
        .iter()
        .enumerate()
        .map(|(i, &point)| {
            loop {
                let reach_mm = reach_mm(i, place.0);
                let a = polyline[place.0];
                let b = polyline.get(place.0 + 1).copied().unwrap_or(a);
                if let Some(share) = earliest(point, a, b, place.1, reach_mm) {
                    place.1 = share;
                    return Some(place);
                }
                if place.0 + 2 >= polyline.len() {
                    return None;
                }
                place = (place.0 + 1, 0.0);
            }
        })
        .collect()
}

/// The smallest share ≥ `from` of the chord `ab` within `reach` of the point.
fn earliest(point: [f64; 3], a: [f64; 3], b: [f64; 3], from: f64, reach: f64) -> Option<f64> {
    let chord = sub(b, a);
    let square = dot(chord, chord);
    if square == 0.0 {
        return (distance(point, a) <= reach).then_some(from);
    }
    // Half the chord's way through the sphere about the point, from the foot of the
    // perpendicular: |a + u chord − point|² = reach² would cancel.
    let foot = dot(chord, sub(point, a)) / square;
    let off = distance(point, add(a, scale(foot, chord)));
    if off > reach {
        return None;
    }
    let half = ((reach - off) * (reach + off) / square).sqrt();
    let (entry, exit) = (foot - half, foot + half);
    // A place that was just reached must not be lost to rounding.
    (entry <= 1.0 + ROUNDING && exit >= from - ROUNDING).then_some(entry.clamp(from, 1.0))
}

/// Distance of a point to the stretch `ab`.
#[must_use]
pub fn distance_to_chord(point: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let chord = sub(b, a);
    let square = dot(chord, chord);
    let share = if square > 0.0 {
        (dot(chord, sub(point, a)) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    distance(point, add(a, scale(share, chord)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 2]]) -> Vec<[f64; 3]> {
        points.iter().map(|p| [p[0], p[1], 0.0]).collect()
    }

    /// Points every `step` along a polyline.
    fn walk(corners: &[[f64; 2]], step: f64) -> Vec<[f64; 3]> {
        let corners = line(corners);
        let mut points = vec![corners[0]];
        for pair in corners.windows(2) {
            let count = (distance(pair[0], pair[1]) / step).round() as u32;
            points.extend((1..=count).map(|i| {
                let u = f64::from(i) / f64::from(count);
                add(pair[0], scale(u, sub(pair[1], pair[0])))
            }));
        }
        points
    }

    fn miss(points: &[[f64; 3]], polyline: &[[f64; 3]]) -> f64 {
        match_in_order(points, polyline).distance_mm
    }

    #[test]
    fn offset_and_spike_are_seen() {
        let path = line(&[[0.0, 0.0], [100.0, 0.0]]);
        let mut trace = walk(&[[0.0, 0.0], [100.0, 0.0]], 0.1);
        assert!(miss(&trace, &path) < 1e-8);
        trace[500][1] = 0.0123;
        assert!((miss(&trace, &path) - 0.0123).abs() < 1e-8);
        trace[700][2] = -3.0;
        assert!((miss(&trace, &path) - 3.0).abs() < 1e-8);
        trace[700][2] = f64::NAN;
        assert_eq!(miss(&trace, &path), f64::INFINITY);
    }

    #[test]
    fn retraced_path_is_followed_to_its_tip_and_back() {
        let corners = [[0.0, 0.0], [100.0, 0.0], [0.0, 0.0]];
        assert!(miss(&walk(&corners, 0.1), &line(&corners)) < 1e-8);
        // Turning 0.4 mm before the tip deviates by nothing, but misses the tip.
        let short = walk(&[[0.0, 0.0], [99.6, 0.0], [0.0, 0.0]], 0.1);
        assert!(miss(&short, &line(&corners)) < 1e-8);
        assert!((miss(&line(&corners), &short) - 0.4).abs() < 1e-8);
    }

    #[test]
    fn running_backwards_is_a_deviation() {
        let path = line(&[[0.0, 0.0], [100.0, 0.0]]);
        let trace = walk(&[[0.0, 0.0], [60.0, 0.0], [50.0, 0.0], [100.0, 0.0]], 0.1);
        // 10 mm back: best matched half-way.
        assert!((miss(&trace, &path) - 5.0).abs() < 0.01);
    }

    #[test]
    fn crossing_paths_are_told_apart_by_order() {
        // An eight; the trace runs its second half the wrong way round.
        let eight = [
            [0.0, 0.0],
            [20.0, 20.0],
            [20.0, 0.0],
            [0.0, 20.0],
            [0.0, 0.0],
        ];
        let wrong = [
            [0.0, 0.0],
            [20.0, 20.0],
            [0.0, 20.0],
            [20.0, 0.0],
            [0.0, 0.0],
        ];
        assert!(miss(&walk(&eight, 0.1), &line(&eight)) < 1e-8);
        assert!(miss(&walk(&wrong, 0.1), &line(&eight)) > 5.0);
        // A loop left out: every point lies on the path, but the path is not covered.
        let looped = [
            [0.0, 0.0],
            [50.0, 0.0],
            [50.0, 30.0],
            [30.0, 30.0],
            [30.0, -30.0],
        ];
        let cut = walk(&[[0.0, 0.0], [30.0, 0.0], [30.0, -30.0]], 0.1);
        assert!(miss(&cut, &line(&looped)) < 1e-8);
        assert!(miss(&line(&looped), &cut) > 20.0);
    }

    #[test]
    fn distance_to_a_chord() {
        let (a, b) = ([0.0; 3], [10.0, 0.0, 0.0]);
        assert_eq!(distance_to_chord([5.0, 2.0, 0.0], a, b), 2.0);
        assert_eq!(distance_to_chord([-3.0, 4.0, 0.0], a, b), 5.0);
        assert_eq!(distance_to_chord([3.0, 4.0, 0.0], a, a), 5.0);
    }
}
