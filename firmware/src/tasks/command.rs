//! The command task: G-code lines and questions in, answers out.
//!
//! Every line gets exactly one `ok` or `error:N`, in order; `ok` means parsed and
//! queued, so it is withheld while the move queue is full.

use core::fmt;

use embassy_time::{Duration, Instant, Timer, with_deadline};
use micromath::F32Ext;
use planner_core::config::{ConfigError, Robot, RobotConfig, SettingError};
use planner_core::gcode::{self, LineBuffer};
use planner_core::motion::{self, MotionState};
use planner_core::planner::{Accepted, Planner};
use planner_core::pose::Pose;
use planner_core::units::TICK_HZ;

use crate::board::{ByteIn, ByteOut, StackUse, Stopwatch, stack_use};
use crate::tasks::cycle_start::CycleStart;
use crate::tasks::inbox::{Inbox, Line, READ_BYTES, RX_BYTES, TooLong};
use crate::tasks::link::{Link, Order, Report};
use crate::tasks::text::Text;

const BANNER: &str = "\r\nGrbl 1.1h ['$' for help]";

/// How often a full move queue is looked at: the motion frees a place at most once a tick.
const ROOM_POLL: Duration = Duration::from_millis(1);

/// Errors of this task's own making, by Grbl's numbers.
mod code {
    pub const BAD_DOLLAR: u8 = 3;
    pub const NOT_IDLE: u8 = 8;
    pub const LINE_OVERFLOW: u8 = 11;
}

const SOFT_RESET: u8 = 0x18;

/// What the command port has sent and not yet been answered; apart from the task, which would
/// be moved about with it.
pub struct Received {
    lines: LineBuffer,
    inbox: Inbox,
}

impl Received {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self {
            lines: LineBuffer::new(),
            inbox: Inbox::new(),
        }
    }
}

impl Default for Received {
    fn default() -> Self {
        Self::new()
    }
}

/// Everything between the command port and the planner.
pub struct Commands<I, O> {
    /// Where commands come from.
    pub input: I,
    /// Where answers go.
    pub output: O,
    /// Where bytes and lines wait.
    pub received: &'static mut Received,
    /// Takes the lines.
    pub planner: &'static mut Planner<'static>,
    /// The settings in force.
    pub config: RobotConfig,
    /// The place of the active robot; absent only while the control task has it.
    pub robot: &'static mut Robot,
    /// To the control task.
    pub link: &'static Link,
    /// Moves that the queue holds, for `$I`.
    pub blocks: usize,
}

/// Serves the command port for ever. `W` says what the ticks are measured in.
pub async fn run<W: Stopwatch>(commands: Commands<impl ByteIn, impl ByteOut>) -> ! {
    let mut session = Session {
        output: commands.output,
        planner: commands.planner,
        config: commands.config,
        robot: Some(commands.robot),
        link: commands.link,
        blocks: commands.blocks,
        cost_unit: W::UNIT,
        received: commands.received,
        cycle_start: CycleStart::new(Instant::now()),
        orders: 0,
    };
    session.serve(commands.input).await
}

struct Session<O> {
    output: O,
    planner: &'static mut Planner<'static>,
    config: RobotConfig,
    robot: Option<&'static mut Robot>,
    link: &'static Link,
    blocks: usize,
    cost_unit: &'static str,
    received: &'static mut Received,
    cycle_start: CycleStart,
    /// Orders given, to be compared with those the control task reports obeyed.
    orders: u32,
}

impl<O: ByteOut> Session<O> {
    async fn serve(&mut self, mut input: impl ByteIn) -> ! {
        let mut bytes = [0; READ_BYTES];
        self.say(format_args!("{BANNER}")).await;
        loop {
            if self.planner.has_room()
                && let Some(line) = self.received.inbox.pop()
            {
                self.answer(line).await;
            }
            let now = Instant::now();
            let full = !self.planner.has_room();
            if self.cycle_start.is_due(now, full) {
                self.order(motion::Order::Start).await;
            }
            // A deadline that is now still takes what the port already has, so that
            // a question is answered between two lines.
            let wake = if full {
                now + ROOM_POLL
            } else if !self.received.inbox.is_empty() {
                now
            } else {
                self.cycle_start.next_check().unwrap_or(Instant::MAX)
            };
            if !self.received.inbox.has_room() {
                Timer::at(wake).await;
            } else if let Ok(count) = with_deadline(wake, input.read(&mut bytes)).await {
                for &byte in bytes.iter().take(count) {
                    self.receive(byte).await;
                }
            }
        }
    }

    async fn receive(&mut self, byte: u8) {
        let realtime = match self.received.lines.push(byte) {
            gcode::Received::Nothing => None,
            gcode::Received::Line => {
                self.received.inbox.push(self.received.lines.line());
                None
            }
            gcode::Received::Overflow => {
                self.received.inbox.push_too_long();
                None
            }
            gcode::Received::Realtime(byte) => Some(byte),
        };
        match realtime {
            Some(b'?') => self.say_status().await,
            Some(SOFT_RESET) => self.soft_reset().await,
            Some(b'!') => self.order(motion::Order::Hold).await,
            Some(b'~') => self.order(motion::Order::Resume).await,
            Some(_) => {}
            // A sender that keeps asking for the status says nothing about moves.
            None => self.cycle_start.heard(Instant::now()),
        }
    }

    /// Every line gets one answer.
    async fn answer(&mut self, line: Result<Line, TooLong>) {
        let Ok(line) = line else {
            return self.say_error(code::LINE_OVERFLOW).await;
        };
        match line.split_first() {
            Some((b'$', command)) => self.dollar(command).await,
            _ => self.gcode(&line).await,
        }
    }

