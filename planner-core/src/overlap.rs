//! Velocity profile overlap: a tool that moves and turns, its corners rounded by letting the
//! speed of one segment fall while that of the next one rises.
//!
//! config ([`ToolPose`]s, feedrates, a [`CornerRule`] for each corner) → active ([`Segment`],
//! [`SpeedCurve`], [`plan`]) → [`Plan::at`], which keeps no state. It is the same construction as that of the
//! tick, for any orientation and in `f64`.
//!
//! \[Li23\]: Li, Tsai, Zhang, Cheng: smooth interpolation design with corner tolerance
//! constraints for robotics. Appl. Sci. 2023, 13, 8789.

use core::fmt;

use crate::corner::{self, CornerRule, Side};
use crate::orientation::{EulerRates, Orientation, Quaternion, Rotation};
use crate::prefilter::Prefilter;

/// Where a tool is and how it is turned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolPose {
    /// X, Y and Z in mm.
    pub position_mm: [f64; 3],
    /// Its orientation.
    pub orientation: Orientation,
}

/// Why there is no motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OverlapError {
    /// A time to accelerate in is not between 1 ms and 10 s.
    Time {
        /// What was given, or what the limits ask for.
        time_s: f64,
    },
    /// A limit or a speed is not above zero, or a length or an angle is no finite number.
    NotPositive {
        /// What it is.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A segment neither moves nor turns.
    Empty,
}

impl fmt::Display for OverlapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time { time_s } => write!(
                f,
                "the box of {time_s} s is outside 0.001 to 10 s: give another time, or other limits"
            ),
            Self::NotPositive { what, value } => {
                write!(
                    f,
                    "the {what} of {value} is no number above zero: give another one"
                )
            }
            Self::Empty => f.write_str(
                "a segment neither moves nor turns: leave out points that are given twice",
            ),
        }
    }
}

impl core::error::Error for OverlapError {}

/// A speed with the limits that it is reached within, in mm or in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Per second.
    pub speed: f64,
    /// Largest acceleration, per s².
    pub acceleration: f64,
    /// Largest jerk, per s³.
    pub jerk: f64,
}

/// How the speed of a segment rises and falls: a prefilter of one or two equal boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCurve {
    box_s: f64,
    is_s_curve: bool,
}

impl SpeedCurve {
    /// The S-curve, `box(T_rr) ∗ box(T_rr)`: the acceleration rises for `T_rr` and falls for
    /// `T_rr`. At speed `V` it takes the acceleration `V/T_rr` and the jerk `V/T_rr²`.
    ///
    /// # Errors
    /// [`OverlapError::Time`] outside 1 ms to 10 s.
    pub fn s_curve(box_s: f64) -> Result<Self, OverlapError> {
        Self::new(box_s, true)
    }

    /// ADAI, acceleration and deceleration after interpolation: one box of `τ`. At speed `V`
    /// it takes the acceleration `V/τ`, and the jerk is not limited.
    ///
    /// # Errors
    /// [`OverlapError::Time`] outside 1 ms to 10 s.
    pub fn adai(box_s: f64) -> Result<Self, OverlapError> {
        Self::new(box_s, false)
    }

    /// The shortest S-curve that keeps every demand.
    ///
    /// ```text
    /// T_rr = max(V/A, √(V/J))
    /// ```
    ///
    /// # Errors
    /// A speed or a limit that is not above zero; [`OverlapError::Time`].
    pub fn within(demands: &[Demand]) -> Result<Self, OverlapError> {
        let mut box_s = 0.0_f64;
        for demand in demands {
            let speed = positive("speed", demand.speed)?;
            let acceleration = positive("acceleration limit", demand.acceleration)?;
            let jerk = positive("jerk limit", demand.jerk)?;
            box_s = box_s
                .max(speed / acceleration)
                .max(libm::sqrt(speed / jerk));
        }
        Self::s_curve(box_s)
    }

    fn new(box_s: f64, is_s_curve: bool) -> Result<Self, OverlapError> {
        if !(1e-3..=10.0).contains(&box_s) {
            return Err(OverlapError::Time { time_s: box_s });
        }
        Ok(Self { box_s, is_s_curve })
    }

    /// Length of a box in seconds: `T_rr` or `τ`.
    #[must_use]
    pub const fn box_s(&self) -> f64 {
        self.box_s
    }

