//! What a drive does between two setpoints: the core's interpolation and servo, in fixed point
//! and single precision, against the same in double precision; and what they achieve.

use host_tests::oracle::servo as oracle;
use host_tests::plant::{FullConfig, FullPlant, JointSetpoint};
use host_tests::serial_loop::{Records, with_controller};
use planner_core::servo::{
    CYCLES_PER_TICK, Cubic, Knot, SIXTEENTHS, Servo, ServoConfig, ServoGains, Travel,
};
use proptest::prelude::*;

const TICK_S: f64 = 1e-3;

/// A position, its velocity and its acceleration in rad, s.
#[derive(Clone, Copy)]
struct Motion {
    position: f64,
    velocity: f64,
    acceleration: f64,
}

fn bits(position_rad: f64) -> i32 {
    (position_rad * f64::from(1 << 26)).round() as i32
}

fn knot(motion: Motion) -> Knot {
    Knot {
        position: bits(motion.position),
        velocity: motion.velocity as f32,
    }
}

/// The upper arm's angle of the delta robot of [vNoorden21] whose arm lies along the motion, by
/// the stable formula, in double precision.
fn delta_arm_rad(x_mm: f64, z_mm: f64) -> f64 {
    let (r, l1, l2) = (155.0, 348.088, 800.0_f64);
    let e = 2.0 * l1 * (x_mm + r);
    let g = 2.0 * z_mm * l1;
    let h = x_mm * x_mm + z_mm * z_mm + r * r + l1 * l1 - l2 * l2 + 2.0 * x_mm * r;
    2.0 * (h + e).atan2(-g + (g * g + e * e - h * h).sqrt())
}

/// The reference move: that arm's angle while the tool goes 700 mm across with limited
/// acceleration and jerk, so fast that the joint's acceleration peaks at the 5039 °/s² of
/// [vNoorden21].
fn reference_rad(t: f64) -> f64 {
    /// Longest acceleration and the time in which it builds up, in seconds.
    const ACCELERATES_S: f64 = 0.1511;
    const BUILDS_UP_S: f64 = 0.02;
    // the ramp response of two boxes
    let ramp = |t: f64| {
        let cube = |t: f64| t.max(0.0).powi(3) / 6.0;
        (cube(t) - cube(t - ACCELERATES_S) - cube(t - BUILDS_UP_S)
            + cube(t - ACCELERATES_S - BUILDS_UP_S))
            / (ACCELERATES_S * BUILDS_UP_S)
    };
    let way = (ramp(t) - ramp(t - ACCELERATES_S - BUILDS_UP_S)) / (ACCELERATES_S + BUILDS_UP_S);
    delta_arm_rad(-350.0 + 700.0 * way, -767.0)
}

/// How long the reference move takes, in seconds.
const REFERENCE_S: f64 = 0.343;

/// The reference move with its derivatives, by five points each.
fn reference(t: f64) -> Motion {
    const H: f64 = 2e-5;
    let q = |i: i32| reference_rad(t + f64::from(i) * H);
    Motion {
        position: q(0),
        velocity: (q(-2) - 8.0 * q(-1) + 8.0 * q(1) - q(2)) / (12.0 * H),
        acceleration: (-q(-2) + 16.0 * q(-1) - 30.0 * q(0) + 16.0 * q(1) - q(2)) / (12.0 * H * H),
    }
}

/// The largest acceleration of the reference move, and the largest error of what a cubic
/// through two knots makes of it, in °/s².
fn acceleration_errors(knot_at: impl Fn(i32) -> Knot) -> (f64, f64) {
    let (mut peak, mut worst) = (0.0_f64, 0.0_f64);
    for tick in -5..(REFERENCE_S / TICK_S) as i32 + 5 {
        let cubic = Cubic::new(knot_at(tick), knot_at(tick + 1), Travel::Rotary);
        for cycle in 0..CYCLES_PER_TICK {
            let sixteenths = cycle * (SIXTEENTHS / CYCLES_PER_TICK);
            let t = (f64::from(tick) + f64::from(sixteenths) / 16.0) * TICK_S;
            let wanted = reference(t).acceleration.to_degrees();
            let found = f64::from(cubic.acceleration(sixteenths) * Travel::Rotary.si_per_lsb());
            peak = peak.max(wanted.abs());
            worst = worst.max((found.to_degrees() - wanted).abs());
        }
    }
    (peak, worst)
}

