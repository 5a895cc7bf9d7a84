//! The thread that keeps the journals: an act is written there, so that a slow disk never holds the window up, and is shown
//! only when the answer is back.

use super::Wake;
use crate::dataset::Dataset;
use crate::labels::{Change, FrameId, Journal, Judged, LabelError, LabelPlace, LabelStore, Record};
use crate::session::acts::{Changes, Done};
use crate::session::effect::Commit;
use crate::session::labels::LabelTable;
use crate::session::records::Records;
use crate::session::report::{OpenedLabels, Report, Written};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TrySendError, bounded, unbounded};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Acts that may wait to be written.
const WAITING: usize = 256;
/// How long nobody looks at what others write into the same folder.
const LOOK_EVERY: Duration = Duration::from_secs(1);

enum Request {
    Open(u64, Arc<Dataset>, String),
    Commit(Commit),
    Refresh,
}

/// The window's end.
pub(super) struct LabelKeeper {
    /// `None` once it is being dropped.
    requests: Option<Sender<Request>>,
    thread: Option<JoinHandle<()>>,
    answers: Receiver<Report>,
    told: Sender<Report>,
    wake: Wake,
}

impl LabelKeeper {
    /// Starts the thread `labels`. Dropping the keeper waits until the acts that were asked for are written.
    pub(super) fn start(wake: &Wake) -> Self {
        let (requests, inbox) = bounded(WAITING);
        let (told, answers) = unbounded();
        let (answer, waker) = (told.clone(), Arc::clone(wake));
        let spawned = std::thread::Builder::new().name("labels".into()).spawn(move || {
            let mut keeper = Keeper::default();
            while let Some(request) = keeper.next(&inbox) {
                for report in keeper.answer(request) {
                    if answer.send(report).is_err() {
                        return;
                    }
                    waker();
                }
            }
        });
        let thread = spawned.inspect_err(|reason| tracing::error!("no thread for labels: {reason}")).ok();
        Self { requests: Some(requests), thread, answers, told, wake: Arc::clone(wake) }
    }

    pub(super) fn open(&self, id: u64, dataset: Arc<Dataset>, annotator: String) {
        if self.ask(Request::Open(id, dataset, annotator)).is_some() {
            self.tell(Report::LabelsOpened(id, Err("the thread that keeps labels does not answer".into())));
        }
    }

    pub(super) fn commit(&self, commit: Commit) {
        if let Some(Request::Commit(Commit { id, kind, act, .. })) = self.ask(Request::Commit(commit)) {
            let result = Err("the disk does not keep up with the acts before it".into());
            self.tell(Report::LabelsWritten(Written { id, kind, act, result }));
        }
    }

    /// What others wrote is looked for when there is time.
    pub(super) fn refresh(&self) {
        let _ = self.ask(Request::Refresh);
    }

    /// Gives back what the thread cannot take.
    fn ask(&self, request: Request) -> Option<Request> {
        let Some(requests) = &self.requests else { return Some(request) };
        match requests.try_send(request) {
            Ok(()) => None,
            Err(TrySendError::Full(request) | TrySendError::Disconnected(request)) => Some(request),
        }
    }

    pub(super) fn poll(&self) -> Option<Report> {
        self.answers.try_recv().ok()
    }

    fn tell(&self, report: Report) {
        // The other end is held by this very keeper.
        let _ = self.told.send(report);
        (self.wake)();
    }
}

impl Drop for LabelKeeper {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // A panic there is not one here.
            let _ = thread.join();
        }
    }
}

/// The thread's end.
#[derive(Default)]
struct Keeper {
    open: Option<Open>,
}

struct Open {
    dataset: Arc<Dataset>,
    /// True once it was tried where can be written: a data set that is only looked at stays as it is.
    tried: bool,
    journal: Journal,
    store: LabelStore,
    /// What the window was told of the files.
    warned: BTreeSet<String>,
    /// What others wrote came in with an act of our own and is still to be told.
    unseen: bool,
    /// Frames by name; made when a record's index is not that of its name.
    names: Option<HashMap<String, usize>>,
}

