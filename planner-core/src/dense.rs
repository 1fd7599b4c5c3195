//! Lines in a row: whether the command keeps the tolerance where several corners lie within the
//! prefilter's length.
//!
//! # The guarantee
//! The command is the mean of the points that the raw path `Γ(s)` passes, weighted by the
//! prefilter: `P(t) = E Γ(s(t − τ))`. With `s̄(t) = E s(t − τ)` and `Δu_j` the change of tangent
//! at the corner `s_j`,
//!
//! ```text
//! |P − Γ(s̄)| ≤ G = Σ_j |Δu_j| e_j,   e_j = min(a_j, b_j),   a_j = E(s_j − s)₊,  b_j = E(s − s_j)₊
//! ```
//!
//! because `Γ(s) = Γ(s̄) + u(s̄)(s − s̄) + Σ Δu_j (s − s_j)₊` over the corners ahead of `s̄`, with
//! `(s_j − s)₊` for those behind, and `b_j − a_j = s̄ − s_j`. On a circle of many chords at
//! constant feedrate `G` is `F² σ² / (2R)`, what the command really cuts.
//!
//! A segment is planned when its line arrives, and those before it are not changed any more. So
//! it is checked that `G ≤ tolerance` all along **if the path stops at the segment's end**; then
//! the path can always stop there, and there is always a way to go on. Whatever the
//! prefilter is, nothing else is asked of it than its step and ramp response `S` and `I`.
//!
//! # How it is computed
//! With `s̄_j` the mean as if the path stopped at the corner `j`: `a_j = s_j − s̄_j`, so that
//!
//! ```text
//! G(t) = A(t) − B(s̄(t)),     A = Σ |Δu_j| (s_j − s̄_j(t)),     B(s) = Σ |Δu_j| (s_j − s)₊
//! s̄(t) += F [I(t − t_start) − I(t − t_end)]     for each segment
//! ```
//!
//! `A` and `s̄` are kept at times `h` apart, `B` is exact at every corner. Between them a
//! function bends upward from its chord by `h/4` times what its rate *falls*, at most. The
//! rate of `A` falls where a feedrate rose, that of `s̄` where one fell:
//!
//! ```text
//! A(t) ≤ chord of [A + h/4 Σ_j |Δu_j| Σ_{i≤j} (ΔF_i)₊ ΔS_i],     s̄(t) ≤ chord of [s̄ + h/4 Σ_i (−ΔF_i)₊ ΔS_i]
//! ```
//!
//! so that `G` is bounded everywhere, and tightly: it is enough to look at the samples and at
//! the corners between them. Corners closer together than `h` are joined first, see
//! [`crate::outline`].
//!
//! # Holds and overrides
//! Let the raw path go slower, or stand, at any time. At a given time after it came to a corner,
//! `a_j` and `b_j` are at most as planned; `a_j` falls and `b_j` grows; so on the line
//! `b_j − a_j = s̄ − s_j`, where `e_j` is looked up, it is at most as planned too. `G` as a
//! function of the place `s̄` therefore nowhere grows. Where a segment is hurried by `k`, the
//! dwells beside it grow by `(T − t_d)(1 − 1/k)`, with `T` the prefilter's length: seen from the
//! corner's departure the raw point is for all of the prefilter's length no further away than
//! planned, `k (z − T (1 − 1/k)) ≤ z` for `z ≤ T`.

use heapless::Vec;

use crate::config::Robot;
use crate::outline::{Joint, Outline};
use crate::prefilter::Response;

/// Intervals within the prefilter's length.
const INTERVALS: u16 = 32;

/// Samples: the prefilter's length, one interval more on either side, and one to make room.
const SAMPLES: usize = INTERVALS as usize + 4;

/// Knots within the prefilter's length. With more the path stops.
const KNOTS: usize = 64;

/// With more knots than this their outline is made coarser.
const MANY_KNOTS: usize = 56;

/// How far the outline may be from the path, as a part of the tolerance.
const FINE: f32 = 0.03;
const COARSE: f32 = 0.1;

/// How long a piece of the outline that leaves out corners may last, in intervals: on a circle
/// it is then within 0.8 % of the tolerance.
const PIECE: f32 = 1.25;

/// A line that follows the last one.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Direction.
    pub tangent: [f32; 3],
    /// Length in mm, above zero.
    pub length_mm: f32,
    /// Tolerance at the corner before it, in mm.
    pub tolerance_mm: f32,
}

