//! How much vibration a prefilter leaves.

use super::{Impulses, Mode, Prefilter, Stage};

/// A complex number, as far as a residual needs one.
#[derive(Clone, Copy)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    fn times(self, other: Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }

    /// `e^{a + jb}`
    fn exp(a: f64, b: f64) -> Self {
        let size = libm::exp(a);
        Self {
            re: size * libm::cos(b),
            im: size * libm::sin(b),
        }
    }
}

/// The vibration that is left of a mode after a filtered step, as a fraction of what the
/// unfiltered step excites (0 to 1).
///
/// ```text
/// V = e^{−ζω T_h} |H(s)| at the mode's pole s = −ζω + jω_d
/// impulses: H(s) = Σ A_i e^{−s t_i}       box: H(s) = (1 − e^{−sT}) / (sT)
/// ```
/// Source: Singer, Seering: preshaping command inputs to reduce system vibration, 1990.
#[must_use]
pub fn residual(prefilter: &Prefilter, mode: &Mode) -> f64 {
    let decay = mode.decay_per_s();
    let omega = mode.damped_rad_s();
    let mut response = Complex { re: 1.0, im: 0.0 };
    for stage in prefilter.stages() {
        let factor = match stage {
            Stage::Box(length_s) => {
                let end = Complex::exp(decay * length_s, -omega * length_s);
                // (1 − e^{−sT}) / (sT), the division by s as a product with its conjugate
                let size = (decay * decay + omega * omega) * length_s;
                Complex {
                    re: 1.0 - end.re,
                    im: -end.im,
                }
                .times(Complex {
                    re: -decay / size,
                    im: -omega / size,
                })
            }
            Stage::Zv(shaped) => transform(&Impulses::zv(shaped), decay, omega),
            Stage::Impulses(list) => transform(list, decay, omega),
        };
        response = response.times(factor);
    }
    libm::hypot(response.re, response.im) * libm::exp(-decay * prefilter.length_s())
}

/// `Σ A_i e^{−s t_i}` at `s = −decay + j omega`.
fn transform(impulses: &Impulses, decay: f64, omega: f64) -> Complex {
    let mut sum = Complex { re: 0.0, im: 0.0 };
    for impulse in impulses.iter() {
        let turn = Complex::exp(decay * impulse.time_s, -omega * impulse.time_s);
        sum.re += impulse.amplitude * turn.re;
        sum.im += impulse.amplitude * turn.im;
    }
    sum
}

/// A band of frequencies in Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Lowest frequency of the band.
    pub low_hz: f64,
    /// Highest frequency of the band.
    pub high_hz: f64,
}

