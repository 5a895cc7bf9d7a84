//! What can be wrong with predictions; every message names the file, the place in it and what was expected.

use crate::dataset::NpzError;
use crate::input::place;
use std::path::{Path, PathBuf};

/// Why predictions could not be read or used.
#[derive(Debug, thiserror::Error)]
pub enum PredictionError {
    /// The operating system refused.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What it said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// The file or the folder cannot be written.
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
    /// The file is none of predictions, or damaged.
    #[error("{place}: {message}", place = place(path, *line))]
    Format {
        /// What is wrong, and what was expected.
        message: String,
        /// The line, counted from 1, where one is known.
        line: Option<usize>,
        /// The file.
        path: PathBuf,
    },
    /// The joints are not those of a skeleton that can be compared.
    #[error("{path}: wrong skeleton: {message}", path = path.display())]
    Skeleton {
        /// What is wrong, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// Nothing says what the numbers are: ask, and remember.
    #[error("{path}: nothing in it says {missing}; give {flags} once (it is remembered for files of this form){hint}", path = path.display())]
    NotStated {
        /// What is not said, in words.
        missing: String,
        /// The flags that say it.
        flags: String,
        /// What the numbers look like, in words.
        hint: String,
        /// The file.
        path: PathBuf,
    },
    /// The numbers cannot be in the unit that is stated.
    #[error("{path}: wrong unit: {message}", path = path.display())]
    Unit {
        /// What is wrong, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// The frames are not those of the data set.
    #[error("{path}: {message}", path = path.display())]
    Frames {
        /// What is wrong, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// A joint is no number.
    #[error("{path}: frame {frame}, person {person}, joint `{joint}` is not finite; expected three finite numbers (a person of whom \
             every joint is NaN is one who is not there)", path = path.display())]
    NotFinite {
        /// The frame, as the file calls it.
        frame: String,
        /// The person, counted from 0.
        person: usize,
        /// The joint.
        joint: String,
        /// The file.
        path: PathBuf,
    },
}

impl PredictionError {
    pub(super) fn format(path: &Path, message: impl Into<String>) -> Self {
        Self::Format { message: message.into(), line: None, path: path.to_owned() }
    }

    pub(super) fn at_line(path: &Path, line: usize, message: impl Into<String>) -> Self {
        Self::Format { message: message.into(), line: Some(line), path: path.to_owned() }
    }

    /// True where the answer is a question to the user: joints, unit or axes.
    pub fn is_question(&self) -> bool {
        matches!(self, Self::NotStated { .. })
    }
}
