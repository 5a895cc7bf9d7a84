//! The state behind the window, and the only function that changes it.
//!
//! [`Session::apply`] takes a [`Command`] and answers [`Effect`]s, requests to the outside: open, load, run. It needs no
//! thread, no window and no GPU, so every behaviour of the window can be tested without one. Panes read the session and
//! send commands; threads report back by commands too.

mod acts;
mod apply;
mod command;
mod evidence;
mod file;
mod fit;
mod history;
mod labels;
mod pins;
mod queue;
mod records;
mod results;
mod runtime;
mod state;
mod strata;
mod view;

pub use acts::{Act, ActKind, Asked, Changes, Done};
pub use command::{Command, Commit, Effect, Export, OpenedLabels, PickKind, PinRequest, Task, Trash, Written};
pub use evidence::EvidenceRequest;
pub use file::{SavedDataset, SavedFit, SavedFrame, SavedPin, SessionFile, SessionFileError};
pub use fit::{Fit, FitStatus};
pub use history::{Branch, Flag, History, Row, difference};
pub use labels::{LabelMode, LabelStatus, LabelTable, Labels};
pub use pins::{MOST_PINS, Pin, PinRow, Pins, numbers};
pub use queue::{Facts, Number, Queue, Reads, Rule, SYNTAX, SavedView, Sort, SortKey};
pub use records::Records;
pub use results::FoundResults;
pub use runtime::{Picker, Runtime, Wake};
pub use state::{Data, FitHashes, FrameSummary, LogLevel, LogLine, Opening, Session};
pub use strata::{Strata, StrataStatus};
pub use view::{Against, ColorRange, Compare, MapScale, SplatMode, Strip, ThemeChoice, ViewState};
