//! The SCARA's kinematics against the textbook's formulas in `f64`.

use planner_core::kinematics::{Elbow, JointRange, PoseError, Scara, ScaraConfig, ScaraError};
use planner_core::pose::{AXES, Joint3, JointPosition, Pose};
use planner_core::units::{AngleDeg, AngleRad, LengthMm};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

/// Law of cosines, `acos` and `atan2`, in millimetres and radians.
#[derive(Clone, Copy)]
struct Textbook {
    l1: f64,
    l2: f64,
    elbow: f64,
    joint1_mid: f64,
}

impl Textbook {
    fn of(config: &ScaraConfig) -> Self {
        let [range, ..] = config.joint_limits;
        Self {
            l1: config.link1_mm.into(),
            l2: config.link2_mm.into(),
            elbow: if config.elbow == Elbow::Left {
                -1.0
            } else {
                1.0
            },
            joint1_mid: f64::midpoint(range.min.into(), range.max.into()).to_radians(),
        }
    }

    fn forward(&self, [t1, t2, d3, t4]: [f64; 4]) -> [f64; 4] {
        let x = self.l1 * t1.cos() + self.l2 * (t1 + t2).cos();
        let y = self.l1 * t1.sin() + self.l2 * (t1 + t2).sin();
        [x, y, d3, (t1 + t2 + t4).to_degrees()]
    }

    fn inverse(&self, [x, y, z, c]: [f64; 4]) -> [f64; 4] {
        let c2 =
            (x * x + y * y - self.l1 * self.l1 - self.l2 * self.l2) / (2.0 * self.l1 * self.l2);
        let t2 = self.elbow * c2.clamp(-1.0, 1.0).acos();
        let t1 = y.atan2(x) - (self.l2 * t2.sin()).atan2(self.l1 + self.l2 * t2.cos());
        // (mid - π, mid + π]
        let t1 = self.joint1_mid + PI - (self.joint1_mid + PI - t1).rem_euclid(TAU);
        [t1, t2, z, c.to_radians() - t1 - t2]
    }
}

fn pose([x, y, z, c]: [f64; 4]) -> Pose {
    Pose {
        x: LengthMm::from_num(x),
        y: LengthMm::from_num(y),
        z: LengthMm::from_num(z),
        c: AngleDeg::from_num(c),
    }
}

fn pose_f64(pose: &Pose) -> [f64; 4] {
    [
        pose.x.to_num(),
        pose.y.to_num(),
        pose.z.to_num(),
        pose.c.to_num(),
    ]
}

fn joints([t1, t2, d3, t4]: [f64; 4]) -> JointPosition {
    JointPosition {
        joint1: AngleRad::from_num(t1),
        joint2: AngleRad::from_num(t2),
        joint3: Joint3::from_length(LengthMm::from_num(d3)),
        joint4: AngleRad::from_num(t4),
    }
}

fn joints_f64(j: &JointPosition) -> [f64; 4] {
    [
        j.joint1.to_num(),
        j.joint2.to_num(),
        j.joint3.as_length().to_num(),
        j.joint4.to_num(),
    ]
}

fn robot(link1_mm: f32, link2_mm: f32, elbow: Elbow) -> (Scara, Textbook) {
    let config = ScaraConfig {
        link1_mm,
        link2_mm,
        elbow,
        ..ScaraConfig::default()
    };
    (Scara::new(&config).unwrap(), Textbook::of(&config))
}

const LINKS: [(f32, f32); 5] = [
    (200.0, 150.0),
    (150.0, 200.0),
    (100.0, 100.0),
    (1200.0, 800.0),
    (333.3, 41.7),
];

/// A pose with the elbow bent by `bend` degrees, at polar angle `direction` degrees.
fn pose_at(textbook: &Textbook, bend: f64, direction: f64, c: f64) -> [f64; 4] {
    let (l1, l2) = (textbook.l1, textbook.l2);
    let radius = (l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * bend.to_radians().cos()).sqrt();
    let (s, cos) = direction.to_radians().sin_cos();
    [radius * cos, radius * s, 12.5, c]
}

/// Largest difference, angles by the shorter way around.
fn angle_error(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(TAU);
    d.min(TAU - d)
}

