//! Every step of a fit: reports for the curves, states to go back to, branches that began at an earlier state.

use crate::body::Pppr;
use crate::config::{FitConfig, difference};
use crate::mhp::{ErasedCells, FitState, StepReport};
use std::sync::Arc;

/// Bytes of states that one fit may keep; beyond it every second state is forgotten (its report stays).
pub(super) const STATE_BUDGET: usize = 128 << 20;

/// One iteration.
#[derive(Debug, Clone)]
pub struct IterationRow {
    /// Loss, terms, IoU.
    pub report: StepReport,
    /// Parameters and Adam moments; `None` where thinned out.
    pub state: Option<Arc<FitState>>,
    /// Mean absolute joint position error, mm, where there is truth.
    pub majpe_mm: Option<f64>,
}

impl IterationRow {
    /// The mean IoU over the views where it is defined.
    pub fn iou(&self) -> Option<f64> {
        super::apply::mean_known(&self.report.iou)
    }
}

/// A hyperparameter changed here.
#[derive(Debug, Clone, PartialEq)]
pub struct Flag {
    /// The last iteration with the old settings.
    pub iteration: usize,
    /// What changed, in words.
    pub text: String,
    /// The settings from there on.
    pub config: FitConfig,
}

/// A line of iterations.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Its number; 0 is the first.
    pub id: u32,
    /// The branch and iteration that it began at.
    pub parent: Option<(u32, usize)>,
    /// Settings at its beginning.
    pub config: FitConfig,
    /// Iterations, ascending and without holes.
    pub rows: Vec<IterationRow>,
    /// Changes of settings.
    pub flags: Vec<Flag>,
    /// What was moved or erased by hand where it begins, in words; empty while it is still in hand.
    pub edit: Option<String>,
    /// Cells that its fit does not see.
    pub erased: Arc<[ErasedCells]>,
    /// Iterations at which a breakpoint stopped a run, and which one.
    pub stops: Vec<(usize, String)>,
    /// The pose that its EM region is laid around, where that is not the start that was found first.
    pub around: Option<Arc<Pppr>>,
}

impl Branch {
    /// The first iteration.
    pub fn start(&self) -> usize {
        self.rows.first().map_or(0, |row| row.report.iteration)
    }

    /// The last iteration.
    pub fn head(&self) -> usize {
        self.rows.last().map_or(0, |row| row.report.iteration)
    }

    /// The row of an iteration.
    pub fn row(&self, iteration: usize) -> Option<&IterationRow> {
        self.rows.get(iteration.checked_sub(self.start())?)
    }

    /// The last iteration at or before `iteration` whose state is kept.
    pub fn state_at(&self, iteration: usize) -> Option<(usize, &Arc<FitState>)> {
        let last = iteration.checked_sub(self.start())?.min(self.rows.len().checked_sub(1)?);
        self.rows.get(..=last)?.iter().rev().find_map(|r| r.state.as_ref().map(|s| (r.report.iteration, s)))
    }

    /// The first iteration at or after `iteration` whose state is kept.
    pub fn kept_from(&self, iteration: usize) -> Option<usize> {
        let first = iteration.saturating_sub(self.start());
        self.rows.get(first..)?.iter().find(|row| row.state.is_some()).map(|row| row.report.iteration)
    }

    /// The settings in force at an iteration.
    pub fn config_at(&self, iteration: usize) -> FitConfig {
        self.flags.iter().rev().find(|flag| flag.iteration < iteration).map_or(self.config, |flag| flag.config)
    }

    /// The newest settings.
    pub fn newest_config(&self) -> FitConfig {
        self.flags.last().map_or(self.config, |flag| flag.config)
    }
}

/// All branches of one fit.
#[derive(Debug, Clone, Default)]
pub struct History {
    branches: Vec<Branch>,
    active: u32,
    next_id: u32,
    state_bytes: usize,
    revision: u64,
}

impl History {
    /// A history with an empty first branch.
    pub fn new(config: FitConfig) -> Self {
        let mut history = Self::default();
        history.begin(None, config);
        history
    }

    /// A history with one branch, as a file kept it: the settings at its beginning, every row, few states, where the
    /// settings changed, and what its fit does not see.
    pub(super) fn restored(
        config: &FitConfig,
        rows: Vec<super::pins::PinRow>,
        states: Vec<FitState>,
        changes: Vec<(usize, FitConfig)>,
        (erased, stops): (Vec<ErasedCells>, Vec<(usize, String)>),
    ) -> Self {
        let mut history = Self::new(*config);
        let erased: Arc<[ErasedCells]> = erased.into();
        for first in &mut history.branches {
            first.erased = Arc::clone(&erased);
            first.stops.clone_from(&stops);
        }
        let mut states: Vec<Arc<FitState>> = states.into_iter().map(Arc::new).collect();
        for super::pins::PinRow { report, majpe_mm } in rows {
            let at = states.iter().position(|state| state.iteration == report.iteration);
            let state = at.map(|at| states.swap_remove(at));
            history.push(0, IterationRow { report, state, majpe_mm });
        }
        for (iteration, config) in changes {
            history.flag(0, iteration, config);
        }
        history
    }

