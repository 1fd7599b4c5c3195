//! The prefilter as a cascade of stages of unit area, in seconds.

use heapless::Vec;

use super::kind::{Boxes, Shaper};
use super::{Impulse, Impulses, Kind, Mode, PrefilterConfig, PrefilterError, Response, SecondMode};
use crate::sort::sort_by;

/// Stages in a cascade: FIR-ZVDD for two modes has eight, and one more delays.
pub const MAX_STAGES: usize = 9;

/// One stage of a cascade; each has unit area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// ZV shaper for a mode: `[1, K] / (1 + K)` at `0, T_d/2`.
    Zv(Mode),
    /// A shaper given by its impulses.
    Impulses(Impulses),
    /// A box `1/T` on `[0, T]`, `T` in seconds: a moving average.
    Box(f64),
}

impl Stage {
    /// The stage's length in seconds.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        match self {
            Self::Zv(mode) => mode.damped_period_s() / 2.0,
            Self::Impulses(list) => list.iter().fold(0.0, |end, i| i.time_s.max(end)),
            Self::Box(length_s) => *length_s,
        }
    }

    /// The mean of the stage's weight over time in seconds.
    fn mean_s(&self) -> f64 {
        match self {
            Self::Box(length_s) => length_s / 2.0,
            Self::Zv(mode) => mean_s(&Impulses::zv(mode)),
            Self::Impulses(list) => mean_s(list),
        }
    }

    /// The variance of the stage's weight over time in s²: `T²/12` of a box,
    /// `Σ A t² − (Σ A t)²` of impulses.
    pub(super) fn variance_s2(&self) -> f64 {
        match self {
            Self::Box(length_s) => length_s * length_s / 12.0,
            Self::Zv(mode) => variance_s2(&Impulses::zv(mode)),
            Self::Impulses(list) => variance_s2(list),
        }
    }
}

fn mean_s(impulses: &Impulses) -> f64 {
    impulses.iter().map(|i| i.amplitude * i.time_s).sum()
}

fn variance_s2(impulses: &Impulses) -> f64 {
    // squares of what is left of the mean: no difference of large numbers
    let mean_s = mean_s(impulses);
    let from_mean = |i: &Impulse| (i.time_s - mean_s) * (i.time_s - mean_s);
    impulses.iter().map(|i| i.amplitude * from_mean(i)).sum()
}

/// A prefilter: a cascade of stages, shapers first and boxes last.
///
/// The order matters to rounding only: a box at the end averages what the stages before it
/// have rounded.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefilter {
    stages: Vec<Stage, MAX_STAGES>,
}

impl Prefilter {
    /// No filter.
    pub const NONE: Self = Self { stages: Vec::new() };

    /// The prefilter that the settings describe: one cascade for each mode, and smoothing.
    ///
    /// # Errors
    /// [`PrefilterError`] names the setting that is out of range.
    pub fn new(config: &PrefilterConfig) -> Result<Self, PrefilterError> {
        let mut prefilter = Self::NONE;
        prefilter.set(config)?;
        Ok(prefilter)
    }

    /// Becomes the prefilter that the settings describe, in its place.
    ///
    /// # Errors
    /// As [`Prefilter::new`]; it is of no use then.
    #[inline(never)]
    pub(crate) fn set(&mut self, config: &PrefilterConfig) -> Result<(), PrefilterError> {
        config.check()?;
        self.stages.clear();
        for (kind, mode) in parts(config) {
            self.push_shaper(config, kind, &mode);
        }
        self.push_all_boxes(config)
    }

    /// The lengths of the boxes of the prefilter that the settings describe, as
    /// [`Prefilter::boxes_s`]; none if they are out of range. Shapers cost most of a prefilter:
    /// they are not made.
    #[inline(never)]
    pub(crate) fn boxes_of(config: &PrefilterConfig) -> Vec<f64, MAX_STAGES> {
        let mut prefilter = Self::NONE;
        let made = prefilter.push_all_boxes(config);
        made.map(|()| prefilter.boxes_s()).unwrap_or_default()
    }

