//! One joint seen by one view: its Gaussian in bin coordinates, its weight, its phases. All in f64; SPEC section 3.
//!
//! What is kept is what the per-cell kernel needs ([`Splats`]); what the derivative needs besides ([`JointInView`], [`AxisJacobian`],
//! [`Widths`]) it computes once more, and `adjoint.rs` reads like this file from bottom to top.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use super::Precision;
use super::batch::{Batch, Columns, JointTask, OneJoint, each_joint};
use super::gaussian::{WorldGaussian, WorldGaussians, mean};
use super::triad::{DISTANCE_FLOOR_M, Floored, SphericalTriad, splat_matrix};
use crate::body::{Group, Pppr};
use crate::config::{FitConfig, LobeShape, Summation};
use crate::geometry::{Numeric, Vec3, dot, mat_t_vec, mat_vec, norm, scale};
use crate::radar::{AxisKind, Lobe, PointSpread, RadarConfig, Resolves, SPEED_OF_LIGHT, View};
use smallvec::SmallVec;
use std::f64::consts::{PI, TAU};

/// τ of an echo, s a metre.
const PER_METRE_S: f64 = 2.0 / SPEED_OF_LIGHT;
/// ln 2π
const LN_TAU: f64 = 1.837_877_066_409_345_3;

/// One axis at one joint: ∂b/∂p and what it is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct AxisJacobian<T> {
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

/// The covariance C of a joint's Gaussian, bins², as L D Lᵀ. Its exponent at Δ = i − b is −½ Σ_k (Δ_k + Σ_l<k s_kl Δ_l)²/D_k,
/// squares completed from the last axis on, so that elongated Gaussians keep their digits; s is L⁻¹ below its diagonal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Squares<T, const D: usize> {
    /// 1/D_k
    pub weight: [T; D],
    /// s_10, s_20, s_21
    pub skew: [T; 3],
}

/// A joint's Gaussian as a view of `D` axes sees it: its splat, but for spectra.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProjectedGaussian<T, const D: usize> {
    /// Bin coordinates b.
    pub bin: [T; D],
    pub squares: Squares<T, D>,
    /// ln of amplitude times the Gaussian's norm.
    pub ln_weight: T,
    /// φ, reduced to one turn.
    pub phase: T,
    /// Phase ramp κ, rad per bin.
    pub kappa: [T; D],
}

/// Numbers of a [`ProjectedGaussian`] of three axes.
const NUMBERS: usize = 14;

/// What the per-cell kernel needs of all joints in one view.
#[derive(Debug, Default)]
pub(super) struct Splats {
    joints: usize,
    numbers: Columns<NUMBERS>,
    /// ln of the spectrum's factor, (joints, bins), of each Doppler axis; empty on other axes.
    spectra: [Vec<f64>; 3],
}

/// What the per-cell kernel needs of one joint in one view. The last axis is the third; axes that are missing come first,
/// as axes of one bin in whose middle the joint lies.
#[derive(Debug, Clone)]
pub(super) struct Splat<'a> {
    pub bin: [f64; 3],
    /// 1/D_k and s of [`Squares`].
    pub weight: [f64; 3],
    pub skew: [f64; 3],
    pub ln_weight: f64,
    pub phase: f64,
    pub kappa: [f64; 3],
    /// ln of the spectrum's factor a bin of each Doppler axis; empty on other axes.
    pub spectrum: [&'a [f64]; 3],
}

impl Splats {
    pub(super) fn joints(&self) -> usize {
        self.joints
    }

    fn clear(&mut self) {
        self.joints = 0;
        self.spectra.iter_mut().for_each(Vec::clear);
    }

    /// Adds those of `other`; of so many in the end.
    fn append(&mut self, other: &Self, all: usize) {
        self.numbers.hold(all);
        for joint in 0..other.joints {
            let numbers: [f64; NUMBERS] = OneJoint(joint).load(&other.numbers);
            OneJoint(self.joints + joint).store(numbers, &mut self.numbers);
        }
        self.joints += other.joints;
        for (spectra, others) in self.spectra.iter_mut().zip(&other.spectra) {
            spectra.extend_from_slice(others);
        }
    }

