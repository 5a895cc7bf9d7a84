//! A splat in powers of two, and as every row of tiles sees it.

use super::strip::bits;
use super::{ACROSS, ALONG, Block, CELLS, REACH, SIDE, STEPS, Simd, Tiling, lanes, splat, store};
use crate::mhp::splat::Splat;
use std::f64::consts::{LOG2_E, TAU};

/// The spectrum of ω along a Doppler axis, a tile: what it is in the middle, how far its bins lie from that, and those
/// distances a cell. Empty where the axis is no Doppler axis.
#[derive(Debug, Default)]
pub(super) struct Spectrum {
    /// Largest of all its bins.
    pub largest: f32,
    /// Middles and farthest distances of sixteen tiles.
    pub blocks: Vec<[[f32; CELLS]; 2]>,
    pub cells: Vec<[f32; CELLS]>,
}

impl Spectrum {
    /// `ln` is the spectrum of the whole axis; `lane` picks the bin of a tile that a cell lies in.
    fn fill(&mut self, ln: &[f64], lo: usize, tiles: usize, lane: impl Fn(usize) -> usize) {
        self.blocks.clear();
        self.cells.clear();
        self.largest = if ln.is_empty() { 0.0 } else { (LOG2_E * ln.iter().copied().fold(f64::MIN, f64::max)) as f32 };
        if ln.is_empty() {
            return;
        }
        self.blocks.resize(tiles.div_ceil(CELLS), [[0.0; CELLS]; 2]);
        for tile in 0..tiles {
            let bins: [f64; SIDE] =
                std::array::from_fn(|i| LOG2_E * ln.get(lo + tile * SIDE + i).copied().unwrap_or(0.0));
            let (low, high) = bins.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
            let middle = f64::midpoint(low, high);
            let [middles, most] = &mut self.blocks[tile / CELLS];
            (middles[tile % CELLS], most[tile % CELLS]) = (middle as f32, (0.5 * (high - low)) as f32);
            self.cells.push(std::array::from_fn(|cell| (bins[lane(cell)] - middle) as f32));
        }
    }

    /// How far the bins of a tile lie from what the spectrum is in its middle.
    pub(super) fn most(&self, tile: usize) -> f32 {
        self.blocks.get(tile / CELLS).map_or(0.0, |[_, most]| most[tile % CELLS])
    }
}

/// Sixteen rows of tiles as a joint sees them, a number a row.
#[derive(Debug, Clone, Copy, Default)]
struct Lines {
    top: [f32; CELLS],
    /// log₂ in the row, at most, but for a spectrum along it.
    highest: [f32; CELLS],
    slope: [f32; CELLS],
    nearest: [f32; CELLS],
    rest: [f32; CELLS],
    turn: [f32; CELLS],
    delta: [f32; CELLS],
}

/// A row of tiles as a joint sees it.
pub(super) struct Line {
    /// log₂ where the joint's ridge crosses the row's middle.
    pub top: f32,
    /// Slope across the row at the ridge.
    pub slope: f32,
    /// From the ridge to the middle of the first tile, bins: a multiple of a tile, and the rest.
    pub nearest: f32,
    pub rest: f32,
    /// Phase beside the joint, turns.
    pub turn: f32,
    /// Middle of the row minus joint, bins.
    pub delta: f32,
}

