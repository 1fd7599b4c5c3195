//! The planner: from a line of text to a scheduled segment, or a refusal before anything moves.

use core::fmt;

use crate::chords::{self, Chords};
use crate::config::{ConfigError, Robot, RobotConfig};
use crate::gcode::{
    self, Command, Defaults, Feed, HopMove, Interpreted, Interpreter, Line, MAX_ACTIONS_A_LINE,
    Move, Offsets, ProgramFlow, RobotChange,
};
use crate::hop::{self, Hop, HopConfig, HopError, HopLimits};
use crate::kinematics::{Arm, Elbow, PoseError, SegmentError};
use crate::limits::{BoxRange, Course, Limited};
use crate::path::{PathSegment, Shape};
use crate::pose::{JointPosition, JointUnit, Pose};
use crate::posture::{MoveToFollow, MoveTunings, Tuning};
use crate::prefilter::{AxisSet, Kernel, Prefilter, PrefilterConfig};
use crate::queue::{KERNELS_A_MOVE, SegmentProducer};
use crate::raw::{LONGEST_S, Pace};
use crate::schedule::{Schedule, Timing};
use crate::units::{AngleRad, LengthMm, TICK_S};

/// Places in the look-ahead that a line can take, the changes of a prefilter that follows the mode
/// left out.
pub const PLACES_A_LINE: usize = MAX_ACTIONS_A_LINE + chords::MOST - 1;

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
    /// A limit lowers the feed of its last motion.
    pub limited: Option<Limited>,
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
    /// The prefilter of M100.
    Prefilter(ConfigError),
    /// M100 gives a mode of its own although there is a map.
    MapSaysMode,
    /// The pick-and-place move of M103.
    Hop(HopError),
    /// The segment would take more than a day.
    TooSlow {
        /// How long it would take.
        duration_s: f64,
    },
    /// M101 or M102 on a robot without an elbow.
    NoElbow,
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
                PoseError::Unreachable { .. } | PoseError::ArmUnreachable { .. } => 70,
                PoseError::NearSingular { .. }
                | PoseError::NearSerial { .. }
                | PoseError::NearParallel { .. } => 71,
                PoseError::JointLimit { .. } => 72,
            },
            Cause::Jog(_) => 15,
            Cause::TooSlow { .. } => 73,
            Cause::Full => 74,
            Cause::Prefilter(_) | Cause::MapSaysMode => 76,
            Cause::NoElbow => 79,
            Cause::Hop(_) => 85,
        }
    }
}

