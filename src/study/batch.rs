//! Fits of many frames, some at a time, told in the order of the data set.
//!
//! Each thread takes the next frame, loads it, fits it, writes its parameters and lets go of it, so that no more frames
//! are in memory than there are threads. Plain threads and not rayon's: a thread of rayon's that waits inside one fit
//! may begin another meanwhile, and the times of both would be wrong.

use super::row::annotated;
use super::{BatchRow, CurveRow, FitNumbers, FrameFit, StudyError, write_curves, write_ply};
use crate::body::Pppr;
use crate::condition::{Breakpoint, Watch};
use crate::config::FitConfig;
use crate::dataset::{Dataset, Truth, write_pppr};
use crate::diagnose::{JointErrors, joint_errors};
use crate::geometry::{Vec3, mean};
use crate::mhp::{ErasedCells, FitState, Fitter, Precision, StepReport, predict, without};
use crate::output::{FileNames, Inputs};
use crate::people::Tracker;
use crate::predictions::{Predictions, start_of};
use crate::start::{find_start_along, problem_of};
use crate::task::{milliseconds, panic_as_error};
use crossbeam_channel::Sender;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// How a batch is run.
#[derive(Debug, Clone, Default)]
pub struct BatchOptions {
    /// Settings of every fit.
    pub config: FitConfig,
    /// Scalar of the per-cell kernel.
    pub precision: Precision,
    /// Start a frame from the result of the frame before, where both are of one sequence; one frame at a time then.
    pub warm_start: bool,
    /// The folder that the parameters are written to, an npz a frame; it must exist.
    pub params_folder: Option<PathBuf>,
    /// Write the Gaussians beside the parameters, a PLY a frame.
    pub ply: bool,
    /// The folder that every iteration is written to, a CSV a frame; it must exist.
    pub curves_folder: Option<PathBuf>,
    /// A fit stops at the first iteration at which one of these holds.
    pub breakpoints: Vec<Breakpoint>,
    /// Cells that no fit sees, neither in its frame nor in those around; a start that is sought sees them.
    pub erased: Vec<ErasedCells>,
    /// Begin every frame at what is predicted of it; one of which nothing is predicted fails.
    pub init: Option<Arc<Predictions>>,
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
    fit_watched(dataset, index, options, start, None)
}

/// As [`fit_frame`]; `watch` sees every iteration, the start included, with its mean joint error in mm where there is truth.
fn fit_watched(
    dataset: &Dataset,
    index: usize,
    options: &BatchOptions,
    start: Option<Pppr>,
    mut watch: Option<&mut dyn FnMut(StepReport, Option<f64>)>,
) -> Result<FrameFit, String> {
    let in_file = |error: &dyn std::fmt::Display| format!("{}: {error}", dataset.frame_path(index).display());
    let frame = dataset.load(index).map_err(|error| error.to_string())?;
    let info = dataset.info();
    let problem = Arc::new(problem_of(dataset, &frame).map_err(|error| in_file(&error))?);
    let began = Instant::now();
    let predicted = |source: &Predictions| {
        let found = start_of(source, dataset, index, &problem, &options.config);
        found.ok_or_else(|| format!("{}: nothing is predicted of {}", source.path.display(), dataset.frame_name(index)))
    };
    let (state, init_ms) = if let Some(source) = &options.init {
        (FitState::given(predicted(source)?), None)
    } else if let Some(params) = start {
        (FitState::at_start(predict(&problem, &options.config, &params)), None)
    } else {
        let found = find_start_along(dataset, index, &problem, &options.config)
            .map_err(|error| in_file(&error))?
            .initialisation;
        (FitState::at_start(found.params), Some(milliseconds(began)))
    };
    let began = Instant::now();
    let seen = without(&problem, &options.erased).map_err(|error| in_file(&error))?;
    let initial = state.params.clone();
    let mut fitter =
        Fitter::starting_at(seen, options.config, options.precision, state).map_err(|error| in_file(&error))?;
    let errors = |params: &Pppr| errors(params, frame.truth.as_ref()?, info.skeleton.joints.len());
    let (mut breaks, mut broke, mut first) = (Watch::new(options.breakpoints.clone()), None, true);
    let unwatched = watch.is_none() && options.breakpoints.is_empty();
    let stops = |fitter: &Fitter| {
        let majpe_mm = errors(fitter.params()).map(|e| e.majpe_mm);
        if let Some(watch) = watch.as_mut() {
            watch(fitter.report(), majpe_mm);
        }
        if std::mem::take(&mut first) {
            breaks.begin(fitter, majpe_mm);
            return false;
        }
        broke = breaks.step(fitter, majpe_mm);
        broke.is_some()
    };
    let last = options.config.iterations;
    let run = if unwatched { fitter.run_unseen(last, |_| false) } else { fitter.run_until(last, stops) };
    let reason = run.map_err(|error| in_file(&error))?;
    let breakpoint = broke.and_then(|which| options.breakpoints.get(which)).map(ToString::to_string);
    let fit_ms = milliseconds(began);
    let (report, params) = (fitter.report(), fitter.params().clone());
    let errors = errors(&params);
    let (majpe_mm, pa_majpe_mm) = (errors.map(|e| e.majpe_mm), errors.map(|e| e.pa_majpe_mm));
    let (people, annotated) = (params.shape().persons, annotated(&frame));
    let numbers = FitNumbers { report, reason, breakpoint, people, annotated, majpe_mm, pa_majpe_mm, init_ms, fit_ms };
    Ok(FrameFit { numbers, initial, params })
}

