//! What the window and the worker say to each other.

use crate::body::Pppr;
use crate::condition::Breakpoint;
use crate::config::FitConfig;
use crate::dataset::{Dataset, Frame};
use crate::geometry::Vec3;
use crate::mhp::{ErasedCells, Evaluation, FitState, GivenStart, Masks, Precision, Problem, StepReport, StopReason};
use crate::start::FoundStart;
use std::sync::Arc;

/// Identifies one fit of one frame; messages of an older job are dropped.
pub type JobId = u64;

/// Where a fit begins.
#[derive(Debug, Clone)]
pub enum Start {
    /// From the map's peaks.
    Initialise,
    /// From the map's peaks, decided along the sequence.
    Along,
    /// From these parameters (the previous frame's).
    Warm(Pppr),
    /// From these parameters, which are of this frame: what somebody predicts of it. The fit is held to the joints that are given.
    Given(GivenStart),
    /// From a state of an earlier session with the same frame; `initial` fixes the EM region.
    Resume {
        /// The initial pose of that fit.
        initial: Pppr,
        /// Where it stood.
        state: Arc<FitState>,
    },
}

/// Everything a job needs.
#[derive(Debug, Clone)]
pub struct Prepare {
    /// The new job.
    pub job: JobId,
    /// The branch that its rows belong to.
    pub branch: u32,
    /// The data set: its radar, skeleton and views, and the frames around.
    pub dataset: Arc<Dataset>,
    /// The frame.
    pub frame: Arc<Frame>,
    /// Settings.
    pub config: FitConfig,
    /// Scalar of the kernel.
    pub precision: Precision,
    /// Where to begin.
    pub start: Start,
    /// Cells that the fit is not to see; a start that is sought sees them.
    pub erased: Arc<[ErasedCells]>,
    /// The pose that the EM region of the branch is laid around, where it is not the initial one.
    pub around: Option<Arc<Pppr>>,
}

/// Window to worker.
#[derive(Debug, Clone)]
pub enum WorkerCommand {
    /// Set up a job, replacing the old one; it stays paused.
    Prepare(Box<Prepare>),
    /// Run until an iteration.
    RunTo {
        /// The iteration.
        target: usize,
        /// Comes back with the run's end, so that the end of an older run is not taken for this one's.
        run: u64,
    },
    /// Fit anew from a state with other settings, and write the branch anew with it: what a setting under a finger asks
    /// many times a second. Of those that wait the newest is done; each that is begun is shown, as far as it came.
    Refit {
        /// The branch that is written anew.
        branch: u32,
        /// Where to begin.
        state: Arc<FitState>,
        /// Settings from there on.
        config: Box<FitConfig>,
        /// Run until this iteration.
        target: usize,
        /// Comes back with the end, as that of [`WorkerCommand::RunTo`].
        run: u64,
        /// Cells that the fit is not to see.
        erased: Arc<[ErasedCells]>,
        /// The pose that the EM region is laid around, where it is not the initial one.
        around: Option<Arc<Pppr>>,
    },
    /// Runs take at most so many iterations a second from now on, `None` as fast as they go; a fit that is done anew
    /// always does.
    Pace(Option<f64>),
    /// Runs stop where one of these holds from now on, each with its number; a fit that is done anew does not.
    Watch(Vec<(u32, Breakpoint)>),
    /// Stop after the current step; the job stays.
    Pause,
    /// Take effect at the next step.
    Configure(Box<FitConfig>),
    /// Continue from an earlier state (and perhaps other settings) as a new branch.
    Branch {
        /// Tag of the rows that follow.
        branch: u32,
        /// Where to continue.
        state: Arc<FitState>,
        /// Settings from there on.
        config: Box<FitConfig>,
        /// Cells that the fit is not to see.
        erased: Arc<[ErasedCells]>,
        /// The pose that the EM region is laid around, where it is not the initial one.
        around: Option<Arc<Pppr>>,
    },
    /// Replace the parameters at the current iteration by hand; of those that wait the newest is done.
    Edit(Box<Pppr>),
    /// Show an earlier state without going back to it: answers with a snapshot.
    Inspect {
        /// The branch that the state is of.
        branch: u32,
        /// The state.
        state: Arc<FitState>,
        /// The settings that were in force there.
        config: Box<FitConfig>,
    },
    /// Forget the job.
    Discard,
    /// Test hook: panic inside the job, to prove that the window lives on.
    #[doc(hidden)]
    PanicForTest,
    /// End the thread.
    Shutdown,
}

