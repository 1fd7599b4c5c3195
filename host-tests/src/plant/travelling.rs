//! A mode that changes along a move: Tajima's simulation of one axis.
//!
//! A mass on a moving base, as in [`super::mode`], whose natural frequency follows from where
//! the base is commanded to be:
//!
//! `ẅ + 2ζω(x) ẇ + ω(x)² w = −ẍ`, and the mass has the velocity `v = ẋ + ẇ`.

use super::mode::Mode;

/// Integration step (Runge and Kutta's fourth order), a hundredth of a period at 200 Hz.
const STEP_S: f64 = 5e-5;

/// A velocity is settled within this part of the feedrate.
const SETTLED: f64 = 1e-3;

/// How long the simulation waits for the mode to settle after the end.
const LONGEST_WAIT_S: f64 = 60.0;

/// The base at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    /// The way travelled in mm.
    pub position_mm: f64,
    /// Its velocity in mm/s.
    pub velocity_mm_s: f64,
    /// Its acceleration in mm/s².
    pub acceleration_mm_s2: f64,
}

/// A move of the base and the mode on it.
pub struct Travel<B, M> {
    /// The base at a time in seconds after its start.
    pub base: B,
    /// The mode after so much of the way in mm.
    pub mode: M,
    /// The feedrate between the phases, mm/s.
    pub feed_mm_s: f64,
    /// When the acceleration ends, seconds.
    pub accelerated_s: f64,
    /// When the deceleration begins, seconds.
    pub decelerates_s: f64,
    /// When the deceleration ends, seconds.
    pub end_s: f64,
}

/// What the mass did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// By how much the velocity passed the feedrate before the deceleration, in % of it.
    pub overshoot_accelerating_percent: f64,
    /// How long after the acceleration the velocity was within 0.1 % of the feedrate for
    /// good; none if it never was before the deceleration.
    pub settling_accelerating_s: Option<f64>,
    /// By how much the velocity passed zero after the deceleration began, in % of the feedrate.
    pub overshoot_decelerating_percent: f64,
    /// How long after the deceleration the velocity was within 0.1 % of the feedrate around
    /// zero for good; none if it was not within a minute.
    pub settling_decelerating_s: Option<f64>,
    /// The largest velocity after the end, in % of the feedrate.
    pub residual_percent: f64,
    /// The velocity of the mass over time, `(s, mm/s)`.
    pub velocity: Vec<(f64, f64)>,
}

impl<B: Fn(f64) -> Base, M: Fn(f64) -> Mode> Travel<B, M> {
    /// Simulates the move until the mass has settled after it.
    #[must_use]
    pub fn answer(&self) -> Answer {
        let (mut w, mut t) = ([0.0; 2], 0.0);
        let mut answer = Answer::default();
        let limit = SETTLED * self.feed_mm_s;
        let mut unsettled_after = (self.accelerated_s, self.end_s);
        let mut lasting = false;
        for step in 1_u32.. {
            w = self.step(t, w);
            t = f64::from(step) * STEP_S;
            let base = (self.base)(t);
            let velocity = base.velocity_mm_s + w[1];
            answer.velocity.push((t, velocity));
            let percent = |excess: f64| 100.0 * excess / self.feed_mm_s;
            if t < self.decelerates_s {
                let excess = velocity - self.feed_mm_s;
                raise(&mut answer.overshoot_accelerating_percent, percent(excess));
                if t >= self.accelerated_s && excess.abs() > limit {
                    unsettled_after.0 = t;
                }
            } else {
                raise(
                    &mut answer.overshoot_decelerating_percent,
                    percent(-velocity),
                );
            }
            if t >= self.end_s {
                raise(&mut answer.residual_percent, percent(velocity.abs()));
                if velocity.abs() > limit {
                    unsettled_after.1 = t;
                }
                // energy only falls from here on: nothing can leave the limit again
                let swing = (self.mode)(base.position_mm).omega() * w[0];
                if swing.hypot(w[1]) <= limit {
                    break;
                }
                if t > self.end_s + LONGEST_WAIT_S {
                    lasting = true;
                    break;
                }
            }
        }
        let (accelerating, decelerating) = unsettled_after;
        answer.settling_accelerating_s = (accelerating + STEP_S < self.decelerates_s)
            .then_some(accelerating - self.accelerated_s);
        answer.settling_decelerating_s = (!lasting).then_some(decelerating - self.end_s);
        answer
    }

