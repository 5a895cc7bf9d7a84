//! `journal.jsonl`: a line a finished row, appended as soon as it is known, so that a killed run loses nothing that was done.
//!
//! The first line names the run. A torn or damaged line is dropped, its row is done again. One process writes it: whoever holds
//! the folder ([`crate::output::FolderLock`]).

use super::super::FileError;
use super::error::RunError;
use super::row::RunRow;
use super::spec::RunSpec;
use crate::input::read_bytes;
use crate::output::replace_file;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The name of the file in a run folder.
pub const JOURNAL_FILE: &str = "journal.jsonl";

/// Rows by (variant, frame).
pub(super) type Rows = BTreeMap<(usize, usize), RunRow>;

/// An open journal.
#[derive(Debug)]
pub(super) struct RunJournal {
    file: File,
    path: PathBuf,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct Head {
    run: String,
}

impl RunJournal {
    /// Opens the journal of a run folder, or begins it, and gives the rows that are in it.
    ///
    /// # Errors
    /// Where it cannot be read or written, or it is of another run.
    pub(super) fn open(folder: &Path, spec: &RunSpec) -> Result<(Self, Rows), RunError> {
        let path = folder.join(JOURNAL_FILE);
        let (rows, sound) = if path.exists() { read_lines(&path, spec)? } else { (Rows::new(), false) };
        if !sound {
            rewrite(&path, spec, &rows)?;
        }
        let file = OpenOptions::new().append(true).open(&path).map_err(FileError::writing(&path))?;
        Ok((Self { file, path }, rows))
    }

    /// Appends a row in one piece.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub(super) fn add(&mut self, row: &RunRow) -> Result<(), RunError> {
        let line = line(row).map_err(FileError::writing(&self.path))?;
        Ok(self.file.write_all(line.as_bytes()).map_err(FileError::writing(&self.path))?)
    }
}

/// The rows of a run folder, finished or not.
///
/// # Errors
/// Where the journal cannot be read or is of another run.
pub(super) fn read(folder: &Path, spec: &RunSpec) -> Result<Rows, RunError> {
    let path = folder.join(JOURNAL_FILE);
    if path.exists() { read_lines(&path, spec).map(|(rows, _)| rows) } else { Ok(Rows::new()) }
}

/// Writes a journal of these rows anew, in their order.
pub(super) fn rewrite(path: &Path, spec: &RunSpec, rows: &Rows) -> Result<(), RunError> {
    let written = replace_file(path, |out| {
        let head = serde_json::to_string(&Head { run: spec.id.clone() })?;
        writeln!(out, "{head}")?;
        rows.values().try_for_each(|row| out.write_all(line(row)?.as_bytes()))
    });
    Ok(written.map_err(FileError::writing(path))?)
}

fn line(row: &RunRow) -> std::io::Result<String> {
    Ok(serde_json::to_string(row)? + "\n")
}

/// Bytes of a journal that are read: some 400 a row.
const MOST_BYTES: u64 = 4 << 30;

/// The rows, and whether every line was whole.
fn read_lines(path: &Path, spec: &RunSpec) -> Result<(Rows, bool), RunError> {
    let bytes = read_bytes(path, "the journal of a run", MOST_BYTES).map_err(FileError::reading(path))?;
    let whole = bytes.is_empty() || bytes.ends_with(b"\n");
    let mut lines = bytes.split(|&byte| byte == b'\n').filter(|line| !line.is_empty());
    let Some(head) = lines.next() else { return Ok((Rows::new(), false)) };
    let Ok(head) = serde_json::from_slice::<Head>(head) else {
        // Killed while the first line was written: nothing is lost. Anything more is not ours to drop.
        if whole {
            let message = "line 1 does not name a run; expected {\"run\": …}".to_owned();
            return Err(FileError::Damaged { message, path: path.to_owned() }.into());
        }
        return Ok((Rows::new(), false));
    };
    if head.run != spec.id {
        let message = format!("is the journal of run {}; run.toml is {}", head.run, spec.id);
        return Err(FileError::Damaged { message, path: path.to_owned() }.into());
    }
    let (mut rows, mut sound) = (Rows::new(), whole);
    for line in lines {
        match serde_json::from_slice::<RunRow>(line) {
            Ok(row) if row.variant < spec.variants.len() => {
                rows.insert((row.variant, row.frame), row);
            }
            _ => sound = false,
        }
    }
    if !sound {
        tracing::warn!("{}: a torn line is dropped, its row is done again", path.display());
    }
    Ok((rows, sound))
}
