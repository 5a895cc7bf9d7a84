//! A problem's maps as fits in a window see them: in fewer cells, and without what no model of a body tells.
//!
//! Powers along a Doppler axis add: limbs spread over it in ways that poses do not tell. Across the sight, where an array resolves
//! more finely than limbs are wide and than cells show, powers are blurred: speckle in every cell is no shape. Of cells of which the
//! point spread covers several every second one is kept: what is left says the same in a quarter of the time. It is made once for
//! all fits of a problem that look at the same cells.

use super::Problem;
use super::levels::NOISE_PCT;
use super::percentile::percentile;
use crate::config::FramesAround;
use crate::radar::{Axis, AxisKind, PointSpread, Resolves, SpatialGrid, View};
use std::iter::zip;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Reductions that are kept for a problem: near and far persons want others.
const KEPT: usize = 4;
/// Levels see a point spread down to the noise, where a window's main lobe falls faster than the Gaussian that has its width.
const ACROSS: f64 = 0.9;
/// A Gaussian is told to so many standard deviations.
const REACH: f64 = 3.0;
/// Parts of a bin that blurs are told in, and of a metre that distances are.
const PARTS: f64 = 4.0;
const PARTS_OF_M: f64 = 2.0;

/// What becomes of a view.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Reduction {
    pub(super) axes: Vec<AxisReduction>,
    /// How far from the radar what is looked at is; the same for all where nothing is blurred.
    pub(super) far: Distance,
}

/// What becomes of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AxisReduction {
    /// Powers are blurred along it, and then every so manyth cell is kept.
    Every { stride: usize, blur: Blur },
    /// Powers along it add, and it is no more.
    Summed,
}

/// The standard deviation of a blur, quarters of a bin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Blur(u8);

/// A distance, half metres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Distance(u32);

impl Distance {
    pub(super) const ANY: Self = Self(1);

    /// The nearest one that can be told.
    pub(super) fn near(m: f64) -> Self {
        Self((PARTS_OF_M * m).round().max(1.0) as u32)
    }

    pub(super) fn m(self) -> f64 {
        f64::from(self.0) / PARTS_OF_M
    }
}

impl Blur {
    pub(super) const NONE: Self = Self(0);

    /// The nearest one that can be told.
    pub(super) fn near(bins: f64) -> Self {
        Self((PARTS * bins).round() as u8)
    }

    pub(super) fn bins(self) -> f64 {
        f64::from(self.0) / PARTS
    }

    /// Blurs `powers` of this shape, C order, along an axis. What lies beyond its ends, and what was erased (NaN), counts nothing.
    fn along(self, axis: usize, shape: &[usize], powers: &mut [f64]) {
        let (bins, stride) = (shape[axis], shape[axis + 1..].iter().product::<usize>());
        let reach = (REACH * self.bins()).ceil() as usize;
        let weights: Vec<f64> = (0..=reach).map(|k| (-0.5 * (k as f64 / self.bins()).powi(2)).exp()).collect();
        let mut row = vec![0.0; bins];
        for first in (0..powers.len()).filter(|at| at / stride % bins == 0) {
            row.iter_mut().enumerate().for_each(|(k, power)| *power = powers[first + k * stride]);
            for (k, _) in row.iter().enumerate().filter(|(_, own)| !own.is_nan()) {
                let around = k.saturating_sub(reach)..(k + reach + 1).min(bins);
                let there =
                    around.filter(|&other| !row[other].is_nan()).map(|other| (weights[k.abs_diff(other)], row[other]));
                let (sum, all) =
                    there.fold((0.0, 0.0), |(sum, all), (weight, power)| (sum + weight * power, all + weight));
                powers[first + k * stride] = sum / all;
            }
        }
    }
}

impl Reduction {
    /// A view with what is left of its axes.
    fn view(&self, of: &View) -> View {
        let mut psf = narrowed(&of.psf);
        let mut axes = Vec::with_capacity(of.axes.len());
        for (axis, reduction) in zip(&of.axes, &self.axes) {
            let AxisReduction::Every { stride, blur } = *reduction else { continue };
            let bins = axis.bins.div_ceil(stride);
            axes.push(Axis { bins, hi: axis.lo + axis.step() * (bins * stride) as f64, ..axis.clone() });
            if blur != Blur::NONE {
                let at_m = if matches!(axis.kind, AxisKind::Y | AxisKind::Z) { self.far.m() } else { 1.0 };
                let resolves = Resolves::of(axis.kind);
                let width = psf.width_mut(resolves);
                *width = width.hypot(blur.bins() * axis.step() / at_m);
                *psf.lobe_mut(resolves) = None;
            }
        }
        View { psf, axes, ..of.clone() }
    }

