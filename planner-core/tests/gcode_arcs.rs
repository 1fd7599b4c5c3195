//! Arcs of G2 and G3 against an `f64` oracle, and the whole front end against noise.

use std::f64::consts::{PI, TAU};

use planner_core::gcode::{
    Command, Defaults, Error, Interpreter, Line, LineBuffer, MAX_ACTIONS_A_LINE, Move, Offsets,
    Received,
};
use planner_core::path::{Arc, Shape};
use planner_core::pose::Pose;
use proptest::prelude::*;

/// Half a step of a coordinate, 2^-20 mm, in X and in Y.
const ROUNDING_MM: f64 = 1.4e-6;

fn run(interpreter: &mut Interpreter, text: &str) -> Result<Command, Error> {
    let line = Line::parse(text.as_bytes())?;
    let interpreted = interpreter.interpret(&line)?;
    interpreter.commit(&interpreted);
    Ok(interpreted.command)
}

fn arc_move(lines: &[&str]) -> (Move, Arc) {
    let mut interpreter = Interpreter::new(Defaults::default());
    let mut command = Ok(Command::default());
    for line in lines {
        command = run(&mut interpreter, line);
    }
    if let Ok(command) = &command
        && let Some(motion) = command.motion
        && let Shape::Arc(arc) = motion.path.shape
    {
        return (motion, arc);
    }
    panic!("{lines:?}: {command:?}");
}

fn xy(pose: Pose) -> [f64; 2] {
    [pose.x.to_num(), pose.y.to_num()]
}

