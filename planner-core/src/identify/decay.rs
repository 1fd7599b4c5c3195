//! Modes of a free decay by least squares: variable projection.
//!
//! ```text
//! y(t) = c + Σ Re( C_k e^(λ_k t) ),   λ_k = -σ_k + iω_k
//! ```
//!
//! For given `λ` the rest is linear, and next to the solution so is a change of `λ`:
//! `C e^((λ + δ) t) ≈ (C + C δ t) e^(λ t)`. A regression on the columns `1, e^(λ_k t),
//! t e^(λ_k t)` gives the steps of `c`, of `C_k`, and `D_k = C_k δ_k` (Golub, Pereyra: the
//! differentiation of pseudo-inverses, SIAM J. Numer. Anal. 10, 1973, as simplified by Kaufman,
//! BIT 15, 1975). The columns with `t` come last in the triangular factor: its first part gives
//! the sum of squares at the present `λ` with the best `c` and `C_k`, and what follows is the
//! information on `λ` alone, damped as Marquardt has it where the way is far.
//!
//! What is regressed is what the model leaves of the record, and not the record itself, so that
//! single precision does not move the solution.

use core::f32::consts::TAU;

use crate::math::{sin_cos_f32, sqrt_f32};

use super::triangle::{COLUMNS, Row, Triangle};

/// A complex number: real and imaginary part.
pub type Complex = [f32; 2];

/// `a b`.
pub fn product(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// `a / b`, 0 for `b` 0.
pub fn quotient(a: Complex, b: Complex) -> Complex {
    let square = b[0] * b[0] + b[1] * b[1];
    if square > 0.0 {
        product(a, [b[0] / square, -b[1] / square])
    } else {
        [0.0; 2]
    }
}

/// `e^(λ t)` for less than a turn.
pub fn exponential(rate: Complex, time_s: f32) -> Complex {
    let (sin, cos) = sin_cos_f32(rate[1] * time_s);
    let length = libm::expf(rate[0] * time_s);
    [length * cos, length * sin]
}

/// A decaying mode: `Re(C e^(λ t))`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Decay {
    /// `λ = -σ + iω` in 1/s; `|λ|` is the natural frequency, `σ / |λ|` the damping ratio.
    pub rate: Complex,
    /// `C` in the unit of the record.
    pub amplitude: Complex,
}

impl Decay {
    /// Its value at a time in s.
    #[must_use]
    pub fn at(&self, time_s: f32) -> f32 {
        let turns = self.rate[1] * time_s / TAU;
        let angle = (turns - libm::floorf(turns)) * TAU;
        let (sin, cos) = sin_cos_f32(angle);
        let [re, im] = self.amplitude;
        libm::expf(self.rate[0] * time_s) * (re * cos - im * sin)
    }
}

/// A record's modes and constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model<const MODES: usize> {
    /// The modes.
    pub decays: [Decay; MODES],
    /// The constant in the unit of the record.
    pub offset: f32,
}

impl<const MODES: usize> Model<MODES> {
    /// Modes of these rates, their amplitudes not known.
    pub fn at_rates(rates: [Complex; MODES]) -> Self {
        Self {
            decays: rates.map(|rate| Decay {
                rate,
                amplitude: [0.0; 2],
            }),
            offset: 0.0,
        }
    }

    /// Adds `factor` times the model to the samples.
    pub fn add_to(&self, samples: &mut [f32], period_s: f32, factor: f32) {
        let turns = self.decays.map(|decay| exponential(decay.rate, period_s));
        let mut values = self.decays.map(|decay| decay.amplitude);
        for sample in samples {
            let sum: f32 = values.iter().map(|value| value[0]).sum();
            *sample += factor * (self.offset + sum);
            for (value, turn) in values.iter_mut().zip(turns) {
                *value = product(*value, turn);
            }
        }
    }
}

/// The model of least squares.
#[derive(Clone, Copy, Debug)]
pub struct Fit<const MODES: usize> {
    /// The model.
    pub model: Model<MODES>,
    /// Sum of the squares of what it leaves.
    pub squares: f32,
    /// Variance of each rate's real and imaginary part in 1/s², for noise of variance 1 in each
    /// sample.
    pub variances: [[f32; 2]; MODES],
}

/// Passes over the record at the most.
const PASSES: u32 = 24;

/// What a step has to take off the squares to be worth another pass, in variances of a sample's
/// noise: the error left is then below a hundredth of the standard deviation.
const WORTH: f32 = 1e-4;

/// Likewise in parts of the squares that the modes take off: the rounding of the sums.
const ROUNDING: f32 = 1e-9;

/// Marquardt's damping: at the start, and when it is given up.
const DAMPING: (f32, f32) = (1e-3, 1e3);

/// Longest step of `λ` in reciprocal record lengths.
const LONGEST_STEP: f32 = 2.0;

/// Range of `ω` in reciprocal periods: up to 0.45 of the sampling rate.
const HIGHEST_RATE: f32 = 0.45 * TAU;

/// Lowest `ω` in 1/s.
const LOWEST_RATE: f32 = 1.5;

