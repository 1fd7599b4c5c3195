//! How the prefilter follows the map from move to move.

use core::fmt;

use super::automatic::{Shortest, ShortestError};
use super::course::{Course, between};
use super::map::{MapError, ModeMap, ModeMapConfig};
use super::method::Method;
use super::zeros::Zeros;
use crate::limits::BoxRange;
use crate::path::PathSegment;
use crate::prefilter::{
    HALF_SLOTS, Kernel, Kind, Mode, Prefilter, PrefilterConfig, PrefilterError, Stage, add_box_s,
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
    /// Two boxes with zeros at these frequencies in Hz, and the second mode's prefilter of the
    /// settings besides.
    Boxes([f64; 2], PrefilterConfig),
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
            Self::Boxes(zeros_hz, besides) => {
                prefilter.set(besides)?;
                prefilter.add_boxes(zeros_hz.map(|zero_hz| 1.0 / zero_hz));
            }
        }
        Ok(())
    }

    /// Adds to a range the boxes of the prefilter.
    fn add_boxes(&self, range: &mut BoxRange) {
        let (config, zeros_hz) = match self {
            Self::Named(config) => (config, None),
            Self::Boxes(zeros_hz, besides) => (besides, Some(zeros_hz)),
        };
        let mut boxes_s = Prefilter::boxes_of(config);
        for zero_hz in zeros_hz.into_iter().flatten() {
            add_box_s(&mut boxes_s, 1.0 / zero_hz);
        }
        range.add(&boxes_s);
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
            (Self::Boxes([a, b], _), Self::Boxes([c, d], _)) => near(*a, *c) && near(*b, *d),
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
    /// How long the prefilter in force is, in seconds.
    pub in_force_s: f64,
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
    /// The settings are those of [`Tuning::Boxes`].
    Boxes(PostureMethod, PrefilterConfig),
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
    /// The largest reach of its prefilters in s: see [`Prefilter::reach_s`].
    reach_s: f32,
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
        Self::put(place, config, shortest(config)?)?;
        place.as_mut().map_or(Ok(()), Self::fit)
    }

    /// Leaves out what is too long for the delay line, and takes note of the reach. Not inlined,
    /// so that what the follower is made of is not on the stack any more.
    #[inline(never)]
    fn fit(&mut self) -> Result<(), FollowError> {
        self.leave_out_too_long();
        check_length(&self.slowest())?;
        self.reach_s = self.longest_reach_s();
        Ok(())
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
                (method, _) => Source::Boxes(
                    method,
                    PrefilterConfig {
                        kind: Kind::None,
                        smoothing_ms: [0.0; 2],
                        ..config.prefilter
                    },
                ),
            },
            reach_s: 0.0,
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
            Source::Boxes(_, besides) => Tuning::Boxes([mode.frequency_hz; 2], *besides),
        }
    }

    /// Leaves kinds out of the choice that would be too long for the slowest mode.
    fn leave_out_too_long(&mut self) {
        let mode = self.map.slowest();
        if let Source::Shortest(shortest, config) = &mut self.source {
            shortest.retain(|kind| check_length(&named(&of_kind(config, kind), &mode)).is_ok());
        }
    }

    /// The largest [`Prefilter::reach_s`] of the prefilters that a move can get.
    #[must_use]
    pub const fn reach_s(&self) -> f32 {
        self.reach_s
    }

    /// `T_h − m` is largest with the most damping, `m` with the least.
    fn longest_reach_s(&self) -> f32 {
        let most = self.map.slowest();
        let none = Mode {
            damping: 0.0,
            ..most
        };
        let mut longest_s = 0.0_f64;
        for mode in [most, none] {
            self.each_tuning(&mode, &mut |tuning| {
                longest_s = longest_s.max(reach_s(tuning));
            });
        }
        longest_s as f32
    }

    /// Adds to a range the boxes of every prefilter that a move along a course can get.
    ///
    /// Every box of a prefilter is a damped period long, or as long as the settings say: the
    /// n-th longest one grows with the period as well.
    #[inline(never)]
    pub fn add_boxes(&self, range: &mut BoxRange, course: &Course) {
        let (one, other) = (course.start, course.end);
        let slowest = Mode {
            frequency_hz: one.frequency_hz.min(other.frequency_hz),
            damping: one.damping.max(other.damping),
        };
        let fastest = Mode {
            frequency_hz: one.frequency_hz.max(other.frequency_hz),
            damping: one.damping.min(other.damping),
        };
        for mode in [slowest, fastest] {
            self.each_tuning(&mode, &mut |tuning| tuning.add_boxes(range));
        }
    }

    /// Every kind of tuning that a move can get, for the map's slowest mode.
    pub(crate) fn each_slowest(&self, take: &mut dyn FnMut(&Tuning)) {
        self.each_tuning(&self.map.slowest(), take);
    }

    /// The same for a mode.
    #[inline(never)]
    fn each_tuning(&self, mode: &Mode, take: &mut dyn FnMut(&Tuning)) {
        match &self.source {
            Source::Named(config) => take(&named(config, mode)),
            Source::Shortest(shortest, config) => shortest
                .kinds()
                .for_each(|kind| take(&named(&of_kind(config, kind), mode))),
            Source::Boxes(_, besides) => {
                take(&Tuning::Boxes([mode.frequency_hz; 2], *besides));
            }
        }
    }

    /// The mode along a segment.
    #[must_use]
    pub fn course(&self, path: &PathSegment) -> Course {
        self.map.course(path)
    }

    /// The prefilters of a move, with the one in force before it.
    ///
    /// Cost on a Cortex-M4F: nothing for a move within a path that is shorter than the prefilter
    /// in force, or an arc; else some 100 000 instructions.
    #[must_use]
    pub fn tunings(&self, step: &MoveToFollow, now: &Tuning) -> MoveTunings {
        let may_change = step.is_line && step.duration_s > step.in_force_s;
        if !step.from_rest && !may_change {
            return MoveTunings {
                start: *now,
                end: *now,
            };
        }
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
            Source::Boxes(method, besides) => profile(*method, besides, step),
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
            Source::Boxes(_, besides) => Tuning::Boxes([mode.frequency_hz; 2], *besides),
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
            Source::Boxes(method, _) => write!(
                f,
                "two boxes for each phase of a move, by method {}",
                method.name()
            ),
        }
    }
}

