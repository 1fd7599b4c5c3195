//! What a trace did, measured against its program.

use super::hops::{HopCheck, HopDefaults};
use super::matching::{Match, Place, distance_to_chord, match_in_order};
use super::program::Program;
use crate::vector::{add, distance, norm, scale, sub, xyz};

/// Smallest reach along the path, millimetres, in which a corner's passage is looked
/// for where the adjoining blocks are shorter.
const CORNER_WINDOW_MM: f64 = 2.0;

/// One row of a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TraceRow {
    /// Time in seconds.
    pub time_s: f64,
    /// Commanded pose `[x, y, z, c]`, mm and degrees.
    pub pose: [f64; 4],
}

/// What the program leaves to the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckOptions {
    /// Speed of rapids in mm/s.
    pub rapid_mm_s: f64,
    /// Corner tolerance where the program sets none, millimetres; infinite where the robot's
    /// corners are passed by overlap.
    pub tolerance_mm: f64,
    /// How far along the path the feedrate of a faster block may still be seen,
    /// millimetres: at least feedrate times prefilter length.
    pub feed_window_mm: f64,
    /// What hops do where the program does not say.
    pub hops: HopDefaults,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self {
            rapid_mm_s: 160.0,
            tolerance_mm: 0.5,
            feed_window_mm: 60.0,
            hops: HopDefaults {
                height_mm: 50.0,
                tolerance_mm: 0.5,
            },
        }
    }
}

/// How a corner was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerCheck {
    /// Line of the block that ends there.
    pub line: usize,
    /// The corner.
    pub point_mm: [f64; 3],
    /// Change of direction in degrees, 0 straight on.
    pub angle_deg: f64,
    /// How far the less extended of its two segments goes away from it. Where that is within
    /// the tolerance, the passage cannot be told from those of the corners beside it.
    pub shorter_side_mm: f64,
    /// Tolerance in force; infinite where the overlap is given instead.
    pub tolerance_mm: f64,
    /// Distance of the trace's polyline to the corner as it passes.
    pub error_mm: f64,
    /// When it is closest: the row before.
    pub time_s: f64,
}

/// The checker's findings.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// From the first change of the command to its last, seconds.
    pub cycle_time_s: f64,
    /// Largest distance of a commanded point to its place on the path.
    pub max_path_deviation_mm: f64,
    /// Largest distance of a point of the path to the trace: what was left out.
    pub max_missed_mm: f64,
    /// Corners in order.
    pub corners: Vec<CornerCheck>,
    /// Hops in order.
    pub hops: Vec<HopCheck>,
    /// Largest speed of the command.
    pub peak_speed_mm_s: f64,
    /// Largest excess over the feedrates nearby; negative when all is slower.
    pub feed_excess_mm_s: f64,
    /// Distance of the last commanded point to the program's end.
    pub drift_mm: f64,
    /// Difference of the last commanded yaw to the program's end.
    pub drift_deg: f64,
}

impl Report {
    /// Largest corner error.
    #[must_use]
    pub fn max_corner_error_mm(&self) -> f64 {
        self.corners.iter().map(|c| c.error_mm).fold(0.0, f64::max)
    }

    /// What broke a promise by more than the allowances, in words; empty if nothing did.
    ///
    /// Corners and hops are judged by their own tolerance, path deviation and coverage by the
    /// widest. A trace knows nothing between its rows: where the velocity jumps (ZV,
    /// ZVD, EI, none) its polyline cuts a corner by up to half a row's travel more
    /// than the continuous command does.
    #[must_use]
    pub fn violations(&self, allowance_mm: f64, allowance_mm_s: f64) -> Vec<String> {
        let mut found = Vec::new();
        // Written so that a NaN is a violation.
        let mut demand = |holds: bool, what: String| {
            if !holds {
                found.push(what);
            }
        };
        for corner in &self.corners {
            demand(
                corner.error_mm <= corner.tolerance_mm + allowance_mm,
                format!(
                    "corner of line {} missed by {:.4} mm, tolerance {:.4} mm",
                    corner.line, corner.error_mm, corner.tolerance_mm
                ),
            );
        }
        for HopCheck { hop, bent_mm } in &self.hops {
            demand(
                *bent_mm <= hop.tolerance_mm + allowance_mm,
                format!(
                    "hop of line {} bent by {bent_mm:.4} mm, tolerance {:.4} mm",
                    hop.line, hop.tolerance_mm
                ),
            );
        }
        let widest = self
            .corners
            .iter()
            .map(|c| c.tolerance_mm)
            .fold(0.0, f64::max);
        for (what, value) in [
            ("path left", self.max_path_deviation_mm),
            ("path not covered", self.max_missed_mm),
        ] {
            demand(
                value <= widest + allowance_mm,
                format!("{what} by {value:.4} mm"),
            );
        }
        demand(
            self.feed_excess_mm_s <= allowance_mm_s,
            format!("feedrate exceeded by {:.4} mm/s", self.feed_excess_mm_s),
        );
        demand(
            self.drift_mm <= allowance_mm && self.drift_deg <= allowance_mm,
            format!(
                "end missed by {:.6} mm, {:.6}°",
                self.drift_mm, self.drift_deg
            ),
        );
        found
    }
}

