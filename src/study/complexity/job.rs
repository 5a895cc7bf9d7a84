//! Computing off the window's thread.

use super::super::StudyError;
use super::{Complexity, ComplexityOptions, cache_folder, compute};
use crate::dataset::{Dataset, Progress, panic_text};
use crossbeam_channel::{Receiver, TryRecvError, bounded};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

/// The complexity of a data set, being computed on the thread `complexity`. Dropping the job cancels it.
#[derive(Debug)]
pub struct ComplexityJob {
    options: ComplexityOptions,
    progress: Progress,
    answer: Receiver<Result<Complexity, StudyError>>,
    answered: bool,
}

impl ComplexityJob {
    /// Begins, with the user's cache; `wake` is called once, when the answer is there.
    pub fn start(dataset: Arc<Dataset>, options: ComplexityOptions, wake: impl Fn() + Send + 'static) -> Self {
        Self::start_in(dataset, options, cache_folder(), wake)
    }

    /// As [`Self::start`], with this folder for the cache, or none.
    pub fn start_in(
        dataset: Arc<Dataset>,
        options: ComplexityOptions,
        cache: Option<PathBuf>,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let progress = Progress::new();
        let (sender, answer) = bounded(1);
        let told = progress.clone();
        let work = move || {
            let computed = catch_unwind(AssertUnwindSafe(|| compute(&dataset, &options, cache.as_deref(), &told)));
            let computed =
                computed.unwrap_or_else(|panic| Err(StudyError::Internal { message: panic_text(panic.as_ref()) }));
            // Nobody listens any more: the job was dropped.
            let _ = sender.send(computed);
            wake();
        };
        let spawned = std::thread::Builder::new().name("complexity".into()).spawn(work);
        if let Err(reason) = spawned {
            tracing::error!("no thread to measure complexity: {reason}");
        }
        Self { options, progress, answer, answered: false }
    }

    /// What it is computed with.
    pub fn options(&self) -> &ComplexityOptions {
        &self.options
    }

    /// How far it is: frames done of all, in two stages (files looked at, maps measured).
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// The answer, once, when it is there.
    pub fn poll(&mut self) -> Option<Result<Complexity, StudyError>> {
        if self.answered {
            return None;
        }
        let answer = match self.answer.try_recv() {
            Ok(answer) => answer,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => {
                Err(StudyError::Internal { message: "the thread that measures complexity could not run".into() })
            }
        };
        self.answered = true;
        Some(answer)
    }

    /// Asks it to stop; [`Self::poll`] then answers [`StudyError::Cancelled`], or the complexity if it was faster. What was
    /// measured is kept in the cache.
    pub fn cancel(&self) {
        self.progress.cancel();
    }
}

impl Drop for ComplexityJob {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}
