//! How fast the arms of a delta robot can be made to move by a tool anywhere in a region.
//!
//! As for a SCARA ([`super::RateBounds`]), by the norms of the first three derivatives g, H, D of
//! each arm's angle θ with respect to the tool's place; the fourth axis is the yaw itself. With
//! the names of [`super::Delta`], and `f̂ = f/s`, the derivatives of `f² = l2²` along a straight
//! motion with velocity v are
//!
//! ```text
//! θ'   = f̂·v / l1
//! θ''  = vᵀM v / (l1 s),   M = I − (f̂ tᵀ + t f̂ᵀ) + μ f̂ f̂ᵀ,   μ = m / l1
//! θ''' = [−3 θ'' (t − μ f̂)·v + (3 n + f/l1)·v (f̂·v)² / l1²] / s
//! ```
//!
//! with n along the upper arm. As `f̂ = t + √(w−1) e` with e square to t, `w = l2²/s² ≥ 1`, the
//! eigenvalues of M are 1 and the roots of `λ² − μwλ + (μ−1)w = 0`, of which the larger in
//! magnitude is at least 1. So
//!
//! ```text
//! ‖g‖ = l2 / (l1 s)
//! ‖H‖ = N / (l1 s),   N = |μ|w/2 + √((μw/2 − 1)² + w − 1)
//! ‖D‖ ≤ [3 N √((1−μ)² + μ²(w−1)) / (l1 s) + w √(3 + 6μ + l2²/l1²) / l1²] / s
//! ```
//!
//! All of them grow with w, that is as s falls, and are convex functions of μ, so that over
//! intervals of both they are largest at the least s and one of the ends of μ. Both follow from
//! how far the tool is from the shoulder, `q`, and from the plane of the arm, `a`:
//!
//! ```text
//! μ = (q² + l1² − l2²) / (2 l1²),   s² = q² − l1²μ² − a²
//! ```
//!
//! The first two terms are a concave function of q²: least at the ends of an interval.

use super::delta::{ARMS, Delta, directions_of};
use super::rate_bounds::RateBounds;
use super::scara::MM_PER_LSB;
use crate::math::sqrt_f32;

/// Pieces into which a long way is divided.
const PIECES: usize = 6;

/// A way is divided into pieces of so much or more.
const PIECE_MM: f32 = 50.0;

/// The least `s²` that a command comes to, as a part of what the serial margin allows: what is
/// left is for corners, which are rounded inside of the path.
const FLOOR: f32 = 0.8;

/// The furthest that a command may stray from the path, as a part of the upper arm.
const STRAY: f32 = 0.25;

/// What a tool passes: a curve, or all that is above it up to a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Places on the curve; between two of them it is as good as straight.
    stations: [[f32; 3]; PIECES + 1],
    pieces: usize,
    /// How far it is from straight in between.
    bent_mm: f32,
    /// The height above the curve.
    rise_mm: f32,
}

impl Sweep {
    /// The curve that is `at(u)` for `u` from 0 to 1, of such a length and largest curvature.
    #[must_use]
    pub fn new(length_mm: f32, curvature_per_mm: f32, at: impl Fn(f32) -> [f32; 3]) -> Self {
        let pieces = ((length_mm / PIECE_MM) as usize).clamp(1, PIECES);
        let per = 1.0 / pieces as f32;
        let mut stations = [[0.0; 3]; PIECES + 1];
        for (station, place) in stations.iter_mut().take(pieces + 1).enumerate() {
            *place = at(station as f32 * per);
        }
        let piece_mm = length_mm * per;
        Self {
            stations,
            pieces,
            // the sagitta of an arc
            bent_mm: 0.125 * curvature_per_mm * piece_mm * piece_mm,
            rise_mm: 0.0,
        }
    }

    /// The same with all that is above it up to a height.
    #[must_use]
    pub fn raised(self, rise_mm: f32) -> Self {
        Self { rise_mm, ..self }
    }

    fn stations(&self) -> impl Iterator<Item = &[f32; 3]> {
        self.stations.iter().take(self.pieces + 1)
    }
}

/// Where a piece is, seen from an arm, in mm.
#[derive(Clone, Copy, Debug, Default)]
struct Span {
    /// Least and largest q; their squares while they are being found.
    near: f32,
    far: f32,
    /// Largest a.
    across: f32,
}

