//! Streaming over a link that damages bytes: every line is carried out once, and in order.
//!
//! A line has a number and a checksum. The controller takes a line only if it is whole and the
//! next one; one that it already has gets its `ok` and no more. So a line may be sent again
//! whenever in doubt, and only the controller knows for certain what it has: it is asked with a
//! number that cannot be the next, refuses that, and says which it waits for. Before the end it
//! has to say so twice, because its answers carry no checksum.

use std::collections::VecDeque;

use super::codes::{CHECKSUM, OUT_OF_ORDER, REFUSED_AFTER_ERROR};
use super::flight::Flight;
use super::streamer::{ACKNOWLEDGE, Ending, Refusal, StreamerConfig};
use super::{Reply, wire};

/// A controller that was asked so often in vain is not asked again.
const TRIES: u32 = 30;

/// A number that is never the next: the largest that Grbl has.
const NEVER_NEXT: u32 = 10_000_000;

/// What the controller says before it refuses a line for its number or its checksum.
const NEXT_IS: &str = "Next is N";

/// What is going on.
#[derive(Clone, Debug)]
enum Phase {
    /// Lines go out as there is room. To [`Phase::Settling`] at anything unforeseen, to
    /// [`Phase::Asking`] when every line has its `ok`.
    Streaming,
    /// Something is wrong, so the answers to what is under way are waited for and mean
    /// nothing. Then [`Phase::Clearing`].
    Settling,
    /// An answer was not what it should be, so maybe one more or one less than lines is on its
    /// way: they are let pass until none comes any more. Then [`Phase::Clearing`].
    Listening(Step),
    /// The controller is told that no more numbered lines come, so that any sender may follow.
    Dismissing(Ending),
    /// A line end, for a line that lost its own, and `$ACK` are under way; then the step.
    Clearing(Step),
    /// The controller is told to count from the beginning. Then it is asked whether it does.
    Numbering,
    /// The controller is asked which line it waits for. From there it goes on.
    Asking,
    /// Nothing more to do.
    Over(Ending),
}

/// What follows when the way is clear.
#[derive(Clone, Debug)]
enum Step {
    Number,
    Ask,
    Stream,
    End(Ending),
}

/// An error that is no matter of the link.
#[derive(Clone, Debug)]
struct Suspicion {
    index: usize,
    code: u8,
    message: Option<String>,
}

/// A program on its way, each line sent until it has arrived.
pub struct CheckedStream {
    lines: Vec<String>,
    error_safe: bool,
    phase: Phase,
    /// Index of the next line to send.
    next: usize,
    /// Lines that the controller has, as far as is known.
    accepted: usize,
    /// Lines that were ever sent.
    sent: usize,
    resent: usize,
    flight: Flight,
    /// What has to go out besides lines.
    outgoing: VecDeque<String>,
    /// `[MSG:…]` since the last answer.
    message: Option<String>,
    /// The line that the controller has said to wait for, since the last answer; 0 if that
    /// was damaged.
    awaited: Option<u32>,
    /// What it has said so before.
    awaited_before: Option<u32>,
    suspicion: Option<Suspicion>,
    fruitless: u32,
}

