//! A segment of the programmed path: a line or an arc from pose to pose.

use crate::kinematics::{Curve, Travel};
use crate::pose::{AXES, Pose};
use crate::prefilter::AxisSet;

/// The path of X and Y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Straight.
    Line,
    /// Circular.
    Arc(Arc),
}

/// An arc in the XY plane, helical if Z moves along.
///
/// Its radius goes linearly from start to end, since programs round: by 0.5 mm or
/// 0.1 % at most (below 5 mm: by 5 µm). It starts and ends at the move's start and
/// target, within 1e-8 mm up to a radius of 10 m, and 1e-6 mm up to 1 km.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Centre, X.
    pub centre_x_mm: f64,
    /// Centre, Y.
    pub centre_y_mm: f64,
    /// Distance of the start from the centre, 1 µm to 1 km.
    pub radius_mm: f64,
    /// Distance of the end from the centre.
    pub end_radius_mm: f64,
    /// Direction from the centre to the start, from +X counter-clockwise, -π to π.
    pub start_angle_rad: f64,
    /// Angle travelled, counter-clockwise positive, never zero; ±2π is a full circle.
    pub sweep_rad: f64,
}

impl Arc {
    /// X and Y in mm at a fraction of the sweep, from 0 (start) to 1 (target).
    #[must_use]
    pub fn point_at(&self, fraction: f64) -> [f64; 2] {
        let angle_rad = self.start_angle_rad + self.sweep_rad * fraction;
        let radius_mm = self.radius_mm + (self.end_radius_mm - self.radius_mm) * fraction;
        let (sin, cos) = libm::sincos(angle_rad);
        [
            self.centre_x_mm + radius_mm * cos,
            self.centre_y_mm + radius_mm * sin,
        ]
    }
}

/// A segment of the programmed path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSegment {
    /// Where it begins.
    pub start: Pose,
    /// Where it ends.
    pub target: Pose,
    /// What is in between.
    pub shape: Shape,
}

impl PathSegment {
    /// Length of the tool's path in mm; yaw does not count.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        let [dx, dy, dz, _] = self.change();
        match self.shape {
            Shape::Line => libm::sqrt(dx * dx + dy * dy + dz * dz),
            Shape::Arc(arc) => {
                let along = arc.radius_mm * arc.sweep_rad;
                libm::sqrt(along * along + dz * dz)
            }
        }
    }

    /// Change of yaw in degrees.
    #[must_use]
    pub fn turn_deg(&self) -> f64 {
        self.change()[3]
    }

    /// The axes along which it goes.
    #[must_use]
    pub fn axes(&self) -> AxisSet {
        let (from, to) = (&self.start, &self.target);
        let turns = matches!(self.shape, Shape::Arc(_)) || from.c != to.c;
        AxisSet::of([
            turns || from.x != to.x,
            turns || from.y != to.y,
            from.z != to.z,
        ])
    }

    /// Unit tangents at the start and at the end, and the change of heading in the XY plane
    /// per mm of path; zero for a segment that only turns.
    #[must_use]
    pub fn tangents(&self) -> ([f32; 3], [f32; 3], f32) {
        let length_mm = self.length_mm();
        if length_mm <= 0.0 {
            return ([0.0; 3], [0.0; 3], 0.0);
        }
        let [dx, dy, dz, _] = self.change();
        let uz = (dz / length_mm) as f32;
        match self.shape {
            Shape::Line => {
                let tangent = [(dx / length_mm) as f32, (dy / length_mm) as f32, uz];
                (tangent, tangent, 0.0)
            }
            Shape::Arc(arc) => {
                let heading_rate = arc.sweep_rad / length_mm;
                let along = arc.radius_mm * heading_rate;
                let start_rad = arc.start_angle_rad;
                let tangent = |angle: f64| {
                    [
                        (-along * libm::sin(angle)) as f32,
                        (along * libm::cos(angle)) as f32,
                        uz,
                    ]
                };
                (
                    tangent(start_rad),
                    tangent(start_rad + arc.sweep_rad),
                    heading_rate as f32,
                )
            }
        }
    }

    fn change(&self) -> [f64; AXES] {
        let (from, to) = (to_f64(self.start), to_f64(self.target));
        core::array::from_fn(|axis| to[axis] - from[axis])
    }
}

fn to_f64(pose: Pose) -> [f64; AXES] {
    [
        pose.x.to_num(),
        pose.y.to_num(),
        pose.z.to_num(),
        pose.c.to_num(),
    ]
}

impl Curve for PathSegment {
    fn length_mm(&self) -> f64 {
        Self::length_mm(self)
    }

    fn pose(&self, u: f64) -> [f64; AXES] {
        let [x, y, z, c] = to_f64(self.start);
        let [dx, dy, dz, dc] = self.change();
        let [x, y] = match self.shape {
            Shape::Line => [x + u * dx, y + u * dy],
            Shape::Arc(arc) => arc.point_at(u),
        };
        [x, y, z + u * dz, c + u * dc]
    }

    fn travel(&self) -> Travel {
        let [_, _, dz, dc] = self.change();
        Travel {
            xy_mm: self.length_mm() as f32,
            z_mm: libm::fabs(dz) as f32,
            c_deg: libm::fabs(dc) as f32,
        }
    }
}
