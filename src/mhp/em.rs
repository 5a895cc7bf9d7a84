//! L_EM on one view: soft mask of H_sim against the hard mask of H_ori; SPEC section 4.

use super::adjoint::{Moments, pull_back};
use super::kernel::Kernel;
use super::percentile::percentile;
use super::region::Region;
use super::scalar::Real;
use super::simulate::{EPSILON, floored, ln_floored};
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

/// Evaluates L_view over `region`, and adds its gradient times `scale` to `gradient` where one is given: (`scale`,
/// `gradient`). `target` is B_ori over the region's cells in C order.
pub(super) fn evaluate<T: Real>(
    scene: &Scene<'_>,
    params: &Pppr,
    region: &Region,
    target: &[bool],
    gradient: Option<(f64, &mut Pppr)>,
) -> ViewAnswer {
    let joints = params.shape().total_joints();
    let (splats, traces): (Vec<Splat>, Vec<Trace>) = (0..joints).map(|j| scene.splat(params, j)).unzip();
    let mut kernel = Kernel::<T>::new(&splats, &region.bins, scene.config.summation);
    let mut ln_s = vec![f64::NEG_INFINITY; region.cells()];
    kernel.forward(&mut ln_s);

    let mask = SoftMask::new(&ln_s, target, scene.config.tau_pct, scene.config.softness);
    if let Some((scale, gradient)) = gradient {
        let mut moments = vec![empty_moments(scene); joints];
        kernel.backward(&mask.weight(&ln_s, target, scale), &mut moments);
        for (joint, moments) in moments.iter().enumerate() {
            pull_back(scene, &splats[joint], &traces[joint], moments, joint, gradient);
        }
    }
    ViewAnswer { loss: mask.loss(), iou: mask.iou }
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

/// The soft mask of H_sim and what it has in common with the hard mask of H_ori.
struct SoftMask {
    ln_h: Vec<f64>,
    /// m
    soft: Vec<f64>,
    softness: f64,
    /// Σ m B
    common: f64,
    /// Σ (m + B − m B)
    union: f64,
    /// IoU of the hard masks.
    iou: Option<f64>,
}

impl SoftMask {
    fn new(ln_s: &[f64], target: &[bool], tau_pct: f64, softness: f64) -> Self {
        let ln_h: Vec<f64> = ln_s.iter().map(|&x| ln_floored(x)).collect();
        let h: Vec<f64> = ln_s.iter().map(|&x| floored(x)).collect();
        let threshold = percentile(&h, 100.0 - tau_pct);
        let iou = hard_iou(h.iter().zip(target).map(|(&h, &b)| (h > threshold, b)));
        let soft_threshold = ln_sum(threshold.ln(), SOFT_FLOOR.ln());
        let soften = |&h: &f64| sigmoid((ln_sum(h, SOFT_FLOOR.ln()) - soft_threshold) / softness);
        let soft: Vec<f64> = ln_h.iter().map(soften).collect();
        let (mut common, mut union) = (0.0, 0.0);
        for (&m, &b) in soft.iter().zip(target) {
            let b = f64::from(u8::from(b));
            common += m * b;
            union += m + b - m * b;
        }
        Self { ln_h, soft, softness, common, union, iou }
    }

    /// L_view; 1 where both masks are empty.
    fn loss(&self) -> f64 {
        if self.union == 0.0 { 1.0 } else { 1.0 - self.common / self.union }
    }

    /// ∂(scale · L)/∂ln|S| of every cell; the threshold is held constant.
    fn weight(&self, ln_s: &[f64], target: &[bool], scale: f64) -> Vec<f64> {
        if self.union == 0.0 {
            return vec![0.0; ln_s.len()];
        }
        let cells = self.soft.iter().zip(target).zip(ln_s.iter().zip(&self.ln_h));
        let weight = cells.map(|((&m, &b), (&ln_s, &ln_h))| {
            let loss_by_m = if b { -1.0 / self.union } else { self.common / (self.union * self.union) };
            // d ln(H + h)/d ln H and d ln H/d ln|S|
            let above_soft_floor = sigmoid(ln_h - SOFT_FLOOR.ln());
            let above_floor = sigmoid(2.0 * (ln_s - EPSILON.ln()));
            scale * loss_by_m * m * (1.0 - m) / self.softness * above_soft_floor * above_floor
        });
        weight.collect()
    }
}

/// ln(eᵃ + eᵇ)
fn ln_sum(a: f64, b: f64) -> f64 {
    let (high, low) = if a >= b { (a, b) } else { (b, a) };
    high + (low - high).exp().ln_1p()
}

fn sigmoid(x: f64) -> f64 {
    if x >= 0.0 { 1.0 / (1.0 + (-x).exp()) } else { x.exp() / (1.0 + x.exp()) }
}
