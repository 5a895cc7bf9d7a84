//! What a data set is on disk: its folders, and every file that is read for a frame. Results must not go there ([`Inputs`]).

use super::layout::MapArray;
use super::set::{Dataset, MANIFEST_NAME};
use crate::output::{FileNames, Inputs};
use std::path::{Path, PathBuf};

impl Dataset {
    /// The folders and files that must not be written. A bare file is its own data set: what lies beside it is not. Of files
    /// that a manifest of another name lists, their folders are the data set, not the one that the manifest happens to lie in.
    pub fn inputs(&self) -> Inputs<'_> {
        let mut folders: Vec<PathBuf> = Vec::new();
        let root = &self.info().root;
        let listed = self.info().layout.preset_text().is_none();
        if root.is_dir() && (!listed || root.join(MANIFEST_NAME).is_file()) {
            folders.push(root.clone());
        }
        if self.frame_path(0) != *root {
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

    /// The files that the maps of frame `i` are made of, the main one first: one, or one a view; none past the end.
    pub(crate) fn map_paths(&self, i: usize) -> Vec<PathBuf> {
        if i < self.len() { self.frames.files(i, &self.info) } else { Vec::new() }
    }

    /// The arrays in the file at `place` of [`Self::map_paths`] that hold maps.
    pub(crate) fn map_arrays(&self, place: usize) -> Vec<MapArray> {
        self.frames.arrays(place, &self.info)
    }

    /// Labels and truth of frame `i` alone, in files of their own that may be there or not.
    pub(crate) fn companion_paths(&self, i: usize) -> Vec<PathBuf> {
        if i < self.len() { self.frames.companions(i, &self.info) } else { Vec::new() }
    }

    /// Labels of many frames in one file.
    pub(crate) fn label_paths(&self) -> Vec<PathBuf> {
        self.frames.label_files()
    }

    /// Frames of a file, where every reader expects all of them.
    pub(crate) fn frames_a_file(&self) -> Option<usize> {
        self.frames.frames_a_file()
    }

    fn each_file(&self, see: &mut dyn FnMut(&Path)) {
        see(&self.info().root.join(MANIFEST_NAME));
        self.label_paths().iter().for_each(|path| see(path));
        for i in 0..self.len() {
            self.map_paths(i).iter().chain(&self.companion_paths(i)).for_each(|path| see(path));
        }
    }
}
