//! A payload that swings under the tool: a pendulum on a moving pivot.
//!
//! In one plane it is the pendulum of vNoorden21, with a hinge that has stiffness and damping:
//!
//! `θ̈ = −(b/ml²) θ̇ − (k/ml²) θ − [cos θ · Ẍ + sin θ (g + Z̈)]/l`
//!
//! On any path it swings in two directions. Two angles would be singular somewhere and would
//! have to be coupled by hand, so the state is the unit vector `r` from the pivot to the
//! payload, on the sphere, with `d` straight down and `θ` the angle between them:
//!
//! `r̈ = −|ṙ|² r + P[(−g ẑ − p̈)/l + (k/ml²)(θ/sin θ) d] − (b/ml²) ṙ`,   `P[f] = f − (f·r) r`
//!
//! where the hinge turns the payload back towards `d` along the great circle. In a plane that
//! is the equation above, term for term. Gravity, `z̈` and the curvature of the sphere couple
//! the two directions.
//!
//! The pivot is the tool. Its acceleration is the second difference of its positions, constant
//! for a tick; the pendulum takes eight steps (RK4) in one. It does not pull back at the robot,
//! and the gripper's hinge is the same in all directions. The payload's own acceleration,
//! without gravity, is `p̈ + l r̈`: above a limit the gripper loses it.

use crate::vector::{add, dot, norm, scale, sub};

/// Gravity in m/s².
const GRAVITY_M_S2: f64 = 9.81;

/// Steps in a tick.
const STEPS: u32 = 8;

/// Straight down.
const DOWN: [f64; 3] = [0.0, 0.0, -1.0];

/// The payload and the gripper that holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PayloadConfig {
    /// Mass in kg.
    pub mass_kg: f64,
    /// Distance from the pivot to the centre of mass in mm.
    pub length_mm: f64,
    /// Stiffness of the gripper's hinge in Nm/°.
    pub stiffness_nm_per_deg: f64,
    /// Damping of the gripper's hinge in Nm·s/°.
    pub damping_nm_s_per_deg: f64,
    /// Acceleration of the payload, without gravity, above which it peels off, in mm/s².
    pub peel_off_mm_s2: f64,
    /// How far it may be from its place after the stop, in mm.
    pub overshoot_limit_mm: f64,
}

impl PayloadConfig {
    /// The flexible gripper of vNoorden21, 2.4727 Hz. The printed k, b and l do not give the
    /// measured frequency; these do.
    pub const FLEXIBLE: Self = Self {
        mass_kg: 0.225,
        length_mm: 45.85,
        stiffness_nm_per_deg: 2.264e-4,
        damping_nm_s_per_deg: 9.02e-8,
        peel_off_mm_s2: 20_000.0,
        overshoot_limit_mm: 15.0,
    };

    /// The stiff gripper, 3.5906 Hz.
    pub const STIFF: Self = Self {
        mass_kg: 0.225,
        length_mm: 22.95,
        stiffness_nm_per_deg: 1.686e-4,
        damping_nm_s_per_deg: 1.12e-7,
        peel_off_mm_s2: 50_000.0,
        overshoot_limit_mm: 15.0,
    };

    /// Length in m.
    fn length_m(&self) -> f64 {
        self.length_mm * 1e-3
    }

    /// `m l²`.
    fn inertia_kg_m2(&self) -> f64 {
        self.mass_kg * self.length_m() * self.length_m()
    }

    /// `k` in Nm/rad.
    fn stiffness_nm_per_rad(&self) -> f64 {
        self.stiffness_nm_per_deg.to_degrees()
    }

    /// `b` in Nm·s/rad.
    fn damping_nm_s_per_rad(&self) -> f64 {
        self.damping_nm_s_per_deg.to_degrees()
    }
}

/// The payload at the end of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PayloadSample {
    /// Where it is, in mm.
    pub position_mm: [f64; 3],
    /// How far that is from where it hangs at rest under the tool, in mm.
    pub swing_mm: f64,
    /// Its largest acceleration in this tick, without gravity, in mm/s².
    pub acceleration_mm_s2: f64,
}

