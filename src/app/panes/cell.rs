//! Who lit this cell: the joints that send something back to the cell under the pointer, how they interfere, and what each joint is
//! worth to the agreement of the maps. The cell stays when the pointer leaves the maps; joints that are pointed at here glow
//! elsewhere.

use super::answered::Answered;
use super::lit::{cell_at, joint_name, lit};
use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::figure;
use crate::app::map_image::Orientation;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Mark;
use crate::explore::{IdleCores, LeaveOneOut, leave_one_out};
use crate::mhp::JointReturn;
use crate::session::{Command, Session};
use crate::task::Progress;
use egui::{Align2, Color32, FontId, Rect, RichText, Role, Sense, Stroke, Ui, pos2, vec2};

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Cell",
    title: "Who lit it",
    icon: &[
        Mark::Dot([8.0, 8.0], 2.5),
        Mark::Line(&[[8.0, 1.0], [8.0, 4.0]]),
        Mark::Line(&[[8.0, 12.0], [8.0, 15.0]]),
        Mark::Line(&[[1.0, 8.0], [4.0, 8.0]]),
        Mark::Line(&[[12.0, 8.0], [15.0, 8.0]]),
    ],
    help: "the joints that light the cell under the pointer, and what each joint is worth",
    dock: Dock::BottomHigh,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: None,
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

#[derive(Default)]
struct State {
    /// View and pixel that were pointed at last.
    cell: Option<(usize, [usize; 2])>,
    /// The worth of the joints of a state.
    worth: Answered<(), LeaveOneOut>,
}

impl PaneState for State {
    fn is_working(&self) -> bool {
        self.worth.is_working()
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Once a frame has joints, point at a cell of any map: this says who lit it.";
    (session.fit.shown.is_none() || session.fit.problem.is_none()).then(|| Blank::new("No fit", how))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    state.cell = shared.pointed.cell.or(state.cell);
    follow(ui, session, state);
    let caption = figure::of(session, "joints that light a cell; drop of IoU without each joint");
    let area = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    let response = ui.interact(area, ui.scope_id().with("who lit it"), Sense::hover());
    response.widget_info(|| figure::spoken("Who lit the cell", caption.as_deref()));
    // While this is pointed at, the cell is shown elsewhere too.
    let inside = ui.rect_contains_pointer(area);
    if inside {
        shared.points.cell = state.cell;
    }
    let right = (0.36 * area.width()).clamp(150.0, 340.0).min(0.45 * area.width());
    let (left, worth) = area.split_left_right_at_x(area.max.x - right);
    ui.scope_builder(egui::UiBuilder::new().max_rect(left.with_max_x(left.max.x - 8.0)), |ui| {
        lit_by(ui, shared, state, &tokens);
    });
    ui.scope_builder(egui::UiBuilder::new().max_rect(worth), |ui| worths(ui, shared, state, &tokens));
}

/// Asks for the worth of the joints of a state that rests.
fn follow(ui: &Ui, session: &Session, state: &mut State) {
    state.worth.poll();
    state.worth.ask((ui, session), (), "leave-one-out", |_| {
        let state = session.explored_state().ok()?;
        Some(move |with: (&IdleCores, &Progress)| leave_one_out(&state, with))
    });
}

fn color(session: &Session, joint: usize, tokens: &Tokens) -> Color32 {
    let Some(problem) = &session.fit.problem else { return tokens.dim };
    tokens.side(problem.skeleton.side(joint % problem.skeleton.joints.len().max(1)))
}

fn lit_by(ui: &mut Ui, shared: &mut Shared<'_>, state: &State, tokens: &Tokens) {
    let session = shared.session;
    let (Some(lit), Some(dataset)) = (lit(ui.ctx(), session), &session.data.dataset) else { return };
    let views = &dataset.info().views;
    let pointed = state.cell.and_then(|(index, pixel)| {
        let view = views.get(index)?;
        let map = session.fit.shown.as_ref()?.h_sim.get(index).map(Vec::as_slice);
        let cell = cell_at(view, Orientation::of(view, session.view.cube), pixel, map)?;
        Some((index, view, cell))
    });
    if pointed.is_none() {
        let hint = "The brightest cell of H_sim. Point at a cell of any map for another one.";
        ui.label(RichText::new(hint).small().color(tokens.dim));
    }
    let Some((index, view, cell)) = pointed.or_else(|| Some((0, views.first()?, brightest(session, 0)?))) else {
        return;
    };
    let returns = lit.returns.at(index, cell);
    let bins = crate::radar::unravel(cell, &view.shape());
    let place: Vec<String> = view
        .axes
        .iter()
        .zip(&bins)
        .map(|(axis, &bin)| format!("{} {:.2} {}", axis.shown_name(), axis.shown_at(bin as f64), axis.shown_unit()))
        .collect();
    ui.horizontal(|ui| {
        ui.label(RichText::new(&view.array).font(theme::strong(theme::CAPTION)));
        ui.label(RichText::new(place.join("  ")).font(theme::mono(theme::CAPTION)).color(tokens.dim));
    });
    let area = ui.available_rect_before_wrap();
    let side = if lit.returns.is_coherent() { area.height().min(0.4 * area.width()).min(180.0) } else { 0.0 };
    let (list, diagram) = area.split_left_right_at_x(area.max.x - side);
    ui.scope_builder(egui::UiBuilder::new().max_rect(list.with_max_x(list.max.x - 6.0)), |ui| {
        egui::ScrollArea::vertical().id_salt("lit by").auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for of in returns.iter().filter(|of| of.amplitude_share > 2e-3) {
                let told = format!(
                    "{:.0} % of the amplitudes, {:+.0} % of the cell",
                    100.0 * of.amplitude_share,
                    100.0 * of.share
                );
                let bar = Bar {
                    joint: of.joint,
                    share: of.amplitude_share,
                    text: format!("{:.0} %", 100.0 * of.amplitude_share),
                    told,
                };
                row(ui, shared, &bar, tokens);
            }
        });
    });
    if side > 40.0 {
        phasors(ui, session, diagram, &returns, tokens);
    }
}

