//! What gives way where a window is small: panes beside the maps become icons with their names on a strip at the window's
//! edge, and icons alone where the names have no room.
//!
//! The order: what lies left of the maps (frames, failure modes), then what lies right of them (fit, 3-D), each where the maps would
//! have less than [`MIDDLE`]; then what lies below them (curves), and of two panes in a column the lower one, where the window
//! is lower than [`LOW`]. Nothing is lost: a click on the icon shows the pane until it is clicked again or another one
//! is, and all come back by themselves when there is room. It holds for every arrangement whose outermost split is into columns.

use super::{Leaf, panes_in};
use crate::app::panes::Pane;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Named as _, draw_icon};
use egui::{Role, Sense, Ui, pos2, vec2};
use egui_tiles::{Container, LinearDir, Tile, TileId, Tiles, Tree};

/// Width that the maps keep, points.
const MIDDLE: f32 = 460.0;
/// Height below which one pane has a column alone, points.
const LOW: f32 = 420.0;
/// Width of a strip, points.
pub(super) const STRIP: f32 = 22.0;
/// Size of an icon, and what an entry has around what it shows, points.
const ICON: f32 = 14.0;
const PAD: f32 = 8.0;
/// Between an icon and its name.
const GAP: f32 = 4.0;
/// Between what gave way together and the next, points.
const APART: f32 = 8.0;

/// Where a pane is that can give way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Below,
}

/// A tile that can give way as a whole.
#[derive(Debug, Clone, Copy)]
struct Slot {
    side: Side,
    tile: TileId,
    /// Whether it is the first of its column.
    first: bool,
}

/// Which panes gave way, and which of them was asked for.
#[derive(Debug, Default)]
pub(super) struct Collapse {
    opened: Option<TileId>,
    hidden: Vec<Slot>,
}

/// The children of a linear container of that direction.
fn children(tiles: &Tiles<Leaf>, tile: TileId, wanted: LinearDir) -> Option<Vec<TileId>> {
    match tiles.get(tile) {
        Some(Tile::Container(Container::Linear(linear))) if linear.dir == wanted => Some(linear.children.clone()),
        _ => None,
    }
}

fn has_maps(tiles: &Tiles<Leaf>, tile: TileId) -> bool {
    Pane::called("Maps").is_some_and(|maps| panes_in(tiles, tile).contains(&maps))
}

/// What can give way; nothing where the outermost split is not into columns, or none of them has the maps.
fn slots(tree: &Tree<Leaf>) -> Vec<Slot> {
    let tiles = &tree.tiles;
    let columns = tree.root().and_then(|root| children(tiles, root, LinearDir::Horizontal)).unwrap_or_default();
    let Some(middle) = columns.iter().position(|&column| has_maps(tiles, column)) else { return Vec::new() };
    let mut slots = Vec::new();
    for (place, &column) in columns.iter().enumerate() {
        let parts = children(tiles, column, LinearDir::Vertical).unwrap_or_else(|| vec![column]);
        let side = match place.cmp(&middle) {
            std::cmp::Ordering::Less => Side::Left,
            std::cmp::Ordering::Greater => Side::Right,
            std::cmp::Ordering::Equal => Side::Below,
        };
        let parts = parts.into_iter().enumerate().filter(|&(_, tile)| !has_maps(tiles, tile));
        slots.extend(parts.map(|(k, tile)| Slot { side, tile, first: k == 0 }));
    }
    slots
}

impl Collapse {
    /// Decides for a window of that size, whose columns beside the maps take `left` and `right`, points. Answers the widths of
    /// the two sides that are shown.
    pub(super) fn decide(&mut self, tree: &mut Tree<Leaf>, size: egui::Vec2, left: f32, right: f32) -> [f32; 2] {
        let slots = slots(tree);
        if self.opened.is_some_and(|opened| slots.iter().all(|slot| slot.tile != opened)) {
            self.opened = None;
        }
        let has = |side: Side| slots.iter().any(|slot| slot.side == side);
        let wide = |has: bool, width: f32| if has { width } else { 0.0 };
        let (left, right) = (wide(has(Side::Left), left), wide(has(Side::Right), right));
        let no_left = left > 0.0 && size.x - left - right < MIDDLE;
        let no_right = right > 0.0 && no_left && size.x - STRIP - right < MIDDLE;
        let low = size.y < LOW;
        let opened = slots.iter().find(|slot| Some(slot.tile) == self.opened).copied();
        let opened_in = |side: Side| opened.is_some_and(|opened| opened.side == side);
        let shown = |slot: &Slot| {
            let narrow = match slot.side {
                Side::Left => no_left,
                Side::Right => no_right,
                Side::Below => low,
            };
            if narrow && !opened_in(slot.side) {
                return false;
            }
            // Of a column that is low: the one that was asked for, else the first.
            let alone = low && slot.side != Side::Below;
            !alone || if opened_in(slot.side) { Some(slot.tile) == self.opened } else { slot.first }
        };
        let hidden: Vec<Slot> = slots.iter().filter(|slot| !shown(slot)).copied().collect();
        for slot in &slots {
            let hide = hidden.iter().any(|other| other.tile == slot.tile);
            tree.tiles.set_visible(slot.tile, !hide);
        }
        // What is shown because it was asked for keeps its entry on the strip, to be clicked away.
        let asked = opened.filter(|slot| match slot.side {
            Side::Left => no_left || low,
            Side::Right => no_right || low,
            Side::Below => low,
        });
        self.hidden = slots
            .iter()
            .filter(|slot| hidden.iter().chain(&asked).any(|other| other.tile == slot.tile))
            .copied()
            .collect();
        if asked.is_none() {
            self.opened = None;
        }
        let of = |side: Side, width: f32| {
            let any = slots.iter().any(|slot| slot.side == side && hidden.iter().all(|other| other.tile != slot.tile));
            if any { width } else { 0.0 }
        };
        [of(Side::Left, left), of(Side::Right, right)]
    }

