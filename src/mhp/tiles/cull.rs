//! Which joints matter to which tiles, and a guess of the threshold.

use super::joint::Line;
use super::strip::bits;
use super::{
    CELLS, Crest, Joint, LOG2_E, Lanes, Question, REACH, RELATIVE, SIDE, STEPS, Scale, Simd, Strip, Tiles, Tiling,
    lanes, ordered, place, splat, store, unordered,
};

/// (exponent, slope across, slope along) of a joint in some of a block's tile middles, from tile column `column` on.
#[inline(always)]
fn middles<S: Simd>(simd: S, joint: &Joint, line: &Line, column: usize, part: usize) -> [Lanes<S>; 3] {
    // All but the rest is whole: x keeps its digits near the ridge.
    let whole = lanes(simd, &STEPS, part) + splat(simd, line.nearest + (column * SIDE) as f32);
    let x = whole + splat(simd, line.rest);
    let along = x * splat(simd, joint.bend);
    let mut exponent = along.mul_add(x * splat(simd, 0.5), splat(simd, line.top));
    if let Some([middle, _]) = joint.along.blocks.get(column / CELLS) {
        exponent += lanes(simd, middle, part);
    }
    [exponent, along.mul_add(splat(simd, joint.shear), splat(simd, line.slope)), along]
}

/// How far a joint's spectrum may lie above its middles, in some of a block's tiles.
#[inline(always)]
fn slack<S: Simd>(simd: S, joint: &Joint, row: usize, column: usize, part: usize) -> Lanes<S> {
    let across = splat(simd, joint.across.most(row));
    joint.along.blocks.get(column / CELLS).map_or(across, |[_, most]| across + lanes(simd, most, part))
}

impl Tiles {
    /// The strongest joint in every tile's middle; returns a guess of log₂ of the threshold.
    #[inline(always)]
    pub(super) fn crests<S: Simd>(&mut self, simd: S, question: &Question<'_>) -> f64 {
        let grid = question.tiling;
        self.crests.clear();
        self.ranked.clear();
        for (slice, row, column) in grid.blocks() {
            let mut crest = Crest { exponent: [f32::MIN; CELLS], slope: [[0.0; CELLS]; 2], slack: [0.0; CELLS] };
            for part in 0..Self::parts::<S>() {
                let zero = splat(simd, 0.0);
                let mut best = [splat(simd, f32::MIN), zero, zero, zero];
                for joint in &self.joints {
                    let line = joint.line(grid, [slice, row]);
                    let [exponent, across, along] = middles(simd, joint, &line, column, part);
                    let slack = slack(simd, joint, row, column, part) + splat(simd, joint.curvature);
                    let highest = best[0];
                    for (best, new) in best.iter_mut().zip([exponent, across, along, slack]) {
                        *best = exponent.choose(highest, new, *best);
                    }
                }
                let [exponent, across, along, slack] = best;
                store(&mut crest.exponent, part, exponent);
                store(&mut crest.slope[0], part, across);
                store(&mut crest.slope[1], part, along);
                store(&mut crest.slack, part, slack);
            }
            let here = (grid.columns - column).min(CELLS);
            self.ranked.extend(crest.exponent[..here].iter().map(|&x| ordered(x)));
            self.crests.push(crest);
        }
        let Some(last) = self.ranked.len().checked_sub(1) else { return 0.0 };
        let (lower, _) = place(last, 100.0 - question.tau_pct);
        let (_, &mut key, _) = self.ranked.select_nth_unstable(lower);
        f64::from(unordered(key))
    }

    /// Lists for every joint the tiles that it matters to.
    #[inline(always)]
    pub(super) fn cull<S: Simd>(&mut self, simd: S, grid: &Tiling, scale: &Scale) {
        let Self { joints, crests, strips, ends, lit_bits, .. } = self;
        // Room to grow, for the number drifts while a fit moves. Memory that is not touched costs nothing.
        let (used, most) = (strips.len(), joints.len() * crests.len());
        if strips.capacity() < most.min(used + used / 2 + 16) {
            strips.reserve_exact(most.min(4 * used + 1024) - used);
        }
        strips.clear();
        ends.clear();
        lit_bits.clear();
        lit_bits.resize(crests.len(), 0);
        let (reach, cut) = (splat(simd, REACH), splat(simd, scale.cut + scale.log2 as f32));
        let (relative, log2) = (splat(simd, (RELATIVE * LOG2_E) as f32), splat(simd, scale.log2 as f32));
        for joint in joints.iter() {
            for (block, (slice, row, column)) in grid.blocks().enumerate() {
                let line = joint.line(grid, [slice, row]);
                if line.highest + joint.along.largest < cut.first() {
                    continue;
                }
                let crest = &crests[block];
                let mut strip = Strip::default();
                for part in 0..Self::parts::<S>() {
                    let [exponent, across, along] = middles(simd, joint, &line, column, part);
                    let slack = slack(simd, joint, row, column, part);
                    let highest = (along.abs() + across.abs()).mul_add(reach, exponent + slack);
                    let best_across = lanes(simd, &crest.slope[0], part);
                    let best_along = lanes(simd, &crest.slope[1], part);
                    let apart = (along - best_along).abs() + (across - best_across).abs();
                    let nearest = exponent - lanes(simd, &crest.exponent, part)
                        + slack
                        + lanes(simd, &crest.slack, part)
                        + relative;
                    let spare = (highest - cut).min(apart.mul_add(reach, nearest));
                    strip.tiles |= spare.positive() << (part * S::F32_LANES);
                    store(&mut strip.exponent, part, exponent - log2);
                    store(&mut strip.slope[0], part, across);
                    store(&mut strip.slope[1], part, along);
                }
                strip.tiles &= u32::MAX >> (32 - (grid.columns - column).min(CELLS));
                if strip.tiles == 0 {
                    continue;
                }
                lit_bits[block] |= strip.tiles;
                (strip.block, strip.slice, strip.row, strip.column) =
                    (block as u32, slice as u32, row as u32, column as u32);
                strip.across = line.delta;
                for part in 0..Self::parts::<S>() {
                    let whole = lanes(simd, &STEPS, part) + splat(simd, joint.first[0] + (column * SIDE) as f32);
                    let along = whole + splat(simd, joint.first[1]);
                    let turns = along.mul_add(splat(simd, joint.along_turns), splat(simd, line.turn));
                    store(&mut strip.along, part, along);
                    for (table, values) in strip.turn.iter_mut().zip(turns.turn()) {
                        store(table, part, values);
                    }
                }
                strips.push(strip);
            }
            ends.push(strips.len());
        }
        let cells = crests.len() * CELLS * CELLS;
        for field in [&mut self.re, &mut self.im, &mut self.power, &mut self.soft] {
            field.resize(cells, 0.0);
        }
        self.ranked.reserve(cells.saturating_sub(self.ranked.len()));
        self.lit.clear();
        self.lit.reserve(crests.len() * CELLS);
        for (block, &tiles) in self.lit_bits.iter().enumerate() {
            self.lit.extend(bits(tiles).map(|tile| (block * CELLS + tile) as u32));
        }
        for &tile in &self.lit {
            let cells = tile as usize * CELLS..(tile as usize + 1) * CELLS;
            self.re[cells.clone()].fill(0.0);
            self.im[cells].fill(0.0);
        }
    }
}
