//! Failure modes: the tags of a frame, its note, and the machine's evidence for each mode.

mod cards;
mod journal;

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::{CommandRow, Menu, NONE, UiAction, UserCommand, command, has_frame};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _, fitting};
use crate::dataset::Dataset;
use crate::labels::{CellRegion, Tag, Verdict};
use crate::radar::View;
use crate::session::{Command, LabelMode, Session};
use egui::{Key, RichText, Role, Ui, vec2};
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Modes",
    title: "Failure modes",
    icon: &[
        Mark::Line(&[[8.0, 1.5], [15.0, 14.0], [1.0, 14.0], [8.0, 1.5]]),
        Mark::Line(&[[8.0, 6.0], [8.0, 9.8]]),
        Mark::Dot([8.0, 11.8], 0.9),
    ],
    help: "a frame's tags and note, and the machine's evidence",
    dock: Dock::LeftBottom,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: None,
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Brings the pane to the front and puts the text cursor into the note.
pub(in crate::app) const WRITE_NOTE: CommandRow = CommandRow {
    label: "Write a note",
    title: None,
    tooltip: "Put the text cursor into the note of the frame.",
    menu: Menu::Labels,
    keys: &[(NONE, Key::M)],
    enabled: has_frame,
    act: |_| UiAction::in_front(&PANE, |states, _| states.of::<State>().focus_note = true),
};

/// What the pane remembers: fields while they are typed in.
#[derive(Default)]
struct State {
    /// What is being typed, and for which frames: the one on screen, the selection, and how often that changed.
    note: Option<(Arc<[u32]>, String)>,
    annotator: Option<String>,
    region: Option<(usize, String)>,
    focus_note: bool,
    /// The data set that this is typed for.
    of: Option<Arc<Dataset>>,
}

impl PaneState for State {}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a data set; tags, notes and the evidence for each mode appear here.";
    session.data.dataset.is_none().then(|| Blank::new("No frame to tag", how))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let tokens = Tokens::of(ui);
    let dataset = shared.session.data.dataset.as_ref();
    if state.of.as_ref().map(Arc::as_ptr) != dataset.map(Arc::as_ptr) {
        // The same numbers are other frames now.
        *state = State { of: dataset.cloned(), focus_note: state.focus_note, ..State::default() };
    }
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 6.0;
        journal::show(ui, shared, &mut state.annotator, &tokens);
        mode(ui, shared);
        targets(ui, shared, &tokens);
        match shared.session.view.label_mode {
            LabelMode::CountReview => verdicts(ui, shared, &tokens),
            LabelMode::Explore | LabelMode::Agreement => tags(ui, shared, &tokens),
        }
        note(ui, shared, state);
        details(ui, shared, state, &tokens);
        said(ui, shared.session, &tokens);
        cards::show(ui, shared, &tokens);
    });
}

fn mode(ui: &mut Ui, shared: &mut Shared<'_>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for mode in LabelMode::ALL {
            let on = shared.session.view.label_mode == mode;
            if ui.selectable_label(on, RichText::new(mode.title()).small()).on_hover_text(mode.words()).clicked() {
                shared.set_view(|view| view.label_mode = mode);
            }
        }
        if shared.session.view.label_mode == LabelMode::Agreement {
            let mut blind = shared.session.view.blind;
            let tip =
                "Hide the machine's evidence until you have tagged the frame, so that agreement with it is honest.";
            if ui.checkbox(&mut blind, RichText::new("blind").small()).on_hover_text(tip).changed() {
                shared.set_view(|view| view.blind = blind);
            }
        }
    });
}

/// What a tag would be given to.
fn targets(ui: &mut Ui, shared: &Shared<'_>, tokens: &Tokens) {
    let selected = shared.session.labels.selection.len();
    if selected > 0 {
        let text = format!("Tags go to {selected} selected frames (Esc clears the selection).");
        ui.label(RichText::new(text).small().color(tokens.accent));
    }
}

fn tags(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let common = shared.session.labels.common_tags(&shared.session.label_targets());
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(3.0, 4.0);
        ui.spacing_mut().button_padding.x = 3.0;
        for tag in Tag::ALL {
            tag_chip(ui, shared, tag, common.contains(tag), tokens);
        }
    });
}

