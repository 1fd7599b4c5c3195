//! The automatic prefilter in motion: what is left of a mode that is as far off as it may be.

use host_tests::plant::{IdealPlant, Mode};
use host_tests::trace::pose;
use host_tests::vector::{norm, xyz};
use planner_core::config::{Robot, RobotConfig};
use planner_core::motion::Setpoint;

use crate::support::{Orders, TICK_S, setpoints};

const NOMINAL: Mode = Mode {
    frequency_hz: 6.34,
    damping: 0.022,
};

const PROGRAM: &str = "G0 X180 Y-60\nG1 X260 Y50 F9600\nM2";

fn robot(settings: &str) -> Robot {
    let mut config = RobotConfig::default();
    config.set_all(settings).expect("these settings exist");
    Robot::new(&config).expect("the settings are within range")
}

/// The amplitude of a mode when the command has come to its end, in mm/s².
fn left_mm_s2(all: &[Setpoint], mode: Mode) -> f64 {
    let mut plant = IdealPlant::new(mode, TICK_S, xyz(pose(&all[0])));
    let poses: Vec<_> = all.iter().map(|setpoint| setpoint.pose).collect();
    let moving = host_tests::vibration::moving_samples(&poses);
    for setpoint in &all[..moving] {
        plant.step(xyz(pose(setpoint)));
    }
    let end = xyz(pose(&all[moving]));
    let period = (1.0 / mode.frequency_hz / TICK_S) as usize;
    let rest = (0..period).map(|_| norm(plant.step(end).tool_acceleration_mm_s2));
    rest.fold(0.0, f64::max)
}

#[test]
fn it_leaves_no_more_than_allowed_of_a_mode_within_the_uncertainty() {
    let unfiltered = setpoints(&robot("prefilter=none"), PROGRAM, &Orders::new());
    for (uncertainty, limit, tightest) in [
        (0.02, 0.05, 0.4),
        (0.1, 0.05, 0.4),
        (0.2, 0.05, 0.4),
        (0.3, 0.1, 0.4),
        (0.05, 0.01, 0.3),
    ] {
        let robot = robot(&format!(
            "automatic=1 uncertainty={uncertainty} residual-limit={limit}"
        ));
        let all = setpoints(&robot, PROGRAM, &Orders::new());
        let mut worst = 0.0_f64;
        for step in -10..=10 {
            let off = uncertainty * f64::from(step) / 10.0;
            let mode = Mode {
                frequency_hz: NOMINAL.frequency_hz * (1.0 + off),
                ..NOMINAL
            };
            worst = worst.max(left_mm_s2(&all, mode) / left_mm_s2(&unfiltered, mode));
        }
        println!("±{uncertainty}: {worst:.4} of {limit} left");
        // maxima within a period of samples: some percent of either amplitude
        assert!(
            (tightest * limit..=1.03 * limit).contains(&worst),
            "±{uncertainty}: {worst} of {limit}"
        );
    }
}
