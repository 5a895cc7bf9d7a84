//! Settings under a finger: one act from where it goes down until it is lifted, and a fit that follows it where that is
//! quick.
//!
//! ```text
//! DragConfig … DragConfig ──▶ Refit (the worker does the newest) ──▶ Refitted, Rows, Snapshot ──▶ one branch, rewritten
//! EndDrag ──▶ one line of the log, one act to undo
//! ```

use crate::config::{FitConfig, ReadBy, difference};
use crate::mhp::FitState;
use crate::session::acts::ActKind;
use crate::session::effect::Effect;
use crate::session::fit::FitStatus;
use crate::session::history::Branch;
use crate::session::settings::{Drag, Live, LiveFrom, SettingsAct};
use crate::session::state::{LogLevel, Session};
use crate::worker::WorkerCommand;
use std::sync::Arc;

impl Session {
    /// Milliseconds that a whole fit of the frame on screen takes, about; `None` before one is prepared.
    pub fn fit_ms(&self) -> Option<f64> {
        self.fit.problem.as_ref().map(|_| self.fit.step_ms * self.config.iterations as f64)
    }

    /// Whether a change of settings fits anew at once.
    pub fn is_live(&self) -> bool {
        match self.view.live {
            Live::On => true,
            Live::Off => false,
            Live::Auto => self.fit_ms().is_some_and(|ms| ms < Live::QUICK_MS),
        }
    }

    /// Whether settings or the body are under a finger.
    pub fn is_dragging(&self) -> bool {
        self.drag.is_some() || self.moving.is_some()
    }

    /// Whether a new start would be another one than that of the fit on screen: settings that only a start reads have
    /// changed since.
    pub fn needs_new_start(&self) -> bool {
        let begun = self.fit.is_ready() && self.fit.found_start.is_some();
        begun && self.fit.start_config.is_some_and(|config| !same_start(&config, &self.config))
    }

    /// New settings, an act of their own.
    pub(super) fn set_config(&mut self, config: &FitConfig) -> Vec<Effect> {
        let mut effects = self.drag_config(config);
        effects.extend(self.end_drag());
        effects
    }

    /// New settings that are still under a finger.
    pub(super) fn drag_config(&mut self, config: &FitConfig) -> Vec<Effect> {
        let config = match config.validated() {
            Ok(config) => config,
            Err(error) => {
                self.note(LogLevel::Error, error.to_string());
                return Vec::new();
            }
        };
        if config == self.config {
            return Vec::new();
        }
        let before = std::mem::replace(&mut self.config, config);
        let from = self.fit.history.active_id();
        self.drag.get_or_insert(Drag { before, from, live: None, erasing: None, adopted: None });
        if !same_start(&config, &before) && self.fit.is_untouched() {
            return self.reset();
        }
        if matches!(self.fit.status, FitStatus::Idle | FitStatus::Failed(_) | FitStatus::Preparing) {
            return self.configure(&before);
        }
        // How long a run takes is no reason for another fit.
        if self.is_live() && !self.steers_only(&before) { self.refit() } else { self.configure(&before) }
    }

