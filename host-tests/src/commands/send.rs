//! `stillpoint send`: a program goes to a controller.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Error, anyhow};
use clap::Args;
use planner_core::config::Robot;
use planner_core::units::TICK_HZ;
use serde::Serialize;

use super::Failure;
use crate::link::wire::{self, WireLine};
use crate::link::{
    ACKNOWLEDGE, Address, Connection, Ending, Known, LinkError, Refusal, Streamer, StreamerConfig,
    codes,
};
use crate::program_file::ProgramFile;
use crate::progress::Progress;
use crate::robot_file::RobotSettings;
use crate::sender::{
    Borrowed, Finish, Interrupts, Job, Keyboard, LiveView, Sent, Session, SessionError, run,
};
use crate::software_loop;

/// Exit statuses; `--help` and the README list them.
mod status {
    pub const REFUSED: u8 = 1;
    pub const USAGE: u8 = 2;
    pub const ALARM: u8 = 3;
    pub const ABORTED: u8 = 4;
    pub const LINK: u8 = 5;
    pub const HELD: u8 = 6;
}

/// Arguments of `send`.
#[derive(Args, Debug)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
While it runs, Ctrl-C holds the robot on its path and asks: r resumes, a aborts (soft reset), \
q leaves it held and quits; a second Ctrl-C aborts. Without a terminal to ask at, Ctrl-C holds \
and quits.

Exit status:
  0  every line was accepted and the robot stands at the program's end
  1  a line was refused; those before it were carried out
  2  wrong use: arguments, or a program that cannot be read or holds nothing to send
  3  an alarm, or the controller was not ready for a program
  4  aborted at the keyboard
  5  the link could not be opened, was lost or silent, or the controller restarted
  6  held by Ctrl-C and left so"
)]
pub struct SendArgs {
    /// Serial device, pseudo-terminal, or tcp:HOST:PORT.
    port: Address,
    /// G-code file.
    program: PathBuf,
    /// Robot file (TOML): the program is checked and planned first, which tells the time left.
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// Speed of a serial device.
    #[arg(long, value_name = "BAUD", default_value_t = 115_200)]
    baud: u32,
    /// Reset the controller first: it forgets what it was doing.
    #[arg(long)]
    reset: bool,
    /// Unlock the controller first, after an alarm and a look at the robot.
    #[arg(long)]
    unlock: bool,
    /// Number the lines, add checksums, and send again what the link has damaged.
    #[arg(long)]
    checksums: bool,
    /// After a refused line, let the controller carry out the lines already sent behind it, as
    /// Grbl does.
    #[arg(long)]
    no_error_safe: bool,
    /// Silence after which the controller holds by itself; 0 never. Other controllers than
    /// Stillpoint do not have it.
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0, value_parser = timeout)]
    link_timeout: f64,
    /// Print a summary as one JSON object, and no progress.
    #[arg(long)]
    json: bool,
}

/// What came of a program, for `--json`.
#[derive(Debug, Serialize)]
struct Summary {
    program: String,
    port: String,
    ending: &'static str,
    status: u8,
    lines: usize,
    accepted: usize,
    resent: usize,
    errors: Vec<Refused>,
    alarm: Option<u8>,
    duration_s: f64,
    state: String,
    position: Position,
}

/// A refused line.
#[derive(Debug, Serialize)]
struct Refused {
    line: usize,
    text: String,
    code: u8,
    message: String,
}

/// Where the tool is; null where the controller did not say.
#[derive(Debug, Serialize)]
struct Position {
    x_mm: Option<f64>,
    y_mm: Option<f64>,
    z_mm: Option<f64>,
    c_deg: Option<f64>,
}

/// A program that may be sent.
struct Program {
    name: String,
    lines: Vec<WireLine>,
    planned: Option<Duration>,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// How the program ended, if not well, with the exit status that tells so.
pub fn execute(args: &SendArgs) -> Result<String, Failure> {
    let program = Program::load(args)?;
    let interrupts = Interrupts::watch().map_err(|error| Failure::new(status::USAGE, error))?;
    let connection = Connection::open(&args.port, args.baud).map_err(link)?;
    let mut session = Session::begin(connection, args.reset).map_err(not_ready)?;
    if args.unlock {
        session.unlock().map_err(link)?;
    }
    session.check_ready().map_err(not_ready)?;
    let start = Instant::now();
    let mut streamer = None;
    let sent = send(args, &program, &mut session, &interrupts, &mut streamer);
    let summary = Outcome {
        args,
        program: &program,
        known: &session.known,
        accepted: streamer.as_ref().map_or(0, Streamer::accepted),
        resent: streamer.as_ref().map_or(0, Streamer::resent),
        duration: start.elapsed(),
    };
    summary.tell(sent)
}

impl Program {
    /// Everything that can be found wrong without a controller.
    fn load(args: &SendArgs) -> Result<Self, Failure> {
        let usage = |error: Error| Failure::new(status::USAGE, error);
        let file = ProgramFile::load(&args.program).map_err(|error| usage(error.into()))?;
        let name = file.name;
        let lines = wire::lines(&file.text).map_err(|error| usage(anyhow!("{name}: {error}")))?;
        if lines.is_empty() {
            let error = anyhow!("{name}: the program holds no line to send: check its name");
            return Err(usage(error));
        }
        let planned =
            match &args.robot {
                None => None,
                Some(robot) => {
                    let settings = RobotSettings::load(Some(robot));
                    let settings = settings.map_err(|error| usage(error.into()))?;
                    let duration = duration(&settings, &file.text);
                    Some(duration.map_err(|error| {
                        Failure::new(status::REFUSED, anyhow!("{name}: {error:#}"))
                    })?)
                }
            };
        Ok(Self {
            name,
            lines,
            planned,
        })
    }

