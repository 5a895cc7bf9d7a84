//! The maps: H_ori, H_sim and the masks of each view, with one zoom, one cursor and one probe for all three columns.

mod overlay;
mod picture;
mod region;
mod toolbar;

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::{CommandRow, Menu, NONE, UiAction, has_frame};
use crate::app::figure;
use crate::app::map_image::Orientation;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{ColorBar, colorbar};
use crate::radar::View;
use crate::session::{ColorRange, Compare, Session};
use egui::{Key, Rect, Sense, Ui, UiBuilder, pos2, vec2};
use picture::{Content, Pictures};
use serde_json::Value;

/// The measured maps.
pub(super) static H_ORI: Pane = Pane {
    key: "HOri",
    title: "H_ori",
    help: "the measured maps",
    dock: Dock::Top,
    keys: &[],
    margin: 0,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar::show(ui, shared, MapColumn::Ori)),
    ui: |ui, shared, states| show(ui, shared, states.of(), MapColumn::Ori),
};

/// The simulated maps.
pub(super) static H_SIM: Pane = Pane {
    key: "HSim",
    title: "H_sim",
    help: "the simulated maps",
    dock: Dock::Top,
    keys: &[],
    margin: 0,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar::show(ui, shared, MapColumn::Sim)),
    ui: |ui, shared, states| show(ui, shared, states.of(), MapColumn::Sim),
};

/// The masks of the two.
pub(super) static MASKS: Pane = Pane {
    key: "Masks",
    title: "Masks",
    help: "the masks of both",
    dock: Dock::Top,
    keys: &[],
    margin: 0,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar::show(ui, shared, MapColumn::Masks)),
    ui: |ui, shared, states| show(ui, shared, states.of(), MapColumn::Masks),
};

/// The next drag on a map marks cells; again to leave it.
pub(in crate::app) const MARK_CELLS: CommandRow = CommandRow {
    label: "Mark cells",
    title: None,
    tooltip: "Drag a box on a map to mark the cells that your label is about. Ctrl+drag does it at any time.",
    menu: Menu::Labels,
    keys: &[(NONE, Key::G)],
    enabled: has_frame,
    act: |_| UiAction::panes(|states, _| states.of::<State>().mark_cells()),
};

/// Points at cells of a view, first and last bin of each axis, and zooms its maps to them.
pub(super) fn show_cells(view: usize, lo: Vec<usize>, hi: Vec<usize>) -> UiAction {
    UiAction::panes(move |states, session| states.of::<State>().show_cells(session, view, &lo, &hi))
}

/// Which column a pane is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum MapColumn {
    Ori,
    Sim,
    Masks,
}

/// The part of a map that is seen, in picture coordinates (0..1 both ways).
#[derive(Debug, Clone, Copy, PartialEq)]
struct MapExtent {
    min: [f32; 2],
    max: [f32; 2],
}

impl Default for MapExtent {
    fn default() -> Self {
        Self { min: [0.0; 2], max: [1.0; 2] }
    }
}

/// What the three panes share between passes.
#[derive(Default)]
struct State {
    pictures: Pictures,
    windows: Vec<MapExtent>,
    /// View and (column, row) pixel under the pointer, whichever pane it is in.
    hovered: Option<(usize, [usize; 2])>,
    hovered_next: Option<(usize, [usize; 2])>,
    pass: u64,
    /// Shift is held over the pane that is drawn: H_ori and H_sim are flipped in all its views.
    flipped: bool,
    highlight: Option<region::Highlight>,
    marking: region::Marking,
    /// The data set that the windows belong to.
    dataset: Option<std::sync::Weak<crate::dataset::Dataset>>,
}

impl PaneState for State {
    fn reset_view(&mut self) {
        self.highlight = None;
        self.windows.clear();
    }

