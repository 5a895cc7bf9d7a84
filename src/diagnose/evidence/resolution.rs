//! How finely a view resolves a place, and where a joint falls on its map.
//!
//! A resolution cell is as wide as the point-spread function at half its maximum, 2√(2 ln 2) σ: two equal echoes that
//! far apart begin to show as two. On a map it is at least one cell.

use crate::body::Pppr;
use crate::config::FitConfig;
use crate::geometry::{Vec3, add, dot, mat_vec, norm, scale};
use crate::radar::{Axis, AxisKind, View};

/// Full width at half maximum of a Gaussian of standard deviation 1.
pub(super) const FWHM: f64 = 2.354_820_045_030_949_3;
/// As in the forward model (SPEC section 3): distances and the cosines in denominators are held above these.
const DISTANCE_FLOOR_M: f64 = 0.01;
const COSINE_FLOOR: f64 = 0.05;
/// Step of the difference quotients of axis coordinates, m.
const STEP_M: f64 = 1e-4;

/// A place seen by a view: directions and the width of the point spread along them.
pub(super) struct Resolution {
    /// The place in the view frame, m.
    p: Vec3,
    /// Distance from the view's origin, m.
    pub range_m: f64,
    /// Azimuth and elevation, rad.
    pub angles: [f64; 2],
    /// Unit vectors: radial, azimuth, elevation.
    pub directions: [Vec3; 3],
    /// Standard deviations along them, m: σ_r, ρ σ_az/cos θ_az, d σ_el/cos θ_el.
    pub sigma_m: [f64; 3],
}

impl Resolution {
    /// At `p`, m, in the frame of `view`.
    pub(super) fn new(view: &View, p: Vec3) -> Self {
        let (rho, d) = (p[0].hypot(p[1]), norm(p).max(DISTANCE_FLOOR_M));
        let (azimuth, elevation) = (p[1].atan2(p[0]), p[2].atan2(rho));
        let ((sin_az, cos_az), (sin_el, cos_el)) = (azimuth.sin_cos(), elevation.sin_cos());
        let psf = &view.psf;
        Self {
            p,
            range_m: d,
            angles: [azimuth, elevation],
            directions: [
                [cos_el * cos_az, cos_el * sin_az, sin_el],
                [-sin_az, cos_az, 0.0],
                [-sin_el * cos_az, -sin_el * sin_az, cos_el],
            ],
            sigma_m: [
                psf.range_m,
                rho.max(DISTANCE_FLOOR_M) * psf.azimuth_rad / cos_az.max(COSINE_FLOOR),
                d * psf.elevation_rad / cos_el.max(COSINE_FLOOR),
            ],
        }
    }

    /// Full width at half maximum along each axis of the map, in cells; 1 at least, the whole axis at most.
    pub(super) fn cells(&self, view: &View) -> Vec<f64> {
        self.widths(view, &[0, 1, 2])
    }

    /// As [`Self::cells`], of the cross-range directions alone.
    pub(super) fn cross_range_cells(&self, view: &View) -> Vec<f64> {
        self.widths(view, &[1, 2])
    }

    fn widths(&self, view: &View, along: &[usize]) -> Vec<f64> {
        let width = |axis: &Axis| {
            let bin = |p: Vec3| axis.bin(axis.coordinate(p));
            let sigma = if axis.kind == AxisKind::Doppler {
                view.psf.doppler_mps / axis.step()
            } else {
                let slope = |k: usize| {
                    let (e, sigma) = (self.directions[k], self.sigma_m[k]);
                    let difference = bin(add(self.p, scale(e, STEP_M))) - bin(add(self.p, scale(e, -STEP_M)));
                    difference / (2.0 * STEP_M) * sigma
                };
                along.iter().map(|&k| slope(k).powi(2)).sum::<f64>().sqrt()
            };
            (FWHM * sigma.abs()).max(1.0).min(axis.bins as f64)
        };
        view.axes.iter().map(width).collect()
    }
}

/// Where the echo of flat joint `joint` comes from in the frame of `view`, m: the joint, moved to the skin as the forward
/// model does.
pub(super) fn echo(view: &View, config: &FitConfig, params: &Pppr, joint: usize) -> Vec3 {
    let p = view.pose.view_from_world(params.position(joint));
    let d = norm(p).max(DISTANCE_FLOOR_M);
    scale(p, (d - config.surface_offset_m + view.psf.offset_m()).max(DISTANCE_FLOOR_M) / d)
}