/// The choice of the shortest prefilter, if that is asked for. Not inlined, because it looks at
/// many prefilters.
#[inline(never)]
fn shortest(config: &FollowConfig<'_>) -> Result<Option<Shortest>, FollowError> {
    match (config.method, &config.shortest) {
        (PostureMethod::Local, Some(shortest)) => {
            let modes = config.map.used().iter().map(Mode::from);
            let found = Shortest::new(modes, shortest, config.prefilter.v_tol);
            found.map(Some).map_err(FollowError::Shortest)
        }
        _ => Ok(None),
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
fn profile(
    method: PostureMethod,
    besides: &PrefilterConfig,
    step: &MoveToFollow,
) -> (Tuning, Tuning) {
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
        let zeros_hz = if is_inside { zeros_hz } else { [end_hz; 2] };
        Tuning::Boxes(zeros_hz, *besides)
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

/// The same settings with another kind, as [`Shortest`] knows it: its boxes are a period long.
fn of_kind(config: &PrefilterConfig, kind: Kind) -> PrefilterConfig {
    PrefilterConfig {
        kind,
        box_ms: 0.0,
        s_curve_jerk_mm_s3: 0.0,
        ..*config
    }
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

/// The [`Prefilter::reach_s`] of a tuning; 0 if it cannot be made.
#[inline(never)]
fn reach_s(tuning: &Tuning) -> f64 {
    let mut prefilter = Prefilter::NONE;
    let made = tuning.make(&mut prefilter);
    made.map_or(0.0, |()| prefilter.reach_s())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::MapNode;
    use crate::prefilter::{AxisSet, SecondMode, residual};

    /// 20 Hz at one end, 8 Hz at the other.
    fn course() -> Course {
        let mode = |frequency_hz| Mode {
            frequency_hz,
            damping: 0.02,
        };
        Course {
            start: mode(20.0),
            end: mode(8.0),
            length_mm: 150.0,
        }
    }

    fn follower(prefilter: PrefilterConfig, shortest: Option<ShortestConfig>) -> Follower {
        follower_by(PostureMethod::Local, prefilter, shortest)
    }

    fn follower_by(
        method: PostureMethod,
        prefilter: PrefilterConfig,
        shortest: Option<ShortestConfig>,
    ) -> Follower {
        let map = ModeMapConfig::constant(MapNode::new(8.0, 0.02));
        let mut place = None;
        let config = FollowConfig {
            map: &map,
            prefilter,
            shortest,
            method,
        };
        Follower::make(&mut place, &config).unwrap();
        place.unwrap()
    }

    fn step(from_rest: bool) -> MoveToFollow {
        MoveToFollow {
            course: course(),
            duration_s: 1.0,
            from_rest,
            is_line: true,
            after_arc: false,
            in_force_s: 0.5,
        }
    }

    fn tunings(follower: &Follower, from_rest: bool) -> [PrefilterConfig; 2] {
        let step = step(from_rest);
        let MoveTunings { start, end } = follower.tunings(&step, &follower.slowest());
        [start, end].map(|tuning| match tuning {
            Tuning::Named(config) => config,
            Tuning::Boxes(..) => panic!("named prefilters are asked for"),
        })
    }

    fn left(config: &PrefilterConfig, frequency_hz: f32, damping: f32) -> f64 {
        let mode = Mode {
            frequency_hz: frequency_hz.into(),
            damping: damping.into(),
        };
        residual(&Prefilter::new(config).unwrap(), &mode)
    }

    #[test]
    fn prefilters_of_a_move_keep_second_mode_residual_allowed_and_smoothing() {
        const SECOND_HZ: f32 = 36.6;
        let plain = PrefilterConfig {
            kind: Kind::Ei,
            v_tol: 0.2,
            ..PrefilterConfig::DEFAULT
        };
        let second = SecondMode {
            axes: AxisSet::ALL,
            kind: Kind::Zv,
            frequency_hz: SECOND_HZ,
            damping: 0.03,
        };
        let both = PrefilterConfig { second, ..plain };
        let smooth = PrefilterConfig {
            smoothing_ms: [30.0, 12.0],
            ..plain
        };
        for from_rest in [false, true] {
            for config in tunings(&follower(plain, None), from_rest) {
                let allowed = left(&config, config.frequency_hz, config.damping);
                assert!((allowed - 0.2).abs() < 1e-6, "{allowed}");
                assert!(left(&config, SECOND_HZ, 0.03) > 0.2, "{config:?}");
            }
            for config in tunings(&follower(both, None), from_rest) {
                assert!(left(&config, config.frequency_hz, config.damping) < 0.2);
                assert!(left(&config, SECOND_HZ, 0.03) < 1e-6, "{config:?}");
            }
            for config in tunings(&follower(smooth, None), from_rest) {
                assert_eq!(Prefilter::new(&config).unwrap().boxes_s(), [0.03, 0.012]);
            }
        }
    }

    #[test]
    fn a_move_within_a_path_changes_the_prefilter_on_a_line_that_is_long_enough() {
        let follower = follower(PrefilterConfig::DEFAULT, None);
        let now = follower.slowest();
        let end = |step: &MoveToFollow| {
            let MoveTunings { start, end } = follower.tunings(step, &now);
            assert_eq!(start, now);
            end
        };
        // two periods at 8 Hz before and at about 9 Hz behind, and the slack
        let in_force_s = 2.0 / 8.0;
        let lasts = |duration_s| MoveToFollow {
            duration_s,
            in_force_s,
            course: Course {
                end: Mode {
                    frequency_hz: 9.0,
                    damping: 0.02,
                },
                ..course()
            },
            ..step(false)
        };
        assert_eq!(end(&lasts(0.2)), now);
        assert_eq!(end(&lasts(0.28)), now);
        assert_ne!(end(&lasts(0.32)), now);
        let arc = MoveToFollow {
            is_line: false,
            ..lasts(0.32)
        };
        assert_eq!(end(&arc), now);
    }

    #[test]
    fn two_boxes_leave_nothing_of_the_second_mode_either() {
        const SECOND_HZ: f64 = 36.6;
        let second = |frequency_hz| SecondMode {
            axes: AxisSet::ALL,
            kind: Kind::Zv,
            frequency_hz,
            damping: 0.0,
        };
        let left_of_second = |frequency_hz: f32| {
            let follower = follower_by(
                PostureMethod::A,
                PrefilterConfig {
                    second: second(frequency_hz),
                    ..PrefilterConfig::DEFAULT
                },
                None,
            );
            let MoveTunings { start, end } = follower.tunings(&step(true), &follower.slowest());
            let mut range = BoxRange::of(&[0.05, 0.05]);
            follower.add_boxes(&mut range, &course());
            assert_eq!((range.shortest_s, range.longest_s), ([0.05; 2], [0.125; 2]));
            [start, end].map(|tuning| {
                let mode = Mode {
                    frequency_hz: SECOND_HZ,
                    damping: 0.0,
                };
                residual(&tuning.prefilter().unwrap(), &mode)
            })
        };
        assert!(
            left_of_second(SECOND_HZ as f32)
                .iter()
                .all(|left| *left < 1e-6)
        );
        assert!(left_of_second(0.0).iter().all(|left| *left > 1e-3));
    }

    #[test]
    fn the_automatic_choice_leaves_no_more_than_its_limit_whatever_else_is_set() {
        let config = PrefilterConfig {
            v_tol: 0.2,
            box_ms: 11.0,
            s_curve_jerk_mm_s3: 1e6,
            smoothing_ms: [30.0, 12.0],
            ..PrefilterConfig::DEFAULT
        };
        for (uncertainty, limit) in [(0.02, 0.05), (0.1, 0.05), (0.2, 0.1), (0.25, 0.02)] {
            let shortest = ShortestConfig { uncertainty, limit };
            let follower = follower(config, Some(shortest));
            for config in tunings(&follower, true) {
                for off in [-uncertainty, 0.0, uncertainty] {
                    let met_hz = config.frequency_hz * (1.0 + off);
                    let left = left(&config, met_hz, config.damping);
                    assert!(left <= f64::from(limit) + 1e-3, "{left}, {config:?}");
                }
            }
        }
    }

    #[test]
    fn all_boxes_that_a_move_can_get_are_in_the_range() {
        let zv = PrefilterConfig {
            kind: Kind::Zv,
            smoothing_ms: [30.0, 12.0],
            ..PrefilterConfig::DEFAULT
        };
        let fir = PrefilterConfig {
            kind: Kind::FirZv,
            ..zv
        };
        let range_of = |follower: &Follower| {
            let mut range = BoxRange::of(&[0.06, 0.02]);
            follower.add_boxes(&mut range, &course());
            range
        };
        let damped = |hz: f32| 1.0 / (hz * libm::sqrtf(1.0 - 0.02 * 0.02));
        let near = |found: [f32; 2], expected: [f32; 2]| {
            let close = |(one, other): (f32, f32)| (one - other).abs() < 1e-6;
            assert!(found.into_iter().zip(expected).all(close), "{found:?}");
        };
        let range = range_of(&follower(zv, None));
        near(range.shortest_s, [0.03, 0.012]);
        near(range.longest_s, [0.06, 0.02]);
        let range = range_of(&follower(fir, None));
        near(range.shortest_s, [damped(20.0), 0.012]);
        near(range.longest_s, [damped(8.0), 0.02]);
        // pure shapers for small uncertainties, a box besides for moves on which the mode changes
        let shortest = ShortestConfig {
            uncertainty: 0.02,
            limit: 0.05,
        };
        let range = range_of(&follower(fir, Some(shortest)));
        near(range.shortest_s, [0.03, 0.012]);
    }
}
