//! Which modes the prefilter suppresses, and on which axes.

use std::fmt;

use planner_core::config::Robot;
use planner_core::prefilter::{AxisSet, PrefilterConfig};
use serde::Serialize;

/// A mode and its prefilter, as the settings have them.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct ModeUse {
    /// The prefilter's name.
    pub prefilter: &'static str,
    /// Natural frequency of the mode.
    pub frequency_hz: f32,
    /// Its damping ratio.
    pub damping: f32,
    /// The axes along which a move has this prefilter.
    pub axes: &'static str,
}

impl ModeUse {
    /// The modes of the settings, the second one if there is one.
    #[must_use]
    pub fn all(config: &PrefilterConfig) -> Vec<Self> {
        let second = config.second;
        let first = Self {
            prefilter: config.kind.name(),
            frequency_hz: config.frequency_hz,
            damping: config.damping,
            axes: config.axes.name(),
        };
        let second = (second.frequency_hz > 0.0).then(|| Self {
            prefilter: second.kind.name(),
            frequency_hz: second.frequency_hz,
            damping: second.damping,
            axes: second.axes.name(),
        });
        std::iter::once(first).chain(second).collect()
    }
}

impl fmt::Display for ModeUse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            prefilter,
            frequency_hz,
            damping,
            axes,
        } = self;
        write!(f, "{prefilter} for {frequency_hz} Hz, damping {damping}")?;
        if *axes != AxisSet::ALL.name() {
            write!(f, ", on moves along {axes}")?;
        }
        Ok(())
    }
}

/// The single axes along which a move has no prefilter at all, neither a mode's nor boxes.
#[must_use]
pub fn axes_without_prefilter(robot: &Robot) -> Vec<&'static str> {
    let is_bare = |axes: &AxisSet| {
        let mut robot = robot.clone();
        robot.suit(*axes) && robot.prefilter().stages().is_empty()
    };
    let single = AxisSet::SETS
        .into_iter()
        .filter(|axes| axes.name().len() == 1);
    single.filter(is_bare).map(AxisSet::name).collect()
}
