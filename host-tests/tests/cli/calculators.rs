//! `corner`, `prefilter`, `profile`, `overlap`, `inverse` and `forward`: keys and values.

use serde_json::Value;

use super::{json, keys, near, number, programs, refusal, stillpoint};

#[test]
fn corner_has_the_keys_and_values_of_the_published_table() {
    let table = include_str!("../published/corner_tables.csv");
    let mut csv = csv::Reader::from_reader(table.as_bytes());
    let columns: Vec<_> = csv.headers().unwrap().iter().map(str::to_owned).collect();
    let column = |name: &str| columns.iter().position(|c| c == name).unwrap();
    let mut rows = 0;
    for row in csv.records().map(Result::unwrap) {
        let field = |name: &str| row[column(name)].to_owned();
        let args = [
            "corner",
            "--prefilter",
            &field("prefilter"),
            "--frequency",
            "6.34",
            "--damping",
            "0.022",
            "--feed",
            "160",
            "--angle",
            &field("change_angle_deg"),
            "--tolerance",
            &field("corner_tolerance_mm"),
            "--json",
        ];
        let found = json(&args);
        assert_eq!(
            keys(&found),
            ["e_c_mm", "t_c_s", "t_d_s", "t_dec1_s", "t_m_s"]
        );
        for key in ["t_dec1_s", "t_m_s", "t_c_s", "t_d_s"] {
            let exact = field(&format!("exact_{key}")).parse().unwrap();
            near(&found, key, exact, 20e-6);
        }
        let tolerance: f64 = field("corner_tolerance_mm").parse().unwrap();
        assert!(number(&found, "e_c_mm") <= tolerance);
        rows += 1;
    }
    assert!(rows >= 20);
}

#[test]
fn prefilter_gives_length_residual_and_band() {
    let fir_zvd = [
        "prefilter",
        "--prefilter",
        "fir-zvd",
        "--damping",
        "0.1",
        "--json",
    ];
    let at = |model: &str, actual: &str| {
        let mut args = fir_zvd.to_vec();
        args.extend(["--frequency", model, "--actual-frequency", actual]);
        json(&args)
    };
    let found = at("1", "1.2");
    assert_eq!(
        keys(&found),
        [
            "band_high_hz",
            "band_low_hz",
            "length_s",
            "residual_percent"
        ]
    );
    near(&found, "residual_percent", 0.82, 0.1);
    near(&found, "band_low_hz", 0.699, 1e-3);
    near(&found, "band_high_hz", 1.576, 1e-3);
    near(&found, "length_s", 2.0 / (1.0_f64 - 0.01).sqrt(), 1e-6);
    let fir = json(&[
        "prefilter",
        "--prefilter",
        "fir",
        "--frequency",
        "1",
        "--damping",
        "0.1",
        "--json",
    ]);
    near(&fir, "residual_percent", 7.41, 0.1);
    assert_eq!(fir["band_low_hz"], Value::Null);
    assert_eq!(fir["band_high_hz"], Value::Null);
    let ei = json(&[
        "prefilter",
        "--prefilter",
        "ei",
        "--frequency",
        "10",
        "--damping",
        "0",
        "--json",
    ]);
    near(&ei, "band_low_hz", 8.003, 1e-2);
    near(&ei, "band_high_hz", 11.997, 1e-2);
}

#[test]
fn prefilter_takes_what_its_name_leaves_open() {
    let undamped = |flags: &str| {
        let args = format!("prefilter --frequency 10 --damping 0 --json --prefilter {flags}");
        json(&args.split(' ').collect::<Vec<_>>())
    };
    // EI at 10 %: half the band is acos(1/√5.5) · 2/π of the frequency
    let ei = undamped("ei --v-tol 0.1");
    near(&ei, "residual_percent", 10.0, 1e-4);
    near(&ei, "band_low_hz", 7.195, 1e-3);
    near(&ei, "band_high_hz", 12.805, 1e-3);
    let humps = undamped("2HUMP-EI");
    near(&humps, "residual_percent", 0.0, 1e-6);
    near(&humps, "band_low_hz", 6.377, 2e-3);
    near(&humps, "band_high_hz", 13.623, 2e-3);
    let second = "--mode2-prefilter zvd --mode2-frequency 25 --mode2-damping 0";
    let both = undamped(&format!("fir-zv {second} --actual-frequency 25"));
    near(&both, "length_s", 0.19, 1e-9);
    near(&both, "residual_percent", 0.0, 1e-6);
    let smooth = undamped("zv --smoothing1-ms 20 --smoothing2-ms 10");
    near(&smooth, "length_s", 0.08, 1e-8);
    let list = undamped("custom --impulses 0:1,50:1");
    near(&list, "residual_percent", 0.0, 1e-6);
    near(&list, "length_s", 0.05, 1e-8);
    let jerk = undamped("s-curve --s-curve-feed 80 --s-curve-jerk 5120");
    near(&jerk, "length_s", 0.25, 1e-9);
    near(&undamped("box --box-ms 30"), "length_s", 0.03, 1e-8);
}

