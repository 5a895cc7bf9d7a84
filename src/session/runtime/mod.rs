//! The session with the threads behind it: carries effects out, and brings back what the threads tell.

mod batch;
mod evidence;
mod explore;
mod labels;
mod study;

use super::command::{Command, PickKind};
use super::effect::{Effect, Trash};
use super::file::SessionFile;
use super::presets::PresetFits;
use super::report::Report;
use super::results::FoundResults;
use super::sources::SourceErrors;
use super::state::{LogLevel, Session};
use super::strata::StrataStatus;
use crate::dataset::{Dataset, Loader, OpenJob};
use crate::predictions::{Predictions, RememberedReadings};
use crate::study::StudyError;
use crate::study::complexity::{ComplexityJob, ComplexityOptions, cache_folder, cached_share};
use crate::worker::Worker;
use crossbeam_channel::{Receiver, Sender, unbounded};
use evidence::{Ask, EvidenceKeeper};
use labels::LabelKeeper;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Called from any thread when there is something to poll.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Shows a file dialog and answers the choice; runs on a thread of its own.
pub type Picker = Arc<dyn Fn(PickKind) -> Option<PathBuf> + Send + Sync>;

/// The next pass takes in what is left after this time.
const LONGEST_POLL: Duration = Duration::from_millis(6);

/// Smaller data sets are graded faster than a cache is worth.
const CACHE_FROM: usize = 200;

/// The session, and its threads: the worker, the loader, the opener, and those that keep labels, grade frames and gather
/// evidence.
pub struct Runtime {
    session: Session,
    wake: Wake,
    picker: Option<Picker>,
    worker: Option<Worker>,
    loader: Option<Loader>,
    opening: Option<(PathBuf, OpenJob)>,
    answers: (Sender<Report>, Receiver<Report>),
    startup_error: Option<String>,
    allow_outside: bool,
    labels: LabelKeeper,
    evidence: EvidenceKeeper,
    grading: Option<ComplexityJob>,
    batch: Option<batch::BatchRun>,
    study: Option<study::StudyThread>,
    explorer: explore::Explorer,
    restored_window: Option<serde_json::Value>,
}

impl Runtime {
    /// Starts the worker of a session. `picker` shows file dialogs, where there are any.
    pub fn new(session: Session, wake: Wake, picker: Option<Picker>) -> Self {
        let waker = Arc::clone(&wake);
        let (worker, startup_error) = match Worker::spawn(move || waker()) {
            Ok(worker) => (Some(worker), None),
            Err(error) => (None, Some(format!("no thread for the fit: {error}"))),
        };
        Self {
            session,
            labels: LabelKeeper::start(&wake),
            evidence: EvidenceKeeper::start(&wake),
            grading: None,
            batch: None,
            study: None,
            explorer: explore::Explorer::default(),
            restored_window: None,
            wake,
            picker,
            worker,
            loader: None,
            opening: None,
            answers: unbounded(),
            startup_error,
            allow_outside: false,
        }
    }

    /// Whether manifests may name frames outside their own folder.
    pub fn allow_outside(self, allow_outside: bool) -> Self {
        Self { allow_outside, ..self }
    }

    /// The state, to be read.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Does what a person asks, with what follows from it.
    pub fn apply(&mut self, command: Command) {
        let effects = self.session.apply(command);
        self.carry_out(effects);
    }

    /// Takes in what the window has to tell, with what follows from it.
    pub fn report(&mut self, report: Report) {
        let effects = self.session.report(report);
        self.carry_out(effects);
    }

    /// Takes in the reports that wait, for a few milliseconds: a run that reports faster than this thread takes in does not hold
    /// it up. True where there was one.
    pub fn poll(&mut self) -> bool {
        let mut any = false;
        if let Some(text) = self.startup_error.take() {
            self.report(Report::Log(LogLevel::Error, text));
        }
        let began = Instant::now();
        while let Some(report) = self.next_report() {
            self.report(report);
            any = true;
            if began.elapsed() > LONGEST_POLL {
                (self.wake)();
                break;
            }
        }
        any
    }

