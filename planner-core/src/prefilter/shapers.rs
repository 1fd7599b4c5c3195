//! Shapers that are no cascade of ZV, as sequences of impulses.

use core::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

use super::{CustomImpulse, Mode};

/// Impulses of a shaper: the 3-hump EI has five.
pub const MAX_IMPULSES: usize = 5;

/// One impulse `A δ(t − t_i)` of a shaper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impulse {
    /// When, in seconds from the stage's input.
    pub time_s: f64,
    /// Its amplitude; a shaper's amplitudes are positive and sum to 1.
    pub amplitude: f64,
}

/// A shaper: one to [`MAX_IMPULSES`] impulses of positive amplitude and sum 1, the first at
/// time 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulses {
    list: [Impulse; MAX_IMPULSES],
    count: usize,
}

impl core::ops::Deref for Impulses {
    type Target = [Impulse];

    fn deref(&self) -> &[Impulse] {
        self.list.get(..self.count).unwrap_or(&self.list)
    }
}

impl Impulses {
    /// Impulses of any positive weights, which are divided by their sum.
    fn normalised<const N: usize>(impulses: [Impulse; N]) -> Self {
        const { assert!(0 < N && N <= MAX_IMPULSES) };
        let sum: f64 = impulses.iter().map(|impulse| impulse.amplitude).sum();
        let mut list = [Impulse::default(); MAX_IMPULSES];
        for (place, impulse) in list.iter_mut().zip(impulses) {
            *place = Impulse {
                amplitude: impulse.amplitude / sum,
                ..impulse
            };
        }
        Self { list, count: N }
    }

    /// Weights at a constant spacing, each damped by `decay` against the one before.
    fn spaced<const N: usize>(spacing_s: f64, decay: f64, weights: [f64; N]) -> Self {
        let mut time_s = 0.0;
        let mut share = 1.0;
        Self::normalised(weights.map(|weight| {
            let impulse = Impulse {
                time_s,
                amplitude: weight * share,
            };
            time_s += spacing_s;
            share *= decay;
            impulse
        }))
    }

    /// ZV: `[1, K] / (1 + K)` at `0, T_d/2`.
    pub(super) fn zv(mode: &Mode) -> Self {
        let (half_s, k) = half_period(mode);
        Self::spaced(half_s, k, [1.0, 1.0])
    }

    /// MZV: three impulses `3/8 T_d` apart that null the mode.
    ///
    /// With `φ = 3π/4` the turn between two of them and `k = K^{3/4}` the decay, the zero
    /// `1 − 2 cos φ k z + k² z²` has the weights `1, √2 k, k²`, which the firmware of
    /// 3D printers writes as `1 − 1/√2, (√2 − 1) k, (1 − 1/√2) k²`.
    pub(super) fn mzv(mode: &Mode) -> Self {
        let (half_s, k) = half_period(mode);
        let weights = [1.0 - FRAC_1_SQRT_2, SQRT_2 - 1.0, 1.0 - FRAC_1_SQRT_2];
        Self::spaced(0.75 * half_s, libm::pow(k, 0.75), weights)
    }

    /// EI shaper: three impulses at `0, T_d/2, T_d` that leave `residual` of a step's
    /// vibration at the nominal mode.
    ///
    /// ```text
    /// A = [(1+v)/4, (1−v)/2 K, (1+v)/4 K²] / Σ,   residual V = v K² / Σ
    /// Σ = c0 + c1 v,  c0 = (1+K)²/4,  c1 = (1−K)²/4   ⇒   v = V c0 / (K² − V c1)
    /// ```
    /// Source: Singhose, Seering, Singer: residual vibration reduction using vector diagrams
    /// to generate shaped inputs, 1994; `v` solved so that the residual holds with damping.
    /// A mode so damped that `v` would pass 1 leaves less than is allowed.
    #[must_use]
    pub fn extra_insensitive(mode: &Mode, residual: f64) -> Self {
        let (half_s, k) = half_period(mode);
        let c0 = (1.0 + k) * (1.0 + k) / 4.0;
        let c1 = (1.0 - k) * (1.0 - k) / 4.0;
        let room = k * k - residual * c1;
        let v = if residual * c0 < room {
            residual * c0 / room
        } else {
            1.0
        };
        let outer = (1.0 + v) / 4.0;
        Self::spaced(half_s, k, [outer, (1.0 - v) / 2.0, outer])
    }

    /// 2-hump EI: four impulses half a damped period apart, the mode nulled, two humps of at
    /// most `residual` beside it.
    pub(super) fn two_hump_ei(mode: &Mode, residual: f64) -> Self {
        let (half_s, k) = half_period(mode);
        let weights = humps(k, residual, |v| {
            let x = widening(v, 3.0);
            let (first, second) = (x * x * x / 2.0, 1.5 * x * (x * x - 1.0));
            [first, second, second, first].map(|weight| v * weight)
        });
        Self::spaced(half_s, k, weights)
    }

