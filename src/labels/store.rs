//! What everybody said: all journals of a place, followed as they grow.
//!
//! The newest record of each frame is held, and of the others only where they lie, so that a long history costs little.

use super::file::open_to_read;
use super::format::{JournalLine, is_ahead, now_ms, order_ms, parse, time_ms};
use super::place::{ENDING, file_name};
use super::stamp::{Stamp, in_lines_order};
use super::tail::{Found, Span, Tail};
use super::{LabelError, LabelPlace, Record};
use std::collections::{BTreeMap, HashMap};
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
    /// Who has records in it.
    voices: BTreeMap<String, Voice>,
}

/// One annotator's records in one file.
#[derive(Debug, Default)]
struct Voice {
    /// True where the file speaks for them.
    own: bool,
    records: usize,
}

impl Source {
    fn new(path: PathBuf, folder: usize) -> Self {
        Self { tail: Tail::new(path), folder, refused: None, voices: BTreeMap::new() }
    }

    /// In words, what is in the file and does not belong there.
    fn others(&self) -> impl Iterator<Item = String> {
        let others = self.voices.iter().filter(|(_, voice)| !voice.own);
        others.map(|(name, voice)| {
            let records = if voice.records == 1 { "1 record".into() } else { format!("{} records", voice.records) };
            format!(
                "{}: {records} by `{name}`, for whom only {} speaks: they count where that file says nothing of a frame",
                self.tail.path().display(),
                file_name(name)
            )
        })
    }
}

/// Where a record lies, and the number of the one before it of the same frame.
#[derive(Debug)]
struct LineAt {
    stamp: Stamp,
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
    /// True where its time has not come yet.
    ahead: bool,
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
    /// Which labels have a time that has not come yet, in words.
    ahead: Vec<String>,
    warnings: Vec<String>,
}

impl LabelStore {
    /// Reads every journal of a place. A file that cannot be read, is of a newer version or is no journal is a warning: it
    /// must not hide what the others say.
    ///
    /// # Errors
    /// Where the folder is there and cannot be listed.
    pub fn read(place: &LabelPlace) -> Result<Self, LabelError> {
        let mut store = Self::unread(place);
        store.refresh()?;
        Ok(store)
    }

    /// As [`Self::read`]; gives every record to `acts`, file by file.
    pub(super) fn read_with(place: &LabelPlace, acts: &mut Vec<(Stamp, Record)>) -> Result<Self, LabelError> {
        let mut store = Self::unread(place);
        store.catch_up(Some(acts))?;
        Ok(store)
    }

    fn unread(place: &LabelPlace) -> Self {
        let (people, place) = (BTreeMap::new(), place.clone());
        Self { place, sources: Vec::new(), people, lines: Vec::new(), ahead: Vec::new(), warnings: Vec::new() }
    }

