//! Lines into commands, by the modal state.

use crate::path::{Arc, PathSegment, Shape};
use crate::pose::Pose;

use super::arc::{Chord, Rotation};
use super::block::{Block, PathControl, ProgramFlow};
use super::command::{Command, Feed, Move};
use super::error::Error;
use super::line::Line;
use super::modal::{Defaults, Distance, Feedrate, Modal, Motion, Position, Units};
use super::number::Decimal;

/// Largest line number, Grbl's.
pub(super) const MAX_LINE_NUMBER: u32 = 10_000_000;

/// The axes in their order, and how far their targets may be from zero: mm, mm, mm, °.
/// A millimetre short of the format's end, so that corners and tolerances have room.
const AXES_AND_LIMITS: [(u8, i32); 4] = [(b'X', 4095), (b'Y', 4095), (b'Z', 4095), (b'C', 1440)];

/// X, Y, Z and C as given in a line: X, Y, Z in mm, C in degrees.
type AxisWords = [Option<Decimal>; 4];

/// Executes lines: G0 to G4, G17, G20, G21, G40, G49, G54, G61, G64 P, G80, G90, G91,
/// G91.1, G94, M0, M2, M30, and as no-ops M1 and M3 to M9.
///
/// Coordinates are in mm or inches, C (yaw) in degrees. F is in mm/min or in/min
/// along the path of X, Y and Z, and in deg/min for a motion of C alone. S, T and,
/// beside I and J, K are read and ignored, as in Grbl.
///
/// The position is unknown at first. An absolute G0 or G1 with X and Y, Z and C being
/// 0 unless given, then tells where the robot is ([`Command::Reference`]).
///
/// `interpret`, let the planner accept the command, then `commit`; a line that is
/// refused, by either, is counted with `skip`.
#[derive(Clone, Debug)]
pub struct Interpreter {
    defaults: Defaults,
    modal: Modal,
}

impl Interpreter {
    /// The state after power-up: G0 G17 G21 G40 G54 G64 G90 G91.1 G94, no feedrate,
    /// position unknown.
    #[must_use]
    pub const fn new(defaults: Defaults) -> Self {
        Self {
            defaults,
            modal: Modal::new(defaults),
        }
    }

    /// The modal state after the last line committed.
    #[must_use]
    pub const fn modal(&self) -> &Modal {
        &self.modal
    }

    /// Makes a new modal state the current one.
    pub const fn commit(&mut self, modal: Modal) {
        self.modal = modal;
    }

    /// Counts a line that was refused, or was none of G-code.
    pub const fn skip(&mut self) {
        self.modal.lines = self.modal.lines.saturating_add(1);
    }

    /// Says where the robot is, after homing or a stop on the way; `None` if that is unknown.
    pub fn set_position(&mut self, position: Option<Pose>) {
        self.modal.position = position.map(Position::from_pose);
    }

    /// What a line does, and the modal state after it. Changes nothing.
    ///
    /// # Errors
    /// Any [`Error`] but those of [`Line::parse`]; if several apply, mostly the one
    /// that Grbl would report.
    pub fn interpret(&self, line: &Line) -> Result<(Modal, Command), Error> {
        let mut block = Block::collect(line)?;
        let mut modal = self.modal;
        modal.lines = modal.lines.saturating_add(1);
        let line_number = take_line_number(&mut block)?.unwrap_or(modal.lines);
        modal.units = block.units.unwrap_or(modal.units);
        modal.distance = block.distance.unwrap_or(modal.distance);
        modal.motion = block.motion.unwrap_or(modal.motion);
        if let Some(feed) = block.take(b'F') {
            modal.feedrate = feedrate(feed, modal.units)?;
        }
        let _tolerated = (block.take(b'S'), block.take(b'T'));
        let dwell = take_dwell(&mut block)?;
        if let Some(tolerance_mm) = self.take_tolerance_mm(&mut block, modal.units)? {
            modal.corner_tolerance_mm = tolerance_mm;
        }
        let motion = motion(&mut block, &mut modal, line_number)?;
        if let Some(letter) = block.unused() {
            return Err(Error::UnusedWord { letter });
        }
        let flow = block.program_flow.map(|flow| match flow {
            ProgramFlow::Pause => Command::Pause,
            ProgramFlow::End => Command::End,
        });
        if flow == Some(Command::End) {
            self.end_program(&mut modal);
        }
        match (motion, dwell, flow) {
            (None, None, None) => Ok((modal, Command::Nothing)),
            (Some(command), None, None)
            | (None, Some(command), None)
            | (None, None, Some(command)) => Ok((modal, command)),
            _ => Err(Error::OneActionPerLine),
        }
    }

