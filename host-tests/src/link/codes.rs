//! The controller's numbers in words, where it says no sentence of its own.

use planner_core::protocol::{Alarm, ERRORS};

/// A line's checksum is wrong.
pub const CHECKSUM: u8 = 63;
/// A line that came after one with an error, before the sender took note of it.
pub const REFUSED_AFTER_ERROR: u8 = 66;
/// A line's number is not the next one.
pub const OUT_OF_ORDER: u8 = 67;

/// What `error:N` means.
#[must_use]
pub fn error(code: u8) -> &'static str {
    let entry = ERRORS.iter().find(|(number, _)| *number == code);
    entry.map_or("The controller gives no reason", |(_, sentence)| sentence)
}

/// What `ALARM:N` means, and what to do.
#[must_use]
pub fn alarm(code: u8) -> String {
    match Alarm::ALL.iter().find(|alarm| alarm.code() == code) {
        Some(alarm) if alarm.needs_reset() => format!("{alarm} with --reset --unlock"),
        Some(Alarm::ResetInMotion) => format!("{} with --unlock", Alarm::ResetInMotion),
        Some(alarm) => alarm.to_string(),
        None => "see the controller's manual, then unlock with --unlock".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_sentences_that_say_what_to_do() {
        assert_eq!(error(22), "A feed move without a feedrate: give F");
        assert_eq!(error(255), "The controller gives no reason");
        for code in 1..=3 {
            assert!(alarm(code).contains("--unlock"), "{}", alarm(code));
        }
        assert!(alarm(99).contains("manual"));
    }
}
