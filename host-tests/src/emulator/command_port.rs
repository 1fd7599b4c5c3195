//! The firmware's command port, line by line.

use std::io::{self, BufRead, BufReader, Write};
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use super::EmulatorError;

/// How long an answer may take: a full queue of long moves keeps back an `ok`, and
/// QEMU takes in some 10 to 20 kilobytes a second.
const ANSWER_S: u64 = 300;

/// The answer to a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Parsed and queued.
    Ok,
    /// Refused.
    Error {
        /// Grbl's number.
        code: u8,
        /// The `[MSG:…]` before it, if there was one.
        message: String,
    },
}

/// What the firmware says, apart from empty lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Said {
    Answer(Answer),
    Status(String),
    Banner,
    /// `[…]` without the brackets.
    Info(String),
}

/// The port, read by a thread of its own.
pub struct CommandPort {
    stream: TcpStream,
    lines: Receiver<io::Result<String>>,
}

impl CommandPort {
    pub fn new(stream: TcpStream) -> Result<Self, EmulatorError> {
        let reader = BufReader::new(stream.try_clone()?);
        let (to_us, lines) = channel();
        thread::spawn(move || {
            for line in reader.lines() {
                if to_us.send(line).is_err() {
                    break;
                }
            }
        });
        Ok(Self { stream, lines })
    }

    pub fn send(&mut self, bytes: &[u8]) -> Result<(), EmulatorError> {
        Ok(self.stream.write_all(bytes)?)
    }

    /// Waits for the banner.
    pub fn banner(&mut self) -> Result<(), EmulatorError> {
        match self.next("the banner")? {
            Said::Banner => Ok(()),
            other => Err(unforeseen(&other)),
        }
    }

    /// Waits for the answer to the oldest line without one.
    pub fn answer(&mut self) -> Result<Answer, EmulatorError> {
        let (answer, _) = self.answer_with_info()?;
        Ok(answer)
    }

    /// The same, and the `[…]` lines before it.
    pub fn answer_with_info(&mut self) -> Result<(Answer, Vec<String>), EmulatorError> {
        let mut info = Vec::new();
        loop {
            match self.next("an answer")? {
                Said::Answer(Answer::Error { code, .. }) => {
                    let message = info
                        .iter()
                        .rev()
                        .find_map(|line: &String| line.strip_prefix("MSG:"))
                        .unwrap_or("no reason given")
                        .to_owned();
                    return Ok((Answer::Error { code, message }, info));
                }
                Said::Answer(answer) => return Ok((answer, info)),
                Said::Info(line) => info.push(line),
                other => return Err(unforeseen(&other)),
            }
        }
    }

    /// Asks for the status, `<…>` without the brackets. No line may be unanswered.
    pub fn status(&mut self) -> Result<String, EmulatorError> {
        self.send(b"?")?;
        match self.next("the status")? {
            Said::Status(status) => Ok(status),
            other => Err(unforeseen(&other)),
        }
    }

    /// Whether the firmware says nothing for a while.
    pub fn is_silent_for(&mut self, time: Duration) -> bool {
        matches!(
            self.lines.recv_timeout(time),
            Err(RecvTimeoutError::Timeout)
        )
    }

    fn next(&mut self, awaited: &'static str) -> Result<Said, EmulatorError> {
        loop {
            let line = match self.lines.recv_timeout(Duration::from_secs(ANSWER_S)) {
                Ok(line) => line?,
                Err(RecvTimeoutError::Timeout) => {
                    return Err(EmulatorError::Silent(ANSWER_S, awaited));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(EmulatorError::Ended("the serial port closed".to_owned()));
                }
            };
            if !line.is_empty() {
                return parse(&line);
            }
        }
    }
}

fn unforeseen(said: &Said) -> EmulatorError {
    EmulatorError::Unforeseen(format!("{said:?}"))
}

pub fn parse(line: &str) -> Result<Said, EmulatorError> {
    let inside = |open, close| {
        line.strip_prefix(open)
            .and_then(|rest: &str| rest.strip_suffix(close))
            .map(str::to_owned)
    };
    if line == "ok" {
        return Ok(Said::Answer(Answer::Ok));
    }
    if let Some(code) = line.strip_prefix("error:") {
        let code = code
            .parse()
            .map_err(|_| EmulatorError::Unforeseen(line.to_owned()))?;
        let message = String::new();
        return Ok(Said::Answer(Answer::Error { code, message }));
    }
    if line.starts_with("Grbl ") {
        return Ok(Said::Banner);
    }
    if line.starts_with("[MSG:panic") {
        return Err(EmulatorError::Unforeseen(line.to_owned()));
    }
    inside("<", ">")
        .map(Said::Status)
        .or_else(|| inside("[", "]").map(Said::Info))
        .ok_or_else(|| EmulatorError::Unforeseen(line.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_told_apart() {
        assert_eq!(parse("ok").unwrap(), Said::Answer(Answer::Ok));
        assert_eq!(
            parse("<Idle|FS:0,0>").unwrap(),
            Said::Status("Idle|FS:0,0".to_owned())
        );
        assert_eq!(
            parse("[OPT:,64,1024]").unwrap(),
            Said::Info("OPT:,64,1024".to_owned())
        );
        assert_eq!(parse("Grbl 1.1h ['$' for help]").unwrap(), Said::Banner);
        for bad in ["error:x", "okay", "[MSG:panic in x line 3]", "<Idle"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