/// The program's path as a polyline.
pub(super) struct Outline {
    pub(super) points: Vec<[f64; 3]>,
    /// Path length at each point.
    lengths: Vec<f64>,
    /// For each block that translates: its number and the points of its two ends.
    pub(super) ends: Vec<(usize, usize, usize)>,
}

impl Outline {
    pub(super) fn new(program: &Program) -> Self {
        let mut points = vec![xyz(program.start)];
        let mut lengths = vec![0.0];
        let mut ends = Vec::new();
        for (i, block) in program.blocks.iter().enumerate() {
            let first = points.len() - 1;
            for point in block.points() {
                lengths
                    .push(lengths[lengths.len() - 1] + distance(points[points.len() - 1], point));
                points.push(point);
            }
            if points.len() - 1 > first {
                ends.push((i, first, points.len() - 1));
            }
        }
        Self {
            points,
            lengths,
            ends,
        }
    }

    fn length_at(&self, (chord, share): Place) -> f64 {
        let from = self.lengths[chord];
        let to = self.lengths.get(chord + 1).copied().unwrap_or(from);
        from + share * (to - from)
    }
}

/// Measures a trace against a program without hops. Distances of an empty trace are infinite.
pub(super) fn check(program: &Program, trace: &[TraceRow], options: &CheckOptions) -> Report {
    let outline = Outline::new(program);
    let points: Vec<_> = trace.iter().map(|row| xyz(row.pose)).collect();
    let Match {
        distance_mm,
        places,
    } = match_in_order(&points, &outline.points);
    let missed = match_in_order(&outline.points, &points).distance_mm;
    let progress: Vec<f64> = places
        .iter()
        .map(|&place| outline.length_at(place))
        .collect();
    let end = program.end();
    let last = trace.last().map_or([f64::INFINITY; 4], |row| row.pose);
    let (peak, excess) = speeds(program, &outline, trace, &progress, options);
    Report {
        cycle_time_s: cycle_time_s(trace),
        max_path_deviation_mm: distance_mm,
        max_missed_mm: missed,
        corners: corners(program, &outline, trace, (&progress, distance_mm), options),
        hops: Vec::new(),
        peak_speed_mm_s: peak,
        feed_excess_mm_s: excess,
        drift_mm: distance(xyz(last), xyz(end)),
        drift_deg: (last[3] - end[3]).abs(),
    }
}

/// From the row before the first change to the row of the last.
pub(super) fn cycle_time_s(trace: &[TraceRow]) -> f64 {
    let changes = |pair: &[TraceRow]| pair[0].pose != pair[1].pose;
    match (
        trace.windows(2).position(changes),
        trace.windows(2).rposition(changes),
    ) {
        (Some(first), Some(last)) => trace[last + 1].time_s - trace[first].time_s,
        _ => 0.0,
    }
}

