//! What a file is written through: after a first failure everything is swallowed, and the failure is told at the end.
//!
//! An archive that cannot be finished says so on standard error when it is dropped, and formats finish themselves in their own
//! ways; none of them has to know that the disk is full.

use std::io::{Error, Result, Seek, SeekFrom, Write};

/// What a file is written through.
pub(crate) trait Sink: Write + Seek {}
impl<T: Write + Seek> Sink for T {}

/// Writes to `inner` until that fails.
pub(super) struct Swallowing<W> {
    inner: W,
    failed: Option<Error>,
    at: u64,
    end: u64,
}

impl<W: Write + Seek> Swallowing<W> {
    pub(super) fn new(inner: W) -> Self {
        Self { inner, failed: None, at: 0, end: 0 }
    }

    /// Everything is written; the first failure.
    pub(super) fn finish(mut self) -> Result<W> {
        self.keep(Write::flush);
        self.failed.map_or(Ok(self.inner), Err)
    }

    fn keep(&mut self, act: impl FnOnce(&mut W) -> Result<()>) {
        if self.failed.is_none() {
            self.failed = act(&mut self.inner).err();
        }
    }
}

impl<W: Write + Seek> Write for Swallowing<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.keep(|inner| inner.write_all(bytes));
        self.at += bytes.len() as u64;
        self.end = self.end.max(self.at);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        self.keep(Write::flush);
        Ok(())
    }
}

impl<W: Write + Seek> Seek for Swallowing<W> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let from = |base: u64, by: i64| base.checked_add_signed(by).ok_or_else(|| Error::other("before the beginning"));
        self.at = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(by) => from(self.at, by)?,
            SeekFrom::End(by) => from(self.end, by)?,
        };
        let at = self.at;
        self.keep(|inner| inner.seek(SeekFrom::Start(at)).map(drop));
        Ok(at)
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use std::io::Cursor;

    #[test]
    fn an_archive_on_a_full_disk_ends_quietly_and_the_failure_is_told() {
        let mut disk = [0_u8; 64];
        let mut out = Swallowing::new(Cursor::new(&mut disk[..]));
        let mut archive = zip::ZipWriter::new(&mut out);
        archive.start_file("a.npy", zip::write::FileOptions::default()).unwrap();
        archive.write_all(&[1; 1000]).unwrap();
        archive.finish().unwrap();
        drop(archive);
        assert!(out.finish().is_err());
    }
}
