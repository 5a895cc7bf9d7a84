//! What the session asks of the outside.

use super::acts::{ActKind, Asked};
use super::batch::BatchRequest;
use super::command::PickKind;
use super::evidence::EvidenceRequest;
use super::pins::Pin;
use super::study::StudyRequest;
use crate::dataset::{BareChoice, ChirpForm, Dataset, Frame};
use crate::explore::{Exploration, ExplorationKind};
use crate::labels::Judged;
use crate::mhp::Precision;
use crate::predictions::{Predictions, Reading};
use crate::study::run::Run;
use crate::worker::WorkerCommand;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Work for a thread, which answers a line for a person.
pub struct BackgroundTask(pub(super) Box<dyn FnOnce() -> Result<String, String> + Send>);

impl BackgroundTask {
    /// Work that answers what was done, or why it was not.
    pub fn new(work: impl FnOnce() -> Result<String, String> + Send + 'static) -> Self {
        Self(Box::new(work))
    }
}

impl std::fmt::Debug for BackgroundTask {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("BackgroundTask")
    }
}

/// A pinned fit whose maps are to be computed.
#[derive(Debug, Clone)]
pub struct PinRequest {
    /// To read its frame.
    pub dataset: Arc<Dataset>,
    /// The pin.
    pub pin: Pin,
}

/// An act of labelling, to be written.
#[derive(Debug, Clone)]
pub struct Commit {
    /// Comes back with the answer.
    pub id: u64,
    /// Done, undone or done again.
    pub kind: ActKind,
    /// In words.
    pub act: String,
    /// To name the frames.
    pub dataset: Arc<Dataset>,
    /// What is asked of which frames.
    pub asked: Asked,
    /// The fits that were judged, of the frames that have one.
    pub judged: BTreeMap<usize, Judged>,
}

/// Something large that is not needed any more: freeing a hundred thousand records takes longer than a pass may.
pub struct Trash(Box<dyn std::any::Any + Send>);

impl Trash {
    /// Of anything.
    pub(super) fn new(what: impl Send + 'static) -> Self {
        Self(Box::new(what))
    }

    /// Frees it, here and now.
    pub(super) fn free(self) {
        drop(self.0);
    }
}

impl std::fmt::Debug for Trash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Trash")
    }
}

/// What the session asks of the outside.
#[derive(Debug)]
pub enum Effect {
    /// Open this on a thread.
    Open(PathBuf),
    /// Open a bare file with these axes on a thread.
    OpenBare(PathBuf, BareChoice),
    /// Open a capture whose chirps this says on a thread.
    OpenCapture(PathBuf, Box<ChirpForm>),
    /// Stop opening.
    CancelOpen,
    /// Show a file dialog on a thread.
    Pick(PickKind),
    /// Read frames of this data set from now on.
    UseDataset(Arc<Dataset>),
    /// Read a frame on a thread.
    Load(usize),
    /// Tell the worker.
    Send(WorkerCommand),
    /// Read the journals and open this annotator's.
    OpenLabels {
        /// Comes back with the answer.
        id: u64,
        /// Whose frames are labelled.
        dataset: Arc<Dataset>,
        /// Who labels.
        annotator: String,
    },
    /// Write an act.
    CommitLabels(Commit),
    /// Read what others wrote.
    RefreshLabels,
    /// Compute strata on all cores.
    ComputeStrata {
        /// Of these frames.
        dataset: Arc<Dataset>,
        /// Only take what an earlier run left.
        only_kept: bool,
    },
    /// Stop computing strata.
    CancelStrata,
    /// Do this on a thread.
    Run(BackgroundTask),
    /// Read a session file on a thread.
    ReadSession(PathBuf),
    /// Read a table of results on a thread, and find its frames in this data set.
    ReadResults(PathBuf, Arc<Dataset>),
    /// Read a file of predictions of this data set, on a thread.
    ReadPredictions(PathBuf, Box<Reading>, Arc<Dataset>),
    /// Compare a source with the truth of every frame, on a thread.
    ComparePredictions(Arc<Predictions>, Arc<Dataset>),
    /// Fit these frames on all cores.
    StartBatch(Box<BatchRequest>),
    /// Let the batch wait, or go on.
    PauseBatch(bool),
    /// Stop the batch.
    CancelBatch,
    /// Look for what earlier batches left of this data set, on a thread.
    FindKept(Arc<Dataset>),
    /// Fit a frame with two presets, on a thread.
    FitPresets(Arc<Dataset>, Arc<Frame>, Precision),
    /// Do this study on all cores.
    StartStudy(Box<StudyRequest>),
    /// Let the study wait, or go on.
    PauseStudy(bool),
    /// Stop the study.
    CancelStudy,
    /// Read a run folder on a thread.
    ReadRun(PathBuf),
    /// Find the frames of a row of a run's table in this data set, on a thread.
    FindStudyRow {
        /// Where the run lies.
        folder: PathBuf,
        /// The run.
        run: Arc<Run>,
        /// The row's place in its table.
        row: usize,
        /// Only the frames of this scene.
        scene: Option<String>,
        /// Where the frames are sought.
        dataset: Arc<Dataset>,
    },
    /// Explore this on idle cores, under this number; an older one of its kind is given up.
    Explore(u64, Box<Exploration>),
    /// Give it up.
    StopExploring(ExplorationKind),
    /// Compute the maps of a pinned fit on a thread.
    DrawPin(Box<PinRequest>),
    /// Gather evidence.
    Evidence(Box<EvidenceRequest>),
    /// Free this on a thread.
    Free(Trash),
    /// Give the window what a session file says of it.
    RestoreWindow(serde_json::Value),
}
