//! One setting on screen, made from its row in the table.

use super::Named as _;
use crate::config::{Answer, Field, FieldGroup, FieldKind, FitConfig, Number, Preset, Value};
use egui::{Color32, Response, Ui, vec2};

/// The box of a number and the button beside it, points.
const VALUE: egui::Vec2 = egui::vec2(72.0, 20.0);
const BACK: egui::Vec2 = egui::vec2(14.0, 20.0);
/// The column of labels: as wide as the longest of a group, within these, points.
const NAME: [f32; 2] = [46.0, 92.0];
/// Between the columns.
const GAP: f32 = 4.0;

/// The settings of a group, one a line; switches that follow each other share one.
pub(in crate::app) fn settings(ui: &mut Ui, group: FieldGroup, config: &mut FitConfig) {
    rows(ui, &group.fields().collect::<Vec<_>>(), config);
}

/// These settings, one a line; switches that follow each other share one.
pub(in crate::app) fn rows(ui: &mut Ui, fields: &[&Field], config: &mut FitConfig) {
    let preset = Preset::nearest(config);
    let width = names(ui, fields);
    for run in fields.chunk_by(|a, b| matches!((&a.kind, &b.kind), (FieldKind::Switch, FieldKind::Switch))) {
        if let [Field { kind: FieldKind::Switch, .. }, ..] = run {
            ui.horizontal_wrapped(|ui| run.iter().for_each(|field| switch(ui, field, config)));
            continue;
        }
        for field in run {
            match &field.kind {
                FieldKind::Choice(answers) => choice(ui, field, width, answers, config),
                FieldKind::Number(number) if number.unset.is_some() => optional(ui, field, width, number, config),
                FieldKind::Number(number) => slider(ui, field, width, number, preset, config),
                FieldKind::Switch => {}
            }
        }
    }
}

fn switch(ui: &mut Ui, field: &Field, config: &mut FitConfig) {
    let mut on = field.get(config) == Value::Switch(true);
    if ui.checkbox(&mut on, field.label).on_hover_text(field.tip()).changed() {
        field.set(config, Value::Switch(on));
    }
}

/// Label and answers.
fn choice(ui: &mut Ui, field: &Field, width: f32, answers: &[Answer], config: &mut FitConfig) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        name(ui, field, width);
        for (k, answer) in answers.iter().enumerate() {
            let given = field.get(config) == Value::Answer(k);
            if ui.selectable_label(given, answer.label).on_hover_text(field.answer_tip(answer)).clicked() {
                field.set(config, Value::Answer(k));
            }
        }
    });
}

/// The width of the column of these labels, points.
fn names(ui: &Ui, fields: &[&Field]) -> f32 {
    let font = egui::TextStyle::Body.resolve(ui.style());
    let wide = |field: &&Field| ui.painter().layout_no_wrap(field.label.into(), font.clone(), Color32::GRAY).size().x;
    let labels = fields.iter().filter(|field| !matches!(field.kind, FieldKind::Switch));
    labels.map(wide).fold(0.0, f32::max).ceil().clamp(NAME[0], NAME[1])
}

/// The label, in the column that all of them share.
fn name(ui: &mut Ui, field: &Field, width: f32) {
    let layout = egui::Layout::left_to_right(egui::Align::Center);
    let label = ui.allocate_ui_with_layout(vec2(width, VALUE.y), layout, |ui| {
        ui.set_min_width(width);
        ui.add(egui::Label::new(field.label).truncate())
    });
    label.inner.on_hover_text(field.tip());
}

/// Label, slider, value, and a button back to what the nearest preset sets where the value differs from it.
fn slider(ui: &mut Ui, field: &Field, width: f32, number: &Number, preset: Preset, config: &mut FitConfig) {
    let (Value::Number(old), Value::Number(usual)) = (field.get(config), field.get(&preset.config())) else { return };
    let mut value = old;
    let (lo, hi) = number.offered;
    let tip = field.tip();
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        name(ui, field, width);
        ui.spacing_mut().slider_width = (ui.available_width() - beside()).max(40.0);
        // Every point of the way is another value, of three digits: a live fit follows as finely as the finger moves.
        let mut slider = egui::Slider::new(&mut value, lo..=hi).show_value(false).smart_aim(false);
        if number.logarithmic {
            slider = slider.logarithmic(true).smallest_positive(if lo > 0.0 { lo } else { 1e-3 });
        }
        let response = ui.add(slider);
        if response.changed() {
            value = three_digits(value).clamp(lo, hi);
        }
        response.widget_info(|| egui::WidgetInfo::slider(true, value, field.label));
        unless_held(response, &tip);
        unless_held(typed(ui, field, number, &mut value), &tip);
        let back = egui::Button::new("↺").small().frame(false).min_size(BACK);
        let back = ui.add_visible(value != usual, back);
        let back = back.named(egui::Role::Button, &format!("Reset {}", field.label));
        if back.on_hover_text(format!("Back to {usual}, as {} has it", preset.name())).clicked() {
            value = usual;
        }
    });
    if value != old {
        field.set(config, Value::Number(value));
    }
}

