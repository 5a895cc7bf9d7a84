//! What a person asks of a session.

use super::body_move::BodyMove;
use super::compared::ResultSide;
use super::effect::BackgroundTask;
use super::explore::AdoptedFit;
use super::queue::Sort;
use super::study::StudyOrder;
use super::view::ViewState;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::{BareChoice, ChirpForm};
use crate::explore::ExplorationKind;
use crate::geometry::Vec3;
use crate::labels::{CellRegion, Tag, Verdict};
use crate::mhp::Precision;
use crate::predictions::{Colour, Reading};
use std::collections::BTreeSet;
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

/// What a person asks of the session.
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
    /// Open a capture whose chirps this says.
    OpenCapture(PathBuf, Box<ChirpForm>),
    /// Close the question about a capture's chirps.
    DismissCapture,
    /// Give up opening.
    CancelOpen,
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
    /// Take the last act, of labelling or on settings, back.
    Undo,
    /// Do it again.
    Redo,
    /// Somebody else labels.
    SetAnnotator(String),
    /// Read what others wrote.
    RefreshLabels,
    /// Compute strata.
    ComputeStrata,
    /// Give up computing strata.
    CancelStrata,
    /// Keep the state on screen to compare others with.
    PinFit,
    /// Forget a pinned state.
    RemovePin(u32),
    /// Give a pinned state another name.
    RenamePin(u32, String),
    /// Compare with this one.
    SetBaseline(Option<u32>),
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
    /// New settings: the fit is done anew with them where that is live, else they count from the next step on.
    SetConfig(Box<FitConfig>),
    /// The same while they are under a finger: until [`Command::EndDrag`] it is one act.
    DragConfig(Box<FitConfig>),
    /// Cells under an eraser: the fit is done anew without them; until [`Command::EndDrag`] it is one act.
    DragErase(CellRegion),
    /// Single cells (flat indices, C order) of a view under an eraser: as [`Command::DragErase`].
    DragEraseCells(usize, Vec<usize>),
    /// The whole connected echo that a cell of a view belongs to: erased, an act of its own.
    EraseEcho(usize, usize),
    /// A fit of an exploration under a finger, beside the one on screen; until [`Command::EndDrag`] all are one act.
    DragFit(Box<AdoptedFit>),
    /// The finger is lifted.
    EndDrag,
    /// Runs stop where this holds.
    AddBreakpoint(String),
    /// Forget a breakpoint.
    RemoveBreakpoint(u32),
    /// Switch a breakpoint on or off.
    EnableBreakpoint(u32, bool),
    /// Play the iterations of the branch on screen, or stop playing them.
    ToggleReplay,
    /// So many seconds of the replay went by.
    PlayOn(f64),
    /// Another scalar for the kernel; prepares the fit again.
    SetPrecision(Precision),
    /// Start the next frame from this one's result.
    SetWarmStart(bool),
    /// Let the frames around decide with each frame where it starts, or each frame by itself; starts the fit anew.
    SetAlong(bool),
    /// Parameters edited by hand.
    EditParams(Box<Pppr>),
    /// The body under a finger: moved from where it was when the finger went down; until [`Command::EndDrag`] one act.
    DragBody(BodyMove),
    /// The selected joint, or with handles shown the whole person, moved by so much, m, world frame, from where it is; until
    /// [`Command::EndDrag`] all that follow are one act.
    NudgeBody(Vec3),
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
    /// Fit the selected frames, or all in the list, on all cores; what is kept of them already is taken.
    FitListed,
    /// Let the batch wait, or go on.
    PauseBatch,
    /// Stop the batch; what was fitted is kept.
    CancelBatch,
    /// Keep what the list says of the fits as one of the two sets that are compared.
    KeepResults(ResultSide),
    /// Forget one of them.
    ForgetResults(ResultSide),
    /// Take the results of a batch, a table that `fit --out` wrote, into the frame list.
    LoadResults(PathBuf),
    /// Show a file of predictions beside the fits; what it does not say of itself is told with it.
    OpenPredictions(PathBuf, Box<Reading>),
    /// Close the question about a file of predictions.
    DismissPredictions,
    /// Draw a source, or draw it no longer.
    ShowPredictions(usize, bool),
    /// Draw a source in this colour, or in one of the theme's.
    ColourPredictions(usize, Option<Colour>),
    /// Take a source out of the window.
    RemovePredictions(usize),
    /// Begin the fit on screen at what a source predicts.
    StartFromPredictions(usize),
    /// Fit the frame on screen with the paper's and the recommended settings, and show both.
    ComparePresets,
    /// Close what shows them.
    ClosePresets,
    /// Study the selected frames, or all in the list, on all cores; what was done of the same study is taken.
    RunStudy(StudyOrder),
    /// Let the study wait, or go on.
    PauseStudy,
    /// Stop the study; what was fitted is kept.
    CancelStudy,
    /// Show the run of a study.
    OpenRun(PathBuf),
    /// Put the frames of a row of the study's table into the list, with what the study says of them.
    ShowStudyRow {
        /// Its place in the table.
        row: usize,
        /// Only the frames of this scene.
        scene: Option<String>,
    },
    /// Explore what is on screen, as is chosen; an older exploration of the kind is given up.
    Explore(ExplorationKind),
    /// Give it up.
    StopExploring(ExplorationKind),
    /// Keep the tuning map as the run folder of a sweep.
    KeepTuning,
    /// Write a picture that the window drew.
    RunTask(BackgroundTask),
    /// Empty the log.
    ClearLog,
    /// Forget the recently opened.
    ClearRecent,
    /// Put these at the end of the recently opened.
    OfferPaths(Vec<PathBuf>),
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
    /// Cells that the fit does not see, JSON.
    Erased,
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
            Self::Erased => "erased cells",
        }
    }

    /// The usual ending of its file.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Curves | Self::LabelsCsv | Self::Strata => "csv",
            Self::Gaussians => "ply",
            Self::Parameters => "npz",
            Self::LabelsJson | Self::Erased => "json",
        }
    }
}
