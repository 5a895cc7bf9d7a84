//! Levels of views with two axes whose powers add: rows of cells, each joint or point of skin in those that it reaches.
//!
//! Tiles (`tiles/mod.rs`) are made for masks, whose threshold lies far below the noise, and for joints that interfere. Where levels
//! are compared, nothing matters that is nothing beside the noise: a body's points are small then, some fifteen rows of thirty
//! cells, and what would be spent on sorting out tiles is more than their sum. Here a point goes through its rows, a register of
//! cells at a time; what it returns there is kept for the way back.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

mod aligned;
mod point;

use super::adjoint::Moments;
use super::floors::ViewLoss;
use super::lanes::{Lanes, splat};
use super::levels::{LevelTotals, REGULARISER};
use super::percentile::place;
use super::splat::Splats;
use crate::config::EmLoss;
use aligned::AlignedF32s;
use point::{LOWERED, Reach, RowPoint, SLOPE_UNIT};
use pulp::{Arch, Simd, WithSimd};
use std::f32::consts::LN_2;
use std::f64::consts::{LOG2_E, PI};
use std::iter::zip;
use std::ops::Range;

/// Cells of the widest register: rows are padded to whole ones.
const LANES: usize = 16;
/// log₂ below which a power is nothing in single precision.
const FAINTEST_LOG2: f64 = -52.0;
/// How much larger the gain may be than was guessed, and how often it is guessed.
const GAIN_STEP: f64 = 2.0;
const GAIN_GUESSES: usize = 24;

/// What is measured over a region, in padded rows: as in `Levels`, 0 beyond the region.
#[derive(Debug, Clone, Default)]
pub(super) struct LevelRows {
    lo: [usize; 2],
    size: [usize; 2],
    stride: usize,
    measured: AlignedF32s,
    by_noise: AlignedF32s,
    base: AlignedF32s,
    /// B_ori, 1 or 0.
    marked: AlignedF32s,
    /// Where cells are erased, ascending: they are as those beyond the region.
    erased: Vec<u32>,
}

/// Scratch of an evaluation.
#[derive(Debug, Default)]
pub(super) struct RowScratch {
    points: Vec<RowPoint>,
    /// Where each point reaches, and what is kept of what it returns there.
    reaches: Vec<Reach>,
    kept: AlignedF32s,
    /// The cells of the rows that something reaches: whole registers.
    lit: Range<usize>,
    power: AlignedF32s,
    /// ∂L/∂(g S), and then what a joint's return is to be multiplied by.
    slopes: AlignedF32s,
    ranked: Vec<u32>,
}

/// One evaluation, as it is asked for.
pub(super) struct RowQuery<'a> {
    pub(super) splats: &'a Splats,
    pub(super) rows: &'a LevelRows,
    pub(super) totals: &'a LevelTotals,
    /// A return below this share of the noise is left out.
    pub(super) least: f64,
    /// Factor of the gradient; `None` where none is wanted.
    pub(super) factor: Option<f64>,
    /// Where the IoU of masks of this share, percent, is asked for.
    pub(super) tau_pct: Option<f64>,
}

impl LevelRows {
    /// Of these numbers a cell of the box `bins`, C order; where not all take part, `there` says which do. `None` unless it has
    /// two axes.
    pub(super) fn new(
        bins: &[[usize; 2]],
        (marked, there): (&[bool], Option<&[bool]>),
        values: [&[f64]; 3],
    ) -> Option<Self> {
        let [rows, columns] = bins else { return None };
        let (lo, size) = ([rows[0], columns[0]], [rows[1] - rows[0], columns[1] - columns[0]]);
        let stride = size[1].div_ceil(LANES) * LANES;
        let padded = |of: &dyn Fn(usize) -> f32| {
            let mut padded = AlignedF32s::zeros(size[0] * stride);
            for (row, to) in padded.chunks_exact_mut(stride.max(1)).enumerate() {
                for (column, to) in to[..size[1]].iter_mut().enumerate() {
                    *to = of(row * size[1] + column);
                }
            }
            padded
        };
        let [measured, by_noise, base] = values.map(|values| padded(&|cell| values[cell] as f32));
        let marked = padded(&|cell| f32::from(u8::from(marked[cell])));
        let gone = there.map(|there| padded(&|cell| f32::from(u8::from(!there[cell])))).unwrap_or_default();
        let erased = (0..gone.len() as u32).filter(|&cell| gone[cell as usize] > 0.5).collect();
        Some(Self { lo, size, stride, measured, by_noise, base, marked, erased })
    }

