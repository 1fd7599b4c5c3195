//! Work coordinates: where a line's coordinates lie in the machine's.

mod support;

use planner_core::gcode::{Feed, Interpreter, Line, Offsets};
use planner_core::pose::Pose;
use proptest::prelude::*;
use support::{DEFAULTS, after, pose, run, run_move};

const ORIGIN: Pose = Pose::from_bits([0; 4]);

/// The pose after some lines at (10, 20, 30, 40), a rapid being the last of them.
fn target(lines: &[&str]) -> Pose {
    let mut interpreter = after(&["G0 X10 Y20 Z30 C40"]);
    for line in lines {
        run(&mut interpreter, line).unwrap_or_else(|error| panic!("{line}: {error}"));
    }
    interpreter.modal().position().unwrap()
}

#[test]
fn machine_is_work_plus_offsets() {
    for (lines, expected) in [
        // Coordinate systems.
        (
            &["G10 L2 P1 X1 Y2 Z3 C4", "G0 X0 Y0 Z0 C0"][..],
            pose(1.0, 2.0, 3.0, 4.0),
        ),
        (&["G10 L2 P2 X1", "G0 X0"], pose(0.0, 20.0, 30.0, 40.0)),
        (&["G10 L2 P2 X1", "G55 G0 X0"], pose(1.0, 20.0, 30.0, 40.0)),
        (
            &["G10 L2 P6 X1", "G59", "X5 Y6"],
            pose(6.0, 6.0, 30.0, 40.0),
        ),
        (&["G59 G10 L2 P0 X1", "G0 X0"], pose(1.0, 20.0, 30.0, 40.0)),
        (&["G59 G10 L2 X1", "G54 G0 X0"], pose(0.0, 20.0, 30.0, 40.0)),
        (
            &["G20 G10 L2 P1.9 X1 C2", "G21 G0 X0 C0"],
            pose(25.4, 20.0, 30.0, 2.0),
        ),
        // G91 makes no difference to G10, and work zero none to G91.
        (&["G91 G10 L2 P1 X1", "G0 X5"], pose(15.0, 20.0, 30.0, 40.0)),
        (
            &["G91 G10 L2 P1 X1", "G90 G0 X0"],
            pose(1.0, 20.0, 30.0, 40.0),
        ),
        // L20: where the robot is has these coordinates.
        (
            &["G10 L20 P1 X100 Z0", "G0 X101 Z1"],
            pose(11.0, 20.0, 31.0, 40.0),
        ),
        (
            &["G10 L20 P3 X100", "G0 X0", "G56 X90"],
            pose(0.0, 20.0, 30.0, 40.0),
        ),
        (
            &["G92 X0", "G10 L20 P1 X5", "G0 X5"],
            pose(10.0, 20.0, 30.0, 40.0),
        ),
        (
            &["G43.1 Z7", "G10 L20 P1 Z0", "G0 Z1"],
            pose(10.0, 20.0, 31.0, 40.0),
        ),
        // G92, on top of all.
        (&["G92 X0 C0", "G0 X1 C2"], pose(11.0, 20.0, 30.0, 42.0)),
        (
            &["G10 L2 P1 X3", "G92 X0", "G55 G0 X0"],
            pose(7.0, 20.0, 30.0, 40.0),
        ),
        (
            &["G92 X0", "G92 Y0", "G0 X1 Y1"],
            pose(11.0, 21.0, 30.0, 40.0),
        ),
        (&["G92 X0", "G92.1", "G0 X1"], pose(1.0, 20.0, 30.0, 40.0)),
        (
            &["G43.1 Z7", "G92 Z0", "G0 Z1"],
            pose(10.0, 20.0, 31.0, 40.0),
        ),
        (
            &["G10 L2 P2 X3", "G55 G92 X0", "G0 X0"],
            pose(10.0, 20.0, 30.0, 40.0),
        ),
        // As in Grbl, G92.1 and a motion in one line: the motion is the earlier one.
        (&["G92 X0", "G92.1 G0 X1"], pose(11.0, 20.0, 30.0, 40.0)),
        // Tool length.
        (&["G43.1 Z7", "G0 Z0"], pose(10.0, 20.0, 7.0, 40.0)),
        (&["G20 G43.1 Z1", "G21 G0 Z0"], pose(10.0, 20.0, 25.4, 40.0)),
        (&["G43.1 Z7", "G49", "G0 Z0"], pose(10.0, 20.0, 0.0, 40.0)),
        (&["G43.1 Z7", "G91 G0 Z1"], pose(10.0, 20.0, 31.0, 40.0)),
        // Machine coordinates, for their line only.
        (
            &["G10 L2 P1 X1", "G53 G0 X0", "X5"],
            pose(6.0, 20.0, 30.0, 40.0),
        ),
        (&["G10 L2 P1 X1", "G53 G0 X0"], pose(0.0, 20.0, 30.0, 40.0)),
        (
            &["G10 L2 P1 X1", "G91 G53 G0 X2"],
            pose(2.0, 20.0, 30.0, 40.0),
        ),
        (
            &["G10 L2 P1 X1", "G53 G1 X2 F1", "X2"],
            pose(3.0, 20.0, 30.0, 40.0),
        ),
        // A motion in the line of G28.1 and G30.1 comes after it.
        (&["G28.1 G0 X1", "G28"], pose(10.0, 20.0, 30.0, 40.0)),
        (
            &["G0 X1", "G30.1", "G0 X2 Y3 Z4", "G30"],
            pose(1.0, 20.0, 30.0, 40.0),
        ),
        // Arcs go between work coordinates, too.
        (
            &["G10 L2 P1 X5 Y20", "G3 X0 Y5 I-5 J0 F100"],
            pose(5.0, 25.0, 30.0, 40.0),
        ),
    ] {
        assert_eq!(target(lines), expected, "{lines:?}");
    }
}

