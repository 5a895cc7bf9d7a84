//! L_EM that compares levels, in the tiles; the mathematics is in `mhp/levels.rs`.

use super::{
    EmQuery, F32Range, Moments, PerCell, Simd, TileGrid, Tiles, ViewLoss, cell_parts, lanes, share, splat, store,
};
use crate::config::EmLoss;
use crate::mhp::level_rows::ln_1p;
use crate::mhp::levels::{LevelTotals, REGULARISER};
use crate::mhp::splat::Splat;
use std::f64::consts::{LOG2_E, PI};

/// A joint whose simulated power in a cell is less than this share of the noise is dropped there.
const LEAST_OF_NOISE: f64 = 1e-9;
/// How much larger the gain may be than was guessed, and how often it is guessed.
const GAIN_STEP: f64 = 2.0;
const MAX_GAIN_STEP: f64 = 1e15;
const GAIN_GUESSES: usize = 24;
/// Tiles whose sums are taken in single precision.
const TILES_OF_F32_SUM: usize = 16;

/// What is measured, a number a cell of a tile: as in `Levels`, 0 beyond the box.
#[derive(Debug, Clone, Default)]
pub(in crate::mhp) struct LevelTiles {
    measured: Vec<PerCell>,
    by_noise: Vec<PerCell>,
    base: Vec<PerCell>,
}

/// What levels are compared with: the measured ones in tiles, and their totals.
#[derive(Clone, Copy)]
pub(in crate::mhp) struct LevelQuery<'a> {
    pub(in crate::mhp) tiles: &'a LevelTiles,
    pub(in crate::mhp) totals: &'a LevelTotals,
}

impl LevelTiles {
    /// Of these numbers a cell of the box, in C order.
    pub(in crate::mhp) fn new(grid: &TileGrid, values: [&[f64]; 3]) -> Self {
        let [measured, by_noise, base] = values.map(|values| {
            let mut tiles = vec![PerCell::ZERO; grid.target.len()];
            if !tiles.is_empty() {
                let mut values = values.iter();
                grid.for_places(|tile, cell| tiles[tile][cell] = values.next().map_or(0.0, |&x| x as f32));
            }
            tiles
        });
        Self { measured, by_noise, base }
    }
}

/// Sums over the cells of the listed tiles of what is said of every register of them: in single precision for some tiles and in
/// double for all. A macro, for a closure would not be compiled for the instruction set.
macro_rules! over_cells {
    ($simd:ident, $count:literal, $tiles:expr, |$tile:ident, $part:ident| $values:expr) => {{
        let mut totals = [0.0; $count];
        for few in $tiles.chunks(TILES_OF_F32_SUM) {
            let mut sums = [splat($simd, 0.0); $count];
            for &tile in few {
                let $tile = tile as usize;
                for $part in 0..cell_parts::<S>() {
                    let values = $values;
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += value;
                    }
                }
            }
            for (total, sum) in totals.iter_mut().zip(sums) {
                *total += f64::from(sum.reduce_sum());
            }
        }
        totals
    }};
}

