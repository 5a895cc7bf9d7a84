//! The state behind the window, and the only function that changes it.
//!
//! [`Session::apply`] takes a [`Command`] and answers [`Effect`]s, requests to the outside: open, load, run. It needs no
//! thread, no window and no GPU, so every behaviour of the window can be tested without one. Panes read the session and
//! send commands; threads report back by commands too.

mod apply;
mod command;
mod fit;
mod history;
mod runtime;
mod state;
mod view;

pub use command::{Command, Effect, PickKind};
pub use fit::{Fit, FitStatus};
pub use history::{Branch, Flag, History, Row};
pub use runtime::{Picker, Runtime, Wake};
pub use state::{Data, FrameSummary, LogLevel, LogLine, Opening, Session};
pub use view::{ColorRange, Compare, FrameSort, MapScale, SplatMode, ThemeChoice, ViewState};
