//! What can be asked of a session, and what it asks of the outside.

use super::view::ViewState;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::{BareChoice, Dataset, DatasetError, Frame};
use crate::mhp::Precision;
use crate::worker::{Snapshot, WorkerCommand, WorkerMessage};
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

/// A change of the session: by a person, or a report of a thread.
#[derive(Debug)]
pub enum Command {
    /// Open a data set.
    Open(PathBuf),
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
    /// Show the frame this many further.
    StepFrames(isize),
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
    SetConfig(FitConfig),
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
    /// Write a line to the log.
    Log(super::LogLevel, String),
    /// Empty the log.
    ClearLog,
    /// Forget the recently opened.
    ClearRecent,
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
}
