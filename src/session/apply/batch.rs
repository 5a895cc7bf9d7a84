//! Fits of the listed frames: asked for, taken in as they come, found again.

use crate::dataset::Dataset;
use crate::session::batch::{BatchRequest, summary};
use crate::session::effect::Effect;
use crate::session::state::{LogLevel, Session};
use crate::session::work::WorkStatus;
use crate::study::{BatchRow, FitsOf, KeptFits};
use std::sync::Arc;

impl Session {
    /// The frames that a batch would fit: the selected ones, else those in the list, in its order.
    pub fn batch_frames(&self) -> Arc<[u32]> {
        if self.labels.selection.is_empty() { self.queue.rows().into() } else { self.label_targets() }
    }

    pub(super) fn fit_listed(&mut self) -> Vec<Effect> {
        let Some(dataset) = self.data.dataset.clone() else { return Vec::new() };
        if self.batch.is_running() {
            return Vec::new();
        }
        let frames = self.batch_frames();
        if frames.is_empty() {
            self.note(LogLevel::Warning, "no frame matches the filter: there is nothing to fit".into());
            return Vec::new();
        }
        let of = FitsOf::new(dataset.fingerprint(), self.config, self.precision);
        if self.batch.shown.as_ref() != Some(&of) {
            // Fits with other settings and these are not of one table.
            self.forget_batch();
        }
        self.results_from = None;
        self.batch.begin(of.clone(), frames.len());
        vec![Effect::StartBatch(Box::new(BatchRequest { dataset, frames, of }))]
    }

    /// Takes what a batch said out of the list.
    pub(super) fn forget_batch(&mut self) {
        self.batch.forget();
        if self.summaries.values().any(|summary| summary.batch) {
            self.summaries.change().retain(|_, summary| !summary.batch);
        }
    }

    pub(super) fn pause_batch(&mut self) -> Vec<Effect> {
        self.batch.work.toggle_pause().map(Effect::PauseBatch).into_iter().collect()
    }

    pub(super) fn cancel_batch(&mut self) -> Vec<Effect> {
        if self.batch.is_running() { vec![Effect::CancelBatch] } else { Vec::new() }
    }

    /// Rows of a batch, or of one that was kept. A frame that was fitted by hand keeps what its fit says.
    pub(super) fn batch_rows(&mut self, dataset: &Arc<Dataset>, rows: Vec<BatchRow>, done: u64) -> Vec<Effect> {
        if !self.is_open(dataset) {
            return Vec::new();
        }
        if let WorkStatus::Running { total, .. } = self.batch.work.status {
            self.batch.work.advance(done, total);
        }
        self.take_rows(rows);
        Vec::new()
    }

    fn take_rows(&mut self, rows: Vec<BatchRow>) {
        if rows.is_empty() {
            return;
        }
        let counted = self.batch.shown.as_ref().is_some_and(|of| of.config.people == 0);
        let summaries = self.summaries.change();
        for row in rows {
            self.batch.take(&row);
            let own = summaries.get(&row.index).is_some_and(|summary| summary.hashes.is_some());
            if !own {
                summaries.insert(row.index, summary(&row, counted));
            }
        }
    }

    fn is_open(&self, dataset: &Arc<Dataset>) -> bool {
        self.data.dataset.as_ref().is_some_and(|open| Arc::ptr_eq(open, dataset))
    }

    /// A batch ended: all frames, or as many as there were when it was cancelled; or it could not go on.
    pub(super) fn batch_done(&mut self, dataset: &Arc<Dataset>, result: Result<bool, String>) -> Vec<Effect> {
        if !self.is_open(dataset) {
            return Vec::new();
        }
        let WorkStatus::Running { done, total, .. } = std::mem::take(&mut self.batch.work).status else {
            return Vec::new();
        };
        let failed = match self.batch.failed() {
            0 => String::new(),
            n => format!("; {n} could not be fitted, the list says why (column Reason)"),
        };
        match result {
            Ok(true) => self.hint(format!("{done} frames fitted{failed}")),
            Ok(false) => {
                self.hint(format!("stopped after {done} of {total} frames; “Fit listed” goes on from there{failed}"));
            }
            Err(why) => self.note(LogLevel::Error, format!("the batch stopped after {done} of {total} frames: {why}")),
        }
        Vec::new()
    }

    /// What earlier batches left beside the data that was just opened: those with the settings in force, else the newest.
    pub(super) fn kept_found(
        &mut self,
        dataset: &Arc<Dataset>,
        mut kept: Vec<KeptFits>,
        faults: Vec<String>,
    ) -> Vec<Effect> {
        if !self.is_open(dataset) {
            return Vec::new();
        }
        for fault in faults {
            self.note(LogLevel::Warning, format!("kept fits: {fault}"));
        }
        if self.batch.shown.is_some() {
            return Vec::new();
        }
        let of = FitsOf::new(dataset.fingerprint(), self.config, self.precision);
        kept.retain(|kept| !kept.rows.is_empty());
        let same = kept.iter().position(|kept| kept.of == of);
        let Some(found) = same.or(kept.len().checked_sub(1)).map(|at| kept.swap_remove(at)) else { return Vec::new() };
        let name = |row: &BatchRow| row.index < dataset.len() && dataset.frame_name(row.index) == row.frame;
        let rows: Vec<BatchRow> = found.rows.into_values().filter(name).collect();
        let (count, of) = (rows.len(), self.data.len());
        self.batch.shown = Some(found.of);
        self.take_rows(rows);
        let stale = self.batch.stale(&self.config, self.precision);
        let what = stale.map_or_else(|| "with the settings in force".into(), |stale| format!("stale: {stale}"));
        self.note(LogLevel::Info, format!("fits of {count} of {of} frames were kept by an earlier batch, {what}"));
        Vec::new()
    }
}
