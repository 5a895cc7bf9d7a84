//! The session's fields.

use super::batch::Batch;
use super::body_move::Moving;
use super::breakpoints::Breakpoints;
use super::command::StartAt;
use super::compared::ResultSets;
use super::evidence::EvidenceState;
use super::explore::Explorations;
use super::file::SessionFile;
use super::fit::Fit;
use super::identity::Identities;
use super::labels::Labels;
use super::pins::Pins;
use super::presets::PresetCard;
use super::queue::{ListedFrom, Queue};
use super::settings::{Drag, SettingsActs};
use super::sources::Sources;
use super::strata::Strata;
use super::study::StudyView;
use super::tracked::Tracked;
use super::view::ViewState;
use crate::config::FitConfig;
use crate::dataset::{BareCatalog, Dataset, Frame};
use crate::mhp::{Precision, Terms};
use crate::worker::JobId;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

/// Lines the log keeps.
pub(super) const LOG_LINES: usize = 2000;
/// Entries of the recent list.
pub(super) const RECENT: usize = 12;

/// How bad a log line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogLevel {
    /// For information.
    Info,
    /// Something was assumed or repaired.
    Warning,
    /// Something could not be done.
    Error,
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    /// When.
    pub at: std::time::SystemTime,
    /// How bad.
    pub level: LogLevel,
    /// What.
    pub text: String,
}

/// Something to be told in a notification.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Notice {
    /// Counts up, so that the same text twice is told twice.
    pub count: u64,
    /// How bad.
    pub level: LogLevel,
    /// What.
    pub text: String,
    /// The act of which it tells, where it is one that touches so much that it must be easy to take back.
    pub act: Option<u64>,
}

/// A data set that is being opened.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening {
    /// What was asked for.
    pub path: PathBuf,
    /// What it is doing.
    pub stage: String,
    /// Done so far.
    pub done: u64,
    /// Of how many; 0 where unknown.
    pub total: u64,
}

/// The data side.
#[derive(Debug, Default)]
pub struct Data {
    /// The open data set.
    pub dataset: Option<Arc<Dataset>>,
    /// One that is being opened; the old one stays on screen until it is there.
    pub opening: Option<Opening>,
    /// A bare file whose axes must be told.
    pub bare: Option<(PathBuf, BareCatalog)>,
    /// A capture whose chirps must be told.
    pub capture: Option<PathBuf>,
    /// The frame that was asked for.
    pub frame_index: usize,
    /// The frame on screen.
    pub frame: Option<Arc<Frame>>,
    /// A frame that is being read.
    pub loading: Option<usize>,
    /// Why the asked frame is not on screen.
    pub error: Option<String>,
    /// Recently opened, newest first.
    pub recent: Vec<PathBuf>,
    /// Frames are playing.
    pub playing: bool,
}

impl Data {
    /// Number of frames.
    pub fn len(&self) -> usize {
        self.dataset.as_ref().map_or(0, |dataset| dataset.len())
    }

    /// True where there is no frame.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// What is known of a frame's fit, for the list and the timeline.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FrameSummary {
    /// Iterations done; `None` where a batch could not fit the frame.
    pub iterations: Option<usize>,
    /// L.
    pub loss: Option<f64>,
    /// Its unweighted terms, as far as they are known.
    #[serde(default)]
    pub terms: Terms<Option<f64>>,
    /// Mean forward-consistency IoU over the views.
    pub iou: Option<f64>,
    /// The convergence criterion.
    pub converged: Option<bool>,
    /// MAJPE, mm, where there is truth.
    pub majpe_mm: Option<f64>,
    /// Why the last run ended.
    pub reason: Option<String>,
    /// What identifies the fit; `None` for one that was read from a table.
    pub hashes: Option<Box<FitHashes>>,
    /// Whether a batch of the window made it.
    #[serde(default)]
    pub batch: bool,
    /// Persons counted, where as many were fitted; of a table that is opened, those that were fitted.
    #[serde(default)]
    pub people: Option<usize>,
    /// Persons annotated, where that is known.
    #[serde(default)]
    pub annotated: Option<usize>,
    /// Its joints, m, where a fit of this session made it: predictions are compared with them.
    #[serde(skip)]
    pub joints: Option<Arc<[[f32; 3]]>>,
}

