//! Gaussians as translucent splats: EWA splatting (Zwicker et al. 2001; Kerbl et al. 2023, section 4).
//!
//! Σ in view coordinates is projected with the Jacobian J of the perspective at the mean, Σ' = J Σ Jᵀ + 0.3 px² · I,
//! and drawn as a quad along the axes of Σ', k standard deviations and one pixel large. In units of standard
//! deviations the weight is α exp(−½ r²), so the fragment needs no matrix.

use super::cpu::{Canvas, Fragment};
use super::pipeline::{Depth, Drawable};
use super::projection::Projection;
use super::scene::SplatInstance;
use super::{camera::NEAR_M, wgpu};
use glam::Vec2;

/// Variance of the low-pass filter that keeps a distant Gaussian visible, px².
pub(super) const LOW_PASS_PX2: f32 = 0.3;

/// One splat on the screen; the vertex attributes of `gaussians.wgsl`, in order.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct SplatPrimitive {
    /// Mean, px.
    pub(super) center: [f32; 2],
    /// Unit vector of the longer axis; the other one is it turned by 90°.
    axis: [f32; 2],
    /// Standard deviations along the two axes, px.
    sigma: [f32; 2],
    /// Straight colour and opacity.
    color: [f32; 4],
    /// Depth-buffer value of the mean.
    pub(super) z: f32,
}

/// The pipeline's description.
pub(super) const DRAWABLE: Drawable = Drawable {
    label: "gaussians",
    shader: concat!(include_str!("globals.wgsl"), include_str!("gaussians.wgsl")),
    stride: size_of::<SplatPrimitive>(),
    attributes: &wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32x2, 2 => Float32x2, 3 => Float32x4, 4 => Float32],
    depth: Depth::Test,
};

impl SplatPrimitive {
    /// Projects a Gaussian; `None` where it is behind the near plane or off the screen.
    pub(super) fn project(splat: &SplatInstance, projection: &Projection) -> Option<Self> {
        let view = projection.view_point(splat.center);
        if view.z < NEAR_M {
            return None;
        }
        let [a, b, c] = screen_covariance(splat, projection);
        let (mid, spread) = (f32::midpoint(a, c), ((a - c) / 2.0).hypot(b));
        let angle = 0.5 * (2.0 * b).atan2(a - c);
        // Rounding may eat the smaller eigenvalue of a long splat; the low-pass filter is its lower bound.
        let sigma = Vec2::new((mid + spread).sqrt(), (mid - spread).max(LOW_PASS_PX2).sqrt());
        let center = projection.pixel(view);
        let reach = projection.globals.sigma * sigma.x + 1.0;
        let [red, green, blue, alpha] = splat.color;
        projection.on_screen(center, Vec2::splat(reach)).then(|| Self {
            center: center.to_array(),
            axis: [angle.cos(), angle.sin()],
            sigma: sigma.to_array(),
            color: [red, green, blue, alpha * projection.fade(splat)],
            z: projection.globals.buffer_depth(view.z),
        })
    }

    /// Radius of a circle that holds all of it, px.
    pub(super) fn reach(&self, k: f32) -> f32 {
        k * self.sigma[0] + 1.0
    }

    /// Draws it on the CPU; the twin of `gaussians.wgsl`.
    pub(super) fn draw(&self, canvas: &mut Canvas) {
        let (center, reach) = (Vec2::from_array(self.center), Vec2::splat(self.reach(canvas.globals.sigma)));
        let (k, contour) = (canvas.globals.sigma, canvas.globals.contour);
        canvas.draw(center - reach, center + reach, Depth::Test, |px| self.fragment(px, k, contour));
    }

    fn fragment(&self, px: Vec2, k: f32, contour: f32) -> Option<Fragment> {
        let (axis, sigma) = (Vec2::from_array(self.axis), Vec2::from_array(self.sigma));
        let offset = px - Vec2::from_array(self.center);
        let q = Vec2::new(axis.dot(offset), axis.perp_dot(offset)) / sigma;
        let r = q.length();
        let inside_px = if r > 1e-6 { (k - r) * r / (q / sigma).length() } else { 1e6 };
        let fill = (-0.5 * r * r).exp() * (inside_px + 0.5).clamp(0.0, 1.0);
        let ring = contour * (1.0 - inside_px.abs()).clamp(0.0, 1.0);
        let alpha = self.color[3] * (1.0 - (1.0 - fill) * (1.0 - ring));
        (alpha > 1.0 / 1024.0).then(|| Fragment::new(self.color, alpha, self.z))
    }
}

/// Σ' = J Σ Jᵀ + the low-pass filter: xx, xy, yy, px² (y down).
///
/// The Jacobian is taken at the mean, but no farther out than 1.3 times the edge of the view: beyond it the affine
/// approximation has no meaning and would smear a splat over the whole screen.
fn screen_covariance(splat: &SplatInstance, projection: &Projection) -> [f32; 3] {
    let view = projection.view_point(splat.center);
    let focal = projection.globals.focal;
    let limit = 1.3 * projection.viewport / (2.0 * focal);
    let slope = (Vec2::new(view.x, view.y) / view.z).clamp(-limit, limit);
    let scale = focal / view.z;
    let [xx, xy, xz, yy, yz, zz] = projection.view_covariance(splat.covariance);
    let a = xx - 2.0 * slope.x * xz + slope.x * slope.x * zz;
    let b = -(xy - slope.y * xz - slope.x * yz + slope.x * slope.y * zz);
    let c = yy - 2.0 * slope.y * yz + slope.y * slope.y * zz;
    let s2 = scale * scale;
    [a * s2 + LOW_PASS_PX2, b * s2, c * s2 + LOW_PASS_PX2]
}
