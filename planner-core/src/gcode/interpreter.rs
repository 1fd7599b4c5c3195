//! Lines into commands, by the modal state.

use crate::kinematics::Elbow;
use crate::pose::Pose;
use crate::prefilter::{Kind, PrefilterConfig};

use super::block::Block;
use super::code::{Group, NonModal, PathControl, RobotCode, ToolLength};
use super::command::{Command, Move, ProgramFlow, RobotChange};
use super::error::Error;
use super::line::Line;
use super::modal::{
    Coolant, Defaults, Distance, FeedMode, Feedrate, Modal, Motion, Plane, Spindle,
};
use super::motion::{Frame, Travel, linear_to, rapid_to, take_axis_words, travel};
use super::number::Decimal;
use super::offsets::{OffsetChange, Offsets, WORK_SYSTEMS};
use super::parser_state::ParserState;
use super::position::{AxisWords, ORIGIN, Position, Z, checked, nearest_pose};

/// Largest line number, Grbl's.
pub(super) const MAX_LINE_NUMBER: u32 = 10_000_000;

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

    /// Changes the robot's settings: tolerance, prefilter and elbow are theirs again.
    pub const fn set_defaults(&mut self, defaults: Defaults) {
        self.defaults = defaults;
        self.modal.corner_tolerance_mm = defaults.corner_tolerance_mm;
        self.modal.prefilter = defaults.prefilter;
        self.modal.elbow = defaults.elbow;
    }

    /// Back to the state after power-up, as Grbl's soft reset: position, G54 to G59, G28
    /// and G30 stay, G92 and the tool length offset do not.
    pub const fn reset(&mut self) {
        let position = self.modal.position;
        self.modal = Modal::new(&self.defaults);
        self.modal.position = position;
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
            let command = self.robot_line(block, code)?;
            return Ok(self.done(modal, command, None));
        }
        self.take_plain_values(&mut block)?;
        let dwell_s = take_dwell_s(&mut block)?;
        let words = take_axis_words(&mut block)?;
        let change = self.offset_change(&mut block, &words)?;
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
            moves: motion.into_iter().collect(),
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

    /// F, S, T and the P of G64.
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
        let own = self.defaults.corner_tolerance_mm;
        match block.path_control {
            None => {}
            Some(PathControl::ExactStop) => block.modal.corner_tolerance_mm = 0.0,
            Some(PathControl::Blend) => {
                let needs_p = [NonModal::Dwell, NonModal::SetWorkSystem].map(Some);
                if needs_p.contains(&block.non_modal) {
                    return Err(Error::OwnLine);
                }
                block.modal.corner_tolerance_mm = match block.take(b'P') {
                    None => own,
                    Some(tolerance) => block.modal.units.to_mm(b'P', tolerance)?.to_f32(),
                };
            }
        }
        Ok(())
    }

    /// What G10, G28.1, G30.1, G43.1, G49, G92 and G92.1 change.
    fn offset_change(
        &self,
        block: &mut Block,
        words: &AxisWords,
    ) -> Result<Option<OffsetChange>, Error> {
        let has_words = words.iter().any(Option::is_some);
        match block.tool_length {
            Some(ToolLength::Set) => {
                let [None, None, Some(z), None] = *words else {
                    return Err(Error::ToolLengthAxis);
                };
                let length = checked(Z, z.to_nano())?;
                return Ok(Some(OffsetChange::ToolLength(length)));
            }
            Some(ToolLength::Cancel) if has_words => return Err(Error::AxisConflict),
            Some(ToolLength::Cancel) => {
                return Ok(Some(OffsetChange::ToolLength(Decimal::ZERO)));
            }
            None => {}
        }
        match block.non_modal {
            Some(NonModal::SetWorkSystem | NonModal::SetOffset) if !has_words => {
                Err(Error::NoAxisWords)
            }
            Some(NonModal::SetWorkSystem) => self.set_work_system(block, words).map(Some),
            Some(NonModal::SetOffset) => {
                let position = block.modal.position.ok_or(Error::PositionUnknown)?;
                let origin = *self.offsets.row(block.modal.work_system());
                let mut g92 = *self.offsets.g92_exact();
                for (axis, value) in g92.iter_mut().enumerate() {
                    let Some(word) = words.get(axis).copied().flatten() else {
                        continue;
                    };
                    let origin_nano = origin.get(axis).map_or(0, |value| value.to_nano());
                    let tool_nano = self.offsets.tool_length_nano(axis);
                    let nano = position.nano(axis) - origin_nano - tool_nano;
                    *value = checked(axis, nano.saturating_sub(word.to_nano()))?;
                }
                Ok(Some(OffsetChange::G92(g92)))
            }
            Some(NonModal::ResetOffset) => Ok(Some(OffsetChange::G92(ORIGIN))),
            Some(NonModal::Store(row)) => {
                let position = block.modal.position.ok_or(Error::PositionUnknown)?;
                Ok(Some(OffsetChange::Stored(row, *position.exact())))
            }
            Some(NonModal::Dwell | NonModal::Go(_) | NonModal::MachineCoordinates) | None => {
                Ok(None)
            }
        }
    }

    /// G10: L2 sets the origin of a coordinate system, L20 makes the position have the
    /// given coordinates in it.
    fn set_work_system(&self, block: &mut Block, words: &AxisWords) -> Result<OffsetChange, Error> {
        let (system, kind) = (block.take(b'P'), block.take(b'L'));
        if system.is_none() && kind.is_none() {
            return Err(Error::NoOffsetKind);
        }
        // As in Grbl, a P that is missing is the active system; decimals are cut off.
        let row = match usize::try_from(system.unwrap_or_default().integer()) {
            Ok(0) => block.modal.work_system(),
            Ok(system) if system <= WORK_SYSTEMS => system - 1,
            _ => return Err(Error::WorkOffset),
        };
        let kind = kind.unwrap_or_default();
        let position = match kind.integer() {
            2 if block.value(b'R').is_some() => {
                return Err(Error::UnsupportedWord { letter: b'R' });
            }
            2 => None,
            20 => Some(block.modal.position.ok_or(Error::PositionUnknown)?),
            _ => {
                return Err(Error::UnsupportedCommand {
                    letter: b'L',
                    number: kind,
                });
            }
        };
        let mut origin = *self.offsets.row(row);
        for (axis, value) in origin.iter_mut().enumerate() {
            let Some(word) = words.get(axis).copied().flatten() else {
                continue;
            };
            let nano = match position {
                None => word.to_nano(),
                Some(position) => (position.nano(axis) - self.offsets.overlay_nano(axis))
                    .saturating_sub(word.to_nano()),
            };
            *value = checked(axis, nano)?;
        }
        Ok(OffsetChange::Stored(row, origin))
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
        match block.non_modal {
            Some(NonModal::Go(row)) => {
                for motion in self
                    .go(block, frame, words, line, row)?
                    .into_iter()
                    .flatten()
                {
                    // There is room for both.
                    let _ = command.moves.push(motion);
                }
            }
            Some(NonModal::SetWorkSystem | NonModal::SetOffset) => {}
            _ if block.tool_length.is_some() => {}
            _ if has_words || block.has_motion_code() => {
                if block.modal.motion == Motion::Cancelled {
                    return Ok(());
                }
                let declares = self.defaults.first_point_declares;
                match travel(block, frame, words, line, declares)? {
                    Travel::Nothing => {}
                    Travel::Reference(pose) => command.reference = Some(pose),
                    Travel::Move(motion) => {
                        // There is room for it.
                        let _ = command.moves.push(motion);
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// G28 and G30: by way of the axis words, if there are any, to the stored position;
    /// with axis words, these axes only.
    fn go(
        &self,
        block: &mut Block,
        frame: Frame,
        words: &AxisWords,
        line: u32,
        row: usize,
    ) -> Result<[Option<Move>; 2], Error> {
        let modal = &mut *block.modal;
        let start = modal.position.ok_or(Error::PositionUnknown)?;
        let all = words.iter().all(Option::is_none);
        let by_way_of = frame.target(modal, start, words)?;
        let mut end = start;
        for (axis, (word, value)) in words.iter().zip(self.offsets.row(row)).enumerate() {
            if all || word.is_some() {
                end.set(axis, *value);
            }
        }
        Ok([rapid_to(modal, by_way_of, line), rapid_to(modal, end, line)])
    }

    /// M100 to M102.
    fn robot_line(&self, mut block: Block, code: RobotCode) -> Result<Command, Error> {
        if !block.groups.is_within(&[Group::Robot]) {
            return Err(Error::OwnLine);
        }
        let change = match code {
            RobotCode::Elbow(elbow) => self.elbow_change(&mut block, elbow),
            RobotCode::Prefilter => self.prefilter_change(&mut block)?,
        };
        if let Some(letter) = block.unused() {
            return Err(Error::UnusedWord { letter });
        }
        Ok(Command {
            robot: change,
            ..Command::default()
        })
    }

    fn elbow_change(&self, block: &mut Block, elbow: Elbow) -> Option<RobotChange> {
        block.modal.elbow = elbow;
        (elbow != self.modal.elbow).then_some(RobotChange::Elbow(elbow))
    }

    fn prefilter_change(&self, block: &mut Block) -> Result<Option<RobotChange>, Error> {
        let before = self.modal.prefilter;
        let kind = match block.take(b'P') {
            None => before.kind,
            Some(number) => prefilter_kind(number)?,
        };
        let frequency_hz = block.take(b'Q').map(Decimal::to_f32);
        let damping = block.take(b'R').map(Decimal::to_f32);
        let prefilter = PrefilterConfig {
            kind,
            frequency_hz: frequency_hz.unwrap_or(before.frequency_hz),
            damping: damping.unwrap_or(before.damping),
        };
        block.modal.prefilter = prefilter;
        Ok((prefilter != before).then_some(RobotChange::Prefilter(prefilter)))
    }

    /// Back to G1, G17, G54, G90, G94, M5, M9 and the robot's corner tolerance, and to line
    /// 1; as in Grbl, units, feedrate and position stay.
    fn end_program(&self, modal: &mut Modal) {
        modal.motion = Motion::Linear;
        modal.plane = Plane::Xy;
        modal.distance = Distance::Absolute;
        modal.work_system = 0;
        modal.spindle = Spindle::Off;
        modal.coolant = Coolant::default();
        modal.corner_tolerance_mm = self.defaults.corner_tolerance_mm;
        modal.lines = 0;
        if modal.feed_mode == FeedMode::InverseTime {
            modal.feed_mode = FeedMode::PerMinute;
            // Its number means something else in G94.
            modal.feedrate = None;
        }
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

/// The prefilter of M100's P.
fn prefilter_kind(number: Decimal) -> Result<Kind, Error> {
    match number.tenths() {
        Some(tenths) if tenths % 10 == 0 => Kind::ALL
            .get(usize::from(tenths / 10))
            .copied()
            .ok_or(Error::NoSuchPrefilter),
        Some(_) => Err(Error::NotAnInteger {
            letter: b'P',
            number,
        }),
        None => Err(Error::NoSuchPrefilter),
    }
}
