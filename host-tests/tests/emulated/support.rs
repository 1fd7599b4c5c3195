//! What tests need that run the firmware. Where QEMU or the target is missing they say so
//! and pass, except with `CI=true`, where they fail.

use std::io::Write;
use std::path::PathBuf;
use std::sync::OnceLock;

use host_tests::emulator::{Board, Emulator, EmulatorError, Pace, build_image};

/// Whether a missing tool is a failure.
pub fn is_ci() -> bool {
    std::env::var("CI").as_deref() == Ok("true")
}

/// The value, or `None` where a tool is missing and may be.
pub fn installed<T>(result: Result<T, EmulatorError>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(error) if error.is_missing_tool() && !is_ci() => {
            // written to the stream itself, because the test harness hides what is printed
            let _ = writeln!(std::io::stderr(), "SKIPPED, not passed: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// The images of the emulated board, built once.
pub fn images() -> Option<&'static [PathBuf]> {
    static IMAGES: OnceLock<Option<Vec<PathBuf>>> = OnceLock::new();
    IMAGES
        .get_or_init(|| installed(build_image(Board::Mps2An386)))
        .as_deref()
}

/// The booted board.
pub fn emulator(pace: Pace) -> Option<Emulator> {
    installed(Emulator::start_at(&images()?[0], pace))
}
