//! Stillpoint on the microcontroller: the boards, and the tasks that run the
//! planner core on them.
//!
//! ```text
//! command port -> inbox -> planner -> [move queue] -> motion -> [frames] -> setpoint port
//!                 `---- command task, thread ----'    control    setpoint task,
//!                                                     task,      middle interrupt
//!                                                     highest
//! ```
//!
//! | task | runs in | deadline | if it is missed |
//! |---|---|---|---|
//! | [`tasks::control`] | an interrupt above all but the time driver | one period, 1 ms | counted, not made up for; the watchdog is not fed |
//! | [`tasks::setpoints`] | an interrupt below it | four periods | frames are dropped and counted |
//! | [`tasks::command`] | the thread | none | `ok` comes later |
//!
//! The tasks know a board by the traits of [`board`] only. They hold no state but what passes
//! between them: moves in the core's queue, orders and reports in [`tasks::link`].
#![no_std]

pub mod board;
pub mod tasks;
