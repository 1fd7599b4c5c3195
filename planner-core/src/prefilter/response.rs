//! Step and ramp response of a prefilter: exact piecewise polynomials.

use heapless::Vec;

use super::{Impulse, Impulses, Stage};
use crate::sort::sort_by;

/// Breakpoints of a response while it is made: FIR-3-hump-EI for each of two modes has 49.
const MAX_BREAKS: usize = 50;

/// Numbers of a response: begin and coefficients of each piece, up to 36 pieces with two boxes,
/// as FIR-ZVDD for each of two modes has. A cascade with more is refused when its taps are made;
/// room for any cascade would cost 2 KiB more each.
const MAX_NUMBERS: usize = 36 * 5;

/// Boxes of a cascade: S-curves for two modes have four.
const MAX_BOXES: usize = 4;

/// Coefficients of a ramp response: degree 1 and one more for each box.
const COEFFICIENTS: usize = MAX_BOXES + 2;

/// Times closer than this are one breakpoint (in seconds).
const SAME_TIME_S: f64 = 1e-12;

/// Step response `S(t)` and ramp response `I(t) = ∫ S` of a prefilter.
///
/// With impulses `A_i` at `t_i` and boxes `T_j`, the ramp response is
///
/// ```text
/// I(t) = Σ c_k (t − b_k)₊ⁿ / n!,      n = 1 + number of boxes
/// an impulse stage: (b, c) → (b + t_i, A_i c);   a box: (b, c) → (b, c/T), (b + T, −c/T), n + 1
/// ```
///
/// It is kept as one polynomial for each piece between breakpoints, in the time since the
/// piece began, so that single precision loses nothing to cancellation: relative error of
/// `S` and `I` below 2e-6.
#[derive(Clone, Debug)]
pub struct Response {
    /// Piece after piece: when it begins, and the coefficients of `I` in the time since then,
    /// highest order first.
    pieces: Vec<f32, MAX_NUMBERS>,
    /// Numbers of a piece.
    stride: usize,
    length_s: f32,
    delay_s: f32,
    spread_s: f32,
}

/// A term `c (t − b)₊ⁿ / n!` of the ramp response.
#[derive(Clone, Copy)]
pub(crate) struct Term {
    /// `b` in seconds.
    pub b: f64,
    /// `c`.
    pub c: f64,
}

/// The terms of a ramp response.
pub(crate) type Terms = Vec<Term, MAX_BREAKS>;

impl Response {
    /// That of no filter, which has no pieces yet.
    pub(crate) const NONE: Self = Self {
        pieces: Vec::new(),
        stride: stride(1),
        length_s: 0.0,
        delay_s: 0.0,
        spread_s: 0.0,
    };

    /// The response of a cascade, or of the same cascade run backwards in time.
    pub(super) fn new(stages: &[Stage], reversed: bool) -> Self {
        let mut response = Self::NONE;
        response.set(stages, reversed);
        response
    }

    /// Becomes the response of a cascade, or of the same cascade run backwards in time.
    #[inline(never)]
    pub(crate) fn set(&mut self, stages: &[Stage], reversed: bool) {
        let mut terms = Terms::new();
        add_terms(&mut terms, stages, reversed);
        let variance_s2: f64 = stages.iter().map(Stage::variance_s2).sum();
        sort_by(&mut terms, |one, other| one.b < other.b);
        self.set_terms(&terms, 1 + boxes(stages));
        self.spread_s = libm::sqrt(variance_s2) as f32;
    }

    /// One polynomial a piece: shift the last one to the next breakpoint, add its term.
    fn set_terms(&mut self, terms: &[Term], degree: usize) {
        self.pieces.clear();
        self.stride = stride(degree);
        let mut now = [0.0_f64; COEFFICIENTS];
        let mut at = 0.0;
        let factorial: f64 = (1..=degree).map(|order| order as f64).product();
        for (place, term) in terms.iter().enumerate() {
            shift(&mut now, term.b - at);
            at = term.b;
            if let Some(highest) = now.get_mut(degree) {
                *highest += term.c / factorial;
            }
            if place + 1 == terms.len() {
                // Behind the last breakpoint the response is the raw ramp, late by the centroid.
                now = [now[0], 1.0, 0.0, 0.0, 0.0, 0.0];
            }
            let coefficients = now.iter().take(degree + 1).rev();
            // of what has no room no taps are made
            for number in core::iter::once(&at).chain(coefficients) {
                let _ = self.pieces.push(*number as f32);
            }
        }
        self.length_s = at as f32;
        self.delay_s = (at - now[0]) as f32;
    }

    /// `T_h`, the length in seconds.
    #[must_use]
    pub fn length_s(&self) -> f32 {
        self.length_s
    }

    /// `m = T_h − I(T_h)`, the centroid of the prefilter in seconds.
    #[must_use]
    pub fn delay_s(&self) -> f32 {
        self.delay_s
    }

    /// `σ`, the standard deviation of the prefilter's weight in seconds.
    #[must_use]
    pub fn spread_s(&self) -> f32 {
        self.spread_s
    }

    /// `(S(t), I(t))`: the step response (0 to 1) and the ramp response (in seconds) at `t`.
    ///
    /// Where `S` jumps it is the limit from the right; before zero both are zero.
    ///
    /// Cost on a Cortex-M4F: 10 instructions for each halving of the pieces, 5 a coefficient.
    #[must_use]
    pub fn at(&self, t_s: f32) -> (f32, f32) {
        // the length of a piece is known to the compiler, because a corner asks hundreds of times
        match self.stride {
            3 => self.at_in::<3>(t_s),
            4 => self.at_in::<4>(t_s),
            5 => self.at_in::<5>(t_s),
            6 => self.at_in::<6>(t_s),
            _ => self.at_in::<7>(t_s),
        }
    }

