//! Lines that stand for things: ground grid, axes, field of view, radar, arrows.
//!
//! World frame, metres: the radar at the origin looks along +x, left is +y, up is +z (SPEC section 1).

use super::camera::Camera;
use super::scene::LineInstance;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// The colours of the x, y and z axis: red, green, blue, no more saturated than they must be.
pub const AXIS_COLORS: [[f32; 4]; 3] = [[0.88, 0.36, 0.34, 1.0], [0.36, 0.72, 0.42, 1.0], [0.36, 0.56, 0.94, 1.0]];

/// How a helper's lines look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Straight sRGB colour and opacity.
    pub color: [f32; 4],
    /// Physical pixels.
    pub width_px: f32,
}

impl Stroke {
    /// One line between two points.
    pub fn line(self, a: Vec3, b: Vec3) -> LineInstance {
        LineInstance { a: a.to_array(), b: b.to_array(), color: self.color, width_px: self.width_px }
    }

    /// Lines from point to point.
    pub fn polyline(self, points: impl IntoIterator<Item = Vec3>) -> Vec<LineInstance> {
        let points: Vec<Vec3> = points.into_iter().collect();
        points.windows(2).filter_map(|pair| Some(self.line(*pair.first()?, *pair.last()?))).collect()
    }
}

/// A level grid at height `z` m with lines every metre from `x.0` to `x.1` and from `y.0` to `y.1` (whole metres).
/// Every line whose coordinate is a multiple of five, zero included, is drawn with `major`.
pub fn grid(x: (i32, i32), y: (i32, i32), z: f32, minor: Stroke, major: Stroke) -> Vec<LineInstance> {
    let stroke = |i: i32| if i % 5 == 0 { major } else { minor };
    let at = |x: i32, y: i32| Vec3::new(x as f32, y as f32, z);
    let along_y = (x.0..=x.1).map(|i| stroke(i).line(at(i, y.0), at(i, y.1)));
    let along_x = (y.0..=y.1).map(|j| stroke(j).line(at(x.0, j), at(x.1, j)));
    along_y.chain(along_x).collect()
}

/// The three axes from `origin`, `length` m long.
pub fn triad(origin: Vec3, length: f32, width_px: f32) -> Vec<LineInstance> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().zip(AXIS_COLORS);
    axes.map(|(axis, color)| Stroke { color, width_px }.line(origin, origin + axis * length)).collect()
}

/// The axes in a corner of the view: overlay lines of `length_px` around the pixel `center`, farthest first, and the
/// pixels where the letters x, y, z belong. Drawn without perspective.
pub fn corner_triad(
    camera: &Camera,
    viewport: Vec2,
    center: Vec2,
    length_px: f32,
    width_px: f32,
) -> (Vec<LineInstance>, [Vec2; 3]) {
    let (basis, eye) = (camera.basis(), camera.eye());
    let depth = 1.0;
    let focal = camera.focal_px(viewport);
    let at = |px: Vec2| {
        let offset = (px - viewport / 2.0) * (depth / focal);
        (eye + basis.forward * depth + basis.right * offset.x - basis.up * offset.y).to_array()
    };
    let on_screen = |axis: Vec3| Vec2::new(basis.right.dot(axis), -basis.up.dot(axis));
    let mut axes: Vec<(f32, LineInstance)> = [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .zip(AXIS_COLORS)
        .map(|(axis, color)| {
            let line = LineInstance { a: at(center), b: at(center + on_screen(axis) * length_px), color, width_px };
            (basis.forward.dot(axis), line)
        })
        .collect();
    axes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let letters = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| center + on_screen(axis) * (length_px + 9.0));
    (axes.into_iter().map(|(_, line)| line).collect(), letters)
}

