//! The controller: everything between the bytes of a link and the planner, as a state machine.

use heapless::Deque;

use crate::config::{ConfigError, Robot, SettingError};
use crate::gcode::{Line, LineBuffer, Offsets, Received};
use crate::identify::{self, Identified, Listen, MODES, Signal};
use crate::joint_space::Space;
use crate::motion::{MotionState, Order};
use crate::planner::{LineError, Planner};
use crate::pose::{AXES, JointPosition, Pose};
use crate::posture::ModeMapConfig;
use crate::servo::ServoGains;

use super::alarm::Alarm;
use super::cycle_start::CycleStart;
use super::dollar::{Dollar, Restore};
use super::homing::{self, Homing};
use super::identification::{self, EXCITING, Identification, ModeFound};
use super::inbox::Inbox;
use super::overrides::{Rates, overridden};
use super::record::{KeptText, RECORD_BYTES, Record};
use super::refusal::Refusal;
use super::reply::{self, Reply, Topic};
use super::report::Report;
use super::settings::{Setting, Settings};
use super::status::{Cadence, Extra, State, Status};
use super::text::Text;

/// How often what the motion does is looked at while something waits for it, in ms.
const POLL_MS: u64 = 1;

/// Outputs that one line, event or wish causes at the most.
const OUTS_AT_ONCE: usize = 6;

/// Outputs that can wait.
const OUTS: usize = 3 * OUTS_AT_ONCE;

// The longest ways through the controller are kept out of line, so that the texts and lines of
// one are not on the stack while another is taken.

/// The longest move of `$ID`, with the word that makes it relative.
const JOG_BYTES: usize = 100;

/// What the shell around the controller has to do next.
#[derive(Debug)]
pub enum Step {
    /// Send this line.
    Say(Text),
    /// Hand this to the motion.
    Order(Order),
    /// Hand [`Controller::robot`] to the motion; everything stands.
    Robot,
    /// Keep what [`Controller::record`] gives, then call [`Controller::kept`].
    Keep(Record),
    /// Forget all records, then call [`Controller::kept`].
    ForgetRecords,
    /// Have samples recorded ([`crate::identify::Listener`]); the reports tell how far that is.
    Listen(Listen),
    /// Call [`Controller::identified`] with what the record shows.
    Identify,
    /// Nothing, until a byte comes or until this time in ms.
    Wait(Option<u64>),
}

/// What waits for its turn to leave.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Out {
    Order(Order),
    Robot,
    Keep(Record),
    ForgetRecords,
    Listen(Listen),
    Identify,
    ModeFound(ModeFound),
    NothingFound(identify::Refusal),
    Ok,
    Error(u8),
    Alarm(Alarm),
    Banner,
    Message(&'static str),
    Sentence(Refusal),
    LineRefused(LineError),
    RobotRefused(ConfigError),
    SettingRefused(SettingError),
    Startup { line: u8, code: u8 },
    NextIs(i32),
}

/// What the controller is in, apart from motion and hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Before the first tick's report.
    Starting,
    Ready,
    Jogging,
    /// `$H`, by limit inputs.
    Homing,
    /// `$ID`.
    Identifying,
    /// `$C`.
    Checking,
    /// Locked until `$X` or `$H`.
    Locked,
    /// Locked until a reset.
    Critical,
    Asleep,
}

/// Why a motion that was told to go on does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    None,
    Feed,
    Door,
}

/// What happens when a motion that is being stopped for good stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AfterStop {
    Reset { alarm: Option<Alarm> },
    Stop,
    JogCancelled,
    IdentificationCancelled,
    Alarm(Alarm),
}

/// What realtime bytes have asked for since the last step. A later byte of a kind replaces
/// an earlier one, so that no number of bytes makes anything overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Wishes {
    /// A status report; not one of before the orders given until then, so many, were obeyed.
    status: Option<u32>,
    full_status: bool,
    reset: bool,
    stop: bool,
    door: bool,
    jog_cancel: bool,
    /// Hold, or go on.
    hold: Option<bool>,
    rates: bool,
}

impl Wishes {
    const NONE: Self = Self {
        status: None,
        full_status: false,
        reset: false,
        stop: false,
        door: false,
        jog_cancel: false,
        hold: None,
        rates: false,
    };
}

/// Where numbered lines with checksums have come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sequence {
    /// Lines carry no checksums, or none has come yet: the first says where they begin.
    Off,
    /// The last line that came whole has this number.
    At(i32),
    /// A reset came in between: M110 has to say where they go on.
    Lost,
}

/// Serves one command link.
///
/// Bytes go in with [`Controller::receive`]; [`Controller::step`] says, one thing at a time,
/// what to send, to order and to keep. It never blocks, and time is an argument, so that the
/// same code runs on the microcontroller, in tests and under fuzzing.
pub struct Controller<'c, 'q> {
    planner: &'c mut Planner<'q>,
    settings: Settings,
    identity: Identity,
    lines: LineBuffer,
    inbox: Inbox,
    outs: Deque<Out, OUTS>,
    reply: Option<Reply>,
    cycle_start: CycleStart,
    mode: Mode,
    hold: Hold,
    after_stop: Option<AfterStop>,
    homing: Homing,
    identification: Identification,
    /// The last ones that were found since the start, none or the one that is looked for first.
    modes_found: [Option<ModeFound>; MODES],
    rates: Rates,
    cadence: Cadence,
    wishes: Wishes,
    /// Orders given, to be compared with those the motion has obeyed.
    orders: u32,
    program_open: bool,
    /// The program uses line numbers: reports show them.
    has_line_numbers: bool,
    /// After an error, in error-safe streaming: until `$ACK`.
    is_refusing: bool,
    sequence: Sequence,
    /// The next start-up line to execute.
    startup: Option<u8>,
    startup_lines: [KeptText; 2],
    build_name: KeptText,
    last_byte_ms: u64,
}

/// What `$I` says of the firmware it runs in.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Name of the board.
    pub board: &'static str,
    /// What ticks are measured in.
    pub cost_unit: &'static str,
    /// Places for moves.
    pub blocks: usize,
    /// Bytes of the stack that were ever used, and those never.
    pub stack_use: fn() -> (usize, usize),
}

