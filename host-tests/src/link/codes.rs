//! Grbl's numbers in words, for controllers that say no sentence of their own.

/// What `error:N` means.
#[must_use]
pub fn error(code: u8) -> &'static str {
    match code {
        1 => "a word begins with no letter",
        2 => "a letter has no proper number",
        3 => "there is no such $ line or setting",
        4 => "a value is negative",
        5 => "homing is off",
        7 => "the stored settings cannot be read",
        8 => "this needs rest",
        9 => "the controller is locked by an alarm, or jogging",
        10 => "soft limits need homing",
        11 => "the line is too long",
        14 => "the start-up line is too long",
        15 => "the jog would leave the travel",
        16 => "a jog without axis words, or with words that a jog does not have",
        20 => "the controller does not have this word",
        21 => "two words of one modal group",
        22 => "there is no feedrate: give F",
        23 => "a whole number is needed",
        24 => "two words use the axis words",
        25 => "a word stands twice",
        26 => "axis words are missing",
        27 => "the line number is out of range",
        28 => "a value is missing",
        29 => "there is no such work offset",
        30 => "G53 needs G0 or G1",
        31 => "axis words that nothing uses",
        32 => "an arc without axis words in its plane",
        33 => "the arc's target cannot be reached by it",
        34 => "the arc's radius is too small",
        35 => "an arc without centre or radius",
        36 => "words that nothing uses",
        37 => "G43.1 takes the tool's axis alone",
        38 => "the tool number is too large",
        CHECKSUM => "the checksum is wrong",
        REFUSED_AFTER_ERROR => "it was refused because of the error before it",
        OUT_OF_ORDER => "its line number is not the next one",
        _ => "the controller gives no reason",
    }
}

/// What `ALARM:N` means, and what to do.
#[must_use]
pub fn alarm(code: u8) -> &'static str {
    match code {
        1 => "a limit input tripped: free the arm, then send with --reset --unlock",
        2 => "a target is out of reach: correct the program, then send with --reset --unlock",
        3 => "it was reset while moving: the position is kept; send with --unlock",
        4 | 5 => "the probe did not find what it should",
        6..=9 => "homing failed: check the limit inputs, then home with $H",
        _ => "see the controller's manual, and send with --unlock when it is safe",
    }
}

/// A line's checksum is wrong.
pub const CHECKSUM: u8 = 63;
/// A line that came after one with an error, before the sender took note of it.
pub const REFUSED_AFTER_ERROR: u8 = 66;
/// A line's number is not the next one.
pub const OUT_OF_ORDER: u8 = 67;
