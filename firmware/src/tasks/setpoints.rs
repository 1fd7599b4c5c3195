//! The setpoint task: every tick's frame goes out to the drives.
//!
//! It runs in an interrupt executor of its own, above planning, so that a long
//! plan delays no setpoint, and below the control task.

use crate::board::ByteOut;
use crate::tasks::control::Frames;

/// Sends frames for ever.
pub async fn run(frames: &'static Frames, mut port: impl ByteOut) -> ! {
    loop {
        let frame = frames.receive().await;
        port.write_all(&frame.encode()).await;
    }
}