    /// Back to G1, G90 and the robot's corner tolerance, and to line 1; as in Grbl,
    /// units, feedrate and position stay.
    const fn end_program(&self, modal: &mut Modal) {
        modal.motion = Motion::Linear;
        modal.distance = Distance::Absolute;
        modal.corner_tolerance_mm = self.defaults.corner_tolerance_mm;
        modal.lines = 0;
    }

    /// The corner tolerance that G61 or G64 sets.
    fn take_tolerance_mm(&self, block: &mut Block, units: Units) -> Result<Option<f32>, Error> {
        match block.path_control {
            None => Ok(None),
            Some(PathControl::ExactStop) => Ok(Some(0.0)),
            Some(PathControl::Blend) => match block.take(b'P') {
                None => Ok(Some(self.defaults.corner_tolerance_mm)),
                Some(tolerance) => Ok(Some(units.to_mm(b'P', tolerance)?.to_f32())),
            },
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

/// The feedrate of an F word; F0 takes it back.
fn feedrate(feed: Decimal, units: Units) -> Result<Option<Feedrate>, Error> {
    let feedrate = Feedrate {
        mm_per_min: units.to_mm(b'F', feed)?,
        deg_per_min: feed,
    };
    Ok((feed > Decimal::ZERO).then_some(feedrate))
}

/// The dwell of G4.
fn take_dwell(block: &mut Block) -> Result<Option<Command>, Error> {
    if !block.dwell {
        return Ok(None);
    }
    if block.path_control == Some(PathControl::Blend) {
        return Err(Error::OneActionPerLine);
    }
    let seconds = block.take(b'P').ok_or(Error::NoDwellTime)?.to_f32();
    Ok(Some(Command::Dwell { seconds }))
}

/// The motion of a line: `None` without axis words. Updates the position.
fn motion(block: &mut Block, modal: &mut Modal, line: u32) -> Result<Option<Command>, Error> {
    let words = take_axis_words(block, modal.units)?;
    let has_words = words.iter().any(Option::is_some);
    if has_words && block.cancel_tool_length {
        return Err(Error::AxisConflict);
    }
    if modal.motion == Motion::Cancelled && has_words {
        return Err(Error::AxisWordsWithoutMotion);
    }
    if !has_words && matches!(block.motion, None | Some(Motion::Cancelled)) {
        return Ok(None);
    }
    if modal.motion != Motion::Rapid && modal.feedrate.is_none() {
        return Err(Error::NoFeed);
    }
    let rotation = match modal.motion {
        Motion::ArcClockwise => Some(Rotation::Clockwise),
        Motion::ArcCounterClockwise => Some(Rotation::CounterClockwise),
        Motion::Rapid | Motion::Linear | Motion::Cancelled => None,
    };
    match (rotation, words) {
        (None, _) if !has_words => return Ok(None),
        (Some(_), _) if !has_words => return Err(Error::NoAxisWords),
        (Some(_), [None, None, ..]) => return Err(Error::NoAxisWordsInPlane),
        _ => {}
    }
    let Some(position) = modal.position else {
        let reference = reference(modal.distance, rotation, words)?;
        modal.position = Some(reference);
        return Ok(Some(Command::Reference(reference.to_pose())));
    };
    let end = target(position, modal.distance, words)?;
    let (start, target) = (position.to_pose(), end.to_pose());
    let shape = match rotation {
        None => Shape::Line,
        Some(rotation) => Shape::Arc(arc(block, modal.units, start, target, rotation)?),
    };
    modal.position = Some(end);
    if shape == Shape::Line && start == target {
        return Ok(Some(Command::Nothing));
    }
    Ok(Some(Command::Move(Move {
        path: PathSegment {
            start,
            target,
            shape,
        },
        feed: feed(modal, start, target, shape),
        corner_tolerance_mm: modal.corner_tolerance_mm,
        line,
    })))
}

fn take_axis_words(block: &mut Block, units: Units) -> Result<AxisWords, Error> {
    let mut lengths = [None; 3];
    for (length, letter) in lengths.iter_mut().zip(*b"XYZ") {
        let value = block.take(letter);
        *length = value.map(|value| units.to_mm(letter, value)).transpose()?;
    }
    let [x, y, z] = lengths;
    Ok([x, y, z, block.take(b'C')])
}

/// The position that the first point of a program tells.
fn reference(
    distance: Distance,
    rotation: Option<Rotation>,
    words: AxisWords,
) -> Result<Position, Error> {
    match (distance, rotation, words) {
        (Distance::Absolute, None, [Some(_), Some(_), ..]) => {
            target(Position([Decimal::ZERO; 4]), distance, words)
        }
        _ => Err(Error::PositionUnknown),
    }
}

/// Where a motion ends: axes that are not given stay.
fn target(position: Position, distance: Distance, words: AxisWords) -> Result<Position, Error> {
    let mut target = position;
    for ((axis, word), (letter, limit)) in target.0.iter_mut().zip(words).zip(AXES_AND_LIMITS) {
        let Some(value) = word else { continue };
        let nano = match distance {
            Distance::Absolute => value.to_nano(),
            Distance::Incremental => axis.to_nano().saturating_add(value.to_nano()),
        };
        let limit = Decimal::from_integer(limit).to_nano();
        if !(-limit..=limit).contains(&nano) {
            return Err(Error::OutOfRange { letter });
        }
        *axis = Decimal::from_nano(nano);
    }
    Ok(target)
}

/// The arc of G2 and G3: by R if it is given, by I and J otherwise.
fn arc(
    block: &mut Block,
    units: Units,
    start: Pose,
    target: Pose,
    rotation: Rotation,
) -> Result<Arc, Error> {
    let chord = Chord {
        start_mm: [start.x.to_num(), start.y.to_num()],
        target_mm: [target.x.to_num(), target.y.to_num()],
    };
    let mm = |letter, value| Ok(units.to_mm(letter, value)?.to_f64());
    if let Some(radius) = block.take(b'R') {
        return chord.of_radius(mm(b'R', radius)?, rotation);
    }
    let offset = match (block.take(b'I'), block.take(b'J')) {
        (None, None) => return Err(Error::NoArcOffsets),
        (i, j) => [
            mm(b'I', i.unwrap_or_default())?,
            mm(b'J', j.unwrap_or_default())?,
        ],
    };
    let _tolerated = block.take(b'K');
    chord.around(offset, rotation)
}

/// How fast a motion goes.
fn feed(modal: &Modal, start: Pose, target: Pose, shape: Shape) -> Feed {
    let Some(feedrate) = modal.feedrate.filter(|_| modal.motion != Motion::Rapid) else {
        return Feed::Rapid;
    };
    let yaw_alone = shape == Shape::Line
        && Pose {
            c: target.c,
            ..start
        } == target;
    let per_min = if yaw_alone {
        feedrate.deg_per_min
    } else {
        feedrate.mm_per_min
    };
    Feed::MmPerS((per_min.to_f64() / 60.0) as f32)
}
