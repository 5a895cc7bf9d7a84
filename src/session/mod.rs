//! The state behind the window, and the only two functions that change it.
//!
//! [`Session::apply`] takes a [`Command`], what a person asks; [`Session::report`] takes a [`Report`], what a thread tells. Both
//! answer [`Effect`]s, requests to the outside: open, load, run. They need no thread, no window and no GPU, so every
//! behaviour of the window can be tested without one. The [`Runtime`] owns the session and carries the effects out: the window
//! gets it to read and can only send commands.
//!
//! **Time.** A pass of the window has 16 ms of its thread, also on 100,000 frames. What takes longer is an [`Effect`]: it
//! is done by a thread of the [`Runtime`] and comes back as a report. `tests/window/large` measures it.
//!
//! **Memory.** A window on 100,000 frames, all of them labelled, graded and with results, takes less than 1 GiB besides
//! the pictures: frames that were read up to 512 MiB ([`crate::dataset::DEFAULT_BUDGET`]), the states of one fit up to
//! 128 MiB, what can be undone up to 64 MiB; a label takes about 1 KiB, a row of results 0.3 KiB, a frame's strata 0.1 KiB.

mod acts;
mod apply;
mod batch;
mod body_move;
mod breakpoints;
mod command;
mod compared;
mod effect;
mod evidence;
mod explore;
mod file;
mod fit;
mod history;
mod identity;
mod labels;
mod pins;
mod presets;
mod queue;
mod records;
mod report;
mod results;
mod runtime;
mod settings;
mod sources;
mod state;
mod strata;
mod study;
mod tracked;
mod under_way;
mod view;
mod work;

pub use acts::{ActKind, Asked, Changes, Done, LabelAct};
pub use apply::{ErasedEffect, OutputCheck};
pub use batch::{Batch, BatchRequest};
pub use body_move::{BodyMove, root_of};
pub use breakpoints::{Breakpoints, StopPoint};
pub use command::{Command, Export, PickKind, StartAt};
pub use compared::{ComparedNumber, ResultSet, ResultSets, ResultSide, SetDifference};
pub use effect::{BackgroundTask, Commit, Effect, PinRequest, Trash};
pub use evidence::EvidenceRequest;
pub use explore::{AdoptedFit, ExplorationState, Explorations, ExploreNews};
pub use file::{SavedChange, SavedDataset, SavedFit, SavedFrame, SavedPin, SavedSource, SessionFile, SessionFileError};
pub use fit::{Fit, FitStatus};
pub use history::{Branch, Flag, History, IterationRow};
pub use labels::{LabelMode, LabelStatus, LabelTable, Labels};
pub use pins::{MOST_PINS, Pin, PinRow, Pins, numbers};
pub use presets::{PresetCard, PresetFits};
pub use queue::{FrameFilter, FrameNumber, FrameRow, Queue, Reads, SavedView, Sort, SortKey, syntax};
pub use records::Records;
pub use report::{OpenedLabels, Report, Written};
pub use results::FoundResults;
pub use runtime::{Picker, Runtime, Wake};
pub use settings::{Live, LiveFrom, RunSpeed};
pub use sources::{
    MOST_SOURCES, Source, SourceErrors, SourceNumber, SourceNumbers, SourceQuestion, Sources, frame_rows,
};
pub use state::{Data, FitHashes, FrameSummary, LogLevel, LogLine, Notice, Opening, Session};
pub use strata::{Strata, StrataStatus};
pub use study::{StudyOrder, StudyRequest, StudyView};
pub use tracked::Tracked;
pub use view::{
    Against, ColorRange, Compare, CubeAxes, CubeView, CurvesShown, Isolate, MapLimits, MapScale, Smoothing, SplatMode,
    ThemeChoice, ThirdAxis, TimelineStrip, ViewState,
};
pub use work::{Work, WorkStatus};
