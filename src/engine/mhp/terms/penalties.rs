//! What several terms are made of.

use crate::geometry::{Vec3, dot, scale};

/// δ of the pseudo-Huber function ψ.
const HUBER_DELTA: f64 = 1e-3;
/// Under the root of a length: keeps its derivative finite.
const LENGTH_FLOOR_SQ: f64 = 1e-12;

/// ψ(x) = √(x² + δ²) − δ, written so that small x keeps its digits, and its derivative.
pub(super) fn pseudo_huber(x: f64) -> (f64, f64) {
    let root = (x * x + HUBER_DELTA * HUBER_DELTA).sqrt();
    let beyond = root + HUBER_DELTA;
    let by_both = x / (root * beyond);
    (x * root * by_both, beyond * by_both)
}

/// How far `x` lies outside ± `tolerance`, with its sign.
pub(super) fn beyond(x: f64, tolerance: f64) -> f64 {
    x - x.max(-tolerance).min(tolerance)
}

/// ‖e‖, never quite 0.
pub(super) fn length(e: Vec3) -> f64 {
    (dot(e, e) + LENGTH_FLOOR_SQ).sqrt()
}

/// max(0, limit − √(‖e‖² + …))² for both orders of a pair, and the gradient with respect to e.
pub(super) fn repulsion(e: Vec3, limit: f64) -> Option<(f64, Vec3)> {
    let l = length(e);
    let gap = limit - l;
    (gap > 0.0).then(|| (2.0 * gap * gap, scale(e, -4.0 * gap / l)))
}
