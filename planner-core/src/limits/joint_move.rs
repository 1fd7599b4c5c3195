//! How long a move of the joints has to take.

use super::config::{Bound, Part};
use super::feed::{Limits, largest};
use crate::kinematics::ArmBounds;

impl Limits {
    /// The shortest duration in s, `asked_s` or more, in which joints may go from rest to rest by
    /// `ways` (rad, and mm of joint 3 of a SCARA), each at constant speed.
    ///
    /// For the joints' own limits it is exact. The tool's limits are kept by bounds that hold
    /// in every posture, since where the arm homes the posture is not known: with
    /// `ω = |θ̇1| + |θ̇2|` the tool moves by `l1 |θ̇1| + l2 ω`, and each link adds `l ω²` to the
    /// acceleration and `3 l ω ω̇ + l ω³` to the jerk. Of a delta robot such bounds do not exist,
    /// since near a parallel singularity the platform moves however slow the arms are: there the
    /// joints' own limits are kept.
    #[must_use]
    pub fn joint_move_s(&self, ways: [f32; 4], asked_s: f32) -> (f32, Option<Bound>) {
        if !self.is_set() {
            return (asked_s, None);
        }
        let per_s = 1.0 / asked_s;
        let mut worst: (f32, Option<Bound>) = (1.0, None);
        let mut take = |found: (f32, Bound)| {
            if found.0 > worst.0 {
                worst = (found.0, Some(found.1));
            }
        };
        for ((joint, way), highest) in (1..).zip(ways).zip(&self.joints) {
            let load = self.boxes.load(way.abs() * per_s, 0.0, 0.0);
            take(largest(
                Part::Joint(joint),
                self.boxes.linear(&load, highest),
            ));
        }
        let ArmBounds::Scara(arm) = &self.arm else {
            return (asked_s * worst.0, worst.1);
        };
        let [way1, way2, way3, _] = ways.map(f32::abs);
        let (link1_mm, link2_mm) = arm.links_mm();
        let (turn1, turn12) = (way1 * per_s, (way1 + way2) * per_s);
        let (per_first, per_both) = (self.boxes.per_first, self.boxes.per_both);
        let (mut velocity, mut acceleration, mut jerk) = (0.0, 0.0, 0.0);
        for (link_mm, turn) in [(link1_mm, turn1), (link2_mm, turn12)] {
            velocity += link_mm * turn;
            acceleration += link_mm * turn * (per_first + turn);
            jerk += link_mm * turn * (per_both + turn * (3.0 * per_first + turn));
        }
        let lift = way3 * per_s;
        let sum = [
            velocity + lift,
            acceleration + lift * per_first,
            jerk + lift * per_both,
        ];
        for (part, highest) in [(Part::Path, &self.path), (Part::Axis, &self.axis)] {
            let [velocity, acceleration, jerk] = sum;
            take(largest(
                part,
                [
                    velocity / highest.velocity,
                    acceleration / highest.acceleration,
                    jerk / highest.jerk,
                ],
            ));
        }
        (asked_s * worst.0, worst.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Robot, RobotConfig};
    use crate::kinematics::ArmKind;
    use crate::limits::Order;

    #[test]
    fn the_joints_of_a_delta_keep_their_own_limits() {
        let mut config = RobotConfig {
            arm: ArmKind::Delta,
            ..RobotConfig::default()
        };
        config
            .set_all("joint3-velocity=50 joint4-velocity=1000 path-velocity=1")
            .unwrap();
        let robot = Robot::new(&config).unwrap();
        let (duration_s, bound) = robot.limits.joint_move_s([0.5, 0.2, 1.0, 0.3], 0.1);
        let least_s = 1.0 / 50_f32.to_radians();
        assert!(
            (1.0..1.001).contains(&(duration_s / least_s)),
            "{duration_s}"
        );
        let expected = Bound {
            part: Part::Joint(3),
            order: Order::Velocity,
        };
        assert_eq!(bound, Some(expected));
    }
}
