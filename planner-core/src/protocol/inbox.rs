//! Lines that wait for the planner.
//!
//! Bytes are taken out of the port and split into lines as they come, so that a
//! realtime byte is answered even while lines wait for room in the move queue.

use heapless::Deque;

/// Bytes of unanswered lines that a sender may have under way, line ends
/// included; announced by `$I`. Grbl's 128 would starve half-millimetre segments:
/// at 100 mm/s they need a line every 5 ms.
pub const RX_BYTES: usize = 1024;

/// The longest line kept. A record's length is one byte, and 255 means overflow.
pub const LINE_BYTES: usize = 254;

const OVERFLOW: u8 = u8::MAX;

/// Bytes that may be taken from the port at once, if [`Inbox::has_room`].
pub const READ_BYTES: usize = 64;

/// What one reading can add: a line that was almost complete, and shorter ones.
const RESERVE: usize = LINE_BYTES + 1 + READ_BYTES;

/// What a sender may have under way always fits: a line's end becomes its length.
const CAPACITY: usize = RX_BYTES + RESERVE;

/// A line as received, without its end.
pub type Line = heapless::Vec<u8, LINE_BYTES>;

/// The mark of a line that did not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

/// A queue of lines in one ring of bytes.
#[derive(Debug, Default)]
pub struct Inbox {
    records: Deque<u8, CAPACITY>,
}

impl Inbox {
    /// No lines.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            records: Deque::new(),
        }
    }

    /// Whether another reading would fit. If not, the sender ignores the flow
    /// control, and its bytes have to wait in the port.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.records.len() + RESERVE <= CAPACITY
    }

    /// Whether no line waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Room in bytes, as the status reports it.
    #[must_use]
    pub fn free_bytes(&self) -> usize {
        RX_BYTES.saturating_sub(self.records.len())
    }

    /// Appends a line; after a reading, for which there was room.
    pub fn push(&mut self, line: &[u8]) {
        match u8::try_from(line.len()) {
            Ok(length) if length != OVERFLOW => {
                let _ = self.records.push_back(length);
                for &byte in line {
                    let _ = self.records.push_back(byte);
                }
            }
            _ => self.push_too_long(),
        }
    }

    /// Appends the mark of a line that was too long; likewise.
    pub fn push_too_long(&mut self) {
        let _ = self.records.push_back(OVERFLOW);
    }

    /// The first byte of the oldest line, 0 of an empty or lost one.
    #[must_use]
    pub fn first_byte(&self) -> Option<u8> {
        let mut bytes = self.records.iter();
        match bytes.next()? {
            0 | &OVERFLOW => Some(0),
            _ => bytes.next().copied(),
        }
    }

    /// The oldest line.
    pub fn pop(&mut self) -> Option<Result<Line, TooLong>> {
        match self.records.pop_front()? {
            OVERFLOW => Some(Err(TooLong)),
            length => {
                let bytes = (0..length).filter_map(|_| self.records.pop_front());
                Some(Ok(bytes.collect()))
            }
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.records.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn lines_come_out_in_order_with_the_marks_of_the_lost() {
        let mut inbox = Inbox::new();
        inbox.push(b"G0 X1");
        inbox.push_too_long();
        inbox.push(b"");
        inbox.push(&[b'x'; LINE_BYTES + 1]);
        let all: Vec<_> = core::iter::from_fn(|| inbox.pop()).collect();
        assert_eq!(all.len(), 4);
        assert_eq!(all[0].as_deref(), Ok(b"G0 X1".as_slice()));
        assert_eq!(all[1], Err(TooLong));
        assert_eq!(all[2].as_deref(), Ok(b"".as_slice()));
        assert_eq!(all[3], Err(TooLong));
    }

    #[test]
    fn what_a_sender_may_have_under_way_always_fits() {
        let mut inbox = Inbox::new();
        let mut announced = 0;
        while announced + LINE_BYTES < RX_BYTES {
            assert!(inbox.has_room());
            inbox.push(&[b'x'; LINE_BYTES]);
            announced += LINE_BYTES + 1;
        }
        assert!(inbox.has_room());
    }
}