/// The flat index of the cell where H_sim of a view is largest.
fn brightest(session: &Session, view: usize) -> Option<usize> {
    let map = session.fit.shown.as_ref()?.h_sim.get(view)?;
    (0..map.len()).max_by(|&a, &b| map[a].total_cmp(&map[b]))
}

/// A bar of a joint.
struct Bar {
    joint: usize,
    /// Its length, −1..1 of what there is room for.
    share: f64,
    text: String,
    told: String,
}

const ROW: f32 = 15.0;

fn row(ui: &mut Ui, shared: &mut Shared<'_>, bar: &Bar, tokens: &Tokens) {
    let session = shared.session;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let name = joint_name(session, bar.joint);
    let pointed = response.hovered() || shared.pointed.joint == Some(bar.joint);
    if response.hovered() {
        shared.points.joint = Some(bar.joint);
    }
    response.widget_info(|| {
        let mut info = egui::WidgetInfo::labeled(Role::Button, true, format!("Joint {name}"));
        info.current_text_value = Some(bar.told.clone());
        info
    });
    let response = response.on_hover_text(format!("{name}: {}\nClick to select it.", bar.told));
    if response.clicked() {
        shared.send(Command::SelectJoint(Some(bar.joint)));
    }
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    if pointed {
        painter.rect_filled(rect, 2.0, tokens.raised);
    }
    let font = FontId::proportional(theme::CAPTION);
    let written = painter.layout_no_wrap(bar.text.clone(), theme::mono(theme::CAPTION), tokens.dim);
    let (label, number) = ((0.42 * rect.width()).clamp(60.0, 110.0), written.size().x.max(38.0) + 6.0);
    let selected = session.joint == Some(bar.joint);
    painter.with_clip_rect(rect.with_max_x(rect.min.x + label - 4.0)).text(
        rect.left_center(),
        Align2::LEFT_CENTER,
        &name,
        font,
        if selected { tokens.selected } else { tokens.text },
    );
    let field =
        Rect::from_min_max(pos2(rect.min.x + label, rect.min.y + 3.0), pos2(rect.max.x - number, rect.max.y - 3.0));
    let length = bar.share.abs().min(1.0) as f32 * field.width().max(0.0);
    let filled = Rect::from_min_size(field.min, vec2(length, field.height()));
    let color = color(session, bar.joint, tokens);
    if bar.share < 0.0 {
        painter.rect_stroke(filled, 0.0, Stroke::new(1.0, color), egui::StrokeKind::Inside);
    } else {
        painter.rect_filled(filled, 0.0, color);
    }
    let at = rect.right_center() - vec2(written.size().x, 0.5 * written.size().y);
    painter.galley(at, written, tokens.dim);
}

