//! A guess of the threshold, which joints matter to which tiles, and the sum of what returns there.

use super::joint::TileRow;
use super::strip::{Middles, Strip, bits};
use super::{
    BLOCK_TILES, Block, ComplexPerCell, EPSILON, EmQuery, F32Range, HALF_TILE_ACROSS_BINS, HALF_TILE_ALONG_BINS, Joint,
    Lanes, PerCell, PerTile, Simd, TILE_CELLS, TileGrid, Tiles, cell_parts, lanes, place, splat, store, tile_parts,
};

/// The threshold is guessed from at least this many rows of tiles, and from one in so many.
const MIN_GUESS_ROWS: usize = 10;
const MAX_GUESS_STRIDE: usize = 4;
/// The guess is that near, log₂.
const GUESS_STEP_LOG2: f64 = 0.5;
/// The strongest joint in the middle of a block's tiles.
struct StrongestJoint {
    exponent: PerTile,
    slope: [PerTile; 2],
    slack: PerTile,
    /// log₂ of any joint in the tile, at most.
    highest: PerTile,
}

impl StrongestJoint {
    #[inline(always)]
    fn new<S: Simd>(simd: S, joints: &[Joint], present: &[u32], grid: &TileGrid, block: &Block) -> Self {
        let mut strongest =
            Self { exponent: PerTile::ZERO, slope: [PerTile::ZERO; 2], slack: PerTile::ZERO, highest: PerTile::ZERO };
        for part in 0..tile_parts::<S>() {
            let (lowest, zero) = (splat(simd, f32::MIN), splat(simd, 0.0));
            let [mut exponent, mut across, mut along, mut slack, mut highest] = [lowest, zero, zero, zero, lowest];
            for &joint in present {
                let joint = &joints[joint as usize];
                let [e, a, b] = joint.middles(simd, (block, &joint.tile_row(grid, block)), part);
                let s = joint.slack(simd, block, part);
                highest = highest.max(rise(simd, a, b) + e + s);
                let s = s + splat(simd, joint.curvature);
                let best = exponent;
                exponent = e.max(best);
                across = e.select_gt(best, a, across);
                along = e.select_gt(best, b, along);
                slack = e.select_gt(best, s, slack);
            }
            store(&mut strongest.exponent, part, exponent);
            store(&mut strongest.slope[0], part, across);
            store(&mut strongest.slope[1], part, along);
            store(&mut strongest.slack, part, slack);
            store(&mut strongest.highest, part, highest);
        }
        strongest
    }
}

/// How far slopes across and along rise from a tile's middle to its outermost cell.
#[inline(always)]
fn rise<S: Simd>(simd: S, across: Lanes<S>, along: Lanes<S>) -> Lanes<S> {
    across.abs().mul_add(splat(simd, HALF_TILE_ACROSS_BINS), along.abs() * splat(simd, HALF_TILE_ALONG_BINS))
}

/// What tells a joint that matters in a tile from one that does not.
struct Bounds<S: Simd> {
    cut: Lanes<S>,
    low: Lanes<S>,
    fading: Lanes<S>,
    relative: Lanes<S>,
    log2: Lanes<S>,
}

impl<S: Simd> Bounds<S> {
    #[inline(always)]
    fn new(simd: S, range: &F32Range, joints: usize) -> Self {
        Self {
            cut: splat(simd, range.cut + range.log2 as f32),
            // Σ of all joints by the strongest, at most.
            low: splat(simd, range.low - (joints.max(1) as f32).log2()),
            fading: splat(simd, range.fading),
            relative: splat(simd, range.relative),
            log2: splat(simd, range.log2 as f32),
        }
    }

