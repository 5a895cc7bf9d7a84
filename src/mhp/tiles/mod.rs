//! The fast path of L_EM: f32, in tiles of 4 × 8 cells, each summed over the joints that matter there.
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
//! The answer depends on the parameters alone: what is kept from the last evaluation only speeds the percentile up.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

mod collect;
mod joint;
mod mask;
mod strip;
mod sum;

use super::adjoint::{self, Moments};
use super::floors::{EPSILON, SOFT_FLOOR, ViewLoss, share};
use super::lanes::{Lanes, splat};
use super::percentile::{between, place};
use super::splat::Splats;
use crate::config::Summation;
use collect::Gathered;
use joint::Joint;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::LOG2_E;
use std::ops::{Deref, DerefMut};
use strip::Strip;

/// Bins of a tile along the last axis and along the one before.
const TILE_ALONG_BINS: usize = 4;
const TILE_ACROSS_BINS: usize = 8;
const TILE_CELLS: usize = TILE_ALONG_BINS * TILE_ACROSS_BINS;
/// Tiles of a block.
const BLOCK_TILES: usize = 16;
/// From a tile's middle to its outermost cells.
const HALF_TILE_ALONG_BINS: f32 = 0.5 * (TILE_ALONG_BINS - 1) as f32;
const HALF_TILE_ACROSS_BINS: f32 = 0.5 * (TILE_ACROSS_BINS - 1) as f32;
/// Cells of a tile relative to its middle.
const CELL_ALONG_BINS: PerCell = from_middle(1, TILE_ALONG_BINS);
const CELL_ACROSS_BINS: PerCell = from_middle(TILE_ALONG_BINS, TILE_ACROSS_BINS);
/// From the first tile of a block to each of its sixteen, bins.
const TILE_STEPS_BINS: PerTile = {
    let mut steps = [0.0; BLOCK_TILES];
    let mut tile = 0;
    while tile < BLOCK_TILES {
        steps[tile] = (tile * TILE_ALONG_BINS) as f32;
        tile += 1;
    }
    Aligned(steps)
};

/// Numbers that lie as registers want them.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Aligned<const N: usize>([f32; N]);

/// A number a cell of a tile.
type PerCell = Aligned<TILE_CELLS>;
/// Re and Im.
type ComplexPerCell = [PerCell; 2];
/// A number a tile of a block, or a row of tiles of sixteen.
type PerTile = Aligned<BLOCK_TILES>;

impl<const N: usize> Aligned<N> {
    const ZERO: Self = Self::all(0.0);

    const fn all(x: f32) -> Self {
        Self([x; N])
    }
}

impl<const N: usize> Default for Aligned<N> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const N: usize> Deref for Aligned<N> {
    type Target = [f32; N];
    #[inline(always)]
    fn deref(&self) -> &[f32; N] {
        &self.0
    }
}

impl<const N: usize> DerefMut for Aligned<N> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f32; N] {
        &mut self.0
    }
}

/// Each cell's bin, of those that are `stride` cells apart, from the middle of `bins`.
const fn from_middle(stride: usize, bins: usize) -> PerCell {
    let mut from = [0.0; TILE_CELLS];
    let mut cell = 0;
    while cell < TILE_CELLS {
        from[cell] = (cell / stride % bins) as f32 - 0.5 * (bins - 1) as f32;
        cell += 1;
    }
    Aligned(from)
}

/// Softest mask, T, whose reach the powers of two of f32 hold; softer ones take the plain kernel.
const MAX_SOFTNESS: f64 = 1.5;
/// Below e^−15T of the threshold, `MAX_GUESS_TOO_HIGH_LN` included, a cell neither counts nor pulls (3e-7).
const MASK_REACH_PER_SOFTNESS_LN: f64 = 14.0;
/// A joint this much weaker than the threshold is dropped, ln, and at least `JOINT_MARGIN_LN` under the weakest cell that
/// counts.
const MIN_JOINT_REACH_LN: f64 = 13.0;
const JOINT_MARGIN_LN: f64 = 3.0;
/// The guess of the threshold may be this much too high, ln.
const MAX_GUESS_TOO_HIGH_LN: f64 = 1.0;
/// And this much too low, ln: beyond it the strongest returns would leave f32's range.
const MAX_GUESS_TOO_LOW_LN: f64 = 12.0;
/// Guesses of the threshold at most.
const MAX_GUESSES: usize = 40;
/// A joint this much weaker, ln, than the strongest at its cells is dropped: from the objective (3e-4), whose mask is
/// soft, and from a map (5e-5).
const MAX_BELOW_STRONGEST_LN: f64 = 8.0;
const MAX_BELOW_STRONGEST_IN_MAPS_LN: f64 = 10.0;
/// The weakest return that counts, relative to the view's scale.
const MIN_COUNTED_LN: f64 = -36.0;
/// log₂ below which no return is taken: squares of its parts are normal f32, for others cost a hundred cycles.
const MIN_RETURN_LOG2: f32 = -54.0;
/// log₂ of the strongest return relative to the view's scale; what is stronger is far above any threshold.
const MAX_RETURN_LOG2: f32 = 54.0;
/// log₂ of how far the strongest joint of a map stays under what is strongest in f32, for the sum of all.
const MAP_HEADROOM_LOG2: f64 = 8.0;
/// log₂ of how far a map may stay under its strongest joint.
const MAX_MAP_BELOW_JOINTS_LOG2: f64 = 30.0;
/// m(1 − m)/T below which a tile has no slope.
const MIN_MASK_SLOPE: f32 = 3e-7;

