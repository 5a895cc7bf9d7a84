//! Orthoview: three cuts through a map with three axes, linked by one place that a drag in any of them moves.
//!
//! ```text
//!  depth │ first × depth │ second × depth
//!        └────────────────────────────────
//! second │ first × second│ what is at the place
//! ```

use super::overlay;
use crate::app::figure;
use crate::app::map_image::{Orientation, colorize, level, limits, shown};
use crate::app::panes::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::dataset::Frame;
use crate::radar::View;
use crate::render::Colormap;
use crate::session::{ColorRange, CubeAxes, CubeView, MapScale, Session, ThirdAxis};
use crate::worker::Snapshot;
use egui::{Painter, Pos2, Rect, RichText, Role, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::Arc;

/// The pane.
pub(in crate::app::panes) static PANE: Pane = Pane {
    key: "Ortho",
    title: "Orthoview",
    icon: &[
        Mark::Box([1.5, 1.5, 14.5, 14.5]),
        Mark::Line(&[[5.5, 1.5], [5.5, 14.5]]),
        Mark::Line(&[[1.5, 10.0], [14.5, 10.0]]),
        Mark::Dot([5.5, 10.0], 1.8),
    ],
    help: "three linked cuts through a map with three axes",
    dock: Dock::Centre,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| toolbar(ui, shared, states.of())),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Room for the numbers of an axis, points: left and below.
const LEFT: f32 = 44.0;
const BELOW: f32 = 18.0;
/// Between pictures.
const GAP: f32 = 10.0;
/// The pairs of axes, as they lie: above at the left, above at the right, below at the left.
const PLANES: [CubeAxes; 3] = [CubeAxes::First, CubeAxes::Second, CubeAxes::Others];

/// What is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
struct Look {
    /// The view.
    view: usize,
    /// H_sim instead of H_ori.
    sim: bool,
    /// The largest value along the axis that is not drawn, instead of the cut at the place.
    largest: bool,
    /// The place, a bin of each axis; `None`: where H_ori is largest.
    place: Option<[usize; 3]>,
}

/// What the pane remembers.
#[derive(Default)]
struct State {
    look: Look,
    /// The joint that the place followed last.
    joint: Option<usize>,
    /// What the pictures are of.
    made: Option<Made>,
    /// Frame and fit of these, held so that no other one gets their address.
    held: (Option<Arc<Frame>>, Option<Arc<Snapshot>>),
    textures: Vec<TextureHandle>,
}

/// Everything that changes a pixel.
#[derive(PartialEq)]
struct Made {
    look: Look,
    place: [usize; 3],
    scale: MapScale,
    range: ColorRange,
    colormap: Colormap,
    frame: usize,
    snapshot: usize,
}

impl PaneState for State {
    fn reset_view(&mut self) {
        self.look.place = None;
    }

    fn stored_as(&self) -> Option<&'static str> {
        Some("ortho")
    }

    fn stored(&self) -> serde_json::Result<Value> {
        serde_json::to_value(self.look)
    }

    fn restore(&mut self, stored: Value, _session: &Session) -> serde_json::Result<()> {
        self.look = serde_json::from_value::<Option<Look>>(stored)?.unwrap_or_default();
        Ok(())
    }
}

/// The views with three axes: index and view.
fn cubes(session: &Session) -> Vec<(usize, &View)> {
    let views = session.seen_views().iter().enumerate();
    views.filter(|(_, view)| view.axes.len() == 3).collect()
}

/// The one that is looked at, else the first.
fn chosen<'a>(session: &'a Session, look: &Look) -> Option<(usize, &'a View)> {
    let cubes = cubes(session);
    cubes.iter().find(|(index, _)| *index == look.view).or(cubes.first()).copied()
}

