//! The serial loop: the unchanged protocol, planner and tick in one process, byte by byte and
//! millisecond by millisecond.

use std::collections::HashMap;

use crate::sensed_plant::SensedPlant;
use crate::switched_arm::SwitchedArm;
use fixed::traits::ToFixed;
use planner_core::config::Robot;
use planner_core::identify::Listener;
use planner_core::motion::{DelayLines, Motion, Order, Setpoint};
use planner_core::planner::Planner;
use planner_core::pose::{AXES, JointPosition, Pose};
use planner_core::protocol::{
    Controller, Health, Identity, Inputs, RECORD_BYTES, Record, Report, Settings, Step,
};
use planner_core::queue::{LOOKAHEAD, SegmentQueue};
use planner_core::servo::ServoGains;
use planner_core::telemetry::SetpointFrame;

/// Bytes that a port hands over at once.
const PORT_BYTES: usize = 64;

/// What is kept over a restart, here in memory.
pub type Records = HashMap<Record, Vec<u8>>;

/// A controller with its motion, as the firmware wires them.
pub struct SerialLoop<'q> {
    controller: Controller<'q, 'q>,
    motion: Motion<'q>,
    report: Report,
    now_ms: u64,
    output: Vec<u8>,
    /// Orders obeyed; the next tick reports them.
    obeyed: u32,
    /// What is kept.
    pub records: Records,
    /// The board's inputs, as the next tick reports them.
    pub inputs: Inputs,
    /// An arm with limit switches, whose inputs count then.
    pub arm: Option<SwitchedArm>,
    /// What absolute encoders read, if there are any.
    pub encoders: Option<JointPosition>,
    /// A plant on the second port, whose accelerometer and drives answer the setpoints.
    pub plant: Option<SensedPlant>,
    listener: Listener,
    /// Whether what is to be kept is kept.
    pub store_works: bool,
    /// Banners said.
    banners: u32,
}