/// How a line is walked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// How long the raw path stands before it, in seconds.
    pub dwell_s: f32,
    /// How long the line lasts, in seconds, above zero.
    pub duration_s: f32,
}

impl Walk {
    /// How long it takes.
    pub fn time_s(&self) -> f32 {
        self.dwell_s + self.duration_s
    }
}

/// What may follow a further line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The tolerance holds everywhere if the path stops behind it.
    pub may_stop: bool,
    /// It is about to hold as well if the path goes on to turn as it did of late.
    pub may_go_on: bool,
}

/// What is known of the command at a time; lengths and times are counted from the end of the
/// path, and from when the raw path comes there.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    time_s: f32,
    /// `s̄` if the path stops at its end.
    mean_mm: f32,
    /// `A` of the knots but the last, with what it may bend between samples.
    spread_mm: f32,
    /// The same of the last knot, for a turn of 1.
    last_mm: f32,
    /// What feedrates have risen by from the sample before to the one behind, `Σ (ΔF)₊ ΔS`.
    rise_mm_s: f32,
    /// What they have fallen by since the sample before, the stop at the path's end left out.
    fall_mm_s: f32,
}

/// A corner of the outline.
#[derive(Clone, Copy, Debug)]
struct Knot {
    time_s: f32,
    along_mm: f32,
    turn: f32,
    tolerance_mm: f32,
    /// How far the path is from the outline behind it.
    loose_mm: f32,
}

/// What a step does to a sample.
#[derive(Clone, Copy, Default)]
struct Change {
    mean_mm: f32,
    rise_mm_s: f32,
    fall_mm_s: f32,
    /// By the stop at its end.
    stop_mm_s: f32,
    /// `I` since its end.
    ended_s: f32,
}

/// Lines in a row.
#[derive(Clone, Debug, Default)]
pub struct Chain {
    samples: Vec<Sample, SAMPLES>,
    /// Oldest first. The first is the start of the run, without a turn.
    knots: Vec<Knot, KNOTS>,
    outline: Outline,
    /// Feedrate of the last line.
    feed_mm_s: f32,
}

impl Chain {
    /// Begins anew with a line, from rest or as if from rest.
    pub fn begin(&mut self, robot: &Robot, tangent: [f32; 3], length_mm: f32, duration_s: f32) {
        self.samples.clear();
        self.knots.clear();
        self.feed_mm_s = 0.0;
        let start = Joint {
            last_turn: 0.0,
            turn: Some(0.0),
            loose_mm: 0.0,
        };
        let step = Step {
            tangent,
            length_mm,
            tolerance_mm: f32::INFINITY,
        };
        let walk = Walk {
            dwell_s: 0.0,
            duration_s,
        };
        self.walk(robot, &start, &step, &walk);
        self.outline.begin(tangent, length_mm, duration_s);
    }

    /// The run ends; what is known of the path's turns stays.
    pub fn end(&mut self) {
        self.samples.clear();
    }

    /// Whether it has not begun, or has ended.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// How a further line joins. The run must have begun.
    pub fn joint(&self, robot: &Robot, step: &Step, duration_s: f32) -> Joint {
        let share = if self.knots.len() < MANY_KNOTS {
            FINE
        } else {
            COARSE
        };
        let limits = (
            PIECE * interval_s(robot) - duration_s,
            share * step.tolerance_mm,
        );
        self.outline.joint(step.tangent, step.length_mm, limits)
    }

    /// How much the path turns per mm of late, with a further line.
    pub fn curvature_per_mm(&self, turn: f32, length_mm: f32) -> f32 {
        self.outline.curvature_per_mm(turn, length_mm)
    }

