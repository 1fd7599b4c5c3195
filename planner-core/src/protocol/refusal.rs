//! Refusals of the protocol's own, and every `error:N` with its sentence.

use core::fmt;

/// Why a line was refused that no interpreter of G-code has seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// 3: no `$` command of that name, or one that is not complete.
    BadDollar,
    /// 5: homing, without encoders or limit inputs that tell the position.
    NoHoming,
    /// 7: the settings could not be kept, and are those of the start again after a restart.
    NotStored,
    /// 8: only at rest, idle or in alarm.
    NotIdle,
    /// 9: locked by an alarm or by a jog.
    Locked,
    /// 10: alarms on targets out of reach need encoders to know the position.
    SoftLimitsNeedPosition,
    /// 11: more characters than a line may have.
    LineTooLong,
    /// 14: a start-up line that does not fit.
    StartupTooLong,
    /// 66: not executed, because a line before it was refused and `$ACK` is still to come.
    AfterAnError,
    /// 67: its line number is not the next; it or a line before it was lost on the way.
    OutOfOrder,
    /// 77: a setting does not take this value.
    BadValue,
    /// 78: the settings would not make a robot.
    NoRobot,
    /// 92: nothing was identified.
    NotIdentified,
    /// 93: nothing has been identified that could be stored.
    NothingToStore,
}

impl Refusal {
    /// The number in `error:N`: Grbl's where it has one.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::BadDollar => 3,
            Self::NoHoming => 5,
            Self::NotStored => 7,
            Self::NotIdle => 8,
            Self::Locked => 9,
            Self::SoftLimitsNeedPosition => 10,
            Self::LineTooLong => 11,
            Self::StartupTooLong => 14,
            Self::AfterAnError => 66,
            Self::OutOfOrder => 67,
            Self::BadValue => 77,
            Self::NoRobot => 78,
            Self::NotIdentified => 92,
            Self::NothingToStore => 93,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(sentence(self.code()))
    }
}

/// What each `error:N` means, as `$EE` lists it.
pub const ERRORS: [(u8, &str); 54] = [
    (1, "A word begins with something other than a letter"),
    (2, "A letter has no proper number"),
    (3, "There is no such $ command or setting: see $ and $$"),
    (4, "A value is negative that must not be"),
    (
        5,
        "There is nothing to home by: set $1000 for encoders or $1004 for limit inputs",
    ),
    (
        7,
        "The settings could not be stored: they hold until the next start only",
    ),
    (8, "Possible only at rest: wait for Idle"),
    (9, "Locked by an alarm or a jog: unlock with $X or wait"),
    (
        10,
        "Alarms on targets out of reach need encoders: set $1000=1 first",
    ),
    (11, "The line is too long: split it"),
    (
        14,
        "The start-up line is too long: 80 characters are the most",
    ),
    (15, "The jog leaves the robot's travel: nothing moves"),
    (
        16,
        "A jog has axis words and F, and G20, G21, G53, G90 or G91 at most",
    ),
    (20, "A command or word that is not supported"),
    (21, "Two commands of one modal group"),
    (22, "A feed move without a feedrate: give F"),
    (23, "A command's number must be whole"),
    (24, "Two commands of the line use axis words"),
    (25, "A word is given twice"),
    (26, "A command needs axis words and has none"),
    (27, "The line number is too large"),
    (28, "A command lacks a value that it needs"),
    (
        29,
        "There is no such work coordinate system: use G54 to G59",
    ),
    (30, "G53 works with G0 and G1 only"),
    (31, "Axis words that no command uses"),
    (32, "The arc has no axis word in its plane"),
    (33, "The arc's target does not fit its centre or radius"),
    (34, "The arc's radius does not fit its target"),
    (35, "The arc has neither centre nor radius"),
    (36, "A word that no command of the line uses"),
    (37, "G43.1 takes Z alone"),
    (38, "The tool number is too large"),
    (60, "A number is too large"),
    (61, "A target leaves the number range"),
    (62, "The position is unknown: home or give a first point"),
    (63, "The checksum is not the line's: send it again"),
    (64, "The line has too many words: split it"),
    (65, "A command that needs a line of its own: split it"),
    (
        66,
        "Not executed after the error before: acknowledge with $ACK",
    ),
    (
        67,
        "Not the next line number: send again from the line after the last ok",
    ),
    (70, "The path leaves the robot's reach"),
    (71, "The path comes too close to a singularity"),
    (72, "The path exceeds a joint limit"),
    (
        73,
        "The segment would take more than a day: give a higher feedrate",
    ),
    (
        74,
        "The look-ahead is full: wait for ok before the next line",
    ),
    (75, "An arc must lie in the plane G17"),
    (
        76,
        "The prefilter cannot be used: check its frequency and damping",
    ),
    (
        77,
        "The value of the setting cannot be used: see $ES for its range",
    ),
    (
        78,
        "The settings do not make a robot: see the message before",
    ),
    (79, "This robot has no elbow: leave out M101 and M102"),
    (80, "G64 takes either P in mm or Q of 0 to 100 percent"),
    (
        85,
        "The hop cannot be planned: check its height, rise, tolerance and acceleration",
    ),
    (92, "Nothing was identified: see the message before"),
    (93, "There is no mode to store: identify one with $ID first"),
];

/// The sentence for an `error:N`.
#[must_use]
pub fn sentence(code: u8) -> &'static str {
    let row = ERRORS.iter().find(|(number, _)| *number == code);
    row.map_or("An error without a sentence", |(_, sentence)| sentence)
}
