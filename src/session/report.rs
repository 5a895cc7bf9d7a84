//! What threads, and the window itself, tell a session.

use super::acts::{ActKind, Done};
use super::explore::ExploreNews;
use super::file::SessionFile;
use super::labels::LabelTable;
use super::presets::PresetFits;
use super::results::FoundResults;
use super::sources::SourceErrors;
use super::state::{FitHashes, LogLevel};
use crate::dataset::{Dataset, DatasetError, Frame};
use crate::diagnose::Evidence;
use crate::explore::ExplorationKind;
use crate::labels::LabelPlace;
use crate::predictions::{PredictionError, Predictions, Reading};
use crate::study::complexity::Complexity;
use crate::study::run::Run;
use crate::study::{BatchRow, KeptFits};
use crate::worker::{Snapshot, WorkerMessage};
use std::path::PathBuf;
use std::sync::Arc;

/// What a thread tells of its work, or the window of its own.
#[derive(Debug)]
pub enum Report {
    /// A data set was chosen in a dialog.
    Picked(PathBuf),
    /// Opening got on.
    OpenProgress {
        /// What it is doing.
        stage: String,
        /// Done so far.
        done: u64,
        /// Of how many; 0 where unknown.
        total: u64,
    },
    /// Opening ended.
    Opened(PathBuf, Result<Arc<Dataset>, DatasetError>),
    /// The journals were read, as was asked under this number.
    LabelsOpened(u64, Result<Box<OpenedLabels>, String>),
    /// An act was written, or not.
    LabelsWritten(Written),
    /// Others wrote.
    LabelsRefreshed(LabelTable),
    /// Something of the journals is not as it should be.
    LabelsWarned(Vec<String>),
    /// Acts are written there, as was found before the first of them.
    LabelsPlaced(LabelPlace),
    /// Computing strata got on.
    StrataProgress {
        /// Frames done.
        done: u64,
        /// Of how many.
        total: u64,
    },
    /// Computing strata ended; `Ok(None)` where nothing was kept from an earlier run and none was begun.
    StrataDone(Result<Option<Arc<Complexity>>, String>),
    /// The maps of a pinned state.
    PinDrawn(u32, Result<Box<Snapshot>, String>),
    /// The evidence of a fit.
    EvidenceFound(usize, FitHashes, Result<Vec<Evidence>, String>),
    /// A frame was read.
    FrameLoaded(usize, Result<Arc<Frame>, DatasetError>),
    /// Rows or an event of the worker.
    Worker(WorkerMessage),
    /// Something newer to draw.
    Snapshot(Box<Snapshot>),
    /// A session file was read.
    SessionRead(PathBuf, Result<Box<SessionFile>, String>),
    /// A table of results was read and its frames were found in the data set, or not.
    ResultsRead(PathBuf, Result<Box<FoundResults>, String>),
    /// A file of predictions was read as was told, or asks something, or cannot be used.
    PredictionsRead(PathBuf, Box<Reading>, Arc<Dataset>, Result<Box<Predictions>, PredictionError>),
    /// What a source says against the truth.
    PredictionsCompared(Arc<Predictions>, Arc<SourceErrors>),
    /// Rows of a batch, and how many frames are done.
    BatchRows(Arc<Dataset>, Vec<BatchRow>, u64),
    /// A batch ended: with all frames, or cancelled; or it could not go on.
    BatchDone(Arc<Dataset>, Result<bool, String>),
    /// What earlier batches left of a data set.
    KeptFound {
        /// Whose.
        dataset: Arc<Dataset>,
        /// A file of them each.
        kept: Vec<KeptFits>,
        /// What was left out, and why, a line each.
        faults: Vec<String>,
    },
    /// A frame was fitted with two presets.
    PresetsFitted(Arc<PresetFits>),
    /// The study that was begun here got on: fits done, of how many.
    StudyProgress(u64, u64),
    /// It has more rows.
    StudyGrew(PathBuf, Arc<Run>),
    /// It ended: with its run, cancelled, or it could not go on.
    StudyDone(Result<Option<(PathBuf, Arc<Run>)>, String>),
    /// A run folder was read, or not.
    RunRead(PathBuf, Result<Arc<Run>, String>),
    /// An exploration got on, as was asked under this number.
    Explored(ExplorationKind, u64, ExploreNews),
    /// Something was written, or not.
    TaskDone(Result<String, String>),
    /// A line for the log.
    Log(LogLevel, String),
}

/// What was found when the journals were opened.
#[derive(Debug)]
pub struct OpenedLabels {
    /// Where they are.
    pub place: LabelPlace,
    /// Everybody's labels.
    pub table: LabelTable,
    /// The frame that the annotator labelled last.
    pub last_edited: Option<usize>,
    /// What had to be skipped.
    pub warnings: Vec<String>,
}

/// The journal's answer to a [`super::Commit`].
#[derive(Debug)]
pub struct Written {
    /// That of the commit.
    pub id: u64,
    /// That of the commit.
    pub kind: ActKind,
    /// That of the commit.
    pub act: String,
    /// What was written, or why nothing was.
    pub result: Result<Done, String>,
}
