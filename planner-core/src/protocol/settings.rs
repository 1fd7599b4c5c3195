//! Every setting by number and by name: one table for reading, writing and self-description.
//!
//! Numbers below 1000 are Grbl's, for what means the same there; the robot's own begin at
//! 1000. A value is given as a number everywhere; a choice may be given by its name too.

use core::fmt;

use super::homing::HomingConfig;
#[cfg(doc)]
use super::report::Inputs;
use crate::config::{RobotConfig, SettingError, SettingValue};
use crate::hop::HopAxes;
use crate::pose::AXES;
use crate::posture::PostureMethod;
use crate::prefilter::{AxisSet, Kind as Prefilter};
use crate::servo::{GAINS, ServoGains};

/// How the controller deals with its sender and its inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProtocolConfig {
    /// What a status report holds: bit 0 machine instead of work position, bit 1 buffers.
    pub report_mask: u8,
    /// Lengths in reports are in inches.
    pub report_inches: bool,
    /// Status reports also hold the joint positions.
    pub report_joints: bool,
    /// A target that the robot cannot reach is not only refused: it raises alarm 2, as in
    /// Grbl, so that a sender that ignores errors does not go on from elsewhere.
    pub soft_limit_alarm: bool,
    /// Inputs that are active while high, as [`Inputs::to_bits`] has them: switches that open,
    /// so that a broken wire is an open door.
    pub inputs_inverted: u8,
    /// A limit input that becomes active in motion raises alarm 1.
    pub hard_limits: bool,
    /// The controller is locked at the start, until `$H` or `$X`.
    pub start_locked: bool,
    /// The drives have absolute encoders, which tell the position from the start.
    pub encoders: bool,
    /// After an `error:N` all further lines are refused until `$ACK`.
    pub error_safe: bool,
    /// Silence in s after which a running program is held; 0 waits for ever.
    pub link_timeout_s: f32,
}

impl Default for ProtocolConfig {
    fn default() -> Self {
        Self {
            report_mask: 3,
            report_inches: false,
            report_joints: false,
            soft_limit_alarm: false,
            inputs_inverted: 0,
            hard_limits: false,
            start_locked: false,
            encoders: false,
            error_safe: false,
            link_timeout_s: 0.0,
        }
    }
}

/// All that `$$` lists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The robot and its prefilter.
    pub robot: RobotConfig,
    /// The controller's manners.
    pub protocol: ProtocolConfig,
    /// How the joints find their limit inputs.
    pub homing: HomingConfig,
    /// The servos of joints 1 to 4. They are kept for the drives, in which servos run.
    pub servos: [ServoGains; AXES],
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            robot: RobotConfig::default(),
            protocol: ProtocolConfig::default(),
            homing: HomingConfig::default(),
            servos: ServoGains::SCARA,
        }
    }
}

/// A setting's kind of value, with what is needed to check and to describe it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// 0 or 1.
    Switch,
    /// Bits, with a name for each.
    Bits(&'static [&'static str]),
    /// One of these names, counted from 0.
    Choice(&'static [&'static str]),
    /// A number within a range.
    Decimal {
        /// Lowest value.
        low: f32,
        /// Highest value.
        high: f32,
    },
}

/// One row of the table of settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// As in `$n=value`.
    pub number: u16,
    /// As in `$name=value`.
    pub name: &'static str,
    /// Index into [`GROUPS`].
    pub group: u8,
    /// For people, without the unit.
    pub label: &'static str,
    /// Empty if it has none.
    pub unit: &'static str,
    /// What values it takes.
    pub kind: Kind,
}

/// Names of the groups of settings.
pub const GROUPS: [&str; 8] = [
    "Reports", "Safety", "Link", "Robot", "Motion", "Homing", "Limits", "Servos",
];

const REPORTS: u8 = 0;
const SAFETY: u8 = 1;
const LINK: u8 = 2;
const ROBOT: u8 = 3;
const MOTION: u8 = 4;
const HOMING: u8 = 5;
const LIMITS: u8 = 6;
const SERVOS: u8 = 7;

const fn setting(
    number: u16,
    name: &'static str,
    group: u8,
    label: &'static str,
    unit: &'static str,
    kind: Kind,
) -> Setting {
    Setting {
        number,
        name,
        group,
        label,
        unit,
        kind,
    }
}

const fn decimal(low: f32, high: f32) -> Kind {
    Kind::Decimal { low, high }
}

const JOINTS: &[&str] = &["Joint 1", "Joint 2", "Joint 3", "Joint 4"];
const INPUTS: &[&str] = &["Joint 1", "Joint 2", "Joint 3", "Joint 4", "Door"];
const ELBOWS: &[&str] = &["left", "right"];
const ROBOTS: &[&str] = &["scara", "delta"];
const METHODS: &[&str] = &{
    let mut names = [""; PostureMethod::ALL.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = PostureMethod::ALL[i].name();
        i += 1;
    }
    names
};
const PREFILTERS: &[&str] = &{
    let mut names = [""; Prefilter::ALL.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = Prefilter::ALL[i].name();
        i += 1;
    }
    names
};

