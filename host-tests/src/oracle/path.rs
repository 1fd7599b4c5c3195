//! Segments, their schedule, and the command at a real time `t`.

use std::sync::Arc;

use super::corner::{Corner, Leg};
use super::prefilter::Prefilter;
use crate::vector::{distance, norm, scale, sub, xyz};

/// A pose `[x, y, z, c]` in millimetres and degrees.
pub type Pose = [f64; 4];

/// The curve of one segment, `γ(s)`; the yaw turns with `s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// A straight line. Without translation its length is the turn in degrees.
    Line {
        /// Pose at its start.
        from: Pose,
        /// Pose at its end.
        to: Pose,
    },
    /// An arc in the XY plane, or a helix about Z.
    Arc {
        /// Pose at its start.
        from: Pose,
        /// Centre in the plane.
        centre: [f64; 2],
        /// Swept angle in radians, positive counter-clockwise.
        sweep_rad: f64,
        /// Rise along Z in millimetres.
        rise_mm: f64,
        /// Turn of the yaw in degrees.
        turn_deg: f64,
    },
}

impl Geometry {
    /// Length in millimetres (degrees for a pure turn).
    #[must_use]
    pub fn length(&self) -> f64 {
        match *self {
            Self::Line { from, to } => {
                let translation = distance(xyz(from), xyz(to));
                if translation > 0.0 {
                    translation
                } else {
                    (to[3] - from[3]).abs()
                }
            }
            Self::Arc {
                from,
                centre,
                sweep_rad,
                rise_mm,
                ..
            } => {
                let radius = (from[0] - centre[0]).hypot(from[1] - centre[1]);
                (radius * sweep_rad).hypot(rise_mm)
            }
        }
    }

    /// Pose at path length `s`.
    #[must_use]
    pub fn at(&self, s: f64) -> Pose {
        let length = self.length();
        let u = if length > 0.0 { s / length } else { 0.0 };
        match *self {
            Self::Line { from, to } => {
                std::array::from_fn(|axis| from[axis] + u * (to[axis] - from[axis]))
            }
            Self::Arc {
                from,
                centre,
                sweep_rad,
                rise_mm,
                turn_deg,
            } => {
                let (sin, cos) = (u * sweep_rad).sin_cos();
                let (dx, dy) = (from[0] - centre[0], from[1] - centre[1]);
                [
                    centre[0] + dx * cos - dy * sin,
                    centre[1] + dx * sin + dy * cos,
                    from[2] + u * rise_mm,
                    from[3] + u * turn_deg,
                ]
            }
        }
    }

    /// Derivative `γ'(s)`: a unit tangent in x, y, z, and degrees per millimetre.
    #[must_use]
    pub fn tangent(&self, s: f64) -> Pose {
        let length = self.length();
        if length == 0.0 {
            return [0.0; 4];
        }
        match *self {
            Self::Line { from, to } => std::array::from_fn(|axis| (to[axis] - from[axis]) / length),
            Self::Arc {
                from,
                centre,
                sweep_rad,
                rise_mm,
                turn_deg,
            } => {
                let (sin, cos) = (s / length * sweep_rad).sin_cos();
                let (dx, dy) = (from[0] - centre[0], from[1] - centre[1]);
                [
                    (-dx * sin - dy * cos) * sweep_rad / length,
                    (dx * cos - dy * sin) * sweep_rad / length,
                    rise_mm / length,
                    turn_deg / length,
                ]
            }
        }
    }
}

/// One segment of the raw path.
#[derive(Clone, Debug)]
pub struct Segment {
    /// Its curve.
    pub geometry: Geometry,
    /// Feedrate in mm/s (°/s for a pure turn).
    pub feed: f64,
    /// Prefilter through which it accelerates.
    pub accelerate: Arc<Prefilter>,
    /// Prefilter through which it decelerates.
    pub decelerate: Arc<Prefilter>,
}

/// A program: segments, each beginning where the last one ended.
#[derive(Clone, Debug, Default)]
pub struct Path {
    /// The segments in order.
    pub segments: Vec<Segment>,
    /// Tolerance of the corner after segment `i` in millimetres; one fewer than segments.
    pub tolerances_mm: Vec<f64>,
}

