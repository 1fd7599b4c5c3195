//! `run`, `compare` and no command at all: figures and files.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use super::{corner_path, json, near, number, programs, stillpoint};

#[test]
fn without_arguments_it_tells_and_draws() {
    let here = TempDir::new().unwrap();
    let output = stillpoint(&[]).current_dir(&here).output().unwrap();
    assert!(output.status.success());
    let said = String::from_utf8(output.stdout).unwrap();
    for part in ["91 % lower", "stillpoint-out", "path.svg", "missed by 0.49"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    for file in [
        "trace.csv",
        "summary.json",
        "path.svg",
        "feedrate.svg",
        "vibration.svg",
    ] {
        assert!(
            here.path().join("stillpoint-out").join(file).is_file(),
            "{file}"
        );
    }
}

#[test]
fn run_writes_a_trace_that_agrees_with_its_summary() {
    let out = TempDir::new().unwrap();
    let directory = out.path().join("deeper/still");
    let args = [
        "run",
        &corner_path(),
        "--json",
        "--out",
        directory.to_str().unwrap(),
    ];
    let printed = json(&args);
    let written = fs::read(directory.join("summary.json")).unwrap();
    let summary: Value = serde_json::from_slice(&written).unwrap();
    assert_eq!(printed, summary);
    assert_eq!(summary["prefilter"], "fir-zvd");
    assert_eq!(summary["on"], "host");
    assert_eq!(summary["tick_instructions_max"], Value::Null);
    near(&summary, "cycle_time_s", 3.988, 2e-3);
    near(&summary, "settling_time_s", 0.0, 0.05);
    near(&summary, "max_corner_error_mm", 0.4995, 5e-4);
    near(&summary, "max_path_deviation_mm", 0.455, 5e-3);
    near(&summary, "vibration_max_ratio", 0.09, 0.01);

    let mut csv = csv::Reader::from_path(directory.join("trace.csv")).unwrap();
    let header: Vec<_> = csv.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(
        header[..12].join(","),
        "time_s,x_mm,y_mm,z_mm,c_deg,joint1,joint2,joint3,joint4,tool_x_mm,tool_y_mm,tool_z_mm"
    );
    let rows: Vec<Vec<f64>> = csv
        .records()
        .map(|row| {
            row.unwrap()
                .iter()
                .map(|field| field.parse().unwrap())
                .collect()
        })
        .collect();
    let first = &rows[0];
    let last = &rows[rows.len() - 1];
    assert_eq!(first[1..5], [180.0, 0.0, 0.0, 0.0]);
    assert_eq!(last[1..5], [270.0, 0.0, 0.0, 0.0]);
    let stop = rows
        .iter()
        .rposition(|row| row[1..5] != last[1..5])
        .unwrap()
        + 1;
    let cycle = number(&summary, "cycle_time_s");
    assert!((rows[stop][0] - cycle).abs() < 5e-3);
    assert!(last[0] - rows[stop][0] >= 2.999);
    // One row a millisecond; fixed-point values exactly, joints that lead to the pose.
    for (k, row) in rows.iter().enumerate() {
        assert!((row[0] - k as f64 * 1e-3).abs() < 1e-9);
        for value in &row[1..5] {
            assert_eq!((value * 2_f64.powi(19)).fract(), 0.0);
        }
        for joint in [5, 6, 8] {
            assert_eq!((row[joint] * 2_f64.powi(26)).fract(), 0.0);
        }
        let (q1, q12) = (row[5], row[5] + row[6]);
        let x = 200.0 * q1.cos() + 150.0 * q12.cos();
        let y = 200.0 * q1.sin() + 150.0 * q12.sin();
        assert!((x - row[1]).hypot(y - row[2]) < 1e-4);
    }
    // The vibration is that of the trace, and the tool is where the summary says.
    let magnitude = |row: &Vec<f64>| (row[12].powi(2) + row[13].powi(2) + row[14].powi(2)).sqrt();
    let max = rows.iter().map(magnitude).fold(0.0, f64::max);
    near(&summary, "vibration_max_mm_s2", max, 1e-2);
    let square: f64 = rows.iter().map(|row| magnitude(row).powi(2)).sum();
    near(
        &summary,
        "vibration_rms_mm_s2",
        (square / rows.len() as f64).sqrt(),
        1e-2,
    );
    let away = |row: &Vec<f64>| (row[9] - 270.0).hypot(row[10]) > 0.05;
    assert!(rows.iter().rposition(away).unwrap() < stop);
    for picture in ["path.svg", "feedrate.svg", "vibration.svg"] {
        let text = fs::read_to_string(directory.join(picture)).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        assert!(text.contains("corner-path.gcode"), "{picture}");
    }
}

#[test]
fn flags_override_the_robot_file() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(
        &robot,
        "[prefilter]\nname = 'zv'\nfrequency_hz = 5\n[motion]\ncorner_tolerance_mm = 0.2\n\
         [plant]\nmode_frequency_hz = 5",
    )
    .unwrap();
    let robot = robot.to_str().unwrap();
    let path = corner_path();
    let filed = json(&["run", &path, "--robot", robot, "--json"]);
    assert_eq!(filed["prefilter"], "zv");
    near(&filed, "frequency_hz", 5.0, 0.0);
    near(&filed, "tolerance_mm", 0.2, 1e-6);
    let flags = [
        "run",
        &path,
        "--robot",
        robot,
        "--prefilter",
        "zvd",
        "--frequency",
        "7",
        "--damping",
        "0.05",
        "--tolerance",
        "0",
        "--plant",
        "ideal",
        "--on",
        "host",
        "--json",
    ];
    let flagged = json(&flags);
    assert_eq!(flagged["prefilter"], "zvd");
    assert_eq!(flagged["plant"], "ideal");
    near(&flagged, "frequency_hz", 7.0, 0.0);
    near(&flagged, "damping", 0.05, 1e-6);
    near(&flagged, "tolerance_mm", 0.0, 0.0);
    // Made for 7 Hz, the robot swings at 5: worse than made for 5.
    assert!(
        number(&flagged, "vibration_residual_ratio") > number(&filed, "vibration_residual_ratio")
    );
}