fn errors(params: &Pppr, truth: &Truth, joints: usize) -> Option<JointErrors> {
    joint_errors(params.positions(), &truth.joints, joints)
}

/// Fits `frames` and hands every row to `sink`, in their order, as soon as it and those before it are done. A frame that fails is a row with the reason, and the batch goes on; an error of `sink` ends it.
///
/// # Errors
/// What `sink` said, or that there is no thread to fit on.
pub fn run_batch(
    dataset: &Dataset,
    frames: &[usize],
    options: &BatchOptions,
    mut sink: impl FnMut(BatchRow) -> Result<(), StudyError>,
) -> Result<(), StudyError> {
    let batch = Batch {
        dataset,
        options,
        names: dataset.file_names(),
        inputs: dataset.inputs(),
        next: AtomicUsize::new(0),
        frames,
    };
    let threads = if options.warm_start { 1 } else { rayon::current_num_threads().clamp(1, frames.len().max(1)) };
    let mut persons = PersonOrder::default();
    let (outbox, inbox) = crossbeam_channel::bounded::<Done>(threads);
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
        let mut due = 0;
        for done in inbox {
            early.insert(done.place, done);
            while let Some(Done { mut row, several, .. }) = early.remove(&due) {
                if let Some(params) = several {
                    let ordered = persons.ordered(dataset, row.index, &params);
                    if let Err(why) = panic_as_error(|| batch.keep(row.index, &ordered)) {
                        row.fit = Err(why);
                    }
                }
                sink(row)?;
                due += 1;
            }
        }
        Ok(())
    })
}

/// A frame that was fitted.
struct Done {
    /// Its place among the frames of the batch.
    place: usize,
    row: BatchRow,
    /// Parameters of several persons that are to be kept: in which order the frames before tell.
    several: Option<Pppr>,
}

/// The order of persons from frame to frame: who comes first stays first, as long as a sequence is followed.
#[derive(Default)]
struct PersonOrder {
    tracker: Tracker,
    last: Option<usize>,
}

/// Seconds a frame where the data set does not say.
const FRAME_S: f64 = 0.1;

