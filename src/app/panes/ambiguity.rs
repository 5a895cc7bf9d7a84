//! The ambiguity map: L_EM of this body over the floor plan, and over heading and height, with its minima; a click on one, or
//! anywhere, begins a branch there.

use super::explore::{begin_branch, keep_up, needs_fit, plane, signed};
use super::{Blank, Dock, MovedBody, Pane, PaneStates, Shared};
use crate::app::figure;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::body::Pppr;
use crate::explore::{AMBIGUITY_CELLS, AmbiguityMap, EmPlane, ExplorationKind, Minimum, RegionOf};
use crate::session::Session;
use egui::{Color32, Rect, RichText, Role, Sense, Ui, pos2};
use plane::{PlaneArea, PlaneAxis};
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Ambiguity",
    title: "Ambiguity map",
    icon: &[Mark::Ring([5.5, 9.5], 4.0), Mark::Dot([5.5, 9.5], 1.5), Mark::Ring([12.0, 4.5], 2.5)],
    help: "where in the room, and how turned, this body would explain the echo as well",
    dock: Dock::BottomTall,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<()>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, _| show(ui, shared),
};

/// Width of the list of minima, points, and where there is much room.
const LIST: f32 = 228.0;
const WIDEST_LIST: f32 = 320.0;
/// An evaluation takes about so much of a step, which has a gradient too.
const OF_A_STEP: f64 = 0.6;

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a frame: its body is tried everywhere on the floor, and at every heading and height.";
    needs_fit(session).then(|| Blank::new("No body to move", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>) {
    let before = shared.session.view.explore.ambiguity.clone();
    let mut settings = before.clone();
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new("EM region").small().color(Tokens::of(ui).dim));
        let along = ui.selectable_value(&mut settings.region, RegionOf::Body, "goes along");
        along.on_hover_text(
            "A region around the body wherever it is put, as a start there would have: over the whole room.",
        );
        let of_fit = ui.selectable_value(&mut settings.region, RegionOf::Fit, "of the fit");
        of_fit
            .on_hover_text("The region of the fit on screen: as far as it reaches, and what the fit itself could see.");
        let cost = shared
            .session
            .fit
            .problem
            .as_ref()
            .map(|_| shared.session.fit.step_ms * OF_A_STEP * 2.0 * (AMBIGUITY_CELLS * AMBIGUITY_CELLS) as f64);
        keep_up(ui, shared, ExplorationKind::Ambiguity, cost);
    });
    if settings != before {
        shared.set_view(|view| view.explore.ambiguity = settings);
    }
}

/// Which of the two maps.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Floor,
    Turn,
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>) {
    let Some(map) = shared.session.explore.ambiguity(shared.session.fit.frame).cloned() else { return };
    let tokens = Tokens::of(ui);
    let region = if map.region == RegionOf::Body { "region around the body" } else { "region of the fit" };
    let title = "Ambiguity map of L_EM";
    let caption =
        figure::of(shared.session, &format!("{title}: left over the floor, right over heading and height, {region}"));
    let rect = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    if rect.width() < 220.0 || rect.height() < 80.0 {
        return;
    }
    let list = if rect.width() > 640.0 { (0.2 * rect.width()).clamp(LIST, WIDEST_LIST) } else { 0.0 };
    let pictures = rect.with_max_x(rect.max.x - list);
    let floor_share = if pictures.width() > 380.0 { 0.5 } else { 1.0 };
    let middle = pictures.min.x + floor_share * pictures.width();
    let mut hovered = picture(ui, shared, &map, Side::Floor, pictures.with_max_x(middle), caption.as_deref(), &tokens);
    if floor_share < 1.0 {
        let right = pictures.with_min_x(middle + 6.0);
        hovered = picture(ui, shared, &map, Side::Turn, right, caption.as_deref(), &tokens).or(hovered);
    }
    shared.points.moved = hovered.map(|(side, at)| match side {
        Side::Floor => MovedBody::Floor(at),
        Side::Turn => MovedBody::Turned(at),
    });
    if list > 0.0 {
        let column = rect.with_min_x(rect.max.x - list + 12.0);
        let mut ui = ui.new_child(
            egui::UiBuilder::new().id_salt("column").max_rect(column).layout(egui::Layout::top_down(egui::Align::Min)),
        );
        egui::ScrollArea::vertical()
            .id_salt("minima")
            .auto_shrink(false)
            .show(&mut ui, |ui| minima(ui, shared, &map, hovered, &tokens));
    }
}

