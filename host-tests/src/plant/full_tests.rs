//! The full plant against analytic answers, and on the corner path.

use super::config::{FullConfig, JOINTS, ModeMap};
use super::full::{FullPlant, JointSetpoint, LATENCY_TICKS, PlantOutput};
use super::{Body, DeltaArm, Elbow, Mode, ScaraArm};
use crate::oracle::{Path, Prefilter, path::corner_path};
use crate::vector::{distance, xyz};
use crate::vibration::{Vibration, moving_samples};

const TICK_S: f64 = 1e-3;

fn hold(plant: &mut FullPlant, position: [f64; JOINTS], ticks: u32) -> Vec<PlantOutput> {
    (0..ticks)
        .map(|_| plant.step(JointSetpoint::at_rest(position)))
        .collect()
}

/// Frequency and damping ratio of a free decay, from its upward zero crossings and
/// the logarithmic decrement between extrema.
fn identify(signal: &[f64]) -> (f64, f64) {
    let crossings: Vec<f64> = signal
        .windows(2)
        .enumerate()
        .filter(|(_, s)| s[0] < 0.0 && s[1] >= 0.0)
        .map(|(i, s)| (i as f64 + s[0] / (s[0] - s[1])) * TICK_S)
        .collect();
    let cycles = (crossings.len() - 1) as f64;
    let damped = cycles / (crossings[crossings.len() - 1] - crossings[0]);
    let peak = |from: f64| {
        let first = (from / TICK_S) as usize;
        let window = &signal[first..first + (1.0 / damped / TICK_S) as usize];
        let (i, &top) = window
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .unwrap();
        let (before, after) = (window[i - 1], window[i + 1]);
        top - (after - before).powi(2) / (8.0 * (before - 2.0 * top + after))
    };
    let decrement =
        (peak(crossings[0]) / peak(crossings[crossings.len() - 2])).ln() / (cycles - 1.0);
    let damping = decrement / (4.0 * std::f64::consts::PI.powi(2) + decrement.powi(2)).sqrt();
    (damped / (1.0 - damping * damping).sqrt(), damping)
}

#[test]
fn end_effector_rings_at_the_frequency_and_damping_set() {
    let fast = Mode {
        frequency_hz: 12.3,
        damping: 0.05,
    };
    // With its default mass the end effector moves the arm a little.
    for (mass, mode, damping_error) in [
        (1e-9, Mode::default(), 1e-3),
        (1e-9, fast, 1e-3),
        (0.05, Mode::default(), 5e-3),
    ] {
        let mut config = FullConfig {
            tool_mass_kg: mass,
            mode: ModeMap::constant(mode),
            ..FullConfig::default()
        };
        config.joints.iter_mut().for_each(|j| j.encoder_noise = 0.0);
        let start = config.start;
        let mut plant = FullPlant::new(config);
        plant.pluck([1.0, 0.4]);
        let ticks = (10_000.0 / mode.frequency_hz) as u32;
        let record = hold(&mut plant, start, ticks);
        for axis in 0..2 {
            let signal: Vec<f64> = record
                .iter()
                .map(|o| o.tool_acceleration_mm_s2[axis])
                .collect();
            let (frequency, damping) = identify(&signal);
            assert!(
                (frequency / mode.frequency_hz - 1.0).abs() < 1e-3,
                "{frequency}"
            );
            assert!(
                (damping / mode.damping - 1.0).abs() < damping_error,
                "{damping}"
            );
        }
    }
}

#[test]
fn end_effector_follows_the_pose_map() {
    let map = ModeMap::from_fn(|[x, ..]| Mode {
        frequency_hz: x / 20.0,
        damping: 0.02,
    });
    for q2 in [0.8, 1.5, 2.2] {
        let config = FullConfig {
            start: [0.2, q2, 0.0, 0.0],
            mode: map.clone(),
            tool_mass_kg: 1e-9,
            ..FullConfig::default()
        };
        let (start, body) = (config.start, config.body);
        let mut plant = FullPlant::new(config);
        plant.pluck([1.0, 0.0]);
        let record = hold(&mut plant, start, 2000);
        let signal: Vec<f64> = record
            .iter()
            .map(|o| o.tool_acceleration_mm_s2[0])
            .collect();
        let expected = body.forward(start)[0] / 20.0;
        assert!((identify(&signal).0 / expected - 1.0).abs() < 1e-3);
    }
}

