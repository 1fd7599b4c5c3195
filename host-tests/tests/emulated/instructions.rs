//! What the core costs on the Cortex-M4F, in instructions counted by the emulator.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use crate::support::{images, installed};
use host_tests::emulator::measure_instructions;
use planner_core::corner::CornerRule;
use planner_core::orientation::Orientation;
use planner_core::overlap::{Method, Move, Segment, SpeedCurve, ToolPose, plan};

/// What the bits of a motion that turns come to on this machine; the image does the same.
fn bits_of_a_turning_tool() -> u32 {
    let pose = |x: f64, y: f64, angle_deg: f64| ToolPose {
        position_mm: [x, y, 0.0],
        orientation: Orientation::new(angle_deg, 20.0, -angle_deg),
    };
    let points = [
        pose(0.0, 0.0, 10.0),
        pose(50.0, 0.0, 30.0),
        pose(50.0, 50.0, -15.0),
    ];
    let mut moves: Vec<_> = points
        .windows(2)
        .map(|pair| Segment::new(&pair[0], &pair[1], 150.0, 500.0).unwrap())
        .map(|segment| Move::new(segment, CornerRule::ToleranceMm(1.0)))
        .collect();
    let curve = SpeedCurve::s_curve(0.125).unwrap();
    let plan = plan(curve, Method::ClosedForm, &mut moves);
    let mut bits = 0_u32;
    for k in 0..100 {
        let state = plan.at(plan.cycle_s() * f64::from(k) / 100.0);
        let orientation = state.pose.orientation;
        for value in [
            state.pose.position_mm[1],
            state.acceleration_mm_s2[0],
            orientation.a_deg,
            orientation.b_deg,
            orientation.c_deg,
            state.euler_rates.a_deg_s,
        ] {
            let value = value.to_bits();
            bits = (bits ^ value as u32 ^ (value >> 32) as u32).rotate_left(5);
        }
    }
    bits
}

/// The counts, measured once.
fn counts() -> Option<&'static BTreeMap<String, u64>> {
    static COUNTS: OnceLock<Option<BTreeMap<String, u64>>> = OnceLock::new();
    COUNTS
        .get_or_init(|| installed(measure_instructions(&images()?[1])))
        .as_ref()
}

#[test]
fn the_counter_counts() {
    let Some(counts) = counts() else { return };
    assert!(counts["nothing"] <= 1, "{counts:?}");
    // A round is a whole number of instructions, however it is compiled, so that
    // thousands of them show a miscount.
    let per_2000 = counts["three-thousand-rounds"] - counts["thousand-rounds"];
    let (rounds, rest) = ((per_2000 + 1000) / 2000, (per_2000 + 1000) % 2000);
    assert!((2..20).contains(&rounds), "{counts:?}");
    assert!(rest.abs_diff(1000) <= 2, "{counts:?}");
}

#[test]
fn the_tick_stays_below_2000_instructions_on_the_corner_path() {
    let Some(counts) = counts() else { return };
    for filter in [
        "fir-zvd",
        "fir-zvd-0.1s",
        "fir-zvd-1s",
        "ei",
        "s-curve",
        "at-63",
        "at-137",
    ] {
        let tick = counts[&format!("tick/corner-path/{filter}")];
        assert!((500..=2000).contains(&tick), "{filter}: {tick}");
    }
}

#[test]
fn the_tick_costs_the_same_whatever_the_filters_length_and_the_segments() {
    let Some(counts) = counts() else { return };
    for program in ["corner-path", "arcs", "half-millimetres"] {
        let short = counts[&format!("tick/{program}/fir-zvd-0.1s")];
        let long = counts[&format!("tick/{program}/fir-zvd-1s")];
        // 1.05 times, in whole numbers
        assert!(long * 20 <= short * 21, "{program}: {short}, {long}");
    }
    let corner_path = counts["tick/corner-path/fir-zvd"];
    let half_millimetres = counts["tick/half-millimetres/fir-zvd"];
    assert!(half_millimetres * 20 <= corner_path * 21);
    // two arcs in flight all the time
    for filter in ["fir-zvd", "fir-zvd-0.1s", "fir-zvd-1s", "at-63", "at-137"] {
        let tick = counts[&format!("tick/arcs/{filter}")];
        println!("arcs, {filter}: {tick}");
        assert!((500..=2300).contains(&tick), "{filter}: {tick}");
    }
}

/// Two filters of three stages each while the prefilter changes, and the kernels' way between
/// planner and tick.
#[test]
fn the_tick_stays_below_2500_instructions_while_the_prefilter_changes() {
    let Some(counts) = counts() else { return };
    for program in ["corner-path", "arcs", "half-millimetres"] {
        for filter in ["map-fir-zvd", "map-ei"] {
            let tick = counts[&format!("tick/{program}/{filter}")];
            println!("{program}, {filter}: {tick}");
            assert!((500..=2500).contains(&tick), "{program}, {filter}: {tick}");
        }
    }
}

/// Bounds for three arms along a way cost more than a SCARA's.
#[test]
fn limits_cost_a_line_a_millisecond() {
    let Some(counts) = counts() else { return };
    for robot in ["scara", "delta"] {
        for program in ["lines", "arcs"] {
            let [free, limited] = ["free", "limited"]
                .map(|limits| counts[&format!("line/{robot}-{program}/{limits}")]);
            println!("{robot}, {program}: {free} without limits, {limited} with them");
            assert!(
                (50_000..190_000).contains(&limited),
                "{robot}, {program}: {limited}"
            );
        }
    }
    let [free, limited] =
        ["free", "limited"].map(|limits| counts[&format!("line/delta-hop/{limits}")]);
    println!("a hop: {free} without limits, {limited} with them");
    assert!((1_000_000..7_500_000).contains(&limited), "{limited}");
}

