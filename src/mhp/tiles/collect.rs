//! What the cells want of each joint.

use super::{ACROSS, ALONG, CELLS, Joint, Lanes, Moments, Pair, SIDE, Simd, Tiles, Tiling, lanes, splat, store};

impl Tiles {
    /// Adds to each joint's moments what the cells want.
    #[inline(always)]
    pub(super) fn collect<S: Simd, const COHERENT: bool>(&self, simd: S, grid: &Tiling, moments: &mut [Moments]) {
        for ((joint, pairs), moments) in self.joints.iter().zip(&self.pairs).zip(moments) {
            let mut rest = pairs.list();
            while let Some(first) = rest.first() {
                let length = rest.partition_point(|pair| pair.slice == first.slice);
                let (slice, after) = rest.split_at(length);
                let delta = (grid.lo[0] + first.slice as usize) as f64 - joint.bin[0];
                let sums = self.collect_slice::<S, COHERENT>(simd, grid, joint, slice, moments);
                sums.add_to(moments, grid.lo[0] + first.slice as usize, delta);
                rest = after;
            }
        }
    }

    #[inline(always)]
    fn collect_slice<S: Simd, const COHERENT: bool>(
        &self,
        simd: S,
        grid: &Tiling,
        joint: &Joint,
        pairs: &[Pair],
        moments: &mut Moments,
    ) -> Sums {
        let zero = splat(simd, 0.0);
        let mut total = Sums::default();
        for part in 0..Self::parts::<S>() {
            let (x, y) = (lanes(simd, &ALONG, part), lanes(simd, &ACROSS, part));
            let [mut r, mut rx, mut ry, mut rxx, mut rxy, mut ryy, mut q, mut qx, mut qy] = [zero; 9];
            for pair in pairs.iter().filter(|pair| self.sloped[pair.slot as usize]) {
                let cells = pair.slot as usize * CELLS..(pair.slot as usize + 1) * CELLS;
                let [a, z_re, z_im] = pair.at::<S, COHERENT>(simd, joint, part);
                let re = lanes(simd, &self.re[cells.clone()], part);
                let (dx, dy) = (splat(simd, pair.delta[1]) + x, splat(simd, pair.delta[0]) + y);
                let wants = if COHERENT {
                    let im = lanes(simd, &self.im[cells], part);
                    let (a_re, a_im) = (a * re, a * im);
                    let turn = a_im * z_re - a_re * z_im;
                    q += turn;
                    qx = turn.mul_add(dx, qx);
                    qy = turn.mul_add(dy, qy);
                    a_re.mul_add(z_re, a_im * z_im)
                } else {
                    a * a * re
                };
                let (by_x, by_y) = (wants * dx, wants * dy);
                r += wants;
                rx += by_x;
                ry += by_y;
                rxx = by_x.mul_add(dx, rxx);
                rxy = by_x.mul_add(dy, rxy);
                ryy = by_y.mul_add(dy, ryy);
                if !joint.along.middle.is_empty() || !joint.across.middle.is_empty() {
                    by_bin(grid, pair, part, wants, moments);
                }
            }
            for (total, sums) in total.0.iter_mut().zip([r, rx, ry, rxx, rxy, ryy, q, qx, qy]) {
                *total += f64::from(sums.sum());
            }
        }
        total
    }
}

/// Adds `r` to the bins of the Doppler axes.
#[inline(always)]
fn by_bin<S: Simd>(grid: &Tiling, pair: &Pair, part: usize, r: Lanes<S>, moments: &mut Moments) {
    let mut cells = [0.0; CELLS];
    store(&mut cells, part, r);
    let axes: [(usize, usize); 2] =
        [(1, grid.lo[1] + pair.row as usize * SIDE), (2, grid.lo[2] + pair.column as usize * SIDE)];
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
