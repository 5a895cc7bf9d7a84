//! Chips, icon buttons and rows of a name and a number.

use crate::app::theme::{self, Tokens};
use egui::{Color32, Response, RichText, Sense, Ui, WidgetInfo};

/// A word in a rounded frame.
pub(crate) fn chip(ui: &mut Ui, text: &str, color: Color32) -> Response {
    // Allocated as one piece, so that it goes to the next line where a row has no room for it.
    let font = egui::TextStyle::Small.resolve(ui.style());
    let galley = ui.painter().layout_no_wrap(text.to_owned(), font, color);
    let (rect, response) = ui.allocate_exact_size(galley.size() + egui::vec2(8.0, 2.0), egui::Sense::hover());
    ui.painter().rect_stroke(rect, 3.0, egui::Stroke::new(1.0, color), egui::StrokeKind::Inside);
    ui.painter().galley(rect.min + egui::vec2(4.0, 1.0), galley, color);
    response.named(egui::Role::Label, text)
}

/// A text on a ground of its own, to be read over a picture; answers where it is.
pub(crate) fn grounded(
    painter: &egui::Painter,
    at: egui::Pos2,
    align: egui::Align2,
    text: impl Into<String>,
    font: egui::FontId,
    color: Color32,
) -> egui::Rect {
    let tokens = Tokens::of_visuals(&painter.ctx().global_style().visuals);
    let galley = painter.layout_no_wrap(text.into(), font, color);
    let ground = align.anchor_size(at, galley.size() + egui::vec2(6.0, 2.0));
    painter.rect_filled(ground, 2.0, tokens.canvas.gamma_multiply(0.8));
    painter.galley(ground.min + egui::vec2(3.0, 1.0), galley, color);
    ground
}

/// The first of these texts, of that size, that an empty field across `ui` has room for; else the last.
pub(crate) fn fitting<'a, S: AsRef<str>>(ui: &Ui, texts: &'a [S], size: f32) -> &'a str {
    /// What a field has around its text, points.
    const AROUND: f32 = 18.0;
    let room = ui.available_width() - AROUND;
    let wide = |text: &str| {
        let font = egui::FontId::proportional(size);
        ui.painter().layout_no_wrap(text.to_owned(), font, Color32::GRAY).size().x
    };
    let texts = || texts.iter().map(AsRef::as_ref);
    texts().find(|text| wide(text) <= room).or_else(|| texts().last()).unwrap_or_default()
}

/// The colour of an IoU: bad, attention, good. The number beside it says the same.
pub(crate) fn iou_color(tokens: &Tokens, iou: f64) -> Color32 {
    if iou >= 0.5 {
        tokens.ok
    } else if iou >= 0.3 {
        tokens.warn
    } else {
        tokens.bad
    }
}

/// A square button with a sign on it and a spoken name.
pub(crate) fn icon_button(ui: &mut Ui, sign: &str, name: &str, tooltip: &str, enabled: bool, active: bool) -> Response {
    let tokens = Tokens::of(ui);
    let text = RichText::new(sign).font(theme::mono(if sign.chars().count() == 1 { 15.0 } else { 12.0 }));
    let mut button = egui::Button::new(text).min_size(egui::vec2(30.0, 22.0)).sense(Sense::click());
    if active {
        button = button.fill(tokens.accent.gamma_multiply(0.35));
    }
    let response = ui.add_enabled(enabled, button);
    let name = name.to_owned();
    response.widget_info(move || WidgetInfo::labeled(egui::Role::Button, enabled, &name));
    response.on_hover_text(tooltip).on_disabled_hover_text(tooltip)
}

/// Gives a thing the name that a screen reader says, where its text does not.
pub(crate) trait Named {
    /// The same response, named.
    fn named(self, role: egui::Role, name: &str) -> Self;
}

impl Named for Response {
    fn named(self, role: egui::Role, name: &str) -> Self {
        let enabled = self.enabled();
        self.widget_info(|| WidgetInfo::labeled(role, enabled, name));
        self
    }
}

/// A name at the left and a number with its unit at the right edge, in tabular figures.
pub(crate) fn value_row(ui: &mut Ui, name: &str, value: &str, unit: &str) -> Response {
    let tokens = Tokens::of(ui);
    ui.horizontal(|ui| {
        ui.label(RichText::new(name).color(tokens.dim));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.add_sized([26.0, 16.0], egui::Label::new(RichText::new(unit).small().color(tokens.dim)));
            ui.label(RichText::new(value).font(theme::mono(12.0)));
        });
    })
    .response
}
