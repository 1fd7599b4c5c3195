//! Joint moves: the four axes of the raw path are the joints, not the tool's coordinates.
//!
//! The arm homes by them, because the tool's position is not known then, and the elbow changes
//! its side by them, because the tool cannot go straight through the stretched arm. They are
//! walked, held and filtered as tool moves are: a joint moves at constant speed, and the
//! prefilter rounds its start and its stop.

use crate::kinematics::ArmKind;
use crate::pose::{AXES, JointPosition, JointState, JointUnit};
use crate::prefilter::FINE_BITS;
use crate::units::TICK_HZ;

/// What the four axes of the raw path are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Space {
    /// X, Y, Z and yaw of the tool.
    #[default]
    Tool,
    /// Joints 1 to 4.
    Joints,
}

/// Bits behind the point of a fine joint angle in rad: those of an `AngleRad` and the filter's.
const ANGLE_BITS: u32 = 26 + FINE_BITS;
/// Those of a fine length in mm.
const LENGTH_BITS: u32 = 19 + FINE_BITS;

/// What the joints have to do, from their positions as the filters give them: `twice` is the
/// change over two ticks, `bend` the second difference.
pub(crate) fn state(
    arm: ArmKind,
    position: JointPosition,
    twice: [i64; AXES],
    bend: [i64; AXES],
) -> JointState {
    const HZ: f32 = TICK_HZ as f32;
    let scaled = |value: i64, bits: u32, factor: f32| {
        // 2^-28 rad or 2^-21 mm: what a joint moves in two ticks fits
        let coarse = (value >> 11) as i32 as f32;
        coarse * factor / (1_u64 << (bits - 11)) as f32
    };
    let by_joint = |values: [i64; AXES], factor: f32| {
        let mut result = [0.0; AXES];
        for ((result, value), unit) in result.iter_mut().zip(values).zip(arm.joint_units()) {
            let bits = match unit {
                JointUnit::Angle => ANGLE_BITS,
                JointUnit::Length => LENGTH_BITS,
            };
            *result = scaled(value, bits, factor);
        }
        result
    };
    JointState {
        position,
        velocity: by_joint(twice, HZ / 2.0),
        acceleration: by_joint(bend, HZ * HZ),
    }
}
