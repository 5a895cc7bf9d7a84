//! The fit: transport, the shown iteration's numbers, and every setting.

use super::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Named as _, chip, icon_button, iou_color, value_row};
use crate::config::{ChoiceGroup, Convergence, EmRegion, Field, FieldGroup, FitConfig, Preset};
use crate::mhp::Precision;
use crate::session::{Command, FitStatus};
use egui::{RichText, Ui};

pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>) {
    transport(ui, shared);
    // In scopes of their own: what appears in them must not shift the identity of a number that is being typed below.
    ui.scope(|ui| status(ui, shared));
    ui.separator();
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let old = shared.session.config;
        let mut config = old;
        for field in FieldGroup::Weights.fields() {
            slider(ui, field, &mut config);
        }
        ui.separator();
        ui.scope(|ui| numbers(ui, shared));
        ui.separator();
        settings(ui, shared, &mut config);
        if config != old {
            shared.send(Command::SetConfig(Box::new(config)));
        }
    });
}

fn transport(ui: &mut Ui, shared: &mut Shared<'_>) {
    let fit = &shared.session.fit;
    let (ready, running, shown) = (fit.is_ready(), fit.is_running(), fit.shown_iteration());
    let head = fit.head();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let (sign, name) = if running { ("‖", "Pause fit") } else { ("▶", "Run fit") };
        let text = RichText::new(if running { format!("{sign} Pause") } else { format!("{sign} Run") });
        let response = ui.add_enabled(ready, egui::Button::new(text).min_size(egui::vec2(72.0, 24.0)));
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, ready, name));
        if response.on_hover_text("Run the asked number of iterations, or pause.\nKey: Enter").clicked() {
            shared.invoke("Run or pause");
        }
        if icon_button(ui, "−1", "Step back", "Show the iteration before.\nKey: ,", ready && shown > 0, false).clicked() {
            shared.invoke("One step back");
        }
        if icon_button(ui, "+1", "Step forward", "One iteration forward.\nKey: .", ready && !(running && shown == head), false).clicked() {
            shared.invoke("One step");
        }
        if icon_button(ui, "+10", "Ten steps forward", "Ten iterations forward.\nKey: Shift+.", ready && !(running && shown == head), false).clicked() {
            shared.invoke("Ten steps");
        }
        if icon_button(ui, "↺", "Reset fit", "Find a new start pose with the current settings and forget every iteration of this frame.\nKey: Ctrl+R", shared.session.data.frame.is_some(), false).clicked() {
            shared.invoke("Reset fit");
        }
        if icon_button(ui, "✕", "Discard run", "Remove this branch and go back to where it began; on the first branch, back to the start pose.\nKey: Ctrl+Backspace", ready && head > 0, false).clicked() {
            shared.invoke("Discard run");
        }
    });
}

fn status(ui: &mut Ui, shared: &mut Shared<'_>) {
    let tokens = Tokens::of(ui);
    let fit = &shared.session.fit;
    let (word, color) = match &fit.status {
        FitStatus::Idle => ("no frame", tokens.dim),
        FitStatus::Preparing => ("preparing…", tokens.dim),
        FitStatus::Paused if fit.cursor.is_some() => ("looking back", tokens.warn),
        FitStatus::Paused => ("paused", tokens.dim),
        FitStatus::Running => ("running", tokens.accent),
        FitStatus::Failed(_) => ("failed", tokens.bad),
    };
    ui.horizontal_wrapped(|ui| {
        chip(ui, word, color);
        if let Some(row) = fit.shown_row() {
            if row.report.converged && row.report.iteration > 0 && !fit.is_running() {
                let settled = match shared.session.config.convergence {
                    Convergence::Change => "L changed",
                    Convergence::Improvement => "L fell",
                };
                chip(ui, "✓ converged", tokens.ok).on_hover_text(format!(
                    "The criterion holds: L < 1, or {settled} by less than 0.5 % over five iterations; every joint finite and every bone within 0.5–1.5 of its reference.",
                ));
            }
            if let Some(reason) = fit.reason {
                ui.label(RichText::new(reason).small().color(tokens.dim));
            }
        }
        if let FitStatus::Failed(why) = &fit.status {
            ui.label(RichText::new(why).small().color(tokens.bad));
        }
    });
    // Always there: a branch that begins while a slider is dragged must not move the slider.
    branches(ui, shared);
}

