//! The threads of explorations: one of each kind at a time, the newest.

use super::Wake;
use crate::explore::{Exploration, ExplorationKind, Explored, Halt, IdleCores};
use crate::session::explore::ExploreNews;
use crate::session::report::Report;
use crate::task::{Job, Progress};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// What was found, as the window has not seen it yet.
type Newest = Arc<Mutex<Option<Explored>>>;

/// An exploration under way. Dropping it cancels it.
struct Running {
    number: u64,
    job: Job<Explored, Halt>,
    newest: Newest,
    told: (u64, u64),
}

/// All that are under way.
#[derive(Default)]
pub(super) struct Explorer {
    running: BTreeMap<ExplorationKind, Running>,
}

impl Explorer {
    pub(super) fn start(&mut self, number: u64, what: Exploration, cores: IdleCores, wake: &Wake) {
        let (kind, newest) = (what.kind(), Newest::default());
        let (shown, waker, wake) = (Arc::clone(&newest), Arc::clone(wake), Arc::clone(wake));
        let look = move |found| {
            *shown.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
            waker();
        };
        let work = move |progress: &Progress| what.explore(&cores, progress, &look);
        let broken = |text| Halt::Failed(format!("internal error: {text}"));
        let job = Job::start("explore", work, broken, move || wake());
        // The older one is dropped, and so cancelled.
        self.running.insert(kind, Running { number, job, newest, told: (0, 0) });
    }

    pub(super) fn stop(&self, kind: ExplorationKind) {
        if let Some(running) = self.running.get(&kind) {
            running.job.cancel();
        }
    }

    /// What is new of any of them.
    pub(super) fn poll(&mut self) -> Option<Report> {
        let news = self.running.iter_mut().find_map(|(&kind, running)| Some((kind, running.number, running.poll()?)));
        let (kind, number, news) = news?;
        if matches!(news, ExploreNews::Ended(_)) {
            self.running.remove(&kind);
        }
        Some(Report::Explored(kind, number, news))
    }
}

impl Running {
    fn poll(&mut self) -> Option<ExploreNews> {
        let state = self.job.progress().state();
        let newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(found) = newest {
            return Some(ExploreNews::Grew(found));
        }
        if let Some(done) = self.job.poll() {
            return Some(ExploreNews::Ended(match done {
                Ok(found) => Ok(Some(found)),
                Err(Halt::Cancelled) => Ok(None),
                Err(Halt::Failed(why)) => Err(why),
            }));
        }
        if self.told == (state.done, state.total) {
            return None;
        }
        self.told = (state.done, state.total);
        Some(ExploreNews::Progress(state.done, state.total))
    }
}
