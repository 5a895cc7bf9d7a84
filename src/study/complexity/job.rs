//! Computing off the window's thread.

use super::super::StudyError;
use super::{Complexity, ComplexityOptions, compute};
use crate::dataset::Dataset;
use crate::task::{Job, Progress};
use std::path::PathBuf;
use std::sync::Arc;

/// The complexity of a data set, being computed on the thread `complexity`. Dropping the job cancels it.
pub struct ComplexityJob(Job<Complexity, StudyError>);

impl ComplexityJob {
    /// Begins, with this folder for the cache ([`super::cache_folder`] is the user's) or none; `wake` is called once, when the
    /// answer is there.
    pub fn start(
        dataset: Arc<Dataset>,
        options: ComplexityOptions,
        cache: Option<PathBuf>,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let work = move |progress: &Progress| compute(&dataset, &options, cache.as_deref(), progress);
        let broken = |message| StudyError::Internal { message };
        Self(Job::start("complexity", work, broken, wake))
    }

    /// How far it is: frames done of all, in two stages (files looked at, maps measured).
    pub fn progress(&self) -> &Progress {
        self.0.progress()
    }

    /// The answer, once, when it is there.
    pub fn poll(&mut self) -> Option<Result<Complexity, StudyError>> {
        self.0.poll()
    }

    /// Asks it to stop; [`Self::poll`] then answers [`StudyError::Cancelled`], or the complexity if it was faster. What was
    /// measured is kept in the cache.
    pub fn cancel(&self) {
        self.0.cancel();
    }
}
