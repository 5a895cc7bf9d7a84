//! The fast path of L_EM: f32, in tiles of 4 × 4 cells, each summed over the joints that matter there.
//!
//! One view goes through five stages, none of which allocates once its buffers have grown:
//! 1. [`Joint`]: a splat in powers of two, its quadratic form and phase within a tile as tables.
//! 2. Cull: in the middle of every tile all joints' exponents; the strongest ones' percentile is a guess of the
//!    threshold. A joint is dropped where it is far below the soft mask's reach under that threshold, or far below the
//!    tile's strongest joint; bounds over the tile make this safe. What is left is a list of [`Pair`]s a joint.
//! 3. Sum: a pair costs one exponential and one complex product for 16 cells, relative to a scale of the whole view.
//! 4. Mask: percentile, soft mask, its slope. Where the threshold was guessed too high, back to 2 with a lower guess.
//! 5. Collect: the pairs once more, in the tiles where the mask has a slope, into each joint's moments.
//!
//! The answer depends on the parameters alone: what is kept from the last evaluation only speeds the percentile up.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::adjoint::Moments;
use super::em::{SOFT_FLOOR, ViewAnswer, share};
use super::lanes::{Lanes, splat};
use super::percentile::{between, place};
use super::simulate::EPSILON;
use super::splat::Splat;
use crate::config::Summation;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::LOG2_E;

const SIDE: usize = 4;
const CELLS: usize = SIDE * SIDE;
/// From a tile's middle to its outermost cells.
const REACH: f32 = 1.5;
/// Cells of a tile relative to its middle, along the last axis and the one before.
const ALONG: [f32; CELLS] = [-1.5, -0.5, 0.5, 1.5, -1.5, -0.5, 0.5, 1.5, -1.5, -0.5, 0.5, 1.5, -1.5, -0.5, 0.5, 1.5];
const ACROSS: [f32; CELLS] = [-1.5, -1.5, -1.5, -1.5, -0.5, -0.5, -0.5, -0.5, 0.5, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5, 1.5];
/// Softest mask, T, whose reach the powers of two of f32 hold; softer ones take the plain kernel.
const SOFTEST: f64 = 1.5;
/// Below e^−16T of the threshold a cell neither counts nor pulls (1e-7).
const MASK_REACH: f64 = 16.0;
/// A joint this much weaker (in ln) than the threshold is dropped, and at least `MARGIN` under the weakest cell that counts.
const BELOW: f64 = 16.0;
const MARGIN: f64 = 3.0;
/// The guess of ln threshold may be this much too high.
const GUESS: f64 = 3.0;
/// And this much too low: beyond it the strongest returns would leave f32's range.
const HIGH: f64 = 12.0;
/// Guesses of the threshold at most.
const TRIES: usize = 40;
/// A joint this much weaker (in ln) than the strongest at its cells is dropped (8e-7).
const RELATIVE: f64 = 14.0;
/// ln of the weakest return relative to the view's scale: its square is still a normal f32.
const WEAKEST: f64 = -42.0;
/// log₂ of the strongest return relative to the view's scale; what is stronger is far above any threshold.
const STRONGEST: f32 = 54.0;
/// m(1 − m) below which a tile has no slope.
const NO_SLOPE: f32 = 1e-7;

/// A box of cells in tiles, and B_ori over it: fixed for a fit.
#[derive(Debug, Clone)]
pub(super) struct Tiling {
    /// First bin of the last three axes (outermost first; missing axes have one bin, 0).
    lo: [usize; 3],
    size: [usize; 3],
    /// Tiles across and along.
    rows: usize,
    columns: usize,
    /// 16 numbers a tile: B_ori as 0 or 1, −1 where the tile reaches beyond the box.
    target: Vec<f32>,
    cells: usize,
    marked: usize,
}

