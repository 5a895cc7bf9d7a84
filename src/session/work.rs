//! How far long work on many frames is: shared by batches and studies.

use std::time::{Duration, Instant};

/// How far it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WorkStatus {
    /// None is under way.
    #[default]
    Idle,
    /// Fits are being done.
    Running {
        /// Fits done.
        done: u64,
        /// Of how many; 0 where nobody knows yet.
        total: u64,
        /// Whether it waits for somebody to let it go on.
        paused: bool,
    },
}

/// Work on many frames, with what is left of it.
#[derive(Debug, Default)]
pub struct Work {
    /// How far it is.
    pub status: WorkStatus,
    /// Fits take so long that this much time has passed for so many, without pauses.
    pace: Option<Pace>,
}

#[derive(Debug, Clone, Copy)]
struct Pace {
    began: Instant,
    paused: Duration,
    pause_began: Option<Instant>,
    /// Fits that were there when it began.
    known: u64,
}

impl Work {
    /// It begins with this many fits.
    pub(super) fn begin(&mut self, total: u64) {
        *self = Self { status: WorkStatus::Running { done: 0, total, paused: false }, pace: None };
    }

    /// So many fits are done, of so many.
    pub(super) fn advance(&mut self, done_now: u64, total_now: u64) {
        let WorkStatus::Running { done, total, .. } = &mut self.status else { return };
        // What was known from before came at once and says nothing of the pace.
        let pace = Pace { began: Instant::now(), paused: Duration::ZERO, pause_began: None, known: done_now };
        self.pace.get_or_insert(pace);
        (*done, *total) = (done_now, total_now);
    }

    /// It waits, or goes on; answers which, `None` where nothing is under way.
    pub(super) fn toggle_pause(&mut self) -> Option<bool> {
        let WorkStatus::Running { paused, .. } = &mut self.status else { return None };
        *paused = !*paused;
        let wait = *paused;
        if let Some(pace) = &mut self.pace {
            match (wait, pace.pause_began.take()) {
                (true, _) => pace.pause_began = Some(Instant::now()),
                (false, Some(began)) => pace.paused += began.elapsed(),
                (false, None) => {}
            }
        }
        Some(wait)
    }

    /// What is left, about; `None` until that can be told.
    pub fn eta(&self) -> Option<Duration> {
        let WorkStatus::Running { done, total, .. } = self.status else { return None };
        let pace = self.pace?;
        let fitted = done.checked_sub(pace.known).filter(|fitted| *fitted > 0)?;
        let waited = pace.paused + pace.pause_began.map_or(Duration::ZERO, |began| began.elapsed());
        let each = pace.began.elapsed().saturating_sub(waited).as_secs_f64() / fitted as f64;
        Duration::try_from_secs_f64(each * total.saturating_sub(done) as f64).ok()
    }

    /// True while fits are being done.
    pub fn is_running(&self) -> bool {
        self.status != WorkStatus::Idle
    }

    /// True while it takes cores: under way, and not waiting for somebody.
    pub(super) fn takes_cores(&self) -> bool {
        matches!(self.status, WorkStatus::Running { paused: false, .. })
    }
}
