//! What the limits have to know of a segment.

use crate::kinematics::{ArmKind, Curve, Ring, Sweep};
use crate::math::sqrt_f32;
use crate::path::{PathSegment, Shape};

/// Where a segment is, as bounds on the joints of an arm need it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// Seen from the shoulder of a SCARA.
    Ring(Ring),
    /// In the space of a delta robot.
    Sweep(Sweep),
}

impl Region {
    /// The same with all that is above it up to a height.
    pub(super) fn raised(self, rise_mm: f32) -> Self {
        match self {
            Self::Ring(_) => self,
            Self::Sweep(sweep) => Self::Sweep(sweep.raised(rise_mm)),
        }
    }
}

/// A segment as the limits see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Where it is.
    pub region: Region,
    /// Its length in mm.
    pub length_mm: f32,
    /// Its length in the plane.
    pub plane_mm: f32,
    /// What it moves along each of X, Y and Z in mm; on an arc as if it went along the axis.
    pub axes_mm: [f32; 3],
    /// What the yaw turns, in rad.
    pub yaw_rad: f32,
    /// Largest curvature per mm.
    pub curvature_per_mm: f32,
    /// Unit tangent at the start.
    pub first_tangent: [f32; 3],
    /// Unit tangent at the end.
    pub last_tangent: [f32; 3],
}

impl Course {
    /// What the limits of a kind of robot have to know of `path`.
    #[must_use]
    pub fn new(path: &PathSegment, kind: ArmKind) -> Self {
        let length_mm = path.length_mm() as f32;
        let (first_tangent, last_tangent, _) = path.tangents();
        let at = |u: f64| path.pose(u).map(|value| value as f32);
        let (start, middle, end) = (at(0.0), at(0.5), at(1.0));
        let z_mm = (end[2] - start[2]).abs();
        let (plane_mm, curvature_per_mm) = match path.shape {
            Shape::Line => (root(end[0] - start[0], end[1] - start[1]), 0.0),
            Shape::Arc(arc) => {
                let radius_mm = arc.radius_mm.min(arc.end_radius_mm) as f32;
                let along = arc.radius_mm.max(arc.end_radius_mm) * libm::fabs(arc.sweep_rad);
                let closing = libm::fabs(arc.end_radius_mm - arc.radius_mm);
                ((along + closing) as f32, 1.0 / radius_mm.max(1e-3))
            }
        };
        let axes_mm = match path.shape {
            Shape::Line => [(end[0] - start[0]).abs(), (end[1] - start[1]).abs(), z_mm],
            Shape::Arc(_) => [plane_mm, plane_mm, z_mm],
        };
        let region = match (kind, path.shape) {
            (ArmKind::Delta, Shape::Line) => {
                let [way_x, way_y, way_z] = [0, 1, 2].map(|axis: usize| end[axis] - start[axis]);
                Region::Sweep(Sweep::new(length_mm, 0.0, |u| {
                    [
                        start[0] + u * way_x,
                        start[1] + u * way_y,
                        start[2] + u * way_z,
                    ]
                }))
            }
            (ArmKind::Delta, Shape::Arc(_)) => {
                Region::Sweep(Sweep::new(length_mm, curvature_per_mm, |u| {
                    let [x, y, z, _] = at(f64::from(u));
                    [x, y, z]
                }))
            }
            (ArmKind::Scara, Shape::Line) => {
                Region::Ring(ring_of_line([start[0], start[1]], [end[0], end[1]]))
            }
            (ArmKind::Scara, Shape::Arc(arc)) => {
                let centre_mm = root(arc.centre_x_mm as f32, arc.centre_y_mm as f32);
                let radius_mm = arc.radius_mm.max(arc.end_radius_mm) as f32;
                let middle_mm = root(middle[0], middle[1]);
                // in the arc's circle, and within half its length of its middle
                let half_mm = 0.5 * plane_mm;
                let smaller_mm = arc.radius_mm.min(arc.end_radius_mm) as f32;
                let inner_mm = (centre_mm - radius_mm).max(smaller_mm - centre_mm);
                Region::Ring(Ring {
                    inner_mm: inner_mm.max(middle_mm - half_mm),
                    outer_mm: (centre_mm + radius_mm).min(middle_mm + half_mm),
                })
            }
        };
        Self {
            region,
            length_mm,
            plane_mm,
            axes_mm,
            yaw_rad: (end[3] - start[3]).abs().to_radians(),
            curvature_per_mm,
            first_tangent,
            last_tangent,
        }
    }
}

/// The radii along a straight line.
fn ring_of_line(from: [f32; 2], to: [f32; 2]) -> Ring {
    let (start_mm, end_mm) = (root(from[0], from[1]), root(to[0], to[1]));
    let way = [to[0] - from[0], to[1] - from[1]];
    let length_squared = way[0] * way[0] + way[1] * way[1];
    // how far along the line the foot of the perpendicular from the shoulder is
    let along = -(from[0] * way[0] + from[1] * way[1]);
    let nearest_mm = if along > 0.0 && along < length_squared {
        let share = along / length_squared;
        root(from[0] + share * way[0], from[1] + share * way[1])
    } else {
        start_mm.min(end_mm)
    };
    Ring {
        inner_mm: nearest_mm,
        outer_mm: start_mm.max(end_mm),
    }
}

fn root(x: f32, y: f32) -> f32 {
    sqrt_f32(x * x + y * y)
}