    #[inline(always)]
    pub(super) fn of(&self, joint: usize) -> Splat<'_> {
        let [b0, b1, b2, w0, w1, w2, s0, s1, s2, ln_weight, phase, k0, k1, k2] = OneJoint(joint).load(&self.numbers);
        let mut spectrum = [&[] as &[f64]; 3];
        for (of, all) in spectrum.iter_mut().zip(&self.spectra) {
            let bins = all.len() / self.joints;
            *of = &all[joint * bins..(joint + 1) * bins];
        }
        let (bin, weight, skew, kappa) = ([b0, b1, b2], [w0, w1, w2], [s0, s1, s2], [k0, k1, k2]);
        Splat { bin, weight, skew, ln_weight, phase, kappa, spectrum }
    }

    /// Of these numbers a joint, in the order of [`Self::of`]; no axis has a spectrum.
    #[cfg(test)]
    pub(super) fn from_numbers(joints: &[[f64; NUMBERS]]) -> Self {
        let mut splats = Self { joints: joints.len(), ..Self::default() };
        splats.numbers.hold(joints.len());
        for (joint, numbers) in joints.iter().enumerate() {
            OneJoint(joint).store(*numbers, &mut splats.numbers);
        }
        splats
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = Splat<'_>> {
        (0..self.joints).map(|joint| self.of(joint))
    }
}

/// Where a view sees a joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointInView<T> {
    /// The joint before the surface offset, view frame.
    pub unmoved: Vec3<T>,
    pub triad: SphericalTriad<T>,
    /// v in the view frame, m/s.
    pub velocity: Vec3<T>,
    /// The point spread along u, e_az and e_el, m.
    pub blur: [T; 3],
}

/// How far the joint's own widths and the point spread reach along an axis; C is the sum of their products.
#[derive(Debug, Clone, Copy)]
pub(super) struct Widths<T> {
    /// ∂b/∂p, world frame.
    pub gradient: Vec3<T>,
    /// That along the columns of R S, bins.
    pub own: Vec3<T>,
    /// ∂b/∂p along u, e_az and e_el, bins a metre; zero where the point spread is.
    pub along_triad: [T; 3],
}

/// The forward model of one view: view, radar and configuration, and what is the same for all joints.
pub(super) struct ViewModel<'a> {
    pub view: &'a View,
    pub config: &'a FitConfig,
    /// The widths of the point spread.
    pub psf: PointSpread,
    /// What each axis adds to C beside them, bins².
    cell: f64,
    /// Of φ beside what joints have.
    turned: f64,
    /// A bin of each axis in axis units, and bins a unit.
    pub step: [f64; 3],
    pub by_step: [f64; 3],
    /// The variance of each axis whose width does not come through Σ', bins².
    own_variance: [f64; 3],
    /// Of φ: by τ², v_r, sin θ_az and sin θ_el; 0 where an operator is off.
    phase: [f64; 4],
    /// Whether the point spread has a width along u, e_az and e_el.
    pub blurs: [bool; 3],
    /// How much nearer than it is a joint is seen, m: its skin, less what the map adds to a range.
    pub nearer_m: f64,
    /// ln of what all joints' weights share.
    ln_share: f64,
    radar: &'a RadarConfig,
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
fn own_width(config: &FitConfig, psf: &PointSpread, kind: AxisKind) -> f64 {
    match kind {
        AxisKind::Doppler => psf.doppler_mps,
        kind if sees(config, kind) => 0.0,
        AxisKind::Range => psf.range_m,
        AxisKind::Azimuth | AxisKind::Cone => psf.azimuth_rad,
        AxisKind::Elevation => psf.elevation_rad,
        _ => 0.0,
    }
}

impl<'a> ViewModel<'a> {
    pub(super) fn new(radar: &'a RadarConfig, view: &'a View, config: &'a FitConfig) -> Self {
        let shaped = has_lobes(config, view);
        Self::with(radar, view, config, (view.psf, if shaped { LOBE_CELL } else { 1.0 / 12.0 }))
    }

