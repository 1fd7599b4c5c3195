//! Stop at any instant: shaped, on the path, and all that was queued is forgotten.

use host_tests::software_loop::Controller;
use host_tests::vector::{norm, sub};
use planner_core::config::Robot;
use planner_core::motion::{DelayLines, MotionState, Order, Setpoint};
use planner_core::pose::Pose;
use planner_core::prefilter::{Kind, PrefilterConfig};
use planner_core::queue::{LOOKAHEAD, SegmentQueue};
use planner_core::units::LengthMm;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::support::{
    CORNER_PATH, KINDS, Orders, TICK_S, allowance_mm, is_at_rest, prefilter_line, report, robot,
    setpoints, velocities,
};

/// From wherever the corner path was left to a place off it.
const NEXT_PROGRAM: &str = "G1 X250 Y30 F9600\nX240\nM2";

fn next_end() -> Pose {
    Pose {
        x: LengthMm::from_num(240),
        y: LengthMm::from_num(30),
        ..Pose::default()
    }
}

/// Runs the corner path until it is stopped, then ticks on until the motion is idle.
fn stop_at(controller: &mut Controller<'_>, tick: usize) -> Vec<Setpoint> {
    let mut lines = CORNER_PATH.lines();
    let mut all = Vec::new();
    controller.feed(&mut lines).expect("the program is right");
    controller.obey(Order::Start);
    for _ in 0..tick {
        all.push(controller.tick());
    }
    controller.obey(Order::Stop);
    loop {
        let setpoint = controller.tick();
        all.push(setpoint);
        match setpoint.state {
            MotionState::Idle => return all,
            MotionState::Stopping => {}
            other => panic!("{other:?} while stopping"),
        }
        // None of these changes anything now.
        for order in [Order::Hold, Order::Resume, Order::Start, Order::Stop] {
            controller.obey(order);
        }
    }
}

#[test]
fn stopped_at_any_instant_it_is_on_the_path_and_can_go_on_elsewhere() {
    for (kind, seed) in KINDS.into_iter().zip(0..) {
        let robot = robot(|config| config.prefilter.kind = kind);
        let ticks = setpoints(&robot, CORNER_PATH, &Orders::new()).len();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..30 {
            stop_and_go_on(&robot, rng.random_range(0..ticks - 1));
        }
    }
}

fn stop_and_go_on(robot: &Robot, stopped_at: usize) {
    let kind = robot.config.prefilter.kind;
    let context = format!("{kind:?}, stopped at {stopped_at}");
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut planned = robot.clone();
    let mut controller = Controller::new(&mut planned, &mut queue, &mut filters);
    let stopped = stop_at(&mut controller, stopped_at);
    assert!(controller.is_empty(), "{context}");
    let last = stopped[stopped.len() - 1];
    assert!(is_at_rest(&last), "{context}");
    // The filters settle, and the queue is emptied.
    let bound = usize::from(robot.kernel.length_ticks()) + LOOKAHEAD / 8 + 4;
    assert!(stopped.len() <= stopped_at + bound, "{context}");

    let allowance_mm = allowance_mm(kind, 160.0);
    let report = report(robot, CORNER_PATH, &stopped);
    assert!(
        report.max_path_deviation_mm <= 0.5 + allowance_mm,
        "{context}"
    );

    controller.planner().stopped_at(last.pose);
    let mut next = Vec::new();
    controller
        .run(NEXT_PROGRAM, |setpoint| next.push(*setpoint))
        .expect("the way is free");
    assert_eq!(next[0].pose, last.pose, "{context}");
    let end = next[next.len() - 1];
    assert_eq!(end.pose, next_end(), "{context}");
    assert!(is_at_rest(&end), "{context}");

    // Nothing jumps between the two.
    let bound_mm_s2 = match robot.prefilter().longest_box_s() {
        Some(box_s) => 2.0 * 160.0 / box_s + 160.0 * 160.0 / 45.0,
        None => 2.0 * 160.0 / TICK_S,
    };
    let all = [stopped, next].concat();
    for pair in velocities(&all).windows(2) {
        let found = norm(sub(pair[1], pair[0])) / TICK_S;
        // a resolution of 2 nm, twice differenced
        assert!(
            found <= bound_mm_s2 + 8.0,
            "{context}: {found} of {bound_mm_s2}"
        );
    }
}

#[test]
fn what_waits_is_forgotten_in_idle_and_in_a_hold() {
    let robot = robot(|_| {});
    for held in [false, true] {
        let mut queue = SegmentQueue::new();
        let mut filters = Box::new(DelayLines::new());
        let mut planned = robot.clone();
        let mut controller = Controller::new(&mut planned, &mut queue, &mut filters);
        controller
            .feed(&mut CORNER_PATH.lines())
            .expect("it is right");
        if held {
            controller.obey(Order::Hold);
            assert_eq!(controller.tick().state, MotionState::Held);
            controller.obey(Order::Start);
            assert_eq!(controller.tick().state, MotionState::Held);
        }
        assert!(!controller.is_empty());
        controller.obey(Order::Stop);
        let before = controller.tick();
        let mut ticks = 1;
        while controller.tick().state != MotionState::Idle {
            ticks += 1;
        }
        assert!(ticks <= LOOKAHEAD / 8 + 2);
        assert!(controller.is_empty());
        assert_eq!(controller.tick().pose, before.pose);
    }
}

/// The planner has planned with the new prefilter already.
#[test]
fn a_forgotten_change_of_the_prefilter_is_made_all_the_same() {
    let other = PrefilterConfig {
        kind: Kind::Zv,
        frequency_hz: 9.0,
        damping: 0.1,
        ..PrefilterConfig::default()
    };
    let mut robot_before = robot(|_| {});
    let mut robot_after = robot(|config| config.prefilter = other);
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut controller = Controller::new(&mut robot_before, &mut queue, &mut filters);
    controller
        .feed(&mut "G0 X200 Y0\nG1 X250 F6000".lines())
        .expect("it is right");
    controller
        .feed(&mut prefilter_line(&other).lines())
        .expect("it is right");
    controller.obey(Order::Start);
    for _ in 0..100 {
        let _ = controller.tick();
    }
    controller.obey(Order::Stop);
    let last = loop {
        let setpoint = controller.tick();
        if setpoint.state == MotionState::Idle {
            break setpoint;
        }
    };
    controller.planner().stopped_at(last.pose);
    let mut found = Vec::new();
    controller
        .run(NEXT_PROGRAM, |setpoint| found.push(*setpoint))
        .expect("it runs");

    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut fresh = Controller::new(&mut robot_after, &mut queue, &mut filters);
    fresh.obey(Order::Place(last.pose));
    fresh.planner().stopped_at(last.pose);
    let mut expected = Vec::new();
    fresh
        .run(NEXT_PROGRAM, |setpoint| expected.push(*setpoint))
        .expect("it runs");
    expected[0].placed = false;
    assert_eq!(found, expected);
}
