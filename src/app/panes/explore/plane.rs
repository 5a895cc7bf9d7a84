//! A picture over two axes: cells in colours, axes with numbers, a colour bar, and places between picture and screen.

use crate::app::map_image::Histogram;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{ColorBar, colorbar};
use crate::render::Colormap;
use crate::session::Session;
use egui::{Align2, Color32, Mesh, Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};

/// Room for the numbers of the upright axis, of the lower one with its name, and of the colour bar, points.
pub(in crate::app::panes) const LEFT: f32 = 64.0;
pub(in crate::app::panes) const BELOW: f32 = 34.0;
pub(in crate::app::panes) const BAR: f32 = 62.0;
/// A number of an axis takes this much room, points.
const NUMBER: f32 = 34.0;
const LINE: f32 = 14.0;

/// One axis: its name, and where it has numbers, in cells from 0 (the middle of the first).
pub(in crate::app::panes) struct PlaneAxis {
    pub(in crate::app::panes) name: String,
    /// Texts at places, ascending, to be thinned out where there is no room.
    pub(in crate::app::panes) numbers: Vec<(f64, String)>,
}

/// Where the picture is: cell (0, 0) is at the lower left.
#[derive(Debug, Clone, Copy)]
pub(in crate::app::panes) struct PlaneArea {
    pub(in crate::app::panes) rect: Rect,
    cells: [usize; 2],
}

impl PlaneArea {
    pub(in crate::app::panes) fn new(rect: Rect, cells: [usize; 2]) -> Self {
        Self { rect, cells: cells.map(|n| n.max(1)) }
    }

    /// The largest area within `rect` whose cells are as wide as `aspect` times their height; all of it without one.
    pub(in crate::app::panes) fn shaped(rect: Rect, cells: [usize; 2], aspect: Option<f64>) -> Self {
        let Some(aspect) = aspect else { return Self::new(rect, cells) };
        let wanted = (cells[0].max(1) as f64 * aspect / cells[1].max(1) as f64) as f32;
        let size = if rect.width() / rect.height().max(1.0) > wanted {
            vec2(rect.height() * wanted, rect.height())
        } else {
            vec2(rect.width(), rect.width() / wanted)
        };
        Self::new(Rect::from_min_size(rect.min, size), cells)
    }

    /// The screen place of a place in cells: 0 is the middle of the first cell.
    pub(in crate::app::panes) fn at(&self, [x, y]: [f64; 2]) -> Pos2 {
        let share = |x: f64, n: usize| ((x + 0.5) / n as f64) as f32;
        pos2(
            self.rect.min.x + share(x, self.cells[0]) * self.rect.width(),
            self.rect.max.y - share(y, self.cells[1]) * self.rect.height(),
        )
    }

    /// The place in cells of a screen place; `None` outside.
    pub(in crate::app::panes) fn place(&self, at: Pos2) -> Option<[f64; 2]> {
        if !self.rect.contains(at) {
            return None;
        }
        let x = f64::from((at.x - self.rect.min.x) / self.rect.width()) * self.cells[0] as f64 - 0.5;
        let y = f64::from((self.rect.max.y - at.y) / self.rect.height()) * self.cells[1] as f64 - 0.5;
        Some([x, y])
    }

    /// The cell of a screen place.
    pub(in crate::app::panes) fn cell(&self, at: Pos2) -> Option<[usize; 2]> {
        let [x, y] = self.place(at)?;
        let cell = |x: f64, n: usize| ((x + 0.5).floor().max(0.0) as usize).min(n - 1);
        Some([cell(x, self.cells[0]), cell(y, self.cells[1])])
    }

    /// The screen place of a cell.
    pub(in crate::app::panes) fn cell_rect(&self, [i, j]: [usize; 2]) -> Rect {
        let corner = |i: f64, j: f64| self.at([i - 0.5, j - 0.5]);
        Rect::from_two_pos(corner(i as f64, j as f64), corner(i as f64 + 1.0, j as f64 + 1.0))
    }
}

/// The colour map that the person chose.
pub(in crate::app::panes) fn colormap(session: &Session) -> Colormap {
    let map = Colormap::ALL.into_iter().find(|map| map.name().eq_ignore_ascii_case(&session.view.colormap));
    map.unwrap_or_default()
}

/// Paints the cells that have a value.
pub(in crate::app::panes) fn cells(
    painter: &Painter,
    area: &PlaneArea,
    (lo, hi): (f64, f64),
    map: Colormap,
    value: impl Fn([usize; 2]) -> Option<f64>,
) {
    let mut mesh = Mesh::default();
    let lut = map.lut();
    for j in 0..area.cells[1] {
        for i in 0..area.cells[0] {
            let Some(value) = value([i, j]) else { continue };
            let t = ((value - lo) / (hi - lo)).clamp(0.0, 1.0);
            let [r, g, b] = lut[(t * 255.0).round() as usize];
            mesh.add_colored_rect(area.cell_rect([i, j]), Color32::from_rgb(r, g, b));
        }
    }
    painter.add(egui::Shape::mesh(mesh));
}

