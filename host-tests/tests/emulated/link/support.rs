//! An emulator as a user starts it, and what is said to its controller.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::support::images;

pub const LONG: Duration = Duration::from_secs(60);

pub fn program(name: &str) -> String {
    let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("programs");
    programs.join(name).display().to_string()
}

pub fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stillpoint"));
    command.args(args);
    command
}

pub fn signal(child: &Child, signal: Signal) {
    let pid = Pid::from_raw(child.id().try_into().unwrap()).unwrap();
    kill_process(pid, signal).unwrap();
}

/// Waits for a program's end, but not for ever.
pub fn end_of(child: &mut Child) -> ExitStatus {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if start.elapsed() > LONG {
            child.kill().unwrap();
            panic!("it does not end");
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// A running `stillpoint emulate`; it ends with this value.
pub struct Emulator {
    pub child: Child,
    pub terminal: PathBuf,
    pub tcp: u16,
    pub telemetry: u16,
}

impl Emulator {
    /// None where a tool is missing and may be.
    pub fn start(args: &[&str]) -> Option<Self> {
        images()?;
        let mut child = command(&["emulate", "--json"])
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        out.read_line(&mut line).unwrap();
        let ports: Value = serde_json::from_str(&line).unwrap();
        let port = |name: &str| ports[name].as_u64().unwrap().try_into().unwrap();
        Some(Self {
            child,
            terminal: ports["pty"].as_str().unwrap().into(),
            tcp: port("tcp"),
            telemetry: port("telemetry"),
        })
    }

    pub fn terminal(&self) -> String {
        self.terminal.display().to_string()
    }

    pub fn tcp(&self) -> String {
        format!("tcp:127.0.0.1:{}", self.tcp)
    }

    pub fn telemetry(&self) -> String {
        format!("tcp:127.0.0.1:{}", self.telemetry)
    }

    /// Another client, beside the one under test.
    pub fn client(&self) -> Client {
        Client::new(self.tcp)
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        if self.child.try_wait().unwrap().is_none() {
            // One that was stopped does not hear it before it goes on.
            signal(&self.child, Signal::TERM);
            signal(&self.child, Signal::CONT);
            end_of(&mut self.child);
        }
    }
}

/// Bytes to a controller and lines from it.
pub struct Client {
    stream: TcpStream,
    lines: BufReader<TcpStream>,
}

impl Client {
    pub fn new(port: u16) -> Self {
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        let lines = BufReader::new(stream.try_clone().unwrap());
        Self { stream, lines }
    }

    pub fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).unwrap();
    }

    /// Lines up to the first that begins so.
    pub fn until(&mut self, start: &str) -> Vec<String> {
        let mut lines = Vec::new();
        loop {
            let mut line = String::new();
            assert!(self.lines.read_line(&mut line).unwrap() > 0, "{lines:?}");
            let is_it = line.starts_with(start);
            lines.push(line.trim_end().to_owned());
            if is_it {
                return lines;
            }
        }
    }

    pub fn ask(&mut self, line: &str) -> Vec<String> {
        self.send(format!("{line}\n").as_bytes());
        self.until("ok")
    }

    /// Asks for the status until it begins so.
    pub fn await_status(&mut self, start: &str) -> String {
        let begin = Instant::now();
        loop {
            self.send(b"?");
            let status = self.until("<").pop().unwrap();
            if status.starts_with(start) {
                return status;
            }
            assert!(begin.elapsed() < LONG, "{status} and not {start}");
            thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Standard output as the one JSON object that it must be.
pub fn json(output: &Output) -> Value {
    let stderr = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {stderr}"))
}

pub fn status(output: &Output) -> i32 {
    output.status.code().unwrap()
}

/// What a program that has ended left in its pipes.
pub fn outputs(child: &mut Child) -> [String; 2] {
    let mut texts = [String::new(), String::new()];
    child
        .stdout
        .take()
        .unwrap()
        .read_to_string(&mut texts[0])
        .unwrap();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut texts[1])
        .unwrap();
    texts
}
