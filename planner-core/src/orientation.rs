//! How a tool is turned: any orientation, and the rotation about one axis from one to another.
//!
//! \[Li23\]: Li, Tsai, Zhang, Cheng: smooth interpolation design with corner tolerance
//! constraints for robotics. Appl. Sci. 2023, 13, 8789.

use core::f64::consts::PI;

/// Below this cosine of B the Euler angles are locked: A and C turn about the same axis.
const LOCKED_COS_B: f64 = 1e-6;

/// Rotations closer than this (sine) to half a turn take the axis that points up.
const HALF_TURN_COS: f64 = 1e-12;

/// An orientation by its Euler angles about the fixed axes X, Y and Z, in that order:
///
/// ```text
/// R = R_z(C) R_y(B) R_x(A)                                                    [Li23]
/// ```
///
/// The yaw of a SCARA is C, with A and B at rest. Any finite angle may be given. Angles that
/// this module yields are principal values: A and C from −180 to 180°, B from −90 to 90°.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation {
    /// Angle about X in degrees.
    pub a_deg: f64,
    /// Angle about Y in degrees.
    pub b_deg: f64,
    /// Angle about Z in degrees.
    pub c_deg: f64,
}

/// How fast the Euler angles change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EulerRates {
    /// A′ in °/s.
    pub a_deg_s: f64,
    /// B′ in °/s.
    pub b_deg_s: f64,
    /// C′ in °/s.
    pub c_deg_s: f64,
}

/// A unit quaternion `[w, x, y, z]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion([f64; 4]);

impl Orientation {
    /// From three angles in degrees.
    #[must_use]
    pub const fn new(a_deg: f64, b_deg: f64, c_deg: f64) -> Self {
        Self {
            a_deg,
            b_deg,
            c_deg,
        }
    }

    /// The same orientation as a quaternion, `q = q_z(C) q_y(B) q_x(A)`. Exact to 1e-15.
    #[must_use]
    pub fn quaternion(&self) -> Quaternion {
        let about_x = Quaternion::about([1.0, 0.0, 0.0], self.a_deg);
        let about_y = Quaternion::about([0.0, 1.0, 0.0], self.b_deg);
        let about_z = Quaternion::about([0.0, 0.0, 1.0], self.c_deg);
        about_z.after(&about_y.after(&about_x))
    }

    /// The rotation about one axis that leads to another orientation, the shorter way round.
    #[must_use]
    pub fn rotation_to(&self, target: &Self) -> Rotation {
        let start = self.quaternion();
        let turned = target.quaternion().after(&start.inverse());
        let (axis, angle_deg) = turned.axis_and_angle_deg();
        Rotation {
            start,
            axis,
            angle_deg,
        }
    }

    /// The Euler rates at this orientation while it turns by `turn_deg_s` (about X, Y and Z of
    /// the fixed frame).
    ///
    /// ```text
    /// A′ cos B = ω_x cos C + ω_y sin C,   B′ = ω_y cos C − ω_x sin C,   C′ = ω_z + A′ sin B
    /// ```
    ///
    /// Where the angles are locked, `|cos B| < 1e-6`, no rates show the part of the turn
    /// along `A′ cos B`: it is left out, A rests and C takes the turn about Z.
    #[must_use]
    pub fn rates(&self, turn_deg_s: [f64; 3]) -> EulerRates {
        let [wx, wy, wz] = turn_deg_s;
        let (sin_b, cos_b) = sin_cos_deg(self.b_deg);
        let (sin_c, cos_c) = sin_cos_deg(self.c_deg);
        let a_deg_s = if libm::fabs(cos_b) < LOCKED_COS_B {
            0.0
        } else {
            (wx * cos_c + wy * sin_c) / cos_b
        };
        EulerRates {
            a_deg_s,
            b_deg_s: wy * cos_c - wx * sin_c,
            c_deg_s: wz + a_deg_s * sin_b,
        }
    }
}

impl Quaternion {
    /// A rotation about a unit axis.
    #[must_use]
    pub fn about(axis: [f64; 3], angle_deg: f64) -> Self {
        let (sin, cos) = sin_cos_deg(angle_deg / 2.0);
        let [x, y, z] = axis.map(|part| part * sin);
        Self([cos, x, y, z])
    }

