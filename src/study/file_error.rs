//! What can go wrong with one file of results.

use std::path::{Path, PathBuf};

/// Why a file of a run or of a shard cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It cannot be written.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
    /// It cannot be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
    /// It is not what it should be.
    #[error("{path}: {message}", path = path.display())]
    Damaged {
        /// What is wrong, and what was expected.
        message: String,
        /// The file or folder.
        path: PathBuf,
    },
}

impl FileError {
    /// For `map_err`: a file that cannot be written.
    pub(super) fn writing(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |reason| Self::Write { reason, path: path.to_owned() }
    }

    /// For `map_err`: a file that cannot be read.
    pub(super) fn reading(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |reason| Self::Read { reason, path: path.to_owned() }
    }
}
