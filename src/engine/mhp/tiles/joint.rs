//! A splat in powers of two, and as every row of tiles sees it.

use super::strip::{MAX_CHAINED_RISE_LOG2, product};
use super::{
    Aligned, BLOCK_TILES, Block, CELL_ACROSS_BINS, CELL_ALONG_BINS, ComplexPerCell, HALF_TILE_ACROSS_BINS,
    HALF_TILE_ALONG_BINS, Lanes, MAX_RETURN_LOG2, PerCell, PerTile, Simd, TILE_ACROSS_BINS, TILE_ALONG_BINS,
    TILE_STEPS_BINS, TileGrid, cell_parts, lanes, splat, store, tile_parts,
};
use crate::mhp::splat::Splat;
use std::f64::consts::{LOG2_E, TAU};

/// log₂ of what tables of factors hold, at most and one by it: their squares stay in range, and no strip has larger ones.
const MAX_FACTOR_LOG2: f32 = 2.0 * MAX_CHAINED_RISE_LOG2;

/// The spectrum of ω along a Doppler axis, a tile: what it is in the middle, how far its bins lie from that, and those
/// distances a cell. Empty where the axis is no Doppler axis.
#[derive(Debug, Default)]
pub(super) struct Spectrum {
    /// Largest of all its bins.
    pub largest: f32,
    /// Middles and farthest distances of sixteen tiles.
    pub blocks: Vec<[PerTile; 2]>,
    pub cells: Vec<PerCell>,
}

impl Spectrum {
    /// `ln` is the spectrum of the whole axis; a tile has `bins` of it, and `lane` picks the one that a cell lies in.
    fn fill(&mut self, ln: &[f64], lo: usize, tiles: usize, bins: usize, lane: impl Fn(usize) -> usize) {
        self.blocks.clear();
        self.cells.clear();
        self.largest = largest(ln);
        if ln.is_empty() {
            return;
        }
        self.blocks.resize(tiles.div_ceil(BLOCK_TILES), [PerTile::ZERO; 2]);
        for tile in 0..tiles {
            let bin = |i: usize| LOG2_E * ln.get(lo + tile * bins + i).copied().unwrap_or(0.0);
            let (low, high) = (0..bins).map(bin).fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
            let middle = f64::midpoint(low, high);
            let [middles, most] = &mut self.blocks[tile / BLOCK_TILES];
            (middles[tile % BLOCK_TILES], most[tile % BLOCK_TILES]) = (middle as f32, (0.5 * (high - low)) as f32);
            self.cells.push(Aligned(std::array::from_fn(|cell| (bin(lane(cell)) - middle) as f32)));
        }
    }

    /// How far the bins of a tile lie from what the spectrum is in its middle.
    pub(super) fn most(&self, tile: usize) -> f32 {
        self.blocks.get(tile / BLOCK_TILES).map_or(0.0, |[_, most]| most[tile % BLOCK_TILES])
    }
}

/// log₂ of the largest of a spectrum; 0 where there is none.
fn largest(ln: &[f64]) -> f32 {
    if ln.is_empty() { 0.0 } else { (LOG2_E * ln.iter().copied().fold(f64::MIN, f64::max)) as f32 }
}

/// Sixteen rows of tiles as a joint sees them, a number a row.
#[derive(Debug, Clone, Copy, Default)]
struct TileRows {
    top: PerTile,
    /// log₂ in the row, at most, but for a spectrum along it.
    highest: PerTile,
    slope: PerTile,
    nearest: PerTile,
    rest: PerTile,
    turn: [PerTile; 2],
    delta: PerTile,
}

/// A row of tiles as a joint sees it.
pub(super) struct TileRow {
    /// log₂ where the joint's ridge crosses the row's middle.
    pub top: f32,
    /// Slope across the row at the ridge.
    pub slope: f32,
    /// From the ridge to the middle of the first tile, bins: a multiple of a tile, and the rest.
    pub nearest: f32,
    pub rest: f32,
    /// e^{i…} beside the joint.
    pub turn: [f32; 2],
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
    /// −2 h₂ and k₂₁ for the tiles of a row.
    pub bend: f32,
    pub shear: f32,
    /// From the joint to the middle of the first tile of a row, bins: a multiple of a tile, and the rest.
    pub first: [f32; 2],
    /// Largest fall of the exponent from the middle of a tile to its corner by curvature alone.
    pub curvature: f32,
    /// Within a tile: the quadratic form, and e^{iκΔ}.
    pub quadratic: PerCell,
    pub turn: ComplexPerCell,
    /// Both in one; and what takes every cell one tile further along the row, but for what the middle does.
    pub shape: ComplexPerCell,
    pub gain: PerCell,
    /// e^{iκΔ} of the tiles of a row, sixteen at a time.
    columns: Vec<[PerTile; 2]>,
    tile_rows: Vec<TileRows>,
    /// A bit a row, sixteen at a time: those that the joint reaches.
    rows: Vec<u32>,
    /// Nowhere above what single precision holds, and a Gaussian along both axes.
    pub bounded: bool,
    pub along: Spectrum,
    pub across: Spectrum,
    /// log₂ of the largest of the spectrum along the outermost of three axes, where that is a Doppler axis.
    outer: f32,
}

