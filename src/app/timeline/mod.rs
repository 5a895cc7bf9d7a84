//! The bottom strip: frames coloured by stratum, IoU or tags with their transport, and the iterations with theirs.

mod strip;

use super::commands::{UserCommand, command};
use super::panes::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Named as _, icon_button};
use crate::session::{Command, TimelineStrip};
use egui::{Rect, RichText, Sense, Stroke, Ui, pos2, vec2};

/// What the strip remembers.
#[derive(Default)]
pub(super) struct Timeline {
    drag_frame: Option<usize>,
    strip: strip::Strips,
}

/// Draws the strip at the bottom of the window.
pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut Timeline) {
    let tokens = Tokens::of(ui);
    let frame = egui::Frame::new().fill(tokens.panel).inner_margin(egui::Margin::symmetric(8, 3));
    egui::Panel::bottom("timeline").exact_size(60.0).frame(frame).show(ui, |ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        ui.horizontal(|ui| frames(ui, shared, state, &tokens));
        ui.horizontal(|ui| iterations(ui, shared, &tokens));
    });
}

/// Width of the caption before each strip, so that both strips begin at the same place.
const CAPTION: f32 = 70.0;
/// Width of the numbers behind each strip.
const NUMBERS: f32 = 118.0;

/// Half of the width of the handle on the strip of iterations.
const HANDLE: f32 = 5.0;
/// What runs a fit: ▶ plays the frames, this goes down the gradient.
const RUN_FIT: &str = "∂ Fit";
/// What pauses it.
const PAUSE_FIT: &str = "‖ Fit";

/// As wide as two buttons, so that both strips begin at the same place.
fn run_button(ui: &mut Ui, text: &str, name: &str, tip: &str, enabled: bool, running: bool) -> egui::Response {
    let mut button = egui::Button::new(RichText::new(text).font(theme::mono(12.0))).min_size(vec2(64.0, 22.0));
    if running {
        button = button.fill(Tokens::of(ui).accent.gamma_multiply(0.35));
    }
    let response = ui.add_enabled(enabled, button).named(egui::Role::Button, name);
    response.on_hover_text(tip).on_disabled_hover_text(tip)
}

fn caption(ui: &mut Ui, text: &str) {
    ui.allocate_ui_with_layout(vec2(CAPTION, 22.0), egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.set_min_width(CAPTION);
        ui.label(RichText::new(text).small());
    });
}

/// What the strip shows, in the place of its caption.
fn choose_strip(ui: &mut Ui, shared: &mut Shared<'_>) {
    let names = [
        (TimelineStrip::Stratum, "Stratum"),
        (TimelineStrip::Iou, "IoU"),
        (TimelineStrip::Tags, "Tags"),
        (TimelineStrip::Disagreement, "Disagree"),
        (TimelineStrip::PredictionError, "Pred. mm"),
    ];
    let now = shared.session.view.strip;
    ui.allocate_ui_with_layout(vec2(CAPTION, 22.0), egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.set_min_width(CAPTION);
        let name = names.iter().find(|(strip, _)| *strip == now).map_or("", |(_, name)| *name);
        let button = ui.menu_button(RichText::new(format!("{name} ▾")).small(), |ui| {
            for (strip, name) in names {
                if ui.selectable_label(strip == now, name).clicked() {
                    shared.set_view(|view| view.strip = strip);
                    ui.close();
                }
            }
        });
        let tip = "What the strip over all frames shows: bars for stratum or IoU, marks for tags, or how far \
                   the predictions of others are from the fits or from the truth (the whole height is 300 mm).";
        button.response.named(egui::Role::Button, "Strip shows").on_hover_text(tip);
    });
}

fn frames(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut Timeline, tokens: &Tokens) {
    let (count, index, playing) = {
        let data = &shared.session.data;
        (data.len(), data.frame_index, data.playing)
    };
    choose_strip(ui, shared);
    let many = count > 1;
    for (sign, name, label, enabled) in [
        ("|◂", "First frame", "First frame", index > 0),
        ("◂", "Previous frame", "Previous frame", index > 0),
        (if playing { "‖" } else { "▶" }, if playing { "Stop playing" } else { "Play frames" }, "Play frames", many),
        ("▸", "Next frame", "Next frame", index + 1 < count),
        ("▸|", "Last frame", "Last frame", index + 1 < count),
    ] {
        let tip = command(label).map(UserCommand::tip).unwrap_or_default();
        if icon_button(ui, sign, name, &tip, enabled, playing && label == "Play frames").clicked() {
            shared.invoke(label);
        }
    }
    let (rect, response) =
        ui.allocate_exact_size(vec2((ui.available_width() - NUMBERS - 4.0).max(40.0), 22.0), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::slider(many, index as f64, "Timeline"));
    ui.painter().rect_filled(rect, 2.0, tokens.canvas);
    if count > 0 {
        state.strip.paint(ui, shared.session, rect, tokens);
        let at = |x: f32| (((x - rect.left()) / rect.width() * count as f32).floor().max(0.0) as usize).min(count - 1);
        if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged() || response.clicked()) {
            let wanted = at(pointer.x);
            if state.drag_frame != Some(wanted) {
                state.drag_frame = Some(wanted);
                shared.send(Command::GotoFrame(wanted));
            }
        } else {
            state.drag_frame = None;
        }
        let x = rect.left() + (index as f32 + 0.5) / count as f32 * rect.width();
        ui.painter().vline(x, rect.y_range(), Stroke::new(2.0, tokens.accent));
        if let (Some(pointer), Some(dataset)) = (response.hover_pos(), &shared.session.data.dataset) {
            let i = at(pointer.x);
            let row = shared.session.frame_row(i);
            let stratum = row.stratum.map_or("not graded", |stratum| stratum.word());
            let iou = row.iou.map_or_else(|| "not fitted".into(), |x| format!("IoU {x:.3}"));
            let tags = if row.tags.is_empty() { "no tag".into() } else { row.tags.to_string() };
            response.on_hover_text_at_pointer(format!("{i} · {}\n{stratum} · {iou} · {tags}", dataset.frame_name(i)));
        }
    }
    ui.painter().rect_stroke(rect, 2.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Inside);
    let text = if count == 0 { "—".into() } else { format!("{} / {}", index, count - 1) };
    numbers(ui, &text, if shared.session.data.loading.is_some() { "reading…" } else { "" });
}

