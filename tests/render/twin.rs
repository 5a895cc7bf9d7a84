//! The GPU and the CPU twin agree.

use super::demo::{self, DARK, LIGHT, Theme};
use super::gpu;
use image::RgbaImage;
use mhp_inspector::render::{
    Camera, LineInstance, Scene, SceneMode, SplatInstance, Undrawable, Vec2, Vec3, clamped_size, cpu,
};

/// Mean difference of a channel, and the share of pixels in which a channel differs by more than 4 of 255.
fn difference(a: &RgbaImage, b: &RgbaImage) -> (f64, f64) {
    assert_eq!(a.dimensions(), b.dimensions());
    let (mut sum, mut outliers) = (0.0, 0.0);
    for (p, q) in a.pixels().zip(b.pixels()) {
        let channels = p.0.iter().zip(q.0).map(|(x, y)| f64::from(x.abs_diff(y)));
        sum += channels.clone().sum::<f64>();
        outliers += f64::from(u8::from(channels.fold(0.0, f64::max) > 4.0));
    }
    let n = a.pixels().len() as f64;
    (sum / (4.0 * n), outliers / n)
}

fn assert_twins(name: &str, size: [u32; 2], scene: &Scene, camera: &Camera) {
    let Some(mut gpu) = gpu() else { return };
    let picture = gpu.render(size, scene, camera).unwrap();
    let twin = cpu::render(size, scene, camera);
    let (mean, outliers) = difference(&picture, &twin);
    eprintln!("{name}: mean difference {mean:.4}, outliers {outliers:.6} ({})", gpu.adapter().name);
    if let Some(folder) = std::env::var_os("MHP_RENDER_OUT") {
        let folder = std::path::PathBuf::from(folder);
        picture.save(folder.join(format!("{name}.png"))).unwrap();
        twin.save(folder.join(format!("{name}-cpu.png"))).unwrap();
    }
    assert!(mean < 0.1, "{name}: mean difference {mean}");
    assert!(outliers < 2e-4, "{name}: {outliers} of the pixels differ");
    let background = twin.get_pixel(0, 0);
    assert!(twin.pixels().filter(|p| *p != background).count() > 100, "{name}: nothing was drawn");
}

fn demo_twins(name: &str, theme: &Theme, camera: &Camera, mode: SceneMode) {
    let size = [960, 640];
    let scene = Scene { mode, ..demo::scene(theme, camera, Vec2::new(960.0, 640.0)) };
    assert_eq!(scene.invalid_instances(), 0);
    assert_twins(name, size, &scene, camera);
}

#[test]
fn demo_dark() {
    demo_twins("overview-dark", &DARK, &Camera::overview(Vec3::new(2.2, 0.0, -0.3), 1.6), SceneMode::Splat);
}

#[test]
fn demo_light() {
    demo_twins("overview-light", &LIGHT, &Camera::overview(Vec3::new(2.2, 0.0, -0.3), 1.6), SceneMode::Splat);
}

#[test]
fn demo_person_close_up() {
    demo_twins("person-dark", &DARK, &Camera::overview(Vec3::new(3.0, 0.0, -0.15), 1.0), SceneMode::Splat);
}

#[test]
fn demo_ellipsoids() {
    let camera = Camera::overview(Vec3::new(3.0, 0.0, -0.15), 1.0);
    demo_twins("person-ellipsoids-dark", &DARK, &camera, SceneMode::Ellipsoid);
    demo_twins("person-ellipsoids-light", &LIGHT, &camera, SceneMode::Ellipsoid);
}

#[test]
fn demo_presets() {
    demo_twins("top-light", &LIGHT, &Camera::top(Vec3::new(2.5, 0.0, 0.0), 3.0), SceneMode::Splat);
    demo_twins("radar-dark", &DARK, &Camera::from_radar(), SceneMode::Splat);
}

#[test]
fn splats_alone() {
    let splat = |i: u32| SplatInstance {
        center: [3.0 + 0.3 * i as f32, 0.2 * i as f32 - 0.5, 0.1 * i as f32],
        covariance: demo::covariance(Vec3::new(1.0, i as f32, 0.5), 0.3, 0.02),
        color: [0.2 * i as f32, 0.9, 0.3, 0.9],
        id: i,
    };
    let scene = Scene { splats: (0..5).map(splat).collect(), ..Scene::default() };
    assert_twins("splats", [300, 200], &scene, &Camera::from_radar());
}

#[test]
fn lines_alone_near_and_far() {
    let line = |a: [f32; 3], b: [f32; 3], width_px: f32| LineInstance { a, b, color: [1.0, 0.8, 0.2, 0.9], width_px };
    let lines = vec![
        line([1.0, -0.5, -0.4], [4.0, 0.9, 0.5], 7.0),
        line([-3.0, 0.1, -0.3], [9.0, -0.4, 0.2], 2.0),
        line([2.0, -50.0, 0.0], [2.0, 50.0, 0.1], 1.0),
        line([2.0, 0.0, 0.3], [2.0, 0.0, 0.3], 9.0),
        line([1.0, 0.02, 0.0], [3.0, 0.06, 0.0], 5.0),
        line([2.0, 0.3, -0.9], [2.0, 0.31, 0.9], 0.4),
    ];
    assert_twins("lines", [300, 200], &Scene { lines, ..Scene::default() }, &Camera::from_radar());
}

