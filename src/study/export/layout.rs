//! Which files hold the maps of a frame, what lies beside them, and where all of it goes in a copy of the data set.

use crate::dataset::{Dataset, MapArray};
use crate::output::FileNames;
use std::path::{Component, Path, PathBuf};
use std::sync::OnceLock;

/// The folder of frames from outside the data set's own, and the pattern that finds them there.
const STRANGERS: &str = "frames";
pub(super) const STRANGERS_PATTERN: &str = "frames/*";

/// One file of maps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MapFile {
    /// Where it lies.
    pub(super) from: PathBuf,
    /// Its path inside the copy.
    pub(super) inside: PathBuf,
    pub(super) arrays: Vec<MapArray>,
}

/// Where the files of a data set go in a copy: where they are in it, but never out of the copy.
#[derive(Debug)]
pub(super) struct Tree<'a> {
    dataset: &'a Dataset,
    names: OnceLock<FileNames>,
}

impl<'a> Tree<'a> {
    pub(super) fn new(dataset: &'a Dataset) -> Self {
        Self { dataset, names: OnceLock::new() }
    }

    /// Whether the frames are found by another pattern than in the data set. A pattern that leaves the folder does so with all.
    pub(super) fn has_strangers(&self) -> bool {
        inside(&self.dataset.info().root, &self.dataset.frame_path(0)).is_none()
    }

    /// The files that frame `index` is read from.
    pub(super) fn map_files(&self, index: usize) -> Vec<MapFile> {
        let paths = self.dataset.map_paths(index).into_iter().enumerate();
        paths
            .map(|(k, from)| MapFile { inside: self.place(index, &from), from, arrays: self.dataset.map_arrays(k) })
            .collect()
    }

    /// Files with labels of frame `index`, and where they go.
    pub(super) fn companions(&self, index: usize) -> Vec<(PathBuf, PathBuf)> {
        let files = self.dataset.companion_paths(index).into_iter().filter(|file| file.is_file());
        files.map(|file| (self.place(index, &file), file)).map(|(to, from)| (from, to)).collect()
    }

    /// Files with labels of many frames, and where they go.
    pub(super) fn labels(&self) -> Vec<(PathBuf, PathBuf)> {
        let root = &self.dataset.info().root;
        let place =
            |file: &Path| inside(root, file).or_else(|| file.file_name().map(PathBuf::from)).unwrap_or_default();
        self.dataset.label_paths().into_iter().map(|file| (file.clone(), place(&file))).collect()
    }

    fn place(&self, index: usize, path: &Path) -> PathBuf {
        inside(&self.dataset.info().root, path).unwrap_or_else(|| {
            let names = self.names.get_or_init(|| self.dataset.file_names());
            let name = names.of(index, self.dataset.frame_name(index));
            let ending = path.extension().and_then(|ending| ending.to_str()).filter(|e| matches!(*e, "npz" | "npy"));
            Path::new(STRANGERS).join(ending.map_or_else(|| name.to_string(), |ending| format!("{name}.{ending}")))
        })
    }
}

/// A path below `root`, made of names alone; the file's name where `root` is the file. `None` for what lies elsewhere, or goes up
/// on its way.
fn inside(root: &Path, path: &Path) -> Option<PathBuf> {
    if root == path {
        return path.file_name().map(PathBuf::from);
    }
    let below = path.strip_prefix(root).ok()?;
    let parts = below.components().filter(|part| *part != Component::CurDir);
    let names = parts.map(|part| matches!(part, Component::Normal(_)).then_some(part));
    names.collect::<Option<PathBuf>>().filter(|below| !below.as_os_str().is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_lies_below_the_root_keeps_its_place() {
        let at = |root: &str, path: &str| inside(Path::new(root), Path::new(path)).map(|p| p.display().to_string());
        assert_eq!(at("/d", "/d/a/b.npz").as_deref(), Some("a/b.npz"));
        assert_eq!(at(".", "./a/./b.npz").as_deref(), Some("a/b.npz"));
        assert_eq!(at("/d/m.npy", "/d/m.npy").as_deref(), Some("m.npy"));
        for (root, path) in
            [("/d", "/d/../mine/b.npz"), ("/d", "/d/a/../b.npz"), ("/d", "/mine/b.npz"), ("/d", "/dd/b.npz")]
        {
            assert_eq!(at(root, path), None, "{path}");
        }
    }
}