#[test]
fn going_to_a_stored_position() {
    let mut interpreter = after(&["G0 X10 Y20 Z30 C40", "G10 L2 P1 X1", "G30.1", "G1 X50 F60"]);
    let start = interpreter.modal().position().unwrap();
    assert_eq!(start, pose(51.0, 20.0, 30.0, 40.0));
    let stored = pose(10.0, 20.0, 30.0, 40.0);
    for (text, via, end) in [
        ("G30", None, Some(stored)),
        // With axis words these axes only, by way of a work coordinate.
        ("G30 X0", Some(pose(1.0, 20.0, 30.0, 40.0)), Some(stored)),
        ("G30 Z35", Some(pose(51.0, 20.0, 35.0, 40.0)), Some(start)),
        (
            "G91 G30 Z5",
            Some(pose(51.0, 20.0, 35.0, 40.0)),
            Some(start),
        ),
        ("G91 G30 Z0", None, None),
        ("G28", None, Some(ORIGIN)),
        ("G28 Z30", None, Some(pose(51.0, 20.0, 0.0, 40.0))),
        ("G30 X50", None, Some(stored)),
    ] {
        let mut interpreter = interpreter.clone();
        let command = run(&mut interpreter, text).unwrap();
        let reached =
            |order: Option<planner_core::gcode::Move>| order.map(|order| order.path.target);
        assert_eq!(reached(command.via), via, "{text}");
        assert_eq!(reached(command.motion), end, "{text}");
        let mut position = start;
        for order in command.moves() {
            assert_eq!(order.path.start, position, "{text}");
            assert_eq!(order.feed, Feed::Rapid, "{text}");
            position = order.path.target;
        }
        assert_eq!(interpreter.modal().position(), Some(position), "{text}");
    }
    // The motion mode stays what it was.
    run(&mut interpreter, "G28").unwrap();
    assert_eq!(run_move(&mut interpreter, "X60").feed, Feed::MmPerS(1.0));
}

#[test]
fn offsets_show_as_poses_and_say_what_they_change() {
    let mut interpreter = after(&["G0 X10 Y20 Z30 C40"]);
    for (text, moves_work_zero, stores) in [
        ("G10 L2 P1 X1 C5", true, true),
        ("G10 L2 P2 Y2", false, true),
        ("G55", true, false),
        ("G55", false, false),
        ("G43.1 Z3", true, false),
        ("G92 Y0", true, false),
        ("G28.1", false, true),
        ("G0 X1", false, false),
        ("G30.1", false, true),
        ("M30", true, false),
    ] {
        let line = Line::parse(text.as_bytes()).unwrap();
        let interpreted = interpreter.interpret(&line).unwrap();
        assert_eq!(interpreted.moves_work_zero(), moves_work_zero, "{text}");
        assert_eq!(interpreted.stores_offsets(), stores, "{text}");
        interpreter.commit(&interpreted);
    }
    let offsets = interpreter.offsets();
    assert_eq!(offsets.work(0), pose(1.0, 0.0, 0.0, 5.0));
    assert_eq!(offsets.work(1), pose(0.0, 2.0, 0.0, 0.0));
    assert_eq!(offsets.work(5), ORIGIN);
    assert_eq!(offsets.work(6), ORIGIN);
    assert_eq!(offsets.g28(), pose(10.0, 20.0, 30.0, 40.0));
    assert_eq!(offsets.g30(), pose(1.0, 20.0, 30.0, 40.0));
    assert_eq!(offsets.g92(), pose(0.0, 18.0, 0.0, 0.0));
    assert_eq!(offsets.tool_length(), 3);
    assert_eq!(interpreter.work_offset(), pose(1.0, 18.0, 3.0, 5.0));
}