impl Keeper {
    /// What is to be done next: what is asked for, or, where nothing is for a while and a journal is open, a look at what others
    /// wrote. `None` once nobody asks any more.
    fn next(&self, inbox: &Receiver<Request>) -> Option<Request> {
        if self.open.is_none() {
            return inbox.recv().ok();
        }
        match inbox.recv_timeout(LOOK_EVERY) {
            Err(RecvTimeoutError::Timeout) => Some(Request::Refresh),
            asked => asked.ok(),
        }
    }

    fn answer(&mut self, request: Request) -> Vec<Report> {
        match request {
            Request::Open(id, dataset, annotator) => {
                self.open = None;
                vec![Report::LabelsOpened(id, self.begin(dataset, &annotator))]
            }
            Request::Commit(commit) => {
                let tried = self.open.as_ref().is_some_and(|open| open.tried);
                let result = match &mut self.open {
                    Some(open) => open.commit(&commit),
                    None => Err("the journal is not open".into()),
                };
                let Commit { id, kind, act, .. } = commit;
                let mut answers = vec![Report::LabelsWritten(Written { id, kind, act, result })];
                let open = self.open.as_ref().filter(|open| open.tried && !tried);
                answers.extend(open.map(|open| Report::LabelsPlaced(open.store.place().clone())));
                answers
            }
            Request::Refresh => self.open.as_mut().map_or_else(Vec::new, Open::refresh),
        }
    }

    fn begin(&mut self, dataset: Arc<Dataset>, annotator: &str) -> Result<Box<OpenedLabels>, String> {
        let place = LabelPlace::to_read(&dataset.info().root, dataset.fingerprint());
        let journal = Journal::open(&place, annotator, dataset.fingerprint()).map_err(|error| error.to_string())?;
        let store = LabelStore::read(&place).map_err(|error| error.to_string())?;
        let warned = store.warnings().iter().cloned().collect();
        let mut open = Open { dataset, tried: false, journal, store, warned, unseen: false, names: None };
        let table = open.table();
        let last_edited = open.store.last_edited(annotator.trim()).map(|record| record.frame.clone());
        let last_edited = last_edited.and_then(|frame| open.index(&frame));
        let mut warnings = open.store.warnings().to_vec();
        warnings.extend(open.unknown());
        self.open = Some(open);
        Ok(Box::new(OpenedLabels { place, table, last_edited, warnings }))
    }
}

impl Open {
    /// What others wrote, and what is to be told of it.
    fn refresh(&mut self) -> Vec<Report> {
        let news = self.store.refresh().map(|more| more | std::mem::take(&mut self.unseen));
        let news = news.inspect_err(|error| tracing::warn!("{error}"));
        if !news.is_ok_and(|news| news) {
            return Vec::new();
        }
        let new: Vec<String> =
            self.store.warnings().iter().filter(|warning| !self.warned.contains(*warning)).cloned().collect();
        self.warned.extend(new.iter().cloned());
        let warned = (!new.is_empty()).then_some(Report::LabelsWarned(new));
        [Report::LabelsRefreshed(self.table())].into_iter().chain(warned).collect()
    }

    /// Before the first act: where can be written. The folders that are read are the same.
    fn find_place(&mut self) -> Result<(), LabelError> {
        if self.tried {
            return Ok(());
        }
        let place = LabelPlace::of(&self.dataset.info().root, self.dataset.fingerprint())?;
        if place != *self.store.place() {
            self.journal = Journal::open(&place, self.journal.annotator(), self.dataset.fingerprint())?;
            self.store = LabelStore::read(&place)?;
            self.unseen = true;
        }
        self.tried = true;
        Ok(())
    }

