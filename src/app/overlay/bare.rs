//! The question that a bare `.npy` or `.npz` raises: which arrays are maps, and what their axes are.

use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::body::Skeleton;
use crate::dataset::{BareCatalog, BareChoice};
use crate::radar::{Axis, AxisKind, Quantity, Spacing, View};
use crate::session::Command;
use egui::{RichText, Ui};

/// The choice that is being edited.
#[derive(Default)]
pub(super) struct BareQuestion {
    choice: Option<(BareCatalog, BareChoice, Vec<bool>)>,
}

impl BareQuestion {
    pub(super) fn is_open(&self) -> bool {
        self.choice.is_some()
    }

    pub(super) fn show(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) {
        let Some((path, catalog)) = &shared.session.data.bare else {
            self.choice = None;
            return;
        };
        if self.choice.as_ref().is_none_or(|(known, ..)| known != catalog) {
            let guess = BareChoice::guess(catalog);
            let used = vec![true; guess.views.len()];
            self.choice = Some((catalog.clone(), guess, used));
        }
        let Some((catalog, choice, used)) = &mut self.choice else { return };
        let path = path.clone();
        let mut send = None;
        let response = super::modal(ui, "bare file").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 640.0));
            let tokens = Tokens::of(ui);
            ui.label(RichText::new("What do these maps measure?").font(theme::strong(16.0)));
            let text = "The file does not say which arrays are maps and what their axes are. Your answer is remembered for files with the same arrays.";
            ui.label(RichText::new(text).small().color(tokens.dim));
            ui.label(RichText::new(path.display().to_string()).font(theme::mono(theme::CAPTION)).color(tokens.dim));
            ui.separator();
            egui::ScrollArea::vertical().max_height(380.0).show(ui, |ui| {
                for (i, view) in choice.views.iter_mut().enumerate() {
                    let shape = catalog.arrays.iter().find(|e| e.key == view.array).map(|e| format!("{:?} {}", e.shape, e.dtype));
                    ui.checkbox(&mut used[i], RichText::new(format!("{}   {}", view.array, shape.unwrap_or_default())).font(theme::strong(12.0)));
                    if used[i] {
                        edit_view(ui, view);
                    }
                    ui.add_space(6.0);
                }
                general(ui, choice);
            });
            ui.separator();
            ui.horizontal(|ui| {
                let picked = BareChoice { views: kept(&choice.views, used), ..choice.clone() };
                let fault = if picked.views.is_empty() { Some("choose at least one array".to_owned()) } else { picked.frames_in(catalog).err().map(|e| e.to_string()) };
                if ui.add_enabled(fault.is_none(), egui::Button::new("Open these maps")).clicked() {
                    send = Some(Command::OpenBare(path.clone(), picked));
                }
                if ui.button("Cancel").clicked() {
                    send = Some(Command::DismissBare);
                }
                if let Some(fault) = fault {
                    ui.add(egui::Label::new(RichText::new(fault).small().color(tokens.bad)).wrap());
                }
            });
        });
        if let Some(command) = send {
            shared.send(command);
        } else if response.should_close() {
            shared.send(Command::DismissBare);
        }
    }
}

fn kept(views: &[View], used: &[bool]) -> Vec<View> {
    views.iter().zip(used).filter(|(_, used)| **used).map(|(view, _)| view.clone()).collect()
}

fn edit_view(ui: &mut Ui, view: &mut View) {
    for (k, axis) in view.axes.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            ui.label(format!("   axis {k} · {} bins", axis.bins));
            edit_axis(ui, (&view.array, k), axis);
        });
    }
    ui.horizontal(|ui| {
        ui.label("   values");
        ui.selectable_value(&mut view.quantity, Quantity::Amplitude, "amplitude");
        ui.selectable_value(&mut view.quantity, Quantity::Power, "power");
        ui.label("   blur σ: range");
        ui.add(egui::DragValue::new(&mut view.psf.range_m).range(0.0..=2.0).speed(0.002).suffix(" m"));
        ui.label("azimuth");
        ui.add(egui::DragValue::new(&mut view.psf.azimuth_rad).range(0.0..=1.5).speed(0.001).suffix(" rad"));
        ui.label("elevation");
        ui.add(egui::DragValue::new(&mut view.psf.elevation_rad).range(0.0..=1.5).speed(0.001).suffix(" rad"));
    });
}

fn edit_axis(ui: &mut Ui, salt: (&str, usize), axis: &mut Axis) {
    let combo = egui::ComboBox::from_id_salt(salt).width(92.0).selected_text(axis.kind.name()).show_ui(ui, |ui| {
        for kind in AxisKind::ALL {
            ui.selectable_value(&mut axis.kind, kind, kind.name());
        }
    });
    let spoken = format!("Kind of axis {} of {}", salt.1, salt.0);
    combo.response.named(egui::Role::ComboBox, &spoken);
    let angular = axis.kind.is_angular();
    if angular {
        let mut sine = axis.spacing == Spacing::Sine;
        ui.checkbox(&mut sine, "sine")
            .on_hover_text("The bins are uniform in the sine of the angle; the ends are sines.");
        axis.spacing = if sine { Spacing::Sine } else { Spacing::Linear };
    } else {
        axis.spacing = Spacing::Linear;
    }
    let unit = match (axis.kind, axis.spacing) {
        (_, Spacing::Sine) => "",
        (AxisKind::Doppler, _) => " m/s",
        _ if angular => " rad",
        _ => " m",
    };
    ui.label("from").on_hover_text("Centre of bin 0.");
    ui.add(egui::DragValue::new(&mut axis.lo).speed(0.01).max_decimals(5).suffix(unit));
    ui.label("to")
        .on_hover_text("One step past the centre of the last bin. May be smaller than the start: a falling axis.");
    ui.add(egui::DragValue::new(&mut axis.hi).speed(0.01).max_decimals(5).suffix(unit));
}

fn general(ui: &mut Ui, choice: &mut BareChoice) {
    ui.horizontal(|ui| {
        ui.label("Skeleton");
        let combo = egui::ComboBox::from_id_salt("skeleton").selected_text(&choice.skeleton).show_ui(ui, |ui| {
            for name in Skeleton::PRESETS {
                ui.selectable_value(&mut choice.skeleton, name.to_owned(), name);
            }
        });
        combo.response.named(egui::Role::ComboBox, "Skeleton");
        ui.checkbox(&mut choice.first_axis_is_frame, "the first axis counts frames");
    });
}
