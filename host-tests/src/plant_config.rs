//! Settings of the simulated robot, as a robot file gives them.

use std::fmt;

use planner_core::servo::ServoConfig;

use crate::plant::arm::ArmInertia;
use crate::plant::config::JOINTS;
use crate::plant::{Body, DeltaArm, FullConfig, Mode, ModeMap, PayloadConfig, ScaraArm};

/// Lowest frequency that a posture-dependent mode falls to.
const MODE_MIN_HZ: f64 = 0.1;

/// The servos' tables in a robot file.
const SERVOS: [&str; JOINTS] = [
    "servo.joint1",
    "servo.joint2",
    "servo.joint3",
    "servo.joint4",
];

/// Settings of the simulated robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantConfig {
    /// Upper arm in millimetres.
    pub link1_mm: f64,
    /// Forearm in millimetres.
    pub link2_mm: f64,
    /// The robot is this delta, and no SCARA.
    pub delta: Option<DeltaArm>,
    /// The end effector's mode.
    pub mode: Mode,
    /// Change of its frequency for each mm further from the shoulder; full plant only.
    pub mode_slope_hz_per_mm: f64,
    /// Distance from the shoulder at which the mode has its frequency.
    pub mode_reference_mm: f64,
    /// Mass that swings in the mode.
    pub tool_mass_kg: f64,
    /// Largest error of an encoder reading of a joint that turns.
    pub encoder_noise_rad: f64,
    /// Largest error of an encoder reading of a quill.
    pub encoder_noise_mm: f64,
    /// Seed of the noise.
    pub noise_seed: u64,
    /// The servos of the joints.
    pub servos: [ServoConfig; JOINTS],
    /// What swings under the tool, if anything does.
    pub payload: Option<PayloadConfig>,
}

impl Default for PlantConfig {
    fn default() -> Self {
        Self {
            link1_mm: 200.0,
            link2_mm: 150.0,
            delta: None,
            mode: Mode::default(),
            mode_slope_hz_per_mm: 0.0,
            mode_reference_mm: 225.0,
            tool_mass_kg: 0.05,
            encoder_noise_rad: 1e-6,
            encoder_noise_mm: 1e-4,
            noise_seed: 0,
            servos: FullConfig::default().joints.map(|joint| joint.servo),
            payload: None,
        }
    }
}

/// A plant setting that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantConfigError {
    /// Its key in a robot file.
    pub key: &'static str,
    /// What was given.
    pub value: f64,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
}

impl fmt::Display for PlantConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            value, low, high, ..
        } = self;
        write!(
            f,
            "{value} is outside {low} to {high}: give a value within that range"
        )
    }
}

impl std::error::Error for PlantConfigError {}

