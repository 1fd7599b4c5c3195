//! A SCARA arm in double precision: kinematics and the dynamics of its two links.

/// Lengths of the two links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaraArm {
    /// Shoulder to elbow in millimetres.
    pub link1_mm: f64,
    /// Elbow to tool axis in millimetres.
    pub link2_mm: f64,
}

/// Which of the two solutions of the inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Elbow {
    /// Elbow to the left of the line from shoulder to tool: joint 2 negative.
    Left,
    /// Elbow to the right: joint 2 positive.
    Right,
}

impl Default for ScaraArm {
    fn default() -> Self {
        Self {
            link1_mm: 200.0,
            link2_mm: 150.0,
        }
    }
}

impl ScaraArm {
    /// Pose `[x, y, z, c]` (mm, degrees) at joints (rad, rad, mm, rad).
    #[must_use]
    pub fn forward(&self, q: [f64; 4]) -> [f64; 4] {
        let elbow = q[0] + q[1];
        [
            self.link1_mm * q[0].cos() + self.link2_mm * elbow.cos(),
            self.link1_mm * q[0].sin() + self.link2_mm * elbow.sin(),
            q[2],
            (elbow + q[3]).to_degrees(),
        ]
    }

    /// Joints (rad, rad, mm, rad) at a pose; `None` out of reach.
    #[must_use]
    pub fn inverse(&self, pose: [f64; 4], elbow: Elbow) -> Option<[f64; 4]> {
        let (l1, l2) = (self.link1_mm, self.link2_mm);
        let [x, y, z, c] = pose;
        let cos = (x * x + y * y - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
        if !(-1.0..=1.0).contains(&cos) {
            return None;
        }
        let sin = match elbow {
            Elbow::Left => -(1.0 - cos * cos).sqrt(),
            Elbow::Right => (1.0 - cos * cos).sqrt(),
        };
        let q2 = sin.atan2(cos);
        let q1 = y.atan2(x) - (l2 * sin).atan2(l1 + l2 * cos);
        Some([q1, q2, z, c.to_radians() - q1 - q2])
    }

    /// `∂(x, y)/∂(q1, q2)` in mm/rad, by rows.
    #[must_use]
    pub fn jacobian(&self, q: [f64; 4]) -> [[f64; 2]; 2] {
        let (s1, c1) = q[0].sin_cos();
        let (s12, c12) = (q[0] + q[1]).sin_cos();
        let (l1, l2) = (self.link1_mm, self.link2_mm);
        [
            [-l1 * s1 - l2 * s12, -l2 * s12],
            [l1 * c1 + l2 * c12, l2 * c12],
        ]
    }

    /// Joint velocities of a tool that moves with `velocity` (mm/s, °/s).
    ///
    /// Not finite where the arm is stretched or folded.
    #[must_use]
    pub fn joint_velocity(&self, q: [f64; 4], velocity: [f64; 4]) -> [f64; 4] {
        let rates = solve2(self.jacobian(q), [velocity[0], velocity[1]]);
        [
            rates[0],
            rates[1],
            velocity[2],
            velocity[3].to_radians() - rates[0] - rates[1],
        ]
    }

    /// Acceleration of the tool axis in mm/s² at joint rates `r` and accelerations `a`.
    #[must_use]
    pub fn tool_acceleration(&self, q: [f64; 4], r: [f64; 2], a: [f64; 2]) -> [f64; 2] {
        let (s1, c1) = q[0].sin_cos();
        let (s12, c12) = (q[0] + q[1]).sin_cos();
        let (l1, l2) = (self.link1_mm, self.link2_mm);
        let (rate1, rate12) = (r[0] * r[0], (r[0] + r[1]).powi(2));
        let j = self.jacobian(q);
        [
            j[0][0] * a[0] + j[0][1] * a[1] - l1 * c1 * rate1 - l2 * c12 * rate12,
            j[1][0] * a[0] + j[1][1] * a[1] - l1 * s1 * rate1 - l2 * s12 * rate12,
        ]
    }
}

/// Inertia of the two links in their usual three parameters:
/// `M = [a + 2b cos q2, d + b cos q2; ·, d]`, kg·m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmInertia {
    /// Both links about the shoulder, elbow at a right angle.
    pub a: f64,
    /// Coupling of the links through the elbow's angle.
    pub b: f64,
    /// Forearm about the elbow.
    pub d: f64,
}

