//! Products of matrices and vectors in the widest registers that the machine has; compiled here, where numbers are optimised in every
//! profile.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use pulp::{Arch, Simd, WithSimd};
use std::ops::{AddAssign, Mul};

/// Sums side by side: registers hold as many while others are loaded.
const SUMS: usize = 16;
/// Rows that are added before what they are added to is written again.
const ROWS: usize = 4;

/// bias + W x: `weight` (outputs, inputs) in C order, `bias` (outputs), `x` (inputs), of one unit; returns (outputs).
pub fn dense(weight: &[f32], bias: &[f32], x: &[f32]) -> Vec<f32> {
    let mut out = bias.to_vec();
    add_products(&mut out, weight, x);
    out
}

/// Adds A x to `out` (rows): `rows` is A, (rows, columns) in C order, `x` (columns).
pub fn add_products<T: Summand>(out: &mut [T], rows: &[T], x: &[T]) {
    Arch::new().dispatch(AddProducts { out, rows, x });
}

/// Adds Aᵀ w to `out` (columns): `rows` is A, (rows, columns) in C order, `weights` w (rows). The columns before `from` stay as they are.
pub fn add_rows<T: Summand>(out: &mut [T], rows: &[T], weights: &[T], from: usize) {
    Arch::new().dispatch(AddRows { out, rows, weights, from });
}

/// What sums of products are made of.
pub trait Summand: Copy + Default + Mul<Output = Self> + AddAssign {}

impl<T: Copy + Default + Mul<Output = Self> + AddAssign> Summand for T {}

struct AddProducts<'a, T> {
    out: &'a mut [T],
    rows: &'a [T],
    x: &'a [T],
}

impl<T: Summand> WithSimd for AddProducts<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (out, row) in self.out.iter_mut().zip(self.rows.chunks_exact(self.x.len().max(1))) {
            *out += product(row, self.x);
        }
    }
}

struct AddRows<'a, T> {
    out: &'a mut [T],
    rows: &'a [T],
    weights: &'a [T],
    from: usize,
}

impl<T: Summand> WithSimd for AddRows<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { out, rows, weights, from } = self;
        let columns = out.len();
        let out = &mut out[from..];
        let (few, rest) = weights.as_chunks::<ROWS>();
        let (of_few, of_rest) = rows.split_at((few.len() * ROWS * columns).min(rows.len()));
        for (rows, weights) in of_few.chunks_exact((ROWS * columns).max(1)).zip(few) {
            let of: [&[T]; ROWS] = std::array::from_fn(|k| &rows[k * columns + from..(k + 1) * columns][..out.len()]);
            for (column, out) in out.iter_mut().enumerate() {
                let mut sum = *out;
                for k in 0..ROWS {
                    sum += weights[k] * of[k][column];
                }
                *out = sum;
            }
        }
        for (row, &weight) in of_rest.chunks_exact(columns.max(1)).zip(rest) {
            for (out, of) in out.iter_mut().zip(&row[from..]) {
                *out += weight * *of;
            }
        }
    }
}

#[inline(always)]
fn product<T: Summand>(a: &[T], b: &[T]) -> T {
    let (a_whole, a_rest) = a.as_chunks::<SUMS>();
    let (b_whole, b_rest) = b.as_chunks::<SUMS>();
    let mut sums = [T::default(); SUMS];
    for (a, b) in a_whole.iter().zip(b_whole) {
        for k in 0..SUMS {
            sums[k] += a[k] * b[k];
        }
    }
    let mut total = T::default();
    for (a, b) in a_rest.iter().zip(b_rest) {
        total += *a * *b;
    }
    // Halves onto each other: a sum one after the other would wait for each.
    let mut width = SUMS / 2;
    while width > 0 {
        for k in 0..width {
            let other = sums[k + width];
            sums[k] += other;
        }
        width /= 2;
    }
    total += sums[0];
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_is_its_matrix_times_its_input() {
        let inputs = 37;
        let x: Vec<f32> = (0..inputs).map(|k| (k as f32 * 0.7).sin()).collect();
        let weight: Vec<f32> = (0..3 * inputs).map(|k| (k as f32 * 0.3).cos()).collect();
        let out = dense(&weight, &[1.0, -2.0, 0.5], &x);
        for (row, bias) in [1.0, -2.0, 0.5].into_iter().enumerate() {
            let plain: f64 = (0..inputs).map(|k| f64::from(weight[row * inputs + k]) * f64::from(x[k])).sum();
            assert!((f64::from(out[row]) - plain - bias).abs() < 1e-5, "{row}");
        }
    }

    #[test]
    fn rows_are_added_from_a_place_on() {
        let rows: Vec<f64> = (0..40).map(f64::from).collect();
        let mut out = vec![1.0; 20];
        add_rows(&mut out, &rows, &[2.0, -0.5], 3);
        for (k, found) in out.into_iter().enumerate() {
            let added = if k < 3 { 0.0 } else { 2.0 * rows[k] - 0.5 * rows[20 + k] };
            assert!((found - 1.0 - added).abs() < 1e-12, "{k}: {found}");
        }
        add_rows::<f64>(&mut [], &rows, &[1.0], 0);
        add_products(&mut [0.0], &rows, &[]);
    }
}
