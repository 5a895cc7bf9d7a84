//! A joint or point of skin in its rows: what it returns in each cell, and what the cells want of it.
//!
//! A point returns 2^(t − w₀ y² − w₁ (x + s y)²), y rows and x columns from its middle. That is
//!
//! ```text
//! 2^(t − (w₀ + w₁ s²) y²) · 2^(−w₁ x²) · q(x)^y,  q = 2^(−2 w₁ s x)
//! ```
//!
//! a number a row, and one a column that is multiplied by q from row to row: two products a cell instead of a power. Both numbers
//! are lifted, so that where the point is faint, too, returns stay above the smallest of single precision: denormal numbers cost a
//! hundred cycles. Of a point that leans so far that this does not hold each cell is a power by itself.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::{LANES, LevelRows};
use crate::mhp::adjoint::Sums;
use crate::mhp::lanes::{Lanes, splat};
use pulp::Simd;
use std::iter::zip;
use std::ops::Range;

/// log₂ of what a return is multiplied by: of its row's share, and of its column's.
const LIFTS: [f64; 2] = [20.0, 85.0];
/// log₂ of both: whole numbers.
const LIFT: f64 = LIFTS[0] + LIFTS[1];
/// What a sum of lifted returns is to be multiplied by.
pub(super) const LOWERED: f64 = 1.0 / (1_u128 << LIFT as u32) as f64;
/// What slopes are multiplied by before they meet returns: their products stay below the largest of single precision.
pub(super) const SLOPE_UNIT: f64 = 1.0 / (1_u32 << 30) as f64;
/// log₂ of the least and the most that a column's share, what it is multiplied by and a return may be: normal numbers end at −126
/// and 127.
const LOWEST: f64 = -122.0;
const HIGHEST: f64 = 120.0;
/// 2 to this and less is 0 where each cell is a power by itself, lifted.
const FAINTEST: f32 = 41.0;
/// Registers of a row that are summed side by side: each waits for its own product only.
const ABREAST: usize = 4;

/// A joint: its bins, 1/D, skew, and log₂ of its largest power relative to the strongest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RowPoint {
    pub(super) bin: [f64; 2],
    pub(super) weight: [f64; 2],
    pub(super) skew: f64,
    pub(super) top: f64,
}

/// The rows and columns of a region in which a point is above a level, `[from, to)`; none of somebody who is not.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reach {
    pub(super) rows: (usize, usize),
    columns: (usize, usize),
    /// In which register what is kept of it begins. Where returns are products: a share a row, and then of each block of columns what
    /// its first row has and what that is multiplied by from row to row; else what it returns, a block after the other, row by row.
    kept: usize,
    /// Where returns are products: how far the point reaches to either side.
    aside: Option<f32>,
}

/// The rows that a point reaches above a level, `height` above it at most.
#[inline(always)]
fn reached(middle: f64, height: f64, weight: f64, lo: usize, size: usize) -> (usize, usize) {
    let half = (height / weight).max(0.0).sqrt();
    let from = (middle - half - lo as f64).ceil().max(0.0);
    let to = (middle + half - lo as f64).floor() + 1.0;
    (from.min(size as f64) as usize, to.clamp(0.0, size as f64) as usize)
}

impl Reach {
    /// The registers of a row.
    #[inline(always)]
    fn registers<S: Simd>(&self) -> Range<usize> {
        self.columns.0 / S::F32_LANES..self.columns.1.div_ceil(S::F32_LANES)
    }

    /// Whether it is none.
    pub(super) fn is_empty(&self) -> bool {
        self.count() == 0
    }

    /// How many rows.
    fn count(&self) -> usize {
        self.rows.1 - self.rows.0
    }

    /// Registers of the shares of rows, and those that are kept of each register of a row.
    #[inline(always)]
    fn each<S: Simd>(&self) -> (usize, usize) {
        if self.aside.is_some() { (self.count().div_ceil(S::F32_LANES), 2) } else { (0, self.count()) }
    }

    /// Registers that are kept.
    #[inline(always)]
    pub(super) fn registers_kept<S: Simd>(&self) -> usize {
        let (of_rows, each) = self.each::<S>();
        of_rows + each * self.registers::<S>().len()
    }

