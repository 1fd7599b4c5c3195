//! Whether hops are vertical where they have to be, measured from a trace.
//!
//! Reads the programmed hops by itself: `M103` with X Y Z, Q (height) and P (tolerance), between
//! points of G0 and G1.

use super::report::TraceRow;

/// A command nearer to a place than this has arrived there, in mm.
const ARRIVED_MM: f64 = 2e-4;

/// A command this far below a height has come to it, in mm: some bits of its resolution.
const RESOLUTION_MM: f64 = 1e-5;

/// A pick-and-place move as programmed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hop {
    /// Line of the program, from 1.
    pub line: usize,
    /// Where it starts, X Y Z in mm.
    pub from: [f64; 3],
    /// Where it ends.
    pub to: [f64; 3],
    /// Height that is to be vertical, in mm.
    pub height_mm: f64,
    /// By how much it may be bent there, in mm.
    pub tolerance_mm: f64,
    /// Whether the program says how fast.
    pub sets_acceleration: bool,
}

/// What the robot does where the program does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HopDefaults {
    /// Height that is to be vertical, in mm.
    pub height_mm: f64,
    /// By how much it may be bent there, in mm.
    pub tolerance_mm: f64,
}

/// The hops of a program, in their order; none if it uses words that are not read here.
#[must_use]
pub fn hops(program: &str, defaults: HopDefaults) -> Option<Vec<Hop>> {
    const READ: [&str; 13] = [
        "G0", "G1", "G17", "G21", "G61", "G64", "G90", "G94", "M2", "M3", "M5", "M30", "M103",
    ];
    let mut at = [0.0; 3];
    let mut hops = Vec::new();
    for (i, line) in program.lines().enumerate() {
        let text = line.split([';', '(']).next().unwrap_or_default();
        let words: Vec<_> = text.split_ascii_whitespace().collect();
        let unread = |word: &&str| word.starts_with(['G', 'M']) && !READ.contains(word);
        if words.iter().any(unread) {
            return None;
        }
        let value = |letter: char| {
            let word = words.iter().find(|word| word.starts_with(letter))?;
            word[1..].parse::<f64>().ok()
        };
        let from = at;
        for (value, letter) in at
            .iter_mut()
            .zip(['X', 'Y', 'Z'])
            .map(|(slot, letter)| (slot, value(letter)))
        {
            *value = letter.unwrap_or(*value);
        }
        if words.contains(&"M103") {
            hops.push(Hop {
                line: i + 1,
                from,
                to: at,
                height_mm: value('Q').unwrap_or(defaults.height_mm),
                tolerance_mm: value('P').unwrap_or(defaults.tolerance_mm),
                sets_acceleration: value('K').is_some(),
            });
        }
    }
    Some(hops)
}

/// How far each hop is bent to the side within its vertical parts, the greater of the two, in mm.
/// A hop that the trace does not hold has no row here.
#[must_use]
pub fn vertical_deviations_mm(hops: &[Hop], rows: &[TraceRow]) -> Vec<f64> {
    let points: Vec<[f64; 3]> = rows
        .iter()
        .map(|row| [row.pose[0], row.pose[1], row.pose[2]])
        .collect();
    let mut rest = &points[..];
    let mut found = Vec::new();
    for hop in hops {
        let is_at = |place: [f64; 3]| {
            move |point: &[f64; 3]| (0..3).all(|i| (point[i] - place[i]).abs() < ARRIVED_MM)
        };
        // from where it was last seen at the start to where it is first seen at the end
        let Some(first) = rest.iter().position(is_at(hop.from)) else {
            break;
        };
        let standing = rest[first..]
            .iter()
            .take_while(|point| is_at(hop.from)(point))
            .count();
        let begin = first + standing - 1;
        let Some(length) = rest[begin..].iter().position(is_at(hop.to)) else {
            break;
        };
        let way = &rest[begin..=begin + length];
        let backwards: Vec<_> = way.iter().rev().copied().collect();
        let up = bent_below(way, hop.from, hop.height_mm);
        let down = bent_below(&backwards, hop.to, hop.height_mm);
        found.push(f64::max(up, down));
        rest = &rest[begin + length..];
    }
    found
}

/// How far a way is from the vertical through a place until it has first risen by the height,
/// straight lines between its points.
fn bent_below(way: &[[f64; 3]], place: [f64; 3], height_mm: f64) -> f64 {
    let aside = |point: [f64; 3]| (point[0] - place[0]).hypot(point[1] - place[1]);
    let mut furthest = 0.0_f64;
    for pair in way.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        let end = place[2] + height_mm - RESOLUTION_MM;
        if after[2] >= end {
            let rise = after[2] - before[2];
            let part = if rise > 0.0 {
                ((end - before[2]) / rise).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let crossing: [f64; 3] =
                std::array::from_fn(|i| before[i] + part * (after[i] - before[i]));
            return furthest.max(aside(crossing));
        }
        furthest = furthest.max(aside(after));
    }
    furthest
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEFAULTS: HopDefaults = HopDefaults {
        height_mm: 20.0,
        tolerance_mm: 0.5,
    };

    fn rows(points: &[[f64; 3]]) -> Vec<TraceRow> {
        let row = |&[x, y, z]: &[f64; 3]| TraceRow {
            time_s: 0.0,
            pose: [x, y, z, 0.0],
        };
        points.iter().map(row).collect()
    }

    #[test]
    fn hops_are_read_with_their_words() {
        let program = "G21 G90\nG0 X10 Y0 Z5 ; start\nM103 X110 Z0 Q30 P0.2 K5000\nM103 Y7\nM2";
        let found = hops(program, DEFAULTS).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].from, found[0].to),
            ([10.0, 0.0, 5.0], [110.0, 0.0, 0.0])
        );
        assert_eq!((found[0].height_mm, found[0].tolerance_mm), (30.0, 0.2));
        assert_eq!((found[1].to, found[1].height_mm), ([110.0, 7.0, 0.0], 20.0));
        assert!(found[0].sets_acceleration && !found[1].sets_acceleration);
        assert_eq!(hops("G91\nM103 X1", DEFAULTS), None);
    }

    #[test]
    fn what_bends_within_the_height_is_found_at_either_end() {
        let program = "G0 X0 Y0 Z0\nM103 X100 Z10";
        let hops = hops(program, DEFAULTS).unwrap();
        let straight = [
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 20.0],
            [50.0, 0.0, 60.0],
            [100.0, 0.0, 30.0],
            [100.0, 0.0, 10.0],
        ];
        let found = vertical_deviations_mm(&hops, &rows(&straight))[0];
        assert!(found < 2.0 * RESOLUTION_MM);
        let mut early = straight;
        early[1] = [3.0, 4.0, 19.0];
        let found = vertical_deviations_mm(&hops, &rows(&early))[0];
        // at the height it is a 41st further along to the top
        let expected = (3.0 + 47.0 / 41.0_f64).hypot(4.0 - 4.0 / 41.0);
        assert!((found - expected).abs() < 2.0 * RESOLUTION_MM);
        let mut late = straight;
        late[3] = [100.0, 2.0, 30.0];
        let found = vertical_deviations_mm(&hops, &rows(&late))[0];
        assert!((found - 2.0).abs() < 2.0 * RESOLUTION_MM);
        assert!(vertical_deviations_mm(&hops, &rows(&straight[1..])).is_empty());
    }
}