    /// A bit a tile of the block that the joint matters to, and what the joint is in the tiles' middles.
    #[inline(always)]
    fn tiles(
        &self,
        simd: S,
        joint: &Joint,
        (block, tile_row): (&Block, &TileRow),
        strongest: &StrongestJoint,
        middles: &mut Middles,
    ) -> u32 {
        let mut tiles = 0;
        for part in 0..tile_parts::<S>() {
            let [exponent, across, along] = joint.middles(simd, (block, tile_row), part);
            let slack = joint.slack(simd, block, part);
            let rise_here = rise(simd, across, along);
            let highest = rise_here + exponent + slack;
            let (best_across, best_along) =
                (lanes(simd, &strongest.slope[0], part), lanes(simd, &strongest.slope[1], part));
            let apart = rise(simd, across - best_across, along - best_along);
            let nearest = exponent - lanes(simd, &strongest.exponent, part)
                + slack
                + lanes(simd, &strongest.slack, part)
                + self.relative;
            let faded = (self.low - lanes(simd, &strongest.highest, part)).max(splat(simd, 0.0));
            let spare = (highest - faded.mul_add(self.fading, self.cut)).min(apart + nearest);
            tiles |= spare.positive_bits() << (part * S::F32_LANES);
            store(&mut middles.exponent, part, exponent - self.log2);
            store(&mut middles.across, part, across);
            store(&mut middles.along, part, along);
            store(&mut middles.rise, part, rise_here);
        }
        tiles
    }
}

impl Tiles {
    /// A guess of log₂ of the threshold: the percentile of the strongest joints in the middles of tiles.
    #[inline(always)]
    pub(super) fn guess<S: Simd>(&mut self, simd: S, query: &EmQuery<'_>) -> f64 {
        let grid = query.grid;
        self.middles.clear();
        let mut tiles = 0;
        let stride = (grid.size[0] * grid.rows / MIN_GUESS_ROWS).clamp(1, MAX_GUESS_STRIDE);
        for block in grid.blocks.iter().filter(|block| (block.slice * grid.rows + block.row).is_multiple_of(stride)) {
            let mut highest = PerTile::all(f32::MIN);
            for part in 0..tile_parts::<S>() {
                let mut best = splat(simd, f32::MIN);
                for joint in &self.joints {
                    let [exponent, ..] = joint.middles(simd, (block, &joint.tile_row(grid, block)), part);
                    best = best.max(exponent);
                }
                store(&mut highest, part, best);
            }
            let here = (grid.columns - block.column).min(BLOCK_TILES);
            // Beyond the box nothing is strong.
            highest[here..].fill(f32::MIN);
            self.middles.push(highest);
            tiles += here;
        }
        let last = tiles.saturating_sub(1);
        let (lower, _) = place(last, 100.0 - query.tau_pct);
        self.level(simd, last - lower)
    }

    /// The highest multiple of [`GUESS_STEP_LOG2`] that more than `rank` of the listed middles lie above, no lower than the floor.
    #[inline(always)]
    fn level<S: Simd>(&mut self, simd: S, rank: usize) -> f64 {
        let floor = EPSILON.log2();
        let top = self.joints.iter().map(|joint| joint.top + f64::from(joint.spectrum())).fold(floor, f64::max);
        let (mut low, mut high) = ((floor / GUESS_STEP_LOG2).floor(), (top / GUESS_STEP_LOG2).floor() + 1.0);
        // The answer is the same wherever the search begins: near that of the last evaluation it is soon found.
        let (mut probe, mut step) = (self.last_level, 1.0);
        while high - low > 1.0 {
            if !(probe > low && probe < high) {
                probe = f64::midpoint(low, high).floor();
                // Levels so far up have no multiple between them.
                if !(probe > low && probe < high) {
                    break;
                }
            }
            let level = splat(simd, (probe * GUESS_STEP_LOG2) as f32);
            let mut above = 0;
            for middles in &self.middles {
                for part in 0..tile_parts::<S>() {
                    above += (lanes(simd, middles, part) - level).positive_bits().count_ones();
                }
            }
            if above as usize > rank {
                (low, probe) = (probe, probe + step);
            } else {
                (high, probe) = (probe, probe - step);
            }
            step *= 2.0;
        }
        self.last_level = low;
        (low * GUESS_STEP_LOG2).max(floor)
    }

