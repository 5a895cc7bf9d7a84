//! What tiles sum and what they drop, against every cell by itself in f64.

use super::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use std::f64::consts::TAU;
use std::ops::Range;

/// The box: bins across and along, the last block half beyond it.
const BOX: [[usize; 2]; 2] = [[3, 45], [10, 170]];

/// Bin, 1/D, skew, ln weight, phase and ramp of a joint on the last two axes; its standard deviations lie in `widths`, bins.
fn joint(rng: &mut StdRng, widths: Range<f64>) -> [f64; 14] {
    let [y, x] = BOX.map(|[lo, hi]| rng.random_range(lo as f64..hi as f64));
    let [weight_y, weight_x] = [(); 2].map(|()| rng.random_range(widths.clone()).powi(-2));
    let skew = rng.random_range(-0.4..0.4);
    let [ramp_y, ramp_x] = [(); 2].map(|()| rng.random_range(-0.6..0.6));
    let (ln_weight, phase) = (rng.random_range(-1.0..2.0), rng.random_range(0.0..TAU));
    [0.0, y, x, 1.0, weight_y, weight_x, 0.0, 0.0, skew, ln_weight, phase, 0.0, ramp_y, ramp_x]
}

/// ln amplitude and phase of a joint's return at a cell, rad.
fn returned(joint: &[f64; 14], [y, x]: [usize; 2]) -> [f64; 2] {
    let [_, bin_y, bin_x, _, weight_y, weight_x, .., skew, ln_weight, phase, _, ramp_y, ramp_x] = *joint;
    let (across, along) = (y as f64 - bin_y, x as f64 - bin_x);
    let bent = along + skew * across;
    [ln_weight - 0.5 * (weight_y * across * across + weight_x * bent * bent), phase + ramp_y * across + ramp_x * along]
}

/// Bins of a cell of a tile.
fn bins_of(grid: &TileGrid, tile: usize, cell: usize) -> [usize; 2] {
    let Block { row, column, .. } = grid.blocks[tile / BLOCK_TILES];
    let x = (column + tile % BLOCK_TILES) * TILE_ALONG_BINS + cell % TILE_ALONG_BINS;
    [BOX[0][0] + row * TILE_ACROSS_BINS + cell / TILE_ALONG_BINS, BOX[1][0] + x]
}

fn whole_box() -> TileGrid {
    let cells = BOX.iter().map(|[lo, hi]| hi - lo).product();
    TileGrid::new(&BOX, &vec![false; cells], None)
}

/// log₂ of what 1 stands for in the sums of a map of these joints.
fn range(joints: &[[f64; 14]]) -> F32Range {
    F32Range::below(joints.iter().map(|joint| joint[9] * LOG2_E).fold(f64::MIN, f64::max))
}

#[test]
fn a_strip_sums_what_its_joint_returns() {
    let (grid, mut rng, mut chained) = (whole_box(), StdRng::seed_from_u64(11), [0; 2]);
    for (case, widths) in [2.0..6.0, 6.0..30.0, 0.3..0.7].into_iter().cycle().take(60).enumerate() {
        let joint = [joint(&mut rng, widths)];
        let (splats, unit) = (Splats::from_numbers(&joint), range(&joint).log2.exp2());
        for summation in [Summation::Coherent, Summation::Incoherent] {
            let mut tiles = Tiles::default();
            // No map where a narrow joint shines in no tile's middle; what is summed is right all the same.
            let _map = tiles.map(&splats, &grid, summation);
            for strip in &tiles.strips[..tiles.used] {
                chained[usize::from(strip.chained)] += 1;
            }
            for &tile in &tiles.lit {
                let tile = tile as usize;
                for cell in (0..TILE_CELLS).filter(|&cell| grid.target[tile][cell] >= 0.0) {
                    let [re, im] = [0, 1].map(|part| f64::from(tiles.sums[tile][part][cell]));
                    let [ln_a, phase] = returned(&joint[0], bins_of(&grid, tile, cell));
                    let a = ln_a.exp() / unit;
                    let (off, wanted) = match summation {
                        Summation::Coherent => ((re - a * phase.cos()).hypot(im - a * phase.sin()), a),
                        Summation::Incoherent => ((re - a * a).abs(), a * a),
                    };
                    assert!(off < 3e-4 * wanted + 1e-15, "case {case}, tile {tile}, cell {cell}: {off} of {wanted}");
                }
            }
        }
    }
    assert!(chained[0] > 50 && chained[1] > 200, "strips by themselves and in chains: {chained:?}");
}

#[test]
fn a_joint_that_is_dropped_from_a_tile_is_weak_in_all_of_it() {
    let (grid, mut rng, mut count) = (whole_box(), StdRng::seed_from_u64(12), [0; 2]);
    for _ in 0..40 {
        let joints: Vec<[f64; 14]> = (0..8).map(|_| joint(&mut rng, 0.5..9.0)).collect();
        let range = range(&joints);
        let least = (f64::from(range.cut) + range.log2) / LOG2_E;
        let mut tiles = Tiles::default();
        let _map = tiles.map(&Splats::from_numbers(&joints), &grid, Summation::Coherent);
        let mut from = 0;
        for (index, &to) in tiles.ends.iter().enumerate() {
            let strips = &tiles.strips[from..to as usize];
            from = to as usize;
            for tile in (0..BLOCK_TILES).map(|tile| index * BLOCK_TILES + tile) {
                let kept = |joint: usize| {
                    strips
                        .iter()
                        .any(|strip| strip.joint as usize == joint && strip.bits() >> (tile % BLOCK_TILES) & 1 == 1)
                };
                for cell in (0..TILE_CELLS).filter(|&cell| grid.target[tile][cell] >= 0.0) {
                    let at = joints.iter().map(|joint| returned(joint, bins_of(&grid, tile, cell))[0]);
                    let ln_a: Vec<f64> = at.collect();
                    let strongest = ln_a.iter().copied().fold(f64::MIN, f64::max);
                    for (joint, &ln_a) in ln_a.iter().enumerate() {
                        count[usize::from(kept(joint))] += 1;
                        let weak = ln_a < least + 1e-3 || ln_a < strongest - f64::from(range.relative) / LOG2_E + 1e-3;
                        assert!(kept(joint) || weak, "joint {joint} at e^{ln_a} of e^{strongest} in tile {tile}");
                    }
                }
            }
        }
    }
    assert!(count[0] > 10_000 && count[1] > 10_000, "dropped and kept: {count:?}");
}