#[test]
fn inverse_over_the_workspace() {
    println!("links, elbow: tool error max / RMS in nm, C in nrad, joints 1 and 2 in nrad");
    for (l1, l2) in LINKS {
        for elbow in [Elbow::Left, Elbow::Right] {
            let (scara, textbook) = robot(l1, l2, elbow);
            let (mut tool, mut squares, mut yaw, mut angles) = (0.0_f64, 0.0, 0.0_f64, 0.0_f64);
            let mut count = 0.0;
            for bend in 0..=340 {
                for direction in 0..720 {
                    let target = pose(pose_at(
                        &textbook,
                        5.0 + 0.5 * f64::from(bend),
                        f64::from(direction) * 0.5,
                        -40.0,
                    ));
                    let exact = pose_f64(&target);
                    let joints = joints_f64(&scara.inverse(&target));
                    let reached = textbook.forward(joints);
                    let miss = (reached[0] - exact[0]).hypot(reached[1] - exact[1]);
                    tool = tool.max(miss);
                    squares += miss * miss;
                    count += 1.0;
                    yaw = yaw.max((reached[3] - exact[3]).to_radians().abs());
                    let oracle = textbook.inverse(exact);
                    angles = angles
                        .max(angle_error(joints[0], oracle[0]))
                        .max((joints[1] - oracle[1]).abs());
                    let back = pose_f64(&scara.forward(&scara.inverse(&target)));
                    assert!((back[0] - exact[0]).hypot(back[1] - exact[1]) < 1e-4);
                    assert!((back[3] - exact[3]).to_radians().abs() < 1e-6);
                    assert_eq!(back[2], exact[2]);
                }
            }
            println!(
                "{l1} + {l2} {elbow:?}: {:.1} / {:.1}, {:.1}, {:.1}",
                tool * 1e6,
                f64::sqrt(squares / count) * 1e6,
                yaw * 1e9,
                angles * 1e9
            );
            let reach = f64::from(l1 + l2);
            assert!(
                (5e-9..4e-8).contains(&(tool / reach)),
                "{tool} of {reach} mm"
            );
            assert!((1e-9..1e-6).contains(&yaw) && (5e-9..1e-6).contains(&angles));
        }
    }
}

/// The forward map against the textbook's.
#[test]
fn forward_over_the_joints() {
    let (scara, textbook) = robot(200.0, 150.0, Elbow::Right);
    let mut worst = 0.0_f64;
    for step in 0..200_000 {
        let step = f64::from(step);
        let at = joints([
            (step * 0.7).rem_euclid(12.0) - 6.0,
            (step * 0.31).rem_euclid(6.2) - 3.1,
            1.5,
            step * 1e-5,
        ]);
        let (got, want) = (
            pose_f64(&scara.forward(&at)),
            textbook.forward(joints_f64(&at)),
        );
        worst = worst
            .max((got[0] - want[0]).abs())
            .max((got[1] - want[1]).abs());
        assert!((got[3] - want[3]).abs() < 2e-6);
    }
    println!("forward: max error {:.2} nm", worst * 1e6);
    assert!((1e-7..3e-6).contains(&worst));
}

#[test]
fn jacobian_is_the_derivative() {
    for (l1, l2) in LINKS {
        let (scara, textbook) = robot(l1, l2, Elbow::Right);
        for step in 0..500 {
            let s = f64::from(step);
            let at = joints([s * 0.012 - 3.0, s * 0.006 - 1.4, 20.0, 0.3]);
            let center = joints_f64(&at);
            let jacobian = scara.jacobian(&at);
            for column in 0..AXES {
                let shifted = |by: f64| {
                    let mut joints = center;
                    joints[column] += by;
                    textbook.forward(joints)
                };
                let (ahead, behind) = (shifted(1e-5), shifted(-1e-5));
                for row in 0..AXES {
                    let unit = if row == 3 { TAU / 360.0 } else { 1.0 };
                    let numeric = (ahead[row] - behind[row]) / 2e-5 * unit;
                    let error = (numeric - f64::from(jacobian[row][column])).abs();
                    assert!(
                        error < 1e-6 * f64::from(l1 + l2),
                        "[{row}][{column}]: {error}"
                    );
                }
            }
        }
    }
}

/// Five-point differences of the textbook's joints along a motion.
fn derivatives(of: impl Fn(f64) -> [f64; 4]) -> ([f64; 4], [f64; 4]) {
    let h = 1e-3;
    let [a, b, c, d, e] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| of(k * h));
    let mut rates = ([0.0; 4], [0.0; 4]);
    for i in 0..4 {
        rates.0[i] = (a[i] - 8.0 * b[i] + 8.0 * d[i] - e[i]) / (12.0 * h);
        rates.1[i] = (-a[i] + 16.0 * b[i] - 30.0 * c[i] + 16.0 * d[i] - e[i]) / (12.0 * h * h);
    }
    rates
}

