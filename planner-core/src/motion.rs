//! The tick: from the raw path to joint setpoints, once a millisecond.

use core::array;

use crate::arcs::{ArcFilter, Arcs};
use crate::changeover::Changeover;
use crate::config::Robot;
use crate::joint_space::{self, Space};
use crate::kinematics::{Arm, ArmKind, Elbow};
use crate::pose::{AXES, JointPosition, JointState, Pose};
use crate::prefilter::{Convolver, ConvolverPair, FINE_BITS, Kernel};
use crate::queue::{Action, RawItem, SegmentConsumer};
use crate::rate::Rate;
use crate::units::TICK_HZ;
use crate::walker::{MayBegin, Rates, Walker};

/// Whether the robot moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionState {
    /// Everything stands; what is queued waits for [`Order::Start`].
    #[default]
    Idle,
    /// The raw path or what the prefilter still holds of it moves the robot.
    Running,
    /// The raw path has been stopped, by [`Order::Hold`] or [`Order::Stop`]; the prefilter
    /// settles.
    Stopping,
    /// Everything stands on the path; [`Order::Resume`] goes on.
    Held,
    /// The same, because the program said so (M0).
    Paused,
}

/// What may be asked of the motion, at any time. An order that makes no sense in the state of
/// the moment has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The tool is here. Only while everything stands and nothing is under way.
    Place(Pose),
    /// Execute what is queued, if anything is; the robot goes idle when the queue runs dry and
    /// everything stands.
    Start,
    /// Stop on the path as soon as possible.
    Hold,
    /// Go on from a hold or a pause; otherwise as [`Order::Start`].
    Resume,
    /// Stop on the path as soon as possible, then forget what is queued and go idle.
    Stop,
    /// As [`Order::Start`], and as [`Order::Stop`] in the tick in which a limit input is as
    /// wanted: [`Progress::touched`] tells where.
    Seek {
        /// Which limit input, from 0.
        joint: u8,
        /// Whether it is wanted active.
        active: bool,
    },
    /// Go faster or slower from now on.
    Rates {
        /// Part of the programmed feedrates, 10 to 200 %.
        feed_percent: u16,
        /// Part of the rapid's feedrate, up to 100 %.
        rapid_percent: u8,
    },
}

/// What a tick yields.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setpoint {
    /// The commanded pose of the tool centre point.
    pub pose: Pose,
    /// What the joints have to do.
    pub joints: JointState,
    /// Whose joints these are, which tells their units.
    pub arm: ArmKind,
    /// Whether the robot moves.
    pub state: MotionState,
    /// The digital outputs: bit 0 the gripper, bit 1 the blow-off.
    pub outputs: u8,
    /// The position was set in this tick, not moved to: by [`Order::Place`] or by other settings.
    pub placed: bool,
}

/// How far the motion has come, apart from its setpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The number of the line under way; that of the last one while nothing is.
    pub line: u32,
    /// What the raw path moves.
    pub space: Space,
    /// Where its joint was when the limit input of the last [`Order::Seek`] was as wanted, in
    /// bits of [`JointPosition`].
    pub touched: Option<i32>,
}

/// A limit input that is waited for.
#[derive(Clone, Copy, Debug)]
struct Seek {
    joint: u8,
    active: bool,
}

/// What the motion has to know of a robot: so little that it can be handed over.
#[derive(Clone, Debug)]
pub struct MotionSettings {
    kernel: Kernel,
    arm: Arm,
    /// Whether prefilters change on the way.
    changes_over: bool,
}

impl From<&Robot> for MotionSettings {
    fn from(robot: &Robot) -> Self {
        Self {
            kernel: robot.kernel.clone(),
            arm: robot.arm.clone(),
            changes_over: robot.follower.is_some(),
        }
    }
}

/// The delay lines of the filters: most of the core's memory, 25 KiB, apart from [`Motion`] so
/// that it can be placed where large zeroed memory belongs.
#[derive(Debug, Default)]
pub struct DelayLines {
    lines: ConvolverPair<AXES>,
    arcs: ArcFilter,
}

impl DelayLines {
    /// Delay lines at rest at zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            lines: ConvolverPair::new(),
            arcs: Convolver::new(),
        }
    }
}

