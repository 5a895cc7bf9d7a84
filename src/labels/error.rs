//! What can be wrong with labels; every message names the file or folder.

use std::path::PathBuf;

/// Why labels could not be read or kept.
#[derive(Debug, thiserror::Error)]
pub enum LabelError {
    /// A name that says nobody.
    #[error("{path}: the annotator's name is empty; expected who tags, for example `anna`", path = path.display())]
    NoAnnotator {
        /// The folder of the labels.
        path: PathBuf,
    },
    /// Neither beside the data nor in the user's folder can anything be written.
    #[error("{path}: no place for labels: {beside}; and {other}", path = path.display())]
    NoPlace {
        /// Why not beside the data.
        beside: String,
        /// Why not in the user's folder.
        other: String,
        /// The data set.
        path: PathBuf,
    },
    /// A journal, or a folder of them, cannot be read.
    #[error("{path}: labels cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
    /// An act is not on disk: nothing of it may be shown as tagged.
    #[error("{path}: labels cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
    /// A journal of a program that knows more than this one.
    #[error(
        "{path}: written in version {version} of the label format, this program knows {known}; it is left as it is: \
         update the program",
        path = path.display()
    )]
    Newer {
        /// The version of the file.
        version: u64,
        /// The newest version that is understood.
        known: u64,
        /// The journal.
        path: PathBuf,
    },
    /// Something that would be waited for, or would act on what is written.
    #[error("{path}: no journal of labels: it is {found}; expected a file", path = path.display())]
    NotAFile {
        /// What it is.
        found: &'static str,
        /// The journal.
        path: PathBuf,
    },
    /// A file in which no line is a header or a record.
    #[error("{path}: no journal of labels: {found}; expected JSON lines that begin with {{\"format\":\"mhp-labels\"", path = path.display())]
    NotAJournal {
        /// What its first line is.
        found: String,
        /// The file.
        path: PathBuf,
    },
}
