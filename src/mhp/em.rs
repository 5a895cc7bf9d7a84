//! L_EM on one view: soft mask of H_sim against the hard mask of H_ori; SPEC section 4.

use super::adjoint::{Moments, pull_back};
use super::kernel::Kernel;
use super::percentile::ln_percentile;
use super::region::Region;
use super::scalar::Real;
use super::simulate::{EPSILON, ln_floored};
use super::splat::{Scene, Splat, Trace};
use crate::body::Pppr;
use crate::radar::AxisKind;

/// h of SPEC section 4: the floor in the logarithms of the soft mask.
const SOFT_FLOOR: f64 = 1e-30;

/// What one view says.
pub(super) struct ViewAnswer {
    /// L_view
    pub loss: f64,
    /// IoU of the hard masks; `None` where both are empty.
    pub iou: Option<f64>,
}

/// |a ∩ b| / |a ∪ b|; `None` where both are empty.
pub(super) fn hard_iou(masks: impl Iterator<Item = (bool, bool)>) -> Option<f64> {
    let (mut both, mut either) = (0_usize, 0_usize);
    for (a, b) in masks {
        both += usize::from(a && b);
        either += usize::from(a || b);
    }
    (either > 0).then(|| both as f64 / either as f64)
}

/// Evaluates L_view over `region` and adds its gradient times `gradient_scale` to `gradient`. `target` is B_ori over
/// the region's cells in C order.
pub(super) fn evaluate<T: Real>(
    scene: &Scene<'_>,
    params: &Pppr,
    region: &Region,
    target: &[bool],
    gradient_scale: f64,
    gradient: &mut Pppr,
) -> ViewAnswer {
    let joints = params.shape().total_joints();
    let (splats, traces): (Vec<Splat>, Vec<Trace>) = (0..joints).map(|j| scene.splat(params, j)).unzip();
    let mut kernel = Kernel::<T>::new(&splats, &region.bins, scene.config.summation);
    let mut ln_s = vec![f64::NEG_INFINITY; region.cells()];
    kernel.forward(&mut ln_s);

    let (answer, weight) = soft_iou(&ln_s, target, scene.config.tau_pct, scene.config.softness, gradient_scale);
    let mut moments = vec![empty_moments(scene); joints];
    kernel.backward(&weight, &mut moments);
    for (joint, moments) in moments.iter().enumerate() {
        pull_back(scene, &splats[joint], &traces[joint], moments, joint, gradient);
    }
    answer
}

fn empty_moments(scene: &Scene<'_>) -> Moments {
    let mut moments = Moments::default();
    for (axis, by_bin) in scene.view.axes.iter().zip(&mut moments.r_by_bin) {
        if axis.kind == AxisKind::Doppler {
            *by_bin = vec![0.0; axis.bins];
        }
    }
    moments
}

/// The loss, and ∂(scale · L)/∂ln|S| of every cell; the threshold is held constant.
fn soft_iou(ln_s: &[f64], target: &[bool], tau_pct: f64, softness: f64, scale: f64) -> (ViewAnswer, Vec<f64>) {
    let ln_h: Vec<f64> = ln_s.iter().map(|&x| ln_floored(x)).collect();
    let threshold = ln_percentile(&ln_h, 100.0 - tau_pct);
    let iou = hard_iou(ln_h.iter().zip(target).map(|(&h, &b)| (h > threshold, b)));
    let soft_threshold = ln_sum(threshold, SOFT_FLOOR.ln());
    let soft: Vec<f64> =
        ln_h.iter().map(|&h| sigmoid((ln_sum(h, SOFT_FLOOR.ln()) - soft_threshold) / softness)).collect();

    let (mut common, mut union) = (0.0, 0.0);
    for (&m, &b) in soft.iter().zip(target) {
        let b = f64::from(u8::from(b));
        common += m * b;
        union += m + b - m * b;
    }
    if union == 0.0 {
        return (ViewAnswer { loss: 1.0, iou }, vec![0.0; ln_s.len()]);
    }
    let weight = soft.iter().zip(target).zip(ln_s.iter().zip(&ln_h)).map(|((&m, &b), (&ln_s, &ln_h))| {
        let loss_by_m = if b { -1.0 / union } else { common / (union * union) };
        // d ln(H + h)/d ln H and d ln H/d ln|S|
        let above_soft_floor = sigmoid(ln_h - SOFT_FLOOR.ln());
        let above_floor = sigmoid(2.0 * (ln_s - EPSILON.ln()));
        scale * loss_by_m * m * (1.0 - m) / softness * above_soft_floor * above_floor
    });
    (ViewAnswer { loss: 1.0 - common / union, iou }, weight.collect())
}

/// ln(eᵃ + eᵇ)
fn ln_sum(a: f64, b: f64) -> f64 {
    let (high, low) = if a >= b { (a, b) } else { (b, a) };
    high + (low - high).exp().ln_1p()
}

fn sigmoid(x: f64) -> f64 {
    if x >= 0.0 { 1.0 / (1.0 + (-x).exp()) } else { x.exp() / (1.0 + x.exp()) }
}
