//! Which joints matter to which tiles, and a guess of the threshold.

use super::{
    CELLS, Crest, Joint, LOG2_E, Lanes, Pairs, Question, REACH, RELATIVE, SIDE, Scale, Simd, Tiles, Tiling, lanes,
    ordered, place, splat, store, times, unordered,
};

/// A joint in a row of tile middles: exponent, slopes along and across.
struct Line<S: Simd> {
    top: Lanes<S>,
    half: Lanes<S>,
    /// The joint's ridge: the tile nearest to it, in bins, and from there to the tile's middle.
    nearest: Lanes<S>,
    rest: Lanes<S>,
    across: Lanes<S>,
    skew: Lanes<S>,
}

impl<S: Simd> Line<S> {
    #[inline(always)]
    fn new(simd: S, joint: &Joint, grid: &Tiling, [slice, row]: [usize; 2]) -> Self {
        let [middle_y, middle_x] = grid.middle(row, 0);
        let d0 = (grid.lo[0] + slice) as f64 - joint.bin[0];
        let [mut top, shift, across] = joint.row(d0, middle_y - joint.bin[1]);
        top += joint.outer.get(slice).copied().unwrap_or(0.0);
        let first = middle_x - joint.bin[2] + shift;
        let nearest = (first / SIDE as f64).round() * SIDE as f64;
        Self {
            top: splat(simd, (top + f64::from(joint.across.middle(row))) as f32),
            half: splat(simd, joint.half[2] as f32),
            nearest: splat(simd, nearest as f32),
            rest: splat(simd, (first - nearest) as f32),
            across: splat(simd, across as f32),
            skew: splat(simd, joint.skew[2] as f32),
        }
    }

    /// (exponent, slope along, slope across) at `bins` from the first tile's middle.
    #[inline(always)]
    fn at(&self, simd: S, bins: Lanes<S>) -> [Lanes<S>; 3] {
        // Both terms of the first sum are whole: x keeps its digits near the joint.
        let x = (bins + self.nearest) + self.rest;
        let bent = self.half * x;
        let along = bent * splat(simd, -2.0);
        let exponent = along.mul_add(x * splat(simd, 0.5), self.top);
        [exponent, along, along.mul_add(self.skew, self.across)]
    }
}

/// Bins from the first tile's middle to those of a group of 16.
fn group_bins(group: usize) -> [f32; CELLS] {
    std::array::from_fn(|i| ((group * CELLS + i) * SIDE) as f32)
}

impl Tiles {
    /// The strongest joint in every tile's middle; returns a guess of log₂ of the threshold.
    #[inline(always)]
    pub(super) fn crests<S: Simd>(&mut self, simd: S, question: &Question<'_>) -> f64 {
        let grid = question.tiling;
        self.crests.clear();
        self.ranked.clear();
        for slice in 0..grid.size[0] {
            for row in 0..grid.rows {
                for group in 0..grid.columns.div_ceil(CELLS) {
                    let mut crest =
                        Crest { exponent: [f32::MIN; CELLS], slope: [[0.0; CELLS]; 2], slack: [0.0; CELLS] };
                    let bins = group_bins(group);
                    for joint in &self.joints {
                        let line = Line::new(simd, joint, grid, [slice, row]);
                        let slack = splat(simd, joint.curvature + joint.across.most(row));
                        for part in 0..Self::parts::<S>() {
                            let [mut exponent, along, across] = line.at(simd, lanes(simd, &bins, part));
                            let mut slack = slack;
                            if let Some([middle, most]) = joint.along.group(group) {
                                exponent += lanes(simd, &middle, part);
                                slack += lanes(simd, &most, part);
                            }
                            let best = lanes(simd, &crest.exponent, part);
                            let news = [along, across, slack, exponent];
                            let Crest { slope: [a, b], slack, exponent: c } = &mut crest;
                            for (field, new) in [a, b, slack, c].into_iter().zip(news) {
                                let old = lanes(simd, field, part);
                                store(field, part, exponent.choose(best, new, old));
                            }
                        }
                    }
                    let here = grid.columns.saturating_sub(group * CELLS).min(CELLS);
                    self.ranked.extend(crest.exponent[..here].iter().map(|&x| ordered(x)));
                    self.crests.push(crest);
                }
            }
        }
        let Some(last) = self.ranked.len().checked_sub(1) else { return 0.0 };
        let (lower, _) = place(last, 100.0 - question.tau_pct);
        let (_, &mut key, _) = self.ranked.select_nth_unstable(lower);
        f64::from(unordered(key))
    }