fn distance([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    (ax - bx).hypot(ay - by)
}

/// The arc starts at the start and ends at the target: the promise in [`Arc`]'s doc.
fn assert_ends_meet(motion: &Move, arc: &Arc) {
    let largest_mm = if arc.radius_mm <= 1e4 { 1e-8 } else { 1e-6 };
    let start_mm = distance(arc.point_at(0.0), xy(motion.path.start));
    let target_mm = distance(arc.point_at(1.0), xy(motion.path.target));
    assert!(
        start_mm <= largest_mm,
        "{start_mm} mm at the start, {arc:?}"
    );
    assert!(
        target_mm <= largest_mm,
        "{target_mm} mm at the target, {arc:?}"
    );
}

#[test]
fn known_arcs() {
    // lines, centre, radius, sweep in half turns
    type Case<'a> = (&'a [&'a str], [f64; 2], f64, f64);
    let cases: &[Case] = &[
        (
            &["G0 X180 Y0", "G3 X225 Y-45 I45 F9600"],
            [225.0, 0.0],
            45.0,
            0.5,
        ),
        (
            &["G0 X10 Y0", "G3 X0 Y10 I-10 J0 F1"],
            [0.0, 0.0],
            10.0,
            0.5,
        ),
        (&["G0 X10 Y0", "G2 X0 Y10 I-10 F1"], [0.0, 0.0], 10.0, -1.5),
        (&["G0 X10 Y0", "G3 X-10 Y0 I-10 F1"], [0.0, 0.0], 10.0, 1.0),
        (&["G0 X10 Y0", "G2 X-10 Y0 I-10 F1"], [0.0, 0.0], 10.0, -1.0),
        // Full circles, the last but one with a target that is off by rounding.
        (&["G0 X10 Y0", "G3 X10 Y0 I-10 F1"], [0.0, 0.0], 10.0, 2.0),
        (&["G0 X10 Y0", "G2 X10 I-10 F1"], [0.0, 0.0], 10.0, -2.0),
        (
            &["G0 X10 Y0", "G91 G2 X0 Y0 I-10 F1"],
            [0.0, 0.0],
            10.0,
            -2.0,
        ),
        (
            &["G0 X10 Y0", "G3 X10.001 Y0 I-10 F1"],
            [0.0, 0.0],
            10.0,
            2.0,
        ),
        (
            &["G0 X10 Y0", "G3 X10 Y0 I-0.001 F1"],
            [9.999, 0.0],
            0.001,
            2.0,
        ),
        // R: the shorter way, and the longer one if it is negative.
        (&["G0 X10 Y0", "G3 X0 Y10 R10 F1"], [0.0, 0.0], 10.0, 0.5),
        (&["G0 X10 Y0", "G3 X0 Y10 R-10 F1"], [10.0, 10.0], 10.0, 1.5),
        (&["G0 X10 Y0", "G2 X0 Y10 R10 F1"], [10.0, 10.0], 10.0, -0.5),
        (&["G0 X10 Y0", "G2 X0 Y10 R-10 F1"], [0.0, 0.0], 10.0, -1.5),
        (&["G0 X10 Y0", "G3 X-10 Y0 R10 F1"], [0.0, 0.0], 10.0, 1.0),
        // A radius that is short by rounding.
        (
            &["G0 X10 Y0", "G3 X-10 Y0 R9.999 F1"],
            [0.0, 0.0],
            10.0,
            1.0,
        ),
        (&["G20", "X1 Y0", "G3 X0 Y1 I-1 F1"], [0.0, 0.0], 25.4, 0.5),
        (&["G20", "X1 Y0", "G3 X0 Y1 R1 F1"], [0.0, 0.0], 25.4, 0.5),
    ];
    for &(lines, centre, radius_mm, half_turns) in cases {
        let (motion, arc) = arc_move(lines);
        assert_ends_meet(&motion, &arc);
        let off_mm = distance([arc.centre_x_mm, arc.centre_y_mm], centre);
        assert!(off_mm < 5e-6, "{lines:?}: {arc:?}");
        assert!(
            (arc.radius_mm - radius_mm).abs() < 2e-6,
            "{lines:?}: {arc:?}"
        );
        assert!(
            (arc.sweep_rad / PI - half_turns).abs() < 1e-6,
            "{lines:?}: {arc:?}"
        );
    }
}

#[test]
fn helices_and_short_arcs() {
    let (motion, arc) = arc_move(&["G0 X10 Y0 Z1", "G3 X10 Y0 Z5 C180 I-10 J0 F600"]);
    assert_eq!(arc.sweep_rad, TAU);
    assert_eq!(motion.path.target.z, 5);
    assert_eq!(motion.path.target.c, 180);
    // 10 nm at a radius of 1 m are an arc, no full circle.
    let (motion, arc) = arc_move(&["G0 X1000 Y0", "G3 X1000 Y0.00001 I-1000 F600"]);
    assert_ends_meet(&motion, &arc);
    assert!((arc.sweep_rad - 1e-8).abs() < 1e-9, "{arc:?}");
    // As far from closing as Grbl allows.
    let cases: &[(&[&str], f64)] = &[
        (&["G0 X10 Y0", "G2 X-10.009 Y0 I-10 F1"], 0.009),
        (&["G0 X0 Y0", "G2 X1000.499 Y0 I500 F1"], 0.499),
        (&["G0 X0.1 Y0", "G2 X-0.1049 Y0 I-0.1 F1"], 0.0049),
    ];
    for &(lines, difference_mm) in cases {
        let (motion, arc) = arc_move(lines);
        assert_ends_meet(&motion, &arc);
        let difference = arc.end_radius_mm - arc.radius_mm;
        assert!(
            (difference - difference_mm).abs() < 2e-6,
            "{lines:?}: {arc:?}"
        );
    }
}

/// Arcs of 10 µm and more that are no full circle: centre, radius, direction of the
/// start, sweep.
fn arcs() -> impl Strategy<Value = ([f64; 2], f64, f64, f64)> {
    (
        (-500.0..500.0, -500.0..500.0),
        prop_oneof![0.1..10.0, 10.0..1000.0],
        -PI..PI,
        prop_oneof![-1.0..1.0, -1e-3..1e-3],
    )
        .prop_map(|((x, y), radius, start, turns)| ([x, y], radius, start, turns * TAU))
        .prop_filter("too short", |&(_, radius, _, sweep): &(_, f64, _, f64)| {
            radius * sweep.abs().min(TAU - sweep.abs()) > 0.01
        })
}

/// The point of the oracle's arc at an angle from +X.
fn oracle_point([x, y]: [f64; 2], radius: f64, angle: f64) -> [f64; 2] {
    [x + radius * angle.cos(), y + radius * angle.sin()]
}

fn word(sweep: f64) -> &'static str {
    if sweep < 0.0 { "G2" } else { "G3" }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn arcs_by_centre((centre, radius, start_angle, sweep) in arcs()) {
        let start = oracle_point(centre, radius, start_angle);
        let target = oracle_point(centre, radius, start_angle + sweep);
        let (motion, arc) = arc_move(&[
            &format!("G0 X{:.9} Y{:.9}", start[0], start[1]),
            &format!(
                "{} X{:.9} Y{:.9} I{:.9} J{:.9} F600",
                word(sweep), target[0], target[1], centre[0] - start[0], centre[1] - start[1],
            ),
        ]);
        assert_ends_meet(&motion, &arc);
        let off_mm = distance(xy(motion.path.target), target);
        prop_assert!(off_mm < ROUNDING_MM, "{off_mm}");
        prop_assert!((arc.sweep_rad - sweep).abs() * radius < 3.0 * ROUNDING_MM, "{arc:?}");
        for fraction in [0.25, 0.5, 0.75] {
            let expected = oracle_point(centre, radius, start_angle + sweep * fraction);
            let off_mm = distance(arc.point_at(fraction), expected);
            prop_assert!(off_mm < 3.0 * ROUNDING_MM, "{off_mm}: {arc:?}");
        }
    }

    #[test]
    fn arcs_by_radius((centre, radius, start_angle, sweep) in arcs()) {
        let start = oracle_point(centre, radius, start_angle);
        let target = oracle_point(centre, radius, start_angle + sweep);
        let signed = if sweep.abs() > PI { -radius } else { radius };
        let (motion, arc) = arc_move(&[
            &format!("G0 X{:.9} Y{:.9}", start[0], start[1]),
            &format!("{} X{:.9} Y{:.9} R{signed:.9} F600", word(sweep), target[0], target[1]),
        ]);
        assert_ends_meet(&motion, &arc);
        prop_assert_eq!(arc.radius_mm, arc.end_radius_mm);
        prop_assert!((arc.radius_mm - radius).abs() < ROUNDING_MM);
        prop_assert_eq!(arc.sweep_rad < 0.0, sweep < 0.0);
        // The chord's rounding turns the arc by its share of the chord, and near half
        // a turn the radius says little about the sweep.
        let chord = distance(start, target);
        let height = radius * (sweep / 2.0).cos().abs();
        prop_assume!(height > 1e-2 * radius);
        let tolerance_mm = 6.0 * ROUNDING_MM * (radius / chord).max(1.0) * (radius / height);
        for fraction in [0.5, 1.0] {
            let expected = oracle_point(centre, radius, start_angle + sweep * fraction);
            let off_mm = distance(arc.point_at(fraction), expected);
            prop_assert!(off_mm < tolerance_mm, "{off_mm} of {tolerance_mm}: {arc:?}");
        }
    }

    /// Words that exist, in lines that mostly do not make sense: nothing panics, a
    /// refused line changes nothing, moves follow on each other, and arcs meet.
    #[test]
    fn programs_hang_together(
        lines in prop::collection::vec(
            "([GMGXYZCFIJRPNQL]([0-4]|-?[0-9]{1,4}(\\.[0-9]{0,4})?)|G10 L20? P[0-6]|G(28|30|92)(\\.1)?|G53|G5[4-9]|G43\\.1)\
             ( [GMGXYZCFIJRPST]([0-4]|-?[0-9]{1,3}(\\.[0-9]{0,4})?)){0,5}",
            0..60,
        ),
    ) {
        let mut interpreter = Interpreter::new(Defaults::default());
        run(&mut interpreter, "G0 X10 Y10 F100").unwrap();
        for text in &lines {
            let before = *interpreter.modal();
            let offsets = interpreter.offsets().clone();
            let position = before.position().unwrap();
            match run(&mut interpreter, text) {
                Ok(command) => {
                    let actions = [
                        command.robot.is_some(),
                        command.outputs.is_some(),
                        command.dwell_s.is_some(),
                        command.via.is_some(),
                        command.motion.is_some(),
                        command.outputs_after.is_some(),
                        command.flow.is_some(),
                    ];
                    let actions = actions.into_iter().filter(|is_there| *is_there).count();
                    prop_assert!(actions <= MAX_ACTIONS_A_LINE, "{text}");
                    let mut end = position;
                    for motion in command.moves() {
                        prop_assert_eq!(motion.path.start, end);
                        end = motion.path.target;
                        match motion.path.shape {
                            Shape::Line => prop_assert_ne!(motion.path.start, end),
                            Shape::Arc(arc) => assert_ends_meet(motion, &arc),
                        }
                    }
                    prop_assert_eq!(Some(end), interpreter.modal().position());
                    prop_assert_eq!(interpreter.offsets().to_bytes(), Offsets::from_bytes(&interpreter.offsets().to_bytes()).unwrap().to_bytes());
                }
                Err(error) => {
                    prop_assert_eq!(before, *interpreter.modal());
                    prop_assert_eq!(&offsets, interpreter.offsets());
                    prop_assert!(error.to_string().len() > 10);
                }
            }
        }
    }

    #[test]
    fn any_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        let mut buffer = LineBuffer::new();
        let mut interpreter = Interpreter::new(Defaults::default());
        for byte in bytes {
            if buffer.push(byte) == Received::Line
                && let Ok(line) = Line::parse(buffer.line())
                && let Ok(interpreted) = interpreter.interpret(&line).or(interpreter.jog(&line))
            {
                interpreter.commit(&interpreted);
            }
        }
    }
}
