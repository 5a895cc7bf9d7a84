//! Small fixed-size linear algebra in f64: 3-vectors, 3×3 matrices and quaternions as plain arrays.
//!
//! Arrays rather than a matrix crate, because the forward model's derivatives are easiest to check against the
//! specification when every index is visible; the GPU side uses `glam`.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the functions that are compiled for an instruction set"
)]

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A vector in metres (or a direction, unitless): x forward, y left, z up.
pub type Vec3<T = f64> = [T; 3];
/// A 3×3 matrix in rows.
pub type Mat3<T = f64> = [[T; 3]; 3];

/// The identity matrix.
pub const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A real number, or several that the machine computes at once: what a formula that needs no loop is written in.
pub trait Numeric:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// `x`, as many times as `self` is.
    fn splat(self, x: f64) -> Self;
    /// `yes` where self < limit, else `no`.
    fn select_lt(self, limit: f64, yes: Self, no: Self) -> Self;
    /// self · a + b: several round once, one number twice, as the formulas are written (`f64::mul_add` rounds once).
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// The larger of the two.
    fn max(self, limit: f64) -> Self;
    /// The smaller of the two.
    fn min(self, limit: f64) -> Self;
    /// √x
    fn sqrt(self) -> Self;
    /// The whole number at or below.
    fn floor(self) -> Self;
    /// eˣ
    fn exp(self) -> Self;
    /// ln x of a positive normal x; no finite number where x has no logarithm.
    fn ln(self) -> Self;
    /// ln(1 + x) of a positive x, to 1e-16 of 1 at least.
    fn ln_1p(self) -> Self;
    /// `of` each.
    fn map(self, of: impl Fn(f64) -> f64) -> Self;
    /// `of` each and what is in its place in `other`.
    fn zip_map(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self;
}

impl Numeric for f64 {
    #[inline(always)]
    fn splat(self, x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn select_lt(self, limit: f64, yes: Self, no: Self) -> Self {
        if self < limit { yes } else { no }
    }

    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }

    #[inline(always)]
    fn max(self, limit: f64) -> Self {
        Self::max(self, limit)
    }

    #[inline(always)]
    fn min(self, limit: f64) -> Self {
        Self::min(self, limit)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Self::floor(self)
    }

    #[inline(always)]
    fn exp(self) -> Self {
        Self::exp(self)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        Self::ln(self)
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        Self::ln_1p(self)
    }

    #[inline(always)]
    fn map(self, of: impl Fn(f64) -> f64) -> Self {
        of(self)
    }

    #[inline(always)]
    fn zip_map(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        of(self, other)
    }
}

/// a · b
#[inline(always)]
pub fn dot<T: Numeric>(a: Vec3<T>, b: Vec3<T>) -> T {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// a × b
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + b
#[inline(always)]
pub fn add<T: Numeric>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// k a
#[inline(always)]
pub fn scale<T: Numeric>(a: Vec3<T>, k: T) -> Vec3<T> {
    [a[0] * k, a[1] * k, a[2] * k]
}

/// a += k b
#[inline(always)]
pub fn add_scaled<T: Numeric>(a: &mut Vec3<T>, b: Vec3<T>, k: T) {
    a[0] = k.mul_add(b[0], a[0]);
    a[1] = k.mul_add(b[1], a[1]);
    a[2] = k.mul_add(b[2], a[2]);
}

/// The mean of points; the origin where there are none.
#[inline]
pub fn mean(points: &[Vec3]) -> Vec3 {
    let sum = points.iter().fold([0.0; 3], |sum, &p| add(sum, p));
    scale(sum, 1.0 / points.len().max(1) as f64)
}

/// The mean distance of points from those in the same places of another list, in their unit; 0 where there are none.
pub fn mean_distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(&a, &b)| norm(sub(a, b))).sum();
    sum / a.len().max(1) as f64
}