    /// Starts a branch, makes it the active one and answers its number. Its fit does not see what its parent's does not.
    pub fn begin(&mut self, parent: Option<(u32, usize)>, config: FitConfig) -> u32 {
        let id = self.next_id;
        self.next_id += 1;
        let of_parent = parent.and_then(|(parent, _)| self.branch(parent));
        let of_parent = of_parent.map(|parent| (Arc::clone(&parent.erased), parent.around.clone()));
        let (erased, around) = of_parent.unwrap_or_default();
        self.branches.push(Branch {
            id,
            parent,
            config,
            rows: Vec::new(),
            flags: Vec::new(),
            edit: None,
            erased,
            stops: Vec::new(),
            around,
        });
        self.activate(id);
        id
    }

    /// A branch's fit does not see these cells, besides those that its parent's does not see.
    pub(super) fn erase(&mut self, id: u32, cells: ErasedCells) {
        let parent = self.branch(id).and_then(|branch| branch.parent);
        let before = parent.and_then(|(parent, _)| self.branch(parent)).map(|parent| Arc::clone(&parent.erased));
        let all = before.iter().flat_map(|before| before.iter().cloned()).chain([cells]).collect();
        if let Some(branch) = self.branches.iter_mut().find(|branch| branch.id == id) {
            branch.erased = all;
            self.revision += 1;
        }
    }

    /// What the fit of a branch does not see, and the pose that its EM region is laid around.
    pub(super) fn set_sight(&mut self, id: u32, erased: Arc<[ErasedCells]>, around: Option<Arc<Pppr>>) {
        if let Some(branch) = self.branches.iter_mut().find(|branch| branch.id == id) {
            (branch.erased, branch.around) = (erased, around);
            self.revision += 1;
        }
    }

    /// Says what was moved or erased by hand where a branch begins.
    pub(super) fn edit(&mut self, branch: u32, words: String) {
        if let Some(branch) = self.branches.iter_mut().find(|b| b.id == branch) {
            branch.edit = Some(words);
            self.revision += 1;
        }
    }

    /// The branch and iteration that a fit of `branch` from its start begins at: where the body was moved or cells were erased
    /// by hand last on the way to it, else the start of the first branch.
    pub(super) fn start_of(&self, branch: u32) -> (u32, usize) {
        let mut next = self.branch(branch);
        while let Some(here) = next {
            if here.edit.is_some() {
                return (here.id, here.start());
            }
            next = here.parent.and_then(|(parent, _)| self.branch(parent));
        }
        (0, 0)
    }

    /// Forgets the rows of a branch: it is written anew with other settings.
    pub fn restart(&mut self, branch: u32, config: FitConfig) {
        let Some(branch) = self.branches.iter_mut().find(|b| b.id == branch) else { return };
        branch.rows.clear();
        branch.flags.clear();
        branch.stops.clear();
        branch.config = config;
        self.revision += 1;
        self.recount();
    }

    /// Removes a branch on which none began.
    pub(super) fn remove(&mut self, id: u32) {
        self.branches.retain(|branch| branch.id != id);
        self.revision += 1;
        self.recount();
    }

    /// All branches in the order they began.
    pub fn branches(&self) -> &[Branch] {
        &self.branches
    }

    /// A branch by number.
    pub fn branch(&self, id: u32) -> Option<&Branch> {
        self.branches.iter().find(|branch| branch.id == id)
    }

    /// What was moved or erased by hand and what is set otherwise than at the iteration that a branch began at, in words.
    pub fn departure(&self, branch: &Branch) -> String {
        let before = branch.parent.and_then(|(id, at)| Some(self.branch(id)?.config_at(at)));
        let set = before.map_or_else(String::new, |before| difference(&before, &branch.config));
        let parts = branch.edit.iter().cloned().chain([set]).filter(|part| !part.is_empty());
        parts.collect::<Vec<_>>().join(", ")
    }

    /// The branch that a run continues.
    pub fn active(&self) -> Option<&Branch> {
        self.branch(self.active)
    }

    /// Another number whenever anything but new rows at the end of a branch has changed.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The rows that led to the head of the active branch, those of its parents before its own: a slice a branch.
    pub fn lineage(&self) -> Vec<&[IterationRow]> {
        self.ancestry().into_iter().map(|(_, rows)| rows).collect()
    }

