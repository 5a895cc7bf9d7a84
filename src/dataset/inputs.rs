//! What a data set is on disk: its folders, and every file that is read for a frame. Results must not go there ([`Inputs`]).

use super::manifest::Layout;
use super::set::{Dataset, MANIFEST_NAME};
use super::source::Source;
use crate::output::{FileNames, Inputs};
use std::path::{Path, PathBuf};

/// What may lie beside a frame of MMVR; the last is this program's own.
const MMVR_KINDS: [&str; 5] = ["meta", "bbox", "pose", "mask", "truth"];

impl Dataset {
    /// The folders and files that must not be written. A bare file is its own data set: what lies beside it is not. Of files
    /// that a manifest of another name lists, their folders are the data set, not the one that the manifest happens to lie in.
    pub fn inputs(&self) -> Inputs<'_> {
        let mut folders: Vec<PathBuf> = Vec::new();
        let root = &self.info().root;
        if root.is_dir() && (self.info().layout != Layout::Npz || root.join(MANIFEST_NAME).is_file()) {
            folders.push(root.clone());
        }
        if self.info().layout != Layout::Bare {
            // Frames of one folder follow each other.
            let parents = (0..self.len()).filter_map(|i| self.frame_path(i).parent().map(Path::to_owned));
            parents.for_each(|parent| {
                if folders.last() != Some(&parent) {
                    folders.push(parent);
                }
            });
        }
        Inputs::new(folders, |see| self.each_file(see))
    }

    /// The file of results of each frame, without an ending.
    pub fn file_names(&self) -> FileNames {
        FileNames::new(self.len(), |i| self.frame_name(i))
    }

    /// The files that hold the maps of frame `i`: one, or one a view.
    pub(crate) fn map_paths(&self, i: usize) -> Vec<PathBuf> {
        match (&self.source, self.segment(i)) {
            (Source::Hupr { .. }, Some((segment, k))) => {
                let cube = |view: &crate::radar::View| {
                    segment.path.join(&view.array).join(segment.stem(k).to_owned() + ".npy")
                };
                self.info().views.iter().map(cube).collect()
            }
            _ => vec![self.frame_path(i)],
        }
    }

    /// Labels and truth of frame `i` alone, in files of their own that may be there or not.
    pub(crate) fn companion_paths(&self, i: usize) -> Vec<PathBuf> {
        match (&self.source, self.segment(i)) {
            (Source::Mmvr { .. }, Some((segment, k))) => {
                MMVR_KINDS.map(|kind| segment.path.join(format!("{}_{kind}.npz", segment.stem(k)))).to_vec()
            }
            (Source::Hupr { .. }, Some((segment, k))) => {
                vec![segment.path.join("truth").join(format!("{}.npz", segment.stem(k)))]
            }
            (Source::Stacks { steps, .. }, _) => {
                let path = self.frame_path(i);
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                vec![path.with_file_name(format!("{stem}_truth_{:02}.npz", i % steps))]
            }
            _ => Vec::new(),
        }
    }

    /// Labels of many frames in one file.
    pub(crate) fn label_paths(&self) -> Vec<PathBuf> {
        match &self.source {
            Source::Hupr { labels, .. } => labels.paths().map(Path::to_owned).collect(),
            _ => Vec::new(),
        }
    }

    fn each_file(&self, see: &mut dyn FnMut(&Path)) {
        see(&self.info().root.join(MANIFEST_NAME));
        self.label_paths().iter().for_each(|path| see(path));
        for i in 0..self.len() {
            self.map_paths(i).iter().chain(&self.companion_paths(i)).for_each(|path| see(path));
        }
    }
}
