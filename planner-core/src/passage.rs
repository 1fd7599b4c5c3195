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

/// Durations that are tried, as multiples of the steady one.
const LONGER: [f32; 7] = [1.0, 1.03, 1.1, 1.3, 1.8, 3.0, 6.0];

/// If the path has to go so much slower than steadily, standing before it is tried too.
const SLOW: f32 = 1.35;

/// How often the shortest dwell is bisected.
const BISECTIONS: u32 = 3;

/// What a walk costs that the path cannot go on from as it did of late, as a part of the
/// prefilter's length: a stop soon after it, or nearly one.
const CORNERED: f32 = 0.5;

/// Where a corner and the line behind it take this part of the prefilter's length or more, the
/// next corner's dwell is hardly longer than if that were alone, and the path may go on like that.
const APART: f32 = 0.5;

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

/// The walk along a further line that costs the least of those tried, and with which the
/// tolerance holds: without a dwell that the corner does not need, steadily or slower; behind a
/// dwell, at the feedrate asked for or steadily. A dwell of the prefilter's length is an exact
/// stop, which always keeps the tolerance.
///
/// Cost: up to 14 times that of [`Chain::judge`]; once on a uniform polyline.
pub fn choose(chain: &Chain, robot: &Robot, joint: &Joint, step: &Step, asked: &Asked) -> Walk {
    let length_s = robot.accelerating.length_s();
    let is_slight = asked.dwell_s <= asked.least_dwell_s;
    let goes_on_standing = !is_slight && asked.dwell_s + asked.duration_s >= APART * length_s;
    let cost_s = |walk: &Walk, goes_on: bool| {
        let verdict = chain.judge(robot, joint, step, walk);
        let more_s = if goes_on || verdict.may_go_on {
            0.0
        } else {
            CORNERED * length_s
        };
        verdict.may_stop.then_some(walk.time_s() + more_s)
    };
    let mut best = Best::new(Walk {
        dwell_s: length_s,
        duration_s: if goes_on_standing {
            asked.duration_s
        } else {
            asked.steady_s
        },
    });
    for longer in LONGER {
        let walk = Walk {
            dwell_s: asked.least_dwell_s,
            duration_s: asked.steady_s * longer,
        };
        if walk.time_s() >= best.cost_s {
            break;
        }
        let cost_s = cost_s(&walk, false);
        best.take(&walk, cost_s);
        if cost_s.is_some_and(|cost_s| cost_s <= walk.time_s()) {
            break;
        }
    }
    if !is_slight {
        let walk = Walk {
            dwell_s: asked.dwell_s,
            duration_s: asked.duration_s,
        };
        let is_taken =
            walk.time_s() < best.cost_s && best.take(&walk, cost_s(&walk, goes_on_standing));
        if !is_taken {
            best.bisect(&walk, length_s, |walk| cost_s(walk, goes_on_standing));
        }
    }
    let steady = Walk {
        dwell_s: asked.least_dwell_s,
        duration_s: asked.steady_s,
    };
    if !goes_on_standing && best.cost_s > steady.dwell_s + SLOW * steady.duration_s {
        best.bisect(&steady, length_s, |walk| cost_s(walk, false));
    }
    best.walk
}

/// The best walk so far.
struct Best {
    walk: Walk,
    /// Its time, and what it costs behind it, in seconds.
    cost_s: f32,
}

impl Best {
    fn new(walk: Walk) -> Self {
        Self {
            walk,
            cost_s: walk.time_s(),
        }
    }

    /// Whether a walk of that cost is better; nothing is of one that does not keep the tolerance.
    fn take(&mut self, walk: &Walk, cost_s: Option<f32>) -> bool {
        let is_better = cost_s.is_some_and(|cost_s| cost_s < self.cost_s);
        if let Some(cost_s) = cost_s.filter(|_| is_better) {
            *self = Self {
                walk: *walk,
                cost_s,
            };
        }
        is_better
    }

    /// Looks for the shortest dwell that makes a walk better, if its own does not.
    fn bisect(&mut self, refused: &Walk, longest_s: f32, cost_s: impl Fn(&Walk) -> Option<f32>) {
        let mut refused_s = refused.dwell_s;
        let mut taken_s = (self.cost_s - refused.duration_s).min(longest_s);
        if taken_s <= refused_s {
            return;
        }
        for _ in 0..BISECTIONS {
            let walk = Walk {
                dwell_s: f32::midpoint(refused_s, taken_s),
                ..*refused
            };
            if self.take(&walk, cost_s(&walk)) {
                taken_s = walk.dwell_s;
            } else {
                refused_s = walk.dwell_s;
            }
        }
    }
}
