//! Whether hops are vertical where they have to be, measured from a trace.

/// A command this far below a height has come to it, in mm: some bits of its resolution.
const RESOLUTION_MM: f64 = 1e-5;

/// What a program says of a hop, M103: the words beside its end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HopWords {
    /// Q, the height that is to be vertical, in mm.
    pub height_mm: Option<f64>,
    /// P, by how much it may be bent there, in mm.
    pub tolerance_mm: Option<f64>,
    /// Whether it says how fast, K.
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

/// A pick-and-place move, complete.
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

/// A hop and how it was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HopCheck {
    /// The hop.
    pub hop: Hop,
    /// How far it is bent to the side within its vertical parts, the greater of the two; infinite
    /// if the trace does not hold it.
    pub bent_mm: f64,
}

impl Hop {
    /// How far a way from its start to its end is bent within the vertical parts, in mm.
    #[must_use]
    pub fn bent_mm(&self, way: &[[f64; 3]]) -> f64 {
        let backwards: Vec<_> = way.iter().rev().copied().collect();
        let up = bent_below(way, self.from, self.height_mm);
        let down = bent_below(&backwards, self.to, self.height_mm);
        f64::max(up, down)
    }
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

    #[test]
    fn what_bends_within_the_height_is_found_at_either_end() {
        let hop = Hop {
            line: 2,
            from: [0.0; 3],
            to: [100.0, 0.0, 10.0],
            height_mm: 20.0,
            tolerance_mm: 0.5,
            sets_acceleration: false,
        };
        let straight = [
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 20.0],
            [50.0, 0.0, 60.0],
            [100.0, 0.0, 30.0],
            [100.0, 0.0, 10.0],
        ];
        assert!(hop.bent_mm(&straight) < 2.0 * RESOLUTION_MM);
        let mut early = straight;
        early[1] = [3.0, 4.0, 19.0];
        // at the height it is a 41st further along to the top
        let expected = (3.0 + 47.0 / 41.0_f64).hypot(4.0 - 4.0 / 41.0);
        assert!((hop.bent_mm(&early) - expected).abs() < 2.0 * RESOLUTION_MM);
        let mut late = straight;
        late[3] = [100.0, 2.0, 30.0];
        assert!((hop.bent_mm(&late) - 2.0).abs() < 2.0 * RESOLUTION_MM);
    }
}
