//! The body under a finger: H_sim, masks and losses follow it; one act from where it goes down until it is lifted.
//!
//! ```text
//! DragBody … DragBody ──▶ Branch, Edit … Edit (the worker does the newest) ──▶ Rows, Snapshot ──▶ one branch of its own
//! EndDrag ──▶ one line of the log, one act to undo
//! ```

use crate::body::Pppr;
use crate::geometry::{Vec3, add};
use crate::session::body_move::{BodyMove, Held, Moving};
use crate::session::effect::Effect;
use crate::session::fit::FitStatus;
use crate::session::settings::SettingsAct;
use crate::session::state::{LogLevel, Session};
use crate::worker::WorkerCommand;
use std::sync::Arc;

impl Session {
    /// Whether the body is in a hand.
    pub fn is_moving(&self) -> bool {
        matches!(self.moving, Some(Moving::Held(_)))
    }

    /// The body is moved so far from where it was when the finger went down.
    pub(super) fn drag_body(&mut self, moved: BodyMove) -> Vec<Effect> {
        let mut effects = Vec::new();
        if self.moving.is_none() {
            match self.take_in_hand(moved) {
                Ok(begun) => effects = begun,
                Err(why) => {
                    self.moving = Some(Moving::Refused);
                    self.hint(why.into());
                }
            }
        }
        let (Some(Moving::Held(held)), Some(problem)) = (&mut self.moving, &self.fit.problem) else { return effects };
        held.moved = moved;
        if let Some(params) = moved.of(&held.base, &problem.skeleton).filter(Pppr::is_finite) {
            effects.push(Effect::Send(WorkerCommand::Edit(Box::new(params))));
        }
        effects
    }

    /// The selected joint, or with handles shown its person, moved on by so much, m, from where the hand has it.
    pub(super) fn nudge_body(&mut self, by: Vec3) -> Vec<Effect> {
        let Some(problem) = &self.fit.problem else { return Vec::new() };
        let joints = problem.skeleton.joints.len().max(1);
        let held = match &self.moving {
            Some(Moving::Held(held)) => Some(held.as_ref()),
            _ => None,
        };
        let moved = match (self.view.move_body, self.joint) {
            (true, joint) => {
                let person = joint.unwrap_or(0) / joints;
                let (so_far, yaw) = match held.map(|held| held.moved) {
                    Some(BodyMove::Person { by, yaw, .. }) => (by, yaw),
                    _ => ([0.0; 3], 0.0),
                };
                BodyMove::Person { person, by: add(so_far, by), yaw }
            }
            (false, Some(joint)) => {
                let in_hand = held.and_then(|held| held.moved.of(&held.base, &problem.skeleton));
                let positions = in_hand.as_ref().map_or_else(|| self.shown_positions(), Pppr::positions);
                let Some(&from) = positions.get(joint) else { return Vec::new() };
                BodyMove::Joint { joint, to: add(from, by), keep_bones: self.view.keep_bones }
            }
            (false, None) => {
                self.hint("select a joint to move it: J, or a click on it; H moves the whole body".into());
                return Vec::new();
            }
        };
        self.drag_body(moved)
    }

    /// Begins the branch that what is in the hand belongs to, at the iteration on screen.
    fn take_in_hand(&mut self, moved: BodyMove) -> Result<Vec<Effect>, &'static str> {
        match self.fit.status {
            FitStatus::Paused => {}
            FitStatus::Running => return Err("pause the run to move the body by hand"),
            _ => return Err("there is no fit whose body could be moved"),
        }
        let at = self.fit.shown_iteration();
        let known = self.fit.branch().and_then(|branch| {
            let (at, state) = branch.state_at(at)?;
            Some((branch.id, at, Arc::clone(state), branch.row(at)?.clone()))
        });
        let (parent, at, state, row) = known.ok_or("the iteration on screen is not kept: show another one")?;
        let branch = self.fit.history.begin(Some((parent, at)), self.config);
        // Until the worker answers, the branch is the state that it begins at.
        self.fit.history.push(branch, row);
        self.fit.history.edit(branch, String::new());
        let earlier = self.fit.cursor.take().is_some();
        (self.fit.replay, self.fit.reason, self.fit.edited) = (None, None, true);
        let base = state.params.clone();
        self.moving = Some(Moving::Held(Box::new(Held { base, from: (parent, at), earlier, branch, moved })));
        let (erased, around) = (self.fit.erased(), self.fit.around());
        Ok(vec![Effect::Send(WorkerCommand::Branch { branch, state, config: Box::new(self.config), erased, around })])
    }

    /// The finger is lifted: what it did is one act.
    pub(super) fn end_move(&mut self, moving: Moving) -> Vec<Effect> {
        let Moving::Held(held) = moving else { return Vec::new() };
        let Held { base, from: (from, at), earlier, branch, moved } = *held;
        let words = self.fit.problem.as_ref().and_then(|problem| moved.words(&base, &problem.skeleton));
        let Some(name) = words else {
            // Back where it was: so is the fit.
            self.fit.history.remove(branch);
            self.fit.history.activate(from);
            let mut effects = self.continue_active();
            if earlier {
                effects.extend(self.goto_iteration(at));
            }
            return effects;
        };
        self.fit.history.edit(branch, name.clone());
        self.note(LogLevel::Info, format!("branch {branch} begins at iteration {at} of branch {from}: {name}"));
        self.acts_done += 1;
        self.labels.redo.clear();
        self.settings.push(SettingsAct {
            at: self.acts_done,
            name,
            settings: [self.config; 2],
            frame: self.fit.frame,
            branches: [from, branch],
            moved_at: Some(at),
            erased: false,
        });
        Vec::new()
    }

    /// The fit before (0) or after (1) its body was moved or cells were erased, on the frame where that was done.
    pub(super) fn put_back_by_hand(&mut self, act: &SettingsAct, side: usize) -> Vec<Effect> {
        let [from, branch] = act.branches;
        let on_screen = self.fit.frame == act.frame && self.fit.problem.is_some();
        let fit = if on_screen { Some(&mut self.fit) } else { self.fits.get_mut(&act.frame) };
        let made_by = |fit: &&mut crate::session::Fit| {
            let branch = fit.history.branch(branch);
            let there = |at: usize, b: &crate::session::Branch| b.parent == Some((from, at));
            branch.is_some_and(|b| b.edit.as_ref() == Some(&act.name) && act.moved_at.is_none_or(|at| there(at, b)))
        };
        let Some(fit) = fit.filter(made_by) else {
            self.note(LogLevel::Warning, format!("the branch of “{}” is gone: the fit stays as it is", act.name));
            return Vec::new();
        };
        if !on_screen {
            fit.history.activate(act.branches[side]);
            fit.cursor = None;
            return Vec::new();
        }
        let mut effects = self.select_branch(act.branches[side]);
        if let Some(at) = act.moved_at.filter(|_| side == 0) {
            effects.extend(self.goto_iteration(at));
        }
        effects
    }
}
