//! One mode of vibration, excited by its moving base.
//!
//! A mass on a spring and a damper whose other ends move with the base `x(t)`; its
//! deflection `w = y − x` obeys
//!
//! `ẅ + 2ζω ẇ + ω² w = −ẍ`, and the mass accelerates by `ÿ = −ω² w − 2ζω ẇ`.

use std::f64::consts::TAU;

/// Undamped natural frequency and damping ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency in hertz.
    pub frequency_hz: f64,
    /// Damping ratio, below 1.
    pub damping: f64,
}

/// The robot of Yeh26.
impl Default for Mode {
    fn default() -> Self {
        Self {
            frequency_hz: 6.340,
            damping: 0.022,
        }
    }
}

impl Mode {
    /// `ω` in rad/s.
    #[must_use]
    pub fn omega(&self) -> f64 {
        TAU * self.frequency_hz
    }

    /// Damped period `T_d` in seconds.
    #[must_use]
    pub fn damped_period_s(&self) -> f64 {
        1.0 / (self.frequency_hz * (1.0 - self.damping * self.damping).sqrt())
    }

    /// Acceleration of the mass, `ÿ = −ω² w − 2ζω ẇ`.
    #[must_use]
    pub fn acceleration(&self, deflection: f64, rate: f64) -> f64 {
        let omega = self.omega();
        -omega * omega * deflection - 2.0 * self.damping * omega * rate
    }

    /// `w, ẇ` after a free decay of `t_s`, exactly.
    #[must_use]
    pub fn decay(&self, (deflection, rate): (f64, f64), t_s: f64) -> (f64, f64) {
        let omega = self.omega();
        let sigma = self.damping * omega;
        let damped = omega * (1.0 - self.damping * self.damping).sqrt();
        let (sin, cos) = (damped * t_s).sin_cos();
        let size = (-sigma * t_s).exp();
        let lean = (rate + sigma * deflection) / damped;
        (
            size * (deflection * cos + lean * sin),
            size * (rate * cos - (omega * omega * deflection + sigma * rate) / damped * sin),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decay_solves_the_equation_of_motion() {
        let mode = Mode {
            frequency_hz: 6.34,
            damping: 0.3,
        };
        let start = (1.0, -20.0);
        let h = 1e-5;
        for k in 0..100 {
            let t = f64::from(k) * 3e-3;
            let (before, now, after) = (
                mode.decay(start, t - h),
                mode.decay(start, t),
                mode.decay(start, t + h),
            );
            assert!(((after.0 - before.0) / (2.0 * h) - now.1).abs() < 1e-3);
            let acceleration = (after.1 - before.1) / (2.0 * h);
            assert!((acceleration - mode.acceleration(now.0, now.1)).abs() < 0.05);
        }
        // Two steps are one.
        let twice = mode.decay(mode.decay(start, 0.01), 0.02);
        let once = mode.decay(start, 0.03);
        assert!((twice.0 - once.0).abs() < 1e-13 && (twice.1 - once.1).abs() < 1e-11);
    }
}
