//! Adjoints of where a joint is seen: collected by what they belong to, folded into those of position and velocity.

use crate::geometry::{Numeric, Vec3, add_scaled, dot, norm, scale};
use crate::mhp::splat::{JointInView, ViewModel};
use crate::radar::{Axis, AxisKind, Spacing};

/// Adjoints of the geometry at a joint.
pub(super) struct Geometry<T> {
    pub(super) p: Vec3<T>,
    pub(super) v: Vec3<T>,
    pub(super) d: T,
    pub(super) rho: T,
    pub(super) h: T,
    pub(super) azimuth: T,
    pub(super) elevation: T,
    pub(super) u: Vec3<T>,
    pub(super) e_az: Vec3<T>,
    pub(super) e_el: Vec3<T>,
    pub(super) e_h: Vec3<T>,
    pub(super) e_rho: Vec3<T>,
    pub(super) radial: T,
}

impl<T: Numeric> Geometry<T> {
    #[inline(always)]
    pub(super) fn nothing(zero: T) -> Self {
        let none = [zero; 3];
        Self {
            p: none,
            v: none,
            d: zero,
            rho: zero,
            h: zero,
            azimuth: zero,
            elevation: zero,
            u: none,
            e_az: none,
            e_el: none,
            e_h: none,
            e_rho: none,
            radial: zero,
        }
    }

    /// ∂L/∂(unit direction of an axis).
    #[inline(always)]
    pub(super) fn direction(&mut self, in_view: &JointInView<T>, axis: &Axis, bar: Vec3<T>) {
        let one = bar[0].splat(1.0);
        match axis.kind {
            AxisKind::Range => add_scaled(&mut self.u, bar, one),
            AxisKind::Azimuth => add_scaled(&mut self.e_az, bar, one),
            AxisKind::Elevation => add_scaled(&mut self.e_el, bar, one),
            AxisKind::Cone => self.cone_direction(in_view, bar),
            AxisKind::DepthH => add_scaled(&mut self.e_h, bar, one),
            AxisKind::DepthV => add_scaled(&mut self.e_rho, bar, one),
            AxisKind::Doppler | AxisKind::X | AxisKind::Y | AxisKind::Z => {}
        }
    }

    /// e_cone = (ŷ − s u)/cos.
    #[inline(always)]
    fn cone_direction(&mut self, in_view: &JointInView<T>, bar: Vec3<T>) {
        let triad = &in_view.triad;
        let cosine = triad.cos_cone().value;
        add_scaled(&mut self.u, bar, -triad.u[1] / cosine);
        self.u[1] -= dot(bar, triad.u) / cosine;
        self.cone_cosine(in_view, -dot(bar, triad.e_cone()) / cosine);
    }

    /// cos = √(1 − s²), s = u_y.
    #[inline(always)]
    fn cone_cosine(&mut self, in_view: &JointInView<T>, bar: T) {
        let (s, cosine) = (in_view.triad.u[1], in_view.triad.cos_cone());
        self.u[1] -= bar * s / cosine.value * cosine.pass;
    }

    /// ∂L/∂(the direction of a point spread): u, e_az or e_el.
    #[inline(always)]
    pub(super) fn blurred(&mut self, along: usize, bar: Vec3<T>) {
        let one = bar[0].splat(1.0);
        match along {
            0 => add_scaled(&mut self.u, bar, one),
            1 => add_scaled(&mut self.e_az, bar, one),
            _ => add_scaled(&mut self.e_el, bar, one),
        }
    }

    /// ∂L/∂(arm of an axis): ρ or d.
    #[inline(always)]
    pub(super) fn arm(&mut self, kind: AxisKind, bar: T) {
        match kind {
            AxisKind::Azimuth => self.rho += bar,
            AxisKind::Elevation | AxisKind::Cone => self.d += bar,
            _ => {}
        }
    }

    /// ∂L/∂(dξ/dθ), which depends on the angle on a sine axis only.
    #[inline(always)]
    pub(super) fn slope(&mut self, in_view: &JointInView<T>, axis: &Axis, bar: T) {
        let triad = &in_view.triad;
        match (axis.spacing, axis.kind) {
            (Spacing::Sine, AxisKind::Azimuth) => self.azimuth -= bar * triad.sin_az * triad.cos_az_floored.pass,
            (Spacing::Sine, AxisKind::Elevation) => self.elevation -= bar * triad.sin_el * triad.cos_el_floored.pass,
            (Spacing::Sine, AxisKind::Cone) => self.cone_cosine(in_view, bar),
            _ => {}
        }
    }