    /// The finger is lifted: what it did is one act.
    pub(super) fn end_drag(&mut self) -> Vec<Effect> {
        if let Some(moving) = self.moving.take() {
            return self.end_move(moving);
        }
        let waits = self.drag.as_ref().is_some_and(|drag| drag.erasing.is_some() && drag.live.is_none());
        let effects = if waits { self.refit() } else { Vec::new() };
        let Some(Drag { before, from, live, erasing, adopted }) = self.drag.take() else { return effects };
        let set = difference(&before, &self.config);
        let by_hand = erasing.as_ref().map(|(_, erased)| erased).or(adopted.as_ref()).cloned();
        let name = match (by_hand, &adopted) {
            (Some(begun), Some(_)) if !set.is_empty() => format!("{begun}, {set}"),
            (by_hand, _) => by_hand.unwrap_or(set),
        };
        let there = live.filter(|(branch, _)| self.fit.history.active_id() == *branch);
        if name.is_empty() {
            // Back where it was: so is the fit.
            if let Some((branch, _)) = there {
                self.fit.history.remove(branch);
                self.fit.history.activate(from);
                return self.continue_active();
            }
            return Vec::new();
        }
        // What holds before anything is open is how one begins, no act.
        if self.data.dataset.is_none() {
            return Vec::new();
        }
        let (active, start) = (self.fit.history.active_id(), self.fit.branch().map_or(0, Branch::start));
        let told = match there {
            Some((branch, at)) => format!("branch {branch} is the fit anew from iteration {at} on: {name}"),
            None if active != from && self.fit.is_ready() => {
                format!("branch {active} begins at iteration {start} of branch {from}: {name}")
            }
            None => name.clone(),
        };
        self.note(LogLevel::Info, told);
        self.acts_done += 1;
        self.labels.redo.clear();
        self.settings.push(SettingsAct {
            at: self.acts_done,
            name: name.clone(),
            settings: [before, self.config],
            frame: self.fit.frame,
            branches: [from, self.fit.history.active_id()],
            moved_at: None,
            erased: erasing.is_some(),
        });
        if let (Some((branch, _)), true) = (there, erasing.is_some()) {
            self.fit.history.edit(branch, name);
        }
        effects
    }

    /// Whether only when a run ends is set otherwise than before.
    fn steers_only(&self, before: &FitConfig) -> bool {
        self.config.same_but(before, |read_by| read_by == ReadBy::Run)
    }

    /// Settings that count from the next step on.
    fn configure(&mut self, before: &FitConfig) -> Vec<Effect> {
        if matches!(self.fit.status, FitStatus::Idle | FitStatus::Failed(_)) {
            return Vec::new();
        }
        if !self.steers_only(before)
            && let Some(effects) = self.branch_at_cursor()
        {
            return effects;
        }
        let mut effects = vec![Effect::Send(WorkerCommand::Configure(Box::new(self.config)))];
        if self.config.iterations != before.iterations && self.fit.is_running() {
            effects.extend(self.retarget());
        }
        effects
    }

    /// A run that is under way ends where it is asked to now, at the latest with its next step.
    fn retarget(&mut self) -> Vec<Effect> {
        let (head, asked) = (self.fit.head(), self.config.iterations);
        if head >= asked {
            return vec![Effect::Send(WorkerCommand::Pause)];
        }
        vec![Effect::Send(WorkerCommand::RunTo { target: asked, run: self.fit.run.0 })]
    }

    /// Fits anew with the settings under the finger, on the branch that is its own.
    pub(super) fn refit(&mut self) -> Vec<Effect> {
        let Some(drag) = self.drag.clone() else { return Vec::new() };
        if drag.adopted.is_some() {
            return Vec::new();
        }
        let known = drag.live.filter(|(branch, _)| self.fit.history.branch(*branch).is_some());
        let (parent, at) = match (known, self.view.live_from) {
            (Some((branch, at)), _) => match self.fit.history.branch(branch).and_then(|branch| branch.parent) {
                Some((parent, _)) => (parent, at),
                None => return Vec::new(),
            },
            (None, LiveFrom::Shown) => (drag.from, self.fit.shown_iteration()),
            (None, LiveFrom::Start) => self.fit.history.start_of(drag.from),
        };
        let Some((at, state, row)) = self.fit.history.branch(parent).and_then(|branch| {
            let (at, state) = branch.state_at(at)?;
            Some((at, Arc::clone(state), branch.row(at)?.clone()))
        }) else {
            return Vec::new();
        };
        let branch = known.map_or_else(
            || {
                let branch = self.fit.history.begin(Some((parent, at)), self.config);
                // Until the worker answers, the branch is the state that it begins at.
                self.fit.history.push(branch, row);
                branch
            },
            |(branch, _)| branch,
        );
        if let Some((cells, _)) = drag.erasing {
            self.fit.history.erase(branch, cells);
            self.fit.history.edit(branch, String::new());
        }
        if let Some(drag) = &mut self.drag {
            drag.live = Some((branch, at));
        }
        self.run_anew(branch, (at, state))
    }

