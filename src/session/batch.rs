//! Fits of many frames at once: how far they are, and what those in the list are of.

use super::state::FrameSummary;
use crate::config::{FitConfig, difference};
use crate::study::{BatchRow, FitsOf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How far a batch is.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum BatchStatus {
    /// None is under way.
    #[default]
    Idle,
    /// Frames are being fitted.
    Running {
        /// Frames done.
        done: u64,
        /// Of how many.
        total: u64,
        /// Whether it waits for somebody to let it go on.
        paused: bool,
    },
}

/// The batch of the open data set.
#[derive(Debug, Default)]
pub struct Batch {
    /// How far it is.
    pub status: BatchStatus,
    /// What the fits in the list are of that a batch made, here or before.
    pub shown: Option<FitsOf>,
    /// Frames that a batch fitted, and those that it could not.
    pub fitted: usize,
    /// Frames that it could not fit.
    pub failed: usize,
    /// Fits take so long that this much time has passed for so many frames, without pauses.
    pace: Option<Pace>,
}

#[derive(Debug, Clone, Copy)]
struct Pace {
    began: Instant,
    paused: Duration,
    pause_began: Option<Instant>,
    /// Frames that were there when it began.
    known: u64,
}

impl Batch {
    /// A batch begins with this many frames.
    pub(super) fn begin(&mut self, of: FitsOf, total: usize) {
        self.status = BatchStatus::Running { done: 0, total: total as u64, paused: false };
        self.shown = Some(of);
        self.pace = None;
    }

    /// So many frames are done.
    pub(super) fn advance(&mut self, done_now: u64) {
        let BatchStatus::Running { done, .. } = &mut self.status else { return };
        // What was known from before came at once and says nothing of the pace.
        let pace = Pace { began: Instant::now(), paused: Duration::ZERO, pause_began: None, known: done_now };
        self.pace.get_or_insert(pace);
        *done = done_now;
    }

    /// It waits, or goes on.
    pub(super) fn pause(&mut self, wait: bool) {
        let BatchStatus::Running { paused, .. } = &mut self.status else { return };
        *paused = wait;
        let Some(pace) = &mut self.pace else { return };
        match (wait, pace.pause_began.take()) {
            (true, _) => pace.pause_began = Some(Instant::now()),
            (false, Some(began)) => pace.paused += began.elapsed(),
            (false, None) => {}
        }
    }

    /// What is left, about; `None` until that can be told.
    pub fn eta(&self) -> Option<Duration> {
        let BatchStatus::Running { done, total, .. } = self.status else { return None };
        let pace = self.pace?;
        let fitted = done.checked_sub(pace.known).filter(|fitted| *fitted > 0)?;
        let waited = pace.paused + pace.pause_began.map_or(Duration::ZERO, |began| began.elapsed());
        let each = pace.began.elapsed().saturating_sub(waited).as_secs_f64() / fitted as f64;
        Duration::try_from_secs_f64(each * total.saturating_sub(done) as f64).ok()
    }

    /// True while frames are being fitted.
    pub fn is_running(&self) -> bool {
        matches!(self.status, BatchStatus::Running { .. })
    }

    /// What sets the fits in the list apart from what would be fitted now: other settings, another program; `None` where
    /// nothing does.
    pub fn stale(&self, config: &FitConfig) -> Option<String> {
        let of = self.shown.as_ref()?;
        if of.program != env!("CARGO_PKG_VERSION") {
            return Some(format!("by version {}", of.program));
        }
        // How long a run takes is a setting of the fits of a batch too.
        let what = difference(config, &of.config);
        (!what.is_empty()).then_some(what)
    }
}

/// What the list says of a fit of a batch.
pub(super) fn summary(row: &BatchRow) -> FrameSummary {
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
