//! The tuning map: what the fit comes to under other settings, and from each cell the way to its fit.

mod axes;
mod numbers;
mod picture;

use super::explore::{keep_up, needs_fit, plane};
use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::figure;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::explore::{ExplorationKind, TunedFrames, TunedQuantity, TuningMap};
use crate::session::{AdoptedFit, Command, Session};
use egui::{RichText, Role, Sense, Ui, vec2};
use picture::Shape;
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Tuning",
    title: "Tuning map",
    icon: &[
        Mark::Bar([1.5, 1.5, 7.0, 7.0]),
        Mark::Box([9.0, 1.5, 14.5, 7.0]),
        Mark::Box([1.5, 9.0, 7.0, 14.5]),
        Mark::Bar([9.0, 9.0, 14.5, 14.5]),
    ],
    help: "what the fit comes to under other settings, live",
    dock: Dock::BottomTall,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| toolbar(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Width of the numbers beside the picture, points.
const NUMBERS: f32 = 196.0;
/// The least size of a small picture, points.
const SMALL: f32 = 84.0;
/// More frames than this have no picture each.
const MOST_SMALL: usize = 48;

/// What is typed, and what is under the finger.
#[derive(Default)]
struct State {
    typed: [Option<String>; 2],
    /// The point that the finger has taken last.
    held: Option<usize>,
}

impl PaneState for State {}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a frame: the map shows what its fit comes to under other values of one or two settings.";
    needs_fit(session).then(|| Blank::new("No fit to tune", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    ui.horizontal_wrapped(|ui| {
        axes::show(ui, shared, &mut state.typed);
        frames(ui, shared);
        quantity(ui, shared);
        keep(ui, shared);
    });
    let cost = cost_ms(shared.session);
    keep_up(ui, shared, ExplorationKind::Tuning, cost);
}

/// What all fits of the map take on one core, about, ms.
fn cost_ms(session: &Session) -> Option<f64> {
    let crate::explore::Exploration::Tuning(request) = session.exploration(ExplorationKind::Tuning).ok()? else {
        return None;
    };
    let fits = request.grid.iter().map(|axis| axis.values.len()).product::<usize>() * request.frames.len();
    Some(session.fit_ms()? * fits as f64)
}

fn frames(ui: &mut Ui, shared: &mut Shared<'_>) {
    let mut settings = shared.session.view.explore.tuning.clone();
    let before = settings.clone();
    let menu = egui::ComboBox::from_id_salt("tuned frames").width(104.0).selected_text(settings.frames.title());
    let response = menu.show_ui(ui, |ui| {
        for frames in TunedFrames::ALL {
            ui.selectable_value(&mut settings.frames, frames, frames.title());
        }
    });
    response.response.named(Role::ComboBox, "Frames of the tuning map").on_hover_text("Which frames are fitted.");
    if settings.frames != TunedFrames::Shown {
        let each = ui.checkbox(&mut settings.by_frame, "by frame");
        each.on_hover_text("A small picture a frame instead of the mean over them.");
    }
    if settings != before {
        shared.set_view(|view| view.explore.tuning = settings);
    }
}

fn quantity(ui: &mut Ui, shared: &mut Shared<'_>) {
    let mut chosen = shared.session.view.explore.tuning.quantity;
    let map = shared.session.explore.tuning().cloned();
    let known = |quantity: TunedQuantity| {
        map.as_ref().is_none_or(|map| (0..map.points()).any(|point| map.value(point, quantity).is_some()))
    };
    let menu = egui::ComboBox::from_id_salt("tuned quantity").width(96.0).selected_text(chosen.title());
    let response = menu.show_ui(ui, |ui| {
        for quantity in TunedQuantity::ALL {
            let label = egui::Button::selectable(chosen == quantity, quantity.title());
            let response = ui.add_enabled(known(quantity), label).on_hover_text(quantity.help());
            if response.on_disabled_hover_text("Not known of this frame.").clicked() {
                chosen = quantity;
            }
        }
    });
    response.response.named(Role::ComboBox, "Quantity of the tuning map").on_hover_text(chosen.help());
    if chosen != shared.session.view.explore.tuning.quantity {
        shared.set_view(|view| view.explore.tuning.quantity = chosen);
    }
}

fn keep(ui: &mut Ui, shared: &mut Shared<'_>) {
    let Some(map) = shared.session.explore.tuning().cloned() else { return };
    let quantity = shared.session.view.explore.tuning.quantity;
    let taken = map.best(quantity).filter(|_| shared.session.tuned_frame().is_some());
    let best = ui.add_enabled(taken.is_some(), egui::Button::new("Take best").small());
    let tip = "Take the best fit of the map as a branch.";
    if best.on_hover_text(tip).named(Role::Button, "Take the best of the tuning map").clicked()
        && let Some(point) = taken
    {
        adopt(shared, &map, point);
        shared.send(Command::EndDrag);
    }
    let idle = !shared.session.study.work.is_running();
    let button = ui.add_enabled(idle, egui::Button::new("Keep as study").small());
    let tip = "Write the run folder that a sweep of these values would write, beside the labels, and show it in the Study \
               pane. What is fitted is not fitted again.";
    if button.on_hover_text(tip).clicked() {
        shared.send(Command::KeepTuning);
    }
}

/// Takes a point's fit of the frame on screen in hand.
fn adopt(shared: &mut Shared<'_>, map: &TuningMap, point: usize) {
    let fit = shared.session.tuned_frame().and_then(|frame| map.fit(point, frame));
    let (Some(start), Some(variant)) = (fit.and_then(|fit| fit.start.clone()), map.variants.get(point)) else { return };
    shared.send(Command::DragFit(Box::new(AdoptedFit {
        around: Some(Arc::clone(&start)),
        start,
        erased: Arc::clone(&map.erased),
        config: variant.config,
        words: "of the tuning map".into(),
    })));
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let Some(map) = shared.session.explore.tuning().cloned() else { return };
    let tokens = Tokens::of(ui);
    let settings = shared.session.view.explore.tuning.clone();
    let quantity = settings.quantity;
    let names: Vec<&str> = map.grid.iter().map(|axis| axis.key.as_str()).collect();
    let of = match map.frames.len() {
        1 => shared
            .session
            .data
            .dataset
            .as_ref()
            .map_or_else(String::new, |d| d.frame_name(map.frames[0] as usize).to_owned()),
        n => format!("mean of {n} frames"),
    };
    let title = format!("Tuning map of {} over {}", quantity.title(), names.join(" and "));
    let caption = figure::of(shared.session, &format!("{title}, {of}, {} fits", map.done().1));
    let rect = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    if rect.width() < 160.0 || rect.height() < 60.0 {
        return;
    }
    let beside = if rect.width() > 460.0 { NUMBERS } else { 0.0 };
    let picture = rect.with_max_x(rect.max.x - beside);
    let mut hovered = None;
    if settings.by_frame && map.frames.len() > 1 {
        hovered = multiples(ui, shared, &map, quantity, picture, &tokens);
    } else {
        let response = ui.interact(picture, ui.scope_id().with("tuning"), Sense::click_and_drag());
        let shape = Shape::new(&map, None, quantity, picture);
        shape.draw(ui, shared.session, &tokens);
        let pointer = ui.input(|i| i.pointer.latest_pos()).filter(|_| response.hovered() || response.dragged());
        hovered = pointer.and_then(|at| shape.point(at)).map(|point| (point, None)).or(hovered);
        let told = hovered.map(|(point, _)| numbers::spoken(&map, point));
        let text = told.or_else(|| caption.clone());
        response.widget_info(|| figure::spoken(&title, text.as_deref()));
        let on_screen = shared.session.tuned_frame().is_some();
        take(shared, state, &map, &response, hovered.map(|(point, _)| point).filter(|_| on_screen));
        if on_screen {
            response.on_hover_cursor(egui::CursorIcon::Crosshair);
        }
    }
    if beside > 0.0 {
        let column = rect.with_min_x(rect.max.x - beside + 12.0);
        let mut ui = ui.new_child(
            egui::UiBuilder::new().id_salt("column").max_rect(column).layout(egui::Layout::top_down(egui::Align::Min)),
        );
        egui::ScrollArea::vertical().id_salt("numbers").auto_shrink(false).min_scrolled_height(0.0).show(
            &mut ui,
            |ui| {
                numbers::show(ui, shared.session, &map, quantity, hovered, &tokens);
            },
        );
    }
}

/// A finger on the map takes the fit of the cell that it is on; lifted, it is one act.
fn take(shared: &mut Shared<'_>, state: &mut State, map: &TuningMap, response: &egui::Response, point: Option<usize>) {
    let down = response.dragged() || response.clicked();
    if down && let Some(point) = point.filter(|point| state.held != Some(*point)) {
        state.held = Some(point);
        adopt(shared, map, point);
    }
    if (response.drag_stopped() || response.clicked()) && state.held.take().is_some() {
        shared.send(Command::EndDrag);
    }
}

/// A small picture a frame; answers what the pointer is on.
fn multiples(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    map: &Arc<TuningMap>,
    quantity: TunedQuantity,
    rect: egui::Rect,
    tokens: &Tokens,
) -> Option<(usize, Option<usize>)> {
    let shown = map.frames.len().min(MOST_SMALL);
    let columns = ((rect.width() / (SMALL * 1.3)) as usize).clamp(1, shown);
    let rows = shown.div_ceil(columns);
    let size = vec2(rect.width() / columns as f32, (rect.height() / rows as f32).max(SMALL));
    let limits =
        plane::limits((0..map.points()).flat_map(|point| map.fits_of(point)).filter_map(|fit| quantity.of(fit)));
    let mut hovered = None;
    let mut inner = ui.new_child(egui::UiBuilder::new().id_salt("small pictures").max_rect(rect));
    egui::ScrollArea::vertical().id_salt("small pictures").auto_shrink(false).show(&mut inner, |ui| {
        let (whole, _) = ui.allocate_exact_size(vec2(rect.width(), size.y * rows as f32), Sense::hover());
        for place in 0..shown {
            let corner = whole.min + vec2((place % columns) as f32 * size.x, (place / columns) as f32 * size.y);
            let cell = egui::Rect::from_min_size(corner, size).shrink(4.0);
            let index = map.frames[place] as usize;
            let name = shared.session.data.dataset.as_ref().map_or("", |dataset| dataset.frame_name(index));
            let response = ui.interact(cell, ui.scope_id().with(("tuned", place)), Sense::click());
            let response = response.named(Role::Button, &format!("Tuning map of frame {name}"));
            let shape = Shape::small(map, place, quantity, cell, limits);
            shape.draw(ui, shared.session, tokens);
            let short = name.rsplit('/').next().unwrap_or(name);
            let color = if index == shared.session.data.frame_index { tokens.text } else { tokens.dim };
            let painter = ui.painter().with_clip_rect(cell.intersect(ui.clip_rect()));
            painter.text(cell.min, egui::Align2::LEFT_TOP, short, egui::FontId::proportional(theme::CAPTION), color);
            let pointer = ui.input(|i| i.pointer.latest_pos()).filter(|_| response.hovered());
            let on = pointer.and_then(|at| shape.point(at));
            if let Some(point) = on {
                hovered = Some((point, Some(place)));
            }
            if response.clicked() {
                if index != shared.session.data.frame_index {
                    shared.send(Command::GotoFrame(index));
                } else if let Some(point) = on {
                    adopt(shared, map, point);
                    shared.send(Command::EndDrag);
                }
            }
        }
        if map.frames.len() > shown {
            let text = format!("and {} frames more", map.frames.len() - shown);
            ui.label(RichText::new(text).small().color(tokens.dim));
        }
    });
    hovered
}