    fn place(&self, index: usize) -> String {
        let WireLine { number, text } = &self.lines[index];
        format!("{}: line {number} ({text})", self.name)
    }
}

/// How long a program moves.
fn duration(settings: &RobotSettings, program: &str) -> Result<Duration, Error> {
    let robot = Robot::new(&settings.robot)?;
    let mut ticks = 0_u64;
    software_loop::run(&robot, program, |_| ticks += 1)?;
    Ok(Duration::from_secs_f64(ticks as f64 / f64::from(TICK_HZ)))
}

/// Sends the program with the settings that it is to be sent with.
fn send(
    args: &SendArgs,
    program: &Program,
    session: &mut Session,
    interrupts: &Interrupts,
    streamer: &mut Option<Streamer>,
) -> Result<Sent, LinkError> {
    let rx_bytes = session.rx_bytes()?;
    let mut borrowed = Borrowed::default();
    let wanted = !args.no_error_safe;
    let has_it = borrowed.set(session, "error-safe", f64::from(u8::from(wanted)))?;
    let error_safe = wanted && has_it;
    if error_safe {
        // Somebody may have left an error behind.
        session.ask(ACKNOWLEDGE)?;
    }
    borrowed.set(session, "link-timeout", args.link_timeout)?;
    let config = StreamerConfig {
        rx_bytes,
        checksums: args.checksums,
        error_safe,
    };
    let lines = program.lines.iter().map(|line| line.text.clone()).collect();
    let streamer = streamer.insert(Streamer::new(lines, config));
    let progress = if args.json {
        Progress::Hidden
    } else {
        Progress::Shown
    };
    let view = LiveView::new(progress, program.lines.len());
    let sent = run(Job {
        session,
        streamer,
        lines: program.lines.len(),
        planned: program.planned,
        view: &view,
        keyboard: Keyboard::open().as_mut(),
        interrupts,
    });
    view.clear();
    let sent = sent?;
    // A robot that is held keeps them: settings are for one that is done.
    if sent.finish != Finish::LeftHeld {
        borrowed.give_back(session)?;
    }
    Ok(sent)
}

/// What is known at the end.
struct Outcome<'a> {
    args: &'a SendArgs,
    program: &'a Program,
    known: &'a Known,
    accepted: usize,
    resent: usize,
    duration: Duration,
}

