//! The loss landscape: L and its terms along a direction from the state on screen, or over two, with the way of the fit.

mod choose;
mod marks;
mod picture;

use super::explore::{begin_branch, keep_up, needs_fit};
use super::{Blank, Dock, MovedBody, Pane, PaneStates, Shared};
use crate::app::figure;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _, value_row};
use crate::explore::{ExplorationKind, LossSlice, SampleAxis};
use crate::mhp::TermId;
use crate::session::Session;
use egui::{RichText, Role, Sense, Ui};
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Landscape",
    title: "Loss landscape",
    icon: &[
        Mark::Line(&[[1.5, 3.0], [4.0, 11.0], [6.5, 6.5], [10.0, 13.0], [14.5, 2.0]]),
        Mark::Dot([10.0, 13.0], 1.8),
    ],
    help: "slices of L and its terms around the state on screen, with the way of the fit",
    dock: Dock::BottomTall,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<()>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, _| show(ui, shared),
};

/// Width of the numbers beside the picture, points, and where there is much room.
const NUMBERS: f32 = 200.0;
const WIDEST_NUMBERS: f32 = 300.0;
/// Evaluations of a slice along one direction, and over two.
const EVALUATIONS: [f64; 2] = [241.0, 6561.0];

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a frame: the loss is drawn along directions from the state on screen.";
    needs_fit(session).then(|| Blank::new("No loss to cut", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>) {
    ui.horizontal_wrapped(|ui| {
        choose::show(ui, shared);
        let session = shared.session;
        if let Err(why) = session.exploration(ExplorationKind::Landscape) {
            ui.label(RichText::new(why).small().color(Tokens::of(ui).warn));
            return;
        }
        let count = EVALUATIONS[usize::from(session.view.explore.landscape.and.is_some())];
        let cost = session.fit.problem.as_ref().map(|_| session.fit.step_ms * count);
        keep_up(ui, shared, ExplorationKind::Landscape, cost);
    });
}

/// The term that is drawn over two directions; `None` for L.
fn term(session: &Session) -> Option<TermId> {
    TermId::of(&session.view.explore.landscape.shown)
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>) {
    let session = shared.session;
    let Some(slice) = session.explore.landscape(session.fit.frame).cloned() else { return };
    let tokens = Tokens::of(ui);
    let names: Vec<&str> = slice.axes.iter().map(|axis| axis.name.as_str()).collect();
    let of = if slice.axes.len() > 1 { term(session).map_or("L", |term| term.label) } else { "L and its terms" };
    let title = format!("Loss landscape of {of} over {}", names.join(" and "));
    let caption = figure::of(session, &title);
    let rect = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    if rect.width() < 160.0 || rect.height() < 60.0 {
        return;
    }
    let beside = if rect.width() > 460.0 { (0.2 * rect.width()).clamp(NUMBERS, WIDEST_NUMBERS) } else { 0.0 };
    let picture = rect.with_max_x(rect.max.x - beside);
    let response = ui.interact(picture, ui.scope_id().with("landscape"), Sense::click());
    let marks = marks::of(session, &slice);
    let drawn = picture::draw(ui, session, &slice, &marks, picture, &tokens);
    let pointer = ui.input(|i| i.pointer.latest_pos()).filter(|_| response.hovered());
    let on = pointer.and_then(|at| drawn.as_ref()?.cell(at));
    let at: Option<Vec<f64>> = on.map(|cell| slice.axes.iter().zip(cell).map(|(axis, k)| axis.at(k as f64)).collect());
    let told = on
        .zip(at.as_ref())
        .and_then(|(cell, at)| Some(format!("{}: L {:.4}", place(&slice, at), slice.value(cell, None)?)));
    let text = told.as_deref().or(caption.as_deref());
    response.widget_info(|| figure::spoken(&title, text));
    shared.points.moved = at.as_ref().map(|at| MovedBody::Slice([at[0], at.get(1).copied().unwrap_or(0.0)]));
    if response.on_hover_cursor(egui::CursorIcon::Crosshair).clicked()
        && let Some(at) = &at
    {
        begin_at(shared, &slice, at);
    }
    if beside > 0.0 {
        let column = rect.with_min_x(rect.max.x - beside + 12.0);
        let mut ui = ui.new_child(
            egui::UiBuilder::new().id_salt("column").max_rect(column).layout(egui::Layout::top_down(egui::Align::Min)),
        );
        egui::ScrollArea::vertical().id_salt("slice numbers").auto_shrink(false).show(&mut ui, |ui| {
            numbers(ui, shared, &slice, on, &marks, &tokens);
        });
    }
}

/// A value on an axis of the slice, without its unit.
fn coordinate(axis: &SampleAxis, value: f64) -> String {
    let digits = if axis.unit == "°" { 0 } else { 2 };
    super::explore::signed(format!("{value:+.digits$}"))
}

/// A place on the slice in words.
fn place(slice: &LossSlice, at: &[f64]) -> String {
    let named =
        slice.axes.iter().zip(at).map(|(axis, value)| {
            format!("{} {} {}", axis.name, coordinate(axis, *value), axis.unit).trim_end().to_owned()
        });
    named.collect::<Vec<_>>().join(", ")
}

/// The same beside the picture, whose axes have the names.
fn brief(slice: &LossSlice, at: &[f64]) -> String {
    let numbers = slice.axes.iter().zip(at).map(|(axis, value)| coordinate(axis, *value));
    numbers.collect::<Vec<_>>().join(", ")
}

/// A branch that begins with the body there.
fn begin_at(shared: &mut Shared<'_>, slice: &LossSlice, at: &[f64]) {
    let session = shared.session;
    let Some(problem) = &session.fit.problem else { return };
    let start = Arc::new(slice.params_at(&problem.skeleton, at));
    begin_branch(shared, start, session.fit.around(), format!("from {}", place(slice, at)));
}

/// What is under the pointer, the minima, and what the marks are.
fn numbers(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    slice: &LossSlice,
    on: Option<[usize; 2]>,
    marks: &marks::Marks,
    tokens: &Tokens,
) {
    ui.spacing_mut().item_spacing.y = 1.0;
    let dim = |text: &str| RichText::new(text).small().color(tokens.dim);
    if let Some(cell) = on {
        ui.label(dim("Under the pointer"));
        for (axis, k) in slice.axes.iter().zip(cell) {
            value_row(ui, &axis.name, &coordinate(axis, axis.at(k as f64)), axis.unit);
        }
        if let Some(loss) = slice.value(cell, None) {
            value_row(ui, "L", &format!("{loss:.4}"), "");
        }
        for id in picture::terms(slice) {
            if let Some(value) = slice.value(cell, Some(id)) {
                value_row(ui, id.label, &format!("{:.4}", value * id.weight.of(&slice.config)), "");
            }
        }
        ui.add_space(4.0);
    }
    let shown = if slice.axes.len() > 1 { term(shared.session) } else { None };
    ui.label(dim(&format!("Minima of {}", shown.map_or("L", |term| term.label))));
    let found = slice.minima(shown);
    if found.is_empty() {
        ui.label(dim("none yet"));
    }
    for (k, minimum) in found.iter().enumerate() {
        let at: Vec<f64> = slice.axes.iter().zip(minimum.cell).map(|(axis, k)| axis.at(k as f64)).collect();
        let text = format!("{} {:.4}  {}", k + 1, minimum.value, brief(slice, &at));
        let link = ui.link(RichText::new(text).font(theme::mono(theme::CAPTION)));
        let link = link.named(Role::Link, &format!("Minimum {} at {}", k + 1, place(slice, &at)));
        if link.hovered() {
            shared.points.moved = Some(MovedBody::Slice([at[0], at.get(1).copied().unwrap_or(0.0)]));
        }
        if link.on_hover_text(format!("{:.4} deep. Click to begin a branch there.", minimum.depth)).clicked() {
            begin_at(shared, slice, &at);
        }
    }
    ui.add_space(4.0);
    for mark in &marks.places {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.label(RichText::new(mark.sign).color(mark.color(tokens)));
            ui.label(dim(&format!("{}  {}", mark.name, brief(slice, &mark.at))));
        });
    }
}
