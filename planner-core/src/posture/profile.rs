//! The velocity profile of a move: from rest through a prefilter to its feedrate, and through
//! another one back to rest.

use core::fmt;

use super::course::Course;
use super::method::Method;
use super::zeros::Zeros;

/// A move's position, velocity and acceleration over time: the trapezoidal-acceleration
/// profile of Tajima.
///
/// It is section 2 of the method with boxes for prefilters, `a = box(T1) ∗ box(T2)` to
/// accelerate and `d = box(T3) ∗ box(T4)` to decelerate, `T_i = 1/f_i`:
///
/// ```text
/// s(t) = F [I_a(t) − I_d(t − t_stop)],     t_stop = L/F + m_a − m_d,     m = (T1 + T2)/2
/// acceleration A = F / max(T1, T2),   jerk J = F / (T1 T2),   cruise T_c = L/F − Σ T_i / 2
/// short move, T_c < 0:   F' = 2L / Σ T_i
/// ```
///
/// Each phase is evaluated by its own polynomial in the time since the rest beside it, never
/// as a sum of truncated powers, which cancel after a long cruise. Error below 1e-12 of the
/// length in double precision; it ends at exactly its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    length_mm: f64,
    feed_mm_s: f64,
    accelerating: Transition,
    decelerating: Transition,
    cruise_s: f64,
}

/// Where a move is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProfileState {
    /// The way travelled in mm.
    pub position_mm: f64,
    /// Its velocity in mm/s.
    pub velocity_mm_s: f64,
    /// Its acceleration in mm/s².
    pub acceleration_mm_s2: f64,
}

/// Why there is no profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProfileError {
    /// The length is not above 0 and up to 10 m.
    Length {
        /// What was given.
        length_mm: f64,
    },
    /// The feedrate is not above 0 and up to 10 m/s.
    Feed {
        /// What was given.
        feed_mm_s: f64,
    },
    /// A frequency is not between 0.01 and 250 Hz.
    Frequency {
        /// What was given.
        frequency_hz: f64,
    },
}

impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { length_mm } => write!(
                f,
                "the length of {length_mm} mm is not above 0 and up to 10000: give the length of one move"
            ),
            Self::Feed { feed_mm_s } => write!(
                f,
                "the feedrate of {feed_mm_s} mm/s is not above 0 and up to 10000: give it in mm/s"
            ),
            Self::Frequency { frequency_hz } => write!(
                f,
                "the frequency of {frequency_hz} Hz is outside 0.01 to 250 Hz: give the natural frequency of the mode at the start and at the end"
            ),
        }
    }
}

impl core::error::Error for ProfileError {}

/// The step response of two boxes: how the velocity goes from rest to the feedrate.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Transition {
    /// The shorter box in seconds: how long the acceleration takes to build up.
    short_s: f64,
    /// The longer box in seconds.
    long_s: f64,
}

impl Transition {
    fn new([one_hz, other_hz]: [f64; 2]) -> Self {
        Self {
            short_s: 1.0 / one_hz.max(other_hz),
            long_s: 1.0 / one_hz.min(other_hz),
        }
    }

    fn length_s(&self) -> f64 {
        self.short_s + self.long_s
    }

    /// The centroid `m` of the two boxes.
    fn delay_s(&self) -> f64 {
        self.length_s() / 2.0
    }

    /// From rest towards `feed_mm_s`, `t` after its start.
    fn at(&self, feed_mm_s: f64, t: f64) -> ProfileState {
        let acceleration = feed_mm_s / self.long_s;
        let jerk = acceleration / self.short_s;
        if t <= 0.0 {
            ProfileState::default()
        } else if t < self.short_s {
            ProfileState {
                position_mm: jerk * t * t * t / 6.0,
                velocity_mm_s: jerk * t * t / 2.0,
                acceleration_mm_s2: jerk * t,
            }
        } else if t < self.long_s {
            // late by the centroid of the shorter box, whose variance is T²/12
            let since = t - self.short_s / 2.0;
            let variance = self.short_s * self.short_s / 12.0;
            ProfileState {
                position_mm: acceleration * (since * since + variance) / 2.0,
                velocity_mm_s: acceleration * since,
                acceleration_mm_s2: acceleration,
            }
        } else {
            let left = (self.length_s() - t).max(0.0);
            ProfileState {
                position_mm: feed_mm_s * (t - self.delay_s()) + jerk * left * left * left / 6.0,
                velocity_mm_s: feed_mm_s - jerk * left * left / 2.0,
                acceleration_mm_s2: jerk * left,
            }
        }
    }
}

impl Profile {
    /// The profile of a move of `length_mm` at `feed_mm_s`, or at as much less as a short move
    /// allows.
    ///
    /// # Errors
    /// [`ProfileError`] names the value that is out of range.
    pub fn new(length_mm: f64, feed_mm_s: f64, zeros: &Zeros) -> Result<Self, ProfileError> {
        check(length_mm, feed_mm_s, zeros.all_hz())?;
        let feed_mm_s = feed_mm_s.min(attainable_mm_s(length_mm, zeros));
        Ok(Self {
            length_mm,
            feed_mm_s,
            accelerating: Transition::new(zeros.accelerating_hz),
            decelerating: Transition::new(zeros.decelerating_hz),
            cruise_s: (length_mm / feed_mm_s - zeros.length_s() / 2.0).max(0.0),
        })
    }

