//! The schedule: when each segment of the raw path begins.
//!
//! A segment starts `t_d` after the one before has begun to decelerate; the corner solver
//! gives `t_d` from the corner's tolerance. Corners that follow each other closely share the
//! tolerance (see [`Schedule::plan`]), so that it holds on segments of any length.

use heapless::Deque;

use crate::config::Robot;
use crate::corner::{self, Corner, CornerRule, Side, reach_s};
use crate::hop::Hop;
use crate::kinematics::Elbow;
use crate::limits::{Bound, Choice, Course, Limited, Run};
use crate::math::sqrt_f32;
use crate::path::PathSegment;
use crate::pose::{JointPosition, Pose};
use crate::prefilter::{Kernel, Response};
use crate::queue::{Action, RawItem, SegmentProducer};
use crate::rate::Rate;
use crate::raw::{LONGEST_S, ONE_TICK, Pace, RawSegment, TickTime, tick_time};
use crate::units::TICK_S;

/// Corners that can still be rounding when another one begins. With more, the next segment
/// waits for the oldest: slower, never wrong.
const BLENDING_CORNERS: usize = 64;

/// What the fixed-point trace can miss a point by, in mm: ten times its resolution.
const RESOLUTION_MM: f32 = 2e-5;

/// A segment of so long lasts a tick at the highest rate.
const SHORTEST_HURRIED: TickTime = 2 * ONE_TICK;

/// One control tick in seconds.
const TICK: f32 = TICK_S as f32;

/// A corner that is being rounded until the deceleration of its first segment ends.
#[derive(Clone, Copy, Debug)]
struct Blend {
    /// Counted from the end of the raw path planned so far.
    ends: TickTime,
    /// `|u₂ − u₁|`, the change of the tangent; infinite beside an arc.
    turn: f32,
    /// How far the command strays along either tangent, for each mm/s of feedrate.
    reach_s: f32,
    /// The faster of its two segments.
    feed_mm_s: f32,
    /// Infinite where the overlap is given instead.
    tolerance_mm: f32,
}

/// How long a segment takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timing {
    /// As programmed, within the robot's limits.
    pub duration_s: f64,
    /// At the robot's limits: no override makes it shorter.
    pub shortest_s: f64,
    /// Which override it follows.
    pub pace: Pace,
    /// What it takes at the robot's limits of motion while it is walked alone: see
    /// [`crate::limits::Limits::least_s`].
    pub least_s: f32,
    /// The limit that sets it.
    pub bound: Option<Bound>,
}

impl Timing {
    fn keep(&mut self, choice: &Choice) {
        let least_s = f64::from(choice.least_s);
        self.duration_s = self.duration_s.max(least_s);
        self.shortest_s = self.shortest_s.max(least_s);
    }
}

/// Times segments and hands them to the tick.
pub struct Schedule<'q> {
    queue: SegmentProducer<'q>,
    /// The segment that the next one makes a corner with; none where the path must stop.
    previous: Option<Side>,
    /// The corners that are still being rounded, oldest first.
    blends: Deque<Blend, BLENDING_CORNERS>,
    /// What the limits have to know of the path so far.
    run: Run,
    /// What limits the last segment planned.
    limited: Option<Limited>,
}

impl<'q> Schedule<'q> {
    /// An empty schedule.
    pub fn new(queue: SegmentProducer<'q>) -> Self {
        Self {
            queue,
            previous: None,
            blends: Deque::new(),
            run: Run::default(),
            limited: None,
        }
    }

    /// Segments and actions that the look-ahead has room for.
    pub fn free_places(&self) -> usize {
        self.queue.free_places()
    }

    /// What lowers the feed of the last segment planned, if a limit does.
    pub fn limited(&self) -> Option<Limited> {
        self.limited
    }

    /// Forgets what came before: the next segment begins from rest.
    pub fn reset(&mut self) {
        self.previous = None;
        self.blends.clear();
        self.run = Run::default();
    }

