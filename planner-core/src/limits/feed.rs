//! How long a segment has to take.

use super::box_range::BoxRange;
use super::config::{Bound, LimitsConfig, MotionLimits, Order, Part};
use super::course::{Course, Region};
use crate::config::RobotConfig;
use crate::corner::CornerRule;
use crate::kinematics::{Arm, ArmBounds, ArmKind, RateBounds, Ring, Spans};
use crate::math::sqrt_f32;
use crate::prefilter::{Kind, Prefilter, PrefilterConfig};
use crate::units::TICK_S;

/// Kept of every limit for roundings: of weights to 2^-30, of rates to `f32`.
const MARGIN: f32 = 0.9995;

/// Evaluations after the first: each at least halves the logarithm of what is left to find.
const ROUNDS: usize = 7;

/// A duration found is at most so much longer than need be.
const CLOSE: f32 = 1.005;

/// Lengths of the boxes that a prefilter is given, in ms: short enough to leave the robot
/// quick, long enough to be many ticks.
const BOX_MS: (f32, f32) = (10.0, 200.0);

/// Limits in mm, rad and s; infinite where there is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Highest {
    pub velocity: f32,
    pub acceleration: f32,
    pub jerk: f32,
}

impl Highest {
    fn new(limits: &MotionLimits, unit: f32) -> Self {
        let value = |limit: f32| {
            if limit > 0.0 {
                limit * unit * MARGIN
            } else {
                f32::INFINITY
            }
        };
        Self {
            velocity: value(limits.velocity),
            acceleration: value(limits.acceleration),
            jerk: value(limits.jerk),
        }
    }
}

/// The limits of a robot with its prefilter, ready to time segments.
#[derive(Clone, Debug)]
pub struct Limits {
    pub(super) joints: [Highest; 4],
    pub(super) path: Highest,
    pub(super) axis: Highest,
    pub(super) arm: ArmBounds,
    pub(super) boxes: Boxes,
    /// How far the command can be from a raw point of its window, in s of travel.
    reach_s: f32,
    /// No raw point is faster.
    fastest_mm_s: f32,
    /// Whether anything is limited.
    is_set: bool,
    boxes_needed: usize,
}

/// What the boxes make of a jump of the velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boxes {
    /// Longest box in s, of the prefilter where it is longest; 0 if accelerations are not limited.
    pub first_s: f32,
    /// Second longest, likewise; 0 if jerks are not limited.
    pub second_s: f32,
    /// `1/T1` and `2/(T1 T2)` of the shortest ones; 0 likewise.
    pub per_first: f32,
    pub per_both: f32,
}

/// How fast a segment is walked: its speed, and its loads for accelerations and for jerks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    pub speed: f32,
    pub acceleration: f32,
    pub jerk: f32,
}

impl Boxes {
    /// The first `needed` of the boxes within a range.
    fn new(range: &BoxRange, needed: usize) -> Self {
        let if_needed = |[first_s, second_s]: [f32; 2]| match needed {
            0 => [0.0; 2],
            1 => [first_s, 0.0],
            _ => [first_s, second_s],
        };
        let inverse = |s: f32| if s > 0.0 { 1.0 / s } else { 0.0 };
        let [first_s, second_s] = if_needed(range.longest_s);
        let [shortest_s, second_shortest_s] = if_needed(range.shortest_s);
        Self {
            first_s,
            second_s,
            per_first: inverse(shortest_s),
            per_both: 2.0 * inverse(shortest_s * second_shortest_s),
        }
    }

    /// The load of a segment of `length_mm`. However fast the raw path is, the box spreads the
    /// length over its own, so that the curve is never taken faster than `L / T1`.
    pub(super) fn load(&self, speed: f32, curvature: f32, length_mm: f32) -> Load {
        let smoothed = speed.min(length_mm * self.per_first);
        let turning = curvature * speed * smoothed;
        let acceleration = speed + turning * self.first_s;
        let both = self.first_s * self.second_s;
        Load {
            speed,
            acceleration,
            jerk: acceleration
                + 1.5 * turning * self.second_s
                + 0.5 * turning * curvature * smoothed * both,
        }
    }

