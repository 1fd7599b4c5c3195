//! Robot files: TOML to settings of planner and plant.
//!
//! Every key is optional and carries its unit; unknown keys are refused. An error names
//! the file, the line and the key.

use std::fmt;
use std::path::Path;

use planner_core::config::{ConfigError, Robot, RobotConfig};
use planner_core::hop::{HopAxes, HopError};
use planner_core::kinematics::{ArmKind, DeltaConfig, DeltaError, Elbow, JointRange, ScaraError};
use planner_core::limits::{LimitsConfig, MotionLimits};
use planner_core::pose::JointUnit;
use planner_core::posture::{FollowError, MapError, MapNode, ModeMapConfig, PostureMethod};
use planner_core::prefilter::{
    AxisSet, CustomImpulse, Kind, MAX_IMPULSES, PrefilterConfig, PrefilterError,
};
use planner_core::servo::ServoGains;
use serde::{Deserialize, Deserializer};

use crate::plant::{DeltaArm, FullConfig, Mode, PayloadConfig};
use crate::plant_config::PlantConfig;
use crate::toml_place::{key_at, line_at, line_of};

/// Text of the default robot's file.
pub const DEFAULT_ROBOT: &str = include_str!("../robots/scara-200-150.toml");

/// What a robot file says.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotSettings {
    /// For the planner.
    pub robot: RobotConfig,
    /// For the simulated robot.
    pub plant: PlantConfig,
}

/// Why a robot file cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotFileError {
    /// The file's name.
    pub file: String,
    /// Line, from 1; none if the value at fault is a default.
    pub line: Option<usize>,
    /// Key with its table, as in `prefilter.damping`; none if the text is no TOML.
    pub key: Option<String>,
    /// What is wrong.
    pub reason: String,
}

impl fmt::Display for RobotFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(key) = &self.key {
            write!(f, ", key {key}")?;
        }
        write!(f, ": {}", self.reason)
    }
}

impl std::error::Error for RobotFileError {}

impl RobotSettings {
    /// Reads the file, or the default robot if there is none.
    ///
    /// # Errors
    /// [`RobotFileError`] says what cannot be used.
    pub fn load(file: Option<&Path>) -> Result<Self, RobotFileError> {
        let Some(file) = file else {
            return Self::parse("scara-200-150.toml", DEFAULT_ROBOT);
        };
        let name = file.display().to_string();
        let unreadable = |reason: String| RobotFileError {
            file: name.clone(),
            line: None,
            key: None,
            reason,
        };
        let bytes = std::fs::read(file)
            .map_err(|error| unreadable(format!("the robot file cannot be read ({error})")))?;
        let text = String::from_utf8(bytes)
            .map_err(|_| unreadable("the robot file is not UTF-8: save it as UTF-8 text".into()))?;
        Self::parse(&name, &text)
    }

    /// Reads a file's text and checks that a robot can be made from it.
    ///
    /// # Errors
    /// [`RobotFileError`] names the first key that cannot be used.
    pub fn parse(file: &str, text: &str) -> Result<Self, RobotFileError> {
        let tables: Tables = toml::from_str(text).map_err(|error| {
            let offset = error.span().map(|span| span.start);
            RobotFileError {
                file: file.into(),
                line: offset.map(|offset| line_at(text, offset)),
                key: offset.and_then(|offset| key_at(text, offset)),
                reason: error.message().trim().replace('\n', ", "),
            }
        })?;
        let mut settings = tables.settings();
        let refused = |keys: &[&str], reason: String| {
            let present = keys.iter().find(|key| line_of(text, key).is_some());
            let key = present.or(keys.first()).copied();
            RobotFileError {
                file: file.into(),
                line: key.and_then(|key| line_of(text, key)),
                key: key.map(Into::into),
                reason,
            }
        };
        let joint3 = tables.limits.joint3.check(settings.robot.arm);
        joint3.map_err(|(key, why)| refused(&[&format!("limits.joint3.{key}")], why))?;
        if let Some(map) = &tables.map {
            settings.robot.map = map
                .config()
                .map_err(|reason| refused(&["map.modes"], reason))?;
        }
        Robot::new(&settings.robot)
            .map_err(|error| refused(&keys_of(&error), error.to_string()))?;
        settings
            .plant
            .check()
            .map_err(|error| refused(&[error.key], error.to_string()))?;
        Ok(settings)
    }
}

