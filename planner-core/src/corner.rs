//! The corner: how much of one segment's deceleration may overlap the next one's
//! acceleration while the corner's miss stays within its tolerance.

use crate::math::{sign_change, sin_cos_f32, sqrt_f32, straight_sign_change};
use crate::prefilter::Response;

/// The solver aims below the tolerance by this fraction, more than single precision rounds.
const GUARD: f32 = 8e-6;

/// How exactly the closest approach is found in the end, as a fraction of the cornering time.
const APPROACH_WIDTH: f32 = 2e-6;

/// How exactly it is found on the way: the error is then too large by at most a ten-thousandth
/// of what the tool moves in the cornering time, at a velocity jump.
const COARSE_WIDTH: f32 = 1e-4;

/// How exactly the cornering time is found, in seconds.
const CORNERING_WIDTH_S: f32 = 1e-5;

/// How exactly the crossing of two segments is found, as a fraction of the cornering time.
const CROSSING_WIDTH: f32 = 1e-3;

/// Samples of the deviation on either side of the crossing, beside an arc.
const SAMPLES: usize = 2;

/// Where both segments turn by more than this within a corner, in rad, as small circles do, it is
/// looked at once more with one sample for each radian besides, ...
const MUCH_TURN: f32 = 1.5;

/// ... up to so many, ...
const MOST_SAMPLES: usize = 8;

/// ... multiplied with less. If it misses by too much then, its time is shortened a little more than
/// in proportion.
const FINE_SAMPLING: f32 = 1.1;
const SHORTENED: f32 = 0.9;

/// What the samples of the deviation are multiplied with, for what lies between them.
const SAMPLING: f32 = 1.4;

/// How a corner is to be passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CornerRule {
    /// Missed by at most so many mm, and as fast as that allows; 0 is an exact stop.
    ToleranceMm(f32),
    /// Overlapped by so many percent, 0 (exact stop) to 100 (no dwell at all), however far
    /// that misses the corner:
    ///
    /// ```text
    /// OVLP = 100 (t_c / T_d1)²                                                   [Li23]
    /// ```
    OverlapPercent(f32),
}

impl CornerRule {
    /// Stands still at the corner.
    pub const EXACT_STOP: Self = Self::ToleranceMm(0.0);

    /// Whether it is an exact stop.
    #[must_use]
    pub fn stops(self) -> bool {
        match self {
            Self::ToleranceMm(amount) | Self::OverlapPercent(amount) => amount <= 0.0,
        }
    }

    /// With a tolerance so much smaller, down to an exact stop.
    #[must_use]
    pub fn tightened(self, by_mm: f32) -> Self {
        match self {
            Self::ToleranceMm(tolerance_mm) => Self::ToleranceMm((tolerance_mm - by_mm).max(0.0)),
            Self::OverlapPercent(_) => self,
        }
    }
}

/// A segment as one of its ends sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Feedrate in mm/s.
    pub feed_mm_s: f32,
    /// Unit tangent at the corner, in the direction of motion.
    pub tangent: [f32; 3],
    /// Change of heading in the XY plane per millimetre of path, positive counter-clockwise;
    /// 0 for a line.
    pub heading_rate_per_mm: f32,
    /// Length of the segment in mm: how far it is true to the curve.
    pub length_mm: f32,
}

/// What the solver found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Length of the deceleration, `T_d1` in seconds.
    pub deceleration_s: f32,
    /// Cornering time, `t_c` in seconds: how long both segments move.
    pub cornering_s: f32,
    /// Delay time, `t_d = T_d1 − t_c` in seconds: the dwell of the raw path at the corner.
    pub dwell_s: f32,
    /// Time of the closest approach after the deceleration's start, `t_m` in seconds.
    pub approach_s: f32,
    /// Cornering error, `e_c` in mm: the closest approach to the corner.
    pub error_mm: f32,
}

