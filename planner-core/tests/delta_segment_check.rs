//! The delta's margin walk against dense sampling of circles and spheres in `f64`.

#[path = "support/curves.rs"]
mod curves;
#[path = "support/delta.rs"]
mod geometry;

use std::f64::consts::PI;

use curves::{Arc, Line};
use geometry::Geometry;
use planner_core::kinematics::{
    Curve, Delta, DeltaConfig, JointRange, PoseError, SegmentError, Travel,
};
use proptest::prelude::*;

struct Oracle {
    config: DeltaConfig,
    geometry: Geometry,
}

impl Oracle {
    /// How far beyond a limit, each in millimetres of tool travel at the largest rate that the
    /// limits allow; infinite out of reach.
    fn excess(&self, [x, y, z, c]: [f64; 4]) -> f64 {
        let config = &self.config;
        let Some(arms) = self.geometry.arms([x, y, z]) else {
            return f64::INFINITY;
        };
        let (l1, l2) = (self.geometry.upper_arm, self.geometry.forearm);
        let margin = f64::from(config.serial_margin_deg).to_radians();
        let root_min = l2 * margin.sin();
        let beyond = |value: f64, range: JointRange| {
            let (min, max) = (f64::from(range.min), f64::from(range.max));
            (min.to_radians() - value).max(value - max.to_radians())
        };
        let mut worst = beyond(c.to_radians(), config.yaw_limits) / 1_f64.to_radians();
        for arm in &arms {
            let root = l2 * arm.serial.sin();
            // |ds| <= 1 + |m| l2 / (l1 s)
            let per_mm = 1.0 + (l1 + l2) * l2 / (l1 * root_min);
            worst = worst.max((root_min - root) / per_mm);
            let per_mm = l2 / (l1 * root_min);
            worst = worst.max(beyond(arm.angle, config.arm_limits) / per_mm);
        }
        let volume = self.geometry.volume(&arms);
        let per_mm = 3.0 / root_min;
        worst.max((f64::from(config.parallel_margin) - volume) / per_mm)
    }

    /// The largest excess before the fraction `until`.
    fn worst(&self, curve: &impl Curve, until: f64) -> f64 {
        let count = 4000;
        (0..=count)
            .map(|step| f64::from(step) / f64::from(count))
            .take_while(|u| *u <= until)
            .fold(f64::NEG_INFINITY, |worst, u| {
                worst.max(self.excess(curve.pose(u)))
            })
    }
}

/// An excess that a step of 0.05 mm may hide, and the rounding of `f32` margins.
const HIDDEN_MM: f64 = 0.026;

fn agree(config: &DeltaConfig, curve: &impl Curve) -> Result<(), TestCaseError> {
    let delta = Delta::new(config).unwrap();
    let oracle = Oracle {
        config: *config,
        geometry: Geometry::of(config),
    };
    match delta.check_segment(curve) {
        Ok(()) => {
            let worst = oracle.worst(curve, 1.0);
            prop_assert!(worst < HIDDEN_MM, "{worst} mm beyond a limit was not seen");
        }
        Err(SegmentError { fraction, cause }) => {
            let excess = oracle.excess(curve.pose(fraction));
            prop_assert!(excess > -1e-4, "{cause}, but {excess} at {fraction}");
            let Travel {
                xy_mm, z_mm, c_deg, ..
            } = curve.travel();
            let fastest = f64::from(xy_mm.max(z_mm).max(c_deg));
            let clear = fraction - 0.06 / fastest.max(0.06);
            let before = oracle.worst(curve, clear);
            prop_assert!(before < HIDDEN_MM, "not the first, {fraction}");
        }
    }
    Ok(())
}

fn robots() -> impl Strategy<Value = DeltaConfig> {
    (
        prop_oneof![
            Just((200.0_f32, 45.0_f32, 348.088_f32, 800.0_f32)),
            Just((60.0, 20.0, 300.0, 700.0)),
            Just((250.0, 50.0, 400.0, 600.0)),
        ],
        (-90.0..-10.0_f32, 50.0..120.0_f32),
        10.0..300.0_f32,
        (2.0..35.0_f32, 0.02..0.4_f32),
    )
        .prop_map(
            |((base, platform, arm, forearm), (min, max), yaw, (serial, parallel))| DeltaConfig {
                base_radius_mm: base,
                platform_radius_mm: platform,
                upper_arm_mm: arm,
                forearm_mm: forearm,
                arm_limits: JointRange { min, max },
                yaw_limits: JointRange::symmetric(yaw),
                serial_margin_deg: serial,
                parallel_margin: parallel,
            },
        )
}

fn points() -> impl Strategy<Value = [f64; 4]> {
    (
        0.0..550.0_f64,
        -PI..PI,
        -1050.0..-400.0_f64,
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
        config in robots(), center in points(), radius in 1.0..300.0_f64,
        start in -PI..PI, sweep in -7.0..7.0_f64, climb in -100.0..100.0_f64,
    ) {
        let [x, y, z, _] = center;
        let center = [x * 0.6, y * 0.6, z, 0.0];
        agree(&config, &Arc { center, radius, start, sweep, climb, turn: 0.0 })?;
    }
}

/// The thesis's pick and place, across the workspace, in few samples.
#[test]
fn pick_and_place_is_clear() {
    let delta = Delta::new(&DeltaConfig::default()).unwrap();
    let corners = [
        [-350.0, 0.0, -767.0, 0.0],
        [-350.0, 0.0, -717.0, 0.0],
        [350.0, 0.0, -717.0, 90.0],
        [350.0, 0.0, -767.0, 90.0],
    ];
    for pair in corners.windows(2) {
        let line = Line::new(pair[0], pair[1]);
        assert_eq!(delta.check_segment(&line), Ok(()));
        let (length, samples) = (line.length_mm(), f64::from(line.samples.get()));
        println!("{length:.0} mm in {samples} samples");
        assert!(samples <= 4.0 + length / 15.0, "{samples}");
    }
}

/// Both ends are fine, the middle is too far down.
#[test]
fn an_arc_below_the_workspace() {
    let delta = Delta::new(&DeltaConfig::default()).unwrap();
    let ends = [-350.0, 350.0].map(|x| [x, 0.0, -820.0, 0.0]);
    assert_eq!(delta.check_segment(&Line::new(ends[0], ends[1])), Ok(()));
    struct Bow;
    impl Curve for Bow {
        fn length_mm(&self) -> f64 {
            350.0 * PI
        }
        fn pose(&self, u: f64) -> [f64; 4] {
            let (s, c) = (PI * u).sin_cos();
            [-350.0 * c, 0.0, -820.0 - 350.0 * s, 0.0]
        }
    }
    let error = delta.check_segment(&Bow).unwrap_err();
    assert!((0.05..0.95).contains(&error.fraction), "{error}");
    assert!(
        matches!(
            error.cause,
            PoseError::NearSerial { .. } | PoseError::JointLimit { .. }
        ),
        "{error}"
    );
}

#[test]
fn standing_and_turning() {
    let delta = Delta::new(&DeltaConfig::default()).unwrap();
    let still = [0.0, 0.0, -700.0, 0.0];
    assert_eq!(delta.check_segment(&Line::new(still, still)), Ok(()));
    let turned = |c| [0.0, 0.0, -700.0, c];
    assert_eq!(
        delta.check_segment(&Line::new(still, turned(719.0))),
        Ok(())
    );
    let error = delta
        .check_segment(&Line::new(still, turned(-730.0)))
        .unwrap_err();
    assert!(matches!(error.cause, PoseError::JointLimit { joint: 4, .. }) && error.fraction > 0.98);
}
