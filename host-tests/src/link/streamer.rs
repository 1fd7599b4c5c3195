//! Sending a program: which line goes out when, and what the answers mean.
//!
//! It does no I/O and knows no clock: bytes to send are taken from it, replies are given to it.
//! Silence is measured in status reports, which the caller asks for several times a second.

use super::Reply;
use super::checked_stream::CheckedStream;
use super::plain_stream::PlainStream;

/// How a program is sent.
#[derive(Clone, Copy, Debug)]
pub struct StreamerConfig {
    /// Bytes of unanswered lines that the controller can hold.
    pub rx_bytes: usize,
    /// Number the lines and add checksums, and send again what did not arrive.
    pub checksums: bool,
    /// After an error the controller refuses everything until `$ACK`.
    pub error_safe: bool,
}

/// A line that the controller does not accept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Index of the line.
    pub index: usize,
    /// Grbl's number.
    pub code: u8,
    /// The controller's sentence, if it said one.
    pub message: Option<String>,
    /// Lines that were already sent behind it, and were accepted all the same.
    pub accepted_after: usize,
}

/// How streaming ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Every line was accepted.
    Done,
    /// One was not.
    Refused(Refusal),
    /// The controller stopped and locked itself.
    Alarm(u8),
    /// The controller was reset, or started anew.
    Reset,
    /// An answer will never come.
    AnswerLost,
    /// The controller does not keep count of the lines, or the link is too bad.
    Unverified,
}

/// Tells the controller that the sender knows of the error.
pub const ACKNOWLEDGE: &str = "$ACK";

/// A program on its way.
pub struct Streamer(Stream);

enum Stream {
    /// Each line is sent once.
    Plain(PlainStream),
    /// Lines carry number and checksum, and are sent until they have arrived.
    Checked(CheckedStream),
}

impl Streamer {
    /// A program whose lines are as [`wire::lines`](super::wire::lines) gives them.
    #[must_use]
    pub fn new(lines: Vec<String>, config: StreamerConfig) -> Self {
        Self(if config.checksums {
            Stream::Checked(CheckedStream::new(lines, config))
        } else {
            Stream::Plain(PlainStream::new(lines, config))
        })
    }

    /// How it ended, once it has.
    #[must_use]
    pub fn ending(&self) -> Option<&Ending> {
        match &self.0 {
            Stream::Plain(stream) => stream.ending(),
            Stream::Checked(stream) => stream.ending(),
        }
    }

    /// Lines that the controller has accepted.
    #[must_use]
    pub fn accepted(&self) -> usize {
        match &self.0 {
            Stream::Plain(stream) => stream.accepted(),
            Stream::Checked(stream) => stream.accepted(),
        }
    }

    /// Lines that were sent more than once.
    #[must_use]
    pub fn resent(&self) -> usize {
        match &self.0 {
            Stream::Plain(_) => 0,
            Stream::Checked(stream) => stream.resent(),
        }
    }

    /// What to send now, if anything: one line with its end.
    pub fn take(&mut self) -> Option<Vec<u8>> {
        let line = match &mut self.0 {
            Stream::Plain(stream) => stream.take(),
            Stream::Checked(stream) => stream.take(),
        };
        line.map(|line| (line + "\n").into_bytes())
    }

    /// Takes in what the controller says.
    pub fn hear(&mut self, reply: &Reply) {
        if self.ending().is_some() {
            return;
        }
        match &mut self.0 {
            Stream::Plain(stream) => stream.hear(reply),
            Stream::Checked(stream) => stream.hear(reply),
        }
    }
}