    /// Block by block: which joints matter to which tiles, and the sum of their returns there.
    #[inline(always)]
    pub(super) fn sum<S: Simd, const COHERENT: bool>(&mut self, simd: S, grid: &TileGrid, range: &F32Range) {
        let Self { joints, present, strips, used, ends, sums, power, lit_bits, lit, ranked, .. } = self;
        for joint in joints.iter_mut() {
            joint.mark_rows(simd, grid, range.cut + range.log2 as f32, range.log2);
        }
        let tiles = grid.blocks.len() * BLOCK_TILES;
        sums.resize(tiles, [PerCell::ZERO; 2]);
        power.resize(tiles, PerCell::ZERO);
        ranked.reserve((tiles * TILE_CELLS).saturating_sub(ranked.len()));
        for list in [&mut *lit_bits, &mut *ends] {
            list.clear();
            list.reserve(grid.blocks.len());
        }
        lit.clear();
        lit.reserve(tiles);
        // Room to grow, for the number of strips drifts while a fit moves.
        let room = (*used + *used / 2 + 16).min(joints.len() * grid.blocks.len());
        if strips.len() < room {
            strips.resize(2 * room, Strip::default());
        }
        *used = 0;
        present.reserve(joints.len());
        self.highest = f32::MIN;
        let bounds = Bounds::new(simd, range, joints.len());
        let mut middles = Middles::default();
        for (index, block) in grid.blocks.iter().enumerate() {
            if block.column == 0 {
                present.resize(joints.len(), 0);
                let mut found = 0;
                for (number, joint) in joints.iter().enumerate() {
                    // Written over by the next where it does not reach; a branch would be guessed wrong.
                    present[found] = number as u32;
                    found += usize::from(joint.reaches_row(grid, block));
                }
                present.truncate(found);
            }
            let mut tiles_lit = 0;
            if !present.is_empty() {
                let strongest = StrongestJoint::new(simd, joints, present, grid, block);
                let sums = &mut sums[index * BLOCK_TILES..(index + 1) * BLOCK_TILES];
                let inside = u32::MAX >> (32 - (grid.columns - block.column).min(BLOCK_TILES));
                for &number in present.iter() {
                    let joint = &joints[number as usize];
                    let tile_row = joint.tile_row(grid, block);
                    let tiles = bounds.tiles(simd, joint, (block, &tile_row), &strongest, &mut middles) & inside;
                    if tiles == 0 {
                        continue;
                    }
                    if *used == strips.len() {
                        strips.push(Strip::default());
                    }
                    let strip = &mut strips[*used];
                    *used += 1;
                    strip.joint = number;
                    joint.write_strip::<S, COHERENT>(simd, (block, &tile_row), tiles, &middles, strip);
                    tiles_lit |= strip.bits();
                }
                for tile in bits(tiles_lit) {
                    clear(simd, &mut sums[tile]);
                }
                let first = ends.last().map_or(0, |&end| end as usize);
                for strip in &strips[first..*used] {
                    let joint = &joints[strip.joint as usize];
                    strip.add_to::<S, COHERENT>(simd, joint, (block, &joint.tile_row(grid, block)), sums);
                }
                for part in 0..tile_parts::<S>() {
                    self.highest = self.highest.max(lanes(simd, &strongest.exponent, part).reduce_max());
                }
            }
            ends.push(*used as u32);
            lit_bits.push(tiles_lit);
            for tile in bits(tiles_lit) {
                lit.push((index * BLOCK_TILES + tile) as u32);
            }
        }
    }
}

#[inline(always)]
pub(super) fn clear<S: Simd>(simd: S, sums: &mut ComplexPerCell) {
    for sum in sums {
        for part in 0..cell_parts::<S>() {
            store(sum, part, splat(simd, 0.0));
        }
    }
}