#[test]
fn compare_shows_all_prefilters() {
    let compared = json(&["compare", &corner_path(), "--tolerance", "0.5", "--json"]);
    let rows = compared["prefilters"].as_array().unwrap();
    let names: Vec<_> = rows
        .iter()
        .map(|row| row["prefilter"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        [
            "none",
            "zv",
            "zvd",
            "ei",
            "fir",
            "fir-zv",
            "fir-zvd",
            "mzv",
            "zvdd",
            "2hump-ei",
            "3hump-ei",
            "s-curve",
            "box",
            "fir-ei",
            "fir-mzv",
            "fir-zvdd",
            "fir-2hump-ei",
            "fir-3hump-ei"
        ]
    );
    for row in rows {
        assert_eq!(row["refused"], Value::Null);
        for key in [
            "cycle_time_s",
            "settling_time_s",
            "max_corner_error_mm",
            "vibration_motion_max_mm_s2",
            "vibration_motion_rms_mm_s2",
            "vibration_residual_max_mm_s2",
            "vibration_residual_rms_mm_s2",
            "joint1_peak_rad_s2",
            "joint2_peak_rad_s2",
            "vibration_max_ratio",
        ] {
            assert!(number(row, key) >= 0.0, "{key}");
        }
    }
    let output = stillpoint(&["compare", &corner_path()]).output().unwrap();
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success());
    assert!(
        names
            .iter()
            .all(|name| table.contains(&format!(" {name} "))),
        "{table}"
    );
    // A prefilter that is too long is named, the others are shown.
    let slow = json(&["compare", &corner_path(), "--frequency", "1.6", "--json"]);
    let last = &slow["prefilters"][6];
    assert!(
        last["refused"]
            .as_str()
            .unwrap()
            .contains("choose a shorter prefilter")
    );
    assert!(number(&slow["prefilters"][5], "cycle_time_s") > 4.0);
}

