//! The way back through one joint in one view: from moments over the cells to gradients of the joint's parameters.
//!
//! The kernel hands in what every cell of the map wants of the joint's ln-amplitude (r) and phase (q), summed with
//! powers of Δ = b − b_j. Adjoints are named after what they belong to (`d` is ∂L/∂d); those of directions and angles
//! are collected first and folded into ∂L/∂p at the end, so that each formula of `splat.rs` appears once.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

mod geometry;

use super::Precision;
use super::batch::{Batch, Columns, JointTask, OneJoint, each_joint};
use super::gaussian::{WorldGaussian, WorldGaussianBars, WorldGaussians};
use super::splat::{AxisJacobian, JointInView, ViewModel, Widths, feature_at};
use super::triad::splat_matrix;
use crate::body::{Group, Pppr};
use crate::config::Summation;
use crate::geometry::{Numeric, Vec3, add_scaled, dot, mat_t_vec, mat_vec, scale};
use crate::radar::{Axis, AxisKind};
use geometry::Geometry;
use std::ops::Range;

/// Sums over the cells of a view for one joint; r = ∂L/∂ln A_jK_j, q = ∂L/∂ψ_j. The last axis is the third;
/// those that are missing come first.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums<T = f64> {
    /// Σ r
    pub r: T,
    /// Σ q
    pub q: T,
    /// Σ r Δ
    pub r_delta: Vec3<T>,
    /// Σ q Δ
    pub q_delta: Vec3<T>,
    /// Σ r Δ Δᵀ: 00, 10, 11, 20, 21, 22.
    pub r_delta_delta: [T; 6],
}

/// Numbers of [`Sums`].
const NUMBERS: usize = 14;

/// Where the lower half of a symmetric matrix has its entry (k, l ≤ k), row by row.
const fn lower(k: usize, l: usize) -> usize {
    k * (k + 1) / 2 + l
}

/// The sums of all joints.
#[derive(Debug, Default)]
pub(super) struct Moments {
    numbers: Columns<NUMBERS>,
    /// Σ r, (joints, bins), of each bin of a Doppler axis; empty on other axes.
    r_by_bin: [Vec<f64>; 3],
    joints: usize,
}

impl Moments {
    /// All zeros for a view with these axes; keeps the memory of what was there.
    pub(super) fn reset(&mut self, joints: usize, axes: &[Axis]) {
        self.joints = joints;
        self.numbers.reset(joints);
        for by_bin in &mut self.r_by_bin {
            by_bin.clear();
        }
        for (by_bin, axis) in self.r_by_bin.iter_mut().skip(3_usize.saturating_sub(axes.len())).zip(axes) {
            by_bin.resize(if axis.kind == AxisKind::Doppler { axis.bins * joints } else { 0 }, 0.0);
        }
    }

    /// Adds to one joint's sums.
    #[inline(never)]
    pub(super) fn add(&mut self, joint: usize, sums: &Sums) {
        let Sums { r, q, r_delta: [x, y, z], q_delta: [u, v, w], r_delta_delta: [a, b, c, d, e, f] } = *sums;
        OneJoint(joint).add([r, q, x, y, z, u, v, w, a, b, c, d, e, f], &mut self.numbers);
    }

    /// Σ r of one joint in each bin of an axis, to be added to; empty unless that is a Doppler axis.
    pub(super) fn by_bin(&mut self, joint: usize, axis: usize) -> &mut [f64] {
        let bins = self.bins(joint, axis);
        &mut self.r_by_bin[axis][bins]
    }

    /// Those of `joints` joints from the `first` on, written over `into`.
    pub(super) fn part(&self, first: usize, joints: usize, into: &mut Self) {
        into.joints = joints;
        into.numbers.reset(joints);
        for joint in 0..joints {
            let numbers: [f64; NUMBERS] = OneJoint(first + joint).load(&self.numbers);
            OneJoint(joint).store(numbers, &mut into.numbers);
        }
        for (own, all) in into.r_by_bin.iter_mut().zip(&self.r_by_bin) {
            let bins = all.len() / self.joints.max(1);
            own.clear();
            own.extend_from_slice(&all[first * bins..(first + joints) * bins]);
        }
    }

