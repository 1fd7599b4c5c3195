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

/// Room for lines.
///
/// What a sender may have under way always fits: a line's end becomes its length.
const CAPACITY: usize = RX_BYTES + LINE_BYTES + 1;

/// A line as received, without its end.
pub type Line = heapless::Vec<u8, LINE_BYTES>;

/// The mark of a line that was too long, or that came while there was no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

/// A queue of lines in one ring of bytes.
#[derive(Debug, Default)]
pub struct Inbox {
    records: Deque<u8, CAPACITY>,
    /// Lines that found no room, behind those that did: the sender ignores the flow control,
    /// and realtime bytes must get through nevertheless.
    lost: u32,
}

impl Inbox {
    /// No lines.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            records: Deque::new(),
            lost: 0,
        }
    }

    /// Whether no line waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.records.is_empty() && self.lost == 0
    }

    /// Room in bytes, as the status reports it.
    #[must_use]
    pub fn free_bytes(&self) -> usize {
        RX_BYTES.saturating_sub(self.records.len())
    }

    /// Appends a line.
    pub fn push(&mut self, line: &[u8]) {
        let length = u8::try_from(line.len()).unwrap_or(OVERFLOW);
        if length == OVERFLOW {
            self.push_too_long();
        } else if self.has_room_for(line.len()) {
            let _ = self.records.push_back(length);
            for &byte in line {
                let _ = self.records.push_back(byte);
            }
        } else {
            self.lost = self.lost.saturating_add(1);
        }
    }

    /// Appends the mark of a line that was too long.
    pub fn push_too_long(&mut self) {
        if self.has_room_for(0) {
            let _ = self.records.push_back(OVERFLOW);
        } else {
            self.lost = self.lost.saturating_add(1);
        }
    }

    /// Whether a line of so many bytes fits, and none before it is lost.
    fn has_room_for(&self, length: usize) -> bool {
        self.lost == 0 && self.records.len() + 1 + length <= CAPACITY
    }

    /// The first byte of the oldest line, 0 of an empty or lost one.
    #[must_use]
    pub fn first_byte(&self) -> Option<u8> {
        let mut bytes = self.records.iter();
        match bytes.next() {
            None if self.lost > 0 => Some(0),
            None => None,
            Some(&(0 | OVERFLOW)) => Some(0),
            Some(_) => bytes.next().copied(),
        }
    }

    /// The oldest line.
    pub fn pop(&mut self) -> Option<Result<Line, TooLong>> {
        match self.records.pop_front() {
            None if self.lost > 0 => {
                self.lost -= 1;
                Some(Err(TooLong))
            }
            None => None,
            Some(OVERFLOW) => Some(Err(TooLong)),
            Some(length) => {
                let bytes = (0..length).filter_map(|_| self.records.pop_front());
                Some(Ok(bytes.collect()))
            }
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.records.clear();
        self.lost = 0;
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
            inbox.push(&[b'x'; LINE_BYTES]);
            announced += LINE_BYTES + 1;
        }
        inbox.push(&[b'y'; 10]);
        assert!(core::iter::from_fn(|| inbox.pop()).all(|line| line.is_ok()));
    }

    #[test]
    fn lines_without_room_are_answered_too_and_behind_the_others() {
        let mut inbox = Inbox::new();
        for _ in 0..1000 {
            inbox.push(b"G1 X1");
        }
        let kept = core::iter::from_fn(|| inbox.pop().filter(|line| line.is_ok())).count();
        assert!(kept * 6 > RX_BYTES);
        inbox.push(b"G1 X2");
        let lost = core::iter::from_fn(|| inbox.pop()).take_while(|line| line.is_err());
        assert_eq!(lost.count(), 1000 - kept);
        inbox.push(b"G1 X3");
        assert_eq!(inbox.pop().unwrap().as_deref(), Ok(b"G1 X3".as_slice()));
    }
}