/// Direction of the payload and its rate.
#[derive(Clone, Copy, Debug)]
struct State {
    r: [f64; 3],
    rate: [f64; 3],
}

/// A payload under a moving tool.
#[derive(Clone, Debug)]
pub struct Pendulum {
    config: PayloadConfig,
    step_s: f64,
    /// The pivot in the last two ticks, newest last, in m.
    pivot: [[f64; 3]; 2],
    state: State,
}

impl Pendulum {
    /// Hanging at rest under a tool at rest, with a tool position every `tick_s`.
    #[must_use]
    pub fn new(config: PayloadConfig, tick_s: f64, tool_mm: [f64; 3]) -> Self {
        Self {
            config,
            step_s: tick_s / f64::from(STEPS),
            pivot: [scale(1e-3, tool_mm); 2],
            state: State {
                r: DOWN,
                rate: [0.0; 3],
            },
        }
    }

    /// Turns the payload by an angle in rad in the direction of `[x, y]`, and lets go.
    pub fn pluck(&mut self, angle_rad: f64, [x, y]: [f64; 2]) {
        let (sin, cos) = angle_rad.sin_cos();
        let length = x.hypot(y);
        self.state = State {
            r: [sin * x / length, sin * y / length, -cos],
            rate: [0.0; 3],
        };
    }

    /// Pushes the payload with a rate in rad/s.
    pub fn push(&mut self, rate_rad_s: [f64; 3]) {
        self.state.rate = tangential(&self.state.r, add(self.state.rate, rate_rad_s));
    }

    /// Moves the pivot to a position of the tool within one tick.
    pub fn step(&mut self, tool_mm: [f64; 3]) -> PayloadSample {
        let newest = scale(1e-3, tool_mm);
        let [before, now] = self.pivot;
        let tick_s = self.step_s * f64::from(STEPS);
        let bend = sub(sub(newest, now), sub(now, before));
        let pivot = scale(1.0 / (tick_s * tick_s), bend);
        self.pivot = [now, newest];
        let mut acceleration_mm_s2 = 0.0_f64;
        for _ in 0..STEPS {
            let turning = self.derivative(&self.state, pivot).rate;
            let payload = add(pivot, scale(self.config.length_m(), turning));
            acceleration_mm_s2 = acceleration_mm_s2.max(norm(payload) * 1e3);
            self.runge_kutta(pivot);
        }
        let hanging = scale(self.config.length_mm, sub(self.state.r, DOWN));
        PayloadSample {
            position_mm: add(tool_mm, scale(self.config.length_mm, self.state.r)),
            swing_mm: norm(hanging),
            acceleration_mm_s2,
        }
    }