    /// The worker writes a branch anew from a state at an iteration.
    pub(super) fn run_anew(&mut self, branch: u32, (at, state): (usize, Arc<FitState>)) -> Vec<Effect> {
        self.fit.cursor = None;
        self.fit.reason = None;
        self.fit.replay = None;
        self.fit.status = FitStatus::Running;
        self.fit.run = (self.fit.run.0 + 1, at);
        self.fit.refit_run = self.fit.run.0;
        let (target, erased, around) = (self.config.iterations.max(at + 1), self.fit.erased(), self.fit.around());
        vec![Effect::Send(WorkerCommand::Refit {
            branch,
            state,
            config: Box::new(self.config),
            target,
            run: self.fit.run.0,
            erased,
            around,
        })]
    }

    /// The act that would be undone, in words.
    pub fn undo_name(&self) -> Option<&str> {
        if self.settings_first(ActKind::Undo) {
            return self.settings.undo.last().map(|act| act.name.as_str());
        }
        self.labels.undo_name()
    }

    /// The number of the last act that is not undone.
    pub fn undo_act(&self) -> Option<u64> {
        let settings = self.settings.undo.last().map(|act| act.at);
        settings.max(self.labels.undo.last().map(|act| act.at))
    }

    /// The act that would be done again, in words.
    pub fn redo_name(&self) -> Option<&str> {
        if self.settings_first(ActKind::Redo) {
            return self.settings.redo.last().map(|act| act.name.as_str());
        }
        self.labels.redo_name()
    }

    /// Whether the next act to be undone, or done again, is one on settings.
    fn settings_first(&self, kind: ActKind) -> bool {
        if kind == ActKind::Redo {
            let (settings, labels) = (self.settings.redo.last(), self.labels.redo.last());
            return settings.is_some_and(|act| labels.is_none_or(|label| act.at < label.at));
        }
        let (settings, labels) = (self.settings.undo.last(), self.labels.undo.last());
        settings.is_some_and(|act| labels.is_none_or(|label| act.at > label.at))
    }

    /// Takes the last act back.
    pub(super) fn undo(&mut self) -> Vec<Effect> {
        if !self.settings_first(ActKind::Undo) {
            return self.undo_label();
        }
        let Some(act) = self.settings.undo.pop() else { return Vec::new() };
        let effects = self.put_back(&act, 0);
        self.hint(format!("undo: {}", act.name));
        self.settings.redo.push(act);
        effects
    }

    /// Does it again.
    pub(super) fn redo(&mut self) -> Vec<Effect> {
        if !self.settings_first(ActKind::Redo) {
            return self.redo_label();
        }
        let Some(act) = self.settings.redo.pop() else { return Vec::new() };
        let effects = self.put_back(&act, 1);
        self.hint(format!("redo: {}", act.name));
        self.settings.undo.push(act);
        effects
    }

    /// The settings before (0) or after (1) an act, on the branch that was active then where it is still there and still has them.
    fn put_back(&mut self, act: &SettingsAct, side: usize) -> Vec<Effect> {
        if act.moved_at.is_some() || act.erased {
            return self.put_back_by_hand(act, side);
        }
        let (config, id) = (act.settings[side], act.branches[side]);
        let has_them = |branch: &Branch| branch.newest_config() == config;
        let there = self.fit.is_ready() && self.fit.frame == act.frame;
        if there && act.branches[0] != act.branches[1] && self.fit.history.branch(id).is_some_and(has_them) {
            let effects = self.select_branch(id);
            self.config = config;
            return effects;
        }
        let before = std::mem::replace(&mut self.config, config);
        self.configure(&before)
    }
}

/// Whether a start found with either would be the same one.
fn same_start(a: &FitConfig, b: &FitConfig) -> bool {
    a.same_but(b, |read_by| read_by != ReadBy::Start)
}
