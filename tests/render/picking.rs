//! Which Gaussian is under the cursor.

use super::demo::{DARK, covariance, scene};
use mhp_inspector::render::{Camera, NOT_PICKABLE, Scene, SplatInstance, Vec2, Vec3, pick};
use proptest::prelude::*;

const VIEWPORT: Vec2 = Vec2::new(800.0, 600.0);

fn ball(center: [f32; 3], sigma: f32, id: u32) -> SplatInstance {
    SplatInstance { center, covariance: covariance(Vec3::X, sigma, sigma), color: [1.0; 4], id }
}

fn px(camera: &Camera, splat: &SplatInstance) -> Vec2 {
    camera.project(Vec3::from_array(splat.center), VIEWPORT).unwrap().px
}

#[test]
fn the_nearer_of_two_in_line_is_picked() {
    let camera = Camera::from_radar();
    let splats = vec![ball([4.0, 0.0, 0.0], 0.1, 1), ball([2.0, 0.0, 0.0], 0.1, 2), ball([3.0, 0.0, 0.0], 0.1, 3)];
    let mut scene = Scene { splats, ..Scene::default() };
    assert_eq!(pick(&scene, &camera, VIEWPORT / 2.0, VIEWPORT), Some(2));
    scene.splats[1].id = NOT_PICKABLE;
    assert_eq!(pick(&scene, &camera, VIEWPORT / 2.0, VIEWPORT), Some(3));
    scene.splats[2].covariance = [f32::NAN; 6];
    assert_eq!(pick(&scene, &camera, VIEWPORT / 2.0, VIEWPORT), Some(1));
    scene.splats.clear();
    assert_eq!(pick(&scene, &camera, VIEWPORT / 2.0, VIEWPORT), None);
}

#[test]
fn the_surface_ends_at_sigma() {
    let camera = Camera::from_radar();
    let mut scene = Scene { splats: vec![ball([3.0, 0.0, 0.0], 0.1, 7)], ..Scene::default() };
    // The silhouette of a ball of radius kσ at distance d: tan(asin(kσ/d)) from the middle.
    let focal = 300.0 / 30_f32.to_radians().tan();
    for sigma in [1.0_f32, 2.0, 3.0] {
        scene.sigma = sigma;
        let edge = focal * (0.1 * sigma / 3.0).asin().tan();
        let at = |radius: f32| pick(&scene, &camera, VIEWPORT / 2.0 + Vec2::new(0.6, 0.8) * radius, VIEWPORT);
        assert_eq!(at(edge - 0.5), Some(7));
        assert_eq!(at(edge + 0.5), None);
    }
}

#[test]
fn a_small_one_is_picked_within_eight_pixels() {
    let camera = Camera::from_radar();
    let splats = vec![ball([5.0, 0.0, 0.0], 1e-4, 1), ball([5.0, -0.1, 0.0], 1e-4, 2)];
    let scene = Scene { splats, ..Scene::default() };
    let first = px(&camera, &scene.splats[0]);
    assert_eq!(pick(&scene, &camera, first - Vec2::X * 7.5, VIEWPORT), Some(1));
    assert_eq!(pick(&scene, &camera, first - Vec2::X * 8.5, VIEWPORT), None);
    let between = first.lerp(px(&camera, &scene.splats[1]), 0.6);
    assert_eq!(pick(&scene, &camera, between, VIEWPORT), Some(2));
}

#[test]
fn a_splat_around_or_behind_the_eye_is_not_picked() {
    let camera = Camera::from_radar();
    let splats = vec![ball([0.1, 0.0, 0.0], 1.0, 1), ball([-3.0, 0.0, 0.0], 0.2, 2)];
    assert_eq!(pick(&Scene { splats, ..Scene::default() }, &camera, Vec2::new(10.0, 10.0), VIEWPORT), None);
}

proptest! {
    #[test]
    fn an_unoccluded_center_is_picked(dx in -2000_f32..2000.0, dy in -200_f32..200.0, zoom in 0.5_f32..3.0) {
        let mut camera = Camera::overview(Vec3::new(3.0, 0.0, -0.15), 1.0);
        camera.orbit(dx, dy);
        camera.zoom(zoom, None, 1.0);
        let scene = scene(&DARK, &camera, VIEWPORT);
        let eye = camera.eye();
        let k = scene.effective_sigma();
        for splat in &scene.splats {
            let center = Vec3::from_array(splat.center);
            let direction = (center - eye).normalize();
            // An independent, conservative test: no other's bounding ball (longest σ 0.085 m) comes near the sight line.
            let free = scene.splats.iter().filter(|other| other.id != splat.id).all(|other| {
                let offset = Vec3::from_array(other.center) - eye;
                (offset - direction * offset.dot(direction)).length() > k * 0.086
            });
            if free {
                prop_assert_eq!(pick(&scene, &camera, px(&camera, splat), VIEWPORT), Some(splat.id));
            }
        }
    }
}

/// One that takes more than half of the picture is hit in its middle only: what is behind it can be picked.
#[test]
fn a_gaussian_as_large_as_the_picture_hides_nothing() {
    let camera = Camera::from_radar();
    let splats = vec![ball([2.0, 0.0, 0.0], 0.6, 1), ball([4.0, 0.5, 0.0], 0.05, 2)];
    let small = px(&camera, &splats[1]);
    let mut scene = Scene { splats, ..Scene::default() };
    assert_eq!(pick(&scene, &camera, small, VIEWPORT), Some(1));
    scene.largest = 0.5;
    assert_eq!(pick(&scene, &camera, small, VIEWPORT), Some(2));
    assert_eq!(pick(&scene, &camera, VIEWPORT / 2.0, VIEWPORT), Some(1));
    assert_eq!(pick(&scene, &camera, VIEWPORT / 2.0 + Vec2::new(40.0, 90.0), VIEWPORT), None);
}
