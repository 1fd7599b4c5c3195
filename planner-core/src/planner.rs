//! The planner: from a line of text to a scheduled segment, or a refusal before anything moves.

use core::fmt;

use crate::config::Robot;
use crate::gcode::{
    self, Command, Defaults, Feed, Interpreted, Interpreter, Line, MAX_ACTIONS_A_LINE, Move,
    Offsets, ProgramFlow,
};
use crate::kinematics::{PoseError, SegmentError};
use crate::path::PathSegment;
use crate::pose::Pose;
use crate::raw::{LONGEST_S, SegmentProducer};
use crate::schedule::Schedule;

/// What became of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accepted {
    /// It is the first point of a program: the tool is taken to be there.
    pub reference: Option<Pose>,
    /// Something was queued.
    pub queued: bool,
    /// Work zero may have moved: [`Interpreter::work_offset`].
    pub offset_changed: bool,
    /// [`Offsets::to_bytes`] have changed.
    pub offsets_stored: bool,
    /// The program has ended.
    pub ended: bool,
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
    /// Part of the jog cannot be reached.
    Jog(SegmentError),
    /// M100 to M102.
    RobotChange,
    /// The segment would take more than a day.
    TooSlow {
        /// How long it would take.
        duration_s: f64,
    },
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
            Cause::Jog(_) => 15,
            Cause::TooSlow { .. } => 73,
            Cause::Full => 74,
            Cause::RobotChange => 79,
        }
    }
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: ", self.line)?;
        match self.cause {
            Cause::Gcode(error) => error.fmt(f),
            Cause::Pose(error) => error.fmt(f),
            Cause::Segment(error) | Cause::Jog(error) => error.fmt(f),
            Cause::RobotChange => {
                f.write_str("prefilter and elbow change at rest only: use their settings")
            }
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
/// Each segment is checked as a whole before anything of its line is queued: within reach,
/// away from singularities, within joint limits. A refused line changes nothing.
pub struct Planner<'q> {
    robot: Robot,
    interpreter: Interpreter,
    /// The state after the lines checked, while lines are checked only.
    checking: Option<Interpreter>,
    schedule: Schedule<'q>,
}

impl<'q> Planner<'q> {
    /// A planner that has seen no line; the robot's position is not known yet.
    #[must_use]
    pub fn new(robot: &Robot, segments: SegmentProducer<'q>) -> Self {
        Self {
            robot: robot.clone(),
            interpreter: Interpreter::new(defaults(robot)),
            checking: None,
            schedule: Schedule::new(segments),
        }
    }