    fn at_in<const STRIDE: usize>(&self, t_s: f32) -> (f32, f32) {
        let (pieces, _) = self.pieces.as_chunks::<STRIDE>();
        let begun = pieces.partition_point(|piece| piece[0] <= t_s);
        let Some(piece) = begun.checked_sub(1).and_then(|last| pieces.get(last)) else {
            return (0.0, 0.0);
        };
        let t = t_s - piece[0];
        // Horner's scheme, of the polynomial and of its derivative
        let (mut ramp, mut step) = (0.0, 0.0);
        for coefficient in &piece[1..] {
            step = step * t + ramp;
            ramp = ramp * t + coefficient;
        }
        (step, ramp)
    }
}

/// Numbers of a piece of a response of that degree: its begin and its coefficients.
const fn stride(degree: usize) -> usize {
    degree + 2
}

/// How many boxes are among the stages.
pub(crate) fn boxes(stages: &[Stage]) -> usize {
    let is_box = |stage: &&Stage| matches!(stage, Stage::Box(_));
    stages.iter().filter(is_box).count()
}

/// Whether a response has room for the breakpoints of a cascade.
#[inline(never)]
pub(super) fn has_room_for(stages: &[Stage]) -> bool {
    let stride = stride(1 + boxes(stages));
    let apart: usize = stages
        .iter()
        .map(|stage| match stage {
            Stage::Box(_) | Stage::Zv(_) => 2,
            Stage::Impulses(list) => list.iter().count(),
        })
        .product();
    if apart * stride <= MAX_NUMBERS {
        return true;
    }
    // not all of them need be apart; where the list is full there may be too many
    let mut terms = Terms::new();
    add_terms(&mut terms, stages, false);
    let count = terms.len();
    count < MAX_BREAKS && count * stride <= MAX_NUMBERS
}

/// Adds the terms of a cascade's ramp response, or of that run backwards, to none.
pub(crate) fn add_terms(terms: &mut Terms, stages: &[Stage], reversed: bool) {
    add(terms, Term { b: 0.0, c: 1.0 });
    for stage in stages {
        add_stage(terms, stage, reversed);
    }
}

/// Puts one more stage behind those that have given the terms.
#[inline(never)]
fn add_stage(terms: &mut Terms, stage: &Stage, reversed: bool) {
    let before = terms.clone();
    terms.clear();
    match stage {
        Stage::Box(length_s) => {
            for &Term { b, c } in &before {
                let c = c / length_s;
                add(terms, Term { b, c });
                let b = b + length_s;
                add(terms, Term { b, c: -c });
            }
        }
        Stage::Zv(mode) => add_impulses(terms, &before, &Impulses::zv(mode), stage, reversed),
        Stage::Impulses(list) => add_impulses(terms, &before, list, stage, reversed),
    }
}

fn add_impulses(
    terms: &mut Terms,
    before: &[Term],
    impulses: &[Impulse],
    stage: &Stage,
    reversed: bool,
) {
    let end = stage.length_s();
    for &Term { b, c } in before {
        for impulse in impulses {
            let time = if reversed {
                end - impulse.time_s
            } else {
                impulse.time_s
            };
            let (b, c) = (b + time, c * impulse.amplitude);
            add(terms, Term { b, c });
        }
    }
}

/// Adds a term, joined with one at the same time if there is one.
fn add(terms: &mut Vec<Term, MAX_BREAKS>, term: Term) {
    match terms
        .iter_mut()
        .find(|other| libm::fabs(other.b - term.b) < SAME_TIME_S)
    {
        Some(same) => same.c += term.c,
        // of what has no room no taps are made
        None => drop(terms.push(term)),
    }
}

/// Rewrites a polynomial in `t` as one in `t − by` (Horner's scheme, repeated).
fn shift(polynomial: &mut [f64; COEFFICIENTS], by: f64) {
    for lowest in 0..COEFFICIENTS - 1 {
        for i in (lowest..COEFFICIENTS - 1).rev() {
            polynomial[i] += by * polynomial[i + 1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Kind, Prefilter, PrefilterConfig};

    #[test]
    fn responses_are_smooth_at_breakpoints_and_end_as_a_late_ramp() {
        for kind in Kind::ALL {
            let prefilter = Prefilter::new(&PrefilterConfig {
                kind,
                ..PrefilterConfig::default()
            })
            .unwrap();
            for response in [prefilter.response(), prefilter.reversed_response()] {
                let length_s = response.length_s();
                assert!((f64::from(length_s) - prefilter.length_s()).abs() < 1e-7);
                let mut last = 0.0;
                for i in 0..=1000 {
                    let t = (length_s + 0.1) * i as f32 / 1000.0;
                    let (step, ramp) = response.at(t);
                    assert!(
                        (-1e-6..=1.000_001).contains(&step),
                        "{kind:?} S({t}) = {step}"
                    );
                    assert!(ramp >= last - 1e-6, "{kind:?} I falls at {t}");
                    last = ramp;
                }
                let (step, ramp) = response.at(length_s + 1.0);
                assert_eq!(step, 1.0);
                assert!((ramp - (length_s + 1.0 - response.delay_s())).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn forward_and_reversed_response_add_up() {
        // 1 − S(T − t) is the step response of the reversed filter.
        let prefilter = Prefilter::new(&PrefilterConfig::default()).unwrap();
        let (forward, reversed) = (prefilter.response(), prefilter.reversed_response());
        for i in 1..1000 {
            let t = forward.length_s() * i as f32 / 1000.0;
            let (step, _) = forward.at(forward.length_s() - t);
            let (back, _) = reversed.at(t);
            assert!((1.0 - step - back).abs() < 2e-6, "{t}: {step} {back}");
        }
    }
}
