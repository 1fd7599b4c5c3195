//! The stream of acceleration samples: one frame for each setpoint frame that wants one, back to
//! the controller.
//!
//! The sensor's node hears the setpoints ([`crate::telemetry`]) on the line's other direction, and
//! answers each frame that is marked so with what the tool's acceleration is then. The setpoint's
//! number comes back with it, so that it does not matter how long an answer takes.
//!
//! A frame is 16 bytes, little endian, followed by their CRC-32 (ISO-HDLC), the whole COBS-coded
//! and closed by a zero byte: 22 bytes on the wire.
//!
//! | offset | field | |
//! |---|---|---|
//! | 0 | sequence | u32, that of the setpoint frame which it answers |
//! | 4 | acceleration | 3 × f32, along the robot's X, Y and Z, mm/s² |

use heapless::Vec;

const BODY_BYTES: usize = 16;
const CHECKED_BYTES: usize = BODY_BYTES + 4;

/// Bytes of a frame on the wire, the closing zero included.
pub const SAMPLE_BYTES: usize = cobs::max_encoding_length(CHECKED_BYTES) + 1;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

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
        let mut checked = [0; CHECKED_BYTES];
        let [x, y, z] = self.acceleration_mm_s2.map(f32::to_le_bytes);
        let words = [self.sequence.to_le_bytes(), x, y, z];
        checked[..BODY_BYTES].copy_from_slice(words.as_flattened());
        let crc = CRC.checksum(&checked[..BODY_BYTES]);
        checked[BODY_BYTES..].copy_from_slice(&crc.to_le_bytes());
        // COBS leaves no zero inside, so the byte that stays zero here closes the frame.
        let mut wire = [0; SAMPLE_BYTES];
        cobs::encode(&checked, &mut wire);
        wire
    }

    /// The frame in the bytes between two zeros.
    fn decode(wire: &[u8]) -> Option<Self> {
        let mut checked = [0; SAMPLE_BYTES];
        let length = cobs::decode(wire, &mut checked).ok()?.frame_size();
        let (body, crc) = checked.get(..length)?.split_last_chunk::<4>()?;
        if body.len() != BODY_BYTES || CRC.checksum(body).to_le_bytes() != *crc {
            return None;
        }
        let mut words = body.as_chunks::<4>().0.iter().copied();
        let sequence = u32::from_le_bytes(words.next()?);
        let mut acceleration_mm_s2 = [0.0; 3];
        for (value, word) in acceleration_mm_s2.iter_mut().zip(words) {
            *value = f32::from_le_bytes(word);
        }
        let is_finite = acceleration_mm_s2.iter().all(|value| value.is_finite());
        is_finite.then_some(Self {
            sequence,
            acceleration_mm_s2,
        })
    }
}

/// Finds the frames in a stream of bytes, whatever happened to it on the way.
#[derive(Debug, Default)]
pub struct SampleDecoder {
    /// Bytes since the last zero.
    pending: Vec<u8, SAMPLE_BYTES>,
    /// They are too many for a frame.
    is_too_long: bool,
}

impl SampleDecoder {
    /// A decoder that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            pending: Vec::new(),
            is_too_long: false,
        }
    }

    /// The frame that this byte completes.
    pub fn push(&mut self, byte: u8) -> Option<SampleFrame> {
        if byte != 0 {
            self.is_too_long |= self.pending.push(byte).is_err();
            return None;
        }
        let frame = SampleFrame::decode(&self.pending).filter(|_| !self.is_too_long);
        self.pending.clear();
        self.is_too_long = false;
        frame
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec as List;

    fn frame(sequence: u32) -> SampleFrame {
        SampleFrame {
            sequence,
            acceleration_mm_s2: [1.0, -2.5, sequence as f32],
        }
    }

    fn decoded(wire: &[u8]) -> List<SampleFrame> {
        let mut decoder = SampleDecoder::new();
        wire.iter().filter_map(|&byte| decoder.push(byte)).collect()
    }

    /// Byte by byte: the layout is a promise to the sensor.
    #[test]
    fn the_layout_is_fixed() {
        let wire = SampleFrame {
            sequence: 0x0102_0304,
            acceleration_mm_s2: [1.0, -2.0, 0.0],
        }
        .encode();
        // sequence; 0x3F800000; 0xC0000000; 0, each zero a code that leads to the next one
        assert_eq!(wire[..7], [5, 4, 3, 2, 1, 1, 3]);
        assert_eq!(wire[7..9], [0x80, 0x3F]);
        assert_eq!(wire.len(), 22);
        assert_eq!(wire[21], 0);
    }

    #[test]
    fn joining_in_the_middle_costs_one_frame() {
        let wire: List<u8> = (1..4).flat_map(|n| frame(n).encode()).collect();
        assert_eq!(decoded(&wire), [frame(1), frame(2), frame(3)]);
        assert_eq!(decoded(&wire[10..]), [frame(2), frame(3)]);
        let mut noisy = std::vec![0x55; 1000];
        noisy.push(0);
        noisy.extend(&wire);
        assert_eq!(decoded(&noisy), [frame(1), frame(2), frame(3)]);
    }

    proptest! {
        #[test]
        fn every_frame_survives(sequence: u32, values in [-1e9_f32..1e9, -1e9_f32..1e9, -1e9_f32..1e9]) {
            let sent = SampleFrame { sequence, acceleration_mm_s2: values };
            prop_assert_eq!(decoded(&sent.encode()), [sent]);
        }

        #[test]
        fn damage_never_makes_a_frame(
            damage in proptest::collection::vec((0_usize..SAMPLE_BYTES * 20, 0_u8..3, any::<u8>()), 0..12),
        ) {
            let mut wire: List<u8> = (0..20).flat_map(|n| frame(n).encode()).collect();
            for (at, kind, byte) in damage {
                let at = at % wire.len();
                match kind {
                    0 => wire[at] ^= byte | 1,
                    1 => drop(wire.remove(at)),
                    _ => wire.insert(at, byte),
                }
            }
            wire.push(0);
            wire.extend(frame(20).encode());
            let seen = decoded(&wire);
            prop_assert!(seen.iter().all(|f| *f == frame(f.sequence)));
            prop_assert_eq!(seen.last().map(|f| f.sequence), Some(20));
        }
    }
}
