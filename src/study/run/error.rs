//! What can go wrong with a run as a whole. What goes wrong with one frame is a row.

use super::super::shard::ShardError;
use super::super::{FileError, StudyError};
use crate::output::OutputError;
use std::path::PathBuf;

/// Why a run cannot begin, go on, be merged or be read.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A study underneath.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// A file of its own.
    #[error(transparent)]
    File(#[from] FileError),
    /// The folder holds another run.
    #[error("{path}: holds a run with another {what}: {there}, not {here}; give another --out, or remove the folder", path = path.display())]
    OtherRun {
        /// What differs.
        what: String,
        /// What the folder says.
        there: String,
        /// What was asked for.
        here: String,
        /// The folder.
        path: PathBuf,
    },
    /// The folder must not be written, or another process writes it.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Shards that do not make a run.
    #[error(transparent)]
    Shard(#[from] ShardError),
    /// A parameter grid that makes no sense.
    #[error("--grid {text}: {message}")]
    Grid {
        /// As typed.
        text: String,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// No frame to study.
    #[error("{message}")]
    NoFrames {
        /// Which frames were asked for.
        message: String,
    },
    /// The operating system gives no more threads.
    #[error("no thread to work on: {reason}")]
    Thread {
        /// What it said.
        reason: std::io::Error,
    },
}
