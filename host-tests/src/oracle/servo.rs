//! The servo of one joint in double precision: setpoint interpolation, position P, velocity PI,
//! feed-forward and torque limit, at 8 kHz.
//!
//! The structure is that of vNoorden21 (model, section 6). Everything is
//! reflected to the joint side of the gear: radians or metres, Nm or N.

/// Drive cycles per control tick.
pub const CYCLES_PER_TICK: u32 = 8;

/// Control tick in seconds.
pub const TICK_S: f64 = 1e-3;

/// Drive cycle in seconds.
pub const CYCLE_S: f64 = TICK_S / CYCLES_PER_TICK as f64;

/// Settings of one servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoConfig {
    /// Motor inertia, reflected: kg·m² or kg.
    pub motor_inertia: f64,
    /// Inertia that the acceleration feed-forward reckons with, motor and load.
    pub feed_forward_inertia: f64,
    /// Position gain in 1/s.
    pub position_gain: f64,
    /// Velocity gain: Nm·s/rad or N·s/m.
    pub velocity_gain: f64,
    /// Integral time of the velocity loop in seconds.
    pub integral_time_s: f64,
    /// Share of the velocity feed-forward, 0 to 1.
    pub velocity_feed_forward: f64,
    /// Share of the acceleration feed-forward, 0 to 1.
    pub acceleration_feed_forward: f64,
    /// Largest torque or force: Nm or N.
    pub torque_limit: f64,
    /// Bandwidth of the velocity observer in rad/s: below it the encoder counts, above it the
    /// integrated torque.
    pub observer_rad_s: f64,
}

/// Position, velocity and acceleration of one joint: rad or m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setpoint {
    /// Position.
    pub position: f64,
    /// Velocity.
    pub velocity: f64,
    /// Acceleration.
    pub acceleration: f64,
}

/// Cubic Hermite from `a` to `b`, `t_s` after `a`.
#[must_use]
pub fn interpolate(a: Setpoint, b: Setpoint, t_s: f64) -> Setpoint {
    let h = TICK_S;
    let slope = (b.position - a.position) / h;
    let c2 = (3.0 * slope - 2.0 * a.velocity - b.velocity) / h;
    let c3 = (a.velocity + b.velocity - 2.0 * slope) / (h * h);
    Setpoint {
        position: a.position + t_s * (a.velocity + t_s * (c2 + t_s * c3)),
        velocity: a.velocity + t_s * (2.0 * c2 + 3.0 * c3 * t_s),
        acceleration: 2.0 * c2 + 6.0 * c3 * t_s,
    }
}

/// Servo of one joint.
#[derive(Clone, Debug)]
pub struct Servo {
    config: ServoConfig,
    from: Setpoint,
    to: Setpoint,
    integral: f64,
    torque: f64,
    /// Observed position, velocity and disturbing acceleration.
    observed: [f64; 3],
}

impl Servo {
    /// At rest at `position`.
    #[must_use]
    pub fn new(config: ServoConfig, position: f64) -> Self {
        let rest = Setpoint {
            position,
            ..Setpoint::default()
        };
        Self {
            config,
            from: rest,
            to: rest,
            integral: 0.0,
            torque: 0.0,
            observed: [position, 0.0, 0.0],
        }
    }

    /// Ends a control tick: heads for `next` during the tick that begins.
    pub fn latch(&mut self, next: Setpoint) {
        self.from = self.to;
        self.to = next;
    }

    /// Drive cycle number `cycle` of the tick: torque from the encoder's reading.
    pub fn cycle(&mut self, cycle: u32, encoder: f64) -> f64 {
        let config = self.config;
        let t = f64::from(cycle) * CYCLE_S;
        let wanted = interpolate(self.from, self.to, t);
        // In the middle of the cycle, for which the torque is held.
        let acceleration = interpolate(self.from, self.to, t + CYCLE_S / 2.0).acceleration;

        self.correct(encoder);
        let velocity = config.position_gain * (wanted.position - encoder)
            + config.velocity_feed_forward * wanted.velocity;
        let error = velocity - self.observed[1];
        let ahead = config.acceleration_feed_forward * config.feed_forward_inertia * acceleration;
        let integral =
            self.integral + config.velocity_gain * error * CYCLE_S / config.integral_time_s;
        let torque = config.velocity_gain * error + integral + ahead;
        self.torque = torque.clamp(-config.torque_limit, config.torque_limit);
        // Anti-windup: at the limit the integral only unwinds.
        if self.torque == torque || (torque > 0.0) != (error > 0.0) {
            self.integral = integral;
        }
        self.predict();
        self.torque
    }

