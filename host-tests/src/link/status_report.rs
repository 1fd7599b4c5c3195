//! Grbl's status report, `<State|Name:values|…>`.

use std::fmt;

/// What the controller is doing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// At rest, ready.
    #[default]
    Idle,
    /// Moving along a program.
    Run,
    /// Held: 0 stopped, 1 stopping.
    Hold(Option<u8>),
    /// Moving along a jog.
    Jog,
    /// Locked; some controllers tell why.
    Alarm(Option<u8>),
    /// Held by the safety door.
    Door(Option<u8>),
    /// Checks programs without moving.
    Check,
    /// Homing.
    Home,
    /// Asleep until a reset.
    Sleep,
    /// A state that Grbl does not have.
    Other(String),
}

impl State {
    fn parse(text: &str) -> Self {
        let (name, detail) = match text.split_once(':') {
            Some((name, detail)) => (name, detail.parse().ok()),
            None => (text, None),
        };
        match name {
            "Idle" => Self::Idle,
            "Run" => Self::Run,
            "Hold" => Self::Hold(detail),
            "Jog" => Self::Jog,
            "Alarm" => Self::Alarm(detail),
            "Door" => Self::Door(detail),
            "Check" => Self::Check,
            "Home" => Self::Home,
            "Sleep" => Self::Sleep,
            _ => Self::Other(text.to_owned()),
        }
    }

    /// Held by a command or by the door, whether it has stopped already or not.
    #[must_use]
    pub fn is_held(&self) -> bool {
        matches!(self, Self::Hold(_) | Self::Door(_))
    }

    /// Held, and standing.
    #[must_use]
    pub fn has_stopped(&self) -> bool {
        matches!(
            self,
            Self::Hold(Some(0) | None) | Self::Door(Some(0 | 1) | None)
        )
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, detail) = match self {
            Self::Idle => ("Idle", None),
            Self::Run => ("Run", None),
            Self::Hold(detail) => ("Hold", *detail),
            Self::Jog => ("Jog", None),
            Self::Alarm(detail) => ("Alarm", *detail),
            Self::Door(detail) => ("Door", *detail),
            Self::Check => ("Check", None),
            Self::Home => ("Home", None),
            Self::Sleep => ("Sleep", None),
            Self::Other(name) => (name.as_str(), None),
        };
        f.write_str(name)?;
        detail.map_or(Ok(()), |detail| write!(f, ":{detail}"))
    }
}

/// One report. What it leaves out is none here: Grbl says some things only now and then.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StatusReport {
    /// What the controller is doing.
    pub state: State,
    /// Machine position, `MPos`: X, Y, Z in mm, then C in degrees.
    pub machine: Option<Vec<f64>>,
    /// Work position, `WPos`: machine position less the offset.
    pub work: Option<Vec<f64>>,
    /// Work offset, `WCO`.
    pub offset: Option<Vec<f64>>,
    /// `Bf`: free moves in the look-ahead, and free bytes in the receive buffer.
    pub buffer: Option<[u32; 2]>,
    /// Speed of the tool, mm/min.
    pub feed_mm_min: Option<f64>,
    /// `Ov`: overrides of feed, rapids and spindle, percent.
    pub overrides: Option<[u32; 3]>,
    /// `Pn`: a letter for each active input.
    pub pins: String,
    /// `Ln`: number of the line being executed.
    pub line: Option<u32>,
}

impl StatusReport {
    /// Reads a report with its brackets; none if it is damaged.
    #[must_use]
    pub fn parse(line: &str) -> Option<Self> {
        let inside = line.strip_prefix('<')?.strip_suffix('>')?;
        let mut fields = inside.split('|');
        let state = fields.next().filter(|state| !state.is_empty())?;
        let mut report = Self {
            state: State::parse(state),
            ..Self::default()
        };
        for field in fields {
            // A field that Grbl does not have may look like anything.
            let Some((name, values)) = field.split_once(':') else {
                continue;
            };
            match name {
                "MPos" => report.machine = Some(numbers(values)?),
                "WPos" => report.work = Some(numbers(values)?),
                "WCO" => report.offset = Some(numbers(values)?),
                "Bf" => report.buffer = Some(whole(values)?),
                "F" | "FS" => report.feed_mm_min = numbers(values)?.first().copied(),
                "Ov" => report.overrides = Some(whole(values)?),
                "Pn" => values.clone_into(&mut report.pins),
                "Ln" => report.line = Some(values.parse().ok()?),
                _ => {}
            }
        }
        Some(report)
    }
}

