//! What can go wrong with an export.

use crate::dataset::NpzError;
use crate::output::OutputError;
use std::ops::Range;
use std::path::PathBuf;

/// Why something could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file of arrays cannot be read or written.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// A place that must not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// An array that no map can be written as.
    #[error("{path}: array `{key}` ({form}) cannot hold a map: {reason}", path = path.display())]
    Form {
        /// The array.
        key: String,
        /// Its dtype and shape.
        form: String,
        /// Why not.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// The folder is the data set's own.
    #[error("{path}: is the data set itself; give another folder", path = path.display())]
    Itself {
        /// The folder.
        path: PathBuf,
    },
    /// Files of which every reader expects all frames.
    #[error("{path}: its files hold {steps} frames each, which belong together; expected --frames from a multiple of {steps} \
        to another, not {first}..{end}", path = path.display(), first = frames.start, end = frames.end)]
    Part {
        /// Frames of a file.
        steps: usize,
        /// What was asked for.
        frames: Range<usize>,
        /// The data set.
        path: PathBuf,
    },
    /// A file cannot be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// A file or folder cannot be written.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
}

impl ExportError {
    /// For `map_err`.
    pub(super) fn writing(path: &std::path::Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |reason| Self::Write { reason, path: path.to_owned() }
    }

    /// For `map_err`.
    pub(super) fn reading(path: &std::path::Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |reason| Self::Read { reason, path: path.to_owned() }
    }
}
