//! G-code in Grbl's dialect: bytes to lines, lines to words, words to commands.
//!
//! | step | from | to | full or wrong |
//! |---|---|---|---|
//! | [`LineBuffer`] | bytes of a link | text lines, realtime bytes | [`Received::Overflow`] |
//! | [`Line`] | one text line | words with exact decimals | [`Error`] |
//! | [`Interpreter`] | words, [`Modal`] state, [`Offsets`] | [`Command`] and what it leaves behind | [`Error`] |
//!
//! Every step is a pure state machine without I/O, and none can panic, whatever
//! the bytes. [`Interpreter::interpret`] changes nothing: the caller commits what
//! the line leaves behind once it has accepted the command, so that a line refused
//! by the planner leaves no trace.
//!
//! The parser is our own: the crate `gcode` (0.7) reads numbers as `f32`, takes
//! `X1 0` for two tokens and recovers from errors where Grbl names them by number.

mod arc;
mod block;
mod code;
mod command;
mod error;
mod interpreter;
mod lexical;
mod line;
mod modal;
mod motion;
mod number;
mod offset_words;
mod offsets;
mod parser_state;
mod position;
mod receiver;
mod robot_words;

pub use command::{
    BLOW_OFF, Command, Feed, GRIPPER, HopMove, MAX_ACTIONS_A_LINE, Move, ProgramFlow, RobotChange,
};
pub use error::Error;
pub use interpreter::{Interpreted, Interpreter};
pub use line::{Line, MAX_WORDS, Word, crc16};
pub use modal::{Coolant, Defaults, Distance, FeedMode, Modal, Motion, Plane, Spindle, Units};
pub use number::{Decimal, NumberError};
pub use offsets::{Offsets, WORK_SYSTEMS};
pub use parser_state::ParserState;
pub use receiver::{LineBuffer, MAX_LINE_BYTES, Received};
