//! The order in which a box of a view's cells is summed over joints.
//!
//! Tiles are four bins along the last axis and eight along the one before, sixteen beside each other a block: made for maps
//! that are wide both ways. On a grid of 100000 × 1 cells nearly all of every block would lie beyond the box, which costs its
//! memory and its time sixty-four times. There the axes change places first, the longest last: a view is the same with its
//! axes in any order. A grid that tiles fit is left as it is, and double precision, which has no tiles, always.

use super::Precision;
use super::tiles::{TileGrid, blocks_of};
use crate::radar::{AxisKind, View};
use smallvec::SmallVec;

/// Axes change places where that leaves at most one of so many blocks,
const MIN_SAVING: usize = 4;
/// of at least so many: fewer cost nothing.
const MIN_BLOCKS: usize = 64;
/// Where a Doppler axis stays outermost, one of so many is enough.
const MIN_SAVING_APART: usize = 2;
/// What a block costs where a Doppler axis runs through its tiles, beside one where none does.
const DOPPLER_COST: usize = 8;

/// A box of cells as it is summed.
pub(super) struct CellBox {
    /// The view with its axes in the order of the sum.
    pub view: View,
    /// `[lo, hi)` along these axes.
    pub bins: Vec<[usize; 2]>,
    /// Marks of the cells, in C order of these axes.
    pub marked: Vec<bool>,
    /// Whether each takes part; `None` where all do.
    pub there: Option<Vec<bool>>,
    /// The same in tiles; empty in double precision.
    pub grid: TileGrid,
    /// The place among the view's own axes of each.
    order: SmallVec<[usize; 3]>,
    own_bins: SmallVec<[[usize; 2]; 3]>,
}

impl CellBox {
    /// Of the box `bins` of `view` whose cells are `marked` (C order); where not all take part, `there` says which do.
    pub(super) fn new(
        view: &View,
        bins: &[[usize; 2]],
        (marked, there): (&[bool], Option<&[bool]>),
        precision: Precision,
    ) -> Self {
        let order = match precision {
            Precision::F64 => (0..bins.len()).collect(),
            Precision::F32 => order_of(bins, |k| view.axes.get(k).is_some_and(|axis| axis.kind == AxisKind::Doppler)),
        };
        let axes = order.iter().filter_map(|&k| view.axes.get(k).cloned()).collect();
        let bins_in_order: Vec<[usize; 2]> = order.iter().map(|&k| bins[k]).collect();
        let marked = into_order(&order, bins, marked);
        let there = there.map(|there| into_order(&order, bins, there));
        let grid = match precision {
            Precision::F64 => TileGrid::new(&[], &[], None),
            Precision::F32 => TileGrid::new(&bins_in_order, &marked, there.as_deref()),
        };
        let view = View { axes, region: None, ..view.clone() };
        Self { view, bins: bins_in_order, marked, there, grid, order, own_bins: bins.into() }
    }

    /// Values of the cells in the order of the sum, from those in C order of the view's own axes.
    pub(super) fn in_order_of_sum(&self, values: &[f64]) -> Vec<f64> {
        into_order(&self.order, &self.own_bins, values)
    }

    /// Values of the cells in C order of the view's own axes, from those in the order of the sum.
    pub(super) fn in_order_of_view(&self, values: Vec<f64>) -> Vec<f64> {
        if self.order.is_sorted() {
            return values;
        }
        let own = (0..self.order.len()).map(|axis| self.order.iter().position(|&k| k == axis).unwrap_or(axis));
        into_order(&own.collect::<SmallVec<[usize; 3]>>(), &self.bins, &values)
    }
}

