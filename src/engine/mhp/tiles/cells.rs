//! A tile and a block in numbers, and how they lie in registers.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use crate::mhp::lanes::Lanes;
use pulp::Simd;
use std::ops::{Deref, DerefMut};

/// Bins of a tile along the last axis and along the one before.
pub(super) const TILE_ALONG_BINS: usize = 4;
pub(super) const TILE_ACROSS_BINS: usize = 8;
pub(super) const TILE_CELLS: usize = TILE_ALONG_BINS * TILE_ACROSS_BINS;
/// Tiles of a block.
pub(super) const BLOCK_TILES: usize = 16;
/// From a tile's middle to its outermost cells.
pub(super) const HALF_TILE_ALONG_BINS: f32 = 0.5 * (TILE_ALONG_BINS - 1) as f32;
pub(super) const HALF_TILE_ACROSS_BINS: f32 = 0.5 * (TILE_ACROSS_BINS - 1) as f32;
/// Cells of a tile relative to its middle.
pub(super) const CELL_ALONG_BINS: PerCell = from_middle(1, TILE_ALONG_BINS);
pub(super) const CELL_ACROSS_BINS: PerCell = from_middle(TILE_ALONG_BINS, TILE_ACROSS_BINS);
/// From the first tile of a block to each of its sixteen, bins.
pub(super) const TILE_STEPS_BINS: PerTile = {
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
pub(super) struct Aligned<const N: usize>(pub(super) [f32; N]);

/// A number a cell of a tile.
pub(super) type PerCell = Aligned<TILE_CELLS>;
/// Re and Im.
pub(super) type ComplexPerCell = [PerCell; 2];
/// A number a tile of a block, or a row of tiles of sixteen.
pub(super) type PerTile = Aligned<BLOCK_TILES>;

impl<const N: usize> Aligned<N> {
    pub(super) const ZERO: Self = Self::all(0.0);

    pub(super) const fn all(x: f32) -> Self {
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

/// Parts of a tile's cells, and of a block's tiles.
pub(super) const fn cell_parts<S: Simd>() -> usize {
    TILE_CELLS / S::F32_LANES
}

pub(super) const fn tile_parts<S: Simd>() -> usize {
    BLOCK_TILES / S::F32_LANES
}

#[inline(always)]
pub(super) fn lanes<S: Simd, const N: usize>(simd: S, of: &Aligned<N>, part: usize) -> Lanes<S> {
    Lanes::new(simd, S::as_simd_f32s(&of.0).0[part])
}

#[inline(always)]
pub(super) fn store<S: Simd, const N: usize>(into: &mut Aligned<N>, part: usize, x: Lanes<S>) {
    S::as_mut_simd_f32s(&mut into.0).0[part] = x.value;
}
