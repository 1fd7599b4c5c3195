//! How fast the joints can be made to move, turn up and jerk by a tool anywhere in a region.
//!
//! Joint angles are functions `q(x, y)` of the tool's place. Along any motion of it
//!
//! ```text
//! q̇ = g·ċ,   q̈ = g·c̈ + H[ċ, ċ],   q⃛ = g·c⃛ + 3 H[ċ, c̈] + D[ċ, ċ, ċ]
//! ```
//!
//! with the gradient g, the second derivative H and the third one D; their norms bound the
//! joints whatever the direction. A SCARA looks the same from every side, so that the norms
//! depend on the radius r alone. In polar coordinates each angle is `q = a φ + F(r)`, with
//! a = 1 for θ1 and θ12 = θ1 + θ2, and a = 0 for θ2, and
//!
//! ```text
//! F' = N / S,   S = l1 l2 sin θ2 = ½ √((r² − (l1−l2)²) ((l1+l2)² − r²))
//! N = (r + (l2² − l1²)/r)/2 for θ1,   −r for θ2,   −(r − (l2² − l1²)/r)/2 for θ12
//! ‖g‖ = l2/S, r/S, l1/S
//! H_rr = F''    H_rt = −a/r²    H_tt = F'/r
//! D_rrr = F'''  D_rrt = 2a/r³   D_rtt = (F'' − F'/r)/r   D_ttt = −2a/r³
//! ```
//!
//! H is measured by its spectral norm, D by `√(D_rrr² + 3 D_rrt² + 3 D_rtt² + D_ttt²)`, which is
//! at least `|D[u, u, u]|` for every unit vector u, and at most twice it for one. All nine norms fall and then rise with r,
//! so that over an interval each is largest at one of its ends: a test shows it for arms with
//! links of 1 : 10 to 10 : 1.

use super::delta_bounds::larger;
use super::scara::{MM_PER_LSB, Scara};
use crate::math::{ONE_Q30, sin_cos, sqrt_f32, turns};
use crate::units::AngleRad;

/// Bounds on the derivatives of one joint's position with respect to the tool's place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateBounds {
    /// `‖g‖` in rad/mm.
    pub first: f32,
    /// `‖H‖` in rad/mm².
    pub second: f32,
    /// `‖D‖` in rad/mm³.
    pub third: f32,
}

impl RateBounds {
    pub(super) fn larger(self, other: Self) -> Self {
        Self {
            first: larger(self.first, other.first),
            second: larger(self.second, other.second),
            third: larger(self.third, other.third),
        }
    }
}

/// A ring around the shoulder, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Its inner radius.
    pub inner_mm: f32,
    /// Its outer radius.
    pub outer_mm: f32,
}

/// The shape of the arm, for bounds.
#[derive(Clone, Copy, Debug)]
pub struct RingBounds {
    link1_mm: f32,
    link2_mm: f32,
    /// `(l1 − l2)²` and `(l1 + l2)²`.
    inner_squared: f32,
    outer_squared: f32,
    /// Least `r² − (l1 − l2)²` and `(l1 + l2)² − r²` that a command comes to.
    inner_gap: f32,
    outer_gap: f32,
    /// Where the tool may be programmed.
    programmed: Ring,
    /// Half the width that the singularity margin leaves inside of it.
    spare_mm: f32,
}

impl RingBounds {
    /// Where the joints' travels and the singularity margin let the tool be programmed.
    #[must_use]
    pub const fn programmed(&self) -> Ring {
        self.programmed
    }

    /// Lengths of upper arm and forearm.
    #[must_use]
    pub const fn links_mm(&self) -> (f32, f32) {
        (self.link1_mm, self.link2_mm)
    }

    /// How far inside of that ring a command may stray that rounds a corner: half way to the
    /// folded arm.
    #[must_use]
    pub const fn spare_mm(&self) -> f32 {
        self.spare_mm
    }

    /// How far joints 1 and 2 and their sum turn for each mm of the tool, with the forearm
    /// square to the upper arm, in rad/mm.
    #[must_use]
    pub fn square(&self) -> [f32; 3] {
        let (l1, l2) = (self.link1_mm, self.link2_mm);
        [1.0 / l1, sqrt_f32(l1 * l1 + l2 * l2) / (l1 * l2), 1.0 / l2]
    }

    /// Bounds for joints 1 and 2 and for their sum, which turns joint 4 back, wherever the tool
    /// is in a ring, clipped to where a command can be. Finite for every ring.
    #[must_use]
    pub fn within(&self, ring: Ring) -> [RateBounds; 3] {
        let inner_mm = ring.inner_mm.max(self.programmed.inner_mm - self.spare_mm);
        let outer_mm = ring.outer_mm.min(self.programmed.outer_mm);
        let (at_inner, at_outer) = (self.at(inner_mm), self.at(outer_mm));
        let mut bounds = at_inner;
        for (bound, other) in bounds.iter_mut().zip(at_outer) {
            *bound = bound.larger(other);
        }
        bounds
    }

