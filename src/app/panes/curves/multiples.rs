//! Every curve in a picture of its own, with a scale of its own: terms differ by powers of ten, and what changes is seen in each.

use super::thin::VisibleSpan;
use super::{Curve, DOUBLE_CLICK_S, RAW, Shared, State, wheel};
use crate::app::figure;
use crate::app::theme::{self, Tokens};
use crate::session::Command;
use egui::{Align2, FontId, Rect, Sense, Stroke, Ui, pos2, vec2};
use egui_plot::PlotPoint;

/// The least width of a picture, points.
const LEAST: f32 = 92.0;
/// The least height of one with its name, points.
const LOWEST: f32 = TITLE + 22.0;
/// Between pictures.
const GAP: f32 = 6.0;
/// Name and value over a curve.
const TITLE: f32 = 15.0;

/// Draws `curves` of the rows that led to the head of the active branch, and of other branches behind them; a click asks for
/// the iteration under it.
pub(super) fn show(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    state: &mut State,
    curves: &[&Curve],
    branch: u32,
    area: Rect,
) {
    let fit = &shared.session.fit;
    let lineage = fit.history.lineage();
    let others: Vec<_> = fit.history.branches().iter().filter(|b| b.id != branch && !b.rows.is_empty()).collect();
    let (Some(first), Some(last)) =
        (lineage.first().and_then(|rows| rows.first()), lineage.last().and_then(|rows| rows.last()))
    else {
        return;
    };
    let (first, head) = (first.report.iteration, last.report.iteration);
    let (shown, flags) = (fit.shown_iteration(), fit.history.flags());
    let shown_row = fit.shown_row();
    let end = others.iter().map(|b| b.head()).chain([head, first + 1]).max().unwrap_or_default();
    let along = state.along;
    let whole = (along.x(first as f64), along.x(end as f64));
    let span = state.zoomed.filter(|(lo, hi)| *lo >= whole.0 && *hi <= whole.1).unwrap_or(whole);
    let (mut zoomed, mut whole_again) = (state.zoomed, false);
    let series = &mut state.series;
    let log = shared.session.view.log_loss;
    let smoothing = shared.session.view.smoothing.weight();
    let tokens = Tokens::of(ui);
    let mut asked = None;
    // A term that is 0 from end to end has nothing to show.
    let curves: Vec<&&Curve> =
        curves.iter().filter(|c| !series.grown(None, &c.key, first, &lineage, &c.value).is_zero()).collect();
    for (curve, rect) in curves.iter().zip(cells(area, curves.len())) {
        let window = VisibleSpan::new(span.0, span.1, rect.width() * ui.pixels_per_point(), along);
        let raw = series.grown(None, &curve.key, first, &lineage, &curve.value).pieces(Some(&window), along, false);
        let smooth = smoothing.and_then(|weight| series.smoothed(&curve.key, weight));
        let smooth = smooth.map(|smooth| smooth.pieces(Some(&window), along, false));
        let behind: Vec<Vec<PlotPoint>> = others
            .iter()
            .flat_map(|b| {
                let series = series.grown(Some(b.id), &curve.key, b.start(), &[&b.rows], &curve.value);
                series.pieces(Some(&window), along, false)
            })
            .collect();
        let seen = |point: &&PlotPoint| (span.0..=span.1).contains(&point.x);
        let scale = Scale::of(raw.iter().chain(&behind).flatten().filter(seen).map(|point| point.y), log);
        let response = ui.interact(rect, ui.scope_id().with(("curve", &curve.key)), Sense::click_and_drag());
        let plot = rect.with_min_y(rect.min.y + TITLE);
        let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
        let inside = ui.painter().with_clip_rect(plot.intersect(ui.clip_rect()));
        let x = |place: f64| {
            let t = (place - span.0) / (span.1 - span.0).max(1e-9);
            plot.min.x + 2.0 + t as f32 * (plot.width() - 4.0)
        };
        let at = |p: PlotPoint| pos2(x(p.x), plot.max.y - 3.0 - scale.unit(p.y) * (plot.height() - 6.0));
        let color = tokens.curve(&curve.key);
        painter.rect(plot, 2.0, tokens.canvas, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Inside);
        for piece in behind {
            inside.line(piece.into_iter().map(at).collect(), Stroke::new(1.0, tokens.dim.gamma_multiply(0.6)));
        }
        let (thin, front) = match smooth {
            Some(smooth) => (raw, smooth),
            None => (Vec::new(), raw),
        };
        for piece in thin {
            inside.line(piece.into_iter().map(at).collect(), Stroke::new(0.8, color.gamma_multiply(RAW)));
        }
        for piece in front {
            inside.line(piece.into_iter().map(at).collect(), Stroke::new(1.5, color));
        }
        let now = shown_row.and_then(|row| (curve.value)(row));
        let here = along.x(shown as f64);
        for (iteration, _) in &flags {
            inside.vline(
                x(along.x(*iteration as f64)),
                plot.y_range(),
                Stroke::new(1.0, tokens.warn.gamma_multiply(0.7)),
            );
        }
        inside.vline(x(here), plot.y_range(), Stroke::new(1.0, tokens.accent));
        if let Some(y) = now {
            inside.circle_filled(at(PlotPoint::new(here, y)), 2.5, color);
        }
        let text = now.map_or_else(|| "–".into(), |now| number(now, 4));
        let font = FontId::proportional(theme::CAPTION);
        let named = painter.layout_no_wrap(curve.name.clone(), font.clone(), color).size().x;
        let lettered = |text: String| painter.layout_no_wrap(text, theme::mono(theme::CAPTION), tokens.text);
        let fits = |value: &std::sync::Arc<egui::Galley>| value.size().x + named + 5.0 < rect.width();
        let fewer = || now.map_or_else(|| lettered("–".into()), |now| lettered(number(now, 2)));
        let value = Some(lettered(text.clone())).filter(fits).unwrap_or_else(fewer);
        // Where there is no room for both, the name stays: the value is in the pane Fit too.
        let both = fits(&value);
        let right = if both { rect.max.x - value.size().x } else { rect.max.x + 4.0 };
        if both {
            painter.galley(pos2(right, rect.min.y), value, tokens.text);
        }
        let mut name = egui::text::LayoutJob::simple_singleline(curve.name.clone(), font, color);
        name.wrap = egui::text::TextWrapping::truncate_at_width(right - 4.0 - rect.min.x);
        painter.galley(rect.min + vec2(1.0, 0.0), painter.layout_job(name), color);
        if plot.height() > 60.0 && plot.width() > 140.0 && scale.hi > scale.lo {
            let small = theme::mono(9.0);
            for (place, anchor, y) in
                [(plot.left_top(), Align2::LEFT_TOP, scale.hi), (plot.left_bottom(), Align2::LEFT_BOTTOM, scale.lo)]
            {
                painter.text(place + vec2(3.0, 0.0), anchor, number(y, 4), small.clone(), tokens.dim);
            }
        }
        response.widget_info(|| figure::spoken(&format!("Curve of {}", curve.name), Some(&text)));
        let place = |pointer: egui::Pos2| {
            let t = f64::from((pointer.x - plot.min.x - 2.0) / (plot.width() - 4.0).max(1.0)).clamp(0.0, 1.0);
            span.0 + t * (span.1 - span.0)
        };
        let now_s = ui.input(|i| i.time);
        if let Some(pointer) = response.hover_pos() {
            let factor = f64::from(wheel(ui.ctx()) * ui.input(egui::InputState::zoom_delta));
            if factor != 1.0 {
                zoomed = zoom(span, whole, place(pointer), factor);
            }
        }
        let pointed = (response.clicked() || response.dragged()).then(|| response.interact_pointer_pos()).flatten();
        if response.double_clicked() {
            // The first click of the two has moved the cursor; the gesture was for the picture.
            whole_again = true;
            let before = state.before_click.take().filter(|(_, at)| now_s - at < DOUBLE_CLICK_S);
            asked = before.map(|(iteration, _)| iteration).or(Some(shown));
        } else if let Some(pointer) = pointed {
            if response.clicked() {
                state.before_click = Some((shown, now_s));
            }
            let iteration = along.iteration(place(pointer)).round() as usize;
            asked = Some(iteration).filter(|iteration| *iteration != shown);
        }
        response.on_hover_text(format!(
            "{}: {} to {}{}\nClick or drag to show an iteration; the wheel zooms, a double click shows all.",
            curve.name,
            number(scale.lo, 4),
            number(scale.hi, 4),
            if scale.log { ", logarithmic" } else { "" }
        ));
    }
    state.zoomed = zoomed.filter(|_| !whole_again);
    if let Some(iteration) = asked.filter(|iteration| *iteration != shown) {
        shared.send(Command::GotoIteration(iteration));
    }
}

