//! The modal state as `$G` shows it.

use core::fmt;

use crate::corner::CornerRule;

use super::modal::{Distance, FeedMode, Modal, Motion, Plane, Spindle, Units};

/// What stands between `[GC:` and `]`: Grbl's words in Grbl's order, then G61 or G64 with
/// its tolerance in mm or its overlap in percent. F is in mm/min, or in G93 in 1/min.
#[derive(Clone, Copy, Debug)]
pub struct ParserState<'m>(pub(super) &'m Modal);

impl fmt::Display for ParserState<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let modal = self.0;
        f.write_str(match modal.motion {
            Motion::Rapid => "G0",
            Motion::Linear => "G1",
            Motion::ArcClockwise => "G2",
            Motion::ArcCounterClockwise => "G3",
            Motion::Cancelled => "G80",
        })?;
        write!(f, " G{}", 54 + modal.work_system)?;
        let plane = match modal.plane {
            Plane::Xy => " G17",
            Plane::Zx => " G18",
            Plane::Yz => " G19",
        };
        let units = match modal.units {
            Units::Inches => " G20",
            Units::Millimetres => " G21",
        };
        let distance = match modal.distance {
            Distance::Absolute => " G90",
            Distance::Incremental => " G91",
        };
        let feed_mode = match modal.feed_mode {
            FeedMode::InverseTime => " G93",
            FeedMode::PerMinute => " G94",
        };
        let spindle = match modal.spindle {
            Spindle::Clockwise => " M3",
            Spindle::CounterClockwise => " M4",
            Spindle::Off => " M5",
        };
        let coolant = match (modal.coolant.mist, modal.coolant.flood) {
            (false, false) => " M9",
            (true, false) => " M7",
            (false, true) => " M8",
            (true, true) => " M7 M8",
        };
        for word in [plane, units, distance, feed_mode, spindle, coolant] {
            f.write_str(word)?;
        }
        let feed = modal.feedrate.map_or(0, |rate| rate.number().rounded());
        let speed = modal.spindle_speed.rounded();
        write!(f, " T{} F{feed} S{speed}", modal.tool)?;
        match modal.corner {
            CornerRule::ToleranceMm(mm) if mm > 0.0 => write!(f, " G64 P{mm}"),
            CornerRule::OverlapPercent(percent) if percent > 0.0 => write!(f, " G64 Q{percent}"),
            _ => f.write_str(" G61"),
        }
    }
}
