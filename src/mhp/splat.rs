//! One joint seen by one view: its Gaussian in bin coordinates, its weight, its phases. All in f64; SPEC section 3.
//!
//! What is kept is what the per-cell kernel needs ([`Splat`]) and what the derivative needs on the way back
//! ([`Seen`], [`Row`]); `adjoint.rs` reads like this file from bottom to top.

use super::form::Form;
use crate::body::{Group, Pppr};
use crate::config::FitConfig;
use crate::geometry::{Mat3, Vec3, add_scaled, dot, mat_mul, mat_vec, norm, scale};
use crate::radar::{Axis, AxisKind, RadarConfig, SPEED_OF_LIGHT, Spacing, View};
use std::f64::consts::TAU;

/// Distances are held above this, m.
pub(super) const DISTANCE_FLOOR_M: f64 = 0.01;
/// Cosines that stand in a denominator are held above this.
pub(super) const COSINE_FLOOR: f64 = 0.05;
/// τ of an echo, s a metre.
const PER_METRE_S: f64 = 2.0 / SPEED_OF_LIGHT;
/// ln 2π
const LN_TAU: f64 = 1.837_877_066_409_345_3;

/// A quantity held above a floor; its gradient is zero while it is.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Floored {
    /// max(x, floor)
    pub value: f64,
    /// 1 where the gradient passes, 0 where the floor holds.
    pub pass: f64,
}

impl Floored {
    pub(super) fn new(x: f64, floor: f64) -> Self {
        // A NaN must stay visible, so the comparison lets it through.
        if x < floor { Self { value: floor, pass: 0.0 } } else { Self { value: x, pass: 1.0 } }
    }
}

/// A point in the view frame and the directions around it.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    /// The point after the surface offset, m.
    pub p: Vec3,
    /// d = ‖p‖, m.
    pub d: Floored,
    /// ρ = √(x² + y²), m.
    pub rho: Floored,
    /// √(x² + z²), m.
    pub h: f64,
    pub sin_az: f64,
    pub cos_az: f64,
    pub sin_el: f64,
    pub cos_el: f64,
    /// cos θ_az where it stands in a denominator.
    pub cos_az_floored: Floored,
    /// cos θ_el where it stands in a denominator.
    pub cos_el_floored: Floored,
    /// Radial unit vector; u_y = s is the sine of the cone angle.
    pub u: Vec3,
    pub e_az: Vec3,
    pub e_el: Vec3,
    /// Horizontal radial unit vector, (cos az, sin az, 0).
    pub e_rho: Vec3,
    /// Unit vector of (x, 0, z).
    pub e_h: Vec3,
}

impl Seen {
    pub(super) fn new(p: Vec3) -> Self {
        let [x, y, z] = p;
        let (rho, h, d) = ((x * x + y * y).sqrt(), (x * x + z * z).sqrt(), norm(p));
        // At the origin and above it, angles are 0.
        let unit = |a: f64, b: f64, length: f64| {
            let by_length = 1.0 / length;
            if length == 0.0 { [1.0, 0.0] } else { [a * by_length, b * by_length] }
        };
        let ([cos_az, sin_az], [cos_el, sin_el]) = (unit(x, y, rho), unit(rho, z, d));
        let u = [cos_el * cos_az, cos_el * sin_az, sin_el];
        let [h_x, h_z] = unit(x, z, h);
        Self {
            p,
            d: Floored::new(d, DISTANCE_FLOOR_M),
            rho: Floored::new(rho, DISTANCE_FLOOR_M),
            h,
            sin_az,
            cos_az,
            sin_el,
            cos_el,
            cos_az_floored: Floored::new(cos_az, COSINE_FLOOR),
            cos_el_floored: Floored::new(cos_el, COSINE_FLOOR),
            u,
            e_az: [-sin_az, cos_az, 0.0],
            e_el: [-sin_el * cos_az, -sin_el * sin_az, cos_el],
            e_rho: [cos_az, sin_az, 0.0],
            e_h: [h_x, 0.0, h_z],
        }
    }

    /// √(1 − s²), the cosine of the cone angle.
    pub(super) fn cos_cone(&self) -> Floored {
        Floored::new((1.0 - self.u[1] * self.u[1]).max(0.0).sqrt(), COSINE_FLOOR)
    }

    /// (ŷ − s u)/cos.
    pub(super) fn e_cone(&self) -> Vec3 {
        let [x, s, z] = self.u;
        scale([-s * x, 1.0 - s * s, -s * z], 1.0 / self.cos_cone().value)
    }

