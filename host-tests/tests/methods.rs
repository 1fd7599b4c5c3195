//! Stillpoint against other methods: where it wins, and where it does not.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::sync::LazyLock;

use host_tests::machine::Machine;
use host_tests::methods::{Entry, STILL_MM_S2, compare, fastest_fit};
use host_tests::program_file::ProgramFile;
use host_tests::robot_file::RobotSettings;
use host_tests::scenario::Scenario;
use host_tests::trace::PlantKind;

const LINES: [&str; 4] = ["raster", "rectangle", "star", "pick-and-place"];

const TOLERANCE_MM: f64 = 0.5;

static FOUND: LazyLock<BTreeMap<&str, Vec<Entry>>> = LazyLock::new(|| {
    let programs = LINES.into_iter().chain(["corner-path", "slalom"]);
    programs.map(|name| (name, entries(name))).collect()
});

fn entries(name: &str) -> Vec<Entry> {
    let file = format!("programs/{name}.gcode");
    let scenario = Scenario {
        program: ProgramFile::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap(),
        settings: RobotSettings::load(None).unwrap(),
        plant: PlantKind::Ideal,
        machine: Machine::Host,
    };
    compare(&scenario).unwrap()
}

fn of<'a>(name: &str, method: &str) -> &'a Entry {
    let mut all = FOUND[name].iter();
    all.find(|entry| entry.method.starts_with(method)).unwrap()
}

/// Methods that keep the tolerance and leave the tool as still, from the fastest on.
fn fit(name: &str, residual_mm_s2: f64) -> Vec<&Entry> {
    let is_fit = |entry: &&Entry| {
        let figures = &entry.figures;
        figures.corner_error_mm <= TOLERANCE_MM + 1e-3 && figures.residual_mm_s2 <= residual_mm_s2
    };
    let mut fit: Vec<_> = FOUND[name].iter().filter(is_fit).collect();
    fit.sort_by(|a, b| a.figures.cycle_time_s.total_cmp(&b.figures.cycle_time_s));
    fit
}

/// Full stops with a jerk that knows nothing of the mode leave 1000 to 2000 mm/s².
#[test]
fn on_lines_nothing_is_faster_at_equal_tolerance_and_stillness() {
    for name in LINES {
        let fit = fit(name, STILL_MM_S2);
        let fastest = fastest_fit(&FOUND[name], TOLERANCE_MM).unwrap();
        assert_eq!(fit[0].method, fastest.method);
        assert!(fit.len() >= 3, "{name}: {fit:?}");
        assert_eq!(fit[0].method, "Stillpoint, FIR-ZV", "{name}: {fit:?}");
    }
    // It begins with an arc.
    assert_eq!(fit("corner-path", 10.0)[0].method, "Stillpoint, FIR-ZV");
}

#[test]
fn the_published_method_passes_its_tolerance_and_ours_does_not() {
    for name in LINES.into_iter().chain(["corner-path"]) {
        assert!(of(name, "Stillpoint, FIR-ZVD").figures.corner_error_mm <= TOLERANCE_MM);
        let published = of(name, "hybrid").figures.corner_error_mm;
        // The raster's short lines stop each other from using all of it.
        assert!(
            name == "raster" || published > TOLERANCE_MM,
            "{name}: {published}"
        );
    }
}

#[test]
fn neither_adai_nor_printers_keep_a_tolerance_untuned() {
    for name in LINES {
        for method in ["ADAI [Li23], box", "junction velocity, ZVD"] {
            let error_mm = of(name, method).figures.corner_error_mm;
            assert!(error_mm > 3.0 * TOLERANCE_MM, "{name} {method}: {error_mm}");
        }
    }
}

/// An arc's direction is not filtered, its progress is: where an arc begins at full feedrate
/// the acceleration towards its centre sets in at once.
#[test]
fn where_lines_run_into_arcs_shapers_for_each_axis_leave_the_tool_stiller() {
    let ours = of("slalom", "Stillpoint, FIR-ZVD").figures;
    let printers = of("slalom", "junction velocity, tuned").figures;
    assert!(ours.residual_mm_s2 > 100.0 * printers.residual_mm_s2);
    assert!(ours.cycle_time_s < 0.85 * printers.cycle_time_s);
    let fastest = fastest_fit(&FOUND["slalom"], TOLERANCE_MM).unwrap();
    assert!(fastest.method.starts_with("junction velocity, tuned"));
}

/// Any change shows. What depends on the platform's sines is rounded.
#[test]
fn figures_of_every_method() {
    let mut table = String::new();
    for (name, entries) in &*FOUND {
        writeln!(
            table,
            "{name:42}{:>9}{:>10}{:>11}{:>10}",
            "cycle s", "residual", "corner mm", "joints"
        )
        .unwrap();
        for Entry {
            method, figures, ..
        } in entries
        {
            writeln!(
                table,
                "{method:42}{:9.3}{:10.1}{:11.3}{:10.1}",
                figures.cycle_time_s,
                figures.residual_mm_s2,
                figures.corner_error_mm,
                figures.joint_acceleration_rad_s2,
            )
            .unwrap();
        }
    }
    insta::assert_snapshot!(table);
}