    /// With this point spread, and what each axis adds to C beside it.
    fn with(radar: &'a RadarConfig, view: &'a View, config: &'a FitConfig, (psf, cell): (PointSpread, f64)) -> Self {
        let (mut step, mut by_step, mut own_variance) = ([1.0; 3], [1.0; 3], [0.0; 3]);
        for (k, axis) in view.axes.iter().take(3).enumerate() {
            (step[k], by_step[k]) = (axis.step(), 1.0 / axis.step());
            own_variance[k] = (own_width(config, &psf, axis.kind) / step[k]).powi(2);
        }
        let (on, per_metre) = (config.operators, TAU / radar.wavelength_m());
        let gate = |on: bool, x: f64| if on { x } else { 0.0 };
        let phase = [
            gate(on.range, TAU * radar.slope_hz_per_s()),
            gate(on.doppler, per_metre * 2.0 * radar.frame_s),
            gate(on.angle, per_metre * radar.l_az_m),
            gate(on.angle, per_metre * radar.l_el_m),
        ];
        let blurs = [psf.range_m, psf.azimuth_rad, psf.elevation_rad].map(|width| width != 0.0);
        let near = if on.attenuation { 4.0 * radar.r_max_m.ln() } else { 0.0 };
        let ln_share = near - 0.5 * view.axes.len().min(3) as f64 * LN_TAU;
        let nearer_m = config.surface_offset_m - psf.offset_m();
        Self {
            view,
            config,
            psf,
            cell,
            turned: 0.0,
            step,
            by_step,
            own_variance,
            phase,
            blurs,
            nearer_m,
            ln_share,
            radar,
        }
    }

    /// The Gaussians that one joint's lobe is the sum of; none where it is one Gaussian. Along each axis the lobe is that of
    /// [`Lobe`]; the difference over several axes is the sum over all their products. Each Gaussian is blurred by the joint's own
    /// extent like any other, so that its gradient is theirs. The weights are those of peaks: a narrow Gaussian of unit area has a
    /// higher one, by its widths.
    pub(super) fn lobes(&self) -> SmallVec<[Self; 8]> {
        if !has_lobes(self.config, self.view) {
            return SmallVec::new();
        }
        let mut resolved: SmallVec<[Resolves; 3]> = SmallVec::new();
        for axis in self.view.axes.iter().take(3) {
            let of = Resolves::of(axis.kind);
            if !resolved.contains(&of) {
                resolved.push(of);
            }
        }
        let one = |number: usize| {
            let (mut psf, mut weight) = (self.psf, 1.0);
            for (k, &of) in resolved.iter().enumerate() {
                let which = number >> k & 1;
                if let Some(lobe) = psf.lobe(of) {
                    *psf.width_mut(of) *= lobe.ratios[which];
                    weight *= Lobe::WEIGHTS[which] * lobe.ratios[which];
                }
            }
            let mut model = Self::with(self.radar, self.view, self.config, (psf, self.cell));
            model.ln_share += weight.abs().ln();
            model.turned = if weight < 0.0 { PI } else { 0.0 };
            model
        };
        (0..1 << resolved.len()).map(one).collect()
    }
}

/// What keeps C regular beside the lobes of windows, bins²: a map's value is that at the middle of its cell.
const LOBE_CELL: f64 = 1e-4;

/// Whether a view's joints have the lobes of its windows.
fn has_lobes(config: &FitConfig, view: &View) -> bool {
    config.lobe == LobeShape::Window
        && config.summation == Summation::Coherent
        && view.axes.iter().all(|axis| view.psf.lobe(Resolves::of(axis.kind)).is_some())
}

