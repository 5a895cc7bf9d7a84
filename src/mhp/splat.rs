//! One joint seen by one view: its Gaussian in bin coordinates, its weight, its phases. All in f64; SPEC section 3.
//!
//! What is kept is what the per-cell kernel needs ([`Splat`]) and what the derivative needs on the way back
//! ([`Look`], [`Row`]); `adjoint.rs` reads like this file from bottom to top.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::Precision;
use super::batch::{Batch, Task, each_joint};
use super::form::{Form, Forms};
use super::seen::{DISTANCE_FLOOR_M, Floored, Seen, uniform};
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::geometry::{IDENTITY, Mat3, Number, Vec3, add_scaled, dot, mat_mul, mat_vec, norm, scale, transpose};
use crate::radar::{Axis, AxisKind, RadarConfig, SPEED_OF_LIGHT, View};
use std::f64::consts::TAU;

/// τ of an echo, s a metre.
const PER_METRE_S: f64 = 2.0 / SPEED_OF_LIGHT;
/// ln 2π
const LN_TAU: f64 = 1.837_877_066_409_345_3;

/// One axis at one joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<T> {
    pub slope: T,
    pub arm: T,
    /// slope/arm and arm/slope.
    pub ratio: T,
    pub by_ratio: T,
    pub direction: Vec3<T>,
    /// ∂b/∂p; zero where the axis does not see the joint.
    pub gradient: Vec3<T>,
    /// Displacement of one bin, m.
    pub displacement: Vec3<T>,
}

/// ln of the spectrum's factor a bin of each Doppler axis; empty on other axes.
pub(super) type Spectra = [Vec<f64>; 3];

/// What the per-cell kernel needs of one joint in one view.
#[derive(Debug, Clone, Default)]
pub(super) struct Splat {
    /// Number of axes, 1 to 3.
    pub dims: usize,
    /// Bin coordinates b.
    pub bin: [f64; 3],
    /// C⁻¹ in its leading dims × dims block, bins⁻².
    pub precision: Mat3,
    /// ln of amplitude times the Gaussian's norm.
    pub ln_weight: f64,
    /// φ, reduced to one turn.
    pub phase: f64,
    /// Phase ramp κ, rad per bin.
    pub kappa: [f64; 3],
    pub spectrum: Spectra,
}

/// A joint as a view sees it: its splat, but for spectra.
#[derive(Debug, Clone, Copy)]
pub(super) struct Image<T> {
    pub bin: Vec3<T>,
    pub precision: Mat3<T>,
    pub ln_weight: T,
    pub phase: T,
    pub kappa: Vec3<T>,
}

/// Where a view sees a joint, and how wide.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look<T> {
    /// The joint before the surface offset, view frame.
    pub unmoved: Vec3<T>,
    pub seen: Seen<T>,
    /// v in the view frame, m/s.
    pub velocity: Vec3<T>,
    /// Σ', m².
    pub blurred: Mat3<T>,
    pub w_az: T,
    pub w_el: T,
}

/// A view, a radar and a configuration, and what is the same for all joints.
pub(super) struct Scene<'a> {
    pub radar: &'a RadarConfig,
    pub view: &'a View,
    pub config: &'a FitConfig,
    /// A bin of each axis in axis units, and bins a unit.
    pub step: [f64; 3],
    pub by_step: [f64; 3],
    /// The variance of each axis whose width does not come through Σ', bins².
    own_variance: [f64; 3],
    /// Of φ: by τ², v_r, sin θ_az and sin θ_el; 0 where an operator is off.
    phase: [f64; 4],
}

/// Whether the operator behind an axis is on.
fn sees(config: &FitConfig, kind: AxisKind) -> bool {
    let on = config.operators;
    match kind {
        AxisKind::Range => on.range,
        AxisKind::Azimuth | AxisKind::Elevation | AxisKind::Cone => on.angle,
        AxisKind::Doppler => on.doppler,
        _ => true,
    }
}