impl<'c, 'q> Controller<'c, 'q> {
    /// A controller that has heard nothing, with the default settings in force.
    #[must_use]
    pub const fn new(planner: &'c mut Planner<'q>, settings: Settings, identity: Identity) -> Self {
        Self {
            planner,
            settings,
            identity,
            lines: LineBuffer::new(),
            inbox: Inbox::new(),
            outs: Deque::new(),
            reply: None,
            cycle_start: CycleStart::new(),
            mode: Mode::Starting,
            hold: Hold::None,
            after_stop: None,
            homing: Homing::new(),
            identification: Identification::new(Signal::Acceleration([0.0; 3])),
            modes_found: [None; MODES],
            rates: Rates::FULL,
            cadence: Cadence::new(),
            wishes: Wishes::NONE,
            orders: 0,
            program_open: false,
            has_line_numbers: false,
            is_refusing: false,
            sequence: Sequence::Off,
            startup: None,
            startup_lines: [KeptText::new(), KeptText::new()],
            build_name: KeptText::new(),
            last_byte_ms: 0,
        }
    }

    /// Where the last accepted move ends, if the position is known.
    #[must_use]
    pub fn target(&self) -> Option<Pose> {
        self.planner.interpreter().modal().position()
    }

    /// Number of the last line with a checksum that was accepted, 0 if there is none.
    #[must_use]
    pub fn last_line(&self) -> i32 {
        match self.sequence {
            Sequence::At(number) => number,
            Sequence::Off | Sequence::Lost => 0,
        }
    }

    /// The robot that planning uses, after [`Step::Robot`].
    #[must_use]
    pub const fn robot(&self) -> &Robot {
        self.planner.robot()
    }

    /// The gains of the drives' servos.
    #[must_use]
    pub const fn servos(&self) -> &[ServoGains; AXES] {
        &self.settings.servos
    }

    /// Whether moves of a program have come whose end is still to come.
    #[must_use]
    pub const fn program_is_open(&self) -> bool {
        self.program_open
    }

    /// Inputs that are active while high: the shell inverts what it reads of them.
    #[must_use]
    pub const fn inputs_inverted(&self) -> u8 {
        self.settings.protocol.inputs_inverted
    }

    /// Takes a byte of the link. Realtime commands take effect at once.
    pub fn receive(&mut self, byte: u8, now_ms: u64) {
        self.last_byte_ms = now_ms;
        match self.lines.push(byte) {
            Received::Nothing => self.cycle_start.heard(now_ms),
            Received::Line => {
                self.cycle_start.heard(now_ms);
                self.inbox.push(self.lines.line());
            }
            Received::Overflow => {
                self.cycle_start.heard(now_ms);
                self.inbox.push_too_long();
            }
            // A sender that keeps asking for the status says nothing about moves.
            Received::Realtime(byte) => self.wish(byte),
        }
    }

    /// What to do next.
    pub fn step(&mut self, now_ms: u64, report: &Report) -> Step {
        loop {
            if self.status_is_due(report) {
                return Step::Say(self.status(report));
            }
            if self.grant(report) {
                continue;
            }
            if let Some(out) = self.outs.pop_front() {
                return self.leave(out);
            }
            if let Some(text) = self.continue_reply(report) {
                return Step::Say(text);
            }
            if self.reply.take().is_some() {
                self.out(Out::Ok);
                continue;
            }
            if self.watch(now_ms, report) || self.take_line(report) {
                continue;
            }
            let full = !self.planner.has_room();
            if self.hold == Hold::None && self.cycle_start.is_due(now_ms, full) {
                self.out(Out::Order(Order::Start));
                continue;
            }
            return Step::Wait(self.wake_ms(now_ms, report));
        }
    }

    /// Whether a status report is wished for and can be given: what was said before the wish has
    /// had its effect.
    fn status_is_due(&self, report: &Report) -> bool {
        let is_obeyed = |orders| report.orders.wrapping_sub(orders) <= u32::MAX / 2;
        self.wishes.status.is_some_and(is_obeyed)
    }

    fn out(&mut self, out: Out) {
        // There is room: lines are taken and events are seen only while nothing waits, and
        // wishes are granted only while there is room for the longest of them.
        let pushed = self.outs.push_back(out);
        debug_assert!(pushed.is_ok());
    }

    #[inline(never)]
    fn leave(&mut self, out: Out) -> Step {
        let text = match out {
            Out::Order(order) => {
                self.orders = self.orders.wrapping_add(1);
                return Step::Order(order);
            }
            Out::Robot => return Step::Robot,
            Out::Keep(record) => return Step::Keep(record),
            Out::ForgetRecords => return Step::ForgetRecords,
            Out::Listen(listen) => return Step::Listen(listen),
            Out::Identify => return Step::Identify,
            Out::Ok => Text::line(format_args!("ok")),
            Out::Error(code) => Text::line(format_args!("error:{code}")),
            Out::Alarm(alarm) => Text::line(format_args!("ALARM:{}", alarm.code())),
            Out::Banner => Text::line(format_args!("\r\nGrbl 1.1h ['$' for help]")),
            Out::Message(message) => Text::line(format_args!("[MSG:{message}]")),
            Out::Sentence(refusal) => Text::line(format_args!("[MSG:{refusal}]")),
            Out::LineRefused(error) => Text::line(format_args!("[MSG:{error}]")),
            Out::SettingRefused(error) => Text::line(format_args!("[MSG:{error}]")),
            Out::RobotRefused(error) => Text::line(format_args!("[MSG:{error}]")),
            Out::ModeFound(mode) => Text::line(format_args!(
                "[ID:{:.4},{:.5},{:.3}]",
                mode.frequency_hz, mode.damping, mode.confidence
            )),
            Out::NothingFound(refusal) => Text::line(format_args!("[MSG:{refusal}]")),
            Out::NextIs(number) => Text::line(format_args!("[MSG:Next is N{number}]")),
            Out::Startup { line, code } => self.startup_answer(line, code),
        };
        Step::Say(text)
    }

    fn startup_answer(&self, line: u8, code: u8) -> Text {
        let text = self
            .startup_lines
            .get(usize::from(line))
            .map_or("", |text| text);
        if code == 0 {
            Text::line(format_args!(">{text}:ok"))
        } else {
            Text::line(format_args!(">{text}:error:{code}"))
        }
    }

    #[inline(never)]
    fn continue_reply(&mut self, report: &Report) -> Option<Text> {
        let reply = self.reply.as_mut()?;
        reply.next(&reply::Known {
            settings: &self.settings,
            robot: self.planner.robot(),
            interpreter: self.planner.interpreter(),
            startup_lines: &self.startup_lines,
            build_name: &self.build_name,
            identity: &self.identity,
            health: &report.health,
        })
    }

