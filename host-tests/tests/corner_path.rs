//! The corner path of the model's section 4, measured on the fixed-point trace by the
//! independent checker and on both plants, with every published prefilter.

use std::fmt::Write as _;
use std::sync::LazyLock;

use host_tests::checker::Report;
use host_tests::machine::Machine;
use host_tests::program_file::ProgramFile;
use host_tests::progress::Progress;
use host_tests::robot_file::RobotSettings;
use host_tests::scenario::{Outcome, Scenario};
use host_tests::summary::Ratios;
use host_tests::trace::{PlantKind, REST_TICKS, Trace};
use planner_core::prefilter::Kind;

/// The prefilters of section 4, and EI.
const PUBLISHED: [Kind; 7] = [
    Kind::None,
    Kind::Zv,
    Kind::Zvd,
    Kind::Ei,
    Kind::Fir,
    Kind::FirZv,
    Kind::FirZvd,
];

/// All runs of one plant and tolerance, in the order of [`PUBLISHED`].
type Runs = Vec<Outcome>;

static IDEAL_HALF_MM: LazyLock<Runs> = LazyLock::new(|| runs(PlantKind::Ideal, 0.5));
static IDEAL_STOPS: LazyLock<Runs> = LazyLock::new(|| runs(PlantKind::Ideal, 0.0));
static FULL_HALF_MM: LazyLock<Runs> = LazyLock::new(|| runs(PlantKind::Full, 0.5));

fn runs(plant: PlantKind, tolerance_mm: f32) -> Runs {
    let mut settings = RobotSettings::load(None).unwrap();
    settings.robot.corner_tolerance_mm = tolerance_mm;
    let scenario = Scenario {
        program: ProgramFile::corner_path(),
        settings,
        plant,
        machine: Machine::Host,
    };
    let run = |kind| scenario.run_with(kind, Progress::Hidden).unwrap();
    PUBLISHED.map(run).into()
}

fn of(runs: &Runs, kind: Kind) -> &Outcome {
    runs.iter().find(|run| run.prefilter == kind).unwrap()
}

fn report(run: &Outcome) -> &Report {
    &run.checked.as_ref().unwrap().1
}

/// How far a polyline of samples 1 ms apart may cut a corner where the velocity jumps: half
/// of what 160 mm/s travel in a tick.
const CUT_MM: f64 = 0.08;

#[test]
fn cycle_times_of_section_4() {
    for (kind, stops_ms, half_mm_ms) in [
        (Kind::None, 2866, 2866),
        (Kind::Zv, 3261, 3218),
        (Kind::Zvd, 3655, 3570),
        (Kind::Fir, 3655, 3428),
        (Kind::FirZv, 4049, 3728),
        (Kind::FirZvd, 4444, 3988),
    ] {
        for (runs, expected_ms) in [(&*IDEAL_STOPS, stops_ms), (&*IDEAL_HALF_MM, half_mm_ms)] {
            let found_ms = (of(runs, kind).cycle_time_s * 1e3).round() as i32;
            let off = (found_ms - expected_ms).abs();
            assert!(off <= 2, "{kind:?}: {found_ms} ms, published {expected_ms}");
        }
    }
}

#[test]
fn corners_and_path_are_within_the_tolerance() {
    for run in &*IDEAL_HALF_MM {
        let (kind, report) = (run.prefilter, report(run));
        // Without a filter the samples themselves cut the corner.
        let least_mm = if kind == Kind::None { 0.0 } else { 0.4 };
        for corner in &report.corners {
            assert!(
                (least_mm..=0.5).contains(&corner.error_mm),
                "{kind:?} {corner:?}"
            );
        }
        assert!(report.max_path_deviation_mm <= 0.5, "{kind:?}");
        assert!(report.max_missed_mm <= 0.5, "{kind:?}");
        assert!(report.feed_excess_mm_s < 1e-2, "{kind:?}: {report:?}");
        assert_eq!((report.drift_mm, report.drift_deg), (0.0, 0.0));
        assert_eq!(report.corners.len(), 4);
    }
}

#[test]
fn exact_stops_leave_every_sample_on_the_path() {
    for run in &*IDEAL_STOPS {
        let (kind, report) = (run.prefilter, report(run));
        assert!(report.max_path_deviation_mm < 1e-3, "{kind:?} {report:?}");
        let smooth = matches!(kind, Kind::Fir | Kind::FirZv | Kind::FirZvd);
        let cut_mm = if smooth { 1e-3 } else { CUT_MM };
        assert!(report.max_corner_error_mm() < cut_mm, "{kind:?} {report:?}");
        assert_eq!((report.drift_mm, report.drift_deg), (0.0, 0.0));
    }
}