const HOP_AXES: &[&str] = &{
    let mut names = [""; HopAxes::ALL.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = HopAxes::ALL[i].name();
        i += 1;
    }
    names
};

const AXIS_SETS: &[&str] = &{
    let mut names = [""; AxisSet::SETS.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = AxisSet::SETS[i].name();
        i += 1;
    }
    names
};

/// The rows of a joint's servo.
macro_rules! servo {
    ($joint:literal, $number:literal) => {
        [
            gain(
                $number,
                0,
                concat!("servo", $joint, "-position-gain"),
                concat!("Joint ", $joint, " position gain"),
                "1/s",
            ),
            gain(
                $number,
                1,
                concat!("servo", $joint, "-velocity-gain"),
                concat!("Joint ", $joint, " velocity gain"),
                "Nms/rad or Ns/m",
            ),
            gain(
                $number,
                2,
                concat!("servo", $joint, "-integral-time"),
                concat!("Joint ", $joint, " integral time"),
                "s",
            ),
            gain(
                $number,
                3,
                concat!("servo", $joint, "-velocity-feed-forward"),
                concat!("Joint ", $joint, " velocity fed forward"),
                "",
            ),
            gain(
                $number,
                4,
                concat!("servo", $joint, "-acceleration-feed-forward"),
                concat!("Joint ", $joint, " acceleration fed forward"),
                "",
            ),
            gain(
                $number,
                5,
                concat!("servo", $joint, "-torque-limit"),
                concat!("Joint ", $joint, " torque limit"),
                "Nm or N",
            ),
            gain(
                $number,
                6,
                concat!("servo", $joint, "-observer"),
                concat!("Joint ", $joint, " velocity observer"),
                "rad/s",
            ),
        ]
    };
}

const fn gain(
    first: u16,
    gain: usize,
    name: &'static str,
    label: &'static str,
    unit: &'static str,
) -> Setting {
    let range = GAINS[gain];
    setting(
        first + gain as u16,
        name,
        SERVOS,
        label,
        unit,
        decimal(range.low, range.high),
    )
}

const SERVO_SETTINGS: [[Setting; GAINS.len()]; AXES] = [
    servo!("1", 1310),
    servo!("2", 1320),
    servo!("3", 1330),
    servo!("4", 1340),
];

/// The table, by number. A static, so that it is in the flash once.
pub static SETTINGS: [Setting; OWN + GAINS.len() * AXES] = {
    let mut all = [OWN_SETTINGS[0]; OWN + GAINS.len() * AXES];
    let mut i = 0;
    while i < all.len() {
        all[i] = if i < OWN {
            OWN_SETTINGS[i]
        } else {
            SERVO_SETTINGS.as_flattened()[i - OWN]
        };
        i += 1;
    }
    all
};

/// Settings of the controller's own, which are not the drives'.
const OWN: usize = OWN_SETTINGS.len();

