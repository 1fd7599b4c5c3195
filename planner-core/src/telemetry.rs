//! The setpoint stream: one frame a control tick, from the controller to the drives.
//!
//! A frame that is **placed** says where the joints are, and not where to go: a drive takes its
//! position as the one it has, and does not move. The others a drive follows.
//!
//! A frame is 78 bytes, little endian, and as [`crate::framing`] has it 84 bytes on the wire,
//! 840 kBd at 1 kHz.
//!
//! | offset | field | |
//! |---|---|---|
//! | 0 | sequence | u32, one more each tick |
//! | 4 | state | u8, 0 idle, 1 running, 2 stopping, 3 held, 4 paused; bit 4: following errors wanted; bit 5: accelerations wanted; bit 6: a delta's joints; bit 7: placed |
//! | 5 | pose | 4 × i32, raw bits of X, Y, Z (2^-19 mm) and C (2^-19 °) |
//! | 21 | joint position | 4 × i32, raw bits (2^-26 rad; a SCARA's joint 3 2^-19 mm) |
//! | 37 | joint velocity | 4 × f32, rad/s and mm/s |
//! | 53 | joint acceleration | 4 × f32, rad/s² and mm/s² |
//! | 69 | tick cost | u32, instructions or cycles of this tick, as the board counts |
//! | 73 | overruns | u32, control periods missed since the start |
//! | 77 | outputs | u8, bit 0 gripper, bit 1 blow-off |

use crate::framing::{self, Decoder};
use crate::kinematics::ArmKind;
use crate::motion::{MotionState, Setpoint};
use crate::pose::{JointPosition, JointState, Pose};

/// Bytes of a frame before the CRC.
const BODY_BYTES: usize = 78;

/// Bytes of a frame on the wire, the closing zero included.
pub const FRAME_BYTES: usize = framing::wire_bytes(BODY_BYTES);

/// Marks a position that was set, in the byte of the state.
const PLACED: u8 = 1 << 7;

/// Marks the joints of a delta, likewise.
const DELTA: u8 = 1 << 6;

/// What has to be answered to a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wanted {
    /// Nothing.
    #[default]
    Nothing,
    /// The drives' following errors ([`crate::following_error`]).
    FollowingErrors,
    /// What the accelerometer reads ([`crate::accelerometer`]).
    Acceleration,
}

impl Wanted {
    /// The bits of the state's byte that tell it.
    const MASK: u8 = 1 << 4 | 1 << 5;

    /// As it is among the bits of the state's byte.
    #[must_use]
    pub const fn to_bits(self) -> u8 {
        match self {
            Self::Nothing => 0,
            Self::FollowingErrors => 1 << 4,
            Self::Acceleration => 1 << 5,
        }
    }

    /// The inverse of [`Wanted::to_bits`], whatever the other bits are; none if both are wanted.
    #[must_use]
    pub fn from_bits(bits: u8) -> Option<Self> {
        let all = [Self::Nothing, Self::FollowingErrors, Self::Acceleration];
        all.into_iter()
            .find(|wanted| wanted.to_bits() == bits & Self::MASK)
    }
}

/// One control tick, as it leaves the controller.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SetpointFrame {
    /// Number of the tick since the start, wrapping.
    pub sequence: u32,
    /// What the joints have to do.
    pub setpoint: Setpoint,
    /// Cost of the tick: instructions on the emulated board, cycles on a real one.
    pub tick_cost: u32,
    /// Control periods missed since the start.
    pub overruns: u32,
    /// What has to be answered.
    pub wanted: Wanted,
}

impl SetpointFrame {
    /// The frame as it goes on the wire.
    #[must_use]
    pub fn encode(&self) -> [u8; FRAME_BYTES] {
        framing::encode(&self.body())
    }

    fn body(&self) -> [u8; BODY_BYTES] {
        let joints = &self.setpoint.joints;
        let mut body = [0; BODY_BYTES];
        let mut rest = body.as_mut_slice();
        put(&mut rest, self.sequence.to_le_bytes());
        let placed = if self.setpoint.placed { PLACED } else { 0 };
        let delta = match self.setpoint.arm {
            ArmKind::Scara => 0,
            ArmKind::Delta => DELTA,
        };
        let state = state_to_byte(self.setpoint.state);
        put(&mut rest, [state | delta | placed | self.wanted.to_bits()]);
        for bits in self.setpoint.pose.to_bits() {
            put(&mut rest, bits.to_le_bytes());
        }
        for bits in joints.position.to_bits() {
            put(&mut rest, bits.to_le_bytes());
        }
        for value in joints.velocity.iter().chain(&joints.acceleration) {
            put(&mut rest, value.to_le_bytes());
        }
        put(&mut rest, self.tick_cost.to_le_bytes());
        put(&mut rest, self.overruns.to_le_bytes());
        put(&mut rest, [self.setpoint.outputs]);
        body
    }

