//! Lines that begin with `$`: what they ask for.

/// A `$` command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dollar<'a> {
    /// `$`: the commands there are.
    Help,
    /// `$$`: every setting.
    Settings,
    /// `$n` or `$name`: one setting.
    Show(&'a str),
    /// `$n=value` or `$name=value`, several between blanks.
    Set(&'a str),
    /// `$#`: work offsets and stored positions.
    Offsets,
    /// `$G`: the modal state.
    ParserState,
    /// `$I`: what this controller is, and how it fares.
    BuildInfo,
    /// `$I+`: likewise, in grblHAL's words too.
    MoreBuildInfo,
    /// `$I=text`: the user's name for this controller.
    NameBuild(&'a str),
    /// `$N`: the start-up lines.
    StartupLines,
    /// `$N0=line` and `$N1=line`.
    SetStartupLine(u8, &'a str),
    /// `$J=line`.
    Jog(&'a str),
    /// `$C`: check mode on or off.
    Check,
    /// `$X`: unlock.
    Unlock,
    /// `$H`: home.
    Home,
    /// `$ID=move`: identify the mode that a move excites, relative and with its feedrate, by the
    /// accelerometer; `$ID1=move` to `$ID4=move`: by the following error of that joint, counted
    /// from 0 here.
    Identify(Option<u8>, &'a str),
    /// `$ID`: what was identified last.
    Identified,
    /// `$ID=store`: that is the prefilter's mode from now on.
    StoreIdentified,
    /// `$SLP`: sleep.
    Sleep,
    /// `$RST=$`, `$RST=#`, `$RST=*`.
    Restore(Restore),
    /// `$ES`, `$EG`, `$EA`, `$EE`.
    Describe(Description),
    /// `$ACK`: the sender knows of the error; later lines count again.
    Acknowledge,
}

/// What `$RST` takes back to its default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restore {
    /// The settings.
    Settings,
    /// Work offsets and stored positions.
    Offsets,
    /// Everything that is kept.
    All,
}

/// A table of grblHAL's self-description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Description {
    /// `$ES`
    Settings,
    /// `$EG`
    Groups,
    /// `$EA`
    Alarms,
    /// `$EE`
    Errors,
}

impl<'a> Dollar<'a> {
    /// Reads what follows the `$`; `None` if there is no such command.
    #[must_use]
    pub fn parse(text: &'a str) -> Option<Self> {
        let text = text.trim();
        let is = |name: &str| text.eq_ignore_ascii_case(name);
        let plain = [
            ("", Self::Help),
            ("$", Self::Settings),
            ("#", Self::Offsets),
            ("G", Self::ParserState),
            ("I", Self::BuildInfo),
            ("I+", Self::MoreBuildInfo),
            ("N", Self::StartupLines),
            ("C", Self::Check),
            ("X", Self::Unlock),
            ("H", Self::Home),
            ("ID", Self::Identified),
            ("ID=store", Self::StoreIdentified),
            ("SLP", Self::Sleep),
            ("ACK", Self::Acknowledge),
            ("RST=$", Self::Restore(Restore::Settings)),
            ("RST=#", Self::Restore(Restore::Offsets)),
            ("RST=*", Self::Restore(Restore::All)),
            ("ES", Self::Describe(Description::Settings)),
            ("EG", Self::Describe(Description::Groups)),
            ("EA", Self::Describe(Description::Alarms)),
            ("EE", Self::Describe(Description::Errors)),
        ];
        if let Some((_, command)) = plain.into_iter().find(|(name, _)| is(name)) {
            return Some(command);
        }
        let Some((key, value)) = text.split_once('=') else {
            return Some(Self::Show(text)).filter(|_| !text.contains(' '));
        };
        let value = value.trim();
        match key.trim() {
            "J" | "j" => Some(Self::Jog(value)),
            "ID" | "id" => Some(Self::Identify(None, value)),
            "I" | "i" => Some(Self::NameBuild(value)),
            "N0" | "n0" => Some(Self::SetStartupLine(0, value)),
            "N1" | "n1" => Some(Self::SetStartupLine(1, value)),
            "RST" | "rst" => None,
            key => Some(match joint_of_identify(key) {
                Some(joint) => Self::Identify(Some(joint), value),
                None => Self::Set(text),
            }),
        }
    }
}

/// The joint of `ID1` to `ID4`, counted from 0.
fn joint_of_identify(key: &str) -> Option<u8> {
    let number = key.strip_prefix("ID").or_else(|| key.strip_prefix("id"))?;
    match number.as_bytes() {
        [digit @ b'1'..=b'4'] => Some(digit - b'1'),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_told_apart() {
        for (text, command) in [
            ("", Dollar::Help),
            ("$", Dollar::Settings),
            (" h ", Dollar::Home),
            ("slp", Dollar::Sleep),
            ("J=G91 X1 F100", Dollar::Jog("G91 X1 F100")),
            ("j= X1F1", Dollar::Jog("X1F1")),
            ("N1=G20", Dollar::SetStartupLine(1, "G20")),
            ("N0=", Dollar::SetStartupLine(0, "")),
            ("I=left cell", Dollar::NameBuild("left cell")),
            ("I+", Dollar::MoreBuildInfo),
            ("id", Dollar::Identified),
            ("ID=X10 F9600", Dollar::Identify(None, "X10 F9600")),
            ("ID1=X10 F9600", Dollar::Identify(Some(0), "X10 F9600")),
            ("id4 = X10F9600", Dollar::Identify(Some(3), "X10F9600")),
            ("ID5=3", Dollar::Set("ID5=3")),
            ("ID=STORE", Dollar::StoreIdentified),
            ("10", Dollar::Show("10")),
            ("frequency", Dollar::Show("frequency")),
            ("10=3", Dollar::Set("10=3")),
            ("link1=100 link2=90", Dollar::Set("link1=100 link2=90")),
            ("rst=*", Dollar::Restore(Restore::All)),
            ("EE", Dollar::Describe(Description::Errors)),
        ] {
            assert_eq!(Dollar::parse(text), Some(command), "{text}");
        }
        for text in ["RST=x", "what is this", "RST="] {
            assert_eq!(Dollar::parse(text), None, "{text}");
        }
    }
}
