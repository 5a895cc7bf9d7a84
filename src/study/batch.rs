//! Fits of many frames, some at a time, told in the order of the data set.
//!
//! Each thread takes the next frame, loads it, fits it, writes its parameters and lets go of it, so that no more frames
//! are in memory than there are threads. Plain threads and not rayon's: a thread of rayon's that waits inside one fit
//! may begin another meanwhile, and the times of both would be wrong.

use super::{FitNumbers, FrameFit, FrameRow, StudyError};
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::{Dataset, panic_text, write_pppr};
use crate::diagnose::joint_errors;
use crate::geometry::Vec3;
use crate::mhp::{FitError, Fitter, Precision, Problem, StopReason, initialise};
use crossbeam_channel::Sender;
use std::collections::{BTreeMap, HashSet};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// How a batch is run.
#[derive(Debug, Clone)]
pub struct BatchOptions {
    /// Settings of every fit.
    pub config: FitConfig,
    /// Scalar of the per-cell kernel.
    pub precision: Precision,
    /// Start a frame from the result of the frame before, where both are of one sequence; one frame at a time then.
    pub warm_start: bool,
    /// The folder that the parameters are written to, an npz a frame; it must exist.
    pub params_folder: Option<PathBuf>,
}

/// Fits one frame: from `start` where it is given, else from its own peaks.
///
/// # Errors
/// One line that names the file: it cannot be read, has no finite cell, shows nobody, or the fit diverged.
pub fn fit_frame(
    dataset: &Dataset,
    index: usize,
    options: &BatchOptions,
    start: Option<Pppr>,
) -> Result<FrameFit, String> {
    let in_file = |error: &dyn std::fmt::Display| format!("{}: {error}", dataset.frame_path(index).display());
    let frame = dataset.load(index).map_err(|error| error.to_string())?;
    let info = dataset.info();
    let maps: Vec<&[f64]> = frame.maps.iter().map(|map| map.data.as_slice()).collect();
    let problem = Problem::new(info.radar.clone(), info.skeleton.clone(), info.views.clone(), &maps);
    let problem = Arc::new(problem.map_err(|error| in_file(&error))?);
    let began = Instant::now();
    let (initial, init_ms) = if let Some(params) = start {
        (params, None)
    } else {
        let found = initialise(&problem, &options.config).map_err(|error| in_file(&error))?;
        (found.params, Some(milliseconds(began)))
    };
    let began = Instant::now();
    let mut fitter =
        Fitter::new(problem, options.config, options.precision, initial).map_err(|error| in_file(&error))?;
    let reason = run(&mut fitter).map_err(|error| in_file(&error))?;
    let fit_ms = milliseconds(began);
    let (report, params) = (fitter.report(), fitter.params().clone());
    let joints: Vec<Vec3> = (0..params.shape().total_joints()).map(|joint| params.position(joint)).collect();
    let errors = frame.truth.and_then(|truth| joint_errors(&joints, &truth.joints, info.skeleton.joints.len()));
    let (majpe_mm, pa_majpe_mm) = (errors.map(|e| e.majpe_mm), errors.map(|e| e.pa_majpe_mm));
    Ok(FrameFit { numbers: FitNumbers { report, reason, majpe_mm, pa_majpe_mm, init_ms, fit_ms }, params })
}

/// Steps until the configuration says to stop.
fn run(fitter: &mut Fitter) -> Result<StopReason, FitError> {
    let config = *fitter.config();
    while fitter.iteration() < config.iterations {
        if fitter.step()?.converged && config.stop_when_converged {
            return Ok(StopReason::Converged);
        }
    }
    Ok(StopReason::Iterations)
}

fn milliseconds(began: Instant) -> f64 {
    // A microsecond is all that such a time is worth.
    (began.elapsed().as_secs_f64() * 1e6).round() / 1e3
}