/// Solves for the longest cornering time that keeps the tolerance.
///
/// `x` is the time since the second segment started, `y` the time until the first one ends,
/// `t_c = x + y`. With `S`, `I` the step and ramp response of the second segment's prefilter
/// and `S₋`, `I₋` those of the first one's, run backwards in time:
///
/// ```text
/// a = F₁ I₋(y)   what is left of segment 1        f_DEC = F₁ S₋(y)
/// b = F₂ I(x)    what is done of segment 2        f_ACC = F₂ S(x)
/// P − P_c = [γ₁(L₁ − a) − P_c] + [γ₂(b) − P_c]
/// closest approach: (P − P_c) · (f_DEC u₁ + f_ACC u₂) changes sign   [Yeh26 Eq. 15]
/// cornering error:  e_c = min |P − P_c|                              [Yeh26 Eq. 16]
/// ```
///
/// Between lines, `e_c` is kept within the tolerance; no point of the command is further from
/// the path. Beside an arc that does not follow, since the path itself turns away: there the
/// distance of the whole corner from the path is kept within it, and with it `e_c`.
///
/// Lines and arcs are taken on their true geometry, with unequal feedrates and prefilters.
/// Where velocity jumps, the closest approach may be at the jump. If the tolerance is never
/// reached, the segments overlap as far as they can: `t_c = T_d1`, no dwell. Accuracy of the
/// times 20 µs; the error is never above the tolerance. Cost on a Cortex-M4F: below 60 000
/// instructions with half of the prefilters, up to 70 000 with FIR-3-hump-EI.
#[must_use]
pub fn solve(
    arriving: &Side,
    leaving: &Side,
    decelerating: &Response,
    accelerating: &Response,
    tolerance_mm: f32,
) -> Corner {
    let mut pair = Pair {
        arriving,
        leaving,
        decelerating,
        accelerating,
        samples: SAMPLES,
        sampling: SAMPLING,
    };
    let longest_s = decelerating.length_s();
    let target_mm = tolerance_mm * (1.0 - GUARD);
    let mut cornering_s = pair.longest_cornering_s(target_mm);
    let turn = pair.turn(cornering_s);
    if turn > MUCH_TURN {
        pair.samples = (SAMPLES + turn as usize).min(MOST_SAMPLES);
        pair.sampling = FINE_SAMPLING;
        cornering_s = pair.shortened(cornering_s, target_mm);
    }
    let approach = pair.closest_approach(cornering_s, APPROACH_WIDTH);
    let dwell_s = longest_s - cornering_s;
    Corner {
        deceleration_s: longest_s,
        cornering_s,
        dwell_s,
        approach_s: dwell_s + approach.leaving_s,
        error_mm: approach.error_mm,
    }
}

/// How far both sides of a corner stray from it at the same time, for each mm/s of feedrate.
///
/// `I(x) = I₋(t_c − x)`, in seconds, from 0 without overlap to below the prefilter's length.
#[must_use]
pub fn reach_s(decelerating: &Response, accelerating: &Response, cornering_s: f32) -> f32 {
    let x = crossing_s((decelerating, 1.0), (accelerating, 1.0), cornering_s);
    accelerating.at(x).1
}

/// When as much is done of the second segment as is left of the first, `F₁ I₋(t_c − x) = F₂ I(x)`.
fn crossing_s(
    (decelerating, arriving_mm_s): (&Response, f32),
    (accelerating, leaving_mm_s): (&Response, f32),
    cornering_s: f32,
) -> f32 {
    let gained_mm = |x: f32| {
        leaving_mm_s * accelerating.at(x).1 - arriving_mm_s * decelerating.at(cornering_s - x).1
    };
    if cornering_s <= 0.0 {
        return 0.0;
    }
    // nothing is done at the begin, and nothing left at the end
    sign_change(
        gained_mm,
        (0.0, -arriving_mm_s * decelerating.at(cornering_s).1),
        (cornering_s, leaving_mm_s * accelerating.at(cornering_s).1),
        CROSSING_WIDTH * cornering_s,
    )
    .above
}

/// The closest approach to a corner for a given cornering time.
#[derive(Clone, Copy, Debug)]
struct Approach {
    /// Since the second segment started, `x`.
    leaving_s: f32,
    error_mm: f32,
}

/// Two segments at their corner.
struct Pair<'a> {
    arriving: &'a Side,
    leaving: &'a Side,
    decelerating: &'a Response,
    accelerating: &'a Response,
    /// Of the deviation on either side of the crossing, beside an arc.
    samples: usize,
    /// What they are multiplied with, for what lies between them.
    sampling: f32,
}