const OWN_SETTINGS: [Setting; 98] = [
    setting(
        5,
        "inputs-inverted",
        SAFETY,
        "Inputs active while high",
        "",
        Kind::Bits(INPUTS),
    ),
    setting(
        10,
        "report",
        REPORTS,
        "Status report",
        "",
        Kind::Bits(&["Machine position", "Buffers"]),
    ),
    setting(
        11,
        "tolerance",
        MOTION,
        "Corner tolerance",
        "mm",
        decimal(0.0, 100.0),
    ),
    setting(
        13,
        "report-inches",
        REPORTS,
        "Report in inches",
        "",
        Kind::Switch,
    ),
    setting(
        20,
        "soft-limit-alarm",
        SAFETY,
        "Alarm on a target out of reach",
        "",
        Kind::Switch,
    ),
    setting(
        21,
        "hard-limits",
        SAFETY,
        "Alarm on a limit input in motion",
        "",
        Kind::Switch,
    ),
    setting(
        22,
        "start-locked",
        SAFETY,
        "Locked at the start",
        "",
        Kind::Switch,
    ),
    setting(
        23,
        "home-lower-end",
        HOMING,
        "Limit input at the lower end",
        "",
        Kind::Bits(JOINTS),
    ),
    setting(
        24,
        "home-slow",
        HOMING,
        "Speed of locating",
        "deg/s or mm/s",
        decimal(0.01, 1000.0),
    ),
    setting(
        25,
        "home-fast",
        HOMING,
        "Speed of seeking",
        "deg/s or mm/s",
        decimal(0.01, 1000.0),
    ),
    setting(
        27,
        "home-pull-off",
        HOMING,
        "Distance from the limit input",
        "deg or mm",
        decimal(0.01, 90.0),
    ),
    setting(
        1000,
        "encoders",
        SAFETY,
        "Drives have absolute encoders",
        "",
        Kind::Switch,
    ),
    setting(
        1001,
        "error-safe",
        LINK,
        "Refuse lines after an error until $ACK",
        "",
        Kind::Switch,
    ),
    setting(
        1002,
        "link-timeout",
        LINK,
        "Hold after silence, 0 never",
        "s",
        decimal(0.0, 3600.0),
    ),
    setting(
        1003,
        "report-joints",
        REPORTS,
        "Report joint positions",
        "",
        Kind::Switch,
    ),
    setting(
        1004,
        "home-joints",
        HOMING,
        "Joints with a limit input",
        "",
        Kind::Bits(JOINTS),
    ),
    setting(
        1009,
        "robot",
        ROBOT,
        "Kind of robot",
        "",
        Kind::Choice(ROBOTS),
    ),
    setting(
        1010,
        "link1",
        ROBOT,
        "Upper arm",
        "mm",
        decimal(10.0, 1990.0),
    ),
    setting(1011, "link2", ROBOT, "Forearm", "mm", decimal(10.0, 1990.0)),
    setting(1012, "elbow", ROBOT, "Elbow side", "", Kind::Choice(ELBOWS)),
    setting(
        1013,
        "singularity-margin",
        ROBOT,
        "Joint 2 from its ends",
        "deg",
        decimal(0.5, 45.0),
    ),
    setting(
        1021,
        "joint1-min",
        ROBOT,
        "Joint 1 lower limit",
        "deg",
        decimal(-360.0, 360.0),
    ),
    setting(
        1022,
        "joint1-max",
        ROBOT,
        "Joint 1 upper limit",
        "deg",
        decimal(-360.0, 360.0),
    ),
    setting(
        1023,
        "joint2-min",
        ROBOT,
        "Joint 2 lower limit",
        "deg",
        decimal(-360.0, 360.0),
    ),
    setting(
        1024,
        "joint2-max",
        ROBOT,
        "Joint 2 upper limit",
        "deg",
        decimal(-360.0, 360.0),
    ),
    setting(
        1025,
        "joint3-min",
        ROBOT,
        "Joint 3 lower limit",
        "mm",
        decimal(-4000.0, 4000.0),
    ),
    setting(
        1026,
        "joint3-max",
        ROBOT,
        "Joint 3 upper limit",
        "mm",
        decimal(-4000.0, 4000.0),
    ),
    setting(
        1027,
        "joint4-min",
        ROBOT,
        "Joint 4 lower limit",
        "deg",
        decimal(-1080.0, 1080.0),
    ),
    setting(
        1028,
        "joint4-max",
        ROBOT,
        "Joint 4 upper limit",
        "deg",
        decimal(-1080.0, 1080.0),
    ),
    setting(
        1031,
        "home1",
        HOMING,
        "Joint 1 at its limit input",
        "deg",
        decimal(-360.0, 360.0),
    ),
    setting(
        1032,
        "home2",
        HOMING,
        "Joint 2 at its limit input",
        "deg",
        decimal(-360.0, 360.0),
    ),
    setting(
        1033,
        "home3",
        HOMING,
        "Joint 3 at its limit input",
        "mm or deg",
        decimal(-4000.0, 4000.0),
    ),
    setting(
        1034,
        "home4",
        HOMING,
        "Joint 4 at its limit input",
        "deg",
        decimal(-1080.0, 1080.0),
    ),
    setting(
        1040,
        "prefilter",
        MOTION,
        "Prefilter",
        "",
        Kind::Choice(PREFILTERS),
    ),
    setting(
        1041,
        "frequency",
        MOTION,
        "Natural frequency to suppress",
        "Hz",
        decimal(0.01, 250.0),
    ),
    setting(
        1042,
        "damping",
        MOTION,
        "Damping ratio",
        "",
        decimal(0.0, 0.5),
    ),
    setting(
        1043,
        "v-tol",
        MOTION,
        "Residual allowed to EI, a fraction",
        "",
        decimal(0.001, 0.5),
    ),
    setting(
        1044,
        "box-ms",
        MOTION,
        "Boxes of box and s-curve, 0 one period",
        "ms",
        decimal(0.0, 500.0),
    ),
    setting(
        1045,
        "s-curve-feed",
        MOTION,
        "Feedrate of s-curve with its jerk",
        "mm/s",
        decimal(0.001, 10_000.0),
    ),
    setting(
        1046,
        "s-curve-jerk",
        MOTION,
        "Jerk of s-curve, 0 for its boxes",
        "mm/s^3",
        decimal(0.0, 1e9),
    ),
    setting(
        1047,
        "smoothing1-ms",
        MOTION,
        "Box of a prefilter without one, 0 none",
        "ms",
        decimal(0.0, 500.0),
    ),
    setting(
        1048,
        "smoothing2-ms",
        MOTION,
        "Second box of a prefilter without, 0 none",
        "ms",
        decimal(0.0, 500.0),
    ),
    setting(
        1049,
        "overlap",
        MOTION,
        "Corner overlap instead of tolerance",
        "%",
        decimal(0.0, 100.0),
    ),
    setting(
        1050,
        "rapid",
        MOTION,
        "Feedrate of G0",
        "mm/s",
        decimal(0.001, 10_000.0),
    ),
    setting(
        1051,
        "feed-limit",
        MOTION,
        "Fastest feedrate",
        "mm/s",
        decimal(0.001, 10_000.0),
    ),
    setting(
        1052,
        "yaw-limit",
        MOTION,
        "Fastest yaw",
        "deg/s",
        decimal(0.001, 10_000.0),
    ),
    setting(
        1053,
        "joint-speed",
        MOTION,
        "Joints while the elbow changes",
        "deg/s",
        decimal(0.001, 10_000.0),
    ),
    setting(
        1054,
        "axes",
        MOTION,
        "Axes of the mode",
        "",
        Kind::Choice(AXIS_SETS),
    ),
    setting(
        1060,
        "prefilter2",
        MOTION,
        "Prefilter of the second mode",
        "",
        Kind::Choice(PREFILTERS),
    ),
    setting(
        1061,
        "frequency2",
        MOTION,
        "Second mode, 0 none",
        "Hz",
        decimal(0.0, 250.0),
    ),
    setting(
        1062,
        "damping2",
        MOTION,
        "Damping ratio of the second mode",
        "",
        decimal(0.0, 0.5),
    ),
    setting(
        1063,
        "axes2",
        MOTION,
        "Axes of the second mode",
        "",
        Kind::Choice(AXIS_SETS),
    ),
    setting(
        1071,
        "impulse1-weight",
        MOTION,
        "Weight of impulse 1 of custom",
        "",
        decimal(0.001, 1000.0),
    ),
    setting(
        1072,
        "impulse2-weight",
        MOTION,
        "Weight of impulse 2 of custom",
        "",
        decimal(0.0, 1000.0),
    ),
    setting(
        1073,
        "impulse3-weight",
        MOTION,
        "Weight of impulse 3 of custom",
        "",
        decimal(0.0, 1000.0),
    ),
    setting(
        1074,
        "impulse4-weight",
        MOTION,
        "Weight of impulse 4 of custom",
        "",
        decimal(0.0, 1000.0),
    ),
    setting(
        1075,
        "impulse5-weight",
        MOTION,
        "Weight of impulse 5 of custom",
        "",
        decimal(0.0, 1000.0),
    ),
    setting(
        1082,
        "impulse2-ms",
        MOTION,
        "Time of impulse 2 of custom",
        "ms",
        decimal(0.0, 1000.0),
    ),
    setting(
        1083,
        "impulse3-ms",
        MOTION,
        "Time of impulse 3 of custom",
        "ms",
        decimal(0.0, 1000.0),
    ),
    setting(
        1084,
        "impulse4-ms",
        MOTION,
        "Time of impulse 4 of custom",
        "ms",
        decimal(0.0, 1000.0),
    ),
    setting(
        1085,
        "impulse5-ms",
        MOTION,
        "Time of impulse 5 of custom",
        "ms",
        decimal(0.0, 1000.0),
    ),
    setting(
        1090,
        "hop-height",
        MOTION,
        "Vertical part of a hop",
        "mm",
        decimal(0.0, 1000.0),
    ),
    setting(
        1091,
        "hop-rise",
        MOTION,
        "Rise of a hop",
        "mm",
        decimal(0.001, 1000.0),
    ),
    setting(
        1092,
        "hop-tolerance",
        MOTION,
        "Tolerance of a hop's vertical part",
        "mm",
        decimal(0.001, 10_000.0),
    ),
    setting(
        1093,
        "hop-acceleration",
        MOTION,
        "Acceleration of a hop",
        "mm/s^2",
        decimal(1.0, 1e6),
    ),
    setting(
        1094,
        "hop-axes",
        MOTION,
        "Prefiltered axes of a hop",
        "",
        Kind::Choice(HOP_AXES),
    ),
    setting(
        1110,
        "delta-base",
        ROBOT,
        "Delta's base radius",
        "mm",
        decimal(0.0, 2000.0),
    ),
    setting(
        1111,
        "delta-platform",
        ROBOT,
        "Delta's platform radius",
        "mm",
        decimal(0.0, 2000.0),
    ),
    setting(
        1112,
        "delta-upper-arm",
        ROBOT,
        "Delta's upper arm",
        "mm",
        decimal(10.0, 1990.0),
    ),
    setting(
        1113,
        "delta-forearm",
        ROBOT,
        "Delta's forearm",
        "mm",
        decimal(10.0, 1990.0),
    ),
    setting(
        1114,
        "delta-arm-min",
        ROBOT,
        "Delta's arms lower limit",
        "deg",
        decimal(-170.0, 170.0),
    ),
    setting(
        1115,
        "delta-arm-max",
        ROBOT,
        "Delta's arms upper limit",
        "deg",
        decimal(-170.0, 170.0),
    ),
    setting(
        1116,
        "delta-yaw-min",
        ROBOT,
        "Delta's yaw lower limit",
        "deg",
        decimal(-1080.0, 1080.0),
    ),
    setting(
        1117,
        "delta-yaw-max",
        ROBOT,
        "Delta's yaw upper limit",
        "deg",
        decimal(-1080.0, 1080.0),
    ),
    setting(
        1118,
        "delta-serial-margin",
        ROBOT,
        "Delta's forearms from their arms' planes",
        "deg",
        decimal(0.5, 45.0),
    ),
    setting(
        1119,
        "delta-parallel-margin",
        ROBOT,
        "Volume that the delta's forearms span",
        "",
        decimal(0.01, 0.5),
    ),
    setting(
        1130,
        "posture-method",
        MOTION,
        "Prefilters that follow the map",
        "",
        Kind::Choice(METHODS),
    ),
    setting(
        1131,
        "automatic",
        MOTION,
        "Shortest prefilter for each move",
        "",
        Kind::Switch,
    ),
    setting(
        1132,
        "uncertainty",
        MOTION,
        "Uncertainty of the frequency",
        "",
        decimal(0.0, 0.5),
    ),
    setting(
        1133,
        "residual-limit",
        MOTION,
        "Residual vibration allowed",
        "",
        decimal(0.001, 1.0),
    ),
    setting(
        1200,
        "joint1-velocity",
        LIMITS,
        "Joint 1 velocity, 0 unlimited",
        "deg/s",
        decimal(0.0, 1e6),
    ),
    setting(
        1201,
        "joint1-acceleration",
        LIMITS,
        "Joint 1 acceleration, 0 unlimited",
        "deg/s2",
        decimal(0.0, 1e7),
    ),
    setting(
        1202,
        "joint1-jerk",
        LIMITS,
        "Joint 1 jerk, 0 unlimited",
        "deg/s3",
        decimal(0.0, 1e9),
    ),
    setting(
        1203,
        "joint2-velocity",
        LIMITS,
        "Joint 2 velocity, 0 unlimited",
        "deg/s",
        decimal(0.0, 1e6),
    ),
    setting(
        1204,
        "joint2-acceleration",
        LIMITS,
        "Joint 2 acceleration, 0 unlimited",
        "deg/s2",
        decimal(0.0, 1e7),
    ),
    setting(
        1205,
        "joint2-jerk",
        LIMITS,
        "Joint 2 jerk, 0 unlimited",
        "deg/s3",
        decimal(0.0, 1e9),
    ),
    setting(
        1206,
        "joint3-velocity",
        LIMITS,
        "Joint 3 velocity, 0 unlimited",
        "mm/s or deg/s",
        decimal(0.0, 1e6),
    ),
    setting(
        1207,
        "joint3-acceleration",
        LIMITS,
        "Joint 3 acceleration, 0 unlimited",
        "mm/s2 or deg/s2",
        decimal(0.0, 1e7),
    ),
    setting(
        1208,
        "joint3-jerk",
        LIMITS,
        "Joint 3 jerk, 0 unlimited",
        "mm/s3 or deg/s3",
        decimal(0.0, 1e9),
    ),
    setting(
        1209,
        "joint4-velocity",
        LIMITS,
        "Joint 4 velocity, 0 unlimited",
        "deg/s",
        decimal(0.0, 1e6),
    ),
    setting(
        1210,
        "joint4-acceleration",
        LIMITS,
        "Joint 4 acceleration, 0 unlimited",
        "deg/s2",
        decimal(0.0, 1e7),
    ),
    setting(
        1211,
        "joint4-jerk",
        LIMITS,
        "Joint 4 jerk, 0 unlimited",
        "deg/s3",
        decimal(0.0, 1e9),
    ),
    setting(
        1212,
        "path-velocity",
        LIMITS,
        "Path velocity, 0 unlimited",
        "mm/s",
        decimal(0.0, 1e6),
    ),
    setting(
        1213,
        "path-acceleration",
        LIMITS,
        "Path acceleration, 0 unlimited",
        "mm/s2",
        decimal(0.0, 1e7),
    ),
    setting(
        1214,
        "path-jerk",
        LIMITS,
        "Path jerk, 0 unlimited",
        "mm/s3",
        decimal(0.0, 1e9),
    ),
    setting(
        1215,
        "axis-velocity",
        LIMITS,
        "Axis velocity, 0 unlimited",
        "mm/s",
        decimal(0.0, 1e6),
    ),
    setting(
        1216,
        "axis-acceleration",
        LIMITS,
        "Axis acceleration, 0 unlimited",
        "mm/s2",
        decimal(0.0, 1e7),
    ),
    setting(
        1217,
        "axis-jerk",
        LIMITS,
        "Axis jerk, 0 unlimited",
        "mm/s3",
        decimal(0.0, 1e9),
    ),
];