    /// Plans a segment that follows the last one, with a rule for the corner between the two.
    ///
    /// The tolerance holds for segments of any length. A corner that is rounded alone misses
    /// by its `e_c`. Where several are being rounded at once, the command is a weighted mean
    /// of raw points on a polyline, and against the tangent at the mean each corner bends it
    /// by at most its change of tangent times the mean distance that the raw point is past
    /// the corner, or has yet to go, whichever is less:
    ///
    /// ```text
    /// |P − path| ≤ F Σ |u₂ − u₁|_j r_j,     r_j = I(x) = I₋(t_c − x) for the corner's t_c
    /// ```
    ///
    /// with `F` the fastest of the segments. A segment begins only when that sum, its own
    /// corner included, is within the smallest tolerance of the corners being rounded, or
    /// when they are done. Corners at arcs are always rounded alone. Corners whose overlap is
    /// given promise nothing: they are rounded as given, any number of them at once, but never
    /// together with one that has a tolerance.
    ///
    /// On the way of the segment the prefilter may change to another one; what follows has to be
    /// planned with a robot that has it.
    ///
    /// `false` if the look-ahead is full.
    pub fn plan(
        &mut self,
        robot: &Robot,
        path: &PathSegment,
        timing: &Timing,
        rule: CornerRule,
        line: u32,
        on_the_way: Option<&Kernel>,
    ) -> bool {
        let limits = &robot.limits;
        let limited = limits.is_set().then(|| {
            let course = Course::new(path);
            let asked_s = timing.duration_s as f32;
            let choice = self.run.choose(limits, &course, asked_s, timing.least_s);
            (course, choice)
        });
        let (mut rule, mut timing) = (rule, *timing);
        let mut stop = 0;
        if let Some((course, choice)) = &limited {
            let innermost_mm = self.run.innermost_mm(course);
            rule = limits.rule(rule, innermost_mm);
            let asked_s = timing.duration_s;
            timing.keep(choice);
            stop = tick_time(f64::from(choice.dwell_s));
            let is_lowered = timing.duration_s > asked_s;
            self.limited = timing.bound.filter(|_| is_lowered).map(|bound| Limited {
                bound,
                asked_s,
                takes_s: timing.duration_s,
                length_mm: path.length_mm(),
            });
        }
        let length_mm = path.length_mm() as f32;
        let duration_s = timing.duration_s.clamp(TICK_S, LONGEST_S);
        let (first_tangent, last_tangent, heading_rate_per_mm) = path.tangents();
        let side = |tangent| Side {
            feed_mm_s: length_mm / duration_s as f32,
            tangent,
            heading_rate_per_mm,
            length_mm,
        };
        if self.free_places() == 0 {
            return false;
        }
        let overlap = match self.previous {
            None => 0,
            Some(arriving) => {
                let leaving = side(first_tangent);
                let overlap = self.corner(robot, &arriving, &leaving, rule);
                overlap.min(robot.kernel.length() - stop)
            }
        };
        self.previous = Some(side(last_tangent));
        let segment = RawSegment {
            overlap,
            pace: timing.pace,
            line,
            ..RawSegment::new(path, duration_s)
        };
        let passed = robot.kernel.length() - overlap + segment.duration;
        for blend in &mut self.blends {
            blend.ends -= passed;
        }
        // A segment may be hurried if the corner before it is done at its end.
        let is_done = passed >= robot.kernel.settling_time();
        let top_rate = if is_done && segment.duration >= SHORTEST_HURRIED {
            Rate::at_least_one(duration_s / timing.shortest_s)
        } else {
            Rate::ONE
        };
        if let Some((course, choice)) = &limited {
            let seconds = |time: TickTime| time as f32 / ONE_TICK as f32 * TICK;
            let dwell_s = seconds(robot.kernel.length() - overlap);
            let shortest_s = seconds(top_rate.real(segment.duration.min(ONE_TICK << 13)));
            self.run.take(limits, course, choice, dwell_s, shortest_s);
        }
        let segment = RawSegment {
            top_rate,
            ..segment
        };
        match on_the_way {
            None => self.queue.push(RawItem::Segment(segment)),
            Some(kernel) => self.queue.push_changing(segment, kernel.clone()),
        }
    }

    /// Whether the next segment begins from an exact stop, with that tolerance at its start.
    pub fn begins_from_rest(&self, rule: CornerRule) -> bool {
        let turned = self.previous.is_some_and(|side| side.feed_mm_s == 0.0);
        self.previous.is_none() || rule.stops() || turned
    }