fn profile(start: &str, end: &str, method: &str) -> Vec<String> {
    let args = [
        "profile",
        "--length",
        "100",
        "--feed",
        "50",
        "--start-frequency",
        start,
        "--end-frequency",
        end,
        "--damping",
        "0.05",
        "--method",
        method,
    ];
    args.map(str::to_owned).to_vec()
}

#[test]
fn profile_gives_zeros_and_the_published_overshoot() {
    let at = |start, end, method| {
        let mut args = profile(start, end, method);
        args.push("--json".into());
        let args: Vec<_> = args.iter().map(String::as_str).collect();
        json(&args)
    };
    let found = at("8", "20", "hybrid");
    assert_eq!(
        keys(&found),
        [
            "f1_hz",
            "f2_hz",
            "f3_hz",
            "f4_hz",
            "feed_used_mm_s",
            "overshoot_accelerating_percent",
            "overshoot_decelerating_percent",
            "settling_accelerating_s",
            "settling_decelerating_s",
            "total_s"
        ]
    );
    near(&found, "f1_hz", 8.1773, 1e-3);
    near(&found, "f2_hz", 8.5361, 1e-3);
    near(&found, "f3_hz", 20.0, 0.0);
    near(&found, "overshoot_accelerating_percent", 0.460, 2e-3);
    near(&found, "settling_accelerating_s", 0.526, 1e-3);
    let found = at("20", "8", "b");
    near(&found, "overshoot_decelerating_percent", 0.710, 2e-3);
    near(&found, "settling_decelerating_s", 0.794, 1e-3);
    let found = at("8", "20", "A");
    near(&found, "feed_used_mm_s", 50.0, 0.0);
    near(&found, "total_s", 2.175, 1e-12);
}

