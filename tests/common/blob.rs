//! A small data set for tests of threads and window: a standing person of Gaussian blobs in weak speckle, two Cartesian
//! views as MMVR's but coarser, with truth. A fit of one of its frames takes milliseconds.
#![expect(clippy::unwrap_used, reason = "a test stops where its material cannot be made")]

use mhp_inspector::dataset::npz::{ArrayView, write};
use std::path::Path;

pub(crate) const MANIFEST: &str = r#"
name = "blob"
layout = "npz"
frames = "frames/*.npz"
frame_rate_hz = 10.0
skeleton = "coco17"

[radar]
start_hz = 77e9
bandwidth_hz = 2.5e9
chirp_s = 60e-6
frame_s = 0.0128
r_max_m = 8.0
l_az_m = 0.0019
l_el_m = 0.0019
doppler_features = 4

[[view]]
array = "hori"
psf = { range_m = 0.06, azimuth_rad = 0.03, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [
  { kind = "depth_h", bins = 48, lo = 6.0, hi = 0.0 },
  { kind = "y", bins = 32, lo = 2.0, hi = -2.0 },
]

[[view]]
array = "vert"
psf = { range_m = 0.06, azimuth_rad = 0.03, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [
  { kind = "depth_v", bins = 48, lo = 6.0, hi = 0.0 },
  { kind = "z", bins = 32, lo = -2.0, hi = 2.0 },
]
"#;

/// Half the body of COCO's joints, (y, z) in metres about its middle: nose and eyes to ankles.
const BODY: [[f64; 2]; 17] = [
    [0.0, 0.72],
    [0.03, 0.75],
    [-0.03, 0.75],
    [0.07, 0.73],
    [-0.07, 0.73],
    [0.2, 0.5],
    [-0.2, 0.5],
    [0.25, 0.2],
    [-0.25, 0.2],
    [0.27, -0.05],
    [-0.27, -0.05],
    [0.12, 0.0],
    [-0.12, 0.0],
    [0.12, -0.42],
    [-0.12, -0.42],
    [0.12, -0.84],
    [-0.12, -0.84],
];

/// Writes `frames` frames and their manifest to `folder`; the person walks to the left, 6 cm a frame.
pub(crate) fn write_dataset(folder: &Path, frames: usize) {
    std::fs::create_dir_all(folder.join("frames")).unwrap();
    std::fs::write(folder.join("dataset.toml"), MANIFEST).unwrap();
    for index in 0..frames {
        write_frame(&folder.join(format!("frames/{index:03}.npz")), index, &|_, _| 0.0);
    }
}

/// Writes one frame: the person as in frame `index` of [`write_dataset`], and `others`, by depth and distance across, in
/// both views.
pub(crate) fn write_frame(path: &Path, index: usize, others: &dyn Fn(f64, f64) -> f64) {
    let joints: Vec<[f64; 3]> = BODY.map(|[y, z]| [3.0, y + 0.06 * index as f64, z - 0.2]).into_iter().collect();
    let hori = |depth: f64, y: f64| blob(&joints, |p| [p[0].hypot(p[2]) - depth, p[1] - y]) + others(depth, y);
    let vert = |depth: f64, z: f64| blob(&joints, |p| [p[0].hypot(p[1]) - depth, p[2] - z]) + others(depth, z);
    let (hori, vert) = (map(index as u64, hori, [2.0, -2.0]), map(index as u64 + 99, vert, [-2.0, 2.0]));
    let flat = joints.concat();
    let arrays = [
        ("hori", ArrayView::f64(&[48, 32], &hori)),
        ("vert", ArrayView::f64(&[48, 32], &vert)),
        ("joints", ArrayView::f64(&[1, 17, 3], &flat)),
    ];
    write(path, &arrays).unwrap();
}

/// The echo of the body where its joints are `offset` metres from a cell.
fn blob(joints: &[[f64; 3]], offset: impl Fn(&[f64; 3]) -> [f64; 2]) -> f64 {
    let squares = joints.iter().map(|p| offset(p).map(|d| d * d).iter().sum::<f64>());
    squares.map(|square| (-square / (2.0 * 0.12 * 0.12)).exp()).sum()
}

/// 48 rows of depth, 32 columns over `across`, with speckle of one percent.
fn map(seed: u64, echo: impl Fn(f64, f64) -> f64, across: [f64; 2]) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut speckle = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        0.01 * (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut cells = Vec::with_capacity(48 * 32);
    for row in 0..48 {
        for column in 0..32 {
            let depth = 6.0 - 6.0 * f64::from(row) / 48.0;
            let at = across[0] + (across[1] - across[0]) * f64::from(column) / 32.0;
            cells.push(echo(depth, at) + speckle());
        }
    }
    cells
}
