//! Homing: finding where the joints are by their limit inputs.
//!
//! One joint after the other, the quill first so that the tool is out of the way:
//!
//! | phase | way | until its limit input is | else |
//! |---|---|---|---|
//! | free | away from the switch | inactive; only if it is active at the start | alarm 8 |
//! | seek | towards it, fast | active | alarm 9 |
//! | back off | away, fast | inactive | alarm 8 |
//! | locate | towards it, slowly | active: here the joint is at its home position | alarm 9 |
//! | pull off | to the pull-off distance from there | and it has to be inactive then | alarm 8 |
//!
//! The position counts in the tick in which the input changes, and the arm stops as it always
//! does, through the prefilter. An input that bounces does so within that time.

use crate::pose::{AXES, JointPosition, JointUnit};

use super::alarm::Alarm;

/// How the joints find their limit inputs. Angles are in degrees, a quill's lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingConfig {
    /// Joints with a limit input, a bit each from joint 1 on; the others are taken to stand at
    /// their home positions.
    pub joints: u8,
    /// Joints whose limit input is at their lower end, likewise.
    pub at_lower_end: u8,
    /// Speed of locating, in °/s or mm/s.
    pub slow: f32,
    /// Speed of seeking, in °/s or mm/s.
    pub fast: f32,
    /// From the limit input, in ° or mm.
    pub pull_off: f32,
    /// Positions at the limit inputs, in ° or mm.
    pub positions: [f32; AXES],
}

impl Default for HomingConfig {
    /// No limit inputs; if there were, at the lower ends of the bench robot's joints.
    fn default() -> Self {
        Self {
            joints: 0,
            at_lower_end: 0b1011,
            slow: 2.0,
            fast: 30.0,
            pull_off: 5.0,
            positions: [-165.0, 10.0, 190.0, -360.0],
        }
    }
}

/// The quill first, then the arm from the shoulder on.
const ORDER: [usize; AXES] = [2, 0, 1, 3];

/// Ways to back off, in pull-off distances.
const BACK_OFF: f32 = 10.0;
/// Ways to locate: all that was backed off, and what the prefilter added.
const LOCATE: f32 = 20.0;
/// Ways to seek, in joint travels.
const SEEK: f32 = 1.5;

/// What a joint does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Begin,
    Free,
    Seek,
    BackOff,
    Locate,
    PullOff,
}

/// What the motion has come to at the end of a move.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Where the joints stand.
    pub joints: JointPosition,
    /// Where the joint was when its limit input was as wanted.
    pub touched: Option<i32>,
    /// The limit inputs, from bit 0.
    pub limits: u8,
}

/// What homing does next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    /// Move the joints.
    Move {
        /// To here.
        to: JointPosition,
        /// In this time.
        duration_s: f64,
        /// Which limit input ends the move, and whether when active.
        until: Option<(u8, bool)>,
    },
    /// The joints are here.
    Done(JointPosition),
    /// A limit input was not as expected.
    Failed(Alarm),
}

/// Homing under way.
#[derive(Clone, Copy, Debug)]
pub struct Homing {
    /// Place in [`ORDER`].
    turn: usize,
    phase: Phase,
    /// Where the joint of this turn has its limit input, as the setpoints count.
    home: i32,
    /// What has to be added to the setpoints' positions, by joint.
    corrections: [i32; AXES],
}

