//! Velocity, acceleration and jerk of joints and tool, from the setpoints alone.
//!
//! The tool's motion is the joints', carried forward through the arm: with `e(θ)` the unit
//! vector at an angle, `p = l1 e(θ1) + l2 e(θ1 + θ2)` and its derivatives; of a delta robot,
//! through the spheres about its elbows. Jerks are differences of accelerations from tick to tick.

use planner_core::config::RobotConfig;
use planner_core::kinematics::ArmKind;

use crate::plant::DeltaArm;

/// A setpoint: rad and mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointRow {
    /// Positions of the joints.
    pub position: [f64; 4],
    /// Their velocities.
    pub velocity: [f64; 4],
    /// Their accelerations.
    pub acceleration: [f64; 4],
}

/// Velocity, acceleration and jerk of everything that can be limited, in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Of each joint: magnitudes in rad, joint 3 of a SCARA in mm.
    pub joints: [[f64; 3]; 4],
    /// Of the tool: magnitudes in mm.
    pub path: [f64; 3],
    /// The largest along X, Y or Z.
    pub axis: [f64; 3],
    /// What the resolution of the setpoints may add to or take from a jerk: of each joint, ...
    pub joints_noise: [f64; 4],
    /// ... and of the tool.
    pub path_noise: f64,
}

/// What is known of the robot and its setpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Its arms.
    pub geometry: Geometry,
    /// Time between rows.
    pub step_s: f64,
    /// Length of the longest arc that is driven.
    pub longest_arc_mm: f64,
    /// Length of the longest hop with axes that nothing smooths; 0 if there is none.
    pub longest_hop_mm: f64,
}

/// The robot's arms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// Of a SCARA.
    Scara {
        /// Upper arm.
        link1_mm: f64,
        /// Forearm.
        link2_mm: f64,
    },
    /// Of a delta robot; masses do not count.
    Delta(DeltaArm),
}

impl Geometry {
    /// That of a robot's settings.
    #[must_use]
    pub fn of(config: &RobotConfig) -> Self {
        let delta = &config.delta;
        match config.arm {
            ArmKind::Scara => Self::Scara {
                link1_mm: config.scara.link1_mm.into(),
                link2_mm: config.scara.link2_mm.into(),
            },
            ArmKind::Delta => Self::Delta(DeltaArm {
                offset_mm: f64::from(delta.base_radius_mm) - f64::from(delta.platform_radius_mm),
                upper_arm_mm: delta.upper_arm_mm.into(),
                forearm_mm: delta.forearm_mm.into(),
                ..DeltaArm::default()
            }),
        }
    }

    fn reach_mm(&self) -> f64 {
        match self {
            Self::Scara { link1_mm, link2_mm } => link1_mm + link2_mm,
            Self::Delta(delta) => delta.upper_arm_mm + delta.forearm_mm,
        }
    }

    /// How far each joint moves at the most for each mm of the tool and ° of its yaw.
    fn gains(&self, row: &JointRow) -> [f64; 4] {
        match *self {
            Self::Scara { link1_mm, link2_mm } => {
                let [first, second, both] = scara_gains(row, link1_mm, link2_mm);
                [first, second, 1.0, both + 1_f64.to_radians()]
            }
            Self::Delta(delta) => {
                let [first, second, third] = delta.turns_per_mm(row.position);
                [first, second, third, 1_f64.to_radians()]
            }
        }
    }

    /// Velocity and acceleration of the tool in mm.
    fn tool(&self, row: &JointRow) -> [[f64; 3]; 2] {
        match *self {
            Self::Scara { link1_mm, link2_mm } => scara_tool(row, [link1_mm, link2_mm]),
            Self::Delta(delta) => {
                let ([v1, v2, v3, _], [a1, a2, a3, _]) = (row.velocity, row.acceleration);
                delta.platform_motion(row.position, [v1, v2, v3], [a1, a2, a3])
            }
        }
    }
}