/// A chip with the digit that toggles it.
fn tag_chip(ui: &mut Ui, shared: &mut Shared<'_>, tag: Tag, on: bool, tokens: &Tokens) {
    let color = tokens.tag(tag);
    let mut text = egui::text::LayoutJob::default();
    let part =
        |font, color| egui::TextFormat { font_id: font, color, valign: egui::Align::Center, ..Default::default() };
    let (digit, word) = if on { (tokens.canvas, tokens.canvas) } else { (tokens.dim, tokens.text) };
    text.append(&tag.digit().to_string(), 0.0, part(theme::mono(10.0), digit));
    text.append(tag.code(), 4.0, part(theme::strong(12.0), word));
    let button = egui::Button::new(text)
        .fill(if on { color } else { tokens.raised })
        .stroke(egui::Stroke::new(1.0, if on { color } else { tokens.stroke }))
        .min_size(vec2(36.0, 24.0));
    let response = ui.add(button);
    let name = format!("Tag {tag}");
    response.widget_info(|| egui::WidgetInfo::selected(Role::CheckBox, true, on, &name));
    let tip = format!("{}: {}.\nKey: {}", tag.code(), tag.words(), tag.digit());
    if response.on_hover_text(tip).clicked() {
        shared.send(Command::ToggleTag(tag));
    }
}

/// The second review protocol: whose count is wrong.
fn verdicts(ui: &mut Ui, shared: &mut Shared<'_>, tokens: &Tokens) {
    let session = shared.session;
    let annotated = session.data.frame.as_ref().and_then(|frame| frame.person_count);
    let fitted = session.fit.initial.as_ref().map(|initial| initial.shape().persons);
    let count = |n: Option<usize>| n.map_or_else(|| "unknown".into(), |n| n.to_string());
    let mismatch = matches!((annotated, fitted), (Some(a), Some(b)) if a != b);
    let words = format!("Annotated persons {} · fitted {}", count(annotated), count(fitted));
    ui.label(RichText::new(words).color(if mismatch { tokens.warn } else { tokens.text }));
    let now = session.labels.label(session.data.frame_index).verdict;
    for (digit, verdict) in ('6'..='9').zip(Verdict::ALL) {
        let on = now == Some(verdict);
        let text = format!("{digit}  {}", verdict.code().replace('-', " "));
        let response = ui.add(egui::Button::selectable(on, text).min_size(vec2(150.0, 22.0)));
        let name = format!("Verdict {verdict}");
        response.widget_info(|| egui::WidgetInfo::selected(Role::CheckBox, true, on, &name));
        if response.on_hover_text(format!("{}\nKey: {digit}", verdict.words())).clicked() {
            shared.send(Command::SetVerdict((!on).then_some(verdict)));
        }
    }
}

/// The note is written when the field is left; Escape takes back what was typed.
fn note(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let targets = session.label_targets();
    let note_of = |frames: &[u32]| frames.first().map_or_else(String::new, |&f| session.labels.label(f as usize).note);
    let stored = note_of(&targets);
    // What was being typed when the frame or the selection changed belongs to the frames that it was typed for.
    if let Some((frames, typed)) = state.note.take_if(|(frames, _)| *frames != targets)
        && typed != note_of(&frames)
    {
        shared.send(Command::SetNote(frames, typed));
    }
    let mut text = state.note.as_ref().map_or_else(|| stored.clone(), |(_, typed)| typed.clone());
    let field = egui::TextEdit::multiline(&mut text)
        .hint_text("Note: Enter keeps it, Esc drops it")
        .desired_rows(1)
        .return_key(Some(egui::KeyboardShortcut::new(egui::Modifiers::SHIFT, Key::Enter)))
        .desired_width(f32::INFINITY);
    let response = ui.add(field).named(Role::TextInput, "Note");
    if std::mem::take(&mut state.focus_note) {
        response.request_focus();
    }
    let escape = ui.input(|i| i.key_pressed(Key::Escape));
    let enter = response.has_focus() && ui.input(|i| i.key_pressed(Key::Enter) && !i.modifiers.shift);
    if enter {
        response.surrender_focus();
    }
    // A window that is closed takes what was typed along.
    let closing = state.note.is_some() && ui.input(|i| i.viewport().close_requested());
    if enter || closing || (response.lost_focus() && !escape) {
        if text != stored {
            shared.send(Command::SetNote(targets, text));
        }
        state.note = None;
    } else {
        state.note = response.has_focus().then_some((targets, text));
    }
    response.on_hover_text(
        "Free text, written when you leave the field or press Enter. Shift+Enter begins a line, Esc takes it back.",
    );
}

