//! What can be asked of a session, and what it asks of the outside.

use super::acts::{ActKind, Asked, Done};
use super::evidence::EvidenceRequest;
use super::file::SessionFile;
use super::labels::LabelTable;
use super::pins::Pin;
use super::queue::Sort;
use super::results::FoundResults;
use super::state::FitHashes;
use super::view::ViewState;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::{BareChoice, Dataset, DatasetError, Frame};
use crate::diagnose::Evidence;
use crate::labels::{CellRegion, Judged, LabelPlace, Tag, Verdict};
use crate::mhp::Precision;
use crate::study::complexity::Complexity;
use crate::study::run::Run;
use crate::worker::{Snapshot, WorkerCommand, WorkerMessage};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

/// Which dialog to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PickKind {
    /// A data set's folder.
    Folder,
    /// A file: `dataset.toml`, `*_radar.npz`, `.npy`, `.npz`.
    File,
}

/// Where to begin in a data set.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StartAt {
    /// A frame's name, or its index.
    pub frame: Option<String>,
    /// Run the fit until this iteration.
    pub iteration: Option<usize>,
}

/// A change of the session: by a person, or a report of a thread.
#[derive(Debug)]
pub enum Command {
    /// Open a data set.
    Open(PathBuf),
    /// Open a data set at a frame and an iteration.
    OpenAt(PathBuf, StartAt),
    /// Show a dialog.
    Pick(PickKind),
    /// Open a bare file with these axes.
    OpenBare(PathBuf, BareChoice),
    /// Close the question about a bare file's axes.
    DismissBare,
    /// Give up opening.
    CancelOpen,
    /// Report: opening got on.
    OpenProgress {
        /// What it is doing.
        stage: String,
        /// Done so far.
        done: u64,
        /// Of how many; 0 where unknown.
        total: u64,
    },
    /// Report: opening ended.
    Opened(PathBuf, Result<Arc<Dataset>, DatasetError>),
    /// Show a frame.
    GotoFrame(usize),
    /// Show the frame this many further in time, among those that match the filter.
    StepFrames(isize),
    /// Show the frame this many further in the queue.
    StepQueue(isize),
    /// Show the next frame of the queue that this annotator has not judged.
    NextUntagged,
    /// Show the frame that this annotator labelled last.
    GotoLastEdited,
    /// Filter the list.
    SetFilter(String),
    /// Order the list.
    SetSort(Sort),
    /// Keep the filter and the order under a name.
    SaveView(String),
    /// Filter and order as kept.
    UseView(String),
    /// Forget a kept view.
    RemoveView(String),
    /// Select these frames for the next act of labelling.
    SelectFrames(BTreeSet<usize>),
    /// Add the tag to the targets, or remove it where all have it.
    ToggleTag(Tag),
    /// Set the note of these frames: those that it was typed for, wherever the window went meanwhile.
    SetNote(Arc<[u32]>, String),
    /// Set the person that is meant.
    SetPerson(Option<u32>),
    /// Set the cells that are meant on a frame's map.
    SetRegion(usize, Option<CellRegion>),
    /// Set the verdict.
    SetVerdict(Option<Verdict>),
    /// Say nothing of the targets any more.
    ClearLabel,
    /// Take the last act of labelling back.
    Undo,
    /// Do it again.
    Redo,
    /// Somebody else labels.
    SetAnnotator(String),
    /// Report: the journals were read, as was asked under this number.
    LabelsOpened(u64, Result<Box<OpenedLabels>, String>),
    /// Report: an act was written, or not.
    LabelsWritten(Written),
    /// Report: others wrote.
    LabelsRefreshed(LabelTable),
    /// Report: something of the journals is not as it should be.
    LabelsWarned(Vec<String>),
    /// Report: acts are written there, as was found before the first of them.
    LabelsPlaced(LabelPlace),
    /// Read what others wrote.
    RefreshLabels,
    /// Compute strata.
    ComputeStrata,
    /// Give up computing strata.
    CancelStrata,
    /// Report: computing strata got on.
    StrataProgress {
        /// Frames done.
        done: u64,
        /// Of how many.
        total: u64,
    },
    /// Report: computing strata ended; `Ok(None)` where nothing was kept from an earlier run and none was begun.
    StrataDone(Result<Option<Arc<Complexity>>, String>),
    /// Keep the state on screen to compare others with.
    PinFit,
    /// Forget a pinned state.
    RemovePin(u32),
    /// Give a pinned state another name.
    RenamePin(u32, String),
    /// Compare with this one.
    SetBaseline(Option<u32>),
    /// Report: the maps of a pinned state.
    PinDrawn(u32, Result<Box<Snapshot>, String>),
    /// Report: the evidence of a fit.
    EvidenceFound(usize, FitHashes, Result<Vec<Evidence>, String>),
    /// Report: a frame was read.
    FrameLoaded(usize, Result<Arc<Frame>, DatasetError>),
    /// Play or stop playing frames.
    TogglePlay,
    /// Run, or pause what runs.
    ToggleRun,
    /// Run this many steps.
    StepFit(usize),
    /// Look at this many iterations before the shown one.
    StepBack(usize),
    /// Look at an iteration of the active branch.
    GotoIteration(usize),
    /// Look at the newest iteration again.
    FollowLive,
    /// Begin again from a new start pose with the current settings.
    Reset,
    /// Remove the active branch; on the first one, everything after the start.
    Discard,
    /// Continue on another branch.
    SelectBranch(u32),
    /// New settings; effective from the next step.
    SetConfig(Box<FitConfig>),
    /// Another scalar for the kernel; prepares the fit again.
    SetPrecision(Precision),
    /// Start the next frame from this one's result.
    SetWarmStart(bool),
    /// Parameters edited by hand.
    EditParams(Box<Pppr>),
    /// Report: rows or an event of the worker.
    Worker(WorkerMessage),
    /// Report: something newer to draw.
    Snapshot(Box<Snapshot>),
    /// Select a joint (flat index).
    SelectJoint(Option<usize>),
    /// How things are shown.
    SetView(Box<ViewState>),
    /// Write something to a file.
    Export(Export, PathBuf),
    /// Keep everything in a session file; with what only the window knows.
    SaveSession(PathBuf, serde_json::Value),
    /// Open a session file.
    OpenSession(PathBuf),
    /// Report: a session file was read.
    SessionRead(PathBuf, Result<Box<SessionFile>, String>),
    /// Take the results of a batch, a table that `fit --out` wrote, into the frame list.
    LoadResults(PathBuf),
    /// Report: such a table was read and its frames were found in the data set, or not.
    ResultsRead(PathBuf, Result<Box<FoundResults>, String>),
    /// Show the run of a study.
    OpenRun(PathBuf),
    /// Report: a run folder was read, or not.
    RunRead(PathBuf, Result<Arc<Run>, String>),
    /// Put the frames of a row of the study's table into the list, with what the study says of them.
    ShowStudyRow(usize),
    /// Report: something was written, or not.
    TaskDone(Result<String, String>),
    /// Write a picture that the window drew.
    RunTask(BackgroundTask),
    /// Write a line to the log.
    Log(super::LogLevel, String),
    /// Empty the log.
    ClearLog,
    /// Forget the recently opened.
    ClearRecent,
}

