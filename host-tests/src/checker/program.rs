//! Reads the test programs' G-code into a path, for the checker alone.

use std::fmt;

use super::hops::{Hop, HopDefaults, HopWords};
use crate::vector::{distance, xyz};

/// Largest difference of an arc's two radii in millimetres.
const RADIUS_MM: f64 = 0.005;

/// Height of an arc above its chord in millimetres when it is made a polyline.
const SAGITTA_MM: f64 = 1e-6;

/// The curve of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Curve {
    Line,
    /// Centre, and the angle swept in radians, positive counter-clockwise.
    Arc([f64; 2], f64),
    /// A pick-and-place move.
    Hop(HopWords),
}

/// One block that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Line of the program, from 1.
    pub line: usize,
    /// Pose `[x, y, z, c]` at its start, mm and degrees.
    pub from: [f64; 4],
    /// Pose at its end.
    pub to: [f64; 4],
    /// Feedrate in mm/s; `None` for a rapid.
    pub feed_mm_s: Option<f64>,
    /// Tolerance of the corner at its start, millimetres; `None` where none is set, infinite
    /// where its overlap is.
    pub tolerance_mm: Option<f64>,
    curve: Curve,
}

impl Block {
    /// Centre and swept angle in radians, positive counter-clockwise, of an arc.
    #[must_use]
    pub fn arc(&self) -> Option<([f64; 2], f64)> {
        match self.curve {
            Curve::Line | Curve::Hop(_) => None,
            Curve::Arc(centre, sweep_rad) => Some((centre, sweep_rad)),
        }
    }

    /// Whether it is a pick-and-place move.
    #[must_use]
    pub fn is_hop(&self) -> bool {
        matches!(self.curve, Curve::Hop(_))
    }

    /// The pick-and-place move, if it is one.
    #[must_use]
    pub fn as_hop(&self, defaults: HopDefaults) -> Option<Hop> {
        let Curve::Hop(words) = self.curve else {
            return None;
        };
        Some(Hop {
            line: self.line,
            from: xyz(self.from),
            to: xyz(self.to),
            height_mm: words.height_mm.unwrap_or(defaults.height_mm),
            tolerance_mm: words.tolerance_mm.unwrap_or(defaults.tolerance_mm),
            sets_acceleration: words.sets_acceleration,
        })
    }

    /// Points along the block, its start left out; chords within 1 nm of the arc. Of a hop, whose
    /// way is not programmed, its end.
    #[must_use]
    pub fn points(&self) -> Vec<[f64; 3]> {
        let Curve::Arc(centre, sweep) = self.curve else {
            return if distance(xyz(self.from), xyz(self.to)) > 0.0 {
                vec![xyz(self.to)]
            } else {
                Vec::new()
            };
        };
        let (dx, dy) = (self.from[0] - centre[0], self.from[1] - centre[1]);
        let step = (8.0 * SAGITTA_MM / dx.hypot(dy)).sqrt();
        let chords = (sweep.abs() / step).ceil().max(1.0) as u32;
        let mut points: Vec<_> = (1..=chords)
            .map(|i| {
                let u = f64::from(i) / f64::from(chords);
                let (sin, cos) = (u * sweep).sin_cos();
                [
                    centre[0] + dx * cos - dy * sin,
                    centre[1] + dx * sin + dy * cos,
                    self.from[2] + u * (self.to[2] - self.from[2]),
                ]
            })
            .collect();
        points[chords as usize - 1] = xyz(self.to);
        points
    }
}

/// A program as a path: it starts at the point of its first motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// Blocks in order, each beginning where the last one ended.
    pub blocks: Vec<Block>,
    /// Pose at the start; 0 for axes that the first motion does not name.
    pub start: [f64; 4],
}

/// Why a program cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramError {
    /// Line of the program, from 1.
    pub line: usize,
    /// What is wrong with it.
    pub reason: &'static str,
}

impl fmt::Display for ProgramError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.reason)
    }
}

impl std::error::Error for ProgramError {}

