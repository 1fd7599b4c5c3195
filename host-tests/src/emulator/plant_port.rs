//! A plant at the other end of the firmware's second port: it carries the setpoints out and
//! sends what its accelerometer or its drives answer back.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use planner_core::telemetry::FrameDecoder;

use crate::sensed_plant::SensedPlant;

/// A plant that follows the setpoints in threads of its own, one step a frame; they end with
/// the port.
pub struct PlantPort {
    plant: Arc<Mutex<SensedPlant>>,
}

impl PlantPort {
    /// Puts a plant at the end of the setpoint port. The setpoints go on through the stream, as
    /// they came; read it or drop it.
    ///
    /// # Errors
    /// There is no socket to be had.
    pub fn attach(port: TcpStream, plant: SensedPlant) -> io::Result<(Self, TcpStream)> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let onward = TcpStream::connect(listener.local_addr()?)?;
        let (setpoints, _) = listener.accept()?;
        port.set_nodelay(true)?;
        let plant = Arc::new(Mutex::new(plant));
        let theirs = Arc::clone(&plant);
        let mut to_port = port.try_clone()?;
        let (answers, to_send) = channel();
        let (read, to_follow) = channel();
        // Each waits for one thing only: QEMU takes in a few bytes a millisecond, and the firmware
        // drops setpoints that nobody reads.
        thread::spawn(move || read_on(port, &read));
        thread::spawn(move || follow(&to_follow, onward, &answers, &theirs));
        thread::spawn(move || {
            to_send
                .iter()
                .try_for_each(|answer: Vec<u8>| to_port.write_all(&answer))
        });
        Ok((Self { plant }, setpoints))
    }

    /// The plant as it is now.
    pub fn plant(&self) -> MutexGuard<'_, SensedPlant> {
        self.plant.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Carries out what was read until the port closes.
fn follow(
    read: &Receiver<Vec<u8>>,
    onward: TcpStream,
    answers: &Sender<Vec<u8>>,
    plant: &Mutex<SensedPlant>,
) {
    let mut onward = Some(onward);
    let mut decoder = FrameDecoder::new();
    for bytes in read {
        for frame in decoder.frames(&bytes) {
            let mut plant = plant.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(answer) = plant.answer(&frame)
                && answers.send(answer.encode()).is_err()
            {
                return;
            }
        }
        if let Some(stream) = &mut onward
            && stream.write_all(&bytes).is_err()
        {
            onward = None;
        }
    }
}

/// Reads on whatever the plant does.
fn read_on(mut port: TcpStream, read: &Sender<Vec<u8>>) {
    let mut bytes = [0; 16 * 1024];
    while let Ok(count @ 1..) = port.read(&mut bytes) {
        if read.send(bytes[..count].to_vec()).is_err() {
            break;
        }
    }
}
