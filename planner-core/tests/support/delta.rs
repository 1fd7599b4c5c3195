//! The delta robot by circles and spheres, in `f64`.

// Each test file uses its part.
#![allow(dead_code)]

use planner_core::kinematics::DeltaConfig;
use planner_core::pose::{AXES, JointPosition, Pose};
use planner_core::units::LengthMm;

/// The workspace of [vNoorden21]: 797 × 797 × 228 mm.
pub const WORKSPACE: [(f64, f64); 3] = [(-398.5, 398.5), (-398.5, 398.5), (-828.0, -600.0)];

/// A robot of these radii and lengths, in millimetres.
pub fn sized(base: f32, platform: f32, arm: f32, forearm: f32) -> DeltaConfig {
    DeltaConfig {
        base_radius_mm: base,
        platform_radius_mm: platform,
        upper_arm_mm: arm,
        forearm_mm: forearm,
        ..DeltaConfig::default()
    }
}

/// The robot's geometry, in millimetres and radians.
#[derive(Clone, Copy)]
pub struct Geometry {
    pub offset: f64,
    pub upper_arm: f64,
    pub forearm: f64,
}

/// One arm at a pose.
#[derive(Clone, Copy, Debug)]
pub struct Arm {
    pub angle: f64,
    /// From the elbow to the platform.
    pub forearm: [f64; 3],
    /// The forearm's angle to the plane of the upper arm and the shoulder's axis.
    pub serial: f64,
}

impl Geometry {
    pub fn of(config: &DeltaConfig) -> Self {
        Self {
            offset: f64::from(config.base_radius_mm) - f64::from(config.platform_radius_mm),
            upper_arm: config.upper_arm_mm.into(),
            forearm: config.forearm_mm.into(),
        }
    }

    /// Arm `k` (0 to 2): where the circle of its elbow meets the circle that the forearm's sphere
    /// about the platform cuts out of the arm's plane, outward. `None` where they do not meet.
    pub fn arm(&self, k: usize, [x, y, z]: [f64; 3]) -> Option<Arm> {
        let turn = k as f64 * 120_f64.to_radians();
        // In a frame in which the arm points along -Y.
        let (s, c) = turn.sin_cos();
        let (across, outward) = (x * c + y * s, x * s - y * c);
        let cut = (self.forearm * self.forearm - across * across).sqrt();
        let (dx, dz) = (outward - self.offset, z);
        let distance = dx.hypot(dz);
        let along = (self.upper_arm.powi(2) - cut.powi(2) + distance.powi(2)) / (2.0 * distance);
        let aside = (self.upper_arm.powi(2) - along.powi(2)).sqrt();
        if aside.is_nan() || cut.is_nan() {
            return None;
        }
        let (ex, ez) = (dx / distance, dz / distance);
        let (elbow_x, elbow_z) = (along * ex - aside * ez, along * ez + aside * ex);
        let radius = self.offset + elbow_x;
        let elbow = [radius * s, -radius * c, elbow_z];
        let forearm = [x - elbow[0], y - elbow[1], z - elbow[2]];
        let angle = (-elbow_z).atan2(elbow_x);
        // The normal of that plane is the way of the elbow.
        let normal = [-angle.sin() * s, angle.sin() * c, -angle.cos()];
        let serial = (dot(normal, forearm) / self.forearm).asin();
        Some(Arm {
            angle,
            forearm,
            serial,
        })
    }

    pub fn arms(&self, place: [f64; 3]) -> Option<[Arm; 3]> {
        Some([
            self.arm(0, place)?,
            self.arm(1, place)?,
            self.arm(2, place)?,
        ])
    }

    /// Joints in rad at a pose in mm and degrees; NaN out of reach.
    pub fn inverse(&self, [x, y, z, c]: [f64; 4]) -> [f64; AXES] {
        let arm = |k| self.arm(k, [x, y, z]).map_or(f64::NAN, |arm| arm.angle);
        [arm(0), arm(1), arm(2), c.to_radians()]
    }

    /// The elbow of arm `k` at an angle.
    pub fn elbow(&self, k: usize, angle: f64) -> [f64; 3] {
        let (s, c) = (k as f64 * 120_f64.to_radians()).sin_cos();
        let radius = self.offset + self.upper_arm * angle.cos();
        [radius * s, -radius * c, -self.upper_arm * angle.sin()]
    }

    /// The volume that the forearms' directions span.
    pub fn volume(&self, arms: &[Arm; 3]) -> f64 {
        let [a, b, c] = arms.map(|arm| arm.forearm);
        -dot(a, cross(b, c)) / self.forearm.powi(3)
    }
}

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub fn pose(values: [f64; 4]) -> Pose {
    let [x, y, z, c] = values.map(LengthMm::from_num);
    Pose { x, y, z, c }
}

pub fn pose_f64(pose: &Pose) -> [f64; 4] {
    [pose.x, pose.y, pose.z, pose.c].map(LengthMm::to_num)
}

/// In rad.
pub fn joints_f64(joints: &JointPosition) -> [f64; 4] {
    joints
        .to_bits()
        .map(|bits| f64::from(bits) / 2_f64.powi(26))
}

/// A grid over the workspace, ends included.
pub fn workspace(steps: [u32; 3]) -> impl Iterator<Item = [f64; 3]> {
    let axis = move |axis: usize, step: u32| {
        let (low, high) = WORKSPACE[axis];
        low + (high - low) * f64::from(step) / f64::from(steps[axis])
    };
    let [nx, ny, nz] = steps;
    (0..=nx).flat_map(move |i| {
        (0..=ny).flat_map(move |j| (0..=nz).map(move |k| [axis(0, i), axis(1, j), axis(2, k)]))
    })
}
