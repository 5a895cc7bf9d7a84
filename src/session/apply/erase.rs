//! Cells under the eraser: a box, single cells, a whole echo. The fit is done anew without them, where that is live, else when the
//! finger is lifted; and what that changed is told.

use crate::geometry::{norm, sub};
use crate::labels::CellRegion;
use crate::mhp::{ErasedCells, connected_echo, leaves_any};
use crate::radar::View;
use crate::session::effect::Effect;
use crate::session::history::{Branch, IterationRow};
use crate::session::settings::Drag;
use crate::session::state::Session;

/// What a fit without some cells has to do with the one that sees them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErasedEffect {
    /// How far the joints moved, mm: the mean and the longest way.
    pub moved_mm: [f64; 2],
    /// L_EM with and without.
    pub em: [f64; 2],
    /// Mean IoU with and without.
    pub iou: [Option<f64>; 2],
    /// Mean joint error with and without, mm, where there is truth.
    pub majpe_mm: [Option<f64>; 2],
    /// Cells that are left out.
    pub cells: usize,
}

impl Session {
    fn views(&self) -> &[View] {
        self.data.dataset.as_ref().map(|dataset| &dataset.info().views[..]).unwrap_or_default()
    }

    /// A box under the eraser.
    pub(super) fn drag_erase(&mut self, region: &CellRegion) -> Vec<Effect> {
        let views = self.views();
        let Some(view) = views.iter().position(|view| view.array == region.view) else { return Vec::new() };
        let bins: Vec<[usize; 2]> = region.lo.iter().zip(&region.hi).map(|(&lo, &hi)| [lo, hi + 1]).collect();
        if bins.len() != views[view].axes.len() {
            return Vec::new();
        }
        self.erase(ErasedCells { view, bins, cells: Vec::new() }, format!("erased {region}"))
    }

    /// Single cells under the eraser.
    pub(super) fn drag_erase_cells(&mut self, view: usize, cells: Vec<usize>) -> Vec<Effect> {
        let Some(of) = self.views().get(view) else { return Vec::new() };
        let Some(cells) = ErasedCells::of_cells((view, of), cells) else { return Vec::new() };
        let name = format!("erased {} cells of {}", cells.count(), of.array);
        self.erase(cells, name)
    }

    /// The whole echo that a cell belongs to, at once.
    pub(super) fn erase_echo(&mut self, view: usize, cell: usize) -> Vec<Effect> {
        let (Some(problem), Some(of)) = (self.fit.problem.clone(), self.views().get(view).cloned()) else {
            return Vec::new();
        };
        let inside = self.fit.shown.as_ref().and_then(|shown| Some(shown.masks.get(view)?.inside.clone()));
        let echo = connected_echo((&of, problem.map(view)), inside.as_deref(), self.config.tau_pct, cell);
        let Some(cells) = ErasedCells::of_cells((view, &of), echo) else {
            self.hint(format!(
                "no echo there: click a cell of {} that is in H_ori's mask, or as strong as one",
                of.array
            ));
            return Vec::new();
        };
        let name = format!("erased an echo of {} cells of {}", cells.count(), of.array);
        let mut effects = self.erase(cells, name);
        effects.extend(self.end_drag());
        effects
    }

    fn erase(&mut self, cells: ErasedCells, name: String) -> Vec<Effect> {
        if !self.fit.is_ready() {
            self.hint("there is no fit that could do without these cells".into());
            return Vec::new();
        }
        let all: Vec<ErasedCells> = self.fit.erased().iter().cloned().chain([cells.clone()]).collect();
        let Some(view) = self.views().get(cells.view) else { return Vec::new() };
        if !leaves_any((cells.view, view), &all) {
            let text = format!("nothing of {} would be left: erase less of it", view.array);
            if self.notice.as_ref().is_none_or(|notice| notice.text != text) {
                self.hint(text);
            }
            return Vec::new();
        }
        let (before, from) = (self.config, self.fit.history.active_id());
        let drag = self.drag.get_or_insert(Drag { before, from, live: None, erasing: None, adopted: None });
        if drag.erasing.as_ref().is_some_and(|(known, _)| *known == cells) {
            return Vec::new();
        }
        drag.erasing = Some((cells, name));
        if self.is_live() { self.refit() } else { Vec::new() }
    }

    /// What the cells that the fit of the active branch does not see change: its newest iteration beside that of the fit that
    /// sees them, at the same number or its last. `None` where nothing is erased, or while it runs.
    pub fn erased_effect(&self) -> Option<ErasedEffect> {
        let (history, without) = (&self.fit.history, self.fit.branch()?);
        if without.erased.is_empty() || self.fit.is_running() {
            return None;
        }
        let mut with = without;
        while !with.erased.is_empty() {
            with = history.branch(with.parent?.0)?;
        }
        let at = without.head().min(with.head());
        let row = |branch: &Branch, at: usize| branch.row(at).cloned();
        let [before, after] = [row(with, at)?, row(without, without.head())?];
        let positions =
            |branch: &Branch, at: usize| branch.state_at(at).map(|(_, state)| state.params.positions().to_vec());
        let [from, to] = [positions(with, at)?, positions(without, without.head())?];
        let ways: Vec<f64> = from.iter().zip(&to).map(|(a, b)| 1000.0 * norm(sub(*a, *b))).collect();
        let both = |of: fn(&IterationRow) -> Option<f64>| [of(&before), of(&after)];
        let em = [&before, &after]
            .map(|row| row.report.terms.iter().find(|(term, _)| term.key == "em").map_or(0.0, |(_, x)| x));
        Some(ErasedEffect {
            moved_mm: [ways.iter().sum::<f64>() / ways.len().max(1) as f64, ways.iter().copied().fold(0.0, f64::max)],
            em,
            iou: both(IterationRow::iou),
            majpe_mm: both(|row| row.majpe_mm),
            cells: without.erased.iter().map(ErasedCells::count).sum(),
        })
    }
}
