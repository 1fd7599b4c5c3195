//! How the prefilter follows the map from move to move.

use core::fmt;

use super::automatic::{Shortest, ShortestError};
use super::course::{Course, between};
use super::map::{MapError, ModeMap, ModeMapConfig};
use super::method::Method;
use super::zeros::Zeros;
use crate::path::PathSegment;
use crate::prefilter::{
    HALF_SLOTS, Kernel, Kind, Mode, Prefilter, PrefilterConfig, PrefilterError, Stage,
};
use crate::units::TICK_S;

/// What the two prefilters of a move are made from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PostureMethod {
    /// The named prefilter, for the mode at the start and for that at the end.
    #[default]
    Local,
    /// Two boxes for each phase: see [`Method::A`].
    A,
    /// Two boxes for each phase: see [`Method::B`].
    B,
    /// Two boxes for each phase: see [`Method::Hybrid`].
    Hybrid,
    /// Two boxes for each phase, by the method that suits the move: see [`Method::choose`].
    Auto,
}

impl PostureMethod {
    /// Every method, in the order of their numbers.
    pub const ALL: [Self; 5] = [Self::Local, Self::A, Self::B, Self::Hybrid, Self::Auto];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Local => "local",
            Self::A => "a",
            Self::B => "b",
            Self::Hybrid => "hybrid",
            Self::Auto => "auto",
        }
    }

    /// The method of that name, if there is one; upper and lower case are the same.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|method| method.name().eq_ignore_ascii_case(name))
    }
}

/// What a prefilter is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tuning {
    /// A named prefilter for a mode.
    Named(PrefilterConfig),
    /// Two boxes with zeros at these frequencies in Hz.
    Boxes([f64; 2]),
}

impl Tuning {
    /// The prefilter.
    ///
    /// # Errors
    /// [`PrefilterError`] names the value that is out of range.
    pub fn prefilter(&self) -> Result<Prefilter, PrefilterError> {
        let mut prefilter = Prefilter::NONE;
        self.make(&mut prefilter)?;
        Ok(prefilter)
    }

    /// Makes the prefilter in its place.
    ///
    /// # Errors
    /// As [`Tuning::prefilter`]; the prefilter is of no use then.
    pub(crate) fn make(&self, prefilter: &mut Prefilter) -> Result<(), PrefilterError> {
        match self {
            Self::Named(config) => prefilter.set(config)?,
            Self::Boxes(zeros_hz) => prefilter.set_boxes(zeros_hz.map(|zero_hz| 1.0 / zero_hz)),
        }
        Ok(())
    }

    /// Whether another one is so near that it leaves no more of the vibration than 0.5 %.
    #[must_use]
    pub fn is_near(&self, other: &Self) -> bool {
        let near = |one: f64, other: f64| libm::fabs(one - other) <= SAME_FREQUENCY * one;
        match (self, other) {
            (Self::Named(one), Self::Named(other)) => {
                one.kind == other.kind
                    && near(one.frequency_hz.into(), other.frequency_hz.into())
                    && libm::fabsf(one.damping - other.damping) <= SAME_DAMPING
            }
            (Self::Boxes([a, b]), Self::Boxes([c, d])) => near(*a, *c) && near(*b, *d),
            _ => false,
        }
    }
}

/// Frequencies that differ by less are the same: `V ≈ (π/2) |δf/f|` of 0.5 %.
const SAME_FREQUENCY: f64 = 0.003;

/// Damping ratios that differ by less are the same, for a like effect.
const SAME_DAMPING: f32 = 0.003;

/// The prefilters of a move: equal where it keeps one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveTunings {
    /// To accelerate through. Other than the one in force only if the move begins from rest.
    pub start: Tuning,
    /// To decelerate through.
    pub end: Tuning,
}

/// A move as far as its prefilters depend on it.
#[derive(Clone, Copy, Debug)]
pub struct MoveToFollow {
    /// The mode along it.
    pub course: Course,
    /// How long its raw path takes, in seconds.
    pub duration_s: f64,
    /// Whether everything stands before it begins.
    pub from_rest: bool,
    /// Whether it is a line, on which the prefilter can change.
    pub is_line: bool,
    /// Whether an arc before it still is in flight when it begins.
    pub after_arc: bool,
}

