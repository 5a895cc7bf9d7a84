//! Which files hold the maps of a frame, and what lies beside them: a match arm a layout.

use crate::dataset::{Dataset, Layout};
use std::path::{Path, PathBuf};

/// One file of maps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MapFile {
    /// Where it lies.
    pub(super) from: PathBuf,
    /// Its path inside the data set.
    pub(super) inside: PathBuf,
    /// The array of each view that it holds: key, index of the view.
    pub(super) arrays: Vec<(String, usize)>,
    /// Files with labels of the same frame; copied, so that the copy can be trained on.
    pub(super) companions: Vec<PathBuf>,
}

/// The files that frame `index` is read from.
pub(super) fn map_files(dataset: &Dataset, index: usize) -> Vec<MapFile> {
    let info = dataset.info();
    let from = dataset.frame_path(index);
    let arrays = info.views.iter().enumerate().map(|(view, of)| (of.array.clone(), view)).collect();
    let companions = if info.layout == Layout::Mmvr { mmvr_companions(&from) } else { Vec::new() };
    vec![MapFile { inside: inside(&info.root, &from), from, arrays, companions }]
}

/// A path below `root`; the file's name where `root` is the file.
pub(super) fn inside(root: &Path, path: &Path) -> PathBuf {
    let below = path.strip_prefix(root).ok().filter(|below| !below.as_os_str().is_empty());
    below.map_or_else(|| path.file_name().map(PathBuf::from).unwrap_or_default(), Path::to_owned)
}

/// `NNNNN_bbox.npz` and so on beside `NNNNN_radar.npz`; those that are there.
fn mmvr_companions(radar: &Path) -> Vec<PathBuf> {
    let stem = radar.file_name().and_then(|name| name.to_str()?.strip_suffix("_radar.npz"));
    let Some(stem) = stem else { return Vec::new() };
    let beside = ["meta", "bbox", "pose", "mask"].map(|kind| radar.with_file_name(format!("{stem}_{kind}.npz")));
    beside.into_iter().filter(|file| file.is_file()).collect()
}
