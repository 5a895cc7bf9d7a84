//! The threads behind a session: carries effects out, and brings reports back as commands.

use super::command::{Command, Effect, PickKind};
use super::state::{LogLevel, Session};
use crate::dataset::{BareChoice, Dataset, Loader, OpenJob};
use crate::worker::Worker;
use crossbeam_channel::{Receiver, Sender, unbounded};
use std::path::PathBuf;
use std::sync::Arc;

/// Called from any thread when there is something to poll.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Shows a file dialog and answers the choice; runs on a thread of its own.
pub type Picker = Arc<dyn Fn(PickKind) -> Option<PathBuf> + Send + Sync>;

/// The worker, the loader and the opener.
pub struct Runtime {
    wake: Wake,
    picker: Option<Picker>,
    worker: Option<Worker>,
    loader: Option<Loader>,
    opening: Option<(PathBuf, OpenJob)>,
    picked: (Sender<PathBuf>, Receiver<PathBuf>),
    bare: (Sender<Command>, Receiver<Command>),
    startup_error: Option<String>,
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
            wake,
            picker,
            worker,
            loader: None,
            opening: None,
            picked: unbounded(),
            bare: unbounded(),
            startup_error,
        }
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
        if let Ok(command) = self.bare.1.try_recv() {
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
        let crate::dataset::ProgressState { stage, done, total } = job.progress().state();
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
                let job = OpenJob::start(path.clone(), None, move || wake());
                self.opening = Some((path, job));
            }
            Effect::OpenBare(path, choice) => self.open_bare(path, choice),
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
            Effect::Send(command) => {
                if let Some(worker) = &self.worker {
                    worker.send(command);
                }
            }
        }
    }

    /// Reads the file's headers, which may be slow on a network, on a thread.
    fn open_bare(&self, path: PathBuf, choice: BareChoice) {
        let (answer, wake) = (self.bare.0.clone(), Arc::clone(&self.wake));
        let spawned = std::thread::Builder::new().name("open-bare".into()).spawn(move || {
            let result = Dataset::open_bare(&path, &choice).map(Arc::new);
            let _ = answer.send(Command::Opened(path, result));
            wake();
        });
        if let Err(error) = spawned {
            tracing::error!("no thread for opening the file: {error}");
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
        self.opening.is_some()
    }
}