fn numbers(values: &str) -> Option<Vec<f64>> {
    let finite = |text: &str| text.parse().ok().filter(|value: &f64| value.is_finite());
    values.split(',').map(finite).collect()
}

fn whole<const N: usize>(values: &str) -> Option<[u32; N]> {
    let values: Option<Vec<u32>> = values.split(',').map(|text| text.parse().ok()).collect();
    values?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn reports_of_grbl_and_of_stillpoint_are_read() {
        let report = StatusReport::parse(
            "<Hold:1|MPos:262.549,-12.549,0.000,90.000|Bf:12,1011|FS:8985,0|WCO:1.000,0.000,0.000,\
             0.000|Ov:100,50,100|Pn:XD|Ln:7|Another:thing|Strange>",
        )
        .unwrap();
        assert_eq!(report.state, State::Hold(Some(1)));
        assert_eq!(report.machine.unwrap(), [262.549, -12.549, 0.0, 90.0]);
        assert_eq!(report.offset.unwrap()[0], 1.0);
        assert_eq!(report.buffer, Some([12, 1011]));
        assert_eq!(report.feed_mm_min, Some(8985.0));
        assert_eq!(report.overrides, Some([100, 50, 100]));
        assert_eq!((report.pins.as_str(), report.line), ("XD", Some(7)));
        let report = StatusReport::parse("<Alarm|WPos:0.000,0.000,0.000|F:500>").unwrap();
        assert_eq!(report.state, State::Alarm(None));
        assert_eq!((report.machine, report.feed_mm_min), (None, Some(500.0)));
        let report = StatusReport::parse("<Tool>").unwrap();
        assert_eq!(report.state, State::Other("Tool".to_owned()));
    }

    #[test]
    fn damage_is_noticed() {
        for damaged in [
            "<Idle",
            "Idle>",
            "<>",
            "<|MPos:1,2,3>",
            "<Idle|MPos:1,2,x>",
            "<Idle|MPos:1,,3>",
            "<Idle|MPos:1,NaN,3>",
            "<Idle|Bf:1>",
            "<Idle|Bf:-1,2>",
            "<Idle|Ov:1,2>",
            "<Idle|Ln:>",
        ] {
            assert_eq!(StatusReport::parse(damaged), None, "{damaged}");
        }
    }

    fn detail() -> impl Strategy<Value = Option<u8>> {
        proptest::option::of(any::<u8>())
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            state in prop_oneof![
                Just(State::Idle), Just(State::Run), Just(State::Jog), Just(State::Check),
                Just(State::Home), Just(State::Sleep), detail().prop_map(State::Hold),
                detail().prop_map(State::Door), detail().prop_map(State::Alarm),
            ],
            position in proptest::collection::vec(-4000.0_f64..4000.0, 3..5),
            buffer in any::<[u32; 2]>(),
            overrides in any::<[u32; 3]>(),
            feed in 0_u32..1_000_000,
            line in any::<u32>(),
        ) {
            let list = |values: &[f64]| {
                let texts: Vec<_> = values.iter().map(|value| format!("{value:.3}")).collect();
                texts.join(",")
            };
            let text = format!(
                "<{state}|MPos:{}|Bf:{},{}|FS:{feed},0|Ov:{},{},{}|Ln:{line}>",
                list(&position), buffer[0], buffer[1], overrides[0], overrides[1], overrides[2],
            );
            let report = StatusReport::parse(&text).unwrap();
            prop_assert_eq!(report.state, state);
            for (read, written) in report.machine.unwrap().iter().zip(&position) {
                prop_assert!((read - written).abs() <= 0.0005 + 1e-9);
            }
            prop_assert_eq!(report.buffer, Some(buffer));
            prop_assert_eq!(report.overrides, Some(overrides));
            prop_assert_eq!(report.feed_mm_min, Some(f64::from(feed)));
            prop_assert_eq!(report.line, Some(line));
        }

        #[test]
        fn no_report_is_too_strange(text in "\\PC*") {
            let _ = StatusReport::parse(&text);
            let _ = StatusReport::parse(&format!("<{text}>"));
        }
    }
}
