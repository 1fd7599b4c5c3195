//! The words of a line, sorted into commands and values.

use super::code::{Code, CoolantChange, Groups, NonModal, PathControl, RobotCode, ToolLength};
use super::command::ProgramFlow;
use super::error::Error;
use super::line::{Line, Word};
use super::modal::{Coolant, Modal};
use super::number::Decimal;

/// Largest tool number, Grbl's.
pub(super) const MAX_TOOL: u8 = 255;

/// Letters with a value.
const VALUE_LETTERS: u32 = letters(b"CFIJKLNPQRSTXYZ");

/// Letters whose value is zero or more.
const UNSIGNED_LETTERS: u32 = letters(b"FNPST");

/// The commands and values of one line: no group and no value occurs twice, no
/// letter and no command is unknown. Whether they fit together is still open.
#[derive(Debug)]
pub(super) struct Block<'l> {
    /// The modal state, which the line's commands change.
    pub modal: &'l mut Modal,
    /// The groups of the line's commands.
    pub groups: Groups,
    pub non_modal: Option<NonModal>,
    pub tool_length: Option<ToolLength>,
    pub path_control: Option<PathControl>,
    pub flow: Option<ProgramFlow>,
    pub robot: Option<RobotCode>,
    values: &'l [Decimal],
    /// Letters whose value nothing has used, A being bit 0.
    unused: u32,
    /// Where the value of each letter stands among the values.
    places: [u8; 26],
}

impl<'l> Block<'l> {
    /// Sorts the words of a line.
    ///
    /// # Errors
    /// Codes 4, 20, 21, 23, 24, 25, 29 and 38, for the first word that is wrong.
    pub(super) fn collect(line: &'l Line, modal: &'l mut Modal) -> Result<Self, Error> {
        let mut block = Self {
            modal,
            groups: Groups::default(),
            non_modal: None,
            tool_length: None,
            path_control: None,
            flow: None,
            robot: None,
            values: line.values(),
            unused: 0,
            places: [0; 26],
        };
        let mut axes_are_used = false;
        for (place, Word { letter, value }) in (0..).zip(line.words()) {
            if !matches!(letter, b'G' | b'M') {
                block.insert(letter, value, place)?;
                continue;
            }
            let code = Code::new(letter, value)?;
            if !block.groups.insert(code.group()) {
                let number = value;
                return Err(Error::ModalConflict { letter, number });
            }
            if code.uses_axes() && core::mem::replace(&mut axes_are_used, true) {
                return Err(Error::AxisConflict);
            }
            block.set(code);
        }
        Ok(block)
    }

    /// Uses a value: what has not been used when all is done is an error.
    pub(super) fn take(&mut self, letter: u8) -> Option<Decimal> {
        let value = self.value(letter)?;
        self.unused &= !bit(letter);
        Some(value)
    }

    /// A value that has not been used.
    pub(super) fn value(&self, letter: u8) -> Option<Decimal> {
        if self.unused & bit(letter) == 0 {
            return None;
        }
        let place = self.places.get(usize::from(letter.wrapping_sub(b'A')))?;
        self.values.get(usize::from(*place)).copied()
    }

    /// A letter whose value nothing has used.
    pub(super) const fn unused(&self) -> Option<u8> {
        match self.unused {
            0 => None,
            unused => Some(b'A' + unused.trailing_zeros() as u8),
        }
    }

    fn insert(&mut self, letter: u8, value: Decimal, place: u8) -> Result<(), Error> {
        let bit = bit(letter);
        if VALUE_LETTERS & bit == 0 {
            return Err(Error::UnsupportedWord { letter });
        }
        if letter == b'T' && value >= Decimal::from_integer(i32::from(MAX_TOOL) + 1) {
            return Err(Error::ToolNumber);
        }
        if self.unused & bit != 0 {
            return Err(Error::RepeatedWord { letter });
        }
        if UNSIGNED_LETTERS & bit != 0 && value < Decimal::ZERO {
            return Err(Error::Negative { letter });
        }
        self.unused |= bit;
        if let Some(slot) = self.places.get_mut(usize::from(letter.wrapping_sub(b'A'))) {
            *slot = place;
        }
        Ok(())
    }

    const fn set(&mut self, code: Code) {
        match code {
            Code::Motion(motion) => self.modal.motion = motion,
            Code::NonModal(command) => self.non_modal = Some(command),
            Code::Plane(plane) => self.modal.plane = plane,
            Code::Units(units) => self.modal.units = units,
            Code::ToolLength(tool_length) => self.tool_length = Some(tool_length),
            Code::WorkSystem(system) => self.modal.work_system = system,
            Code::PathControl(path_control) => self.path_control = Some(path_control),
            Code::Distance(distance) => self.modal.distance = distance,
            Code::FeedMode(mode) => self.modal.feed_mode = mode,
            Code::Flow(flow) => self.flow = Some(flow),
            Code::Spindle(spindle) => self.modal.spindle = spindle,
            Code::Coolant(CoolantChange::Mist) => self.modal.coolant.mist = true,
            Code::Coolant(CoolantChange::Flood) => self.modal.coolant.flood = true,
            Code::Coolant(CoolantChange::Off) => {
                self.modal.coolant = Coolant {
                    mist: false,
                    flood: false,
                };
            }
            Code::Robot(code) => self.robot = Some(code),
            // These are what the robot does anyway, or what it does not have.
            Code::NoCutterCompensation
            | Code::NoWorkSystem
            | Code::ArcCentresIncremental
            | Code::OptionalStop
            | Code::ToolChange => {}
        }
    }
}

/// The bit of a letter; none for what is no letter.
const fn bit(letter: u8) -> u32 {
    match letter {
        b'A'..=b'Z' => 1 << (letter - b'A'),
        _ => 0,
    }
}

const fn letters(list: &[u8]) -> u32 {
    let mut bits = 0;
    let mut rest = list;
    while let [letter, after @ ..] = rest {
        bits |= bit(*letter);
        rest = after;
    }
    bits
}
