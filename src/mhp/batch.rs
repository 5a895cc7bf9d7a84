//! Joints one by one, or as many of them as the machine computes at once: the same formulas for both.
//!
//! What is computed a joint is written over [`Number`]. In f64 a [`Task`] sees one joint at a time, which is the oracle's
//! own order of operations; in single precision it sees as many as `pulp` has f64 in a register, whose sums may round
//! differently.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::Precision;
use crate::geometry::{Mat3, Number};
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::{LN_2, LOG2_E, SQRT_2};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Joints of a row of [`Columns`]: as many as the largest register has.
const ROW: usize = 8;
/// 1.5 · 2⁵²: adding it rounds to a whole number.
const WHOLE: f64 = 6_755_399_441_055_744.0;
/// 2⁵²: holds a whole number in its lowest bits.
const HOLDER: f64 = 4_503_599_627_370_496.0;
/// Of an f64's exponent, and the bits of its mantissa.
const BIAS: f64 = 1023.0;
const MANTISSA: u32 = 52;
/// 2ᶠ on |f| ≤ ½ by Taylor, relative error 1e-14.
const EXP2: [f64; 12] = series_of_exp2();
/// 2 artanh(s)/s by s² on |s| ≤ 0.172, relative error 1e-14.
const ATANH: [f64; 9] = series_of_artanh();

/// (ln 2)ᵏ/k!
const fn series_of_exp2() -> [f64; 12] {
    let mut series = [1.0; 12];
    let mut k = 1;
    while k < series.len() {
        series[k] = series[k - 1] * LN_2 / k as f64;
        k += 1;
    }
    series
}

/// 2/(2k + 1)
const fn series_of_artanh() -> [f64; 9] {
    let mut series = [2.0; 9];
    let mut k = 1;
    while k < series.len() {
        series[k] = 2.0 / (2 * k + 1) as f64;
        k += 1;
    }
    series
}

/// Some joints beside each other, and how their numbers are read and written.
pub(super) trait Batch: Copy {
    /// A number of each of them.
    type Number: Number;

    /// `x` for each.
    fn all(self, x: f64) -> Self::Number;

    /// What `of` says of each.
    fn gather(self, of: impl Fn(usize) -> f64) -> Self::Number;

    /// Tells `to` each joint and what is its own in `x`.
    fn scatter(self, x: Self::Number, to: impl FnMut(usize, f64));

    /// `N` numbers of each.
    fn load<const N: usize>(self, from: &Columns<N>) -> [Self::Number; N];

    /// Writes `N` numbers of each.
    fn store<const N: usize>(self, x: [Self::Number; N], into: &mut Columns<N>);

    /// Adds `N` numbers to those of each.
    #[inline(always)]
    fn add<const N: usize>(self, x: [Self::Number; N], to: &mut Columns<N>) {
        let mut sum = self.load(to);
        for k in 0..N {
            sum[k] += x[k];
        }
        self.store(sum, to);
    }
}

/// What is done a joint.
pub(super) trait Task {
    /// Does it for these.
    fn run<B: Batch>(&mut self, batch: B);
}

/// Does `task` for `joints` joints.
pub(super) fn each_joint(precision: Precision, joints: usize, task: &mut impl Task) {
    match precision {
        Precision::F64 => (0..joints).for_each(|joint| task.run(One(joint))),
        Precision::F32 => Arch::new().dispatch(Together { joints, task }),
    }
}

struct Together<'a, T> {
    joints: usize,
    task: &'a mut T,
}

impl<T: Task> WithSimd for Together<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for first in (0..self.joints).step_by(S::F64_LANES) {
            if first + 1 == self.joints {
                // A register for one joint, as the last of seventeen is, would divide and take roots for eight.
                self.task.run(One(first));
            } else {
                self.task.run(Several { simd, first, end: self.joints });
            }
        }
    }
}

/// `N` numbers a joint, in rows of eight joints.
#[derive(Debug, Clone)]
pub(super) struct Columns<const N: usize>(Vec<[Row; N]>);

#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Row([f64; ROW]);

impl<const N: usize> Default for Columns<N> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<const N: usize> Columns<N> {
    /// Makes room for so many joints.
    pub(super) fn hold(&mut self, joints: usize) {
        self.0.resize(joints.div_ceil(ROW), [Row([0.0; ROW]); N]);
    }

    /// Zeros for so many joints.
    pub(super) fn reset(&mut self, joints: usize) {
        self.0.clear();
        self.hold(joints);
    }
}

impl Columns<9> {
    /// A matrix of each joint.
    #[inline(always)]
    pub(super) fn matrix<B: Batch>(&self, batch: B) -> Mat3<B::Number> {
        let [a, b, c, d, e, f, g, h, i] = batch.load(self);
        [[a, b, c], [d, e, f], [g, h, i]]
    }

