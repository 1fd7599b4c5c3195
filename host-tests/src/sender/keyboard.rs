//! Single keys, without a line end, while Ctrl-C stays a signal.

use std::io::{self, Read};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::stdio::stdin;
use rustix::termios::{LocalModes, OptionalActions, Termios, isatty, tcgetattr, tcsetattr};

/// The terminal's keys. Dropping it gives the terminal back as it was.
pub struct Keyboard {
    before: Termios,
}

impl Keyboard {
    /// None if standard input is no terminal.
    #[must_use]
    pub fn open() -> Option<Self> {
        if !isatty(stdin()) {
            return None;
        }
        let before = tcgetattr(stdin()).ok()?;
        let mut settings = before.clone();
        settings.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
        tcsetattr(stdin(), OptionalActions::Now, &settings).ok()?;
        Some(Self { before })
    }

    /// The next key, if one was hit.
    #[must_use]
    pub fn key(&mut self) -> Option<u8> {
        let mut keys = [PollFd::from_borrowed_fd(stdin(), PollFlags::IN)];
        let hit = poll(&mut keys, Some(&Timespec::default())).ok()? > 0;
        let mut key = [0];
        // Locked and unbuffered reading are the same here: nobody else reads it.
        (hit && io::stdin().read(&mut key).ok()? == 1).then_some(key[0])
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        let _ = tcsetattr(stdin(), OptionalActions::Now, &self.before);
    }
}
