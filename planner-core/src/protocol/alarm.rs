//! Alarms: what locks the controller, by Grbl's numbers.

use core::fmt;

/// Why the controller is locked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alarm {
    /// 1: a limit input became active in motion.
    HardLimit,
    /// 2: a target was out of reach, and the settings ask for an alarm then.
    SoftLimit,
    /// 3: a reset stopped the motion. The position is kept.
    ResetInMotion,
    /// 6: a reset stopped homing.
    HomingReset,
    /// 7: the safety door was opened while homing.
    HomingDoor,
    /// 8: a limit input stayed active while its joint backed off.
    HomingPullOff,
    /// 9: a limit input was not found.
    HomingNotFound,
}

impl Alarm {
    /// Every alarm, by number.
    pub const ALL: [Self; 7] = [
        Self::HardLimit,
        Self::SoftLimit,
        Self::ResetInMotion,
        Self::HomingReset,
        Self::HomingDoor,
        Self::HomingPullOff,
        Self::HomingNotFound,
    ];

    /// The number in `ALARM:N`, Grbl's.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::HardLimit => 1,
            Self::SoftLimit => 2,
            Self::ResetInMotion => 3,
            Self::HomingReset => 6,
            Self::HomingDoor => 7,
            Self::HomingPullOff => 8,
            Self::HomingNotFound => 9,
        }
    }

    /// Whether only a reset helps: unlocking would go on where nobody has looked.
    #[must_use]
    pub const fn needs_reset(self) -> bool {
        matches!(self, Self::HardLimit | Self::SoftLimit)
    }
}

/// One sentence: what happened, and what to do.
impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::HardLimit => "A limit input became active in motion: free the arm then reset",
            Self::SoftLimit => "A target is out of reach: correct the program then reset",
            Self::ResetInMotion => "A reset stopped the motion: the position is kept; unlock",
            Self::HomingReset => "A reset stopped homing: the position is unknown; home again or unlock",
            Self::HomingDoor => "The door was opened while homing: close it and home again or unlock",
            Self::HomingPullOff => {
                "A limit input stayed active while its joint backed off: check it and $23 then home again or unlock"
            }
            Self::HomingNotFound => {
                "A limit input was not found: check it and $23 then home again or unlock"
            }
        })
    }
}