    /// Blocks of registers that are summed side by side, each with where, behind the shares of rows, lies what is kept of it.
    #[inline(always)]
    fn blocks<S: Simd>(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> + use<S> {
        let (registers, (_, each)) = (self.registers::<S>(), self.each::<S>());
        registers.clone().step_by(ABREAST).map(move |from| {
            let (to, at) = ((from + ABREAST).min(registers.end), (from - registers.start) * each);
            (from..to, at..at + (to - from) * each)
        })
    }
}

impl RowPoint {
    /// Where the point is above a level; what is kept of it begins in this register.
    #[inline(always)]
    pub(super) fn reach(&self, rows: &LevelRows, cut: f64, kept: usize) -> Reach {
        let height = self.top - cut;
        if height <= 0.0 {
            return Reach { kept, ..Reach::default() };
        }
        let across = reached(self.bin[0], height, self.weight[0], rows.lo[0], rows.size[0]);
        // The ridge leans by the skew.
        let half = (height / self.weight[0]).sqrt() * self.skew.abs() + (height / self.weight[1]).sqrt();
        let from = (self.bin[1] - half - rows.lo[1] as f64).ceil().clamp(0.0, rows.size[1] as f64);
        let to = ((self.bin[1] + half - rows.lo[1] as f64).floor() + 1.0).clamp(0.0, rows.size[1] as f64);
        let columns = (from as usize, to as usize);
        if across.0 < across.1 && columns.0 < columns.1 {
            Reach { rows: across, columns, kept, aside: self.aside(half, height) }
        } else {
            Reach { kept, ..Reach::default() }
        }
    }

    /// [`Reach::aside`] of a point that reaches `half` columns to either side, so far above its level.
    #[inline(always)]
    fn aside(&self, half: f64, height: f64) -> Option<f32> {
        // Of a column log₂ is −w₁ x² − 2 w₁ s x y, of the row that is highest there at most r times the height, r = w₁ s²/w₀.
        let [w0, w1] = self.weight;
        let lean = w1 * self.skew * self.skew / w0;
        let falls = w1 * half * (half + 2.0 * self.skew.abs() * (height / w0).sqrt());
        let faintest = self.top - height * (1.0 + lean) - falls;
        let share = LIFTS[1] + height * lean < HIGHEST && LIFTS[1] - falls > LOWEST;
        let holds = share && 2.0 * w1 * self.skew.abs() * half < HIGHEST && LIFT + faintest > LOWEST;
        holds.then_some(half as f32)
    }

    /// Adds what the point returns to `power`, and keeps what tells it.
    #[inline(always)]
    pub(super) fn spread<S: Simd>(
        &self,
        simd: S,
        (rows, reach): (&LevelRows, &Reach),
        (kept, power): (&mut [S::f32s], &mut [S::f32s]),
    ) {
        let stride = rows.stride / S::F32_LANES;
        let power = &mut power[reach.rows.0 * stride..reach.rows.1 * stride];
        let (ridge, kept) = kept[reach.kept..].split_at_mut(reach.each::<S>().0);
        self.fill_ridge(simd, (rows, reach), ridge);
        let ridge: &[f32] = bytemuck::cast_slice(ridge);
        for (block, at) in reach.blocks::<S>() {
            let (kept, at) = (&mut kept[at], (rows, reach, block.start));
            match block.len() {
                1 => self.spread_block::<S, 1>(simd, at, ridge, (kept, power)),
                2 => self.spread_block::<S, 2>(simd, at, ridge, (kept, power)),
                3 => self.spread_block::<S, 3>(simd, at, ridge, (kept, power)),
                _ => self.spread_block::<S, ABREAST>(simd, at, ridge, (kept, power)),
            }
        }
    }

    /// How far the first row is from the middle.
    #[inline(always)]
    fn first_row(&self, rows: &LevelRows, reach: &Reach) -> f32 {
        ((rows.lo[0] + reach.rows.0) as f64 - self.bin[0]) as f32
    }

    /// How far the columns of a register are.
    #[inline(always)]
    fn columns<S: Simd>(&self, simd: S, rows: &LevelRows, register: usize) -> Lanes<S> {
        steps(simd) + splat(simd, ((rows.lo[1] + register * S::F32_LANES) as f64 - self.bin[1]) as f32)
    }