/// Fits `frames` and hands every row to `sink`, in the order of the data set, as soon as it and those before it are
/// done. A frame that fails is a row with the reason, and the batch goes on; an error of `sink` ends it.
///
/// # Errors
/// What `sink` said, or that there is no thread to fit on.
pub fn run_batch(
    dataset: &Dataset,
    frames: Range<usize>,
    options: &BatchOptions,
    mut sink: impl FnMut(FrameRow) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    let batch = Batch {
        dataset,
        options,
        files: options.params_folder.as_deref().map(|folder| Files::new(folder, dataset, frames.clone())),
        next: AtomicUsize::new(frames.start),
        end: frames.end,
    };
    let threads = if options.warm_start { 1 } else { rayon::current_num_threads().clamp(1, frames.len().max(1)) };
    let (outbox, inbox) = crossbeam_channel::bounded::<FrameRow>(threads);
    std::thread::scope(|scope| {
        // The inbox goes with this closure: after an error the threads find nobody listening, and end.
        let inbox = inbox;
        for k in 0..threads {
            let (batch, outbox) = (&batch, outbox.clone());
            let named = std::thread::Builder::new().name(format!("fit {k}"));
            named.spawn_scoped(scope, move || batch.work(&outbox)).map_err(|reason| StudyError::Thread { reason })?;
        }
        drop(outbox);
        let mut early = BTreeMap::new();
        let mut due = frames.start;
        for row in inbox {
            early.insert(row.index, row);
            while let Some(row) = early.remove(&due) {
                sink(row)?;
                due += 1;
            }
        }
        Ok(())
    })
}

/// What the threads of a batch share.
struct Batch<'a> {
    dataset: &'a Dataset,
    options: &'a BatchOptions,
    files: Option<Files<'a>>,
    next: AtomicUsize,
    end: usize,
}

impl Batch<'_> {
    /// Takes frames until none is left or nobody listens.
    fn work(&self, outbox: &Sender<FrameRow>) {
        let mut before: Option<(usize, Pppr)> = None;
        loop {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            if index >= self.end {
                return;
            }
            let start = before.take().filter(|(last, _)| self.follows(*last, index)).map(|(_, params)| params);
            let fit = caught(|| self.fit_and_keep(index, start)).map(|fit| {
                before = Some((index, fit.params));
                fit.numbers
            });
            if outbox.send(FrameRow { index, frame: self.dataset.frame_name(index), fit }).is_err() {
                return;
            }
        }
    }

    fn follows(&self, last: usize, index: usize) -> bool {
        self.options.warm_start && self.dataset.sequence(last) == self.dataset.sequence(index)
    }

    fn fit_and_keep(&self, index: usize, start: Option<Pppr>) -> Result<FrameFit, String> {
        let fit = fit_frame(self.dataset, index, self.options, start)?;
        if let Some(files) = &self.files {
            write_pppr(&files.path(self.dataset, index), &fit.params).map_err(|error| error.to_string())?;
        }
        Ok(fit)
    }
}

/// A panic is a defect in this program; one frame of thousands must not end the others.
fn caught<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(format!("internal error: {}", panic_text(panic.as_ref()))))
}

/// The file of a frame: its name with `_` for `/`, and with its index where two names would become one.
struct Files<'a> {
    folder: &'a Path,
    ambiguous: HashSet<usize>,
}

impl<'a> Files<'a> {
    fn new(folder: &'a Path, dataset: &Dataset, frames: Range<usize>) -> Self {
        let mut seen = HashSet::new();
        let ambiguous = frames.filter(|&index| !seen.insert(flat(&dataset.frame_name(index)))).collect();
        Self { folder, ambiguous }
    }

    fn path(&self, dataset: &Dataset, index: usize) -> PathBuf {
        let name = flat(&dataset.frame_name(index));
        let ending = if self.ambiguous.contains(&index) { format!("_{index}.npz") } else { ".npz".to_owned() };
        self.folder.join(name + &ending)
    }
}

fn flat(name: &str) -> String {
    name.replace(['/', '\\'], "_")
}