    /// 3-hump EI: five impulses half a damped period apart, three humps of at most `residual`.
    pub(super) fn three_hump_ei(mode: &Mode, residual: f64) -> Self {
        let (half_s, k) = half_period(mode);
        let weights = humps(k, residual, |v| {
            let x2 = widening(v, 4.0) * widening(v, 4.0);
            let (first, second) = (x2 * x2 / 2.0, 2.0 * x2 * (x2 - 1.0));
            let third = (3.0 * x2 - 1.0) * (x2 - 1.0);
            [first, second, third, second, first].map(|weight| v * weight)
        });
        Self::spaced(half_s, k, weights)
    }

    /// A list of one's own; impulses without weight are left out by having none.
    pub(super) fn custom(list: &[CustomImpulse; MAX_IMPULSES]) -> Self {
        let count = 1 + list.iter().rposition(|one| one.weight > 0.0).unwrap_or(0);
        let impulses = list.map(|one| Impulse {
            time_s: f64::from(one.time_ms) / 1e3,
            amplitude: f64::from(one.weight),
        });
        let mut all = Self::normalised(impulses);
        for impulse in &mut all.list {
            if impulse.amplitude == 0.0 {
                impulse.time_s = 0.0;
            }
        }
        all.count = count;
        all
    }
}

/// `T_d/2` in seconds and the decay `K` over it.
fn half_period(mode: &Mode) -> (f64, f64) {
    (mode.damped_period_s() / 2.0, mode.half_period_decay())
}

/// `x₀` with `T_n(x₀) = 1/v`, `T_n` the Chebyshev polynomial of degree `n`.
fn widening(v: f64, n: f64) -> f64 {
    libm::cosh(libm::acosh(1.0 / v) / n)
}

/// The undamped weights of an EI shaper whose highest hump is `residual` once they are damped.
///
/// The response of `n + 1` symmetric impulses half a period apart is a polynomial of degree
/// `n` in `x = cos(πr/2)`, `r` = actual/model frequency. EI shapers have the one with humps of
/// equal height over the widest band, a Chebyshev polynomial:
///
/// ```text
/// H = v T_n(x₀ x),   T_n(x₀) = 1/v      band: |x| ≤ 1/x₀      humps at x₀ x = cos(kπ/n)
/// n = 3: v [x₀³/2, 3/2 x₀(x₀² − 1), …]
/// n = 4: v [x₀⁴/2, 2 x₀²(x₀² − 1), (3x₀² − 1)(x₀² − 1), …]
/// ```
///
/// These are the amplitudes of Singhose, Porter, Tuttle, Singer (vibration reduction using
/// multi-hump input shapers, 1997), as 3D printers use them. Damping weighs the i-th impulse
/// with `K^i`, which keeps what happens at the nominal mode, raises the hump at the lowest
/// frequency and lowers the others: `v` is solved so that this hump is the residual. A mode so
/// damped that `v` would pass 1 leaves less.
fn humps<const N: usize>(k: f64, residual: f64, weights: impl Fn(f64) -> [f64; N]) -> [f64; N] {
    let order = (N - 1) as f64;
    let mut v = residual;
    for _ in 0..HUMP_ROUNDS {
        let all = weights(v);
        let r = libm::acos(libm::cos(PI / order) / widening(v, order)) * 2.0 / PI;
        let next = (v * residual / hump(k, &all, r)).min(1.0);
        let change = libm::fabs(next - v);
        v = next;
        if change < 1e-12 {
            break;
        }
    }
    weights(v)
}

/// Rounds until the height of a hump is right; each divides the error by about ten.
const HUMP_ROUNDS: usize = 16;

/// The height of the hump near the frequency ratio `r`: damping moves its top a little.
fn hump(k: f64, weights: &[f64], mut r: f64) -> f64 {
    const SPACING: f64 = 4e-3;
    let mut height = 0.0;
    for _ in 0..4 {
        let [below, at, above] = [r - SPACING, r, r + SPACING].map(|r| left_over(k, weights, r));
        height = at;
        // the vertex of the parabola through the three
        let bend = below - 2.0 * at + above;
        let to_vertex = SPACING / 2.0 * (below - above) / bend;
        if bend < 0.0 {
            r += to_vertex.clamp(-0.05, 0.05);
            height = at - (below - above) * (below - above) / (8.0 * bend);
        }
    }
    height
}