    /// What is left of a map of this view, C order.
    fn map(&self, of: &View, map: &[f64]) -> Vec<f64> {
        let kept = places(of, |k| match self.axes[k] {
            AxisReduction::Every { stride, .. } => stride,
            AxisReduction::Summed => of.axes[k].bins,
        });
        if self.axes.iter().all(|axis| matches!(axis, AxisReduction::Every { blur: Blur::NONE, .. })) {
            return kept.into_iter().map(|at| map[at]).collect();
        }
        let mut powers: Vec<f64> = map.iter().map(|&h| if h.is_nan() { h } else { of.quantity.power(h) }).collect();
        for (k, axis) in self.axes.iter().enumerate() {
            if let AxisReduction::Every { blur, .. } = *axis
                && blur != Blur::NONE
            {
                blur.along(k, &of.shape(), &mut powers);
            }
        }
        let summed = places(of, |k| if self.axes[k] == AxisReduction::Summed { 1 } else { of.axes[k].bins });
        let sum = |at: usize| summed.iter().map(|beside| powers[at + beside]).sum::<f64>();
        kept.into_iter().map(|at| of.quantity.stored(sum(at))).collect()
    }
}

/// The places in a view's map, C order, of the first cell and every so manyth along each axis.
fn places(view: &View, stride: impl Fn(usize) -> usize) -> Vec<usize> {
    view.axes.iter().enumerate().fold(vec![0], |places: Vec<usize>, (k, axis)| {
        let bins = (0..axis.bins).step_by(stride(k).max(1));
        places.iter().flat_map(|&at| bins.clone().map(move |bin| at * axis.bins + bin)).collect()
    })
}

/// The point spread that levels see.
fn narrowed(psf: &PointSpread) -> PointSpread {
    PointSpread { azimuth_rad: ACROSS * psf.azimuth_rad, elevation_rad: ACROSS * psf.elevation_rad, ..*psf }
}

/// A map's cells that are kept, C order.
#[derive(Debug)]
pub(super) struct ReducedMap {
    pub(super) cells: Vec<f64>,
    noise: OnceLock<f64>,
}

/// The power of the noise in a map whose erased cells are NaN: a percentile of the powers of the others.
fn noise_power(view: &View, map: &[f64]) -> f64 {
    let powers: Vec<f64> = map.iter().filter(|h| !h.is_nan()).map(|&h| view.quantity.power(h)).collect();
    percentile(&powers, NOISE_PCT)
}

/// The views of a problem with what is left of their axes, and what its frames show in them; each map when it is first asked for.
#[derive(Debug)]
pub(super) struct ReducedMaps {
    reductions: Vec<Reduction>,
    pub(super) views: Vec<View>,
    grids: Vec<OnceLock<SpatialGrid>>,
    /// The frame that is fitted, then those around it; one map a view.
    maps: Vec<Vec<OnceLock<ReducedMap>>>,
    /// What stands in the cells of each view over the frames around, by which of these are looked at.
    backgrounds: [OnceLock<Vec<Vec<f64>>>; FramesAround::COUNT],
}

impl ReducedMaps {
    fn new(problem: &Problem, reductions: Vec<Reduction>) -> Self {
        let views: Vec<View> = problem.views.iter().zip(&reductions).map(|(view, of)| of.view(view)).collect();
        let each_view = || views.iter().map(|_| OnceLock::new()).collect();
        Self {
            reductions,
            grids: views.iter().map(|_| OnceLock::new()).collect(),
            maps: (0..=problem.neighbours().len()).map(|_| each_view()).collect(),
            views,
            backgrounds: Default::default(),
        }
    }

