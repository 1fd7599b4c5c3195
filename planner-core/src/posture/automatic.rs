//! The automatic prefilter: the shortest one that leaves little enough of whatever the mode
//! may be.

use core::fmt;

use heapless::Vec;

use super::course::{Course, between};
use super::follow::ShortestConfig;
use crate::prefilter::{Band, Kernel, Kind, Mode, Prefilter, PrefilterConfig, residual};
use crate::sort::sort_by;

/// What a prefilter has to achieve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Requirement {
    /// The mode that it is made for.
    nominal: Mode,
    /// What the mode's frequency may be.
    band: Band,
    /// What may be left of its vibration, as a fraction.
    limit: f64,
}

impl Requirement {
    /// A mode whose frequency is known to `±uncertainty` (a fraction, 0 to 0.5), of which
    /// `limit` (a fraction, above 0 and up to 1) may be left.
    ///
    /// # Errors
    /// [`ChoiceError`] names the value that is out of range.
    pub fn new(mode: &Mode, uncertainty: f64, limit: f64) -> Result<Self, ChoiceError> {
        let Mode { frequency_hz, .. } = *mode;
        Self::over(*mode, [frequency_hz; 2], uncertainty, limit)
    }

    /// The same for everything that the mode is along a course, by one prefilter made for its
    /// middle.
    ///
    /// # Errors
    /// [`ChoiceError`] names the value that is out of range.
    pub fn along(course: &Course, uncertainty: f64, limit: f64) -> Result<Self, ChoiceError> {
        let ends_hz = [course.start.frequency_hz, course.end.frequency_hz];
        let middle = between(course.start, course.end, 0.5);
        Self::over(middle, ends_hz, uncertainty, limit)
    }

    fn over(
        nominal: Mode,
        [one_hz, other_hz]: [f64; 2],
        uncertainty: f64,
        limit: f64,
    ) -> Result<Self, ChoiceError> {
        if !(0.0..=0.5).contains(&uncertainty) {
            return Err(ChoiceError::Uncertainty { uncertainty });
        }
        if !(limit > 0.0 && limit <= 1.0) {
            return Err(ChoiceError::Limit { limit });
        }
        Ok(Self {
            nominal,
            band: Band {
                low_hz: one_hz.min(other_hz) * (1.0 - uncertainty),
                high_hz: one_hz.max(other_hz) * (1.0 + uncertainty),
            },
            limit,
        })
    }

    /// Whether what is left at the ends of the band, where it is mostly largest, is allowed.
    fn may_keep(&self, prefilter: &Prefilter) -> bool {
        [self.band.low_hz, self.band.high_hz]
            .into_iter()
            .all(|frequency_hz| self.allows(self.left(prefilter, frequency_hz)))
    }

    fn allows(&self, residual: f64) -> bool {
        residual <= self.limit + MARGIN
    }

    fn left(&self, prefilter: &Prefilter, frequency_hz: f64) -> f64 {
        let mode = Mode {
            frequency_hz,
            ..self.nominal
        };
        residual(prefilter, &mode)
    }

    /// The largest residual over the band, looked at in steps of 0.5 % of the nominal
    /// frequency: what lies between two steps is larger by less than 0.001. The search ends
    /// at the first residual above `enough`.
    fn worst(&self, prefilter: &Prefilter, enough: f64) -> f64 {
        let Band { low_hz, high_hz } = self.band;
        let steps = libm::ceil((high_hz - low_hz) / (STEP * self.nominal.frequency_hz));
        let steps = steps.clamp(1.0, MOST_STEPS);
        let mut worst = 0.0_f64;
        for step in 0..=steps as u32 {
            let frequency_hz = low_hz + (high_hz - low_hz) * f64::from(step) / steps;
            worst = worst.max(self.left(prefilter, frequency_hz));
            if worst > enough {
                break;
            }
        }
        worst
    }
}

/// Steps of the search for the largest residual, as a part of the nominal frequency.
const STEP: f64 = 0.005;

/// The most steps of that search: a course over a decade of frequencies takes longer ones.
const MOST_STEPS: f64 = 400.0;

/// EI leaves exactly its limit at the nominal frequency: the margin keeps rounding out of the
/// answer.
const MARGIN: f64 = 1e-6;

