//! The loop closed on the PC: the controller moves, listens, identifies and stores, with the full
//! plant and its accelerometer at the other end of the second port.

use host_tests::plant::{FullConfig, Mode, ModeMap};
use host_tests::sensed_plant::SensedPlant;
use host_tests::serial_loop::{Records, SerialLoop, with_controller};
use planner_core::protocol::Record;

/// The plant with a mode that the controller does not know.
pub fn plant(frequency_hz: f64, damping: f64, delay: usize) -> SensedPlant {
    let mode = Mode {
        frequency_hz,
        damping,
    };
    let config = FullConfig {
        mode: ModeMap::constant(mode),
        ..FullConfig::default()
    };
    SensedPlant::new(config, delay)
}

fn with_plant(plant: SensedPlant, body: impl FnOnce(&mut SerialLoop<'_>)) {
    with_controller(Records::new(), |desk| {
        desk.plant = Some(plant);
        desk.run_ms(5);
        assert!(desk.ask("G0 X220 Y0").contains("ok"));
        assert!(desk.run_until("Idle"));
        desk.run_ms(100);
        desk.heard();
        body(desk);
    });
}

/// The vibration that a move leaves: the largest acceleration from its end, as commanded, on for
/// 0.5 s, and a rest for it to die away.
fn left_by(desk: &mut SerialLoop<'_>, line: &str) -> f64 {
    desk.send(format!("{line}\n").as_bytes());
    desk.run_ms(20);
    assert!(desk.run_until("Idle"));
    desk.run_ms(500);
    let largest = (desk.plant.as_ref().unwrap()).largest_after_stop_mm_s2(500);
    desk.run_ms(20_000);
    desk.heard();
    largest
}

/// `[ID:frequency,damping,confidence]` among what was heard.
fn found(heard: &str) -> [f64; 3] {
    let line = heard.lines().find_map(|line| line.strip_prefix("[ID:"));
    let values = line.unwrap_or_else(|| panic!("nothing found: {heard}"));
    let mut values = values
        .trim_end_matches(']')
        .split(',')
        .map(|value| value.parse().unwrap());
    std::array::from_fn(|_| values.next().unwrap())
}

#[test]
fn the_vibration_goes_down_without_a_human_number() {
    for (frequency_hz, damping, delay) in [(2.9, 0.01, 0), (4.1, 0.02, 300), (11.3, 0.004, 7)] {
        with_plant(plant(frequency_hz, damping, delay), |desk| {
            let before = left_by(desk, "G91 G1 X40 F9600");
            left_by(desk, "X-40");
            let heard = desk.ask("$ID=X40 F9600");
            assert!(heard.ends_with("ok\r\n"), "{heard}");
            let [found_hz, found_damping, confidence] = found(&heard);
            assert!((found_hz / frequency_hz - 1.0).abs() < 0.005, "{heard}");
            assert!((found_damping - damping).abs() < 0.002, "{heard}");
            assert!(confidence > 0.9, "{heard}");
            desk.run_ms(20_000);
            assert!(desk.ask("$ID=store").ends_with("ok\r\n"));
            let prefilter = desk.robot().config.prefilter;
            assert!((f64::from(prefilter.frequency_hz) - found_hz).abs() < 1e-4);
            assert!((f64::from(prefilter.damping) - found_damping).abs() < 1e-5);
            assert!(desk.records.contains_key(&Record::Settings));
            left_by(desk, "G91 G1 X-40 F9600");
            let after = left_by(desk, "X40");
            println!("{frequency_hz} Hz: {before:.1} mm/s² before, {after:.1} after, {heard}");
            assert!(after <= 0.1 * before, "{before} {after}");
        });
    }
}

#[test]
fn the_prefilter_of_the_settings_is_in_force_again_afterwards() {
    with_plant(plant(6.34, 0.022, 0), |desk| {
        let expected = desk.robot().config.prefilter;
        for line in [
            "$ID=X40 F9600",
            "$ID=X1000 F9600",
            "$ID=C10 F100",
            "$ID=X0 F100",
        ] {
            desk.ask(line);
            assert_eq!(desk.robot().config.prefilter, expected, "{line}");
        }
        // stopped on its way, by hold, stop, jog cancel and reset
        for byte in [b'!', 0x19, 0x85, 0x18] {
            desk.ask("$X");
            desk.send(b"$ID=X10 F600\n");
            desk.run_ms(300);
            assert_eq!(desk.state(), "Run");
            assert_ne!(desk.robot().config.prefilter, expected);
            desk.send(&[byte]);
            desk.run_ms(2000);
            assert_eq!(desk.robot().config.prefilter, expected, "{byte:x}");
            let heard = desk.heard();
            assert_eq!(
                heard.contains("error:92"),
                byte != 0x18,
                "{byte:x}: {heard}"
            );
        }
    });
}

#[test]
fn what_cannot_be_identified_is_refused_with_a_sentence() {
    with_plant(plant(6.34, 0.022, 0), |desk| {
        for (line, error, words) in [
            ("$ID", "error:93", "There is no mode to store"),
            ("$ID=store", "error:93", "There is no mode to store"),
            ("$ID=X1000 F9600", "error:15", "of the segment"),
            ("$ID=X10", "error:22", ""),
            ("$ID=G90 X10 F600", "error:21", ""),
            ("$ID=X0 F600", "error:92", "excites nothing"),
        ] {
            let heard = desk.ask(line);
            assert!(
                heard.contains(error) && heard.contains(words),
                "{line}: {heard}"
            );
        }
        // at a crawl nothing swings
        let heard = desk.ask("$ID=X0.1 F1");
        assert!(
            heard.contains("error:92") && heard.contains("nothing stands out"),
            "{heard}"
        );
        assert!(desk.ask("$X").contains("ok"));

        desk.plant = None;
        let heard = desk.ask("$ID=X1 F600");
        assert!(
            heard.contains("error:92") && heard.contains("The accelerometer is silent"),
            "{heard}"
        );
    });
}

/// A plant whose tool is so heavy.
fn plant_with_tool(mass_kg: f64, frequency_hz: f64) -> SensedPlant {
    let mode = Mode {
        frequency_hz,
        damping: 0.02,
    };
    let config = FullConfig {
        mode: ModeMap::constant(mode),
        tool_mass_kg: mass_kg,
        ..FullConfig::default()
    };
    SensedPlant::new(config, 0)
}

/// All `[ID:…]` lines of an answer.
fn all_found(heard: &str) -> Vec<[f64; 3]> {
    let lines = heard.lines().filter(|line| line.starts_with("[ID:"));
    lines.map(found).collect()
}

/// A tool of half a kilogram pulls at the joints by a few µrad, beside their own mode.
#[test]
fn a_heavy_tools_mode_is_in_the_following_error() {
    let frequency_hz = 6.34;
    for line in ["$ID1=Y40 F9600", "$ID2=X40 F9600"] {
        with_plant(plant_with_tool(0.5, frequency_hz), |desk| {
            let (_, way) = line.split_once('=').unwrap();
            let by_tool = found(&desk.ask(&format!("$ID={way}")))[0];
            desk.run_ms(20_000);
            desk.ask(&format!("$J=G91 {}", way.replace("40", "-40")));
            desk.run_ms(20_000);
            desk.heard();
            let heard = desk.ask(line);
            let modes = all_found(&heard);
            println!("{frequency_hz} Hz, {line}: {by_tool} Hz by the tool, {heard}");
            assert_eq!(modes.len(), 2, "{heard}");
            assert!((modes[0][0] / by_tool - 1.0).abs() < 0.005, "{heard}");
        });
    }
}

/// A light tool is not felt: what the joints tell of is their own mode, of 32 Hz here, which the
/// drives of two joints and the tool tell alike.
#[test]
fn a_light_tool_leaves_the_joints_own_mode() {
    with_plant(plant_with_tool(0.05, 6.34), |desk| {
        let mut told = Vec::new();
        for line in ["$ID1=X40 F9600", "$ID2=X40 F9600", "$ID=X40 F9600"] {
            let heard = desk.ask(line);
            assert!(heard.ends_with("ok\r\n"), "{line}: {heard}");
            told.push(all_found(&heard));
            desk.run_ms(20_000);
            assert!(desk.ask("$J=G91 X-40 F9600").contains("ok"));
            desk.run_ms(20_000);
            desk.heard();
        }
        println!("{told:?}");
        let by_tool = told[2][1][0];
        assert!((30.0..34.0).contains(&by_tool), "{told:?}");
        for by_drive in [told[0][0][0], told[1][0][0]] {
            assert!((by_drive / by_tool - 1.0).abs() < 0.01, "{told:?}");
        }
    });
}

#[test]
fn drives_that_tell_nothing_are_named() {
    with_plant(plant(6.34, 0.022, 0), |desk| {
        desk.plant = None;
        let heard = desk.ask("$ID3=X1 F600");
        assert!(
            heard.contains("error:92") && heard.contains("The drives tell no following error"),
            "{heard}"
        );
    });
}

/// With a map in force, or with a prefilter chosen for each move, the test move excites as well.
#[test]
fn the_map_is_not_in_the_way_of_an_identification() {
    for settings in [
        &["$map=1,1,200,300,-50,50", "$map1=11.3/0.02"][..],
        &["$frequency=11.3", "$automatic=1"],
    ] {
        with_plant(plant(11.3, 0.02, 0), |desk| {
            for line in settings {
                assert!(desk.ask(line).ends_with("ok\r\n"), "{line}");
            }
            let before = desk.robot().config;
            let heard = desk.ask("$ID=X40 F9600");
            assert!((found(&heard)[0] / 11.3 - 1.0).abs() < 0.005, "{heard}");
            assert_eq!(desk.robot().config, before);
        });
    }
}