/// The standard deviation of an axis whose width does not come through Σ', in axis units.
fn own_width(config: &FitConfig, view: &View, kind: AxisKind) -> f64 {
    let psf = &view.psf;
    match kind {
        AxisKind::Doppler => psf.doppler_mps,
        kind if sees(config, kind) => 0.0,
        AxisKind::Range => psf.range_m,
        AxisKind::Azimuth | AxisKind::Cone => psf.azimuth_rad,
        AxisKind::Elevation => psf.elevation_rad,
        _ => 0.0,
    }
}

impl<'a> Scene<'a> {
    pub(super) fn new(radar: &'a RadarConfig, view: &'a View, config: &'a FitConfig) -> Self {
        let (mut step, mut by_step, mut own_variance) = ([1.0; 3], [1.0; 3], [0.0; 3]);
        for (k, axis) in view.axes.iter().take(3).enumerate() {
            (step[k], by_step[k]) = (axis.step(), 1.0 / axis.step());
            own_variance[k] = (own_width(config, view, axis.kind) / step[k]).powi(2);
        }
        let (on, per_metre) = (config.operators, TAU / radar.wavelength_m());
        let gate = |on: bool, x: f64| if on { x } else { 0.0 };
        let phase = [
            gate(on.range, TAU * radar.slope_hz_per_s()),
            gate(on.doppler, per_metre * 2.0 * radar.frame_s),
            gate(on.angle, per_metre * radar.l_az_m),
            gate(on.angle, per_metre * radar.l_el_m),
        ];
        Self { radar, view, config, step, by_step, own_variance, phase }
    }
}

