//! Gaussians as opaque lit surfaces at k standard deviations: each pixel's ray is intersected with the ellipsoid.
//!
//! With A = (k²Σ)⁻¹ and s₀ the ray's point at the centre's depth, relative to the centre, the ray s₀ + τ d meets the
//! surface where a τ² + 2 B τ + C = 0, a = dᵀAd, B = s₀ᵀAd, C = s₀ᵀAs₀ − 1. Starting at the centre's depth, and not at the
//! eye, keeps all numbers of order one and so exact in f32. q = C + 1 − B²/a is the squared distance of the ray from the
//! centre, 1 on the silhouette; its gradient per pixel gives the antialiased edge. The quad is the bounding box of the
//! silhouette's exact conic.

use super::camera::NEAR_M;
use super::cpu::{Canvas, Fragment};
use super::pipeline::{Depth, Drawable};
use super::projection::{Globals, Projection, Symmetric, apply, invert};
use super::scene::SplatInstance;
use super::wgpu;
use glam::{Vec2, Vec3};

/// Where the light comes from, view coordinates (from the upper left behind the camera).
const LIGHT: Vec3 = Vec3::new(-0.36, 0.48, -0.8);

/// One ellipsoid in view coordinates; the vertex attributes of `ellipsoids.wgsl`, in order.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct EllipsoidPrimitive {
    /// Lower and upper corner of its bounding box, px.
    bounds: [f32; 4],
    /// Its centre, px, and its depth, m.
    center: [f32; 3],
    /// A: xx, xy, xz.
    inverse_x: [f32; 3],
    /// A: yy, yz, zz.
    inverse_yz: [f32; 3],
    /// Its colour; the opacity is not used.
    color: [f32; 4],
}

/// The pipeline's description.
pub(super) const DRAWABLE: Drawable = Drawable {
    label: "ellipsoids",
    shader: concat!(include_str!("globals.wgsl"), include_str!("ellipsoids.wgsl")),
    stride: size_of::<EllipsoidPrimitive>(),
    attributes: &wgpu::vertex_attr_array![
        0 => Float32x4, 1 => Float32x3, 2 => Float32x3, 3 => Float32x3, 4 => Float32x4
    ],
    depth: Depth::TestAndWrite,
};

impl EllipsoidPrimitive {
    /// Projects a Gaussian's surface; `None` where it is off the screen or reaches the near plane.
    pub(super) fn project(splat: &SplatInstance, projection: &Projection) -> Option<Self> {
        let view = projection.view_point(splat.center);
        let k2 = projection.globals.sigma * projection.globals.sigma;
        let scaled = projection.view_covariance(splat.covariance).map(|c| c * k2);
        let (min, max) = silhouette_bounds(&scaled, view, projection)?;
        let [xx, xy, xz, yy, yz, zz] = invert(&scaled)?;
        let center = projection.pixel(view);
        let (min, max) = (min - 1.0, max + 1.0);
        projection.on_screen((min + max) / 2.0, (max - min) / 2.0).then_some(Self {
            bounds: [min.x, min.y, max.x, max.y],
            center: [center.x, center.y, view.z],
            inverse_x: [xx, xy, xz],
            inverse_yz: [yy, yz, zz],
            color: splat.color,
        })
    }

    /// Depth of its centre, m.
    pub(super) fn depth(&self) -> f32 {
        self.center[2]
    }

    /// Draws it on the CPU; the twin of `ellipsoids.wgsl`.
    pub(super) fn draw(&self, canvas: &mut Canvas) {
        let [x0, y0, x1, y1] = self.bounds;
        let globals = canvas.globals;
        canvas.draw(Vec2::new(x0, y0), Vec2::new(x1, y1), Depth::TestAndWrite, |px| self.fragment(px, &globals));
    }

    fn fragment(&self, px: Vec2, globals: &Globals) -> Option<Fragment> {
        let [cx, cy, depth] = self.center;
        let inverse = [
            self.inverse_x[0],
            self.inverse_x[1],
            self.inverse_x[2],
            self.inverse_yz[0],
            self.inverse_yz[1],
            self.inverse_yz[2],
        ];
        let slope = (px - Vec2::from_array(globals.viewport) / 2.0) / globals.focal;
        let d = Vec3::new(slope.x, -slope.y, 1.0);
        let s0 = Vec3::new(px.x - cx, cy - px.y, 0.0) * (depth / globals.focal);
        let (ad, as0) = (apply(&inverse, d), apply(&inverse, s0));
        let (a, b) = (d.dot(ad), s0.dot(ad));
        let q = (s0.dot(as0) - b * b / a).max(0.0);
        let r = q.sqrt();
        // By the envelope theorem the gradient of q at the ray's closest point s* is 2 A s* (depth of s*)/focal.
        let closest = -b / a;
        let slope_per_px = (as0 + ad * closest).truncate().length() * (depth + closest) / globals.focal;
        let inside_px = if r > 1e-6 { (1.0 - r) * r / slope_per_px.max(1e-12) } else { 1e6 };
        let coverage = (inside_px + 0.5).clamp(0.0, 1.0);
        let tau = closest - ((1.0 - q).max(0.0) / a).sqrt();
        let normal = (as0 + ad * tau).normalize();
        let shade = 0.6 + 0.4 * normal.dot(LIGHT).max(0.0);
        let [red, green, blue, _] = self.color;
        let color = [red * shade, green * shade, blue * shade, 1.0];
        let z = globals.buffer_depth((depth + tau).max(NEAR_M));
        (coverage > 1.0 / 256.0).then(|| Fragment::new(color, coverage, z))
    }
}

/// Bounding box of the silhouette, px: with M = k²Σ − c cᵀ (the dual conic), x/depth = X is tangent where
/// M_xx − 2 X M_xd + X² M_dd = 0, likewise y.
fn silhouette_bounds(scaled: &Symmetric, c: Vec3, projection: &Projection) -> Option<(Vec2, Vec2)> {
    let [xx, _, xd, yy, yd, dd] = *scaled;
    if c.z - dd.sqrt() < NEAR_M {
        return None;
    }
    let m_dd = dd - c.z * c.z;
    let tangents = |m_aa: f32, m_ad: f32| {
        let root = (m_ad * m_ad - m_aa * m_dd).max(0.0).sqrt();
        ((m_ad + root) / m_dd, (m_ad - root) / m_dd)
    };
    let (x0, x1) = tangents(xx - c.x * c.x, xd - c.x * c.z);
    let (y0, y1) = tangents(yy - c.y * c.y, yd - c.y * c.z);
    let (middle, focal) = (projection.viewport / 2.0, projection.globals.focal);
    Some((middle + Vec2::new(x0, -y1) * focal, middle + Vec2::new(x1, -y0) * focal))
}