impl Path {
    /// All segments through one prefilter, one feed and one corner tolerance.
    #[must_use]
    pub fn uniform(
        curves: &[Geometry],
        feed: f64,
        prefilter: &Prefilter,
        tolerance_mm: f64,
    ) -> Self {
        let prefilter = Arc::new(prefilter.clone());
        let segments: Vec<_> = curves
            .iter()
            .map(|&geometry| Segment {
                geometry,
                feed,
                accelerate: Arc::clone(&prefilter),
                decelerate: Arc::clone(&prefilter),
            })
            .collect();
        let tolerances_mm = vec![tolerance_mm; segments.len().saturating_sub(1)];
        Self {
            segments,
            tolerances_mm,
        }
    }

    /// The corner between segments `i` and `i + 1`, its true geometry included.
    #[must_use]
    pub fn corner(&self, i: usize) -> Corner<'_> {
        let (before, after) = (&self.segments[i], &self.segments[i + 1]);
        Corner {
            incoming: Leg {
                geometry: before.geometry,
                feed: before.feed,
                prefilter: &before.decelerate,
            },
            outgoing: Leg {
                geometry: after.geometry,
                feed: after.feed,
                prefilter: &after.accelerate,
            },
        }
    }

    /// Start and stop of every raw segment, corners solved on the true geometry.
    #[must_use]
    pub fn schedule(&self) -> Schedule<'_> {
        let mut starts_s = Vec::with_capacity(self.segments.len());
        let mut stops_s = Vec::with_capacity(self.segments.len());
        let mut start = 0.0;
        for (i, segment) in self.segments.iter().enumerate() {
            // t_stop = t_start + L/F + m_a − m_d, so that s ends exactly at L.
            let stop =
                start + segment.geometry.length() / segment.feed + segment.accelerate.centroid_s()
                    - segment.decelerate.centroid_s();
            starts_s.push(start);
            stops_s.push(stop);
            if let Some(&tolerance) = self.tolerances_mm.get(i) {
                start = stop + self.corner(i).solve(tolerance).dwell_s;
            }
        }
        Schedule {
            path: self,
            starts_s,
            stops_s,
        }
    }
}

/// A path with its timing: the command as a continuous function of time.
#[derive(Clone, Debug)]
pub struct Schedule<'a> {
    /// The path.
    pub path: &'a Path,
    /// When each raw segment starts, seconds.
    pub starts_s: Vec<f64>,
    /// When each raw segment stops, seconds.
    pub stops_s: Vec<f64>,
}

impl Schedule<'_> {
    /// When the command has come to rest, seconds after the start.
    #[must_use]
    pub fn cycle_time_s(&self) -> f64 {
        self.stops_s
            .iter()
            .zip(&self.path.segments)
            .map(|(&stop, segment)| stop + segment.decelerate.length_s())
            .fold(0.0, f64::max)
    }

    /// Progress `s = F [I_a(t − t_start) − I_d(t − t_stop)]` of segment `i`.
    #[must_use]
    pub fn progress(&self, i: usize, t_s: f64) -> f64 {
        let segment = &self.path.segments[i];
        let stop = self.stops_s[i];
        if t_s >= stop + segment.decelerate.length_s() {
            return segment.geometry.length();
        }
        segment.feed
            * (segment.accelerate.ramp(t_s - self.starts_s[i])
                - segment.decelerate.ramp(t_s - stop))
    }

    /// Commanded pose: the first point plus every segment's displacement.
    #[must_use]
    pub fn pose(&self, t_s: f64) -> Pose {
        let segments = &self.path.segments;
        let mut pose = segments.first().map_or([0.0; 4], |s| s.geometry.at(0.0));
        for (i, segment) in segments.iter().enumerate() {
            if self.starts_s[i] > t_s {
                break;
            }
            let from = segment.geometry.at(0.0);
            let now = segment.geometry.at(self.progress(i, t_s));
            for axis in 0..4 {
                pose[axis] += now[axis] - from[axis];
            }
        }
        pose
    }

    /// Commanded velocity in mm/s and °/s; its right limit at a jump.
    #[must_use]
    pub fn velocity(&self, t_s: f64) -> Pose {
        let mut velocity = [0.0; 4];
        for (i, segment) in self.path.segments.iter().enumerate() {
            let (start, stop) = (self.starts_s[i], self.stops_s[i]);
            if start > t_s {
                break;
            }
            let rate = segment.feed
                * (segment.accelerate.step(t_s - start) - segment.decelerate.step(t_s - stop));
            let tangent = segment.geometry.tangent(self.progress(i, t_s));
            for axis in 0..4 {
                velocity[axis] += rate * tangent[axis];
            }
        }
        velocity
    }

    /// Poses every `step_s` from 0 until `after_s` past the command's end.
    #[must_use]
    pub fn sample(&self, step_s: f64, after_s: f64) -> Vec<Pose> {
        let count = ((self.cycle_time_s() + after_s) / step_s).ceil() as u32;
        (0..=count)
            .map(|k| self.pose(f64::from(k) * step_s))
            .collect()
    }
}