fn branches(ui: &mut Ui, shared: &mut Shared<'_>) {
    let history = &shared.session.fit.history;
    let active = history.active_id();
    let name = |id: u32, parent: Option<(u32, usize)>, head: usize| match parent {
        None => format!("branch {id}: 0 → {head}"),
        Some((from, at)) => format!("branch {id}: from {from} at {at} → {head}"),
    };
    let mut chosen = active;
    let current = history.active().map_or_else(String::new, |b| name(b.id, b.parent, b.head()));
    egui::ComboBox::from_id_salt("branch")
        .width(ui.available_width() - 8.0)
        .selected_text(current)
        .show_ui(ui, |ui| {
            for b in history.branches() {
                ui.selectable_value(&mut chosen, b.id, name(b.id, b.parent, b.head()));
            }
        })
        .response
        .named(egui::Role::ComboBox, "Branch")
        .on_hover_text(
            "Branches of this fit. Changing a setting at an earlier iteration starts a new one and keeps the old.",
        );
    if chosen != active {
        shared.send(Command::SelectBranch(chosen));
    }
}

fn numbers(ui: &mut Ui, shared: &Shared<'_>) {
    let tokens = Tokens::of(ui);
    let fit = &shared.session.fit;
    let Some(row) = fit.shown_row() else {
        // The same rows without numbers, so that nothing jumps while the next frame is prepared.
        let arrays =
            shared.session.data.dataset.iter().flat_map(|d| &d.info().views).map(|v| format!("IoU {}", v.array));
        let names = ["Iteration", "L total", "L_EM", "L_bone", "L_rigid", "L_joint"].map(str::to_owned);
        for name in names.into_iter().chain(arrays) {
            value_row(ui, &name, "—", "");
        }
        if let Some(error) = &shared.session.data.error {
            ui.label(RichText::new(error).small().color(tokens.bad));
        }
        return;
    };
    let report = &row.report;
    // Settings may have changed since the row was made: while the newest iteration is shown, the snapshot is the truth.
    let evaluation = fit.shown.as_ref().filter(|s| s.iteration == report.iteration).map(|s| &s.evaluation);
    let (loss, terms, iou) =
        evaluation.map_or((report.loss, report.terms, report.iou.clone()), |e| (e.loss, e.terms, e.iou.clone()));
    value_row(ui, "Iteration", &format!("{} / {}", report.iteration, fit.head()), "");
    if let Some(count) = fit.found_start.as_ref().and_then(|found| found.count.as_ref()) {
        let (people, chances) = (count.people(), count.probabilities.map(|p| format!("{:.0} %", 100.0 * p)));
        let chance = chances.get(people).cloned().unwrap_or_default();
        value_row(ui, "People counted", &format!("{people} ({chance})"), "").on_hover_text(format!(
            "0 to 4 and more: {}. Fitted: {}; “people” under Start overrides the count.",
            chances.join(", "),
            fit.initial.as_ref().map_or(0, |initial| initial.shape().persons)
        ));
    }
    value_row(ui, "L total", &format!("{loss:.5}"), "")
        .on_hover_text("L = w_EM·L_EM + w_kine·(L_bone + L_rigid + L_joint + L_sep + L_coll)");
    value_row(ui, "L_EM", &format!("{:.5}", terms.em), "")
        .on_hover_text("Mean over the views of one minus the soft IoU.");
    value_row(ui, "L_bone", &format!("{:.5}", terms.bone), "")
        .on_hover_text("Σ ψ(l − ℓ) over the bones: length against reference.");
    value_row(ui, "L_rigid", &format!("{:.5}", terms.rigid), "")
        .on_hover_text("Σ ψ of the relative velocity along each bone.");
    value_row(ui, "L_joint", &format!("{:.5}", terms.joint), "")
        .on_hover_text("Σ max(0, θ − θ_max)² over elbows and knees, rad².");
    if terms.time != 0.0 {
        value_row(ui, "L_time", &format!("{:.5}", terms.time), "")
            .on_hover_text("Σ ‖c − ĉ‖² to where the frames around say that each person is, m².");
    }
    if terms.sep != 0.0 || terms.coll != 0.0 {
        value_row(ui, "L_sep", &format!("{:.5}", terms.sep), "");
        value_row(ui, "L_coll", &format!("{:.5}", terms.coll), "");
    }
    let names = fit.problem.iter().flat_map(|p| &p.views).map(|v| v.array.as_str());
    for (name, iou) in names.zip(&iou) {
        ui.horizontal(|ui| {
            ui.label(RichText::new(format!("IoU {name}")).color(tokens.dim));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add_sized([26.0, 16.0], egui::Label::new(""));
                let (text, color) =
                    iou.map_or(("—".into(), tokens.dim), |x| (format!("{x:.3}"), iou_color(&tokens, x)));
                ui.label(RichText::new(text).font(theme::mono(12.0)).color(color));
            });
        })
        .response
        .on_hover_text("Forward-consistency IoU of the hard masks over the EM region.");
    }
    if let Some(majpe) = row.majpe_mm {
        value_row(ui, "MAJPE", &format!("{majpe:.1}"), "mm")
            .on_hover_text("Mean absolute joint position error against the data set's joints.");
    }
}

