//! Bytes of a link into lines and realtime commands.

use heapless::Vec;

use super::lexical::Lexical;

/// Longest line in bytes, without its end. Grbl has 80; 256 hold any line of the
/// senders and CAM programs known to us.
pub const MAX_LINE_BYTES: usize = 256;

/// Grbl's soft reset.
const SOFT_RESET: u8 = 0x18;

/// What the last byte completed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// Nothing yet.
    Nothing,
    /// A line, maybe an empty one: read it with [`LineBuffer::line`] before the next byte.
    Line,
    /// The end of a line that was too long: answer `error:11`. Its text is lost.
    Overflow,
    /// A realtime command, taken out of the stream:
    /// `?` status, `~` cycle start, `!` feed hold, 0x18 soft reset, 0x19 stop,
    /// 0x84 safety door, 0x85 jog cancel, 0x87 full status, 0x90 to 0x97 overrides.
    Realtime(u8),
}

/// Collects the bytes of a link into lines of at most [`MAX_LINE_BYTES`].
///
/// - A line ends with `\n`, `\r` or `\r\n`; every line is reported exactly once,
///   as [`Received::Line`] or [`Received::Overflow`], and so is an empty one.
/// - Realtime commands are found anywhere, also inside of lines and comments.
/// - Bytes above 0x7F are dropped unless they are realtime commands. So that a
///   comment in a foreign language commands nothing, the trailing bytes of a UTF-8
///   character are not; `U+0080` to `U+00BF` are the exception: some senders send
///   realtime commands as those.
/// - Once the buffer is full, spaces and comments are dropped and all else overflows:
///   a comment may be longer than the buffer, to the end of its line.
#[derive(Clone, Debug, Default)]
pub struct LineBuffer {
    text: Vec<u8, MAX_LINE_BYTES>,
    lexical: Lexical,
    /// The line goes on but its text does not fit.
    overflowed: bool,
    /// The text is a line that has been reported: the next byte begins a new one.
    complete: bool,
    /// The byte before was `\r`: a `\n` belongs to the same line end.
    after_return: bool,
    /// Bytes still to come of a UTF-8 character.
    utf8_trailing: u8,
}

impl LineBuffer {
    /// An empty buffer.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            text: Vec::new(),
            lexical: Lexical::Words,
            overflowed: false,
            complete: false,
            after_return: false,
            utf8_trailing: 0,
        }
    }

    /// Takes bytes up to the first that completes something; returns what it
    /// completed and the bytes that follow it.
    pub fn feed<'a>(&mut self, bytes: &'a [u8]) -> (Received, &'a [u8]) {
        let mut rest = bytes;
        while let [byte, after @ ..] = rest {
            rest = after;
            let received = self.push(*byte);
            if received != Received::Nothing {
                return (received, rest);
            }
        }
        (Received::Nothing, rest)
    }

    /// Takes one byte. A soft reset also forgets the line begun.
    pub fn push(&mut self, byte: u8) -> Received {
        let in_character = self.continues_character(byte);
        if !in_character && is_realtime(byte) {
            if byte == SOFT_RESET {
                self.clear();
            }
            return Received::Realtime(byte);
        }
        if !byte.is_ascii() {
            return Received::Nothing;
        }
        let after_return = core::mem::replace(&mut self.after_return, byte == b'\r');
        if after_return && byte == b'\n' {
            return Received::Nothing;
        }
        if self.complete {
            self.clear_line();
        }
        match byte {
            b'\n' | b'\r' => self.end_line(),
            _ => {
                self.store(byte);
                Received::Nothing
            }
        }
    }

    /// The line just reported: its bytes as received, without realtime commands,
    /// bytes above 0x7F and the line end. Empty at any other time.
    #[must_use]
    pub fn line(&self) -> &[u8] {
        if self.complete { &self.text } else { &[] }
    }

    /// Forgets everything received so far.
    pub fn clear(&mut self) {
        *self = Self::new();
    }

    /// Whether this byte is a trailing byte of a UTF-8 character that is no realtime command.
    fn continues_character(&mut self, byte: u8) -> bool {
        let trailing = matches!(byte, 0x80..=0xBF) && self.utf8_trailing > 0;
        self.utf8_trailing = match byte {
            0x80..=0xBF => self.utf8_trailing.saturating_sub(1),
            0xC3..=0xDF => 1,
            0xE0..=0xEF => 2,
            0xF0..=0xF4 => 3,
            _ => 0,
        };
        trailing
    }

    fn store(&mut self, byte: u8) {
        let significant = self.lexical.significant(byte).is_some();
        if self.text.push(byte).is_err() {
            self.overflowed |= significant;
        }
    }

    fn end_line(&mut self) -> Received {
        self.complete = true;
        if self.overflowed {
            self.text.clear();
            Received::Overflow
        } else {
            Received::Line
        }
    }

    fn clear_line(&mut self) {
        self.text.clear();
        self.lexical = Lexical::default();
        self.overflowed = false;
        self.complete = false;
    }
}

