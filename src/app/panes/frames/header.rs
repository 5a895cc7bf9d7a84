//! Over the rows: the filter, kept views, what is found, how far the grading is, and the columns' titles.

use super::columns::{Column, columns};
use super::{GAP, ROW, State};
use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Named as _, WorkAsked, fitting, work};
use crate::session::{Command, ComparedNumber, ResultSide, Sort, SortKey, StrataStatus, syntax};
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Align2, RichText, Role, Sense, Ui, pos2, vec2};
use std::collections::BTreeSet;

pub(super) fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let tokens = &Tokens::of(ui);
    filter(ui, shared, state, tokens);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 5.0;
        quick(ui, shared, state);
        views(ui, shared, state);
        column_menu(ui, shared);
        compared(ui, shared, tokens);
        fit_listed(ui, shared);
    });
    grading(ui, shared, tokens);
    batch(ui, shared, tokens);
    found(ui, shared, tokens);
}

/// What the empty filter says, where there is room for it.
const HINTS: [&str; 3] = ["Filter: stratum:hard iou<0.5 -tag:F1", "Filter: stratum:hard iou<0.5", "Filter frames"];

fn filter(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, tokens: &Tokens) {
    let session = shared.session;
    let mut text = state.filter.clone().unwrap_or_else(|| session.queue.text.clone());
    let wrong = session.queue.error.clone();
    let field = egui::TextEdit::singleline(&mut text)
        .hint_text(fitting(ui, &HINTS, theme::BODY))
        .text_color_opt(wrong.is_some().then_some(tokens.bad))
        .desired_width(ui.available_width() - 8.0);
    let response = ui.add(field).named(Role::TextInput, "Filter frames");
    if std::mem::take(&mut state.focus_filter) {
        response.request_focus();
    }
    if response.changed() {
        shared.send(Command::SetFilter(text.clone()));
    }
    state.filter = response.has_focus().then_some(text);
    response.on_hover_text(syntax());
    if let Some(wrong) = wrong {
        ui.label(RichText::new(wrong).small().color(tokens.bad));
    }
}

/// The filters that are wanted most, one click each; again to take them away.
fn quick(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    for (name, term, tip) in [
        ("Hard", "stratum:hard", "Only frames of the hard stratum."),
        ("Untagged", "tag:none", "Only frames without a tag."),
        ("Fitted", "fitted:yes", "Only frames with a fit."),
    ] {
        let text = &shared.session.queue.text;
        let on = text.split_whitespace().any(|part| part == term);
        let button = ui.selectable_label(on, RichText::new(name).small());
        if button.on_hover_text(format!("{tip}\nFilter: {term}")).clicked() {
            let mut parts: Vec<&str> = text.split_whitespace().filter(|part| *part != term).collect();
            if !on {
                parts.push(term);
            }
            let text = parts.join(" ");
            state.filter = None;
            shared.send(Command::SetFilter(text));
        }
    }
}

/// A menu that stays open while something in it is typed or ticked.
fn staying(title: &str) -> MenuButton<'_> {
    let config = MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    MenuButton::new(RichText::new(title).small()).config(config)
}

fn views(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let (button, _) = staying("Views").ui(ui, |ui| {
        ui.set_min_width(220.0);
        let kept = shared.session.view.saved_views.clone();
        if kept.is_empty() {
            ui.label(RichText::new("A view keeps a filter and an order under a name.").small());
        }
        for view in kept {
            ui.horizontal(|ui| {
                if ui.button(&view.name).on_hover_text(format!("Filter: {}", view.filter)).clicked() {
                    state.filter = None;
                    shared.send(Command::UseView(view.name.clone()));
                    ui.close();
                }
                let remove = ui.small_button("✕").named(Role::Button, &format!("Remove view {}", view.name));
                if remove.clicked() {
                    shared.send(Command::RemoveView(view.name.clone()));
                }
            });
        }
        ui.separator();
        ui.horizontal(|ui| {
            let field = egui::TextEdit::singleline(&mut state.view_name).hint_text("Name").desired_width(140.0);
            ui.add(field).named(Role::TextInput, "Name of the view");
            let ready = !state.view_name.trim().is_empty() && shared.session.queue.error.is_none();
            let keep = ui.add_enabled(ready, egui::Button::new("Keep"));
            if keep.on_hover_text("Keep the filter and the order as they are now.").clicked() {
                shared.send(Command::SaveView(std::mem::take(&mut state.view_name)));
                ui.close();
            }
        });
    });
    button.on_hover_text("Kept filters. It is the rule that is kept, not the frames it found.");
}