    /// Lists the pairs of joints and tiles that matter.
    #[inline(always)]
    pub(super) fn cull<S: Simd>(&mut self, simd: S, grid: &Tiling, scale: &Scale) {
        let Self { joints, crests, pairs, lit, .. } = self;
        pairs.resize_with(joints.len(), Pairs::default);
        for pairs in pairs.iter_mut() {
            pairs.clear(grid.tiles());
        }
        lit.clear();
        lit.reserve_exact(grid.tiles());
        self.sloped.clear();
        self.sloped.reserve_exact(grid.tiles());
        let (reach, cut) = (splat(simd, REACH), splat(simd, scale.cut + scale.log2 as f32));
        let relative = splat(simd, (RELATIVE * LOG2_E) as f32);
        let groups = grid.columns.div_ceil(CELLS);
        for (index, crest) in crests.iter().enumerate() {
            let (group, line) = (index % groups, index / groups);
            let (slice, row) = (line / grid.rows, line % grid.rows);
            let here = grid.columns.saturating_sub(group * CELLS).min(CELLS);
            let bins = group_bins(group);
            let mut slots = [u32::MAX; CELLS];
            for (joint, pairs) in joints.iter().zip(pairs.iter_mut()) {
                let line = Line::new(simd, joint, grid, [slice, row]);
                // The ridge's height in the tile row, at most.
                let ridge = line.top.first() + REACH * line.across.first().abs();
                if ridge + joint.across.most(row) + joint.along.largest < cut.first() {
                    continue;
                }
                let [middle_y, middle_x] = grid.middle(row, 0);
                let (delta_y, delta_x) = ((middle_y - joint.bin[1]) as f32, (middle_x - joint.bin[2]) as f32);
                let d0 = (grid.lo[0] + slice) as f64 - joint.bin[0];
                let turn = times(joint.row_turn[row], [(joint.kappa[0] * d0).cos(), (joint.kappa[0] * d0).sin()]);
                let (mut spares, mut exponents, mut slopes) = ([0.0; CELLS], [0.0; CELLS], [[0.0; CELLS]; 2]);
                let mut any = false;
                for part in 0..Self::parts::<S>() {
                    let [mut exponent, along, across] = line.at(simd, lanes(simd, &bins, part));
                    let mut slack = splat(simd, joint.across.most(row));
                    if let Some([middle, most]) = joint.along.group(group) {
                        exponent += lanes(simd, &middle, part);
                        slack += lanes(simd, &most, part);
                    }
                    let highest = (along.abs() + across.abs()).mul_add(reach, exponent + slack);
                    let best_along = lanes(simd, &crest.slope[0], part);
                    let best_across = lanes(simd, &crest.slope[1], part);
                    let apart = (along - best_along).abs() + (across - best_across).abs();
                    let nearest = exponent - lanes(simd, &crest.exponent, part)
                        + slack
                        + lanes(simd, &crest.slack, part)
                        + relative;
                    let spare = (highest - cut).min(apart.mul_add(reach, nearest));
                    any |= spare.any_positive();
                    store(&mut spares, part, spare);
                    store(&mut exponents, part, exponent - splat(simd, scale.log2 as f32));
                    store(&mut slopes[0], part, across);
                    store(&mut slopes[1], part, along);
                }
                if !any {
                    continue;
                }
                let mut matters = spares[..here]
                    .iter()
                    .enumerate()
                    .fold(0_u32, |bits, (lane, &spare)| bits | u32::from(spare > 0.0) << lane);
                while matters != 0 {
                    let lane = matters.trailing_zeros() as usize;
                    matters &= matters - 1;
                    let column = group * CELLS + lane;
                    if slots[lane] == u32::MAX {
                        slots[lane] = lit.len() as u32;
                        lit.push(((slice * grid.rows + row) * grid.columns + column) as u32);
                    }
                    let pair = pairs.next();
                    pair.slot = slots[lane];
                    (pair.slice, pair.row, pair.column) = (slice as u32, row as u32, column as u32);
                    pair.exponent = exponents[lane];
                    pair.slope = [slopes[0][lane], slopes[1][lane]];
                    let [c, s] = times(joint.column_turn[column], turn);
                    pair.turn = [c as f32, s as f32];
                    pair.delta = [delta_y, delta_x + (column * SIDE) as f32];
                }
            }
        }
        let (cells, most) = (lit.len() * CELLS, grid.tiles() * CELLS);
        for field in [&mut self.re, &mut self.im, &mut self.h, &mut self.soft] {
            // Memory that is not touched costs nothing; growing later would.
            field.reserve_exact(most.saturating_sub(field.len()));
            field.resize(cells, 0.0);
        }
        self.ranked.clear();
        self.ranked.reserve_exact(most);
        self.re.fill(0.0);
        self.im.fill(0.0);
    }
}
