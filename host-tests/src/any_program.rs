//! Seeded random programs of all that a path can be made of: dense polylines, arcs of any
//! radius, helices, tiny corners in a row, reversals, moves that do not translate.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// X and Y of the region in which programs stay: convex, so that lines between its points do.
const REGION_MM: [(f64, f64); 2] = [(300.0, 680.0), (-340.0, 340.0)];

/// Z in which programs stay.
const DEPTH_MM: (f64, f64) = (-80.0, 80.0);

/// The settings of an arm that reaches the region.
pub const ARM: &str =
    "link1=500 link2=400 joint1-min=-170 joint1-max=170 joint3-min=-100 joint3-max=100";

/// A random program: the same for the same seed on every machine. `mixed` programs change the
/// corner tolerance on the way, from 0.01 to 2 mm and to exact stops.
#[must_use]
pub fn any_program(seed: u64, mixed: bool) -> String {
    let mut writer = Writer {
        rng: ChaCha8Rng::seed_from_u64(seed),
        text: String::from("G21 G90 G17\nG0 X500 Y0 Z0 C0\n"),
        at: [500.0, 0.0, 0.0],
        heading: 0.0,
        decimals: 4,
    };
    writer.decimals = writer.rng.random_range(3..=5);
    for _ in 0..writer.rng.random_range(4..10) {
        if mixed {
            writer.change_tolerance();
        }
        writer.feed();
        match writer.rng.random_range(0..10) {
            0 | 1 => writer.dense_curve(),
            2 => writer.dense_wave(),
            3 => writer.arcs(),
            4 => writer.rounded_corner(),
            5 => writer.circle(),
            6 => writer.tiny_corners(),
            7 => writer.reversals(),
            8 => writer.lines(),
            _ => writer.stand(),
        }
    }
    writer.text + "M2\n"
}

struct Writer {
    rng: ChaCha8Rng,
    text: String,
    at: [f64; 3],
    heading: f64,
    decimals: usize,
}

impl Writer {
    /// A number evenly spread over its logarithm.
    fn spread(&mut self, low: f64, high: f64) -> f64 {
        self.rng.random_range(low.ln()..high.ln()).exp()
    }

    fn sign(&mut self) -> f64 {
        if self.rng.random_bool(0.5) { 1.0 } else { -1.0 }
    }

    fn change_tolerance(&mut self) {
        let tolerance_mm = self.spread(0.01, 2.0);
        let _ = match self.rng.random_range(0..5) {
            0 => writeln!(self.text, "G61"),
            1 => writeln!(self.text, "G64"),
            _ => writeln!(self.text, "G64 P{tolerance_mm:.4}"),
        };
    }

    fn feed(&mut self) {
        let feed = self.spread(1200.0, 24_000.0);
        let _ = writeln!(self.text, "F{feed:.0}");
    }

    fn rounded(&self, value: f64) -> f64 {
        let scale = 10.0_f64.powi(self.decimals as i32);
        (value * scale).round() / scale
    }

    /// A line to a point, if that is within the region and elsewhere.
    fn line(&mut self, to: [f64; 3]) -> bool {
        let to = to.map(|value| self.rounded(value));
        if !is_inside(to) || to == self.at {
            return false;
        }
        let [x, y, z] = to;
        let digits = self.decimals;
        let _ = write!(self.text, "G1 X{x:.digits$} Y{y:.digits$} Z{z:.digits$}");
        if self.rng.random_bool(0.02) {
            let _ = write!(self.text, " C{:.2}", self.rng.random_range(-90.0..90.0));
        }
        self.text.push('\n');
        self.at = to;
        true
    }

    fn ahead(&self, length_mm: f64, angle: f64) -> [f64; 3] {
        let [x, y, z] = self.at;
        let heading = self.heading + angle;
        [
            x + length_mm * heading.cos(),
            y + length_mm * heading.sin(),
            z,
        ]
    }

