//! Paths of a tool that moves and turns, from a table, and what the core makes of them.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use planner_core::corner::CornerRule;
use planner_core::orientation::Orientation;
use planner_core::overlap::{Method, Move, Plan, Segment, SpeedCurve, ToolPose, plan};
use serde::{Deserialize, Serialize};

use crate::vector::{distance, norm};

/// Distance of the instants at which a motion is measured, in seconds.
const STEP_S: f64 = 1e-4;

/// Angular feedrate where the table gives none: it never leads.
const ANY_TURN_DEG_S: f64 = 1e6;

/// A row of the table: a point, how fast it is gone to, and how the corner there is passed.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Vertex {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    a_deg: f64,
    b_deg: f64,
    c_deg: f64,
    feed_mm_s: Option<f64>,
    turn_deg_s: Option<f64>,
    tolerance_mm: Option<f32>,
    overlap_percent: Option<f32>,
}

impl Vertex {
    fn pose(&self) -> ToolPose {
        ToolPose {
            position_mm: [self.x_mm, self.y_mm, self.z_mm],
            orientation: Orientation::new(self.a_deg, self.b_deg, self.c_deg),
        }
    }

    /// An exact stop where neither is given.
    fn corner(&self) -> Result<CornerRule> {
        let (tolerance_mm, percent) = (self.tolerance_mm, self.overlap_percent);
        match (tolerance_mm, percent) {
            (None, None) => Ok(CornerRule::EXACT_STOP),
            (Some(mm), None) if (0.0..=100.0).contains(&mm) => Ok(CornerRule::ToleranceMm(mm)),
            (None, Some(percent)) if (0.0..=100.0).contains(&percent) => {
                Ok(CornerRule::OverlapPercent(percent))
            }
            (Some(_), Some(_)) => bail!("tolerance and overlap are both given: leave one empty"),
            _ => bail!("the corner's value is outside 0 to 100: give mm or percent in that range"),
        }
    }
}

/// A path from point to point.
#[derive(Clone, Debug)]
pub struct ToolPath {
    moves: Vec<Move>,
}

impl ToolPath {
    /// Reads a table (CSV) with the columns `x_mm, y_mm, z_mm, a_deg, b_deg, c_deg, feed_mm_s` and,
    /// where wanted, `turn_deg_s, tolerance_mm, overlap_percent`.
    ///
    /// # Errors
    /// The row that cannot be used, and why.
    pub fn load(file: &Path) -> Result<Self> {
        let name = file.display().to_string();
        let mut reader =
            csv::Reader::from_path(file).with_context(|| format!("{name} cannot be read"))?;
        let rows: Result<Vec<Vertex>, _> = reader.deserialize().collect();
        let rows = rows.with_context(|| format!("{name} cannot be used"))?;
        Self::new(&rows).with_context(|| name)
    }

    fn new(vertices: &[Vertex]) -> Result<Self> {
        ensure!(vertices.len() > 1, "a path needs two points: add rows");
        let mut moves = Vec::new();
        for (row, pair) in vertices.windows(2).enumerate() {
            // the header is line 1, the first point line 2
            let line = || format!("line {}", row + 3);
            let feed_mm_s = pair[1].feed_mm_s;
            let feed_mm_s =
                feed_mm_s.with_context(|| format!("{}: feed_mm_s is missing", line()))?;
            let segment = Segment::new(
                &pair[0].pose(),
                &pair[1].pose(),
                feed_mm_s,
                pair[1].turn_deg_s.unwrap_or(ANY_TURN_DEG_S),
            );
            let corner = if row == 0 {
                Ok(CornerRule::EXACT_STOP)
            } else {
                pair[0].corner()
            };
            moves.push(Move::new(
                segment.with_context(line)?,
                corner.with_context(|| format!("line {}", row + 2))?,
            ));
        }
        Ok(Self { moves })
    }

