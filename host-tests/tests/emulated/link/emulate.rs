//! `stillpoint emulate`: its ports, its pace, its end.

use std::fs;
use std::io::Read;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use planner_core::telemetry::FrameDecoder;
use rustix::process::Signal;
use tempfile::TempDir;

use super::support::{Emulator, command, end_of, signal};

#[test]
fn it_is_reached_from_this_machine_alone_and_leaves_nothing_behind() {
    let here = TempDir::new().unwrap();
    let link = here.path().join("robot");
    let Some(mut emulator) = Emulator::start(&["--link", link.to_str().unwrap()]) else {
        return;
    };
    assert_eq!(fs::read_link(&link).unwrap(), emulator.terminal);
    // 127.0.0.2 is this machine, too, and another address.
    for port in [emulator.tcp, emulator.telemetry] {
        assert!(TcpStream::connect(("127.0.0.1", port)).is_ok());
        assert!(TcpStream::connect(("127.0.0.2", port)).is_err());
    }
    emulator.client().await_status("<Idle|");
    signal(&emulator.child, Signal::INT);
    assert_eq!(end_of(&mut emulator.child).code(), Some(0));
    assert!(fs::symlink_metadata(&link).is_err(), "the link is gone");
    assert!(TcpStream::connect(("127.0.0.1", emulator.tcp)).is_err());
}

#[test]
fn it_ends_when_its_time_is_over() {
    let Some(mut emulator) = Emulator::start(&["--for", "0.5", "--fast"]) else {
        return;
    };
    assert_eq!(end_of(&mut emulator.child).code(), Some(0));
}

/// Never faster; slower only where the machine has too little for it.
#[test]
fn a_second_of_the_controller_takes_a_second() {
    let Some(emulator) = Emulator::start(&["--real-time"]) else {
        return;
    };
    let mut stream = TcpStream::connect(("127.0.0.1", emulator.telemetry)).unwrap();
    let mut decoder = FrameDecoder::new();
    let mut ticks_at_start = None;
    let (mut ticks, start) = (0, Instant::now());
    let mut bytes = [0; 4096];
    while start.elapsed() < Duration::from_secs(3) {
        let count = stream.read(&mut bytes).unwrap();
        for frame in decoder.frames(&bytes[..count]) {
            ticks = frame.sequence - *ticks_at_start.get_or_insert(frame.sequence);
        }
    }
    let pace = f64::from(ticks) / 1000.0 / start.elapsed().as_secs_f64();
    println!("{pace:.3} of real time");
    assert!((0.2..1.1).contains(&pace), "{pace}");
    assert_eq!(decoder.lost(), 0);
}

#[test]
fn what_it_cannot_use_is_named() {
    let taken = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let here = TempDir::new().unwrap();
    let file = here.path().join("file");
    fs::write(&file, "precious").unwrap();
    for (args, sentence) in [
        (["--tcp", &port], "of 127.0.0.1 cannot be opened"),
        (["--telemetry", &port], "give --telemetry another, or 0"),
        (
            ["--robot", "no.toml"],
            "no.toml: the robot file cannot be read",
        ),
        (["--for", "-1"], "give a number of seconds"),
    ] {
        let output = command(&["emulate"]).args(args).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success());
        assert!(said.contains(sentence), "{said}");
    }
    if crate::support::images().is_some() {
        let args = ["emulate", "--link", file.to_str().unwrap(), "--for", "1"];
        let output = command(&args).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains("give --link another place"), "{said}");
        assert_eq!(fs::read_to_string(&file).unwrap(), "precious");
    }
}

/// The robot's settings are in force before anybody can connect.
#[test]
fn a_robot_file_reaches_the_controller() {
    let here = TempDir::new().unwrap();
    let robot = here.path().join("robot.toml");
    fs::write(&robot, "[motion]\ncorner_tolerance_mm = 0.125\n").unwrap();
    let Some(emulator) = Emulator::start(&["--robot", robot.to_str().unwrap()]) else {
        return;
    };
    let said = emulator.client().ask("$tolerance");
    assert!(said[0].ends_with("=0.125"), "{said:?}");
}

/// The firmware's own store on the simulated flash: over an emulated board whose power fails, and
/// after the flash was damaged.
#[test]
fn settings_outlast_the_emulator_in_a_file() {
    let here = TempDir::new().unwrap();
    let flash = here.path().join("flash, of the bench");
    let args = ["--flash", flash.to_str().unwrap()];
    let Some(mut emulator) = Emulator::start(&args) else {
        return;
    };
    let mut client = emulator.client();
    assert_eq!(client.ask("$tolerance=0.375 link-timeout=2"), ["ok"]);
    assert_eq!(client.ask("G10 L2 P2 X12.5"), ["ok"]);
    signal(&emulator.child, Signal::TERM);
    end_of(&mut emulator.child);

    let emulator = Emulator::start(&args).unwrap();
    let mut client = emulator.client();
    assert_eq!(client.ask("$tolerance"), ["$11=0.375", "ok"]);
    assert_eq!(client.ask("$link-timeout"), ["$1002=2", "ok"]);
    let offsets = client.ask("$#");
    assert!(
        offsets.iter().any(|line| line.starts_with("[G55:12.500,")),
        "{offsets:?}"
    );
    drop(emulator);

    // Every bit of the first page is programmed.
    let file = fs::OpenOptions::new().write(true).open(&flash).unwrap();
    std::os::unix::fs::FileExt::write_all_at(&file, &[0; 8192], 0).unwrap();
    let emulator = Emulator::start(&args).unwrap();
    let mut client = emulator.client();
    assert_eq!(client.ask("$tolerance"), ["$11=0.5", "ok"]);
    assert_eq!(client.ask("$tolerance=0.25"), ["ok"]);
}
