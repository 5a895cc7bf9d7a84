//! The views of a data set's frames, and what their axes decide of every map.

use super::{PointSpread, SpatialGrid, View};
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

/// The views of a frame. What their axes alone decide is worked out when it is first asked for; clones share it, so that
/// frame after frame of a data set finds it there, and it goes with the last of them.
#[derive(Clone)]
pub struct ViewSet(Arc<Shared>);

struct Shared {
    views: Vec<View>,
    grids: Vec<OnceLock<Arc<SpatialGrid>>>,
}

impl ViewSet {
    /// The spatial cells of a view; `None` where there is no such view.
    pub(crate) fn grid(&self, view: usize) -> Option<&Arc<SpatialGrid>> {
        let (view, grid) = (self.0.views.get(view)?, self.0.grids.get(view)?);
        Some(grid.get_or_init(|| Arc::new(SpatialGrid::new(view))))
    }

    /// The same views whose maps add these to a range, m, one a view, beside what is stated.
    pub(crate) fn with_range_offsets(&self, offsets_m: &[f64]) -> Self {
        let of = |(view, &measured_offset_m): (&View, &f64)| View {
            psf: PointSpread { measured_offset_m, ..view.psf },
            ..view.clone()
        };
        let views: Vec<View> = self.iter().zip(offsets_m).map(of).collect();
        // Where cells lie in the map is the same.
        let grid = |(k, view): (usize, &View)| match self.grid(k) {
            Some(grid) => Arc::new(grid.seen_as(view)).into(),
            None => OnceLock::new(),
        };
        let grids = views.iter().enumerate().map(grid).collect();
        Self(Arc::new(Shared { views, grids }))
    }

    /// The spatial cells of every view.
    pub(crate) fn grids(&self) -> impl Iterator<Item = &Arc<SpatialGrid>> {
        (0..self.len()).filter_map(|view| self.grid(view))
    }
}

impl From<Vec<View>> for ViewSet {
    fn from(views: Vec<View>) -> Self {
        let grids = views.iter().map(|_| OnceLock::new()).collect();
        Self(Arc::new(Shared { views, grids }))
    }
}

impl Deref for ViewSet {
    type Target = [View];

    fn deref(&self) -> &[View] {
        &self.0.views
    }
}

impl<'a> IntoIterator for &'a ViewSet {
    type Item = &'a View;
    type IntoIter = std::slice::Iter<'a, View>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// What axes decide follows from the views.
impl PartialEq for ViewSet {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl std::fmt::Debug for ViewSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::radar::{Axis, AxisKind, Quantity, Spacing};

    #[test]
    fn what_axes_decide_is_shared_by_clones_and_by_nobody_else() {
        let axis = |kind| Axis { kind, bins: 4, lo: 1.0, hi: 2.0, spacing: Spacing::Linear };
        let view = View {
            array: "map".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread::default(),
            pose: crate::geometry::Pose::default(),
            axes: vec![axis(AxisKind::Range), axis(AxisKind::Doppler)],
            region: None,
        };
        let [views, others] = [(); 2].map(|()| ViewSet::from(vec![view.clone()]));
        let clone = views.clone();
        assert!(Arc::ptr_eq(views.grid(0).unwrap(), clone.grid(0).unwrap()));
        assert!(views == others && !Arc::ptr_eq(views.grid(0).unwrap(), others.grid(0).unwrap()));
        assert_eq!((views.grid(0).unwrap().shape.as_slice(), views.grid(1).is_none()), (&[4][..], true));
    }
}