/// The prefilter that was chosen, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Its name.
    pub kind: Kind,
    /// The prefilter, made for the nominal mode.
    pub prefilter: Prefilter,
    /// The most that it leaves within the band, as a fraction.
    pub worst: f64,
    requirement: Requirement,
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Requirement { band, limit, .. } = &self.requirement;
        write!(
            f,
            "{}: shortest whose residual stays below {} % from {:.1} to {:.1} Hz (worst {:.1} %)",
            self.kind.name(),
            Percent(*limit),
            band.low_hz,
            band.high_hz,
            100.0 * self.worst
        )
    }
}

/// A fraction in percent, without the digits that binary fractions add.
struct Percent(f64);

impl fmt::Display for Percent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        ((1e5 * self.0 + 0.5) as u32 as f32 / 1e3).fmt(f)
    }
}

/// Why no prefilter was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChoiceError {
    /// The uncertainty is not between 0 and 0.5.
    Uncertainty {
        /// What was given.
        uncertainty: f64,
    },
    /// The residual allowed is not above 0 and up to 1.
    Limit {
        /// What was given.
        limit: f64,
    },
    /// No prefilter keeps the limit over the whole band.
    NoneKeeps {
        /// What was asked for.
        requirement: Requirement,
        /// The one that comes closest and the most that it leaves; none if none can be made
        /// for the mode.
        closest: Option<(Kind, f64)>,
    },
}

impl fmt::Display for ChoiceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uncertainty { uncertainty } => write!(
                f,
                "the frequency's uncertainty of {uncertainty} is outside 0 to 0.5: give a fraction"
            ),
            Self::Limit { limit } => write!(
                f,
                "the residual allowed of {limit} is not above 0 and up to 1: give a fraction"
            ),
            Self::NoneKeeps {
                requirement: Requirement { band, limit, .. },
                closest,
            } => {
                write!(
                    f,
                    "no prefilter's residual stays below {} % from {:.1} to {:.1} Hz",
                    Percent(*limit),
                    band.low_hz,
                    band.high_hz
                )?;
                match closest {
                    Some((kind, worst)) => write!(
                        f,
                        " ({} comes closest with {:.1} %): allow more, or measure the mode",
                        kind.name(),
                        100.0 * worst
                    ),
                    None => f.write_str(": none can be made for this mode"),
                }
            }
        }
    }
}

impl core::error::Error for ChoiceError {}

/// Chooses the shortest of `kinds` whose residual keeps the requirement's limit over its whole
/// band; of equally long ones that which leaves less.
///
/// A prefilter that cannot be made for the mode, as one longer than the delay line, is passed
/// over, and so is a list of impulses, which no mode has made. Lengths and residuals scale with
/// the frequency: the kind chosen depends on damping, limit and the ratio of the band's ends to
/// the nominal frequency only, so that a caller may keep it from move to move. Cost on a
/// Cortex-M4F: some million instructions over a band of ±20 %.
///
/// # Errors
/// [`ChoiceError::NoneKeeps`] names the one that comes closest.
pub fn choose(requirement: &Requirement, kinds: &[Kind]) -> Result<Choice, ChoiceError> {
    let mut best: Option<Choice> = None;
    for (kind, prefilter) in made_for(&requirement.nominal, kinds) {
        let (longest_s, least) = best
            .as_ref()
            .map_or((f64::INFINITY, f64::INFINITY), |best| {
                (best.prefilter.length_s(), best.worst)
            });
        let length_s = prefilter.length_s();
        if length_s > longest_s + SAME_LENGTH_S || !requirement.may_keep(&prefilter) {
            continue;
        }
        let is_shorter = length_s < longest_s - SAME_LENGTH_S;
        let allowed = requirement.limit + MARGIN;
        let enough = if is_shorter {
            allowed
        } else {
            allowed.min(least)
        };
        let worst = requirement.worst(&prefilter, enough);
        if requirement.allows(worst)
            && (is_shorter || worst < least)
            && Kernel::new(&prefilter).is_ok()
        {
            best = Some(Choice {
                kind,
                prefilter,
                worst,
                requirement: *requirement,
            });
        }
    }
    best.ok_or_else(|| ChoiceError::NoneKeeps {
        requirement: *requirement,
        closest: made_for(&requirement.nominal, kinds)
            .filter(|(_, prefilter)| Kernel::new(prefilter).is_ok())
            .map(|(kind, prefilter)| (kind, requirement.worst(&prefilter, f64::INFINITY)))
            .min_by(|(_, one), (_, other)| one.total_cmp(other)),
    })
}

