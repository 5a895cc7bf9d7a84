//! How bright joints and points of skin are, several at once.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the function that is compiled for an instruction set"
)]

use super::{LEAST_LN_ALPHA, Look, MOST_ALPHA, MOST_LN, Seen};
use crate::body::{Group, Pppr};
use crate::geometry::Numeric;
use crate::mhp::batch::{Batch, JointTask};
use crate::mhp::gaussian::{self, opacity_and_ln};

/// How each joint looks.
pub(super) struct TakeIn<'a> {
    pub(super) params: &'a Pppr,
    pub(super) plain: &'a [[f64; 2]],
    pub(super) looks: &'a mut [Look],
}

impl JointTask for TakeIn<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { params, plain, looks } = self;
        let beta = batch.gather(|joint| params.group(Group::Beta)[joint]);
        let [opacity, ln_opacity] = opacity_and_ln(beta);
        batch.scatter(opacity, |joint, x| looks[joint].opacity = x);
        batch.scatter(ln_opacity, |joint, x| {
            let [ln_alpha, ln_scale] = plain[joint % plain.len()];
            let scales = params.vec3(Group::LogScale, joint);
            looks[joint].ln_alpha = x - ln_alpha;
            looks[joint].ln_scale = scales.iter().sum::<f64>() / 3.0 - ln_scale;
            looks[joint].omega_mean = gaussian::mean(params.joint(Group::Omega, joint));
        });
    }
}

/// From the amplitude that a point has at the start, as its opacity, to how opaque it is.
pub(super) struct Brighten<'a> {
    pub(super) seen: &'a mut [(Seen, Look)],
    pub(super) beta: &'a mut [f64],
}

impl JointTask for Brighten<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { seen, beta } = self;
        let ln_alpha = batch.gather(|point| seen[point].1.ln_alpha).max(LEAST_LN_ALPHA).min(MOST_LN);
        let opacity = (batch.gather(|point| seen[point].1.opacity) * ln_alpha.exp()).min(MOST_ALPHA);
        batch.scatter(opacity, |point, x| seen[point].1.opacity = x);
        batch.scatter((opacity / (-opacity + 1.0)).ln(), |point, x| beta[point] = x);
    }
}