    /// What a session file says of the window, once.
    pub fn take_restored_window(&mut self) -> Option<serde_json::Value> {
        self.restored_window.take()
    }

    fn next_report(&mut self) -> Option<Report> {
        if let Ok(report) = self.answers.1.try_recv() {
            return Some(report);
        }
        if let Some(report) = self.opening_report() {
            return Some(report);
        }
        if let Some((index, result)) = self.loader.as_ref().and_then(Loader::poll) {
            return Some(Report::FrameLoaded(index, result));
        }
        if let Some(report) = self.labels.poll().or_else(|| self.evidence.poll()).or_else(|| self.grading_report()) {
            return Some(report);
        }
        if let Some(report) = self.batch_report().or_else(|| self.study_report()) {
            return Some(report);
        }
        if let Some(report) = self.explorer.poll() {
            return Some(report);
        }
        let worker = self.worker.as_ref()?;
        // Rows and events first: a snapshot may be of a branch that an event announces.
        if let Some(message) = worker.poll() {
            return Some(Report::Worker(message));
        }
        worker.take_snapshot().map(|snapshot| Report::Snapshot(Box::new(snapshot)))
    }

    fn batch_report(&mut self) -> Option<Report> {
        let batch = self.batch.as_mut()?;
        let (report, ended) = batch.poll()?;
        if ended {
            // Its last rows are taken in before its end is told.
            if let Some(rest) = batch.rest() {
                let _ = self.answers.0.send(report);
                self.batch = None;
                return Some(rest);
            }
            self.batch = None;
        }
        Some(report)
    }

    fn study_report(&mut self) -> Option<Report> {
        let report = self.study.as_mut()?.poll()?;
        if matches!(report, Report::StudyDone(_)) {
            self.study = None;
        }
        Some(report)
    }

    fn opening_report(&mut self) -> Option<Report> {
        let (_, job) = self.opening.as_mut()?;
        if let Some(result) = job.poll() {
            let (path, _) = self.opening.take()?;
            return Some(Report::Opened(path, result.map(Arc::new)));
        }
        let crate::task::ProgressState { stage, done, total } = job.progress().state();
        let shown = self.session.data.opening.as_ref()?;
        (shown.stage != stage || shown.done != done || shown.total != total).then_some(Report::OpenProgress {
            stage,
            done,
            total,
        })
    }

    fn carry_out(&mut self, effects: Vec<Effect>) {
        // Before the worker hears of a run: whoever explores makes way from its first step on.
        self.session.explore.cores.fit_runs(self.session.needs_cores());
        for effect in effects {
            self.carry_out_one(effect);
        }
    }