/// Powers a controller up with what was kept, and hands it to `body` before its first tick.
pub fn with_controller<R>(records: Records, body: impl FnOnce(&mut SerialLoop<'_>) -> R) -> R {
    let mut queue = SegmentQueue::new();
    let mut filters = Box::new(DelayLines::new());
    let settings = Settings::default();
    let mut robot = Robot::new(&settings.robot).expect("the default settings are a robot");
    let (producer, consumer) = queue.split();
    let identity = Identity {
        board: "PC",
        cost_unit: "ticks",
        blocks: LOOKAHEAD,
        stack_use: || (0, 0),
    };
    let motion = Motion::new(&robot, consumer, &mut filters);
    let mut planner = Planner::new(&mut robot, producer);
    let mut controller = Controller::new(&mut planner, settings, identity);
    for record in Record::ALL {
        if let Some(bytes) = records.get(&record) {
            controller.restore(record, bytes);
        }
    }
    let mut serial_loop = SerialLoop {
        controller,
        motion,
        report: Report::default(),
        now_ms: 0,
        output: Vec::new(),
        obeyed: 0,
        records,
        inputs: Inputs::default(),
        arm: None,
        encoders: None,
        plant: None,
        listener: Listener::new(),
        store_works: true,
        banners: 0,
    };
    body(&mut serial_loop)
}

impl SerialLoop<'_> {
    /// Sends bytes; they arrive at once, as far as there is room.
    pub fn send(&mut self, bytes: &[u8]) {
        self.send_watched(bytes, |_| ());
    }

    /// Everything said since the last call.
    pub fn heard(&mut self) -> String {
        String::from_utf8_lossy(&std::mem::take(&mut self.output)).into_owned()
    }

    /// Sends a line and waits, for 60 s at the most, for its answer; returns all that was
    /// said until then.
    pub fn ask(&mut self, line: &str) -> String {
        self.send(format!("{line}\n").as_bytes());
        for _ in 0..60_000 {
            let is_answer = |line: &str| line == "ok" || line.starts_with("error:");
            if String::from_utf8_lossy(&self.output).lines().any(is_answer) {
                break;
            }
            self.tick();
        }
        self.heard()
    }

    /// Lets time pass.
    pub fn run_ms(&mut self, duration_ms: u64) {
        for _ in 0..duration_ms {
            self.tick();
        }
    }

    /// Lets time pass until a report begins with `<state`, for 600 s at the most; returns
    /// whether one did.
    pub fn run_until(&mut self, state: &str) -> bool {
        (0..600_000).any(|_| {
            self.tick();
            self.state().starts_with(state)
        })
    }

    /// Asks for a status report (`?` or 0x87). It comes at once, or with the next tick if orders
    /// are under way.
    pub fn ask_status(&mut self, byte: u8) {
        let before = self.output.len();
        self.send(&[byte]);
        if !self.output[before..].contains(&b'<') {
            self.tick();
        }
    }

    /// The state that a status report shows.
    pub fn state(&mut self) -> String {
        let mut heard = std::mem::take(&mut self.output);
        self.ask_status(b'?');
        let report = String::from_utf8_lossy(&self.output).into_owned();
        let is_other = |line: &&str| !line.starts_with('<');
        let others = report.split_inclusive('\n').filter(is_other);
        heard.extend(others.flat_map(str::bytes));
        self.output = heard;
        let start = report.rfind('<').map_or(0, |start| start + 1);
        let end = report[start..].find('|').unwrap_or(0);
        report[start..start + end].to_string()
    }

    /// Where the last accepted move ends, if the position is known.
    pub fn target(&self) -> Option<Pose> {
        self.controller.target()
    }

    /// Number of the last line with a checksum that was accepted.
    pub fn last_line(&self) -> i32 {
        self.controller.last_line()
    }

    /// Resets so far, and the start.
    pub fn banners(&self) -> u32 {
        self.banners
    }

    /// The robot that planning uses.
    pub fn robot(&self) -> &Robot {
        self.controller.robot()
    }

    /// The gains of the drives' servos.
    pub fn servos(&self) -> &[ServoGains; AXES] {
        self.controller.servos()
    }

    /// What encoders read with the tool at a point.
    pub fn joints_at(&self, x_mm: f64, y_mm: f64) -> JointPosition {
        let pose = Pose {
            x: x_mm.to_fixed(),
            y: y_mm.to_fixed(),
            ..Pose::default()
        };
        self.controller.robot().arm.inverse(&pose)
    }

    /// The setpoint of the last tick.
    pub fn setpoint(&self) -> &Setpoint {
        &self.report.setpoint
    }

    /// Like [`SerialLoop::send`]; `watch` sees every step of the controller.
    pub fn send_watched(&mut self, bytes: &[u8], mut watch: impl FnMut(&Self)) {
        for chunk in bytes.chunks(PORT_BYTES) {
            for &byte in chunk {
                self.controller.receive(byte, self.now_ms);
            }
            self.serve_watched(&mut watch);
        }
    }

    /// One millisecond: a tick of the motion, and all that the controller has to do then.
    pub fn tick(&mut self) {
        self.tick_watched(|_| ());
    }

    /// Likewise; `watch` sees every step of the controller.
    pub fn tick_watched(&mut self, mut watch: impl FnMut(&Self)) {
        self.now_ms += 1;
        let before = self.report.setpoint.pose;
        if let Some(arm) = &self.arm {
            self.inputs.limits = arm.limits();
        }
        self.motion.see_limits(self.inputs.limits);
        let setpoint = self.motion.tick();
        if let Some(arm) = &mut self.arm {
            arm.follow(&setpoint);
        }
        if let Some(plant) = &mut self.plant {
            let frame = SetpointFrame {
                sequence: self.report.health.ticks,
                setpoint,
                wanted: self.listener.wants(self.report.health.ticks),
                ..SetpointFrame::default()
            };
            if let Some(answer) = plant.answer(&frame) {
                self.listener.hear(&answer.encode());
            }
        }
        self.report = Report {
            setpoint,
            previous_pose: before,
            progress: self.motion.progress(),
            orders: self.obeyed,
            inputs: self.inputs,
            encoders: self.encoders,
            listening: self.listener.progress(),
            health: Health {
                ticks: self.report.health.ticks.wrapping_add(1),
                ..self.report.health
            },
        };
        self.serve_watched(&mut watch);
    }

    /// Lets the controller do all it has to do now; `watch` sees every step.
    fn serve_watched(&mut self, watch: &mut impl FnMut(&Self)) {
        while self.step() {
            watch(self);
        }
    }

    /// One step of the controller; whether there was something to do.
    fn step(&mut self) -> bool {
        match self.controller.step(self.now_ms, &self.report) {
            Step::Say(text) => {
                self.banners += u32::from(text.as_bytes().starts_with(b"\r\nGrbl"));
                self.output.extend_from_slice(text.as_bytes());
            }
            Step::Order(order) => self.obey(order),
            Step::Robot => self.motion.set_robot(&self.controller.robot().into()),
            Step::Keep(record) => {
                let mut buffer = [0; RECORD_BYTES];
                let bytes = self.controller.record(record, &mut buffer).to_vec();
                if self.store_works {
                    self.records.insert(record, bytes);
                }
                self.controller.kept(self.store_works);
            }
            Step::ForgetRecords => {
                self.records.clear();
                self.controller.kept(true);
            }
            Step::Listen(listen) => self.listener.listen(listen),
            Step::Identify => self.controller.identified(&self.listener.identify()),
            Step::Wait(_) => return false,
        }
        true
    }

    fn obey(&mut self, order: Order) {
        self.motion.obey(order);
        self.obeyed = self.obeyed.wrapping_add(1);
    }
}
