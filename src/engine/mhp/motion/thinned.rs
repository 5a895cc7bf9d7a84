//! Which cells of a problem's maps a window looks at, and a frame's comparison in them.

use crate::body::Pppr;
use crate::config::{Clutter, EmLoss, FitConfig};
use crate::geometry::norm;
use crate::mhp::frame_em::{FrameEm, Measured, skin_of};
use crate::mhp::region::{Region, centres};
use crate::mhp::skin::Skin;
use crate::mhp::thinned::{ThinnedMaps, Thinning};
use crate::mhp::{Precision, Problem};
use crate::radar::{Axis, AxisKind, View};
use std::sync::Arc;

/// Cells that a standard deviation of the point spread covers at least where every second one is enough.
const CELLS: f64 = 1.5;

/// The views of a problem, thinned, and what its frames show in them.
pub(in crate::mhp) struct ThinnedViews<'a> {
    problem: &'a Problem,
    pub(super) maps: Arc<ThinnedMaps>,
    /// Whether clutter is modelled by range.
    by_range: bool,
    /// The skin that every frame is given.
    skin: Option<Skin>,
}

impl<'a> ThinnedViews<'a> {
    /// For persons who stand where those of `params` do.
    pub(in crate::mhp) fn new(problem: &'a Problem, config: &FitConfig, params: &Pppr) -> Self {
        let maps = problem.thinned(problem.views.iter().map(|view| thinnings(view, params)).collect());
        let skin = skin_of(config, (&maps.views, &problem.skeleton, &problem.radar));
        Self { problem, by_range: config.clutter == Clutter::Modelled, maps, skin }
    }

    /// The views.
    pub(in crate::mhp) fn views(&self) -> &[View] {
        &self.maps.views
    }

    /// What compares the maps of a frame around, or of the one that is fitted, over a background power a kept cell where one is
    /// known.
    pub(in crate::mhp) fn compared(
        &self,
        frame: Option<usize>,
        regions: &[Region],
        (config, precision): (&FitConfig, Precision),
        background: Option<&[Vec<f64>]>,
    ) -> FrameEm {
        let Self { problem, maps, by_range, skin } = self;
        let (views, levels) = (0..maps.views.len(), config.objective != EmLoss::Iou);
        let measured = Measured {
            views: &maps.views,
            skeleton: &problem.skeleton,
            radar: &problem.radar,
            maps: views.clone().map(|view| maps.map(problem, frame, view).cells.as_slice()).collect(),
            background,
            grids: views.clone().filter(|_| *by_range).map(|view| maps.grid(view)).collect(),
            noises: views.filter(|_| levels).map(|view| maps.noise(problem, frame, view)).collect(),
        };
        FrameEm::with_skin(&measured, regions, (config, precision), skin.clone())
    }
}

/// Of each axis of a view, every so manyth cell: where persons stand as those of `params` do, and the others can be spared.
fn thinnings(view: &View, params: &Pppr) -> Vec<Thinning> {
    let far = centres(params).into_iter().map(|at| norm(view.pose.view_from_world(at))).fold(f64::INFINITY, f64::min);
    let psf = &view.psf;
    let spread = |axis: &Axis| match axis.kind {
        AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => psf.range_m,
        AxisKind::Y => psf.azimuth_rad * far,
        AxisKind::Z => psf.elevation_rad * far,
        AxisKind::Azimuth | AxisKind::Cone => psf.azimuth_rad,
        AxisKind::Elevation => psf.elevation_rad,
        AxisKind::Doppler => 0.0,
    };
    let spatial = view.axes.iter().filter(|axis| axis.kind != AxisKind::Doppler).count();
    let thinning = |axis: &Axis| match () {
        () if view.region.is_some() => Thinning::Every(1),
        () if axis.kind == AxisKind::Doppler && spatial > 1 => Thinning::Summed,
        () if spread(axis) > CELLS * axis.step().abs() => Thinning::Every(2),
        () => Thinning::Every(1),
    };
    view.axes.iter().map(thinning).collect()
}
