//! `stillpoint monitor`: one report, a line for every change, setpoints.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use rustix::process::Signal;
use serde_json::Value;

use super::support::{Emulator, command, end_of, json, signal, status};

#[test]
fn one_report_tells_state_position_and_setpoints() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut other = emulator.client();
    other.ask("G0 X250 Y50");
    other.await_status("<Idle|MPos:250.000,50.000");
    let (port, telemetry) = (emulator.terminal(), emulator.telemetry());
    let args = ["monitor", &port, "--once", "--telemetry", &telemetry];
    let output = command(&args).arg("--json").output().unwrap();
    let report = json(&output);
    assert_eq!(status(&output), 0);
    assert_eq!(report["state"], "Idle");
    assert_eq!(report["machine"][1], 50.0);
    let setpoints = &report["setpoints"];
    assert_eq!(setpoints["x_mm"], 250.0);
    assert_eq!(
        (&setpoints["lost"], &setpoints["bad"]),
        (&0.into(), &0.into())
    );
    // The pose by the joints, with links of 200 and 150 mm.
    let angle = |name: &str| setpoints[name].as_f64().unwrap().to_radians();
    let (shoulder, elbow) = (angle("joint1_deg"), angle("joint2_deg"));
    let x = 200.0 * shoulder.cos() + 150.0 * (shoulder + elbow).cos();
    assert!((x - 250.0).abs() < 0.001, "{report}");

    let output = command(&args).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("Idle     X250.000 Y50.000"), "{text}");
    assert!(text.contains("frames lost 0, bad 0"), "{text}");
}

#[test]
fn every_change_is_a_line() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut other = emulator.client();
    other.ask("G0 X250 Y0");
    let mut monitor = command(&["monitor", &emulator.terminal(), "--json"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines();
    let mut next =
        move || -> Value { serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap() };
    assert_eq!(next()["state"], "Idle");
    other.send(b"G1 X260 F600\nG1 X2000\n");
    let mut seen = Vec::new();
    while !seen.iter().any(|line: &Value| line["machine"][0] == 260.0) {
        seen.push(next());
    }
    assert!(seen.iter().any(|line| line["state"] == "Run"));
    let mut messages = seen.iter().filter_map(|line| line["message"].as_str());
    assert!(
        messages.any(|said| said.contains("of stretched or folded")),
        "{seen:?}"
    );
    signal(&monitor, Signal::INT);
    assert_eq!(end_of(&mut monitor).code(), Some(0));
}

#[test]
fn nobody_there_is_a_sentence() {
    let output = command(&["monitor", "tcp:127.0.0.1:1"]).output().unwrap();
    assert_eq!(status(&output), 5);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.starts_with("stillpoint: tcp:127.0.0.1:1: the port cannot be opened"));
}
