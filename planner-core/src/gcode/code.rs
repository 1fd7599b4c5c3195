//! G and M commands by their numbers.

use super::error::Error;
use super::modal::{Distance, FeedMode, Motion, Plane, Spindle, Units};
use super::number::Decimal;
use super::offsets::{G28, G30};

/// A G or M command that the robot knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Code {
    /// G0 to G3, G80.
    Motion(Motion),
    /// Modal group 0.
    NonModal(NonModal),
    /// G17 to G19.
    Plane(Plane),
    /// G20, G21.
    Units(Units),
    /// G40.
    NoCutterCompensation,
    /// G43.1, G49.
    ToolLength(ToolLength),
    /// G54 to G59, from 0.
    WorkSystem(u8),
    /// G59.1 to G59.3.
    NoWorkSystem,
    /// G61, G64.
    PathControl(PathControl),
    /// G90, G91.
    Distance(Distance),
    /// G91.1.
    ArcCentresIncremental,
    /// G93, G94.
    FeedMode(FeedMode),
    /// M0, M2, M30.
    Flow(super::command::ProgramFlow),
    /// M1, which stops nothing.
    OptionalStop,
    /// M3 to M5.
    Spindle(Spindle),
    /// M6, which does nothing.
    ToolChange,
    /// M7 to M9.
    Coolant(CoolantChange),
    /// M100 to M103.
    Robot(RobotCode),
}

/// Commands that concern their own line only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NonModal {
    /// G4.
    Dwell,
    /// G10.
    SetWorkSystem,
    /// G28, G30: by way of the axis words to the row stored.
    Go(usize),
    /// G28.1, G30.1: stores the position in the row.
    Store(usize),
    /// G53.
    MachineCoordinates,
    /// G92.
    SetOffset,
    /// G92.1.
    ResetOffset,
}

/// G43.1 and G49.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ToolLength {
    /// G43.1: Z is the tool's length.
    Set,
    /// G49.
    Cancel,
}

/// Path control, G61 and G64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PathControl {
    /// G61: stand still at every corner.
    ExactStop,
    /// G64: round corners within the tolerance P, by the overlap Q, or by the robot's own rule.
    Blend,
}

/// M7 to M9.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CoolantChange {
    /// M7.
    Mist,
    /// M8.
    Flood,
    /// M9.
    Off,
}

/// The robot's own commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RobotCode {
    /// M100.
    Prefilter,
    /// M101, M102.
    Elbow(crate::kinematics::Elbow),
    /// M103.
    Hop,
}

/// Modal groups of NIST RS274/NGC v3, table 4: one command of each to a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    NonModal,
    Motion,
    Plane,
    Distance,
    ArcDistance,
    FeedMode,
    Units,
    CutterCompensation,
    ToolLength,
    WorkSystem,
    PathControl,
    ProgramFlow,
    ToolChange,
    Spindle,
    Coolant,
    Robot,
}

/// A set of modal groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Groups(u16);

impl Groups {
    /// Adds a group; `false` if the set has it already.
    pub(super) const fn insert(&mut self, group: Group) -> bool {
        let before = self.0;
        self.0 |= 1 << group as u16;
        self.0 != before
    }

    /// Whether the set has a group.
    pub(super) const fn has(self, group: Group) -> bool {
        self.0 & 1 << group as u16 != 0
    }

    /// Whether the set has no group but these.
    pub(super) fn is_within(self, groups: &[Group]) -> bool {
        let all = groups.iter().fold(0, |all, &group| all | 1 << group as u16);
        self.0 & !all == 0
    }
}

impl Code {
    /// The command of a G or M word.
    ///
    /// # Errors
    /// Codes 20, 23 and 29.
    pub(super) fn new(letter: u8, number: Decimal) -> Result<Self, Error> {
        let is_general = letter == b'G';
        let find = |tenths| {
            if is_general {
                Self::general(tenths)
            } else {
                Self::miscellaneous(tenths)
            }
        };
        match number.tenths().and_then(find) {
            Some(Self::NoWorkSystem) => Err(Error::WorkOffset),
            Some(code) => Ok(code),
            None => {
                // As in Grbl, decimals are the error only where the integer alone would
                // do, and for G only where no relative with a decimal exists (G61.1,
                // G90.1, G91.2, G92.2).
                let integer = i32::try_from(number.integer()).unwrap_or(i32::MAX);
                let whole = Decimal::from_integer(integer);
                let has_relatives = is_general && matches!(integer, 28 | 30 | 61 | 90..=92);
                let exists = !is_general || whole.tenths().and_then(find).is_some();
                if whole != number && exists && !has_relatives {
                    Err(Error::NotAnInteger { letter, number })
                } else {
                    Err(Error::UnsupportedCommand { letter, number })
                }
            }
        }
    }

