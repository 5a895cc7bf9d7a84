//! What the cells want of each joint.

use super::adjoint::Sums;
use super::joint::Joint;
use super::strip::{Strip, bits};
use super::{
    Aligned, BLOCK_TILES, Block, CELL_ACROSS_BINS, CELL_ALONG_BINS, ComplexPerCell, Lanes, Moments, PerCell, Simd,
    TILE_ACROSS_BINS, TILE_ALONG_BINS, TileGrid, Tiles, cell_parts, lanes, splat, store,
};
use std::ops::Range;

/// Σr, ΣrΔx, ΣrΔy, ΣrΔx², ΣrΔxΔy, ΣrΔy², Σq, ΣqΔx, ΣqΔy of a joint, a number a cell of a register; Δ to where the tile's
/// middle is from its first register.
pub(super) type Gathered = [Aligned<MAX_F32_LANES>; 9];
/// Numbers of the widest register.
const MAX_F32_LANES: usize = 16;

impl Tiles {
    /// Adds to each joint's moments what the cells want.
    #[inline(always)]
    pub(super) fn collect<S: Simd, const COHERENT: bool>(&mut self, simd: S, grid: &TileGrid, moments: &mut Moments) {
        let mut gathered = std::mem::take(&mut self.gathered);
        gathered.resize(self.joints.len(), [Aligned::ZERO; 9]);
        let row_blocks = grid.rows * grid.columns.div_ceil(BLOCK_TILES);
        let mut from = 0;
        for (slice, blocks) in grid.blocks.chunks(row_blocks.max(1)).enumerate() {
            for (block, index) in blocks.iter().zip(slice * row_blocks..) {
                let to = self.ends[index] as usize;
                for strip in &self.strips[from..to] {
                    let number = strip.joint as usize;
                    let at = (index, block);
                    self.gather::<S, COHERENT>(simd, grid, at, strip, &mut gathered[number], moments);
                }
                from = to;
            }
            let slice = grid.lo[0] + slice;
            for (number, (joint, gathered)) in self.joints.iter().zip(&mut gathered).enumerate() {
                let sums = slice_sums(simd, gathered, slice as f64 - joint.bin[0]);
                moments.add(number, &sums);
                if let Some(sum) = moments.by_bin(number, 0).get_mut(slice) {
                    *sum += sums.r;
                }
                CellSums::nothing(simd).keep(gathered);
            }
        }
        self.gathered = gathered;
    }

    #[inline(always)]
    fn gather<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        grid: &TileGrid,
        (index, block): (usize, &Block),
        strip: &Strip,
        gathered: &mut Gathered,
        moments: &mut Moments,
    ) {
        let tiles = strip.bits() & self.sloped[index];
        if tiles == 0 {
            return;
        }
        let joint = &self.joints[strip.joint as usize];
        let tile_row = joint.tile_row(grid, block);
        let sums = &self.sums[index * BLOCK_TILES..(index + 1) * BLOCK_TILES];
        let first_x = joint.first[0] + (block.column * TILE_ALONG_BINS) as f32 + joint.first[1];
        let mut cell = CellSums::of(simd, gathered);
        if strip.chained {
            let last = u32::BITS - tiles.leading_zeros();
            let tiles = strip.tiles().start..last as usize;
            let before = first_x + (tiles.start as f32 - 1.0) * TILE_ALONG_BINS as f32;
            for part in (0..cell_parts::<S>()).step_by(2) {
                let chain_sums = strip.chain_sums::<S, COHERENT>(simd, joint, tiles.clone(), sums, part);
                for k in 0..2 {
                    let start = strip.returned::<S, COHERENT>(simd, part + k);
                    let [x, y] = beside_first::<S>(part + k);
                    let along = chain_sums[k].along(simd, start, splat(simd, before + x));
                    cell.add(simd, &along, tile_row.delta + y);
                }
            }
        } else {
            for part in 0..cell_parts::<S>() {
                let mut of = StripSums::nothing(simd);
                let one = splat(simd, 1.0);
                let [beside_x, beside_y] = beside_first::<S>(part);
                for tile in bits(tiles) {
                    let returned =
                        joint.tile::<S, COHERENT>(simd, (block, &tile_row), tile, part, strip.middles[0][tile]);
                    let wanted = wanted::<S, COHERENT>(simd, returned, &sums[tile], part);
                    let x = splat(simd, first_x + (tile * TILE_ALONG_BINS) as f32 + beside_x);
                    of.add(wanted, [one, x, x * x]);
                    if joint.by_bin() {
                        let mut cells = PerCell::ZERO;
                        store(&mut cells, part, wanted[0]);
                        by_bin(grid, block, tile, &cells, strip.joint as usize, moments);
                    }
                }
                cell.add(simd, &of, tile_row.delta + beside_y);
            }
        }
        cell.keep(gathered);
    }
}

