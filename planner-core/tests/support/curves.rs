//! Lines and helices to walk along.

use std::cell::Cell;

use planner_core::kinematics::{Curve, Travel};

/// A line that counts how often it is sampled, and knows its travel.
pub struct Line {
    from: [f64; 4],
    to: [f64; 4],
    /// How often.
    pub samples: Cell<u32>,
}

impl Line {
    /// Between two poses in mm and degrees.
    pub fn new(from: [f64; 4], to: [f64; 4]) -> Self {
        Self {
            from,
            to,
            samples: Cell::new(0),
        }
    }
}

impl Curve for Line {
    fn length_mm(&self) -> f64 {
        (0..3)
            .map(|i| (self.to[i] - self.from[i]).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    fn pose(&self, u: f64) -> [f64; 4] {
        self.samples.set(self.samples.get() + 1);
        std::array::from_fn(|i| self.from[i] + (self.to[i] - self.from[i]) * u)
    }

    fn travel(&self) -> Travel {
        let [x, y, z, c] = std::array::from_fn(|i| (self.to[i] - self.from[i]).abs());
        Travel {
            xy_mm: x.hypot(y) as f32,
            z_mm: z as f32,
            c_deg: c as f32,
        }
    }
}

/// A helix, with the default travel.
pub struct Arc {
    /// X, Y, Z in mm and C in degrees where it begins.
    pub center: [f64; 4],
    /// In mm.
    pub radius: f64,
    /// Where on the circle it begins, in rad.
    pub start: f64,
    /// In rad.
    pub sweep: f64,
    /// In mm.
    pub climb: f64,
    /// Of C, in degrees.
    pub turn: f64,
}

impl Curve for Arc {
    fn length_mm(&self) -> f64 {
        (self.radius * self.sweep).hypot(self.climb)
    }

    fn pose(&self, u: f64) -> [f64; 4] {
        let (s, c) = (self.start + self.sweep * u).sin_cos();
        let [x, y, z, yaw] = self.center;
        [
            x + self.radius * c,
            y + self.radius * s,
            z + self.climb * u,
            yaw + self.turn * u,
        ]
    }
}
