//! What everybody said: all journals of a place, followed as they grow.
//!
//! The newest record of each frame is held, and of the others only where they lie, so that a long history costs little.

use super::format::{Line, parse, time_ms};
use super::place::ENDING;
use super::stamp::Stamp;
use super::tail::{Found, Span, Tail};
use super::{LabelError, LabelPlace, Record};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How often files that are replaced while they are read are begun anew.
const TRIES: usize = 100;

/// One journal.
#[derive(Debug)]
struct Source {
    tail: Tail,
    folder: usize,
    refused: Option<String>,
}

/// Where a record lies, and the number of the one before it of the same frame.
#[derive(Debug)]
struct LineAt {
    file: u32,
    span: Span,
    before: Option<u32>,
}

/// The newest record of a frame.
#[derive(Debug)]
struct Slot {
    /// Shared with whoever shows it.
    record: Arc<Record>,
    stamp: Stamp,
    last_line: u32,
}

/// One annotator.
#[derive(Debug, Default)]
struct Person {
    frames: HashMap<String, Slot>,
    last: Option<(Stamp, String)>,
}

/// The labels of all annotators of a place.
#[derive(Debug)]
pub struct LabelStore {
    place: LabelPlace,
    sources: Vec<Source>,
    people: BTreeMap<String, Person>,
    lines: Vec<LineAt>,
    warnings: Vec<String>,
}

impl LabelStore {
    /// Reads every journal of a place. A file that cannot be read, is of a newer version or is no journal is a warning: it
    /// must not hide what the others say.
    ///
    /// # Errors
    /// Where the folder is there and cannot be listed.
    pub fn read(place: &LabelPlace) -> Result<Self, LabelError> {
        let mut store = Self {
            place: place.clone(),
            sources: Vec::new(),
            people: BTreeMap::new(),
            lines: Vec::new(),
            warnings: Vec::new(),
        };
        store.refresh()?;
        Ok(store)
    }

    /// Reads what was appended since, and files that are new; true where anything changed. With nothing new it costs one
    /// listing and one `stat` a journal.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn refresh(&mut self) -> Result<bool, LabelError> {
        let mut changed = false;
        for _ in 0..TRIES {
            let mut unlisted = self.find()?;
            match self.look() {
                Found::Replaced => self.forget(),
                found => {
                    changed |= found == Found::More;
                    unlisted.extend(self.sources.iter().filter_map(|source| source.refused.clone()));
                    unlisted.extend(self.sources.iter().flat_map(|source| source.tail.warnings()));
                    changed |= unlisted != self.warnings;
                    self.warnings = unlisted;
                    return Ok(changed);
                }
            }
            changed = true;
        }
        let reason = std::io::Error::other("another program replaces its files again and again");
        Err(LabelError::Read { reason, path: self.place.folder.clone() })
    }

    /// Number of records that were read, the older ones of a frame too.
    pub fn lines(&self) -> usize {
        self.lines.len()
    }

    /// Where the labels lie.
    pub fn place(&self) -> &LabelPlace {
        &self.place
    }

    /// Everybody who said something, in the order of their names.
    pub fn annotators(&self) -> impl Iterator<Item = &str> {
        self.people.keys().map(String::as_str)
    }

    /// The newest record of the frame of this name; its label may be empty, where everything was taken back.
    pub fn label(&self, annotator: &str, frame: &str) -> Option<&Record> {
        Some(&self.people.get(annotator)?.frames.get(frame)?.record)
    }

    /// The newest record of each frame, in the order of frames: by index, then by name. Some labels may be empty.
    pub fn records(&self, annotator: &str) -> impl Iterator<Item = &Record> {
        let frames = self.people.get(annotator).into_iter().flat_map(|person| person.frames.values());
        let mut records: Vec<&Record> = frames.map(|slot| &*slot.record).collect();
        records.sort_unstable_by(|a, b| in_frame_order(a, b));
        records.into_iter()
    }

    /// As [`Self::label`], to be kept.
    pub fn shared(&self, annotator: &str, frame: &str) -> Option<&Arc<Record>> {
        Some(&self.people.get(annotator)?.frames.get(frame)?.record)
    }

    /// The newest record of each frame, to be kept, in no order.
    pub fn shared_records(&self, annotator: &str) -> impl Iterator<Item = &Arc<Record>> {
        let person = self.people.get(annotator);
        person.into_iter().flat_map(|person| person.frames.values()).map(|slot| &slot.record)
    }

    /// The record that an annotator wrote last.
    pub fn last_edited(&self, annotator: &str) -> Option<&Record> {
        let (_, frame) = self.people.get(annotator)?.last.as_ref()?;
        self.label(annotator, frame)
    }

    /// Every record of a frame, the oldest first, read from the files.
    ///
    /// # Errors
    /// Where a file cannot be read. One that was replaced since the last refresh gives what still is a record there.
    pub fn history(&self, annotator: &str, frame: &str) -> Result<Vec<Record>, LabelError> {
        let slot = self.people.get(annotator).and_then(|person| person.frames.get(frame));
        let mut next = slot.map(|slot| slot.last_line);
        let mut records = Vec::new();
        while let Some(line) = next.and_then(|line| self.lines.get(line as usize)) {
            records.extend(self.read_line(line)?.filter(|record| record.frame.path == frame));
            next = line.before;
        }
        records.reverse();
        records.sort_by_key(|record| time_ms(&record.time));
        Ok(records)
    }

    /// What had to be skipped, in words that name file and line.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Lists the folders; gives what could not be listed.
    fn find(&mut self) -> Result<Vec<String>, LabelError> {
        let mut unlisted = Vec::new();
        let folders: Vec<PathBuf> = self.place.folders().map(Path::to_owned).collect();
        for (folder, path) in folders.iter().enumerate() {
            let files = match journals_in(path) {
                Ok(files) => files,
                Err(reason) if folder == 0 => return Err(LabelError::Read { reason, path: path.clone() }),
                // A file in the place of the folder: that is why the labels lie elsewhere.
                Err(reason) if reason.kind() == ErrorKind::NotADirectory => Vec::new(),
                Err(reason) => {
                    unlisted.push(format!("{}: labels cannot be read: {reason}", path.display()));
                    Vec::new()
                }
            };
            for file in files {
                if !self.sources.iter().any(|source| source.tail.path() == file) {
                    self.sources.push(Source { tail: Tail::new(file), folder, refused: None });
                }
            }
        }
        Ok(unlisted)
    }

    fn look(&mut self) -> Found {
        let Self { sources, people, lines, .. } = self;
        let mut all = Found::Same;
        for (file, source) in sources.iter_mut().enumerate() {
            let folder = source.folder;
            let found = source.tail.look(|span, record| {
                let stamp = Stamp { time_ms: time_ms(&record.time), folder, file };
                fold(people, lines, span, stamp, record);
            });
            source.refused = found.as_ref().err().map(ToString::to_string);
            match found {
                Ok(Found::Replaced) => return Found::Replaced,
                Ok(Found::More) => all = Found::More,
                Ok(Found::Same) | Err(_) => {}
            }
        }
        all
    }

    fn forget(&mut self) {
        self.sources.clear();
        self.people.clear();
        self.lines.clear();
    }

    fn read_line(&self, line: &LineAt) -> Result<Option<Record>, LabelError> {
        let Some(source) = self.sources.get(line.file as usize) else { return Ok(None) };
        let path = source.tail.path();
        let mut bytes = Vec::new();
        let read = File::open(path).and_then(|mut file| {
            file.seek(SeekFrom::Start(line.span.offset))?;
            file.take(u64::from(line.span.len)).read_to_end(&mut bytes)
        });
        read.map_err(|reason| LabelError::Read { reason, path: path.to_owned() })?;
        Ok(match parse(&bytes, path)? {
            Line::Record(record) => Some(*record),
            _ => None,
        })
    }
}