/// A smooth motion: sinusoids of the bend and the direction, the yaw and the height.
fn rate_errors(seed: [f64; 4], left: bool, links: usize) -> (f64, f64) {
    let (l1, l2) = LINKS[links];
    let elbow = if left { Elbow::Left } else { Elbow::Right };
    let (scara, textbook) = robot(l1, l2, elbow);
    let [phase, slow, fast, wide] = seed;
    let place = |t: f64| {
        let bend = 90.0 + 70.0 * (phase + slow * t).sin();
        let direction = wide * (2.0 * phase + fast * t).cos();
        let mut at = pose_at(&textbook, bend, direction, 90.0 * (fast * t + phase).sin());
        at[2] = 30.0 * (slow * t).sin();
        at
    };
    let (velocity, acceleration) = derivatives(place);
    let state = scara.joint_state(
        &pose(place(0.0)),
        velocity.map(|v| v as f32),
        acceleration.map(|a| a as f32),
    );
    // Differences across joint 1's seam are not its rate: put the seam opposite.
    let [joint1_mid, ..] = textbook.inverse(place(0.0));
    let unwrapped = Textbook {
        joint1_mid,
        ..textbook
    };
    let (velocity, acceleration) = derivatives(|t| unwrapped.inverse(place(t)));
    let error = |got: [f32; 4], want: [f64; 4]| {
        [0, 1, 3]
            .into_iter()
            .fold(0.0_f64, |m, i| m.max((f64::from(got[i]) - want[i]).abs()))
    };
    // Of the joints that turn: the third's rates pass unchanged.
    // Accelerations are sums of terms as large as the squares of rates, which may cancel.
    let fastest = [0, 1, 3]
        .into_iter()
        .fold(0.1_f64, |m, i| m.max(velocity[i].abs()));
    let sharpest = [0, 1, 3]
        .into_iter()
        .fold(fastest * fastest, |m, i| m.max(acceleration[i].abs()));
    (
        error(state.velocity, velocity) / fastest,
        error(state.acceleration, acceleration) / sharpest,
    )
}

