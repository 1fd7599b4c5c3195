//! The program `stillpoint` from outside: flags, JSON keys, exit status, sentences, files.

mod calculators;
mod identify;
mod on_emulator;
mod refusals;
mod run;
#[path = "../emulated/support.rs"]
mod support;

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

fn stillpoint(args: &[&str]) -> Command {
    let mut command = Command::cargo_bin("stillpoint").unwrap();
    command.args(args);
    command
}

fn programs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("programs")
}

fn corner_path() -> String {
    programs().join("corner-path.gcode").display().to_string()
}

/// Standard output of a run that must succeed, as the one JSON object that it must be.
fn json(args: &[&str]) -> Value {
    let output = stillpoint(args).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{args:?}: {stderr}");
    assert_eq!(stderr, "", "{args:?}");
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(value.is_object());
    value
}

/// The one sentence of a run that must fail and print nothing else.
fn refusal(args: &[&str]) -> String {
    let output = stillpoint(args).output().unwrap();
    assert!(!output.status.success(), "{args:?}");
    assert_eq!(output.stdout, b"", "{args:?}");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
    stderr
}

fn number(value: &Value, key: &str) -> f64 {
    value[key]
        .as_f64()
        .unwrap_or_else(|| panic!("{key} of {value}"))
}

fn near(value: &Value, key: &str, expected: f64, allowed: f64) {
    let found = number(value, key);
    assert!(
        (found - expected).abs() <= allowed,
        "{key}: {found}, not {expected}"
    );
}

fn keys(value: &Value) -> Vec<&str> {
    value
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect()
}
