//! Which joints matter to which tiles, and a guess of the threshold.

use super::joint::Line;
use super::strip::bits;
use super::{
    Block, CELLS, Crest, Joint, LOG2_E, Lanes, Question, REACH, RELATIVE, SIDE, STEPS, Scale, Simd, Strip, Tiles,
    Tiling, lanes, ordered, place, splat, store, unordered,
};

/// The threshold is guessed from at least this many rows of tiles, and from one in so many.
const ROWS: usize = 10;
const STRIDE: usize = 4;

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
fn slack<S: Simd>(simd: S, joint: &Joint, block: &Block, part: usize) -> Lanes<S> {
    let across = splat(simd, joint.across.most(block.row));
    joint.along.blocks.get(block.column / CELLS).map_or(across, |[_, most]| across + lanes(simd, most, part))
}

impl Tiles {
    /// A guess of log₂ of the threshold: the percentile of the strongest joints in the middles of tiles.
    #[inline(always)]
    pub(super) fn guess<S: Simd>(&mut self, simd: S, question: &Question<'_>) -> f64 {
        let grid = question.tiling;
        self.ranked.clear();
        let stride = (grid.size[0] * grid.rows / ROWS).clamp(1, STRIDE);
        for block in grid.blocks.iter().filter(|block| (block.slice * grid.rows + block.row).is_multiple_of(stride)) {
            let mut highest = [f32::MIN; CELLS];
            for part in 0..Self::parts::<S>() {
                let mut best = splat(simd, f32::MIN);
                for joint in &self.joints {
                    let [exponent, ..] = middles(simd, joint, &joint.line(grid, block), block.column, part);
                    best = best.max(exponent);
                }
                store(&mut highest, part, best);
            }
            let here = (grid.columns - block.column).min(CELLS);
            self.ranked.extend(highest[..here].iter().map(|&x| ordered(x)));
        }
        let Some(last) = self.ranked.len().checked_sub(1) else { return 0.0 };
        let (lower, _) = place(last, 100.0 - question.tau_pct);
        let (_, &mut key, _) = self.ranked.select_nth_unstable(lower);
        f64::from(unordered(key))
    }

    /// The strongest joint in every tile's middle, among those that reach its row.
    #[inline(always)]
    fn crests<S: Simd>(&mut self, simd: S, grid: &Tiling) {
        let Self { joints, crests, .. } = self;
        crests.clear();
        crests.resize(grid.blocks.len(), Crest::NOTHING);
        for joint in joints.iter() {
            for &index in &joint.reached {
                let (block, crest) = (&grid.blocks[index as usize], &mut crests[index as usize]);
                let line = joint.line(grid, block);
                for part in 0..Self::parts::<S>() {
                    let [exponent, across, along] = middles(simd, joint, &line, block.column, part);
                    let slack = slack(simd, joint, block, part);
                    let highest = (along.abs() + across.abs()).mul_add(splat(simd, REACH), exponent + slack);
                    let highest = highest.max(lanes(simd, &crest.highest, part));
                    store(&mut crest.highest, part, highest);
                    let slack = slack + splat(simd, joint.curvature);
                    let highest = lanes(simd, &crest.exponent, part);
                    let Crest { exponent: e, slope: [a, b], slack: s, .. } = crest;
                    for (best, new) in [(e, exponent), (a, across), (b, along), (s, slack)] {
                        let old = lanes(simd, best, part);
                        store(best, part, exponent.choose(highest, new, old));
                    }
                }
            }
        }
    }

    /// Lists for every joint the tiles that it matters to.
    #[inline(always)]
    pub(super) fn cull<S: Simd>(&mut self, simd: S, grid: &Tiling, scale: &Scale) {
        let cut = scale.cut + scale.log2 as f32;
        for joint in &mut self.joints {
            joint.reach(simd, grid, cut);
        }
        self.crests(simd, grid);
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
        let reach = splat(simd, REACH);
        // Σ of all joints by the strongest, at most.
        let low = splat(simd, scale.low - (joints.len().max(1) as f32).log2());
        let (relative, log2) = (splat(simd, (RELATIVE * LOG2_E) as f32), splat(simd, scale.log2 as f32));
        for joint in joints.iter() {
            for &index in &joint.reached {
                let (block, crest) = (&grid.blocks[index as usize], &crests[index as usize]);
                let line = joint.line(grid, block);
                let mut strip = Strip::default();
                for part in 0..Self::parts::<S>() {
                    let [exponent, across, along] = middles(simd, joint, &line, block.column, part);
                    let slack = slack(simd, joint, block, part);
                    let highest = (along.abs() + across.abs()).mul_add(reach, exponent + slack);
                    let best_across = lanes(simd, &crest.slope[0], part);
                    let best_along = lanes(simd, &crest.slope[1], part);
                    let apart = (along - best_along).abs() + (across - best_across).abs();
                    let nearest = exponent - lanes(simd, &crest.exponent, part)
                        + slack
                        + lanes(simd, &crest.slack, part)
                        + relative;
                    let faded = (low - lanes(simd, &crest.highest, part)).max(splat(simd, 0.0));
                    let cut = faded.mul_add(splat(simd, scale.fading), splat(simd, cut));
                    let spare = (highest - cut).min(apart.mul_add(reach, nearest));
                    strip.tiles |= spare.positive() << (part * S::F32_LANES);
                    store(&mut strip.exponent, part, exponent - log2);
                    store(&mut strip.slope[0], part, across);
                    store(&mut strip.slope[1], part, along);
                }
                strip.tiles &= u32::MAX >> (32 - (grid.columns - block.column).min(CELLS));
                if strip.tiles == 0 {
                    continue;
                }
                lit_bits[index as usize] |= strip.tiles;
                (strip.block, strip.slice) = (index, block.slice as u32);
                (strip.row, strip.column) = (block.row as u32, block.column as u32);
                strip.across = line.delta;
                for part in 0..Self::parts::<S>() {
                    let whole = lanes(simd, &STEPS, part) + splat(simd, joint.first[0] + (block.column * SIDE) as f32);
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