    /// When to look again, should no byte come.
    fn wake_ms(&self, now_ms: u64, report: &Report) -> Option<u64> {
        let waits_for_motion = self.mode == Mode::Starting
            || self.after_stop.is_some()
            || matches!(self.mode, Mode::Jogging | Mode::Homing | Mode::Identifying)
            || self.startup.is_some()
            || self.wishes.status.is_some()
            || (!self.inbox.is_empty() && self.after_stop.is_none())
            || (!self.planner.has_room() && self.cycle_start.is_waiting())
            || self.settings.protocol.hard_limits
            || report.inputs.door != (self.hold == Hold::Door);
        let poll = waits_for_motion.then_some(now_ms + POLL_MS);
        let start = self
            .cycle_start
            .next_check()
            .filter(|_| self.hold == Hold::None);
        let silence = self
            .link_timeout_ms()
            .map(|timeout| self.last_byte_ms + timeout);
        let silence = silence.filter(|_| report.setpoint.state == MotionState::Running);
        [poll, start, silence].into_iter().flatten().min()
    }
}

// Realtime commands.
impl Controller<'_, '_> {
    /// Notes what a realtime byte asks for. A reset and a stop also forget the lines before
    /// them, and only those.
    fn wish(&mut self, byte: u8) {
        match byte {
            b'?' | 0x87 => {
                self.wishes.status.get_or_insert(self.orders);
                self.wishes.full_status |= byte == 0x87;
            }
            0x18 => {
                self.inbox.clear();
                self.wishes = Wishes {
                    reset: true,
                    status: self.wishes.status,
                    ..Wishes::NONE
                };
            }
            0x19 => {
                self.inbox.clear();
                self.wishes.stop = true;
            }
            b'!' => self.wishes.hold = Some(true),
            b'~' => self.wishes.hold = Some(false),
            0x84 => self.wishes.door = true,
            0x85 => self.wishes.jog_cancel = true,
            _ => {
                if let Some(rates) = overridden(self.rates, byte)
                    && rates != self.rates
                {
                    self.rates = rates;
                    self.wishes.rates = true;
                }
            }
        }
    }

    /// Grants one wish; whether there was one.
    fn grant(&mut self, report: &Report) -> bool {
        if self.outs.len() > OUTS - 2 * OUTS_AT_ONCE || self.mode == Mode::Starting {
            return false;
        }
        let wishes = &mut self.wishes;
        if core::mem::take(&mut wishes.reset) {
            self.soft_reset(report);
        } else if core::mem::take(&mut wishes.stop) {
            self.stop_for_good(report);
        } else if core::mem::take(&mut wishes.door) {
            self.suspend(Hold::Door, report);
        } else if core::mem::take(&mut wishes.jog_cancel) {
            self.cancel_jog(report);
        } else if let Some(hold) = wishes.hold.take() {
            if hold {
                self.suspend(Hold::Feed, report);
            } else {
                self.go_on(report);
            }
        } else if core::mem::take(&mut wishes.rates) {
            self.cadence.overrides_changed();
            self.out(Out::Order(self.rates.order()));
        } else {
            return false;
        }
        true
    }

    /// Feed hold and safety door. A jog ends by it.
    fn suspend(&mut self, hold: Hold, report: &Report) {
        match self.mode {
            Mode::Jogging => self.cancel_jog(report),
            Mode::Identifying => self.cancel_identification(report),
            Mode::Ready if self.after_stop.is_none() => {
                if self.hold == Hold::None && !self.is_at_rest(report) {
                    self.out(Out::Order(Order::Hold));
                }
                // A door is not opened by a hold.
                if self.hold != Hold::Door {
                    self.hold = hold;
                }
            }
            _ => {}
        }
    }

    /// Cycle start: goes on after a hold, a closed door or M0, else starts what waits.
    fn go_on(&mut self, report: &Report) {
        if self.mode != Mode::Ready || self.after_stop.is_some() {
            return;
        }
        if self.hold == Hold::Door && report.inputs.door {
            return self.out(Out::Message("Check Door"));
        }
        if self.hold != Hold::None || report.setpoint.state == MotionState::Paused {
            self.hold = Hold::None;
            self.out(Out::Order(Order::Resume));
        } else if self.cycle_start.is_waiting() {
            self.cycle_start.forget();
            self.out(Out::Order(Order::Start));
        }
    }

    fn cancel_jog(&mut self, report: &Report) {
        if self.mode == Mode::Jogging && self.after_stop.is_none() {
            self.stop_motion(AfterStop::JogCancelled, report);
        } else if self.mode == Mode::Identifying {
            self.cancel_identification(report);
        }
    }

    /// Stops and forgets all moves, without alarm and without reset.
    fn stop_for_good(&mut self, report: &Report) {
        if self.after_stop.is_some() {
            return;
        }
        match self.mode {
            Mode::Ready | Mode::Jogging => {
                self.forget_answers();
                self.stop_motion(AfterStop::Stop, report);
            }
            Mode::Homing => self.stop_homing(Alarm::HomingReset, report),
            Mode::Identifying => self.cancel_identification(report),
            _ => {}
        }
    }

    fn stop_motion(&mut self, after: AfterStop, report: &Report) {
        let was_at_rest = self.is_at_rest(report);
        self.cycle_start.forget();
        self.hold = Hold::None;
        self.program_open = false;
        if !was_at_rest {
            self.out(Out::Order(Order::Stop));
        }
        self.after_stop = Some(after);
    }

    fn soft_reset(&mut self, report: &Report) {
        let alarm = if self.mode == Mode::Homing {
            Some(Alarm::HomingReset)
        } else {
            (!self.is_at_rest(report)).then_some(Alarm::ResetInMotion)
        };
        self.forget_answers();
        self.is_refusing = false;
        if self.sequence != Sequence::Off {
            self.sequence = Sequence::Lost;
        }
        self.has_line_numbers = false;
        if self.rates != Rates::FULL {
            self.rates = Rates::FULL;
            self.wishes.rates = true;
        }
        self.stop_motion(AfterStop::Reset { alarm }, report);
    }

    /// Drops the answers under way, but not what was ordered.
    fn forget_answers(&mut self) {
        self.reply = None;
        self.startup = None;
        for _ in 0..self.outs.len() {
            if let Some(out) = self.outs.pop_front()
                && matches!(
                    out,
                    Out::Order(_) | Out::Robot | Out::Keep(_) | Out::ForgetRecords
                )
            {
                self.out(out);
            }
        }
    }
}

