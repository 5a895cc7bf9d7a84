//! The fit of the frame on screen.

use super::history::{Branch, History, IterationRow};
use super::state::FitHashes;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::mhp::{ErasedCells, Problem, SETTLED_OVER, has_settled};
use crate::start::FoundStart;
use crate::worker::{JobId, Snapshot};
use std::sync::Arc;

/// What the worker is doing for this frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum FitStatus {
    /// No frame, or no fit asked for.
    #[default]
    Idle,
    /// Maps are being filled and a start pose sought.
    Preparing,
    /// Ready to step.
    Paused,
    /// Stepping.
    Running,
    /// It cannot go on; the text says why.
    Failed(String),
}

/// The fit of one frame. Without a problem it is still being prepared.
#[derive(Debug, Clone, Default)]
pub struct Fit {
    /// The worker's job.
    pub job: JobId,
    /// The data set's frame.
    pub frame: usize,
    /// What is going on.
    pub status: FitStatus,
    /// Filled maps, views, skeleton.
    pub problem: Option<Arc<Problem>>,
    /// The pose that fixes the EM region.
    pub initial: Option<Pppr>,
    /// How the start pose was found, and how many people were counted.
    pub found_start: Option<FoundStart>,
    /// Milliseconds that took.
    pub init_ms: f64,
    /// Parameters were edited by hand.
    pub edited: bool,
    /// Number of the newest run, and the iteration that it began at.
    pub run: (u64, usize),
    /// Number of the newest run that a finger asked for.
    pub(super) refit_run: u64,
    /// A branch that is written anew with the rows that come next, and the settings that they are fitted with.
    pub(super) restart: Option<(u32, Box<FitConfig>)>,
    /// Milliseconds that a step takes, about.
    pub step_ms: f64,
    /// The settings that the start was found with.
    pub start_config: Option<FitConfig>,
    /// Where the replay of the active branch is, in iterations; `None` where none is played.
    pub replay: Option<f64>,
    /// Milliseconds of the last run.
    pub run_ms: Option<f64>,
    /// Why the last run ended, in words.
    pub reason: Option<&'static str>,
    /// Who the persons are: the same number is the same person in the frames around; empty until that is known.
    pub identities: Vec<usize>,
    /// Every step.
    pub history: History,
    /// An earlier iteration of the active branch that is being looked at; `None` follows the newest.
    pub cursor: Option<usize>,
    /// What is drawn.
    pub shown: Option<Arc<Snapshot>>,
    /// What identifies it; made once, for every pass and every command asks.
    pub(super) shown_hashes: Option<FitHashes>,
}

impl Fit {
    /// The active branch.
    pub fn branch(&self) -> Option<&Branch> {
        self.history.active()
    }

    /// Cells that the fit of the active branch does not see.
    pub fn erased(&self) -> Arc<[ErasedCells]> {
        self.branch().map(|branch| Arc::clone(&branch.erased)).unwrap_or_default()
    }

    /// The newest iteration of the active branch.
    pub fn head(&self) -> usize {
        self.branch().map_or(0, Branch::head)
    }

    /// The pose that the EM region of the active branch is laid around, where that is not the first start.
    pub fn around(&self) -> Option<Arc<Pppr>> {
        self.branch().and_then(|branch| branch.around.clone())
    }

    /// The pose that fixes the EM region of the active branch.
    pub fn region_pose(&self) -> Option<&Pppr> {
        self.branch().and_then(|branch| branch.around.as_deref()).or(self.initial.as_ref())
    }

    /// Whether this is a start that was found, and nothing was done with it yet.
    pub fn is_untouched(&self) -> bool {
        let found = self.found_start.is_some() && !self.edited && self.status == FitStatus::Paused;
        found && self.head() == 0 && self.history.branches().len() == 1
    }

    /// The iteration that is looked at.
    pub fn shown_iteration(&self) -> usize {
        self.cursor.unwrap_or_else(|| self.head())
    }

    /// The row that is looked at.
    pub fn shown_row(&self) -> Option<&IterationRow> {
        self.branch()?.row(self.shown_iteration())
    }

    /// True where commands to the optimiser make sense.
    pub fn is_ready(&self) -> bool {
        matches!(self.status, FitStatus::Paused | FitStatus::Running)
    }

    /// True while stepping.
    pub fn is_running(&self) -> bool {
        self.status == FitStatus::Running
    }

    /// The settings in force at the iteration that is looked at.
    pub fn shown_config(&self) -> Option<FitConfig> {
        Some(self.branch()?.config_at(self.shown_iteration()))
    }

    /// Whether the fit moves no more at the iteration that is looked at: over the last ten iterations the loss changed by
    /// less than 0.1 %, no joint moved more than 2 mm, and none by more than a fifth of what the learning rate lets it, so that the
    /// gradient is small too. `None` before there are as many.
    pub fn settled(&self) -> Option<bool> {
        let (branch, now) = (self.branch()?, self.shown_iteration());
        let then = now.checked_sub(SETTLED_OVER).filter(|then| *then >= branch.start())?;
        let (before, after) = (branch.row(then)?, branch.row(now)?);
        let losses = [before, after].map(|row| row.report.loss);
        let (_, then) = branch.state_at(then)?;
        let (_, now) = branch.state_at(now)?;
        Some(has_settled(&self.shown_config()?, losses, [then.params.positions(), now.params.positions()]))
    }
}
