//! What the picture must show, checked on the CPU twin (`twin` proves that the GPU draws the same).

use super::demo::covariance;
use mhp_inspector::render::{
    Camera, Colormap, LineInstance, NAN_COLOR, Scene, SceneMode, SplatInstance, Vec2, Vec3, cpu,
};

const SIZE: [u32; 2] = [201, 201];
const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

fn ball(center: [f32; 3], sigma: f32, color: [f32; 4]) -> SplatInstance {
    SplatInstance { center, covariance: covariance(Vec3::X, sigma, sigma), color, id: 0 }
}

fn pixel(scene: &Scene, x: u32, y: u32) -> [u8; 4] {
    cpu::render(SIZE, scene, &Camera::from_radar()).get_pixel(x, y).0
}

#[test]
fn the_nearer_splat_wins_in_any_order() {
    for mode in [SceneMode::Splat, SceneMode::Ellipsoid] {
        let mut splats = vec![ball([3.0, 0.0, 0.0], 0.1, RED), ball([4.0, 0.0, 0.0], 0.2, BLUE)];
        let forward =
            cpu::render(SIZE, &Scene { splats: splats.clone(), mode, ..Scene::default() }, &Camera::from_radar());
        splats.reverse();
        let backward = cpu::render(SIZE, &Scene { splats, mode, ..Scene::default() }, &Camera::from_radar());
        assert_eq!(forward, backward);
        let [red, _, blue, _] = forward.get_pixel(100, 100).0;
        assert!(red > 120 && blue < 10, "{mode:?}: {red} {blue}");
    }
}

#[test]
fn the_weight_is_a_gaussian_of_the_projected_covariance() {
    // At 3 m a σ of 0.15 m is f·0.05 px wide; the low-pass filter adds 0.3 px².
    let scene =
        Scene { splats: vec![ball([3.0, 0.0, 0.0], 0.15, [1.0, 1.0, 1.0, 0.8])], sigma: 3.0, ..Scene::default() };
    let focal = 100.5 / 30_f32.to_radians().tan();
    let variance = (focal * 0.05).powi(2) + 0.3;
    for dx in [0_i32, 3, 6, 10, 15, 20] {
        let expected = 0.8 * (-0.5 * (dx * dx) as f32 / variance).exp() * 255.0;
        let [value, ..] = pixel(&scene, (100 + dx) as u32, 100);
        assert!((f32::from(value) - expected).abs() < 1.0, "{dx}: {value} {expected}");
    }
}

#[test]
fn the_covariance_is_projected_as_its_samples_are() {
    // A long Gaussian off the axis: moments of projected samples (a 3-D lattice, Gaussian weights) against those of the
    // picture.
    let camera = Camera::overview(Vec3::new(3.0, 0.0, 0.0), 1.0);
    let (center, axis) = (Vec3::new(3.1, 0.25, 0.2), Vec3::new(0.6, 0.5, -0.4).normalize());
    let splat =
        SplatInstance { center: center.to_array(), covariance: covariance(axis, 0.12, 0.04), color: [1.0; 4], id: 0 };
    let viewport = Vec2::new(401.0, 401.0);
    let (u, v) = axis.any_orthonormal_pair();
    let steps = || (-12..=12).map(|i| i as f32 / 4.0);
    let samples = steps().flat_map(|a| steps().flat_map(move |b| steps().map(move |c| (a, b, c)))).map(|(a, b, c)| {
        let point = center + axis * (0.12 * a) + u * (0.04 * b) + v * (0.04 * c);
        (camera.project(point, viewport).unwrap().px, f64::from((-0.5 * (a * a + b * b + c * c)).exp()))
    });
    let expected = moments(samples);
    let picture = cpu::render([401, 401], &Scene { splats: vec![splat], sigma: 5.0, ..Scene::default() }, &camera);
    let weights =
        picture.enumerate_pixels().map(|(x, y, p)| (Vec2::new(x as f32 + 0.5, y as f32 + 0.5), f64::from(p[0])));
    let got = moments(weights);
    // Lattice cut at 3 σ and 8-bit weights cost a few percent of variance; perspective moves the mean by a pixel.
    for i in 0..2 {
        assert!((got[i] - expected[i]).abs() < 1.5, "mean {got:?} {expected:?}");
    }
    let scale = expected[2].max(expected[4]);
    for i in 2..5 {
        assert!((got[i] - expected[i]).abs() < 0.08 * scale, "covariance {got:?} {expected:?}");
    }
}