    /// Nothing is in what is erased, nor in what of these cells, whole rows, lies beyond the region.
    #[inline(always)]
    fn blank(&self, cells: &mut [f32], lit: &Range<usize>) {
        for row in cells[lit.clone()].chunks_exact_mut(self.stride.max(1)) {
            row[self.size[1]..].iter_mut().for_each(|cell| *cell = 0.0);
        }
        for &cell in &self.erased {
            cells[cell as usize] = 0.0;
        }
    }
}

impl RowScratch {
    /// Answers `query`, and adds to `moments` where a gradient is wanted. The IoU is `None` also where the mask's threshold lies
    /// among cells that nothing was summed in; the flag beside it tells.
    pub(super) fn evaluate(&mut self, query: &RowQuery<'_>, moments: &mut Moments) -> (ViewLoss, bool) {
        Arch::new().dispatch(Evaluate { scratch: self, query, moments })
    }
}

struct Evaluate<'a> {
    scratch: &'a mut RowScratch,
    query: &'a RowQuery<'a>,
    moments: &'a mut Moments,
}

impl WithSimd for Evaluate<'_> {
    type Output = (ViewLoss, bool);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (ViewLoss, bool) {
        let Self { scratch, query, moments } = self;
        let (rows, totals) = (query.rows, query.totals);
        let Some(unit_log2) = scratch.fill(query.splats) else {
            return (ViewLoss { loss: f64::NAN, iou: None }, true);
        };
        // Σ over a plane without bounds, the points apart from each other, is the guess.
        let everywhere =
            scratch.points.iter().map(|of| of.top.exp2() / (of.weight[0] * of.weight[1]).sqrt()).sum::<f64>();
        let strongest = unit_log2.exp2();
        let mut gain = totals.gain(everywhere * PI * strongest);
        // Of powers as they are summed.
        let unit = strongest * LOWERED;
        let mut tries = 0..GAIN_GUESSES;
        let sum = loop {
            let cut = ((totals.noise * query.least / gain).log2() - unit_log2).max(FAINTEST_LOG2);
            scratch.sum(simd, rows, cut);
            let sum = scratch.total(simd);
            let found = totals.gain(sum * unit);
            if found > GAIN_STEP * gain && cut > FAINTEST_LOG2 && tries.next().is_some() {
                gain = found;
                continue;
            }
            gain = found;
            break sum;
        };
        let nobody = sum * unit < REGULARISER;
        if nobody {
            // What is summed is what rounding leaves.
            scratch.power.fill(0.0);
        }
        let scaled = (gain * unit) as f32;
        let (loss, through_gain) = match totals.kind {
            EmLoss::Gamma => scratch.divergences(simd, (rows, totals), scaled),
            EmLoss::Iou | EmLoss::NccDb => scratch.correlations(simd, (rows, totals), scaled),
        };
        let (iou, among) = query.tau_pct.map_or((None, true), |tau_pct| scratch.iou(rows, tau_pct));
        if let (Some(factor), false) = (query.factor, nobody) {
            let by_power = 1.0 / (gain * (sum * unit + REGULARISER));
            let factor = 2.0 * factor * gain * strongest * SLOPE_UNIT;
            scratch.weigh(simd, rows, [factor as f32, (through_gain * by_power) as f32]);
            let (kept, _) = S::as_simd_f32s(&scratch.kept);
            let (slopes, _) = S::as_simd_f32s(&scratch.slopes);
            for (joint, (point, reach)) in zip(&scratch.points, &scratch.reaches).enumerate() {
                moments.add(joint, &point.collect(simd, (rows, reach), (kept, slopes)));
            }
        }
        (ViewLoss { loss, iou }, among)
    }
}

impl RowScratch {
    /// Takes the splats in; the unit of powers, log₂, or `None` where a number is not finite.
    fn fill(&mut self, splats: &Splats) -> Option<f64> {
        self.points.clear();
        let mut strongest = f64::NEG_INFINITY;
        for of in splats.iter() {
            let point = RowPoint {
                bin: [of.bin[1], of.bin[2]],
                weight: [of.weight[1] * LOG2_E, of.weight[2] * LOG2_E],
                skew: of.skew[2],
                top: 2.0 * of.ln_weight * LOG2_E,
            };
            let numbers = [point.bin[0], point.bin[1], point.weight[0], point.weight[1], point.skew, point.top];
            if !numbers.iter().all(|x| x.is_finite()) {
                return None;
            }
            strongest = strongest.max(point.top);
            self.points.push(point);
        }
        self.points.iter_mut().for_each(|point| point.top -= strongest);
        // Weights are those of log₂: a plane's sum is over them in ln.
        strongest.is_finite().then_some(strongest)
    }

