//! The planner: from a line of text to a scheduled segment, or a refusal before anything moves.

use core::fmt;

use crate::config::Robot;
use crate::gcode::{self, Command, Defaults, Feed, Interpreter, Line, Modal, Move};
use crate::kinematics::{PoseError, SegmentError};
use crate::path::PathSegment;
use crate::pose::Pose;
use crate::prefilter::{PrefilterConfig, PrefilterError};
use crate::queue::SegmentProducer;
use crate::raw::{LONGEST_S, Pace};
use crate::schedule::{Schedule, Timing};

/// What became of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Accepted {
    /// It changed modes or nothing at all; nothing moves.
    Nothing,
    /// It is the first point of a program: the tool is taken to be there.
    Reference(Pose),
    /// A segment or an action was queued.
    Queued,
    /// The program has ended.
    End,
}

/// Why a line was refused; nothing moves because of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineError {
    /// Number of the line, counted from 1 since the planner was reset.
    pub line: u32,
    /// What is wrong.
    pub cause: Cause,
}

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The text.
    Gcode(gcode::Error),
    /// The first point of the program cannot be reached.
    Pose(PoseError),
    /// Part of the segment cannot be reached.
    Segment(SegmentError),
    /// The segment would take more than a day.
    TooSlow {
        /// How long it would take.
        duration_s: f64,
    },
    /// The prefilter that a line asks for.
    Prefilter(PrefilterError),
    /// The look-ahead is full: the caller did not wait for [`Planner::has_room`].
    Full,
}

impl LineError {
    /// The number in `error:N`: Grbl's where it has one, else from 60 on.
    #[must_use]
    pub fn code(&self) -> u8 {
        match self.cause {
            Cause::Gcode(error) => error.code(),
            Cause::Pose(cause) | Cause::Segment(SegmentError { cause, .. }) => match cause {
                PoseError::Unreachable { .. } => 70,
                PoseError::NearSingular { .. } => 71,
                PoseError::JointLimit { .. } => 72,
            },
            Cause::TooSlow { .. } => 73,
            Cause::Full => 74,
            Cause::Prefilter(_) => 75,
        }
    }
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: ", self.line)?;
        match self.cause {
            Cause::Gcode(error) => error.fmt(f),
            Cause::Pose(error) => error.fmt(f),
            Cause::Segment(error) => error.fmt(f),
            Cause::Prefilter(error) => error.fmt(f),
            Cause::TooSlow { duration_s } => write!(
                f,
                "the segment would take {duration_s:.0} s, more than a day: give a higher feedrate"
            ),
            Cause::Full => f.write_str("the look-ahead is full: wait for ok before the next line"),
        }
    }
}

impl core::error::Error for LineError {}

/// Turns lines into scheduled segments.
///
/// Each segment is checked as a whole before it is queued: within reach, away from
/// singularities, within joint limits. A refused line changes nothing.
pub struct Planner<'q> {
    robot: Robot,
    interpreter: Interpreter,
    schedule: Schedule<'q>,
}

impl<'q> Planner<'q> {
    /// A planner that has seen no line; the robot's position is not known yet.
    #[must_use]
    pub fn new(robot: &Robot, queue: SegmentProducer<'q>) -> Self {
        Self {
            robot: robot.clone(),
            interpreter: Interpreter::new(defaults(robot)),
            schedule: Schedule::new(queue),
        }
    }

