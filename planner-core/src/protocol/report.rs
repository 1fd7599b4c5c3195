//! What the control task tells the controller about its last tick.

use micromath::F32Ext;

use crate::identify::Listening;
use crate::motion::{Progress, Setpoint};
use crate::pose::{JointPosition, Pose};
use crate::units::TICK_HZ;

/// Inputs of the board; a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Limit inputs of joints 1 to 4, from bit 0.
    pub limits: u8,
    /// The safety door is open.
    pub door: bool,
}

impl Inputs {
    /// The safety door among the bits.
    const DOOR: u8 = 1 << 4;

    /// From a bit each: joints 1 to 4 from bit 0, the door bit 4.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self {
            limits: bits & 0b1111,
            door: bits & Self::DOOR != 0,
        }
    }

    /// The inverse of [`Inputs::from_bits`].
    #[must_use]
    pub const fn to_bits(self) -> u8 {
        self.limits & 0b1111 | if self.door { Self::DOOR } else { 0 }
    }
}

/// What the last tick was like.
#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    /// What left in the tick.
    pub setpoint: Setpoint,
    /// Where the tool was a tick before, for its speed.
    pub previous_pose: Pose,
    /// How far the motion has come.
    pub progress: Progress,
    /// Orders obeyed since the start.
    pub orders: u32,
    /// The board's inputs.
    pub inputs: Inputs,
    /// What absolute encoders read, if the board has any.
    pub encoders: Option<JointPosition>,
    /// How far the accelerometer's record has come.
    pub listening: Listening,
    /// How the controller fares.
    pub health: Health,
}

impl Report {
    /// The tool's speed in the last tick in mm/s, good to 0.1 %: it is for display.
    ///
    /// The root of micromath is good to some 5 %; a Newton step squares that.
    #[must_use]
    pub fn speed_mm_s(&self) -> f32 {
        let (now, before) = (self.setpoint.pose, self.previous_pose);
        let squared_mm2: f32 = [(now.x, before.x), (now.y, before.y), (now.z, before.z)]
            .into_iter()
            .map(|(to, from)| to.saturating_sub(from).to_num::<f32>())
            .map(|step_mm| step_mm * step_mm)
            .sum();
        let rough_mm = F32Ext::sqrt(squared_mm2);
        if rough_mm > 0.0 {
            0.5 * (rough_mm + squared_mm2 / rough_mm) * TICK_HZ as f32
        } else {
            0.0
        }
    }
}

/// What `$I` tells about the control task and the memory.
#[derive(Clone, Copy, Debug, Default)]
pub struct Health {
    /// Ticks since the start.
    pub ticks: u32,
    /// The dearest tick, in the board's unit.
    pub worst_tick: u32,
    /// Control periods missed since the start.
    pub overruns: u32,
    /// Frames that found no room on their way out.
    pub unsent: u32,
    /// Times the moves ran out before the program ended.
    pub starved: u32,
}