/// ‖a‖
#[inline(always)]
pub fn norm<T: Numeric>(a: Vec3<T>) -> T {
    dot(a, a).sqrt()
}

/// `p`, turned by `angle` rad about the vertical axis through `middle`.
pub fn turned_about(middle: Vec3, angle: f64, p: Vec3) -> Vec3 {
    let (sine, cosine) = angle.sin_cos();
    let [x, y, z] = [p[0] - middle[0], p[1] - middle[1], p[2]];
    [middle[0] + cosine * x - sine * y, middle[1] + sine * x + cosine * y, z]
}

/// Distance of two points on the floor, whatever their heights.
pub fn flat_distance(a: Vec3, b: Vec3) -> f64 {
    norm([a[0] - b[0], a[1] - b[1], 0.0])
}

/// M a
#[inline(always)]
pub fn mat_vec<T: Numeric>(m: &Mat3<T>, a: Vec3<T>) -> Vec3<T> {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}

/// Mᵀ a
#[inline(always)]
pub fn mat_t_vec<T: Numeric>(m: &Mat3<T>, a: Vec3<T>) -> Vec3<T> {
    mat_vec(&transpose(m), a)
}

/// A B
#[inline(always)]
pub fn mat_mul<T: Numeric>(a: &Mat3<T>, b: &Mat3<T>) -> Mat3<T> {
    [mat_t_vec(b, a[0]), mat_t_vec(b, a[1]), mat_t_vec(b, a[2])]
}

/// Aᵀ
#[inline(always)]
pub fn transpose<T: Copy>(a: &Mat3<T>) -> Mat3<T> {
    [[a[0][0], a[1][0], a[2][0]], [a[0][1], a[1][1], a[2][1]], [a[0][2], a[1][2], a[2][2]]]
}

/// ‖q‖ and q/‖q‖; that of the zero quaternion is the identity's, (1, 0, 0, 0).
#[inline(always)]
pub fn unit_quaternion<T: Numeric>(q: [T; 4]) -> (T, [T; 4]) {
    let n = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    let (zero, one) = (n.splat(0.0), n.splat(1.0));
    let mut unit = [one, zero, zero, zero];
    for k in 0..4 {
        unit[k] = n.select_lt(f64::MIN_POSITIVE, unit[k], q[k] / n);
    }
    (n, unit)
}

/// The rotation matrix of the quaternion `q` = (w, x, y, z), normalised here; SPEC section 2, paper section 4.1.
/// The zero quaternion gives the identity.
#[inline(always)]
pub fn rotation_from_quaternion<T: Numeric>(q: [T; 4]) -> Mat3<T> {
    let (n, [w, x, y, z]) = unit_quaternion(q);
    let one = n.splat(1.0);
    [
        [one - (y * y + z * z) * 2.0, (x * y - w * z) * 2.0, (x * z + w * y) * 2.0],
        [(x * y + w * z) * 2.0, one - (x * x + z * z) * 2.0, (y * z - w * x) * 2.0],
        [(x * z - w * y) * 2.0, (y * z + w * x) * 2.0, one - (x * x + y * y) * 2.0],
    ]
}

/// A rigid transform `p_view = rotation · p_world + translation`, metres; SPEC section 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Rows of the rotation. Usually orthonormal with determinant +1; a reflection is tolerated.
    pub rotation: Mat3,
    /// Metres.
    pub translation: Vec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self { rotation: IDENTITY, translation: [0.0; 3] }
    }
}

impl Pose {
    /// Moves a point from the world frame into the view frame, metres.
    pub fn view_from_world(&self, p_world: Vec3) -> Vec3 {
        add(mat_vec(&self.rotation, p_world), self.translation)
    }

    /// Moves a point from the view frame into the world frame, metres.
    pub fn world_from_view(&self, p_view: Vec3) -> Vec3 {
        mat_t_vec(&self.rotation, sub(p_view, self.translation))
    }
}