    /// The norms at a radius.
    fn at(&self, radius_mm: f32) -> [RateBounds; 3] {
        let r = radius_mm.max(1e-3);
        let square = r * r;
        // Differences of squares lose digits near the ends of the reach: to the safe side.
        let rounding = self.outer_squared * 2.4e-7;
        let from_inner = (square - self.inner_squared - rounding).max(self.inner_gap);
        let to_outer = (self.outer_squared - square - rounding).max(self.outer_gap);
        let (per_r, slope) = (1.0 / r, to_outer - from_inner);
        // S and its derivatives: S S' = r slope / 4, S'² + S S'' = (slope − 4 r²) / 4
        let s = 0.5 * sqrt_f32(from_inner * to_outer);
        let per_s = 1.0 / s;
        let s1 = 0.25 * r * slope * per_s;
        let s2 = (0.25 * slope - square - s1 * s1) * per_s;
        let (t1, t2) = (s1 * per_s, s2 * per_s);

        let lopsided = (self.link2_mm - self.link1_mm) * (self.link2_mm + self.link1_mm) * per_r;
        let bend = lopsided * per_r;
        let numerators = [
            (0.5 * (r + lopsided), 0.5 * (1.0 - bend), bend * per_r, 1.0),
            (-r, -1.0, 0.0, 0.0),
            (
                -0.5 * (r - lopsided),
                -0.5 * (1.0 + bend),
                bend * per_r,
                1.0,
            ),
        ];
        let first = [self.link2_mm, r, self.link1_mm].map(|length| length * per_s);
        let mut bounds = [RateBounds::default(); 3];
        for ((bound, (n, n1, n2, a)), first) in bounds.iter_mut().zip(numerators).zip(first) {
            let f1 = n * per_s;
            let f2 = (n1 - n * t1) * per_s;
            let f3 = (n2 - 2.0 * n1 * t1 + n * (2.0 * t1 * t1 - t2)) * per_s;
            let (rr, tt) = (f2, f1 * per_r);
            let rt = a * per_r * per_r;
            let half = 0.5 * (rr - tt);
            let (rrt, rtt) = (2.0 * rt * per_r, (rr - tt) * per_r);
            *bound = RateBounds {
                first,
                second: 0.5 * (rr + tt).abs() + sqrt_f32(half * half + rt * rt),
                third: sqrt_f32(f3 * f3 + 3.0 * rtt * rtt + 4.0 * rrt * rrt),
            };
        }
        bounds
    }
}

