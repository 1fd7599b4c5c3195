//! Lines into commands, by the modal state.

use crate::corner::CornerRule;
use crate::kinematics::Elbow;
use crate::pose::Pose;

use super::block::Block;
use super::code::{Group, NonModal, PathControl};
use super::command::{Command, ProgramFlow};
use super::error::Error;
use super::line::Line;
use super::modal::{
    Coolant, Defaults, Distance, FeedMode, Feedrate, Modal, Motion, Plane, Spindle,
};
use super::motion::{Frame, Travel, go, linear_to, take_axis_words, travel};
use super::number::Decimal;
use super::offset_words::offset_change;
use super::offsets::{OffsetChange, Offsets};
use super::parser_state::ParserState;
use super::position::{AxisWords, Position, nearest_pose};
use super::robot_words::robot_command;

/// Largest line number, Grbl's.
pub(super) const MAX_LINE_NUMBER: u32 = 10_000_000;

/// A whole overlap.
const PERCENT: Decimal = Decimal::from_integer(100);

/// Executes lines: the G-code of Grbl 1.1 but for probing, and the robot's own words.
///
/// Coordinates are work coordinates in mm or inches, C (yaw) in degrees. F is in mm/min or
/// in/min along the path of X, Y and Z, and in deg/min for a motion of C alone. M1 and M6
/// do nothing; S and T, and K beside I and J, are read and have no effect. A line that
/// sets the line number (M110) does nothing here.
///
/// The position is unknown at first. If the [`Defaults`] say so, an absolute G0 or G1 with
/// X and Y then tells where the robot is ([`Command::reference`]); axes that it does not
/// give are at the machine's zero.
///
/// `interpret`, let the planner accept the command, then `commit`; a line that is
/// refused, by either, is counted with `skip`.
#[derive(Clone, Debug)]
pub struct Interpreter {
    defaults: Defaults,
    modal: Modal,
    offsets: Offsets,
}

/// What a line does, and what it leaves behind once it is committed.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpreted {
    /// What to execute.
    pub command: Command,
    modal: Modal,
    change: Option<OffsetChange>,
    moves_work_zero: bool,
}

impl Interpreted {
    /// The modal state after the line.
    #[must_use]
    pub const fn modal(&self) -> &Modal {
        &self.modal
    }

    /// Whether it changes what [`Offsets::to_bytes`] yields: G10, G28.1 and G30.1.
    #[must_use]
    pub const fn stores_offsets(&self) -> bool {
        matches!(self.change, Some(OffsetChange::Stored(..)))
    }

    /// Whether it may change [`Interpreter::work_offset`].
    #[must_use]
    pub const fn moves_work_zero(&self) -> bool {
        self.moves_work_zero
    }
}

impl Interpreter {
    /// The state after power-up: G0 G17 G21 G40 G54 G64 G90 G91.1 G94 M5 M9, no feedrate,
    /// no offsets, position unknown.
    #[must_use]
    pub const fn new(defaults: Defaults) -> Self {
        Self {
            defaults,
            modal: Modal::new(&defaults),
            offsets: Offsets::NONE,
        }
    }

    /// The modal state after the last line committed.
    #[must_use]
    pub const fn modal(&self) -> &Modal {
        &self.modal
    }

    /// Work offsets and stored positions.
    #[must_use]
    pub const fn offsets(&self) -> &Offsets {
        &self.offsets
    }

