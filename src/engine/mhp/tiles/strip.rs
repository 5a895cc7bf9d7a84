//! A joint in tiles beside each other.

use super::joint::{Joint, TileRow};
use super::{
    Block, CELL_ACROSS_BINS, CELL_ALONG_BINS, ComplexPerCell, Lanes, MAX_RETURN_LOG2, MIN_RETURN_LOG2, PerTile, Simd,
    TILE_ALONG_BINS, cell_parts, lanes, splat, store, tile_parts,
};
use std::ops::Range;

/// log₂ of how far a joint may rise or fall from a tile's middle to its corner where tiles follow from each other.
pub(super) const MAX_CHAINED_RISE_LOG2: f32 = 30.0;
/// log₂ below which a tile's middle is not taken.
const MIN_MIDDLE_LOG2: f32 = -110.0;

/// A joint in those of a block's tiles that it matters to, which lie side by side.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Strip {
    pub joint: u32,
    /// First of the tiles among the block's, and how many.
    first: u32,
    count: u32,
    /// Whether each tile follows from the one before.
    pub chained: bool,
    /// A K e^{i…} in the middles of the block's tiles where they do, else log₂ of A K in the first of the two; relative
    /// to the view's scale.
    pub middles: [PerTile; 2],
    /// The first tile's cells beside its middle, Re and Im.
    pub start: ComplexPerCell,
}

/// A joint in the middles of a block's tiles.
#[derive(Debug, Default)]
pub(super) struct Middles {
    /// log₂ of A K, relative to the view's scale.
    pub exponent: PerTile,
    /// Its slopes across and along, a bin.
    pub across: PerTile,
    pub along: PerTile,
    /// How far these rise to the tile's outermost cell.
    pub rise: PerTile,
}

/// The places of a number's bits, from the lowest on.
pub(super) fn bits(mut of: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = (of != 0).then(|| of.trailing_zeros() as usize)?;
        of &= of - 1;
        Some(place)
    })
}

impl Joint {
    /// Writes down the joint in `tiles` (a bit each) of a block and those between them.
    #[inline(always)]
    pub(super) fn write_strip<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        (block, tile_row): (&Block, &TileRow),
        tiles: u32,
        middles: &Middles,
        strip: &mut Strip,
    ) {
        let first = tiles.trailing_zeros();
        // A tile between others costs less than what tells it from them.
        let count = 32 - tiles.leading_zeros() - first;
        let last = first + count - 1;
        (strip.first, strip.count) = (first, count);
        // Slopes along a strip lie between those at its ends.
        let steepest = middles.rise[first as usize].max(middles.rise[last as usize]);
        strip.chained = self.bounded && steepest + self.curvature < MAX_CHAINED_RISE_LOG2;
        if !strip.chained {
            strip.middles[0] = middles.exponent;
            return;
        }
        for part in 0..tile_parts::<S>() {
            let within = lanes(simd, &middles.exponent, part)
                .max(splat(simd, MIN_MIDDLE_LOG2))
                .min(splat(simd, MAX_RETURN_LOG2));
            let middle = within.exp2();
            if COHERENT {
                let [cos, sin] = self.middle_turns(simd, (block, tile_row), part);
                store(&mut strip.middles[0], part, middle * cos);
                store(&mut strip.middles[1], part, middle * sin);
            } else {
                store(&mut strip.middles[0], part, middle);
            }
        }
        let (across, along) = (middles.across[first as usize], middles.along[first as usize]);
        for part in 0..cell_parts::<S>() {
            let by_x = lanes(simd, &CELL_ALONG_BINS, part) * splat(simd, along);
            let rise = lanes(simd, &CELL_ACROSS_BINS, part).mul_add(splat(simd, across), by_x).exp2();
            store(&mut strip.start[0], part, rise * lanes(simd, &self.shape[0], part));
            store(&mut strip.start[1], part, rise * lanes(simd, &self.shape[1], part));
        }
    }

    /// Slopes across and along in the middle of a block's tile, log₂ a bin.
    #[inline(always)]
    fn slopes(&self, block: &Block, tile_row: &TileRow, tile: usize) -> [f32; 2] {
        let along = self.bend * (tile_row.nearest + ((block.column + tile) * TILE_ALONG_BINS) as f32 + tile_row.rest);
        [along * self.shear + tile_row.slope, along]
    }

    /// One tile by itself: where the Gaussian is so narrow that single precision does not hold a tile of it at once, and
    /// along Doppler axes.
    #[inline(always)]
    pub(super) fn tile<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        (block, tile_row): (&Block, &TileRow),
        tile: usize,
        part: usize,
        middle: f32,
    ) -> [Lanes<S>; 2] {
        let [across, along] = self.slopes(block, tile_row, tile);
        let bent = lanes(simd, &self.quadratic, part) + splat(simd, middle);
        let mut exponent = lanes(simd, &CELL_ALONG_BINS, part).mul_add(splat(simd, along), bent);
        exponent = lanes(simd, &CELL_ACROSS_BINS, part).mul_add(splat(simd, across), exponent);
        if let Some(spectrum) = self.along.cells.get(block.column + tile) {
            exponent += lanes(simd, spectrum, part);
        }
        if let Some(spectrum) = self.across.cells.get(block.row) {
            exponent += lanes(simd, spectrum, part);
        }
        let a = exponent.max(splat(simd, MIN_RETURN_LOG2)).min(splat(simd, MAX_RETURN_LOG2)).exp2();
        if !COHERENT {
            return [a * a, splat(simd, 0.0)];
        }
        let turn = self.middle_turn(block, tile_row, tile);
        let within = [lanes(simd, &self.turn[0], part), lanes(simd, &self.turn[1], part)];
        let [re, im] = product(within, [splat(simd, turn[0]), splat(simd, turn[1])]);
        [a * re, a * im]
    }
}