// What happens by itself.
impl Controller<'_, '_> {
    /// Looks at what the motion and the inputs do; whether there was something to do.
    fn watch(&mut self, now_ms: u64, report: &Report) -> bool {
        if self.mode == Mode::Starting {
            return self.begin(report);
        }
        if let Some(after) = self.after_stop {
            if !self.has_stopped(report) {
                return false;
            }
            self.after_stop = None;
            self.stopped(after, report);
            return true;
        }
        if self.mode == Mode::Homing {
            return self.home_on(report);
        }
        if self.mode == Mode::Identifying {
            return self.identify_on(report);
        }
        if self.mode == Mode::Jogging && self.is_at_rest(report) {
            self.mode = Mode::Ready;
        }
        let moves = matches!(
            report.setpoint.state,
            MotionState::Running | MotionState::Stopping
        );
        if self.settings.protocol.hard_limits && report.inputs.limits != 0 && moves {
            self.stop_motion(AfterStop::Alarm(Alarm::HardLimit), report);
            return true;
        }
        if report.inputs.door && self.hold != Hold::Door && self.mode == Mode::Ready {
            self.suspend(Hold::Door, report);
            return true;
        }
        let silent = self
            .link_timeout_ms()
            .is_some_and(|timeout| now_ms >= self.last_byte_ms + timeout);
        if silent && moves && self.hold == Hold::None && self.mode == Mode::Ready {
            self.suspend(Hold::Feed, report);
            self.out(Out::Message(
                "Nothing was heard for the link timeout: held; go on with ~",
            ));
            return true;
        }
        self.run_startup(report)
    }

    fn link_timeout_ms(&self) -> Option<u64> {
        let seconds = self.settings.protocol.link_timeout_s;
        (seconds > 0.0).then_some((seconds * 1000.0) as u64)
    }

    /// The first report is there: the encoders' position counts from now on.
    fn begin(&mut self, report: &Report) -> bool {
        if report.health.ticks == 0 {
            return false;
        }
        self.mode = Mode::Ready;
        let protocol = self.settings.protocol;
        if protocol.encoders {
            match report.encoders {
                Some(joints) => self.place(&joints),
                None => {
                    self.mode = Mode::Locked;
                    self.out(Out::Message("This board reads no encoders: set $1000=0"));
                }
            }
        } else if protocol.start_locked {
            self.mode = Mode::Locked;
        }
        self.greet();
        true
    }

    /// The joints are here.
    fn place(&mut self, joints: &JointPosition) {
        let elbow = self.robot().config.scara.elbow;
        let pose = self.planner.place_joints(joints);
        if self.robot().config.scara.elbow != elbow {
            self.out(Out::Robot);
        }
        self.out(Out::Order(Order::Place(pose)));
    }

    fn greet(&mut self) {
        self.out(Out::Banner);
        if self.mode == Mode::Locked {
            self.out(Out::Message("'$H'|'$X' to unlock"));
        } else {
            self.startup = Some(0);
        }
    }

    /// The motion that was stopped for good stands.
    fn stopped(&mut self, after: AfterStop, report: &Report) {
        // Who did not know where the robot is does not know it now.
        if self.target().is_some() {
            match report.progress.space {
                Space::Tool => self.planner.stopped_at(report.setpoint.pose),
                Space::Joints => {
                    let joints = report.setpoint.joints.position;
                    self.planner.stopped_at_joints(joints);
                }
            }
        }
        match after {
            AfterStop::Reset { alarm } => {
                self.planner.reset_modes();
                self.forget_robot_words();
                let was_locked = matches!(self.mode, Mode::Locked | Mode::Critical | Mode::Asleep);
                self.mode = if alarm.is_some() || was_locked {
                    Mode::Locked
                } else {
                    Mode::Ready
                };
                if let Some(alarm) = alarm {
                    self.out(Out::Alarm(alarm));
                }
                self.greet();
            }
            AfterStop::JogCancelled => self.mode = Mode::Ready,
            AfterStop::IdentificationCancelled => {
                self.end_identification();
                self.out(Out::Message(identification::CANCELLED));
                self.out(Out::Error(Refusal::NotIdentified.code()));
            }
            AfterStop::Stop => {
                self.mode = Mode::Ready;
                self.out(Out::Message("Stopped"));
            }
            AfterStop::Alarm(alarm) => {
                self.mode = if alarm.needs_reset() {
                    Mode::Critical
                } else {
                    Mode::Locked
                };
                self.out(Out::Alarm(alarm));
                if alarm.needs_reset() {
                    self.out(Out::Message("Reset to continue"));
                }
            }
        }
    }

    /// Takes back what M100 or an identification has changed, as a reset does with all modes.
    /// What M101 and M102 have changed stays as it is, because the arm does.
    #[inline(never)]
    fn forget_robot_words(&mut self) {
        let (now, settings) = (&self.robot().config, &self.settings.robot);
        if now.prefilter == settings.prefilter
            && now.automatic == settings.automatic
            && now.map == settings.map
        {
            return;
        }
        // They have been in force before: this does not fail.
        if self.planner.set_config(&self.settings.robot).is_ok() {
            self.out(Out::Robot);
        }
    }

    /// The motion has obeyed all orders and stands.
    fn has_stopped(&self, report: &Report) -> bool {
        let has_orders = self.outs.iter().any(|out| matches!(out, Out::Order(_)));
        !has_orders && report.orders == self.orders && report.setpoint.state == MotionState::Idle
    }

    /// Nothing moves, and nothing is about to.
    fn is_at_rest(&self, report: &Report) -> bool {
        self.has_stopped(report) && !self.cycle_start.is_waiting() && self.after_stop.is_none()
    }

    fn state(&self, report: &Report) -> State {
        let stopping = matches!(
            report.setpoint.state,
            MotionState::Running | MotionState::Stopping
        );
        match (self.mode, self.hold) {
            (Mode::Asleep, _) => State::Sleep,
            (Mode::Locked | Mode::Critical, _) => State::Alarm,
            (Mode::Checking, _) => State::Check,
            (Mode::Jogging, _) => State::Jog,
            (Mode::Homing, _) => State::Home,
            (Mode::Identifying, _) => State::Run,
            (_, Hold::Door) => State::Door {
                stopping,
                open: report.inputs.door,
            },
            (_, Hold::Feed) => State::Hold { stopping },
            _ if report.setpoint.state == MotionState::Paused => State::Hold { stopping: false },
            _ if self.after_stop.is_some() && stopping => State::Hold { stopping },
            _ if self.is_at_rest(report) => State::Idle,
            _ => State::Run,
        }
    }