/// The keys that an error of the core is about, the likeliest first.
fn keys_of(error: &ConfigError) -> Vec<&'static str> {
    match error {
        ConfigError::Scara(error) => match error {
            ScaraError::Link1 => vec!["arm.link1_mm"],
            ScaraError::Link2 => vec!["arm.link2_mm"],
            ScaraError::Reach => vec!["arm.link1_mm", "arm.link2_mm"],
            ScaraError::SingularityMargin => vec!["arm.singularity_margin_deg"],
            ScaraError::JointLimits(1) => vec!["arm.joint1"],
            ScaraError::JointLimits(2) => vec!["arm.joint2"],
            ScaraError::JointLimits(3) => vec!["arm.joint3"],
            ScaraError::JointLimits(_) => vec!["arm.joint4"],
            ScaraError::ElbowSide => vec!["arm.joint2", "arm.elbow"],
        },
        ConfigError::Delta(error) => match error {
            DeltaError::Radii => vec!["delta.base_radius_mm", "delta.platform_radius_mm"],
            DeltaError::UpperArm => vec!["delta.upper_arm_mm"],
            DeltaError::Forearm => vec!["delta.forearm_mm"],
            DeltaError::Reach => vec!["delta.forearm_mm", "delta.upper_arm_mm"],
            DeltaError::ArmLimits => vec!["delta.arm"],
            DeltaError::YawLimits => vec!["delta.yaw"],
            DeltaError::SerialMargin => vec!["delta.serial_margin_deg"],
            DeltaError::ParallelMargin => vec!["delta.parallel_margin"],
        },
        ConfigError::Prefilter(error) => match error {
            PrefilterError::Frequency { .. } => vec!["prefilter.frequency_hz"],
            PrefilterError::Damping { .. } => vec!["prefilter.damping"],
            PrefilterError::SecondFrequency { .. } => vec!["prefilter.mode2.frequency_hz"],
            PrefilterError::SecondDamping { .. } => vec!["prefilter.mode2.damping"],
            PrefilterError::Residual { .. } => vec!["prefilter.v_tol"],
            PrefilterError::Box { .. } => vec!["prefilter.box_ms"],
            PrefilterError::SCurve { .. } => {
                vec![
                    "prefilter.s_curve_jerk_mm_s3",
                    "prefilter.s_curve_feed_mm_s",
                ]
            }
            PrefilterError::Impulse { .. } => vec!["prefilter.impulses"],
            PrefilterError::Smoothing { .. } => {
                vec!["prefilter.smoothing1_ms", "prefilter.smoothing2_ms"]
            }
            PrefilterError::TooLong { .. } => vec!["prefilter.frequency_hz", "prefilter.name"],
            PrefilterError::TooManyKinks => vec!["prefilter.impulses", "prefilter.name"],
        },
        ConfigError::Follow(error) => match error {
            FollowError::Map(MapError::Size { .. }) => vec!["map.columns", "map.rows"],
            FollowError::Map(MapError::Place { axis: 'X' }) => vec!["map.x_mm"],
            FollowError::Map(MapError::Place { .. }) => vec!["map.y_mm"],
            FollowError::Map(MapError::Frequency { .. } | MapError::Damping { .. }) => {
                vec!["map.modes"]
            }
            FollowError::Prefilter(_) | FollowError::TooLong { .. } => {
                vec!["prefilter.name", "map.modes"]
            }
            FollowError::Shortest(_) => vec!["prefilter.residual_limit", "prefilter.uncertainty"],
        },
        ConfigError::Hop(error) => match error {
            HopError::Rise { .. } => vec!["hop.rise_mm", "hop.height_mm"],
            HopError::Range { name, .. } => match *name {
                "hop-height" => vec!["hop.height_mm"],
                "hop-rise" => vec!["hop.rise_mm"],
                "hop-tolerance" => vec!["hop.tolerance_mm"],
                _ => vec!["hop.acceleration_mm_s2"],
            },
        },
        ConfigError::AxesOnMap => vec!["prefilter.axes", "prefilter.mode2.axes"],
        ConfigError::Range { name, .. } => match *name {
            "tolerance" => vec!["motion.corner_tolerance_mm"],
            "overlap" => vec!["motion.corner_overlap_percent"],
            "rapid" => vec!["motion.rapid_mm_s"],
            "feed-limit" => vec!["motion.feed_limit_mm_s"],
            "joint-speed" => vec!["motion.joint_speed_deg_s"],
            "uncertainty" => vec!["prefilter.uncertainty"],
            "residual-limit" => vec!["prefilter.residual_limit"],
            "yaw-limit" => vec!["motion.yaw_limit_deg_s"],
            name => limit_keys(name),
        },
    }
}