impl Outcome<'_> {
    /// Puts it into words, and into an exit status.
    fn tell(&self, sent: Result<Sent, LinkError>) -> Result<String, Failure> {
        let Sent { finish, message } = match sent {
            Ok(sent) => sent,
            Err(error) => {
                let summary = self.summary("link-lost", status::LINK);
                let sentence = format!("{error}; {}", self.so_far());
                return Err(self.failure(&summary, sentence));
            }
        };
        let ending = match finish {
            Finish::Aborted(said_so) => {
                let summary = self.summary("aborted", status::ABORTED);
                let state = if said_so {
                    format!(
                        "the controller is now in the state {}",
                        self.known.state_name()
                    )
                } else {
                    "the controller did not confirm the reset: look at the robot".to_owned()
                };
                let sentence =
                    format!("{}: aborted; {}; {state}", self.program.name, self.so_far());
                return Err(self.failure(&summary, sentence));
            }
            Finish::LeftHeld => {
                let summary = self.summary("held", status::HELD);
                let sentence = format!(
                    "{}: held at {} and left so; {}; ~ goes on with what the controller has, a \
                     reset forgets it",
                    self.program.name,
                    self.known.position(),
                    self.so_far()
                );
                return Err(self.failure(&summary, sentence));
            }
            Finish::Streamed(ending) => ending,
        };
        self.tell_streamed(ending, message)
    }

    fn tell_streamed(&self, ending: Ending, message: Option<String>) -> Result<String, Failure> {
        match ending {
            Ending::Done => self.done(),
            Ending::Refused(refusal) => Err(self.refused(&refusal)),
            Ending::Alarm(code) => {
                let mut summary = self.summary("alarm", status::ALARM);
                summary.alarm = Some(code);
                let said = message.map_or_else(String::new, |said| format!(" ({said})"));
                let sentence = format!(
                    "{}: alarm {code}{said}: {}; {}",
                    self.program.name,
                    codes::alarm(code),
                    self.so_far()
                );
                Err(self.failure(&summary, sentence))
            }
            Ending::Reset => self.broken("reset", "the controller was reset or has restarted"),
            Ending::AnswerLost => self.broken(
                "answer-lost",
                "an answer was lost on the link: check the cable, or send with --checksums",
            ),
            Ending::Unverified => self.broken(
                "unverified",
                "the controller does not say which line it waits for: it counts no lines, or the \
                 link is too bad; send without --checksums, or check the cable",
            ),
        }
    }

    fn done(&self) -> Result<String, Failure> {
        let summary = self.summary("done", 0);
        if self.args.json {
            return json(&summary);
        }
        let again = match self.resent {
            0 => String::new(),
            count => format!(", {count} of them more than once"),
        };
        Ok(format!(
            "{}: {} lines{again} in {:.1} s; {} at {}",
            self.program.name,
            self.accepted,
            self.duration.as_secs_f64(),
            self.known.state_name(),
            self.known.position(),
        ))
    }

    fn refused(&self, refusal: &Refusal) -> Failure {
        let Refusal {
            index,
            code,
            message,
            accepted_after,
        } = refusal;
        // The controller counts lines from its start, blank ones too; we count those of the file.
        let said = message.as_deref().map(without_line_number);
        let reason = said.unwrap_or(codes::error(*code)).to_owned();
        let after = match accepted_after {
            0 => "nothing behind it was carried out".to_owned(),
            1 => "a line that was already sent behind it was carried out".to_owned(),
            count => format!("{count} lines that were already sent behind it were carried out"),
        };
        let WireLine { number, text } = &self.program.lines[*index];
        let mut summary = self.summary("refused", status::REFUSED);
        summary.errors.push(Refused {
            line: *number,
            text: text.clone(),
            code: *code,
            message: reason.clone(),
        });
        let sentence = format!(
            "{}: error {code}: {reason}; {after}",
            self.program.place(*index)
        );
        self.failure(&summary, sentence)
    }

    fn broken(&self, ending: &'static str, why: &str) -> Result<String, Failure> {
        let summary = self.summary(ending, status::LINK);
        let sentence = format!("{}: {why}; {}", self.args.port, self.so_far());
        Err(self.failure(&summary, sentence))
    }

    fn so_far(&self) -> String {
        format!(
            "{} of {} lines were accepted",
            self.accepted,
            self.program.lines.len()
        )
    }

    fn failure(&self, summary: &Summary, sentence: String) -> Failure {
        let mut failure = Failure::new(summary.status, anyhow!(sentence));
        if self.args.json {
            failure.answer = json(summary).unwrap_or_default();
        }
        failure
    }

    fn summary(&self, ending: &'static str, status: u8) -> Summary {
        let axis = |axis: usize| self.known.machine.get(axis).copied();
        Summary {
            program: self.program.name.clone(),
            port: self.args.port.to_string(),
            ending,
            status,
            lines: self.program.lines.len(),
            accepted: self.accepted,
            resent: self.resent,
            errors: Vec::new(),
            alarm: None,
            duration_s: self.duration.as_secs_f64(),
            state: self.known.state_name(),
            position: Position {
                x_mm: axis(0),
                y_mm: axis(1),
                z_mm: axis(2),
                c_deg: axis(3),
            },
        }
    }
}

fn json(summary: &Summary) -> Result<String, Failure> {
    serde_json::to_string_pretty(summary).map_err(|error| Error::from(error).into())
}

fn link(error: LinkError) -> Failure {
    Failure::new(status::LINK, error)
}

fn not_ready(error: SessionError) -> Failure {
    match error {
        SessionError::Link(error) => link(error),
        SessionError::Locked(_) | SessionError::Busy(_) => Failure::new(status::ALARM, error),
    }
}

/// A sentence of the controller without its own count of lines.
fn without_line_number(message: &str) -> &str {
    let rest = message.strip_prefix("line ").unwrap_or(message);
    match rest.split_once(": ") {
        Some((number, sentence)) if number.bytes().all(|byte| byte.is_ascii_digit()) => sentence,
        _ => message,
    }
}

fn timeout(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.0..=3600.0).contains(&seconds) => Ok(seconds),
        _ => Err("give a number of seconds from 0 to 3600".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_controllers_own_count_is_left_out() {
        for (said, left) in [
            ("line 12: no feedrate: give F", "no feedrate: give F"),
            ("no feedrate: give F", "no feedrate: give F"),
            ("line up: first", "line up: first"),
        ] {
            assert_eq!(without_line_number(said), left);
        }
    }
}
