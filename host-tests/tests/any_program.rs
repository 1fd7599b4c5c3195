//! The tolerance on any program, judged by the independent checker.

use std::f64::consts::TAU;

use host_tests::any_program::{ARM, any_program, chord_circle};
use host_tests::checker::{CheckOptions, Program, TraceRow, check, tolerance_use};
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
    let mut rows = Vec::new();
    let result = run(robot, program, |setpoint| {
        let pose = setpoint.pose;
        rows.push(TraceRow {
            time_s: f64::from(rows.len() as u32) * TICK_S,
            pose: [
                pose.x.to_num(),
                pose.y.to_num(),
                pose.z.to_num(),
                pose.c.to_num(),
            ],
        });
    });
    if let Err(error) = result {
        panic!("{error}\n{program}");
    }
    rows
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
            (60.0, 0.5, 4, 0.02, 0.05),
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