impl Span {
    fn of_place(delta: &DeltaBounds, arm: u8, [x, y, z]: [f32; 3]) -> Self {
        let (ux, uy) = directions_of(arm);
        let across = x * uy - y * ux;
        let outward = x * ux + y * uy - delta.offset_mm;
        let square = outward * outward + across * across + z * z;
        Self {
            near: square,
            far: square,
            across: across.abs(),
        }
    }

    fn with(self, other: Self) -> Self {
        Self {
            near: -larger(-self.near, -other.near),
            far: larger(self.far, other.far),
            across: larger(self.across, other.across),
        }
    }
}

/// A sweep as the three arms see it.
#[derive(Clone, Copy, Debug)]
pub struct Spans {
    /// One for each piece, of each arm.
    arms: [[Span; PIECES]; ARMS],
    pieces: usize,
}

/// The shape of the robot, for bounds.
#[derive(Clone, Copy, Debug)]
pub struct DeltaBounds {
    offset_mm: f32,
    upper_arm_mm: f32,
    forearm_mm: f32,
    /// `l2² − l1²`.
    excess: f32,
    /// Least `s²` of a programmed path, and of a command.
    programmed: f32,
    floor: f32,
    /// By how much `s²` can fall for each mm that a command strays.
    steepest_mm: f32,
}

impl DeltaBounds {
    /// How far each arm turns for each mm of the tool, with the forearm square to the upper arm
    /// and to the shoulder's axis, in rad/mm.
    #[must_use]
    pub fn square(&self) -> f32 {
        1.0 / self.upper_arm_mm
    }

    /// How far from a path, whose poses have all been checked, a command may stray so that its
    /// bounds hold, in mm.
    #[must_use]
    pub fn spare_mm(&self, sweep: &Sweep) -> f32 {
        let spans = self.spans(sweep);
        let all = spans
            .arms
            .iter()
            .flat_map(|arm| arm.iter().take(spans.pieces));
        let least = all.fold(f32::INFINITY, |least, span| {
            least.min(self.least_squared(span, 0.0).0)
        });
        let spare_mm = (least.max(self.programmed) - self.floor) / self.steepest_mm;
        spare_mm.min(STRAY * self.upper_arm_mm)
    }

    /// Bounds for the three arms, wherever the tool is within `reach_mm` of what it passes. Finite
    /// everywhere.
    ///
    /// Exact for g and H where the region is a point. D is there at most twice what it has to be for
    /// the default robot, and four times where forearms are shorter than upper arms.
    /// Cost on a Cortex-M4F: some 1800 instructions a piece, of which a way has up to 6.
    #[must_use]
    pub fn within(&self, spans: &Spans, reach_mm: f32) -> [RateBounds; ARMS] {
        spans.arms.each_ref().map(|arm| {
            let pieces = arm.iter().take(spans.pieces);
            pieces.fold(RateBounds::default(), |bound, span| {
                let (squared, ends) = self.least_squared(span, reach_mm);
                bound.larger(self.norms(larger(squared, self.floor), ends))
            })
        })
    }

    /// A sweep as the arms see it.
    #[must_use]
    pub fn spans(&self, sweep: &Sweep) -> Spans {
        let mut spans = Spans {
            arms: [[Span::default(); PIECES]; ARMS],
            pieces: sweep.pieces,
        };
        for (arm, spans) in (1..).zip(&mut spans.arms) {
            let seen = |[x, y, z]: [f32; 3]| {
                let low = Span::of_place(self, arm, [x, y, z]);
                if sweep.rise_mm == 0.0 {
                    return low;
                }
                low.with(Span::of_place(self, arm, [x, y, z + sweep.rise_mm]))
            };
            let ends = sweep.stations().zip(sweep.stations().skip(1));
            for (span, (from, to)) in spans.iter_mut().zip(ends) {
                *span = seen(*from).with(seen(*to));
                // between the ends of a chord, q² is up to a quarter of its square less
                let mut squares = sweep.rise_mm * sweep.rise_mm;
                for (from, to) in from.iter().zip(to) {
                    squares += (to - from) * (to - from);
                }
                span.near = sqrt_f32((span.near - 0.25 * squares).max(0.0)) - sweep.bent_mm;
                span.far = sqrt_f32(span.far) + sweep.bent_mm;
                span.across += sweep.bent_mm;
            }
        }
        spans
    }

