//! `stillpoint monitor`: what a controller does, as it does it.

use std::io::{self, IsTerminal, Write};

use anyhow::Error;
use clap::Args;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::Failure;
use crate::link::{Address, Connection, Known, LinkError, Reply, codes};
use crate::sender::{Interrupts, Keyboard, Session, SessionError};
use crate::setpoint_watch::{SetpointWatch, Watched};

/// Exit status: the link could not be opened, or was lost.
const LINK: u8 = 5;

/// Messages that stay on the screen.
const MESSAGES: usize = 5;

/// Arguments of `monitor`.
#[derive(Args, Debug)]
#[command(after_help = "\
q or Ctrl-C ends it; the controller does not notice. Without a terminal it prints a line for \
every change.

A pseudo-terminal or serial device is for one program at a time: to watch while another one \
sends, connect to the emulator's TCP port.

Exit status: 0, 2 wrong use, 5 the link could not be opened, was lost or silent.")]
pub struct MonitorArgs {
    /// Serial device, pseudo-terminal, or tcp:HOST:PORT.
    port: Address,
    /// Where setpoint frames come from, likewise.
    #[arg(long, value_name = "PORT")]
    telemetry: Option<Address>,
    /// Speed of a serial device.
    #[arg(long, value_name = "BAUD", default_value_t = 115_200)]
    baud: u32,
    /// Speed of a serial device that setpoint frames come from.
    #[arg(long, value_name = "BAUD", default_value_t = 2_000_000)]
    telemetry_baud: u32,
    /// Print one report and end.
    #[arg(long)]
    once: bool,
    /// Print JSON, one object a line.
    #[arg(long)]
    json: bool,
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// The link cannot be opened, or is lost.
pub fn execute(args: &MonitorArgs) -> Result<String, Failure> {
    let interrupts = Interrupts::watch().map_err(|error| Failure::new(LINK, error))?;
    let watch = args.telemetry.as_ref().map(|address| {
        SetpointWatch::open(address, args.telemetry_baud).map_err(|error| link(&error))
    });
    let watch = watch.transpose()?;
    let connection = Connection::open(&args.port, args.baud).map_err(|error| link(&error))?;
    let mut session = match Session::begin(connection, false) {
        Ok(session) => session,
        Err(SessionError::Link(error)) => return Err(link(&error)),
        Err(error) => return Err(Failure::new(LINK, error)),
    };
    let mut view = View::new(args);
    if args.once {
        let watched = match &watch {
            Some(watch) => Some(watch.first().map_err(|error| link(&error))?),
            None => None,
        };
        return Ok(view.text(&session.known, watched.as_ref()));
    }
    let mut keyboard = Keyboard::open();
    while !interrupts.take_ctrl_c() && !interrupts.must_end() {
        let key = keyboard.as_mut().and_then(Keyboard::key);
        if matches!(key, Some(b'q' | b'Q')) {
            break;
        }
        let reply = session.hear();
        let watched = watch.as_ref().map(SetpointWatch::watched);
        let said = match reply {
            Ok(Some(reply)) => sentence(&reply),
            Ok(None) => None,
            Err(error) => {
                view.clear();
                return Err(link(&error));
            }
        };
        if !view.show(&session.known, watched.as_ref(), said) {
            break;
        }
    }
    view.clear();
    Ok(String::new())
}

fn link(error: &LinkError) -> Failure {
    Failure::new(LINK, Error::msg(error.to_string()))
}

/// What is worth a line of its own.
fn sentence(reply: &Reply) -> Option<String> {
    match reply {
        Reply::Message(message) => Some(message.clone()),
        Reply::Alarm(code) => Some(format!("alarm {code}: {}", codes::alarm(*code))),
        Reply::Error(code) => Some(format!("error {code}: {}", codes::error(*code))),
        Reply::Banner => Some("the controller was reset, or has started".to_owned()),
        _ => None,
    }
}

/// Where reports go: one block that changes, or a line for every change.
struct View {
    json: bool,
    screen: Option<Screen>,
    last: String,
    messages: Vec<String>,
}

struct Screen {
    area: MultiProgress,
    lines: Vec<ProgressBar>,
}

impl View {
    fn new(args: &MonitorArgs) -> Self {
        let is_live = io::stdout().is_terminal() && !args.json && !args.once;
        Self {
            json: args.json,
            screen: is_live.then(|| Screen {
                area: MultiProgress::with_draw_target(indicatif::ProgressDrawTarget::stdout()),
                lines: Vec::new(),
            }),
            last: String::new(),
            messages: Vec::new(),
        }
    }

