//! Filling the cells of a map that hold no number; SPEC section 4.

use crate::radar::unravel;
use smallvec::SmallVec;

/// Replaces NaN and infinite cells by the mean of their finite 3^D neighbours, all at once, repeated until none is
/// left. `map` is a C-ordered array of shape `shape`. Returns how many cells were filled, or `None` where no cell is
/// finite (the map is then unchanged).
pub fn fill_missing(map: &mut [f64], shape: &[usize]) -> Option<usize> {
    let mut missing: Vec<usize> = (0..map.len()).filter(|&i| !map[i].is_finite()).collect();
    let filled = missing.len();
    if filled == map.len() {
        return None;
    }
    // Only what borders on a number can be filled, and after the first round only what borders on what was filled last: the
    // work grows with the missing cells, not with their square.
    while !missing.is_empty() {
        let found: Vec<(usize, f64)> =
            missing.iter().filter_map(|&cell| neighbour_mean(map, shape, cell).map(|mean| (cell, mean))).collect();
        missing.clear();
        for &(cell, mean) in &found {
            map[cell] = mean;
        }
        for &(cell, _) in &found {
            for_neighbours(shape, cell, |other| {
                if !map[other].is_finite() {
                    missing.push(other);
                }
            });
        }
        missing.sort_unstable();
        missing.dedup();
    }
    Some(filled)
}

fn neighbour_mean(map: &[f64], shape: &[usize], cell: usize) -> Option<f64> {
    let mut near: SmallVec<[f64; 26]> = SmallVec::new();
    for_neighbours(shape, cell, |other| near.extend(Some(map[other]).filter(|x| x.is_finite())));
    let count = near.len() as f64;
    let mean = near.iter().sum::<f64>() / count;
    // The sum of huge numbers may overflow; that of their shares cannot.
    let mean = if mean.is_finite() { mean } else { near.iter().map(|x| x / count).sum() };
    (!near.is_empty()).then_some(mean)
}

/// Calls `visit` with the flat index of each of the up to 3^D − 1 neighbours of `cell`.
pub fn for_neighbours(shape: &[usize], cell: usize, mut visit: impl FnMut(usize)) {
    all_neighbours(shape, cell, |other| {
        visit(other);
        true
    });
}

/// Whether `holds` for all neighbours of `cell`; none is asked after the first for which it does not.
pub(super) fn all_neighbours(shape: &[usize], cell: usize, mut holds: impl FnMut(usize) -> bool) -> bool {
    let (dims, index) = (shape.len(), unravel(cell, shape));
    for code in 0..3_usize.pow(dims as u32) {
        let (mut other, mut digits, mut inside, mut same) = (0, code, true, true);
        for k in 0..dims {
            let offset = digits % 3;
            digits /= 3;
            let moved = (index[k] + offset).checked_sub(1).filter(|&m| m < shape[k]);
            same &= offset == 1;
            match moved {
                Some(m) => other = other * shape[k] + m,
                None => inside = false,
            }
        }
        if inside && !same && !holds(other) {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fills_from_finite_neighbours_all_at_once() {
        let nan = f64::NAN;
        let mut map = vec![1.0, nan, nan, 4.0, f64::INFINITY, nan];
        assert_eq!(fill_missing(&mut map, &[2, 3]), Some(4));
        // Cells (0, 1) and (1, 1) see 1 and 4 in the first round; (0, 2) and (1, 2) see those two in the second.
        assert_eq!(map, vec![1.0, 2.5, 2.5, 4.0, 2.5, 2.5]);
    }

    #[test]
    fn huge_numbers_of_both_signs_have_a_finite_mean() {
        let mut map = vec![1e308, 1e308, f64::NAN, -1e308, -1e308, f64::INFINITY, 1.7e308, 1.7e308, f64::NAN];
        assert_eq!(fill_missing(&mut map, &[9]), Some(3));
        assert_eq!((map[2], map[5], map[8]), (0.0, 1.7e308 / 2.0 - 1e308 / 2.0, 1.7e308));
        let mut map = vec![1.7e308, f64::NAN, 1.7e308, f64::NAN];
        assert_eq!(fill_missing(&mut map, &[4]), Some(2));
        assert!(map.iter().all(|x| *x == 1.7e308), "{map:?}");
    }

    /// Rounds times missing cells would be 10¹⁰ means.
    #[test]
    fn a_long_row_with_one_number_is_filled_from_it() {
        let mut map = vec![f64::NAN; 100_000];
        map[0] = 3.0;
        assert_eq!(fill_missing(&mut map, &[1, 100_000]), Some(99_999));
        assert!(map.iter().all(|x| *x == 3.0));
    }

    #[test]
    fn a_map_without_a_number_is_refused() {
        assert_eq!(fill_missing(&mut [f64::NAN; 4], &[2, 2]), None);
        assert_eq!(fill_missing(&mut [], &[0, 2]), None);
    }

    #[test]
    fn neighbours_stop_at_the_border() {
        let mut seen = Vec::new();
        for_neighbours(&[3, 3], 0, |cell| seen.push(cell));
        seen.sort_unstable();
        assert_eq!(seen, [1, 3, 4]);
        let mut count = 0;
        for_neighbours(&[3, 3, 3], 13, |_| count += 1);
        assert_eq!(count, 26);
    }
}
