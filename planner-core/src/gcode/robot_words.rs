//! The robot's own words, M100 to M103.

use crate::prefilter::{Kind, PrefilterConfig};

use super::block::Block;
use super::code::{Group, RobotCode};
use super::command::{Command, HopMove, RobotChange};
use super::error::Error;
use super::motion::{Frame, take_axis_words};
use super::number::Decimal;
use super::offsets::Offsets;

/// What a line with one of them does: nothing else may stand in it.
///
/// # Errors
/// Codes 23, 26, 36, 61, 62, 65 and 76.
pub(super) fn robot_command(
    mut block: Block,
    code: RobotCode,
    offsets: &Offsets,
    line: u32,
) -> Result<Command, Error> {
    if !block.groups.is_within(&[Group::Robot]) {
        return Err(Error::OwnLine);
    }
    let robot = match code {
        RobotCode::Elbow(elbow) => {
            block.modal.elbow = elbow;
            Some(RobotChange::Elbow(elbow))
        }
        RobotCode::Prefilter => prefilter_change(&mut block)?,
        RobotCode::Hop => Some(RobotChange::Hop(hop(&mut block, offsets, line)?)),
    };
    if let Some(letter) = block.unused() {
        return Err(Error::UnusedWord { letter });
    }
    Ok(Command {
        robot,
        ..Command::default()
    })
}

/// M100: words that are not given keep their values.
fn prefilter_change(block: &mut Block) -> Result<Option<RobotChange>, Error> {
    let before = block.modal.prefilter;
    let kind = block.take(b'P').map(prefilter_kind).transpose()?;
    let frequency_hz = block.take(b'Q').map(Decimal::to_f32);
    let damping = block.take(b'R').map(Decimal::to_f32);
    let prefilter = PrefilterConfig {
        kind: kind.unwrap_or(before.kind),
        frequency_hz: frequency_hz.unwrap_or(before.frequency_hz),
        damping: damping.unwrap_or(before.damping),
        ..before
    };
    block.modal.prefilter = prefilter;
    Ok((prefilter != before).then_some(RobotChange::Prefilter(prefilter)))
}

/// M103: to X, Y, Z and C, in a hop.
fn hop(block: &mut Block, offsets: &Offsets, line: u32) -> Result<HopMove, Error> {
    let words = take_axis_words(block)?;
    if words.iter().all(Option::is_none) {
        return Err(Error::NoAxisWords);
    }
    let position = block.modal.position.ok_or(Error::PositionUnknown)?;
    let end = Frame::Work(offsets).target(block.modal, position, &words)?;
    block.modal.position = Some(end);
    let units = block.modal.units;
    let mut mm = |letter| {
        let given = block.take(letter).map(|value| units.to_mm(letter, value));
        Ok(given.transpose()?.map(Decimal::to_f32))
    };
    Ok(HopMove {
        start: position.to_pose(),
        target: end.to_pose(),
        height_mm: mm(b'Q')?,
        rise_mm: mm(b'R')?,
        tolerance_mm: mm(b'P')?,
        acceleration_mm_s2: mm(b'K')?,
        line,
    })
}

/// The prefilter of M100's P, its place among [`Kind::ALL`].
fn prefilter_kind(number: Decimal) -> Result<Kind, Error> {
    let kind = usize::try_from(number.integer())
        .ok()
        .and_then(|place| Kind::ALL.get(place).copied())
        .ok_or(Error::NoSuchPrefilter)?;
    if Decimal::from_integer(number.integer() as i32) == number {
        Ok(kind)
    } else {
        let letter = b'P';
        Err(Error::NotAnInteger { letter, number })
    }
}