#[test]
fn mechanics_without_damping_and_drives_keep_their_energy() {
    let mut config = FullConfig {
        tool_mass_kg: 0.5,
        mode: ModeMap::constant(Mode {
            frequency_hz: 6.34,
            damping: 0.0,
        }),
        ..FullConfig::default()
    };
    for joint in &mut config.joints {
        joint.damping = 0.0;
        joint.servo.gains.torque_limit = 0.0;
    }
    let start = config.start;
    let mut plant = FullPlant::new(config.clone());
    plant.pluck([30.0, -20.0]);
    let energy = plant.energy_j();
    assert!((energy - 0.25 * Mode::default().omega().powi(2) * 1.3e-3).abs() < 1e-9);
    for _ in 0..3000 {
        plant.step(JointSetpoint::at_rest(start));
        assert!(
            (plant.energy_j() / energy - 1.0).abs() < 1e-5,
            "{}",
            plant.energy_j()
        );
    }
    // With dampers it only falls.
    config.mode = ModeMap::default();
    config.joints[0].damping = 5.0;
    let mut plant = FullPlant::new(config);
    plant.pluck([30.0, -20.0]);
    let mut last = energy;
    for _ in 0..3000 {
        plant.step(JointSetpoint::at_rest(start));
        assert!(plant.energy_j() <= last * (1.0 + 1e-9));
        last = plant.energy_j();
    }
    assert!(last < 0.1 * energy, "{last} of {energy}");
}

#[test]
fn servo_settles_after_a_step() {
    let config = FullConfig::default();
    let target: [f64; JOINTS] =
        std::array::from_fn(|i| config.start[i] + [0.01, 0.01, 2.0, 0.01][i]);
    let mut plant = FullPlant::new(config);
    let record = hold(&mut plant, target, 5000);
    for joint in 0..JOINTS {
        let unit = [0.01, 0.01, 2.0, 0.01][joint];
        let overshoot = record
            .iter()
            .map(|o| (o.motor_position[joint] - target[joint]) / unit)
            .fold(f64::MIN, f64::max);
        assert!(overshoot < 0.3, "{overshoot}");
        let left = record[4900..]
            .iter()
            .map(|o| ((o.joint_position[joint] - target[joint]) / unit).abs())
            .fold(0.0, f64::max);
        assert!(left < 2e-3, "{joint} {left}");
    }
}

#[test]
fn feed_forward_keeps_up_and_its_absence_lags_by_v_over_kp() {
    for (share, lag) in [(1.0, 0.0), (0.0, 0.3 / 200.0)] {
        let mut config = FullConfig::default();
        config.joints[3].servo.gains.velocity_feed_forward = share;
        let mut plant = FullPlant::new(config.clone());
        let mut out = plant.output();
        let mut sent = [0.0; 2];
        for k in 0..2000 {
            let mut setpoint = JointSetpoint::at_rest(config.start);
            setpoint.position[3] += 0.3e-3 * f64::from(k);
            setpoint.velocity[3] = 0.3;
            out = plant.step(setpoint);
            sent = [sent[1], setpoint.position[3]];
        }
        let error = sent[0] - out.motor_position[3];
        assert!((error - lag).abs() < 1e-5, "{error}");
    }
}

#[test]
fn output_of_the_next_call_belongs_to_a_setpoint() {
    assert_eq!(LATENCY_TICKS, 2);
    let config = FullConfig::default();
    let mut plant = FullPlant::new(config.clone());
    let mut moved = JointSetpoint::at_rest(config.start);
    moved.position[2] += 0.1;
    let before = plant.step(moved).motor_position[2];
    let after = plant.step(moved).motor_position[2];
    assert!(before.abs() < 1e-3 && after > 0.05, "{before} {after}");
}

