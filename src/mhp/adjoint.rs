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
use super::batch::{Batch, Columns, Task, each_joint};
use super::form::{Form, Forms};
use super::seen::uniform;
use super::splat::{Image, Look, Row, Scene, feature_at};
use crate::body::{Group, Pppr};
use crate::geometry::{Mat3, Number, Vec3, add_scaled, dot, mat_mul, mat_t_vec, mat_vec, scale, transpose};
use crate::radar::{Axis, AxisKind};
use geometry::Geometry;

/// Sums over the cells of a view for one joint; r = ∂L/∂ln A_jK_j, q = ∂L/∂ψ_j.
#[derive(Debug, Clone, Default)]
pub(super) struct Moments {
    /// Number of axes, 1 to 3.
    pub dims: usize,
    /// Σ r
    pub r: f64,
    /// Σ r Δ
    pub r_delta: [f64; 3],
    /// Σ r Δ Δᵀ
    pub r_delta_delta: Mat3,
    /// Σ q
    pub q: f64,
    /// Σ q Δ
    pub q_delta: [f64; 3],
    /// Σ r of each bin of a Doppler axis; empty on other axes.
    pub r_by_bin: [Vec<f64>; 3],
}

impl Moments {
    /// All zeros for a view with these axes; keeps the memory of what was there.
    pub(super) fn clear(&mut self, axes: &[Axis]) {
        let Self { dims, r, r_delta, r_delta_delta, q, q_delta, r_by_bin } = self;
        *dims = axes.len().min(3);
        (*r, *r_delta, *r_delta_delta) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        (*q, *q_delta) = (0.0, [0.0; 3]);
        for (by_bin, axis) in r_by_bin.iter_mut().zip(axes) {
            by_bin.clear();
            by_bin.resize(if axis.kind == AxisKind::Doppler { axis.bins } else { 0 }, 0.0);
        }
    }
}

/// Some joints' [`Moments`], but for what is summed a bin.
#[derive(Clone, Copy)]
struct Wants<T> {
    r: T,
    r_delta: Vec3<T>,
    r_delta_delta: Mat3<T>,
    q: T,
    q_delta: Vec3<T>,
}

impl<T: Number> Wants<T> {
    #[inline(always)]
    fn new<B: Batch<Number = T>>(batch: B, moments: &[Moments], dims: usize) -> Self {
        let zero = batch.all(0.0);
        let (r, q) = (batch.gather(|joint| moments[joint].r), batch.gather(|joint| moments[joint].q));
        let mut wants = Self { r, r_delta: [zero; 3], r_delta_delta: [[zero; 3]; 3], q, q_delta: [zero; 3] };
        for k in 0..dims {
            wants.r_delta[k] = batch.gather(|joint| moments[joint].r_delta[k]);
            wants.q_delta[k] = batch.gather(|joint| moments[joint].q_delta[k]);
            for l in 0..dims {
                wants.r_delta_delta[k][l] = batch.gather(|joint| moments[joint].r_delta_delta[k][l]);
            }
        }
        wants
    }
}

/// Adds the gradient that `moments` imply to `gradient`, but for shape, whose adjoint ∂L/∂(R S Sᵀ Rᵀ) is added to
/// `covariance_bar`; SPEC section 3.
pub(super) fn pull_back(
    scene: &Scene<'_>,
    forms: &Forms,
    moments: &[Moments],
    (gradient, covariance_bar): (&mut Pppr, &mut Columns<9>),
    precision: Precision,
) {
    each_joint(precision, forms.joints(), &mut PullBack { scene, forms, moments, gradient, covariance_bar });
}

struct PullBack<'a> {
    scene: &'a Scene<'a>,
    forms: &'a Forms,
    moments: &'a [Moments],
    gradient: &'a mut Pppr,
    covariance_bar: &'a mut Columns<9>,
}

