//! What a pane asks of the state on screen and a thread answers: the newest question wins, and none is asked while a run goes on or
//! something is dragged.

use crate::explore::{Halt, IdleCores};
use crate::session::Session;
use crate::task::{Job, Progress};
use crate::worker::Snapshot;
use egui::Ui;
use std::sync::Arc;

/// A state of the fit, and what else is asked with it.
#[derive(Clone)]
struct Question<K>(Arc<Snapshot>, K);

impl<K: PartialEq> PartialEq for Question<K> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) && self.1 == other.1
    }
}

/// A thread at work on a question.
type Asked<K, T> = (Question<K>, Job<T, Halt>);

/// The last answer, and what is under way.
pub(super) struct Answered<K, T: Send + 'static> {
    job: Option<Asked<K, T>>,
    known: Option<(Question<K>, Result<T, String>)>,
}

impl<K, T: Send + 'static> Default for Answered<K, T> {
    fn default() -> Self {
        Self { job: None, known: None }
    }
}

impl<K: Clone + PartialEq, T: Send + 'static> Answered<K, T> {
    /// Whether a thread is at work.
    pub(super) fn is_working(&self) -> bool {
        self.job.is_some()
    }

    /// The last answer; or in words why there is none.
    pub(super) fn last(&self) -> Option<&Result<T, String>> {
        self.known.as_ref().map(|(_, answer)| answer)
    }

    /// Whether the last answer is of another state than `shown`.
    pub(super) fn is_of_another(&self, shown: &Arc<Snapshot>) -> bool {
        self.known.as_ref().is_none_or(|(of, _)| !Arc::ptr_eq(&of.0, shown))
    }

    /// Takes an answer that came; whether one did.
    pub(super) fn poll(&mut self) -> bool {
        let Some(answer) = self.job.as_mut().and_then(|(_, job)| job.poll()) else { return false };
        self.known = self.job.take().map(|(of, _)| (of, answer.map_err(|halt| halt.to_string())));
        true
    }

    /// Asks for the state on screen with `with`, where that was not asked yet: `work` makes what a thread called `name` does on
    /// idle cores.
    pub(super) fn ask<W>(
        &mut self,
        (ui, session): (&Ui, &Session),
        with: K,
        name: &str,
        work: impl FnOnce(&Snapshot) -> Option<W>,
    ) where
        W: FnOnce((&IdleCores, &Progress)) -> Result<T, Halt> + Send + 'static,
    {
        let Some(shown) = &session.fit.shown else { return };
        let asked = Question(Arc::clone(shown), with);
        let there = self.known.as_ref().is_some_and(|(of, _)| *of == asked);
        let under_way = self.job.as_ref().is_some_and(|(of, _)| *of == asked);
        if there || under_way || session.fit.is_running() || session.is_dragging() {
            return;
        }
        let Some(work) = work(shown) else { return };
        let (cores, ctx) = (session.explore.cores.clone(), ui.ctx().clone());
        let work = move |progress: &Progress| work((&cores, progress));
        // An older one is dropped, which cancels it.
        self.job = Some((asked, Job::start(name, work, Halt::Failed, move || ctx.request_repaint())));
    }
}
