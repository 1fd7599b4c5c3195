//! The full plant with an accelerometer on its tool: what answers the setpoints on the other end
//! of the controller's second port, the accelerometer or the drives.

use std::collections::VecDeque;
use std::ops::Range;

use planner_core::accelerometer::SampleFrame;
use planner_core::following_error::FollowingErrorFrame;
use planner_core::motion::MotionState;
use planner_core::pose::JointUnit;
use planner_core::telemetry::{SetpointFrame, Wanted};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::plant::{FullConfig, FullPlant, JointSetpoint};
use crate::trace::joints;

/// The accelerometer's noise in mm/s²: evenly distributed up to this.
const NOISE_MM_S2: f64 = 10.0;

/// Ticks of a rest that are kept: a minute.
const LONGEST_TICKS: usize = 60_000;

/// Lost frames in a row that the plant bridges; more are a controller that started again.
const LONGEST_GAP: u32 = 100;

/// What comes back for a setpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// What the accelerometer reads.
    Acceleration(SampleFrame),
    /// What the drives tell.
    FollowingErrors(FollowingErrorFrame),
}

impl Answer {
    /// The bytes on the wire.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        match self {
            Self::Acceleration(frame) => frame.encode().to_vec(),
            Self::FollowingErrors(frame) => frame.encode().to_vec(),
        }
    }
}

/// Full plant and accelerometer.
#[derive(Debug)]
pub struct SensedPlant {
    config: FullConfig,
    /// With the last frame.
    plant: Option<(FullPlant, SetpointFrame)>,
    rng: ChaCha8Rng,
    /// Ticks that an answer takes.
    delay: usize,
    /// Answers with the ticks until they arrive.
    under_way: VecDeque<(usize, Answer)>,
    /// The tool's acceleration along X and Y in each tick since the last stop, in mm/s².
    felt_mm_s2: Vec<[f64; 2]>,
    was_moving: bool,
    /// How often the commanded motion has come to a stop.
    pub stops: u32,
}

impl SensedPlant {
    /// A plant that stands wherever the first setpoint says it does, and answers `delay` ticks
    /// late.
    #[must_use]
    pub fn new(config: FullConfig, delay: usize) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(config.seed),
            config,
            plant: None,
            delay,
            under_way: VecDeque::new(),
            felt_mm_s2: Vec::new(),
            was_moving: false,
            stops: 0,
        }
    }

    /// Carries out a setpoint; yields the answer that arrives then.
    pub fn answer(&mut self, frame: &SetpointFrame) -> Option<Answer> {
        let setpoint = &frame.setpoint;
        let target = JointSetpoint {
            position: joints(setpoint),
            velocity: setpoint.joints.velocity.map(f64::from),
            acceleration: setpoint.joints.acceleration.map(f64::from),
        };
        // A placed setpoint says where the joints are and moves none.
        if setpoint.placed {
            self.plant = None;
        }
        let (plant, last) = self.plant.get_or_insert_with(|| {
            let config = FullConfig {
                start: target.position,
                ..self.config.clone()
            };
            (FullPlant::new(config), *frame)
        });
        // Time goes on where frames were lost: the drives hold what they had.
        let lost = frame.sequence.wrapping_sub(last.sequence).saturating_sub(1);
        let held = JointSetpoint::at_rest(joints(&last.setpoint));
        for _ in 0..lost.min(LONGEST_GAP) {
            plant.step(held);
        }
        *last = *frame;
        let felt = plant.step(target);
        let is_moving = setpoint.state != MotionState::Idle;
        if self.was_moving && !is_moving {
            self.stops += 1;
            self.felt_mm_s2.clear();
        }
        self.was_moving = is_moving;
        if self.felt_mm_s2.len() < LONGEST_TICKS {
            let [x, y, _] = felt.tool_acceleration_mm_s2;
            self.felt_mm_s2.push([x, y]);
        }
        for (wait, _) in &mut self.under_way {
            *wait = wait.saturating_sub(1);
        }
        let sequence = frame.sequence;
        let answer = match frame.wanted {
            Wanted::Nothing => None,
            Wanted::Acceleration => {
                let mut noisy =
                    |value: f64| value + NOISE_MM_S2 * self.rng.random_range(-1.0..=1.0);
                let acceleration_mm_s2 = felt
                    .tool_acceleration_mm_s2
                    .map(|value| noisy(value) as f32);
                Some(Answer::Acceleration(SampleFrame {
                    sequence,
                    acceleration_mm_s2,
                }))
            }
            Wanted::FollowingErrors => Some(Answer::FollowingErrors(FollowingErrorFrame {
                sequence,
                error: std::array::from_fn(|joint| {
                    // rad to µrad, or mm to µm
                    let fine = match setpoint.arm.joint_units()[joint] {
                        JointUnit::Angle => 1e6,
                        JointUnit::Length => 1e3,
                    };
                    (fine * felt.following_error[joint]) as f32
                }),
            })),
        };
        self.under_way
            .extend(answer.map(|answer| (self.delay, answer)));
        let (_, answer) = self.under_way.pop_front_if(|(wait, _)| *wait == 0)?;
        Some(answer)
    }

    /// Ticks since the last stop, up to a minute of them.
    #[must_use]
    pub fn stood_ticks(&self) -> usize {
        if self.was_moving {
            0
        } else {
            self.felt_mm_s2.len()
        }
    }

    /// The largest acceleration in so many ticks after the last stop, in mm/s².
    #[must_use]
    pub fn largest_after_stop_mm_s2(&self, ticks: usize) -> f64 {
        self.largest_within_mm_s2(0..ticks)
    }

    /// The largest acceleration within some ticks, counted from the last stop, in mm/s².
    #[must_use]
    pub fn largest_within_mm_s2(&self, ticks: Range<usize>) -> f64 {
        let felt = self.felt_mm_s2.iter().take(ticks.end).skip(ticks.start);
        felt.map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max)
    }
}