    fn from_body(body: &[u8; BODY_BYTES]) -> Option<Self> {
        let mut rest = body.as_slice();
        let sequence = u32::from_le_bytes(take(&mut rest));
        let [state] = take(&mut rest);
        let pose = Pose::from_bits(core::array::from_fn(|_| {
            i32::from_le_bytes(take(&mut rest))
        }));
        let position = core::array::from_fn(|_| i32::from_le_bytes(take(&mut rest)));
        let velocity = core::array::from_fn(|_| f32::from_le_bytes(take(&mut rest)));
        let acceleration = core::array::from_fn(|_| f32::from_le_bytes(take(&mut rest)));
        let tick_cost = u32::from_le_bytes(take(&mut rest));
        let overruns = u32::from_le_bytes(take(&mut rest));
        let [outputs] = take(&mut rest);
        Some(Self {
            sequence,
            setpoint: Setpoint {
                pose,
                joints: JointState {
                    position: JointPosition::from_bits(position),
                    velocity,
                    acceleration,
                },
                arm: if state & DELTA == 0 {
                    ArmKind::Scara
                } else {
                    ArmKind::Delta
                },
                state: state_from_byte(state & !(PLACED | DELTA | Wanted::MASK))?,
                placed: state & PLACED != 0,
                outputs,
            },
            tick_cost,
            overruns,
            wanted: Wanted::from_bits(state)?,
        })
    }
}

/// Fills the front of `rest`, as far as it goes, and moves on.
fn put<const N: usize>(rest: &mut &mut [u8], bytes: [u8; N]) {
    if let Some((front, back)) = core::mem::take(rest).split_first_chunk_mut::<N>() {
        *front = bytes;
        *rest = back;
    }
}

/// Takes the front of `rest`, zeros where it has ended.
fn take<const N: usize>(rest: &mut &[u8]) -> [u8; N] {
    match rest.split_first_chunk::<N>() {
        Some((front, back)) => {
            *rest = back;
            *front
        }
        None => [0; N],
    }
}

fn state_to_byte(state: MotionState) -> u8 {
    match state {
        MotionState::Idle => 0,
        MotionState::Running => 1,
        MotionState::Stopping => 2,
        MotionState::Held => 3,
        MotionState::Paused => 4,
    }
}

fn state_from_byte(byte: u8) -> Option<MotionState> {
    match byte {
        0 => Some(MotionState::Idle),
        1 => Some(MotionState::Running),
        2 => Some(MotionState::Stopping),
        3 => Some(MotionState::Held),
        4 => Some(MotionState::Paused),
        _ => None,
    }
}

/// Finds the frames in a stream of bytes, whatever happened to it on the way.
#[derive(Debug, Default)]
pub struct FrameDecoder {
    decoder: Decoder<FRAME_BYTES>,
    last_sequence: Option<u32>,
    lost: u32,
    bad: u32,
}