    /// The share of each row.
    #[inline(always)]
    fn fill_ridge<S: Simd>(&self, simd: S, (rows, reach): (&LevelRows, &Reach), ridge: &mut [S::f32s]) {
        let [w0, w1] = self.weight;
        let falls = splat(simd, -(w0 + w1 * self.skew * self.skew) as f32);
        let top = splat(simd, (self.top + LIFTS[0]) as f32);
        // Beyond the last row nothing is asked.
        let lowest = splat(simd, LOWEST as f32);
        let mut y = steps(simd) + splat(simd, self.first_row(rows, reach));
        for share in ridge {
            *share = (y * y).mul_add(falls, top).max(lowest).exp2().value;
            y += splat(simd, S::F32_LANES as f32);
        }
    }

    #[inline(always)]
    fn spread_block<S: Simd, const N: usize>(
        &self,
        simd: S,
        (rows, reach, register): (&LevelRows, &Reach, usize),
        ridge: &[f32],
        (kept, power): (&mut [S::f32s], &mut [S::f32s]),
    ) {
        let stride = rows.stride / S::F32_LANES;
        let [skew, w0, w1, top] = [self.skew, self.weight[0], self.weight[1], self.top + LIFT].map(|x| x as f32);
        let mut columns = [splat(simd, 0.0); N];
        for k in 0..N {
            columns[k] = self.columns(simd, rows, register + k);
        }
        let first = self.first_row(rows, reach);
        let Some(aside) = reach.aside else {
            let (falls, faintest) = (splat(simd, -w1), splat(simd, FAINTEST));
            let mut y = first;
            for (kept, row) in zip(kept.chunks_exact_mut(N), power.chunks_exact_mut(stride)) {
                let at_row = splat(simd, top - w0 * y * y);
                for k in 0..N {
                    let beside = columns[k] + splat(simd, skew * y);
                    let log2 = (beside * beside).mul_add(falls, at_row);
                    let returned = log2.select_gt(faintest, log2.max(faintest).exp2(), splat(simd, 0.0));
                    kept[k] = returned.value;
                    row[register + k] = (Lanes::new(simd, row[register + k]) + returned).value;
                }
                y += 1.0;
            }
            return;
        };
        let Some([shares, by_rows]) = halves_mut::<_, N>(kept) else { return };
        let mut share = [splat(simd, 0.0); N];
        let mut by_row = share;
        let (aside, lift, zero) = (splat(simd, aside), splat(simd, LIFTS[1] as f32), splat(simd, 0.0));
        for k in 0..N {
            let x = columns[k];
            let by_row_log2 = x * splat(simd, -2.0 * w1 * skew);
            let log2 = (x * x).mul_add(splat(simd, -w1), by_row_log2.mul_add(splat(simd, first), lift));
            // Beyond where the point reaches it returns nothing, whatever that is multiplied by.
            let beyond = x.abs();
            share[k] = beyond.select_gt(aside, zero, log2.exp2());
            by_row[k] = beyond.select_gt(aside, zero, by_row_log2).exp2_precise();
            (shares[k], by_rows[k]) = (share[k].value, by_row[k].value);
        }
        for (row, at_row) in zip(power.chunks_exact_mut(stride), ridge) {
            let Some(row) = row[register..].first_chunk_mut::<N>() else { break };
            for k in 0..N {
                row[k] = share[k].mul_add(splat(simd, *at_row), Lanes::new(simd, row[k])).value;
                share[k] = share[k] * by_row[k];
            }
        }
    }

    /// What the cells want of the point.
    #[inline(always)]
    pub(super) fn collect<S: Simd>(
        &self,
        simd: S,
        (rows, reach): (&LevelRows, &Reach),
        (kept, slopes): (&[S::f32s], &[S::f32s]),
    ) -> Sums {
        let stride = rows.stride / S::F32_LANES;
        let slopes = &slopes[reach.rows.0 * stride..reach.rows.1 * stride];
        let mut sums = [splat(simd, 0.0); 6];
        let (ridge, kept) = kept[reach.kept..].split_at(reach.each::<S>().0);
        let ridge: &[f32] = bytemuck::cast_slice(ridge);
        for (block, at) in reach.blocks::<S>() {
            let (kept, at) = (&kept[at], (rows, reach, block.start));
            match block.len() {
                1 => self.collect_block::<S, 1>(simd, at, ridge, (kept, slopes), &mut sums),
                2 => self.collect_block::<S, 2>(simd, at, ridge, (kept, slopes), &mut sums),
                3 => self.collect_block::<S, 3>(simd, at, ridge, (kept, slopes), &mut sums),
                _ => self.collect_block::<S, ABREAST>(simd, at, ridge, (kept, slopes), &mut sums),
            }
        }
        let mut totals = [0.0; 6];
        for k in 0..6 {
            totals[k] = f64::from(sums[k].reduce_sum()) * (LOWERED / SLOPE_UNIT);
        }
        let [r, rx, rxx, ry, rxy, ryy] = totals;
        Sums { r, q: 0.0, r_delta: [0.0, ry, rx], q_delta: [0.0; 3], r_delta_delta: [0.0, 0.0, ryy, 0.0, rxy, rxx] }
    }

