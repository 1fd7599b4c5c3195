//! The robot's settings (SI units and degrees) and the robot made from them.

use core::fmt;

use crate::corner::CornerRule;
use crate::hop::{HopAxes, HopConfig, HopError};
use crate::kinematics::{
    Arm, ArmKind, Delta, DeltaConfig, DeltaError, Elbow, JointRange, Scara, ScaraConfig, ScaraError,
};
use crate::limits::{Limits, LimitsConfig, MotionLimits, Part, add_boxes};
use crate::pose::AXES;
use crate::posture::{
    FollowConfig, FollowError, Follower, MapNode, ModeMapConfig, PostureMethod, ShortestConfig,
    Tuning,
};
use crate::prefilter::{
    AxisSet, Kernel, Kind, Prefilter, PrefilterConfig, PrefilterError, Response,
};

/// Everything that a builder sets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotConfig {
    /// Which robot it is.
    pub arm: ArmKind,
    /// Arm lengths, elbow and joint limits, if it is a SCARA.
    pub scara: ScaraConfig,
    /// Arm lengths and limits, if it is a delta.
    pub delta: DeltaConfig,
    /// Which vibration to suppress, and how.
    pub prefilter: PrefilterConfig,
    /// The mode over the workspace; without it the prefilter's is the mode everywhere.
    pub map: ModeMapConfig,
    /// What the prefilters that follow the map are made from.
    pub posture_method: PostureMethod,
    /// Whether each move gets the shortest prefilter that leaves little enough, instead of the
    /// named one.
    pub automatic: bool,
    /// What that prefilter has to achieve.
    pub shortest: ShortestConfig,
    /// Corner tolerance in mm where the program gives none, 0 to 100; 0 stops at corners.
    pub corner_tolerance_mm: f32,
    /// Corner overlap in percent where the program gives no tolerance, above 0 to 100: instead of
    /// the tolerance, which is not promised then. 0 rounds corners by their tolerance.
    pub corner_overlap_percent: f32,
    /// Feedrate of `G0` in mm/s, above 0 to 10 000.
    pub rapid_mm_s: f32,
    /// Fastest feedrate in mm/s, above 0 to 10 000; a program that asks for more gets this.
    pub feed_limit_mm_s: f32,
    /// Fastest turn of the yaw in °/s, above 0 to 10 000.
    pub yaw_limit_deg_s: f32,
    /// Speed of joints 1, 2 and 4 while the elbow changes its side, in °/s, above 0 to 10 000.
    pub joint_speed_deg_s: f32,
    /// How pick-and-place moves go where the program does not say.
    pub hop: HopConfig,
    /// Limits of velocity, acceleration and jerk.
    pub limits: LimitsConfig,
}

impl Default for RobotConfig {
    fn default() -> Self {
        Self {
            arm: ArmKind::default(),
            scara: ScaraConfig::default(),
            delta: DeltaConfig::default(),
            prefilter: PrefilterConfig::default(),
            map: ModeMapConfig::NONE,
            posture_method: PostureMethod::Local,
            automatic: false,
            shortest: ShortestConfig {
                uncertainty: 0.05,
                limit: 0.05,
            },
            corner_tolerance_mm: 0.5,
            corner_overlap_percent: 0.0,
            rapid_mm_s: 160.0,
            feed_limit_mm_s: 1000.0,
            yaw_limit_deg_s: 360.0,
            joint_speed_deg_s: 90.0,
            hop: HopConfig::default(),
            limits: LimitsConfig::default(),
        }
    }
}

/// Why a robot's settings are refused; names the setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConfigError {
    /// The SCARA's geometry.
    Scara(ScaraError),
    /// The delta's geometry.
    Delta(DeltaError),
    /// The prefilter.
    Prefilter(PrefilterError),
    /// The map of the mode, or the prefilters that follow it.
    Follow(FollowError),
    /// Pick-and-place moves.
    Hop(HopError),
    /// Axes of a mode beside a map of the mode or a prefilter that is chosen automatically.
    AxesOnMap,
    /// A plain number is out of its range.
    Range {
        /// Name of the setting.
        name: &'static str,
        /// What was given.
        value: f32,
        /// Lowest value.
        low: f32,
        /// Highest value.
        high: f32,
    },
}

impl From<ScaraError> for ConfigError {
    fn from(error: ScaraError) -> Self {
        Self::Scara(error)
    }
}

impl From<DeltaError> for ConfigError {
    fn from(error: DeltaError) -> Self {
        Self::Delta(error)
    }
}

impl From<PrefilterError> for ConfigError {
    fn from(error: PrefilterError) -> Self {
        Self::Prefilter(error)
    }
}

