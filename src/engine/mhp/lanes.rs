//! As many f32 as the machine computes at once, with the few functions that the tiles need.
//!
//! The instruction set is chosen at run time by `pulp` (AVX-512, AVX2 with FMA, NEON or plain), which keeps this crate
//! free of `unsafe`. Everything here is inlined into the function that `pulp` compiles for the chosen set.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use pulp::Simd;
use std::ops::{Add, AddAssign, Div, Mul, Sub};

/// 1.5 · 2²³ + 127: adding it rounds to a whole number and leaves that number, biased as an exponent, in the low bits.
const ROUND_TO_EXPONENT: f32 = 12_583_039.0;
/// 2ᶠ on |f| ≤ ½, relative error 3e-6 (least squares at Chebyshev points).
const EXP2_SERIES: [f32; 5] = [0.999_999_2, 0.693_121_97, 0.240_249_81, 0.055_917_04, 0.009_560_51];

/// The same, relative error 2e-7.
const EXP2_LONG_SERIES: [f32; 7] =
    [1.0, std::f32::consts::LN_2, 0.240_226_5, 0.055_504_11, 0.009_618_129, 0.001_333_355_8, 0.000_154_035_3];

/// 1.5 · 2²³: adding it rounds to a whole number.
const ROUND_TO_INTEGER: f32 = 12_582_912.0;
/// Series of cos πt and sin(πt)/t by t².
const COS_PI_SERIES: [f32; 7] = [1.0, -4.934_802, 4.058_712, -1.335_262_8, 0.235_330_63, -0.025_806_89, 0.001_929_6];
const SIN_PI_SERIES: [f32; 6] =
    [std::f32::consts::PI, -5.167_712_8, 2.550_164, -0.599_264_5, 0.082_145_89, -0.007_370_43];

/// A register of f32.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    pub(super) value: S::f32s,
}

