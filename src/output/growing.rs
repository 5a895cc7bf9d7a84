//! A table that grows while a command works: rows go to a file beside its place, and the rows so far are put there as a whole now
//! and then, so that a command that is killed leaves a table of what it did, and one that fails leaves the table before.

use super::replace::{Temporary, replace_file};
use std::io::{BufReader, Result, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The table in place is at most this old, unless copying it takes long.
const OLDEST: Duration = Duration::from_millis(200);
/// Work between two copies takes at least so many times as long as a copy.
const PATIENCE: u32 = 20;

/// A growing file.
#[derive(Debug)]
pub(crate) struct Growing {
    rows: Temporary,
    path: PathBuf,
    /// When the file in place was made, and how long that took.
    put: (Instant, Duration),
    failed: bool,
}

impl Growing {
    /// Begins a file with `head`. It is in place at once unless there is an older one.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(crate) fn create(path: &Path, head: &[u8]) -> Result<Self> {
        let rows = Temporary::beside(path)?;
        let mut growing = Self { rows, path: path.to_owned(), put: (Instant::now(), Duration::ZERO), failed: false };
        growing.write(head)?;
        if !path.exists() {
            growing.put_copy()?;
        }
        Ok(growing)
    }

    /// Appends whole rows.
    ///
    /// # Errors
    /// Where they cannot be written; the file in place then stays as it is.
    pub(crate) fn add(&mut self, rows: &[u8]) -> Result<()> {
        self.write(rows)?;
        let (when, cost) = self.put;
        if when.elapsed() < OLDEST.max(cost * PATIENCE) { Ok(()) } else { self.put_copy() }
    }

    /// Puts the whole in place.
    ///
    /// # Errors
    /// Where it cannot be moved there.
    pub(crate) fn finish(self) -> Result<()> {
        // The failure was told when it came.
        if self.failed { Ok(()) } else { self.rows.put() }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let written = self.rows.file.write_all(bytes);
        self.failed |= written.is_err();
        written
    }

    fn put_copy(&mut self) -> Result<()> {
        let began = Instant::now();
        let mut rows = &self.rows.file;
        let copied = replace_file(&self.path, |out| {
            rows.rewind()?;
            std::io::copy(&mut BufReader::new(rows), out).map(drop)
        });
        self.failed |= copied.is_err();
        self.put = (Instant::now(), began.elapsed());
        copied.and_then(|()| rows.seek(std::io::SeekFrom::End(0)).map(drop))
    }
}
