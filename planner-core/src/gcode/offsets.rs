//! Work offsets and stored positions: between a program's coordinates and the machine's.

use crate::pose::{AXES, Pose};
use crate::units::LengthMm;

use super::number::Decimal;
use super::position::{Coordinates, ORIGIN, Z, checked, nearest_pose};

/// Coordinate systems, G54 to G59.
pub const WORK_SYSTEMS: usize = 6;

/// Where G28 goes, behind the coordinate systems.
pub(super) const G28: usize = WORK_SYSTEMS;

/// Where G30 goes.
pub(super) const G30: usize = WORK_SYSTEMS + 1;

/// What outlasts power-off: the coordinate systems and two positions.
const STORED: usize = WORK_SYSTEMS + 2;

/// Bytes of a value, its steps of 1e-9 with the little end first.
const VALUE_BYTES: usize = 8;

/// A change that a line makes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OffsetChange {
    /// G10, G28.1 and G30.1: a row of what is stored.
    Stored(usize, Coordinates),
    /// G92 and G92.1.
    G92(Coordinates),
    /// G43.1 and G49.
    ToolLength(Decimal),
}

/// Work offsets and stored positions, exact decimals.
///
/// A machine coordinate is a work coordinate plus the offsets of the active coordinate
/// system and of G92 and, for Z, the tool length offset. G28 and G30 hold machine
/// coordinates. Each value is within ±4095 mm, or ±1440° for C.
///
/// The accessors round to a [`Pose`]: 2^-19 mm and degrees.
#[derive(Clone, Debug, PartialEq)]
pub struct Offsets {
    stored: [Coordinates; STORED],
    g92: Coordinates,
    tool_length: Decimal,
}

impl Offsets {
    /// Length of what [`Offsets::to_bytes`] yields.
    pub const BYTES: usize = STORED * AXES * VALUE_BYTES;

    /// No offsets, and G28 and G30 at the machine's origin.
    pub const NONE: Self = Self {
        stored: [ORIGIN; STORED],
        g92: ORIGIN,
        tool_length: Decimal::ZERO,
    };

    /// Origin of a coordinate system in the machine's, 0 for G54 to 5 for G59.
    #[must_use]
    pub fn work(&self, system: usize) -> Pose {
        let is_system = system < WORK_SYSTEMS;
        nearest_pose(if is_system { self.row(system) } else { &ORIGIN })
    }

    /// Where G28 goes.
    #[must_use]
    pub fn g28(&self) -> Pose {
        nearest_pose(self.row(G28))
    }

    /// Where G30 goes.
    #[must_use]
    pub fn g30(&self) -> Pose {
        nearest_pose(self.row(G30))
    }

    /// The offset of G92, until G92.1 or a reset.
    #[must_use]
    pub fn g92(&self) -> Pose {
        nearest_pose(&self.g92)
    }

    /// The tool length offset of G43.1, until G49 or a reset.
    #[must_use]
    pub fn tool_length(&self) -> LengthMm {
        self.tool_length.to_length_mm().unwrap_or_default()
    }

    /// What outlasts power-off, G54 to G59, G28 and G30.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let values = self.stored.iter().flatten();
        for (field, value) in bytes.chunks_exact_mut(VALUE_BYTES).zip(values) {
            field.copy_from_slice(&value.to_nano().to_le_bytes());
        }
        bytes
    }

    /// The inverse of [`Offsets::to_bytes`], with neither G92 nor tool length offset;
    /// `None` if the bytes are not such.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != Self::BYTES {
            return None;
        }
        let mut offsets = Self::NONE;
        let (fields, _) = bytes.as_chunks::<VALUE_BYTES>();
        for (row, fields) in offsets.stored.iter_mut().zip(fields.chunks_exact(AXES)) {
            for (axis, (value, field)) in row.iter_mut().zip(fields).enumerate() {
                *value = checked(axis, i64::from_le_bytes(*field)).ok()?;
            }
        }
        Some(offsets)
    }

    /// A row of what is stored.
    pub(super) fn row(&self, row: usize) -> &Coordinates {
        self.stored.get(row).unwrap_or(&ORIGIN)
    }

    /// G92's offset, exactly.
    pub(super) const fn g92_exact(&self) -> &Coordinates {
        &self.g92
    }

    /// The tool length offset of an axis in steps of 1e-9.
    pub(super) fn tool_length_nano(&self, axis: usize) -> i64 {
        if axis == Z {
            self.tool_length.to_nano()
        } else {
            0
        }
    }

    /// Offset of G92 and tool length of an axis in steps of 1e-9.
    pub(super) fn overlay_nano(&self, axis: usize) -> i64 {
        let g92 = self.g92.get(axis).map_or(0, |value| value.to_nano());
        g92 + self.tool_length_nano(axis)
    }

    /// Work zero of a coordinate system in machine coordinates, on one axis, in steps of 1e-9.
    pub(super) fn work_zero_nano(&self, system: usize, axis: usize) -> i64 {
        let origin = self
            .row(system)
            .get(axis)
            .map_or(0, |value| value.to_nano());
        origin + self.overlay_nano(axis)
    }

    /// Work zero of a coordinate system in machine coordinates.
    pub(super) fn work_zero(&self, system: usize) -> Coordinates {
        core::array::from_fn(|axis| Decimal::from_nano(self.work_zero_nano(system, axis)))
    }

    /// Makes a change.
    pub(super) fn apply(&mut self, change: &OffsetChange) {
        match *change {
            OffsetChange::Stored(row, coordinates) => {
                if let Some(row) = self.stored.get_mut(row) {
                    *row = coordinates;
                }
            }
            OffsetChange::G92(coordinates) => self.g92 = coordinates,
            OffsetChange::ToolLength(length) => self.tool_length = length,
        }
    }

    /// Takes back what a reset takes back: G92 and the tool length offset.
    pub(super) const fn reset(&mut self) {
        self.g92 = ORIGIN;
        self.tool_length = Decimal::ZERO;
    }
}
