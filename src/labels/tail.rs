//! Follows one journal: each look reads what was appended since the last, and notices a file that was replaced.

use super::file::regular;
use super::format::{JournalLine, is_torn_header, parse};
use super::{LabelError, Record};
use std::fs::{File, Metadata};
use std::io::{BufRead as _, BufReader, ErrorKind, Read, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Bytes before the place of reading that are remembered, to notice a file that was written anew in place.
const REMEMBERED: usize = 64;
/// The longest line that is read: a note of a whole book.
const MAX_LINE: u64 = 16 << 20;
/// Damaged lines that are told one by one.
const TOLD: usize = 20;

/// What a look found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing new.
    Same,
    /// More lines.
    More,
    /// Another file, or none, where the file was: what was read of it no longer holds. Read anew after [`Tail::reset`].
    Replaced,
}

/// Where a record lies in its file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    /// Its first byte.
    pub(super) offset: u64,
    /// Its bytes, with the newline.
    pub(super) len: u32,
}

/// A file as it was at the last look.
#[derive(Debug, PartialEq)]
struct Seen {
    identity: Identity,
    len: u64,
    modified: Option<SystemTime>,
}

impl Seen {
    fn of(meta: &Metadata) -> Self {
        Self { identity: identity(meta), len: meta.len(), modified: meta.modified().ok() }
    }
}

/// A journal and how far it was read.
#[derive(Debug)]
pub(super) struct Tail {
    path: PathBuf,
    offset: u64,
    newlines: usize,
    last: Vec<u8>,
    seen: Option<Seen>,
    has_header: bool,
    has_record: bool,
    foreign: Option<String>,
    damaged: Vec<usize>,
    torn: Option<u64>,
}

impl Tail {
    /// Nothing is read yet.
    pub(super) fn new(path: PathBuf) -> Self {
        Self {
            path,
            offset: 0,
            newlines: 0,
            last: Vec::new(),
            seen: None,
            has_header: false,
            has_record: false,
            foreign: None,
            damaged: Vec::new(),
            torn: None,
        }
    }

    /// Forgets all that was read.
    pub(super) fn reset(&mut self) {
        *self = Self::new(std::mem::take(&mut self.path));
    }

    /// The file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// True where a header was read.
    pub(super) fn has_header(&self) -> bool {
        self.has_header
    }

    /// What had to be skipped, in words.
    pub(super) fn warnings(&self) -> impl Iterator<Item = String> {
        let place = |line| format!("{}:{line}", self.path.display());
        let lines = self.damaged.iter().take(TOLD).map(move |&line| format!("{}: damaged line, skipped", place(line)));
        let more = self.damaged.len().saturating_sub(TOLD);
        let more = (more > 0).then(|| format!("{}: {more} more damaged lines, skipped", self.path.display()));
        let torn = self.torn.map(|bytes| {
            let place = place(self.newlines + 1);
            format!("{place}: the last line is cut off after {bytes} bytes, as by a crash; skipped")
        });
        lines.chain(more).chain(torn)
    }

    /// Gives every record that is new to `sink`.
    ///
    /// # Errors
    /// Where the file cannot be read, is of a newer version, or is no journal. A file that is not there has no records.
    pub(super) fn look(&mut self, sink: impl FnMut(Span, Box<Record>)) -> Result<Found, LabelError> {
        let missing = if self.offset > 0 || self.seen.is_some() { Found::Replaced } else { Found::Same };
        match std::fs::metadata(&self.path) {
            Err(reason) if reason.kind() == ErrorKind::NotFound => return Ok(missing),
            Ok(meta) if self.seen.as_ref() == Some(&Seen::of(&meta)) => return Ok(Found::Same),
            Ok(meta) => regular(&meta, &self.path)?,
            Err(_) => {}
        }
        match File::open(&self.path) {
            Ok(file) => self.look_in(&file, sink),
            Err(reason) if reason.kind() == ErrorKind::NotFound => Ok(missing),
            Err(reason) => Err(self.unreadable(reason)),
        }
    }