/// An arrow with two barbs that face `eye`. Nothing where it has no length.
pub fn arrow(from: Vec3, to: Vec3, eye: Vec3, stroke: Stroke) -> Vec<LineInstance> {
    let shaft = to - from;
    let length = shaft.length();
    if !length.is_finite() || length < 1e-4 {
        return Vec::new();
    }
    let direction = shaft / length;
    let side = direction.cross(eye - to).try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
    let head = (0.3 * length).min(0.07);
    let barb = |sign: f32| stroke.line(to, to - direction * head + side * (sign * 0.45 * head));
    vec![stroke.line(from, to), barb(1.0), barb(-1.0)]
}

/// A point at a range, azimuth (positive to the left) and elevation as seen from the origin.
pub fn polar(range_m: f32, azimuth_rad: f32, elevation_rad: f32) -> Vec3 {
    let ((sin_az, cos_az), (sin_el, cos_el)) = (azimuth_rad.sin_cos(), elevation_rad.sin_cos());
    Vec3::new(cos_el * cos_az, cos_el * sin_az, sin_el) * range_m
}

/// The field of view of a radar at the origin: its four edges, and the outline of the far end at `range_m`, for
/// azimuths ± `half_azimuth_rad` and elevations ± `half_elevation_rad`.
pub fn frustum(half_azimuth_rad: f32, half_elevation_rad: f32, range_m: f32, stroke: Stroke) -> Vec<LineInstance> {
    let (az, el) = (half_azimuth_rad.min(PI), half_elevation_rad.min(PI / 2.0));
    let steps = |half: f32| {
        let n = ((half * 2.0 / 6_f32.to_radians()).ceil() as usize).max(1);
        (0..=n).map(move |i| half * (2.0 * i as f32 / n as f32 - 1.0))
    };
    let mut lines = Vec::new();
    for sign in [-1.0, 1.0] {
        lines.push(stroke.line(Vec3::ZERO, polar(range_m, az, sign * el)));
        lines.push(stroke.line(Vec3::ZERO, polar(range_m, -az, sign * el)));
        lines.extend(stroke.polyline(steps(az).map(|azimuth| polar(range_m, azimuth, sign * el))));
        lines.extend(stroke.polyline(steps(el).map(|elevation| polar(range_m, sign * az, elevation))));
    }
    lines
}

/// Range rings at the given ranges and the two limits of the field of view, level at height `z` m.
pub fn range_rings(half_azimuth_rad: f32, ranges_m: &[f32], z: f32, stroke: Stroke) -> Vec<LineInstance> {
    let up = Vec3::Z * z;
    let n = ((half_azimuth_rad * 2.0 / 4_f32.to_radians()).ceil() as usize).max(1);
    let azimuth = |i: usize| half_azimuth_rad * (2.0 * i as f32 / n as f32 - 1.0);
    let ring = |&range: &f32| stroke.polyline((0..=n).map(move |i| polar(range, azimuth(i), 0.0) + up));
    let farthest = ranges_m.iter().copied().fold(0.0, f32::max);
    let limit = |sign: f32| stroke.line(up, polar(farthest, sign * half_azimuth_rad, 0.0) + up);
    ranges_m.iter().flat_map(ring).chain([limit(-1.0), limit(1.0)]).collect()
}

/// A radar at the origin: its board, `size` m wide, facing +x, two rows of antennas and a short boresight.
pub fn radar(size: f32, stroke: Stroke) -> Vec<LineInstance> {
    let at = |y: f32, z: f32| Vec3::new(0.0, y * size, z * size);
    let board = [at(0.5, 0.35), at(-0.5, 0.35), at(-0.5, -0.35), at(0.5, -0.35), at(0.5, 0.35)];
    let antenna = |i: i32| {
        let y = 0.22 * i as f32;
        stroke.line(at(y, 0.18), at(y, -0.18))
    };
    let boresight = stroke.line(Vec3::ZERO, Vec3::X * size);
    stroke.polyline(board).into_iter().chain([-1, 0, 1].map(antenna)).chain([boresight]).collect()
}