fn iterations(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let fit = &shared.session.fit;
    let (shown, head, running, ready, back) =
        (fit.shown_iteration(), fit.head(), fit.is_running(), fit.is_ready(), fit.cursor.is_some());
    let start = fit.branch().map_or(0, crate::session::Branch::start);
    // What was set before the branch on screen begins is not on its strip.
    let flags: Vec<_> = fit.history.flags().into_iter().filter(|(at, _)| (start..=head).contains(at)).collect();
    caption(ui, "Iteration");
    for (sign, name, label, enabled) in [
        ("−1", "Iteration back", "One step back", ready && shown > start),
        (if running { PAUSE_FIT } else { RUN_FIT }, "Run or pause fit", "Run or pause", ready),
        ("+1", "Iteration forward", "One step", ready && (back || !running)),
        ("⇥", "Follow newest", "Follow newest iteration", back),
    ] {
        let tip = command(label).map(UserCommand::tip).unwrap_or_default();
        let clicked = if label == "Run or pause" {
            run_button(ui, sign, name, &tip, enabled, running).clicked()
        } else {
            icon_button(ui, sign, name, &tip, enabled, false).clicked()
        };
        if clicked {
            shared.invoke(label);
        }
    }
    let (rect, response) =
        ui.allocate_exact_size(vec2((ui.available_width() - NUMBERS - 4.0).max(40.0), 22.0), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::slider(ready, shown as f64, "Iteration scrubber"));
    // The handle is whole at both ends, and nothing beside the strip is under it.
    let lane = rect.shrink2(vec2(HANDLE, 0.0));
    let track = Rect::from_center_size(rect.center(), vec2(rect.width(), 4.0));
    ui.painter().rect_filled(track, 2.0, tokens.stroke);
    let span = (head - start).max(1) as f32;
    let x_of = |k: usize| lane.left() + (k.saturating_sub(start)) as f32 / span * lane.width();
    let target = shared.session.config.iterations;
    if head > start {
        let done = Rect::from_min_max(track.min, pos2(x_of(shown), track.max.y));
        ui.painter().rect_filled(done, 2.0, tokens.accent.gamma_multiply(0.7));
        ui.painter().circle_filled(pos2(x_of(shown), rect.center().y), HANDLE, tokens.accent);
    }
    for (k, _) in &flags {
        ui.painter().vline(x_of(*k), rect.y_range(), Stroke::new(1.0, tokens.warn));
    }
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged() || response.clicked()) {
        let k = start + ((pointer.x - lane.left()) / lane.width() * span).round().max(0.0) as usize;
        if k.min(head) != shown {
            shared.send(Command::GotoIteration(k.min(head)));
        }
    }
    // The lines have no room for words: what changed is told where the pointer is.
    let pointer = response.hover_pos();
    let near = |k: usize| pointer.is_some_and(|pointer| (pointer.x - x_of(k)).abs() < HANDLE);
    let changed: Vec<String> =
        flags.iter().filter(|(k, _)| near(*k)).map(|(k, text)| format!("from iteration {k} on: {text}")).collect();
    let tip = "Drag to show an earlier iteration. Changing a setting there starts a branch.";
    response.on_hover_text(if changed.is_empty() { tip.to_owned() } else { changed.join("\n") });
    let side = if head < target && head > 0 { format!("of {target}") } else { String::new() };
    numbers(ui, &format!("{shown} / {head}"), &side);
}

fn numbers(ui: &mut Ui, text: &str, side: &str) {
    let tokens = Tokens::of(ui);
    ui.allocate_ui_with_layout(vec2(NUMBERS, 22.0), egui::Layout::right_to_left(egui::Align::Center), |ui| {
        ui.label(RichText::new(text).font(theme::mono(12.0)));
        // Never over the strip: what has no room is left out.
        let font = egui::FontId::proportional(theme::CAPTION);
        if ui.painter().layout_no_wrap(side.to_owned(), font, tokens.dim).size().x <= ui.available_width() {
            ui.label(RichText::new(side).small().color(tokens.dim));
        }
    });
}
