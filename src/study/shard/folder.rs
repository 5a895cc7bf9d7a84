//! The folder of a shard that is under way: held by one process, said what it is before the first frame, finished by its rows.

use super::super::FileError;
use super::gather::Part as _;
use super::rows::{ShardRow, write_rows};
use super::{ShardError, ShardSpec};
use crate::output::{FolderLock, Inputs, replace_file};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The file that says what a shard is.
pub const SHARD_FILE: &str = "shard.toml";
/// The rows of a shard; they are there once all are known.
pub(super) const ROWS_FILE: &str = "rows.jsonl";

/// Whether `folder` holds a shard of a command over frames, finished or not.
pub fn is_shard_folder(folder: &Path) -> bool {
    folder.join(SHARD_FILE).is_file()
}

/// A shard under way.
#[derive(Debug)]
pub struct ShardFolder {
    folder: PathBuf,
    spec: ShardSpec,
    _lock: FolderLock,
}

impl ShardFolder {
    /// Makes and holds `folder`, and the folders `below` it. Where it holds the same shard, that is done again.
    ///
    /// # Errors
    /// Where the folder holds another shard, or other results `below`, lies in the data set or cannot be written, or another
    /// process works on it.
    pub fn begin(folder: &Path, below: &[&str], spec: ShardSpec, inputs: &Inputs<'_>) -> Result<Self, ShardError> {
        let lock = FolderLock::claim(folder, below, inputs)?;
        let [file, rows] = [SHARD_FILE, ROWS_FILE].map(|name| folder.join(name));
        [&file, &rows].into_iter().try_for_each(|file| inputs.check_replaced(file))?;
        if is_shard_folder(folder)
            && let Some((what, there, here)) = ShardSpec::read(folder)?.difference(&spec)
        {
            return Err(ShardError::OtherShard { what, there, here, path: folder.to_owned() });
        }
        if !is_shard_folder(folder) {
            below.iter().try_for_each(|name| check_empty(&folder.join(name)))?;
        }
        match std::fs::remove_file(&rows) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(FileError::writing(&rows)(error).into()),
            _ => {}
        }
        let text = spec.text().map_err(|error| FileError::Damaged {
            message: format!("cannot be written: {error}"),
            path: file.clone(),
        })?;
        replace_file(&file, |out| out.write_all(text.as_bytes())).map_err(FileError::writing(&file))?;
        Ok(Self { folder: folder.to_owned(), spec, _lock: lock })
    }

    /// Writes the rows of all frames of the shard, in their order: it is finished.
    ///
    /// # Errors
    /// Where they cannot be written.
    pub fn finish(self, rows: &[impl ShardRow]) -> Result<(), ShardError> {
        write_rows(&self.folder.join(ROWS_FILE), &self.spec, rows)
    }
}

/// Refuses a folder with files that a merge would take for the shard's.
fn check_empty(folder: &Path) -> Result<(), ShardError> {
    let mut entries = std::fs::read_dir(folder).map_err(FileError::reading(folder))?;
    let message = "holds other results already; give another --out, or remove it".to_owned();
    entries.next().map_or(Ok(()), |_| Err(FileError::Damaged { message, path: folder.to_owned() }.into()))
}
