//! The threads behind a session: carries effects out, and brings reports back as commands.

mod evidence;
mod labels;

use super::command::{Command, Effect, PickKind, Trash};
use super::file::SessionFile;
use super::results::FoundResults;
use super::state::{LogLevel, Session};
use super::strata::StrataStatus;
use crate::dataset::{Dataset, Loader, OpenJob};
use crate::study::StudyError;
use crate::study::complexity::{ComplexityJob, ComplexityOptions, cache_folder, cached_share};
use crate::worker::Worker;
use crossbeam_channel::{Receiver, Sender, unbounded};
use evidence::{Ask, EvidenceKeeper};
use labels::LabelKeeper;
use std::path::PathBuf;
use std::sync::Arc;

/// Called from any thread when there is something to poll.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Shows a file dialog and answers the choice; runs on a thread of its own.
pub type Picker = Arc<dyn Fn(PickKind) -> Option<PathBuf> + Send + Sync>;

/// Smaller data sets are graded faster than a cache is worth.
const CACHE_FROM: usize = 200;

/// The worker, the loader, the opener, and those that keep labels, grade frames and gather evidence.
pub struct Runtime {
    wake: Wake,
    picker: Option<Picker>,
    worker: Option<Worker>,
    loader: Option<Loader>,
    opening: Option<(PathBuf, OpenJob)>,
    picked: (Sender<PathBuf>, Receiver<PathBuf>),
    answers: (Sender<Command>, Receiver<Command>),
    startup_error: Option<String>,
    allow_outside: bool,
    labels: LabelKeeper,
    evidence: EvidenceKeeper,
    grading: Option<ComplexityJob>,
}

impl Runtime {
    /// Starts the worker. `picker` shows file dialogs, where there are any.
    pub fn new(wake: Wake, picker: Option<Picker>) -> Self {
        let waker = Arc::clone(&wake);
        let (worker, startup_error) = match Worker::spawn(move || waker()) {
            Ok(worker) => (Some(worker), None),
            Err(error) => (None, Some(format!("no thread for the fit: {error}"))),
        };
        Self {
            labels: LabelKeeper::start(&wake),
            evidence: EvidenceKeeper::start(&wake),
            grading: None,
            wake,
            picker,
            worker,
            loader: None,
            opening: None,
            picked: unbounded(),
            answers: unbounded(),
            startup_error,
            allow_outside: false,
        }
    }

    /// Whether manifests may name frames outside their own folder.
    pub fn allow_outside(self, allow_outside: bool) -> Self {
        Self { allow_outside, ..self }
    }

    /// Applies a command and carries out what follows from it.
    pub fn apply(&mut self, session: &mut Session, command: Command) {
        for effect in session.apply(command) {
            self.carry_out(effect);
        }
    }

    /// Applies every report that waits. True where there was one.
    pub fn poll(&mut self, session: &mut Session) -> bool {
        let mut any = false;
        if let Some(text) = self.startup_error.take() {
            self.apply(session, Command::Log(LogLevel::Error, text));
        }
        while let Some(command) = self.next_report(session) {
            self.apply(session, command);
            any = true;
        }
        any
    }

    fn next_report(&mut self, session: &Session) -> Option<Command> {
        if let Ok(command) = self.answers.1.try_recv() {
            return Some(command);
        }
        if let Ok(path) = self.picked.1.try_recv() {
            return Some(Command::Open(path));
        }
        if let Some(command) = self.opening_report(session) {
            return Some(command);
        }
        if let Some((index, result)) = self.loader.as_ref().and_then(Loader::poll) {
            return Some(Command::FrameLoaded(index, result));
        }
        if let Some(command) =
            self.labels.poll().or_else(|| self.evidence.poll()).or_else(|| self.grading_report(session))
        {
            return Some(command);
        }
        let worker = self.worker.as_ref()?;
        // Rows and events first: a snapshot may be of a branch that an event announces.
        if let Some(message) = worker.poll() {
            return Some(Command::Worker(message));
        }
        worker.take_snapshot().map(|snapshot| Command::Snapshot(Box::new(snapshot)))
    }

    fn opening_report(&mut self, session: &Session) -> Option<Command> {
        let (_, job) = self.opening.as_mut()?;
        if let Some(result) = job.poll() {
            let (path, _) = self.opening.take()?;
            return Some(Command::Opened(path, result.map(Arc::new)));
        }
        let crate::task::ProgressState { stage, done, total } = job.progress().state();
        let shown = session.data.opening.as_ref()?;
        (shown.stage != stage || shown.done != done || shown.total != total).then_some(Command::OpenProgress {
            stage,
            done,
            total,
        })
    }

