//! Tajima: profiles for a mode that changes along the move, against published values.

use host_tests::commands::profile::SimulatedMove;
use host_tests::oracle::Prefilter as Oracle;
use host_tests::oracle::posture::minimum_amplitude_integral;
use planner_core::posture::{Course, Method, Profile, RawRamp, Reason, Zeros};
use planner_core::prefilter::{Convolver, FINE_BITS, Kernel, Mode, Prefilter};
use planner_core::raw::{ONE_TICK, TickTime, tick_time};

const TICK_S: f64 = 1e-3;

struct Vector {
    length_mm: f64,
    feed_mm_s: f64,
    zeros: Zeros,
    feed_used_mm_s: f64,
    cruise_s: f64,
    total_s: f64,
    time_s: f64,
    state: [f64; 3],
}

/// The published vectors.
fn vectors() -> Vec<Vector> {
    let table = include_str!("published/posture_profile_vectors.csv");
    let mut csv = csv::Reader::from_reader(table.as_bytes());
    csv.deserialize()
        .map(|row: Result<[f64; 13], _>| {
            let [
                length_mm,
                feed_mm_s,
                f1,
                f2,
                f3,
                f4,
                feed,
                cruise_s,
                total_s,
                t,
                x,
                v,
                a,
            ] = row.unwrap();
            Vector {
                length_mm,
                feed_mm_s,
                zeros: Zeros {
                    accelerating_hz: [f1, f2],
                    decelerating_hz: [f3, f4],
                },
                feed_used_mm_s: feed,
                cruise_s,
                total_s,
                time_s: t,
                state: [x, v, a],
            }
        })
        .collect()
}

fn course(start_hz: f64, end_hz: f64, length_mm: f64) -> Course {
    let mode = |frequency_hz| Mode {
        frequency_hz,
        damping: 0.05,
    };
    Course {
        start: mode(start_hz),
        end: mode(end_hz),
        length_mm,
    }
}

#[test]
fn every_published_vector_in_double_precision() {
    let all = vectors();
    assert_eq!(all.len(), 120);
    for vector in all {
        let Vector {
            length_mm,
            feed_mm_s,
            zeros,
            ..
        } = &vector;
        let profile = Profile::new(*length_mm, *feed_mm_s, zeros).unwrap();
        let state = profile.at(vector.time_s);
        // the table gives twelve digits of everything but its times
        let near = |got: f64, want: f64, scale: f64| {
            assert!(
                (got - want).abs() <= 1e-9 * scale,
                "{got}, not {want}: {zeros:?} at {}",
                vector.time_s
            );
        };
        near(profile.feed_mm_s(), vector.feed_used_mm_s, *feed_mm_s);
        near(profile.cruise_s(), vector.cruise_s, 1.0);
        near(profile.total_s(), vector.total_s, 1.0);
        let [x, v, a] = vector.state;
        near(state.position_mm, x, *length_mm);
        near(state.velocity_mm_s, v, *feed_mm_s);
        let [rises, falls] = profile.acceleration_mm_s2();
        near(state.acceleration_mm_s2, a, rises.max(falls));
    }
}

/// The command of the tick, in mm: two raw ramps through one convolver each, moved by their
/// difference. It starts so much before a tick that one falls on `time_s`.
fn in_fixed_point(profile: &Profile, zeros: &Zeros, time_s: f64) -> f64 {
    const BITS_PER_MM: f64 = (1 << 19) as f64;
    let ticks = (time_s / TICK_S).ceil();
    let start_s = ticks * TICK_S - time_s;
    let phase = |prefilter: Prefilter, begins_s: f64| Phase {
        kernel: Kernel::new(&prefilter).unwrap(),
        convolver: Convolver::new(),
        ramp: RawRamp::new(profile.feed_mm_s()),
        begins: tick_time(begins_s),
    };
    let mut phases = [
        phase(zeros.accelerating(), start_s),
        phase(zeros.decelerating(), start_s + profile.stop_s()),
    ];
    let mut moved = 0;
    for tick in 0..=ticks as i64 {
        let [accelerated, decelerated] = phases.each_mut().map(|phase| phase.tick(tick));
        moved = accelerated - decelerated;
    }
    moved as f64 / BITS_PER_MM / f64::from(1 << FINE_BITS)
}

struct Phase {
    kernel: Kernel,
    convolver: Convolver<1>,
    ramp: RawRamp,
    begins: TickTime,
}