impl Default for ArmInertia {
    /// Upper arm 3 kg, forearm with quill 2.5 kg, its centre 80 mm from the elbow.
    fn default() -> Self {
        Self {
            a: 0.166,
            b: 0.040,
            d: 0.026,
        }
    }
}

impl ArmInertia {
    /// Mass matrix by rows.
    #[must_use]
    pub fn matrix(&self, q2: f64) -> [[f64; 2]; 2] {
        let b = self.b * q2.cos();
        [[self.a + 2.0 * b, self.d + b], [self.d + b, self.d]]
    }

    /// Joint accelerations under `torque`, centrifugal and Coriolis terms included.
    #[must_use]
    pub fn acceleration(&self, q2: f64, r: [f64; 2], torque: [f64; 2]) -> [f64; 2] {
        let h = self.b * q2.sin();
        let right = [
            torque[0] + h * (2.0 * r[0] * r[1] + r[1] * r[1]),
            torque[1] - h * r[0] * r[0],
        ];
        solve2(self.matrix(q2), right)
    }

    /// Kinetic energy in joules.
    #[must_use]
    pub fn kinetic_j(&self, q2: f64, r: [f64; 2]) -> f64 {
        let m = self.matrix(q2);
        0.5 * (m[0][0] * r[0] * r[0] + 2.0 * m[0][1] * r[0] * r[1] + m[1][1] * r[1] * r[1])
    }
}

fn solve2(m: [[f64; 2]; 2], right: [f64; 2]) -> [f64; 2] {
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    [
        (m[1][1] * right[0] - m[0][1] * right[1]) / determinant,
        (m[0][0] * right[1] - m[1][0] * right[0]) / determinant,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_forward() {
        let arm = ScaraArm::default();
        for k in 0..200 {
            let k = f64::from(k);
            let q2 = 0.1 + k * 0.013;
            for (q2, elbow) in [(q2, Elbow::Right), (-q2, Elbow::Left)] {
                let q = [k * 0.01 - 1.0, q2, k - 50.0, 0.02 * k];
                let back = arm.inverse(arm.forward(q), elbow).unwrap();
                for joint in 0..4 {
                    assert!((back[joint] - q[joint]).abs() < 1e-12);
                }
            }
        }
        assert!(arm.inverse([351.0, 0.0, 0.0, 0.0], Elbow::Right).is_none());
        assert!(arm.inverse([0.0, 49.0, 0.0, 0.0], Elbow::Right).is_none());
        // Left and right as seen from the shoulder towards the tool.
        let left = arm.inverse([200.0, 0.0, 0.0, 0.0], Elbow::Left).unwrap();
        assert!(left[0] > 0.0 && left[1] < 0.0);
    }

    #[test]
    fn derivatives_match_differences() {
        let arm = ScaraArm::default();
        let (q, r, a) = ([0.4, 1.1, 3.0, -0.2], [1.3, -2.1], [5.0, 8.0]);
        let at = |t: f64| {
            let angle = |i: usize| q[i] + r[i] * t + a[i] * t * t / 2.0;
            arm.forward([angle(0), angle(1), q[2], q[3]])
        };
        let h = 1e-4;
        let (before, now, after) = (at(-h), at(0.0), at(h));
        let expected = arm.tool_acceleration(q, r, a);
        let velocity: [f64; 4] = std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * h));
        let rates = arm.joint_velocity(q, velocity);
        for i in 0..2 {
            let second = (after[i] - 2.0 * now[i] + before[i]) / (h * h);
            assert!((second - expected[i]).abs() < 1e-2, "{second} {expected:?}");
            assert!((rates[i] - r[i]).abs() < 1e-5);
        }
        assert!(rates[3].abs() < 1e-5);
    }
}
