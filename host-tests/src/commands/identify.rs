//! `stillpoint identify`: frequency and damping from a free decay.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Error, Result, anyhow};
use clap::{Args, ValueEnum};
use planner_core::identify::{
    DAMPING_WITHIN, FREQUENCY_WITHIN, Identified, IdentifiedMode, identify,
};
use serde::Serialize;

use super::{Failure, identify_grid};
use crate::link::{Address, Connection, LinkError, codes};
use crate::pictures;
use crate::record_file::RecordFile;
use crate::sender::{self, Session, SessionError};
use crate::survey::{Grid, found};

/// Exit status: the link could not be opened, or was lost.
pub(super) const LINK: u8 = 5;

/// How long a move, a record and an identification may take: seconds, but an emulated controller's
/// are longer on a machine that is busy.
pub(super) const PATIENCE: Duration = Duration::from_secs(300);

/// Arguments of `identify`.
#[derive(Args, Debug)]
#[command(after_help = "\
On a controller it moves the robot, records what the accelerometer on its second port sends in the \
second after the stop, and identifies there. The way has to be clear. Start and stop both excite: \
where nothing stands out, another length helps.

With --grid it does so at each node of a grid: it goes there, and the test move ends at the node. A \
record that cannot be trusted is made again with a shorter move, twice; nodes that stay open, or \
that the robot cannot reach, are filled from their neighbours. The robot has to know where it is, \
and the whole grid has to be clear, with the length of the move around it.

Exit status: 0, 1 the record or the controller's answer is a refusal, 2 wrong use, 5 the link could \
not be opened, was lost or silent.")]
pub struct IdentifyArgs {
    /// Record of an acceleration after a stop: CSV with the columns time_s and
    /// acceleration_mm_s2, 0.25 s at the least; the first 2 s count.
    #[arg(required_unless_present = "on")]
    file: Option<PathBuf>,
    /// Controller that identifies instead: serial device, pseudo-terminal, or tcp:HOST:PORT.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["file", "modes", "out"])]
    on: Option<Address>,
    /// What is listened to.
    #[arg(
        long,
        value_name = "SIGNAL",
        default_value = "accelerometer",
        requires = "on"
    )]
    pub(super) by: By,
    /// Identify at every node of a grid and make the controller's map of it:
    /// COLUMNS,ROWS,X0,X1,Y0,Y1 in mm, or the word map for the grid of its map.
    #[arg(long, value_name = "GRID", requires = "on")]
    grid: Option<Grid>,
    /// The move that excites: axis words, relative, and a feedrate.
    #[arg(
        long = "move",
        value_name = "WORDS",
        default_value = "X40 F9600",
        requires = "on"
    )]
    pub(super) excite: String,
    /// Make the mode that is found the prefilter's, or the map the controller's, and keep it.
    #[arg(long, requires = "on")]
    pub(super) store: bool,
    /// Speed of a serial device.
    #[arg(long, value_name = "BAUD", default_value_t = 115_200, requires = "on")]
    baud: u32,
    /// Modes to give: the one of the larger amplitude, or both if there are two.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=2))]
    modes: u8,
    /// Directory for a picture of record, fit and spectrum.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    pub(super) json: bool,
}

/// What a controller listens to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum By {
    /// The accelerometer on the tool.
    Accelerometer,
    /// The following error of joint 1.
    Joint1,
    /// That of joint 2.
    Joint2,
    /// That of joint 3.
    Joint3,
    /// That of joint 4.
    Joint4,
}

impl By {
    /// The command that identifies by it.
    pub(super) const fn command(self) -> &'static str {
        match self {
            Self::Accelerometer => "$ID",
            Self::Joint1 => "$ID1",
            Self::Joint2 => "$ID2",
            Self::Joint3 => "$ID3",
            Self::Joint4 => "$ID4",
        }
    }
}

/// A record with what was found in it.
#[derive(Debug)]
pub struct Identification {
    /// The record.
    pub file: RecordFile,
    /// What it shows.
    pub found: Identified,
    /// Modes to give.
    wanted: usize,
}

/// A mode as the answer has it.
#[derive(Clone, Copy, Debug, Serialize)]
struct Figures {
    frequency_hz: f32,
    damping: f32,
    confidence: f32,
}

#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    largest: Figures,
    #[serde(skip_serializing_if = "Option::is_none")]
    modes: Option<Vec<Figures>>,
}

impl From<&IdentifiedMode> for Figures {
    fn from(mode: &IdentifiedMode) -> Self {
        Self {
            frequency_hz: mode.frequency_hz,
            damping: mode.damping,
            confidence: mode.confidence,
        }
    }
}

/// Runs the command; yields what it has to say.
///
/// # Errors
/// A record that cannot be read or believed, in one sentence.
pub fn execute(args: &IdentifyArgs) -> Result<String, Failure> {
    if let Some(address) = &args.on {
        return on_controller(args, address);
    }
    let file = args.file.as_deref().unwrap_or(Path::new(""));
    let identification = Identification::of(file, usize::from(args.modes))?;
    let written = args
        .out
        .as_deref()
        .map(|directory| write_picture(directory, &identification))
        .transpose()?;
    if args.json {
        let modes: Vec<Figures> = identification.modes().map(Figures::from).collect();
        let answer = Answer {
            largest: modes[0],
            modes: (args.modes > 1).then_some(modes),
        };
        return Ok(serde_json::to_string(&answer).map_err(Error::from)?);
    }
    let mut text = identification.text();
    if let Some(path) = written {
        text += &format!("\n\nLook at:\n  {}", path.display());
    }
    Ok(text)
}