    fn stored_as(&self) -> Option<&'static str> {
        Some("maps")
    }

    /// What is seen of each view: left, top, right, bottom, 0..1.
    fn stored(&self) -> serde_json::Result<Value> {
        let seen = self.windows.iter().map(|w| [w.min[0], w.min[1], w.max[0], w.max[1]]);
        serde_json::to_value(seen.collect::<Vec<[f32; 4]>>())
    }

    fn restore(&mut self, stored: Value, session: &Session) -> serde_json::Result<()> {
        let stored: Vec<[f32; 4]> = serde_json::from_value(stored)?;
        self.dataset = session.data.dataset.as_ref().map(std::sync::Arc::downgrade);
        let valid =
            |w: &[f32; 4]| w.iter().all(|x| (0.0..=1.0).contains(x)) && w[2] - w[0] > 0.01 && w[3] - w[1] > 0.01;
        let window = |w: [f32; 4]| MapExtent { min: [w[0], w[1]], max: [w[2], w[3]] };
        self.windows = stored.into_iter().map(|w| if valid(&w) { window(w) } else { MapExtent::default() }).collect();
        Ok(())
    }

    /// Zooms every map to the EM region.
    fn focus(&mut self, session: &Session) {
        let (Some(dataset), Some(snapshot)) = (&session.data.dataset, &session.fit.shown) else { return };
        let views = &dataset.info().views;
        self.windows.resize(views.len(), MapExtent::default());
        for (i, (view, masks)) in views.iter().zip(&snapshot.masks).enumerate() {
            if let Some([min, max]) = overlay::region_box(view, &masks.inside) {
                let pad = [(max[0] - min[0]) * 0.06, (max[1] - min[1]) * 0.06];
                self.windows[i] = MapExtent {
                    min: [(min[0] - pad[0]).max(0.0), (min[1] - pad[1]).max(0.0)],
                    max: [(max[0] + pad[0]).min(1.0), (max[1] + pad[1]).min(1.0)],
                };
            }
        }
    }
}

impl State {
    /// The pixel that was hovered in the last pass is this pass's linked cursor.
    fn begin_pass(&mut self, ctx: &egui::Context) {
        let pass = ctx.cumulative_pass_nr();
        if self.pass != pass {
            self.pass = pass;
            self.hovered = self.hovered_next.take();
            // One more pass after the pointer moved, or the cursor would stay a step behind it.
            if self.hovered.is_some() && ctx.input(|i| i.pointer.delta() != egui::Vec2::ZERO) {
                ctx.request_repaint();
            }
        }
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let data = &session.data;
    let how = "Open a folder with File > Open folder, or drop it on the window.";
    match (&data.dataset, &data.error, &data.frame) {
        (None, ..) => Some(Blank::new("No data set", how)),
        (_, Some(error), _) => Some(Blank::new("This frame cannot be shown", error.clone())),
        (.., None) => Some(Blank::new("Reading the frame…", "")),
        _ => None,
    }
}

/// Draws one column.
fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, column: MapColumn) {
    state.begin_pass(ui.ctx());
    let session = shared.session;
    let (Some(dataset), Some(frame)) = (&session.data.dataset, &session.data.frame) else { return };
    let views = &dataset.info().views;
    let known = state.dataset.as_ref().and_then(std::sync::Weak::upgrade);
    if !known.is_some_and(|known| std::sync::Arc::ptr_eq(&known, dataset)) {
        state.dataset = Some(std::sync::Arc::downgrade(dataset));
        state.windows.clear();
    }
    state.windows.resize(views.len(), MapExtent::default());
    state.leave_highlight(Some(session.data.frame_index));
    state.pictures.update(session, views, frame);
    if column != MapColumn::Ori
        && session.fit.shown.is_none()
        && let crate::session::FitStatus::Failed(why) = &session.fit.status
    {
        return Blank::new("No fit", why.clone()).show(ui);
    }
    // A toolbar that is wider than the pane must not push the maps out of it.
    let area = ui.available_rect_before_wrap().intersect(shared.pane);
    let pointer = ui.input(|i| i.pointer.hover_pos().filter(|_| i.modifiers.shift));
    state.flipped = column != MapColumn::Masks && pointer.is_some_and(|p| area.contains(p));
    for (i, rect) in arrange(area, views, session.view.true_proportions).into_iter().enumerate() {
        let builder = UiBuilder::new().max_rect(rect).id_salt(("map", i));
        ui.scope_builder(builder, |ui| one(ui, shared, state, column, i, rect));
    }
}

/// Side by side or one above the other, whichever makes the maps larger.
fn arrange(area: Rect, views: &[View], to_scale: bool) -> Vec<Rect> {
    let n = views.len().max(1);
    let aspects: Vec<f32> = views.iter().map(|v| Orientation::of(v).metric_aspect(v).unwrap_or(1.0)).collect();
    let score = |cell: egui::Vec2| -> f32 {
        let usable = (cell - vec2(92.0, 48.0)).max(egui::Vec2::ZERO);
        // To scale: the area that is left. Freely stretched: the area, less where the proportions are far off.
        aspects
            .iter()
            .map(|a| {
                let (w, h) = (usable.x.min(usable.y * a), usable.y.min(usable.x / a));
                if to_scale { w * h } else { (usable.x * usable.y * w * h).sqrt() }
            })
            .sum()
    };
    let across = vec2(area.width() / n as f32, area.height());
    let down = vec2(area.width(), area.height() / n as f32);
    let side_by_side = score(across) > score(down);
    (0..n)
        .map(|i| {
            let (size, offset) = if side_by_side {
                (across, vec2(across.x * i as f32, 0.0))
            } else {
                (down, vec2(0.0, down.y * i as f32))
            };
            Rect::from_min_size(area.min + offset, size)
        })
        .collect()
}

