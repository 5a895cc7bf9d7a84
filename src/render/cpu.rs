//! The CPU twin of the GPU renderer: the same primitives in the same order, shaded pixel by pixel in Rust.

use super::camera::Camera;
use super::order::{DrawList, Kind};
use super::pipeline::Depth;
use super::projection::Globals;
use super::renderer::{MAX_SIDE_PX, clamped_size};
use super::scene::Scene;
use glam::Vec2;
use image::RgbaImage;

/// What a drawable answers for one pixel.
pub(super) struct Fragment {
    /// Premultiplied colour and coverage.
    premultiplied: [f32; 4],
    /// Depth-buffer value.
    z: f32,
}

impl Fragment {
    /// A straight colour, of which `alpha` counts; its own opacity must be in `alpha` already.
    pub(super) fn new([red, green, blue, _]: [f32; 4], alpha: f32, z: f32) -> Self {
        Self { premultiplied: [red * alpha, green * alpha, blue * alpha, alpha], z }
    }
}

/// Colour and depth of the picture while it is drawn.
pub(super) struct Canvas {
    size: [u32; 2],
    pub(super) globals: Globals,
    pixels: Vec<([f32; 4], f32)>,
}

impl Canvas {
    fn new(size: [u32; 2], globals: Globals, background: [f32; 4]) -> Self {
        let clear = (premultiplied(background), 1.0);
        Self { size, globals, pixels: vec![clear; size[0] as usize * size[1] as usize] }
    }

    /// Shades every pixel whose centre may lie between two corners, px.
    pub(super) fn draw(&mut self, min: Vec2, max: Vec2, depth: Depth, shade: impl Fn(Vec2) -> Option<Fragment>) {
        let span =
            |lo: f32, hi: f32, n: u32| (lo - 0.5).floor().max(0.0) as u32..((hi + 0.5).ceil().max(0.0) as u32).min(n);
        for y in span(min.y, max.y, self.size[1]) {
            for x in span(min.x, max.x, self.size[0]) {
                let index = y as usize * self.size[0] as usize + x as usize;
                let fragment = shade(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                if let (Some(fragment), Some(pixel)) = (fragment, self.pixels.get_mut(index)) {
                    blend(pixel, &fragment, depth);
                }
            }
        }
    }

    fn into_image(self) -> RgbaImage {
        let mut image = RgbaImage::new(self.size[0], self.size[1]);
        for (target, (color, _)) in image.pixels_mut().zip(&self.pixels) {
            target.0 = color.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        }
        image
    }
}

fn blend((color, stored_z): &mut ([f32; 4], f32), fragment: &Fragment, depth: Depth) {
    if depth != Depth::Ignore && fragment.z > *stored_z {
        return;
    }
    let keep = 1.0 - fragment.premultiplied[3];
    for (c, source) in color.iter_mut().zip(fragment.premultiplied) {
        *c = source + *c * keep;
    }
    if depth == Depth::TestAndWrite {
        *stored_z = fragment.z;
    }
}

/// Premultiplies a straight colour, clamped to 0..=1; a colour that is not finite becomes transparent black.
pub(super) fn premultiplied(straight: [f32; 4]) -> [f32; 4] {
    if !straight.iter().all(|c| c.is_finite()) {
        return [0.0; 4];
    }
    let [red, green, blue, alpha] = straight.map(|c| c.clamp(0.0, 1.0));
    [red * alpha, green * alpha, blue * alpha, alpha]
}

/// Draws a scene, premultiplied alpha; `size` is clamped as the GPU renderer does ([`clamped_size`]).
pub fn render(size: [u32; 2], scene: &Scene, camera: &Camera) -> RgbaImage {
    let size = clamped_size(size, MAX_SIDE_PX);
    let prepared = DrawList::new(scene, camera, size);
    let mut canvas = Canvas::new(size, prepared.globals, scene.background);
    for run in &prepared.runs {
        let range = run.range.start as usize..run.range.end as usize;
        match run.kind {
            Kind::Splat => take(&prepared.splats, range).for_each(|splat| splat.draw(&mut canvas)),
            Kind::Ellipsoid => take(&prepared.ellipsoids, range).for_each(|e| e.draw(&mut canvas)),
            Kind::Line => take(&prepared.lines, range).for_each(|line| line.draw(&mut canvas, Depth::TestAndWrite)),
            Kind::Overlay => take(&prepared.overlay, range).for_each(|line| line.draw(&mut canvas, Depth::Ignore)),
        }
    }
    canvas.into_image()
}

fn take<T>(items: &[T], range: std::ops::Range<usize>) -> std::slice::Iter<'_, T> {
    items.get(range).unwrap_or_default().iter()
}
