//! A SCARA as its maker describes it.

use crate::pose::AXES;
use crate::units::AngleRad;
use core::fmt;

/// On which side of the line from shoulder to tool the elbow is, seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Elbow {
    /// Left of it: joint 2 is negative.
    Left,
    /// Right of it, as of a right arm: joint 2 is positive.
    #[default]
    Right,
}

impl Elbow {
    /// The side of an arm whose joint 2 is there.
    #[must_use]
    pub fn of(joint2: AngleRad) -> Self {
        if joint2.is_negative() {
            Self::Left
        } else {
            Self::Right
        }
    }

    /// The sign of joint 2.
    pub(super) const fn sign(self) -> i32 {
        match self {
            Self::Left => -1,
            Self::Right => 1,
        }
    }
}

/// Travel of a joint, ends included: degrees, or millimetres for joint 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointRange {
    /// Lowest position.
    pub min: f32,
    /// Highest position.
    pub max: f32,
}

/// Dimensions and limits of a SCARA.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaraConfig {
    /// Upper arm, shoulder to elbow: at least 10 mm.
    pub link1_mm: f32,
    /// Forearm, elbow to quill: at least 10 mm. Both links together at most 2000 mm.
    pub link2_mm: f32,
    /// The arm's side when its position becomes known.
    pub elbow: Elbow,
    /// Joint 1 and 2: within ±360° and spanning at most 360°. Joint 3: within ±4000 mm.
    /// Joint 4: within ±1080°.
    pub joint_limits: [JointRange; AXES],
    /// How far joint 2 stays from stretched (0°) and folded (180°), where a tool speed would
    /// need an infinite joint speed: 0.5° to 45°.
    pub singularity_margin_deg: f32,
}

impl Default for ScaraConfig {
    /// The bench robot: links of 200 and 150 mm, elbow to the right.
    fn default() -> Self {
        Self {
            link1_mm: 200.0,
            link2_mm: 150.0,
            elbow: Elbow::Right,
            joint_limits: [
                JointRange::symmetric(170.0),
                JointRange::symmetric(170.0),
                JointRange::symmetric(200.0),
                JointRange::symmetric(720.0),
            ],
            singularity_margin_deg: 5.0,
        }
    }
}

/// The parameter of a [`ScaraConfig`] that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaraError {
    /// `link1_mm` is not a number of at least 10.
    Link1,
    /// `link2_mm` is not a number of at least 10.
    Link2,
    /// `link1_mm + link2_mm` is more than 2000.
    Reach,
    /// `singularity_margin_deg` is not within 0.5 to 45.
    SingularityMargin,
    /// The limits of this joint (1 to 4) are not numbers, not in ascending order, too far out
    /// or, for joints 1 and 2, more than 360° apart.
    JointLimits(u8),
    /// The limits of joint 2 leave nothing on the elbow's side outside the singularity margin.
    ElbowSide,
}

impl fmt::Display for ScaraError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link1 => f.write_str("link 1 must be at least 10 mm long"),
            Self::Link2 => f.write_str("link 2 must be at least 10 mm long"),
            Self::Reach => f.write_str("the links must not reach further than 2000 mm"),
            Self::SingularityMargin => f.write_str("the singularity margin must be 0.5° to 45°"),
            Self::JointLimits(joint) => write!(f, "the limits of joint {joint} are impossible"),
            Self::ElbowSide => f.write_str("the limits of joint 2 exclude this elbow side"),
        }
    }
}

impl core::error::Error for ScaraError {}

/// Shortest link.
const LINK_MIN_MM: f32 = 10.0;
/// Longest reach: squares of lengths stay below 2^60 machine units.
const REACH_MAX_MM: f32 = 2000.0;
/// How far out the limits of each joint may be (° and mm), and how far apart.
///
/// Joint 4 saturates at 1833° less what joints 1 and 2 turn, 720°: beyond any limit allowed here.
const LIMIT_RANGES: [(f32, f32); AXES] = [
    (360.0, 360.0),
    (360.0, 360.0),
    (4000.0, 8000.0),
    (1080.0, 2160.0),
];

impl JointRange {
    /// `-max` to `max`.
    #[must_use]
    pub const fn symmetric(max: f32) -> Self {
        Self { min: -max, max }
    }
}

impl ScaraConfig {
    /// Everything but the elbow's side, which takes the machine units to decide.
    pub(super) fn validate(&self) -> Result<(), ScaraError> {
        // Written so that NaN fails every test.
        if !(self.link1_mm >= LINK_MIN_MM && self.link1_mm.is_finite()) {
            return Err(ScaraError::Link1);
        }
        if !(self.link2_mm >= LINK_MIN_MM && self.link2_mm.is_finite()) {
            return Err(ScaraError::Link2);
        }
        if self.link1_mm + self.link2_mm > REACH_MAX_MM {
            return Err(ScaraError::Reach);
        }
        if !(0.5..=45.0).contains(&self.singularity_margin_deg) {
            return Err(ScaraError::SingularityMargin);
        }
        for ((joint, range), (furthest, span)) in (1..).zip(self.joint_limits).zip(LIMIT_RANGES) {
            let within = range.min >= -furthest && range.max <= furthest;
            if !(within && range.min < range.max && range.max - range.min <= span) {
                return Err(ScaraError::JointLimits(joint));
            }
        }
        Ok(())
    }
}
