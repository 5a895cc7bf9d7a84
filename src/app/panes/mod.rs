//! The panes: each draws a part of the session and sends what is asked of it.

mod agreement;
mod compare;
mod curves;
mod fit;
mod frames;
mod image;
mod joint;
mod log;
mod maps;
mod modes;
mod scene;
mod statistics;
mod study;
pub(super) mod timeline;

use super::PaneKind;
use super::commands::{Act, AppAct, command};
use super::theme::{self, Tokens};
use crate::diagnose::FindingPlace;
use crate::labels::CellRegion;
use crate::session::{Command, Session, ViewState};

/// What every pane gets.
pub(super) struct Shared<'a> {
    /// The state, to be read.
    pub(super) session: &'a Session,
    /// What is asked for; carried out after the pass.
    pub(super) acts: &'a mut Vec<Act>,
}

impl Shared<'_> {
    /// Sends a command to the session.
    pub(super) fn send(&mut self, command: Command) {
        self.acts.push(Act::Session(command));
    }

    /// Asks the window for something.
    pub(super) fn app(&mut self, act: AppAct) {
        self.acts.push(Act::App(act));
    }

    /// Shows where a finding is seen.
    pub(super) fn show_place(&mut self, place: FindingPlace) {
        match place {
            FindingPlace::Joint(joint) => self.send(Command::SelectJoint(Some(joint))),
            FindingPlace::Frame(frame) => self.send(Command::GotoFrame(frame)),
            FindingPlace::Cells { view, lo, hi } => self.acts.push(Act::ShowCells { view, lo, hi }),
        }
    }

    /// Shows the cells that a label marks.
    pub(super) fn show_region(&mut self, region: &CellRegion) {
        let views = self.session.data.dataset.iter().flat_map(|dataset| &dataset.info().views);
        if let Some(view) = views.into_iter().position(|view| view.array == region.view) {
            self.acts.push(Act::ShowCells { view, lo: region.lo.clone(), hi: region.hi.clone() });
        }
    }

    /// Does the user command called `label`, if it is enabled.
    pub(super) fn invoke(&mut self, label: &str) {
        if let Some(command) = command(label).filter(|c| (c.enabled)(self.session)) {
            self.acts.push((command.act)(self.session));
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

/// What a session file keeps of the panes.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Stored {
    /// The camera of the 3-D view, where it was moved.
    pub(super) camera: Option<scene::StoredCamera>,
    /// The part of each view's maps that is seen: left, top, right, bottom, 0..1.
    pub(super) maps: Vec<[f32; 4]>,
}

/// What the panes remember between passes: textures, zoom, camera. None of it is a user's work.
pub(super) struct PaneStates {
    pub(super) maps: maps::State,
    pub(super) scene: scene::State,
    pub(super) curves: curves::State,
    pub(super) agreement: agreement::State,
    pub(super) statistics: statistics::State,
    pub(super) study: study::State,
    pub(super) compare: compare::State,
    pub(super) frames: frames::State,
    pub(super) modes: modes::State,
    pub(super) joint: joint::State,
    pub(super) image: image::State,
    pub(super) timeline: timeline::State,
}

impl PaneStates {
    pub(super) fn new(render_state: Option<eframe::egui_wgpu::RenderState>) -> Self {
        Self {
            maps: maps::State::default(),
            scene: scene::State::new(render_state),
            curves: curves::State::default(),
            agreement: agreement::State::default(),
            statistics: statistics::State::default(),
            study: study::State::default(),
            compare: compare::State::default(),
            frames: frames::State::default(),
            modes: modes::State::default(),
            joint: joint::State::default(),
            image: image::State::default(),
            timeline: timeline::State::default(),
        }
    }

    pub(super) fn reset_views(&mut self) {
        self.maps.reset();
        self.scene.reset();
        self.curves.reset();
    }

    pub(super) fn focus(&mut self, session: &Session) {
        self.maps.focus(session);
        self.scene.focus(session);
    }
}

/// Draws a pane.
pub(super) fn show(pane: PaneKind, ui: &mut egui::Ui, shared: &mut Shared<'_>, states: &mut PaneStates) {
    match pane {
        PaneKind::Frames => frames::show(ui, shared, &mut states.frames),
        PaneKind::HOri => maps::show(ui, shared, &mut states.maps, maps::MapColumn::Ori),
        PaneKind::HSim => maps::show(ui, shared, &mut states.maps, maps::MapColumn::Sim),
        PaneKind::Masks => maps::show(ui, shared, &mut states.maps, maps::MapColumn::Masks),
        PaneKind::Scene => scene::show(ui, shared, &mut states.scene),
        PaneKind::Curves => curves::show(ui, shared, &mut states.curves),
        PaneKind::Fit => fit::show(ui, shared),
        PaneKind::Joint => joint::show(ui, shared, &mut states.joint),
        PaneKind::Image => image::show(ui, shared, &mut states.image),
        PaneKind::Log => log::show(ui, shared),
        PaneKind::Compare => compare::show(ui, shared, &mut states.compare),
        PaneKind::Agreement => agreement::show(ui, shared, &mut states.agreement),
        PaneKind::Statistics => statistics::show(ui, shared, &mut states.statistics),
        PaneKind::Modes => modes::show(ui, shared, &mut states.modes),
        PaneKind::Study => study::show(ui, shared, &mut states.study),
    }
}

/// An empty pane says what would fill it and how.
pub(super) fn empty(ui: &mut egui::Ui, title: &str, how: &str) {
    let tokens = Tokens::of(ui);
    let area = ui.available_rect_before_wrap().shrink(16.0);
    let mut text = egui::text::LayoutJob::default();
    let format = |font, color| egui::TextFormat { font_id: font, color, ..Default::default() };
    text.append(title, 0.0, format(theme::strong(theme::BODY), tokens.text));
    if !how.is_empty() {
        text.append(&format!("\n{how}"), 0.0, format(egui::FontId::proportional(theme::CAPTION), tokens.dim));
    }
    text.halign = egui::Align::Center;
    text.wrap.max_width = area.width().clamp(60.0, 420.0);
    let galley = ui.painter().layout_job(text);
    let top = (area.center().y - galley.size().y / 2.0).max(area.top());
    let rect =
        egui::Rect::from_min_size(egui::pos2(area.left(), top), egui::vec2(area.width().max(1.0), galley.size().y));
    let response = ui.allocate_rect(rect, egui::Sense::hover());
    let spoken = format!("{title}. {how}");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &spoken));
    ui.painter().with_clip_rect(ui.clip_rect()).galley(egui::pos2(area.center().x, top), galley, tokens.text);
}
