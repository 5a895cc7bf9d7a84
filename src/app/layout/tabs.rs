//! The tabs of a place: their names, and icons alone where a row has no room for all names.
//!
//! From the last tab on, names give way to icons, as many as it takes; the one in front keeps its name.

use super::{panes_in, title};
use crate::app::panes::Pane;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::draw_icon;
use egui::{Align2, Color32, Galley, Id, Response, Role, Sense, Ui, vec2};
use egui_tiles::{TabState, Tabs, TileId, Tiles};
use std::sync::Arc;

/// Size of an icon, and what is on both sides of it or of a name, points.
const ICON: f32 = 14.0;
const BESIDE: f32 = 8.0;

/// Draws a tab as wide as what it shows: its name, or its icon alone.
pub(super) fn show(
    ui: &mut Ui,
    tiles: &Tiles<&'static Pane>,
    id: Id,
    (tile, named): (TileId, bool),
    state: &TabState,
) -> Response {
    let tokens = Tokens::of(ui);
    let text = title(tiles, tile);
    let name = lettered(ui, &text);
    let width = if named { name.size().x } else { ICON } + 2.0 * BESIDE;
    let (_, rect) = ui.allocate_space(vec2(width, ui.available_height()));
    let response = ui.interact(rect, id, Sense::click_and_drag()).on_hover_cursor(egui::CursorIcon::Grab);
    let enabled = ui.is_enabled();
    response.widget_info(|| egui::WidgetInfo::selected(Role::Button, enabled, state.active, &text));
    let first = panes_in(tiles, tile).first().copied();
    if ui.is_rect_visible(rect) && !state.is_being_dragged {
        let color = if state.active || response.hovered() { tokens.text } else { tokens.dim };
        match first {
            Some(pane) if !named => draw_icon(ui.painter(), rect, ICON, pane.icon(), color),
            _ => {
                let at = Align2::CENTER_CENTER.align_size_within_rect(name.size(), rect).min;
                ui.painter().galley_with_override_text_color(at, name, color);
            }
        }
    }
    match first {
        Some(pane) if !named => response.on_hover_text(format!("{text}: {}.", pane.help())),
        _ => response,
    }
}

fn lettered(ui: &Ui, title: &str) -> Arc<Galley> {
    ui.painter().layout_no_wrap(title.to_owned(), theme::strong(12.0), Color32::GRAY)
}

/// The tabs of a row that have no room for their names in `room`, points.
pub(super) fn without_name(ui: &Ui, tiles: &Tiles<&'static Pane>, tabs: &Tabs, room: f32) -> Vec<TileId> {
    let shown: Vec<TileId> = tabs.children.iter().copied().filter(|child| tiles.is_visible(*child)).collect();
    let widths: Vec<f32> = shown.iter().map(|child| lettered(ui, &title(tiles, *child)).size().x).collect();
    let front = shown.iter().position(|child| Some(*child) == tabs.active);
    let named = names(&widths, front, room);
    shown.into_iter().zip(named).filter(|(_, named)| !named).map(|(tile, _)| tile).collect()
}

/// Which tabs of these names' widths keep their names in `room`, points.
fn names(widths: &[f32], front: Option<usize>, room: f32) -> Vec<bool> {
    let mut named = vec![true; widths.len()];
    let mut all = widths.iter().map(|width| width + 2.0 * BESIDE).sum::<f32>();
    for at in (0..widths.len()).rev().filter(|at| Some(*at) != front) {
        if all <= room {
            break;
        }
        named[at] = false;
        all += ICON.min(widths[at]) - widths[at];
    }
    named
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_give_way_from_the_last_but_for_the_one_in_front() {
        let widths = [40.0, 50.0, 60.0, 30.0];
        assert_eq!(names(&widths, Some(0), 244.0), [true; 4]);
        assert_eq!(names(&widths, Some(0), 243.0), [true, true, true, false]);
        assert_eq!(names(&widths, Some(3), 243.0), [true, true, false, true]);
        assert_eq!(names(&widths, Some(1), 100.0), [false, true, false, false]);
    }
}