    /// Whether the tolerance holds with a further line.
    ///
    /// Cost on a Cortex-M4: see the table in the crate's documentation.
    pub fn judge(&self, robot: &Robot, joint: &Joint, step: &Step, walk: &Walk) -> Verdict {
        let mut verdict = Verdict {
            may_stop: false,
            may_go_on: true,
        };
        if joint.turn.is_some() && self.knots.is_full() {
            return verdict;
        }
        let limit_mm = self.limit_mm(joint, step);
        let interval_s = interval_s(robot);
        let bend_s = interval_s / 4.0;
        let mut changes = Changes::new(robot, self.feed_mm_s, step, walk);
        let corners = Ahead::new(self, joint);
        let curvature_per_mm = self.curvature_per_mm(joint.turn.unwrap_or(0.0), step.length_mm);
        let mut going_on = GoingOn {
            corners: corners.clone(),
            feed_mm_s: changes.feed_mm_s,
            interval_turn: curvature_per_mm * changes.feed_mm_s * interval_s,
            half_turn: curvature_per_mm * step.length_mm / 2.0,
            reach_s: 0.0,
            end_mm: step.length_mm,
            before: None,
        };
        let mut stopping = corners;
        let mut before: Option<Seen> = None;
        for (i, sample) in self.samples.iter().enumerate() {
            let change = changes.of(&self.samples, i);
            let mut spread_mm = sample.spread_mm + joint.last_turn * sample.last_mm;
            if let Some(turn) = joint.turn {
                spread_mm += turn * own_mm(sample, bend_s);
            }
            let here = Seen {
                mean_mm: sample.mean_mm + change.mean_mm,
                spread_mm,
                fall_mm_s: sample.fall_mm_s + change.fall_mm_s + change.stop_mm_s,
            };
            if let Some(before) = &before {
                let bend_mm = stopping.turn * bend_s * here.fall_mm_s;
                if stopping.largest_between(before, &here) + bend_mm > limit_mm {
                    return verdict;
                }
            } else {
                stopping.pass(here.mean_mm);
            }
            let fall_mm_s = here.fall_mm_s - change.stop_mm_s;
            let bend_mm = going_on.corners.turn * bend_s * fall_mm_s;
            verdict.may_go_on &= going_on.miss_mm(&here, change.ended_s) + bend_mm <= limit_mm;
            before = Some(here);
        }
        verdict.may_stop = true;
        verdict
    }

    /// Goes on with a line that may stop, by [`Chain::judge`] or otherwise.
    pub fn push(&mut self, robot: &Robot, joint: &Joint, step: &Step, walk: &Walk) {
        let spread_mm = step.length_mm / walk.duration_s * robot.accelerating.spread_s();
        self.walk(robot, joint, step, walk);
        self.outline.push(
            joint,
            step.tangent,
            step.length_mm,
            walk.time_s(),
            spread_mm,
        );
    }

    fn walk(&mut self, robot: &Robot, joint: &Joint, step: &Step, walk: &Walk) {
        let end_s = walk.time_s();
        self.make_samples(robot, end_s);
        let bend_s = interval_s(robot) / 4.0;
        let mut changes = Changes::new(robot, self.feed_mm_s, step, walk);
        for i in 0..self.samples.len() {
            let change = changes.of(&self.samples, i);
            let Some(sample) = self.samples.get_mut(i) else {
                continue;
            };
            if joint.turn.is_some() {
                sample.spread_mm += joint.last_turn * sample.last_mm;
                sample.last_mm = own_mm(sample, bend_s);
            }
            sample.time_s -= end_s;
            sample.mean_mm += change.mean_mm - step.length_mm;
            sample.rise_mm_s += change.rise_mm_s;
            sample.fall_mm_s += change.fall_mm_s;
        }
        self.make_knot(joint, step);
        let length_s = robot.accelerating.length_s();
        for knot in &mut self.knots {
            knot.time_s -= end_s;
            knot.along_mm -= step.length_mm;
        }
        // the outline behind a knot matters until the next one is passed
        let next = self.knots.iter().skip(1);
        let passed = next.take_while(|next| next.time_s + length_s <= 0.0);
        let passed = passed.count();
        self.knots.rotate_left(passed);
        self.knots.truncate(self.knots.len() - passed);
        self.feed_mm_s = step.length_mm / walk.duration_s;
    }

    /// Closes the last knot and opens one at the path's end, or changes the last one.
    fn make_knot(&mut self, joint: &Joint, step: &Step) {
        if let Some(last) = self.knots.last_mut() {
            last.turn = joint.last_turn;
            if joint.turn.is_none() {
                last.loose_mm = joint.loose_mm;
                last.tolerance_mm = last.tolerance_mm.min(step.tolerance_mm);
            }
        }
        if let Some(turn) = joint.turn {
            // there is room: it was asked for
            let _ = self.knots.push(Knot {
                time_s: 0.0,
                along_mm: 0.0,
                turn,
                tolerance_mm: step.tolerance_mm,
                loose_mm: 0.0,
            });
        }
    }

    /// What the smallest tolerance leaves to `G`.
    fn limit_mm(&self, joint: &Joint, step: &Step) -> f32 {
        let mut tolerance_mm = step.tolerance_mm;
        let mut loose_mm = joint.loose_mm;
        for knot in &self.knots {
            tolerance_mm = tolerance_mm.min(knot.tolerance_mm);
            loose_mm = loose_mm.max(knot.loose_mm);
        }
        tolerance_mm - 2.0 * loose_mm
    }

