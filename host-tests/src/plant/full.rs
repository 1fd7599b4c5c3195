//! The full plant: drives, flexible joints, links, and a mode at the end effector.
//!
//! | part | model |
//! |---|---|
//! | setpoints | one tick of transport, then one tick of cubic interpolation |
//! | drive | the core's [`Servo`], 8 kHz, encoder on the motor with seeded noise |
//! | joint | motor inertia, spring and damper, link |
//! | links | [`super::Body`]: planar two-link dynamics, quill and wrist on their own; or three arms and a platform, yaw on its own |
//! | end effector | [`Mode`] in X and Y, rigid in Z; its mass pulls back at the arm |
//!
//! The mechanics run in SI units at 24 kHz (RK4). Gravity is balanced, friction
//! and the gyroscopic pull of the wrist are left out.

use planner_core::servo::{CYCLE_HZ, CYCLES_PER_TICK, Knot, Servo};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::body::{Accelerations, Load};
use super::config::{FullConfig, JOINTS, JointConfig};
use super::mode::Mode;

/// Mechanical steps per drive cycle.
const STEPS_PER_CYCLE: u32 = 3;

/// Mechanical step in seconds.
const STEP_S: f64 = 1.0 / (CYCLE_HZ * STEPS_PER_CYCLE) as f64;

/// Ticks until the plant has carried out a setpoint: one of transport, one of
/// interpolation. The output of call `k + 1` belongs to the setpoint of call `k`.
pub const LATENCY_TICKS: usize = 2;

// Layout of the mechanical state, metres and radians.
const MOTOR: usize = 0;
const LINK: usize = 4;
const DEFLECTION: usize = 8;
/// Rates follow the positions in the same order.
const RATES: usize = 10;
const STATES: usize = 20;

type State = [f64; STATES];

/// Setpoint of one tick: rad, a quill's mm, and their derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointSetpoint {
    /// Joint positions.
    pub position: [f64; JOINTS],
    /// Joint velocities.
    pub velocity: [f64; JOINTS],
    /// Joint accelerations.
    pub acceleration: [f64; JOINTS],
}

impl JointSetpoint {
    /// Standing still.
    #[must_use]
    pub fn at_rest(position: [f64; JOINTS]) -> Self {
        Self {
            position,
            ..Self::default()
        }
    }

    fn joint(&self, i: usize, joint: &JointConfig, si: f64) -> Knot {
        Knot {
            position: bits(joint, self.position[i] * si),
            velocity: self.velocity[i] as f32,
        }
    }
}

/// A position in radians or metres as a servo counts it.
fn bits(joint: &JointConfig, position: f64) -> i32 {
    (position / f64::from(joint.servo.travel.si_per_lsb())).round() as i32
}

/// What the plant shows at the end of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlantOutput {
    /// Tool position in millimetres.
    pub tool_mm: [f64; 3],
    /// Tool acceleration in mm/s²: what an accelerometer reads.
    pub tool_acceleration_mm_s2: [f64; 3],
    /// Where the tool would be without the end effector's deflection, millimetres.
    pub flange_mm: [f64; 3],
    /// Link side of the joints: rad, a quill's mm.
    pub joint_position: [f64; JOINTS],
    /// Motor side of the joints, without noise: rad, a quill's mm.
    pub motor_position: [f64; JOINTS],
    /// What the drives tell of how far the motors are behind their setpoints, with the encoders'
    /// noise: rad, a quill's mm.
    pub following_error: [f64; JOINTS],
    /// Drives whose torque stands at its limit.
    pub saturated: [bool; JOINTS],
}

/// The full plant; see the module.
#[derive(Clone, Debug)]
pub struct FullPlant {
    config: FullConfig,
    servos: [Servo; JOINTS],
    pending: JointSetpoint,
    state: State,
    rng: ChaCha8Rng,
}