/// Which prefilter is the shortest for how much the mode may be off, worked out once.
///
/// Lengths and residuals scale with the frequency, so that one table holds for every place of
/// a map, and a look into it costs nothing.
#[derive(Clone, Debug)]
pub struct Shortest {
    /// Shortest first: each kind with how far the mode may be off, uncertainty included.
    reach: Vec<(Kind, f32), { Kind::ALL.len() }>,
    config: ShortestConfig,
}

/// No prefilter keeps the residual allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShortestError {
    /// The uncertainty or the residual allowed is out of range.
    Value(ChoiceError),
    /// Every prefilter leaves more.
    None {
        /// What was asked for.
        config: ShortestConfig,
        /// The frequency's uncertainty that one prefilter at least allows for.
        most: f32,
    },
}

impl fmt::Display for ShortestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value(error) => error.fmt(f),
            Self::None { config, most } => write!(
                f,
                "no prefilter's residual stays below {} % of a mode known to {} %, only to {:.1} %: allow more, or measure the mode",
                Percent(config.limit.into()),
                Percent(config.uncertainty.into()),
                100.0 * most
            ),
        }
    }
}

impl Shortest {
    /// The table for modes of these damping ratios and EI shapers that leave `v_tol`.
    ///
    /// Cost on a Cortex-M4F: some ten million instructions, once for a robot.
    ///
    /// # Errors
    /// [`ShortestError`] if a value is out of range or no prefilter will do.
    pub fn new(
        modes: impl Iterator<Item = Mode> + Clone,
        config: &ShortestConfig,
        v_tol: f32,
    ) -> Result<Self, ShortestError> {
        let one_hz = |damping| Mode {
            frequency_hz: 1.0,
            damping,
        };
        let dampings = modes.map(|mode| mode.damping);
        let least = one_hz(dampings.clone().fold(0.5, f64::min));
        let most = one_hz(dampings.fold(0.0, f64::max));
        let (uncertainty, limit) = (f64::from(config.uncertainty), f64::from(config.limit));
        Requirement::new(&most, uncertainty, limit).map_err(ShortestError::Value)?;
        let mut all: Vec<(Kind, f32, f64), { Kind::ALL.len() }> = Vec::new();
        for kind in by_length(&Kind::ALL) {
            let at = |mode| PrefilterConfig {
                v_tol,
                ..self::config(kind, mode)
            };
            let (least, most) = (at(&least), at(&most));
            let Some(length_s) = length_s(&most) else {
                continue;
            };
            let reach = reach(&least, limit).min(reach(&most, limit)) as f32;
            // there is room for every kind
            let _ = all.push((kind, reach, length_s));
        }
        sort_by(
            &mut all,
            |(_, reach, length_s), (_, other_reach, other_s)| {
                length_s < other_s || length_s == other_s && reach > other_reach
            },
        );
        let furthest = all.iter().map(|(_, reach, _)| *reach).fold(0.0, f32::max);
        if furthest < config.uncertainty {
            return Err(ShortestError::None {
                config: *config,
                most: furthest,
            });
        }
        Ok(Self {
            reach: all
                .into_iter()
                .map(|(kind, reach, _)| (kind, reach))
                .collect(),
            config: *config,
        })
    }

    /// The shortest for a mode that is off by up to `off` (a fraction) besides what it is not
    /// known to; the one that comes closest if none will do.
    #[must_use]
    pub fn kind(&self, off: f64) -> Kind {
        let wanted = self.config.uncertainty + off as f32;
        let found = self.reach.iter().find(|(_, reach)| *reach >= wanted);
        found.map_or(self.longest(), |(kind, _)| *kind)
    }

    /// Keeps of the kinds those that will do, and the shortest in any case.
    pub fn retain(&mut self, will_do: impl Fn(Kind) -> bool) {
        let shortest = self.kind(0.0);
        self.reach
            .retain(|(kind, _)| *kind == shortest || will_do(*kind));
    }

    /// Every kind that is ever chosen.
    pub fn kinds(&self) -> impl Iterator<Item = Kind> {
        self.chosen().map(|(kind, _)| kind)
    }

    /// The same with how far each allows: further than all shorter ones.
    fn chosen(&self) -> impl Iterator<Item = (Kind, f32)> {
        let mut furthest = 0.0;
        let all = self.reach.iter().copied();
        all.filter(move |(_, reach)| {
            let is_chosen = *reach > furthest && *reach >= self.config.uncertainty;
            if is_chosen {
                furthest = *reach;
            }
            is_chosen
        })
    }

