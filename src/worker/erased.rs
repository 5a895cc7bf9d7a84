//! Cells whose measurement is taken away before a fit: what would it do without that echo?

use crate::mhp::{FitError, Problem};
use crate::radar::{View, unravel};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A box of cells of one view.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErasedCells {
    /// Index of the view.
    pub view: usize,
    /// Bins of each axis, `[lo, hi)`, as [`View::region`] has them.
    pub bins: Vec<[usize; 2]>,
}

impl ErasedCells {
    /// Whether a cell lies in the box, `cell` in C order.
    fn holds(&self, cell: usize, shape: &[usize]) -> bool {
        let inside = |(bin, &[lo, hi]): (usize, &[usize; 2])| (lo..hi).contains(&bin);
        self.bins.len() == shape.len() && unravel(cell, shape).into_iter().zip(&self.bins).all(inside)
    }
}

/// Whether something of a view's map is left without these cells.
pub fn leaves_any((index, view): (usize, &View), erased: &[ErasedCells]) -> bool {
    let shape = view.shape();
    let of_view: Vec<&ErasedCells> = erased.iter().filter(|cells| cells.view == index).collect();
    (0..view.cells()).any(|cell| of_view.iter().all(|cells| !cells.holds(cell, &shape)))
}

/// The problem as if these cells had not been measured, neither in its frame nor in those around: they are filled from what
/// borders on them, like cells without a number (SPEC section 4).
///
/// # Errors
/// Where nothing is left of a map.
pub fn without(problem: &Arc<Problem>, erased: &[ErasedCells]) -> Result<Arc<Problem>, FitError> {
    if erased.is_empty() {
        return Ok(Arc::clone(problem));
    }
    let views = &problem.views;
    let all = |map: &dyn Fn(usize) -> Vec<f64>| -> Vec<Vec<f64>> {
        views.iter().enumerate().map(|(k, view)| holed(map(k), (k, view), erased)).collect()
    };
    let maps = all(&|view| problem.map(view).to_vec());
    let mut left = Problem::new(problem.radar.clone(), problem.skeleton.clone(), views.clone(), &slices(&maps))?;
    for neighbour in problem.neighbours() {
        let maps = all(&|view| neighbour.map(view).to_vec());
        left.add_neighbour(neighbour.offset_s, &slices(&maps))?;
    }
    Ok(Arc::new(left))
}

fn slices(maps: &[Vec<f64>]) -> Vec<&[f64]> {
    maps.iter().map(Vec::as_slice).collect()
}

/// A map without what is erased of its view.
fn holed(mut map: Vec<f64>, (index, view): (usize, &View), erased: &[ErasedCells]) -> Vec<f64> {
    let shape = view.shape();
    let row = map.len() / shape.first().map_or(1, |&bins| bins.max(1));
    for cells in erased.iter().filter(|cells| cells.view == index) {
        let [lo, hi] = cells.bins.first().copied().unwrap_or_default();
        for (cell, value) in map.iter_mut().enumerate().take(hi.saturating_mul(row)).skip(lo.saturating_mul(row)) {
            if cells.holds(cell, &shape) {
                *value = f64::NAN;
            }
        }
    }
    map
}