    /// Samples from one interval before the path's new end to the prefilter's length behind it.
    fn make_samples(&mut self, robot: &Robot, end_s: f32) {
        let interval_s = interval_s(robot);
        let until_s = end_s + robot.accelerating.length_s();
        let oldest = self
            .samples
            .iter()
            .rposition(|sample| sample.time_s <= end_s);
        let passed = oldest.unwrap_or(0);
        let last_s = self.samples.last().map_or(f32::MIN, |sample| sample.time_s);
        if last_s <= end_s {
            self.samples.clear();
        } else {
            self.samples.rotate_left(passed);
            self.samples.truncate(self.samples.len() - passed);
        }
        let first = Sample {
            time_s: end_s,
            ..Sample::default()
        };
        let mut next = match self.samples.last() {
            Some(last) => Sample {
                time_s: last.time_s + interval_s,
                ..Sample::default()
            },
            None => first,
        };
        while next.time_s < until_s + interval_s && self.samples.push(next).is_ok() {
            next.time_s += interval_s;
        }
    }
}

/// `h`.
fn interval_s(robot: &Robot) -> f32 {
    robot.accelerating.length_s() / f32::from(INTERVALS)
}

/// `a_j` of a corner at the path's end, with what it may bend between samples.
fn own_mm(sample: &Sample, bend_s: f32) -> f32 {
    (-sample.mean_mm).max(0.0) + bend_s * sample.rise_mm_s
}

/// A sample with a further line.
struct Seen {
    mean_mm: f32,
    spread_mm: f32,
    fall_mm_s: f32,
}

/// The corners ahead of a place that moves along the path.
#[derive(Clone)]
struct Ahead<'r> {
    /// Those that are still ahead, the last knot left out.
    knots: &'r [Knot],
    /// The last knot and the corner at the path's end: where, and their turns.
    newest: [(f32, f32); 2],
    /// How many of these have been passed.
    passed: usize,
    /// `Σ |Δu|`.
    turn: f32,
    /// `Σ |Δu| s`.
    moment_mm: f32,
}

impl<'r> Ahead<'r> {
    fn new(chain: &'r Chain, joint: &Joint) -> Self {
        let (last, knots) = match chain.knots.split_last() {
            Some((last, knots)) => (last.along_mm, knots),
            None => (0.0, [].as_slice()),
        };
        let newest = [(last, joint.last_turn), (0.0, joint.turn.unwrap_or(0.0))];
        let mut ahead = Self {
            knots,
            newest,
            passed: 0,
            turn: 0.0,
            moment_mm: 0.0,
        };
        for knot in knots {
            ahead.add(knot.along_mm, knot.turn);
        }
        for (along_mm, turn) in newest {
            ahead.add(along_mm, turn);
        }
        ahead
    }

    fn add(&mut self, along_mm: f32, turn: f32) {
        self.turn += turn;
        self.moment_mm += turn * along_mm;
    }

    /// `B` at a place before the next corner, and not before the last one passed.
    fn ahead_mm(&self, at_mm: f32) -> f32 {
        self.moment_mm - self.turn * at_mm
    }

    /// Where the next corner is that a place has come to, and passes it.
    fn next(&mut self, at_mm: f32) -> Option<f32> {
        let (along_mm, turn) = match self.knots.split_first() {
            Some((knot, rest)) if knot.along_mm <= at_mm => {
                self.knots = rest;
                (knot.along_mm, knot.turn)
            }
            Some(_) => return None,
            None => {
                let newest = *self.newest.get(self.passed)?;
                if newest.0 > at_mm {
                    return None;
                }
                self.passed += 1;
                newest
            }
        };
        self.add(along_mm, -turn);
        Some(along_mm)
    }

    /// Passes the corners up to a place.
    fn pass(&mut self, at_mm: f32) {
        while self.next(at_mm).is_some() {}
    }

    /// The largest `G` at the corners between two samples and at the second one.
    fn largest_between(&mut self, from: &Seen, to: &Seen) -> f32 {
        let length_mm = (to.mean_mm - from.mean_mm).max(f32::MIN_POSITIVE);
        let mut largest_mm = 0.0_f32;
        while let Some(along_mm) = self.next(to.mean_mm) {
            let share = ((along_mm - from.mean_mm) / length_mm).clamp(0.0, 1.0);
            let spread_mm = from.spread_mm + share * (to.spread_mm - from.spread_mm);
            largest_mm = largest_mm.max(spread_mm - self.ahead_mm(along_mm));
        }
        largest_mm.max(to.spread_mm - self.ahead_mm(to.mean_mm))
    }
}

