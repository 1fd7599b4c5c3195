//! A controller that is there, and answers.

use std::time::{Duration, Instant};

use crate::link::{Connection, Heard, Known, LinkError, Reply, State, StatusReport, realtime};

/// How often the status is asked for.
pub const STATUS_PERIOD: Duration = Duration::from_millis(100);

/// A controller that does not answer `?` for so long is gone: it answers at once in any state.
const SILENCE: Duration = Duration::from_secs(3);

/// How long a controller may take to start: boards that a connection resets need two seconds.
const START: Duration = Duration::from_secs(5);

/// How long an answer to a `$` line may take.
const ANSWER: Duration = Duration::from_secs(5);

/// Grbl's receive buffer, where none is announced.
const GRBL_RX_BYTES: usize = 128;

/// Why no program is sent.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// There is no link, or no more.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The controller is locked.
    #[error(
        "the controller is locked in the state {0}: when it is safe, send again with --unlock, \
         after a limit alarm with --reset --unlock"
    )]
    Locked(String),
    /// It does something else.
    #[error("the controller is in the state {0}: wait until it is Idle, or reset with --reset")]
    Busy(String),
}

/// The answer to a line, and what was said before it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// Grbl's number, if it was refused.
    pub error: Option<u8>,
    /// `[NAME:…]` lines, without brackets.
    pub info: Vec<String>,
    /// `[MSG:…]` lines, without their frame.
    pub messages: Vec<String>,
    /// Values of settings.
    pub settings: Vec<(String, String)>,
}

impl Answer {
    /// Takes a line of it; whether it is the last one.
    pub fn take(&mut self, reply: Reply) -> bool {
        match reply {
            Reply::Ok => return true,
            Reply::Error(code) => {
                self.error = Some(code);
                return true;
            }
            Reply::Info(info) => self.info.push(info),
            Reply::Message(message) => self.messages.push(message),
            Reply::Setting { name, value } => self.settings.push((name, value)),
            _ => {}
        }
        false
    }
}

/// A connection, and what is known of the controller at its end.
pub struct Session {
    connection: Connection,
    /// What its reports told.
    pub known: Known,
    asked: Instant,
    last_report: Instant,
}

impl Session {
    /// Waits until the controller answers, after a reset if that is asked for.
    ///
    /// # Errors
    /// Nobody answers.
    pub fn begin(connection: Connection, reset: bool) -> Result<Self, SessionError> {
        let now = Instant::now();
        let mut session = Self {
            connection,
            known: Known::default(),
            asked: now,
            last_report: now,
        };
        if reset {
            session.send(&[realtime::SOFT_RESET])?;
            session.await_banner(START)?;
        }
        session.await_report()?;
        Ok(session)
    }

    /// Whether the controller takes a program.
    ///
    /// # Errors
    /// Its state, and what to do about it.
    pub fn check_ready(&self) -> Result<(), SessionError> {
        match &self.known.state {
            Some(State::Idle | State::Check) => Ok(()),
            Some(State::Alarm(_)) => Err(SessionError::Locked(self.known.state_name())),
            _ => Err(SessionError::Busy(self.known.state_name())),
        }
    }

    /// Unlocks the controller after an alarm.
    ///
    /// # Errors
    /// The link is lost.
    pub fn unlock(&mut self) -> Result<(), LinkError> {
        self.ask("$X")?;
        self.await_report()
    }

    /// Sends bytes as they are.
    ///
    /// # Errors
    /// The link is lost.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.connection.send(bytes)
    }

    /// Asks for the status now and then, and waits a moment for a reply. Call it all the time.
    ///
    /// # Errors
    /// The link is lost, or the controller is silent.
    pub fn hear(&mut self) -> Result<Option<Reply>, LinkError> {
        let now = Instant::now();
        if now >= self.asked + STATUS_PERIOD {
            self.asked = now;
            self.send(&[realtime::STATUS])?;
        }
        let patience = (self.asked + STATUS_PERIOD).saturating_duration_since(now);
        let reply = match self.connection.hear(patience)? {
            Heard::Reply(reply) => Some(reply),
            Heard::Nothing => None,
        };
        if let Some(Reply::Status(report)) = &reply {
            self.note(report);
        } else if self.last_report.elapsed() > SILENCE {
            let address = self.connection.address().clone();
            return Err(LinkError::Silent(address, SILENCE.as_secs_f64()));
        }
        Ok(reply)
    }

    fn note(&mut self, report: &StatusReport) {
        self.last_report = Instant::now();
        self.known.update(report);
    }

    /// Waits for the banner; whether it came.
    ///
    /// # Errors
    /// The link is lost.
    pub fn await_banner(&mut self, patience: Duration) -> Result<bool, LinkError> {
        let start = Instant::now();
        while start.elapsed() < patience {
            if self.hear()? == Some(Reply::Banner) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Waits for a report that was asked for now.
    fn await_report(&mut self) -> Result<(), LinkError> {
        let start = Instant::now();
        self.asked = start - STATUS_PERIOD;
        loop {
            // A controller that is just starting is silent for longer than a running one.
            self.last_report = Instant::now();
            if let Some(Reply::Status(_)) = self.hear()? {
                return Ok(());
            }
            if start.elapsed() > START {
                let address = self.connection.address().clone();
                return Err(LinkError::Silent(address, START.as_secs_f64()));
            }
        }
    }

    /// Sends a line and waits for its answer. No other line may be unanswered.
    ///
    /// # Errors
    /// The link is lost.
    pub fn ask(&mut self, line: &str) -> Result<Answer, LinkError> {
        self.ask_patiently(line, ANSWER)
    }

    /// Likewise, for an answer that may take so long.
    ///
    /// # Errors
    /// The link is lost.
    pub fn ask_patiently(&mut self, line: &str, patience: Duration) -> Result<Answer, LinkError> {
        self.send(format!("{line}\n").as_bytes())?;
        let mut answer = Answer::default();
        let start = Instant::now();
        while start.elapsed() < patience {
            if self.hear()?.is_some_and(|reply| answer.take(reply)) {
                return Ok(answer);
            }
        }
        let address = self.connection.address().clone();
        Err(LinkError::Silent(address, patience.as_secs_f64()))
    }

    /// Bytes of unanswered lines that the controller can hold.
    ///
    /// # Errors
    /// The link is lost.
    pub fn rx_bytes(&mut self) -> Result<usize, LinkError> {
        let mut answer = self.ask("$I")?;
        if answer.error.is_some() {
            // The rest of a line that somebody began made nonsense of it.
            answer = self.ask("$I")?;
        }
        let announced = answer.info.iter().find_map(|line| {
            let options = line.strip_prefix("OPT:")?;
            options.split(',').nth(2)?.parse().ok()
        });
        Ok(announced.unwrap_or(GRBL_RX_BYTES))
    }
}
