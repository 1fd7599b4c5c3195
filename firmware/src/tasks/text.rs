//! An answer, put together before it is sent.

use core::fmt;

/// The longest answer.
const CAPACITY: usize = 192;

/// Text that is cut short rather than refused.
#[derive(Default)]
pub struct Text(heapless::Vec<u8, CAPACITY>);

impl Text {
    /// `parts` and CRLF; cut so that the CRLF always has its place.
    pub fn line(parts: fmt::Arguments<'_>) -> Self {
        let mut text = Self::default();
        // A full text is the only error, and a shortened sentence is what we want then.
        let _ = fmt::write(&mut text, parts);
        text.0.truncate(CAPACITY - 2);
        let _ = text.0.extend_from_slice(b"\r\n");
        text
    }

    /// The bytes to send.
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
