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
use super::batch::{Batch, Columns, One, Task, each_joint};
use super::form::{Form, FormBars, Forms};
use super::seen::uniform;
use super::splat::{Look, Row, Scene, Widths, feature_at};
use crate::body::{Group, Pppr};
use crate::geometry::{Number, Vec3, add_scaled, dot, mat_t_vec, mat_vec, scale};
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
        One(joint).add([r, q, x, y, z, u, v, w, a, b, c, d, e, f], &mut self.numbers);
    }

    /// Σ r of one joint in each bin of an axis, to be added to; empty unless that is a Doppler axis.
    pub(super) fn by_bin(&mut self, joint: usize, axis: usize) -> &mut [f64] {
        let bins = self.bins(joint, axis);
        &mut self.r_by_bin[axis][bins]
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
    scene: &Scene<'_>,
    forms: &Forms,
    moments: &Moments,
    (gradient, bars): (&mut Pppr, &mut FormBars),
    precision: Precision,
) {
    match scene.dims() {
        1 => each_joint(precision, forms.joints(), &mut PullBack::<1> { scene, forms, moments, bars }),
        2 => each_joint(precision, forms.joints(), &mut PullBack::<2> { scene, forms, moments, bars }),
        _ => each_joint(precision, forms.joints(), &mut PullBack::<3> { scene, forms, moments, bars }),
    }
    for (k, axis) in scene.view.axes.iter().enumerate().take(3) {
        if axis.kind == AxisKind::Doppler {
            for joint in 0..forms.joints() {
                let by_bin = moments.of_bins(joint, 3 - scene.dims() + k);
                features(by_bin, gradient.joint_mut(Group::Omega, joint));
                bars.add_omega_mean(joint, -by_bin.iter().sum::<f64>());
            }
        }
    }
}

struct PullBack<'a, const D: usize> {
    scene: &'a Scene<'a>,
    forms: &'a Forms,
    moments: &'a Moments,
    bars: &'a mut FormBars,
}

impl<const D: usize> Task for PullBack<'_, D> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { scene, forms, moments, bars } = self;
        let (form, sums) = (forms.of(batch), moments.of(batch));
        // The way there once more: that costs less than to keep it.
        let look = scene.look(&form);
        let rows: [Row<B::Number>; D] = scene.rows(&look.seen);
        let widths = scene.widths(&form, &look, &rows);
        let kappa = scene.kappa(&form, &look, &rows);
        let (squares, _) = scene.squares(&look, &widths);
        let mut geometry = Geometry::nothing(batch.all(0.0));
        let (c_bar, b_bar) = gaussian(&squares.precision(), kappa, &sums);
        let covariance_bar = covariance(&mut geometry, scene, &form, (&look, &rows, &widths), &c_bar);
        for k in 0..D {
            let axis = &scene.view.axes[k];
            if scene.sees(axis.kind) {
                geometry.coordinate(&look, axis, b_bar[k] * scene.by_step[k]);
            }
        }
        let omega_mean_bar = ramp(&mut geometry, scene, (&form, &look, &rows), &sums);
        phases(&mut geometry, scene, &look, sums.q);
        if scene.config.operators.attenuation {
            geometry.d -= sums.r * 4.0 / look.seen.d.value;
        }
        let (p_bar, v_bar) = geometry.fold(scene, &look);
        let turn = uniform(sums.r, scene.view.pose.rotation);
        let motion = [mat_t_vec(&turn, p_bar), mat_t_vec(&turn, v_bar)];
        bars.add(batch, motion, covariance_bar, [sums.r, omega_mean_bar]);
    }
}

