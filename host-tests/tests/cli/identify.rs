//! `identify FILE`: keys, values, refusals and the picture.

use std::f64::consts::TAU;
use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use super::{json, keys, near, number, refusal, stillpoint};

/// A swing of 6.34 Hz, damping 0.022, and one of 10 Hz, damping 0.01, with 3 in 10 of its
/// amplitude.
fn swings(time_s: f64) -> f64 {
    let swing = |amplitude: f64, frequency_hz: f64, damping: f64| {
        let turn = TAU * frequency_hz;
        let damped = turn * (1.0 - damping * damping).sqrt();
        amplitude * (-damping * turn * time_s).exp() * (damped * time_s + 1.0).cos()
    };
    9810.0 + swing(100.0, 6.34, 0.022) + swing(30.0, 10.0, 0.01)
}

/// Writes a record of so many samples.
fn written(directory: &TempDir, rate_hz: f64, count: u32, value: impl Fn(f64) -> f64) -> PathBuf {
    let path = directory.path().join("record.csv");
    let mut text = String::from("time_s,acceleration_mm_s2\n");
    for at in 0..count {
        let time_s = f64::from(at) / rate_hz;
        text += &format!("{time_s:.6},{:.4}\n", value(time_s));
    }
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn one_mode_or_two_from_any_sampling_rate() {
    let directory = TempDir::new().unwrap();
    for (rate_hz, count) in [(1000.0, 1500), (1000.0, 5000), (500.0, 800), (3200.0, 6400)] {
        let path = written(&directory, rate_hz, count, swings);
        let path = path.to_str().unwrap();
        let found = json(&["identify", path, "--json"]);
        assert_eq!(keys(&found), ["confidence", "damping", "frequency_hz"]);
        near(&found, "frequency_hz", 6.34, 0.002);
        near(&found, "damping", 0.022, 2e-4);
        assert!((0.99..=1.0).contains(&number(&found, "confidence")));

        let found = json(&["identify", path, "--modes", "2", "--json"]);
        assert_eq!(
            keys(&found),
            ["confidence", "damping", "frequency_hz", "modes"]
        );
        near(&found, "frequency_hz", 6.34, 0.002);
        let modes = found["modes"].as_array().unwrap();
        assert_eq!(modes.len(), 2);
        near(&modes[0], "frequency_hz", 6.34, 0.002);
        near(&modes[1], "frequency_hz", 10.0, 0.005);
        near(&modes[1], "damping", 0.01, 5e-4);
    }
}

#[test]
fn a_picture_shows_record_fit_and_spectrum() {
    let directory = TempDir::new().unwrap();
    let path = written(&directory, 1000.0, 1500, swings);
    let out = directory.path().join("out");
    let args = [
        "identify",
        path.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ];
    let output = stillpoint(&args).output().unwrap();
    let words = String::from_utf8(output.stdout).unwrap();
    assert!(
        words.contains("6.34") && words.contains("confidence"),
        "{words}"
    );
    let picture = fs::read_to_string(out.join("identified.svg")).unwrap();
    for words in ["recorded", "fitted", "spectrum, mm/s²", "6.34 Hz"] {
        assert!(picture.contains(words), "{words}");
    }
}

#[test]
fn a_record_that_cannot_be_trusted_is_refused_with_the_reason() {
    let directory = TempDir::new().unwrap();
    let hum = |time_s: f64| (TAU * 12.0 * time_s).sin();
    let cut = |time_s: f64| swings(time_s).min(9810.0 + 50.0);
    for (count, value, words) in [
        (200, &swings as &dyn Fn(f64) -> f64, "needs 0.25 s at least"),
        (1500, &|_| 9810.0, "all samples of the record are the same"),
        (1500, &hum, "the swing at 12.00 Hz does not die away"),
        (1500, &cut, "the crests of the record are cut off"),
    ] {
        let path = written(&directory, 1000.0, count, value);
        let said = refusal(&["identify", path.to_str().unwrap()]);
        assert!(
            said.contains("record.csv: ") && said.contains(words),
            "{said}"
        );
    }
    let path = written(&directory, 50.0, 100, swings);
    let said = refusal(&["identify", path.to_str().unwrap(), "--json"]);
    assert!(
        said.contains("the record has 50.0 samples a second"),
        "{said}"
    );

    fs::write(&path, "time_s,acceleration_mm_s2\n0,1\n0.001,one\n").unwrap();
    let said = refusal(&["identify", path.to_str().unwrap()]);
    assert!(
        said.contains("record.csv: line 3: acceleration_mm_s2 is \"one\""),
        "{said}"
    );
    let said = refusal(&["identify", "no-such-record.csv"]);
    assert!(
        said.contains("no-such-record.csv: the record cannot be read"),
        "{said}"
    );
}