#[test]
fn rates_along_a_motion() {
    println!("links: velocity, acceleration; relative to the largest rate or its square");
    for (links, (l1, l2)) in LINKS.into_iter().enumerate() {
        let mut worst = (0.0_f64, 0.0_f64);
        for step in 0..10_000 {
            let s = f64::from(step);
            let seed = [
                s * 0.37,
                1.0 + (s * 0.11) % 6.0,
                1.0 + (s * 0.07) % 9.0,
                20.0 + s % 60.0,
            ];
            let (velocity, acceleration) = rate_errors(seed, step % 2 == 0, links);
            worst = (worst.0.max(velocity), worst.1.max(acceleration));
        }
        println!("{l1} + {l2}: {:.2e}, {:.2e}", worst.0, worst.1);
        assert!((1e-7..1e-5).contains(&worst.0), "{}", worst.0);
        assert!((1e-7..1e-4).contains(&worst.1), "{}", worst.1);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trip_anywhere(
        links in 0..LINKS.len(), left: bool, bend in 5.0..175.0_f64,
        direction in -180.0..180.0_f64, c in -500.0..500.0_f64,
    ) {
        let (l1, l2) = LINKS[links];
        let (scara, textbook) = robot(l1, l2, if left { Elbow::Left } else { Elbow::Right });
        let target = pose(pose_at(&textbook, bend, direction, c));
        let joints = scara.inverse(&target);
        prop_assert_eq!(joints.joint2.to_bits() < 0, left);
        let (back, exact) = (pose_f64(&scara.forward(&joints)), pose_f64(&target));
        prop_assert!((back[0] - exact[0]).hypot(back[1] - exact[1]) < 1e-3);
        prop_assert!((back[3] - exact[3]).to_radians().abs() < 1e-6);
    }

    #[test]
    fn any_input_gives_finite_rates(
        bits: [i32; 4], links in 0..LINKS.len(), left: bool, near: bool, fast in -1e6..1e6_f32,
    ) {
        let (l1, l2) = LINKS[links];
        let (scara, _) = robot(l1, l2, if left { Elbow::Left } else { Elbow::Right });
        let at = Pose::from_bits(if near { bits.map(|b| b >> 24) } else { bits });
        let state = scara.joint_state(&at, [fast; 4], [-fast; 4]);
        prop_assert!(state.velocity.iter().chain(&state.acceleration).all(|r| r.is_finite()));
        prop_assert!(state.position.joint1.to_num::<f64>().abs() <= PI + 1e-7);
        prop_assert!(state.position.joint2.to_num::<f64>().abs() <= PI + 1e-7);
        let _ = scara.check(&at);
        let joints = JointPosition {
            joint1: AngleRad::from_bits(bits[0]),
            joint2: AngleRad::from_bits(bits[1]),
            joint3: Joint3::from_bits(bits[2]),
            joint4: AngleRad::from_bits(bits[3]),
        };
        let _ = (scara.forward(&joints), scara.jacobian(&joints));
    }
}

#[test]
fn singular_and_extreme_poses() {
    let extremes = [i32::MIN, i32::MIN + 1, -1, 0, 1, i32::MAX];
    for (l1, l2) in LINKS {
        for elbow in [Elbow::Left, Elbow::Right] {
            let (scara, _) = robot(l1, l2, elbow);
            for x in extremes {
                for y in extremes {
                    let state =
                        scara.joint_state(&Pose::from_bits([x, y, x, y]), [1000.0; 4], [1e4; 4]);
                    assert!(
                        state
                            .velocity
                            .iter()
                            .chain(&state.acceleration)
                            .all(|r| r.is_finite())
                    );
                }
            }
        }
    }
}

/// A thousand states, folded to a number that a Cortex-M4F computed from the same poses.
#[test]
fn bits_are_those_of_the_microcontroller() {
    let (scara, _) = robot(200.0, 150.0, Elbow::Right);
    let (mut seed, mut folded) = (12345_u32, 0_u32);
    let mut next = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        seed as i32
    };
    for _ in 0..1000 {
        let (a, b) = (next(), next());
        let at = Pose::from_bits([a >> 4, b >> 4, a >> 6, b >> 3]);
        let (v, w) = ((a >> 20) as f32, (b >> 20) as f32);
        let state = scara.joint_state(&at, [v, w, v, w], [w, v, w, v]);
        let JointPosition {
            joint1,
            joint2,
            joint4,
            ..
        } = state.position;
        folded = folded.rotate_left(1)
            ^ joint1.to_bits() as u32
            ^ (joint2.to_bits() as u32).rotate_left(7)
            ^ joint4.to_bits() as u32;
        for rate in state.velocity.iter().chain(&state.acceleration) {
            folded = folded.rotate_left(3) ^ rate.to_bits();
        }
    }
    assert_eq!(folded, 0x13e4_dcc1, "{folded:#x}");
}

/// Beyond the reach the arm points at the pose, stretched.
#[test]
fn saturates_at_the_edge() {
    let (scara, _) = robot(200.0, 150.0, Elbow::Right);
    let joints = scara.inverse(&pose([3000.0, -3000.0, 0.0, 0.0]));
    assert!((joints.joint1.to_num::<f64>() + PI / 4.0).abs() < 1e-4);
    assert!(joints.joint2.to_num::<f64>().abs() < 1e-4);
}

/// Joint 1 is within half a turn of the middle of its range, wherever that is.
#[test]
fn joint1_follows_its_range() {
    for (min, max) in [
        (0.0, 350.0),
        (-350.0, -10.0),
        (-10.0, 340.0),
        (170.0, 360.0),
    ] {
        let mut config = ScaraConfig::default();
        config.joint_limits[0] = JointRange { min, max };
        let (scara, textbook) = (Scara::new(&config).unwrap(), Textbook::of(&config));
        for direction in 0..3600 {
            let at = pose(pose_at(
                &textbook,
                80.0,
                f64::from(direction) * 0.1 + 0.05,
                0.0,
            ));
            let (got, want) = (
                joints_f64(&scara.inverse(&at)),
                textbook.inverse(pose_f64(&at)),
            );
            assert!(
                (got[0] - want[0]).abs() < 1e-6,
                "{} for {}",
                got[0],
                want[0]
            );
        }
    }
}