impl ViewModel<'_> {
    /// The variance of axis `k` whose width does not come through Σ', bins².
    pub(super) fn own_variance(&self, k: usize) -> f64 {
        self.own_variance.get(k).copied().unwrap_or(0.0)
    }

    /// What each axis adds to C beside widths, bins².
    pub(super) fn cell(&self) -> f64 {
        self.cell
    }

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
    pub(super) fn surface_factor<T: Numeric>(&self, unmoved: Vec3<T>) -> (T, Floored<T>, Floored<T>) {
        let d = Floored::new(norm(unmoved), DISTANCE_FLOOR_M);
        let skin = Floored::new(d.value - self.nearer_m, DISTANCE_FLOOR_M);
        (skin.value / d.value, d, skin)
    }

    /// Projects every joint of `params`, which has these Gaussians, into this view: overwrites `splats`.
    pub(super) fn splats(
        &self,
        (params, gaussians): (&Pppr, &WorldGaussians),
        precision: Precision,
        splats: &mut Splats,
    ) {
        let (joints, axes) = (gaussians.joints(), &self.view.axes);
        splats.joints = joints;
        splats.numbers.hold(joints);
        match self.dims() {
            1 => each_joint(precision, joints, &mut Project::<1> { model: self, gaussians, splats }),
            2 => each_joint(precision, joints, &mut Project::<2> { model: self, gaussians, splats }),
            _ => each_joint(precision, joints, &mut Project::<3> { model: self, gaussians, splats }),
        }
        for spectra in &mut splats.spectra {
            spectra.clear();
        }
        for (spectra, axis) in splats.spectra.iter_mut().skip(3 - self.dims()).zip(axes) {
            if axis.kind == AxisKind::Doppler {
                for joint in 0..joints {
                    spectra.extend(spectrum_of(params.joint(Group::Omega, joint), axis.bins));
                }
            }
        }
    }

    /// The same of `lobes`, the Gaussians that each joint is the sum of, one after the other for all joints; of this one where
    /// there are none.
    pub(super) fn splats_of(
        &self,
        lobes: &[Self],
        of: (&Pppr, &WorldGaussians),
        precision: Precision,
        (splats, scratch): (&mut Splats, &mut Splats),
    ) {
        if lobes.is_empty() {
            return self.splats(of, precision, splats);
        }
        splats.clear();
        for lobe in lobes {
            lobe.splats(of, precision, scratch);
            splats.append(scratch, of.1.joints() * lobes.len());
        }
    }

    /// Where the view sees joints with this Gaussian.
    #[inline(always)]
    pub(super) fn joint_in_view<T: Numeric>(&self, gaussian: &WorldGaussian<T>) -> JointInView<T> {
        let pose = &self.view.pose;
        let turn = splat_matrix(gaussian.opacity, pose.rotation);
        let [x, y, z] = mat_vec(&turn, gaussian.position);
        let unmoved = [x + pose.translation[0], y + pose.translation[1], z + pose.translation[2]];
        let moved = self.nearer_m != 0.0;
        let triad = SphericalTriad::new(if moved { scale(unmoved, self.surface_factor(unmoved).0) } else { unmoved });
        let psf = &self.psf;
        let mut blur = [x.splat(psf.range_m), x.splat(0.0), x.splat(0.0)];
        if self.blurs[1] {
            blur[1] = triad.rho.value * psf.azimuth_rad / triad.cos_az_floored.value;
        }
        if self.blurs[2] {
            blur[2] = triad.d.value * psf.elevation_rad / triad.cos_el_floored.value;
        }
        JointInView { unmoved, triad, velocity: mat_vec(&turn, gaussian.velocity), blur }
    }

    /// The view's axes there.
    #[inline(always)]
    pub(super) fn jacobians<T: Numeric, const D: usize>(&self, triad: &SphericalTriad<T>) -> [AxisJacobian<T>; D] {
        let mut jacobians = [self.jacobian(triad, 0); D];
        for k in 1..D {
            jacobians[k] = self.jacobian(triad, k);
        }
        jacobians
    }

    /// How wide joints with this Gaussian are along them.
    #[inline(always)]
    pub(super) fn widths<T: Numeric, const D: usize>(
        &self,
        gaussian: &WorldGaussian<T>,
        in_view: &JointInView<T>,
        jacobians: &[AxisJacobian<T>; D],
    ) -> [Widths<T>; D] {
        let (zero, triad) = (gaussian.opacity.splat(0.0), &in_view.triad);
        let turn = splat_matrix(zero, self.view.pose.rotation);
        let mut widths = [Widths { gradient: [zero; 3], own: [zero; 3], along_triad: [zero; 3] }; D];
        for k in 0..D {
            let gradient = mat_t_vec(&turn, jacobians[k].gradient);
            widths[k].own = mat_t_vec(&gaussian.spread, gradient);
            widths[k].gradient = gradient;
            for (i, direction) in [triad.u, triad.e_az, triad.e_el].into_iter().enumerate() {
                if self.blurs[i] {
                    widths[k].along_triad[i] = dot(jacobians[k].gradient, direction);
                }
            }
        }
        widths
    }

    /// C of those widths, in its squares, and its determinant.
    #[inline(always)]
    pub(super) fn squares<T: Numeric, const D: usize>(
        &self,
        in_view: &JointInView<T>,
        widths: &[Widths<T>; D],
    ) -> (Squares<T, D>, T) {
        let zero = in_view.triad.h.splat(0.0);
        let mut covariance = [[zero; D]; D];
        for k in 0..D {
            for l in 0..=k {
                covariance[k][l] = dot(widths[k].own, widths[l].own);
                for i in 0..3 {
                    if self.blurs[i] {
                        let reach = in_view.blur[i] * in_view.blur[i] * widths[k].along_triad[i];
                        covariance[k][l] = reach.mul_add(widths[l].along_triad[i], covariance[k][l]);
                    }
                }
            }
            covariance[k][k] = covariance[k][k] + (self.own_variance[k] + self.cell);
        }
        Squares::new(&covariance)
    }

    /// What the view makes of it.
    #[inline(always)]
    pub(super) fn projected<T: Numeric, const D: usize>(
        &self,
        gaussian: &WorldGaussian<T>,
        in_view: &JointInView<T>,
        jacobians: &[AxisJacobian<T>; D],
    ) -> ProjectedGaussian<T, D> {
        let JointInView { triad, velocity, .. } = in_view;
        let zero = triad.h.splat(0.0);
        let radial = dot(*velocity, triad.u);
        let mut bin = [zero; D];
        for k in 0..D {
            let axis = &self.view.axes[k];
            let coordinate = if self.sees(axis.kind) { triad.coordinate(axis, radial) } else { zero };
            bin[k] = (coordinate - axis.lo) * self.by_step[k];
        }
        let (squares, mut inverse_weight_sq) = self.squares(in_view, &self.widths(gaussian, in_view, jacobians));
        if self.config.operators.attenuation {
            let d_sq = triad.d.value * triad.d.value;
            inverse_weight_sq = inverse_weight_sq * (d_sq * d_sq) * (d_sq * d_sq);
        }
        let ln_weight = gaussian.ln_opacity - inverse_weight_sq.ln() * 0.5 + self.ln_share;
        let phase = self.phase(triad, radial);
        let phase = phase - (phase * (1.0 / TAU)).floor() * TAU;
        ProjectedGaussian { bin, squares, ln_weight, phase, kappa: self.kappa(gaussian, in_view, jacobians) }
    }

    /// κ = ω̄ v·D, rad per bin; 0 where Doppler is off.
    #[inline(always)]
    pub(super) fn kappa<T: Numeric, const D: usize>(
        &self,
        gaussian: &WorldGaussian<T>,
        in_view: &JointInView<T>,
        jacobians: &[AxisJacobian<T>; D],
    ) -> [T; D] {
        let mut kappa = [gaussian.omega_mean.splat(0.0); D];
        if self.config.operators.doppler {
            for k in 0..D {
                kappa[k] = gaussian.omega_mean * dot(in_view.velocity, jacobians[k].displacement);
            }
        }
        kappa
    }

    #[inline(always)]
    fn jacobian<T: Numeric>(&self, triad: &SphericalTriad<T>, k: usize) -> AxisJacobian<T> {
        let axis = &self.view.axes[k];
        let (direction, arm) = triad.direction_and_arm(axis.kind);
        let slope = triad.slope(axis);
        let (zero, one) = (arm.splat(0.0), arm.splat(1.0));
        let (ratio, by_ratio) = if axis.kind.is_angular() { (slope / arm, arm / slope) } else { (one, one) };
        let gradient = if self.sees(axis.kind) { scale(direction, ratio * self.by_step[k]) } else { [zero; 3] };
        let displacement = scale(direction, by_ratio * self.step[k]);
        AxisJacobian { slope, arm, ratio, by_ratio, direction, gradient, displacement }
    }

    #[inline(always)]
    fn phase<T: Numeric>(&self, triad: &SphericalTriad<T>, radial_mps: T) -> T {
        let [by_tau_sq, by_radial, by_az, by_el] = self.phase;
        let tau = triad.d.value * PER_METRE_S;
        tau * by_tau_sq * tau + radial_mps * by_radial + triad.sin_az * by_az + triad.sin_el * by_el + self.turned
    }

    /// (∂φ/∂d, ∂φ/∂v_r, ∂φ/∂θ_az, ∂φ/∂θ_el).
    #[inline(always)]
    pub(super) fn phase_slopes<T: Numeric>(&self, triad: &SphericalTriad<T>) -> [T; 4] {
        let [by_tau_sq, by_radial, by_az, by_el] = self.phase;
        let tau = triad.d.value * PER_METRE_S;
        [tau * (2.0 * by_tau_sq) * PER_METRE_S, tau.splat(by_radial), triad.cos_az * by_az, triad.cos_el * by_el]
    }
}