    /// Whether the look-ahead has room for another segment. Give a line only then.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.schedule.has_room()
    }

    /// Takes one line of G-code, without its line end.
    ///
    /// # Errors
    /// [`LineError`] says what is wrong with it and what to do. The line has no effect then.
    pub fn line(&mut self, text: &[u8]) -> Result<Accepted, LineError> {
        match self.interpret(text) {
            Ok((modal, accepted)) => {
                self.interpreter.commit(modal);
                Ok(accepted)
            }
            Err(cause) => {
                self.interpreter.skip();
                Err(LineError {
                    line: self.interpreter.modal().lines(),
                    cause,
                })
            }
        }
    }

    /// Changes the robot's settings. Only while everything stands.
    pub fn set_robot(&mut self, robot: &Robot) {
        self.robot = robot.clone();
        let position = self.interpreter.modal().position();
        self.interpreter = Interpreter::new(defaults(robot));
        self.interpreter.set_position(position);
        self.schedule.reset();
    }

    /// Goes on from where the motion has been stopped, the queue being empty.
    pub fn stopped_at(&mut self, pose: Pose) {
        self.interpreter.set_position(Some(pose));
        self.schedule.reset();
    }

    /// Switches the digital outputs where the path has come to: bit 0 the gripper, bit 1 the
    /// blow-off. The robot stops there first.
    ///
    /// # Errors
    /// [`Cause::Full`].
    pub fn switch_outputs(&mut self, outputs: u8) -> Result<Accepted, Cause> {
        queued(self.schedule.switch(outputs))
    }

    /// Pauses where the path has come to, until the motion is resumed.
    ///
    /// # Errors
    /// [`Cause::Full`].
    pub fn pause(&mut self) -> Result<Accepted, Cause> {
        queued(self.schedule.pause())
    }

    /// Changes the prefilter where the path has come to. The robot stops there first.
    ///
    /// # Errors
    /// [`Cause::Prefilter`] or [`Cause::Full`]; nothing is changed then.
    pub fn change_prefilter(&mut self, config: &PrefilterConfig) -> Result<Accepted, Cause> {
        if !self.has_room() {
            return Err(Cause::Full);
        }
        self.robot.set_prefilter(config).map_err(Cause::Prefilter)?;
        queued(self.schedule.change_prefilter(&self.robot.kernel))
    }

    /// The state after a line, once its command is queued.
    fn interpret(&mut self, text: &[u8]) -> Result<(Modal, Accepted), Cause> {
        let line = Line::parse(text).map_err(Cause::Gcode)?;
        let (modal, command) = self.interpreter.interpret(&line).map_err(Cause::Gcode)?;
        let accepted = match command {
            Command::Nothing => Ok(Accepted::Nothing),
            Command::End => Ok(Accepted::End),
            Command::Reference(pose) => {
                self.robot.scara.check(&pose).map_err(Cause::Pose)?;
                self.schedule.reset();
                Ok(Accepted::Reference(pose))
            }
            Command::Dwell { seconds } => self.stand_still(f64::from(seconds)),
            Command::Pause => self.pause(),
            Command::Move(order) => self.queue(&order),
        }?;
        Ok((modal, accepted))
    }

    /// Stops, then stands for so long.
    fn stand_still(&mut self, duration_s: f64) -> Result<Accepted, Cause> {
        let Some(pose) = self.interpreter.modal().position() else {
            return Ok(Accepted::Nothing);
        };
        queued(self.schedule.dwell(pose, duration_s))
    }

    fn queue(&mut self, order: &Move) -> Result<Accepted, Cause> {
        let path = order.path;
        let timing = self.timing(&path, order.feed);
        let duration_s = timing.duration_s;
        if duration_s == 0.0 {
            return Ok(Accepted::Nothing);
        }
        if duration_s > LONGEST_S {
            return Err(Cause::TooSlow { duration_s });
        }
        self.robot
            .scara
            .check_segment(&path)
            .map_err(Cause::Segment)?;
        let planned = self
            .schedule
            .plan(&self.robot, &path, &timing, order.corner_tolerance_mm);
        queued(planned)
    }

    /// How long a segment takes: at its feedrate, and no faster than feedrate and yaw limits.
    ///
    /// A segment that only turns takes its feedrate in °/s.
    fn timing(&self, path: &PathSegment, feed: Feed) -> Timing {
        let config = &self.robot.config;
        let (feed, pace) = match feed {
            Feed::Rapid => (config.rapid_mm_s, Pace::Rapid),
            Feed::MmPerS(feed) => (feed, Pace::Feed),
        };
        let (length_mm, turn_deg) = (path.length_mm(), libm::fabs(path.turn_deg()));
        let shortest_s = (length_mm / f64::from(config.feed_limit_mm_s))
            .max(turn_deg / f64::from(config.yaw_limit_deg_s));
        let way = if length_mm > 0.0 { length_mm } else { turn_deg };
        Timing {
            duration_s: (way / f64::from(feed)).max(shortest_s),
            shortest_s,
            pace,
        }
    }
}

fn queued(done: bool) -> Result<Accepted, Cause> {
    if done {
        Ok(Accepted::Queued)
    } else {
        Err(Cause::Full)
    }
}

fn defaults(robot: &Robot) -> Defaults {
    Defaults {
        corner_tolerance_mm: robot.config.corner_tolerance_mm,
    }
}
