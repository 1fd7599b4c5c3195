//! One text line as words.

use crc::{CRC_16_IBM_3740, Crc};
use heapless::Vec;

use super::error::Error;
use super::lexical::Lexical;
use super::number::{Decimal, NumberError};
use super::receiver::MAX_LINE_BYTES;

/// Most words in one line: a line that says nothing twice has at most one of each
/// of the 14 value letters and of the 15 modal groups.
pub const MAX_WORDS: usize = 32;

/// A letter and its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// `A` to `Z` in upper case.
    pub letter: u8,
    /// The number as written: of a command (38.2 in `G38.2`) or a value in the
    /// line's units.
    pub value: Decimal,
}

/// The words of one line, in their order.
///
/// Grbl's lexical rules hold: spaces and control characters mean nothing anywhere
/// (`X1 0` is `X10`), `( )` and `;` comments are dropped, lower case is accepted,
/// `/` is ignored. What the words mean is the [`Interpreter`](super::Interpreter)'s
/// business.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// Letters and values apart, so that a line is no larger than it must be: it is moved.
    letters: Vec<u8, MAX_WORDS>,
    values: Vec<Decimal, MAX_WORDS>,
    has_checksum: bool,
}

impl Line {
    /// Reads one line, given without its line end. No words is a line, too.
    ///
    /// A `*` and a number end the words: the checksum of all bytes before the `*`, which is
    /// verified. It is their exclusive or (RepRap's convention), or in five digits their
    /// [`crc16`], which also finds what two faults leave of a line. One flipped bit makes
    /// `*` the begin of a comment, so a link that relies on checksums has to insist on
    /// [`Line::has_checksum`].
    ///
    /// # Errors
    /// - [`Error::LineTooLong`]: more than [`MAX_LINE_BYTES`] characters that mean something
    /// - [`Error::ExpectedLetter`]: a word begins with something else
    /// - [`Error::Number`]: a letter without a proper number
    /// - [`Error::Checksum`]: not a number, or not this line's
    /// - [`Error::TooManyWords`]: more than [`MAX_WORDS`]
    pub fn parse(text: &[u8]) -> Result<Self, Error> {
        let mut compact: Vec<u8, MAX_LINE_BYTES> = Vec::new();
        let mut lexical = Lexical::default();
        let mut covered = text;
        let mut in_checksum = false;
        for (i, &byte) in text.iter().enumerate() {
            let Some(significant) = lexical.significant(byte) else {
                continue;
            };
            if significant == b'*' && !in_checksum {
                in_checksum = true;
                covered = text.get(..i).unwrap_or(text);
            }
            compact.push(significant).map_err(|_| Error::LineTooLong)?;
        }
        Self::parse_compact(&compact, covered)
    }

    /// The words, in their order.
    pub fn words(&self) -> impl DoubleEndedIterator<Item = Word> {
        let words = self.letters.iter().zip(&self.values);
        words.map(|(&letter, &value)| Word { letter, value })
    }

    /// The values of the words, in their order.
    pub(super) fn values(&self) -> &[Decimal] {
        &self.values
    }

    /// Whether it carried a checksum, and so the right one.
    #[must_use]
    pub const fn has_checksum(&self) -> bool {
        self.has_checksum
    }

    /// The N word, or the last one if there are several; decimals are cut off. It may be
    /// negative in a line that sets the number.
    #[must_use]
    pub fn number(&self) -> Option<i32> {
        let word = self.words().rev().find(|word| word.letter == b'N')?;
        i32::try_from(word.value.integer()).ok()
    }

    /// Whether it does nothing but set the line number: `M110 N7`, or as some senders say
    /// it, `N-1 M110 N-1`. The next line has the number that follows.
    #[must_use]
    pub fn sets_number(&self) -> bool {
        let m110 = Word {
            letter: b'M',
            value: Decimal::from_integer(110),
        };
        let mut is_set = false;
        self.words().all(|word| {
            is_set |= word == m110;
            word.letter == b'N' || word == m110
        }) && is_set
    }