impl<T: Numeric, const D: usize> Squares<T, D> {
    /// Of the lower half of C, which is positive definite; and its determinant.
    #[inline(always)]
    fn new(c: &[[T; D]; D]) -> (Self, T) {
        let one = c[0][0].splat(1.0);
        let mut squares = Self { weight: [one / c[0][0]; D], skew: [one.splat(0.0); 3] };
        let mut determinant = c[0][0];
        if D > 1 {
            let s_10 = -c[1][0] * squares.weight[0];
            let d_1 = s_10.mul_add(c[1][0], c[1][1]);
            (squares.weight[1], squares.skew[0]) = (one / d_1, s_10);
            determinant = determinant * d_1;
            if D > 2 {
                let (l_20, mixed) = (c[2][0] * squares.weight[0], s_10.mul_add(c[2][0], c[2][1]));
                let s_21 = -mixed * squares.weight[1];
                let d_2 = s_21.mul_add(mixed, c[2][2] - l_20 * c[2][0]);
                squares.weight[2] = one / d_2;
                (squares.skew[1], squares.skew[2]) = (s_21.mul_add(s_10, -l_20), s_21);
                determinant = determinant * d_2;
            }
        }
        (squares, determinant)
    }

    /// C⁻¹, bins⁻².
    #[inline(always)]
    pub(super) fn precision(&self) -> [[T; D]; D] {
        let Self { weight, skew } = self;
        let mut precision = [[weight[0]; D]; D];
        if D > 1 {
            let s_10 = skew[0];
            precision[1][0] = s_10 * weight[1];
            precision[0][0] = s_10.mul_add(precision[1][0], weight[0]);
            precision[1][1] = weight[1];
            if D > 2 {
                let (s_20, s_21) = (skew[1], skew[2]);
                let (by_0, by_1) = (s_20 * weight[2], s_21 * weight[2]);
                precision[0][0] = s_20.mul_add(by_0, precision[0][0]);
                precision[1][0] = s_21.mul_add(by_0, precision[1][0]);
                precision[1][1] = s_21.mul_add(by_1, precision[1][1]);
                (precision[2][0], precision[2][1], precision[2][2]) = (by_0, by_1, weight[2]);
            }
        }
        for k in 0..D {
            for l in k + 1..D {
                precision[k][l] = precision[l][k];
            }
        }
        precision
    }
}

