//! Running, stepping, going back, branching, changing settings.

use crate::body::Pppr;
use crate::config::FitConfig;
use crate::session::effect::Effect;
use crate::session::fit::FitStatus;
use crate::session::state::{LogLevel, Session};
use crate::worker::WorkerCommand;
use std::sync::Arc;

/// What the first run of a person takes, s.
const FIRST_RUN_S: f64 = 4.0;
/// What a replay takes at full speed, s.
const FASTEST_REPLAY_S: f64 = 1.0;

impl Session {
    /// The run is watched at another speed, from now on.
    pub(super) fn set_speed(&mut self) -> Vec<Effect> {
        self.slow_first_run = false;
        self.set_pace(self.view.speed.pace())
    }

    /// Tells the worker the pace of runs, where it is another one.
    fn set_pace(&mut self, pace: Option<f64>) -> Vec<Effect> {
        if self.pace == pace {
            return Vec::new();
        }
        self.pace = pace;
        vec![Effect::Send(WorkerCommand::Pace(pace))]
    }

    /// Plays the iterations of the branch on screen from its first one, or stops playing them.
    pub(super) fn toggle_replay(&mut self) -> Vec<Effect> {
        if self.fit.replay.take().is_some() || !self.fit.is_ready() || self.fit.is_running() {
            return Vec::new();
        }
        let Some(branch) = self.fit.branch().filter(|branch| branch.rows.len() > 1) else { return Vec::new() };
        let (start, head) = (branch.start(), branch.head());
        let shown = self.fit.shown_iteration();
        let from = if shown >= head { start } else { shown };
        self.fit.replay = Some(from as f64);
        self.show_iteration(from)
    }

    /// The replay gets on by so many seconds.
    pub(super) fn play_on(&mut self, seconds: f64) -> Vec<Effect> {
        let (Some(at), Some(branch)) = (self.fit.replay, self.fit.branch()) else { return Vec::new() };
        let (start, head) = (branch.start(), branch.head());
        let pace = self.view.speed.pace().unwrap_or((head - start) as f64 / FASTEST_REPLAY_S);
        let next = at + pace * seconds;
        if next >= head as f64 {
            self.fit.replay = None;
            return self.show_iteration(head);
        }
        self.fit.replay = Some(next);
        self.show_iteration(next as usize)
    }

    pub(super) fn toggle_run(&mut self) -> Vec<Effect> {
        if self.fit.is_running() {
            return vec![Effect::Send(WorkerCommand::Pause)];
        }
        if !self.fit.is_ready() {
            return Vec::new();
        }
        let (head, asked) = (self.fit.head(), self.config.iterations);
        let target = if head < asked { asked } else { head + asked };
        let mut pace = self.view.speed.pace();
        if pace.is_none() && std::mem::take(&mut self.slow_first_run) {
            let slow = ((target - head) as f64 / FIRST_RUN_S).max(1.0);
            pace = Some(slow);
            let text = format!(
                "Your first run, slowed to {slow:.0} iterations a second to be watched. It takes {:.0} ms: “max” beside Run.",
                self.fit_ms().unwrap_or_default().max(1.0)
            );
            self.hint(text);
        }
        self.run_at(target, pace)
    }

    /// A run as fast as it goes.
    pub(super) fn run_to(&mut self, target: usize) -> Vec<Effect> {
        self.run_at(target, None)
    }

    fn run_at(&mut self, target: usize, pace: Option<f64>) -> Vec<Effect> {
        self.fit.cursor = None;
        self.fit.replay = None;
        self.fit.status = FitStatus::Running;
        self.fit.reason = None;
        self.fit.run = (self.fit.run.0 + 1, self.fit.head());
        let mut effects = self.set_pace(pace);
        effects.push(Effect::Send(WorkerCommand::RunTo { target, run: self.fit.run.0 }));
        effects
    }

    pub(super) fn step_fit(&mut self, n: usize) -> Vec<Effect> {
        if !self.fit.is_ready() {
            return Vec::new();
        }
        let (shown, head) = (self.fit.shown_iteration(), self.fit.head());
        if shown < head {
            // States may be thinned out: the next one that is kept, or a step would stay where it is.
            let wanted = (shown + n).min(head);
            let next = self.fit.branch().and_then(|branch| branch.kept_from(wanted));
            return self.goto_iteration(next.unwrap_or(head));
        }
        if self.fit.is_running() {
            return Vec::new();
        }
        self.run_to(head + n)
    }

    /// Looks at an iteration; one that is being played stays there.
    pub(super) fn goto_iteration(&mut self, iteration: usize) -> Vec<Effect> {
        self.fit.replay = None;
        self.show_iteration(iteration)
    }

