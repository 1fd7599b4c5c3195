//! A delta robot as its maker describes it.

use super::config::JointRange;
use core::fmt;

/// Dimensions and limits of a delta robot: three equal arms, 120° apart, and a yaw axis.
///
/// Arm 1 points along −Y, arm 2 is 120° further counter-clockwise seen from above, arm 3 240°.
/// Z is zero at the shoulders and negative below, where the tool is. Joints 1 to 3 are the
/// upper arms, 0° when level and positive down; joint 4 is the tool's yaw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaConfig {
    /// Centre of the base to the shoulders, in mm.
    pub base_radius_mm: f32,
    /// Centre of the platform to the forearms, in mm: 0 to the base's. The difference is at
    /// most the upper arm.
    pub platform_radius_mm: f32,
    /// Upper arm in mm, shoulder to elbow: at least 10.
    pub upper_arm_mm: f32,
    /// Forearm in mm, elbow to platform: at least 10. Upper arm, forearm and the difference of
    /// the radii are at most 2000 mm together.
    pub forearm_mm: f32,
    /// Travel of each upper arm: within ±170°.
    pub arm_limits: JointRange,
    /// Travel of the yaw: within ±1080°.
    pub yaw_limits: JointRange,
    /// How far each forearm stays, in degrees, from the plane of its upper arm and its
    /// shoulder's axis: 0.5 to 45. In that plane the platform moves and the arm cannot follow
    /// (serial singularity).
    pub serial_margin_deg: f32,
    /// The least volume that the three forearms' directions may span: 0.01 to 0.5. 1 is at
    /// right angles; at 0 they lie in a plane and the platform moves although the arms stand
    /// (parallel singularity).
    pub parallel_margin: f32,
}

impl Default for DeltaConfig {
    /// The robot of \[vNoorden21\]. Over its workspace, 797 × 797 × 228 mm with Z from −828 to
    /// −600, its arms are between −35.1° and 104.1°, its forearms 28.2° from serial singularity
    /// or further, and they span 0.22 or more.
    fn default() -> Self {
        Self {
            base_radius_mm: 200.0,
            platform_radius_mm: 45.0,
            upper_arm_mm: 348.088,
            forearm_mm: 800.0,
            arm_limits: JointRange {
                min: -45.0,
                max: 110.0,
            },
            yaw_limits: JointRange::symmetric(720.0),
            serial_margin_deg: 20.0,
            parallel_margin: 0.1,
        }
    }
}

/// The parameter of a [`DeltaConfig`] that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeltaError {
    /// `base_radius_mm` is not `platform_radius_mm` and up to the upper arm more, or that is
    /// negative.
    Radii,
    /// `upper_arm_mm` is not a number of at least 10.
    UpperArm,
    /// `forearm_mm` is not a number of at least 10.
    Forearm,
    /// Upper arm, forearm and the radii's difference are more than 2000 mm.
    Reach,
    /// `arm_limits` are not numbers within ±170 in ascending order.
    ArmLimits,
    /// `yaw_limits` are not numbers within ±1080 in ascending order.
    YawLimits,
    /// `serial_margin_deg` is not within 0.5 to 45.
    SerialMargin,
    /// `parallel_margin` is not within 0.01 to 0.5.
    ParallelMargin,
}

impl fmt::Display for DeltaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Radii => {
                "the delta's base radius must be its platform radius and up to the upper arm more"
            }
            Self::UpperArm => "the delta's upper arm must be at least 10 mm long",
            Self::Forearm => "the delta's forearm must be at least 10 mm long",
            Self::Reach => "the delta's arms must not reach further than 2000 mm",
            Self::ArmLimits => "the limits of the delta's arms must ascend within ±170°",
            Self::YawLimits => "the limits of the delta's yaw must ascend within ±1080°",
            Self::SerialMargin => "the delta's serial margin must be 0.5° to 45°",
            Self::ParallelMargin => "the delta's parallel margin must be 0.01 to 0.5",
        })
    }
}

impl core::error::Error for DeltaError {}

/// Shortest upper arm and forearm.
const LINK_MIN_MM: f32 = 10.0;
/// Furthest reach, below the 2048 mm within which coordinates are computed.
const REACH_MAX_MM: f32 = 2000.0;
/// How far out limits may be: half the angle stays off ±90°, and joint 4 within ±32 rad.
const ARM_MAX_DEG: f32 = 170.0;
const YAW_MAX_DEG: f32 = 1080.0;

impl DeltaConfig {
    /// Whether all parameters are within their ranges.
    pub(super) fn validate(&self) -> Result<(), DeltaError> {
        let within = |range: JointRange, furthest: f32| {
            range.min >= -furthest && range.max <= furthest && range.min < range.max
        };
        let offset_mm = self.base_radius_mm - self.platform_radius_mm;
        // Written so that NaN fails every test.
        let tests = [
            (self.upper_arm_mm >= LINK_MIN_MM, DeltaError::UpperArm),
            (self.forearm_mm >= LINK_MIN_MM, DeltaError::Forearm),
            (
                self.platform_radius_mm >= 0.0 && (0.0..=self.upper_arm_mm).contains(&offset_mm),
                DeltaError::Radii,
            ),
            (
                self.upper_arm_mm + self.forearm_mm + offset_mm <= REACH_MAX_MM,
                DeltaError::Reach,
            ),
            (within(self.arm_limits, ARM_MAX_DEG), DeltaError::ArmLimits),
            (within(self.yaw_limits, YAW_MAX_DEG), DeltaError::YawLimits),
            (
                (0.5..=45.0).contains(&self.serial_margin_deg),
                DeltaError::SerialMargin,
            ),
            (
                (0.01..=0.5).contains(&self.parallel_margin),
                DeltaError::ParallelMargin,
            ),
        ];
        let failed = tests.into_iter().find(|(holds, _)| !holds);
        failed.map_or(Ok(()), |(_, error)| Err(error))
    }
}
