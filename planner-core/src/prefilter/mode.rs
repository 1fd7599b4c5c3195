//! The mode of vibration that a prefilter suppresses.

use core::f64::consts::PI;

/// A damped mode: natural frequency and damping ratio with what follows from them.
///
/// With `f_n` the natural frequency (undamped) and `ζ` the damping ratio:
///
/// ```text
/// ω = 2π f_n          ω_d = ω √(1 − ζ²)          T_d = 2π / ω_d
/// K = exp(−ζ π / √(1 − ζ²)): what is left of an amplitude after half a period
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Natural frequency (undamped) in Hz.
    pub frequency_hz: f64,
    /// Damping ratio, 0 to below 1.
    pub damping: f64,
}

impl Mode {
    /// `ζω`, the decay rate in 1/s.
    #[must_use]
    pub fn decay_per_s(&self) -> f64 {
        2.0 * PI * self.frequency_hz * self.damping
    }

    /// `ω_d`, the damped angular frequency in rad/s.
    #[must_use]
    pub fn damped_rad_s(&self) -> f64 {
        2.0 * PI * self.frequency_hz * self.root()
    }

    /// `T_d`, the damped period in seconds.
    #[must_use]
    pub fn damped_period_s(&self) -> f64 {
        1.0 / (self.frequency_hz * self.root())
    }

    /// `K`, the amplitude ratio over half a damped period, 0 to 1.
    #[must_use]
    pub fn half_period_decay(&self) -> f64 {
        libm::exp(-self.damping * PI / self.root())
    }

    fn root(&self) -> f64 {
        libm::sqrt(1.0 - self.damping * self.damping)
    }
}
