//! Pick-and-place moves: up, across and down again, from rest to rest.
//!
//! A **hop** leaves one place straight upwards, goes across, and comes down straight on the
//! other place. Each of the three is a motion from rest to rest with limited acceleration and
//! jerk ([`Ramp`]). They overlap, but the raw path is vertical within the height at either
//! place:
//!
//! ```text
//!            rise ___________________
//!               /                    \        across begins when up has passed the height
//!    height  - |                      | -     down passes the height when across has ended
//!              |                      |
//! ```
//!
//! **Chosen axes.** What hangs from the tool swings when the tool accelerates across, and what
//! swings is excited by vertical acceleration too. A hop has the prefilter on no axis, on those
//! that go across, or on all ([`HopAxes`]); the other axes follow the raw path. The prefilter
//! delays, so that motion across would reach into the vertical parts; a [`tolerance`] bounds
//! that. The planner delays *across* and *down* until it holds: the raw path has more time, and
//! the path of the tool stays vertical where it has to be. A tolerance as large as the move
//! leaves the raw path's times, and what the prefilter makes of its shape.
//!
//! **Limits of motion.** Where they are set all three motions take so many times as long that the
//! limits hold ([`HopLimits::slowdown`]): see [`crate::limits`].
//!
//! **Holds and overrides** change the rate at which the raw path is walked, gradually: without
//! limits within 150 ms, with them in as many ticks as their accelerations and jerks need.
//!
//! [`tolerance`]: HopConfig::tolerance_mm

mod filtered;
mod plan;
mod ramp;
mod raw;

use core::fmt;

pub use plan::{Hop, HopLimits, HopPeaks, outline, peaks, plan};
pub use ramp::Ramp;
pub use raw::RawHop;

/// Which axes the prefilter of a hop acts on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HopAxes {
    /// None: the raw path is the command.
    None,
    /// X, Y and C.
    Across,
    /// All.
    #[default]
    All,
}

impl HopAxes {
    /// In the order of their numbers.
    pub const ALL: [Self; 3] = [Self::None, Self::Across, Self::All];

    /// Its name in settings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Across => "across",
            Self::All => "all",
        }
    }

    /// The axes of a name, upper or lower case.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|axes| axes.name().eq_ignore_ascii_case(name))
    }
}

/// How hops go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HopConfig {
    /// The height over either place within which the path is vertical, in mm, 0 to 1000.
    pub height_mm: f32,
    /// How far it rises over the higher place, in mm, above 0 to 1000, at least the height.
    pub rise_mm: f32,
    /// How far the prefilter may bend the vertical parts, in mm, 0.001 to 10 000.
    pub tolerance_mm: f32,
    /// Largest acceleration across, and likewise vertical, in mm/s², 1 to 1 000 000.
    pub acceleration_mm_s2: f32,
    /// What the prefilter acts on.
    pub axes: HopAxes,
}

impl Default for HopConfig {
    fn default() -> Self {
        Self {
            height_mm: 50.0,
            rise_mm: 115.0,
            tolerance_mm: 0.5,
            acceleration_mm_s2: 2000.0,
            axes: HopAxes::All,
        }
    }
}

/// Why a hop is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HopError {
    /// A number is out of its range.
    Range {
        /// Name of the setting.
        name: &'static str,
        /// What was given.
        value: f32,
        /// Lowest value.
        low: f32,
        /// Highest value.
        high: f32,
    },
    /// The vertical part is higher than the hop.
    Rise {
        /// Of the hop, in mm.
        rise_mm: f32,
        /// Of the vertical part, in mm.
        height_mm: f32,
    },
}

impl fmt::Display for HopError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range {
                name,
                value,
                low,
                high,
            } => write!(
                f,
                "{name} is {value}, outside {low} to {high}: give a value within that range"
            ),
            Self::Rise { rise_mm, height_mm } => write!(
                f,
                "the hop rises by {rise_mm} mm, less than the {height_mm} mm that are to be \
                 vertical: give a higher rise or a lower height"
            ),
        }
    }
}

impl core::error::Error for HopError {}

impl HopConfig {
    /// Whether a hop can be planned with these.
    ///
    /// # Errors
    /// [`HopError`] names the value that is out of range.
    pub fn check(&self) -> Result<(), HopError> {
        let checks = [
            ("hop-height", self.height_mm, 0.0, 1000.0),
            ("hop-rise", self.rise_mm, 0.001, 1000.0),
            ("hop-tolerance", self.tolerance_mm, 0.001, 10_000.0),
            ("hop-acceleration", self.acceleration_mm_s2, 1.0, 1e6),
        ];
        for (name, value, low, high) in checks {
            if !(low..=high).contains(&value) {
                return Err(HopError::Range {
                    name,
                    value,
                    low,
                    high,
                });
            }
        }
        if self.rise_mm < self.height_mm {
            return Err(HopError::Rise {
                rise_mm: self.rise_mm,
                height_mm: self.height_mm,
            });
        }
        Ok(())
    }
}
