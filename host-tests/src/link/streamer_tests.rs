//! The streamer against a simulated controller, over links good and bad.

use std::collections::VecDeque;

use planner_core::gcode::{LineBuffer, Received};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// A controller as far as a sender sees it. It answers a line a turn, and withholds its answers
/// for some turns, as one does whose look-ahead is full.
struct Controller {
    bytes: LineBuffer,
    inbox: VecDeque<Vec<u8>>,
    rx_bytes: usize,
    refuses: Option<&'static str>,
    error_safe: bool,
    is_refusing: bool,
    /// Number of the last line with a checksum.
    last: Option<u32>,
    executed: Vec<String>,
    said: VecDeque<String>,
    busy_turns: u32,
}

impl Controller {
    fn new(config: StreamerConfig) -> Self {
        Self {
            bytes: LineBuffer::new(),
            inbox: VecDeque::new(),
            rx_bytes: config.rx_bytes,
            refuses: None,
            error_safe: config.error_safe,
            is_refusing: false,
            last: None,
            executed: Vec::new(),
            said: VecDeque::new(),
            busy_turns: 0,
        }
    }

    fn receive(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match self.bytes.push(byte) {
                Received::Line => self.inbox.push_back(self.bytes.line().to_vec()),
                Received::Overflow => self.inbox.push_back(b"too long".to_vec()),
                Received::Nothing | Received::Realtime(_) => {}
            }
        }
        let waiting: usize = self.inbox.iter().map(|line| line.len() + 1).sum();
        assert!(waiting <= self.rx_bytes, "{waiting} bytes wait");
    }

    fn turn(&mut self) {
        if self.busy_turns > 0 {
            self.busy_turns -= 1;
        } else if let Some(line) = self.inbox.pop_front() {
            let line = String::from_utf8(line).unwrap();
            let answer = self.answer(&line).unwrap_or_else(|code| {
                self.is_refusing = self.error_safe;
                format!("error:{code}")
            });
            self.said.push_back(answer);
        }
    }

    fn answer(&mut self, line: &str) -> Result<String, u8> {
        if line == "$ACK" {
            self.is_refusing = false;
            return Ok("ok".into());
        }
        if line.starts_with('$') {
            return Err(3);
        }
        if self.is_refusing {
            return Err(codes::REFUSED_AFTER_ERROR);
        }
        if line.is_empty() {
            return Ok("ok".into());
        }
        let (mut text, mut number) = (line.to_owned(), None);
        if let Some((before, _)) = line.split_once('*') {
            let (start, rest) = split_number(before);
            let whole = match start {
                Some(number) => wire::checked(rest, number),
                None => wire::with_checksum(before),
            };
            if whole != line {
                self.say_next();
                return Err(codes::CHECKSUM);
            }
            (text, number) = (rest.to_owned(), start);
        }
        if !text.is_empty() && !text.starts_with(['G', 'M']) {
            self.say_next();
            return Err(1);
        }
        match (self.last, number) {
            (_, number) if text == "M110" && line.contains('*') => {
                self.last = number;
                return Ok("ok".into());
            }
            (Some(last), Some(number)) if number <= last => return Ok("ok".into()),
            (Some(last), Some(number)) if number == last + 1 => self.last = Some(number),
            (Some(_), _) => {
                self.say_next();
                return Err(codes::OUT_OF_ORDER);
            }
            (None, _) => self.last = number,
        }
        if Some(text.as_str()) == self.refuses {
            self.said.push_back("[MSG:no such thing]".into());
            return Err(20);
        }
        self.executed.push(text);
        Ok("ok".into())
    }

    fn say_next(&mut self) {
        if let Some(last) = self.last {
            self.said.push_back(format!("[MSG:Next is N{}]", last + 1));
        }
    }

    fn status(&self) -> String {
        let waiting: usize = self.inbox.iter().map(|line| line.len() + 1).sum();
        let state = if self.busy_turns > 0 { "Run" } else { "Idle" };
        format!("<{state}|Bf:8,{}>", self.rx_bytes - waiting)
    }
}

/// The number of a line, and what follows it.
fn split_number(line: &str) -> (Option<u32>, &str) {
    let Some(rest) = line.strip_prefix('N') else {
        return (None, line);
    };
    let end = rest.find(|c: char| !c.is_ascii_digit());
    let (number, rest) = rest.split_at(end.unwrap_or(rest.len()));
    (number.parse().ok(), rest)
}

/// What a link does to bytes: in a thousand, so many are changed, dropped or doubled.
struct Link {
    damaged_per_mille: u32,
    random: ChaCha8Rng,
}

impl Link {
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut carried = Vec::new();
        for &byte in bytes {
            if self.random.random_range(0..1000) >= self.damaged_per_mille {
                carried.push(byte);
                continue;
            }
            match self.random.random_range(0..3) {
                // No flip makes a reset, which no sender could hide.
                0 => carried.push(byte ^ (1 << self.random.random_range(0..3_u32))),
                1 => {}
                _ => carried.extend([byte, byte]),
            }
        }
        carried
    }
}

