//! What the cells want of each joint.

use super::joint::Joint;
use super::strip::{Strip, bits};
use super::{
    ACROSS, ACROSS_BINS, ALONG, ALONG_BINS, BLOCK, Block, Cells, Lanes, Moments, Pair, STEPS, Simd, Sixteen, Tiles,
    Tiling, cell_parts, lanes, splat, store, tile_parts,
};
use std::ops::Range;

/// Σr, ΣrΔx, ΣrΔy, ΣrΔx², ΣrΔxΔy, ΣrΔy², Σq, ΣqΔx, ΣqΔy of a joint, a number a cell of a tile.
pub(super) type Gathered = [Cells; 9];

impl Tiles {
    /// Adds to each joint's moments what the cells want.
    #[inline(always)]
    pub(super) fn collect<S: Simd, const COHERENT: bool>(&mut self, simd: S, grid: &Tiling, moments: &mut [Moments]) {
        let mut gathered = std::mem::take(&mut self.gathered);
        gathered.clear();
        gathered.resize(self.joints.len(), [Cells::ZERO; 9]);
        let row_blocks = grid.rows * grid.columns.div_ceil(BLOCK);
        let mut from = 0;
        for (slice, blocks) in grid.blocks.chunks(row_blocks.max(1)).enumerate() {
            for (block, index) in blocks.iter().zip(slice * row_blocks..) {
                let to = self.ends[index] as usize;
                for strip in &self.strips[from..to] {
                    let number = strip.joint as usize;
                    let (gathered, moments) = (&mut gathered[number], &mut moments[number]);
                    let at = (index, block);
                    self.gather::<S, COHERENT>(simd, grid, at, strip, gathered, moments);
                }
                from = to;
            }
            for ((joint, gathered), moments) in self.joints.iter().zip(&mut gathered).zip(&mut *moments) {
                let mut sums = Sums::default();
                for (total, sums) in sums.0.iter_mut().zip(gathered.iter_mut()) {
                    for part in 0..cell_parts::<S>() {
                        *total += f64::from(lanes(simd, sums, part).sum());
                        store(sums, part, splat(simd, 0.0));
                    }
                }
                let slice = grid.lo[0] + slice;
                sums.add_to(moments, slice, slice as f64 - joint.bin[0]);
            }
        }
        self.gathered = gathered;
    }

    #[inline(always)]
    fn gather<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        grid: &Tiling,
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
        let line = joint.line(grid, block);
        let sums = &self.sums[index * BLOCK..(index + 1) * BLOCK];
        let first_x = splat(simd, joint.first[0] + (block.column * ALONG_BINS) as f32);
        let mut along = Sixteen::ZERO;
        for part in 0..tile_parts::<S>() {
            let x = lanes(simd, &STEPS, part) + first_x + splat(simd, joint.first[1]);
            store(&mut along, part, x);
        }
        if strip.chained {
            let weights = Weights::new::<S, COHERENT>(simd, strip, tiles, &along);
            for part in (0..cell_parts::<S>()).step_by(2) {
                let [even, odd] = weights.gather::<S, COHERENT>(simd, joint, strip, sums, part);
                even.add_to(simd, line.delta, part, gathered);
                odd.add_to(simd, line.delta, part + 1, gathered);
            }
        } else {
            for part in 0..cell_parts::<S>() {
                let mut of = Along::nothing(simd);
                let one = splat(simd, 1.0);
                for tile in bits(tiles) {
                    let returned = joint.tile::<S, COHERENT>(simd, (block, &line), tile, part, strip.middles[tile]);
                    let wanted = wanted::<S, COHERENT>(simd, returned, &sums[tile], part);
                    let x = splat(simd, along[tile]);
                    of.add(wanted, [one, x, x * x]);
                    by_bin(grid, block, tile, part, wanted[0], moments);
                }
                of.add_to(simd, line.delta, part, gathered);
            }
        }
    }
}

/// What some cells of a tile want of a joint that returns Re and Im there (or the square): r and q.
#[inline(always)]
fn wanted<S: Simd, const COHERENT: bool>(simd: S, [a, b]: [Lanes<S>; 2], sum: &Pair, part: usize) -> [Lanes<S>; 2] {
    let re = lanes(simd, &sum[0], part);
    if !COHERENT {
        return [a * re, splat(simd, 0.0)];
    }
    let im = lanes(simd, &sum[1], part);
    [a.mul_add(re, b * im), (a * im).minus(b, re)]
}

/// Σr, ΣrΔx, ΣrΔx², Σq, ΣqΔx along a strip, Δx to the tiles' middles: that of the cells is the same in all of them.
struct Along<S: Simd> {
    r: [Lanes<S>; 3],
    q: [Lanes<S>; 2],
}

impl<S: Simd> Along<S> {
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

