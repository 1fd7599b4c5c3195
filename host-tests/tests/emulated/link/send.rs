//! `stillpoint send`: programs that arrive, lines that do not, links that break.

use std::fmt::Write as _;
use std::fs;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;
use tempfile::TempDir;

use super::support::{Emulator, command, end_of, json, outputs, program, signal, status};

#[test]
fn the_corner_path_ends_at_rest_at_its_end() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let path = program("corner-path.gcode");
    let robot = "--robot=robots/scara-200-150.toml";
    for (port, extra) in [
        (emulator.terminal(), "--json"),
        (emulator.tcp(), "--checksums"),
        (emulator.terminal(), robot),
        (emulator.tcp(), "--no-error-safe"),
        (emulator.tcp(), "--reset"),
    ] {
        let output = command(&["send", &port, &path, "--json", extra])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output();
        // `--json` twice is once too often.
        let output = match extra {
            "--json" => command(&["send", &port, &path, "--json"]).output(),
            _ => output,
        };
        let output = output.unwrap();
        let summary = json(&output);
        assert_eq!(status(&output), 0, "{summary}");
        assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
        assert_eq!(summary["ending"], "done");
        assert_eq!(summary["state"], "Idle");
        assert_eq!(summary["lines"], 8);
        assert_eq!(summary["accepted"], 8);
        assert_eq!(summary["errors"], Value::Array(Vec::new()));
        assert_eq!(summary["position"]["x_mm"], 270.0);
        assert_eq!(summary["position"]["y_mm"], 0.0);
        // The path takes 4 s, and nobody says it is over before it is.
        assert!(summary["duration_s"].as_f64().unwrap() > 3.9, "{summary}");
    }
    let said = emulator.client().ask("$error-safe");
    assert!(said[0].ends_with("=0"), "it was given back: {said:?}");
}

#[test]
fn a_refused_line_is_named_with_its_sentence() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let here = TempDir::new().unwrap();
    let file = here.path().join("bad.gcode");
    let mut text =
        "; first a comment\nG0 X250 Y0\n\nG1 X255 F6000\nG1 X2000 (too far)\n".to_owned();
    for x in 0..100 {
        writeln!(text, "G1 X{}", 250 + x % 3).unwrap();
    }
    fs::write(&file, text).unwrap();
    let file = file.to_str().unwrap();
    for extra in ["--error-safe", "--checksums"] {
        let mut args = vec!["send", file, "--json"];
        let port = emulator.tcp();
        args.insert(1, &port);
        args.extend((extra == "--checksums").then_some(extra));
        let output = command(&args).output().unwrap();
        let summary = json(&output);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(status(&output), 1, "{said}");
        assert_eq!(summary["ending"], "refused");
        assert_eq!(summary["accepted"], 2);
        let error = &summary["errors"][0];
        assert_eq!((&error["line"], &error["code"]), (&5.into(), &71.into()));
        assert_eq!(error["text"], "G1X2000");
        let message = error["message"].as_str().unwrap();
        assert!(message.contains("° of stretched or folded"), "{message}");
        assert!(said.contains(&format!("bad.gcode: line 5 (G1X2000): error 71: {message}")));
        assert!(said.contains("nothing behind it was carried out"), "{said}");
        // What came before it was carried out, and nothing behind it.
        assert_eq!(summary["position"]["x_mm"], 255.0);
        // The controller takes lines again.
        let mut other = emulator.client();
        other.ask("G4 P0.01");
        other.await_status("<Idle");
    }
    // With the robot's file it is found before anything moves.
    let args = [
        "send",
        &emulator.tcp(),
        file,
        "--robot",
        "robots/scara-200-150.toml",
    ];
    let output = command(&args)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(status(&output), 1);
    assert!(said.contains("bad.gcode: line 5: at "), "{said}");
}

#[test]
fn as_grbl_does_lines_behind_an_error_are_carried_out_and_counted() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let here = TempDir::new().unwrap();
    let file = here.path().join("bad.gcode");
    fs::write(
        &file,
        "G0 X250 Y0\nG1 X2000 F6000\nG1 X251 F6000\nG1 X252\n",
    )
    .unwrap();
    let args = [
        "send",
        &emulator.tcp(),
        file.to_str().unwrap(),
        "--json",
        "--no-error-safe",
    ];
    let output = command(&args).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(status(&output), 1, "{said}");
    assert!(
        said.contains("2 lines that were already sent behind it were carried out"),
        "{said}"
    );
    assert_eq!(json(&output)["position"]["x_mm"], 252.0);
}