impl Pair<'_> {
    /// The longest cornering time with which the miss is no more than that.
    fn longest_cornering_s(&self, target_mm: f32) -> f32 {
        let longest_s = self.decelerating.length_s();
        if target_mm <= 0.0 || longest_s <= 0.0 {
            return 0.0;
        }
        // the miss grows with a power of 1 to 3 of the time: its root is nearly straight
        let target = sqrt_f32(target_mm);
        let excess = |cornering_s: f32| sqrt_f32(self.miss_mm(cornering_s, target_mm)) - target;
        let widest = excess(longest_s);
        if widest <= 0.0 {
            return longest_s;
        }
        let (start, end) = ((0.0, -target), (longest_s, widest));
        straight_sign_change(excess, start, end, CORNERING_WIDTH_S).below
    }

    /// A cornering time, or a shorter one if it misses by more than that; 0 if that does not do.
    /// The miss grows at least in proportion to the time.
    fn shortened(&self, cornering_s: f32, target_mm: f32) -> f32 {
        let miss_mm = self.miss_mm(cornering_s, target_mm);
        if miss_mm <= target_mm {
            return cornering_s;
        }
        let shorter_s = cornering_s * SHORTENED * target_mm / miss_mm;
        if self.miss_mm(shorter_s, target_mm) <= target_mm {
            shorter_s
        } else {
            0.0
        }
    }

    /// By how many rad both segments turn within a corner.
    fn turn(&self, cornering_s: f32) -> f32 {
        if self.is_of_lines() {
            return 0.0;
        }
        self.arriving.turn(self.decelerating, cornering_s)
            + self.leaving.turn(self.accelerating, cornering_s)
    }

    /// How far the command misses for a cornering time: the corner itself between lines, any
    /// point of the path beside an arc.
    ///
    /// Where an arc ends within the corner, no point of the command is further from the path
    /// than the lesser of `a` and `b`, and the corner is missed by no more than when they are
    /// equal.
    ///
    /// Where it is above `enough_mm`, what is yielded is above it too, but may be less.
    fn miss_mm(&self, cornering_s: f32, enough_mm: f32) -> f32 {
        if self.is_of_lines() {
            return self.closest_approach(cornering_s, COARSE_WIDTH).error_mm;
        }
        let crossing_s = crossing_s(
            (self.decelerating, self.arriving.feed_mm_s),
            (self.accelerating, self.leaving.feed_mm_s),
            cornering_s,
        );
        let arriving_mm = self.arriving.feed_mm_s * self.decelerating.at(cornering_s).1;
        let leaving_mm = self.leaving.feed_mm_s * self.accelerating.at(cornering_s).1;
        if arriving_mm <= self.arriving.length_mm && leaving_mm <= self.leaving.length_mm {
            self.deviation_mm(cornering_s, crossing_s, enough_mm)
        } else {
            let least_mm = self.leaving.feed_mm_s * self.accelerating.at(crossing_s).1;
            least_mm.max(self.look_at_curves(cornering_s, crossing_s).0)
        }
    }

    fn is_of_lines(&self) -> bool {
        self.arriving.is_line() && self.leaving.is_line()
    }

    fn closest_approach(&self, cornering_s: f32, width: f32) -> Approach {
        if self.is_of_lines() {
            let turn = sum(self.leaving.tangent, scaled(self.arriving.tangent, -1.0));
            let squared_turn = dot(turn, turn);
            approach(cornering_s, width, |x| {
                self.look_at_lines(squared_turn, cornering_s, x)
            })
        } else {
            approach(cornering_s, width, |x| self.look_at_curves(cornering_s, x))
        }
    }

    /// Distance to the corner between lines, and half the change of its square in time.
    ///
    /// ```text
    /// |P − P_c|² = a² + b² − 2ab cos β = (a − b)² + ab |u₂ − u₁|²,   da/dt = −f_DEC, db/dt = f_ACC
    /// ```
    fn look_at_lines(&self, squared_turn: f32, cornering_s: f32, x: f32) -> (f32, f32) {
        let (deceleration, remaining_s) = self.decelerating.at(cornering_s - x);
        let (acceleration, done_s) = self.accelerating.at(x);
        let (a, slower) = (
            self.arriving.feed_mm_s * remaining_s,
            self.arriving.feed_mm_s * deceleration,
        );
        let (b, faster) = (
            self.leaving.feed_mm_s * done_s,
            self.leaving.feed_mm_s * acceleration,
        );
        let ahead = b - a;
        (
            sqrt_f32(ahead * ahead + a * b * squared_turn),
            ahead * (slower + faster) + 0.5 * squared_turn * (a * faster - b * slower),
        )
    }

    /// Distance to a corner at an arc, and half the change of its square in time.
    fn look_at_curves(&self, cornering_s: f32, x: f32) -> (f32, f32) {
        let (deceleration, remaining_s) = self.decelerating.at(cornering_s - x);
        let (acceleration, done_s) = self.accelerating.at(x);
        let arriving_mm_s = self.arriving.feed_mm_s;
        let leaving_mm_s = self.leaving.feed_mm_s;
        let first = self.arriving.before_the_corner(arriving_mm_s * remaining_s);
        let second = self.leaving.after_the_corner(leaving_mm_s * done_s);
        let offset = sum(first.offset, second.offset);
        let velocity = sum(
            scaled(first.tangent, arriving_mm_s * deceleration),
            scaled(second.tangent, leaving_mm_s * acceleration),
        );
        (length(offset), dot(offset, velocity))
    }

    /// The largest distance of the command from the path point that is as far along the path
    /// as both segments together.
    ///
    /// ```text
    /// |P − γ(s̄)|,   s̄ = L₁ − a + b:   on segment 1 while a > b, then on segment 2
    /// ```
    ///
    /// It peaks where `a = b` at a sharp corner, beside it where an arc bends the path; there
    /// it is sampled, and a factor covers what lies between samples. Where it is more than
    /// `enough_mm` at the crossing, the samples are spared.
    fn deviation_mm(&self, cornering_s: f32, crossing_s: f32, enough_mm: f32) -> f32 {
        let (at_crossing_mm, _) = self.look_at_curves(cornering_s, crossing_s);
        if at_crossing_mm > enough_mm {
            return at_crossing_mm;
        }
        let at = |x: f32| {
            let left_mm = self.arriving.feed_mm_s * self.decelerating.at(cornering_s - x).1;
            let done_mm = self.leaving.feed_mm_s * self.accelerating.at(x).1;
            let first = self.arriving.before_the_corner(left_mm).offset;
            let second = self.leaving.after_the_corner(done_mm).offset;
            let along = if left_mm > done_mm {
                self.arriving.before_the_corner(left_mm - done_mm)
            } else {
                self.leaving.after_the_corner(done_mm - left_mm)
            };
            length(sum(sum(first, second), scaled(along.offset, -1.0)))
        };
        let mut beside_mm = 0.0_f32;
        for i in 1..=self.samples {
            let share = i as f32 / (self.samples + 1) as f32;
            let before = at(crossing_s * share);
            let after = at(crossing_s + (cornering_s - crossing_s) * share);
            beside_mm = beside_mm.max(before).max(after);
        }
        at_crossing_mm.max(beside_mm * self.sampling)
    }
}