fn blank(session: &Session) -> Option<Blank> {
    let how =
        "Cuts through a map of range, angle and Doppler appear here. The maps of this data set have two axes each.";
    match (&session.data.dataset, &session.data.frame) {
        (None, _) => Some(Blank::new("No data set", "Open one with maps of three axes.")),
        (_, None) => Some(Blank::new("Reading the frame…", "")),
        _ if cubes(session).is_empty() => Some(Blank::new("No map with three axes", how)),
        _ => None,
    }
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let look = &mut state.look;
    let cubes = cubes(shared.session);
    ui.horizontal_wrapped(|ui| {
        if cubes.len() > 1 {
            for (index, view) in &cubes {
                let on = chosen(shared.session, look).is_some_and(|(chosen, _)| chosen == *index);
                let button = ui.selectable_label(on, &view.array).named(Role::Button, &format!("Cut {}", view.array));
                if button.clicked() {
                    (look.view, look.place) = (*index, None);
                }
            }
            ui.separator();
        }
        ui.selectable_value(&mut look.sim, false, "H_ori").named(Role::Button, "Cuts through H_ori");
        ui.selectable_value(&mut look.sim, true, "H_sim").named(Role::Button, "Cuts through H_sim");
        ui.separator();
        ui.selectable_value(&mut look.largest, false, "cut")
            .on_hover_text("The bin of the place along the third axis.");
        ui.selectable_value(&mut look.largest, true, "largest")
            .on_hover_text("The largest value along the axis that is not drawn.");
        ui.separator();
        let peak = ui.button("To the peak").on_hover_text("Where H_ori is largest.");
        if peak.clicked() {
            look.place = None;
        }
    });
}

/// Where a map is largest, a bin of each axis.
fn peak(view: &View, map: &[f64]) -> [usize; 3] {
    let finite = map.iter().enumerate().filter(|(_, x)| x.is_finite());
    let at = finite.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(at, _)| at);
    let bins = [view.axes[1].bins.max(1), view.axes[2].bins.max(1)];
    [at / (bins[0] * bins[1]), at / bins[1] % bins[0], at % bins[1]]
}

/// The nearest bins to fractional ones.
fn nearest(view: &View, bins: &[f64]) -> Option<[usize; 3]> {
    let of = |axis: usize| {
        let bin = bins.get(axis)?.round();
        bin.is_finite().then(|| bin.clamp(0.0, view.axes[axis].bins.saturating_sub(1) as f64) as usize)
    };
    Some([of(0)?, of(1)?, of(2)?])
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let (Some((index, view)), Some(frame)) = (chosen(session, &state.look), &session.data.frame) else { return };
    let Some(ori) = frame.maps.get(index).map(|map| map.data.as_slice()) else { return };
    let sim = session.fit.shown.as_ref().and_then(|shown| shown.h_sim.get(index)).map(Vec::as_slice);
    // A joint that was just selected, here or elsewhere, is where one wants to look.
    if session.joint != state.joint {
        state.joint = session.joint;
        let at = session.joint.and_then(|joint| {
            let params = &session.fit.shown.as_ref()?.params;
            Some(view.bins_of_moving(*params.positions().get(joint)?, *params.velocities().get(joint)?))
        });
        state.look.place = at.and_then(|bins| nearest(view, &bins)).or(state.look.place);
    }
    let place = state.look.place.unwrap_or_else(|| peak(view, ori));
    let place: [usize; 3] = std::array::from_fn(|axis| place[axis].min(view.axes[axis].bins.saturating_sub(1)));
    let Some(map) = (if state.look.sim { sim } else { Some(ori) }).filter(|map| map.len() == view.cells()) else {
        return Blank::new("No H_sim yet", "It is there once the frame is fitted.").show(ui);
    };
    let planes = PLANES.map(|axes| orientation(view, &state.look, axes, place));
    state.draw_pictures(ui, session, view, map, &planes, place);
    let tokens = Tokens::of(ui);
    let area = ui.available_rect_before_wrap();
    let [upper_left, upper_right, lower_left, rest] = quarters(area, view, &planes);
    let mut moved = None;
    for (k, (rect, o)) in [upper_left, upper_right, lower_left].into_iter().zip(planes).enumerate() {
        if rect.width() < 16.0 || rect.height() < 16.0 {
            continue;
        }
        moved = plane(ui, session, state.textures.get(k), rect, (view, o), place, &tokens).or(moved);
        overlay::axes(ui, rect, view, o, crate::app::panes::maps::MapExtent::default(), true, &tokens);
    }
    told(ui, rest, view, place, (ori, sim), session.view.scale, &tokens);
    if let Some((joint, place)) = moved {
        state.look.place = Some(place);
        if joint.is_some() {
            // Its place is the one that was clicked, not quite the joint's own.
            state.joint = joint;
            crate::app::panes::joint::select(shared, joint);
        }
    }
}

