//! Homing: each joint looks for its limit input, so that its position is known.
//!
//! A joint goes fast until its input becomes active, backs off by the pull-off, comes again
//! slowly, and backs off once more. The position at which the input became active the second
//! time is the setting's. Every one of these moves is shaped by the prefilter.

use crate::motion::{Seek, SeekResult};
use crate::pose::AXES;

use super::alarm::Alarm;

/// Settings of homing. Joints 1, 2 and 4 in degrees and °/s, joint 3 in mm and mm/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingConfig {
    /// Joints that are homed, bit 0 for joint 1.
    pub joints: u8,
    /// Joints whose input is at the upper end of their travel.
    pub upwards: u8,
    /// Speed towards the input the second time.
    pub locate_speed: f32,
    /// Speed towards the input the first time.
    pub seek_speed: f32,
    /// How far a joint backs off.
    pub pull_off: f32,
    /// Position of each joint at which its input becomes active.
    pub positions: [f32; AXES],
}

impl Default for HomingConfig {
    fn default() -> Self {
        Self {
            joints: 0b0111,
            upwards: 0b0100,
            locate_speed: 2.0,
            seek_speed: 20.0,
            pull_off: 5.0,
            positions: [-170.0, 10.0, 200.0, 0.0],
        }
    }
}

/// In which order joints are homed: the quill leaves the table first.
const ORDER: [usize; AXES] = [2, 0, 1, 3];

/// How much further than its travel a joint seeks.
const BEYOND: f32 = 1.1;

/// What a joint does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Seeking,
    BackingOff,
    Locating,
    Leaving,
}

/// What homing wants next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// This move of one joint.
    Seek(Seek),
    /// The positions that all joints have now; homing is over.
    Done([f32; AXES]),
    /// It has failed.
    Failed(Alarm),
}

/// Homing under way.
#[derive(Clone, Copy, Debug)]
pub struct Homing {
    config: HomingConfig,
    /// Travel of each joint.
    travels: [f32; AXES],
    /// Index into [`ORDER`].
    turn: usize,
    phase: Phase,
    /// Where each joint is, in the coordinates of before homing until its input was located.
    positions: [f32; AXES],
}

impl Homing {
    /// Begins, with the joints at `positions` in coordinates that mean nothing yet; returns
    /// the first move as well.
    pub fn begin(config: HomingConfig, travels: [f32; AXES], positions: [f32; AXES]) -> (Self, Wish) {
        let mut homing = Self {
            config,
            travels,
            turn: 0,
            phase: Phase::Seeking,
            positions,
        };
        let wish = homing.next_joint();
        (homing, wish)
    }

    /// What comes after a move that ended with `result`, with the joint's input as it is now.
    pub fn moved(&mut self, result: SeekResult, limits: u8) -> Wish {
        let Some(joint) = ORDER.get(self.turn).copied() else {
            return Wish::Done(self.positions);
        };
        if let Some(position) = self.positions.get_mut(joint) {
            *position = result.end;
        }
        let is_active = limits & (1 << joint) != 0;
        match (self.phase, result.found) {
            (Phase::Seeking | Phase::Locating, None) => Wish::Failed(Alarm::HomingNoLimit),
            (Phase::Seeking, Some(_)) => self.back_off(joint, Phase::BackingOff),
            (Phase::BackingOff | Phase::Leaving, _) if is_active => {
                Wish::Failed(Alarm::HomingPullOff)
            }
            (Phase::BackingOff, _) => {
                self.phase = Phase::Locating;
                let Self { config, .. } = self;
                Wish::Seek(self.towards(joint, 2.0 * config.pull_off, config.locate_speed))
            }
            (Phase::Locating, Some(found)) => {
                let home = self.config.positions.get(joint).copied().unwrap_or(0.0);
                if let Some(position) = self.positions.get_mut(joint) {
                    *position += home - found;
                }
                self.back_off(joint, Phase::Leaving)
            }
            (Phase::Leaving, _) => {
                self.turn += 1;
                self.next_joint()
            }
        }
    }

    /// The first move of the next joint that is homed.
    fn next_joint(&mut self) -> Wish {
        while let Some(joint) = ORDER.get(self.turn).copied() {
            if self.config.joints & (1 << joint) != 0 {
                self.phase = Phase::Seeking;
                let travel = self.travels.get(joint).copied().unwrap_or(0.0);
                return Wish::Seek(self.towards(joint, BEYOND * travel, self.config.seek_speed));
            }
            self.turn += 1;
        }
        Wish::Done(self.positions)
    }

    fn towards(&self, joint: usize, distance: f32, speed: f32) -> Seek {
        let sign = if self.config.upwards & (1 << joint) != 0 {
            1.0
        } else {
            -1.0
        };
        Seek {
            joint: joint as u8,
            start: self.positions,
            distance: sign * distance,
            speed,
            until_limit: true,
        }
    }

    fn back_off(&mut self, joint: usize, phase: Phase) -> Wish {
        self.phase = phase;
        let away = self.towards(joint, -self.config.pull_off, self.config.locate_speed);
        Wish::Seek(Seek {
            until_limit: false,
            ..away
        })
    }
}