    /// The same path with one rule for all corners.
    #[must_use]
    pub fn with_rule(&self, rule: CornerRule) -> Self {
        let moves = self.moves.iter().map(|one| Move::new(*one.segment(), rule));
        Self {
            moves: moves.collect(),
        }
    }

    /// The same path with a rule for each corner, in order.
    #[must_use]
    pub fn with_rules(&self, rules: &[CornerRule]) -> Self {
        let mut moves = self.moves.clone();
        for (one, rule) in moves.iter_mut().skip(1).zip(rules) {
            *one = Move::new(*one.segment(), *rule);
        }
        Self { moves }
    }

    /// Its segments.
    pub fn segments(&self) -> impl Iterator<Item = &Segment> {
        self.moves.iter().map(Move::segment)
    }

    /// Times its moves.
    pub fn plan(&mut self, curve: SpeedCurve, method: Method) -> Plan<'_> {
        plan(curve, method, &mut self.moves)
    }

    /// Runs it and measures what it does.
    #[must_use]
    pub fn measure(&mut self, curve: SpeedCurve, method: Method) -> Measured {
        let corners: Vec<_> = self
            .moves
            .windows(2)
            .map(|pair| pair[0].segment().end_mm())
            .collect();
        let plan = self.plan(curve, method);
        let mut measured = Measured {
            cycle_s: plan.cycle_s(),
            tangential_mm_s2: [0.0; 2],
            axial_mm_s2: [0.0; 2],
            acceleration_mm_s2: 0.0,
            euler_rates_deg_s: [0.0; 3],
            overlaps_s: plan.moves().iter().skip(1).map(Move::overlap_s).collect(),
            corner_errors_mm: vec![f64::INFINITY; corners.len()],
        };
        let steps = (plan.cycle_s() / STEP_S).ceil() as u32;
        for step in 0..=steps {
            let state = plan.at(f64::from(step) * STEP_S);
            let (velocity, acceleration) = (state.velocity_mm_s, state.acceleration_mm_s2);
            let speed = norm(velocity);
            let along: f64 = (0..3).map(|axis| velocity[axis] * acceleration[axis]).sum();
            if speed > 1e-6 {
                widen(&mut measured.tangential_mm_s2, along / speed);
            }
            for part in acceleration {
                widen(&mut measured.axial_mm_s2, part);
            }
            let total = norm(acceleration);
            measured.acceleration_mm_s2 = measured.acceleration_mm_s2.max(total);
            let rates = state.euler_rates;
            let rates = [rates.a_deg_s, rates.b_deg_s, rates.c_deg_s];
            for (peak, rate) in measured.euler_rates_deg_s.iter_mut().zip(rates) {
                *peak = peak.max(rate.abs());
            }
            for (error_mm, corner) in measured.corner_errors_mm.iter_mut().zip(&corners) {
                *error_mm = error_mm.min(distance(state.pose.position_mm, *corner));
            }
        }
        measured
    }
}

fn widen(range: &mut [f64; 2], value: f64) {
    range[0] = range[0].min(value);
    range[1] = range[1].max(value);
}

/// What a motion does.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// From start to rest.
    pub cycle_s: f64,
    /// Least and largest change of the speed, mm/s².
    pub tangential_mm_s2: [f64; 2],
    /// Least and largest acceleration of X, Y and Z, mm/s².
    pub axial_mm_s2: [f64; 2],
    /// Largest acceleration, mm/s².
    pub acceleration_mm_s2: f64,
    /// Largest A′, B′ and C′, °/s.
    pub euler_rates_deg_s: [f64; 3],
    /// Overlap at each corner.
    pub overlaps_s: Vec<f64>,
    /// Miss of each corner.
    pub corner_errors_mm: Vec<f64>,
}

impl Measured {
    /// The largest miss of a corner.
    #[must_use]
    pub fn corner_error_mm(&self) -> f64 {
        self.corner_errors_mm.iter().copied().fold(0.0, f64::max)
    }
}
