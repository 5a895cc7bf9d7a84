//! The fast path of L_EM: f32, in tiles of 4 × 8 cells, each summed over the joints that matter there.
//!
//! ```text
//!            last axis, "along" →
//!            ┌───────┬───────┬───────┬─ … ─┬───────┐
//!  the axis  │ tile  │ tile  │ tile  │     │ tile  │   a block: sixteen tiles beside each other,
//!  before,   │   0   │   1   │   2   │     │  15   │   64 bins along, 8 across (`grid.rs`, `cells.rs`)
//!  "across"  └───────┴───────┴───────┴─ … ─┴───────┘
//!     ↓      a row of tiles is as many blocks as the box is wide; the last may reach beyond it
//!
//!  a tile: 4 × 8 cells               strips of a block: a joint in the tiles that it matters to (`strip.rs`)
//!  ┌───┬───┬───┬───┐                  tile     0 1 2 3 4 5 6 7 8 9 …
//!  │ 0 │ 1 │ 2 │ 3 │                  joint 3  · ■ ■ ■ ■ · · · · ·   first 1, count 4
//!  │ 4 │ 5 │ 6 │ 7 │                  joint 7  · · · ■ ■ ■ ■ ■ ■ ·   first 3, count 6
//!  │ … │   │   │   │                  joint 8  · · · · · · · · · ·   dropped: no strip
//!  │28 │29 │30 │31 │                  summed     ■ ■ ■ ■ ■ ■ ■ ■     "lit" tiles; the others are at the floor
//!  └───┴───┴───┴───┘
//!  32 f32: two registers             in a chained strip the cells of tile k + 1 are those of tile k times `gain`, and the
//!  of AVX-512, four of AVX2          middle of each tile is a complex number: a product a cell, no exponential
//! ```
//!
//! One view goes through five stages, none of which allocates once its buffers have grown:
//! 1. [`Joint`]: a splat in powers of two, its quadratic form and phase within a tile as tables, and what is the same
//!    along a row of tiles.
//! 2. Guess: the strongest joints' percentile over the middles of tiles, for the threshold.
//! 3. Sum, a block of sixteen tiles at a time. A joint is dropped from a tile where it is far below the soft mask's reach
//!    under the guessed threshold, or far below the tile's strongest joint; bounds over the tile make this safe. What is
//!    left is a [`Strip`] of tiles, where each tile's cells follow from the tile before by one complex product.
//!    All is relative to a scale of the whole view.
//! 4. Mask: percentile, soft mask, its slope. Where the threshold was guessed too high, back to 3 with a lower guess.
//! 5. Collect: the strips once more, in the tiles where the mask has a slope, into each joint's moments.
//!
//! Where levels are compared instead of masks (`levels.rs`), the guess is one of the gain, and a joint is dropped where it is
//! nothing beside the noise.
//!
//! The answer depends on the parameters alone: what is kept from the last evaluation only speeds the percentile up.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

mod cells;
mod collect;
mod f32_range;
mod grid;
mod joint;
mod levels;
mod mask;
mod strip;
mod sum;
#[cfg(test)]
mod tests;

pub(super) use grid::{TileGrid, blocks_of};
pub(super) use levels::{LevelQuery, LevelTiles};

use super::adjoint::{self, Moments};
use super::floors::{EPSILON, ViewLoss, share};
use super::lanes::{Lanes, splat};
use super::percentile::{between, place};
use super::splat::Splats;
use crate::config::Summation;
use cells::{
    Aligned, BLOCK_TILES, CELL_ACROSS_BINS, CELL_ALONG_BINS, ComplexPerCell, HALF_TILE_ACROSS_BINS,
    HALF_TILE_ALONG_BINS, PerCell, PerTile, TILE_ACROSS_BINS, TILE_ALONG_BINS, TILE_CELLS, TILE_STEPS_BINS, cell_parts,
    lanes, store, tile_parts,
};
use collect::Gathered;
use f32_range::{F32Range, MAX_GUESS_TOO_HIGH_LN, MAX_GUESS_TOO_LOW_LN, MAX_RETURN_LOG2, MIN_RETURN_LOG2};
use grid::Block;
use joint::Joint;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::LOG2_E;
use strip::Strip;

/// Softest mask, T, whose reach the powers of two of f32 hold; softer ones take the plain kernel.
const MAX_SOFTNESS: f64 = 1.5;
/// Guesses of the threshold at most.
const MAX_GUESSES: usize = 40;
/// log₂ of how far a map may stay under its strongest joint.
const MAX_MAP_BELOW_JOINTS_LOG2: f64 = 30.0;

