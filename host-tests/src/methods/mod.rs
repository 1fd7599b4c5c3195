//! Other methods of motion on the same programs: what Stillpoint is compared with.
//!
//! | method | corners | smooth by |
//! |---|---|---|
//! | Stillpoint | overlap as long as the tolerance allows | FIR-ZVD or FIR-ZV, in the core's arithmetic |
//! | hybrid \[Yeh26\] | the same, rounded up to the millisecond | FIR-ZVD |
//! | VPO \[Li23\] | overlap as long as the tolerance allows | two boxes |
//! | ADAI \[Li23\] | no dwell at all | one box |
//! | junction velocity | slowed down to a junction velocity | an acceleration limit, then a shaper for each axis: 3D-printer firmware |
//! | full stops | full stops | limits of acceleration and jerk, time-optimal for each segment |
//!
//! All get the same path and feedrates. Those with limits get as acceleration what Stillpoint's
//! prefilter takes at its peak, so that all ask the drives for about the same along the path.
//! Where a method has a parameter it is also tuned, to the corner tolerance or to the mode.

mod figures;
mod full_stops;
mod junction;
mod overlap;
mod task;

pub use figures::{Figures, corner_error_mm};
pub use task::{Limits, STEP_S, Task};

use anyhow::Result;
use planner_core::prefilter::Kind;

use crate::oracle::Prefilter;
use crate::progress::Progress;
use crate::scenario::Scenario;
use crate::vector::xyz;

/// A position in mm.
pub type Point = [f64; 3];

/// What a method made of a program.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Name of the method, and how it is tuned.
    pub method: &'static str,
    /// What came of it.
    pub figures: Figures,
    /// The command, sampled every [`STEP_S`].
    pub positions: Vec<Point>,
    /// Limits along the path that the method was given.
    pub limits: Option<Limits>,
}

/// Largest acceleration of the tool after the stop, in mm/s², that counts as still.
pub const STILL_MM_S2: f64 = 10.0;

impl Entry {
    /// Whether it keeps a corner tolerance and leaves the tool still.
    #[must_use]
    pub fn is_fit(&self, tolerance_mm: f64) -> bool {
        // samples of a millisecond cut a corner where the velocity jumps
        self.figures.corner_error_mm <= tolerance_mm + 1e-3
            && self.figures.residual_mm_s2 <= STILL_MM_S2
    }
}

/// The fastest of those that keep the corner tolerance and leave the tool still.
#[must_use]
pub fn fastest_fit(entries: &[Entry], tolerance_mm: f64) -> Option<&Entry> {
    let fit = entries.iter().filter(|entry| entry.is_fit(tolerance_mm));
    fit.min_by(|a, b| a.figures.cycle_time_s.total_cmp(&b.figures.cycle_time_s))
}

/// Runs a program by every method, on a mode in each Cartesian axis.
///
/// # Errors
/// The program or a setting is refused, or a method finds no solution.
pub fn compare(scenario: &Scenario) -> Result<Vec<Entry>> {
    let task = Task::new(scenario)?;
    let mode = task.mode;
    let named = |name| Prefilter::named(name, mode.frequency_hz, mode.damping);
    let period_s = mode.damped_period_s();
    let hybrid = named("fir-zvd").unwrap_or_else(|| Prefilter::new(&[(0.0, 1.0)], &[period_s]));
    let s_curve = Prefilter::new(&[(0.0, 1.0)], &[period_s, period_s]);
    let adai = Prefilter::new(&[(0.0, 1.0)], &[period_s]);
    let shaper = named("zvd").unwrap_or_else(|| hybrid.clone());
    let limits = Limits::of(&task, &hybrid);

    let ours = |kind| -> Result<Vec<Point>> {
        let trace = scenario.run_with(kind, Progress::Hidden)?.trace;
        Ok(trace.poses().into_iter().map(xyz).collect())
    };
    let in_10_ms = limits.with_jerk_time(0.01);
    let in_a_period = limits.with_jerk_time(period_s);
    // the peaks of two boxes of a period: an S-curve with its zeros at the mode
    let of_boxes = Limits::of(&task, &adai).with_jerk_time(period_s);
    let runs: Vec<(&'static str, Vec<Point>, Option<Limits>)> = vec![
        ("Stillpoint, FIR-ZVD", ours(Kind::FirZvd)?, None),
        ("Stillpoint, FIR-ZV", ours(Kind::FirZv)?, None),
        (
            "hybrid [Yeh26], overlap rounded up",
            overlap::rounded_up(&task, &hybrid),
            None,
        ),
        (
            "VPO [Li23], boxes of a period",
            overlap::within_tolerance(&task, &s_curve),
            None,
        ),
        (
            "ADAI [Li23], box of a period",
            overlap::without_dwell(&task, &adai, 1.0),
            None,
        ),
        (
            "ADAI, feed lowered to the tolerance",
            overlap::without_dwell_within_tolerance(&task, &adai),
            None,
        ),
        (
            "junction velocity, ZVD for each axis",
            junction::run(&task, &shaper, limits.acceleration_mm_s2, task.tolerance_mm),
            Some(limits),
        ),
        (
            "junction velocity, tuned to the tolerance",
            junction::within_tolerance(&task, &shaper, limits.acceleration_mm_s2),
            Some(limits),
        ),
        (
            "full stops, jerk in 10 ms",
            full_stops::run(&task, &in_10_ms)?,
            Some(in_10_ms),
        ),
        (
            "full stops, jerk tuned to the mode",
            full_stops::run(&task, &in_a_period)?,
            Some(in_a_period),
        ),
        (
            "full stops, both limits tuned to the mode",
            full_stops::run(&task, &of_boxes)?,
            Some(of_boxes),
        ),
    ];
    runs.into_iter()
        .map(|(method, positions, limits)| {
            Ok(Entry {
                method,
                figures: Figures::of(&task, &positions)?,
                positions,
                limits,
            })
        })
        .collect()
}