    fn of_bins(&self, joint: usize, axis: usize) -> &[f64] {
        &self.r_by_bin[axis][self.bins(joint, axis)]
    }

    fn bins(&self, joint: usize, axis: usize) -> Range<usize> {
        let bins = self.r_by_bin[axis].len() / self.joints.max(1);
        joint * bins..(joint + 1) * bins
    }

    #[inline(always)]
    fn of<B: Batch>(&self, batch: B) -> Sums<B::Number> {
        let [r, q, x, y, z, u, v, w, a, b, c, d, e, f] = batch.load(&self.numbers);
        Sums { r, q, r_delta: [x, y, z], q_delta: [u, v, w], r_delta_delta: [a, b, c, d, e, f] }
    }
}

/// Adds what `moments` imply to `bars`, and to `gradient` what they say of single features; SPEC section 3.
pub(super) fn pull_back(
    model: &ViewModel<'_>,
    gaussians: &WorldGaussians,
    moments: &Moments,
    (gradient, bars): (&mut Pppr, &mut WorldGaussianBars),
    precision: Precision,
) {
    match model.dims() {
        1 => each_joint(precision, gaussians.joints(), &mut PullBack::<1> { model, gaussians, moments, bars }),
        2 => each_joint(precision, gaussians.joints(), &mut PullBack::<2> { model, gaussians, moments, bars }),
        _ => each_joint(precision, gaussians.joints(), &mut PullBack::<3> { model, gaussians, moments, bars }),
    }
    for (k, axis) in model.view.axes.iter().enumerate().take(3) {
        if axis.kind == AxisKind::Doppler {
            for joint in 0..gaussians.joints() {
                let by_bin = moments.of_bins(joint, 3 - model.dims() + k);
                features(by_bin, gradient.joint_mut(Group::Omega, joint));
                bars.add_omega_mean(joint, -by_bin.iter().sum::<f64>());
            }
        }
    }
}

struct PullBack<'a, const D: usize> {
    model: &'a ViewModel<'a>,
    gaussians: &'a WorldGaussians,
    moments: &'a Moments,
    bars: &'a mut WorldGaussianBars,
}

impl<const D: usize> JointTask for PullBack<'_, D> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { model, gaussians, moments, bars } = self;
        let (gaussian, sums) = (gaussians.of(batch), moments.of(batch));
        // The way there once more: that costs less than to keep it.
        let in_view = model.joint_in_view(&gaussian);
        let jacobians: [AxisJacobian<B::Number>; D] = model.jacobians(&in_view.triad);
        let widths = model.widths(&gaussian, &in_view, &jacobians);
        // Where powers add nothing wants a phase.
        let coherent = model.config.summation == Summation::Coherent;
        let zero = batch.splat(0.0);
        let kappa = if coherent { model.kappa(&gaussian, &in_view, &jacobians) } else { [zero; D] };
        let (squares, _) = model.squares(&in_view, &widths);
        let mut geometry = Geometry::nothing(zero);
        let (c_bar, b_bar) = covariance_and_bin_bars(&squares.precision(), kappa, &sums);
        let covariance_bar = spread_bars(&mut geometry, model, &gaussian, (&in_view, &jacobians, &widths), &c_bar);
        for k in 0..D {
            let axis = &model.view.axes[k];
            if model.sees(axis.kind) {
                geometry.coordinate(&in_view, axis, b_bar[k] * model.by_step[k]);
            }
        }
        let mut omega_mean_bar = zero;
        if coherent {
            omega_mean_bar = ramp(&mut geometry, model, (&gaussian, &in_view, &jacobians), &sums);
            phases(&mut geometry, model, &in_view, sums.q);
        }
        if model.config.operators.attenuation {
            geometry.d -= sums.r * 4.0 / in_view.triad.d.value;
        }
        let (p_bar, v_bar) = geometry.fold(model, &in_view);
        let turn = splat_matrix(sums.r, model.view.pose.rotation);
        let motion = [mat_t_vec(&turn, p_bar), mat_t_vec(&turn, v_bar)];
        bars.add(batch, motion, covariance_bar, [sums.r, omega_mean_bar]);
    }
}

