//! The mode along a move.

use crate::prefilter::Mode;

/// How the mode changes along a move: linearly with the way travelled, as in Tajima.
///
/// ```text
/// f(l) = f_s + (f_e − f_s) l / L
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// The mode at the start.
    pub start: Mode,
    /// The mode at the end.
    pub end: Mode,
    /// Length of the move in mm.
    pub length_mm: f64,
}

/// The frequency as a phase meets it that begins or ends at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RestEnd {
    /// `f0`, the frequency at rest in Hz.
    pub frequency_hz: f64,
    /// `g = df/dl`, seen from the rest end, in Hz/mm.
    pub gradient_hz_mm: f64,
}

impl Course {
    /// The mode after so much of the way; beyond an end it is that end's.
    #[must_use]
    pub fn mode_at(&self, travelled_mm: f64) -> Mode {
        // a move that only turns stays where it is
        let part = if self.length_mm > 0.0 {
            (travelled_mm / self.length_mm).clamp(0.0, 1.0)
        } else {
            0.0
        };
        between(self.start, self.end, part)
    }

    /// What the acceleration meets.
    pub(super) fn departing(&self) -> RestEnd {
        RestEnd {
            frequency_hz: self.start.frequency_hz,
            gradient_hz_mm: self.rise_hz_mm(),
        }
    }

    /// What the deceleration meets, watched from its end.
    pub(super) fn arriving(&self) -> RestEnd {
        RestEnd {
            frequency_hz: self.end.frequency_hz,
            gradient_hz_mm: -self.rise_hz_mm(),
        }
    }

    fn rise_hz_mm(&self) -> f64 {
        (self.end.frequency_hz - self.start.frequency_hz) / self.length_mm
    }
}

/// The mode `part` (0 to 1) of the way from one to another.
pub(super) fn between(one: Mode, other: Mode, part: f64) -> Mode {
    let mix = |a: f64, b: f64| a + (b - a) * part;
    Mode {
        frequency_hz: mix(one.frequency_hz, other.frequency_hz),
        damping: mix(one.damping, other.damping),
    }
}
