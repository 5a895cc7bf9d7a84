//! What long work tells of itself, and how it is told to stop.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};

#[derive(Debug, Default)]
struct Inner {
    stage: Mutex<String>,
    done: AtomicU64,
    total: AtomicU64,
    cancelled: AtomicBool,
    paused: Mutex<bool>,
    resumed: Condvar,
}

/// Work was stopped because somebody asked for it ([`Progress::cancel`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cancelled;

/// Progress of one piece of work: cheap to clone, every clone sees the same. The worker writes, the window reads.
#[derive(Debug, Clone, Default)]
pub struct Progress(Arc<Inner>);

/// [`Progress`] at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgressState {
    /// What is being done, as shown to a person.
    pub stage: String,
    /// Units done in this stage.
    pub done: u64,
    /// Units in this stage; 0 where nobody knows yet.
    pub total: u64,
}

impl Progress {
    /// Nothing done yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins a stage of `total` units (0: unknown).
    pub fn begin(&self, stage: &str, total: u64) {
        stage.clone_into(&mut self.0.stage.lock().unwrap_or_else(PoisonError::into_inner));
        self.0.done.store(0, Ordering::Relaxed);
        self.0.total.store(total, Ordering::Relaxed);
    }

    /// Counts `units` as done.
    pub fn advance(&self, units: u64) {
        self.0.done.fetch_add(units, Ordering::Relaxed);
    }

    /// Adds `units` to the total of this stage.
    pub fn grow(&self, units: u64) {
        self.0.total.fetch_add(units, Ordering::Relaxed);
    }

    /// Stage, done and total.
    pub fn state(&self) -> ProgressState {
        ProgressState {
            stage: self.0.stage.lock().unwrap_or_else(PoisonError::into_inner).clone(),
            done: self.0.done.load(Ordering::Relaxed),
            total: self.0.total.load(Ordering::Relaxed),
        }
    }

    /// Asks the work to stop; it answers [`Cancelled`] soon after.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
        self.pause(false);
    }

    /// Lets the work wait at the next [`Self::wait_while_paused`], or go on.
    pub fn pause(&self, wait: bool) {
        *self.0.paused.lock().unwrap_or_else(PoisonError::into_inner) = wait;
        self.0.resumed.notify_all();
    }

    /// Returns once nobody wants the work to wait; at once after [`Self::cancel`].
    pub fn wait_while_paused(&self) {
        let mut paused = self.0.paused.lock().unwrap_or_else(PoisonError::into_inner);
        while *paused && !self.is_cancelled() {
            paused = self.0.resumed.wait(paused).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// True once [`Self::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Ordering::Relaxed)
    }

    /// To be asked between two units of work.
    pub(crate) fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}