impl From<HopError> for ConfigError {
    fn from(error: HopError) -> Self {
        Self::Hop(error)
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scara(error) => error.fmt(f),
            Self::Delta(error) => error.fmt(f),
            Self::Prefilter(error) => error.fmt(f),
            Self::Follow(error) => error.fmt(f),
            Self::Hop(error) => error.fmt(f),
            Self::AxesOnMap => f.write_str(
                "a mode along some axes only needs a prefilter that neither follows a map of the mode nor is chosen automatically: leave out either",
            ),
            Self::Range {
                name,
                value,
                low,
                high,
            } => write!(
                f,
                "the setting {name} is {value}, outside {low} to {high}: give a value within that range"
            ),
        }
    }
}

impl core::error::Error for ConfigError {}

/// A robot with validated settings, in the units that planning and tick work in.
#[derive(Clone, Debug)]
pub struct Robot {
    /// The settings that it was made from.
    pub config: RobotConfig,
    /// Kinematics of the arm.
    pub arm: Arm,
    /// Chooses the prefilters of each move, if there is a map of the mode.
    pub follower: Option<Follower>,
    /// What the prefilter in force at the end of the path planned so far is made of.
    pub tuning: Tuning,
    /// The axes along which the path may go with it: see [`PrefilterConfig::axes`].
    pub along: AxisSet,
    /// The longest box of the prefilter in s, if it has one.
    pub longest_box_s: Option<f32>,
    /// The prefilter in integer taps.
    pub kernel: Kernel,
    /// What an acceleration looks like from its start.
    pub accelerating: Response,
    /// What a deceleration looks like from its end.
    pub decelerating: Response,
    /// What limits its motion.
    pub limits: Limits,
}

impl Robot {
    /// Validates the settings.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of range.
    pub fn new(config: &RobotConfig) -> Result<Self, ConfigError> {
        check_ranges(config)?;
        let mut robot = Self::unfiltered(config, arm(config)?);
        robot.set_config(config)?;
        Ok(robot)
    }

    /// A robot of these settings and this arm that has no prefilter yet. [`Robot::set_config`]
    /// completes it where it stays, so that the stack never holds a robot and what it is made of.
    #[must_use]
    pub fn unfiltered(config: &RobotConfig, arm: Arm) -> Self {
        Self {
            config: *config,
            limits: Limits::new(config, &arm, &Prefilter::NONE, 0.0),
            arm,
            follower: None,
            tuning: Tuning::Named(config.prefilter),
            along: AxisSet::ALL,
            kernel: Kernel::NONE,
            accelerating: Response::NONE,
            decelerating: Response::NONE,
            longest_box_s: None,
        }
    }

    /// Changes all settings, each part in its place.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of range; nothing is changed then.
    #[inline(never)]
    pub fn set_config(&mut self, config: &RobotConfig) -> Result<(), ConfigError> {
        let tuning = self.take_config(config)?;
        // its taps have been made before: this does not fail
        self.tune(&tuning)?;
        self.along = AxisSet::ALL;
        Ok(())
    }

    /// Changes all settings but the prefilter, and yields what that is to be made of.
    #[inline(never)]
    fn take_config(&mut self, config: &RobotConfig) -> Result<Tuning, ConfigError> {
        check_ranges(config)?;
        let arm = arm(config)?;
        let mut follower = None;
        let wanted = (&config.prefilter, config.automatic);
        let tuning = take_follower(&mut follower, config, &arm, wanted)?;
        // nothing fails from here on
        self.config = *config;
        self.arm = arm;
        self.follower = follower;
        Ok(tuning)
    }

    /// Changes the side of a SCARA's elbow.
    pub fn set_elbow(&mut self, elbow: Elbow) {
        self.config.scara.elbow = elbow;
        self.arm.set_elbow(elbow);
    }

    /// Changes the prefilter; with a map, the kind that follows it. Another kind is not chosen
    /// automatically any more.
    ///
    /// # Errors
    /// [`ConfigError`] names the value that is out of range; nothing is changed then.
    #[inline(never)]
    pub fn set_prefilter(&mut self, config: &PrefilterConfig) -> Result<(), ConfigError> {
        let stays_automatic = self.stays_automatic(config);
        let mut follower = None;
        let wanted = (config, stays_automatic);
        let tuning = take_follower(&mut follower, &self.config, &self.arm, wanted)?;
        // nothing fails from here on
        self.along = AxisSet::ALL;
        self.follower = follower;
        self.config.prefilter = *config;
        self.config.automatic = stays_automatic;
        self.tune(&tuning)?;
        Ok(())
    }

    /// Whether the prefilter can be changed to that. Not inlined, so that what it makes is on the
    /// stack for a moment only.
    ///
    /// # Errors
    /// As [`Robot::set_prefilter`].
    #[inline(never)]
    pub fn check_prefilter(&self, config: &PrefilterConfig) -> Result<(), ConfigError> {
        let wanted = (config, self.stays_automatic(config));
        take_follower(&mut None, &self.config, &self.arm, wanted)?;
        Ok(())
    }

    fn stays_automatic(&self, config: &PrefilterConfig) -> bool {
        self.config.automatic && config.kind == self.config.prefilter.kind
    }

