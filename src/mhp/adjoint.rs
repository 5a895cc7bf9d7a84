//! The way back through one joint in one view: from moments over the cells to gradients of the joint's parameters.
//!
//! The kernel hands in what every cell of the map wants of the joint's ln-amplitude (r) and phase (q), summed with
//! powers of Δ = b − b_j. Adjoints are named after what they belong to (`d` is ∂L/∂d); those of directions and angles
//! are collected first and folded into ∂L/∂p at the end, so that each formula of `splat.rs` appears once.

use super::form::Form;
use super::splat::{Row, Scene, Splat, Trace, feature_at};
use crate::body::{Group, Pppr};
use crate::geometry::{Mat3, Vec3, add_scaled, dot, mat_mul, mat_t_vec, mat_vec, norm, scale, transpose};
use crate::radar::{Axis, AxisKind, Spacing};

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

/// Adjoints of the geometry at a joint.
#[derive(Default)]
struct Geometry {
    p: Vec3,
    v: Vec3,
    d: f64,
    rho: f64,
    h: f64,
    azimuth: f64,
    elevation: f64,
    u: Vec3,
    e_az: Vec3,
    e_el: Vec3,
    e_h: Vec3,
    e_rho: Vec3,
    radial: f64,
}

/// Adds the gradient that `moments` imply to joint `joint` of `gradient`, but for shape, whose adjoint ∂L/∂(R S Sᵀ Rᵀ) is
/// added to `covariance_bar`; SPEC section 3.
pub(super) fn pull_back(
    scene: &Scene<'_>,
    (form, splat, trace): (&Form, &Splat, &Trace),
    moments: &Moments,
    joint: usize,
    (gradient, covariance_bar): (&mut Pppr, &mut Mat3),
) {
    let mut geometry = Geometry::default();
    let (c_bar, b_bar) = gaussian(splat, moments);
    let blurred_bar = covariance(&mut geometry, scene, trace, &c_bar, splat.dims);
    coordinates(&mut geometry, scene, trace, b_bar, splat.dims);
    let omega_mean_bar = ramp(&mut geometry, scene, (form, trace), moments, splat.dims);
    phases(&mut geometry, scene, trace, moments.q);
    if scene.config.operators.attenuation {
        geometry.d -= 4.0 * moments.r / trace.seen.d.value;
    }
    blur(&mut geometry, scene, trace, &blurred_bar);

    let (p_bar, v_bar) = geometry.fold(scene, trace);
    let pose = &scene.view.pose;
    add_to(gradient.joint_mut(Group::Position, joint), &mat_t_vec(&pose.rotation, p_bar));
    add_to(gradient.joint_mut(Group::Velocity, joint), &mat_t_vec(&pose.rotation, v_bar));
    gradient.joint_mut(Group::Beta, joint)[0] += moments.r * (1.0 - form.opacity);
    let (bar, rotation) = (mat_mul(&blurred_bar, &pose.rotation), transpose(&pose.rotation));
    for (sum, row) in covariance_bar.iter_mut().zip(mat_mul(&rotation, &bar)) {
        add_scaled(sum, row, 1.0);
    }
    features(moments, omega_mean_bar, gradient.joint_mut(Group::Omega, joint));
}

fn add_to(sum: &mut [f64], term: &[f64]) {
    for (a, b) in sum.iter_mut().zip(term) {
        *a += b;
    }
}

/// ∂L/∂C = ½ P (Σ rΔΔᵀ) P − ½ P Σr and ∂L/∂b = P ΣrΔ − κ Σq.
fn gaussian(splat: &Splat, moments: &Moments) -> (Mat3, [f64; 3]) {
    let p = &splat.precision;
    let quadratic = mat_mul(&mat_mul(p, &moments.r_delta_delta), p);
    let c_bar = std::array::from_fn(|k| std::array::from_fn(|l| 0.5 * (quadratic[k][l] - p[k][l] * moments.r)));
    let pull = mat_vec(p, moments.r_delta);
    (c_bar, std::array::from_fn(|k| pull[k] - splat.kappa[k] * moments.q))
}

/// C = G Σ' Gᵀ: hands G̅ to the axes' directions and returns Σ̅'.
fn covariance(geometry: &mut Geometry, scene: &Scene<'_>, trace: &Trace, c_bar: &Mat3, dims: usize) -> Mat3 {
    let mut blurred_bar = [[0.0; 3]; 3];
    for (k, axis) in scene.view.axes.iter().take(dims).enumerate() {
        let row = &trace.rows[k];
        let mut mixed = [0.0; 3];
        for l in 0..dims {
            add_scaled(&mut mixed, trace.rows[l].gradient, c_bar[k][l]);
        }
        for i in 0..3 {
            add_scaled(&mut blurred_bar[i], mixed, row.gradient[i]);
        }
        if row.seen {
            let g_bar = scale(mat_vec(&trace.blurred, mixed), 2.0 * scene.by_step[k]);
            geometry.direction(trace, axis, scale(g_bar, row.ratio));
            if axis.kind.is_angular() {
                let along = dot(g_bar, row.direction);
                geometry.arm(axis.kind, -along * row.ratio / row.arm);
                geometry.slope(trace, axis, along / row.arm);
            }
        }
    }
    blurred_bar
}