/// The returns as arrows one after the other, the strongest first, and their sum: who interferes with whom.
fn phasors(ui: &Ui, session: &Session, rect: Rect, returns: &[JointReturn], tokens: &Tokens) {
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let mut at = [0.0_f64; 2];
    let mut way = vec![at];
    for of in returns {
        at = [at[0] + of.amplitude * of.phase_rad.cos(), at[1] + of.amplitude * of.phase_rad.sin()];
        way.push(at);
    }
    let (lo, hi) = way.iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(lo, hi), p| {
        ([lo[0].min(p[0]), lo[1].min(p[1])], [hi[0].max(p[0]), hi[1].max(p[1])])
    });
    let span = (hi[0] - lo[0]).max(hi[1] - lo[1]).max(f64::MIN_POSITIVE);
    let inner = rect.shrink(10.0);
    let middle = [0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])];
    let side = f64::from(inner.width().min(inner.height()));
    let place = |p: [f64; 2]| {
        inner.center() + vec2(((p[0] - middle[0]) / span * side) as f32, (-(p[1] - middle[1]) / span * side) as f32)
    };
    painter.rect_stroke(rect.shrink(2.0), 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Inside);
    for (of, two) in returns.iter().zip(way.windows(2)).filter(|(of, _)| of.amplitude_share > 2e-3) {
        let (from, to) = (place(two[0]), place(two[1]));
        arrow(&painter, from, to, Stroke::new(1.5, color(session, of.joint, tokens)));
    }
    arrow(&painter, place([0.0; 2]), place(at), Stroke::new(2.0, tokens.text));
    painter.text(rect.left_top() + vec2(6.0, 4.0), Align2::LEFT_TOP, "phasors", FontId::proportional(9.0), tokens.dim);
    let sum: f64 = returns.iter().map(|of| of.amplitude).sum();
    let kept = if sum > 0.0 { (at[0] * at[0] + at[1] * at[1]).sqrt() / sum } else { 0.0 };
    let told = format!("{:.0} % is left", 100.0 * kept);
    painter.text(
        rect.right_bottom() - vec2(6.0, 4.0),
        Align2::RIGHT_BOTTOM,
        &told,
        FontId::proportional(9.0),
        tokens.dim,
    );
    let response = ui.interact(rect, ui.scope_id().with("phasors"), Sense::hover());
    response.widget_info(|| {
        figure::spoken("Phasor diagram", Some(&format!("{told} of the amplitudes after interference")))
    });
    response.on_hover_text(
        "The joints' returns one after the other, the strongest first; the dark arrow is their sum. What is left of the amplitudes after they interfere.",
    );
}

fn arrow(painter: &egui::Painter, from: egui::Pos2, to: egui::Pos2, stroke: Stroke) {
    painter.line_segment([from, to], stroke);
    let along = to - from;
    if along.length() > 6.0 {
        let back = along.normalized() * -5.0;
        for turn in [0.45_f32, -0.45] {
            let (s, c) = turn.sin_cos();
            painter.line_segment([to, to + vec2(back.x * c - back.y * s, back.x * s + back.y * c)], stroke);
        }
    }
}

fn worths(ui: &mut Ui, shared: &mut Shared<'_>, state: &State, tokens: &Tokens) {
    let worth = match state.worth.last() {
        Some(Ok(worth)) => worth.clone(),
        Some(Err(why)) => {
            ui.label(RichText::new(why).small().color(tokens.bad));
            return;
        }
        None => {
            ui.label(RichText::new("Leaving joints out …").small().color(tokens.dim));
            return;
        }
    };
    let stale = shared.session.fit.shown.as_ref().is_some_and(|shown| state.worth.is_of_another(shown));
    let iou = worth.iou.map_or_else(|| "—".into(), |iou| format!("{iou:.3}"));
    let text = format!("IoU {iou}; its drop without a joint{}", if stale { " (of the last rest)" } else { "" });
    ui.label(RichText::new(text).small().color(tokens.dim)).on_hover_text(
        "The masks of H_ori and of H_sim without what one joint sends back; nothing is fitted anew. An empty bar: the maps agree better without it.",
    );
    let most = worth.joints.iter().map(|of| of.drop.abs()).fold(1e-6, f64::max);
    egui::ScrollArea::vertical().id_salt("worth").auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        for of in &worth.joints {
            let told = format!("IoU {:+.4} without it", -of.drop);
            let bar = Bar { joint: of.joint, share: of.drop / most, text: format!("{:+.3}", -of.drop), told };
            row(ui, shared, &bar, tokens);
        }
    });
}
