//! The threads of a run: each takes a unit, fits, and appends its rows to the journal before it takes the next.
//!
//! Plain threads: a thread of rayon's that waits inside one fit may begin another, and the times of both would be wrong.

use super::counting;
use super::error::RunError;
use super::fit::{LoadedFrame, Stop, TimedStart, fit_key};
use super::journal::{Rows, RunJournal};
use super::plan::{RunPlan, Unit};
use super::row::{RunNumbers, RunRow};
use super::variant::StartFrom;
use crate::body::Pppr;
use crate::dataset::{Dataset, read_pppr, write_pppr};
use crate::task::{Progress, panic_as_error};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// The folder, inside a run's, of the last parameters of each chain that is under way.
const CHAINS: &str = "chains";

/// Does all units of `plan` that `journal` does not hold yet with `threads` threads, and returns all rows.
///
/// # Errors
/// Where the journal cannot be written or there is no thread; on cancel [`crate::study::StudyError::Cancelled`].
pub(super) fn execute(
    dataset: &Dataset,
    plan: &RunPlan,
    (journal, rows): (RunJournal, Rows),
    folder: &Path,
    threads: usize,
    progress: &Progress,
    grown: &(dyn Fn(&Rows) + Sync),
) -> Result<Rows, RunError> {
    let done: BTreeSet<(usize, usize)> = rows.keys().copied().collect();
    let engine = Engine {
        dataset,
        plan,
        chains: folder.join(CHAINS),
        done,
        studied: plan.frames.iter().copied().collect(),
        next: AtomicUsize::new(0),
        kept: Mutex::new(Kept { journal, rows, fault: None }),
        progress,
        grown,
    };
    progress.begin("fitting", plan.rows() as u64);
    progress.advance(engine.done.len() as u64);
    std::thread::scope(|scope| {
        for k in 0..threads.clamp(1, plan.units.len().max(1)) {
            let engine = &engine;
            let named = std::thread::Builder::new().name(format!("study {k}"));
            named.spawn_scoped(scope, move || engine.work()).map_err(|reason| RunError::Thread { reason })?;
        }
        Ok::<(), RunError>(())
    })?;
    let kept = engine.kept.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(fault) = kept.fault {
        return Err(fault);
    }
    if progress.is_cancelled() {
        return Err(crate::study::StudyError::Cancelled.into());
    }
    let _ = std::fs::remove_dir_all(folder.join(CHAINS));
    Ok(kept.rows)
}

/// What the threads write.
struct Kept {
    journal: RunJournal,
    rows: Rows,
    fault: Option<RunError>,
}

/// What the threads share.
struct Engine<'a> {
    dataset: &'a Dataset,
    plan: &'a RunPlan,
    chains: PathBuf,
    /// What the journal held at the start.
    done: BTreeSet<(usize, usize)>,
    studied: BTreeSet<usize>,
    next: AtomicUsize,
    kept: Mutex<Kept>,
    progress: &'a Progress,
    /// Told of every new row, one at a time.
    grown: &'a (dyn Fn(&Rows) + Sync),
}

/// The journal could not be written, or somebody pressed cancel: the thread ends.
struct Halt;

