//! The append-only file of one annotator, and the one way to change a label.
//!
//! An act is a read-modify-write under the file's lock: what other windows appended is read first, the change is applied
//! to that, and the records are on disk before anybody is told. A process that is killed at any moment leaves at worst a
//! line without its end, which the next one closes. The file is opened anew for each act, because one that was replaced
//! meanwhile would swallow what is written to the old.
//!
//! What a reader sees of the annotator is what is changed: all files of the place are read, as by a
//! [`LabelStore`](super::LabelStore), and an act comes after everything in them, whatever their clocks said.

use super::file::open_to_append;
use super::format::{PROGRAM, is_ahead, now_ms, order_ms, time_ms, time_text, write_header, write_record};
use super::place::file_name;
use super::stamp::Stamp;
use super::store::journals_in;
use super::tail::{Found, Tail, is_named};
use super::{Change, FrameId, Judged, Label, LabelError, LabelPlace, Record};
use std::collections::HashMap;
use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

/// How often a file that changes its identity under our hands is tried.
const TRIES: usize = 100;

/// What an act did to one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The frame.
    pub frame: FrameId,
    /// Its label before, with what other windows had done to it.
    pub before: Label,
    /// What was written; `Change::between(&after.label, &before)` undoes it.
    pub after: Record,
}

/// A change of one frame that was made elsewhere and is brought here, with what was known of it there.
#[derive(Debug, Clone, PartialEq)]
pub struct SaidElsewhere {
    /// The frame.
    pub frame: FrameId,
    /// What is said of it.
    pub change: Change,
    /// What was judged.
    pub judged: Judged,
    /// When it was said, RFC 3339; what is no time, or has not come yet, is now.
    pub time: String,
}

/// One change of an act.
#[derive(Debug, Clone, Copy)]
struct Part<'a> {
    frame: &'a FrameId,
    change: &'a Change,
    judged: &'a Judged,
    /// When, where that is not now.
    time_ms: Option<i64>,
}

/// The label of a frame and when it was given.
#[derive(Debug)]
struct Held {
    label: Label,
    stamp: Stamp,
}

/// A file in which the annotator may have records.
#[derive(Debug)]
struct Source {
    tail: Tail,
    folder: usize,
    /// True where it speaks for the annotator.
    own: bool,
}

/// The journal of one annotator in one place.
#[derive(Debug)]
pub struct Journal {
    annotator: String,
    dataset: String,
    place: LabelPlace,
    /// The file that is written, then all others of the place.
    sources: Vec<Source>,
    held: HashMap<String, Held>,
    unlocked: Option<String>,
}

impl Journal {
    /// Reads what `annotator` has said so far. The file is made by the first act.
    ///
    /// # Errors
    /// For an empty name; where the file cannot be read, is of a newer version or is no journal.
    pub fn open(place: &LabelPlace, annotator: &str, dataset: &str) -> Result<Self, LabelError> {
        let annotator = annotator.trim();
        if annotator.is_empty() {
            return Err(LabelError::NoAnnotator { path: place.folder.clone() });
        }
        let home = Tail::new(place.folder.join(file_name(annotator)));
        let mut journal = Self {
            annotator: annotator.to_owned(),
            dataset: dataset.to_owned(),
            place: place.clone(),
            sources: vec![Source { tail: home, folder: 0, own: true }],
            held: HashMap::new(),
            unlocked: None,
        };
        journal.catch_up(None)?;
        Ok(journal)
    }

    /// Who.
    pub fn annotator(&self) -> &str {
        &self.annotator
    }

    /// The file that is written.
    pub fn path(&self) -> &Path {
        self.sources.first().map_or(Path::new(""), |home| home.tail.path())
    }

    /// The label of the frame of this name, as of the last act of this journal.
    pub fn label(&self, frame: &str) -> Option<&Label> {
        self.held.get(frame).map(|held| &held.label)
    }

    /// What is wrong with the annotator's own files without being an error: damaged lines, a file system without locks.
    pub fn warnings(&self) -> Vec<String> {
        let own = self.sources.iter().filter(|source| source.own);
        own.flat_map(|source| source.tail.warnings()).chain(self.unlocked.clone()).collect()
    }

    /// Applies each change to the newest label of its frame, and returns when the records are on disk. Frames whose label
    /// does not change get no record and no outcome, unless only another annotator's file says it.
    ///
    /// # Errors
    /// Where the file cannot be read or written. Nothing of the act is then to be shown as done; what was written of it is
    /// taken back as far as the disk allows.
    pub fn commit(
        &mut self,
        act: &str,
        changes: &[(FrameId, Change)],
        judged: &Judged,
    ) -> Result<Vec<Outcome>, LabelError> {
        let parts = changes.iter().map(|(frame, change)| Part { frame, change, judged, time_ms: None });
        self.commit_parts(act, &parts.collect::<Vec<_>>())
    }

