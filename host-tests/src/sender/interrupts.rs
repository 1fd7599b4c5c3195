//! Ctrl-C, and what else asks a program to end.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// Signals since the last look.
pub struct Interrupts {
    ctrl_c: Arc<AtomicBool>,
    end: Arc<AtomicBool>,
}

impl Interrupts {
    /// From now on they end nothing by themselves.
    ///
    /// # Errors
    /// The system refuses.
    pub fn watch() -> io::Result<Self> {
        let ctrl_c = Arc::new(AtomicBool::new(false));
        let end = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(SIGINT, Arc::clone(&ctrl_c))?;
        for signal in [SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, Arc::clone(&end))?;
        }
        Ok(Self { ctrl_c, end })
    }

    /// Whether Ctrl-C was hit since the last question.
    #[must_use]
    pub fn take_ctrl_c(&self) -> bool {
        self.ctrl_c.swap(false, Ordering::Relaxed)
    }

    /// Whether the program is to end, with nobody there to ask.
    #[must_use]
    pub fn must_end(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }
}
