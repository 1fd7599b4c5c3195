//! The schedule: when each segment of the raw path begins.
//!
//! A segment starts `t_d` after the one before has begun to decelerate; the corner solver
//! gives `t_d` from the corner's tolerance. Where several corners lie within the prefilter's
//! length the path goes slower or stands longer, so that the tolerance holds on segments of any
//! length: see [`crate::dense`].

use crate::config::Robot;
use crate::corner::{self, Corner, CornerRule, Side};
use crate::dense::{Chain, Step, Walk};
use crate::hop::Hop;
use crate::kinematics::Elbow;
use crate::limits::{Bound, Choice, Course, Limited, Run};
use crate::math::sqrt_f32;
use crate::outline::Joint;
use crate::passage::{self, Asked};
use crate::path::PathSegment;
use crate::pose::{JointPosition, Pose};
use crate::prefilter::{Kernel, Response};
use crate::queue::{Action, RawItem, SegmentProducer};
use crate::rate::Rate;
use crate::raw::{LONGEST_S, ONE_TICK, Pace, RawSegment, TickTime, tick_time};
use crate::units::TICK_S;

/// What the fixed-point trace can miss a point by, in mm: twenty times its resolution.
const RESOLUTION_MM: f32 = 4e-5;

/// A segment of so long lasts a tick at the highest rate.
const SHORTEST_HURRIED: TickTime = 2 * ONE_TICK;

/// How close to a jump of the velocity, in ticks, the trace may miss the closest approach.
const JUMP_TICKS: f32 = 1.0;

/// One control tick in seconds.
const TICK: f32 = TICK_S as f32;

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
    /// How long the corners so far are still being rounded, from the end of the raw path.
    busy: TickTime,
    /// What the last of them is.
    last: Kind,
    /// The lines that lead to the end of the raw path.
    chain: Chain,
    /// What the limits have to know of the path so far.
    run: Run,
    /// What limits the last segment planned.
    limited: Option<Limited>,
}

/// Corners of which only those of the same kind are rounded at once, and those at arcs never.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// Between lines, within a tolerance.
    Tolerance,
    /// Between lines, with a given overlap: nothing is promised.
    Overlap,
    /// At an arc.
    Arc,
}

/// How a corner is passed.
#[derive(Clone, Copy, Debug)]
struct Passage {
    /// How long the raw path stands there; an exact stop if no less than the prefilter's length.
    dwell: TickTime,
    /// How long the segment behind it lasts, if longer than asked for.
    longer_s: Option<f32>,
    /// How it joins the lines before, with what tolerance; nothing where it need not be known.
    joint: Option<(Joint, Step)>,
}

