//! The lines under way: how many bytes they are, and whether their answers will still come.

use std::collections::VecDeque;

use super::{State, StatusReport};

/// So many reports in a row that show nothing waiting and nothing moving, while an answer is
/// outstanding, mean that it will not come. The first may have been under way already.
const QUIET_REPORTS: u32 = 5;

/// The same where an answer that comes all the same does no harm.
const QUIET_REPORTS_IN_DOUBT: u32 = 2;

/// Lines without an answer.
#[derive(Clone, Debug)]
pub struct Flight {
    rx_bytes: usize,
    /// Bytes of each, its end included.
    lines: VecDeque<usize>,
    quiet_reports: u32,
}

impl Flight {
    /// Nothing is under way to a controller that can hold so many bytes.
    pub fn new(rx_bytes: usize) -> Self {
        Self {
            rx_bytes,
            lines: VecDeque::new(),
            quiet_reports: 0,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Whether another line fits. One that is longer than the controller's buffer goes alone,
    /// for the controller to refuse it.
    pub fn has_room_for(&self, line: &str) -> bool {
        let bytes: usize = self.lines.iter().sum();
        bytes == 0 || bytes + line.len() < self.rx_bytes
    }

    /// A line goes out.
    pub fn sent(&mut self, line: &str) {
        self.lines.push_back(line.len() + 1);
        self.quiet_reports = 0;
    }

    /// An answer has come; whether one was awaited.
    pub fn answered(&mut self) -> bool {
        self.quiet_reports = 0;
        self.lines.pop_front().is_some()
    }

    /// No answers are awaited any more.
    pub fn forget(&mut self) {
        self.lines.clear();
        self.quiet_reports = 0;
    }

    /// Takes in a report; whether the answers that are outstanding will never come. A motion
    /// may delay them, unless `motion_delays` says that none does and that a mistake costs
    /// nothing but time.
    pub fn is_lost_by(&mut self, report: &StatusReport, motion_delays: bool) -> bool {
        !self.is_empty() && self.is_quiet_by(report, motion_delays)
    }

    /// Takes in a report; whether the controller has nothing more to answer.
    pub fn is_quiet_by(&mut self, report: &StatusReport, motion_delays: bool) -> bool {
        let is_at_rest = matches!(report.state, State::Idle | State::Check);
        let is_quiet = match report.buffer {
            Some([_, free]) => free as usize >= self.rx_bytes && (is_at_rest || !motion_delays),
            None => is_at_rest,
        };
        self.quiet_reports = if is_quiet { self.quiet_reports + 1 } else { 0 };
        let enough = if motion_delays {
            QUIET_REPORTS
        } else {
            QUIET_REPORTS_IN_DOUBT
        };
        if self.quiet_reports < enough {
            return false;
        }
        self.quiet_reports = 0;
        true
    }
}
