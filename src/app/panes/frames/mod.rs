//! The frame list: a filter, an order, and one row a frame; only the rows that are seen are drawn.

mod columns;
mod header;

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::{CTRL, CommandRow, Menu, UiAction, has_frame};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Mark;
use crate::session::{Command, Session};
use columns::{Column, cell, spoken};
use egui::{Key, RichText, Sense, Ui, pos2, vec2};
use std::collections::BTreeSet;

const ROW: f32 = 20.0;
/// Width of a digit of an index, points.
const DIGIT: f32 = 6.7;
const GAP: f32 = 4.0;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Frames",
    title: "Frames",
    icon: &[
        Mark::Bar([1.5, 2.5, 3.5, 4.5]),
        Mark::Bar([1.5, 7.0, 3.5, 9.0]),
        Mark::Bar([1.5, 11.5, 3.5, 13.5]),
        Mark::Line(&[[6.0, 3.5], [14.5, 3.5]]),
        Mark::Line(&[[6.0, 8.0], [14.5, 8.0]]),
        Mark::Line(&[[6.0, 12.5], [14.5, 12.5]]),
    ],
    help: "the list of frames, its filter and its order",
    dock: Dock::LeftTop,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| header::show(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Puts the text cursor into the filter.
pub(in crate::app) const FILTER: CommandRow = CommandRow {
    label: "Filter frames…",
    title: None,
    tooltip: "Type which frames are listed, for example stratum:hard iou<0.5 -tag:F1.",
    menu: Menu::Edit,
    keys: &[(CTRL, Key::F)],
    enabled: has_frame,
    act: |_| UiAction::panes(|states, _| states.of::<State>().focus_filter = true),
};

/// What the list remembers.
#[derive(Default)]
struct State {
    /// The filter while it is being typed.
    filter: Option<String>,
    /// Name of a view to be kept.
    view_name: String,
    focus_filter: bool,
    shown: Option<(usize, u64)>,
    /// Where a range of rows begins that Shift extends.
    anchor: Option<usize>,
}

impl PaneState for State {}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open one with Ctrl+O, or drop a folder on the window.";
    session.data.dataset.is_none().then(|| Blank::new("No data set", how))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    let columns: Vec<&Column> =
        columns::columns().filter(|column| column.is_shown(&session.view) && column.has_any(session)).collect();
    // As many digits as the last index has.
    let digits = session.data.len().saturating_sub(1).max(9).ilog10() as f32 + 1.0;
    let own = |column: &Column| if column.key == "index" { DIGIT * digits + 2.0 } else { column.width };
    let wanted: f32 = columns.iter().map(|column| own(column) + GAP).sum::<f32>() + 4.0;
    let width = wanted.max(ui.available_width());
    // The name takes what the numbers leave.
    let spare = width - wanted;
    let extent = |column: &Column| own(column) + if column.key == "frame" { spare } else { 0.0 };
    egui::ScrollArea::horizontal().auto_shrink(false).show(ui, |ui| {
        ui.set_min_width(width);
        header::titles(ui, shared, &columns, &extent, &tokens);
        rows(ui, shared, state, &columns, &extent, &tokens);
    });
}

fn rows(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    state: &mut State,
    columns: &[&Column],
    extent: &dyn Fn(&Column) -> f32,
    tokens: &Tokens,
) {
    let session = shared.session;
    let current = session.data.frame_index;
    let mut area = egui::ScrollArea::vertical().auto_shrink(false);
    let key = (current, session.queue.revision);
    if state.shown != Some(key) {
        // Another frame is brought into sight; a list that was made anew stays where it was scrolled to.
        let moved = state.shown.is_none_or(|(frame, _)| frame != current);
        state.shown = Some(key);
        if let Some(at) = session.queue.position(current).filter(|_| moved) {
            let height = ui.available_height();
            area = area.vertical_scroll_offset((at as f32 * ROW - height / 2.0).max(0.0));
        }
    }
    ui.spacing_mut().item_spacing.y = 0.0;
    let mut clicked = None;
    area.show_rows(ui, ROW, session.queue.rows().len(), |ui, range| {
        for &index in &session.queue.rows()[range] {
            if row(ui, session, index as usize, columns, extent, tokens) {
                clicked = Some(index as usize);
            }
        }
    });
    if session.queue.rows().is_empty() {
        ui.label(RichText::new("No frame matches the filter.").color(tokens.dim));
    }
    if let Some(index) = clicked {
        let (ctrl, shift) = ui.input(|i| (i.modifiers.command, i.modifiers.shift));
        click(shared, state, index, ctrl, shift);
    }
}

