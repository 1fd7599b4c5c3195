//! Seeded random programs within the reach of the default SCARA or delta robot, for tests on both machines.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

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
    /// The first point.
    pub start_mm: [f64; 3],
    /// X and Y of the region in which the program stays: convex, so that lines between its points
    /// do.
    pub region_mm: [(f64, f64); 2],
    /// How far Z goes from that of the first point, either way.
    pub lift_mm: f64,
}

impl Shape {
    /// Within the default delta robot's reach, over two thirds of its width.
    #[must_use]
    pub fn of_delta() -> Self {
        Self {
            start_mm: [0.0, 0.0, -720.0],
            region_mm: [(-260.0, 260.0); 2],
            lift_mm: 80.0,
            ..Self::default()
        }
    }
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
            start_mm: [200.0, 0.0, 0.0],
            region_mm: [(150.0, 300.0), (-120.0, 120.0)],
            lift_mm: 20.0,
        }
    }
}

/// A random program: the same for the same seed and shape on every machine.
#[must_use]
pub fn random_program(seed: u64, shape: Shape) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let [x, y, z] = shape.start_mm;
    let mut text = format!("G21 G90 G17\nG0 X{x} Y{y} Z{z} C0\n");
    let mut at = [x, y];
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
        let _ = writeln!(text, "{} F{feed:.0}", end.words(at, shape, &mut rng));
        at = end.target;
    }
    if shape.closed {
        let _ = writeln!(text, "G1 X{x} Y{y} Z{z} C0 F9600");
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
                Self::arc_around(rng, shape, from, toward(direction, size_mm / 2.0))
            } else {
                Some(Self {
                    target: toward(direction, size_mm),
                    arc: None,
                })
            };
            match candidate {
                Some(found) if is_inside(shape, found.target, 0.0) && found.target != from => {
                    *heading = direction;
                    return found;
                }
                // a corner of the region: look the other way
                _ => *heading += 1.0,
            }
        }
    }

    /// An arc of a random sweep around a centre, if its circle stays in the region.
    fn arc_around(
        rng: &mut impl Rng,
        shape: Shape,
        from: [f64; 2],
        centre: [f64; 2],
    ) -> Option<Self> {
        let (dx, dy) = (from[0] - centre[0], from[1] - centre[1]);
        let radius_mm = dx.hypot(dy);
        let counter_clockwise = rng.random_bool(0.5);
        let sweep = rng.random_range(0.2..6.0) * if counter_clockwise { 1.0 } else { -1.0 };
        let (sin, cos) = f64::sin_cos(sweep);
        let target = [
            centre[0] + dx * cos - dy * sin,
            centre[1] + dx * sin + dy * cos,
        ];
        (radius_mm > 0.01 && is_inside(shape, centre, radius_mm)).then(|| Self {
            target: target.map(|value| (value * 1e4).round() / 1e4),
            arc: Some((centre, counter_clockwise)),
        })
    }

    fn words(&self, from: [f64; 2], shape: Shape, rng: &mut impl Rng) -> String {
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
            let lift_mm = rng.random_range(-shape.lift_mm..shape.lift_mm);
            let _ = write!(words, " Z{:.3}", shape.start_mm[2] + lift_mm);
        }
        if rng.random_bool(0.2) {
            let _ = write!(words, " C{:.3}", rng.random_range(-90.0..90.0));
        }
        words
    }
}

fn is_inside(shape: Shape, point: [f64; 2], margin: f64) -> bool {
    point
        .into_iter()
        .zip(shape.region_mm)
        .all(|(value, (low, high))| (low + margin..=high - margin).contains(&value))
}