fn orientation(view: &View, look: &Look, axes: CubeAxes, place: [usize; 3]) -> Orientation {
    let mut cube = CubeView { axes, third: ThirdAxis::Largest, ..CubeView::default() };
    let o = Orientation::of(view, cube);
    if !look.largest {
        cube.third = o.collapsed.map_or(ThirdAxis::Largest, |axis| ThirdAxis::Bin(place[axis]));
    }
    Orientation::of(view, cube)
}

/// Three pictures that share their edges, and what is left: sides go by the axes' bins, within reason.
fn quarters(area: Rect, view: &View, planes: &[Orientation; 3]) -> [Rect; 4] {
    let bins = |axis: usize| view.axes[axis].bins.max(1) as f32;
    let share = |a: f32, b: f32| (a / (a + b)).clamp(0.3, 0.7);
    let width = area.width() - 2.0 * LEFT - GAP;
    let height = area.height() - 2.0 * BELOW - GAP;
    let left = width * share(bins(planes[0].horizontal), bins(planes[1].horizontal));
    let above = height * share(bins(planes[0].vertical), bins(planes[2].vertical));
    let at = |x: f32, y: f32, w: f32, h: f32| Rect::from_min_size(area.min + vec2(x, y), vec2(w.max(0.0), h.max(0.0)));
    let (x, y) = (2.0 * LEFT + left + GAP, above + BELOW + GAP);
    [
        at(LEFT, 0.0, left, above),
        at(x, 0.0, width - left, above),
        at(LEFT, y, left, height - above),
        at(x, y, width - left, height - above),
    ]
}

impl State {
    /// Makes the pictures anew where something in them changed; all three to one scale.
    fn draw_pictures(
        &mut self,
        ui: &Ui,
        session: &Session,
        view: &View,
        map: &[f64],
        planes: &[Orientation; 3],
        place: [usize; 3],
    ) {
        let look = &session.view;
        let colormap = Colormap::ALL.into_iter().find(|m| m.name().eq_ignore_ascii_case(&look.colormap));
        let address = |arc: Option<*const ()>| arc.map_or(0, |at| at as usize);
        let made = Made {
            look: self.look,
            place,
            scale: look.scale,
            range: look.range_of(&view.array),
            colormap: colormap.unwrap_or_default(),
            frame: address(session.data.frame.as_ref().map(|frame| Arc::as_ptr(frame).cast())),
            snapshot: address(session.fit.shown.as_ref().map(|shown| Arc::as_ptr(shown).cast())),
        };
        if self.made.as_ref() == Some(&made) {
            return;
        }
        let pictures = planes.map(|o| o.picture(view, map));
        let ends: Vec<usize> = pictures.iter().map(Vec::len).collect();
        // The largest of the whole map is the reference of every cut.
        let mut all = pictures.concat();
        all.push(map.iter().copied().filter(|x| x.is_finite()).fold(0.0, f64::max));
        let shown = shown(&all, made.scale, made.range, view.quantity.db_factor());
        let limits = limits(&shown.values, made.range);
        let mut from = 0;
        for (k, (o, len)) in planes.iter().zip(ends).enumerate() {
            let values = &shown.values[from..from + len];
            from += len;
            let image = colorize(o.size(view), values, limits, made.colormap, false, theme::NAN_CELL);
            match self.textures.get_mut(k) {
                Some(texture) => texture.set(image, TextureOptions::NEAREST),
                None => self.textures.push(ui.ctx().load_texture(format!("cut {k}"), image, TextureOptions::NEAREST)),
            }
        }
        self.made = Some(made);
        self.held = (session.data.frame.clone(), session.fit.shown.clone());
    }
}

