//! Fits of many frames at once: how far they are, and what those in the list are of.

use super::state::FrameSummary;
use super::work::Work;
use crate::config::{FitConfig, difference};
use crate::mhp::Precision;
use crate::study::{BatchRow, FitsOf};
use std::collections::HashMap;
use std::sync::Arc;

/// The batch of the open data set.
#[derive(Debug, Default)]
pub struct Batch {
    /// How far it is.
    pub work: Work,
    /// What the fits in the list are of that a batch made, here or before.
    pub shown: Option<FitsOf>,
    /// Frames that a batch had: whether it could fit them. One that goes on tells of frames that were known before.
    had: HashMap<usize, bool>,
    /// How many of these it could fit.
    fitted: usize,
}

impl Batch {
    /// A batch begins with this many frames.
    pub(super) fn begin(&mut self, of: FitsOf, total: usize) {
        self.work.begin(total as u64);
        self.shown = Some(of);
    }

    /// Says nothing of any frame any more.
    pub(super) fn forget(&mut self) {
        self.had.clear();
        (self.fitted, self.shown) = (0, None);
    }

    /// A frame was had.
    pub(super) fn take(&mut self, row: &BatchRow) {
        let before = self.had.insert(row.index, row.fit.is_ok());
        self.fitted = self.fitted + usize::from(row.fit.is_ok()) - usize::from(before == Some(true));
    }

    /// Frames that a batch fitted, here or before.
    pub fn fitted(&self) -> usize {
        self.fitted
    }

    /// Frames that it could not fit.
    pub fn failed(&self) -> usize {
        self.had.len() - self.fitted
    }

    /// True while frames are being fitted.
    pub fn is_running(&self) -> bool {
        self.work.is_running()
    }

    /// What sets the fits in the list apart from what would be fitted now: another program, another scalar, other settings;
    /// `None` where nothing does. (Those of files that changed are not in the list.)
    pub fn stale(&self, config: &FitConfig, precision: Precision) -> Option<String> {
        let of = self.shown.as_ref()?;
        if of.program != env!("CARGO_PKG_VERSION") {
            return Some(format!("by version {} of the program", of.program));
        }
        if of.precision != precision {
            return Some(format!("in {:?}", of.precision).to_lowercase());
        }
        // How long a run takes is a setting of the fits of a batch too.
        let what = difference(config, &of.config);
        (!what.is_empty()).then(|| format!("with {what}"))
    }
}

/// What the list says of a fit of a batch; `counted` where as many people were fitted as were counted.
pub(super) fn summary(row: &BatchRow, counted: bool) -> FrameSummary {
    let reason = Some(row.reason());
    let Ok(fit) = &row.fit else { return FrameSummary { reason, batch: true, ..FrameSummary::default() } };
    FrameSummary {
        iterations: Some(fit.report.iteration),
        loss: Some(fit.report.loss),
        terms: fit.report.terms.map(Some),
        iou: super::apply::mean_known(&fit.report.iou),
        converged: Some(fit.report.converged),
        majpe_mm: fit.majpe_mm,
        reason,
        hashes: None,
        batch: true,
        people: counted.then_some(fit.people),
        annotated: fit.annotated,
        joints: row.joints.clone(),
    }
}

/// What a batch is asked for.
#[derive(Debug, Clone)]
pub struct BatchRequest {
    /// Whose frames.
    pub dataset: Arc<crate::dataset::Dataset>,
    /// Which, in the order that they are fitted.
    pub frames: Arc<[u32]>,
    /// With what.
    pub of: FitsOf,
}
