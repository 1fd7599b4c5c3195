//! Lines through the planner: what is queued, checked and refused.

use planner_core::config::{Robot, RobotConfig};
use planner_core::gcode::Line;
use planner_core::motion::{DelayLines, Motion, MotionState, Order};
use planner_core::planner::{Accepted, LineError, PLACES_A_LINE, Planner};
use planner_core::queue::SegmentQueue;

fn robot() -> Robot {
    let mut config = RobotConfig::default();
    config.set("prefilter=none").unwrap();
    config.set("feed-limit=100").unwrap();
    config.set("rapid=50").unwrap();
    config.set("yaw-limit=90").unwrap();
    Robot::new(&config).unwrap()
}

/// Ticks of a program's motion.
fn ticks(program: &[&str]) -> u32 {
    let robot = robot();
    let mut queue = SegmentQueue::new();
    let (producer, consumer) = queue.split();
    let mut filters = DelayLines::new();
    let mut planned = robot.clone();
    let mut planner = Planner::new(&mut planned, producer);
    let mut motion = Motion::new(&robot, consumer, &mut filters);
    for line in program {
        let accepted = planner.line(line.as_bytes());
        let accepted = accepted.unwrap_or_else(|error| panic!("{line}: {error}"));
        if let Some(pose) = accepted.reference {
            motion.obey(Order::Place(pose));
        }
    }
    motion.obey(Order::Start);
    let mut ticks = 0;
    while motion.tick().state != MotionState::Idle {
        ticks += 1;
    }
    ticks
}

#[test]
fn inverse_time_is_the_time_of_the_motion_within_the_limits() {
    for (line, expected) in [
        ("G93 G1 X310 F30", 2000),
        ("G93 G1 X310 Z10 C45 F30", 2000),
        ("G93 G1 C45 F30", 2000),
        ("G93 G3 X290 Y10 I-10 F30", 2000),
        // 100 mm/s and 90 °/s are the limits.
        ("G93 G1 X310 F60000", 100),
        ("G93 G1 C45 F60000", 500),
        ("G93 G1 X310 C45 F60000", 500),
        ("G93 G0 X310", 200),
        ("G1 X310 F120", 5000),
        ("G30", 0),
    ] {
        let program = ["G0 X300 Y0", "G30.1", line];
        let found = ticks(&program);
        // the last tick of history
        assert!(
            (expected..=expected + 4).contains(&found),
            "{line}: {found}"
        );
    }
}

fn with_planner(test: impl FnOnce(&mut Planner)) {
    let mut queue = SegmentQueue::new();
    let (producer, _consumer) = queue.split();
    test(&mut Planner::new(&mut robot(), producer));
}

fn code(result: Result<Accepted, LineError>) -> u8 {
    result.map_or_else(|error| error.code(), |_| 0)
}

#[test]
fn a_line_is_taken_as_a_whole_or_not_at_all() {
    with_planner(|planner| {
        planner.line(b"G0 X300 Y0").unwrap();
        let free = planner.free_places();
        let modal = *planner.interpreter().modal();
        // The way to the intermediate point is clear, the way on is not: the machine's
        // origin is the shoulder.
        assert_eq!(code(planner.line(b"M3 G4 P1")), 0);
        let dwelt = planner.free_places();
        assert!(dwelt < free);
        assert_eq!(code(planner.line(b"G28 X250 Y0")), 72);
        assert_eq!(code(planner.line(b"G4 P1 G0 X1000")), 71);
        assert_eq!(planner.free_places(), dwelt);
        assert_eq!(planner.interpreter().modal().position(), modal.position());
    });
}

#[test]
fn there_is_room_for_all_that_a_line_can_ask_for() {
    with_planner(|planner| {
        planner.line(b"G0 X300 Y0").unwrap();
        planner.line(b"G30.1").unwrap();
        planner.line(b"G0 X310").unwrap();
        let lines = [b"M3 G30 Z5 M0".as_slice(), b"M5 G4 P1 G0 X310 M0"];
        for line in lines.into_iter().cycle() {
            if !planner.has_room() {
                break;
            }
            planner.line(line).unwrap();
        }
        let free = planner.free_places();
        assert!(free < PLACES_A_LINE);
        assert_eq!(code(planner.line(b"G0 X300")), 74);
        assert_eq!(planner.free_places(), free);
    });
}

#[test]
fn jogs_stay_within_the_robots_travel() {
    with_planner(|planner| {
        assert_eq!(code(planner.jog(b"X300 Y0 F100")), 62);
        planner.line(b"G0 X300 Y0").unwrap();
        for (text, expected) in [
            ("X310 F100", 0),
            ("X400 F100", 15),
            ("G91 Z500 F100", 15),
            ("X0 Y0 F100", 15),
            ("X9999 F100", 15),
            ("X310", 22),
            ("X310 F100 M3", 16),
            ("X305 F0.0001", 73),
        ] {
            assert_eq!(code(planner.jog(text.as_bytes())), expected, "{text}");
        }
        let x = planner.interpreter().modal().position().unwrap().x;
        assert_eq!(x, 310);
    });
}

#[test]
fn checking_queues_and_changes_nothing() {
    with_planner(|planner| {
        planner.line(b"G0 X300 Y0").unwrap();
        let (free, modal) = (planner.free_places(), *planner.interpreter().modal());
        let offsets = planner.interpreter().offsets().clone();
        let mut check = |text: &str, expected: u8, line: u32| {
            let parsed = Line::parse(text.as_bytes()).unwrap();
            match planner.check(&parsed) {
                Ok(()) => assert_eq!(0, expected, "{text}"),
                Err(error) => assert_eq!((error.code(), error.line), (expected, line), "{text}"),
            }
        };
        check("G1 X310", 22, 2);
        check("G1 X310 F100", 0, 3);
        check("G91 X10", 0, 4);
        check("X100", 71, 5);
        check("G10 L2 P1 X5", 0, 6);
        check("M30", 0, 7);
        check("X5", 72, 1);
        let x = planner.interpreter().modal().position().unwrap().x;
        assert_eq!(x, 320);
        assert_eq!(planner.free_places(), free);
        planner.reset_modes();
        assert_eq!(planner.interpreter().modal().position(), modal.position());
        assert_eq!(*planner.interpreter().offsets(), offsets);
        assert_eq!(code(planner.line(b"G1 X310")), 22);
    });
}

#[test]
fn what_a_line_has_done_is_told() {
    with_planner(|planner| {
        let mut told = |text: &str| planner.line(text.as_bytes()).unwrap();
        let reference = told("G0 X300 Y0").reference.unwrap();
        assert_eq!(reference.x, 300);
        assert_eq!(reference.y, 0);
        assert_eq!(told("G0"), Accepted::default());
        let queued = Accepted {
            queued: true,
            ..Accepted::default()
        };
        assert_eq!(told("G0 X310"), queued);
        assert_eq!(told("G4 P0.1"), queued);
        assert_eq!(told("M0"), queued);
        let stored = Accepted {
            offset_changed: true,
            offsets_stored: true,
            ..Accepted::default()
        };
        assert_eq!(told("G10 L2 P1 X1"), stored);
        let ended = Accepted {
            queued: true,
            ended: true,
            ..Accepted::default()
        };
        assert_eq!(told("G0 X300 M30"), ended);
    });
}
