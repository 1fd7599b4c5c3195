//! Homing by limit inputs: the controller finds where the arm is.

use host_tests::serial_loop::{Records, SerialLoop, with_controller};
use host_tests::switched_arm::{LimitSwitch, SwitchedArm};
use planner_core::pose::JointPosition;

const RAD: f64 = (1 << 26) as f64;
const MM: f64 = (1 << 19) as f64;

/// Joint positions of degrees and, for joint 3, millimetres.
fn joints([j1, j2, j3, j4]: [f64; 4]) -> JointPosition {
    let angle = |degrees: f64| (degrees.to_radians() * RAD).round() as i32;
    JointPosition::from_bits([angle(j1), angle(j2), (j3 * MM).round() as i32, angle(j4)])
}

/// An arm with switches where the default settings expect them: at -165° and 10°, at 190 mm
/// from below, at -360°.
pub fn bench_arm() -> SwitchedArm {
    arm_at([-30.0, 60.0, 20.0, 15.0])
}

fn arm_at(position: [f64; 4]) -> SwitchedArm {
    let positions = joints([-165.0, 10.0, 190.0, -360.0]).to_bits();
    let switches = std::array::from_fn(|joint| LimitSwitch {
        position: positions[joint],
        is_upper: joint == 2,
        stuck: None,
    });
    SwitchedArm::new(joints(position), switches)
}

fn with_arm(arm: SwitchedArm, body: impl FnOnce(&mut SerialLoop<'_>)) {
    with_controller(Records::new(), |desk| {
        desk.arm = Some(arm);
        desk.run_ms(2);
        assert!(desk.ask("$home-joints=15").contains("ok"));
        body(desk);
    });
}

/// Sends `$H` and waits for its answer.
fn home(desk: &mut SerialLoop<'_>) -> String {
    desk.send(b"$H\n");
    let mut heard = String::new();
    for _ in 0..600_000 {
        desk.tick();
        heard += &desk.heard();
        if heard.contains("ok") || heard.contains("error") {
            break;
        }
    }
    heard
}

/// The largest difference between where the controller takes the joints to be and where they
/// are, in degrees and mm.
fn error(desk: &SerialLoop<'_>) -> f64 {
    let told = desk.setpoint().joints.position.to_bits();
    let true_joints = desk.arm.as_ref().unwrap().joints().to_bits();
    let errors = told.iter().zip(true_joints).enumerate();
    errors
        .map(|(joint, (told, is))| {
            let bits = f64::from(told - is).abs();
            if joint == 2 {
                bits / MM
            } else {
                (bits / RAD).to_degrees()
            }
        })
        .fold(0.0, f64::max)
}

#[test]
fn the_position_is_that_of_the_arm() {
    // The last begins on the switches of joints 1 and 3.
    for position in [
        [-30.0, 60.0, 20.0, 15.0],
        [100.0, 150.0, -180.0, 300.0],
        [-166.0, 40.0, 191.0, 0.0],
    ] {
        with_arm(arm_at(position), |desk| {
            assert!(desk.ask("G91 G1 X1 F600").contains("error:62"));
            let heard = home(desk);
            assert!(heard.contains("ok"), "{position:?}: {heard}");
            desk.run_ms(5);
            assert_eq!(desk.state(), "Idle");
            // Two ticks at the speed of locating, 2 °/s and 2 mm/s.
            assert!(error(desk) < 0.004, "{position:?}: {}", error(desk));
            // 5° and 5 mm from the switches
            let told = desk.setpoint().joints.position.to_bits();
            let expected = joints([-160.0, 15.0, 185.0, -355.0]).to_bits();
            for (told, expected) in told.into_iter().zip(expected) {
                assert!((told - expected).abs() < (1e-4 * RAD) as i32);
            }
            // It can be moved from there, and nothing jumps.
            let before = desk.setpoint().pose;
            assert!(desk.ask("G91 G1 Z-5 F6000").contains("ok"));
            assert!(desk.run_until("Idle"));
            let after = desk.setpoint().pose;
            let moved: f64 = (after.z - before.z).to_num();
            assert!((moved + 5.0).abs() < 1e-5, "{moved}");
            assert!(error(desk) < 0.004, "{}", error(desk));
        });
    }
}

#[test]
fn joints_move_no_faster_than_set_and_smoothly() {
    with_arm(bench_arm(), |desk| {
        desk.ask("$home-fast=20 home-slow=1");
        desk.send(b"$H\n");
        let mut last = desk.setpoint().joints;
        let (mut is_placed, mut is_answered) = (false, false);
        let mut top: f32 = 0.0;
        for _ in 0..600_000 {
            desk.tick();
            let joints = desk.setpoint().joints;
            // The setpoints may jump only where they say so.
            is_placed |= desk.setpoint().placed;
            if !is_placed {
                let steps = joints.position.to_bits().into_iter();
                for (joint, (to, from)) in steps.zip(last.position.to_bits()).enumerate() {
                    let unit = if joint == 2 { MM } else { RAD };
                    let step = f64::from(to - from).abs() / unit;
                    let limit = if joint == 2 {
                        20.0
                    } else {
                        20_f64.to_radians()
                    };
                    assert!(step <= limit * 1e-3 + 1e-6, "joint {joint}: {step}");
                }
            }
            let speed = [joints.velocity[0], joints.velocity[1], joints.velocity[3]];
            top = speed.into_iter().fold(top, |top, v| top.max(v.abs()));
            last = joints;
            is_answered |= desk.heard().contains("ok");
            if is_answered && is_placed {
                break;
            }
        }
        assert!(is_answered && is_placed);
        let expected = 20_f32.to_radians();
        assert!((top - expected).abs() < 1e-3 * expected, "{top}");
    });
}

#[test]
fn realtime_bytes_reach_homing() {
    with_arm(bench_arm(), |desk| {
        desk.send(b"$H\n");
        desk.run_ms(500);
        assert_eq!(desk.state(), "Home");
        // A hold would leave it between two switches.
        desk.send(b"!");
        desk.run_ms(1000);
        assert_eq!(desk.state(), "Home");
        desk.send(&[0x19]);
        assert!(desk.run_until("Alarm"));
        let heard = desk.heard();
        assert!(
            heard.contains("ALARM:6") && heard.contains("error:9"),
            "{heard}"
        );
        assert!(desk.ask("$X").contains("ok"));
        assert!(desk.ask("G91 G1 X1 F600").contains("error:62"));
        // Again, to the end.
        assert!(home(desk).contains("ok"));
        desk.run_ms(2);
        assert!(error(desk) < 0.004);
    });
}

#[test]
fn a_program_may_say_where_the_arm_is_after_homing_was_stopped() {
    with_arm(bench_arm(), |desk| {
        desk.send(b"$H\n");
        desk.run_ms(700);
        desk.send(b"\x18");
        assert!(desk.run_until("Alarm"));
        assert!(desk.ask("$X").contains("ok"));
        assert!(desk.ask("G0 X250 Y0").contains("ok"));
        assert!(desk.ask("G1 X260 F6000").contains("ok"));
        assert!(desk.run_until("Idle"));
        assert_eq!(desk.setpoint().pose.x, 260);
    });
}