    /// Writes a matrix of each joint.
    #[inline(always)]
    pub(super) fn set_matrix<B: Batch>(&mut self, batch: B, [[a, b, c], [d, e, f], [g, h, i]]: Mat3<B::Number>) {
        batch.store([a, b, c, d, e, f, g, h, i], self);
    }
}

/// A joint.
#[derive(Clone, Copy)]
pub(super) struct One(pub usize);

impl Batch for One {
    type Number = f64;

    fn all(self, x: f64) -> f64 {
        x
    }

    fn gather(self, of: impl Fn(usize) -> f64) -> f64 {
        of(self.0)
    }

    fn scatter(self, x: f64, mut to: impl FnMut(usize, f64)) {
        to(self.0, x);
    }

    fn load<const N: usize>(self, from: &Columns<N>) -> [f64; N] {
        let (rows, lane) = (&from.0[self.0 / ROW], self.0 % ROW);
        let mut x = [0.0; N];
        for k in 0..N {
            x[k] = rows[k].0[lane];
        }
        x
    }

    fn store<const N: usize>(self, x: [f64; N], into: &mut Columns<N>) {
        for (row, x) in into.0[self.0 / ROW].iter_mut().zip(x) {
            row.0[self.0 % ROW] = x;
        }
    }
}

/// A register of joints from `first` on; beyond the last, what is gathered are copies of it, and what is stored nobody reads.
#[derive(Clone, Copy)]
struct Several<S: Simd> {
    simd: S,
    first: usize,
    end: usize,
}

impl<S: Simd> Batch for Several<S> {
    type Number = Wide<S>;

    #[inline(always)]
    fn all(self, x: f64) -> Wide<S> {
        Wide { simd: self.simd, value: self.simd.splat_f64s(x) }
    }

    #[inline(always)]
    fn gather(self, of: impl Fn(usize) -> f64) -> Wide<S> {
        let mut x = self.all(0.0);
        for (lane, x) in x.lanes().iter_mut().enumerate() {
            *x = of((self.first + lane).min(self.end - 1));
        }
        x
    }

    #[inline(always)]
    fn scatter(self, mut x: Wide<S>, mut to: impl FnMut(usize, f64)) {
        for (joint, &mut x) in (self.first..self.end).zip(x.lanes()) {
            to(joint, x);
        }
    }

    #[inline(always)]
    fn load<const N: usize>(self, from: &Columns<N>) -> [Wide<S>; N] {
        let mut x = [self.all(0.0); N];
        let rows = &from.0[self.first / ROW];
        for k in 0..N {
            x[k].value = S::as_simd_f64s(&rows[k].0).0[self.first % ROW / S::F64_LANES];
        }
        x
    }

    #[inline(always)]
    fn store<const N: usize>(self, x: [Wide<S>; N], into: &mut Columns<N>) {
        let rows = &mut into.0[self.first / ROW];
        for k in 0..N {
            S::as_mut_simd_f64s(&mut rows[k].0).0[self.first % ROW / S::F64_LANES] = x[k].value;
        }
    }
}

/// A register of f64.
#[derive(Clone, Copy)]
pub(super) struct Wide<S: Simd> {
    simd: S,
    value: S::f64s,
}

impl<S: Simd> Wide<S> {
    /// `of` the bits of each.
    #[inline(always)]
    fn bits(self, of: impl Fn(u64) -> u64) -> Self {
        self.each(|x| f64::from_bits(of(x.to_bits())))
    }

    /// The polynomial with these coefficients, the constant one first.
    #[inline(always)]
    fn series<const N: usize>(self, coefficients: &[f64; N]) -> Self {
        let mut sum = self.like(coefficients[N - 1]);
        for k in (0..N - 1).rev() {
            sum = Self {
                simd: self.simd,
                value: self.simd.mul_add_f64s(sum.value, self.value, self.like(coefficients[k]).value),
            };
        }
        sum
    }

    #[inline(always)]
    fn lanes(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut self.value))
    }
}