    fn commit(&mut self, commit: &Commit) -> Result<Done, String> {
        self.find_place().map_err(|error| error.to_string())?;
        let id = |index| FrameId { path: commit.dataset.frame_name(index).to_owned(), index };
        let judged = |index| commit.judged.get(&index).cloned().unwrap_or_default();
        let changes: Vec<(FrameId, Change, Judged)> =
            commit.asked.each().map(|(index, change)| (id(index), change, judged(index))).collect();
        let mut outcomes = self.journal.commit_each(&commit.act, &changes).map_err(|error| error.to_string())?;
        // Our own records are no news to be told again; what others wrote meanwhile is.
        let known = self.store.lines();
        match self.store.refresh() {
            Ok(_) => self.unseen |= self.store.lines() != known + outcomes.len(),
            Err(error) => tracing::warn!("{error}"),
        }
        let (mut changes, mut records) = (Vec::with_capacity(outcomes.len()), Vec::with_capacity(outcomes.len()));
        let scored = outcomes.iter().filter(|outcome| !outcome.after.judged.machine.is_empty());
        let scored = scored.map(|outcome| outcome.frame.index).collect();
        // In the order of frames, as `Changes` has them.
        outcomes.sort_by_key(|outcome| outcome.frame.index);
        for outcome in outcomes {
            changes.push((outcome.frame.index, outcome.before, outcome.after.label.clone()));
            // What is in memory already is not held twice.
            let known = self.store.shared(&outcome.after.annotator, &outcome.frame.path);
            let known = known.filter(|known| ***known == outcome.after).cloned();
            records.push(known.unwrap_or_else(|| Arc::new(outcome.after)));
        }
        Ok(Done { changes: Changes::of(changes), records, scored })
    }

    /// Everybody's records by the frames of this data set. A record's index is a hint: its name decides.
    fn table(&mut self) -> LabelTable {
        let annotators: Vec<String> = self.store.annotators().map(str::to_owned).collect();
        annotators.into_iter().map(|annotator| (annotator.clone(), self.records(&annotator))).collect()
    }

    fn records(&mut self, annotator: &str) -> Records {
        let records: Vec<Arc<Record>> = self.store.shared_records(annotator).cloned().collect();
        let placed = records.into_iter().filter_map(|mut record| {
            let index = self.index(&record.frame)?;
            if record.frame.index != index {
                Arc::make_mut(&mut record).frame.index = index;
            }
            Some((index, record))
        });
        placed.collect()
    }

    fn index(&mut self, frame: &FrameId) -> Option<usize> {
        if self.dataset.frame_name(frame.index) == frame.path {
            return Some(frame.index);
        }
        let dataset = &self.dataset;
        let all = || (0..dataset.len()).map(|index| (dataset.frame_name(index).to_owned(), index)).collect();
        self.names.get_or_insert_with(all).get(&frame.path).copied()
    }

