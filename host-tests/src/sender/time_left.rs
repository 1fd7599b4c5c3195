//! How long a program will still take.

use std::time::Duration;

use crate::link::State;

/// Progress says little about the rest before so much of it was made.
const LEAST_PART: f64 = 0.02;

/// Time that a program has moved, and how long it will.
#[derive(Clone, Copy, Debug)]
pub struct TimeLeft {
    /// Time of the whole motion, if it was planned.
    planned_s: Option<f64>,
    /// Time moved so far, in the plan's time: overrides stretch it.
    moved_s: f64,
}

impl TimeLeft {
    /// For a motion of which the whole time may be known.
    #[must_use]
    pub fn new(planned: Option<Duration>) -> Self {
        Self {
            planned_s: planned.map(|planned| planned.as_secs_f64()),
            moved_s: 0.0,
        }
    }

    /// Time went by in a state, at a feed override in percent.
    pub fn pass(&mut self, time: Duration, state: Option<&State>, override_percent: u32) {
        if state == Some(&State::Run) {
            self.moved_s += time.as_secs_f64() * f64::from(override_percent) / 100.0;
        }
    }

    /// What is left when `part` of the lines was accepted; none where nothing is known.
    #[must_use]
    pub fn estimate(&self, part: f64) -> Option<Duration> {
        let left_s = match self.planned_s {
            Some(planned_s) => planned_s - self.moved_s,
            None if (LEAST_PART..1.0).contains(&part) => self.moved_s * (1.0 - part) / part,
            None => return None,
        };
        Duration::try_from_secs_f64(left_s.max(0.0)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINUTE: Duration = Duration::from_secs(60);

    #[test]
    fn a_plan_is_counted_down_while_it_moves() {
        let mut left = TimeLeft::new(Some(5 * MINUTE));
        assert_eq!(left.estimate(0.0), Some(5 * MINUTE));
        left.pass(MINUTE, Some(&State::Run), 100);
        left.pass(MINUTE, Some(&State::Hold(Some(0))), 100);
        left.pass(MINUTE, Some(&State::Run), 50);
        assert_eq!(left.estimate(0.9), Some(Duration::from_secs(210)));
        left.pass(10 * MINUTE, Some(&State::Run), 100);
        assert_eq!(left.estimate(1.0), Some(Duration::ZERO));
    }

    #[test]
    fn without_a_plan_progress_is_all_there_is() {
        let mut left = TimeLeft::new(None);
        left.pass(MINUTE, Some(&State::Run), 100);
        assert_eq!(left.estimate(0.01), None);
        assert_eq!(left.estimate(0.25), Some(3 * MINUTE));
        assert_eq!(left.estimate(1.0), None);
    }
}