    fn show_iteration(&mut self, iteration: usize) -> Vec<Effect> {
        let Some(branch) = self.fit.branch() else { return Vec::new() };
        let wanted = iteration.clamp(branch.start(), branch.head());
        if wanted == branch.head() {
            return self.follow_live();
        }
        let Some((kept, state)) = branch.state_at(wanted) else { return Vec::new() };
        let (id, config, state) = (branch.id, branch.config_at(kept), Arc::clone(state));
        if self.fit.cursor == Some(kept) || !self.fit.is_ready() {
            return Vec::new();
        }
        self.fit.cursor = Some(kept);
        vec![Effect::Send(WorkerCommand::Inspect { branch: id, state, config: Box::new(config) })]
    }

    /// Back to the newest iteration: its state is looked at until the worker publishes a newer one.
    pub(super) fn follow_live(&mut self) -> Vec<Effect> {
        if self.fit.cursor.take().is_none() || self.fit.is_running() {
            return Vec::new();
        }
        self.inspect_head()
    }

    pub(super) fn inspect_head(&self) -> Vec<Effect> {
        let Some(branch) = self.fit.branch() else { return Vec::new() };
        let Some((_, state)) = branch.state_at(branch.head()) else { return Vec::new() };
        let (id, config, state) = (branch.id, branch.newest_config(), Arc::clone(state));
        vec![Effect::Send(WorkerCommand::Inspect { branch: id, state, config: Box::new(config) })]
    }

    pub(super) fn reset(&mut self) -> Vec<Effect> {
        let Some(frame) = self.data.frame.as_ref().map(|frame| frame.index) else { return Vec::new() };
        self.fits.remove(&frame);
        self.forget_summary(frame);
        self.note(LogLevel::Info, "reset: a new start pose with the current settings".into());
        self.begin_fit(frame, None)
    }

    pub(super) fn discard(&mut self) -> Vec<Effect> {
        if !self.fit.is_ready() {
            return Vec::new();
        }
        let id = self.fit.history.active_id();
        if let Some((parent, at)) = self.fit.history.discard(id) {
            self.note(LogLevel::Info, format!("discarded branch {id}; back on branch {parent}, which it left at {at}"));
        } else {
            self.fit.history.keep_start();
            self.note(LogLevel::Info, "discarded the run; back at the start pose".into());
        }
        self.fit.status = FitStatus::Paused;
        self.fit.reason = None;
        self.continue_active()
    }

    pub(super) fn select_branch(&mut self, id: u32) -> Vec<Effect> {
        if !self.fit.is_ready() || id == self.fit.history.active_id() {
            return Vec::new();
        }
        self.fit.history.activate(id);
        self.continue_active()
    }

    /// The worker continues at the head of the active branch, with that branch's newest settings.
    pub(super) fn continue_active(&mut self) -> Vec<Effect> {
        self.fit.cursor = None;
        self.fit.status = FitStatus::Paused;
        let Some(branch) = self.fit.branch() else { return Vec::new() };
        let Some((_, state)) = branch.state_at(branch.head()) else { return Vec::new() };
        let (id, config, state) = (branch.id, branch.newest_config(), Arc::clone(state));
        self.config = FitConfig { iterations: self.config.iterations, ..config };
        self.summarise();
        let (erased, around) = (self.fit.erased(), self.fit.around());
        vec![Effect::Send(WorkerCommand::Branch { branch: id, state, config: Box::new(self.config), erased, around })]
    }

    /// Where an earlier iteration is looked at: starts a branch there with the current settings.
    pub(super) fn branch_at_cursor(&mut self) -> Option<Vec<Effect>> {
        let at = self.fit.cursor?;
        let branch = self.fit.branch()?;
        let (kept, state) = branch.state_at(at).map(|(k, s)| (k, Arc::clone(s)))?;
        let parent = branch.id;
        // Until the worker answers with the row under the new settings, the branch begins with the one that is known.
        let row = branch.row(kept).cloned();
        let id = self.fit.history.begin(Some((parent, kept)), self.config);
        if let Some(row) = row {
            self.fit.history.push(id, row);
        }
        self.fit.cursor = None;
        self.fit.status = FitStatus::Paused;
        // What a finger does is told when it is lifted.
        if self.drag.is_none() {
            let text = format!("branch {id} begins at iteration {kept} of branch {parent}: edited by hand");
            self.note(LogLevel::Info, text);
        }
        let (erased, around) = (self.fit.erased(), self.fit.around());
        Some(vec![Effect::Send(WorkerCommand::Branch {
            branch: id,
            state,
            config: Box::new(self.config),
            erased,
            around,
        })])
    }

    pub(super) fn edit(&mut self, params: Pppr) -> Vec<Effect> {
        if !self.fit.is_ready() {
            return Vec::new();
        }
        if !params.is_finite() {
            self.note(LogLevel::Error, "an edited parameter is not a finite number; nothing was changed".into());
            return Vec::new();
        }
        // An edit needs a branch of its own, or it would rewrite the row that is already there.
        if self.fit.cursor.is_none() && self.fit.branch().is_some_and(|b| b.rows.len() > 1) {
            self.fit.cursor = Some(self.fit.head());
        }
        self.fit.edited = true;
        let mut effects = self.branch_at_cursor().unwrap_or_default();
        effects.push(Effect::Send(WorkerCommand::Edit(Box::new(params))));
        effects
    }
}
