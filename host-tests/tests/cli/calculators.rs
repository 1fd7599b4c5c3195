//! `corner`, `prefilter`, `inverse` and `forward`: keys and values.

use serde_json::Value;

use super::{json, keys, near, number, refusal};

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