#[test]
fn noise_repeats_with_its_seed() {
    let run = |seed| {
        let config = FullConfig {
            seed,
            ..FullConfig::default()
        };
        let start = config.start;
        *hold(&mut FullPlant::new(config), start, 200)
            .last()
            .unwrap()
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}

/// The oracle's corner path through the full plant: vibration and worst miss of the
/// flange against the command.
fn corner_path_run(name: &str, config: FullConfig) -> (Vibration, f64) {
    let filter = Prefilter::named(name, 6.34, 0.022).unwrap();
    let path = Path::uniform(&corner_path(), 160.0, &filter, 0.5);
    let schedule = path.schedule();
    let arm = ScaraArm::default();
    let command = schedule.sample(TICK_S, 3.0);
    let setpoints: Vec<_> = command
        .iter()
        .zip(0u32..)
        .map(|(&pose, k)| {
            let position = arm.inverse(pose, Elbow::Right).unwrap();
            let velocity = schedule.velocity(f64::from(k) * TICK_S);
            JointSetpoint {
                position,
                velocity: arm.joint_velocity(position, velocity),
                acceleration: [0.0; 4],
            }
        })
        .collect();
    let mut plant = FullPlant::new(FullConfig {
        start: setpoints[0].position,
        ..config
    });
    let mut acceleration = Vec::new();
    let mut miss = 0.0_f64;
    for (k, &setpoint) in setpoints.iter().enumerate() {
        let out = plant.step(setpoint);
        acceleration.push(out.tool_acceleration_mm_s2);
        if k > 0 {
            miss = miss.max(distance(out.flange_mm, xyz(command[k - 1])));
        }
    }
    let moving = moving_samples(&command) + LATENCY_TICKS;
    (Vibration::measure(&acceleration, moving), miss)
}

#[test]
fn fir_zvd_takes_85_percent_of_the_vibration_away() {
    let (none, _) = corner_path_run("none", FullConfig::default());
    assert!((11_000.0..12_500.0).contains(&none.max_mm_s2), "{none:?}");
    // Ratios to no prefilter, maximum and RMS, close to the ideal plant's; the
    // flange's distance from the command two ticks before, millimetres.
    for (name, max, rms, miss) in [
        ("zv", 0.303, 0.200, 0.6),
        ("zvd", 0.168, 0.139, 0.5),
        ("ei", 0.181, 0.141, 0.5),
        ("fir", 0.192, 0.148, 0.08),
        ("fir-zv", 0.098, 0.110, 0.08),
        ("fir-zvd", 0.088, 0.096, 0.05),
    ] {
        let (found, found_miss) = corner_path_run(name, FullConfig::default());
        let ratios = [
            found.max_mm_s2 / none.max_mm_s2,
            found.rms_mm_s2 / none.rms_mm_s2,
        ];
        assert!((ratios[0] - max).abs() < 0.01, "{name} {ratios:?}");
        assert!((ratios[1] - rms).abs() < 0.01, "{name} {ratios:?}");
        assert!(found_miss < miss, "{name} {found_miss}");
        if name == "fir-zvd" {
            assert!(ratios.iter().all(|&ratio| ratio < 0.15));
            assert!(found.residual_max_mm_s2 < 0.005 * none.residual_max_mm_s2);
        }
    }
}

#[test]
fn what_rings_after_a_stop_is_the_end_effector() {
    let mut plant = FullPlant::new(FullConfig::default());
    let start = FullConfig::default().start;
    let mut target = start;
    target[0] += 0.02;
    let ring = hold(&mut plant, target, 2500);
    for axis in 0..2 {
        let signal: Vec<f64> = ring[600..]
            .iter()
            .map(|o| o.tool_acceleration_mm_s2[axis])
            .collect();
        let (frequency, damping) = identify(&signal);
        assert!((frequency / 6.34 - 1.0).abs() < 5e-3, "{frequency}");
        assert!((damping - 0.022).abs() < 2e-3, "{damping}");
    }
}

/// A delta in the middle of its workspace.
fn delta() -> FullConfig {
    let arm = DeltaArm::default();
    FullConfig {
        start: arm.inverse([0.0, 0.0, -767.0, 0.0]).unwrap(),
        ..FullConfig::delta(arm)
    }
}

#[test]
fn a_delta_without_damping_and_drives_keeps_its_energy() {
    let mut config = FullConfig {
        tool_mass_kg: 0.5,
        mode: ModeMap::constant(Mode {
            frequency_hz: 6.34,
            damping: 0.0,
        }),
        ..delta()
    };
    for joint in &mut config.joints {
        joint.damping = 0.0;
        joint.servo.gains.torque_limit = 0.0;
    }
    let start = config.start;
    let mut plant = FullPlant::new(config);
    plant.pluck([30.0, -20.0]);
    let energy = plant.energy_j();
    for _ in 0..2000 {
        plant.step(JointSetpoint::at_rest(start));
        let ratio = plant.energy_j() / energy;
        assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");
    }
    let moved = distance(plant.output().flange_mm, [0.0, 0.0, -767.0]);
    assert!(moved > 0.1, "{moved} mm");
}

#[test]
fn a_deltas_first_mode_is_where_the_thesis_measured_it() {
    // Motors that hold still: heavy, and without drives.
    let mut config = FullConfig {
        tool_mass_kg: 1e-9,
        ..delta()
    };
    for joint in &mut config.joints {
        joint.servo.motor_inertia = 1e4;
        joint.servo.gains.torque_limit = 0.0;
    }
    let start = config.start;
    // Arms 2 and 3 a little off, to the opposite: the platform goes sideways.
    let mut shifted = config.clone();
    shifted.start[1] += 1e-3;
    shifted.start[2] -= 1e-3;
    let body = config.body;
    let mut plant = FullPlant::new(shifted);
    plant.place_motors(start);
    let aside: Vec<f64> = hold(&mut plant, start, 400)
        .iter()
        .map(|out| out.flange_mm[0] - body.forward(start)[0])
        .collect();
    let (frequency, damping) = identify(&aside);
    // 36.6 Hz ± 13 %
    assert!((32.0..42.0).contains(&frequency), "{frequency}");
    assert!((0.01..0.1).contains(&damping), "{damping}");
}

#[test]
fn a_delta_follows_across_its_workspace() {
    let config = delta();
    let Body::Delta(arm) = config.body else {
        panic!("a delta");
    };
    // 400 mm and 60 mm up in 0.6 s, as a cosine.
    let place = |k: u32| {
        let phase = (f64::from(k.min(600)) / 600.0 * std::f64::consts::PI).cos();
        [200.0 * -phase, 0.0, -737.0 - 30.0 * phase, 0.0]
    };
    let joints = |k: u32| arm.inverse(place(k)).unwrap();
    let mut plant = FullPlant::new(FullConfig {
        start: joints(0),
        ..config
    });
    let mut miss = 0.0_f64;
    for k in 0..1000 {
        let (before, now, after) = (joints(k.max(1) - 1), joints(k), joints(k + 1));
        let half = |i: usize| (after[i] - before[i]) / (2.0 * TICK_S);
        let bend = |i: usize| (after[i] - 2.0 * now[i] + before[i]) / (TICK_S * TICK_S);
        let out = plant.step(JointSetpoint {
            position: now,
            velocity: std::array::from_fn(half),
            acceleration: std::array::from_fn(bend),
        });
        assert_eq!(out.saturated, [false; JOINTS]);
        if k > 0 {
            miss = miss.max(distance(out.flange_mm, xyz(place(k - 1))));
        }
    }
    assert!(miss < 0.5, "{miss} mm");
    let end = plant.output();
    assert!(distance(end.flange_mm, xyz(place(600))) < 0.01);
}