impl CheckedStream {
    pub fn new(lines: Vec<String>, config: StreamerConfig) -> Self {
        let mut stream = Self {
            error_safe: config.error_safe,
            phase: Phase::Over(Ending::Done),
            next: 0,
            accepted: 0,
            sent: 0,
            resent: 0,
            flight: Flight::new(config.rx_bytes),
            outgoing: VecDeque::new(),
            message: None,
            awaited: None,
            awaited_before: None,
            suspicion: None,
            fruitless: 0,
            lines,
        };
        if !stream.lines.is_empty() {
            stream.clear(Step::Number);
        }
        stream
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

    pub fn resent(&self) -> usize {
        self.resent
    }

    pub fn take(&mut self) -> Option<String> {
        let line = match self.outgoing.pop_front() {
            Some(line) => line,
            None if matches!(self.phase, Phase::Streaming) => self.next_line()?,
            None => return None,
        };
        self.flight.sent(&line);
        Some(line)
    }

    fn next_line(&mut self) -> Option<String> {
        let text = self.lines.get(self.next)?;
        let line = wire::checked(text, number_of(self.next));
        if !self.flight.has_room_for(&line) {
            return None;
        }
        if self.next < self.sent {
            self.resent += 1;
        }
        self.next += 1;
        self.sent = self.sent.max(self.next);
        Some(line)
    }

    pub fn hear(&mut self, reply: &Reply) {
        match reply {
            Reply::Ok => self.answered(None),
            Reply::Error(code) => self.answered(Some(*code)),
            Reply::Message(message) => match message.strip_prefix(NEXT_IS) {
                // Damaged, it is still no sentence about a line.
                Some(number) => self.awaited = Some(number.parse().unwrap_or(0)),
                None => self.message = Some(message.clone()),
            },
            Reply::Status(report) => {
                // A line may be sent twice, so what still moves need not be waited for.
                let is_over = match self.phase {
                    Phase::Listening(_) => self.flight.is_quiet_by(report, false),
                    _ => self.flight.is_lost_by(report, false),
                };
                if is_over {
                    self.go_on(None, None);
                }
            }
            Reply::Alarm(code) => self.phase = Phase::Over(Ending::Alarm(*code)),
            Reply::Banner => self.phase = Phase::Over(Ending::Reset),
            Reply::Info(_) | Reply::Setting { .. } | Reply::Other(_) => {}
        }
    }

    fn answered(&mut self, error: Option<u8>) {
        let was_awaited = self.flight.answered();
        let message = self.message.take();
        let awaited = self.awaited.take();
        if matches!(self.phase, Phase::Streaming) {
            match error {
                None if was_awaited => self.arrived(),
                // An answer to nothing: somewhere before, a line has become two.
                None => self.settle(),
                Some(code) => {
                    let is_of_the_link = awaited.is_some()
                        || matches!(code, CHECKSUM | REFUSED_AFTER_ERROR | OUT_OF_ORDER);
                    self.suspicion = (!is_of_the_link).then_some(Suspicion {
                        index: self.accepted,
                        code,
                        message,
                    });
                    self.settle();
                }
            }
        } else if self.flight.is_empty()
            && self.outgoing.is_empty()
            && !matches!(self.phase, Phase::Listening(_))
        {
            self.go_on(error, awaited);
        }
    }

    fn arrived(&mut self) {
        self.accepted += 1;
        self.fruitless = 0;
        if self.accepted == self.lines.len() {
            self.ask();
        }
    }

    /// Waits for the answers to what is under way, and takes none of them for granted.
    fn settle(&mut self) {
        self.phase = Phase::Settling;
        if self.flight.is_empty() {
            self.clear(Step::Ask);
        }
    }

    /// The last answer is there, or none will come any more.
    fn go_on(&mut self, error: Option<u8>, awaited: Option<u32>) {
        match self.phase.clone() {
            Phase::Streaming | Phase::Settling => self.clear(Step::Ask),
            Phase::Listening(step) => self.clear(step),
            Phase::Clearing(Step::Number) => self.say(Phase::Numbering, wire::checked("M110", 0)),
            Phase::Clearing(Step::Ask) => self.ask(),
            Phase::Clearing(Step::Stream) => {
                self.phase = Phase::Streaming;
                self.next = self.accepted;
            }
            Phase::Clearing(Step::End(ending)) => {
                self.say(Phase::Dismissing(ending), wire::with_checksum("M110"));
            }
            // Whatever it answers: the program has ended.
            Phase::Dismissing(ending) => self.phase = Phase::Over(ending),
            Phase::Numbering if error.is_none() => self.ask(),
            Phase::Numbering => self.listen(Step::Number),
            Phase::Asking => self.told(awaited),
            Phase::Over(_) => {}
        }
    }

    fn ask(&mut self) {
        self.say(Phase::Asking, wire::checked("", NEVER_NEXT));
    }

    fn say(&mut self, phase: Phase, line: String) {
        self.phase = phase;
        self.flight.forget();
        self.outgoing.push_back(line);
    }

    /// The controller has said which line it waits for, or something that noise left of it.
    fn told(&mut self, awaited: Option<u32>) {
        let before = std::mem::replace(&mut self.awaited_before, awaited);
        // A controller that does not count yet takes the question for the first line. Once it
        // counts lines of ours, it must not be told to begin anew.
        let again = if self.sent == 0 {
            Step::Number
        } else {
            Step::Ask
        };
        let Some(index) = awaited.and_then(index_of) else {
            return self.listen(again);
        };
        // What ends a program has to be said twice; a mistake about the rest shows at once.
        let may_end = index == self.lines.len() || self.suspicion.is_some();
        if may_end && awaited != before {
            return self.clear(Step::Ask);
        }
        self.awaited_before = None;
        if index > self.sent {
            // It counts for somebody else; while lines of ours are counted, it cannot.
            let step = if self.sent == 0 {
                Step::Number
            } else {
                Step::Ask
            };
            return self.listen(step);
        }
        if index > self.accepted {
            self.fruitless = 0;
        }
        self.accepted = index;
        let suspicion = self.suspicion.take();
        let ending = match suspicion {
            // It has taken the line into account, so the line came whole and is refused.
            Some(suspicion) if index > suspicion.index => {
                Some(Ending::Refused(self.refusal(suspicion, index)))
            }
            _ => (index == self.lines.len()).then_some(Ending::Done),
        };
        self.clear(ending.map_or(Step::Stream, Step::End));
    }

    fn refusal(&mut self, suspicion: Suspicion, index: usize) -> Refusal {
        let Suspicion {
            index: suspect,
            code,
            message,
        } = suspicion;
        // An `ok` that was lost makes the suspect an earlier line than it is; in error-safe
        // streaming the last one counted is it.
        let refused = if self.error_safe { index - 1 } else { suspect };
        self.accepted = refused;
        Refusal {
            index: refused,
            code,
            message,
            accepted_after: index - 1 - refused,
        }
    }

    fn listen(&mut self, step: Step) {
        self.flight.forget();
        self.phase = Phase::Listening(step);
    }

    fn clear(&mut self, step: Step) {
        self.fruitless += 1;
        if self.fruitless > TRIES {
            self.phase = Phase::Over(Ending::Unverified);
            return;
        }
        self.say(Phase::Clearing(step), String::new());
        if self.error_safe {
            self.outgoing.push_back(ACKNOWLEDGE.to_owned());
        }
    }
}

/// The number of a line: M110 has set it to 0 for the line before the first.
fn number_of(index: usize) -> u32 {
    u32::try_from(index + 1).map_or(NEVER_NEXT - 1, |number| number.min(NEVER_NEXT - 1))
}

fn index_of(number: u32) -> Option<usize> {
    usize::try_from(number.checked_sub(1)?).ok()
}