impl Engine<'_> {
    fn work(&self) {
        while let Some(unit) = self.plan.units.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            let did = match unit {
                Unit::Chain { variant, frames } => self.chain(*variant, frames),
                Unit::Frame { frame, variants } => self.frame(*frame, variants),
                Unit::Count { variant, frames } => self.count(*variant, frames),
            };
            if did.is_err() {
                return;
            }
        }
    }

    fn halted(&self) -> Result<(), Halt> {
        self.progress.wait_while_paused();
        let fault = self.kept.lock().unwrap_or_else(PoisonError::into_inner).fault.is_some();
        if fault || self.progress.is_cancelled() { Err(Halt) } else { Ok(()) }
    }

    /// One frame under variants that start alike.
    fn frame(&self, frame: usize, variants: &[usize]) -> Result<(), Halt> {
        self.halted()?;
        let missing: Vec<usize> = variants.iter().copied().filter(|&v| !self.done.contains(&(v, frame))).collect();
        let Some(&first) = missing.first() else { return Ok(()) };
        let started = panic_as_error(|| {
            let loaded = LoadedFrame::read(self.dataset, frame, &self.plan.spec.erased)?;
            let variant = &self.plan.spec.variants[first];
            let start = match variant.start {
                StartFrom::Truth => loaded.truth_start(&variant.config)?,
                StartFrom::Cold | StartFrom::Warm => loaded.cold(&variant.config)?,
            };
            Ok((loaded, start))
        });
        match started {
            Ok((loaded, start)) => {
                self.same_fits(&missing).into_iter().try_for_each(|fits| self.fits(frame, &loaded, &start, &fits))
            }
            Err(why) => missing.into_iter().try_for_each(|variant| self.keep(variant, frame, None, Err(why.clone()))),
        }
    }

    /// Variants in groups that differ in the number of iterations only, ascending.
    fn same_fits(&self, variants: &[usize]) -> Vec<Vec<usize>> {
        let config = |v: usize| &self.plan.spec.variants[v].config;
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for &variant in variants {
            match groups.iter_mut().find(|group| fit_key(config(group[0])) == fit_key(config(variant))) {
                Some(group) => group.push(variant),
                None => groups.push(vec![variant]),
            }
        }
        for group in &mut groups {
            group.sort_by_key(|&v| (config(v).iterations, v));
        }
        groups
    }

    fn fits(&self, frame: usize, loaded: &LoadedFrame<'_>, start: &TimedStart, variants: &[usize]) -> Result<(), Halt> {
        let spec = &self.plan.spec;
        let Some(&longest) = variants.last() else { return Ok(()) };
        let stops: Vec<usize> = variants.iter().map(|&v| spec.variants[v].config.iterations).collect();
        let config = &spec.variants[longest].config;
        let answers = panic_as_error(|| Ok(loaded.fit(config, spec.precision, start, &stops)));
        let answers = answers.unwrap_or_else(|why| stops.iter().map(|_| Err(why.clone())).collect());
        for (&variant, answer) in variants.iter().zip(answers) {
            self.keep(variant, frame, start.init_ms, answer)?;
        }
        Ok(())
    }

    /// The frames of a sequence, each from the one before.
    fn chain(&self, variant: usize, frames: &[usize]) -> Result<(), Halt> {
        let Some(first) = frames.iter().position(|&frame| !self.done.contains(&(variant, frame))) else {
            return Ok(());
        };
        let (from, mut before) = self.chain_at(variant, frames, first);
        for (k, &frame) in frames.iter().enumerate().skip(from) {
            self.halted()?;
            let (init_ms, answer) = self.link(variant, frame, before.take().as_ref());
            before = answer.as_ref().ok().map(|stop| stop.params.clone());
            if k < first {
                continue;
            }
            // On disk before the row is: a row in the journal means that the chain can go on behind it.
            if let Some(params) = before.as_ref().filter(|_| k + 1 < frames.len()) {
                self.keep_params(variant, frame, params);
            }
            self.keep(variant, frame, init_ms, answer)?;
            if let Some(&old) = k.checked_sub(1).and_then(|k| frames.get(k)) {
                let _ = std::fs::remove_file(self.params_file(variant, old));
            }
        }
        Ok(())
    }

    /// Frames whose people are counted: all again where one is missing, because each is counted with those before it.
    fn count(&self, variant: usize, frames: &[usize]) -> Result<(), Halt> {
        self.halted()?;
        let missing = |frame: &usize| !self.done.contains(&(variant, *frame));
        if !frames.iter().any(missing) {
            return Ok(());
        }
        let method = self.plan.spec.variants[variant].method;
        let counted = panic_as_error(|| Ok(counting::count(self.dataset, method, frames)));
        let counted = counted.unwrap_or_else(|why| frames.iter().map(|_| (Err(why.clone()), None)).collect());
        for (&frame, (numbers, ms)) in frames.iter().zip(counted).filter(|(frame, _)| missing(frame)) {
            self.keep_numbers(variant, frame, [None, ms], numbers)?;
        }
        Ok(())
    }

    /// Where in `frames` to go on for the row of `first`, and what the frame before ended with. Where that is not on disk the
    /// chain is done again from its beginning.
    fn chain_at(&self, variant: usize, frames: &[usize], first: usize) -> (usize, Option<Pppr>) {
        let Some(&before) = first.checked_sub(1).and_then(|k| frames.get(k)) else { return (first, None) };
        let failed = {
            let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.rows.get(&(variant, before)).is_some_and(|row| row.fit.is_err())
        };
        if failed {
            return (first, None);
        }
        match read_pppr(&self.params_file(variant, before), None) {
            Ok(params) => (first, Some(params)),
            Err(_) => (0, None),
        }
    }

    fn link(&self, variant: usize, frame: usize, before: Option<&Pppr>) -> (Option<f64>, Result<Stop, String>) {
        let spec = &self.plan.spec;
        let config = &spec.variants[variant].config;
        let mut init_ms = None;
        let answer = panic_as_error(|| {
            let loaded = LoadedFrame::read(self.dataset, frame, &self.plan.spec.erased)?;
            let start = before.map_or_else(|| loaded.cold(config), |before| Ok(loaded.warm(config, before)))?;
            init_ms = start.init_ms;
            let mut answers = loaded.fit(config, spec.precision, &start, &[config.iterations]);
            answers.pop().unwrap_or_else(|| Err("internal error: a fit without an answer".into()))
        });
        (init_ms, answer)
    }

    fn params_file(&self, variant: usize, frame: usize) -> PathBuf {
        self.chains.join(format!("{variant:04}-{frame:08}.npz"))
    }

    /// That they cannot be written costs time on resuming, no more.
    fn keep_params(&self, variant: usize, frame: usize, params: &Pppr) {
        let written = std::fs::create_dir_all(&self.chains).map_err(|error| error.to_string());
        let file = self.params_file(variant, frame);
        if let Err(error) = written.and_then(|()| write_pppr(&file, params).map_err(|error| error.to_string())) {
            tracing::warn!("{error}");
        }
    }

    fn keep(
        &self,
        variant: usize,
        frame: usize,
        init_ms: Option<f64>,
        answer: Result<Stop, String>,
    ) -> Result<(), Halt> {
        let fit_ms = answer.as_ref().ok().map(|stop| stop.fit_ms);
        self.keep_numbers(variant, frame, [init_ms, fit_ms], answer.map(|stop| stop.numbers))
    }

    fn keep_numbers(
        &self,
        variant: usize,
        frame: usize,
        [init_ms, fit_ms]: [Option<f64>; 2],
        fit: Result<RunNumbers, String>,
    ) -> Result<(), Halt> {
        let row = RunRow {
            variant,
            frame,
            name: self.dataset.frame_name(frame).to_owned(),
            sequence: self.dataset.sequence(frame).to_owned(),
            origin: self.dataset.origin(frame),
            stratum: self.plan.strata.get(frame).copied().flatten(),
            passing: !self.studied.contains(&frame),
            fit,
            init_ms,
            fit_ms,
        };
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.fault.is_some() {
            return Err(Halt);
        }
        if let Err(fault) = kept.journal.add(&row) {
            kept.fault = Some(fault);
            return Err(Halt);
        }
        kept.rows.insert((variant, frame), row);
        (self.grown)(&kept.rows);
        drop(kept);
        self.progress.advance(1);
        Ok(())
    }
}
