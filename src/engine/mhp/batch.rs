//! Joints one by one, or as many of them as the machine computes at once: the same formulas for both.
//!
//! What is computed a joint is written over [`Numeric`]. In f64 a [`JointTask`] sees one joint at a time, which is the oracle's
//! own order of operations; in single precision it sees as many as `pulp` has f64 in a register, whose sums may round
//! differently.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::Precision;
use crate::geometry::{Mat3, Numeric};
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::{LN_2, LOG2_E, SQRT_2};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Joints of a row of [`Columns`]: as many as the largest register has.
const ROW_JOINTS: usize = 8;
/// 1.5 · 2⁵²: adding it rounds to a whole number.
const ROUND_TO_INTEGER: f64 = 6_755_399_441_055_744.0;
/// 2⁵²: holds a whole number in its lowest bits.
const INTEGER_IN_MANTISSA: f64 = 4_503_599_627_370_496.0;
/// Of an f64's exponent, and the bits of its mantissa.
const EXPONENT_BIAS: f64 = 1023.0;
const MANTISSA_BITS: u32 = 52;
/// 2ᶠ on |f| ≤ ½ by Taylor, relative error 1e-14.
const EXP2_SERIES: [f64; 12] = series_of_exp2();
/// 2 artanh(s)/s by s² on |s| ≤ 0.172, relative error 1e-14.
const ATANH_SERIES: [f64; 9] = series_of_artanh();

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
    type Number: Numeric;

    /// `x` for each.
    fn splat(self, x: f64) -> Self::Number;

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
pub(super) trait JointTask {
    /// Does it for these.
    fn run<B: Batch>(&mut self, batch: B);
}

/// Does `task` for `joints` joints.
pub(super) fn each_joint(precision: Precision, joints: usize, task: &mut impl JointTask) {
    match precision {
        Precision::F64 => (0..joints).for_each(|joint| task.run(OneJoint(joint))),
        Precision::F32 => Arch::new().dispatch(Together { joints, task }),
    }
}

struct Together<'a, T> {
    joints: usize,
    task: &'a mut T,
}

impl<T: JointTask> WithSimd for Together<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for first in (0..self.joints).step_by(S::F64_LANES) {
            if first + 1 == self.joints {
                // A register for one joint, as the last of seventeen is, would divide and take roots for eight.
                self.task.run(OneJoint(first));
            } else {
                self.task.run(JointLanes { simd, first, end: self.joints });
            }
        }
    }
}

/// `N` numbers a joint, in rows of eight joints.
#[derive(Debug, Clone)]
pub(super) struct Columns<const N: usize>(Vec<[JointRow; N]>);

#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct JointRow([f64; ROW_JOINTS]);

impl<const N: usize> Default for Columns<N> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<const N: usize> Columns<N> {
    /// Makes room for so many joints.
    pub(super) fn hold(&mut self, joints: usize) {
        self.0.resize(joints.div_ceil(ROW_JOINTS), [JointRow([0.0; ROW_JOINTS]); N]);
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
pub(super) struct OneJoint(pub usize);

impl Batch for OneJoint {
    type Number = f64;

    fn splat(self, x: f64) -> f64 {
        x
    }

    fn gather(self, of: impl Fn(usize) -> f64) -> f64 {
        of(self.0)
    }

    fn scatter(self, x: f64, mut to: impl FnMut(usize, f64)) {
        to(self.0, x);
    }

    fn load<const N: usize>(self, from: &Columns<N>) -> [f64; N] {
        let (rows, lane) = (&from.0[self.0 / ROW_JOINTS], self.0 % ROW_JOINTS);
        let mut x = [0.0; N];
        for k in 0..N {
            x[k] = rows[k].0[lane];
        }
        x
    }

    fn store<const N: usize>(self, x: [f64; N], into: &mut Columns<N>) {
        for (row, x) in into.0[self.0 / ROW_JOINTS].iter_mut().zip(x) {
            row.0[self.0 % ROW_JOINTS] = x;
        }
    }
}

/// A register of joints from `first` on; beyond the last, what is gathered are copies of it, and what is stored nobody reads.
#[derive(Clone, Copy)]
struct JointLanes<S: Simd> {
    simd: S,
    first: usize,
    end: usize,
}

impl<S: Simd> Batch for JointLanes<S> {
    type Number = F64Lanes<S>;

    #[inline(always)]
    fn splat(self, x: f64) -> F64Lanes<S> {
        F64Lanes { simd: self.simd, value: self.simd.splat_f64s(x) }
    }

    #[inline(always)]
    fn gather(self, of: impl Fn(usize) -> f64) -> F64Lanes<S> {
        let mut x = self.splat(0.0);
        for (lane, x) in x.lanes().iter_mut().enumerate() {
            *x = of((self.first + lane).min(self.end - 1));
        }
        x
    }

    #[inline(always)]
    fn scatter(self, mut x: F64Lanes<S>, mut to: impl FnMut(usize, f64)) {
        for (joint, &mut x) in (self.first..self.end).zip(x.lanes()) {
            to(joint, x);
        }
    }

    #[inline(always)]
    fn load<const N: usize>(self, from: &Columns<N>) -> [F64Lanes<S>; N] {
        let mut x = [self.splat(0.0); N];
        let rows = &from.0[self.first / ROW_JOINTS];
        for k in 0..N {
            x[k].value = S::as_simd_f64s(&rows[k].0).0[self.first % ROW_JOINTS / S::F64_LANES];
        }
        x
    }

    #[inline(always)]
    fn store<const N: usize>(self, x: [F64Lanes<S>; N], into: &mut Columns<N>) {
        let rows = &mut into.0[self.first / ROW_JOINTS];
        for k in 0..N {
            S::as_mut_simd_f64s(&mut rows[k].0).0[self.first % ROW_JOINTS / S::F64_LANES] = x[k].value;
        }
    }
}

/// A register of f64.
#[derive(Clone, Copy)]
pub(super) struct F64Lanes<S: Simd> {
    simd: S,
    value: S::f64s,
}

impl<S: Simd> F64Lanes<S> {
    /// `of` the bits of each.
    #[inline(always)]
    fn bits(self, of: impl Fn(u64) -> u64) -> Self {
        self.map(|x| f64::from_bits(of(x.to_bits())))
    }

    /// The polynomial with these coefficients, the constant one first.
    #[inline(always)]
    fn series<const N: usize>(self, coefficients: &[f64; N]) -> Self {
        let mut sum = self.splat(coefficients[N - 1]);
        for k in (0..N - 1).rev() {
            sum = sum.mul_add(self, self.splat(coefficients[k]));
        }
        sum
    }

    #[inline(always)]
    fn lanes(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut self.value))
    }
}

