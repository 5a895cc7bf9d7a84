//! The only mutator: a command in, effects out.
//!
//! Here is the table from commands to functions; `data` opens and loads, `fit` steers the optimiser, `reports` takes in what
//! the worker says.

mod data;
mod fit;
mod reports;

use super::command::{Command, Effect};
use super::state::{LOG_LINES, LogLevel, LogLine, Session};

impl Session {
    /// Applies one command and answers what the outside has to do for it.
    pub fn apply(&mut self, command: Command) -> Vec<Effect> {
        match command {
            Command::Open(path) => self.open(path),
            Command::Pick(kind) => vec![Effect::Pick(kind)],
            Command::OpenBare(path, choice) => {
                self.data.bare = None;
                self.data.opening = Some(data::opening(path.clone()));
                vec![Effect::OpenBare(path, choice)]
            }
            Command::DismissBare => {
                self.data.bare = None;
                Vec::new()
            }
            Command::CancelOpen => {
                self.data.opening = None;
                vec![Effect::CancelOpen]
            }
            Command::OpenProgress { stage, done, total } => {
                if let Some(opening) = &mut self.data.opening {
                    (opening.stage, opening.done, opening.total) = (stage, done, total);
                }
                Vec::new()
            }
            Command::Opened(path, result) => self.opened(path, result),
            Command::GotoFrame(index) => self.goto_frame(index),
            Command::StepFrames(by) => {
                let last = self.data.len().saturating_sub(1);
                let target = self.data.frame_index.saturating_add_signed(by).min(last);
                if self.data.playing && target == self.data.frame_index {
                    self.data.playing = false;
                }
                self.goto_frame(target)
            }
            Command::FrameLoaded(index, result) => self.frame_loaded(index, result),
            Command::TogglePlay => {
                self.data.playing = !self.data.playing && self.data.len() > 1;
                Vec::new()
            }
            Command::ToggleRun => self.toggle_run(),
            Command::StepFit(n) => self.step_fit(n),
            Command::StepBack(n) => {
                let target = self.fit.shown_iteration().saturating_sub(n);
                self.goto_iteration(target)
            }
            Command::GotoIteration(iteration) => self.goto_iteration(iteration),
            Command::FollowLive => self.follow_live(),
            Command::Reset => self.reset(),
            Command::Discard => self.discard(),
            Command::SelectBranch(id) => self.select_branch(id),
            Command::SetConfig(config) => self.set_config(config),
            Command::SetPrecision(precision) => {
                if self.precision == precision {
                    return Vec::new();
                }
                self.precision = precision;
                self.reset()
            }
            Command::SetWarmStart(on) => {
                self.warm_start = on;
                Vec::new()
            }
            Command::EditParams(params) => self.edit(*params),
            Command::Worker(message) => self.worker_message(message),
            Command::Snapshot(snapshot) => {
                self.snapshot(*snapshot);
                Vec::new()
            }
            Command::SelectJoint(joint) => {
                self.joint = joint;
                Vec::new()
            }
            Command::SetView(view) => {
                self.view = *view;
                Vec::new()
            }
            Command::Log(level, text) => {
                self.note(level, text);
                Vec::new()
            }
            Command::ClearLog => {
                self.log.clear();
                Vec::new()
            }
            Command::ClearRecent => {
                self.data.recent.clear();
                Vec::new()
            }
        }
    }

    /// Writes a line to the log; warnings and errors also become the notice.
    pub(super) fn note(&mut self, level: LogLevel, text: String) {
        tracing::debug!("{text}");
        if level != LogLevel::Info {
            let count = self.notice.as_ref().map_or(0, |(count, ..)| *count);
            self.notice = Some((count + 1, level, text.clone()));
        }
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(LogLine { at: std::time::SystemTime::now(), level, text });
    }
}
