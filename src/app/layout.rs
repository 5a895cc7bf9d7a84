//! Where the panes are: a tree of tiles that can be dragged, resized, stored and reset.

mod collapse;
mod tabs;

use super::commands::{AppAct, SaveKind};
use super::panes::{Dock, Pane, PaneStates, Shared};
use super::theme::{self, Tokens};
use collapse::Collapse;
use egui_tiles::{
    Container, Linear, LinearDir, SimplificationOptions, TabState, Tabs, Tile, TileId, Tiles, Tree, UiResponse,
};

/// A pane in the tree.
type Leaf = &'static Pane;

/// The tree of tiles.
pub(crate) struct PaneLayout {
    tree: Tree<Leaf>,
    /// The default layout, as long as nobody moved one of its borders: it goes with the size of the window.
    fitted: Option<Fitted>,
    /// What gave way in a small window.
    collapse: Collapse,
    /// A pane whose tab was right-clicked, and what was chosen.
    asked: Option<AppAct>,
    /// A pane that is drawn without the others, and where.
    alone: Option<(Leaf, egui::Rect)>,
}

impl Default for PaneLayout {
    fn default() -> Self {
        let mut tiles = Tiles::default();
        let mut column = |docks: [(Dock, f32); 2]| {
            let panes = docks.map(|(dock, share)| (docked(&mut tiles, dock), share));
            linear(&mut tiles, LinearDir::Vertical, &panes)
        };
        let left = column([(Dock::LeftTop, 1.2), (Dock::LeftBottom, 1.0)]);
        let middle = column([(Dock::Centre, 4.0), (Dock::Bottom, 1.0)]);
        let right = column([(Dock::RightTop, 1.4), (Dock::RightBottom, 1.0)]);
        let root = linear(&mut tiles, LinearDir::Horizontal, &[(left, 1.0), (middle, 4.0), (right, 1.25)]);
        let fitted = Fitted { columns: root, middle, shares: [Vec::new(), Vec::new()] };
        let tree = Tree::new(egui::Id::unique("panes"), root, tiles);
        Self { tree, fitted: Some(fitted), collapse: Collapse::default(), asked: None, alone: None }
    }
}

/// Borders of the default layout.
struct Fitted {
    /// Left, middle and right.
    columns: TileId,
    /// Maps, and what is below them.
    middle: TileId,
    /// As they were set last; empty before.
    shares: [Vec<f32>; 2],
}

/// Widths of the columns at the edges: a share of the window's within these, points.
const LEFT: (f32, [f32; 2]) = (0.168, [214.0, 330.0]);
const RIGHT: (f32, [f32; 2]) = (0.2, [258.0, 430.0]);
/// Height of what is below the maps.
const BELOW: (f32, [f32; 2]) = (0.165, [112.0, 300.0]);

/// The same while a pane is in front there that needs more of it, or still more.
const BELOW_HIGH: (f32, [f32; 2]) = (0.27, [150.0, 420.0]);
const BELOW_TALL: (f32, [f32; 2]) = (0.42, [200.0, 620.0]);

/// The height of what is below the maps while one of these panes is in front there.
fn below(in_front: &[Leaf]) -> (f32, [f32; 2]) {
    let has = |dock: Dock| in_front.iter().any(|pane| pane.dock() == dock);
    match (has(Dock::BottomTall), has(Dock::BottomHigh)) {
        (true, _) => BELOW_TALL,
        (_, true) => BELOW_HIGH,
        _ => BELOW,
    }
}

/// A share of the window's size, within bounds, points.
fn within((share, [least, most]): (f32, [f32; 2]), of: f32) -> f32 {
    (share * of).clamp(least, most)
}

impl Fitted {
    /// The borders of a stored default layout; nothing where it is another one.
    fn of(tree: &Tree<Leaf>) -> Option<Self> {
        let linear = |tile: TileId| match tree.tiles.get(tile) {
            Some(Tile::Container(Container::Linear(linear))) => Some(linear.children.clone()),
            _ => None,
        };
        let columns = tree.root()?;
        let [_, middle, _] = linear(columns)?[..] else { return None };
        (linear(middle)?.len() == 2).then(|| Self { columns, middle, shares: [Vec::new(), Vec::new()] })
    }