    fn carry_out_one(&mut self, effect: Effect) {
        match effect {
            Effect::Open(path) => {
                let wake = Arc::clone(&self.wake);
                let job = OpenJob::start(path.clone(), None, self.allow_outside, move || wake());
                self.opening = Some((path, job));
            }
            Effect::OpenBare(path, choice) => self.on_thread("open-bare", move || {
                let result = Dataset::open_bare(&path, &choice).map(Arc::new);
                Report::Opened(path, result)
            }),
            Effect::OpenCapture(path, form) => self.on_thread("open-capture", move || {
                let result = Dataset::open_capture(&path, &form).map(Arc::new);
                Report::Opened(path, result)
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
            Effect::RestoreWindow(window) => self.restored_window = Some(window),
            Effect::Run(task) => self.on_thread("export", move || Report::TaskDone((task.0)())),
            Effect::ReadSession(path) => self.on_thread("session-file", move || {
                let read = SessionFile::read(&path).map(Box::new).map_err(|error| error.to_string());
                Report::SessionRead(path, read)
            }),
            Effect::ReadResults(path, dataset) => self.on_thread("results", move || {
                let read = FoundResults::read(&path, &dataset).map(Box::new);
                Report::ResultsRead(path, read)
            }),
            Effect::ReadPredictions(path, reading, dataset) => self.on_thread("predictions", move || {
                let memory = RememberedReadings::of_user();
                let read = Predictions::open(&path, &dataset, &reading, memory.as_ref()).map(Box::new);
                Report::PredictionsRead(path, reading, dataset, read)
            }),
            Effect::ComparePredictions(of, dataset) => self.on_thread("predictions-errors", move || {
                let errors = Arc::new(SourceErrors::of(&of, &dataset));
                Report::PredictionsCompared(of, errors)
            }),
            Effect::StartBatch(request) => self.batch = Some(batch::BatchRun::start(*request, &self.wake)),
            Effect::PauseBatch(wait) => {
                if let Some(batch) = &self.batch {
                    batch.pause(wait);
                }
            }
            Effect::CancelBatch => {
                if let Some(batch) = &self.batch {
                    batch.cancel();
                }
            }
            Effect::FitPresets(dataset, frame, precision) => self.on_thread("presets", move || {
                Report::PresetsFitted(Arc::new(PresetFits::of(&dataset, &frame, precision)))
            }),
            Effect::StartStudy(request) => self.study = Some(study::StudyThread::start(*request, &self.wake)),
            Effect::PauseStudy(wait) => {
                if let Some(study) = &self.study {
                    study.pause(wait);
                }
            }
            Effect::CancelStudy => {
                if let Some(study) = &self.study {
                    study.cancel();
                }
            }
            Effect::Explore(number, what) => {
                self.explorer.start(number, *what, self.session.explore.cores.clone(), &self.wake);
            }
            Effect::StopExploring(kind) => self.explorer.stop(kind),
            Effect::FindKept(dataset) => self.on_thread("kept-fits", move || {
                let (kept, faults) = batch::kept(&dataset);
                Report::KeptFound { dataset, kept, faults }
            }),
            Effect::ReadRun(folder) => self.on_thread("study", move || {
                let read = crate::study::run::Run::read(&folder).map(Arc::new).map_err(|error| error.to_string());
                Report::RunRead(folder, read)
            }),
            Effect::FindStudyRow { folder, run, row, scene, dataset } => self.on_thread("results", move || {
                let found = super::study::frames_of_row(&run, row, scene.as_deref(), &dataset);
                Report::ResultsRead(folder, Ok(Box::new(found)))
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
            let _ = self.answers.0.send(Report::StrataDone(Ok(None)));
            return (self.wake)();
        }
        let wake = Arc::clone(&self.wake);
        self.grading = Some(ComplexityJob::start(dataset, options, cache, move || wake()));
    }

    fn grading_report(&mut self) -> Option<Report> {
        let job = self.grading.as_mut()?;
        if let Some(result) = job.poll() {
            self.grading = None;
            return Some(Report::StrataDone(match result {
                Ok(complexity) => Ok(Some(Arc::new(complexity))),
                Err(StudyError::Cancelled) => Ok(None),
                Err(error) => Err(error.to_string()),
            }));
        }
        let state = job.progress().state();
        let StrataStatus::Running { done, total } = self.session.strata.status else { return None };
        ((done, total) != (state.done, state.total))
            .then_some(Report::StrataProgress { done: state.done, total: state.total })
    }

    /// Frees something on a thread of its own; here, where there is none.
    fn free(trash: Trash) {
        if let Err(error) = std::thread::Builder::new().name("free".into()).spawn(move || trash.free()) {
            tracing::debug!("no thread to free memory on: {error}");
        }
    }

    /// Does something that may be slow on a thread of its own; its answer comes back as a report.
    fn on_thread(&self, name: &str, work: impl FnOnce() -> Report + Send + 'static) {
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
        let (answer, wake) = (self.answers.0.clone(), Arc::clone(&self.wake));
        let thread = std::thread::Builder::new().name("file-dialog".into());
        let spawned = thread.spawn(move || {
            if let Some(path) = picker(kind) {
                let _ = answer.send(Report::Picked(path));
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