impl Tiling {
    /// Cuts the box `bins` ([lo, hi) per axis), with B_ori in C order.
    pub(super) fn new(bins: &[[usize; 2]], ori: &[bool]) -> Self {
        let (mut lo, mut size) = ([0; 3], [1; 3]);
        for (k, &[from, to]) in bins.iter().rev().take(3).enumerate() {
            (lo[2 - k], size[2 - k]) = (from, to.saturating_sub(from));
        }
        let (rows, columns) = (size[1].div_ceil(SIDE), size[2].div_ceil(SIDE));
        let mut target = vec![-1.0; size[0] * rows * columns * CELLS];
        for (cell, &ori) in ori.iter().enumerate() {
            let (x, y, z) = (cell % size[2], cell / size[2] % size[1], cell / (size[2] * size[1]));
            let tile = (z * rows + y / SIDE) * columns + x / SIDE;
            target[tile * CELLS + y % SIDE * SIDE + x % SIDE] = f32::from(u8::from(ori));
        }
        let marked = ori.iter().filter(|&&b| b).count();
        Self { lo, size, rows, columns, target, cells: ori.len(), marked }
    }

    fn tiles(&self) -> usize {
        self.size[0] * self.rows * self.columns
    }

    /// Bin of a tile's middle.
    fn middle(&self, row: usize, column: usize) -> [f64; 2] {
        let half = (SIDE - 1) as f64 * 0.5;
        [(self.lo[1] + SIDE * row) as f64 + half, (self.lo[2] + SIDE * column) as f64 + half]
    }
}

/// The spectrum of ω along a Doppler axis, a tile: what it is in the middle, how far its bins lie from that, and those
/// distances a cell.
#[derive(Debug, Default)]
struct Spectrum {
    /// Largest of all its bins; 0 where the axis is no Doppler axis.
    largest: f32,
    middle: Vec<f32>,
    most: Vec<f32>,
    cells: Vec<[f32; CELLS]>,
}

impl Spectrum {
    /// `ln` is the spectrum of the whole axis; `lane` picks the bin of a tile that a cell lies in.
    fn fill(&mut self, ln: &[f64], lo: usize, tiles: usize, lane: impl Fn(usize) -> usize) {
        self.middle.clear();
        self.most.clear();
        self.cells.clear();
        self.largest = if ln.is_empty() { 0.0 } else { (LOG2_E * ln.iter().copied().fold(f64::MIN, f64::max)) as f32 };
        if ln.is_empty() {
            return;
        }
        for tile in 0..tiles {
            let bins: [f64; SIDE] =
                std::array::from_fn(|i| LOG2_E * ln.get(lo + tile * SIDE + i).copied().unwrap_or(0.0));
            let (low, high) = bins.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
            let middle = f64::midpoint(low, high);
            self.middle.push(middle as f32);
            self.most.push((0.5 * (high - low)) as f32);
            self.cells.push(std::array::from_fn(|cell| (bins[lane(cell)] - middle) as f32));
        }
    }

    fn middle(&self, tile: usize) -> f32 {
        self.middle.get(tile).copied().unwrap_or(0.0)
    }

    fn most(&self, tile: usize) -> f32 {
        self.most.get(tile).copied().unwrap_or(0.0)
    }

    /// Middles and distances of 16 tiles; `None` where the axis is no Doppler axis.
    fn group(&self, group: usize) -> Option<[[f32; CELLS]; 2]> {
        let of = |f: fn(&Self, usize) -> f32| std::array::from_fn(|i| f(self, group * CELLS + i));
        (!self.middle.is_empty()).then(|| [of(Self::middle), of(Self::most)])
    }
}

