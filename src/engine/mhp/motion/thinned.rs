//! Every second cell of a map where its point spread covers several: what is left says the same in a quarter of the time.

use crate::body::Pppr;
use crate::config::{Clutter, FitConfig};
use crate::geometry::norm;
use crate::mhp::frame_em::{FrameEm, Measured};
use crate::mhp::region::{Region, centres};
use crate::mhp::{Neighbour, Precision, Problem};
use crate::radar::{Axis, AxisKind, PointSpread, SpatialGrid, View};

/// Cells that a standard deviation of the point spread covers at least where every second one is enough.
const CELLS: f64 = 1.5;

/// Levels see a point spread down to the noise, where a window's main lobe falls faster than the Gaussian that has its width.
const ACROSS: f64 = 0.9;

/// The point spread that levels see.
fn narrowed(psf: &PointSpread) -> PointSpread {
    PointSpread { azimuth_rad: ACROSS * psf.azimuth_rad, elevation_rad: ACROSS * psf.elevation_rad, ..*psf }
}

/// The views of a problem, thinned, and what its frames show in them.
pub(in crate::mhp) struct ThinnedViews<'a> {
    problem: &'a Problem,
    thinned: Vec<Thinned>,
    pub(in crate::mhp) views: Vec<View>,
    /// Their rings, where clutter is modelled.
    grids: Vec<SpatialGrid>,
}

impl<'a> ThinnedViews<'a> {
    /// For persons who stand where those of `params` do.
    pub(in crate::mhp) fn new(problem: &'a Problem, config: &FitConfig, params: &Pppr) -> Self {
        let thinned: Vec<Thinned> = problem.views.iter().map(|view| Thinned::new(view, params)).collect();
        let views: Vec<View> = thinned.iter().map(|thinned| thinned.view.clone()).collect();
        let by_range = config.clutter == Clutter::Modelled;
        let grids = views.iter().filter(|_| by_range).map(SpatialGrid::new).collect();
        Self { problem, thinned, views, grids }
    }

    /// The kept cells of a view in a frame around, or in the one that is fitted; C order.
    pub(super) fn cells(&self, view: usize, frame: Option<&Neighbour>) -> Vec<f64> {
        self.thinned[view].cells(frame.map_or_else(|| self.problem.map(view), |frame| frame.map(view)))
    }

    /// What compares the maps of a frame, over a background power a kept cell where one is known.
    pub(in crate::mhp) fn compared(
        &self,
        frame: Option<&Neighbour>,
        regions: &[Region],
        (config, precision): (&FitConfig, Precision),
        background: Option<&[Vec<f64>]>,
    ) -> FrameEm {
        let maps: Vec<Vec<f64>> = (0..self.views.len()).map(|view| self.cells(view, frame)).collect();
        let measured = Measured {
            views: &self.views,
            skeleton: &self.problem.skeleton,
            radar: &self.problem.radar,
            maps: maps.iter().map(Vec::as_slice).collect(),
            background,
            grids: self.grids.iter().collect(),
        };
        FrameEm::new(&measured, regions, config, precision)
    }
}

/// A view of every second cell along the axes that can spare the others.
struct Thinned {
    view: View,
    /// Of each axis, every so manyth cell.
    strides: Vec<usize>,
    shape: Vec<usize>,
}

impl Thinned {
    /// Of `view`, for persons who stand where those of `params` do.
    fn new(view: &View, params: &Pppr) -> Self {
        let far =
            centres(params).into_iter().map(|at| norm(view.pose.view_from_world(at))).fold(f64::INFINITY, f64::min);
        let psf = &view.psf;
        let spread = |axis: &Axis| match axis.kind {
            AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => psf.range_m,
            AxisKind::Y => psf.azimuth_rad * far,
            AxisKind::Z => psf.elevation_rad * far,
            AxisKind::Azimuth | AxisKind::Cone => psf.azimuth_rad,
            AxisKind::Elevation => psf.elevation_rad,
            AxisKind::Doppler => 0.0,
        };
        let strides: Vec<usize> = view
            .axes
            .iter()
            .map(|axis| if view.region.is_none() && spread(axis) > CELLS * axis.step().abs() { 2 } else { 1 })
            .collect();
        let thinned = |(axis, &stride): (&Axis, &usize)| {
            let bins = axis.bins.div_ceil(stride);
            Axis { bins, hi: axis.lo + axis.step() * (bins * stride) as f64, ..axis.clone() }
        };
        let axes = view.axes.iter().zip(&strides).map(thinned).collect();
        Self { view: View { axes, psf: narrowed(psf), ..view.clone() }, shape: view.shape(), strides }
    }

    /// The cells of a map that are kept, C order.
    fn cells(&self, map: &[f64]) -> Vec<f64> {
        let places = self.shape.iter().zip(&self.strides).fold(vec![0], |places: Vec<usize>, (&bins, &stride)| {
            places.iter().flat_map(|&at| (0..bins).step_by(stride).map(move |bin| at * bins + bin)).collect()
        });
        places.into_iter().filter_map(|at| map.get(at).copied()).collect()
    }
}
