//! Ctrl-C, the keys that answer it, and other clients that interfere.

use std::fs::File;
use std::io::Write;
use std::os::unix::fs::OpenOptionsExt;
use std::process::{Child, Stdio};
use std::thread;
use std::time::Duration;

use rustix::fs::OFlags;
use rustix::process::Signal;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use serde_json::Value;

use super::support::{Client, Emulator, command, end_of, outputs, program, signal};

/// `send` in the middle of the corner path, with somebody at its keyboard.
struct Sending {
    child: Child,
    keyboard: File,
    other: Client,
}

impl Sending {
    fn start(emulator: &Emulator) -> Self {
        let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&ours).unwrap();
        unlockpt(&ours).unwrap();
        let name = ptsname(&ours, Vec::new()).unwrap();
        let mut options = File::options();
        let options = options.read(true).write(true);
        let no_control = OFlags::NOCTTY.bits() as i32;
        let theirs = options
            .custom_flags(no_control)
            .open(name.to_str().unwrap());
        let mut sending = Self::start_with(emulator, theirs.unwrap().into());
        sending.keyboard = ours.into();
        sending
    }

    fn start_with(emulator: &Emulator, stdin: Stdio) -> Self {
        let path = program("corner-path.gcode");
        let child = command(&["send", &emulator.terminal(), &path, "--json"])
            .stdin(stdin)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut other = emulator.client();
        other.await_status("<Run");
        thread::sleep(Duration::from_secs(1));
        Self {
            child,
            keyboard: File::open("/dev/null").unwrap(),
            other,
        }
    }

    fn hold(&mut self) {
        signal(&self.child, Signal::INT);
        self.other.await_status("<Hold:0");
    }

    fn key(&mut self, key: &[u8]) {
        // The question comes with the report of the hold, if not before.
        thread::sleep(Duration::from_millis(300));
        self.keyboard.write_all(key).unwrap();
    }

    fn end(mut self) -> (Option<i32>, Value, String) {
        let status = end_of(&mut self.child).code();
        let [out, err] = outputs(&mut self.child);
        (status, serde_json::from_str(&out).unwrap(), err)
    }
}

#[test]
fn a_hold_is_resumed_and_the_path_goes_to_its_end() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut sending = Sending::start(&emulator);
    sending.hold();
    let held = sending.other.await_status("<Hold:0");
    thread::sleep(Duration::from_secs(1));
    // It stands.
    let position = |status: &str| status.split('|').nth(1).map(str::to_owned);
    let later = sending.other.await_status("<Hold:0");
    assert_eq!(position(&held), position(&later));
    sending.key(b"r");
    let (status, summary, said) = sending.end();
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(summary["state"], "Idle");
    assert_eq!(summary["position"]["x_mm"], 270.0);
}

#[test]
fn an_abort_stops_and_locks_it() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut sending = Sending::start(&emulator);
    sending.hold();
    sending.key(b"a");
    let (status, summary, said) = sending.end();
    assert_eq!(status, Some(4), "{said}");
    assert_eq!(summary["ending"], "aborted");
    assert!(said.contains("aborted"), "{said}");
    let locked = emulator.client().await_status("<Alarm");
    assert!(!locked.contains("MPos:270.000,0.000"), "{locked}");
}

#[test]
fn a_second_ctrl_c_aborts() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut sending = Sending::start(&emulator);
    sending.hold();
    thread::sleep(Duration::from_millis(300));
    signal(&sending.child, Signal::INT);
    let (status, _, said) = sending.end();
    assert_eq!(status, Some(4), "{said}");
    emulator.client().await_status("<Alarm");
}

#[test]
fn a_held_robot_can_be_left_so() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut sending = Sending::start(&emulator);
    sending.hold();
    sending.key(b"q");
    let (status, summary, said) = sending.end();
    assert_eq!(status, Some(6), "{said}");
    assert_eq!(summary["ending"], "held");
    let mut other = emulator.client();
    other.await_status("<Hold:0");
    other.send(b"~");
    other.await_status("<Idle|MPos:270.000,0.000,0.000");
}

#[test]
fn without_a_keyboard_ctrl_c_holds_and_ends() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    for ended_by in [Signal::INT, Signal::TERM] {
        let sending = Sending::start_with(&emulator, Stdio::null());
        signal(&sending.child, ended_by);
        let (status, summary, said) = sending.end();
        assert_eq!(status, Some(6), "{said}");
        assert_eq!(summary["state"], "Hold:0");
        let mut other = emulator.client();
        other.send(b"~");
        other.await_status("<Idle|MPos:270.000,0.000,0.000");
    }
}

#[test]
fn somebody_elses_reset_is_an_alarm() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut sending = Sending::start_with(&emulator, Stdio::null());
    sending.other.send(b"\x18");
    let (status, summary, said) = sending.end();
    assert_eq!(status, Some(3), "{said}");
    assert_eq!(summary["alarm"], 3);
    assert!(
        said.contains("alarm 3") && said.contains("--unlock"),
        "{said}"
    );
}

#[test]
fn somebody_elses_hold_and_resume_are_no_end() {
    let Some(emulator) = Emulator::start(&[]) else {
        return;
    };
    let mut sending = Sending::start(&emulator);
    sending.other.send(b"!");
    sending.other.await_status("<Hold:0");
    thread::sleep(Duration::from_millis(500));
    sending.other.send(b"~");
    let (status, summary, said) = sending.end();
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(summary["position"]["x_mm"], 270.0);
}