    /// As [`Self::commit`], where each frame was judged on a fit of its own.
    ///
    /// # Errors
    /// As [`Self::commit`].
    pub fn commit_each(
        &mut self,
        act: &str,
        changes: &[(FrameId, Change, Judged)],
    ) -> Result<Vec<Outcome>, LabelError> {
        let parts = changes.iter().map(|(frame, change, judged)| Part { frame, change, judged, time_ms: None });
        self.commit_parts(act, &parts.collect::<Vec<_>>())
    }

    /// As [`Self::commit`], for changes that were made elsewhere: each record keeps when it was said and what was judged.
    ///
    /// # Errors
    /// As [`Self::commit`].
    pub fn bring(&mut self, act: &str, said: &[SaidElsewhere]) -> Result<Vec<Outcome>, LabelError> {
        let now = now_ms();
        let parts = said.iter().map(|SaidElsewhere { frame, change, judged, time }| {
            let time_ms = Some(time_ms(time)).filter(|&time| time > i64::MIN && !is_ahead(time, now));
            Part { frame, change, judged, time_ms }
        });
        self.commit_parts(act, &parts.collect::<Vec<_>>())
    }

    fn commit_parts(&mut self, act: &str, parts: &[Part<'_>]) -> Result<Vec<Outcome>, LabelError> {
        if parts.iter().all(|part| *part.change == Change::default()) {
            return Ok(Vec::new());
        }
        let file = self.lock()?;
        self.catch_up(Some(&file))?;
        let outcomes = self.outcomes(act, parts);
        self.append(&file, &outcomes)?;
        self.catch_up(Some(&file))?;
        // Closing the file gives the lock back; so does the end of the process, whatever ends it.
        Ok(outcomes)
    }

    /// Opens the file for appending and waits for its lock.
    fn lock(&mut self) -> Result<File, LabelError> {
        let path = self.path().to_owned();
        let failed = |reason| LabelError::Write { reason, path: path.clone() };
        for _ in 0..TRIES {
            let file = open_to_append(&path)?;
            if let Err(reason) = wait_for_lock(&file) {
                self.without_locks(&reason);
            }
            // Between opening and locking, another process may have put another file there.
            if is_named(&file, &path).map_err(failed)? {
                return Ok(file);
            }
        }
        Err(failed(std::io::Error::other("another program replaces it again and again")))
    }

    fn without_locks(&mut self, reason: &std::io::Error) {
        let path = self.path().display();
        let warning = format!(
            "{path}: no locks on this file system ({reason}): records are appended whole, but two windows that label \
             the same frame at the same moment may overwrite each other"
        );
        if self.unlocked.is_none() {
            tracing::warn!("{warning}");
        }
        self.unlocked = Some(warning);
    }

    /// Folds in what was appended since the last look; `home` is the file that is written, where it is open.
    fn catch_up(&mut self, home: Option<&File>) -> Result<(), LabelError> {
        for _ in 0..TRIES {
            if !self.look(home)? {
                return Ok(());
            }
            tracing::warn!("{}: another file lies there now; it is read anew", self.path().display());
            self.held.clear();
            self.sources.iter_mut().for_each(|source| source.tail.reset());
        }
        let reason = std::io::Error::other("another program replaces it again and again");
        Err(LabelError::Read { reason, path: self.path().to_owned() })
    }

    /// Finds files that are new. A folder that cannot be listed must not keep anybody from labelling; who reads the labels
    /// is told of it.
    fn find(&mut self) {
        let name = file_name(&self.annotator);
        for (folder, path) in self.place.folders().enumerate() {
            for file in journals_in(path).unwrap_or_default() {
                if !self.sources.iter().any(|source| source.tail.path() == file) {
                    let own = file.file_name().is_some_and(|found| *found == *name);
                    self.sources.push(Source { tail: Tail::new(file), folder, own });
                }
            }
        }
    }

    /// True where a file was replaced.
    fn look(&mut self, home: Option<&File>) -> Result<bool, LabelError> {
        self.find();
        let Self { sources, held, annotator, .. } = self;
        for (file, Source { tail, folder, own }) in sources.iter_mut().enumerate() {
            let sink = |_, record: Box<Record>| {
                if record.annotator == *annotator {
                    let stamp = Stamp { own: *own, order_ms: order_ms(&record), folder: *folder, file };
                    fold(held, stamp, *record);
                }
            };
            let found = match home {
                Some(home) if file == 0 => tail.look_in(home, sink),
                Some(_) | None if file == 0 => tail.look(sink),
                // What lies where nothing is written, and cannot be read, must not keep anybody from labelling.
                _ => tail.look(sink).or_else(|error| match error {
                    LabelError::Newer { .. } if *own => Err(error),
                    _ => Ok(Found::Same),
                }),
            };
            if found? == Found::Replaced {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn outcomes(&self, act: &str, parts: &[Part<'_>]) -> Vec<Outcome> {
        // One time for all of an act; what was said elsewhere keeps its own.
        let now = now_ms();
        let mut latest: HashMap<&str, Label> = HashMap::new();
        let mut outcomes = Vec::with_capacity(parts.len());
        for part in parts {
            let Part { frame, change, judged, time_ms } = *part;
            let held = || self.label(&frame.path).cloned().unwrap_or_default();
            let before = latest.get(frame.path.as_str()).cloned().unwrap_or_else(held);
            let label = change.applied(&before);
            // What only a file of somebody else says is written here too: that file may go.
            let ours = self.held.get(&frame.path).is_none_or(|held| held.stamp.own);
            if label == before && ours {
                continue;
            }
            latest.insert(&frame.path, label.clone());
            let mut judged = judged.clone();
            // JSON has no other numbers.
            judged.machine.retain(|_, score| score.is_finite());
            let time_ms = time_ms.unwrap_or(now);
            let after = Record {
                dataset: self.dataset.clone(),
                frame: frame.clone(),
                label,
                annotator: self.annotator.clone(),
                time: time_text(time_ms),
                after: self.order_elsewhere(frame).filter(|&order| order >= time_ms),
                act: act.to_owned(),
                program: PROGRAM.to_owned(),
                judged,
            };
            outcomes.push(Outcome { frame: frame.clone(), before, after });
        }
        outcomes
    }

    /// The order of a frame's newest record where that lies in another file; in this one the lines decide.
    fn order_elsewhere(&self, frame: &FrameId) -> Option<i64> {
        let stamp = self.held.get(&frame.path)?.stamp;
        (stamp.file != 0).then_some(stamp.order_ms)
    }

    fn append(&self, mut file: &File, outcomes: &[Outcome]) -> Result<(), LabelError> {
        let failed = |reason| LabelError::Write { reason, path: self.path().to_owned() };
        let len = file.metadata().map_err(failed)?.len();
        let bytes = self.bytes(file, len, outcomes).map_err(failed)?;
        // Also without a record of ours: a label that is there already counts only once it is on disk.
        let written = file.write_all(&bytes).and_then(|()| file.sync_data());
        if let Err(reason) = written {
            if self.unlocked.is_none() {
                // A full disk takes half an act. That half must not be found later: nobody was shown it.
                let _ = file.set_len(len);
            }
            return Err(failed(reason));
        }
        if len == 0 {
            sync_names(self.path());
        }
        Ok(())
    }

    /// What has to be appended to a file of `len` bytes.
    fn bytes(&self, file: &File, len: u64, outcomes: &[Outcome]) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::with_capacity(outcomes.len() * 512);
        if outcomes.is_empty() {
            return Ok(bytes);
        }
        if len > 0 && last_byte(file, len)? != b'\n' {
            bytes.push(b'\n');
        }
        if !self.sources.first().is_some_and(|home| home.tail.has_header()) {
            write_header(&mut bytes, &self.annotator, &self.dataset)?;
        }
        outcomes.iter().try_for_each(|outcome| write_record(&mut bytes, &outcome.after))?;
        Ok(bytes)
    }
}

fn fold(held: &mut HashMap<String, Held>, stamp: Stamp, record: Record) {
    let newest = held.get(&record.frame.path).map(|held| held.stamp);
    if let Some(stamp) = stamp.newer_than(newest) {
        held.insert(record.frame.path, Held { label: record.label, stamp });
    }
}

/// Waits without end: who holds the lock writes a few records and lets go, and the system lets go for the dead.
fn wait_for_lock(file: &File) -> std::io::Result<()> {
    loop {
        match file.lock() {
            Err(reason) if reason.kind() == ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}

fn last_byte(mut file: &File, len: u64) -> std::io::Result<u8> {
    let mut byte = [0];
    file.seek(SeekFrom::Start(len - 1))?;
    file.read_exact(&mut byte)?;
    Ok(byte[0])
}

/// Puts the names of a new file and of its folder on disk. Not every system can; the records themselves are there.
fn sync_names(path: &Path) {
    for folder in path.ancestors().skip(1).take(2) {
        if let Err(reason) = File::open(folder).and_then(|folder| folder.sync_all()) {
            tracing::debug!("{}: {reason}", folder.display());
        }
    }
}
