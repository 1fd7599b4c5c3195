//! The stream of following errors: one frame for each setpoint frame that wants one, from the
//! drives back to the controller.
//!
//! A following error is how far the joint's encoder stays behind the drive's own setpoint of that
//! moment ([`crate::servo::Servo::following_error`]). What swings at the end of the arm pulls at
//! the joints, so that the mode is in it. The setpoint's number comes back with it, as with the
//! accelerometer's samples ([`crate::accelerometer`]).
//!
//! A frame is 20 bytes, little endian, and as [`crate::framing`] has it 26 bytes on the wire.
//!
//! | offset | field | |
//! |---|---|---|
//! | 0 | sequence | u32, that of the setpoint frame which it answers |
//! | 4 | following error | 4 × f32, setpoint less encoder of joints 1 to 4, µrad; a SCARA's joint 3 µm |

use crate::framing;
use crate::pose::AXES;

/// Bytes of a frame on the wire, the closing zero included.
pub const FOLLOWING_ERROR_BYTES: usize = framing::wire_bytes(20);

/// The following errors of all joints at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FollowingErrorFrame {
    /// Number of the setpoint frame that it answers.
    pub sequence: u32,
    /// Setpoint less encoder of joints 1 to 4 in µrad, a SCARA's joint 3 in µm, finite numbers.
    pub error: [f32; AXES],
}

impl FollowingErrorFrame {
    /// The frame as it goes on the wire.
    #[must_use]
    pub fn encode(&self) -> [u8; FOLLOWING_ERROR_BYTES] {
        framing::encode_numbered(self.sequence, self.error)
    }

    /// The errors in a frame's body; none if it is another kind of frame.
    #[must_use]
    pub fn from_body(body: &[u8]) -> Option<Self> {
        let (sequence, error) = framing::numbered(body)?;
        Some(Self { sequence, error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::framing::Decoder;

    /// Byte by byte: the layout is a promise to the drives.
    #[test]
    fn the_layout_is_fixed() {
        let frame = FollowingErrorFrame {
            sequence: 0x0102_0304,
            error: [1.0, -2.0, 0.0, 3.5],
        };
        let wire = frame.encode();
        assert_eq!(wire.len(), 26);
        assert_eq!(wire[..7], [5, 4, 3, 2, 1, 1, 3]);
        let mut decoder = Decoder::<FOLLOWING_ERROR_BYTES>::new();
        let mut body = None;
        for byte in wire {
            if let Some(Ok(read)) = decoder.push(byte) {
                assert_eq!(read[..4], [4, 3, 2, 1]);
                assert_eq!(read[4..8], 1.0_f32.to_le_bytes());
                assert_eq!(read[16..], 3.5_f32.to_le_bytes());
                body = FollowingErrorFrame::from_body(read);
            }
        }
        assert_eq!(body, Some(frame));
    }
}
