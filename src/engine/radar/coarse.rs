//! A map in few cells.

/// A map as `size` means of the cells' absolute values, over all but its last two axes too; what is not finite is left out.
pub fn coarse(shape: &[usize], cells: &[f64], [height, width]: [usize; 2]) -> Vec<f64> {
    let (columns, rows) = match shape {
        [.., rows, columns] => ((*columns).max(1), (*rows).max(1)),
        _ => (cells.len().max(1), 1),
    };
    let mut sums = vec![(0.0, 0u32); height * width];
    for (k, cell) in cells.iter().enumerate().filter(|(_, cell)| cell.is_finite()) {
        let (row, column) = (k / columns % rows, k % columns);
        let (sum, count) = &mut sums[row * height / rows * width + column * width / columns];
        (*sum, *count) = (*sum + cell.abs(), *count + 1);
    }
    sums.into_iter().map(|(sum, count)| if count > 0 { sum / f64::from(count) } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_means_over_all_but_the_last_two_axes() {
        // Two Doppler bins of 2 × 4 cells, of which one is missing.
        let cells = [1.0, 3.0, 5.0, 7.0, 2.0, 2.0, 2.0, 2.0, 1.0, -3.0, f64::NAN, 7.0, 4.0, 4.0, 4.0, 4.0];
        assert_eq!(coarse(&[2, 2, 4], &cells, [2, 2]), [2.0, 19.0 / 3.0, 3.0, 3.0]);
        assert_eq!(coarse(&[4], &[1.0, 2.0, 3.0, 4.0], [1, 2]), [1.5, 3.5]);
        assert_eq!(coarse(&[1, 1], &[9.0], [2, 1]), [9.0, 0.0], "fewer cells than asked for leave some empty");
    }
}