/// A splat in powers of two. Its exponent is −(h₀ d₀² + h₁ (d₁ + k₁₀ d₀)² + h₂ (d₂ + k₂₁ d₁ + k₂₀ d₀)²), the squares
/// completed from the last axis on, so that elongated Gaussians keep their digits.
#[derive(Debug, Default)]
struct Joint {
    bin: [f64; 3],
    /// log₂ of amplitude times norm.
    top: f64,
    half: [f64; 3],
    /// k₁₀, k₂₀, k₂₁
    skew: [f64; 3],
    /// Largest fall of the exponent from the middle of a tile to its corner by curvature alone.
    curvature: f32,
    phase: f64,
    kappa: [f64; 3],
    /// Within a tile: the quadratic form, and e^{iκΔ}.
    quadratic: [f32; CELLS],
    turn: [[f32; CELLS]; 2],
    /// e^{iκΔ} a tile column from the joint on; e^{i(φ + κΔ)} a tile row.
    column_turn: Vec<[f64; 2]>,
    row_turn: Vec<[f64; 2]>,
    along: Spectrum,
    across: Spectrum,
    /// The spectrum a slice of the outermost of three axes; empty where that is no Doppler axis.
    outer: Vec<f64>,
}

impl Joint {
    fn fill(&mut self, splat: &Splat, grid: &Tiling) {
        let missing = 3 - splat.dims;
        let at = |k: usize| k.checked_sub(missing);
        let p = |k: usize, l: usize| match (at(k), at(l)) {
            (Some(k), Some(l)) => splat.precision[k][l],
            _ => f64::from(u8::from(k == l)),
        };
        self.bin = std::array::from_fn(|k| at(k).map_or(0.0, |k| splat.bin[k]));
        self.kappa = std::array::from_fn(|k| at(k).map_or(0.0, |k| splat.kappa[k]));
        (self.phase, self.top) = (splat.phase, splat.ln_weight * LOG2_E);
        let (k20, k21) = (p(2, 0) / p(2, 2), p(2, 1) / p(2, 2));
        let s = |k: usize, l: usize| p(k, l) - p(k, 2) * p(2, l) / p(2, 2);
        let k10 = s(1, 0) / s(1, 1);
        self.half = [s(0, 0) - s(0, 1) * s(1, 0) / s(1, 1), s(1, 1), p(2, 2)].map(|h| 0.5 * LOG2_E * h);
        self.skew = [k10, k20, k21];
        let reach = f64::from(REACH);
        self.curvature = (self.half[1] * reach.powi(2) + self.half[2] * (reach * (1.0 + k21.abs())).powi(2)) as f32;
        for (cell, (&x, &y)) in ALONG.iter().zip(&ACROSS).enumerate() {
            let (x, y) = (f64::from(x), f64::from(y));
            self.quadratic[cell] = -(self.half[1] * y * y + self.half[2] * (x + k21 * y).powi(2)) as f32;
        }
        let step = |kappa: f64| [(0.5 * kappa).cos(), (0.5 * kappa).sin()];
        let (x, y) = (step(self.kappa[2]), step(self.kappa[1]));
        let odd = |[c, s]: [f64; 2]| {
            let half = [c, s];
            let three = times(times(half, half), half);
            [conjugate(three), conjugate(half), half, three]
        };
        let (x, y) = (odd(x), odd(y));
        for cell in 0..CELLS {
            let [c, s] = times(x[cell % SIDE], y[cell / SIDE]);
            (self.turn[0][cell], self.turn[1][cell]) = (c as f32, s as f32);
        }
        let [middle_y, middle_x] = grid.middle(0, 0);
        turns(&mut self.column_turn, 0.0, self.kappa[2], middle_x - self.bin[2], grid.columns);
        turns(&mut self.row_turn, self.phase, self.kappa[1], middle_y - self.bin[1], grid.rows);
        let spectrum = |k: usize| at(k).map_or(&[] as &[f64], |k| splat.spectrum[k].as_slice());
        self.along.fill(spectrum(2), grid.lo[2], grid.columns, |cell| cell % SIDE);
        self.across.fill(spectrum(1), grid.lo[1], grid.rows, |cell| cell / SIDE);
        let slices = spectrum(0).iter().skip(grid.lo[0]).take(grid.size[0]);
        self.outer.clear();
        self.outer.extend(slices.map(|ln| LOG2_E * ln));
    }

