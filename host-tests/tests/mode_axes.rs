//! Modes that swing along some axes only: a move has the prefilters of its axes.

use std::fmt::Write as _;

use host_tests::any_program::{ARM, any_program};
use host_tests::checker::{Program, tolerance_use};
use host_tests::judged_run::rows;
use host_tests::plant::{IdealPlant, Mode};
use host_tests::software_loop::run;
use host_tests::trace::pose;
use host_tests::vector::xyz;
use planner_core::config::{ConfigError, Robot, RobotConfig};
use planner_core::motion::Setpoint;
use planner_core::planner::Planner;
use planner_core::pose::Pose;
use planner_core::prefilter::{AxisSet, Kind, Prefilter};
use planner_core::queue::SegmentQueue;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TICK_S: f64 = 1e-3;

/// The modes of these tests: 6 Hz along X and 9 Hz along Y.
const MODES_HZ: [f64; 2] = [6.0, 9.0];
const DAMPING: f64 = 0.02;

const DIAGONAL: &str = "G0 X400 Y0 Z0\nG1 X500 Y80 F9600\n";

/// A robot with a prefilter for each of them.
const TWO_MODES: &str =
    "prefilter=fir-zvd frequency=6 damping=0.02 prefilter2=fir-zv frequency2=9 damping2=0.02";

fn robot(settings: &str) -> Robot {
    let mut config = RobotConfig::default();
    for part in [ARM, TWO_MODES, settings] {
        config.set_all(part).expect("these settings exist");
    }
    Robot::new(&config).expect("the settings are within range")
}

fn setpoints(robot: &Robot, program: &str) -> Vec<Setpoint> {
    let mut all = Vec::new();
    if let Err(error) = run(robot, program, |setpoint| all.push(*setpoint)) {
        panic!("{error}\n{program}");
    }
    all
}

/// The largest acceleration of the mode along X and of that along Y in the 2 s after the command
/// has come to its end, in mm/s².
fn residual_mm_s2(all: &[Setpoint]) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    let Some(first) = all.first() else {
        return worst;
    };
    for (axis, frequency_hz) in MODES_HZ.into_iter().enumerate() {
        let mode = Mode {
            frequency_hz,
            damping: DAMPING,
        };
        let mut plant = IdealPlant::new(mode, TICK_S, xyz(pose(first)));
        let mut last = [0.0; 3];
        for setpoint in all {
            last = xyz(pose(setpoint));
            plant.step(last);
        }
        for _ in 0..2000 {
            let moved = plant.step(last).tool_acceleration_mm_s2[axis];
            worst[axis] = worst[axis].max(moved.abs());
        }
    }
    worst
}

/// The poses from the first that is not the last on.
fn motion(all: &[Setpoint]) -> Vec<Pose> {
    let poses = all.iter().map(|setpoint| setpoint.pose);
    let start = all.first().map(|setpoint| setpoint.pose);
    poses.skip_while(|pose| Some(*pose) == start).collect()
}

/// How long the command moves.
fn moves_s(all: &[Setpoint]) -> f64 {
    let changed = |pair: &[Setpoint]| pair[0].pose != pair[1].pose;
    let first = all.windows(2).position(changed).unwrap_or(0);
    let last = all.windows(2).rposition(changed).unwrap_or(0);
    f64::from(u32::try_from(last + 1 - first).unwrap()) * TICK_S
}

#[test]
fn a_move_along_x_is_as_still_and_shorter_by_the_other_modes_prefilter() {
    let program = "G0 X400 Y0 Z0\nG1 X560 F9600\n";
    let own = setpoints(&robot("axes=x axes2=y"), program);
    let both = setpoints(&robot(""), program);
    let none = setpoints(&robot("prefilter=none frequency2=0"), program);
    let swapped = setpoints(&robot("axes=y axes2=x"), program);
    // FIR-ZV: 1.5 periods of 9 Hz
    let saved_s = moves_s(&both) - moves_s(&own);
    assert!((saved_s - 1.5 / 9.0).abs() < 0.005, "{saved_s}");
    let [own, both, none, swapped] = [own, both, none, swapped].map(|all| residual_mm_s2(&all));
    println!("{own:?} of {none:?} mm/s², {both:?} with both, {swapped:?} with the other one");
    assert!((1000.0..20_000.0).contains(&none[0]), "{none:?}");
    assert!(own[0] < 2e-4 * none[0] && both[0] < 2e-4 * none[0]);
    assert_eq!(own[1], 0.0);
    // the other mode's prefilter alone is no help
    assert!((0.005..0.9).contains(&(swapped[0] / none[0])));
}

