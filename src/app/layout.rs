//! Where the panes are: a tree of tiles that can be dragged, resized, stored and reset.

use super::commands::{AppAct, SaveKind};
use super::panes::{self, PaneStates, Shared};
use super::theme::{self, Tokens};
use egui_tiles::{
    Container, Linear, LinearDir, SimplificationOptions, TabState, Tile, TileId, Tiles, Tree, UiResponse,
};
use serde::{Deserialize, Serialize};

/// A pane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PaneKind {
    /// The frame list.
    Frames,
    /// The measured maps.
    HOri,
    /// The simulated maps.
    HSim,
    /// The masks of the two.
    Masks,
    /// Gaussians and skeleton in 3-D.
    Scene,
    /// Loss curves.
    Curves,
    /// Settings of the fit.
    Fit,
    /// The selected joint.
    Joint,
    /// Labels in image pixels.
    Image,
    /// The log.
    Log,
    /// Tags, notes and evidence.
    Modes,
    /// Pinned fits.
    Compare,
    /// How far annotators agree.
    Agreement,
    /// Counts of labels.
    Statistics,
    /// A study's table and plot.
    Study,
}

impl PaneKind {
    /// Every pane.
    pub const ALL: [Self; 15] = [
        Self::Frames,
        Self::HOri,
        Self::HSim,
        Self::Masks,
        Self::Scene,
        Self::Curves,
        Self::Fit,
        Self::Joint,
        Self::Image,
        Self::Log,
        Self::Modes,
        Self::Compare,
        Self::Agreement,
        Self::Statistics,
        Self::Study,
    ];

    /// The title on its tab.
    pub fn title(self) -> &'static str {
        match self {
            Self::Frames => "Frames",
            Self::HOri => "H_ori",
            Self::HSim => "H_sim",
            Self::Masks => "Masks",
            Self::Scene => "3-D",
            Self::Curves => "Curves",
            Self::Fit => "Fit",
            Self::Joint => "Joint",
            Self::Image => "Image plane",
            Self::Log => "Log",
            Self::Modes => "Failure modes",
            Self::Compare => "Compare",
            Self::Agreement => "Agreement",
            Self::Statistics => "Statistics",
            Self::Study => "Study",
        }
    }
}

/// The tree of tiles.
pub(crate) struct Layout {
    tree: Tree<PaneKind>,
    /// A pane whose tab was right-clicked, and what was chosen.
    asked: Option<AppAct>,
}

impl Default for Layout {
    fn default() -> Self {
        let mut tiles = Tiles::default();
        let maps: Vec<TileId> =
            [PaneKind::HOri, PaneKind::HSim, PaneKind::Masks].map(|pane| tiles.insert_pane(pane)).to_vec();
        let maps = tiles.insert_horizontal_tile(maps);
        let scene = tiles.insert_pane(PaneKind::Scene);
        let image = tiles.insert_pane(PaneKind::Image);
        let scene = tabs(&mut tiles, vec![scene, image]);
        let curves = tiles.insert_pane(PaneKind::Curves);
        let log = tiles.insert_pane(PaneKind::Log);
        let [study, compare, agreement, statistics] =
            [PaneKind::Study, PaneKind::Compare, PaneKind::Agreement, PaneKind::Statistics]
                .map(|pane| tiles.insert_pane(pane));
        let curves = tabs(&mut tiles, vec![curves, study, compare, agreement, statistics, log]);
        let below = linear(&mut tiles, LinearDir::Horizontal, &[(scene, 1.0), (curves, 1.0)]);
        let middle = linear(&mut tiles, LinearDir::Vertical, &[(maps, 1.12), (below, 1.0)]);
        let frames = tiles.insert_pane(PaneKind::Frames);
        let fit = tiles.insert_pane(PaneKind::Fit);
        let joint = tiles.insert_pane(PaneKind::Joint);
        let modes = tiles.insert_pane(PaneKind::Modes);
        let fit = tabs(&mut tiles, vec![fit, joint]);
        let right = linear(&mut tiles, LinearDir::Vertical, &[(fit, 1.0), (modes, 1.25)]);
        let root = linear(&mut tiles, LinearDir::Horizontal, &[(frames, 0.235), (middle, 0.6), (right, 0.25)]);
        Self { tree: Tree::new(egui::Id::unique("panes"), root, tiles), asked: None }
    }
}

fn linear(tiles: &mut Tiles<PaneKind>, dir: LinearDir, children: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear::new(dir, children.iter().map(|child| child.0).collect());
    for &(child, share) in children {
        linear.shares.set_share(child, share);
    }
    tiles.insert_container(Container::Linear(linear))
}

fn tabs(tiles: &mut Tiles<PaneKind>, children: Vec<TileId>) -> TileId {
    tiles.insert_tab_tile(children)
}

impl Layout {
    /// A stored tree; one without a single pane is replaced by the default.
    pub(crate) fn restored(tree: Tree<PaneKind>) -> Self {
        if tree.root().is_some() && tree.tiles.iter().any(|(_, tile)| matches!(tile, Tile::Pane(_))) {
            let mut restored = Self { tree, asked: None };
            restored.complete();
            restored
        } else {
            Self::default()
        }
    }

