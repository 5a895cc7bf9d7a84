//! The scalar of the per-cell kernel: one code path, two precisions.

use num_traits::Float;
use std::ops::AddAssign;

/// f64, the oracle, or f32, the fast one.
pub(super) trait Real: Float + AddAssign + Send + Sync + 'static {
    /// A return this much weaker (in ln) than the strongest at its cell is dropped; SPEC section 3, Numerics.
    const CUTOFF_LN: Self;

    /// Rounds to this precision.
    fn from_f64(x: f64) -> Self;

    /// Widens.
    fn into_f64(self) -> f64;
}

impl Real for f64 {
    const CUTOFF_LN: Self = 50.0;

    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }

    #[inline]
    fn into_f64(self) -> f64 {
        self
    }
}

impl Real for f32 {
    const CUTOFF_LN: Self = 32.0;

    #[inline]
    fn from_f64(x: f64) -> Self {
        x as Self
    }

    #[inline]
    fn into_f64(self) -> f64 {
        f64::from(self)
    }
}