fn of_side(map: &AmbiguityMap, side: Side) -> &EmPlane {
    if side == Side::Floor { &map.floor } else { &map.turn }
}

/// One of the maps; answers where the pointer is, in the axes' units.
fn picture(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    map: &Arc<AmbiguityMap>,
    side: Side,
    rect: Rect,
    caption: Option<&str>,
    tokens: &Tokens,
) -> Option<(Side, [f64; 2])> {
    let of = of_side(map, side);
    let limits = plane::limits(of.values.iter().flatten().copied())?;
    let cells = [of.axes[0].cells, of.axes[1].cells];
    let inner = Rect::from_min_max(
        pos2(rect.min.x + plane::LEFT, rect.min.y + 6.0),
        pos2(rect.max.x - plane::BAR, rect.max.y - plane::BELOW),
    );
    // A metre is as long in both directions on the floor.
    let [across, up] = of.axes.each_ref().map(|axis| (axis.to - axis.from).abs() / (axis.cells - 1).max(1) as f64);
    let area = PlaneArea::shaped(inner, cells, (side == Side::Floor).then_some(across / up));
    if !area.rect.is_positive() {
        return None;
    }
    let name = if side == Side::Floor { "L_EM over the floor" } else { "L_EM over heading and height" };
    let response = ui.interact(area.rect, ui.scope_id().with(("ambiguity", name)), Sense::click());
    let pointer = ui.input(|i| i.pointer.latest_pos()).filter(|_| response.hovered());
    let on = pointer.and_then(|at| area.cell(at));
    let told = on.and_then(|cell| Some(format!("{}: L_EM {:.3}", place(side, of.at(cell)), of.value(cell)?)));
    let text = told.as_deref().or(caption);
    response.widget_info(|| figure::spoken(name, text));
    let painter = ui.painter().with_clip_rect(ui.clip_rect());
    let map_colors = plane::colormap(shared.session);
    plane::cells(&painter, &area, limits, map_colors, |[i, j]| {
        [1, 2, 4, 8].into_iter().find_map(|s| of.value([i / s * s, j / s * s]))
    });
    let axes = [0, 1].map(|k: usize| {
        let axis = &of.axes[k];
        let room = if k == 0 { area.rect.width() } else { area.rect.height() };
        PlaneAxis { name: axis.title(), numbers: plane::round_numbers((axis.from, axis.to), axis.cells, room) }
    });
    plane::axes(&painter, &area, [&axes[0], &axes[1]], tokens);
    plane::scale(ui, &area, map_colors, limits, "L_EM");
    let at = |value: [f64; 2]| area.at([of.axes[0].place(value[0]), of.axes[1].place(value[1])]);
    for (k, minimum) in of.minima.iter().enumerate() {
        number(&painter, area.at(minimum.cell.map(|k| k as f64)), k + 1);
    }
    if side == Side::Floor
        && let Some(root) = truth_root(shared.session, map.person)
    {
        plane::ring(&painter, at([root[1], root[0]]), 5.0, tokens.truth);
    }
    plane::ring(&painter, at(of.here), 6.0, Color32::WHITE);
    let value = on.map(|cell| of.at(cell));
    if response.on_hover_cursor(egui::CursorIcon::Crosshair).clicked()
        && let Some(value) = value
    {
        begin_at(shared, map, side, value);
    }
    value.map(|value| (side, value))
}

/// A number on a ground that is seen on every colour.
fn number(painter: &egui::Painter, at: egui::Pos2, number: usize) {
    painter.circle_filled(at, 7.0, Color32::from_black_alpha(190));
    painter.text(at, egui::Align2::CENTER_CENTER, number.to_string(), theme::mono(10.0), Color32::WHITE);
}

