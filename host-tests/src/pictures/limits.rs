//! The limits of motion: velocity, acceleration and jerk of all that is limited, with the
//! limits.

use anyhow::Result;
use planner_core::config::Robot;
use planner_core::limits::{Bound, Order, Part};

use super::canvas::{
    COMMAND, LIMIT, Point, axes, caption, dashed, full, headed, limit, lines, picture,
};
use super::polyline::envelope;
use crate::limit_use::{limits, trace_rates, unit, value};
use crate::paired_run::PairedRun;
use crate::trace::Trace;

const WIDTH: u32 = 1800;
/// Height of the headline and of a row of charts.
const HEAD: u32 = 108;
const ROW: u32 = 300;

/// Points of a curve.
const POINTS: usize = 700;

const ORDERS: [Order; 3] = [Order::Velocity, Order::Acceleration, Order::Jerk];

/// Draws the picture; none of a robot without limits.
pub fn draw(run: &PairedRun) -> Result<Option<String>> {
    let robot = Robot::new(&run.robot)?;
    let all = limits(&run.robot);
    let mut parts: Vec<Part> = all.iter().map(|(bound, _)| bound.part).collect();
    parts.dedup();
    if parts.is_empty() {
        return Ok(None);
    }
    let trace = &run.outcome.trace;
    let rows = trace_rates(&robot, trace);
    let kind = run.robot.arm;
    let rows = rows
        .get(..(trace.stop() + 50).min(rows.len()))
        .unwrap_or(&[]);
    let end = Trace::time_s(rows.len());
    let title = format!("{}: the limits of motion", run.summary.program_name());
    let subtitle = format!(
        "magnitudes from the setpoints; jerk from the change of acceleration within a tick; {:.3} s",
        run.outcome.cycle_time_s
    );
    let legend = [full(COMMAND, 1, "commanded"), limit("limit")];
    let height = HEAD + ROW * parts.len() as u32;
    let text = picture((WIDTH, height), |root| {
        let body = headed(root, &title, &subtitle, &legend)?;
        let panels = body.split_evenly((parts.len(), ORDERS.len()));
        let places = parts
            .iter()
            .flat_map(|part| ORDERS.map(|order| (*part, order)));
        for (panel, (part, order)) in panels.iter().zip(places) {
            let bound = Bound { part, order };
            let found = all.iter().find(|(other, _)| *other == bound);
            let allowed = found.map(|(_, allowed)| *allowed);
            let curve: Vec<Point> = (1..)
                .zip(rows)
                .map(|(row, rates)| (Trace::time_s(row), value(kind, rates, bound)))
                .collect();
            let largest = curve.iter().map(|point| point.1).chain(allowed);
            let top = largest.fold(1e-3, f64::max) * 1.12;
            let area = caption(panel, &format!("{} {}", name(part), order_name(order)))?;
            let y_name = unit(kind, bound);
            let mut chart = axes(&area, [(0.0, end), (0.0, top)], ["time, s", y_name], [6, 4])?;
            lines(&mut chart, [envelope(curve, POINTS)], COMMAND, 1)?;
            if let Some(allowed) = allowed {
                dashed(&mut chart, [vec![(0.0, allowed), (end, allowed)]], LIMIT)?;
            }
        }
        Ok(())
    })?;
    Ok(Some(text))
}

fn name(part: Part) -> String {
    match part {
        Part::Joint(joint) => format!("joint {joint},"),
        Part::Path => "along the path,".into(),
        Part::Axis => "along the axes,".into(),
    }
}

fn order_name(order: Order) -> &'static str {
    match order {
        Order::Velocity => "velocity",
        Order::Acceleration => "acceleration",
        Order::Jerk => "jerk",
    }
}
