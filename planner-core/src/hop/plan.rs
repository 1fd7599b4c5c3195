//! When a hop goes up, across and down.

use super::filtered::times_s;
use super::ramp::HELD;
use super::{HopAxes, HopConfig, HopError, Ramp, RawHop};
use crate::pose::Pose;
use crate::prefilter::Prefilter;
use crate::rate::GradualRate;
use crate::units::{LengthMm, TICK_HZ, TICK_S};

/// Part of the tolerance that is planned with: the rest is for what the prefilter's integer taps
/// make of its impulses.
const TOLERANCE_USED: f64 = 0.98;

/// What the robot allows, whatever is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HopLimits {
    /// Speed across, and likewise vertical.
    pub feed_mm_s: f32,
    /// Speed of the yaw.
    pub yaw_deg_s: f32,
    /// How many times as long each motion takes, from 1 on, where limits of motion are set: it
    /// keeps them also while it is held or its rate changes.
    pub slowdown: Option<f64>,
}

/// Changes of the rate take so many ticks where no limits are set.
const CHANGE_TICKS: u32 = 150;

/// The largest speed, acceleration and jerk that a hop has, per s, s² and s³, holds included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HopPeaks {
    /// Of the tool in the plane, in mm.
    pub across: [f32; 3],
    /// Along Z, in mm.
    pub vertical: [f32; 3],
    /// Of the yaw, in rad.
    pub yaw: [f32; 3],
    /// What the resolution of axes that the prefilter does not act on may add to accelerations, in
    /// mm/s² and °/s².
    pub grain: f32,
    /// How long its motions would take one after the other, in s.
    pub apart_s: f64,
    /// How long up, across and down are together, in mm.
    pub length_mm: f64,
}

/// Lengths of a hop, with the motions over them.
struct Motions {
    top_mm: f64,
    across_mm: f64,
    up_mm: f64,
    down_mm: f64,
    turn_deg: f64,
    acceleration: f64,
    up: Ramp,
    across: Ramp,
    down: Ramp,
}

impl Motions {
    fn new(start: &Pose, target: &Pose, config: &HopConfig, limits: &HopLimits) -> Self {
        let mm = |pose: &Pose| [pose.x, pose.y, pose.z].map(|value| value.to_num::<f64>());
        let ([x0, y0, z0], [x1, y1, z1]) = (mm(start), mm(target));
        let across_mm = libm::hypot(x1 - x0, y1 - y0);
        let turn_deg = libm::fabs(target.c.to_num::<f64>() - start.c.to_num::<f64>());
        let top_mm = z0.max(z1) + f64::from(config.rise_mm);
        let (up_mm, down_mm) = (top_mm - z0, top_mm - z1);
        let slowdown = limits.slowdown.unwrap_or(1.0);
        let speed = f64::from(limits.feed_mm_s) / slowdown;
        let acceleration = f64::from(config.acceleration_mm_s2) / (slowdown * slowdown);
        let ramp = |length_mm, slowest_s| Ramp::new(length_mm, speed, acceleration, slowest_s);
        Self {
            top_mm,
            across_mm,
            up_mm,
            down_mm,
            turn_deg,
            acceleration,
            up: ramp(up_mm, 0.0),
            across: ramp(across_mm, slowdown * turn_deg / f64::from(limits.yaw_deg_s)),
            down: ramp(down_mm, 0.0),
        }
    }
}

/// What a hop that is planned with these does at the most. Settings have been checked.
#[must_use]
#[inline(never)]
pub fn peaks(start: &Pose, target: &Pose, config: &HopConfig, limits: &HopLimits) -> HopPeaks {
    let motions = Motions::new(start, target, config, limits);
    let held = |[speed, acceleration, jerk]: [f32; 3]| [speed, acceleration * HELD, jerk * HELD];
    let [up, down] = [(motions.up, motions.up_mm), (motions.down, motions.down_mm)]
        .map(|(ramp, mm)| held(ramp.peaks(mm as f32)));
    let mut vertical = up;
    for (peak, down) in vertical.iter_mut().zip(down) {
        *peak = peak.max(down);
    }
    let all = [motions.up, motions.across, motions.down];
    let ticks: f64 = all.iter().map(|ramp| f64::from(ramp.ticks())).sum();
    HopPeaks {
        across: held(motions.across.peaks(motions.across_mm as f32)),
        vertical,
        yaw: held(motions.across.peaks(motions.turn_deg.to_radians() as f32)),
        grain: if config.axes == HopAxes::All {
            0.0
        } else {
            grain(motions.across_mm.max(motions.up_mm).max(motions.down_mm))
        },
        apart_s: ticks * TICK_S,
        length_mm: motions.up_mm + motions.across_mm + motions.down_mm,
    }
}

/// A planned hop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hop {
    /// Where it begins.
    pub start: Pose,
    /// Where it ends.
    pub target: Pose,
    /// How high it goes, as a Z in mm.
    pub top_mm: f64,
    /// What the tick walks.
    pub raw: RawHop,
}