impl PersonOrder {
    /// The persons of a frame in the order of their identities.
    fn ordered(&mut self, dataset: &Dataset, index: usize, params: &Pppr) -> Pppr {
        let before = self.last.replace(index);
        let before = before.filter(|last| *last < index && dataset.sequence(*last) == dataset.sequence(index));
        if before.is_none() {
            self.tracker = Tracker::default();
        }
        let frame_s = dataset.info().frame_rate_hz.filter(|rate| *rate > 0.0).map_or(FRAME_S, f64::recip);
        let apart_s = before.map_or(0, |last| index - last) as f64 * frame_s;
        let persons = params.shape().persons;
        let places: Vec<Vec3> = (0..persons).map(|person| mean(params.person(person))).collect();
        let identities = self.tracker.step(&places, apart_s);
        let mut order: Vec<usize> = (0..persons).collect();
        order.sort_by_key(|&person| identities.get(person).copied().unwrap_or(person));
        params.with_persons(&order)
    }
}

/// What the threads of a batch share.
struct Batch<'a> {
    dataset: &'a Dataset,
    options: &'a BatchOptions,
    names: FileNames,
    inputs: Inputs<'a>,
    next: AtomicUsize,
    frames: &'a [usize],
}

impl Batch<'_> {
    /// Takes frames until none is left or nobody listens.
    fn work(&self, outbox: &Sender<Done>) {
        let several = self.options.params_folder.is_some() && self.options.config.people != 1;
        let mut before: Option<(usize, Pppr)> = None;
        loop {
            let place = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(&index) = self.frames.get(place) else { return };
            let start = before.take().filter(|(last, _)| self.follows(*last, index)).map(|(_, params)| params);
            let mut kept = None;
            let fit = panic_as_error(|| {
                let fit = self.fit(index, start)?;
                if several {
                    kept = Some(fit.params.clone());
                } else {
                    self.keep(index, &fit.params)?;
                }
                Ok(fit)
            });
            let mut joints = None;
            let fit = fit.map(|fit| {
                joints = Some(fit.params.positions().iter().map(|p| p.map(|x| x as f32)).collect());
                before = Some((index, fit.params));
                fit.numbers
            });
            let row = BatchRow { index, frame: self.dataset.frame_name(index).to_owned(), fit, joints };
            let several = kept.filter(|_| row.fit.is_ok());
            if outbox.send(Done { place, row, several }).is_err() {
                return;
            }
        }
    }

    fn follows(&self, last: usize, index: usize) -> bool {
        self.options.warm_start && last + 1 == index && self.dataset.sequence(last) == self.dataset.sequence(index)
    }

    /// Fits a frame, and writes its iterations where that is asked.
    fn fit(&self, index: usize, start: Option<Pppr>) -> Result<FrameFit, String> {
        let (dataset, options) = (self.dataset, self.options);
        let mut rows = Vec::new();
        let mut keep = |report, majpe_mm| rows.push((report, majpe_mm));
        let watch = options.curves_folder.is_some().then_some(&mut keep as &mut dyn FnMut(StepReport, Option<f64>));
        let fit = fit_watched(dataset, index, options, start, watch)?;
        if let Some(folder) = &options.curves_folder {
            let arrays: Vec<String> = dataset.info().views.iter().map(|view| view.array.clone()).collect();
            let rows =
                rows.iter().map(|(report, majpe_mm)| CurveRow { branch: 0, report, majpe_mm: *majpe_mm, flag: None });
            write_curves(&self.file(index, folder, "csv")?, &arrays, rows).map_err(|error| error.to_string())?;
        }
        Ok(fit)
    }

    /// Writes the parameters of a frame where that is asked.
    fn keep(&self, index: usize, params: &Pppr) -> Result<(), String> {
        let Some(folder) = &self.options.params_folder else { return Ok(()) };
        write_pppr(&self.file(index, folder, "npz")?, params).map_err(|error| error.to_string())?;
        if self.options.ply {
            let written = write_ply(&self.file(index, folder, "ply")?, params, &self.dataset.info().skeleton);
            written.map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// The file of a frame in a folder of results.
    fn file(&self, index: usize, folder: &Path, ending: &str) -> Result<PathBuf, String> {
        let name = self.names.of(index, self.dataset.frame_name(index));
        let file = folder.join(format!("{name}.{ending}"));
        self.inputs.check_replaced(&file).map_err(|error| error.to_string()).map(|()| file)
    }
}