    /// The one that allows for the most: none that is ever chosen is longer.
    #[must_use]
    pub fn longest(&self) -> Kind {
        let all = self.reach.iter();
        let furthest = all.max_by(|(_, one), (_, other)| one.total_cmp(other));
        furthest.map_or(Kind::None, |(kind, _)| *kind)
    }
}

impl fmt::Display for Shortest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: shortest whose residual stays below {} % of a mode known to {} %",
            self.kind(0.0).name(),
            Percent(self.config.limit.into()),
            Percent(self.config.uncertainty.into()),
        )?;
        // longer ones, for moves that keep one prefilter while the mode changes
        self.chosen()
            .try_for_each(|(kind, reach)| write!(f, "; {} to {:.1} %", kind.name(), 100.0 * reach))
    }
}

/// How far the mode may be off, as a fraction, for no more than `limit` to be left of it: good
/// to 0.03 %, and never too much but by what the residual does within a percent.
#[inline(never)]
fn reach(config: &PrefilterConfig, limit: f64) -> f64 {
    let mut prefilter = Prefilter::NONE;
    if prefilter.set(config).is_err() {
        return -1.0;
    }
    let nominal = Mode {
        frequency_hz: config.frequency_hz.into(),
        damping: config.damping.into(),
    };
    let keeps = |off: f64| {
        [1.0 - off, 1.0 + off].into_iter().all(|ratio| {
            let mode = Mode {
                frequency_hz: nominal.frequency_hz * ratio,
                ..nominal
            };
            residual(&prefilter, &mode) <= limit + MARGIN
        })
    };
    if !keeps(0.0) {
        return -1.0;
    }
    let mut inside = 0.0;
    while inside < FURTHEST && keeps(inside + REACH_STEP) {
        inside += REACH_STEP;
    }
    let mut outside = inside + REACH_STEP;
    for _ in 0..5 {
        let middle = (inside + outside) / 2.0;
        if keeps(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// Steps of the search for how far a mode may be off.
const REACH_STEP: f64 = 0.01;

/// The furthest that it is looked for.
const FURTHEST: f64 = 0.6;

/// Those prefilters that can be made for a mode, the shortest first.
fn made_for(mode: &Mode, kinds: &[Kind]) -> impl Iterator<Item = (Kind, Prefilter)> {
    by_length(kinds)
        .into_iter()
        .filter_map(|kind| Some((kind, Prefilter::new(&config(kind, mode)).ok()?)))
}

/// Those that follow from the mode alone, the shortest first.
fn by_length(kinds: &[Kind]) -> Vec<Kind, { Kind::ALL.len() }> {
    let mut by_length: Vec<Kind, { Kind::ALL.len() }> = kinds
        .iter()
        .copied()
        .filter(|kind| kind.follows_the_mode())
        .take(Kind::ALL.len())
        .collect();
    let key = |kind: &Kind| (kind.quarter_periods(), *kind as u8);
    sort_by(&mut by_length, |one, other| key(one) < key(other));
    by_length
}

/// The settings of a kind for a mode.
fn config(kind: Kind, mode: &Mode) -> PrefilterConfig {
    PrefilterConfig {
        kind,
        frequency_hz: mode.frequency_hz as f32,
        damping: mode.damping as f32,
        ..PrefilterConfig::default()
    }
}

/// The length in seconds of a prefilter, if it can be made.
#[inline(never)]
fn length_s(config: &PrefilterConfig) -> Option<f64> {
    let mut prefilter = Prefilter::NONE;
    prefilter.set(config).ok()?;
    Some(prefilter.length_s())
}

/// Prefilters whose lengths differ by less take equally long.
const SAME_LENGTH_S: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    const MODE: Mode = Mode {
        frequency_hz: 6.34,
        damping: 0.022,
    };

    /// The published prefilters.
    const PUBLISHED: [Kind; 7] = [
        Kind::None,
        Kind::Zv,
        Kind::Zvd,
        Kind::Ei,
        Kind::Fir,
        Kind::FirZv,
        Kind::FirZvd,
    ];

    fn chosen(uncertainty: f64, limit: f64) -> Result<Choice, ChoiceError> {
        choose(&Requirement::new(&MODE, uncertainty, limit)?, &PUBLISHED)
    }

    #[test]
    fn the_more_uncertain_the_longer() {
        let mut last_s = 0.0;
        for percent in 0..=26 {
            let choice = chosen(f64::from(percent) / 100.0, 0.05).unwrap();
            let length_s = choice.prefilter.length_s();
            assert!(length_s >= last_s - 1e-9, "{choice}");
            assert!(choice.worst <= 0.05 + 1e-6, "{choice}");
            last_s = length_s;
        }
        assert_eq!(chosen(0.0, 0.05).unwrap().kind, Kind::Zv);
        assert_eq!(chosen(0.26, 0.05).unwrap().kind, Kind::FirZvd);
    }

    #[test]
    fn humps_are_the_shortest_over_a_wide_band() {
        let widest = |percent: u8| {
            let requirement = Requirement::new(&MODE, f64::from(percent) / 100.0, 0.05).unwrap();
            choose(&requirement, &Kind::ALL).unwrap().kind
        };
        let expected = [
            (2, Kind::Zv),
            (5, Kind::Mzv),
            (19, Kind::Ei),
            (34, Kind::TwoHumpEi),
            (45, Kind::ThreeHumpEi),
        ];
        for (percent, kind) in expected {
            assert_eq!(widest(percent), kind, "±{percent} %");
        }
    }

    #[test]
    fn no_shorter_one_keeps_the_limit() {
        for percent in 0..=45 {
            let requirement = Requirement::new(&MODE, f64::from(percent) / 100.0, 0.05).unwrap();
            let choice = choose(&requirement, &Kind::ALL).unwrap();
            for kind in Kind::ALL {
                let Ok(alone) = choose(&requirement, &[kind]) else {
                    continue;
                };
                assert!(
                    alone.prefilter.length_s() >= choice.prefilter.length_s() - 1e-9,
                    "{choice}, but {alone}"
                );
            }
        }
    }

    #[test]
    fn the_worst_residual_is_found_between_the_steps_too() {
        for kind in Kind::ALL.into_iter().filter(|kind| kind.follows_the_mode()) {
            for uncertainty in [0.013, 0.1, 0.37] {
                let requirement = Requirement::new(&MODE, uncertainty, 1.0).unwrap();
                let choice = choose(&requirement, &[kind]).unwrap();
                let Band { low_hz, high_hz } = requirement.band;
                for step in 0..=5000 {
                    let mode = Mode {
                        frequency_hz: low_hz + (high_hz - low_hz) * f64::from(step) / 5000.0,
                        ..MODE
                    };
                    let left = residual(&choice.prefilter, &mode);
                    assert!(left < choice.worst + 1e-3, "{choice}: {left} at {mode:?}");
                }
            }
        }
    }

    #[test]
    fn it_says_why() {
        assert_eq!(
            format!(
                "{}",
                choose(
                    &Requirement::new(&MODE, 0.1, 0.05).unwrap(),
                    &[Kind::Fir, Kind::FirZv]
                )
                .unwrap()
            ),
            "fir-zv: shortest whose residual stays below 5 % from 5.7 to 7.0 Hz (worst 1.6 %)"
        );
        let refused = |result: Result<Choice, ChoiceError>| format!("{}", result.unwrap_err());
        let said = refused(chosen(0.5, 0.01));
        assert!(
            said.starts_with("no prefilter's residual stays below 1 % from 3.2 to 9.5 Hz (fir-zvd comes closest with"),
            "{said}"
        );
        assert!(refused(chosen(0.6, 0.01)).contains("uncertainty of 0.6"));
        assert!(refused(chosen(0.1, 0.0)).contains("residual allowed of 0 "));
        let slow = Mode {
            frequency_hz: 0.6,
            damping: 0.0,
        };
        let slow = Requirement::new(&slow, 0.1, 0.05).unwrap();
        assert!(refused(choose(&slow, &[Kind::FirZv])).ends_with("none can be made for this mode"));
    }

    #[test]
    fn one_prefilter_for_a_course_covers_both_its_ends() {
        let course = Course {
            start: Mode {
                frequency_hz: 6.0,
                ..MODE
            },
            end: Mode {
                frequency_hz: 9.0,
                ..MODE
            },
            length_mm: 100.0,
        };
        let choice = choose(
            &Requirement::along(&course, 0.02, 0.05).unwrap(),
            &PUBLISHED,
        )
        .unwrap();
        assert_eq!(choice.kind, Kind::FirZvd);
        for frequency_hz in [5.9, 6.0, 9.0, 9.1] {
            assert!(
                residual(
                    &choice.prefilter,
                    &Mode {
                        frequency_hz,
                        ..MODE
                    }
                ) < 0.05
            );
        }
    }
}