    /// Goes on with the prefilters that a path along these axes needs: of a mode along other axes
    /// there is nothing to suppress. Whether that is another prefilter than the one in force.
    #[inline(never)]
    pub fn suit(&mut self, along: AxisSet) -> bool {
        let config = &self.config.prefilter;
        if config.modes_along(along) == config.modes_along(self.along) {
            return false;
        }
        // there is none on all axes with a map, and its taps have been made before
        let is_other = self.tune_along(along).is_ok();
        if is_other {
            self.along = along;
        }
        is_other
    }

    #[inline(never)]
    fn tune_along(&mut self, along: AxisSet) -> Result<(), PrefilterError> {
        self.tune(&tuning_along(
            &self.config,
            &self.arm,
            &self.config.prefilter,
            along,
        ))
    }

    /// Goes on with a prefilter of this tuning.
    ///
    /// # Errors
    /// [`PrefilterError`] names the value that is out of range; nothing is changed then.
    #[inline(never)]
    pub fn tune(&mut self, tuning: &Tuning) -> Result<(), PrefilterError> {
        let mut prefilter = Prefilter::NONE;
        tuning.make(&mut prefilter)?;
        set_kernel(&mut self.kernel, &prefilter)?;
        let reach_s = self.follower.as_ref().map_or(0.0, Follower::reach_s);
        self.limits = Limits::new(&self.config, &self.arm, &prefilter, reach_s);
        self.accelerating.set(prefilter.stages(), false);
        self.decelerating.set(prefilter.stages(), true);
        self.longest_box_s = longest_box_s(&prefilter);
        self.tuning = *tuning;
        Ok(())
    }

    /// The prefilter in seconds. It is made anew each time, to keep a robot small.
    #[must_use]
    pub fn prefilter(&self) -> Prefilter {
        let mut prefilter = Prefilter::NONE;
        self.put_prefilter(&mut prefilter);
        prefilter
    }

    /// Makes the prefilter in its place, where the stack has no room for a copy.
    pub(crate) fn put_prefilter(&self, prefilter: &mut Prefilter) {
        // one of this tuning has been made before: this does not fail
        let _ = self.tuning.make(prefilter);
    }

    /// The boxes that the prefilter was given because limits need them, in s; where it is chosen
    /// automatically, those that any choice has.
    pub fn added_boxes_s(&self) -> impl Iterator<Item = f64> {
        let own_ms = self.config.prefilter.smoothing_ms;
        let mut added_s = [None; 2];
        let mut look = |tuning: &Tuning| {
            let Tuning::Named(config) = tuning else {
                return;
            };
            let boxes_s = Prefilter::boxes_of(config);
            let both_ms = config.smoothing_ms.into_iter().zip(own_ms);
            for (added_s, (length_ms, own_ms)) in added_s.iter_mut().zip(both_ms) {
                let length_s = f64::from(length_ms) / 1e3;
                if length_ms != own_ms && boxes_s.contains(&length_s) {
                    *added_s = Some(length_s);
                }
            }
        };
        look(&self.tuning);
        if let Some(follower) = &self.follower {
            follower.each_slowest(&mut look);
        }
        added_s.into_iter().flatten()
    }
}

// Each of these makes something large in a frame of its own, so that the stack holds one of
// them at a time.

#[inline(never)]
fn set_kernel(kernel: &mut Kernel, prefilter: &Prefilter) -> Result<(), PrefilterError> {
    *kernel = Kernel::new(prefilter)?;
    Ok(())
}

/// Whether there are taps for the prefilter of a tuning.
#[inline(never)]
fn check_tuning(tuning: &Tuning) -> Result<(), PrefilterError> {
    let mut prefilter = Prefilter::NONE;
    tuning.make(&mut prefilter)?;
    Kernel::new(&prefilter).map(drop)
}

/// Whether there are taps for the prefilters of all axes along which a path may go.
#[inline(never)]
fn check_along(
    robot: &RobotConfig,
    arm: &Arm,
    prefilter: &PrefilterConfig,
) -> Result<(), PrefilterError> {
    if prefilter.chooses_axes() {
        for axes in AxisSet::SETS {
            check_tuning(&tuning_along(robot, arm, prefilter, axes))?;
        }
    }
    Ok(())
}

/// What the prefilter for a path along these axes is made of.
#[inline(never)]
fn tuning_along(
    robot: &RobotConfig,
    arm: &Arm,
    prefilter: &PrefilterConfig,
    axes: AxisSet,
) -> Tuning {
    let mut prefilter = prefilter.along(axes);
    add_boxes(&mut prefilter, robot, arm, false);
    Tuning::Named(prefilter)
}

/// The arm that the settings describe.
///
/// # Errors
/// [`ConfigError`] names the first setting of the arm that is out of range.
#[inline(never)]
pub fn arm(config: &RobotConfig) -> Result<Arm, ConfigError> {
    Ok(match config.arm {
        ArmKind::Scara => Arm::Scara(Scara::new(&config.scara)?),
        ArmKind::Delta => Arm::Delta(Delta::new(&config.delta)?),
    })
}