/// Why there is no following the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FollowError {
    /// The map's settings.
    Map(MapError),
    /// No prefilter can be made for one of its modes.
    Prefilter(PrefilterError),
    /// The prefilter for its slowest mode is longer than the two that it changes between may be.
    TooLong {
        /// That prefilter's length.
        length_s: f32,
    },
    /// No prefilter keeps the residual allowed.
    Shortest(ShortestError),
}

impl fmt::Display for FollowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Map(error) => error.fmt(f),
            Self::Prefilter(error) => error.fmt(f),
            Self::TooLong { length_s } => write!(
                f,
                "the prefilter for the map's slowest mode is {length_s:.3} s long and half the delay line holds 0.5 s: choose a shorter prefilter"
            ),
            Self::Shortest(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for FollowError {}

/// What a follower makes prefilters of.
#[derive(Clone, Debug)]
enum Source {
    Named(PrefilterConfig),
    Shortest(Shortest, PrefilterConfig),
    Boxes(PostureMethod),
}

/// Settings of a follower.
#[derive(Clone, Copy, Debug)]
pub struct FollowConfig<'a> {
    /// The map.
    pub map: &'a ModeMapConfig,
    /// The named prefilter; its mode is the map's.
    pub prefilter: PrefilterConfig,
    /// Whether the shortest prefilter is to be chosen instead.
    pub shortest: Option<ShortestConfig>,
    /// What prefilters are made from.
    pub method: PostureMethod,
}

/// What the shortest prefilter has to achieve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortestConfig {
    /// By how much the mode's frequency may be off, as a fraction, 0 to 0.5.
    pub uncertainty: f32,
    /// What may be left of its vibration, as a fraction, above 0 and up to 1.
    pub limit: f32,
}

/// Chooses the prefilters of each move by the map.
///
/// A move accelerates through a prefilter for the mode at its start and decelerates through one
/// for the mode at its end, each for the mean of what the phase meets. Where one follows the other without a stop, both sides of the
/// corner share the prefilter for that place. A move too short to change on its way keeps one
/// prefilter: from rest that for its middle, which is off by half of the change at both ends;
/// within a path the one in force.
#[derive(Clone, Debug)]
pub struct Follower {
    map: ModeMap,
    source: Source,
}

/// Ticks that a change-over takes beside the filters' windows: a segment begins and ends
/// between ticks, and each stage's fractional delay takes a tick.
const SLACK_TICKS: f64 = 12.0;

impl Follower {
    /// Validates the settings, and makes the follower in its place. A filter for any mode of the
    /// map then fits half the delay line.
    ///
    /// # Errors
    /// [`FollowError`] says what cannot be followed; the place is of no use then.
    pub(crate) fn make(
        place: &mut Option<Self>,
        config: &FollowConfig<'_>,
    ) -> Result<(), FollowError> {
        check_map(config.map)?;
        // with as little as can be on the stack, because it looks at many prefilters
        let shortest = match (config.method, config.shortest) {
            (PostureMethod::Local, Some(shortest)) => {
                let modes = config.map.used().iter().map(Mode::from);
                let found = Shortest::new(modes, &shortest);
                Some(found.map_err(FollowError::Shortest)?)
            }
            _ => None,
        };
        Self::put(place, config, shortest)?;
        place
            .as_ref()
            .map_or(Ok(()), |follower| check_length(&follower.slowest()))
    }

    #[inline(never)]
    fn put(
        place: &mut Option<Self>,
        config: &FollowConfig<'_>,
        shortest: Option<Shortest>,
    ) -> Result<(), FollowError> {
        *place = Some(Self {
            map: ModeMap::new(config.map).map_err(FollowError::Map)?,
            source: match (config.method, shortest) {
                (PostureMethod::Local, None) => Source::Named(config.prefilter),
                (PostureMethod::Local, Some(shortest)) => {
                    Source::Shortest(shortest, config.prefilter)
                }
                (method, _) => Source::Boxes(method),
            },
        });
        Ok(())
    }