fn fold(people: &mut BTreeMap<String, Person>, lines: &mut Vec<LineAt>, span: Span, stamp: Stamp, record: Box<Record>) {
    if !people.contains_key(&record.annotator) {
        people.insert(record.annotator.clone(), Person::default());
    }
    let Some(person) = people.get_mut(&record.annotator) else { return };
    let number = lines.len() as u32;
    let slot = person.frames.get_mut(&record.frame.path);
    lines.push(LineAt { file: stamp.file as u32, span, before: slot.as_ref().map(|slot| slot.last_line) });
    if let Some(stamp) = stamp.newer_than(person.last.as_ref().map(|last| last.0)) {
        person.last = Some((stamp, record.frame.path.clone()));
    }
    let Some(slot) = slot else {
        let (path, record) = (record.frame.path.clone(), Arc::from(record));
        person.frames.insert(path, Slot { record, stamp, last_line: number });
        return;
    };
    slot.last_line = number;
    if let Some(stamp) = stamp.newer_than(Some(slot.stamp)) {
        (slot.record, slot.stamp) = (Arc::from(record), stamp);
    }
}

/// The journals in a folder, in the order of their names; none where there is no folder.
pub(super) fn journals_in(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let entries = match std::fs::read_dir(folder) {
        Err(reason) if reason.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut files = entries.map(|entry| entry.map(|entry| entry.path())).collect::<std::io::Result<Vec<_>>>()?;
    files.retain(|file| file.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING)));
    files.sort();
    Ok(files)
}

fn in_frame_order(a: &Record, b: &Record) -> std::cmp::Ordering {
    (a.frame.index, &a.frame.path, &a.annotator).cmp(&(b.frame.index, &b.frame.path, &b.annotator))
}

/// The newest record of each frame of one journal, in the order of frames: by index, then by name. A file in which several
/// annotators were joined gives one a frame and annotator. Damaged lines are skipped and logged.
///
/// # Errors
/// Where the file cannot be read, is of a newer version or is no journal.
pub fn read_journal(path: &Path) -> Result<Vec<Record>, LabelError> {
    let (mut people, mut lines) = (BTreeMap::new(), Vec::new());
    let mut tail = Tail::new(path.to_owned());
    let file = File::open(path).map_err(|reason| LabelError::Read { reason, path: path.to_owned() })?;
    tail.look_in(&file, |span, record| {
        let stamp = Stamp { time_ms: time_ms(&record.time), folder: 0, file: 0 };
        fold(&mut people, &mut lines, span, stamp, record);
    })?;
    tail.warnings().for_each(|warning| tracing::warn!("{warning}"));
    let people: BTreeMap<String, Person> = people;
    let slots = people.into_values().flat_map(|person| person.frames.into_values());
    let mut records: Vec<Record> = slots.map(|slot| Arc::unwrap_or_clone(slot.record)).collect();
    records.sort_unstable_by(in_frame_order);
    Ok(records)
}