#[test]
fn a_thousand_lines_arrive_through_a_full_buffer() {
    let Some(emulator) = Emulator::start(&["--fast"]) else {
        return;
    };
    let here = TempDir::new().unwrap();
    let file = here.path().join("long.gcode");
    // Relative moves: one that came twice, or not at all, would leave the end elsewhere.
    let moves = "G1 X0.05 Y0.02 F6000\n".repeat(1000);
    fs::write(&file, format!("G0 X250 Y0\nG91\n{moves}G90\nM2\n")).unwrap();
    for (port, extra) in [
        (emulator.terminal(), None),
        (emulator.tcp(), Some("--checksums")),
    ] {
        let mut args = vec!["send", &port, file.to_str().unwrap(), "--json"];
        args.extend(extra);
        let output = command(&args).output().unwrap();
        let summary = json(&output);
        assert_eq!(status(&output), 0, "{summary}");
        assert_eq!(summary["accepted"], 1004);
        assert_eq!(summary["position"]["x_mm"], 300.0);
        assert_eq!(summary["position"]["y_mm"], 20.0);
        println!("{extra:?}: {} s", summary["duration_s"]);
    }
}

#[test]
fn a_link_that_breaks_is_noticed_at_once() {
    for (break_by, patience_s) in [(Signal::TERM, 2.0), (Signal::STOP, 8.0)] {
        for over_tcp in [false, true] {
            let Some(emulator) = Emulator::start(&[]) else {
                return;
            };
            let port = if over_tcp {
                emulator.tcp()
            } else {
                emulator.terminal()
            };
            let path = program("corner-path.gcode");
            let mut send = command(&["send", &port, &path, "--json"])
                .stdin(Stdio::null())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            thread::sleep(Duration::from_secs(1));
            signal(&emulator.child, break_by);
            let start = Instant::now();
            assert_eq!(end_of(&mut send).code(), Some(5));
            let elapsed_s = start.elapsed().as_secs_f64();
            assert!(elapsed_s < patience_s, "{elapsed_s} s");
            let [out, err] = outputs(&mut send);
            assert!(out.contains(r#""ending": "link-lost""#), "{out}");
            assert!(err.contains("8 of 8 lines were accepted"), "{err}");
            println!("{break_by:?}, over TCP {over_tcp}: {elapsed_s:.2} s");
        }
    }
}

#[test]
fn wrong_use_is_noticed_before_anybody_is_connected() {
    let nowhere = "tcp:127.0.0.1:1";
    let here = TempDir::new().unwrap();
    let file = |name: &str, text: &str| {
        let file = here.path().join(name);
        fs::write(&file, text).unwrap();
        file.display().to_string()
    };
    let robot = file("robot.toml", "[arm]\nlink3_mm = 3\n");
    let good = file("good.gcode", "G0 X250 Y0\n");
    for (args, code, sentence) in [
        (
            vec![nowhere, "no-such.gcode"],
            2,
            "the program cannot be read",
        ),
        (
            vec![nowhere, &file("empty", "; nothing\n\n")],
            2,
            "holds no line to send",
        ),
        (
            vec![nowhere, &file("hold", "G1 X1 !\n")],
            2,
            "'!' is a realtime command",
        ),
        (
            vec![nowhere, &good, "--robot", &robot],
            2,
            "key arm.link3_mm",
        ),
        (
            vec![nowhere, &good, "--link-timeout", "-1"],
            2,
            "from 0 to 3600",
        ),
        (vec!["tcp:nowhere", &good], 2, "tcp:HOST:PORT"),
        (vec![nowhere, &good], 5, "the port cannot be opened"),
        (
            vec!["/dev/no-such-port", &good],
            5,
            "the port cannot be opened",
        ),
    ] {
        let output = command(&["send"]).args(&args).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(status(&output), code, "{args:?}: {said}");
        assert!(said.contains(sentence), "{args:?}: {said}");
        assert_eq!(output.stdout, b"");
    }
}

#[test]
fn a_controller_that_is_not_ready_is_left_alone() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut other = emulator.client();
    other.ask("G0 X250 Y0");
    other.ask("G1 X300 F600");
    other.await_status("<Run");
    let path = program("corner-path.gcode");
    let send = |extra: &[&str]| {
        let output = command(&["send", &emulator.tcp(), &path])
            .args(extra)
            .output();
        let output = output.unwrap();
        (status(&output), String::from_utf8(output.stderr).unwrap())
    };
    let (code, said) = send(&[]);
    assert_eq!(code, 3);
    assert!(
        said.contains("the controller is in the state Run: wait"),
        "{said}"
    );
    // A reset of a moving robot locks it.
    let (code, said) = send(&["--reset"]);
    assert_eq!(code, 3, "{said}");
    assert!(said.contains("locked in the state Alarm"), "{said}");
    let (code, said) = send(&["--unlock"]);
    assert_eq!(code, 0, "{said}");
}