/// From the cells of a tile's first register to those of another, bins along and across.
#[inline(always)]
fn beside_first<S: Simd>(part: usize) -> [f32; 2] {
    let first = part * S::F32_LANES;
    [CELL_ALONG_BINS[first] - CELL_ALONG_BINS[0], CELL_ACROSS_BINS[first] - CELL_ACROSS_BINS[0]]
}

/// What some cells of a tile want of a joint that returns Re and Im there (or the square): r and q.
#[inline(always)]
fn wanted<S: Simd, const COHERENT: bool>(
    simd: S,
    [a, b]: [Lanes<S>; 2],
    sum: &ComplexPerCell,
    part: usize,
) -> [Lanes<S>; 2] {
    let re = lanes(simd, &sum[0], part);
    if !COHERENT {
        return [a * re, splat(simd, 0.0)];
    }
    let im = lanes(simd, &sum[1], part);
    [a.mul_add(re, b * im), b.neg_mul_add(re, a * im)]
}

/// Σr, ΣrΔx, ΣrΔx², Σq, ΣqΔx along a strip, Δx to the tiles' middles: that of the cells is the same in all of them.
struct StripSums<S: Simd> {
    r: [Lanes<S>; 3],
    q: [Lanes<S>; 2],
}

impl<S: Simd> StripSums<S> {
    #[inline(always)]
    fn nothing(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        Self { r: [zero; 3], q: [zero; 2] }
    }

    /// `weights` are those of r, rΔx and rΔx².
    #[inline(always)]
    fn add(&mut self, [r, q]: [Lanes<S>; 2], weights: [Lanes<S>; 3]) {
        self.r[0] = r.mul_add(weights[0], self.r[0]);
        self.r[1] = r.mul_add(weights[1], self.r[1]);
        self.r[2] = r.mul_add(weights[2], self.r[2]);
        self.q[0] = q.mul_add(weights[0], self.q[0]);
        self.q[1] = q.mul_add(weights[1], self.q[1]);
    }
}

/// What is gathered in the cells of a register.
struct CellSums<S: Simd>([Lanes<S>; 9]);

impl<S: Simd> CellSums<S> {
    #[inline(always)]
    fn nothing(simd: S) -> Self {
        Self([splat(simd, 0.0); 9])
    }

    #[inline(always)]
    fn of(simd: S, gathered: &Gathered) -> Self {
        let mut cell = Self::nothing(simd);
        for k in 0..9 {
            cell.0[k] = lanes(simd, &gathered[k], 0);
        }
        cell
    }

    #[inline(always)]
    fn keep(&self, gathered: &mut Gathered) {
        for k in 0..9 {
            store(&mut gathered[k], 0, self.0[k]);
        }
    }

    /// Adds a strip's; `delta` is from the joint to the row's middle, y.
    #[inline(always)]
    fn add(&mut self, simd: S, of: &StripSums<S>, delta: f32) {
        let ([r, rx, rxx], [q, qx], [y, yy]) = (of.r, of.q, [splat(simd, delta), splat(simd, delta * delta)]);
        let sums = &mut self.0;
        sums[0] += r;
        sums[1] += rx;
        sums[2] = r.mul_add(y, sums[2]);
        sums[3] += rxx;
        sums[4] = rx.mul_add(y, sums[4]);
        sums[5] = r.mul_add(yy, sums[5]);
        sums[6] += q;
        sums[7] += qx;
        sums[8] = q.mul_add(y, sums[8]);
    }

    /// From the tiles' middles to the cells.
    #[inline(always)]
    fn shifted(self, simd: S) -> Self {
        let [r, rx, ry, rxx, rxy, ryy, q, qx, qy] = self.0;
        let (x, y) = (lanes(simd, &CELL_ALONG_BINS, 0), lanes(simd, &CELL_ACROSS_BINS, 0));
        let (cell_rx, cell_ry) = (x.mul_add(r, rx), y.mul_add(r, ry));
        let cell_rxx = x.mul_add(rx + cell_rx, rxx);
        let cell_rxy = x.mul_add(ry, y.mul_add(cell_rx, rxy));
        let cell_ryy = y.mul_add(ry + cell_ry, ryy);
        Self([r, cell_rx, cell_ry, cell_rxx, cell_rxy, cell_ryy, q, x.mul_add(q, qx), y.mul_add(q, qy)])
    }
}

/// Σ g^k Z, Σ (k + 1) g^k Z and Σ ½(k + 1)(k + 2) g^k Z over a strip's tiles k, Re and Im: Z is what the cells want of the
/// middle, gᵏ what the first tile's cells have become.
#[derive(Clone, Copy)]
struct ChainSums<S: Simd>([[Lanes<S>; 2]; 3]);