    /// By how much a thing that moves as the tool does, or a part of it, passes its limits.
    pub(super) fn linear(&self, load: &Load, highest: &Highest) -> [f32; 3] {
        [
            load.speed / highest.velocity,
            load.acceleration * self.per_first / highest.acceleration,
            load.jerk * self.per_both / highest.jerk,
        ]
    }

    /// Likewise a joint with these bounds.
    fn turning(&self, load: &Load, bounds: &RateBounds, highest: &Highest) -> [f32; 3] {
        let RateBounds {
            first,
            second,
            third,
        } = *bounds;
        let (a, j) = (load.acceleration, load.jerk);
        [
            first * load.speed / highest.velocity,
            (first * self.per_first + second * a) * a / highest.acceleration,
            (first * self.per_both + (3.0 * second * self.per_first + third * j) * j) * j
                / highest.jerk,
        ]
    }
}

/// Gives the settings of prefilters the boxes that limits need, as smoothing: every prefilter
/// made from them has as many then, whatever its mode and, if it is chosen automatically, its kind.
///
/// A box that is missing gets the length with which a rapid just keeps the limits with the
/// forearm square to the upper arm, within 10 and 200 ms; with all of a delta's. The second one is
/// that beside the shortest first one that there is.
#[inline(never)]
pub fn add_boxes(prefilter: &mut PrefilterConfig, robot: &RobotConfig, arm: &Arm, automatic: bool) {
    let (config, rapid_mm_s) = (&robot.limits, robot.rapid_mm_s);
    let needed = config.boxes_needed();
    let length_ms = |length_s: f32| (1e3 * length_s).clamp(BOX_MS.0, BOX_MS.1);
    let [first_ms, second_ms] = prefilter.smoothing_ms;
    // one that is given as the second is the first of a prefilter without a box
    if first_ms == 0.0 && needed > usize::from(second_ms > 0.0) {
        let quotient = worst_quotient(config, arm, |limits| limits.acceleration);
        prefilter.smoothing_ms[0] = length_ms(rapid_mm_s * quotient);
    }
    if second_ms == 0.0 && needed >= 2 {
        let quotient = worst_quotient(config, arm, |limits| limits.jerk);
        let first_s = shortest_first_box_s(prefilter, robot, automatic);
        prefilter.smoothing_ms[1] = length_ms(2.0 * rapid_mm_s * quotient / first_s);
    }
}

/// The shortest first box of the prefilters made from these settings: that for the fastest mode.
fn shortest_first_box_s(prefilter: &PrefilterConfig, robot: &RobotConfig, automatic: bool) -> f32 {
    let nodes = robot.map.used().iter().map(|node| node.frequency_hz());
    let fastest_hz = nodes.reduce(f32::max).filter(|_| robot.map.is_complete());
    let first_box_s = |kind| {
        let boxes_s = Prefilter::boxes_of(&PrefilterConfig {
            kind,
            frequency_hz: fastest_hz.unwrap_or(prefilter.frequency_hz),
            ..*prefilter
        });
        boxes_s
            .first()
            .map_or(f32::INFINITY, |length_s| *length_s as f32)
    };
    if automatic {
        // all kinds that are chosen have boxes of a period, or none
        first_box_s(Kind::None).min(first_box_s(Kind::Fir))
    } else {
        first_box_s(prefilter.kind)
    }
}

/// The largest quotient of what a tool's mm moves and what is allowed of it.
fn worst_quotient(config: &LimitsConfig, arm: &Arm, limit: impl Fn(&MotionLimits) -> f32) -> f32 {
    // of joints 1 to 4
    let turns = match arm.bounds() {
        ArmBounds::Scara(shape) => {
            let [first, second, both] = shape.square();
            [first, second, 0.0, both]
        }
        ArmBounds::Delta(shape) => {
            let turn = shape.square();
            [turn, turn, turn, 0.0]
        }
    };
    let quotient = |(part, limits): (Part, &MotionLimits)| {
        let per_mm = match part {
            Part::Joint(joint) => turns
                .get(usize::from(joint) - 1)
                .filter(|turn| **turn > 0.0)
                .map_or(1.0, |turn| turn.to_degrees()),
            Part::Path | Part::Axis => 1.0,
        };
        let limit = limit(limits);
        if limit > 0.0 { per_mm / limit } else { 0.0 }
    };
    config.all().map(quotient).fold(0.0, f32::max)
}

