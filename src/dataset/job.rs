//! Opening off the window's thread.

use super::error::panic_text;
use super::{Dataset, DatasetError, Manifest, Progress};
use crossbeam_channel::{Receiver, TryRecvError, bounded};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

/// A data set that is being opened on the thread `open-dataset`. Dropping the job cancels it.
#[derive(Debug)]
pub struct OpenJob {
    path: PathBuf,
    progress: Progress,
    answer: Receiver<Result<Dataset, DatasetError>>,
    answered: bool,
}

impl OpenJob {
    /// Begins; `wake` is called once, when the answer is there. With a manifest's path, that manifest is used.
    pub fn start(path: PathBuf, manifest: Option<PathBuf>, wake: impl Fn() + Send + 'static) -> Self {
        let progress = Progress::new();
        let (sender, answer) = bounded(1);
        let (told, here) = (progress.clone(), path.clone());
        let work = move || {
            let opened = catch_unwind(AssertUnwindSafe(|| match &manifest {
                Some(file) => Dataset::open_with_manifest(&here, &Manifest::from_file(file)?, &told),
                None => Dataset::open(&here, &told),
            }));
            let opened = opened.unwrap_or_else(|panic| {
                Err(DatasetError::Internal { message: panic_text(panic.as_ref()), path: here.clone() })
            });
            // Nobody listens any more: the job was dropped.
            let _ = sender.send(opened);
            wake();
        };
        let spawned = std::thread::Builder::new().name("open-dataset".into()).spawn(work);
        if let Err(reason) = spawned {
            tracing::error!("no thread to open a data set: {reason}");
        }
        Self { path, progress, answer, answered: false }
    }

    /// What is being opened.
    pub fn path(&self) -> &std::path::Path {
        &self.path
    }

    /// How far it is.
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// The answer, once, when it is there.
    pub fn poll(&mut self) -> Option<Result<Dataset, DatasetError>> {
        if self.answered {
            return None;
        }
        let answer = match self.answer.try_recv() {
            Ok(answer) => answer,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => {
                let message = "the thread that opens data sets could not run".into();
                Err(DatasetError::Internal { message, path: self.path.clone() })
            }
        };
        self.answered = true;
        Some(answer)
    }

    /// Asks it to stop; [`Self::poll`] then answers [`DatasetError::Cancelled`], or the data set if it was faster.
    pub fn cancel(&self) {
        self.progress.cancel();
    }
}

impl Drop for OpenJob {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
