//! The convergence criterion of SPEC section 4, or of the paper's section 5.5.4 to the letter; and when a fit has settled.

use crate::body::{Pppr, Skeleton};
use crate::config::{Convergence, FitConfig};
use crate::geometry::{Vec3, dot, norm, sub};

/// Iterations that a fit is looked at over to say that it has settled, and how little may change meanwhile: share of the
/// loss, m of each joint at `SETTLED_RATE`.
pub const SETTLED_OVER: usize = 10;
const SETTLED_LOSS: f64 = 1e-3;
const SETTLED_M: f64 = 2e-3;
/// The learning rate, m, at which joints that all move one way move five times as far. Adam's steps are the mean gradient in units of
/// its own size times the rate: against the rate, a way that is short says that the gradient is small.
const SETTLED_RATE: f64 = 1e-3;

/// How far back the loss is compared.
pub(super) const LOOK_BACK: usize = 5;
const SMALL_LOSS: f64 = 1.0;
const SMALL_CHANGE: f64 = 0.005;
const BONE_RATIO: [f64; 2] = [0.5, 1.5];

/// (L < 1, or the loss of five iterations ago differs by under half a percent, or with [`Convergence::Improvement`] is not
/// half a percent larger) and every joint finite and every bone within 0.5 to 1.5 of its reference. `losses` ends with the
/// current one.
pub(super) fn converged(criterion: Convergence, skeleton: &Skeleton, params: &Pppr, losses: &[f64]) -> bool {
    let Some(&now) = losses.last() else { return false };
    let before = losses.len().checked_sub(LOOK_BACK + 1).and_then(|i| losses.get(i));
    let progress = |before: f64| match criterion {
        Convergence::Change => (before - now).abs(),
        Convergence::Improvement => before - now,
    };
    let settled = before.is_some_and(|&before| progress(before) < SMALL_CHANGE * before.abs());
    (now < SMALL_LOSS || settled) && params.is_finite() && bones_plausible(skeleton, params)
}

/// Whether a fit moves no more: from [`SETTLED_OVER`] iterations ago (first) to now (second) the loss changed by less than 0.1 %,
/// no joint moved more than 2 mm, and none by more than a fifth of what the learning rate lets it, so that the gradient is
/// small too. Joints in m.
pub fn has_settled(config: &FitConfig, [before, now]: [f64; 2], [from, to]: [&[Vec3]; 2]) -> bool {
    let rate = config.learning_rates.position.unwrap_or(config.learning_rate);
    let most_m = SETTLED_M * (rate / SETTLED_RATE).min(1.0);
    let flat = (now - before).abs() <= SETTLED_LOSS * before.abs();
    let still = !from.is_empty() && from.len() == to.len();
    flat && still && from.iter().zip(to).all(|(a, b)| norm(sub(*a, *b)) <= most_m)
}

fn bones_plausible(skeleton: &Skeleton, params: &Pppr) -> bool {
    let joints = params.shape().joints;
    (0..params.shape().persons).all(|person| {
        skeleton.bones.iter().zip(&skeleton.bone_lengths_m).all(|(bone, &reference)| {
            // Squares need neither root nor quotient.
            let [m, n] = bone.map(|joint| params.position(person * joints + joint));
            let e = sub(m, n);
            let length_sq = dot(e, e);
            let bounds = BONE_RATIO.map(|ratio| (ratio * reference) * (ratio * reference));
            (bounds[0]..=bounds[1]).contains(&length_sq)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::terms::tests::two_joints;
    use super::*;

    #[test]
    fn needs_a_small_or_settled_loss() {
        let (skeleton, params) = two_joints(0.4);
        let converged = |losses: &[f64]| converged(Convergence::Change, &skeleton, &params, losses);
        assert!(converged(&[0.99]));
        assert!(!converged(&[1.0]));
        assert!(!converged(&[3.0, 3.0, 3.0, 3.0, 3.0]), "five losses look back four");
        assert!(converged(&[3.0, 9.0, 9.0, 9.0, 9.0, 2.99]));
        assert!(!converged(&[3.0, 9.0, 9.0, 9.0, 9.0, 2.98]));
    }

    #[test]
    fn a_loss_that_rises_has_not_improved_but_changed() {
        let (skeleton, params) = two_joints(0.4);
        let converged = |criterion, losses: &[f64]| converged(criterion, &skeleton, &params, losses);
        let rising = [2.0, 2.2, 2.4, 2.6, 2.8, 3.0];
        assert!(!converged(Convergence::Change, &rising));
        assert!(converged(Convergence::Improvement, &rising), "the paper's words count it");
        let falling = [3.0, 2.8, 2.6, 2.4, 2.2, 2.0];
        assert!(!converged(Convergence::Change, &falling) && !converged(Convergence::Improvement, &falling));
    }

    #[test]
    fn needs_finite_joints_and_plausible_bones() {
        for (distance_m, want) in [(0.19, false), (0.21, true), (0.59, true), (0.61, false), (f64::NAN, false)] {
            let (skeleton, params) = two_joints(distance_m);
            assert_eq!(converged(Convergence::Change, &skeleton, &params, &[0.5]), want, "{distance_m}");
        }
    }
}
