//! The margin walk against dense sampling of the textbook's formulas in `f64`.

#[path = "support/curves.rs"]
mod curves;

use curves::{Arc, Line};
use planner_core::kinematics::{
    Curve, Elbow, JointRange, PoseError, Scara, ScaraConfig, SegmentError,
};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

/// How far beyond each limit: radius (mm), joint 1, joint 3 (mm), joint 4 (rad), seam (rad).
struct Oracle {
    config: ScaraConfig,
}

impl Oracle {
    fn excess(&self, [x, y, z, c]: [f64; 4]) -> ([f64; 4], f64) {
        let config = &self.config;
        let (l1, l2) = (f64::from(config.link1_mm), f64::from(config.link2_mm));
        let limit = |joint: usize| {
            let JointRange { min, max } = config.joint_limits[joint];
            (f64::from(min), f64::from(max))
        };
        let beyond = |value: f64, (min, max): (f64, f64)| (min - value).max(value - max);
        let radians = |(min, max): (f64, f64)| (min.to_radians(), max.to_radians());
        let margin = f64::from(config.singularity_margin_deg);
        let (low, high) = match config.elbow {
            Elbow::Right => limit(1),
            Elbow::Left => (-limit(1).1, -limit(1).0),
        };
        let radius =
            |bend: f64| (l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * bend.to_radians().cos()).sqrt();
        let radii = (radius(high.min(180.0 - margin)), radius(low.max(margin)));
        let r = x.hypot(y);
        let c2 = ((r * r - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)).clamp(-1.0, 1.0);
        let t2 = if config.elbow == Elbow::Right {
            c2.acos()
        } else {
            -c2.acos()
        };
        let t1 = y.atan2(x) - (l2 * t2.sin()).atan2(l1 + l2 * t2.cos());
        let mid = f64::midpoint(limit(0).0, limit(0).1).to_radians();
        let t1 = mid + PI - (mid + PI - t1).rem_euclid(TAU);
        let t4 = c.to_radians() - t1 - t2;
        (
            [
                beyond(r, radii),
                beyond(t1, radians(limit(0))),
                beyond(z, limit(2)),
                beyond(t4, radians(limit(3))),
            ],
            t1,
        )
    }

    /// Excess in millimetres, of radians at the arm's smallest rate, before the fraction `until`;
    /// infinite where joint 1 jumps.
    fn worst(&self, curve: &impl Curve, until: f64) -> f64 {
        let margin = f64::from(self.config.singularity_margin_deg).to_radians();
        let l_min = f64::from(self.config.link1_mm.min(self.config.link2_mm));
        // What joints 1 and 4 turn at most in a millimetre of travel and a degree of C.
        let rad_per_mm = 1.0 / (l_min * margin.sin()) + 1_f64.to_radians();
        let (mut worst, mut before) = (f64::NEG_INFINITY, None);
        let count = 4000;
        for step in 0..=count {
            let u = f64::from(step) / f64::from(count);
            if u > until {
                break;
            }
            let ([r, t1_beyond, z, t4], t1) = self.excess(curve.pose(u));
            worst = worst
                .max(r)
                .max(z)
                .max(t1_beyond / rad_per_mm)
                .max(t4 / rad_per_mm);
            if before.is_some_and(|before: f64| (t1 - before).abs() > PI) {
                return f64::INFINITY;
            }
            before = Some(t1);
        }
        worst
    }
}

/// An excess that a step of 0.05 mm may hide, and the rounding of `f32` margins.
const HIDDEN_MM: f64 = 0.026;

fn agree(config: &ScaraConfig, curve: &impl Curve) -> Result<(), TestCaseError> {
    let scara = Scara::new(config).unwrap();
    let oracle = Oracle { config: *config };
    match scara.check_segment(curve) {
        Ok(()) => {
            let worst = oracle.worst(curve, 1.0);
            prop_assert!(worst < HIDDEN_MM, "{worst} mm beyond a limit was not seen");
        }
        Err(SegmentError { fraction, .. }) => {
            let (excess, _) = oracle.excess(curve.pose(fraction));
            let jump = oracle.worst(curve, (fraction + 1e-3).min(1.0)) == f64::INFINITY;
            prop_assert!(
                jump || excess.iter().any(|e| *e > -1e-5),
                "{excess:?} at {fraction}"
            );
            let fastest = f64::from(
                curve
                    .travel()
                    .xy_mm
                    .max(curve.travel().z_mm)
                    .max(curve.travel().c_deg),
            );
            let clear = fraction - 0.06 / fastest.max(0.06);
            prop_assert!(
                oracle.worst(curve, clear) < HIDDEN_MM,
                "not the first, {fraction}"
            );
        }
    }
    Ok(())
}

fn robots() -> impl Strategy<Value = ScaraConfig> {
    (
        prop_oneof![
            Just((200.0_f32, 150.0_f32)),
            Just((150.0, 200.0)),
            Just((170.0, 170.0)),
            Just((300.0, 60.0))
        ],
        any::<bool>(),
        (-180.0..180.0_f32, 90.0..360.0_f32),
        (2.0..30.0_f32, 90.0..175.0_f32),
        (5.0..150.0_f32, 90.0..400.0_f32),
    )
        .prop_map(
            |((link1_mm, link2_mm), left, (mid, span), (margin, bend), (z, wrist))| ScaraConfig {
                link1_mm,
                link2_mm,
                elbow: if left { Elbow::Left } else { Elbow::Right },
                joint_limits: [
                    JointRange {
                        min: mid - span / 2.0,
                        max: mid + span / 2.0,
                    },
                    JointRange::symmetric(bend),
                    JointRange::symmetric(z),
                    JointRange::symmetric(wrist),
                ],
                singularity_margin_deg: margin,
            },
        )
}