/// Lines around all that a hop passes: up, across at the top, down, and across where the lower
/// vertical part ends.
#[must_use]
pub fn outline(start: Pose, target: Pose, config: &HopConfig) -> [[Pose; 2]; 4] {
    let at = |pose: Pose, z: LengthMm| Pose { z, ..pose };
    let above = |z: LengthMm, mm: f32| z.saturating_add(LengthMm::saturating_from_num(mm));
    let top = above(start.z.max(target.z), config.rise_mm);
    let low = above(start.z.min(target.z), config.height_mm);
    [
        [start, at(start, top)],
        [at(start, top), at(target, top)],
        [at(target, top), target],
        [at(start, low), at(target, low)],
    ]
}

/// What rounding adds to the acceleration of a raw path: a second difference of three points that
/// are rounded to 2^-19 mm, of progresses that are good to 2^-30, in each of three axes.
fn grain(length_mm: f64) -> f32 {
    const PER_S2: f64 = 1.0 / (TICK_S * TICK_S);
    let axis_mm = 2.0 / f64::from(1 << 19) + length_mm * 4.0 / f64::from(1 << 30);
    (1.732_051 * axis_mm * PER_S2) as f32
}

/// Plans a hop.
///
/// With `t↑(h)` when *up* has passed the height, `t↓(h)` when *down* comes to it, counted from
/// its begin, and `x(t)` the motion across, all three as they leave the prefilter of their axes:
///
/// ```text
/// across begins at  max( t↑(h) raw,                 t↑(h) − τ₁ ),       L x(τ₁) = tolerance
/// down begins at    max( across + T_x − t↓(h) raw,  across + τ₂ − t↓(h),  T↑ ),   L (1 − x(τ₂)) = tolerance
/// ```
///
/// The first of each keeps the raw path vertical within the height, the second one the path
/// behind the prefilter; with the third, `T↑` the end of *up*, the hop rises as high as it is
/// said to, and *up* and *down* do not add up to more than the acceleration.
///
/// 3.3 million instructions on a Cortex-M4F with FIR-ZVD on all axes, and 6.4 million with a second
/// box; in proportion to the kinks of the response.
///
/// # Errors
/// [`HopError`] names the value that is out of range.
pub fn plan(
    start: Pose,
    target: Pose,
    config: &HopConfig,
    limits: &HopLimits,
    prefilter: &Prefilter,
) -> Result<Hop, HopError> {
    config.check()?;
    let Motions {
        top_mm,
        across_mm,
        up_mm,
        down_mm,
        acceleration,
        up,
        across,
        down,
        ..
    } = Motions::new(&start, &target, config, limits);

    let over_all = (config.axes == HopAxes::All).then_some(prefilter);
    let over_across = (config.axes != HopAxes::None).then_some(prefilter);
    let share = |mm: f64, of_mm: f64| if of_mm > 0.0 { mm / of_mm } else { 1.0 };
    let height_mm = f64::from(config.height_mm);
    // the trace goes straight from one tick to the next, aside from a curve by up to A T²/8
    let sampled_mm = acceleration * TICK_S * TICK_S / 8.0;
    let tolerance_mm = (f64::from(config.tolerance_mm) * TOLERANCE_USED - sampled_mm).max(0.0);
    let (risen, lowered) = (
        share(height_mm, up_mm),
        1.0 - share(height_mm, down_mm).min(1.0),
    );
    let bent = share(tolerance_mm, across_mm).min(1.0);

    let [first_s, last_s] = times_s(&across, over_across, [bent, 1.0 - bent]);
    let [raw_up_s] = times_s(&up, None, [risen]);
    let [up_s, top_s] = times_s(&up, over_all, [risen, 1.0]);
    let across_begins = ticks(raw_up_s.max(up_s - first_s));

    let [raw_down_s] = times_s(&down, None, [lowered]);
    let [down_s] = times_s(&down, over_all, [lowered]);
    let raw_last_s = f64::from(across.ticks()) * TICK_S;
    let after_s = (raw_last_s - raw_down_s).max(last_s - down_s);
    let down_begins = ticks((f64::from(across_begins) * TICK_S + after_s).max(top_s));

    let change_ticks = match limits.slowdown {
        Some(_) => [up, across, down]
            .iter()
            .fold(CHANGE_TICKS, |most, ramp| most.max(ramp.change_ticks())),
        None => CHANGE_TICKS,
    };
    let bits = |mm: f64| libm::round(mm * f64::from(1 << 19)) as i32;
    let up_bits = bits(up_mm);
    let is_direct =
        [over_across, over_across, over_all, over_across].map(|filter| filter.is_none());
    Ok(Hop {
        start,
        target,
        top_mm,
        raw: RawHop {
            up_bits,
            // ends at the target to the last bit
            down_bits: up_bits.wrapping_add(start.z.to_bits().wrapping_sub(target.z.to_bits())),
            up,
            across_begins,
            across,
            down_begins,
            down,
            direct: is_direct,
            rate_step: GradualRate::step(change_ticks),
        },
    })
}

/// Whole ticks, rounded up; none for a time before zero.
fn ticks(time_s: f64) -> u32 {
    libm::ceil(time_s * f64::from(TICK_HZ)).max(0.0) as u32
}