fn column_menu(ui: &mut Ui, shared: &mut Shared<'_>) {
    let (button, _) = staying("Columns").ui(ui, |ui| {
        let may_lack = |column: &Column| matches!(column.sort, SortKey::Source(..) | SortKey::Origin(_));
        let session = shared.session;
        let offered = |column: &&Column| column.key != "frame" && (!may_lack(column) || column.has_any(session));
        for column in columns().filter(offered) {
            let mut on = column.is_shown(&shared.session.view);
            if ui.checkbox(&mut on, column.name_in(shared.session)).on_hover_text(column.tip).changed() {
                shared.set_view(|view| column.show(view, on));
            }
        }
    });
    button.on_hover_text("Which columns the list has.");
}

/// Two sets of results: what is kept as which, by which number they are compared, and how they differ.
fn compared(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let (button, _) = staying("A | B").ui(ui, |ui| {
        ui.set_min_width(260.0);
        let session = shared.session;
        for side in ResultSide::ALL {
            let letter = side.letter();
            ui.horizontal(|ui| {
                ui.label(RichText::new(letter).strong());
                match session.results.get(side) {
                    Some(set) => {
                        let text = format!("{} frames, {}", set.len(), set.name);
                        let width = (ui.available_width() - 24.0).clamp(60.0, 260.0);
                        let label = egui::Label::new(RichText::new(&text).small()).truncate();
                        ui.add_sized([width, 18.0], label).on_hover_text(text);
                        let forget = ui.small_button("✕").named(Role::Button, &format!("Forget results {letter}"));
                        if forget.clicked() {
                            shared.send(Command::ForgetResults(side));
                        }
                    }
                    None => {
                        ui.label(RichText::new("nothing kept").small().color(tokens.dim));
                    }
                }
            });
            let keep =
                ui.add_enabled(!session.summaries.is_empty(), egui::Button::new(format!("Keep these as {letter}")));
            let tip = format!("What the list says now of its fits: {}.", session.results_name());
            if keep.on_hover_text(tip).clicked() {
                shared.send(Command::KeepResults(side));
            }
        }
        ui.separator();
        ui.horizontal(|ui| {
            ui.label(RichText::new("by").small());
            for number in ComparedNumber::ALL {
                if ui.selectable_label(session.view.compared == number, number.label()).clicked() {
                    shared.set_view(|view| view.compared = number);
                }
            }
        });
        let number = session.view.compared;
        let text = session.results.difference(number).map_or_else(
            || "Fit the list, keep it as A, change something, fit again, keep it as B.".to_owned(),
            |found| {
                let (mean, share) = (number.text(found.mean), 100 * found.better / found.frames);
                format!("B − A: {mean} on average; better on {share} % of {} frames", found.frames)
            },
        );
        ui.label(RichText::new(text).small().color(tokens.dim));
    });
    button.on_hover_text("Two sets of results beside each other: columns A, B and B − A.");
}

/// Progress of the grading, or how to begin it.
fn grading(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    match shared.session.strata.status.clone() {
        StrataStatus::Running { done, total } => {
            ui.horizontal(|ui| {
                let share = if total > 0 { done as f32 / total as f32 } else { 0.0 };
                let text = format!("grading {done} of {total}");
                let bar = egui::ProgressBar::new(share).desired_height(14.0).text(RichText::new(text).small());
                ui.add(bar.desired_width((ui.available_width() - 64.0).max(60.0)));
                let cancel = ui.small_button("Cancel").on_hover_text("Stop; what was read is kept for the next time.");
                if cancel.named(Role::Button, "Cancel grading").clicked() {
                    shared.send(Command::CancelStrata);
                }
            });
        }
        StrataStatus::Absent | StrataStatus::Failed(_) => {
            let frames = shared.session.data.len();
            let label = format!("Grade {frames} frames");
            let tip = "Read every frame and sort the data set into easy, medium and hard, without labels (in the \
                       background, on all cores). The result is kept.";
            if ui.small_button(label).on_hover_text(tip).clicked() {
                shared.send(Command::ComputeStrata);
            }
            if let StrataStatus::Failed(why) = &shared.session.strata.status {
                ui.label(RichText::new(why).small().color(tokens.bad));
            }
        }
        StrataStatus::Ready => {}
    }
}

