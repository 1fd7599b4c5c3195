//! `send --checksums` over a link that damages bytes both ways.

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use super::support::{Emulator, command, json, status};

/// Carries bytes one way, and damages so many in ten thousand: flips one of their low bits,
/// drops or doubles them. No flip makes a reset or a hold of a character of a program.
fn carry(mut from: TcpStream, mut to: TcpStream, per_myriad: u32, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut bytes = [0; 1024];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        let mut carried = Vec::new();
        for &byte in &bytes[..count] {
            if random.random_range(0..10_000) >= per_myriad {
                carried.push(byte);
                continue;
            }
            match random.random_range(0..3) {
                0 => carried.push(byte ^ (1 << random.random_range(0..3_u32))),
                1 => {}
                _ => carried.extend([byte, byte]),
            }
        }
        if to.write_all(&carried).is_err() {
            break;
        }
    }
}

/// A port that leads to another one, damaged.
fn noisy(port: u16, per_myriad: u32) -> u16 {
    let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let here = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        let (client, _) = listener.accept().unwrap();
        let controller = TcpStream::connect(("127.0.0.1", port)).unwrap();
        let (to, from) = (controller.try_clone().unwrap(), client.try_clone().unwrap());
        thread::spawn(move || carry(from, to, per_myriad, 1));
        carry(controller, client, per_myriad, 2);
    });
    here
}

/// Relative moves: one that came twice, or not at all, would leave the end elsewhere.
#[test]
fn every_line_is_carried_out_once() {
    let Some(emulator) = Emulator::start(&["--fast"]) else {
        return;
    };
    let here = TempDir::new().unwrap();
    let file = here.path().join("relative.gcode");
    let moves = "G1 X0.07 Y-0.02 F6000\n".repeat(500);
    fs::write(&file, format!("G0 X250 Y0\nG91\n{moves}G90\nM2\n")).unwrap();
    let port = format!("tcp:127.0.0.1:{}", noisy(emulator.tcp, 10));
    let args = [
        "send",
        &port,
        file.to_str().unwrap(),
        "--json",
        "--checksums",
    ];
    let output = command(&args).output().unwrap();
    let summary = json(&output);
    assert_eq!(
        status(&output),
        0,
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    println!(
        "{} lines sent again, {} s",
        summary["resent"], summary["duration_s"]
    );
    assert!(summary["resent"].as_u64().unwrap() > 0);
    let position = emulator.client().await_status("<Idle");
    assert!(
        position.contains("MPos:285.000,-10.000,0.000"),
        "{position}"
    );
}