    /// Whether the last segment was an arc, which is still in flight when the next one begins.
    pub fn follows_arc(&self) -> bool {
        let is_arc = |side: Side| side.heading_rate_per_mm != 0.0;
        self.previous.is_some_and(is_arc)
    }

    /// Places for kernels that are free.
    pub fn free_kernels(&self) -> usize {
        self.queue.free_kernels()
    }

    /// Plans a pick-and-place move after everything has stopped; what follows begins when it has.
    ///
    /// `false` if the look-ahead is full.
    pub fn hop(&mut self, hop: &Hop, line: u32) -> bool {
        let segment = RawSegment {
            line,
            ..RawSegment::of_hop(hop)
        };
        let queued = self.queue.push_hop(hop.raw, segment);
        if queued {
            self.reset();
        }
        queued
    }

    /// Plans a stand-still of `duration_s` after everything has stopped.
    ///
    /// `false` if the look-ahead is full.
    pub fn dwell(&mut self, pose: Pose, duration_s: f64) -> bool {
        let duration_s = duration_s.clamp(TICK_S, LONGEST_S);
        self.push_stopped(RawItem::Segment(RawSegment::stand_still(pose, duration_s)))
    }

    /// Switches the digital outputs after everything has stopped: bit 0 the gripper, bit 1 the
    /// blow-off.
    ///
    /// `false` if the look-ahead is full.
    pub fn switch(&mut self, outputs: u8) -> bool {
        self.push_stopped(RawItem::Action(Action::Outputs(outputs)))
    }

    /// Pauses after everything has stopped, until the motion is resumed.
    ///
    /// `false` if the look-ahead is full.
    pub fn pause(&mut self) -> bool {
        self.push_stopped(RawItem::Action(Action::Pause))
    }

    /// Changes the prefilter after everything has stopped; what is planned from now on has to
    /// be planned with the robot that has it.
    ///
    /// `false` if the look-ahead is full.
    pub fn change_prefilter(&mut self, kernel: &Kernel) -> bool {
        let queued = self.queue.push_kernel(kernel.clone());
        if queued {
            self.reset();
        }
        queued
    }

    /// Moves the joints after everything has stopped. What follows is joint moves too, until
    /// [`Schedule::return_to_tool`].
    ///
    /// `false` if the look-ahead is full.
    pub fn move_joints(&mut self, from: JointPosition, to: JointPosition, duration_s: f64) -> bool {
        let duration_s = duration_s.clamp(TICK_S, LONGEST_S);
        let segment = RawSegment::of_joints(from, to, duration_s);
        self.push_stopped(RawItem::Action(Action::ToJoints))
            && self.push_stopped(RawItem::Segment(segment))
    }

    /// Goes on with moves of the tool, which then stands at a pose, if that is known, with the
    /// elbow on a side.
    ///
    /// `false` if the look-ahead is full.
    pub fn return_to_tool(&mut self, pose: Option<Pose>, elbow: Elbow) -> bool {
        self.push_stopped(RawItem::Action(Action::ToTool(pose, elbow)))
    }

    /// Queues what comes after an exact stop; the path goes on from rest.
    fn push_stopped(&mut self, item: RawItem) -> bool {
        let queued = self.queue.push(item);
        if queued {
            self.reset();
        }
        queued
    }

