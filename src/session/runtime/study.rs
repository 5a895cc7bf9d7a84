//! The thread of a study: plans it, does it on all cores in a folder of its own, and tells of it as it grows.

use super::Wake;
use crate::labels::LabelPlace;
use crate::output::Inputs;
use crate::session::report::Report;
use crate::session::study::StudyRequest;
use crate::study::StudyError;
use crate::study::complexity::{ComplexityOptions, cache_folder, compute};
use crate::study::run::{Run, RunError, RunFolder, RunPlan, execute_run, seed_run};
use crate::task::{Job, Progress};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The folder of studies, beside the labels of a data set.
const STUDIES: &str = "studies";

/// A study under way. Dropping it cancels it.
pub(super) struct StudyThread {
    job: Job<Option<(PathBuf, Run)>, String>,
    newest: Newest,
    told: (u64, u64),
}

/// The run as the window has not seen it yet.
type Newest = Arc<Mutex<Option<(PathBuf, Run)>>>;

impl StudyThread {
    pub(super) fn start(request: StudyRequest, wake: &Wake) -> Self {
        let newest = Newest::default();
        let (shared, waker, wake) = (Arc::clone(&newest), Arc::clone(wake), Arc::clone(wake));
        let work = move |progress: &Progress| work(&request, progress, &shared, &waker);
        let job = Job::start("study", work, |text| format!("internal error: {text}"), move || wake());
        Self { job, newest, told: (0, 0) }
    }

    pub(super) fn pause(&self, wait: bool) {
        self.job.progress().pause(wait);
    }

    pub(super) fn cancel(&self) {
        self.job.cancel();
    }

    /// What is new: how far it is, its rows, its end.
    pub(super) fn poll(&mut self) -> Option<Report> {
        let state = self.job.progress().state();
        if self.told != (state.done, state.total) {
            self.told = (state.done, state.total);
            return Some(Report::StudyProgress(state.done, state.total));
        }
        let newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some((folder, run)) = newest {
            return Some(Report::StudyGrew(folder, Arc::new(run)));
        }
        let done = self.job.poll()?;
        Some(Report::StudyDone(done.map(|done| done.map(|(folder, run)| (folder, Arc::new(run))))))
    }
}

/// The run and its folder; `None` where it was cancelled.
fn work(
    request: &StudyRequest,
    progress: &Progress,
    newest: &Newest,
    wake: &Wake,
) -> Result<Option<(PathBuf, Run)>, String> {
    match study(request, progress, newest, wake) {
        Ok(done) => Ok(Some(done)),
        Err(RunError::Study(StudyError::Cancelled)) => Ok(None),
        Err(error) => Err(error.to_string()),
    }
}

fn study(
    StudyRequest { dataset, run, complexity, known }: &StudyRequest,
    progress: &Progress,
    newest: &Newest,
    wake: &Wake,
) -> Result<(PathBuf, Run), RunError> {
    let internal = |message: String| StudyError::Internal { message };
    let place = LabelPlace::of(&dataset.info().root, dataset.fingerprint()).map_err(|why| internal(why.to_string()))?;
    let graded = match complexity {
        None if RunPlan::needs_strata(run) => {
            Some(compute(dataset, &ComplexityOptions::default(), cache_folder().as_deref(), progress)?)
        }
        _ => None,
    };
    let plan = RunPlan::new(dataset, run, graded.as_ref().or(complexity.as_deref()))?;
    let folder = place.folder.join(STUDIES).join(format!("{}-{}", run.study, plan.spec().id));
    let path: &Path = &folder;
    let watcher = |run: Run| {
        *newest.lock().unwrap_or_else(PoisonError::into_inner) = Some((path.to_owned(), run));
        wake();
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    // Beside the labels, in a folder of the program's own: no layout takes what lies there for data.
    let folder_of_run = RunFolder { path: folder.clone(), inputs: Inputs::default() };
    if !known.is_empty() {
        seed_run(&plan, &folder_of_run, known)?;
    }
    let done = execute_run(dataset, &plan, &folder_of_run, threads, progress, Some(&watcher))?;
    Ok((folder, done))
}