impl<S: Simd> Numeric for F64Lanes<S> {
    #[inline(always)]
    fn splat(self, x: f64) -> Self {
        Self { simd: self.simd, value: self.simd.splat_f64s(x) }
    }

    #[inline(always)]
    fn select_lt(self, limit: f64, yes: Self, no: Self) -> Self {
        let mask = self.simd.less_than_f64s(self.value, self.simd.splat_f64s(limit));
        Self { simd: self.simd, value: self.simd.select_f64s(mask, yes.value, no.value) }
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self { simd: self.simd, value: self.simd.mul_add_f64s(self.value, a.value, b.value) }
    }

    #[inline(always)]
    fn max(self, limit: f64) -> Self {
        Self { simd: self.simd, value: self.simd.max_f64s(self.value, self.simd.splat_f64s(limit)) }
    }

    #[inline(always)]
    fn min(self, limit: f64) -> Self {
        Self { simd: self.simd, value: self.simd.min_f64s(self.value, self.simd.splat_f64s(limit)) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { simd: self.simd, value: self.simd.sqrt_f64s(self.value) }
    }

    #[inline(always)]
    fn floor(self) -> Self {
        let nearest = (self + ROUND_TO_INTEGER) - ROUND_TO_INTEGER;
        nearest - (self - nearest).select_lt(0.0, self.splat(1.0), self.splat(0.0))
    }

    #[inline(always)]
    fn exp(self) -> Self {
        // 2ⁿ · 2ᶠ; the sum holds n, biased as an exponent, in its lowest bits.
        let x = (self * LOG2_E).max(-1022.0).min(1023.0);
        let biased = x + (ROUND_TO_INTEGER + EXPONENT_BIAS);
        let f = x - (biased - (ROUND_TO_INTEGER + EXPONENT_BIAS));
        biased.bits(|bits| bits << MANTISSA_BITS) * f.series(&EXP2_SERIES)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        let exponent = self.bits(|bits| (bits >> MANTISSA_BITS) | INTEGER_IN_MANTISSA.to_bits())
            - (INTEGER_IN_MANTISSA + EXPONENT_BIAS);
        let m = self.bits(|bits| bits & (u64::MAX >> 12) | 1.0_f64.to_bits());
        let s = (m - SQRT_2) / (m + SQRT_2);
        let ln = s * (s * s).series(&ATANH_SERIES) + (exponent + 0.5) * LN_2;
        // What has no logarithm, and what is not finite, must stay visible.
        self.select_lt(f64::MIN_POSITIVE, self.splat(f64::NAN), ln + self * 0.0)
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        (self + 1.0).ln()
    }

    #[inline(always)]
    fn map(mut self, of: impl Fn(f64) -> f64) -> Self {
        for x in self.lanes() {
            *x = of(*x);
        }
        self
    }

    #[inline(always)]
    fn zip_map(mut self, mut other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        for (x, &mut y) in self.lanes().iter_mut().zip(other.lanes()) {
            *x = of(*x, y);
        }
        self
    }
}

/// An operator between two registers, and between a register and a number.
macro_rules! operator {
    ($operator:ident, $name:ident, $of:ident) => {
        impl<S: Simd> $operator for F64Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, b: Self) -> Self {
                Self { simd: self.simd, value: self.simd.$of(self.value, b.value) }
            }
        }

        impl<S: Simd> $operator<f64> for F64Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, b: f64) -> Self {
                self.$name(self.splat(b))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for F64Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, value: self.simd.neg_f64s(self.value) }
    }
}

impl<S: Simd> AddAssign for F64Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl<S: Simd> SubAssign for F64Lanes<S> {
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

    impl JointTask for Functions {
        #[inline(always)]
        fn run<B: Batch>(&mut self, batch: B) {
            let x = batch.gather(|k| self.of[k]);
            for (which, y) in [x.exp(), x.ln(), x.ln_1p(), x.floor()].into_iter().enumerate() {
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
