//! What is known of a controller from all its reports so far.

use super::{State, StatusReport};

/// The last report, completed by earlier ones: Grbl tells offset and overrides now and then.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Known {
    /// What the controller is doing; none before the first report.
    pub state: Option<State>,
    /// Machine position: X, Y, Z in mm, then C in degrees.
    pub machine: Vec<f64>,
    /// Work offset, where it was ever told.
    pub offset: Vec<f64>,
    /// Free moves and free bytes.
    pub buffer: Option<[u32; 2]>,
    /// Speed of the tool, mm/min.
    pub feed_mm_min: Option<f64>,
    /// Overrides of feed, rapids and spindle, percent.
    pub overrides: Option<[u32; 3]>,
    /// A letter for each active input.
    pub pins: String,
    /// Number of the line being executed.
    pub line: Option<u32>,
}

impl Known {
    /// Takes in a report.
    pub fn update(&mut self, report: &StatusReport) {
        self.state = Some(report.state.clone());
        if let Some(offset) = &report.offset {
            self.offset.clone_from(offset);
        }
        if let Some(machine) = &report.machine {
            self.machine.clone_from(machine);
        } else if let Some(work) = &report.work {
            let offsets = self.offset.iter().copied().chain(std::iter::repeat(0.0));
            self.machine = work.iter().zip(offsets).map(|(w, o)| w + o).collect();
        }
        self.buffer = report.buffer.or(self.buffer);
        self.feed_mm_min = report.feed_mm_min.or(self.feed_mm_min);
        self.overrides = report.overrides.or(self.overrides);
        self.pins.clone_from(&report.pins);
        self.line = report.line;
    }

    /// The state's name.
    #[must_use]
    pub fn state_name(&self) -> String {
        let name = |state: &State| state.to_string();
        self.state.as_ref().map_or_else(|| "unknown".into(), name)
    }

    /// The machine position in words: `X250.000 Y0.000 …`.
    #[must_use]
    pub fn position(&self) -> String {
        in_words(&self.machine)
    }

    /// The position in work coordinates, where an offset is in force.
    #[must_use]
    pub fn work_position(&self) -> Option<String> {
        if self.offset.iter().all(|&offset| offset == 0.0) {
            return None;
        }
        let pairs = self.machine.iter().zip(&self.offset);
        let work: Vec<f64> = pairs.map(|(machine, offset)| machine - offset).collect();
        Some(in_words(&work))
    }
}

fn in_words(position: &[f64]) -> String {
    let axes = ["X", "Y", "Z", "C"].iter().zip(position);
    let words: Vec<String> = axes
        .map(|(axis, value)| format!("{axis}{value:.3}"))
        .collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_complete_each_other() {
        let mut known = Known::default();
        assert_eq!(known.state_name(), "unknown");
        for text in [
            "<Run|MPos:10.000,0.000,0.000,0.000|WCO:1.000,2.000,0.000,0.000|Pn:X>",
            "<Run|MPos:11.000,0.000,0.000,0.000|Ov:110,100,100>",
            "<Idle|WPos:11.000,0.000,0.000,0.000>",
        ] {
            known.update(&StatusReport::parse(text).unwrap());
        }
        assert_eq!(known.state, Some(State::Idle));
        assert_eq!(known.overrides, Some([110, 100, 100]));
        assert_eq!(known.position(), "X12.000 Y2.000 Z0.000 C0.000");
        assert_eq!(
            known.work_position().unwrap(),
            "X11.000 Y0.000 Z0.000 C0.000"
        );
        assert_eq!(known.pins, "");
    }
}
