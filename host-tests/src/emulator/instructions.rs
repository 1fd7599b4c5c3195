//! Counting instructions on the emulated Cortex-M4F.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::time::Duration;

use super::EmulatorError;
use super::qemu::{Pace, Qemu};

/// A measurement that says nothing for so long has stopped.
const LINE_S: u64 = 60;

/// Runs the image that measures pieces of code, and yields the instructions of each
/// by its name. A count may be one off; the same image counts the same every time.
pub fn measure_instructions(image: &Path) -> Result<BTreeMap<String, u64>, EmulatorError> {
    let (mut qemu, [port]) = Qemu::boot(image, Pace::Free, None)?;
    port.set_read_timeout(Some(Duration::from_secs(LINE_S)))?;
    let mut counts = BTreeMap::new();
    for line in BufReader::new(port).lines() {
        let line = line.map_err(|_| EmulatorError::Silent(LINE_S, "a measurement"))?;
        if line == "end" {
            return Ok(counts);
        }
        match line.split_once(' ').map(|(name, n)| (name, n.parse())) {
            Some((name, Ok(count))) => {
                counts.insert(name.to_owned(), count);
            }
            _ if line.is_empty() => {}
            _ => return Err(EmulatorError::Unforeseen(line)),
        }
    }
    Err(qemu.epitaph())
}
