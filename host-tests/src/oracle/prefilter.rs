//! Prefilters as cascades of impulses and boxes, in closed form.

use std::f64::consts::{PI, TAU};

/// Names that [`Prefilter::named`] knows, by increasing length.
pub const NAMES: [&str; 8] = [
    "none", "zv", "zvd", "ei", "fir", "fir-zv", "fir-zvd", "s-curve",
];

/// Residual that the EI shaper allows at its nominal frequency.
const EI_RESIDUAL: f64 = 0.05;

/// A filter of unit area: impulses `Σ A_i δ(t − t_i)` convolved with boxes.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefilter {
    /// `(t_i, A_i)` in time order, seconds; the amplitudes sum to 1.
    impulses: Vec<(f64, f64)>,
    /// Box lengths in seconds.
    boxes_s: Vec<f64>,
    /// Step response `Σ c (t − τ)₊ⁿ / n!` with n the number of boxes: `(τ, c)`.
    terms: Vec<(f64, f64)>,
}

impl Prefilter {
    /// A cascade of one impulse sequence and any number of boxes.
    ///
    /// # Panics
    /// If there is no impulse or a box has no length.
    #[must_use]
    pub fn new(impulses: &[(f64, f64)], boxes_s: &[f64]) -> Self {
        assert!(!impulses.is_empty() && boxes_s.iter().all(|&length| length > 0.0));
        // Box: (1 − e^{−sT}) / (sT). Its product with the impulses has one term per
        // impulse and subset of boxes, over sⁿ⁺¹ for the step.
        let mut terms = impulses.to_vec();
        for &length in boxes_s {
            let mut next = Vec::with_capacity(2 * terms.len());
            for &(tau, c) in &terms {
                next.push((tau, c / length));
                next.push((tau + length, -c / length));
            }
            terms = next;
        }
        terms.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            impulses: impulses.to_vec(),
            boxes_s: boxes_s.to_vec(),
            terms,
        }
    }

    /// The prefilter called `name` for a mode of undamped frequency `frequency_hz`
    /// and damping ratio `damping`; `None` for a name not in [`NAMES`].
    #[must_use]
    pub fn named(name: &str, frequency_hz: f64, damping: f64) -> Option<Self> {
        let root = (1.0 - damping * damping).sqrt();
        let period = 1.0 / (frequency_hz * root);
        let half = period / 2.0;
        let k = (-damping * PI / root).exp();
        let none = vec![(0.0, 1.0)];
        let zv = vec![(0.0, 1.0 / (1.0 + k)), (half, k / (1.0 + k))];
        let square = (1.0 + k) * (1.0 + k);
        let zvd = vec![
            (0.0, 1.0 / square),
            (half, 2.0 * k / square),
            (period, k * k / square),
        ];
        let (impulses, boxes): (_, &[f64]) = match name {
            "none" => (none, &[]),
            "zv" => (zv, &[]),
            "zvd" => (zvd, &[]),
            "ei" => (extra_insensitive(period, k), &[]),
            "fir" => (none, &[period]),
            "fir-zv" => (zv, &[period]),
            "fir-zvd" => (zvd, &[period]),
            "s-curve" => (none, &[period, period]),
            _ => return None,
        };
        Some(Self::new(&impulses, boxes))
    }

    /// Times in seconds and amplitudes of its impulses.
    pub fn impulses(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.impulses.iter().copied()
    }

    /// Length `T_h` of the impulse response in seconds.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        self.terms.last().map_or(0.0, |term| term.0)
    }

    /// Centroid `m = T_h − I(T_h)` of the impulse response in seconds: the sum of
    /// the stages' centroids.
    #[must_use]
    pub fn centroid_s(&self) -> f64 {
        let impulses: f64 = self.impulses.iter().map(|&(t, a)| t * a).sum();
        impulses + self.boxes_s.iter().sum::<f64>() / 2.0
    }

    /// Times at which the step response jumps or has a kink, in order.
    pub fn kinks_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.terms.iter().map(|term| term.0)
    }

    /// Step response `S(t)`; its right limit at a jump.
    #[must_use]
    pub fn step(&self, t_s: f64) -> f64 {
        if t_s >= self.length_s() {
            return 1.0;
        }
        self.truncated_powers(t_s, self.boxes_s.len() as u32, true)
    }

    /// Step response just before `t_s`.
    #[must_use]
    pub fn step_left(&self, t_s: f64) -> f64 {
        if t_s > self.length_s() {
            return 1.0;
        }
        self.truncated_powers(t_s, self.boxes_s.len() as u32, false)
    }

    /// Ramp response `I(t) = ∫ S`.
    #[must_use]
    pub fn ramp(&self, t_s: f64) -> f64 {
        if t_s >= self.length_s() {
            return t_s - self.centroid_s();
        }
        self.truncated_powers(t_s, self.boxes_s.len() as u32 + 1, true)
    }

    /// Residual vibration `V = e^{−ζωT_h} |H(−ζω + jω√(1−ζ²))|` of a mode, as a
    /// fraction of that of an unfiltered impulse (Singer, Seering).
    #[must_use]
    pub fn residual(&self, frequency_hz: f64, damping: f64) -> f64 {
        let omega = TAU * frequency_hz;
        let decay = damping * omega;
        let damped = omega * (1.0 - damping * damping).sqrt();
        // e^{−pt} at the pole p = −decay + j damped.
        let exponential = |t: f64| {
            let size = (decay * t).exp();
            (size * (damped * t).cos(), -size * (damped * t).sin())
        };
        let (mut re, mut im) = (0.0, 0.0);
        for &(t, amplitude) in &self.impulses {
            let (c, s) = exponential(t);
            re += amplitude * c;
            im += amplitude * s;
        }
        let boxes: f64 = self
            .boxes_s
            .iter()
            .map(|&length| {
                let (c, s) = exponential(length);
                (1.0 - c).hypot(s) / (omega * length)
            })
            .product();
        (-decay * self.length_s()).exp() * re.hypot(im) * boxes
    }

    /// The band of actual frequencies around `frequency_hz` in which the residual
    /// stays below `limit`; `None` if it is not below at `frequency_hz` itself.
    #[must_use]
    pub fn band_hz(&self, frequency_hz: f64, damping: f64, limit: f64) -> Option<(f64, f64)> {
        let below = |f: f64| self.residual(f, damping) < limit;
        if !below(frequency_hz) {
            return None;
        }
        let edge = |direction: f64| {
            let step = direction * frequency_hz * 1e-3;
            let mut inside = frequency_hz;
            while below(inside + step) && inside + step > step.abs() && inside < 1e3 * frequency_hz
            {
                inside += step;
            }
            let mut outside = inside + step;
            for _ in 0..50 {
                let middle = f64::midpoint(inside, outside);
                *(if below(middle) {
                    &mut inside
                } else {
                    &mut outside
                }) = middle;
            }
            inside
        };
        Some((edge(-1.0), edge(1.0)))
    }

    fn truncated_powers(&self, t_s: f64, power: u32, right: bool) -> f64 {
        let factorial: f64 = (1..=power).map(f64::from).product();
        self.terms
            .iter()
            .filter(|&&(tau, _)| if right { t_s >= tau } else { t_s > tau })
            .map(|&(tau, c)| c * (t_s - tau).powi(power.cast_signed()))
            .sum::<f64>()
            / factorial
    }
}