/// Sends a program to the end, or to the given number of turns.
fn run(streamer: &mut Streamer, controller: &mut Controller, link: &mut Link, turns: u32) {
    let mut heard = Vec::new();
    for turn in 0..turns {
        if streamer.ending().is_some() {
            return;
        }
        while let Some(bytes) = streamer.take() {
            controller.receive(&link.carry(&bytes));
        }
        if link.random.random_range(0..50) == 0 {
            controller.busy_turns = link.random.random_range(0..40);
        }
        controller.turn();
        if turn % 10 == 0 {
            let status = controller.status();
            controller.said.push_back(status);
        }
        while let Some(line) = controller.said.pop_front() {
            heard.extend(link.carry((line + "\r\n").as_bytes()));
        }
        while let Some(end) = heard.iter().position(|&byte| byte == b'\n') {
            let line: Vec<u8> = heard.drain(..=end).collect();
            streamer.hear(&Reply::parse(String::from_utf8_lossy(&line).trim()));
        }
    }
}

fn program(lines: usize) -> Vec<String> {
    (0..lines).map(|n| format!("G1X{n}.5Y-{n}")).collect()
}

const PLAIN: StreamerConfig = StreamerConfig {
    rx_bytes: 128,
    checksums: false,
    error_safe: false,
};

const SAFE: StreamerConfig = StreamerConfig {
    error_safe: true,
    ..PLAIN
};

const CHECKED: StreamerConfig = StreamerConfig {
    checksums: true,
    ..SAFE
};

fn bad_link(seed: u64, damaged_per_mille: u32) -> Link {
    Link {
        damaged_per_mille,
        random: ChaCha8Rng::seed_from_u64(seed),
    }
}

fn good_link(seed: u64) -> Link {
    bad_link(seed, 0)
}

#[test]
fn every_line_arrives_once_and_in_order() {
    for config in [PLAIN, SAFE, CHECKED] {
        let mut controller = Controller::new(config);
        let mut streamer = Streamer::new(program(500), config);
        run(&mut streamer, &mut controller, &mut good_link(1), 100_000);
        assert_eq!(streamer.ending(), Some(&Ending::Done));
        assert_eq!(controller.executed, program(500));
        assert_eq!((streamer.accepted(), streamer.resent()), (500, 0));
    }
}

#[test]
fn the_buffer_is_kept_full() {
    let mut streamer = Streamer::new(vec!["G1X10Y10".into(); 100], PLAIN);
    let sent = std::iter::from_fn(|| streamer.take()).count();
    assert_eq!(sent, 128 / 9);
    streamer.hear(&Reply::Ok);
    assert_eq!(std::iter::from_fn(|| streamer.take()).count(), 1);
    // One that does not fit goes alone.
    let mut streamer = Streamer::new(vec!["G1".into(), "(".repeat(200), "G1".into()], PLAIN);
    assert_eq!(std::iter::from_fn(|| streamer.take()).count(), 1);
    streamer.hear(&Reply::Ok);
    assert_eq!(std::iter::from_fn(|| streamer.take()).count(), 1);
}

#[test]
fn a_refused_line_is_named_and_those_behind_it_are_counted() {
    let mut refusal = Refusal {
        index: 3,
        code: 20,
        message: Some("no such thing".into()),
        accepted_after: 0,
    };
    for config in [SAFE, CHECKED, PLAIN] {
        let mut controller = Controller::new(config);
        controller.refuses = Some("G1X3.5Y-3");
        let mut streamer = Streamer::new(program(500), config);
        run(&mut streamer, &mut controller, &mut good_link(2), 100_000);
        if !config.error_safe {
            // As Grbl does: what is already under way is carried out.
            refusal.accepted_after = controller.executed.len() - 3;
            assert!(refusal.accepted_after > 3, "{refusal:?}");
        } else {
            assert_eq!(controller.executed, program(3));
            assert!(!controller.is_refusing, "it was acknowledged");
        }
        assert_eq!(streamer.ending(), Some(&Ending::Refused(refusal.clone())));
    }
}

#[test]
fn alarm_and_reset_end_it() {
    for (said, ending) in [
        ("ALARM:3", Ending::Alarm(3)),
        ("Grbl 1.1h ['$' for help]", Ending::Reset),
    ] {
        for config in [PLAIN, CHECKED] {
            let mut streamer = Streamer::new(program(5), config);
            while streamer.take().is_some() {}
            streamer.hear(&Reply::parse(said));
            streamer.hear(&Reply::Ok);
            assert_eq!(streamer.ending(), Some(&ending));
            assert_eq!(streamer.take(), None);
        }
    }
}

