//! The loop closed with the firmware: it moves, listens, identifies and stores, with the full
//! plant at the other end of its second port.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use crate::support::{images, installed};
use host_tests::emulator::{EmulatedBoard, Pace, PlantPort};
use host_tests::plant::{FullConfig, Mode, ModeMap};
use host_tests::sensed_plant::SensedPlant;

/// What the firmware does not know.
const FREQUENCY_HZ: f64 = 2.9;
const DAMPING: f64 = 0.05;

/// Ticks after a stop in which the vibration counts.
const FELT_TICKS: usize = 500;
/// Ticks until it has died away.
const REST_TICKS: usize = 4000;

/// How long the emulator may take for anything.
const PATIENCE: Duration = Duration::from_secs(300);

struct Desk {
    commands: TcpStream,
    answers: BufReader<TcpStream>,
    port: PlantPort,
}

impl Desk {
    /// Sends a line; all that is said up to its answer.
    fn ask(&mut self, line: &str) -> String {
        writeln!(self.commands, "{line}").unwrap();
        let mut heard = String::new();
        loop {
            let start = heard.len();
            assert!(self.answers.read_line(&mut heard).unwrap() > 0, "{heard}");
            if heard[start..].starts_with("ok") || heard[start..].starts_with("error:") {
                return heard;
            }
        }
    }

    fn wait(&self, is_over: impl Fn(&SensedPlant) -> bool) {
        let start = Instant::now();
        while !is_over(&self.port.plant()) {
            assert!(start.elapsed() < PATIENCE);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The vibration that a move leaves, and a rest for it to die away.
    fn left_by(&mut self, line: &str) -> f64 {
        let before = self.port.plant().stops;
        let heard = self.ask(line);
        assert!(heard.ends_with("ok\r\n"), "{line}: {heard}");
        self.wait(|plant| plant.stops > before && plant.stood_ticks() >= FELT_TICKS);
        let largest = self.port.plant().largest_after_stop_mm_s2(FELT_TICKS);
        self.wait(|plant| plant.stood_ticks() >= REST_TICKS);
        largest
    }
}

#[test]
fn the_firmware_finds_the_mode_and_stills_it() {
    let Some(images) = images() else { return };
    let Some(board) = installed(EmulatedBoard::boot(&images[0], Pace::Free, None, &[])) else {
        return;
    };
    let mode = Mode {
        frequency_hz: FREQUENCY_HZ,
        damping: DAMPING,
    };
    let config = FullConfig {
        mode: ModeMap::constant(mode),
        ..FullConfig::default()
    };
    let setpoints = board.setpoints.try_clone().unwrap();
    let commands = board.commands.try_clone().unwrap();
    commands.set_read_timeout(Some(PATIENCE)).unwrap();
    let (port, _) = PlantPort::attach(setpoints, SensedPlant::new(config, 0)).unwrap();
    let mut desk = Desk {
        answers: BufReader::new(commands.try_clone().unwrap()),
        commands,
        port,
    };
    assert!(desk.ask("G0 X220 Y0").ends_with("ok\r\n"));

    let before = desk.left_by("G91 G1 X40 F9600");
    desk.left_by("X-40");
    // One after the other: what one has asked for and not used does not keep the next one waiting.
    let mut heard = String::new();
    for line in ["$ID=X40 F9600", "$ID=X-40 F9600", "$ID=X40 F9600"] {
        heard = desk.ask(line);
        assert!(heard.ends_with("ok\r\n"), "{line}: {heard}");
        let line = heard.lines().find_map(|line| line.strip_prefix("[ID:"));
        let values: Vec<f64> = line
            .unwrap_or_else(|| panic!("{heard}"))
            .trim_end_matches(']')
            .split(',')
            .map(|value| value.parse().unwrap())
            .collect();
        assert!((values[0] / FREQUENCY_HZ - 1.0).abs() < 0.005, "{heard}");
        assert!((values[1] - DAMPING).abs() < 0.002, "{heard}");
    }
    let unfiltered = desk.port.plant().largest_after_stop_mm_s2(FELT_TICKS);
    assert!(desk.ask("$ID=store").ends_with("ok\r\n"));
    desk.wait(|plant| plant.stood_ticks() >= REST_TICKS);
    desk.left_by("G91 G1 X-40 F9600");
    let after = desk.left_by("X40");
    println!(
        "{heard}{before:.1} mm/s² with the prefilter as delivered, {unfiltered:.1} while identifying, {after:.1} afterwards"
    );
    assert!(after <= 0.1 * before, "{before} {after}");

    // The samples do not keep the tick from its deadline.
    let info = desk.ask("$I");
    assert!(info.contains("overruns=0"), "{info}");
}
