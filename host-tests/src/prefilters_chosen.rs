//! Which prefilters the moves of a program get where each has its own, and why.

use std::fmt;

use planner_core::config::{Robot, RobotConfig};
use planner_core::posture::{ShortestConfig, Tuning};
use planner_core::prefilter::{Mode, Prefilter, PrefilterConfig, insensitivity, residual};
use serde::Serialize;

/// EI leaves its limit beside the nominal frequency: what is said to be kept may touch it, and pass
/// it by so small a part.
const TOUCHES: f64 = 2e-3;

/// Frequencies at which a band is looked at.
const PLACES: u32 = 100;

/// Moves that end with the same kind of prefilter.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct ChosenPrefilter {
    /// Its name.
    pub prefilter: &'static str,
    /// How many moves end with it.
    pub moves: usize,
    /// The lowest frequency that it is made for.
    pub lowest_hz: f64,
    /// The highest one.
    pub highest_hz: f64,
    /// Why; null where the settings name the prefilter.
    pub reason: Option<Reason>,
}

/// Why a prefilter is chosen automatically: no shorter one leaves so little.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct Reason {
    /// By how much the settings say that the frequency may be off, as a fraction.
    pub uncertainty: f64,
    /// The most that it leaves then, as a fraction.
    pub worst_residual: f64,
    /// What may be left, as a fraction.
    pub residual_limit: f64,
    /// By how much the frequency may be off until that is left.
    pub reach: f64,
}

/// The prefilters at the ends of moves by their kinds, those of most moves first. Those of two
/// boxes are not among them.
#[must_use]
pub fn prefilters_chosen(robot: &Robot, at_ends: &[Tuning]) -> Vec<ChosenPrefilter> {
    let mut chosen: Vec<ChosenPrefilter> = Vec::new();
    for tuning in at_ends {
        let Tuning::Named(config) = tuning else {
            continue;
        };
        let frequency_hz = f64::from(config.frequency_hz);
        let name = config.kind.name();
        match chosen.iter_mut().find(|other| other.prefilter == name) {
            Some(same) => {
                same.moves += 1;
                same.lowest_hz = same.lowest_hz.min(frequency_hz);
                same.highest_hz = same.highest_hz.max(frequency_hz);
            }
            None => chosen.push(ChosenPrefilter {
                prefilter: name,
                moves: 1,
                lowest_hz: frequency_hz,
                highest_hz: frequency_hz,
                reason: reason(&robot.config, config),
            }),
        }
    }
    chosen.sort_by_key(|one| std::cmp::Reverse(one.moves));
    chosen
}

fn reason(robot: &RobotConfig, config: &PrefilterConfig) -> Option<Reason> {
    if !robot.automatic {
        return None;
    }
    let ShortestConfig { uncertainty, limit } = robot.shortest;
    let (uncertainty, limit) = (f64::from(uncertainty), f64::from(limit));
    let nominal = Mode {
        frequency_hz: config.frequency_hz.into(),
        damping: config.damping.into(),
    };
    let prefilter = Prefilter::new(config).ok()?;
    let left = |part: f64| {
        let off = uncertainty * (2.0 * part - 1.0);
        let mode = Mode {
            frequency_hz: nominal.frequency_hz * (1.0 + off),
            ..nominal
        };
        residual(&prefilter, &mode)
    };
    let places = (0..=PLACES).map(|place| f64::from(place) / f64::from(PLACES));
    let band = insensitivity(&prefilter, &nominal, limit * (1.0 + TOUCHES))?;
    Some(Reason {
        uncertainty,
        worst_residual: places.map(left).fold(0.0, f64::max),
        residual_limit: limit,
        reach: (1.0 - band.low_hz / nominal.frequency_hz)
            .min(band.high_hz / nominal.frequency_hz - 1.0),
    })
}

impl fmt::Display for ChosenPrefilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            prefilter,
            moves,
            lowest_hz,
            highest_hz,
            reason,
        } = self;
        let plural = if *moves == 1 { "" } else { "s" };
        write!(f, "{moves} move{plural}: {prefilter} for {lowest_hz:.2}")?;
        if highest_hz - lowest_hz > 0.005 {
            write!(f, " to {highest_hz:.2}")?;
        }
        f.write_str(" Hz")?;
        let Some(reason) = reason else {
            return Ok(());
        };
        write!(
            f,
            "; leaves {:.1} % at the most at ±{:.1} %, and {} % is kept to ±{:.1} %",
            100.0 * reason.worst_residual,
            100.0 * reason.uncertainty,
            (1e3 * reason.residual_limit).round() / 10.0,
            100.0 * reason.reach
        )
    }
}