impl<'q> Schedule<'q> {
    /// An empty schedule.
    pub fn new(queue: SegmentProducer<'q>) -> Self {
        Self {
            queue,
            previous: None,
            busy: 0,
            last: Kind::Tolerance,
            chain: Chain::default(),
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
        self.busy = 0;
        self.last = Kind::Tolerance;
        self.chain = Chain::default();
        self.run = Run::default();
    }

    /// Plans a segment that follows the last one, with a rule for the corner between the two.
    ///
    /// The tolerance holds for segments of any length. A corner that is rounded alone misses
    /// by its `e_c`. Where several are being rounded at once the command is nowhere further from
    /// the path than the smallest of their tolerances, as [`crate::dense`] says; the segment
    /// lasts longer than asked for, or the path stands longer at the corner, whichever takes
    /// less time. Corners at arcs are always rounded alone. Corners whose overlap is given
    /// promise nothing: they are rounded as given, any number of them at once, but never
    /// together with one that has a tolerance.
    ///
    /// On the way of the segment the prefilter may change to another one; what follows has to be
    /// planned with a robot that has it.
    ///
    /// `false` if the look-ahead is full.
    ///
    /// Not inlined: its frame is on the stack for no more than this.
    #[inline(never)]
    pub fn plan(
        &mut self,
        robot: &Robot,
        path: &PathSegment,
        timing: &Timing,
        rule: CornerRule,
        line: u32,
        on_the_way: Option<&Kernel>,
    ) -> bool {
        if self.free_places() == 0 {
            return false;
        }
        let limits = &robot.limits;
        let limited = limits.is_set().then(|| {
            let course = Course::new(path, limits.kind());
            let asked_s = timing.duration_s as f32;
            let choice = self.run.choose(limits, &course, asked_s, timing.least_s);
            (course, choice)
        });
        let (mut rule, mut timing) = (rule, *timing);
        let mut stop = 0;
        if let Some((course, choice)) = &limited {
            rule = limits.rule(rule, self.run.spare_mm(limits.spare_mm(course)));
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
        let asked_s = timing.duration_s.clamp(TICK_S, LONGEST_S);
        let (first_tangent, last_tangent, heading_rate_per_mm) = path.tangents();
        let side = |tangent, duration_s: f64| Side {
            feed_mm_s: length_mm / duration_s as f32,
            tangent,
            heading_rate_per_mm,
            length_mm,
        };
        let settled = robot.kernel.length();
        let passage = match self.previous {
            None => Passage::of(settled),
            Some(arriving) => {
                let leaving = side(first_tangent, asked_s);
                self.corner(robot, &arriving, &leaving, rule, stop)
            }
        };
        let duration_s = passage.longer_s.map_or(asked_s, |longer_s| {
            f64::from(longer_s).clamp(asked_s, LONGEST_S)
        });
        self.note(robot, &passage, duration_s as f32);
        self.previous = Some(side(last_tangent, duration_s));
        // a stop that limits ask for may be longer than the filter
        let overlap = (settled - passage.dwell).max(0).min(settled - stop);
        let segment = RawSegment {
            overlap,
            pace: timing.pace,
            line,
            ..RawSegment::new(path, duration_s)
        };
        let passed = settled - overlap + segment.duration;
        self.busy -= passed;
        if on_the_way.is_some() {
            // the filter of what comes has seen this line only
            self.chain = Chain::default();
        }
        // A segment may be hurried if the corner before it is done at its end.
        let is_done = passed >= robot.kernel.settling_time();
        let top_rate = if is_done && segment.duration >= SHORTEST_HURRIED {
            Rate::at_least_one(duration_s / timing.shortest_s)
        } else {
            Rate::ONE
        };
        if let Some((course, choice)) = &limited {
            let dwell_s = seconds(settled - overlap);
            let shortest_s = if on_the_way.is_some() {
                // the filter of what comes has seen this line only
                f32::INFINITY
            } else {
                seconds(top_rate.real(segment.duration.min(ONE_TICK << 13)))
            };
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

    /// How a corner is passed, where the raw path stands for `stop` at least.
    fn corner(
        &mut self,
        robot: &Robot,
        arriving: &Side,
        leaving: &Side,
        rule: CornerRule,
        stop: TickTime,
    ) -> Passage {
        let settled = robot.kernel.length();
        let (kind, alone, usable_mm) = alone(robot, arriving, leaving, rule);
        let (busy, last) = (self.busy, self.last);
        self.last = kind;
        // an arc keeps its filter until that has settled to the last bit
        self.busy = if kind == Kind::Arc {
            robot.kernel.settling_time()
        } else {
            settled
        };
        let may_join = kind == last && kind != Kind::Arc;
        let least = stop.max(if may_join { 0 } else { busy });
        let dwell = alone.max(least);
        if kind != Kind::Tolerance || dwell >= settled {
            return Passage::of(dwell);
        }
        let duration_s = leaving.length_mm / leaving.feed_mm_s;
        if self.chain.is_empty() {
            let arriving_s = arriving.length_mm / arriving.feed_mm_s;
            self.chain
                .begin(robot, arriving.tangent, arriving.length_mm, arriving_s);
        }
        let step = dense_step(robot, arriving, leaving, usable_mm);
        let steady_s = passage::steady_s(&self.chain, robot, &step, turn(arriving, leaving));
        // a stop, and then the feedrate asked for, takes no longer
        let slowest_s = duration_s + robot.accelerating.length_s();
        let steady_s = steady_s.min(slowest_s).max(duration_s);
        let joint = self.chain.joint(robot, &step, steady_s);
        let is_alone = dwell >= busy && dwell + tick_time(f64::from(duration_s)) >= settled;
        let asked = Asked {
            least_dwell_s: seconds(least),
            dwell_s: seconds(dwell),
            duration_s,
            steady_s,
        };
        let walk = if is_alone {
            Walk {
                dwell_s: asked.dwell_s,
                duration_s,
            }
        } else {
            passage::choose(&self.chain, robot, &joint, &step, &asked)
        };
        Passage {
            dwell: if walk.dwell_s == asked.dwell_s {
                dwell
            } else if walk.dwell_s == asked.least_dwell_s {
                least
            } else {
                tick_time(f64::from(walk.dwell_s))
            },
            longer_s: (walk.duration_s > duration_s).then_some(walk.duration_s),
            joint: Some((joint, step)),
        }
    }

    /// Notes a segment with which the path goes on. A run that ends here begins anew at the
    /// next corner.
    fn note(&mut self, robot: &Robot, passage: &Passage, duration_s: f32) {
        let is_stop = passage.dwell >= robot.kernel.length();
        if is_stop {
            self.busy = 0;
        }
        match &passage.joint {
            Some((joint, step)) if !is_stop => {
                let walk = Walk {
                    dwell_s: seconds(passage.dwell),
                    duration_s,
                };
                self.chain.push(robot, joint, step, &walk);
            }
            _ => self.chain.end(),
        }
    }
}

impl Passage {
    /// After standing for so long, as asked for.
    fn of(dwell: TickTime) -> Self {
        Self {
            dwell,
            longer_s: None,
            joint: None,
        }
    }
}

/// A time in seconds.
fn seconds(time: TickTime) -> f32 {
    time as f32 * (TICK / ONE_TICK as f32)
}

/// The kind of a corner, how long the raw path stands there if it is rounded alone, and its
/// tolerance.
fn alone(
    robot: &Robot,
    arriving: &Side,
    leaving: &Side,
    rule: CornerRule,
) -> (Kind, TickTime, f32) {
    let at_arc = arriving.heading_rate_per_mm != 0.0 || leaving.heading_rate_per_mm != 0.0;
    let kind = |between_lines| if at_arc { Kind::Arc } else { between_lines };
    match rule {
        CornerRule::ToleranceMm(tolerance_mm) => {
            let turns_only = arriving.feed_mm_s == 0.0 || leaving.feed_mm_s == 0.0;
            let usable_mm = if turns_only { 0.0 } else { tolerance_mm };
            let dwell = dwell_alone(robot, arriving, leaving, usable_mm, at_arc);
            (kind(Kind::Tolerance), dwell, usable_mm)
        }
        CornerRule::OverlapPercent(percent) => {
            let share = sqrt_f32((percent / 100.0).clamp(0.0, 1.0));
            let cornering_s = robot.decelerating.length_s() * share;
            let settled = robot.kernel.length();
            let dwell = settled - tick_time(f64::from(cornering_s)).min(settled);
            (kind(Kind::Overlap), dwell, f32::INFINITY)
        }
    }
}

/// A line that follows another one, with what sampling in ticks leaves of the tolerance.
///
/// An input between two ticks, and an impulse split over two, spread the prefilter by up to
/// half a tick: a part of its length. Where the velocity jumps, straight lines between ticks
/// miss a corner by `Δv T_s / 4`.
fn dense_step(robot: &Robot, arriving: &Side, leaving: &Side, tolerance_mm: f32) -> Step {
    let spread = 2.0 * TICK / robot.accelerating.length_s().max(2.0 * TICK);
    let jump_mm = if robot.longest_box_s.is_none() {
        let feed_mm_s = arriving.feed_mm_s.max(leaving.feed_mm_s);
        turn(arriving, leaving) * feed_mm_s * TICK / 4.0
    } else {
        0.0
    };
    Step {
        tangent: leaving.tangent,
        length_mm: leaving.length_mm,
        tolerance_mm: (1.0 - spread) * tolerance_mm - jump_mm - RESOLUTION_MM,
    }
}

/// How long the raw path stands at a corner that is rounded alone.
fn dwell_alone(
    robot: &Robot,
    arriving: &Side,
    leaving: &Side,
    tolerance_mm: f32,
    at_arc: bool,
) -> TickTime {
    let settled = robot.kernel.length();
    if !at_arc && is_slight(robot, arriving, leaving, tolerance_mm) {
        return 0;
    }
    let corner = solve_sampled(robot, arriving, leaving, tolerance_mm);
    if corner.cornering_s >= corner.deceleration_s {
        return 0;
    }
    settled - tick_time(f64::from(corner.cornering_s)).min(settled)
}

/// Whether a corner between lines keeps its tolerance without a dwell, plainly:
/// `F |Δu| I(m)` is within it.
fn is_slight(robot: &Robot, arriving: &Side, leaving: &Side, tolerance_mm: f32) -> bool {
    let feed_mm_s = arriving.feed_mm_s.max(leaving.feed_mm_s);
    let (_, reach_s) = robot.accelerating.at(robot.accelerating.delay_s());
    let miss_mm = feed_mm_s * turn(arriving, leaving) * (reach_s + TICK / 2.0);
    miss_mm <= tolerance_mm - RESOLUTION_MM
}

/// `|u₂ − u₁|`, the change of the tangent at a corner.
fn turn(arriving: &Side, leaving: &Side) -> f32 {
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
/// twice the box's change within a tick is kept. A pure shaper lets the velocity jump: there the
/// margin is taken only if the closest approach is within [`JUMP_TICKS`] of a jump.
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
    if let Some(box_s) = robot.longest_box_s {
        let both_mm_s = arriving.feed_mm_s + leaving.feed_mm_s;
        let share = (2.0 * TICK / box_s).min(1.0);
        return solve(margin_mm(both_mm_s * share));
    }
    let corner = solve(0.0);
    let since_start = corner.approach_s - corner.dwell_s;
    let until_end = corner.deceleration_s - corner.approach_s;
    let near = JUMP_TICKS * TICK;
    let change = |response: &Response, t: f32| response.at(t + near).0 - response.at(t - near).0;
    let change_mm_s = arriving.feed_mm_s * change(&robot.decelerating, until_end)
        + leaving.feed_mm_s * change(&robot.accelerating, since_start);
    if change_mm_s > 0.0 {
        solve(margin_mm(change_mm_s))
    } else {
        corner
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::RobotConfig;
    use crate::path::Shape;
    use crate::queue::SegmentQueue;
    use std::vec::Vec;

    /// `(dwell, duration)` in seconds of each line of a polyline.
    fn planned(robot: &Robot, points: &[[f64; 2]], feed_mm_s: f64) -> Vec<(f64, f64)> {
        let mut queue = SegmentQueue::new();
        let (producer, mut consumer) = queue.split();
        let mut schedule = Schedule::new(producer);
        let mut all = Vec::new();
        let pose = |[x, y]: [f64; 2]| Pose {
            x: fixed::types::I13F19::from_num(x),
            y: fixed::types::I13F19::from_num(y),
            ..Pose::default()
        };
        for pair in points.windows(2) {
            let path = PathSegment {
                start: pose(pair[0]),
                target: pose(pair[1]),
                shape: Shape::Line,
            };
            let duration_s = path.length_mm() / feed_mm_s;
            let timing = Timing {
                duration_s,
                shortest_s: duration_s,
                pace: Pace::Feed,
                ..Timing::default()
            };
            let rule = CornerRule::ToleranceMm(robot.config.corner_tolerance_mm);
            assert!(schedule.plan(robot, &path, &timing, rule, 0, None));
            if let Some(RawItem::Segment(segment)) = consumer.pop() {
                let seconds = |time: TickTime| time as f64 / ONE_TICK as f64 * TICK_S;
                all.push((
                    seconds(robot.kernel.length() - segment.overlap),
                    seconds(segment.duration),
                ));
            }
        }
        all
    }

    fn robot(settings: &str) -> Robot {
        let mut config = RobotConfig::default();
        config.set_all(settings).unwrap();
        Robot::new(&config).unwrap()
    }

    #[test]
    fn a_circle_of_chords_is_walked_steadily() {
        let robot = robot("tolerance=0.1 prefilter=fir-zvd");
        let count = 785;
        let points: Vec<_> = (0..=count)
            .map(|i| {
                let angle = core::f64::consts::TAU * f64::from(i) / f64::from(count);
                [25.0 * angle.cos(), 25.0 * angle.sin()]
            })
            .collect();
        let bound_mm_s = f64::from(sqrt_f32(2.0 * 25.0 * 0.1) / robot.accelerating.spread_s());
        let lines = planned(&robot, &points, 160.0);
        for (i, (dwell_s, duration_s)) in lines.into_iter().enumerate().skip(1) {
            assert_eq!(dwell_s, 0.0);
            let part = 0.2 / duration_s / bound_mm_s;
            // the first line is walked at the feedrate asked for, which the filter remembers
            let least = if i < 100 { 0.85 } else { 0.95 };
            assert!(
                (least..1.0).contains(&part),
                "line {i}: {part} of the bound"
            );
        }
    }

    #[test]
    fn a_straight_line_in_pieces_is_walked_at_the_feedrate_asked_for() {
        let robot = robot("tolerance=0.01");
        let points: Vec<_> = (0..=200).map(|i| [f64::from(i) * 0.5, 0.0]).collect();
        for (dwell_s, duration_s) in planned(&robot, &points, 160.0).into_iter().skip(1) {
            assert_eq!(dwell_s, 0.0);
            assert!((0.5 / duration_s - 160.0).abs() < 0.01);
        }
    }
}
