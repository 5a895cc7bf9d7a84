//! Sets of cells of a map: boxes around them and connected patches.

use super::FindingPlace;
use crate::mhp::for_neighbours;

/// The box around flat cells of a map of `shape`; `None` where there are none.
pub(super) fn bounds(shape: &[usize], cells: &[usize]) -> Option<(Vec<usize>, Vec<usize>)> {
    let mut corners: Option<(Vec<usize>, Vec<usize>)> = None;
    for &cell in cells {
        let at = index(shape, cell);
        match &mut corners {
            None => corners = Some((at.clone(), at)),
            Some((lo, hi)) => {
                for ((lo, hi), at) in lo.iter_mut().zip(hi).zip(at) {
                    (*lo, *hi) = ((*lo).min(at), (*hi).max(at));
                }
            }
        }
    }
    corners
}

/// The box around flat cells as a place.
pub(super) fn place(view: usize, shape: &[usize], cells: &[usize]) -> Option<FindingPlace> {
    bounds(shape, cells).map(|(lo, hi)| FindingPlace::Cells { view, lo, hi })
}

/// The index along each axis of a flat cell.
pub(super) fn index(shape: &[usize], cell: usize) -> Vec<usize> {
    let mut rest = cell;
    let mut at: Vec<usize> = shape
        .iter()
        .rev()
        .map(|&bins| {
            let bin = rest % bins.max(1);
            rest /= bins.max(1);
            bin
        })
        .collect();
    at.reverse();
    at
}

/// The cells of the largest patch of `set` (cells that touch, corners included), ascending; the first of equals.
pub(super) fn largest_patch(shape: &[usize], set: &[bool]) -> Vec<usize> {
    let mut left = set.to_vec();
    let mut best: Vec<usize> = Vec::new();
    for start in 0..left.len() {
        if !left[start] {
            continue;
        }
        left[start] = false;
        let mut patch = vec![start];
        let mut next = 0;
        while let Some(&cell) = patch.get(next) {
            next += 1;
            for_neighbours(shape, cell, |other| {
                if left.get(other) == Some(&true) {
                    left[other] = false;
                    patch.push(other);
                }
            });
        }
        if patch.len() > best.len() {
            best = patch;
        }
    }
    best.sort_unstable();
    best
}

/// The flat cells where `set` holds, ascending.
pub(super) fn members(set: &[bool]) -> Vec<usize> {
    set.iter().enumerate().filter(|(_, member)| **member).map(|(cell, _)| cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_patch_joins_over_corners_and_not_over_borders() {
        let text = "##...\n#....\n...#.\n..#.#\n....#";
        let set: Vec<bool> = text.chars().filter(|c| *c != '\n').map(|c| c == '#').collect();
        let patch = largest_patch(&[5, 5], &set);
        assert_eq!(patch, [13, 17, 19, 24]);
        assert_eq!(bounds(&[5, 5], &patch), Some((vec![2, 2], vec![4, 4])));
        assert_eq!(largest_patch(&[5, 5], &[false; 25]), Vec::<usize>::new());
        assert_eq!(bounds(&[5, 5], &[]), None);
        // The end of one row and the start of the next are no neighbours.
        assert_eq!(largest_patch(&[2, 3], &[false, false, true, true, false, false]).len(), 1);
        assert_eq!(index(&[2, 3, 4], 23), [1, 2, 3]);
    }
}