/// Tells what a thing is, but not while it is dragged: the maps beside it are what the finger moves.
fn unless_held(response: Response, tip: &str) {
    if !response.ctx.input(|i| i.pointer.any_down()) {
        response.on_hover_text(tip);
    }
}

/// What stands right of a slider, points.
fn beside() -> f32 {
    VALUE.x + BACK.x + 2.0 * GAP
}

/// The nearest number of three digits that count.
fn three_digits(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let unit = 10f64.powi(2 - value.abs().log10().floor() as i32);
    (value * unit).round() / unit
}

/// Label, the answer that needs no number, and the number.
fn optional(ui: &mut Ui, field: &Field, width: f32, number: &Number, config: &mut FitConfig) {
    let Some(unset) = number.unset else { return };
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        ui.spacing_mut().button_padding.x = GAP;
        let tip = field.tip();
        name(ui, field, width);
        let given = field.get(config);
        let without = given == Value::Unset;
        // What has no word is left out of FIT.toml.
        let tip_without = match unset.form {
            Some(_) => field.answer_tip(&unset.answer),
            None => unset.answer.help.to_owned(),
        };
        if ui.selectable_label(without, unset.answer.label).on_hover_text(tip_without).clicked() {
            field.set(config, Value::Unset);
        }
        if ui.selectable_label(!without, unset.number).on_hover_text(&tip).clicked() && without {
            field.set(config, Value::Number(unset.first));
        }
        if let Value::Number(old) = field.get(config) {
            let mut value = old;
            // In the column of all numbers.
            ui.add_space((ui.available_width() - beside() + GAP).max(0.0));
            unless_held(typed(ui, field, number, &mut value), &tip);
            if value != old {
                field.set(config, Value::Number(value));
            }
        }
    });
}

/// The number itself, to be typed or dragged.
fn typed(ui: &mut Ui, field: &Field, number: &Number, value: &mut f64) -> Response {
    let (lo, hi) = number.offered;
    let speed = if *value == 0.0 { 0.001 } else { value.abs() * 0.01 };
    let drag = egui::DragValue::new(value)
        .update_while_editing(false)
        .range(lo..=hi)
        .speed(speed)
        .max_decimals(if number.whole { 0 } else { 6 })
        .suffix(suffix(number.unit));
    let drag = match number.zero {
        Some(word) => drag
            .custom_formatter(move |x, _| if x == 0.0 { word.to_owned() } else { format!("{x:.0}") })
            .custom_parser(move |text| if text.trim() == word { Some(0.0) } else { text.trim().parse().ok() }),
        None => drag,
    };
    let response = ui.scope(|ui| {
        ui.spacing_mut().button_padding.x = 3.0;
        ui.add_sized(VALUE, drag)
    });
    let response = response.inner;
    response.named(egui::Role::SpinButton, &format!("{} value", field.label))
}

/// A unit behind a number: letters stand apart from it.
fn suffix(unit: &str) -> String {
    if unit.starts_with(char::is_alphabetic) { format!(" {unit}") } else { unit.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::epaint::Shape;

    fn texts(shape: &Shape, into: &mut Vec<String>) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| texts(shape, into)),
            Shape::Text(text) => into.push(text.galley.text().to_owned()),
            _ => {}
        }
    }

    #[test]
    fn a_dragged_value_has_three_digits() {
        let told = [0.0, 3.472_13, 0.012_345_6, 999.9, 98_765.4, -0.5].map(three_digits);
        assert_eq!(told, [0.0, 3.47, 0.0123, 1000.0, 98_800.0, -0.5]);
    }

    /// Each setting by its label, also one that only tests know; and drawing them changes none.
    #[test]
    fn every_row_of_the_table_is_drawn() {
        for group in FieldGroup::ALL {
            let mut config = FitConfig::default();
            let size = egui::vec2(600.0, 2000.0);
            let input = egui::RawInput {
                screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size)),
                ..egui::RawInput::default()
            };
            let mut output = egui::Context::default().run_ui(input, |ui| settings(ui, group, &mut config));
            output.textures_delta.clear();
            let mut drawn = Vec::new();
            output.shapes.iter().for_each(|clipped| texts(&clipped.shape, &mut drawn));
            for field in group.fields() {
                assert!(drawn.iter().any(|text| text == field.label), "{} in {drawn:?}", field.key);
            }
            assert_eq!(config, FitConfig::default());
        }
    }
}