/// Executes the raw path: owned by the control task, called once a tick.
///
/// The raw point's lines and chords go through one filter, the progress of each arc through
/// one of its own, from which follows the arc's bow. Their sum is the command; velocity and
/// acceleration are its central differences, one tick behind the newest point. While the
/// prefilter changes on the way, the raw point goes through the next one's filter besides.
///
/// [`Motion::tick`] cannot fail, does not allocate, and costs the same whatever the filter's
/// length and the number of segments in flight: below 2 000 instructions on a
/// Cortex-M4F, and below 2 500 while two arcs overlap or the prefilter changes.
pub struct Motion<'q> {
    walker: Walker<'q>,
    changeover: Changeover,
    kinematics: Arm,
    filters: &'q mut DelayLines,
    arcs: Arcs,
    /// Commands of the last two ticks in 2^-32 mm, oldest first.
    history: [[i64; AXES]; 2],
    mode: Mode,
    /// Ticks since the raw path last moved.
    stood_for: u16,
    outputs: u8,
    space: Space,
    /// Limit inputs of joints 1 to 4, from bit 0.
    limits: u8,
    seek: Option<Seek>,
    touched: Option<i32>,
    placed: bool,
}

/// What the motion is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Nothing. To running by a start, to held by a hold.
    Idle,
    /// Walking the raw path. To idle when the queue has run dry and everything stands, to
    /// paused when the path says so, to holding by a hold, to stopping by a stop.
    Running,
    /// The raw path is held, the filters settle. Then to held; to running by a resume.
    Holding,
    /// Likewise. Then to forgetting.
    Stopping,
    /// Everything stands, on the path. To running by a resume, to forgetting by a stop.
    Held,
    /// Likewise.
    Paused,
    /// Everything stands, and the queue is being emptied. Then to idle.
    Forgetting,
}

/// Queued segments that a tick forgets after a stop: so few that it costs less than a tick of
/// motion.
const FORGOTTEN_A_TICK: usize = 8;

impl<'q> Motion<'q> {
    /// At rest at the origin of the robot's frame.
    #[must_use]
    pub fn new(robot: &Robot, segments: SegmentConsumer<'q>, filters: &'q mut DelayLines) -> Self {
        let start = Pose::default().to_bits();
        let mut changeover = Changeover::new(&robot.kernel);
        filters.lines.share(robot.follower.is_some());
        changeover.rest_at(&mut filters.lines, start);
        Self {
            walker: Walker::new(segments, start),
            changeover,
            kinematics: robot.arm.clone(),
            filters,
            arcs: Arcs::default(),
            history: [[0; AXES]; 2],
            mode: Mode::Idle,
            stood_for: u16::MAX,
            outputs: 0,
            space: Space::Tool,
            limits: 0,
            seek: None,
            touched: None,
            placed: false,
        }
    }

    /// The limit inputs of joints 1 to 4, from bit 0, as they are before the next tick.
    pub fn see_limits(&mut self, limits: u8) {
        self.limits = limits;
    }

    /// Does what is asked, from this tick on.
    pub fn obey(&mut self, order: Order) {
        match order {
            Order::Place(pose) => self.place(pose),
            Order::Start => self.start(),
            Order::Hold => self.hold(),
            Order::Resume => self.resume(),
            Order::Stop => self.stop(),
            Order::Seek { joint, active } => {
                self.touched = None;
                self.seek = Some(Seek { joint, active });
                self.start();
            }
            Order::Rates {
                feed_percent,
                rapid_percent,
            } => self.walker.set_rates(Rates {
                feed: Rate::from_percent(feed_percent.clamp(10, 200)),
                rapid: Rate::from_percent(u16::from(rapid_percent).clamp(1, 100)),
            }),
        }
    }

    /// Changes the robot's settings. Only while idle; otherwise nothing happens.
    pub fn set_robot(&mut self, robot: &MotionSettings) {
        if self.mode == Mode::Idle {
            let pose = self.pose();
            let joints = self.kinematics.inverse(&pose);
            let kind = self.kinematics.kind();
            self.changeover.set_kernel(robot.kernel.clone());
            self.filters.lines.share(robot.changes_over);
            self.kinematics = robot.arm.clone();
            self.rest_at(self.nearest_point());
            // Another arm at the same pose, or with joints of another kind.
            self.placed |= match self.space {
                Space::Tool => self.kinematics.inverse(&pose) != joints,
                Space::Joints => kind != self.kinematics.kind(),
            };
        }
    }