impl Scara {
    /// The shape of the arm, for bounds. Not for the tick.
    #[must_use]
    pub fn ring_bounds(&self) -> RingBounds {
        let (link1_mm, link2_mm) = (
            self.link1 as f32 * MM_PER_LSB,
            self.link2 as f32 * MM_PER_LSB,
        );
        let product = 2.0 * link1_mm * link2_mm;
        let cosine = |bits: i32| sin_cos(turns(AngleRad::from_bits(bits))).1;
        let (bend_min, bend_max) = self.elbow_range();
        // From the cosines and not from radii, which would lose digits.
        let share = |difference: i32| difference as f32 / ONE_Q30 as f32;
        let from_inner = product * share(ONE_Q30.saturating_add(cosine(bend_max)));
        let outer_gap = product * share(ONE_Q30.saturating_sub(cosine(bend_min)));
        let inner_mm = (link1_mm - link2_mm).abs();
        let reach_mm = link1_mm + link2_mm;
        let (inner_squared, outer_squared) = (inner_mm * inner_mm, reach_mm * reach_mm);
        let programmed = Ring {
            inner_mm: sqrt_f32(inner_squared + from_inner),
            outer_mm: sqrt_f32(outer_squared - outer_gap),
        };
        let spare_mm = 0.5 * (programmed.inner_mm - inner_mm);
        let strayed_mm = programmed.inner_mm - spare_mm;
        RingBounds {
            link1_mm,
            link2_mm,
            inner_squared,
            outer_squared,
            inner_gap: (strayed_mm - inner_mm) * (strayed_mm + inner_mm) * 0.999,
            outer_gap: outer_gap * 0.9999,
            programmed,
            spare_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ScaraConfig;
    use super::*;

    fn bounds(ratio: f32) -> RingBounds {
        let config = ScaraConfig {
            link1_mm: 100.0,
            link2_mm: 100.0 * ratio,
            singularity_margin_deg: 0.5,
            joint_limits: ScaraConfig::default().joint_limits.map(|mut range| {
                (range.min, range.max) = (range.min * 1.05, range.max * 1.05);
                range
            }),
            ..ScaraConfig::default()
        };
        Scara::new(&config).expect("a possible arm").ring_bounds()
    }

    /// θ1, θ2, θ12 by the law of cosines.
    fn angles(l1: f64, l2: f64, [x, y]: [f64; 2]) -> [f64; 3] {
        let square = x * x + y * y;
        let bend = ((square - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)).acos();
        let upper = y.atan2(x) - (l2 * bend.sin()).atan2(l1 + l2 * bend.cos());
        [upper, bend, upper + bend]
    }

    /// Derivatives 1 to 3 along a straight line through (r, 0), by differences.
    fn along(l1: f64, l2: f64, r: f64, direction: f64) -> [[f64; 3]; 3] {
        let h = 0.02 * (r - (l1 - l2).abs()).min(l1 + l2 - r);
        let at = |k: f64| {
            let (sin, cos) = direction.sin_cos();
            angles(l1, l2, [r + k * h * cos, k * h * sin])
        };
        let q = [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0].map(at);
        core::array::from_fn(|joint| {
            let q = q.map(|angles| angles[joint]);
            [
                (45.0 * (q[4] - q[2]) - 9.0 * (q[5] - q[1]) + q[6] - q[0]) / (60.0 * h),
                (270.0 * (q[4] + q[2]) - 27.0 * (q[5] + q[1]) + 2.0 * (q[6] + q[0]) - 490.0 * q[3])
                    / (180.0 * h * h),
                (-13.0 * (q[4] - q[2]) + 8.0 * (q[5] - q[1]) - (q[6] - q[0])) / (8.0 * h * h * h),
            ]
        })
    }

    #[test]
    fn norms_bound_the_derivatives_in_every_direction_and_are_met_in_one() {
        for ratio in [0.3, 0.75, 1.0, 1.8] {
            let shape = bounds(ratio);
            let (l1, l2) = (f64::from(shape.link1_mm), f64::from(shape.link2_mm));
            let (low, high) = ((l1 - l2).abs(), l1 + l2);
            for step in 1..20 {
                let r = low + (high - low) * f64::from(step) / 20.0;
                let found = shape.at(r as f32);
                let mut largest = [[0.0_f64; 3]; 3];
                for turn in 0..72 {
                    let derivatives = along(l1, l2, r, f64::from(turn) * 0.087_266);
                    for (largest, values) in largest.iter_mut().zip(derivatives) {
                        for (largest, value) in largest.iter_mut().zip(values) {
                            *largest = largest.max(value.abs());
                        }
                    }
                }
                for (largest, bound) in largest.into_iter().zip(found) {
                    let bound = [bound.first, bound.second, bound.third].map(f64::from);
                    for (order, (value, bound)) in largest.into_iter().zip(bound).enumerate() {
                        assert!(
                            value <= bound * 1.003,
                            "{ratio} {r} {order}: {value} {bound}"
                        );
                        // the norm of D is no spectral norm
                        let met = [0.995, 0.995, 0.49][order];
                        assert!(value >= bound * met, "{ratio} {r} {order}: {value} {bound}");
                    }
                }
            }
        }
    }

    #[test]
    fn over_an_interval_each_norm_is_largest_at_an_end() {
        for ratio in [
            0.1, 0.2, 0.35, 0.5, 0.7, 0.75, 0.9, 0.99, 1.0, 1.01, 1.3, 2.0, 4.0, 10.0,
        ] {
            let shape = bounds(ratio);
            let Ring { inner_mm, outer_mm } = shape.programmed();
            let count = 3000;
            let radius = |i: u32| {
                // evenly over joint 2, which resolves both ends
                let turn = core::f32::consts::PI * i as f32 / count as f32;
                inner_mm + (outer_mm - inner_mm) * 0.5 * (1.0 - turn.cos())
            };
            let norms: std::vec::Vec<_> = (0..=count)
                .map(|i| shape.at(radius(i)))
                .map(|all| all.map(|bound| [bound.first, bound.second, bound.third]))
                .collect();
            for joint in 0..3 {
                for order in 0..3 {
                    // falls, then rises: no value above both neighbours by more than rounding
                    let column = norms.iter().map(|all| all[joint][order]);
                    let mut lowest = f32::INFINITY;
                    let mut highest_since = 0.0_f32;
                    for value in column {
                        assert!(
                            value > highest_since * 0.9995,
                            "{ratio}: joint {joint}, order {order}"
                        );
                        if value < lowest {
                            lowest = value;
                            highest_since = 0.0;
                        } else {
                            highest_since = highest_since.max(value);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn every_ring_has_finite_bounds() {
        let shape = bounds(0.75);
        for (inner_mm, outer_mm) in [(0.0, 0.0), (-1e6, 1e6), (200.0, 100.0), (0.0, 1e9)] {
            for bound in shape.within(Ring { inner_mm, outer_mm }) {
                assert!(bound.first.is_finite() && bound.third.is_finite());
            }
        }
    }
}
