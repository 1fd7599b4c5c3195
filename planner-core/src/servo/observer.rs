//! The velocity of a motor, observed through an encoder that is coarse and noisy.

use super::CYCLE_S;

/// Estimates a motor's velocity: from the encoder up to a bandwidth, above it from the
/// acceleration that the torque implies.
///
/// Three states, the position's error, velocity and disturbing acceleration, predicted over a
/// cycle `h` and corrected by the encoder with three equal poles `p = e^{−ωh}`:
///
/// ```text
/// x⁻ = x + h v + h²/2 (τ/J + d),   v⁻ = v + h (τ/J + d),   d⁻ = d
/// gains  1 − p³,   (3/2)(1 − p)²(1 + p)/h,   (1 − p)³/h²
/// ```
///
/// Source: vNoorden21, section on velocity estimation; the gains by pole placement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observer {
    gains: [f32; 3],
    /// Observed minus measured position at the last reading and what was predicted since, so
    /// that single precision is enough at any position.
    error: f32,
    velocity: f32,
    disturbance: f32,
    encoder: i32,
}

impl Observer {
    /// At rest at an encoder's reading, with the bandwidth `ω` in rad/s.
    pub fn new(bandwidth_rad_s: f32, encoder: i32) -> Self {
        let pole = libm::expf(-bandwidth_rad_s * CYCLE_S);
        let rest = 1.0 - pole;
        Self {
            gains: [
                1.0 - pole * pole * pole,
                1.5 * rest * rest * (1.0 + pole) / CYCLE_S,
                rest * rest * rest / (CYCLE_S * CYCLE_S),
            ],
            error: 0.0,
            velocity: 0.0,
            disturbance: 0.0,
            encoder,
        }
    }

    /// Takes a reading; yields the velocity in rad/s or m/s.
    pub fn correct(&mut self, encoder: i32, si_per_lsb: f32) -> f32 {
        let moved = encoder.wrapping_sub(self.encoder) as f32 * si_per_lsb;
        self.encoder = encoder;
        let missing = moved - self.error;
        let [position, velocity, disturbance] = self.gains;
        self.error = position * missing - missing;
        self.velocity += velocity * missing;
        self.disturbance += disturbance * missing;
        self.velocity
    }

    /// A cycle passes, in which the motor is accelerated by its torque.
    pub fn predict(&mut self, acceleration: f32) {
        let total = acceleration + self.disturbance;
        self.error += CYCLE_S * (self.velocity + CYCLE_S / 2.0 * total);
        self.velocity += CYCLE_S * total;
    }
}