    /// The coordinate ξ of this point on `axis`, in axis units; `radial_mps` is v_r.
    pub(super) fn coordinate(&self, axis: &Axis, radial_mps: f64) -> f64 {
        let sine = axis.spacing == Spacing::Sine;
        match axis.kind {
            AxisKind::Range => self.d.value,
            AxisKind::Azimuth if sine => self.sin_az,
            AxisKind::Azimuth => self.sin_az.atan2(self.cos_az),
            AxisKind::Elevation if sine => self.sin_el,
            AxisKind::Elevation => self.sin_el.atan2(self.cos_el),
            AxisKind::Cone if sine => self.u[1],
            AxisKind::Cone => self.u[1].clamp(-1.0, 1.0).asin(),
            AxisKind::Doppler => radial_mps,
            AxisKind::X => self.p[0],
            AxisKind::Y => self.p[1],
            AxisKind::Z => self.p[2],
            AxisKind::DepthH => self.h,
            AxisKind::DepthV => self.rho.value,
        }
    }

    /// dξ/dθ of an angular axis: 1, or the floored cosine on a sine axis.
    pub(super) fn slope(&self, axis: &Axis) -> f64 {
        match (axis.spacing, axis.kind) {
            (Spacing::Sine, AxisKind::Azimuth) => self.cos_az_floored.value,
            (Spacing::Sine, AxisKind::Elevation) => self.cos_el_floored.value,
            (Spacing::Sine, AxisKind::Cone) => self.cos_cone().value,
            _ => 1.0,
        }
    }

    /// The unit direction along ∂ξ/∂p, and the arm: ∂ξ/∂p = direction · slope / arm. A Doppler axis has none.
    pub(super) fn direction_and_arm(&self, kind: AxisKind) -> (Vec3, f64) {
        match kind {
            AxisKind::Range => (self.u, 1.0),
            AxisKind::Azimuth => (self.e_az, self.rho.value),
            AxisKind::Elevation => (self.e_el, self.d.value),
            AxisKind::Cone => (self.e_cone(), self.d.value),
            AxisKind::Doppler => ([0.0; 3], 1.0),
            AxisKind::X => ([1.0, 0.0, 0.0], 1.0),
            AxisKind::Y => ([0.0, 1.0, 0.0], 1.0),
            AxisKind::Z => ([0.0, 0.0, 1.0], 1.0),
            AxisKind::DepthH => (self.e_h, 1.0),
            AxisKind::DepthV => (self.e_rho, 1.0),
        }
    }
}

/// One axis at one joint.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Row {
    /// Whether the axis sees the joint (its operator is on, or it has none).
    pub seen: bool,
    pub slope: f64,
    pub arm: f64,
    /// slope/arm and arm/slope.
    pub ratio: f64,
    pub by_ratio: f64,
    pub direction: Vec3,
    /// ∂b/∂p; zero where the axis does not see the joint.
    pub gradient: Vec3,
    /// Displacement of one bin, m.
    pub displacement: Vec3,
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

/// What the derivative needs besides.
#[derive(Debug, Clone, Default)]
pub(super) struct Trace {
    /// The joint before the surface offset, view frame.
    pub unmoved: Vec3,
    pub seen: Seen,
    pub rows: [Row; 3],
    /// v in the view frame, m/s.
    pub velocity: Vec3,
    /// Σ', m².
    pub blurred: Mat3,
    pub w_az: f64,
    pub w_el: f64,
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
    /// The factor of p that moves a joint to its skin: max(d − δ, floor)/d.
    pub(super) fn surface_factor(&self, unmoved: Vec3) -> (f64, Floored, Floored) {
        let d = Floored::new(norm(unmoved), DISTANCE_FLOOR_M);
        let skin = Floored::new(d.value - self.config.surface_offset_m, DISTANCE_FLOOR_M);
        (skin.value / d.value, d, skin)
    }

