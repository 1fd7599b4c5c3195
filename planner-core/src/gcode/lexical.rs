//! Which characters of a line mean anything.

/// Where a scan of one line stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Lexical {
    /// In the words. `(` and `;` leave it.
    #[default]
    Words,
    /// Behind `(`. `)` or the end of the line leaves it; a `;` or another `(` does not.
    Parentheses,
    /// Behind `;`. Only the end of the line leaves it.
    Semicolon,
}

impl Lexical {
    /// Takes the next byte of a line and returns it in upper case if it means anything.
    ///
    /// As in Grbl, comments, spaces, control characters and the block delete `/`
    /// mean nothing, wherever they stand (a deleted block is executed). So do
    /// bytes above 0x7E, which the receiver has dropped from a link's lines.
    pub(super) fn significant(&mut self, byte: u8) -> Option<u8> {
        match (*self, byte) {
            (Self::Words, b'(') => *self = Self::Parentheses,
            (Self::Words, b';') => *self = Self::Semicolon,
            (Self::Words, b'/') => {}
            (Self::Words, b'!'..=b'~') => return Some(byte.to_ascii_uppercase()),
            (Self::Parentheses, b')') => *self = Self::Words,
            _ => {}
        }
        None
    }
}
