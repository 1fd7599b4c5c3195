//! The delta's kinematics against circles and spheres in `f64`.

#[path = "support/delta.rs"]
mod geometry;

use geometry::{Geometry, WORKSPACE, dot, joints_f64, pose, pose_f64, sized, workspace};
use planner_core::kinematics::{Delta, DeltaConfig, DeltaError, JointRange, PoseError};
use planner_core::pose::{JointPosition, Pose};
use proptest::prelude::*;

fn robot() -> (Delta, Geometry) {
    of(&DeltaConfig::default())
}

fn of(config: &DeltaConfig) -> (Delta, Geometry) {
    (Delta::new(config).unwrap(), Geometry::of(config))
}

/// Other robots of this kind: small, large, without an offset, with forearms as short as arms.
fn robots() -> [DeltaConfig; 5] {
    [
        DeltaConfig::default(),
        sized(60.0, 20.0, 80.0, 210.0),
        sized(300.0, 100.0, 600.0, 1100.0),
        sized(50.0, 50.0, 300.0, 500.0),
        sized(180.0, 45.0, 400.0, 420.0),
    ]
}

/// Largest error of a joint in rad, and of inverse and then forward in mm.
fn errors(delta: &Delta, geometry: &Geometry, at: &Pose) -> (f64, f64) {
    let exact = pose_f64(at);
    let joints = delta.inverse(at);
    let oracle = geometry.inverse(exact);
    let angles = joints_f64(&joints).into_iter().zip(oracle);
    let angle = angles.fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
    let back = pose_f64(&delta.forward(&joints));
    let off: [f64; 3] = std::array::from_fn(|i| back[i] - exact[i]);
    assert!((back[3] - exact[3]).abs() < 2e-6);
    (angle, dot(off, off).sqrt())
}

#[test]
fn inverse_and_forward_over_the_workspace() {
    let (delta, geometry) = robot();
    let (mut angle, mut miss, mut squares, mut count) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    for [x, y, z] in workspace([80, 80, 24]) {
        let (a, m) = errors(&delta, &geometry, &pose([x, y, z, 33.3]));
        angle = angle.max(a);
        miss = miss.max(m);
        squares += m * m;
        count += 1.0;
    }
    println!(
        "joints within {:.2e}°, inverse and forward within {:.1} nm, RMS {:.1} nm",
        angle.to_degrees(),
        miss * 1e6,
        f64::sqrt(squares / count) * 1e6
    );
    assert!((5e-9..3e-8).contains(&angle), "{angle:e} rad");
    assert!((3e-6..4e-5).contains(&miss), "{miss:e} mm");
}