/// A box of cells in tiles, and B_ori over it: fixed for a fit. Sixteen tiles beside each other are a block; the last
/// block of a row may reach beyond the box, as may the last row and column of tiles.
#[derive(Debug, Clone)]
pub(super) struct TileGrid {
    /// First bin of the last three axes (outermost first; missing axes have one bin, 0).
    lo: [usize; 3],
    size: [usize; 3],
    /// Tiles across and along.
    rows: usize,
    columns: usize,
    blocks: Vec<Block>,
    /// Sixteen tiles a block: B_ori as 0 or 1, −1 beyond the box.
    target: Vec<PerCell>,
    cells: usize,
    marked: usize,
}

/// Sixteen tiles beside each other: its slice, its row, and its first column of tiles.
#[derive(Debug, Clone, Copy)]
struct Block {
    slice: usize,
    row: usize,
    column: usize,
}

/// Blocks of a box of these sizes, the last axis last.
pub(super) fn blocks_of(sizes: impl DoubleEndedIterator<Item = usize>) -> usize {
    let in_block = [BLOCK_TILES * TILE_ALONG_BINS, TILE_ACROSS_BINS, 1];
    sizes.rev().zip(in_block).fold(1, |blocks, (size, bins)| blocks * size.div_ceil(bins))
}

impl TileGrid {
    /// Cuts the box `bins` ([lo, hi) per axis), with B_ori in C order.
    pub(super) fn new(bins: &[[usize; 2]], ori: &[bool]) -> Self {
        let (mut lo, mut size) = ([0; 3], [1; 3]);
        for (k, &[from, to]) in bins.iter().rev().take(3).enumerate() {
            (lo[2 - k], size[2 - k]) = (from, to.saturating_sub(from));
        }
        let (rows, columns) = (size[1].div_ceil(TILE_ACROSS_BINS), size[2].div_ceil(TILE_ALONG_BINS));
        let marked = ori.iter().filter(|&&b| b).count();
        let of_line = |line| {
            let (slice, row) = (line / rows, line % rows);
            (0..columns).step_by(BLOCK_TILES).map(move |column| Block { slice, row, column })
        };
        let blocks = (0..size[0] * rows).flat_map(of_line).collect();
        let mut grid = Self { lo, size, rows, columns, blocks, target: Vec::new(), cells: ori.len(), marked };
        let mut target = vec![PerCell::all(-1.0); size[0] * rows * columns.div_ceil(BLOCK_TILES) * BLOCK_TILES];
        let mut ori = ori.iter();
        grid.for_places(|tile, cell| target[tile][cell] = ori.next().map_or(-1.0, |&ori| f32::from(u8::from(ori))));
        grid.target = target;
        grid
    }

    /// Calls `each` with the tile of every cell of the box and which of its cells it is, in C order.
    fn for_places(&self, mut each: impl FnMut(usize, usize)) {
        let ([slices, height, width], row_tiles) = (self.size, self.columns.div_ceil(BLOCK_TILES) * BLOCK_TILES);
        for slice in 0..slices {
            for y in 0..height {
                let first = (slice * self.rows + y / TILE_ACROSS_BINS) * row_tiles;
                for x in 0..width {
                    each(first + x / TILE_ALONG_BINS, y % TILE_ACROSS_BINS * TILE_ALONG_BINS + x % TILE_ALONG_BINS);
                }
            }
        }
    }