/// The band of actual frequencies around `nominal` in which less than `limit` is left
/// (insensitivity), if the nominal frequency itself is in such a band.
///
/// For EI, whose residual touches the limit at the nominal frequency, give a limit slightly
/// above its `V_tol`. Edges are good to 1e-6 of the nominal frequency. The search
/// covers a quarter to four times the nominal frequency.
#[must_use]
pub fn insensitivity(prefilter: &Prefilter, nominal: &Mode, limit: f64) -> Option<Band> {
    let left_over = |ratio: f64| {
        let mode = Mode {
            frequency_hz: nominal.frequency_hz * ratio,
            ..*nominal
        };
        residual(prefilter, &mode)
    };
    if left_over(1.0) >= limit {
        return None;
    }
    // Walk outwards in steps of 0.1 % until the limit is passed, then bisect.
    let edge = |step: f64| {
        let mut inside = 1.0;
        while (0.25..=4.0).contains(&inside) && left_over(inside + step) < limit {
            inside += step;
        }
        let mut outside = inside + step;
        while libm::fabs(outside - inside) > 1e-6 {
            let middle = (inside + outside) / 2.0;
            if left_over(middle) < limit {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside * nominal.frequency_hz
    };
    Some(Band {
        low_hz: edge(-1e-3),
        high_hz: edge(1e-3),
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Kind, PrefilterConfig};
    use super::*;

    const MODE: Mode = Mode {
        frequency_hz: 1.0,
        damping: 0.1,
    };

    fn config(kind: Kind, damping: f32) -> PrefilterConfig {
        PrefilterConfig {
            kind,
            frequency_hz: 1.0,
            damping,
            ..PrefilterConfig::default()
        }
    }

    fn prefilter(kind: Kind, damping: f32) -> Prefilter {
        Prefilter::new(&config(kind, damping)).unwrap()
    }

    #[test]
    fn published_residuals() {
        // [Yeh26] Figs. 4, 5: residual in % at actual/model frequency 0.8, 1.0, 1.2, 1.5
        let table = [
            (Kind::Zv, [27.0, 0.0, 25.4, 55.5]),
            (Kind::Zvd, [7.31, 0.0, 6.44, 30.8]),
            (Kind::Fir, [19.7, 7.41, 12.7, 14.7]),
            (Kind::FirZv, [5.33, 0.0, 3.23, 8.13]),
            (Kind::FirZvd, [1.44, 0.0, 0.82, 4.51]),
        ];
        for (kind, row) in table {
            let prefilter = prefilter(kind, 0.1);
            for (ratio, published) in [0.8, 1.0, 1.2, 1.5].into_iter().zip(row) {
                let mode = Mode {
                    frequency_hz: ratio,
                    ..MODE
                };
                let percent = 100.0 * residual(&prefilter, &mode);
                assert!(
                    (percent - published).abs() < 0.1,
                    "{kind:?} {ratio}: {percent}"
                );
            }
        }
    }

    #[test]
    fn published_bands() {
        let table = [
            (Kind::Zv, Some((0.963, 1.038))),
            (Kind::Zvd, Some((0.835, 1.175))),
            (Kind::Fir, None),
            (Kind::FirZv, Some((0.806, 1.280))),
            (Kind::FirZvd, Some((0.699, 1.576))),
        ];
        for (kind, published) in table {
            let band = insensitivity(&prefilter(kind, 0.1), &MODE, 0.05);
            assert_eq!(band.is_some(), published.is_some(), "{kind:?}");
            if let (Some(band), Some((low, high))) = (band, published) {
                let off = |got: f64, want: f64| (got - want).abs();
                assert!(off(band.low_hz, low) < 1e-3, "{kind:?} {band:?}");
                assert!(off(band.high_hz, high) < 1e-3, "{kind:?} {band:?}");
            }
        }
    }

    #[test]
    fn ei_leaves_what_it_is_told_to() {
        for v_tol in [0.02_f32, 0.05, 0.1] {
            for damping in [0.0_f32, 0.022, 0.1, 0.3] {
                let mode = Mode {
                    damping: damping.into(),
                    ..MODE
                };
                let ei = Prefilter::new(&PrefilterConfig {
                    v_tol,
                    ..config(Kind::Ei, damping)
                });
                let left = residual(&ei.unwrap(), &mode);
                assert!((left - f64::from(v_tol)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn highest_hump_is_the_residual_allowed() {
        for (kind, humps) in [(Kind::TwoHumpEi, 2), (Kind::ThreeHumpEi, 3)] {
            for (v_tol, damping) in [
                (0.02_f32, 0.0_f32),
                (0.02, 0.1),
                (0.05, 0.0),
                (0.05, 0.022),
                (0.05, 0.1),
                (0.1, 0.022),
            ] {
                let prefilter = Prefilter::new(&PrefilterConfig {
                    v_tol,
                    ..config(kind, damping)
                })
                .unwrap();
                let left = |step: i32| {
                    let mode = Mode {
                        frequency_hz: f64::from(step) / 1e5,
                        damping: damping.into(),
                    };
                    residual(&prefilter, &mode)
                };
                let tops: std::vec::Vec<f64> = (40_000..160_000)
                    .filter(|&step| left(step) >= left(step - 1) && left(step) > left(step + 1))
                    .map(left)
                    .collect();
                assert_eq!(tops.len(), humps, "{kind:?} {v_tol} {damping}");
                let highest = tops.iter().copied().fold(0.0, f64::max);
                let off = highest - f64::from(v_tol);
                assert!(off.abs() < 2e-8, "{kind:?} {v_tol} {damping}: {highest}");
            }
        }
    }

    /// The half width of the band in % of the nominal frequency, without damping.
    fn half_width(kind: Kind) -> f64 {
        let mode = Mode {
            damping: 0.0,
            ..MODE
        };
        let band = insensitivity(&prefilter(kind, 0.0), &mode, 0.05 + 1e-7).unwrap();
        50.0 * (band.high_hz - band.low_hz)
    }

    #[test]
    fn published_comparison_of_shapers() {
        // [vNoorden21]: residual at ±15 % frequency error, %; the jerk-limited profile is a
        // box over the period
        let undamped = |kind, ratio| {
            let mode = Mode {
                frequency_hz: ratio,
                damping: 0.0,
            };
            100.0 * residual(&prefilter(kind, 0.0), &mode)
        };
        for (kind, published) in [(Kind::Zv, 23.3), (Kind::Zvd, 5.45), (Kind::Fir, 17.0)] {
            let worst = undamped(kind, 0.85).max(undamped(kind, 1.15));
            assert!((worst - published).abs() < 0.05, "{kind:?}: {worst}");
        }
        // insensitivity at 5 %: ±%; the last two are 72.6 and 95 % wide in the literature
        for (kind, published, within) in [
            (Kind::Zv, 3.18, 0.01),
            (Kind::Zvd, 14.36, 0.01),
            (Kind::Ei, 19.97, 0.01),
            (Kind::TwoHumpEi, 36.3, 0.1),
            (Kind::ThreeHumpEi, 47.5, 0.75),
        ] {
            let width = half_width(kind);
            assert!((width - published).abs() < within, "{kind:?}: ±{width} %");
        }
        // from the closed forms |cos(πr/2)|³ and |(2 − √2) cos(3πr/4) + √2 − 1|
        for (kind, exact) in [(Kind::Zvdd, 24.0191), (Kind::Mzv, 5.1748)] {
            let width = half_width(kind);
            assert!((width - exact).abs() < 1e-3, "{kind:?}: ±{width} %");
        }
    }
}