impl Limits {
    /// The limits of a robot with this arm and prefilter, which has the boxes that they need:
    /// see [`add_boxes`]. `reach_s` is the largest [`Prefilter::reach_s`] of those that it may
    /// change to.
    #[must_use]
    pub fn new(robot: &RobotConfig, arm: &Arm, prefilter: &Prefilter, reach_s: f32) -> Self {
        let config = &robot.limits;
        let mut joints = config.joints.map(|l| Highest::new(&l, 1_f32.to_radians()));
        if arm.kind() == ArmKind::Scara {
            joints[2] = Highest::new(&config.joints[2], 1.0);
        }
        let needed = config.boxes_needed();
        Self {
            joints,
            path: Highest::new(&config.path, 1.0),
            axis: Highest::new(&config.axis, 1.0),
            arm: arm.bounds(),
            boxes: Boxes::new(&BoxRange::of(&prefilter.boxes_s()), needed),
            // and two ticks that a setpoint is behind
            reach_s: reach_s.max(prefilter.reach_s() as f32) + 2.0 * TICK_S as f32,
            fastest_mm_s: robot.feed_limit_mm_s,
            is_set: *config != LimitsConfig::default(),
            boxes_needed: needed,
        }
    }

    /// The same while the prefilter may be any whose boxes are within a range.
    #[must_use]
    pub fn within(&self, range: &BoxRange) -> Self {
        Self {
            boxes: Boxes::new(range, self.boxes_needed),
            ..self.clone()
        }
    }

    /// The boxes of the one prefilter that these limits are for; those that no limit needs are 0.
    #[must_use]
    pub fn box_range(&self) -> BoxRange {
        let both_s = [self.boxes.first_s, self.boxes.second_s];
        BoxRange {
            shortest_s: both_s,
            longest_s: both_s,
        }
    }

    /// Whether the prefilter has to do with the limits.
    #[must_use]
    pub const fn needs_boxes(&self) -> bool {
        self.boxes_needed > 0
    }

    /// Whether anything is limited.
    #[must_use]
    pub const fn is_set(&self) -> bool {
        self.is_set
    }

    /// How long the raw path stands at a corner that no pair of instants may span, in s; 0 if
    /// any corner will do.
    #[must_use]
    pub fn stop_s(&self) -> f32 {
        match self.boxes_needed {
            0 => 0.0,
            // and two ticks over which the boxes' edges are spread
            _ => self.boxes.first_s + self.boxes.second_s + 2.0 * TICK_S as f32,
        }
    }

    /// Whether single axes are limited, so that corners may not reverse them.
    pub(super) fn limits_axes(&self) -> bool {
        self.axis.acceleration.is_finite() || self.axis.jerk.is_finite()
    }

    /// Whether turning the yaw is limited by more than its speed.
    pub(super) fn limits_yaw(&self) -> bool {
        let [.., joint4] = &self.joints;
        joint4.acceleration.is_finite() || joint4.jerk.is_finite()
    }

    /// Which kind of robot they are for.
    #[must_use]
    pub const fn kind(&self) -> ArmKind {
        self.arm.kind()
    }

    /// How far from a segment a command may stray that rounds a corner, in mm, so that it keeps
    /// away from a SCARA's folded arm or a delta's serial singularity: a part of what the
    /// singularity margin leaves, and what the segment itself keeps from it.
    #[must_use]
    pub fn spare_mm(&self, course: &Course) -> f32 {
        match (&self.arm, &course.region) {
            (ArmBounds::Scara(arm), Region::Ring(ring)) => {
                arm.spare_mm() + (ring.inner_mm - arm.programmed().inner_mm).max(0.0)
            }
            (ArmBounds::Delta(arm), Region::Sweep(sweep)) => arm.spare_mm(sweep),
            // a course is made for the robot's kind
            _ => 0.0,
        }
    }