/// Such a line is a move that lasts longer than its prefilter, 0.1 s and more.
#[test]
fn a_line_that_changes_the_prefilter_is_planned_within_three_milliseconds() {
    let Some(counts) = counts() else { return };
    for (name, count) in counts {
        if name.starts_with("changing-line/") {
            println!("{name}: {count}");
            assert!(count * 1000 <= 3 * INSTRUCTIONS_S, "{name}: {count}");
        }
    }
}

#[test]
fn a_deltas_tick_stays_below_2500_instructions() {
    let Some(counts) = counts() else { return };
    // on lines, with two arcs in flight all the time, and in a hop
    for case in ["delta", "delta-arcs", "delta-arcs-0.1s", "delta-hop"] {
        let tick = counts[&format!("tick/{case}")];
        println!("{case}: {tick}");
        assert!((1000..=2500).contains(&tick), "{case}: {tick}");
    }
    assert!((300..=1200).contains(&counts["joint-state/delta"]));
    assert!((200..=1200).contains(&counts["forward/delta"]));
}

#[test]
fn a_corner_stays_below_60_000_instructions() {
    let Some(counts) = counts() else { return };
    for (name, count) in counts {
        if name.starts_with("corner/") {
            // the longest cascades of impulses with a box cost more where arcs meet
            let most = match name.as_str() {
                "corner/fir-ei" | "corner/fir-mzv" | "corner/fir-3hump-ei" => 70_000,
                _ => 60_000,
            };
            println!("{name}: {count}");
            assert!((100..=most).contains(count), "{name}: {count}");
        }
    }
}

#[test]
fn a_line_is_read_below_6000_instructions() {
    let Some(counts) = counts() else { return };
    for name in ["gcode/line", "gcode/feed"] {
        let count = counts[name];
        assert!((1000..=6000).contains(&count), "{name}: {count}");
    }
    // the geometry in f64, in software
    assert!(counts["gcode/arc"] <= 20_000, "{counts:?}");
}

#[test]
fn a_second_is_identified_within_2_million_instructions() {
    let Some(counts) = counts() else { return };
    println!("{} and {}", counts["identify/1s"], counts["identify/2s"]);
    assert!(
        (200_000..=2_000_000).contains(&counts["identify/1s"]),
        "{counts:?}"
    );
    assert!(counts["identify/2s"] <= 6_000_000, "{counts:?}");
}

/// 170 MHz, up to 1.5 cycles an instruction.
const INSTRUCTIONS_S: u64 = 113_000_000;

#[test]
fn a_link_carries_a_thousand_lines_a_second_beside_the_tick_and_the_status() {
    let Some(counts) = counts() else { return };
    let ticks = 1000 * counts["tick/half-millimetres/fir-zvd"];
    let reports = 10 * counts["link/status"];
    let line = counts["link/line"];
    let lines_s = (INSTRUCTIONS_S - ticks - reports) / line;
    println!("{lines_s} lines a second, {line} instructions each, ten reports {reports}");
    assert!(lines_s >= 1000, "{lines_s}");
    assert!((5000..=100_000).contains(&line), "{line}");
    // Ten reports a second take less than a thousandth of the time.
    assert!(reports * 100 <= INSTRUCTIONS_S, "{reports}");
}

/// 170 MHz at 1.35 cycles an instruction, the middle of what a Cortex-M4 takes.
const USUAL_INSTRUCTIONS_S: u64 = 125_900_000;

/// Planning runs beside the tick, a thousand times a second. A program's mean is what it can
/// sustain: the look-ahead of 64 segments evens out the dearest line.
#[test]
fn planning_stays_ahead_at_a_thousand_segments_a_second() {
    let Some(counts) = counts() else { return };
    let programs = [
        "corner-path",
        "arcs",
        "half-millimetres",
        "fifth-millimetres",
    ];
    println!(
        "{:18}{:14}{:>9}{:>9}{:>10}{:>10}",
        "", "", "mean", "worst", "mean/s", "worst/s"
    );
    for program in programs {
        for filter in ["fir-zvd", "fir-zvd-0.1s", "fir-zvd-1s", "ei", "s-curve"] {
            let of = |what: &str| counts[&format!("{what}/{program}/{filter}")];
            let free = USUAL_INSTRUCTIONS_S - 1000 * of("tick");
            let (mean, worst) = (of("line-mean"), of("line"));
            println!(
                "{program:18}{filter:14}{mean:9}{worst:9}{:10}{:10}",
                free / mean,
                free / worst
            );
            assert!(free / mean >= 1000, "{program}, {filter}: {mean}");
            // two periods of a thousandth: the look-ahead has room for that
            assert!(
                worst * 500 <= INSTRUCTIONS_S,
                "{program}, {filter}: {worst}"
            );
            assert!(
                (1000..=worst).contains(&mean),
                "{program}, {filter}: {mean}"
            );
        }
    }
}

#[test]
fn a_tool_that_moves_and_turns_has_the_same_bits() {
    let Some(counts) = counts() else { return };
    assert_eq!(counts["overlap/bits"], u64::from(bits_of_a_turning_tool()));
}

#[test]
fn a_tool_that_moves_and_turns_costs_what_its_documentation_says() {
    let Some(counts) = counts() else { return };
    for (name, most) in [
        ("overlap/segment", 60_000),
        ("overlap/corner-closed-form", 20_000),
        ("overlap/corner-exact", 100_000),
        ("overlap/instant", 80_000),
    ] {
        let count = counts[name];
        println!("{name} {count}");
        assert!((100..=most).contains(&count), "{name}: {count}");
    }
}
