//! The floors under H_sim, and what both evaluators of L_EM answer: the plain one in f64 and the tiles in f32.

/// ε of SPEC section 3.
pub(super) const EPSILON: f64 = 1e-30;

/// h of SPEC section 4: the floor in the logarithms of the soft mask.
pub(super) const SOFT_FLOOR: f64 = 1e-30;

/// ln √(S² + ε²) from ln S.
pub(super) fn ln_floored(ln_s: f64) -> f64 {
    ln_hypot(ln_s, EPSILON.ln())
}

fn ln_hypot(a: f64, b: f64) -> f64 {
    let (high, low) = if a >= b { (a, b) } else { (b, a) };
    // With a NaN the comparison fails and `a` is `low`: it stays visible.
    high + 0.5 * (2.0 * (low - high)).exp().ln_1p()
}

/// √(S² + ε²) from ln S, in linear f64: values that differ by less than a step of ln H near the floor stay apart, and the
/// floor itself is exactly ε, so that a strict comparison with a percentile behaves as SPEC section 4 says.
pub(super) fn floored(ln_s: f64) -> f64 {
    let s = ln_s.exp();
    // As written in SPEC: a more exact hypotenuse would decide ties at the floor differently. Beyond 1e150 ε is nothing.
    if s > 1e150 { s } else { (s * s + EPSILON * EPSILON).sqrt() }
}

/// L_EM of one view.
pub(super) struct ViewLoss {
    /// L_view
    pub loss: f64,
    /// IoU of the hard masks; `None` where both are empty.
    pub iou: Option<f64>,
}

/// `both` of `either`; `None` of nothing.
pub(super) fn share(both: usize, either: usize) -> Option<f64> {
    (either > 0).then(|| both as f64 / either as f64)
}

/// |a ∩ b| / |a ∪ b|; `None` where both are empty.
pub(super) fn hard_iou(masks: impl Iterator<Item = (bool, bool)>) -> Option<f64> {
    let (mut both, mut either) = (0_usize, 0_usize);
    for (a, b) in masks {
        both += usize::from(a && b);
        either += usize::from(a || b);
    }
    share(both, either)
}