    #[inline(never)]
    fn status(&mut self, report: &Report) -> Text {
        self.wishes.status = None;
        let full = core::mem::take(&mut self.wishes.full_status);
        let state = self.state(report);
        let extra = self.cadence.next(state != State::Idle);
        let protocol = &self.settings.protocol;
        let has_buffers = full || protocol.report_mask & 2 != 0;
        Text::line(format_args!(
            "{}",
            Status {
                state,
                pose: report.setpoint.pose,
                offset: self.planner.interpreter().work_offset(),
                machine_position: protocol.report_mask & 1 != 0,
                inches: protocol.report_inches,
                buffers: has_buffers.then(|| (self.planner.free_places(), self.inbox.free_bytes())),
                line: (self.has_line_numbers && state != State::Idle)
                    .then_some(report.progress.line),
                speed_mm_s: report.speed_mm_s(),
                inputs: report.inputs,
                outputs: report.setpoint.outputs,
                rates: self.rates,
                joints: (full || protocol.report_joints).then_some((
                    report.setpoint.arm.joint_units(),
                    report.setpoint.joints.position,
                )),
                with_offset: full || extra == Extra::Offset,
                with_overrides: full || extra == Extra::Overrides,
            }
        ))
    }
}

// Lines.
impl Controller<'_, '_> {
    /// Takes the next line, if it may be answered now.
    fn take_line(&mut self, report: &Report) -> bool {
        if matches!(
            self.mode,
            Mode::Starting | Mode::Homing | Mode::Identifying | Mode::Critical | Mode::Asleep
        ) {
            return false;
        }
        let Some(first) = self.inbox.first_byte() else {
            return false;
        };
        // Questions are answered while moves wait for room, once the report is one of after
        // the last order: whether the robot is at rest may matter.
        let may_be_taken = match first {
            b'$' => report.orders == self.orders,
            _ => self.planner.has_room(),
        };
        if !may_be_taken {
            return false;
        }
        match self.inbox.pop() {
            None => return false,
            Some(Err(_)) => self.refuse(Refusal::LineTooLong),
            Some(Ok(line)) => match line.split_first() {
                Some((b'$', command)) => self.dollar(command, report),
                _ => self.gcode(&line, report),
            },
        }
        true
    }

    /// One answer to a line: `ok`.
    fn accept(&mut self) {
        self.out(Out::Ok);
    }

    /// One answer to a line: `error:N`, with a sentence where it is not one of many alike.
    fn refuse(&mut self, refusal: Refusal) {
        let is_one_of_many = matches!(
            refusal,
            Refusal::Locked | Refusal::AfterAnError | Refusal::OutOfOrder
        );
        if !is_one_of_many {
            self.out(Out::Sentence(refusal));
        }
        self.out(Out::Error(refusal.code()));
        self.is_refusing |= self.settings.protocol.error_safe;
    }

    fn refuse_line(&mut self, error: LineError, report: &Report) {
        self.out(Out::LineRefused(error));
        self.out(Out::Error(error.code()));
        self.is_refusing |= self.settings.protocol.error_safe;
        if error.is_out_of_reach() && self.settings.protocol.soft_limit_alarm {
            self.stop_motion(AfterStop::Alarm(Alarm::SoftLimit), report);
        }
    }

    #[inline(never)]
    fn gcode(&mut self, text: &[u8], report: &Report) {
        if matches!(self.mode, Mode::Locked | Mode::Jogging) {
            return self.refuse(Refusal::Locked);
        }
        if self.is_refusing {
            return self.refuse(Refusal::AfterAnError);
        }
        let line = match Line::parse(text) {
            Ok(line) => line,
            Err(error) => {
                self.say_next_number();
                let error = self.planner.refused(error);
                return self.refuse_line(error, report);
            }
        };
        match self.in_sequence(&line) {
            Ok(true) => {}
            // It came twice; it was executed once.
            Ok(false) => return self.accept(),
            Err(refusal) => {
                self.say_next_number();
                return self.refuse(refusal);
            }
        }
        self.has_line_numbers |= line.number().is_some();
        match self.execute(&line) {
            Ok(()) => self.accept(),
            Err(error) => self.refuse_line(error, report),
        }
    }

    /// Executes a line, or only checks it in check mode.
    fn execute(&mut self, line: &Line) -> Result<(), LineError> {
        if self.mode == Mode::Checking {
            return self.planner.check(line);
        }
        let accepted = self.planner.execute(line)?;
        if let Some(pose) = accepted.reference {
            self.out(Out::Order(Order::Place(pose)));
        }
        if accepted.offset_changed {
            self.cadence.offset_changed();
        }
        if accepted.offsets_stored {
            self.out(Out::Keep(Record::Offsets));
        }
        if accepted.queued {
            self.program_open = true;
            self.cycle_start.queued();
        }
        if accepted.ended {
            self.program_open = false;
            self.has_line_numbers = false;
            self.cycle_start.completed();
        }
        Ok(())
    }

    /// Whether a line is the next one, once lines carry number and checksum; `false` if it is
    /// one that has come before.
    fn in_sequence(&mut self, line: &Line) -> Result<bool, Refusal> {
        let number = line.number().filter(|_| line.has_checksum());
        // Without a number M110 ends the count. Only with a checksum: damage must not.
        let ends_it = line.sets_number() && line.has_checksum() && line.number().is_none();
        // After a reset another sender may go on, one that never numbers its lines. A numbered
        // line that was damaged still has its N; where a damaged byte was the reset, nothing but
        // the line's end may be left.
        let is_blank = line.words().next().is_none();
        let is_unnumbered = self.sequence == Sequence::Lost && line.number().is_none();
        if is_unnumbered && is_blank {
            return Ok(true);
        }
        if ends_it || is_unnumbered {
            self.sequence = Sequence::Off;
        }
        match (self.sequence, number) {
            (Sequence::Off, None) => return Ok(true),
            // A line without checksum among lines with one has lost it.
            (_, None) => return Err(Refusal::OutOfOrder),
            (_, Some(_)) if line.sets_number() => {}
            (Sequence::Off, Some(_)) => {}
            (Sequence::Lost, Some(_)) => return Err(Refusal::OutOfOrder),
            (Sequence::At(last), Some(number)) if number <= last => return Ok(false),
            (Sequence::At(last), Some(number)) if number > last.wrapping_add(1) => {
                return Err(Refusal::OutOfOrder);
            }
            (Sequence::At(_), Some(_)) => {}
        }
        if let Some(number) = number {
            self.sequence = Sequence::At(number);
        }
        Ok(true)
    }