    /// Shows what is new; whether somebody still reads it.
    fn show(&mut self, known: &Known, watched: Option<&Watched>, said: Option<String>) -> bool {
        if let Some(screen) = &mut self.screen {
            self.messages.extend(said);
            let old = self.messages.len().saturating_sub(MESSAGES);
            self.messages.drain(..old);
            let mut lines = block(known, watched);
            lines.extend(self.messages.iter().cloned());
            screen.show(&lines);
            return true;
        }
        let said = said.map(|said| match self.json {
            true => json!({ "message": said }).to_string(),
            false => said,
        });
        // What the setpoints do is a change a thousand times a second: it comes along.
        let now = self.text(known, None);
        let report = (now != self.last).then(|| self.text(known, watched));
        self.last = now;
        let mut out = io::stdout().lock();
        said.into_iter()
            .chain(report)
            .all(|line| writeln!(out, "{line}").and_then(|()| out.flush()).is_ok())
    }

    fn text(&self, known: &Known, watched: Option<&Watched>) -> String {
        if self.json {
            as_json(known, watched).to_string()
        } else {
            block(known, watched).join("  ")
        }
    }

    fn clear(&mut self) {
        if let Some(screen) = &mut self.screen {
            // The last block stays; what follows begins below it.
            for line in &screen.lines {
                line.abandon();
            }
        }
    }
}

impl Screen {
    fn show(&mut self, texts: &[String]) {
        while self.lines.len() < texts.len() {
            let line = ProgressBar::no_length();
            // A template of one message is valid.
            if let Ok(style) = ProgressStyle::with_template("{msg}") {
                line.set_style(style);
            }
            self.lines.push(self.area.add(line));
        }
        for (line, text) in self.lines.iter().zip(texts) {
            line.set_message(text.clone());
        }
    }
}

/// Everything that is known, a line each.
fn block(known: &Known, watched: Option<&Watched>) -> Vec<String> {
    let mut lines = vec![format!("{:8} {}", known.state_name(), known.position())];
    if let Some(work) = known.work_position() {
        lines.push(format!("work     {work}"));
    }
    let mut line = format!("feed     {:.0} mm/min", known.feed_mm_min.unwrap_or(0.0));
    if let Some([feed, rapid, _]) = known.overrides {
        line += &format!(", overrides: feed {feed} %, rapid {rapid} %");
    }
    lines.push(line);
    if let Some([moves, bytes]) = known.buffer {
        lines.push(format!("free     {moves} moves, {bytes} bytes"));
    }
    if !known.pins.is_empty() {
        lines.push(format!("inputs   {}", known.pins));
    }
    if let Some(number) = known.line {
        lines.push(format!("line     N{number}"));
    }
    if let Some(watched) = watched {
        lines.extend(watched.lines());
    }
    lines
}

fn as_json(known: &Known, watched: Option<&Watched>) -> Value {
    let [feed, rapid] = match known.overrides {
        Some([feed, rapid, _]) => [Some(feed), Some(rapid)],
        None => [None; 2],
    };
    let [moves, bytes] = match known.buffer {
        Some(free) => free.map(Some),
        None => [None; 2],
    };
    json!({
        "state": known.state_name(),
        "machine": known.machine,
        "offset": known.offset,
        "feed_mm_min": known.feed_mm_min,
        "free_moves": moves,
        "free_bytes": bytes,
        "feed_override_percent": feed,
        "rapid_override_percent": rapid,
        "inputs": known.pins,
        "line": known.line,
        "setpoints": watched.map(Watched::json),
    })
}