    /// Whether the look-ahead has room for all that a line can ask for. Give one only then.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.schedule.free_places() >= MAX_ACTIONS_A_LINE
    }

    /// Segments that the look-ahead has room for.
    #[must_use]
    pub fn free_places(&self) -> usize {
        self.schedule.free_places()
    }

    /// The modal state and the offsets, after the lines accepted so far or, in between
    /// [`Planner::check`] and [`Planner::reset_modes`], checked so far.
    #[must_use]
    pub fn interpreter(&self) -> &Interpreter {
        self.checking.as_ref().unwrap_or(&self.interpreter)
    }

    /// Takes one line of G-code, without its line end.
    ///
    /// # Errors
    /// [`LineError`] says what is wrong with it and what to do. The line has no effect then.
    pub fn line(&mut self, text: &[u8]) -> Result<Accepted, LineError> {
        match Line::parse(text) {
            Ok(line) => self.execute(&line),
            Err(error) => Err(self.refused(error)),
        }
    }

    /// Takes one line of G-code.
    ///
    /// # Errors
    /// [`LineError`] says what is wrong with it and what to do. The line has no effect then.
    pub fn execute(&mut self, line: &Line) -> Result<Accepted, LineError> {
        let interpreted = self.interpreter.interpret(line);
        let interpreted = interpreted.map_err(|error| self.refused(error))?;
        self.carry_out(&interpreted)
            .map_err(|cause| self.refusal(cause))
    }

    /// Takes the text behind `$J=`.
    ///
    /// # Errors
    /// [`LineError`]; its code is 15 if the jog leaves the robot's travel.
    pub fn jog(&mut self, text: &[u8]) -> Result<Accepted, LineError> {
        let interpreted = Line::parse(text)
            .and_then(|line| self.interpreter.jog(&line))
            .map_err(|error| self.refused(error))?;
        self.carry_out(&interpreted).map_err(|cause| {
            self.refusal(match cause {
                Cause::Segment(error) => Cause::Jog(error),
                cause => cause,
            })
        })
    }

    /// Checks a line as if those before it had been executed, and queues nothing: the state
    /// that they leave behind is apart from the planner's own until
    /// [`Planner::reset_modes`].
    ///
    /// # Errors
    /// [`LineError`] says what is wrong with it and what to do.
    pub fn check(&mut self, line: &Line) -> Result<(), LineError> {
        let mut interpreter = self.interpreter().clone();
        let checked = interpreter
            .interpret(line)
            .map_err(Cause::Gcode)
            .and_then(|interpreted| {
                self.durations_s(&interpreted.command)?;
                Ok(interpreted)
            });
        match &checked {
            Ok(interpreted) => interpreter.commit(interpreted),
            Err(_) => interpreter.skip(),
        }
        let line = interpreter.modal().lines();
        self.checking = Some(interpreter);
        checked.map(drop).map_err(|cause| LineError { line, cause })
    }

    /// Counts a line that could not be read.
    pub fn refused(&mut self, error: gcode::Error) -> LineError {
        self.refusal(Cause::Gcode(error))
    }

    /// Back to the modes after power-up, as Grbl's soft reset: position, G54 to G59, G28
    /// and G30 stay. What [`Planner::check`] has kept is forgotten.
    pub fn reset_modes(&mut self) {
        self.checking = None;
        self.interpreter.reset();
    }

    /// Replaces the offsets, by those kept over power-off or by none.
    pub fn set_offsets(&mut self, offsets: Offsets) {
        self.interpreter.set_offsets(offsets);
    }

    /// Changes the robot's settings. Only while everything stands.
    pub fn set_robot(&mut self, robot: &Robot) {
        self.robot = robot.clone();
        self.interpreter.set_defaults(defaults(robot));
        self.reset_modes();
        self.schedule.reset();
    }

    fn refusal(&mut self, cause: Cause) -> LineError {
        self.interpreter.skip();
        let line = self.interpreter.modal().lines();
        LineError { line, cause }
    }

    /// Queues the actions of a line, all or none, and commits what it leaves behind.
    fn carry_out(&mut self, interpreted: &Interpreted) -> Result<Accepted, Cause> {
        let command = &interpreted.command;
        let durations_s = self.durations_s(command)?;
        if !self.has_room() {
            return Err(Cause::Full);
        }
        if command.reference.is_some() {
            self.schedule.reset();
        }
        let mut queued = false;
        if let Some(duration_s) = command.dwell_s {
            queued |= self.stand_still(f64::from(duration_s));
        }
        for (order, duration_s) in command.moves().zip(durations_s) {
            let tolerance_mm = order.corner_tolerance_mm;
            let robot = &self.robot;
            queued |= duration_s > 0.0
                && self
                    .schedule
                    .plan(robot, &order.path, duration_s, tolerance_mm);
        }
        self.interpreter.commit(interpreted);
        if command.flow == Some(ProgramFlow::Pause) {
            queued |= self.stand_still(0.0);
        }
        Ok(Accepted {
            reference: command.reference,
            queued,
            offset_changed: interpreted.moves_work_zero(),
            offsets_stored: interpreted.stores_offsets(),
            ended: command.flow == Some(ProgramFlow::End),
        })
    }

    /// How long each motion of a line takes, once the robot can do all that the line asks for.
    fn durations_s(&self, command: &Command) -> Result<[f64; 2], Cause> {
        if command.robot.is_some() {
            return Err(Cause::RobotChange);
        }
        if let Some(pose) = &command.reference {
            self.robot.scara.check(pose).map_err(Cause::Pose)?;
        }
        let mut durations_s = [0.0; 2];
        for (order, duration_s) in command.moves().zip(&mut durations_s) {
            *duration_s = self.checked_duration_s(order)?;
        }
        Ok(durations_s)
    }

    /// How long a motion takes; zero if it is shorter than anything.
    fn checked_duration_s(&self, order: &Move) -> Result<f64, Cause> {
        let duration_s = self.duration_s(&order.path, order.feed);
        if duration_s > LONGEST_S {
            return Err(Cause::TooSlow { duration_s });
        }
        if duration_s > 0.0 {
            let checked = self.robot.scara.check_segment(&order.path);
            checked.map_err(Cause::Segment)?;
        }
        Ok(duration_s)
    }

    /// Stops, then stands for so long; where the position is unknown nothing has moved.
    /// Whether anything was queued.
    fn stand_still(&mut self, duration_s: f64) -> bool {
        let position = self.interpreter.modal().position();
        position.is_some_and(|pose| self.schedule.dwell(&self.robot, pose, duration_s))
    }

    /// How long a segment takes: at its feedrate, and no faster than feedrate and yaw limits.
    ///
    /// A segment that only turns takes its feedrate in °/s.
    fn duration_s(&self, path: &PathSegment, feed: Feed) -> f64 {
        let config = &self.robot.config;
        let (feed, at_least_s) = match feed {
            Feed::Rapid => (config.rapid_mm_s, 0.0),
            Feed::MmPerS(feed) => (feed, 0.0),
            Feed::Seconds(duration_s) => (f32::INFINITY, f64::from(duration_s)),
        };
        let length_mm = path.length_mm();
        let turn_s = |rate_deg_s: f32| libm::fabs(path.turn_deg()) / f64::from(rate_deg_s);
        let limited_s = if length_mm > 0.0 {
            let feed_mm_s = feed.min(config.feed_limit_mm_s);
            (length_mm / f64::from(feed_mm_s)).max(turn_s(config.yaw_limit_deg_s))
        } else {
            turn_s(feed.min(config.yaw_limit_deg_s))
        };
        limited_s.max(at_least_s)
    }
}

fn defaults(robot: &Robot) -> Defaults {
    Defaults {
        corner_tolerance_mm: robot.config.corner_tolerance_mm,
        prefilter: robot.config.prefilter,
        elbow: robot.config.scara.elbow,
        first_point_declares: true,
    }
}
