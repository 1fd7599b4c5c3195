//! The words of a line, sorted into commands and values.

use super::error::Error;
use super::line::{Line, Word};
use super::modal::{Distance, Motion, Units};
use super::number::Decimal;

/// Largest tool number, Grbl's.
pub(super) const MAX_TOOL: i64 = 255;

/// Path control, G61 and G64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PathControl {
    /// G61: stand still at every corner.
    ExactStop,
    /// G64: round corners within the tolerance P, or the robot's own.
    Blend,
}

/// What M0, M2 and M30 do to the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ProgramFlow {
    /// M0.
    Pause,
    /// M2, M30.
    End,
}

/// The commands and values of one line: no group and no value occurs twice, no
/// letter and no command is unknown. Whether they fit together is still open.
#[derive(Debug, Default)]
pub(super) struct Block {
    pub motion: Option<Motion>,
    pub units: Option<Units>,
    pub distance: Option<Distance>,
    pub path_control: Option<PathControl>,
    pub program_flow: Option<ProgramFlow>,
    pub dwell: bool,
    pub cancel_tool_length: bool,
    values: Values,
}

/// A G or M command that the robot knows.
#[derive(Clone, Copy)]
enum Code {
    Motion(Motion),
    Dwell,
    PlaneXy,
    Units(Units),
    NoCutterCompensation,
    NoToolLength,
    /// True for G54, the only one there is.
    WorkOffset(bool),
    PathControl(PathControl),
    Distance(Distance),
    ArcCentresIncremental,
    FeedPerMinute,
    /// None for M1, which stops nothing.
    ProgramFlow(Option<ProgramFlow>),
    Spindle,
    ToolChange,
    Coolant,
}

/// Modal groups of NIST RS274/NGC v3, table 4: one command of each to a line.
#[derive(Clone, Copy)]
enum Group {
    NonModal,
    Motion,
    Plane,
    Distance,
    ArcDistance,
    FeedMode,
    Units,
    CutterCompensation,
    ToolLength,
    WorkOffset,
    PathControl,
    ProgramFlow,
    ToolChange,
    Spindle,
    Coolant,
}

impl Block {
    /// Sorts the words of a line.
    ///
    /// # Errors
    /// Codes 4, 20, 21, 23, 24, 25, 29 and 38, for the first word that is wrong.
    pub(super) fn collect(line: &Line) -> Result<Self, Error> {
        let mut block = Self::default();
        let mut groups_seen = 0_u16;
        for &Word { letter, value } in line.words() {
            if !matches!(letter, b'G' | b'M') {
                block.values.insert(letter, value)?;
                continue;
            }
            let code = Code::new(letter, value)?;
            if matches!(code, Code::WorkOffset(false)) {
                return Err(Error::WorkOffset);
            }
            let group = 1 << code.group() as u16;
            if groups_seen & group != 0 {
                let number = value;
                return Err(Error::ModalConflict { letter, number });
            }
            groups_seen |= group;
            block.set(code);
        }
        let moves = !matches!(block.motion, None | Some(Motion::Cancelled));
        if block.cancel_tool_length && moves {
            return Err(Error::AxisConflict);
        }
        Ok(block)
    }

    /// Uses a value: what has not been used when all is done is an error.
    pub(super) fn take(&mut self, letter: u8) -> Option<Decimal> {
        self.values.slot(letter).and_then(Option::take)
    }

    /// A letter whose value nothing has used.
    pub(super) fn unused(&self) -> Option<u8> {
        let mut letters = (b'A'..=b'Z').zip(&self.values.0);
        letters.find_map(|(letter, value)| value.map(|_| letter))
    }

    const fn set(&mut self, code: Code) {
        match code {
            Code::Motion(motion) => self.motion = Some(motion),
            Code::Dwell => self.dwell = true,
            Code::Units(units) => self.units = Some(units),
            Code::NoToolLength => self.cancel_tool_length = true,
            Code::PathControl(path_control) => self.path_control = Some(path_control),
            Code::Distance(distance) => self.distance = Some(distance),
            Code::ProgramFlow(flow) => self.program_flow = flow,
            // These are what the robot does anyway, or what it does not have.
            Code::PlaneXy
            | Code::NoCutterCompensation
            | Code::WorkOffset(_)
            | Code::ArcCentresIncremental
            | Code::FeedPerMinute
            | Code::Spindle
            | Code::ToolChange
            | Code::Coolant => {}
        }
    }
}