impl Scene<'_> {
    /// Number of axes, 1 to 3.
    pub(super) fn dims(&self) -> usize {
        self.view.axes.len().min(3)
    }

    /// Whether the operator behind an axis is on.
    pub(super) fn sees(&self, kind: AxisKind) -> bool {
        sees(self.config, kind)
    }

    /// The factor of p that moves a joint to its skin: max(d − δ, floor)/d.
    #[inline(always)]
    pub(super) fn surface_factor<T: Number>(&self, unmoved: Vec3<T>) -> (T, Floored<T>, Floored<T>) {
        let d = Floored::new(norm(unmoved), DISTANCE_FLOOR_M);
        let skin = Floored::new(d.value - self.config.surface_offset_m, DISTANCE_FLOOR_M);
        (skin.value / d.value, d, skin)
    }

    /// Projects every joint of `params`, which has these forms, into this view: overwrites `splats`.
    pub(super) fn splats(&self, (params, forms): (&Pppr, &Forms), precision: Precision, splats: &mut Vec<Splat>) {
        splats.resize_with(forms.joints(), Splat::default);
        each_joint(precision, forms.joints(), &mut Project { scene: self, params, forms, splats });
    }

    /// Where the view sees joints of this form, and how wide.
    #[inline(always)]
    pub(super) fn look<T: Number>(&self, form: &Form<T>) -> Look<T> {
        let pose = &self.view.pose;
        let turn = uniform(form.opacity, pose.rotation);
        let [x, y, z] = mat_vec(&turn, form.position);
        let unmoved = [x + pose.translation[0], y + pose.translation[1], z + pose.translation[2]];
        let seen = Seen::new(scale(unmoved, self.surface_factor(unmoved).0));
        let psf = &self.view.psf;
        let w_az = seen.rho.value * psf.azimuth_rad / seen.cos_az_floored.value;
        let w_el = seen.d.value * psf.elevation_rad / seen.cos_el_floored.value;
        let blurred = blurred(&mat_mul(&turn, &form.spread), &seen, psf.range_m, w_az, w_el);
        Look { unmoved, seen, velocity: mat_vec(&turn, form.velocity), blurred, w_az, w_el }
    }

    /// The view's axes there.
    #[inline(always)]
    pub(super) fn rows<T: Number>(&self, seen: &Seen<T>) -> [Row<T>; 3] {
        let zero = seen.h.like(0.0);
        let (slope, arm, ratio, by_ratio, none) = (zero, zero, zero, zero, [zero; 3]);
        let missing = Row { slope, arm, ratio, by_ratio, direction: none, gradient: none, displacement: none };
        let mut rows = [missing; 3];
        for (k, axis) in self.view.axes.iter().take(3).enumerate() {
            rows[k] = self.row(seen, k, axis);
        }
        rows
    }

    /// What the view makes of it.
    #[inline(always)]
    pub(super) fn image<T: Number>(&self, form: &Form<T>, look: &Look<T>, rows: &[Row<T>; 3]) -> Image<T> {
        let Look { seen, velocity, blurred, .. } = look;
        let zero = seen.h.like(0.0);
        let dims = self.dims();
        let radial = dot(*velocity, seen.u);
        let (mut bin, mut kappa) = ([zero; 3], [zero; 3]);
        let mut covariance = uniform(zero, IDENTITY);
        for (k, axis) in self.view.axes.iter().take(dims).enumerate() {
            let coordinate = if self.sees(axis.kind) { seen.coordinate(axis, radial) } else { zero };
            bin[k] = (coordinate - axis.lo) * self.by_step[k];
            if self.config.operators.doppler {
                kappa[k] = form.omega_mean * dot(*velocity, rows[k].displacement);
            }
            covariance[k][k] = zero.like(self.own_variance[k] + 1.0 / 12.0);
        }
        for k in 0..dims {
            for l in 0..dims {
                covariance[k][l] += dot(rows[k].gradient, mat_vec(blurred, rows[l].gradient));
            }
        }
        let (precision, ln_det) = inverse_and_ln_det(&covariance);

        let mut ln_amplitude = form.ln_opacity;
        if self.config.operators.attenuation {
            ln_amplitude += (zero.like(self.radar.r_max_m) / seen.d.value).ln() * 4.0;
        }
        let ln_weight = ln_amplitude - (ln_det + dims as f64 * LN_TAU) * 0.5;
        let phase = self.phase(seen, radial);
        let phase = phase - (phase * (1.0 / TAU)).whole() * TAU;
        Image { bin, precision, ln_weight, phase, kappa }
    }

    #[inline(always)]
    fn row<T: Number>(&self, seen: &Seen<T>, k: usize, axis: &Axis) -> Row<T> {
        let (direction, arm) = seen.direction_and_arm(axis.kind);
        let slope = seen.slope(axis);
        let (zero, one) = (arm.like(0.0), arm.like(1.0));
        let (ratio, by_ratio) = if axis.kind.is_angular() { (slope / arm, arm / slope) } else { (one, one) };
        let gradient = if self.sees(axis.kind) { scale(direction, ratio * self.by_step[k]) } else { [zero; 3] };
        let displacement = scale(direction, by_ratio * self.step[k]);
        Row { slope, arm, ratio, by_ratio, direction, gradient, displacement }
    }

    #[inline(always)]
    fn phase<T: Number>(&self, seen: &Seen<T>, radial_mps: T) -> T {
        let [by_tau_sq, by_radial, by_az, by_el] = self.phase;
        let tau = seen.d.value * PER_METRE_S;
        tau * by_tau_sq * tau + radial_mps * by_radial + seen.sin_az * by_az + seen.sin_el * by_el
    }

    /// (∂φ/∂d, ∂φ/∂v_r, ∂φ/∂θ_az, ∂φ/∂θ_el).
    #[inline(always)]
    pub(super) fn phase_slopes<T: Number>(&self, seen: &Seen<T>) -> [T; 4] {
        let [by_tau_sq, by_radial, by_az, by_el] = self.phase;
        let tau = seen.d.value * PER_METRE_S;
        [tau * (2.0 * by_tau_sq) * PER_METRE_S, tau.like(by_radial), seen.cos_az * by_az, seen.cos_el * by_el]
    }
}

