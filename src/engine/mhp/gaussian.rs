//! A joint's Gaussian in the world, which every view shares: forward and back; SPEC sections 2 and 3.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::Precision;
use super::batch::{Batch, Columns, JointTask, OneJoint, each_joint};
use crate::body::{Group, Pppr};
use crate::geometry::{Mat3, Numeric, Vec3, mat_mul, rotation_from_quaternion, scale, unit_quaternion};

/// A joint's Gaussian: what does not depend on where it is seen from.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorldGaussian<T = f64> {
    /// World frame, m and m/s.
    pub position: Vec3<T>,
    pub velocity: Vec3<T>,
    /// R S, world frame, m.
    pub spread: Mat3<T>,
    pub opacity: T,
    pub ln_opacity: T,
    /// ω̄
    pub omega_mean: T,
}

/// ω̄
pub(super) fn mean(omega: &[f64]) -> f64 {
    omega.iter().sum::<f64>() / omega.len().max(1) as f64
}

/// α = σ(β) and ln α.
#[inline(always)]
pub(super) fn opacity_and_ln<T: Numeric>(beta: T) -> [T; 2] {
    // Of e^−|β| alone: exact for large |β|.
    let (one, fading) = (beta.splat(1.0), (-beta.max(0.0) + beta.min(0.0)).exp());
    [beta.select_lt(0.0, fading, one) / (one + fading), beta.min(0.0) - fading.ln_1p()]
}

/// Adjoints of [`WorldGaussians`]: ∂L by what they say, summed over the views.
#[derive(Debug, Default)]
pub(super) struct WorldGaussianBars {
    /// Of p and v, world frame.
    motion: Columns<6>,
    /// Of R S Sᵀ Rᵀ, world frame: xx, xy, xz, yy, yz, zz.
    covariance: Columns<6>,
    /// Of ln α and ω̄.
    strength: Columns<2>,
}

impl WorldGaussianBars {
    /// Zeros for so many joints.
    pub(super) fn reset(&mut self, joints: usize) {
        self.motion.reset(joints);
        self.covariance.reset(joints);
        self.strength.reset(joints);
    }

    /// Adds what one view says of `position`, `velocity`, ln α, ω̄ and the covariance's upper half, row by row.
    #[inline(always)]
    pub(super) fn add<B: Batch>(
        &mut self,
        batch: B,
        [[x, y, z], [u, v, w]]: [Vec3<B::Number>; 2],
        covariance: [B::Number; 6],
        strength: [B::Number; 2],
    ) {
        batch.add([x, y, z, u, v, w], &mut self.motion);
        batch.add(covariance, &mut self.covariance);
        batch.add(strength, &mut self.strength);
    }

    /// Adds to ∂L/∂ω̄ of one joint.
    pub(super) fn add_omega_mean(&mut self, joint: usize, bar: f64) {
        OneJoint(joint).add([0.0, bar], &mut self.strength);
    }
}

/// The Gaussians of all joints, and what their derivatives need besides.
#[derive(Debug, Default)]
pub(super) struct WorldGaussians {
    joints: usize,
    /// Whether all are round, and nobody asks how they are turned.
    round: bool,
    position: Columns<3>,
    velocity: Columns<3>,
    spread: Columns<9>,
    /// α, ln α and ω̄
    strength: Columns<3>,
    /// (w, x, y, z) as stored.
    quaternion: Columns<4>,
    scale: Columns<3>,
}

impl WorldGaussians {
    /// Of every joint of `params`, over what was there. Where all are `round`, as points of skin are, nobody asks how they are turned:
    /// the way back has no adjoint of rotations.
    pub(super) fn fill(&mut self, params: &Pppr, round: bool, precision: Precision) {
        let joints = params.shape().total_joints();
        (self.joints, self.round) = (joints, round);
        for columns in [&mut self.position, &mut self.velocity, &mut self.strength, &mut self.scale] {
            columns.hold(joints);
        }
        self.spread.hold(joints);
        self.quaternion.hold(joints);
        each_joint(precision, joints, &mut Fill { params, gaussians: self });
    }

    pub(super) fn joints(&self) -> usize {
        self.joints
    }

    #[inline(always)]
    pub(super) fn of<B: Batch>(&self, batch: B) -> WorldGaussian<B::Number> {
        let [opacity, ln_opacity, omega_mean] = batch.load(&self.strength);
        WorldGaussian {
            position: batch.load(&self.position),
            velocity: batch.load(&self.velocity),
            spread: self.spread.matrix(batch),
            opacity,
            ln_opacity,
            omega_mean,
        }
    }

    /// Adds to `gradient` what `bars` imply.
    pub(super) fn pull_back(&self, bars: &WorldGaussianBars, gradient: &mut Pppr, precision: Precision) {
        each_joint(precision, self.joints, &mut PullBack { gaussians: self, bars, gradient });
    }
}

struct Fill<'a> {
    params: &'a Pppr,
    gaussians: &'a mut WorldGaussians,
}