/// Whether a byte commands something on its own.
const fn is_realtime(byte: u8) -> bool {
    matches!(
        byte,
        b'?' | b'~' | b'!' | SOFT_RESET | 0x19 | 0x84 | 0x85 | 0x87 | 0x90..=0x97
    )
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec;
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    #[derive(Debug, PartialEq)]
    enum Event {
        Line(Vec<u8>),
        Overflow,
        Realtime(u8),
    }

    fn line(text: &[u8]) -> Event {
        Event::Line(text.to_vec())
    }

    fn events(buffer: &mut LineBuffer, mut bytes: &[u8]) -> Vec<Event> {
        let mut events = Vec::new();
        while !bytes.is_empty() {
            let (received, rest) = buffer.feed(bytes);
            bytes = rest;
            match received {
                Received::Nothing => assert!(rest.is_empty()),
                Received::Line => events.push(line(buffer.line())),
                Received::Overflow => {
                    assert_eq!(buffer.line(), b"");
                    events.push(Event::Overflow);
                }
                Received::Realtime(byte) => events.push(Event::Realtime(byte)),
            }
        }
        events
    }

    #[test]
    fn byte_vectors() {
        use Event::Realtime;
        let vectors: &[(&[u8], &[Event])] = &[
            (b"", &[]),
            (b"G0 X1", &[]),
            (b"G0 X1\n", &[line(b"G0 X1")]),
            (
                b"G0\rG1\nG2\r\nG3\n\r",
                &[
                    line(b"G0"),
                    line(b"G1"),
                    line(b"G2"),
                    line(b"G3"),
                    line(b""),
                ],
            ),
            (b"\n\n", &[line(b""), line(b"")]),
            (b"\r\n\r\n", &[line(b""), line(b"")]),
            (
                b"G0?X~1!\n",
                &[
                    Realtime(b'?'),
                    Realtime(b'~'),
                    Realtime(b'!'),
                    line(b"G0X1"),
                ],
            ),
            (b"G0\x18G1\n", &[Realtime(0x18), line(b"G1")]),
            (
                b"\x84\x85\x87\x90\x97\x19",
                &[
                    Realtime(0x84),
                    Realtime(0x85),
                    Realtime(0x87),
                    Realtime(0x90),
                    Realtime(0x97),
                    Realtime(0x19),
                ],
            ),
            // Meaningless high bytes.
            (b"G\xFF0\x80\x98\xA0\xC0\n", &[line(b"G0")]),
            // 0x90 as cncjs sends it, U+0090.
            (b"G0\xC2\x90\n", &[Realtime(0x90), line(b"G0")]),
            // A-umlaut, trade mark and dash contain 0x84, 0x84 and 0x93.
            (b"(\xC3\x84\xE2\x84\xA2\xE2\x80\x93)\n", &[line(b"()")]),
            (
                b"\xE2\x84?\x84\n",
                &[Realtime(b'?'), Realtime(0x84), line(b"")],
            ),
            (b"$J=G91 x1 f100\n", &[line(b"$J=G91 x1 f100")]),
            (
                b"a\rb\xC3\n\r?\n\n",
                &[line(b"a"), line(b"b"), line(b""), Realtime(b'?'), line(b"")],
            ),
        ];
        for (bytes, expected) in vectors {
            assert_eq!(
                events(&mut LineBuffer::new(), bytes),
                *expected,
                "{bytes:x?}"
            );
        }
    }

    #[test]
    fn too_long_a_line_overflows_once() {
        let mut buffer = LineBuffer::new();
        let mut bytes = vec![b'X'; 1 << 20];
        assert_eq!(events(&mut buffer, &bytes), []);
        assert_eq!(events(&mut buffer, b"?"), [Event::Realtime(b'?')]);
        assert_eq!(
            events(&mut buffer, b"\nG0\n"),
            [Event::Overflow, line(b"G0")]
        );
        bytes.truncate(MAX_LINE_BYTES);
        let fits = bytes.clone();
        bytes.push(b'\n');
        assert_eq!(events(&mut buffer, &bytes), [line(&fits)]);
        bytes.insert(0, b'X');
        assert_eq!(events(&mut buffer, &bytes), [Event::Overflow]);
        bytes.pop();
        bytes.extend(b" ;ends in a comment\n");
        assert_eq!(events(&mut buffer, &bytes), [Event::Overflow]);
    }

    #[test]
    fn comments_may_be_longer_than_the_buffer() {
        let mut bytes = b"G0 X1 ;".to_vec();
        bytes.resize(1 << 20, b'x');
        let stored = bytes[..MAX_LINE_BYTES].to_vec();
        bytes.push(b'\n');
        assert_eq!(events(&mut LineBuffer::new(), &bytes), [line(&stored)]);
        assert_eq!(
            super::super::Line::parse(&stored),
            super::super::Line::parse(b"G0X1")
        );
        // Words behind it do not fit.
        bytes[6] = b'(';
        bytes.pop();
        bytes.extend(b") Y1\n");
        assert_eq!(events(&mut LineBuffer::new(), &bytes), [Event::Overflow]);
    }

    proptest! {
        #[test]
        fn pieces_make_no_difference(bytes: Vec<u8>, cut: prop::sample::Index) {
            let whole = events(&mut LineBuffer::new(), &bytes);
            let (first, second) = bytes.split_at(cut.index(bytes.len() + 1));
            let mut buffer = LineBuffer::new();
            let mut pieces = events(&mut buffer, first);
            pieces.extend(events(&mut buffer, second));
            prop_assert_eq!(whole, pieces);
        }

        #[test]
        fn every_line_end_is_answered_once(lines in prop::collection::vec("[ -~&&[^?~!]]{0,300}", 0..8)) {
            let mut buffer = LineBuffer::new();
            for text in &lines {
                let mut bytes = text.clone().into_bytes();
                bytes.push(b'\n');
                prop_assert_eq!(events(&mut buffer, &bytes).len(), 1);
            }
        }
    }
}