    /// Adds what an older tree does not know yet to the tabs of the curves, or to the first tabs that there are.
    fn complete(&mut self) {
        let tiles = &self.tree.tiles;
        let has = |wanted: PaneKind| tiles.iter().any(|(_, tile)| matches!(tile, Tile::Pane(pane) if *pane == wanted));
        let missing: Vec<PaneKind> = PaneKind::ALL.into_iter().filter(|&pane| !has(pane)).collect();
        let of_curves = tiles.iter().find_map(|(id, tile)| {
            matches!(tile, Tile::Pane(PaneKind::Curves)).then(|| tiles.parent_of(*id)).flatten()
        });
        let is_tabs = |id: &TileId| matches!(tiles.get(*id), Some(Tile::Container(Container::Tabs(_))));
        let mut all: Vec<TileId> = tiles.iter().map(|(id, _)| *id).filter(|id| is_tabs(id)).collect();
        all.sort_unstable_by_key(|id| id.0);
        let Some(home) = of_curves.filter(|id| is_tabs(id)).or_else(|| all.first().copied()) else { return };
        for pane in missing {
            let id = self.tree.tiles.insert_pane(pane);
            if let Some(Tile::Container(Container::Tabs(tabs))) = self.tree.tiles.get_mut(home) {
                tabs.add_child(id);
            }
        }
    }

    /// The tree, to be stored.
    pub(crate) fn stored(&self) -> &Tree<PaneKind> {
        &self.tree
    }

    /// Where a pane was drawn in the last pass, points; `None` where it is behind another tab.
    pub(crate) fn rect(&self, pane: PaneKind) -> Option<egui::Rect> {
        let (id, _) = self.tree.tiles.iter().find(|(_, tile)| matches!(tile, Tile::Pane(kind) if *kind == pane))?;
        self.tree.tiles.rect(*id)
    }

    /// Brings a pane to the front; one that was closed is not brought back.
    pub(crate) fn show_pane(&mut self, pane: PaneKind) {
        self.tree.make_active(|_, tile| matches!(tile, Tile::Pane(kind) if *kind == pane));
    }

    /// What was asked for on a tab.
    pub(crate) fn take_asked(&mut self) -> Option<AppAct> {
        self.asked.take()
    }

    /// Draws every pane in what is left of the window.
    pub(crate) fn show(&mut self, ui: &mut egui::Ui, shared: &mut Shared<'_>, states: &mut PaneStates) {
        let tokens = Tokens::of(ui);
        egui::CentralPanel::default().frame(egui::Frame::new().fill(tokens.stroke)).show(ui, |ui| {
            let mut behavior = Behavior { shared, states, asked: &mut self.asked };
            self.tree.ui(&mut behavior, ui);
        });
    }
}

struct Behavior<'a, 'b> {
    shared: &'a mut Shared<'b>,
    states: &'a mut PaneStates,
    asked: &'a mut Option<AppAct>,
}

impl egui_tiles::Behavior<PaneKind> for Behavior<'_, '_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut PaneKind) -> UiResponse {
        let tokens = Tokens::of(ui);
        let data =
            matches!(pane, PaneKind::HOri | PaneKind::HSim | PaneKind::Masks | PaneKind::Scene | PaneKind::Image);
        let margin = if data { 0 } else { 8 };
        egui::Frame::new().fill(tokens.panel).inner_margin(margin).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            panes::show(*pane, ui, self.shared, self.states);
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &PaneKind) -> egui::WidgetText {
        egui::RichText::new(pane.title()).font(theme::strong(12.0)).into()
    }

    fn on_tab_button(&mut self, tiles: &mut Tiles<PaneKind>, tile: TileId, response: egui::Response) -> egui::Response {
        if let Some(Tile::Pane(pane)) = tiles.get(tile) {
            response.context_menu(|ui| {
                let tip = "As it is on screen, without the rest of the window.";
                if ui.button("Save picture of this pane…").on_hover_text(tip).clicked() {
                    *self.asked = Some(AppAct::Save(SaveKind::Picture(Some(*pane))));
                    ui.close();
                }
                if ui.button("Copy picture of this pane").on_hover_text(tip).clicked() {
                    *self.asked = Some(AppAct::CopyPicture(Some(*pane)));
                    ui.close();
                }
            });
        }
        response
    }

    fn tab_bar_height(&self, _style: &egui::Style) -> f32 {
        24.0
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        1.0
    }

    fn tab_bar_color(&self, visuals: &egui::Visuals) -> egui::Color32 {
        if visuals.dark_mode { theme::DARK.panel } else { theme::LIGHT.panel }
    }

    fn tab_bg_color(&self, visuals: &egui::Visuals, _: &Tiles<PaneKind>, _: TileId, _: &TabState) -> egui::Color32 {
        self.tab_bar_color(visuals)
    }

    fn tab_text_color(
        &self,
        visuals: &egui::Visuals,
        _: &Tiles<PaneKind>,
        _: TileId,
        state: &TabState,
    ) -> egui::Color32 {
        let tokens = if visuals.dark_mode { theme::DARK } else { theme::LIGHT };
        if state.active { tokens.text } else { tokens.dim }
    }

    fn tab_outline_stroke(&self, _: &egui::Visuals, _: &Tiles<PaneKind>, _: TileId, _: &TabState) -> egui::Stroke {
        egui::Stroke::NONE
    }

    fn tab_bar_hline_stroke(&self, visuals: &egui::Visuals) -> egui::Stroke {
        egui::Stroke::new(1.0, if visuals.dark_mode { theme::DARK.stroke } else { theme::LIGHT.stroke })
    }

    fn resize_stroke(&self, style: &egui::Style, state: egui_tiles::ResizeState) -> egui::Stroke {
        let tokens = if style.visuals.dark_mode { theme::DARK } else { theme::LIGHT };
        match state {
            egui_tiles::ResizeState::Idle => egui::Stroke::new(1.0, tokens.stroke),
            egui_tiles::ResizeState::Hovering => egui::Stroke::new(2.0, tokens.dim),
            egui_tiles::ResizeState::Dragging => egui::Stroke::new(2.0, tokens.accent),
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..Default::default() }
    }
}