/// Number and value of a setting, as kept.
const PAIR_BYTES: usize = 6;

/// All settings but those of the servos, as kept.
pub const SETTINGS_BYTES: usize = OWN * PAIR_BYTES;

/// The settings of the servos, as kept.
pub const SERVO_BYTES: usize = GAINS.len() * AXES * 4;

impl Setting {
    /// The setting of that number or name.
    #[must_use]
    pub fn find(key: &str) -> Option<&'static Self> {
        match key.parse::<u16>() {
            Ok(number) => SETTINGS.iter().find(|setting| setting.number == number),
            Err(_) => SETTINGS
                .iter()
                .find(|setting| setting.name.eq_ignore_ascii_case(key)),
        }
    }

    /// The value that a text gives, if it is one of this setting's.
    fn read(&self, text: &str) -> Option<f32> {
        if let Kind::Choice(names) = self.kind
            && let Some(choice) = names
                .iter()
                .position(|name| name.eq_ignore_ascii_case(text))
        {
            return Some(choice as f32);
        }
        text.parse().ok().filter(|value| self.takes(*value))
    }

    /// Whether a number is one of this setting's values.
    fn takes(&self, value: f32) -> bool {
        let whole_below = |end: u32| {
            let is_whole = value as u32 as f32 == value;
            is_whole && (0.0..end as f32).contains(&value)
        };
        match self.kind {
            Kind::Switch => whole_below(2),
            Kind::Bits(names) => whole_below(1 << names.len()),
            Kind::Choice(names) => whole_below(names.len() as u32),
            Kind::Decimal { low, high } => (low..=high).contains(&value),
        }
    }
}

