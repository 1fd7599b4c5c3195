//! Moves with their times, and what the tool does at any of them.

use super::add;
use super::corner_overlap::{Method, overlap_s};
use super::segment::{Segment, ToolPose};
use super::speed_curve::SpeedCurve;
use crate::corner::CornerRule;
use crate::orientation::{EulerRates, Quaternion};

/// A segment with the corner before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    segment: Segment,
    corner: CornerRule,
    overlap_s: f64,
    start_s: f64,
}

impl Move {
    /// A segment, and how the corner at its begin is to be passed; that of a path's first
    /// segment does not matter.
    #[must_use]
    pub const fn new(segment: Segment, corner: CornerRule) -> Self {
        Self {
            segment,
            corner,
            overlap_s: 0.0,
            start_s: 0.0,
        }
    }

    /// The segment.
    #[must_use]
    pub const fn segment(&self) -> &Segment {
        &self.segment
    }

    /// How long before the end of the move before it begins, in seconds.
    #[must_use]
    pub const fn overlap_s(&self) -> f64 {
        self.overlap_s
    }
}

/// Moves with their times.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'m> {
    curve: SpeedCurve,
    moves: &'m [Move],
}

/// What the tool does at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolState {
    /// Where it is.
    pub pose: ToolPose,
    /// Velocity of X, Y and Z in mm/s.
    pub velocity_mm_s: [f64; 3],
    /// Acceleration of X, Y and Z in mm/s².
    pub acceleration_mm_s2: [f64; 3],
    /// Turn about X, Y and Z of the fixed frame in °/s.
    pub turn_deg_s: [f64; 3],
    /// The same as rates of the Euler angles.
    pub euler_rates: EulerRates,
}

/// Times the moves of a path, each of which begins where the one before ends.
///
/// A move lasts its duration and the length of the curve, and begins `overlap` before the one
/// before has ended. So that a tolerance holds on short segments too, a corner with a tolerance
/// is rounded only once the corner before it is done; an overlap that is given as such is done
/// as given.
#[must_use]
pub fn plan(curve: SpeedCurve, method: Method, moves: &mut [Move]) -> Plan<'_> {
    let length_s = curve.length_s();
    let mut before: Option<Move> = None;
    for next in &mut *moves {
        if let Some(before) = before {
            let room_s = before.segment.duration_s() + length_s - before.overlap_s;
            let overlap_s = overlap_s(&curve, &before.segment, &next.segment, next.corner, method);
            next.overlap_s = match next.corner {
                CornerRule::ToleranceMm(_) => overlap_s.min(room_s),
                CornerRule::OverlapPercent(_) => overlap_s,
            };
            let end_s = before.start_s + before.segment.duration_s() + length_s;
            next.start_s = end_s - next.overlap_s;
        } else {
            next.overlap_s = 0.0;
            next.start_s = 0.0;
        }
        before = Some(*next);
    }
    Plan { curve, moves }
}

impl Plan<'_> {
    /// The moves with their overlaps.
    #[must_use]
    pub const fn moves(&self) -> &[Move] {
        self.moves
    }

    /// When the tool has come to rest, in seconds.
    #[must_use]
    pub fn cycle_s(&self) -> f64 {
        self.moves.last().map_or(0.0, |last| {
            last.start_s + last.segment.duration_s() + self.curve.length_s()
        })
    }

    /// What the tool does `t` seconds after its start. On a Cortex-M4F it costs up to 36 000
    /// instructions for each move that has begun: it is for planning and for tests, not for the tick.
    ///
    /// ```text
    /// P = P₀ + Σ u_i s_i,   s_i = F_i [I(t − t_i) − I(t − t_i − T_i)]
    /// R = … Rot(axis₂, φ₂ s₂/L₂) Rot(axis₁, φ₁ s₁/L₁) R₀,   ω = ω₂ + Rot₂ ω₁
    /// ```
    #[must_use]
    pub fn at(&self, t: f64) -> ToolState {
        let Some(first) = self.moves.first() else {
            return ToolState::default();
        };
        let mut state = ToolState {
            pose: first.segment.start,
            ..ToolState::default()
        };
        let mut turned: Quaternion = state.pose.orientation.quaternion();
        for Move {
            segment, start_s, ..
        } in self.moves
        {
            let since_s = t - start_s;
            if since_s <= 0.0 {
                break;
            }
            let rise = self.curve.at(since_s);
            let fall = self.curve.at(since_s - segment.duration_s());
            let done_s = if since_s >= segment.duration_s() + self.curve.length_s() {
                segment.duration_s()
            } else {
                rise.way - fall.way
            };
            let speed = rise.speed - fall.speed;
            let acceleration = rise.acceleration - fall.acceleration;
            let feed_mm_s = segment.feed_mm_s();
            for (axis, part) in segment.direction.iter().enumerate() {
                add(&mut state.pose.position_mm, axis, part * feed_mm_s * done_s);
                add(&mut state.velocity_mm_s, axis, part * feed_mm_s * speed);
                let acceleration = part * feed_mm_s * acceleration;
                add(&mut state.acceleration_mm_s2, axis, acceleration);
            }
            let turn = segment.rotation().turned(done_s / segment.duration_s());
            turned = turn.after(&turned);
            state.turn_deg_s = turn.turn(state.turn_deg_s);
            for (axis, part) in segment.rotation().axis().iter().enumerate() {
                add(
                    &mut state.turn_deg_s,
                    axis,
                    part * segment.turn_deg_s() * speed,
                );
            }
        }
        state.pose.orientation = turned.orientation();
        state.euler_rates = state.pose.orientation.rates(state.turn_deg_s);
        state
    }
}
