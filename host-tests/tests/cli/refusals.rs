//! Bad programs and settings: one sentence each, and nothing else.

use std::fs;

use tempfile::TempDir;

use super::{corner_path, programs, refusal, stillpoint};

#[test]
fn bad_programs_each_have_a_sentence_and_leave_no_file() {
    let here = TempDir::new().unwrap();
    let long = here.path().join("long.gcode");
    let digits = "1".repeat(1 << 20);
    fs::write(&long, format!("G0 X250 Y0\nG1 F6000 X{digits}\nM2\n")).unwrap();
    let bad = |name: &str| programs().join("bad").join(name);
    let out = here.path().join("out");
    for (program, sentence) in [
        (
            bad("unreachable.gcode"),
            "line 1: the tool would be 400.000 mm from the shoulder",
        ),
        (bad("singular.gcode"), "line 2: at 99."),
        (bad("singular.gcode"), "of stretched or folded"),
        (
            bad("joint-limit.gcode"),
            "line 3: at 42.3 % of the segment joint 1 would be at",
        ),
        (bad("open-arc.gcode"), "line 2: the arc does not close"),
        (bad("no-feed.gcode"), "line 2: no feedrate: give F"),
        (bad("nan.gcode"), "line 2: word X: "),
        (
            bad("overflow.gcode"),
            "line 2: word X: the number is too large",
        ),
        (bad("too-slow.gcode"), "line 2: the segment would take"),
        (bad("empty.gcode"), "the program holds no motion"),
        (bad("no-motion.gcode"), "the program holds no motion"),
        (bad("not-text.gcode"), "line 2: the line is not UTF-8"),
        (bad("no-such-file.gcode"), "the program cannot be read"),
        (programs(), "the program cannot be read"),
        (long, "line 2: the line is too long"),
    ] {
        let program = program.to_str().unwrap();
        for json in [&["--json"][..], &[]] {
            let mut args = vec!["run", program, "--out", out.to_str().unwrap()];
            args.extend(json);
            let said = refusal(&args);
            assert!(
                said.starts_with(&format!("stillpoint: {program}: ")),
                "{said}"
            );
            assert!(said.contains(sentence), "{said}");
        }
        assert!(refusal(&["compare", program]).contains(sentence));
        assert!(!out.exists(), "{program}");
    }
}

#[test]
fn bad_settings_each_have_a_sentence() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(&robot, "[arm]\nlink1_mm = 200\nlink3_mm = 10\n").unwrap();
    let robot = robot.to_str().unwrap();
    let path = corner_path();
    let said = refusal(&["run", &path, "--robot", robot]);
    assert!(
        said.contains("robot.toml, line 3, key arm.link3_mm: unknown field"),
        "{said}"
    );
    assert_eq!(
        refusal(&["inverse", "250", "0", "0", "0", "--robot", robot]),
        said
    );
    for (flag, value, sentence) in [
        (
            "--frequency",
            "0",
            "frequency of 0 Hz is outside 0.01 to 250 Hz",
        ),
        ("--frequency", "1", "the delay line holds 1 s"),
        ("--damping", "-1", "damping ratio of -1 is outside 0 to 0.5"),
        ("--tolerance", "nan", "the setting tolerance is NaN"),
    ] {
        let said = refusal(&["run", &path, flag, value]);
        assert!(said.contains(sentence), "{said}");
    }
    let corner = |angle: &str, feed: &str, tolerance: &str| {
        refusal(&[
            "corner",
            "--prefilter",
            "fir",
            "--frequency",
            "6",
            "--damping",
            "0",
            "--feed",
            feed,
            "--angle",
            angle,
            "--tolerance",
            tolerance,
        ])
    };
    assert!(corner("181", "160", "1").contains("--angle"));
    assert!(corner("90", "0", "1").contains("--feed"));
    assert!(corner("90", "160", "-1").contains("--tolerance"));
    let polygon = programs().join("polygon.csv").display().to_string();
    let overlap = |flags: &[&str]| {
        let mut args = vec!["overlap", polygon.as_str()];
        args.extend(flags);
        refusal(&args)
    };
    assert!(overlap(&["--box", "0"]).contains("outside 0.001 to 10 s"));
    assert!(overlap(&["--box", "0.1", "--overlap", "101"]).contains("--overlap"));
    let points = here.path().join("points.csv");
    let header = "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,feed_mm_s,tolerance_mm,overlap_percent\n";
    for (rows, sentence) in [
        ("0,0,0,0,0,0,,,\n", "a path needs two points"),
        (
            "0,0,0,0,0,0,,,\n0,0,0,0,0,0,5,,\n",
            "line 3: a segment neither moves nor turns",
        ),
        (
            "0,0,0,0,0,0,,,\n1,0,0,0,0,0,,,\n",
            "line 3: feed_mm_s is missing",
        ),
        (
            "0,0,0,0,0,0,,,\n1,0,0,0,0,0,5,1,50\n2,0,0,0,0,0,5,,\n",
            "line 3: tolerance and overlap are both given",
        ),
    ] {
        fs::write(&points, format!("{header}{rows}")).unwrap();
        let said = refusal(&["overlap", points.to_str().unwrap(), "--box", "0.1"]);
        assert!(said.contains(sentence), "{said}");
    }
    stillpoint(&["run", &path, "--prefilter", "zvx"])
        .assert()
        .failure();
    stillpoint(&["run"]).assert().failure();
}