    /// As [`Self::look`], in a file that is open.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub(super) fn look_in(&mut self, file: &File, sink: impl FnMut(Span, Box<Record>)) -> Result<Found, LabelError> {
        let meta = file.metadata().map_err(|reason| self.unreadable(reason))?;
        regular(&meta, &self.path)?;
        let now = Seen::of(&meta);
        match &self.seen {
            Some(seen) if *seen == now => return Ok(Found::Same),
            Some(seen) if seen.identity != now.identity => return Ok(Found::Replaced),
            _ => {}
        }
        if now.len < self.offset || !self.continues(file).map_err(|reason| self.unreadable(reason))? {
            return Ok(Found::Replaced);
        }
        self.read_lines(file.take(now.len - self.offset), sink)?;
        self.seen = Some(now);
        Ok(Found::More)
    }

    /// Reads a journal that is in memory already, from its beginning.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub(super) fn read(&mut self, bytes: &[u8], sink: impl FnMut(Span, Box<Record>)) -> Result<(), LabelError> {
        self.reset();
        self.read_lines(bytes, sink)
    }

    fn unreadable(&self, reason: std::io::Error) -> LabelError {
        LabelError::Read { reason, path: self.path.clone() }
    }

    /// True where the bytes before the place of reading are those that were read.
    fn continues(&self, mut file: &File) -> std::io::Result<bool> {
        let mut bytes = vec![0; self.last.len()];
        file.seek(SeekFrom::Start(self.offset - self.last.len() as u64))?;
        file.read_exact(&mut bytes)?;
        Ok(bytes == self.last)
    }

    /// Reads all of `rest`, which begins at the place of reading and ends where the file did when it was asked: bytes that
    /// come later may be half a line.
    fn read_lines(&mut self, rest: impl Read, mut sink: impl FnMut(Span, Box<Record>)) -> Result<(), LabelError> {
        let mut reader = BufReader::with_capacity(1 << 18, rest);
        let mut line = Vec::new();
        self.torn = None;
        loop {
            line.clear();
            let read = (&mut reader).take(MAX_LINE).read_until(b'\n', &mut line);
            let read = read.map_err(|reason| self.unreadable(reason))? as u64;
            if read == 0 {
                return match self.foreign.clone() {
                    Some(found) => Err(LabelError::NotAJournal { found, path: self.path.clone() }),
                    None => Ok(()),
                };
            }
            if read == MAX_LINE && !line.ends_with(b"\n") {
                let found = format!("line {} has more than {MAX_LINE} bytes", self.newlines + 1);
                return Err(LabelError::NotAJournal { found, path: self.path.clone() });
            }
            self.take(&line, &mut sink)?;
        }
    }

    fn take(&mut self, line: &[u8], sink: &mut impl FnMut(Span, Box<Record>)) -> Result<(), LabelError> {
        let ended = line.ends_with(b"\n");
        match parse(line, &self.path)? {
            JournalLine::Record(record) => {
                (self.has_record, self.foreign) = (true, None);
                sink(Span { offset: self.offset, len: line.len() as u32 }, record);
            }
            JournalLine::Header => (self.has_header, self.foreign) = (true, None),
            JournalLine::Blank if ended => {}
            JournalLine::Blank => return Ok(()),
            JournalLine::Damaged => {
                self.suspect(line);
                if !ended {
                    // Perhaps another process is still writing it.
                    self.torn = Some(line.len() as u64);
                    return Ok(());
                }
                self.damaged.push(self.newlines + 1);
            }
        }
        self.offset += line.len() as u64;
        self.newlines += usize::from(ended);
        self.last.extend_from_slice(line.get(line.len().saturating_sub(REMEMBERED)..).unwrap_or_default());
        self.last.drain(..self.last.len().saturating_sub(REMEMBERED));
        Ok(())
    }

    /// Keeps the first line of what may be no journal at all.
    fn suspect(&mut self, line: &[u8]) {
        if self.has_header || self.has_record || self.foreign.is_some() || is_torn_header(line) {
            return;
        }
        let begin = line.get(..line.len().min(40)).unwrap_or_default();
        self.foreign = Some(format!("line {} is {:?}", self.newlines + 1, String::from_utf8_lossy(begin).trim_end()));
    }
}

/// What tells a file from another one of the same name.
#[cfg(unix)]
type Identity = (u64, u64);

/// What tells a file from another one of the same name.
#[cfg(not(unix))]
type Identity = Option<SystemTime>;

#[cfg(unix)]
fn identity(meta: &Metadata) -> Identity {
    use std::os::unix::fs::MetadataExt as _;
    (meta.dev(), meta.ino())
}

#[cfg(not(unix))]
fn identity(meta: &Metadata) -> Identity {
    meta.created().ok()
}

/// True where `path` still names the open `file`.
///
/// # Errors
/// Where one cannot be asked.
pub(super) fn is_named(file: &File, path: &Path) -> std::io::Result<bool> {
    match std::fs::metadata(path) {
        Ok(meta) => Ok(identity(&meta) == identity(&file.metadata()?)),
        Err(reason) if reason.kind() == ErrorKind::NotFound => Ok(false),
        Err(reason) => Err(reason),
    }
}
