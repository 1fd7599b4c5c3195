//! Every prefilter against the double-precision oracle, in cascades too, and in motion.

use std::fmt::Write as _;
use std::sync::LazyLock;

use host_tests::checker::Report;
use host_tests::machine::Machine;
use host_tests::oracle::{Options, Prefilter as Oracle};
use host_tests::program_file::ProgramFile;
use host_tests::progress::Progress;
use host_tests::robot_file::RobotSettings;
use host_tests::scenario::{Outcome, Scenario};
use host_tests::trace::PlantKind;
use planner_core::prefilter::{
    AxisSet, Convolver, CustomImpulse, FINE_BITS, Kernel, Kind, Mode, Prefilter, PrefilterConfig,
    PrefilterError, Response, SecondMode, insensitivity, residual,
};
use planner_core::units::{TICK_HZ, TICK_S};
use proptest::prelude::*;

/// The list of impulses of `custom` in these tests, times in ms.
const LIST: [(f32, f32); 5] = [
    (0.0, 3.0),
    (17.25, 1.0),
    (31.5, 0.0),
    (60.125, 2.0),
    (78.9, 1.5),
];

fn config(kind: Kind, frequency_hz: f32, damping: f32) -> PrefilterConfig {
    PrefilterConfig {
        kind,
        frequency_hz,
        damping,
        impulses: LIST.map(|(time_ms, weight)| CustomImpulse { time_ms, weight }),
        ..PrefilterConfig::default()
    }
}

/// The oracle's idea of the same settings.
fn oracle(config: &PrefilterConfig) -> Oracle {
    let jerk = f64::from(config.s_curve_jerk_mm_s3);
    let named = |kind: Kind, frequency_hz: f32, damping: f32| {
        let box_s = if kind == Kind::SCurve && jerk > 0.0 {
            Some((f64::from(config.s_curve_feed_mm_s) / jerk).sqrt())
        } else {
            Some(f64::from(config.box_ms) / 1e3).filter(|&length| length > 0.0)
        };
        let options = Options {
            v_tol: config.v_tol.into(),
            box_s,
            impulses: config
                .impulses
                .iter()
                .filter(|impulse| impulse.weight > 0.0)
                .map(|impulse| (f64::from(impulse.time_ms) / 1e3, impulse.weight.into()))
                .collect(),
        };
        Oracle::with_options(kind.name(), frequency_hz.into(), damping.into(), &options)
            .expect("the same names")
    };
    let mut parts = vec![named(config.kind, config.frequency_hz, config.damping)];
    let second = config.second;
    if second.frequency_hz > 0.0 {
        parts.push(named(second.kind, second.frequency_hz, second.damping));
    }
    // no box: the first smoothing box; fewer than two: the second one
    let boxes = |kind: Kind| match kind.name() {
        "s-curve" => 2,
        name => usize::from(name == "box" || name.starts_with("fir")),
    };
    let mut count = boxes(config.kind);
    if second.frequency_hz > 0.0 {
        count += boxes(second.kind);
    }
    for (place, length_ms) in config.smoothing_ms.into_iter().enumerate() {
        if length_ms > 0.0 && count <= place {
            count += 1;
            parts.push(Oracle::new(&[(0.0, 1.0)], &[f64::from(length_ms) / 1e3]));
        }
    }
    Oracle::cascade(&parts)
}

/// Largest differences of step and ramp response, the latter as a part of the length.
fn response_gap(response: &Response, oracle: &Oracle, reversed: bool) -> (f64, f64) {
    let length_s = oracle.length_s();
    let (mut step_gap, mut ramp_gap) = (0.0_f64, 0.0_f64);
    for i in 0..700 {
        let t_s = (length_s + 1e-3) * (f64::from(i) + 0.37) / 700.0;
        let t_s = f64::from(t_s as f32);
        let (step, ramp) = response.at(t_s as f32);
        // reversed: 1 − S(T − t) and its integral, from the ramp's end
        let back_s = length_s - t_s;
        let (exact_step, exact_ramp) = if reversed {
            let centroid_s = length_s - oracle.centroid_s();
            let exact_step = 1.0
                - if back_s > 0.0 {
                    oracle.step(back_s)
                } else {
                    0.0
                };
            let before = if back_s > 0.0 {
                oracle.ramp(back_s)
            } else {
                0.0
            };
            (exact_step, t_s + before - centroid_s)
        } else {
            (oracle.step(t_s), oracle.ramp(t_s))
        };
        let at = if reversed { back_s } else { t_s };
        let beside_a_kink = oracle.kinks_s().any(|kink| (kink - at).abs() < 1e-7);
        if !beside_a_kink {
            step_gap = step_gap.max((f64::from(step) - exact_step).abs());
        }
        ramp_gap = ramp_gap.max((f64::from(ramp) - exact_ramp).abs() / length_s.max(1e-3));
    }
    (step_gap, ramp_gap)
}