    /// The modal state as `$G` shows it.
    #[must_use]
    pub const fn parser_state(&self) -> ParserState<'_> {
        ParserState(&self.modal)
    }

    /// Work zero in machine coordinates, Grbl's WCO: the offsets of the active coordinate
    /// system, of G92 and of the tool length.
    #[must_use]
    pub fn work_offset(&self) -> Pose {
        nearest_pose(&self.offsets.work_zero(self.modal.work_system()))
    }

    /// Makes what a line leaves behind the current state.
    pub fn commit(&mut self, interpreted: &Interpreted) {
        self.modal = interpreted.modal;
        if let Some(change) = &interpreted.change {
            self.offsets.apply(change);
        }
    }

    /// Counts a line that was refused.
    pub const fn skip(&mut self) {
        self.modal.lines = self.modal.lines.saturating_add(1);
    }

    /// Says where the robot is, after homing or a stop on the way; `None` if that is unknown.
    pub fn set_position(&mut self, position: Option<Pose>) {
        self.modal.position = position.map(Position::from_pose);
    }

    /// Replaces the offsets, by those kept over power-off or by none.
    pub fn set_offsets(&mut self, offsets: Offsets) {
        self.offsets = offsets;
    }

    /// Says on which side the elbow is.
    pub fn set_elbow(&mut self, elbow: Elbow) {
        self.defaults.elbow = elbow;
        self.modal.elbow = elbow;
    }

    /// Changes the robot's settings: tolerance, prefilter and elbow are theirs again.
    pub const fn set_defaults(&mut self, defaults: Defaults) {
        self.defaults = defaults;
        self.modal.corner = defaults.corner;
        self.modal.prefilter = defaults.prefilter;
        self.modal.elbow = defaults.elbow;
    }

    /// Back to the state after power-up, as Grbl's soft reset: position, G54 to G59, G28
    /// and G30 stay, G92 and the tool length offset do not. Unlike Grbl's spindle the outputs
    /// stay too: a reset must not drop what the gripper holds. The elbow is where it is.
    pub const fn reset(&mut self) {
        let Modal {
            position,
            spindle,
            coolant,
            elbow,
            ..
        } = self.modal;
        self.modal = Modal::new(&self.defaults);
        self.modal.position = position;
        self.modal.spindle = spindle;
        self.modal.coolant = coolant;
        self.modal.elbow = elbow;
        self.offsets.reset();
    }

    /// What a line does, and the modal state after it. Changes nothing.
    ///
    /// # Errors
    /// Any [`Error`] but those of [`Line::parse`] and of jogs; if several apply, mostly the
    /// one that Grbl would report.
    pub fn interpret(&self, line: &Line) -> Result<Interpreted, Error> {
        let mut modal = self.modal;
        modal.lines = modal.lines.saturating_add(1);
        if line.sets_number() {
            return Ok(self.done(modal, Command::default(), None));
        }
        let mut block = Block::collect(line, &mut modal)?;
        let line_number = take_line_number(&mut block)?.unwrap_or(block.modal.lines);
        if let Some(code) = block.robot {
            let command = robot_command(block, code, &self.offsets, line_number)?;
            return Ok(self.done(modal, command, None));
        }
        self.take_plain_values(&mut block)?;
        let dwell_s = take_dwell_s(&mut block)?;
        let words = take_axis_words(&mut block)?;
        let change = offset_change(&mut block, &self.offsets, &words)?;
        let mut command = Command {
            dwell_s,
            ..Command::default()
        };
        self.motions(&mut block, &words, line_number, &mut command)?;
        match block.unused() {
            None => {}
            Some(letter @ b'Q') => return Err(Error::UnsupportedWord { letter }),
            Some(letter) => return Err(Error::UnusedWord { letter }),
        }
        let outputs = block.modal.outputs();
        command.outputs = (outputs != self.modal.outputs()).then_some(outputs);
        command.flow = block.flow;
        if command.flow == Some(ProgramFlow::End) {
            command.outputs_after = (outputs != 0).then_some(0);
            self.end_program(block.modal);
        }
        Ok(self.done(modal, command, change))
    }

    /// What the text behind `$J=` does. Of the modal state it changes the position only.
    ///
    /// # Errors
    /// Any [`Error`] of [`Interpreter::interpret`]; 15: an axis leaves its range; 16: it
    /// has other words than axes, F, N, G20, G21, G53, G90 and G91.
    pub fn jog(&self, line: &Line) -> Result<Interpreted, Error> {
        let mut modes = self.modal;
        let mut block = Block::collect(line, &mut modes)?;
        let frame = match block.non_modal {
            None => Frame::Work(&self.offsets),
            Some(NonModal::MachineCoordinates) => Frame::Machine,
            Some(_) => return Err(Error::JogSyntax),
        };
        let allowed = [Group::Units, Group::Distance, Group::NonModal];
        if !block.groups.is_within(&allowed) {
            return Err(Error::JogSyntax);
        }
        let line_number = take_line_number(&mut block)?.unwrap_or(0);
        let f = block.take(b'F').unwrap_or_default();
        let feedrate = Feedrate::new(f, FeedMode::PerMinute, block.modal.units)?;
        let feedrate = feedrate.ok_or(Error::NoFeed)?;
        let words = take_axis_words(&mut block)?;
        if block.unused().is_some() {
            return Err(Error::JogSyntax);
        }
        if words.iter().all(Option::is_none) {
            return Err(Error::NoAxisWords);
        }
        let start = self.modal.position.ok_or(Error::PositionUnknown)?;
        let end = frame.target(block.modal, start, &words);
        let end = end.map_err(|error| match error {
            Error::OutOfRange { letter } => Error::JogOutOfRange { letter },
            error => error,
        })?;
        let motion = linear_to(
            &self.modal,
            start.to_pose(),
            end.to_pose(),
            feedrate,
            line_number,
        );
        let command = Command {
            motion,
            ..Command::default()
        };
        let modal = Modal {
            position: Some(end),
            ..self.modal
        };
        Ok(self.done(modal, command, None))
    }

    fn done(&self, modal: Modal, command: Command, change: Option<OffsetChange>) -> Interpreted {
        let active = modal.work_system();
        let moves_active = match change {
            None => false,
            Some(OffsetChange::Stored(row, _)) => row == active,
            Some(OffsetChange::G92(_) | OffsetChange::ToolLength(_)) => true,
        };
        Interpreted {
            command,
            modal,
            change,
            moves_work_zero: moves_active || active != self.modal.work_system(),
        }
    }

    /// F, S, T, and P and Q of G64.
    fn take_plain_values(&self, block: &mut Block) -> Result<(), Error> {
        let mode = block.modal.feed_mode;
        block.modal.feedrate = match block.take(b'F') {
            Some(f) => Feedrate::new(f, mode, block.modal.units)?,
            // In G93, and behind it, no feedrate of an earlier line holds.
            None if mode == FeedMode::PerMinute && self.modal.feed_mode == mode => {
                self.modal.feedrate
            }
            None => None,
        };
        if let Some(speed) = block.take(b'S') {
            block.modal.spindle_speed = speed;
        }
        if let Some(tool) = block.take(b'T') {
            block.modal.tool = u8::try_from(tool.integer()).map_err(|_| Error::ToolNumber)?;
        }
        match block.path_control {
            None => {}
            Some(PathControl::ExactStop) => block.modal.corner = CornerRule::EXACT_STOP,
            Some(PathControl::Blend) => {
                block.modal.corner = take_corner(block)?.unwrap_or(self.defaults.corner);
            }
        }
        Ok(())
    }

    /// The motions of a line: of G28 and G30, or of the motion mode.
    fn motions(
        &self,
        block: &mut Block,
        words: &AxisWords,
        line: u32,
        command: &mut Command,
    ) -> Result<(), Error> {
        let has_words = words.iter().any(Option::is_some);
        // As in Grbl, a motion sees the offsets as they are before the line, but for the
        // choice of the coordinate system.
        let mut frame = Frame::Work(&self.offsets);
        if block.non_modal == Some(NonModal::MachineCoordinates) {
            if !matches!(block.modal.motion, Motion::Rapid | Motion::Linear) {
                return Err(Error::MachineCoordinates);
            }
            frame = Frame::Machine;
        }
        if block.modal.motion == Motion::Cancelled && has_words {
            return Err(Error::AxisWordsWithoutMotion);
        }
        let moves_by_mode = has_words || block.groups.has(Group::Motion);
        match block.non_modal {
            Some(NonModal::Go(row)) => {
                let end = self.offsets.row(row);
                [command.via, command.motion] = go(block, frame, words, end, line)?;
            }
            Some(NonModal::SetWorkSystem | NonModal::SetOffset) => {}
            _ if block.tool_length.is_some() || block.modal.motion == Motion::Cancelled => {}
            _ if moves_by_mode => {
                let declares = self.defaults.first_point_declares;
                match travel(block, frame, words, line, declares)? {
                    Travel::Nothing => {}
                    Travel::Reference(pose) => command.reference = Some(pose),
                    Travel::Move(motion) => command.motion = Some(motion),
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Back to G1, G17, G54, G90, G94, M5, M9 and the robot's own corner rule, and to line
    /// 1; as in Grbl, units, feedrate and position stay.
    fn end_program(&self, modal: &mut Modal) {
        modal.motion = Motion::Linear;
        modal.plane = Plane::Xy;
        modal.distance = Distance::Absolute;
        modal.work_system = 0;
        modal.spindle = Spindle::Off;
        modal.coolant = Coolant::default();
        modal.corner = self.defaults.corner;
        modal.lines = 0;
        if modal.feed_mode == FeedMode::InverseTime {
            modal.feed_mode = FeedMode::PerMinute;
            // Its number means something else in G94.
            modal.feedrate = None;
        }
    }
}

/// The rule that G64 gives with P, a tolerance, or Q, an overlap in percent.
fn take_corner(block: &mut Block) -> Result<Option<CornerRule>, Error> {
    let needs_p = [NonModal::Dwell, NonModal::SetWorkSystem].map(Some);
    if needs_p.contains(&block.non_modal) {
        return Err(Error::OwnLine);
    }
    let units = block.modal.units;
    match (block.take(b'P'), block.take(b'Q')) {
        (None, None) => Ok(None),
        (Some(tolerance), None) => {
            let mm = units.to_mm(b'P', tolerance)?.to_f32();
            Ok(Some(CornerRule::ToleranceMm(mm)))
        }
        (None, Some(percent)) if percent >= Decimal::ZERO && percent <= PERCENT => {
            Ok(Some(CornerRule::OverlapPercent(percent.to_f32())))
        }
        (_, Some(_)) => Err(Error::CornerOverlap),
    }
}

/// The N word, decimals cut off.
fn take_line_number(block: &mut Block) -> Result<Option<u32>, Error> {
    let Some(number) = block.take(b'N') else {
        return Ok(None);
    };
    match u32::try_from(number.integer()) {
        Ok(number) if number <= MAX_LINE_NUMBER => Ok(Some(number)),
        _ => Err(Error::LineNumber),
    }
}

/// The time of G4 in seconds.
fn take_dwell_s(block: &mut Block) -> Result<Option<f32>, Error> {
    if block.non_modal != Some(NonModal::Dwell) {
        return Ok(None);
    }
    let time = block.take(b'P').ok_or(Error::NoDwellTime)?;
    Ok(Some(time.to_f32()))
}