/// EI for a damped mode: ratios `(1+v)/4 : (1−v)/2·K : (1+v)/4·K²` leave
/// `V = v K² / (c0 + v c1)` at the nominal mode, solved here for `v`.
fn extra_insensitive(period_s: f64, k: f64) -> Vec<(f64, f64)> {
    let c0 = (1.0 + k).powi(2) / 4.0;
    let c1 = (1.0 - k).powi(2) / 4.0;
    let v = EI_RESIDUAL * c0 / (k * k - EI_RESIDUAL * c1);
    let raw = [
        (1.0 + v) / 4.0,
        (1.0 - v) / 2.0 * k,
        (1.0 + v) / 4.0 * k * k,
    ];
    let sum: f64 = raw.iter().sum();
    vec![
        (0.0, raw[0] / sum),
        (period_s / 2.0, raw[1] / sum),
        (period_s, raw[2] / sum),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} against {b}");
    }

    #[test]
    fn reproduces_figures_4_and_5_of_yeh26() {
        let table = [
            ("zv", [27.0, 0.0, 25.4, 55.5], Some((0.963, 1.038))),
            ("zvd", [7.31, 0.0, 6.44, 30.8], Some((0.835, 1.175))),
            ("fir", [19.7, 7.41, 12.7, 14.7], None),
            ("fir-zv", [5.33, 0.0, 3.23, 8.13], Some((0.806, 1.280))),
            ("fir-zvd", [1.44, 0.0, 0.82, 4.51], Some((0.699, 1.576))),
        ];
        for (name, percent, band) in table {
            let filter = Prefilter::named(name, 1.0, 0.1).unwrap();
            for (ratio, expected) in [0.8, 1.0, 1.2, 1.5].into_iter().zip(percent) {
                close(100.0 * filter.residual(ratio, 0.1), expected, 0.1);
            }
            match (filter.band_hz(1.0, 0.1, 0.05), band) {
                (Some(found), Some(expected)) => {
                    close(found.0, expected.0, 6e-4);
                    close(found.1, expected.1, 6e-4);
                }
                (found, expected) => assert_eq!(found, expected, "{name}"),
            }
        }
    }

    #[test]
    fn fir_leaves_two_percent_of_the_robots_mode() {
        let fir = Prefilter::named("fir", 6.34, 0.022).unwrap();
        close(100.0 * fir.residual(6.34, 0.022), 2.05, 0.1);
    }

    #[test]
    fn extra_insensitive_leaves_its_five_percent() {
        for damping in [0.0, 0.022, 0.1, 0.2] {
            let ei = Prefilter::named("ei", 3.0, damping).unwrap();
            close(ei.residual(3.0, damping), 0.05, 1e-12);
        }
        // [vNoorden21]: the undamped insensitivities at V = 5 %, ±3.18, 14.36, 19.97 %.
        let width = |name| {
            let filter = Prefilter::named(name, 1.0, 0.0).unwrap();
            let (low, high) = filter.band_hz(1.0, 0.0, 0.050_000_1).unwrap();
            (high - low) / 2.0
        };
        close(width("zv"), 0.0318, 1e-4);
        close(width("zvd"), 0.1436, 1e-4);
        close(width("ei"), 0.1997, 1e-4);
    }

    #[test]
    fn responses_are_consistent() {
        for name in NAMES {
            let filter = Prefilter::named(name, 6.34, 0.022).unwrap();
            let length = filter.length_s();
            // The centroid from the stages is the one from the ramp response.
            let terms = filter.truncated_powers(length, filter.boxes_s.len() as u32 + 1, true);
            close(length - terms, filter.centroid_s(), 1e-14);
            // S is the derivative of I, never falls, and ends at 1.
            let mut last = 0.0;
            let mut sum = 0.0;
            let n = 200_000;
            for i in 0..n {
                let t = length * (f64::from(i) + 0.5) / f64::from(n);
                let s = filter.step(t);
                assert!(s >= last - 1e-12, "{name}");
                last = s;
                sum += s * length / f64::from(n);
            }
            close(filter.ramp(length), sum, 1e-6);
            close(filter.step(length), 1.0, 0.0);
            close(filter.step_left(0.0), 0.0, 0.0);
        }
    }

    #[test]
    fn lengths_are_those_of_the_model() {
        let period = 1.0 / (6.34 * (1.0_f64 - 0.022 * 0.022).sqrt());
        let lengths = [0.0, 0.5, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0];
        for (name, expected) in NAMES.into_iter().zip(lengths) {
            let filter = Prefilter::named(name, 6.34, 0.022).unwrap();
            close(filter.length_s(), expected * period, 1e-15);
        }
        assert!(Prefilter::named("fir-zvdd", 6.34, 0.022).is_none());
    }
}
