//! The maps: a row a view with H_ori, H_sim and the masks, one zoom, one cursor and one read-out for all of them.

mod drag;
mod focus;
mod grid;
pub(super) mod ortho;
mod overlay;
mod picture;
mod readout;
mod region;
mod toolbar;

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared, lit};
use crate::app::commands::{CommandRow, Menu, NONE, SHIFT, UiAction, has_frame};
use crate::app::figure;
use crate::app::map_image::Orientation;
use crate::app::map_plane::Plane;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{BarRow, ColorBar, LimitsEdit, Mark, colorbar};
use crate::radar::View;
use crate::session::{Compare, Session};
use egui::{Key, Rect, Sense, Ui, UiBuilder, pos2, vec2};
use focus::Focus;
use grid::GridRow;
use picture::{Content, Pictures};
use region::{BoxOf, Drawn};
use serde_json::Value;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Maps",
    title: "Maps",
    icon: &[
        Mark::Box([1.5, 1.5, 14.5, 14.5]),
        Mark::Line(&[[1.5, 8.0], [14.5, 8.0]]),
        Mark::Line(&[[8.0, 1.5], [8.0, 14.5]]),
        Mark::Bar([8.0, 1.5, 14.5, 8.0]),
    ],
    help: "the measured maps, the simulated ones and the masks of both",
    dock: Dock::Centre,
    keys: &[],
    margin: 0,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| toolbar::show(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// One map takes the room of all.
pub(in crate::app) const ENLARGE: CommandRow = CommandRow {
    label: "One map alone",
    title: None,
    tooltip: "The map under the pointer takes the room of all of them; again, or Esc, to see all. A double click does the same.",
    menu: Menu::View,
    keys: &[(NONE, Key::Z)],
    enabled: has_frame,
    act: |_| UiAction::panes(|states, _| states.of::<State>().enlarge()),
};

/// The next drag on a map marks cells; again to leave it.
pub(in crate::app) const MARK_CELLS: CommandRow = CommandRow {
    label: "Mark cells",
    title: None,
    tooltip: "Drag a box on a map to mark the cells that your label is about. Ctrl+drag does it at any time.",
    menu: Menu::Labels,
    keys: &[(NONE, Key::G)],
    enabled: has_frame,
    act: |_| UiAction::panes(|states, _| states.of::<State>().draw_box(BoxOf::Label)),
};

/// The next drag on a map erases cells; again to leave it.
pub(in crate::app) const ERASE_CELLS: CommandRow = CommandRow {
    label: "Erase cells",
    title: None,
    tooltip: "Drag a box on a map: the fit is done anew as if nothing had been measured there, in this frame and in those around it, on a branch of its own. Live, the body follows the box. Beside it: a brush, and whole echoes by one click.",
    menu: Menu::Fit,
    keys: &[(SHIFT, Key::G)],
    enabled: has_frame,
    act: |_| UiAction::panes(|states, _| states.of::<State>().draw_box(BoxOf::Eraser)),
};

/// H_sim of all joints, of all but the selected one, of the selected one alone; round.
pub(in crate::app) const ISOLATE: CommandRow = CommandRow {
    label: "Without or only this joint",
    title: None,
    tooltip: "H_sim without what the selected joint sends back; again: of that joint alone; again: of all.",
    menu: Menu::View,
    keys: &[(NONE, Key::I)],
    enabled: |s| s.joint.is_some() && s.fit.shown.is_some(),
    act: |s| {
        let mut view = s.view.clone();
        view.isolate = view.isolate.next();
        UiAction::Session(crate::session::Command::SetView(Box::new(view)))
    },
};

/// Points at cells of a view, first and last bin of each axis, and zooms its maps to them.
pub(super) fn show_cells(view: usize, lo: Vec<usize>, hi: Vec<usize>) -> UiAction {
    UiAction::panes(move |states, session| states.of::<State>().show_cells(session, view, &lo, &hi))
}

/// What a column shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum MapColumn {
    Ori,
    Sim,
    Masks,
}

impl MapColumn {
    const ALL: [Self; grid::COLUMNS] = [Self::Ori, Self::Sim, Self::Masks];
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
    /// View and (column, row) pixel under the pointer, in whichever column.
    hovered: Option<(usize, [usize; 2])>,
    hovered_next: Option<(usize, [usize; 2])>,
    /// View and column of the map under the pointer.
    pointed: Option<(usize, usize)>,
    /// View and column of the map that is alone.
    solo: Option<(usize, usize)>,
    focus: Focus,
    pass: u64,
    /// The column over which Shift is held: H_ori and H_sim are flipped in all its views.
    flipped: Option<MapColumn>,
    highlight: Option<region::Highlight>,
    marking: region::Marking,
    /// The coordinates that the windows belong to: bird's-eye, polar.
    planes: Option<[bool; 2]>,
    /// A joint that is moved.
    held: Option<drag::Held>,
    /// What the read-out says instead of the cell under the pointer, in this pass.
    told: Option<&'static str>,
    /// The data set that the windows belong to.
    dataset: Option<std::sync::Weak<crate::dataset::Dataset>>,
}