fn corners(
    program: &Program,
    outline: &Outline,
    trace: &[TraceRow],
    (progress, reach_mm): (&[f64], f64),
    options: &CheckOptions,
) -> Vec<CornerCheck> {
    let mut found = Vec::new();
    for pair in outline.ends.windows(2) {
        let ((block, first, corner), (next, _, last)) = (pair[0], pair[1]);
        let point = outline.points[corner];
        let at = outline.lengths[corner];
        // From half-way before to half-way after, and one row more on either side. A matched
        // place may be ahead or behind by as much as the match reaches.
        let half = |length: f64| (length / 2.0).max(CORNER_WINDOW_MM) + reach_mm;
        let before = half(at - outline.lengths[first]);
        let after = half(outline.lengths[last] - at);
        let from = progress
            .partition_point(|&s| s < at - before)
            .saturating_sub(1);
        let to = (progress.partition_point(|&s| s <= at + after) + 1).min(progress.len());
        let (error_mm, time_s) = trace[from.min(to)..to]
            .windows(2)
            .map(|rows| {
                let miss = distance_to_chord(point, xyz(rows[0].pose), xyz(rows[1].pose));
                (miss, rows[0].time_s)
            })
            .fold((f64::INFINITY, 0.0), |a, b| if b.0 < a.0 { b } else { a });
        let tangent = |i: usize, j: usize| {
            let chord = sub(outline.points[j], outline.points[i]);
            scale(1.0 / norm(chord), chord)
        };
        let (u, v) = (tangent(corner - 1, corner), tangent(corner, corner + 1));
        let extent = |from: usize, to: usize| {
            let side = outline.points[from..=to].iter();
            side.map(|&other| distance(point, other))
                .fold(0.0, f64::max)
        };
        found.push(CornerCheck {
            line: program.blocks[block].line,
            point_mm: point,
            angle_deg: norm(sub(v, u)).atan2(norm(add(u, v))).to_degrees() * 2.0,
            tolerance_mm: program.blocks[next]
                .tolerance_mm
                .unwrap_or(options.tolerance_mm),
            shorter_side_mm: extent(first, corner).min(extent(corner, last)),
            error_mm,
            time_s,
        });
    }
    found
}

