//! Where the panes are: a tree of tiles that can be dragged, resized, stored and reset.

use super::commands::{AppAct, SaveKind};
use super::panes::{Dock, Pane, PaneStates, Shared};
use super::theme::{self, Tokens};
use egui_tiles::{
    Container, Linear, LinearDir, SimplificationOptions, TabState, Tile, TileId, Tiles, Tree, UiResponse,
};

/// A pane in the tree.
type Leaf = &'static Pane;

/// The tree of tiles.
pub(crate) struct PaneLayout {
    tree: Tree<Leaf>,
    /// A pane whose tab was right-clicked, and what was chosen.
    asked: Option<AppAct>,
}

impl Default for PaneLayout {
    fn default() -> Self {
        let mut tiles = Tiles::default();
        let top = docked(&mut tiles, Dock::Top);
        let bottom = [Dock::BottomLeft, Dock::BottomRight].map(|dock| (docked(&mut tiles, dock), 1.0));
        let bottom = linear(&mut tiles, LinearDir::Horizontal, &bottom);
        let middle = linear(&mut tiles, LinearDir::Vertical, &[(top, 1.12), (bottom, 1.0)]);
        let left = docked(&mut tiles, Dock::Left);
        let right = [(Dock::RightTop, 1.0), (Dock::RightBottom, 1.25)];
        let right = right.map(|(dock, share)| (docked(&mut tiles, dock), share));
        let right = linear(&mut tiles, LinearDir::Vertical, &right);
        let root = linear(&mut tiles, LinearDir::Horizontal, &[(left, 0.235), (middle, 0.6), (right, 0.25)]);
        Self { tree: Tree::new(egui::Id::unique("panes"), root, tiles), asked: None }
    }
}

fn linear(tiles: &mut Tiles<Leaf>, dir: LinearDir, children: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear::new(dir, children.iter().map(|child| child.0).collect());
    for &(child, share) in children {
        linear.shares.set_share(child, share);
    }
    tiles.insert_container(Container::Linear(linear))
}

/// The panes of a place: side by side at the top, else tabs, and one alone as it is.
fn docked(tiles: &mut Tiles<Leaf>, dock: Dock) -> TileId {
    let panes = Pane::all().iter().filter(|pane| pane.dock() == dock);
    let panes: Vec<TileId> = panes.map(|pane| tiles.insert_pane(*pane)).collect();
    match panes[..] {
        [one] => one,
        _ if dock == Dock::Top => tiles.insert_horizontal_tile(panes),
        _ => tiles.insert_tab_tile(panes),
    }
}

impl PaneLayout {
    /// A stored tree; one without a single pane is replaced by the default.
    pub(crate) fn restored(tree: Tree<Leaf>) -> Self {
        if tree.root().is_some() && tree.tiles.iter().any(|(_, tile)| matches!(tile, Tile::Pane(_))) {
            let mut restored = Self { tree, asked: None };
            restored.complete();
            restored
        } else {
            Self::default()
        }
    }

    /// Adds what an older tree does not know yet: to the tabs with a pane of the same place, or to the first tabs there are.
    fn complete(&mut self) {
        for &pane in Pane::all() {
            let tiles = &mut self.tree.tiles;
            if tiles.find_pane(&pane).is_some() {
                continue;
            }
            let is_tabs = |id: &TileId| matches!(tiles.get(*id), Some(Tile::Container(Container::Tabs(_))));
            let neighbours = Pane::all().iter().filter(|other| other.dock() == pane.dock());
            let mut homes = neighbours.filter_map(|other| tiles.parent_of(tiles.find_pane(other)?)).filter(is_tabs);
            let Some(home) = homes.next().or_else(|| tiles.tile_ids().filter(is_tabs).min_by_key(|id| id.0)) else {
                return;
            };
            let id = tiles.insert_pane(pane);
            if let Some(Tile::Container(Container::Tabs(tabs))) = tiles.get_mut(home) {
                tabs.add_child(id);
            }
        }
    }

    /// The tree, to be stored.
    pub(crate) fn stored(&self) -> &Tree<Leaf> {
        &self.tree
    }

    /// Where a pane was drawn in the last pass, points; `None` where it is behind another tab.
    pub(crate) fn rect(&self, pane: Leaf) -> Option<egui::Rect> {
        self.tree.tiles.rect(self.tree.tiles.find_pane(&pane)?)
    }

    /// Brings a pane to the front; one that was closed is not brought back.
    pub(crate) fn show_pane(&mut self, pane: Leaf) {
        self.tree.make_active(|_, tile| matches!(tile, Tile::Pane(other) if *other == pane));
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

impl egui_tiles::Behavior<Leaf> for Behavior<'_, '_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut Leaf) -> UiResponse {
        let tokens = Tokens::of(ui);
        pane.show(ui, tokens.panel, self.shared, self.states);
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Leaf) -> egui::WidgetText {
        egui::RichText::new(pane.title()).font(theme::strong(12.0)).into()
    }

    fn on_tab_button(&mut self, tiles: &mut Tiles<Leaf>, tile: TileId, response: egui::Response) -> egui::Response {
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

    fn tab_bg_color(&self, visuals: &egui::Visuals, _: &Tiles<Leaf>, _: TileId, _: &TabState) -> egui::Color32 {
        self.tab_bar_color(visuals)
    }

    fn tab_text_color(&self, visuals: &egui::Visuals, _: &Tiles<Leaf>, _: TileId, state: &TabState) -> egui::Color32 {
        let tokens = if visuals.dark_mode { theme::DARK } else { theme::LIGHT };
        if state.active { tokens.text } else { tokens.dim }
    }

    fn tab_outline_stroke(&self, _: &egui::Visuals, _: &Tiles<Leaf>, _: TileId, _: &TabState) -> egui::Stroke {
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