#[test]
fn profile_draws_its_picture_and_says_what_the_move_gets() {
    let here = tempfile::TempDir::new().unwrap();
    let out = here.path().join("out");
    let mut args = profile("8", "20", "fir");
    args.extend(["--out".to_owned(), out.display().to_string()]);
    let args: Vec<_> = args.iter().map(String::as_str).collect();
    let output = super::stillpoint(&args).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success());
    assert!(said.contains("2.149 %") && said.contains("0.936"), "{said}");
    assert!(said.contains("gets\nhybrid: the mode settles"), "{said}");
    let svg = std::fs::read_to_string(out.join("profile.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("8 to 20 Hz"));
    for (flag, value, sentence) in [
        ("--length", "0", "the length of 0 mm"),
        ("--feed", "nan", "the feedrate of NaN mm/s"),
        ("--end-frequency", "0", "the frequency of 0 Hz"),
        ("--damping", "1", "the damping ratio of 1"),
    ] {
        let mut args = profile("8", "20", "fir");
        let place = args.iter().position(|arg| arg == flag).unwrap();
        args[place + 1] = value.into();
        let args: Vec<_> = args.iter().map(String::as_str).collect();
        let said = refusal(&args);
        assert!(said.contains(sentence), "{said}");
    }
}

#[test]
fn inverse_and_forward_undo_each_other() {
    for elbow in ["left", "right"] {
        let joints = json(&[
            "inverse", "225", "-45.5", "-10", "20", "--elbow", elbow, "--json",
        ]);
        assert_eq!(keys(&joints), ["joint1", "joint2", "joint3", "joint4"]);
        assert_eq!(number(&joints, "joint2") > 0.0, elbow == "right");
        let texts = ["joint1", "joint2", "joint3", "joint4"].map(|key| joints[key].to_string());
        let mut args = vec!["forward"];
        args.extend(texts.iter().map(String::as_str));
        args.push("--json");
        let pose = json(&args);
        assert_eq!(keys(&pose), ["c_deg", "x_mm", "y_mm", "z_mm"]);
        near(&pose, "x_mm", 225.0, 1e-3);
        near(&pose, "y_mm", -45.5, 1e-3);
        near(&pose, "z_mm", -10.0, 1e-5);
        near(&pose, "c_deg", 20.0, 1e-4);
    }
    for (args, sentence) in [
        (
            vec!["inverse", "400", "0", "0", "0"],
            "the arm reaches from 50.000 to 350.000 mm",
        ),
        (
            vec!["inverse", "349.9", "0", "0", "0"],
            "of stretched or folded",
        ),
        (
            vec!["inverse", "250", "0", "-300", "0"],
            "joint 3 would be at -300.000 mm",
        ),
        (
            vec!["inverse", "1e9", "0", "0", "0"],
            "X of 1000000000 leaves the number range",
        ),
        (
            vec!["inverse", "nan", "0", "0", "0"],
            "X is NaN: give a number",
        ),
        (
            vec!["forward", "0", "-171", "0", "0"],
            "joint 2 would be at -171.000°",
        ),
        (
            vec!["forward", "0", "90", "0", "inf"],
            "joint 4 is inf: give a number",
        ),
    ] {
        let said = refusal(&args);
        assert!(said.contains(sentence), "{said}");
    }
}

#[test]
fn overlap_times_a_path_of_a_tool_that_moves_and_turns() {
    let table = programs().join("polygon.csv").display().to_string();
    let run = |flags: &[&str]| {
        let mut args = vec!["overlap", &table, "--box", "0.125", "--json"];
        args.extend(flags);
        json(&args)
    };
    for (flags, cycle_s) in [
        (&[][..], 5.456),
        (&["--exact"], 5.456),
        (&["--overlap", "100"], 5.123),
        (&["--overlap", "0"], 6.373),
        // the raw path and one box
        (&["--adai"], 4.998),
    ] {
        near(&run(flags), "cycle_s", cycle_s, 0.001);
    }
    let found = run(&[]);
    let last = &found["segments"][5];
    near(last, "rotation_deg", 38.63, 0.01);
    assert!(last["overlap_s"].is_null());
    let text = stillpoint(&["overlap", &table, "--box", "0.125"])
        .output()
        .unwrap();
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.contains("cycle time               5.456 s"), "{text}");
}

#[test]
fn a_deltas_joints_are_four_angles() {
    let robot = programs().join("../robots/delta-800.toml");
    let robot = robot.to_str().unwrap();
    let joints = json(&[
        "inverse", "-350", "0", "-767", "30", "--robot", robot, "--json",
    ]);
    assert_eq!(keys(&joints), ["joint1", "joint2", "joint3", "joint4"]);
    for (key, published) in [
        ("joint1", 34.782_244),
        ("joint2", 60.738_544),
        ("joint3", 2.036_028),
        ("joint4", 30.0),
    ] {
        near(&joints, key, published, 2e-6);
    }
    let texts = ["joint1", "joint2", "joint3", "joint4"].map(|key| joints[key].to_string());
    let mut args = vec!["forward", "--robot", robot, "--json"];
    args.extend(texts.iter().map(String::as_str));
    let pose = json(&args);
    near(&pose, "x_mm", -350.0, 1e-3);
    near(&pose, "y_mm", 0.0, 1e-3);
    near(&pose, "z_mm", -767.0, 1e-3);
    near(&pose, "c_deg", 30.0, 1e-5);
    for (place, sentence) in [
        (
            ["0", "0", "-1200", "0"],
            "1209.969 mm from the shoulder of arm 1",
        ),
        (
            ["0", "0", "-1130", "0"],
            "from the plane of its upper arm, closer than 20.000°",
        ),
        (["0", "0", "-767", "721"], "joint 4 would be at 721.000°"),
    ] {
        let mut args = vec!["inverse", "--robot", robot];
        args.extend(place);
        let said = refusal(&args);
        assert!(said.contains(sentence), "{said}");
    }
    let said = refusal(&[
        "inverse", "0", "0", "-767", "0", "--robot", robot, "--elbow", "left",
    ]);
    assert!(said.contains("leave out --elbow"), "{said}");
    let said = refusal(&["forward", "0", "0", "120", "0", "--robot", robot]);
    assert!(said.contains("joint 3 would be at 120.000°"), "{said}");
}