    /// Energy in J against hanging at rest, while the pivot stands.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        let State { r, rate } = &self.state;
        let config = &self.config;
        let angle = angle(r);
        let height_m = config.length_m() * (1.0 + r[2]);
        0.5 * config.inertia_kg_m2() * dot(*rate, *rate)
            + config.mass_kg * GRAVITY_M_S2 * height_m
            + 0.5 * config.stiffness_nm_per_rad() * angle * angle
    }

    /// The angle from straight down in the x and y direction, for small angles in rad.
    #[must_use]
    pub fn lean(&self) -> [f64; 2] {
        [self.state.r[0], self.state.r[1]]
    }

    fn derivative(&self, state: &State, pivot: [f64; 3]) -> State {
        let config = &self.config;
        let inertia = config.inertia_kg_m2();
        let field = scale(
            1.0 / config.length_m(),
            sub([0.0, 0.0, -GRAVITY_M_S2], pivot),
        );
        let (angle, sin) = (angle(&state.r), norm(tangential(&state.r, DOWN)));
        let steepness = if sin > 1e-12 { angle / sin } else { 1.0 };
        let hinge = scale(config.stiffness_nm_per_rad() / inertia * steepness, DOWN);
        let drive = tangential(&state.r, add(field, hinge));
        let drag = scale(config.damping_nm_s_per_rad() / inertia, state.rate);
        let inward = scale(dot(state.rate, state.rate), state.r);
        State {
            r: state.rate,
            rate: sub(sub(drive, drag), inward),
        }
    }

    fn runge_kutta(&mut self, pivot: [f64; 3]) {
        let h = self.step_s;
        let start = self.state;
        let ahead = |d: &State, h: f64| State {
            r: add(start.r, scale(h, d.r)),
            rate: add(start.rate, scale(h, d.rate)),
        };
        let d1 = self.derivative(&start, pivot);
        let d2 = self.derivative(&ahead(&d1, h / 2.0), pivot);
        let d3 = self.derivative(&ahead(&d2, h / 2.0), pivot);
        let d4 = self.derivative(&ahead(&d3, h), pivot);
        let mean = |a: [f64; 3], b, c, d| scale(1.0 / 6.0, add(add(a, d), scale(2.0, add(b, c))));
        let end = ahead(
            &State {
                r: mean(d1.r, d2.r, d3.r, d4.r),
                rate: mean(d1.rate, d2.rate, d3.rate, d4.rate),
            },
            h,
        );
        // What the steps leave of the sphere is put back on it.
        let r = scale(1.0 / norm(end.r), end.r);
        self.state = State {
            rate: tangential(&r, end.rate),
            r,
        };
    }
}

/// The angle of a direction from straight down.
fn angle(r: &[f64; 3]) -> f64 {
    r[0].hypot(r[1]).atan2(-r[2])
}