impl JointTask for Fill<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { params, gaussians } = self;
        let numbers = |group: Group, width: usize, k: usize| {
            let of = params.group(group);
            move |joint: usize| of[width * joint + k]
        };
        let beta = batch.gather(numbers(Group::Beta, 1, 0));
        let ([opacity, ln_opacity], one) = (opacity_and_ln(beta), beta.splat(1.0));
        let omega_mean = batch.gather(|joint| mean(params.joint(Group::Omega, joint)));
        let (mut position, mut velocity, mut scale) = ([one; 3], [one; 3], [one; 3]);
        for k in 0..3 {
            position[k] = batch.gather(numbers(Group::Position, 3, k));
            velocity[k] = batch.gather(numbers(Group::Velocity, 3, k));
        }
        let mut spread = [[one.splat(0.0); 3]; 3];
        if gaussians.round {
            scale = [batch.gather(numbers(Group::LogScale, 3, 0)).exp(); 3];
            for k in 0..3 {
                spread[k][k] = scale[k];
            }
        } else {
            let mut quaternion = [one; 4];
            for k in 0..4 {
                quaternion[k] = batch.gather(numbers(Group::Rotation, 4, k));
            }
            spread = rotation_from_quaternion(quaternion);
            for k in 0..3 {
                scale[k] = batch.gather(numbers(Group::LogScale, 3, k)).exp();
                for row in &mut spread {
                    row[k] = row[k] * scale[k];
                }
            }
            batch.store(quaternion, &mut gaussians.quaternion);
        }
        batch.store(position, &mut gaussians.position);
        batch.store(velocity, &mut gaussians.velocity);
        batch.store(scale, &mut gaussians.scale);
        batch.store([opacity, ln_opacity, omega_mean], &mut gaussians.strength);
        gaussians.spread.set_matrix(batch, spread);
    }
}

struct PullBack<'a> {
    gaussians: &'a WorldGaussians,
    bars: &'a WorldGaussianBars,
    gradient: &'a mut Pppr,
}

impl JointTask for PullBack<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { gaussians, bars, gradient } = self;
        let [ln_opacity_bar, omega_mean_bar] = batch.load(&bars.strength);
        let [opacity, ..] = batch.load(&gaussians.strength);
        let beta = gradient.group_mut(Group::Beta);
        batch.scatter(ln_opacity_bar * (opacity.splat(1.0) - opacity), |joint, x| beta[joint] += x);
        let motion = batch.load(&bars.motion);
        for (group, first) in [(Group::Position, 0), (Group::Velocity, 3)] {
            let numbers = gradient.group_mut(group);
            for k in 0..3 {
                batch.scatter(motion[first + k], |joint, x| numbers[3 * joint + k] += x);
            }
        }
        batch.scatter(omega_mean_bar, |joint, mean_bar| {
            let omega = gradient.joint_mut(Group::Omega, joint);
            let share = mean_bar / omega.len().max(1) as f64;
            for bar in omega {
                *bar += share;
            }
        });

        let widths = batch.load(&gaussians.scale);
        let [xx, xy, xz, yy, yz, zz] = batch.load(&bars.covariance);
        if gaussians.round {
            let log_scale = gradient.group_mut(Group::LogScale);
            for (k, bar) in [xx, yy, zz].into_iter().enumerate() {
                batch.scatter(bar * widths[k] * widths[k] * 2.0, |joint, x| log_scale[3 * joint + k] += x);
            }
            return;
        }
        let quaternion = batch.load(&gaussians.quaternion);
        let rotation = rotation_from_quaternion(quaternion);
        let covariance_bar = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let mut bar = mat_mul(&covariance_bar, &gaussians.spread.matrix(batch));
        for row in &mut bar {
            *row = scale(*row, widths[0].splat(2.0));
        }
        let log_scale = gradient.group_mut(Group::LogScale);
        for k in 0..3 {
            let width_bar =
                rotation[2][k].mul_add(bar[2][k], rotation[1][k].mul_add(bar[1][k], rotation[0][k] * bar[0][k]));
            batch.scatter(width_bar * widths[k], |joint, x| log_scale[3 * joint + k] += x);
            for row in &mut bar {
                row[k] = row[k] * widths[k];
            }
        }
        let (quaternion_bar, numbers) = (quaternion_bar(quaternion, &bar), gradient.group_mut(Group::Rotation));
        for k in 0..4 {
            batch.scatter(quaternion_bar[k], |joint, x| numbers[4 * joint + k] += x);
        }
    }
}

/// ∂L/∂q through the normalisation; the zero quaternion stands for the identity and has no gradient.
#[inline(always)]
fn quaternion_bar<T: Numeric>(q: [T; 4], m: &Mat3<T>) -> [T; 4] {
    let (length, unit) = unit_quaternion(q);
    let [w, x, y, z] = unit;
    let mut bar = [
        (x * (m[2][1] - m[1][2]) + y * (m[0][2] - m[2][0]) + z * (m[1][0] - m[0][1])) * 2.0,
        (w * (m[2][1] - m[1][2]) + y * (m[0][1] + m[1][0]) + z * (m[0][2] + m[2][0]) - x * 2.0 * (m[1][1] + m[2][2]))
            * 2.0,
        (w * (m[0][2] - m[2][0]) + x * (m[0][1] + m[1][0]) + z * (m[1][2] + m[2][1]) - y * 2.0 * (m[0][0] + m[2][2]))
            * 2.0,
        (w * (m[1][0] - m[0][1]) + x * (m[0][2] + m[2][0]) + y * (m[1][2] + m[2][1]) - z * 2.0 * (m[0][0] + m[1][1]))
            * 2.0,
    ];
    let along = w * bar[0] + x * bar[1] + y * bar[2] + z * bar[3];
    for k in 0..4 {
        bar[k] = length.select_lt(f64::MIN_POSITIVE, w.splat(0.0), (bar[k] - unit[k] * along) / length);
    }
    bar
}