    /// Adds to a joint's moments; `delta` is from the joint to the row's middle.
    #[inline(always)]
    fn add_to(self, simd: S, delta: f32, part: usize, gathered: &mut Gathered) {
        let ([r, rx, rxx], [q, qx]) = (self.r, self.q);
        let (x, y) = (lanes(simd, &ALONG, part), lanes(simd, &ACROSS, part) + splat(simd, delta));
        let cell_rx = x.mul_add(r, rx);
        let cell_rxx = x.mul_add(rx + cell_rx, rxx);
        let cell_qx = x.mul_add(q, qx);
        let ry = r * y;
        let news = [r, cell_rx, ry, cell_rxx, cell_rx * y, ry * y, q, cell_qx, q * y];
        for (sums, new) in gathered.iter_mut().zip(news) {
            let sum = new + lanes(simd, sums, part);
            store(sums, part, sum);
        }
    }
}

/// What r counts for in a strip's tiles: A K in the middle (or its square), and that times Δx and Δx².
struct Weights {
    of: [Sixteen; 3],
    tiles: Range<usize>,
}

impl Weights {
    #[inline(always)]
    fn new<S: Simd, const COHERENT: bool>(simd: S, strip: &Strip, tiles: u32, along: &Sixteen) -> Self {
        let mut weights =
            Self { of: [strip.middles; 3], tiles: strip.tiles().start..(u32::BITS - tiles.leading_zeros()) as usize };
        // Between tiles where the mask has a slope may be some where it has none.
        let mut without = !tiles & ((1 << weights.tiles.end) - 1);
        while without != 0 {
            weights.of[0][without.trailing_zeros() as usize] = 0.0;
            without &= without - 1;
        }
        for part in 0..tile_parts::<S>() {
            let mut middle = lanes(simd, &weights.of[0], part);
            if !COHERENT {
                middle = middle * middle;
            }
            let x = lanes(simd, along, part);
            store(&mut weights.of[0], part, middle);
            store(&mut weights.of[1], part, middle * x);
            store(&mut weights.of[2], part, middle * x * x);
        }
        weights
    }

    /// Two parts at a time: a product waits for the one before it.
    #[inline(always)]
    fn gather<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        joint: &Joint,
        strip: &Strip,
        sums: &[Pair],
        part: usize,
    ) -> [Along<S>; 2] {
        let mut along = [Along::nothing(simd), Along::nothing(simd)];
        let mut chains = [strip.chain(simd, joint, part), strip.chain(simd, joint, part + 1)];
        let tiles = self.tiles.clone();
        let [a, b, c] = [&self.of[0][tiles.clone()], &self.of[1][tiles.clone()], &self.of[2][tiles.clone()]];
        for (((sum, &a), &b), &c) in sums[tiles].iter().zip(a).zip(b).zip(c) {
            let weights = [splat(simd, a), splat(simd, b), splat(simd, c)];
            for k in 0..2 {
                let [re, im] = chains[k].now;
                let returned = if COHERENT { [re, im] } else { [re * re, im] };
                along[k].add(wanted::<S, COHERENT>(simd, returned, sum, part + k), weights);
                chains[k].go::<COHERENT>();
            }
        }
        along
    }
}

/// Adds `r` to the bins of the Doppler axes.
#[inline(always)]
fn by_bin<S: Simd>(grid: &Tiling, block: &Block, tile: usize, part: usize, r: Lanes<S>, moments: &mut Moments) {
    let mut cells = Cells::ZERO;
    store(&mut cells, part, r);
    let axes: [(usize, usize); 2] =
        [(1, grid.lo[1] + block.row * ACROSS_BINS), (2, grid.lo[2] + (block.column + tile) * ALONG_BINS)];
    let missing = 3 - moments.dims;
    for (axis, first) in axes {
        let Some(bins) = axis.checked_sub(missing).map(|k| &mut moments.r_by_bin[k]) else { continue };
        if bins.is_empty() {
            continue;
        }
        for (cell, &r) in cells.iter().enumerate() {
            let lane = if axis == 2 { cell % ALONG_BINS } else { cell / ALONG_BINS };
            if let Some(sum) = bins.get_mut(first + lane) {
                *sum += f64::from(r);
            }
        }
    }
}

/// Σr, ΣrΔx, ΣrΔy, ΣrΔx², ΣrΔxΔy, ΣrΔy², Σq, ΣqΔx, ΣqΔy of one slice.
#[derive(Default)]
struct Sums([f64; 9]);

impl Sums {
    /// Folds a slice at bin `slice` of the outermost of three axes, `delta` from the joint, into the moments.
    fn add_to(&self, moments: &mut Moments, slice: usize, delta: f64) {
        let [r, rx, ry, rxx, rxy, ryy, q, qx, qy] = self.0;
        let missing = 3 - moments.dims;
        let deltas = [delta * r, ry, rx];
        let turns = [delta * q, qy, qx];
        let squares = [[delta * delta * r, delta * ry, delta * rx], [delta * ry, ryy, rxy], [delta * rx, rxy, rxx]];
        moments.r += r;
        moments.q += q;
        for k in missing..3 {
            moments.r_delta[k - missing] += deltas[k];
            moments.q_delta[k - missing] += turns[k];
            for l in missing..3 {
                moments.r_delta_delta[k - missing][l - missing] += squares[k][l];
            }
        }
        if missing == 0
            && let Some(sum) = moments.r_by_bin[0].get_mut(slice)
        {
            *sum += r;
        }
    }
}