/// `[SETTING:…]` of grblHAL's `$ES`: number, group, label, unit, type, format, range, whether
/// a restart is needed and whether it may be empty.
impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            number,
            group,
            label,
            unit,
            ..
        } = self;
        write!(f, "[SETTING:{number}|{group}|{label}|{unit}|")?;
        match self.kind {
            Kind::Switch => f.write_str("0|||")?,
            Kind::Bits(names) => names_of(f, 1, names)?,
            Kind::Choice(names) => names_of(f, 3, names)?,
            Kind::Decimal { low, high } => write!(f, "6|###0.000|{low}|{high}")?,
        }
        f.write_str("|0|0]")
    }
}

fn names_of(f: &mut fmt::Formatter<'_>, datatype: u8, names: &[&str]) -> fmt::Result {
    write!(f, "{datatype}|")?;
    for (i, name) in names.iter().enumerate() {
        let comma = if i == 0 { "" } else { "," };
        write!(f, "{comma}{name}")?;
    }
    f.write_str("||")
}

/// Where a setting's value is kept.
enum Place<'a> {
    Switch(&'a mut bool),
    Bits(&'a mut u8),
    Number(&'a mut f32),
    Robot,
}

impl Settings {
    /// Sets values from `key=value` texts between blanks, a key being a number or a name, or
    /// part of the map: see [`ModeMapConfig::set`](crate::posture::ModeMapConfig::set).
    /// Whether a robot can be made of them is checked when one is.
    ///
    /// # Errors
    /// [`SettingError`] if a key or a value cannot be used; nothing is changed then.
    pub fn set_all(&mut self, text: &str) -> Result<(), SettingError> {
        let mut changed = *self;
        for pair in text.split_ascii_whitespace() {
            let (key, value) = pair.split_once('=').ok_or(SettingError::Value)?;
            match changed.robot.set_map(key, value) {
                Some(true) => continue,
                Some(false) => return Err(SettingError::Value),
                None => {}
            }
            let setting = Setting::find(key).ok_or(SettingError::Unknown)?;
            changed.set(setting, setting.read(value).ok_or(SettingError::Value)?);
        }
        *self = changed;
        Ok(())
    }

    /// The value of a setting as a number; a choice counts from 0.
    #[must_use]
    pub fn value(&self, setting: &Setting) -> f32 {
        let mut copy = *self;
        match copy.place(setting.name) {
            Place::Switch(switch) => f32::from(u8::from(*switch)),
            Place::Bits(bits) => f32::from(*bits),
            Place::Number(number) => *number,
            Place::Robot => match (self.robot.value(setting.name), setting.kind) {
                (Some(SettingValue::Number(number)), _) => number,
                (Some(SettingValue::Name(name)), Kind::Choice(names)) => {
                    let choice = names.iter().position(|other| *other == name);
                    choice.unwrap_or_default() as f32
                }
                _ => f32::NAN,
            },
        }
    }

    /// As kept over a restart, but for the servos: number and value of each setting,
    /// little-endian.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; SETTINGS_BYTES] {
        let mut buffer = [0; SETTINGS_BYTES];
        for (setting, place) in SETTINGS.iter().zip(buffer.chunks_exact_mut(PAIR_BYTES)) {
            let (number, value) = place.split_at_mut(2);
            number.copy_from_slice(&setting.number.to_le_bytes());
            value.copy_from_slice(&self.value(setting).to_le_bytes());
        }
        buffer
    }

    /// The settings kept; those that are missing have their defaults, and numbers and values
    /// that do not exist any more are passed over.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut settings = Self::default();
        for pair in bytes.chunks_exact(PAIR_BYTES) {
            let [n0, n1, v0, v1, v2, v3] = *pair else {
                continue;
            };
            let number = u16::from_le_bytes([n0, n1]);
            let value = f32::from_le_bytes([v0, v1, v2, v3]);
            let setting = SETTINGS.iter().find(|setting| setting.number == number);
            if let Some(setting) = setting.filter(|setting| setting.takes(value)) {
                settings.set(setting, value);
            }
        }
        settings
    }

    /// The servos' settings as kept over a restart, little-endian.
    #[must_use]
    pub fn servo_bytes(&self) -> [u8; SERVO_BYTES] {
        let mut buffer = [0; SERVO_BYTES];
        let mut servos = self.servos;
        let values = servos.iter_mut().flat_map(ServoGains::values);
        for (place, value) in buffer.as_chunks_mut::<4>().0.iter_mut().zip(values) {
            *place = value.to_le_bytes();
        }
        buffer
    }

    /// Takes the servos' settings as kept; what is out of range stays as it is.
    pub fn take_servo_bytes(&mut self, bytes: &[u8]) {
        let values = self.servos.iter_mut().flat_map(ServoGains::values);
        let ranges = GAINS.iter().cycle();
        for ((place, range), bytes) in values.zip(ranges).zip(bytes.as_chunks::<4>().0) {
            let value = f32::from_le_bytes(*bytes);
            if (range.low..=range.high).contains(&value) {
                *place = value;
            }
        }
    }

    /// Sets a value that [`Setting::takes`].
    fn set(&mut self, setting: &Setting, value: f32) {
        match self.place(setting.name) {
            Place::Switch(switch) => *switch = value != 0.0,
            Place::Bits(bits) => *bits = value as u8,
            Place::Number(number) => *number = value,
            Place::Robot => self.robot.set_value(setting.name, value),
        }
    }

    fn place(&mut self, name: &str) -> Place<'_> {
        let protocol = &mut self.protocol;
        let homing = &mut self.homing;
        let [home1, home2, home3, home4] = &mut homing.positions;
        match name {
            "report" => Place::Bits(&mut protocol.report_mask),
            "report-inches" => Place::Switch(&mut protocol.report_inches),
            "report-joints" => Place::Switch(&mut protocol.report_joints),
            "soft-limit-alarm" => Place::Switch(&mut protocol.soft_limit_alarm),
            "inputs-inverted" => Place::Bits(&mut protocol.inputs_inverted),
            "hard-limits" => Place::Switch(&mut protocol.hard_limits),
            "start-locked" => Place::Switch(&mut protocol.start_locked),
            "encoders" => Place::Switch(&mut protocol.encoders),
            "error-safe" => Place::Switch(&mut protocol.error_safe),
            "link-timeout" => Place::Number(&mut protocol.link_timeout_s),
            "home-joints" => Place::Bits(&mut homing.joints),
            "home-lower-end" => Place::Bits(&mut homing.at_lower_end),
            "home-slow" => Place::Number(&mut homing.slow),
            "home-fast" => Place::Number(&mut homing.fast),
            "home-pull-off" => Place::Number(&mut homing.pull_off),
            "home1" => Place::Number(home1),
            "home2" => Place::Number(home2),
            "home3" => Place::Number(home3),
            "home4" => Place::Number(home4),
            _ => gain_named(&mut self.servos, name).map_or(Place::Robot, Place::Number),
        }
    }
}

