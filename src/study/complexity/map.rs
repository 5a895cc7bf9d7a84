//! One map: which bins are strong, how many of them are peaks, how much of the sum the strongest hold.

use super::ComplexityOptions;
use crate::mhp::percentiles;

/// The bins of a view, its missing axes in front with one bin each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    bins: [usize; 3],
}

impl Grid {
    /// Of a shape of at most three axes; of more, the leading ones are merged into one.
    pub(super) fn new(shape: &[usize]) -> Self {
        let mut bins = [1; 3];
        for (k, &size) in shape.iter().rev().enumerate() {
            bins[2_usize.saturating_sub(k)] *= size;
        }
        Self { bins }
    }

    /// Cells.
    pub(super) fn cells(&self) -> usize {
        self.bins.iter().product()
    }

    /// 64-bit words of a mask.
    pub(super) fn words(&self) -> usize {
        self.cells().div_ceil(64)
    }

    /// True where `cell` is strictly above all of its up to 26 neighbours.
    fn is_peak(&self, map: &[f64], cell: usize) -> bool {
        let [_, rows, columns] = self.bins;
        let at = [cell / (rows * columns), cell / columns % rows, cell % columns];
        let near = |k: usize| at[k].saturating_sub(1)..(at[k] + 2).min(self.bins[k]);
        let value = map[cell];
        near(0).all(|slice| {
            near(1).all(|row| {
                let line = (slice * rows + row) * columns;
                near(2).all(|column| line + column == cell || map[line + column] < value)
            })
        })
    }
}

/// What a map says by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MapNumbers {
    /// Peaks a cell.
    pub(super) peak_density: f64,
    /// Share of the sum in the top-τ mask; `None` where the sum is 0.
    pub(super) human_saliency: Option<f64>,
}

/// Measures a map without missing cells, and writes the mask of its strong bins, a bit a cell, to `strong`, which has
/// [`Grid::words`] words. `scratch` is overwritten.
pub(super) fn measure(
    map: &[f64],
    grid: &Grid,
    options: &ComplexityOptions,
    strong: &mut [u64],
    scratch: &mut Vec<i64>,
) -> MapNumbers {
    let [kappa, tau] = [100.0 - options.kappa_pct, 100.0 - options.tau_pct];
    let [strong_above, human_above] = if kappa <= tau {
        percentiles(map, [kappa, tau], scratch)
    } else {
        let [tau, kappa] = percentiles(map, [tau, kappa], scratch);
        [kappa, tau]
    };
    for (word, cells) in strong.iter_mut().zip(map.chunks(64)) {
        *word = cells.iter().enumerate().fold(0, |bits, (k, &x)| bits | u64::from(x > strong_above) << k);
    }
    let peaks = bits(strong).filter(|&cell| grid.is_peak(map, cell)).count();
    let peak_density = peaks as f64 / map.len() as f64;
    MapNumbers { peak_density, human_saliency: saliency(map, human_above) }
}

/// The indices of the bits that are set.
fn bits(mask: &[u64]) -> impl Iterator<Item = usize> {
    mask.iter().enumerate().flat_map(|(k, &word)| {
        std::iter::successors(Some(word), |rest| Some(rest & rest.wrapping_sub(1)))
            .take_while(|&rest| rest != 0)
            .map(move |rest| k * 64 + rest.trailing_zeros() as usize)
    })
}

/// Sum above a limit over the sum; `None` where that is 0.
fn saliency(map: &[f64], above: f64) -> Option<f64> {
    let sums = |scale: f64| {
        let (mut all, mut part) = (Sum::default(), Sum::default());
        for &x in map {
            all.add(x * scale);
            part.add(if x > above { x * scale } else { 0.0 });
        }
        (part.value(), all.value())
    };
    let (mut part, mut all) = sums(1.0);
    if !(part.is_finite() && all.is_finite()) {
        // Cells near the largest number: the ratio does not depend on the scale, and no map has 2⁴⁰ cells.
        (part, all) = sums((-40_f64).exp2());
    }
    (all != 0.0).then(|| part / all).filter(|ratio| ratio.is_finite())
}

/// A sum with the error of every addition kept (Knuth): rounded once, whatever the order of the terms. Two maps of the
/// same numbers therefore tie in the ranking, as they do by definition.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    sum: f64,
    error: f64,
}

impl Sum {
    #[inline]
    fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        let kept = sum - self.sum;
        self.error += (self.sum - (sum - kept)) + (x - kept);
        self.sum = sum;
    }

    fn value(self) -> f64 {
        self.sum + self.error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(map: &[f64], shape: &[usize]) -> (MapNumbers, Vec<usize>) {
        let grid = Grid::new(shape);
        let mut strong = vec![0; grid.words()];
        let options = ComplexityOptions { kappa_pct: 50.0, ..ComplexityOptions::default() };
        let numbers = measure(map, &grid, &options, &mut strong, &mut Vec::new());
        (numbers, bits(&strong).collect())
    }

    #[test]
    fn a_plateau_is_no_peak_and_a_corner_is_one() {
        let (numbers, strong) = of(&[9.0, 1.0, 5.0, 1.0, 1.0, 5.0], &[2, 3]);
        assert_eq!(numbers.peak_density, 1.0 / 6.0);
        assert_eq!(strong, [0, 2, 5]);
        assert_eq!(numbers.human_saliency, Some(9.0 / 22.0));
    }

    #[test]
    fn a_constant_map_has_no_strong_bin_and_no_saliency_where_it_is_zero() {
        let (numbers, strong) = of(&[2.0; 70], &[7, 10]);
        assert_eq!((numbers.peak_density, numbers.human_saliency, strong.len()), (0.0, Some(0.0), 0));
        assert_eq!(of(&[0.0; 8], &[2, 2, 2]).0.human_saliency, None);
        assert_eq!(of(&[3.0], &[1, 1]).0.peak_density, 0.0);
    }

    #[test]
    fn in_a_cube_the_slices_are_neighbours() {
        let mut map = vec![0.0; 27];
        (map[13], map[0]) = (5.0, 4.0);
        assert_eq!(of(&map, &[3, 3, 3]).0.peak_density, 1.0 / 27.0, "the corner touches the middle");
        assert_eq!(of(&map, &[27, 1]).0.peak_density, 2.0 / 27.0);
    }

    #[test]
    fn the_sum_does_not_depend_on_the_order_and_does_not_overflow() {
        let sum = |terms: &[f64]| {
            let mut sum = Sum::default();
            for &x in terms {
                sum.add(x);
            }
            sum.value()
        };
        assert_eq!(sum(&[1e16, 1.0, -1e16]), 1.0);
        assert_eq!(sum(&[0.1; 10]), 1.0);
        let huge = [f64::MAX, f64::MAX / 2.0, f64::MAX / 4.0, f64::MAX / 4.0];
        assert_eq!(saliency(&huge, f64::MAX / 2.0), Some(0.5));
    }
}