/// The textbook's form in single precision, to see where it fails: `tan(θ/2) = (-b - √) / 2a`.
fn textbook_f32(geometry: &Geometry, [x, y, z]: [f64; 3]) -> f32 {
    let (l1, l2) = (geometry.upper_arm as f32, geometry.forearm as f32);
    let (r, x, y, z) = (geometry.offset as f32, x as f32, y as f32, z as f32);
    let e = 2.0 * l1 * (y + r);
    let g = 2.0 * z * l1;
    let h = x * x + y * y + z * z + r * r + l1 * l1 - l2 * l2 + 2.0 * y * r;
    let (a, b, c) = (h - e, 2.0 * g, h + e);
    2.0 * ((-b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).atan()
}

#[test]
fn nothing_happens_where_the_textbooks_denominator_vanishes() {
    let (delta, geometry) = robot();
    let denominator = |x: f64, y: f64, z: f64| {
        let Geometry {
            offset,
            upper_arm,
            forearm,
        } = geometry;
        let sum = x * x + y * y + z * z + offset * offset;
        sum + upper_arm * upper_arm - forearm * forearm + 2.0 * y * offset
            - 2.0 * upper_arm * (y + offset)
    };
    let (mut found, mut angle, mut miss, mut textbook) = (0, 0.0_f64, 0.0_f64, 0.0_f64);
    for [x, y, z] in workspace([200, 200, 1]) {
        let (mut low, mut high) = WORKSPACE[2];
        if z > low {
            continue;
        }
        if denominator(x, y, low) < 0.0 || denominator(x, y, high) > 0.0 {
            continue;
        }
        while high - low > 1e-9 {
            let middle = f64::midpoint(low, high);
            if denominator(x, y, middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        found += 1;
        for step in -3..=3 {
            let at = pose([x, y, low + f64::from(step) / 524_288.0, 0.0]);
            let (a, m) = errors(&delta, &geometry, &at);
            angle = angle.max(a);
            miss = miss.max(m);
        }
        let exact = geometry.arm(0, [x, y, low]).unwrap().angle;
        let lost = f64::from(textbook_f32(&geometry, [x, y, low])) - exact;
        if lost.is_finite() {
            textbook = textbook.max(lost.abs());
        }
    }
    println!(
        "{found} places: joints within {:.2e}°, inverse and forward within {:.1} nm; the \
         textbook's form loses {:.1}°",
        angle.to_degrees(),
        miss * 1e6,
        textbook.to_degrees()
    );
    assert!(found > 1000, "{found}");
    assert!(angle < 3e-8 && miss < 4e-5, "{angle:e} rad, {miss:e} mm");
    assert!(textbook.to_degrees() > 1.0);
}

/// Forward from the joints alone: all three forearms have their length, and the tool hangs below.
#[test]
fn forward_puts_the_platform_on_all_three_spheres() {
    let (delta, geometry) = robot();
    let mut worst = 0.0_f64;
    for step in 0..200_000 {
        let s = f64::from(step);
        let angle = |rate: f64, mid: f64| mid + 0.6 * (s * rate).sin();
        let joints = [angle(0.37, 0.4), angle(0.21, 0.5), angle(0.113, 0.6), 0.0];
        let bits = joints.map(|rad| (rad * 2_f64.powi(26)) as i32);
        let joints = JointPosition::from_bits(bits);
        let [x, y, z, _] = pose_f64(&delta.forward(&joints));
        assert!(z < -300.0);
        for (k, angle) in joints_f64(&joints).into_iter().take(3).enumerate() {
            let elbow = geometry.elbow(k, angle);
            let forearm = [x - elbow[0], y - elbow[1], z - elbow[2]];
            worst = worst.max((dot(forearm, forearm).sqrt() - geometry.forearm).abs());
        }
    }
    println!("forearms of their length within {:.1} nm", worst * 1e6);
    assert!((1e-6..2e-5).contains(&worst), "{worst:e} mm");
}

#[test]
fn the_published_pose_and_its_turns() {
    let (delta, geometry) = robot();
    let degrees = |at| joints_f64(&delta.inverse(&pose(at))).map(f64::to_degrees);
    for angle in &degrees([0.0, 0.0, -767.0, 0.0])[..3] {
        assert!((angle - 21.305_482).abs() < 2e-6, "{angle}");
    }
    // Turning the place by 120° hands the angles on.
    let place = [-350.0, 40.0, -767.0];
    let (s, c) = 120_f64.to_radians().sin_cos();
    let turned = [
        place[0] * c - place[1] * s,
        place[0] * s + place[1] * c,
        -767.0,
    ];
    let (first, then) = (
        geometry.arms(place).unwrap(),
        geometry.arms(turned).unwrap(),
    );
    for k in 0..3 {
        assert!((first[k].angle - then[(k + 1) % 3].angle).abs() < 1e-12);
    }
}

/// Five-point differences.
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

#[test]
fn rates_along_a_motion() {
    let (delta, geometry) = robot();
    let mut worst = (0.0_f64, 0.0_f64);
    for step in 0..20_000 {
        let s = f64::from(step);
        let (phase, slow, fast) = (s * 0.37, 1.0 + (s * 0.11) % 6.0, 1.0 + (s * 0.07) % 9.0);
        let place = |t: f64| {
            [
                390.0 * (phase + slow * t).sin(),
                390.0 * (1.7 * phase + fast * t).cos(),
                -714.0 + 110.0 * (0.3 * phase + fast * t).sin(),
                90.0 * (fast * t + phase).sin(),
            ]
        };
        let (velocity, acceleration) = derivatives(place);
        let state = delta.joint_state(
            &pose(place(0.0)),
            velocity.map(|v| v as f32),
            acceleration.map(|a| a as f32),
        );
        let (velocity, acceleration) = derivatives(|t| geometry.inverse(place(t)));
        let largest = |values: [f64; 4]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let error = |got: [f32; 4], want: [f64; 4]| {
            largest(std::array::from_fn(|i| f64::from(got[i]) - want[i]))
        };
        // Accelerations are sums of terms as large as the squares of rates, which may cancel.
        let fastest = largest(velocity).max(0.1);
        let sharpest = largest(acceleration).max(fastest * fastest);
        worst.0 = worst.0.max(error(state.velocity, velocity) / fastest);
        worst.1 = worst
            .1
            .max(error(state.acceleration, acceleration) / sharpest);
    }
    println!(
        "velocity {:.2e}, acceleration {:.2e} of the largest or its square",
        worst.0, worst.1
    );
    assert!((1e-8..1e-6).contains(&worst.0), "{}", worst.0);
    assert!((1e-8..2e-6).contains(&worst.1), "{}", worst.1);
}

/// Largest and smallest singular value of a 3 × 3 matrix, by the eigenvalues of its square.
fn singular_values(m: [[f64; 3]; 3]) -> (f64, f64) {
    let square: [[f64; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| m[k][i] * m[k][j]).sum()));
    let trace = square[0][0] + square[1][1] + square[2][2];
    let mean = trace / 3.0;
    let mut p2 = 0.0;
    for (i, row) in square.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let value = value - if i == j { mean } else { 0.0 };
            p2 += value * value;
        }
    }
    let p = (p2 / 6.0).sqrt();
    let b: [[f64; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| (square[i][j] - if i == j { mean } else { 0.0 }) / p)
    });
    let half = dot(b[0], geometry::cross(b[1], b[2])) / 2.0;
    let angle = half.clamp(-1.0, 1.0).acos() / 3.0;
    let largest = mean + 2.0 * p * angle.cos();
    let smallest = mean + 2.0 * p * (angle + 2.0 * std::f64::consts::FRAC_PI_3).cos();
    (largest.sqrt(), smallest.max(0.0).sqrt())
}