#[derive(Clone, Copy, PartialEq)]
enum Motion {
    Rapid,
    Line,
    Clockwise,
    Counterclockwise,
}

/// Modal state of the reader.
struct Reader {
    motion: Motion,
    relative: bool,
    feed_mm_s: Option<f64>,
    tolerance_mm: Option<f64>,
    at: Option<[f64; 4]>,
}

impl Program {
    /// Reads G0–G4, G17, G21, G61, G64 P or Q, G90, G91, G94, M2, M30, M103 and outputs, with
    /// X Y Z C, I J, F and the words of a hop; anything else is refused rather than misjudged.
    ///
    /// The mode at a block is that of the corner at the block's **end**.
    ///
    /// # Errors
    /// The first line that cannot be read.
    pub fn parse(text: &str) -> Result<Self, ProgramError> {
        let mut reader = Reader {
            motion: Motion::Rapid,
            relative: false,
            feed_mm_s: None,
            tolerance_mm: None,
            at: None,
        };
        let mut program = Self::default();
        for (i, line) in text.lines().enumerate() {
            let fail = |reason| ProgramError {
                line: i + 1,
                reason,
            };
            let words = words(line).map_err(fail)?;
            let first = reader.at.is_none();
            match reader.block(&words).map_err(fail)? {
                Outcome::Nothing => {}
                Outcome::End => break,
                Outcome::Move(to, _) if first => program.start = to,
                Outcome::Move(to, curve) => {
                    let from = program.end();
                    program.blocks.push(Block {
                        line: i + 1,
                        from,
                        to,
                        feed_mm_s: reader.feed_mm_s.filter(|_| {
                            reader.motion != Motion::Rapid && !matches!(curve, Curve::Hop(_))
                        }),
                        tolerance_mm: reader.tolerance_mm,
                        curve,
                    });
                }
            }
        }
        Ok(program)
    }

    /// The pick-and-place moves in order.
    #[must_use]
    pub fn hops(&self, defaults: HopDefaults) -> Vec<Hop> {
        let blocks = self.blocks.iter();
        blocks.filter_map(|block| block.as_hop(defaults)).collect()
    }

    /// Pose at the end.
    #[must_use]
    pub fn end(&self) -> [f64; 4] {
        self.blocks.last().map_or(self.start, |block| block.to)
    }
}

enum Outcome {
    Nothing,
    Move([f64; 4], Curve),
    End,
}

impl Reader {
    fn block(&mut self, words: &[(char, f64)]) -> Result<Outcome, &'static str> {
        let word = |letter| words.iter().find(|w| w.0 == letter).map(|w| w.1);
        let is_hop = words.contains(&('M', 103.0));
        let mut dwell = false;
        let mut end = false;
        for &(letter, value) in words {
            match (letter, value) {
                ('G', 0.0) => self.motion = Motion::Rapid,
                ('G', 1.0) => self.motion = Motion::Line,
                ('G', 2.0) => self.motion = Motion::Clockwise,
                ('G', 3.0) => self.motion = Motion::Counterclockwise,
                ('G', 4.0) => dwell = true,
                ('G', 61.0) => self.tolerance_mm = Some(0.0),
                ('G', 64.0) => {
                    self.tolerance_mm = match word('Q') {
                        Some(overlap) if overlap > 0.0 => Some(f64::INFINITY),
                        overlap => word('P').or(overlap),
                    };
                }
                ('G', 90.0) => self.relative = false,
                ('G', 91.0) => self.relative = true,
                ('G', 17.0 | 21.0 | 94.0) => {}
                ('M', 2.0 | 30.0) => end = true,
                // outputs are switched where the path stands
                ('M', 3.0 | 4.0 | 5.0 | 7.0 | 8.0 | 9.0 | 103.0) => {}
                ('R' | 'K', _) if is_hop => {}
                ('F', feed) if feed > 0.0 => self.feed_mm_s = Some(feed / 60.0),
                ('X' | 'Y' | 'Z' | 'C' | 'I' | 'J' | 'P' | 'Q' | 'N', _) => {}
                _ => return Err("a word that this reader does not know"),
            }
        }
        let axes = ['X', 'Y', 'Z', 'C'].map(word);
        if end {
            return Ok(Outcome::End);
        }
        if dwell || axes.iter().all(Option::is_none) && word('I').or(word('J')).is_none() {
            return Ok(Outcome::Nothing);
        }
        let from = self.at.unwrap_or_default();
        let mut to = from;
        for (to, axis) in to.iter_mut().zip(axes) {
            match axis {
                Some(value) if self.relative => *to += value,
                Some(value) => *to = value,
                None => {}
            }
        }
        let curve = match self.motion {
            _ if is_hop && self.at.is_none() => return Err("a hop without a start"),
            _ if is_hop => Curve::Hop(HopWords {
                height_mm: word('Q'),
                tolerance_mm: word('P'),
                sets_acceleration: word('K').is_some(),
            }),
            Motion::Rapid | Motion::Line => Curve::Line,
            _ if self.at.is_none() => return Err("an arc without a start"),
            turn => {
                let centre = [
                    from[0] + word('I').unwrap_or(0.0),
                    from[1] + word('J').unwrap_or(0.0),
                ];
                Curve::Arc(centre, sweep(from, to, centre, turn)?)
            }
        };
        if !is_hop && self.motion != Motion::Rapid && self.feed_mm_s.is_none() {
            return Err("no feedrate");
        }
        self.at = Some(to);
        Ok(Outcome::Move(to, curve))
    }
}

