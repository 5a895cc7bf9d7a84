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

mod collect;
mod cull;
mod pairs;
mod sum;

use super::adjoint::Moments;
use super::em::{SOFT_FLOOR, ViewAnswer, share};
use super::lanes::{Lanes, splat};
use super::percentile::{between, place};
use super::simulate::EPSILON;
use super::splat::Splat;
use crate::config::Summation;
use pairs::{Pair, Pairs};
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

/// A float as an integer that sorts as it.
fn ordered(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 0 { bits | 0x8000_0000 } else { !bits }
}

fn unordered(key: u32) -> f32 {
    f32::from_bits(if key >> 31 == 1 { key & 0x7FFF_FFFF } else { !key })
}

impl Tiles {
    /// Parts of 16 numbers.
    const fn parts<S: Simd>() -> usize {
        CELLS / S::F32_LANES
    }
}