/// v_r of flat joint `joint` in `view`, m/s, positive moving away.
pub(super) fn radial_mps(view: &View, params: &Pppr, joint: usize) -> f64 {
    let p = view.pose.view_from_world(params.position(joint));
    dot(mat_vec(&view.pose.rotation, params.velocity(joint)), p) / norm(p).max(DISTANCE_FLOOR_M)
}

/// Bin coordinates of flat joint `joint` on the map of `view`.
pub(super) fn joint_bins(view: &View, config: &FitConfig, params: &Pppr, joint: usize) -> Vec<f64> {
    let p = echo(view, config, params, joint);
    let coordinate = |axis: &crate::radar::Axis| match axis.kind {
        AxisKind::Doppler => radial_mps(view, params, joint),
        _ => axis.coordinate(p),
    };
    view.axes.iter().map(|axis| axis.bin(coordinate(axis))).collect()
}

/// The joints on the map of a view, each with its resolution cell.
pub(super) struct JointCells {
    shape: Vec<usize>,
    /// Bin and width in bins along each axis.
    joints: Vec<Vec<(f64, f64)>>,
}

impl JointCells {
    pub(super) fn new(view: &View, config: &FitConfig, params: &Pppr) -> Self {
        let of_joint = |joint: usize| {
            let at = joint_bins(view, config, params, joint);
            let widths = Resolution::new(view, echo(view, config, params, joint)).cells(view);
            // A place has every velocity: what a joint's own is, a fit hardly knows.
            let placed =
                |(axis, width): (&Axis, f64)| if axis.kind == AxisKind::Doppler { f64::INFINITY } else { width };
            at.into_iter().zip(view.axes.iter().zip(widths).map(placed)).collect()
        };
        Self { shape: view.shape(), joints: (0..params.shape().total_joints()).map(of_joint).collect() }
    }

    /// How far a flat cell is from the nearest joint, in resolution cells; `None` where no joint is on a finite bin.
    pub(super) fn distance(&self, cell: usize) -> Option<f64> {
        let at = super::cells::index(&self.shape, cell);
        let square = |joint: &Vec<(f64, f64)>| {
            at.iter().zip(joint).map(|(&at, (bin, width))| ((at as f64 - bin) / width).powi(2)).sum::<f64>()
        };
        let nearest = self.joints.iter().map(square).fold(f64::INFINITY, f64::min);
        nearest.is_finite().then(|| nearest.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::radar::{PointSpread, Quantity, Spacing};

    fn view(axes: Vec<Axis>) -> View {
        let psf = PointSpread {
            range_m: 0.1,
            azimuth_rad: 0.05,
            elevation_rad: 0.0,
            doppler_mps: 0.2,
            ..PointSpread::default()
        };
        View { array: "h".into(), quantity: Quantity::Amplitude, psf, pose: Pose::default(), axes, region: None }
    }

    fn axis(kind: AxisKind, bins: usize, lo: f64, hi: f64) -> Axis {
        Axis { kind, bins, lo, hi, spacing: Spacing::Linear }
    }

    #[test]
    fn a_resolution_cell_is_the_half_width_of_the_point_spread() {
        let view = view(vec![axis(AxisKind::Range, 100, 0.0, 5.0), axis(AxisKind::Azimuth, 200, 1.0, -1.0)]);
        let cells = Resolution::new(&view, [3.0, 0.0, 0.0]).cells(&view);
        assert!(
            (cells[0] - FWHM * 0.1 / 0.05).abs() < 1e-6 && (cells[1] - FWHM * 0.05 / 0.01).abs() < 1e-6,
            "{cells:?}"
        );
    }

    #[test]
    fn on_a_cartesian_map_it_grows_with_range_and_keeps_within_the_axis() {
        let view = view(vec![axis(AxisKind::X, 10, 0.0, 1.0), axis(AxisKind::Y, 30, -1.5, 1.5)]);
        let across = |x: f64| Resolution::new(&view, [x, 0.0, 0.0]).cells(&view)[1];
        assert!((across(4.0) / across(2.0) - 2.0).abs() < 1e-6);
        assert_eq!((across(1e-3), across(1e9)), (1.0, 30.0), "a cell at least, the axis at most");
    }

    #[test]
    fn a_doppler_axis_has_its_own_width() {
        let view = view(vec![axis(AxisKind::Range, 100, 0.0, 5.0), axis(AxisKind::Doppler, 40, -2.0, 2.0)]);
        let cells = Resolution::new(&view, [3.0, 0.0, 0.0]).cells(&view);
        assert!((cells[1] - FWHM * 2.0).abs() < 1e-9, "{cells:?}");
    }
}
