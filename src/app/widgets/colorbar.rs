//! The colour bar: how often each value occurs, its colour, and handles that set the limits.
//!
//! The bar reaches over all that occurs on the map, so that there is something beyond the limits to drag them to; what lies
//! there has the colour of the limit.

use super::limits::{self, LimitsEdit};
use crate::app::map_image::Histogram;
use crate::app::theme::{self, Tokens};
use crate::render::Colormap;
use egui::{Align2, Color32, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

/// Width of the longest bar of the histogram, points.
const HISTOGRAM: f32 = 16.0;
/// The unit above the bar.
const ABOVE: f32 = 20.0;
/// A lower bar is not drawn.
const LEAST: f32 = 24.0;
/// Half a line of a number.
const HALF_LINE: f32 = 6.0;

/// What a colour bar shows.
pub(crate) struct ColorBar<'a> {
    /// Where, ticks included.
    pub(crate) rect: Rect,
    /// The colour map.
    pub(crate) map: Colormap,
    /// Limits, shown units.
    pub(crate) limits: (f64, f64),
    /// How often each value occurs, and the ends of the bar.
    pub(crate) histogram: Histogram,
    /// What lies lower is shown as this.
    pub(crate) floor: f64,
    /// Unit and reference, for example `dB re max`.
    pub(crate) unit: &'a str,
    /// The maps whose limits can be set on it.
    pub(crate) row: Option<BarRow<'a>>,
}

/// The row of maps whose limits a colour bar sets.
pub(crate) struct BarRow<'a> {
    /// Key of the array.
    pub(crate) array: &'a str,
    /// Spoken name of what the bar is of.
    pub(crate) name: String,
    /// The limits are set by hand.
    pub(crate) by_hand: bool,
    /// They stay when another frame is shown.
    pub(crate) locked: bool,
}

impl ColorBar<'_> {
    fn y(&self, strip: Rect, value: f64) -> f32 {
        let (lo, hi) = self.histogram.span;
        strip.max.y - strip.height() * ((value - lo) / (hi - lo)).clamp(0.0, 1.0) as f32
    }

    fn value(&self, strip: Rect, y: f32) -> f64 {
        let (lo, hi) = self.histogram.span;
        let t = f64::from((strip.max.y - y) / strip.height()).clamp(0.0, 1.0);
        lo + t * (hi - lo)
    }

    /// Whether there are buttons under the bar: where it is low, the form of the limits has them.
    pub(super) fn has_buttons(&self) -> bool {
        self.row.is_some() && self.rect.height() > ABOVE + limits::BUTTONS + 2.0 * LEAST
    }

    /// A value as text: `≤` before what may lie anywhere below the floor.
    fn text(&self, value: f64) -> String {
        let (lo, hi) = self.histogram.span;
        let text = tick(value, hi - lo);
        if value <= self.floor { format!("≤{text}") } else { text }
    }
}

/// Draws the bar; answers what was done to the limits.
pub(crate) fn colorbar(ui: &mut Ui, bar: &ColorBar<'_>) -> Option<LimitsEdit> {
    let tokens = Tokens::of(ui);
    let below = if bar.has_buttons() { limits::BUTTONS + 8.0 } else { HALF_LINE };
    let left = bar.rect.min.x + 4.0 + if bar.histogram.heights.is_empty() { 0.0 } else { HISTOGRAM + 1.0 };
    let strip = Rect::from_min_max(pos2(left, bar.rect.min.y + ABOVE), pos2(left + 10.0, bar.rect.max.y - below));
    if strip.height() < LEAST {
        return None;
    }
    let painter = ui.painter().with_clip_rect(bar.rect.intersect(ui.clip_rect()));
    histogram(&painter, bar, strip, &tokens);
    let (lo, hi) = bar.limits;
    let steps = strip.height().ceil() as usize;
    for i in 0..steps {
        let y = strip.min.y + i as f32;
        let [r, g, b] = bar.map.sample(((bar.value(strip, y + 0.5) - lo) / (hi - lo)).clamp(0.0, 1.0));
        let line = Rect::from_min_max(pos2(strip.min.x, y), pos2(strip.max.x, (y + 1.0).min(strip.max.y)));
        painter.rect_filled(line, 0.0, Color32::from_rgb(r, g, b));
    }
    painter.rect_stroke(strip, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    let caption = egui::FontId::proportional(10.0);
    ui.painter().text(bar.rect.right_top() + vec2(0.0, 1.0), Align2::RIGHT_TOP, bar.unit, caption, tokens.dim);
    let numbers = numbers(bar, strip);
    ticks(&painter, bar, strip, numbers, &tokens);
    let Some(row) = &bar.row else {
        for (value, y) in [lo, hi].into_iter().zip(numbers) {
            let at = pos2(strip.max.x + 5.0, y);
            painter.text(at, Align2::LEFT_CENTER, bar.text(value), theme::mono(10.0), tokens.dim);
        }
        return None;
    };
    let dragged = handles(ui, bar, row, strip, &tokens);
    let texts = [bar.text(lo), bar.text(hi)];
    let rects = numbers
        .map(|y| Rect::from_min_max(pos2(strip.max.x + 2.0, y - HALF_LINE), pos2(bar.rect.max.x, y + HALF_LINE)));
    limits::edit(ui, bar, row, texts, rects).or(dragged)
}

/// How often each value occurs, longest where it is most often.
fn histogram(painter: &egui::Painter, bar: &ColorBar<'_>, strip: Rect, tokens: &Tokens) {
    let heights = &bar.histogram.heights;
    let step = strip.height() / heights.len().max(1) as f32;
    for (i, height) in heights.iter().enumerate().filter(|(_, height)| **height > 0.0) {
        let y = strip.max.y - step * i as f32;
        let left = strip.min.x - 1.0 - (HISTOGRAM * height).max(1.0);
        let rect = Rect::from_min_max(pos2(left, y - step), pos2(strip.min.x - 1.0, y));
        painter.rect_filled(rect, 0.0, tokens.dim.gamma_multiply(0.55));
    }
}

/// Where the numbers of the limits are, lower first: beside them, and apart.
fn numbers(bar: &ColorBar<'_>, strip: Rect) -> [f32; 2] {
    let [low, high] = [bar.limits.0, bar.limits.1].map(|value| bar.y(strip, value));
    let apart = (2.0 * HALF_LINE - (low - high)).max(0.0);
    let low = (low + 0.5 * apart).clamp(strip.min.y + 2.0 * HALF_LINE, strip.max.y);
    [low, high.min(low - 2.0 * HALF_LINE)]
}

/// Round values between the limits and beyond, where there is room beside the limits' own numbers.
fn ticks(painter: &egui::Painter, bar: &ColorBar<'_>, strip: Rect, numbers: [f32; 2], tokens: &Tokens) {
    let (lo, hi) = bar.histogram.span;
    let step = round_step((hi - lo) / f64::from((strip.height() / 30.0).clamp(1.0, 8.0)));
    let (first, last) = ((lo / step).ceil() as i64, (hi / step).floor() as i64);
    for i in first..=last.min(first.saturating_add(20)) {
        let value = i as f64 * step;
        let y = bar.y(strip, value);
        painter.hline(strip.max.x..=strip.max.x + 3.0, y, Stroke::new(1.0, tokens.dim));
        if numbers.iter().all(|number| (number - y).abs() > 2.0 * HALF_LINE) {
            let at = pos2(strip.max.x + 5.0, y);
            painter.text(at, Align2::LEFT_CENTER, bar.text(value), theme::mono(10.0), tokens.dim.gamma_multiply(0.8));
        }
    }
}

/// The next 1, 2 or 5 times a power of ten.
pub(crate) fn round_step(raw: f64) -> f64 {
    let magnitude = 10f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|m| m * magnitude).into_iter().find(|step| *step >= raw).unwrap_or(raw)
}

