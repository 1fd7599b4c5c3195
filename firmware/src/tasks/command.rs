//! The command task: carries out what the core's controller decides.

use embassy_time::{Duration, Instant, Timer, with_deadline};
use micromath::F32Ext;
use planner_core::config::{ConfigError, Robot, RobotConfig, SettingError};
use planner_core::gcode::{self, LineBuffer};
use planner_core::motion::MotionState;
use planner_core::planner::Planner;
use planner_core::pose::Pose;
use planner_core::units::TICK_HZ;

use crate::board::{ByteIn, ByteOut};
use crate::tasks::link::Link;

/// Everything between the command port and the control task.
pub struct Commands<I, O> {
    /// Where commands come from.
    pub input: I,
    /// Where answers go.
    pub output: O,
    /// Decides.
    pub controller: &'static mut Controller<'static>,
    /// The place in which a robot with new settings travels to the control task and back.
    pub robot: &'static mut Robot,
    /// To the control task.
    pub link: &'static Link,
}

/// Serves the command port for ever.
pub async fn run(commands: Commands<impl ByteIn, impl ByteOut>) -> ! {
    let Commands {
        mut input,
        mut output,
        controller,
        mut robot,
        link,
    } = commands;
    let mut bytes = [0; READ_BYTES];
    loop {
        let now = Instant::now();
        // A deadline that is now still takes what the port already has, so that a realtime
        // byte is heeded between any two steps.
        let mut wake = now;
        match controller.step(now.as_millis(), &link.report()) {
            Step::Say(text) => output.write_all(text.as_bytes()).await,
            Step::Order(order) => link.order(order).await,
            Step::Robot => {
                robot.clone_from(controller.robot());
                robot = link.exchange_robot(robot).await;
            }
            Step::Wait(until_ms) => {
                wake = until_ms.map_or(Instant::MAX, |ms| Instant::MIN + Duration::from_millis(ms));
            }
        }
        link.set_program_open(controller.program_is_open());
        if !controller.has_room() {
            Timer::at(wake).await;
        } else if let Ok(count) = with_deadline(wake, input.read(&mut bytes)).await {
            let now_ms = Instant::now().as_millis();
            for &byte in bytes.iter().take(count) {
                controller.receive(byte, now_ms);
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
                if let Some(pose) = accepted.reference {
                    self.order(Order::Place(pose)).await;
                }
                if accepted.queued {
                    self.link.set_program_open(true);
                    self.cycle_start.queued();
                }
                if accepted.ended {
                    self.link.set_program_open(false);
                    self.cycle_start.completed();
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
            self.order(Order::Robot(robot)).await;
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

    async fn order(&mut self, order: Order) {
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
        let state = if self.is_at_rest() { "Idle" } else { "Run" };
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