    /// The rule that a corner may have between segments that leave `spare_mm`. A given overlap
    /// promises nothing, and stays.
    #[must_use]
    pub fn rule(&self, rule: CornerRule, spare_mm: f32) -> CornerRule {
        match rule {
            CornerRule::ToleranceMm(tolerance_mm) => {
                CornerRule::ToleranceMm(tolerance_mm.min(spare_mm))
            }
            CornerRule::OverlapPercent(_) => rule,
        }
    }

    /// The shortest duration in s that keeps the limits while the segment is walked alone, and
    /// the limit that sets it; 0 if the segment may take half of `asked_s`.
    ///
    /// At most 0.5 % longer than need be, mostly. Cost on a Cortex-M4F: below 20 000 instructions
    /// for a SCARA, 50 000 for a delta robot.
    #[must_use]
    pub fn least_s(&self, course: &Course, asked_s: f32) -> (f32, Option<Bound>) {
        if !self.is_set {
            return (0.0, None);
        }
        let yaw_s = self.yaw_s(course);
        let place = self.place(&course.region);
        let hurried_s = 0.5 * asked_s - yaw_s;
        let (overload, mut bound) = self.overload(course, &place, hurried_s);
        if overload <= 1.0 {
            return (0.0, None);
        }
        let (mut low_s, mut high_s) = (hurried_s.max(0.0), f32::INFINITY);
        if low_s > 0.0 {
            high_s = low_s * overload;
        }
        let (mut above, mut below) = ((low_s, overload), None);
        for _ in 0..ROUNDS {
            if high_s <= low_s * CLOSE {
                break;
            }
            let middle_s = match (low_s > 0.0, high_s.is_finite()) {
                // where the bounds cost more: overloads grow little faster than the speed
                (true, true) if self.kind() == ArmKind::Delta => {
                    below.map_or(high_s, |below| between(above, below).clamp(low_s, high_s))
                }
                (true, true) => sqrt_f32(low_s * high_s),
                (false, true) => 0.5 * high_s,
                // any duration serves to begin with
                (_, false) => asked_s,
            };
            let (overload, by) = self.overload(course, &place, middle_s);
            bound = by;
            if overload > 1.0 {
                above = (middle_s, overload);
            } else {
                below = Some((middle_s, overload));
            }
            // Overloads grow at least as the speed does: a duration times its overload keeps the
            // limits if that is above 1, and does not if it is below.
            let scaled_s = middle_s * overload;
            low_s = low_s.max(middle_s.min(scaled_s));
            high_s = high_s.min(middle_s.max(scaled_s));
        }
        (high_s + yaw_s, bound)
    }

    /// How long the yaw alone takes at the limits of joint 4, where the tool moves that too.
    fn yaw_s(&self, course: &Course) -> f32 {
        if self.kind() == ArmKind::Delta {
            return 0.0;
        }
        let load = self.boxes.load(course.yaw_rad, 0.0, 0.0);
        largest(Part::Joint(4), self.boxes.linear(&load, &self.joints[3])).0
    }

