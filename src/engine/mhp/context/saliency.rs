//! How far each cell of a map rises above its background: local maxima found, points looked up.
//!
//! A strong echo smears along its own range (sidelobes of the angular transform), and so do walls that surround the
//! radar: both are arcs about the radar. A person is compact. So each cell is compared with the median of the cells at
//! the same range; where a view does not resolve range, with the median of the map.
//!
//! What the axes alone decide ([`SpatialGrid`]) is worked out once for all maps of a view. Cells are f32 of the map's largest.

use super::triangulate::Mark;
use crate::config::Background;
use crate::geometry::{Vec3, dot, mat_t_vec};
use crate::mhp::fill::all_neighbours;
use crate::mhp::for_neighbours;
use crate::mhp::triad::SphericalTriad;
use crate::radar::{AxisKind, NEAREST_M, SpatialGrid, unravel};
use smallvec::SmallVec;
use std::collections::HashSet;
use std::sync::{Arc, OnceLock};

/// Spread of speckle, ln: a Rayleigh amplitude has 0.64. What rises less over the background is not counted.
pub(super) const SPECKLE: f64 = 0.64;
/// e^[`SPECKLE`]
const SPECKLE_RATIO: f64 = 1.896_480_879_304_951_5;
/// Percentiles tried for local maxima, strictest first, until [`ENOUGH_PEAKS`] are found.
const PERCENTILES: [f64; 6] = [99.5, 99.0, 98.0, 96.0, 92.0, 85.0];
const ENOUGH_PEAKS: usize = 12;
/// How far below its strongest cell a body is still lit, ln: 26 dB.
pub(super) const DEPTH_LN: f64 = 3.0;
/// At most this many peaks of a view are kept, strongest first.
const MOST_PEAKS: usize = 40;

/// A local maximum of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Peak {
    /// Index of the view.
    pub view: usize,
    /// Bin on each axis of the view.
    pub bin: Vec<usize>,
    /// H_ori there, to single precision.
    pub value: f64,
    /// H_ori over the background at the same range, ln.
    pub salience: f64,
}

/// What the change from one map to another tells at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mhp) struct Flow {
    /// Magnitude of the intensity gradient, of the map's steepest.
    pub steepness: f64,
    /// 1 where the echo goes away from the radar, −1 where it comes, 0 where nothing tells.
    pub sign: f64,
}

/// A view's map without its Doppler axes (the strongest Doppler bin stands for a cell).
#[derive(Debug, Clone)]
pub(in crate::mhp) struct SaliencyMap {
    /// Index of the view.
    view: usize,
    grid: Arc<SpatialGrid>,
    /// H of each spatial cell in shares of `largest`, and the full cell it was taken from where that is another.
    value: Vec<f32>,
    source: Vec<u32>,
    largest: f64,
    /// What a cell is compared with.
    compared_with: Background,
    /// One over the background of each ring, worked out where it is asked for.
    background: Vec<OnceLock<f32>>,
    /// How much each spatial cell changes with time, 0 to 1: what stands still does not count. `None` where nothing tells.
    temporal_variation: Option<Arc<Vec<f32>>>,
}

impl SaliencyMap {
    /// Of the map of view `view`, whose cells are `grid`.
    pub(super) fn new(view: usize, grid: &Arc<SpatialGrid>, map: &[f64], compared_with: Background) -> Self {
        let largest = map.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let (value, source) = grid.spatial(map, largest);
        let (grid, background) = (Arc::clone(grid), grid.unknown());
        Self { view, grid, value, source, largest, compared_with, background, temporal_variation: None }
    }

    /// The largest value of its map.
    pub(super) fn largest(&self) -> f64 {
        self.largest
    }

    /// Another map of the same view, a short time before or after, on the scale and with the stillness of this one. The
    /// background is its own: that of a ring rises with the sidelobes of whoever stands in it.
    pub(super) fn at_another_time(&self, map: &[f64]) -> Self {
        let (value, source) = self.grid.spatial(map, self.largest);
        let (grid, background) = (Arc::clone(&self.grid), self.grid.unknown());
        Self { value, source, background, grid, temporal_variation: self.temporal_variation.clone(), ..*self }
    }

    /// The same map where what stands still does not count: cells whose coefficient of variation over time is below `still`
    /// do not, those above `varying` do.
    pub(super) fn where_varying(self, coefficients: &[f32], [still, varying]: [f32; 2]) -> Self {
        let variation = |cell: usize| ((coefficients[self.source(cell)] - still) / (varying - still)).clamp(0.0, 1.0);
        let of_spatial = (0..self.value.len()).map(variation).collect();
        Self { temporal_variation: Some(Arc::new(of_spatial)), ..self }
    }