#[test]
fn a_diagonal_has_both_and_bends_nowhere() {
    for program in [
        DIAGONAL,
        "G0 X400 Y0 Z0\nG3 X400 Y0 I40 J0 F9600\n",
        // a turn of the yaw turns the arm in the plane
        "G0 X400 Y0 Z0\nG1 C90 F9600\n",
    ] {
        let own = setpoints(&robot("axes=x axes2=y"), program);
        let both = setpoints(&robot(""), program);
        assert_eq!(motion(&own), motion(&both), "{program}");
    }
    let [x, y] = residual_mm_s2(&setpoints(&robot("axes=x axes2=y"), DIAGONAL));
    let [free_x, free_y] =
        residual_mm_s2(&setpoints(&robot("prefilter=none frequency2=0"), DIAGONAL));
    println!("{x:.5} of {free_x:.0}, {y:.5} of {free_y:.0} mm/s²");
    assert!((1000.0..20_000.0).contains(&free_x) && (1000.0..20_000.0).contains(&free_y));
    assert!(x < 2e-6 * free_x && y < 2e-6 * free_y);
}

#[test]
fn a_line_of_two_axes_is_straight_although_its_modes_differ() {
    let all = setpoints(
        &robot("axes=x axes2=y"),
        "G0 X400 Y0 Z0\nG1 X500 Y100 F9600\n",
    );
    let off = |setpoint: &Setpoint| {
        let [x, y, ..] = pose(setpoint);
        ((x - 400.0) - y).abs()
    };
    let furthest_mm = all.iter().map(off).fold(0.0, f64::max);
    // each coordinate with its own kernel would be off by F/2 (m_x − m_y) = 6.7 mm
    assert!(furthest_mm < 1e-5, "{furthest_mm}");
}

/// How often the command rests between its first and its last move.
fn stops(all: &[Setpoint]) -> usize {
    let moving: Vec<_> = all
        .windows(2)
        .map(|pair| pair[0].pose != pair[1].pose)
        .collect();
    let last = moving.iter().rposition(|moves| *moves).unwrap_or(0);
    let begins = moving[..last].windows(2).filter(|pair| pair[0] && !pair[1]);
    begins.count()
}

#[test]
fn a_dense_path_stops_once_for_each_mode_that_comes_in() {
    let mut staircase = String::from("G0 X400 Y0 Z0\nG1 F6000\n");
    for step in 1..=100 {
        let _ = writeln!(staircase, "X{:.2}", 400.0 + 0.2 * f64::from(step));
        let _ = writeln!(staircase, "Y{:.2}", 0.2 * f64::from(step));
    }
    // a tolerance that asks for no stop by itself
    let stops = |settings: &str, program: &str| {
        stops(&setpoints(
            &robot(&format!("tolerance=100 {settings}")),
            program,
        ))
    };
    assert_eq!(stops("", &staircase), 0);
    assert_eq!(stops("axes=x axes2=y", &staircase), 1);
    // never for one that is there
    let climbing = format!("{staircase}Z1\nX421\nY21\nX422\n");
    assert_eq!(stops("", &climbing), 0);
    assert_eq!(stops("axes=x axes2=yz", &climbing), 1);
    assert_eq!(stops("axes=xy axes2=z", &climbing), 1);
    assert_eq!(stops("axes=xyz axes2=xy", &climbing), 0);
    assert_eq!(stops("axes=y axes2=z", &climbing), 2);
}

#[test]
fn a_mode_is_left_out_only_where_the_path_stands() {
    let mut robot = robot("axes=x axes2=y");
    let mut queue = SegmentQueue::new();
    let (producer, mut consumer) = queue.split();
    let mut planner = Planner::new(&mut robot, producer);
    let mut modes = |line: &str| {
        planner
            .line(line.as_bytes())
            .unwrap_or_else(|error| panic!("{error}"));
        while consumer.pop().is_some() {}
        while consumer.pop_kernel().is_some() {}
        let robot = planner.robot();
        robot.config.prefilter.modes_along(robot.along)
    };
    let (x, y, both, none) = ([true, false], [false, true], [true; 2], [false; 2]);
    for (line, expected) in [
        ("G0 X400 Y0 Z0", both),
        ("G1 X410 F6000", x),
        ("G1 Y10", both),
        ("G1 X420", both),
        // from an exact stop, after a dwell, an output or a pause
        ("G61 X430", x),
        ("G64 X440 Y20", both),
        ("G4 P0.1", both),
        ("G1 Y30", y),
        ("M3", y),
        ("G1 X450", x),
        ("M0", x),
        ("G1 Y40", y),
        // Z alone excites neither
        ("G61 Z5", none),
        ("G64 Y30", y),
        // the yaw counts as X and Y, an arc goes along both
        ("G1 C10", both),
        ("M5", both),
        ("G1 X440", x),
        ("G2 X450 Y30 I5 J-5", both),
        // a hop and the joints have all
        ("G4 P0.1", both),
        ("G1 X440", x),
        ("M103 X450 Y0 Q10 R20", both),
        ("G1 X440", x),
        ("M101", both),
        ("G1 X430", x),
        // so has what another prefilter begins with
        ("M100 P1", both),
        ("G1 X420", x),
    ] {
        assert_eq!(modes(line), expected, "{line}");
    }
}

