//! What of a problem's maps a window looks at (`mhp/reduced.rs`), and a frame's comparison in it.

use crate::body::Pppr;
use crate::config::{Clutter, EmLoss, FitConfig};
use crate::geometry::norm;
use crate::mhp::frame_em::{FrameEm, Measured, skin_of};
use crate::mhp::reduced::{AxisReduction, Blur, Distance, ReducedMaps, Reduction};
use crate::mhp::region::{Region, centres};
use crate::mhp::skin::Skin;
use crate::mhp::{Precision, Problem};
use crate::radar::{Axis, AxisKind, View};
use std::sync::Arc;

/// Cells that a standard deviation of the point spread covers at least where every second one is enough.
const CELLS: f64 = 1.5;
/// A limb's width, standard deviation, m: across the sight nothing finer is looked at, where cells are too wide to show it.
const LIMB_M: f64 = 0.06;
/// Cells that a standard deviation covers where they are narrow enough.
const SHOWN: f64 = 1.2;
/// A blur by less, bins, is none.
const LEAST_BLUR: f64 = 0.4;

/// What is left of the views of a problem, and what its frames show in them.
pub(in crate::mhp) struct ReducedViews<'a> {
    problem: &'a Problem,
    pub(super) maps: Arc<ReducedMaps>,
    /// Whether clutter is modelled by range.
    by_range: bool,
    /// The skin that every frame is given.
    skin: Option<Skin>,
}

impl<'a> ReducedViews<'a> {
    /// For persons who stand where those of `params` do.
    pub(in crate::mhp) fn new(problem: &'a Problem, config: &FitConfig, params: &Pppr) -> Self {
        let maps = problem.reduced(problem.views.iter().map(|view| reduction(view, params)).collect());
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

/// What becomes of a view where persons stand as those of `params` do; one with a fixed region stays as it is.
fn reduction(view: &View, params: &Pppr) -> Reduction {
    let far_m = centres(params).into_iter().map(|at| norm(view.pose.view_from_world(at))).fold(f64::INFINITY, f64::min);
    let far = Distance::near(far_m);
    let psf = &view.psf;
    // Standard deviations of the point spread along an axis, and of a limb, where one limits what is looked at.
    let widths = |kind: AxisKind| match kind {
        AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => (psf.range_m, 0.0),
        AxisKind::Y => (psf.azimuth_rad * far_m, LIMB_M),
        AxisKind::Z => (psf.elevation_rad * far_m, LIMB_M),
        AxisKind::Azimuth | AxisKind::Cone => (psf.azimuth_rad, LIMB_M / far.m()),
        AxisKind::Elevation => (psf.elevation_rad, LIMB_M / far.m()),
        AxisKind::Doppler => (0.0, 0.0),
    };
    let places = view.axes.iter().filter(|axis| axis.kind != AxisKind::Doppler).count();
    let of_axis = |axis: &Axis| {
        if view.region.is_some() {
            return AxisReduction::Every { stride: 1, blur: Blur::NONE };
        }
        if axis.kind == AxisKind::Doppler && places > 1 {
            return AxisReduction::Summed;
        }
        let ((width, limb), step) = (widths(axis.kind), axis.step().abs());
        let limb = limb.min(SHOWN * step);
        let missing = (limb * limb - width * width).max(0.0).sqrt() / step;
        let blur = if missing < LEAST_BLUR { Blur::NONE } else { Blur::near(missing) };
        let stride = if width.hypot(blur.bins() * step) > CELLS * step { 2 } else { 1 };
        AxisReduction::Every { stride, blur }
    };
    let axes: Vec<AxisReduction> = view.axes.iter().map(of_axis).collect();
    let blurred = |axis: &AxisReduction| matches!(axis, AxisReduction::Every { blur, .. } if *blur != Blur::NONE);
    let far = if axes.iter().any(blurred) { far } else { Distance::ANY };
    Reduction { axes, far }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Group, PpprShape};
    use crate::geometry::Pose;
    use crate::radar::{PointSpread, Quantity, Spacing};

    fn somebody(ahead_m: f64) -> Pppr {
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 1, doppler_features: 1 });
        params.set_vec3(Group::Position, 0, [ahead_m, 0.0, 0.0]);
        params
    }

    fn view(psf: PointSpread, axes: &[(AxisKind, usize, f64, f64)]) -> View {
        let axis = |&(kind, bins, lo, hi)| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        let axes = axes.iter().map(axis).collect();
        View { array: "v".into(), quantity: Quantity::Amplitude, psf, pose: Pose::default(), axes, region: None }
    }

    /// What is blurred along an axis, bins, and what is kept; `None` where powers add.
    fn of(view: &View, far_m: f64) -> Vec<Option<(f64, usize)>> {
        let axis = |axis: &AxisReduction| match *axis {
            AxisReduction::Every { stride, blur } => Some((blur.bins(), stride)),
            AxisReduction::Summed => None,
        };
        reduction(view, &somebody(far_m)).axes.iter().map(axis).collect()
    }

    #[test]
    fn across_the_sight_nothing_finer_than_a_limb_is_looked_at() {
        let fine = PointSpread { range_m: 0.06, azimuth_rad: 0.0113, ..PointSpread::default() };
        let hiber = view(fine, &[(AxisKind::DepthH, 160, 8.0, 0.0), (AxisKind::Y, 200, 5.0, -5.0)]);
        // √(0.06² − 0.034²)/0.05
        assert_eq!(of(&hiber, 3.0), [Some((0.0, 1)), Some((1.0, 1))]);
        assert_eq!(of(&hiber, 6.0), [Some((0.0, 1)), Some((0.0, 1))], "far away nothing is that fine");
        let wide = PointSpread { range_m: 0.04, azimuth_rad: 0.052, ..PointSpread::default() };
        let mmvr = view(wide, &[(AxisKind::DepthH, 256, 8.0, 0.0), (AxisKind::Y, 128, 2.5, -2.5)]);
        assert_eq!(of(&mmvr, 3.0), [Some((0.0, 1)), Some((0.0, 2))]);
        assert_eq!(of(&mmvr, 1.0), [Some((0.0, 1)); 2], "its cells show what its array resolves");
        let [near, far] = [3.0, 4.0].map(|far_m| reduction(&mmvr, &somebody(far_m)));
        assert_eq!(near, far, "what is not blurred is the same for all");
    }

    #[test]
    fn powers_along_a_doppler_axis_add_where_two_other_axes_tell_the_place() {
        let psf = PointSpread { range_m: 0.02, azimuth_rad: 0.12, doppler_mps: 0.07, ..PointSpread::default() };
        let doppler = (AxisKind::Doppler, 16, -1.1, 1.1);
        let range = (AxisKind::Range, 64, 4.0, 1.3);
        let cube = view(psf, &[doppler, range, (AxisKind::Cone, 64, 1.0, -1.0)]);
        assert_eq!(of(&cube, 3.0), [None, Some((0.0, 1)), Some((0.0, 2))]);
        assert_eq!(of(&view(psf, &[range, doppler]), 3.0), [Some((0.0, 1)); 2]);
        let mut fixed = cube;
        fixed.region = Some(vec![[0, 16], [3, 60], [0, 64]].into_iter().collect());
        assert_eq!(of(&fixed, 3.0), [Some((0.0, 1)); 3]);
    }
}