impl Code {
    fn new(letter: u8, number: Decimal) -> Result<Self, Error> {
        let find = |tenths| match letter {
            b'G' => Self::general(tenths),
            _ => Self::miscellaneous(tenths),
        };
        if let Some(code) = number.tenths().and_then(find) {
            return Ok(code);
        }
        // As in Grbl, decimals are the error only where the integer alone would do
        // and no relative with a decimal exists (G61.1, G90.1, G91.2).
        let integer = number.integer();
        let is_integer = Decimal::from_nano(integer * 1_000_000_000) == number;
        let has_relatives = letter == b'G' && matches!(integer, 61 | 90 | 91);
        if !is_integer && !has_relatives && find(integer * 10).is_some() {
            Err(Error::NotAnInteger { letter, number })
        } else {
            Err(Error::UnsupportedCommand { letter, number })
        }
    }

    /// A G command, by ten times its number.
    const fn general(tenths: i64) -> Option<Self> {
        Some(match tenths {
            0 => Self::Motion(Motion::Rapid),
            10 => Self::Motion(Motion::Linear),
            20 => Self::Motion(Motion::ArcClockwise),
            30 => Self::Motion(Motion::ArcCounterClockwise),
            40 => Self::Dwell,
            170 => Self::PlaneXy,
            200 => Self::Units(Units::Inches),
            210 => Self::Units(Units::Millimetres),
            400 => Self::NoCutterCompensation,
            490 => Self::NoToolLength,
            540 => Self::WorkOffset(true),
            550 | 560 | 570 | 580 | 590 => Self::WorkOffset(false),
            610 => Self::PathControl(PathControl::ExactStop),
            640 => Self::PathControl(PathControl::Blend),
            800 => Self::Motion(Motion::Cancelled),
            900 => Self::Distance(Distance::Absolute),
            910 => Self::Distance(Distance::Incremental),
            911 => Self::ArcCentresIncremental,
            940 => Self::FeedPerMinute,
            _ => return None,
        })
    }

    /// An M command, by ten times its number.
    const fn miscellaneous(tenths: i64) -> Option<Self> {
        Some(match tenths {
            0 => Self::ProgramFlow(Some(ProgramFlow::Pause)),
            10 => Self::ProgramFlow(None),
            20 | 300 => Self::ProgramFlow(Some(ProgramFlow::End)),
            30 | 40 | 50 => Self::Spindle,
            60 => Self::ToolChange,
            70 | 80 | 90 => Self::Coolant,
            _ => return None,
        })
    }

    const fn group(self) -> Group {
        match self {
            Self::Motion(_) => Group::Motion,
            Self::Dwell => Group::NonModal,
            Self::PlaneXy => Group::Plane,
            Self::Units(_) => Group::Units,
            Self::NoCutterCompensation => Group::CutterCompensation,
            Self::NoToolLength => Group::ToolLength,
            Self::WorkOffset(_) => Group::WorkOffset,
            Self::PathControl(_) => Group::PathControl,
            Self::Distance(_) => Group::Distance,
            Self::ArcCentresIncremental => Group::ArcDistance,
            Self::FeedPerMinute => Group::FeedMode,
            Self::ProgramFlow(_) => Group::ProgramFlow,
            Self::Spindle => Group::Spindle,
            Self::ToolChange => Group::ToolChange,
            Self::Coolant => Group::Coolant,
        }
    }
}

/// The value of every letter given, A to Z.
#[derive(Debug, Default)]
struct Values([Option<Decimal>; 26]);

impl Values {
    fn slot(&mut self, letter: u8) -> Option<&mut Option<Decimal>> {
        self.0.get_mut(usize::from(letter.wrapping_sub(b'A')))
    }

    fn insert(&mut self, letter: u8, value: Decimal) -> Result<(), Error> {
        let known = b"CFIJKLNPRSTXYZ".contains(&letter);
        let Some(slot) = self.slot(letter).filter(|_| known) else {
            return Err(Error::UnsupportedWord { letter });
        };
        if letter == b'T' && value.integer() > MAX_TOOL {
            return Err(Error::ToolNumber);
        }
        if slot.is_some() {
            return Err(Error::RepeatedWord { letter });
        }
        if b"FNPST".contains(&letter) && value < Decimal::ZERO {
            return Err(Error::Negative { letter });
        }
        *slot = Some(value);
        Ok(())
    }
}
