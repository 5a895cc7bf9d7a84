//! The question that a file of predictions raises: whose joints they are, their unit, which way the axes point.

use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::body::Skeleton;
use crate::predictions::{Axes, Reading, Unit};
use crate::session::{Command, SourceQuestion};
use egui::{RichText, Role, Ui};

/// The answer that is being edited.
#[derive(Default)]
pub(super) struct ReadingQuestion {
    edited: Option<(SourceQuestion, Reading, String)>,
}

impl ReadingQuestion {
    pub(super) fn is_open(&self) -> bool {
        self.edited.is_some()
    }

    pub(super) fn show(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) {
        let Some(question) = &shared.session.sources.question else {
            self.edited = None;
            return;
        };
        if self.edited.as_ref().is_none_or(|(known, ..)| known != question) {
            let mut reading = question.reading.clone();
            // The usual answers, to be changed: the form shows what will be taken.
            reading.unit =
                reading.unit.or(Some(if question.why.contains("would be in mm") { Unit::Mm } else { Unit::M }));
            reading.axes = reading.axes.or(Some(Axes::WORLD));
            let axes = reading.axes.map_or_else(String::new, |axes| axes.to_string());
            self.edited = Some((question.clone(), reading, axes));
        }
        let Some((question, reading, axes)) = &mut self.edited else { return };
        let needs_joints = question.why.contains("joints they are") || question.why.contains("wrong skeleton");
        let mut send = None;
        let response = super::modal(ui, "reading").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 560.0));
            let tokens = Tokens::of(ui);
            ui.label(RichText::new("How are these joints to be read?").font(theme::strong(16.0)));
            let text = "The file does not say it. Your answer is remembered for files of the same form.";
            ui.label(RichText::new(text).small().color(tokens.dim));
            ui.label(
                RichText::new(question.path.display().to_string()).font(theme::mono(theme::CAPTION)).color(tokens.dim),
            );
            ui.separator();
            egui::Grid::new("reading").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
                ui.label("Unit");
                ui.horizontal(|ui| {
                    for unit in Unit::ALL {
                        ui.selectable_value(&mut reading.unit, Some(unit), unit.word());
                    }
                });
                ui.end_row();
                ui.label("Axes");
                ui.horizontal(|ui| choose_axes(ui, reading, axes));
                ui.end_row();
                if needs_joints {
                    ui.label("Joints");
                    skeleton(ui, reading);
                    ui.end_row();
                }
                ui.label("Name");
                let mut name = reading.name.clone().unwrap_or_else(|| crate::predictions::source_name(&question.path));
                let field = egui::TextEdit::singleline(&mut name).desired_width(160.0);
                if ui.add(field).named(Role::TextInput, "Name of the source").changed() {
                    reading.name = Some(name.to_lowercase());
                }
                ui.end_row();
            });
            ui.separator();
            let ready =
                reading.axes.is_some() && reading.unit.is_some() && (!needs_joints || reading.skeleton.is_some());
            ui.horizontal(|ui| {
                if ui.add_enabled(ready, egui::Button::new("Read these joints")).clicked() {
                    send = Some(Command::OpenPredictions(question.path.clone(), Box::new(reading.clone())));
                }
                if ui.button("Cancel").clicked() {
                    send = Some(Command::DismissPredictions);
                }
            });
            ui.add(egui::Label::new(RichText::new(&question.why).small().color(tokens.dim)).wrap());
        });
        if let Some(command) = send {
            shared.send(command);
        } else if response.should_close() {
            shared.send(Command::DismissPredictions);
        }
    }
}

fn choose_axes(ui: &mut Ui, reading: &mut Reading, typed: &mut String) {
    for (name, axes) in Axes::NAMED {
        let tip = match name {
            "radar" => "x forward, y to the left, z up: the frame of the program.",
            "camera" => "x to the right, y down, z forward.",
            _ => "x to the right, y forward, z up.",
        };
        if ui.selectable_label(reading.axes == Some(axes), name).on_hover_text(tip).clicked() {
            reading.axes = Some(axes);
            *typed = axes.to_string();
        }
    }
    let field = egui::TextEdit::singleline(typed).font(egui::TextStyle::Monospace).desired_width(80.0);
    let field = ui.add(field).named(Role::TextInput, "Axes: forward, left, up");
    if field.on_hover_text("Which signed axes of the file are forward, left and up, for example z,-x,-y.").changed() {
        reading.axes = typed.parse().ok();
    }
}

fn skeleton(ui: &mut Ui, reading: &mut Reading) {
    let shown = reading.skeleton.clone().unwrap_or_else(|| "choose".into());
    let combo = egui::ComboBox::from_id_salt("predicted skeleton").selected_text(shown).show_ui(ui, |ui| {
        for name in Skeleton::PRESETS {
            let joints = Skeleton::preset(name).map_or(0, |skeleton| skeleton.joints.len());
            ui.selectable_value(&mut reading.skeleton, Some(name.to_owned()), format!("{name}, {joints} joints"));
        }
    });
    combo.response.named(Role::ComboBox, "Skeleton of the joints");
}
