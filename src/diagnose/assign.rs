//! Who is who: the pairing of estimated with annotated persons that costs least in all (Kuhn–Munkres).

use pathfinding::matrix::Matrix;
use pathfinding::prelude::kuhn_munkres_min;

/// Costs are compared as whole numbers of this many to a unit: the algorithm needs a total order.
const STEPS: f64 = 1e6;
/// What stands for a cost that is not finite or larger: two such are alike.
const LARGEST: f64 = 1e9;

/// Pairs `rows` things with `columns` others so that the sum of `cost(row, column)` is smallest; of the longer side some stay
/// without a partner. Pairs are (row, column), ascending by row.
pub(super) fn assign(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<(usize, usize)> {
    if rows <= columns {
        return wide(rows, columns, &cost);
    }
    let turned = wide(columns, rows, &|a, b| cost(b, a));
    let mut pairs: Vec<_> = turned.into_iter().map(|(a, b)| (b, a)).collect();
    pairs.sort_unstable();
    pairs
}

/// As [`assign`], for no more rows than columns.
fn wide(rows: usize, columns: usize, cost: &dyn Fn(usize, usize) -> f64) -> Vec<(usize, usize)> {
    if rows == 0 {
        return Vec::new();
    }
    let whole = |(row, column)| {
        let cost = cost(row, column);
        let cost = if cost.is_finite() { cost.clamp(-LARGEST, LARGEST) } else { LARGEST };
        (cost * STEPS).round() as i64
    };
    let weights = Matrix::from_fn(rows, columns, whole);
    kuhn_munkres_min(&weights).1.into_iter().enumerate().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cheapest assignment by trying all.
    fn cheapest(rows: usize, columns: usize, cost: &dyn Fn(usize, usize) -> f64, taken: &mut Vec<usize>) -> f64 {
        if taken.len() == rows {
            return 0.0;
        }
        let row = taken.len();
        let mut best = f64::INFINITY;
        for column in (0..columns).filter(|c| !taken.contains(c)).collect::<Vec<_>>() {
            taken.push(column);
            best = best.min(cost(row, column) + cheapest(rows, columns, cost, taken));
            taken.pop();
        }
        best
    }

    #[test]
    fn the_sum_is_smallest_also_where_the_closest_pair_is_a_trap() {
        // Taking 0 with 0 first (cost 1) leaves 10 for the rest.
        let trap = |a: usize, b: usize| [[1.0, 2.0], [2.0, 10.0]][a][b];
        assert_eq!(assign(2, 2, trap), [(0, 1), (1, 0)]);
        for (rows, columns) in [(1, 1), (3, 3), (6, 6), (3, 6), (2, 7)] {
            let cost = |a: usize, b: usize| ((a * 37 + b * 17 + a * b * 11) % 23) as f64 / 7.0;
            let sum: f64 = assign(rows, columns, cost).iter().map(|&(a, b)| cost(a, b)).sum();
            let best = cheapest(rows, columns, &cost, &mut Vec::new());
            assert!((sum - best).abs() < 1e-5, "{rows} × {columns}: {sum} against {best}");
            let turned = assign(columns, rows, |b, a| cost(a, b));
            assert!((turned.iter().map(|&(b, a)| cost(a, b)).sum::<f64>() - best).abs() < 1e-5);
        }
    }

    #[test]
    fn what_is_not_finite_ends_too() {
        assert_eq!(assign(0, 3, |_, _| 0.0), []);
        assert_eq!(assign(2, 2, |_, _| f64::NAN).len(), 2);
        assert_eq!(assign(2, 2, |a, b| if a == b { f64::INFINITY } else { 1.0 }), [(0, 1), (1, 0)]);
    }
}