    /// What a view shows in a frame around `problem`'s, or in the one that is fitted.
    pub(super) fn map(&self, problem: &Problem, frame: Option<usize>, view: usize) -> &ReducedMap {
        self.maps[frame.map_or(0, |frame| frame + 1)][view].get_or_init(|| {
            let whole = frame.map_or_else(|| problem.map(view), |frame| problem.neighbours()[frame].map(view));
            let cells = self.reductions[view].map(&problem.views[view], whole);
            ReducedMap { cells, noise: OnceLock::new() }
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

/// The reductions of a problem that were asked for last, and the noise of its own maps.
#[derive(Debug, Default)]
pub(super) struct ReducedCache {
    kept: Mutex<Vec<Arc<ReducedMaps>>>,
    noises: OnceLock<Vec<OnceLock<f64>>>,
}

impl ReducedCache {
    /// Those of `problem`, which must be the same whenever this is asked.
    pub(super) fn of(&self, problem: &Problem, reductions: Vec<Reduction>) -> Arc<ReducedMaps> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept.iter().find(|maps| maps.reductions == reductions) {
            return Arc::clone(found);
        }
        if kept.len() >= KEPT {
            kept.remove(0);
        }
        let maps = Arc::new(ReducedMaps::new(problem, reductions));
        kept.push(Arc::clone(&maps));
        maps
    }

    /// The power of the noise in a view of `problem`, which must be the same whenever this is asked.
    pub(super) fn noise(&self, problem: &Problem, view: usize) -> f64 {
        let noises = self.noises.get_or_init(|| problem.views.iter().map(|_| OnceLock::new()).collect());
        *noises[view].get_or_init(|| noise_power(&problem.views[view], problem.map(view)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::radar::{Quantity, Spacing};

    const NONE: AxisReduction = AxisReduction::Every { stride: 1, blur: Blur::NONE };

    fn view(axes: &[(AxisKind, usize, f64, f64)], quantity: Quantity) -> View {
        let axis = |&(kind, bins, lo, hi)| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        let axes = axes.iter().map(axis).collect();
        View { array: "v".into(), quantity, psf: PointSpread::default(), pose: Pose::default(), axes, region: None }
    }

    #[test]
    fn powers_along_a_doppler_axis_add_and_every_second_cell_is_left() {
        let axes =
            [(AxisKind::Range, 4, 0.0, 2.0), (AxisKind::Doppler, 3, -1.0, 1.0), (AxisKind::Azimuth, 5, -0.5, 0.5)];
        let half = AxisReduction::Every { stride: 2, blur: Blur::NONE };
        let reduction = Reduction { axes: vec![half, AxisReduction::Summed, NONE], far: Distance::ANY };
        let mut map: Vec<f64> = (0..60).map(f64::from).collect();
        // Range bin 2, Doppler bin 1, azimuth bin 3 was erased.
        map[2 * 15 + 5 + 3] = f64::NAN;
        for quantity in [Quantity::Amplitude, Quantity::Power] {
            let view = view(&axes, quantity);
            let left = reduction.view(&view);
            assert_eq!(left.shape(), [2, 5]);
            assert!((left.axes[0].at(1.0) - view.axes[0].at(2.0)).abs() < 1e-12, "cells stay where they are");
            let cells = reduction.map(&view, &map);
            for (cell, found) in cells.iter().enumerate() {
                let (range, azimuth) = (2 * (cell / 5), cell % 5);
                let sum: f64 = (0..3).map(|doppler| quantity.power(map[(range * 3 + doppler) * 5 + azimuth])).sum();
                if (range, azimuth) == (2, 3) {
                    assert!(found.is_nan(), "of what was erased in part nothing is known");
                } else {
                    assert!((found - quantity.stored(sum)).abs() < 1e-9 * sum, "{cell}: {found}");
                }
            }
        }
    }

    #[test]
    fn an_echo_is_as_wide_as_the_view_that_is_left_says() {
        let (step, far) = (0.05, Distance::near(3.1));
        assert_eq!(far.m(), 3.0);
        let axes = [(AxisKind::DepthH, 3, 0.0, 0.3), (AxisKind::Y, 81, 40.5 * step, -40.5 * step)];
        let mut view = view(&axes, Quantity::Amplitude);
        let sigma_m = 0.06;
        // What levels see is narrower than what is stated.
        view.psf.azimuth_rad = sigma_m / ACROSS / far.m();
        let blur = Blur::near(1.6);
        let reduction = Reduction { axes: vec![NONE, AxisReduction::Every { stride: 1, blur }], far };
        let of_cell = |cell: usize| (-0.25 * ((cell % 81) as f64 - 40.0).powi(2) * (step / sigma_m).powi(2)).exp();
        let mut map: Vec<f64> = (0..243).map(of_cell).collect();
        map[81 + 43] = f64::NAN;
        let left = reduction.view(&view);
        let cells = reduction.map(&view, &map);
        let wide = left.psf.azimuth_rad * far.m();
        assert!((wide - sigma_m.hypot(1.5 * step)).abs() < 1e-9, "blurs are told in quarters of a bin: {wide}");
        let moment = |row: &[f64], power: i32| -> f64 {
            row.iter().enumerate().map(|(k, h)| h * h * (step * (k as f64 - 40.0)).powi(power)).sum()
        };
        let (before, after) = (moment(&map[..81], 0), moment(&cells[..81], 0));
        assert!((after / before - 1.0).abs() < 1e-3, "no power is lost: {before}, {after}");
        let found = (moment(&cells[..81], 2) / after).sqrt();
        assert!((found / wide - 1.0).abs() < 0.02, "{found}, {wide}");
        // An erased cell stays so and makes no hole around it.
        assert!(cells[81 + 43].is_nan());
        assert!((cells[81 + 44] / cells[44] - 1.0).abs() < 0.2, "{} {}", cells[81 + 44], cells[44]);
    }
}