struct Project<'a> {
    scene: &'a Scene<'a>,
    params: &'a Pppr,
    forms: &'a Forms,
    splats: &'a mut [Splat],
}

impl Task for Project<'_> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let Self { scene, params, forms, splats } = self;
        let (axes, form) = (&scene.view.axes, forms.of(batch));
        let look = scene.look(&form);
        let image = scene.image(&form, &look, &scene.rows(&look.seen));
        batch.scatter(image.ln_weight, |joint, x| splats[joint].ln_weight = x);
        batch.scatter(image.phase, |joint, x| splats[joint].phase = x);
        for k in 0..scene.dims() {
            batch.scatter(image.bin[k], |joint, x| splats[joint].bin[k] = x);
            batch.scatter(image.kappa[k], |joint, x| splats[joint].kappa[k] = x);
            for l in 0..scene.dims() {
                batch.scatter(image.precision[k][l], |joint, x| splats[joint].precision[k][l] = x);
            }
        }
        batch.scatter(form.omega_mean, |joint, mean| {
            splats[joint].dims = scene.dims();
            for (spectrum, axis) in splats[joint].spectrum.iter_mut().zip(axes) {
                spectrum.clear();
                if axis.kind == AxisKind::Doppler {
                    spectrum.extend(spectrum_of(params.joint(Group::Omega, joint), mean, axis.bins));
                }
            }
        });
    }
}

/// Σ' = M Mᵀ + σ_r² u uᵀ + w_az² e_az e_azᵀ + w_el² e_el e_elᵀ, m².
#[inline(always)]
fn blurred<T: Number>(spread: &Mat3<T>, seen: &Seen<T>, sigma_r: f64, w_az: T, w_el: T) -> Mat3<T> {
    let mut blurred = *spread;
    for i in 0..3 {
        let row = &mut blurred[i];
        *row = mat_vec(spread, spread[i]);
        add_scaled(row, seen.u, seen.u[i] * (sigma_r * sigma_r));
        add_scaled(row, seen.e_az, w_az * w_az * seen.e_az[i]);
        add_scaled(row, seen.e_el, w_el * w_el * seen.e_el[i]);
    }
    blurred
}

/// Where bin `bin` of a Doppler axis lies among `features` entries of ω: lower entry and weight of the upper one.
pub(super) fn feature_at(bin: usize, bins: usize, features: usize) -> (usize, f64) {
    if bins < 2 || features < 2 {
        return (0, 0.0);
    }
    let t = bin as f64 * (features - 1) as f64 / (bins - 1) as f64;
    let lower = (t.floor() as usize).min(features - 2);
    (lower, t - lower as f64)
}

fn spectrum_of(omega: &[f64], mean: f64, bins: usize) -> impl Iterator<Item = f64> {
    (0..bins).map(move |bin| {
        let (lower, t) = feature_at(bin, bins, omega.len());
        let at = |i: usize| omega.get(i).copied().unwrap_or(0.0);
        let upper = if t == 0.0 { 0.0 } else { at(lower + 1) * t };
        at(lower) * (1.0 - t) + upper - mean
    })
}

/// The inverse of a symmetric positive definite matrix and the ln of its determinant.
#[inline(always)]
fn inverse_and_ln_det<T: Number>(m: &Mat3<T>) -> (Mat3<T>, T) {
    let mut cofactors = *m;
    for i in 0..3 {
        for k in 0..3 {
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            let (p, q) = ((k + 1) % 3, (k + 2) % 3);
            cofactors[i][k] = m[a][p] * m[b][q] - m[a][q] * m[b][p];
        }
    }
    let determinant = dot(m[0], cofactors[0]);
    let by_determinant = determinant.like(1.0) / determinant;
    let [a, b, c] = transpose(&cofactors);
    let inverse = [scale(a, by_determinant), scale(b, by_determinant), scale(c, by_determinant)];
    (inverse, determinant.ln())
}