    fn place(&mut self, pose: Pose) {
        let stands = match self.mode {
            Mode::Idle => true,
            Mode::Held | Mode::Paused => self.walker.is_done(),
            Mode::Running | Mode::Holding | Mode::Stopping | Mode::Forgetting => false,
        };
        if stands {
            self.space = Space::Tool;
            self.rest_at(pose.to_bits());
            self.placed = true;
        }
    }

    fn start(&mut self) {
        if self.mode == Mode::Idle && !self.walker.is_done() {
            self.mode = Mode::Running;
        }
    }

    fn hold(&mut self) {
        match self.mode {
            Mode::Idle => self.mode = Mode::Held,
            Mode::Running => self.mode = Mode::Holding,
            Mode::Holding | Mode::Stopping | Mode::Held | Mode::Paused | Mode::Forgetting => {}
        }
    }

    fn resume(&mut self) {
        match self.mode {
            Mode::Idle => self.start(),
            Mode::Holding | Mode::Held | Mode::Paused => self.mode = Mode::Running,
            Mode::Running | Mode::Stopping | Mode::Forgetting => {}
        }
    }

    fn stop(&mut self) {
        match self.mode {
            Mode::Running | Mode::Holding => self.mode = Mode::Stopping,
            Mode::Idle | Mode::Held | Mode::Paused => self.forget(),
            Mode::Stopping | Mode::Forgetting => {}
        }
    }

    /// The setpoint of this tick.
    #[must_use]
    pub fn tick(&mut self) -> Setpoint {
        self.watch_limits();
        let newest = match self.mode {
            Mode::Running | Mode::Holding | Mode::Stopping => self.command(),
            Mode::Idle | Mode::Held | Mode::Paused => self.history[1],
            Mode::Forgetting => {
                self.forget_some();
                self.history[1]
            }
        };
        let (pose, joints) = match self.space {
            Space::Tool => self.move_tool(&newest),
            Space::Joints => self.move_joints(&newest),
        };
        let [before, now] = &mut self.history;
        (*before, *now) = (*now, newest);
        Setpoint {
            pose,
            joints,
            arm: self.kinematics.kind(),
            state: self.state(),
            outputs: self.outputs,
            placed: core::mem::take(&mut self.placed),
        }
    }

    /// The pose of the tick before and what the joints do, when the tool moves on to `newest`.
    fn move_tool(&self, newest: &[i64; AXES]) -> (Pose, JointState) {
        let [before, now] = &self.history;
        let pose = Pose::from_bits(now.map(|value| round_off(value) as i32));
        let velocity = array::from_fn(|axis| velocity_of(twice(newest, before, axis)));
        let acceleration = array::from_fn(|axis| acceleration_of(bend(newest, now, before, axis)));
        let joints = self.kinematics.joint_state(&pose, velocity, acceleration);
        (pose, joints)
    }

    /// The same, when the joints move on to `newest`.
    #[inline(never)]
    fn move_joints(&self, newest: &[i64; AXES]) -> (Pose, JointState) {
        let [before, now] = &self.history;
        let position = JointPosition::from_bits(now.map(|value| round_off(value) as i32));
        let twice = array::from_fn(|axis| twice(newest, before, axis));
        let bend = array::from_fn(|axis| bend(newest, now, before, axis));
        let joints = joint_space::state(self.kinematics.kind(), position, twice, bend);
        (self.kinematics.forward(&position), joints)
    }

    /// How far the motion has come.
    #[must_use]
    pub fn progress(&self) -> Progress {
        Progress {
            line: self.walker.line(),
            space: self.space,
            touched: self.touched,
        }
    }

    /// Stops for good where the limit input that is waited for is as wanted.
    fn watch_limits(&mut self) {
        let moves_joints = self.mode == Mode::Running && self.space == Space::Joints;
        let Some(seek) = self.seek.filter(|_| moves_joints) else {
            return;
        };
        let is_active = self.limits & 1_u8.wrapping_shl(u32::from(seek.joint)) != 0;
        if is_active == seek.active {
            let [sent, _] = self.history;
            let at = sent.get(usize::from(seek.joint)).copied();
            self.touched = at.map(|value| round_off(value) as i32);
            self.stop();
        }
    }

    /// Whether a running robot has come to the end of the queued path, so that it slows down
    /// although more may be on its way.
    #[must_use]
    pub fn is_out_of_path(&self) -> bool {
        self.mode == Mode::Running && self.walker.is_done()
    }

