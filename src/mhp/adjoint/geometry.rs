//! Adjoints of where a joint is seen: collected by what they belong to, folded into those of position and velocity.

use crate::geometry::{Number, Vec3, add_scaled, dot, norm, scale};
use crate::mhp::splat::{Look, Scene};
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

impl<T: Number> Geometry<T> {
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
    pub(super) fn direction(&mut self, look: &Look<T>, axis: &Axis, bar: Vec3<T>) {
        let one = bar[0].like(1.0);
        match axis.kind {
            AxisKind::Range => add_scaled(&mut self.u, bar, one),
            AxisKind::Azimuth => add_scaled(&mut self.e_az, bar, one),
            AxisKind::Elevation => add_scaled(&mut self.e_el, bar, one),
            AxisKind::Cone => self.cone_direction(look, bar),
            AxisKind::DepthH => add_scaled(&mut self.e_h, bar, one),
            AxisKind::DepthV => add_scaled(&mut self.e_rho, bar, one),
            AxisKind::Doppler | AxisKind::X | AxisKind::Y | AxisKind::Z => {}
        }
    }

    /// e_cone = (ŷ − s u)/cos.
    #[inline(always)]
    fn cone_direction(&mut self, look: &Look<T>, bar: Vec3<T>) {
        let seen = &look.seen;
        let cosine = seen.cos_cone().value;
        add_scaled(&mut self.u, bar, -seen.u[1] / cosine);
        self.u[1] -= dot(bar, seen.u) / cosine;
        self.cone_cosine(look, -dot(bar, seen.e_cone()) / cosine);
    }

    /// cos = √(1 − s²), s = u_y.
    #[inline(always)]
    fn cone_cosine(&mut self, look: &Look<T>, bar: T) {
        let (s, cosine) = (look.seen.u[1], look.seen.cos_cone());
        self.u[1] -= bar * s / cosine.value * cosine.pass;
    }

    /// ∂L/∂(the direction of a point spread): u, e_az or e_el.
    #[inline(always)]
    pub(super) fn blurred(&mut self, along: usize, bar: Vec3<T>) {
        let one = bar[0].like(1.0);
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
    pub(super) fn slope(&mut self, look: &Look<T>, axis: &Axis, bar: T) {
        let seen = &look.seen;
        match (axis.spacing, axis.kind) {
            (Spacing::Sine, AxisKind::Azimuth) => self.azimuth -= bar * seen.sin_az * seen.cos_az_floored.pass,
            (Spacing::Sine, AxisKind::Elevation) => self.elevation -= bar * seen.sin_el * seen.cos_el_floored.pass,
            (Spacing::Sine, AxisKind::Cone) => self.cone_cosine(look, bar),
            _ => {}
        }
    }

    /// ∂L/∂ξ.
    #[inline(always)]
    pub(super) fn coordinate(&mut self, look: &Look<T>, axis: &Axis, bar: T) {
        let (seen, sine) = (&look.seen, axis.spacing == Spacing::Sine);
        match axis.kind {
            AxisKind::Range => self.d += bar,
            AxisKind::Azimuth => self.azimuth += bar * if sine { seen.cos_az } else { bar.like(1.0) },
            AxisKind::Elevation => self.elevation += bar * if sine { seen.cos_el } else { bar.like(1.0) },
            AxisKind::Cone if sine => self.u[1] += bar,
            // At the pole of the cone the arcsine has no derivative; the floor keeps the answer finite.
            AxisKind::Cone => self.u[1] += bar / (bar.like(1.0) - seen.u[1] * seen.u[1]).root().at_least(1e-9),
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
    pub(super) fn fold(mut self, scene: &Scene<'_>, look: &Look<T>) -> (Vec3<T>, Vec3<T>) {
        let seen = &look.seen;
        add_scaled(&mut self.v, seen.u, self.radial);
        add_scaled(&mut self.u, look.velocity, self.radial);
        // du = e_el dθ_el + cos el e_az dθ_az, de_az = −e_ρ dθ_az, de_el = −u dθ_el − sin el e_az dθ_az, de_ρ = e_az dθ_az
        self.elevation += dot(self.u, seen.e_el) - dot(self.e_el, seen.u);
        self.azimuth +=
            seen.cos_el * dot(self.u, seen.e_az) - dot(self.e_az, seen.e_rho) - seen.sin_el * dot(self.e_el, seen.e_az)
                + dot(self.e_rho, seen.e_az);
        let across_h = [-seen.e_h[2], seen.h.like(0.0), seen.e_h[0]];
        let mut p = self.p;
        add_scaled(&mut p, seen.u, self.d * seen.d.pass);
        add_scaled(&mut p, seen.e_rho, self.rho * seen.rho.pass);
        add_scaled(&mut p, seen.e_h, self.h);
        // Angles and unit directions come from the point itself, not from the floored lengths: so do their slopes.
        let [x, y, _] = seen.p;
        add_scaled(&mut p, seen.e_az, self.azimuth * inverse((x * x + y * y).root()));
        add_scaled(&mut p, seen.e_el, self.elevation * inverse(norm(seen.p)));
        add_scaled(&mut p, across_h, dot(self.e_h, across_h) * inverse(seen.h));
        (unmove(scene, look.unmoved, p), self.v)
    }
}

/// 1/length; 0 at the one point where an angle has no slope.
#[inline(always)]
fn inverse<T: Number>(length_m: T) -> T {
    length_m.below(1e-12, length_m.like(0.0), length_m.like(1.0) / length_m)
}

/// p = p₀ max(d₀ − δ, floor)/d₀.
#[inline(always)]
fn unmove<T: Number>(scene: &Scene<'_>, unmoved: Vec3<T>, p_bar: Vec3<T>) -> Vec3<T> {
    if scene.config.surface_offset_m == 0.0 {
        return p_bar;
    }
    let (factor, d, skin) = scene.surface_factor(unmoved);
    let mut bar = scale(p_bar, factor);
    let length = norm(unmoved);
    // The slope of the factor, along the unit vector of p₀.
    let slope = d.pass * (skin.pass - factor) / (d.value * length);
    let slope = length.below(f64::MIN_POSITIVE, length.like(0.0), slope);
    add_scaled(&mut bar, unmoved, dot(p_bar, unmoved) * slope);
    bar
}