impl Joint {
    #[inline(always)]
    pub(super) fn fill<S: Simd, const COHERENT: bool>(&mut self, simd: S, splat_of: &Splat<'_>, grid: &TileGrid) {
        let Splat { bin, weight, skew, ln_weight, phase, kappa, spectrum } = splat_of;
        let [turns0, turns1, turns2] = *kappa;
        (self.bin, self.skew) = (*bin, *skew);
        self.kappa = [turns0 * (1.0 / TAU), turns1 * (1.0 / TAU), turns2 * (1.0 / TAU)];
        self.half = [weight[0] * (0.5 * LOG2_E), weight[1] * (0.5 * LOG2_E), weight[2] * (0.5 * LOG2_E)];
        (self.phase, self.top) = (phase * (1.0 / TAU), ln_weight * LOG2_E);
        let k21 = self.skew[2];
        (self.bend, self.shear) = ((-2.0 * self.half[2]) as f32, k21 as f32);
        self.first = nearest_tile(grid.middle()[1] - self.bin[2]).map(|bins| bins as f32);
        let (reach_y, reach_x) = (f64::from(HALF_TILE_ACROSS_BINS), f64::from(HALF_TILE_ALONG_BINS));
        let most_x = reach_x + reach_y * k21.abs();
        self.curvature = (self.half[1] * reach_y * reach_y + self.half[2] * most_x * most_x) as f32;
        self.tables::<S, COHERENT>(simd, grid);
        self.along.fill(spectrum[2], grid.lo[2], grid.columns, TILE_ALONG_BINS, |cell| cell % TILE_ALONG_BINS);
        self.across.fill(spectrum[1], grid.lo[1], grid.rows, TILE_ACROSS_BINS, |cell| cell / TILE_ALONG_BINS);
        self.outer = largest(spectrum[0]);
        let blocks = grid.rows.div_ceil(BLOCK_TILES);
        let mut tile_rows = std::mem::take(&mut self.tile_rows);
        tile_rows.resize(grid.size[0] * blocks, TileRows::default());
        for (index, tile_rows) in tile_rows.iter_mut().enumerate() {
            let (slice, block) = (index / blocks, index % blocks);
            let outer = spectrum[0].get(grid.lo[0] + slice).map_or(0.0, |ln| LOG2_E * ln);
            self.fill_rows(simd, grid, (slice, block), outer, tile_rows);
        }
        self.tile_rows = tile_rows;
    }

    /// What is the same in every tile, and along every row.
    #[inline(always)]
    fn tables<S: Simd, const COHERENT: bool>(&mut self, simd: S, grid: &TileGrid) {
        let (across, along) = (splat(simd, self.kappa[1] as f32), splat(simd, self.kappa[2] as f32));
        let rise = TILE_ALONG_BINS as f32 * self.bend;
        let (half_y, half_x) = (splat(simd, -self.half[1] as f32), splat(simd, -self.half[2] as f32));
        for part in 0..cell_parts::<S>() {
            let (x, y) = (lanes(simd, &CELL_ALONG_BINS, part), lanes(simd, &CELL_ACROSS_BINS, part));
            let none = [splat(simd, 1.0), splat(simd, 0.0)];
            let within = if COHERENT { y.mul_add(across, x * along).cos_sin_turns() } else { none };
            let bent = y.mul_add(splat(simd, self.shear), x);
            let quadratic = (bent * bent).mul_add(half_x, y * y * half_y);
            store(&mut self.quadratic, part, quadratic);
            let bump = factor(simd, quadratic);
            let gain = factor(simd, y.mul_add(splat(simd, rise * self.shear), x * splat(simd, rise)));
            for i in 0..2 {
                store(&mut self.turn[i], part, within[i]);
                store(&mut self.shape[i], part, bump * within[i]);
            }
            store(&mut self.gain, part, gain);
        }
        self.columns.resize(grid.columns.div_ceil(BLOCK_TILES), [PerTile::ZERO; 2]);
        for (block, columns) in self.columns.iter_mut().enumerate() {
            let bins = grid.middle()[1] + (block * BLOCK_TILES * TILE_ALONG_BINS) as f64 - self.bin[2];
            let first = splat(simd, whole_turns_off(self.kappa[2] * bins));
            for part in 0..tile_parts::<S>() {
                let turns = lanes(simd, &TILE_STEPS_BINS, part).mul_add(along, first).cos_sin_turns();
                for i in 0..2 {
                    store(&mut columns[i], part, turns[i]);
                }
            }
        }
    }

