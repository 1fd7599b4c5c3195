//! The elbow changes its side inside a program, by a move of the joints.

use host_tests::serial_loop::{Records, SerialLoop, with_controller};
use planner_core::kinematics::Elbow;

const RAD: f64 = (1 << 26) as f64;

fn with_robot(body: impl FnOnce(&mut SerialLoop<'_>)) {
    with_controller(Records::new(), |desk| {
        desk.run_ms(2);
        assert!(desk.ask("G0 X200 Y50 Z10 C20").contains("ok"));
        desk.run_ms(2);
        body(desk);
    });
}

fn side(desk: &SerialLoop<'_>) -> Elbow {
    Elbow::of(desk.setpoint().joints.position.joint2)
}

/// Runs until it is idle, and checks that no joint jumps or is faster than `top_deg_s`.
fn run_smoothly(desk: &mut SerialLoop<'_>, top_deg_s: f64) {
    let mut last = desk.setpoint().joints.position.to_bits();
    for _ in 0..60_000 {
        desk.tick();
        assert!(!desk.setpoint().placed);
        let now = desk.setpoint().joints.position.to_bits();
        for (joint, (to, from)) in now.into_iter().zip(last).enumerate() {
            let step_deg = (f64::from(to - from).abs() / RAD).to_degrees();
            let limit_deg = top_deg_s * 1e-3 + 1e-5;
            assert!(
                joint == 2 || step_deg <= limit_deg,
                "joint {}: {step_deg}",
                joint + 1
            );
        }
        last = now;
        if desk.state() == "Idle" {
            return;
        }
    }
    panic!("it never ends");
}

#[test]
fn the_tool_comes_back_to_the_same_bits() {
    with_robot(|desk| {
        assert_eq!(side(desk), Elbow::Right);
        let before = desk.setpoint().pose;
        assert!(desk.ask("M101").contains("ok"));
        run_smoothly(desk, 90.0);
        assert_eq!(desk.setpoint().pose, before);
        assert_eq!(side(desk), Elbow::Left);
        // A move on that side, and back.
        desk.ask("G1 X220 F6000");
        desk.ask("M102");
        assert!(desk.ask("G1 X200").contains("ok"));
        run_smoothly(desk, 90.0);
        assert_eq!(desk.setpoint().pose, before);
        assert_eq!(side(desk), Elbow::Right);
    });
}

#[test]
fn it_is_as_fast_as_set() {
    with_robot(|desk| {
        desk.ask("$joint-speed=30");
        desk.ask("M101");
        let mut top: f32 = 0.0;
        let mut ticks = 0;
        while desk.state() != "Idle" || ticks < 100 {
            desk.tick();
            ticks += 1;
            top = desk.setpoint().joints.velocity[1].abs().max(top);
        }
        assert!(
            (top.to_degrees() - 30.0).abs() < 0.01,
            "{}",
            top.to_degrees()
        );
    });
}

#[test]
fn a_hold_on_the_way_goes_on() {
    with_robot(|desk| {
        let before = desk.setpoint().pose;
        desk.ask("M101");
        desk.run_ms(600);
        desk.send(b"!");
        assert!(desk.run_until("Hold:0"));
        let held = desk.setpoint().joints.position;
        desk.run_ms(1000);
        assert_eq!(desk.setpoint().joints.position, held);
        desk.send(b"~");
        run_smoothly(desk, 90.0);
        assert_eq!(desk.setpoint().pose, before);
        assert_eq!(side(desk), Elbow::Left);
    });
}

/// Stops the change after so many ms; the arm may be stretched then.
fn stop_after(desk: &mut SerialLoop<'_>, ms: u64) {
    desk.ask("$joint-speed=40");
    desk.ask("M101");
    desk.run_ms(ms);
    desk.send(b"\x18");
    assert!(desk.run_until("Alarm"));
    assert!(desk.ask("$X").contains("ok"));
}

#[test]
fn stopped_on_the_way_it_folds_to_either_side() {
    let mut refused = 0;
    for ms in (100..4000).step_by(130) {
        for word in ["M101", "M102"] {
            with_robot(|desk| {
                stop_after(desk, ms);
                let stood = desk.setpoint().joints.position;
                let is_refused = desk.ask("G91 G1 Z1 F600").contains("error:71");
                refused += u32::from(is_refused);
                if !is_refused {
                    run_smoothly(desk, 90.0);
                    // Where it can go on it does so from where it stood.
                    let now = desk.setpoint().joints.position;
                    let moved = (now.joint1 - stood.joint1).abs();
                    assert!(moved.to_num::<f64>() < 1e-6, "{moved}");
                }
                assert!(desk.ask(word).contains("ok"), "{ms} {word}");
                run_smoothly(desk, 90.0);
                let expected = if word == "M101" {
                    Elbow::Left
                } else {
                    Elbow::Right
                };
                assert_eq!(side(desk), expected);
                assert!(desk.ask("G91 G1 Z-1 F600").contains("ok"));
                run_smoothly(desk, 90.0);
            });
        }
    }
    assert!(refused > 0, "no stop came near the stretched pose");
}

#[test]
fn a_side_that_the_limits_exclude_is_refused() {
    with_robot(|desk| {
        assert!(desk.ask("$joint2-min=-20").contains("ok"));
        let heard = desk.ask("M101");
        assert!(heard.contains("error:72"), "{heard}");
        assert!(heard.contains("joint 2 would be at"), "{heard}");
        assert_eq!(side(desk), Elbow::Right);
    });
}

#[test]
fn a_reset_leaves_the_arm_as_it_is() {
    with_robot(|desk| {
        desk.ask("M101");
        run_smoothly(desk, 90.0);
        desk.ask("M100 P1 Q9");
        desk.run_ms(100);
        desk.send(b"\x18");
        let joints = desk.setpoint().joints.position;
        desk.run_ms(50);
        desk.ask("$tolerance=0.1");
        desk.run_ms(50);
        assert_eq!(desk.setpoint().joints.position, joints);
        assert!(desk.ask("G91 G1 X1 F600").contains("ok"));
        run_smoothly(desk, 90.0);
    });
}

#[test]
fn before_the_position_is_known_it_only_says_which_side() {
    with_controller(Records::new(), |desk| {
        desk.run_ms(2);
        assert!(desk.ask("M101").contains("ok"));
        desk.run_ms(100);
        assert!(desk.ask("G0 X200 Y50").contains("ok"));
        desk.run_ms(10);
        assert_eq!(side(desk), Elbow::Left);
    });
}

#[test]
fn checking_knows_the_side() {
    with_robot(|desk| {
        // Only the right elbow reaches this with joint 1 within its travel.
        desk.ask("$joint1-max=20 joint1-min=-90");
        assert!(desk.ask("$C").contains("ok"));
        assert!(desk.ask("G1 X200 Y60 F600").contains("ok"));
        let right = desk.ask("G1 X200 Y40 F600");
        assert!(right.contains("ok"), "{right}");
        assert!(desk.ask("M101").contains("error:72"));
    });
}
