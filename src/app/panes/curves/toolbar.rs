//! What the curves show, and how: above them.

use super::{Curve, Shared, branch_of, curves};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::session::{CurvesShown, Smoothing, ViewState};
use egui::{Color32, Ui};

pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>) {
    let tab = shared.session.view.curves;
    let curves = curves(shared, &branch_of(shared.session), tab);
    let tokens = Tokens::of(ui);
    let mut view = shared.session.view.clone();
    ui.horizontal_wrapped(|ui| {
        ui.selectable_value(&mut view.curves, CurvesShown::Each, "Each")
            .on_hover_text("Every curve in a picture of its own, with its own scale.");
        ui.selectable_value(&mut view.curves, CurvesShown::Loss, "Loss")
            .on_hover_text("The total and its unweighted terms.");
        ui.selectable_value(&mut view.curves, CurvesShown::Quality, "IoU and error")
            .on_hover_text("Forward-consistency IoU of each view, and MAJPE where the data set has truth.");
        if tab != CurvesShown::Quality {
            ui.toggle_value(&mut view.log_loss, "log y").on_hover_text("Logarithmic vertical axis.");
        }
        ui.toggle_value(&mut view.log_iterations, "log x").on_hover_text(
            "Logarithmic axis of iterations, log₁₀(1 + iteration): the first ten as wide as the next ninety.",
        );
        smoothing(ui, &mut view);
        if tab == CurvesShown::Each {
            // Their names are over the pictures.
            ui.menu_button("Show", |ui| choose(ui, &curves, &mut view, &tokens))
                .response
                .named(egui::Role::Button, "Which curves are shown")
                .on_hover_text("Which curves are shown.");
        } else {
            ui.add_space(4.0);
            choose(ui, &curves, &mut view, &tokens);
        }
    });
    if view != shared.session.view {
        shared.set_view(|v| *v = view);
    }
}

/// Raw, or how smooth.
fn smoothing(ui: &mut Ui, view: &mut ViewState) {
    let tip = "Exponential moving average over the iterations: what of the mean so far is kept at each. The values themselves \
               stay as a thin line behind.";
    let menu = ui.menu_button(format!("{} ▾", view.smoothing.title()), |ui| {
        for choice in Smoothing::ALL {
            if ui.selectable_label(view.smoothing == choice, choice.title()).clicked() {
                view.smoothing = choice;
                ui.close();
            }
        }
    });
    menu.response.named(egui::Role::Button, "Smoothing").on_hover_text(tip);
}

/// The names of curves; a click shows or hides one.
fn choose(ui: &mut Ui, curves: &[Curve], view: &mut ViewState, tokens: &Tokens) {
    for c in curves {
        let on = !view.hidden_curves.contains(&c.key);
        let mut text = egui::text::LayoutJob::default();
        let font = egui::FontId::proportional(theme::CAPTION);
        let part = |color: Color32, on: bool| egui::TextFormat {
            font_id: font.clone(),
            color,
            strikethrough: if on { egui::Stroke::NONE } else { egui::Stroke::new(1.0, tokens.dim) },
            ..Default::default()
        };
        text.append("■ ", 0.0, part(if on { tokens.curve(&c.key) } else { tokens.stroke }, true));
        text.append(&c.name, 0.0, part(if on { tokens.text } else { tokens.dim }, on));
        let response = ui.add(egui::Label::new(text).sense(egui::Sense::click()).selectable(false).extend());
        let name = format!("Curve {}", c.name);
        response.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, on, &name));
        if response.on_hover_text("Click to show or hide.").clicked() {
            if on {
                view.hidden_curves.push(c.key.clone());
            } else {
                view.hidden_curves.retain(|key| *key != c.key);
            }
        }
    }
}
