//! Curves over a number: a curve for each group of the other labels, error bars at its points, the paper's figures beside.

use super::measure::{PlottedQuantity, Values};
use super::number;
use crate::app::theme::Tokens;
use crate::study::run::Run;
use egui::{Color32, Ui, WidgetInfo};
use egui_plot::{Legend, Line, LineStyle, Plot, PlotPoints, Points};

struct Series {
    name: String,
    color: Color32,
    /// x, mean, standard error, row.
    points: Vec<(f64, f64, f64, usize)>,
    paper: Vec<[f64; 2]>,
}

/// Draws the curves; answers the row of the point that was clicked.
pub(super) fn show(
    ui: &mut Ui,
    run: &Run,
    measure: PlottedQuantity,
    values: &Values,
    height: f32,
    tokens: &Tokens,
) -> Option<usize> {
    let series = series(run, values, tokens);
    let axis = run.spec.columns.last().cloned().unwrap_or_default();
    let axis = if axis == "tau" { "τ, %".to_owned() } else { axis };
    let legend = series.len() > 1 || series.iter().any(|s| !s.paper.is_empty());
    let mut plot = Plot::new(("study lines", measure.short()))
        .height(height)
        .width(ui.available_width().clamp(240.0, 900.0))
        .show_grid([true, true])
        .grid_color(tokens.stroke)
        .allow_scroll(false)
        .allow_zoom(false)
        .allow_drag(false)
        .set_margin_fraction(egui::vec2(0.05, 0.12))
        .x_axis_label(axis)
        .y_axis_label(measure.title())
        .y_axis_min_width(40.0);
    if legend {
        plot = plot.legend(Legend::default());
    }
    let response = plot.show(ui, |plot| {
        for s in &series {
            let line: Vec<[f64; 2]> = s.points.iter().map(|&(x, y, ..)| [x, y]).collect();
            plot.line(Line::new(s.name.clone(), PlotPoints::from(line.clone())).color(s.color).width(2.0));
            plot.points(Points::new(s.name.clone(), line).color(s.color).radius(3.5));
            for &(x, y, error, _) in s.points.iter().filter(|point| point.2 > 0.0) {
                let bar = Line::new(s.name.clone(), PlotPoints::from(vec![[x, y - error], [x, y + error]]));
                plot.line(bar.color(s.color).width(1.0).allow_hover(false));
            }
            if !s.paper.is_empty() {
                let line = Line::new("paper", PlotPoints::from(s.paper.clone()));
                plot.line(line.color(tokens.warn).width(1.5).style(LineStyle::dashed_loose()));
            }
        }
        (plot.pointer_coordinate(), plot.response().clone())
    });
    let (transform, (pointer, inner)) = (response.transform, response.inner);
    let name = format!("Plot of {} by {}", measure.title(), run.spec.columns.join(" and "));
    inner.widget_info(|| WidgetInfo::labeled(egui::Role::Canvas, true, &name));
    let at = pointer.filter(|_| inner.clicked())?;
    let at = transform.position_from_point(&at);
    let distance = |&(x, y, _, row): &(f64, f64, f64, usize)| {
        let place = transform.position_from_point(&egui_plot::PlotPoint::new(x, y));
        (place.distance(at), row)
    };
    let nearest = series.iter().flat_map(|s| &s.points).map(distance).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.filter(|(distance, _)| *distance < 24.0).map(|(_, row)| row)
}

fn series(run: &Run, values: &Values, tokens: &Tokens) -> Vec<Series> {
    let colors = [tokens.accent, tokens.ok, tokens.right, tokens.bad, tokens.dim];
    let mut series: Vec<Series> = Vec::new();
    for (k, row) in run.table.iter().enumerate() {
        let (Some(Some(value)), Some((last, others))) = (values.get(k), row.labels.split_last()) else { continue };
        let Some(x) = number(last) else { continue };
        let name = if others.is_empty() { "fit".to_owned() } else { others.join(", ") };
        let at = series.iter().position(|s| s.name == name).unwrap_or_else(|| {
            let color = colors[series.len() % colors.len()];
            series.push(Series { name, color, points: Vec::new(), paper: Vec::new() });
            series.len() - 1
        });
        series[at].points.push((x, value.mean, value.error, k));
        series[at].paper.extend(value.paper.map(|paper| [x, paper]));
    }
    for s in &mut series {
        s.points.sort_by(|a, b| a.0.total_cmp(&b.0));
        s.paper.sort_by(|a, b| a[0].total_cmp(&b[0]));
    }
    series
}