/// `x` in every lane.
#[inline(always)]
pub(super) fn splat<S: Simd>(simd: S, x: f32) -> Lanes<S> {
    Lanes::new(simd, simd.splat_f32s(x))
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, value: S::f32s) -> Self {
        Self { simd, value }
    }

    /// self · a + b
    #[inline(always)]
    pub(super) fn mul_add(self, a: Self, b: Self) -> Self {
        Self::new(self.simd, self.simd.mul_add_f32s(self.value, a.value, b.value))
    }

    /// b − self · a
    #[inline(always)]
    pub(super) fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self::new(self.simd, self.simd.negate_mul_add_f32s(self.value, a.value, b.value))
    }

    #[inline(always)]
    pub(super) fn min(self, b: Self) -> Self {
        Self::new(self.simd, self.simd.min_f32s(self.value, b.value))
    }

    #[inline(always)]
    pub(super) fn max(self, b: Self) -> Self {
        Self::new(self.simd, self.simd.max_f32s(self.value, b.value))
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        // Pulp's own is not always inlined.
        self.max(splat(self.simd, 0.0) - self)
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Self::new(self.simd, self.simd.sqrt_f32s(self.value))
    }

    /// `yes` where self > b, else `no`.
    #[inline(always)]
    pub(super) fn select_gt(self, b: Self, yes: Self, no: Self) -> Self {
        let mask = self.simd.less_than_f32s(b.value, self.value);
        Self::new(self.simd, self.simd.select_f32s(mask, yes.value, no.value))
    }

    #[inline(always)]
    pub(super) fn any_positive(self) -> bool {
        let simd = self.simd;
        simd.first_true_m32s(simd.less_than_f32s(simd.splat_f32s(0.0), self.value)) < S::F32_LANES
    }

    /// A bit a lane that is positive, the first lane's the lowest.
    #[inline(always)]
    pub(super) fn positive_bits(self) -> u32 {
        let simd = self.simd;
        let mask = simd.less_than_f32s(simd.splat_f32s(0.0), self.value);
        let bytes = bytemuck::bytes_of(&mask);
        if let (&[low, high], 16) = (bytes, S::F32_LANES) {
            // AVX-512 has them as such.
            return u32::from(u16::from_le_bytes([low, high]));
        }
        let mut bits = 0;
        for (lane, bytes) in bytes.chunks_exact(bytes.len() / S::F32_LANES).enumerate() {
            bits |= u32::from(bytes[0] != 0) << lane;
        }
        bits
    }

    /// The largest lane.
    #[inline(always)]
    pub(super) fn reduce_max(self) -> f32 {
        self.simd.reduce_max_f32s(self.value)
    }

    /// Σ of the lanes.
    #[inline(always)]
    pub(super) fn reduce_sum(self) -> f32 {
        self.simd.reduce_sum_f32s(self.value)
    }

    /// cos and sin of a number of turns, absolute error 3e-7 and what rounding leaves of whole turns.
    #[inline(always)]
    pub(super) fn cos_sin_turns(self) -> [Self; 2] {
        let of = |x: f32| splat(self.simd, x);
        let t = self - ((self + of(ROUND_TO_INTEGER)) - of(ROUND_TO_INTEGER));
        let t2 = t * t;
        let polynomial = |of_t2: &[f32]| of_t2.iter().rev().fold(of(0.0), |sum, &c| sum.mul_add(t2, of(c)));
        // Of half the angle, −π/2 to π/2.
        let (c, s) = (polynomial(&COS_PI_SERIES), t * polynomial(&SIN_PI_SERIES));
        let twice = s + s;
        [of(1.0) - twice * s, twice * c]
    }

    /// 2ˣ for x in −126 ..= 127.
    #[inline(always)]
    pub(super) fn exp2(self) -> Self {
        self.exp2_by(EXP2_SERIES)
    }

    /// The same to the last digits, to be raised to powers.
    #[inline(always)]
    pub(super) fn exp2_precise(self) -> Self {
        self.exp2_by(EXP2_LONG_SERIES)
    }

    #[inline(always)]
    fn exp2_by<const N: usize>(self, series: [f32; N]) -> Self {
        let simd = self.simd;
        let rounded = self + splat(simd, ROUND_TO_EXPONENT);
        let f = self - (rounded - splat(simd, ROUND_TO_EXPONENT));
        let mut power = splat(simd, series[N - 1]);
        for k in (0..N - 1).rev() {
            power = power.mul_add(f, splat(simd, series[k]));
        }
        let bits = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(rounded.value), simd.splat_u32s(23));
        power * Self::new(simd, simd.transmute_f32s_u32s(bits))
    }

    /// log₂ x of a positive normal x, absolute error 1e-7 or a unit in the last place.
    #[inline(always)]
    pub(super) fn log2(self) -> Self {
        let simd = self.simd;
        let bits = simd.transmute_u32s_f32s(self.value);
        // The exponent as the low bits of 2²³.
        let shifted = simd.wrapping_dyn_shr_u32s(bits, simd.splat_u32s(23));
        let whole = Self::new(simd, simd.transmute_f32s_u32s(simd.or_u32s(shifted, simd.splat_u32s(0x4B00_0000))));
        let fraction = simd.or_u32s(simd.and_u32s(bits, simd.splat_u32s(0x007F_FFFF)), simd.splat_u32s(0x3F80_0000));
        let m = Self::new(simd, simd.transmute_f32s_u32s(fraction));
        let root = splat(simd, std::f32::consts::SQRT_2);
        let s = (m - root) / (m + root);
        let s2 = s * s;
        // 2/ln 2 · (s + s³/3 + s⁵/5 + s⁷/7)
        let series = s2
            .mul_add(splat(simd, 0.412_198_58), splat(simd, 0.577_078))
            .mul_add(s2, splat(simd, 0.961_796_7))
            .mul_add(s2, splat(simd, 2.885_39));
        s.mul_add(series, (whole - splat(simd, 8_388_735.0)) + splat(simd, 0.5))
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self::new(self.simd, self.simd.add_f32s(self.value, b.value))
    }
}

impl<S: Simd> AddAssign for Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self::new(self.simd, self.simd.sub_f32s(self.value, b.value))
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self::new(self.simd, self.simd.mul_f32s(self.value, b.value))
    }
}

