//! The boxes of all prefilters that may be in force.

/// The first two boxes of some prefilters: how short and how long each of them is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxRange {
    /// The shortest first box and the shortest second one, in s; 0 if a prefilter has none.
    pub shortest_s: [f32; 2],
    /// The longest ones.
    pub longest_s: [f32; 2],
}

impl BoxRange {
    /// The boxes of one prefilter, the longest first.
    #[must_use]
    pub fn of(boxes_s: &[f64]) -> Self {
        let nth = |place: usize| boxes_s.get(place).map_or(0.0, |length_s| *length_s as f32);
        let both_s = [nth(0), nth(1)];
        Self {
            shortest_s: both_s,
            longest_s: both_s,
        }
    }

    /// With those of another prefilter.
    pub fn add(&mut self, boxes_s: &[f64]) {
        let other = Self::of(boxes_s);
        for place in 0..2 {
            self.shortest_s[place] = self.shortest_s[place].min(other.shortest_s[place]);
            self.longest_s[place] = self.longest_s[place].max(other.longest_s[place]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_box_has_a_range_of_its_own() {
        let mut range = BoxRange::of(&[0.1, 0.02]);
        range.add(&[0.05, 0.03, 0.01]);
        assert_eq!(range.shortest_s, [0.05, 0.02]);
        assert_eq!(range.longest_s, [0.1, 0.03]);
        range.add(&[0.2]);
        assert_eq!(range.shortest_s, [0.05, 0.0]);
        assert_eq!(range.longest_s, [0.2, 0.03]);
    }
}
