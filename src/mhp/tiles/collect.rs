//! What the cells want of each joint.

use super::strip::bits;
use super::{ACROSS, ALONG, CELLS, Joint, Lanes, Moments, SIDE, Simd, Strip, Tiles, Tiling, lanes, splat, store};

impl Tiles {
    /// Adds to each joint's moments what the cells want.
    #[inline(always)]
    pub(super) fn collect<S: Simd, const COHERENT: bool>(&self, simd: S, grid: &Tiling, moments: &mut [Moments]) {
        let mut from = 0;
        for ((joint, &to), moments) in self.joints.iter().zip(&self.ends).zip(moments) {
            for strips in self.strips[from..to].chunk_by(|a, b| a.slice == b.slice) {
                let slice = grid.lo[0] + strips[0].slice as usize;
                let sums = self.collect_slice::<S, COHERENT>(simd, grid, joint, strips, moments);
                sums.add_to(moments, slice, slice as f64 - joint.bin[0]);
            }
            from = to;
        }
    }

    #[inline(always)]
    fn collect_slice<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        grid: &Tiling,
        joint: &Joint,
        strips: &[Strip],
        moments: &mut Moments,
    ) -> Sums {
        let zero = splat(simd, 0.0);
        let spectral = !joint.along.cells.is_empty() || !joint.across.cells.is_empty();
        let mut total = Sums::default();
        for part in 0..Self::parts::<S>() {
            let (x, y) = (lanes(simd, &ALONG, part), lanes(simd, &ACROSS, part));
            let mut sums = [zero; 9];
            for strip in strips {
                // By the distance of the tiles' middles first: that of the cells is the same in all of them.
                let [mut r, mut rx, mut rxx, mut q, mut qx] = [zero; 5];
                for tile in bits(strip.tiles & self.sloped[strip.block as usize]) {
                    let cell = (strip.block as usize * CELLS + tile) * CELLS;
                    let [a, a_re, a_im] = strip.at::<S, COHERENT>(simd, joint, tile, part);
                    let re = lanes(simd, &self.re[cell..cell + CELLS], part);
                    let dx = splat(simd, strip.along[tile]);
                    let wants = if COHERENT {
                        let im = lanes(simd, &self.im[cell..cell + CELLS], part);
                        let turn = a_re * im - a_im * re;
                        q += turn;
                        qx = turn.mul_add(dx, qx);
                        a_re.mul_add(re, a_im * im)
                    } else {
                        a * a * re
                    };
                    let by_x = wants * dx;
                    r += wants;
                    rx += by_x;
                    rxx = by_x.mul_add(dx, rxx);
                    if spectral {
                        by_bin(grid, strip, tile, part, wants, moments);
                    }
                }
                let y = y + splat(simd, strip.across);
                let cell_rx = x.mul_add(r, rx);
                let cell_rxx = x.mul_add(rx + cell_rx, rxx);
                let cell_qx = x.mul_add(q, qx);
                let ry = r * y;
                let news = [r, cell_rx, ry, cell_rxx, cell_rx * y, ry * y, q, cell_qx, q * y];
                for (sum, new) in sums.iter_mut().zip(news) {
                    *sum += new;
                }
            }
            for (total, sums) in total.0.iter_mut().zip(sums) {
                *total += f64::from(sums.sum());
            }
        }
        total
    }
}

/// Adds `r` to the bins of the Doppler axes.
#[inline(always)]
fn by_bin<S: Simd>(grid: &Tiling, strip: &Strip, tile: usize, part: usize, r: Lanes<S>, moments: &mut Moments) {
    let mut cells = [0.0; CELLS];
    store(&mut cells, part, r);
    let axes: [(usize, usize); 2] =
        [(1, grid.lo[1] + strip.row as usize * SIDE), (2, grid.lo[2] + (strip.column as usize + tile) * SIDE)];
    let missing = 3 - moments.dims;
    for (axis, first) in axes {
        let Some(bins) = axis.checked_sub(missing).map(|k| &mut moments.r_by_bin[k]) else { continue };
        if bins.is_empty() {
            continue;
        }
        for (cell, &r) in cells.iter().enumerate() {
            let lane = if axis == 2 { cell % SIDE } else { cell / SIDE };
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