    /// An arc, spiral or helix in chords.
    fn dense_curve(&mut self) {
        let radius_mm = self.spread(0.3, 200.0) * self.sign();
        let chord_mm = self.spread(0.05, 1.5);
        let growth = self.rng.random_range(-0.3..0.3);
        let climb = if self.rng.random_bool(0.3) {
            self.rng.random_range(-0.3..0.3)
        } else {
            0.0
        };
        let noise = if self.rng.random_bool(0.2) { 0.3 } else { 0.0 };
        let count = self.rng.random_range(10..150);
        let mut turned = 0.0_f64;
        for _ in 0..count {
            let radius_mm = radius_mm * (1.0 + growth * turned.abs() / TAU).max(0.1);
            let turn = (chord_mm / radius_mm).clamp(-1.0, 1.0);
            turned += turn;
            self.heading += turn;
            let length_mm = chord_mm * (1.0 + noise * self.rng.random_range(-1.0..1.0));
            let [x, y, z] = self.ahead(length_mm, 0.0);
            if !self.line([x, y, z + climb * length_mm]) {
                self.heading += 1.0;
            }
        }
    }

    /// A sine wave in chords.
    fn dense_wave(&mut self) {
        let (length_mm, height_mm) = (self.spread(1.0, 60.0), self.spread(0.05, 10.0));
        let chord_mm = self.spread(0.05, 1.0);
        let heading = self.rng.random_range(0.0..TAU);
        let [x0, y0, z] = self.at;
        let (sin, cos) = heading.sin_cos();
        for i in 1..self.rng.random_range(20..150) {
            let along = f64::from(i) * chord_mm;
            let across = height_mm * (TAU * along / length_mm).sin();
            if !self.line([
                x0 + along * cos - across * sin,
                y0 + along * sin + across * cos,
                z,
            ]) {
                break;
            }
        }
        self.heading = heading;
    }

    /// An arc of a sweep about a centre to the left at a radius, if its circle is inside.
    fn arc(&mut self, radius_mm: f64, sweep: f64, climb_mm: f64) -> bool {
        let [x, y, z] = self.at;
        let (sin, cos) = self.heading.sin_cos();
        // the centre is to the left of the heading, counter-clockwise, or to the right
        let side = sweep.signum() * radius_mm;
        let (cx, cy) = (self.rounded(x - side * sin), self.rounded(y + side * cos));
        let (dx, dy) = (x - cx, y - cy);
        let radius_mm = dx.hypot(dy);
        let inside = [
            [cx - radius_mm, cy - radius_mm, z],
            [cx + radius_mm, cy + radius_mm, z + climb_mm],
        ];
        let is_full = sweep.abs() >= TAU;
        let (turn_sin, turn_cos) = sweep.sin_cos();
        let target = if is_full {
            [x, y]
        } else {
            [
                self.rounded(cx + dx * turn_cos - dy * turn_sin),
                self.rounded(cy + dx * turn_sin + dy * turn_cos),
            ]
        };
        if radius_mm < 0.04 || !inside.into_iter().all(is_inside) || !is_full && target == [x, y] {
            return false;
        }
        let z = self.rounded(z + climb_mm);
        let digits = self.decimals;
        let _ = writeln!(
            self.text,
            "{} X{:.digits$} Y{:.digits$} Z{z:.digits$} I{:.digits$} J{:.digits$}",
            if sweep > 0.0 { "G3" } else { "G2" },
            target[0],
            target[1],
            cx - x,
            cy - y,
        );
        self.at = [target[0], target[1], z];
        self.heading += sweep;
        true
    }

    /// Arcs and helices that follow each other, with or without a corner.
    fn arcs(&mut self) {
        for _ in 0..self.rng.random_range(1..6) {
            let radius_mm = self.spread(0.05, 200.0);
            let sweep = self.rng.random_range(0.1..6.0) * self.sign();
            let climb_mm = if self.rng.random_bool(0.3) {
                self.rng.random_range(-5.0..5.0)
            } else {
                0.0
            };
            if self.rng.random_bool(0.5) {
                self.heading += self.rng.random_range(-PI..PI);
            }
            if !self.arc(radius_mm, sweep, climb_mm) {
                self.heading += 1.0;
            }
        }
    }

    /// A line, an arc that touches it, a line that touches the arc.
    fn rounded_corner(&mut self) {
        let (before_mm, after_mm) = (self.spread(0.1, 100.0), self.spread(0.1, 100.0));
        let (radius_mm, sweep) = (
            self.spread(0.05, 50.0),
            self.rng.random_range(0.05..3.0) * self.sign(),
        );
        let ahead = self.ahead(before_mm, 0.0);
        if self.line(ahead) && self.arc(radius_mm, sweep, 0.0) {
            let ahead = self.ahead(after_mm, 0.0);
            self.line(ahead);
        } else {
            self.heading += 1.0;
        }
    }