impl Homing {
    /// Homing that has not begun.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            turn: 0,
            phase: Phase::Begin,
            home: 0,
            corrections: [0; AXES],
        }
    }

    /// What to do next, everything standing. `travels` are the joints' travels in ° or mm, by
    /// their `units`.
    pub fn next(
        &mut self,
        config: &HomingConfig,
        units: [JointUnit; AXES],
        travels: &[f32; AXES],
        outcome: &Outcome,
    ) -> Next {
        while let Some(&joint) = ORDER.get(self.turn) {
            let unit = units.get(joint).copied().unwrap_or(JointUnit::Angle);
            if let Some(next) = self.joint_next((joint, unit), config, travels, outcome) {
                return next;
            }
            self.turn += 1;
            self.phase = Phase::Begin;
        }
        let mut position = outcome.joints.to_bits();
        for (value, correction) in position.iter_mut().zip(self.corrections) {
            *value = value.saturating_add(correction);
        }
        Next::Done(JointPosition::from_bits(position))
    }

    /// What a joint does next; nothing when it is done.
    fn joint_next(
        &mut self,
        (joint, unit): (usize, JointUnit),
        config: &HomingConfig,
        travels: &[f32; AXES],
        outcome: &Outcome,
    ) -> Option<Next> {
        let at = |values: &[f32; AXES]| values.get(joint).copied().unwrap_or_default();
        let here = outcome.joints.to_bits().get(joint).copied().unwrap_or(0);
        let home_position = unit.bits(at(&config.positions));
        let is_active = outcome.limits & (1 << joint) != 0;
        let away = if config.at_lower_end & (1 << joint) == 0 {
            -1.0
        } else {
            1.0
        };
        let go = |way: f32, speed: f32, until| {
            let mut to = outcome.joints.to_bits();
            if let Some(value) = to.get_mut(joint) {
                *value = value.saturating_add(unit.bits(way));
            }
            Some(Next::Move {
                to: JointPosition::from_bits(to),
                duration_s: f64::from(way.abs() / speed),
                until,
            })
        };
        let until = |active| Some((joint as u8, active));
        let failed = |alarm| Some(Next::Failed(alarm));
        let touched = outcome.touched;

        let (phase, next) = match self.phase {
            Phase::Begin if config.joints & (1 << joint) == 0 => {
                self.correct(joint, home_position.saturating_sub(here));
                return None;
            }
            Phase::Begin if is_active => {
                let way = away * BACK_OFF * config.pull_off;
                (Phase::Free, go(way, config.fast, until(false)))
            }
            Phase::Free if touched.is_none() || is_active => return failed(Alarm::HomingPullOff),
            Phase::Begin | Phase::Free => {
                let way = -away * SEEK * at(travels);
                (Phase::Seek, go(way, config.fast, until(true)))
            }
            Phase::Seek if touched.is_none() => return failed(Alarm::HomingNotFound),
            Phase::Seek => {
                let way = away * BACK_OFF * config.pull_off;
                (Phase::BackOff, go(way, config.fast, until(false)))
            }
            Phase::BackOff if touched.is_none() || is_active => {
                return failed(Alarm::HomingPullOff);
            }
            Phase::BackOff => {
                let way = -away * LOCATE * config.pull_off;
                (Phase::Locate, go(way, config.slow, until(true)))
            }
            Phase::Locate => {
                let Some(home) = touched else {
                    return failed(Alarm::HomingNotFound);
                };
                self.home = home;
                let target = home.saturating_add(unit.bits(away * config.pull_off));
                let way = unit.shown(target.saturating_sub(here));
                (Phase::PullOff, go(way, config.fast, None))
            }
            Phase::PullOff if is_active => return failed(Alarm::HomingPullOff),
            Phase::PullOff => {
                self.correct(joint, home_position.saturating_sub(self.home));
                return None;
            }
        };
        self.phase = phase;
        next
    }

    fn correct(&mut self, joint: usize, correction: i32) {
        if let Some(value) = self.corrections.get_mut(joint) {
            *value = correction;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::ArmKind;

    const UNITS: [JointUnit; AXES] = ArmKind::Scara.joint_units();

    fn bits(joint: usize, way: f32) -> i32 {
        UNITS[joint].bits(way)
    }

    fn plain(joint: usize, bits: i32) -> f32 {
        UNITS[joint].shown(bits)
    }

    /// A joint with a switch below `switch`, obeying homing at once, and by `late` too far
    /// whenever a switch ends a move.
    fn home(config: &HomingConfig, switches: [f32; AXES], start: [f32; AXES]) -> Next {
        let mut homing = Homing::new();
        let mut joints = core::array::from_fn(|joint| bits(joint, start[joint]));
        let mut touched = None;
        let away = |joint: usize| {
            if config.at_lower_end & (1 << joint) == 0 {
                -1
            } else {
                1
            }
        };
        let is_active = |joint: usize, value: i32| {
            let beyond = value.saturating_sub(bits(joint, switches[joint]));
            beyond.saturating_mul(away(joint)) <= 0
        };
        for _ in 0..100 {
            let limits = (0..AXES)
                .filter(|&joint| is_active(joint, joints[joint]))
                .fold(0, |bits, joint| bits | 1 << joint);
            let outcome = Outcome {
                joints: JointPosition::from_bits(joints),
                touched,
                limits,
            };
            match homing.next(config, UNITS, &[340.0, 340.0, 400.0, 1440.0], &outcome) {
                Next::Move {
                    to,
                    duration_s,
                    until,
                } => {
                    assert!(duration_s > 0.0);
                    let from = joints;
                    joints = to.to_bits();
                    touched = None;
                    if let Some((joint, active)) = until {
                        let joint = usize::from(joint);
                        let switch = bits(joint, switches[joint]);
                        let target = joints[joint];
                        // The input changes at the switch, if the move passes it.
                        let edge = if active { switch } else { switch + away(joint) };
                        if is_active(joint, target) == active {
                            assert_ne!(is_active(joint, from[joint]), active);
                            touched = Some(edge);
                            let late = bits(joint, 1.5) * (target - from[joint]).signum();
                            joints[joint] = edge + late;
                        }
                    }
                }
                end => return end,
            }
        }
        panic!("it does not end");
    }

    fn config() -> HomingConfig {
        HomingConfig {
            joints: 0b1111,
            ..HomingConfig::default()
        }
    }

    #[test]
    fn every_joint_ends_at_its_pull_off_distance_from_home() {
        let config = config();
        for start in [
            [0.0, 50.0, 0.0, 0.0],
            [-80.0, -60.0, 140.0, -300.0],
            // on the switches of joints 1 and 3
            [-101.0, 20.0, 151.0, 0.0],
        ] {
            // the controller's zero is not the arm's
            let switches = [-100.0, -70.0, 150.0, -350.0];
            let Next::Done(joints) = home(&config, switches, start) else {
                panic!("it fails from {start:?}");
            };
            let expected = [-165.0 + 5.0, 10.0 + 5.0, 190.0 - 5.0, -360.0 + 5.0];
            for (joint, value) in joints.to_bits().into_iter().enumerate() {
                let error = plain(joint, value) - expected[joint];
                assert!(error.abs() < 1e-4, "joint {joint}: {error}");
            }
        }
    }

    #[test]
    fn a_joint_without_an_input_is_taken_to_stand_at_home() {
        let config = HomingConfig {
            joints: 0b0001,
            ..config()
        };
        let Next::Done(joints) = home(&config, [-100.0; 4], [0.0, 33.0, 44.0, 55.0]) else {
            panic!("it fails");
        };
        let [joint1, rest @ ..] = joints.to_bits();
        assert!((plain(0, joint1) + 160.0).abs() < 1e-4);
        assert_eq!(rest, [bits(1, 10.0), bits(2, 190.0), bits(3, -360.0)]);
    }

    #[test]
    fn a_switch_that_is_not_found_or_does_not_open_is_an_alarm() {
        let start = [0.0, 50.0, 0.0, 0.0];
        // further than one and a half travels away
        let far = [-511.0, -70.0, 150.0, -350.0];
        assert_eq!(
            home(&config(), far, start),
            Next::Failed(Alarm::HomingNotFound)
        );
        // joint 1 is further on its switch than it backs off
        let stuck = [51.0, -70.0, 150.0, -350.0];
        assert_eq!(
            home(&config(), stuck, start),
            Next::Failed(Alarm::HomingPullOff)
        );
    }
}