/// Person and region of the frame on screen.
fn details(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, tokens: &Tokens) {
    let label = shared.session.labels.label(shared.session.data.frame_index);
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new("Person").small().color(tokens.dim));
        let text = label.person.map_or_else(|| "any".to_owned(), |person| person.to_string());
        let menu = egui::ComboBox::from_id_salt("person").width(52.0).selected_text(text).show_ui(ui, |ui| {
            for (person, name) in
                std::iter::once((None, "any".to_owned())).chain((0..6).map(|n| (Some(n), n.to_string())))
            {
                if ui.selectable_label(label.person == person, name).clicked() {
                    shared.send(Command::SetPerson(person));
                }
            }
        });
        menu.response.named(Role::ComboBox, "Person").on_hover_text("The person that the tags are about, from 0.");
        let tip = command("Mark cells").map(UserCommand::tip).unwrap_or_default();
        if ui.small_button("Mark cells").on_hover_text(tip).clicked() {
            shared.invoke("Mark cells");
        }
        if let Some(region) = &label.region {
            if ui.small_button("Show").named(Role::Button, "Show marked cells").clicked() {
                shared.show_region(region);
            }
            if ui.small_button("✕").named(Role::Button, "Unmark cells").on_hover_text("Unmark the cells.").clicked() {
                shared.send(Command::SetRegion(shared.session.data.frame_index, None));
            }
        }
    });
    region(ui, shared, state, label.region.as_ref(), tokens);
}

/// The marked cells as text, which can be typed: without a mouse there is no other way.
fn region(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, known: Option<&CellRegion>, tokens: &Tokens) {
    let frame = shared.session.data.frame_index;
    let stored = known.map(ToString::to_string).unwrap_or_default();
    let views = shared.session.data.dataset.as_ref().map_or(&[][..], |dataset| &dataset.info().views[..]);
    let example = views.first().map_or_else(String::new, |view| format!("{}[10..=20, 30..=42]", view.array));
    let hints = [format!("cells, for example {example}"), format!("e.g. {example}"), "cells".to_owned()];
    let hint = fitting(ui, &hints, theme::CAPTION).to_owned();
    let read = |text: &str| if text.trim().is_empty() { Ok(None) } else { cells(text, views).map(Some) };
    // What was being typed when the frame changed belongs to the frame that it was typed for.
    if let Some((typed_for, typed)) = state.region.take_if(|(typed_for, _)| *typed_for != frame)
        && let Ok(region) = read(&typed)
    {
        shared.send(Command::SetRegion(typed_for, region));
    }
    let mut text = state.region.as_ref().map_or_else(|| stored.clone(), |(_, typed)| typed.clone());
    let field = egui::TextEdit::singleline(&mut text).hint_text(hint).font(egui::FontId::proportional(theme::CAPTION));
    let response = ui.add(field.desired_width(f32::INFINITY)).named(Role::TextInput, "Marked cells");
    let region = read(&text);
    if let Err(why) = &region
        && text != stored
    {
        ui.label(RichText::new(why).small().color(tokens.bad));
    }
    let escape = ui.input(|i| i.key_pressed(Key::Escape));
    if response.lost_focus() {
        state.region = None;
        if let (Ok(region), false) = (region, escape)
            && text != stored
        {
            shared.send(Command::SetRegion(frame, region));
        }
    } else {
        state.region = response.has_focus().then_some((frame, text));
    }
    response.on_hover_text(
        "The cells that your label is about: drag a box on a map (key G), or type them. Empty for none.",
    );
}

/// The cells that a text names, if one of the views has them.
fn cells(text: &str, views: &[View]) -> Result<CellRegion, String> {
    let region: CellRegion = text.parse()?;
    let view = views.iter().find(|view| view.array == region.view);
    let view = view.ok_or_else(|| format!("no view is called {}", region.view))?;
    let inside = region.lo.len() == view.axes.len()
        && view.axes.iter().zip(&region.hi).all(|(axis, &hi)| hi < axis.bins)
        && region.lo.iter().zip(&region.hi).all(|(lo, hi)| lo <= hi);
    if inside { Ok(region) } else { Err(format!("{} has {:?} cells", view.array, view.shape())) }
}

/// What was judged, and what others say.
fn said(ui: &mut Ui, session: &Session, tokens: &Tokens) {
    let frame = session.data.frame_index;
    if let Some(record) = session.labels.mine(frame)
        && let Some(text) = session.judged_elsewhere(record)
    {
        let tip = format!("{} at {} with version {}.", record.act, record.time, record.program);
        ui.label(RichText::new(format!("△ {text}")).small().color(tokens.warn)).on_hover_text(tip);
    }
    let others = session.labels.others(frame).count();
    if others == 0 {
        return;
    }
    if session.view.label_mode == LabelMode::Agreement {
        let text = format!("Labels of {others} other{} are hidden in this mode.", if others == 1 { "" } else { "s" });
        ui.label(RichText::new(text).small().color(tokens.dim));
        return;
    }
    for record in session.labels.others(frame) {
        let note = if record.label.note.is_empty() { String::new() } else { format!(" “{}”", record.label.note) };
        let verdict = record.label.verdict.map_or_else(String::new, |verdict| format!(" {verdict}"));
        let text = format!("{}: {}{verdict}{note}", record.annotator, record.label.tags);
        ui.label(RichText::new(text).small().color(tokens.dim))
            .on_hover_text(format!("{}, {}", record.act, record.time));
    }
}