impl PaneState for State {
    fn reset_view(&mut self) {
        self.highlight = None;
        self.solo = None;
        self.show_all();
    }

    fn show_all(&mut self) {
        self.windows.clear();
        self.focus.whole = true;
    }

    fn back(&mut self) -> bool {
        self.marking.armed.take().is_some() || self.solo.take().is_some()
    }

    fn shows_all(&self) -> bool {
        self.windows.iter().all(|window| *window == MapExtent::default())
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
        self.focus.whole = true;
        self.planes = None;
        self.windows = stored.into_iter().map(|w| if valid(&w) { window(w) } else { MapExtent::default() }).collect();
        Ok(())
    }

    /// Zooms every map to the person.
    fn focus(&mut self, session: &Session) {
        if session.data.dataset.is_none() {
            return;
        }
        self.focus.whole = false;
        self.show_person(session, session.seen_views(), false);
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

    /// The map under the pointer alone, else the first one; or all of them again.
    fn enlarge(&mut self) {
        self.solo = if self.solo.is_some() { None } else { Some(self.pointed.unwrap_or_default()) };
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

/// Draws every map, and what is under the pointer.
fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    state.begin_pass(ui.ctx());
    let session = shared.session;
    let (Some(dataset), Some(frame)) = (&session.data.dataset, &session.data.frame) else { return };
    let views = session.seen_views();
    let known = state.dataset.as_ref().and_then(std::sync::Weak::upgrade);
    if !known.is_some_and(|known| std::sync::Arc::ptr_eq(&known, dataset)) {
        state.dataset = Some(std::sync::Arc::downgrade(dataset));
        state.windows.clear();
        state.solo = None;
        state.focus = Focus::default();
    }
    let planes = [session.view.cube.birds_eye, session.view.cube.polar];
    if state.planes.replace(planes).is_some_and(|known| known != planes) {
        // What was seen in other coordinates means nothing: the person is found again.
        state.windows.clear();
        state.focus.again();
    }
    state.windows.resize(views.len(), MapExtent::default());
    state.leave_highlight(Some(session.data.frame_index));
    state.pictures.update(session, views, frame);
    isolate(ui, session, state, views);
    state.follow(session, views);
    // A toolbar that is wider than the pane must not push the maps out of it.
    let area = ui.available_rect_before_wrap().intersect(shared.pane);
    let strip = grid::READOUT + if session.view.neighbours { grid::NEIGHBOURS } else { 0.0 };
    let (maps, readout) = area.split_top_bottom_at_y((area.max.y - strip).max(area.min.y));
    let rows = grid::rows(maps.shrink2(vec2(4.0, 1.0)), views.len(), state.solo);
    let pointer = ui.input(|i| i.pointer.hover_pos());
    let over = |column: usize| pointer.is_some_and(|p| rows.iter().any(|row| row.maps[column].contains(p)));
    let column = (0..grid::COLUMNS).find(|&column| over(column));
    state.pointed = column.and_then(|column| {
        let row = rows.iter().find(|row| pointer.is_some_and(|p| row.maps[column].contains(p)))?;
        Some((row.view, column))
    });
    let flip = ui.input(|i| i.modifiers.shift);
    state.flipped = column.filter(|_| flip).map(|column| MapColumn::ALL[column]);
    for row in rows {
        let builder = UiBuilder::new().max_rect(maps).id_salt(("map", row.view));
        ui.scope_builder(builder, |ui| {
            for (column, rect) in MapColumn::ALL.into_iter().zip(row.maps).filter(|(_, rect)| rect.is_positive()) {
                ui.push_id(column, |ui| one(ui, shared, state, column, &row, rect));
            }
            if row.axes {
                beside(ui, shared, state, &row);
            }
        });
    }
    readout::show(ui, shared, state, readout);
}

/// Takes in the maps of what H_sim is made of, where that is not all joints.
fn isolate(ui: &Ui, session: &Session, state: &mut State, views: &[View]) {
    let kept = lit::isolated(session).zip(lit::lit(ui.ctx(), session));
    for (index, view) in views.iter().enumerate() {
        let map = kept.as_ref().and_then(|(kept, lit)| lit.map(ui.ctx(), index, *kept));
        let o = Orientation::of(view, session.view.cube);
        state.pictures.isolate(index, (view, o), map, (session.view.scale, session.view.range_of(&view.array)));
    }
}

/// What a column shows now.
fn content_of(column: MapColumn, state: &State, session: &Session) -> Content {
    let flipped = state.flipped == Some(column);
    match (column, flipped) {
        (MapColumn::Masks, _) => Content::Masks,
        (MapColumn::Ori, false) => Content::Ori,
        (MapColumn::Sim, true) => state.pictures.reference(),
        (MapColumn::Ori, true) => Content::Sim,
        (MapColumn::Sim, false) => match session.view.compare {
            Compare::Flip | Compare::Wipe if lit::isolated(session).is_some() => Content::Isolated,
            Compare::Flip | Compare::Wipe => Content::Sim,
            Compare::Difference => Content::Difference,
        },
    }
}

/// `without` or `only`, where H_sim is not of all joints.
fn isolated_word(session: &Session) -> Option<&'static str> {
    lit::isolated(session).map(|kept| if matches!(kept, crate::mhp::KeptJoints::Only(_)) { "only" } else { "without" })
}

fn name_of(session: &Session, content: Content, state: &State, view: &View) -> (String, &'static str) {
    let what = match (content, state.pictures.reference()) {
        (Content::Difference, Content::Base) => "H_sim − baseline",
        (Content::Difference, _) => "H_sim − H_ori",
        (Content::Isolated, _) if isolated_word(session) == Some("without") => "H_sim without the joint",
        (Content::Isolated, _) => "H_sim of the joint alone",
        _ => content.name(),
    };
    (format!("{what} map of {}", view.array), what)
}

/// One map of one view: picture, title, axes, overlays.
fn one(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, column: MapColumn, row: &GridRow, rect: Rect) {
    let (session, index) = (shared.session, row.view);
    let Some(view) = session.seen_views().get(index) else { return };
    let orientation = Orientation::of(view, session.view.cube);
    let content = content_of(column, state, session);
    let (name, what) = name_of(session, content, state, view);
    let unit = if content == Content::Masks { "masks" } else { state.pictures.unit(content) };
    let caption = figure::of(session, &format!("{what} {} · {unit}", view.array));
    let rect = figure::print(ui, rect, caption.as_deref());
    // What is on metres for its shape's sake is to scale in any case.
    let to_scale = session.view.true_proportions || orientation.plane == Plane::BirdsEye;
    let aspect = orientation.metric_aspect(view).filter(|_| to_scale);
    let plot = fit_aspect(rect, aspect, state.windows[index]);
    if plot.width() < 12.0 || plot.height() < 12.0 {
        return;
    }
    let tokens = Tokens::of(ui);
    let response = ui.interact(plot, ui.scope_id().with("plot"), Sense::click_and_drag());
    let drawn = state.mark(ui, &response, plot, index, (view, orientation));
    let drawing = !matches!(drawn, Drawn::Nothing);
    match drawn {
        Drawn::Marked(cells) => {
            shared.send(crate::session::Command::SetRegion(session.data.frame_index, Some(cells)));
        }
        Drawn::Erased(cells) => shared.send(crate::session::Command::DragErase(cells)),
        Drawn::Painted(cells) => shared.send(crate::session::Command::DragEraseCells(index, cells)),
        Drawn::Echo(cell) => shared.send(crate::session::Command::EraseEcho(index, cell)),
        Drawn::Begun | Drawn::Nothing => {}
    }
    if !drawing && !drag::joint(ui, shared, state, &response, plot, (index, view, orientation)) {
        navigate(ui, &response, plot, &mut state.windows[index]);
    }
    let window = state.windows[index];
    let painter = ui.painter().with_clip_rect(plot.intersect(ui.clip_rect()));
    painter.rect_filled(plot, 0.0, theme::MASK_GROUND);
    state.pictures.paint(ui, &painter, plot, window_rect(window), index, content);
    if column == MapColumn::Sim && session.view.compare == Compare::Wipe && content == Content::Sim {
        wipe(ui, shared, state, index, plot, window);
    }
    let to_screen = |unit: [f64; 2]| screen(plot, window, unit);
    let region = state.pictures.region(index);
    overlay::draw(&painter, session, view, index, region, &to_screen);
    state.draw_regions(&painter, session, index, view, &to_screen, &tokens);
    if session.view.show_outlines {
        outlines(&painter, state, content, (index, view, orientation), &to_screen);
    }
    let joint = shared.pointed.joint;
    let print = joint.and_then(|joint| footprint(ui, &painter, session, joint, (index, view, orientation), &to_screen));
    response.widget_info(|| figure::spoken(&name, print.as_deref().or(caption.as_deref())));
    overlay::title(&painter, plot, view, content, state.pictures.reference(), session);
    if row.axes {
        let first = column == MapColumn::Ori || state.solo.is_some();
        overlay::axes(ui, plot, view, orientation, window, first, &tokens);
    }
    ui.painter().rect_stroke(plot, 0.0, egui::Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    if let Some(pointer) = response.hover_pos() {
        let unit = unit_at(plot, window, pointer);
        if let Some(pixel) = orientation.pixel_at(view, unit) {
            state.hovered_next = Some((index, pixel));
            shared.points.cell = Some((index, pixel));
        }
        let joint = overlay::joint_near(session, view, orientation, &to_screen, pointer);
        shared.points.joint = joint.or(shared.points.joint);
        if response.clicked() && !drawing {
            super::joint::select(shared, joint);
        }
    }
    if response.double_clicked() {
        state.pointed = Some((index, MapColumn::ALL.iter().position(|one| *one == column).unwrap_or_default()));
        state.enlarge();
    }
    drag::ring(&painter, shared, (view, orientation), &to_screen);
    if let Some((_, pixel)) = state.hovered.filter(|(hovered, _)| *hovered == index) {
        overlay::crosshair(&painter, &to_screen, view, orientation, pixel);
    }
}

/// The outlines of a map's own mask at τ, and thinner at its neighbours; on the masks both.
fn outlines(
    painter: &egui::Painter,
    state: &State,
    content: Content,
    (index, view, o): (usize, &View, Orientation),
    to_screen: &dyn Fn([f64; 2]) -> egui::Pos2,
) {
    let Some(lines) = state.pictures.outlines(index) else { return };
    let (ori, sim) = (content != Content::Sim, content != Content::Ori);
    for (map, (wanted, color)) in lines.iter().zip([(ori, theme::MASK_ORI), (sim, theme::MASK_SIM)]) {
        for (k, pieces) in map.iter().enumerate().filter(|_| wanted) {
            let (width, strength) = if k == 1 { (1.6, 1.0) } else { (0.8, 0.75) };
            let stroke = egui::Stroke::new(width, color.gamma_multiply(strength));
            for piece in pieces {
                painter.line_segment(piece.map(|at| to_screen(o.to_shown(view, at))), stroke);
            }
        }
    }
}

/// Levels of a joint's footprint below its own largest cell, dB, and how its lines are drawn.
const FOOTPRINT: [(f64, f32); 2] = [(-3.0, 2.0), (-10.0, 1.0)];

/// Where the joint that is pointed at lights the map: lines 3 and 10 dB below its own largest cell. Answers that in words.
fn footprint(
    ui: &Ui,
    painter: &egui::Painter,
    session: &Session,
    joint: usize,
    (index, view, o): (usize, &View, Orientation),
    to_screen: &dyn Fn([f64; 2]) -> egui::Pos2,
) -> Option<String> {
    let lit = lit::lit(ui.ctx(), session).filter(|lit| joint < lit.returns.joints())?;
    let map = lit.map(ui.ctx(), index, crate::mhp::KeptJoints::Only(joint))?;
    let picture = o.picture(view, &map);
    let most = picture.iter().copied().fold(0.0, f64::max);
    // What is nothing but H_sim's floor has no footprint.
    if most <= 1e-29 {
        return None;
    }
    for (db, width) in FOOTPRINT {
        let level = most * 10f64.powf(db / 20.0);
        for piece in lit::contour(o.size(view), &picture, level) {
            let ends = piece.map(|at| to_screen(o.to_shown(view, at)));
            painter.line_segment(ends, egui::Stroke::new(width + 1.5, egui::Color32::from_black_alpha(110)));
            painter.line_segment(ends, egui::Stroke::new(width, theme::DARK.selected));
        }
    }
    let [within_3, within_10] =
        FOOTPRINT.map(|(db, _)| picture.iter().filter(|x| **x >= most * 10f64.powf(db / 20.0)).count());
    let name = lit::joint_name(session, joint);
    Some(format!("footprint of {name}: {within_3} cells within 3 dB, {within_10} within 10 dB"))
}

/// What belongs to a whole row: where on the map it is, where that is not all of it, and what its colours mean.
fn beside(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State, row: &GridRow) {
    let index = row.view;
    let Some(view) = shared.session.data.dataset.as_ref().and_then(|d| d.info().views.get(index)) else { return };
    let rest = if state.windows[index] == MapExtent::default() {
        row.beside
    } else {
        let o = Orientation::of(view, shared.session.view.cube);
        let [width, height] = o.size(view);
        let on_metres = o.metric_aspect(view).filter(|_| o.plane == Plane::BirdsEye);
        let aspect = on_metres.unwrap_or(width as f32 / height.max(1) as f32);
        let high = (row.beside.width() / aspect).clamp(20.0, 0.36 * row.beside.height());
        let (above, rest) = row.beside.split_top_bottom_at_y(row.beside.min.y + high);
        overview(ui, state, view, index, above);
        rest.with_min_y(rest.min.y + 6.0)
    };
    let shown: Vec<(MapColumn, Content)> = MapColumn::ALL
        .into_iter()
        .zip(row.maps)
        .filter(|(_, rect)| rect.is_positive())
        .map(|(column, _)| (column, content_of(column, state, shared.session)))
        .filter(|(_, content)| *content != Content::Masks)
        .collect();
    // One bar for all that share their limits.
    let mut bars: Vec<(Content, (f64, f64))> = Vec::new();
    for (_, content) in shown {
        let limits = state.pictures.limits(index, content);
        let same = |known: &(Content, (f64, f64))| {
            known.1 == limits && (known.0 == Content::Difference) == (content == Content::Difference)
        };
        // What is not there yet has no limits.
        if limits.0 < limits.1 && !bars.iter().any(same) {
            bars.push((content, limits));
        }
    }
    let set = shared.session.view.limits_of(&view.array);
    let height = rest.height() / bars.len().max(1) as f32;
    for (k, (content, limits)) in bars.into_iter().enumerate() {
        let rect = Rect::from_min_size(rest.min + vec2(0.0, height * k as f32), vec2(rest.width(), height));
        let bar = ColorBar {
            rect,
            map: state.pictures.colormap(content),
            limits,
            histogram: state.pictures.histogram(index, content),
            floor: state.pictures.floor(index, content),
            unit: state.pictures.unit(content),
            row: (content != Content::Difference).then(|| BarRow {
                array: &view.array,
                name: name_of(shared.session, content, state, view).0,
                by_hand: set.is_some(),
                locked: set.is_some_and(|set| set.locked),
            }),
        };
        let Some(edit) = colorbar(ui, &bar) else { continue };
        shared.set_view(|v| match edit {
            LimitsEdit::Set(limits) => v.set_limits(&view.array, limits),
            LimitsEdit::Automatic => v.free_limits(&view.array),
            LimitsEdit::Lock(on) => v.lock_limits(&view.array, limits, on),
        });
    }
}

/// The whole map, small, with what is seen of it, which can be dragged.
fn overview(ui: &mut Ui, state: &mut State, view: &View, index: usize, rect: Rect) {
    let response = ui.interact(rect, ui.scope_id().with("overview"), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, format!("Overview of {}", view.array)));
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.rect_filled(rect, 0.0, theme::MASK_GROUND);
    state.pictures.paint(ui, &painter, rect, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), index, Content::Ori);
    let window = &mut state.windows[index];
    if (response.dragged() || response.clicked())
        && let Some(pointer) = response.interact_pointer_pos()
    {
        let at = [(pointer.x - rect.min.x) / rect.width(), (pointer.y - rect.min.y) / rect.height()];
        for axis in 0..2 {
            let span = window.max[axis] - window.min[axis];
            let low = (at[axis] - 0.5 * span).clamp(0.0, 1.0 - span);
            (window.min[axis], window.max[axis]) = (low, low + span);
        }
    }
    let corner = |at: [f32; 2]| rect.min + vec2(at[0] * rect.width(), at[1] * rect.height());
    let seen = Rect::from_min_max(corner(window.min), corner(window.max));
    painter.rect_stroke(seen, 0.0, egui::Stroke::new(1.5, egui::Color32::WHITE), egui::StrokeKind::Inside);
    ui.painter().rect_stroke(rect, 0.0, egui::Stroke::new(1.0, Tokens::of(ui).stroke), egui::StrokeKind::Outside);
    response.on_hover_text("The whole map. Drag the frame to look elsewhere; F shows all of it.");
}

/// The largest rectangle in which what is seen of a map is to scale; all of it where the map has no scale.
fn fit_aspect(inner: Rect, aspect: Option<f32>, window: MapExtent) -> Rect {
    let Some(aspect) = aspect else { return inner };
    let aspect = aspect * (window.max[0] - window.min[0]) / (window.max[1] - window.min[1]);
    let width = inner.width().min(inner.height() * aspect);
    Rect::from_min_size(inner.min, vec2(width, width / aspect))
}

/// Drag pans, the wheel zooms at the pointer.
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