#[test]
fn a_program_that_the_checker_cannot_read_runs_without_its_figures() {
    let here = TempDir::new().unwrap();
    let program = here.path().join("radius.gcode");
    fs::write(&program, "G0 X250 Y0\nG3 X250 Y50 R30 F6000\nM2\n").unwrap();
    let output = stillpoint(&["run", program.to_str().unwrap(), "--json"])
        .output()
        .unwrap();
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("the checker cannot judge this program (line 2: "),
        "{said}"
    );
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["max_path_deviation_mm"], Value::Null);
    assert!(number(&summary, "cycle_time_s") > 0.5);
}

#[test]
fn help_and_version_work() {
    for args in [&["--help"][..], &["run", "--help"], &["--version"]] {
        stillpoint(args).assert().success();
    }
}

#[test]
fn comparisons_draw_speed_acceleration_and_jerk() {
    let here = TempDir::new().unwrap();
    let out = here.path().to_str().unwrap();
    let program = programs().join("rectangle.gcode").display().to_string();
    for (command, rows, name) in [
        ("methods", "methods", "methods.svg"),
        ("compare", "prefilters", "prefilters.svg"),
    ] {
        let compared = json(&[command, &program, "--out", out, "--json"]);
        let rows = compared[rows].as_array().unwrap().len();
        assert!(rows > 5);
        let picture = fs::read_to_string(here.path().join(name)).unwrap();
        for what in ["speed", "acceleration", "jerk"] {
            let panels = picture.matches(&format!("{what}\n")).count();
            assert_eq!(panels, rows, "{name}: {what}");
        }
    }
}

#[test]
fn a_comparison_draws_the_limits_that_are_set() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(
        &robot,
        "limits.joint1.velocity_deg_s = 60\n\
         limits.path = { velocity_mm_s = 120, acceleration_mm_s2 = 1000 }",
    )
    .unwrap();
    let arguments = [
        "compare",
        &programs().join("rectangle.gcode").display().to_string(),
        "--robot",
        robot.to_str().unwrap(),
        "--out",
        here.path().to_str().unwrap(),
        "--json",
    ];
    let compared = json(&arguments);
    let rows = compared["prefilters"].as_array().unwrap().len();
    let picture = fs::read_to_string(here.path().join("prefilters.svg")).unwrap();
    let used = picture
        .matches("used of a limit of joints or axes\n")
        .count();
    assert_eq!(used, rows);
    // at the limits of velocity and acceleration, and at 100 % of the joint's; none of a jerk
    let lines = picture
        .split("<text")
        .map(|part| part.matches("#009E73").count());
    assert_eq!(lines.filter(|count| *count > 10).count(), 3 * rows);
}

#[test]
fn programs_with_hops_are_checked() {
    let here = TempDir::new().unwrap();
    let program = here.path().join("hops.gcode");
    fs::write(
        &program,
        "G0 X-200 Y0 Z-760\nG1 Y60 F9000\nX-350\nM3\nM103 X350 Y0\nM5\nG1 X300 Y40\nX350\nM103 Y0 P0.1\n",
    )
    .unwrap();
    let robot = programs().join("../robots/delta-800-payload.toml");
    let robot = robot.to_str().unwrap();
    let run = |program: &str| json(&["run", program, "--robot", robot, "--json"]);
    let summary = run(program.to_str().unwrap());
    assert!((4.9..=5.0).contains(&number(&summary, "max_corner_error_mm")));
    assert!((3.0..=4.0).contains(&number(&summary, "max_path_deviation_mm")));
    assert!((0.3..=0.5).contains(&number(&summary, "vertical_deviation_max_mm")));
    // a hop alone has no path that could be left
    let alone = programs().join("hop.gcode");
    let summary = run(alone.to_str().unwrap());
    assert!((0.3..=0.5).contains(&number(&summary, "vertical_deviation_max_mm")));
    assert_eq!(summary["max_path_deviation_mm"], Value::Null);
}

