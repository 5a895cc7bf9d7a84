//! Opening off the window's thread.

use super::{Dataset, DatasetError, Manifest, OpenOptions};
use crate::task::{Job, Progress};
use std::path::PathBuf;

/// A data set that is being opened on the thread `open-dataset`. Dropping the job cancels it.
pub struct OpenJob {
    path: PathBuf,
    job: Job<Dataset, DatasetError>,
}

impl OpenJob {
    /// Begins; `wake` is called once, when the answer is there. With a manifest's path, that manifest is used;
    /// `allow_outside` as in [`OpenOptions`].
    pub fn start(
        path: PathBuf,
        manifest: Option<PathBuf>,
        allow_outside: bool,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let (here, broken_at) = (path.clone(), path.clone());
        let work = move |progress: &Progress| {
            let manifest = manifest.as_deref().map(Manifest::from_file).transpose()?;
            Dataset::open_with(&here, OpenOptions { manifest: manifest.as_ref(), allow_outside }, progress)
        };
        let broken = move |message| DatasetError::Internal { message, path: broken_at.clone() };
        Self { path, job: Job::start("open-dataset", work, broken, wake) }
    }

    /// What is being opened.
    pub fn path(&self) -> &std::path::Path {
        &self.path
    }

    /// How far it is.
    pub fn progress(&self) -> &Progress {
        self.job.progress()
    }

    /// The answer, once, when it is there.
    pub fn poll(&mut self) -> Option<Result<Dataset, DatasetError>> {
        self.job.poll()
    }

    /// Asks it to stop; [`Self::poll`] then answers [`DatasetError::Cancelled`], or the data set if it was faster.
    pub fn cancel(&self) {
        self.job.cancel();
    }
}
