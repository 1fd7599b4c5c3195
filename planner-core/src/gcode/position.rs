//! Positions as programmed: exact decimals, rounded once into a pose.

use crate::pose::{AXES, Pose};
use crate::units::LengthMm;

use super::error::Error;
use super::number::Decimal;

/// The letters of the axes, in their order.
pub(super) const LETTERS: [u8; AXES] = *b"XYZC";

/// Z, the axis of the tool length offset.
pub(super) const Z: usize = 2;

/// How far an axis, and each offset of it, may be from zero: mm, mm, mm, °. A millimetre
/// short of the format's end, so that corners and tolerances have room.
const LIMITS: [i32; AXES] = [4095, 4095, 4095, 1440];

/// X, Y, Z in mm and C in degrees, to 1e-9.
///
/// Finer than a [`Pose`], so that the roundings of incremental moves and of offsets do not
/// add up: a relative program ends where its absolute twin ends, bit for bit.
pub(super) type Coordinates = [Decimal; AXES];

/// X, Y, Z and C as given in a line: X, Y, Z in mm, C in degrees.
pub(super) type AxisWords = [Option<Decimal>; AXES];

/// Every axis at zero.
pub(super) const ORIGIN: Coordinates = [Decimal::ZERO; AXES];

/// A value of an axis.
///
/// # Errors
/// 61: it is out of range.
pub(super) fn checked(axis: usize, value_nano: i64) -> Result<Decimal, Error> {
    let limit = LIMITS.get(axis).copied().unwrap_or_default();
    let limit_nano = Decimal::from_integer(limit).to_nano();
    if (-limit_nano..=limit_nano).contains(&value_nano) {
        Ok(Decimal::from_nano(value_nano))
    } else {
        let letter = LETTERS.get(axis).copied().unwrap_or_default();
        Err(Error::OutOfRange { letter })
    }
}

/// The nearest pose to coordinates; an axis beyond the format's range saturates.
pub(super) fn nearest_pose(coordinates: &Coordinates) -> Pose {
    Pose::from_bits(coordinates.map(nearest_bits))
}

/// The nearest step of an axis; beyond the format's range, its end.
fn nearest_bits(value: Decimal) -> i32 {
    let end = if value < Decimal::ZERO {
        LengthMm::MIN
    } else {
        LengthMm::MAX
    };
    value.to_length_mm().unwrap_or(end).to_bits()
}

/// A position in machine coordinates, with its pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Position {
    exact: Coordinates,
    /// The nearest pose, kept so that each line rounds only the axes that it moves.
    bits: [i32; AXES],
}

impl Position {
    /// The machine's origin.
    pub(super) const ORIGIN: Self = Self {
        exact: ORIGIN,
        bits: [0; AXES],
    };

    /// A pose, exactly enough to give its bits back.
    pub(super) fn from_pose(pose: Pose) -> Self {
        Self {
            exact: [pose.x, pose.y, pose.z, pose.c].map(Decimal::from_length_mm),
            bits: pose.to_bits(),
        }
    }

    /// The nearest pose.
    pub(super) const fn to_pose(self) -> Pose {
        Pose::from_bits(self.bits)
    }

    /// The exact coordinates.
    pub(super) const fn exact(&self) -> &Coordinates {
        &self.exact
    }

    /// The value of an axis in steps of 1e-9.
    pub(super) fn nano(&self, axis: usize) -> i64 {
        self.exact.get(axis).map_or(0, |value| value.to_nano())
    }

    /// Moves one axis.
    pub(super) fn set(&mut self, axis: usize, value: Decimal) {
        if let (Some(exact), Some(bits)) = (self.exact.get_mut(axis), self.bits.get_mut(axis)) {
            *exact = value;
            *bits = nearest_bits(value);
        }
    }
}