    /// The least `s²` within a reach of a piece, and the ends of μ there.
    fn least_squared(&self, span: &Span, reach_mm: f32) -> (f32, [f32; 2]) {
        let shortest_mm = (self.forearm_mm - self.upper_arm_mm).abs();
        let longest_mm = self.forearm_mm + self.upper_arm_mm;
        let near_mm = (span.near - reach_mm).clamp(shortest_mm, longest_mm);
        let far_mm = (span.far + reach_mm).clamp(shortest_mm, longest_mm);
        let across_mm = span.across + reach_mm;
        let per = 0.5 / self.upper_arm_mm;
        let [near, far] = [near_mm, far_mm].map(|distance_mm| {
            let square = distance_mm * distance_mm;
            let along_mm = (square - self.excess) * per;
            // differences of squares lose digits: to the safe side
            let rounding = 5e-7 * (square + along_mm * along_mm);
            (square - along_mm * along_mm - rounding, along_mm)
        });
        let squared = -larger(-near.0, -far.0) - across_mm * across_mm;
        (squared, [near.1, far.1].map(|along| along * 2.0 * per))
    }

    /// The norms where `s²` is at least `squared` and μ between the ends.
    fn norms(&self, squared: f32, ends: [f32; 2]) -> RateBounds {
        let (per_root, per_arm) = (1.0 / sqrt_f32(squared), 1.0 / self.upper_arm_mm);
        let ratio = self.forearm_mm * per_root;
        let w = larger(ratio * ratio, 1.0);
        let [low, high] = ends;
        // N is least at μ = 0
        let bend = |mu: f32| {
            let half = 0.5 * mu * w;
            half.abs() + sqrt_f32((half - 1.0) * (half - 1.0) + (w - 1.0))
        };
        let bend = match (low < 0.0, high > 0.0) {
            (true, true) => larger(bend(low), bend(high)),
            (true, false) => bend(low),
            (false, _) => bend(high),
        };
        let turn = |mu: f32| (1.0 - mu) * (1.0 - mu) + mu * mu * (w - 1.0);
        let turn = sqrt_f32(larger(turn(low), turn(high)));
        let lengths = self.forearm_mm * per_arm;
        let rest = sqrt_f32(larger(3.0 + 6.0 * high + lengths * lengths, 0.0));
        let per_both = per_root * per_arm;
        RateBounds {
            first: ratio * per_arm,
            second: bend * per_both,
            third: (3.0 * bend * turn * per_both + w * rest * per_arm * per_arm) * per_root,
        }
    }
}

/// The larger of two numbers: without the call that `f32::max` is on a Cortex-M4F.
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Delta {
    /// The shape of the robot, for bounds. Not for the tick.
    #[must_use]
    pub fn bounds(&self) -> DeltaBounds {
        let (arm_mm, forearm_mm) = (self.upper_arm_mm, self.forearm_mm);
        let least_mm = self.root_min as f32 * MM_PER_LSB;
        let programmed = least_mm * least_mm;
        // |dF/dq| = 2 q |1 − μ| of F = q² − l1²μ², wherever a command may stray, and d(a²)/da
        let stray_mm = STRAY * arm_mm;
        let longest_mm = arm_mm + forearm_mm + stray_mm;
        let shortest_mm = ((forearm_mm - arm_mm).abs() - stray_mm).max(0.0);
        let excess = (forearm_mm - arm_mm) * (forearm_mm + arm_mm);
        let turned = [shortest_mm, longest_mm].map(|distance_mm| {
            let mu = 0.5 * (distance_mm * distance_mm - excess) / (arm_mm * arm_mm);
            (1.0 - mu).abs()
        });
        let [low, high] = turned;
        DeltaBounds {
            offset_mm: self.offset_mm,
            upper_arm_mm: arm_mm,
            forearm_mm,
            excess,
            programmed,
            floor: FLOOR * programmed,
            steepest_mm: 2.0 * longest_mm * low.max(high) + 2.0 * forearm_mm + stray_mm,
        }
    }
}