    /// Whether nothing is queued or under way.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.walker.is_done()
    }

    fn state(&self) -> MotionState {
        match self.mode {
            Mode::Idle => MotionState::Idle,
            Mode::Running => MotionState::Running,
            Mode::Holding | Mode::Stopping | Mode::Forgetting => MotionState::Stopping,
            Mode::Held => MotionState::Held,
            Mode::Paused => MotionState::Paused,
        }
    }

    /// The newest command in 2^-32 mm: one tick of the raw path, filtered.
    fn command(&mut self) -> [i64; AXES] {
        self.walker.hold(self.mode != Mode::Running);
        let may_begin = if self.changeover.is_due() {
            MayBegin::None
        } else if self.arcs.has_room() {
            MayBegin::Any
        } else {
            MayBegin::Lines
        };
        let kernel = self.changeover.kernel();
        let raw = self.walker.step(kernel, may_begin);
        let (chord, moved, changes_over) = (raw.chord, raw.moved, raw.changes_over);
        let direct = raw.direct;
        let [bow_x, bow_y] = self.arcs.step(&mut self.filters.arcs, kernel, &raw);
        let mut line = self.changeover.step(&mut self.filters.lines, chord);
        if changes_over {
            self.changeover.expect();
        } else if self.changeover.is_due() {
            self.approach_changeover(line);
        }
        self.stood_for = if moved {
            0
        } else {
            self.stood_for.saturating_add(1)
        };
        // the filters and then the two ticks of history have settled
        let settled = self.stood_for > self.changeover.kernel().delay_ticks() + 1;
        if settled && self.changeover.has_faded() {
            return self.settle(chord);
        }
        if direct != [false; AXES] {
            pass_directly(&mut line, chord, direct);
        }
        let [x, y, ..] = &mut line;
        (*x, *y) = (x.wrapping_add(bow_x), y.wrapping_add(bow_y));
        line
    }

    /// Everything stands at a point of the raw path: what has waited for that happens.
    #[inline(never)]
    fn settle(&mut self, chord: [i32; AXES]) -> [i64; AXES] {
        self.take_expected_kernel();
        self.changeover.come_to_rest(&mut self.filters.lines, chord);
        self.come_to_rest();
        self.history[1]
    }

    /// Takes the kernel that is to come into force on the way of the segment that has begun.
    fn take_expected_kernel(&mut self) {
        if self.changeover.is_expected()
            && let Some(kernel) = self.walker.take_kernel()
        {
            self.changeover.prepare(kernel);
        }
    }

    /// Feeds the filter to come, and changes over to it where that does not show. While an arc
    /// is in flight neither its filters nor the tick's time allow for that.
    #[inline(never)]
    fn approach_changeover(&mut self, line: [i64; AXES]) {
        if !self.arcs.are_clear() {
            return;
        }
        let Some(ahead) = self.changeover.ahead() else {
            return self.take_expected_kernel();
        };
        let seen = self.walker.look_ahead(ahead);
        let lines = &mut self.filters.lines;
        if let Some(jump) = self.changeover.approach(lines, seen, line) {
            self.walker.jump(jump);
        }
    }

    /// What happens when everything stands.
    fn come_to_rest(&mut self) {
        match self.mode {
            Mode::Running => self.act(),
            Mode::Holding => self.mode = Mode::Held,
            Mode::Stopping => self.forget(),
            Mode::Idle | Mode::Held | Mode::Paused | Mode::Forgetting => {}
        }
    }

    /// Carries out the action that waits here, one a tick; idle when nothing more waits.
    fn act(&mut self) {
        match self.walker.take_action() {
            Some(Action::Outputs(outputs)) => self.outputs = outputs,
            Some(Action::Pause) => self.mode = Mode::Paused,
            Some(Action::Prefilter) => self.change_prefilter(),
            Some(Action::ToJoints) => self.enter_joints(),
            Some(Action::ToTool(pose, elbow)) => self.enter_tool(pose, elbow),
            None => {}
        }
        if self.mode == Mode::Running && self.walker.is_done() {
            self.mode = Mode::Idle;
            self.seek = None;
        }
    }

    /// Goes on with joint moves, from where the joints are.
    fn enter_joints(&mut self) {
        if self.space == Space::Tool {
            let pose = Pose::from_bits(self.nearest_point());
            self.space = Space::Joints;
            self.rest_at(self.kinematics.inverse(&pose).to_bits());
        }
    }

    /// Goes on with moves of the tool, which stands at the pose; without one it stands where
    /// the setpoint is, and the elbow is said to be on that side.
    fn enter_tool(&mut self, pose: Option<Pose>, elbow: Elbow) {
        let pose = pose.unwrap_or_else(|| {
            self.placed = true;
            self.pose()
        });
        self.kinematics.set_elbow(elbow);
        self.space = Space::Tool;
        self.rest_at(pose.to_bits());
    }

    /// Where the tool stands.
    fn pose(&self) -> Pose {
        let point = self.nearest_point();
        match self.space {
            Space::Tool => Pose::from_bits(point),
            Space::Joints => self.kinematics.forward(&JointPosition::from_bits(point)),
        }
    }

    /// Stays where everything stands, and begins to empty the queue.
    fn forget(&mut self) {
        self.walker.leave();
        self.rest_at(self.nearest_point());
        self.seek = None;
        self.mode = Mode::Forgetting;
    }

    /// Forgets the oldest of what is queued; idle when nothing is left. Changes of the
    /// prefilter are made all the same: the planner goes on with the last one.
    fn forget_some(&mut self) {
        for _ in 0..FORGOTTEN_A_TICK {
            match self.walker.forget() {
                Some(RawItem::Action(Action::Prefilter)) => self.change_prefilter(),
                Some(RawItem::Segment(segment)) if segment.changes_over => self.change_prefilter(),
                Some(RawItem::Action(_) | RawItem::Segment(_)) => {}
                None => {
                    self.mode = Mode::Idle;
                    return;
                }
            }
        }
    }

    /// Goes on with the next kernel, at rest.
    fn change_prefilter(&mut self) {
        if let Some(kernel) = self.walker.take_kernel() {
            self.changeover.set_kernel(kernel);
            self.rest_at(self.nearest_point());
        }
    }

    /// The command at rest as a pose can tell it. Between the ends of an arc that is not exact.
    fn nearest_point(&self) -> [i32; AXES] {
        let [_, rest] = self.history;
        rest.map(|value| round_off(value) as i32)
    }

    /// Puts everything to rest at a point.
    fn rest_at(&mut self, point: [i32; AXES]) {
        self.walker.place(point);
        self.changeover.rest_at(&mut self.filters.lines, point);
        self.arcs.clear();
        self.history = [point.map(|value| i64::from(value) << FINE_BITS); 2];
        self.stood_for = u16::MAX;
    }
}