    /// The largest quotient of what a segment that takes `duration_s` may make of something, and
    /// the limit of that; infinite without a duration.
    fn overload(&self, course: &Course, place: &Place, duration_s: f32) -> (f32, Option<Bound>) {
        if duration_s <= 0.0 {
            return (f32::INFINITY, None);
        }
        let per_s = 1.0 / duration_s;
        let boxes = &self.boxes;
        let load =
            |way_mm: f32| boxes.load(way_mm * per_s, course.curvature_per_mm, course.plane_mm);
        let [x_mm, y_mm, z_mm] = course.axes_mm;
        let straight = boxes.load(z_mm * per_s, 0.0, 0.0);
        let mut worst = (0.0, None);
        let mut take = |found: (f32, Bound)| {
            if found.0 > worst.0 {
                worst = (found.0, Some(found.1));
            }
        };
        take(largest(
            Part::Path,
            boxes.linear(&load(course.length_mm), &self.path),
        ));
        let plane = boxes.linear(&load(x_mm.max(y_mm)), &self.axis);
        take(largest(Part::Axis, plane));
        take(largest(Part::Axis, boxes.linear(&straight, &self.axis)));
        let [joint1, joint2, joint3, joint4] = &self.joints;
        // what moves as a part of the tool does, the length that moves the others, and those
        let (linear, way_mm, turning) = match &self.arm {
            ArmBounds::Scara(_) => (
                (3, straight, joint3),
                course.plane_mm,
                [(1, joint1), (2, joint2), (4, joint4)],
            ),
            ArmBounds::Delta(_) => (
                (4, boxes.load(course.yaw_rad * per_s, 0.0, 0.0), joint4),
                course.length_mm,
                [(1, joint1), (2, joint2), (3, joint3)],
            ),
        };
        let (joint, alone, highest) = linear;
        take(largest(Part::Joint(joint), boxes.linear(&alone, highest)));
        let load = load(way_mm);
        let reach_mm = load.jerk.min(self.fastest_mm_s) * self.reach_s;
        let bounds = self.bounds(place, reach_mm);
        for ((joint, highest), bounds) in turning.into_iter().zip(&bounds) {
            take(largest(
                Part::Joint(joint),
                boxes.turning(&load, bounds, highest),
            ));
        }
        worst
    }

    /// A region as bounds are computed from it.
    pub(super) fn place(&self, region: &Region) -> Place {
        match (&self.arm, region) {
            (ArmBounds::Delta(arm), Region::Sweep(sweep)) => Place::Spans(arm.spans(sweep)),
            (_, Region::Ring(ring)) => Place::Ring(*ring),
            // a course is made for the robot's kind
            (ArmBounds::Scara(arm), Region::Sweep(_)) => Place::Ring(arm.programmed()),
        }
    }

    /// Bounds for the joints that the tool turns, wherever it is so near a place: 1, 2 and their
    /// sum of a SCARA, 1 to 3 of a delta robot.
    pub(super) fn bounds(&self, place: &Place, reach_mm: f32) -> [RateBounds; 3] {
        match (&self.arm, place) {
            (ArmBounds::Scara(arm), Place::Ring(ring)) => arm.within(Ring {
                inner_mm: ring.inner_mm - reach_mm,
                outer_mm: ring.outer_mm + reach_mm,
            }),
            (ArmBounds::Delta(arm), Place::Spans(spans)) => arm.within(spans, reach_mm),
            // a place is made for the robot's kind
            _ => [RateBounds::default(); 3],
        }
    }
}

/// Where an overload is about 1, between durations where it is above that and no more than that: on
/// a straight line in their logarithms, for which the bits of a float do well enough.
fn between((above_s, above): (f32, f32), (below_s, below): (f32, f32)) -> f32 {
    let logarithm = |value: f32| value.to_bits() as f32;
    let share = (logarithm(above) - logarithm(1.0)) / (logarithm(above) - logarithm(below));
    let way = logarithm(below_s) - logarithm(above_s);
    f32::from_bits((logarithm(above_s) + share * way) as u32)
}

/// Where a segment is, as bounds on the joints are computed from it.
#[expect(
    clippy::large_enum_variant,
    reason = "there is one at a time, and no allocator to box it with"
)]
pub(super) enum Place {
    Ring(Ring),
    Spans(Spans),
}

/// The largest of the quotients for velocity, acceleration and jerk.
pub(super) fn largest(part: Part, quotients: [f32; 3]) -> (f32, Bound) {
    let [velocity, acceleration, jerk] = quotients;
    let found = |order| Bound { part, order };
    if jerk > velocity.max(acceleration) {
        (jerk, found(Order::Jerk))
    } else if acceleration > velocity {
        (acceleration, found(Order::Acceleration))
    } else {
        (velocity, found(Order::Velocity))
    }
}
