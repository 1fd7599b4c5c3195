//! `run --on emulator`: the files of `--on host`, and what to install where a tool is missing.

use std::fs;
use std::path::Path;

use host_tests::emulator::Pace;
use serde_json::Value;
use tempfile::TempDir;

use super::support::emulator;
use super::{corner_path, json, number, stillpoint};

#[test]
fn the_emulator_writes_the_trace_of_the_host() {
    if emulator(Pace::Free).is_none() {
        return;
    }
    let [host, board] = [TempDir::new().unwrap(), TempDir::new().unwrap()];
    let path = corner_path();
    let run = ["run", &path, "--json", "--out"];
    json(&[&run[..], &[host.path().to_str().unwrap()]].concat());

    // The build speaks on standard error; standard output is the summary alone.
    let output = stillpoint(&run)
        .arg(board.path())
        .args(["--on", "emulator"])
        .output()
        .unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();

    let read = |directory: &TempDir, file: &str| fs::read(directory.path().join(file)).unwrap();
    let [on_host, on_board]: [Value; 2] = [&host, &board]
        .map(|directory| serde_json::from_slice(&read(directory, "summary.json")).unwrap());
    assert_eq!(printed, on_board);
    assert_eq!(on_board["on"], "emulator");
    let worst = number(&on_board, "tick_instructions_max");
    assert!(worst > 500.0, "{worst}");
    // All else in the summary is the same, and so is every byte of the trace.
    for (key, value) in on_host.as_object().unwrap() {
        if key != "on" && key != "tick_instructions_max" {
            assert_eq!(&on_board[key], value, "{key}");
        }
    }
    let [host_rows, board_rows] =
        [&host, &board].map(|directory| String::from_utf8(read(directory, "trace.csv")).unwrap());
    for (host_row, board_row) in host_rows.lines().zip(board_rows.lines()) {
        assert_eq!(host_row, board_row);
    }
    assert_eq!(host_rows.len(), board_rows.len());
    for picture in ["path.svg", "feedrate.svg", "vibration.svg"] {
        assert!(board.path().join(picture).is_file(), "{picture}");
    }
}

/// The sentence of a run on the emulator that finds no tools but those in `tools`.
fn refusal_with_only(tools: &Path) -> String {
    let output = stillpoint(&["run", &corner_path(), "--on", "emulator", "--json"])
        .env("PATH", tools)
        .output()
        .unwrap();
    assert!(!output.status.success());
    assert_eq!(output.stdout, b"");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn a_missing_tool_is_named_with_what_to_install() {
    let tools = TempDir::new().unwrap();
    let said = refusal_with_only(tools.path());
    assert!(
        said.ends_with(": QEMU for ARM is missing: install the package qemu-system-arm\n"),
        "{said}"
    );
    assert_eq!(said.lines().count(), 1, "{said}");

    // With QEMU, but without a compiler: a script that does nothing passes for QEMU.
    let qemu = tools.path().join("qemu-system-arm");
    fs::write(&qemu, "#!/bin/sh\n").unwrap();
    fs::set_permissions(&qemu, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let said = refusal_with_only(tools.path());
    assert!(said.starts_with("stillpoint: "), "{said}");
    assert!(
        said.contains("rustup target add thumbv7em-none-eabihf"),
        "{said}"
    );
    assert_eq!(said.lines().count(), 1, "{said}");
}
