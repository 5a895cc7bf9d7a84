//! Who labels, how much, and where it is kept: one line, and what is wrong with it below.

use super::Shared;
use crate::app::theme::Tokens;
use crate::app::widgets::Named as _;
use crate::session::{Command, LabelStatus};
use egui::{Align, Label, Layout, RichText, Role, Ui, vec2};

/// Height of the line, points.
const LINE: f32 = 22.0;

/// `typed` is the name while it is being typed.
pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, typed: &mut Option<String>, tokens: &Tokens) {
    let labels = &shared.session.labels;
    let folder =
        labels.place.as_ref().map_or_else(String::new, |place| format!("\nJournals: {}", place.folder.display()));
    let mut wrong = None;
    let (count, tip) = match (&labels.status, &labels.place) {
        (LabelStatus::Failed(why), _) => {
            wrong = Some((format!("■ labels cannot be written: {why}"), tokens.bad));
            (String::new(), String::new())
        }
        (LabelStatus::Ready, Some(place)) => {
            if !place.beside_data {
                let why = place.reason.as_deref().unwrap_or("the data's folder cannot be written");
                wrong = Some((format!("△ kept in {} because {why}", place.folder.display()), tokens.warn));
            }
            let beside = if place.beside_data { " beside the data" } else { "" };
            (
                format!("{} labelled", labels.count()),
                format!("Every act is on disk{beside} before it is shown.{folder}"),
            )
        }
        _ => ("reading…".into(), "The journals are being read.".into()),
    };
    let width = ui.available_width();
    ui.allocate_ui_with_layout(vec2(width, LINE), Layout::right_to_left(Align::Center), |ui| {
        ui.add(Label::new(RichText::new(count).small().color(tokens.dim))).on_hover_text(tip);
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.label(RichText::new("Annotator").small().color(tokens.dim));
            annotator(ui, shared, typed);
        });
    });
    if let Some((text, color)) = wrong {
        ui.label(RichText::new(text).small().color(color)).on_hover_text(folder.trim_start());
    }
}

fn annotator(ui: &mut Ui, shared: &mut Shared<'_>, typed: &mut Option<String>) {
    let known = &shared.session.labels.annotator;
    let mut name = typed.clone().unwrap_or_else(|| known.clone());
    let field = egui::TextEdit::singleline(&mut name).desired_width(ui.available_width().min(160.0));
    let response = ui.add(field).named(Role::TextInput, "Annotator");
    if response.lost_focus() {
        *typed = None;
        if name != *known {
            shared.send(Command::SetAnnotator(name));
        }
    } else {
        *typed = response.has_focus().then_some(name);
    }
    response.on_hover_text("Whose labels these are. Each annotator has a journal of their own.");
}