    /// `w` and `ẇ` a step after `t`.
    fn step(&self, t: f64, w: [f64; 2]) -> [f64; 2] {
        let half = STEP_S / 2.0;
        let (now, middle, next) = (self.pull(t), self.pull(t + half), self.pull(t + STEP_S));
        let moved = |slope: [f64; 2], h: f64| [w[0] + slope[0] * h, w[1] + slope[1] * h];
        let k1 = now.slope(w);
        let k2 = middle.slope(moved(k1, half));
        let k3 = middle.slope(moved(k2, half));
        let k4 = next.slope(moved(k3, STEP_S));
        std::array::from_fn(|i| w[i] + STEP_S / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    fn pull(&self, t: f64) -> Pull {
        let base = (self.base)(t);
        Pull {
            mode: (self.mode)(base.position_mm),
            acceleration_mm_s2: base.acceleration_mm_s2,
        }
    }
}

/// What acts on the mass at an instant.
struct Pull {
    mode: Mode,
    acceleration_mm_s2: f64,
}

impl Pull {
    /// `ẇ` and `ẅ`.
    fn slope(&self, [deflection, rate]: [f64; 2]) -> [f64; 2] {
        [
            rate,
            self.mode.acceleration(deflection, rate) - self.acceleration_mm_s2,
        ]
    }
}

fn raise(highest: &mut f64, value: f64) {
    *highest = highest.max(value);
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODE: Mode = Mode {
        frequency_hz: 8.0,
        damping: 0.05,
    };

    const FEED_MM_S: f64 = 50.0;
    const ACCELERATION_MM_S2: f64 = 1000.0;
    const PHASE_S: f64 = FEED_MM_S / ACCELERATION_MM_S2;
    const STOP_S: f64 = 4.03;

    /// A base that accelerates and decelerates evenly.
    fn evenly(mode: Mode) -> Answer {
        Travel {
            base: |t: f64| {
                let ramp = |t: f64| (t / PHASE_S).clamp(0.0, 1.0);
                let pushed = |t: f64| f64::from((0.0..PHASE_S).contains(&t));
                Base {
                    // the mode is the same everywhere
                    position_mm: 0.0,
                    velocity_mm_s: FEED_MM_S * (ramp(t) - ramp(t - STOP_S)),
                    acceleration_mm_s2: ACCELERATION_MM_S2 * (pushed(t) - pushed(t - STOP_S)),
                }
            },
            mode: |_| mode,
            feed_mm_s: FEED_MM_S,
            accelerated_s: PHASE_S,
            decelerates_s: STOP_S,
            end_s: STOP_S + PHASE_S,
        }
        .answer()
    }

    /// Velocity of the mass by the free decay about the deflection that the acceleration holds.
    fn exactly(mode: Mode, t: f64) -> f64 {
        let held = ACCELERATION_MM_S2 / mode.omega().powi(2);
        if t < PHASE_S {
            return ACCELERATION_MM_S2 * t + mode.decay((held, 0.0), t).1;
        }
        let (w, rate) = mode.decay((held, 0.0), PHASE_S);
        FEED_MM_S + mode.decay((w - held, rate), t - PHASE_S).1
    }

    #[test]
    fn answers_an_even_acceleration_like_the_textbook() {
        let answer = evenly(MODE);
        let before_stop = || answer.velocity.iter().filter(|(t, _)| *t < STOP_S);
        let (mut highest, mut unsettled_s) = (0.0_f64, 0.0);
        for &(t, velocity) in before_stop() {
            let exact = exactly(MODE, t);
            // a step that ends where the acceleration does sees part of the change
            assert!(
                (velocity - exact).abs() < 0.02,
                "{t}: {velocity}, not {exact}"
            );
            highest = highest.max(exact - FEED_MM_S);
            if (exact - FEED_MM_S).abs() > SETTLED * FEED_MM_S {
                unsettled_s = t - PHASE_S;
            }
        }
        let overshoot = answer.overshoot_accelerating_percent;
        assert!(
            (overshoot - 100.0 * highest / FEED_MM_S).abs() < 0.05,
            "{overshoot}"
        );
        let settled_s = answer.settling_accelerating_s.unwrap();
        assert!(
            (settled_s - unsettled_s).abs() < 0.07,
            "{settled_s} {unsettled_s}"
        );
        // at constant frequency a deceleration mirrors the acceleration
        assert!((answer.overshoot_decelerating_percent - overshoot).abs() < 0.05);
        assert!((answer.residual_percent - overshoot).abs() < 0.05);
    }

    #[test]
    fn a_mode_without_damping_never_settles() {
        let endless = Mode {
            damping: 0.0,
            ..MODE
        };
        let answer = evenly(endless);
        assert_eq!(answer.settling_accelerating_s, None);
        assert_eq!(answer.settling_decelerating_s, None);
    }
}