/// Mean x, y and covariance xx, xy, yy of weighted points.
fn moments(points: impl Iterator<Item = (Vec2, f64)>) -> [f64; 5] {
    let mut sums = [0.0; 6];
    for (p, w) in points {
        let (x, y) = (f64::from(p.x), f64::from(p.y));
        for (sum, term) in sums.iter_mut().zip([1.0, x, y, x * x, x * y, y * y]) {
            *sum += w * term;
        }
    }
    let [n, x, y, xx, xy, yy] = sums;
    let (x, y) = (x / n, y / n);
    [x, y, xx / n - x * x, xy / n - x * y, yy / n - y * y]
}

#[test]
fn sigma_scales_what_is_drawn() {
    let focal = 100.5 / 30_f32.to_radians().tan();
    for (sigma, mode) in
        [(1.0, SceneMode::Splat), (2.0, SceneMode::Splat), (1.0, SceneMode::Ellipsoid), (2.5, SceneMode::Ellipsoid)]
    {
        let scene = Scene { splats: vec![ball([3.0, 0.0, 0.0], 0.1, RED)], sigma, mode, ..Scene::default() };
        let picture = cpu::render(SIZE, &scene, &Camera::from_radar());
        let drawn = picture.pixels().filter(|p| p[0] > 8).count() as f32;
        let radius = match mode {
            SceneMode::Splat => sigma * ((focal * 0.1 / 3.0).powi(2) + 0.3).sqrt(),
            SceneMode::Ellipsoid => focal * (sigma * 0.1 / 3.0).asin().tan(),
        };
        let expected = std::f32::consts::PI * radius * radius;
        // Half a pixel of soft edge around.
        let margin = 2.0 * std::f32::consts::PI * radius * 0.6;
        assert!((drawn - expected).abs() < margin, "{mode:?} {sigma}: {drawn} {expected}");
    }
}

#[test]
fn an_ellipsoid_covers_what_a_ray_can_hit() {
    use mhp_inspector::render::pick;
    let splat = SplatInstance {
        center: [2.0, 0.7, 0.4],
        covariance: covariance(Vec3::new(1.0, -0.5, 0.3), 0.3, 0.05),
        color: RED,
        id: 5,
    };
    let scene = Scene { splats: vec![splat], mode: SceneMode::Ellipsoid, ..Scene::default() };
    let picture = cpu::render(SIZE, &scene, &Camera::from_radar());
    let viewport = Vec2::new(201.0, 201.0);
    let (mut covered, mut wrong) = (0, 0);
    for (x, y, p) in picture.enumerate_pixels() {
        let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let center = Camera::from_radar().project(Vec3::from_array(splat.center), viewport).unwrap().px;
        if at.distance(center) > 8.0 {
            let hit = pick(&scene, &Camera::from_radar(), at, viewport).is_some();
            covered += u32::from(hit);
            // On the soft edge coverage is ½ where a ray just misses, and the shade there is about 0.8 at most.
            wrong += u32::from(if hit { p[0] == 0 } else { p[0] > 112 });
        }
    }
    assert!(covered > 500 && wrong == 0, "{covered} covered, {wrong} wrong");
}

#[test]
fn a_line_hides_splats_behind_it_and_shows_through_those_before_it() {
    let line =
        |x: f32| LineInstance { a: [x, 1.0, 0.0], b: [x, -1.0, 0.0], color: [0.0, 1.0, 0.0, 1.0], width_px: 5.0 };
    let at = |x: f32| Scene {
        splats: vec![ball([3.0, 0.0, 0.0], 0.2, [1.0, 0.0, 0.0, 0.5])],
        lines: vec![line(x)],
        ..Scene::default()
    };
    assert_eq!(pixel(&at(2.5), 100, 100), [0, 255, 0, 255]);
    let [red, green, ..] = pixel(&at(3.5), 100, 100);
    assert!((120..=130).contains(&red) && (120..=130).contains(&green), "{red} {green}");
    let overlay = Scene { lines: Vec::new(), overlay: vec![line(3.5)], ..at(3.5) };
    assert_eq!(pixel(&overlay, 100, 100), [0, 255, 0, 255]);
    // No dark fringe: on the soft edge of a line in front of the splat, red and green add up to at least the splat's red.
    let picture = cpu::render(SIZE, &at(2.5), &Camera::from_radar());
    let alone = cpu::render(SIZE, &Scene { lines: Vec::new(), ..at(2.5) }, &Camera::from_radar());
    for y in 94..=106 {
        let ([red, green, ..], [expected, ..]) = (picture.get_pixel(100, y).0, alone.get_pixel(100, y).0);
        assert!(u16::from(red) + u16::from(green) + 1 >= u16::from(expected), "{y}: {red} {green} {expected}");
    }
}

