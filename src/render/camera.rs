//! A camera that orbits a target; z is up and never tilts.
//!
//! The basis is written from yaw and pitch, not from a look-at, so that looking straight down is a view like any other:
//! with yaw π the radar's left stays on the left of the screen at every pitch.

use glam::{Mat4, Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Nearest drawn depth, m.
pub(crate) const NEAR_M: f32 = 0.02;
/// Farthest drawn depth, m.
pub(crate) const FAR_M: f32 = 500.0;
const RADIANS_PER_PX: f32 = 0.006;
const DISTANCE_M: std::ops::RangeInclusive<f32> = 0.05..=200.0;

/// An orbit camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The point it turns around, world frame, m.
    pub target: Vec3,
    /// Distance of the eye from the target, m.
    pub distance: f32,
    /// Azimuth of the eye as seen from the target, radians from +x towards +y. π looks along the radar's boresight.
    pub yaw: f32,
    /// Elevation of the eye as seen from the target, radians, −π/2..=π/2.
    pub pitch: f32,
    /// Vertical field of view, radians.
    pub fov_y: f32,
}

/// Where a world point falls on the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projected {
    /// Pixels from the upper left corner, y down.
    pub px: Vec2,
    /// Distance along the viewing direction, m.
    pub depth: f32,
}

/// A half line, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Its start (the eye), m.
    pub origin: Vec3,
    /// Its direction, of length 1.
    pub direction: Vec3,
}

/// The directions of the screen in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Basis {
    pub(crate) right: Vec3,
    pub(crate) up: Vec3,
    pub(crate) forward: Vec3,
}

impl Default for Camera {
    fn default() -> Self {
        Self::overview(Vec3::new(3.0, 0.0, 0.8), 2.5)
    }
}

impl Camera {
    /// Three-quarter view from behind and above the radar of a sphere, m.
    pub fn overview(center: Vec3, radius: f32) -> Self {
        Self::looking_at(center, radius, PI + 0.55, 0.38)
    }

    /// From the radar: the eye at the origin, looking along +x, left on the left.
    pub fn from_radar() -> Self {
        Self { target: Vec3::new(3.0, 0.0, 0.0), distance: 3.0, yaw: PI, pitch: 0.0, fov_y: 60_f32.to_radians() }
    }

    /// From above: range upward, left on the left.
    pub fn top(center: Vec3, radius: f32) -> Self {
        Self::looking_at(center, radius, PI, FRAC_PI_2)
    }

    /// From the right of the radar, level: range to the right, height upward.
    pub fn side(center: Vec3, radius: f32) -> Self {
        Self::looking_at(center, radius, -FRAC_PI_2, 0.0)
    }

    /// From the radar's side, level, along +x: left on the left, height upward.
    pub fn front(center: Vec3, radius: f32) -> Self {
        Self::looking_at(center, radius, PI, 0.0)
    }

    fn looking_at(center: Vec3, radius: f32, yaw: f32, pitch: f32) -> Self {
        let mut camera = Self { target: center, distance: 1.0, yaw, pitch, fov_y: 35_f32.to_radians() };
        camera.focus(center, radius);
        camera
    }

    /// Moves so that a sphere, m, fills the height of the view; keeps the direction.
    pub fn focus(&mut self, center: Vec3, radius: f32) {
        self.target = center;
        self.distance = clamp_distance(radius.max(0.01) / (self.fov_y / 2.0).sin());
    }

    /// Turns around the target by a drag of `dx`, `dy` pixels (y down): what is in front follows the cursor.
    pub fn orbit(&mut self, dx: f32, dy: f32) {
        self.yaw = (self.yaw - dx * RADIANS_PER_PX).rem_euclid(2.0 * PI);
        self.pitch = (self.pitch + dy * RADIANS_PER_PX).clamp(-FRAC_PI_2, FRAC_PI_2);
    }

