//! What one line leaves behind for the next.

use crate::corner::CornerRule;
use crate::kinematics::Elbow;
use crate::pose::Pose;
use crate::prefilter::PrefilterConfig;

use super::command::{BLOW_OFF, GRIPPER};
use super::error::Error;
use super::number::Decimal;
use super::position::Position;

/// Settings of the robot that a program starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defaults {
    /// How corners are passed until G61 or G64, and after G64 without P or Q.
    pub corner: CornerRule,
    /// The prefilter until M100.
    pub prefilter: PrefilterConfig,
    /// The elbow's side until M101 or M102.
    pub elbow: Elbow,
    /// Whether the first absolute G0 or G1 with X and Y says where the robot is, while that
    /// is unknown. Otherwise nothing moves before homing.
    pub first_point_declares: bool,
}

impl Default for Defaults {
    /// Exact stops, the default prefilter and elbow; the first point declares.
    fn default() -> Self {
        Self {
            corner: CornerRule::EXACT_STOP,
            prefilter: PrefilterConfig::default(),
            elbow: Elbow::default(),
            first_point_declares: true,
        }
    }
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

/// The plane of arcs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// G17.
    #[default]
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
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

/// What F means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FeedMode {
    /// G94: units per minute.
    #[default]
    PerMinute,
    /// G93: one over the minutes that the motion takes. Each feed move needs its own F.
    InverseTime,
}

/// The gripper, where mills have their spindle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spindle {
    /// M5: open.
    #[default]
    Off,
    /// M3: closed.
    Clockwise,
    /// M4: closed.
    CounterClockwise,
}

/// The blow-off, where mills have their coolant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coolant {
    /// M7.
    pub mist: bool,
    /// M8.
    pub flood: bool,
}

/// A feedrate as programmed, above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Feedrate {
    /// G94.
    PerMinute {
        /// As programmed, in millimetres.
        mm_per_min: Decimal,
        /// The path's.
        path_mm_s: f32,
        /// That of a motion of the yaw alone: of the number of the F word, even in inches.
        turn_deg_s: f32,
    },
    /// G93.
    InverseTime {
        /// One over the motion's minutes.
        per_min: Decimal,
    },
}

impl Feedrate {
    /// The feedrate of an F word; F0 takes it back.
    pub(super) fn new(f: Decimal, mode: FeedMode, units: Units) -> Result<Option<Self>, Error> {
        if f <= Decimal::ZERO {
            return Ok(None);
        }
        Ok(Some(match mode {
            FeedMode::InverseTime => Self::InverseTime { per_min: f },
            FeedMode::PerMinute => {
                let mm_per_min = units.to_mm(b'F', f)?;
                Self::PerMinute {
                    mm_per_min,
                    path_mm_s: mm_per_min.per_minute_to_f32(),
                    turn_deg_s: f.per_minute_to_f32(),
                }
            }
        }))
    }

    /// Its number: mm/min, or 1/min.
    pub(super) const fn number(&self) -> Decimal {
        match *self {
            Self::PerMinute { mm_per_min, .. } => mm_per_min,
            Self::InverseTime { per_min } => per_min,
        }
    }
}

/// The modal state: what one line leaves behind for the next.
///
/// Always G40, and G91.1 (arc centres are incremental), since the robot has no others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modal {
    pub(super) motion: Motion,
    pub(super) plane: Plane,
    pub(super) units: Units,
    pub(super) distance: Distance,
    pub(super) feed_mode: FeedMode,
    /// Coordinate system, 0 for G54.
    pub(super) work_system: u8,
    pub(super) spindle: Spindle,
    pub(super) coolant: Coolant,
    pub(super) tool: u8,
    pub(super) spindle_speed: Decimal,
    /// None until an F that holds.
    pub(super) feedrate: Option<Feedrate>,
    pub(super) corner: CornerRule,
    pub(super) prefilter: PrefilterConfig,
    pub(super) elbow: Elbow,
    /// In machine coordinates. None until the first point of a program, or homing, says
    /// where the robot is.
    pub(super) position: Option<Position>,
    /// Lines counted since the program's begin.
    pub(super) lines: u32,
}

impl Modal {
    /// The state after power-up, position unknown.
    pub(super) const fn new(defaults: &Defaults) -> Self {
        Self {
            motion: Motion::Rapid,
            plane: Plane::Xy,
            units: Units::Millimetres,
            distance: Distance::Absolute,
            feed_mode: FeedMode::PerMinute,
            work_system: 0,
            spindle: Spindle::Off,
            coolant: Coolant {
                mist: false,
                flood: false,
            },
            tool: 0,
            spindle_speed: Decimal::ZERO,
            feedrate: None,
            corner: defaults.corner,
            prefilter: defaults.prefilter,
            elbow: defaults.elbow,
            position: None,
            lines: 0,
        }
    }

    /// Motion mode (G0 to G3, G80).
    #[must_use]
    pub const fn motion(&self) -> Motion {
        self.motion
    }

    /// Plane of arcs (G17 to G19).
    #[must_use]
    pub const fn plane(&self) -> Plane {
        self.plane
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

    /// Feed mode (G93, G94).
    #[must_use]
    pub const fn feed_mode(&self) -> FeedMode {
        self.feed_mode
    }

    /// Active coordinate system, 0 for G54 to 5 for G59.
    #[must_use]
    pub const fn work_system(&self) -> usize {
        self.work_system as usize
    }

    /// M3 to M5.
    #[must_use]
    pub const fn spindle(&self) -> Spindle {
        self.spindle
    }

    /// M7 to M9.
    #[must_use]
    pub const fn coolant(&self) -> Coolant {
        self.coolant
    }

    /// State of all outputs: [`GRIPPER`] and [`BLOW_OFF`].
    #[must_use]
    pub const fn outputs(&self) -> u8 {
        let gripper = match self.spindle {
            Spindle::Off => 0,
            Spindle::Clockwise | Spindle::CounterClockwise => GRIPPER,
        };
        let blow_off = if self.coolant.mist || self.coolant.flood {
            BLOW_OFF
        } else {
            0
        };
        gripper | blow_off
    }

    /// Feedrate of the path in mm/min, or in G93 the F word of the last line; if one holds.
    #[must_use]
    pub fn feed_mm_per_min(&self) -> Option<f32> {
        self.feedrate.map(|feedrate| feedrate.number().to_f32())
    }

    /// How corners are passed (G61, G64).
    #[must_use]
    pub const fn corner(&self) -> CornerRule {
        self.corner
    }

    /// The prefilter (M100).
    #[must_use]
    pub const fn prefilter(&self) -> &PrefilterConfig {
        &self.prefilter
    }

    /// The elbow's side (M101, M102).
    #[must_use]
    pub const fn elbow(&self) -> Elbow {
        self.elbow
    }

    /// Where the last motion ends in machine coordinates, if known.
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
