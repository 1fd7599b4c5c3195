//! A line of an answer, put together before it is sent.

use core::fmt;

/// The longest line, its end included.
const CAPACITY: usize = 192;

/// Text that is cut short rather than refused.
#[derive(Clone, Debug, Default)]
pub struct Text(heapless::Vec<u8, CAPACITY>);

impl Text {
    /// `parts` and CRLF; cut so that the CRLF always has its place.
    #[must_use]
    pub fn line(parts: fmt::Arguments<'_>) -> Self {
        let mut text = Self::default();
        // A full text is the only error, and a shortened sentence is what we want then.
        let _ = fmt::write(&mut text, parts);
        text.0.truncate(CAPACITY - 2);
        let _ = text.0.extend_from_slice(b"\r\n");
        text
    }

    /// The bytes to send.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

impl fmt::Write for Text {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        let room = CAPACITY - self.0.len();
        let fits = part.as_bytes().get(..room).unwrap_or(part.as_bytes());
        let _ = self.0.extend_from_slice(fits);
        if fits.len() < part.len() {
            Err(fmt::Error)
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_is_cut_and_still_ends() {
        let text = Text::line(format_args!("{:400}", "x"));
        assert_eq!(text.as_bytes().len(), CAPACITY);
        assert!(text.as_bytes().ends_with(b" \r\n"));
    }
}
