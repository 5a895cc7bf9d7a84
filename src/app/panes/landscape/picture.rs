//! The pictures of a slice: curves of L and its weighted terms along one direction, cells in colours over two.

use super::marks::{Mark, Marks, Role};
use super::term;
use crate::app::panes::explore::plane::{self, PlaneArea, PlaneAxis};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{round_step, tick};
use crate::explore::LossSlice;
use crate::mhp::TermId;
use crate::session::Session;
use egui::{Align2, Color32, Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};

/// Room for the names of the curves, points.
const LEGEND: f32 = 82.0;

/// The terms that are drawn: those that have a weight and are not 0 everywhere.
pub(super) fn terms(slice: &LossSlice) -> Vec<TermId> {
    let counts = |term: &TermId| {
        term.weight.of(&slice.config) != 0.0 && slice.values.iter().flatten().any(|value| value.terms[*term] != 0.0)
    };
    TermId::all().filter(counts).collect()
}

/// Draws the slice; answers where it is.
pub(super) fn draw(
    ui: &mut Ui,
    session: &Session,
    slice: &LossSlice,
    marks: &Marks,
    rect: Rect,
    tokens: &Tokens,
) -> Option<PlaneArea> {
    let bar = if slice.axes.len() > 1 { plane::BAR } else { LEGEND };
    let inner = Rect::from_min_max(
        pos2(rect.min.x + plane::LEFT, rect.min.y + 6.0),
        pos2(rect.max.x - bar, rect.max.y - plane::BELOW),
    );
    let area = PlaneArea::new(inner, slice.shape());
    if !inner.is_positive() {
        return None;
    }
    if slice.axes.len() > 1 {
        over(ui, session, slice, marks, &area, tokens)?;
    } else {
        along(ui, slice, marks, &area, tokens)?;
    }
    Some(area)
}

/// An axis with round numbers.
fn axis(slice: &LossSlice, k: usize, room: f32) -> PlaneAxis {
    let axis = &slice.axes[k];
    PlaneAxis { name: axis.title(), numbers: plane::round_numbers((axis.from, axis.to), axis.cells, room) }
}

fn over(
    ui: &mut Ui,
    session: &Session,
    slice: &LossSlice,
    marks: &Marks,
    area: &PlaneArea,
    tokens: &Tokens,
) -> Option<()> {
    let shown = term(session);
    let [across, up] = slice.shape();
    let values = (0..across * up).filter_map(|k| slice.value([k % across, k / across], shown));
    let limits = plane::limits(values)?;
    let painter = ui.painter().with_clip_rect(ui.clip_rect());
    let map = plane::colormap(session);
    plane::cells(&painter, area, limits, map, |[i, j]| {
        [1, 2, 4, 8].into_iter().find_map(|s| slice.value([i / s * s, j / s * s], shown))
    });
    let axes = [axis(slice, 0, area.rect.width()), axis(slice, 1, area.rect.height())];
    plane::axes(&painter, area, [&axes[0], &axes[1]], tokens);
    plane::scale(ui, area, map, limits, shown.map_or("L", |term| term.label));
    let inside = painter.with_clip_rect(area.rect.expand(1.0).intersect(ui.clip_rect()));
    let at = |place: &[f64]| area.at([slice.axes[0].place(place[0]), slice.axes[1].place(place[1])]);
    let way: Vec<Pos2> = marks.way.iter().map(|place| at(place)).collect();
    inside.add(egui::Shape::line(way.clone(), Stroke::new(3.5, Color32::from_black_alpha(150))));
    inside.add(egui::Shape::line(way, Stroke::new(1.5, Color32::WHITE)));
    for mark in &marks.places {
        sign(&inside, at(&mark.at), mark, tokens);
    }
    Some(())
}

/// A mark that is seen on every colour.
fn sign(painter: &Painter, at: Pos2, mark: &Mark, tokens: &Tokens) {
    let color = match mark.role {
        Role::Truth | Role::Pin => mark.color(tokens),
        _ => Color32::WHITE,
    };
    let dark = Color32::from_black_alpha(170);
    match mark.role {
        Role::Shown => plane::ring(painter, at, 6.0, color),
        Role::End => {
            painter.rect_filled(Rect::from_center_size(at, vec2(9.0, 9.0)), 0.0, dark);
            painter.rect_filled(Rect::from_center_size(at, vec2(6.0, 6.0)), 0.0, color);
        }
        Role::Start => {
            let corners = |r: f32| vec![at + vec2(0.0, -r), at + vec2(r, 0.0), at + vec2(0.0, r), at + vec2(-r, 0.0)];
            painter.add(egui::Shape::convex_polygon(corners(7.0), dark, Stroke::NONE));
            painter.add(egui::Shape::convex_polygon(corners(4.5), color, Stroke::NONE));
        }
        Role::Pin => {
            let corners = |r: f32| vec![at + vec2(0.0, -r), at + vec2(r, 0.8 * r), at + vec2(-r, 0.8 * r)];
            painter.add(egui::Shape::convex_polygon(corners(8.0), dark, Stroke::NONE));
            painter.add(egui::Shape::convex_polygon(corners(5.5), color, Stroke::NONE));
        }
        Role::Truth => {
            for (stroke, arm) in [(Stroke::new(4.5, dark), 8.0), (Stroke::new(2.0, color), 7.0)] {
                painter.line_segment([at - vec2(arm, 0.0), at + vec2(arm, 0.0)], stroke);
                painter.line_segment([at - vec2(0.0, arm), at + vec2(0.0, arm)], stroke);
            }
        }
    }
}

