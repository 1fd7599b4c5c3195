//! The firmware's setpoint port, frame by frame.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::thread;
use std::time::Duration;

use planner_core::motion::MotionState;
use planner_core::telemetry::{FrameDecoder, SetpointFrame};

use super::EmulatorError;

/// Frames come every virtual millisecond, whatever the motion does.
const FRAME_S: u64 = 30;

/// What passes between the port and the thread that reads it, besides frames.
#[derive(Default)]
struct Shared {
    lost: AtomicU32,
    bad: AtomicU32,
    resume_pauses: AtomicBool,
}

/// The port, read by a thread of its own: QEMU stops sending to one that is not read.
pub struct SetpointPort {
    frames: Receiver<SetpointFrame>,
    shared: Arc<Shared>,
}

impl SetpointPort {
    /// `commands` leads to the command port.
    pub fn new(mut stream: TcpStream, mut commands: TcpStream) -> Self {
        let (to_us, frames) = channel();
        let shared = Arc::new(Shared::default());
        let seen = Arc::clone(&shared);
        thread::spawn(move || {
            let mut decoder = FrameDecoder::new();
            let mut bytes = [0; 16 * 1024];
            let mut was_paused = false;
            while let Ok(count @ 1..) = stream.read(&mut bytes) {
                let decoded: Vec<_> = decoder.frames(&bytes[..count]).collect();
                // Before the frames: who has seen a frame has seen its damage.
                seen.lost.store(decoder.lost(), Ordering::Release);
                seen.bad.store(decoder.bad(), Ordering::Release);
                for frame in &decoded {
                    let is_paused = frame.setpoint.state == MotionState::Paused;
                    if is_paused && !was_paused && seen.resume_pauses.load(Ordering::Relaxed) {
                        // If the port is closed, who waits for its answers is told.
                        let _ = commands.write_all(b"~");
                    }
                    was_paused = is_paused;
                }
                if decoded.into_iter().any(|frame| to_us.send(frame).is_err()) {
                    break;
                }
            }
        });
        Self { frames, shared }
    }

    /// Whether a pause of the program (M0) is resumed as soon as it is seen.
    pub fn resume_pauses(&self, resume: bool) {
        self.shared.resume_pauses.store(resume, Ordering::Relaxed);
    }

    /// Forgets the frames that have arrived.
    pub fn forget(&mut self) {
        while !matches!(
            self.frames.try_recv(),
            Err(TryRecvError::Empty | TryRecvError::Disconnected)
        ) {}
    }

    /// The frames up to the one of tick `last`.
    pub fn until(&mut self, last: u32) -> Result<Vec<SetpointFrame>, EmulatorError> {
        let mut frames = Vec::new();
        loop {
            match self.frames.recv_timeout(Duration::from_secs(FRAME_S)) {
                Ok(frame) => {
                    frames.push(frame);
                    if frame.sequence >= last {
                        return Ok(frames);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    return Err(EmulatorError::Silent(FRAME_S, "a setpoint"));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(EmulatorError::Ended("the setpoint port closed".to_owned()));
                }
            }
        }
    }

    /// Frames lost and damaged since the boot.
    pub fn damage(&self) -> (u32, u32) {
        (
            self.shared.lost.load(Ordering::Acquire),
            self.shared.bad.load(Ordering::Acquire),
        )
    }
}