    /// Says from where to send again.
    fn say_next_number(&mut self) {
        match self.sequence {
            Sequence::Off => {}
            Sequence::At(last) => self.out(Out::NextIs(last.wrapping_add(1))),
            Sequence::Lost => self.out(Out::Message("Send M110 first")),
        }
    }

    /// Executes the next start-up line, if one is due.
    #[inline(never)]
    fn run_startup(&mut self, report: &Report) -> bool {
        let Some(line) = self.startup else {
            return false;
        };
        if self.mode != Mode::Ready || !self.planner.has_room() || !self.is_at_rest(report) {
            return false;
        }
        let Some(text) = self.startup_lines.get(usize::from(line)).cloned() else {
            self.startup = None;
            return false;
        };
        self.startup = Some(line + 1);
        if !text.is_empty() {
            let result = Line::parse(text.as_bytes())
                .map_err(|error| self.planner.refused(error))
                .and_then(|line| self.execute(&line));
            let code = result.map_or_else(|error| error.code(), |()| 0);
            self.out(Out::Startup { line, code });
        }
        true
    }
}

// `$` commands.
impl Controller<'_, '_> {
    #[inline(never)]
    fn dollar(&mut self, command: &[u8], report: &Report) {
        let command = core::str::from_utf8(command).ok().and_then(Dollar::parse);
        let Some(command) = command else {
            return self.refuse(Refusal::BadDollar);
        };
        let at_rest = self.is_at_rest(report);
        match command {
            Dollar::Help => self.reply(Topic::Help),
            Dollar::Settings if !at_rest => self.refuse(Refusal::NotIdle),
            Dollar::Settings => self.reply(Topic::Settings),
            Dollar::Show(key) if key.eq_ignore_ascii_case("map") => self.reply(Topic::Map),
            Dollar::Show(key) => match Setting::find(key) {
                Some(setting) => self.reply(Topic::Setting(setting)),
                None => self.refuse(Refusal::BadDollar),
            },
            Dollar::Offsets => self.reply(Topic::Offsets),
            Dollar::ParserState => self.reply(Topic::ParserState),
            Dollar::BuildInfo => self.reply(Topic::BuildInfo { more: false }),
            Dollar::MoreBuildInfo => self.reply(Topic::BuildInfo { more: true }),
            Dollar::StartupLines => self.reply(Topic::StartupLines),
            Dollar::Describe(description) => self.reply(Topic::Describe(description)),
            Dollar::Jog(text) => self.jog(text, report),
            Dollar::Acknowledge => {
                self.is_refusing = false;
                self.accept();
            }
            Dollar::Unlock => self.unlock(),
            _ if !at_rest => self.refuse(Refusal::NotIdle),
            Dollar::Check => self.toggle_check(report),
            Dollar::Home => self.home(report),
            Dollar::Identify(joint, text) => self.identify(joint, text),
            Dollar::Identified => self.show_mode_found(),
            Dollar::StoreIdentified => self.store_mode_found(),
            Dollar::Sleep => {
                self.mode = Mode::Asleep;
                self.accept();
                self.out(Out::Message("Sleeping"));
            }
            Dollar::Set(text) => self.set(text),
            Dollar::NameBuild(text) => self.keep_text(Record::BuildName, text),
            Dollar::SetStartupLine(line, text) => self.set_startup_line(line, text),
            Dollar::Restore(restore) => self.restore_defaults(restore),
        }
    }

    fn reply(&mut self, topic: Topic) {
        self.reply = Some(Reply::new(topic));
    }

    fn jog(&mut self, text: &str, report: &Report) {
        match self.mode {
            Mode::Locked => return self.refuse(Refusal::Locked),
            Mode::Jogging => {}
            Mode::Ready if self.is_at_rest(report) && self.hold == Hold::None => {}
            _ => return self.refuse(Refusal::NotIdle),
        }
        if self.is_refusing {
            return self.refuse(Refusal::AfterAnError);
        }
        // A jog line may arrive while the moves of others fill the look-ahead.
        match self.planner.jog(text.as_bytes()) {
            Ok(accepted) => {
                if accepted.queued {
                    self.mode = Mode::Jogging;
                    self.out(Out::Order(Order::Start));
                }
                self.accept();
            }
            Err(error) => {
                self.out(Out::LineRefused(error));
                self.out(Out::Error(error.code()));
            }
        }
    }

    fn unlock(&mut self) {
        if self.mode == Mode::Locked {
            self.mode = Mode::Ready;
            self.out(Out::Message("Caution: Unlocked"));
        }
        self.accept();
    }

    /// Check mode ends with a reset, because the modal state went on with the lines checked.
    fn toggle_check(&mut self, report: &Report) {
        match self.mode {
            Mode::Checking => {
                self.mode = Mode::Ready;
                self.out(Out::Message("Disabled"));
                self.accept();
                self.after_stop = Some(AfterStop::Reset {
                    alarm: (!self.is_at_rest(report)).then_some(Alarm::ResetInMotion),
                });
            }
            Mode::Ready => {
                self.mode = Mode::Checking;
                self.out(Out::Message("Enabled"));
                self.accept();
            }
            _ => self.refuse(Refusal::NotIdle),
        }
    }

    fn set(&mut self, text: &str) {
        let mut settings = self.settings;
        if let Err(error) = settings.set_all(text) {
            self.out(Out::SettingRefused(error));
            self.out(Out::Error(match error {
                SettingError::Unknown => Refusal::BadDollar.code(),
                SettingError::Value => Refusal::BadValue.code(),
            }));
            return;
        }
        let protocol = settings.protocol;
        if protocol.soft_limit_alarm && !protocol.encoders {
            return self.refuse(Refusal::SoftLimitsNeedPosition);
        }
        let changes_map = settings.robot.map != self.settings.robot.map;
        let changes_servos = settings.servos != self.settings.servos;
        if self.adopt(&settings) {
            self.out(Out::Keep(Record::Settings));
            if changes_map {
                self.out(Out::Keep(Record::Map));
            }
            if changes_servos {
                self.out(Out::Keep(Record::Servos));
            }
            self.accept();
        }
    }

    /// Puts settings in force, or refuses them.
    fn adopt(&mut self, settings: &Settings) -> bool {
        let put = self.put_in_force(settings);
        if let Err(error) = put {
            self.out(Out::RobotRefused(error));
            self.out(Out::Error(Refusal::NoRobot.code()));
        }
        put.is_ok()
    }

