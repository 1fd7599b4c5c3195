//! When queued moves begin: the one place that decides it.
//!
//! Moves that wait to begin, or that arrived while others were being executed,
//! begin when
//! - the queue is full: the planner sees as far ahead as it ever will, or
//! - the program is complete, or
//! - no byte of a line has arrived for [`QUIET_MS`]: somebody typed a line, or the
//!   sender has no more to say before it sees something move. Realtime bytes do not
//!   count: senders ask for the status all the time.

/// In milliseconds. A sender that streams answers an `ok` much sooner.
pub const QUIET_MS: u64 = 50;

/// Moves that wait for a start, and since when nothing was heard. Times are in ms.
#[derive(Clone, Copy, Debug, Default)]
pub struct CycleStart {
    waiting: bool,
    complete: bool,
    last_byte_ms: u64,
}

impl CycleStart {
    /// Nothing waits.
    pub const fn new() -> Self {
        Self {
            waiting: false,
            complete: false,
            last_byte_ms: 0,
        }
    }

    /// A byte of a line has arrived.
    pub fn heard(&mut self, now_ms: u64) {
        self.last_byte_ms = now_ms;
    }

    /// Nothing waits any more: what was queued is gone or began by another order.
    pub fn forget(&mut self) {
        self.waiting = false;
        self.complete = false;
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
    pub fn next_check(&self) -> Option<u64> {
        self.waiting.then(|| self.last_byte_ms + QUIET_MS)
    }

    /// Whether to start now; says so once.
    pub fn is_due(&mut self, now_ms: u64, queue_is_full: bool) -> bool {
        let complete = core::mem::take(&mut self.complete);
        let due =
            self.waiting && (queue_is_full || complete || now_ms >= self.last_byte_ms + QUIET_MS);
        if due {
            self.waiting = false;
        }
        due
    }
}
