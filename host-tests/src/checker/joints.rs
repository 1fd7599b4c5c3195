//! Joint peaks and settling, from columns of a trace.

use crate::vector::distance;

/// Largest joint velocities and accelerations, in the joints' units per s and s².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointPeaks {
    /// Largest magnitude of each joint's first difference.
    pub velocity: [f64; 4],
    /// Largest magnitude of each joint's second difference.
    pub acceleration: [f64; 4],
}

/// Peaks of the joints' positions, sampled every `step_s`, by differencing.
///
/// A resolution of ε shows as accelerations of up to 4 ε / step²: 0.06 rad/s² for
/// 15 nrad at 1 kHz.
#[must_use]
pub fn joint_peaks(joints: &[[f64; 4]], step_s: f64) -> JointPeaks {
    let mut peaks = JointPeaks::default();
    for axis in 0..4 {
        for pair in joints.windows(2) {
            let velocity = (pair[1][axis] - pair[0][axis]) / step_s;
            peaks.velocity[axis] = larger(peaks.velocity[axis], velocity);
        }
        for three in joints.windows(3) {
            let bend = three[0][axis] - 2.0 * three[1][axis] + three[2][axis];
            let acceleration = bend / (step_s * step_s);
            peaks.acceleration[axis] = larger(peaks.acceleration[axis], acceleration);
        }
    }
    peaks
}

/// The larger magnitude; infinite if the new value is not a number.
fn larger(peak: f64, value: f64) -> f64 {
    if value.is_nan() {
        return f64::INFINITY;
    }
    peak.max(value.abs())
}

/// Time after `stop_s` until the tool stays within `band_mm` of `target_mm`; `None`
/// if it is outside at the end of the record.
#[must_use]
pub fn settling_time_s(
    time_s: &[f64],
    tool_mm: &[[f64; 3]],
    target_mm: [f64; 3],
    stop_s: f64,
    band_mm: f64,
) -> Option<f64> {
    // Not `>`: a NaN is outside.
    let inside = |&tool: &[f64; 3]| distance(tool, target_mm) <= band_mm;
    let settled = match tool_mm.iter().rposition(|tool| !inside(tool)) {
        None => *time_s.first()?,
        Some(last) => *time_s.get(last + 1)?,
    };
    Some((settled - stop_s).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_of_a_sine() {
        let joints: Vec<_> = (0..1000)
            .map(|k| {
                let t = f64::from(k) * 1e-3;
                [0.5 * (10.0 * t).sin(), -3.0 * t, 0.0, 2.0 * t * t]
            })
            .collect();
        let found = joint_peaks(&joints, 1e-3);
        for (value, expected) in [
            (found.velocity[0], 5.0),
            (found.acceleration[0], 50.0),
            (found.velocity[1], 3.0),
            (found.acceleration[1], 0.0),
            (found.velocity[2], 0.0),
            (found.acceleration[3], 4.0),
        ] {
            assert!((value - expected).abs() < 1e-3, "{value} {expected}");
        }
        assert_eq!(
            joint_peaks(&[[0.0; 4], [f64::NAN; 4]], 1e-3).velocity[0],
            f64::INFINITY
        );
    }

    #[test]
    fn settling_is_the_last_entry_into_the_band() {
        let time: Vec<f64> = (0..10).map(|k| f64::from(k) * 0.1).collect();
        let tool: Vec<_> = [9.0, 2.0, 0.04, -0.06, 0.04, -0.02, 0.0, 0.0, 0.0, 0.0]
            .map(|x| [5.0 + x, 0.0, 0.0])
            .to_vec();
        let settle = |band, stop| settling_time_s(&time, &tool, [5.0, 0.0, 0.0], stop, band);
        assert!((settle(0.05, 0.1).unwrap() - 0.3).abs() < 1e-12);
        assert!((settle(0.07, 0.1).unwrap() - 0.1).abs() < 1e-12);
        assert_eq!(settle(0.05, 0.5), Some(0.0));
        assert_eq!(settle(100.0, 0.0), Some(0.0));
        let target = [6.0, 0.0, 0.0];
        assert_eq!(settling_time_s(&time, &tool, target, 0.0, 0.05), None);
        assert_eq!(
            settling_time_s(&time, &[[f64::NAN; 3]; 10], target, 0.0, 0.05),
            None
        );
    }
}