/// Whether a response has room: 180 numbers, of which a piece takes three and one for each box,
/// and fewer than 50 pieces. What has none is refused.
fn has_room(prefilter: &Prefilter, oracle: &Oracle) -> bool {
    let mut kinks_s: Vec<f64> = oracle.kinks_s().collect();
    kinks_s.sort_by(f64::total_cmp);
    kinks_s.dedup_by(|later, earlier| *later - *earlier < 1e-11);
    let room = kinks_s.len() < 50 && kinks_s.len() * (3 + prefilter.boxes_s().len()) <= 180;
    let refused = matches!(Kernel::new(prefilter), Err(PrefilterError::TooManyKinks));
    assert_eq!(refused, !room, "{} kinks", kinks_s.len());
    room
}

/// Whether the response was compared, too.
fn agrees(config: &PrefilterConfig) -> bool {
    let prefilter = Prefilter::new(config).expect("within range");
    let oracle = oracle(config);
    let case = format!("{config:?}");
    assert!(
        (prefilter.length_s() - oracle.length_s()).abs() < 1e-12,
        "{case}"
    );
    assert!(
        (prefilter.centroid_s() - oracle.centroid_s()).abs() < 1e-8,
        "{case}"
    );
    let spread_s = oracle.variance_s2().max(0.0).sqrt();
    assert!((prefilter.spread_s() - spread_s).abs() < 1e-8, "{case}");
    for ratio in [0.6, 0.8, 0.9, 1.0, 1.1, 1.3, 1.6, 2.5] {
        let mode = Mode {
            frequency_hz: f64::from(config.frequency_hz) * ratio,
            damping: config.damping.into(),
        };
        let exact = oracle.residual(mode.frequency_hz, mode.damping);
        assert!((residual(&prefilter, &mode) - exact).abs() < 1e-7, "{case}");
    }
    if !has_room(&prefilter, &oracle) {
        return false;
    }
    for (response, reversed) in [
        (prefilter.response(), false),
        (prefilter.reversed_response(), true),
    ] {
        let (step_gap, ramp_gap) = response_gap(&response, &oracle, reversed);
        assert!(step_gap < 3e-6, "{case} {reversed}: step {step_gap}");
        assert!(ramp_gap < 2e-6, "{case} {reversed}: ramp {ramp_gap}");
        assert!((f64::from(response.spread_s()) - spread_s).abs() < 1e-7);
        let delay_s = f64::from(response.delay_s());
        let centroid_s = if reversed {
            oracle.length_s() - oracle.centroid_s()
        } else {
            oracle.centroid_s()
        };
        assert!((delay_s - centroid_s).abs() < 1e-7, "{case}");
    }
    true
}

#[test]
fn every_prefilter_is_that_of_the_oracle() {
    for kind in Kind::ALL {
        for (frequency_hz, damping) in [(6.34, 0.022), (12.3, 0.1), (35.0, 0.0), (2.4727, 0.002)] {
            let config = config(kind, frequency_hz, damping);
            agrees(&config);
            let prefilter = Prefilter::new(&config).unwrap();
            let mode = Mode {
                frequency_hz: frequency_hz.into(),
                damping: damping.into(),
            };
            let limit = 0.05 + 1e-6;
            let found = insensitivity(&prefilter, &mode, limit)
                .map(|band| (band.low_hz, band.high_hz))
                .filter(|_| kind.follows_the_mode() && kind != Kind::None);
            let exact = oracle(&config)
                .band_hz(mode.frequency_hz, mode.damping, limit)
                .filter(|_| kind.follows_the_mode() && kind != Kind::None);
            assert_eq!(found.is_some(), exact.is_some(), "{kind:?}");
            if let (Some(found), Some(exact)) = (found, exact) {
                // the core's search ends at four times the nominal frequency
                let last_hz = 4.0 * mode.frequency_hz;
                let within = 2e-5 * mode.frequency_hz;
                let case = format!("{kind:?} {found:?} {exact:?}");
                assert!((found.0 - exact.0).abs() < within, "{case}");
                let is_beyond = found.1 > last_hz && exact.1 > last_hz;
                assert!(is_beyond || (found.1 - exact.1).abs() < within, "{case}");
            }
        }
    }
}

