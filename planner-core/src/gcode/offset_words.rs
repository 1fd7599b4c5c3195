//! What a line changes of the offsets.

use super::block::Block;
use super::code::{NonModal, ToolLength};
use super::error::Error;
use super::number::Decimal;
use super::offsets::{OffsetChange, Offsets, WORK_SYSTEMS};
use super::position::{AxisWords, Coordinates, ORIGIN, Position, Z, checked};

/// What G10, G28.1, G30.1, G43.1, G49, G92 and G92.1 change.
///
/// # Errors
/// Codes 20, 24, 26, 28, 29, 37, 61 and 62.
pub(super) fn offset_change(
    block: &mut Block,
    offsets: &Offsets,
    words: &AxisWords,
) -> Result<Option<OffsetChange>, Error> {
    let has_words = words.iter().any(Option::is_some);
    match (block.tool_length, block.non_modal) {
        (Some(ToolLength::Set), _) => {
            let [None, None, Some(z), None] = *words else {
                return Err(Error::ToolLengthAxis);
            };
            let length = checked(Z, z.to_nano())?;
            return Ok(Some(OffsetChange::ToolLength(length)));
        }
        (Some(ToolLength::Cancel), _) if has_words => return Err(Error::AxisConflict),
        (Some(ToolLength::Cancel), _) => {
            return Ok(Some(OffsetChange::ToolLength(Decimal::ZERO)));
        }
        (None, Some(NonModal::SetWorkSystem | NonModal::SetOffset)) if !has_words => {
            return Err(Error::NoAxisWords);
        }
        _ => {}
    }
    let position = block.modal.position.ok_or(Error::PositionUnknown);
    match block.non_modal {
        Some(NonModal::SetWorkSystem) => set_work_system(block, offsets, words).map(Some),
        Some(NonModal::SetOffset) => {
            let position = position?;
            let origin = offsets.row(block.modal.work_system());
            let g92 = changed(offsets.g92_exact(), words, |axis, word_nano| {
                let origin_nano = origin.get(axis).map_or(0, |value| value.to_nano());
                let others_nano = origin_nano + offsets.tool_length_nano(axis);
                origin_for(&position, axis, others_nano, word_nano)
            })?;
            Ok(Some(OffsetChange::G92(g92)))
        }
        Some(NonModal::ResetOffset) => Ok(Some(OffsetChange::G92(ORIGIN))),
        Some(NonModal::Store(row)) => {
            // A position that homing found may be beyond what a program can name.
            let stored = *position?.exact();
            for (axis, value) in stored.iter().enumerate() {
                checked(axis, value.to_nano())?;
            }
            Ok(Some(OffsetChange::Stored(row, stored)))
        }
        Some(NonModal::Dwell | NonModal::Go(_) | NonModal::MachineCoordinates) | None => Ok(None),
    }
}

/// G10: L2 sets the origin of a coordinate system, L20 makes the position have the given
/// coordinates in it.
fn set_work_system(
    block: &mut Block,
    offsets: &Offsets,
    words: &AxisWords,
) -> Result<OffsetChange, Error> {
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
    let before = offsets.row(row);
    let number = kind.unwrap_or_default();
    let origin = match number.integer() {
        2 if block.value(b'R').is_some() => return Err(Error::UnsupportedWord { letter: b'R' }),
        2 => changed(before, words, |_, word_nano| word_nano),
        20 => {
            let position = block.modal.position.ok_or(Error::PositionUnknown)?;
            changed(before, words, |axis, word_nano| {
                origin_for(&position, axis, offsets.overlay_nano(axis), word_nano)
            })
        }
        _ => {
            let letter = b'L';
            return Err(Error::UnsupportedCommand { letter, number });
        }
    };
    Ok(OffsetChange::Stored(row, origin?))
}

/// The offset that, with others, gives the position a work coordinate, in steps of 1e-9.
fn origin_for(position: &Position, axis: usize, others_nano: i64, work_nano: i64) -> i64 {
    (position.nano(axis) - others_nano).saturating_sub(work_nano)
}

/// Coordinates with a new value on each axis that has a word, made of it in steps of 1e-9.
fn changed(
    before: &Coordinates,
    words: &AxisWords,
    new_nano: impl Fn(usize, i64) -> i64,
) -> Result<Coordinates, Error> {
    let mut coordinates = *before;
    for (axis, (value, word)) in coordinates.iter_mut().zip(words).enumerate() {
        if let Some(word) = word {
            *value = checked(axis, new_nano(axis, word.to_nano()))?;
        }
    }
    Ok(coordinates)
}