/// b = (ξ − lo)/step.
fn coordinates(geometry: &mut Geometry, scene: &Scene<'_>, trace: &Trace, b_bar: [f64; 3], dims: usize) {
    for (k, axis) in scene.view.axes.iter().take(dims).enumerate() {
        if trace.rows[k].seen {
            geometry.coordinate(trace, axis, b_bar[k] * scene.by_step[k]);
        }
    }
}

/// κ_k = ω̄ v·D_k; returns ∂L/∂ω̄.
fn ramp(
    geometry: &mut Geometry,
    scene: &Scene<'_>,
    (form, trace): (&Form, &Trace),
    moments: &Moments,
    dims: usize,
) -> f64 {
    if !scene.config.operators.doppler {
        return 0.0;
    }
    let mut omega_mean_bar = 0.0;
    for (k, axis) in scene.view.axes.iter().take(dims).enumerate() {
        let row: &Row = &trace.rows[k];
        let kappa_bar = moments.q_delta[k];
        omega_mean_bar += kappa_bar * dot(trace.velocity, row.displacement);
        add_scaled(&mut geometry.v, row.displacement, kappa_bar * form.omega_mean);
        let displacement_bar = scale(trace.velocity, kappa_bar * form.omega_mean * scene.step[k]);
        geometry.direction(trace, axis, scale(displacement_bar, row.by_ratio));
        if axis.kind.is_angular() {
            let along = dot(displacement_bar, row.direction) / row.slope;
            geometry.arm(axis.kind, along);
            geometry.slope(trace, axis, -along * row.by_ratio);
        }
    }
    omega_mean_bar
}

fn phases(geometry: &mut Geometry, scene: &Scene<'_>, trace: &Trace, phase_bar: f64) {
    let [d, radial, azimuth, elevation] = scene.phase_slopes(&trace.seen);
    geometry.d += phase_bar * d;
    geometry.radial += phase_bar * radial;
    geometry.azimuth += phase_bar * azimuth;
    geometry.elevation += phase_bar * elevation;
}

/// The point-spread terms of Σ'.
fn blur(geometry: &mut Geometry, scene: &Scene<'_>, trace: &Trace, blurred_bar: &Mat3) {
    let (seen, psf) = (&trace.seen, &scene.view.psf);
    add_scaled(&mut geometry.u, mat_vec(blurred_bar, seen.u), 2.0 * psf.range_m * psf.range_m);

    let pull_az = mat_vec(blurred_bar, seen.e_az);
    add_scaled(&mut geometry.e_az, pull_az, 2.0 * trace.w_az * trace.w_az);
    let w_az_bar = 2.0 * trace.w_az * dot(seen.e_az, pull_az);
    let w_az_bar = w_az_bar / seen.cos_az_floored.value;
    geometry.rho += w_az_bar * psf.azimuth_rad;
    let cos_az_bar = -w_az_bar * trace.w_az;
    geometry.azimuth -= cos_az_bar * seen.sin_az * seen.cos_az_floored.pass;

    let pull_el = mat_vec(blurred_bar, seen.e_el);
    add_scaled(&mut geometry.e_el, pull_el, 2.0 * trace.w_el * trace.w_el);
    let w_el_bar = 2.0 * trace.w_el * dot(seen.e_el, pull_el);
    let w_el_bar = w_el_bar / seen.cos_el_floored.value;
    geometry.d += w_el_bar * psf.elevation_rad;
    let cos_el_bar = -w_el_bar * trace.w_el;
    geometry.elevation -= cos_el_bar * seen.sin_el * seen.cos_el_floored.pass;
}

impl Geometry {
    /// ∂L/∂(unit direction of an axis).
    fn direction(&mut self, trace: &Trace, axis: &Axis, bar: Vec3) {
        match axis.kind {
            AxisKind::Range => add_scaled(&mut self.u, bar, 1.0),
            AxisKind::Azimuth => add_scaled(&mut self.e_az, bar, 1.0),
            AxisKind::Elevation => add_scaled(&mut self.e_el, bar, 1.0),
            AxisKind::Cone => self.cone_direction(trace, bar),
            AxisKind::DepthH => add_scaled(&mut self.e_h, bar, 1.0),
            AxisKind::DepthV => add_scaled(&mut self.e_rho, bar, 1.0),
            AxisKind::Doppler | AxisKind::X | AxisKind::Y | AxisKind::Z => {}
        }
    }

    /// e_cone = (ŷ − s u)/cos.
    fn cone_direction(&mut self, trace: &Trace, bar: Vec3) {
        let seen = &trace.seen;
        let cosine = seen.cos_cone().value;
        add_scaled(&mut self.u, bar, -seen.u[1] / cosine);
        self.u[1] -= dot(bar, seen.u) / cosine;
        self.cone_cosine(trace, -dot(bar, seen.e_cone()) / cosine);
    }

