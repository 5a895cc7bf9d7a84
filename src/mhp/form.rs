//! A joint's own shape and strength, which every view shares: forward and back; SPEC sections 2 and 3.

use crate::body::{Group, Pppr};
use crate::geometry::{Mat3, Vec3, mat_mul, rotation_from_quaternion, scale};

/// What does not depend on where the joint is seen from.
#[derive(Debug, Clone)]
pub(super) struct Form {
    pub opacity: f64,
    pub ln_opacity: f64,
    /// (w, x, y, z) as stored.
    quaternion: [f64; 4],
    rotation: Mat3,
    scale: Vec3,
    /// R S, world frame, m.
    pub spread: Mat3,
    /// ω̄
    pub omega_mean: f64,
}

impl Form {
    /// That of flat joint `joint`.
    pub(super) fn new(params: &Pppr, joint: usize) -> Self {
        let quaternion = params.rotation(joint);
        let (rotation, scale) = (rotation_from_quaternion(quaternion), params.scale(joint));
        let omega = params.joint(Group::Omega, joint);
        let beta = params.joint(Group::Beta, joint)[0];
        // Of e^−|β| alone: exact for large |β|.
        let fading = (-beta.abs()).exp();
        Self {
            opacity: if beta >= 0.0 { 1.0 } else { fading } / (1.0 + fading),
            ln_opacity: beta.min(0.0) - fading.ln_1p(),
            quaternion,
            spread: std::array::from_fn(|i| std::array::from_fn(|k| rotation[i][k] * scale[k])),
            rotation,
            scale,
            omega_mean: omega.iter().sum::<f64>() / omega.len().max(1) as f64,
        }
    }

    /// Of every joint, into `forms`.
    pub(super) fn all(params: &Pppr, forms: &mut Vec<Self>) {
        forms.clear();
        forms.extend((0..params.shape().total_joints()).map(|joint| Self::new(params, joint)));
    }

    /// Adds what ∂L/∂(R S Sᵀ Rᵀ), world frame and symmetric, implies to joint `joint` of `gradient`.
    pub(super) fn pull_back(&self, covariance_bar: &Mat3, joint: usize, gradient: &mut Pppr) {
        let spread_bar = mat_mul(covariance_bar, &self.spread).map(|row| scale(row, 2.0));
        let log_scale = gradient.joint_mut(Group::LogScale, joint);
        for k in 0..3 {
            let scale_bar: f64 = (0..3).map(|i| self.rotation[i][k] * spread_bar[i][k]).sum();
            log_scale[k] += scale_bar * self.scale[k];
        }
        let rotation_bar: Mat3 = std::array::from_fn(|i| std::array::from_fn(|k| spread_bar[i][k] * self.scale[k]));
        let bar = quaternion_bar(self.quaternion, &rotation_bar);
        for (sum, term) in gradient.joint_mut(Group::Rotation, joint).iter_mut().zip(bar) {
            *sum += term;
        }
    }
}

/// ∂L/∂q through the normalisation; the zero quaternion stands for the identity and has no gradient.
fn quaternion_bar(q: [f64; 4], m: &Mat3) -> [f64; 4] {
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 {
        return [0.0; 4];
    }
    let [w, x, y, z] = q.map(|c| c / length);
    let unit_bar = [
        2.0 * (x * (m[2][1] - m[1][2]) + y * (m[0][2] - m[2][0]) + z * (m[1][0] - m[0][1])),
        2.0 * (w * (m[2][1] - m[1][2]) + y * (m[0][1] + m[1][0]) + z * (m[0][2] + m[2][0])
            - 2.0 * x * (m[1][1] + m[2][2])),
        2.0 * (w * (m[0][2] - m[2][0]) + x * (m[0][1] + m[1][0]) + z * (m[1][2] + m[2][1])
            - 2.0 * y * (m[0][0] + m[2][2])),
        2.0 * (w * (m[1][0] - m[0][1]) + x * (m[0][2] + m[2][0]) + y * (m[1][2] + m[2][1])
            - 2.0 * z * (m[0][0] + m[1][1])),
    ];
    let along = w * unit_bar[0] + x * unit_bar[1] + y * unit_bar[2] + z * unit_bar[3];
    let unit = [w, x, y, z];
    std::array::from_fn(|i| (unit_bar[i] - unit[i] * along) / length)
}
