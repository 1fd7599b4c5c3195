//! Bounds on what a delta's arms do, against differences of the angles in `f64`.

#[path = "support/delta.rs"]
mod geometry;

use std::f64::consts::TAU;

use geometry::{Geometry, WORKSPACE, dot, sized};
use planner_core::kinematics::{Delta, DeltaConfig, RateBounds, Sweep};
use proptest::prelude::*;

/// θ', θ'' and θ''' of arm `k` along a unit vector, by differences of seven points.
fn along(geometry: &Geometry, k: usize, place: [f64; 3], direction: [f64; 3]) -> [f64; 3] {
    let h = geometry.upper_arm / 350.0;
    let q = [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0].map(|step| {
        let at = std::array::from_fn(|axis| place[axis] + step * h * direction[axis]);
        geometry.arm(k, at).expect("within reach").angle
    });
    [
        (45.0 * (q[4] - q[2]) - 9.0 * (q[5] - q[1]) + q[6] - q[0]) / (60.0 * h),
        (270.0 * (q[4] + q[2]) - 27.0 * (q[5] + q[1]) + 2.0 * (q[6] + q[0]) - 490.0 * q[3])
            / (180.0 * h * h),
        (-13.0 * (q[4] - q[2]) + 8.0 * (q[5] - q[1]) - (q[6] - q[0])) / (8.0 * h * h * h),
    ]
}

/// Directions spread evenly over half a sphere.
fn directions(count: u32) -> impl Iterator<Item = [f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
    (0..count).map(move |i| {
        let z = (f64::from(i) + 0.5) / f64::from(count);
        let (sin, cos) = (golden * f64::from(i)).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    })
}

/// The largest derivatives of arm `k` over all directions.
fn largest(geometry: &Geometry, k: usize, place: [f64; 3], count: u32) -> [f64; 3] {
    directions(count).fold([0.0; 3], |worst, direction| {
        let found = along(geometry, k, place, direction);
        std::array::from_fn(|order| worst[order].max(found[order].abs()))
    })
}

fn orders(bound: &RateBounds) -> [f64; 3] {
    [bound.first, bound.second, bound.third].map(f64::from)
}

fn default_robot() -> (Delta, Geometry) {
    let config = DeltaConfig::default();
    (Delta::new(&config).unwrap(), Geometry::of(&config))
}

fn line(from: [f64; 3], to: [f64; 3], rise_mm: f64) -> Sweep {
    let way: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
    let length_mm = dot(way, way).sqrt();
    let curve = Sweep::new(length_mm as f32, 0.0, |u| {
        std::array::from_fn(|axis| (from[axis] + f64::from(u) * way[axis]) as f32)
    });
    curve.raised(rise_mm as f32)
}

fn bounds_of(delta: &Delta, sweep: &Sweep, reach_mm: f32) -> [RateBounds; 3] {
    let shape = delta.bounds();
    shape.within(&shape.spans(sweep), reach_mm)
}

fn somewhere() -> impl Strategy<Value = [f64; 3]> {
    let [x, y, z] = WORKSPACE;
    (x.0..x.1, y.0..y.1, z.0..z.1).prop_map(|(x, y, z)| [x, y, z])
}

/// Over the whole workspace of robots of several shapes: g and H are met, D within a factor.
#[test]
fn norms_bound_the_derivatives_and_are_met() {
    for (config, third) in [
        (DeltaConfig::default(), 1.8..2.1),
        (sized(60.0, 20.0, 80.0, 210.0), 1.05..2.5),
        (sized(50.0, 50.0, 300.0, 500.0), 1.05..3.0),
        (sized(180.0, 45.0, 400.0, 420.0), 1.05..4.0),
        (sized(200.0, 50.0, 500.0, 300.0), 1.05..4.0),
    ] {
        let (delta, geometry) = (Delta::new(&config).unwrap(), Geometry::of(&config));
        let reach = geometry.upper_arm + geometry.forearm;
        let mut loosest = [1.0_f64; 3];
        let mut count = 0;
        for place in geometry::workspace([6, 6, 6]) {
            let [x, y, z] = place;
            let place = [
                x * reach / 1148.0,
                y * reach / 1148.0,
                (z + 190.0) * reach / 850.0,
            ];
            let Some(arms) = geometry.arms(place) else {
                continue;
            };
            // the least s counts for all: its forearms within the serial margin and more
            if arms.iter().any(|arm| arm.serial < 20.5_f64.to_radians()) {
                continue;
            }
            count += 1;
            let bounds = bounds_of(&delta, &line(place, place, 0.0), 0.0);
            for (k, bound) in bounds.iter().enumerate() {
                let found = largest(&geometry, k, place, 500);
                for (order, (value, bound)) in found.into_iter().zip(orders(bound)).enumerate() {
                    assert!(
                        value <= bound * 1.0005,
                        "{config:?}, {place:?}, arm {k}, order {order}: {value:e} {bound:e}"
                    );
                    loosest[order] = loosest[order].max(bound / value);
                }
            }
        }
        println!("bounds by derivatives at {count} places: {loosest:.3?}");
        assert!(count > 30, "{count} places: {config:?}");
        assert!(loosest[0] < 1.02 && loosest[1] < 1.03, "{loosest:?}");
        assert!(third.contains(&loosest[2]), "{loosest:?}");
    }
}