impl<S: Simd> ChainSums<S> {
    /// Goes one tile back, to one that wants `z`.
    #[inline(always)]
    fn step_back(&mut self, gain: Lanes<S>, z: [Lanes<S>; 2]) {
        for i in 0..2 {
            self.0[0][i] = self.0[0][i].mul_add(gain, z[i]);
            self.0[1][i] = self.0[1][i].mul_add(gain, self.0[0][i]);
            self.0[2][i] = self.0[2][i].mul_add(gain, self.0[1][i]);
        }
    }

    /// The same by Δx; `before` is Δx one tile before the first, `start` the first tile's cells.
    #[inline(always)]
    fn along(self, simd: S, start: [Lanes<S>; 2], before: Lanes<S>) -> StripSums<S> {
        let [none, once, twice] = self.0;
        let ([r, q], [r_k, q_k], [r_kk, _]) = (conjugate(start, none), conjugate(start, once), conjugate(start, twice));
        let tile = splat(simd, TILE_ALONG_BINS as f32);
        // Δx = before + 4 (k + 1), (k + 1)² = 2 · ½(k + 1)(k + 2) − (k + 1)
        let square = (r_kk + r_kk - r_k) * tile * tile;
        let rx = r.mul_add(before, r_k * tile);
        let rxx = before.mul_add(rx + r_k * tile, square);
        StripSums { r: [r, rx, rxx], q: [q, q.mul_add(before, q_k * tile)] }
    }
}

/// a* b
#[inline(always)]
fn conjugate<S: Simd>([a, b]: [Lanes<S>; 2], [c, d]: [Lanes<S>; 2]) -> [Lanes<S>; 2] {
    [a.mul_add(c, b * d), b.neg_mul_add(c, a * d)]
}

impl Strip {
    /// From the last of `tiles` to the first, two parts at a time: a product waits for the one before it.
    #[inline(always)]
    fn chain_sums<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        joint: &Joint,
        tiles: Range<usize>,
        sums: &[ComplexPerCell],
        part: usize,
    ) -> [ChainSums<S>; 2] {
        let mut chain_sums = [ChainSums([[splat(simd, 0.0); 2]; 3]); 2];
        let mut gain = [lanes(simd, &joint.gain, part), lanes(simd, &joint.gain, part + 1)];
        if !COHERENT {
            gain = [gain[0] * gain[0], gain[1] * gain[1]];
        }
        let [real, imaginary] = &self.middles;
        let (real, imaginary) = (&real[tiles.clone()], &imaginary[tiles.clone()]);
        for ((sum, &c), &d) in sums[tiles].iter().zip(real).zip(imaginary).rev() {
            let middle = [splat(simd, if COHERENT { c } else { c * c }), splat(simd, d)];
            for k in 0..2 {
                let z = wanted::<S, COHERENT>(simd, middle, sum, part + k);
                chain_sums[k].step_back(gain[k], z);
            }
        }
        chain_sums
    }

    /// What returns from the first tile's cells, beside its middle: Re and Im, or the square.
    #[inline(always)]
    fn returned<S: Simd, const COHERENT: bool>(&self, simd: S, part: usize) -> [Lanes<S>; 2] {
        let [a, b] = self.start(simd, part);
        if COHERENT { [a, b] } else { [a * a, b] }
    }
}

/// Adds what the cells of a tile want, r, to the bins of a joint along Doppler axes.
#[inline(never)]
fn by_bin(grid: &TileGrid, block: &Block, tile: usize, cells: &PerCell, joint: usize, moments: &mut Moments) {
    let axes: [(usize, usize); 2] =
        [(1, grid.lo[1] + block.row * TILE_ACROSS_BINS), (2, grid.lo[2] + (block.column + tile) * TILE_ALONG_BINS)];
    for (axis, first) in axes {
        let bins = moments.by_bin(joint, axis);
        if bins.is_empty() {
            continue;
        }
        for (cell, &r) in cells.iter().enumerate() {
            let lane = if axis == 2 { cell % TILE_ALONG_BINS } else { cell / TILE_ALONG_BINS };
            if let Some(sum) = bins.get_mut(first + lane) {
                *sum += f64::from(r);
            }
        }
    }
}

/// The sums of one slice, `delta` from the joint along the outermost of three axes.
#[inline(always)]
fn slice_sums<S: Simd>(simd: S, gathered: &Gathered, delta: f64) -> Sums {
    let cells = CellSums::of(simd, gathered).shifted(simd).0;
    let mut sums = [0.0; 9];
    for k in 0..9 {
        sums[k] = f64::from(cells[k].reduce_sum());
    }
    let [r, rx, ry, rxx, rxy, ryy, q, qx, qy] = sums;
    Sums {
        r,
        q,
        r_delta: [delta * r, ry, rx],
        q_delta: [delta * q, qy, qx],
        r_delta_delta: [delta * delta * r, delta * ry, ryy, delta * rx, rxy, rxx],
    }
}
