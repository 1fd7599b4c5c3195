//! The emulated board with its ports left to others.

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

use super::EmulatorError;
use super::command_port::{Answer, Said, parse};
use super::qemu::{Pace, Qemu};

/// How long the banner, or the answer to a setting, may take.
const ANSWER_S: u64 = 30;

/// A booted board. Dropping it ends QEMU.
pub struct EmulatedBoard {
    /// Its command port; every line so far has been answered.
    pub commands: TcpStream,
    /// Its setpoint port.
    pub setpoints: TcpStream,
    qemu: Qemu,
}

impl EmulatedBoard {
    /// Boots `image`, waits for its banner, and sends settings (`name=value`), a line each.
    /// A file for the flash keeps what the board keeps.
    pub fn boot(
        image: &Path,
        pace: Pace,
        flash: Option<&Path>,
        settings: &[String],
    ) -> Result<Self, EmulatorError> {
        let (qemu, [mut commands, setpoints]) = Qemu::boot(image, pace, flash)?;
        commands.set_read_timeout(Some(Duration::from_secs(ANSWER_S)))?;
        // Nothing is said unasked, so the reader holds nothing back when it is dropped.
        let mut reader = BufReader::new(commands.try_clone()?);
        while hear(&mut reader)? != Said::Banner {}
        for (index, setting) in settings.iter().enumerate() {
            let line = format!("${setting}");
            std::io::Write::write_all(&mut commands, format!("{line}\n").as_bytes())?;
            let mut message = String::new();
            loop {
                match hear(&mut reader)? {
                    Said::Answer(Answer::Ok) => break,
                    Said::Answer(Answer::Error { code, .. }) => {
                        let number = index + 1;
                        return Err(EmulatorError::Refused {
                            number,
                            line,
                            code,
                            message,
                        });
                    }
                    Said::Info(info) => message = info,
                    Said::Status(_) | Said::Banner => {}
                }
            }
        }
        commands.set_read_timeout(None)?;
        Ok(Self {
            commands,
            setpoints,
            qemu,
        })
    }

    /// What QEMU said when it ended.
    pub fn epitaph(&mut self) -> EmulatorError {
        self.qemu.epitaph()
    }
}

fn hear(reader: &mut impl BufRead) -> Result<Said, EmulatorError> {
    loop {
        let mut line = String::new();
        match reader.read_line(&mut line) {
            Ok(0) => {
                return Err(EmulatorError::Ended("the serial port closed".to_owned()));
            }
            Ok(_) => {}
            Err(_) => return Err(EmulatorError::Silent(ANSWER_S, "an answer")),
        }
        let line = line.trim_end();
        if !line.is_empty() {
            return parse(line);
        }
    }
}