impl FrameDecoder {
    /// A decoder that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            decoder: Decoder::new(),
            last_sequence: None,
            lost: 0,
            bad: 0,
        }
    }

    /// Frames missing between those decoded, by their sequence. A sequence that
    /// steps back is a controller that restarted and counts as none.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Stretches between two zeros that were not a frame.
    #[must_use]
    pub fn bad(&self) -> u32 {
        self.bad
    }

    /// The frames that `bytes` complete, in order.
    pub fn frames<'a>(&'a mut self, bytes: &'a [u8]) -> impl Iterator<Item = SetpointFrame> + 'a {
        bytes.iter().filter_map(|&byte| self.push(byte))
    }

    fn push(&mut self, byte: u8) -> Option<SetpointFrame> {
        let body = self.decoder.push(byte)?.ok();
        let frame = body.and_then(|body| body.try_into().ok());
        let Some(frame) = frame.and_then(SetpointFrame::from_body) else {
            self.bad = self.bad.saturating_add(1);
            return None;
        };
        if let Some(last) = self.last_sequence {
            let gap = frame.sequence.wrapping_sub(last).wrapping_sub(1);
            if gap <= u32::MAX / 2 {
                self.lost = self.lost.saturating_add(gap);
            }
        }
        self.last_sequence = Some(frame.sequence);
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::framing::tests::damage_wire;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn frame(sequence: u32) -> SetpointFrame {
        SetpointFrame {
            sequence,
            setpoint: Setpoint {
                pose: Pose::from_bits([1, -2, 0x0003_0000, i32::MIN]),
                joints: JointState {
                    position: JointPosition::from_bits([i32::MAX, 0, -1, 0x0100]),
                    velocity: [0.0, -0.0, 1.5, f32::MIN_POSITIVE],
                    acceleration: [-1e9, 0.25, 0.0, 3.0],
                },
                arm: ArmKind::Delta,
                state: MotionState::Running,
                outputs: 2,
                placed: true,
            },
            tick_cost: 1999,
            overruns: 3,
            wanted: Wanted::Acceleration,
        }
    }

    /// A frame of its own making, byte by byte: the layout is a promise to the drives.
    #[test]
    fn the_layout_is_fixed() {
        let body = frame(0x0102_0304).body();
        assert_eq!(body[..9], [4, 3, 2, 1, 0xE1, 1, 0, 0, 0]);
        assert_eq!(body[9..13], [0xFE, 0xFF, 0xFF, 0xFF]);
        assert_eq!(body[21..25], [0xFF, 0xFF, 0xFF, 0x7F]);
        assert_eq!(body[41..45], [0, 0, 0, 0x80]);
        assert_eq!(body[45..49], [0, 0, 0xC0, 0x3F]);
        assert_eq!(body[69..], [0xCF, 7, 0, 0, 3, 0, 0, 0, 2]);
        let wire = SetpointFrame::default().encode();
        assert_eq!(wire.len(), 84);
        // 78 zeros are 78 codes of 1; then the CRC behind its code, and the end.
        assert!(wire[..78].iter().all(|&code| code == 1));
        assert_eq!((wire[78], wire[83]), (5, 0));
    }

    #[test]
    fn a_stream_arrives_whole_in_pieces_of_any_size() {
        let wire: Vec<u8> = (0..50).flat_map(|n| frame(n).encode()).collect();
        for piece in [1, 2, 7, FRAME_BYTES, 100, wire.len()] {
            let mut decoder = FrameDecoder::new();
            let mut seen = Vec::new();
            for bytes in wire.chunks(piece) {
                seen.extend(decoder.frames(bytes));
            }
            assert_eq!(seen, (0..50).map(frame).collect::<Vec<_>>());
            assert_eq!((decoder.lost(), decoder.bad()), (0, 0));
        }
    }

    #[test]
    fn joining_in_the_middle_costs_one_bad_frame() {
        let wire: Vec<u8> = (0..3).flat_map(|n| frame(n).encode()).collect();
        let mut decoder = FrameDecoder::new();
        let seen: Vec<_> = decoder.frames(&wire[40..]).map(|f| f.sequence).collect();
        assert_eq!(seen, [1, 2]);
        assert_eq!((decoder.lost(), decoder.bad()), (0, 1));
    }

    #[test]
    fn a_restarted_controller_is_not_a_loss() {
        let mut decoder = FrameDecoder::new();
        let wire: Vec<u8> = [7, 8, 0, 1, u32::MAX, 0, 3]
            .into_iter()
            .flat_map(|n| frame(n).encode())
            .collect();
        assert_eq!(decoder.frames(&wire).count(), 7);
        assert_eq!(decoder.lost(), 2);
    }

    #[test]
    fn a_long_stretch_without_an_end_is_one_bad_frame() {
        let mut decoder = FrameDecoder::new();
        assert_eq!(decoder.frames(&[0x55; 10_000]).count(), 0);
        assert_eq!(decoder.frames(&[0]).count(), 0);
        assert_eq!(decoder.frames(&frame(1).encode()).count(), 1);
        assert_eq!(decoder.bad(), 1);
    }

    proptest! {
        #[test]
        fn every_frame_survives(
            sequence: u32, pose: [i32; 4], position: [i32; 4], velocity: [u32; 4],
            acceleration: [u32; 4], tick_cost: u32, overruns: u32, state: u8, outputs: u8, placed: bool,
            is_delta: bool, wanted in 0_usize..3,
        ) {
            let sent = SetpointFrame {
                sequence,
                setpoint: Setpoint {
                    pose: Pose::from_bits(pose),
                    joints: JointState {
                        position: JointPosition::from_bits(position),
                        velocity: velocity.map(f32::from_bits),
                        acceleration: acceleration.map(f32::from_bits),
                    },
                    arm: if is_delta {
                        ArmKind::Delta
                    } else {
                        ArmKind::Scara
                    },
                    state: state_from_byte(state % 5).unwrap(),
                    outputs,
                    placed,
                },
                tick_cost,
                overruns,
                wanted: [Wanted::Nothing, Wanted::FollowingErrors, Wanted::Acceleration][wanted],
            };
            let wire = sent.encode();
            prop_assert_eq!(wire.iter().filter(|&&byte| byte == 0).count(), 1);
            let mut decoder = FrameDecoder::new();
            let seen: Vec<_> = decoder.frames(&wire).collect();
            prop_assert_eq!(seen.len(), 1);
            // The bytes, because a NaN equals nothing.
            prop_assert_eq!(seen[0].body(), sent.body());
        }

        /// Whatever is flipped, dropped or put in: no frame that was not sent, in
        /// order, and in step again after the next end.
        #[test]
        fn damage_never_makes_a_frame(
            damage in proptest::collection::vec((0_usize..FRAME_BYTES * 20, 0_u8..3, any::<u8>()), 0..12),
        ) {
            let mut wire: Vec<u8> = (0..20).flat_map(|n| frame(n).encode()).collect();
            damage_wire(&mut wire, damage);
            wire.push(0);
            wire.extend(frame(20).encode());
            let mut decoder = FrameDecoder::new();
            let seen: Vec<_> = decoder.frames(&wire).collect();
            prop_assert!(seen.iter().all(|f| *f == frame(f.sequence)));
            prop_assert!(seen.is_sorted_by(|a, b| a.sequence < b.sequence));
            prop_assert_eq!(seen.last().map(|f| f.sequence), Some(20));
            let first = seen[0].sequence;
            prop_assert_eq!(seen.len() as u32 + decoder.lost(), 21 - first);
        }
    }
}