    /// How long the speed rises, `2 T_rr` or `τ`, in seconds.
    #[must_use]
    pub fn length_s(&self) -> f64 {
        if self.is_s_curve {
            2.0 * self.box_s
        } else {
            self.box_s
        }
    }

    /// The rise to speed 1, a time after its begin. Each piece is a polynomial of its own: exact
    /// to 1e-15 of its value at any time.
    #[must_use]
    fn at(&self, t: f64) -> Rise {
        let (length_s, box_s) = (self.length_s(), self.box_s);
        if t <= 0.0 {
            return Rise::default();
        }
        if t >= length_s {
            return Rise {
                way: t - length_s / 2.0,
                speed: 1.0,
                acceleration: 0.0,
            };
        }
        if !self.is_s_curve {
            return Rise {
                way: t * t / (2.0 * box_s),
                speed: t / box_s,
                acceleration: 1.0 / box_s,
            };
        }
        let jerk = 1.0 / (box_s * box_s);
        let left = length_s - t;
        if t < box_s {
            Rise {
                way: jerk * t * t * t / 6.0,
                speed: jerk * t * t / 2.0,
                acceleration: jerk * t,
            }
        } else {
            Rise {
                way: t - box_s + jerk * left * left * left / 6.0,
                speed: 1.0 - jerk * left * left / 2.0,
                acceleration: jerk * left,
            }
        }
    }

    fn prefilter(&self) -> Prefilter {
        if self.is_s_curve {
            Prefilter::of_boxes([self.box_s; 2])
        } else {
            Prefilter::of_box(self.box_s)
        }
    }
}

/// A rise of the speed from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Rise {
    way: f64,
    speed: f64,
    acceleration: f64,
}

/// A straight move with a rotation about one axis, both in the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    start: ToolPose,
    direction: [f64; 3],
    length_mm: f64,
    rotation: Rotation,
    duration_s: f64,
    is_led_by_rotation: bool,
}

impl Segment {
    /// From pose to pose. The slower of translation and rotation sets the time, the other one
    /// follows it with the fraction `s/L`:
    ///
    /// ```text
    /// T = max(L / F, φ / Ω)                                                       [Li23]
    /// ```
    ///
    /// Cost on a Cortex-M4F 42 000 instructions.
    ///
    /// # Errors
    /// A speed that is not above zero; [`OverlapError::Empty`] between equal poses.
    pub fn new(
        from: &ToolPose,
        to: &ToolPose,
        feed_mm_s: f64,
        turn_deg_s: f64,
    ) -> Result<Self, OverlapError> {
        let feed_mm_s = positive("feedrate", feed_mm_s)?;
        let turn_deg_s = positive("angular feedrate", turn_deg_s)?;
        let way = difference(to.position_mm, from.position_mm);
        let length_mm = norm(way);
        let rotation = from.orientation.rotation_to(&to.orientation);
        let (moving_s, turning_s) = (length_mm / feed_mm_s, rotation.angle_deg() / turn_deg_s);
        let duration_s = moving_s.max(turning_s);
        for (what, value) in [("length", length_mm), ("rotation", rotation.angle_deg())] {
            if !value.is_finite() {
                return Err(OverlapError::NotPositive { what, value });
            }
        }
        if duration_s <= 0.0 {
            return Err(OverlapError::Empty);
        }
        Ok(Self {
            start: *from,
            direction: if length_mm > 0.0 {
                way.map(|part| part / length_mm)
            } else {
                [0.0; 3]
            },
            length_mm,
            rotation,
            duration_s,
            is_led_by_rotation: turning_s > moving_s,
        })
    }

    /// Length of the translation in mm.
    #[must_use]
    pub const fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// Where it ends: X, Y and Z in mm.
    #[must_use]
    pub fn end_mm(&self) -> [f64; 3] {
        let mut end_mm = self.start.position_mm;
        for (axis, part) in self.direction.iter().enumerate() {
            add(&mut end_mm, axis, part * self.length_mm);
        }
        end_mm
    }

    /// The rotation.
    #[must_use]
    pub const fn rotation(&self) -> &Rotation {
        &self.rotation
    }