impl FullPlant {
    /// At rest at the configuration's start.
    ///
    /// # Panics
    /// If the settings of a servo are out of range:
    /// [`PlantConfig::check`](crate::plant_config::PlantConfig::check) finds them.
    #[must_use]
    pub fn new(config: FullConfig) -> Self {
        let si = config.body.si();
        let start: [f64; JOINTS] = std::array::from_fn(|i| config.start[i] * si[i]);
        let mut state = [0.0; STATES];
        state[MOTOR..LINK].copy_from_slice(&start);
        state[LINK..DEFLECTION].copy_from_slice(&start);
        let servo = |i: usize| {
            let joint = &config.joints[i];
            Servo::new(&joint.servo, bits(joint, start[i])).expect("servos within their ranges")
        };
        Self {
            servos: std::array::from_fn(servo),
            pending: JointSetpoint::at_rest(config.start),
            rng: ChaCha8Rng::seed_from_u64(config.seed),
            state,
            config,
        }
    }

    /// One control tick of 1 ms: carries out the setpoint of the last call, takes
    /// up this one, and shows the state at the end of the tick.
    pub fn step(&mut self, setpoint: JointSetpoint) -> PlantOutput {
        let si = self.config.body.si();
        for (i, servo) in self.servos.iter_mut().enumerate() {
            servo.latch(self.pending.joint(i, &self.config.joints[i], si[i]));
        }
        self.pending = setpoint;
        for cycle in 0..CYCLES_PER_TICK {
            let mut torque = [0.0; JOINTS];
            for (i, servo) in self.servos.iter_mut().enumerate() {
                let joint = &self.config.joints[i];
                let noise = joint.encoder_noise * self.rng.random_range(-1.0..=1.0);
                let encoder = bits(joint, self.state[MOTOR + i] + noise);
                torque[i] = servo.cycle(cycle, encoder).into();
            }
            let mode = self.mode();
            for _ in 0..STEPS_PER_CYCLE {
                self.state = self.runge_kutta(&self.state, &torque, mode);
            }
        }
        self.output()
    }

    /// The plant now.
    #[must_use]
    pub fn output(&self) -> PlantOutput {
        let s = &self.state;
        let flange_mm = self.flange_mm();
        let mode = self.mode();
        let swing = |axis: usize| {
            let (w, rate) = (s[DEFLECTION + axis], s[RATES + DEFLECTION + axis]);
            mode.acceleration(w, rate) * 1e3
        };
        let si = self.config.body.si();
        let height = self.accelerations(s, mode).flange[2] * 1e3;
        PlantOutput {
            tool_mm: [
                flange_mm[0] + s[DEFLECTION] * 1e3,
                flange_mm[1] + s[DEFLECTION + 1] * 1e3,
                flange_mm[2],
            ],
            tool_acceleration_mm_s2: [swing(0), swing(1), height],
            flange_mm,
            joint_position: std::array::from_fn(|i| s[LINK + i] / si[i]),
            motor_position: std::array::from_fn(|i| s[MOTOR + i] / si[i]),
            following_error: std::array::from_fn(|i| {
                f64::from(self.servos[i].following_error()) / si[i]
            }),
            saturated: std::array::from_fn(|i| self.servos[i].is_saturated()),
        }
    }

    /// Deflects the end effector in X and Y and lets go.
    pub fn pluck(&mut self, deflection_mm: [f64; 2]) {
        for (axis, mm) in deflection_mm.into_iter().enumerate() {
            self.state[DEFLECTION + axis] = mm * 1e-3;
            self.state[RATES + DEFLECTION + axis] = 0.0;
        }
    }

    /// Puts the motors elsewhere: their springs are wound then. Joints in rad, a quill's in mm.
    #[cfg(test)]
    pub(super) fn place_motors(&mut self, position: [f64; JOINTS]) {
        let si = self.config.body.si();
        for (i, position) in position.into_iter().enumerate() {
            self.state[MOTOR + i] = position * si[i];
        }
    }