    /// ∂L/∂ξ.
    #[inline(always)]
    pub(super) fn coordinate(&mut self, in_view: &JointInView<T>, axis: &Axis, bar: T) {
        let (triad, sine) = (&in_view.triad, axis.spacing == Spacing::Sine);
        match axis.kind {
            AxisKind::Range => self.d += bar,
            AxisKind::Azimuth => self.azimuth += bar * if sine { triad.cos_az } else { bar.splat(1.0) },
            AxisKind::Elevation => self.elevation += bar * if sine { triad.cos_el } else { bar.splat(1.0) },
            AxisKind::Cone if sine => self.u[1] += bar,
            // At the pole of the cone the arcsine has no derivative; the floor keeps the answer finite.
            AxisKind::Cone => self.u[1] += bar / (bar.splat(1.0) - triad.u[1] * triad.u[1]).sqrt().max(1e-9),
            AxisKind::Doppler => self.radial += bar,
            AxisKind::X => self.p[0] += bar,
            AxisKind::Y => self.p[1] += bar,
            AxisKind::Z => self.p[2] += bar,
            AxisKind::DepthH => self.h += bar,
            AxisKind::DepthV => self.rho += bar,
        }
    }

    /// Folds everything into (∂L/∂p before the surface offset, ∂L/∂v), view frame.
    #[inline(always)]
    pub(super) fn fold(mut self, model: &ViewModel<'_>, in_view: &JointInView<T>) -> (Vec3<T>, Vec3<T>) {
        let triad = &in_view.triad;
        add_scaled(&mut self.v, triad.u, self.radial);
        add_scaled(&mut self.u, in_view.velocity, self.radial);
        // du = e_el dθ_el + cos el e_az dθ_az, de_az = −e_ρ dθ_az, de_el = −u dθ_el − sin el e_az dθ_az, de_ρ = e_az dθ_az
        self.elevation += dot(self.u, triad.e_el) - dot(self.e_el, triad.u);
        self.azimuth += triad.cos_el * dot(self.u, triad.e_az)
            - dot(self.e_az, triad.e_rho)
            - triad.sin_el * dot(self.e_el, triad.e_az)
            + dot(self.e_rho, triad.e_az);
        let across_h = [-triad.e_h[2], triad.h.splat(0.0), triad.e_h[0]];
        let mut p = self.p;
        add_scaled(&mut p, triad.u, self.d * triad.d.pass);
        add_scaled(&mut p, triad.e_rho, self.rho * triad.rho.pass);
        add_scaled(&mut p, triad.e_h, self.h);
        // Angles and unit directions come from the point itself, not from the floored lengths: so do their slopes.
        let [x, y, _] = triad.p;
        add_scaled(&mut p, triad.e_az, self.azimuth * inverse((x * x + y * y).sqrt()));
        add_scaled(&mut p, triad.e_el, self.elevation * inverse(norm(triad.p)));
        add_scaled(&mut p, across_h, dot(self.e_h, across_h) * inverse(triad.h));
        (unmove(model, in_view.unmoved, p), self.v)
    }
}

/// 1/length; 0 at the one point where an angle has no slope.
#[inline(always)]
fn inverse<T: Numeric>(length_m: T) -> T {
    length_m.select_lt(1e-12, length_m.splat(0.0), length_m.splat(1.0) / length_m)
}

/// p = p₀ max(d₀ − δ, floor)/d₀.
#[inline(always)]
fn unmove<T: Numeric>(model: &ViewModel<'_>, unmoved: Vec3<T>, p_bar: Vec3<T>) -> Vec3<T> {
    if model.nearer_m == 0.0 {
        return p_bar;
    }
    let (factor, d, skin) = model.surface_factor(unmoved);
    let mut bar = scale(p_bar, factor);
    let length = norm(unmoved);
    // The slope of the factor, along the unit vector of p₀.
    let slope = d.pass * (skin.pass - factor) / (d.value * length);
    let slope = length.select_lt(f64::MIN_POSITIVE, length.splat(0.0), slope);
    add_scaled(&mut bar, unmoved, dot(p_bar, unmoved) * slope);
    bar
}