/// The keys of a limit's setting: its table, and in it the values of that name.
fn limit_keys(name: &str) -> Vec<&'static str> {
    let keys = [
        "limits.joint1.velocity_deg_s",
        "limits.joint1.acceleration_deg_s2",
        "limits.joint1.jerk_deg_s3",
        "limits.joint2.velocity_deg_s",
        "limits.joint2.acceleration_deg_s2",
        "limits.joint2.jerk_deg_s3",
        "limits.joint3.velocity_mm_s",
        "limits.joint3.acceleration_mm_s2",
        "limits.joint3.jerk_mm_s3",
        "limits.joint3.velocity_deg_s",
        "limits.joint3.acceleration_deg_s2",
        "limits.joint3.jerk_deg_s3",
        "limits.joint4.velocity_deg_s",
        "limits.joint4.acceleration_deg_s2",
        "limits.joint4.jerk_deg_s3",
        "limits.path.velocity_mm_s",
        "limits.path.acceleration_mm_s2",
        "limits.path.jerk_mm_s3",
        "limits.axis.velocity_mm_s",
        "limits.axis.acceleration_mm_s2",
        "limits.axis.jerk_mm_s3",
    ];
    let Some((part, order)) = name.split_once('-') else {
        return Vec::new();
    };
    let start = format!("limits.{part}.{order}_");
    let found = keys.into_iter().filter(|key| key.starts_with(&start));
    found.collect()
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct Tables {
    robot: Option<RobotName>,
    arm: ArmTable,
    delta: DeltaTable,
    prefilter: PrefilterTable,
    map: Option<MapTable>,
    motion: MotionTable,
    hop: HopTable,
    limits: LimitsTable,
    plant: PlantTable,
    servo: ServoTables,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct ArmTable {
    link1_mm: Option<f32>,
    link2_mm: Option<f32>,
    elbow: Option<ElbowName>,
    singularity_margin_deg: Option<f32>,
    joint1: TurnTable,
    joint2: TurnTable,
    joint3: QuillTable,
    joint4: TurnTable,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum RobotName {
    Scara,
    Delta,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct DeltaTable {
    base_radius_mm: Option<f32>,
    platform_radius_mm: Option<f32>,
    upper_arm_mm: Option<f32>,
    forearm_mm: Option<f32>,
    arm: TurnTable,
    yaw: TurnTable,
    serial_margin_deg: Option<f32>,
    parallel_margin: Option<f32>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum ElbowName {
    Left,
    Right,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct TurnTable {
    min_deg: Option<f32>,
    max_deg: Option<f32>,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct QuillTable {
    min_mm: Option<f32>,
    max_mm: Option<f32>,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct PrefilterTable {
    #[serde(deserialize_with = "prefilter_name")]
    name: Option<Kind>,
    frequency_hz: Option<f32>,
    damping: Option<f32>,
    #[serde(deserialize_with = "axis_set")]
    axes: Option<AxisSet>,
    v_tol: Option<f32>,
    box_ms: Option<f32>,
    s_curve_feed_mm_s: Option<f32>,
    s_curve_jerk_mm_s3: Option<f32>,
    smoothing1_ms: Option<f32>,
    smoothing2_ms: Option<f32>,
    #[serde(deserialize_with = "method_name")]
    posture_method: Option<PostureMethod>,
    automatic: Option<bool>,
    uncertainty: Option<f32>,
    residual_limit: Option<f32>,
    mode2: SecondModeTable,
    #[serde(deserialize_with = "impulses")]
    impulses: Option<[CustomImpulse; MAX_IMPULSES]>,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct SecondModeTable {
    #[serde(deserialize_with = "prefilter_name")]
    name: Option<Kind>,
    frequency_hz: Option<f32>,
    damping: Option<f32>,
    #[serde(deserialize_with = "axis_set")]
    axes: Option<AxisSet>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ImpulseTable {
    time_ms: f32,
    weight: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapTable {
    x_mm: [f32; 2],
    y_mm: [f32; 2],
    columns: u8,
    rows: u8,
    /// Frequency in Hz and damping ratio of each node.
    modes: Vec<[f32; 2]>,
}

impl MapTable {
    fn config(&self) -> Result<ModeMapConfig, String> {
        let wanted = usize::from(self.columns) * usize::from(self.rows);
        let given = self.modes.len();
        if given != wanted {
            return Err(format!(
                "the map has {given} modes and room for {wanted}: give one for each column and row"
            ));
        }
        let mut map = ModeMapConfig {
            x_mm: self.x_mm,
            y_mm: self.y_mm,
            columns: self.columns,
            rows: self.rows,
            ..ModeMapConfig::NONE
        };
        for (node, [frequency_hz, damping]) in map.nodes.iter_mut().zip(&self.modes) {
            *node = MapNode::new(*frequency_hz, *damping);
        }
        Ok(map)
    }
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct MotionTable {
    corner_tolerance_mm: Option<f32>,
    corner_overlap_percent: Option<f32>,
    rapid_mm_s: Option<f32>,
    feed_limit_mm_s: Option<f32>,
    yaw_limit_deg_s: Option<f32>,
    joint_speed_deg_s: Option<f32>,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct HopTable {
    height_mm: Option<f32>,
    rise_mm: Option<f32>,
    tolerance_mm: Option<f32>,
    acceleration_mm_s2: Option<f32>,
    #[serde(deserialize_with = "hop_axes")]
    axes: Option<HopAxes>,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct LimitsTable {
    joint1: TurnLimitsTable,
    joint2: TurnLimitsTable,
    joint3: Joint3LimitsTable,
    joint4: TurnLimitsTable,
    path: LengthLimitsTable,
    axis: LengthLimitsTable,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct TurnLimitsTable {
    velocity_deg_s: Option<f32>,
    acceleration_deg_s2: Option<f32>,
    jerk_deg_s3: Option<f32>,
}

/// In mm of a SCARA, in ° of a delta robot.
#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct Joint3LimitsTable {
    velocity_mm_s: Option<f32>,
    acceleration_mm_s2: Option<f32>,
    jerk_mm_s3: Option<f32>,
    velocity_deg_s: Option<f32>,
    acceleration_deg_s2: Option<f32>,
    jerk_deg_s3: Option<f32>,
}

impl Joint3LimitsTable {
    /// What is given in a unit.
    fn given(&self, unit: JointUnit) -> [Option<f32>; 3] {
        match unit {
            JointUnit::Length => [self.velocity_mm_s, self.acceleration_mm_s2, self.jerk_mm_s3],
            JointUnit::Angle => [
                self.velocity_deg_s,
                self.acceleration_deg_s2,
                self.jerk_deg_s3,
            ],
        }
    }

    /// Refuses a limit in the unit of the other kind of robot: its key, and why.
    fn check(&self, kind: ArmKind) -> Result<(), (&'static str, String)> {
        let (other, keys, why) = match kind {
            ArmKind::Scara => (
                JointUnit::Angle,
                ["velocity_deg_s", "acceleration_deg_s2", "jerk_deg_s3"],
                "joint 3 of a SCARA goes up and down: give its limits in mm",
            ),
            ArmKind::Delta => (
                JointUnit::Length,
                ["velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3"],
                "joint 3 of a delta robot turns: give its limits in deg",
            ),
        };
        let mut wrong = self.given(other).into_iter().zip(keys);
        match wrong.find(|(value, _)| value.is_some()) {
            Some((_, key)) => Err((key, why.into())),
            None => Ok(()),
        }
    }
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct LengthLimitsTable {
    velocity_mm_s: Option<f32>,
    acceleration_mm_s2: Option<f32>,
    jerk_mm_s3: Option<f32>,
}

impl LimitsTable {
    fn config(&self, kind: ArmKind) -> LimitsConfig {
        let [_, _, unit, _] = kind.joint_units();
        let values = |[velocity, acceleration, jerk]: [Option<f32>; 3]| MotionLimits {
            velocity: velocity.unwrap_or_default(),
            acceleration: acceleration.unwrap_or_default(),
            jerk: jerk.unwrap_or_default(),
        };
        let turn = |table: &TurnLimitsTable| {
            values([
                table.velocity_deg_s,
                table.acceleration_deg_s2,
                table.jerk_deg_s3,
            ])
        };
        let length = |table: &LengthLimitsTable| {
            values([
                table.velocity_mm_s,
                table.acceleration_mm_s2,
                table.jerk_mm_s3,
            ])
        };
        LimitsConfig {
            joints: [
                turn(&self.joint1),
                turn(&self.joint2),
                values(self.joint3.given(unit)),
                turn(&self.joint4),
            ],
            path: length(&self.path),
            axis: length(&self.axis),
        }
    }
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct PlantTable {
    mode_frequency_hz: Option<f64>,
    mode_damping: Option<f64>,
    mode_slope_hz_per_mm: Option<f64>,
    mode_reference_mm: Option<f64>,
    tool_mass_kg: Option<f64>,
    upper_arm_kg: Option<f64>,
    forearm_kg: Option<f64>,
    platform_kg: Option<f64>,
    end_effector_kg: Option<f64>,
    encoder_noise_rad: Option<f64>,
    encoder_noise_mm: Option<f64>,
    noise_seed: Option<u64>,
    payload: Option<PayloadTable>,
}

/// The gripper, and keys that differ from it.
#[derive(Deserialize, Default, Clone, Copy)]
#[serde(default, deny_unknown_fields)]
struct PayloadTable {
    gripper: Option<GripperName>,
    mass_kg: Option<f64>,
    length_mm: Option<f64>,
    stiffness_nm_per_deg: Option<f64>,
    damping_nm_s_per_deg: Option<f64>,
    peel_off_mm_s2: Option<f64>,
    overshoot_limit_mm: Option<f64>,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum GripperName {
    #[default]
    Flexible,
    Stiff,
}

fn hop_axes<'de, D: Deserializer<'de>>(text: D) -> Result<Option<HopAxes>, D::Error> {
    let name = String::deserialize(text)?;
    let known = || HopAxes::ALL.map(HopAxes::name).join(", ");
    let unknown = || {
        format!(
            "a hop cannot be prefiltered on `{name}`: give one of {}",
            known()
        )
    };
    let axes = HopAxes::from_name(&name).ok_or_else(|| serde::de::Error::custom(unknown()))?;
    Ok(Some(axes))
}

fn axis_set<'de, D: Deserializer<'de>>(text: D) -> Result<Option<AxisSet>, D::Error> {
    let name = String::deserialize(text)?;
    let known = || AxisSet::SETS.map(AxisSet::name).join(", ");
    let unknown = || {
        format!(
            "a mode cannot swing along `{name}`: give one of {}",
            known()
        )
    };
    let axes = AxisSet::from_name(&name).ok_or_else(|| serde::de::Error::custom(unknown()))?;
    Ok(Some(axes))
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct ServoTables {
    joint1: ServoTable,
    joint2: ServoTable,
    joint3: ServoTable,
    joint4: ServoTable,
}

/// Inertias are the simulated robot's, and not the file's to change.
#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct ServoTable {
    position_gain_per_s: Option<f32>,
    velocity_gain: Option<f32>,
    integral_time_s: Option<f32>,
    velocity_feed_forward: Option<f32>,
    acceleration_feed_forward: Option<f32>,
    torque_limit: Option<f32>,
    observer_rad_s: Option<f32>,
}

fn prefilter_name<'de, D: Deserializer<'de>>(text: D) -> Result<Option<Kind>, D::Error> {
    let name = String::deserialize(text)?;
    let known = || Kind::ALL.map(Kind::name).join(", ");
    let unknown = || format!("there is no prefilter `{name}`: give one of {}", known());
    let kind = Kind::from_name(&name).ok_or_else(|| serde::de::Error::custom(unknown()))?;
    Ok(Some(kind))
}

/// The impulses listed; those that are not are none.
fn impulses<'de, D: Deserializer<'de>>(
    list: D,
) -> Result<Option<[CustomImpulse; MAX_IMPULSES]>, D::Error> {
    let given = Vec::<ImpulseTable>::deserialize(list)?;
    let given: Vec<_> = given
        .iter()
        .map(|&ImpulseTable { time_ms, weight }| CustomImpulse { time_ms, weight })
        .collect();
    let too_many = || format!("there are {} impulses: give 1 to 5", given.len());
    let all = custom_impulses(&given).ok_or_else(|| serde::de::Error::custom(too_many()))?;
    Ok(Some(all))
}

/// A list of 1 to 5 impulses as the settings have it.
#[must_use]
pub fn custom_impulses(given: &[CustomImpulse]) -> Option<[CustomImpulse; MAX_IMPULSES]> {
    let none = CustomImpulse {
        time_ms: 0.0,
        weight: 0.0,
    };
    let mut all = [none; MAX_IMPULSES];
    all.get_mut(..given.len())?.copy_from_slice(given);
    (!given.is_empty()).then_some(all)
}

fn method_name<'de, D: Deserializer<'de>>(text: D) -> Result<Option<PostureMethod>, D::Error> {
    let name = String::deserialize(text)?;
    let known = || PostureMethod::ALL.map(PostureMethod::name).join(", ");
    let unknown = || format!("there is no method `{name}`: give one of {}", known());
    let method = PostureMethod::from_name(&name);
    Ok(Some(
        method.ok_or_else(|| serde::de::Error::custom(unknown()))?,
    ))
}

impl Tables {
    fn settings(&self) -> RobotSettings {
        let mut robot = RobotConfig::default();
        let arm = &self.arm;
        let scara = &mut robot.scara;
        set(&mut scara.link1_mm, arm.link1_mm);
        set(&mut scara.link2_mm, arm.link2_mm);
        set(&mut scara.elbow, arm.elbow.map(Elbow::from));
        set(
            &mut scara.singularity_margin_deg,
            arm.singularity_margin_deg,
        );
        let travels = [
            (arm.joint1.min_deg, arm.joint1.max_deg),
            (arm.joint2.min_deg, arm.joint2.max_deg),
            (arm.joint3.min_mm, arm.joint3.max_mm),
            (arm.joint4.min_deg, arm.joint4.max_deg),
        ];
        for (JointRange { min, max }, travel) in scara.joint_limits.iter_mut().zip(travels) {
            set(min, travel.0);
            set(max, travel.1);
        }
        set(&mut robot.arm, self.robot.map(ArmKind::from));
        self.delta.apply(&mut robot.delta);
        self.prefilter.apply(&mut robot.prefilter);
        set(&mut robot.posture_method, self.prefilter.posture_method);
        set(&mut robot.automatic, self.prefilter.automatic);
        set(&mut robot.shortest.uncertainty, self.prefilter.uncertainty);
        set(&mut robot.shortest.limit, self.prefilter.residual_limit);
        let motion = &self.motion;
        set(&mut robot.corner_tolerance_mm, motion.corner_tolerance_mm);
        set(
            &mut robot.corner_overlap_percent,
            motion.corner_overlap_percent,
        );
        set(&mut robot.rapid_mm_s, motion.rapid_mm_s);
        set(&mut robot.feed_limit_mm_s, motion.feed_limit_mm_s);
        set(&mut robot.yaw_limit_deg_s, motion.yaw_limit_deg_s);
        set(&mut robot.joint_speed_deg_s, motion.joint_speed_deg_s);
        let hop = &self.hop;
        set(&mut robot.hop.height_mm, hop.height_mm);
        set(&mut robot.hop.rise_mm, hop.rise_mm);
        set(&mut robot.hop.tolerance_mm, hop.tolerance_mm);
        set(&mut robot.hop.acceleration_mm_s2, hop.acceleration_mm_s2);
        set(&mut robot.hop.axes, hop.axes);
        robot.limits = self.limits.config(robot.arm);
        let mut plant = self.plant.config(&robot);
        let servo = &self.servo;
        let tables = [&servo.joint1, &servo.joint2, &servo.joint3, &servo.joint4];
        for (servo, table) in plant.servos.iter_mut().zip(tables) {
            table.apply(&mut servo.gains);
        }
        RobotSettings { plant, robot }
    }
}

impl DeltaTable {
    fn apply(&self, delta: &mut DeltaConfig) {
        set(&mut delta.base_radius_mm, self.base_radius_mm);
        set(&mut delta.platform_radius_mm, self.platform_radius_mm);
        set(&mut delta.upper_arm_mm, self.upper_arm_mm);
        set(&mut delta.forearm_mm, self.forearm_mm);
        set(&mut delta.arm_limits.min, self.arm.min_deg);
        set(&mut delta.arm_limits.max, self.arm.max_deg);
        set(&mut delta.yaw_limits.min, self.yaw.min_deg);
        set(&mut delta.yaw_limits.max, self.yaw.max_deg);
        set(&mut delta.serial_margin_deg, self.serial_margin_deg);
        set(&mut delta.parallel_margin, self.parallel_margin);
    }
}

impl PrefilterTable {
    fn apply(&self, prefilter: &mut PrefilterConfig) {
        set(&mut prefilter.kind, self.name);
        set(&mut prefilter.frequency_hz, self.frequency_hz);
        set(&mut prefilter.damping, self.damping);
        set(&mut prefilter.axes, self.axes);
        set(&mut prefilter.v_tol, self.v_tol);
        set(&mut prefilter.box_ms, self.box_ms);
        set(&mut prefilter.s_curve_feed_mm_s, self.s_curve_feed_mm_s);
        set(&mut prefilter.s_curve_jerk_mm_s3, self.s_curve_jerk_mm_s3);
        let [smoothing1_ms, smoothing2_ms] = &mut prefilter.smoothing_ms;
        set(smoothing1_ms, self.smoothing1_ms);
        set(smoothing2_ms, self.smoothing2_ms);
        set(&mut prefilter.second.kind, self.mode2.name);
        set(&mut prefilter.second.frequency_hz, self.mode2.frequency_hz);
        set(&mut prefilter.second.damping, self.mode2.damping);
        set(&mut prefilter.second.axes, self.mode2.axes);
        set(&mut prefilter.impulses, self.impulses);
    }
}

impl PlantTable {
    fn config(&self, robot: &RobotConfig) -> PlantConfig {
        let mut plant = PlantConfig {
            link1_mm: robot.scara.link1_mm.into(),
            link2_mm: robot.scara.link2_mm.into(),
            ..PlantConfig::default()
        };
        if robot.arm == ArmKind::Delta {
            let delta = self.delta(&robot.delta);
            plant.servos = FullConfig::delta(delta).joints.map(|joint| joint.servo);
            plant.delta = Some(delta);
        }
        let Mode {
            frequency_hz,
            damping,
        } = &mut plant.mode;
        set(frequency_hz, self.mode_frequency_hz);
        set(damping, self.mode_damping);
        set(&mut plant.mode_slope_hz_per_mm, self.mode_slope_hz_per_mm);
        set(&mut plant.mode_reference_mm, self.mode_reference_mm);
        set(&mut plant.tool_mass_kg, self.tool_mass_kg);
        set(&mut plant.encoder_noise_rad, self.encoder_noise_rad);
        set(&mut plant.encoder_noise_mm, self.encoder_noise_mm);
        set(&mut plant.noise_seed, self.noise_seed);
        plant.payload = self.payload.map(PayloadConfig::from);
        plant
    }

    /// The arms of a delta: lengths as the planner believes them, masses as they are.
    fn delta(&self, config: &DeltaConfig) -> DeltaArm {
        let mut delta = DeltaArm {
            offset_mm: f64::from(config.base_radius_mm) - f64::from(config.platform_radius_mm),
            upper_arm_mm: config.upper_arm_mm.into(),
            forearm_mm: config.forearm_mm.into(),
            ..DeltaArm::default()
        };
        set(&mut delta.upper_arm_kg, self.upper_arm_kg);
        set(&mut delta.forearm_kg, self.forearm_kg);
        set(&mut delta.platform_kg, self.platform_kg);
        set(&mut delta.end_effector_kg, self.end_effector_kg);
        delta
    }
}

impl From<RobotName> for ArmKind {
    fn from(name: RobotName) -> Self {
        match name {
            RobotName::Scara => Self::Scara,
            RobotName::Delta => Self::Delta,
        }
    }
}

impl ServoTable {
    fn apply(&self, gains: &mut ServoGains) {
        set(&mut gains.position_gain, self.position_gain_per_s);
        set(&mut gains.velocity_gain, self.velocity_gain);
        set(&mut gains.integral_time_s, self.integral_time_s);
        set(&mut gains.velocity_feed_forward, self.velocity_feed_forward);
        set(
            &mut gains.acceleration_feed_forward,
            self.acceleration_feed_forward,
        );
        set(&mut gains.torque_limit, self.torque_limit);
        set(&mut gains.observer_rad_s, self.observer_rad_s);
    }
}

impl From<PayloadTable> for PayloadConfig {
    fn from(table: PayloadTable) -> Self {
        let mut payload = match table.gripper.unwrap_or_default() {
            GripperName::Flexible => Self::FLEXIBLE,
            GripperName::Stiff => Self::STIFF,
        };
        set(&mut payload.mass_kg, table.mass_kg);
        set(&mut payload.length_mm, table.length_mm);
        set(
            &mut payload.stiffness_nm_per_deg,
            table.stiffness_nm_per_deg,
        );
        set(
            &mut payload.damping_nm_s_per_deg,
            table.damping_nm_s_per_deg,
        );
        set(&mut payload.peel_off_mm_s2, table.peel_off_mm_s2);
        set(&mut payload.overshoot_limit_mm, table.overshoot_limit_mm);
        payload
    }
}

impl From<ElbowName> for Elbow {
    fn from(name: ElbowName) -> Self {
        match name {
            ElbowName::Left => Self::Left,
            ElbowName::Right => Self::Right,
        }
    }
}

fn set<T>(slot: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *slot = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_file_states_the_defaults() {
        let shipped = RobotSettings::load(None).unwrap();
        assert_eq!(shipped, RobotSettings::parse("empty", "").unwrap());
        assert_eq!(shipped.robot, RobotConfig::default());
        assert_eq!(shipped.plant, PlantConfig::default());
    }

    #[test]
    fn the_deltas_file_states_its_defaults() {
        let text = include_str!("../robots/delta-800.toml");
        let shipped = RobotSettings::parse("delta-800.toml", text).unwrap();
        assert_eq!(shipped.robot.arm, ArmKind::Delta);
        assert_eq!(shipped.robot.delta, DeltaConfig::default());
        // to the precision of the planner's lengths
        let delta = shipped.plant.delta.unwrap();
        let standard = DeltaArm::default();
        assert!((delta.upper_arm_mm - standard.upper_arm_mm).abs() < 1e-4);
        let rounded = DeltaArm {
            upper_arm_mm: standard.upper_arm_mm,
            ..delta
        };
        assert_eq!(rounded, standard);
    }

    #[test]
    fn a_deltas_keys_reach_their_settings() {
        let text = "robot = 'delta'\n[delta]\nforearm_mm = 700\narm.max_deg = 80\n\
                    [plant]\nplatform_kg = 2.5";
        let found = RobotSettings::parse("r.toml", text).unwrap();
        assert_eq!(found.robot.delta.forearm_mm, 700.0);
        assert_eq!(found.robot.delta.arm_limits.max, 80.0);
        let delta = found.plant.delta.unwrap();
        assert_eq!((delta.forearm_mm, delta.platform_kg), (700.0, 2.5));
    }

    #[test]
    fn keys_reach_their_settings() {
        let text = "[arm]\nelbow = 'left'\nlink2_mm = 180\njoint2.min_deg = -150\n\
                    [prefilter]\nname = 'ZV'\n[hop]\naxes = 'across'\n\
                    [plant]\nmode_damping = 0.1\nnoise_seed = 7\n\
                    [plant.payload]\ngripper = 'stiff'\nmass_kg = 0.1";
        let found = RobotSettings::parse("r.toml", text).unwrap();
        assert_eq!(found.robot.scara.elbow, Elbow::Left);
        assert_eq!(found.robot.scara.joint_limits[1].min, -150.0);
        assert_eq!(found.robot.prefilter.kind, Kind::Zv);
        assert_eq!((found.plant.link1_mm, found.plant.link2_mm), (200.0, 180.0));
        assert_eq!((found.plant.mode.damping, found.plant.noise_seed), (0.1, 7));
        assert_eq!(found.robot.hop.axes, HopAxes::Across);
        let payload = found.plant.payload.unwrap();
        assert_eq!(payload.length_mm, PayloadConfig::STIFF.length_mm);
        assert_eq!(payload.mass_kg, 0.1);
        let text = "limits.joint4.jerk_deg_s3 = 5\nlimits.joint3.velocity_mm_s = 6\n\
                    limits.axis.acceleration_mm_s2 = 7";
        let limits = RobotSettings::parse("r.toml", text).unwrap().robot.limits;
        assert_eq!(
            (limits.joints[3].jerk, limits.joints[2].velocity),
            (5.0, 6.0)
        );
        assert_eq!(limits.axis.acceleration, 7.0);
        let text = "robot = 'delta'\nlimits.joint3.velocity_deg_s = 8";
        let limits = RobotSettings::parse("r.toml", text).unwrap().robot.limits;
        assert_eq!(limits.joints[2].velocity, 8.0);
    }

    #[test]
    fn a_second_mode_and_a_list_of_impulses() {
        let text = "[prefilter]\nname = 'custom'\nv_tol = 0.1\nsmoothing2_ms = 20\n\
                    [prefilter.mode2]\nname = '2hump-ei'\nfrequency_hz = 31\ndamping = 0.01\naxes = 'y'\n\
                    [[prefilter.impulses]]\ntime_ms = 0\nweight = 2\n\
                    [[prefilter.impulses]]\ntime_ms = 80\nweight = 1";
        let prefilter = RobotSettings::parse("r.toml", text)
            .unwrap()
            .robot
            .prefilter;
        assert_eq!(
            (prefilter.kind, prefilter.v_tol, prefilter.smoothing_ms),
            (Kind::Custom, 0.1, [0.0, 20.0])
        );
        let second = prefilter.second;
        assert_eq!(
            (second.kind, second.frequency_hz, second.damping),
            (Kind::TwoHumpEi, 31.0, 0.01)
        );
        assert_eq!(second.axes, AxisSet::of([false, true, false]));
        assert_eq!(prefilter.axes, AxisSet::ALL);
        let list = prefilter.impulses.map(|one| (one.time_ms, one.weight));
        assert_eq!(list[..3], [(0.0, 2.0), (80.0, 1.0), (0.0, 0.0)]);
    }

    #[test]
    fn a_map_is_a_table() {
        let text = "[map]\nx_mm = [100, 300]\ny_mm = [-50, 50]\ncolumns = 2\nrows = 2\n\
                    modes = [[8, 0.02], [9, 0.02], [10, 0.03], [11.5, 0.04]]\n\
                    [prefilter]\nposture_method = 'hybrid'\nautomatic = true";
        let robot = RobotSettings::parse("r.toml", text).unwrap().robot;
        assert!(robot.map.is_complete());
        assert_eq!(robot.map.used()[3], MapNode::new(11.5, 0.04));
        assert_eq!(robot.posture_method, PostureMethod::Hybrid);
        assert!(robot.automatic);
    }

    #[test]
    fn errors_name_file_line_and_key() {
        for (text, expected) in [
            (
                "[arm]\nlink3_mm = 1",
                "r.toml, line 2, key arm.link3_mm: unknown field",
            ),
            ("\n[legs]", "r.toml, line 2, key legs: unknown field `legs`"),
            (
                "[arm]\n\nlink1_mm = 'long'",
                "r.toml, line 3, key arm.link1_mm: invalid type",
            ),
            (
                "[arm]\nelbow = 'up'",
                "r.toml, line 2, key arm.elbow: unknown variant",
            ),
            (
                "[prefilter]\nname = 'zvx'",
                "key prefilter.name: there is no prefilter `zvx`",
            ),
            ("arm = 3", "r.toml, line 1, key arm: invalid type"),
            (
                "[arm]\nlink1_mm = 5",
                "r.toml, line 2, key arm.link1_mm: link 1 must be",
            ),
            (
                "[arm]\nlink2_mm = 1900",
                "r.toml, line 2, key arm.link2_mm: the links must not",
            ),
            (
                "[arm.joint4]\nmin_deg = 9e9",
                "r.toml, line 1, key arm.joint4: the limits of joint 4",
            ),
            (
                "[prefilter]\ndamping = nan",
                "r.toml, line 2, key prefilter.damping: the prefilter's",
            ),
            (
                "[prefilter]\nmode2.frequency_hz = 999",
                "line 2, key prefilter.mode2.frequency_hz: the second mode's",
            ),
            (
                "[prefilter]\naxes = 'yx'",
                "key prefilter.axes: a mode cannot swing along `yx`: give one of xyz, x, y",
            ),
            (
                "[prefilter]\nautomatic = true\nmode2 = { frequency_hz = 9, axes = 'x' }",
                "key prefilter.mode2.axes: a mode along some axes only needs a prefilter that",
            ),
            (
                "[prefilter]\nimpulses = []",
                "line 2, key prefilter.impulses: there are 0 impulses",
            ),
            (
                "[prefilter]\nimpulses = [{ time_ms = 1, weight = 1 }]",
                "line 2, key prefilter.impulses: impulse 1 is out of range",
            ),
            (
                "[prefilter]\nv_tol = 5",
                "line 2, key prefilter.v_tol: the residual allowed",
            ),
            (
                "[prefilter]\nfrequency_hz = 1",
                "line 2, key prefilter.frequency_hz: the prefilter is",
            ),
            (
                "[motion]\n\nrapid_mm_s = 0",
                "r.toml, line 3, key motion.rapid_mm_s: the setting rapid",
            ),
            (
                "[limits.joint2]\njerk_deg_s3 = -1",
                "r.toml, line 2, key limits.joint2.jerk_deg_s3: the setting joint2-jerk",
            ),
            (
                "limits.joint3.velocity_deg_s = 1",
                "key limits.joint3.velocity_deg_s: joint 3 of a SCARA goes up and down",
            ),
            (
                "robot = 'delta'\nlimits.joint3.jerk_mm_s3 = 1",
                "r.toml, line 2, key limits.joint3.jerk_mm_s3: joint 3 of a delta robot turns",
            ),
            (
                "robot = 'delta'\nlimits.joint3.jerk_deg_s3 = -1",
                "r.toml, line 2, key limits.joint3.jerk_deg_s3: the setting joint3-jerk",
            ),
            (
                "plant.mode_damping = 2",
                "r.toml, line 1, key plant.mode_damping: 2 is outside 0 to 0.9",
            ),
            (
                "robot = 'gantry'",
                "r.toml, line 1, key robot: unknown variant `gantry`",
            ),
            (
                "robot = 'delta'\n[delta]\nforearm_mm = 2",
                "r.toml, line 3, key delta.forearm_mm: the delta's forearm",
            ),
            (
                "robot = 'delta'\nplant.platform_kg = 0",
                "r.toml, line 2, key plant.platform_kg: 0 is outside",
            ),
            (
                "[hop]\nrise_mm = 20",
                "r.toml, line 2, key hop.rise_mm: the hop rises by 20 mm",
            ),
            (
                "[hop]\naxes = 'z'",
                "key hop.axes: a hop cannot be prefiltered on `z`",
            ),
            (
                "[plant.payload]\nlength_mm = 0",
                "r.toml, line 2, key plant.payload.length_mm: 0 is outside 1 to 2000",
            ),
            (
                "[prefilter]\nposture_method = 'c'",
                "key prefilter.posture_method: there is no method `c`",
            ),
            (
                "[prefilter]\nuncertainty = 0.6",
                "r.toml, line 2, key prefilter.uncertainty: the setting uncertainty",
            ),
            (
                "[map]\nx_mm = [0, 9]\ny_mm = [0, 9]\ncolumns = 2\nrows = 1\nmodes = [[8, 0.1]]",
                "r.toml, line 6, key map.modes: the map has 1 modes and room for 2",
            ),
            (
                "[map]\nx_mm = [9, 0]\ny_mm = [0, 9]\ncolumns = 1\nrows = 1\nmodes = [[8, 0.1]]",
                "r.toml, line 2, key map.x_mm: the map's last place along X",
            ),
            (
                "[map]\nx_mm = [0, 9]\ny_mm = [0, 9]\ncolumns = 1\nrows = 1\nmodes = [[2, 0.1]]",
                "key map.modes: the prefilter for the map's slowest mode is",
            ),
            ("[arm\n", "r.toml, line 1: "),
        ] {
            let error = RobotSettings::parse("r.toml", text)
                .unwrap_err()
                .to_string();
            assert!(error.contains(expected), "{text:?}: {error}");
            assert!(!error.contains('\n'), "{error}");
        }
        let missing = RobotSettings::load(Some(Path::new("no/such.toml"))).unwrap_err();
        assert!(
            missing
                .to_string()
                .starts_with("no/such.toml: the robot file cannot be read")
        );
    }
}
