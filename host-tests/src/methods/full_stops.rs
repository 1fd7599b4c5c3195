//! Full stops at every corner, each segment time-optimal within limits of velocity,
//! acceleration and jerk.

use anyhow::{Result, anyhow};
use rsruckig::prelude::*;

use super::{Limits, Point, STEP_S, Task};
use crate::vector::xyz;

/// The command along all segments.
///
/// # Errors
/// No profile is found for a segment.
pub fn run(task: &Task, limits: &Limits) -> Result<Vec<Point>> {
    let mut command = Vec::new();
    let mut begin_s = 0.0;
    for (curve, &feed_mm_s) in task.curves.iter().zip(&task.feeds_mm_s) {
        let length_mm = curve.length();
        let mut input = InputParameter::<1>::new(None);
        input.target_position[0] = length_mm;
        input.max_velocity[0] = feed_mm_s;
        input.max_acceleration[0] = limits.acceleration_mm_s2;
        input.max_jerk[0] = limits.jerk_mm_s3;
        let mut trajectory = Trajectory::<1>::new(None);
        Ruckig::<1, ThrowErrorHandler>::new(None, STEP_S)
            .calculate(&input, &mut trajectory)
            .map_err(|error| anyhow!("no profile for {length_mm} mm: {error}"))?;
        let end_s = begin_s + trajectory.get_duration();
        // Samples go on where the segment before has left off between two of them.
        let mut time_s = command.len() as f64 * STEP_S;
        while time_s < end_s {
            let mut position = DataArrayOrVec::new(None, 0.0);
            trajectory.at_time(
                time_s - begin_s,
                &mut Some(&mut position),
                &mut None,
                &mut None,
                &mut None,
                &mut None,
            );
            command.push(xyz(curve.at(position[0])));
            time_s = command.len() as f64 * STEP_S;
        }
        begin_s = end_s;
    }
    if let Some(last) = task.curves.last() {
        command.push(xyz(last.at(last.length())));
    }
    Ok(command)
}
