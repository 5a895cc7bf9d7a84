//! Which directions a slice goes along, how far, and what of it is drawn.

use crate::app::panes::Shared;
use crate::app::widgets::Named as _;
use crate::explore::SliceAlong;
use crate::mhp::TermId;
use egui::{Role, Ui};

/// The choices above the picture.
pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>) {
    let before = shared.session.view.explore.landscape.clone();
    let mut settings = before.clone();
    let menu = egui::ComboBox::from_id_salt("slice along").width(118.0).selected_text(settings.along.title());
    let response = menu.show_ui(ui, |ui| {
        for along in SliceAlong::ALL {
            ui.selectable_value(&mut settings.along, along, along.title()).on_hover_text(along.help());
        }
    });
    response.response.named(Role::ComboBox, "Direction 1").on_hover_text(settings.along.help());
    let title = settings.and.map_or("one direction", SliceAlong::title);
    let menu = egui::ComboBox::from_id_salt("slice and").width(118.0).selected_text(title);
    let response = menu.show_ui(ui, |ui| {
        ui.selectable_value(&mut settings.and, None, "one direction");
        for along in SliceAlong::ALL.into_iter().filter(|along| *along != settings.along) {
            ui.selectable_value(&mut settings.and, Some(along), along.title()).on_hover_text(along.help());
        }
    });
    response.response.named(Role::ComboBox, "Direction 2");
    let reach = egui::DragValue::new(&mut settings.reach).range(0.02..=5.0).speed(0.02).prefix("× ").max_decimals(2);
    ui.add(reach)
        .named(Role::SpinButton, "Reach of the slice")
        .on_hover_text("How far the slice reaches: drag, or type.");
    if [Some(settings.along), settings.and].contains(&Some(SliceAlong::Pins)) {
        pins(ui, shared, &mut settings.pins);
    }
    if settings.and.is_some() {
        let shown = TermId::of(&settings.shown).map_or("L", |term| term.label);
        let menu = egui::ComboBox::from_id_salt("slice of").width(72.0).selected_text(shown);
        let response = menu.show_ui(ui, |ui| {
            ui.selectable_value(&mut settings.shown, "loss".to_owned(), "L");
            for term in TermId::all().filter(|term| !term.is_of_windows()) {
                ui.selectable_value(&mut settings.shown, term.key.to_owned(), term.label);
            }
        });
        response.response.named(Role::ComboBox, "Term of the slice");
    }
    if settings != before {
        shared.set_view(|view| view.explore.landscape = settings);
    }
}

fn pins(ui: &mut Ui, shared: &Shared<'_>, names: &mut [String; 2]) {
    let here = shared.session.fit.frame;
    let pins: Vec<&str> =
        shared.session.pins.list().iter().filter(|pin| pin.frame == here).map(|pin| pin.name.as_str()).collect();
    for (k, end) in ["From pin", "To pin"].into_iter().enumerate() {
        let none = if k == 0 { "baseline" } else { "on screen" };
        let text = if pins.contains(&names[k].as_str()) { names[k].clone() } else { none.to_owned() };
        let menu = egui::ComboBox::from_id_salt(("slice pin", k)).width(84.0).selected_text(text);
        let response = menu.show_ui(ui, |ui| {
            ui.selectable_value(&mut names[k], String::new(), none);
            for pin in &pins {
                ui.selectable_value(&mut names[k], (*pin).to_owned(), *pin);
            }
        });
        response.response.named(Role::ComboBox, end);
    }
}