    fn push_all_boxes(&mut self, config: &PrefilterConfig) -> Result<(), PrefilterError> {
        for (kind, mode) in parts(config) {
            self.push_boxes(config, kind, &mode)?;
        }
        let in_seconds = |length_ms| f64::from(length_ms) / 1e3;
        self.smooth(config.smoothing_ms.map(in_seconds));
        Ok(())
    }

    fn push_shaper(&mut self, config: &PrefilterConfig, kind: Kind, mode: &Mode) {
        let v_tol = f64::from(config.v_tol);
        let impulses = match kind.parts().0 {
            Shaper::None => return,
            Shaper::Zv(times) => return (0..times).for_each(|_| self.push(Stage::Zv(*mode))),
            Shaper::Mzv => Impulses::mzv(mode),
            Shaper::Ei => Impulses::extra_insensitive(mode, v_tol),
            Shaper::TwoHumpEi => Impulses::two_hump_ei(mode, v_tol),
            Shaper::ThreeHumpEi => Impulses::three_hump_ei(mode, v_tol),
            Shaper::Custom => Impulses::custom(&config.impulses),
        };
        self.push(Stage::Impulses(impulses));
    }

    fn push_boxes(
        &mut self,
        config: &PrefilterConfig,
        kind: Kind,
        mode: &Mode,
    ) -> Result<(), PrefilterError> {
        let period_s = mode.damped_period_s();
        let given_s = if config.box_ms > 0.0 {
            f64::from(config.box_ms) / 1e3
        } else {
            period_s
        };
        match kind.parts().1 {
            Boxes::None => {}
            Boxes::Period => self.push(Stage::Box(period_s)),
            Boxes::Box => self.push(Stage::Box(given_s)),
            Boxes::SCurve => {
                let length_s = s_curve_box_s(config)?.unwrap_or(given_s);
                self.push(Stage::Box(length_s));
                self.push(Stage::Box(length_s));
            }
        }
        Ok(())
    }

    /// Adds a stage at its place: shapers first, then boxes, the shorter ones first.
    fn push(&mut self, stage: Stage) {
        let rank = |stage: &Stage| match stage {
            Stage::Box(length_s) => *length_s,
            Stage::Zv(_) | Stage::Impulses(_) => 0.0,
        };
        let before = |other: &&Stage| rank(other) <= rank(&stage);
        let place = self.stages.iter().take_while(before).count();
        // two modes have eight stages at the most, smoothing included: there is room
        let _ = self.stages.insert(place, stage);
    }

    /// Adds boxes that keep the feedrate from jumping, in seconds, 0 for none: the first to a
    /// cascade without a box, the second to one with fewer than two.
    ///
    /// A feedrate `F` then accelerates by at most `F/T1`, with a jerk of at most `F/(T1 T2)`,
    /// `T1` and `T2` being the first of [`Prefilter::boxes_s`].
    fn smooth(&mut self, boxes_s: [f64; 2]) {
        for (enough, length_s) in (1..).zip(boxes_s) {
            if length_s > 0.0 && self.boxes_s().len() < enough {
                self.push(Stage::Box(length_s));
            }
        }
    }

    /// Two boxes in cascade, given by their lengths in seconds: a second-order moving average,
    /// with a zero at the inverse of each length.
    ///
    /// The shorter one filters first: the longer a box, the less it errs by taking its input
    /// for straight from tick to tick.
    #[must_use]
    pub fn of_boxes(boxes_s: [f64; 2]) -> Self {
        let mut prefilter = Self::NONE;
        prefilter.add_boxes(boxes_s);
        prefilter
    }

    /// Adds boxes of these lengths in seconds, as far as there is room.
    pub(crate) fn add_boxes(&mut self, boxes_s: [f64; 2]) {
        for length_s in boxes_s {
            self.push(Stage::Box(length_s));
        }
    }

    /// One box, given by its length in seconds: a moving average.
    #[must_use]
    pub fn of_box(length_s: f64) -> Self {
        Self {
            stages: Vec::from_iter([Stage::Box(length_s)]),
        }
    }

