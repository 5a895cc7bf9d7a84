//! The thread that keeps the journals: an act is written there, so that a slow disk never holds the window up, and is shown
//! only when the answer is back.

use super::Wake;
use crate::dataset::Dataset;
use crate::labels::{Change, FrameId, Journal, Judged, LabelPlace, LabelStore, Record};
use crate::session::acts::{Changes, Done};
use crate::session::command::{Command, Commit, OpenedLabels, Written};
use crate::session::labels::LabelTable;
use crate::session::records::Records;
use crossbeam_channel::{Receiver, Sender, TrySendError, bounded, unbounded};
use std::collections::HashMap;
use std::sync::Arc;
use std::thread::JoinHandle;

/// Acts that may wait to be written.
const WAITING: usize = 256;

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
    answers: Receiver<Command>,
    told: Sender<Command>,
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
            while let Ok(request) = inbox.recv() {
                if let Some(command) = keeper.answer(request) {
                    if answer.send(command).is_err() {
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
            self.tell(Command::LabelsOpened(id, Err("the thread that keeps labels does not answer".into())));
        }
    }

    pub(super) fn commit(&self, commit: Commit) {
        if let Some(Request::Commit(Commit { id, kind, act, .. })) = self.ask(Request::Commit(commit)) {
            let result = Err("the disk does not keep up with the acts before it".into());
            self.tell(Command::LabelsWritten(Written { id, kind, act, result }));
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

    pub(super) fn poll(&self) -> Option<Command> {
        self.answers.try_recv().ok()
    }

    fn tell(&self, command: Command) {
        // The other end is held by this very keeper.
        let _ = self.told.send(command);
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
    journal: Journal,
    store: LabelStore,
    /// What others wrote came in with an act of our own and is still to be told.
    unseen: bool,
    /// Frames by name; made when a record's index is not that of its name.
    names: Option<HashMap<String, usize>>,
}

impl Keeper {
    fn answer(&mut self, request: Request) -> Option<Command> {
        match request {
            Request::Open(id, dataset, annotator) => {
                self.open = None;
                Some(Command::LabelsOpened(id, self.begin(dataset, &annotator)))
            }
            Request::Commit(commit) => {
                let result = match &mut self.open {
                    Some(open) => open.commit(&commit),
                    None => Err("the journal is not open".into()),
                };
                let Commit { id, kind, act, .. } = commit;
                Some(Command::LabelsWritten(Written { id, kind, act, result }))
            }
            Request::Refresh => {
                let open = self.open.as_mut()?;
                let news = open.store.refresh().map(|more| more | std::mem::take(&mut open.unseen));
                match news {
                    Ok(true) => Some(Command::LabelsRefreshed(open.table())),
                    Ok(false) => None,
                    Err(error) => {
                        tracing::warn!("{error}");
                        None
                    }
                }
            }
        }
    }

    fn begin(&mut self, dataset: Arc<Dataset>, annotator: &str) -> Result<Box<OpenedLabels>, String> {
        let place = LabelPlace::of(&dataset.info().root, dataset.fingerprint()).map_err(|error| error.to_string())?;
        let journal = Journal::open(&place, annotator, dataset.fingerprint()).map_err(|error| error.to_string())?;
        let store = LabelStore::read(&place).map_err(|error| error.to_string())?;
        let mut open = Open { dataset, journal, store, unseen: false, names: None };
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
    fn commit(&mut self, commit: &Commit) -> Result<Done, String> {
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