fn longest_box_s(prefilter: &Prefilter) -> Option<f32> {
    prefilter.longest_box_s().map(|length_s| length_s as f32)
}

/// Whether all plain numbers are within their ranges.
#[inline(never)]
fn check_ranges(config: &RobotConfig) -> Result<(), ConfigError> {
    let checks = [
        ("tolerance", config.corner_tolerance_mm, 0.0, 100.0),
        ("overlap", config.corner_overlap_percent, 0.0, 100.0),
        ("rapid", config.rapid_mm_s, 0.001, 10_000.0),
        ("feed-limit", config.feed_limit_mm_s, 0.001, 10_000.0),
        ("yaw-limit", config.yaw_limit_deg_s, 0.001, 10_000.0),
        ("joint-speed", config.joint_speed_deg_s, 0.001, 10_000.0),
        ("uncertainty", config.shortest.uncertainty, 0.0, 0.5),
        ("residual-limit", config.shortest.limit, 0.001, 1.0),
    ];
    for (name, value, low, high) in checks {
        if !(low..=high).contains(&value) {
            return Err(ConfigError::Range {
                name,
                value,
                low,
                high,
            });
        }
    }
    config.hop.check()?;
    if (config.map.is_some() || config.automatic) && config.prefilter.chooses_axes() {
        return Err(ConfigError::AxesOnMap);
    }
    check_limits(config)
}

fn check_limits(config: &RobotConfig) -> Result<(), ConfigError> {
    let limits = &config.limits;
    for (part, values) in limits.all() {
        let names = limit_names(part);
        let values = [values.velocity, values.acceleration, values.jerk];
        for ((name, value), high) in names.iter().zip(values).zip(LimitsConfig::HIGHEST) {
            if !(0.0..=high).contains(&value) {
                return Err(ConfigError::Range {
                    name,
                    value,
                    low: 0.0,
                    high,
                });
            }
        }
    }
    Ok(())
}

/// The settings of the limits of a part.
const fn limit_names(part: Part) -> &'static [&'static str; 3] {
    match part {
        Part::Joint(1) => &["joint1-velocity", "joint1-acceleration", "joint1-jerk"],
        Part::Joint(2) => &["joint2-velocity", "joint2-acceleration", "joint2-jerk"],
        Part::Joint(3) => &["joint3-velocity", "joint3-acceleration", "joint3-jerk"],
        Part::Joint(_) => &["joint4-velocity", "joint4-acceleration", "joint4-jerk"],
        Part::Path => &["path-velocity", "path-acceleration", "path-jerk"],
        Part::Axis => &["axis-velocity", "axis-acceleration", "axis-jerk"],
    }
}

/// Makes what follows the map in its place, and yields what the prefilter is made of at first, once
/// its settings are these and it is chosen automatically or not.
#[inline(never)]
fn take_follower(
    place: &mut Option<Follower>,
    robot: &RobotConfig,
    arm: &Arm,
    (config, automatic): (&PrefilterConfig, bool),
) -> Result<Tuning, ConfigError> {
    let mut prefilter = *config;
    add_boxes(&mut prefilter, robot, arm, automatic);
    make_follower(place, robot, &prefilter, automatic)?;
    let tuning = first_tuning(&prefilter, place.as_ref());
    check_tuning(&tuning)?;
    check_along(robot, arm, config)?;
    Ok(tuning)
}

/// Makes what chooses the prefilters of each move, if there is a map or a choice, for these
/// settings of the prefilter instead of the robot's own.
#[inline(never)]
fn make_follower(
    place: &mut Option<Follower>,
    config: &RobotConfig,
    prefilter: &PrefilterConfig,
    automatic: bool,
) -> Result<(), ConfigError> {
    if !config.map.is_complete() && !automatic {
        return Ok(());
    }
    let (frequency_hz, damping) = (prefilter.frequency_hz, prefilter.damping);
    let everywhere;
    let map = if config.map.is_complete() {
        &config.map
    } else {
        everywhere = ModeMapConfig::constant(MapNode::new(frequency_hz, damping));
        &everywhere
    };
    let follow = FollowConfig {
        map,
        prefilter: *prefilter,
        shortest: automatic.then_some(config.shortest),
        method: config.posture_method,
    };
    Follower::make(place, &follow).map_err(ConfigError::Follow)
}

/// What the prefilter is made of before the first move.
fn first_tuning(config: &PrefilterConfig, follower: Option<&Follower>) -> Tuning {
    follower.map_or(Tuning::Named(*config), Follower::slowest)
}

/// Why a `name=value` setting is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingError {
    /// There is no setting of that name.
    Unknown,
    /// The value is not a number, or none of the names that this setting takes.
    Value,
}

