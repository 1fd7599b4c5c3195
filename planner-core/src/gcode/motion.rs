//! From axis words to motions.

use crate::path::{Arc, PathSegment, Shape};
use crate::pose::Pose;

use super::arc::{Chord, Rotation};
use super::block::Block;
use super::command::{Feed, Move};
use super::error::Error;
use super::modal::{Distance, Feedrate, Modal, Motion, Plane, Units};
use super::number::Decimal;
use super::offsets::Offsets;
use super::position::{AxisWords, Coordinates, LETTERS, Position, checked};

/// The axis words of a line, lengths in mm.
pub(super) fn take_axis_words(block: &mut Block) -> Result<AxisWords, Error> {
    let units = block.modal.units;
    let mut words: AxisWords = [None; _];
    for (word, letter) in words.iter_mut().zip(LETTERS) {
        if let Some(value) = block.take(letter) {
            *word = Some(match letter {
                b'C' => value,
                _ => units.to_mm(letter, value)?,
            });
        }
    }
    Ok(words)
}

/// What axis words count from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Frame<'o> {
    /// The machine's origin, G91 or not (G53).
    Machine,
    /// The origin of the active coordinate system, or in G91 where the robot is.
    Work(&'o Offsets),
}

impl Frame<'_> {
    /// Where axis words lead from a position: axes that are not given stay.
    ///
    /// # Errors
    /// 61: an axis is out of range.
    pub(super) fn target(
        self,
        modal: &Modal,
        position: Position,
        words: &AxisWords,
    ) -> Result<Position, Error> {
        let mut target = position;
        for (axis, word) in words.iter().enumerate() {
            let Some(value) = word else { continue };
            let origin_nano = match (self, modal.distance) {
                (Self::Machine, _) => 0,
                (Self::Work(offsets), Distance::Absolute) => {
                    offsets.work_zero_nano(modal.work_system(), axis)
                }
                (Self::Work(_), Distance::Incremental) => position.nano(axis),
            };
            let nano = origin_nano.saturating_add(value.to_nano());
            target.set(axis, checked(axis, nano)?);
        }
        Ok(target)
    }
}

/// A motion of the current motion mode, or the first point of a program. The modal
/// state's position becomes its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Travel {
    Nothing,
    Reference(Pose),
    Move(Move),
}

/// What the axis words, or the motion command without any, make the robot do.
///
/// # Errors
/// Codes 22, 26, 32 to 35, 61, 62 and 75.
pub(super) fn travel(
    block: &mut Block,
    frame: Frame,
    words: &AxisWords,
    line: u32,
    first_point_declares: bool,
) -> Result<Travel, Error> {
    let has_words = words.iter().any(Option::is_some);
    let modal = &*block.modal;
    if modal.motion != Motion::Rapid && modal.feedrate.is_none() {
        return Err(Error::NoFeed);
    }
    let rotation = match modal.motion {
        Motion::ArcClockwise => Some(Rotation::Clockwise),
        Motion::ArcCounterClockwise => Some(Rotation::CounterClockwise),
        Motion::Rapid | Motion::Linear | Motion::Cancelled => None,
    };
    if rotation.is_some() {
        check_arc_words(modal.plane, words)?;
    } else if !has_words {
        return Ok(Travel::Nothing);
    }
    let Some(position) = modal.position else {
        let is_absolute = matches!(frame, Frame::Machine) || modal.distance == Distance::Absolute;
        let is_point = rotation.is_none() && matches!(words, [Some(_), Some(_), ..]);
        if !(first_point_declares && is_absolute && is_point) {
            return Err(Error::PositionUnknown);
        }
        let reference = frame.target(modal, Position::ORIGIN, words)?;
        block.modal.position = Some(reference);
        return Ok(Travel::Reference(reference.to_pose()));
    };
    let end = frame.target(modal, position, words)?;
    let (start, target) = (position.to_pose(), end.to_pose());
    let shape = match rotation {
        None => Shape::Line,
        Some(rotation) => Shape::Arc(arc(block, start, target, rotation)?),
    };
    block.modal.position = Some(end);
    let path = PathSegment {
        start,
        target,
        shape,
    };
    let feed = feed(block.modal, &path);
    Ok(moving(block.modal, path, feed, line).map_or(Travel::Nothing, Travel::Move))
}