    /// Σ (AK)² of every cell.
    #[inline(always)]
    fn sum<S: Simd>(&mut self, simd: S, rows: &LevelRows, cut: f64) {
        self.power.reset(rows.size[0] * rows.stride);
        let Self { points, reaches, kept, lit, power, .. } = self;
        reaches.clear();
        let mut registers = 0;
        let mut lit_rows = (rows.size[0], 0);
        for point in points.iter() {
            let reach = point.reach(rows, cut, registers);
            registers += reach.registers_kept::<S>();
            if !reach.is_empty() {
                lit_rows = (lit_rows.0.min(reach.rows.0), lit_rows.1.max(reach.rows.1));
            }
            reaches.push(reach);
        }
        *lit = lit_rows.0.min(lit_rows.1) * rows.stride..lit_rows.1 * rows.stride;
        if kept.len() < registers * S::F32_LANES {
            kept.hold(registers * S::F32_LANES);
        }
        let ((kept, _), (power, _)) = (S::as_mut_simd_f32s(kept), S::as_mut_simd_f32s(power));
        for (point, reach) in zip(points, reaches) {
            point.spread(simd, (rows, reach), (&mut *kept, &mut *power));
        }
        rows.blank(&mut self.power, &self.lit);
    }

    /// Σ of all powers.
    #[inline(always)]
    fn total<S: Simd>(&self, simd: S) -> f64 {
        let mut total = 0.0;
        for few in self.power[self.lit.clone()].chunks(32 * LANES) {
            let (cells, _) = S::as_simd_f32s(few);
            let mut sum = splat(simd, 0.0);
            for &cell in cells {
                sum += Lanes::new(simd, cell);
            }
            total += f64::from(sum.reduce_sum());
        }
        total
    }

    /// `ncc_db`, ∂L/∂(g S) of each cell into `slopes`, and Σ of its product with g S.
    #[inline(always)]
    fn correlations<S: Simd>(&mut self, simd: S, (rows, totals): (&LevelRows, &LevelTotals), gain: f32) -> (f64, f64) {
        self.slopes.hold(self.power.len());
        let (gain, one) = (splat(simd, gain), splat(simd, 1.0));
        let mut sums = [0.0; 3];
        let chunk = 32 * LANES;
        for at in self.lit.clone().step_by(chunk) {
            let end = (at + chunk).min(self.lit.end);
            let [power, by_noise] = [&self.power[at..end], &rows.by_noise[at..end]].map(|x| S::as_simd_f32s(x).0);
            let [measured, base] = [&rows.measured[at..end], &rows.base[at..end]].map(|x| S::as_simd_f32s(x).0);
            let (levels, _) = S::as_mut_simd_f32s(&mut self.slopes[at..end]);
            let [mut d_sum, mut a_sum, mut d_d_sum] = [splat(simd, 0.0); 3];
            for k in 0..power.len() {
                let above = Lanes::new(simd, power[k]) * gain * Lanes::new(simd, by_noise[k]);
                let d = ln_1p(simd, above);
                levels[k] = d.value;
                let base = Lanes::new(simd, base[k]);
                d_sum += d;
                a_sum = d.mul_add(Lanes::new(simd, measured[k]), a_sum);
                d_d_sum = (base + base + d).mul_add(d, d_d_sum);
            }
            for (sum, of) in sums.iter_mut().zip([d_sum, a_sum, d_d_sum]) {
                *sum += f64::from(of.reduce_sum());
            }
        }
        let found = totals.correlation(sums);
        let by_measured = splat(simd, found.by_measured as f32);
        let (by_level, mean) = (splat(simd, found.by_level as f32), splat(simd, found.mean as f32));
        let mut product = 0.0;
        for at in self.lit.clone().step_by(chunk) {
            let end = (at + chunk).min(self.lit.end);
            let [power, by_noise] = [&self.power[at..end], &rows.by_noise[at..end]].map(|x| S::as_simd_f32s(x).0);
            let [measured, base] = [&rows.measured[at..end], &rows.base[at..end]].map(|x| S::as_simd_f32s(x).0);
            let (slopes, _) = S::as_mut_simd_f32s(&mut self.slopes[at..end]);
            let mut sum = splat(simd, 0.0);
            for k in 0..power.len() {
                let (power, by_noise) = (Lanes::new(simd, power[k]) * gain, Lanes::new(simd, by_noise[k]));
                let level = Lanes::new(simd, base[k]) + Lanes::new(simd, slopes[k]) - mean;
                let by_d = Lanes::new(simd, measured[k]).mul_add(by_measured, level * by_level);
                let slope = by_d * by_noise / power.mul_add(by_noise, one);
                slopes[k] = slope.value;
                sum = slope.mul_add(power, sum);
            }
            product += f64::from(sum.reduce_sum());
        }
        (found.loss, product)
    }