    /// log₂ at d₂ + … = 0 in a tile row, the offset of d₂ there, and the slope by d₁ of the rest.
    fn row(&self, d0: f64, d1: f64) -> [f64; 3] {
        let [k10, k20, k21] = self.skew;
        let y = d1 + k10 * d0;
        let top = self.top - self.half[0] * d0 * d0 - self.half[1] * y * y;
        [top, k21 * d1 + k20 * d0, -2.0 * self.half[1] * y]
    }

    fn is_finite(&self) -> bool {
        let own = [self.top, self.phase];
        own.iter().chain(&self.half).chain(&self.skew).chain(&self.bin).chain(&self.kappa).all(|x| x.is_finite())
    }
}

fn times([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a * c - b * d, a * d + b * c]
}

fn conjugate([a, b]: [f64; 2]) -> [f64; 2] {
    [a, -b]
}

/// e^{i(φ + κ(Δ + 4k))} for k tiles.
fn turns(out: &mut Vec<[f64; 2]>, phase: f64, kappa: f64, delta: f64, tiles: usize) {
    let start = phase + kappa * delta;
    let (mut now, step) = ([start.cos(), start.sin()], kappa * SIDE as f64);
    let step = [step.cos(), step.sin()];
    out.clear();
    for _ in 0..tiles {
        out.push(now);
        now = times(now, step);
    }
}

/// A joint in a tile that it matters to.
#[derive(Debug, Clone, Copy, Default)]
struct Pair {
    /// Place in the list of tiles that are summed.
    slot: u32,
    slice: u32,
    row: u32,
    column: u32,
    /// log₂ in the tile's middle relative to the view's scale, and its slopes.
    exponent: f32,
    slope: [f32; 2],
    /// e^{i…} in the middle.
    turn: [f32; 2],
    /// Middle minus joint, bins: across, along.
    delta: [f32; 2],
}

/// The strongest joint in the middle of a tile.
#[derive(Debug, Clone, Copy)]
struct Crest {
    exponent: [f32; CELLS],
    slope: [[f32; CELLS]; 2],
    slack: [f32; CELLS],
}

/// Buffers of one view.
#[derive(Debug, Default)]
pub(super) struct Tiles {
    joints: Vec<Joint>,
    /// Sixteen tile columns at a time.
    crests: Vec<Crest>,
    pairs: Vec<Pairs>,
    /// Tiles that are summed, ascending.
    lit: Vec<u32>,
    /// Re and Im of the sum over joints, 16 a tile that is summed (Σ(AK)² where the sum is incoherent); later times w/|S|².
    re: Vec<f32>,
    im: Vec<f32>,
    /// H relative to the scale; −1 beyond the box.
    h: Vec<f32>,
    /// m(1 − m)/|S|² · d ln(H + h)/d ln|S|.
    soft: Vec<f32>,
    /// Whether the mask has a slope in a tile.
    sloped: Vec<bool>,
    /// Scratch of percentiles.
    ranked: Vec<u32>,
    /// log₂ of the last threshold: where the percentile is looked for first.
    last: Option<f64>,
}

/// What one view asks.
pub(super) struct Question<'a> {
    pub splats: &'a [Splat],
    pub tiling: &'a Tiling,
    pub summation: Summation,
    pub tau_pct: f64,
    pub softness: f64,
    /// Factor of the gradient; `None` where none is wanted.
    pub scale: Option<f64>,
}

/// Whether f32 reaches as far as a soft mask of this temperature.
pub(super) fn reaches(softness: f64) -> bool {
    softness <= SOFTEST
}

/// The instruction set that the tiles run on here.
pub fn simd_path() -> &'static str {
    struct Name;
    impl WithSimd for Name {
        type Output = usize;
        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F32_LANES
        }
    }
    match (cfg!(target_arch = "x86_64"), Arch::new().dispatch(Name)) {
        (true, 16) => "avx512",
        (true, 8) => "avx2+fma",
        (false, 4) => "simd128",
        _ => "scalar",
    }
}

