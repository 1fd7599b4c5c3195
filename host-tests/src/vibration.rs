//! What an accelerometer at the tool reads: maximum and RMS, in motion and after.
//!
//! *Vibration* is the magnitude of the tool's acceleration, as the accelerometer of
//! Yeh26 measures it: the commanded acceleration and the mode's answer to it are
//! not told apart. Motion lasts until the command has stopped; what is left after
//! that is residual vibration alone.
//!
//! The ratios of the model's section 4 are ratios of these numbers, over the motion
//! and 3 s more, to those without a prefilter (the residual's to the residual
//! without a prefilter).

use crate::vector::norm;

/// Vibration over the motion and the time recorded after it, in mm/s².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vibration {
    /// Maximum over the whole record.
    pub max_mm_s2: f64,
    /// RMS over the whole record.
    pub rms_mm_s2: f64,
    /// Maximum while the command moves.
    pub motion_max_mm_s2: f64,
    /// RMS while the command moves.
    pub motion_rms_mm_s2: f64,
    /// Maximum after the command has stopped.
    pub residual_max_mm_s2: f64,
    /// RMS after the command has stopped.
    pub residual_rms_mm_s2: f64,
}

impl Vibration {
    /// Measures equally spaced accelerations of which the first `moving` belong to
    /// the motion. A part without samples counts as 0.
    #[must_use]
    pub fn measure(acceleration_mm_s2: &[[f64; 3]], moving: usize) -> Self {
        let (motion, rest) = acceleration_mm_s2.split_at(moving.min(acceleration_mm_s2.len()));
        Self {
            max_mm_s2: max(acceleration_mm_s2),
            rms_mm_s2: rms(acceleration_mm_s2),
            motion_max_mm_s2: max(motion),
            motion_rms_mm_s2: rms(motion),
            residual_max_mm_s2: max(rest),
            residual_rms_mm_s2: rms(rest),
        }
    }
}

/// How many samples of an equally spaced command belong to the motion: all up to
/// the one that first has the final value.
///
/// A plant that lags behind its command needs its latency added.
#[must_use]
pub fn moving_samples<T: PartialEq>(command: &[T]) -> usize {
    let changed = command.windows(2).rposition(|pair| pair[0] != pair[1]);
    changed.map_or(0, |i| i + 2)
}

/// Largest magnitude.
fn max(vectors: &[[f64; 3]]) -> f64 {
    vectors.iter().map(|&v| norm(v)).fold(0.0, f64::max)
}

/// Root of the mean squared magnitude.
fn rms(vectors: &[[f64; 3]]) -> f64 {
    if vectors.is_empty() {
        return 0.0;
    }
    let sum: f64 = vectors.iter().map(|&v| norm(v).powi(2)).sum();
    (sum / vectors.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_told_apart() {
        let record = [[3.0, 4.0, 0.0], [0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
        let found = Vibration::measure(&record, 2);
        assert_eq!((found.max_mm_s2, found.motion_max_mm_s2), (5.0, 5.0));
        assert_eq!(
            (found.residual_max_mm_s2, found.residual_rms_mm_s2),
            (1.0, 1.0)
        );
        assert!((found.rms_mm_s2 - (27.0_f64 / 4.0).sqrt()).abs() < 1e-15);
        assert!((found.motion_rms_mm_s2 - 12.5_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn motion_ends_with_the_last_change() {
        assert_eq!(moving_samples(&[1, 1, 2, 3, 3, 4, 4, 4]), 6);
        assert_eq!(moving_samples(&[1, 1]), 0);
        assert_eq!(moving_samples::<i32>(&[]), 0);
    }

    #[test]
    fn sine_has_its_rms() {
        let record: Vec<_> = (0..10_000)
            .map(|k| [0.0, 7.0 * (f64::from(k) * 0.1).sin(), 0.0])
            .collect();
        let found = Vibration::measure(&record, 0);
        assert!((found.residual_rms_mm_s2 - 7.0 / 2.0_f64.sqrt()).abs() < 5e-3);
        assert_eq!(found.motion_max_mm_s2, 0.0);
        assert_eq!(Vibration::measure(&[], 4), Vibration::default());
    }
}
