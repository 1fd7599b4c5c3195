//! The axes along which a mode swings, or a move goes.

/// Some of the axes X, Y and Z, or none.
///
/// A turn of the yaw counts as X and Y: its torque turns the arm, and what is gripped beside the
/// axis of the yaw pushes across.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisSet(u8);

impl AxisSet {
    /// No axis.
    pub const NONE: Self = Self(0);
    /// X and Y.
    pub const PLANE: Self = Self(0b011);
    /// Every axis.
    pub const ALL: Self = Self(0b111);

    /// Every set but the empty one, in the order of their numbers: all axes first.
    pub const SETS: [Self; 7] = [
        Self::ALL,
        Self(0b001),
        Self(0b010),
        Self(0b100),
        Self::PLANE,
        Self(0b101),
        Self(0b110),
    ];

    /// The axes of X, Y and Z that are said to be in it.
    #[must_use]
    pub const fn of([x, y, z]: [bool; 3]) -> Self {
        Self(x as u8 | (y as u8) << 1 | (z as u8) << 2)
    }

    /// The axes of both.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether both have an axis in common.
    #[must_use]
    pub const fn meets(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Its name in settings.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self.0 {
            0b001 => "x",
            0b010 => "y",
            0b011 => "xy",
            0b100 => "z",
            0b101 => "xz",
            0b110 => "yz",
            0b111 => "xyz",
            _ => "",
        }
    }

    /// The set of a name, upper or lower case; none is empty.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::SETS
            .into_iter()
            .find(|axes| axes.name().eq_ignore_ascii_case(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_has_a_name_of_its_axes() {
        for axes in AxisSet::SETS {
            assert_eq!(AxisSet::from_name(axes.name()), Some(axes));
            let has = |axis| axes.name().contains(axis);
            assert_eq!(AxisSet::of([has('x'), has('y'), has('z')]), axes);
        }
        assert_eq!(AxisSet::from_name("XY"), Some(AxisSet::PLANE));
        assert_eq!(AxisSet::from_name(""), None);
        assert_eq!(AxisSet::from_name("yx"), None);
    }
}