fn settings(ui: &mut Ui, shared: &mut Shared<'_>, config: &mut FitConfig) {
    egui::CollapsingHeader::new("Optimiser").default_open(true).show(ui, |ui| {
        for field in FieldGroup::Optimiser.fields() {
            slider(ui, field, config);
        }
        ui.checkbox(&mut config.stop_when_converged, "Stop when converged")
            .on_hover_text("End a run as soon as the convergence criterion holds.");
        choices(ui, ChoiceGroup::Optimiser, config);
        let mut warm = shared.session.warm_start;
        if ui
            .checkbox(&mut warm, "Warm start")
            .on_hover_text("Start the next frame from this frame's result instead of from its own peaks.")
            .changed()
        {
            shared.send(Command::SetWarmStart(warm));
        }
        let mut precision = shared.session.precision;
        ui.horizontal(|ui| {
            ui.label("Kernel");
            ui.selectable_value(&mut precision, Precision::F64, "f64")
                .on_hover_text("Double precision, the oracle: some seventy times as slow. Changing it resets the fit.");
            ui.selectable_value(&mut precision, Precision::F32, "f32")
                .on_hover_text("Single precision, right to five digits. Changing it resets the fit.");
        });
        if precision != shared.session.precision {
            shared.send(Command::SetPrecision(precision));
        }
        let mut auto = shared.session.view.run_on_open;
        if ui
            .checkbox(&mut auto, "Fit each frame when shown")
            .on_hover_text("Begin a run as soon as a frame without a fit is shown.")
            .changed()
        {
            shared.set_view(|v| v.run_on_open = auto);
        }
    });
    egui::CollapsingHeader::new("Radar simulation").default_open(true).show(ui, |ui| {
        operators(ui, config);
        choices(ui, ChoiceGroup::Radar, config);
        region(ui, config);
        for field in FieldGroup::Radar.fields() {
            slider(ui, field, config);
        }
    });
    egui::CollapsingHeader::new("Kinematic limits").default_open(false).show(ui, |ui| {
        for field in FieldGroup::Limits.fields() {
            slider(ui, field, config);
        }
    });
    egui::CollapsingHeader::new("Model").default_open(true).show(ui, |ui| model(ui, config));
    egui::CollapsingHeader::new("Start").default_open(false).show(ui, |ui| {
        ui.label(egui::RichText::new("Takes effect when a start is found: Ctrl+R.").small());
        ui.checkbox(&mut config.init.position, "P: positions from the peaks")
            .on_hover_text("Off: the body stands in the middle of what the views cover.");
        ui.checkbox(&mut config.init.velocity, "V: velocities from the maps")
            .on_hover_text("From the Doppler axis, or from the intensity gradients of consecutive maps. Off: 0.");
        choices(ui, ChoiceGroup::Start, config);
        for field in FieldGroup::Start.fields() {
            slider(ui, field, config);
        }
        ui.label("Perturb the start").on_hover_text("The perturbations of the paper's robustness table.");
        for field in FieldGroup::Perturbation.fields() {
            slider(ui, field, config);
        }
    });
    ui.add_space(4.0);
    presets(ui, config);
}

/// Every setting at once, by name; what each name stands for beside it.
fn presets(ui: &mut Ui, config: &mut FitConfig) {
    let tokens = Tokens::of(ui);
    ui.label("Preset").on_hover_text("All settings at once.");
    for preset in Preset::ALL {
        ui.horizontal_wrapped(|ui| {
            let button = ui.selectable_label(*config == preset.config(), preset.name());
            let button = button.named(egui::Role::Button, &format!("Preset {}", preset.name()));
            if button.on_hover_text(preset.help()).clicked() {
                *config = preset.config();
            }
            ui.label(RichText::new(preset.help()).small().color(tokens.dim));
        });
    }
}

/// What is moved, what the Gaussians look like, where the start looks, and the terms that the paper's objective lacks.
fn model(ui: &mut Ui, config: &mut FitConfig) {
    choices(ui, ChoiceGroup::Model, config);
    for field in FieldGroup::Regularisation.fields() {
        slider(ui, field, config);
    }
}

