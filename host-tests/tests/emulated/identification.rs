//! The loop closed with the firmware: it moves, listens, identifies and stores, with the full
//! plant at the other end of its second port.

use std::convert::Infallible;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::ops::Range;
use std::time::{Duration, Instant};

use crate::support::{images, installed};
use host_tests::emulator::{EmulatedBoard, Pace, PlantPort};
use host_tests::link::Reply;
use host_tests::plant::{FullConfig, Mode, ModeMap};
use host_tests::sender::Answer;
use host_tests::sensed_plant::SensedPlant;
use host_tests::survey::{self, Finding, Grid, Survey};

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
    _board: EmulatedBoard,
}

impl Desk {
    /// The firmware with a plant of this mode, at X220 Y0; none where a tool is missing and may be.
    fn with(mode: ModeMap) -> Option<Self> {
        let images = images()?;
        let board = installed(EmulatedBoard::boot(&images[0], Pace::Free, None, &[]))?;
        let config = FullConfig {
            mode,
            ..FullConfig::default()
        };
        let setpoints = board.setpoints.try_clone().unwrap();
        let commands = board.commands.try_clone().unwrap();
        commands.set_read_timeout(Some(PATIENCE)).unwrap();
        let (port, _) = PlantPort::attach(setpoints, SensedPlant::new(config, 0)).unwrap();
        let mut desk = Self {
            answers: BufReader::new(commands.try_clone().unwrap()),
            commands,
            port,
            _board: board,
        };
        assert!(desk.ask("G0 X220 Y0").ends_with("ok\r\n"));
        Some(desk)
    }

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
        self.left_within(line, 0..FELT_TICKS)
    }

    /// Likewise, from some ticks after the stop to some others.
    fn left_within(&mut self, line: &str, ticks: Range<usize>) -> f64 {
        let before = self.port.plant().stops;
        let heard = self.ask(line);
        assert!(heard.ends_with("ok\r\n"), "{line}: {heard}");
        self.wait(|plant| plant.stops > before && plant.stood_ticks() >= ticks.end);
        let largest = self.port.plant().largest_within_mm_s2(ticks);
        self.wait(|plant| plant.stood_ticks() >= REST_TICKS);
        largest
    }
}

impl survey::Desk for Desk {
    type Error = Infallible;

    fn ask(&mut self, line: &str) -> Result<Answer, Infallible> {
        let mut answer = Answer::default();
        for line in Self::ask(self, line).lines() {
            answer.take(Reply::parse(line));
        }
        Ok(answer)
    }

    fn await_rest(&mut self) -> Result<Option<String>, Infallible> {
        let mut line = String::new();
        while !line.starts_with("<Idle") {
            self.commands.write_all(b"?").unwrap();
            line.clear();
            assert!(self.answers.read_line(&mut line).unwrap() > 0);
        }
        Ok(None)
    }
}

#[test]
fn the_firmware_finds_the_mode_and_stills_it() {
    let mode = Mode {
        frequency_hz: FREQUENCY_HZ,
        damping: DAMPING,
    };
    let Some(mut desk) = Desk::with(ModeMap::constant(mode)) else {
        return;
    };

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

/// 19 Hz near the shoulder, 10 Hz far from it.
fn frequency_hz(x: f64, y: f64) -> f64 {
    20.0 - 0.05 * (x.hypot(y) - 110.0)
}

#[test]
fn the_firmware_maps_its_mode_and_stills_it_at_both_ends() {
    let mode = ModeMap::from_fn(|[x, y, _]| Mode {
        frequency_hz: frequency_hz(x, y),
        damping: 0.02,
    });
    let Some(mut desk) = Desk::with(mode) else {
        return;
    };
    assert!(desk.ask("$prefilter=fir-zv").ends_with("ok\r\n"));
    // From 150 ms after the stop on: the joints' own modes have died down then.
    let moves = |desk: &mut Desk| {
        let lines = ["G1 X290 Y-80 F9600", "X150 Y80", "X290 Y80", "X150 Y-80"];
        let left = lines.map(|line| desk.left_within(line, 150..450).powi(2));
        (left.iter().sum::<f64>() / 4.0).sqrt()
    };
    let before = moves(&mut desk);
    let Ok(Grid::Given(grid)) = "2,2,150,290,-80,80".parse() else {
        panic!("a grid");
    };
    let survey = Survey {
        grid: *grid,
        excitation: "X40 F9600".parse().unwrap(),
        command: "$ID",
    };
    let nodes = survey
        .run(&mut desk, |visit| println!("{visit:?}"))
        .unwrap();
    for node in &nodes {
        assert!(matches!(node.visit.finding, Finding::Measured { .. }));
        let [x, y] = node.visit.place_mm;
        let error = node.frequency_hz / frequency_hz(x, y) - 1.0;
        assert!(error.abs() < 0.02, "{node:?}");
    }
    survey.store(&mut desk, &nodes).unwrap();
    desk.wait(|plant| plant.stood_ticks() >= REST_TICKS);
    let after = moves(&mut desk);
    println!("{before:.1} mm/s² with the frequency as delivered, {after:.1} with the map");
    assert!((0.01..0.25).contains(&(after / before)), "{before} {after}");
}
