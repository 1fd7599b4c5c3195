//! The methods of Tajima, and which one a move gets.

use core::fmt;

use super::course::Course;
use super::profile::{Profile, ProfileError};
use super::zeros::relative_change;

/// How the zeros of a move's two prefilters are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Start and end reference: accelerates with both zeros at the start's frequency,
    /// decelerates with both at the end's.
    A,
    /// Minimum amplitude integral: both phases with zeros spread over the frequencies met.
    B,
    /// B accelerating, A decelerating: the least overshoot of a long move.
    Hybrid,
    /// One second-order FIR filter with zeros at the start's and the end's frequency, for both
    /// phases: for comparison.
    Fir,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 4] = [Self::A, Self::B, Self::Hybrid, Self::Fir];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "a",
            Self::B => "b",
            Self::Hybrid => "hybrid",
            Self::Fir => "fir",
        }
    }

    /// The method of that name, if there is one; upper and lower case are the same.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|method| method.name().eq_ignore_ascii_case(name))
    }

    /// The method that leaves the least of a move's vibration.
    ///
    /// The hybrid trades some of what is left after the acceleration for less overshoot during
    /// it. That pays where the mode settles before the deceleration begins, and where the
    /// frequency changes little enough while accelerating; otherwise A is better in both
    /// phases.
    ///
    /// # Errors
    /// [`ProfileError`] if there is no such move.
    pub fn choose(course: &Course, feed_mm_s: f64) -> Result<MethodChoice, ProfileError> {
        let profile = Profile::plan(course, feed_mm_s, Self::A)?;
        let decay_per_s = course.start.decay_per_s().min(course.end.decay_per_s());
        let rho = relative_change(&course.departing(), feed_mm_s);
        let (method, reason) = if decay_per_s * profile.cruise_s() < SETTLED {
            (Self::A, Reason::Short)
        } else if !(-STEEPEST..=STEEPEST).contains(&rho) {
            (Self::A, Reason::Steep)
        } else {
            (Self::Hybrid, Reason::Settles)
        };
        Ok(MethodChoice { method, reason })
    }
}

/// `ln 10`: a vibration that decays by as many times its decay rate is a tenth of what it was.
const SETTLED: f64 = core::f64::consts::LN_10;

/// Largest `|ρ|` at which B overshoots less than A while accelerating: at 8 → 20 Hz they are
/// even at ρ = 0.3.
const STEEPEST: f64 = 0.3;

/// A method and why a move gets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MethodChoice {
    /// The method.
    pub method: Method,
    /// Why.
    pub reason: Reason,
}

/// Why a move gets its method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The mode does not settle between the phases.
    Short,
    /// The frequency changes too much while accelerating.
    Steep,
    /// The mode settles between the phases.
    Settles,
}

impl fmt::Display for MethodChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let because = match self.reason {
            Reason::Short => "the mode does not settle to a tenth between the phases",
            Reason::Steep => "the frequency changes too fast while accelerating",
            Reason::Settles => "the mode settles to a tenth between the phases",
        };
        write!(f, "{}: {because}", self.method.name())
    }
}
