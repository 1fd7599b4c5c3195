use super::*;
use crate::corner::CornerRule;
use crate::orientation::Orientation;
use proptest::prelude::*;

fn pose(x: f64, y: f64, c_deg: f64) -> ToolPose {
    ToolPose {
        position_mm: [x, y, 0.0],
        orientation: Orientation::new(0.0, 0.0, c_deg),
    }
}

fn segment(from: &ToolPose, to: &ToolPose, feed_mm_s: f64) -> Segment {
    Segment::new(from, to, feed_mm_s, 100.0).unwrap()
}

#[test]
fn the_slower_of_translation_and_rotation_sets_the_time() {
    let moved = segment(&pose(0.0, 0.0, 0.0), &pose(100.0, 0.0, 50.0), 100.0);
    assert!(!moved.is_led_by_rotation());
    assert_eq!((moved.duration_s(), moved.feed_mm_s()), (1.0, 100.0));
    assert!((moved.turn_deg_s() - 50.0).abs() < 1e-12);
    let turned = segment(&pose(0.0, 0.0, 0.0), &pose(10.0, 0.0, 150.0), 100.0);
    assert!(turned.is_led_by_rotation());
    assert!((turned.duration_s() - 1.5).abs() < 1e-14);
    assert!((turned.feed_mm_s() - 10.0 / 1.5).abs() < 1e-12);
    assert_eq!(
        Segment::new(&pose(1.0, 2.0, 3.0), &pose(1.0, 2.0, 3.0), 1.0, 1.0),
        Err(OverlapError::Empty)
    );
}

#[test]
fn limits_set_the_time_of_the_s_curve() {
    let demand = |acceleration, jerk| Demand {
        speed: 150.0,
        acceleration,
        jerk,
    };
    let by_acceleration = SpeedCurve::within(&[demand(1000.0, 1e6)]).unwrap();
    assert_eq!(by_acceleration.box_s(), 0.15);
    let by_jerk = SpeedCurve::within(&[demand(1000.0, 1e6), demand(1e6, 9600.0)]).unwrap();
    assert_eq!(by_jerk.box_s(), 0.15_f64.max((150.0_f64 / 9600.0).sqrt()));
    assert!(matches!(
        SpeedCurve::within(&[demand(0.0, 1.0)]),
        Err(OverlapError::NotPositive { .. })
    ));
}

#[test]
fn a_tool_that_only_turns_stops_where_a_tolerance_is_asked_for() {
    let curve = SpeedCurve::s_curve(0.1).unwrap();
    let moves = segment(&pose(0.0, 0.0, 0.0), &pose(10.0, 0.0, 0.0), 100.0);
    let turns = segment(&pose(10.0, 0.0, 0.0), &pose(10.0, 0.0, 90.0), 100.0);
    for method in [Method::ClosedForm, Method::Exact] {
        let tolerance = CornerRule::ToleranceMm(1.0);
        assert_eq!(overlap_s(&curve, &moves, &turns, tolerance, method), 0.0);
        let percent = CornerRule::OverlapPercent(25.0);
        assert_eq!(overlap_s(&curve, &moves, &turns, percent, method), 0.1);
    }
}

