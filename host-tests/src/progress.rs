//! Progress bars, on standard error.

use indicatif::{ProgressBar, ProgressStyle};

/// Whether long work shows how far it is. Without a terminal it never does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Bars on standard error.
    Shown,
    /// Silence.
    Hidden,
}

impl Progress {
    /// A bar for `length` steps of the work named.
    ///
    /// # Panics
    /// Never: the template is fixed and valid.
    #[must_use]
    pub fn bar(self, work: &str, length: usize) -> ProgressBar {
        if self == Self::Hidden {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{prefix:22} {bar:40.blue} {percent:>3} %")
            .expect("a fixed template");
        ProgressBar::new(length as u64)
            .with_style(style)
            .with_prefix(work.to_owned())
    }

    /// A counter of simulated time for work of unknown length.
    ///
    /// # Panics
    /// Never: the template is fixed and valid.
    #[must_use]
    pub fn counter(self, work: &str) -> ProgressBar {
        if self == Self::Hidden {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{prefix:22} {spinner} {pos} ms of motion")
            .expect("a fixed template");
        ProgressBar::new_spinner()
            .with_style(style)
            .with_prefix(work.to_owned())
    }
}
