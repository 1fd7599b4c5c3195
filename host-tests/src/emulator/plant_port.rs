//! A plant at the other end of the firmware's second port: it carries the setpoints out and
//! sends the samples of its accelerometer back.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use planner_core::telemetry::FrameDecoder;

use crate::sensed_plant::SensedPlant;

/// A plant that follows the setpoints in a thread of its own, one step a frame. The thread ends
/// with the port.
pub struct PlantPort {
    plant: Arc<Mutex<SensedPlant>>,
    /// The setpoints go on here, as they came. Who drops it gets none.
    pub setpoints: TcpStream,
}

impl PlantPort {
    /// Puts a plant at the end of the setpoint port.
    ///
    /// # Errors
    /// There is no socket to be had.
    pub fn attach(port: TcpStream, plant: SensedPlant) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let onward = TcpStream::connect(listener.local_addr()?)?;
        let (setpoints, _) = listener.accept()?;
        port.set_nodelay(true)?;
        let plant = Arc::new(Mutex::new(plant));
        let theirs = Arc::clone(&plant);
        thread::spawn(move || follow(port, onward, &theirs));
        Ok(Self { plant, setpoints })
    }

    /// The plant as it is now.
    pub fn plant(&self) -> MutexGuard<'_, SensedPlant> {
        self.plant.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn follow(mut port: TcpStream, onward: TcpStream, plant: &Mutex<SensedPlant>) {
    let mut onward = Some(onward);
    let mut decoder = FrameDecoder::new();
    let mut bytes = [0; 4096];
    while let Ok(count @ 1..) = port.read(&mut bytes) {
        let bytes = &bytes[..count];
        let mut answers = Vec::new();
        {
            let mut plant = plant.lock().unwrap_or_else(PoisonError::into_inner);
            for frame in decoder.frames(bytes) {
                answers.extend(
                    plant
                        .answer(&frame)
                        .iter()
                        .flat_map(|sample| sample.encode()),
                );
            }
        }
        if port.write_all(&answers).is_err() {
            break;
        }
        if let Some(stream) = &mut onward
            && stream.write_all(bytes).is_err()
        {
            onward = None;
        }
    }
}