#[test]
fn late_answers_are_waited_for_and_lost_ones_are_not() {
    let moving = Reply::parse("<Run|Bf:0,128>");
    let waiting = Reply::parse("<Idle|Bf:0,100>");
    let at_rest = Reply::parse("<Idle|Bf:15,128>");
    let mut streamer = Streamer::new(program(1), PLAIN);
    streamer.take().unwrap();
    for _ in 0..1000 {
        streamer.hear(&moving);
        streamer.hear(&waiting);
    }
    for _ in 0..4 {
        streamer.hear(&at_rest);
    }
    assert_eq!(streamer.ending(), None);
    streamer.hear(&at_rest);
    assert_eq!(streamer.ending(), Some(&Ending::AnswerLost));

    let mut streamer = Streamer::new(program(1), PLAIN);
    streamer.take().unwrap();
    streamer.hear(&at_rest);
    streamer.hear(&Reply::Ok);
    assert_eq!(streamer.ending(), Some(&Ending::Done));
}

#[test]
fn a_count_that_goes_on_from_an_earlier_program_is_begun_anew() {
    let mut controller = Controller::new(CHECKED);
    controller.last = Some(500);
    let mut streamer = Streamer::new(program(20), CHECKED);
    run(&mut streamer, &mut controller, &mut good_link(3), 10_000);
    assert_eq!(streamer.ending(), Some(&Ending::Done));
    assert_eq!(controller.executed, program(20));
}

#[test]
fn a_controller_that_does_not_count_is_found_out() {
    for answer in [Reply::Ok, Reply::Error(20)] {
        let mut streamer = Streamer::new(program(2), CHECKED);
        for _ in 0..1000 {
            if let Some(line) = streamer.take() {
                assert!(!String::from_utf8(line).unwrap().contains("G1"));
                streamer.hear(&answer);
            }
            streamer.hear(&Reply::parse("<Idle|Bf:15,128>"));
        }
        assert_eq!(streamer.ending(), Some(&Ending::Unverified));
    }
}

#[test]
fn a_link_that_is_too_bad_is_given_up() {
    let mut controller = Controller::new(CHECKED);
    controller.rx_bytes = 4096;
    let mut streamer = Streamer::new(program(500), CHECKED);
    run(
        &mut streamer,
        &mut controller,
        &mut bad_link(4, 80),
        1_000_000,
    );
    assert_eq!(streamer.ending(), Some(&Ending::Unverified));
    let executed = controller.executed;
    assert_eq!(executed, program(executed.len()));
}

/// Whatever happens to bytes in either direction: every line is carried out once and in order.
/// The seeds are fixed, because one in 65 536 damages passes a CRC-16.
#[test]
fn noise_costs_time_and_nothing_else() {
    for seed in 0..100 {
        let mut link = bad_link(seed, (seed / 10) as u32);
        // Doubled line ends may fill more than was counted.
        let config = StreamerConfig {
            rx_bytes: 4096,
            ..CHECKED
        };
        let mut controller = Controller::new(config);
        let mut streamer = Streamer::new(
            program(200),
            StreamerConfig {
                rx_bytes: 512,
                ..config
            },
        );
        run(&mut streamer, &mut controller, &mut link, 1_000_000);
        assert_eq!(streamer.ending(), Some(&Ending::Done), "seed {seed}");
        assert_eq!(controller.executed, program(200), "seed {seed}");
        println!(
            "{} ‰: {} lines sent again",
            link.damaged_per_mille,
            streamer.resent()
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Whatever is said, the streamer neither fails nor sends what is no line of the program.
    #[test]
    fn no_reply_is_too_strange(
        said in proptest::collection::vec(
            prop_oneof![
                Just("ok".to_owned()), Just("<Idle|Bf:15,128>".to_owned()),
                (0_u8..80).prop_map(|code| format!("error:{code}")),
                any::<u32>().prop_map(|n| format!("[MSG:Next is N{n}]")),
                (0_u32..25).prop_map(|n| format!("[MSG:Next is N{n}]")),
                Just("[MSG:Next is N]".to_owned()), Just("ø".to_owned()),
            ],
            0..200,
        ),
        checksums in any::<bool>(),
        error_safe in any::<bool>(),
    ) {
        let config = StreamerConfig { rx_bytes: 40, checksums, error_safe };
        let mut streamer = Streamer::new(program(20), config);
        for line in said {
            let mut bytes = 0;
            while let Some(line) = streamer.take() {
                bytes += line.len();
                prop_assert!(bytes <= 100, "it sends without end");
                let text = String::from_utf8(line).unwrap();
                let known = ["G1X", "$ACK\n", "M110*", "N10000000*"];
                let is_known = text == "\n" || known.iter().any(|known| text.contains(known));
                prop_assert!(is_known, "{text}");
            }
            streamer.hear(&Reply::parse(&line));
        }
        prop_assert!(streamer.accepted() <= 20);
    }
}
