//! The settings of a joint's servo.

use core::fmt;

use crate::pose::AXES;

/// Which way a joint moves, and with it the unit of its positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Travel {
    /// It turns: positions in 2^-26 rad, torques in Nm.
    #[default]
    Rotary,
    /// It slides: positions in 2^-19 mm, forces in N.
    Linear,
}

impl Travel {
    /// Radians or metres in the last bit of a position.
    #[must_use]
    pub const fn si_per_lsb(self) -> f32 {
        match self {
            Self::Rotary => 1.0 / (1 << 26) as f32,
            Self::Linear => 1e-3 / (1 << 19) as f32,
        }
    }

    /// Bits of a position in a radian or a millimetre, the units of a setpoint's velocity.
    #[must_use]
    pub const fn lsb_per_unit(self) -> f32 {
        match self {
            Self::Rotary => (1 << 26) as f32,
            Self::Linear => (1 << 19) as f32,
        }
    }
}

/// What a person sets of a servo, reflected to the joint side of the gear: radians and Nm, or
/// metres and N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoGains {
    /// `K_p` of the position loop in 1/s, above 0 to 5000.
    pub position_gain: f32,
    /// `K_v` of the velocity loop in Nm·s/rad or N·s/m, above 0 to 1e6.
    pub velocity_gain: f32,
    /// Integral time of the velocity loop in seconds, 0.0005 to 10.
    pub integral_time_s: f32,
    /// Part of the velocity that is fed forward, 0 to 1.
    pub velocity_feed_forward: f32,
    /// Part of the acceleration that is fed forward, 0 to 1.
    pub acceleration_feed_forward: f32,
    /// Largest torque or force: Nm or N, 0 to 1e6.
    pub torque_limit: f32,
    /// Bandwidth of the velocity observer in rad/s, 1 to 10 000: below it the encoder counts,
    /// above it the acceleration that the torque implies, so that encoder noise stays out.
    pub observer_rad_s: f32,
}

/// The range of a gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainRange {
    /// Name of the field.
    pub name: &'static str,
    /// Lowest value.
    pub low: f32,
    /// Highest value.
    pub high: f32,
}

const fn range(name: &'static str, low: f32, high: f32) -> GainRange {
    GainRange { name, low, high }
}

/// The gains of a servo and their ranges, in the order of [`ServoGains::values`].
pub const GAINS: [GainRange; 7] = [
    range("position_gain", 1e-3, 5e3),
    range("velocity_gain", 1e-6, 1e6),
    range("integral_time_s", 5e-4, 10.0),
    range("velocity_feed_forward", 0.0, 1.0),
    range("acceleration_feed_forward", 0.0, 1.0),
    range("torque_limit", 0.0, 1e6),
    range("observer_rad_s", 1.0, 1e4),
];

impl ServoGains {
    /// The gains of vNoorden21.
    pub const PUBLISHED: Self = Self {
        position_gain: 1100.0,
        velocity_gain: 0.25,
        integral_time_s: 0.0067,
        velocity_feed_forward: 1.0,
        acceleration_feed_forward: 1.0,
        torque_limit: 23.3,
        observer_rad_s: 1500.0,
    };

    /// Those of joints 1 to 4 of the SCARA that the other settings describe by default: its joints
    /// are flexible and its motors slow, which brings `K_p` down to 200 1/s.
    pub const SCARA: [Self; AXES] = [
        Self::scaled(200.0, 150.0),
        Self::scaled(75.0, 60.0),
        Self::scaled(15_000.0, 1500.0),
        Self::scaled(5.0, 5.0),
    ];

    const fn scaled(velocity_gain: f32, torque_limit: f32) -> Self {
        Self {
            position_gain: 200.0,
            velocity_gain,
            torque_limit,
            ..Self::PUBLISHED
        }
    }

    /// All gains, in the order of [`GAINS`].
    pub const fn values(&mut self) -> [&mut f32; GAINS.len()] {
        [
            &mut self.position_gain,
            &mut self.velocity_gain,
            &mut self.integral_time_s,
            &mut self.velocity_feed_forward,
            &mut self.acceleration_feed_forward,
            &mut self.torque_limit,
            &mut self.observer_rad_s,
        ]
    }
}

/// Settings of a servo: what is set of it, and what it drives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoConfig {
    /// Which way the joint moves.
    pub travel: Travel,
    /// What is set.
    pub gains: ServoGains,
    /// Inertia of the motor, which the observer reckons with: kg·m² or kg, above 0 to 1e4.
    pub motor_inertia: f32,
    /// Inertia of motor and load, which the acceleration's feed-forward reckons with, above 0
    /// to 1e4.
    pub total_inertia: f32,
}

impl Default for ServoConfig {
    fn default() -> Self {
        Self {
            travel: Travel::Rotary,
            gains: ServoGains::PUBLISHED,
            motor_inertia: 1e-4,
            total_inertia: 1e-4,
        }
    }
}

/// Why a servo's settings are refused; names the setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoError {
    /// The setting.
    pub name: &'static str,
    /// What was given.
    pub value: f32,
    /// Lowest value.
    pub low: f32,
    /// Highest value.
    pub high: f32,
}

impl fmt::Display for ServoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            value,
            low,
            high,
        } = self;
        write!(
            f,
            "the servo's {name} of {value} is outside {low} to {high}: give a value within that range"
        )
    }
}

impl core::error::Error for ServoError {}

impl ServoConfig {
    /// Whether a servo can be made of these.
    ///
    /// # Errors
    /// [`ServoError`] names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), ServoError> {
        let inertias = [
            (range("motor_inertia", 1e-9, 1e4), self.motor_inertia),
            (range("total_inertia", 1e-9, 1e4), self.total_inertia),
        ];
        let mut gains = self.gains;
        let gains = GAINS.into_iter().zip(gains.values().map(|value| *value));
        // Written so that NaN is out of range.
        let wrong = gains
            .chain(inertias)
            .find(|(range, value)| !(range.low..=range.high).contains(value));
        match wrong {
            None => Ok(()),
            Some((GainRange { name, low, high }, value)) => Err(ServoError {
                name,
                value,
                low,
                high,
            }),
        }
    }
}