impl LineError {
    /// Whether the robot cannot reach what the line asks for.
    #[must_use]
    pub const fn is_out_of_reach(&self) -> bool {
        matches!(self.cause, Cause::Pose(_) | Cause::Segment(_))
    }
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: ", self.line)?;
        match self.cause {
            Cause::Gcode(error) => error.fmt(f),
            Cause::Pose(error) => error.fmt(f),
            Cause::Segment(error) | Cause::Jog(error) => error.fmt(f),
            Cause::Prefilter(error) => error.fmt(f),
            Cause::Hop(error) => error.fmt(f),
            Cause::TooSlow { duration_s } => write!(
                f,
                "the segment would take {duration_s:.0} s, more than a day: give a higher feedrate"
            ),
            Cause::MapSaysMode => f.write_str(
                "the map says frequency and damping: give M100 without Q and R, or remove the map with $map=0",
            ),
            Cause::NoElbow => f.write_str(
                "this robot has no elbow that could change its side: leave out M101 and M102",
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
    robot: &'q mut Robot,
    interpreter: Interpreter,
    /// The state after the lines checked, while lines are checked only.
    checking: Option<Interpreter>,
    schedule: Schedule<'q>,
    /// Where the joints stand, if a joint move was stopped on its way.
    joints: Option<JointPosition>,
    /// By how much the last move may stray from its path, having been an arc and become chords.
    sagitta_mm: f32,
}

/// A move of the joints that changes the elbow's side.
struct ElbowMove {
    elbow: Elbow,
    from: JointPosition,
    to: JointPosition,
    /// Where the tool is at its end.
    pose: Pose,
    duration_s: f64,
}

/// What a pick-and-place move is planned with.
struct HopOrder {
    config: HopConfig,
    limits: HopLimits,
    /// The limit that slows it down.
    limited: Option<Limited>,
}

impl<'q> Planner<'q> {
    /// A planner that has seen no line; the robot's position is not known yet. What it changes of
    /// the robot it changes in the robot's place.
    #[must_use]
    pub fn new(robot: &'q mut Robot, queue: SegmentProducer<'q>) -> Self {
        Self {
            interpreter: Interpreter::new(defaults(robot)),
            robot,
            checking: None,
            schedule: Schedule::new(queue),
            joints: None,
            sagitta_mm: 0.0,
        }
    }

    /// Whether the look-ahead has room for all that a line can ask for. Give one only then.
    #[must_use]
    pub fn has_room(&self) -> bool {
        let places = self.schedule.free_places();
        if self.robot.follower.is_none() && !self.robot.config.prefilter.chooses_axes() {
            return places >= PLACES_A_LINE;
        }
        // a change of the prefilter before each move
        places >= PLACES_A_LINE + 2 && self.schedule.free_kernels() >= KERNELS_A_MOVE
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
    #[inline(never)]
    pub fn execute(&mut self, line: &Line) -> Result<Accepted, LineError> {
        // Not moved out of its result: one copy of it is large enough.
        match &self.interpreter.interpret(line) {
            Ok(interpreted) => self
                .carry_out(interpreted)
                .map_err(|cause| self.refusal(cause)),
            Err(error) => Err(self.refused(*error)),
        }
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
    #[inline(never)]
    pub fn check(&mut self, line: &Line) -> Result<(), LineError> {
        let mut interpreter = self.interpreter().clone();
        let checked = interpreter
            .interpret(line)
            .map_err(Cause::Gcode)
            .and_then(|interpreted| {
                self.check_with_elbow(interpreter.modal().elbow(), &interpreted.command)?;
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

    /// Checks a command with the elbow on the side to which the lines before have brought it.
    #[inline(never)]
    fn check_with_elbow(&self, elbow: Elbow, command: &Command) -> Result<(), Cause> {
        let mut arm = self.robot.arm.clone();
        arm.set_elbow(elbow);
        self.timings(&arm, command).map(drop)
    }

    /// Whether the line would be accepted now; changes nothing but the count of refusals.
    ///
    /// # Errors
    /// [`LineError`] says what is wrong with it and what to do.
    pub fn would_accept(&mut self, line: &Line) -> Result<(), LineError> {
        let interpreted = self.interpreter.interpret(line);
        let interpreted = interpreted.map_err(|error| self.refused(error))?;
        let checked = self.timings(&self.robot.arm, &interpreted.command);
        checked.map(drop).map_err(|cause| self.refusal(cause))
    }

    /// The robot that planning uses.
    #[must_use]
    pub const fn robot(&self) -> &Robot {
        self.robot
    }

    /// Goes on from where the motion has been stopped, the queue being empty.
    pub fn stopped_at(&mut self, pose: Pose) {
        self.interpreter.set_position(Some(pose));
        self.joints = None;
        self.schedule.reset();
    }

    /// Goes on from where a joint move has been stopped, the queue being empty.
    pub fn stopped_at_joints(&mut self, joints: JointPosition) {
        let pose = self.know_joints(&joints);
        self.stopped_at(pose);
        self.joints = Some(joints);
    }

    /// The joints are said to be here, by encoders or limit inputs. Yields the tool's pose,
    /// where the motion has to be placed with [`Planner::robot`].
    pub fn place_joints(&mut self, joints: &JointPosition) -> Pose {
        let pose = self.know_joints(joints);
        self.stopped_at(pose);
        pose
    }

    fn know_joints(&mut self, joints: &JointPosition) -> Pose {
        if let Some(elbow) = self.robot.arm.elbow_at(joints) {
            self.robot.set_elbow(elbow);
            self.interpreter.set_elbow(elbow);
        }
        self.robot.arm.forward(joints)
    }

    /// The position is not known any more.
    pub fn forget_position(&mut self) {
        self.interpreter.set_position(None);
        self.joints = None;
        self.schedule.reset();
    }

    /// Moves the joints in `duration_s`, to find limit inputs: the position is not known then.
    /// The queue has to be empty.
    pub fn move_joints(&mut self, from: JointPosition, to: JointPosition, duration_s: f64) {
        if self.robot.suit(AxisSet::ALL) {
            self.schedule.change_prefilter(&self.robot.kernel);
        }
        let duration_s = self.joint_move_s(&from, &to, duration_s);
        self.schedule.move_joints(from, to, duration_s);
    }

    /// How long a move of the joints takes, `asked_s` or as much as the limits need.
    fn joint_move_s(&self, from: &JointPosition, to: &JointPosition, asked_s: f64) -> f64 {
        if !self.robot.limits.is_set() {
            return asked_s;
        }
        let mut ways = [0.0; 4];
        let bits = from.to_bits().into_iter().zip(to.to_bits());
        let units = self.robot.arm.kind().joint_units();
        for ((way, (from, to)), unit) in ways.iter_mut().zip(bits).zip(units) {
            let unit = match unit {
                JointUnit::Angle => f64::from(AngleRad::DELTA),
                JointUnit::Length => f64::from(LengthMm::DELTA),
            };
            *way = (f64::from(to.abs_diff(from)) * unit) as f32;
        }
        let asked = asked_s.max(TICK_S) as f32;
        let (least_s, _) = self.robot.limits.joint_move_s(ways, asked);
        asked_s.max(f64::from(least_s))
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

    /// Changes the robot's settings. Only while everything stands. Where the position is known
    /// the elbow stays on its side.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of range; nothing is changed then.
    pub fn set_config(&mut self, config: &RobotConfig) -> Result<(), ConfigError> {
        let elbow = self.robot.config.scara.elbow;
        self.robot.set_config(config)?;
        if self.interpreter.modal().position().is_some() {
            self.robot.set_elbow(elbow);
        }
        self.interpreter.set_defaults(defaults(self.robot));
        self.reset_modes();
        self.schedule.reset();
        Ok(())
    }

    fn refusal(&mut self, cause: Cause) -> LineError {
        self.interpreter.skip();
        let line = self.interpreter.modal().lines();
        LineError { line, cause }
    }

    /// Queues the actions of a line, all or none, and commits what it leaves behind.
    fn carry_out(&mut self, interpreted: &Interpreted) -> Result<Accepted, Cause> {
        let command = &interpreted.command;
        let timings = self.timings(&self.robot.arm, command)?;
        if !self.has_room() {
            return Err(Cause::Full);
        }
        let other_timings = self.suit_axes(command)?;
        let changes_prefilter = other_timings.is_some();
        let timings = other_timings.unwrap_or(timings);
        if command.reference.is_some() {
            self.schedule.reset();
            self.joints = None;
        }
        let mut queued = changes_prefilter && self.schedule.change_prefilter(&self.robot.kernel);
        let mut folded = None;
        let mut limited = None;
        match &command.robot {
            Some(RobotChange::Prefilter(config)) => {
                self.robot.set_prefilter(config).map_err(Cause::Prefilter)?;
                queued |= self.schedule.change_prefilter(&self.robot.kernel);
            }
            Some(RobotChange::Elbow(elbow)) => {
                let change = self.elbow_move(&self.robot.arm, *elbow)?;
                folded = change.as_ref().map(|change| change.pose);
                queued |= self.change_elbow(*elbow, change.as_ref());
            }
            Some(RobotChange::Hop(_)) | None => {}
        }
        let hop = command.hop();
        let moves_tool =
            command.dwell_s.is_some() || command.moves().next().is_some() || hop.is_some();
        if moves_tool && self.joints.take().is_some() {
            let position = self.interpreter.modal().position();
            queued |= self
                .schedule
                .return_to_tool(position, self.robot.config.scara.elbow);
        }
        if let Some(outputs) = command.outputs {
            queued |= self.schedule.switch(outputs);
        }
        if let Some(duration_s) = command.dwell_s {
            queued |= self.stand_still(f64::from(duration_s));
        }
        if let Some(order) = hop {
            let (planned, slowed) = self.plan_hop(order)?;
            queued |= planned;
            limited = slowed;
        }
        for (order, timing) in command.moves().zip(&timings) {
            queued |= timing.duration_s > 0.0 && self.plan_move(order, timing);
            limited = self.schedule.limited();
        }
        if let Some(outputs) = command.outputs_after {
            queued |= self.schedule.switch(outputs);
        }
        self.interpreter.commit(interpreted);
        if folded.is_some() {
            self.interpreter.set_position(folded);
        }
        if command.flow == Some(ProgramFlow::Pause) {
            queued |= self.schedule.pause();
        }
        Ok(Accepted {
            reference: command.reference,
            queued,
            offset_changed: interpreted.moves_work_zero(),
            offsets_stored: interpreted.stores_offsets(),
            ended: command.flow == Some(ProgramFlow::End),
            limited,
        })
    }

    /// Puts the prefilters in force that a command needs on its axes, and yields how long its
    /// motions take then; nothing where they are in force. The path has to come to rest before
    /// the command then.
    ///
    /// One that is needed is added wherever that is; one that is not needed any more is left
    /// out only where the path stands anyway.
    #[inline(never)]
    fn suit_axes(&mut self, command: &Command) -> Result<Option<[Timing; 2]>, Cause> {
        let before = self.robot.along;
        let along = match (&command.robot, command.moves().next()) {
            // joints take the tool along all axes, hops have axes of their own
            (Some(RobotChange::Elbow(_) | RobotChange::Hop(_)), _) => AxisSet::ALL,
            (_, Some(first)) => {
                let axes = command.moves().map(|order| order.path.axes());
                let axes = axes.fold(AxisSet::NONE, AxisSet::with);
                let from_rest = command.outputs.is_some()
                    || command.dwell_s.is_some()
                    || self.schedule.begins_from_rest(first.corner);
                if from_rest { axes } else { axes.with(before) }
            }
            _ => return Ok(None),
        };
        if along == AxisSet::NONE || !self.robot.suit(along) {
            return Ok(None);
        }
        match self.timings(&self.robot.arm, command) {
            Ok(timings) => Ok(Some(timings)),
            Err(cause) => {
                self.robot.suit(before);
                Err(cause)
            }
        }
    }

    /// Queues a pick-and-place move, with the prefilter that is in force.
    #[inline(never)]
    fn plan_hop(&mut self, order: &HopMove) -> Result<(bool, Option<Limited>), Cause> {
        let HopOrder {
            config,
            limits,
            limited,
        } = self.checked_hop(&self.robot.arm, order)?;
        let hop = self.hop_of(order, &config, &limits).map_err(Cause::Hop)?;
        Ok((self.schedule.hop(&hop, order.line), limited))
    }

    /// Queues a move, a short arc of a chain by chords unless the prefilter follows a map: the stack
    /// holds what either needs.
    fn plan_move(&mut self, order: &Move, timing: &Timing) -> bool {
        let is_arc = matches!(order.path.shape, Shape::Arc(_));
        if self.robot.follower.is_some() || !is_arc && self.sagitta_mm == 0.0 {
            return self.plan_segment(order, timing);
        }
        self.plan_chords(order, timing)
    }

    /// Queues an arc, or what follows chords.
    #[inline(never)]
    fn plan_chords(&mut self, order: &Move, timing: &Timing) -> bool {
        let order = Move {
            corner: order.corner.tightened(self.sagitta_mm),
            ..*order
        };
        let Some(chords) = self.chords(&order, timing) else {
            self.sagitta_mm = 0.0;
            return self.plan_segment(&order, timing);
        };
        self.sagitta_mm = chords.sagitta_mm as f32;
        let share = 1.0 / f64::from(chords.count);
        let mut timing = Timing {
            duration_s: share * timing.duration_s,
            shortest_s: share * timing.shortest_s,
            ..*timing
        };
        let mut boxes = self.robot.limits.box_range();
        let mut queued = false;
        for number in 0..chords.count {
            let chord = chords.chord(&order, number);
            if self.robot.limits.is_set() {
                self.limit(&chord.path, &mut timing, &mut boxes);
            }
            queued |= self.plan_segment(&chord, &timing);
        }
        queued
    }

    /// The chords that go faster than a move's arc.
    ///
    /// An arc that lasts as long as the prefilter has corners far enough apart. A shorter one
    /// waits for the filters to leave an arc before it, for about half of that.
    fn chords(&self, order: &Move, timing: &Timing) -> Option<Chords> {
        let length_s = f64::from(self.robot.accelerating.length_s());
        if timing.duration_s >= length_s {
            return None;
        }
        let chords = Chords::of(order, self.robot.accelerating.spread_s().into())?;
        let is_chain = self.sagitta_mm > 0.0 || self.schedule.follows_arc();
        let is_faster = chords.steady_s <= timing.duration_s + 0.5 * length_s;
        (is_faster && (is_chain || chords.count == 1)).then_some(chords)
    }

    /// Queues a line or an arc, with the prefilters that the map asks for.
    fn plan_segment(&mut self, order: &Move, timing: &Timing) -> bool {
        let (queued, next) = self.queue_move(order, timing);
        if let Some(tuning) = next {
            // its taps have been made before: this does not fail
            let _ = self.robot.tune(&tuning);
        }
        queued
    }

    /// Queues a move that may change the prefilter on its way, and yields what is in force at
    /// its end then.
    #[inline(never)]
    fn queue_move(&mut self, order: &Move, timing: &Timing) -> (bool, Option<Tuning>) {
        let next = self.follow(order, timing);
        let queued = self.schedule.plan(
            self.robot,
            &order.path,
            timing,
            order.corner,
            order.line,
            next.as_ref().map(|(_, kernel)| kernel),
        );
        (queued, next.map(|(tuning, _)| tuning))
    }

    /// Changes the prefilter before a move from rest as the map asks for, and yields the one
    /// to which it is to change on the move's way. The second move of a line keeps the prefilter
    /// if the first one has taken the last places for kernels.
    #[inline(never)]
    fn follow(&mut self, order: &Move, timing: &Timing) -> Option<(Tuning, Kernel)> {
        let follower = self.robot.follower.as_ref()?;
        if self.schedule.free_kernels() < KERNELS_A_MOVE {
            return None;
        }
        let from_rest = self.schedule.begins_from_rest(order.corner);
        let step = MoveToFollow {
            course: follower.course(&order.path),
            duration_s: timing.duration_s.max(timing.least_s.into()),
            from_rest,
            is_line: matches!(order.path.shape, Shape::Line),
            after_arc: !from_rest && self.schedule.follows_arc(),
            in_force_s: self.robot.accelerating.length_s().into(),
        };
        let MoveTunings { start, end } = follower.tunings(&step, &self.robot.tuning);
        if !start.is_near(&self.robot.tuning) && self.robot.tune(&start).is_ok() {
            self.schedule.change_prefilter(&self.robot.kernel);
        }
        if end.is_near(&self.robot.tuning) {
            return None;
        }
        // a map whose slowest mode has a prefilter has one for every mode
        Some((end, kernel_of(&end)?))
    }

    /// Changes the elbow's side, by a move of the joints where the position is known.
    fn change_elbow(&mut self, elbow: Elbow, change: Option<&ElbowMove>) -> bool {
        let is_known = self.interpreter.modal().position().is_some();
        let is_other = elbow != self.robot.config.scara.elbow;
        self.robot.set_elbow(elbow);
        match change {
            Some(change) => {
                self.joints = None;
                self.schedule
                    .move_joints(change.from, change.to, change.duration_s)
                    && self
                        .schedule
                        .return_to_tool(Some(change.pose), change.elbow)
            }
            None => is_other && !is_known && self.schedule.return_to_tool(None, elbow),
        }
    }

    /// The move of the joints that brings the elbow to a side with the tool where it is. An arm
    /// that was stopped near its stretched pose folds as far as the margin asks.
    /// Not inlined, so that the other arm is on the stack for a moment only.
    #[inline(never)]
    fn elbow_move(&self, arm: &Arm, elbow: Elbow) -> Result<Option<ElbowMove>, Cause> {
        let Arm::Scara(scara) = arm else {
            return Err(Cause::NoElbow);
        };
        let Some(position) = self.interpreter.modal().position() else {
            return Ok(None);
        };
        if elbow == self.robot.config.scara.elbow && self.joints.is_none() {
            return Ok(None);
        }
        let from = self.joints.unwrap_or_else(|| scara.inverse(&position));
        let mut scara = scara.clone();
        scara.set_elbow(elbow);
        let (pose, to) = match (scara.check(&position), self.joints) {
            (Ok(to), _) => (position, to),
            (Err(_), Some(joints)) => {
                let pose = scara.folded(&joints);
                (pose, scara.check(&pose).map_err(Cause::Pose)?)
            }
            (Err(error), None) => return Err(Cause::Pose(error)),
        };
        let ways = from.to_bits().into_iter().zip(to.to_bits());
        let furthest = ways.map(|(from, to)| to.abs_diff(from)).max().unwrap_or(0);
        let furthest_rad = f64::from(AngleRad::DELTA) * f64::from(furthest);
        let speed_rad_s = f64::from(self.robot.config.joint_speed_deg_s).to_radians();
        let duration_s = self.joint_move_s(&from, &to, furthest_rad / speed_rad_s);
        Ok(Some(ElbowMove {
            elbow,
            from,
            to,
            pose,
            duration_s,
        }))
    }

    /// How long each motion of a line takes, once the robot can do all that the line asks for.
    fn timings(&self, arm: &Arm, command: &Command) -> Result<[Timing; 2], Cause> {
        match &command.robot {
            Some(RobotChange::Prefilter(config)) => {
                self.check_prefilter(config)?;
            }
            Some(RobotChange::Elbow(elbow)) => {
                self.elbow_move(arm, *elbow)?;
            }
            Some(RobotChange::Hop(order)) => {
                self.checked_hop(arm, order)?;
            }
            None => {}
        }
        if let Some(pose) = &command.reference {
            arm.check(pose).map_err(Cause::Pose)?;
        }
        // A dwell stands where a move may begin only.
        if let (Some(_), Some(pose), Some(_)) = (
            self.joints,
            self.interpreter.modal().position(),
            command.dwell_s,
        ) {
            arm.check(&pose).map_err(Cause::Pose)?;
        }
        let mut timings = [Timing::default(); 2];
        // the second move begins with what the first one has changed to
        let mut boxes = self.robot.limits.box_range();
        for (order, timing) in command.moves().zip(&mut timings) {
            *timing = self.checked_timing(arm, order, &mut boxes)?;
        }
        Ok(timings)
    }

    /// Whether the prefilter can be changed to these settings.
    fn check_prefilter(&self, config: &PrefilterConfig) -> Result<(), Cause> {
        let own = &self.robot.config.prefilter;
        let says_mode = (config.frequency_hz, config.damping) != (own.frequency_hz, own.damping);
        if self.robot.config.map.is_complete() && says_mode {
            return Err(Cause::MapSaysMode);
        }
        self.robot.check_prefilter(config).map_err(Cause::Prefilter)
    }

    /// What to plan a pick-and-place move with that the arm can drive: up, across at the top and at
    /// the end of the vertical parts, and down. Not inlined, as [`Planner::elbow_move`].
    #[inline(never)]
    fn checked_hop(&self, arm: &Arm, order: &HopMove) -> Result<HopOrder, Cause> {
        let own = self.robot.config.hop;
        let wanted = HopConfig {
            height_mm: order.height_mm.unwrap_or(own.height_mm),
            rise_mm: order.rise_mm.unwrap_or(own.rise_mm),
            tolerance_mm: order.tolerance_mm.unwrap_or(own.tolerance_mm),
            acceleration_mm_s2: order.acceleration_mm_s2.unwrap_or(own.acceleration_mm_s2),
            axes: own.axes,
        };
        wanted.check().map_err(Cause::Hop)?;
        let mut limits = HopLimits {
            feed_mm_s: self.robot.config.feed_limit_mm_s,
            yaw_deg_s: self.robot.config.yaw_limit_deg_s,
            slowdown: None,
        };
        let limited = self.slow_hop(order, &wanted, &mut limits);
        let peaks = hop::peaks(&order.start, &order.target, &wanted, &limits);
        let duration_s = peaks.apart_s;
        if duration_s > LONGEST_S {
            return Err(Cause::TooSlow { duration_s });
        }
        for [start, target] in hop::outline(order.start, order.target, &wanted) {
            let line = PathSegment {
                start,
                target,
                shape: Shape::Line,
            };
            arm.check_segment(&line).map_err(Cause::Segment)?;
        }
        Ok(HopOrder {
            config: wanted,
            limits,
            limited,
        })
    }

    /// Slows a pick-and-place move down for the limits of motion, and says for which.
    #[inline(never)]
    fn slow_hop(
        &self,
        order: &HopMove,
        wanted: &HopConfig,
        limits: &mut HopLimits,
    ) -> Option<Limited> {
        if !self.robot.limits.is_set() {
            return None;
        }
        let slowed = |slowdown: f64| HopLimits {
            slowdown: Some(slowdown),
            ..*limits
        };
        let (start, target) = (order.start, order.target);
        let peaks = |slowdown| hop::peaks(&start, &target, wanted, &slowed(slowdown));
        let low = start.z.min(target.z);
        let across = PathSegment {
            start: Pose { z: low, ..start },
            target: Pose { z: low, ..target },
            shape: Shape::Line,
        };
        let course = Course::new(&across, self.robot.limits.kind());
        let rise_mm = wanted.rise_mm + (start.z.max(target.z) - low).to_num::<f32>();
        let found = self.robot.limits.hop_slowdown(&course, rise_mm, peaks);
        let (asked, takes) = (peaks(1.0), peaks(found.slowdown));
        let limited = found.bound.map(|bound| Limited {
            bound,
            asked_s: asked.apart_s,
            takes_s: takes.apart_s,
            length_mm: takes.length_mm,
        });
        *limits = slowed(found.slowdown);
        limited
    }

    /// A pick-and-place move with the prefilter that is in force. Not inlined, so that the
    /// prefilter is on the stack for a moment only.
    #[inline(never)]
    fn hop_of(
        &self,
        order: &HopMove,
        wanted: &HopConfig,
        limits: &HopLimits,
    ) -> Result<Hop, HopError> {
        let mut prefilter = Prefilter::NONE;
        self.robot.put_prefilter(&mut prefilter);
        hop::plan(order.start, order.target, wanted, limits, &prefilter)
    }

    /// How long a motion takes; zero if it is shorter than anything. To the boxes that may be in
    /// force before it, it adds those that may be on its way.
    fn checked_timing(
        &self,
        arm: &Arm,
        order: &Move,
        boxes: &mut BoxRange,
    ) -> Result<Timing, Cause> {
        let mut timing = self.timing(&order.path, order.feed);
        if timing.duration_s > 0.0 && timing.duration_s <= LONGEST_S {
            let checked = arm.check_segment(&order.path);
            checked.map_err(Cause::Segment)?;
            if self.robot.limits.is_set() {
                self.limit(&order.path, &mut timing, boxes);
            }
        }
        // A segment that may not take its full feed takes half of it at the least.
        let duration_s = timing.duration_s.max(2.0 * f64::from(timing.least_s));
        if duration_s > LONGEST_S {
            return Err(Cause::TooSlow { duration_s });
        }
        Ok(timing)
    }

    /// How long a segment takes at the robot's limits of motion, whichever prefilters it gets.
    /// Not inlined, as [`Planner::elbow_move`].
    #[inline(never)]
    fn limit(&self, path: &PathSegment, timing: &mut Timing, boxes: &mut BoxRange) {
        // what the highest override could make of it
        let hurried_s = (0.5 * timing.duration_s).max(timing.shortest_s);
        let asked_s = hurried_s.max(TICK_S) as f32;
        let course = Course::new(path, self.robot.limits.kind());
        let limits = &self.robot.limits;
        (timing.least_s, timing.bound) = match &self.robot.follower {
            Some(follower) if limits.needs_boxes() => {
                follower.add_boxes(boxes, &follower.course(path));
                limits.within(boxes).least_s(&course, asked_s)
            }
            _ => limits.least_s(&course, asked_s),
        };
    }

    /// Stops, then stands for so long; where the position is unknown nothing has moved.
    /// Whether anything was queued.
    fn stand_still(&mut self, duration_s: f64) -> bool {
        let position = self.interpreter.modal().position();
        position.is_some_and(|pose| self.schedule.dwell(pose, duration_s))
    }

    /// How long a segment takes: at its feedrate, and no faster than feedrate and yaw limits.
    ///
    /// A segment that only turns takes its feedrate in °/s.
    fn timing(&self, path: &PathSegment, feed: Feed) -> Timing {
        let config = &self.robot.config;
        let (length_mm, turn_deg) = (path.length_mm(), libm::fabs(path.turn_deg()));
        let shortest_s = (length_mm / f64::from(config.feed_limit_mm_s))
            .max(turn_deg / f64::from(config.yaw_limit_deg_s));
        let way = if length_mm > 0.0 { length_mm } else { turn_deg };
        let (wanted_s, pace) = match feed {
            Feed::Rapid => (way / f64::from(config.rapid_mm_s), Pace::Rapid),
            Feed::MmPerS(feed) => (way / f64::from(feed), Pace::Feed),
            Feed::Seconds(duration_s) => (f64::from(duration_s), Pace::Feed),
        };
        let is_move = way > 0.0;
        Timing {
            duration_s: if is_move {
                wanted_s.max(shortest_s)
            } else {
                0.0
            },
            shortest_s,
            pace,
            least_s: 0.0,
            bound: None,
        }
    }
}

/// The taps of a tuning. Not inlined, so that the prefilter is on the stack for a moment only.
#[inline(never)]
fn kernel_of(tuning: &Tuning) -> Option<Kernel> {
    let mut prefilter = Prefilter::NONE;
    tuning.make(&mut prefilter).ok()?;
    Kernel::new(&prefilter).ok()
}

fn defaults(robot: &Robot) -> Defaults {
    Defaults {
        corner: robot.config.corner(),
        prefilter: robot.config.prefilter,
        elbow: robot.config.scara.elbow,
        first_point_declares: true,
    }
}