    fn push(&mut self, word: Word) -> Result<(), Error> {
        let letter = self.letters.push(word.letter);
        letter.map_err(|_| Error::TooManyWords)?;
        self.values
            .push(word.value)
            .map_err(|_| Error::TooManyWords)
    }

    /// Reads characters that all mean something; a checksum among them is that of `covered`.
    fn parse_compact(mut text: &[u8], covered: &[u8]) -> Result<Self, Error> {
        let mut line = Self::default();
        while let [letter, after @ ..] = text {
            match *letter {
                b'*' => {
                    verify_checksum(after, covered)?;
                    line.has_checksum = true;
                    break;
                }
                letter @ b'A'..=b'Z' => {
                    let (word, rest) = parse_word(letter, after)?;
                    line.push(word)?;
                    text = rest;
                }
                found => return Err(Error::ExpectedLetter { found }),
            }
        }
        Ok(line)
    }
}

/// Reads the number of a word, and what follows it.
fn parse_word(letter: u8, text: &[u8]) -> Result<(Word, &[u8]), Error> {
    let wrong = |reason| Error::Number { letter, reason };
    match Decimal::parse_prefix(text).map_err(wrong)? {
        (_, [b'.', ..]) => Err(wrong(NumberError::SecondPoint)),
        (_, [b'+' | b'-', ..]) => Err(wrong(NumberError::NotDecimal)),
        (value, rest) => Ok((Word { letter, value }, rest)),
    }
}

/// The CRC-16 of a line's bytes: polynomial 0x1021, from 0xFFFF (CRC-16/IBM-3740).
#[must_use]
pub fn crc16(bytes: &[u8]) -> u16 {
    const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
    CRC.checksum(bytes)
}

/// Digits of a CRC-16 behind `*`, leading zeros included.
const CRC_DIGITS: usize = 5;