impl<const MODES: usize> Fit<MODES> {
    /// The least squares next to a start. `samples` are centred.
    ///
    #[inline(never)]
    pub fn new(start: Model<MODES>, samples: &[f32], period_s: f32) -> Self {
        let length_s = samples.len() as f32 * period_s;
        let freedom = samples.len().saturating_sub(Trial::<MODES>::END).max(1) as f32;
        let total: f32 = samples.iter().map(|sample| sample * sample).sum();
        let (mut damping, give_up) = DAMPING;
        // A first guess of the amplitudes leaves so little that single precision can weigh it.
        let guess = Trial::at(start, samples, period_s).model;
        let mut best = Trial::at(guess, samples, period_s);
        for _ in 1..PASSES {
            let (next, gain) = best.next(damping, length_s, period_s);
            if gain <= WORTH * best.squares / freedom || gain <= ROUNDING * total {
                break;
            }
            let trial = Trial::at(next, samples, period_s);
            if trial.squares < best.squares {
                best = trial;
                damping = (damping * 0.1).max(1e-6);
            } else {
                damping *= 10.0;
            }
            if damping > give_up {
                break;
            }
        }
        Self {
            model: best.model,
            squares: best.squares,
            variances: best.variances(),
        }
    }
}

impl<const MODES: usize> Fit<MODES> {
    /// Variance of the noise of a sample, if what the fit leaves of so many is noise.
    pub fn noise_variance(&self, samples: usize) -> f32 {
        self.squares / samples.saturating_sub(Trial::<MODES>::END).max(1) as f32
    }
}

/// The least squares for given rates.
#[derive(Clone, Copy)]
struct Trial<const MODES: usize> {
    model: Model<MODES>,
    squares: f32,
    /// Factored as far as the columns without `t`.
    triangle: Triangle,
    scales: Row,
}

impl<const MODES: usize> Trial<MODES> {
    /// Columns without `t`: a constant and two for each mode.
    const STILL: usize = 1 + 2 * MODES;
    /// All columns.
    const END: usize = const {
        assert!(4 * MODES < COLUMNS);
        1 + 4 * MODES
    };

    /// One pass over the record, with the model's amplitudes as a guess.
    #[inline(never)]
    fn at(model: Model<MODES>, samples: &[f32], period_s: f32) -> Self {
        let Sums { triangle, squares } = Sums::of(&model, samples, period_s);
        let mut trial = Self {
            model,
            squares,
            scales: core::array::from_fn(|column| triangle.rows[column][column]),
            triangle,
        };
        trial
            .triangle
            .factor(0..Self::STILL, Self::END, &trial.scales);
        let [offset, amplitudes @ ..] = trial.triangle.solve(Self::STILL);
        trial.model.offset += offset;
        for (decay, change) in trial.model.decays.iter_mut().zip(pairs(&amplitudes)) {
            decay.amplitude[0] += change[0];
            decay.amplitude[1] += change[1];
        }
        // With these amplitudes nothing of the residual is left along those columns.
        let mut taken_off = 0.0;
        for value in trial.triangle.right.iter_mut().take(Self::STILL) {
            taken_off += *value * *value;
            *value = 0.0;
        }
        trial.squares = (squares - taken_off).max(0.0);
        trial
    }

    /// The next rates, with amplitudes as the regression has them, and what it would take off
    /// the squares.
    #[inline(never)]
    fn next(&self, damping: f32, length_s: f32, period_s: f32) -> (Model<MODES>, f32) {
        let mut triangle = self.triangle;
        let moving = Self::STILL..Self::END;
        for column in moving.clone() {
            triangle.rows[column][column] *= 1.0 + damping;
        }
        triangle.factor(moving, Self::END, &self.scales);
        let right = triangle.right[Self::STILL..Self::END].iter();
        let gain = right.map(|value| value * value).sum();
        let x = triangle.solve(Self::END);
        let mut next = self.model;
        next.offset += x[0];
        let amplitudes = pairs(&x[1..Self::STILL]);
        let moves = pairs(&x[Self::STILL..Self::END]);
        for ((decay, still), moved) in next.decays.iter_mut().zip(amplitudes).zip(moves) {
            let mut step = quotient(moved, decay.amplitude);
            let square = step[0] * step[0] + step[1] * step[1];
            let longest = LONGEST_STEP / length_s;
            if square > longest * longest {
                let shorter = longest / sqrt_f32(square);
                step = step.map(|part| part * shorter);
            }
            let [decrease, turn] = &mut decay.rate;
            *turn = (*turn + step[1]).clamp(LOWEST_RATE, HIGHEST_RATE / period_s);
            *decrease = (*decrease + step[0]).clamp(-0.5 * *turn, 2.0 / length_s);
            decay.amplitude[0] += still[0];
            decay.amplitude[1] += still[1];
        }
        (next, gain)
    }