impl Strip {
    /// A bit a tile of the block.
    pub(super) fn bits(&self) -> u32 {
        (u32::MAX >> (32 - self.count)) << self.first
    }

    pub(super) fn tiles(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }

    /// Adds what returns from the strip's cells to the sums of its block.
    #[inline(always)]
    pub(super) fn add_to<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        joint: &Joint,
        (block, tile_row): (&Block, &TileRow),
        sums: &mut [ComplexPerCell],
    ) {
        let tiles = self.tiles();
        let [real, imaginary] = &self.middles;
        let (real, imaginary, sums) = (&real[tiles.clone()], &imaginary[tiles.clone()], &mut sums[tiles]);
        if !self.chained {
            for ((tile, &middle), sum) in self.tiles().zip(real).zip(sums) {
                for part in 0..cell_parts::<S>() {
                    let [re, im] = joint.tile::<S, COHERENT>(simd, (block, tile_row), tile, part, middle);
                    for (sum, of) in sum.iter_mut().zip([re, im]) {
                        let sums = of + lanes(simd, sum, part);
                        store(sum, part, sums);
                    }
                }
            }
            return;
        }
        // Two at a time: a product waits for the one before it.
        for part in (0..cell_parts::<S>()).step_by(2) {
            let gain = [lanes(simd, &joint.gain, part), lanes(simd, &joint.gain, part + 1)];
            let mut now = [self.start(simd, part), self.start(simd, part + 1)];
            for ((sum, &c), &d) in sums.iter_mut().zip(real).zip(imaginary) {
                let (c, d) = (splat(simd, c), splat(simd, d));
                for k in 0..2 {
                    let [a, b] = now[k];
                    if COHERENT {
                        let re = b.neg_mul_add(d, a.mul_add(c, lanes(simd, &sum[0], part + k)));
                        let im = a.mul_add(d, b.mul_add(c, lanes(simd, &sum[1], part + k)));
                        store(&mut sum[0], part + k, re);
                        store(&mut sum[1], part + k, im);
                        now[k] = [a * gain[k], b * gain[k]];
                    } else {
                        let returned = a * c;
                        let squares = returned.mul_add(returned, lanes(simd, &sum[0], part + k));
                        store(&mut sum[0], part + k, squares);
                        now[k][0] = a * gain[k];
                    }
                }
            }
        }
    }

    /// The first tile's cells beside its middle, Re and Im.
    #[inline(always)]
    pub(super) fn start<S: Simd>(&self, simd: S, part: usize) -> [Lanes<S>; 2] {
        [lanes(simd, &self.start[0], part), lanes(simd, &self.start[1], part)]
    }
}

/// The product of two complex numbers.
#[inline(always)]
pub(super) fn product<S: Simd>([a, b]: [Lanes<S>; 2], [c, d]: [Lanes<S>; 2]) -> [Lanes<S>; 2] {
    [b.neg_mul_add(d, a * c), a.mul_add(d, b * c)]
}
