//! A program's run, as the independent checker sees it.

use std::collections::BTreeMap;

use planner_core::config::Robot;
use planner_core::motion::{DelayLines, Order, Setpoint};
use planner_core::planner::LineError;
use planner_core::queue::SegmentQueue;
use planner_core::units::TICK_S;

use crate::checker::{CheckOptions, Program, ProgramError, Report, TraceRow, check};
use crate::software_loop::Controller;
use crate::trace::pose;

/// Orders before the ticks of these numbers.
pub type Orders = BTreeMap<usize, Order>;

/// Runs a program to its end, with orders on the way: a hold has to be resumed.
///
/// # Errors
/// The first line that is refused.
pub fn setpoints(
    robot: &Robot,
    program: &str,
    orders: &Orders,
) -> Result<Vec<Setpoint>, LineError> {
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let mut all = Vec::new();
    Controller::new(&mut robot.clone(), &mut queue, &mut filters).run_with_orders(
        program,
        |tick| orders.get(&tick).copied(),
        |setpoint| all.push(*setpoint),
    )?;
    Ok(all)
}

/// The poses of setpoints, a row each.
#[must_use]
pub fn rows(setpoints: &[Setpoint]) -> Vec<TraceRow> {
    let row = |(setpoint, tick): (&Setpoint, u32)| TraceRow {
        time_s: f64::from(tick) * TICK_S,
        pose: pose(setpoint),
    };
    setpoints.iter().zip(0..).map(row).collect()
}

/// What the checker finds, with the robot's own tolerance and rapids.
///
/// # Errors
/// What the checker cannot read.
pub fn report(
    robot: &Robot,
    program: &str,
    setpoints: &[Setpoint],
) -> Result<Report, ProgramError> {
    let options = CheckOptions {
        rapid_mm_s: robot.config.rapid_mm_s.into(),
        tolerance_mm: robot.config.corner_tolerance_mm.into(),
        ..CheckOptions::default()
    };
    Ok(check(&Program::parse(program)?, &rows(setpoints), &options))
}