/// Peak speed, and the largest excess over the fastest block within the window.
fn speeds(
    program: &Program,
    outline: &Outline,
    trace: &[TraceRow],
    progress: &[f64],
    options: &CheckOptions,
) -> (f64, f64) {
    let (mut peak, mut excess) = (0.0_f64, f64::NEG_INFINITY);
    for (i, rows) in trace.windows(2).enumerate() {
        let moved = distance(xyz(rows[0].pose), xyz(rows[1].pose));
        let speed = moved / (rows[1].time_s - rows[0].time_s);
        if moved == 0.0 {
            continue;
        }
        let Some(&at) = progress.get(i) else {
            return (f64::INFINITY, f64::INFINITY);
        };
        let low = at - options.feed_window_mm;
        let high = at + options.feed_window_mm;
        let begin = outline
            .ends
            .partition_point(|&(_, _, to)| outline.lengths[to] < low);
        let feed = outline.ends[begin..]
            .iter()
            .take_while(|&&(_, from, _)| outline.lengths[from] <= high)
            .map(|&(block, ..)| {
                program.blocks[block]
                    .feed_mm_s
                    .unwrap_or(options.rapid_mm_s)
            })
            .fold(0.0, f64::max);
        // Time that stands still or runs back is infinitely fast.
        let speed = if speed > 0.0 { speed } else { f64::INFINITY };
        peak = peak.max(speed);
        excess = excess.max(speed - feed);
    }
    (peak, excess)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::{NAMES, Path, Prefilter, path::corner_path};

    const OPTIONS: CheckOptions = CheckOptions {
        rapid_mm_s: 160.0,
        tolerance_mm: 0.5,
        feed_window_mm: 60.0,
        hops: HopDefaults {
            height_mm: 50.0,
            tolerance_mm: 0.5,
        },
    };

    fn program() -> Program {
        Program::parse(include_str!("../../programs/corner-path.gcode")).unwrap()
    }

    /// The oracle's command at 1 kHz, standing still for 50 ms at either end.
    fn oracle_trace(name: &str, tolerance_mm: f64) -> (Vec<TraceRow>, f64) {
        let filter = Prefilter::named(name, 6.34, 0.022).unwrap();
        let path = Path::uniform(&corner_path(), 160.0, &filter, tolerance_mm);
        let schedule = path.schedule();
        let cycle = schedule.cycle_time_s();
        let rows = (0..(cycle * 1e3) as u32 + 100)
            .map(|k| TraceRow {
                time_s: f64::from(k) * 1e-3,
                pose: schedule.pose(f64::from(k) * 1e-3 - 0.05),
            })
            .collect();
        (rows, cycle)
    }

    /// Straight lines at constant speed, one row a millisecond.
    fn walk(corners: &[[f64; 2]], speed_mm_s: f64) -> Vec<TraceRow> {
        let mut poses = vec![[corners[0][0], corners[0][1], 0.0, 0.0]];
        for pair in corners.windows(2) {
            let (dx, dy) = (pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
            let count = (dx.hypot(dy) / speed_mm_s * 1e3).round() as u32;
            poses.extend((1..=count).map(|i| {
                let u = f64::from(i) / f64::from(count);
                [pair[0][0] + u * dx, pair[0][1] + u * dy, 0.0, 0.0]
            }));
        }
        poses
            .into_iter()
            .zip(0u32..)
            .map(|(pose, k)| TraceRow {
                time_s: f64::from(k) * 1e-3,
                pose,
            })
            .collect()
    }

    #[test]
    fn oracle_passes_with_every_prefilter() {
        for name in NAMES {
            // custom without a list of impulses is none, too
            let is_filter = Prefilter::named(name, 6.34, 0.022).unwrap().length_s() > 0.0;
            for tolerance_mm in [0.0, 0.5] {
                let options = CheckOptions {
                    tolerance_mm,
                    ..OPTIONS
                };
                let (trace, cycle) = oracle_trace(name, tolerance_mm);
                let report = check(&program(), &trace, &options);
                // Rows 1 ms apart cut an unfiltered corner, and hardly a rounded one.
                let allowance = if tolerance_mm > 0.0 && is_filter {
                    0.003
                } else {
                    0.06
                };
                assert_eq!(
                    report.violations(allowance, 1e-6),
                    [""; 0],
                    "{name} {report:?}"
                );
                assert!((report.cycle_time_s - cycle).abs() < 2e-3);
                assert!(report.drift_mm < 1e-11 && report.drift_deg == 0.0);
                assert!((report.peak_speed_mm_s - 160.0).abs() < 1e-6);
                let angles: Vec<_> = report.corners.iter().map(|c| c.angle_deg).collect();
                for (found, expected) in angles.iter().zip([66.04, 47.92, 158.96, 90.0]) {
                    assert!((found - expected).abs() < 0.05, "{angles:?}");
                }
                if tolerance_mm > 0.0 && is_filter {
                    for corner in &report.corners {
                        assert!(
                            (0.45..0.503).contains(&corner.error_mm),
                            "{name} {corner:?}"
                        );
                    }
                    // Section 3, point 7: some e_c cos(β/2), largest at the bluntest.
                    assert!(
                        (0.43..0.458).contains(&report.max_path_deviation_mm),
                        "{name}"
                    );
                }
            }
        }
        // Smooth enough that the rows resolve it: the tolerance is used to the full.
        let report = check(&program(), &oracle_trace("fir-zvd", 0.5).0, &OPTIONS);
        for corner in &report.corners {
            assert!((corner.error_mm - 0.5).abs() < 2e-4, "{corner:?}");
        }
    }

    #[test]
    fn a_wider_corner_a_left_path_and_a_missed_end_fail() {
        let (trace, _) = oracle_trace("fir-zvd", 0.52);
        let found = check(&program(), &trace, &OPTIONS).violations(0.01, 1e-6);
        assert_eq!(
            found
                .iter()
                .filter(|v| v.starts_with("corner of line"))
                .count(),
            4
        );

        let (good, _) = oracle_trace("fir-zvd", 0.5);
        let mut left = good.clone();
        left[500].pose[2] = 0.6;
        let report = check(&program(), &left, &OPTIONS);
        assert!((report.max_path_deviation_mm - 0.6).abs() < 1e-6);
        let found = report.violations(0.01, 1e-6);
        assert!(
            found.iter().any(|v| v.starts_with("path left")),
            "{found:?}"
        );
        assert!(found.iter().any(|v| v.starts_with("feedrate")), "{found:?}");

        let mut drifted = good.clone();
        drifted.iter_mut().for_each(|row| row.pose[1] += 0.02);
        let report = check(&program(), &drifted, &OPTIONS);
        assert!((report.drift_mm - 0.02).abs() < 1e-9);
        assert!(!report.violations(0.01, 1e-6).is_empty());

        let cut = &good[..good.len() - 400];
        let found = check(&program(), cut, &OPTIONS).violations(0.01, 1e-6);
        assert!(
            found.iter().any(|v| v.starts_with("end missed")),
            "{found:?}"
        );
        assert!(
            !check(&program(), &[], &OPTIONS)
                .violations(0.01, 1.0)
                .is_empty()
        );
        let mut nan = good;
        nan[700].pose[0] = f64::NAN;
        assert!(
            !check(&program(), &nan, &OPTIONS)
                .violations(0.01, 1.0)
                .is_empty()
        );
    }

    #[test]
    fn a_corner_error_of_known_size_is_measured() {
        let program = Program::parse("G0 X0 Y0\nG64 P0.3 G1 X50 F6000\nY50\nX0\nY0").unwrap();
        // The first corner cut along the diagonal, 1/√2 mm from its point.
        let trace = walk(
            &[
                [0.0, 0.0],
                [49.0, 0.0],
                [50.0, 1.0],
                [50.0, 50.0],
                [0.0, 50.0],
                [0.0, 0.0],
            ],
            100.0,
        );
        let report = check(&program, &trace, &OPTIONS);
        let errors: Vec<_> = report.corners.iter().map(|c| c.error_mm).collect();
        assert!((errors[0] - 0.5_f64.sqrt()).abs() < 1e-9, "{errors:?}");
        assert!(errors[1] < 1e-12 && errors[2] < 1e-12);
        assert!(
            (report.max_path_deviation_mm - 0.5).abs() < 0.02,
            "{report:?}"
        );
        assert!((report.max_missed_mm - 0.5_f64.sqrt()).abs() < 1e-6);
        assert_eq!(report.corners[0].tolerance_mm, 0.3);
        assert!((report.cycle_time_s - 1.994).abs() < 2e-3);
        assert!((report.peak_speed_mm_s - 101.0).abs() < 1.1);
    }

    #[test]
    fn closed_and_crossing_paths_are_judged_in_order() {
        // A square run twice: its corners are passed twice, the second time badly.
        let square = [
            [0.0, 0.0],
            [30.0, 0.0],
            [30.0, 30.0],
            [0.0, 30.0],
            [0.0, 0.0],
        ];
        let text = "G0 X0 Y0\nG1 X30 F6000\nY30\nX0\nY0\nX30\nY30\nX0\nY0";
        let program = Program::parse(text).unwrap();
        let mut twice = square.to_vec();
        twice.extend([
            [28.0, 0.0],
            [30.0, 2.0],
            [30.0, 30.0],
            [0.0, 30.0],
            [0.0, 0.0],
        ]);
        let report = check(&program, &walk(&twice, 100.0), &OPTIONS);
        let bad: Vec<_> = report
            .corners
            .iter()
            .enumerate()
            .filter(|(_, c)| c.error_mm > 1e-9)
            .map(|(i, c)| (i, c.error_mm))
            .collect();
        assert_eq!(bad.len(), 1, "{bad:?}");
        assert!(
            bad[0].0 == 4 && (bad[0].1 - 2.0_f64.sqrt()).abs() < 1e-9,
            "{bad:?}"
        );
        // Run once where twice was asked for.
        let report = check(&program, &walk(&square, 100.0), &OPTIONS);
        assert!(report.max_missed_mm > 10.0, "{report:?}");
    }

    #[test]
    fn overspeed_is_seen_away_from_faster_blocks() {
        let program = Program::parse("G0 X0 Y0\nG1 X200 F6000\nX400 F3000").unwrap();
        let mut trace = walk(&[[0.0, 0.0], [200.0, 0.0], [400.0, 0.0]], 100.0);
        let report = check(&program, &trace, &OPTIONS);
        assert!((report.feed_excess_mm_s - 50.0).abs() < 1e-6);
        // Slow enough: rows of the second block 2 ms apart.
        for row in &mut trace[2000..] {
            row.time_s = 2.0 * row.time_s - 2.0;
        }
        let report = check(&program, &trace, &OPTIONS);
        assert!(report.feed_excess_mm_s < 1e-6);
        trace[300].time_s = trace[299].time_s;
        assert_eq!(
            check(&program, &trace, &OPTIONS).feed_excess_mm_s,
            f64::INFINITY
        );
    }

    #[test]
    fn dense_circle_is_followed_through_its_corners() {
        let mut text = String::from("G0 X50 Y0\nG1 F9600\n");
        let mut poses = vec![];
        for k in 1..=628 {
            let angle = f64::from(k) / 628.0 * std::f64::consts::TAU;
            text += &format!("X{:.6} Y{:.6}\n", 50.0 * angle.cos(), 50.0 * angle.sin());
        }
        let program = Program::parse(&text).unwrap();
        for k in 0..=1000 {
            let angle = f64::from(k) / 1000.0 * std::f64::consts::TAU;
            // Cuts the curve by up to 0.3 mm, the ends excepted.
            let radius = 50.0 - 0.3 * (angle / 2.0).sin().min(0.5) * 2.0;
            poses.push([radius * angle.cos(), radius * angle.sin(), 0.0, 0.0]);
        }
        let trace: Vec<_> = poses
            .into_iter()
            .zip(0u32..)
            .map(|(pose, k)| TraceRow {
                time_s: f64::from(k) * 2e-3,
                pose,
            })
            .collect();
        let report = check(&program, &trace, &OPTIONS);
        assert!(
            (report.max_path_deviation_mm - 0.3).abs() < 2e-3,
            "{report:?}"
        );
        assert!((report.max_corner_error_mm() - 0.3).abs() < 2e-3);
        assert_eq!(report.corners.len(), 627);
    }
}