    /// Mechanical energy in joules.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        let s = &self.state;
        let rate = |i: usize| s[RATES + i];
        let (q, rates) = (self.links(s), self.link_rates(s));
        let inertia = self.link_inertia();
        let mut energy = self.config.body.kinetic_j(q, rates, inertia);
        for (i, joint) in self.config.joints.iter().enumerate() {
            energy += 0.5 * f64::from(joint.servo.motor_inertia) * rate(MOTOR + i).powi(2);
            energy += 0.5 * joint.stiffness * (s[MOTOR + i] - s[LINK + i]).powi(2);
        }
        let omega = self.mode().omega();
        let flange = self.config.body.flange_velocity(q, rates);
        for (axis, flange) in flange.into_iter().enumerate() {
            let speed = flange + rate(DEFLECTION + axis);
            let swing = omega * s[DEFLECTION + axis];
            energy += 0.5 * self.config.tool_mass_kg * (speed * speed + swing * swing);
        }
        energy
    }

    fn flange_mm(&self) -> [f64; 3] {
        let pose = self.config.body.forward(self.links(&self.state));
        [pose[0], pose[1], pose[2]]
    }

    fn mode(&self) -> Mode {
        self.config.mode.at(self.flange_mm())
    }

    /// Link side of the joints in rad, a quill's in mm.
    fn links(&self, s: &State) -> [f64; JOINTS] {
        let si = self.config.body.si();
        std::array::from_fn(|i| s[LINK + i] / si[i])
    }

    /// Rates of the same in SI units.
    fn link_rates(&self, s: &State) -> [f64; JOINTS] {
        std::array::from_fn(|i| s[RATES + LINK + i])
    }

    fn link_inertia(&self) -> [f64; JOINTS] {
        std::array::from_fn(|i| self.config.joints[i].link_inertia)
    }

    /// Accelerations of what the joints' springs and the swinging mass pull at.
    fn accelerations(&self, s: &State, mode: Mode) -> Accelerations {
        // The swinging mass accelerates by ÿ and pulls back with −m ÿ.
        let pull = std::array::from_fn(|axis| {
            let (w, rate) = (s[DEFLECTION + axis], s[RATES + DEFLECTION + axis]);
            -self.config.tool_mass_kg * mode.acceleration(w, rate)
        });
        let load = Load {
            torque: std::array::from_fn(|i| self.spring(s, i)),
            inertia: self.link_inertia(),
            pull,
        };
        self.config
            .body
            .accelerations(self.links(s), self.link_rates(s), &load)
    }

    /// Torque that joint `i` passes from motor to link.
    fn spring(&self, s: &State, i: usize) -> f64 {
        let joint = &self.config.joints[i];
        joint.stiffness * (s[MOTOR + i] - s[LINK + i])
            + joint.damping * (s[RATES + MOTOR + i] - s[RATES + LINK + i])
    }

    fn derivative(&self, s: &State, torque: &[f64; JOINTS], mode: Mode) -> State {
        let config = &self.config;
        let mut d = [0.0; STATES];
        d[..RATES].copy_from_slice(&s[RATES..]);
        for (i, joint) in config.joints.iter().enumerate() {
            d[RATES + MOTOR + i] =
                (torque[i] - self.spring(s, i)) / f64::from(joint.servo.motor_inertia);
        }
        let moving = self.accelerations(s, mode);
        d[RATES + LINK..RATES + LINK + JOINTS].copy_from_slice(&moving.joints);
        for axis in 0..2 {
            let swing = mode.acceleration(s[DEFLECTION + axis], s[RATES + DEFLECTION + axis]);
            d[RATES + DEFLECTION + axis] = swing - moving.flange[axis];
        }
        d
    }

    fn runge_kutta(&self, s: &State, torque: &[f64; JOINTS], mode: Mode) -> State {
        let ahead = |d: &State, h: f64| -> State { std::array::from_fn(|i| s[i] + h * d[i]) };
        let d1 = self.derivative(s, torque, mode);
        let d2 = self.derivative(&ahead(&d1, STEP_S / 2.0), torque, mode);
        let d3 = self.derivative(&ahead(&d2, STEP_S / 2.0), torque, mode);
        let d4 = self.derivative(&ahead(&d3, STEP_S), torque, mode);
        std::array::from_fn(|i| s[i] + STEP_S / 6.0 * (d1[i] + 2.0 * (d2[i] + d3[i]) + d4[i]))
    }
}
