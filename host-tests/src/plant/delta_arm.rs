//! A delta robot in double precision: kinematics and the dynamics of its three arms.
//!
//! The platform is a point on three forearms, at `P`; elbow k is at `c` and its forearm is
//! `f = P - c`. With `t` the direction in which the elbow moves, `s = f·t`:
//!
//! ```text
//! f·P' = l1 s θ',   f·P'' = l1 s θ'' - θ'² f·(c - shoulder) - |P' - c'|²
//! (I + m JᵀJ) θ'' = torque - Jᵀ m (J' θ'),   J = F⁻¹ diag(l1 s)
//! ```
//!
//! Half of each forearm's mass counts at its elbow, half at the platform.

/// Dimensions and masses of a delta robot. Arm 1 points along −Y, the others 120° and 240°
/// further; a joint is 0 when its upper arm is level, positive down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaArm {
    /// The base's radius less the platform's, millimetres.
    pub offset_mm: f64,
    /// Shoulder to elbow, millimetres.
    pub upper_arm_mm: f64,
    /// Elbow to platform, millimetres.
    pub forearm_mm: f64,
    /// Each upper arm.
    pub upper_arm_kg: f64,
    /// Each forearm.
    pub forearm_kg: f64,
    /// The platform.
    pub platform_kg: f64,
    /// What is screwed to it.
    pub end_effector_kg: f64,
}

impl Default for DeltaArm {
    /// The robot of \[vNoorden21\].
    fn default() -> Self {
        Self {
            offset_mm: 155.0,
            upper_arm_mm: 348.088,
            forearm_mm: 800.0,
            upper_arm_kg: 0.949,
            forearm_kg: 0.308,
            platform_kg: 1.728,
            end_effector_kg: 0.026,
        }
    }
}

type Vector = [f64; 3];

/// One arm at a posture, millimetres.
#[derive(Clone, Copy)]
struct Limb {
    elbow: Vector,
    /// From the shoulder to the elbow.
    upper_arm: Vector,
    /// The direction in which the elbow moves.
    tangent: Vector,
}

/// All of it at a posture.
struct Posture {
    limbs: [Limb; 3],
    forearms: [Vector; 3],
    /// `∂P/∂θ` by columns, mm/rad.
    columns: [Vector; 3],
}

impl DeltaArm {
    /// Pose `[x, y, z, c]` (mm, degrees) at joints in rad.
    ///
    /// Not finite where the forearms cannot meet.
    #[must_use]
    pub fn forward(&self, q: [f64; 4]) -> [f64; 4] {
        let limbs = self.limbs(q);
        let [x, y, z] = meet(limbs.map(|limb| limb.elbow), self.forearm_mm);
        [x, y, z, q[3].to_degrees()]
    }

    /// Joints in rad at a pose; `None` out of reach.
    #[must_use]
    pub fn inverse(&self, [x, y, z, c]: [f64; 4]) -> Option<[f64; 4]> {
        let (l1, l2) = (self.upper_arm_mm, self.forearm_mm);
        let mut joints = [0.0, 0.0, 0.0, c.to_radians()];
        for (k, joint) in joints.iter_mut().take(3).enumerate() {
            let [ux, uy] = direction(k);
            let outward = x * ux + y * uy - self.offset_mm;
            let across = x * uy - y * ux;
            let squares = outward * outward + across * across + z * z;
            let along = (squares + l1 * l1 - l2 * l2) / (2.0 * l1);
            let distance = outward.hypot(z);
            if along.abs() > distance {
                return None;
            }
            *joint = (-z).atan2(outward) - (along / distance).acos();
        }
        Some(joints)
    }

    /// `∂(x, y, z)/∂(q1, q2, q3)` in mm/rad, by rows.
    #[must_use]
    pub fn jacobian(&self, q: [f64; 4]) -> [Vector; 3] {
        let columns = self.posture(q).columns;
        std::array::from_fn(|row| columns.map(|column| column[row]))
    }

    /// Inertia of each upper arm about its shoulder, half a forearm included, kg·m².
    #[must_use]
    pub fn arm_inertia(&self) -> f64 {
        let length = self.upper_arm_mm * 1e-3;
        (self.upper_arm_kg / 3.0 + self.forearm_kg / 2.0) * length * length
    }

    /// What moves with the platform, half of each forearm included.
    #[must_use]
    pub fn platform_kg(&self) -> f64 {
        self.platform_kg + self.end_effector_kg + 1.5 * self.forearm_kg
    }

    /// Mass matrix of the three arms, kg·m².
    #[must_use]
    pub fn mass_matrix(&self, q: [f64; 4]) -> [Vector; 3] {
        self.mass_of(&self.posture(q).columns)
    }

