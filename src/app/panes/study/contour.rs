//! Two numbers: the quantity as a map between the grid's points, with lines of equal value, and a point a row.
//!
//! The points stand at equal distances whatever their values are: grids are often geometric, and each column is labelled.
//! The lines are found here, not by the crate `contour`: that one closes every line along the border of the map, and knows
//! no point without a value.

use super::measure::{PlottedQuantity, Values, levels, limits};
use crate::app::map_image::Histogram;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{ColorBar, Named as _, colorbar};
use crate::render::Colormap;
use crate::session::Session;
use crate::study::run::Run;
use egui::{Align2, Color32, Mesh, Pos2, Rect, Role, Sense, Stroke, Ui, pos2, vec2};

/// Cells between two points of the grid, along each axis: colours are linear within one.
const FINE: usize = 24;
/// Lines of equal value.
const LINES: usize = 6;

/// The grid of values: `at(column, row)`.
struct Field {
    across: Vec<String>,
    up: Vec<String>,
    values: Vec<Option<f64>>,
    /// The table's row of each point.
    rows: Vec<Option<usize>>,
}

impl Field {
    fn of(run: &Run, values: &Values) -> Self {
        let (across, up) = (levels(run, 0), levels(run, 1));
        let mut field = Self { values: vec![None; across.len() * up.len()], rows: Vec::new(), across, up };
        field.rows = vec![None; field.values.len()];
        for (k, row) in run.table.iter().enumerate() {
            let find = |levels: &[String], column: usize| levels.iter().position(|l| Some(l) == row.labels.get(column));
            let (Some(i), Some(j)) = (find(&field.across, 0), find(&field.up, 1)) else { continue };
            let at = j * field.across.len() + i;
            (field.values[at], field.rows[at]) = (values.get(k).copied().flatten().map(|v| v.mean), Some(k));
        }
        field
    }

    fn at(&self, i: usize, j: usize) -> Option<f64> {
        self.values.get(j * self.across.len() + i).copied().flatten()
    }

    /// Bilinear between the points around; `None` where one of them is unknown.
    fn between(&self, x: f64, y: f64) -> Option<f64> {
        let place = |x: f64, n: usize| {
            let lower = (x.floor().max(0.0) as usize).min(n.saturating_sub(2));
            (lower, x - lower as f64)
        };
        let ((i, s), (j, t)) = (place(x, self.across.len()), place(y, self.up.len()));
        let [a, b, c, d] = [self.at(i, j)?, self.at(i + 1, j)?, self.at(i, j + 1)?, self.at(i + 1, j + 1)?];
        Some((1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * c + s * d))
    }
}

/// Draws the map; answers the row of the point that was clicked.
pub(super) fn show(
    ui: &mut Ui,
    run: &Run,
    measure: PlottedQuantity,
    values: &Values,
    session: &Session,
    height: f32,
    tokens: &Tokens,
) -> Option<usize> {
    let field = Field::of(run, values);
    let map = Colormap::ALL.into_iter().find(|map| map.name().eq_ignore_ascii_case(&session.view.colormap));
    let map = map.unwrap_or_default();
    let limits = limits(values);
    let whole = vec2(ui.available_width().clamp(260.0, 640.0), height);
    let (rect, response) = ui.allocate_exact_size(whole, Sense::hover());
    let name = format!("Contour of {} over {}", measure.title(), run.spec.columns.join(" and "));
    response.named(Role::Canvas, &name);
    let area = Rect::from_min_max(rect.min + vec2(64.0, 10.0), rect.max - vec2(74.0, 40.0));
    let step =
        vec2(area.width() / (field.across.len() - 1).max(1) as f32, area.height() / (field.up.len() - 1).max(1) as f32);
    let place = |x: f64, y: f64| pos2(area.min.x + x as f32 * step.x, area.max.y - y as f32 * step.y);
    paint(ui, &field, limits, map, &place);
    iso_lines(ui, &field, limits, &place, tokens);
    axes(ui, run, &field, area, &place, tokens);
    let bar = Rect::from_min_max(pos2(area.max.x + 10.0, area.min.y - 10.0), pos2(rect.max.x, area.max.y));
    // The scale is the table's own: there is nothing to set.
    let histogram = Histogram { span: limits, heights: Vec::new() };
    let floor = f64::NEG_INFINITY;
    let _ = colorbar(ui, &ColorBar { rect: bar, map, limits, histogram, floor, unit: measure.unit(), row: None });
    points(ui, run, &field, measure, &place, tokens)
}

