//! The prefilter as a cascade of stages of unit area, in seconds.

use heapless::Vec;

use super::{EI_RESIDUAL, Kind, Mode, PrefilterConfig, PrefilterError, Response};

/// Stages in a cascade: FIR-ZVD has three.
pub const MAX_STAGES: usize = 4;

/// One impulse `A δ(t − t_i)` of a shaper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// When, in seconds from the stage's input.
    pub time_s: f64,
    /// Its amplitude; a shaper's amplitudes are positive and sum to 1.
    pub amplitude: f64,
}

/// One stage of a cascade; each has unit area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// ZV shaper for a mode: `[1, K] / (1 + K)` at `0, T_d/2`.
    Zv(Mode),
    /// A shaper given by three impulses, the first at zero.
    Impulses([Impulse; 3]),
    /// A box `1/T` on `[0, T]`, `T` in seconds: a moving average.
    Box(f64),
}

impl Stage {
    /// EI shaper: three impulses at `0, T_d/2, T_d` that leave `residual` of a step's
    /// vibration at the nominal mode.
    ///
    /// ```text
    /// A = [(1+v)/4, (1−v)/2 K, (1+v)/4 K²] / Σ,   residual V = v K² / Σ
    /// Σ = c0 + c1 v,  c0 = (1+K)²/4,  c1 = (1−K)²/4   ⇒   v = V c0 / (K² − V c1)
    /// ```
    /// Source: Singhose, Seering, Singer: residual vibration reduction using vector diagrams
    /// to generate shaped inputs, 1994; `v` solved so that the residual holds with damping.
    #[must_use]
    pub fn extra_insensitive(mode: &Mode, residual: f64) -> Self {
        let k = mode.half_period_decay();
        let c0 = (1.0 + k) * (1.0 + k) / 4.0;
        let c1 = (1.0 - k) * (1.0 - k) / 4.0;
        let v = residual * c0 / (k * k - residual * c1);
        let sum = c0 + c1 * v;
        let period_s = mode.damped_period_s();
        let at = |time_s, amplitude| Impulse { time_s, amplitude };
        Self::Impulses([
            at(0.0, (1.0 + v) / 4.0 / sum),
            at(period_s / 2.0, (1.0 - v) / 2.0 * k / sum),
            at(period_s, (1.0 + v) / 4.0 * k * k / sum),
        ])
    }

    /// The stage's length in seconds.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        match self {
            Self::Zv(mode) => mode.damped_period_s() / 2.0,
            Self::Impulses(list) => list.iter().fold(0.0, |end, i| i.time_s.max(end)),
            Self::Box(length_s) => *length_s,
        }
    }

    /// The stage's impulses; none for a box.
    pub(super) fn impulses(&self) -> Vec<Impulse, 3> {
        match self {
            Self::Zv(mode) => {
                let k = mode.half_period_decay();
                Vec::from_iter([
                    Impulse {
                        time_s: 0.0,
                        amplitude: 1.0 / (1.0 + k),
                    },
                    Impulse {
                        time_s: mode.damped_period_s() / 2.0,
                        amplitude: k / (1.0 + k),
                    },
                ])
            }
            Self::Impulses(list) => list.iter().copied().collect(),
            Self::Box(_) => Vec::new(),
        }
    }
}

/// A prefilter: a cascade of stages, shapers first and boxes last.
///
/// The order matters to rounding only: a box at the end averages what the stages before it
/// have rounded.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefilter {
    stages: Vec<Stage, MAX_STAGES>,
}

impl Prefilter {
    /// The prefilter that the settings describe.
    ///
    /// # Errors
    /// [`PrefilterError`] names the setting that is out of range.
    pub fn new(config: &PrefilterConfig) -> Result<Self, PrefilterError> {
        let PrefilterConfig {
            kind,
            frequency_hz,
            damping,
        } = *config;
        if !(0.01..=250.0).contains(&frequency_hz) {
            return Err(PrefilterError::Frequency { frequency_hz });
        }
        if !(0.0..=0.5).contains(&damping) {
            return Err(PrefilterError::Damping { damping });
        }
        let mode = Mode {
            frequency_hz: f64::from(frequency_hz),
            damping: f64::from(damping),
        };
        let zv = Stage::Zv(mode);
        let fir = Stage::Box(mode.damped_period_s());
        let stages: &[Stage] = match kind {
            Kind::None => &[],
            Kind::Zv => &[zv],
            Kind::Zvd => &[zv, zv],
            Kind::Ei => &[Stage::extra_insensitive(&mode, EI_RESIDUAL)],
            Kind::Fir => &[fir],
            Kind::FirZv => &[zv, fir],
            Kind::FirZvd => &[zv, zv, fir],
            Kind::SCurve => &[fir, fir],
        };
        Ok(Self {
            stages: stages.iter().copied().collect(),
        })
    }

    /// Two boxes in cascade, given by their lengths in seconds: a second-order moving average,
    /// with a zero at the inverse of each length.
    ///
    /// The shorter one filters first: the longer a box, the less it errs by taking its input
    /// for straight from tick to tick.
    #[must_use]
    pub fn of_boxes([one_s, other_s]: [f64; 2]) -> Self {
        Self {
            stages: Vec::from_iter([one_s.min(other_s), one_s.max(other_s)].map(Stage::Box)),
        }
    }

    /// One box, given by its length in seconds: a moving average.
    #[must_use]
    pub fn of_box(length_s: f64) -> Self {
        Self {
            stages: Vec::from_iter([Stage::Box(length_s)]),
        }
    }

    /// The stages in the order in which they filter.
    #[must_use]
    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// `T_h`: how long the output moves on after the input has stopped, in seconds.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        self.stages.iter().map(Stage::length_s).sum()
    }

    /// The response to a segment that accelerates through this prefilter.
    #[must_use]
    pub fn response(&self) -> Response {
        Response::new(&self.stages, false)
    }

    /// The response of the prefilter run backwards in time: what a deceleration looks like
    /// when it is watched from its end.
    #[must_use]
    pub fn reversed_response(&self) -> Response {
        Response::new(&self.stages, true)
    }

    /// The longest box in seconds; none in a pure shaper, which lets the velocity jump.
    #[must_use]
    pub fn longest_box_s(&self) -> Option<f64> {
        self.stages
            .iter()
            .filter_map(|stage| match stage {
                Stage::Box(length_s) => Some(*length_s),
                _ => None,
            })
            .reduce(f64::max)
    }
}
