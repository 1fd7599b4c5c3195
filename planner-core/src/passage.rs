//! How a corner among others is passed: by going slower, or by standing there.

use crate::config::Robot;
use crate::dense::{Chain, Step, Walk};
use crate::math::sqrt_f32;
use crate::outline::Joint;

/// The feedrate on a uniform polyline, as a part of the one that uses all of the tolerance.
const STEADY: f32 = 0.987;

/// Corners on either side of one that are looked at where they are further apart than a part
/// of the prefilter's length.
const FAR_CORNERS: u16 = 6;

/// How often a feedrate is corrected for that.
const CORRECTIONS: u32 = 3;

/// Durations that are tried where the first one does not keep the tolerance, as multiples of it.
const LONGER: [f32; 8] = [1.01, 1.03, 1.07, 1.16, 1.4, 2.2, 4.0, 8.0];

/// How often the shortest dwell is bisected.
const BISECTIONS: u32 = 4;

/// What is asked of a corner.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Dwell that cannot be shortened, in seconds.
    pub least_dwell_s: f32,
    /// Dwell with which the corner keeps the tolerance alone, no less than that.
    pub dwell_s: f32,
    /// How long the line behind it lasts at the feedrate asked for, in seconds.
    pub duration_s: f32,
    /// How long it lasts so that the path can go on turning as it did, no less than that.
    pub steady_s: f32,
}

/// How long a line lasts at the feedrate with which the path could go on turning as it did of
/// late, with lines like this one, in seconds.
///
/// ```text
/// F² σ² κ / 2 = tolerance          with many corners in the prefilter's length
/// F κ L [I(m) + Σ_k (I(m − k L/F) + I(m + k L/F) − k L/F)] = tolerance        with few
/// ```
pub fn steady_s(chain: &Chain, robot: &Robot, step: &Step, turn: f32) -> f32 {
    let curvature_per_mm = chain.curvature_per_mm(turn, step.length_mm);
    let tolerance_mm = step.tolerance_mm.max(f32::MIN_POSITIVE);
    let squared = 2.0 * tolerance_mm / curvature_per_mm.max(f32::MIN_POSITIVE);
    let response = &robot.accelerating;
    let mut feed_mm_s = sqrt_f32(squared) / robot.accelerating.spread_s();
    for _ in 0..CORRECTIONS {
        let line_s = step.length_mm / feed_mm_s;
        if 2.0 * line_s * f32::from(FAR_CORNERS) < response.length_s() {
            break;
        }
        let middle_s = response.delay_s();
        let (_, mut reach_s) = response.at(middle_s);
        for k in 1..=FAR_CORNERS {
            let away_s = f32::from(k) * line_s;
            let (_, before_s) = response.at(middle_s - away_s);
            let (_, behind_s) = response.at(middle_s + away_s);
            reach_s += before_s + behind_s - away_s;
        }
        let miss_mm = feed_mm_s * curvature_per_mm * step.length_mm * reach_s;
        feed_mm_s *= sqrt_f32((tolerance_mm / miss_mm).min(1.0));
    }
    step.length_mm / (STEADY * feed_mm_s)
}

/// The walk along a further line that takes the least time of those tried, and with which the
/// tolerance holds. A dwell of the prefilter's length is an exact stop, which always does.
///
/// Cost: up to 14 times that of [`Chain::judge`]; once on a uniform polyline.
pub fn choose(chain: &Chain, robot: &Robot, joint: &Joint, step: &Step, asked: &Asked) -> Walk {
    let judge = |walk: &Walk| chain.judge(robot, joint, step, walk);
    let is_slight = asked.dwell_s <= asked.least_dwell_s;
    let standing_s = if is_slight {
        asked.steady_s
    } else {
        asked.duration_s
    };
    let standing = |dwell_s: f32| Walk {
        dwell_s,
        duration_s: standing_s,
    };
    let mut best = standing(robot.accelerating.length_s());
    let mut may_stop = None;
    for longer in core::iter::once(1.0).chain(LONGER) {
        let walk = Walk {
            dwell_s: asked.least_dwell_s,
            duration_s: asked.steady_s * longer,
        };
        if walk.time_s() >= best.time_s() {
            break;
        }
        let verdict = judge(&walk);
        if verdict.may_stop {
            may_stop = may_stop.or(Some(walk));
        }
        if verdict.may_stop && verdict.may_go_on {
            may_stop = Some(walk);
            break;
        }
    }
    best = may_stop.unwrap_or(best);
    let mut refused_s = asked.dwell_s;
    let is_slower = may_stop.is_some() && is_slight;
    if is_slower || standing(refused_s).time_s() >= best.time_s() {
        return best;
    }
    if !is_slight && judge(&standing(refused_s)).may_stop {
        return standing(refused_s);
    }
    let mut kept_s = (best.time_s() - standing_s).min(robot.accelerating.length_s());
    for _ in 0..BISECTIONS {
        let walk = standing(f32::midpoint(refused_s, kept_s));
        if judge(&walk).may_stop {
            kept_s = walk.dwell_s;
            best = walk;
        } else {
            refused_s = walk.dwell_s;
        }
    }
    best
}
