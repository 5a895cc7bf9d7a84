//! The panes: each draws a part of the session and sends what is asked of it.
//!
//! **A pane is one file** (or folder) in this room with one `static PANE: Pane`: its key in stored layouts, title, icon, help,
//! place in the default layout, the keys that bring it to the front, what it says where it has nothing to draw, its toolbar,
//! and the function that draws it. What it remembers between passes is a type of that file that implements `PaneState`.
//!
//! To add one, write the file, name it in the `mod` lines below, and add its line to [`PANES`]. The menu, the palette, the
//! help sheet, the default layout, stored layouts and the option `--pane` of `screenshot` read the list. What a pane lets
//! a person do beyond being shown are rows that its file makes and the tables of commands name where the menus have them.

mod agreement;
mod ambiguity;
mod answered;
mod breakpoints;
mod calibration;
mod cell;
mod chain;
mod closure;
mod compare;
mod curves;
#[cfg(test)]
mod dummy;
mod explore;
mod extras;
mod fit;
pub(super) mod frames;
mod image;
mod joint;
mod known;
mod landscape;
mod lit;
mod log;
pub(super) mod maps;
pub(super) mod modes;
mod pane;
pub(super) mod predictions;
mod restarts;
mod ribbon;
pub(super) mod scene;
mod signal;
mod statistics;
pub(super) mod study;
mod tuning;
mod what_if;

pub use pane::Pane;
pub(super) use pane::{Blank, Dock, PaneState, PaneStates};

use super::commands::{AppAct, UiAction, command};
use crate::diagnose::FindingPlace;
use crate::labels::CellRegion;
use crate::session::{Command, Session, ViewState};

/// Every pane, in the order of the menu; panes of one place are tabs in this order.
static PANES: &[&Pane] = &[
    &maps::PANE,
    &maps::ortho::PANE,
    &chain::PANE,
    &calibration::PANE,
    &signal::PANE,
    &what_if::PANE,
    &study::PANE,
    &statistics::PANE,
    &agreement::PANE,
    &curves::PANE,
    &cell::PANE,
    &known::PANE,
    &closure::PANE,
    &compare::PANE,
    &predictions::PANE,
    &tuning::PANE,
    &landscape::PANE,
    &ambiguity::PANE,
    &restarts::PANE,
    &breakpoints::PANE,
    &log::PANE,
    &fit::PANE,
    &joint::PANE,
    &scene::PANE,
    &image::PANE,
    &frames::PANE,
    &modes::PANE,
    #[cfg(test)]
    &dummy::PANE,
];

/// What every pane gets.
pub(super) struct Shared<'a> {
    /// The state, to be read.
    pub(super) session: &'a Session,
    /// What is asked for; carried out after the pass.
    pub(super) acts: &'a mut Vec<UiAction>,
    /// What pictures of the scene are drawn with; `None` without a graphics adapter.
    pub(super) gpu: Option<&'a eframe::egui_wgpu::RenderState>,
    /// The pane that is drawn, its toolbar included.
    pub(super) pane: egui::Rect,
    /// What the pointer was on in the pass before, in whichever pane.
    pub(super) pointed: Pointed,
    /// What it is on in this one.
    pub(super) points: &'a mut Pointed,
}

/// What the pointer is on: every pane shows it in its own way.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Pointed {
    /// View and (column, row) pixel of a map.
    cell: Option<(usize, [usize; 2])>,
    /// A joint, flat index.
    joint: Option<usize>,
    /// A basin of the restart cloud.
    basin: Option<usize>,
    /// A place of an exploration to which the body would be moved.
    moved: Option<MovedBody>,
}

/// A place of an exploration, in the units of its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum MovedBody {
    /// Of the ambiguity map: y and x on the floor.
    Floor([f64; 2]),
    /// Of the same: turned by, higher by.
    Turned([f64; 2]),
    /// Of the loss landscape.
    Slice([f64; 2]),
}

impl Shared<'_> {
    /// Sends a command to the session.
    pub(super) fn send(&mut self, command: Command) {
        self.acts.push(UiAction::Session(command));
    }

    /// Asks the window for something.
    pub(super) fn app(&mut self, act: AppAct) {
        self.acts.push(UiAction::App(act));
    }

    /// Shows where a finding is seen.
    pub(super) fn show_place(&mut self, place: FindingPlace) {
        match place {
            FindingPlace::Joint(joint) => self.send(Command::SelectJoint(Some(joint))),
            FindingPlace::Frame(frame) => self.send(Command::GotoFrame(frame)),
            FindingPlace::Cells { view, lo, hi } => self.acts.push(maps::show_cells(view, lo, hi)),
        }
    }

    /// Shows the cells that a label marks.
    pub(super) fn show_region(&mut self, region: &CellRegion) {
        let views = self.session.data.dataset.iter().flat_map(|dataset| &dataset.info().views);
        if let Some(view) = views.into_iter().position(|view| view.array == region.view) {
            self.acts.push(maps::show_cells(view, region.lo.clone(), region.hi.clone()));
        }
    }

    /// Does the user command called `label`, if it is enabled.
    pub(super) fn invoke(&mut self, label: &str) {
        if let Some(command) = command(label).filter(|command| command.enabled(self.session)) {
            self.acts.push(command.action(self.session));
        }
    }

    /// Changes how things are shown.
    pub(super) fn set_view(&mut self, change: impl FnOnce(&mut ViewState)) {
        let mut view = self.session.view.clone();
        change(&mut view);
        if view != self.session.view {
            self.send(Command::SetView(Box::new(view)));
        }
    }
}