impl Tiles {
    /// Answers `question`, and fills `moments` (one a joint, zeroed) where a gradient is wanted.
    pub(super) fn evaluate(&mut self, question: &Question<'_>, moments: &mut [Moments]) -> ViewAnswer {
        self.joints.resize_with(question.splats.len(), Joint::default);
        for (joint, splat) in self.joints.iter_mut().zip(question.splats) {
            joint.fill(splat, question.tiling);
        }
        if !self.joints.iter().all(Joint::is_finite) {
            return ViewAnswer { loss: f64::NAN, iou: None };
        }
        match question.summation {
            Summation::Coherent => Arch::new().dispatch(Run::<true> { tiles: self, question, moments }),
            Summation::Incoherent => Arch::new().dispatch(Run::<false> { tiles: self, question, moments }),
        }
    }
}

struct Run<'a, const COHERENT: bool> {
    tiles: &'a mut Tiles,
    question: &'a Question<'a>,
    moments: &'a mut [Moments],
}

impl<const COHERENT: bool> WithSimd for Run<'_, COHERENT> {
    type Output = ViewAnswer;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> ViewAnswer {
        let Self { tiles, question, moments } = self;
        let floor = EPSILON.log2();
        let mut guess = tiles.crests(simd, question).max(floor);
        let mut tries = 0..TRIES;
        loop {
            let scale = Scale::new(guess, question.softness);
            tiles.cull(simd, question.tiling, &scale);
            tiles.sum::<S, COHERENT>(simd);
            let threshold = tiles.threshold::<S, COHERENT>(simd, question, &scale);
            let low = guess > floor && threshold.log2 < guess - GUESS * LOG2_E;
            let high = threshold.log2 > guess + HIGH * LOG2_E;
            if (low || high) && tries.next().is_some() {
                guess = if threshold.among_lit { threshold.log2 } else { guess - 30.0 }.max(floor);
                continue;
            }
            tiles.last = Some(threshold.log2);
            let mask = tiles.mask::<S, COHERENT>(simd, question, &scale, &threshold);
            if let Some(factor) = question.scale
                && mask.union > 0.0
            {
                tiles.weigh::<S, COHERENT>(simd, question, &mask, factor / question.softness);
                tiles.collect::<S, COHERENT>(simd, question.tiling, moments);
            }
            return mask.answer();
        }
    }
}

/// Where f32's range lies in this view.
struct Scale {
    /// log₂ of what 1 stands for.
    log2: f64,
    /// log₂ relative to it below which nothing counts.
    cut: f32,
    /// ε and h of SPEC section 3 and 4 relative to it.
    epsilon_sq: f32,
    soft_floor: f32,
}

impl Scale {
    fn new(guess: f64, softness: f64) -> Self {
        let below = ((MASK_REACH * softness + MARGIN).max(BELOW) + GUESS) * LOG2_E;
        let log2 = guess - below - WEAKEST * LOG2_E;
        let epsilon = (EPSILON.log2() - log2).exp2();
        let soft_floor = (SOFT_FLOOR.log2() - log2).exp2() as f32;
        Self { log2, cut: (WEAKEST * LOG2_E) as f32, epsilon_sq: (epsilon * epsilon) as f32, soft_floor }
    }
}

struct Threshold {
    /// The order statistic at or below it, relative to the scale: H > threshold means H > this.
    lower: f32,
    /// Relative to the scale.
    value: f64,
    log2: f64,
    among_lit: bool,
}

#[derive(Default)]
struct Mask {
    common: f64,
    union: f64,
    both: usize,
    either: usize,
}

impl Mask {
    fn answer(&self) -> ViewAnswer {
        let loss = if self.union == 0.0 { 1.0 } else { 1.0 - self.common / self.union };
        ViewAnswer { loss, iou: share(self.both, self.either) }
    }
}

#[inline(always)]
fn lanes<S: Simd>(simd: S, of: &[f32], part: usize) -> Lanes<S> {
    Lanes::new(simd, S::as_simd_f32s(of).0[part])
}

