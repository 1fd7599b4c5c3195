//! The outline of a run of lines: the same path with fewer corners.
//!
//! Lines of a tenth of a millimetre make more corners than planning can look at. The corners
//! that lie within `δ` of a chord are left out: with `Γ` the path over its length `s`, and `Γ̃`
//! what goes straight from knot to knot while `s` does,
//!
//! ```text
//! |Γ(s) − Γ̃(s)| ≤ δ   for all s   ⇒   |E Γ(s) − Γ(E s)| ≤ |E Γ̃(s) − Γ̃(E s)| + 2δ
//! ```

use heapless::Vec;

use crate::math::sqrt_f32;

/// Corners that can be left out between two knots; with more, a knot is made.
const LEFT_OUT: usize = 16;

/// Over how much of the length that the prefilter spreads the slow mean of the curvature goes, and
/// the fast one.
const SLOW: f32 = 1.4;
const FAST: f32 = 0.12;

/// How far a rising curvature is followed ahead, in differences between the two means.
const AHEAD: f32 = 1.4;

/// By how much more the next corner may turn than the latest ones.
const SHARPER: f32 = 1.2;

/// A corner left out, seen from the knot before it.
#[derive(Clone, Copy, Debug)]
struct Point {
    offset_mm: [f32; 3],
    /// Length of the path from the knot.
    along_mm: f32,
}

/// How the path goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Change of direction at the last knot.
    pub last_turn: f32,
    /// Change of direction at the corner if it becomes a knot, otherwise none.
    pub turn: Option<f32>,
    /// `δ` behind the last knot.
    pub loose_mm: f32,
}

/// How much a path turns per mm: two means over its latest part.
#[derive(Clone, Copy, Debug)]
struct Turning {
    slow_per_mm: f32,
    fast_per_mm: f32,
    /// The turn at the latest knot.
    latest: f32,
}

impl Turning {
    /// The slow mean lags behind the fast one, by as much as the curvature has risen in between.
    fn ahead_per_mm(&self) -> f32 {
        let rise = (self.fast_per_mm - self.slow_per_mm).max(0.0);
        self.fast_per_mm.max(self.slow_per_mm) + AHEAD * rise
    }
}

/// The last piece of an outline.
#[derive(Clone, Debug, Default)]
pub struct Outline {
    /// From the last knot to the end of the path.
    chord_mm: [f32; 3],
    /// Length of the path from the last knot.
    length_mm: f32,
    /// How long the path takes from there, in seconds.
    time_s: f32,
    left_out: Vec<Point, LEFT_OUT>,
    loose_mm: f32,
    /// `(Γ̃' , length)` of the piece before the last knot; none at the start of the path.
    before: Option<([f32; 3], f32)>,
    /// How the path has turned; nothing before the first corner.
    turning: Option<Turning>,
}

impl Outline {
    /// The path begins anew with a line that takes `time_s`.
    pub fn begin(&mut self, tangent: [f32; 3], length_mm: f32, time_s: f32) {
        self.chord_mm = scaled(tangent, length_mm);
        self.length_mm = length_mm;
        self.time_s = time_s;
        self.left_out.clear();
        self.loose_mm = 0.0;
        self.before = None;
    }

    /// How the path goes on with a line: its corner becomes a knot unless the last piece lasts
    /// up to `piece_s` so far and stays within `loose_mm`.
    pub fn joint(
        &self,
        tangent: [f32; 3],
        length_mm: f32,
        (piece_s, loose_mm): (f32, f32),
    ) -> Joint {
        let slope = self.slope();
        let turn_to = |slope| {
            self.before
                .map_or(0.0, |(before, _)| distance(before, slope))
        };
        let knot = Joint {
            last_turn: turn_to(slope),
            turn: Some(distance(slope, tangent)),
            loose_mm: self.loose_mm,
        };
        if self.time_s > piece_s || self.left_out.is_full() {
            return knot;
        }
        let longer_mm = self.length_mm + length_mm;
        let chord_mm = sum(self.chord_mm, scaled(tangent, length_mm));
        let longer_slope = scaled(chord_mm, 1.0 / longer_mm);
        let miss = |offset_mm, along_mm| distance(offset_mm, scaled(longer_slope, along_mm));
        let misses = self
            .left_out
            .iter()
            .map(|point| miss(point.offset_mm, point.along_mm));
        let loose = misses.fold(miss(self.chord_mm, self.length_mm), f32::max);
        if loose > loose_mm {
            return knot;
        }
        Joint {
            last_turn: turn_to(longer_slope),
            turn: None,
            loose_mm: loose,
        }
    }

    /// Goes on with a line that takes `time_s`, its dwell included.
    pub fn push(
        &mut self,
        joint: &Joint,
        tangent: [f32; 3],
        length_mm: f32,
        time_s: f32,
        spread_mm: f32,
    ) {
        if let Some(turn) = joint.turn {
            self.learn(turn, length_mm, spread_mm);
            let before = (self.slope(), self.length_mm);
            self.begin(tangent, length_mm, time_s);
            self.before = Some(before);
            return;
        }
        self.loose_mm = joint.loose_mm;
        // there is room: it was asked for
        let _ = self.left_out.push(Point {
            offset_mm: self.chord_mm,
            along_mm: self.length_mm,
        });
        self.chord_mm = sum(self.chord_mm, scaled(tangent, length_mm));
        self.length_mm += length_mm;
        self.time_s += time_s;
    }

    /// How much the path is about to turn per mm, if its next line is `length_mm` long and begins
    /// with a turn: as it did of late, and more where it turns more and more. No corner is
    /// expected to turn by more than the latest two.
    pub fn curvature_per_mm(&self, turn: f32, length_mm: f32) -> f32 {
        let here_per_mm = turn / length_mm;
        self.turning.map_or(here_per_mm, |turning| {
            let latest_per_mm = SHARPER * turning.latest.max(turn) / length_mm;
            turning.ahead_per_mm().min(latest_per_mm)
        })
    }

    /// Takes note of the turns at the last knot and at the one that is made now.
    fn learn(&mut self, turn: f32, length_mm: f32, spread_mm: f32) {
        let slope = self.slope();
        let Some(turning) = &mut self.turning else {
            let per_mm = 2.0 * turn / (self.length_mm + length_mm);
            self.turning = Some(Turning {
                slow_per_mm: per_mm,
                fast_per_mm: per_mm,
                latest: turn,
            });
            return;
        };
        turning.latest = turn;
        let Some((before, before_mm)) = self.before else {
            return;
        };
        let both_mm = (before_mm + self.length_mm) / 2.0;
        let per_mm = distance(before, slope) / both_mm;
        let follow = |known_per_mm: &mut f32, over_mm: f32| {
            *known_per_mm += both_mm / (both_mm + over_mm) * (per_mm - *known_per_mm);
        };
        follow(&mut turning.slow_per_mm, SLOW * spread_mm);
        follow(&mut turning.fast_per_mm, FAST * spread_mm);
    }

    /// `Γ̃'` behind the last knot.
    fn slope(&self) -> [f32; 3] {
        if self.length_mm > 0.0 {
            scaled(self.chord_mm, 1.0 / self.length_mm)
        } else {
            [0.0; 3]
        }
    }
}

fn sum(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    let ([ax, ay, az], [bx, by, bz]) = (a, b);
    [ax + bx, ay + by, az + bz]
}

fn scaled(a: [f32; 3], by: f32) -> [f32; 3] {
    a.map(|value| value * by)
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = sum(a, scaled(b, -1.0));
    sqrt_f32(x * x + y * y + z * z)
}
