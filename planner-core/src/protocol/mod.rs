//! The serial command protocol: Grbl 1.1's, so that its senders drive the robot.
//!
//! | step | from | to |
//! |---|---|---|
//! | [`Controller::receive`] | a byte of the link | a wish (realtime), or a line in the [`inbox`] |
//! | [`Controller::step`] | wishes, lines, [`Report`]s of the motion, time | [`Step`]s: say, order, keep, wait |
//!
//! The controller is a state machine without I/O; the shell around it (the firmware's
//! command task, or a test) moves bytes and obeys its steps. No byte, in whatever order, can
//! make it panic, block or forget an answer: every line gets exactly one `ok` or `error:N`,
//! unless a reset comes before.

mod alarm;
mod controller;
mod cycle_start;
mod dollar;
mod homing;
mod identification;
pub mod inbox;
mod overrides;
mod record;
mod refusal;
mod reply;
mod report;
mod settings;
mod status;
mod text;

pub use alarm::Alarm;
pub use controller::{Controller, Identity, Step};
pub use dollar::{Description, Dollar, Restore};
pub use homing::HomingConfig;
pub use identification::NO_RECORD;
pub use overrides::Rates;
pub use record::{KeptText, RECORD_BYTES, Record, TEXT_BYTES};
pub use refusal::{ERRORS, Refusal};
pub use report::{Health, Inputs, Report};
pub use settings::{GROUPS, Kind, ProtocolConfig, SETTINGS, Setting, Settings};
pub use status::{Coordinates, State};
pub use text::Text;