    /// How long a segment begins before the one before has come to a stop; 0 is an exact stop.
    fn corner(
        &mut self,
        robot: &Robot,
        arriving: &Side,
        leaving: &Side,
        rule: CornerRule,
    ) -> TickTime {
        let settled = robot.kernel.length();
        let (cornering_s, tolerance_mm) = match rule {
            CornerRule::ToleranceMm(tolerance_mm) => {
                let turns_only = arriving.feed_mm_s == 0.0 || leaving.feed_mm_s == 0.0;
                let usable_mm = if turns_only { 0.0 } else { tolerance_mm };
                let corner = solve_sampled(robot, arriving, leaving, usable_mm);
                (corner.cornering_s, usable_mm)
            }
            CornerRule::OverlapPercent(percent) => {
                let share = sqrt_f32((percent / 100.0).clamp(0.0, 1.0));
                (robot.decelerating.length_s() * share, f32::INFINITY)
            }
        };
        let mut dwell = settled - tick_time(f64::from(cornering_s)).min(settled);
        let turn = turn(arriving, leaving);
        let own = Blend {
            // an arc keeps its filter until that has settled to the last bit
            ends: if turn.is_finite() {
                settled
            } else {
                robot.kernel.settling_time()
            },
            turn,
            reach_s: reach_s(&robot.decelerating, &robot.accelerating, cornering_s),
            feed_mm_s: arriving.feed_mm_s.max(leaving.feed_mm_s),
            tolerance_mm,
        };
        while let Some(oldest) = self.blends.front().copied() {
            if oldest.ends > dwell && self.may_join(&own) && !self.blends.is_full() {
                break;
            }
            dwell = dwell.max(oldest.ends);
            self.blends.pop_front();
        }
        if dwell < settled {
            // there is room: a full deque has given up its oldest
            let _ = self.blends.push_back(own);
        }
        (settled - dwell).max(0)
    }

    /// Whether a further corner may be rounded together with those that are: between lines only,
    /// and where all overlaps are given, or all together keep the smallest tolerance.
    fn may_join(&self, own: &Blend) -> bool {
        let all = || self.blends.iter().chain(core::iter::once(own));
        if all().any(|blend| blend.turn.is_infinite()) {
            return false;
        }
        let given = |blend: &Blend| blend.tolerance_mm.is_infinite();
        if all().any(given) {
            return all().all(given);
        }
        let mut bend_s = 0.0;
        let mut feed_mm_s = 0.0_f32;
        let mut limit_mm = f32::INFINITY;
        for blend in all() {
            bend_s += blend.turn * blend.reach_s;
            feed_mm_s = feed_mm_s.max(blend.feed_mm_s);
            limit_mm = limit_mm.min(blend.tolerance_mm);
        }
        feed_mm_s * bend_s <= limit_mm
    }
}

/// `|u₂ − u₁|`, the change of the tangent at a corner between lines; infinite at an arc.
fn turn(arriving: &Side, leaving: &Side) -> f32 {
    if arriving.heading_rate_per_mm != 0.0 || leaving.heading_rate_per_mm != 0.0 {
        return f32::INFINITY;
    }
    let pairs = arriving.tangent.iter().zip(leaving.tangent);
    let squared: f32 = pairs.map(|(u1, u2)| (u2 - u1) * (u2 - u1)).sum();
    sqrt_f32(squared)
}

/// Solves a corner so that the trace, which goes straight from one tick to the next, keeps
/// the tolerance too.
///
/// Where the velocity turns by `Δv` within a tick, straight lines between ticks pass the
/// turning point by up to `Δv T_s / 4`, and raw feedrates that change between ticks are seen
/// at ticks only. With a box in the prefilter that makes about a micrometre, and a margin of
/// twice the box's change within a tick is kept. A pure shaper lets the velocity jump: there the margin
/// is taken only if the closest approach is within a tick of a jump.
fn solve_sampled(robot: &Robot, arriving: &Side, leaving: &Side, tolerance_mm: f32) -> Corner {
    let solve = |margin_mm: f32| {
        corner::solve(
            arriving,
            leaving,
            &robot.decelerating,
            &robot.accelerating,
            tolerance_mm - margin_mm - RESOLUTION_MM,
        )
    };
    let margin_mm = |change_mm_s: f32| change_mm_s * TICK / 4.0;
    if let Some(box_s) = robot.prefilter.longest_box_s() {
        let both_mm_s = arriving.feed_mm_s + leaving.feed_mm_s;
        let share = (2.0 * TICK / box_s as f32).min(1.0);
        return solve(margin_mm(both_mm_s * share));
    }
    let corner = solve(0.0);
    let since_start = corner.approach_s - corner.dwell_s;
    let until_end = corner.deceleration_s - corner.approach_s;
    let change = |response: &Response, t: f32| response.at(t + TICK).0 - response.at(t - TICK).0;
    let change_mm_s = arriving.feed_mm_s * change(&robot.decelerating, until_end)
        + leaving.feed_mm_s * change(&robot.accelerating, since_start);
    if change_mm_s > 0.0 {
        solve(margin_mm(change_mm_s))
    } else {
        corner
    }
}