/// One cut: picture, joints, cross-hairs. Answers the joint and the place that were clicked or dragged to.
fn plane(
    ui: &Ui,
    session: &Session,
    texture: Option<&TextureHandle>,
    rect: Rect,
    (view, o): (&View, Orientation),
    place: [usize; 3],
    tokens: &Tokens,
) -> Option<(Option<usize>, [usize; 3])> {
    let axes = [&view.axes[o.vertical], &view.axes[o.horizontal]];
    let name = format!("Cut of {} over {}", axes[0].shown_name(), axes[1].shown_name());
    let response = ui.interact(rect, ui.scope_id().with(&name), Sense::click_and_drag());
    response.widget_info(|| figure::spoken(&name, None));
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    if let Some(texture) = texture {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), rect, whole, egui::Color32::WHITE);
    }
    let to_screen = |unit: [f64; 2]| rect.min + vec2(unit[0] as f32 * rect.width(), unit[1] as f32 * rect.height());
    let joints = joints(&painter, session, view, o, &to_screen);
    let at = to_screen(o.grid_from_bins(view, [place[o.horizontal] as f64, place[o.vertical] as f64]));
    for (stroke, wide) in [(egui::Color32::from_black_alpha(120), 3.0), (egui::Color32::WHITE, 1.0)] {
        painter.hline(rect.x_range(), at.y, Stroke::new(wide, stroke));
        painter.vline(at.x, rect.y_range(), Stroke::new(wide, stroke));
    }
    ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    let pointer = (response.clicked() || response.dragged()).then(|| response.interact_pointer_pos()).flatten()?;
    let unit = [(pointer.x - rect.min.x) / rect.width(), (pointer.y - rect.min.y) / rect.height()].map(f64::from);
    let [across, up] = o.bins_from_unit(view, unit);
    let mut bins = place.map(|bin| bin as f64);
    (bins[o.horizontal], bins[o.vertical]) = (across, up);
    let near = |p: &Pos2| p.distance(pointer) < 6.0;
    let joint = response.clicked().then(|| joints.iter().position(near)).flatten();
    Some((joint, nearest(view, &bins)?))
}

/// Draws the joints and answers where they are.
fn joints(
    painter: &Painter,
    session: &Session,
    view: &View,
    o: Orientation,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
) -> Vec<Pos2> {
    let Some(problem) = session.fit.problem.as_ref().filter(|_| session.view.show_skeleton) else { return Vec::new() };
    let at = overlay::joints_on(session, view, o, to_screen);
    let joints = problem.skeleton.joints.len().max(1);
    for (joint, &at) in at.iter().enumerate() {
        let color = theme::DARK.side(problem.skeleton.side(joint % joints));
        let selected = session.joint == Some(joint);
        painter.circle(
            at,
            if selected { 4.0 } else { 2.2 },
            color,
            Stroke::new(1.0, egui::Color32::from_black_alpha(180)),
        );
        if selected {
            painter.circle_stroke(at, 7.0, Stroke::new(1.5, egui::Color32::WHITE));
        }
    }
    at
}