    /// Reads what was appended since, and files that are new; true where anything changed. With nothing new it costs one
    /// listing and one `stat` a journal.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn refresh(&mut self) -> Result<bool, LabelError> {
        self.catch_up(None)
    }

    fn catch_up(&mut self, mut acts: Option<&mut Vec<(Stamp, Record)>>) -> Result<bool, LabelError> {
        let mut changed = false;
        for _ in 0..TRIES {
            let unlisted = self.find()?;
            match self.look(acts.as_deref_mut()) {
                Found::Replaced => {
                    self.forget();
                    if let Some(acts) = acts.as_deref_mut() {
                        acts.clear();
                    }
                }
                found => {
                    changed |= found == Found::More;
                    if changed {
                        self.ahead = self.dated_ahead().collect();
                    }
                    let warnings = self.told(unlisted);
                    changed |= warnings != self.warnings;
                    self.warnings = warnings;
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

    /// True where the newest record of a frame is in a file that speaks for its annotator.
    pub fn is_own(&self, annotator: &str, frame: &str) -> bool {
        self.people.get(annotator).and_then(|person| person.frames.get(frame)).is_some_and(|slot| slot.stamp.own)
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
        let mut records: Vec<(Stamp, Record)> = Vec::new();
        while let Some(line) = next.and_then(|line| self.lines.get(line as usize)) {
            let record = self.read_line(line)?.filter(|record| record.frame.path == frame);
            records.extend(record.map(|record| (line.stamp, record)));
            next = line.before;
        }
        records.reverse();
        in_lines_order(&mut records);
        records.sort_by_key(|(stamp, _)| stamp.rank());
        Ok(records.into_iter().map(|(_, record)| record).collect())
    }

    /// What had to be skipped, which files speak for others, and what is dated in the future, in words that name the file.
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
                    self.sources.push(Source::new(file, folder));
                }
            }
        }
        Ok(unlisted)
    }

    fn look(&mut self, mut acts: Option<&mut Vec<(Stamp, Record)>>) -> Found {
        let Self { sources, people, lines, .. } = self;
        let (mut all, now) = (Found::Same, now_ms());
        for (file, source) in sources.iter_mut().enumerate() {
            let Source { tail, folder, refused, voices } = source;
            let (folder, name) = (*folder, tail.path().file_name().unwrap_or_default().to_owned());
            let found = tail.look(|span, record| {
                if !voices.contains_key(&record.annotator) {
                    let own = *name == *file_name(&record.annotator);
                    voices.insert(record.annotator.clone(), Voice { own, records: 0 });
                }
                let own = voices.get_mut(&record.annotator).is_some_and(|voice| {
                    voice.records += 1;
                    voice.own
                });
                let stamp = Stamp { own, order_ms: order_ms(&record), folder, file };
                if let Some(acts) = &mut acts {
                    acts.push((stamp, (*record).clone()));
                }
                fold(people, lines, &Place { span, stamp, now }, record);
            });
            *refused = found.as_ref().err().map(ToString::to_string);
            match found {
                Ok(Found::Replaced) => return Found::Replaced,
                Ok(Found::More) => all = Found::More,
                Ok(Found::Same) | Err(_) => {}
            }
        }
        all
    }

    /// `unlisted`, and what else is to be told.
    fn told(&self, mut unlisted: Vec<String>) -> Vec<String> {
        unlisted.extend(self.sources.iter().filter_map(|source| source.refused.clone()));
        unlisted.extend(self.sources.iter().flat_map(|source| source.tail.warnings()));
        unlisted.extend(self.sources.iter().flat_map(Source::others));
        unlisted.extend_from_slice(&self.ahead);
        unlisted.extend(self.alike());
        unlisted
    }

    /// In words, whose names differ only by upper and lower case.
    fn alike(&self) -> impl Iterator<Item = String> {
        let mut names: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for name in self.people.keys() {
            names.entry(name.to_lowercase()).or_default().push(format!("`{name}`"));
        }
        let folder = self.place.folder.display().to_string();
        names.into_values().filter(|names| names.len() > 1).map(move |names| {
            format!("{folder}: {} are different annotators, though only the case differs", names.join(" and "))
        })
    }

    /// In words, which labels have a time that has not come yet.
    fn dated_ahead(&self) -> impl Iterator<Item = String> {
        let mut ahead: BTreeMap<(usize, &str), (usize, &str)> = BTreeMap::new();
        for (name, person) in &self.people {
            for slot in person.frames.values().filter(|slot| slot.ahead) {
                let (labels, latest) = ahead.entry((slot.stamp.file, name)).or_insert((0, ""));
                *labels += 1;
                *latest = (*latest).max(&slot.record.time);
            }
        }
        let told = |((file, name), (labels, latest)): ((usize, &str), (usize, &str))| {
            let path = self.sources.get(file).map_or(Path::new(""), |source| source.tail.path()).display();
            let dated = if labels == 1 { "1 label".into() } else { format!("{labels} labels") };
            format!(
                "{path}: {dated} by `{name}` dated in the future, as late as {latest}: a clock was wrong; what is tagged now \
                 counts as later all the same"
            )
        };
        ahead.into_iter().map(told)
    }

    fn forget(&mut self) {
        self.sources.clear();
        self.people.clear();
        self.lines.clear();
    }

    fn read_line(&self, line: &LineAt) -> Result<Option<Record>, LabelError> {
        let Some(source) = self.sources.get(line.stamp.file) else { return Ok(None) };
        let path = source.tail.path();
        let (mut file, mut bytes) = (open_to_read(path)?, Vec::new());
        let read = file.seek(SeekFrom::Start(line.span.offset));
        let read = read.and_then(|_| file.take(u64::from(line.span.len)).read_to_end(&mut bytes));
        read.map_err(|reason| LabelError::Read { reason, path: path.to_owned() })?;
        Ok(match parse(&bytes, path)? {
            JournalLine::Record(record) => Some(*record),
            _ => None,
        })
    }
}

/// Of a record that is read at the time `now`, milliseconds since 1970.
struct Place {
    span: Span,
    stamp: Stamp,
    now: i64,
}

fn fold(people: &mut BTreeMap<String, Person>, lines: &mut Vec<LineAt>, place: &Place, record: Box<Record>) {
    let &Place { span, stamp, now } = place;
    if !people.contains_key(&record.annotator) {
        people.insert(record.annotator.clone(), Person::default());
    }
    let Some(person) = people.get_mut(&record.annotator) else { return };
    let number = lines.len() as u32;
    let written_ms = time_ms(&record.time);
    let ahead = is_ahead(written_ms, now);
    // What was labelled last is asked of the clocks, as far as they can be believed.
    let written = Stamp { order_ms: if ahead { i64::MIN } else { written_ms }, ..stamp };
    if let Some(written) = written.newer_than(person.last.as_ref().map(|last| last.0)) {
        person.last = Some((written, record.frame.path.clone()));
    }
    let slot = person.frames.get_mut(&record.frame.path);
    lines.push(LineAt { stamp, span, before: slot.as_ref().map(|slot| slot.last_line) });
    let Some(slot) = slot else {
        let (path, record) = (record.frame.path.clone(), Arc::from(record));
        person.frames.insert(path, Slot { record, stamp, last_line: number, ahead });
        return;
    };
    slot.last_line = number;
    if let Some(stamp) = stamp.newer_than(Some(slot.stamp)) {
        (slot.record, slot.stamp, slot.ahead) = (Arc::from(record), stamp, ahead);
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
    let (mut people, mut lines, now) = (BTreeMap::new(), Vec::new(), now_ms());
    let mut tail = Tail::new(path.to_owned());
    let file = open_to_read(path)?;
    tail.look_in(&file, |span, record| {
        let stamp = Stamp { own: true, order_ms: order_ms(&record), folder: 0, file: 0 };
        fold(&mut people, &mut lines, &Place { span, stamp, now }, record);
    })?;
    tail.warnings().for_each(|warning| tracing::warn!("{warning}"));
    let people: BTreeMap<String, Person> = people;
    let slots = people.into_values().flat_map(|person| person.frames.into_values());
    let mut records: Vec<Record> = slots.map(|slot| Arc::unwrap_or_clone(slot.record)).collect();
    records.sort_unstable_by(in_frame_order);
    Ok(records)
}