    /// Fills in sixteen rows from row 16 `block` of a slice on; `outer` is the spectrum there, log₂.
    #[inline(always)]
    fn fill_rows<S: Simd>(
        &self,
        simd: S,
        grid: &TileGrid,
        (slice, block): (usize, usize),
        outer: f64,
        tile_rows: &mut TileRows,
    ) {
        let Self { half: [h0, h1, _], skew: [k10, k20, k21], kappa: [kappa0, kappa1, _], .. } = *self;
        let [middle_y, middle_x] = grid.middle();
        let d0 = (grid.lo[0] + slice) as f64 - self.bin[0];
        let first_y = middle_y + (block * BLOCK_TILES * TILE_ACROSS_BINS) as f64 - self.bin[1];
        let (top, turn) = (self.top + outer - h0 * d0 * d0, self.phase + kappa0 * d0);
        let (shift_y, shift_x) = (k10 * d0, middle_x - self.bin[2] + k20 * d0);
        let [middle, most] = self.across.blocks.get(block).copied().unwrap_or_default();
        let mut turns = PerTile::ZERO;
        for i in 0..BLOCK_TILES {
            let y = first_y + (i * TILE_ACROSS_BINS) as f64;
            let from_ridge = y + shift_y;
            let slope = -2.0 * h1 * from_ridge;
            let [nearest, rest] = nearest_tile(shift_x + k21 * y);
            tile_rows.top[i] = (top + 0.5 * slope * from_ridge) as f32 + middle[i];
            tile_rows.slope[i] = slope as f32;
            tile_rows.highest[i] = tile_rows.top[i] + HALF_TILE_ACROSS_BINS * tile_rows.slope[i].abs() + most[i];
            (tile_rows.nearest[i], tile_rows.rest[i]) = (nearest as f32, rest as f32);
            turns[i] = whole_turns_off(turn + kappa1 * y);
            tile_rows.delta[i] = y as f32;
        }
        for part in 0..tile_parts::<S>() {
            for (table, values) in tile_rows.turn.iter_mut().zip(lanes(simd, &turns, part).cos_sin_turns()) {
                store(table, part, values);
            }
        }
    }

    #[inline(always)]
    pub(super) fn tile_row(&self, grid: &TileGrid, block: &Block) -> TileRow {
        let tile_rows = &self.tile_rows[block.slice * grid.rows.div_ceil(BLOCK_TILES) + block.row / BLOCK_TILES];
        let i = block.row % BLOCK_TILES;
        TileRow {
            top: tile_rows.top[i],
            slope: tile_rows.slope[i],
            nearest: tile_rows.nearest[i],
            rest: tile_rows.rest[i],
            turn: [tile_rows.turn[0][i], tile_rows.turn[1][i]],
            delta: tile_rows.delta[i],
        }
    }

    /// Marks the rows in which the joint is stronger than `cut` or may be, and whether it fits into f32 with `scale`, log₂.
    #[inline(always)]
    pub(super) fn mark_rows<S: Simd>(&mut self, simd: S, grid: &TileGrid, cut: f32, scale: f64) {
        let blocks = grid.rows.div_ceil(BLOCK_TILES);
        let least = splat(simd, cut - self.along.largest);
        self.rows.clear();
        for (index, tile_rows) in self.tile_rows.iter().enumerate() {
            let mut rows = 0;
            for part in 0..tile_parts::<S>() {
                rows |= (lanes(simd, &tile_rows.highest, part) - least).positive_bits() << (part * S::F32_LANES);
            }
            self.rows.push(rows & low_bits(grid.rows - index % blocks * BLOCK_TILES));
        }
        self.bounded = !self.by_bin() && self.top + f64::from(self.outer) - scale < f64::from(MAX_RETURN_LOG2);
    }