    /// Labels of frames that the data set does not have.
    fn unknown(&mut self) -> Option<String> {
        let annotators: Vec<String> = self.store.annotators().map(str::to_owned).collect();
        let frames: Vec<FrameId> =
            annotators.iter().flat_map(|name| self.store.records(name)).map(|record| record.frame.clone()).collect();
        let unknown: Vec<&FrameId> = frames.iter().filter(|frame| self.index(frame).is_none()).collect();
        let first = unknown.first()?;
        let count = unknown.len();
        Some(format!(
            "{count} labels are of frames that are not in this data set, for example {}; they are kept",
            first.path
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::Tag;
    use crate::session::acts::{ActKind, Asked};
    use crate::task::Progress;
    use std::collections::BTreeMap;
    use std::error::Error;
    use std::path::Path;
    use std::time::SystemTime;

    const MANIFEST: &str = r#"name = "case"
layout = "npz"
frames = "frames/*.npz"
skeleton = "coco17"

[[view]]
array = "hm"
psf = { range_m = 0.05, azimuth_rad = 0.05, elevation_rad = 0.0, doppler_mps = 0.1 }
axes = [ { kind = "range", bins = 16, lo = 0.5, hi = 6.0 }, { kind = "azimuth", bins = 8, lo = 0.96, hi = -1.04 } ]
"#;

    fn dataset(folder: &Path) -> Result<Arc<Dataset>, Box<dyn Error>> {
        std::fs::create_dir(folder.join("frames"))?;
        std::fs::write(folder.join("dataset.toml"), MANIFEST)?;
        for name in ["0", "1"] {
            std::fs::write(folder.join(format!("frames/{name}.npz")), b"")?;
        }
        Ok(Arc::new(Dataset::open(folder, &Progress::new())?))
    }

    fn state(folder: &Path) -> std::io::Result<(usize, SystemTime)> {
        Ok((std::fs::read_dir(folder)?.count(), folder.metadata()?.modified()?))
    }

    fn tag(dataset: &Arc<Dataset>, id: u64) -> Request {
        let asked = Asked::Same([0].into(), Change::adding(if id == 1 { Tag::F1 } else { Tag::F2 }));
        let (kind, dataset) = (ActKind::Do, Arc::clone(dataset));
        Request::Commit(Commit { id, kind, act: "tag".into(), dataset, asked, judged: BTreeMap::new() })
    }

    #[test]
    fn a_data_set_that_is_only_looked_at_stays_as_it_is() -> Result<(), Box<dyn Error>> {
        let folder = tempfile::tempdir()?;
        let dataset = dataset(folder.path())?;
        let before = state(folder.path())?;
        let mut keeper = Keeper::default();
        let opened = keeper.answer(Request::Open(1, Arc::clone(&dataset), "ada".into()));
        assert!(matches!(opened[..], [Report::LabelsOpened(1, Ok(_))]), "{opened:?}");
        assert!(keeper.answer(Request::Refresh).is_empty());
        assert_eq!(state(folder.path())?, before);
        // The first act finds the place and tells it, once.
        let told = keeper.answer(tag(&dataset, 1));
        let [Report::LabelsWritten(written), Report::LabelsPlaced(place)] = &told[..] else {
            return Err(format!("{told:?}").into());
        };
        assert_eq!(written.result.as_ref().map(|done| done.changes.len()).ok(), Some(1));
        assert_eq!(place.folder, folder.path().join("mhp-labels"));
        let again = keeper.answer(tag(&dataset, 2));
        assert!(matches!(again[..], [Report::LabelsWritten(_)]), "{again:?}");
        Ok(())
    }

    #[test]
    fn what_is_wrong_with_a_file_that_comes_later_is_told_once() -> Result<(), Box<dyn Error>> {
        let folder = tempfile::tempdir()?;
        let dataset = dataset(folder.path())?;
        let mut keeper = Keeper::default();
        keeper.answer(Request::Open(1, Arc::clone(&dataset), "ada".into()));
        keeper.answer(tag(&dataset, 1));
        keeper.answer(Request::Refresh);
        let labels = folder.path().join("mhp-labels");
        let own = std::fs::read_to_string(labels.join("ada.labels.jsonl"))?;
        std::fs::write(labels.join("copy.labels.jsonl"), own.replace("\"time\":\"2", "\"time\":\"9"))?;
        let told = keeper.answer(Request::Refresh);
        let [Report::LabelsRefreshed(table), Report::LabelsWarned(warnings)] = &told[..] else {
            return Err(format!("{told:?}").into());
        };
        assert!(table["ada"].get(0).is_some_and(|record| record.time.starts_with('2')), "ada's own file counts");
        assert!(warnings[0].contains("copy.labels.jsonl: 1 record by `ada`, for whom only ada.labels.jsonl speaks"));
        assert!(keeper.answer(Request::Refresh).is_empty());
        Ok(())
    }
}
