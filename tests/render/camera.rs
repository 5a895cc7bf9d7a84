//! The camera's conventions and its invariants under orbit, pan and zoom.

use mhp_inspector::render::{Camera, Vec2, Vec3};
use proptest::prelude::*;

const VIEWPORT: Vec2 = Vec2::new(800.0, 600.0);

fn px(camera: &Camera, point: Vec3) -> Vec2 {
    camera.project(point, VIEWPORT).unwrap().px
}

#[test]
fn left_is_left_and_up_is_up() {
    let center = Vec3::new(3.0, 0.0, 0.0);
    for camera in [Camera::from_radar(), Camera::front(center, 1.0), Camera::top(center, 1.0), Camera::default()] {
        let middle = px(&camera, camera.target);
        assert!(middle.distance(VIEWPORT / 2.0) < 1e-2, "the target is in the middle: {middle}");
        assert!(px(&camera, camera.target + Vec3::Y * 0.1).x < middle.x, "the radar's left is on the left");
    }
    let from_radar = Camera::from_radar();
    assert!(from_radar.eye().length() < 1e-5);
    assert!(px(&from_radar, Vec3::new(3.0, 0.0, 0.1)).y < 300.0, "z is up");
    let top = Camera::top(center, 1.0);
    assert!(px(&top, center + Vec3::X * 0.1).y < px(&top, center).y, "range is upward");
    let side = Camera::side(center, 1.0);
    assert!(px(&side, center + Vec3::X * 0.1).x > px(&side, center).x, "range is to the right");
    assert!(px(&side, center + Vec3::Z * 0.1).y < px(&side, center).y, "height is upward");
}

#[test]
fn a_focused_sphere_fills_the_height() {
    let (center, radius) = (Vec3::new(2.0, 1.0, 0.3), 0.7);
    let camera = Camera::front(center, radius);
    // The tangent from the eye touches the sphere at half the field of view.
    let half_angle = (radius / camera.eye().distance(center)).asin();
    assert!((half_angle - camera.fov_y / 2.0).abs() < 1e-5);
}

#[test]
fn a_point_behind_the_eye_is_nowhere() {
    assert_eq!(Camera::from_radar().project(Vec3::new(-1.0, 0.0, 0.0), VIEWPORT), None);
    assert_eq!(Camera::from_radar().project(Vec3::NAN, VIEWPORT), None);
}

#[test]
fn a_drag_turns_the_scene_with_the_cursor() {
    let mut camera = Camera::front(Vec3::new(3.0, 0.0, 0.0), 1.0);
    let near = camera.target - Vec3::X * 0.2;
    let before = px(&camera, near);
    camera.orbit(30.0, 20.0);
    let after = px(&camera, near);
    assert!(after.x > before.x && after.y > before.y, "{before} -> {after}");
}

fn cameras() -> impl Strategy<Value = Camera> {
    let angles = (0.0_f32..6.2, -1.5_f32..1.5, 0.4_f32..1.5);
    ((-3.0_f32..3.0, -3.0_f32..3.0, -1.0_f32..2.0), 0.5_f32..20.0, angles).prop_map(
        |((x, y, z), distance, (yaw, pitch, fov_y))| Camera { target: Vec3::new(x, y, z), distance, yaw, pitch, fov_y },
    )
}

/// A pixel and the offset along the ray's depth.
fn pixels() -> impl Strategy<Value = Vec2> {
    (5.0_f32..795.0, 5.0_f32..595.0).prop_map(|(x, y)| Vec2::new(x, y))
}

/// The point of the target's plane (parallel to the screen) under a pixel.
fn on_target_plane(camera: &Camera, px: Vec2) -> Vec3 {
    let ray = camera.ray(px, VIEWPORT);
    let forward = (camera.target - camera.eye()).normalize();
    ray.origin + ray.direction * (camera.distance / ray.direction.dot(forward))
}

proptest! {
    #[test]
    fn project_and_the_matrices_agree(camera in cameras(), at in pixels(), depth in 0.2_f32..30.0) {
        let ray = camera.ray(at, VIEWPORT);
        let point = ray.origin + ray.direction * depth;
        let projected = camera.project(point, VIEWPORT).unwrap();
        prop_assert!(projected.px.distance(at) < 0.5, "ray and project are inverse: {} {}", projected.px, at);
        let clip = camera.projection(VIEWPORT.x / VIEWPORT.y) * camera.view() * point.extend(1.0);
        let ndc = clip.truncate() / clip.w;
        let px = Vec2::new(ndc.x + 1.0, 1.0 - ndc.y) * VIEWPORT / 2.0;
        prop_assert!(px.distance(at) < 0.5, "matrices: {px} {at}");
        prop_assert!((0.0..=1.0).contains(&ndc.z));
    }

    #[test]
    fn orbit_keeps_target_distance_and_upright(mut camera in cameras(), dx in -500_f32..500.0, dy in -500_f32..500.0) {
        let (target, distance) = (camera.target, camera.distance);
        camera.orbit(dx, dy);
        prop_assert!(camera.target == target && camera.distance == distance);
        prop_assert!((camera.eye().distance(target) - distance).abs() < 1e-4 * distance);
        prop_assert!(camera.pitch.abs() <= std::f32::consts::FRAC_PI_2);
        let up = camera.view().transform_vector3(Vec3::Z);
        prop_assert!(up.x.abs() < 1e-5 && up.y >= -1e-5, "z never tilts: {up}");
    }

    #[test]
    fn pan_keeps_the_point_under_the_cursor(mut camera in cameras(), from in pixels(), to in pixels()) {
        let grabbed = on_target_plane(&camera, from);
        camera.pan(to.x - from.x, to.y - from.y, VIEWPORT);
        prop_assert!(px(&camera, grabbed).distance(to) < 0.5);
    }

    #[test]
    fn zoom_keeps_the_point_under_the_cursor(mut camera in cameras(), at in pixels(), factor in 0.5_f32..2.0) {
        let (point, before) = (on_target_plane(&camera, at), camera.distance);
        let ndc = Vec2::new(at.x / VIEWPORT.x * 2.0 - 1.0, 1.0 - at.y / VIEWPORT.y * 2.0);
        camera.zoom(factor, Some(ndc), VIEWPORT.x / VIEWPORT.y);
        prop_assert!((camera.distance * factor - before).abs() < 1e-4 * before);
        prop_assert!(px(&camera, point).distance(at) < 0.5);
    }

    #[test]
    fn zoom_and_focus_stay_within_limits(mut camera in cameras(), factor in proptest::num::f32::ANY) {
        camera.zoom(factor, None, 1.0);
        prop_assert!((0.05..=200.0).contains(&camera.distance));
        camera.focus(Vec3::ZERO, factor);
        prop_assert!((0.05..=200.0).contains(&camera.distance));
    }
}