/// The gain of that name, as in `servo1-position-gain`.
fn gain_named<'a>(servos: &'a mut [ServoGains; AXES], name: &str) -> Option<&'a mut f32> {
    if !name.starts_with("servo") {
        return None;
    }
    let mut all = SETTINGS.iter().skip(OWN);
    let nth = all.position(|setting| setting.name == name)?;
    servos.iter_mut().flat_map(ServoGains::values).nth(nth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Robot;
    use std::format;

    #[test]
    fn numbers_ascend_and_names_differ() {
        assert!(SETTINGS.is_sorted_by(|a, b| a.number < b.number));
        for (i, setting) in SETTINGS.iter().enumerate() {
            assert!(usize::from(setting.group) < GROUPS.len());
            let others = SETTINGS.iter().skip(i + 1);
            assert!(others.into_iter().all(|other| other.name != setting.name));
        }
    }

    #[test]
    fn every_setting_of_the_robot_has_its_row() {
        for name in RobotConfig::GROUPS.into_iter().flatten() {
            assert!(Setting::find(name).is_some(), "{name}");
        }
    }

    #[test]
    fn every_setting_reads_back_by_number_and_by_name() {
        for setting in &SETTINGS {
            let settings = Settings::default();
            let value = settings.value(setting);
            assert!(value.is_finite(), "{}", setting.name);
            for key in [format!("{}", setting.number), setting.name.into()] {
                let mut copy = settings;
                copy.set_all(&format!("{key}={value}")).unwrap();
                assert_eq!(copy, settings, "{key}");
            }
            let other = match setting.kind {
                Kind::Switch | Kind::Bits(_) | Kind::Choice(_) => f32::from(u8::from(value == 0.0)),
                Kind::Decimal { low, high } => low + (high - low) / 4.0,
            };
            let mut copy = settings;
            copy.set_all(&format!("{}={other}", setting.name)).unwrap();
            assert_eq!(copy.value(setting), other, "{}", setting.name);
            assert_ne!(copy, settings, "{}", setting.name);
        }
    }

    #[test]
    fn what_is_kept_comes_back() {
        let mut settings = Settings::default();
        settings
            .set_all("1001=1 prefilter=zv link1=123.25 10=0 elbow=left")
            .unwrap();
        assert_eq!(Settings::from_bytes(&settings.to_bytes()), settings);
        settings
            .set_all("servo1-position-gain=150 servo4-observer=900")
            .unwrap();
        assert_eq!(settings.servos[0].position_gain, 150.0);
        assert_eq!(settings.servos[3].observer_rad_s, 900.0);
        let mut kept = Settings::default();
        kept.take_servo_bytes(&settings.servo_bytes());
        assert_eq!(kept.servos, settings.servos);
        // what is cut off, or out of range, leaves the defaults
        let mut kept = Settings::default();
        kept.take_servo_bytes(&[0xFF; 6]);
        assert_eq!(kept, Settings::default());
        // an older list, and one with what does not exist
        assert_eq!(Settings::from_bytes(&[]), Settings::default());
        let unknown = [0xFF, 0xFF, 0, 0, 0, 0, 22, 0, 0, 0, 0, 0x42, 1, 2];
        assert_eq!(Settings::from_bytes(&unknown), Settings::default());
    }

    #[test]
    fn what_the_table_refuses_changes_nothing() {
        let mut settings = Settings::default();
        for (text, error) in [
            ("9999=1", SettingError::Unknown),
            ("speed=1", SettingError::Unknown),
            ("report", SettingError::Value),
            ("report=4", SettingError::Value),
            ("start-locked=2", SettingError::Value),
            ("start-locked=0.5", SettingError::Value),
            ("elbow=up", SettingError::Value),
            ("prefilter=-1", SettingError::Value),
            ("tolerance=NaN", SettingError::Value),
            ("tolerance=1 rapid=x", SettingError::Value),
        ] {
            assert_eq!(settings.set_all(text), Err(error), "{text}");
        }
        assert_eq!(settings, Settings::default());
    }

    #[test]
    fn plain_ranges_are_those_of_the_robot() {
        for setting in &SETTINGS {
            let Kind::Decimal { low, high } = setting.kind else {
                continue;
            };
            // What must fit something else has its range for the help only.
            let is_plain = [
                "tolerance",
                "overlap",
                "rapid",
                "feed-limit",
                "yaw-limit",
                "joint-speed",
                "hop-tolerance",
                "hop-acceleration",
                "damping",
                "v-tol",
                "damping2",
                "impulse1-weight",
                "impulse5-weight",
                "impulse5-ms",
            ];
            if !is_plain.contains(&setting.name) && setting.group != LIMITS {
                continue;
            }
            for (value, is_robot) in [(low, true), (high, true), (high * 1.01, false)] {
                let mut config = RobotConfig::default();
                config.set_value(setting.name, value);
                assert_eq!(
                    Robot::new(&config).is_ok(),
                    is_robot,
                    "{} {value}",
                    setting.name
                );
            }
        }
    }

    #[test]
    fn a_setting_describes_itself() {
        let text = |name| format!("{}", Setting::find(name).unwrap());
        assert_eq!(
            text("elbow"),
            "[SETTING:1012|3|Elbow side||3|left,right|||0|0]"
        );
        assert_eq!(text("22"), "[SETTING:22|1|Locked at the start||0||||0|0]");
        assert_eq!(
            text("tolerance"),
            "[SETTING:11|4|Corner tolerance|mm|6|###0.000|0|100|0|0]"
        );
    }
}
