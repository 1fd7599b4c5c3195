//! Short arcs as chords.
//!
//! A corner at an arc is rounded alone: the next one waits until the filters have left the arc.
//! One arc between two lines is fast like that, but a chain of arcs shorter than the prefilter
//! would stop at each of them. Chords go with the lines, any number of them in the prefilter's
//! length, see [`crate::dense`]; for that they go no faster than the curve allows,
//!
//! ```text
//! F² σ² / (2R) = tolerance
//! ```
//!
//! `n` chords of an arc that turns by φ stray from it by their sagitta `R (1 − cos(φ/2n))`. It is
//! at most 15 % of the tolerance, and the tolerance of the chords is as much smaller.

use crate::corner::CornerRule;
use crate::gcode::Move;
use crate::kinematics::Curve;
use crate::path::{Arc, PathSegment, Shape};
use crate::pose::Pose;
use crate::units::{AngleDeg, LengthMm};

/// Most chords of an arc.
pub const MOST: usize = 2;

/// What they may stray from it, as a part of the tolerance.
const SHARE: f64 = 0.15;

/// The chords of an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chords {
    /// How many.
    pub count: u8,
    /// By how much they stray from it, in mm.
    pub sagitta_mm: f64,
    /// How long they take at the feedrate with which a chain of them keeps the tolerance, in s.
    pub steady_s: f64,
}

impl Chords {
    /// The chords that stand for a move, behind a prefilter of the standard deviation `spread_s`;
    /// none of a line, of an arc that would need too many, or without a tolerance.
    #[must_use]
    pub fn of(order: &Move, spread_s: f64) -> Option<Self> {
        let (Shape::Arc(arc), CornerRule::ToleranceMm(tolerance_mm)) =
            (order.path.shape, order.corner)
        else {
            return None;
        };
        let stray_mm = SHARE * f64::from(tolerance_mm);
        let count = (1..=MOST as u8).find(|&count| sagitta_mm(&arc, count) <= stray_mm)?;
        let kept_mm = f64::from(tolerance_mm) - stray_mm;
        let feed_mm_s = libm::sqrt(2.0 * arc.radius_mm * kept_mm) / spread_s;
        Some(Self {
            count,
            sagitta_mm: sagitta_mm(&arc, count),
            steady_s: order.path.length_mm() / feed_mm_s,
        })
    }

    /// One of them, from 0, with what they leave of the tolerance.
    #[must_use]
    pub fn chord(&self, order: &Move, number: u8) -> Move {
        let pose = |number: u8| match number {
            0 => order.path.start,
            _ if number == self.count => order.path.target,
            _ => point(&order.path, f64::from(number) / f64::from(self.count)),
        };
        Move {
            path: PathSegment {
                start: pose(number),
                target: pose(number + 1),
                shape: Shape::Line,
            },
            corner: order.corner.tightened(self.sagitta_mm as f32),
            ..*order
        }
    }
}

/// `R (1 − cos(φ/2n)) = 2R sin²(φ/4n)`, with the larger radius.
fn sagitta_mm(arc: &Arc, count: u8) -> f64 {
    let sin = libm::sin(arc.sweep_rad / (4.0 * f64::from(count)));
    2.0 * arc.radius_mm.max(arc.end_radius_mm) * sin * sin
}

fn point(path: &PathSegment, fraction: f64) -> Pose {
    let [x, y, z, c] = path.pose(fraction);
    Pose {
        x: LengthMm::saturating_from_num(x),
        y: LengthMm::saturating_from_num(y),
        z: LengthMm::saturating_from_num(z),
        c: AngleDeg::saturating_from_num(c),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gcode::Feed;
    use std::vec::Vec;

    fn arc(radius_mm: f64, sweep_rad: f64, tolerance_mm: f32) -> Move {
        let shape = Arc {
            centre_x_mm: 200.0,
            centre_y_mm: 10.0,
            radius_mm,
            end_radius_mm: radius_mm,
            start_angle_rad: 0.3,
            sweep_rad,
        };
        let pose = |fraction: f64, z: i32| {
            let [x, y] = shape.point_at(fraction);
            Pose {
                x: LengthMm::from_num(x),
                y: LengthMm::from_num(y),
                z: LengthMm::from_num(z),
                ..Pose::default()
            }
        };
        Move {
            path: PathSegment {
                start: pose(0.0, 0),
                target: pose(1.0, 4),
                shape: Shape::Arc(shape),
            },
            feed: Feed::MmPerS(100.0),
            corner: CornerRule::ToleranceMm(tolerance_mm),
            line: 7,
        }
    }

    /// The distance of a point from a helix about the Z axis through the arc's centre.
    fn stray_mm(order: &Move, pose: [f64; 4]) -> f64 {
        let Shape::Arc(arc) = order.path.shape else {
            panic!("it is an arc");
        };
        let radius = (pose[0] - arc.centre_x_mm).hypot(pose[1] - arc.centre_y_mm);
        (radius - arc.radius_mm).abs()
    }

    #[test]
    fn chords_lead_from_start_to_target_within_their_sagitta() {
        for (radius_mm, sweep_rad, tolerance_mm) in
            [(25.0, 0.15, 0.2), (5.0, -0.4, 0.5), (300.0, 0.01, 0.1)]
        {
            let order = arc(radius_mm, sweep_rad, tolerance_mm);
            let chords = Chords::of(&order, 0.07).unwrap();
            assert!(chords.sagitta_mm <= 0.15 * f64::from(tolerance_mm));
            let moves: Vec<_> = (0..chords.count).map(|i| chords.chord(&order, i)).collect();
            assert_eq!(moves[0].path.start, order.path.start);
            assert_eq!(moves[moves.len() - 1].path.target, order.path.target);
            for pair in moves.windows(2) {
                assert_eq!(pair[0].path.target, pair[1].path.start);
            }
            let mut worst_mm = 0.0_f64;
            for chord in &moves {
                for step in 0..=20 {
                    let pose = chord.path.pose(f64::from(step) / 20.0);
                    worst_mm = worst_mm.max(stray_mm(&order, pose));
                }
                let CornerRule::ToleranceMm(left_mm) = chord.corner else {
                    panic!("{:?}", chord.corner);
                };
                let kept_mm = f64::from(left_mm) + chords.sagitta_mm;
                assert!((kept_mm - f64::from(tolerance_mm)).abs() < 1e-6);
            }
            let share = worst_mm / chords.sagitta_mm;
            assert!((0.98..1.001).contains(&share), "{share} of the sagitta");
        }
    }

    #[test]
    fn only_arcs_of_few_chords_with_a_tolerance_are_chords() {
        let count = |order: &Move| Chords::of(order, 0.07).map(|chords| chords.count);
        assert_eq!(count(&arc(300.0, 0.02, 0.2)), Some(1));
        assert_eq!(count(&arc(25.0, 0.06, 0.2)), Some(1));
        assert_eq!(count(&arc(5.0, -0.4, 0.5)), Some(2));
        assert_eq!(count(&arc(5.0, -1.2, 0.5)), None);
        assert_eq!(count(&arc(25.0, 0.1, 0.0)), None);
        let overlap = Move {
            corner: CornerRule::OverlapPercent(50.0),
            ..arc(300.0, 0.02, 0.2)
        };
        assert_eq!(count(&overlap), None);
        let line = Move {
            path: PathSegment {
                shape: Shape::Line,
                ..arc(300.0, 0.02, 0.2).path
            },
            ..arc(300.0, 0.02, 0.2)
        };
        assert_eq!(count(&line), None);
    }
}
