//! The stream of acceleration samples: one frame for each setpoint frame that wants one, back to
//! the controller.
//!
//! The sensor's node hears the setpoints ([`crate::telemetry`]) on the line's other direction, and
//! answers each frame that is marked so with what the tool's acceleration is then. The setpoint's
//! number comes back with it, so that it does not matter how long an answer takes.
//!
//! A frame is 16 bytes, little endian, and as [`crate::framing`] has it 22 bytes on the wire.
//!
//! | offset | field | |
//! |---|---|---|
//! | 0 | sequence | u32, that of the setpoint frame which it answers |
//! | 4 | acceleration | 3 × f32, along the robot's X, Y and Z, mm/s² |

use crate::framing;

/// Bytes of a frame on the wire, the closing zero included.
pub const SAMPLE_BYTES: usize = framing::wire_bytes(16);

/// One sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleFrame {
    /// Number of the setpoint frame that it answers.
    pub sequence: u32,
    /// Acceleration along X, Y and Z in mm/s², finite numbers.
    pub acceleration_mm_s2: [f32; 3],
}

impl SampleFrame {
    /// The frame as it goes on the wire.
    #[must_use]
    pub fn encode(&self) -> [u8; SAMPLE_BYTES] {
        framing::encode_numbered(self.sequence, self.acceleration_mm_s2)
    }

    /// The sample in a frame's body; none if it is another kind of frame.
    #[must_use]
    pub fn from_body(body: &[u8]) -> Option<Self> {
        let (sequence, acceleration_mm_s2) = framing::numbered(body)?;
        Some(Self {
            sequence,
            acceleration_mm_s2,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::framing::Decoder;

    /// Byte by byte: the layout is a promise to the sensor.
    #[test]
    fn the_layout_is_fixed() {
        let frame = SampleFrame {
            sequence: 0x0102_0304,
            acceleration_mm_s2: [1.0, -2.0, 0.0],
        };
        let wire = frame.encode();
        // sequence; 0x3F800000; 0xC0000000; 0, each zero a code that leads to the next one
        assert_eq!(wire[..7], [5, 4, 3, 2, 1, 1, 3]);
        assert_eq!(wire[7..9], [0x80, 0x3F]);
        assert_eq!(wire.len(), 22);
        assert_eq!(wire[21], 0);
        let mut decoder = Decoder::<SAMPLE_BYTES>::new();
        let read = wire.map(|byte| {
            decoder
                .push(byte)
                .map(|body| body.map(SampleFrame::from_body))
        });
        assert_eq!(read[21], Some(Ok(Some(frame))));
    }
}