    /// Adds Σ r, r x, r x², r y, r x y and r y² of a block.
    #[inline(always)]
    fn collect_block<S: Simd, const N: usize>(
        &self,
        simd: S,
        (rows, reach, register): (&LevelRows, &Reach, usize),
        ridge: &[f32],
        (kept, slopes): (&[S::f32s], &[S::f32s]),
        sums: &mut [Lanes<S>; 6],
    ) {
        let slopes = slopes.chunks_exact(rows.stride / S::F32_LANES);
        let mut of = Columns::<S, N>::from_row(simd, self.first_row(rows, reach));
        if reach.aside.is_some() {
            let Some([shares, by_rows]) = halves::<_, N>(kept) else { return };
            let mut share = shares.map(|share| Lanes::new(simd, share));
            for (row, at_row) in zip(slopes, ridge) {
                let Some(row) = row[register..].first_chunk::<N>() else { break };
                let at_row = splat(simd, *at_row);
                of.add(|k| share[k] * at_row * Lanes::new(simd, row[k]));
                for k in 0..N {
                    share[k] = share[k] * Lanes::new(simd, by_rows[k]);
                }
            }
        } else {
            for (row, kept) in zip(slopes, kept.chunks_exact(N)) {
                let (Some(kept), Some(row)) = (kept.first_chunk::<N>(), row[register..].first_chunk::<N>()) else {
                    break;
                };
                of.add(|k| Lanes::new(simd, kept[k]) * Lanes::new(simd, row[k]));
            }
        }
        let Columns { r, r_y, r_yy, .. } = of;
        for k in 0..N {
            let x = self.columns(simd, rows, register + k);
            let r_x = r[k] * x;
            sums[0] += r[k];
            sums[1] += r_x;
            sums[2] = r_x.mul_add(x, sums[2]);
            sums[3] += r_y[k];
            sums[4] = r_y[k].mul_add(x, sums[4]);
            sums[5] += r_yy[k];
        }
    }
}

/// Σ r, r y and r y² over rows, a number a column.
struct Columns<S: Simd, const N: usize> {
    simd: S,
    y: Lanes<S>,
    r: [Lanes<S>; N],
    r_y: [Lanes<S>; N],
    r_yy: [Lanes<S>; N],
}

impl<S: Simd, const N: usize> Columns<S, N> {
    /// Nothing yet; the first row is `y` from the middle.
    #[inline(always)]
    fn from_row(simd: S, y: f32) -> Self {
        let [r, r_y, r_yy] = [[splat(simd, 0.0); N]; 3];
        Self { simd, y: splat(simd, y), r, r_y, r_yy }
    }

    /// Adds a row.
    #[inline(always)]
    fn add(&mut self, wanted: impl Fn(usize) -> Lanes<S>) {
        let y_y = self.y * self.y;
        for k in 0..N {
            let wanted = wanted(k);
            self.r[k] += wanted;
            self.r_y[k] = wanted.mul_add(self.y, self.r_y[k]);
            self.r_yy[k] = wanted.mul_add(y_y, self.r_yy[k]);
        }
        self.y += splat(self.simd, 1.0);
    }
}

/// What is kept of a block whose returns are products.
#[inline(always)]
fn halves<T, const N: usize>(kept: &[T]) -> Option<[&[T; N]; 2]> {
    let (first, rest) = kept.split_first_chunk()?;
    Some([first, rest.first_chunk()?])
}

/// The same, to be filled in.
#[inline(always)]
fn halves_mut<T, const N: usize>(kept: &mut [T]) -> Option<[&mut [T; N]; 2]> {
    let (first, rest) = kept.split_first_chunk_mut()?;
    Some([first, rest.first_chunk_mut()?])
}

/// 0, 1, 2, … of a register.
#[inline(always)]
fn steps<S: Simd>(simd: S) -> Lanes<S> {
    const STEPS: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];
    Lanes::new(simd, S::as_simd_f32s(&STEPS).0[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, WithSimd};

    /// What a point returns in each cell of a region, and what it collects of slopes there.
    struct Once<'a>(&'a RowPoint, &'a LevelRows, &'a [f32], f64);

