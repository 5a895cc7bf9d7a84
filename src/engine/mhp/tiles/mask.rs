//! H in the tiles, its percentile, the mask and its slope.

use super::strip::bits;
use super::sum::clear;
use super::{
    BLOCK_TILES, EmQuery, F32Range, Lanes, MIN_RETURN_LOG2, Mask, Simd, Threshold, Tiles, between, cell_parts, lanes,
    place, splat, store,
};

/// m(1 − m)/T below which a tile has no slope.
const MIN_MASK_SLOPE: f32 = 3e-7;
/// The square of the threshold is looked for between these multiples of the last one, and then between those.
const NEAR_LEVELS: [f64; 2] = [0.93, 1.07];
const FAR_LEVELS: [f64; 2] = [0.5, 2.0];
/// log₂ of m/(1 − m) is cut off here, both ways; there is no slope so far up.
const MAX_ODDS_LOG2: f32 = 60.0;
/// Tiles whose soft masks are added up in single precision.
const TILES_OF_F32_SUM: usize = 64;

impl Tiles {
    /// H² of every cell that is summed, and the percentile of H over all cells.
    #[inline(always)]
    pub(super) fn threshold<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        query: &EmQuery<'_>,
        range: &F32Range,
    ) -> Threshold {
        let grid = query.grid;
        let square = self.last.map_or(f64::NAN, |last| (2.0 * (last - range.log2)).exp2());
        let levels = NEAR_LEVELS.map(|level| (level * square) as f32);
        let (zero, one, faint) = (splat(simd, 0.0), splat(simd, 1.0), splat(simd, MIN_RETURN_LOG2.exp2()));
        let mut above = [zero; 2];
        for &tile in &self.lit {
            let tile = tile as usize;
            let (target, [re, im], power) = (&grid.target[tile], &self.sums[tile], &mut self.power[tile]);
            for part in 0..cell_parts::<S>() {
                let (re, im) = (lanes(simd, re, part), lanes(simd, im, part));
                let square = if COHERENT {
                    // What is too faint to be squared is nothing beside the threshold.
                    let (re, im) = (re.abs().max(faint), im.abs().max(faint));
                    re.mul_add(re, im * im)
                } else {
                    re
                };
                let value = square + splat(simd, range.epsilon_sq);
                // What lies beyond the box ranks below all.
                let value = lanes(simd, target, part).select_gt(splat(simd, -0.5), value, splat(simd, -1.0));
                store(power, part, value);
                for (above, level) in above.iter_mut().zip(levels) {
                    *above += value.select_gt(splat(simd, level), one, zero);
                }
            }
        }
        let last = grid.cells.saturating_sub(1);
        let (lower_index, weight) = place(last, 100.0 - query.tau_pct);
        // Counted from the strongest.
        let rank = last - lower_index;
        // A level that fewer than these lie above, with their upper neighbour, is beyond the threshold.
        let (mut low, mut high, mut stronger) = (-0.5, f32::MAX, 0);
        let mut bound = |levels: [f32; 2], above: [usize; 2]| {
            for (level, above) in levels.into_iter().zip(above) {
                if above > rank {
                    low = level.max(low);
                } else if above < rank && level < high {
                    (high, stronger) = (level, above);
                }
            }
            low > 0.0 && high < f32::MAX
        };
        if !bound(levels, [above[0].reduce_sum() as usize, above[1].reduce_sum() as usize]) {
            let levels = FAR_LEVELS.map(|level| (level * square) as f32);
            bound(levels, self.above(simd, levels));
        }
        let above = stronger;
        self.between(simd, [low, high]);
        let found = order(&mut self.ranked, rank - above);
        // Where only the upper neighbour is summed, the lower one is nothing beside it.
        let split = || {
            let least = self.ranked.iter().copied().min().filter(|_| self.ranked.len() + above == rank && weight > 0.0);
            least.map(|upper| [range.epsilon_sq, f32::from_bits(upper)])
        };
        let found = found.or_else(split);
        let among_lit = found.is_some();
        let [lower, upper] = found.unwrap_or([range.epsilon_sq; 2]);
        let upper = if upper.is_nan() { lower } else { upper };
        let value = between(f64::from(lower).sqrt(), f64::from(upper).sqrt(), weight);
        Threshold { lower, value, log2: value.log2() + range.log2, among_lit }
    }

    /// How many squares lie above each level.
    #[inline(always)]
    fn above<S: Simd>(&self, simd: S, levels: [f32; 2]) -> [usize; 2] {
        let mut above = [0; 2];
        for &tile in &self.lit {
            for part in 0..cell_parts::<S>() {
                let value = lanes(simd, &self.power[tile as usize], part);
                for (above, level) in above.iter_mut().zip(levels) {
                    *above += (value - splat(simd, level)).positive_bits().count_ones() as usize;
                }
            }
        }
        above
    }

    /// Lists the squares in (low, high] as what is ranked.
    #[inline(always)]
    fn between<S: Simd>(&mut self, simd: S, [low, high]: [f32; 2]) {
        self.ranked.clear();
        for &tile in &self.lit {
            let power = &self.power[tile as usize];
            for part in 0..cell_parts::<S>() {
                let value = lanes(simd, power, part);
                let above = (value - splat(simd, low)).positive_bits();
                for cell in bits(above & !(value - splat(simd, high)).positive_bits()) {
                    self.ranked.push(power[part * S::F32_LANES + cell].to_bits());
                }
            }
        }
    }

    /// The soft mask: its sums, and a cell's m(1 − m)/|S|² · d ln(H + h)/d ln|S|.
    #[inline(always)]
    pub(super) fn mask<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        query: &EmQuery<'_>,
        range: &F32Range,
        threshold: &Threshold,
    ) -> Mask {
        let grid = query.grid;
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let flat = splat(simd, (f64::from(MIN_MASK_SLOPE) * query.softness) as f32);
        let centre = (threshold.value + f64::from(range.soft_floor)).log2();
        let odds = Odds::new(query.softness, range.soft_floor, threshold.value);
        self.sloped.clear();
        self.sloped.resize(self.lit_bits.len(), 0);
        let mut mask = Mask::default();
        let (mut common, mut soft) = (0.0, 0.0);
        let (mut both, mut hard, mut marked, mut lit_cells) = (zero, zero, zero, zero);
        for tiles in self.lit.chunks(TILES_OF_F32_SUM) {
            let (mut few_common, mut few_soft) = (zero, zero);
            for &tile in tiles {
                let tile = tile as usize;
                let (target, cells) = (&grid.target[tile], &mut self.power[tile]);
                let mut steep = false;
                for part in 0..cell_parts::<S>() {
                    let (target, power) = (lanes(simd, target, part), lanes(simd, cells, part));
                    let inside = target.select_gt(splat(simd, -0.5), one, zero);
                    let b = target.max(zero);
                    let [odds, by_power] = odds.at(simd, power.max(splat(simd, f32::MIN_POSITIVE)));
                    let share = one / (one + odds);
                    let m = odds * share * inside;
                    few_common = m.mul_add(b, few_common);
                    few_soft += m;
                    steep |= (m * share - flat).any_positive();
                    store(cells, part, by_power * share * share * inside);
                    let sim = power.select_gt(splat(simd, threshold.lower), inside, zero);
                    both = sim.mul_add(b, both);
                    hard += sim;
                    marked += b;
                    lit_cells += inside;
                }
                self.sloped[tile / BLOCK_TILES] |= u32::from(steep) << (tile % BLOCK_TILES);
            }
            common += f64::from(few_common.reduce_sum());
            soft += f64::from(few_soft.reduce_sum());
        }
        // Cells that were not summed are at the floor, and alike.
        let [both, hard, marked, lit_cells] =
            [both.reduce_sum(), hard.reduce_sum(), marked.reduce_sum(), lit_cells.reduce_sum()];
        let idle_marked = grid.marked as f64 - f64::from(marked);
        let idle = grid.cells as f64 - f64::from(lit_cells);
        let floor = f64::from(range.epsilon_sq.sqrt()) + f64::from(range.soft_floor);
        let idle_soft = 1.0 / (1.0 + ((centre - floor.log2()) / query.softness).exp2());
        mask.common = common + idle_soft * idle_marked;
        mask.union = soft + idle_soft * idle + grid.marked as f64 - mask.common;
        mask.both = both as usize;
        mask.either = hard as usize + grid.marked - mask.both;
        mask
    }

    /// Turns the sums into w S*/|S|² (or w/Σ(AK)² where the sum is incoherent), w = ∂L/∂ln|S|.
    #[inline(always)]
    pub(super) fn weight_sums<S: Simd, const COHERENT: bool>(
        &mut self,
        simd: S,
        query: &EmQuery<'_>,
        mask: &Mask,
        factor: f64,
    ) {
        let grid = query.grid;
        let inside = splat(simd, (-factor / mask.union) as f32);
        let outside = splat(simd, (factor * mask.common / (mask.union * mask.union)) as f32);
        for (block, (&tiles, &lit)) in self.sloped.iter().zip(&self.lit_bits).enumerate() {
            // Strips go through tiles without a slope, too.
            for tile in bits(lit & !tiles) {
                clear(simd, &mut self.sums[block * BLOCK_TILES + tile]);
            }
            for tile in bits(tiles) {
                let tile = block * BLOCK_TILES + tile;
                let (target, [re, im], soft) = (&grid.target[tile], &mut self.sums[tile], &self.power[tile]);
                for part in 0..cell_parts::<S>() {
                    let by_m = lanes(simd, target, part).select_gt(splat(simd, 0.5), inside, outside);
                    let weight = lanes(simd, soft, part) * by_m;
                    if COHERENT {
                        let (weighed_re, weighed_im) = (lanes(simd, re, part) * weight, lanes(simd, im, part) * weight);
                        store(re, part, weighed_re);
                        store(im, part, weighed_im);
                    } else {
                        store(re, part, weight);
                    }
                }
            }
        }
    }
}