    /// Projects flat joint `joint` of `params`, which has this form, into this view: overwrites `splat` and `trace`.
    pub(super) fn splat(&self, params: &Pppr, joint: usize, form: &Form, splat: &mut Splat, trace: &mut Trace) {
        let pose = &self.view.pose;
        let unmoved = pose.view_from_world(params.position(joint));
        let seen = Seen::new(scale(unmoved, self.surface_factor(unmoved).0));
        let velocity = mat_vec(&pose.rotation, params.velocity(joint));
        let radial = dot(velocity, seen.u);
        let omega = params.joint(Group::Omega, joint);

        let psf = &self.view.psf;
        let spread = mat_mul(&pose.rotation, &form.spread);
        let w_az = seen.rho.value * psf.azimuth_rad / seen.cos_az_floored.value;
        let w_el = seen.d.value * psf.elevation_rad / seen.cos_el_floored.value;
        let blurred = blurred(&spread, &seen, psf.range_m, w_az, w_el);

        let dims = self.view.axes.len().min(3);
        let (mut rows, mut bin, mut kappa) = ([Row::default(); 3], [0.0; 3], [0.0; 3]);
        splat.spectrum.iter_mut().for_each(Vec::clear);
        let mut covariance = [[0.0; 3]; 3];
        for (k, axis) in self.view.axes.iter().take(dims).enumerate() {
            rows[k] = self.row(&seen, k, axis);
            bin[k] = (if rows[k].seen { seen.coordinate(axis, radial) } else { 0.0 } - axis.lo) * self.by_step[k];
            if self.config.operators.doppler {
                kappa[k] = form.omega_mean * dot(velocity, rows[k].displacement);
            }
            if axis.kind == AxisKind::Doppler {
                splat.spectrum[k].extend(spectrum_of(omega, form.omega_mean, axis.bins));
            }
            covariance[k][k] = self.own_variance[k] + 1.0 / 12.0;
        }
        for k in 0..dims {
            for l in 0..dims {
                covariance[k][l] += dot(rows[k].gradient, mat_vec(&blurred, rows[l].gradient));
            }
        }
        let (precision, ln_det) = inverse_and_ln_det(&covariance, dims);

        let attenuation =
            if self.config.operators.attenuation { 4.0 * (self.radar.r_max_m / seen.d.value).ln() } else { 0.0 };
        splat.ln_weight = form.ln_opacity + attenuation - 0.5 * (dims as f64 * LN_TAU + ln_det);
        let phase = self.phase(&seen, radial);
        splat.phase = phase - TAU * (phase * (1.0 / TAU)).floor();
        (splat.dims, splat.bin, splat.precision, splat.kappa) = (dims, bin, precision, kappa);
        *trace = Trace { unmoved, seen, rows, velocity, blurred, w_az, w_el };
    }

    fn row(&self, seen: &Seen, k: usize, axis: &Axis) -> Row {
        let (direction, arm) = seen.direction_and_arm(axis.kind);
        let (slope, on) = (seen.slope(axis), sees(self.config, axis.kind));
        let (ratio, by_ratio) = if axis.kind.is_angular() { (slope / arm, arm / slope) } else { (1.0, 1.0) };
        let gradient = if on { scale(direction, ratio * self.by_step[k]) } else { [0.0; 3] };
        let displacement = scale(direction, by_ratio * self.step[k]);
        Row { seen: on, slope, arm, ratio, by_ratio, direction, gradient, displacement }
    }

    fn phase(&self, seen: &Seen, radial_mps: f64) -> f64 {
        let [by_tau_sq, by_radial, by_az, by_el] = self.phase;
        let tau = seen.d.value * PER_METRE_S;
        by_tau_sq * tau * tau + by_radial * radial_mps + by_az * seen.sin_az + by_el * seen.sin_el
    }

    /// (∂φ/∂d, ∂φ/∂v_r, ∂φ/∂θ_az, ∂φ/∂θ_el).
    pub(super) fn phase_slopes(&self, seen: &Seen) -> [f64; 4] {
        let [by_tau_sq, by_radial, by_az, by_el] = self.phase;
        let tau = seen.d.value * PER_METRE_S;
        [2.0 * by_tau_sq * tau * PER_METRE_S, by_radial, by_az * seen.cos_az, by_el * seen.cos_el]
    }
}

/// Σ' = M Mᵀ + σ_r² u uᵀ + w_az² e_az e_azᵀ + w_el² e_el e_elᵀ, m².
fn blurred(spread: &Mat3, seen: &Seen, sigma_r: f64, w_az: f64, w_el: f64) -> Mat3 {
    std::array::from_fn(|i| {
        let mut row: Vec3 = std::array::from_fn(|k| dot(spread[i], spread[k]));
        add_scaled(&mut row, seen.u, sigma_r * sigma_r * seen.u[i]);
        add_scaled(&mut row, seen.e_az, w_az * w_az * seen.e_az[i]);
        add_scaled(&mut row, seen.e_el, w_el * w_el * seen.e_el[i]);
        row
    })
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

/// The inverse of a symmetric positive definite matrix (leading `dims` block) and the ln of its determinant.
fn inverse_and_ln_det(c: &Mat3, dims: usize) -> (Mat3, f64) {
    let mut full = *c;
    for (k, row) in full.iter_mut().enumerate().skip(dims) {
        *row = [0.0; 3];
        row[k] = 1.0;
    }
    let m = &full;
    let cofactor = |i: usize, k: usize| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = ((k + 1) % 3, (k + 2) % 3);
        m[a][p] * m[b][q] - m[a][q] * m[b][p]
    };
    let determinant = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    let by_determinant = 1.0 / determinant;
    let inverse = std::array::from_fn(|i| std::array::from_fn(|k| cofactor(k, i) * by_determinant));
    (inverse, determinant.ln())
}
