//! Small data sets with everything in them that is awkward.

use super::naive::Maps;
use mhp_inspector::dataset::Dataset;
use mhp_inspector::dataset::npz::{ArrayView, write};
use mhp_inspector::task::Progress;
use std::path::{Path, PathBuf};

/// A plane and a cube.
pub(crate) const SHAPES: [&[usize]; 2] = [&[9, 8], &[4, 5, 3]];

const HEAD: &str = "name = \"set\"\nlayout = \"npz\"\nframes = \"*/*.npz\"\nskeleton = \"coco17\"\n";
const PSF: &str = "psf = { range_m = 0.1, azimuth_rad = 0.1, elevation_rad = 0.1, doppler_mps = 0.1 }";
const PLANE: &str = "axes = [ { kind = \"depth_h\", bins = 9, lo = 5.0, hi = 1.0 }, \
                     { kind = \"y\", bins = 8, lo = 1.5, hi = -1.5 } ]";
const CUBE: &str = "axes = [ { kind = \"range\", bins = 4, lo = 0.0, hi = 4.0 }, \
                    { kind = \"azimuth\", bins = 5, lo = -1.0, hi = 1.0 }, \
                    { kind = \"elevation\", bins = 3, lo = -1.0, hi = 1.0 } ]";

/// Frames by sequence; a map is `None` where its file shall be damaged.
pub(crate) struct Set {
    pub(crate) sequences: Vec<Vec<[Vec<f64>; 2]>>,
    /// How many of the two views the manifest names.
    pub(crate) views: usize,
}

impl Set {
    /// The set that the committed answers belong to, and its like: `lengths` frames in each sequence. The value of cell `c`
    /// of view `v` of frame `f` (counted through all sequences) comes from two steps of a congruential generator; one cell
    /// in 19 stands still and high, one in 37 is NaN; few values differ, so that there are ties everywhere.
    pub(crate) fn mixed(lengths: &[usize], views: usize) -> Self {
        let mut f = 0;
        let mut frame = || {
            let maps = [0, 1].map(|v| (0..cells(v)).map(|c| cell(c as u64, v as u64, f)).collect::<Vec<f64>>());
            f += 1;
            maps
        };
        let sequences = lengths.iter().map(|&length| (0..length).map(|_| frame()).collect()).collect();
        Self { sequences, views }
    }

    /// Writes the set; frame k of sequence s is `s/k.npz`.
    pub(crate) fn write(&self, root: &Path) {
        let views = [("plane", PLANE), ("cube", CUBE)];
        let views =
            views.iter().take(self.views).map(|(key, axes)| format!("[[view]]\narray = \"{key}\"\n{PSF}\n{axes}\n"));
        std::fs::write(root.join("dataset.toml"), HEAD.to_owned() + &views.collect::<String>()).unwrap();
        for (s, sequence) in self.sequences.iter().enumerate() {
            for (k, maps) in sequence.iter().enumerate() {
                write_frame(&file(root, s, k), maps);
            }
        }
    }

    /// Written to a new folder.
    pub(crate) fn folder(&self) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        self.write(folder.path());
        folder
    }

    /// For the other implementation: the maps of each frame and its sequence.
    pub(crate) fn frames(&self) -> Vec<Maps> {
        let frames = self.sequences.iter().enumerate();
        frames.flat_map(|(s, frames)| frames.iter().map(move |maps| Some((s, maps[..self.views].to_vec())))).collect()
    }
}

pub(crate) fn file(root: &Path, sequence: usize, frame: usize) -> PathBuf {
    root.join(format!("{sequence}/{frame:03}.npz"))
}

pub(crate) fn write_frame(file: &Path, maps: &[Vec<f64>; 2]) {
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    let array = |v: usize| ArrayView::f64(SHAPES[v], &maps[v]);
    write(file, &[("plane", array(0)), ("cube", array(1))]).unwrap();
}

pub(crate) fn open(root: &Path) -> Dataset {
    Dataset::open(root, &Progress::new()).unwrap()
}

pub(crate) fn cells(view: usize) -> usize {
    SHAPES[view].iter().product()
}

fn cell(c: u64, v: u64, f: u64) -> f64 {
    let step = |x: u64| x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    let u = step(step(c + 1000 * v + 100_000 * f));
    if (u >> 20).is_multiple_of(37) {
        return f64::NAN;
    }
    let still = if (c * 7 + v).is_multiple_of(19) { 30.0 } else { 0.0 };
    ((u >> 40) % 23) as f64 / 4.0 + still
}
