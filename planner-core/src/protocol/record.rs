//! What is kept over a restart.

use crate::gcode::Offsets;
use crate::posture::MAP_BYTES;

use super::settings::{SERVO_BYTES, SETTINGS_BYTES};

/// A piece of what is kept; it is read and written as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Record {
    /// All settings but the servos'.
    Settings,
    /// The map of the mode.
    Map,
    /// The servos' settings.
    Servos,
    /// Work offsets and stored positions.
    Offsets,
    /// Start-up line 0 or 1.
    StartupLine(u8),
    /// The user's name for this controller.
    BuildName,
}

/// Longest start-up line and build name in bytes.
pub const TEXT_BYTES: usize = 80;

/// A start-up line or a build name.
pub type KeptText = heapless::String<TEXT_BYTES>;

/// The longest record in bytes.
pub const RECORD_BYTES: usize = 640;

const _: () = assert!(SETTINGS_BYTES <= RECORD_BYTES && Offsets::BYTES <= RECORD_BYTES);

const _: () = assert!(MAP_BYTES <= RECORD_BYTES && SERVO_BYTES <= RECORD_BYTES);

impl Record {
    /// Every record there is; the map and the servos go with settings that come before it.
    pub const ALL: [Self; 7] = [
        Self::Settings,
        Self::Map,
        Self::Servos,
        Self::Offsets,
        Self::StartupLine(0),
        Self::StartupLine(1),
        Self::BuildName,
    ];
}
