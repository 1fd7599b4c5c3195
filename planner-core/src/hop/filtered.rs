//! A motion from rest to rest as it leaves the prefilter, exactly.

use super::ramp::Ramp;
use crate::prefilter::{Prefilter, Stage, Term, Terms, add_terms, boxes};

/// Steps of halving: to a microsecond within a minute.
const HALVINGS: u32 = 26;

/// When a ramp has come so far behind a prefilter, or behind none, in seconds since its begin.
///
/// Not inlined, so that the terms are on the stack for a moment only.
#[inline(never)]
pub(super) fn times_s<const N: usize>(
    ramp: &Ramp,
    prefilter: Option<&Prefilter>,
    progress: [f64; N],
) -> [f64; N] {
    let mut terms = Terms::new();
    // a prefilter that has a response has these too
    add_terms(&mut terms, stages(prefilter), false);
    let filtered = Filtered::new(ramp, prefilter, &terms);
    progress.map(|progress| filtered.time_of(progress))
}

/// A [`Ramp`] behind a prefilter, or behind none.
///
/// ```text
/// u(t) = Σ c_k Σ± (t − b_k − …)₊ⁿ / n!,    n = 3 + boxes of the prefilter
/// ```
/// with the prefilter's impulses and the edges of its boxes as `b_k`, and the eight edges of the
/// ramp's boxes in the inner sum.
struct Filtered<'t> {
    /// Those of the prefilter's ramp response.
    terms: &'t [Term],
    boxes_s: [f64; 3],
    degree: i32,
    /// When it has ended.
    end_s: f64,
}

impl<'t> Filtered<'t> {
    /// What the prefilter, whose terms these are, makes of a ramp.
    fn new(ramp: &Ramp, prefilter: Option<&Prefilter>, terms: &'t [Term]) -> Self {
        let boxes_s = ramp.boxes_s();
        Self {
            terms,
            boxes_s,
            degree: 3 + boxes(stages(prefilter)) as i32,
            end_s: boxes_s.iter().sum::<f64>() + prefilter.map_or(0.0, Prefilter::length_s),
        }
    }

    /// How far it has come, from 0 to 1.
    ///
    /// Not inlined: unrolled in every search it would take 8 KB.
    #[inline(never)]
    fn at(&self, time_s: f64) -> f64 {
        if time_s >= self.end_s {
            return 1.0;
        }
        let mut sum = 0.0;
        for corner in 0..8_u32 {
            let mut edge_s = 0.0;
            let mut sign = 1.0;
            for (i, length_s) in self.boxes_s.iter().enumerate() {
                if corner >> i & 1 == 1 {
                    edge_s += length_s;
                    sign = -sign;
                }
            }
            for term in self.terms {
                let since = time_s - term.b - edge_s;
                if since > 0.0 {
                    sum += sign * term.c * power(since, self.degree);
                }
            }
        }
        let factorial: f64 = (1..=self.degree).map(f64::from).product();
        let area: f64 = self.boxes_s.iter().product();
        (sum / (factorial * area)).clamp(0.0, 1.0)
    }

    /// When it has come so far, to a microsecond; late rather than early.
    fn time_of(&self, progress: f64) -> f64 {
        if progress <= 0.0 {
            return 0.0;
        }
        if progress >= 1.0 {
            return self.end_s;
        }
        let (mut before, mut after) = (0.0, self.end_s);
        for _ in 0..HALVINGS {
            let middle = (before + after) / 2.0;
            if self.at(middle) < progress {
                before = middle;
            } else {
                after = middle;
            }
        }
        after
    }
}

fn stages(prefilter: Option<&Prefilter>) -> &[Stage] {
    prefilter.map_or(&[], Prefilter::stages)
}

/// `x` to a small power.
fn power(x: f64, exponent: i32) -> f64 {
    (0..exponent).fold(1.0, |product, _| product * x)
}