#[test]
fn settings_change_what_they_name() {
    let with = |change: fn(&mut PrefilterConfig)| {
        let mut config = config(Kind::SCurve, 6.34, 0.022);
        change(&mut config);
        agrees(&config);
        Prefilter::new(&config).unwrap()
    };
    // [Li23]: T_rr = √(V/J) = 0.125 s at 80 mm/s and 5120 mm/s³
    let by_jerk = with(|config| {
        config.s_curve_feed_mm_s = 80.0;
        config.s_curve_jerk_mm_s3 = 5120.0;
    });
    assert_eq!(by_jerk.boxes_s()[..], [0.125, 0.125]);
    let by_length = with(|config| {
        config.kind = Kind::Box;
        config.box_ms = 250.0;
    });
    assert_eq!(by_length.boxes_s()[..], [0.25]);
    for (kind, lengths_s) in [
        (Kind::Zv, &[0.04, 0.01][..]),
        (Kind::Box, &[0.25, 0.01]),
        (Kind::SCurve, &[0.25, 0.25]),
    ] {
        let mut smooth = config(kind, 6.34, 0.022);
        smooth.box_ms = 250.0;
        smooth.smoothing_ms = [40.0, 10.0];
        agrees(&smooth);
        let boxes_s = Prefilter::new(&smooth).unwrap().boxes_s();
        assert_eq!(boxes_s.len(), 2);
        for (found, expected) in boxes_s.iter().zip(lengths_s) {
            assert!((found - expected).abs() < 1e-9, "{kind:?} {boxes_s:?}");
        }
    }
    for (v_tol, kind) in [
        (0.01, Kind::Ei),
        (0.2, Kind::TwoHumpEi),
        (0.1, Kind::ThreeHumpEi),
    ] {
        agrees(&PrefilterConfig {
            v_tol,
            ..config(kind, 6.34, 0.022)
        });
    }
}

#[test]
fn a_second_mode_is_nulled_too() {
    let both = PrefilterConfig {
        second: SecondMode {
            kind: Kind::Zvd,
            frequency_hz: 14.2,
            damping: 0.01,
            axes: AxisSet::ALL,
        },
        ..config(Kind::FirZv, 6.34, 0.022)
    };
    let prefilter = Prefilter::new(&both).unwrap();
    for (frequency_hz, damping) in [(6.34_f32, 0.022_f32), (14.2, 0.01)] {
        let mode = Mode {
            frequency_hz: frequency_hz.into(),
            damping: damping.into(),
        };
        assert!(residual(&prefilter, &mode) < 1e-9);
    }
    let alone = |kind, frequency_hz, damping| {
        Prefilter::new(&config(kind, frequency_hz, damping))
            .unwrap()
            .length_s()
    };
    let sum_s = alone(Kind::FirZv, 6.34, 0.022) + alone(Kind::Zvd, 14.2, 0.01);
    assert!((prefilter.length_s() - sum_s).abs() < 1e-12);
}

