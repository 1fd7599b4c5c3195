//! How far two segments overlap at their corner.

use super::segment::Segment;
use super::speed_curve::SpeedCurve;
use super::{difference, norm};
use crate::corner::{self, CornerRule};

/// How the overlap follows from a tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Eq. 35 of \[Li23\]: at unequal feedrates it overlaps less than it could.
    #[default]
    ClosedForm,
    /// The closest approach to the corner, by [`corner::solve`]. It never overlaps more than the
    /// tolerance allows, and 20 µs less at the most.
    Exact,
}

/// How long before the end of one segment the next one begins, in seconds, up to the length of
/// the curve.
///
/// ```text
/// ε = |J₁u₁ − J₂u₂| T_ol³ / 48,  J = F / T_rr²                        [Li23 Eq. 35]
/// T_ol = (48 ε / |J₁u₁ − J₂u₂|)^⅓ ≤ 2 T_rr,   OVLP = 100 (T_ol / 2T_rr)² %
/// one box:  ε = |A₁u₁ − A₂u₂| T_ol² / 8,  A = F / τ
/// ```
///
/// A tolerance says nothing about a tool that only turns: beside such a segment it stops. Cost on a
/// Cortex-M4F 8 000 instructions in closed form, 26 000 exactly.
#[must_use]
pub fn overlap_s(
    curve: &SpeedCurve,
    arriving: &Segment,
    leaving: &Segment,
    rule: CornerRule,
    method: Method,
) -> f64 {
    let tolerance_mm = match rule {
        CornerRule::OverlapPercent(percent) => {
            let share = (f64::from(percent) / 100.0).clamp(0.0, 1.0);
            return curve.length_s() * libm::sqrt(share);
        }
        CornerRule::ToleranceMm(mm) => f64::from(mm),
    };
    if arriving.length_mm() <= 0.0 || leaving.length_mm() <= 0.0 || tolerance_mm <= 0.0 {
        return 0.0;
    }
    if method == Method::Exact {
        let prefilter = curve.prefilter();
        let found = corner::solve(
            &arriving.side(),
            &leaving.side(),
            &prefilter.reversed_response(),
            &prefilter.response(),
            tolerance_mm as f32,
        );
        return f64::from(found.cornering_s);
    }
    let velocity = |segment: &Segment| segment.direction.map(|part| part * segment.feed_mm_s());
    let turn_mm_s = norm(difference(velocity(arriving), velocity(leaving)));
    let box_s = curve.box_s();
    let longest_s = if curve.is_s_curve() {
        libm::cbrt(48.0 * tolerance_mm * box_s * box_s / turn_mm_s)
    } else {
        libm::sqrt(8.0 * tolerance_mm * box_s / turn_mm_s)
    };
    // straight on there is nothing to miss: the quotient is infinite
    longest_s.min(curve.length_s())
}
