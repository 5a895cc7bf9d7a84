//! A large tree of tiny frames, written in seconds: folders like MMVR's whose frames are hard links to a few files.
#![expect(clippy::unwrap_used, reason = "a test stops where its material cannot be made")]

use mhp_inspector::dataset::npz::{ArrayView, write};
use std::path::Path;

/// Rows and columns of both maps.
pub(crate) const BINS: usize = 8;
/// Files that differ; no file system refuses a few thousand links to one.
const DISTINCT: usize = 64;

const MANIFEST: &str = r#"
name = "tree"
layout = "mmvr"
frame_rate_hz = 15.0

[[view]]
array = "hm_hori"
psf = { range_m = 0.5, azimuth_rad = 0.2, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [ { kind = "depth_h", bins = 8, lo = 8.0, hi = 0.0 }, { kind = "y", bins = 8, lo = 2.0, hi = -2.0 } ]

[[view]]
array = "hm_vert"
psf = { range_m = 0.5, azimuth_rad = 0.0, elevation_rad = 0.2, doppler_mps = 0.1 }
axes = [ { kind = "depth_v", bins = 8, lo = 8.0, hi = 0.0 }, { kind = "z", bins = 8, lo = -2.0, hi = 2.0 } ]
"#;

/// Writes `frames` frames of two 8×8 maps in `sequences` folders (`d1s1/000`, …) of nearly the same length, with a
/// `dataset.toml` of layout "mmvr", to `root`. Neighbouring frames differ; frames 64 apart are the same file.
pub(crate) fn tree(root: &Path, frames: usize, sequences: usize) {
    std::fs::create_dir_all(root).unwrap();
    std::fs::write(root.join("dataset.toml"), MANIFEST).unwrap();
    let originals = root.join(".originals");
    std::fs::create_dir_all(&originals).unwrap();
    let originals: Vec<_> = (0..DISTINCT.min(frames)).map(|k| originals.join(format!("{k}"))).collect();
    for (k, file) in originals.iter().enumerate() {
        let [hori, vert] = [0, 1].map(|view| map(2 * k + view));
        let shape = [BINS, BINS];
        write(file, &[("hm_hori", ArrayView::f32(&shape, &hori)), ("hm_vert", ArrayView::f32(&shape, &vert))]).unwrap();
    }
    for sequence in 0..sequences {
        let folder = root.join(format!("d{}s1/{:03}", 1 + sequence / 1000, sequence % 1000));
        std::fs::create_dir_all(&folder).unwrap();
        let range = sequence * frames / sequences..(sequence + 1) * frames / sequences;
        for (number, frame) in range.enumerate() {
            let (from, to) = (&originals[frame % DISTINCT], folder.join(format!("{number:05}_radar.npz")));
            if std::fs::hard_link(from, &to).is_err() {
                std::fs::copy(from, &to).unwrap();
            }
        }
    }
}

/// A still wall in the last row, a bright cell that wanders, and weak speckle.
fn map(seed: usize) -> Vec<f32> {
    let mut state = seed as u64 + 1;
    let mut cells = Vec::with_capacity(BINS * BINS);
    for cell in 0..BINS * BINS {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let speckle = (state >> 40) as f32 / (1u64 << 24) as f32;
        let wall = if cell / BINS + 1 == BINS { 4.0 } else { 0.0 };
        let person = if cell == (seed * 5) % (BINS * (BINS - 1)) { 9.0 } else { 0.0 };
        cells.push(speckle + wall + person);
    }
    cells
}