    /// Shifts the target by a drag of `dx`, `dy` pixels: points at the target's depth stay under the cursor.
    pub fn pan(&mut self, dx: f32, dy: f32, viewport: Vec2) {
        let metres_per_px = self.distance / self.focal_px(viewport);
        let basis = self.basis();
        self.target += (basis.up * dy - basis.right * dx) * metres_per_px;
    }

    /// Comes closer by `factor` (below 1: moves away). `toward`, in normalised device coordinates (y up) with the
    /// view's `aspect`: the point of the target's plane under it stays where it is on the screen.
    pub fn zoom(&mut self, factor: f32, toward: Option<Vec2>, aspect: f32) {
        if !(factor.is_finite() && factor > 0.0) {
            return;
        }
        let before = self.distance;
        self.distance = clamp_distance(before / factor);
        if let Some(ndc) = toward {
            let basis = self.basis();
            let half_height = (self.fov_y / 2.0).tan() * (before - self.distance);
            self.target += (basis.right * ndc.x * aspect + basis.up * ndc.y) * half_height;
        }
    }

    /// The eye, world frame, m.
    pub fn eye(&self) -> Vec3 {
        self.target - self.basis().forward * self.distance
    }

    pub(crate) fn basis(&self) -> Basis {
        let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = (self.yaw.sin_cos(), self.pitch.sin_cos());
        Basis {
            right: Vec3::new(-sin_yaw, cos_yaw, 0.0),
            up: Vec3::new(-sin_pitch * cos_yaw, -sin_pitch * sin_yaw, cos_pitch),
            forward: -Vec3::new(cos_pitch * cos_yaw, cos_pitch * sin_yaw, sin_pitch),
        }
    }

    /// View from world: x right, y up, −z into the screen.
    pub fn view(&self) -> Mat4 {
        let Basis { right, up, forward } = self.basis();
        let eye = self.eye();
        Mat4::from_cols(
            Vec3::new(right.x, up.x, -forward.x).extend(0.0),
            Vec3::new(right.y, up.y, -forward.y).extend(0.0),
            Vec3::new(right.z, up.z, -forward.z).extend(0.0),
            Vec3::new(-right.dot(eye), -up.dot(eye), forward.dot(eye)).extend(1.0),
        )
    }

    /// Clip space from view, depth 0..1, y up.
    pub fn projection(&self, aspect: f32) -> Mat4 {
        glam::camera::rh::proj::directx::perspective(self.fov_y, aspect.max(1e-6), NEAR_M, FAR_M)
    }

    /// Focal length in pixels of a view `viewport` pixels large.
    pub(crate) fn focal_px(&self, viewport: Vec2) -> f32 {
        viewport.y.max(1.0) / (2.0 * (self.fov_y / 2.0).tan())
    }

    /// x right, y up (m) and depth (m) of a world point as seen by the camera.
    pub(crate) fn view_point(&self, world: Vec3) -> Vec3 {
        let basis = self.basis();
        let p = world - self.eye();
        Vec3::new(basis.right.dot(p), basis.up.dot(p), basis.forward.dot(p))
    }

    /// Where a world point falls in a view `viewport` pixels large; `None` behind the near plane.
    pub fn project(&self, world: Vec3, viewport: Vec2) -> Option<Projected> {
        let p = self.view_point(world);
        let focal = self.focal_px(viewport);
        (p.z >= NEAR_M && p.is_finite())
            .then(|| Projected { px: viewport / 2.0 + Vec2::new(p.x, -p.y) * (focal / p.z), depth: p.z })
    }

    /// The half line from the eye through a pixel of a view `viewport` pixels large.
    pub fn ray(&self, px: Vec2, viewport: Vec2) -> Ray {
        let Basis { right, up, forward } = self.basis();
        let offset = (px - viewport / 2.0) / self.focal_px(viewport);
        Ray { origin: self.eye(), direction: (forward + right * offset.x - up * offset.y).normalize() }
    }
}

fn clamp_distance(distance: f32) -> f32 {
    if distance.is_nan() { 1.0 } else { distance.clamp(*DISTANCE_M.start(), *DISTANCE_M.end()) }
}
