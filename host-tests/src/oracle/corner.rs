//! The corner: closest approach, cornering error, and the dwell that keeps a tolerance.

use super::path::Geometry;
use super::prefilter::Prefilter;
use crate::vector::{add, dot, norm, scale, sub, xyz};

/// Samples between two kinks when the closest approach is searched.
const SAMPLES: u32 = 64;

/// Halvings of a bracket: down to the last bit of a double.
const HALVINGS: u32 = 60;

/// Samples of `t_c` when the first crossing of the tolerance is searched.
const OVERLAP_SAMPLES: u32 = 64;

/// One side of a corner.
#[derive(Clone, Copy, Debug)]
pub struct Leg<'a> {
    /// The curve that ends, or begins, at the corner.
    pub geometry: Geometry,
    /// Feedrate in mm/s.
    pub feed: f64,
    /// Prefilter of the phase at the corner.
    pub prefilter: &'a Prefilter,
}

/// Two legs that meet; both are taken to be long enough to reach their feed.
///
/// Time here is local: 0 when the incoming leg begins to decelerate.
#[derive(Clone, Copy, Debug)]
pub struct Corner<'a> {
    /// The leg that ends at the corner.
    pub incoming: Leg<'a>,
    /// The leg that begins there.
    pub outgoing: Leg<'a>,
}

/// How a corner is taken; the names are those of Yeh26.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerSolution {
    /// `t_DEC1`: length of the deceleration in seconds.
    pub deceleration_s: f64,
    /// `t_c`: overlap of deceleration and acceleration in seconds.
    pub overlap_s: f64,
    /// `t_d`: dwell of the raw path in seconds.
    pub dwell_s: f64,
    /// `t_m`: when the corner point is closest, seconds.
    pub closest_s: f64,
    /// `e_c`: distance to the corner point then, millimetres.
    pub error_mm: f64,
}

impl<'a> Corner<'a> {
    /// Two lines that change direction by `angle_deg`.
    #[must_use]
    pub fn of_lines(
        angle_deg: f64,
        (incoming_feed, incoming): (f64, &'a Prefilter),
        (outgoing_feed, outgoing): (f64, &'a Prefilter),
    ) -> Self {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        Self {
            incoming: Leg {
                geometry: Geometry::Line {
                    from: [-1.0, 0.0, 0.0, 0.0],
                    to: [0.0; 4],
                },
                feed: incoming_feed,
                prefilter: incoming,
            },
            outgoing: Leg {
                geometry: Geometry::Line {
                    from: [0.0; 4],
                    to: [cos, sin, 0.0, 0.0],
                },
                feed: outgoing_feed,
                prefilter: outgoing,
            },
        }
    }

    /// Largest overlap that keeps `tolerance_mm`: `e_c(t_c) ≤ tolerance` exactly,
    /// `t_c` within 1e-15 s below the true root, or all of the deceleration.
    #[must_use]
    pub fn solve(&self, tolerance_mm: f64) -> CornerSolution {
        let full = self.incoming.prefilter.length_s();
        let keeps = |overlap: f64| self.at_overlap(overlap).error_mm <= tolerance_mm;
        let mut low = 0.0;
        for i in 1..=OVERLAP_SAMPLES {
            let mut high = full * f64::from(i) / f64::from(OVERLAP_SAMPLES);
            if keeps(high) {
                low = high;
                continue;
            }
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(low, high);
                *(if keeps(middle) { &mut low } else { &mut high }) = middle;
            }
            break;
        }
        self.at_overlap(low)
    }

    /// The closest approach, `e_c = min |P(t) − P_c|`, for a given overlap.
    ///
    /// Between kinks the distance is smooth: its stationary points are bracketed
    /// by samples of `P·Ṗ` and bisected. The kinks themselves, where the velocity
    /// may jump, are candidates too.
    #[must_use]
    pub fn at_overlap(&self, overlap_s: f64) -> CornerSolution {
        let end = self.incoming.prefilter.length_s();
        let dwell = end - overlap_s;
        let mut kinks: Vec<f64> = self
            .incoming
            .prefilter
            .kinks_s()
            .chain(self.outgoing.prefilter.kinks_s().map(|t| t + dwell))
            .filter(|&t| t > dwell && t < end)
            .collect();
        kinks.extend([dwell, end]);
        kinks.sort_by(f64::total_cmp);

        let mut best = (f64::INFINITY, dwell);
        let mut offer = |t: f64| {
            let miss = norm(self.offset(t, dwell));
            if miss < best.0 {
                best = (miss, t);
            }
        };
        for pair in kinks.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            offer(from);
            offer(to);
            // Strictly inside, so that no jump is met.
            let inside = |i: u32| from + (to - from) * (f64::from(i) + 0.5) / f64::from(SAMPLES);
            let mut low = from + (to - from) * 1e-9;
            for high in (0..SAMPLES).map(inside).chain([to - (to - from) * 1e-9]) {
                if self.approach(low, dwell) < 0.0 && self.approach(high, dwell) >= 0.0 {
                    let (mut a, mut b) = (low, high);
                    for _ in 0..HALVINGS {
                        let middle = f64::midpoint(a, b);
                        *(if self.approach(middle, dwell) < 0.0 {
                            &mut a
                        } else {
                            &mut b
                        }) = middle;
                    }
                    offer(f64::midpoint(a, b));
                }
                low = high;
            }
        }
        CornerSolution {
            deceleration_s: end,
            overlap_s,
            dwell_s: dwell,
            closest_s: best.1,
            error_mm: best.0,
        }
    }