    fn mass_of(&self, columns: &[Vector; 3]) -> [Vector; 3] {
        let (arm, platform) = (self.arm_inertia(), self.platform_kg() * 1e-6);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let own = if i == j { arm } else { 0.0 };
                own + platform * dot(columns[i], columns[j])
            })
        })
    }

    /// Accelerations of the arms in rad/s² and of the platform in m/s², at joint rates `r` under
    /// `torque` in Nm, with `pull` in N at the platform.
    #[must_use]
    pub fn accelerations(
        &self,
        q: [f64; 4],
        r: Vector,
        torque: Vector,
        pull: Vector,
    ) -> (Vector, Vector) {
        let posture = self.posture(q);
        let columns = &posture.columns;
        let bias = self.bias(&posture, r);
        let platform = self.platform_kg() * 1e-3;
        let force: Vector = std::array::from_fn(|axis| pull[axis] - platform * bias[axis]);
        let load = std::array::from_fn(|k| torque[k] + 1e-3 * dot(columns[k], force));
        let arms = solve(&self.mass_of(columns), load);
        let place = std::array::from_fn(|axis| {
            let driven: f64 = (0..3).map(|k| columns[k][axis] * arms[k]).sum();
            (driven + bias[axis]) * 1e-3
        });
        (arms, place)
    }

    /// Velocity of the platform in m/s.
    #[must_use]
    pub fn velocity(&self, q: [f64; 4], r: Vector) -> Vector {
        let columns = self.posture(q).columns;
        std::array::from_fn(|axis| (0..3).map(|k| columns[k][axis] * r[k]).sum::<f64>() * 1e-3)
    }

    /// Velocity and acceleration of the platform in mm/s and mm/s², at rates and accelerations of
    /// the arms.
    #[must_use]
    pub fn platform_motion(
        &self,
        q: [f64; 4],
        rates: Vector,
        accelerations: Vector,
    ) -> [Vector; 2] {
        let posture = self.posture(q);
        let bias = self.bias(&posture, rates);
        let driven = |by: Vector| {
            let columns = &posture.columns;
            std::array::from_fn(|axis| (0..3).map(|k| columns[k][axis] * by[k]).sum::<f64>())
        };
        let [velocity, acceleration]: [Vector; 2] = [driven(rates), driven(accelerations)];
        let total = std::array::from_fn(|axis| acceleration[axis] + bias[axis]);
        [velocity, total]
    }

    /// How far each arm turns at the most for each mm of the platform, in rad/mm.
    #[must_use]
    pub fn turns_per_mm(&self, q: [f64; 4]) -> Vector {
        let posture = self.posture(q);
        std::array::from_fn(|k| {
            let root = dot(posture.forearms[k], posture.limbs[k].tangent);
            self.forearm_mm / (self.upper_arm_mm * root.abs())
        })
    }

    /// Kinetic energy in joules.
    #[must_use]
    pub fn kinetic_j(&self, q: [f64; 4], r: Vector) -> f64 {
        let velocity = self.velocity(q, r);
        0.5 * (self.arm_inertia() * dot(r, r) + self.platform_kg() * dot(velocity, velocity))
    }

    /// Acceleration of the platform with the arms at constant speed, mm/s².
    fn bias(&self, posture: &Posture, r: Vector) -> Vector {
        let columns = &posture.columns;
        let velocity: Vector =
            std::array::from_fn(|axis| (0..3).map(|k| columns[k][axis] * r[k]).sum());
        let right = std::array::from_fn(|k| {
            let (limb, forearm) = (&posture.limbs[k], posture.forearms[k]);
            let speed = self.upper_arm_mm * r[k];
            let along: Vector =
                std::array::from_fn(|axis| velocity[axis] - speed * limb.tangent[axis]);
            -r[k] * r[k] * dot(forearm, limb.upper_arm) - dot(along, along)
        });
        solve(&posture.forearms, right)
    }

    fn limbs(&self, q: [f64; 4]) -> [Limb; 3] {
        std::array::from_fn(|k| {
            let [ux, uy] = direction(k);
            let (sin, cos) = q[k].sin_cos();
            let l1 = self.upper_arm_mm;
            let upper_arm = [l1 * cos * ux, l1 * cos * uy, -l1 * sin];
            Limb {
                elbow: [
                    self.offset_mm * ux + upper_arm[0],
                    self.offset_mm * uy + upper_arm[1],
                    upper_arm[2],
                ],
                upper_arm,
                tangent: [-sin * ux, -sin * uy, -cos],
            }
        })
    }

    fn posture(&self, q: [f64; 4]) -> Posture {
        let limbs = self.limbs(q);
        let place = meet(limbs.map(|limb| limb.elbow), self.forearm_mm);
        let forearms = limbs.map(|limb| minus(place, limb.elbow));
        let columns = std::array::from_fn(|k| {
            let mut right = [0.0; 3];
            right[k] = self.upper_arm_mm * dot(forearms[k], limbs[k].tangent);
            solve(&forearms, right)
        });
        Posture {
            limbs,
            forearms,
            columns,
        }
    }
}