    async fn gcode(&mut self, line: &[u8]) {
        match self.planner.line(line) {
            Ok(accepted) => {
                match accepted {
                    Accepted::Nothing => {}
                    Accepted::Reference(pose) => self.order(motion::Order::Place(pose)).await,
                    Accepted::Queued => {
                        self.link.set_program_open(true);
                        self.cycle_start.queued();
                    }
                    Accepted::End => {
                        self.link.set_program_open(false);
                        self.cycle_start.completed();
                    }
                }
                self.say_ok().await;
            }
            Err(error) => self.refuse(error.code(), error).await,
        }
    }

    async fn dollar(&mut self, command: &[u8]) {
        match core::str::from_utf8(command) {
            Ok("I") => {
                self.say_build_info().await;
                self.say_ok().await;
            }
            Ok(setting) if setting.contains('=') => self.set(setting).await,
            _ => self.say_error(code::BAD_DOLLAR).await,
        }
    }

    /// Applies the `name=value` pairs of a line as a whole or not at all.
    async fn set(&mut self, setting: &str) {
        if !self.is_at_rest() {
            return self.say_error(code::NOT_IDLE).await;
        }
        if let Err(reason) = self.adopt(setting) {
            return self.refuse(code::BAD_DOLLAR, reason).await;
        }
        if let Some(robot) = self.robot.take() {
            self.link_order(Order::Robot(robot)).await;
            self.robot = Some(self.link.robot_back().await);
        }
        self.say_ok().await;
    }

    /// Takes a setting over for planning and into the robot's place. Neither asynchronous nor
    /// inlined, so that the new robot is on the stack for a moment only.
    #[inline(never)]
    fn adopt(&mut self, setting: &str) -> Result<(), Refusal> {
        let mut config = self.config;
        config.set_all(setting).map_err(Refusal::Setting)?;
        if let Some(robot) = &mut self.robot {
            **robot = Robot::new(&config).map_err(Refusal::Config)?;
            self.planner.set_robot(robot);
            self.config = config;
        }
        Ok(())
    }

    /// Forgets the lines that have no answer yet. Moves cannot be forgotten yet,
    /// so nothing may wait or move.
    async fn soft_reset(&mut self) {
        if self.is_at_rest() {
            self.received.inbox.clear();
            self.received.lines.clear();
            self.say(format_args!("{BANNER}")).await;
        } else {
            self.say(format_args!("[MSG:Reset is possible at rest only]"))
                .await;
        }
    }

    async fn order(&mut self, order: motion::Order) {
        self.link_order(Order::Motion(order)).await;
    }

    async fn link_order(&mut self, order: Order) {
        self.orders = self.orders.wrapping_add(1);
        self.link.order(order).await;
    }

    /// Nothing moves, and nothing is about to.
    fn is_at_rest(&self) -> bool {
        let report = self.link.report();
        report.setpoint.state == MotionState::Idle
            && report.orders == self.orders
            && !self.cycle_start.is_waiting()
    }

    async fn say_status(&mut self) {
        let report = self.link.report();
        let state = match report.setpoint.state {
            MotionState::Idle if self.is_at_rest() => "Idle",
            MotionState::Idle | MotionState::Running => "Run",
            MotionState::Stopping => "Hold:1",
            MotionState::Held | MotionState::Paused => "Hold:0",
        };
        let Pose { x, y, z, c } = report.setpoint.pose;
        self.say(format_args!(
            "<{state}|MPos:{x:.3},{y:.3},{z:.3},{c:.3}|Bf:{},{}|FS:{},0>",
            u8::from(self.planner.has_room()),
            self.received.inbox.free_bytes(),
            feed_mm_min(&report),
        ))
        .await;
    }

    async fn say_build_info(&mut self) {
        let report = self.link.report();
        let (blocks, unit) = (self.blocks, self.cost_unit);
        self.say(format_args!("[VER:1.1h:Stillpoint]")).await;
        self.say(format_args!("[OPT:,{blocks},{RX_BYTES}]")).await;
        self.say(format_args!(
            "[TICK:count={},worst={} {unit},overruns={},unsent={},starved={}]",
            report.ticks, report.worst_tick, report.overruns, report.unsent, report.starved,
        ))
        .await;
        let StackUse { used, free } = stack_use();
        self.say(format_args!("[STACK:used={used},free={free}]"))
            .await;
    }

    async fn refuse(&mut self, code: u8, reason: impl fmt::Display) {
        self.say(format_args!("[MSG:{reason}]")).await;
        self.say_error(code).await;
    }

    async fn say_error(&mut self, code: u8) {
        self.say(format_args!("error:{code}")).await;
    }

    async fn say_ok(&mut self) {
        self.say(format_args!("ok")).await;
    }

    async fn say(&mut self, parts: fmt::Arguments<'_>) {
        let text = Text::line(parts);
        self.output.write_all(text.as_bytes()).await;
    }
}

/// Why a setting is refused.
enum Refusal {
    Setting(SettingError),
    Config(ConfigError),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Setting(error) => error.fmt(f),
            Self::Config(error) => error.fmt(f),
        }
    }
}

/// The tool's speed in the last tick in mm/min, good to 0.1 %.
fn feed_mm_min(report: &Report) -> u32 {
    let (now, before) = (report.setpoint.pose, report.previous_pose);
    let squared_mm2: f32 = [(now.x, before.x), (now.y, before.y), (now.z, before.z)]
        .into_iter()
        .map(|(to, from)| to.saturating_sub(from).to_num::<f32>())
        .map(|step_mm| step_mm * step_mm)
        .sum();
    const MM_MIN_PER_MM_TICK: f32 = TICK_HZ as f32 * 60.0;
    // a display: the root's 1e-3 is enough
    (F32Ext::sqrt(squared_mm2) * MM_MIN_PER_MM_TICK) as u32
}