    /// The settings in force at the first row of [`Self::lineage`], and where they changed along it: the last iteration
    /// with the old ones, and the new ones.
    pub(super) fn lineage_settings(&self) -> Option<(FitConfig, Vec<(usize, FitConfig)>)> {
        let ancestry = self.ancestry();
        let mut lineage = ancestry.iter().flat_map(|(branch, rows)| rows.iter().map(|row| (*branch, row))).peekable();
        let (branch, first) = lineage.peek()?;
        let begin = branch.config_at(first.report.iteration);
        let (mut now, mut before, mut changes) = (begin, first.report.iteration, Vec::new());
        for (branch, row) in lineage {
            let config = branch.config_at(row.report.iteration);
            if config != now {
                changes.push((before, config));
                now = config;
            }
            before = row.report.iteration;
        }
        let newest = self.active()?.newest_config();
        if newest != now {
            changes.push((before, newest));
        }
        Some((begin, changes))
    }

    /// A breakpoint stopped a run of a branch.
    pub(super) fn stopped(&mut self, branch: u32, iteration: usize, breakpoint: String) {
        if let Some(branch) = self.branches.iter_mut().find(|b| b.id == branch) {
            branch.stops.push((iteration, breakpoint));
            self.revision += 1;
        }
    }

    /// Where breakpoints stopped runs on the way to the head of the active branch.
    pub(super) fn lineage_stops(&self) -> Vec<(usize, String)> {
        let of = |(branch, rows): (&Branch, &[IterationRow])| {
            let end = rows.last().map_or(0, |row| row.report.iteration);
            branch.stops.iter().filter(|(at, _)| *at <= end).cloned().collect::<Vec<_>>()
        };
        self.ancestry().into_iter().flat_map(of).collect()
    }

    /// Where something was set, moved or erased, or a breakpoint stopped, on the way to the head of the active branch: the last
    /// iteration before, and what in words.
    pub fn flags(&self) -> Vec<(usize, String)> {
        let mut flags = Vec::new();
        for (branch, rows) in self.ancestry() {
            let departure = branch.parent.map(|_| (branch.start(), self.departure(branch)));
            let end = rows.last().map_or(0, |row| row.report.iteration);
            let set = branch.flags.iter().filter(|flag| flag.iteration <= end);
            flags.extend(departure.into_iter().chain(set.map(|flag| (flag.iteration, flag.text.clone()))));
        }
        flags.extend(self.lineage_stops().into_iter().map(|(at, text)| (at, format!("stopped: {text}"))));
        flags.retain(|(_, text)| !text.is_empty());
        flags.sort_by_key(|(at, _)| *at);
        flags
    }

    /// The branches that led to the head of the active one, each with its rows of the lineage.
    fn ancestry(&self) -> Vec<(&Branch, &[IterationRow])> {
        let Some(branch) = self.active() else { return Vec::new() };
        let mut ancestry = vec![(branch, branch.rows.as_slice())];
        let (mut from, mut parent) = (branch.start(), branch.parent);
        while let Some((id, at)) = parent {
            let Some(before) = self.branch(id) else { break };
            let last = at.min(from);
            let count = last.saturating_sub(before.start()).min(before.rows.len());
            ancestry.push((before, &before.rows[..count]));
            (from, parent) = (before.start().min(last), before.parent);
        }
        ancestry.reverse();
        // A branch that begins where its parent does takes nothing of it.
        ancestry.retain(|(_, rows)| !rows.is_empty());
        ancestry
    }

    /// Number of the active branch.
    pub fn active_id(&self) -> u32 {
        self.active
    }

    /// Makes another branch the active one.
    pub fn activate(&mut self, id: u32) {
        if self.branch(id).is_some() {
            self.active = id;
            self.revision += 1;
        }
    }

    /// Removes a branch that has a parent, and those that began on it; the parent becomes active.
    pub fn discard(&mut self, id: u32) -> Option<(u32, usize)> {
        let parent = self.branch(id)?.parent?;
        let mut gone = vec![id];
        loop {
            let more: Vec<u32> = self
                .branches
                .iter()
                .filter(|b| b.parent.is_some_and(|(p, _)| gone.contains(&p)) && !gone.contains(&b.id))
                .map(|b| b.id)
                .collect();
            if more.is_empty() {
                break;
            }
            gone.extend(more);
        }
        self.branches.retain(|branch| !gone.contains(&branch.id));
        self.activate(parent.0);
        self.recount();
        Some(parent)
    }