    /// The profile of a move along a course, with zeros placed by a method for the feedrate
    /// that the move attains.
    ///
    /// # Errors
    /// [`ProfileError`] names the value that is out of range.
    pub fn plan(course: &Course, feed_mm_s: f64, method: Method) -> Result<Self, ProfileError> {
        let zeros = Self::zeros(course, feed_mm_s, method)?;
        Self::new(course.length_mm, feed_mm_s, &zeros)
    }

    /// The zeros that a method places for the feedrate that the move attains.
    ///
    /// On a short move that feedrate depends on the zeros in turn; the less of it, the shorter
    /// the way through both phases, so that bisection finds it.
    ///
    /// # Errors
    /// [`ProfileError`] names the value that is out of range.
    pub fn zeros(course: &Course, feed_mm_s: f64, method: Method) -> Result<Zeros, ProfileError> {
        let ends_hz = [course.start.frequency_hz, course.end.frequency_hz];
        check(course.length_mm, feed_mm_s, ends_hz)?;
        let zeros_at = |feed_mm_s| Zeros::new(course, feed_mm_s, method);
        let attains =
            |feed_mm_s: f64| feed_mm_s <= attainable_mm_s(course.length_mm, &zeros_at(feed_mm_s));
        let depends_on_feed = matches!(method, Method::B | Method::Hybrid);
        if !depends_on_feed || attains(feed_mm_s) {
            return Ok(zeros_at(feed_mm_s));
        }
        let (mut low, mut high) = (0.0, feed_mm_s);
        for _ in 0..BISECTIONS {
            let middle = (low + high) / 2.0;
            if attains(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(zeros_at(low))
    }

    /// Where the move is at `t_s` after its start; before it begins and after it ends it rests.
    #[must_use]
    pub fn at(&self, t_s: f64) -> ProfileState {
        let left_s = self.total_s() - t_s;
        if t_s < self.accelerating.length_s() + self.cruise_s {
            return self.accelerating.at(self.feed_mm_s, t_s);
        }
        let from_end = self.decelerating.at(self.feed_mm_s, left_s);
        ProfileState {
            position_mm: self.length_mm - from_end.position_mm,
            velocity_mm_s: from_end.velocity_mm_s,
            acceleration_mm_s2: -from_end.acceleration_mm_s2,
        }
    }

    /// The feedrate that it attains, `F` or `F'`, in mm/s.
    #[must_use]
    pub fn feed_mm_s(&self) -> f64 {
        self.feed_mm_s
    }

    /// How long it accelerates, in seconds.
    #[must_use]
    pub fn accelerating_s(&self) -> f64 {
        self.accelerating.length_s()
    }

    /// `T_c`, how long it keeps its feedrate, in seconds.
    #[must_use]
    pub fn cruise_s(&self) -> f64 {
        self.cruise_s
    }

    /// When it begins to decelerate: `t_stop`, where the raw path stops, in seconds.
    #[must_use]
    pub fn stop_s(&self) -> f64 {
        self.accelerating.length_s() + self.cruise_s
    }

    /// How long it decelerates, in seconds.
    #[must_use]
    pub fn decelerating_s(&self) -> f64 {
        self.decelerating.length_s()
    }

    /// How long it takes, in seconds.
    #[must_use]
    pub fn total_s(&self) -> f64 {
        self.stop_s() + self.decelerating.length_s()
    }

    /// `A`, the largest acceleration of each phase in mm/s².
    #[must_use]
    pub fn acceleration_mm_s2(&self) -> [f64; 2] {
        [&self.accelerating, &self.decelerating].map(|phase| self.feed_mm_s / phase.long_s)
    }

    /// `J`, the largest jerk of each phase in mm/s³.
    #[must_use]
    pub fn jerk_mm_s3(&self) -> [f64; 2] {
        [&self.accelerating, &self.decelerating]
            .map(|phase| self.feed_mm_s / (phase.short_s * phase.long_s))
    }
}

/// Halvings of the feedrate's bracket: to the last bit of double precision.
const BISECTIONS: usize = 53;

/// `F' = 2L / Σ T_i`, the feedrate at which a move has no cruise.
fn attainable_mm_s(length_mm: f64, zeros: &Zeros) -> f64 {
    2.0 * length_mm / zeros.length_s()
}

fn check(
    length_mm: f64,
    feed_mm_s: f64,
    frequencies_hz: impl IntoIterator<Item = f64>,
) -> Result<(), ProfileError> {
    let up_to_10_000 = |value: f64| value > 0.0 && value <= 10_000.0;
    if !up_to_10_000(length_mm) {
        return Err(ProfileError::Length { length_mm });
    }
    if !up_to_10_000(feed_mm_s) {
        return Err(ProfileError::Feed { feed_mm_s });
    }
    for frequency_hz in frequencies_hz {
        if !(0.01..=250.0).contains(&frequency_hz) {
            return Err(ProfileError::Frequency { frequency_hz });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prefilter::Mode;
    use proptest::prelude::*;

    fn course(start_hz: f64, end_hz: f64, length_mm: f64) -> Course {
        let mode = |frequency_hz| Mode {
            frequency_hz,
            damping: 0.02,
        };
        Course {
            start: mode(start_hz),
            end: mode(end_hz),
            length_mm,
        }
    }

    proptest! {
        #[test]
        fn a_profile_ends_at_its_length_within_feedrate_and_acceleration(
            start_hz in 0.7_f64..60.0, end_hz in 0.7_f64..60.0,
            length_log in -2.0_f64..3.5, feed_log in -1.0_f64..3.5,
            method in 0..Method::ALL.len()
        ) {
            let (length_mm, feed_mm_s) = (libm::pow(10.0, length_log), libm::pow(10.0, feed_log));
            let course = course(start_hz, end_hz, length_mm);
            let profile = Profile::plan(&course, feed_mm_s, Method::ALL[method]).unwrap();
            let feed = profile.feed_mm_s();
            prop_assert!(feed > 0.0 && feed <= feed_mm_s);
            prop_assert!(profile.cruise_s() >= 0.0);
            prop_assert_eq!(profile.at(-1.0), ProfileState::default());
            prop_assert_eq!(
                profile.at(profile.total_s()),
                ProfileState { position_mm: length_mm, ..ProfileState::default() }
            );
            // continuous: from step to step each quantity changes by its derivative's bound
            let [rises, falls] = profile.acceleration_mm_s2();
            let [builds_up, dies_down] = profile.jerk_mm_s3();
            let (most, hardest) = (rises.max(falls), builds_up.max(dies_down));
            let steps = 400;
            let h = profile.total_s() / f64::from(steps);
            let mut last = profile.at(0.0);
            for step in 1..=steps {
                let state = profile.at(h * f64::from(step));
                let slack = 1e-9;
                prop_assert!(state.velocity_mm_s >= -slack * feed);
                prop_assert!(state.velocity_mm_s <= feed * (1.0 + slack));
                prop_assert!(state.acceleration_mm_s2 <= rises * (1.0 + slack));
                prop_assert!(state.acceleration_mm_s2 >= -falls * (1.0 + slack));
                let moved = state.position_mm - last.position_mm;
                prop_assert!(moved >= -slack * length_mm && moved <= feed * h + slack * length_mm);
                let gained = state.velocity_mm_s - last.velocity_mm_s;
                prop_assert!(libm::fabs(gained) <= most * h + slack * feed);
                let pushed = state.acceleration_mm_s2 - last.acceleration_mm_s2;
                prop_assert!(libm::fabs(pushed) <= hardest * h + slack * most);
                last = state;
            }
        }

        #[test]
        fn a_lower_feedrate_takes_longer(
            start_hz in 1.0_f64..60.0, end_hz in 1.0_f64..60.0, feed_mm_s in 1.0_f64..500.0
        ) {
            let course = course(start_hz, end_hz, 100.0);
            let total = |feed| Profile::plan(&course, feed, Method::A).unwrap().total_s();
            prop_assert!(total(feed_mm_s * 0.9) >= total(feed_mm_s));
        }
    }

    #[test]
    fn a_short_move_has_no_cruise_and_the_feedrate_that_its_zeros_are_for() {
        for (start_hz, end_hz) in [(8.0, 20.0), (20.0, 8.0)] {
            let course = course(start_hz, end_hz, 5.0);
            for method in Method::ALL {
                let profile = Profile::plan(&course, 200.0, method).unwrap();
                let zeros = Zeros::new(&course, profile.feed_mm_s(), method);
                let attainable = attainable_mm_s(5.0, &zeros);
                let gap = libm::fabs(profile.feed_mm_s() / attainable - 1.0);
                // where method B has no solution any more, the feedrate stays just below
                assert!(
                    gap < 1e-9 || method == Method::B && start_hz > end_hz,
                    "{method:?} {gap}"
                );
                assert!(profile.cruise_s() < 0.2 * profile.total_s());
            }
        }
    }

    #[test]
    fn what_is_out_of_range_is_refused_by_name() {
        let good = course(8.0, 20.0, 100.0);
        let refused = |course: &Course, feed_mm_s| {
            std::format!(
                "{}",
                Profile::plan(course, feed_mm_s, Method::B).unwrap_err()
            )
        };
        assert!(refused(&good, 0.0).contains("feedrate of 0 mm/s"));
        assert!(refused(&good, f64::NAN).contains("feedrate of NaN"));
        assert!(refused(&course(8.0, 20.0, -1.0), 50.0).contains("length of -1 mm"));
        assert!(refused(&course(8.0, f64::INFINITY, 1.0), 50.0).contains("frequency of inf Hz"));
    }
}