/// Buffers of one view.
#[derive(Debug, Default)]
pub(super) struct Tiles {
    joints: Vec<Joint>,
    /// log₂ of the strongest joint in the middles of some blocks' tiles.
    middles: Vec<PerTile>,
    /// Those that reach a row.
    present: Vec<u32>,
    /// Block by block, the first `used` of them; `ends` tells where each block's strips end.
    strips: Vec<Strip>,
    used: usize,
    ends: Vec<u32>,
    /// log₂ of the strongest joint in any tile's middle.
    highest: f32,
    /// Tiles that are summed: a bit each, a block's in one number; and their places, ascending.
    lit_bits: Vec<u32>,
    lit: Vec<u32>,
    /// The sum over joints a tile (Σ(AK)² where the sum is incoherent); later times w/|S|². This and what follows holds
    /// where tiles are lit.
    sums: Vec<ComplexPerCell>,
    /// H² relative to the scale, −1 beyond the box; later m(1 − m)/|S|² · d ln(H + h)/d ln|S|.
    power: Vec<PerCell>,
    /// Where levels are compared: ∂L/∂(g S).
    slopes: Vec<PerCell>,
    /// Tiles where the mask has a slope: a bit each, a block's in one number.
    sloped: Vec<u32>,
    /// Each joint's moments over the blocks, a number a cell of a tile; zeros when they have been collected.
    gathered: Vec<Gathered>,
    /// Scratch of percentiles.
    ranked: Vec<u32>,
    /// log₂ of the last threshold, and the level of the last guess: where these are looked for first.
    last: Option<f64>,
    last_level: f64,
}

/// L_EM of one view, as it is asked for.
#[derive(Clone, Copy)]
pub(super) struct EmQuery<'a> {
    pub splats: &'a Splats,
    pub grid: &'a TileGrid,
    pub summation: Summation,
    pub tau_pct: f64,
    pub softness: f64,
    /// Factor of the gradient; `None` where none is wanted.
    pub gradient_factor: Option<f64>,
    /// What levels are compared with; `None` compares masks.
    pub levels: Option<LevelQuery<'a>>,
    /// Whether the IoU is asked for where levels are compared.
    pub with_iou: bool,
}

/// Whether f32 holds a soft mask of this temperature.
pub(super) fn holds(softness: f64) -> bool {
    softness <= MAX_SOFTNESS
}

/// The instruction set that the tiles run on here.
pub fn simd_path() -> &'static str {
    struct Name;
    impl WithSimd for Name {
        type Output = usize;
        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F32_LANES
        }
    }
    match (cfg!(target_arch = "x86_64"), Arch::new().dispatch(Name)) {
        (true, 16) => "avx512",
        (true, 8) => "avx2+fma",
        (false, 4) => "simd128",
        _ => "scalar",
    }
}

impl Tiles {
    /// Answers `query`, and fills `moments` (one a joint, zeroed) where a gradient is wanted.
    pub(super) fn evaluate(&mut self, query: &EmQuery<'_>, moments: &mut Moments) -> ViewLoss {
        match query.summation {
            Summation::Coherent => Arch::new().dispatch(EvaluateQuery::<true> { tiles: self, query, moments }),
            Summation::Incoherent => Arch::new().dispatch(EvaluateQuery::<false> { tiles: self, query, moments }),
        }
    }
}

impl Tiles {
    /// H_sim of every cell in C order, f64; `None` where f32's range does not hold it.
    pub(super) fn map(&mut self, splats: &Splats, grid: &TileGrid, summation: Summation) -> Option<Vec<f64>> {
        match summation {
            Summation::Coherent => Arch::new().dispatch(EvaluateMap::<true> { tiles: self, splats, grid }),
            Summation::Incoherent => Arch::new().dispatch(EvaluateMap::<false> { tiles: self, splats, grid }),
        }
    }

    fn values<const COHERENT: bool>(&self, grid: &TileGrid, log2: f64) -> Vec<f64> {
        let (unit, floor) = ((2.0 * log2).exp2(), EPSILON * EPSILON);
        let mut values = Vec::with_capacity(grid.cells);
        grid.for_places(|tile, cell| {
            let lit = self.lit_bits[tile / BLOCK_TILES] >> (tile % BLOCK_TILES) & 1 == 1;
            let [re, im] = [0, 1].map(|part| f64::from(self.sums[tile][part][cell]));
            let square = if COHERENT { re * re + im * im } else { re };
            values.push(if lit { (unit * square + floor).sqrt() } else { EPSILON });
        });
        values
    }
}