    /// `gamma`, and the same of it.
    #[inline(always)]
    fn divergences<S: Simd>(&mut self, simd: S, (rows, totals): (&LevelRows, &LevelTotals), gain: f32) -> (f64, f64) {
        self.slopes.hold(self.power.len());
        let (gain, one) = (splat(simd, gain), splat(simd, 1.0));
        let by_count = splat(simd, (1.0 / totals.count) as f32);
        let (mut loss, mut product) = (0.0, 0.0);
        let chunk = 32 * LANES;
        for at in self.lit.clone().step_by(chunk) {
            let end = (at + chunk).min(self.lit.end);
            let [power, by_noise] = [&self.power[at..end], &rows.by_noise[at..end]].map(|x| S::as_simd_f32s(x).0);
            let (measured, _) = S::as_simd_f32s(&rows.measured[at..end]);
            let (slopes, _) = S::as_mut_simd_f32s(&mut self.slopes[at..end]);
            let [mut sum, mut product_sum] = [splat(simd, 0.0); 2];
            for k in 0..power.len() {
                let (power, by_noise) = (Lanes::new(simd, power[k]) * gain, Lanes::new(simd, by_noise[k]));
                let (y, i) = (power * by_noise, Lanes::new(simd, measured[k]));
                let m = one / (y + one);
                let slope = by_noise * m * i.neg_mul_add(m, one) * by_count;
                slopes[k] = slope.value;
                sum += (i * y).neg_mul_add(m, ln_1p(simd, y));
                product_sum = slope.mul_add(power, product_sum);
            }
            loss += f64::from(sum.reduce_sum());
            product += f64::from(product_sum.reduce_sum());
        }
        (totals.idle + loss / totals.count, product)
    }

    /// From ∂L/∂(g S) to what a return is to be multiplied by.
    #[inline(always)]
    fn weigh<S: Simd>(&mut self, simd: S, rows: &LevelRows, [factor, through_gain]: [f32; 2]) {
        let (factor, through_gain) = (splat(simd, factor), splat(simd, through_gain));
        let (slopes, _) = S::as_mut_simd_f32s(&mut self.slopes[self.lit.clone()]);
        for slope in slopes {
            *slope = ((Lanes::new(simd, *slope) - through_gain) * factor).value;
        }
        rows.blank(&mut self.slopes, &self.lit);
    }

    /// The IoU of the hard masks, and whether something was summed in the cells that their threshold lies among; elsewhere it is
    /// not known.
    fn iou(&mut self, rows: &LevelRows, tau_pct: f64) -> (Option<f64>, bool) {
        self.ranked.clear();
        for row in self.power.chunks_exact(rows.stride.max(1)) {
            self.ranked.extend(row[..rows.size[1]].iter().map(|power| power.to_bits()));
        }
        let Some(last) = self.ranked.len().checked_sub(1 + rows.erased.len()) else { return (None, true) };
        let (lower, _) = place(last, 100.0 - tau_pct);
        // Erased cells hold 0: they rank below all.
        let (_, &mut lower, _) = self.ranked.select_nth_unstable(lower + rows.erased.len());
        let lower = f32::from_bits(lower);
        if lower <= 0.0 {
            return (None, false);
        }
        // The threshold lies between it and the next above: no cell does.
        let (mut both, mut either) = (0_usize, 0_usize);
        for (row, marked) in
            self.power.chunks_exact(rows.stride.max(1)).zip(rows.marked.chunks_exact(rows.stride.max(1)))
        {
            for (&power, &marked) in row[..rows.size[1]].iter().zip(marked) {
                let (sim, ori) = (power > lower, marked > 0.5);
                both += usize::from(sim && ori);
                either += usize::from(sim || ori);
            }
        }
        (super::floors::share(both, either), true)
    }
}

/// ln(1 + x) of x ≥ 0; of small x with all its digits, for a correlation of faint levels is made of them.
#[inline(always)]
pub(super) fn ln_1p<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    let one = splat(simd, 1.0);
    let cube = x.mul_add(splat(simd, -0.25), splat(simd, 1.0 / 3.0));
    let series = x.mul_add(x.mul_add(cube, splat(simd, -0.5)), one) * x;
    x.select_gt(splat(simd, 0.015_625), (x + one).log2() * splat(simd, LN_2), series)
}