#[test]
fn a_hop_has_every_mode() {
    let program = |before: &str| format!("G0 X400 Y0 Z0\n{before}M103 X480 Y60 Q10 R30\n");
    let alone = setpoints(&robot("axes=x axes2=y"), &program(""));
    let all = setpoints(&robot(""), &program(""));
    assert_eq!(moves_s(&alone), moves_s(&all));
    // also where the mode of X alone was in force
    let after = setpoints(
        &robot("axes=x axes2=y"),
        &program("G1 X410 F6000\nG4 P0.5\n"),
    );
    let [x, y] = residual_mm_s2(&after);
    let [free_x, free_y] = residual_mm_s2(&setpoints(
        &robot("hop-axes=none"),
        &program("G1 X410 F6000\nG4 P0.5\n"),
    ));
    println!("{x} of {free_x}, {y} of {free_y} mm/s²");
    assert!(free_x > 50.0 && free_y > 50.0);
    assert!(x < 2e-3 * free_x && y < 2e-3 * free_y);
}

/// Moves along single axes, diagonals, staircases, arcs and stops in a random row.
fn axis_program(seed: u64) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut text = String::from("G21 G90 G17\nG0 X500 Y0 Z0 C0\n");
    let mut at = [500.0_f64, 0.0, 0.0];
    let regions = [(300.0, 680.0), (-340.0, 340.0), (-80.0, 80.0)];
    for _ in 0..rng.random_range(5..20) {
        let feed = rng.random_range(1200.0_f64.ln()..24_000.0_f64.ln()).exp();
        let size = rng.random_range(0.05_f64.ln()..80.0_f64.ln()).exp();
        let _ = writeln!(text, "G1 F{feed:.0}");
        let mut go = |steps: &[f64; 3], text: &mut String| {
            for ((value, step), (low, high)) in at.iter_mut().zip(steps).zip(regions) {
                // back from the border
                *value += if (low..=high).contains(&(*value + step)) {
                    *step
                } else {
                    -step
                };
            }
            let [x, y, z] = at;
            let _ = writeln!(text, "G1 X{x:.4} Y{y:.4} Z{z:.4}");
        };
        match rng.random_range(0..8) {
            axis @ 0..=2 => {
                let mut step = [0.0; 3];
                step[axis] = size;
                go(&step, &mut text);
            }
            3 => go(&[size, -size / 2.0, 0.0], &mut text),
            4 => {
                let stair = size.min(2.0);
                for _ in 0..rng.random_range(3..40) {
                    go(&[stair, 0.0, 0.0], &mut text);
                    go(&[0.0, stair, 0.0], &mut text);
                }
            }
            5 => {
                for _ in 0..rng.random_range(3..40) {
                    go(&[0.0, size.min(2.0), 0.0], &mut text);
                }
            }
            6 => {
                let (x, y, radius) = (at[0], at[1], size.clamp(0.1, 15.0));
                let _ = writeln!(text, "G2 X{x:.4} Y{y:.4} I{radius:.3} J0");
            }
            _ => {
                let word = ["G61", "G64", "G64 P0.3", "G4 P0.01", "G1 C20", "G1 C0"];
                let _ = writeln!(text, "{}", word[rng.random_range(0..word.len())]);
            }
        }
    }
    text + "M2\n"
}

/// A robot with two modes along random axes.
fn random_robot(seed: u64, change: &str) -> Robot {
    let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
    let mut pick = || AxisSet::SETS[rng.random_range(0..AxisSet::SETS.len())];
    let axes = [pick(), pick()];
    let kinds = [0, 1].map(|i| Kind::ALL[(seed as usize + 7 * i) % Kind::ALL.len()]);
    robot(&format!(
        "prefilter={} axes={} prefilter2={} axes2={} feed-limit=400 {change}",
        kinds[0].name(),
        axes[0].name(),
        kinds[1].name(),
        axes[1].name(),
    ))
}

