//! Which settings a tuning map is over, and which of their values.

use crate::app::panes::Shared;
use crate::app::theme::Tokens;
use crate::app::widgets::Named as _;
use crate::config::{FIELDS, FieldGroup};
use crate::explore::{AxisValues, TuningAxis};
use egui::{RichText, Role, Ui};

/// The two settings with their values.
pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, typed: &mut [Option<String>; 2]) {
    let config = shared.session.config;
    let before = shared.session.view.explore.tuning.axes_around(&config);
    let mut axes = before.clone();
    for number in 0..2 {
        let chosen = setting(ui, shared, axes.get(number), number);
        match (chosen, axes.get_mut(number)) {
            (Chosen::Axis(axis), Some(old)) => (*old, typed[number]) = (axis, None),
            (Chosen::Axis(axis), None) => axes.push(axis),
            (Chosen::None, Some(_)) => {
                axes.remove(number);
                typed[number] = None;
            }
            _ => {}
        }
        if let Some(axis) = axes.get_mut(number) {
            values(ui, axis, number, &mut typed[number]);
        }
    }
    if axes != before {
        shared.set_view(|view| view.explore.tuning.axes = axes);
    }
}

/// What was chosen in a list of settings.
enum Chosen {
    /// Nothing: as it was.
    AsItWas,
    /// No setting.
    None,
    /// This one.
    Axis(TuningAxis),
}

/// A list of all settings; answers what was chosen.
fn setting(ui: &mut Ui, shared: &Shared<'_>, axis: Option<&TuningAxis>, number: usize) -> Chosen {
    let mut chosen = Chosen::AsItWas;
    let title = axis.map_or("one setting alone", |axis| axis.key.as_str());
    let menu = egui::ComboBox::from_id_salt(("tuned", number)).width(108.0).selected_text(title).height(420.0);
    let response = menu.show_ui(ui, |ui| {
        if number > 0 && ui.selectable_label(axis.is_none(), "one setting alone").clicked() {
            chosen = Chosen::None;
        }
        for group in FieldGroup::ALL {
            ui.label(RichText::new(group.title()).small().weak());
            for field in FIELDS.iter().filter(|field| field.group == group) {
                let on = axis.is_some_and(|axis| axis.key == field.key);
                let other = shared.session.view.explore.tuning.axes_around(&shared.session.config);
                let taken = other.iter().enumerate().any(|(k, axis)| k != number && axis.key == field.key);
                let label = egui::Button::selectable(on, field.key);
                if ui.add_enabled(!taken, label).on_hover_text(field.tip()).clicked() && !on {
                    chosen = Chosen::Axis(TuningAxis::around(field, &shared.session.config));
                }
            }
        }
    });
    response.response.named(Role::ComboBox, &format!("Tuned setting {}", number + 1));
    chosen
}

/// The values as they are typed: a range or a list.
fn values(ui: &mut Ui, axis: &mut TuningAxis, number: usize, typed: &mut Option<String>) {
    let tokens = Tokens::of(ui);
    let mut text = typed.clone().unwrap_or_else(|| written(axis));
    let parsed = format!("{}={text}", axis.key).parse::<TuningAxis>();
    let mut edit = egui::TextEdit::singleline(&mut text).desired_width(128.0);
    if parsed.is_err() {
        edit = edit.text_color(tokens.bad);
    }
    let response = ui.add(edit).named(Role::TextInput, &format!("Values of tuned setting {}", number + 1));
    let expected = axis.field().map_or_else(|why| why, crate::config::Field::expected);
    let why = parsed.as_ref().err().map_or_else(String::new, |why| format!("\n{why}"));
    let response = response.on_hover_text(format!(
        "FROM..TO:STEPS, with log at the end for equal factors; or values with commas between. Enter takes them.\n{expected}{why}"
    ));
    if response.has_focus() {
        *typed = Some(text);
    } else if response.lost_focus() {
        if let Ok(parsed) = format!("{}={text}", axis.key).parse() {
            *axis = parsed;
        }
        *typed = None;
    }
}

/// An axis as it is typed.
fn written(axis: &TuningAxis) -> String {
    match &axis.values {
        AxisValues::Listed(words) => words.join(","),
        AxisValues::Range { from, to, steps, logarithmic } => {
            format!("{from}..{to}:{steps}{}", if *logarithmic { "log" } else { "" })
        }
    }
}
