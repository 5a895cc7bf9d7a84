//! What can go wrong with an export.

use crate::dataset::NpzError;
use std::path::PathBuf;

/// Why something could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file of arrays cannot be read or written.
    #[error(transparent)]
    Npz(#[from] NpzError),
    /// The parameters do not fit the problem.
    #[error("{reason}")]
    Fit {
        /// Why, in words.
        reason: String,
    },
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
}