/// ∂L/∂C = ½ P (Σ rΔΔᵀ) P − ½ P Σr and ∂L/∂b = P ΣrΔ − κ Σq.
#[inline(always)]
fn covariance_and_bin_bars<T: Numeric, const D: usize>(
    p: &[[T; D]; D],
    kappa: [T; D],
    sums: &Sums<T>,
) -> ([[T; D]; D], [T; D]) {
    let zero = sums.r.splat(0.0);
    let (mut half, mut c_bar, mut b_bar) = ([[zero; D]; D], [[zero; D]; D], [zero; D]);
    let first = 3 - D;
    for k in 0..D {
        b_bar[k] = -(kappa[k] * sums.q);
        for l in 0..D {
            b_bar[k] = p[k][l].mul_add(sums.r_delta[first + l], b_bar[k]);
            for m in 0..D {
                let r_delta_delta = sums.r_delta_delta[lower(first + m.max(l), first + m.min(l))];
                half[k][l] = p[k][m].mul_add(r_delta_delta, half[k][l]);
            }
        }
    }
    for k in 0..D {
        for l in 0..=k {
            let mut sum = -(p[k][l] * sums.r);
            for m in 0..D {
                sum = half[k][m].mul_add(p[m][l], sum);
            }
            c_bar[k][l] = sum * 0.5;
            c_bar[l][k] = c_bar[k][l];
        }
    }
    (c_bar, b_bar)
}

/// C from how wide the joint and the point spread are along the axes: hands on what the axes' directions, lengths and
/// the point spread want, and returns the adjoint of R S Sᵀ Rᵀ, its upper half row by row.
#[inline(always)]
fn spread_bars<T: Numeric, const D: usize>(
    geometry: &mut Geometry<T>,
    model: &ViewModel<'_>,
    gaussian: &WorldGaussian<T>,
    (in_view, jacobians, widths): (&JointInView<T>, &[AxisJacobian<T>; D], &[Widths<T>; D]),
    c_bar: &[[T; D]; D],
) -> [T; 6] {
    let zero = gaussian.opacity.splat(0.0);
    let turn = splat_matrix(zero, model.view.pose.rotation);
    let directions = [in_view.triad.u, in_view.triad.e_az, in_view.triad.e_el];
    let (mut covariance_bar, mut blur_bar) = ([zero; 6], [zero; 3]);
    for k in 0..D {
        // What C̅ makes of all axes for this one.
        let mut mixed = Widths { gradient: [zero; 3], own: [zero; 3], along_triad: [zero; 3] };
        for l in 0..D {
            add_scaled(&mut mixed.gradient, widths[l].gradient, c_bar[k][l]);
            add_scaled(&mut mixed.own, widths[l].own, c_bar[k][l]);
            add_scaled(&mut mixed.along_triad, widths[l].along_triad, c_bar[k][l]);
        }
        let mut entry = 0;
        for i in 0..3 {
            for j in i..3 {
                covariance_bar[entry] = widths[k].gradient[i].mul_add(mixed.gradient[j], covariance_bar[entry]);
                entry += 1;
            }
        }
        // ½ ∂L/∂(∂b/∂p), view frame.
        let mut gradient_bar = mat_vec(&turn, mat_vec(&gaussian.spread, mixed.own));
        for i in 0..3 {
            if model.blurs[i] {
                let pull = in_view.blur[i] * in_view.blur[i] * mixed.along_triad[i];
                add_scaled(&mut gradient_bar, directions[i], pull);
                geometry.blurred(i, scale(jacobians[k].gradient, pull * 2.0));
                blur_bar[i] = widths[k].along_triad[i].mul_add(mixed.along_triad[i], blur_bar[i]);
            }
        }
        let axis = &model.view.axes[k];
        if model.sees(axis.kind) {
            let jacobian = &jacobians[k];
            let jacobian_bar = scale(gradient_bar, zero.splat(2.0 * model.by_step[k]));
            geometry.direction(in_view, axis, scale(jacobian_bar, jacobian.ratio));
            if axis.kind.is_angular() {
                let along = dot(jacobian_bar, jacobian.direction);
                geometry.arm(axis.kind, -along * jacobian.ratio / jacobian.arm);
                geometry.slope(in_view, axis, along / jacobian.arm);
            }
        }
    }
    blur(geometry, model, in_view, blur_bar);
    covariance_bar
}