impl fmt::Display for SettingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "there is no setting of that name: see the table of settings",
            Self::Value => "the setting's value cannot be read: give a number or one of its names",
        })
    }
}

impl core::error::Error for SettingError {}

/// A setting's place in the configuration.
enum Slot<'a> {
    Number(&'a mut f32),
    Prefilter(&'a mut Kind),
    Elbow(&'a mut Elbow),
    Arm(&'a mut ArmKind),
    HopAxes(&'a mut HopAxes),
    Axes(&'a mut AxisSet),
    Method(&'a mut PostureMethod),
    Switch(&'a mut bool),
}

/// The value of a setting, as text shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingValue {
    /// A number in the setting's unit.
    Number(f32),
    /// One of the setting's names.
    Name(&'static str),
}

impl fmt::Display for SettingValue {
    /// Written so that it reads back as exactly the same value.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value) => value.fmt(f),
            Self::Name(name) => f.write_str(name),
        }
    }
}

impl RobotConfig {
    /// How corners are passed where the program does not say.
    #[must_use]
    pub fn corner(&self) -> CornerRule {
        if self.corner_overlap_percent > 0.0 {
            CornerRule::OverlapPercent(self.corner_overlap_percent)
        } else {
            CornerRule::ToleranceMm(self.corner_tolerance_mm)
        }
    }

    /// Names of all settings, in groups whose values must fit each other: lengths in mm, angles
    /// in °, the frequency in Hz, feedrates in mm/s, the yaw limit in °/s, limits of joints
    /// that turn in °, the others in mm.
    pub const GROUPS: [&'static [&'static str]; 28] = [
        &[
            "robot",
            "delta-base",
            "delta-platform",
            "delta-upper-arm",
            "delta-forearm",
            "delta-arm-min",
            "delta-arm-max",
            "delta-yaw-min",
            "delta-yaw-max",
            "delta-serial-margin",
            "delta-parallel-margin",
        ],
        &["link1", "link2"],
        &["elbow", "joint2-min", "joint2-max", "singularity-margin"],
        &["joint1-min", "joint1-max"],
        &["joint3-min", "joint3-max"],
        &["joint4-min", "joint4-max"],
        &[
            "prefilter",
            "frequency",
            "damping",
            "axes",
            "v-tol",
            "box-ms",
            "s-curve-feed",
            "s-curve-jerk",
        ],
        &["prefilter2", "frequency2", "damping2", "axes2"],
        &["smoothing1-ms", "smoothing2-ms"],
        &[
            "impulse1-weight",
            "impulse2-weight",
            "impulse3-weight",
            "impulse4-weight",
            "impulse5-weight",
        ],
        &["impulse2-ms", "impulse3-ms", "impulse4-ms", "impulse5-ms"],
        &[
            "posture-method",
            "automatic",
            "uncertainty",
            "residual-limit",
        ],
        &["tolerance"],
        &["overlap"],
        &["rapid"],
        &["feed-limit"],
        &["yaw-limit"],
        &["joint-speed"],
        &["hop-height", "hop-rise"],
        &["hop-tolerance"],
        &["hop-acceleration"],
        &["hop-axes"],
        limit_names(Part::Joint(1)),
        limit_names(Part::Joint(2)),
        limit_names(Part::Joint(3)),
        limit_names(Part::Joint(4)),
        limit_names(Part::Path),
        limit_names(Part::Axis),
    ];

    /// Travels of joints 1 to 4 in ° or mm.
    #[must_use]
    pub const fn joint_limits(&self) -> [JointRange; AXES] {
        match self.arm {
            ArmKind::Scara => self.scara.joint_limits,
            ArmKind::Delta => {
                let (arm, yaw) = (self.delta.arm_limits, self.delta.yaw_limits);
                [arm, arm, arm, yaw]
            }
        }
    }

    /// Sets values from `name=value` texts between blanks, as a `$` line carries them.
    ///
    /// Their ranges are checked when a [`Robot`] is made.
    ///
    /// # Errors
    /// [`SettingError`] if a name or a value cannot be read; nothing is changed then.
    pub fn set_all(&mut self, text: &str) -> Result<(), SettingError> {
        let mut changed = *self;
        for pair in text.split_ascii_whitespace() {
            changed.set(pair)?;
        }
        *self = changed;
        Ok(())
    }

    /// Sets one value from a `name=value` text.
    ///
    /// The value's range is checked when a [`Robot`] is made.
    ///
    /// # Errors
    /// [`SettingError`] if the name or the value cannot be read; nothing is changed then.
    pub fn set(&mut self, text: &str) -> Result<(), SettingError> {
        let (name, value) = text.split_once('=').ok_or(SettingError::Value)?;
        let value = value.trim();
        if let Some(is_read) = self.set_map(name.trim(), value) {
            return is_read.then_some(()).ok_or(SettingError::Value);
        }
        match self.slot(name.trim()).ok_or(SettingError::Unknown)? {
            Slot::Number(number) => *number = value.parse().map_err(|_| SettingError::Value)?,
            Slot::Prefilter(kind) => *kind = Kind::from_name(value).ok_or(SettingError::Value)?,
            Slot::Elbow(elbow) => *elbow = named(&ELBOWS, value).ok_or(SettingError::Value)?,
            Slot::Arm(arm) => *arm = named(&ARMS, value).ok_or(SettingError::Value)?,
            Slot::HopAxes(axes) => *axes = HopAxes::from_name(value).ok_or(SettingError::Value)?,
            Slot::Axes(axes) => *axes = AxisSet::from_name(value).ok_or(SettingError::Value)?,
            Slot::Method(method) => {
                *method = PostureMethod::from_name(value).ok_or(SettingError::Value)?;
            }
            Slot::Switch(switch) => {
                *switch = match value {
                    "0" => false,
                    "1" => true,
                    _ => return Err(SettingError::Value),
                };
            }
        }
        Ok(())
    }

    /// Sets one value by its number: of the setting's unit, or counting its names from 0. A
    /// name or number that does not exist changes nothing.
    pub(crate) fn set_value(&mut self, name: &str, value: f32) {
        match self.slot(name) {
            Some(Slot::Number(number)) => *number = value,
            Some(Slot::Prefilter(kind)) => {
                *kind = Kind::ALL.get(value as usize).copied().unwrap_or(*kind);
            }
            Some(Slot::Elbow(elbow)) => {
                *elbow = ELBOWS
                    .get(value as usize)
                    .map_or(*elbow, |(_, elbow)| *elbow);
            }
            Some(Slot::Arm(arm)) => {
                *arm = ARMS.get(value as usize).map_or(*arm, |(_, arm)| *arm);
            }
            Some(Slot::HopAxes(axes)) => {
                *axes = HopAxes::ALL.get(value as usize).copied().unwrap_or(*axes);
            }
            Some(Slot::Axes(axes)) => {
                *axes = AxisSet::SETS.get(value as usize).copied().unwrap_or(*axes);
            }
            Some(Slot::Method(method)) => {
                let all = PostureMethod::ALL;
                *method = all.get(value as usize).copied().unwrap_or(*method);
            }
            Some(Slot::Switch(switch)) => *switch = value != 0.0,
            None => {}
        }
    }

    /// The value of a setting; `None` if there is no setting of that name.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<SettingValue> {
        let mut copy = *self;
        Some(match copy.slot(name)? {
            Slot::Number(number) => SettingValue::Number(*number),
            Slot::Prefilter(kind) => SettingValue::Name(kind.name()),
            Slot::Elbow(elbow) => SettingValue::Name(name_of(&ELBOWS, elbow)),
            Slot::Arm(arm) => SettingValue::Name(name_of(&ARMS, arm)),
            Slot::HopAxes(axes) => SettingValue::Name(axes.name()),
            Slot::Axes(axes) => SettingValue::Name(axes.name()),
            Slot::Method(method) => SettingValue::Name(method.name()),
            Slot::Switch(switch) => SettingValue::Number(f32::from(u8::from(*switch))),
        })
    }

    /// Sets part of the map: see [`ModeMapConfig::set`].
    pub(crate) fn set_map(&mut self, key: &str, value: &str) -> Option<bool> {
        self.map.set(key, value)
    }

    fn slot(&mut self, name: &str) -> Option<Slot<'_>> {
        if let Some(limit) = limit_named(&mut self.limits, name) {
            return Some(Slot::Number(limit));
        }
        let [joint1, joint2, joint3, joint4] = &mut self.scara.joint_limits;
        let prefilter = &mut self.prefilter;
        let second = &mut prefilter.second;
        let [impulse1, impulse2, impulse3, impulse4, impulse5] = &mut prefilter.impulses;
        let [smoothing1_ms, smoothing2_ms] = &mut prefilter.smoothing_ms;
        Some(match name {
            "prefilter" => Slot::Prefilter(&mut prefilter.kind),
            "prefilter2" => Slot::Prefilter(&mut second.kind),
            "robot" => Slot::Arm(&mut self.arm),
            "elbow" => Slot::Elbow(&mut self.scara.elbow),
            "link1" => Slot::Number(&mut self.scara.link1_mm),
            "link2" => Slot::Number(&mut self.scara.link2_mm),
            "singularity-margin" => Slot::Number(&mut self.scara.singularity_margin_deg),
            "joint1-min" => Slot::Number(&mut joint1.min),
            "joint1-max" => Slot::Number(&mut joint1.max),
            "joint2-min" => Slot::Number(&mut joint2.min),
            "joint2-max" => Slot::Number(&mut joint2.max),
            "joint3-min" => Slot::Number(&mut joint3.min),
            "joint3-max" => Slot::Number(&mut joint3.max),
            "joint4-min" => Slot::Number(&mut joint4.min),
            "joint4-max" => Slot::Number(&mut joint4.max),
            "delta-base" => Slot::Number(&mut self.delta.base_radius_mm),
            "delta-platform" => Slot::Number(&mut self.delta.platform_radius_mm),
            "delta-upper-arm" => Slot::Number(&mut self.delta.upper_arm_mm),
            "delta-forearm" => Slot::Number(&mut self.delta.forearm_mm),
            "delta-arm-min" => Slot::Number(&mut self.delta.arm_limits.min),
            "delta-arm-max" => Slot::Number(&mut self.delta.arm_limits.max),
            "delta-yaw-min" => Slot::Number(&mut self.delta.yaw_limits.min),
            "delta-yaw-max" => Slot::Number(&mut self.delta.yaw_limits.max),
            "delta-serial-margin" => Slot::Number(&mut self.delta.serial_margin_deg),
            "delta-parallel-margin" => Slot::Number(&mut self.delta.parallel_margin),
            "frequency" => Slot::Number(&mut prefilter.frequency_hz),
            "damping" => Slot::Number(&mut prefilter.damping),
            "axes" => Slot::Axes(&mut prefilter.axes),
            "v-tol" => Slot::Number(&mut prefilter.v_tol),
            "box-ms" => Slot::Number(&mut prefilter.box_ms),
            "s-curve-feed" => Slot::Number(&mut prefilter.s_curve_feed_mm_s),
            "s-curve-jerk" => Slot::Number(&mut prefilter.s_curve_jerk_mm_s3),
            "frequency2" => Slot::Number(&mut second.frequency_hz),
            "damping2" => Slot::Number(&mut second.damping),
            "axes2" => Slot::Axes(&mut second.axes),
            "smoothing1-ms" => Slot::Number(smoothing1_ms),
            "smoothing2-ms" => Slot::Number(smoothing2_ms),
            "impulse1-weight" => Slot::Number(&mut impulse1.weight),
            "impulse2-weight" => Slot::Number(&mut impulse2.weight),
            "impulse3-weight" => Slot::Number(&mut impulse3.weight),
            "impulse4-weight" => Slot::Number(&mut impulse4.weight),
            "impulse5-weight" => Slot::Number(&mut impulse5.weight),
            "impulse2-ms" => Slot::Number(&mut impulse2.time_ms),
            "impulse3-ms" => Slot::Number(&mut impulse3.time_ms),
            "impulse4-ms" => Slot::Number(&mut impulse4.time_ms),
            "impulse5-ms" => Slot::Number(&mut impulse5.time_ms),
            "posture-method" => Slot::Method(&mut self.posture_method),
            "automatic" => Slot::Switch(&mut self.automatic),
            "uncertainty" => Slot::Number(&mut self.shortest.uncertainty),
            "residual-limit" => Slot::Number(&mut self.shortest.limit),
            "tolerance" => Slot::Number(&mut self.corner_tolerance_mm),
            "overlap" => Slot::Number(&mut self.corner_overlap_percent),
            "rapid" => Slot::Number(&mut self.rapid_mm_s),
            "feed-limit" => Slot::Number(&mut self.feed_limit_mm_s),
            "yaw-limit" => Slot::Number(&mut self.yaw_limit_deg_s),
            "hop-height" => Slot::Number(&mut self.hop.height_mm),
            "hop-rise" => Slot::Number(&mut self.hop.rise_mm),
            "hop-tolerance" => Slot::Number(&mut self.hop.tolerance_mm),
            "hop-acceleration" => Slot::Number(&mut self.hop.acceleration_mm_s2),
            "hop-axes" => Slot::HopAxes(&mut self.hop.axes),
            "joint-speed" => Slot::Number(&mut self.joint_speed_deg_s),
            _ => return None,
        })
    }
}

/// The limit of that name, as in `joint1-jerk`.
fn limit_named<'a>(limits: &'a mut LimitsConfig, name: &str) -> Option<&'a mut f32> {
    let (part, order) = name.split_once('-')?;
    let LimitsConfig { joints, path, axis } = limits;
    let [joint1, joint2, joint3, joint4] = joints;
    let limits: &mut MotionLimits = match part {
        "joint1" => joint1,
        "joint2" => joint2,
        "joint3" => joint3,
        "joint4" => joint4,
        "path" => path,
        "axis" => axis,
        _ => return None,
    };
    match order {
        "velocity" => Some(&mut limits.velocity),
        "acceleration" => Some(&mut limits.acceleration),
        "jerk" => Some(&mut limits.jerk),
        _ => None,
    }
}

