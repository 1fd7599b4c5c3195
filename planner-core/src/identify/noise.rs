//! What a fit leaves of a record, taken as noise.

use crate::math::sin_cos_f32;

use super::decay::Fit;

/// What a fit leaves of a record.
pub struct Noise {
    /// Sum of squares.
    pub squares: f32,
    /// Of a sample.
    pub variance: f32,
    /// Correlation of a sample with the next, 0 unless it stands out.
    correlation: f32,
    period_s: f32,
}

impl Noise {
    /// Takes the fit off the samples and looks at the rest.
    pub fn of<const N: usize>(fit: &Fit<N>, samples: &mut [f32], period_s: f32) -> Self {
        fit.model.add_to(samples, period_s, -1.0);
        let next = samples.iter().skip(1);
        let products: f32 = samples.iter().zip(next).map(|(a, b)| a * b).sum();
        let correlation = products / fit.squares.max(f32::MIN_POSITIVE);
        // Of white noise, three times the standard deviation.
        let stands_out = correlation * correlation * samples.len() as f32 > 9.0;
        Self {
            squares: fit.squares,
            variance: fit.noise_variance(samples.len()),
            correlation: if stands_out {
                correlation.clamp(0.0, 0.999)
            } else {
                0.0
            },
            period_s,
        }
    }

    /// The variance that white noise as strong as this at a frequency would have; that of a
    /// sample at the least.
    ///
    /// First-order noise has the density `(1 - ρ²) / (1 - 2ρ cos ωT + ρ²)` at `ω`.
    pub fn variance_at(&self, turn: f32) -> f32 {
        let rho = self.correlation;
        let (_, cos) = sin_cos_f32(turn * self.period_s);
        let density = (1.0 - rho * rho) / (1.0 - 2.0 * rho * cos + rho * rho);
        self.variance * density.max(1.0)
    }
}
