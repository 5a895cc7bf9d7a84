//! Straight lines with round caps (thin ones end flat), of constant width on the screen, antialiased by their distance in pixels.
//!
//! A line is clipped by the near and far planes and by the picture's edge before it becomes a quad, so that no vertex
//! is far off the screen. It can be cut into pieces along its length (`order`), which share their edges exactly: the
//! caps and the fade belong to the whole line, so no seam shows.

use super::camera::{FAR_M, NEAR_M};
use super::cpu::{Canvas, Fragment};
use super::pipeline::{Depth, Drawable};
use super::projection::Projection;
use super::scene::LineInstance;
use super::wgpu;
use glam::{Vec2, Vec3};

/// Lines up to this width, px, end flat: the caps of a thin translucent polyline would show as dots.
const MAX_FLAT_PX: f32 = 1.5;

/// A piece of a line on the screen; the vertex attributes of `lines.wgsl`, in order.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct LinePrimitive {
    /// Start of the whole line, px.
    start: [f32; 2],
    /// Unit vector along it.
    direction: [f32; 2],
    /// Length of the whole line and half its width, px.
    shape: [f32; 2],
    /// Where along the line this piece begins and ends, px from `start`; caps included.
    piece: [f32; 2],
    /// Depth-buffer values at these two.
    pub(super) z: [f32; 2],
    /// Straight colour and opacity.
    color: [f32; 4],
}

const SHADER: &str = concat!(include_str!("globals.wgsl"), include_str!("lines.wgsl"));
const STRIDE: usize = size_of::<LinePrimitive>();
const ATTRIBUTES: &[wgpu::VertexAttribute] = &wgpu::vertex_attr_array![
    0 => Float32x2, 1 => Float32x2, 2 => Float32x2, 3 => Float32x2, 4 => Float32x2, 5 => Float32x4
];

/// Lines that are hidden by what is in front of them.
pub(super) const DRAWABLE: Drawable =
    Drawable { label: "lines", shader: SHADER, stride: STRIDE, attributes: ATTRIBUTES, depth: Depth::TestAndWrite };

/// Lines on top of everything.
pub(super) const OVERLAY: Drawable =
    Drawable { label: "overlay lines", shader: SHADER, stride: STRIDE, attributes: ATTRIBUTES, depth: Depth::Ignore };

impl LinePrimitive {
    /// Projects a line; `None` where nothing of it is on the screen.
    pub(super) fn project(line: &LineInstance, projection: &Projection) -> Option<Self> {
        let (a, b) = clip_depth(projection.view_point(line.a), projection.view_point(line.b))?;
        let half = line.width_px.max(1.0) / 2.0;
        let z = [a, b].map(|p| projection.globals.buffer_depth(p.z));
        let ends = [projection.pixel(a), projection.pixel(b)];
        let (t0, t1) = clip_rectangle(ends, projection.viewport, half + 2.0)?;
        let [start, end] = [t0, t1].map(|t| ends[0].lerp(ends[1], t));
        let [z0, z1] = [t0, t1].map(|t| z[0] + (z[1] - z[0]) * t);
        let length = start.distance(end);
        let direction = if length > 1e-4 { (end - start) / length } else { Vec2::X };
        let cap = if line.width_px > MAX_FLAT_PX { half + 1.0 } else { 0.0 };
        let [red, green, blue, alpha] = line.color;
        Some(Self {
            start: start.to_array(),
            direction: direction.to_array(),
            shape: [length, half],
            piece: [-cap, length + cap],
            z: [z0, z1],
            color: [red, green, blue, alpha * line.width_px.min(1.0)],
        })
    }

