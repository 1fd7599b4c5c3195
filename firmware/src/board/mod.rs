//! The seam between the tasks and the boards.
//!
//! Only the files beside this one name pins, peripherals and HAL types. Each board's has
//! a function `start` that sets its board up, once, and yields a [`Board`], and a
//! future `idle` for the thread that has nothing else to do; the feature of the
//! same name chooses the board.

use core::future::Future;

use embassy_executor::SendSpawner;
use planner_core::motion::Setpoint;
use planner_core::pose::JointPosition;
#[cfg(doc)]
use planner_core::protocol::Inputs;

#[cfg(feature = "mps2-an386")]
mod mps2_an386;
#[cfg(feature = "nucleo-g474re")]
mod nucleo_g474re;
mod stack;

pub use stack::{StackUse, stack_use};

#[cfg(all(feature = "mps2-an386", not(feature = "nucleo-g474re")))]
pub use mps2_an386::*;
#[cfg(all(feature = "nucleo-g474re", not(feature = "mps2-an386")))]
pub use nucleo_g474re::*;

#[cfg(all(feature = "mps2-an386", feature = "nucleo-g474re"))]
compile_error!("choose one board: `nucleo-g474re` is the default, so add --no-default-features");
#[cfg(not(any(feature = "mps2-an386", feature = "nucleo-g474re")))]
compile_error!("choose a board: feature `nucleo-g474re` or `mps2-an386`");

/// What a board gives the tasks.
pub struct Board<I, O, S, M, D, A, F, W, T> {
    /// Commands come in here.
    pub command_in: I,
    /// Answers go out here.
    pub command_out: O,
    /// Setpoints go out here.
    pub setpoint_out: S,
    /// Samples of the accelerometer come in here: the setpoint port's other direction.
    pub sample_in: M,
    /// Drives the gripper and the blow-off.
    pub outputs: D,
    /// Senses the arm.
    pub arm: A,
    /// Keeps the settings over power-off, in the board's range `STORE`.
    pub flash: F,
    /// Resets the board when the control task does not keep up.
    pub watchdog: W,
    /// Measures the tick.
    pub stopwatch: T,
    /// The executor above everything but the time driver.
    pub control: SendSpawner,
    /// The executor below it and above the thread.
    pub setpoints: SendSpawner,
}

/// A serial port's receiving side.
pub trait ByteIn {
    /// Waits for bytes, at least one, and says how many it put `into` the buffer.
    /// Bytes stay in order, and none is lost when the future is dropped.
    fn read(&mut self, into: &mut [u8]) -> impl Future<Output = usize>;
}

/// A serial port's sending side.
pub trait ByteOut {
    /// Sends all `bytes`.
    fn write_all(&mut self, bytes: &[u8]) -> impl Future<Output = ()>;
}

/// The digital outputs.
pub trait Outputs {
    /// Switches all of them: bit 0 the gripper, bit 1 the blow-off.
    fn set(&mut self, bits: u8);
}

/// What the board senses of the arm.
pub trait Arm {
    /// The inputs, a bit each as in [`Inputs::to_bits`]; 1 is a low level, a switch to ground.
    fn inputs(&mut self) -> u8;
    /// What the drives' absolute encoders read, if the board is told.
    fn encoders(&self) -> Option<JointPosition>;
    /// The setpoint that goes to the drives in this tick.
    fn follow(&mut self, setpoint: &Setpoint);
}

/// The board's watchdog, running since the start.
pub trait Watchdog {
    /// All is well for another [`WATCHDOG_MS`].
    fn feed(&mut self);
}

/// How long the control task may miss its deadline before the watchdog resets the board.
pub const WATCHDOG_MS: u32 = 20;

/// Measures short stretches of code in the board's own unit.
pub trait Stopwatch {
    /// What is counted.
    const UNIT: &'static str;
    /// The beginning of a stretch.
    fn now(&self) -> u32;
    /// What has been counted since `start`, without the reading itself.
    fn since(&self, start: u32) -> u32;
}
