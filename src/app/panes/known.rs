//! What the radar knows of the pose on screen, and what only the prior does: numbers and the least observable directions, with
//! ellipsoids and arrows in 3-D while this pane is in front.

use super::answered::Answered;
use super::extras::{Extras, publish};
use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::figure;
use crate::app::theme::Tokens;
use crate::app::widgets::{Mark, Named as _, value_row};
use crate::explore::{IdleCores, Noise, Observability, observability};
use crate::geometry::add;
use crate::session::Session;
use crate::task::Progress;
use egui::{RichText, Role, Sense, Ui};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Known",
    title: "Radar knows",
    icon: &[
        Mark::Line(&[
            [1.5, 8.0],
            [3.5, 5.0],
            [8.0, 3.5],
            [12.5, 5.0],
            [14.5, 8.0],
            [12.5, 11.0],
            [8.0, 12.5],
            [3.5, 11.0],
            [1.5, 8.0],
        ]),
        Mark::Line(&[[5.5, 8.0], [8.0, 6.5], [10.5, 8.0], [8.0, 9.5], [5.5, 8.0]]),
    ],
    help: "what the echo fixes of the pose, and what only the prior does",
    dock: Dock::BottomHigh,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| toolbar(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// What a person chooses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Choice {
    /// Noise below the largest cell, dB; as measured without.
    snr_db: Option<f64>,
    /// How much larger than they are the ellipsoids of refits are drawn.
    magnified: f64,
    /// The direction whose arrows are drawn.
    direction: usize,
}

impl Default for Choice {
    fn default() -> Self {
        Self { snr_db: None, magnified: 5.0, direction: 0 }
    }
}

#[derive(Default)]
struct State {
    choice: Choice,
    /// Asked with the noise.
    known: Answered<Option<f64>, Observability>,
    drawn: Option<(Choice, bool, Arc<Extras>)>,
}

impl PaneState for State {
    fn is_working(&self) -> bool {
        self.known.is_working()
    }

    fn stored_as(&self) -> Option<&'static str> {
        Some("known")
    }

    fn stored(&self) -> serde_json::Result<Value> {
        serde_json::to_value(&self.choice)
    }

    fn restore(&mut self, stored: Value, _: &Session) -> serde_json::Result<()> {
        self.choice = serde_json::from_value::<Option<Choice>>(stored)?.unwrap_or_default();
        Ok(())
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Once a frame has joints, this tells what of their pose the echo fixes.";
    (session.fit.shown.is_none() || session.fit.problem.is_none()).then(|| Blank::new("No fit", how))
}

fn toolbar(ui: &mut Ui, shared: &Shared<'_>, state: &mut State) {
    let tokens = Tokens::of(ui);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let measured = state.choice.snr_db.is_none();
        let tip = "As strong as the lowest cells of each map say.";
        if ui.selectable_label(measured, "Measured noise").on_hover_text(tip).clicked() {
            state.choice.snr_db = None;
        }
        if ui.selectable_label(!measured, "SNR").on_hover_text("Noise so many dB below the largest cell.").clicked() {
            state.choice.snr_db.get_or_insert(40.0);
        }
        if let Some(snr) = &mut state.choice.snr_db {
            let drag = egui::DragValue::new(snr).range(0.0..=80.0).speed(0.5).max_decimals(0).suffix(" dB");
            ui.add(drag).named(Role::SpinButton, "SNR value");
        }
        ui.separator();
        ui.label(RichText::new("refits drawn ×").small().color(tokens.dim));
        let drag = egui::DragValue::new(&mut state.choice.magnified).range(1.0..=50.0).speed(0.1).max_decimals(0);
        ui.add(drag).named(Role::SpinButton, "Magnification").on_hover_text(
            "How much larger than they are the ellipsoids of refits are drawn; those of the echo alone are to scale.",
        );
        if state.known.is_working() {
            ui.spinner();
            ui.label(RichText::new("differences of the gradient …").small().color(tokens.dim));
        } else if shared.session.fit.is_running() {
            ui.label(RichText::new("of the last pause").small().color(tokens.dim));
        }
    });
}