/// One map of one view: title, picture, axes, colour bar, overlays, probe.
fn one(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, column: MapColumn, index: usize, rect: Rect) {
    let session = shared.session;
    let Some(view) = session.data.dataset.as_ref().and_then(|d| d.info().views.get(index)) else { return };
    let orientation = Orientation::of(view);
    let flipped = state.flipped;
    let content = match (column, flipped) {
        (MapColumn::Masks, _) => Content::Masks,
        (MapColumn::Ori, false) => Content::Ori,
        (MapColumn::Sim, true) => state.pictures.reference(),
        (MapColumn::Ori, true) => Content::Sim,
        (MapColumn::Sim, false) => match session.view.compare {
            Compare::Flip | Compare::Wipe => Content::Sim,
            Compare::Difference => Content::Difference,
        },
    };
    let what = match (content, state.pictures.reference()) {
        (Content::Difference, Content::Base) => "H_sim − baseline",
        (Content::Difference, _) => "H_sim − H_ori",
        _ => content.name(),
    };
    let unit = if content == Content::Masks { "masks" } else { state.pictures.unit(content) };
    let caption = figure::of(session, &format!("{what} {} · {unit}", view.array));
    let rect = figure::print(ui, rect, caption.as_deref());
    // The masks have no colour bar, but keep its place: the three columns must line up.
    let bar_width = 46.0;
    // Where there is hardly room for the map, it goes without axes and colour bar; the probe still tells both.
    let compact = rect.height() < 112.0 || rect.width() < 150.0;
    let inner = if compact {
        Rect::from_min_max(rect.min + vec2(6.0, 18.0), rect.max - vec2(6.0, 4.0))
    } else {
        Rect::from_min_max(rect.min + vec2(42.0, 20.0), rect.max - vec2(4.0 + bar_width, 30.0))
    };
    let plot = if session.view.true_proportions { fit_aspect(inner, view, orientation) } else { inner };
    if plot.width() < 12.0 || plot.height() < 12.0 {
        return;
    }
    let tokens = Tokens::of(ui);
    overlay::title(ui, rect, plot, view, content, state.pictures.reference(), &tokens, session);
    let name = format!("{what} map of {}", view.array);
    let response = ui.interact(plot, ui.scope_id().with("plot"), Sense::click_and_drag());
    response.widget_info(|| figure::spoken(&name, caption.as_deref()));
    let (marking, marked) = state.mark(ui, &response, plot, index, view);
    if let Some(region) = marked {
        shared.send(crate::session::Command::SetRegion(session.data.frame_index, Some(region)));
    }
    if !marking {
        navigate(ui, &response, plot, &mut state.windows[index]);
    }
    let window = state.windows[index];
    let painter = ui.painter().with_clip_rect(plot.intersect(ui.clip_rect()));
    painter.rect_filled(plot, 0.0, theme::MASK_GROUND);
    state.pictures.paint(ui, &painter, plot, window_rect(window), index, content);
    if column == MapColumn::Sim && session.view.compare == Compare::Wipe && !flipped {
        wipe(ui, shared, state, index, plot, window);
    }
    let to_screen = |unit: [f64; 2]| screen(plot, window, unit);
    overlay::draw(&painter, session, view, index, orientation, &to_screen, &tokens);
    state.draw_regions(&painter, session, index, view, &to_screen, &tokens);
    if !compact {
        overlay::axes(ui, plot, view, orientation, window, &tokens);
    }
    ui.painter().rect_stroke(plot, 0.0, egui::Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    if let Some(pointer) = response.hover_pos() {
        let unit = unit_at(plot, window, pointer);
        if let Some(pixel) = overlay::pixel_at(view, orientation, unit) {
            state.hovered_next = Some((index, pixel));
            let text = overlay::probe(session, &state.pictures, view, index, orientation, pixel);
            let anchor = egui::PopupAnchor::Pointer;
            let probe = egui::Tooltip::always_open(ui.ctx().clone(), ui.layer_id(), response.id, anchor).gap(14.0);
            probe.show(|ui| {
                ui.add(egui::Label::new(egui::RichText::new(text).font(theme::mono(theme::CAPTION))).extend());
            });
        }
        if response.clicked() {
            let joint = overlay::joint_near(session, view, orientation, &to_screen, pointer);
            if joint != session.joint {
                shared.send(crate::session::Command::SelectJoint(joint));
            }
        }
    }
    if let Some((hovered, pixel)) = state.hovered.filter(|(hovered, _)| *hovered == index) {
        debug_assert_eq!(hovered, index);
        overlay::crosshair(&painter, plot, &to_screen, view, orientation, pixel, &tokens);
    }
    if content != Content::Masks && !compact {
        let bar = ColorBar {
            rect: Rect::from_min_max(
                pos2(plot.max.x + 2.0, plot.min.y - 18.0),
                pos2(plot.max.x + 2.0 + bar_width, plot.max.y + 6.0),
            ),
            map: state.pictures.colormap(content),
            limits: state.pictures.limits(index, content),
            floor: state.pictures.floor(content),
            unit: state.pictures.unit(content),
            name,
        };
        if let Some((lo, hi)) = colorbar(ui, &bar)
            && content != Content::Difference
        {
            shared.set_view(|v| v.range = ColorRange::Fixed { lo, hi });
        }
    }
}

/// The largest rectangle of the map's own proportions; where an axis is not in metres, all of it.
fn fit_aspect(inner: Rect, view: &View, orientation: Orientation) -> Rect {
    let Some(aspect) = orientation.metric_aspect(view) else { return inner };
    let width = inner.width().min(inner.height() * aspect);
    Rect::from_min_size(inner.min, vec2(width, width / aspect))
}

/// Drag pans, the wheel zooms at the pointer, a double click shows everything.
fn navigate(ui: &Ui, response: &egui::Response, plot: Rect, window: &mut MapExtent) {
    let span = [window.max[0] - window.min[0], window.max[1] - window.min[1]];
    let mut moved = *window;
    if response.dragged() {
        let delta = response.drag_delta();
        for (axis, by) in [(0, delta.x / plot.width()), (1, delta.y / plot.height())] {
            let by = (by * span[axis]).clamp(moved.max[axis] - 1.0, moved.min[axis]);
            moved.min[axis] -= by;
            moved.max[axis] -= by;
        }
    }
    if let Some(pointer) = response.hover_pos() {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        let factor = (-scroll * 0.004).exp() / pinch;
        if (factor - 1.0).abs() > 1e-4 {
            let unit = unit_at(plot, *window, pointer);
            for axis in 0..2 {
                let new_span = (span[axis] * factor).clamp(0.02, 1.0);
                let at = (unit[axis] as f32 - window.min[axis]) / span[axis];
                let min = (unit[axis] as f32 - at * new_span).clamp(0.0, 1.0 - new_span);
                moved.min[axis] = min;
                moved.max[axis] = min + new_span;
            }
        }
    }
    if response.double_clicked() {
        moved = MapExtent::default();
    }
    *window = moved;
}

/// The line between what is compared with (left) and H_sim (right), and the former left of it.
fn wipe(ui: &Ui, shared: &mut Shared<'_>, state: &State, index: usize, plot: Rect, window: MapExtent) {
    let x = plot.min.x + plot.width() * shared.session.view.wipe;
    let left = Rect::from_min_max(plot.min, pos2(x, plot.max.y));
    let painter = ui.painter().with_clip_rect(left.intersect(ui.clip_rect()));
    state.pictures.paint(ui, &painter, plot, window_rect(window), index, state.pictures.reference());
    let tokens = Tokens::of(ui);
    let handle = Rect::from_center_size(pos2(x, plot.center().y), vec2(10.0, plot.height()));
    let response = ui.interact(handle, ui.scope_id().with("wipe"), Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Wipe position"));
    if response.dragged() {
        let at = (shared.session.view.wipe + response.drag_delta().x / plot.width()).clamp(0.0, 1.0);
        shared.set_view(|v| v.wipe = at);
    }
    let response = response.on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
    let width = if response.hovered() || response.dragged() { 2.0 } else { 1.0 };
    ui.painter().vline(x, plot.y_range(), egui::Stroke::new(width, tokens.accent));
}

fn window_rect(window: MapExtent) -> Rect {
    Rect::from_min_max(pos2(window.min[0], window.min[1]), pos2(window.max[0], window.max[1]))
}

/// Picture coordinates to the screen.
fn screen(plot: Rect, window: MapExtent, unit: [f64; 2]) -> egui::Pos2 {
    let t = |axis: usize| (unit[axis] as f32 - window.min[axis]) / (window.max[axis] - window.min[axis]);
    pos2(plot.min.x + t(0) * plot.width(), plot.min.y + t(1) * plot.height())
}

/// Picture coordinates under a point of the screen.
fn unit_at(plot: Rect, window: MapExtent, at: egui::Pos2) -> [f64; 2] {
    let t = [(at.x - plot.min.x) / plot.width(), (at.y - plot.min.y) / plot.height()];
    std::array::from_fn(|axis| f64::from(window.min[axis] + t[axis] * (window.max[axis] - window.min[axis])))
}
