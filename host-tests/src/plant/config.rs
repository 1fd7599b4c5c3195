//! Settings of the full plant and the robot they describe by default.

use std::fmt;
use std::sync::Arc;

use planner_core::servo::{ServoConfig, ServoGains, Travel};

use super::arm::{ArmInertia, ScaraArm};
use super::body::Body;
use super::delta_arm::DeltaArm;
use super::mode::Mode;

/// Joints of the robot.
pub const JOINTS: usize = 4;

/// The end effector's mode over the workspace.
#[derive(Clone)]
pub struct ModeMap(Arc<dyn Fn([f64; 3]) -> Mode + Send + Sync>);

impl ModeMap {
    /// The same mode everywhere.
    #[must_use]
    pub fn constant(mode: Mode) -> Self {
        Self(Arc::new(move |_| mode))
    }

    /// A mode that depends on the flange's position in millimetres.
    pub fn from_fn(map: impl Fn([f64; 3]) -> Mode + Send + Sync + 'static) -> Self {
        Self(Arc::new(map))
    }

    /// The mode with the flange at `position_mm`.
    #[must_use]
    pub fn at(&self, position_mm: [f64; 3]) -> Mode {
        (self.0)(position_mm)
    }
}

impl Default for ModeMap {
    fn default() -> Self {
        Self::constant(Mode::default())
    }
}

impl fmt::Debug for ModeMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ModeMap")
    }
}

/// One joint with its servo; a quill in metres and newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointConfig {
    /// Its servo, and with it the inertia of its motor.
    pub servo: ServoConfig,
    /// Stiffness between motor and link: Nm/rad or N/m.
    pub stiffness: f64,
    /// Damping between motor and link: Nm·s/rad or N·s/m.
    pub damping: f64,
    /// Inertia of what turns or slides on its own; the rest is the [`Body`]'s.
    pub link_inertia: f64,
    /// Largest error of an encoder reading, evenly distributed: rad or m.
    pub encoder_noise: f64,
}

/// Settings of the full plant.
#[derive(Clone, Debug)]
pub struct FullConfig {
    /// What the joints move.
    pub body: Body,
    /// Joints and drives.
    pub joints: [JointConfig; JOINTS],
    /// Mass that swings in the end effector's mode, kilograms.
    pub tool_mass_kg: f64,
    /// The end effector's mode.
    pub mode: ModeMap,
    /// Seed of the encoders' noise.
    pub seed: u64,
    /// Joints at the start: rad, a quill's mm.
    pub start: [f64; JOINTS],
}

/// A table-top SCARA of 200 + 150 mm. Its joints resonate at some 36 Hz (shoulder,
/// as the robot of vNoorden21) to 60 Hz, well above the end effector's 6.34 Hz.
///
/// The swinging mass is small: the arm's own compliance then lowers the mode's
/// frequency by less than 0.1 %, and the number set is the number seen.
impl Default for FullConfig {
    fn default() -> Self {
        let inertia = ArmInertia::default();
        Self {
            body: Body::Scara {
                arm: ScaraArm::default(),
                inertia,
            },
            joints: [
                joint(Travel::Rotary, 0.080, inertia.a, 10_000.0, 150.0),
                joint(Travel::Rotary, 0.030, inertia.d, 3_000.0, 60.0),
                joint(Travel::Linear, 6.0, 3.0, 1.0e6, 1_500.0),
                joint(Travel::Rotary, 0.002, 0.002, 300.0, 5.0),
            ],
            tool_mass_kg: 0.05,
            mode: ModeMap::default(),
            seed: 0,
            start: [0.0, 1.5, 0.0, 0.0],
        }
    }
}

impl FullConfig {
    /// A delta robot. With its motors held and its arms 20° down it resonates first at 36.6 Hz,
    /// as \[vNoorden21\] has measured. The thesis gives the drives at the motor and no gear: here
    /// the motor's inertia behind it equals the load's, and the torque limit is some three times
    /// what the thesis's fastest moves need.
    #[must_use]
    pub fn delta(delta: DeltaArm) -> Self {
        let posture = [20_f64.to_radians(); JOINTS];
        let [[own, shared, _], ..] = delta.mass_matrix(posture);
        // Alike arms: the platform goes up and down, or to either side.
        let heaviest = (own + 2.0 * shared).max(own - shared);
        let stiffness = (std::f64::consts::TAU * FIRST_MODE_HZ).powi(2) * heaviest;
        let arm = joint(Travel::Rotary, heaviest, own, stiffness, 300.0);
        Self {
            body: Body::Delta(delta),
            joints: [
                arm,
                arm,
                arm,
                joint(Travel::Rotary, 0.002, 0.002, 300.0, 5.0),
            ],
            start: posture,
            ..Self::default()
        }
    }
}

/// First mode of the delta robot of [vNoorden21].
const FIRST_MODE_HZ: f64 = 36.6;

/// A joint with the drive gains of vNoorden21, scaled to this arm: its flexible
/// joints and the slower motors bring K_p from 1100 to 200 1/s; K_v gives the bare
/// motor a bandwidth of 2500 rad/s; the integral time is the thesis's.
fn joint(travel: Travel, motor: f64, link: f64, stiffness: f64, torque_limit: f32) -> JointConfig {
    JointConfig {
        servo: ServoConfig {
            travel,
            gains: ServoGains {
                position_gain: 200.0,
                velocity_gain: 2500.0 * motor as f32,
                torque_limit,
                ..ServoGains::PUBLISHED
            },
            motor_inertia: motor as f32,
            total_inertia: (motor + link) as f32,
        },
        stiffness,
        // A damping ratio of 0.05 against a motor that holds still.
        damping: 2.0 * 0.05 * (stiffness * link).sqrt(),
        link_inertia: link,
        // About one count of a 23-bit encoder on the joint.
        encoder_noise: match travel {
            Travel::Rotary => 1e-6,
            Travel::Linear => 1e-7,
        },
    }
}
