//! Every second cell of a problem's maps where the point spread covers several: what is left says the same in a quarter of the
//! time. It is made once for all fits of a problem that look at the same cells.

use super::Problem;
use super::levels::NOISE_PCT;
use super::percentile::percentile;
use crate::config::FramesAround;
use crate::radar::{Axis, PointSpread, SpatialGrid, View};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Ways of thinning that are kept for a problem: near and far persons want others.
const KEPT: usize = 4;
/// Levels see a point spread down to the noise, where a window's main lobe falls faster than the Gaussian that has its width.
const ACROSS: f64 = 0.9;

/// The point spread that levels see.
fn narrowed(psf: &PointSpread) -> PointSpread {
    PointSpread { azimuth_rad: ACROSS * psf.azimuth_rad, elevation_rad: ACROSS * psf.elevation_rad, ..*psf }
}

/// Of each axis of each view, every so manyth cell.
pub(super) type Strides = Vec<Vec<usize>>;

/// A map's cells that are kept, C order.
#[derive(Debug)]
pub(super) struct ThinnedMap {
    pub(super) cells: Vec<f64>,
    noise: OnceLock<f64>,
}

/// The power of the noise in a map whose erased cells are NaN: a percentile of the powers of the others.
fn noise_power(view: &View, map: &[f64]) -> f64 {
    let powers: Vec<f64> = map.iter().filter(|h| !h.is_nan()).map(|&h| view.quantity.power(h)).collect();
    percentile(&powers, NOISE_PCT)
}

/// The views of a problem, thinned, and what its frames show in them; each map when it is first asked for.
#[derive(Debug)]
pub(super) struct ThinnedMaps {
    strides: Strides,
    pub(super) views: Vec<View>,
    grids: Vec<OnceLock<SpatialGrid>>,
    /// The frame that is fitted, then those around it; one map a view.
    maps: Vec<Vec<OnceLock<ThinnedMap>>>,
    /// What stands in the cells of each view over the frames around, by which of these are looked at.
    backgrounds: [OnceLock<Vec<Vec<f64>>>; FramesAround::COUNT],
}

impl ThinnedMaps {
    fn new(problem: &Problem, strides: Strides) -> Self {
        let thinned = |(view, strides): (&View, &Vec<usize>)| {
            let axis = |(axis, &stride): (&Axis, &usize)| {
                let bins = axis.bins.div_ceil(stride);
                Axis { bins, hi: axis.lo + axis.step() * (bins * stride) as f64, ..axis.clone() }
            };
            let axes = view.axes.iter().zip(strides).map(axis).collect();
            View { axes, psf: narrowed(&view.psf), ..view.clone() }
        };
        let views: Vec<View> = problem.views.iter().zip(&strides).map(thinned).collect();
        let each_view = || views.iter().map(|_| OnceLock::new()).collect();
        Self {
            strides,
            grids: views.iter().map(|_| OnceLock::new()).collect(),
            maps: (0..=problem.neighbours().len()).map(|_| each_view()).collect(),
            views,
            backgrounds: Default::default(),
        }
    }

    /// What a view shows in a frame around `problem`'s, or in the one that is fitted.
    pub(super) fn map(&self, problem: &Problem, frame: Option<usize>, view: usize) -> &ThinnedMap {
        self.maps[frame.map_or(0, |frame| frame + 1)][view].get_or_init(|| {
            let whole = frame.map_or_else(|| problem.map(view), |frame| problem.neighbours()[frame].map(view));
            let (shape, strides) = (problem.views[view].shape(), &self.strides[view]);
            let places = shape.iter().zip(strides).fold(vec![0], |places: Vec<usize>, (&bins, &stride)| {
                places.iter().flat_map(|&at| (0..bins).step_by(stride).map(move |bin| at * bins + bin)).collect()
            });
            let cells = places.into_iter().filter_map(|at| whole.get(at).copied()).collect();
            ThinnedMap { cells, noise: OnceLock::new() }
        })
    }

    /// The power of the noise there.
    pub(super) fn noise(&self, problem: &Problem, frame: Option<usize>, view: usize) -> f64 {
        let map = self.map(problem, frame, view);
        *map.noise.get_or_init(|| noise_power(&self.views[view], &map.cells))
    }

    /// The rings of a view.
    pub(super) fn grid(&self, view: usize) -> &SpatialGrid {
        self.grids[view].get_or_init(|| SpatialGrid::new(&self.views[view]))
    }

    /// What stands in each cell of each view while `frames` are looked at; `of_view` works it out from a view's maps over time.
    pub(super) fn backgrounds(
        &self,
        problem: &Problem,
        frames: FramesAround,
        of_view: impl Fn(&View, Vec<Vec<f64>>) -> Vec<f64>,
    ) -> &[Vec<f64>] {
        self.backgrounds[frames as usize].get_or_init(|| {
            let all = || std::iter::once(None).chain((0..problem.neighbours_in(frames).len()).map(Some));
            let maps = |view: usize| all().map(|frame| self.map(problem, frame, view).cells.clone()).collect();
            self.views.iter().enumerate().map(|(k, view)| of_view(view, maps(k))).collect()
        })
    }
}

/// The ways of thinning of a problem that were asked for last, and the noise of its own maps.
#[derive(Debug, Default)]
pub(super) struct ThinnedCache {
    kept: Mutex<Vec<Arc<ThinnedMaps>>>,
    noises: OnceLock<Vec<OnceLock<f64>>>,
}

impl ThinnedCache {
    /// Those of `problem`, which must be the same whenever this is asked.
    pub(super) fn of(&self, problem: &Problem, strides: Strides) -> Arc<ThinnedMaps> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept.iter().find(|maps| maps.strides == strides) {
            return Arc::clone(found);
        }
        if kept.len() >= KEPT {
            kept.remove(0);
        }
        let maps = Arc::new(ThinnedMaps::new(problem, strides));
        kept.push(Arc::clone(&maps));
        maps
    }

    /// The power of the noise in a view of `problem`, which must be the same whenever this is asked.
    pub(super) fn noise(&self, problem: &Problem, view: usize) -> f64 {
        let noises = self.noises.get_or_init(|| problem.views.iter().map(|_| OnceLock::new()).collect());
        *noises[view].get_or_init(|| noise_power(&problem.views[view], problem.map(view)))
    }
}