/// Resolution of the tool's acceleration in mm/s²: its second differences count 2^-26 mm.
const ACCELERATION_BIT: f64 = 1e6 / (1_u64 << 26) as f64;

/// The progress along an arc counts 2^-30 of it.
const PROGRESS_BIT: f64 = 1.0 / (1_u64 << 30) as f64;

/// The raw path counts 2^-19 mm; and the progress of a hop is good to some 2^-30.
const RAW_BIT_MM: f64 = 1.0 / (1 << 19) as f64;
const HOP_BIT: f64 = 1.0 / (1_u64 << 30) as f64;

/// Relative resolution of accelerations in single precision, after some ten operations.
const SINGLE: f64 = 1e-6;

/// The rates of every row but the first.
#[must_use]
pub fn rates(rows: &[JointRow], arm: &Arm) -> Vec<Rates> {
    rows.windows(2)
        .map(|pair| {
            let [before, now] = [&pair[0], &pair[1]];
            let per_s = 1.0 / arm.step_s;
            let mut found = Rates::default();
            // two accelerations, each from four times half a bit
            let hop_mm = if arm.longest_hop_mm > 0.0 {
                4.0 * RAW_BIT_MM + 8.0 * HOP_BIT * arm.longest_hop_mm
            } else {
                0.0
            };
            let arc_mm = 4.0 * PROGRESS_BIT * arm.longest_arc_mm;
            let resolved = 2.0 * ACCELERATION_BIT + (arc_mm + hop_mm) * per_s * per_s;
            for joint in 0..4 {
                let jerk = (now.acceleration[joint] - before.acceleration[joint]) * per_s;
                found.joints[joint] =
                    [now.velocity[joint], now.acceleration[joint], jerk].map(f64::abs);
            }
            let largest = now.acceleration.map(f64::abs);
            let turns = match arm.geometry {
                Geometry::Scara { .. } => [true, true, false, true],
                Geometry::Delta(_) => [true; 4],
            };
            let among = largest.iter().zip(turns).filter(|(_, turns)| *turns);
            let single = SINGLE * among.map(|(largest, _)| largest).sum::<f64>();
            let gains = arm.geometry.gains(now);
            found.joints_noise = std::array::from_fn(|joint| {
                let single = if turns[joint] { single } else { 0.0 };
                (gains[joint] * resolved + single) * per_s
            });
            let [tool_before, tool] = [before, now].map(|row| arm.geometry.tool(row));
            let size = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let peak = |v: [f64; 3]| v.into_iter().map(f64::abs).fold(0.0, f64::max);
            let jerk = core::array::from_fn(|k| (tool[1][k] - tool_before[1][k]) * per_s);
            found.path = [size(tool[0]), size(tool[1]), size(jerk)];
            found.axis = [peak(tool[0]), peak(tool[1]), peak(jerk)];
            let reach_mm = arm.geometry.reach_mm();
            found.path_noise = (2.0 * resolved + single * 2.0 * reach_mm) * per_s;
            found
        })
        .collect()
}

fn scara_tool(row: &JointRow, links_mm: [f64; 2]) -> [[f64; 3]; 2] {
    let [mut velocity, mut acceleration] = [[0.0; 3]; 2];
    let (mut angle, mut rate, mut gain) = (0.0, 0.0, 0.0);
    for (joint, link_mm) in links_mm.into_iter().enumerate() {
        angle += row.position[joint];
        rate += row.velocity[joint];
        gain += row.acceleration[joint];
        let (sin, cos) = angle.sin_cos();
        velocity[0] -= link_mm * sin * rate;
        velocity[1] += link_mm * cos * rate;
        acceleration[0] -= link_mm * (sin * gain + cos * rate * rate);
        acceleration[1] += link_mm * (cos * gain - sin * rate * rate);
    }
    velocity[2] = row.velocity[2];
    acceleration[2] = row.acceleration[2];
    [velocity, acceleration]
}

