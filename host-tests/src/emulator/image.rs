//! Building the firmware.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::EmulatorError;

/// Boards that the firmware knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// The real one, STM32G474RE.
    NucleoG474re,
    /// QEMU's.
    Mps2An386,
}

impl Board {
    /// The feature of the firmware that chooses it.
    #[must_use]
    pub fn feature(self) -> &'static str {
        match self {
            Self::NucleoG474re => "nucleo-g474re",
            Self::Mps2An386 => "mps2-an386",
        }
    }
}

/// Exit status of the script when no compiler has the target.
const NO_TARGET: i32 = 3;

/// Builds the images for a board and yields their paths: the firmware first, then,
/// on the emulated board, the one that counts instructions.
///
/// `firmware/build-image` chooses the compiler; what it and cargo say goes to
/// standard error, but for the last line of a failure, which is the error.
pub fn build_image(board: Board) -> Result<Vec<PathBuf>, EmulatorError> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/build-image");
    let mut child = Command::new(&script)
        .arg(board.feature())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| EmulatorError::Build(format!("{}: {error}", script.display())))?;

    // Standard output is a few paths and fits into the pipe until it is read below.
    let mut last = String::new();
    if let Some(stderr) = child.stderr.take() {
        for line in BufReader::new(stderr).lines() {
            let before = std::mem::replace(&mut last, line?);
            if !before.is_empty() {
                eprintln!("{before}");
            }
        }
    }
    let mut paths = String::new();
    if let Some(mut stdout) = child.stdout.take() {
        stdout.read_to_string(&mut paths)?;
    }
    let status = child.wait()?;
    if status.success() {
        eprintln!("{last}");
        Ok(paths.lines().map(PathBuf::from).collect())
    } else if status.code() == Some(NO_TARGET) {
        Err(EmulatorError::NoTarget(last))
    } else {
        Err(EmulatorError::Build(last))
    }
}
