//! What can be wrong with an array file; every message names the file, the key and what was expected.

use std::path::{Path, PathBuf};

/// Why an array file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// The operating system refused to open or read it.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What it said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// Zero bytes.
    #[error("{path}: is empty (0 bytes); expected an npz or npy file", path = path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Neither a zip archive nor an npy file, whatever its name says.
    #[error("{path}: is neither npz nor npy; it begins with {found}", path = path.display())]
    NotAnArchive {
        /// The first bytes, made printable.
        found: String,
        /// The file.
        path: PathBuf,
    },
    /// The zip directory cannot be read: truncated or damaged.
    #[error("{path}: truncated or damaged npz archive: {message}", path = path.display())]
    BadArchive {
        /// What the archive reader said.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// No array of that name.
    #[error("{path}: no array `{key}`; the file holds {present}", path = path.display())]
    MissingKey {
        /// The key that was asked for.
        key: String,
        /// The keys that exist.
        present: String,
        /// The file.
        path: PathBuf,
    },
    /// The array's header is not one that numpy writes.
    #[error("{path}: array `{key}`: bad npy header: {message}", path = path.display())]
    BadHeader {
        /// The array.
        key: String,
        /// What is wrong.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// An object array: unpickling runs code, and is never done.
    #[error("{path}: array `{key}` holds pickled Python objects, which are never loaded; expected numbers", path = path.display())]
    Pickled {
        /// The array.
        key: String,
        /// The file.
        path: PathBuf,
    },
    /// A dtype that cannot be used here.
    #[error("{path}: array `{key}` has dtype {dtype}; expected {expected}", path = path.display())]
    WrongType {
        /// The array.
        key: String,
        /// Its dtype, as in the file.
        dtype: String,
        /// What would do.
        expected: &'static str,
        /// The file.
        path: PathBuf,
    },
    /// A shape that does not fit.
    #[error("{path}: array `{key}` has shape {got}; expected {expected}", path = path.display())]
    WrongShape {
        /// The array.
        key: String,
        /// Its shape.
        got: String,
        /// What was expected, in words.
        expected: String,
        /// The file.
        path: PathBuf,
    },
    /// The header declares more than the file can hold, or than this program keeps in memory; nothing was allocated.
    #[error("{path}: array `{key}` declares shape {shape}, {declared} bytes; {limit}", path = path.display())]
    TooLarge {
        /// The array.
        key: String,
        /// The declared shape.
        shape: String,
        /// Bytes that the shape needs.
        declared: u64,
        /// What limits it, in words.
        limit: String,
        /// The file.
        path: PathBuf,
    },
    /// The data end early, go on too long, or fail the checksum.
    #[error("{path}: array `{key}` is damaged: {message}", path = path.display())]
    Corrupt {
        /// The array.
        key: String,
        /// What is wrong.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// The file could not be written; whatever was there before is untouched.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
}

impl NpzError {
    /// The file that the error is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::Read { path, .. }
            | Self::Empty { path }
            | Self::NotAnArchive { path, .. }
            | Self::BadArchive { path, .. }
            | Self::MissingKey { path, .. }
            | Self::BadHeader { path, .. }
            | Self::Pickled { path, .. }
            | Self::WrongType { path, .. }
            | Self::WrongShape { path, .. }
            | Self::TooLarge { path, .. }
            | Self::Corrupt { path, .. }
            | Self::Write { path, .. } => path,
        }
    }

    /// True where the file simply is not there: a missing companion is a note, a damaged one is named.
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::Read { reason, .. } if reason.kind() == std::io::ErrorKind::NotFound)
    }
}

/// A shape as numpy prints it: `(256, 128)`, `(3,)`, `()`.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// Text from a file, made safe and short enough to put into a message.
pub(crate) fn shown(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes.get(..24).unwrap_or(bytes)).escape_debug().to_string();
    format!("\"{text}{}\"", if bytes.len() > 24 { "…" } else { "" })
}