/// Compares the number behind `*` with what the bytes before it add up to.
fn verify_checksum(text: &[u8], covered: &[u8]) -> Result<(), Error> {
    let computed = if text.len() == CRC_DIGITS {
        crc16(covered)
    } else {
        u16::from(covered.iter().fold(0, |sum, byte| sum ^ byte))
    };
    if Decimal::parse(text) == Ok(Decimal::from_integer(i32::from(computed))) {
        Ok(())
    } else {
        Err(Error::Checksum { computed })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::String;
    use std::vec::Vec;
    use std::{format, vec};

    use proptest::prelude::*;

    use super::*;

    fn words(text: &str) -> String {
        let line = Line::parse(text.as_bytes()).unwrap();
        let words: Vec<String> = line
            .words()
            .map(|word| format!("{}{}", char::from(word.letter), word.value))
            .collect();
        words.join(" ")
    }

    #[test]
    fn lines_follow_grbls_lexical_rules() {
        for (text, expected) in [
            ("", ""),
            ("   \t", ""),
            ("G1 X10 Y-2.5 F100", "G1 X10 Y-2.5 F100"),
            ("g1x10y-2.5f100", "G1 X10 Y-2.5 F100"),
            ("X1 0 Y- 2 . 5", "X10 Y-2.5"),
            ("G1 (go (there) X1", "G1 X1"),
            ("G1 (; not this) X1 ; but this (X2", "G1 X1"),
            ("G1 (open to the end X1", "G1"),
            ("/G1 X1/0", "G1 X10"),
            ("N10 G38.2 Z-1", "N10 G38.2 Z-1"),
            ("G91.1 G64 P.05", "G91.1 G64 P0.05"),
            ("; a comment with a 1.2.3 *", ""),
            ("G01 X001", "G1 X1"),
            ("G1 X1\u{a0}\u{e4}", "G1 X1"),
            ("\r\x00\x08G1\x7f", "G1"),
        ] {
            assert_eq!(words(text), expected, "{text}");
        }
    }

    #[test]
    fn wrong_lines_are_named() {
        let number = |letter, reason| Error::Number { letter, reason };
        for (text, error) in [
            ("1", Error::ExpectedLetter { found: b'1' }),
            ("G1 )", Error::ExpectedLetter { found: b')' }),
            ("%", Error::ExpectedLetter { found: b'%' }),
            ("X1=2", Error::ExpectedLetter { found: b'=' }),
            ("G", number(b'G', NumberError::Empty)),
            ("XY1", number(b'X', NumberError::NotDecimal)),
            ("X nan", number(b'X', NumberError::NotDecimal)),
            ("X inf", number(b'X', NumberError::NotDecimal)),
            ("X--1", number(b'X', NumberError::SecondSign)),
            ("X1.2.3", number(b'X', NumberError::SecondPoint)),
            ("X1-2", number(b'X', NumberError::NotDecimal)),
            ("X.", number(b'X', NumberError::NoDigits)),
            ("F9999999999", number(b'F', NumberError::TooLarge)),
        ] {
            assert_eq!(Line::parse(text.as_bytes()), Err(error), "{text}");
        }
    }

    #[test]
    fn checksums_cover_every_byte_before_the_star() {
        // The RepRap wiki's example.
        assert_eq!(words("N3 T0*57"), "N3 T0");
        assert_eq!(words("N3 T0 *25"), "N3 T0");
        assert_eq!(words("N3 T0*5 7 "), "N3 T0");
        for text in ["N3 T0*56", "N3T0*57", "N3 T0*", "N3 T0*57X1", "N3 T0*313"] {
            assert!(
                matches!(Line::parse(text.as_bytes()), Err(Error::Checksum { .. })),
                "{text}"
            );
        }
    }

    #[test]
    fn numbers_and_checksums_let_a_sequence_be_checked() {
        for (text, number, has_checksum, sets_number) in [
            ("G1 X1", None, false, false),
            ("N3 T0*57", Some(3), true, false),
            ("N3.9 G0 X1", Some(3), false, false),
            ("N-1 M110 N-1*125", Some(-1), true, true),
            ("M110 N7", Some(7), false, true),
            ("N6 M110 N7", Some(7), false, true),
            ("M110", None, false, true),
            ("M110 N7 X1", Some(7), false, false),
            ("N999999999 X1", Some(999_999_999), false, false),
            ("", None, false, false),
        ] {
            let line = Line::parse(text.as_bytes()).unwrap();
            assert_eq!(line.number(), number, "{text}");
            assert_eq!(line.has_checksum(), has_checksum, "{text}");
            assert_eq!(line.sets_number(), sets_number, "{text}");
        }
        // One flipped bit, and the checksum is a comment.
        assert!(!Line::parse(b"N3 T0(57").unwrap().has_checksum());
    }

    #[test]
    fn full_is_an_error() {
        let mut text = vec![b'0'; MAX_LINE_BYTES + 1];
        text[0] = b'X';
        assert_eq!(Line::parse(&text), Err(Error::LineTooLong));
        assert!(Line::parse(&text[..MAX_LINE_BYTES]).is_ok());
        let spaced: Vec<u8> = text[..MAX_LINE_BYTES]
            .iter()
            .flat_map(|&byte| [b' ', byte])
            .collect();
        assert!(Line::parse(&spaced).is_ok());
        let comment = vec![b';'; 1 << 20];
        assert_eq!(Line::parse(&comment), Ok(Line::default()));
        let many = "X1".repeat(MAX_WORDS);
        assert!(Line::parse(many.as_bytes()).is_ok());
        assert_eq!(
            Line::parse((many + "X1").as_bytes()),
            Err(Error::TooManyWords)
        );
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_line_or_an_error(text: Vec<u8>) {
            let _ = Line::parse(&text);
        }

        #[test]
        fn words_read_back_exactly(
            words in prop::collection::vec((b'A'..=b'Z', -999_999_999_999_999_999_i64..=999_999_999_999_999_999), 0..8),
        ) {
            let text: String = words
                .iter()
                .map(|&(letter, nano)| format!("{}{} ", char::from(letter), Decimal::from_nano(nano)))
                .collect();
            let line = Line::parse(text.as_bytes()).unwrap();
            let read: Vec<(u8, i64)> = line.words().map(|word| (word.letter, word.value.to_nano())).collect();
            prop_assert_eq!(read, words);
        }
    }
}