impl PlantConfig {
    /// Whether the plant can be simulated with these.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn check(&self) -> Result<(), PlantConfigError> {
        let delta = self.delta.unwrap_or_default();
        let ranges = [
            (
                "plant.mode_frequency_hz",
                self.mode.frequency_hz,
                MODE_MIN_HZ,
                250.0,
            ),
            ("plant.mode_damping", self.mode.damping, 0.0, 0.9),
            (
                "plant.mode_slope_hz_per_mm",
                self.mode_slope_hz_per_mm,
                -1.0,
                1.0,
            ),
            (
                "plant.mode_reference_mm",
                self.mode_reference_mm,
                0.0,
                2000.0,
            ),
            ("plant.tool_mass_kg", self.tool_mass_kg, 0.0, 5.0),
            ("plant.upper_arm_kg", delta.upper_arm_kg, 0.01, 100.0),
            ("plant.forearm_kg", delta.forearm_kg, 0.01, 100.0),
            ("plant.platform_kg", delta.platform_kg, 0.01, 100.0),
            ("plant.end_effector_kg", delta.end_effector_kg, 0.0, 100.0),
            ("plant.encoder_noise_rad", self.encoder_noise_rad, 0.0, 1e-3),
            ("plant.encoder_noise_mm", self.encoder_noise_mm, 0.0, 1.0),
        ];
        let payload = self.payload.map(|payload| {
            [
                ("plant.payload.mass_kg", payload.mass_kg, 0.001, 100.0),
                ("plant.payload.length_mm", payload.length_mm, 1.0, 2000.0),
                (
                    "plant.payload.stiffness_nm_per_deg",
                    payload.stiffness_nm_per_deg,
                    0.0,
                    10.0,
                ),
                (
                    "plant.payload.damping_nm_s_per_deg",
                    payload.damping_nm_s_per_deg,
                    0.0,
                    1.0,
                ),
                (
                    "plant.payload.peel_off_mm_s2",
                    payload.peel_off_mm_s2,
                    1.0,
                    1e7,
                ),
                (
                    "plant.payload.overshoot_limit_mm",
                    payload.overshoot_limit_mm,
                    0.001,
                    1000.0,
                ),
            ]
        });
        // Written so that NaN is out of range.
        let wrong = ranges
            .into_iter()
            .chain(payload.into_iter().flatten())
            .find(|(_, value, low, high)| !(low..=high).contains(&value));
        if let Some((key, value, low, high)) = wrong {
            return Err(PlantConfigError {
                key,
                value,
                low,
                high,
            });
        }
        for (key, servo) in SERVOS.into_iter().zip(&self.servos) {
            servo.validate().map_err(|error| PlantConfigError {
                key,
                value: error.value.into(),
                low: error.low.into(),
                high: error.high.into(),
            })?;
        }
        Ok(())
    }

    /// The full plant at rest with its joints at `start` (rad, a quill's mm).
    #[must_use]
    pub fn full(&self, start: [f64; JOINTS]) -> FullConfig {
        let kind = self
            .delta
            .map_or_else(FullConfig::default, FullConfig::delta);
        let mut config = FullConfig {
            body: self.body(),
            tool_mass_kg: self.tool_mass_kg,
            mode: self.mode_map(),
            seed: self.noise_seed,
            start,
            ..kind
        };
        let noise = self.encoder_noise_rad;
        let third = match self.delta {
            None => self.encoder_noise_mm / 1e3,
            Some(_) => noise,
        };
        let noise = [noise, noise, third, noise];
        for ((joint, noise), servo) in config.joints.iter_mut().zip(noise).zip(self.servos) {
            joint.encoder_noise = noise;
            joint.servo = servo;
        }
        config
    }

    /// What the joints move.
    #[must_use]
    pub fn body(&self) -> Body {
        match self.delta {
            Some(delta) => Body::Delta(delta),
            None => Body::Scara {
                arm: ScaraArm {
                    link1_mm: self.link1_mm,
                    link2_mm: self.link2_mm,
                },
                inertia: ArmInertia::default(),
            },
        }
    }

    fn mode_map(&self) -> ModeMap {
        let (mode, slope, reference) =
            (self.mode, self.mode_slope_hz_per_mm, self.mode_reference_mm);
        if slope == 0.0 {
            return ModeMap::constant(mode);
        }
        ModeMap::from_fn(move |[x, y, _]| Mode {
            frequency_hz: (mode.frequency_hz + slope * (x.hypot(y) - reference)).max(MODE_MIN_HZ),
            ..mode
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_the_plants_own() {
        let mut ours = PlantConfig::default().full(FullConfig::default().start);
        let own = FullConfig::default();
        for (ours, own) in ours.joints.iter_mut().zip(own.joints) {
            // 1e-4 mm is 1e-7 m but for the last bit
            assert!((ours.encoder_noise / own.encoder_noise - 1.0).abs() < 1e-12);
            ours.encoder_noise = own.encoder_noise;
        }
        assert_eq!(ours.body, own.body);
        assert_eq!(ours.joints, own.joints);
        assert_eq!((ours.tool_mass_kg, ours.seed), (own.tool_mass_kg, own.seed));
        assert_eq!(ours.mode.at([1.0, 2.0, 3.0]), Mode::default());
    }

    #[test]
    fn the_mode_follows_the_distance_from_the_shoulder() {
        let config = PlantConfig {
            mode_slope_hz_per_mm: -0.02,
            ..PlantConfig::default()
        };
        let map = config.full([0.0; JOINTS]).mode;
        assert!((map.at([0.0, 325.0, 9.0]).frequency_hz - 4.34).abs() < 1e-12);
        assert_eq!(map.at([2000.0, 0.0, 0.0]).frequency_hz, MODE_MIN_HZ);
    }
}