    /// The stages in the order in which they filter.
    #[must_use]
    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// `T_h`: how long the output moves on after the input has stopped, in seconds.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        self.stages.iter().map(Stage::length_s).sum()
    }

    /// The response to a segment that accelerates through this prefilter.
    #[must_use]
    pub fn response(&self) -> Response {
        Response::new(&self.stages, false)
    }

    /// The response of the prefilter run backwards in time: what a deceleration looks like
    /// when it is watched from its end.
    #[must_use]
    pub fn reversed_response(&self) -> Response {
        Response::new(&self.stages, true)
    }

    /// How far the output can be from a point of the input's window, in s of travel: `m` or
    /// `T_h − m`, whichever is longer.
    #[must_use]
    pub fn reach_s(&self) -> f64 {
        let mean_s = self.centroid_s();
        mean_s.max(self.length_s() - mean_s)
    }

    /// The lengths of the boxes in seconds, the longest first; none in a pure shaper.
    ///
    /// A feedrate `F` through boxes `T1 ≥ T2` accelerates by at most `F/T1`, with a jerk of at
    /// most `F/(T1 T2)`: shapers, whose weights are positive and sum to 1, make neither larger.
    #[must_use]
    pub fn boxes_s(&self) -> Vec<f64, MAX_STAGES> {
        let mut boxes_s: Vec<f64, MAX_STAGES> = self
            .stages
            .iter()
            .filter_map(|stage| match stage {
                Stage::Box(length_s) => Some(*length_s),
                _ => None,
            })
            .collect();
        sort_by(&mut boxes_s, |one, other| one > other);
        boxes_s
    }

    /// The longest box in seconds; none in a pure shaper, which lets the velocity jump.
    #[must_use]
    pub fn longest_box_s(&self) -> Option<f64> {
        self.boxes_s().first().copied()
    }

    /// `m`, the mean delay of the prefilter in seconds: half a box's length, `Σ A t` of impulses.
    #[must_use]
    pub fn centroid_s(&self) -> f64 {
        self.stages.iter().map(Stage::mean_s).sum()
    }

    /// `σ`, the standard deviation of the prefilter's weight over time, in seconds: a path of
    /// curvature `κ` at a feedrate `F` is cut by about `F² κ σ²/2`.
    ///
    /// The variances of the stages add up.
    #[must_use]
    pub fn spread_s(&self) -> f64 {
        libm::sqrt(self.stages.iter().map(Stage::variance_s2).sum())
    }
}

/// Adds a length to those of boxes, the longest first, if there is room.
pub(crate) fn add_box_s(boxes_s: &mut Vec<f64, MAX_STAGES>, length_s: f64) {
    let longer = boxes_s.iter().take_while(|other| **other >= length_s);
    let place = longer.count();
    let _ = boxes_s.insert(place, length_s);
}

/// The kind for each mode that the settings name.
fn parts(config: &PrefilterConfig) -> impl Iterator<Item = (Kind, Mode)> {
    let mode = |frequency_hz: f32, damping: f32| Mode {
        frequency_hz: frequency_hz.into(),
        damping: damping.into(),
    };
    let first = (config.kind, mode(config.frequency_hz, config.damping));
    let SecondMode {
        kind,
        frequency_hz,
        damping,
        axes: _,
    } = config.second;
    let second = (frequency_hz > 0.0).then(|| (kind, mode(frequency_hz, damping)));
    core::iter::once(first).chain(second)
}

/// `T_rr = √(F/J)`, the boxes of an S-curve that reaches a feedrate `F` with a jerk `J`
/// [Li23]; none without a jerk.
fn s_curve_box_s(config: &PrefilterConfig) -> Result<Option<f64>, PrefilterError> {
    let (feed_mm_s, jerk_mm_s3) = (config.s_curve_feed_mm_s, config.s_curve_jerk_mm_s3);
    if jerk_mm_s3 == 0.0 {
        return Ok(None);
    }
    let length_s = libm::sqrt(f64::from(feed_mm_s) / f64::from(jerk_mm_s3));
    if (0.001..=0.5).contains(&length_s) {
        Ok(Some(length_s))
    } else {
        Err(PrefilterError::SCurve {
            feed_mm_s,
            jerk_mm_s3,
        })
    }
}
