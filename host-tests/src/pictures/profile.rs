//! A profile: velocity and acceleration of a move, and what the mode on it does.

use anyhow::Result;

use super::canvas::{
    COMMAND, CONTRAST, LIMIT, Point, axes, dashed, full, headed, limit, lines, picture,
};
use super::polyline::envelope;
use crate::commands::profile::SimulatedMove;

const SIZE: (u32, u32) = (1280, 900);

/// Points of a curve.
const POINTS: u32 = 2000;

/// Draws the picture.
pub fn draw(simulated: &SimulatedMove) -> Result<String> {
    let SimulatedMove {
        profile, answer, ..
    } = simulated;
    let feed = profile.feed_mm_s();
    // room to see the mode come to rest
    let end = profile.total_s() * 1.25;
    let times = (0..=POINTS).map(|k| end * f64::from(k) / f64::from(POINTS));
    let commanded: Vec<_> = times.map(|t| (t, profile.at(t))).collect();
    let velocity: Vec<Point> = commanded
        .iter()
        .map(|(t, state)| (*t, state.velocity_mm_s))
        .collect();
    let acceleration: Vec<Point> = commanded
        .iter()
        .map(|(t, state)| (*t, state.acceleration_mm_s2))
        .collect();
    let mass: Vec<Point> = answer
        .velocity
        .iter()
        .copied()
        .take_while(|point| point.0 <= end)
        .collect();
    let subtitle = format!(
        "overshoot {:.3} % accelerating and {:.3} % decelerating, {:.3} s in all",
        answer.overshoot_accelerating_percent,
        answer.overshoot_decelerating_percent,
        profile.total_s()
    );
    let legend = [
        full(COMMAND, 2, "commanded"),
        full(CONTRAST, 1, "mass on the mode"),
        limit("largest acceleration"),
    ];
    picture(SIZE, |root| {
        let body = headed(root, &simulated.headline(), &subtitle, &legend)?;
        let (_, height) = body.dim_in_pixel();
        let (upper, lower) = body.split_vertically(height / 2);
        let ranges = [(0.0, end), (-0.12 * feed, 1.16 * feed)];
        let mut chart = axes(&upper, ranges, ["time, s", "velocity, mm/s"], [10, 6])?;
        lines(&mut chart, [envelope(mass, 2400)], CONTRAST, 1)?;
        lines(&mut chart, [velocity], COMMAND, 2)?;
        let [rises, falls] = profile.acceleration_mm_s2();
        let ranges = [(0.0, end), (-1.16 * falls, 1.16 * rises)];
        let mut chart = axes(&lower, ranges, ["time, s", "acceleration, mm/s²"], [10, 6])?;
        let limits = [rises, -falls].map(|limit| vec![(0.0, limit), (end, limit)]);
        dashed(&mut chart, limits, LIMIT)?;
        lines(&mut chart, [acceleration], COMMAND, 2)
    })
}
