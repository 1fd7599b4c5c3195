//! What somebody at a terminal sees while a program runs: on standard error.

use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use crate::link::Known;
use crate::progress::Progress;

/// A progress bar, a line of state, and a line for what is asked.
pub struct LiveView {
    screen: MultiProgress,
    bar: ProgressBar,
    state: ProgressBar,
    question: ProgressBar,
}

impl LiveView {
    /// For a program of so many lines.
    ///
    /// # Panics
    /// Never: the templates are fixed and valid.
    #[must_use]
    pub fn new(progress: Progress, lines: usize) -> Self {
        let screen = MultiProgress::new();
        if progress == Progress::Hidden {
            screen.set_draw_target(indicatif::ProgressDrawTarget::hidden());
        }
        let style = |template| ProgressStyle::with_template(template).expect("a fixed template");
        let line = |style| {
            let bar = ProgressBar::new(lines as u64).with_style(style);
            screen.add(bar)
        };
        Self {
            bar: line(style(
                "{bar:30.blue} {percent:>3} %  {pos}/{len} lines  {msg}",
            )),
            state: line(style("{msg}")),
            question: line(style("{msg:.yellow}")),
            screen,
        }
    }

    /// Shows where the program is.
    pub fn show(&self, accepted: usize, left: Option<Duration>, known: &Known) {
        self.bar.set_position(accepted as u64);
        self.bar
            .set_message(left.map_or_else(String::new, in_words));
        self.state.set_message(state_line(known));
    }

    /// Asks something, or nothing any more.
    pub fn ask(&self, question: &str) {
        self.question.set_message(question.to_owned());
    }

    /// Says something that stays.
    pub fn say(&self, sentence: &str) {
        // Nobody looks where there is no terminal.
        let _ = self.screen.println(sentence);
    }

    /// Takes everything off the screen.
    pub fn clear(&self) {
        for line in [&self.bar, &self.state, &self.question] {
            line.finish_and_clear();
        }
    }
}

fn in_words(left: Duration) -> String {
    let seconds = left.as_secs_f64().round() as u64;
    let (minutes, seconds) = (seconds / 60, seconds % 60);
    match minutes / 60 {
        0 => format!("{minutes}:{seconds:02} left"),
        hours => format!("{hours}:{:02}:{seconds:02} left", minutes % 60),
    }
}

/// State, position, feed and buffers in one line.
#[must_use]
pub fn state_line(known: &Known) -> String {
    let mut line = format!("{:7} {}", known.state_name(), known.position());
    if let Some(feed) = known.feed_mm_min {
        line += &format!("  {feed:.0} mm/min");
    }
    if let Some([moves, bytes]) = known.buffer {
        line += &format!("  free: {moves} moves, {bytes} bytes");
    }
    if let Some([feed, rapid, _]) = known.overrides
        && (feed, rapid) != (100, 100)
    {
        line += &format!("  override: feed {feed} %, rapid {rapid} %");
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::StatusReport;

    #[test]
    fn states_and_times_are_short() {
        let mut known = Known::default();
        let report = "<Run|MPos:1.000,2.000,0.000,0.000|Bf:3,1011|FS:9600,0|Ov:50,100,100>";
        known.update(&StatusReport::parse(report).unwrap());
        assert_eq!(
            state_line(&known),
            "Run     X1.000 Y2.000 Z0.000 C0.000  9600 mm/min  free: 3 moves, 1011 bytes  \
             override: feed 50 %, rapid 100 %"
        );
        assert_eq!(in_words(Duration::from_secs(59)), "0:59 left");
        assert_eq!(in_words(Duration::from_secs(3661)), "1:01:01 left");
    }
}