/// Puts the raw point in the place of the filter's output on the axes that are not filtered.
#[inline(never)]
fn pass_directly(newest: &mut [i64; AXES], chord: [i32; AXES], direct: [bool; AXES]) {
    for ((value, chord), is_direct) in newest.iter_mut().zip(chord).zip(direct) {
        if is_direct {
            *value = i64::from(chord) << FINE_BITS;
        }
    }
}

/// The change over two ticks.
fn twice(newest: &[i64; AXES], before: &[i64; AXES], axis: usize) -> i64 {
    newest[axis].wrapping_sub(before[axis])
}

/// The second difference.
fn bend(newest: &[i64; AXES], now: &[i64; AXES], before: &[i64; AXES], axis: usize) -> i64 {
    let (coming, going) = (
        newest[axis].wrapping_sub(now[axis]),
        now[axis].wrapping_sub(before[axis]),
    );
    coming.wrapping_sub(going)
}

/// Rounds a command in 2^-32 mm to the pose's 2^-19 mm.
const fn round_off(fine: i64) -> i64 {
    fine.wrapping_add(1 << (FINE_BITS - 1)) >> FINE_BITS
}

/// Velocity in mm/s from the change over two ticks in 2^-32 mm.
///
/// Holds ±256 m/s; the settings allow 10 m/s.
fn velocity_of(change: i64) -> f32 {
    const MM_S_PER_BIT: f32 = TICK_HZ as f32 / 2.0 / (1 << 22) as f32;
    (change >> 10) as i32 as f32 * MM_S_PER_BIT
}

/// Acceleration in mm/s² from the second difference in 2^-32 mm.
///
/// Holds ±32 km/s², a jump of the velocity by 32 m/s in a tick; the settings allow 20.
fn acceleration_of(change: i64) -> f32 {
    const MM_S2_PER_BIT: f32 = (TICK_HZ * TICK_HZ) as f32 / (1 << 26) as f32;
    (change >> 6) as i32 as f32 * MM_S2_PER_BIT
}