/// What there is to draw at one iteration.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// The job.
    pub job: JobId,
    /// The branch.
    pub branch: u32,
    /// The iteration.
    pub iteration: usize,
    /// False for the answer to [`WorkerCommand::Inspect`].
    pub live: bool,
    /// Settings in force.
    pub config: FitConfig,
    /// The parameters.
    pub params: Pppr,
    /// The objective there.
    pub evaluation: Evaluation,
    /// H_sim of each view, whole maps.
    pub h_sim: Vec<Vec<f64>>,
    /// Masks of each view, whole maps.
    pub masks: Vec<Masks>,
    /// Iterations a second of the run so far; 0 when paused.
    pub iterations_per_s: f64,
}

/// One iteration, for the curves and for going back.
#[derive(Debug, Clone)]
pub struct HistoryRow {
    /// The branch.
    pub branch: u32,
    /// Loss, terms, IoU, convergence.
    pub report: StepReport,
    /// What is kept of where it stood.
    pub kept: Kept,
}

/// What a row keeps of where the fit stood.
#[derive(Debug, Clone, PartialEq)]
pub enum Kept {
    /// Parameters and Adam moments: the fit can go back there.
    State(Arc<FitState>),
    /// Positions of all joints, m: in long runs most iterations are only measured.
    Positions(Box<[Vec3]>),
}

impl Kept {
    /// The state, where there is one.
    pub fn state(&self) -> Option<&Arc<FitState>> {
        match self {
            Self::State(state) => Some(state),
            Self::Positions(_) => None,
        }
    }

    /// Positions of all joints, m.
    pub fn positions(&self) -> &[Vec3] {
        match self {
            Self::State(state) => state.params.positions(),
            Self::Positions(positions) => positions,
        }
    }
}

/// The answer to [`WorkerCommand::Prepare`].
#[derive(Debug, Clone)]
pub struct PreparedFit {
    /// Maps filled, shapes checked.
    pub problem: Arc<Problem>,
    /// How the start pose was found, and how many people were counted; `None` when warm or resumed.
    pub found_start: Option<FoundStart>,
    /// The pose that fixes the EM region.
    pub initial: Pppr,
    /// Warnings of the objective (an EM region without cells, …).
    pub warnings: Vec<String>,
    /// Milliseconds of the initialisation.
    pub init_ms: f64,
    /// Milliseconds that a step takes, about.
    pub step_ms: f64,
}

/// Rare and lossless.
#[derive(Debug, Clone)]
pub enum WorkerEvent {
    /// The job is ready and paused at its start.
    Prepared(Box<PreparedFit>),
    /// Settings changed and hold from the step after `iteration`.
    ConfigApplied {
        /// The branch.
        branch: u32,
        /// The last iteration with the old settings.
        iteration: usize,
        /// The new settings.
        config: Box<FitConfig>,
    },
    /// A branch is written anew: the rows that follow replace all that were sent of it.
    Refitted {
        /// The branch.
        branch: u32,
        /// The settings that it is fitted with.
        config: Box<FitConfig>,
    },
    /// A breakpoint holds: the run's end follows.
    Broke {
        /// The branch.
        branch: u32,
        /// Where it holds.
        iteration: usize,
        /// Its number.
        breakpoint: u32,
    },
    /// A run ended.
    Finished {
        /// The run's number.
        run: u64,
        /// The branch.
        branch: u32,
        /// Where it stands.
        iteration: usize,
        /// Why.
        reason: StopReason,
        /// Milliseconds since the run began.
        run_ms: f64,
    },
    /// A command could not be done, or the next step not be taken; the job stays where it was. The text names what
    /// diverged or failed.
    Failed(String),
    /// There is no job any more: it could not be prepared or ended in a panic.
    Lost(String),
}

/// Worker to window, without the snapshots.
#[derive(Debug, Clone)]
pub enum WorkerMessage {
    /// A batch of iterations.
    Rows(JobId, Vec<HistoryRow>),
    /// Something happened.
    Event(JobId, WorkerEvent),
}