    fn carry_out(&mut self, effect: Effect) {
        match effect {
            Effect::Open(path) => {
                let wake = Arc::clone(&self.wake);
                let job = OpenJob::start(path.clone(), None, self.allow_outside, move || wake());
                self.opening = Some((path, job));
            }
            Effect::OpenBare(path, choice) => self.on_thread("open-bare", move || {
                let result = Dataset::open_bare(&path, &choice).map(Arc::new);
                Command::Opened(path, result)
            }),
            Effect::CancelOpen => {
                if let Some((_, job)) = self.opening.take() {
                    job.cancel();
                }
            }
            Effect::Pick(kind) => self.pick(kind),
            Effect::UseDataset(dataset) => {
                let wake = Arc::clone(&self.wake);
                self.loader = Some(Loader::start(dataset, move || wake()));
            }
            Effect::Load(index) => {
                if let Some(loader) = &self.loader {
                    loader.request(index);
                }
            }
            Effect::OpenLabels { id, dataset, annotator } => self.labels.open(id, dataset, annotator),
            Effect::CommitLabels(commit) => self.labels.commit(commit),
            Effect::RefreshLabels => self.labels.refresh(),
            Effect::ComputeStrata { dataset, only_kept } => self.grade(dataset, only_kept),
            Effect::CancelStrata => {
                if let Some(job) = &self.grading {
                    job.cancel();
                }
            }
            Effect::Evidence(request) => self.evidence.ask(Ask::Evidence(request)),
            Effect::DrawPin(request) => self.evidence.ask(Ask::Pin(request)),
            Effect::Free(trash) => Self::free(trash),
            Effect::Run(task) => self.on_thread("export", move || Command::TaskDone((task.0)())),
            Effect::ReadSession(path) => self.on_thread("session-file", move || {
                let read = SessionFile::read(&path).map(Box::new).map_err(|error| error.to_string());
                Command::SessionRead(path, read)
            }),
            Effect::ReadResults(path, dataset) => self.on_thread("results", move || {
                let read = FoundResults::read(&path, &dataset).map(Box::new);
                Command::ResultsRead(path, read)
            }),
            Effect::ReadRun(folder) => self.on_thread("study", move || {
                let read = crate::study::run::Run::read(&folder).map(Arc::new).map_err(|error| error.to_string());
                Command::RunRead(folder, read)
            }),
            Effect::FindStudyRow(folder, run, row, dataset) => self.on_thread("results", move || {
                let found = super::study::frames_of_row(&run, row, &dataset);
                Command::ResultsRead(folder, Ok(Box::new(found)))
            }),
            Effect::Send(command) => {
                if let Some(worker) = &self.worker {
                    worker.send(command);
                }
            }
        }
    }

    /// Grades the frames, with what an earlier run left; or takes only that.
    fn grade(&mut self, dataset: Arc<Dataset>, only_kept: bool) {
        let options = ComplexityOptions::default();
        let cache = cache_folder().filter(|_| dataset.len() >= CACHE_FROM);
        if only_kept && cached_share(&dataset, &options, cache.as_deref()) < 1.0 {
            self.grading = None;
            let _ = self.answers.0.send(Command::StrataDone(Ok(None)));
            return (self.wake)();
        }
        let wake = Arc::clone(&self.wake);
        self.grading = Some(ComplexityJob::start(dataset, options, cache, move || wake()));
    }

    fn grading_report(&mut self, session: &Session) -> Option<Command> {
        let job = self.grading.as_mut()?;
        if let Some(result) = job.poll() {
            self.grading = None;
            return Some(Command::StrataDone(match result {
                Ok(complexity) => Ok(Some(Arc::new(complexity))),
                Err(StudyError::Cancelled) => Ok(None),
                Err(error) => Err(error.to_string()),
            }));
        }
        let state = job.progress().state();
        let StrataStatus::Running { done, total } = session.strata.status else { return None };
        ((done, total) != (state.done, state.total))
            .then_some(Command::StrataProgress { done: state.done, total: state.total })
    }

    /// Frees something on a thread of its own; here, where there is none.
    fn free(trash: Trash) {
        if let Err(error) = std::thread::Builder::new().name("free".into()).spawn(move || trash.free()) {
            tracing::debug!("no thread to free memory on: {error}");
        }
    }

    /// Does something that may be slow on a thread of its own; its answer comes back as a report.
    fn on_thread(&self, name: &str, work: impl FnOnce() -> Command + Send + 'static) {
        let (answer, wake) = (self.answers.0.clone(), Arc::clone(&self.wake));
        let spawned = std::thread::Builder::new().name(name.into()).spawn(move || {
            let _ = answer.send(work());
            wake();
        });
        if let Err(error) = spawned {
            tracing::error!("no thread for {name}: {error}");
        }
    }

    /// A dialog blocks its thread until it is answered, so it gets one of its own.
    fn pick(&self, kind: PickKind) {
        let Some(picker) = self.picker.clone() else { return };
        let (answer, wake) = (self.picked.0.clone(), Arc::clone(&self.wake));
        let thread = std::thread::Builder::new().name("file-dialog".into());
        let spawned = thread.spawn(move || {
            if let Some(path) = picker(kind) {
                let _ = answer.send(path);
                wake();
            }
        });
        if let Err(error) = spawned {
            tracing::error!("no thread for the file dialog: {error}");
        }
    }

    /// True while something is under way whose progress is worth showing soon.
    pub fn is_busy(&self) -> bool {
        self.opening.is_some() || self.grading.is_some()
    }
}
