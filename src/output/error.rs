//! Why something is not written.

use super::inputs::INTO_DATA_FLAG;
use std::path::PathBuf;

/// What can go wrong before the first byte.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The place lies in the data set.
    #[error("{path}: lies in the data set {data}; give another place, or {INTO_DATA_FLAG} to write there all the same",
        path = path.display(), data = data.display())]
    IntoData {
        /// The folder of the data set.
        data: PathBuf,
        /// The file or folder.
        path: PathBuf,
    },
    /// The file is one that is read.
    #[error("{path}: is an input, which is never replaced; give another place", path = path.display())]
    Input {
        /// The file.
        path: PathBuf,
    },
    /// A folder of results would hold a file that is read.
    #[error("{path}: holds the input {input}, which is never replaced; give another place",
        path = path.display(), input = input.display())]
    HoldsInput {
        /// The file or folder that is read.
        input: PathBuf,
        /// The folder.
        path: PathBuf,
    },
    /// A folder of results leads elsewhere.
    #[error("{path}: is a link to {target}, outside the folder of results; remove it, or give another place",
        path = path.display(), target = target.display())]
    Elsewhere {
        /// Where it leads.
        target: PathBuf,
        /// The link.
        path: PathBuf,
    },
    /// Two results would be one file.
    #[error("{path}: is {other}, which holds another result, on this file system; give a place where case counts",
        path = path.display(), other = other.display())]
    Taken {
        /// The file of the other.
        other: PathBuf,
        /// The file.
        path: PathBuf,
    },
    /// Another process writes the folder.
    #[error("{path}: another process{holder} is writing here; wait until it ends, or give another folder",
        path = path.display(), holder = holder.map(|pid| format!(" ({pid})")).unwrap_or_default())]
    Busy {
        /// Its id, where it has told it.
        holder: Option<u32>,
        /// The folder.
        path: PathBuf,
    },
    /// Something else has the name of the lock.
    #[error("{path}: is no lock of this program; remove it, or give another folder", path = path.display())]
    NoLock {
        /// The file.
        path: PathBuf,
    },
    /// The file or folder cannot be written.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
}

impl OutputError {
    /// For `map_err`.
    pub(super) fn writing(path: &std::path::Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |reason| Self::Write { reason, path: path.to_owned() }
    }
}