/// Lets a controller identify; yields what it has to say.
fn on_controller(args: &IdentifyArgs, address: &Address) -> Result<String, Failure> {
    let link = |error: LinkError| Failure::new(LINK, error);
    let connection = Connection::open(address, args.baud).map_err(link)?;
    let mut session = Session::begin(connection, false).map_err(|error| match error {
        SessionError::Link(error) => link(error),
        error => Failure::from(Error::from(error)),
    })?;
    if let Some(grid) = &args.grid {
        return identify_grid::survey(args, grid, address, &mut session);
    }
    let line = format!("{}={}", args.by.command(), args.excite);
    let answer = session.ask_patiently(&line, PATIENCE).map_err(link)?;
    let info = accepted(address, &line, answer)?;
    let mut modes = found(&info).into_iter();
    let first = modes.next().map(|mode| mode.map(|value| value as f32));
    let Some([frequency_hz, damping, confidence]) = first else {
        return Err(anyhow!("{address}: the controller did not say what it found").into());
    };
    if args.store {
        let line = "$ID=store";
        let answer = session.ask(line).map_err(link)?;
        accepted(address, line, answer)?;
    }
    let largest = Figures {
        frequency_hz,
        damping,
        confidence,
    };
    if args.json {
        let modes = None;
        let answer = Answer { largest, modes };
        return Ok(serde_json::to_string(&answer).map_err(Error::from)?);
    }
    let stored = if args.store {
        "The prefilter is made for it from now on."
    } else {
        "Store it with --store, or the line $ID=store."
    };
    let mut text = format!("{frequency_hz} Hz, damping {damping}, confidence {confidence}\n");
    for [frequency_hz, damping, confidence] in modes {
        text +=
            &format!("Beside it: {frequency_hz} Hz, damping {damping}, confidence {confidence}\n");
    }
    Ok(text + stored)
}

/// What was said with a line that was accepted, or the sentence of its refusal.
fn accepted(address: &Address, line: &str, answer: sender::Answer) -> Result<Vec<String>> {
    match answer.error {
        None => Ok(answer.info),
        Some(code) => {
            let sentence = answer
                .messages
                .last()
                .map_or_else(|| codes::error(code), String::as_str);
            Err(anyhow!("{address}: {line} was refused: {sentence}"))
        }
    }
}

impl Identification {
    /// Identifies up to so many modes from a file.
    ///
    /// # Errors
    /// The file cannot be read, or not be believed.
    fn of(path: &Path, wanted: usize) -> Result<Self> {
        let file = RecordFile::read(path)?;
        let found = file
            .record()
            .and_then(|mut record| identify(&mut record))
            .map_err(|refusal| anyhow!("{}: {refusal}", file.name))?;
        Ok(Self {
            file,
            found,
            wanted,
        })
    }

    /// The modes to give.
    pub fn modes(&self) -> impl Iterator<Item = &IdentifiedMode> {
        self.found.modes.iter().take(self.wanted)
    }

    /// The modes in one line.
    #[must_use]
    pub fn in_words(&self) -> String {
        let modes = self.modes().map(|mode| {
            let percent = 100.0 * mode.confidence;
            let (frequency, damping) = (mode.frequency_hz, mode.damping);
            format!("{frequency:.3} Hz, damping {damping:.4}, confidence {percent:.0} %")
        });
        modes.collect::<Vec<_>>().join("; ")
    }

    fn text(&self) -> String {
        let used_s = self.file.used().len() as f64 / self.file.rate_hz;
        let length = if used_s < self.file.length_s() {
            format!("the first {used_s:.2} s of {:.2} s", self.file.length_s())
        } else {
            format!("{used_s:.2} s")
        };
        let mut lines = vec![format!(
            "{}: {length} at {:.0} Hz",
            self.file.name, self.file.rate_hz
        )];
        for mode in self.modes() {
            lines.push(format!(
                "\n{:.4} Hz, damping {:.5}, amplitude {:.4} mm/s²\n\
                 confidence {:.3}: the probability that the frequency is right within {:.1} % and the\n\
                 damping within {DAMPING_WITHIN}, if what the fit leaves is noise",
                mode.frequency_hz,
                mode.damping,
                mode.amplitude(),
                mode.confidence,
                100.0 * FREQUENCY_WITHIN,
            ));
        }
        if self.found.modes.len() < self.wanted {
            lines.push("\nThere is no second mode in this record.".into());
        }
        lines.push(format!(
            "\nThe fit leaves {:.4} mm/s² RMS of the record.",
            self.found.residual
        ));
        lines.join("\n")
    }
}

fn write_picture(directory: &Path, identification: &Identification) -> Result<PathBuf> {
    let at = |path: &Path| format!("{} cannot be written", path.display());
    fs::create_dir_all(directory).with_context(|| at(directory))?;
    let path = directory.join("identified.svg");
    fs::write(&path, pictures::draw_identified(identification)?).with_context(|| at(&path))?;
    Ok(path)
}