#[inline(always)]
fn store<S: Simd>(into: &mut [f32], part: usize, x: Lanes<S>) {
    S::as_mut_simd_f32s(into).0[part] = x.value;
}

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
    /// Parts of 16 numbers.
    const fn parts<S: Simd>() -> usize {
        CELLS / S::F32_LANES
    }

    /// The strongest joint in every tile's middle; returns a guess of log₂ of the threshold.
    #[inline(always)]
    fn crests<S: Simd>(&mut self, simd: S, question: &Question<'_>) -> f64 {
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
    fn cull<S: Simd>(&mut self, simd: S, grid: &Tiling, scale: &Scale) {
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

    /// Adds every pair's return to its tile.
    #[inline(always)]
    fn sum<S: Simd, const COHERENT: bool>(&mut self, simd: S) {
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
    fn threshold<S: Simd, const COHERENT: bool>(
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
    fn mask<S: Simd, const COHERENT: bool>(
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
    fn weigh<S: Simd, const COHERENT: bool>(&mut self, simd: S, question: &Question<'_>, mask: &Mask, factor: f64) {
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

    /// Adds to each joint's moments what the cells want.
    #[inline(always)]
    fn collect<S: Simd, const COHERENT: bool>(&self, simd: S, grid: &Tiling, moments: &mut [Moments]) {
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

/// The pairs of one joint.
#[derive(Debug, Default)]
struct Pairs {
    /// Those in use, then those of evaluations before: a place that is written to field by field costs no copy.
    all: Vec<Pair>,
    used: usize,
}

impl Pairs {
    /// Forgets them; `most` is the number of tiles that there are.
    fn clear(&mut self, most: usize) {
        // Room to grow, for the number drifts while a fit moves. Memory that is not touched costs nothing.
        if self.all.capacity() < most.min(self.used + self.used / 2 + 16) {
            self.all.reserve_exact(most.min(4 * self.used + 1024).saturating_sub(self.all.len()));
        }
        self.used = 0;
    }

    fn list(&self) -> &[Pair] {
        &self.all[..self.used]
    }

    fn next(&mut self) -> &mut Pair {
        if self.used == self.all.len() {
            self.all.push(Pair::default());
        }
        self.used += 1;
        &mut self.all[self.used - 1]
    }
}

impl Pair {
    /// A K of some of the tile's cells and its unit phase (Re, Im; nothing where the sum is incoherent).
    #[inline(always)]
    fn at<S: Simd, const COHERENT: bool>(&self, simd: S, joint: &Joint, part: usize) -> [Lanes<S>; 3] {
        let [across, along] = self.slope;
        let bent = lanes(simd, &joint.quadratic, part) + splat(simd, self.exponent);
        let mut exponent = lanes(simd, &ALONG, part).mul_add(splat(simd, along), bent);
        exponent = lanes(simd, &ACROSS, part).mul_add(splat(simd, across), exponent);
        if let Some(spectrum) = joint.along.cells.get(self.column as usize) {
            exponent += lanes(simd, spectrum, part);
        }
        if let Some(spectrum) = joint.across.cells.get(self.row as usize) {
            exponent += lanes(simd, spectrum, part);
        }
        let a = exponent.max(splat(simd, -126.0)).min(splat(simd, STRONGEST)).exp2();
        if !COHERENT {
            return [a, splat(simd, 0.0), splat(simd, 0.0)];
        }
        let (c, s) = (splat(simd, self.turn[0]), splat(simd, self.turn[1]));
        let (re, im) = (lanes(simd, &joint.turn[0], part), lanes(simd, &joint.turn[1], part));
        [a, c * re - s * im, c.mul_add(im, s * re)]
    }
}

/// A float as an integer that sorts as it.
fn ordered(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 0 { bits | 0x8000_0000 } else { !bits }
}

fn unordered(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 { key & 0x7FFF_FFFF } else { !key })
}