fn paint(ui: &Ui, field: &Field, (lo, hi): (f64, f64), map: Colormap, place: &dyn Fn(f64, f64) -> Pos2) {
    let mut mesh = Mesh::default();
    let (columns, rows) = ((field.across.len() - 1) * FINE, (field.up.len() - 1) * FINE);
    let cell = 1.0 / FINE as f64;
    for j in 0..rows {
        for i in 0..columns {
            let (x, y) = (i as f64 * cell, j as f64 * cell);
            let Some(value) = field.between(x + 0.5 * cell, y + 0.5 * cell) else { continue };
            let [r, g, b] = map.sample((value - lo) / (hi - lo));
            let (a, b2) = (place(x, y + cell), place(x + cell, y));
            mesh.add_colored_rect(Rect::from_min_max(a, b2), Color32::from_rgb(r, g, b));
        }
    }
    ui.painter().add(egui::Shape::mesh(mesh));
}

/// Marching squares on the fine cells: a line piece where the value crosses a level.
fn iso_lines(ui: &Ui, field: &Field, (lo, hi): (f64, f64), place: &dyn Fn(f64, f64) -> Pos2, tokens: &Tokens) {
    let stroke = Stroke::new(1.0, tokens.canvas.gamma_multiply(0.7));
    let cell = 1.0 / FINE as f64;
    for level in (1..=LINES).map(|k| lo + (hi - lo) * k as f64 / (LINES + 1) as f64) {
        for j in 0..(field.up.len() - 1) * FINE {
            for i in 0..(field.across.len() - 1) * FINE {
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| {
                    let (x, y) = ((i + a) as f64 * cell, (j + b) as f64 * cell);
                    (x, y, field.between(x, y))
                });
                let mut crossings = (0..4).filter_map(|k| {
                    let ((x0, y0, a), (x1, y1, b)) = (corners[k], corners[(k + 1) % 4]);
                    let (a, b) = (a? - level, b? - level);
                    let t = a / (a - b);
                    ((a < 0.0) != (b < 0.0)).then(|| place(x0 + t * (x1 - x0), y0 + t * (y1 - y0)))
                });
                while let (Some(from), Some(to)) = (crossings.next(), crossings.next()) {
                    ui.painter().line_segment([from, to], stroke);
                }
            }
        }
    }
}

fn axes(ui: &Ui, run: &Run, field: &Field, area: Rect, place: &dyn Fn(f64, f64) -> Pos2, tokens: &Tokens) {
    let (painter, small) = (ui.painter(), theme::mono(10.0));
    painter.rect_stroke(area, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    for (i, level) in field.across.iter().enumerate() {
        let at = pos2(place(i as f64, 0.0).x, area.max.y + 6.0);
        painter.text(at, Align2::CENTER_TOP, level, small.clone(), tokens.dim);
    }
    for (j, level) in field.up.iter().enumerate() {
        let at = pos2(area.min.x - 8.0, place(0.0, j as f64).y);
        painter.text(at, Align2::RIGHT_CENTER, level, small.clone(), tokens.dim);
    }
    let font = egui::FontId::proportional(theme::CAPTION);
    let name = |column: usize| run.spec.columns.get(column).cloned().unwrap_or_default();
    painter.text(pos2(area.center().x, area.max.y + 22.0), Align2::CENTER_TOP, name(0), font.clone(), tokens.text);
    let upright = painter.layout_no_wrap(name(1), font, tokens.text);
    let at = pos2(area.min.x - 60.0, area.center().y + 0.5 * upright.size().x);
    let turned = egui::epaint::TextShape::new(at, upright, tokens.text).with_angle(-std::f32::consts::FRAC_PI_2);
    painter.add(turned);
}

/// A point a row of the table; the one that was clicked.
fn points(
    ui: &mut Ui,
    run: &Run,
    field: &Field,
    measure: PlottedQuantity,
    place: &dyn Fn(f64, f64) -> Pos2,
    tokens: &Tokens,
) -> Option<usize> {
    let mut clicked = None;
    for j in 0..field.up.len() {
        for i in 0..field.across.len() {
            let Some(row) = field.rows[j * field.across.len() + i] else { continue };
            let at = place(i as f64, j as f64);
            let id = ui.scope_id().with(("grid point", i, j));
            let response = ui.interact(Rect::from_center_size(at, vec2(14.0, 14.0)), id, Sense::click());
            let value = field.at(i, j).map_or_else(|| "unknown".into(), |value| measure.text(value));
            let name = run.table.get(row).map(|row| row.labels.join(", ")).unwrap_or_default();
            let response = response.named(Role::Button, &format!("Point {name}: {value}"));
            let radius = if response.hovered() { 5.0 } else { 3.0 };
            ui.painter().circle(at, radius, tokens.canvas, Stroke::new(1.5, tokens.text));
            let tip = format!("{}\n{} {value} {}", name, measure.short(), measure.unit());
            if response.on_hover_text(tip).clicked() {
                clicked = Some(row);
            }
        }
    }
    clicked
}
