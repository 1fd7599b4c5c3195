//! Sending a program to a controller, with somebody watching.
//!
//! | | |
//! |---|---|
//! | [`Session`] | the controller is there and answers questions |
//! | [`Borrowed`] settings | put in force for the program, and given back |
//! | [`run`] | the program goes out, the state comes in, the operator may intervene |
//! | [`LiveView`], [`TimeLeft`] | what the operator sees |
//! | [`Keyboard`], [`Interrupts`] | what the operator does |

mod borrowed;
mod interrupts;
mod keyboard;
mod live_view;
mod run;
mod session;
mod time_left;

pub use borrowed::Borrowed;
pub use interrupts::Interrupts;
pub use keyboard::Keyboard;
pub use live_view::LiveView;
pub use run::{Finish, Job, Sent, run};
pub use session::{Answer, Session, SessionError};
pub use time_left::TimeLeft;