#[test]
fn a_line_through_a_splat_is_half_before_and_half_behind() {
    // The line goes away from the eye, to the left; the splat's depth is in its middle.
    let line = LineInstance { a: [2.8, -0.15, 0.0], b: [3.2, 0.15, 0.0], color: [0.0, 1.0, 0.0, 1.0], width_px: 5.0 };
    let scene =
        Scene { splats: vec![ball([3.0, 0.0, 0.0], 0.3, [1.0, 0.0, 0.0, 0.9])], lines: vec![line], ..Scene::default() };
    assert_eq!(pixel(&scene, 104, 100)[1], 255, "the near half is in front");
    assert!(pixel(&scene, 96, 100)[1] < 60, "the far half is behind");
}

#[test]
fn a_line_has_its_width_at_any_distance() {
    for (x, width_px) in [(1.0, 3.0), (20.0, 3.0), (5.0, 8.0), (5.0, 1.0), (5.0, 0.5)] {
        let line = LineInstance { a: [x, x, 0.0], b: [x, -x, 0.0], color: RED, width_px };
        let picture = cpu::render(SIZE, &Scene { lines: vec![line], ..Scene::default() }, &Camera::from_radar());
        let coverage: f32 = (0..SIZE[1]).map(|y| f32::from(picture.get_pixel(100, y)[0]) / 255.0).sum();
        assert!((coverage - width_px).abs() < 0.02, "{coverage} {width_px}");
    }
}

#[test]
fn colour_maps_are_what_they_are_called() {
    let hex = |map: Colormap, t| map.sample(t);
    assert_eq!(hex(Colormap::Viridis, 0.0), [0x44, 0x01, 0x54]);
    assert_eq!(hex(Colormap::Viridis, 1.0), [0xFD, 0xE7, 0x25]);
    assert_eq!(hex(Colormap::Grey, 0.5), [128; 3]);
    let [low, middle, high] = [0.0, 0.5, 1.0].map(|t| hex(Colormap::Diverging, t));
    assert!(low[2] > low[0] && high[0] > high[2] && middle.iter().all(|&c| c > 235), "blue, white, red");
    for map in Colormap::ALL {
        assert_eq!(map.sample(f64::NAN), NAN_COLOR);
        assert_eq!((map.sample(-3.0), map.sample(f64::INFINITY)), (map.lut()[0], map.lut()[255]));
        assert!(!map.lut().contains(&NAN_COLOR), "{} holds the colour of NaN", map.name());
    }
    for map in [Colormap::Viridis, Colormap::Inferno, Colormap::Magma, Colormap::Grey] {
        let luma = |c: [u8; 3]| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
        assert!(map.lut().windows(2).all(|w| luma(w[1]) > luma(w[0]) - 1.0), "{} gets brighter", map.name());
    }
}

/// A Gaussian that would fill the picture fades, in both modes; one of ordinary size does not.
#[test]
fn a_gaussian_as_large_as_the_picture_fades() {
    for mode in [SceneMode::Splat, SceneMode::Ellipsoid] {
        let at = |sigma: f32, largest: f32| {
            let splats = vec![ball([3.0, 0.0, 0.0], sigma, RED)];
            pixel(&Scene { splats, mode, largest, ..Scene::default() }, 100, 100)[0]
        };
        assert!(at(1.2, f32::INFINITY) > 120, "{mode:?}");
        assert!(at(1.2, 0.5) < 60, "{mode:?}: {}", at(1.2, 0.5));
        assert_eq!(at(0.1, 0.5), at(0.1, f32::INFINITY), "{mode:?}");
    }
}