/// The part of a vector that is tangential to the sphere at `r`.
fn tangential(r: &[f64; 3], vector: [f64; 3]) -> [f64; 3] {
    sub(vector, scale(dot(vector, *r), *r))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const TICK_S: f64 = 1e-3;

    /// Frequency of a free decay from a small angle, by its zero crossings over ten periods.
    fn frequency_hz(config: PayloadConfig, direction: [f64; 2]) -> f64 {
        let mut pendulum = Pendulum::new(config, TICK_S, [0.0; 3]);
        pendulum.pluck(1e-3, direction);
        let along = |lean: [f64; 2]| lean[0] * direction[0] + lean[1] * direction[1];
        let mut crossings = Vec::new();
        let mut before = along(pendulum.lean());
        for k in 0..12_000 {
            pendulum.step([0.0; 3]);
            let now = along(pendulum.lean());
            if before > 0.0 && now <= 0.0 {
                crossings.push((f64::from(k) + before / (before - now)) * TICK_S);
            }
            before = now;
        }
        let periods = (crossings.len() - 1) as f64;
        periods / (crossings[crossings.len() - 1] - crossings[0])
    }

    #[test]
    fn eigenfrequencies_are_those_of_the_grippers() {
        for (config, expected_hz) in [
            (PayloadConfig::FLEXIBLE, 2.4727),
            (PayloadConfig::STIFF, 3.5906),
        ] {
            for direction in [[1.0, 0.0], [0.0, 1.0], [0.6, -0.8]] {
                let found_hz = frequency_hz(config, direction);
                assert!((found_hz / expected_hz - 1.0).abs() < 1e-3, "{found_hz}");
            }
        }
    }

    #[test]
    fn damping_is_that_of_the_grippers() {
        // ζ = b / (2 ω m l²): 3e-4 to 2e-3 in vNoorden21; the decay of the energy is 2 ζω.
        for (config, omega) in [
            (PayloadConfig::FLEXIBLE, 2.0 * PI * 2.4727),
            (PayloadConfig::STIFF, 2.0 * PI * 3.5906),
        ] {
            let mut pendulum = Pendulum::new(config, TICK_S, [0.0; 3]);
            pendulum.pluck(0.01, [1.0, 0.0]);
            let start = pendulum.energy_j();
            for _ in 0..20_000 {
                pendulum.step([0.0; 3]);
            }
            let found = (start / pendulum.energy_j()).ln() / 20.0 / 2.0 / omega;
            let inertia = config.mass_kg * (config.length_mm / 1e3).powi(2);
            let expected = config.damping_nm_s_per_deg * 180.0 / PI / (2.0 * omega * inertia);
            assert!(
                (found / expected - 1.0).abs() < 0.02,
                "{found} of {expected}"
            );
            assert!((3e-4..2e-3).contains(&found));
        }
    }

    #[test]
    fn energy_is_kept_without_damping() {
        let config = PayloadConfig {
            damping_nm_s_per_deg: 0.0,
            ..PayloadConfig::FLEXIBLE
        };
        // in a plane, round a cone, and over the top
        for (angle, push) in [
            (1.2, [0.0; 3]),
            (0.7, [3.0, 9.0, 0.0]),
            (2.5, [0.0, 20.0, 1.0]),
        ] {
            let mut pendulum = Pendulum::new(config, TICK_S, [3.0, -4.0, 500.0]);
            pendulum.pluck(angle, [1.0, 0.0]);
            pendulum.push(push);
            let start = pendulum.energy_j();
            for _ in 0..10_000 {
                pendulum.step([3.0, -4.0, 500.0]);
            }
            let change = pendulum.energy_j() / start - 1.0;
            assert!(change.abs() < 1e-6, "{change} from {angle}");
        }
    }

    #[test]
    fn in_a_plane_it_is_the_pendulum_of_the_thesis() {
        // The printed equation, stepped 100 times a tick with the same pivot accelerations.
        let config = PayloadConfig::FLEXIBLE;
        let pivot_mm = |k: f64| {
            let t = k * TICK_S;
            [60.0 * (4.0 * t).sin(), 0.0, 25.0 * (11.0 * t).cos()]
        };
        let (l, m) = (config.length_mm / 1e3, config.mass_kg);
        let per_rad = 180.0 / PI / (m * l * l);
        let (k, b) = (
            config.stiffness_nm_per_deg * per_rad,
            config.damping_nm_s_per_deg * per_rad,
        );
        let mut pendulum = Pendulum::new(config, TICK_S, pivot_mm(0.0));
        pendulum.pivot = [scale(1e-3, pivot_mm(-1.0)), scale(1e-3, pivot_mm(0.0))];
        let (mut theta, mut rate) = (0.0_f64, 0.0_f64);
        for tick in 1..3000 {
            let at = |back: f64| pivot_mm(f64::from(tick) - back);
            let second = |axis: usize| (at(0.0)[axis] - 2.0 * at(1.0)[axis] + at(2.0)[axis]) * 1e3;
            let (ax, az) = (second(0), second(2));
            let turn = |theta: f64, rate: f64| {
                -b * rate - k * theta - (theta.cos() * ax + theta.sin() * (9.81 + az)) / l
            };
            let h = TICK_S / 100.0;
            for _ in 0..100 {
                // midpoint rule
                let (half, half_rate) =
                    (theta + h / 2.0 * rate, rate + h / 2.0 * turn(theta, rate));
                theta += h * half_rate;
                rate += h * turn(half, half_rate);
            }
            let sample = pendulum.step(at(0.0));
            let swing_mm = 2.0 * config.length_mm * (theta / 2.0).sin().abs();
            assert!((sample.swing_mm - swing_mm).abs() < 1e-3, "tick {tick}");
        }
    }

    #[test]
    fn a_hanging_payload_moves_as_its_pivot() {
        let mut pendulum = Pendulum::new(PayloadConfig::STIFF, TICK_S, [0.0; 3]);
        let mut last = PayloadSample::default();
        for k in 0..200 {
            let t = f64::from(k) * TICK_S;
            last = pendulum.step([0.0, 0.0, 0.5 * 3000.0 * t * t]);
        }
        assert!((last.acceleration_mm_s2 - 3000.0).abs() < 1e-3);
        assert!(last.swing_mm < 1e-9);
    }
}