    /// Path lengths: still to go to the corner, and gone since.
    fn lengths(&self, t: f64, dwell: f64) -> (f64, f64) {
        let (before, after) = (&self.incoming, &self.outgoing);
        // ∫ F (1 − S) from t to the end.
        let left = (before.prefilter.centroid_s() - t + before.prefilter.ramp(t)).max(0.0);
        let gone = if t > dwell {
            after.prefilter.ramp(t - dwell)
        } else {
            0.0
        };
        (before.feed * left, after.feed * gone)
    }

    /// `P(t) − P_c`.
    fn offset(&self, t: f64, dwell: f64) -> [f64; 3] {
        let (left, gone) = self.lengths(t, dwell);
        let (before, after) = (&self.incoming.geometry, &self.outgoing.geometry);
        let length = before.length();
        let back = sub(xyz(before.at(length - left)), xyz(before.at(length)));
        add(back, sub(xyz(after.at(gone)), xyz(after.at(0.0))))
    }

    /// `(P − P_c) · Ṗ`: negative while the corner comes closer.
    fn approach(&self, t: f64, dwell: f64) -> f64 {
        let (left, gone) = self.lengths(t, dwell);
        let (before, after) = (&self.incoming, &self.outgoing);
        let slow = before.feed * (1.0 - before.prefilter.step(t));
        let fast = after.feed * after.prefilter.step(t - dwell);
        let at = before.geometry.length() - left;
        let velocity = add(
            scale(slow, xyz(before.geometry.tangent(at))),
            scale(fast, xyz(after.geometry.tangent(gone))),
        );
        dot(self.offset(t, dwell), velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::path::corner_path;
    use std::f64::consts::PI;

    const FEED: f64 = 160.0;

    fn robot(name: &str) -> Prefilter {
        Prefilter::named(name, 6.34, 0.022).unwrap()
    }

    #[test]
    fn reproduces_tables_1_and_2_of_yeh26() {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/tests/published/corner_tables.csv"
        );
        let mut rows = 0;
        for record in csv::Reader::from_path(file).unwrap().records() {
            let record = record.unwrap();
            let number = |i: usize| record[i].parse::<f64>().unwrap();
            let filter = robot(&record[0].to_lowercase());
            let side = (FEED, &filter);
            let found = Corner::of_lines(number(1), side, side).solve(number(2));
            assert!(found.error_mm <= number(2));
            // Columns t_DEC1, t_m, t_c, t_d; published bounds from the model's section 4.
            let values = [
                (found.deceleration_s, 0.5e-3),
                (found.closest_s, 0.5e-3),
                (found.overlap_s, 1.0e-3),
                (found.dwell_s, 0.75e-3),
            ];
            for (column, (value, bound)) in values.into_iter().enumerate() {
                assert!(
                    (value - number(7 + column)).abs() < 1e-8,
                    "{record:?}: {found:?}"
                );
                let excepted = column == 1 && !record[11].is_empty();
                let published = (value - number(3 + column)).abs() <= bound + 1e-9;
                assert!(published || excepted, "{record:?}: {found:?}");
            }
            rows += 1;
        }
        assert_eq!(rows, 40);
    }

    #[test]
    fn fir_has_a_closed_form() {
        let fir = robot("fir");
        let period = fir.length_s();
        for angle in [10.0_f64, 45.0, 90.0, 135.0, 179.0, 180.0] {
            for tolerance in [0.01, 0.1, 0.5] {
                let found = Corner::of_lines(angle, (FEED, &fir), (FEED, &fir)).solve(tolerance);
                let chord = (2.0 * (1.0 - angle.to_radians().cos())).sqrt();
                let overlap = (tolerance * 8.0 * period / (FEED * chord))
                    .sqrt()
                    .min(period);
                assert!(
                    (found.overlap_s - overlap).abs() < 1e-12,
                    "{angle} {found:?}"
                );
                let middle = found.dwell_s + overlap / 2.0;
                assert!((found.closest_s - middle).abs() < 1e-8, "{angle} {found:?}");
            }
        }
    }

    #[test]
    fn li23_double_box_has_a_closed_form() {
        // [Li23]: ε = |J1 u1 − J2 u2| T_ol³ / 48, at equal feeds, J = V / T_rr².
        let rise = 0.125;
        let filter = Prefilter::new(&[(0.0, 1.0)], &[rise, rise]);
        for angle in [20.0_f64, 60.0, 120.0] {
            let found = Corner::of_lines(angle, (150.0, &filter), (150.0, &filter)).solve(0.5);
            let jerk = 150.0 / (rise * rise);
            let change = 2.0 * jerk * (angle.to_radians() / 2.0).sin();
            let expected = (48.0 * 0.5 / change).cbrt();
            assert!(
                (found.overlap_s - expected).abs() < 1e-11,
                "{angle} {found:?}"
            );
        }
    }

    #[test]
    fn sharp_shaper_corners_are_closest_at_the_jump() {
        let k = (-0.022 * PI / (1.0_f64 - 0.022 * 0.022).sqrt()).exp();
        for (name, p, limit) in [
            ("zv", k / (1.0 + k), 158.940),
            ("zvd", k * k / (1.0 + k).powi(2), 150.560),
        ] {
            let filter = robot(name);
            let solve = |angle: f64| Corner::of_lines(angle, (FEED, &filter), (FEED, &filter));
            let sharp = solve(limit + 0.01).solve(0.3);
            assert!((sharp.closest_s - sharp.dwell_s).abs() < 1e-15);
            assert!((sharp.error_mm - FEED * p * sharp.overlap_s).abs() < 1e-12);
            let blunt = solve(limit - 0.01).solve(0.3);
            assert!(blunt.closest_s > blunt.dwell_s + 1e-8);
        }
    }

    #[test]
    fn shallow_corners_need_no_dwell() {
        let filter = robot("fir-zvd");
        let solve =
            |angle: f64| Corner::of_lines(angle, (FEED, &filter), (FEED, &filter)).solve(0.5);
        assert_eq!(solve(6.05).dwell_s, 0.0);
        assert!(solve(6.07).dwell_s > 0.0);
        let straight = solve(0.0);
        assert!(straight.dwell_s == 0.0 && straight.error_mm < 1e-9);
    }

    #[test]
    fn error_is_the_minimum_over_a_dense_scan() {
        let (a, b) = (robot("fir-zv"), robot("zvd"));
        let mut corner = Corner::of_lines(0.0, (FEED, &a), (70.0, &b));
        let curves = corner_path();
        for (incoming, outgoing) in [(0, 1), (1, 2), (2, 3), (3, 0), (0, 0)] {
            corner.incoming.geometry = curves[incoming];
            corner.outgoing.geometry = curves[outgoing];
            let found = corner.solve(0.5);
            assert!(found.error_mm <= 0.5 && found.error_mm > 0.5 - 1e-9);
            let scan = (0..200_000)
                .map(|i| found.deceleration_s * f64::from(i) / 2e5)
                .map(|t| norm(corner.offset(t, found.dwell_s)))
                .fold(f64::INFINITY, f64::min);
            assert!(scan >= found.error_mm - 1e-12 && scan < found.error_mm + 2e-3);
        }
    }

    #[test]
    fn arc_biases_the_tangent_formula() {
        // Section 3, point 6: some 0.4 % at R 45 mm.
        let filter = robot("fir-zvd");
        let curves = corner_path();
        let lines = Corner::of_lines(66.0375, (FEED, &filter), (FEED, &filter));
        let overlap = lines.solve(0.5).overlap_s;
        let mut bent = lines;
        bent.incoming.geometry = curves[0];
        bent.outgoing.geometry = curves[1];
        let bias = bent.at_overlap(overlap).error_mm / 0.5 - 1.0;
        assert!(bias.abs() > 1e-3 && bias.abs() < 6e-3, "{bias}");
    }

    #[test]
    fn no_prefilter_stops_on_the_corner() {
        let none = robot("none");
        let found = Corner::of_lines(90.0, (FEED, &none), (FEED, &none)).solve(0.5);
        assert_eq!(
            (found.overlap_s, found.dwell_s, found.error_mm),
            (0.0, 0.0, 0.0)
        );
    }
}