/// What is seen of `whole` after zooming in by `factor` about a place; `None` for all of it.
fn zoom(span: (f64, f64), whole: (f64, f64), about: f64, factor: f64) -> Option<(f64, f64)> {
    let all = whole.1 - whole.0;
    let width = ((span.1 - span.0) / factor).max(all * 1e-4);
    if width >= all {
        return None;
    }
    let share = (about - span.0) / (span.1 - span.0).max(1e-9);
    let lo = (about - share * width).clamp(whole.0, whole.1 - width);
    Some((lo, lo + width))
}

/// Places for `count` pictures: as many rows as make them least narrow, and no more than leave a curve some height.
fn cells(area: Rect, count: usize) -> Vec<Rect> {
    let across = ((area.width() / LEAST).floor() as usize).clamp(1, count.max(1));
    let most = ((area.height() / LOWEST).floor() as usize).max(1);
    let down = count.div_ceil(across).min(most);
    // Rows of the same length, not one full and one with the rest.
    let across = count.div_ceil(down.max(1)).max(1);
    let size = vec2(area.width() / across as f32, area.height() / down.max(1) as f32);
    let place = |k: usize| {
        let corner = area.min + vec2(size.x * (k % across) as f32, size.y * (k / across) as f32);
        Rect::from_min_size(corner, (size - vec2(GAP, GAP * 0.5)).max(vec2(1.0, 1.0)))
    };
    (0..count).map(place).collect()
}

