//! Frames on a serial line: a body and its CRC-32 (ISO-HDLC), the whole COBS-coded and closed by a
//! zero byte.
//!
//! A receiver that starts in the middle, or that loses bytes, is in step again at the next zero.

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

const CRC_BYTES: usize = 4;

/// Words of a numbered frame at the most.
const LONGEST_WORDS: usize = 5;

/// Bytes on the wire of a frame with such a body, the closing zero included.
#[must_use]
pub const fn wire_bytes(body_bytes: usize) -> usize {
    cobs::max_encoding_length(body_bytes + CRC_BYTES) + 1
}

/// The frame of a body, with `WIRE` = [`wire_bytes`] of its length.
#[must_use]
pub fn encode<const WIRE: usize>(body: &[u8]) -> [u8; WIRE] {
    debug_assert_eq!(WIRE, wire_bytes(body.len()));
    let crc = CRC.checksum(body).to_le_bytes();
    // COBS leaves no zero inside, so the byte that stays zero here closes the frame.
    let mut wire = [0; WIRE];
    let mut encoder = cobs::CobsEncoder::new(&mut wire);
    let pushed = encoder.push(body).and_then(|()| encoder.push(&crc));
    debug_assert!(pushed.is_ok());
    encoder.finalize();
    wire
}

/// The frame of a number and some values: little endian, a u32 and f32s.
#[must_use]
pub fn encode_numbered<const VALUES: usize, const WIRE: usize>(
    sequence: u32,
    values: [f32; VALUES],
) -> [u8; WIRE] {
    let mut words = heapless::Vec::<[u8; 4], LONGEST_WORDS>::new();
    const { assert!(VALUES < LONGEST_WORDS) };
    let values = values.into_iter().map(f32::to_le_bytes);
    words.extend(core::iter::once(sequence.to_le_bytes()).chain(values));
    encode(words.as_flattened())
}

/// The number and the values in a body of that length; none if a value is no finite number.
#[must_use]
pub fn numbered<const VALUES: usize>(body: &[u8]) -> Option<(u32, [f32; VALUES])> {
    let (sequence, values) = body.split_first_chunk::<4>()?;
    let (words, []) = values.as_chunks::<4>() else {
        return None;
    };
    let words: &[[u8; 4]; VALUES] = words.try_into().ok()?;
    let values = words.map(f32::from_le_bytes);
    let is_finite = values.iter().all(|value| value.is_finite());
    is_finite.then_some((u32::from_le_bytes(*sequence), values))
}

/// A stretch between two zeros that was no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damaged;

/// Finds the frames in a stream of bytes, whatever happened to it on the way. `WIRE` are the bytes
/// of the longest one on the wire.
#[derive(Debug, Default)]
pub struct Decoder<const WIRE: usize> {
    /// Bytes since the last zero.
    pending: heapless::Vec<u8, WIRE>,
    /// They are too many for a frame.
    is_too_long: bool,
    /// The last byte was a zero: what is pending has been looked at.
    is_over: bool,
}

impl<const WIRE: usize> Decoder<WIRE> {
    /// A decoder that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            pending: heapless::Vec::new(),
            is_too_long: false,
            is_over: false,
        }
    }

    /// The body of the frame that this byte completes, if it completes one.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], Damaged>> {
        if core::mem::take(&mut self.is_over) {
            self.pending.clear();
            self.is_too_long = false;
        }
        if byte != 0 {
            self.is_too_long |= self.pending.push(byte).is_err();
            return None;
        }
        self.is_over = true;
        if self.pending.is_empty() {
            return None;
        }
        let body = if self.is_too_long {
            None
        } else {
            body(&mut self.pending)
        };
        Some(body.ok_or(Damaged))
    }
}

/// The body in the bytes between two zeros.
fn body(wire: &mut [u8]) -> Option<&[u8]> {
    let length = cobs::decode_in_place(wire).ok()?;
    let (body, crc) = wire.get(..length)?.split_last_chunk::<CRC_BYTES>()?;
    (CRC.checksum(body).to_le_bytes() == *crc).then_some(body)
}

#[cfg(test)]
pub(crate) mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Flips, drops and puts in bytes: where, what of that, and which.
    pub(crate) fn damage_wire(wire: &mut Vec<u8>, damage: Vec<(usize, u8, u8)>) {
        for (at, kind, byte) in damage {
            let at = at % wire.len();
            match kind {
                0 => wire[at] ^= byte | 1,
                1 => drop(wire.remove(at)),
                _ => wire.insert(at, byte),
            }
        }
    }

    const WIRE: usize = wire_bytes(20);

    fn decoded(wire: &[u8]) -> Vec<Result<Vec<u8>, Damaged>> {
        let mut decoder = Decoder::<WIRE>::new();
        let mut seen = Vec::new();
        for &byte in wire {
            seen.extend(decoder.push(byte).map(|body| body.map(<[u8]>::to_vec)));
        }
        seen
    }

    #[test]
    fn the_coding_is_fixed() {
        let wire: [u8; WIRE] = encode(&[0; 20]);
        // 20 zeros are 20 codes of 1; then the CRC behind its code, and the end.
        assert!(wire[..20].iter().all(|&code| code == 1));
        let crc = CRC.checksum(&[0; 20]).to_le_bytes();
        assert_eq!(wire[20], 5);
        assert_eq!(wire[21..25], crc);
        assert_eq!(wire[25..], [0]);
    }

    #[test]
    fn only_finite_numbers_of_the_right_count_are_values() {
        let wire: [u8; WIRE] = encode_numbered(7, [1.0, 2.0, 3.0, 4.0]);
        let body = decoded(&wire).remove(0).unwrap();
        assert_eq!(numbered(&body), Some((7, [1.0, 2.0, 3.0, 4.0])));
        assert_eq!(numbered::<3>(&body), None);
        assert_eq!(numbered::<4>(&body[..19]), None);
        let wire: [u8; WIRE] = encode_numbered(7, [1.0, f32::NAN, 3.0, 4.0]);
        let body = decoded(&wire).remove(0).unwrap();
        assert_eq!(numbered::<4>(&body), None);
    }

    #[test]
    fn a_long_stretch_without_an_end_is_damage_and_an_empty_one_is_nothing() {
        let mut wire = std::vec![0x55; 10_000];
        wire.extend([0, 0, 0]);
        wire.extend(encode::<WIRE>(&[9; 20]));
        assert_eq!(decoded(&wire), [Err(Damaged), Ok(std::vec![9; 20])]);
    }

    proptest! {
        #[test]
        fn every_body_survives(body: [u8; 20]) {
            let wire: [u8; WIRE] = encode(&body);
            prop_assert_eq!(wire.iter().filter(|&&byte| byte == 0).count(), 1);
            prop_assert_eq!(decoded(&wire), [Ok(body.to_vec())]);
        }

        #[test]
        fn damage_never_makes_a_frame(
            damage in proptest::collection::vec((0_usize..WIRE * 20, 0_u8..3, any::<u8>()), 0..12),
        ) {
            let body = |n: u8| std::vec![n; 20];
            let mut wire: Vec<u8> = (0..20).flat_map(|n| encode::<WIRE>(&body(n))).collect();
            damage_wire(&mut wire, damage);
            wire.push(0);
            wire.extend(encode::<WIRE>(&body(20)));
            let seen: Vec<_> = decoded(&wire).into_iter().flatten().collect();
            prop_assert!(seen.iter().all(|seen| *seen == body(seen[0])));
            prop_assert_eq!(seen.last(), Some(&body(20)));
        }
    }
}
