//! What passes between the command task and the control task.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::mutex::{self, MutexGuard};
use planner_core::identify::Listener;
use planner_core::motion::{self, MotionSettings};
use planner_core::protocol::Report;
use planner_core::telemetry::Wanted;

/// What the command task asks of the control task. Obeyed in order, before the next tick.
pub enum Order {
    /// To the motion.
    Motion(motion::Order),
    /// Other settings of the robot, in the one place they have; it goes back with
    /// [`Link::return_robot`]. At rest only.
    Robot(&'static mut MotionSettings),
}

/// Orders under way: a place and a start may follow each other within a period.
const ORDERS: usize = 4;

/// Orders one way, reports the other.
pub struct Link {
    orders: Orders,
    robots: Robots,
    report: Mutex<CriticalSectionRawMutex, Cell<Report>>,
    program_open: AtomicBool,
    inputs_inverted: AtomicU8,
    /// Bits of [`Wanted`].
    wanted: AtomicU8,
    listener: mutex::Mutex<CriticalSectionRawMutex, Listener>,
}

type Orders = Channel<CriticalSectionRawMutex, Order, ORDERS>;
type Robots = Channel<CriticalSectionRawMutex, &'static mut MotionSettings, 1>;

impl Default for Link {
    fn default() -> Self {
        Self {
            orders: Channel::new(),
            robots: Channel::new(),
            report: Mutex::new(Cell::default()),
            program_open: AtomicBool::new(false),
            inputs_inverted: AtomicU8::new(0),
            wanted: AtomicU8::new(0),
            listener: mutex::Mutex::new(Listener::new()),
        }
    }
}

impl Link {
    /// Command task: asks for something.
    pub async fn order(&self, order: motion::Order) {
        self.orders.send(Order::Motion(order)).await;
    }

    /// Command task: other settings, in the one place they have; comes back when they are in
    /// force.
    pub async fn exchange_robot(
        &self,
        robot: &'static mut MotionSettings,
    ) -> &'static mut MotionSettings {
        self.orders.send(Order::Robot(robot)).await;
        self.robots.receive().await
    }

    /// Command task: whether the moves sent since the last end are a program
    /// whose end is still to come.
    pub fn set_program_open(&self, open: bool) {
        self.program_open.store(open, Ordering::Relaxed);
    }

    /// Command task: inputs that are active while high, a bit each.
    pub fn set_inputs_inverted(&self, bits: u8) {
        self.inputs_inverted.store(bits, Ordering::Relaxed);
    }

    /// Command task: the last tick's report, with how far the record has come.
    pub async fn report(&self) -> Report {
        let mut listener = self.listener().await;
        let report = self.report.lock(Cell::get);
        let wanted = listener.wants(report.health.ticks);
        self.wanted.store(wanted.to_bits(), Ordering::Relaxed);
        Report {
            listening: listener.progress(),
            ..report
        }
    }

    /// Sample task and command task: the record. While one has it the other
    /// waits, and interrupts do not.
    pub async fn listener(&self) -> MutexGuard<'_, CriticalSectionRawMutex, Listener> {
        self.listener.lock().await
    }

    /// Control task: the next order, if there is one.
    pub fn next_order(&self) -> Option<Order> {
        self.orders.try_receive().ok()
    }

    /// Control task: gives the robot back. There is only one, so there is room for it.
    pub fn return_robot(&self, robot: &'static mut MotionSettings) {
        let returned = self.robots.try_send(robot);
        debug_assert!(returned.is_ok());
    }

    /// Control task: see [`Link::set_program_open`].
    pub fn program_is_open(&self) -> bool {
        self.program_open.load(Ordering::Relaxed)
    }

    /// Control task: see [`Link::set_inputs_inverted`].
    pub fn inputs_inverted(&self) -> u8 {
        self.inputs_inverted.load(Ordering::Relaxed)
    }

    /// Control task: what has to be answered to the setpoint.
    pub fn wanted(&self) -> Wanted {
        Wanted::from_bits(self.wanted.load(Ordering::Relaxed)).unwrap_or_default()
    }

    /// Control task: tells about the tick.
    pub fn publish(&self, report: Report) {
        self.report.lock(|cell| cell.set(report));
    }
}
