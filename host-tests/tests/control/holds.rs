//! Hold and resume at any instant of the corner path.

use host_tests::vector::{norm, sub};
use planner_core::config::Robot;
use planner_core::motion::{MotionState, Order, Setpoint};
use planner_core::pose::JointPosition;
use planner_core::prefilter::Kind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::support::{
    CORNER_PATH, KINDS, Orders, TICK_S, allowance_mm, prefilter, report, robot, setpoints,
    velocities,
};

const FEED_MM_S: f64 = 160.0;

/// Radius of the path's arc.
const RADIUS_MM: f64 = 45.0;

/// What the second difference of positions with a resolution of 2 nm can be off by.
const RESOLUTION_MM_S2: f64 = 4.0 * 2e-6 / (TICK_S * TICK_S);

fn robot_with(kind: Kind) -> Robot {
    robot(|config| config.prefilter.kind = kind)
}

/// Every prefilter is held at its share of the instants.
#[test]
fn held_at_100_instants_it_stays_on_the_path_and_ends_at_the_same_bits() {
    for kind in KINDS {
        hold_at_instants(kind, 100 / KINDS.len() + 1);
    }
}

#[test]
#[ignore = "long: 500 instants with every prefilter"]
fn held_at_500_instants_it_stays_on_the_path_and_ends_at_the_same_bits() {
    for kind in KINDS {
        hold_at_instants(kind, 500);
    }
}

fn hold_at_instants(kind: Kind, instants: usize) {
    let robot = robot_with(kind);
    let undisturbed = setpoints(&robot, CORNER_PATH, &Orders::new());
    let length = usize::from(robot.kernel.length_ticks());
    let mut rng = ChaCha8Rng::seed_from_u64(kind as u64);
    let (mut stop_ticks, mut stop_mm) = (0, 0.0_f64);
    for _ in 0..instants {
        let held_at = rng.random_range(0..undisturbed.len());
        // some are resumed before everything stands
        let resumed_at = held_at + rng.random_range(1..=2 * length + 10);
        let orders = Orders::from([(held_at, Order::Hold), (resumed_at, Order::Resume)]);
        let held = setpoints(&robot, CORNER_PATH, &orders);
        let context = format!("{kind:?}, held at {held_at}, resumed at {resumed_at}");

        stays_on_the_path(&robot, &held, &context);
        velocity_is_continuous(&robot, &held, &context);
        assert_eq!(held.last(), undisturbed.last(), "{context}");
        assert!(held.len() <= undisturbed.len() + resumed_at - held_at + 1);

        // what has been held for long enough, and was not yet at the end of the path.
        if resumed_at - held_at > length + 5 && held_at + length < undisturbed.len() {
            let (ticks, mm) = stop_of(&held, held_at);
            stop_ticks = stop_ticks.max(ticks);
            stop_mm = stop_mm.max(mm);
        }
    }
    let delay_s = prefilter(&robot).centroid_s();
    let ticks_bound = (robot.prefilter().length_s() / TICK_S).ceil() as usize + 1;
    // from the last setpoint before the order to the first that stands
    let mm_bound = FEED_MM_S * (delay_s + TICK_S) + 1e-3;
    println!(
        "{}: stops within {stop_ticks} ticks (bound {ticks_bound}) and {stop_mm:.3} mm (bound {mm_bound:.3})",
        kind.name()
    );
    assert!(stop_ticks <= ticks_bound, "{kind:?}");
    assert!(stop_mm <= mm_bound, "{kind:?}");
}

/// Ticks from the hold until the command stands, and its way there.
fn stop_of(held: &[Setpoint], held_at: usize) -> (usize, f64) {
    let reported = held[held_at..]
        .iter()
        .position(|setpoint| setpoint.state == MotionState::Held)
        .expect("it comes to rest");
    let rest = held[held_at + reported];
    let before = &held[..held_at + reported];
    let stands_from = before
        .iter()
        .rposition(|setpoint| setpoint.pose != rest.pose)
        .map_or(0, |last| last + 1);
    let way = velocities(&held[held_at.saturating_sub(1)..=held_at + reported]);
    (
        stands_from.saturating_sub(held_at),
        way.into_iter()
            .map(|velocity| norm(velocity) * TICK_S)
            .sum(),
    )
}

fn stays_on_the_path(robot: &Robot, held: &[Setpoint], context: &str) {
    let kind = robot.config.prefilter.kind;
    let allowance_mm = allowance_mm(kind, FEED_MM_S);
    let tolerance_mm = f64::from(robot.config.corner_tolerance_mm);
    let report = report(robot, CORNER_PATH, held);
    for corner in &report.corners {
        assert!(corner.error_mm <= tolerance_mm, "{context}: {corner:?}");
    }
    assert!(
        report.max_path_deviation_mm <= tolerance_mm + allowance_mm,
        "{context}: {report:?}"
    );
    assert_eq!((report.drift_mm, report.drift_deg), (0.0, 0.0), "{context}");
    assert!(report.feed_excess_mm_s < 1e-2, "{context}: {report:?}");
}