/// Where the truth has the person's root, m; the nearest one of several.
fn truth_root(session: &Session, person: usize) -> Option<[f64; 3]> {
    let (truth, dataset) = (session.data.frame.as_ref()?.truth.as_ref()?, session.data.dataset.as_ref()?);
    let skeleton = &dataset.info().skeleton;
    let joints = skeleton.joints.len().max(1);
    let shown = session.shown_positions().get(person * joints..(person + 1) * joints)?;
    let here = crate::explore::root_of(shown, skeleton);
    let roots = truth.joints.chunks_exact(joints).map(|person| crate::explore::root_of(person, skeleton));
    roots.min_by(|a, b| {
        let far = |p: &[f64; 3]| (p[0] - here[0]).hypot(p[1] - here[1]);
        far(a).total_cmp(&far(b))
    })
}

/// A place in words.
fn place(side: Side, [across, up]: [f64; 2]) -> String {
    signed(match side {
        Side::Floor => format!("x {up:.2} m, y {across:+.2} m"),
        Side::Turn => format!("turned {across:+.0}°, {up:+.2} m up"),
    })
}

/// The body there.
fn moved(session: &Session, map: &AmbiguityMap, side: Side, at: [f64; 2]) -> Option<Pppr> {
    let skeleton = &session.fit.problem.as_ref()?.skeleton;
    Some(if side == Side::Floor { map.on_floor(skeleton, at) } else { map.turned(skeleton, at) })
}

/// A branch that begins with the body there.
fn begin_at(shared: &mut Shared<'_>, map: &AmbiguityMap, side: Side, at: [f64; 2]) {
    let session = shared.session;
    let Some(start) = moved(session, map, side, at).map(Arc::new) else { return };
    let goes_along = side == Side::Floor && map.region == RegionOf::Body;
    let around = if goes_along { Some(Arc::clone(&start)) } else { session.fit.around() };
    begin_branch(shared, start, around, format!("from {}", place(side, at)));
}

/// The minima of both maps, and what is under the pointer.
fn minima(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    map: &Arc<AmbiguityMap>,
    hovered: Option<(Side, [f64; 2])>,
    tokens: &Tokens,
) {
    ui.spacing_mut().item_spacing.y = 2.0;
    let mono = |text: String| RichText::new(text).font(theme::mono(theme::CAPTION));
    ui.label(mono(format!("○ here  L_EM {:.3}", map.floor.here_value)));
    for (side, title) in [(Side::Floor, "Minima on the floor"), (Side::Turn, "Minima by heading")] {
        ui.add_space(4.0);
        ui.label(RichText::new(title).small().color(tokens.dim));
        let of = of_side(map, side);
        let found: &[Minimum] = &of.minima;
        if found.is_empty() {
            ui.label(RichText::new("none yet").small().color(tokens.dim));
        }
        for (k, minimum) in found.iter().enumerate() {
            let at = of.at(minimum.cell);
            let text = format!("{} {:.3}  {}", k + 1, minimum.value, place(side, at));
            let link = ui.link(mono(text)).named(Role::Link, &format!("Minimum {} at {}", k + 1, place(side, at)));
            let tip = format!("L_EM {:.4}, {:.4} deep. Click to begin a branch there.", minimum.value, minimum.depth);
            if link.hovered() {
                shared.points.moved =
                    Some(if side == Side::Floor { MovedBody::Floor(at) } else { MovedBody::Turned(at) });
            }
            if link.on_hover_text(tip).clicked() {
                begin_at(shared, map, side, at);
            }
        }
    }
    if let Some((side, at)) = hovered {
        ui.add_space(4.0);
        ui.label(RichText::new("Under the pointer").small().color(tokens.dim));
        ui.label(mono(place(side, at)));
        let axes = &of_side(map, side).axes;
        let cell = [0, 1].map(|k: usize| axes[k].place(at[k]).round().max(0.0) as usize);
        if let Some(value) = of_side(map, side).value(cell) {
            ui.label(mono(format!("L_EM {value:.4}")));
        }
    }
}