fn points() -> impl Strategy<Value = [f64; 4]> {
    (
        40.0..345.0_f64,
        -PI..PI,
        -120.0..120.0_f64,
        -200.0..200.0_f64,
    )
        .prop_map(|(r, angle, z, c)| [r * angle.cos(), r * angle.sin(), z, c])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn lines(config in robots(), from in points(), to in points(), short in 0.0..1.0_f64) {
        let to = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * short * short);
        agree(&config, &Line::new(from, to))?;
    }

    #[test]
    fn arcs(
        config in robots(), center in points(), radius in 1.0..200.0_f64,
        start in -PI..PI, sweep in -7.0..7.0_f64, climb in -60.0..60.0_f64, turn in -300.0..300.0_f64,
    ) {
        let [x, y, ..] = center;
        agree(&config, &Arc { center: [x * 0.7, y * 0.7, 0.0, 0.0], radius, start, sweep, climb, turn })?;
    }
}

/// Both ends are fine, the middle is too close to the shoulder.
#[test]
fn a_line_past_the_shoulder() {
    let scara = Scara::new(&ScaraConfig::default()).unwrap();
    let line = Line::new([150.0, -20.0, 0.0, 0.0], [20.0, 150.0, 0.0, 0.0]);
    assert!(scara.check_segment(&line).is_ok());
    let line = Line::new([150.0, -100.0, 0.0, 0.0], [-30.0, 100.0, 0.0, 0.0]);
    let error = scara.check_segment(&line).unwrap_err();
    assert!(matches!(
        error.cause,
        PoseError::JointLimit { joint: 2, .. } | PoseError::Unreachable { .. }
    ));
    assert!((0.3..0.7).contains(&error.fraction), "{error}");
}

/// With a full turn of travel every pose is within limits, but the arm cannot pass the seam.
#[test]
fn joint1_cannot_jump() {
    let mut config = ScaraConfig::default();
    config.joint_limits[0] = JointRange::symmetric(180.0);
    config.joint_limits[3] = JointRange::symmetric(1080.0);
    let scara = Scara::new(&config).unwrap();
    let circle = |start, sweep| Arc {
        center: [0.0; 4],
        radius: 250.0,
        start,
        sweep,
        climb: 0.0,
        turn: 0.0,
    };
    for sweep in [TAU * 0.999, -TAU * 0.999] {
        let cause = scara.check_segment(&circle(0.0, sweep)).unwrap_err().cause;
        let PoseError::JointLimit {
            joint: 1, value, ..
        } = cause
        else {
            panic!("{cause}");
        };
        // Just past the end, on the side that the arm came from.
        assert!(
            (180.0..180.1).contains(&(f64::from(value) * sweep.signum())),
            "{cause}"
        );
    }
    // From seam to seam the same circle is one sweep of the joint.
    let joint1_offset = scara
        .inverse(&planner_core::pose::Pose::from_bits([250 << 19, 0, 0, 0]))
        .joint1;
    let start = -PI - joint1_offset.to_num::<f64>() + 1e-3;
    assert_eq!(scara.check_segment(&circle(start, TAU * 0.999)), Ok(()));
}

/// [Yeh26]'s corner path fits either arm.
#[test]
fn corner_path_is_clear() {
    for elbow in [Elbow::Left, Elbow::Right] {
        let scara = Scara::new(&ScaraConfig {
            elbow,
            ..ScaraConfig::default()
        })
        .unwrap();
        let arc = Arc {
            center: [225.0, 0.0, 0.0, 0.0],
            radius: 45.0,
            start: PI,
            sweep: PI / 2.0,
            climb: 0.0,
            turn: 0.0,
        };
        assert_eq!(scara.check_segment(&arc), Ok(()));
        let corners = [
            [225.0, -45.0],
            [265.0, 45.0],
            [225.0, 135.0],
            [315.0, 45.0],
            [270.0, 0.0],
        ];
        for pair in corners.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|[x, y]| [x, y, 0.0, 0.0]);
            let line = Line::new(from, to);
            assert_eq!(scara.check_segment(&line), Ok(()));
            println!(
                "{elbow:?}: {:.1} mm in {} samples",
                line.length_mm(),
                line.samples.get()
            );
            assert!(line.samples.get() <= 8);
        }
    }
}

/// A limit that is touched but not approached costs nothing.
#[test]
fn along_the_height_limit() {
    let scara = Scara::new(&ScaraConfig::default()).unwrap();
    let line = Line::new([200.0, 0.0, 200.0, 0.0], [250.0, 0.0, 200.0, 0.0]);
    assert_eq!(scara.check_segment(&line), Ok(()));
    assert!(line.samples.get() <= 4, "{}", line.samples.get());
    let vertical = Line::new([200.0, 0.0, 0.0, 0.0], [200.0, 0.0, 200.5, 0.0]);
    let error = scara.check_segment(&vertical).unwrap_err();
    assert!(
        matches!(error.cause, PoseError::JointLimit { joint: 3, .. }) && error.fraction > 0.997
    );
    let still = Line::new([200.0, 0.0, 0.0, 0.0], [200.0, 0.0, 0.0, 0.0]);
    assert_eq!(scara.check_segment(&still), Ok(()));
    let turn = Line::new([200.0, 0.0, 0.0, 0.0], [200.0, 0.0, 0.0, 3000.0]);
    assert!(scara.check_segment(&turn).is_err());
}
