//! The zeros of a move's two prefilters, and method B's closed form for them.

use super::Course;
use super::course::RestEnd;
use super::method::Method;
use crate::prefilter::Prefilter;

/// The frequencies that the two prefilters of a move null: a box of `1/f` for each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zeros {
    /// `f1` and `f2` of the prefilter to accelerate through, in Hz.
    pub accelerating_hz: [f64; 2],
    /// `f3` and `f4` of the prefilter to decelerate through, in Hz.
    pub decelerating_hz: [f64; 2],
}

impl Zeros {
    /// The zeros that a method places along a course travelled at `feed_mm_s`.
    ///
    /// Where method B has no solution, the zeros of that phase are method A's.
    #[must_use]
    pub fn new(course: &Course, feed_mm_s: f64, method: Method) -> Self {
        let (start_hz, end_hz) = (course.start.frequency_hz, course.end.frequency_hz);
        let at_rest = |end: &RestEnd| [end.frequency_hz; 2];
        let least = |end: &RestEnd| {
            minimum_amplitude_integral(end, feed_mm_s).unwrap_or_else(|| at_rest(end))
        };
        let (departing, arriving) = (course.departing(), course.arriving());
        let (accelerating_hz, decelerating_hz) = match method {
            Method::A => (at_rest(&departing), at_rest(&arriving)),
            Method::B => (least(&departing), least(&arriving)),
            Method::Hybrid => (least(&departing), at_rest(&arriving)),
            Method::Fir => ([start_hz, end_hz], [start_hz, end_hz]),
        };
        Self {
            accelerating_hz,
            decelerating_hz,
        }
    }

    /// The prefilter to accelerate through.
    #[must_use]
    pub fn accelerating(&self) -> Prefilter {
        nulling(self.accelerating_hz)
    }

    /// The prefilter to decelerate through.
    #[must_use]
    pub fn decelerating(&self) -> Prefilter {
        nulling(self.decelerating_hz)
    }

    /// `f1` to `f4`.
    #[must_use]
    pub fn all_hz(&self) -> [f64; 4] {
        let ([f1, f2], [f3, f4]) = (self.accelerating_hz, self.decelerating_hz);
        [f1, f2, f3, f4]
    }

    /// `Σ 1/f`, the length of both prefilters together in seconds.
    pub(super) fn length_s(&self) -> f64 {
        self.all_hz().into_iter().map(|zero_hz| 1.0 / zero_hz).sum()
    }
}

fn nulling([one_hz, other_hz]: [f64; 2]) -> Prefilter {
    Prefilter::of_boxes([1.0 / one_hz, 1.0 / other_hz])
}

/// `ρ = gF/f0²`, by which part the frequency changes while accelerating at a feedrate.
pub(super) fn relative_change(end: &RestEnd, feed_mm_s: f64) -> f64 {
    end.gradient_hz_mm * feed_mm_s / (end.frequency_hz * end.frequency_hz)
}

/// Method B: the zeros that minimise `∫ |sinc(πf/f1) sinc(πf/f2)| df` over the frequencies
/// `[f0, f_a]` that the phase meets, with the zeros kept inside that range.
///
/// ```text
/// f_a = f0 + g l_a,   l_a = F (1/f1 + 1/f2) / 2
/// ρ = gF/f0²,   f_c = (f0 + √(f0² + 2gF)) / 2,   w = gF/f_c,   zeros at f_c ∓ w/4
/// ```
/// `[f0, f0 + w]` is the range met with both zeros in its middle, and the quarter points are
/// where a parabola has the least area. The exact minimum lies 3 % of `ρ²` lower: with that the
/// zeros are within 0.14 % of it for −0.25 ≤ ρ ≤ 0.4, and within 0.4 % at ρ = −0.3. Beyond, the
/// closed form is taken as it is: up to 20 % from the minimum, and method A is better. `None`
/// for ρ < −0.5, where the frequency would reach zero.
///
/// Source: Tajima, minimum amplitude integral.
fn minimum_amplitude_integral(end: &RestEnd, feed_mm_s: f64) -> Option<[f64; 2]> {
    let rho = relative_change(end, feed_mm_s);
    if rho < -0.5 {
        return None;
    }
    let centre = (1.0 + libm::sqrt(1.0 + 2.0 * rho)) / 2.0;
    let quarter = rho / centre / 4.0;
    let lowered = if FITTED.contains(&rho) {
        1.0 - LOWERED * rho * rho
    } else {
        1.0
    };
    let scale_hz = end.frequency_hz * lowered;
    Some([scale_hz * (centre - quarter), scale_hz * (centre + quarter)])
}

/// By which part of `ρ²` the exact minimum lies below the quarter points: fitted to the direct
/// minimisation over −0.25 ≤ ρ ≤ 0.4.
const LOWERED: f64 = 0.03;

/// `ρ` for which the fit holds.
const FITTED: core::ops::RangeInclusive<f64> = -0.3..=0.4;