/// A click shows a frame; with Ctrl it joins or leaves the selection, with Shift the rows from the last click join it.
fn click(shared: &mut Shared<'_>, state: &mut State, index: usize, ctrl: bool, shift: bool) {
    let session = shared.session;
    let mut selection = session.labels.selection.clone();
    if shift {
        let anchor = state.anchor.unwrap_or(session.data.frame_index);
        let ends = (session.queue.position(anchor), session.queue.position(index));
        if let (Some(a), Some(b)) = ends {
            selection.extend(session.queue.rows()[a.min(b)..=a.max(b)].iter().map(|&row| row as usize));
            return shared.send(Command::SelectFrames(selection));
        }
    }
    state.anchor = Some(index);
    if ctrl {
        let on_screen = session.data.frame_index;
        if selection.is_empty() && session.queue.position(on_screen).is_some() {
            // The frame on screen is marked like a selected one, and is the first of them.
            selection.insert(on_screen);
        }
        if !selection.remove(&index) {
            selection.insert(index);
        }
        return shared.send(Command::SelectFrames(selection));
    }
    if !selection.is_empty() {
        shared.send(Command::SelectFrames(BTreeSet::new()));
    }
    shared.send(Command::GotoFrame(index));
}

fn row(
    ui: &mut Ui,
    session: &Session,
    index: usize,
    columns: &[&Column],
    extent: &dyn Fn(&Column) -> f32,
    tokens: &Tokens,
) -> bool {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let row = session.frame_row(index);
    let current = index == session.data.frame_index;
    let selected = session.labels.selection.contains(&index);
    response.widget_info(|| {
        let name = format!("Frame {}", row.name);
        let mut info = egui::WidgetInfo::selected(egui::Role::Button, true, current || selected, name);
        info.current_text_value = Some(spoken(&row));
        info
    });
    let painter = ui.painter();
    if current {
        painter.rect_filled(rect, 2.0, tokens.accent.gamma_multiply(0.3));
    } else if selected {
        painter.rect_filled(rect, 0.0, tokens.accent.gamma_multiply(0.14));
    } else if response.hovered() {
        painter.rect_filled(rect, 2.0, tokens.raised);
    }
    if selected {
        let bar = egui::Rect::from_min_size(rect.min, vec2(2.0, rect.height()));
        painter.rect_filled(bar, 0.0, tokens.accent);
    }
    let mut x = rect.left() + 2.0;
    for column in columns {
        let width = extent(column);
        let at = egui::Rect::from_min_max(pos2(x, rect.top()), pos2(x + width, rect.bottom()));
        cell(painter, at, column, &row, session.view.compared, tokens);
        x += width + GAP;
    }
    response.on_hover_ui(|ui| tooltip(ui, session, index)).clicked()
}

fn tooltip(ui: &mut Ui, session: &Session, index: usize) {
    let row = session.frame_row(index);
    ui.label(format!("{} · {}", row.sequence, row.name));
    if !row.origin.is_unknown() {
        ui.label(row.origin.to_string());
    }
    let number = |value: Option<f64>| value.map_or_else(|| "undefined".into(), |x| format!("{x:.3}"));
    if let Some(hardness) = row.hardness {
        let word = row.stratum.map_or("ungraded", |stratum| stratum.word());
        ui.label(format!("{word}, hardness {hardness:.3}"));
        let peaks = row.peak_density.map_or_else(|| "undefined".into(), |x| format!("{x:.5}"));
        let (stat, human) = (number(row.static_dominance), number(row.human_saliency));
        ui.label(format!("ρ_peak {peaks} · s_static {stat} · r_human {human}"));
    }
    if let (Some(n), Some(loss)) = (row.iterations, row.loss) {
        let word = if row.converged == Some(true) { "the paper's criterion holds" } else { "the criterion is open" };
        let majpe = row.majpe_mm.map_or_else(String::new, |mm| format!(" · MAJPE {mm:.1} mm"));
        ui.label(format!("{n} iterations · L {loss:.4} · {word}{majpe}"));
    }
    if !row.tags.is_empty() {
        ui.label(format!("{} by {}", row.tags, row.annotators.join(", ")));
    }
    if !row.note.is_empty() {
        ui.label(row.note);
    }
    let hint = "Click to show. Ctrl+click and Shift+click select frames to tag together.";
    ui.label(RichText::new(hint).font(egui::FontId::proportional(theme::CAPTION)).weak());
}
