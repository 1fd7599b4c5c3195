//! The delta robot as a whole: published poses, the controller, its setpoints.

use std::f64::consts::PI;

use host_tests::robot_file::RobotSettings;
use host_tests::serial_loop::{Records, SerialLoop, with_controller};
use host_tests::software_loop;
use host_tests::switched_arm::{LimitSwitch, SwitchedArm};
use planner_core::config::Robot;
use planner_core::kinematics::{Arm, ArmKind, Delta, DeltaConfig};
use planner_core::motion::Setpoint;
use planner_core::pose::{JointPosition, Pose};
use planner_core::units::{LengthMm, TICK_S};

const RAD: f64 = (1 << 26) as f64;

fn pose([x, y, z]: [f64; 3]) -> Pose {
    let [x, y, z] = [x, y, z].map(LengthMm::from_num);
    Pose {
        x,
        y,
        z,
        ..Pose::default()
    }
}

/// Degrees.
fn degrees(joints: JointPosition) -> [f64; 4] {
    let units = ArmKind::Delta.joint_units();
    joints.values(units).map(f64::to_degrees)
}

#[test]
fn published_poses_within_a_ten_thousandth_of_a_degree() {
    let delta = Delta::new(&DeltaConfig::default()).unwrap();
    let mut reader = csv::Reader::from_path(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/published/delta_inverse_kinematics.csv"
    ))
    .unwrap();
    let (mut worst, mut miss, mut count) = (0.0_f64, 0.0_f64, 0);
    for row in reader.deserialize() {
        let (x, y, z, q1, q2, q3): (f64, f64, f64, f64, f64, f64) = row.unwrap();
        let at = pose([x, y, z]);
        let joints = delta.inverse(&at);
        for (found, published) in degrees(joints).into_iter().zip([q1, q2, q3]) {
            worst = worst.max((found - published).abs());
        }
        let back = delta.forward(&joints);
        for (found, given) in [(back.x, at.x), (back.y, at.y), (back.z, at.z)] {
            miss = miss.max((found - given).to_num::<f64>().abs());
        }
        count += 1;
    }
    println!(
        "{count} poses: joints within {worst:.1e}°, and back within {:.1} nm",
        miss * 1e6
    );
    assert_eq!(count, 100);
    // the upper arm's 348.088 mm as a setting in f32 is most of it
    assert!(worst < 1e-5, "{worst}");
    assert!(miss < 4e-5, "{miss}");
}

fn robot() -> Robot {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/robots/delta-800.toml");
    let settings = RobotSettings::load(Some(file.as_ref())).unwrap();
    Robot::new(&settings.robot).unwrap()
}

/// The setpoints of the pick and place.
fn pick_and_place() -> Vec<Setpoint> {
    let mut setpoints = Vec::new();
    let program = include_str!("../programs/delta-pick-and-place.gcode");
    software_loop::run(&robot(), program, |setpoint| setpoints.push(*setpoint)).unwrap();
    setpoints
}

#[test]
fn setpoints_say_whose_they_are_and_fit_together() {
    let all = pick_and_place();
    let joints = |setpoint: &Setpoint| degrees(setpoint.joints.position).map(f64::to_radians);
    for window in all.windows(3) {
        assert_eq!(window[1].arm, ArmKind::Delta);
        let [before, now, after] = [0, 1, 2].map(|i| joints(&window[i]));
        for joint in 0..4 {
            let velocity = (after[joint] - before[joint]) / (2.0 * TICK_S);
            let bend = after[joint] - 2.0 * now[joint] + before[joint];
            let acceleration = bend / (TICK_S * TICK_S);
            let (found, state) = (joint, &window[1].joints);
            let off = (f64::from(state.velocity[found]) - velocity).abs();
            assert!(off < 2e-4, "velocity {joint}: {off}");
            let off = (f64::from(state.acceleration[found]) - acceleration).abs();
            assert!(off < 0.2, "acceleration {joint}: {off}");
        }
    }
    let (first, last) = (all[0], all[all.len() - 1]);
    assert_eq!(first.pose, last.pose);
    assert_eq!(last.pose.z, -767);
    assert_eq!(last.joints.velocity, [0.0; 4]);
}