    /// This rotation after another one, both about axes of the fixed frame.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        let [w, x, y, z] = self.0;
        let [v, a, b, c] = first.0;
        Self([
            w * v - x * a - y * b - z * c,
            w * a + x * v + y * c - z * b,
            w * b - x * c + y * v + z * a,
            w * c + x * b - y * a + z * v,
        ])
    }

    /// The rotation back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let [w, x, y, z] = self.0;
        Self([w, -x, -y, -z])
    }

    /// A vector of the turned frame in the fixed one.
    #[must_use]
    pub fn turn(&self, vector: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = vector;
        let Self([_, x, y, z]) = self.after(&Self([0.0, x, y, z])).after(&self.inverse());
        [x, y, z]
    }

    /// Its Euler angles; where they are locked (`|cos B| < 1e-6`) A is zero and C takes all.
    /// Exact to 1e-9° away from there.
    #[must_use]
    pub fn orientation(&self) -> Orientation {
        let [w, x, y, z] = self.0;
        // the entries of R, whose last row is [−sin B, cos B sin A, cos B cos A]
        let minus_sin_b = 2.0 * (x * z - w * y);
        let (sin_a, cos_a) = (2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y));
        let (sin_c, cos_c) = (2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z));
        let cos_b = libm::sqrt(sin_a * sin_a + cos_a * cos_a);
        let b_deg = atan2_deg(-minus_sin_b, cos_b);
        if cos_b < LOCKED_COS_B {
            // with A = 0 the second column of R is [−sin C, cos C, 0]
            let (minus_sin, cos) = (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z));
            return Orientation::new(0.0, b_deg, atan2_deg(-minus_sin, cos));
        }
        Orientation::new(atan2_deg(sin_a, cos_a), b_deg, atan2_deg(sin_c, cos_c))
    }

    /// Unit axis and angle from 0 to 180°.
    ///
    /// Without a turn the axis is Z. At half a turn both directions do: it is the one whose
    /// last part that is not zero is positive, so that half a turn of the yaw goes
    /// counter-clockwise.
    fn axis_and_angle_deg(&self) -> ([f64; 3], f64) {
        let [mut w, x, y, z] = self.0;
        let mut axis = [x, y, z];
        let sin = libm::sqrt(x * x + y * y + z * z);
        if sin == 0.0 {
            return ([0.0, 0.0, 1.0], 0.0);
        }
        let last = axis
            .iter()
            .rev()
            .copied()
            .find(|part| libm::fabs(*part) > HALF_TURN_COS);
        let is_half_turn = libm::fabs(w) < HALF_TURN_COS;
        let goes_down = last.is_some_and(|part| part < 0.0);
        if (is_half_turn && goes_down) || (!is_half_turn && w < 0.0) {
            axis = axis.map(|part| -part);
        }
        w = libm::fabs(w);
        // from both parts: the sine alone is flat at half a turn, the cosine alone at none
        (axis.map(|part| part / sin), 2.0 * atan2_deg(sin, w))
    }
}

/// A rotation from one orientation to another about one axis that stands still.
///
/// Every fraction of it is `R(u) = Rot(axis, u φ) R_start`, which is the shortest way; the SCARA's
/// yaw goes it too as long as it turns by less than half a turn (it counts turns, an
/// orientation does not).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    start: Quaternion,
    axis: [f64; 3],
    angle_deg: f64,
}

impl Rotation {
    /// The axis in the fixed frame, of length 1.
    #[must_use]
    pub const fn axis(&self) -> [f64; 3] {
        self.axis
    }

    /// The angle φ, 0 to 180°. Exact to 1e-13° near both ends too.
    #[must_use]
    pub const fn angle_deg(&self) -> f64 {
        self.angle_deg
    }

    /// The turn so far, after a fraction `s/L` of it.
    #[must_use]
    pub fn turned(&self, fraction: f64) -> Quaternion {
        Quaternion::about(self.axis, fraction * self.angle_deg)
    }

    /// The orientation after a fraction `s/L` of it.
    #[must_use]
    pub fn at(&self, fraction: f64) -> Orientation {
        self.turned(fraction).after(&self.start).orientation()
    }

    /// The Euler rates there, while it turns by `rate_deg_s` about its axis.
    #[must_use]
    pub fn rates(&self, fraction: f64, rate_deg_s: f64) -> EulerRates {
        self.at(fraction)
            .rates(self.axis.map(|part| part * rate_deg_s))
    }
}