#[test]
fn vibration_of_the_ideal_plant_is_that_of_section_4() {
    let none = of(&IDEAL_HALF_MM, Kind::None);
    for (kind, max, rms, residual) in [
        (Kind::Zv, 0.299, 0.195, 0.0050),
        (Kind::Zvd, 0.147, 0.134, 0.0014),
        (Kind::Fir, 0.191, 0.150, 0.0157),
        (Kind::FirZv, 0.097, 0.112, 0.00075),
        (Kind::FirZvd, 0.087, 0.098, 0.00008),
    ] {
        let found = Ratios::new(of(&IDEAL_HALF_MM, kind), none);
        for (found, published) in [
            (found.vibration_max_ratio, max),
            (found.vibration_rms_ratio, rms),
            (found.vibration_residual_ratio, residual),
        ] {
            let off = (found.unwrap() - published).abs();
            let allowed = (0.03 * published).max(0.002);
            assert!(off <= allowed, "{kind:?}: {found:?}, published {published}");
        }
    }
}

#[test]
fn fir_zvd_takes_85_percent_of_the_full_plants_vibration_away() {
    let none = of(&FULL_HALF_MM, Kind::None);
    let found = Ratios::new(of(&FULL_HALF_MM, Kind::FirZvd), none);
    for ratio in [found.vibration_max_ratio, found.vibration_rms_ratio] {
        // Measured on a real robot: 0.143 and 0.149.
        assert!((0.08..0.15).contains(&ratio.unwrap()), "{found:?}");
    }
    assert!(found.vibration_residual_ratio.unwrap() < 0.005, "{found:?}");
}

#[test]
fn the_tool_settles_with_the_command_or_rings_for_seconds() {
    for runs in [&*IDEAL_HALF_MM, &*FULL_HALF_MM] {
        let settling = |kind| of(runs, kind).settling_time_s.unwrap();
        // ln(0.05 mm / 7.4 mm) / (ζω) = 5.7 s
        assert!((5.6..5.8).contains(&settling(Kind::None)));
        for kind in [Kind::FirZv, Kind::FirZvd] {
            assert_eq!(settling(kind), 0.0, "{kind:?}");
        }
    }
}

#[test]
fn the_trace_begins_and_ends_at_rest() {
    for run in &*IDEAL_HALF_MM {
        let trace = &run.trace;
        let rest = trace.setpoints.len() - trace.stop();
        assert!(rest >= REST_TICKS, "{:?}", run.prefilter);
        assert!(trace.start() <= 2);
        let duration = Trace::time_s(trace.stop()) - Trace::time_s(trace.start());
        assert_eq!(duration, run.cycle_time_s);
        let last = trace.setpoints[trace.setpoints.len() - 1];
        assert_eq!(last.joints.velocity, [0.0; 4]);
        assert_eq!(last.joints.acceleration, [0.0; 4]);
        assert_eq!(
            (last.pose.x.to_num::<f64>(), last.pose.y.to_num::<f64>()),
            (270.0, 0.0)
        );
    }
}

/// The figures as a table: any change shows. What depends on the platform's sines is rounded.
#[test]
fn figures_of_every_prefilter() {
    let mut table = String::new();
    for (name, runs) in [
        ("ideal plant, exact stops", &*IDEAL_STOPS),
        ("ideal plant, 0.5 mm", &*IDEAL_HALF_MM),
        ("full plant, 0.5 mm", &*FULL_HALF_MM),
    ] {
        writeln!(table, "{name}").unwrap();
        writeln!(
            table,
            "{:8}{:>9}{:>10}{:>10}{:>10}{:>8}{:>8}{:>9}{:>9}{:>9}",
            "", "cycle s", "settle s", "corner mm", "path mm", "max", "RMS", "after", "J1", "J2"
        )
        .unwrap();
        let none = of(runs, Kind::None);
        for run in runs {
            let ratios = Ratios::new(run, none);
            let [joint1, joint2, ..] = run.joint_peaks.acceleration;
            writeln!(
                table,
                "{:8}{:9.3}{:10.2}{:10.4}{:10.4}{:8.3}{:8.3}{:9.4}{:9.1}{:9.1}",
                run.prefilter.name(),
                run.cycle_time_s,
                run.settling_time_s.unwrap(),
                report(run).max_corner_error_mm(),
                report(run).max_path_deviation_mm,
                ratios.vibration_max_ratio.unwrap(),
                ratios.vibration_rms_ratio.unwrap(),
                ratios.vibration_residual_ratio.unwrap(),
                joint1,
                joint2,
            )
            .unwrap();
        }
    }
    insta::assert_snapshot!(table);
}