    /// Cuts a whole line where it passes the depth of something it overlaps on the screen; `obstacles` are (centre px,
    /// radius px, depth-buffer value). The pieces come in order along the line.
    pub(super) fn cut(self, obstacles: impl Iterator<Item = (Vec2, f32, f32)>, pieces: &mut Vec<Self>) {
        let (start, direction) = (Vec2::from_array(self.start), Vec2::from_array(self.direction));
        let ([length, half], [z0, z1]) = (self.shape, self.z);
        let crossing = |(center, radius, z): (Vec2, f32, f32)| {
            let along = (center - start).dot(direction).clamp(0.0, length);
            let near = center.distance(start + direction * along) <= radius + half + 1.0;
            let t = (z - z0) / (z1 - z0);
            (near && t > 0.0 && t < 1.0).then_some(t * length)
        };
        let mut cuts: Vec<f32> = obstacles.filter_map(crossing).collect();
        cuts.sort_by(f32::total_cmp);
        let mut rest = self;
        let depth_at = |s: f32| z0 + (z1 - z0) * (s / length.max(1e-6)).clamp(0.0, 1.0);
        for s in cuts.into_iter().filter(|s| s.is_finite()) {
            pieces.push(Self { piece: [rest.piece[0], s], z: [rest.z[0], depth_at(s)], ..self });
            rest = Self { piece: [s, rest.piece[1]], z: [depth_at(s), z1], ..self };
        }
        pieces.push(rest);
    }

    /// The depth-buffer value in its middle, by which it is ordered.
    pub(super) fn mid_z(&self) -> f32 {
        f32::midpoint(self.z[0], self.z[1])
    }

    /// Draws it on the CPU; the twin of `lines.wgsl`.
    pub(super) fn draw(&self, canvas: &mut Canvas, depth: Depth) {
        let (start, direction) = (Vec2::from_array(self.start), Vec2::from_array(self.direction));
        let ends = self.piece.map(|s| start + direction * s);
        let margin = direction.perp().abs() * (self.shape[1] + 1.0);
        let (min, max) = (ends[0].min(ends[1]) - margin, ends[0].max(ends[1]) + margin);
        canvas.draw(min, max, depth, |px| self.fragment(px - start, direction));
    }

    fn fragment(&self, offset: Vec2, direction: Vec2) -> Option<Fragment> {
        let ([length, half], [lo, hi]) = (self.shape, self.piece);
        let (along, across) = (direction.dot(offset), direction.perp_dot(offset));
        if !(lo..hi).contains(&along) {
            return None;
        }
        let beyond = (-along).max(along - length).max(0.0);
        let coverage = (half + 0.5 - beyond.hypot(across)).clamp(0.0, 1.0);
        let alpha = self.color[3] * coverage;
        let z = self.z[0] + (self.z[1] - self.z[0]) * (along - lo) / (hi - lo);
        (alpha > 1.0 / 512.0).then(|| Fragment::new(self.color, alpha, z))
    }
}

/// The part between the near and the far plane, view coordinates.
fn clip_depth(a: Vec3, b: Vec3) -> Option<(Vec3, Vec3)> {
    let (lo, hi) = (NEAR_M * 1.01, FAR_M * 0.99);
    if !(a.is_finite() && b.is_finite()) || a.z.max(b.z) < lo || a.z.min(b.z) > hi {
        return None;
    }
    let at = |z: f32| a.lerp(b, (z - a.z) / (b.z - a.z));
    let end = |p: Vec3| {
        if p.z < lo {
            at(lo)
        } else if p.z > hi {
            at(hi)
        } else {
            p
        }
    };
    Some((end(a), end(b)))
}

/// The part (t₀, t₁) of a segment within `margin` of the picture; Liang and Barsky (1984).
fn clip_rectangle(ends: [Vec2; 2], viewport: Vec2, margin: f32) -> Option<(f32, f32)> {
    let delta = ends[1] - ends[0];
    let (mut t0, mut t1) = (0.0_f32, 1.0_f32);
    let sides = [
        (-delta.x, ends[0].x + margin),
        (delta.x, viewport.x + margin - ends[0].x),
        (-delta.y, ends[0].y + margin),
        (delta.y, viewport.y + margin - ends[0].y),
    ];
    for (p, q) in sides {
        if p == 0.0 {
            if q < 0.0 {
                return None;
            }
        } else if p < 0.0 {
            t0 = t0.max(q / p);
        } else {
            t1 = t1.min(q / p);
        }
    }
    (t0 <= t1).then_some((t0, t1))
}