#[test]
fn run_says_what_limits_do_and_draws_them() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(
        &robot,
        "limits.joint2.acceleration_deg_s2 = 400\nlimits.path.jerk_mm_s3 = 20000",
    )
    .unwrap();
    let out = here.path().join("out");
    let summary = json(&[
        "run",
        &corner_path(),
        "--robot",
        robot.to_str().unwrap(),
        "--json",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(out.join("limits.svg").is_file());
    // FIR-ZVD has one box, and a jerk needs two
    assert_eq!(summary["added_boxes_s"].as_array().unwrap().len(), 1);
    let limits = summary["limits"].as_array().unwrap();
    assert_eq!(limits.len(), 2);
    assert_eq!(limits[0]["limit"], "joint 2 acceleration");
    assert!(limits[0]["lowered_segments"].as_u64().unwrap() > 0);
    for limit in limits {
        let largest = limit["largest"].as_f64().unwrap();
        assert!(
            largest <= limit["allowed"].as_f64().unwrap() * 1.001,
            "{limit}"
        );
    }
}

#[test]
fn run_says_which_prefilters_are_chosen_and_why() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(
        &robot,
        "prefilter = { automatic = true, uncertainty = 0.1, residual_limit = 0.05 }",
    )
    .unwrap();
    let arguments = ["run", &corner_path(), "--robot", robot.to_str().unwrap()];
    let output = stillpoint(&arguments).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let summary = json(&[arguments.as_slice(), &["--json"]].concat());
    let chosen = summary["prefilters_chosen"].as_array().unwrap();
    assert_eq!(chosen.len(), 1, "{chosen:?}");
    assert_eq!(chosen[0]["moves"], 5);
    let name = chosen[0]["prefilter"].as_str().unwrap();
    let line = format!("5 moves: {name} for 6.34 Hz; leaves ");
    assert!(text.contains(&line), "{line}: {text}");
    let reason = &chosen[0]["reason"];
    assert!((0.005..=0.0501).contains(&number(reason, "worst_residual")));
    assert!((0.1..=0.3).contains(&number(reason, "reach")));
}

#[test]
fn run_says_which_modes_act_on_which_axes() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(
        &robot,
        "prefilter.axes = 'x'\nprefilter.mode2 = { name = 'zv', frequency_hz = 9, axes = 'y' }",
    )
    .unwrap();
    let arguments = ["run", &corner_path(), "--robot", robot.to_str().unwrap()];
    let output = stillpoint(&arguments).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for line in [
        "first mode             fir-zvd for 6.34 Hz, damping 0.022, on moves along x",
        "second mode            zv for 9 Hz, damping 0, on moves along y",
        "along z alone          no prefilter",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    assert!(!text.contains("along x alone") && !text.contains("along y alone"));
    let summary = json(&[arguments.as_slice(), &["--json"]].concat());
    assert_eq!(summary["modes"][1]["axes"], "y");
    // each of the path's lines goes along both, so does its arc
    assert!((0.4..0.51).contains(&number(&summary, "max_corner_error_mm")));
}

#[test]
fn a_delta_runs_its_pick_and_place() {
    let out = TempDir::new().unwrap();
    let robot = programs().join("../robots/delta-800.toml");
    let program = programs().join("delta-pick-and-place.gcode");
    let summary = json(&[
        "run",
        program.to_str().unwrap(),
        "--robot",
        robot.to_str().unwrap(),
        "--json",
        "--out",
        out.path().to_str().unwrap(),
    ]);
    assert!((4.0..=5.0).contains(&number(&summary, "max_corner_error_mm")));
    near(&summary, "settling_time_s", 0.0, 0.05);
    assert!(number(&summary, "vibration_residual_ratio") < 0.02);
    assert!(number(&summary, "joint3_peak_rad_s2") > 1.0);
    assert_eq!(summary["joint3_peak_mm_s2"], Value::Null);
    // Seen from the side, because it goes up and across.
    let path = fs::read_to_string(out.path().join("path.svg")).unwrap();
    assert!(path.contains("Z, mm") && !path.contains("Y, mm"));
    for file in ["trace.csv", "feedrate.svg", "vibration.svg"] {
        assert!(out.path().join(file).is_file(), "{file}");
    }
}