    /// The same map where some of its `peaks` were missed: with each goes its hill, the cells from which the steepest way up
    /// leads to it.
    pub(in crate::mhp) fn without<'a>(&self, peaks: impl Iterator<Item = &'a Peak>) -> Self {
        let missed: HashSet<usize> = peaks.map(|peak| self.spatial_of(peak)).collect();
        let mut top_of: Vec<usize> = (0..self.value.len()).map(|cell| self.upward(cell)).collect();
        for cell in 0..top_of.len() {
            let (mut at, mut way) = (cell, Vec::new());
            while top_of[at] != at {
                way.push(at);
                at = top_of[at];
            }
            for passed in way {
                top_of[passed] = at;
            }
        }
        let variation = |cell: usize| self.temporal_variation.as_ref().map_or(1.0, |variation| variation[cell]);
        let left = |(cell, top): (usize, usize)| if missed.contains(&top) { 0.0 } else { variation(cell) };
        let left = top_of.into_iter().enumerate().map(left).collect();
        Self { temporal_variation: Some(Arc::new(left)), ..self.clone() }
    }

    /// The highest neighbour of a cell, or itself where none is higher.
    fn upward(&self, cell: usize) -> usize {
        let mut highest = cell;
        for_neighbours(&self.grid.shape, cell, |other| {
            if self.value[other] > self.value[highest] {
                highest = other;
            }
        });
        highest
    }

    /// The cell of the whole map that a spatial cell was taken from.
    fn source(&self, spatial: usize) -> usize {
        self.source.get(spatial).map_or(spatial, |&cell| cell as usize)
    }

    fn temporal_variation(&self, cell: usize) -> f64 {
        self.temporal_variation.as_ref().map_or(1.0, |variation| f64::from(variation[cell]))
    }

    /// H over the background.
    #[inline]
    fn over_background(&self, cell: usize) -> f32 {
        let place = self.grid.place(cell, self.compared_with);
        self.value[cell] * self.background[place].get_or_init(|| self.grid.background(&self.value, place))
    }

    /// ln H over the background of what moves, ≥ 0.
    fn salience(&self, cell: usize) -> f64 {
        f64::from(self.over_background(cell).max(1.0).ln()) * self.temporal_variation(cell)
    }

    /// H over the background and what speckle rises above it, of what moves, of the map's largest.
    fn excess(&self, cell: usize) -> f64 {
        let over_speckle = (1.0 - SPECKLE_RATIO / f64::from(self.over_background(cell))).max(0.0);
        f64::from(self.value[cell]) * over_speckle * self.temporal_variation(cell)
    }

    /// Local maxima above the strictest percentile that leaves enough of them, strongest excess first.
    pub(in crate::mhp) fn peaks(&self) -> Vec<Peak> {
        let mut bits: Vec<u32> = self.value.iter().map(|x| x.to_bits()).collect();
        let last = bits.len().saturating_sub(1);
        let place = |q: f64| (last as f64 * q / 100.0).ceil() as usize;
        // What lies under the laxest level is of no interest.
        let laxest = place(PERCENTILES[PERCENTILES.len() - 1]).min(last);
        let least = if bits.is_empty() { 0 } else { *bits.select_nth_unstable(laxest).1 };
        let bright = (0..self.value.len()).filter(|&cell| self.value[cell].to_bits() >= least);
        let mut bright: Vec<(u32, usize)> = bright.map(|cell| (self.value[cell].to_bits(), cell)).collect();
        let mut rest = bits.get_mut(laxest..).unwrap_or_default();
        let mut kept: Vec<(f64, usize)> = Vec::new();
        for q in PERCENTILES {
            let at = place(q) - laxest;
            if at >= rest.len() {
                continue;
            }
            let (below, &mut level, _) = rest.select_nth_unstable(at);
            rest = below;
            // Those of the stricter levels have been asked.
            bright.retain(|&(bits, cell)| {
                if bits >= level && self.is_maximum(cell) {
                    kept.push((self.excess(cell), cell));
                }
                bits < level
            });
            if kept.len() >= ENOUGH_PEAKS {
                break;
            }
        }
        kept.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        kept.truncate(MOST_PEAKS);
        kept.into_iter().map(|(_, cell)| self.peak(cell)).collect()
    }

    fn is_maximum(&self, cell: usize) -> bool {
        let highest = |other: usize| self.value[other] <= self.value[cell];
        all_neighbours(&self.grid.shape, cell, highest) && self.excess(cell) > 0.0
    }

    fn peak(&self, cell: usize) -> Peak {
        Peak {
            view: self.view,
            bin: unravel(self.source(cell), &self.grid.view.shape()).to_vec(),
            value: self.largest * f64::from(self.value[cell]),
            salience: self.salience(cell),
        }
    }

    /// Where the view sees a world point, view frame, m.
    fn seen_at(&self, p_world: Vec3) -> Vec3 {
        self.grid.view.seen_at(p_world)
    }

    /// The spatial cell at a world point; `None` outside the map.
    #[inline]
    pub(in crate::mhp) fn cell(&self, p_world: Vec3) -> Option<usize> {
        let p = self.seen_at(p_world);
        self.grid.axes.iter().try_fold(0, |flat, (_, axis)| {
            let bin = axis.bin(axis.coordinate(p)).round();
            (bin >= 0.0 && bin < axis.bins as f64).then(|| flat * axis.bins + bin as usize)
        })
    }

    /// Mean over `points` of the amplitude over the background, of the map's largest.
    pub(in crate::mhp) fn mean_excess(&self, points: &[Vec3]) -> f64 {
        let sum: f64 = points.iter().filter_map(|&p| self.cell(p)).map(|cell| self.excess(cell)).sum();
        sum / points.len().max(1) as f64
    }

    /// Whether some axis of this view tells positions along `direction` (unit vector, world frame) near a world point.
    pub(in crate::mhp) fn resolves(&self, p_world: Vec3, direction: Vec3) -> bool {
        let triad = SphericalTriad::new(self.seen_at(p_world));
        self.grid.axes.iter().any(|(_, axis)| {
            let along = mat_t_vec(&self.grid.view.pose.rotation, triad.direction_and_arm(axis.kind).0);
            dot(along, direction).abs() > 0.7
        })
    }

    /// The largest salience at height `z_m` within `reach_m` before and behind `p_world`, ln.
    pub(super) fn salience_at_height(&self, p_world: Vec3, z_m: f64, reach_m: f64) -> f64 {
        let distance = p_world[0].hypot(p_world[1]).max(NEAREST_M);
        let along = (-8..=8).map(|k| 1.0 + reach_m * f64::from(k) / (8.0 * distance));
        let cells = along.filter_map(|k| self.cell([p_world[0] * k, p_world[1] * k, z_m]));
        cells.map(|cell| self.salience(cell)).fold(0.0, f64::max)
    }

    /// The spatial cell of a peak of this view.
    fn spatial_of(&self, peak: &Peak) -> usize {
        let bin = |k: usize| peak.bin.get(k).copied().unwrap_or(0);
        self.grid.axes.iter().fold(0, |flat, (k, axis)| flat * axis.bins + bin(*k))
    }

    /// H over the background at a peak of this view, of the map's largest.
    pub(in crate::mhp) fn excess_of(&self, peak: &Peak) -> f64 {
        let spatial = self.spatial_of(peak);
        if spatial < self.value.len() { self.excess(spatial) } else { 0.0 }
    }

    /// How steep the map is at a world point, of its steepest; `None` outside the map or where nothing changes.
    pub(in crate::mhp) fn steepness(&self, p_world: Vec3) -> Option<f64> {
        let (cell, steepest) = (self.cell(p_world)?, self.steepest());
        (steepest > 0.0).then(|| self.gradient(cell).1 / steepest)
    }

    /// How steep the map is at a world point, and which way its echo goes from this map to `then`; `None` outside the map
    /// or where no axis tells a distance.
    pub(in crate::mhp) fn flow(&self, then: &Self, p_world: Vec3) -> Option<Flow> {
        let cell = self.cell(p_world)?;
        let (k, axis) =
            self.grid.axes.iter().enumerate().find(|(_, (_, axis))| axis.kind.is_depth()).map(|(k, (_, a))| (k, a))?;
        let steepest = self.steepest();
        if steepest <= 0.0 {
            return None;
        }
        // Speckle makes one cell's slope a coin toss: the flow is that of the cells around, weighted by their slopes.
        let (mut change, mut slopes) = (0.0, 0.0);
        let mut add = |cell: usize| {
            let (by_axis, _) = self.gradient(cell);
            let outwards = by_axis[k] * axis.step().signum();
            let later = then.value.get(cell).copied().unwrap_or(self.value[cell]);
            change -= outwards * f64::from(later - self.value[cell]);
            slopes += outwards * outwards;
        };
        add(cell);
        for_neighbours(&self.grid.shape, cell, &mut add);
        let sign = if slopes > 0.0 { change.signum() } else { 0.0 };
        Some(Flow { steepness: self.gradient(cell).1 / steepest, sign })
    }

    /// Central differences of H along each spatial axis a bin, and their magnitude.
    fn gradient(&self, cell: usize) -> (SmallVec<[f64; 3]>, f64) {
        let shape = &self.grid.shape;
        let mut stride = self.value.len();
        let along = |(bin, &count): (usize, &usize)| {
            stride /= count;
            let (before, after) = (bin.min(1), (count - 1 - bin).min(1));
            let span = (before + after).max(1) as f64;
            f64::from(self.value[cell + after * stride] - self.value[cell - before * stride]) / span
        };
        let by_axis: SmallVec<[f64; 3]> = unravel(cell, shape).into_iter().zip(shape).map(along).collect();
        let magnitude = by_axis.iter().map(|g| g * g).sum::<f64>().sqrt();
        (by_axis, magnitude)
    }

    /// The largest magnitude of a gradient in the map.
    fn steepest(&self) -> f64 {
        let mut squares = vec![0.0_f32; self.value.len()];
        let mut stride = self.value.len();
        for &count in &self.grid.shape {
            let block = stride;
            stride /= count;
            for (squares, value) in squares.chunks_exact_mut(block).zip(self.value.chunks_exact(block)) {
                for bin in 0..count {
                    let (before, after) = (bin.min(1), (count - 1 - bin).min(1));
                    let (low, high) = ((bin - before) * stride, (bin + after) * stride);
                    let scale = 1.0 / (before + after).max(1) as f32;
                    for k in 0..stride {
                        let slope = scale * (value[high + k] - value[low + k]);
                        squares[bin * stride + k] += slope * slope;
                    }
                }
            }
        }
        f64::from(squares.into_iter().fold(0.0, f32::max).sqrt())
    }

    /// A peak's place.
    pub(in crate::mhp) fn mark(&self, peak: &Peak) -> Mark {
        let bin = self.grid.axes.iter().map(|&(k, _)| peak.bin.get(k).map_or(0.0, |&bin| bin as f64));
        Mark { view: self.view, bin: bin.collect() }
    }

    /// The middle of what is lit around a world point, within `reach_m` along directions on the floor and up; weights
    /// are the salience's excess over [`DEPTH_LN`] below the strongest cell there, so that the whole body counts and not
    /// its brightest part, and the sidelobes do not. `None` where nothing is lit.
    pub(super) fn centroid(&self, p_world: Vec3, [floor_m, up_m]: [f64; 2]) -> Option<Mark> {
        let triad = SphericalTriad::new(self.seen_at(p_world));
        let window: Vec<[usize; 2]> = self
            .grid
            .axes
            .iter()
            .map(|(_, axis)| {
                let (direction, arm) = triad.direction_and_arm(axis.kind);
                let up = mat_t_vec(&self.grid.view.pose.rotation, direction)[2].abs();
                let reach_m = floor_m + (up_m - floor_m) * up;
                let half = reach_m * triad.slope(axis) / (arm * axis.step().abs());
                let middle = axis.bin(triad.coordinate(axis, 0.0));
                let clamp = |bin: f64| bin.clamp(0.0, axis.bins as f64) as usize;
                [clamp((middle - half).round()), clamp((middle + half).round() + 1.0)]
            })
            .collect();
        let cells = window.iter().zip(&self.grid.shape).fold(vec![0], |cells: Vec<usize>, (&[lo, hi], &bins)| {
            cells.iter().flat_map(|&cell| (lo..hi).map(move |bin| cell * bins + bin)).collect()
        });
        let lit: Vec<(usize, f64)> = cells.into_iter().map(|cell| (cell, self.salience(cell))).collect();
        let strongest = lit.iter().map(|(_, salience)| *salience).fold(0.0, f64::max);
        let floor = (strongest - DEPTH_LN).max(SPECKLE);
        let (mut sum, mut weights): (SmallVec<[f64; 3]>, f64) = (SmallVec::from_elem(0.0, self.grid.axes.len()), 0.0);
        for (cell, salience) in lit {
            let weight = salience - floor;
            if weight > 0.0 {
                weights += weight;
                let mut rest = cell;
                for (sum, bins) in sum.iter_mut().zip(&self.grid.shape).rev() {
                    *sum += weight * (rest % bins) as f64;
                    rest /= bins;
                }
            }
        }
        (weights > 0.0).then(|| Mark { view: self.view, bin: sum.into_iter().map(|sum| sum / weights).collect() })
    }

    /// Radial velocity (m/s) of the strongest Doppler bin at a world point, where the view has a Doppler axis.
    pub(in crate::mhp) fn radial_mps(&self, p_world: Vec3) -> Option<f64> {
        let (k, axis) = self.grid.view.axes.iter().enumerate().find(|(_, axis)| axis.kind == AxisKind::Doppler)?;
        let bins = unravel(self.source(self.cell(p_world)?), &self.grid.view.shape());
        Some(axis.at(bins[k] as f64))
    }
}