/// With a box of length `T` in the prefilter the tool's velocity is the mean of another over
/// `T`, and that is F in any direction or less:
///
/// ```text
/// |a| ≤ 2F / T + F² / R        on an arc of radius R besides
/// |q̈| ≤ (|a| + l₁ q̇₁² + l₂ (q̇₁ + q̇₂)²) / σ,     σ the least singular value of the Jacobian
/// ```
///
/// A pure shaper lets the velocity jump, by 2F at the most.
fn velocity_is_continuous(robot: &Robot, held: &[Setpoint], context: &str) {
    let bound_mm_s2 = match robot.prefilter().longest_box_s() {
        Some(box_s) => 2.0 * FEED_MM_S / box_s + FEED_MM_S * FEED_MM_S / RADIUS_MM,
        None => 2.0 * FEED_MM_S / TICK_S,
    };
    let change = |pair: &[[f64; 3]]| norm(sub(pair[1], pair[0])) / TICK_S;
    let found_mm_s2 = velocities(held).windows(2).map(change).fold(0.0, f64::max);
    assert!(
        found_mm_s2 <= bound_mm_s2 + RESOLUTION_MM_S2,
        "{context}: {found_mm_s2} of {bound_mm_s2} mm/s²"
    );
    if robot.prefilter().longest_box_s().is_some() {
        for three in held.windows(3) {
            joints_follow(robot, three, bound_mm_s2, context);
        }
    }
}

fn joints_follow(robot: &Robot, three: &[Setpoint], tool_mm_s2: f64, context: &str) {
    let [before, now, after] = [0, 1, 2].map(|i| angles_rad(&three[i].joints.position));
    let [l1, l2] = [robot.config.scara.link1_mm, robot.config.scara.link2_mm].map(f64::from);
    // the faster of the two steps, because the bound is one of the motion between samples
    let rate = |joint: usize| {
        let steps = [now[joint] - before[joint], after[joint] - now[joint]];
        steps.map(f64::abs).into_iter().fold(0.0, f64::max) / TICK_S
    };
    let (rate1, rate2) = (rate(0), rate(1));
    let turning = l1 * rate1 * rate1 + l2 * (rate1 + rate2) * (rate1 + rate2);
    let sigma = least_singular_value(l1, l2, now[1]);
    let bound_rad_s2 = (tool_mm_s2 + turning) / sigma;
    for joint in 0..2 {
        let change = after[joint] - 2.0 * now[joint] + before[joint];
        let found_rad_s2 = (change / (TICK_S * TICK_S)).abs();
        // angles have a resolution of 15 nrad
        assert!(
            found_rad_s2 <= bound_rad_s2 + 0.06,
            "{context}: joint {joint}: {found_rad_s2} of {bound_rad_s2} rad/s²"
        );
    }
}

fn angles_rad(position: &JointPosition) -> [f64; 2] {
    [position.joint1.to_num(), position.joint2.to_num()]
}

/// Of the Jacobian of two links: `σ₁² + σ₂² = ‖J‖²`, `σ₁ σ₂ = l₁ l₂ |sin q₂|`.
fn least_singular_value(l1: f64, l2: f64, elbow_rad: f64) -> f64 {
    let product = l1 * l2 * elbow_rad.sin().abs();
    let sum = l1 * l1 + 2.0 * l1 * l2 * elbow_rad.cos() + 2.0 * l2 * l2;
    let greatest = (f64::midpoint(sum, (sum * sum - 4.0 * product * product).sqrt())).sqrt();
    product / greatest
}

/// On a straight line the way to rest is exactly the feedrate times the prefilter's mean delay,
/// and the deceleration at most the feedrate over the box.
#[test]
fn a_line_is_left_by_the_mean_delay() {
    for kind in KINDS {
        let robot = robot_with(kind);
        let orders = Orders::from([(800, Order::Hold), (2000, Order::Resume)]);
        let all = setpoints(&robot, "G0 X200 Y-120\nG1 Y150 F9600\nM2", &orders);
        assert_eq!(all[799].state, MotionState::Running);
        assert_eq!(all[800].state, MotionState::Stopping);
        let held = all
            .iter()
            .position(|setpoint| setpoint.state == MotionState::Held)
            .expect("it comes to rest");
        let delay = usize::from(robot.kernel.delay_ticks());
        assert_eq!(held, 800 + delay + 1, "{kind:?}");
        // The setpoint is a tick behind the newest command, which the hold leaves as it is.
        let y_mm = |tick: usize| all[tick].pose.y.to_num::<f64>();
        let way_mm = y_mm(held) - y_mm(800);
        let delay_s = prefilter(&robot).centroid_s();
        assert!(
            (way_mm - FEED_MM_S * delay_s).abs() < 1e-3,
            "{kind:?}: {way_mm} of {} mm",
            FEED_MM_S * delay_s
        );
        if let Some(box_s) = robot.prefilter().longest_box_s() {
            let bound = FEED_MM_S / box_s;
            for three in velocities(&all).windows(2) {
                let found = norm(sub(three[1], three[0])) / TICK_S;
                assert!(
                    found <= bound + RESOLUTION_MM_S2,
                    "{kind:?}: {found} of {bound}"
                );
            }
        }
        assert!(
            all[held..2000]
                .iter()
                .all(|setpoint| setpoint.pose == all[held].pose)
        );
    }
}

/// A dwell (G4) is neither cut short nor run twice.
#[test]
fn a_hold_freezes_a_dwell() {
    let robot = robot_with(Kind::Fir);
    let program = "G0 X250 Y0\nG1 X260 F6000\nG4 P0.5\nG1 X250\nM2";
    let undisturbed = setpoints(&robot, program, &Orders::new());
    // The dwell begins some 0.26 s after the start.
    let orders = Orders::from([(500, Order::Hold), (900, Order::Resume)]);
    let held = setpoints(&robot, program, &orders);
    assert_eq!(held.len(), undisturbed.len() + 400);
    assert_eq!(
        held[500].state,
        MotionState::Held,
        "everything stands at once"
    );
}
