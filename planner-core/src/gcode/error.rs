//! What is wrong with a line, by Grbl's numbers.

use core::fmt;

use crate::prefilter::Kind;

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
    /// 15: a jog beyond the range of an axis.
    JogOutOfRange {
        /// The axis.
        letter: u8,
    },
    /// 16: a jog with other words than axes, F, N, G20, G21, G53, G90 and G91.
    JogSyntax,
    /// 20: a G or M number that the robot does not have, or an L that G10 does not.
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
    /// 22: a feed move, and no feedrate given yet; in G93 and in a jog, not in its line.
    NoFeed,
    /// 23: decimals behind a command that has none, as in `G1.5`.
    NotAnInteger {
        /// `G` or `M`, or `P` of M100.
        letter: u8,
        /// Its number.
        number: Decimal,
    },
    /// 24: two commands of different groups that both use axis words, as in `G0 G92`.
    AxisConflict,
    /// 25: a value given twice.
    RepeatedWord {
        /// The word's letter.
        letter: u8,
    },
    /// 26: an arc, G10, G92, M103 or a jog without axis words.
    NoAxisWords,
    /// 27: N beyond 10,000,000.
    LineNumber,
    /// 28: G4 without P.
    NoDwellTime,
    /// 28: G10 with neither L nor P.
    NoOffsetKind,
    /// 29: G59.1 to G59.3, or G10 with P above 6.
    WorkOffset,
    /// 30: G53 while neither G0 nor G1 is active.
    MachineCoordinates,
    /// 31: axis words while G80 is active.
    AxisWordsWithoutMotion,
    /// 32: an arc whose target has no axis of its plane.
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
    /// 37: G43.1 with other axis words than Z alone.
    ToolLengthAxis,
    /// 38: T above 255.
    ToolNumber,
    /// 61: a target, or an offset, that no robot of ours can reach.
    OutOfRange {
        /// The axis.
        letter: u8,
    },
    /// 62: a motion before the robot's position is known.
    PositionUnknown,
    /// 63: the checksum is not this line's.
    Checksum {
        /// What the line's bytes add up to.
        computed: u16,
    },
    /// 64: more words than a line can use.
    TooManyWords,
    /// 65: G4 or G10 beside G64 (whose is P?), or M100 to M103 beside another command.
    OwnLine,
    /// 75: an arc in G18 or G19.
    ArcPlane,
    /// 76: M100 with a P that names no prefilter.
    NoSuchPrefilter,
    /// 80: G64 with both P and Q, or with a Q that is not a percentage.
    CornerOverlap,
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
            Self::JogOutOfRange { .. } => 15,
            Self::JogSyntax => 16,
            Self::UnsupportedCommand { .. } | Self::UnsupportedWord { .. } => 20,
            Self::ModalConflict { .. } => 21,
            Self::NoFeed => 22,
            Self::NotAnInteger { .. } => 23,
            Self::AxisConflict => 24,
            Self::RepeatedWord { .. } => 25,
            Self::NoAxisWords => 26,
            Self::LineNumber => 27,
            Self::NoDwellTime | Self::NoOffsetKind => 28,
            Self::WorkOffset => 29,
            Self::MachineCoordinates => 30,
            Self::AxisWordsWithoutMotion => 31,
            Self::NoAxisWordsInPlane => 32,
            Self::ArcDoesNotClose { .. } | Self::ArcWithoutChord => 33,
            Self::ArcTooSmall | Self::ArcTooLarge => 34,
            Self::NoArcOffsets => 35,
            Self::UnusedWord { .. } => 36,
            Self::ToolLengthAxis => 37,
            Self::ToolNumber => 38,
            Self::OutOfRange { .. } => 61,
            Self::PositionUnknown => 62,
            Self::Checksum { .. } => 63,
            Self::TooManyWords => 64,
            Self::OwnLine => 65,
            Self::ArcPlane => 75,
            Self::NoSuchPrefilter => 76,
            Self::CornerOverlap => 80,
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
            Self::JogOutOfRange { letter } => {
                return write!(
                    f,
                    "the jog takes {} beyond the number range: jog less far",
                    char::from(letter)
                );
            }
            Self::JogSyntax => {
                "a jog has axis words and F, and G20, G21, G53, G90 or G91: remove the others"
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
            Self::AxisConflict => "two commands want the axis words: give each its own line",
            Self::RepeatedWord { letter } => {
                return write!(f, "{} is given twice: keep one of them", char::from(letter));
            }
            Self::NoAxisWords => "a command lacks its axis words: give X, Y, Z or C",
            Self::LineNumber => {
                return write!(
                    f,
                    "the line number is too large: {MAX_LINE_NUMBER} is the most"
                );
            }
            Self::NoDwellTime => "G4 needs a time: give P in seconds",
            Self::NoOffsetKind => "G10 needs its kind: give L2 or L20, and P",
            Self::WorkOffset => {
                "there are six coordinate systems: use G54 to G59, and P0 to P6 with G10"
            }
            Self::MachineCoordinates => "G53 works with straight motion only: give G0 or G1",
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
            Self::ToolLengthAxis => "G43.1 sets the tool length: give Z and no other axis",
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
                "the position is unknown: home, or begin with an absolute G0 or G1 with X and Y"
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
            Self::OwnLine => {
                "G64 beside G4 or G10, or M100 to M103 beside others: give each its own line"
            }
            Self::ArcPlane => "an arc must lie in the XY plane: give G17 before it",
            Self::CornerOverlap => "G64 takes P in mm or Q of 0 to 100 percent: give one of them",
            Self::NoSuchPrefilter => {
                return write!(
                    f,
                    "there is no such prefilter: give M100 a P of 0 to {}",
                    Kind::ALL.len() - 1
                );
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
            (Error::JogOutOfRange { letter }, 15),
            (Error::JogSyntax, 16),
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
            (Error::NoOffsetKind, 28),
            (Error::WorkOffset, 29),
            (Error::MachineCoordinates, 30),
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
            (Error::ToolLengthAxis, 37),
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
            (Error::OwnLine, 65),
            (Error::ArcPlane, 75),
            (Error::NoSuchPrefilter, 76),
            (Error::CornerOverlap, 80),
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