fn sin_cos_deg(angle_deg: f64) -> (f64, f64) {
    libm::sincos(angle_deg * (PI / 180.0))
}

fn atan2_deg(y: f64, x: f64) -> f64 {
    libm::atan2(y, x) * (180.0 / PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::Curve;
    use crate::path::{PathSegment, Shape};
    use crate::pose::Pose;
    use crate::units::{AngleDeg, LengthMm};
    use proptest::prelude::*;

    type Matrix = [[f64; 3]; 3];

    /// `R_z(C) R_y(B) R_x(A)`, multiplied out from three matrices.
    fn matrix(orientation: &Orientation) -> Matrix {
        let [a, b, c] =
            [orientation.a_deg, orientation.b_deg, orientation.c_deg].map(f64::to_radians);
        let x = [
            [1.0, 0.0, 0.0],
            [0.0, a.cos(), -a.sin()],
            [0.0, a.sin(), a.cos()],
        ];
        let y = [
            [b.cos(), 0.0, b.sin()],
            [0.0, 1.0, 0.0],
            [-b.sin(), 0.0, b.cos()],
        ];
        let z = [
            [c.cos(), -c.sin(), 0.0],
            [c.sin(), c.cos(), 0.0],
            [0.0, 0.0, 1.0],
        ];
        product(&z, &product(&y, &x))
    }

    fn product(a: &Matrix, b: &Matrix) -> Matrix {
        core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
    }

    fn difference(a: &Matrix, b: &Matrix) -> f64 {
        let pairs = a.iter().flatten().zip(b.iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    fn angles() -> impl Strategy<Value = Orientation> {
        [-400.0..400.0_f64, -200.0..200.0_f64, -400.0..400.0_f64]
            .prop_map(|[a, b, c]| Orientation::new(a, b, c))
    }

    proptest! {
        #[test]
        fn euler_angles_read_back_as_the_same_orientation(given in angles()) {
            let found = given.quaternion().orientation();
            prop_assert!(difference(&matrix(&given), &matrix(&found)) < 1e-9);
            prop_assert!(found.b_deg.abs() <= 90.0);
        }

        #[test]
        fn a_rotation_leads_to_its_target_about_an_axis_that_stands(
            from in angles(), to in angles()
        ) {
            let rotation = from.rotation_to(&to);
            prop_assert!((0.0..=180.0).contains(&rotation.angle_deg()));
            for (fraction, end) in [(0.0, from), (1.0, to)] {
                let found = matrix(&rotation.at(fraction));
                prop_assert!(difference(&found, &matrix(&end)) < 1e-9);
            }
            // the axis is one that R_to R_fromᵀ leaves where it is
            let back: Matrix = {
                let m = matrix(&from);
                core::array::from_fn(|i| core::array::from_fn(|j| m[j][i]))
            };
            let whole = product(&matrix(&to), &back);
            let axis = rotation.axis();
            for (row, part) in whole.iter().zip(axis) {
                let turned: f64 = row.iter().zip(axis).map(|(a, b)| a * b).sum();
                prop_assert!((turned - part).abs() < 1e-9);
            }
            // trace R = 1 + 2 cos φ
            let trace = whole[0][0] + whole[1][1] + whole[2][2];
            let cos = rotation.angle_deg().to_radians().cos();
            prop_assert!((trace - 1.0 - 2.0 * cos).abs() < 1e-9);
        }

        #[test]
        fn rates_are_the_derivatives_of_the_angles(
            from in angles(), to in angles(), fraction in 0.1..0.9_f64
        ) {
            const STEP: f64 = 1e-6;
            let rotation = from.rotation_to(&to);
            let here = rotation.at(fraction);
            prop_assume!(here.b_deg.abs() < 80.0);
            let rates = rotation.rates(fraction, rotation.angle_deg());
            let (before, after) = (rotation.at(fraction - STEP), rotation.at(fraction + STEP));
            let turned = |a: f64, b: f64| (b - a + 540.0).rem_euclid(360.0) - 180.0;
            for (rate, before, after) in [
                (rates.a_deg_s, before.a_deg, after.a_deg),
                (rates.b_deg_s, before.b_deg, after.b_deg),
                (rates.c_deg_s, before.c_deg, after.c_deg),
            ] {
                let seen = turned(before, after) / (2.0 * STEP);
                prop_assert!((rate - seen).abs() < 1e-3, "{rate} {seen}");
            }
        }

        #[test]
        fn the_yaw_of_a_scara_is_the_special_case(
            from in -170.0..170.0_f64, turn in -179.0..179.0_f64, fraction in 0.0..1.0_f64
        ) {
            let yaw = |c_deg| Orientation::new(0.0, 0.0, c_deg);
            let rotation = yaw(from).rotation_to(&yaw(from + turn));
            let on_the_way = yaw(from + fraction * turn).quaternion().orientation();
            let found = rotation.at(fraction);
            prop_assert!(found.a_deg.abs() < 1e-9 && found.b_deg.abs() < 1e-9);
            prop_assert!(difference(&matrix(&found), &matrix(&on_the_way)) < 1e-12);
            // the yaw of a segment as the planner walks it, in 2^-19 °
            let at = |c_deg: f64| Pose {
                x: LengthMm::from_num(200),
                c: AngleDeg::from_num(c_deg),
                ..Pose::default()
            };
            let path = PathSegment {
                start: at(from),
                target: at(from + turn),
                shape: Shape::Line,
            };
            let [.., c_deg] = path.pose(fraction);
            let off = (found.c_deg - c_deg + 180.0).rem_euclid(360.0) - 180.0;
            prop_assert!(off.abs() < 4e-6, "{off}");
            let rates = rotation.rates(fraction, 50.0);
            let signed = if turn < 0.0 { -50.0 } else { 50.0 };
            prop_assert!((rates.c_deg_s - signed).abs() < 1e-6);
        }
    }

    #[test]
    fn small_turns_and_half_turns_keep_their_angle_and_axis() {
        let start = Orientation::new(20.0, 30.0, 40.0);
        for angle_deg in [1e-12, 1e-9, 1e-6, 1.0, 179.0, 180.0 - 1e-6, 180.0 - 1e-9] {
            let axis = [0.48, -0.6, 0.64];
            let turned = Quaternion::about(axis, angle_deg);
            let (found, angle) = turned.axis_and_angle_deg();
            assert!(
                (angle - angle_deg).abs() < 1e-13 * angle_deg.max(1.0),
                "{angle}"
            );
            for (found, given) in found.iter().zip(axis) {
                assert!((found - given).abs() < 1e-12, "{angle_deg}: {found}");
            }
            // through Euler angles rounding moves both ends by some 1e-14
            let target = turned.after(&start.quaternion()).orientation();
            let rotation = start.rotation_to(&target);
            assert!((rotation.angle_deg() - angle_deg).abs() < 1e-11);
        }
        assert!(start.rotation_to(&start).angle_deg() < 1e-13);
        // either way round is as short
        let up = Orientation::default().rotation_to(&Orientation::new(0.0, 0.0, 180.0));
        let down = Orientation::default().rotation_to(&Orientation::new(0.0, 0.0, -180.0));
        assert_eq!(up.axis(), [0.0, 0.0, 1.0]);
        assert_eq!(down.axis(), [0.0, 0.0, 1.0]);
        assert_eq!((up.angle_deg(), down.angle_deg()), (180.0, 180.0));
    }

    #[test]
    fn locked_angles_are_finite_and_lead_to_the_same_orientation() {
        for b_deg in [90.0, -90.0] {
            let locked = Orientation::new(25.0, b_deg, 70.0);
            let found = locked.quaternion().orientation();
            assert_eq!(found.a_deg, 0.0);
            assert!(difference(&matrix(&locked), &matrix(&found)) < 2e-6);
            let rates = found.rates([3.0, 4.0, 5.0]);
            assert_eq!((rates.a_deg_s, rates.c_deg_s), (0.0, 5.0));
            // a way through the lock stays continuous as an orientation
            let rotation = Orientation::new(0.0, b_deg - 10.0, 0.0).rotation_to(&Orientation::new(
                0.0,
                b_deg + 10.0,
                0.0,
            ));
            for step in 0..1000 {
                let [one, next] = [step, step + 1].map(|step| f64::from(step) / 1000.0);
                let (one, next) = (matrix(&rotation.at(one)), matrix(&rotation.at(next)));
                assert!(difference(&one, &next) < 4e-4);
            }
        }
    }
}