    fn circle(&mut self) {
        let radius_mm = self.spread(0.05, 60.0);
        let turn = TAU * self.sign();
        self.heading = self.rng.random_range(0.0..TAU);
        self.arc(radius_mm, turn, 0.0);
    }

    /// Many tiny corners, blunt or sharp.
    fn tiny_corners(&mut self) {
        let length_mm = self.spread(0.05, 3.0);
        let sharpest = self.spread(0.01, PI);
        for i in 0..self.rng.random_range(5..60) {
            let size = self.rng.random_range(0.5..1.0);
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let ahead = self.ahead(length_mm * size, side * sharpest / 2.0 * size);
            if !self.line(ahead) {
                self.heading += 1.0;
            }
        }
    }

    /// There and back on the same way, or beside it.
    fn reversals(&mut self) {
        for _ in 0..self.rng.random_range(1..6) {
            let length_mm = self.spread(0.05, 100.0);
            let beside_mm = if self.rng.random_bool(0.5) {
                self.spread(0.05, 1.0)
            } else {
                0.0
            };
            let from = self.at;
            let ahead = self.ahead(length_mm, 0.0);
            if !self.line(ahead) {
                self.heading += 1.0;
                continue;
            }
            if beside_mm > 0.0 {
                let beside = self.ahead(beside_mm, PI / 2.0);
                self.line(beside);
            }
            let back_mm = length_mm * self.rng.random_range(0.3..1.0);
            let back = if beside_mm == 0.0 && self.rng.random_bool(0.5) {
                from
            } else {
                self.ahead(-back_mm, 0.0)
            };
            self.line(back);
            self.heading += self.rng.random_range(-0.5..0.5);
        }
    }

    /// Lines of any length at any angle.
    fn lines(&mut self) {
        for _ in 0..self.rng.random_range(1..8) {
            let length_mm = self.spread(0.05, 500.0);
            let angle = if self.rng.random_bool(0.5) {
                self.rng.random_range(-0.2..0.2)
            } else {
                self.rng.random_range(-PI..PI)
            };
            if self.rng.random_bool(0.3) {
                self.feed();
            }
            let [x, y, z] = self.ahead(length_mm, angle);
            let climb_mm = if self.rng.random_bool(0.2) {
                self.rng.random_range(-20.0..20.0)
            } else {
                0.0
            };
            if self.line([x, y, z + climb_mm]) {
                self.heading += angle;
            } else {
                self.heading = self.rng.random_range(0.0..TAU);
            }
        }
    }

    /// A move of Z or of the yaw alone, or a rapid.
    fn stand(&mut self) {
        let [x, y, _] = self.at;
        match self.rng.random_range(0..3) {
            0 => {
                let z = self.rng.random_range(DEPTH_MM.0..DEPTH_MM.1);
                self.line([x, y, z]);
            }
            1 => {
                let _ = writeln!(self.text, "G1 C{:.3}", self.rng.random_range(-90.0..90.0));
            }
            _ => {
                let [x, y] = REGION_MM.map(|(low, high)| {
                    let value: f64 = self.rng.random_range(low..high);
                    value.round()
                });
                let _ = writeln!(self.text, "G0 X{x} Y{y}");
                self.at = [x, y, self.at[2]];
            }
        }
    }
}

fn is_inside([x, y, z]: [f64; 3]) -> bool {
    [(x, REGION_MM[0]), (y, REGION_MM[1]), (z, DEPTH_MM)]
        .into_iter()
        .all(|(value, (low, high))| (low..=high).contains(&value))
}

/// A circle of chords about (500, 0), once around, counter-clockwise, from its point at +X.
#[must_use]
pub fn chord_circle(radius_mm: f64, chord_mm: f64, decimals: usize, feed_mm_s: f64) -> String {
    let count = (TAU * radius_mm / chord_mm).round() as u32;
    let mut text = format!(
        "G0 X{} Y0 Z0\nG1 F{}\n",
        500.0 + radius_mm,
        feed_mm_s * 60.0
    );
    for i in 1..=count {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(count)).sin_cos();
        let _ = writeln!(
            text,
            "X{:.decimals$} Y{:.decimals$}",
            500.0 + radius_mm * cos,
            radius_mm * sin
        );
    }
    text
}