/// A controller that is told to be a delta.
fn with_delta(body: impl FnOnce(&mut SerialLoop<'_>)) {
    with_controller(Records::new(), |desk| {
        desk.run_ms(2);
        assert!(desk.ask("$robot=delta").contains("ok"));
        assert_eq!(desk.robot().arm.kind(), ArmKind::Delta);
        body(desk);
    });
}

#[test]
fn one_firmware_is_either_robot() {
    with_delta(|desk| {
        let heard = desk.ask("G0 X0 Y0 Z-767");
        assert!(heard.contains("ok"), "{heard}");
        assert!(desk.ask("$report-joints=1").contains("ok"));
        desk.ask_status(b'?');
        let heard = desk.heard();
        // radians, all four
        assert!(heard.contains("|J:0.3719,0.3719,0.3719,0.0000|"), "{heard}");
        assert!(desk.ask("G1 X100 F6000").contains("ok"));
        assert!(desk.run_until("Idle"));
        assert_eq!(desk.setpoint().pose, pose([100.0, 0.0, -767.0]));
        // And back: the SCARA is at a place of its own.
        assert!(desk.ask("$robot=scara").contains("ok"));
        assert!(matches!(desk.robot().arm, Arm::Scara(_)));
        desk.run_ms(2);
        assert_eq!(desk.setpoint().arm, ArmKind::Scara);
    });
}

#[test]
fn a_robot_without_an_elbow_says_so() {
    with_delta(|desk| {
        for line in ["M101", "M102", "G0 X0 Y0 Z-767", "M101"] {
            let heard = desk.ask(line);
            let is_refused = heard.contains("error:79") && heard.contains("no elbow");
            assert_eq!(is_refused, line.starts_with('M'), "{line}: {heard}");
        }
        assert!(desk.ask("$C").contains("ok"));
        assert!(desk.ask("M102").contains("error:79"));
    });
}

#[test]
fn what_the_arms_cannot_do_is_refused_before_motion() {
    with_delta(|desk| {
        let heard = desk.ask("G0 X0 Y0 Z-1200");
        assert!(
            heard.contains("error:70") && heard.contains("which reaches from"),
            "{heard}"
        );
        assert!(desk.ask("G0 X0 Y0 Z-767").contains("ok"));
        for (line, code, said) in [
            ("G1 Z-1200 F6000", 71, "from the plane of its upper arm"),
            ("G1 X0 Y900 F6000", 72, "joint 1 would be at"),
            ("G1 C800 F6000", 72, "joint 4 would be at"),
        ] {
            let heard = desk.ask(line);
            assert!(heard.contains(&format!("error:{code}")), "{line}: {heard}");
            assert!(heard.contains(said), "{line}: {heard}");
        }
        desk.run_ms(100);
        assert_eq!(desk.setpoint().pose, pose([0.0, 0.0, -767.0]));
    });
}

#[test]
fn settings_that_make_no_delta_are_refused() {
    with_delta(|desk| {
        for line in [
            "$delta-forearm=1900",
            "$delta-arm-max=-60",
            "$delta-base=20",
        ] {
            let heard = desk.ask(line);
            assert!(heard.contains("error:78"), "{line}: {heard}");
            assert!(heard.contains("delta"), "{line}: {heard}");
        }
    });
}

/// An arm whose switches are at the upper ends of its arms' travel, which is where they are up,
/// and at the lower end of the yaw's.
fn switched(position: [f64; 4]) -> SwitchedArm {
    let bits = |degrees: [f64; 4]| degrees.map(|angle| (angle * PI / 180.0 * RAD) as i32);
    let at = bits([-40.0, -40.0, -40.0, -360.0]);
    let switches = std::array::from_fn(|joint| LimitSwitch {
        position: at[joint],
        is_upper: false,
        stuck: None,
    });
    SwitchedArm::new(JointPosition::from_bits(bits(position)), switches)
}

#[test]
fn a_delta_homes_by_its_limit_inputs() {
    for position in [[20.0, 30.0, 10.0, 15.0], [-41.0, 5.0, 60.0, -100.0]] {
        with_delta(|desk| {
            desk.arm = Some(switched(position));
            let settings =
                "$home-joints=15 home-lower-end=15 home1=-40 home2=-40 home3=-40 home4=-360";
            assert!(desk.ask(settings).contains("ok"));
            desk.send(b"$H\n");
            let mut heard = String::new();
            for _ in 0..600_000 {
                desk.tick();
                heard += &desk.heard();
                if heard.contains("ok") || heard.contains("error") {
                    break;
                }
            }
            let at = degrees(desk.arm.as_ref().unwrap().joints());
            let told = degrees(desk.setpoint().joints.position);
            assert!(heard.contains("ok"), "{heard}: {at:?}, taken for {told:?}");
            desk.run_ms(5);
            let told = degrees(desk.setpoint().joints.position);
            let true_joints = degrees(desk.arm.as_ref().unwrap().joints());
            for joint in 0..4 {
                // two ticks at the speed of locating
                assert!((told[joint] - true_joints[joint]).abs() < 0.004);
                let expected = [-35.0, -35.0, -35.0, -355.0][joint];
                assert!((told[joint] - expected).abs() < 0.01, "{told:?}");
            }
            // The tool hangs in the middle, and can be moved from there.
            let at = desk.setpoint().pose;
            assert!(at.x.to_num::<f64>().abs() < 0.1 && at.y.to_num::<f64>().abs() < 0.1);
            assert!(desk.ask("G91 G1 Z-150 F6000").contains("ok"));
            assert!(desk.run_until("Idle"));
            let moved: f64 = (desk.setpoint().pose.z - at.z).to_num();
            assert!((moved + 150.0).abs() < 1e-5, "{moved}");
        });
    }
}
