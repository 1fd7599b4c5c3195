//! The robot of these tests and its map.

use host_tests::checker::Report;
use host_tests::judged_run;
pub use host_tests::judged_run::Orders;
use planner_core::config::{Robot, RobotConfig};
use planner_core::motion::Setpoint;
use planner_core::posture::{MAP_NODES, MapNode, ModeMapConfig};

pub const TICK_S: f64 = 1e-3;

pub const DAMPING: f32 = 0.02;

/// 20 Hz at a reach of 110 mm, 8 Hz at 350 mm.
pub fn frequency_hz(x_mm: f64, y_mm: f64) -> f64 {
    20.0 - 0.05 * (x_mm.hypot(y_mm) - 110.0)
}

/// The map of it where programs move.
pub fn map() -> ModeMapConfig {
    let mut map = ModeMapConfig {
        x_mm: [100.0, 320.0],
        y_mm: [-140.0, 140.0],
        columns: MAP_NODES as u8,
        rows: MAP_NODES as u8,
        ..ModeMapConfig::NONE
    };
    let place = |[low, high]: [f32; 2], node: usize| {
        f64::from(low) + f64::from(high - low) * node as f64 / (MAP_NODES - 1) as f64
    };
    for (node, mode) in map.nodes.iter_mut().enumerate() {
        let x_mm = place(map.x_mm, node % MAP_NODES);
        let y_mm = place(map.y_mm, node / MAP_NODES);
        *mode = MapNode::new(frequency_hz(x_mm, y_mm) as f32, DAMPING);
    }
    map
}

pub fn robot(change: impl FnOnce(&mut RobotConfig)) -> Robot {
    let mut config = RobotConfig {
        map: map(),
        feed_limit_mm_s: 400.0,
        ..RobotConfig::default()
    };
    config.prefilter.damping = DAMPING;
    change(&mut config);
    Robot::new(&config).expect("the settings are within range")
}

/// Runs a program to its end with orders on the way.
pub fn setpoints(robot: &Robot, program: &str, orders: &Orders) -> Vec<Setpoint> {
    judged_run::setpoints(robot, program, orders).expect("the program runs")
}

/// What the checker finds, with the robot's own tolerance and rapids.
pub fn report(robot: &Robot, program: &str, setpoints: &[Setpoint]) -> Report {
    judged_run::report(robot, program, setpoints).expect("the checker reads it")
}