    /// Sets the borders for a window whose sides have these widths, points, 0 where one gave way; false where somebody moved one.
    fn set(&mut self, tiles: &mut Tiles<Leaf>, size: egui::Vec2, sides: [f32; 2], below: (f32, [f32; 2])) -> bool {
        let [left, right] = sides.map(|width| width / size.x.max(1.0));
        let below = within(below, size.y) / size.y.max(1.0);
        // What gave way keeps a share that counts for nothing.
        let kept = |share: f32| if share > 0.0 { share } else { 0.2 };
        let middle = (1.0 - left - right).max(0.1);
        let wanted = [vec![kept(left), middle, kept(right)], vec![(1.0 - below).max(0.1), below]];
        for ((id, shares), set) in [self.columns, self.middle].into_iter().zip(wanted).zip(&mut self.shares) {
            let Some(Tile::Container(Container::Linear(linear))) = tiles.get_mut(id) else { return false };
            let now: Vec<f32> = linear.children.iter().map(|child| linear.shares[*child]).collect();
            let moved =
                !set.is_empty() && (now.len() != set.len() || now.iter().zip(&*set).any(|(a, b)| (a - b).abs() > 1e-4));
            if moved || linear.children.len() != shares.len() {
                return false;
            }
            for (&child, &share) in linear.children.iter().zip(&shares) {
                linear.shares.set_share(child, share);
            }
            *set = shares;
        }
        true
    }
}

fn linear(tiles: &mut Tiles<Leaf>, dir: LinearDir, children: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear::new(dir, children.iter().map(|child| child.0).collect());
    for &(child, share) in children {
        linear.shares.set_share(child, share);
    }
    tiles.insert_container(Container::Linear(linear))
}

/// The panes of a place: tabs, and one alone as it is.
fn docked(tiles: &mut Tiles<Leaf>, dock: Dock) -> TileId {
    let panes = Pane::all().iter().filter(|pane| pane.dock().is_beside(dock));
    let panes: Vec<TileId> = panes.map(|pane| tiles.insert_pane(*pane)).collect();
    match panes[..] {
        [one] => one,
        _ => tiles.insert_tab_tile(panes),
    }
}