    /// Puts settings in force; if they are refused nothing changes.
    #[inline(never)]
    fn put_in_force(&mut self, settings: &Settings) -> Result<(), ConfigError> {
        if settings.robot != self.settings.robot {
            self.planner.set_config(&settings.robot)?;
            self.out(Out::Robot);
        }
        self.settings = *settings;
        self.cadence.offset_changed();
        Ok(())
    }

    fn set_startup_line(&mut self, line: u8, text: &str) {
        if self.mode == Mode::Locked {
            return self.refuse(Refusal::Locked);
        }
        let checked = Line::parse(text.as_bytes())
            .map_err(|error| self.planner.refused(error))
            .and_then(|line| self.planner.would_accept(&line));
        match checked {
            Ok(()) => self.keep_text(Record::StartupLine(line), text),
            Err(error) => {
                self.out(Out::LineRefused(error));
                self.out(Out::Error(error.code()));
            }
        }
    }

    fn keep_text(&mut self, record: Record, text: &str) {
        let Ok(text) = KeptText::try_from(text) else {
            return self.refuse(Refusal::StartupTooLong);
        };
        self.take_text(record, text);
        self.out(Out::Keep(record));
        self.accept();
    }

    fn take_text(&mut self, record: Record, text: KeptText) {
        match record {
            Record::StartupLine(line) => {
                if let Some(place) = self.startup_lines.get_mut(usize::from(line)) {
                    *place = text;
                }
            }
            Record::BuildName => self.build_name = text,
            Record::Settings | Record::Map | Record::Servos | Record::Offsets => {}
        }
    }

    fn restore_defaults(&mut self, restore: Restore) {
        let all = restore == Restore::All;
        // What is forgotten as a whole need not be kept before.
        let sets = all || restore == Restore::Settings;
        let is_set = sets && self.adopt(&Settings::default());
        if is_set && !all {
            self.out(Out::Keep(Record::Settings));
            self.out(Out::Keep(Record::Map));
            self.out(Out::Keep(Record::Servos));
        }
        if all || restore == Restore::Offsets {
            self.planner.set_offsets(Offsets::NONE);
            self.cadence.offset_changed();
        }
        if all {
            self.startup_lines = [KeptText::new(), KeptText::new()];
            self.build_name = KeptText::new();
            self.out(Out::ForgetRecords);
        } else if restore == Restore::Offsets {
            self.out(Out::Keep(Record::Offsets));
        }
        self.out(Out::Message("Restoring defaults"));
        self.accept();
    }

    /// Encoders tell the position at once, limit inputs have to be found.
    fn home(&mut self, report: &Report) {
        if self.settings.protocol.encoders
            && let Some(joints) = report.encoders
        {
            return self.homed(&joints);
        }
        if self.settings.homing.joints == 0 {
            return self.refuse(Refusal::NoHoming);
        }
        self.mode = Mode::Homing;
        self.homing = Homing::new();
        self.hold = Hold::None;
        self.planner.forget_position();
    }

    /// The joints are known; what comes at every start comes now.
    fn homed(&mut self, joints: &JointPosition) {
        self.mode = Mode::Ready;
        self.place(joints);
        self.accept();
        self.startup = Some(0);
    }

    /// Ends homing without a position, by an alarm when everything stands.
    fn stop_homing(&mut self, alarm: Alarm, report: &Report) {
        self.stop_motion(AfterStop::Alarm(alarm), report);
        self.out(Out::Error(Refusal::Locked.code()));
    }

    /// Goes on with homing, once the last move has ended; whether it has.
    #[inline(never)]
    fn home_on(&mut self, report: &Report) -> bool {
        if report.inputs.door {
            self.stop_homing(Alarm::HomingDoor, report);
            return true;
        }
        // A report may be older than a change of the robot: its joints are of another kind.
        let is_current = report.setpoint.arm == self.robot().arm.kind();
        if !self.has_stopped(report) || !is_current {
            return false;
        }
        let outcome = homing::Outcome {
            joints: report.setpoint.joints.position,
            touched: report.progress.touched,
            limits: report.inputs.limits,
        };
        let travels = self
            .robot()
            .config
            .joint_limits()
            .map(|range| range.max - range.min);
        let units = self.robot().arm.kind().joint_units();
        let homing = &self.settings.homing;
        match self.homing.next(homing, units, &travels, &outcome) {
            homing::Next::Move {
                to,
                duration_s,
                until,
            } => {
                self.planner.move_joints(outcome.joints, to, duration_s);
                self.out(Out::Order(match until {
                    Some((joint, active)) => Order::Seek { joint, active },
                    None => Order::Start,
                }));
            }
            homing::Next::Done(joints) => self.homed(&joints),
            homing::Next::Failed(alarm) => {
                self.mode = Mode::Locked;
                self.out(Out::Alarm(alarm));
                self.out(Out::Error(Refusal::Locked.code()));
            }
        }
        true
    }
}

// Identification.
impl Controller<'_, '_> {
    /// Begins with the move; the answer comes at the end.
    #[inline(never)]
    fn identify(&mut self, joint: Option<u8>, text: &str) {
        match self.mode {
            Mode::Ready if self.hold == Hold::None => {}
            Mode::Locked => return self.refuse(Refusal::Locked),
            _ => return self.refuse(Refusal::NotIdle),
        }
        let mut jog = heapless::String::<JOG_BYTES>::new();
        if jog.push_str("G91 ").is_err() || jog.push_str(text).is_err() {
            return self.refuse(Refusal::LineTooLong);
        }
        if self.excite().is_err() {
            return self.refuse(Refusal::NoRobot);
        }
        self.out(Out::Robot);
        let start = self.target();
        match self.planner.jog(jog.as_bytes()) {
            Ok(accepted) if accepted.queued => {
                let direction = start.zip(self.target()).map(direction);
                self.identification = Identification::new(match joint {
                    None => Signal::Acceleration(direction.unwrap_or_default()),
                    Some(joint) => Signal::FollowingError(joint),
                });
                self.mode = Mode::Identifying;
                self.out(Out::Order(Order::Start));
            }
            Ok(_) => {
                self.forget_robot_words();
                self.out(Out::Message("The move excites nothing: give it a length"));
                self.out(Out::Error(Refusal::NotIdentified.code()));
            }
            Err(error) => {
                self.forget_robot_words();
                self.out(Out::LineRefused(error));
                self.out(Out::Error(error.code()));
            }
        }
    }