impl Phase {
    fn tick(&mut self, tick: i64) -> i64 {
        let moving = tick * ONE_TICK - self.begins;
        let raw = match moving {
            ..=0 => 0,
            1..=ONE_TICK => self.ramp.start(moving),
            _ => self.ramp.step(),
        };
        let [filtered] = self.convolver.process(&self.kernel, [raw]);
        filtered
    }
}

#[test]
fn every_published_vector_in_fixed_point() {
    let mut worst_mm = 0.0_f64;
    for vector in vectors() {
        let profile = Profile::new(vector.length_mm, vector.feed_mm_s, &vector.zeros).unwrap();
        let got_mm = in_fixed_point(&profile, &vector.zeros, vector.time_s);
        worst_mm = worst_mm.max((got_mm - vector.state[0]).abs());
    }
    println!(
        "fixed point, lengths up to 718 mm: {:.4} µm",
        worst_mm * 1e3
    );
    assert!(worst_mm < 2e-5, "{worst_mm} mm");
}

#[test]
fn whole_profiles_in_fixed_point() {
    let mut worst_mm = 0.0_f64;
    for (start_hz, end_hz, feed_mm_s) in [(8.0, 20.0, 50.0), (20.0, 8.0, 50.0), (8.0, 20.0, 250.0)]
    {
        for method in Method::ALL {
            let course = course(start_hz, end_hz, 100.0);
            let zeros = Profile::zeros(&course, feed_mm_s, method).unwrap();
            let profile = Profile::new(100.0, feed_mm_s, &zeros).unwrap();
            for step in 0..=300 {
                let time_s = profile.total_s() * 1.05 * f64::from(step) / 300.0;
                let exact_mm = profile.at(time_s).position_mm;
                let got_mm = in_fixed_point(&profile, &zeros, time_s);
                worst_mm = worst_mm.max((got_mm - exact_mm).abs());
            }
        }
    }
    println!("fixed point, 100 mm: {:.4} µm", worst_mm * 1e3);
    assert!(worst_mm < 2e-5, "{worst_mm} mm");
}

#[test]
fn profiles_are_the_filtered_raw_path_of_section_2() {
    for (start_hz, end_hz, length_mm, feed_mm_s) in [
        (8.0, 20.0, 100.0, 50.0),
        (20.0, 8.0, 100.0, 400.0),
        (3.0, 40.0, 3.0, 50.0),
    ] {
        for method in Method::ALL {
            let course = course(start_hz, end_hz, length_mm);
            let zeros = Profile::zeros(&course, feed_mm_s, method).unwrap();
            let profile = Profile::new(length_mm, feed_mm_s, &zeros).unwrap();
            let boxes = |zeros: [f64; 2]| Oracle::new(&[(0.0, 1.0)], &zeros.map(|f| 1.0 / f));
            let (a, d) = (boxes(zeros.accelerating_hz), boxes(zeros.decelerating_hz));
            let feed = profile.feed_mm_s();
            let stop_s = length_mm / feed + a.centroid_s() - d.centroid_s();
            assert!((stop_s - profile.stop_s()).abs() < 1e-12);
            for step in 0..=500 {
                let t = profile.total_s() * f64::from(step) / 500.0;
                let state = profile.at(t);
                let moved = feed * (a.ramp(t) - d.ramp(t - stop_s));
                let velocity = feed * (a.step(t) - d.step(t - stop_s));
                assert!((state.position_mm - moved).abs() < 1e-11 * length_mm.max(feed));
                assert!((state.velocity_mm_s - velocity).abs() < 1e-10 * feed);
            }
        }
    }
}

#[test]
fn the_closed_form_of_method_b_is_the_direct_minimum() {
    let mut worst = [0.0_f64; 2];
    for percent in -30..=40 {
        let rho = f64::from(percent) / 100.0;
        if rho == 0.0 {
            continue;
        }
        // f0 = 10 Hz, g = 1 Hz a millimetre: ρ = gF/f0²
        let length_mm = 1000.0;
        let rise_hz = length_mm * rho.signum();
        let course = Course {
            end: Mode {
                frequency_hz: 10.0 + rise_hz,
                damping: 0.0,
            },
            ..course(10.0, 10.0, length_mm)
        };
        let zeros = Zeros::new(&course, 100.0 * rho.abs(), Method::B);
        let mut closed_hz = zeros.accelerating_hz;
        closed_hz.sort_by(f64::total_cmp);
        let direct = minimum_amplitude_integral(rho).unwrap();
        for (closed_hz, direct) in closed_hz.into_iter().zip(direct) {
            let off = (closed_hz / (10.0 * direct) - 1.0).abs();
            worst[0] = worst[0].max(off);
            if rho >= -0.25 {
                worst[1] = worst[1].max(off);
            }
        }
    }
    println!("zeros against the direct minimum: {worst:?}");
    assert!(worst[0] <= 4e-3, "{worst:?}");
    assert!(worst[1] <= 1.5e-3, "{worst:?}");
}