/// The order of the axes of a box: their own, or the one that costs least where that saves most of the blocks. Three axes with a
/// Doppler axis among them may leave that one outermost: a tile that it runs through needs an exponential a cell.
fn order_of(bins: &[[usize; 2]], is_doppler: impl Fn(usize) -> bool) -> SmallVec<[usize; 3]> {
    let own: SmallVec<[usize; 3]> = (0..bins.len()).collect();
    let size = |k: usize| bins[k][1].saturating_sub(bins[k][0]);
    let cost = |order: &[usize]| {
        let within = order.iter().skip(bins.len().saturating_sub(2)).any(|&k| is_doppler(k));
        blocks_of(order.iter().map(|&k| size(k))) * if within { DOPPLER_COST } else { 1 }
    };
    let (mut sorted, mut doppler_first) = (own.clone(), own.clone());
    sorted.sort_by_key(|&k| size(k));
    doppler_first.sort_by_key(|&k| (!is_doppler(k), size(k)));
    let now = cost(&own);
    let worth = |order: &SmallVec<[usize; 3]>, saving: usize| now >= MIN_BLOCKS && cost(order) <= now / saving;
    if cost(&doppler_first) < cost(&sorted) && worth(&doppler_first, MIN_SAVING_APART) {
        doppler_first
    } else if worth(&sorted, MIN_SAVING) {
        sorted
    } else {
        own
    }
}

/// `values` of a box (C order) in C order of its axes `order`.
fn into_order<T: Copy>(order: &[usize], bins: &[[usize; 2]], values: &[T]) -> Vec<T> {
    if order.is_sorted() {
        return values.to_vec();
    }
    let sizes: SmallVec<[usize; 3]> = bins.iter().map(|[lo, hi]| hi - lo).collect();
    let stride = |k: usize| sizes[k + 1..].iter().product::<usize>();
    let cells = order.iter().fold(vec![0], |cells: Vec<usize>, &k| {
        cells.iter().flat_map(|&cell| (0..sizes[k]).map(move |bin| cell + bin * stride(k))).collect()
    });
    cells.into_iter().filter_map(|cell| values.get(cell).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_grid_that_tiles_do_not_fit_is_turned() {
        let order =
            |sizes: &[usize]| order_of(&sizes.iter().map(|&n| [3, 3 + n]).collect::<Vec<_>>(), |_| false).to_vec();
        for fits in
            [&[256, 128][..], &[80, 64], &[128, 40], &[1, 100_000], &[1, 1], &[3, 2], &[64, 64, 32], &[1, 1, 50_000]]
        {
            assert!(order(fits).is_sorted(), "{fits:?}");
        }
        assert_eq!(order(&[100_000, 1]), [1, 0]);
        assert_eq!(order(&[100_000, 3]), [1, 0]);
        assert_eq!(order(&[50_000, 1, 1]), [1, 2, 0]);
        assert_eq!(order(&[900, 1, 700]), [1, 2, 0]);
    }

    #[test]
    fn a_doppler_axis_stays_out_of_the_tiles_where_that_saves_as_much() {
        let order = |sizes: [usize; 3], doppler: usize| order_of(&sizes.map(|n| [0, n]), |k| k == doppler).to_vec();
        assert_eq!(order([16, 64, 12], 0), [0, 2, 1]);
        assert_eq!(order([16, 47, 10], 0), [0, 2, 1]);
        assert_eq!(order([16, 47, 10], 3), [2, 0, 1]);
        assert_eq!(order([50_000, 1, 1], 0), [1, 2, 0], "a tile a bin would be worse");
    }

    #[test]
    fn cells_come_back_to_their_places() {
        let bins = [[1, 5], [0, 3], [2, 4]];
        let values: Vec<f64> = (0..24).map(f64::from).collect();
        let turned = into_order(&[1, 2, 0], &bins, &values);
        // The cell (2, 1, 0) of the box is number 14, and (1, 0, 2) of the turned one 10.
        assert_eq!(turned[10], 14.0);
        let bins_in_order: Vec<[usize; 2]> = [1, 2, 0].map(|k: usize| bins[k]).to_vec();
        assert_eq!(into_order(&[2, 0, 1], &bins_in_order, &turned), values);
    }
}
