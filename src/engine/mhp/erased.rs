//! Cells whose measurement is taken away before a fit: what would it do without that echo?

use super::fill::for_neighbours;
use super::percentile::percentile;
use super::{FitError, Problem};
use crate::radar::{View, unravel};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A box of cells of one view, or some of its cells.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErasedCells {
    /// Index of the view.
    pub view: usize,
    /// Bins of each axis, `[lo, hi)`, as [`View::region`] has them.
    pub bins: Vec<[usize; 2]>,
    /// Flat indices (C order, ascending) of the cells of the box that are meant; empty where all are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cells: Vec<usize>,
}

impl ErasedCells {
    /// These cells of a view (flat indices, C order); `None` where there is none of them.
    pub fn of_cells(view: (usize, &View), cells: impl IntoIterator<Item = usize>) -> Option<Self> {
        let (index, view) = view;
        let shape = view.shape();
        let mut cells: Vec<usize> = cells.into_iter().filter(|&cell| cell < view.cells()).collect();
        cells.sort_unstable();
        cells.dedup();
        let mut bins: Vec<[usize; 2]> = vec![[usize::MAX, 0]; shape.len()];
        for &cell in &cells {
            for ([lo, hi], at) in bins.iter_mut().zip(unravel(cell, &shape)) {
                (*lo, *hi) = ((*lo).min(at), (*hi).max(at + 1));
            }
        }
        (!cells.is_empty()).then_some(Self { view: index, bins, cells })
    }

    /// Whether a cell is meant, `cell` in C order.
    pub fn holds(&self, cell: usize, shape: &[usize]) -> bool {
        if !self.cells.is_empty() {
            return self.cells.binary_search(&cell).is_ok();
        }
        let inside = |(bin, &[lo, hi]): (usize, &[usize; 2])| (lo..hi).contains(&bin);
        self.bins.len() == shape.len() && unravel(cell, shape).into_iter().zip(&self.bins).all(inside)
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        let boxed = || self.bins.iter().map(|[lo, hi]| hi.saturating_sub(*lo)).product();
        if self.cells.is_empty() { boxed() } else { self.cells.len() }
    }
}

/// A mark a cell of each view, C order: whether it is erased.
pub fn erased_marks(views: &[View], erased: &[ErasedCells]) -> Vec<Vec<bool>> {
    let of_view = |(index, view): (usize, &View)| {
        let (shape, mut marks) = (view.shape(), vec![false; view.cells()]);
        let row = marks.len() / shape.first().map_or(1, |&bins| bins.max(1));
        for cells in erased.iter().filter(|cells| cells.view == index) {
            let [lo, hi] = cells.bins.first().copied().unwrap_or_default();
            let rows = lo.saturating_mul(row)..hi.saturating_mul(row).min(marks.len());
            for cell in rows {
                marks[cell] |= cells.holds(cell, &shape);
            }
        }
        marks
    };
    views.iter().enumerate().map(of_view).collect()
}

/// Whether something of a view's map is left without these cells.
pub fn leaves_any((index, view): (usize, &View), erased: &[ErasedCells]) -> bool {
    let shape = view.shape();
    let of_view: Vec<&ErasedCells> = erased.iter().filter(|cells| cells.view == index).collect();
    (0..view.cells()).any(|cell| of_view.iter().all(|cells| !cells.holds(cell, &shape)))
}

/// The problem as if these cells had not been measured: [`Problem::without`].
///
/// # Errors
/// Where nothing is left of a map.
pub fn without(problem: &Arc<Problem>, erased: &[ErasedCells]) -> Result<Arc<Problem>, FitError> {
    if erased.is_empty() {
        return Ok(Arc::clone(problem));
    }
    problem.without(&erased_marks(&problem.views, erased)).map(Arc::new)
}

/// The cells of the whole connected echo that a cell belongs to: those as strong as H_ori's mask at `tau_pct` asks of the cells
/// `inside` the EM region (of all, where there is none), reached from the cell over neighbours. Empty where the cell is weaker.
pub fn connected_echo((view, map): (&View, &[f64]), inside: Option<&[bool]>, tau_pct: f64, cell: usize) -> Vec<usize> {
    let region = map
        .iter()
        .enumerate()
        .filter(|(k, h)| !h.is_nan() && inside.is_none_or(|inside| inside.get(*k) == Some(&true)));
    let threshold = percentile(&region.map(|(_, h)| *h).collect::<Vec<_>>(), 100.0 - tau_pct);
    let is_strong = |cell: usize| map.get(cell).is_some_and(|h| *h > threshold);
    if !is_strong(cell) {
        return Vec::new();
    }
    let (shape, mut seen) = (view.shape(), vec![false; map.len()]);
    let (mut echo, mut open) = (Vec::new(), vec![cell]);
    seen[cell] = true;
    while let Some(cell) = open.pop() {
        echo.push(cell);
        for_neighbours(&shape, cell, |other| {
            if is_strong(other) && !std::mem::replace(&mut seen[other], true) {
                open.push(other);
            }
        });
    }
    echo.sort_unstable();
    echo
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::radar::{Axis, AxisKind, PointSpread, Quantity, Spacing};

    #[test]
    fn boxes_and_single_cells_mark_what_they_name() {
        let axis = |kind, bins| Axis { kind, bins, lo: 0.0, hi: 1.0, spacing: Spacing::Linear };
        let view = View {
            array: "hm".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread::default(),
            pose: crate::geometry::Pose::default(),
            axes: vec![axis(AxisKind::Range, 4), axis(AxisKind::Y, 5)],
            region: None,
        };
        let boxed = ErasedCells { view: 0, bins: vec![[1, 3], [0, 2]], cells: Vec::new() };
        let single = ErasedCells::of_cells((0, &view), [19, 7, 7, 99]).unwrap();
        assert_eq!((single.bins.clone(), single.count(), boxed.count()), (vec![[1, 4], [2, 5]], 2, 4));
        let marks = erased_marks(std::slice::from_ref(&view), &[boxed, single]);
        let marked: Vec<usize> = (0..20).filter(|&cell| marks[0][cell]).collect();
        assert_eq!(marked, [5, 6, 7, 10, 11, 19]);
        assert!(ErasedCells::of_cells((0, &view), [20]).is_none());
    }
}
