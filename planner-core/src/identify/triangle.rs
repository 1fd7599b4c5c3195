//! Normal equations and their triangular factor.

use crate::math::rsqrt;

/// Columns at the most: a constant and four for each of two modes.
pub const COLUMNS: usize = 9;

/// A value for each column.
pub type Row = [f32; COLUMNS];

/// Least part of a column's square that the columns before it may leave.
const LEAST_PIVOT: f32 = 3e-6;

/// Normal equations `AᵀA x = Aᵀr`, turned column by column into `L z = Aᵀr` and `Lᵀ x = z`.
///
/// Up to a column, `L` and `z` are in place; behind it, what the columns before leave of
/// `AᵀA` and `Aᵀr` (the Schur complement).
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Lower triangle; on the diagonal of `L` the reciprocals.
    pub rows: [Row; COLUMNS],
    /// The right side.
    pub right: Row,
}

impl Triangle {
    /// Factors the columns of a range; those before it are factored, those from `end` on do not
    /// exist. A column that the ones before it already contain is left out, as zeros.
    ///
    /// `scales` are the columns' own squares.
    pub fn factor(&mut self, range: core::ops::Range<usize>, end: usize, scales: &Row) {
        for pivot in range {
            let square = self.rows[pivot][pivot];
            let reciprocal = if square > LEAST_PIVOT * scales[pivot] {
                let root = rsqrt(square);
                root * (1.5 - 0.5 * square * root * root)
            } else {
                0.0
            };
            self.rows[pivot][pivot] = reciprocal;
            self.right[pivot] *= reciprocal;
            let right = self.right[pivot];
            for row in pivot + 1..end {
                let below = self.rows[row][pivot] * reciprocal;
                self.rows[row][pivot] = below;
                self.right[row] -= below * right;
                for column in pivot + 1..=row {
                    self.rows[row][column] -= below * self.rows[column][pivot];
                }
            }
        }
    }

    /// `x` for the columns before `end`, all factored.
    pub fn solve(&self, end: usize) -> Row {
        let mut x = self.right;
        for column in (0..end).rev() {
            let behind: f32 = (column + 1..end)
                .map(|row| self.rows[row][column] * x[row])
                .sum();
            x[column] = (x[column] - behind) * self.rows[column][column];
        }
        x
    }

    /// `gᵀ (AᵀA)⁻¹ g` for a `g` that is zero outside `range`, which ends with the last column.
    pub fn variance(&self, g: &Row, range: core::ops::Range<usize>) -> f32 {
        let mut z = [0.0; COLUMNS];
        let mut sum = 0.0;
        for row in range.clone() {
            let before: f32 = (range.start..row)
                .map(|column| self.rows[row][column] * z[column])
                .sum();
            z[row] = (g[row] - before) * self.rows[row][row];
            sum += z[row] * z[row];
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Gauss's elimination in `f64`, of a positive definite matrix.
    fn eliminate(mut rows: [[f64; COLUMNS]; COLUMNS], mut right: [f64; COLUMNS]) -> [f64; COLUMNS] {
        for pivot in 0..COLUMNS {
            for row in pivot + 1..COLUMNS {
                let factor = rows[row][pivot] / rows[pivot][pivot];
                let above = rows[pivot];
                for (value, above) in rows[row].iter_mut().zip(above) {
                    *value -= factor * above;
                }
                right[row] -= factor * right[pivot];
            }
        }
        for pivot in (0..COLUMNS).rev() {
            let behind: f64 = (pivot + 1..COLUMNS)
                .map(|at| rows[pivot][at] * right[at])
                .sum();
            right[pivot] = (right[pivot] - behind) / rows[pivot][pivot];
        }
        right
    }

    proptest! {
        #[test]
        fn it_solves_as_double_precision_does(
            columns: [[i8; COLUMNS]; COLUMNS], right: [i8; COLUMNS],
        ) {
            let column = |at: usize| columns[at].map(|value| f64::from(value) / 128.0);
            let matrix: [[f64; COLUMNS]; COLUMNS] = core::array::from_fn(|row| {
                core::array::from_fn(|other| {
                    let product: f64 = column(row).iter().zip(column(other)).map(|(a, b)| a * b).sum();
                    product + f64::from(u8::from(row == other))
                })
            });
            let mut triangle = Triangle {
                rows: matrix.map(|row| row.map(|value| value as f32)),
                right: right.map(f32::from),
            };
            let scales = core::array::from_fn(|at| triangle.rows[at][at]);
            // in two parts, as the fit does it
            triangle.factor(0..5, COLUMNS, &scales);
            triangle.factor(5..COLUMNS, COLUMNS, &scales);
            let exact = eliminate(matrix, right.map(f64::from));
            for (value, exact) in triangle.solve(COLUMNS).into_iter().zip(exact) {
                prop_assert!((f64::from(value) - exact).abs() < 1e-2, "{value} {exact}");
            }
            // The variance of the last value is the last element of the inverse.
            let mut unit = [0.0; COLUMNS];
            unit[COLUMNS - 1] = 1.0;
            let inverse = eliminate(matrix, unit)[COLUMNS - 1];
            let variance = triangle.variance(&unit.map(|value| value as f32), 5..COLUMNS);
            prop_assert!((f64::from(variance) - inverse).abs() < 1e-4);
        }
    }

    #[test]
    fn a_column_twice_is_left_out() {
        let mut triangle = Triangle {
            rows: [[0.0; COLUMNS]; COLUMNS],
            right: [0.0; COLUMNS],
        };
        (
            triangle.rows[0][0],
            triangle.rows[1][0],
            triangle.rows[1][1],
        ) = (2.0, 2.0, 2.0);
        triangle.right = [4.0; COLUMNS];
        triangle.factor(0..2, 2, &[2.0; COLUMNS]);
        let [first, second, ..] = triangle.solve(2);
        assert!((first - 2.0).abs() < 1e-5, "{first}");
        assert_eq!(second, 0.0);
    }
}