#[test]
fn crowded_cascades_have_room_or_are_refused() {
    // with five impulses a mode and two boxes there would be 100 kinks
    let crowded = |kind, second_kind, smoothing_ms| PrefilterConfig {
        impulses: [0.0, 13.0, 29.0, 47.0, 71.0].map(|time_ms| CustomImpulse {
            time_ms,
            weight: 1.0,
        }),
        second: SecondMode {
            kind: second_kind,
            frequency_hz: 31.0,
            damping: 0.0,
            axes: AxisSet::ALL,
        },
        smoothing_ms,
        ..config(kind, 17.0, 0.0)
    };
    for (kind, second_kind, smoothing_ms, room) in [
        (Kind::ThreeHumpEi, Kind::ThreeHumpEi, [0.0, 0.0], true),
        (Kind::Custom, Kind::ThreeHumpEi, [0.0, 0.0], true),
        (Kind::FirZvdd, Kind::FirZvdd, [7.0, 5.0], true),
        (Kind::SCurve, Kind::SCurve, [7.0, 5.0], true),
        (Kind::ThreeHumpEi, Kind::ThreeHumpEi, [7.0, 5.0], false),
        (Kind::FirCustom, Kind::ThreeHumpEi, [7.0, 5.0], false),
        (Kind::Custom, Kind::ThreeHumpEi, [7.0, 5.0], false),
    ] {
        let found = agrees(&crowded(kind, second_kind, smoothing_ms));
        assert_eq!(found, room, "{kind:?} {second_kind:?} {smoothing_ms:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn cascades_are_those_of_the_oracle(
        kind in 0..Kind::ALL.len(), other in 0..Kind::ALL.len(),
        frequency in 7.0_f32..60.0, ratio in 1.1_f32..3.0,
        damping in 0.0_f32..0.1, other_damping in 0.0_f32..0.1,
        smoothing1 in 2.0_f32..60.0, smoothing2 in 2.0_f32..60.0,
        v_tol in 0.02_f32..0.2,
    ) {
        let config = PrefilterConfig {
            second: SecondMode {
                kind: Kind::ALL[other],
                frequency_hz: frequency * ratio,
                damping: other_damping,
                axes: AxisSet::ALL,
            },
            v_tol,
            smoothing_ms: [smoothing1, smoothing2],
            ..config(Kind::ALL[kind], frequency, damping)
        };
        agrees(&config);
    }

    #[test]
    fn the_tick_follows_the_oracle_and_rests_on_the_input(
        kind in 0..Kind::ALL.len(), other in 0..Kind::ALL.len(),
        frequency in 7.0_f32..40.0, damping in 0.0_f32..0.1,
        smoothing1 in 2.0_f32..60.0, start in -1_000_000_i32..1_000_000,
    ) {
        let config = PrefilterConfig {
            second: SecondMode {
                kind: Kind::ALL[other],
                frequency_hz: 1.7 * frequency,
                damping,
                axes: AxisSet::ALL,
            },
            smoothing_ms: [smoothing1, 0.0],
            ..config(Kind::ALL[kind], frequency, damping)
        };
        let prefilter = Prefilter::new(&config).expect("within range");
        let oracle = oracle(&config);
        prop_assume!(has_room(&prefilter, &oracle));
        let kernel = Kernel::new(&prefilter).expect("shorter than a second");
        // a ramp of 160 mm/s in 2^-19 mm, from rest; it stops after 0.3 s
        let rate = 160.0 * TICK_S * f64::from(1 << 19);
        let input = |tick: i32| start + (rate * f64::from(tick.min(300))).round() as i32;
        let mut convolver = Convolver::<1>::new();
        convolver.reset([start]);
        let ramp = |t_s: f64| if t_s > 0.0 { oracle.ramp(t_s) } else { 0.0 };
        let ends = 300 + i32::from(kernel.length_ticks()) + 2;
        for tick in 0..ends + 10 {
            let [output] = convolver.process(&kernel, [input(tick)]);
            if tick >= ends {
                prop_assert_eq!(output, i64::from(input(tick)) << FINE_BITS);
            }
            let found = output as f64 / f64::from(1 << FINE_BITS) - f64::from(start);
            let t_s = f64::from(tick) * TICK_S;
            let exact = rate * f64::from(TICK_HZ) * (ramp(t_s) - ramp(t_s - 0.3));
            // a kink between ticks is seen at ticks: a quarter of a tick's way at the most for
            // each stage
            let bound = rate / 4.0 * (1.0 + prefilter.stages().len() as f64 / 4.0);
            prop_assert!((found - exact).abs() < bound, "{tick}: {found} {exact}");
        }
    }
}

/// Kinds that section 4 has not published.
const MORE: [Kind; 12] = [
    Kind::Mzv,
    Kind::Zvdd,
    Kind::TwoHumpEi,
    Kind::ThreeHumpEi,
    Kind::SCurve,
    Kind::Box,
    Kind::Custom,
    Kind::FirEi,
    Kind::FirMzv,
    Kind::FirZvdd,
    Kind::FirTwoHumpEi,
    Kind::FirThreeHumpEi,
];

static HALF_MM: LazyLock<Vec<Outcome>> = LazyLock::new(|| corner_path(0.5));
static STOPS: LazyLock<Vec<Outcome>> = LazyLock::new(|| corner_path(0.0));

fn corner_path(tolerance_mm: f32) -> Vec<Outcome> {
    let mut settings = RobotSettings::load(None).unwrap();
    settings.robot.corner_tolerance_mm = tolerance_mm;
    settings.robot.prefilter.impulses = config(Kind::Custom, 1.0, 0.0).impulses;
    let scenario = Scenario {
        program: ProgramFile::corner_path(),
        settings,
        plant: PlantKind::Ideal,
        machine: Machine::Host,
    };
    let run = |kind| scenario.run_with(kind, Progress::Hidden).unwrap();
    MORE.map(run).into()
}

fn report(run: &Outcome) -> &Report {
    &run.checked.as_ref().unwrap().1
}

#[test]
fn corners_are_within_the_tolerance_and_stops_exact() {
    for run in &*HALF_MM {
        let (kind, report) = (run.prefilter, report(run));
        for corner in &report.corners {
            assert!(
                (0.4..=0.5).contains(&corner.error_mm),
                "{kind:?} {corner:?}"
            );
        }
        assert!(report.max_path_deviation_mm <= 0.5, "{kind:?}");
        assert_eq!((report.drift_mm, report.drift_deg), (0.0, 0.0));
        assert_eq!(report.corners.len(), 4);
    }
    for run in &*STOPS {
        let (kind, report) = (run.prefilter, report(run));
        assert!(report.max_path_deviation_mm < 1e-3, "{kind:?} {report:?}");
        // half of what 160 mm/s travel in a tick
        let cut_mm = if kind.lets_velocity_jump() {
            0.08
        } else {
            1e-3
        };
        assert!(report.max_corner_error_mm() < cut_mm, "{kind:?} {report:?}");
        assert_eq!((report.drift_mm, report.drift_deg), (0.0, 0.0));
    }
}

/// The figures as a table: any change shows.
#[test]
fn figures_of_more_prefilters() {
    let mut table = String::new();
    for (name, runs) in [("exact stops", &*STOPS), ("0.5 mm", &*HALF_MM)] {
        writeln!(table, "{name}").unwrap();
        writeln!(
            table,
            "{:14}{:>9}{:>10}{:>10}{:>10}",
            "", "cycle s", "corner mm", "path mm", "after"
        )
        .unwrap();
        for run in runs {
            writeln!(
                table,
                "{:14}{:9.3}{:10.4}{:10.4}{:10.2}",
                run.prefilter.name(),
                run.cycle_time_s,
                report(run).max_corner_error_mm(),
                report(run).max_path_deviation_mm,
                run.vibration.residual_max_mm_s2,
            )
            .unwrap();
        }
    }
    insta::assert_snapshot!(table);
}

/// A pure shaper lets the velocity jump; smoothing keeps acceleration and jerk of a straight
/// move at what its boxes say.
#[test]
fn smoothing_bounds_acceleration_and_jerk() {
    let feed_mm_s = 160.0;
    let mut settings = RobotSettings::load(None).unwrap();
    settings.robot.prefilter.smoothing_ms = [50.0, 20.0];
    let scenario = Scenario {
        program: ProgramFile {
            name: "a line".into(),
            text: "G0 X250 Y0\nG1 X250 Y120 F9600\nM2\n".into(),
        },
        settings,
        plant: PlantKind::Ideal,
        machine: Machine::Host,
    };
    for kind in [Kind::None, Kind::Zv, Kind::Ei, Kind::TwoHumpEi] {
        let run = scenario.run_with(kind, Progress::Hidden).unwrap();
        let y: Vec<f64> = run.trace.poses().iter().map(|pose| pose[1]).collect();
        let difference = |list: &[f64]| -> Vec<f64> {
            list.windows(2).map(|p| (p[1] - p[0]) / TICK_S).collect()
        };
        let acceleration = difference(&difference(&y));
        // over 5 ms, as a tick's rounding makes 2^-32 mm a large jerk
        let jerk = acceleration
            .windows(6)
            .map(|w| (w[5] - w[0]) / (5.0 * TICK_S));
        let jerk = jerk.map(f64::abs).fold(0.0, f64::max);
        let acceleration = acceleration
            .iter()
            .copied()
            .map(f64::abs)
            .fold(0.0, f64::max);
        let (most, most_jerk) = (feed_mm_s / 0.05, feed_mm_s / (0.05 * 0.02));
        // poses come in 2^-19 mm
        let rounding = 2.0 / f64::from(1 << 19) / (TICK_S * TICK_S);
        assert!(acceleration < most + rounding, "{kind:?}: {acceleration}");
        let most_jerk = most_jerk + 2.0 * rounding / (5.0 * TICK_S);
        assert!(jerk < most_jerk, "{kind:?}: {jerk} of {most_jerk}");
        // the first impulse alone takes a good part of both
        assert!(
            acceleration > 0.15 * most && jerk > 0.15 * most_jerk,
            "{kind:?}"
        );
    }
}
