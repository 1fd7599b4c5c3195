//! The tick: from the raw path to joint setpoints, once a millisecond.

use crate::arcs::{ARC_CHANNELS, ArcFilters, Arcs};
use crate::config::Robot;
use crate::kinematics::Scara;
use crate::pose::{AXES, JointState, Pose};
use crate::prefilter::{Convolver, FINE_BITS, Kernel};
use crate::raw::SegmentConsumer;

use crate::units::TICK_HZ;
use crate::walker::Walker;

/// Whether the robot moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionState {
    /// Everything stands; queued segments wait for [`Motion::start`].
    #[default]
    Idle,
    /// The raw path or what the prefilter still holds of it moves the robot.
    Running,
}

/// What a tick yields.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setpoint {
    /// The commanded pose of the tool centre point.
    pub pose: Pose,
    /// What the joints have to do.
    pub joints: JointState,
    /// Whether the robot moves.
    pub state: MotionState,
}

/// The delay lines of the filters: most of the core's memory, 25 KiB, apart from [`Motion`] so
/// that it can be placed where large zeroed memory belongs.
#[derive(Debug, Default)]
pub struct DelayLines {
    lines: Convolver<AXES>,
    arcs: ArcFilters,
}

impl DelayLines {
    /// Delay lines at rest at zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            lines: Convolver::new(),
            arcs: [const { Convolver::new() }; ARC_CHANNELS],
        }
    }
}

/// Executes the raw path: owned by the control task, called once a tick.
///
/// The raw point's lines and chords go through one filter, the progress of each arc through
/// one of its own, from which follows the arc's bow. Their sum is the command; velocity and
/// acceleration are its central differences, one tick behind the newest point.
///
/// [`Motion::tick`] cannot fail, does not allocate, and costs the same whatever the filter's
/// length and the number of segments in flight: below 2 000 instructions on a
/// Cortex-M4F, and below 2 500 while two arcs overlap.
pub struct Motion<'q> {
    walker: Walker<'q>,
    kernel: Kernel,
    kinematics: Scara,
    filters: &'q mut DelayLines,
    arcs: Arcs,
    /// Commands of the last two ticks in 2^-32 mm, oldest first.
    history: [[i64; AXES]; 2],
    state: MotionState,
    /// Ticks since the raw path ended.
    done_for: u16,
}

impl<'q> Motion<'q> {
    /// At rest at the origin of the robot's frame.
    #[must_use]
    pub fn new(robot: &Robot, segments: SegmentConsumer<'q>, filters: &'q mut DelayLines) -> Self {
        let start = Pose::default().to_bits();
        filters.lines.reset(start);
        Self {
            walker: Walker::new(segments, start),
            kernel: robot.kernel.clone(),
            kinematics: robot.scara.clone(),
            filters,
            arcs: Arcs::default(),
            history: [[0; AXES]; 2],
            state: MotionState::Idle,
            done_for: 0,
        }
    }

    /// Takes the tool to be at `pose`. Only while idle; otherwise nothing happens.
    pub fn place(&mut self, pose: Pose) {
        if self.state == MotionState::Idle {
            let point = pose.to_bits();
            self.walker.place(point);
            self.filters.lines.reset(point);
            self.history = [point.map(|value| i64::from(value) << FINE_BITS); 2];
        }
    }

    /// Changes the robot's settings. Only while idle; otherwise nothing happens.
    pub fn set_robot(&mut self, robot: &Robot) {
        if self.state == MotionState::Idle {
            self.kernel = robot.kernel.clone();
            self.kinematics = robot.scara.clone();
            let [_, rest] = self.history;
            self.filters
                .lines
                .reset(rest.map(|value| (value >> FINE_BITS) as i32));
        }
    }

    /// Begins to execute what is queued, if anything is; the robot goes idle when the queue
    /// runs dry and everything stands.
    pub fn start(&mut self) {
        if !self.walker.is_done() {
            self.state = MotionState::Running;
        }
    }

    /// The setpoint of this tick.
    #[must_use]
    pub fn tick(&mut self) -> Setpoint {
        let newest = match self.state {
            MotionState::Idle => self.history[1],
            MotionState::Running => self.command(),
        };
        let [before, now] = self.history;
        self.history = [now, newest];
        let pose = Pose::from_bits(now.map(|value| round_off(value) as i32));
        let coming = difference(&newest, &now);
        let going = difference(&now, &before);
        let velocity = sum(&coming, &going).map(velocity_of);
        let acceleration = difference(&coming, &going).map(acceleration_of);
        Setpoint {
            pose,
            joints: self.kinematics.joint_state(&pose, velocity, acceleration),
            state: self.state,
        }
    }

    /// Whether a running robot has come to the end of the queued path, so that it slows down
    /// although more may be on its way.
    #[must_use]
    pub fn is_out_of_path(&self) -> bool {
        self.state == MotionState::Running && self.walker.is_done()
    }

    /// The newest command in 2^-32 mm: one tick of the raw path, filtered.
    fn command(&mut self) -> [i64; AXES] {
        let raw = self.walker.step(self.arcs.has_room());
        let [x, y, z, c] = self.filters.lines.process(&self.kernel, raw.chord);
        let [bow_x, bow_y] = self.arcs.step(&mut self.filters.arcs, &self.kernel, &raw);
        if self.walker.is_done() {
            self.done_for = self.done_for.saturating_add(1);
            // the filters and then the two ticks of history have settled
            if self.done_for > self.kernel.length_ticks() + 2 {
                self.state = MotionState::Idle;
            }
        } else {
            self.done_for = 0;
        }
        [x.wrapping_add(bow_x), y.wrapping_add(bow_y), z, c]
    }
}

fn sum(a: &[i64; AXES], b: &[i64; AXES]) -> [i64; AXES] {
    core::array::from_fn(|axis| a[axis].wrapping_add(b[axis]))
}

fn difference(a: &[i64; AXES], b: &[i64; AXES]) -> [i64; AXES] {
    core::array::from_fn(|axis| a[axis].wrapping_sub(b[axis]))
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