/// Names of both sides, in the order of their numbers.
const ELBOWS: [(&str, Elbow); 2] = [("left", Elbow::Left), ("right", Elbow::Right)];

/// Names of the robots, likewise.
const ARMS: [(&str, ArmKind); 2] = [("scara", ArmKind::Scara), ("delta", ArmKind::Delta)];

fn name_of<T: PartialEq>(names: &[(&'static str, T)], value: &T) -> &'static str {
    let row = names.iter().find(|(_, other)| other == value);
    row.map_or("", |(name, _)| name)
}

fn named<T: Copy>(names: &[(&str, T)], text: &str) -> Option<T> {
    let row = names
        .iter()
        .find(|(name, _)| name.eq_ignore_ascii_case(text));
    row.map(|(_, value)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::MapNode;
    use std::format;

    #[test]
    fn every_setting_reads_back_as_itself() {
        let config = RobotConfig::default();
        for name in RobotConfig::GROUPS.into_iter().flatten() {
            let mut copy = RobotConfig::default();
            let value = config.value(name).expect(name);
            copy.set(&format!("{name}={value}")).expect(name);
            assert_eq!(copy, config);
        }
    }

    #[test]
    fn a_line_of_settings_is_taken_as_a_whole() {
        let mut config = RobotConfig::default();
        config.set_all("link1=1900  link2=90").unwrap();
        assert_eq!(
            (config.scara.link1_mm, config.scara.link2_mm),
            (1900.0, 90.0)
        );
        let before = config;
        assert_eq!(
            config.set_all("link1=100 speed=3"),
            Err(SettingError::Unknown)
        );
        assert_eq!(config, before);
    }

    #[test]
    fn settings_that_cannot_be_read_change_nothing() {
        let mut config = RobotConfig::default();
        for (text, error) in [
            ("speed=3", SettingError::Unknown),
            ("frequency", SettingError::Value),
            ("frequency=", SettingError::Value),
            ("frequency=six", SettingError::Value),
            ("prefilter=zvx", SettingError::Value),
            ("elbow=up", SettingError::Value),
        ] {
            assert_eq!(config.set(text), Err(error), "{text}");
        }
        assert_eq!(config, RobotConfig::default());
    }

    #[test]
    fn a_robot_is_refused_by_the_name_of_its_setting() {
        for (text, name) in [
            ("tolerance=-1", "tolerance"),
            ("overlap=101", "overlap"),
            ("rapid=0", "rapid"),
            ("feed-limit=NaN", "feed-limit"),
            ("yaw-limit=inf", "yaw-limit"),
            ("frequency=0", "frequency"),
            ("frequency=1.5", "long"),
            ("damping=1", "damping"),
            ("frequency2=300", "second mode's frequency"),
            ("damping2=-1", "second mode's damping"),
            ("v-tol=0", "residual allowed"),
            ("box-ms=0.5", "box"),
            ("s-curve-feed=0", "s-curve"),
            ("smoothing2-ms=501", "smoothing"),
            ("impulse1-weight=0", "impulse 1"),
            ("impulse3-ms=1001", "impulse 3"),
            ("link1=-200", "link"),
        ] {
            let mut config = RobotConfig::default();
            config.set(text).unwrap();
            let message = format!("{}", Robot::new(&config).expect_err(text));
            assert!(message.contains(name), "{text}: {message}");
        }
    }

    #[test]
    fn limits_are_refused_where_they_are_not_kept() {
        let refused = |change: fn(&mut RobotConfig)| {
            let mut config = RobotConfig::default();
            config.set("path-acceleration=1000").unwrap();
            change(&mut config);
            Robot::new(&config).err()
        };
        assert_eq!(refused(|_| {}), None);
        assert_eq!(refused(|config| config.arm = ArmKind::Delta), None);
    }

    #[test]
    fn prefilters_that_follow_a_map_get_the_boxes_that_limits_need() {
        let robot = |settings: &str, follows: bool| {
            let mut config = RobotConfig::default();
            config.set_all(settings).unwrap();
            if follows {
                config.map = ModeMapConfig::constant(MapNode::new(9.0, 0.02));
            }
            Robot::new(&config).unwrap()
        };
        let added =
            |settings: &str, follows: bool| robot(settings, follows).added_boxes_s().count();
        for follows in [false, true] {
            assert_eq!(added("prefilter=zv path-velocity=100", follows), 0);
            assert_eq!(added("prefilter=zv path-acceleration=100", follows), 1);
            assert_eq!(added("prefilter=zv path-jerk=1000", follows), 2);
            assert_eq!(added("prefilter=fir path-jerk=1000", follows), 1);
            assert_eq!(added("prefilter=s-curve path-jerk=1000", follows), 0);
            // those that are given count
            assert_eq!(
                added("prefilter=zv smoothing1-ms=30 path-jerk=1000", follows),
                1
            );
            assert_eq!(
                added("prefilter=zv smoothing2-ms=30 path-acceleration=9", follows),
                0
            );
            assert_eq!(added("automatic=1 path-jerk=1000", follows), 2);
        }
        assert_eq!(added("posture-method=a path-jerk=1000", true), 0);
        let boxes_s = robot("prefilter=zv path-jerk=1000", true)
            .prefilter()
            .boxes_s();
        assert_eq!(boxes_s.len(), 2);
    }
}
