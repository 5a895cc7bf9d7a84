//! H in the tiles, its percentile, the mask and its slope.

use super::{CELLS, Mask, NO_SLOPE, Question, Scale, Simd, Threshold, Tiles, between, lanes, place, splat, store};

impl Tiles {
    /// Adds every pair's return to its tile.
    #[inline(always)]
    pub(super) fn sum<S: Simd, const COHERENT: bool>(&mut self, simd: S) {
        let Self { joints, pairs, re, im, .. } = self;
        for (joint, pairs) in joints.iter().zip(pairs.iter()) {
            for pair in pairs.list() {
                let cells = pair.slot as usize * CELLS..(pair.slot as usize + 1) * CELLS;
                let (re, im) = (&mut re[cells.clone()], &mut im[cells]);
                for part in 0..Self::parts::<S>() {
                    let [a, z_re, z_im] = pair.at::<S, COHERENT>(simd, joint, part);
                    let old = lanes(simd, re, part);
                    if COHERENT {
                        store(re, part, a.mul_add(z_re, old));
                        store(im, part, a.mul_add(z_im, lanes(simd, im, part)));
                    } else {
                        store(re, part, a.mul_add(a, old));
                    }
                }
            }
        }
    }

    /// H of every cell that is summed, and its percentile over all cells.
    #[inline(always)]
    pub(super) fn threshold<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        question: &Question<'_>,
        scale: &Scale,
    ) -> Threshold {
        let grid = question.tiling;
        let window = self.last.map(|last| [0.8, 1.25].map(|k| (k * (last - scale.log2).exp2()) as f32));
        let [low, high] = window.unwrap_or([f32::MAX, f32::MAX]);
        self.ranked.clear();
        let mut above = splat(simd, 0.0);
        for (slot, &tile) in self.lit.iter().enumerate() {
            let cells = slot * CELLS..(slot + 1) * CELLS;
            let target = &grid.target[tile as usize * CELLS..(tile as usize + 1) * CELLS];
            let (re, im, h) = (&self.re[cells.clone()], &self.im[cells.clone()], &mut self.h[cells]);
            let mut any = false;
            for part in 0..Self::parts::<S>() {
                let (re, im) = (lanes(simd, re, part), lanes(simd, im, part));
                let power = if COHERENT { re.mul_add(re, im * im) } else { re };
                let value = (power + splat(simd, scale.epsilon_sq)).sqrt();
                // What lies beyond the box ranks below all.
                let value = lanes(simd, target, part).choose(splat(simd, -0.5), value, splat(simd, -1.0));
                above += value.choose(splat(simd, high), splat(simd, 1.0), splat(simd, 0.0));
                any |= (value - splat(simd, low)).min(splat(simd, high) - value).any_positive();
                store(h, part, value);
            }
            if any {
                self.ranked.extend(h.iter().filter(|&&x| x > low && x <= high).map(|x| x.to_bits()));
            }
        }
        let last = grid.cells.saturating_sub(1);
        let (lower_index, weight) = place(last, 100.0 - question.tau_pct);
        // Counted from the strongest.
        let (rank, above) = (last - lower_index, above.sum() as usize);
        let floor = scale.epsilon_sq.sqrt();
        let order = |ranked: &mut [u32], rank: usize| -> Option<[f32; 2]> {
            let from_below = ranked.len().checked_sub(rank + 1)?;
            let (_, &mut lower, stronger) = ranked.select_nth_unstable(from_below);
            let upper = stronger.iter().copied().min();
            Some([f32::from_bits(lower), upper.map_or(f32::NAN, f32::from_bits)])
        };
        let near = rank.checked_sub(above).filter(|&rank| rank > 0);
        let found = near.and_then(|rank| order(&mut self.ranked, rank)).or_else(|| {
            self.ranked.clear();
            self.ranked.extend(self.h.iter().filter(|&&x| x >= 0.0).map(|x| x.to_bits()));
            order(&mut self.ranked, rank)
        });
        // Where only the upper neighbour is summed, the lower one is nothing beside it.
        let split = || {
            let least = self.ranked.iter().copied().min().filter(|_| self.ranked.len() == rank && weight > 0.0);
            least.map(|upper| [floor, f32::from_bits(upper)])
        };
        let found = found.or_else(split);
        let among_lit = found.is_some();
        let [lower, upper] = found.unwrap_or([floor; 2]);
        let upper = if upper.is_nan() { lower } else { upper };
        let value = between(f64::from(lower), f64::from(upper), weight);
        Threshold { lower, value, log2: value.log2() + scale.log2, among_lit }
    }

    /// The soft mask: its sums, and a cell's m(1 − m)/|S|² · d ln(H + h)/d ln|S|.
    #[inline(always)]
    pub(super) fn mask<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        question: &Question<'_>,
        scale: &Scale,
        threshold: &Threshold,
    ) -> Mask {
        let grid = question.tiling;
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let soft_floor = scale.soft_floor;
        let centre = (threshold.value + f64::from(soft_floor)).log2();
        let softness = splat(simd, (1.0 / question.softness) as f32);
        self.sloped.clear();
        let mut mask = Mask::default();
        let (mut common, mut soft) = (0.0, 0.0);
        let (mut both, mut hard, mut marked, mut lit_cells) = (zero, zero, zero, zero);
        for (slot, &tile) in self.lit.iter().enumerate() {
            let cells = slot * CELLS..(slot + 1) * CELLS;
            let target = &grid.target[tile as usize * CELLS..(tile as usize + 1) * CELLS];
            let (h, out) = (&self.h[cells.clone()], &mut self.soft[cells]);
            let mut steepest = zero;
            let (mut tile_common, mut tile_soft) = (zero, zero);
            for part in 0..Self::parts::<S>() {
                let (target, h) = (lanes(simd, target, part), lanes(simd, h, part));
                let inside = target.choose(splat(simd, -0.5), one, zero);
                let (b, h) = (target.max(zero), h.max(splat(simd, f32::MIN_POSITIVE.sqrt())));
                let raised = h + splat(simd, soft_floor);
                let odds = ((raised.log2() - splat(simd, centre as f32)) * softness)
                    .min(splat(simd, 60.0))
                    .max(splat(simd, -60.0))
                    .exp2();
                let share = one / (one + odds);
                let m = odds * share * inside;
                tile_common += m * b;
                tile_soft += m;
                let slope = m * share;
                steepest = steepest.max(slope);
                store(out, part, slope / (raised * h));
                let sim = h.choose(splat(simd, threshold.lower), inside, zero);
                both += sim * b;
                hard += sim;
                marked += b;
                lit_cells += inside;
            }
            common += f64::from(tile_common.sum());
            soft += f64::from(tile_soft.sum());
            self.sloped.push(steepest.largest() > NO_SLOPE);
        }
        // Cells that were not summed are at the floor, and alike.
        let [both, hard, marked, lit_cells] = [both.sum(), hard.sum(), marked.sum(), lit_cells.sum()];
        let idle_marked = grid.marked as f64 - f64::from(marked);
        let idle = grid.cells as f64 - f64::from(lit_cells);
        let floor = f64::from(scale.epsilon_sq.sqrt()) + f64::from(soft_floor);
        let idle_soft = 1.0 / (1.0 + ((centre - floor.log2()) / question.softness).exp2());
        mask.common = common + idle_soft * idle_marked;
        mask.union = soft + idle_soft * idle + grid.marked as f64 - mask.common;
        mask.both = both as usize;
        mask.either = hard as usize + grid.marked - mask.both;
        mask
    }

    /// Turns the sums into w S*/|S|² (or w/Σ(AK)² where the sum is incoherent), w = ∂L/∂ln|S|.
    #[inline(always)]
    pub(super) fn weigh<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        question: &Question<'_>,
        mask: &Mask,
        factor: f64,
    ) {
        let grid = question.tiling;
        let inside = splat(simd, (-factor / mask.union) as f32);
        let outside = splat(simd, (factor * mask.common / (mask.union * mask.union)) as f32);
        for (slot, &tile) in self.lit.iter().enumerate().filter(|(slot, _)| self.sloped[*slot]) {
            let cells = slot * CELLS..(slot + 1) * CELLS;
            let target = &grid.target[tile as usize * CELLS..(tile as usize + 1) * CELLS];
            let (re, im, soft) = (&mut self.re[cells.clone()], &mut self.im[cells.clone()], &self.soft[cells]);
            for part in 0..Self::parts::<S>() {
                let by_m = lanes(simd, target, part).choose(splat(simd, 0.5), inside, outside);
                let weight = lanes(simd, soft, part) * by_m;
                if COHERENT {
                    store(re, part, lanes(simd, re, part) * weight);
                    store(im, part, lanes(simd, im, part) * weight);
                } else {
                    store(re, part, weight);
                }
            }
        }
    }
}