#[test]
fn check_names_the_limit() {
    let (scara, textbook) = robot(200.0, 150.0, Elbow::Right);
    let check = |at: [f64; 4]| scara.check(&pose(at));
    assert!(check([225.0, 135.0, 0.0, 0.0]).is_ok());
    assert!(matches!(
        check([351.0, 0.0, 0.0, 0.0]),
        Err(PoseError::Unreachable { .. })
    ));
    assert!(matches!(
        check([49.0, 0.0, 0.0, 0.0]),
        Err(PoseError::Unreachable { .. })
    ));
    let bent = |bend: f64| check(pose_at(&textbook, bend, 0.0, 0.0));
    assert!(matches!(bent(4.999), Err(PoseError::NearSingular { .. })) && bent(5.001).is_ok());
    assert!(matches!(
        bent(170.001),
        Err(PoseError::JointLimit { joint: 2, .. })
    ));
    assert!(matches!(
        check([225.0, 0.0, 200.1, 0.0]),
        Err(PoseError::JointLimit { joint: 3, .. })
    ));
    assert!(matches!(
        check([225.0, 0.0, 0.0, 900.0]),
        Err(PoseError::JointLimit { joint: 4, .. })
    ));
    assert!(matches!(
        check([225.0, 0.0, 0.0, 4000.0]),
        Err(PoseError::JointLimit { joint: 4, .. })
    ));
    let behind = check([-225.0, 225.0, 0.0, 0.0]).map(|j| j.joint1.to_num::<f64>().to_degrees());
    assert!(behind.is_ok_and(|joint1| (100.0..135.0).contains(&joint1)));
    let error = check(textbook.forward([175_f64.to_radians(), 1.0, 0.0, 0.0])).unwrap_err();
    assert_eq!(
        error.to_string(),
        "joint 1 would be at 175.000°, its travel is -170.000 to 170.000°"
    );
    assert_eq!(
        check([360.0, 0.0, 0.0, 0.0]).unwrap_err().to_string(),
        "the tool would be 360.000 mm from the shoulder, the arm reaches from 50.000 to 350.000 mm"
    );
}

/// C that saturates is not taken for one within limits.
#[test]
fn any_orientation_too_far_is_refused() {
    let mut config = ScaraConfig::default();
    config.joint_limits[3] = JointRange::symmetric(1080.0);
    config.joint_limits[0] = JointRange {
        min: 359.0,
        max: 360.0,
    };
    for elbow in [Elbow::Left, Elbow::Right] {
        let scara = Scara::new(&ScaraConfig { elbow, ..config }).unwrap();
        let textbook = Textbook::of(&ScaraConfig { elbow, ..config });
        for c in -4095..4096 {
            let c = f64::from(c);
            let at = textbook.forward([359.5_f64.to_radians(), textbook.elbow, 0.0, 0.0]);
            let wrist = c - at[3];
            let checked = scara.check(&pose([at[0], at[1], 0.0, c]));
            assert_eq!(checked.is_ok(), wrist.abs() <= 1080.0, "C {c}: {checked:?}");
        }
    }
}

#[test]
fn configuration_errors_name_the_parameter() {
    let with = |change: fn(&mut ScaraConfig)| {
        let mut config = ScaraConfig::default();
        change(&mut config);
        Scara::new(&config).map(|_| ())
    };
    assert_eq!(with(|_| ()), Ok(()));
    assert_eq!(with(|c| c.link1_mm = f32::NAN), Err(ScaraError::Link1));
    assert_eq!(with(|c| c.link1_mm = f32::INFINITY), Err(ScaraError::Link1));
    assert_eq!(with(|c| c.link2_mm = -150.0), Err(ScaraError::Link2));
    assert_eq!(with(|c| c.link2_mm = 1800.5), Err(ScaraError::Reach));
    assert_eq!(
        with(|c| c.singularity_margin_deg = 0.0),
        Err(ScaraError::SingularityMargin)
    );
    assert_eq!(
        with(|c| c.joint_limits[0] = JointRange::symmetric(180.5)),
        Err(ScaraError::JointLimits(1))
    );
    assert_eq!(
        with(|c| c.joint_limits[1].min = f32::NAN),
        Err(ScaraError::JointLimits(2))
    );
    assert_eq!(
        with(|c| c.joint_limits[2] = JointRange::symmetric(-1.0)),
        Err(ScaraError::JointLimits(3))
    );
    assert_eq!(
        with(|c| c.joint_limits[3].max = 1081.0),
        Err(ScaraError::JointLimits(4))
    );
    assert_eq!(
        with(|c| c.joint_limits[1] = JointRange {
            min: -170.0,
            max: 4.0
        }),
        Err(ScaraError::ElbowSide)
    );
}