impl Tiles {
    /// Compares levels; the IoU of the hard masks is told besides.
    #[inline(always)]
    pub(super) fn compare_levels<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        query: &EmQuery<'_>,
        levels: LevelQuery<'_>,
        moments: &mut Moments,
    ) -> ViewLoss {
        let (grid, totals) = (query.grid, levels.totals);
        let mut gain = totals.gain(Self::power_everywhere(query));
        let mut tries = 0..GAIN_GUESSES;
        let (range, sum) = loop {
            let cut_ln = 0.5 * (totals.noise * LEAST_OF_NOISE / gain).ln();
            let range = F32Range::above(cut_ln * LOG2_E);
            self.sum::<S, COHERENT>(simd, grid, &range);
            let sum = self.powers::<S, COHERENT>(simd, grid);
            let found = totals.gain(sum * (2.0 * range.log2).exp2());
            if found > GAIN_STEP * gain && tries.next().is_some() {
                // Where nothing was above the cut, all that is known is that nothing was: what lies far below it comes in reach
                // step by step, so that it cannot leave f32's range on the other side.
                gain = found.min(gain * MAX_GAIN_STEP);
                continue;
            }
            gain = found;
            break (range, sum);
        };
        // Powers as they lie in the tiles are relative to the range's unit.
        let unit = (2.0 * range.log2).exp2();
        if sum * unit < REGULARISER {
            // Nobody is in the region: what is summed is what rounding leaves.
            self.lit.clear();
            self.lit_bits.fill(0);
        }
        let scaled_gain = (gain * unit) as f32;
        let by_sum = 1.0 / (sum + REGULARISER / unit);
        let (loss, through_gain) = match totals.kind {
            EmLoss::Gamma => self.divergences(simd, levels, scaled_gain),
            EmLoss::Iou | EmLoss::NccDb => self.correlations(simd, levels, scaled_gain),
        };
        let threshold = query.with_iou.then(|| self.threshold::<S, COHERENT>(simd, query, &range));
        let among_lit = threshold.as_ref().is_none_or(|threshold| threshold.among_lit);
        let iou = threshold.and_then(|threshold| self.hard_iou(simd, query, threshold.lower));
        if let Some(factor) = query.gradient_factor {
            let factor = splat(simd, (2.0 * factor * gain * unit) as f32);
            let through_gain = splat(simd, (through_gain * by_sum) as f32);
            self.sloped.clear();
            self.sloped.extend_from_slice(&self.lit_bits);
            for &tile in &self.lit {
                let tile = tile as usize;
                let ([re, im], slopes) = (&mut self.sums[tile], &self.slopes[tile]);
                for part in 0..cell_parts::<S>() {
                    let inside =
                        lanes(simd, &grid.target[tile], part).select_gt(splat(simd, -0.5), factor, splat(simd, 0.0));
                    let weight = (lanes(simd, slopes, part) - through_gain) * inside;
                    if COHERENT {
                        let (weighed_re, weighed_im) = (lanes(simd, re, part) * weight, lanes(simd, im, part) * weight);
                        store(re, part, weighed_re);
                        store(im, part, weighed_im);
                    } else {
                        store(re, part, weight);
                    }
                }
            }
            self.collect::<S, COHERENT>(simd, grid, moments);
        }
        if among_lit {
            return ViewLoss { loss, iou };
        }
        // Rare: the body is above the noise in fewer cells than a mask has.
        let masks = EmQuery { levels: None, gradient_factor: None, ..*query };
        ViewLoss { loss, iou: self.compare_masks::<S, COHERENT>(simd, &masks, moments).iou }
    }

    /// Σ S over a plane without bounds, the joints apart from each other: a first guess of the sum over the box.
    fn power_everywhere(query: &EmQuery<'_>) -> f64 {
        let of = |joint: Splat<'_>| {
            let [a, b, c] = joint.weight;
            (2.0 * joint.ln_weight).exp() / (a * b * c).sqrt()
        };
        // Missing axes are one bin wide: what they lack of a Gaussian's width is little beside the guess's step.
        query.splats.iter().map(of).sum::<f64>() * PI
    }

    /// |S|² of every cell that is summed, 0 beyond the box; and their sum.
    #[inline(always)]
    fn powers<S: Simd, const COHERENT: bool>(&mut self, simd: S, grid: &TileGrid) -> f64 {
        let Self { lit, sums, power, slopes, .. } = self;
        slopes.resize(power.len(), PerCell::ZERO);
        let zero = splat(simd, 0.0);
        let [sum] = over_cells!(simd, 1, lit, |tile, part| {
            let [re, im] = &sums[tile];
            let (re, im) = (lanes(simd, re, part), lanes(simd, im, part));
            let square = if COHERENT { re.mul_add(re, im * im) } else { re };
            let square = lanes(simd, &grid.target[tile], part).select_gt(splat(simd, -0.5), square, zero);
            store(&mut power[tile], part, square);
            [square]
        });
        sum
    }

    /// `ncc_db`, ∂L/∂(g S) of each cell that is summed into `slopes`, and Σ of its product with S.
    #[inline(always)]
    fn correlations<S: Simd>(&mut self, simd: S, levels: LevelQuery<'_>, gain: f32) -> (f64, f64) {
        let Self { lit, power, slopes, .. } = self;
        let LevelTiles { measured, by_noise, base } = levels.tiles;
        let (gain, one) = (splat(simd, gain), splat(simd, 1.0));
        let sums = over_cells!(simd, 3, lit, |tile, part| {
            let above = lanes(simd, &power[tile], part) * gain * lanes(simd, &by_noise[tile], part);
            let d = ln_1p(simd, above);
            store(&mut slopes[tile], part, d);
            let base = lanes(simd, &base[tile], part);
            [d, d * lanes(simd, &measured[tile], part), (base + base + d) * d]
        });
        let found = levels.totals.correlation(sums);
        let by_measured = splat(simd, found.by_measured as f32);
        let (by_level, mean) = (splat(simd, found.by_level as f32), splat(simd, found.mean as f32));
        let [product] = over_cells!(simd, 1, lit, |tile, part| {
            let (power, by_noise) = (lanes(simd, &power[tile], part), lanes(simd, &by_noise[tile], part));
            let level = lanes(simd, &base[tile], part) + lanes(simd, &slopes[tile], part) - mean;
            let by_d = lanes(simd, &measured[tile], part).mul_add(by_measured, level * by_level);
            let slope = by_d * by_noise / (power * gain).mul_add(by_noise, one);
            store(&mut slopes[tile], part, slope);
            [slope * power]
        });
        (found.loss, product)
    }

    /// `gamma`, and the same of it.
    #[inline(always)]
    fn divergences<S: Simd>(&mut self, simd: S, levels: LevelQuery<'_>, gain: f32) -> (f64, f64) {
        let Self { lit, power, slopes, .. } = self;
        let LevelTiles { measured, by_noise, .. } = levels.tiles;
        let (gain, one) = (splat(simd, gain), splat(simd, 1.0));
        let by_count = splat(simd, (1.0 / levels.totals.count) as f32);
        let [sum, product] = over_cells!(simd, 2, lit, |tile, part| {
            let (power, by_noise) = (lanes(simd, &power[tile], part), lanes(simd, &by_noise[tile], part));
            let (y, i) = (power * gain * by_noise, lanes(simd, &measured[tile], part));
            let m = one / (y + one);
            let slope = by_noise * m * i.neg_mul_add(m, one) * by_count;
            store(&mut slopes[tile], part, slope);
            [(i * y).neg_mul_add(m, ln_1p(simd, y)), slope * power]
        });
        (levels.totals.idle + sum / levels.totals.count, product)
    }

    #[inline(always)]
    fn hard_iou<S: Simd>(&self, simd: S, query: &EmQuery<'_>, lower: f32) -> Option<f64> {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let [both, hard] = over_cells!(simd, 2, self.lit, |tile, part| {
            let above = lanes(simd, &self.power[tile], part).select_gt(splat(simd, lower), one, zero);
            [above * lanes(simd, &query.grid.target[tile], part).max(zero), above]
        });
        let both = both as usize;
        share(both, hard as usize + query.grid.marked - both)
    }
}

impl F32Range {
    /// For what is at least `cut_log2`, log₂ of an amplitude.
    fn above(cut_log2: f64) -> Self {
        let range = Self::below(0.0);
        Self { log2: cut_log2 - f64::from(range.cut), ..range }
    }
}