/// What is at the place: the axes' values, and both maps.
fn told(
    ui: &mut Ui,
    rect: Rect,
    view: &View,
    place: [usize; 3],
    (ori, sim): (&[f64], Option<&[f64]>),
    scale: MapScale,
    tokens: &Tokens,
) {
    let cell = (place[0] * view.axes[1].bins + place[1]) * view.axes[2].bins + place[2];
    let value = |map: &[f64]| -> String {
        let Some(&stored) = map.get(cell) else { return "–".into() };
        let largest = map.iter().copied().filter(|x| x.is_finite()).fold(0.0, f64::max);
        let range = ColorRange::Percentile { lo: 0.0, hi: 100.0 };
        let one = shown(&[stored, largest], MapScale::Decibel, range, view.quantity.db_factor());
        match (scale, one.values.first()) {
            (MapScale::Decibel, Some(db)) => format!("{stored:.4e}   {} dB re max", level(*db, one.floor)),
            _ => format!("{stored:.4e}"),
        }
    };
    let mut lines: Vec<String> = Vec::new();
    for (axis, bin) in view.axes.iter().zip(place) {
        lines.push(format!(
            "{:<16}{:>8.3} {}   bin {bin}",
            axis.shown_name(),
            axis.shown_at(bin as f64),
            axis.shown_unit()
        ));
    }
    lines.push(format!("{:<16}{}", "H_ori", value(ori)));
    lines.push(format!("{:<16}{}", "H_sim", sim.map_or_else(|| "–".into(), value)));
    let text = lines.join("\n").replace('-', "−");
    ui.scope_builder(egui::UiBuilder::new().max_rect(rect), |ui| {
        let label = ui.label(RichText::new(&text).font(theme::mono(theme::CAPTION)).color(tokens.text));
        label.named(Role::Label, &format!("At the place: {text}"));
        ui.label(
            RichText::new("Click or drag in a cut to look elsewhere; a joint that is selected is gone to.")
                .small()
                .color(tokens.dim),
        );
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::{Axis, AxisKind, PointSpread, Quantity, Spacing};

    fn cube() -> View {
        let axis = |kind, bins| Axis { kind, bins, lo: 0.0, hi: 1.0, spacing: Spacing::Linear };
        View {
            array: "cube".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread::default(),
            pose: crate::geometry::Pose::default(),
            axes: vec![axis(AxisKind::Doppler, 4), axis(AxisKind::Range, 5), axis(AxisKind::Cone, 6)],
            region: None,
        }
    }

    #[test]
    fn the_place_is_the_largest_cell_and_stays_inside() {
        let view = cube();
        let mut map = vec![0.0; view.cells()];
        map[(2 * 5 + 3) * 6 + 4] = 7.0;
        map[0] = f64::NAN;
        assert_eq!(peak(&view, &map), [2, 3, 4]);
        assert_eq!(nearest(&view, &[1.4, -3.0, 99.0]), Some([1, 0, 5]));
        assert_eq!(nearest(&view, &[f64::NAN, 0.0, 0.0]), None);
    }

    #[test]
    fn the_three_cuts_are_of_the_three_pairs_and_go_through_the_place() {
        let view = cube();
        let look = Look::default();
        let planes = PLANES.map(|axes| orientation(&view, &look, axes, [1, 2, 3]));
        let of = |o: Orientation| (o.vertical, o.horizontal, o.collapsed, o.third);
        assert_eq!(of(planes[0]), (1, 0, Some(2), ThirdAxis::Bin(3)));
        assert_eq!(of(planes[1]), (1, 2, Some(0), ThirdAxis::Bin(1)));
        assert_eq!(of(planes[2]), (2, 0, Some(1), ThirdAxis::Bin(2)));
        let area = Rect::from_min_size(pos2(0.0, 0.0), vec2(800.0, 500.0));
        let parts = quarters(area, &view, &planes);
        assert!((0..4).all(|a| area.contains_rect(parts[a]) && (0..a).all(|b| !parts[a].intersects(parts[b]))));
        assert_eq!(
            (parts[0].x_range(), parts[0].y_range()),
            (parts[2].x_range(), parts[1].y_range()),
            "they share edges"
        );
    }
}
