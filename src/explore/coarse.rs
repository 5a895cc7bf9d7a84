//! The order of a grid's points from coarse to fine: every eighth along each axis, then every fourth, every second, all.

/// The widest step between points that are done first.
const WIDEST: usize = 8;

/// For each stride the points (C order, the last axis fastest) that it adds.
pub(super) fn levels(shape: &[usize]) -> Vec<(usize, Vec<usize>)> {
    let total: usize = shape.iter().product();
    let mut done = vec![false; total];
    let mut levels = Vec::new();
    let mut stride = WIDEST;
    while stride >= 1 {
        let on = |mut point: usize| {
            shape.iter().rev().all(|&n| {
                let k = point % n.max(1);
                point /= n.max(1);
                // The last value belongs to the coarsest look: else a range's end is seen last.
                k.is_multiple_of(stride) || k + 1 == n
            })
        };
        let points: Vec<usize> = (0..total).filter(|&point| !done[point] && on(point)).collect();
        for &point in &points {
            done[point] = true;
        }
        if !points.is_empty() {
            levels.push((stride, points));
        }
        stride /= 2;
    }
    levels
}

/// How many pieces each stride has, the widest first.
pub(super) fn left_by_stride<T>(pieces: &[T], stride: impl Fn(&T) -> usize) -> Vec<(usize, usize)> {
    let mut left: Vec<(usize, usize)> = Vec::new();
    for piece in pieces {
        match left.last_mut() {
            Some((of, count)) if *of == stride(piece) => *count += 1,
            _ => left.push((stride(piece), 1)),
        }
    }
    left
}

/// A piece of `stride` is done: the finest stride that is done with it, together with all wider ones.
pub(super) fn ended(left: &mut Vec<(usize, usize)>, stride: usize) -> Option<usize> {
    if let Some((_, count)) = left.iter_mut().find(|(of, _)| *of == stride) {
        *count -= 1;
    }
    let mut last = None;
    while left.first().is_some_and(|(_, count)| *count == 0) {
        last = Some(left.remove(0).0);
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_comes_once_and_the_corners_first() {
        for shape in [vec![24, 24], vec![24], vec![1], vec![2, 7], vec![9, 3]] {
            let levels = levels(&shape);
            let mut all: Vec<usize> = levels.iter().flat_map(|(_, points)| points.clone()).collect();
            assert_eq!(levels.first().map(|(_, points)| points[0]), Some(0), "{shape:?}");
            all.sort_unstable();
            assert_eq!(all, (0..shape.iter().product()).collect::<Vec<_>>(), "{shape:?}");
        }
        let sizes: Vec<(usize, usize)> =
            levels(&[24, 24]).iter().map(|(stride, points)| (*stride, points.len())).collect();
        assert_eq!(sizes, [(8, 16), (4, 33), (2, 120), (1, 407)]);
    }

    #[test]
    fn a_level_ends_with_its_last_piece_and_after_those_before() {
        let mut left = left_by_stride(&[8, 8, 4, 1], |stride| *stride);
        assert_eq!(left, [(8, 2), (4, 1), (1, 1)]);
        assert_eq!(ended(&mut left, 8), None);
        assert_eq!(ended(&mut left, 4), None, "a wider one is not done");
        assert_eq!(ended(&mut left, 8), Some(4));
        assert_eq!(ended(&mut left, 1), Some(1));
    }
}