    /// Keeps only iteration 0 of the first branch.
    pub fn keep_start(&mut self) {
        self.branches.truncate(1);
        if let Some(first) = self.branches.first_mut() {
            first.rows.truncate(1);
            first.config = first.flags.last().map_or(first.config, |flag| flag.config);
            first.flags.clear();
            first.stops.clear();
            self.active = first.id;
        }
        self.revision += 1;
        self.recount();
    }

    /// Appends a row. A second row of the same iteration replaces the first one only where a branch begins (an edit by
    /// hand, or settings changed before the first step); otherwise history is never rewritten.
    pub fn push(&mut self, branch: u32, row: IterationRow) {
        let bytes = row.state.as_ref().map_or(0, state_bytes);
        let Some(branch) = self.branches.iter_mut().find(|b| b.id == branch) else { return };
        match branch.rows.last() {
            Some(last) if last.report.iteration == row.report.iteration => {
                if branch.rows.len() == 1 {
                    branch.rows[0] = row;
                    self.revision += 1;
                }
            }
            Some(last) if last.report.iteration + 1 != row.report.iteration => {}
            _ => {
                branch.rows.push(row);
                self.state_bytes += bytes;
                if self.state_bytes > STATE_BUDGET {
                    self.thin();
                }
            }
        }
    }

    /// Records changed settings.
    pub fn flag(&mut self, branch: u32, iteration: usize, config: FitConfig) {
        let Some(branch) = self.branches.iter_mut().find(|b| b.id == branch) else { return };
        if branch.rows.len() <= 1 {
            branch.config = config;
            branch.flags.clear();
            return;
        }
        // A slider sends many values between two steps: one flag is what took effect.
        if branch.flags.last().is_some_and(|flag| flag.iteration == iteration) {
            branch.flags.pop();
        }
        let old = branch.newest_config();
        if config != old {
            branch.flags.push(Flag { iteration, text: difference(&old, &config), config });
        }
    }

    /// Forgets states until no more than `budget` bytes of them are left (or only each branch's first and last).
    pub fn shrink(&mut self, budget: usize) {
        while self.state_bytes > budget {
            let before = self.state_bytes;
            self.thin();
            if self.state_bytes == before {
                return;
            }
        }
    }

    /// Forgets every second state except each branch's first and last.
    fn thin(&mut self) {
        for branch in &mut self.branches {
            let last = branch.rows.len().saturating_sub(1);
            let mut kept = 0;
            for (i, row) in branch.rows.iter_mut().enumerate() {
                if row.state.is_some() {
                    kept += 1;
                    if kept % 2 == 0 && i != last {
                        row.state = None;
                    }
                }
            }
        }
        self.recount();
    }

    fn recount(&mut self) {
        self.state_bytes =
            self.branches.iter().flat_map(|b| &b.rows).filter_map(|r| r.state.as_ref()).map(state_bytes).sum();
    }
}

/// Bytes that a state holds: parameters and two moments of each.
fn state_bytes(state: &Arc<FitState>) -> usize {
    3 * size_of::<f64>() * state.params.shape().total()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::config::samples::changed;
    use crate::mhp::Terms;
    use proptest::prelude::*;

    fn run(history: &mut History, branch: u32, iterations: std::ops::RangeInclusive<usize>) {
        for iteration in iterations {
            let report = StepReport {
                iteration,
                loss: 1.0,
                terms: Terms::default(),
                iou: [].into_iter().collect(),
                converged: false,
            };
            history.push(branch, IterationRow { report, state: None, majpe_mm: None });
        }
    }

    proptest! {
        /// Whatever is set otherwise on the way is flagged with its words, in force from there on, and still so after another
        /// branch was looked at.
        #[test]
        fn no_change_of_settings_is_lost((old, new, fields) in changed()) {
            let mut history = History::new(old);
            run(&mut history, 0, 0..=4);
            history.flag(0, 4, new);
            run(&mut history, 0, 5..=6);
            let other = history.begin(Some((0, 2)), new);
            run(&mut history, other, 2..=3);
            history.activate(0);
            let (branch, other) = (history.active().unwrap(), history.branch(other).unwrap());
            prop_assert_eq!([4, 5].map(|iteration| branch.config_at(iteration)), [old, new]);
            prop_assert_eq!(branch.newest_config(), new);
            prop_assert_eq!(history.lineage_settings(), Some((old, fields.first().map(|_| (4, new)).into_iter().collect())));
            let told: Vec<&str> = branch.flags.iter().map(|flag| flag.text.as_str()).collect();
            let expected = difference(&old, &new);
            prop_assert_eq!(told, fields.first().map(|_| expected.as_str()).into_iter().collect::<Vec<_>>());
            prop_assert_eq!(history.departure(other), expected);
            prop_assert!(fields.iter().all(|field| history.departure(other).to_lowercase().contains(&field.name.to_lowercase())));
        }
    }
}
