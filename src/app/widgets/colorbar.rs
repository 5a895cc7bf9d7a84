//! The colour bar: its unit, its scale, and handles that set the limits.

use crate::app::theme::{self, Tokens};
use crate::render::Colormap;
use egui::{Align2, Color32, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

/// What a colour bar shows.
pub(crate) struct ColorBar<'a> {
    /// Where, ticks included.
    pub(crate) rect: Rect,
    /// The colour map.
    pub(crate) map: Colormap,
    /// Limits, shown units.
    pub(crate) limits: (f64, f64),
    /// What lies lower is shown as this.
    pub(crate) floor: f64,
    /// Unit and reference, for example `dB re max`.
    pub(crate) unit: &'a str,
    /// Spoken name.
    pub(crate) name: String,
}

/// Draws the bar; answers new limits while a handle is dragged or the bar is scrolled.
pub(crate) fn colorbar(ui: &mut Ui, bar: &ColorBar<'_>) -> Option<(f64, f64)> {
    let tokens = Tokens::of(ui);
    let strip = Rect::from_min_max(bar.rect.min + vec2(4.0, 18.0), pos2(bar.rect.min.x + 14.0, bar.rect.max.y - 6.0));
    if strip.height() < 24.0 {
        return None;
    }
    let painter = ui.painter().with_clip_rect(bar.rect.intersect(ui.clip_rect()));
    let steps = 64;
    for i in 0..steps {
        let t = f64::from(i) / f64::from(steps - 1);
        let [r, g, b] = bar.map.sample(t);
        let y1 = strip.max.y - strip.height() * i as f32 / steps as f32;
        let y0 = strip.max.y - strip.height() * (i + 1) as f32 / steps as f32;
        let rect = Rect::from_min_max(pos2(strip.min.x, y0.floor()), pos2(strip.max.x, y1.ceil()));
        painter.rect_filled(rect, 0.0, Color32::from_rgb(r, g, b));
    }
    painter.rect_stroke(strip, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    let caption = egui::FontId::proportional(10.0);
    ui.painter().text(bar.rect.right_top() + vec2(0.0, 2.0), Align2::RIGHT_TOP, bar.unit, caption, tokens.dim);
    let (lo, hi) = bar.limits;
    let ticks = ((strip.height() / 34.0).floor() as usize).clamp(1, 6);
    for i in 0..=ticks {
        let t = i as f32 / ticks as f32;
        let value = lo + (hi - lo) * f64::from(t);
        let y = strip.max.y - strip.height() * t;
        painter.hline(strip.max.x..=strip.max.x + 3.0, y, Stroke::new(1.0, tokens.dim));
        let text = tick(value, hi - lo);
        let text = if value <= bar.floor { format!("≤{text}") } else { text };
        painter.text(pos2(strip.max.x + 5.0, y), Align2::LEFT_CENTER, text, theme::mono(10.0), tokens.dim);
    }
    handles(ui, bar, strip, &tokens)
}

fn handles(ui: &mut Ui, bar: &ColorBar<'_>, strip: Rect, tokens: &Tokens) -> Option<(f64, f64)> {
    let (lo, hi) = bar.limits;
    let per_point = (hi - lo) / f64::from(strip.height());
    let mut new = None;
    for (upper, y, name) in [(false, strip.max.y, "lower limit"), (true, strip.min.y, "upper limit")] {
        let rect = Rect::from_center_size(pos2(strip.center().x, y), vec2(18.0, 9.0));
        let id = ui.scope_id().with(("colorbar", &bar.name, upper));
        let response = ui.interact(rect, id, Sense::drag());
        let spoken = format!("{} {name}", bar.name);
        response.widget_info(move || egui::WidgetInfo::labeled(egui::Role::Slider, true, &spoken));
        let color = if response.hovered() || response.dragged() { tokens.accent } else { tokens.text };
        ui.painter().add(triangle(pos2(strip.min.x, y), color));
        if response.dragged() {
            // Dragging a handle towards the middle narrows the range: the value under it becomes the limit.
            let by = -f64::from(response.drag_delta().y) * per_point;
            new = Some(if upper { (lo, (hi + by).max(lo + 1e-6)) } else { ((lo + by).min(hi - 1e-6), hi) });
        }
        response
            .on_hover_cursor(egui::CursorIcon::ResizeVertical)
            .on_hover_text("Drag to set the colour limit of every map. C sets both by percentiles again.");
    }
    new
}

fn triangle(tip: Pos2, color: Color32) -> egui::Shape {
    let points = vec![tip, tip + vec2(-5.0, -4.0), tip + vec2(-5.0, 4.0)];
    egui::Shape::convex_polygon(points, color, Stroke::NONE)
}

/// A number for a scale whose whole span is `span`.
pub(crate) fn tick(value: f64, span: f64) -> String {
    let digits = (1.0 - span.abs().max(1e-12).log10().floor()).clamp(0.0, 6.0) as usize;
    let digits = if span >= 20.0 { 0 } else { digits };
    let text = format!("{value:.digits$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { "0".into() } else { text.replace('-', "−") }
}
