//! Homing on the emulated board, whose simulated arm has both encoders and limit inputs.

use crate::support::emulator;
use host_tests::emulator::{Answer, Emulator, Pace};

/// The position of a status report in mm, mm, mm and degrees.
fn position(emulator: &mut Emulator) -> [f64; 4] {
    let status = emulator.status().unwrap();
    let field = status
        .split('|')
        .find_map(|field| field.strip_prefix("MPos:"));
    let values: Vec<f64> = field
        .unwrap_or_else(|| panic!("no position: {status}"))
        .split(',')
        .map(|value| value.parse().unwrap())
        .collect();
    values.try_into().unwrap()
}

#[test]
fn limit_inputs_and_encoders_tell_the_same_position() {
    let Some(mut emulator) = emulator(Pace::Free) else {
        return;
    };
    assert_eq!(
        emulator.ask(b"$home-joints=15 home-fast=150").unwrap(),
        Answer::Ok
    );
    assert_eq!(emulator.ask(b"$H").unwrap(), Answer::Ok);
    let by_limits = position(&mut emulator);
    assert_eq!(emulator.ask(b"$encoders=1").unwrap(), Answer::Ok);
    assert_eq!(emulator.ask(b"$H").unwrap(), Answer::Ok);
    let by_encoders = position(&mut emulator);
    for (limits, encoders) in by_limits.into_iter().zip(by_encoders) {
        // Two ticks of each joint at 2 °/s: 0.004°, or 0.02 mm at 250 mm.
        let error = (limits - encoders).abs();
        assert!(error < 0.04, "{by_limits:?} {by_encoders:?}");
    }
    // -160° and 15°, 185 mm up
    let [x, y, z, _] = by_encoders;
    let expected = [
        200.0 * (-160_f64).to_radians().cos() + 150.0 * (-145_f64).to_radians().cos(),
        200.0 * (-160_f64).to_radians().sin() + 150.0 * (-145_f64).to_radians().sin(),
        185.0,
    ];
    for (value, expected) in [x, y, z].into_iter().zip(expected) {
        assert!((value - expected).abs() < 0.04, "{by_encoders:?}");
    }
}
