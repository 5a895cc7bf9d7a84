//! What an exploration shows while it is under way, and how it ends.

use crate::task::{Cancelled, Progress};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What is new is shown no more often.
const SHOWN: Duration = Duration::from_millis(60);

/// Why an exploration ended without an answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Halt {
    /// Nobody wants it any more.
    Cancelled,
    /// It cannot be done; why, in a line.
    Failed(String),
}

impl std::fmt::Display for Halt {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Cancelled => write!(out, "cancelled"),
            Self::Failed(why) => write!(out, "{why}"),
        }
    }
}

impl Halt {
    /// Something that cannot be done, with its reason.
    pub(super) fn failed(why: impl std::fmt::Display) -> Self {
        Self::Failed(why.to_string())
    }
}

impl From<Cancelled> for Halt {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// The one who looks: hears how far it is, and gets what is there so far.
pub struct Showing<'a, T> {
    progress: &'a Progress,
    look: &'a (dyn Fn(T) + Sync),
    last: Mutex<Option<Instant>>,
}

impl<'a, T> Showing<'a, T> {
    /// `look` gets what is there, several times a second at most.
    pub fn new(progress: &'a Progress, look: &'a (dyn Fn(T) + Sync)) -> Self {
        Self { progress, look, last: Mutex::new(None) }
    }

    pub(super) fn progress(&self) -> &'a Progress {
        self.progress
    }

    pub(super) fn begin(&self, stage: &str, total: usize) {
        self.progress.begin(stage, total as u64);
    }

    pub(super) fn advance(&self, by: usize) {
        self.progress.advance(by as u64);
    }

    /// Shows what `made` makes, where `now` or where enough time has gone by.
    pub(super) fn maybe(&self, now: bool, made: impl FnOnce() -> T) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if now || last.is_none_or(|last| last.elapsed() >= SHOWN) {
            (self.look)(made());
            *last = Some(Instant::now());
        }
    }
}
