//! What can be wrong with a data set; every message names file, key and what was expected.

use super::BareCatalog;
use super::names::MAX_NAME_BYTES;
use super::npz::NpzError;
use crate::input::place;
use std::path::{Path, PathBuf};

/// Why a data set could not be opened or a frame not loaded.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// Nothing at that path.
    #[error("{path}: no such file or folder", path = path.display())]
    NotFound {
        /// The path.
        path: PathBuf,
    },
    /// A folder or text file cannot be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
    /// A file cannot be written.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// An array file is not what it should be.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// A manifest is not what it should be.
    #[error("{place}: {message}", place = place(path, *line))]
    Manifest {
        /// What is wrong, naming the key.
        message: String,
        /// The line, counted from 1, where one can be named.
        line: Option<usize>,
        /// The manifest.
        path: PathBuf,
    },
    /// A folder without frames.
    #[error("{path}: no frames in it; expected {expected}", path = path.display())]
    NoFrames {
        /// What would have been one.
        expected: String,
        /// The folder.
        path: PathBuf,
    },
    /// More of something than any data set has.
    #[error("{path}: more than {most} {what} in it; open a folder further inside", path = path.display())]
    TooMany {
        /// Folders or frames.
        what: &'static str,
        /// How many are accepted.
        most: usize,
        /// The folder.
        path: PathBuf,
    },
    /// A manifest that leads out of its folder.
    #[error(
        "{place}: `frames = \"{frames}\"` leads out of the data set's folder; expected files inside it (--allow-outside opens it \
         nevertheless)",
        place = place(path, *line)
    )]
    Outside {
        /// The pattern.
        frames: String,
        /// The line, counted from 1, where one is known.
        line: Option<usize>,
        /// The manifest.
        path: PathBuf,
    },
    /// A file of arrays of which none can be a map.
    #[error("{path}: no array in it can be a map; expected real numbers with 2 or 3 axes; it holds {present}", path = path.display())]
    NoMaps {
        /// The arrays that exist, with shape and dtype.
        present: String,
        /// The file.
        path: PathBuf,
    },
    /// A file of maps whose axes nobody has told yet: ask, then call `Dataset::open_bare`.
    #[error("{0}")]
    NeedsAxes(BareCatalog),
    /// A capture of which nothing says the chirps: ask, then call `Dataset::open_capture`.
    #[error(
        "{path}: nothing beside it says what it is; expected its .cfg or .mmwave.json, or a dataset.toml with layout = \"capture\" and \
         [capture.chirp] (`mhp-inspector chain --form` prints one to fill in; the window asks, and remembers)",
        path = path.display()
    )]
    NeedsChirp {
        /// The capture.
        path: PathBuf,
    },
    /// A choice of axes that does not fit the file.
    #[error("{path}: the chosen axes do not fit: {message}", path = path.display())]
    BadChoice {
        /// What is wrong.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// A frame whose files are not what its layout says.
    #[error("{path}: {message}", path = path.display())]
    Frame {
        /// What is wrong, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// An index past the end.
    #[error("{path}: no frame {index}; the data set has {count}, counted from 0", path = path.display())]
    NoSuchFrame {
        /// What was asked for.
        index: usize,
        /// Frames that exist.
        count: usize,
        /// The data set.
        path: PathBuf,
    },
    /// Somebody pressed cancel.
    #[error("cancelled")]
    Cancelled,
    /// A defect in this program, caught so that the window lives on.
    #[error("{path}: internal error while reading: {message}", path = path.display())]
    Internal {
        /// The panic's text.
        message: String,
        /// What was being read.
        path: PathBuf,
    },
}

impl DatasetError {
    /// More bytes in the names of frames than are held.
    pub(super) fn too_long_names(root: &Path) -> Self {
        Self::TooMany { what: "bytes in the names of all frames", most: MAX_NAME_BYTES, path: root.to_owned() }
    }
}

impl From<crate::task::Cancelled> for DatasetError {
    fn from(_: crate::task::Cancelled) -> Self {
        Self::Cancelled
    }
}