/// What planning sees in the middle of the workspace: a region around a line.
#[test]
fn regions_in_the_middle_are_not_much_worse_than_what_is_in_them() {
    let (delta, geometry) = default_robot();
    for (length_mm, reach_mm, most) in [
        (10.0, 5.0, [1.05, 1.1, 1.9]),
        (50.0, 20.0, [1.05, 1.15, 1.9]),
        (200.0, 20.0, [1.05, 1.15, 1.9]),
    ] {
        let mut loosest = [0.0_f64; 3];
        for turn in 0..12 {
            let (sin, cos) = (f64::from(turn) * std::f64::consts::FRAC_PI_6).sin_cos();
            let half = 0.5 * length_mm;
            let from = [-half * cos, -half * sin, -714.0];
            let to = [half * cos, half * sin, -714.0];
            let bounds = bounds_of(&delta, &line(from, to, 0.0), reach_mm);
            for (k, bound) in bounds.iter().enumerate() {
                let mut found = [0.0_f64; 3];
                for part in 0..=4 {
                    let u = f64::from(part) / 4.0;
                    let at: [f64; 3] = std::array::from_fn(|i| from[i] + u * (to[i] - from[i]));
                    for way in directions(60).flat_map(|d| [d, d.map(|v| -v)]) {
                        let reach = f64::from(reach_mm);
                        let edge = std::array::from_fn(|i| at[i] + reach * way[i]);
                        let here = largest(&geometry, k, edge, 60);
                        found = std::array::from_fn(|i| found[i].max(here[i]));
                    }
                }
                for (order, bound) in orders(bound).into_iter().enumerate() {
                    loosest[order] = loosest[order].max(bound / found[order]);
                }
            }
        }
        println!("{length_mm} mm, {reach_mm} mm around: {loosest:.3?}");
        for (loose, most) in loosest.into_iter().zip(most) {
            assert!((1.0..most).contains(&loose), "{length_mm}: {loosest:?}");
        }
    }
}

proptest! {
    #[test]
    fn a_region_bounds_all_that_is_in_it(
        from in somewhere(), to in somewhere(), share in 0.01_f64..1.0, u in 0.0_f64..1.0,
        toward in 0_usize..200, reach in 0.0_f64..15.0, rise in 0.0_f64..100.0, up in 0.0_f64..1.0
    ) {
        let (delta, geometry) = default_robot();
        let to: [f64; 3] = std::array::from_fn(|i| from[i] + share * (to[i] - from[i]));
        let bounds = bounds_of(&delta, &line(from, to, rise), reach as f32);
        let aside = directions(200).nth(toward).unwrap();
        let mut at: [f64; 3] =
            std::array::from_fn(|i| from[i] + u * (to[i] - from[i]) + reach * aside[i]);
        at[2] += rise * up;
        // within the serial margin of 20°, wherever that is
        if let Some(arms) = geometry.arms(at)
            && arms.iter().all(|arm| arm.serial > 20_f64.to_radians())
        {
            for (k, bound) in bounds.iter().enumerate() {
                let found = largest(&geometry, k, at, 60);
                for (value, bound) in found.into_iter().zip(orders(bound)) {
                    prop_assert!(value <= bound * 1.0005, "arm {k}: {value:e} {bound:e}");
                }
            }
        }
    }

    /// An arc is bounded by the pieces that its sagitta widens.
    #[test]
    fn an_arc_is_bounded_along_its_way(
        centre in somewhere(), radius in 1.0_f64..100.0, start in 0.0..TAU,
        sweep in -TAU..TAU, u in 0.0_f64..1.0
    ) {
        let (delta, geometry) = default_robot();
        let centre = [0.7 * centre[0], 0.7 * centre[1], centre[2]];
        let at = |u: f64| {
            let (sin, cos) = (start + sweep * u).sin_cos();
            [centre[0] + radius * cos, centre[1] + radius * sin, centre[2]]
        };
        let length_mm = (radius * sweep.abs()) as f32;
        let way = Sweep::new(length_mm, 1.0 / radius as f32, |u| {
            at(f64::from(u)).map(|v| v as f32)
        });
        for (k, bound) in bounds_of(&delta, &way, 0.0).iter().enumerate() {
            let found = largest(&geometry, k, at(u), 60);
            for (value, bound) in found.into_iter().zip(orders(bound)) {
                prop_assert!(value <= bound * 1.0005, "arm {k}: {value:e} {bound:e}");
            }
        }
    }

    /// As far as a command may stray from a path, its bounds hold.
    #[test]
    fn what_strays_keeps_off_the_floor(
        from in somewhere(), to in somewhere(), u in 0.0_f64..1.0, toward in 0_usize..200,
        margin_deg in 5.0_f32..28.0
    ) {
        let config = DeltaConfig { serial_margin_deg: margin_deg, ..DeltaConfig::default() };
        let delta = Delta::new(&config).unwrap();
        let geometry = Geometry::of(&config);
        let way = line(from, to, 0.0);
        let spare = f64::from(delta.bounds().spare_mm(&way));
        prop_assert!(spare > 0.1 && spare < 90.0, "{spare}");
        let aside = directions(200).nth(toward).unwrap();
        let at = std::array::from_fn(|i| from[i] + u * (to[i] - from[i]) + spare * aside[i]);
        let arms = geometry.arms(at).expect("within reach");
        for (k, bound) in bounds_of(&delta, &way, spare as f32).iter().enumerate() {
            // g is l2/(l1 s) and bounded by the floor
            let first = geometry.forearm / (geometry.upper_arm * geometry.forearm * arms[k].serial.sin());
            prop_assert!(first <= f64::from(bound.first) * 1.0005);
        }
    }
}