/// How far joint 1, joint 2 and their sum turn at the most for each mm of the tool.
fn scara_gains(row: &JointRow, l1: f64, l2: f64) -> [f64; 3] {
    let (sin, cos) = row.position[1].sin_cos();
    let spread = l1 * l2 * sin.abs().max(1e-3);
    let radius = (l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * cos).sqrt();
    [l2 / spread, radius / spread, l1 / spread]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turning_arm_moves_its_tool_on_a_circle() {
        let arm = Arm {
            geometry: Geometry::Scara {
                link1_mm: 200.0,
                link2_mm: 150.0,
            },
            step_s: 1e-3,
            longest_arc_mm: 0.0,
            longest_hop_mm: 0.0,
        };
        let bend: f64 = 1.0;
        let radius = (200.0_f64.powi(2) + 150.0_f64.powi(2) + 60_000.0 * bend.cos()).sqrt();
        let rows: Vec<_> = (0..100)
            .map(|k| JointRow {
                position: [2.0 * f64::from(k) * 1e-3, bend, 5.0, 0.0],
                velocity: [2.0, 0.0, 0.0, -2.0],
                acceleration: [0.0; 4],
            })
            .collect();
        for found in rates(&rows, &arm) {
            assert!((found.path[0] - 2.0 * radius).abs() < 1e-9);
            assert!((found.path[1] - 4.0 * radius).abs() < 1e-9);
            assert!((found.path[2] / (8.0 * radius) - 1.0).abs() < 1e-5);
            assert!(found.axis[0] <= found.path[0]);
            assert_eq!(found.joints[0], [2.0, 0.0, 0.0]);
            assert_eq!(found.joints[3], [2.0, 0.0, 0.0]);
        }
    }

    /// The platform of a delta robot on a circle, through its arms' angles and their differences.
    #[test]
    fn a_delta_carries_its_tool_on_a_circle() {
        let delta = DeltaArm::default();
        let arm = Arm {
            geometry: Geometry::Delta(delta),
            step_s: 1e-3,
            longest_arc_mm: 0.0,
            longest_hop_mm: 0.0,
        };
        let (radius, rate) = (80.0, 3.0);
        let at = |time_s: f64| {
            let (sin, cos) = (rate * time_s).sin_cos();
            delta
                .inverse([100.0 + radius * cos, -50.0 + radius * sin, -700.0, 0.0])
                .expect("within reach")
        };
        let rows: Vec<_> = (0..200)
            .map(|k| {
                let (time_s, h) = (f64::from(k) * 1e-3, 1e-4);
                let [before, now, after] = [-h, 0.0, h].map(|by| at(time_s + by));
                JointRow {
                    position: now,
                    velocity: std::array::from_fn(|j| (after[j] - before[j]) / (2.0 * h)),
                    acceleration: std::array::from_fn(|j| {
                        (after[j] - 2.0 * now[j] + before[j]) / (h * h)
                    }),
                }
            })
            .collect();
        for found in rates(&rows, &arm) {
            for (order, value) in found.path.into_iter().enumerate() {
                let exact = radius * f64::powi(rate, order as i32 + 1);
                assert!(
                    (value / exact - 1.0).abs() < 1e-3,
                    "{order}: {value} {exact}"
                );
            }
        }
    }

    #[test]
    fn a_jerk_is_the_change_of_an_acceleration() {
        let arm = Arm {
            geometry: Geometry::Scara {
                link1_mm: 100.0,
                link2_mm: 100.0,
            },
            step_s: 1e-3,
            longest_arc_mm: 0.0,
            longest_hop_mm: 0.0,
        };
        let row = |acceleration| JointRow {
            position: [0.0, 1.5, 0.0, 0.0],
            acceleration: [acceleration, 0.0, 2.0 * acceleration, 0.0],
            ..JointRow::default()
        };
        let found = rates(&[row(1.0), row(1.5)], &arm)[0];
        assert!((found.joints[0][2] - 500.0).abs() < 1e-9);
        assert!((found.joints[2][2] - 1000.0).abs() < 1e-9);
        assert!(found.joints_noise[0] < 1.0);
    }
}