#[test]
fn jacobian_undoes_the_derivative_and_is_well_conditioned() {
    let (delta, geometry) = robot();
    let (mut error, mut condition, mut serial) = (0.0_f64, 0.0_f64, f64::INFINITY);
    for [x, y, z] in workspace([40, 40, 12]) {
        let jacobian = delta.jacobian(&delta.inverse(&pose([x, y, z, 10.0])));
        assert_eq!(jacobian[3], [0.0, 0.0, 0.0, 1.0]);
        let h = 1e-3;
        let mut across = [[0.0; 3]; 3];
        for axis in 0..3 {
            let shifted = |by: f64| {
                let mut at = [x, y, z, 10.0];
                at[axis] += by;
                geometry.inverse(at)
            };
            let (ahead, behind) = (shifted(h), shifted(-h));
            for (joint, row) in across.iter_mut().enumerate() {
                row[axis] = (ahead[joint] - behind[joint]) / (2.0 * h);
            }
        }
        for (row, entries) in jacobian.iter().take(3).enumerate() {
            assert_eq!(entries[3], 0.0);
            for column in 0..3 {
                let joints = entries.iter().zip(&across);
                let product: f64 = joints.map(|(a, b)| f64::from(*a) * b[column]).sum();
                let unit = if row == column { 1.0 } else { 0.0 };
                error = error.max((product - unit).abs());
            }
        }
        let (largest, smallest) = singular_values(std::array::from_fn(|row| {
            std::array::from_fn(|column| f64::from(jacobian[row][column]))
        }));
        condition = condition.max(largest / smallest);
        for arm in geometry.arms([x, y, z]).unwrap() {
            serial = serial.min(arm.serial);
        }
    }
    println!(
        "Jacobian within {error:.1e}; condition up to {condition:.3}; forearms {:.2}° from serial \
         singularity or further",
        serial.to_degrees()
    );
    assert!((1e-8..1e-5).contains(&error), "{error}");
    // 6.8 and 28° as published
    assert!((6.75..6.85).contains(&condition), "{condition}");
    assert!((28.0..29.0).contains(&serial.to_degrees()));
}

#[test]
fn the_whole_workspace_is_allowed() {
    let (delta, _) = robot();
    for [x, y, z] in workspace([60, 60, 16]) {
        let at = pose([x, y, z, -45.0]);
        assert_eq!(delta.check(&at), Ok(delta.inverse(&at)), "{x} {y} {z}");
    }
}

