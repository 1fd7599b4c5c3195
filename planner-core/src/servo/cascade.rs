//! The loops of one joint, one within the other.

use super::observer::Observer;
use super::{CYCLE_S, CYCLES_PER_TICK, Cubic, Knot, SIXTEENTHS, ServoConfig, ServoError, Travel};

/// The servo of one joint: position P around velocity PI, with feed-forward of velocity and
/// acceleration, at 8 kHz.
///
/// ```text
/// v* = K_p (q* − q) + k_v q̇*
/// τ  = K_v (e + ∫e / T_i) + k_a J q̈*,    e = v* − v̂,    |τ| ≤ τ_max
/// ```
///
/// `q*` and its derivatives come from a [`Cubic`] between setpoints, `v̂` from an observer. The
/// acceleration is that in the middle of the cycle for which the torque is held. At the torque
/// limit the integral only unwinds.
///
/// [`Servo::cycle`] cannot fail; its cost is constant.
#[derive(Clone, Debug)]
pub struct Servo {
    config: ServoConfig,
    si_per_lsb: f32,
    cubic: Cubic,
    to: Knot,
    observer: Observer,
    integral: f32,
    torque: f32,
    lag: f32,
}

impl Servo {
    /// At rest at a position in 2^-26 rad or 2^-19 mm.
    ///
    /// # Errors
    /// [`ServoError`] names the first setting that is out of range.
    pub fn new(config: &ServoConfig, position: i32) -> Result<Self, ServoError> {
        config.validate()?;
        let rest = Knot {
            position,
            velocity: 0.0,
        };
        Ok(Self {
            config: *config,
            si_per_lsb: config.travel.si_per_lsb(),
            cubic: Cubic::new(rest, rest, config.travel),
            to: rest,
            observer: Observer::new(config.gains.observer_rad_s, position),
            integral: 0.0,
            torque: 0.0,
            lag: 0.0,
        })
    }

    /// Begins a control tick, in which the joint goes on to `next`.
    pub fn latch(&mut self, next: Knot) {
        self.cubic = Cubic::new(self.to, next, self.config.travel);
        self.to = next;
    }

    /// The torque (Nm) or force (N) for drive cycle `cycle` of the tick, 0 to 7, from the
    /// encoder's reading in the setpoints' unit.
    pub fn cycle(&mut self, cycle: u32, encoder: i32) -> f32 {
        let config = &self.config;
        let gains = &config.gains;
        let sixteenths = cycle.min(CYCLES_PER_TICK) * (SIXTEENTHS / CYCLES_PER_TICK);
        let lag = self.cubic.way_to(encoder, sixteenths).wrapping_neg();
        let lag = lag as f32 * (self.si_per_lsb / 65_536.0);
        self.lag = lag;
        let wanted = self.cubic.velocity(sixteenths) * self.si_per_lsb;
        let acceleration = self.cubic.acceleration(sixteenths + 1) * self.si_per_lsb;

        let observed = self.observer.correct(encoder, self.si_per_lsb);
        let target = gains.position_gain * lag + gains.velocity_feed_forward * wanted;
        let error = target - observed;
        let ahead = gains.acceleration_feed_forward * config.total_inertia * acceleration;
        let proportional = gains.velocity_gain * error;
        let integral = self.integral + proportional * (CYCLE_S / gains.integral_time_s);
        let torque = proportional + integral + ahead;
        self.torque = torque.clamp(-gains.torque_limit, gains.torque_limit);
        let is_free = self.torque == torque;
        if is_free || (torque > 0.0) != (error > 0.0) {
            self.integral = integral;
        }
        self.observer.predict(self.torque / config.motor_inertia);
        self.torque
    }

    /// How far the encoder was behind the setpoint in the last cycle, in rad or m: what a drive
    /// tells the controller of itself ([`crate::following_error`]).
    #[must_use]
    pub const fn following_error(&self) -> f32 {
        self.lag
    }

    /// Whether the torque stands at its limit.
    #[must_use]
    pub fn is_saturated(&self) -> bool {
        self.torque.abs() >= self.config.gains.torque_limit
    }

    /// Which way the joint moves.
    #[must_use]
    pub const fn travel(&self) -> Travel {
        self.config.travel
    }
}