#[test]
fn on_the_reference_move_the_acceleration_is_right_within_30_degrees_per_second_squared() {
    let exact = |tick: i32| knot(reference(f64::from(tick) * TICK_S));
    // what Catmull and Rom would take for the velocity
    let differenced = |tick: i32| {
        let at = |tick: i32| reference(f64::from(tick) * TICK_S).position;
        knot(Motion {
            velocity: (at(tick + 1) - at(tick - 1)) / (2.0 * TICK_S),
            ..reference(f64::from(tick) * TICK_S)
        })
    };
    let (peak, worst) = acceleration_errors(exact);
    let (_, worst_differenced) = acceleration_errors(differenced);
    println!(
        "peak {peak:.0} °/s²; error {worst:.1} °/s² with exact velocities, \
         {worst_differenced:.0} °/s² with differenced ones"
    );
    assert!((5000.0..5080.0).contains(&peak), "{peak}");
    assert!(worst <= 30.0, "{worst}");
    assert!(worst_differenced > 5.0 * worst, "{worst_differenced}");
}

/// Gains of a joint of the simulated robot.
fn config() -> ServoConfig {
    ServoConfig {
        gains: ServoGains {
            position_gain: 200.0,
            velocity_gain: 100.0,
            torque_limit: 50.0,
            ..ServoGains::PUBLISHED
        },
        motor_inertia: 0.1,
        total_inertia: 0.12,
        ..ServoConfig::default()
    }
}

