//! A point as a view sees it: distances, angles and the directions around it; SPEC sections 1 and 3.
#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the one function that is compiled for an instruction set"
)]

use crate::geometry::{Mat3, Numeric, Vec3, norm, scale};
use crate::radar::{Axis, AxisKind, Spacing};

/// Distances are held above this, m.
pub(super) const DISTANCE_FLOOR_M: f64 = 0.01;
/// Cosines that stand in a denominator are held above this.
const COSINE_FLOOR: f64 = 0.05;

/// A quantity held above a floor; its gradient is zero while it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Floored<T = f64> {
    /// max(x, floor)
    pub value: T,
    /// 1 where the gradient passes, 0 where the floor holds.
    pub pass: T,
}

impl<T: Numeric> Floored<T> {
    #[inline(always)]
    pub(super) fn new(x: T, floor: f64) -> Self {
        // A NaN must stay visible, so the comparison lets it through.
        Self { value: x.select_lt(floor, x.splat(floor), x), pass: x.select_lt(floor, x.splat(0.0), x.splat(1.0)) }
    }
}

/// A point in the view frame and the directions around it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SphericalTriad<T = f64> {
    /// The point after the surface offset, m.
    pub p: Vec3<T>,
    /// d = ‖p‖, m.
    pub d: Floored<T>,
    /// ρ = √(x² + y²), m.
    pub rho: Floored<T>,
    /// √(x² + z²), m.
    pub h: T,
    pub sin_az: T,
    pub cos_az: T,
    pub sin_el: T,
    pub cos_el: T,
    /// cos θ_az where it stands in a denominator.
    pub cos_az_floored: Floored<T>,
    /// cos θ_el where it stands in a denominator.
    pub cos_el_floored: Floored<T>,
    /// Radial unit vector; u_y = s is the sine of the cone angle.
    pub u: Vec3<T>,
    pub e_az: Vec3<T>,
    pub e_el: Vec3<T>,
    /// Horizontal radial unit vector, (cos az, sin az, 0).
    pub e_rho: Vec3<T>,
    /// Unit vector of (x, 0, z).
    pub e_h: Vec3<T>,
}

/// The direction of (a, b), whose length is given; at the origin that of a.
#[inline(always)]
fn direction<T: Numeric>(a: T, b: T, length: T) -> [T; 2] {
    let (zero, one) = (a.splat(0.0), a.splat(1.0));
    let by_length = one / length;
    [length.select_lt(f64::MIN_POSITIVE, one, a * by_length), length.select_lt(f64::MIN_POSITIVE, zero, b * by_length)]
}

impl<T: Numeric> SphericalTriad<T> {
    #[inline(always)]
    pub(super) fn new(p: Vec3<T>) -> Self {
        let [x, y, z] = p;
        let zero = x.splat(0.0);
        let (rho, h, d) = ((x * x + y * y).sqrt(), (x * x + z * z).sqrt(), norm(p));
        // At the origin and above it, angles are 0.
        let ([cos_az, sin_az], [cos_el, sin_el]) = (direction(x, y, rho), direction(rho, z, d));
        let u = [cos_el * cos_az, cos_el * sin_az, sin_el];
        let [h_x, h_z] = direction(x, z, h);
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
            e_az: [-sin_az, cos_az, zero],
            e_el: [-sin_el * cos_az, -sin_el * sin_az, cos_el],
            e_rho: [cos_az, sin_az, zero],
            e_h: [h_x, zero, h_z],
        }
    }

    /// √(1 − s²), the cosine of the cone angle.
    #[inline(always)]
    pub(super) fn cos_cone(&self) -> Floored<T> {
        let s = self.u[1];
        Floored::new((s.splat(1.0) - s * s).max(0.0).sqrt(), COSINE_FLOOR)
    }

    /// (ŷ − s u)/cos.
    #[inline(always)]
    pub(super) fn e_cone(&self) -> Vec3<T> {
        let [x, s, z] = self.u;
        let one = s.splat(1.0);
        scale([-s * x, one - s * s, -s * z], one / self.cos_cone().value)
    }

    /// The coordinate ξ of this point on `axis`, in axis units; `radial_mps` is v_r.
    #[inline(always)]
    pub(super) fn coordinate(&self, axis: &Axis, radial_mps: T) -> T {
        let sine = axis.spacing == Spacing::Sine;
        match axis.kind {
            AxisKind::Range => self.d.value,
            AxisKind::Azimuth if sine => self.sin_az,
            AxisKind::Azimuth => self.sin_az.zip_map(self.cos_az, f64::atan2),
            AxisKind::Elevation if sine => self.sin_el,
            AxisKind::Elevation => self.sin_el.zip_map(self.cos_el, f64::atan2),
            AxisKind::Cone if sine => self.u[1],
            AxisKind::Cone => self.u[1].map(|s| s.clamp(-1.0, 1.0).asin()),
            AxisKind::Doppler => radial_mps,
            AxisKind::X => self.p[0],
            AxisKind::Y => self.p[1],
            AxisKind::Z => self.p[2],
            AxisKind::DepthH => self.h,
            AxisKind::DepthV => self.rho.value,
        }
    }

    /// dξ/dθ of an angular axis: 1, or the floored cosine on a sine axis.
    #[inline(always)]
    pub(super) fn slope(&self, axis: &Axis) -> T {
        match (axis.spacing, axis.kind) {
            (Spacing::Sine, AxisKind::Azimuth) => self.cos_az_floored.value,
            (Spacing::Sine, AxisKind::Elevation) => self.cos_el_floored.value,
            (Spacing::Sine, AxisKind::Cone) => self.cos_cone().value,
            _ => self.h.splat(1.0),
        }
    }

    /// The unit direction along ∂ξ/∂p, and the arm: ∂ξ/∂p = direction · slope / arm. A Doppler axis has none.
    #[inline(always)]
    pub(super) fn direction_and_arm(&self, kind: AxisKind) -> (Vec3<T>, T) {
        let (zero, one) = (self.h.splat(0.0), self.h.splat(1.0));
        match kind {
            AxisKind::Range => (self.u, one),
            AxisKind::Azimuth => (self.e_az, self.rho.value),
            AxisKind::Elevation => (self.e_el, self.d.value),
            AxisKind::Cone => (self.e_cone(), self.d.value),
            AxisKind::Doppler => ([zero; 3], one),
            AxisKind::X => ([one, zero, zero], one),
            AxisKind::Y => ([zero, one, zero], one),
            AxisKind::Z => ([zero, zero, one], one),
            AxisKind::DepthH => (self.e_h, one),
            AxisKind::DepthV => (self.e_rho, one),
        }
    }
}

/// The same matrix for all that `like` stands for.
#[inline(always)]
pub(super) fn splat_matrix<T: Numeric>(like: T, of: Mat3) -> Mat3<T> {
    let mut matrix = [[like; 3]; 3];
    for i in 0..3 {
        for k in 0..3 {
            matrix[i][k] = like.splat(of[i][k]);
        }
    }
    matrix
}