    /// A G command, by ten times its number.
    const fn general(tenths: u16) -> Option<Self> {
        Some(match tenths {
            0 => Self::Motion(Motion::Rapid),
            10 => Self::Motion(Motion::Linear),
            20 => Self::Motion(Motion::ArcClockwise),
            30 => Self::Motion(Motion::ArcCounterClockwise),
            40 => Self::NonModal(NonModal::Dwell),
            100 => Self::NonModal(NonModal::SetWorkSystem),
            170 => Self::Plane(Plane::Xy),
            180 => Self::Plane(Plane::Zx),
            190 => Self::Plane(Plane::Yz),
            200 => Self::Units(Units::Inches),
            210 => Self::Units(Units::Millimetres),
            280 => Self::NonModal(NonModal::Go(G28)),
            281 => Self::NonModal(NonModal::Store(G28)),
            300 => Self::NonModal(NonModal::Go(G30)),
            301 => Self::NonModal(NonModal::Store(G30)),
            400 => Self::NoCutterCompensation,
            431 => Self::ToolLength(ToolLength::Set),
            490 => Self::ToolLength(ToolLength::Cancel),
            530 => Self::NonModal(NonModal::MachineCoordinates),
            540 => Self::WorkSystem(0),
            550 => Self::WorkSystem(1),
            560 => Self::WorkSystem(2),
            570 => Self::WorkSystem(3),
            580 => Self::WorkSystem(4),
            590 => Self::WorkSystem(5),
            591..=593 => Self::NoWorkSystem,
            610 => Self::PathControl(PathControl::ExactStop),
            640 => Self::PathControl(PathControl::Blend),
            800 => Self::Motion(Motion::Cancelled),
            900 => Self::Distance(Distance::Absolute),
            910 => Self::Distance(Distance::Incremental),
            911 => Self::ArcCentresIncremental,
            920 => Self::NonModal(NonModal::SetOffset),
            921 => Self::NonModal(NonModal::ResetOffset),
            930 => Self::FeedMode(FeedMode::InverseTime),
            940 => Self::FeedMode(FeedMode::PerMinute),
            _ => return None,
        })
    }

    /// An M command, by ten times its number.
    const fn miscellaneous(tenths: u16) -> Option<Self> {
        use super::command::ProgramFlow;
        use crate::kinematics::Elbow;
        Some(match tenths {
            0 => Self::Flow(ProgramFlow::Pause),
            10 => Self::OptionalStop,
            20 | 300 => Self::Flow(ProgramFlow::End),
            30 => Self::Spindle(Spindle::Clockwise),
            40 => Self::Spindle(Spindle::CounterClockwise),
            50 => Self::Spindle(Spindle::Off),
            60 => Self::ToolChange,
            70 => Self::Coolant(CoolantChange::Mist),
            80 => Self::Coolant(CoolantChange::Flood),
            90 => Self::Coolant(CoolantChange::Off),
            1000 => Self::Robot(RobotCode::Prefilter),
            1010 => Self::Robot(RobotCode::Elbow(Elbow::Left)),
            1020 => Self::Robot(RobotCode::Elbow(Elbow::Right)),
            1030 => Self::Robot(RobotCode::Hop),
            _ => return None,
        })
    }

    /// Its modal group.
    pub(super) const fn group(self) -> Group {
        match self {
            Self::Motion(_) => Group::Motion,
            Self::NonModal(_) => Group::NonModal,
            Self::Plane(_) => Group::Plane,
            Self::Units(_) => Group::Units,
            Self::NoCutterCompensation => Group::CutterCompensation,
            Self::ToolLength(_) => Group::ToolLength,
            Self::WorkSystem(_) | Self::NoWorkSystem => Group::WorkSystem,
            Self::PathControl(_) => Group::PathControl,
            Self::Distance(_) => Group::Distance,
            Self::ArcCentresIncremental => Group::ArcDistance,
            Self::FeedMode(_) => Group::FeedMode,
            Self::Flow(_) | Self::OptionalStop => Group::ProgramFlow,
            Self::Spindle(_) => Group::Spindle,
            Self::ToolChange => Group::ToolChange,
            Self::Coolant(_) => Group::Coolant,
            Self::Robot(_) => Group::Robot,
        }
    }

    /// Whether it takes the line's axis words, so that no other command can.
    pub(super) const fn uses_axes(self) -> bool {
        match self {
            Self::Motion(motion) => !matches!(motion, Motion::Cancelled),
            Self::NonModal(command) => matches!(
                command,
                NonModal::SetWorkSystem | NonModal::Go(_) | NonModal::SetOffset
            ),
            Self::ToolLength(_) => true,
            _ => false,
        }
    }
}
