//! The firmware on an emulated Cortex-M4F, run by QEMU.
//!
//! [`build_image`] makes the image, [`Emulator`] boots it and talks to its two
//! serial ports, [`EmulatedBoard`] leaves them to others, [`measure_instructions`]
//! runs the image that counts instructions.

mod command_port;
mod image;
mod instructions;
mod plant_port;
mod ports;
mod qemu;
mod run;
mod setpoint_port;

pub use command_port::Answer;
pub use image::{Board, build_image};
pub use instructions::measure_instructions;
pub use plant_port::PlantPort;
pub use ports::EmulatedBoard;
pub use qemu::{Pace, check_qemu};
pub use run::{Emulator, EmulatorRun, StackUse, TickStatistics};

use std::io;
use std::path::PathBuf;

/// Why the emulator did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// QEMU is not installed.
    #[error("QEMU for ARM is missing: install the package qemu-system-arm")]
    NoQemu,
    /// No installed compiler can build for the microcontroller; says what to install.
    #[error("{0}")]
    NoTarget(String),
    /// The firmware does not build.
    #[error("the firmware did not build: {0}")]
    Build(String),
    /// The image is not there.
    #[error("there is no firmware image {0}")]
    NoImage(PathBuf),
    /// QEMU ended, or never came up.
    #[error("QEMU ended: {0}")]
    Ended(String),
    /// The firmware answers nothing any more.
    #[error("the firmware was silent for {0} s while {1} was awaited")]
    Silent(u64, &'static str),
    /// The firmware panicked or said something unforeseen.
    #[error("the firmware said {0:?}")]
    Unforeseen(String),
    /// The firmware refused a setting or a line of the program.
    #[error("line {number} ({line}) was refused with error {code}: {message}")]
    Refused {
        /// Counted from 1, in the settings or in the program.
        number: usize,
        /// As sent.
        line: String,
        /// Grbl's number.
        code: u8,
        /// The reason in words.
        message: String,
    },
    /// Setpoints are missing from the stream.
    #[error("{lost} setpoint frames are missing and {bad} were damaged")]
    Lost {
        /// Gaps in the sequence.
        lost: u32,
        /// Damaged frames.
        bad: u32,
    },
    /// A socket, a pipe or a process failed.
    #[error("{0}")]
    Io(#[from] io::Error),
}

impl EmulatorError {
    /// Whether something has to be installed first.
    #[must_use]
    pub fn is_missing_tool(&self) -> bool {
        matches!(self, Self::NoQemu | Self::NoTarget(_))
    }
}