/// The residual at the frequency ratio `r` of weights that are damped by `K^i`:
/// `|Σ a_i K^i p^{n−i}| / Σ a_i K^i`, `p = K^r e^{jπr}`.
fn left_over(k: f64, weights: &[f64], r: f64) -> f64 {
    let size = libm::pow(k, r);
    let (re, im) = (size * libm::cos(PI * r), size * libm::sin(PI * r));
    let (mut sum_re, mut sum_im, mut sum, mut share) = (0.0, 0.0, 0.0, 1.0);
    for weight in weights {
        (sum_re, sum_im) = (
            sum_re * re - sum_im * im + weight * share,
            sum_re * im + sum_im * re,
        );
        sum += weight * share;
        share *= k;
    }
    libm::hypot(sum_re, sum_im) / sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decay_amplitudes_and_times_are_exact() {
        // ζ, K = exp(−ζπ/√(1−ζ²)), 1/(1+K), K/(1+K), in twenty digits rounded to double
        for (damping, k, first, second) in [
            (0.0, 1.0, 0.5, 0.5),
            (
                0.0003,
                0.999_057_966_154_254_2,
                0.500_235_619_442_181_1,
                0.499_764_380_557_818_8,
            ),
            (
                0.002,
                0.993_736_500_137_079_5,
                0.501_570_794_300_673_6,
                0.498_429_205_699_326_4,
            ),
            (
                0.022,
                0.933_203_703_451_367_8,
                0.517_276_062_638_763_8,
                0.482_723_937_361_236_15,
            ),
            (
                0.1,
                0.729_247_614_287_670_9,
                0.578_286_181_653_591_6,
                0.421_713_818_346_408_36,
            ),
        ] {
            let mode = Mode {
                frequency_hz: 2.4727,
                damping,
            };
            assert!((mode.half_period_decay() - k).abs() < 1e-15);
            let zv = Impulses::zv(&mode);
            assert_eq!(zv.len(), 2);
            assert!((zv[0].amplitude - first).abs() < 1e-15);
            assert!((zv[1].amplitude - second).abs() < 1e-15);
            assert_eq!(zv[0].time_s, 0.0);
            let half_s = 0.5 / (2.4727 * libm::sqrt(1.0 - damping * damping));
            assert!((zv[1].time_s - half_s).abs() < 1e-15);
            // MZV: K^{3/4} and K^{3/2} weigh 1 : √2 : 1, three eighths of a period apart
            let mzv = Impulses::mzv(&mode);
            let shares = [1.0, SQRT_2 * libm::pow(k, 0.75), libm::pow(k, 1.5)];
            let sum: f64 = shares.iter().sum();
            for (i, (impulse, share)) in mzv.iter().zip(shares).enumerate() {
                assert!((impulse.amplitude - share / sum).abs() < 1e-15);
                assert!((impulse.time_s - 0.75 * half_s * i as f64).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn published_amplitudes_of_humps() {
        // without damping, V = 5 %, as they are printed for use
        let mode = Mode {
            frequency_hz: 1.0,
            damping: 0.0,
        };
        let v = 0.05_f64;
        let x = libm::cbrt(v * v * (libm::sqrt(1.0 - v * v) + 1.0));
        let a1 = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x);
        let two = Impulses::two_hump_ei(&mode, v);
        for (impulse, published) in two.iter().zip([a1, 0.5 - a1, 0.5 - a1, a1]) {
            assert!((impulse.amplitude - published).abs() < 1e-9);
        }
        let b1 = (1.0 + 3.0 * v + 2.0 * libm::sqrt(2.0 * v * (v + 1.0))) / 16.0;
        let b2 = (1.0 - v) / 4.0;
        let three = Impulses::three_hump_ei(&mode, v);
        let published = [b1, b2, 1.0 - 2.0 * (b1 + b2), b2, b1];
        for (impulse, published) in three.iter().zip(published) {
            assert!((impulse.amplitude - published).abs() < 1e-9);
        }
        assert_eq!((two.len(), three.len()), (4, 5));
    }

    #[test]
    fn every_amplitude_is_positive_and_their_sum_one() {
        for damping in [0.0, 0.1, 0.3, 0.5] {
            for residual in [0.001, 0.05, 0.3, 0.5] {
                let mode = Mode {
                    frequency_hz: 3.0,
                    damping,
                };
                for shaper in [
                    Impulses::mzv(&mode),
                    Impulses::extra_insensitive(&mode, residual),
                    Impulses::two_hump_ei(&mode, residual),
                    Impulses::three_hump_ei(&mode, residual),
                ] {
                    let sum: f64 = shaper.iter().map(|impulse| impulse.amplitude).sum();
                    assert!((sum - 1.0).abs() < 1e-14);
                    assert!(shaper.iter().all(|impulse| impulse.amplitude >= 0.0));
                }
            }
        }
    }

    #[test]
    fn a_list_of_ones_own_is_normalised() {
        let at = |time_ms, weight| CustomImpulse { time_ms, weight };
        let list = [
            at(0.0, 3.0),
            at(80.0, 0.0),
            at(50.0, 1.0),
            at(9.0, 0.0),
            at(0.0, 0.0),
        ];
        let found = Impulses::custom(&list);
        let expected = [(0.0, 0.75), (0.0, 0.0), (0.05, 0.25)];
        assert_eq!(found.len(), expected.len());
        for (impulse, (time_s, amplitude)) in found.iter().zip(expected) {
            assert_eq!((impulse.time_s, impulse.amplitude), (time_s, amplitude));
        }
    }
}
