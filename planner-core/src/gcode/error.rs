//! What is wrong with a line, by Grbl's numbers.

use core::fmt;

use super::block::MAX_TOOL;
use super::interpreter::MAX_LINE_NUMBER;
use super::line::MAX_WORDS;
use super::number::{Decimal, NumberError};
use super::receiver::MAX_LINE_BYTES;

/// Why a line was refused. Nothing of a refused line is executed.
///
/// Letters are upper case. The variants stand in the order of [`Error::code`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Error {
    /// 1: a word begins with something other than a letter.
    ExpectedLetter {
        /// The character found instead.
        found: u8,
    },
    /// 2, or 60 if it is [`NumberError::TooLarge`]: a letter without a proper number.
    Number {
        /// The word's letter.
        letter: u8,
        /// What is wrong with its number.
        reason: NumberError,
    },
    /// 4: F, N, P, S or T below zero.
    Negative {
        /// The word's letter.
        letter: u8,
    },
    /// 11: more characters than a line may have.
    LineTooLong,
    /// 20: a G or M number that the robot does not have.
    UnsupportedCommand {
        /// `G` or `M`.
        letter: u8,
        /// Its number.
        number: Decimal,
    },
    /// 20: a letter that means nothing to the robot.
    UnsupportedWord {
        /// The word's letter.
        letter: u8,
    },
    /// 21: two commands of one modal group in a line, as in `G0 G1`.
    ModalConflict {
        /// `G` or `M`.
        letter: u8,
        /// The number of the second one.
        number: Decimal,
    },
    /// 22: a feed move, and no feedrate given yet.
    NoFeed,
    /// 23: decimals behind a command that has none, as in `G1.5`.
    NotAnInteger {
        /// `G` or `M`.
        letter: u8,
        /// Its number.
        number: Decimal,
    },
    /// 24: G49 and a motion in one line.
    AxisConflict,
    /// 25: a value given twice.
    RepeatedWord {
        /// The word's letter.
        letter: u8,
    },
    /// 26: an arc without a target.
    NoAxisWords,
    /// 27: N beyond 10,000,000.
    LineNumber,
    /// 28: G4 without P.
    NoDwellTime,
    /// 29: G55 to G59.
    WorkOffset,
    /// 31: axis words while G80 is active.
    AxisWordsWithoutMotion,
    /// 32: an arc whose target has neither X nor Y.
    NoAxisWordsInPlane,
    /// 33: start and target of an arc lie at unequal distances from its centre.
    ArcDoesNotClose {
        /// The difference in millimetres.
        difference_mm: f32,
    },
    /// 33: an arc by its radius that ends where it starts.
    ArcWithoutChord,
    /// 34: a radius that does not reach from start to target, or is zero.
    ArcTooSmall,
    /// 34: a radius above 1 km, which is a line to the robot.
    ArcTooLarge,
    /// 35: an arc with neither I, J nor R.
    NoArcOffsets,
    /// 36: a word that no command of the line uses.
    UnusedWord {
        /// The word's letter.
        letter: u8,
    },
    /// 38: T above 255.
    ToolNumber,
    /// 61: a target that no robot of ours can reach.
    OutOfRange {
        /// The axis.
        letter: u8,
    },
    /// 62: a motion before the robot's position is known.
    PositionUnknown,
    /// 63: the checksum is not this line's.
    Checksum {
        /// What the line's bytes add up to.
        computed: u8,
    },
    /// 64: more words than a line can use.
    TooManyWords,
    /// 65: two of motion, G4, M0, M2 and M30 in one line, or G4 beside G64: whose is P?
    OneActionPerLine,
}

impl Error {
    /// The number to report: Grbl's, or 60 and up where Grbl has none.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::ExpectedLetter { .. } => 1,
            Self::Number {
                reason: NumberError::TooLarge,
                ..
            } => 60,
            Self::Number { .. } => 2,
            Self::Negative { .. } => 4,
            Self::LineTooLong => 11,
            Self::UnsupportedCommand { .. } | Self::UnsupportedWord { .. } => 20,
            Self::ModalConflict { .. } => 21,
            Self::NoFeed => 22,
            Self::NotAnInteger { .. } => 23,
            Self::AxisConflict => 24,
            Self::RepeatedWord { .. } => 25,
            Self::NoAxisWords => 26,
            Self::LineNumber => 27,
            Self::NoDwellTime => 28,
            Self::WorkOffset => 29,
            Self::AxisWordsWithoutMotion => 31,
            Self::NoAxisWordsInPlane => 32,
            Self::ArcDoesNotClose { .. } | Self::ArcWithoutChord => 33,
            Self::ArcTooSmall | Self::ArcTooLarge => 34,
            Self::NoArcOffsets => 35,
            Self::UnusedWord { .. } => 36,
            Self::ToolNumber => 38,
            Self::OutOfRange { .. } => 61,
            Self::PositionUnknown => 62,
            Self::Checksum { .. } => 63,
            Self::TooManyWords => 64,
            Self::OneActionPerLine => 65,
        }
    }
}