    /// A tuning for the map's slowest mode: the longest prefilter that a move can get.
    #[must_use]
    pub fn slowest(&self) -> Tuning {
        let mode = self.map.slowest();
        match &self.source {
            Source::Named(config) => named(config, &mode),
            Source::Shortest(shortest, config) => {
                named(&of_kind(config, shortest.longest()), &mode)
            }
            Source::Boxes(_) => Tuning::Boxes([mode.frequency_hz; 2]),
        }
    }

    /// The mode along a segment.
    #[must_use]
    pub fn course(&self, path: &PathSegment) -> Course {
        self.map.course(path)
    }

    /// The prefilters of a move, with the one in force before it.
    #[must_use]
    pub fn tunings(&self, step: &MoveToFollow, now: &Tuning) -> MoveTunings {
        let (first, last) = self.ends(step);
        let start = if step.from_rest { first } else { *now };
        if step.is_line && step.duration_s >= change_over_s(&start, &last, step.after_arc) {
            return MoveTunings { start, end: last };
        }
        let only = if step.from_rest {
            self.middle(step)
        } else {
            *now
        };
        MoveTunings {
            start: only,
            end: only,
        }
    }

    /// What suits both ends.
    fn ends(&self, step: &MoveToFollow) -> (Tuning, Tuning) {
        match &self.source {
            Source::Named(config) => both_ends(config, step),
            Source::Shortest(shortest, config) => {
                both_ends(&of_kind(config, shortest.kind(0.0)), step)
            }
            Source::Boxes(method) => profile(*method, step),
        }
    }

    /// One prefilter for the whole course.
    fn middle(&self, step: &MoveToFollow) -> Tuning {
        let course = &step.course;
        let mode = between(course.start, course.end, 0.5);
        match &self.source {
            Source::Named(config) => named(config, &mode),
            Source::Shortest(shortest, config) => {
                let off = libm::fabs(course.start.frequency_hz / mode.frequency_hz - 1.0);
                named(&of_kind(config, shortest.kind(off)), &mode)
            }
            Source::Boxes(_) => Tuning::Boxes([mode.frequency_hz; 2]),
        }
    }
}

impl fmt::Display for Follower {
    /// Which prefilters, and why.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.source {
            Source::Named(config) => write!(
                f,
                "{} made for the mode where each move starts and ends",
                config.kind.name()
            ),
            Source::Shortest(shortest, _) => shortest.fmt(f),
            Source::Boxes(method) => write!(
                f,
                "two boxes for each phase of a move, by method {}",
                method.name()
            ),
        }
    }
}

#[inline(never)]
fn check_map(config: &ModeMapConfig) -> Result<(), FollowError> {
    ModeMap::new(config).map(drop).map_err(FollowError::Map)
}

/// Whether two prefilters of a tuning fit the delay line. Not inlined, so that none is on the
/// stack for longer.
#[inline(never)]
fn check_length(longest: &Tuning) -> Result<(), FollowError> {
    let mut prefilter = Prefilter::NONE;
    let made = longest.make(&mut prefilter);
    made.map_err(FollowError::Prefilter)?;
    let kernel = Kernel::new(&prefilter).map_err(FollowError::Prefilter)?;
    if usize::from(kernel.length_ticks()) > HALF_SLOTS {
        return Err(FollowError::TooLong {
            length_s: prefilter.length_s() as f32,
        });
    }
    Ok(())
}

