//! What passes between the command task and the control task.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use planner_core::config::Robot;
use planner_core::motion::{self, Setpoint};
use planner_core::pose::Pose;

/// What the command task asks of the control task. Obeyed in order, before the next tick.
pub enum Order {
    /// To the motion.
    Motion(motion::Order),
    /// Other settings, in the one place they have; it goes back with
    /// [`Link::return_robot`]. At rest only.
    Robot(&'static mut Robot),
}

/// What the control task tells about its last tick.
#[derive(Clone, Copy, Default)]
pub struct Report {
    /// What left in the tick.
    pub setpoint: Setpoint,
    /// Where the tool was a tick before, for the speed.
    pub previous_pose: Pose,
    /// Ticks since the start.
    pub ticks: u32,
    /// Control periods missed since the start.
    pub overruns: u32,
    /// The dearest tick, in the board's unit.
    pub worst_tick: u32,
    /// Frames that found no room on their way out.
    pub unsent: u32,
    /// Times the moves ran out before the program ended.
    pub starved: u32,
    /// Orders obeyed since the start.
    pub orders: u32,
    /// Whether no move is queued or under way.
    pub queue_is_empty: bool,
}

/// Orders under way: a place and a start may follow each other within a period.
const ORDERS: usize = 4;

/// Orders one way, reports the other.
pub struct Link {
    orders: Orders,
    robots: Robots,
    report: Mutex<CriticalSectionRawMutex, Cell<Report>>,
    program_open: AtomicBool,
}

type Orders = Channel<CriticalSectionRawMutex, Order, ORDERS>;
type Robots = Channel<CriticalSectionRawMutex, &'static mut Robot, 1>;

impl Default for Link {
    fn default() -> Self {
        Self {
            orders: Channel::new(),
            robots: Channel::new(),
            report: Mutex::new(Cell::default()),
            program_open: AtomicBool::new(false),
        }
    }
}

impl Link {
    /// Command task: asks for something.
    pub async fn order(&self, order: Order) {
        self.orders.send(order).await;
    }

    /// Command task: waits for the robot that [`Order::Robot`] took along.
    pub async fn robot_back(&self) -> &'static mut Robot {
        self.robots.receive().await
    }

    /// Command task: whether the moves sent since the last end are a program
    /// whose end is still to come.
    pub fn set_program_open(&self, open: bool) {
        self.program_open.store(open, Ordering::Relaxed);
    }

    /// Command task: the last tick's report.
    pub fn report(&self) -> Report {
        self.report.lock(Cell::get)
    }

    /// Control task: the next order, if there is one.
    pub fn next_order(&self) -> Option<Order> {
        self.orders.try_receive().ok()
    }

    /// Control task: gives the robot back. There is only one, so there is room for it.
    pub fn return_robot(&self, robot: &'static mut Robot) {
        let returned = self.robots.try_send(robot);
        debug_assert!(returned.is_ok());
    }

    /// Control task: see [`Link::set_program_open`].
    pub fn program_is_open(&self) -> bool {
        self.program_open.load(Ordering::Relaxed)
    }

    /// Control task: tells about the tick.
    pub fn publish(&self, report: Report) {
        self.report.lock(|cell| cell.set(report));
    }
}