#[test]
fn what_the_arms_cannot_do_is_refused_by_name() {
    let refused = |config: DeltaConfig, at| of(&config).0.check(&pose(at)).unwrap_err();
    let standard = DeltaConfig::default();
    // Further below than the arms are long, and to the side.
    for at in [[0.0, 0.0, -1200.0, 0.0], [2500.0, 0.0, -767.0, 0.0]] {
        let error = refused(standard, at);
        let PoseError::ArmUnreachable {
            distance_mm,
            max_mm,
            ..
        } = error
        else {
            panic!("{error}");
        };
        assert!(distance_mm > max_mm);
    }
    // Just within reach upper arm and forearm are nearly in line.
    assert!(matches!(
        refused(standard, [0.0, 0.0, -1130.0, 0.0]),
        PoseError::NearSerial { angle_deg, .. } if angle_deg < 20.0
    ));
    // In the low corners two forearms hang nearly side by side.
    let wide = DeltaConfig {
        arm_limits: JointRange::symmetric(170.0),
        parallel_margin: 0.3,
        ..standard
    };
    assert!(matches!(
        refused(wide, [398.5, 398.5, -828.0, 0.0]),
        PoseError::NearParallel { volume, .. } if volume < 0.3
    ));
    let stiff = DeltaConfig {
        arm_limits: JointRange {
            min: 0.0,
            max: 60.0,
        },
        ..standard
    };
    let error = refused(stiff, [-350.0, 0.0, -767.0, 0.0]);
    assert!(
        matches!(error, PoseError::JointLimit { joint: 2, value, .. } if (value - 60.7385).abs() < 1e-3),
        "{error}"
    );
    let error = refused(standard, [0.0, 0.0, -767.0, 721.0]);
    assert!(matches!(error, PoseError::JointLimit { joint: 4, .. }));
    assert!(error.to_string().contains("721.000°"), "{error}");
}

#[test]
fn impossible_dimensions_are_refused_by_name() {
    let standard = DeltaConfig::default();
    let range = |min, max| JointRange { min, max };
    for (config, error) in [
        (
            DeltaConfig {
                base_radius_mm: 40.0,
                ..standard
            },
            DeltaError::Radii,
        ),
        (
            DeltaConfig {
                platform_radius_mm: f32::NAN,
                ..standard
            },
            DeltaError::Radii,
        ),
        (
            DeltaConfig {
                upper_arm_mm: 9.0,
                ..standard
            },
            DeltaError::UpperArm,
        ),
        (
            DeltaConfig {
                forearm_mm: f32::NAN,
                ..standard
            },
            DeltaError::Forearm,
        ),
        (
            DeltaConfig {
                forearm_mm: 1500.0,
                ..standard
            },
            DeltaError::Reach,
        ),
        (
            DeltaConfig {
                arm_limits: range(-171.0, 90.0),
                ..standard
            },
            DeltaError::ArmLimits,
        ),
        (
            DeltaConfig {
                yaw_limits: range(10.0, -10.0),
                ..standard
            },
            DeltaError::YawLimits,
        ),
        (
            DeltaConfig {
                serial_margin_deg: 0.1,
                ..standard
            },
            DeltaError::SerialMargin,
        ),
        (
            DeltaConfig {
                parallel_margin: 0.0,
                ..standard
            },
            DeltaError::ParallelMargin,
        ),
    ] {
        assert_eq!(Delta::new(&config).unwrap_err(), error);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trip_anywhere(
        x in WORKSPACE[0].0..WORKSPACE[0].1, y in WORKSPACE[1].0..WORKSPACE[1].1,
        z in WORKSPACE[2].0..WORKSPACE[2].1, c in -700.0..700.0_f64,
    ) {
        let (delta, geometry) = robot();
        let (angle, miss) = errors(&delta, &geometry, &pose([x, y, z, c]));
        prop_assert!(angle < 3e-8, "{angle:e} rad");
        prop_assert!(miss < 1e-3, "{miss:e} mm");
    }

    /// Wherever a robot of any size may be, it knows where it is.
    #[test]
    fn round_trip_of_other_robots(
        robot in 0..5_usize, x in -0.7..0.7_f64, y in -0.7..0.7_f64, z in -1.2..-0.1_f64,
    ) {
        let config = DeltaConfig { parallel_margin: 0.05, ..robots()[robot] };
        let (delta, geometry) = of(&config);
        let size = f64::from(config.forearm_mm);
        let at = pose([x * size, y * size, z * size, 0.0]);
        if delta.check(&at).is_ok() {
            let (angle, miss) = errors(&delta, &geometry, &at);
            prop_assert!(angle < 3e-5 / size, "{angle:e} rad");
            prop_assert!(miss < 1e-3, "{miss:e} mm");
        }
    }

    #[test]
    fn any_input_gives_finite_rates(
        bits: [i32; 4], robot in 0..5_usize, near: bool, fast in -1e6..1e6_f32,
    ) {
        let (delta, _) = of(&robots()[robot]);
        let at = Pose::from_bits(if near { bits.map(|b| b >> 24) } else { bits });
        let state = delta.joint_state(&at, [fast; 4], [-fast; 4]);
        prop_assert!(state.velocity.iter().chain(&state.acceleration).all(|r| r.is_finite()));
        let _ = delta.check(&at);
        let joints = JointPosition::from_bits(bits);
        let _ = delta.forward(&joints);
        prop_assert!(delta.jacobian(&joints).iter().flatten().all(|entry| entry.is_finite()));
    }
}