fn handles(ui: &mut Ui, bar: &ColorBar<'_>, row: &BarRow<'_>, strip: Rect, tokens: &Tokens) -> Option<LimitsEdit> {
    let (lo, hi) = bar.limits;
    let least = (bar.histogram.span.1 - bar.histogram.span.0) * 1e-3;
    let mut new = None;
    for (upper, limit, name) in [(false, lo, "lower limit"), (true, hi, "upper limit")] {
        let y = bar.y(strip, limit);
        let left = strip.min.x - HISTOGRAM;
        // The two grips leave each other room, however close the limits are.
        let at = pos2(0.5 * (left + strip.max.x), if upper { y - 2.0 } else { y + 2.0 });
        let rect = Rect::from_center_size(at, vec2(strip.max.x - left + 4.0, 9.0));
        let id = ui.scope_id().with(("colorbar", &row.name, upper));
        let response = ui.interact(rect, id, Sense::drag());
        let spoken = format!("{} {name}", row.name);
        response.widget_info(move || egui::WidgetInfo::labeled(egui::Role::Slider, true, &spoken));
        let color = if response.hovered() || response.dragged() { tokens.accent } else { tokens.text };
        ui.painter().hline(left..=strip.min.x - 1.0, y, Stroke::new(1.0, color));
        ui.painter().hline(strip.x_range(), y, Stroke::new(3.0, Color32::from_black_alpha(150)));
        ui.painter().hline(strip.x_range(), y, Stroke::new(1.0, Color32::WHITE));
        ui.painter().add(grip(pos2(left, y), upper, color));
        if response.dragged()
            && let Some(pointer) = response.interact_pointer_pos()
        {
            let value = bar.value(strip, pointer.y);
            let limits = if upper { (lo, value.max(lo + least)) } else { (value.min(hi - least), hi) };
            new = Some(LimitsEdit::Set(limits));
        }
        response.on_hover_cursor(egui::CursorIcon::ResizeVertical).on_hover_text(
            "Drag to set the colour limit of the row's maps; click its number to type it.\n\
             Behind the bar: how often each value occurs, logarithmic.",
        );
    }
    new
}

/// A flag on the line of a limit, on the side that is beyond it.
fn grip(at: Pos2, upper: bool, color: Color32) -> egui::Shape {
    let away = if upper { -6.0 } else { 6.0 };
    egui::Shape::convex_polygon(vec![at, at + vec2(6.0, 0.0), at + vec2(0.0, away)], color, Stroke::NONE)
}

/// A number for a scale whose whole span is `span`.
pub(crate) fn tick(value: f64, span: f64) -> String {
    let digits = (1.0 - span.abs().max(1e-12).log10().floor()).clamp(0.0, 6.0) as usize;
    let digits = if span >= 20.0 { 0 } else { digits };
    let text = format!("{value:.digits$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { "0".into() } else { text.replace('-', "−") }
}