/// G28 and G30: by way of the axis words, if there are any, to a position; with axis words,
/// these axes only. The modal state's position becomes the end.
///
/// # Errors
/// Codes 61 and 62.
pub(super) fn go(
    block: &mut Block,
    frame: Frame,
    words: &AxisWords,
    position: &Coordinates,
    line: u32,
) -> Result<[Option<Move>; 2], Error> {
    let modal = &mut *block.modal;
    let start = modal.position.ok_or(Error::PositionUnknown)?;
    let by_way_of = frame.target(modal, start, words)?;
    let all = words.iter().all(Option::is_none);
    let mut end = start;
    for (axis, (word, value)) in words.iter().zip(position).enumerate() {
        if all || word.is_some() {
            end.set(axis, *value);
        }
    }
    modal.position = Some(end);
    let rapid = |start: Position, target: Position| {
        let path = PathSegment {
            start: start.to_pose(),
            target: target.to_pose(),
            shape: Shape::Line,
        };
        moving(modal, path, Feed::Rapid, line)
    };
    Ok([rapid(start, by_way_of), rapid(by_way_of, end)])
}

/// A straight motion at a feedrate: of a jog. Does not change the modal state.
pub(super) fn linear_to(
    modal: &Modal,
    start: Pose,
    target: Pose,
    feedrate: Feedrate,
    line: u32,
) -> Option<Move> {
    let path = PathSegment {
        start,
        target,
        shape: Shape::Line,
    };
    moving(modal, path, feed_along(feedrate, &path), line)
}

/// A motion, unless it is a line that ends where it starts.
fn moving(modal: &Modal, path: PathSegment, feed: Feed, line: u32) -> Option<Move> {
    if path.shape == Shape::Line && path.start == path.target {
        return None;
    }
    Some(Move {
        path,
        feed,
        corner: modal.corner,
        line,
    })
}

/// Whether an arc has a target in its plane, and its plane is one that the robot can do.
fn check_arc_words(plane: Plane, words: &AxisWords) -> Result<(), Error> {
    let [x, y, z, c] = words.map(|word| word.is_some());
    let in_plane = match plane {
        Plane::Xy => x || y,
        Plane::Zx => z || x,
        Plane::Yz => y || z,
    };
    match (in_plane, plane) {
        (true, Plane::Xy) => Ok(()),
        (true, _) => Err(Error::ArcPlane),
        (false, _) if x || y || z || c => Err(Error::NoAxisWordsInPlane),
        (false, _) => Err(Error::NoAxisWords),
    }
}

/// The arc of G2 and G3: by R if it is given, by I and J otherwise.
fn arc(block: &mut Block, start: Pose, target: Pose, rotation: Rotation) -> Result<Arc, Error> {
    let units: Units = block.modal.units;
    let chord = Chord {
        start_mm: [start.x.to_num(), start.y.to_num()],
        target_mm: [target.x.to_num(), target.y.to_num()],
    };
    let mm = |letter, value: Decimal| Ok(units.to_mm(letter, value)?.to_f64());
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

/// How fast a motion of the current motion mode goes.
fn feed(modal: &Modal, path: &PathSegment) -> Feed {
    match modal.feedrate {
        Some(feedrate) if modal.motion != Motion::Rapid => feed_along(feedrate, path),
        _ => Feed::Rapid,
    }
}

/// How fast a motion goes at a feedrate.
fn feed_along(feedrate: Feedrate, path: &PathSegment) -> Feed {
    match feedrate {
        Feedrate::PerMinute {
            path_mm_s,
            turn_deg_s,
            ..
        } => {
            let c = path.target.c;
            let turns_only = path.shape == Shape::Line && Pose { c, ..path.start } == path.target;
            Feed::MmPerS(if turns_only { turn_deg_s } else { path_mm_s })
        }
        Feedrate::InverseTime { per_min } => Feed::Seconds(60.0 / per_min.to_f32()),
    }
}
