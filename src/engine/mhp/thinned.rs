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

/// What becomes of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Thinning {
    /// Every so manyth cell is kept.
    Every(usize),
    /// Powers along it add, and it is no more.
    Summed,
}

/// Of each axis of each view.
pub(super) type Thinnings = Vec<Vec<Thinning>>;

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
    thinnings: Thinnings,
    pub(super) views: Vec<View>,
    grids: Vec<OnceLock<SpatialGrid>>,
    /// The frame that is fitted, then those around it; one map a view.
    maps: Vec<Vec<OnceLock<ThinnedMap>>>,
    /// What stands in the cells of each view over the frames around, by which of these are looked at.
    backgrounds: [OnceLock<Vec<Vec<f64>>>; FramesAround::COUNT],
}

impl ThinnedMaps {
    fn new(problem: &Problem, thinnings: Thinnings) -> Self {
        let thinned = |(view, thinnings): (&View, &Vec<Thinning>)| {
            let axis = |(axis, thinning): (&Axis, &Thinning)| match *thinning {
                Thinning::Every(stride) => {
                    let bins = axis.bins.div_ceil(stride);
                    Some(Axis { bins, hi: axis.lo + axis.step() * (bins * stride) as f64, ..axis.clone() })
                }
                Thinning::Summed => None,
            };
            let axes = view.axes.iter().zip(thinnings).filter_map(axis).collect();
            View { axes, psf: narrowed(&view.psf), ..view.clone() }
        };
        let views: Vec<View> = problem.views.iter().zip(&thinnings).map(thinned).collect();
        let each_view = || views.iter().map(|_| OnceLock::new()).collect();
        Self {
            thinnings,
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
            let view = (&problem.views[view], self.thinnings[view].as_slice());
            let (places, summed) = (places(view, &Which::Kept), places(view, &Which::Summed));
            let power = |h: f64| if h.is_nan() { h } else { view.0.quantity.power(h) };
            let sum = |at: usize| summed.iter().map(|beside| power(whole[at + beside])).sum::<f64>();
            let cell = |at: usize| if summed.len() == 1 { whole[at] } else { view.0.quantity.stored(sum(at)) };
            let cells = places.into_iter().map(cell).collect();
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

/// Of which axes places are.
#[derive(PartialEq, Eq)]
enum Which {
    Kept,
    Summed,
}

/// The places of the cells along such axes of a view, in C order, where they are the first along the others.
fn places((view, thinnings): (&View, &[Thinning]), which: &Which) -> Vec<usize> {
    view.axes.iter().zip(thinnings).fold(vec![0], |places: Vec<usize>, (axis, thinning)| {
        let stride = match (thinning, which) {
            (Thinning::Every(stride), Which::Kept) => *stride,
            (Thinning::Summed, Which::Summed) => 1,
            _ => axis.bins.max(1),
        };
        places.iter().flat_map(|&at| (0..axis.bins).step_by(stride).map(move |bin| at * axis.bins + bin)).collect()
    })
}

/// The ways of thinning of a problem that were asked for last, and the noise of its own maps.
#[derive(Debug, Default)]
pub(super) struct ThinnedCache {
    kept: Mutex<Vec<Arc<ThinnedMaps>>>,
    noises: OnceLock<Vec<OnceLock<f64>>>,
}

impl ThinnedCache {
    /// Those of `problem`, which must be the same whenever this is asked.
    pub(super) fn of(&self, problem: &Problem, thinnings: Thinnings) -> Arc<ThinnedMaps> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept.iter().find(|maps| maps.thinnings == thinnings) {
            return Arc::clone(found);
        }
        if kept.len() >= KEPT {
            kept.remove(0);
        }
        let maps = Arc::new(ThinnedMaps::new(problem, thinnings));
        kept.push(Arc::clone(&maps));
        maps
    }

    /// The power of the noise in a view of `problem`, which must be the same whenever this is asked.
    pub(super) fn noise(&self, problem: &Problem, view: usize) -> f64 {
        let noises = self.noises.get_or_init(|| problem.views.iter().map(|_| OnceLock::new()).collect());
        *noises[view].get_or_init(|| noise_power(&problem.views[view], problem.map(view)))
    }
}
