//! What these tests share.

use host_tests::checker::Report;
use host_tests::judged_run;
pub use host_tests::judged_run::Orders;
use host_tests::oracle::Prefilter;
pub use host_tests::trace::pose;
use host_tests::vector::{norm, scale, sub, xyz};
use planner_core::config::{Robot, RobotConfig};
use planner_core::motion::Setpoint;
use planner_core::prefilter::{Kind, PrefilterConfig};

pub const CORNER_PATH: &str = include_str!("../../programs/corner-path.gcode");

pub const TICK_S: f64 = 1e-3;

pub fn robot(change: impl FnOnce(&mut RobotConfig)) -> Robot {
    let mut config = RobotConfig::default();
    change(&mut config);
    Robot::new(&config).expect("the settings are within range")
}

/// The oracle's prefilter of a robot.
pub fn prefilter(robot: &Robot) -> Prefilter {
    let config = robot.config.prefilter;
    Prefilter::named(
        config.kind.name(),
        config.frequency_hz.into(),
        config.damping.into(),
    )
    .expect("both have the same names")
}

/// Runs a program to its end with orders on the way.
pub fn setpoints(robot: &Robot, program: &str, orders: &Orders) -> Vec<Setpoint> {
    judged_run::setpoints(robot, program, orders).expect("the program runs")
}

/// What the checker finds, with the robot's own tolerance and rapids.
pub fn report(robot: &Robot, program: &str, setpoints: &[Setpoint]) -> Report {
    judged_run::report(robot, program, setpoints).expect("the checker reads it")
}

/// What these tests go through: the published prefilters, and of the others the one with the
/// most impulses for its length and the one with two boxes.
pub const KINDS: [Kind; 9] = [
    Kind::None,
    Kind::Zv,
    Kind::Zvd,
    Kind::Ei,
    Kind::Fir,
    Kind::FirZv,
    Kind::FirZvd,
    Kind::TwoHumpEi,
    Kind::SCurve,
];

/// How far a polyline of samples may cut a path on which the velocity jumps by twice the
/// feedrate: half of what the tool travels in a tick. A box makes that a micrometre.
pub fn allowance_mm(kind: Kind, feed_mm_s: f64) -> f64 {
    if kind.lets_velocity_jump() {
        feed_mm_s * TICK_S / 2.0
    } else {
        1e-3
    }
}

/// The tool's velocity from each setpoint to the next, in mm/s.
pub fn velocities(setpoints: &[Setpoint]) -> Vec<[f64; 3]> {
    setpoints
        .windows(2)
        .map(|pair| {
            let step = sub(xyz(pose(&pair[1])), xyz(pose(&pair[0])));
            scale(1.0 / TICK_S, step)
        })
        .collect()
}

/// The largest speed of the tool in mm/s.
pub fn top_speed_mm_s(setpoints: &[Setpoint]) -> f64 {
    velocities(setpoints)
        .into_iter()
        .map(norm)
        .fold(0.0, f64::max)
}

/// The line that changes the prefilter to this one.
pub fn prefilter_line(config: &PrefilterConfig) -> String {
    let place = Kind::ALL.iter().position(|kind| *kind == config.kind);
    format!(
        "M100 P{} Q{} R{}",
        place.expect("every kind is listed"),
        config.frequency_hz,
        config.damping
    )
}

/// Whether a setpoint says that nothing moves.
pub fn is_at_rest(setpoint: &Setpoint) -> bool {
    let joints = &setpoint.joints;
    joints.velocity == [0.0; 4] && joints.acceleration == [0.0; 4]
}