    /// Shows a pane that gave way.
    pub(super) fn open(&mut self, tree: &Tree<Leaf>, pane: Leaf) {
        let slot = self.hidden.iter().find(|slot| panes_in(&tree.tiles, slot.tile).contains(&pane));
        if let Some(slot) = slot {
            self.opened = Some(slot.tile);
        }
    }

    /// Draws the strips, each an entry for every pane that gave way there. Answers the pane whose entry was clicked.
    pub(super) fn strips(&mut self, ui: &mut Ui, tree: &Tree<Leaf>) -> Option<Leaf> {
        let tokens = Tokens::of(ui);
        let frame = egui::Frame::new().fill(tokens.panel);
        let mut clicked = None;
        for side in [Side::Below, Side::Left, Side::Right] {
            let slots = self.hidden.iter().filter(|slot| slot.side == side);
            let slots: Vec<(Slot, Vec<Leaf>)> = slots.map(|slot| (*slot, panes_in(&tree.tiles, slot.tile))).collect();
            if slots.is_empty() {
                continue;
            }
            let panel = match side {
                Side::Left => egui::Panel::left("left strip"),
                Side::Right => egui::Panel::right("right strip"),
                Side::Below => egui::Panel::bottom("lower strip"),
            };
            panel.exact_size(STRIP).resizable(false).frame(frame).show(ui, |ui| {
                let upright = side != Side::Below;
                let layout = if upright {
                    egui::Layout::top_down(egui::Align::Center)
                } else {
                    egui::Layout::left_to_right(egui::Align::Center)
                };
                let room = if upright { ui.available_height() } else { ui.available_width() };
                let named = wanted(ui, &slots) <= room;
                ui.with_layout(layout, |ui| {
                    ui.spacing_mut().item_spacing = egui::Vec2::ZERO;
                    for (slot, panes) in slots {
                        let on = self.opened == Some(slot.tile);
                        for pane in panes {
                            if entry(ui, pane, on, Look { upright, named }, &tokens) {
                                clicked = Some((slot.tile, on, pane));
                            }
                        }
                        ui.add_space(APART);
                    }
                });
            });
        }
        let (tile, on, pane) = clicked?;
        let in_front = tree.tiles.rect(tree.tiles.find_pane(&pane)?).is_some();
        // The entry of what is in front takes it away again; that of another tab brings it to the front.
        self.opened = (!(on && in_front)).then_some(tile);
        Some(pane)
    }
}

/// How the entries of a strip look.
#[derive(Debug, Clone, Copy)]
struct Look {
    /// Along the left or right edge: names are read from below.
    upright: bool,
    /// Whether there is room for the names.
    named: bool,
}

/// The title of a pane as a strip has it.
fn lettered(ui: &Ui, pane: Leaf, color: egui::Color32) -> std::sync::Arc<egui::Galley> {
    ui.painter().layout_no_wrap(pane.title().to_owned(), theme::strong(11.0), color)
}

/// The length of a strip with all of these panes' icons and names, points.
fn wanted(ui: &Ui, slots: &[(Slot, Vec<Leaf>)]) -> f32 {
    let long = |pane: &Leaf| ICON + PAD + GAP + lettered(ui, pane, egui::Color32::GRAY).size().x;
    slots.iter().map(|(_, panes)| panes.iter().map(long).sum::<f32>() + APART).sum()
}

/// A pane's icon on a strip, and its name along it; answers whether it was clicked.
fn entry(ui: &mut Ui, pane: Leaf, on: bool, look: Look, tokens: &Tokens) -> bool {
    let color = if on { tokens.text } else { tokens.dim };
    let galley = lettered(ui, pane, color);
    let along = ICON + PAD + if look.named { GAP + galley.size().x } else { 0.0 };
    let size = if look.upright { vec2(ui.available_width(), along) } else { vec2(along, ui.available_height()) };
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    if on || response.hovered() {
        ui.painter().rect_filled(rect.shrink(1.0), 3.0, tokens.raised);
    }
    let square = if look.upright { vec2(size.x, ICON + PAD) } else { vec2(ICON + PAD, size.y) };
    draw_icon(ui.painter(), egui::Rect::from_min_size(rect.min, square), ICON, pane.icon(), color);
    let high = galley.size().y;
    if look.named && look.upright {
        // Read from below: a quarter turn to the left.
        let at = pos2(rect.center().x - 0.5 * high, rect.bottom() - 0.5 * PAD);
        let shape = egui::epaint::TextShape::new(at, galley, color).with_angle(-std::f32::consts::FRAC_PI_2);
        ui.painter().add(shape);
    } else if look.named {
        ui.painter().galley(pos2(rect.left() + 0.5 * PAD + ICON + GAP, rect.center().y - 0.5 * high), galley, color);
    }
    let verb = if on { "Hide" } else { "Show" };
    let tip = format!("{verb} {}: {}.\nThe window has no room for it beside the maps.", pane.title(), pane.help());
    response.named(Role::Button, &format!("{} on the strip", pane.title())).on_hover_text(tip).clicked()
}
