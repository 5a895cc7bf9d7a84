//! The command palette: type to find a command, arrows to choose one, Enter to do it.

use super::{Overlay, modal};
use crate::app::commands::{self, UserCommand, shortcut_text};
use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use egui::{Key, Modifiers, Rect, RichText, Sense, Ui, WidgetInfo, pos2, vec2};

/// Width of the sheet, points.
const WIDTH: f32 = 520.0;
/// Height of a row.
const ROW: f32 = 24.0;
/// Rows that are shown at once where the window has room for them.
const MOST_ROWS: f32 = 16.0;
/// Height of what is around the rows, with some of the window on both sides.
const AROUND: f32 = 150.0;

/// Steps of the highlight by the keys that were pressed; they are taken out of the input.
fn steps(ui: &Ui, page: usize) -> isize {
    let page = page as isize;
    let keys = [(Key::ArrowDown, 1), (Key::ArrowUp, -1), (Key::PageDown, page), (Key::PageUp, -page)];
    ui.input_mut(|i| keys.iter().map(|&(key, by)| i.count_and_consume_key(Modifiers::NONE, key) as isize * by).sum())
}

impl Overlay {
    pub(super) fn palette(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let room = ui.ctx().content_rect();
        let rows = ((room.height() - AROUND) / ROW).floor().clamp(4.0, MOST_ROWS);
        let by = steps(ui, rows as usize - 1);
        let enter = ui.input(|i| i.key_pressed(Key::Enter));
        let mut found = commands::found(&self.query);
        self.chosen = self.chosen.saturating_add_signed(by).min(found.len().saturating_sub(1));
        let mut done = false;
        let response = modal(ui, "palette").show(ui.ctx(), |ui| {
            ui.set_width(WIDTH.min(room.width() - 60.0));
            let field = ui.add(
                egui::TextEdit::singleline(&mut self.query).hint_text("Type a command").desired_width(f32::INFINITY),
            );
            field.widget_info(|| WidgetInfo::labeled(egui::Role::TextInput, true, "Command palette"));
            if self.fresh {
                field.request_focus();
                self.fresh = false;
            }
            if field.changed() {
                found = commands::found(&self.query);
                self.chosen = 0;
            }
            ui.add_space(4.0);
            ui.spacing_mut().item_spacing.y = 0.0;
            // As high whatever is found: nothing moves under the eye while somebody types.
            let area = egui::ScrollArea::vertical().max_height(rows * ROW).min_scrolled_height(rows * ROW);
            area.auto_shrink(false).show(ui, |ui| {
                for (i, &command) in found.iter().enumerate() {
                    let chosen = i == self.chosen;
                    let response = row(ui, shared, command, chosen);
                    if chosen && (by != 0 || field.changed()) {
                        response.scroll_to_me(None);
                    }
                    if response.clicked() || (enter && chosen && command.enabled(shared.session)) {
                        shared.acts.push(command.action(shared.session));
                        done = true;
                    }
                }
                if found.is_empty() {
                    ui.label(RichText::new("No command has these words.").color(Tokens::of(ui).dim));
                }
            });
        });
        done || response.should_close()
    }
}

/// What a command is called, its menu, and its key.
fn row(ui: &mut Ui, shared: &Shared<'_>, command: UserCommand, chosen: bool) -> egui::Response {
    let tokens = Tokens::of(ui);
    let enabled = command.enabled(shared.session);
    let sense = if enabled { Sense::click() } else { Sense::hover() };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), sense);
    let text = command.text(shared.session).into_owned();
    response.widget_info(|| WidgetInfo::selected(egui::Role::Button, enabled, chosen, &text));
    if !ui.is_rect_visible(rect) {
        return response;
    }
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    if chosen {
        painter.rect_filled(rect, 3.0, ui.visuals().selection.bg_fill);
    } else if response.hovered() {
        painter.rect_filled(rect, 3.0, tokens.stroke);
    }
    let y = rect.center().y;
    let color = if enabled { tokens.text } else { tokens.dim };
    let put = |text: String, font, color, x: f32, right: bool| -> Rect {
        let galley = painter.layout_no_wrap(text, font, color);
        let left = if right { x - galley.size().x } else { x };
        let rect = Rect::from_min_size(pos2(left, y - galley.size().y / 2.0), galley.size());
        painter.galley(rect.min, galley, color);
        rect
    };
    let body = egui::FontId::proportional(theme::BODY);
    let said = put(text, body, color, rect.left() + 8.0, false);
    let small = || egui::FontId::proportional(theme::CAPTION);
    put(command.menu().title().to_owned(), small(), tokens.dim, said.right() + 8.0, false);
    let keys: Vec<String> = command.keys().iter().take(2).map(|&keys| shortcut_text(keys)).collect();
    put(keys.join("  "), theme::mono(theme::CAPTION), tokens.dim, rect.right() - 10.0, true);
    response.on_hover_text(command.tooltip())
}