/// m/(1 − m) of the soft mask, (H + h)^(1/T) by that of the threshold.
struct Odds {
    /// 1/T
    sharpness: f32,
    /// 0 where it is nothing beside the threshold.
    soft_floor: f32,
    /// log₂ of the threshold, and 1 by its square.
    centre: f32,
    square: f32,
}

impl Odds {
    fn new(softness: f64, soft_floor: f32, threshold: f64) -> Self {
        let soft_floor = if f64::from(soft_floor) < 1e-8 * threshold { 0.0 } else { soft_floor };
        let raised = threshold + f64::from(soft_floor);
        Self {
            sharpness: (1.0 / softness) as f32,
            soft_floor,
            centre: raised.log2() as f32,
            square: (1.0 / (raised * raised)) as f32,
        }
    }

    /// The odds where H² is `power`, and these times d ln(H + h)/d ln H by H².
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, power: Lanes<S>) -> [Lanes<S>; 2] {
        let of = |x: f32| splat(simd, x);
        if self.soft_floor == 0.0 && self.sharpness == 2.0 {
            // T = ½ takes no powers.
            let (odds, most) = (power * of(self.square), of(MAX_ODDS_LOG2.exp2()));
            return [odds.min(most), odds.select_gt(most, of(0.0), of(self.square))];
        }
        let h = power.sqrt();
        let raised = h + of(self.soft_floor);
        let odds = ((raised.log2() - of(self.centre)) * of(self.sharpness))
            .min(of(MAX_ODDS_LOG2))
            .max(of(-MAX_ODDS_LOG2))
            .exp2();
        [odds, odds / (raised * h)]
    }
}

/// The value of a rank, counted from the strongest, among floats as bits, and the next above it (NaN where there is none).
fn order(ranked: &mut [u32], rank: usize) -> Option<[f32; 2]> {
    let from_below = ranked.len().checked_sub(rank + 1)?;
    let (_, &mut lower, stronger) = ranked.select_nth_unstable(from_below);
    let upper = stronger.iter().copied().min();
    Some([f32::from_bits(lower), upper.map_or(f32::NAN, f32::from_bits)])
}
