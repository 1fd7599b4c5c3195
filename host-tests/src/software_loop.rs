//! The software loop: the unchanged core, stepped in one process.

use std::fmt;

use planner_core::config::{ConfigError, Robot, RobotConfig};
use planner_core::limits::Limited;
use planner_core::motion::{DelayLines, Motion, MotionState, Order, Setpoint};
use planner_core::planner::{LineError, Planner};
use planner_core::posture::Tuning;
use planner_core::queue::{RawItem, SegmentQueue};
use planner_core::raw::Pace;

/// Why a program does not run; nothing has moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProgramError {
    /// A line is refused.
    Line(LineError),
    /// The program holds no motion.
    Empty,
}

impl fmt::Display for ProgramError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(error) => error.fmt(f),
            Self::Empty => f.write_str(
                "the program holds no motion: it needs a first G0 or G1 point and a move from there",
            ),
        }
    }
}

impl std::error::Error for ProgramError {}

impl From<LineError> for ProgramError {
    fn from(error: LineError) -> Self {
        Self::Line(error)
    }
}

/// Plans the whole program without moving: what [`run`] refuses, before anything moves.
///
/// # Errors
/// [`ProgramError`] names the first line that is refused.
pub fn check(robot: &Robot, program: &str) -> Result<(), ProgramError> {
    plan(robot, program).map(drop)
}

/// What planning tells of a program beside its motion.
#[derive(Clone, Debug, Default)]
pub struct Planned {
    /// The segments whose feed a limit lowers.
    pub limited: Vec<Limited>,
    /// What the prefilter at the end of each move is made of.
    pub at_ends: Vec<Tuning>,
}

/// Plans the whole program without moving.
///
/// # Errors
/// As [`check`].
pub fn plan(robot: &Robot, program: &str) -> Result<Planned, ProgramError> {
    let mut planned_so_far = Planned::default();
    let mut queue = SegmentQueue::new();
    let (producer, mut consumer) = queue.split();
    let mut planned = robot.clone();
    let mut planner = Planner::new(&mut planned, producer);
    let mut moves = false;
    for line in program.lines() {
        let accepted = planner.line(line.as_bytes())?;
        moves |= accepted.queued;
        planned_so_far.limited.extend(accepted.limited);
        if accepted.ended {
            break;
        }
        while let Some(item) = consumer.pop() {
            if matches!(item, RawItem::Segment(segment) if segment.pace != Pace::StandStill) {
                planned_so_far.at_ends.push(planner.robot().tuning);
            }
        }
        while consumer.pop_kernel().is_some() {}
    }
    if moves {
        Ok(planned_so_far)
    } else {
        Err(ProgramError::Empty)
    }
}

/// Runs a program through planner and tick, and hands each tick's setpoint to `each`.
///
/// See [`Controller::run`].
///
/// # Errors
/// [`ProgramError`], before anything moves.
pub fn run(robot: &Robot, program: &str, each: impl FnMut(&Setpoint)) -> Result<(), ProgramError> {
    check(robot, program)?;
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    Controller::new(&mut robot.clone(), &mut queue, &mut filters).run(program, each)?;
    Ok(())
}

/// A controller as the firmware wires it, stepped by its caller: it may run one program
/// after the other.
pub struct Controller<'q> {
    planner: Planner<'q>,
    motion: Motion<'q>,
}

impl<'q> Controller<'q> {
    /// A controller that has seen no line, around a queue and delay lines that are new.
    pub fn new(
        robot: &'q mut Robot,
        queue: &'q mut SegmentQueue,
        filters: &'q mut DelayLines,
    ) -> Self {
        let (producer, consumer) = queue.split();
        Self {
            motion: Motion::new(robot, consumer, filters),
            planner: Planner::new(robot, producer),
        }
    }

    /// Changes the settings, between two programs.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of range; nothing is changed then.
    pub fn set_config(&mut self, config: &RobotConfig) -> Result<(), ConfigError> {
        self.planner.set_config(config)?;
        self.motion.set_robot(&self.planner.robot().into());
        Ok(())
    }

    /// The planner, for what no line says.
    pub fn planner(&mut self) -> &mut Planner<'q> {
        &mut self.planner
    }

    /// Gives lines to the planner while it has room for what they may queue; `false` when the
    /// program has ended.
    ///
    /// # Errors
    /// The first line that is refused. What was queued before it may have moved: [`check`]
    /// the program first.
    pub fn feed<'p>(
        &mut self,
        lines: &mut impl Iterator<Item = &'p str>,
    ) -> Result<bool, LineError> {
        while self.planner.has_room() {
            let Some(line) = lines.next() else {
                return Ok(false);
            };
            let accepted = self.planner.line(line.as_bytes())?;
            if let Some(pose) = accepted.reference {
                self.motion.obey(Order::Place(pose));
            }
            if accepted.ended {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Passes an order to the motion.
    pub fn obey(&mut self, order: Order) {
        self.motion.obey(order);
    }

    /// The setpoint of the next tick.
    pub fn tick(&mut self) -> Setpoint {
        self.motion.tick()
    }

    /// Whether nothing is queued or under way.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.motion.is_empty()
    }

    /// Runs a program to its end and hands each tick's setpoint to `each`.
    ///
    /// The queue is kept full, as a sender does that heeds `ok`; motion starts when the queue
    /// is full or the program has ended. The first setpoint is the one at rest where the
    /// motion starts, the last one its end at rest.
    ///
    /// # Errors
    /// See [`Controller::feed`].
    pub fn run(&mut self, program: &str, each: impl FnMut(&Setpoint)) -> Result<(), LineError> {
        self.run_with_orders(program, |_| None, each)
    }

    /// The same, with an order before any tick, whose number `order` is told. A hold has to be
    /// resumed.
    ///
    /// # Errors
    /// See [`Controller::feed`].
    pub fn run_with_orders(
        &mut self,
        program: &str,
        mut order: impl FnMut(usize) -> Option<Order>,
        mut each: impl FnMut(&Setpoint),
    ) -> Result<(), LineError> {
        let mut lines = program.lines();
        let mut more = true;
        for tick in 0.. {
            if more {
                more = self.feed(&mut lines)?;
            }
            self.obey(Order::Start);
            if let Some(order) = order(tick) {
                self.obey(order);
            }
            let setpoint = self.tick();
            if setpoint.state == MotionState::Paused {
                self.obey(Order::Resume);
                continue;
            }
            each(&setpoint);
            if setpoint.state == MotionState::Idle && !more {
                break;
            }
        }
        Ok(())
    }
}