/// Frame, numbers and names of both axes.
pub(in crate::app::panes) fn axes(painter: &Painter, area: &PlaneArea, [across, up]: [&PlaneAxis; 2], tokens: &Tokens) {
    let (rect, small, caption) = (area.rect, theme::mono(10.0), egui::FontId::proportional(theme::CAPTION));
    painter.rect_stroke(rect, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
    let mut free = f32::NEG_INFINITY;
    for (at, text) in &across.numbers {
        let x = area.at([*at, 0.0]).x;
        let galley = painter.layout_no_wrap(text.clone(), small.clone(), tokens.dim);
        let half = 0.5 * galley.size().x;
        if x - half < free || x + half > rect.max.x + 20.0 {
            continue;
        }
        free = x + half + 8.0;
        painter.vline(x, rect.max.y..=rect.max.y + 3.0, Stroke::new(1.0, tokens.dim));
        painter.galley(pos2(x - half, rect.max.y + 4.0), galley, tokens.dim);
    }
    let mut free = f32::INFINITY;
    for (at, text) in &up.numbers {
        let y = area.at([0.0, *at]).y;
        if y + 0.5 * LINE > free {
            continue;
        }
        free = y - 0.5 * LINE;
        painter.hline(rect.min.x - 3.0..=rect.min.x, y, Stroke::new(1.0, tokens.dim));
        painter.text(pos2(rect.min.x - 5.0, y), Align2::RIGHT_CENTER, text, small.clone(), tokens.dim);
    }
    let at = pos2(rect.center().x, rect.max.y + 17.0);
    painter.text(at, Align2::CENTER_TOP, &across.name, caption.clone(), tokens.text);
    let upright = painter.layout_no_wrap(up.name.clone(), caption, tokens.text);
    // A name that is longer than its axis would be cut off.
    if upright.size().x > rect.height() + BELOW {
        return;
    }
    let at = pos2(rect.min.x - LEFT + 2.0, rect.center().y + 0.5 * upright.size().x);
    let turned = egui::epaint::TextShape::new(at, upright, tokens.text).with_angle(-std::f32::consts::FRAC_PI_2);
    painter.add(turned);
}

/// The scale of the colours at the right of a picture.
pub(in crate::app::panes) fn scale(ui: &mut Ui, area: &PlaneArea, map: Colormap, limits: (f64, f64), unit: &str) {
    let at = area.rect;
    let rect = Rect::from_min_max(pos2(at.max.x + 10.0, at.min.y - 6.0), pos2(at.max.x + BAR, at.max.y));
    let histogram = Histogram { span: limits, heights: Vec::new() };
    // The scale is the picture's own: there is nothing to set.
    let _ = colorbar(ui, &ColorBar { rect, map, limits, histogram, floor: f64::NEG_INFINITY, unit, row: None });
}

/// Round numbers along an axis from `lo` (middle of the first cell) to `hi` (of the last).
pub(in crate::app::panes) fn round_numbers((lo, hi): (f64, f64), cells: usize, room: f32) -> Vec<(f64, String)> {
    let (from, to) = (lo.min(hi), lo.max(hi));
    if cells < 2 || to <= from {
        return vec![(0.0, crate::app::widgets::tick(lo, 1.0))];
    }
    let step = crate::app::widgets::round_step((to - from) / f64::from((room / NUMBER).clamp(1.0, 9.0)));
    let first = (from / step).ceil() as i64;
    let values = (first..first + 40).map(|k| k as f64 * step).take_while(|value| *value <= to + 1e-9 * step);
    let mut numbers: Vec<(f64, String)> = values
        .map(|value| ((value - lo) / (hi - lo) * (cells - 1) as f64, crate::app::widgets::tick(value, to - from)))
        .collect();
    numbers.sort_by(|a, b| a.0.total_cmp(&b.0));
    numbers
}

/// A ring that is seen on every colour.
pub(in crate::app::panes) fn ring(painter: &Painter, at: Pos2, radius: f32, color: Color32) {
    painter.circle_stroke(at, radius, Stroke::new(3.5, Color32::from_black_alpha(150)));
    painter.circle_stroke(at, radius, Stroke::new(1.8, color));
}

/// Smallest and largest of some numbers; a little apart where they are one.
pub(in crate::app::panes) fn limits(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.filter(|x| x.is_finite());
    let (lo, hi) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
    match hi - lo {
        span if span > 0.0 => Some((lo, hi)),
        _ if lo.is_finite() => Some((lo - 0.5 * lo.abs().max(1e-3), lo + 0.5 * lo.abs().max(1e-3))),
        _ => None,
    }
}
