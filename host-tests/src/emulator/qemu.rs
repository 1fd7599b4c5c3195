//! One QEMU process and its serial ports.

use std::io::{self, ErrorKind, Read};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::EmulatorError;

/// How fast virtual time passes. It is counted in instructions, 64 ns each, and by
/// nothing else (the firmware never lets the emulated core sleep), so a tick takes
/// the same number of them, and meets the same deadlines, at any pace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// Never faster than real time. A program that is streamed while it runs needs
    /// this: the queue holds so many milliseconds of motion, and the PC has as many
    /// to send the next line. If virtual time ran ahead, a PC busy with something
    /// else for a moment would starve the motion, and it would stop where it does
    /// not on the host. A QEMU that gets too little of the PC is only slower.
    #[default]
    RealTime,
    /// As fast as the PC emulates, some three times real time. For what waits for
    /// nobody, and for programs whose lines and moves the firmware holds with some
    /// time to spare. Whether it went well is to be seen in `starved`.
    Free,
}

impl Pace {
    fn icount(self) -> &'static str {
        // shift=6: an instruction takes 2^6 ns. `sleep=off` would change nothing
        // for a core that never sleeps.
        match self {
            Self::RealTime => "shift=6,align=on",
            Self::Free => "shift=6",
        }
    }
}

const PROGRAM: &str = "qemu-system-arm";

/// The board's PSRAM, in whose first bytes the flash is simulated.
const PSRAM_BYTES: u32 = 16 << 20;

/// QEMU connects within milliseconds, on a loaded machine within seconds.
const START_S: u64 = 30;

/// Finds out whether QEMU is installed, before anything long is done for its sake.
pub fn check_qemu() -> Result<(), EmulatorError> {
    let mut command = Command::new(PROGRAM);
    command.arg("--version");
    command.stdin(Stdio::null());
    command.output().map(drop).map_err(not_started)
}

fn not_started(error: io::Error) -> EmulatorError {
    match error.kind() {
        ErrorKind::NotFound => EmulatorError::NoQemu,
        _ => EmulatorError::Io(error),
    }
}

/// A running QEMU; it ends with this value.
pub struct Qemu {
    child: Child,
}

impl Qemu {
    /// Boots `image` and yields its first `PORTS` serial ports.
    ///
    /// QEMU is the client: it connects to listeners that are already open, on ports
    /// that the system chose, and does so before the core's first instruction. So
    /// no port can be taken by another, and no byte is sent to nobody.
    ///
    /// With a file for the flash, what the board keeps outlasts the emulator: the memory that
    /// the flash is simulated in is the file's, from its first byte on.
    pub fn boot<const PORTS: usize>(
        image: &Path,
        pace: Pace,
        flash: Option<&Path>,
    ) -> Result<(Self, [TcpStream; PORTS]), EmulatorError> {
        if !image.is_file() {
            return Err(EmulatorError::NoImage(image.to_path_buf()));
        }
        let mut command = Command::new(PROGRAM);
        let mut machine = "mps2-an386".to_owned();
        if let Some(flash) = flash {
            let path = std::path::absolute(flash)?.display().to_string();
            // In QEMU's options a comma is written twice.
            let path = path.replace(',', ",,");
            command.arg("-object").arg(format!(
                "memory-backend-file,id=flash,size={PSRAM_BYTES},share=on,mem-path={path}"
            ));
            machine += ",memory-backend=flash";
        }
        command
            .args(["-M", &machine, "-display", "none", "-monitor", "none"])
            .args(["-icount", pace.icount(), "-kernel"])
            .arg(image);
        let mut listeners = Vec::new();
        for port in 0..PORTS {
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
            listener.set_nonblocking(true)?;
            let number = listener.local_addr()?.port();
            // QEMU sends byte by byte; without `nodelay` each waits for the last
            // one's acknowledgement.
            command
                .arg("-chardev")
                .arg(format!(
                    "socket,id=port{port},host=127.0.0.1,port={number},nodelay=on"
                ))
                .args(["-serial", &format!("chardev:port{port}")]);
            listeners.push(listener);
        }
        let child = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(not_started)?;
        let mut qemu = Self { child };
        let mut ports = Vec::new();
        for listener in &listeners {
            ports.push(qemu.accept(listener)?);
        }
        let ports = ports
            .try_into()
            .map_err(|_| io::Error::other("a serial port is missing"))?;
        Ok((qemu, ports))
    }

    fn accept(&mut self, listener: &TcpListener) -> Result<TcpStream, EmulatorError> {
        let deadline = Instant::now() + Duration::from_secs(START_S);
        loop {
            match listener.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false)?;
                    stream.set_nodelay(true)?;
                    return Ok(stream);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Err(error.into()),
            }
            if self.child.try_wait()?.is_some() {
                return Err(self.epitaph());
            }
            if Instant::now() > deadline {
                return Err(EmulatorError::Silent(START_S, "its first connection"));
            }
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// What QEMU said when it ended.
    pub fn epitaph(&mut self) -> EmulatorError {
        let _ = self.child.kill();
        let mut words = String::new();
        if let Some(mut stderr) = self.child.stderr.take() {
            let _ = stderr.read_to_string(&mut words);
        }
        match words.lines().last() {
            Some(line) => EmulatorError::Ended(line.to_owned()),
            None => EmulatorError::Ended("it said nothing".to_owned()),
        }
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
