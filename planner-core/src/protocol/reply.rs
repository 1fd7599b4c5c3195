//! Answers of several lines, one line at a time, so that none has to wait in memory.

use core::fmt;

use crate::config::Robot;
use crate::gcode::{Interpreter, Offsets};
use crate::pose::Pose;

use super::alarm::Alarm;
use super::controller::Identity;
use super::dollar::Description;
use super::inbox::RX_BYTES;
use super::record::KeptText;
use super::refusal::ERRORS;
use super::report::Health;
use super::settings::{GROUPS, SETTINGS, Setting, Settings};
use super::status::Coordinates;
use super::text::Text;

/// An answer under way: what is told, and how many lines of it are out.
#[derive(Clone, Copy, Debug)]
pub struct Reply {
    topic: Topic,
    next: usize,
}

/// What an answer is about.
#[derive(Clone, Copy, Debug)]
pub enum Topic {
    /// The `$` commands.
    Help,
    /// Every setting.
    Settings,
    /// One setting.
    Setting(&'static Setting),
    /// The map of the mode, and which prefilters follow it.
    Map,
    /// Work offsets and stored positions.
    Offsets,
    /// The modal state.
    ParserState,
    /// What this controller is.
    BuildInfo {
        /// In grblHAL's words too.
        more: bool,
    },
    /// The start-up lines.
    StartupLines,
    /// A table of the self-description.
    Describe(Description),
}

/// All that answers are made of.
pub struct Known<'a> {
    /// The settings in force.
    pub settings: &'a Settings,
    /// The robot that planning uses.
    pub robot: &'a Robot,
    /// Modal state, work offsets and stored positions.
    pub interpreter: &'a Interpreter,
    /// Start-up lines 0 and 1.
    pub startup_lines: &'a [KeptText; 2],
    /// The user's name for this controller.
    pub build_name: &'a str,
    /// The firmware.
    pub identity: &'a Identity,
    /// How it fares.
    pub health: &'a Health,
}

impl Reply {
    /// An answer of which nothing is out yet.
    #[must_use]
    pub const fn new(topic: Topic) -> Self {
        Self { topic, next: 0 }
    }

    /// The next line; `None` after the last.
    pub fn next(&mut self, known: &Known<'_>) -> Option<Text> {
        let line = self.next;
        self.next += 1;
        match self.topic {
            Topic::Help => only(
                line,
                "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H $ID $ES $EG $EA $EE $RST= $ACK ~ ! ? ctrl-x]",
            ),
            Topic::Settings => SETTINGS.get(line).map(|setting| known.setting(setting)),
            Topic::Setting(setting) => (line == 0).then(|| known.setting(setting)),
            Topic::Map => known.map(line),
            Topic::Offsets => known.offset(line),
            Topic::ParserState => (line == 0).then(|| {
                let state = known.interpreter.parser_state();
                Text::line(format_args!("[GC:{state}]"))
            }),
            Topic::BuildInfo { more } => known.build_info(line, more),
            Topic::StartupLines => known
                .startup_lines
                .get(line)
                .map(|text| Text::line(format_args!("$N{line}={text}"))),
            Topic::Describe(description) => describe(description, line),
        }
    }
}

fn only(line: usize, text: &str) -> Option<Text> {
    (line == 0).then(|| Text::line(format_args!("{text}")))
}

fn describe(description: Description, line: usize) -> Option<Text> {
    match description {
        Description::Settings => {
            let setting = SETTINGS.get(line)?;
            Some(Text::line(format_args!("{setting}")))
        }
        Description::Groups => {
            let name = GROUPS.get(line)?;
            Some(Text::line(format_args!("[SETTINGGROUP:{line}|0|{name}]")))
        }
        Description::Alarms => {
            let alarm = Alarm::ALL.get(line)?;
            Some(Text::line(format_args!(
                "[ALARMCODE:{}||{alarm}]",
                alarm.code()
            )))
        }
        Description::Errors => {
            let (code, sentence) = ERRORS.get(line)?;
            Some(Text::line(format_args!("[ERRORCODE:{code}||{sentence}]")))
        }
    }
}

impl Known<'_> {
    fn setting(&self, setting: &Setting) -> Text {
        let value = self.settings.value(setting);
        Text::line(format_args!("${}={value}", setting.number))
    }

    /// The lines that set the map, and a message about the prefilters that follow it.
    fn map(&self, line: usize) -> Option<Text> {
        let map = &self.settings.robot.map;
        if let Some(part) = map.line(line) {
            return Some(Text::line(format_args!("${part}")));
        }
        if line != usize::from(map.rows) + 1 {
            return None;
        }
        Some(match &self.robot.follower {
            Some(follower) => Text::line(format_args!("[MSG:{follower}]")),
            None if map.is_some() => Text::line(format_args!(
                "[MSG:The map is in force when all its rows are given]"
            )),
            None => return None,
        })
    }

    /// `[G54:…]` to `[G59:…]`, `[G28:…]`, `[G30:…]`, `[G92:…]`, `[TLO:…]`, `[PRB:…]`.
    fn offset(&self, line: usize) -> Option<Text> {
        const NAMES: [&str; 9] = [
            "G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92",
        ];
        let inches = self.settings.protocol.report_inches;
        let shown = |pose| Coordinates::new(pose, inches);
        let offsets: &Offsets = self.interpreter.offsets();
        if let Some(name) = NAMES.get(line) {
            let pose = match line {
                0..=5 => offsets.work(line),
                6 => offsets.g28(),
                7 => offsets.g30(),
                _ => offsets.g92(),
            };
            return Some(Text::line(format_args!("[{name}:{}]", shown(pose))));
        }
        match line - NAMES.len() {
            0 => {
                let z = offsets.tool_length();
                Some(Text::line(format_args!("[TLO:{z:.3}]")))
            }
            1 => Some(Text::line(format_args!(
                "[PRB:{}:0]",
                shown(Pose::default())
            ))),
            _ => None,
        }
    }

    fn build_info(&self, line: usize, more: bool) -> Option<Text> {
        let Identity {
            board,
            cost_unit,
            blocks,
            stack_use,
        } = self.identity;
        let Health {
            ticks,
            worst_tick,
            overruns,
            unsent,
            starved,
        } = self.health;
        let name = self.build_name;
        let parts = |parts: fmt::Arguments<'_>| Some(Text::line(parts));
        match (line, more) {
            (0, _) => parts(format_args!("[VER:1.1h.20261123:{name}]")),
            (1, _) => parts(format_args!("[OPT:VNMH,{blocks},{RX_BYTES},4,0]")),
            (2, true) => parts(format_args!("[AXS:4:XYZC]")),
            (3, true) => parts(format_args!("[NEWOPT:ENUMS,RT+,HOME,ES]")),
            (4, true) => parts(format_args!(
                "[FIRMWARE:Stillpoint {}]",
                env!("CARGO_PKG_VERSION")
            )),
            (5, true) => parts(format_args!("[BOARD:{board}]")),
            (2, false) | (6, true) => parts(format_args!(
                "[TICK:count={ticks},worst={worst_tick} {cost_unit},overruns={overruns},unsent={unsent},starved={starved}]"
            )),
            (3, false) | (7, true) => {
                let (used, free) = stack_use();
                parts(format_args!("[STACK:used={used},free={free}]"))
            }
            _ => None,
        }
    }
}
