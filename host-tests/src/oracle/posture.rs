//! Tajima's minimum amplitude integral, by direct search.

use std::f64::consts::PI;

/// Intervals of Simpson's rule between two places where the integrand has a kink.
const INTERVALS: u32 = 64;

/// The two zeros that minimise `∫ |sinc(πf/f1) sinc(πf/f2)| df` over the frequencies met while
/// accelerating, `f0` to `f_a = f0 + gF (1/f1 + 1/f2) / 2`, as ratios to `f0`, the lower first;
/// `rho = gF/f0²`. Both zeros stay within that range. `None` if the range reaches zero.
#[must_use]
pub fn minimum_amplitude_integral(rho: f64) -> Option<[f64; 2]> {
    let cost = |[f1, f2]: [f64; 2]| {
        let last = 1.0 + rho * (1.0 / f1 + 1.0 / f2) / 2.0;
        let (low, high) = (last.min(1.0), last.max(1.0));
        let inside = |zero: f64| (low..=high).contains(&zero);
        (last > 0.0 && inside(f1) && inside(f2)).then(|| amplitude_integral([f1, f2], low, high))
    };
    // both zeros in the middle of the range, if there is one: f = 1 + ρ/2f
    let middle = (1.0 + (1.0 + 2.0 * rho).sqrt()) / 2.0;
    let mut best = [middle; 2];
    let mut least = cost(best)?;
    let mut step = rho.abs() / 4.0;
    while step > 1e-9 {
        let directions = (-1..=1).flat_map(|i| (-1..=1).map(move |k| (f64::from(i), f64::from(k))));
        let mut better = None;
        for (i, k) in directions {
            let zeros = [best[0] + i * step, best[1] + k * step];
            if let Some(value) = cost(zeros).filter(|&value| value < least) {
                least = value;
                better = Some(zeros);
            }
        }
        match better {
            Some(zeros) => best = zeros,
            None => step /= 2.0,
        }
    }
    Some([best[0].min(best[1]), best[0].max(best[1])])
}

fn amplitude_integral([f1, f2]: [f64; 2], low: f64, high: f64) -> f64 {
    let value = |f: f64| (sinc(f / f1) * sinc(f / f2)).abs();
    let mut kinks = [low, f1, f2, high];
    kinks.sort_by(f64::total_cmp);
    kinks
        .windows(2)
        .map(|ends| {
            let h = (ends[1] - ends[0]) / f64::from(INTERVALS);
            let sum: f64 = (0..=INTERVALS)
                .map(|i| {
                    let weight = match i {
                        0 | INTERVALS => 1.0,
                        i if i % 2 == 1 => 4.0,
                        _ => 2.0,
                    };
                    weight * value(ends[0] + f64::from(i) * h)
                })
                .sum();
            sum * h / 3.0
        })
        .sum()
}

/// `sin(πx) / πx`
fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_change_puts_the_zeros_at_the_quarter_points() {
        // where |(x − a)(x + a)| has the least area over [−1, 1]: a = 1/2
        for rho in [1e-3, -1e-3] {
            let [lower, upper] = minimum_amplitude_integral(rho).unwrap();
            let range = (1.0 + rho - 1.0_f64).abs();
            assert!(
                ((upper - lower) / range - 0.5).abs() < 2e-3,
                "{lower} {upper}"
            );
            assert!(((upper + lower) / 2.0 - 1.0 - rho / 2.0).abs() < 2e-6);
        }
        assert_eq!(minimum_amplitude_integral(-0.6), None);
    }
}
