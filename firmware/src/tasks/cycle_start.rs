//! When queued moves begin: the one place that decides it.
//!
//! Moves that wait to begin, or that arrived while others were being executed,
//! begin when
//! - the queue is full: the planner sees as far ahead as it ever will, or
//! - the program is complete, or
//! - no byte of a line has arrived for [`QUIET`]: somebody typed a line, or the
//!   sender has no more to say before it sees something move. Realtime bytes do not
//!   count: senders ask for the status all the time.

use embassy_time::{Duration, Instant};

/// A sender that streams answers an `ok` much sooner than this.
pub const QUIET: Duration = Duration::from_millis(50);

/// Moves that wait for a start, and since when nothing was heard.
pub struct CycleStart {
    waiting: bool,
    complete: bool,
    last_byte: Instant,
}

impl CycleStart {
    /// Nothing waits.
    pub fn new(now: Instant) -> Self {
        Self {
            waiting: false,
            complete: false,
            last_byte: now,
        }
    }

    /// A byte of a line has arrived.
    pub fn heard(&mut self, now: Instant) {
        self.last_byte = now;
    }

    /// A move was queued.
    pub fn queued(&mut self) {
        self.waiting = true;
    }

    /// The program's end was read, which may have let its last moves go.
    pub fn completed(&mut self) {
        self.waiting = true;
        self.complete = true;
    }

    /// Whether moves wait for their start.
    pub fn is_waiting(&self) -> bool {
        self.waiting
    }

    /// When to ask again, should nothing happen until then.
    pub fn next_check(&self) -> Option<Instant> {
        self.waiting.then(|| self.last_byte + QUIET)
    }

    /// Whether to start now; says so once.
    pub fn is_due(&mut self, now: Instant, queue_is_full: bool) -> bool {
        let complete = core::mem::take(&mut self.complete);
        let due = self.waiting && (queue_is_full || complete || now >= self.last_byte + QUIET);
        if due {
            self.waiting = false;
        }
        due
    }
}
