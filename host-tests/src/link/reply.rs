//! One line from the controller.

use super::StatusReport;

/// What a line from the controller says.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// The oldest unanswered line was accepted.
    Ok,
    /// The oldest unanswered line was refused.
    Error(u8),
    /// The controller has stopped and is locked.
    Alarm(u8),
    /// `<…>`.
    Status(StatusReport),
    /// It has just started, or was reset.
    Banner,
    /// `[MSG:…]`, without the frame.
    Message(String),
    /// `[NAME:…]`, without the brackets.
    Info(String),
    /// `$name=value`.
    Setting {
        /// Without the `$`.
        name: String,
        /// As written.
        value: String,
    },
    /// None of these: noise, or what another controller says.
    Other(String),
}

impl Reply {
    /// Reads a line without its end.
    #[must_use]
    pub fn parse(line: &str) -> Self {
        let understood = match line.as_bytes() {
            b"ok" => Some(Self::Ok),
            [b'e', ..] => number(line, "error:").map(Self::Error),
            [b'A', ..] => number(line, "ALARM:").map(Self::Alarm),
            [b'<', ..] => StatusReport::parse(line).map(Self::Status),
            [b'G', ..] => line.starts_with("Grbl ").then_some(Self::Banner),
            [b'[', .., b']'] => Some(Self::bracketed(&line[1..line.len() - 1])),
            [b'$', ..] => line[1..]
                .split_once('=')
                .map(|(name, value)| Self::Setting {
                    name: name.to_owned(),
                    value: value.to_owned(),
                }),
            _ => None,
        };
        understood.unwrap_or_else(|| Self::Other(line.to_owned()))
    }

    fn bracketed(text: &str) -> Self {
        match text.strip_prefix("MSG:") {
            Some(message) => Self::Message(message.to_owned()),
            None => Self::Info(text.to_owned()),
        }
    }
}

fn number(line: &str, prefix: &str) -> Option<u8> {
    line.strip_prefix(prefix)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::State;
    use proptest::prelude::*;

    #[test]
    fn lines_are_told_apart() {
        let setting = |name: &str, value: &str| Reply::Setting {
            name: name.to_owned(),
            value: value.to_owned(),
        };
        for (line, expected) in [
            ("ok", Reply::Ok),
            ("error:22", Reply::Error(22)),
            ("ALARM:3", Reply::Alarm(3)),
            ("Grbl 1.1h ['$' for help]", Reply::Banner),
            (
                "[MSG:Reset to continue]",
                Reply::Message("Reset to continue".into()),
            ),
            ("[OPT:,64,1024]", Reply::Info("OPT:,64,1024".into())),
            ("$10=3", setting("10", "3")),
            ("$prefilter=fir-zvd", setting("prefilter", "fir-zvd")),
        ] {
            assert_eq!(Reply::parse(line), expected);
        }
        let Reply::Status(status) = Reply::parse("<Idle|MPos:1.000,2.000,3.000|FS:0,0>") else {
            panic!("a status");
        };
        assert_eq!(status.state, State::Idle);
        for noise in [
            "",
            "o",
            "okay",
            "error:x",
            "error:300",
            "<Idle",
            "[MSG:x",
            "Grbl",
            "é",
        ] {
            assert_eq!(Reply::parse(noise), Reply::Other(noise.to_owned()));
        }
    }

    proptest! {
        #[test]
        fn no_line_is_too_strange(line in "\\PC*", start in "|<|\\[|\\$|error:|ALARM:|<Idle\\|") {
            let _ = Reply::parse(&format!("{start}{line}"));
            let _ = Reply::parse(&format!("{start}{line}]"));
            let _ = Reply::parse(&format!("{start}{line}>"));
        }
    }
}