/// What can be taken home of a session, besides pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Export {
    /// Every iteration of the fit on screen, CSV.
    Curves,
    /// The Gaussians on screen, PLY.
    Gaussians,
    /// The parameters on screen, npz.
    Parameters,
    /// Labels, CSV.
    LabelsCsv,
    /// Labels, JSON.
    LabelsJson,
    /// Complexity of every frame, CSV.
    Strata,
}

impl Export {
    /// What it is, in words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Curves => "curves",
            Self::Gaussians => "Gaussians",
            Self::Parameters => "parameters",
            Self::LabelsCsv | Self::LabelsJson => "labels",
            Self::Strata => "strata",
        }
    }

    /// The usual ending of its file.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Curves | Self::LabelsCsv | Self::Strata => "csv",
            Self::Gaussians => "ply",
            Self::Parameters => "npz",
            Self::LabelsJson => "json",
        }
    }
}

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

/// The journal's answer to a [`Commit`].
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

/// What the session asks of the outside.
#[derive(Debug)]
pub enum Effect {
    /// Open this on a thread.
    Open(PathBuf),
    /// Open a bare file with these axes on a thread.
    OpenBare(PathBuf, BareChoice),
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
    /// Read a run folder on a thread.
    ReadRun(PathBuf),
    /// Find the frames of a row of a run's table in this data set, on a thread.
    FindStudyRow(PathBuf, Arc<Run>, usize, Arc<Dataset>),
    /// Compute the maps of a pinned fit on a thread.
    DrawPin(Box<PinRequest>),
    /// Gather evidence.
    Evidence(Box<EvidenceRequest>),
    /// Free this on a thread.
    Free(Trash),
}
