//! Bars with error bars: a bar a row, named, with the paper's figure as a mark where there is one.

use super::measure::{PlottedQuantity, Value, Values};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::study::run::Run;
use egui::{Align2, Color32, Pos2, Rect, Role, Sense, Stroke, Ui, pos2, vec2};

const ROW: f32 = 20.0;

/// Draws the bars; answers the row that was clicked.
pub(super) fn show(
    ui: &mut Ui,
    run: &Run,
    measure: PlottedQuantity,
    values: &Values,
    chosen: Option<usize>,
    tokens: &Tokens,
) -> Option<usize> {
    let font = egui::FontId::proportional(theme::CAPTION);
    let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), tokens.text).size().x;
    let names: Vec<String> = run.table.iter().map(|row| row.labels.join(", ")).collect();
    let written = written(run, &names);
    let widest = written.iter().map(|name| width(name)).fold(0.0, f32::max);
    let whole = ui.available_width().clamp(240.0, 900.0);
    let left = widest.min(0.52 * whole) + 8.0;
    let reach = values.iter().flatten().map(|v| (v.mean + v.error).max(v.paper.unwrap_or(0.0))).fold(0.0, f64::max);
    let scale = Scale { from: left, to: whole - 56.0, reach: reach.max(1e-9) };
    let mut clicked = None;
    title(ui, measure, values, tokens);
    for (k, name) in names.iter().enumerate() {
        let (rect, response) = ui.allocate_exact_size(vec2(whole, ROW), Sense::click());
        let value = values.get(k).copied().flatten();
        let told = value.map_or_else(|| "unknown".to_owned(), |v| spoken(measure, &v));
        let response = response.named(Role::Button, &format!("Bar {name}: {told}"));
        if response.on_hover_text(format!("{name}\n{told}\nClick to put these frames into the list.")).clicked() {
            clicked = Some(k);
        }
        let on = chosen == Some(k) || ui.rect_contains_pointer(rect);
        if on {
            ui.painter().rect_filled(rect, 2.0, tokens.raised);
        }
        let painter = ui.painter().with_clip_rect(rect.with_max_x(rect.min.x + left - 6.0).intersect(ui.clip_rect()));
        painter.text(pos2(rect.min.x, rect.center().y), Align2::LEFT_CENTER, &written[k], font.clone(), tokens.text);
        if let Some(value) = value {
            bar(ui, rect, &scale, measure, &value, chosen == Some(k), tokens);
        }
    }
    clicked
}

/// What is written beside a bar: the last label where that tells the rows apart, else all of them.
fn written(run: &Run, names: &[String]) -> Vec<String> {
    let last: Vec<String> = run.table.iter().map(|row| row.labels.last().cloned().unwrap_or_default()).collect();
    let distinct: std::collections::BTreeSet<&String> = last.iter().collect();
    if distinct.len() == last.len() { last } else { names.to_vec() }
}

fn spoken(measure: PlottedQuantity, value: &Value) -> String {
    let unit = measure.unit();
    let error = if value.error > 0.0 { format!(" ± {}", measure.text(value.error)) } else { String::new() };
    let paper = value.paper.map(|paper| format!(", paper {}", measure.text(paper))).unwrap_or_default();
    format!("{}{error} {unit}{paper}", measure.text(value.mean)).trim_end().to_owned()
}

/// What is drawn, and what its marks mean.
fn title(ui: &mut Ui, measure: PlottedQuantity, values: &Values, tokens: &Tokens) {
    let paper = values.iter().flatten().any(|value| value.paper.is_some());
    let marks = if paper { ", with its standard error   ◆ paper" } else { ", with its standard error" };
    let text = egui::RichText::new(format!("{}{marks}", measure.title())).small().color(tokens.dim);
    ui.label(text);
}

/// From values to points.
struct Scale {
    from: f32,
    to: f32,
    reach: f64,
}

impl Scale {
    fn x(&self, rect: Rect, value: f64) -> f32 {
        rect.min.x + self.from + (self.to - self.from) * (value / self.reach).clamp(0.0, 1.0) as f32
    }
}

fn bar(ui: &Ui, rect: Rect, scale: &Scale, measure: PlottedQuantity, value: &Value, chosen: bool, tokens: &Tokens) {
    let painter = ui.painter();
    let (zero, end) = (scale.x(rect, 0.0), scale.x(rect, value.mean));
    let fill = if chosen { tokens.accent } else { tokens.accent.gamma_multiply(0.55) };
    let body = Rect::from_min_max(pos2(zero, rect.min.y + 4.0), pos2(end.max(zero + 1.0), rect.max.y - 4.0));
    painter.rect_filled(body, 1.0, fill);
    let middle = rect.center().y;
    if value.error > 0.0 {
        let (a, b) = (scale.x(rect, value.mean - value.error), scale.x(rect, value.mean + value.error));
        let stroke = Stroke::new(1.0, tokens.text);
        painter.hline(a..=b, middle, stroke);
        for x in [a, b] {
            painter.vline(x, middle - 3.0..=middle + 3.0, stroke);
        }
    }
    if let Some(paper) = value.paper {
        diamond(painter, pos2(scale.x(rect, paper), middle), tokens.warn);
    }
    let text = measure.text(value.mean);
    painter.text(pos2(rect.max.x - 2.0, middle), Align2::RIGHT_CENTER, text, theme::mono(theme::CAPTION), tokens.text);
}

fn diamond(painter: &egui::Painter, at: Pos2, color: Color32) {
    let corners = [vec2(0.0, -5.0), vec2(4.0, 0.0), vec2(0.0, 5.0), vec2(-4.0, 0.0)].map(|d| at + d).to_vec();
    painter.add(egui::Shape::convex_polygon(corners, color, Stroke::NONE));
}