/// The shortest of the longest boxes that the prefilters of any axes have.
fn shortest_box_s(robot: &Robot) -> f64 {
    let config = robot.config.prefilter;
    let boxes = AxisSet::SETS.map(|axes| {
        let prefilter = Prefilter::new(&config.along(axes)).expect("a part of what is in force");
        prefilter.longest_box_s().unwrap_or(0.0)
    });
    boxes.into_iter().fold(f64::INFINITY, f64::min)
}

#[test]
fn the_tolerance_holds_with_modes_along_axes() {
    the_tolerance_holds_on(0..40);
}

#[test]
#[ignore = "long: 960 programs"]
fn the_tolerance_holds_with_modes_along_axes_on_many_programs() {
    the_tolerance_holds_on(40..1000);
}

fn the_tolerance_holds_on(seeds: std::ops::Range<u64>) {
    let mut changed = 0;
    for seed in seeds {
        let tolerance_mm = [0.01, 0.05, 0.2, 1.0][seed as usize % 4];
        let robot = random_robot(seed, &format!("tolerance={tolerance_mm}"));
        let program = if seed % 2 == 0 {
            axis_program(seed)
        } else {
            any_program(seed, seed % 3 == 0)
        };
        let parsed = Program::parse(&program).expect("the checker reads it");
        let all = setpoints(&robot, &program);
        let box_s = shortest_box_s(&robot);
        let cut_mm = if box_s > 0.0 {
            400.0 * TICK_S * TICK_S / (2.0 * box_s)
        } else {
            400.0 * TICK_S / 2.0
        };
        let used = tolerance_use(&parsed, &rows(&all), tolerance_mm, (1e-3, cut_mm));
        assert!(
            used.strayed <= 1.0 && used.missed <= 1.0,
            "seed {seed}, {tolerance_mm} mm, {:?}: {used:?}\n{program}",
            robot.config.prefilter
        );
        // ends at the programmed point, bit for bit as with all modes on every axis
        let every = setpoints(&every_axis(&robot), &program);
        let end = |all: &[Setpoint]| all.last().map(|setpoint| setpoint.pose);
        assert_eq!(end(&all), end(&every), "seed {seed}");
        let programmed = parsed.blocks.last().map_or([0.0; 4], |block| block.to);
        let ends = all.last().map_or([0.0; 4], pose);
        let off = programmed
            .iter()
            .zip(ends)
            .map(|(one, other)| (one - other).abs());
        assert!(off.fold(0.0, f64::max) < 2e-6, "seed {seed}: {ends:?}");
        // and does the same every time
        assert_eq!(setpoints(&robot, &program), all, "seed {seed}");
        changed += u32::from(every != all);
    }
    assert!(changed > 10, "{changed}");
}

/// The same robot with the prefilters of all modes on every axis.
fn every_axis(robot: &Robot) -> Robot {
    let mut config = robot.config;
    config.prefilter.axes = AxisSet::ALL;
    config.prefilter.second.axes = AxisSet::ALL;
    Robot::new(&config).expect("the settings are within range")
}

#[test]
fn axes_are_refused_beside_what_chooses_prefilters() {
    let refused = |settings: &str| {
        let mut config = RobotConfig::default();
        config.set_all(settings).expect("these settings exist");
        Robot::new(&config).err()
    };
    assert_eq!(refused("axes=x automatic=1"), Some(ConfigError::AxesOnMap));
    assert_eq!(refused("axes=xyz automatic=1"), None);
    // a second mode that is not there has no axes
    assert_eq!(refused("axes2=x automatic=1"), None);
    assert_eq!(
        refused("axes2=x frequency2=9 automatic=1"),
        Some(ConfigError::AxesOnMap)
    );
    // boxes that limits ask for make the part of one axis longer than all together
    let limits = "prefilter2=zv frequency2=0.6 axes2=y path-acceleration=10 path-jerk=20";
    let with = |kind: &str| refused(&format!("prefilter={kind} box-ms=2 axes=x {limits}"));
    assert!(matches!(with("s-curve"), Some(ConfigError::Prefilter(_))));
    assert_eq!(
        refused(&format!(
            "prefilter=s-curve box-ms=2 {}",
            limits.replace("axes2=y", "")
        )),
        None
    );
}
