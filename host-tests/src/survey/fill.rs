//! Nodes of a map that could not be measured, from those that could.

/// How much a difference of neighbours counts beside a bend: so little that bends decide wherever
/// there are any.
const SLOPE_WEIGHT: f64 = 1e-4;

/// Fills the open nodes of a grid, row after row, so that rows and columns are bent as little as
/// possible: between known nodes straight on, beyond them likewise. Minimises, the known values
/// held,
///
/// `Σ (v₋ − 2v + v₊)² + 10⁻⁴ Σ (v₊ − v)²` over all rows and columns.
///
/// Nothing is filled if nothing is known.
pub fn fill(values: &mut [Option<f64>], columns: usize) {
    let open: Vec<usize> = (0..values.len())
        .filter(|&node| values[node].is_none())
        .collect();
    if open.len() == values.len() || columns == 0 {
        return;
    }
    let mut matrix = vec![vec![0.0; open.len() + 1]; open.len()];
    // Each term is a sum of nodes with weights, to be as close to 0 as can be.
    for term in terms(values.len(), columns) {
        let known: f64 = term
            .iter()
            .filter_map(|&(node, weight)| Some(weight * values[node]?))
            .sum();
        let unknown: Vec<(usize, f64)> = term
            .iter()
            .filter_map(|&(node, weight)| Some((open.binary_search(&node).ok()?, weight)))
            .collect();
        for &(row, weight) in &unknown {
            for &(column, other) in &unknown {
                matrix[row][column] += weight * other;
            }
            matrix[row][open.len()] -= weight * known;
        }
    }
    for (node, value) in open.iter().zip(solved(matrix)) {
        values[*node] = Some(value);
    }
}

/// Bends and slopes along rows and columns, as nodes and their weights.
fn terms(nodes: usize, columns: usize) -> Vec<Vec<(usize, f64)>> {
    let slope = SLOPE_WEIGHT.sqrt();
    let mut terms = Vec::new();
    for node in 0..nodes {
        let ahead = [
            (1, columns - node % columns),
            (columns, (nodes - node).div_ceil(columns)),
        ];
        for (step, left) in ahead {
            if left >= 2 {
                terms.push(vec![(node, -slope), (node + step, slope)]);
            }
            if left >= 3 {
                terms.push(vec![
                    (node, 1.0),
                    (node + step, -2.0),
                    (node + 2 * step, 1.0),
                ]);
            }
        }
    }
    terms
}

/// Solves a symmetric positive definite system, its right side in the last column.
fn solved(mut matrix: Vec<Vec<f64>>) -> Vec<f64> {
    let size = matrix.len();
    for pivot in 0..size {
        let (above, below) = matrix.split_at_mut(pivot + 1);
        for row in below {
            let factor = row[pivot] / above[pivot][pivot];
            for (value, other) in row.iter_mut().zip(&above[pivot]) {
                *value -= factor * other;
            }
        }
    }
    let mut found = vec![0.0; size];
    for row in (0..size).rev() {
        let rest: f64 = (row + 1..size).map(|i| matrix[row][i] * found[i]).sum();
        found[row] = (matrix[row][size] - rest) / matrix[row][row];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(columns: usize, rows: usize) -> Vec<Option<f64>> {
        let value = |node: usize| 8.0 + (node % columns) as f64 - 0.5 * (node / columns) as f64;
        (0..columns * rows).map(|node| Some(value(node))).collect()
    }

    #[test]
    fn a_plane_goes_on_where_nothing_is_known() {
        for open in [vec![4], vec![0], vec![0, 1, 3], vec![7, 11, 10], vec![5, 6]] {
            let expected = plane(4, 3);
            let mut values = expected.clone();
            open.iter().for_each(|&node| values[node] = None);
            fill(&mut values, 4);
            for (value, expected) in values.iter().zip(&expected) {
                let error = value.unwrap() - expected.unwrap();
                assert!(error.abs() < 0.01, "{open:?}: {values:?}");
            }
        }
    }

    #[test]
    fn a_few_are_enough_and_none_are_not() {
        let mut values = vec![None, Some(9.0), None, None];
        fill(&mut values, 2);
        assert!(
            values
                .iter()
                .all(|value| (value.unwrap() - 9.0).abs() < 1e-9)
        );
        let mut values = vec![Some(8.0), None, Some(10.0)];
        fill(&mut values, 1);
        assert!((values[1].unwrap() - 9.0).abs() < 1e-9);
        let mut values = vec![None; 6];
        fill(&mut values, 3);
        assert_eq!(values, [None; 6]);
    }
}
