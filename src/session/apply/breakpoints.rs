//! Breakpoints are set, switched, hit.

use crate::condition::Breakpoint;
use crate::session::breakpoints::Breakpoints;
use crate::session::effect::Effect;
use crate::session::state::{LogLevel, Session};
use crate::worker::WorkerCommand;

impl Session {
    /// Why a condition cannot be a breakpoint here; `None` where it can.
    ///
    /// # Errors
    /// One line that names the term and what was expected.
    pub fn breakpoint_of(&self, text: &str) -> Result<Breakpoint, String> {
        let condition: Breakpoint = text.parse()?;
        if let Some(dataset) = &self.data.dataset {
            let info = dataset.info();
            let arrays: Vec<&str> = info.views.iter().map(|view| view.array.as_str()).collect();
            condition.check(&info.skeleton, &arrays)?;
        }
        Ok(condition)
    }

    pub(super) fn add_breakpoint(&mut self, text: &str) -> Vec<Effect> {
        match self.breakpoint_of(text) {
            Ok(condition) => {
                self.breakpoints.add(&condition);
                self.note(LogLevel::Info, format!("runs stop where {condition}"));
                self.watch()
            }
            Err(why) => {
                self.note(LogLevel::Error, format!("no breakpoint: {why}"));
                Vec::new()
            }
        }
    }

    pub(super) fn remove_breakpoint(&mut self, id: u32) -> Vec<Effect> {
        self.breakpoints.remove(id);
        self.watch()
    }

    pub(super) fn enable_breakpoint(&mut self, id: u32, on: bool) -> Vec<Effect> {
        if let Some(point) = self.breakpoints.of(id) {
            point.enabled = on;
        }
        self.watch()
    }

    /// Breakpoints as a session file kept them.
    pub(super) fn restore_breakpoints(&mut self, list: Vec<crate::session::breakpoints::StopPoint>) -> Vec<Effect> {
        self.breakpoints = Breakpoints::restored(list);
        self.watch()
    }

    /// Tells the worker where runs stop.
    fn watch(&self) -> Vec<Effect> {
        vec![Effect::Send(WorkerCommand::Watch(self.breakpoints.watched()))]
    }

    /// A run stopped at one.
    pub(super) fn broke(&mut self, branch: u32, iteration: usize, id: u32) {
        let frame = self.fit.frame;
        let Some(point) = self.breakpoints.of(id) else { return };
        point.hits += 1;
        point.last = Some((frame, iteration));
        let text = point.text.clone();
        self.fit.history.stopped(branch, iteration, text.clone());
        self.hint(format!("stopped at iteration {iteration}: {text}"));
    }
}
