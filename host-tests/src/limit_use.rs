//! What a run makes of the robot's limits of motion: which are set, how much of each it uses,
//! and which feeds they lower.

use planner_core::config::{Robot, RobotConfig};
use planner_core::kinematics::ArmKind;
use planner_core::limits::{Bound, Limited, MotionLimits, Order, Part};
use planner_core::pose::JointUnit;
use serde::Serialize;

use crate::checker::limits::{Arm, Geometry, JointRow, Rates, rates};
use crate::trace::{Trace, joints};

/// One limit and what became of it.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct LimitUse {
    /// As in `joint 1 velocity`.
    pub limit: String,
    /// In ° or mm, per s, s² or s³.
    pub unit: &'static str,
    /// The limit.
    pub allowed: f64,
    /// The largest value over the run, from the setpoints.
    pub largest: f64,
    /// Segments whose feed it lowers.
    pub lowered_segments: usize,
    /// The lowest feed that it leaves; null if it lowers none of a segment with a length.
    pub lowest_feed_mm_s: Option<f64>,
}

/// Whether a limit of a kind of robot is one of lengths.
fn is_length(kind: ArmKind, bound: Bound) -> bool {
    match bound.part {
        Part::Joint(joint) => {
            kind.joint_units().get(usize::from(joint) - 1) == Some(&JointUnit::Length)
        }
        Part::Path | Part::Axis => true,
    }
}

/// The value in a row that a limit is for: in ° or mm, per s, s² or s³.
#[must_use]
pub fn value(kind: ArmKind, rates: &Rates, bound: Bound) -> f64 {
    let place = bound.order as usize;
    match bound.part {
        Part::Joint(joint) => {
            let value = rates.joints[usize::from(joint) - 1][place];
            if is_length(kind, bound) {
                value
            } else {
                value.to_degrees()
            }
        }
        Part::Path => rates.path[place],
        Part::Axis => rates.axis[place],
    }
}

/// The unit of a limit.
#[must_use]
pub fn unit(kind: ArmKind, bound: Bound) -> &'static str {
    match (is_length(kind, bound), bound.order) {
        (true, Order::Velocity) => "mm/s",
        (true, Order::Acceleration) => "mm/s²",
        (true, Order::Jerk) => "mm/s³",
        (false, Order::Velocity) => "°/s",
        (false, Order::Acceleration) => "°/s²",
        (false, Order::Jerk) => "°/s³",
    }
}

/// The limits that are set, with their values.
#[must_use]
pub fn limits(robot: &RobotConfig) -> Vec<(Bound, f64)> {
    let of_part = |(part, limits): (Part, &MotionLimits)| {
        [
            (Order::Velocity, limits.velocity),
            (Order::Acceleration, limits.acceleration),
            (Order::Jerk, limits.jerk),
        ]
        .map(|(order, allowed)| (Bound { part, order }, f64::from(allowed)))
    };
    let all = robot.limits.all().flat_map(of_part);
    all.filter(|(_, allowed)| *allowed > 0.0).collect()
}

/// Velocities, accelerations and jerks of a trace, for every row but the first.
#[must_use]
pub fn trace_rates(robot: &Robot, trace: &Trace) -> Vec<Rates> {
    let rows: Vec<_> = trace
        .setpoints
        .iter()
        .map(|setpoint| JointRow {
            position: joints(setpoint),
            velocity: setpoint.joints.velocity.map(f64::from),
            acceleration: setpoint.joints.acceleration.map(f64::from),
        })
        .collect();
    let arm = Arm {
        geometry: Geometry::of(&robot.config),
        step_s: Trace::time_s(1),
        longest_arc_mm: 0.0,
        longest_hop_mm: 0.0,
    };
    rates(&rows, &arm)
}

/// The largest part that each row uses of any limit of the joints and the axes; empty where there
/// are none. The path's are not among them.
#[must_use]
pub fn limits_used(robot: &Robot, trace: &Trace) -> Vec<f64> {
    let mut limits = limits(&robot.config);
    limits.retain(|(bound, _)| bound.part != Part::Path);
    if limits.is_empty() {
        return Vec::new();
    }
    let kind = robot.arm.kind();
    let part = |row: &Rates| {
        let parts = limits
            .iter()
            .map(|(bound, allowed)| value(kind, row, *bound) / allowed);
        parts.fold(0.0, f64::max)
    };
    let rows = trace_rates(robot, trace);
    // nothing moves in the first row
    let used = std::iter::once(0.0).chain(rows.iter().map(part));
    used.take(trace.stop() + 1).collect()
}

/// What a run makes of every limit that is set.
#[must_use]
pub fn limit_uses(robot: &Robot, trace: &Trace, limited: &[Limited]) -> Vec<LimitUse> {
    let limits = limits(&robot.config);
    if limits.is_empty() {
        return Vec::new();
    }
    let rates = trace_rates(robot, trace);
    let kind = robot.arm.kind();
    let used = |(bound, allowed): (Bound, f64)| {
        let lowered = limited.iter().filter(|one| one.bound == bound);
        let feeds = lowered.clone().filter(|one| one.length_mm > 0.0);
        LimitUse {
            limit: bound.to_string(),
            unit: unit(kind, bound),
            allowed,
            largest: rates
                .iter()
                .map(|row| value(kind, row, bound))
                .fold(0.0, f64::max),
            lowered_segments: lowered.count(),
            lowest_feed_mm_s: feeds
                .map(|one| one.length_mm / one.takes_s)
                .reduce(f64::min),
        }
    };
    limits.into_iter().map(used).collect()
}
