//! `summary.csv`: a row a frame; an interrupted run leaves a valid table of what it did ([`Growing`]).

use super::BatchRow;
use crate::mhp::{StepReport, TERMS};
use crate::output::Growing;
use std::path::{Path, PathBuf};

/// The columns before the numbers.
pub(super) const FIRST: [&str; 6] = ["frame", "iterations", "converged", "reason", "people", "annotated"];
/// Columns of numbers before the IoUs: the loss and its terms.
pub(super) const LOSSES: usize = 1 + TERMS.len();
const LAST: [&str; 4] = ["majpe_mm", "pa_majpe_mm", "init_ms", "fit_ms"];
/// Joint errors: the first of [`LAST`].
pub(super) const ERRORS: usize = 2;
/// Columns of numbers, besides one for the IoU of each view.
pub(super) const NUMBERS: usize = LOSSES + LAST.len();

/// What can go wrong with a study as a whole.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A folder or table cannot be written.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file or folder.
        path: PathBuf,
    },
    /// A table cannot be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// A table is not what it should be.
    #[error("{path}: line {line}: {message}", path = path.display())]
    Table {
        /// The line, from 1.
        line: u64,
        /// What is wrong with it, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// A file of erased cells is not what it should be.
    #[error("{path}: no erased cells: {reason}", path = path.display())]
    Erased {
        /// What is wrong with it, and what was expected.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// The operating system gives no more threads.
    #[error("no thread to work on: {reason}")]
    Thread {
        /// What it said.
        reason: std::io::Error,
    },
    /// A setting out of its range.
    #[error("{key} is {value}; expected {expected}")]
    Setting {
        /// Its name.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What would have been accepted.
        expected: &'static str,
    },
    /// Somebody pressed cancel.
    #[error("cancelled")]
    Cancelled,
    /// A defect in this program, caught so that the window lives on.
    #[error("internal error: {message}")]
    Internal {
        /// The panic's text.
        message: String,
    },
}

/// The columns of a batch, in order: `frame iterations converged reason people annotated loss`, each of [`TERMS`],
/// `iou_<array>…  majpe_mm pa_majpe_mm init_ms fit_ms`, an IoU for each of `arrays`.
pub fn columns(arrays: &[String]) -> Vec<String> {
    let plain = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
    let ious = arrays.iter().map(|array| format!("iou_{array}")).collect();
    [plain(&FIRST), losses().map(str::to_owned).collect(), ious, plain(&LAST)].concat()
}

/// The names of the columns of the loss and its terms.
pub(super) fn losses() -> impl Iterator<Item = &'static str> {
    ["loss"].into_iter().chain(TERMS.iter().map(|term| term.key))
}

/// The numbers of these columns.
pub(super) fn loss_values(report: &StepReport) -> impl Iterator<Item = f64> {
    [report.loss].into_iter().chain(report.terms.iter().map(|(_, value)| value))
}

/// An open `summary.csv`.
#[derive(Debug)]
pub struct Summary {
    table: Growing,
    views: usize,
    path: PathBuf,
}

impl Summary {
    /// Begins the table with its head. An older one stays until there are rows to take its place.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn create(path: &Path, arrays: &[String]) -> Result<Self, StudyError> {
        let failed = |reason| StudyError::Write { reason, path: path.to_owned() };
        let table = line(&columns(arrays)).and_then(|head| Growing::create(path, &head)).map_err(failed)?;
        Ok(Self { table, views: arrays.len(), path: path.to_owned() })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// Where the file cannot be written; what is in its place stays whole.
    pub fn add(&mut self, row: &BatchRow) -> Result<(), StudyError> {
        let added = line(&row.cells(self.views)).and_then(|row| self.table.add(&row));
        added.map_err(|reason| StudyError::Write { reason, path: self.path.clone() })
    }

    /// Puts the whole table in its place.
    ///
    /// # Errors
    /// Where that cannot be done.
    pub fn finish(self) -> Result<(), StudyError> {
        let Self { table, path, .. } = self;
        table.finish().map_err(|reason| StudyError::Write { reason, path })
    }
}

fn line(cells: &[String]) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(cells).map_err(std::io::Error::other)?;
    writer.into_inner().map_err(|error| std::io::Error::other(error.to_string()))
}
