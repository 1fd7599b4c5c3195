//! What happens in step with the motion: outputs, pauses, changes of the prefilter.

use host_tests::software_loop::Controller;
use planner_core::config::Robot;
use planner_core::motion::{DelayLines, MotionState, Order, Setpoint};
use planner_core::prefilter::{Kind, PrefilterConfig};
use planner_core::queue::{KERNELS, SegmentQueue};

use crate::support::{CORNER_PATH, KINDS, is_at_rest, prefilter_line, robot};

/// Plans with `plan`, then runs what is queued to its end; a pause is not resumed.
fn run(robot: &Robot, plan: impl FnOnce(&mut Controller<'_>)) -> Vec<Setpoint> {
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut planned = robot.clone();
    let mut controller = Controller::new(&mut planned, &mut queue, &mut filters);
    plan(&mut controller);
    controller.obey(Order::Start);
    let mut all = Vec::new();
    loop {
        let setpoint = controller.tick();
        all.push(setpoint);
        if setpoint.state == MotionState::Idle {
            return all;
        }
        assert!(all.len() < 20_000, "it does not come to an end");
    }
}

fn feed(controller: &mut Controller<'_>, lines: &str) {
    controller
        .feed(&mut lines.lines())
        .expect("the lines are right");
}

#[test]
fn outputs_switch_when_the_motion_has_settled_at_their_point() {
    for kind in KINDS {
        let robot = robot(|config| config.prefilter.kind = kind);
        let all = run(&robot, |controller| {
            feed(controller, "G0 X200 Y0\nG1 X210 F6000");
            feed(controller, "M3");
            feed(controller, "G3 X210 Y20 J10");
            feed(controller, "M8");
            feed(controller, "M5");
            feed(controller, "G1 X200");
        });
        let changes: Vec<usize> = (1..all.len())
            .filter(|&tick| all[tick].outputs != all[tick - 1].outputs)
            .collect();
        let [first, second, third] = changes[..] else {
            panic!("{kind:?}: {changes:?}");
        };
        assert_eq!(third, second + 1, "{kind:?}");
        for (tick, outputs, [x, y]) in [(first, 1, [210, 0]), (second, 3, [210, 20])] {
            let setpoint = all[tick];
            assert_eq!(setpoint.outputs, outputs, "{kind:?}");
            assert_eq!(
                (setpoint.pose.x, setpoint.pose.y),
                (x.into_fixed(), y.into_fixed())
            );
            assert!(is_at_rest(&setpoint), "{kind:?}");
            // Not later than it has to be: rates are rounded, the last moves are nanometres.
            assert!(!is_at_rest(&all[tick - 4]), "{kind:?}");
            assert!(!is_at_rest(&all[tick + 4]), "{kind:?}");
        }
        let last = all[all.len() - 1];
        assert_eq!(
            (last.outputs, last.pose.x),
            (2, 200_i32.into_fixed()),
            "{kind:?}"
        );
    }
}

/// Lengths of the tests' programs are whole millimetres.
trait IntoFixed {
    fn into_fixed(self) -> planner_core::units::LengthMm;
}

impl IntoFixed for i32 {
    fn into_fixed(self) -> planner_core::units::LengthMm {
        planner_core::units::LengthMm::from_num(self)
    }
}

#[test]
fn outputs_switch_without_any_motion() {
    let all = run(&robot(|_| {}), |controller| {
        feed(controller, "G0 X200 Y0");
        feed(controller, "M3");
    });
    assert_eq!(all.iter().map(|s| s.outputs).collect::<Vec<_>>(), [1]);
}

#[test]
fn a_pause_waits_for_resume_and_outputs_behind_it_wait_too() {
    let robot = robot(|_| {});
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut planned = robot.clone();
    let mut controller = Controller::new(&mut planned, &mut queue, &mut filters);
    feed(&mut controller, "G0 X200 Y0\nG1 X210 F6000\nM0");
    feed(&mut controller, "M3");
    feed(&mut controller, "G1 X220");
    controller.obey(Order::Start);
    let paused = loop {
        let setpoint = controller.tick();
        if setpoint.state == MotionState::Paused {
            break setpoint;
        }
        assert_eq!(setpoint.state, MotionState::Running);
    };
    assert!(is_at_rest(&paused));
    assert_eq!(paused.pose.x, 210_i32.into_fixed());
    for order in [Order::Hold, Order::Start] {
        controller.obey(order);
        assert_eq!(controller.tick(), paused);
    }
    controller.obey(Order::Resume);
    let mut last = controller.tick();
    assert_eq!((last.state, last.outputs), (MotionState::Running, 1));
    while last.state == MotionState::Running {
        last = controller.tick();
    }
    assert_eq!(
        (last.state, last.pose.x),
        (MotionState::Idle, 220_i32.into_fixed())
    );
}

#[test]
fn a_hold_on_the_way_to_an_action_holds_it_back() {
    let robot = robot(|_| {});
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut planned = robot.clone();
    let mut controller = Controller::new(&mut planned, &mut queue, &mut filters);
    feed(&mut controller, "G0 X200 Y0\nG1 X210 F6000");
    feed(&mut controller, "M3");
    controller.obey(Order::Start);
    // The raw path has arrived, the filter has not settled.
    for _ in 0..200 {
        let _ = controller.tick();
    }
    controller.obey(Order::Hold);
    for _ in 0..1000 {
        assert_eq!(controller.tick().outputs, 0);
    }
    assert_eq!(controller.tick().state, MotionState::Held);
    controller.obey(Order::Resume);
    assert_eq!(controller.tick().outputs, 1);
}

/// Before and after the change the setpoints are those of robots that have the one prefilter
/// and the other.
#[test]
fn the_prefilter_changes_where_the_program_says() {
    let other = PrefilterConfig {
        kind: Kind::FirZv,
        frequency_hz: 11.0,
        damping: 0.05,
        ..PrefilterConfig::default()
    };
    let (first, second) = (robot(|_| {}), robot(|config| config.prefilter = other));
    let onward = "G1 X200 Y30 F9600\nG2 X180 Y10 I-20 J0\nM2";
    let changed = run(&first, |controller| {
        feed(controller, CORNER_PATH);
        feed(controller, &prefilter_line(&other));
        feed(controller, onward);
    });
    let before = run(&first, |controller| feed(controller, CORNER_PATH));
    let after = run(&second, |controller| {
        let end = before[before.len() - 1].pose;
        controller.obey(Order::Place(end));
        controller.planner().stopped_at(end);
        // the feedrate of the program before
        feed(controller, "G21 G90 G1 F9600");
        feed(controller, onward);
    });
    let (found_before, found_after) = changed.split_at(before.len());
    let poses = |all: &[Setpoint]| all.iter().map(|s| (s.pose, s.joints)).collect::<Vec<_>>();
    assert_eq!(poses(found_before), poses(&before));
    assert_eq!(poses(found_after), poses(&after));
}

#[test]
fn a_prefilter_that_is_refused_or_finds_no_room_changes_nothing() {
    let robot = robot(|_| {});
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut planned = robot.clone();
    let mut controller = Controller::new(&mut planned, &mut queue, &mut filters);
    let code = |controller: &mut Controller<'_>, line: &str| {
        let planned = controller.planner().line(line.as_bytes());
        planned.map_or_else(|error| error.code(), |_| 0)
    };
    assert_eq!(code(&mut controller, "M100 Q0"), 76);
    for change in 0..KERNELS {
        assert!(controller.planner().has_room());
        assert_eq!(code(&mut controller, &format!("M100 Q{}", 5 + change)), 0);
    }
    assert!(!controller.planner().has_room());
    assert_eq!(code(&mut controller, "M100 Q20"), 74);
    controller.obey(Order::Start);
    while controller.tick().state != MotionState::Idle {}
    assert!(controller.planner().has_room());
}
