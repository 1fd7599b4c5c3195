//! The prefilters by name.

/// The prefilters by name: a shaper, boxes, or both in cascade.
///
/// Their numbers ([`Kind::ALL`]) are part of the language of programs: new ones come last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// No filter: the feedrate jumps.
    None,
    /// Two impulses half a damped period apart.
    Zv,
    /// ZV twice: three impulses over one damped period.
    Zvd,
    /// Three impulses that trade a residual at the nominal frequency for a wider band.
    Ei,
    /// A moving average over one damped period.
    Fir,
    /// FIR and ZV in cascade.
    FirZv,
    /// FIR and ZVD in cascade: the smoothest motion of the published ones.
    #[default]
    FirZvd,
    /// Three impulses over three quarters of a damped period: a null like that of ZV, wider.
    Mzv,
    /// ZV three times: four impulses over one and a half damped periods.
    Zvdd,
    /// Four impulses whose residual touches the one allowed beside the nominal frequency.
    TwoHumpEi,
    /// Five impulses whose residual touches the one allowed at the nominal frequency and beside.
    ThreeHumpEi,
    /// Two equal boxes: the S-curve of \[Li23\].
    SCurve,
    /// One box of any length: the acceleration of ADAI \[Li23\].
    Box,
    /// A list of impulses from the settings.
    Custom,
    /// FIR and EI in cascade.
    FirEi,
    /// FIR and MZV in cascade.
    FirMzv,
    /// FIR and ZVDD in cascade.
    FirZvdd,
    /// FIR and 2-hump EI in cascade.
    FirTwoHumpEi,
    /// FIR and 3-hump EI in cascade.
    FirThreeHumpEi,
    /// FIR and the list of impulses in cascade.
    FirCustom,
}

/// The impulses of a prefilter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shaper {
    None,
    /// ZV, so many times.
    Zv(u8),
    Mzv,
    Ei,
    TwoHumpEi,
    ThreeHumpEi,
    Custom,
}

/// The boxes of a prefilter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Boxes {
    None,
    /// Over one damped period.
    Period,
    /// Over the time that the settings give.
    Box,
    /// Two equal ones.
    SCurve,
}

impl Kind {
    /// Every prefilter, by its number.
    pub const ALL: [Self; 20] = [
        Self::None,
        Self::Zv,
        Self::Zvd,
        Self::Ei,
        Self::Fir,
        Self::FirZv,
        Self::FirZvd,
        Self::Mzv,
        Self::Zvdd,
        Self::TwoHumpEi,
        Self::ThreeHumpEi,
        Self::SCurve,
        Self::Box,
        Self::Custom,
        Self::FirEi,
        Self::FirMzv,
        Self::FirZvdd,
        Self::FirTwoHumpEi,
        Self::FirThreeHumpEi,
        Self::FirCustom,
    ];

    /// The name by which programs and settings call it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Zv => "zv",
            Self::Zvd => "zvd",
            Self::Ei => "ei",
            Self::Fir => "fir",
            Self::FirZv => "fir-zv",
            Self::FirZvd => "fir-zvd",
            Self::Mzv => "mzv",
            Self::Zvdd => "zvdd",
            Self::TwoHumpEi => "2hump-ei",
            Self::ThreeHumpEi => "3hump-ei",
            Self::SCurve => "s-curve",
            Self::Box => "box",
            Self::Custom => "custom",
            Self::FirEi => "fir-ei",
            Self::FirMzv => "fir-mzv",
            Self::FirZvdd => "fir-zvdd",
            Self::FirTwoHumpEi => "fir-2hump-ei",
            Self::FirThreeHumpEi => "fir-3hump-ei",
            Self::FirCustom => "fir-custom",
        }
    }

    /// The prefilter of that name, if there is one; upper and lower case are the same.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name().eq_ignore_ascii_case(name))
    }

    /// Whether it follows from the mode alone, not from a list of impulses.
    #[must_use]
    pub const fn follows_the_mode(self) -> bool {
        !matches!(self.parts().0, Shaper::Custom)
    }

    /// Whether it is a pure shaper, or nothing at all: the velocity jumps.
    #[must_use]
    pub const fn lets_velocity_jump(self) -> bool {
        matches!(self.parts().1, Boxes::None)
    }

    /// Its length in quarters of a damped period, where the settings give its boxes no other.
    pub(crate) const fn quarter_periods(self) -> u8 {
        let (shaper, boxes) = self.parts();
        let of_shaper = match shaper {
            Shaper::None | Shaper::Custom => 0,
            Shaper::Zv(times) => 2 * times,
            Shaper::Mzv => 3,
            Shaper::Ei => 4,
            Shaper::TwoHumpEi => 6,
            Shaper::ThreeHumpEi => 8,
        };
        let of_boxes = match boxes {
            Boxes::None => 0,
            Boxes::Period | Boxes::Box => 4,
            Boxes::SCurve => 8,
        };
        of_shaper + of_boxes
    }

    pub(super) const fn parts(self) -> (Shaper, Boxes) {
        match self {
            Self::None => (Shaper::None, Boxes::None),
            Self::Zv => (Shaper::Zv(1), Boxes::None),
            Self::Zvd => (Shaper::Zv(2), Boxes::None),
            Self::Ei => (Shaper::Ei, Boxes::None),
            Self::Fir => (Shaper::None, Boxes::Period),
            Self::FirZv => (Shaper::Zv(1), Boxes::Period),
            Self::FirZvd => (Shaper::Zv(2), Boxes::Period),
            Self::Mzv => (Shaper::Mzv, Boxes::None),
            Self::Zvdd => (Shaper::Zv(3), Boxes::None),
            Self::TwoHumpEi => (Shaper::TwoHumpEi, Boxes::None),
            Self::ThreeHumpEi => (Shaper::ThreeHumpEi, Boxes::None),
            Self::SCurve => (Shaper::None, Boxes::SCurve),
            Self::Box => (Shaper::None, Boxes::Box),
            Self::Custom => (Shaper::Custom, Boxes::None),
            Self::FirEi => (Shaper::Ei, Boxes::Period),
            Self::FirMzv => (Shaper::Mzv, Boxes::Period),
            Self::FirZvdd => (Shaper::Zv(3), Boxes::Period),
            Self::FirTwoHumpEi => (Shaper::TwoHumpEi, Boxes::Period),
            Self::FirThreeHumpEi => (Shaper::ThreeHumpEi, Boxes::Period),
            Self::FirCustom => (Shaper::Custom, Boxes::Period),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_programs_stay_and_names_differ() {
        // M100 P0 to P6 as they have always been
        let old = ["none", "zv", "zvd", "ei", "fir", "fir-zv", "fir-zvd"];
        for (kind, name) in Kind::ALL.into_iter().zip(old) {
            assert_eq!(kind.name(), name);
        }
        for (place, kind) in Kind::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, place);
            assert_eq!(Kind::from_name(kind.name()), Some(kind));
        }
    }
}
