//! A joint's own shape and strength, which every view shares: forward and back; SPEC sections 2 and 3.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::Precision;
use super::batch::{Batch, Columns, One, Task, each_joint};
use crate::body::{Group, Pppr};
use crate::geometry::{Mat3, Number, Vec3, mat_mul, rotation_from_quaternion, scale, unit_quaternion};

/// What does not depend on where the joint is seen from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form<T = f64> {
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

/// ∂L/∂ what [`Forms`] say, summed over the views.
#[derive(Debug, Default)]
pub(super) struct FormBars {
    /// Of p and v, world frame.
    motion: Columns<6>,
    /// Of R S Sᵀ Rᵀ, world frame: xx, xy, xz, yy, yz, zz.
    covariance: Columns<6>,
    /// Of ln α and ω̄.
    strength: Columns<2>,
}

impl FormBars {
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
        One(joint).add([0.0, bar], &mut self.strength);
    }
}

/// The forms of all joints, and what their derivatives need besides.
#[derive(Debug, Default)]
pub(super) struct Forms {
    joints: usize,
    position: Columns<3>,
    velocity: Columns<3>,
    spread: Columns<9>,
    /// α, ln α and ω̄
    strength: Columns<3>,
    /// (w, x, y, z) as stored.
    quaternion: Columns<4>,
    scale: Columns<3>,
}

impl Forms {
    /// Of every joint of `params`, over what was there.
    pub(super) fn fill(&mut self, params: &Pppr, precision: Precision) {
        let joints = params.shape().total_joints();
        self.joints = joints;
        for columns in [&mut self.position, &mut self.velocity, &mut self.strength, &mut self.scale] {
            columns.hold(joints);
        }
        self.spread.hold(joints);
        self.quaternion.hold(joints);
        each_joint(precision, joints, &mut Fill { params, forms: self });
    }

    pub(super) fn joints(&self) -> usize {
        self.joints
    }

    #[inline(always)]
    pub(super) fn of<B: Batch>(&self, batch: B) -> Form<B::Number> {
        let [opacity, ln_opacity, omega_mean] = batch.load(&self.strength);
        Form {
            position: batch.load(&self.position),
            velocity: batch.load(&self.velocity),
            spread: self.spread.matrix(batch),
            opacity,
            ln_opacity,
            omega_mean,
        }
    }

    /// Adds to `gradient` what `bars` imply.
    pub(super) fn pull_back(&self, bars: &FormBars, gradient: &mut Pppr, precision: Precision) {
        each_joint(precision, self.joints, &mut PullBack { forms: self, bars, gradient });
    }
}

struct Fill<'a> {
    params: &'a Pppr,
    forms: &'a mut Forms,
}

impl Task for Fill<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { params, forms } = self;
        let numbers = |group: Group, width: usize, k: usize| {
            let of = params.group(group);
            move |joint: usize| of[width * joint + k]
        };
        let beta = batch.gather(numbers(Group::Beta, 1, 0));
        // Of e^−|β| alone: exact for large |β|.
        let (one, fading) = (beta.like(1.0), (-beta.at_least(0.0) + beta.at_most(0.0)).exp());
        let omega_mean = batch.gather(|joint| mean(params.joint(Group::Omega, joint)));
        let opacity = beta.below(0.0, fading, one) / (one + fading);
        let ln_opacity = beta.at_most(0.0) - fading.ln_1p();
        let (mut position, mut velocity, mut scale, mut quaternion) = ([one; 3], [one; 3], [one; 3], [one; 4]);
        for k in 0..3 {
            position[k] = batch.gather(numbers(Group::Position, 3, k));
            velocity[k] = batch.gather(numbers(Group::Velocity, 3, k));
            scale[k] = batch.gather(numbers(Group::LogScale, 3, k)).exp();
        }
        for k in 0..4 {
            quaternion[k] = batch.gather(numbers(Group::Rotation, 4, k));
        }
        let mut spread = rotation_from_quaternion(quaternion);
        for row in &mut spread {
            for k in 0..3 {
                row[k] = row[k] * scale[k];
            }
        }
        batch.store(position, &mut forms.position);
        batch.store(velocity, &mut forms.velocity);
        batch.store(scale, &mut forms.scale);
        batch.store(quaternion, &mut forms.quaternion);
        batch.store([opacity, ln_opacity, omega_mean], &mut forms.strength);
        forms.spread.set_matrix(batch, spread);
    }
}

struct PullBack<'a> {
    forms: &'a Forms,
    bars: &'a FormBars,
    gradient: &'a mut Pppr,
}

impl Task for PullBack<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { forms, bars, gradient } = self;
        let [ln_opacity_bar, omega_mean_bar] = batch.load(&bars.strength);
        let [opacity, ..] = batch.load(&forms.strength);
        let beta = gradient.group_mut(Group::Beta);
        batch.scatter(ln_opacity_bar * (opacity.like(1.0) - opacity), |joint, x| beta[joint] += x);
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

        let (quaternion, widths) = (batch.load(&forms.quaternion), batch.load(&forms.scale));
        let rotation = rotation_from_quaternion(quaternion);
        let [xx, xy, xz, yy, yz, zz] = batch.load(&bars.covariance);
        let covariance_bar = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let mut bar = mat_mul(&covariance_bar, &forms.spread.matrix(batch));
        for row in &mut bar {
            *row = scale(*row, widths[0].like(2.0));
        }
        let log_scale = gradient.group_mut(Group::LogScale);
        for k in 0..3 {
            let width_bar =
                (rotation[0][k] * bar[0][k]).plus(rotation[1][k], bar[1][k]).plus(rotation[2][k], bar[2][k]);
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
fn quaternion_bar<T: Number>(q: [T; 4], m: &Mat3<T>) -> [T; 4] {
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
        bar[k] = length.below(f64::MIN_POSITIVE, w.like(0.0), (bar[k] - unit[k] * along) / length);
    }
    bar
}