fn along(ui: &Ui, slice: &LossSlice, marks: &Marks, area: &PlaneArea, tokens: &Tokens) -> Option<()> {
    let (rect, painter) = (area.rect, ui.painter().with_clip_rect(ui.clip_rect()));
    let terms = terms(slice);
    let cells = slice.shape()[0];
    let curve = |of: &dyn Fn(usize) -> Option<f64>| -> Vec<(usize, f64)> {
        (0..cells).filter_map(|k| Some((k, of(k)?))).collect()
    };
    let values = curve(&|k| slice.value([k, 0], None));
    let mut curves = vec![Curve { name: "L", color: tokens.text, width: 2.0, values }];
    for &id in &terms {
        let weight = id.weight.of(&slice.config);
        let values = curve(&|k| slice.value([k, 0], Some(id)).map(|value| value * weight));
        curves.push(Curve { name: id.label, color: tokens.hue(id.hue), width: 1.5, values });
    }
    // Bones that stretch cost far more than an echo that is missed: what lies above thrice L's least rise is cut off.
    let (lo, top) = plane::limits(curves[0].values.iter().map(|(_, value)| *value))?;
    let mut rising: Vec<f64> = curves[0].values.iter().map(|(_, value)| *value).collect();
    rising.sort_by(f64::total_cmp);
    let most = rising.get(rising.len() * 9 / 10).copied().unwrap_or(top);
    let (lo, hi) = (lo.min(0.0), lo + 1.08 * (most - lo).max(1e-6));
    let y = |value: f64| rect.max.y - ((value - lo) / (hi - lo)) as f32 * rect.height();
    let x = |k: f64| area.at([k, 0.0]).x;
    let step = round_step((hi - lo) / f64::from((rect.height() / 34.0).clamp(1.0, 8.0)));
    let lines = ((lo / step).ceil() as i64..).map(|k| k as f64 * step).take_while(|value| *value <= hi).take(20);
    for value in lines {
        painter.hline(rect.x_range(), y(value), Stroke::new(1.0, tokens.stroke));
        painter.text(
            pos2(rect.min.x - 5.0, y(value)),
            Align2::RIGHT_CENTER,
            tick(value, hi - lo),
            theme::mono(10.0),
            tokens.dim,
        );
    }
    let inside = painter.with_clip_rect(rect.intersect(ui.clip_rect()));
    for Curve { color, width, values, .. } in curves.iter().rev() {
        let line = values.iter().map(|&(k, value)| pos2(x(k as f64), y(value))).collect();
        inside.add(egui::Shape::line(line, Stroke::new(*width, *color)));
    }
    for mark in &marks.places {
        let at = slice.axes[0].place(mark.at[0]);
        if !(0.0..=(cells - 1) as f64).contains(&at) {
            continue;
        }
        inside.vline(x(at), rect.y_range(), Stroke::new(1.0, mark.color(tokens).gamma_multiply(0.8)));
        inside.text(
            pos2(x(at) + 3.0, rect.min.y + 2.0),
            Align2::LEFT_TOP,
            mark.sign,
            theme::mono(11.0),
            mark.color(tokens),
        );
    }
    let ticks = marks.way.iter().map(|place| slice.axes[0].place(place[0]));
    for at in ticks.filter(|at| (0.0..=(cells - 1) as f64).contains(at)) {
        inside.vline(x(at), rect.max.y - 6.0..=rect.max.y, Stroke::new(1.0, tokens.dim));
    }
    let up = PlaneAxis { name: "L, terms × weights".into(), numbers: Vec::new() };
    plane::axes(&painter, area, [&axis(slice, 0, rect.width()), &up], tokens);
    legend(&painter, rect, &curves, tokens);
    Some(())
}

/// A line: its name, and sample and value of its places.
struct Curve {
    name: &'static str,
    color: Color32,
    width: f32,
    values: Vec<(usize, f64)>,
}

/// What the curves are, at the right of the picture.
fn legend(painter: &Painter, rect: Rect, curves: &[Curve], tokens: &Tokens) {
    let font = egui::FontId::proportional(theme::CAPTION);
    for (k, Curve { name, color, width, .. }) in curves.iter().enumerate() {
        let (left, y) = (rect.max.x + 12.0, rect.min.y + 6.0 + 15.0 * k as f32);
        painter.hline(left..=left + 14.0, y, Stroke::new(*width, *color));
        painter.text(pos2(left + 18.0, y), Align2::LEFT_CENTER, name, font.clone(), tokens.text);
    }
}
