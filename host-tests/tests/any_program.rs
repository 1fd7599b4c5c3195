//! The tolerance on any program, judged by the independent checker.

use std::f64::consts::TAU;
use std::fmt::Write;

use host_tests::any_program::{ARM, any_program, chord_circle};
use host_tests::checker::{CheckOptions, Program, TraceRow, check, tolerance_use};
use host_tests::judged_run::rows;
use host_tests::oracle::Prefilter;
use host_tests::software_loop::run;
use planner_core::config::{Robot, RobotConfig};
use planner_core::prefilter::Kind;

const TICK_S: f64 = 1e-3;

/// Feedrate limit of the random programs.
const FASTEST_MM_S: f64 = 400.0;

/// What the programs round arcs by: their two radii differ by as much.
const ROUNDING_MM: f64 = 1e-3;

fn robot(change: impl FnOnce(&mut RobotConfig)) -> Robot {
    let mut config = RobotConfig::default();
    config.set_all(ARM).expect("these settings exist");
    change(&mut config);
    Robot::new(&config).expect("the settings are within range")
}

fn trace(robot: &Robot, program: &str) -> Vec<TraceRow> {
    let mut all = Vec::new();
    if let Err(error) = run(robot, program, |setpoint| all.push(*setpoint)) {
        panic!("{error}\n{program}");
    }
    rows(&all)
}

fn prefilter(robot: &Robot) -> Prefilter {
    let config = robot.config.prefilter;
    Prefilter::named(
        config.kind.name(),
        config.frequency_hz.into(),
        config.damping.into(),
    )
    .expect("both have the same names")
}

#[test]
fn the_tolerance_holds_on_any_program() {
    the_tolerance_holds_on(0..42);
}

#[test]
#[ignore = "long: a thousand programs"]
fn the_tolerance_holds_on_a_thousand_programs() {
    the_tolerance_holds_on(0..1000);
}

fn the_tolerance_holds_on(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let kind = Kind::ALL[seed as usize % Kind::ALL.len()];
        let tolerance_mm = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0][(seed / 3) as usize % 8];
        let robot = robot(|config| {
            config.prefilter.kind = kind;
            config.prefilter.frequency_hz = [3.5, 6.34, 12.0, 30.0, 100.0][seed as usize % 5];
            config.feed_limit_mm_s = FASTEST_MM_S as f32;
            config.corner_tolerance_mm = tolerance_mm;
        });
        let program = any_program(seed, seed % 3 == 0);
        let parsed = Program::parse(&program).expect("the checker reads it");
        let rows = trace(&robot, &program);
        // Straight lines between rows cut where the velocity turns: at once, or within a box.
        let cut_mm = match robot.prefilter().longest_box_s() {
            None => FASTEST_MM_S * TICK_S / 2.0,
            Some(box_s) => FASTEST_MM_S * TICK_S * TICK_S / (2.0 * box_s),
        };
        let used = tolerance_use(&parsed, &rows, tolerance_mm.into(), (ROUNDING_MM, cut_mm));
        assert!(
            used.strayed <= 1.0 && used.missed <= 1.0,
            "seed {seed}, {kind:?} {} Hz, {tolerance_mm} mm: {used:?}\n{program}",
            robot.config.prefilter.frequency_hz
        );
    }
}

/// A circle of chords.
struct Circle {
    radius_mm: f64,
    chord_mm: f64,
    /// Of its coordinates.
    decimals: usize,
    tolerance_mm: f64,
}

impl Circle {
    /// Runs it at 160 mm/s, if it may, within its tolerance. How much longer it takes than the
    /// bound `F² σ² / (2R) = tolerance` allows, as a part of that time.
    fn slower(&self, kind: Kind) -> f64 {
        const ASKED_MM_S: f64 = 160.0;
        let robot = robot(|config| {
            config.prefilter.kind = kind;
            config.corner_tolerance_mm = self.tolerance_mm as f32;
        });
        let bound_mm_s = (2.0 * self.radius_mm * self.tolerance_mm).sqrt()
            / prefilter(&robot).variance_s2().sqrt();
        // a chord lasts a tick at least
        let bound_mm_s = bound_mm_s.min(ASKED_MM_S).min(self.chord_mm / TICK_S);
        let program = chord_circle(self.radius_mm, self.chord_mm, self.decimals, ASKED_MM_S);
        let parsed = Program::parse(&program).expect("the checker reads it");
        let rows = trace(&robot, &program);
        let options = CheckOptions {
            tolerance_mm: self.tolerance_mm,
            ..CheckOptions::default()
        };
        let report = check(&parsed, &rows, &options);
        let used = report.max_path_deviation_mm / self.tolerance_mm;
        let bound_s = TAU * self.radius_mm / bound_mm_s + robot.prefilter().length_s();
        let slower = report.cycle_time_s / bound_s - 1.0;
        println!(
            "{kind:?}, radius {} mm, chords of {} mm to {} decimals, {} mm: {used:.3} of it used, {:.2} % slower",
            self.radius_mm,
            self.chord_mm,
            self.decimals,
            self.tolerance_mm,
            slower * 100.0
        );
        assert!(used <= 1.0 && report.drift_mm < 2e-6);
        slower
    }
}

#[test]
fn a_circle_of_chords_is_at_most_5_percent_slower_than_the_bound() {
    let circle = Circle {
        radius_mm: 25.0,
        chord_mm: 0.2,
        decimals: 4,
        tolerance_mm: 0.1,
    };
    let slower = circle.slower(Kind::FirZvd);
    assert!((-0.01..=0.05).contains(&slower), "{slower}");
}