struct EvaluateQuery<'a, const COHERENT: bool> {
    tiles: &'a mut Tiles,
    query: &'a EmQuery<'a>,
    moments: &'a mut Moments,
}

impl<const COHERENT: bool> WithSimd for EvaluateQuery<'_, COHERENT> {
    type Output = ViewLoss;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> ViewLoss {
        let Self { tiles, query, moments } = self;
        if !tiles.fill::<S, COHERENT>(simd, query.splats, query.grid) {
            return ViewLoss { loss: f64::NAN, iou: None };
        }
        match query.levels {
            Some(levels) => tiles.compare_levels::<S, COHERENT>(simd, query, levels, moments),
            None => tiles.compare_masks::<S, COHERENT>(simd, query, moments),
        }
    }
}

impl Tiles {
    /// Compares masks.
    #[inline(always)]
    fn compare_masks<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        query: &EmQuery<'_>,
        moments: &mut Moments,
    ) -> ViewLoss {
        let floor = EPSILON.log2();
        let mut guess = self.guess(simd, query);
        let mut tries = 0..MAX_GUESSES;
        loop {
            let range = F32Range::new(guess, query.softness);
            self.sum::<S, COHERENT>(simd, query.grid, &range);
            let threshold = self.threshold::<S, COHERENT>(simd, query, &range);
            let low = guess > floor && threshold.log2 < guess - MAX_GUESS_TOO_HIGH_LN * LOG2_E;
            let high = threshold.log2 > guess + MAX_GUESS_TOO_LOW_LN * LOG2_E;
            if (low || high) && tries.next().is_some() {
                guess = if threshold.among_lit { threshold.log2 } else { guess - 30.0 }.max(floor);
                continue;
            }
            self.last = Some(threshold.log2);
            let mask = self.mask::<S, COHERENT>(simd, query, &range, &threshold);
            if let Some(factor) = query.gradient_factor
                && mask.union > 0.0
            {
                self.weight_sums::<S, COHERENT>(simd, query, &mask, factor / query.softness);
                self.collect::<S, COHERENT>(simd, query.grid, moments);
            }
            return mask.answer();
        }
    }
}

/// H_sim over a box.
struct EvaluateMap<'a, const COHERENT: bool> {
    tiles: &'a mut Tiles,
    splats: &'a Splats,
    grid: &'a TileGrid,
}

impl<const COHERENT: bool> WithSimd for EvaluateMap<'_, COHERENT> {
    type Output = Option<Vec<f64>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Vec<f64>> {
        let Self { tiles, splats, grid } = self;
        if !tiles.fill::<S, COHERENT>(simd, splats, grid) {
            return None;
        }
        let loudest = tiles.joints.iter().map(|joint| joint.top + f64::from(joint.spectrum())).fold(f64::MIN, f64::max);
        let range = F32Range::below(loudest);
        tiles.sum::<S, COHERENT>(simd, grid, &range);
        // A map that none of the joints reaches in its own cells has its largest values elsewhere in f32's range.
        let within = f64::from(tiles.highest) >= loudest - MAX_MAP_BELOW_JOINTS_LOG2;
        within.then(|| tiles.values::<COHERENT>(grid, range.log2))
    }
}

struct Threshold {
    /// Square of the order statistic at or below it, relative to the scale: H > threshold means H² > this.
    lower: f32,
    /// Relative to the scale.
    value: f64,
    log2: f64,
    among_lit: bool,
}

#[derive(Default)]
struct Mask {
    common: f64,
    union: f64,
    both: usize,
    either: usize,
}

impl Mask {
    fn answer(&self) -> ViewLoss {
        let loss = if self.union == 0.0 { 1.0 } else { 1.0 - self.common / self.union };
        ViewLoss { loss, iou: share(self.both, self.either) }
    }
}

impl Tiles {
    /// Takes the splats in; false where one is not finite.
    #[inline(always)]
    fn fill<S: Simd, const COHERENT: bool>(&mut self, simd: S, splats: &Splats, grid: &TileGrid) -> bool {
        self.joints.resize_with(splats.joints(), Joint::default);
        for (joint, splat) in self.joints.iter_mut().zip(splats.iter()) {
            joint.fill::<S, COHERENT>(simd, &splat, grid);
        }
        self.joints.iter().all(Joint::is_finite)
    }
}