    /// See [`Fit::variances`].
    #[inline(never)]
    fn variances(&self) -> [[f32; 2]; MODES] {
        let mut triangle = self.triangle;
        let moving = Self::STILL..Self::END;
        triangle.factor(moving.clone(), Self::END, &self.scales);
        let mut column = Self::STILL;
        self.model.decays.map(|decay| {
            // δ = D / C: its parts are linear in the parts of D.
            let [re, im] = quotient([1.0, 0.0], decay.amplitude);
            let variances = [[re, -im], [im, re]].map(|parts| {
                let mut weights = [0.0; COLUMNS];
                weights[column] = parts[0];
                weights[column + 1] = parts[1];
                triangle.variance(&weights, moving.clone())
            });
            column += 2;
            variances
        })
    }
}

/// Values two by two.
fn pairs(values: &[f32]) -> impl Iterator<Item = Complex> + '_ {
    values.as_chunks::<2>().0.iter().copied()
}

/// Sums over the record: products of the columns with each other and with the residual.
struct Sums {
    triangle: Triangle,
    /// Of the residual.
    squares: f32,
}

/// The constant's column and two of each mode.
const STILL_COLUMNS: usize = 5;

impl Sums {
    /// The columns that a `t` makes of others share their products but for powers of `t`.
    fn of<const MODES: usize>(model: &Model<MODES>, samples: &[f32], period_s: f32) -> Self {
        let still = Trial::<MODES>::STILL;
        let turns = model.decays.map(|decay| exponential(decay.rate, period_s));
        let mut phasors = [[1.0, 0.0]; MODES];
        let mut products = [[[0.0_f32; 3]; STILL_COLUMNS]; STILL_COLUMNS];
        let mut right = [[0.0_f32; 2]; STILL_COLUMNS];
        let mut squares = 0.0;
        let mut columns = [1.0; STILL_COLUMNS];
        let mut time_s = 0.0;
        for sample in samples {
            let mut residual = sample - model.offset;
            for (mode, phasor) in phasors.iter_mut().enumerate() {
                let [re, im] = *phasor;
                let amplitude = model.decays[mode].amplitude;
                residual -= amplitude[0] * re - amplitude[1] * im;
                columns[1 + 2 * mode] = re;
                columns[2 + 2 * mode] = -im;
                *phasor = product(*phasor, turns[mode]);
            }
            for row in 0..still {
                for column in 0..=row {
                    let once = columns[row] * columns[column];
                    let timed = time_s * once;
                    let [sum, sum_t, sum_tt] = &mut products[row][column];
                    *sum += once;
                    *sum_t += timed;
                    *sum_tt += time_s * timed;
                }
                let once = columns[row] * residual;
                right[row][0] += once;
                right[row][1] += time_s * once;
            }
            squares += residual * residual;
            time_s += period_s;
        }

        let mut triangle = Triangle {
            rows: [[0.0; COLUMNS]; COLUMNS],
            right: [0.0; COLUMNS],
        };
        // A column with `t` stands as far behind its own as there are columns without the constant.
        let shift = still - 1;
        for (row, (products, right)) in products.iter().zip(right).take(still).enumerate() {
            triangle.right[row] = right[0];
            for (column, products) in products.iter().enumerate().take(row + 1) {
                triangle.rows[row][column] = products[0];
            }
            if row == 0 {
                continue;
            }
            triangle.right[row + shift] = right[1];
            for (column, products) in products.iter().enumerate().take(row + 1) {
                triangle.rows[row + shift][column] = products[1];
                if column > 0 {
                    triangle.rows[column + shift][row] = products[1];
                    triangle.rows[row + shift][column + shift] = products[2];
                }
            }
        }
        Self { triangle, squares }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decay_is_that_of_double_precision() {
        let decay = Decay {
            rate: [-3.0, 250.0],
            amplitude: [2.0, -1.0],
        };
        for step in 0..2000 {
            let time_s = step as f32 * 1e-3;
            let (sin, cos) = (250.0 * f64::from(time_s)).sin_cos();
            let exact = (-3.0 * f64::from(time_s)).exp() * (2.0 * cos + sin);
            assert!(
                (f64::from(decay.at(time_s)) - exact).abs() < 1e-4,
                "{time_s}"
            );
        }
    }

    /// The variance that the fit states is that of the classical result for a sinusoid in white
    /// noise: `var ω = 24 σ² / (A² N³ T²)` for N samples, T apart (and σ's likewise).
    #[test]
    fn the_variance_of_a_lasting_mode_is_the_cramer_rao_bound() {
        let mode = Model {
            decays: [Decay {
                rate: [0.0, 60.0],
                amplitude: [0.6, 0.8],
            }],
            offset: 0.0,
        };
        let mut samples = [0.0; 400];
        mode.add_to(&mut samples, 0.004, 1.0);
        let fit = Fit::new(Model::at_rates([[-0.5, 61.0]]), &samples, 0.004);
        let bound = 24.0 / (400.0_f32.powi(3) * 0.004 * 0.004);
        for variance in fit.variances[0] {
            assert!(
                (0.95..1.05).contains(&(variance / bound)),
                "{variance} {bound}"
            );
        }
        assert!((fit.model.decays[0].rate[1] - 60.0).abs() < 1e-3);
        assert!(fit.model.decays[0].rate[0].abs() < 1e-3);
    }
}