impl Task for PullBack<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { scene, forms, moments, gradient, covariance_bar } = self;
        let (form, wants) = (forms.of(batch), Wants::new(batch, moments, scene.dims()));
        // The way there once more: that costs less than to keep it.
        let look = scene.look(&form);
        let rows = scene.rows(&look.seen);
        let image = scene.image(&form, &look, &rows);
        let mut geometry = Geometry::nothing(batch.all(0.0));
        let (c_bar, b_bar) = gaussian(&image, &wants);
        let blurred_bar = covariance(&mut geometry, scene, (&look, &rows), &c_bar);
        coordinates(&mut geometry, scene, &look, b_bar);
        let omega_mean_bar = ramp(&mut geometry, scene, (&form, &look, &rows), &wants);
        phases(&mut geometry, scene, &look, wants.q);
        if scene.config.operators.attenuation {
            geometry.d -= wants.r * 4.0 / look.seen.d.value;
        }
        blur(&mut geometry, scene, &look, &blurred_bar);

        let (p_bar, v_bar) = geometry.fold(scene, &look);
        let turn = uniform(wants.r, scene.view.pose.rotation);
        for (group, bar) in [(Group::Position, mat_t_vec(&turn, p_bar)), (Group::Velocity, mat_t_vec(&turn, v_bar))] {
            let numbers = gradient.group_mut(group);
            for k in 0..3 {
                batch.scatter(bar[k], |joint, x| numbers[3 * joint + k] += x);
            }
        }
        let beta = gradient.group_mut(Group::Beta);
        batch.scatter(wants.r * (wants.r.like(1.0) - form.opacity), |joint, x| beta[joint] += x);
        let bar = mat_mul(&transpose(&turn), &mat_mul(&blurred_bar, &turn));
        let mut sum = covariance_bar.matrix(batch);
        for k in 0..3 {
            add_scaled(&mut sum[k], bar[k], wants.r.like(1.0));
        }
        covariance_bar.set_matrix(batch, sum);
        batch.scatter(omega_mean_bar, |joint, mean| {
            features(&moments[joint], mean, gradient.joint_mut(Group::Omega, joint));
        });
    }
}

/// ∂L/∂C = ½ P (Σ rΔΔᵀ) P − ½ P Σr and ∂L/∂b = P ΣrΔ − κ Σq.
#[inline(always)]
fn gaussian<T: Number>(image: &Image<T>, wants: &Wants<T>) -> (Mat3<T>, Vec3<T>) {
    let p = &image.precision;
    let mut c_bar = mat_mul(&mat_mul(p, &wants.r_delta_delta), p);
    let mut b_bar = mat_vec(p, wants.r_delta);
    for k in 0..3 {
        b_bar[k] -= image.kappa[k] * wants.q;
        for l in 0..3 {
            c_bar[k][l] = (c_bar[k][l] - p[k][l] * wants.r) * 0.5;
        }
    }
    (c_bar, b_bar)
}

/// C = G Σ' Gᵀ: hands G̅ to the axes' directions and returns Σ̅'.
#[inline(always)]
fn covariance<T: Number>(
    geometry: &mut Geometry<T>,
    scene: &Scene<'_>,
    (look, rows): (&Look<T>, &[Row<T>; 3]),
    c_bar: &Mat3<T>,
) -> Mat3<T> {
    let zero = look.w_az.like(0.0);
    let mut blurred_bar = [[zero; 3]; 3];
    let dims = scene.dims();
    for (k, axis) in scene.view.axes.iter().take(dims).enumerate() {
        let row = &rows[k];
        let mut mixed = [zero; 3];
        for l in 0..dims {
            add_scaled(&mut mixed, rows[l].gradient, c_bar[k][l]);
        }
        for i in 0..3 {
            add_scaled(&mut blurred_bar[i], mixed, row.gradient[i]);
        }
        if scene.sees(axis.kind) {
            let g_bar = scale(mat_vec(&look.blurred, mixed), zero.like(2.0 * scene.by_step[k]));
            geometry.direction(look, axis, scale(g_bar, row.ratio));
            if axis.kind.is_angular() {
                let along = dot(g_bar, row.direction);
                geometry.arm(axis.kind, -along * row.ratio / row.arm);
                geometry.slope(look, axis, along / row.arm);
            }
        }
    }
    blurred_bar
}

/// b = (ξ − lo)/step.
#[inline(always)]
fn coordinates<T: Number>(geometry: &mut Geometry<T>, scene: &Scene<'_>, look: &Look<T>, b_bar: Vec3<T>) {
    for (k, axis) in scene.view.axes.iter().take(3).enumerate() {
        if scene.sees(axis.kind) {
            geometry.coordinate(look, axis, b_bar[k] * scene.by_step[k]);
        }
    }
}

