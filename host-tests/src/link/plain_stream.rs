//! Streaming by character counting, as every Grbl sender does it.

use super::Reply;
use super::flight::Flight;
use super::streamer::{ACKNOWLEDGE, Ending, Refusal, StreamerConfig};

/// What is going on.
#[derive(Clone, Debug)]
enum Phase {
    /// Lines go out as there is room; to [`Phase::Draining`] when one is refused.
    Streaming,
    /// A line was refused; those under way still get their answers. Then `$ACK`, where the
    /// controller wants it.
    Draining(Refusal),
    /// `$ACK` has to go out, or is under way (`true`); then the end.
    Acknowledging(Refusal, bool),
    /// Nothing more to do.
    Over(Ending),
}

/// A program on its way, each line sent once.
pub struct PlainStream {
    lines: Vec<String>,
    error_safe: bool,
    phase: Phase,
    /// Index of the next line to send.
    next: usize,
    /// Lines that were answered with `ok`, before one was refused.
    accepted: usize,
    flight: Flight,
    /// `[MSG:…]` since the last answer.
    message: Option<String>,
}

impl PlainStream {
    pub fn new(lines: Vec<String>, config: StreamerConfig) -> Self {
        let phase = if lines.is_empty() {
            Phase::Over(Ending::Done)
        } else {
            Phase::Streaming
        };
        Self {
            lines,
            error_safe: config.error_safe,
            phase,
            next: 0,
            accepted: 0,
            flight: Flight::new(config.rx_bytes),
            message: None,
        }
    }

    pub fn ending(&self) -> Option<&Ending> {
        match &self.phase {
            Phase::Over(ending) => Some(ending),
            _ => None,
        }
    }

    pub fn accepted(&self) -> usize {
        self.accepted
    }

    pub fn take(&mut self) -> Option<String> {
        let line = match &mut self.phase {
            Phase::Streaming => {
                let line = self.lines.get(self.next)?;
                if !self.flight.has_room_for(line) {
                    return None;
                }
                self.next += 1;
                line.clone()
            }
            Phase::Acknowledging(_, is_sent) if !*is_sent => {
                *is_sent = true;
                ACKNOWLEDGE.to_owned()
            }
            _ => return None,
        };
        self.flight.sent(&line);
        Some(line)
    }

    pub fn hear(&mut self, reply: &Reply) {
        match reply {
            Reply::Ok => self.answered(None),
            Reply::Error(code) => self.answered(Some(*code)),
            Reply::Message(message) => self.message = Some(message.clone()),
            Reply::Status(report) => {
                if self.flight.is_lost_by(report, true) {
                    self.lost();
                }
            }
            Reply::Alarm(code) => self.phase = Phase::Over(Ending::Alarm(*code)),
            Reply::Banner => self.phase = Phase::Over(Ending::Reset),
            Reply::Info(_) | Reply::Setting { .. } | Reply::Other(_) => {}
        }
    }

    fn answered(&mut self, error: Option<u8>) {
        let message = self.message.take();
        // Another client's line may be answered too.
        if !self.flight.answered() {
            return;
        }
        match (&mut self.phase, error) {
            (Phase::Streaming, None) => {
                self.accepted += 1;
                if self.accepted == self.lines.len() {
                    self.phase = Phase::Over(Ending::Done);
                }
            }
            (Phase::Streaming, Some(code)) => {
                let refusal = Refusal {
                    index: self.accepted,
                    code,
                    message,
                    accepted_after: 0,
                };
                self.phase = Phase::Draining(refusal);
            }
            (Phase::Draining(refusal), None) => refusal.accepted_after += 1,
            // One error may be followed by many: the first is the one to correct.
            _ => {}
        }
        if self.flight.is_empty() {
            self.drained();
        }
    }

    /// Everything that was sent has been answered, or never will be.
    fn drained(&mut self) {
        match &self.phase {
            Phase::Draining(refusal) if self.error_safe => {
                self.phase = Phase::Acknowledging(refusal.clone(), false);
                self.flight.forget();
            }
            Phase::Draining(refusal) | Phase::Acknowledging(refusal, true) => {
                self.phase = Phase::Over(Ending::Refused(refusal.clone()));
            }
            Phase::Streaming | Phase::Acknowledging(_, false) | Phase::Over(_) => {}
        }
    }

    fn lost(&mut self) {
        match self.phase {
            Phase::Streaming => self.phase = Phase::Over(Ending::AnswerLost),
            _ => self.drained(),
        }
    }
}