    /// Whether the torque stands at its limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        self.torque.abs() >= self.config.torque_limit
    }

    /// Observer: the encoder corrects all three states, three equal poles.
    fn correct(&mut self, encoder: f64) {
        let pole = (-self.config.observer_rad_s * CYCLE_S).exp();
        let error = encoder - self.observed[0];
        let gains = [
            1.0 - pole.powi(3),
            1.5 * (1.0 - pole).powi(2) * (1.0 + pole) / CYCLE_S,
            (1.0 - pole).powi(3) / (CYCLE_S * CYCLE_S),
        ];
        for (state, gain) in self.observed.iter_mut().zip(gains) {
            *state += gain * error;
        }
    }

    /// Observer: the torque carries them to the next cycle.
    fn predict(&mut self) {
        let [position, velocity, disturbance] = self.observed;
        let acceleration = self.torque / self.config.motor_inertia + disturbance;
        self.observed = [
            position + CYCLE_S * (velocity + CYCLE_S / 2.0 * acceleration),
            velocity + CYCLE_S * acceleration,
            disturbance,
        ];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: ServoConfig = ServoConfig {
        motor_inertia: 0.1,
        feed_forward_inertia: 0.1,
        position_gain: 200.0,
        velocity_gain: 100.0,
        integral_time_s: 0.0067,
        velocity_feed_forward: 1.0,
        acceleration_feed_forward: 1.0,
        torque_limit: 50.0,
        observer_rad_s: 1500.0,
    };

    /// A free motor of the servo's inertia; the position error after each tick.
    fn track(config: ServoConfig, path: impl Fn(f64) -> Setpoint, ticks: u32) -> Vec<f64> {
        let mut servo = Servo::new(config, path(0.0).position);
        let (mut position, mut velocity) = (path(0.0).position, 0.0);
        let mut errors = Vec::new();
        for tick in 0..ticks {
            servo.latch(path(f64::from(tick + 1) * TICK_S));
            for cycle in 0..CYCLES_PER_TICK {
                let acceleration = servo.cycle(cycle, position) / config.motor_inertia;
                position += CYCLE_S * (velocity + CYCLE_S / 2.0 * acceleration);
                velocity += CYCLE_S * acceleration;
            }
            errors.push(path(f64::from(tick + 1) * TICK_S).position - position);
        }
        errors
    }

    fn ramp(t: f64) -> Setpoint {
        Setpoint {
            position: 1.0 + 0.5 * t,
            velocity: 0.5,
            acceleration: 0.0,
        }
    }

    #[test]
    fn cubic_is_exact_for_cubics() {
        let at = |t: f64| Setpoint {
            position: 1.0 - 2.0 * t + 300.0 * t * t - 4e5 * t * t * t,
            velocity: -2.0 + 600.0 * t - 12e5 * t * t,
            acceleration: 600.0 - 24e5 * t,
        };
        for k in 0..8 {
            let t = f64::from(k) * CYCLE_S;
            let (found, expected) = (interpolate(at(0.0), at(TICK_S), t), at(t));
            assert!((found.position - expected.position).abs() < 1e-12);
            assert!((found.velocity - expected.velocity).abs() < 1e-9);
            assert!((found.acceleration - expected.acceleration).abs() < 1e-6);
        }
    }

    #[test]
    fn lag_on_a_ramp_is_v_over_kp_without_feed_forward_and_none_with() {
        let without = ServoConfig {
            velocity_feed_forward: 0.0,
            ..CONFIG
        };
        let lag = *track(without, ramp, 1000).last().unwrap();
        assert!((lag - 0.5 / 200.0).abs() < 1e-7, "{lag}");
        let lag = *track(CONFIG, ramp, 1000).last().unwrap();
        assert!(lag.abs() < 1e-9, "{lag}");
    }

    #[test]
    fn acceleration_feed_forward_takes_the_error_out_of_a_sine() {
        let sine = |t: f64| Setpoint {
            position: 0.1 * (20.0 * t).sin(),
            velocity: 2.0 * (20.0 * t).cos(),
            acceleration: -40.0 * (20.0 * t).sin(),
        };
        let worst = |config| {
            let errors = track(config, sine, 2000);
            errors[1000..].iter().fold(0.0_f64, |m, e| m.max(e.abs()))
        };
        let off = worst(ServoConfig {
            acceleration_feed_forward: 0.0,
            ..CONFIG
        });
        let on = worst(CONFIG);
        assert!(on < off / 20.0, "{on} {off}");
    }

    #[test]
    fn limited_torque_winds_nothing_up() {
        let step = |t: f64| Setpoint {
            position: if t > 0.0 { 0.1 } else { 0.0 },
            ..Setpoint::default()
        };
        let errors = track(CONFIG, step, 2000);
        // At 500 rad/s² it starts late to brake: some overshoot, then rest.
        let overshoot = errors.iter().fold(0.0_f64, |m, e| m.max(-e));
        assert!(overshoot > 0.0 && overshoot < 0.08, "{overshoot}");
        assert!(errors[1500..].iter().all(|e| e.abs() < 1e-6));
    }
}
