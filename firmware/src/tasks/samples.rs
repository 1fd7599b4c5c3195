//! The sample task: what the accelerometer or the drives answer is recorded while somebody wants
//! it.
//!
//! It shares the thread with the command task, which takes no line while a record is made.

use crate::board::ByteIn;
use crate::tasks::link::Link;

/// Bytes taken from the port at once: a frame and some more.
const READ_BYTES: usize = 32;

/// Listens for ever.
pub async fn run(link: &'static Link, mut port: impl ByteIn) -> ! {
    let mut bytes = [0; READ_BYTES];
    loop {
        let count = port.read(&mut bytes).await;
        let mut listener = link.listener().await;
        listener.hear(bytes.get(..count).unwrap_or(&bytes));
    }
}
