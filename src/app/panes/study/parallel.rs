//! Many settings: parallel coordinates, an upright axis a setting and one for the quantity, a line a row.

use super::measure::{PlottedQuantity, Values, levels, limits};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::render::Colormap;
use crate::session::Session;
use crate::study::run::Run;
use egui::{Align2, Color32, Pos2, Rect, Role, Sense, Stroke, Ui, pos2, vec2};

/// The pointer is on a line at this distance, points.
const NEAR: f32 = 8.0;

/// Draws the lines; answers the row of the one that was clicked.
#[expect(clippy::too_many_arguments, reason = "what every picture of a study is given")]
pub(super) fn show(
    ui: &mut Ui,
    run: &Run,
    measure: PlottedQuantity,
    values: &Values,
    chosen: Option<usize>,
    session: &Session,
    height: f32,
    tokens: &Tokens,
) -> Option<usize> {
    let width = ui.available_width().clamp(280.0, 900.0);
    let (rect, response) = ui.allocate_exact_size(vec2(width, height), Sense::click());
    let area = Rect::from_min_max(rect.min + vec2(24.0, 26.0), rect.max - vec2(60.0, 14.0));
    let settings: Vec<Vec<String>> = (0..run.spec.columns.len()).map(|column| levels(run, column)).collect();
    let x = |axis: usize| area.min.x + area.width() * axis as f32 / settings.len().max(1) as f32;
    let (lo, hi) = limits(values);
    let lines: Vec<Option<Vec<Pos2>>> = (0..run.table.len())
        .map(|row| {
            line(
                run,
                row,
                values,
                &settings,
                &|axis, share| pos2(x(axis), area.max.y - area.height() * share),
                (lo, hi),
            )
        })
        .collect();
    let pointed =
        ui.input(|i| i.pointer.latest_pos()).filter(|_| response.hovered()).and_then(|at| nearest(&lines, at));
    let map = Colormap::ALL.into_iter().find(|map| map.name().eq_ignore_ascii_case(&session.view.colormap));
    let map = map.unwrap_or_default();
    let emphasis = pointed.or(chosen);
    for (row, line) in lines.iter().enumerate() {
        let (Some(line), Some(Some(value))) = (line, values.get(row)) else { continue };
        let [r, g, b] = map.sample((value.mean - lo) / (hi - lo));
        let color = Color32::from_rgb(r, g, b);
        let quiet = emphasis.is_some_and(|k| k != row);
        let stroke = Stroke::new(if quiet { 1.0 } else { 2.0 }, if quiet { color.gamma_multiply(0.35) } else { color });
        ui.painter().add(egui::Shape::line(line.clone(), stroke));
    }
    axes(ui, run, &settings, measure, (lo, hi), area, &x, tokens);
    let name = format!("Parallel coordinates of {} over {}", measure.title(), run.spec.columns.join(", "));
    let response = response.named(Role::Canvas, &name);
    let row = pointed?;
    let told = |row: usize| {
        let labels = run.table.get(row).map(|row| row.labels.as_slice()).unwrap_or_default();
        let settings = run.spec.columns.iter().zip(labels).map(|(column, label)| format!("{column} = {label}"));
        let value =
            values.get(row).copied().flatten().map_or_else(|| "unknown".into(), |value| measure.text(value.mean));
        format!("{}\n{} {value} {}", settings.collect::<Vec<_>>().join("\n"), measure.short(), measure.unit())
    };
    response.on_hover_text_at_pointer(told(row)).clicked().then_some(row)
}

/// The corners of a row's line; `None` where its value is unknown.
fn line(
    run: &Run,
    row: usize,
    values: &Values,
    settings: &[Vec<String>],
    place: &dyn Fn(usize, f32) -> Pos2,
    (lo, hi): (f64, f64),
) -> Option<Vec<Pos2>> {
    let value = values.get(row).copied().flatten()?;
    let labels = &run.table.get(row)?.labels;
    let mut corners = Vec::with_capacity(settings.len() + 1);
    for (axis, (levels, label)) in settings.iter().zip(labels).enumerate() {
        let at = levels.iter().position(|level| level == label)?;
        corners.push(place(axis, share(at, levels.len())));
    }
    corners.push(place(settings.len(), ((value.mean - lo) / (hi - lo)) as f32));
    Some(corners)
}

/// Levels stand at equal distances; a single one in the middle.
fn share(at: usize, of: usize) -> f32 {
    if of > 1 { at as f32 / (of - 1) as f32 } else { 0.5 }
}

fn nearest(lines: &[Option<Vec<Pos2>>], at: Pos2) -> Option<usize> {
    let distance = |line: &[Pos2]| {
        let pieces = line.windows(2).map(|ends| {
            let (a, b) = (ends[0], ends[1]);
            let along = ((at - a).dot(b - a) / (b - a).length_sq().max(1e-6)).clamp(0.0, 1.0);
            (a + along * (b - a)).distance(at)
        });
        pieces.fold(f32::INFINITY, f32::min)
    };
    let all = lines.iter().enumerate().filter_map(|(row, line)| Some((distance(line.as_ref()?), row)));
    all.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(distance, _)| *distance < NEAR).map(|(_, row)| row)
}

#[expect(clippy::too_many_arguments, reason = "one place that draws all axes")]
fn axes(
    ui: &Ui,
    run: &Run,
    settings: &[Vec<String>],
    measure: PlottedQuantity,
    (lo, hi): (f64, f64),
    area: Rect,
    x: &dyn Fn(usize) -> f32,
    tokens: &Tokens,
) {
    let (painter, small) = (ui.painter(), theme::mono(10.0));
    let font = egui::FontId::proportional(theme::CAPTION);
    for axis in 0..=settings.len() {
        let at = x(axis);
        painter.vline(at, area.y_range(), Stroke::new(1.0, tokens.dim));
        let name = run.spec.columns.get(axis).cloned().unwrap_or_else(|| measure.title());
        let align = if axis == 0 { Align2::LEFT_BOTTOM } else { Align2::CENTER_BOTTOM };
        let left = if axis == 0 { at - 20.0 } else { at };
        painter.text(pos2(left, area.min.y - 8.0), align, name, font.clone(), tokens.text);
        let ticks: Vec<(f32, String)> = match settings.get(axis) {
            Some(levels) => {
                levels.iter().enumerate().map(|(k, level)| (share(k, levels.len()), level.clone())).collect()
            }
            None => [0.0, 0.5, 1.0].map(|t: f32| (t, measure.text(lo + (hi - lo) * f64::from(t)))).to_vec(),
        };
        for (share, text) in ticks {
            let y = area.max.y - area.height() * share;
            painter.hline(at - 3.0..=at + 3.0, y, Stroke::new(1.0, tokens.dim));
            let galley = painter.layout_no_wrap(text, small.clone(), tokens.text);
            let corner = pos2(at + 6.0, y - 0.5 * galley.size().y);
            // Lines pass here: the value must be readable over them.
            painter.rect_filled(Rect::from_min_size(corner, galley.size()).expand(1.0), 2.0, tokens.panel);
            painter.galley(corner, galley, tokens.text);
        }
    }
}