/// The path behind a further line, if it goes on to turn as it did.
struct GoingOn<'r> {
    corners: Ahead<'r>,
    feed_mm_s: f32,
    /// `F κ h`, the turn in an interval.
    interval_turn: f32,
    /// Half of the turn at the line's end: the other half is that of what follows.
    half_turn: f32,
    /// `Σ I` so far.
    reach_s: f32,
    /// Where that line ends.
    end_mm: f32,
    before: Option<Seen>,
}

impl GoingOn<'_> {
    /// `G` at a sample, the next one in time, and since the one before:
    ///
    /// ```text
    /// s̄(t) += F I(t − t_end),     G += F κ [L/2 I(t − t_end) + F ∫ I(t − t_end) dt]     up to its end
    /// ```
    fn miss_mm(&mut self, sample: &Seen, ended_s: f32) -> f32 {
        self.reach_s += ended_s;
        let mean_mm = sample.mean_mm + self.feed_mm_s * ended_s;
        let turning_s = self.half_turn * ended_s + self.interval_turn * self.reach_s;
        let here = Seen {
            mean_mm,
            spread_mm: sample.spread_mm + self.feed_mm_s * turning_s,
            fall_mm_s: 0.0,
        };
        let miss_mm = match &self.before {
            Some(before) if mean_mm <= self.end_mm => self.corners.largest_between(before, &here),
            Some(_) => 0.0,
            None => {
                self.corners.pass(mean_mm);
                0.0
            }
        };
        self.before = Some(here);
        miss_mm
    }
}

/// What a step does to the samples, from the first one to the last.
struct Changes<'a> {
    response: &'a Response,
    walk: &'a Walk,
    interval_s: f32,
    arriving_mm_s: f32,
    feed_mm_s: f32,
    /// The responses at the sample before and at the one looked at.
    known: [Option<Responses>; 2],
}

/// `(S, I)` to the end of the segment before, to the start of a segment, and to its end.
#[derive(Clone, Copy, Default)]
struct Responses {
    arrival: f32,
    start: (f32, f32),
    end: (f32, f32),
}

impl<'a> Changes<'a> {
    fn new(robot: &'a Robot, arriving_mm_s: f32, step: &Step, walk: &'a Walk) -> Self {
        Self {
            response: &robot.accelerating,
            walk,
            interval_s: interval_s(robot),
            arriving_mm_s,
            feed_mm_s: step.length_mm / walk.duration_s,
            known: [None; 2],
        }
    }

    fn at(&self, time_s: f32) -> Responses {
        let start = self.response.at(time_s - self.walk.dwell_s);
        Responses {
            arrival: if self.walk.dwell_s > 0.0 {
                self.response.at(time_s).0
            } else {
                start.0
            },
            start,
            end: self.response.at(time_s - self.walk.time_s()),
        }
    }

    /// What it does to the sample `i`.
    fn of(&mut self, samples: &[Sample], i: usize) -> Change {
        let time_s = |place: Option<usize>| Some(samples.get(place?)?.time_s);
        let now_s = time_s(Some(i)).unwrap_or_default();
        let after_s = time_s(i.checked_add(1)).unwrap_or(now_s + self.interval_s);
        let [before, now] = self.known;
        let before = before.unwrap_or_else(|| self.at(now_s - self.interval_s));
        let now = now.unwrap_or_else(|| self.at(now_s));
        let after = self.at(after_s);
        self.known = [Some(now), Some(after)];
        let (falling_mm_s, rising_mm_s) = if self.walk.dwell_s > 0.0 {
            (self.arriving_mm_s, self.feed_mm_s)
        } else {
            let more_mm_s = self.feed_mm_s - self.arriving_mm_s;
            ((-more_mm_s).max(0.0), more_mm_s.max(0.0))
        };
        Change {
            mean_mm: self.feed_mm_s * (now.start.1 - now.end.1),
            rise_mm_s: rising_mm_s * (after.start.0 - before.start.0),
            fall_mm_s: falling_mm_s * (now.arrival - before.arrival),
            stop_mm_s: self.feed_mm_s * (now.end.0 - before.end.0),
            ended_s: now.end.1,
        }
    }
}