/// A splat in powers of two. Its exponent is −(h₀ d₀² + h₁ (d₁ + k₁₀ d₀)² + h₂ (d₂ + k₂₁ d₁ + k₂₀ d₀)²), the squares
/// completed from the last axis on, so that elongated Gaussians keep their digits.
#[derive(Debug, Default)]
pub(super) struct Joint {
    pub bin: [f64; 3],
    /// log₂ of amplitude times norm.
    pub top: f64,
    half: [f64; 3],
    /// k₁₀, k₂₀, k₂₁
    skew: [f64; 3],
    /// φ and κ in turns.
    phase: f64,
    kappa: [f64; 3],
    /// −2 h₂, k₂₁ and κ₂ (turns) for the tiles of a row.
    pub bend: f32,
    pub shear: f32,
    pub along_turns: f32,
    /// From the joint to the middle of the first tile of a row, bins: a multiple of a tile, and the rest.
    pub first: [f32; 2],
    /// Largest fall of the exponent from the middle of a tile to its corner by curvature alone.
    pub curvature: f32,
    /// Within a tile: the quadratic form, and e^{iκΔ}.
    pub quadratic: [f32; CELLS],
    pub turn: [[f32; CELLS]; 2],
    lines: Vec<Lines>,
    /// Blocks whose rows the joint reaches.
    pub reached: Vec<u32>,
    pub along: Spectrum,
    pub across: Spectrum,
}

impl Joint {
    #[inline(always)]
    pub(super) fn fill<S: Simd>(&mut self, simd: S, splat_of: &Splat, grid: &Tiling) {
        let missing = 3 - splat_of.dims;
        let at = |k: usize| k.checked_sub(missing);
        let p = |k: usize, l: usize| match (at(k), at(l)) {
            (Some(k), Some(l)) => splat_of.precision[k][l],
            _ => f64::from(u8::from(k == l)),
        };
        self.bin = std::array::from_fn(|k| at(k).map_or(0.0, |k| splat_of.bin[k]));
        self.kappa = std::array::from_fn(|k| at(k).map_or(0.0, |k| splat_of.kappa[k] / TAU));
        (self.phase, self.top) = (splat_of.phase / TAU, splat_of.ln_weight * LOG2_E);
        let (k20, k21) = (p(2, 0) / p(2, 2), p(2, 1) / p(2, 2));
        let s = |k: usize, l: usize| p(k, l) - p(k, 2) * p(2, l) / p(2, 2);
        let k10 = s(1, 0) / s(1, 1);
        self.half = [s(0, 0) - s(0, 1) * s(1, 0) / s(1, 1), s(1, 1), p(2, 2)].map(|h| 0.5 * LOG2_E * h);
        self.skew = [k10, k20, k21];
        (self.bend, self.shear, self.along_turns) = ((-2.0 * self.half[2]) as f32, k21 as f32, self.kappa[2] as f32);
        self.first = nearest_tile(grid.middle()[1] - self.bin[2]).map(|bins| bins as f32);
        let reach = f64::from(REACH);
        self.curvature = (self.half[1] * reach.powi(2) + self.half[2] * (reach * (1.0 + k21.abs())).powi(2)) as f32;
        for (cell, (&x, &y)) in ALONG.iter().zip(&ACROSS).enumerate() {
            let (x, y) = (f64::from(x), f64::from(y));
            self.quadratic[cell] = -(self.half[1] * y * y + self.half[2] * (x + k21 * y).powi(2)) as f32;
        }
        for part in 0..STEPS.len() / S::F32_LANES {
            let by_x = lanes(simd, &ALONG, part) * splat(simd, self.along_turns);
            let turns = lanes(simd, &ACROSS, part).mul_add(splat(simd, self.kappa[1] as f32), by_x);
            for (table, values) in self.turn.iter_mut().zip(turns.turn()) {
                store(table, part, values);
            }
        }
        let spectrum = |k: usize| at(k).map_or(&[] as &[f64], |k| splat_of.spectrum[k].as_slice());
        self.along.fill(spectrum(2), grid.lo[2], grid.columns, |cell| cell % SIDE);
        self.across.fill(spectrum(1), grid.lo[1], grid.rows, |cell| cell / SIDE);
        self.lines.clear();
        for slice in 0..grid.size[0] {
            let outer = spectrum(0).get(grid.lo[0] + slice).map_or(0.0, |ln| LOG2_E * ln);
            for block in 0..grid.rows.div_ceil(CELLS) {
                let lines = self.sixteen(grid, slice, block, outer);
                self.lines.push(lines);
            }
        }
    }

