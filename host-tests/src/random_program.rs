//! Seeded random programs within the default robot's reach, for tests on both machines.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// X and Y of the region in which programs stay: convex, so that lines between its points do.
const REGION_MM: [(f64, f64); 2] = [(150.0, 300.0), (-120.0, 120.0)];

/// What a random program may contain.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Moves after the first point.
    pub moves: usize,
    /// Shortest segment in mm; lengths are spread evenly over their logarithm.
    pub shortest_mm: f64,
    /// Longest segment in mm.
    pub longest_mm: f64,
    /// Probability that a move is an arc.
    pub arcs: f64,
    /// Probability that a move turns by at most 10° from the one before.
    pub smooth: f64,
    /// Whether corner tolerances change on the way, between 0 and 2 mm.
    pub tolerances: bool,
    /// Whether the program returns to its first point.
    pub closed: bool,
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            moves: 40,
            shortest_mm: 0.05,
            longest_mm: 150.0,
            arcs: 0.25,
            smooth: 0.3,
            tolerances: true,
            closed: false,
        }
    }
}

/// A random program: the same for the same seed and shape on every machine.
#[must_use]
pub fn random_program(seed: u64, shape: Shape) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut text = String::from("G21 G90 G17\nG0 X200 Y0 Z0 C0\n");
    let mut at = [200.0, 0.0];
    let mut heading = 0.0;
    for _ in 0..shape.moves {
        if shape.tolerances && rng.random_bool(0.1) {
            let tolerance_mm = 10.0_f64.powf(rng.random_range(-2.0..0.3));
            let _ = match rng.random_range(0..4) {
                0 => writeln!(text, "G61"),
                1 => writeln!(text, "G64"),
                _ => writeln!(text, "G64 P{tolerance_mm:.4}"),
            };
        }
        let feed = 10.0_f64.powf(rng.random_range(2.7..4.5));
        let end = Move::random(&mut rng, shape, at, &mut heading);
        let _ = writeln!(text, "{} F{feed:.0}", end.words(at, &mut rng));
        at = end.target;
    }
    if shape.closed {
        text.push_str("G1 X200 Y0 Z0 C0 F9600\n");
    }
    text.push_str("M2\n");
    text
}

/// A move in the plane.
struct Move {
    target: [f64; 2],
    /// Centre, and whether counter-clockwise.
    arc: Option<([f64; 2], bool)>,
}

impl Move {
    fn random(rng: &mut impl Rng, shape: Shape, from: [f64; 2], heading: &mut f64) -> Self {
        let (low, high) = (shape.shortest_mm.ln(), shape.longest_mm.ln());
        loop {
            let size_mm = rng.random_range(low..high).exp();
            let direction = if rng.random_bool(shape.smooth) {
                *heading + rng.random_range(-PI / 18.0..PI / 18.0)
            } else {
                rng.random_range(0.0..TAU)
            };
            let toward = |angle: f64, by: f64| {
                let point = [from[0] + by * angle.cos(), from[1] + by * angle.sin()];
                point.map(|value| (value * 1e4).round() / 1e4)
            };
            let candidate = if rng.random_bool(shape.arcs) {
                Self::arc_around(rng, from, toward(direction, size_mm / 2.0))
            } else {
                Some(Self {
                    target: toward(direction, size_mm),
                    arc: None,
                })
            };
            match candidate {
                Some(found) if is_inside(found.target, 0.0) && found.target != from => {
                    *heading = direction;
                    return found;
                }
                // a corner of the region: look the other way
                _ => *heading += 1.0,
            }
        }
    }

    /// An arc of a random sweep around a centre, if its circle stays in the region.
    fn arc_around(rng: &mut impl Rng, from: [f64; 2], centre: [f64; 2]) -> Option<Self> {
        let (dx, dy) = (from[0] - centre[0], from[1] - centre[1]);
        let radius_mm = dx.hypot(dy);
        let counter_clockwise = rng.random_bool(0.5);
        let sweep = rng.random_range(0.2..6.0) * if counter_clockwise { 1.0 } else { -1.0 };
        let (sin, cos) = f64::sin_cos(sweep);
        let target = [
            centre[0] + dx * cos - dy * sin,
            centre[1] + dx * sin + dy * cos,
        ];
        (radius_mm > 0.01 && is_inside(centre, radius_mm)).then(|| Self {
            target: target.map(|value| (value * 1e4).round() / 1e4),
            arc: Some((centre, counter_clockwise)),
        })
    }

    fn words(&self, from: [f64; 2], rng: &mut impl Rng) -> String {
        let [x, y] = self.target;
        let mut words = match self.arc {
            None => format!("G1 X{x:.4} Y{y:.4}"),
            Some((centre, counter_clockwise)) => format!(
                "{} X{x:.4} Y{y:.4} I{:.4} J{:.4}",
                if counter_clockwise { "G3" } else { "G2" },
                centre[0] - from[0],
                centre[1] - from[1],
            ),
        };
        if rng.random_bool(0.2) {
            let _ = write!(words, " Z{:.3}", rng.random_range(-20.0..20.0));
        }
        if rng.random_bool(0.2) {
            let _ = write!(words, " C{:.3}", rng.random_range(-90.0..90.0));
        }
        words
    }
}

fn is_inside(point: [f64; 2], margin: f64) -> bool {
    point
        .into_iter()
        .zip(REGION_MM)
        .all(|(value, (low, high))| (low + margin..=high - margin).contains(&value))
}
