//! `stillpoint identify --on`: at one place, again at once, and over a grid.

use std::fs;

use tempfile::TempDir;

use super::support::{Emulator, command, json, status};

/// 18 Hz at a reach of 150 mm, 9.5 Hz at one of 320 mm.
const PLANT: &str = "[plant]\nmode_frequency_hz = 14.25\nmode_slope_hz_per_mm = -0.05\n";

fn frequency_hz(x: f64, y: f64) -> f64 {
    14.25 - 0.05 * (x.hypot(y) - 225.0)
}

#[test]
fn one_place_after_the_other_and_a_grid() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(&robot, PLANT).unwrap();
    let Some(emulator) = Emulator::start(&["--plant", "--robot", robot.to_str().unwrap()]) else {
        return;
    };
    let mut client = emulator.client();
    assert_eq!(client.ask("G0 X220 Y0"), ["ok"]);
    client.await_status("<Idle");
    let identify = |args: &[&str]| {
        let on = ["identify", "--on", &emulator.tcp(), "--json"];
        let output = command(&[&on[..], args].concat()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(status(&output), 0, "{args:?}: {said}");
        json(&output)
    };
    for (way, x) in [("X40 F9600", 260.0), ("X-40 F9600", 220.0)] {
        let found = identify(&["--move", way]);
        let found_hz = found["frequency_hz"].as_f64().unwrap();
        let error = found_hz / frequency_hz(x, 0.0) - 1.0;
        assert!(error.abs() < 0.01, "{way}: {found}");
    }

    // The tool is so light that the drives may just tell of it, or of the joints' own mode alone.
    let found = identify(&["--by", "joint1", "--move", "Y40 F9600"]);
    let found_hz = found["frequency_hz"].as_f64().unwrap();
    let error = found_hz / frequency_hz(220.0, 40.0) - 1.0;
    assert!(
        error.abs() < 0.01 || (34.0..37.0).contains(&found_hz),
        "{found}"
    );

    let found = identify(&["--grid", "2,1,180,280,-1,1", "--store"]);
    assert_eq!((&found["columns"], &found["rows"]), (&2.into(), &1.into()));
    for (node, x) in [(0, 180.0), (1, 280.0)] {
        let node = &found["nodes"][node];
        assert_eq!(node["x_mm"], x);
        assert_eq!(node["measured"], true);
        let error = node["frequency_hz"].as_f64().unwrap() / frequency_hz(x, 0.0) - 1.0;
        assert!(error.abs() < 0.02, "{found}");
    }
    // All clients hear what was said to the other one, too.
    let map = emulator.client().ask("$map");
    let lines = found["lines"].as_array().unwrap();
    assert_eq!(lines.len(), 2);
    for (said, line) in map.iter().zip(lines) {
        assert_eq!(said, line.as_str().unwrap());
    }
}

#[test]
fn what_is_no_grid_is_refused_before_anything_moves() {
    for (args, sentence) in [
        (["--grid", "5,4,120"], "give COLUMNS,ROWS,X0,X1,Y0,Y1"),
        (["--grid", "9,4,120,300,0,9"], "a map of 9 by 4"),
        (["--by", "joint5"], "joint4"),
    ] {
        let mut command = command(&["identify", "--on", "tcp:127.0.0.1:9"]);
        let output = command.args(args).output().unwrap();
        let said = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(status(&output), 2, "{said}");
        assert!(said.contains(sentence), "{said}");
    }
}