/// Angle from `from` to `to` about `centre`; a full turn if they are the same point.
fn sweep(
    from: [f64; 4],
    to: [f64; 4],
    centre: [f64; 2],
    turn: Motion,
) -> Result<f64, &'static str> {
    let a = [from[0] - centre[0], from[1] - centre[1]];
    let b = [to[0] - centre[0], to[1] - centre[1]];
    let (ra, rb) = (a[0].hypot(a[1]), b[0].hypot(b[1]));
    if ra == 0.0 || (ra - rb).abs() > RADIUS_MM {
        return Err("an arc that does not close");
    }
    let full = std::f64::consts::TAU;
    let angle = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]);
    let same = from[0] == to[0] && from[1] == to[1];
    Ok(match turn {
        Motion::Clockwise if same => -full,
        _ if same => full,
        Motion::Clockwise => -(-angle).rem_euclid(full),
        _ => angle.rem_euclid(full),
    })
}

/// Letters and numbers of a line, comments left out.
fn words(line: &str) -> Result<Vec<(char, f64)>, &'static str> {
    let mut rest = String::new();
    let mut comment = false;
    for c in line.chars() {
        match c {
            ';' if !comment => break,
            '(' => comment = true,
            ')' => comment = false,
            _ if comment || c.is_whitespace() || c == '%' => {}
            _ => rest.push(c.to_ascii_uppercase()),
        }
    }
    let mut words = Vec::new();
    let mut rest = rest.as_str();
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err("a number without a letter");
        }
        rest = &rest[1..];
        let length = rest
            .find(|c: char| !c.is_ascii_digit() && !"+-.".contains(c))
            .unwrap_or(rest.len());
        let number = rest[..length]
            .parse()
            .map_err(|_| "a letter without a number")?;
        words.push((letter, number));
        rest = &rest[length..];
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn length(points: &[[f64; 3]], from: [f64; 4]) -> f64 {
        let mut last = xyz(from);
        points.iter().fold(0.0, |sum, &p| {
            let step = distance(last, p);
            last = p;
            sum + step
        })
    }

    #[test]
    fn reads_the_corner_path() {
        let program = Program::parse(include_str!("../../programs/corner-path.gcode")).unwrap();
        assert_eq!(program.start, [180.0, 0.0, 0.0, 0.0]);
        assert_eq!(program.end(), [270.0, 0.0, 0.0, 0.0]);
        assert_eq!(program.blocks.len(), 5);
        assert!(program.blocks.iter().all(|b| b.feed_mm_s == Some(160.0)));
        assert!(program.blocks.iter().all(|b| b.tolerance_mm.is_none()));
        let total: f64 = program
            .blocks
            .iter()
            .map(|b| length(&b.points(), b.from))
            .sum();
        assert!((total - 458.58).abs() < 5e-3, "{total}");
    }

    #[test]
    fn modes_hold_and_belong_to_the_end_of_their_block() {
        let text = "(start) g0x1y2\nG64 P0.25 G1 X2 F60 ; slow\nN7 Y3\nG61\nG91 X1 C90\nG0 Z-1\n\
                    G4 P1\nG64\nG90 G1 X0\nM30\nX9";
        let program = Program::parse(text).unwrap();
        let found: Vec<_> = program
            .blocks
            .iter()
            .map(|b| (b.line, b.to, b.feed_mm_s, b.tolerance_mm))
            .collect();
        assert_eq!(
            found,
            [
                (2, [2.0, 2.0, 0.0, 0.0], Some(1.0), Some(0.25)),
                (3, [2.0, 3.0, 0.0, 0.0], Some(1.0), Some(0.25)),
                (5, [3.0, 3.0, 0.0, 90.0], Some(1.0), Some(0.0)),
                (6, [3.0, 3.0, -1.0, 90.0], None, Some(0.0)),
                (9, [0.0, 3.0, -1.0, 90.0], Some(1.0), None),
            ]
        );
    }

    #[test]
    fn arcs_turn_the_way_they_are_told() {
        let arc = |line: &str| {
            let program = Program::parse(&format!("G0 X10 Y0\nF60 {line}")).unwrap();
            let block = program.blocks[0];
            let points = block.points();
            (length(&points, block.from), points[points.len() / 2])
        };
        for (line, expected, middle) in [
            ("G3 X0 Y10 I-10", 5.0 * PI, [7.07, 7.07, 0.0]),
            ("G2 X0 Y10 I-10", 15.0 * PI, [-7.07, -7.07, 0.0]),
            ("G3 I-10 J0", 20.0 * PI, [-10.0, 0.0, 0.0]),
            (
                "G2 X10 Y0 I-10 Z30",
                (20.0 * PI).hypot(30.0),
                [-10.0, 0.0, 15.0],
            ),
        ] {
            let (found, at) = arc(line);
            assert!((found - expected).abs() < 1e-4, "{line} {found}");
            assert!(distance(at, middle) < 0.1, "{line} {at:?}");
        }
    }

    #[test]
    fn hops_are_read_with_their_words() {
        let program =
            "G21 G90\nG0 X10 Y0 Z5 ; start\nM103 X110 Z0 Q30 P0.2 R40 K5000\nM3\nM103 Y7\nM2";
        let defaults = HopDefaults {
            height_mm: 20.0,
            tolerance_mm: 0.5,
        };
        let found = Program::parse(program).unwrap().hops(defaults);
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].from, found[0].to, found[0].line),
            ([10.0, 0.0, 5.0], [110.0, 0.0, 0.0], 3)
        );
        assert_eq!((found[0].height_mm, found[0].tolerance_mm), (30.0, 0.2));
        assert_eq!((found[1].to, found[1].height_mm), ([110.0, 7.0, 0.0], 20.0));
        assert!(found[0].sets_acceleration && !found[1].sets_acceleration);
    }

    #[test]
    fn refuses_what_it_does_not_know() {
        for (text, line, reason) in [
            ("G0 X0\nG1 X1", 2, "no feedrate"),
            ("G0 X0\nG3 X5 Y5 I5 J1 F1", 2, "an arc that does not close"),
            ("G2 X5 I5 F1", 1, "an arc without a start"),
            ("G0 X0\nG18", 2, "a word that this reader does not know"),
            (
                "G0 X0\nG1 X1 R2 F3",
                2,
                "a word that this reader does not know",
            ),
            ("M103 X5", 1, "a hop without a start"),
            ("X1..2", 1, "a letter without a number"),
            ("G0 XNAN", 1, "a letter without a number"),
            ("12", 1, "a number without a letter"),
        ] {
            assert_eq!(
                Program::parse(text),
                Err(ProgramError { line, reason }),
                "{text}"
            );
        }
    }
}