/// ∂L/∂C = ½ P (Σ rΔΔᵀ) P − ½ P Σr and ∂L/∂b = P ΣrΔ − κ Σq.
#[inline(always)]
fn gaussian<T: Number, const D: usize>(p: &[[T; D]; D], kappa: [T; D], sums: &Sums<T>) -> ([[T; D]; D], [T; D]) {
    let zero = sums.r.like(0.0);
    let (mut half, mut c_bar, mut b_bar) = ([[zero; D]; D], [[zero; D]; D], [zero; D]);
    let first = 3 - D;
    for k in 0..D {
        b_bar[k] = -(kappa[k] * sums.q);
        for l in 0..D {
            b_bar[k] = b_bar[k].plus(p[k][l], sums.r_delta[first + l]);
            for m in 0..D {
                let r_delta_delta = sums.r_delta_delta[lower(first + m.max(l), first + m.min(l))];
                half[k][l] = half[k][l].plus(p[k][m], r_delta_delta);
            }
        }
    }
    for k in 0..D {
        for l in 0..=k {
            let mut sum = -(p[k][l] * sums.r);
            for m in 0..D {
                sum = sum.plus(half[k][m], p[m][l]);
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
fn covariance<T: Number, const D: usize>(
    geometry: &mut Geometry<T>,
    scene: &Scene<'_>,
    form: &Form<T>,
    (look, rows, widths): (&Look<T>, &[Row<T>; D], &[Widths<T>; D]),
    c_bar: &[[T; D]; D],
) -> [T; 6] {
    let zero = form.opacity.like(0.0);
    let turn = uniform(zero, scene.view.pose.rotation);
    let directions = [look.seen.u, look.seen.e_az, look.seen.e_el];
    let (mut covariance_bar, mut blur_bar) = ([zero; 6], [zero; 3]);
    for k in 0..D {
        // What C̅ makes of all axes for this one.
        let mut mixed = Widths { gradient: [zero; 3], own: [zero; 3], seen: [zero; 3] };
        for l in 0..D {
            add_scaled(&mut mixed.gradient, widths[l].gradient, c_bar[k][l]);
            add_scaled(&mut mixed.own, widths[l].own, c_bar[k][l]);
            add_scaled(&mut mixed.seen, widths[l].seen, c_bar[k][l]);
        }
        let mut entry = 0;
        for i in 0..3 {
            for j in i..3 {
                covariance_bar[entry] = covariance_bar[entry].plus(widths[k].gradient[i], mixed.gradient[j]);
                entry += 1;
            }
        }
        // ½ ∂L/∂(∂b/∂p), view frame.
        let mut gradient_bar = mat_vec(&turn, mat_vec(&form.spread, mixed.own));
        for i in 0..3 {
            if scene.blurs[i] {
                let pull = look.blur[i] * look.blur[i] * mixed.seen[i];
                add_scaled(&mut gradient_bar, directions[i], pull);
                geometry.blurred(i, scale(rows[k].gradient, pull * 2.0));
                blur_bar[i] = blur_bar[i].plus(widths[k].seen[i], mixed.seen[i]);
            }
        }
        let axis = &scene.view.axes[k];
        if scene.sees(axis.kind) {
            let row = &rows[k];
            let row_bar = scale(gradient_bar, zero.like(2.0 * scene.by_step[k]));
            geometry.direction(look, axis, scale(row_bar, row.ratio));
            if axis.kind.is_angular() {
                let along = dot(row_bar, row.direction);
                geometry.arm(axis.kind, -along * row.ratio / row.arm);
                geometry.slope(look, axis, along / row.arm);
            }
        }
    }
    blur(geometry, scene, look, blur_bar);
    covariance_bar
}

/// κ_k = ω̄ v·D_k; returns ∂L/∂ω̄.
#[inline(always)]
fn ramp<T: Number, const D: usize>(
    geometry: &mut Geometry<T>,
    scene: &Scene<'_>,
    (form, look, rows): (&Form<T>, &Look<T>, &[Row<T>; D]),
    sums: &Sums<T>,
) -> T {
    let mut omega_mean_bar = sums.q.like(0.0);
    if !scene.config.operators.doppler {
        return omega_mean_bar;
    }
    for k in 0..D {
        let (row, axis) = (&rows[k], &scene.view.axes[k]);
        let kappa_bar = sums.q_delta[3 - D + k];
        let by_omega_mean = kappa_bar * form.omega_mean;
        omega_mean_bar = omega_mean_bar.plus(kappa_bar, dot(look.velocity, row.displacement));
        add_scaled(&mut geometry.v, row.displacement, by_omega_mean);
        let displacement_bar = scale(look.velocity, by_omega_mean * scene.step[k]);
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

/// The point spread along e_az and e_el grows with distance; `bar` is ½ of what each wants times itself.
#[inline(always)]
fn blur<T: Number>(geometry: &mut Geometry<T>, scene: &Scene<'_>, look: &Look<T>, bar: [T; 3]) {
    let (seen, psf) = (&look.seen, &scene.view.psf);
    if scene.blurs[1] {
        let bar = look.blur[1] * 2.0 * bar[1] / seen.cos_az_floored.value;
        geometry.rho += bar * psf.azimuth_rad;
        geometry.azimuth += bar * look.blur[1] * seen.sin_az * seen.cos_az_floored.pass;
    }
    if scene.blurs[2] {
        let bar = look.blur[2] * 2.0 * bar[2] / seen.cos_el_floored.value;
        geometry.d += bar * psf.elevation_rad;
        geometry.elevation += bar * look.blur[2] * seen.sin_el * seen.cos_el_floored.pass;
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
