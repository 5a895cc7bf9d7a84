//! Labels as a table, to take them home and to bring them back: CSV (RFC 4180, UTF-8) and JSON.
//!
//! A row is what one annotator says of one frame; [`COLUMNS`] says which cell is what. Tags are `1` or `0`; what is
//! unknown is empty. Text is quoted, never lost: what is written is what is read, also with line breaks or quotes. Before
//! text that a spreadsheet would compute, as `=1+1`, the CSV has an apostrophe, which reading takes away again. The JSON is an array of records as in a journal, without its header. Rows lie in the order
//! of the frames' indices, then names, then annotators.

mod check;
mod csv_read;
mod csv_write;
mod json;

use super::{LabelError, Record, Tag};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The columns of the CSV, in the order in which they are written. On reading, any order will do; `frame` and the six
/// tags must be there, other columns may lack, and unknown ones are passed over with a note.
pub const COLUMNS: [&str; 26] = [
    "frame",
    "index",
    "annotator",
    "time",
    "F1",
    "F2",
    "F3",
    "F4",
    "clean",
    "unsure",
    "verdict",
    "person",
    "region",
    "note",
    "judged_fit",
    "judged_config",
    "judged_iteration",
    "judged_erased",
    "machine_F1",
    "machine_F2",
    "machine_F3",
    "machine_F4",
    "machine_shown",
    "act",
    "dataset",
    "program",
];

/// The column of the program's own score of a failure mode.
fn machine_column(mode: Tag) -> String {
    format!("machine_{mode}")
}

/// What can be wrong with a table of labels.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
    /// It is a folder.
    #[error("{path}: is a folder; expected a journal (*.labels.jsonl), or labels exported as CSV or JSON", path = path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// It is a journal where a table was expected.
    #[error(
        "{path}: is a journal, not a table: it counts as soon as it lies in the data set's folder of labels under its \
         own name; or make a table of it with `labels export`",
        path = path.display()
    )]
    IsJournal {
        /// The journal.
        path: PathBuf,
    },
    /// A column is missing, or there twice.
    #[error("{path}: line 1: {message}", path = path.display())]
    Header {
        /// Which, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// A row is not one.
    #[error("{path}: line {line}: {message}", path = path.display())]
    Row {
        /// The line on which it begins, from 1.
        line: u64,
        /// What is wrong, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// A cell holds what its column cannot.
    #[error("{path}: line {line}, column `{column}`: {message}", path = path.display())]
    Cell {
        /// The line on which its row begins, from 1.
        line: u64,
        /// The column.
        column: String,
        /// What is wrong, and what was expected.
        message: String,
        /// The file.
        path: PathBuf,
    },
    /// It is a journal that cannot be read.
    #[error(transparent)]
    Journal(#[from] LabelError),
    /// It is not an array of records.
    #[error("{path}: {message}; expected a JSON array of records, as `labels export --json` writes it", path = path.display())]
    Json {
        /// What the parser said, with line and column.
        message: String,
        /// The file.
        path: PathBuf,
    },
}

/// A row that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelRow {
    /// The line on which it begins in a CSV, the place in the array in JSON; from 1.
    pub line: u64,
    /// What it says. Cells that were not there are empty, the index 0.
    pub record: Record,
}

/// A table that was read; no frame is there twice for one annotator.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadTable {
    /// In the order of the file.
    pub rows: Vec<LabelRow>,
    /// What was passed over.
    pub notes: Vec<String>,
}

/// Reads a table: a JSON array where the first sign is `[`, else CSV. An empty file has no rows.
///
/// # Errors
/// One that names the file and, where it can, line and column.
pub fn read_table(path: &Path) -> Result<ReadTable, TableError> {
    table_of(&read_bytes(path)?, path)
}

/// As [`read_table`], from the bytes of the file `path`.
///
/// # Errors
/// As [`read_table`].
pub(super) fn table_of(bytes: &[u8], path: &Path) -> Result<ReadTable, TableError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let table = match first_sign(bytes) {
        None => ReadTable::default(),
        Some(b'[') => json::read(bytes, path)?,
        Some(b'{') => return Err(TableError::IsJournal { path: path.to_owned() }),
        Some(_) => csv_read::read(bytes, path)?,
    };
    each_once(&table.rows, path)?;
    Ok(table)
}

/// The file's content.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, TableError> {
    if path.is_dir() {
        return Err(TableError::Folder { path: path.to_owned() });
    }
    std::fs::read(path).map_err(|reason| TableError::Read { reason, path: path.to_owned() })
}

/// The first byte that is no white space.
pub(super) fn first_sign(bytes: &[u8]) -> Option<u8> {
    bytes.iter().copied().find(|byte| !byte.is_ascii_whitespace())
}

fn each_once(rows: &[LabelRow], path: &Path) -> Result<(), TableError> {
    let mut seen = BTreeMap::new();
    for LabelRow { line, record } in rows {
        let who_and_what = (record.annotator.as_str(), record.frame.path.as_str());
        let Some(first) = seen.insert(who_and_what, *line) else { continue };
        let (who, frame) = (shortened(&record.annotator), shortened(&record.frame.path));
        let message = format!("frame `{frame}` of annotator `{who}` is on line {first} already; expected one row each");
        return Err(TableError::Row { line: *line, message, path: path.to_owned() });
    }
    Ok(())
}

/// Text from a file for a message: a line that one can read, however long and wild it is.
fn shortened(text: &str) -> String {
    at_most(60, text)
}

fn at_most(most: usize, text: &str) -> String {
    let more = if text.chars().nth(most).is_some() { "…" } else { "" };
    format!("{}{more}", text.chars().take(most).collect::<String>().escape_debug())
}

/// By index, then name, then annotator.
fn in_order<'a>(records: impl IntoIterator<Item = &'a Record>) -> Vec<&'a Record> {
    let mut records: Vec<&Record> = records.into_iter().collect();
    records.sort_by_key(|record| (record.frame.index, record.frame.path.as_str(), record.annotator.as_str()));
    records
}

/// Writes records as CSV with [`COLUMNS`].
///
/// # Errors
/// Where `out` cannot be written.
pub fn write_csv<'a>(out: &mut dyn Write, records: impl IntoIterator<Item = &'a Record>) -> std::io::Result<()> {
    csv_write::write(out, &in_order(records))
}

/// Writes records as a JSON array, one record a line.
///
/// # Errors
/// Where `out` cannot be written.
pub fn write_json<'a>(out: &mut dyn Write, records: impl IntoIterator<Item = &'a Record>) -> std::io::Result<()> {
    json::write(out, &in_order(records))
}