#[test]
fn circles_of_chords_are_hardly_slower_than_the_bound() {
    for kind in [
        Kind::Zv,
        Kind::Zvd,
        Kind::Ei,
        Kind::Fir,
        Kind::FirZv,
        Kind::FirZvd,
    ] {
        for (radius_mm, chord_mm, decimals, tolerance_mm, most) in [
            (25.0, 0.2, 4, 0.1, 0.08),
            (25.0, 0.1, 4, 0.1, 0.1),
            (25.0, 1.0, 4, 0.1, 0.09),
            (100.0, 0.1, 3, 0.5, 0.05),
            (5.0, 0.2, 4, 0.05, 0.14),
            (60.0, 0.5, 4, 0.02, 0.06),
            // rounded so far that the chords' directions are noise
            (25.0, 0.2, 3, 0.1, 0.12),
            (25.0, 0.1, 3, 0.1, 0.4),
        ] {
            let circle = Circle {
                radius_mm,
                chord_mm,
                decimals,
                tolerance_mm,
            };
            let slower = circle.slower(kind);
            assert!(slower <= most, "{kind:?}: {slower}");
        }
    }
}

/// How much longer a program takes than it would at the feedrate that the bound
/// `F² σ² κ / 2 = tolerance` allows everywhere, as a part of that time: `curve` yields a place in
/// mm of the path from 0 to 1, to be walked at 160 mm/s if it may.
fn slower_than_the_bound(program: &str, tolerance_mm: f32, curve: impl Fn(f64) -> [f64; 2]) -> f64 {
    const STEPS: u32 = 20_000;
    let robot = robot(|config| config.corner_tolerance_mm = tolerance_mm);
    let spread_s = prefilter(&robot).variance_s2().sqrt();
    let mut bound_s = robot.prefilter().length_s();
    let place = |step: u32| curve(f64::from(step) / f64::from(STEPS));
    for step in 1..STEPS {
        let [before, here, behind] = [step - 1, step, step + 1].map(place);
        let (u1, u2) = (
            [here[0] - before[0], here[1] - before[1]],
            [behind[0] - here[0], behind[1] - here[1]],
        );
        let length_mm = u2[0].hypot(u2[1]);
        let turn = (u1[0] * u2[1] - u1[1] * u2[0]).atan2(u1[0] * u2[0] + u1[1] * u2[1]);
        let squared = 2.0 * f64::from(tolerance_mm) * length_mm / turn.abs().max(1e-12);
        bound_s += length_mm / (squared.sqrt() / spread_s).min(160.0);
    }
    let rows = trace(&robot, program);
    let parsed = Program::parse(program).expect("the checker reads it");
    let used = tolerance_use(&parsed, &rows, tolerance_mm.into(), (ROUNDING_MM, 1e-3));
    assert!(used.strayed <= 1.0 && used.missed <= 1.0, "{used:?}");
    let takes_s = (rows.len() - 1) as f64 * TICK_S;
    println!("{takes_s:.3} s, at the bound {bound_s:.3} s");
    takes_s / bound_s - 1.0
}

/// Its curvature grows and falls eightfold, four times.
fn figure_of_eight(at: f64) -> [f64; 2] {
    [
        480.0 + 50.0 * (TAU * at).sin(),
        40.0 * (2.0 * TAU * at).sin(),
    ]
}

fn round(at: f64) -> [f64; 2] {
    [480.0 + 25.0 * (TAU * at).cos(), 25.0 * (TAU * at).sin()]
}

#[test]
fn a_curve_of_chords_is_walked_near_its_bound() {
    for (count, most) in [(1500, 0.2), (400, 0.2), (150, 0.35)] {
        let mut program = String::from("G0 X480 Y0\nG1 F9600\n");
        for i in 1..=count {
            let [x, y] = figure_of_eight(f64::from(i) / f64::from(count));
            let _ = writeln!(program, "X{x:.4} Y{y:.4}");
        }
        let slower = slower_than_the_bound(&(program + "M2\n"), 0.1, figure_of_eight);
        assert!((-0.05..=most).contains(&slower), "{count} chords: {slower}");
    }
}

/// Each of the arcs is shorter than the prefilter: one at a time they would take 22 s.
#[test]
fn a_chain_of_short_arcs_is_walked_near_its_bound() {
    for (count, most) in [(100, 0.15), (40, 0.25)] {
        let mut program = String::from("G0 X505 Y0\nG1 F9600\n");
        for i in 0..count {
            let [x0, y0] = round(f64::from(i) / f64::from(count));
            let [x, y] = round(f64::from(i + 1) / f64::from(count));
            let _ = writeln!(program, "G3 X{x:.4} Y{y:.4} I{:.4} J{:.4}", 480.0 - x0, -y0);
        }
        let slower = slower_than_the_bound(&(program + "M2\n"), 0.2, round);
        assert!((-0.05..=most).contains(&slower), "{count} arcs: {slower}");
    }
}

/// The filter reaches far around the small circle and much of the large one: where the command is
/// furthest from them depends on both.
#[test]
fn the_tolerance_holds_between_a_fast_circle_and_a_small_one() {
    let program = "G0 X500 Y0\nG2 X500 Y0 I15 F23555\nG2 X500 Y0 I1.829 F2116\n\
                   G2 X500 Y0 I2.31 F4820\nG1 X500 Y20\n";
    let robot = robot(|config| {
        config
            .set_all(
                "prefilter=fir-3hump-ei frequency=6 prefilter2=fir-zv frequency2=9 tolerance=0.2",
            )
            .expect("these settings exist");
    });
    let parsed = Program::parse(program).expect("the checker reads it");
    let rows = trace(&robot, program);
    let used = tolerance_use(&parsed, &rows, 0.2, (ROUNDING_MM, 0.0));
    assert!((0.1..=1.0).contains(&used.strayed), "{used:?}");
}
