//! G-code in Grbl's dialect: bytes to lines, lines to words, words to commands.
//!
//! | step | from | to | full or wrong |
//! |---|---|---|---|
//! | [`LineBuffer`] | bytes of a link | text lines, realtime bytes | [`Received::Overflow`] |
//! | [`Line`] | one text line | words with exact decimals | [`Error`] |
//! | [`Interpreter`] | words, modal state | [`Command`] and the next [`Modal`] state | [`Error`] |
//!
//! Every step is a pure state machine without I/O, and none can panic, whatever
//! the bytes. [`Interpreter::interpret`] changes nothing: the caller commits the
//! new modal state once it has accepted the command, so that a line refused by
//! the planner leaves no trace.
//!
//! The parser is our own: the crate `gcode` (0.7) reads numbers as `f32`, takes
//! `X1 0` for two tokens and recovers from errors where Grbl names them by number.

mod arc;
mod block;
mod command;
mod error;
mod interpreter;
mod lexical;
mod line;
mod modal;
mod number;
mod receiver;

pub use command::{Command, Feed, Move};
pub use error::Error;
pub use interpreter::Interpreter;
pub use line::{Line, MAX_WORDS, Word};
pub use modal::{Defaults, Distance, Modal, Motion, Units};
pub use number::{Decimal, NumberError};
pub use receiver::{LineBuffer, MAX_LINE_BYTES, Received};
