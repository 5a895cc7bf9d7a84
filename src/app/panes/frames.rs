//! The frame list: one line a frame, drawn only where it is seen, so that a hundred thousand scroll like ten.

use super::{Shared, empty};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::iou_color;
use crate::session::{Command, FrameSort};
use egui::{Align2, FontId, RichText, Sense, Ui, pos2, vec2};

const ROW: f32 = 20.0;

/// What the list remembers.
#[derive(Default)]
pub(in crate::app) struct State {
    filter: String,
    only_fitted: bool,
    shown: Option<usize>,
    order: Order,
}

/// The rows in their order, made again only when what they depend on changed.
#[derive(Default)]
struct Order {
    key: Option<(usize, usize, String, bool, FrameSort, u64)>,
    rows: Vec<usize>,
}

pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let Some(dataset) = &session.data.dataset else {
        return empty(ui, "No data set", "Open one with Ctrl+O, or drop a folder on the window.");
    };
    let tokens = Tokens::of(ui);
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut state.filter)
            .hint_text("Filter by name")
            .desired_width(ui.available_width() - 8.0);
        let response = ui.add(field);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Filter frames"));
        response.on_hover_text("Show frames whose name contains this.");
    });
    let mut sort = session.view.frame_sort;
    ui.horizontal_wrapped(|ui| {
        ui.selectable_value(&mut sort, FrameSort::Index, "By index").on_hover_text("In the data set's order.");
        ui.selectable_value(&mut sort, FrameSort::Iou, "By IoU")
            .on_hover_text("Lowest mean IoU first; frames without a fit last.");
        ui.checkbox(&mut state.only_fitted, "fitted").on_hover_text("Only frames that were fitted in this session.");
    });
    if sort != session.view.frame_sort {
        shared.set_view(|v| v.frame_sort = sort);
    }
    update_order(state, shared);
    let rows = &state.order.rows;
    let text = if rows.len() == dataset.len() {
        plural(dataset.len())
    } else {
        format!("{} of {}", rows.len(), dataset.len())
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new(text).small().color(tokens.dim));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(RichText::new("IoU").small().color(tokens.dim))
                .on_hover_text("Mean forward-consistency IoU of the last fit in this session.");
        });
    });
    let current = session.data.frame_index;
    let mut area = egui::ScrollArea::vertical().auto_shrink(false);
    if state.shown != Some(current) {
        state.shown = Some(current);
        if let Some(at) = rows.iter().position(|&row| row == current) {
            let height = ui.available_height();
            area = area.vertical_scroll_offset((at as f32 * ROW - height / 2.0).max(0.0));
        }
    }
    ui.spacing_mut().item_spacing.y = 0.0;
    let mut clicked = None;
    area.show_rows(ui, ROW, rows.len(), |ui, range| {
        for &index in &rows[range] {
            if row(ui, shared, dataset, index, index == current, &tokens) {
                clicked = Some(index);
            }
        }
    });
    if rows.is_empty() {
        ui.label(RichText::new("No frame matches.").color(tokens.dim));
    }
    if let Some(index) = clicked {
        shared.send(Command::GotoFrame(index));
    }
}

fn plural(frames: usize) -> String {
    format!("{frames} frame{}", if frames == 1 { "" } else { "s" })
}

fn update_order(state: &mut State, shared: &Shared<'_>) {
    let session = shared.session;
    let Some(dataset) = &session.data.dataset else { return };
    let sort = session.view.frame_sort;
    let progress: u64 = if sort == FrameSort::Iou || state.only_fitted {
        session.summaries.values().map(|s| s.iterations as u64 + 1).sum()
    } else {
        0
    };
    let identity = std::sync::Arc::as_ptr(dataset).addr();
    let key = (identity, dataset.len(), state.filter.to_lowercase(), state.only_fitted, sort, progress);
    if state.order.key.as_ref() == Some(&key) {
        return;
    }
    let wanted = &key.2;
    let mut rows: Vec<usize> = (0..dataset.len())
        .filter(|i| wanted.is_empty() || dataset.frame_name(*i).to_lowercase().contains(wanted.as_str()))
        .filter(|i| !state.only_fitted || session.summaries.contains_key(i))
        .collect();
    if sort == FrameSort::Iou {
        let iou = |i: &usize| session.summaries.get(i).and_then(|s| s.iou).unwrap_or(f64::INFINITY);
        rows.sort_by(|a, b| iou(a).total_cmp(&iou(b)).then(a.cmp(b)));
    }
    state.order = Order { key: Some(key), rows };
}

fn row(
    ui: &mut Ui,
    shared: &Shared<'_>,
    dataset: &crate::dataset::Dataset,
    index: usize,
    current: bool,
    tokens: &Tokens,
) -> bool {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let name = dataset.frame_name(index);
    let spoken = format!("Frame {name}");
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, current, &spoken));
    let painter = ui.painter();
    if current {
        painter.rect_filled(rect, 2.0, tokens.accent.gamma_multiply(0.3));
    } else if response.hovered() {
        painter.rect_filled(rect, 2.0, tokens.raised);
    }
    let y = rect.center().y;
    let number = format!("{index}");
    painter.text(pos2(rect.left() + 38.0, y), Align2::RIGHT_CENTER, number, theme::mono(theme::CAPTION), tokens.dim);
    let short = name.rsplit('/').next().unwrap_or(&name);
    let clip = egui::Rect::from_min_max(rect.min, pos2(rect.right() - 52.0, rect.max.y));
    painter.with_clip_rect(clip.intersect(ui.clip_rect())).text(
        pos2(rect.left() + 46.0, y),
        Align2::LEFT_CENTER,
        short,
        FontId::proportional(12.0),
        tokens.text,
    );
    if let Some(summary) = shared.session.summaries.get(&index) {
        let (text, color) =
            summary.iou.map_or(("—".into(), tokens.dim), |x| (format!("{x:.2}"), iou_color(tokens, x)));
        painter.text(pos2(rect.right() - 4.0, y), Align2::RIGHT_CENTER, text, theme::mono(theme::CAPTION), color);
        let mark = if summary.converged { "✓" } else { "·" };
        painter.text(
            pos2(rect.right() - 40.0, y),
            Align2::CENTER_CENTER,
            mark,
            FontId::proportional(theme::CAPTION),
            tokens.dim,
        );
    }
    let response = response.on_hover_ui(|ui| {
        ui.label(format!("{} · {name}", dataset.sequence(index)));
        if let Some(s) = shared.session.summaries.get(&index) {
            let majpe = s.majpe_mm.map_or_else(String::new, |mm| format!(" · MAJPE {mm:.1} mm"));
            let word = if s.converged { "converged" } else { "not converged" };
            ui.label(format!("{} iterations · L {:.4} · {word}{majpe}", s.iterations, s.loss));
        }
    });
    response.clicked()
}