impl<S: Simd> Div for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Self::new(self.simd, self.simd.div_f32s(self.value, b.value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::{Arch, WithSimd};

    /// Sixteen numbers, of which every register holds a part.
    type F32x16 = [f32; 16];

    /// 2ˣ, log₂ x, cosine and sine of turns, |x|, 5 − 3x, 2 where x > 1, else 3, and 2ˣ by the long series.
    struct Functions<'a>(&'a [F32x16]);

    impl WithSimd for Functions<'_> {
        type Output = Vec<[F32x16; 8]>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let of = |x: f32| splat(simd, x);
            let mut found = vec![[[0.0; 16]; 8]; self.0.len()];
            for (x, found) in self.0.iter().zip(&mut found) {
                for part in 0..16 / S::F32_LANES {
                    let x = Lanes::new(simd, S::as_simd_f32s(x).0[part]);
                    let [cos, sin] = x.cos_sin_turns();
                    let chosen = x.select_gt(of(1.0), of(2.0), of(3.0));
                    let plane = x.neg_mul_add(of(3.0), of(5.0));
                    let all = [x.exp2(), x.log2(), cos, sin, x.abs(), plane, chosen, x.exp2_precise()];
                    for (found, y) in found.iter_mut().zip(all) {
                        S::as_mut_simd_f32s(found).0[part] = y.value;
                    }
                }
            }
            found
        }
    }

    /// Each number with what is found of it.
    fn functions(of: impl Iterator<Item = f32>) -> Vec<(f64, [f64; 8])> {
        let of: Vec<f32> = of.collect();
        let rows: Vec<F32x16> = of.chunks_exact(16).map(|row| std::array::from_fn(|k| row[k])).collect();
        let found = Arch::new().dispatch(Functions(&rows));
        let pairs = rows.iter().zip(&found);
        pairs.flat_map(|(x, y)| (0..16).map(|k| (f64::from(x[k]), y.map(|y| f64::from(y[k]))))).collect()
    }

    #[test]
    fn powers_turns_and_choices_are_those_of_double_precision() {
        for (x, [exp2, _, cos, sin, abs, plane, chosen, precise]) in
            functions((-16 * 63..16 * 63).map(|k| 0.123 * k as f32))
        {
            assert!((precise / x.exp2() - 1.0).abs() < 4e-7, "2^{x}: {precise}");
            assert!((exp2 / x.exp2() - 1.0).abs() < 4e-6, "2^{x}: {exp2}");
            let (wanted_sin, wanted_cos) = (std::f64::consts::TAU * x).sin_cos();
            assert!((cos - wanted_cos).abs() < 1e-6 && (sin - wanted_sin).abs() < 1e-6, "{x} turns: {cos}, {sin}");
            assert!(abs == x.abs() && chosen == if x > 1.0 { 2.0 } else { 3.0 }, "{x}: {abs}, {chosen}");
            assert!((plane - (5.0 - 3.0 * x)).abs() < 1e-6 * (5.0 + x.abs()), "5 - 3 {x}: {plane}");
        }
    }

    #[test]
    fn logarithms_are_those_of_double_precision() {
        let largest = 2.0_f32.powi(126);
        let of = (0..16 * 64).map(|k| (1.0 + 0.37 * k as f32) * 1.187_f32.powi(k % 400 - 200)).chain([largest; 16]);
        for (x, [_, log2, ..]) in functions(of) {
            let wanted = x.log2();
            assert!((log2 - wanted).abs() < 3e-7 * wanted.abs().max(1.0), "log2 {x}: {log2}, not {wanted}");
        }
    }

    /// A bit a lane, the largest lane and Σ of the lanes.
    struct Reductions(F32x16);

    impl WithSimd for Reductions {
        type Output = (u32, f32, f32, bool);

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let (mut bits, mut largest, mut sum, mut any) = (0, f32::MIN, 0.0, false);
            for part in 0..16 / S::F32_LANES {
                let x = Lanes::new(simd, S::as_simd_f32s(&self.0).0[part]);
                bits |= x.positive_bits() << (part * S::F32_LANES);
                (largest, sum) = (x.reduce_max().max(largest), sum + x.reduce_sum());
                any |= x.any_positive();
            }
            (bits, largest, sum, any)
        }
    }

    #[test]
    fn lanes_are_marked_from_the_first_on() {
        let mut x = [-1.0; 16];
        assert_eq!(Arch::new().dispatch(Reductions(x)), (0, -1.0, -16.0, false));
        (x[0], x[5], x[15]) = (2.0, 0.5, 7.0);
        assert_eq!(Arch::new().dispatch(Reductions(x)), (1 | 1 << 5 | 1 << 15, 7.0, -3.5, true));
        x[5] = 0.0;
        assert_eq!(Arch::new().dispatch(Reductions(x)).0, 1 | 1 << 15, "nothing is not positive");
    }
}