/// Fits all that is listed, or what is selected of it.
fn fit_listed(ui: &mut Ui, shared: &mut Shared<'_>) {
    let session = shared.session;
    let selected = session.labels.selection.len();
    let (what, count) = if selected > 0 { ("selected", selected) } else { ("listed", session.queue.rows().len()) };
    let can = count > 0 && !session.batch.is_running();
    let text = if selected > 0 { "Fit selected" } else { "Fit listed" };
    let button = ui.add_enabled(can, egui::Button::new(RichText::new(text).small()));
    let tip = format!(
        "Fit the {count} {what} frame{} with the settings in force, on all cores. The results come into the list, and are kept \
         beside the labels: fits that are there already are taken as they are.\nKey: Ctrl+Enter",
        if count == 1 { "" } else { "s" }
    );
    if button.on_hover_text(tip).clicked() {
        shared.invoke("Fit listed frames");
    }
}

/// How far a batch is, or what its fits are of where they are not of the settings in force.
fn batch(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let batch = &shared.session.batch;
    match work(ui, &batch.work, "the batch") {
        Some(WorkAsked::Pause) => shared.send(Command::PauseBatch),
        Some(WorkAsked::Cancel) => shared.send(Command::CancelBatch),
        None => {}
    }
    let batch = &shared.session.batch;
    if batch.is_running() {
        return;
    }
    if let Some(stale) = batch.stale(&shared.session.config, shared.session.precision).filter(|_| batch.fitted() > 0) {
        let text = format!("results of {} frames are stale: {stale}", batch.fitted());
        let label = egui::Label::new(RichText::new(&text).small().color(tokens.warn)).truncate();
        ui.add(label).on_hover_text(format!("{text}.\n“Fit listed” fits with the settings in force."));
    }
}

/// How many frames there are, where the one on screen is among them, and what a tag would be for.
fn found(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let session = shared.session;
    let words = session.queue_words();
    let place = session
        .queue
        .position(session.data.frame_index)
        .map_or_else(String::new, |at| format!("{} of {}", at + 1, session.queue.rows().len()));
    ui.horizontal(|ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(RichText::new(place).font(theme::mono(theme::CAPTION)).color(tokens.dim));
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                let tip = "N and Shift+N go along this list; the arrow keys go along time, among the same frames.";
                let words = RichText::new(words).small().color(tokens.dim);
                ui.add(egui::Label::new(words).truncate()).on_hover_text(tip);
            });
        });
    });
    let selected = session.labels.selection.len();
    if selected > 0 {
        ui.horizontal(|ui| {
            let text = format!("{selected} selected: tags go to them");
            ui.label(RichText::new(text).small().color(tokens.accent));
            if ui.small_button("Clear").named(Role::Button, "Clear frame selection").clicked() {
                shared.send(Command::SelectFrames(BTreeSet::new()));
            }
        });
    }
}

/// The titles; a click sorts, another turns the order round.
pub(super) fn titles(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    columns: &[&Column],
    extent: &dyn Fn(&Column) -> f32,
    tokens: &Tokens,
) {
    let sort = shared.session.view.sort;
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    let mut x = rect.left() + 2.0;
    for column in columns {
        let width = extent(column);
        let at = egui::Rect::from_min_max(pos2(x, rect.top()), pos2(x + width, rect.bottom()));
        x += width + GAP;
        let active = sort.key == column.sort && (column.sort != SortKey::Index || column.key == "index");
        let id = ui.scope_id().with(("title", column.key));
        let response = ui.interact(at.expand2(vec2(GAP / 2.0, 0.0)), id, Sense::click());
        let name = format!("Sort by {}", column.name_in(shared.session));
        response.widget_info(|| egui::WidgetInfo::selected(Role::Button, true, active, &name));
        let color = if active || response.hovered() { tokens.text } else { tokens.dim };
        let mark = if active && sort != Sort::default() { if sort.descending { "▾" } else { "▴" } } else { "" };
        let (anchor, align) = if column.right {
            (pos2(at.right(), at.center().y), Align2::RIGHT_CENTER)
        } else {
            (pos2(at.left(), at.center().y), Align2::LEFT_CENTER)
        };
        let font = egui::FontId::proportional(theme::CAPTION);
        let painter = ui.painter().with_clip_rect(at.expand2(vec2(GAP, 0.0)).intersect(ui.clip_rect()));
        painter.text(anchor, align, format!("{}{mark}", column.title_in(shared.session)), font, color);
        if response.on_hover_text(format!("{}\nClick to sort, again to turn the order round.", column.tip)).clicked() {
            let descending = if sort.key == column.sort { !sort.descending } else { false };
            shared.send(Command::SetSort(Sort { key: column.sort, descending }));
        }
    }
    ui.painter().hline(rect.x_range(), rect.bottom(), egui::Stroke::new(1.0, tokens.stroke));
}