#[test]
fn an_unchanged_scene_is_not_drawn_again() {
    let Some(mut gpu) = gpu() else { return };
    let mut camera = Camera::default();
    let mut scene = demo::scene(&DARK, &camera, Vec2::new(64.0, 48.0));
    gpu.render([64, 48], &scene, &camera).unwrap();
    gpu.render([64, 48], &scene, &camera).unwrap();
    assert_eq!((gpu.renderer().pictures(), gpu.renderer().target_generation()), (1, 1));
    camera.orbit(3.0, 0.0);
    gpu.render([64, 48], &scene, &camera).unwrap();
    scene.splats[3].color[0] += 0.01;
    gpu.render([64, 48], &scene, &camera).unwrap();
    assert_eq!((gpu.renderer().pictures(), gpu.renderer().target_generation()), (3, 1));
    gpu.render([65, 48], &scene, &camera).unwrap();
    assert_eq!((gpu.renderer().pictures(), gpu.renderer().target_generation()), (4, 2));
}

#[test]
fn every_size_and_an_empty_scene_can_be_drawn() {
    assert_eq!(clamped_size([0, 0], 4096), [1, 1]);
    assert_eq!(clamped_size([4096, 2], 4096), [4096, 2]);
    assert_eq!(clamped_size([8192, 4096], 4096), [4096, 2048]);
    assert_eq!(clamped_size([1_000_000, 1], 4096), [4096, 1]);
    let (empty, camera) = (Scene { background: [1.0, 0.5, 0.0, 0.5], ..Scene::default() }, Camera::default());
    let busy = demo::scene(&DARK, &camera, Vec2::ONE);
    let mut gpu = gpu();
    for (size, expected) in [([0, 0], (1, 1)), ([1, 1], (1, 1)), ([6000, 3], (4096, 2)), ([3, 2], (3, 2))] {
        let twin = cpu::render(size, &empty, &camera);
        assert_eq!(twin.dimensions(), expected);
        assert!(twin.pixels().all(|p| p.0 == [128, 64, 0, 128]), "premultiplied background");
        assert_eq!(cpu::render(size, &busy, &camera).dimensions(), expected);
        if let Some(gpu) = &mut gpu {
            let picture = gpu.render(size, &empty, &camera).unwrap();
            assert!(picture.dimensions() == expected && difference(&picture, &twin).0 <= 1.0);
            assert_eq!(gpu.render(size, &busy, &camera).unwrap().dimensions(), expected);
        }
    }
}

#[test]
fn invalid_instances_are_skipped_and_counted() {
    let Some(mut gpu) = gpu() else { return };
    let camera = Camera::default();
    let good = demo::scene(&DARK, &camera, Vec2::new(200.0, 150.0));
    let mut bad = good.clone();
    for covariance in [[f32::NAN; 6], [0.0; 6], [1.0, 2.0, 0.0, 1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, -1.0, 0.0, -1.0]] {
        bad.splats.push(SplatInstance { covariance, ..good.splats[0] });
    }
    bad.splats.push(SplatInstance { center: [f32::INFINITY, 0.0, 0.0], ..good.splats[0] });
    bad.lines.push(LineInstance { a: [f32::NAN; 3], ..good.lines[0] });
    bad.lines.push(LineInstance { width_px: 0.0, ..good.lines[0] });
    assert_eq!(bad.invalid_instances(), 7);
    for mode in [SceneMode::Splat, SceneMode::Ellipsoid] {
        let (good, bad) = (Scene { mode, ..good.clone() }, Scene { mode, ..bad.clone() });
        assert_eq!(cpu::render([200, 150], &bad, &camera), cpu::render([200, 150], &good, &camera));
        let expected = gpu.render([200, 150], &good, &camera).unwrap();
        assert_eq!(gpu.render([200, 150], &bad, &camera).unwrap(), expected);
        let Undrawable { not_finite, not_definite } = gpu.renderer().skipped();
        assert_eq!((not_finite, not_definite), (4, 3), "each by its reason");
    }
}

#[test]
fn a_camera_that_is_not_a_number_draws_the_background() {
    let camera = Camera { target: Vec3::NAN, distance: f32::INFINITY, ..Camera::default() };
    let size = [40, 30];
    for mode in [SceneMode::Splat, SceneMode::Ellipsoid] {
        let scene = Scene { mode, ..demo::scene(&DARK, &Camera::default(), Vec2::new(40.0, 30.0)) };
        let twin = cpu::render(size, &scene, &camera);
        assert!(twin.pixels().all(|p| p == twin.get_pixel(0, 0)));
        if let Some(mut gpu) = gpu() {
            assert_eq!(gpu.render(size, &scene, &camera).unwrap(), twin);
        }
    }
}

#[test]
fn a_line_cut_by_splats_shows_no_seam() {
    let line = |y: f32| LineInstance {
        a: [1.5, -0.4 + y, -0.3],
        b: [4.0, 0.9 + y, 0.5],
        color: [0.2, 0.8, 1.0, 0.5],
        width_px: 6.0,
    };
    // Invisible, but in the way: each cuts the lines at its depth.
    let splat = |i: u32| SplatInstance {
        center: [1.6 + 0.2 * i as f32, 0.0, 0.0],
        covariance: demo::covariance(Vec3::X, 0.4, 0.4),
        color: [1.0, 1.0, 1.0, 0.0],
        id: i,
    };
    let whole = Scene { lines: vec![line(0.0), line(0.2)], ..Scene::default() };
    let cut = Scene { splats: (0..11).map(splat).collect(), ..whole.clone() };
    let (size, camera) = ([300, 200], Camera::from_radar());
    assert_eq!(difference(&cpu::render(size, &cut, &camera), &cpu::render(size, &whole, &camera)).1, 0.0);
    if let Some(mut gpu) = gpu() {
        let expected = gpu.render(size, &whole, &camera).unwrap();
        assert_eq!(difference(&gpu.render(size, &cut, &camera).unwrap(), &expected).1, 0.0);
    }
}
