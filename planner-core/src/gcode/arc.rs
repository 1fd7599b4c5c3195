//! Geometry of arcs, in `f64` and with `libm` only: the same bits on every machine.

use core::f64::consts::TAU;

use super::error::Error;
use crate::path::Arc;

/// Unequal distances of start and target from the centre that always pass (Grbl's).
const CLOSES_MM: f64 = 0.005;

/// Unequal distances that never pass (Grbl's).
const NEVER_CLOSES_MM: f64 = 0.5;

/// Unequal distances that pass as a fraction of the radius (Grbl's).
const CLOSES_RELATIVE: f64 = 0.001;

/// A target less than this ahead of the start ends a full circle. It is Grbl's 5e-7 rad
/// at a radius of 10 mm, as a length: an angle would turn short arcs of large radius
/// into full circles.
const FULL_CIRCLE_MM: f64 = 5e-6;

/// Shortest radius: below it, the direction of an arc is rounding.
const MIN_RADIUS_MM: f64 = 0.001;

/// Longest radius: across 8 m, the range of X and Y, a line is less than 8 mm away.
const MAX_RADIUS_MM: f64 = 1e6;

/// Sense of rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rotation {
    /// G2.
    Clockwise,
    /// G3.
    CounterClockwise,
}

impl Rotation {
    const fn sign(self) -> f64 {
        match self {
            Self::Clockwise => -1.0,
            Self::CounterClockwise => 1.0,
        }
    }
}

/// Start of an arc and the way to its target, X and Y in mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    pub start_mm: [f64; 2],
    pub target_mm: [f64; 2],
}

impl Chord {
    fn delta_mm(&self) -> [f64; 2] {
        let ([x0, y0], [x1, y1]) = (self.start_mm, self.target_mm);
        [x1 - x0, y1 - y0]
    }

    /// An arc around a centre that lies at an offset (I, J) from the start. A target
    /// that is the start gives a full circle.
    ///
    /// # Errors
    /// 33: it does not close. 34: the radius is out of range.
    pub(super) fn around(&self, [i, j]: [f64; 2], rotation: Rotation) -> Result<Arc, Error> {
        let [dx, dy] = self.delta_mm();
        let radius_mm = length([i, j]);
        let end_radius_mm = length([dx - i, dy - j]);
        check_radius(radius_mm)?;
        let difference_mm = libm::fabs(end_radius_mm - radius_mm);
        let fraction_mm = CLOSES_RELATIVE * radius_mm;
        if difference_mm > NEVER_CLOSES_MM
            || (difference_mm > CLOSES_MM && difference_mm > fraction_mm)
        {
            let difference_mm = difference_mm as f32;
            return Err(Error::ArcDoesNotClose { difference_mm });
        }
        check_radius(end_radius_mm)?;
        // From the start's direction s = (-i, -j) to the target's s + d. The cross
        // product s × (s + d) is s × d, which keeps the digits of a short arc.
        let cross = j * dx - i * dy;
        let dot = i * (i - dx) + j * (j - dy);
        let forward_rad = libm::atan2(cross, dot) * rotation.sign();
        let sweep_rad = if forward_rad * radius_mm <= FULL_CIRCLE_MM {
            forward_rad + TAU
        } else {
            forward_rad
        };
        Ok(self.arc([i, j], [radius_mm, end_radius_mm], sweep_rad, rotation))
    }

    /// An arc of a radius R: up to half a turn, or more than that if R is negative.
    ///
    /// # Errors
    /// 33: the target is the start. 34: the radius is out of range or too short for
    /// the chord; one that is short by rounding (5 µm) gives half a turn.
    pub(super) fn of_radius(&self, r: f64, rotation: Rotation) -> Result<Arc, Error> {
        let delta = self.delta_mm();
        let chord_mm = length(delta);
        if chord_mm == 0.0 {
            return Err(Error::ArcWithoutChord);
        }
        let diameter_mm = 2.0 * libm::fabs(r);
        if chord_mm - diameter_mm > CLOSES_MM {
            return Err(Error::ArcTooSmall);
        }
        let diameter_mm = diameter_mm.max(chord_mm);
        let radius_mm = diameter_mm / 2.0;
        check_radius(radius_mm)?;
        // Twice the distance of the centre from the chord: √(D² - d²), without the
        // cancellation of the squares.
        let twice_height_mm = libm::sqrt((diameter_mm - chord_mm) * (diameter_mm + chord_mm));
        let short_rad = 2.0 * libm::atan2(chord_mm, twice_height_mm);
        let (sweep_rad, long) = if r < 0.0 {
            (TAU - short_rad, -1.0)
        } else {
            (short_rad, 1.0)
        };
        // The centre of a short counter-clockwise arc lies to the left of its chord.
        let left = twice_height_mm / chord_mm * rotation.sign() * long;
        let [dx, dy] = delta;
        let offset = [(dx - dy * left) / 2.0, (dy + dx * left) / 2.0];
        Ok(self.arc(offset, [radius_mm, radius_mm], sweep_rad, rotation))
    }

    fn arc(&self, [i, j]: [f64; 2], radii_mm: [f64; 2], sweep_rad: f64, rotation: Rotation) -> Arc {
        let [x, y] = self.start_mm;
        let [radius_mm, end_radius_mm] = radii_mm;
        Arc {
            centre_x_mm: x + i,
            centre_y_mm: y + j,
            radius_mm,
            end_radius_mm,
            start_angle_rad: libm::atan2(-j, -i),
            sweep_rad: sweep_rad * rotation.sign(),
        }
    }
}

/// Length of a vector: no overflow, since coordinates end at 1e11.
fn length([x, y]: [f64; 2]) -> f64 {
    libm::sqrt(x * x + y * y)
}

fn check_radius(radius_mm: f64) -> Result<(), Error> {
    if radius_mm < MIN_RADIUS_MM {
        Err(Error::ArcTooSmall)
    } else if radius_mm > MAX_RADIUS_MM {
        Err(Error::ArcTooLarge)
    } else {
        Ok(())
    }
}