    /// Whether an axis within a tile is a Doppler axis, where what the cells want is told by bins as well.
    #[inline(always)]
    pub(super) fn by_bin(&self) -> bool {
        !(self.along.cells.is_empty() && self.across.cells.is_empty())
    }

    /// Whether the joint reaches a block's row.
    #[inline(always)]
    pub(super) fn reaches_row(&self, grid: &TileGrid, block: &Block) -> bool {
        self.rows[block.slice * grid.rows.div_ceil(BLOCK_TILES) + block.row / BLOCK_TILES] >> (block.row % BLOCK_TILES)
            & 1
            == 1
    }

    /// (exponent, slope across, slope along) in some of a block's tile middles, log₂.
    #[inline(always)]
    pub(super) fn middles<S: Simd>(
        &self,
        simd: S,
        (block, tile_row): (&Block, &TileRow),
        part: usize,
    ) -> [Lanes<S>; 3] {
        // All but the rest is whole: x keeps its digits near the ridge.
        let whole = lanes(simd, &TILE_STEPS_BINS, part)
            + splat(simd, tile_row.nearest + (block.column * TILE_ALONG_BINS) as f32);
        let x = whole + splat(simd, tile_row.rest);
        let along = x * splat(simd, self.bend);
        let mut exponent = along.mul_add(x * splat(simd, 0.5), splat(simd, tile_row.top));
        if let Some([middle, _]) = self.along.blocks.get(block.column / BLOCK_TILES) {
            exponent += lanes(simd, middle, part);
        }
        [exponent, along.mul_add(splat(simd, self.shear), splat(simd, tile_row.slope)), along]
    }

    /// How far the joint's spectrum may lie above its middles, in some of a block's tiles.
    #[inline(always)]
    pub(super) fn slack<S: Simd>(&self, simd: S, block: &Block, part: usize) -> Lanes<S> {
        let across = splat(simd, self.across.most(block.row));
        self.along.blocks.get(block.column / BLOCK_TILES).map_or(across, |[_, most]| across + lanes(simd, most, part))
    }

    /// e^{i…} in the middle of a block's tile.
    #[inline(always)]
    pub(super) fn middle_turn(&self, block: &Block, tile_row: &TileRow, tile: usize) -> [f32; 2] {
        let columns = &self.columns[block.column / BLOCK_TILES];
        let ([a, b], [c, d]) = (tile_row.turn, [columns[0][tile], columns[1][tile]]);
        [a * c - b * d, a * d + b * c]
    }

    /// e^{i…} in the middles of some of a block's tiles.
    #[inline(always)]
    pub(super) fn middle_turns<S: Simd>(
        &self,
        simd: S,
        (block, tile_row): (&Block, &TileRow),
        part: usize,
    ) -> [Lanes<S>; 2] {
        let [cos, sin] = &self.columns[block.column / BLOCK_TILES];
        let tile_row = [splat(simd, tile_row.turn[0]), splat(simd, tile_row.turn[1])];
        product(tile_row, [lanes(simd, cos, part), lanes(simd, sin, part)])
    }

    /// The most that spectra add, log₂.
    pub(super) fn spectrum(&self) -> f32 {
        self.outer + self.along.largest + self.across.largest
    }

    pub(super) fn is_finite(&self) -> bool {
        let own = [self.top, self.phase, f64::from(self.spectrum())];
        own.iter().chain(&self.half).chain(&self.skew).chain(&self.bin).chain(&self.kappa).all(|x| x.is_finite())
    }
}

/// The lowest `count` bits of sixteen.
fn low_bits(count: usize) -> u32 {
    u32::MAX >> (32 - count.min(BLOCK_TILES))
}

/// What is left of `turns` beside whole ones.
#[inline(always)]
fn whole_turns_off(turns: f64) -> f32 {
    (turns - turns.round_ties_even()) as f32
}

/// 2ˣ, held within bounds.
#[inline(always)]
fn factor<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    x.max(splat(simd, -MAX_FACTOR_LOG2)).min(splat(simd, MAX_FACTOR_LOG2)).exp2()
}

/// `bins` as a multiple of a tile and the rest: both keep their digits in single precision.
#[inline(always)]
fn nearest_tile(bins: f64) -> [f64; 2] {
    let nearest = (bins * (1.0 / TILE_ALONG_BINS as f64)).round_ties_even() * TILE_ALONG_BINS as f64;
    [nearest, bins - nearest]
}