/// The switches of a group: label and answers, one a line.
fn choices(ui: &mut Ui, group: ChoiceGroup, config: &mut FitConfig) {
    for choice in group.choices() {
        ui.horizontal_wrapped(|ui| {
            let given = (choice.get)(config);
            let tip = format!("Default: {}. FIT.toml: {}", choice.answers[0].label, choice.key);
            ui.label(choice.label).on_hover_text(tip);
            for (k, answer) in choice.answers.iter().enumerate() {
                let at_start = if choice.starts() { " Takes effect when a start is found." } else { "" };
                let tip = format!("{}{at_start}\nFIT.toml: {} = \"{}\"", answer.help, choice.key, answer.word);
                if ui.selectable_label(given == k, answer.label).on_hover_text(tip).clicked() {
                    (choice.set)(config, k);
                }
            }
        });
    }
}

/// Label, slider, value, and a button back to the default where the value differs from it.
fn slider(ui: &mut Ui, field: &Field, config: &mut FitConfig) {
    let default = (field.get)(&FitConfig::default());
    let mut value = (field.get)(config);
    let (lo, hi) = field.range;
    let tip = format!(
        "{}\nDefault {default}{}{}. FIT.toml: {}",
        field.help,
        if field.unit.is_empty() { "" } else { " " },
        field.unit,
        field.key
    );
    ui.horizontal(|ui| {
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        let label = ui.allocate_ui_with_layout(egui::vec2(96.0, 20.0), layout, |ui| {
            ui.set_min_width(96.0);
            ui.add(egui::Label::new(field.label).truncate())
        });
        label.inner.on_hover_text(&tip);
        let width = (ui.available_width() - 92.0).max(40.0);
        ui.spacing_mut().slider_width = width;
        let mut slider = egui::Slider::new(&mut value, lo..=hi).show_value(false);
        if field.logarithmic {
            slider = slider.logarithmic(true).smallest_positive(if lo > 0.0 { lo } else { 1e-3 });
        }
        let response = ui.add(slider);
        response.widget_info(|| egui::WidgetInfo::slider(true, value, field.label));
        response.on_hover_text(&tip);
        let speed = if value == 0.0 { 0.001 } else { value.abs() * 0.01 };
        let digits = if field.key == "iterations" { 0 } else { 6 };
        let drag = egui::DragValue::new(&mut value)
            .update_while_editing(false)
            .range(lo..=hi)
            .speed(speed)
            .max_decimals(digits)
            .suffix(if field.unit == "m" { " m" } else { field.unit });
        let response = ui.add_sized([62.0, 20.0], drag);
        let spoken = format!("{} value", field.label);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, &spoken));
        response.on_hover_text(&tip);
        let off = value != default;
        let back = ui.add_visible(off, egui::Button::new("↺").small().frame(false));
        let spoken = format!("Reset {}", field.label);
        back.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, off, &spoken));
        if back.on_hover_text(format!("Back to {default}")).clicked() {
            value = default;
        }
    });
    if value != (field.get)(config) {
        (field.set)(config, value);
    }
}

fn operators(ui: &mut Ui, config: &mut FitConfig) {
    ui.horizontal_wrapped(|ui| {
        let o = &mut config.operators;
        ui.checkbox(&mut o.attenuation, "attenuation").on_hover_text("A = α·(r_max/d)⁴; off: A = α.");
        ui.checkbox(&mut o.range, "range")
            .on_hover_text("Beat-frequency phase 2πSτ²; off: range axes see every joint at 0 m.");
        ui.checkbox(&mut o.doppler, "Doppler")
            .on_hover_text("Phase 2π(2v_r/λ)T_frame and the ramp; off: Doppler axes see every joint at rest.");
        ui.checkbox(&mut o.angle, "angle")
            .on_hover_text("Array phase; off: angular axes see every joint at boresight.");
    });
}

fn region(ui: &mut Ui, config: &mut FitConfig) {
    ui.horizontal(|ui| {
        ui.label("EM region").on_hover_text("Where L_EM is computed: the whole map, or a box around the start pose.");
        let full = config.em_region == EmRegion::Full;
        if ui.selectable_label(full, "whole map").clicked() {
            config.em_region = EmRegion::Full;
        }
        if ui.selectable_label(!full, "±").clicked() && full {
            config.em_region = EmRegion::default();
        }
        if let EmRegion::HalfWidth(half) = &mut config.em_region {
            let drag =
                egui::DragValue::new(half).update_while_editing(false).range(0.1..=20.0).speed(0.01).suffix(" m");
            let response = ui.add(drag);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, "EM region half width"));
            response.on_hover_text("Half width of the box around the person's start pose. Default 1.25 m.");
        }
    });
}
