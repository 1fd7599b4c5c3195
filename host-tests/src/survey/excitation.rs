//! The move that excites the mode.

use std::fmt;
use std::str::FromStr;

/// Parts of the move's length, one after the other, until a record can be trusted. Start and stop
/// cancel where the mode swings a whole number of times meanwhile; with 1 to 5 swings, one of
/// these is 0.3 off a whole number at the least.
pub const LENGTHS: [f64; 3] = [1.0, 0.85, 0.7];

/// A relative move in the plane, as the words `X40 F9600` give it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excitation {
    /// Along X and Y in mm.
    pub way_mm: [f64; 2],
    /// In mm/min.
    pub feed_mm_min: f64,
}

/// Why words are no test move of a survey.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "on a grid the test move has X or Y in mm and F in mm/min, and is 1 mm long at the least: give it as in \"X40 F9600\""
)]
pub struct ExcitationError;

impl FromStr for Excitation {
    type Err = ExcitationError;

    fn from_str(text: &str) -> Result<Self, ExcitationError> {
        let mut words = [None; 3];
        let compact: String = text.split_ascii_whitespace().collect();
        let mut rest = compact.as_str();
        while let Some(letter) = rest.chars().next() {
            let place = "XYF".find(letter.to_ascii_uppercase());
            let place = place.ok_or(ExcitationError)?;
            rest = &rest[letter.len_utf8()..];
            let end = rest.find(|c: char| c.is_ascii_alphabetic());
            let (number, behind) = rest.split_at(end.unwrap_or(rest.len()));
            let value: f64 = number.parse().map_err(|_| ExcitationError)?;
            if words[place].replace(value).is_some() || !value.is_finite() {
                return Err(ExcitationError);
            }
            rest = behind;
        }
        let [x, y, feed] = words;
        let way_mm = [x.unwrap_or(0.0), y.unwrap_or(0.0)];
        let feed_mm_min = feed.filter(|feed| *feed > 0.0).ok_or(ExcitationError)?;
        if way_mm[0].hypot(way_mm[1]) < 1.0 {
            return Err(ExcitationError);
        }
        Ok(Self {
            way_mm,
            feed_mm_min,
        })
    }
}

impl Excitation {
    /// The ways by which a node may be come to, a part of the length: along, against, across.
    pub fn ways(&self, part: f64) -> [[f64; 2]; 4] {
        let [x, y] = self.way_mm.map(|way| part * way);
        [[x, y], [-x, -y], [-y, x], [y, -x]]
    }
}

impl fmt::Display for Excitation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.way_mm;
        write!(f, "X{x} Y{y} F{}", self.feed_mm_min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_in_any_order_are_a_move() {
        let expected = Excitation {
            way_mm: [40.0, -3.5],
            feed_mm_min: 9600.0,
        };
        for text in ["X40 Y-3.5 F9600", "f9600y-3.5x40", " X 40F9600 Y-3.5 "] {
            assert_eq!(text.parse(), Ok(expected), "{text}");
        }
        assert_eq!("Y40F1".parse::<Excitation>().unwrap().way_mm, [0.0, 40.0]);
        for text in [
            "",
            "X40",
            "X40 F0",
            "X0.5 F9600",
            "X40 X40 F1",
            "Z40 F1",
            "X F1",
            "XinfF1",
            "Ü",
        ] {
            assert_eq!(text.parse::<Excitation>(), Err(ExcitationError), "{text}");
        }
    }

    #[test]
    fn one_length_is_far_from_whole_swings() {
        for swings in 1..=5 {
            let off = LENGTHS.map(|part| {
                let swings = part * f64::from(swings);
                (swings - swings.round()).abs()
            });
            assert!(
                off.into_iter().fold(0.0, f64::max) > 0.29,
                "{swings}: {off:?}"
            );
        }
    }
}
