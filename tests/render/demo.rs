//! A scene as the window shows it: a walking COCO skeleton of anisotropic Gaussians, the truth, velocities, the
//! ground, the radar and its field of view, in the two themes of DESIGN section 3.

use mhp_inspector::render::shapes::{self, Stroke};
use mhp_inspector::render::{Camera, LineInstance, Scene, SplatInstance, Vec2, Vec3};

/// The tokens a scene uses.
pub(crate) struct Theme {
    canvas: u32,
    stroke: u32,
    text: u32,
    dim: u32,
    ok: u32,
    left: u32,
    right: u32,
}

pub(crate) const DARK: Theme = Theme {
    canvas: 0x101216,
    stroke: 0x2B303A,
    text: 0xE6E8EB,
    dim: 0x9AA3AF,
    ok: 0x5CC98B,
    left: 0x4DA3FF,
    right: 0xFF9F45,
};
pub(crate) const LIGHT: Theme = Theme {
    canvas: 0xFFFFFF,
    stroke: 0xD9DDE3,
    text: 0x1B1F24,
    dim: 0x5C6570,
    ok: 0x1E8A52,
    left: 0x1769C2,
    right: 0xC25E00,
};

const FLOOR_M: f32 = -1.0;

/// COCO order; the person is at x = 3 m and walks towards the radar, so its left is at negative y.
const JOINTS: [[f32; 3]; 17] = [
    [2.88, 0.00, 0.62],
    [2.90, -0.03, 0.66],
    [2.90, 0.03, 0.66],
    [2.98, -0.08, 0.64],
    [2.98, 0.08, 0.64],
    [3.00, -0.19, 0.42],
    [3.00, 0.19, 0.42],
    [3.12, -0.27, 0.15],
    [2.90, 0.27, 0.15],
    [2.96, -0.27, -0.08],
    [2.68, 0.22, 0.00],
    [3.02, -0.11, -0.10],
    [3.02, 0.11, -0.10],
    [2.86, -0.12, -0.50],
    [3.10, 0.12, -0.52],
    [2.84, -0.12, -0.94],
    [3.38, 0.12, -0.84],
];
const BONES: [[usize; 2]; 16] = [
    [15, 13],
    [13, 11],
    [16, 14],
    [14, 12],
    [11, 12],
    [5, 11],
    [6, 12],
    [5, 6],
    [5, 7],
    [7, 9],
    [6, 8],
    [8, 10],
    [0, 1],
    [0, 2],
    [1, 3],
    [2, 4],
];

pub(crate) fn rgba(hex: u32, alpha: f32) -> [f32; 4] {
    let channel = |shift: u32| ((hex >> shift) & 0xFF) as f32 / 255.0;
    [channel(16), channel(8), channel(0), alpha]
}

/// σ_a² along `axis`, σ_b² across it.
pub(crate) fn covariance(axis: Vec3, along: f32, across: f32) -> [f32; 6] {
    let n = axis.normalize();
    let (a, b) = (along * along, across * across);
    let entry = |i: usize, j: usize| (a - b) * n[i] * n[j] + if i == j { b } else { 0.0 };
    [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)]
}

fn joint(index: usize) -> Vec3 {
    Vec3::from_array(JOINTS[index])
}

fn side_color(theme: &Theme, index: usize) -> u32 {
    match index {
        0 => theme.dim,
        i if i % 2 == 1 => theme.left,
        _ => theme.right,
    }
}

fn bone_color(theme: &Theme, [a, b]: [usize; 2]) -> u32 {
    if a == 0 || b == 0 || a % 2 == b % 2 { side_color(theme, a.max(b)) } else { theme.dim }
}

fn splats(theme: &Theme) -> Vec<SplatInstance> {
    let splat = |index: usize| {
        let limb = BONES.iter().find(|bone| bone.contains(&index));
        let axis = limb.map_or(Vec3::Z, |bone| joint(bone[0]) - joint(bone[1]));
        let (along, across) = if index < 5 { (0.035, 0.025) } else { (0.085, 0.04) };
        SplatInstance {
            center: JOINTS[index],
            covariance: covariance(axis, along, across),
            color: rgba(side_color(theme, index), 0.75),
            id: index as u32,
        }
    };
    (0..JOINTS.len()).map(splat).collect()
}

fn bones(theme: &Theme, offset: Vec3, color: impl Fn([usize; 2]) -> [f32; 4], width_px: f32) -> Vec<LineInstance> {
    let bone =
        |&[a, b]: &[usize; 2]| Stroke { color: color([a, b]), width_px }.line(joint(a) + offset, joint(b) + offset);
    let neck = Stroke { color: rgba(theme.dim, color([0, 0])[3]), width_px };
    let shoulders = (joint(5) + joint(6)) / 2.0;
    BONES.iter().map(bone).chain([neck.line(joint(0) + offset, shoulders + offset)]).collect()
}

/// The whole scene, for a camera and a view `viewport` pixels large.
pub(crate) fn scene(theme: &Theme, camera: &Camera, viewport: Vec2) -> Scene {
    let stroke = |hex, alpha, width_px| Stroke { color: rgba(hex, alpha), width_px };
    let mut lines =
        shapes::grid((0, 6), (-3, 3), FLOOR_M, stroke(theme.stroke, 0.8, 1.0), stroke(theme.stroke, 1.0, 1.5));
    lines.extend(shapes::range_rings(1.05, &[1.0, 2.0, 3.0, 4.0, 5.0], FLOOR_M, stroke(theme.dim, 0.35, 1.0)));
    lines.extend(shapes::frustum(1.05, 0.35, 1.0, stroke(theme.dim, 0.45, 1.0)));
    lines.extend(shapes::radar(0.16, stroke(theme.text, 0.9, 1.5)));
    lines.extend(bones(theme, Vec3::ZERO, |bone| rgba(bone_color(theme, bone), 1.0), 2.5));
    lines.extend(bones(theme, Vec3::new(0.06, 0.05, 0.02), |_| rgba(theme.text, 0.45), 1.0));
    for index in [0, 5, 6, 9, 10, 15, 16] {
        let velocity = Vec3::new(-0.35 - 0.02 * index as f32, 0.0, 0.03 * (index % 3) as f32);
        lines.extend(shapes::arrow(joint(index), joint(index) + velocity, camera.eye(), stroke(theme.ok, 0.9, 1.5)));
    }
    let (overlay, _) = shapes::corner_triad(camera, viewport, Vec2::new(40.0, viewport.y - 40.0), 26.0, 2.0);
    Scene {
        splats: splats(theme),
        lines,
        overlay,
        background: rgba(theme.canvas, 1.0),
        contour: 0.35,
        ..Scene::default()
    }
}
