//! The thread of a batch: what is known already first, then a fit a frame on all cores, each kept as soon as it is there.

use super::Wake;
use crate::dataset::Dataset;
use crate::labels::LabelPlace;
use crate::session::batch::BatchRequest;
use crate::session::report::Report;
use crate::study::{BatchOptions, BatchRow, FitsFile, FrameStamps, KeptFits, StudyError, kept_fits, run_batch};
use crate::task::{Job, Progress};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The window hears of rows at most this often.
const TOLD: Duration = Duration::from_millis(100);

/// A batch under way. Dropping it cancels it.
pub(super) struct BatchRun {
    dataset: Arc<Dataset>,
    job: Job<bool, String>,
    waiting: Arc<Waiting>,
}

/// Rows that the window has not heard of yet, and how many frames are done.
type Waiting = Mutex<(Vec<BatchRow>, u64)>;

impl BatchRun {
    pub(super) fn start(request: BatchRequest, wake: &Wake) -> Self {
        let waiting = Arc::new(Waiting::default());
        let (dataset, shared, waker) = (Arc::clone(&request.dataset), Arc::clone(&waiting), Arc::clone(wake));
        let work = move |progress: &Progress| work(&request, &shared, progress, &waker);
        let wake = Arc::clone(wake);
        let job = Job::start("batch", work, |text| format!("internal error: {text}"), move || wake());
        Self { dataset, job, waiting }
    }

    pub(super) fn pause(&self, wait: bool) {
        self.job.progress().pause(wait);
    }

    pub(super) fn cancel(&self) {
        self.job.cancel();
    }

    /// Rows that came since, then the end; `None` where there is neither. True with the end.
    pub(super) fn poll(&mut self) -> Option<(Report, bool)> {
        // The end first asked, then told last: rows that came before it are in.
        let ended = self.job.poll();
        if let Some(result) = ended {
            return Some((Report::BatchDone(Arc::clone(&self.dataset), result), true));
        }
        let mut rows = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if rows.0.is_empty() {
            return None;
        }
        let (new, done) = (std::mem::take(&mut rows.0), rows.1);
        Some((Report::BatchRows(Arc::clone(&self.dataset), new, done), false))
    }

    /// The rows that nobody has heard of, at the end.
    pub(super) fn rest(&self) -> Option<Report> {
        let mut rows = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let (new, done) = (std::mem::take(&mut rows.0), rows.1);
        (!new.is_empty()).then(|| Report::BatchRows(Arc::clone(&self.dataset), new, done))
    }
}

impl Drop for BatchRun {
    fn drop(&mut self) {
        self.cancel();
    }
}

/// True where every frame was fitted, false where it was cancelled before.
fn work(request: &BatchRequest, waiting: &Waiting, progress: &Progress, wake: &Wake) -> Result<bool, String> {
    let BatchRequest { dataset, frames, of } = request;
    let place = LabelPlace::of(&dataset.info().root, dataset.fingerprint()).map_err(|error| error.to_string())?;
    let mut stamps = FrameStamps::new(dataset);
    let opened = FitsFile::open(&place.folder, of, |index| stamps.of(index));
    let (mut file, mut known) = opened.map_err(|error| error.to_string())?;
    known.retain(|&index, row| index < dataset.len() && dataset.frame_name(index) == row.frame && row.fit.is_ok());
    let (mut there, mut todo) = (Vec::new(), Vec::new());
    for &frame in frames.iter() {
        match known.remove(&(frame as usize)) {
            Some(row) => there.push(row),
            None => todo.push(frame as usize),
        }
    }
    let mut done = there.len() as u64;
    let mut told = Instant::now();
    let mut tell = |rows: &mut Vec<BatchRow>, done: u64, now: bool| {
        let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.0.append(rows);
        waiting.1 = done;
        drop(waiting);
        if now || told.elapsed() >= TOLD {
            told = Instant::now();
            wake();
        }
    };
    tell(&mut there, done, true);
    let options = BatchOptions {
        config: of.config,
        precision: of.precision,
        warm_start: false,
        params_folder: None,
        ply: false,
        curves_folder: None,
        ..BatchOptions::default()
    };
    let fitted = run_batch(dataset, &todo, &options, |row| {
        progress.wait_while_paused();
        file.add(&row, stamps.of(row.index)).map_err(|error| StudyError::Internal { message: error.to_string() })?;
        done += 1;
        tell(&mut vec![row], done, false);
        progress.check().map_err(|_| StudyError::Cancelled)
    });
    match fitted {
        Ok(()) => Ok(true),
        Err(StudyError::Cancelled) => Ok(false),
        Err(error) => Err(error.to_string()),
    }
}

/// What earlier batches left of a data set.
pub(super) fn kept(dataset: &Dataset) -> (Vec<KeptFits>, Vec<String>) {
    let place = LabelPlace::to_read(&dataset.info().root, dataset.fingerprint());
    let folders: Vec<PathBuf> = std::iter::once(place.folder).chain(place.also).collect();
    let mut stamps = FrameStamps::new(dataset);
    kept_fits(&folders, dataset.fingerprint(), |index| if index < dataset.len() { stamps.of(index) } else { None })
}