proptest! {
    #[test]
    fn both_methods_keep_the_tolerance_and_agree_at_equal_feedrates(
        (dx, dy) in (-80.0..80.0_f64, 10.0..80.0_f64),
        ratio in prop_oneof![Just(1.0), 0.3..3.0_f64],
        tolerance_mm in 0.05..3.0_f64,
        is_s_curve: bool,
    ) {
        let curve = SpeedCurve::new(0.05, is_s_curve).unwrap();
        let (a, b) = (pose(-80.0, 0.0, 0.0), pose(0.0, 0.0, 0.0));
        let c = pose(dx, dy, 0.0);
        let (first, second) = (segment(&a, &b, 200.0), segment(&b, &c, 200.0 * ratio));
        let tolerance = CornerRule::ToleranceMm(tolerance_mm as f32);
        let [closed, exact] = [Method::ClosedForm, Method::Exact]
            .map(|method| overlap_s(&curve, &first, &second, tolerance, method));
        // Eq. 35 is conservative; the solver is exact to 20 µs
        prop_assert!(closed <= exact + 2e-5, "{closed} {exact}");
        if ratio == 1.0 {
            prop_assert!((closed - exact).abs() < 2e-5, "{closed} {exact}");
        }
        for method in [Method::ClosedForm, Method::Exact] {
            let mut moves = [Move::new(first, tolerance), Move::new(second, tolerance)];
            let plan = plan(curve, method, &mut moves);
            let miss = |t: f64| norm(plan.at(t).pose.position_mm);
            let ticks = (plan.cycle_s() / 1e-4) as u32;
            let least = (0..=ticks).map(|k| miss(f64::from(k) * 1e-4));
            let least = least.fold(f64::INFINITY, f64::min);
            prop_assert!(least <= tolerance_mm + 1e-3, "{least} {tolerance_mm}");
        }
    }

    #[test]
    fn velocity_and_turn_are_the_derivatives_of_the_pose(
        t in 0.0..2.0_f64, turn in -170.0..170.0_f64, is_s_curve: bool
    ) {
        const STEP: f64 = 1e-6;
        let curve = SpeedCurve::new(0.2, is_s_curve).unwrap();
        let tilted = |x: f64, y: f64, a_deg: f64, c_deg: f64| ToolPose {
            position_mm: [x, y, 0.0],
            orientation: Orientation::new(a_deg, 20.0, c_deg),
        };
        let points = [
            tilted(0.0, 0.0, 10.0, 0.0),
            tilted(60.0, 0.0, -20.0, turn),
            tilted(60.0, 50.0, 5.0, 0.0),
            tilted(0.0, 50.0, 30.0, 40.0),
        ];
        let rule = CornerRule::OverlapPercent(60.0);
        let mut moves: [Move; 3] = core::array::from_fn(|i| {
            Move::new(segment(&points[i], &points[i + 1], 100.0), rule)
        });
        let plan = plan(curve, Method::ClosedForm, &mut moves);
        let (before, here, after) = (plan.at(t - STEP), plan.at(t), plan.at(t + STEP));
        for axis in 0..3 {
            let moved = after.pose.position_mm[axis] - before.pose.position_mm[axis];
            let seen = moved / (2.0 * STEP);
            prop_assert!((seen - here.velocity_mm_s[axis]).abs() < 2e-3);
            if is_s_curve {
                let changed = after.velocity_mm_s[axis] - before.velocity_mm_s[axis];
                let seen = changed / (2.0 * STEP);
                prop_assert!((seen - here.acceleration_mm_s2[axis]).abs() < 1e-2);
            }
        }
        // the rotation between two instants, about its axis
        let turned = before.pose.orientation.rotation_to(&after.pose.orientation);
        for (part, rate) in turned.axis().iter().zip(here.turn_deg_s) {
            let seen = part * turned.angle_deg() / (2.0 * STEP);
            prop_assert!((seen - rate).abs() < 5e-2, "{seen} {rate}");
        }
    }

    #[test]
    fn every_path_ends_exactly_where_it_should(
        points in prop::collection::vec((-50.0..50.0_f64, -50.0..50.0_f64, -90.0..90.0_f64), 2..6),
        percent in 0.0..100.0_f32,
    ) {
        let poses: std::vec::Vec<_> = points.iter().map(|(x, y, c)| pose(*x, *y, *c)).collect();
        let mut moves: std::vec::Vec<_> = poses
            .windows(2)
            .map(|pair| segment(&pair[0], &pair[1], 80.0))
            .map(|segment| Move::new(segment, CornerRule::OverlapPercent(percent)))
            .collect();
        let plan = plan(SpeedCurve::s_curve(0.1).unwrap(), Method::ClosedForm, &mut moves);
        let end = plan.at(plan.cycle_s() + 1.0);
        let target = poses[poses.len() - 1];
        prop_assert!(norm(difference(end.pose.position_mm, target.position_mm)) < 1e-11);
        let off = end.pose.orientation.rotation_to(&target.orientation);
        prop_assert!(off.angle_deg() < 1e-11);
        prop_assert_eq!(end.velocity_mm_s, [0.0; 3]);
    }
}