    /// Bins of the first tile's middle, across and along.
    fn middle(&self) -> [f64; 2] {
        [self.lo[1] as f64 + f64::from(HALF_TILE_ACROSS_BINS), self.lo[2] as f64 + f64::from(HALF_TILE_ALONG_BINS)]
    }
}

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
pub(super) struct EmQuery<'a> {
    pub splats: &'a Splats,
    pub grid: &'a TileGrid,
    pub summation: Summation,
    pub tau_pct: f64,
    pub softness: f64,
    /// Factor of the gradient; `None` where none is wanted.
    pub gradient_factor: Option<f64>,
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
        let floor = EPSILON.log2();
        let mut guess = tiles.guess(simd, query);
        let mut tries = 0..MAX_GUESSES;
        loop {
            let range = F32Range::new(guess, query.softness);
            tiles.sum::<S, COHERENT>(simd, query.grid, &range);
            let threshold = tiles.threshold::<S, COHERENT>(simd, query, &range);
            let low = guess > floor && threshold.log2 < guess - MAX_GUESS_TOO_HIGH_LN * LOG2_E;
            let high = threshold.log2 > guess + MAX_GUESS_TOO_LOW_LN * LOG2_E;
            if (low || high) && tries.next().is_some() {
                guess = if threshold.among_lit { threshold.log2 } else { guess - 30.0 }.max(floor);
                continue;
            }
            tiles.last = Some(threshold.log2);
            let mask = tiles.mask::<S, COHERENT>(simd, query, &range, &threshold);
            if let Some(factor) = query.gradient_factor
                && mask.union > 0.0
            {
                tiles.weight_sums::<S, COHERENT>(simd, query, &mask, factor / query.softness);
                tiles.collect::<S, COHERENT>(simd, query.grid, moments);
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

/// Where f32's range lies in this view.
struct F32Range {
    /// log₂ of what 1 stands for.
    log2: f64,
    /// log₂ relative to it below which nothing counts.
    cut: f32,
    /// ε and h of SPEC section 3 and 4 relative to it.
    epsilon_sq: f32,
    soft_floor: f32,
    /// log₂ of the lowest threshold that the guess allows, and by how many powers a cell below it pulls less than a joint
    /// that is as strong as the threshold: 1/T − 1.
    low: f32,
    fading: f32,
    /// log₂ of how much weaker than the strongest a joint counts.
    relative: f32,
}

impl F32Range {
    /// For a whole map whose strongest joint has `log2` at its middle: all that f32's range holds below it.
    fn below(log2: f64) -> Self {
        let relative = (MAX_BELOW_STRONGEST_IN_MAPS_LN * LOG2_E) as f32;
        Self {
            log2: log2 - f64::from(MAX_RETURN_LOG2) + MAP_HEADROOM_LOG2,
            fading: 0.0,
            relative,
            ..Self::new(0.0, 1.0)
        }
    }

    fn new(guess: f64, softness: f64) -> Self {
        let below = ((MASK_REACH_PER_SOFTNESS_LN * softness + JOINT_MARGIN_LN).max(MIN_JOINT_REACH_LN)
            + MAX_GUESS_TOO_HIGH_LN)
            * LOG2_E;
        let log2 = guess - below - MIN_COUNTED_LN * LOG2_E;
        let epsilon = (EPSILON.log2() - log2).exp2();
        let soft_floor = (SOFT_FLOOR.log2() - log2).exp2() as f32;
        Self {
            log2,
            cut: (MIN_COUNTED_LN * LOG2_E) as f32,
            epsilon_sq: (epsilon * epsilon) as f32,
            soft_floor,
            low: (guess - MAX_GUESS_TOO_HIGH_LN * LOG2_E) as f32,
            fading: (1.0 / softness - 1.0).max(0.0) as f32,
            relative: (MAX_BELOW_STRONGEST_LN * LOG2_E) as f32,
        }
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

/// Parts of a tile's cells, and of a block's tiles.
const fn cell_parts<S: Simd>() -> usize {
    TILE_CELLS / S::F32_LANES
}

const fn tile_parts<S: Simd>() -> usize {
    BLOCK_TILES / S::F32_LANES
}

#[inline(always)]
fn lanes<S: Simd, const N: usize>(simd: S, of: &Aligned<N>, part: usize) -> Lanes<S> {
    Lanes::new(simd, S::as_simd_f32s(&of.0).0[part])
}

#[inline(always)]
fn store<S: Simd, const N: usize>(into: &mut Aligned<N>, part: usize, x: Lanes<S>) {
    S::as_mut_simd_f32s(&mut into.0).0[part] = x.value;
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