#[test]
fn the_table_of_overshoot_and_settling() {
    // (accelerating, decelerating): overshoot in % of the feedrate, settling in s
    let up = [
        (Method::Fir, (2.149, 0.936), (0.395, 0.203)),
        (Method::A, (0.645, 0.603), (0.230, 0.130)),
        (Method::B, (0.460, 0.526), (0.246, 0.132)),
        (Method::Hybrid, (0.460, 0.526), (0.230, 0.130)),
    ];
    let down = [
        (Method::Fir, (0.450, 0.242), (3.855, 1.453)),
        (Method::A, (0.293, 0.157), (0.289, 0.475)),
        (Method::B, (0.272, 0.156), (0.710, 0.794)),
        (Method::Hybrid, (0.272, 0.156), (0.289, 0.475)),
    ];
    for (table, start_hz, end_hz) in [(up, 8.0, 20.0), (down, 20.0, 8.0)] {
        for (method, accelerating, decelerating) in table {
            let course = course(start_hz, end_hz, 100.0);
            let answer = SimulatedMove::new(course, 50.0, method).unwrap().answer;
            let got = [
                answer.overshoot_accelerating_percent,
                answer.settling_accelerating_s.unwrap(),
                answer.overshoot_decelerating_percent,
                answer.settling_decelerating_s.unwrap(),
            ];
            println!("{start_hz} to {end_hz} Hz, {method:?}: {got:.4?}");
            let published = [
                accelerating.0,
                accelerating.1,
                decelerating.0,
                decelerating.1,
            ];
            for ((got, published), allowed) in
                got.into_iter().zip(published).zip([2e-3, 1e-3, 2e-3, 1e-3])
            {
                assert!(
                    (got - published).abs() <= allowed,
                    "{method:?}: {got}, not {published}"
                );
            }
        }
    }
}

#[test]
fn a_short_move_is_better_with_method_a_and_gets_it() {
    for length_mm in [0.5, 2.0, 5.0] {
        let course = course(8.0, 20.0, length_mm);
        let left = |method| {
            let simulated = SimulatedMove::new(course, 50.0, method).unwrap();
            assert_eq!(simulated.profile.cruise_s(), 0.0);
            simulated.answer.residual_percent
        };
        let (a, hybrid) = (left(Method::A), left(Method::Hybrid));
        println!("{length_mm} mm: A {a:.3} %, hybrid {hybrid:.3} %");
        assert!(
            (a - 1.2).abs() < 0.05 && (hybrid - 6.0).abs() < 0.1,
            "{a} {hybrid}"
        );
        let choice = Method::choose(&course, 50.0).unwrap();
        assert_eq!((choice.method, choice.reason), (Method::A, Reason::Short));
    }
}

#[test]
fn the_method_chosen_is_never_much_worse_than_the_other() {
    // what is left after the end, and how far the acceleration passes the feedrate
    for (start_hz, end_hz) in [(8.0, 20.0), (20.0, 8.0), (8.0, 10.0), (12.0, 10.0)] {
        for feed_mm_s in [20.0, 50.0, 100.0, 200.0, 300.0] {
            for length_mm in [3.0, 10.0, 30.0, 100.0, 300.0] {
                let course = course(start_hz, end_hz, length_mm);
                let answer = |method| {
                    SimulatedMove::new(course, feed_mm_s, method)
                        .unwrap()
                        .answer
                };
                let choice = Method::choose(&course, feed_mm_s).unwrap();
                let (chosen, a) = (answer(choice.method), answer(Method::A));
                let case = format!("{start_hz} to {end_hz} Hz, {length_mm} mm, {feed_mm_s} mm/s");
                let (left, left_by_a) = (chosen.residual_percent, a.residual_percent);
                assert!(
                    left <= left_by_a * 1.1 + 0.02,
                    "{case}: {left} against {left_by_a} %"
                );
                let passed = chosen.overshoot_accelerating_percent;
                let passed_by_a = a.overshoot_accelerating_percent;
                assert!(
                    passed <= passed_by_a + 0.02,
                    "{case}: {passed} against {passed_by_a} %"
                );
            }
        }
    }
}
