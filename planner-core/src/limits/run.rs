//! What of the past a corner must heed, and whether to stop at it.

use super::course::{Course, Region};
use super::feed::Limits;
use crate::kinematics::ArmKind;
use crate::math::sqrt_f32;

/// How a segment is walked, chosen by [`Run::choose`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// It takes no less, at any override, in s; 0 where nothing limits it.
    pub least_s: f32,
    /// The raw path stands for so long before it, in s.
    pub dwell_s: f32,
    /// It keeps the limits at twice its load.
    pub carefree: bool,
}

/// Corners and segments that a pair of instants can span, summed up.
#[derive(Clone, Copy, Debug, Default)]
struct Stretch {
    /// Sum of the changes of the tangent `|u₂ − u₁|`: at least that between any two.
    turn: f32,
    /// A segment does not keep the limits at twice its load.
    full: bool,
    /// An arc or a turn of the yaw is among them.
    bent: bool,
    /// Directions of X, Y and Z: bits 0 to 2 up, 3 to 5 down.
    directions: u8,
}

/// The raw path behind the next corner, as far back as the boxes reach.
///
/// Two stretches of time, so that what is old goes: the newer one is at most as long as the
/// boxes, the older one reaches back at least as far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    older: Stretch,
    newer: Stretch,
    newer_s: f32,
    /// Tangent at the end of the last segment; none from rest.
    last_tangent: Option<[f32; 3]>,
    /// How far from the last segment a command may stray, in mm.
    spare_mm: f32,
}

/// Change of the tangent up to which velocities of any two speeds differ by no more than the
/// larger: 60°.
const GENTLE: f32 = 1.0;

impl Run {
    /// How to walk the next segment, which may take `asked_s` and keeps the limits alone if it
    /// takes `least_s`: at full feed with a stop where one must be, or at half of it and none.
    #[must_use]
    pub fn choose(&self, limits: &Limits, course: &Course, asked_s: f32, least_s: f32) -> Choice {
        let stop_s = limits.stop_s();
        let carefree_s = 2.0 * least_s;
        let dwell = |free: bool| if free { 0.0 } else { stop_s };
        let turn = self.turn(course);
        let gentle = self.is_gentle(limits, course, turn);
        let carefree = Choice {
            least_s: carefree_s,
            dwell_s: dwell(gentle || !(self.older.full || self.newer.full)),
            carefree: true,
        };
        if stop_s == 0.0 || asked_s >= carefree_s {
            let least_s = if stop_s == 0.0 { least_s } else { carefree_s };
            return Choice {
                least_s,
                ..carefree
            };
        }
        let full = Choice {
            least_s,
            dwell_s: dwell(gentle),
            carefree: false,
        };
        // If the path goes on as it turns here, it comes to a stop every so often.
        let takes_s = asked_s.max(least_s);
        let keeps_on = gentle && self.last_tangent.is_some() && turn * stop_s <= GENTLE * takes_s;
        let stop_ahead_s = if keeps_on { 0.0 } else { stop_s };
        let full_s = takes_s + full.dwell_s.max(stop_ahead_s);
        if full_s < carefree_s + carefree.dwell_s {
            full
        } else {
            carefree
        }
    }

    /// How far from the segments beside the next corner a command may stray, in mm, when the one
    /// behind it leaves `own_mm`. To be asked once for each segment.
    pub fn spare_mm(&mut self, own_mm: f32) -> f32 {
        let before_mm = core::mem::replace(&mut self.spare_mm, own_mm);
        match self.last_tangent {
            Some(_) => own_mm.min(before_mm),
            None => own_mm,
        }
    }

    /// Goes on behind a segment that was walked as chosen, after a stand of `dwell_s`, in at
    /// least `shortest_s`.
    pub fn take(
        &mut self,
        limits: &Limits,
        course: &Course,
        choice: &Choice,
        dwell_s: f32,
        shortest_s: f32,
    ) {
        let stop_s = limits.stop_s();
        let own = Stretch {
            turn: 0.0,
            full: !choice.carefree,
            bent: is_bent(limits, course),
            directions: directions(course),
        };
        let turn = self.turn(course);
        if self.last_tangent.is_none() || dwell_s >= stop_s || shortest_s >= stop_s {
            self.older = Stretch::default();
            self.newer = own;
            self.newer_s = 0.0;
        } else {
            self.newer.turn += turn;
            self.newer.full |= own.full;
            self.newer.bent |= own.bent;
            self.newer.directions |= own.directions;
            self.newer_s += dwell_s + shortest_s;
            if self.newer_s >= stop_s {
                self.older = self.newer;
                self.newer = own;
                self.newer_s = 0.0;
            }
        }
        self.last_tangent = Some(course.last_tangent);
    }

    /// `|u₂ − u₁|` at the corner before a segment, in space or, where joints move as the tool does
    /// in the plane, there if that is more.
    fn turn(&self, course: &Course) -> f32 {
        let Some([x1, y1, z1]) = self.last_tangent else {
            return 0.0;
        };
        let [x2, y2, z2] = course.first_tangent;
        let square = |x: f32, y: f32| x * x + y * y;
        let (dx, dy, dz) = (x2 - x1, y2 - y1, z2 - z1);
        let space = square(dx, dy) + dz * dz;
        let (flat1, flat2) = (square(x1, y1), square(x2, y2));
        let counts = matches!(course.region, Region::Ring(_));
        let plane = if counts && flat1 > 0.0 && flat2 > 0.0 {
            // |a/|a| − b/|b||² = 2 − 2 a·b/(|a||b|)
            let cosine = (x1 * x2 + y1 * y2) / sqrt_f32(flat1 * flat2);
            (2.0 - 2.0 * cosine).max(0.0)
        } else {
            0.0
        };
        sqrt_f32(space.max(plane))
    }

    /// Whether all velocities that a pair of instants can span differ by no more than the larger.
    fn is_gentle(&self, limits: &Limits, course: &Course, turn: f32) -> bool {
        if self.last_tangent.is_none() {
            return true;
        }
        let directions = self.older.directions | self.newer.directions | directions(course);
        let mut reversed = directions & (directions >> 3) & 0b111;
        if !limits.limits_axes() {
            // joint 3 of a SCARA is an axis
            reversed &= match limits.kind() {
                ArmKind::Scara => 0b100,
                ArmKind::Delta => 0,
            };
        }
        let bent = self.older.bent || self.newer.bent || is_bent(limits, course);
        reversed == 0 && !bent && self.older.turn + self.newer.turn + turn <= GENTLE
    }
}

fn is_bent(limits: &Limits, course: &Course) -> bool {
    course.curvature_per_mm > 0.0 || course.yaw_rad > 0.0 && limits.limits_yaw()
}

/// Bits 0 to 2 where X, Y and Z grow, 3 to 5 where they fall.
fn directions(course: &Course) -> u8 {
    let mut bits = 0;
    for (axis, way) in course.first_tangent.into_iter().enumerate() {
        bits |= u8::from(way > 0.0) << axis;
        bits |= u8::from(way < 0.0) << (axis + 3);
    }
    bits
}