    /// How long the raw segment takes, in seconds.
    #[must_use]
    pub const fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Whether the rotation is the slower one, which sets the time.
    #[must_use]
    pub const fn is_led_by_rotation(&self) -> bool {
        self.is_led_by_rotation
    }

    /// The feedrate that it reaches in mm/s, zero for a segment that only turns.
    #[must_use]
    pub fn feed_mm_s(&self) -> f64 {
        self.length_mm / self.duration_s
    }

    /// The angular feedrate that it reaches in °/s.
    #[must_use]
    pub fn turn_deg_s(&self) -> f64 {
        self.rotation.angle_deg() / self.duration_s
    }

    fn side(&self) -> Side {
        Side {
            feed_mm_s: self.feed_mm_s() as f32,
            tangent: self.direction.map(|part| part as f32),
            heading_rate_per_mm: 0.0,
            length_mm: self.length_mm as f32,
        }
    }
}

/// How the overlap follows from a tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Eq. 35 of \[Li23\]: at unequal feedrates it overlaps less than it could.
    #[default]
    ClosedForm,
    /// The closest approach to the corner, by [`corner::solve`]. It never overlaps more than the
    /// tolerance allows, and 20 µs less at the most.
    Exact,
}

/// How long before the end of one segment the next one begins, in seconds, up to the length of
/// the curve.
///
/// ```text
/// ε = |J₁u₁ − J₂u₂| T_ol³ / 48,  J = F / T_rr²                        [Li23 Eq. 35]
/// T_ol = (48 ε / |J₁u₁ − J₂u₂|)^⅓ ≤ 2 T_rr,   OVLP = 100 (T_ol / 2T_rr)² %
/// one box:  ε = |A₁u₁ − A₂u₂| T_ol² / 8,  A = F / τ
/// ```
///
/// A tolerance says nothing about a tool that only turns: beside such a segment it stops. Cost on a
/// Cortex-M4F 8 000 instructions in closed form, 26 000 exactly.
#[must_use]
pub fn overlap_s(
    curve: &SpeedCurve,
    arriving: &Segment,
    leaving: &Segment,
    rule: CornerRule,
    method: Method,
) -> f64 {
    let tolerance_mm = match rule {
        CornerRule::OverlapPercent(percent) => {
            let share = (f64::from(percent) / 100.0).clamp(0.0, 1.0);
            return curve.length_s() * libm::sqrt(share);
        }
        CornerRule::ToleranceMm(mm) => f64::from(mm),
    };
    if arriving.length_mm <= 0.0 || leaving.length_mm <= 0.0 || tolerance_mm <= 0.0 {
        return 0.0;
    }
    if method == Method::Exact {
        let prefilter = curve.prefilter();
        let found = corner::solve(
            &arriving.side(),
            &leaving.side(),
            &prefilter.reversed_response(),
            &prefilter.response(),
            tolerance_mm as f32,
        );
        return f64::from(found.cornering_s);
    }
    let velocity = |segment: &Segment| segment.direction.map(|part| part * segment.feed_mm_s());
    let turn_mm_s = norm(difference(velocity(arriving), velocity(leaving)));
    let box_s = curve.box_s;
    let longest_s = if curve.is_s_curve {
        libm::cbrt(48.0 * tolerance_mm * box_s * box_s / turn_mm_s)
    } else {
        libm::sqrt(8.0 * tolerance_mm * box_s / turn_mm_s)
    };
    // straight on there is nothing to miss: the quotient is infinite
    longest_s.min(curve.length_s())
}

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
            let room_s = before.segment.duration_s + length_s - before.overlap_s;
            let overlap_s = overlap_s(&curve, &before.segment, &next.segment, next.corner, method);
            next.overlap_s = match next.corner {
                CornerRule::ToleranceMm(_) => overlap_s.min(room_s),
                CornerRule::OverlapPercent(_) => overlap_s,
            };
            let end_s = before.start_s + before.segment.duration_s + length_s;
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
            last.start_s + last.segment.duration_s + self.curve.length_s()
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
            let fall = self.curve.at(since_s - segment.duration_s);
            let done_s = if since_s >= segment.duration_s + self.curve.length_s() {
                segment.duration_s
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
            let turn = segment.rotation.turned(done_s / segment.duration_s);
            turned = turn.after(&turned);
            state.turn_deg_s = turn.turn(state.turn_deg_s);
            for (axis, part) in segment.rotation.axis().iter().enumerate() {
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

fn add(vector: &mut [f64; 3], axis: usize, value: f64) {
    if let Some(part) = vector.get_mut(axis) {
        *part += value;
    }
}

fn positive(what: &'static str, value: f64) -> Result<f64, OverlapError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(OverlapError::NotPositive { what, value })
    }
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    libm::sqrt(x * x + y * y + z * z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose(x: f64, y: f64, c_deg: f64) -> ToolPose {
        ToolPose {
            position_mm: [x, y, 0.0],
            orientation: Orientation::new(0.0, 0.0, c_deg),
        }
    }

    fn segment(from: &ToolPose, to: &ToolPose, feed_mm_s: f64) -> Segment {
        Segment::new(from, to, feed_mm_s, 100.0).unwrap()
    }

    #[test]
    fn the_slower_of_translation_and_rotation_sets_the_time() {
        let moved = segment(&pose(0.0, 0.0, 0.0), &pose(100.0, 0.0, 50.0), 100.0);
        assert!(!moved.is_led_by_rotation());
        assert_eq!((moved.duration_s(), moved.feed_mm_s()), (1.0, 100.0));
        assert!((moved.turn_deg_s() - 50.0).abs() < 1e-12);
        let turned = segment(&pose(0.0, 0.0, 0.0), &pose(10.0, 0.0, 150.0), 100.0);
        assert!(turned.is_led_by_rotation());
        assert!((turned.duration_s() - 1.5).abs() < 1e-14);
        assert!((turned.feed_mm_s() - 10.0 / 1.5).abs() < 1e-12);
        assert_eq!(
            Segment::new(&pose(1.0, 2.0, 3.0), &pose(1.0, 2.0, 3.0), 1.0, 1.0),
            Err(OverlapError::Empty)
        );
    }

    #[test]
    fn limits_set_the_time_of_the_s_curve() {
        let demand = |acceleration, jerk| Demand {
            speed: 150.0,
            acceleration,
            jerk,
        };
        let by_acceleration = SpeedCurve::within(&[demand(1000.0, 1e6)]).unwrap();
        assert_eq!(by_acceleration.box_s(), 0.15);
        let by_jerk = SpeedCurve::within(&[demand(1000.0, 1e6), demand(1e6, 9600.0)]).unwrap();
        assert_eq!(by_jerk.box_s(), 0.15_f64.max((150.0_f64 / 9600.0).sqrt()));
        assert!(matches!(
            SpeedCurve::within(&[demand(0.0, 1.0)]),
            Err(OverlapError::NotPositive { .. })
        ));
    }

    #[test]
    fn a_tool_that_only_turns_stops_where_a_tolerance_is_asked_for() {
        let curve = SpeedCurve::s_curve(0.1).unwrap();
        let moves = segment(&pose(0.0, 0.0, 0.0), &pose(10.0, 0.0, 0.0), 100.0);
        let turns = segment(&pose(10.0, 0.0, 0.0), &pose(10.0, 0.0, 90.0), 100.0);
        for method in [Method::ClosedForm, Method::Exact] {
            let tolerance = CornerRule::ToleranceMm(1.0);
            assert_eq!(overlap_s(&curve, &moves, &turns, tolerance, method), 0.0);
            let percent = CornerRule::OverlapPercent(25.0);
            assert_eq!(overlap_s(&curve, &moves, &turns, percent, method), 0.1);
        }
    }

    proptest! {
        #[test]
        fn both_methods_keep_the_tolerance_and_agree_at_equal_feedrates(
            (dx, dy) in (-80.0..80.0_f64, 10.0..80.0_f64),
            ratio in prop_oneof![Just(1.0), 0.3..3.0_f64],
            tolerance_mm in 0.05..3.0_f64,
            is_s_curve: bool,
        ) {
            let curve = SpeedCurve::new(0.05, is_s_curve).unwrap();
            let (a, b) = (pose(-80.0, 0.0, 0.0), pose(0.0, 0.0, 0.0));
            let c = pose(dx, dy, 0.0);
            let (first, second) = (segment(&a, &b, 200.0), segment(&b, &c, 200.0 * ratio));
            let tolerance = CornerRule::ToleranceMm(tolerance_mm as f32);
            let [closed, exact] = [Method::ClosedForm, Method::Exact]
                .map(|method| overlap_s(&curve, &first, &second, tolerance, method));
            // Eq. 35 is conservative; the solver is exact to 20 µs
            prop_assert!(closed <= exact + 2e-5, "{closed} {exact}");
            if ratio == 1.0 {
                prop_assert!((closed - exact).abs() < 2e-5, "{closed} {exact}");
            }
            for method in [Method::ClosedForm, Method::Exact] {
                let mut moves = [Move::new(first, tolerance), Move::new(second, tolerance)];
                let plan = plan(curve, method, &mut moves);
                let miss = |t: f64| norm(plan.at(t).pose.position_mm);
                let ticks = (plan.cycle_s() / 1e-4) as u32;
                let least = (0..=ticks).map(|k| miss(f64::from(k) * 1e-4));
                let least = least.fold(f64::INFINITY, f64::min);
                prop_assert!(least <= tolerance_mm + 1e-3, "{least} {tolerance_mm}");
            }
        }

        #[test]
        fn velocity_and_turn_are_the_derivatives_of_the_pose(
            t in 0.0..2.0_f64, turn in -170.0..170.0_f64, is_s_curve: bool
        ) {
            const STEP: f64 = 1e-6;
            let curve = SpeedCurve::new(0.2, is_s_curve).unwrap();
            let tilted = |x: f64, y: f64, a_deg: f64, c_deg: f64| ToolPose {
                position_mm: [x, y, 0.0],
                orientation: Orientation::new(a_deg, 20.0, c_deg),
            };
            let points = [
                tilted(0.0, 0.0, 10.0, 0.0),
                tilted(60.0, 0.0, -20.0, turn),
                tilted(60.0, 50.0, 5.0, 0.0),
                tilted(0.0, 50.0, 30.0, 40.0),
            ];
            let rule = CornerRule::OverlapPercent(60.0);
            let mut moves: [Move; 3] = core::array::from_fn(|i| {
                Move::new(segment(&points[i], &points[i + 1], 100.0), rule)
            });
            let plan = plan(curve, Method::ClosedForm, &mut moves);
            let (before, here, after) = (plan.at(t - STEP), plan.at(t), plan.at(t + STEP));
            for axis in 0..3 {
                let moved = after.pose.position_mm[axis] - before.pose.position_mm[axis];
                let seen = moved / (2.0 * STEP);
                prop_assert!((seen - here.velocity_mm_s[axis]).abs() < 2e-3);
                if is_s_curve {
                    let changed = after.velocity_mm_s[axis] - before.velocity_mm_s[axis];
                    let seen = changed / (2.0 * STEP);
                    prop_assert!((seen - here.acceleration_mm_s2[axis]).abs() < 1e-2);
                }
            }
            // the rotation between two instants, about its axis
            let turned = before.pose.orientation.rotation_to(&after.pose.orientation);
            for (part, rate) in turned.axis().iter().zip(here.turn_deg_s) {
                let seen = part * turned.angle_deg() / (2.0 * STEP);
                prop_assert!((seen - rate).abs() < 5e-2, "{seen} {rate}");
            }
        }

        #[test]
        fn every_path_ends_exactly_where_it_should(
            points in prop::collection::vec((-50.0..50.0_f64, -50.0..50.0_f64, -90.0..90.0_f64), 2..6),
            percent in 0.0..100.0_f32,
        ) {
            let poses: std::vec::Vec<_> = points.iter().map(|(x, y, c)| pose(*x, *y, *c)).collect();
            let mut moves: std::vec::Vec<_> = poses
                .windows(2)
                .map(|pair| segment(&pair[0], &pair[1], 80.0))
                .map(|segment| Move::new(segment, CornerRule::OverlapPercent(percent)))
                .collect();
            let plan = plan(SpeedCurve::s_curve(0.1).unwrap(), Method::ClosedForm, &mut moves);
            let end = plan.at(plan.cycle_s() + 1.0);
            let target = poses[poses.len() - 1];
            prop_assert!(norm(difference(end.pose.position_mm, target.position_mm)) < 1e-11);
            let off = end.pose.orientation.rotation_to(&target.orientation);
            prop_assert!(off.angle_deg() < 1e-11);
            prop_assert_eq!(end.velocity_mm_s, [0.0; 3]);
        }
    }
}