    /// The prefilter that leaves most of the vibration, wherever the move goes. It always can be
    /// made, and the other settings have been in force before.
    #[inline(never)]
    fn excite(&mut self) -> Result<(), ConfigError> {
        let mut config = self.settings.robot;
        config.prefilter = EXCITING;
        config.map = ModeMapConfig::NONE;
        config.automatic = false;
        self.planner.set_config(&config)
    }

    /// Goes on with an identification; whether there was something to do.
    #[inline(never)]
    fn identify_on(&mut self, report: &Report) -> bool {
        if report.inputs.door {
            self.cancel_identification(report);
            return true;
        }
        let stands = self.has_stopped(report);
        let ticks = report.health.ticks;
        match self.identification.next(ticks, stands, report.listening) {
            identification::Next::Wait => return false,
            identification::Next::Listen(listen) => self.out(Out::Listen(listen)),
            identification::Next::Identify => self.out(Out::Identify),
            identification::Next::Torn => {
                self.not_identified("Samples were lost: check their line and identify again");
            }
            identification::Next::Silent => {
                self.not_identified(match self.identification.signal() {
                    Signal::Acceleration(_) => identification::ACCELEROMETER_SILENT,
                    Signal::FollowingError(_) => identification::DRIVES_SILENT,
                });
            }
        }
        true
    }

    fn not_identified(&mut self, message: &'static str) {
        self.end_identification();
        self.out(Out::Message(message));
        self.out(Out::Error(Refusal::NotIdentified.code()));
    }

    /// After [`Step::Identify`]: what the record shows.
    pub fn identified(&mut self, result: &Result<Identified, identify::Refusal>) {
        if self.mode != Mode::Identifying {
            return;
        }
        self.end_identification();
        match result {
            Ok(found) => {
                self.modes_found = self.identification.modes(found);
                self.show_mode_found();
            }
            Err(refusal) => {
                self.out(Out::NothingFound(*refusal));
                self.out(Out::Error(Refusal::NotIdentified.code()));
            }
        }
    }

    /// The prefilter of the settings is in force again.
    fn end_identification(&mut self) {
        self.mode = Mode::Ready;
        self.forget_robot_words();
    }

    /// Ends an identification without a result when everything stands.
    fn cancel_identification(&mut self, report: &Report) {
        if self.after_stop.is_none() {
            self.stop_motion(AfterStop::IdentificationCancelled, report);
        }
    }

    fn show_mode_found(&mut self) {
        if self.modes_found == [None; MODES] {
            return self.refuse(Refusal::NothingToStore);
        }
        for mode in self.modes_found.into_iter().flatten() {
            self.out(Out::ModeFound(mode));
        }
        self.accept();
    }

    fn store_mode_found(&mut self) {
        let [Some(mode), ..] = self.modes_found else {
            return self.refuse(Refusal::NothingToStore);
        };
        let mut settings = self.settings;
        settings.robot.prefilter.frequency_hz = mode.frequency_hz;
        settings.robot.prefilter.damping = mode.damping;
        if self.adopt(&settings) {
            self.out(Out::Keep(Record::Settings));
            self.accept();
        }
    }
}

/// Direction from one pose to another, a vector of length 1; 0 if they are at the same place.
fn direction((from, to): (Pose, Pose)) -> [f32; 3] {
    let way = [(from.x, to.x), (from.y, to.y), (from.z, to.z)]
        .map(|(from, to)| to.saturating_sub(from).to_num::<f32>());
    let square: f32 = way.iter().map(|part| part * part).sum();
    let length = crate::math::sqrt_f32(square);
    way.map(|part| if length > 0.0 { part / length } else { 0.0 })
}

// What is kept over a restart.
impl Controller<'_, '_> {
    /// Takes a record that was kept. Before the first step.
    pub fn restore(&mut self, record: Record, bytes: &[u8]) {
        match record {
            Record::Settings => {
                let settings = Settings::from_bytes(bytes);
                self.adopt_kept(&settings);
            }
            Record::Servos => self.settings.take_servo_bytes(bytes),
            Record::Map => {
                if let Some(map) = ModeMapConfig::from_bytes(bytes) {
                    let mut settings = self.settings;
                    settings.robot.map = map;
                    self.adopt_kept(&settings);
                }
            }
            Record::Offsets => {
                if let Some(offsets) = Offsets::from_bytes(bytes) {
                    self.planner.set_offsets(offsets);
                }
            }
            Record::StartupLine(_) | Record::BuildName => {
                if let Ok(text) = core::str::from_utf8(bytes)
                    && let Ok(text) = KeptText::try_from(text)
                {
                    self.take_text(record, text);
                }
            }
        }
    }

    fn adopt_kept(&mut self, settings: &Settings) {
        if self.put_in_force(settings).is_err() {
            self.store_was_damaged();
        }
    }

    /// What to keep of a record, written into `buffer`.
    pub fn record<'b>(&self, record: Record, buffer: &'b mut [u8; RECORD_BYTES]) -> &'b [u8] {
        match record {
            Record::Settings => copied(buffer, &self.settings.to_bytes()),
            Record::Map => copied(buffer, &self.settings.robot.map.to_bytes()),
            Record::Servos => copied(buffer, &self.settings.servo_bytes()),
            Record::Offsets => copied(buffer, &self.planner.interpreter().offsets().to_bytes()),
            Record::StartupLine(line) => {
                let text = self.startup_lines.get(usize::from(line));
                copied(buffer, text.map_or(&[], |text| text.as_bytes()))
            }
            Record::BuildName => copied(buffer, self.build_name.as_bytes()),
        }
    }

    /// Whether what was to be kept is kept; if not, the line's answer becomes `error:7`.
    pub fn kept(&mut self, is_kept: bool) {
        if !is_kept && self.outs.front() == Some(&Out::Ok) {
            self.outs.pop_front();
            let _ = self.outs.push_front(Out::Error(Refusal::NotStored.code()));
            let _ = self.outs.push_front(Out::Sentence(Refusal::NotStored));
        }
    }

    /// Says that what was kept is damaged and the defaults are in force.
    pub fn store_was_damaged(&mut self) {
        self.out(Out::Message(
            "The stored settings were damaged: the defaults are in force",
        ));
    }
}

fn copied<'b>(buffer: &'b mut [u8; RECORD_BYTES], bytes: &[u8]) -> &'b [u8] {
    let (place, _) = buffer.split_at_mut(bytes.len().min(RECORD_BYTES));
    place.copy_from_slice(bytes);
    place
}