impl PaneLayout {
    /// A stored tree, and whether its borders went with the size of the window; one without a single pane is replaced by the
    /// default.
    pub(crate) fn restored(tree: Tree<Leaf>, fitted: bool) -> Self {
        if tree.root().is_some() && tree.tiles.iter().any(|(_, tile)| matches!(tile, Tile::Pane(_))) {
            let fitted = if fitted { Fitted::of(&tree) } else { None };
            let mut restored = Self { tree, fitted, collapse: Collapse::default(), asked: None, alone: None };
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
            let neighbours = Pane::all().iter().filter(|other| other.dock().is_beside(pane.dock()));
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

    /// Whether the borders go with the size of the window, to be stored.
    pub(crate) fn is_fitted(&self) -> bool {
        self.fitted.is_some()
    }

    /// The tree, to be stored.
    pub(crate) fn stored(&self) -> &Tree<Leaf> {
        &self.tree
    }

    /// Where a pane was drawn in the last pass, points; `None` where it is behind another tab.
    pub(crate) fn rect(&self, pane: Leaf) -> Option<egui::Rect> {
        match self.alone {
            Some((alone, rect)) => (alone == pane).then_some(rect),
            None => self.tree.tiles.rect(self.tree.tiles.find_pane(&pane)?),
        }
    }

    /// Brings a pane to the front; one that was closed is not brought back.
    pub(crate) fn show_pane(&mut self, pane: Leaf) {
        self.collapse.open(&self.tree, pane);
        self.tree.make_active(|_, tile| matches!(tile, Tile::Pane(other) if *other == pane));
    }

    /// Draws a pane without the others from now on, over all of the window that they had.
    pub(crate) fn show_alone(&mut self, pane: Leaf) {
        self.alone = Some((pane, egui::Rect::NOTHING));
    }

    /// What was asked for on a tab.
    pub(crate) fn take_asked(&mut self) -> Option<AppAct> {
        self.asked.take()
    }

    /// Draws every pane in what is left of the window.
    pub(crate) fn show(&mut self, ui: &mut egui::Ui, shared: &mut Shared<'_>, states: &mut PaneStates) {
        let tokens = Tokens::of(ui);
        egui::CentralPanel::default().frame(egui::Frame::new().fill(tokens.stroke)).show(ui, |ui| {
            if let Some((pane, rect)) = &mut self.alone {
                *rect = ui.max_rect();
                pane.show(ui, tokens.panel, shared, states);
                return;
            }
            let whole = ui.available_size();
            let (left, right) = (within(LEFT, whole.x), within(RIGHT, whole.x));
            let sides = self.collapse.decide(&mut self.tree, whole, left, right);
            if let Some(pane) = self.collapse.strips(ui, &self.tree) {
                self.tree.make_active(|_, tile| matches!(tile, Tile::Pane(other) if *other == pane));
                ui.ctx().request_repaint();
            }
            let size = ui.available_size();
            let in_front = self.tree.active_tiles().into_iter().filter_map(|id| self.tree.tiles.get_pane(&id));
            let below = below(&in_front.copied().collect::<Vec<_>>());
            let set = |mut fitted: Fitted| fitted.set(&mut self.tree.tiles, size, sides, below).then_some(fitted);
            self.fitted = self.fitted.take().and_then(set);
            let mut behavior = Behavior { shared, states, asked: &mut self.asked, icons: Vec::new() };
            self.tree.ui(&mut behavior, ui);
        });
    }
}

/// What a tab is called: its pane; where panes were dropped beside each other into one tab, the first, and the second or how
/// many more.
fn title(tiles: &Tiles<Leaf>, tile: TileId) -> String {
    match panes_in(tiles, tile)[..] {
        [] => String::new(),
        [one] => one.title().to_owned(),
        [first, second] => format!("{} + {}", first.title(), second.title()),
        [first, ref others @ ..] => format!("{} + {} more", first.title(), others.len()),
    }
}

/// The panes of a tile, in their order.
fn panes_in(tiles: &Tiles<Leaf>, tile: TileId) -> Vec<Leaf> {
    match tiles.get(tile) {
        Some(Tile::Pane(pane)) => vec![*pane],
        Some(Tile::Container(container)) => container.children().flat_map(|child| panes_in(tiles, *child)).collect(),
        None => Vec::new(),
    }
}

struct Behavior<'a, 'b> {
    shared: &'a mut Shared<'b>,
    states: &'a mut PaneStates,
    asked: &'a mut Option<AppAct>,
    /// Tabs that have no room for their names.
    icons: Vec<TileId>,
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

    fn tab_title_for_tile(&mut self, tiles: &Tiles<Leaf>, tile: TileId) -> egui::WidgetText {
        egui::RichText::new(title(tiles, tile)).font(theme::strong(12.0)).into()
    }

    /// Called before the tabs of a row are drawn.
    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<Leaf>,
        ui: &mut egui::Ui,
        _tile: TileId,
        row: &Tabs,
        _scroll_offset: &mut f32,
    ) {
        self.icons.extend(tabs::without_name(ui, tiles, row, ui.available_width()));
    }

    fn tab_ui(
        &mut self,
        tiles: &mut Tiles<Leaf>,
        ui: &mut egui::Ui,
        id: egui::Id,
        tile: TileId,
        state: &TabState,
    ) -> egui::Response {
        let named = !self.icons.contains(&tile);
        let response = tabs::show(ui, tiles, id, (tile, named), state);
        self.on_tab_button(tiles, tile, response)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tab_is_called_by_what_is_in_it_however_it_was_dropped_there() {
        let mut tiles = Tiles::default();
        let [a, b, c] = [0, 1, 2].map(|k| Pane::all()[k]);
        let [one, two, three] = [a, b, c].map(|pane| tiles.insert_pane(pane));
        let alone = tiles.insert_tab_tile(vec![one]);
        let pair = tiles.insert_vertical_tile(vec![alone, two]);
        let mixed = tiles.insert_tab_tile(vec![pair, three]);
        let all = tiles.insert_horizontal_tile(vec![mixed]);
        assert_eq!((title(&tiles, one), title(&tiles, alone)), (a.title().to_owned(), a.title().to_owned()));
        assert_eq!(title(&tiles, pair), format!("{} + {}", a.title(), b.title()));
        assert_eq!(title(&tiles, all), format!("{} + 2 more", a.title()));
    }
}