fn follow(ui: &Ui, session: &Session, state: &mut State) {
    if state.known.poll() {
        state.drawn = None;
    }
    let snr_db = state.choice.snr_db;
    state.known.ask((ui, session), snr_db, "observability", |_| {
        let (state, noise) = (session.explored_state().ok()?, snr_db.map_or(Noise::Measured, Noise::SnrDb));
        Some(move |with: (&IdleCores, &Progress)| observability(&state, noise, with))
    });
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    follow(ui, shared.session, state);
    let tokens = Tokens::of(ui);
    let caption = figure::of(shared.session, "what the echo fixes and what the prior does");
    let area = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    ui.interact(area, ui.scope_id().with("known"), Sense::hover())
        .widget_info(|| figure::spoken("What the radar knows", caption.as_deref()));
    let known = match state.known.last() {
        None => {
            ui.label(RichText::new("Differences of the gradient …").small().color(tokens.dim));
            return;
        }
        Some(Err(why)) => {
            ui.label(RichText::new(why).small().color(tokens.bad));
            return;
        }
        Some(Ok(known)) => known,
    };
    let left = (0.34 * area.width()).clamp(190.0, 300.0);
    let (numbers, list) = area.split_left_right_at_x(area.min.x + left);
    ui.scope_builder(egui::UiBuilder::new().max_rect(numbers.with_max_x(numbers.max.x - 8.0)), |ui| {
        egui::ScrollArea::vertical().id_salt("known numbers").auto_shrink(false).min_scrolled_height(0.0).show(
            ui,
            |ui| {
                ui.spacing_mut().item_spacing.y = 1.0;
                table(ui, known);
            },
        );
    });
    let mut chosen = state.choice.direction;
    ui.scope_builder(egui::UiBuilder::new().max_rect(list), |ui| {
        ui.label(RichText::new("Least observable, widest first").small().color(tokens.dim));
        egui::ScrollArea::vertical().id_salt("directions").auto_shrink(false).min_scrolled_height(0.0).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for (k, of) in known.unseen.iter().enumerate() {
                let on = k == chosen;
                let text = format!("{}  ±{:.0} mm", of.name, of.spread_mm);
                let told = format!(
                    "±{:.1} mm at one standard deviation; the echo is {:.0} % of what fixes it; likeness to its name {:.2}",
                    of.spread_mm,
                    100.0 * of.echo_share,
                    of.likeness
                );
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(egui::vec2(44.0, 8.0), Sense::hover());
                    ui.painter().rect_filled(rect, 1.0, tokens.stroke);
                    let echo = egui::Rect::from_min_size(rect.min, egui::vec2(44.0 * of.echo_share as f32, 8.0));
                    ui.painter().rect_filled(echo, 1.0, tokens.accent);
                    let row = ui.selectable_label(on, RichText::new(text).small());
                    row.widget_info(|| {
                        let mut info = egui::WidgetInfo::selected(Role::Button, true, on, format!("Direction {}", of.name));
                        info.current_text_value = Some(told.clone());
                        info
                    });
                    if row.on_hover_text(format!("{told}.\nClick to see its arrows in 3-D.")).clicked() {
                        chosen = k;
                    }
                });
            }
        });
    });
    state.choice.direction = chosen;
    let same = state.drawn.as_ref().is_some_and(|(choice, dark, _)| *choice == state.choice && *dark == tokens.dark);
    if !same {
        state.drawn = Some((state.choice.clone(), tokens.dark, Arc::new(drawn(known, &state.choice, &tokens))));
    }
    if let Some((.., extras)) = &state.drawn {
        publish(ui.ctx(), "known", Arc::clone(extras));
    }
}

fn table(ui: &mut Ui, known: &Observability) {
    let number = |x: f64| if x.is_finite() { format!("{x:.1e}") } else { "∞".into() };
    value_row(ui, "Directions the echo fixes", &format!("{:.1} of {:.0}", known.fixed[0], known.fixed[1]), "")
        .on_hover_text("tr((A + B)⁻¹ A): A the Gauss-Newton matrix of the maps' term in the joints' positions, B that of all others.");
    value_row(ui, "Condition, echo", &number(known.condition[0]), "")
        .on_hover_text("Largest over smallest eigenvalue of A alone.");
    value_row(ui, "Condition, with prior", &number(known.condition[1]), "")
        .on_hover_text("Largest over smallest eigenvalue of A + B.");
    value_row(ui, "Refits spread", &format!("{:.1}", known.spread_mm[0]), "mm")
        .on_hover_text("Root mean square over the joints of how far fits of maps with other noise end.");
    value_row(ui, "Open by the echo", &format!("{:.0}", known.spread_mm[1]), "mm")
        .on_hover_text("The same where only the echo holds the joints, and nothing beyond half a metre.");
    let noise: Vec<String> = known.noise.iter().map(|of| format!("{:.0}", 20.0 * of.max(1e-12).log10())).collect();
    value_row(ui, "Noise re max", &noise.join(" ").replace('-', "−"), "dB")
        .on_hover_text("Of each map, below its largest cell in the EM region.");
}

/// Outer ellipsoids of the echo alone, inner ones of refits, arrows of the chosen direction.
fn drawn(known: &Observability, choice: &Choice, tokens: &Tokens) -> Extras {
    let mut extras = Extras::default();
    for (joint, at) in known.positions.iter().enumerate() {
        extras.ellipsoid(*at, &known.echo[joint], 1.0, tokens.dim.gamma_multiply(0.6), 0.8);
        extras.ellipsoid(*at, &known.refits[joint], choice.magnified, tokens.accent, 1.2);
    }
    if let Some(of) = known.unseen.get(choice.direction) {
        // As long as they can be read: the longest way of a joint is a fifth of a metre at least.
        let longest = of.displacement.iter().map(|d| crate::geometry::norm(*d)).fold(0.0, f64::max);
        let stretch = if longest > 0.0 { (0.2 / longest).max(1.0) } else { 0.0 };
        for (at, by) in known.positions.iter().zip(&of.displacement) {
            let by = by.map(|x| stretch * x);
            extras.arrows.push(([*at, add(*at, by)], tokens.warn));
        }
        if let Some(first) = known.positions.first() {
            let above = add(*first, [0.0, 0.0, 0.35]);
            extras.labels.push((above, of.name.clone(), tokens.warn));
        }
    }
    extras
}