    impl WithSimd for Once<'_> {
        type Output = (bool, Vec<f32>, Sums);

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let Self(point, rows, slopes, cut) = self;
            let reach = point.reach(rows, cut, 0);
            let mut kept = vec![0.0; reach.registers_kept::<S>() * S::F32_LANES];
            let mut power = vec![0.0; rows.size[0] * rows.stride];
            let ((kept, _), (cells, _)) = (S::as_mut_simd_f32s(&mut kept), S::as_mut_simd_f32s(&mut power));
            point.spread(simd, (rows, &reach), (&mut *kept, cells));
            let sums = point.collect(simd, (rows, &reach), (kept, S::as_simd_f32s(slopes).0));
            (reach.aside.is_some(), power, sums)
        }
    }

    /// Compares returns and sums of a point with the formula, above this cut; whether they are products.
    fn check(point: &RowPoint, cut: f64) -> bool {
        let rows = LevelRows { lo: [100, 7], size: [40, 45], stride: 48, ..LevelRows::default() };
        let slope = |k: usize| if k % 48 < 45 { (k * 7919 % 101) as f32 / 50.0 } else { 0.0 };
        let slopes: Vec<f32> = (0..40 * 48).map(slope).collect();
        let handed: Vec<f32> = slopes.iter().map(|slope| slope * SLOPE_UNIT as f32).collect();
        let (products, power, sums) = Arch::new().dispatch(Once(point, &rows, &handed, cut));
        let mut wanted = [0.0; 6];
        for (row, column) in (0..40).flat_map(|row| (0..45).map(move |column| (row, column))) {
            let (y, x) = ((100 + row) as f64 - point.bin[0], (7 + column) as f64 - point.bin[1]);
            let log2 = point.top - point.weight[0] * y * y - point.weight[1] * (x + point.skew * y).powi(2);
            let found = f64::from(power[row * 48 + column]) * LOWERED;
            let off = (found - log2.exp2()).abs();
            assert!(off < 3e-5 * log2.exp2() + 2.0 * cut.exp2(), "{point:?}: {found}, 2^{log2}");
            let each = log2.exp2() * f64::from(slopes[row * 48 + column]);
            for (sum, by) in wanted.iter_mut().zip([1.0, y, x, y * y, x * y, x * x]) {
                *sum += each * by;
            }
        }
        let Sums { r, r_delta: [_, y, x], r_delta_delta: [_, _, yy, _, xy, xx], .. } = sums;
        for (found, wanted) in zip([r, y, x, yy, xy, xx], wanted) {
            assert!(
                (found - wanted).abs() < (2e-4 + 2e3 * cut.exp2()) * (1.0 + wanted.abs()),
                "{point:?}: {found}, {wanted}"
            );
        }
        products
    }

    /// Upright and leaning points, in the middle of a region, at its edge and beyond it.
    #[test]
    fn products_and_powers_are_what_the_formula_says() {
        let mut ways = [0; 2];
        for skew in [0.0, 0.3, -0.5, 1.1, 4.0] {
            for bin in [[118.3, 28.6], [101.2, 9.1], [96.0, 30.0], [139.4, 50.0]] {
                let point = RowPoint { bin, weight: [0.3, 0.9], skew, top: -2.0 };
                ways[usize::from(check(&point, -30.0))] += 1;
            }
        }
        assert!(ways[0] >= 8 && ways[1] >= 8, "{ways:?}");
    }

    /// From one of its few rows to the next what such a point returns in a column changes by more than single precision holds.
    #[test]
    fn a_narrow_point_that_leans_far_is_no_product() {
        for (weight, skew, height) in [([10.0, 1.0], 10.0, 3.0), ([2.0, 5.0], 5.0, 0.5), ([35.0, 0.5], 12.0, 14.0)] {
            for bin in [[118.5, 28.6], [118.0, 28.0]] {
                let point = RowPoint { bin, weight, skew, top: -2.0 };
                assert!(!check(&point, -2.0 - height), "{point:?}");
            }
        }
    }
}