impl<S: Simd> Number for Wide<S> {
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        Self { simd: self.simd, value: self.simd.splat_f64s(x) }
    }

    #[inline(always)]
    fn below(self, limit: f64, yes: Self, no: Self) -> Self {
        let mask = self.simd.less_than_f64s(self.value, self.simd.splat_f64s(limit));
        Self { simd: self.simd, value: self.simd.select_f64s(mask, yes.value, no.value) }
    }

    #[inline(always)]
    fn plus(self, a: Self, b: Self) -> Self {
        Self { simd: self.simd, value: self.simd.mul_add_f64s(a.value, b.value, self.value) }
    }

    #[inline(always)]
    fn at_least(self, limit: f64) -> Self {
        Self { simd: self.simd, value: self.simd.max_f64s(self.value, self.simd.splat_f64s(limit)) }
    }

    #[inline(always)]
    fn at_most(self, limit: f64) -> Self {
        Self { simd: self.simd, value: self.simd.min_f64s(self.value, self.simd.splat_f64s(limit)) }
    }

    #[inline(always)]
    fn root(self) -> Self {
        Self { simd: self.simd, value: self.simd.sqrt_f64s(self.value) }
    }

    #[inline(always)]
    fn whole(self) -> Self {
        let nearest = (self + WHOLE) - WHOLE;
        nearest - (self - nearest).below(0.0, self.like(1.0), self.like(0.0))
    }

    #[inline(always)]
    fn exp(self) -> Self {
        // 2ⁿ · 2ᶠ; the sum holds n, biased as an exponent, in its lowest bits.
        let x = (self * LOG2_E).at_least(-1022.0).at_most(1023.0);
        let biased = x + (WHOLE + BIAS);
        let f = x - (biased - (WHOLE + BIAS));
        biased.bits(|bits| bits << MANTISSA) * f.series(&EXP2)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        let exponent = self.bits(|bits| (bits >> MANTISSA) | HOLDER.to_bits()) - (HOLDER + BIAS);
        let m = self.bits(|bits| bits & (u64::MAX >> 12) | 1.0_f64.to_bits());
        let s = (m - SQRT_2) / (m + SQRT_2);
        let ln = s * (s * s).series(&ATANH) + (exponent + 0.5) * LN_2;
        // What has no logarithm, and what is not finite, must stay visible.
        self.below(f64::MIN_POSITIVE, self.like(f64::NAN), ln + self * 0.0)
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        (self + 1.0).ln()
    }

    #[inline(always)]
    fn each(mut self, of: impl Fn(f64) -> f64) -> Self {
        for x in self.lanes() {
            *x = of(*x);
        }
        self
    }

    #[inline(always)]
    fn each_with(mut self, mut other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        for (x, &mut y) in self.lanes().iter_mut().zip(other.lanes()) {
            *x = of(*x, y);
        }
        self
    }
}

/// An operator between two registers, and between a register and a number.
macro_rules! operator {
    ($operator:ident, $name:ident, $of:ident) => {
        impl<S: Simd> $operator for Wide<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, b: Self) -> Self {
                Self { simd: self.simd, value: self.simd.$of(self.value, b.value) }
            }
        }

        impl<S: Simd> $operator<f64> for Wide<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, b: f64) -> Self {
                self.$name(self.like(b))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for Wide<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, value: self.simd.neg_f64s(self.value) }
    }
}

impl<S: Simd> AddAssign for Wide<S> {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl<S: Simd> SubAssign for Wide<S> {
    #[inline(always)]
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arguments, and what single precision makes of them: eˣ, ln x, ln(1 + x), ⌊x⌋.
    struct Functions {
        of: Vec<f64>,
        found: Vec<[f64; 4]>,
    }

    impl Task for Functions {
        #[inline(always)]
        fn run<B: Batch>(&mut self, batch: B) {
            let x = batch.gather(|k| self.of[k]);
            for (which, y) in [x.exp(), x.ln(), x.ln_1p(), x.whole()].into_iter().enumerate() {
                batch.scatter(y, |k, y| self.found[k][which] = y);
            }
        }
    }

    fn functions(of: Vec<f64>) -> Vec<[f64; 4]> {
        let found = vec![[0.0; 4]; of.len()];
        let mut task = Functions { of, found };
        each_joint(Precision::F32, task.of.len(), &mut task);
        task.found
    }

    #[test]
    fn functions_of_several_joints_are_those_of_one() {
        let of: Vec<f64> = (1..=997).map(|k| f64::from(k) * 0.37).chain([1e-300, 1e-9, 0.5, 1.0, 2.0, 1e300]).collect();
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-13 * b.abs().max(1.0);
        for (&x, found) in of.iter().zip(functions(of.clone())) {
            let [exp, ln, ln_1p, whole] = found;
            assert!(x > 700.0 || (exp / x.exp() - 1.0).abs() < 1e-12, "e^{x}: {exp}");
            assert!(near(ln, x.ln()) && near(ln_1p, x.ln_1p()), "ln of {x}: {ln}, {ln_1p}");
            assert!(x > 1e15 || whole == x.floor(), "{x}: {whole}");
        }
        let below: Vec<f64> = vec![-0.5, -2.0, -3.25, -40.0, -700.0];
        for (&x, [exp, _, _, whole]) in below.iter().zip(functions(below.clone())) {
            assert!((exp / x.exp() - 1.0).abs() < 1e-12 && whole == x.floor(), "{x}: {exp}, {whole}");
        }
    }

    #[test]
    fn what_has_no_logarithm_stays_visible() {
        let odd = functions(vec![-1.0, 0.0, f64::INFINITY, f64::NAN, -1e-310, f64::NEG_INFINITY]);
        assert!(odd.iter().all(|[_, ln, ..]| !ln.is_finite()), "{odd:?}");
    }
}
