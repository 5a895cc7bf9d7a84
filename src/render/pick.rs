//! Which Gaussian is under the cursor: the nearest surface the pixel's ray meets, else the closest centre near by.

use super::camera::{Camera, NEAR_M, Ray};
use super::projection::{Projection, Symmetric, apply, invert};
use super::scene::{NOT_PICKABLE, Scene, SplatInstance};
use glam::{Vec2, Vec3};

/// How far from a centre a click still counts where it hits no surface, px.
const CENTER_RADIUS_PX: f32 = 8.0;

/// The id of the Gaussian at pixel `px` of a view `viewport` pixels large: the nearest whose surface at `scene.sigma`
/// standard deviations the ray meets, else the one whose centre is closest within 8 px, else none.
pub fn pick(scene: &Scene, camera: &Camera, px: Vec2, viewport: Vec2) -> Option<u32> {
    let ray = camera.ray(px, viewport);
    let k = scene.effective_sigma();
    let candidates = || scene.splats.iter().filter(|splat| splat.id != NOT_PICKABLE && splat.is_valid());
    let size = [viewport.x.max(1.0) as u32, viewport.y.max(1.0) as u32];
    let projection = Projection::new(camera, size, scene);
    let hits = candidates()
        .filter(|splat| projection.fade(splat) >= 1.0)
        .filter_map(|splat| Some((hit(splat, &ray, k)?, splat.id)));
    let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
    let closest = || {
        candidates()
            .filter_map(|splat| {
                Some((camera.project(Vec3::from_array(splat.center), viewport)?.px.distance(px), splat.id))
            })
            .filter(|(distance, _)| *distance <= CENTER_RADIUS_PX)
            .min_by(|a, b| a.0.total_cmp(&b.0))
    };
    nearest.or_else(closest).map(|(_, id)| id)
}

/// Distance along the ray to where it enters the surface at `k` standard deviations, m. A surface around the eye is
/// not hit: it cannot be seen.
fn hit(splat: &SplatInstance, ray: &Ray, k: f32) -> Option<f32> {
    let inverse: Symmetric = invert(&splat.covariance)?;
    let to_center = Vec3::from_array(splat.center) - ray.origin;
    // Start at the point closest to the centre, so that the numbers stay of order one.
    let closest = to_center.dot(ray.direction);
    let s = ray.direction * closest - to_center;
    let (ad, a_s) = (apply(&inverse, ray.direction), apply(&inverse, s));
    let (a, b, c) = (ray.direction.dot(ad), s.dot(ad), s.dot(a_s) - k * k);
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let entry = closest + (-b - discriminant.sqrt()) / a;
    (entry > NEAR_M).then_some(entry)
}
