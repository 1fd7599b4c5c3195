//! The PC's end of the command link: what a sender needs to know of Grbl's dialect, and of what
//! Stillpoint adds to it.
//!
//! | from | through | to |
//! |---|---|---|
//! | a device, a TCP port | [`Connection`] | lines of text |
//! | a line of text | [`Reply`], [`StatusReport`], [`codes`] | what the controller says |
//! | a program | [`wire`] | lines as they go over the link |
//! | lines, replies | [`Streamer`]: character counting, or checksums and resending | bytes to send, an end |

mod address;
mod checked_stream;
pub mod codes;
mod connection;
mod flight;
mod known;
mod plain_stream;
mod reply;
mod status_report;
mod streamer;
#[cfg(test)]
mod streamer_tests;
pub mod wire;

pub use address::Address;
pub use connection::{Connection, Heard, LinkError, open_reader};
pub use known::Known;
pub use reply::Reply;
pub use status_report::{State, StatusReport};
pub use streamer::{ACKNOWLEDGE, Ending, Refusal, Streamer, StreamerConfig};

/// Grbl's realtime commands: single bytes, obeyed at once.
pub mod realtime {
    /// Asks for the status.
    pub const STATUS: u8 = b'?';
    /// Feed hold.
    pub const HOLD: u8 = b'!';
    /// Goes on after a hold.
    pub const RESUME: u8 = b'~';
    /// Forgets everything that waits, and says the banner.
    pub const SOFT_RESET: u8 = 0x18;
}