/// κ_k = ω̄ v·D_k; returns ∂L/∂ω̄.
#[inline(always)]
fn ramp<T: Numeric, const D: usize>(
    geometry: &mut Geometry<T>,
    model: &ViewModel<'_>,
    (gaussian, in_view, jacobians): (&WorldGaussian<T>, &JointInView<T>, &[AxisJacobian<T>; D]),
    sums: &Sums<T>,
) -> T {
    let mut omega_mean_bar = sums.q.splat(0.0);
    if !model.config.operators.doppler {
        return omega_mean_bar;
    }
    for k in 0..D {
        let (jacobian, axis) = (&jacobians[k], &model.view.axes[k]);
        let kappa_bar = sums.q_delta[3 - D + k];
        let by_omega_mean = kappa_bar * gaussian.omega_mean;
        omega_mean_bar = kappa_bar.mul_add(dot(in_view.velocity, jacobian.displacement), omega_mean_bar);
        add_scaled(&mut geometry.v, jacobian.displacement, by_omega_mean);
        let displacement_bar = scale(in_view.velocity, by_omega_mean * model.step[k]);
        geometry.direction(in_view, axis, scale(displacement_bar, jacobian.by_ratio));
        if axis.kind.is_angular() {
            let along = dot(displacement_bar, jacobian.direction) / jacobian.slope;
            geometry.arm(axis.kind, along);
            geometry.slope(in_view, axis, -along * jacobian.by_ratio);
        }
    }
    omega_mean_bar
}

#[inline(always)]
fn phases<T: Numeric>(geometry: &mut Geometry<T>, model: &ViewModel<'_>, in_view: &JointInView<T>, phase_bar: T) {
    let [d, radial, azimuth, elevation] = model.phase_slopes(&in_view.triad);
    geometry.d += phase_bar * d;
    geometry.radial += phase_bar * radial;
    geometry.azimuth += phase_bar * azimuth;
    geometry.elevation += phase_bar * elevation;
}

/// The point spread along e_az and e_el grows with distance; `bar` is ½ of what each wants times itself.
#[inline(always)]
fn blur<T: Numeric>(geometry: &mut Geometry<T>, model: &ViewModel<'_>, in_view: &JointInView<T>, bar: [T; 3]) {
    let (triad, psf) = (&in_view.triad, &model.psf);
    if model.blurs[1] {
        let bar = in_view.blur[1] * 2.0 * bar[1] / triad.cos_az_floored.value;
        geometry.rho += bar * psf.azimuth_rad;
        geometry.azimuth += bar * in_view.blur[1] * triad.sin_az * triad.cos_az_floored.pass;
    }
    if model.blurs[2] {
        let bar = in_view.blur[2] * 2.0 * bar[2] / triad.cos_el_floored.value;
        geometry.d += bar * psf.elevation_rad;
        geometry.elevation += bar * in_view.blur[2] * triad.sin_el * triad.cos_el_floored.pass;
    }
}

/// The spectrum's exp(ω(t)); what its mean wants is summed apart.
fn features(by_bin: &[f64], omega: &mut [f64]) {
    let count = omega.len();
    for (bin, &r) in by_bin.iter().enumerate() {
        let (lower, t) = feature_at(bin, by_bin.len(), count);
        if let Some(entry) = omega.get_mut(lower) {
            *entry += r * (1.0 - t);
        }
        if let (true, Some(entry)) = (t != 0.0, omega.get_mut(lower + 1)) {
            *entry += r * t;
        }
    }
}