/// Angle between two tangents in degrees: 0 straight on, 180 back.
#[must_use]
pub fn change_angle_deg(before: [f64; 3], after: [f64; 3]) -> f64 {
    let (a, b) = (
        scale(1.0 / norm(before), before),
        scale(1.0 / norm(after), after),
    );
    let sum = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    (2.0 * norm(sub(a, b)).atan2(norm(sum))).to_degrees()
}

/// The path of the model's section 4, with the change angles of Yeh26 Fig. 11.
#[must_use]
pub fn corner_path() -> [Geometry; 5] {
    let line = |from: [f64; 2], to: [f64; 2]| Geometry::Line {
        from: [from[0], from[1], 0.0, 0.0],
        to: [to[0], to[1], 0.0, 0.0],
    };
    [
        Geometry::Arc {
            from: [180.0, 0.0, 0.0, 0.0],
            centre: [225.0, 0.0],
            sweep_rad: std::f64::consts::FRAC_PI_2,
            rise_mm: 0.0,
            turn_deg: 0.0,
        },
        line([225.0, -45.0], [265.0, 45.0]),
        line([265.0, 45.0], [225.0, 135.0]),
        line([225.0, 135.0], [315.0, 45.0]),
        line([315.0, 45.0], [270.0, 0.0]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::NAMES;

    fn robot(name: &str) -> Prefilter {
        Prefilter::named(name, 6.34, 0.022).unwrap()
    }

    #[test]
    fn corner_path_has_the_printed_angles_and_length() {
        let curves = corner_path();
        let length: f64 = curves.iter().map(Geometry::length).sum();
        assert!((length - 458.58).abs() < 5e-3, "{length}");
        for (pair, angle) in curves.windows(2).zip([66.038, 47.925, 158.963, 90.0]) {
            let before = xyz(pair[0].tangent(pair[0].length()));
            let found = change_angle_deg(before, xyz(pair[1].tangent(0.0)));
            assert!((found - angle).abs() < 1e-3, "{found}");
            assert!(distance(xyz(pair[0].at(pair[0].length())), xyz(pair[1].at(0.0))) < 1e-12);
        }
    }

    #[test]
    fn cycle_times_of_section_4() {
        let table = [
            ("none", 2.866, 2.866),
            ("zv", 3.261, 3.218),
            ("zvd", 3.655, 3.570),
            ("fir", 3.655, 3.428),
            ("fir-zv", 4.049, 3.728),
            ("fir-zvd", 4.444, 3.988),
        ];
        for (name, exact_stop, half_millimetre) in table {
            for (tolerance, expected) in [(0.0, exact_stop), (0.5, half_millimetre)] {
                let path = Path::uniform(&corner_path(), 160.0, &robot(name), tolerance);
                let found = path.schedule().cycle_time_s();
                assert!(
                    (found - expected).abs() < 2e-3,
                    "{name} {tolerance}: {found}"
                );
            }
        }
    }

    /// How far from a corner a command passes that brakes and starts at once: more than that no
    /// tolerance is used, the less the shorter the filter is. With the ramp response I and the
    /// centroid m it is still `m − t + I` before the corner, and `I` behind it.
    fn furthest_mm(filter: &Prefilter, before: [f64; 3], after: [f64; 3]) -> f64 {
        (0..=1000)
            .map(|k| {
                let t = filter.length_s() * f64::from(k) / 1000.0;
                let behind = filter.ramp(t);
                let left = filter.centroid_s() - t + behind;
                160.0 * distance(scale(behind, after), scale(left, before))
            })
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn command_ends_on_the_programmed_point_and_keeps_its_tolerance() {
        let curves = corner_path();
        for name in NAMES {
            for tolerance in [0.0, 0.5, 3.0] {
                let path = Path::uniform(&curves, 160.0, &robot(name), tolerance);
                let schedule = path.schedule();
                let samples = schedule.sample(1e-4, 0.01);
                let end = samples.last().unwrap();
                assert!(distance(xyz(*end), [270.0, 0.0, 0.0]) < 1e-12);
                for pair in curves.windows(2) {
                    let corner = xyz(pair[1].at(0.0));
                    let miss = samples
                        .iter()
                        .map(|&p| distance(xyz(p), corner))
                        .fold(f64::INFINITY, f64::min);
                    assert!(miss < tolerance + 0.01, "{name} {tolerance} {miss}");
                    let before = xyz(pair[0].tangent(pair[0].length()));
                    let most = furthest_mm(&robot(name), before, xyz(pair[1].tangent(0.0)));
                    assert!(
                        miss > 0.8 * tolerance.min(most) - 0.01,
                        "{name} {tolerance} {miss}, at most {most}"
                    );
                }
            }
        }
    }

    #[test]
    fn velocity_is_the_derivative_of_the_pose() {
        let mut path = Path::uniform(&corner_path(), 160.0, &robot("fir-zvd"), 0.5);
        path.segments[1].feed = 90.0;
        path.segments[2].decelerate = Arc::new(robot("fir"));
        path.segments[3].accelerate = Arc::new(robot("fir-zv"));
        path.segments.push(Segment {
            geometry: Geometry::Arc {
                from: [270.0, 0.0, 0.0, 0.0],
                centre: [250.0, 0.0],
                sweep_rad: -4.0,
                rise_mm: 7.0,
                turn_deg: 30.0,
            },
            ..path.segments[4].clone()
        });
        path.tolerances_mm.push(0.2);
        let schedule = path.schedule();
        let h = 1e-6;
        for k in 0..500 {
            let t = schedule.cycle_time_s() * f64::from(k) / 500.0;
            let (a, b, v) = (
                schedule.pose(t - h),
                schedule.pose(t + h),
                schedule.velocity(t),
            );
            for axis in 0..4 {
                assert!(((b[axis] - a[axis]) / (2.0 * h) - v[axis]).abs() < 0.01);
            }
        }
        let end = schedule.pose(schedule.cycle_time_s());
        let expected = path.segments[5]
            .geometry
            .at(path.segments[5].geometry.length());
        for axis in 0..4 {
            assert!((end[axis] - expected[axis]).abs() < 1e-11);
        }
    }

    #[test]
    fn segment_shorter_than_its_prefilter_is_exact() {
        let line = Geometry::Line {
            from: [0.0; 4],
            to: [0.3, 0.4, 0.0, 10.0],
        };
        let path = Path::uniform(&[line], 160.0, &robot("fir-zvd"), 0.0);
        let schedule = path.schedule();
        let mut last = 0.0;
        for pose in schedule.sample(1e-4, 0.0) {
            let s = pose[0].hypot(pose[1]);
            assert!(s >= last - 1e-12 && s <= 0.5 + 1e-12);
            last = s;
        }
        assert!((last - 0.5).abs() < 1e-15);
    }

    #[test]
    fn pure_turn_counts_degrees() {
        let turn = Geometry::Line {
            from: [1.0, 2.0, 3.0, 10.0],
            to: [1.0, 2.0, 3.0, -80.0],
        };
        let path = Path::uniform(&[turn], 45.0, &robot("none"), 0.0);
        let schedule = path.schedule();
        assert!((schedule.cycle_time_s() - 2.0).abs() < 1e-15);
        assert_eq!(schedule.pose(1.0), [1.0, 2.0, 3.0, -35.0]);
    }
}
