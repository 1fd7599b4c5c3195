//! Program files: G-code from disk, or the one built in.

use std::fmt;
use std::path::Path;

/// The corner path of the model's section 4.
const CORNER_PATH: &str = include_str!("../programs/corner-path.gcode");

/// A program's text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramFile {
    /// How errors and pictures call it.
    pub name: String,
    /// Its lines.
    pub text: String,
}

/// Why a program file cannot be used.
#[derive(Debug)]
pub enum ProgramFileError {
    /// The file is not there, or is none.
    Unreadable {
        /// The file's name.
        file: String,
        /// What the system says.
        error: std::io::Error,
    },
    /// Some bytes are no text.
    NotUtf8 {
        /// The file's name.
        file: String,
        /// The first such line, from 1.
        line: usize,
    },
}

impl fmt::Display for ProgramFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable { file, error } => {
                write!(
                    f,
                    "{file}: the program cannot be read ({error}): check its name"
                )
            }
            Self::NotUtf8 { file, line } => {
                write!(
                    f,
                    "{file}: line {line}: the line is not UTF-8: save the program as text"
                )
            }
        }
    }
}

impl std::error::Error for ProgramFileError {}

impl ProgramFile {
    /// Reads a file.
    ///
    /// # Errors
    /// [`ProgramFileError`] if it cannot be read as text.
    pub fn load(file: &Path) -> Result<Self, ProgramFileError> {
        let name = file.display().to_string();
        let bytes = match std::fs::read(file) {
            Ok(bytes) => bytes,
            Err(error) => return Err(ProgramFileError::Unreadable { file: name, error }),
        };
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self { name, text }),
            Err(error) => {
                let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
                let line = valid.iter().filter(|&&byte| byte == b'\n').count() + 1;
                Err(ProgramFileError::NotUtf8 { file: name, line })
            }
        }
    }

    /// The corner path that is built in.
    #[must_use]
    pub fn corner_path() -> Self {
        Self {
            name: "corner-path.gcode".into(),
            text: CORNER_PATH.into(),
        }
    }
}