    /// Sixteen rows from row 16 `block` of a slice on; `outer` is the spectrum there, log₂.
    #[inline(always)]
    fn sixteen(&self, grid: &Tiling, slice: usize, block: usize, outer: f64) -> Lines {
        let Self { half: [h0, h1, _], skew: [k10, k20, k21], kappa: [kappa0, kappa1, _], .. } = *self;
        let [middle_y, middle_x] = grid.middle();
        let d0 = (grid.lo[0] + slice) as f64 - self.bin[0];
        let first_y = middle_y + (block * CELLS * SIDE) as f64 - self.bin[1];
        let (top, turn) = (self.top + outer - h0 * d0 * d0, self.phase + kappa0 * d0);
        let (shift_y, shift_x) = (k10 * d0, middle_x - self.bin[2] + k20 * d0);
        let [middle, most] = self.across.blocks.get(block).copied().unwrap_or_default();
        let mut lines = Lines::default();
        for i in 0..CELLS {
            let y = first_y + (i * SIDE) as f64;
            let from_ridge = y + shift_y;
            let slope = -2.0 * h1 * from_ridge;
            let [nearest, rest] = nearest_tile(shift_x + k21 * y);
            let turn = turn + kappa1 * y;
            lines.top[i] = (top + 0.5 * slope * from_ridge) as f32 + middle[i];
            lines.slope[i] = slope as f32;
            lines.highest[i] = lines.top[i] + REACH * lines.slope[i].abs() + most[i];
            (lines.nearest[i], lines.rest[i]) = (nearest as f32, rest as f32);
            lines.turn[i] = (turn - turn.round_ties_even()) as f32;
            lines.delta[i] = y as f32;
        }
        lines
    }

    #[inline(always)]
    pub(super) fn line(&self, grid: &Tiling, block: &Block) -> Line {
        let lines = &self.lines[block.slice * grid.rows.div_ceil(CELLS) + block.row / CELLS];
        let i = block.row % CELLS;
        Line {
            top: lines.top[i],
            slope: lines.slope[i],
            nearest: lines.nearest[i],
            rest: lines.rest[i],
            turn: lines.turn[i],
            delta: lines.delta[i],
        }
    }

    /// Lists the blocks in whose rows the joint is stronger than `cut`, log₂, or may be.
    #[inline(always)]
    pub(super) fn reach<S: Simd>(&mut self, simd: S, grid: &Tiling, cut: f32) {
        let (row_blocks, along) = (grid.rows.div_ceil(CELLS), grid.columns.div_ceil(CELLS));
        self.reached.clear();
        self.reached.reserve(grid.blocks.len());
        for (index, lines) in self.lines.iter().enumerate() {
            let (slice, first) = (index / row_blocks, index % row_blocks * CELLS);
            let mut rows = 0;
            for part in 0..CELLS / S::F32_LANES {
                let spare = lanes(simd, &lines.highest, part) - splat(simd, cut - self.along.largest);
                rows |= spare.positive() << (part * S::F32_LANES);
            }
            for row in bits(rows & (u32::MAX >> (32 - (grid.rows - first).min(CELLS)))) {
                let block = (slice * grid.rows + first + row) * along;
                self.reached.extend((block..block + along).map(|block| block as u32));
            }
        }
    }

    /// The most that spectra within tiles add, log₂.
    pub(super) fn spectrum(&self) -> f32 {
        self.along.largest + self.across.largest
    }

    pub(super) fn is_finite(&self) -> bool {
        let own = [self.top, self.phase];
        own.iter().chain(&self.half).chain(&self.skew).chain(&self.bin).chain(&self.kappa).all(|x| x.is_finite())
    }
}

/// `bins` as a multiple of a tile and the rest: both keep their digits in single precision.
#[inline(always)]
fn nearest_tile(bins: f64) -> [f64; 2] {
    let nearest = (bins * (1.0 / SIDE as f64)).round_ties_even() * SIDE as f64;
    [nearest, bins - nearest]
}
