//! The EM region: the box of cells over which the masks are compared; SPEC section 4.

use super::FitError;
use super::triad::SphericalTriad;
use crate::body::Pppr;
use crate::config::EmRegion;
use crate::geometry::Vec3;
use crate::radar::{Axis, AxisKind, Spacing, View};
use std::f64::consts::FRAC_PI_2;

/// A box of cells of one view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Region {
    /// `[lo, hi)` in bins, per axis.
    pub bins: Vec<[usize; 2]>,
}

impl Region {
    /// The whole map of `view`.
    pub fn whole(view: &View) -> Self {
        Self { bins: view.axes.iter().map(|axis| [0, axis.bins]).collect() }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.bins.iter().map(|[lo, hi]| hi - lo).product()
    }

    /// Flat indices into the whole map of shape `shape`, in C order.
    pub fn indices(&self, shape: &[usize]) -> Vec<usize> {
        let mut indices = vec![0];
        for (&[lo, hi], &bins) in self.bins.iter().zip(shape) {
            indices = indices.iter().flat_map(|&i| (lo..hi).map(move |bin| i * bins + bin)).collect();
        }
        indices
    }
}

/// The middle of the bounding box of each person's joints, world frame, m.
pub(super) fn centres(params: &Pppr) -> Vec<Vec3> {
    let joints = params.shape().joints;
    (0..params.shape().persons)
        .map(|person| {
            let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for joint in person * joints..(person + 1) * joints {
                let p = params.position(joint);
                for k in 0..3 {
                    lo[k] = lo[k].min(p[k]);
                    hi[k] = hi[k].max(p[k]);
                }
            }
            std::array::from_fn(|k| f64::midpoint(lo[k], hi[k]))
        })
        .collect()
}

/// The EM region of each view for persons around `centres`, and what had to be widened.
///
/// # Errors
/// Where a centre is not finite.
pub(super) fn regions(
    views: &[View],
    em_region: EmRegion,
    centres: &[Vec3],
) -> Result<(Vec<Region>, Vec<String>), FitError> {
    if let Some(person) = centres.iter().position(|c| c.iter().any(|x| !x.is_finite())) {
        return Err(FitError::Diverged { iteration: 0, joint: format!("person {person}"), term: "position".into() });
    }
    let mut warnings = Vec::new();
    let regions = views
        .iter()
        .map(|view| match (&view.region, em_region) {
            (Some(bins), _) => Region { bins: bins.clone() },
            (None, EmRegion::Full) => Region::whole(view),
            (None, EmRegion::HalfWidth(half_width_m)) => around(view, half_width_m, centres, &mut warnings),
        })
        .collect();
    Ok((regions, warnings))
}

fn around(view: &View, half_width_m: f64, centres: &[Vec3], warnings: &mut Vec<String>) -> Region {
    let triads: Vec<SphericalTriad> = centres.iter().map(|&c| SphericalTriad::new(view.seen_at(c))).collect();
    let bins = view.axes.iter().map(|axis| {
        if axis.kind == AxisKind::Doppler {
            return [0, axis.bins];
        }
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for triad in &triads {
            let [from, to] = span(axis, triad, half_width_m);
            (lo, hi) = (lo.min(from), hi.max(to));
        }
        bins_between(axis, lo, hi).unwrap_or_else(|| {
            warnings.push(format!(
                "the EM region of `{}` has no cell on its {} axis: the whole axis is used",
                view.array,
                axis.kind.name()
            ));
            [0, axis.bins]
        })
    });
    Region { bins: bins.collect() }
}

/// The interval of an axis, in axis units, around one person.
fn span(axis: &Axis, triad: &SphericalTriad, half_width_m: f64) -> [f64; 2] {
    let linear = Axis { spacing: Spacing::Linear, ..axis.clone() };
    let middle = triad.coordinate(&linear, 0.0);
    if !axis.kind.is_angular() {
        return [middle - half_width_m, middle + half_width_m];
    }
    let half = (half_width_m / triad.d.value).atan();
    let bounds = [middle - half, middle + half].map(|angle| angle.clamp(-FRAC_PI_2, FRAC_PI_2));
    if axis.spacing == Spacing::Sine { bounds.map(f64::sin) } else { bounds }
}

/// Bins whose centre lies in [lo, hi], as `[first, last + 1)`; `None` where there is none.
fn bins_between(axis: &Axis, lo: f64, hi: f64) -> Option<[usize; 2]> {
    let inside = |&bin: &usize| (lo..=hi).contains(&axis.at(bin as f64));
    let first = (0..axis.bins).find(inside)?;
    let last = (first..axis.bins).rev().find(inside)?;
    Some([first, last + 1])
}