/// What identifies a fit: a label remembers it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FitHashes {
    /// Hash of the parameters.
    pub fit: String,
    /// Hash of the settings.
    pub config: String,
    /// The iteration.
    pub iteration: usize,
}

/// Everything behind the window.
#[derive(Debug, Default)]
pub struct Session {
    /// Data set and frame.
    pub data: Data,
    /// The fit of the frame on screen.
    pub fit: Fit,
    /// Fits of other frames that were left, to be found again.
    pub fits: BTreeMap<usize, Fit>,
    /// Frames in the order they were left, oldest first: the oldest fits are forgotten first.
    pub(super) left: VecDeque<usize>,
    /// One line a fitted frame.
    pub summaries: Tracked<BTreeMap<usize, FrameSummary>>,
    /// What the results in the list were read from, in words; `None` for fits of this session and its batches.
    pub(super) results_from: Option<String>,
    /// Two sets of results that are compared.
    pub results: ResultSets,
    /// The frame list.
    pub queue: Queue,
    /// What the list was filled from.
    pub(super) listed: Option<ListedFrom>,
    /// How hard the frames are.
    pub strata: Strata,
    /// What people say of the frames.
    pub labels: Labels,
    /// Fits of many frames at once.
    pub batch: Batch,
    /// What the machine says of the fit on screen.
    pub(super) evidence: EvidenceState,
    /// The frame on screen, fitted with two presets.
    pub presets: PresetCard,
    /// Whether that is done with the first frame that is there.
    pub(super) presets_first: bool,
    /// What else the fits could have done.
    pub explore: Explorations,
    /// Of how many starts of a frame the fits end in the best basin, a share, where that was tried.
    pub best_basins: Tracked<BTreeMap<usize, f64>>,
    /// Fits that others are compared with.
    pub pins: Pins,
    /// Predictions of others.
    pub sources: Sources,
    /// Where runs stop.
    pub breakpoints: Breakpoints,
    /// The study on screen.
    pub study: StudyView,
    /// Settings.
    pub config: FitConfig,
    /// Scalar of the kernel.
    pub precision: Precision,
    /// Who is who from frame to frame.
    pub(super) identities: Identities,
    /// Start the next frame from this one's result.
    pub warm_start: bool,
    /// The frames around decide with each frame where its fit starts.
    pub along: bool,
    /// The selected joint (flat index).
    pub joint: Option<usize>,
    /// How things are shown.
    pub view: ViewState,
    /// The log, oldest first.
    pub log: VecDeque<LogLine>,
    /// The newest that is to be told.
    pub notice: Option<Notice>,
    /// Where the session was saved to or opened from.
    pub session_path: Option<PathBuf>,
    /// Where to begin in the data set that is being opened.
    pub(super) aim: StartAt,
    /// A session file whose data set is being opened.
    pub(super) restoring: Option<(PathBuf, Box<SessionFile>)>,
    /// A table of results whose data set is being opened.
    pub(super) waiting_results: Option<PathBuf>,
    pub(super) jobs: JobId,
    /// Settings under a finger.
    pub(super) drag: Option<Drag>,
    /// The body under a finger.
    pub(super) moving: Option<Moving>,
    /// Acts on settings.
    pub(super) settings: SettingsActs,
    /// Acts so far, on labels or on settings.
    pub(super) acts_done: u64,
    /// Iterations a second that the worker was told.
    pub(super) pace: Option<f64>,
    /// Files that are being written.
    pub(super) writing: usize,
    /// The next run that a person asks for is slow enough to be watched.
    pub(super) slow_first_run: bool,
}

impl Session {
    /// Nothing open yet; shown as in an earlier session, and with what was opened in it, newest first.
    pub fn remembered(view: ViewState, recent: Vec<PathBuf>) -> Self {
        Self { view, data: Data { recent, ..Data::default() }, ..Self::default() }
    }

    /// For a person who was not here before: two presets are compared on the first frame, and the first run is slow enough to
    /// be watched.
    pub fn first_visit(self) -> Self {
        Self { slow_first_run: true, presets_first: true, ..self }
    }
}