/// The least distance, where its change (the second of what `look` gives) turns positive.
fn approach(cornering_s: f32, width: f32, look: impl Fn(f32) -> (f32, f32)) -> Approach {
    let (error_start, slope_start) = look(0.0);
    if slope_start >= 0.0 {
        // a velocity jump turns away from the corner at once, or there is no overlap
        return Approach {
            leaving_s: 0.0,
            error_mm: error_start,
        };
    }
    let (error_end, slope_end) = look(cornering_s);
    if slope_end < 0.0 {
        return Approach {
            leaving_s: cornering_s,
            error_mm: error_end,
        };
    }
    // near the closest approach the distance hardly changes: its change tells when, and the
    // least distance seen how close
    let mut error_mm = error_start.min(error_end);
    let bracket = sign_change(
        |x| {
            let (distance_mm, slope) = look(x);
            error_mm = error_mm.min(distance_mm);
            slope
        },
        (0.0, slope_start),
        (cornering_s, slope_end),
        width * cornering_s,
    );
    Approach {
        leaving_s: bracket.above,
        error_mm,
    }
}

/// A point of a segment relative to the corner.
struct Point {
    offset: [f32; 3],
    tangent: [f32; 3],
}

impl Side {
    fn is_line(&self) -> bool {
        self.heading_rate_per_mm == 0.0
    }

    /// By how many rad its heading turns within `cornering_s`.
    fn turn(&self, response: &Response, cornering_s: f32) -> f32 {
        let way_mm = self.feed_mm_s * response.at(cornering_s).1;
        (self.heading_rate_per_mm * way_mm).abs()
    }

    /// The point of the leaving segment `distance_mm` after the corner.
    fn after_the_corner(&self, distance_mm: f32) -> Point {
        curve(
            self.tangent,
            self.heading_rate_per_mm,
            distance_mm.min(self.length_mm),
        )
    }

    /// The point of the arriving segment `distance_mm` before the corner: the curve that
    /// turns the other way, walked backwards.
    fn before_the_corner(&self, distance_mm: f32) -> Point {
        let Point { offset, tangent } = curve(
            self.tangent,
            -self.heading_rate_per_mm,
            distance_mm.min(self.length_mm),
        );
        Point {
            offset: scaled(offset, -1.0),
            tangent,
        }
    }
}

/// `∫₀ᵈ` of the tangent `u` whose heading turns by `k` a millimetre, and the tangent at `d`:
///
/// ```text
/// offset = (sin kd / k) u + ((1 − cos kd) / k) n,    n = u turned by 90° in the XY plane
/// ```
fn curve(u: [f32; 3], k: f32, d: f32) -> Point {
    let [ux, uy, uz] = u;
    if k == 0.0 {
        return Point {
            offset: scaled(u, d),
            tangent: u,
        };
    }
    let (sin, cos) = sin_cos_f32(k * d);
    let (along, across) = (sin / k, (1.0 - cos) / k);
    Point {
        offset: [along * ux - across * uy, along * uy + across * ux, d * uz],
        tangent: [cos * ux - sin * uy, cos * uy + sin * ux, uz],
    }
}

fn sum(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn scaled(a: [f32; 3], by: f32) -> [f32; 3] {
    a.map(|value| value * by)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: [f32; 3]) -> f32 {
    sqrt_f32(dot(a, a))
}