/// The boxes of a move; method A's where another one has none.
fn profile(method: PostureMethod, step: &MoveToFollow) -> (Tuning, Tuning) {
    let course = &step.course;
    let feed_mm_s = course.length_mm / step.duration_s;
    let method = match method {
        PostureMethod::Local | PostureMethod::A => Method::A,
        PostureMethod::B => Method::B,
        PostureMethod::Hybrid => Method::Hybrid,
        PostureMethod::Auto => {
            Method::choose(course, feed_mm_s).map_or(Method::A, |choice| choice.method)
        }
    };
    // the feedrate of the raw path is attained however short the move
    let zeros = Zeros::new(course, feed_mm_s, method);
    let inside = |zeros_hz: [f64; 2], end_hz: f64| {
        let (low, high) = (
            course.start.frequency_hz.min(course.end.frequency_hz),
            course.start.frequency_hz.max(course.end.frequency_hz),
        );
        let is_inside = zeros_hz
            .iter()
            .all(|zero_hz| (low..=high).contains(zero_hz));
        Tuning::Boxes(if is_inside { zeros_hz } else { [end_hz; 2] })
    };
    (
        inside(zeros.accelerating_hz, course.start.frequency_hz),
        inside(zeros.decelerating_hz, course.end.frequency_hz),
    )
}

/// Prefilters for what the mode is, on average in time, while a move accelerates from rest and
/// while it decelerates to rest.
///
/// From rest through a prefilter of length `T` and variance `σ²` the mean distance from the
/// rest end is
///
/// ```text
/// (1/T) ∫ F I(t) dt = F ((T − m)² + σ²) / (2T) ≈ F (T/8 + σ²/(2T))
/// ```
/// and the mode turns by as much as if it were that of there all the time.
fn both_ends(config: &PrefilterConfig, step: &MoveToFollow) -> (Tuning, Tuning) {
    let course = &step.course;
    let feed_mm_s = course.length_mm / step.duration_s;
    let met = |mode_after: &dyn Fn(f64) -> Mode| {
        let mut tuning = named(config, &mode_after(0.0));
        for _ in 0..2 {
            let way_s = mean_way_s(&tuning);
            tuning = named(config, &mode_after(feed_mm_s * way_s));
        }
        tuning
    };
    (
        met(&|way_mm| course.mode_at(way_mm)),
        met(&|way_mm| course.mode_at(course.length_mm - way_mm)),
    )
}

/// `T/8 + σ²/(2T)`, with the variance of symmetric stages; 0 of a prefilter that cannot be made.
#[inline(never)]
fn mean_way_s(tuning: &Tuning) -> f64 {
    let mut prefilter = Prefilter::NONE;
    if tuning.make(&mut prefilter).is_err() {
        return 0.0;
    }
    let length_s = prefilter.length_s();
    let variance = |stage: &Stage| {
        let stage_s = stage.length_s();
        let share = match stage {
            Stage::Box(_) => 12.0,
            Stage::Zv(_) => 4.0,
            Stage::Impulses(_) => 8.0,
        };
        stage_s * stage_s / share
    };
    let variance: f64 = prefilter.stages().iter().map(variance).sum();
    if length_s > 0.0 {
        length_s / 8.0 + variance / (2.0 * length_s)
    } else {
        0.0
    }
}

/// The same prefilter for another mode.
fn named(config: &PrefilterConfig, mode: &Mode) -> Tuning {
    Tuning::Named(PrefilterConfig {
        frequency_hz: mode.frequency_hz as f32,
        damping: mode.damping as f32,
        ..*config
    })
}

/// The same settings with another kind.
fn of_kind(config: &PrefilterConfig, kind: Kind) -> PrefilterConfig {
    PrefilterConfig { kind, ..*config }
}

/// How long a raw path has to be for the change between two prefilters on its way: both windows
/// have to see nothing but even motion, and the path has to reach as far as it jumps.
///
/// ```text
/// D ≥ max(T_a, T_d) + |T_d − T_a|,   behind an arc T_a + T_d + …, because it settles first
/// ```
fn change_over_s(start: &Tuning, end: &Tuning, after_arc: bool) -> f64 {
    let (a, d) = (length_s(start), length_s(end));
    let windows = if after_arc { a + d } else { a.max(d) };
    windows + libm::fabs(d - a) + SLACK_TICKS * TICK_S
}

/// How long the prefilter of a tuning is; without end if it cannot be made.
#[inline(never)]
fn length_s(tuning: &Tuning) -> f64 {
    let mut prefilter = Prefilter::NONE;
    match tuning.make(&mut prefilter) {
        Ok(()) => prefilter.length_s(),
        Err(_) => f64::INFINITY,
    }
}