/// κ_k = ω̄ v·D_k; returns ∂L/∂ω̄.
#[inline(always)]
fn ramp<T: Number>(
    geometry: &mut Geometry<T>,
    scene: &Scene<'_>,
    (form, look, rows): (&Form<T>, &Look<T>, &[Row<T>; 3]),
    wants: &Wants<T>,
) -> T {
    let mut omega_mean_bar = wants.q.like(0.0);
    if !scene.config.operators.doppler {
        return omega_mean_bar;
    }
    for (k, axis) in scene.view.axes.iter().take(3).enumerate() {
        let row: &Row<T> = &rows[k];
        let kappa_bar = wants.q_delta[k];
        omega_mean_bar += kappa_bar * dot(look.velocity, row.displacement);
        add_scaled(&mut geometry.v, row.displacement, kappa_bar * form.omega_mean);
        let displacement_bar = scale(look.velocity, kappa_bar * form.omega_mean * scene.step[k]);
        geometry.direction(look, axis, scale(displacement_bar, row.by_ratio));
        if axis.kind.is_angular() {
            let along = dot(displacement_bar, row.direction) / row.slope;
            geometry.arm(axis.kind, along);
            geometry.slope(look, axis, -along * row.by_ratio);
        }
    }
    omega_mean_bar
}

#[inline(always)]
fn phases<T: Number>(geometry: &mut Geometry<T>, scene: &Scene<'_>, look: &Look<T>, phase_bar: T) {
    let [d, radial, azimuth, elevation] = scene.phase_slopes(&look.seen);
    geometry.d += phase_bar * d;
    geometry.radial += phase_bar * radial;
    geometry.azimuth += phase_bar * azimuth;
    geometry.elevation += phase_bar * elevation;
}

/// The point-spread terms of Σ'.
#[inline(always)]
fn blur<T: Number>(geometry: &mut Geometry<T>, scene: &Scene<'_>, look: &Look<T>, blurred_bar: &Mat3<T>) {
    let (seen, psf) = (&look.seen, &scene.view.psf);
    add_scaled(&mut geometry.u, mat_vec(blurred_bar, seen.u), seen.h.like(2.0 * psf.range_m * psf.range_m));

    let pull_az = mat_vec(blurred_bar, seen.e_az);
    add_scaled(&mut geometry.e_az, pull_az, look.w_az * 2.0 * look.w_az);
    let w_az_bar = look.w_az * 2.0 * dot(seen.e_az, pull_az);
    let w_az_bar = w_az_bar / seen.cos_az_floored.value;
    geometry.rho += w_az_bar * psf.azimuth_rad;
    let cos_az_bar = -w_az_bar * look.w_az;
    geometry.azimuth -= cos_az_bar * seen.sin_az * seen.cos_az_floored.pass;

    let pull_el = mat_vec(blurred_bar, seen.e_el);
    add_scaled(&mut geometry.e_el, pull_el, look.w_el * 2.0 * look.w_el);
    let w_el_bar = look.w_el * 2.0 * dot(seen.e_el, pull_el);
    let w_el_bar = w_el_bar / seen.cos_el_floored.value;
    geometry.d += w_el_bar * psf.elevation_rad;
    let cos_el_bar = -w_el_bar * look.w_el;
    geometry.elevation -= cos_el_bar * seen.sin_el * seen.cos_el_floored.pass;
}

/// Spectrum exp(ω(t) − ω̄) and the mean ω̄.
fn features(moments: &Moments, omega_mean_bar: f64, omega: &mut [f64]) {
    let count = omega.len();
    let mut mean_bar = omega_mean_bar;
    for by_bin in &moments.r_by_bin {
        for (bin, &r) in by_bin.iter().enumerate() {
            let (lower, t) = feature_at(bin, by_bin.len(), count);
            if let Some(entry) = omega.get_mut(lower) {
                *entry += r * (1.0 - t);
            }
            if let (true, Some(entry)) = (t != 0.0, omega.get_mut(lower + 1)) {
                *entry += r * t;
            }
            mean_bar -= r;
        }
    }
    for entry in omega {
        *entry += mean_bar / count as f64;
    }
}