#[test]
fn only_what_a_program_can_name_is_stored() {
    let mut interpreter = after(&[]);
    interpreter.set_position(Some(pose(0.0, 0.0, 0.0, 1500.0)));
    for text in ["G28.1", "G30.1", "G92 C0", "G10 L20 P1 C0"] {
        assert_eq!(
            run(&mut interpreter, text).unwrap_err().code(),
            61,
            "{text}"
        );
    }
    run(&mut interpreter, "G10 L20 P1 X5 C60").unwrap();
    let bytes = interpreter.offsets().to_bytes();
    assert!(Offsets::from_bytes(&bytes).is_some());
}

#[test]
fn stored_offsets_outlast_power_off() {
    let interpreter = after(&[
        "G0 X10.000000001 Y-20",
        "G10 L2 P1 X0.1 Y-4095 C-1440",
        "G10 L2 P6 Z4095",
        "G28.1",
        "G43.1 Z1",
        "G92 X0",
    ]);
    let bytes = interpreter.offsets().to_bytes();
    let restored = Offsets::from_bytes(&bytes).unwrap();
    assert_eq!(restored.to_bytes(), bytes);
    assert_eq!(restored.work(0), interpreter.offsets().work(0));
    assert_eq!(restored.g92(), ORIGIN);
    assert_eq!(restored.tool_length(), 0);
    let mut other = Interpreter::new(DEFAULTS);
    other.set_offsets(restored);
    other.set_position(Some(ORIGIN));
    assert_eq!(
        run_move(&mut other, "G0 X0.2").path.target.x,
        pose(0.3, 0.0, 0.0, 0.0).x
    );
    // Bytes that no offsets yield.
    assert_eq!(Offsets::from_bytes(&bytes[1..]), None);
    let mut wild = bytes;
    wild[7] = 0x7F;
    assert_eq!(Offsets::from_bytes(&wild), None);
    assert_eq!(
        Offsets::from_bytes(&[0; Offsets::BYTES]),
        Some(Offsets::NONE)
    );
}

proptest! {
    /// Offsets are exact: a program that measures everything from another work zero ends
    /// where its twin ends, bit for bit.
    #[test]
    fn work_zero_makes_no_difference(
        zero in prop::array::uniform3(-400_000_i32..400_000),
        g92 in prop::array::uniform3(-400_000_i32..400_000),
        points in prop::collection::vec(prop::array::uniform3(-400_000_i32..400_000), 1..20),
    ) {
        let word = |micrometres: i32| f64::from(micrometres) / 1000.0;
        let mut machine = after(&["G0 X0 Y0"]);
        let mut work = after(&["G0 X0 Y0"]);
        let [x, y, z] = zero.map(word);
        run(&mut work, &format!("G10 L2 P2 X{x} Y{y} Z{z}")).unwrap();
        let [x, y, z] = g92.map(word);
        run(&mut work, &format!("G55 G92 X{x} Y{y} Z{z}")).unwrap();
        for point in points {
            let [x, y, z] = point.map(word);
            run(&mut machine, &format!("G0 X{x} Y{y} Z{z}")).unwrap();
            // G92 has made the machine's zero the work coordinate `g92`.
            let [x, y, z] = core::array::from_fn(|axis| word(point[axis] + g92[axis]));
            run(&mut work, &format!("G0 X{x} Y{y} Z{z}")).unwrap();
            prop_assert_eq!(machine.modal().position(), work.modal().position());
        }
    }

    /// L20 and G92 give the position the coordinates asked for.
    #[test]
    fn where_the_robot_is_gets_its_coordinates(
        at in -1_000_000_i32..1_000_000,
        wanted in -1_000_000_i32..1_000_000,
        command in prop::sample::select(vec!["G10 L20 P0", "G92"]),
    ) {
        let [at, wanted] = [at, wanted].map(|value| f64::from(value) / 1000.0);
        let mut interpreter = after(&["G0 X0 Y0 Z0", "G10 L2 P1 Z3", "G43.1 Z-5"]);
        run(&mut interpreter, &format!("G53 G0 Z{at}")).unwrap();
        let position = interpreter.modal().position();
        run(&mut interpreter, &format!("{command} Z{wanted}")).unwrap();
        let command = run(&mut interpreter, &format!("G0 Z{wanted}")).unwrap();
        prop_assert!(command.motion.is_none());
        prop_assert_eq!(interpreter.modal().position(), position);
    }
}