/// Where arm `k` points.
fn direction(k: usize) -> [f64; 2] {
    let (sin, cos) = (k as f64 * 120_f64.to_radians()).sin_cos();
    [sin, -cos]
}

/// The lower of the two points at `radius` from three centres: below the circle through them.
fn meet([a, b, c]: [Vector; 3], radius: f64) -> Vector {
    let (ab, ac) = (minus(b, a), minus(c, a));
    let normal = cross(ab, ac);
    let square = dot(normal, normal);
    let (u, v) = (cross(normal, ab), cross(ac, normal));
    let centre: Vector = std::array::from_fn(|axis| {
        (dot(ac, ac) * u[axis] + dot(ab, ab) * v[axis]) / (2.0 * square)
    });
    let height = ((radius * radius - dot(centre, centre)) / square).sqrt();
    let down = -height * normal[2].signum();
    std::array::from_fn(|axis| a[axis] + centre[axis] + down * normal[axis])
}

/// Solves `rows · x = right`.
fn solve(rows: &[Vector; 3], right: Vector) -> Vector {
    let [a, b, c] = *rows;
    let columns = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = dot(a, columns[0]);
    std::array::from_fn(|axis| {
        (0..3).map(|k| columns[k][axis] * right[k]).sum::<f64>() / determinant
    })
}

fn minus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_forward() {
        let arm = DeltaArm::default();
        for k in 0..500 {
            let k = f64::from(k);
            let q = [
                0.4 + 0.6 * (0.7 * k).sin(),
                0.4 + 0.6 * (0.31 * k).cos(),
                0.4 + 0.6 * (0.17 * k).sin(),
                0.02 * k,
            ];
            let back = arm.inverse(arm.forward(q)).unwrap();
            for joint in 0..4 {
                assert!((back[joint] - q[joint]).abs() < 1e-11);
            }
        }
        let centre = arm.inverse([0.0, 0.0, -767.0, 0.0]).unwrap();
        assert!((centre[1].to_degrees() - 21.305_482).abs() < 1e-6);
        assert!(arm.inverse([0.0, 0.0, -1200.0, 0.0]).is_none());
    }

    #[test]
    fn derivatives_match_differences() {
        let arm = DeltaArm::default();
        let (q, r) = ([0.4, 0.9, 0.1, 0.0], [1.3, -2.1, 0.7]);
        let torque = [3.0, -8.0, 5.0];
        let (acceleration, place) = arm.accelerations(q, r, torque, [0.0; 3]);
        let at = |t: f64| {
            let angle = |k: usize| q[k] + r[k] * t + acceleration[k] * t * t / 2.0;
            arm.forward([angle(0), angle(1), angle(2), 0.0])
        };
        let h = 1e-4;
        let (before, now, after) = (at(-h), at(0.0), at(h));
        let velocity = arm.velocity(q, r);
        for axis in 0..3 {
            let first = (after[axis] - before[axis]) / (2.0 * h) * 1e-3;
            let second = (after[axis] - 2.0 * now[axis] + before[axis]) / (h * h) * 1e-3;
            assert!((first - velocity[axis]).abs() < 1e-6);
            assert!((second - place[axis]).abs() < 1e-4 * place[axis].abs().max(1.0));
        }
        // The power of the torques is what the kinetic energy gains.
        let energy = |t: f64| {
            let joint = |k: usize| q[k] + r[k] * t + acceleration[k] * t * t / 2.0;
            let rate = std::array::from_fn(|k| r[k] + acceleration[k] * t);
            arm.kinetic_j([joint(0), joint(1), joint(2), 0.0], rate)
        };
        let power = (energy(h) - energy(-h)) / (2.0 * h);
        assert!((power - dot(torque, r)).abs() < 1e-5, "{power}");
    }

    #[test]
    fn a_pull_at_the_platform_is_felt_by_the_arms() {
        let arm = DeltaArm::default();
        let q = arm.inverse([120.0, -200.0, -700.0, 0.0]).unwrap();
        let columns = arm.posture(q).columns;
        // The torques that balance it, by virtual work.
        let pull = [5.0, -7.0, 11.0];
        let torque = columns.map(|column| -1e-3 * dot(column, pull));
        let (arms, place) = arm.accelerations(q, [0.0; 3], torque, pull);
        for k in 0..3 {
            assert!(arms[k].abs() < 1e-10 && place[k].abs() < 1e-10);
        }
    }
}
