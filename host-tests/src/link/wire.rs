//! A program as it goes over the link.
//!
//! Comments and blanks stay here: they would only cost time, and a realtime byte is obeyed even
//! inside of a comment.

use std::fmt;

/// Bytes that the controller takes out of the stream wherever they stand.
const REALTIME: [char; 3] = ['?', '!', '~'];

/// One line to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WireLine {
    /// Its number in the program file, from 1.
    pub number: usize,
    /// Its words, in ASCII, without blanks, comments and line end; never empty.
    pub text: String,
}

/// Why a line cannot be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WireError {
    /// Number of the line, from 1.
    pub line: usize,
    cause: Cause,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cause {
    Realtime(char),
    Foreign(char),
    Dollar,
}

impl fmt::Display for WireError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: ", self.line)?;
        match self.cause {
            Cause::Realtime(letter) => write!(
                f,
                "'{letter}' is a realtime command that would be obeyed at once: remove it"
            ),
            Cause::Foreign(letter) => write!(
                f,
                "{letter:?} is no G-code: remove it, or put it into a comment"
            ),
            Cause::Dollar => {
                f.write_str("a '$' line is for settings and no part of a program: remove it")
            }
        }
    }
}

impl std::error::Error for WireError {}

/// The lines of a program that hold something to send.
///
/// # Errors
/// The first line that no controller should get.
pub fn lines(program: &str) -> Result<Vec<WireLine>, WireError> {
    let mut found = Vec::new();
    for (index, line) in program.lines().enumerate() {
        let number = index + 1;
        let refused = |cause| WireError {
            line: number,
            cause,
        };
        let text = without_comments(line);
        if let Some(letter) = text.chars().find(|c| REALTIME.contains(c)) {
            return Err(refused(Cause::Realtime(letter)));
        }
        if let Some(letter) = text.chars().find(|c| !c.is_ascii_graphic()) {
            return Err(refused(Cause::Foreign(letter)));
        }
        if text.starts_with('$') {
            return Err(refused(Cause::Dollar));
        }
        if !text.is_empty() && text != "%" {
            found.push(WireLine { number, text });
        }
    }
    Ok(found)
}

fn without_comments(line: &str) -> String {
    let mut depth_is_one = false;
    let mut text = String::new();
    for letter in line.chars() {
        match letter {
            ')' if depth_is_one => depth_is_one = false,
            _ if depth_is_one => {}
            ';' => break,
            '(' => depth_is_one = true,
            _ if letter.is_whitespace() || letter.is_ascii_control() || letter == '\u{FEFF}' => {}
            _ => text.push(letter),
        }
    }
    text
}

/// A line with a number and a checksum, in the place of any it had: `N7G1X1*05316`.
///
/// The checksum is in five digits, which makes it a CRC-16 (polynomial 0x1021, from 0xFFFF): the
/// exclusive or of 3D printers misses every second fault that meets another one.
#[must_use]
pub fn checked(text: &str, number: u32) -> String {
    let text = text.split('*').next().unwrap_or_default();
    let after_n = text.strip_prefix(['N', 'n']);
    let bare = after_n.map_or(text, |rest| {
        rest.trim_start_matches(|c: char| c.is_ascii_digit())
    });
    with_checksum(&format!("N{number}{bare}"))
}

/// A line with its checksum.
#[must_use]
pub fn with_checksum(line: &str) -> String {
    let checksum = CRC.checksum(line.as_bytes());
    format!("{line}*{checksum:05}")
}

const CRC: crc::Crc<u16> = crc::Crc::<u16>::new(&crc::CRC_16_IBM_3740);

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(program: &str) -> Vec<String> {
        let lines = lines(program).unwrap();
        lines.into_iter().map(|line| line.text).collect()
    }

    #[test]
    fn comments_and_blanks_stay_here() {
        let program =
            "\u{FEFF}%\r\nG1 X1 (go! on?) Y2 ; 100 % überall ~\r\n\r\n(only this)\n\tg0 z1";
        assert_eq!(texts(program), ["G1X1Y2", "g0z1"]);
        assert_eq!(lines(program).unwrap()[1].number, 5);
        assert_eq!(texts("; nothing\n\n"), [""; 0]);
    }

    #[test]
    fn what_would_be_obeyed_at_once_is_not_sent() {
        for (program, sentence) in [
            ("G1 X1\nG1 X2 ! stop", "line 2: '!' is a realtime command"),
            ("G1 X1 ?", "line 1: '?'"),
            ("G1 Xü", "line 1: 'ü' is no G-code"),
            ("\n$RST=*", "line 2: a '$' line"),
        ] {
            let error = lines(program).unwrap_err().to_string();
            assert!(error.starts_with(sentence), "{error}");
        }
    }

    #[test]
    fn number_and_checksum_take_the_place_of_those_there_were() {
        // The check value of the catalogues for this CRC is 0x29B1 over "123456789".
        assert_eq!(CRC.checksum(b"123456789"), 0x29B1);
        let line = checked("G1X1", 7);
        assert_eq!(line, format!("N7G1X1*{:05}", CRC.checksum(b"N7G1X1")));
        assert_eq!(line.len(), "N7G1X1*".len() + 5);
        assert_eq!(checked("N120G1X1*9", 7), line);
    }
}
