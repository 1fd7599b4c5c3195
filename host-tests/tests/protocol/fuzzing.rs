//! Mutated lines through the whole way from byte to command.
//!
//! The seeds of the mutations are the lines of `corpus.txt`; a line that ever made trouble
//! belongs there.

use std::thread;

use host_tests::serial_loop::{Records, SerialLoop, with_controller};
use planner_core::gcode::{LineBuffer, Received};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const CORPUS: &str = include_str!("corpus.txt");

/// Inputs from one reset to the next.
const INPUTS_PER_RESET: u64 = 500;

/// One line of the corpus, or two, with some bytes changed, lost, doubled or foreign.
fn mutated(rng: &mut ChaCha8Rng, corpus: &[&str]) -> Vec<u8> {
    let mut line = corpus[rng.random_range(0..corpus.len())]
        .as_bytes()
        .to_vec();
    if rng.random_bool(0.1) {
        let other = corpus[rng.random_range(0..corpus.len())].as_bytes();
        let cut = rng.random_range(0..=line.len());
        line.truncate(cut);
        line.extend_from_slice(&other[rng.random_range(0..other.len())..]);
    }
    for _ in 0..rng.random_range(0..4) {
        let at = rng.random_range(0..=line.len());
        match rng.random_range(0..6) {
            0 if at < line.len() => line[at] ^= 1 << rng.random_range(0..8),
            1 if at < line.len() => {
                line.remove(at);
            }
            2 if at < line.len() => line.insert(at, line[at]),
            3 => line.insert(
                at,
                b"0123456789.-+*$=;() XYZCFGMNPQRIJKLST"[rng.random_range(0..37)],
            ),
            4 => line.insert(at, rng.random()),
            _ => {
                let times = rng.random_range(1..400);
                let byte = b"9 0X.("[rng.random_range(0..6)];
                line.splice(at..at, std::iter::repeat_n(byte, times));
            }
        }
    }
    line.push(if rng.random_bool(0.9) { b'\n' } else { b'\r' });
    // A reset in the middle is a test of its own: here it would hide answers.
    line.retain(|byte| !matches!(byte, 0x18 | 0x19));
    line
}

fn answers(heard: &str) -> usize {
    heard
        .split("\r\n")
        .filter(|line| *line == "ok" || line.starts_with("error:"))
        .count()
}

/// A reset, after which the controller must be as good as new.
fn revive(desk: &mut SerialLoop<'_>) {
    desk.inputs.door = false;
    desk.send(b"\n\x18");
    desk.run_ms(2500);
    desk.heard();
    desk.send(b"$X\n$RST=*\n");
    desk.run_ms(5);
    let state = desk.state();
    assert_eq!(state, "Idle", "it has not come back");
    desk.heard();
}

fn fuzz(inputs: u64, seed: u64) {
    let corpus: Vec<&str> = CORPUS.lines().collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    with_controller(Records::new(), |desk| {
        desk.run_ms(2);
        let mut done = 0;
        while done < inputs {
            revive(desk);
            desk.ask("$prefilter=zv frequency=40");
            desk.ask("G0 X200 Y0 F6000");
            let mut lines = LineBuffer::new();
            let (mut expected, mut answered) = (0, 0);
            for _ in 0..INPUTS_PER_RESET {
                done += 1;
                let input = mutated(&mut rng, &corpus);
                for byte in &input {
                    let received = lines.push(*byte);
                    expected +=
                        usize::from(matches!(received, Received::Line | Received::Overflow));
                }
                desk.send(&input);
                if done % 8 == 0 {
                    desk.run_ms(2);
                }
                answered += answers(&desk.heard());
                assert!(
                    answered <= expected,
                    "seed {seed}, input {done}: more answers than lines"
                );
            }
            // What is held, paused, locked or asleep may leave lines unanswered, and no more
            // than fit into the inbox; everything else is answered in the end.
            desk.send(b"~");
            desk.run_ms(1500);
            answered += answers(&desk.heard());
            let state = desk.state();
            assert!(
                answered == expected || state != "Idle",
                "seed {seed}, input {done}: {answered} answers to {expected} lines, and it is idle"
            );
        }
    });
}

#[test]
fn mutated_lines_are_answered_and_do_no_harm() {
    fuzz(100_000, 11);
}

#[test]
#[ignore = "ten million inputs: some minutes"]
fn ten_million_mutated_lines() {
    let threads: Vec<_> = (0..2)
        .map(|thread| thread::spawn(move || fuzz(5_000_000, 1000 + thread)))
        .collect();
    for thread in threads {
        thread.join().expect("no input makes the controller panic");
    }
}