    /// cos = √(1 − s²), s = u_y.
    fn cone_cosine(&mut self, trace: &Trace, bar: f64) {
        let (s, cosine) = (trace.seen.u[1], trace.seen.cos_cone());
        self.u[1] -= bar * s / cosine.value * cosine.pass;
    }

    /// ∂L/∂(arm of an axis): ρ or d.
    fn arm(&mut self, kind: AxisKind, bar: f64) {
        match kind {
            AxisKind::Azimuth => self.rho += bar,
            AxisKind::Elevation | AxisKind::Cone => self.d += bar,
            _ => {}
        }
    }

    /// ∂L/∂(dξ/dθ), which depends on the angle on a sine axis only.
    fn slope(&mut self, trace: &Trace, axis: &Axis, bar: f64) {
        let seen = &trace.seen;
        match (axis.spacing, axis.kind) {
            (Spacing::Sine, AxisKind::Azimuth) => self.azimuth -= bar * seen.sin_az * seen.cos_az_floored.pass,
            (Spacing::Sine, AxisKind::Elevation) => self.elevation -= bar * seen.sin_el * seen.cos_el_floored.pass,
            (Spacing::Sine, AxisKind::Cone) => self.cone_cosine(trace, bar),
            _ => {}
        }
    }

    /// ∂L/∂ξ.
    fn coordinate(&mut self, trace: &Trace, axis: &Axis, bar: f64) {
        let (seen, sine) = (&trace.seen, axis.spacing == Spacing::Sine);
        match axis.kind {
            AxisKind::Range => self.d += bar,
            AxisKind::Azimuth => self.azimuth += bar * if sine { seen.cos_az } else { 1.0 },
            AxisKind::Elevation => self.elevation += bar * if sine { seen.cos_el } else { 1.0 },
            AxisKind::Cone if sine => self.u[1] += bar,
            // At the pole of the cone the arcsine has no derivative; the floor keeps the answer finite.
            AxisKind::Cone => self.u[1] += bar / (1.0 - seen.u[1] * seen.u[1]).sqrt().max(1e-9),
            AxisKind::Doppler => self.radial += bar,
            AxisKind::X => self.p[0] += bar,
            AxisKind::Y => self.p[1] += bar,
            AxisKind::Z => self.p[2] += bar,
            AxisKind::DepthH => self.h += bar,
            AxisKind::DepthV => self.rho += bar,
        }
    }

    /// Folds everything into (∂L/∂p before the surface offset, ∂L/∂v), view frame.
    fn fold(mut self, scene: &Scene<'_>, trace: &Trace) -> (Vec3, Vec3) {
        let seen = &trace.seen;
        add_scaled(&mut self.v, seen.u, self.radial);
        add_scaled(&mut self.u, trace.velocity, self.radial);
        // du = e_el dθ_el + cos el e_az dθ_az, de_az = −e_ρ dθ_az, de_el = −u dθ_el − sin el e_az dθ_az, de_ρ = e_az dθ_az
        self.elevation += dot(self.u, seen.e_el) - dot(self.e_el, seen.u);
        self.azimuth +=
            seen.cos_el * dot(self.u, seen.e_az) - dot(self.e_az, seen.e_rho) - seen.sin_el * dot(self.e_el, seen.e_az)
                + dot(self.e_rho, seen.e_az);
        let across_h = [-seen.e_h[2], 0.0, seen.e_h[0]];
        let mut p = self.p;
        add_scaled(&mut p, seen.u, self.d * seen.d.pass);
        add_scaled(&mut p, seen.e_rho, self.rho * seen.rho.pass);
        add_scaled(&mut p, seen.e_h, self.h);
        // Angles and unit directions come from the point itself, not from the floored lengths: so do their slopes.
        let [x, y, _] = seen.p;
        add_scaled(&mut p, seen.e_az, self.azimuth * inverse((x * x + y * y).sqrt()));
        add_scaled(&mut p, seen.e_el, self.elevation * inverse(norm(seen.p)));
        add_scaled(&mut p, across_h, dot(self.e_h, across_h) * inverse(seen.h));
        (unmove(scene, trace.unmoved, p), self.v)
    }
}

/// 1/length; 0 at the one point where an angle has no slope.
fn inverse(length_m: f64) -> f64 {
    if length_m > 1e-12 { 1.0 / length_m } else { 0.0 }
}

/// p = p₀ max(d₀ − δ, floor)/d₀.
fn unmove(scene: &Scene<'_>, unmoved: Vec3, p_bar: Vec3) -> Vec3 {
    let (factor, d, skin) = scene.surface_factor(unmoved);
    let mut bar = scale(p_bar, factor);
    let length = norm(unmoved);
    if length > 0.0 {
        // The slope of the factor, along the unit vector of p₀.
        let slope = d.pass * (skin.pass - factor) / (d.value * length);
        add_scaled(&mut bar, unmoved, dot(p_bar, unmoved) * slope);
    }
    bar
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
