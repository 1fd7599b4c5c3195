//! What one line leaves behind for the next.

use crate::pose::{AXES, Pose};
use crate::units::LengthMm;

use super::error::Error;
use super::number::Decimal;

/// Settings of the robot that a program starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Defaults {
    /// Corner tolerance until G61 or G64 P, and after G64 without P.
    pub corner_tolerance_mm: f32,
}

/// Motion mode: what an axis word without a command does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Motion {
    /// G0, rapid positioning: after power-up.
    #[default]
    Rapid,
    /// G1, linear interpolation: after a program end.
    Linear,
    /// G2, clockwise arc.
    ArcClockwise,
    /// G3, counter-clockwise arc.
    ArcCounterClockwise,
    /// G80, none: axis words are an error.
    Cancelled,
}

/// Units of lengths and feeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// G21.
    #[default]
    Millimetres,
    /// G20.
    Inches,
}

impl Units {
    /// A length in these units, in millimetres.
    pub(super) fn to_mm(self, letter: u8, value: Decimal) -> Result<Decimal, Error> {
        match self {
            Self::Millimetres => Ok(value),
            Self::Inches => {
                let wrong = |reason| Error::Number { letter, reason };
                value.inches_to_mm().map_err(wrong)
            }
        }
    }
}

/// Distance mode of X, Y, Z and C.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Distance {
    /// G90: coordinates.
    #[default]
    Absolute,
    /// G91: distances from where the robot is.
    Incremental,
}

/// A feedrate as programmed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feedrate {
    /// The path's, in mm/min, above zero.
    pub mm_per_min: Decimal,
    /// That of a motion of the yaw alone, in deg/min: the number of the F word, even in inches.
    pub deg_per_min: Decimal,
}

/// A position as programmed: X, Y, Z in mm and C in degrees, to 1e-9.
///
/// Finer than a [`Pose`], so that the roundings of incremental moves do not add up:
/// a relative program ends where its absolute twin ends, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Position(pub [Decimal; AXES]);

impl Position {
    /// The nearest pose; an axis out of range saturates (targets are checked before).
    pub(super) fn to_pose(self) -> Pose {
        let [x, y, z, c] = self.0.map(|value| {
            let limit = if value < Decimal::ZERO {
                LengthMm::MIN
            } else {
                LengthMm::MAX
            };
            value.to_length_mm().unwrap_or(limit)
        });
        Pose { x, y, z, c }
    }

    /// A pose, exactly enough to give its bits back.
    pub(super) fn from_pose(pose: Pose) -> Self {
        Self([pose.x, pose.y, pose.z, pose.c].map(Decimal::from_length_mm))
    }
}

/// The modal state: what one line leaves behind for the next.
///
/// Always G17 (XY plane), G40, G54, G91.1 (arc centres are incremental) and G94
/// (feed per minute), since the robot has no others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modal {
    pub(super) motion: Motion,
    pub(super) units: Units,
    pub(super) distance: Distance,
    /// None until the first F.
    pub(super) feedrate: Option<Feedrate>,
    pub(super) corner_tolerance_mm: f32,
    /// None until the first point of a program says where the robot is.
    pub(super) position: Option<Position>,
    /// Lines counted since the program's begin.
    pub(super) lines: u32,
}

impl Modal {
    /// The state after power-up: G0 G17 G21 G40 G54 G90 G91.1 G94, no feedrate, position unknown.
    pub(super) const fn new(defaults: Defaults) -> Self {
        Self {
            motion: Motion::Rapid,
            units: Units::Millimetres,
            distance: Distance::Absolute,
            feedrate: None,
            corner_tolerance_mm: defaults.corner_tolerance_mm,
            position: None,
            lines: 0,
        }
    }

    /// Motion mode (G0 to G3, G80).
    #[must_use]
    pub const fn motion(&self) -> Motion {
        self.motion
    }

    /// Units (G20, G21).
    #[must_use]
    pub const fn units(&self) -> Units {
        self.units
    }

    /// Distance mode (G90, G91).
    #[must_use]
    pub const fn distance(&self) -> Distance {
        self.distance
    }

    /// Feedrate of the path in mm/min, if one has been given.
    #[must_use]
    pub fn feed_mm_per_min(&self) -> Option<f32> {
        self.feedrate.map(|feedrate| feedrate.mm_per_min.to_f32())
    }

    /// Corner tolerance (G61, G64); 0 is an exact stop at every corner.
    #[must_use]
    pub const fn corner_tolerance_mm(&self) -> f32 {
        self.corner_tolerance_mm
    }

    /// Where the last motion ends, if known.
    #[must_use]
    pub fn position(&self) -> Option<Pose> {
        self.position.map(Position::to_pose)
    }

    /// Number of the last line, counted from 1 at the begin of a program.
    #[must_use]
    pub const fn lines(&self) -> u32 {
        self.lines
    }
}
