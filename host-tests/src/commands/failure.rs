//! How a command ends that did not do what it was asked.

use anyhow::Error;

/// A sentence for standard error and an exit status, and what there is to say all the same.
#[derive(Debug)]
pub struct Failure {
    /// For standard output; empty if there is nothing.
    pub answer: String,
    /// For standard error.
    pub error: Error,
    /// The exit status.
    pub status: u8,
}

impl Failure {
    /// With nothing else to say.
    #[must_use]
    pub fn new(status: u8, error: impl Into<Error>) -> Self {
        Self {
            answer: String::new(),
            error: error.into(),
            status,
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::new(1, error)
    }
}