/// From a value to 0 (lowest) to 1 (highest).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Scale {
    lo: f64,
    hi: f64,
    log: bool,
}

impl Scale {
    /// Of these values; logarithmic only where all of them are positive.
    fn of(values: impl Iterator<Item = f64>, log: bool) -> Self {
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), y| (lo.min(y), hi.max(y)));
        if lo > hi { Self { lo: 0.0, hi: 0.0, log: false } } else { Self { lo, hi, log: log && lo > 0.0 } }
    }

    fn unit(&self, y: f64) -> f32 {
        let [lo, hi, y] = [self.lo, self.hi, y].map(|y| if self.log { y.ln() } else { y });
        if hi > lo { ((y - lo) / (hi - lo)) as f32 } else { 0.5 }
    }
}

/// So many digits that count.
fn number(y: f64, digits: usize) -> String {
    let text = match y.abs() {
        0.0 => "0".to_owned(),
        a if !(1e-4..1e5).contains(&a) => format!("{y:.*e}", digits.saturating_sub(2)),
        a => format!("{y:.*}", (digits as i32 - 1 - a.log10().floor() as i32).clamp(0, 6) as usize),
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_share_the_area_in_even_rows() {
        let area = Rect::from_min_size(pos2(0.0, 0.0), vec2(800.0, 100.0));
        for (count, rows) in [(1, 1), (5, 1), (8, 1), (9, 2), (10, 2)] {
            let cells = cells(area, count);
            let mut tops: Vec<i32> = cells.iter().map(|cell| cell.min.y as i32).collect();
            tops.dedup();
            assert_eq!((cells.len(), tops.len()), (count, rows));
            assert!(cells.iter().all(|cell| area.contains_rect(*cell)));
        }
    }

    #[test]
    fn zooming_keeps_the_place_and_stays_inside() {
        let whole = (0.0, 100.0);
        assert_eq!(zoom(whole, whole, 50.0, 2.0), Some((25.0, 75.0)));
        assert_eq!(zoom(whole, whole, 0.0, 4.0), Some((0.0, 25.0)));
        let (lo, hi) = zoom((0.0, 25.0), whole, 20.0, 5.0).unwrap_or_default();
        assert!(((20.0 - lo) / (hi - lo) - 0.8).abs() < 1e-9, "the place stays under the pointer");
        assert_eq!(zoom((60.0, 100.0), whole, 90.0, 0.1), None, "all of it again");
    }

    #[test]
    fn scales_and_numbers_fit_what_they_show() {
        let scale = Scale::of([0.01, 1.0].into_iter(), true);
        assert!((scale.unit(0.1) - 0.5).abs() < 1e-6);
        assert!(!Scale::of([0.0, 1.0].into_iter(), true).log, "0 has no logarithm");
        assert_eq!(Scale::of([2.0].into_iter(), false).unit(2.0), 0.5);
        let told = [0.0, 0.023_51, -1.5, 97.94, 12_345.6, 3.2e-7].map(|y| number(y, 4));
        assert_eq!(told, ["0", "0.02351", "−1.500", "97.94", "12346", "3.20e−7"]);
        assert_eq!([0.08595, 0.6048, 128.7].map(|y| number(y, 2)), ["0.086", "0.60", "129"]);
    }
}