/// One sentence: what is wrong, and what to do.
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentence = match *self {
            Self::ExpectedLetter { found } => {
                let found = found.escape_ascii();
                return write!(
                    f,
                    "found `{found}` where a word begins: write a letter and a number"
                );
            }
            Self::Number { letter, reason } => {
                return write!(f, "word {}: {reason}", char::from(letter));
            }
            Self::Negative { letter } => {
                return write!(f, "{} is negative: give zero or more", char::from(letter));
            }
            Self::LineTooLong => {
                return write!(
                    f,
                    "the line is too long: split it, {MAX_LINE_BYTES} characters are the most"
                );
            }
            Self::UnsupportedCommand { letter, number } => {
                let letter = char::from(letter);
                return write!(f, "{letter}{number} is not supported: remove it");
            }
            Self::UnsupportedWord { letter } => {
                return write!(
                    f,
                    "word {} is not supported: the axes are X, Y, Z and C",
                    char::from(letter)
                );
            }
            Self::ModalConflict { letter, number } => {
                return write!(
                    f,
                    "{}{number} contradicts another command of the line: keep one of them",
                    char::from(letter)
                );
            }
            Self::NoFeed => "no feedrate: give F in mm/min before the first G1, G2 or G3",
            Self::NotAnInteger { letter, number } => {
                let letter = char::from(letter);
                return write!(f, "{letter}{number} does not exist: give a whole number");
            }
            Self::AxisConflict => "G49 cannot share a line with a motion: give it its own",
            Self::RepeatedWord { letter } => {
                return write!(f, "{} is given twice: keep one of them", char::from(letter));
            }
            Self::NoAxisWords => "the arc has no target: give X or Y",
            Self::LineNumber => {
                return write!(
                    f,
                    "the line number is too large: {MAX_LINE_NUMBER} is the most"
                );
            }
            Self::NoDwellTime => "G4 needs a time: give P in seconds",
            Self::WorkOffset => "there is one work offset only: use G54",
            Self::AxisWordsWithoutMotion => {
                "G80 has ended all motion: give G0, G1, G2 or G3 before an axis word"
            }
            Self::NoAxisWordsInPlane => "the arc's target lies outside of its plane: give X or Y",
            Self::ArcDoesNotClose { difference_mm } => {
                return write!(
                    f,
                    "the arc does not close: start and target differ by {difference_mm} mm in \
                     their distance from the centre: check I and J"
                );
            }
            Self::ArcWithoutChord => {
                "the arc ends where it starts: give I and J for a full circle, R cannot"
            }
            Self::ArcTooSmall => {
                "the radius is too small to reach from start to target: check R, I and J"
            }
            Self::ArcTooLarge => "the radius is larger than 1 km: use G1",
            Self::NoArcOffsets => "the arc has no centre: give I and J, or R",
            Self::UnusedWord { letter } => {
                return write!(
                    f,
                    "nothing in the line uses {}: remove it or add its command",
                    char::from(letter)
                );
            }
            Self::ToolNumber => {
                return write!(f, "the tool number is too large: {MAX_TOOL} is the most");
            }
            Self::OutOfRange { letter } => {
                return write!(
                    f,
                    "{} leaves the number range: keep within 4095 mm and 1440 degrees",
                    char::from(letter)
                );
            }
            Self::PositionUnknown => {
                "the position is unknown: begin with an absolute G0 or G1 that gives X and Y"
            }
            Self::Checksum { computed } => {
                return write!(f, "the checksum should be {computed}: send the line again");
            }
            Self::TooManyWords => {
                return write!(
                    f,
                    "the line has too many words: split it, {MAX_WORDS} are the most"
                );
            }
            Self::OneActionPerLine => {
                "the line asks for two things: give each motion, G4, M0, M2 and M30 its own"
            }
        };
        f.write_str(sentence)
    }
}

impl core::error::Error for Error {}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::format;

    use super::*;

    #[test]
    fn every_error_has_a_code_and_a_sentence() {
        let number = Decimal::from_nano(1_500_000_000);
        let letter = b'G';
        let errors = [
            (Error::ExpectedLetter { found: b'%' }, 1),
            (
                Error::Number {
                    letter,
                    reason: NumberError::Empty,
                },
                2,
            ),
            (Error::Negative { letter }, 4),
            (Error::LineTooLong, 11),
            (Error::UnsupportedCommand { letter, number }, 20),
            (Error::UnsupportedWord { letter }, 20),
            (Error::ModalConflict { letter, number }, 21),
            (Error::NoFeed, 22),
            (Error::NotAnInteger { letter, number }, 23),
            (Error::AxisConflict, 24),
            (Error::RepeatedWord { letter }, 25),
            (Error::NoAxisWords, 26),
            (Error::LineNumber, 27),
            (Error::NoDwellTime, 28),
            (Error::WorkOffset, 29),
            (Error::AxisWordsWithoutMotion, 31),
            (Error::NoAxisWordsInPlane, 32),
            (
                Error::ArcDoesNotClose {
                    difference_mm: 0.75,
                },
                33,
            ),
            (Error::ArcWithoutChord, 33),
            (Error::ArcTooSmall, 34),
            (Error::ArcTooLarge, 34),
            (Error::NoArcOffsets, 35),
            (Error::UnusedWord { letter }, 36),
            (Error::ToolNumber, 38),
            (
                Error::Number {
                    letter,
                    reason: NumberError::TooLarge,
                },
                60,
            ),
            (Error::OutOfRange { letter }, 61),
            (Error::PositionUnknown, 62),
            (Error::Checksum { computed: 57 }, 63),
            (Error::TooManyWords, 64),
            (Error::OneActionPerLine, 65),
        ];
        for (error, code) in errors {
            assert_eq!(error.code(), code, "{error:?}");
            let text = format!("{error}");
            assert!((20..140).contains(&text.len()), "{error:?}: {text}");
        }
        let sentence = format!("{}", Error::UnsupportedCommand { letter, number });
        assert_eq!(sentence, "G1.5 is not supported: remove it");
    }
}