struct Project<'a, const D: usize> {
    model: &'a ViewModel<'a>,
    gaussians: &'a WorldGaussians,
    splats: &'a mut Splats,
}

impl<const D: usize> JointTask for Project<'_, D> {
    #[inline(always)]
    fn run<B: Batch>(&mut self, batch: B) {
        let gaussian = self.gaussians.of(batch);
        let in_view = self.model.joint_in_view(&gaussian);
        let projected: ProjectedGaussian<B::Number, D> =
            self.model.projected(&gaussian, &in_view, &self.model.jacobians(&in_view.triad));
        let (zero, one) = (batch.splat(0.0), batch.splat(1.0));
        let (mut bin, mut weight, mut kappa) = ([zero; 3], [one; 3], [zero; 3]);
        for k in 0..D {
            let axis = 3 - D + k;
            (bin[axis], weight[axis], kappa[axis]) =
                (projected.bin[k], projected.squares.weight[k], projected.kappa[k]);
        }
        let [s10, s20, s21] = projected.squares.skew;
        let skew = if D == 2 { [zero, zero, s10] } else { [s10, s20, s21] };
        let ([b0, b1, b2], [w0, w1, w2], [s0, s1, s2], [k0, k1, k2]) = (bin, weight, skew, kappa);
        let numbers = [b0, b1, b2, w0, w1, w2, s0, s1, s2, projected.ln_weight, projected.phase, k0, k1, k2];
        batch.store(numbers, &mut self.splats.numbers);
    }
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

/// ω(t) − ω̄ a bin.
pub(super) fn spectrum_of(omega: &[f64], bins: usize) -> impl Iterator<Item = f64> {
    let mean = mean(omega);
    (0..bins).map(move |bin| {
        let (lower, t) = feature_at(bin, bins, omega.len());
        let at = |i: usize| omega.get(i).copied().unwrap_or(0.0);
        let upper = if t == 0.0 { 0.0 } else { at(lower + 1) * t };
        at(lower) * (1.0 - t) + upper - mean
    })
}