fn in_double(config: &ServoConfig) -> oracle::ServoConfig {
    let gains = config.gains;
    oracle::ServoConfig {
        motor_inertia: config.motor_inertia.into(),
        feed_forward_inertia: config.total_inertia.into(),
        position_gain: gains.position_gain.into(),
        velocity_gain: gains.velocity_gain.into(),
        integral_time_s: gains.integral_time_s.into(),
        velocity_feed_forward: gains.velocity_feed_forward.into(),
        acceleration_feed_forward: gains.acceleration_feed_forward.into(),
        torque_limit: gains.torque_limit.into(),
        observer_rad_s: gains.observer_rad_s.into(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn the_servo_does_what_it_does_in_double_precision(
        start in -3.0_f64..3.0, swing in 0.001_f64..0.3, rad_s in 1.0_f64..60.0,
        limit in 5.0_f32..500.0, load in 0.5_f64..2.0
    ) {
        let mut config = config();
        config.gains.torque_limit = limit;
        let path = |t: f64| Motion {
            position: start + swing * (1.0 - (rad_s * t).cos()),
            velocity: swing * rad_s * (rad_s * t).sin(),
            acceleration: 0.0,
        };
        let mut servo = Servo::new(&config, bits(start)).unwrap();
        let mut double = oracle::Servo::new(in_double(&config), f64::from(bits(start)) / f64::from(1 << 26));
        let (mut at, mut rate) = (start, 0.0);
        let inertia = f64::from(config.total_inertia) * load;
        for tick in 0..400 {
            let next = path(f64::from(tick + 1) * TICK_S);
            servo.latch(knot(next));
            double.latch(oracle::Setpoint {
                position: f64::from(bits(next.position)) / f64::from(1 << 26),
                velocity: f64::from(next.velocity as f32),
                acceleration: 0.0,
            });
            for cycle in 0..CYCLES_PER_TICK {
                let encoder = bits(at);
                let torque = f64::from(servo.cycle(cycle, encoder));
                let exact = double.cycle(cycle, f64::from(encoder) / f64::from(1 << 26));
                // 2e-5 of the largest torque, and what single precision makes of the velocity
                let scale = 2e-5 * f64::from(limit) + 1e-5 * 100.0 * swing * rad_s + 1e-4;
                prop_assert!((torque - exact).abs() < scale, "{torque} and {exact} in tick {tick}");
                prop_assert!(torque.abs() <= f64::from(limit));
                let h = TICK_S / f64::from(CYCLES_PER_TICK);
                at += h * (rate + h / 2.0 * exact / inertia);
                rate += h * exact / inertia;
            }
        }
    }
}

#[test]
fn a_servo_is_refused_by_the_name_of_its_setting() {
    type Change = fn(&mut ServoConfig);
    let wrong: [(&str, Change); 5] = [
        ("position_gain", |config| config.gains.position_gain = 0.0),
        ("integral_time_s", |config| {
            config.gains.integral_time_s = f32::NAN;
        }),
        ("torque_limit", |config| config.gains.torque_limit = -1.0),
        ("observer_rad_s", |config| config.gains.observer_rad_s = 1e6),
        ("total_inertia", |config| config.total_inertia = 0.0),
    ];
    for (name, change) in wrong {
        let mut config = config();
        change(&mut config);
        let error = Servo::new(&config, 0).unwrap_err();
        assert_eq!(error.name, name);
        assert!(error.to_string().contains(name), "{error}");
    }
}

/// The largest tracking error of joint 1's motor in the full plant in µrad, on a move of 60°
/// with limited jerk.
fn tracking_error_urad(velocity_share: f32, acceleration_share: f32) -> f64 {
    tracking_error_of(ServoGains::SCARA.map(|gains| ServoGains {
        velocity_feed_forward: velocity_share,
        acceleration_feed_forward: acceleration_share,
        ..gains
    }))
}

fn tracking_error_of(gains: [ServoGains; 4]) -> f64 {
    let mut plant = FullConfig::default();
    for (joint, gains) in plant.joints.iter_mut().zip(gains) {
        joint.servo.gains = gains;
    }
    let start = plant.start;
    let mut plant = FullPlant::new(plant);
    let move_s = 0.5;
    // quintic: at rest with no acceleration at both ends
    let along = |t: f64| {
        let u = (t / move_s).clamp(0.0, 1.0);
        let way = u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u);
        let rate = 30.0 * u * u * (1.0 - u).powi(2) / move_s;
        (way, rate)
    };
    let mut sent = [start[0]; 2];
    let mut worst = 0.0_f64;
    for tick in 0..700 {
        let (way, rate) = along(f64::from(tick) * TICK_S);
        let mut setpoint = JointSetpoint::at_rest(start);
        setpoint.position[0] += 60_f64.to_radians() * way;
        setpoint.velocity[0] = 60_f64.to_radians() * rate;
        let out = plant.step(setpoint);
        // the output of the next call belongs to a setpoint
        sent = [sent[1], setpoint.position[0]];
        let error = sent[0] - out.motor_position[0];
        worst = worst.max(error.abs());
    }
    worst * 1e6
}

#[test]
fn feed_forward_takes_the_tracking_error_out_of_a_move() {
    let none = tracking_error_urad(0.0, 0.0);
    let velocity = tracking_error_urad(1.0, 0.0);
    let both = tracking_error_urad(1.0, 1.0);
    println!(
        "tracking error of joint 1, 60° in 0.5 s: {none:.0} µrad without feed-forward, \
         {velocity:.0} with that of velocity, {both:.0} with that of acceleration too"
    );
    assert!((15_000.0..25_000.0).contains(&none), "{none}");
    assert!(velocity < none / 10.0, "{velocity}");
    assert!((5.0..velocity / 2.0).contains(&both), "{both}");
}

#[test]
fn the_simulated_drives_have_the_default_settings() {
    let joints = FullConfig::default().joints;
    assert_eq!(joints.map(|joint| joint.servo.gains), ServoGains::SCARA);
}

/// As a drive's controller gets its gains: by `$` lines, kept over a restart.
#[test]
fn gains_come_from_the_settings() {
    let records = with_controller(Records::new(), |desk| {
        desk.run_ms(5);
        assert_eq!(desk.servos(), &ServoGains::SCARA);
        for line in [
            "$servo1-velocity-feed-forward=0 servo1-acceleration-feed-forward=0",
            "$1310=100",
        ] {
            assert!(desk.ask(line).ends_with("ok\r\n"), "{line}");
        }
        for line in [
            "$servo1-position-gain=0",
            "$servo5-observer=1",
            "$servo1-=1",
        ] {
            assert!(desk.ask(line).contains("error:"), "{line}");
        }
        desk.records.clone()
    });
    let gains = with_controller(records, |desk| {
        let gains = *desk.servos();
        desk.run_ms(5);
        assert!(desk.ask("$RST=$").ends_with("ok\r\n"));
        assert_eq!(desk.servos(), &ServoGains::SCARA);
        gains
    });
    assert_eq!(gains[1..], ServoGains::SCARA[1..]);
    let slow = tracking_error_of(gains);
    let published = tracking_error_urad(0.0, 0.0);
    // without feed-forward a joint lags by its velocity over the position gain
    let ratio = slow / published;
    println!("{slow:.0} µrad with half the position gain, {ratio:.3} times as much");
    assert!((1.9..2.05).contains(&ratio), "{ratio}");
}
