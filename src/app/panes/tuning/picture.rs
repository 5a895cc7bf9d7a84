//! The picture of a tuning map: two settings are cells in colours, one is a curve with its spread over the frames.
//!
//! Values stand at equal distances, whatever they are: grids are often geometric. A cell that is not fitted yet has the
//! colour of the coarser one that it lies in.

use crate::app::panes::explore::plane::{self, PlaneArea, PlaneAxis};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{round_step, tick};
use crate::explore::{TunedQuantity, TuningMap};
use crate::session::Session;
use egui::{Align2, Color32, Pos2, Rect, Stroke, Ui, pos2};

/// A picture and where it is.
pub(super) struct Shape<'a> {
    map: &'a TuningMap,
    /// A frame by its place, else the mean over all.
    frame: Option<usize>,
    quantity: TunedQuantity,
    area: PlaneArea,
    limits: Option<(f64, f64)>,
    small: bool,
}

impl<'a> Shape<'a> {
    /// Of all frames, or of one.
    pub(super) fn new(map: &'a TuningMap, frame: Option<usize>, quantity: TunedQuantity, rect: Rect) -> Self {
        let mut shape = Self::laid(map, frame, quantity, rect, false);
        shape.limits = plane::limits(
            (0..map.points()).filter_map(|point| shape.spread(point)).flat_map(|(mean, sd)| [mean - sd, mean + sd]),
        );
        if map.grid.len() > 1 {
            shape.limits = plane::limits((0..map.points()).filter_map(|point| shape.value(point)));
        }
        shape
    }

    /// A small one of a frame, without axes, in limits that all share.
    pub(super) fn small(
        map: &'a TuningMap,
        frame: usize,
        quantity: TunedQuantity,
        rect: Rect,
        limits: Option<(f64, f64)>,
    ) -> Self {
        Self { limits, ..Self::laid(map, Some(frame), quantity, rect, true) }
    }

    fn laid(map: &'a TuningMap, frame: Option<usize>, quantity: TunedQuantity, rect: Rect, small: bool) -> Self {
        let inner = if small {
            rect.with_min_y(rect.min.y + 15.0)
        } else {
            let bar = if map.grid.len() > 1 { plane::BAR } else { 12.0 };
            Rect::from_min_max(
                pos2(rect.min.x + plane::LEFT, rect.min.y + 6.0),
                pos2(rect.max.x - bar, rect.max.y - plane::BELOW),
            )
        };
        let n = |axis: usize| map.grid.get(axis).map_or(1, |axis| axis.values.len());
        let area = PlaneArea::new(inner, [n(0), n(1)]);
        Self { map, frame, quantity, area, limits: None, small }
    }

    /// The point at a place on the screen: of a curve that of the nearest value.
    pub(super) fn point(&self, at: Pos2) -> Option<usize> {
        let [i, j] = self.area.cell(at)?;
        Some(if self.map.grid.len() > 1 { self.map.point(&[i, j]) } else { i })
    }

    fn value(&self, point: usize) -> Option<f64> {
        self.spread(point).map(|(mean, _)| mean)
    }

    fn spread(&self, point: usize) -> Option<(f64, f64)> {
        match self.frame {
            Some(frame) => self.map.fit(point, frame).and_then(|fit| self.quantity.of(fit)).map(|x| (x, 0.0)),
            None => self.map.value(point, self.quantity),
        }
    }

    pub(super) fn draw(&self, ui: &mut Ui, session: &Session, tokens: &Tokens) {
        let Some(limits) = self.limits.filter(|_| self.area.rect.is_positive()) else { return };
        if self.map.grid.len() > 1 {
            self.cells(ui, session, limits, tokens);
        } else {
            self.curve(ui, session, limits, tokens);
        }
    }

    fn cells(&self, ui: &mut Ui, session: &Session, limits: (f64, f64), tokens: &Tokens) {
        let map = plane::colormap(session);
        let painter = ui.painter().with_clip_rect(ui.clip_rect());
        let fitted = |i: usize, j: usize| {
            let point = self.map.point(&[i, j]);
            self.frame.map_or_else(|| self.map.fits_of(point).next(), |frame| self.map.fit(point, frame))
        };
        plane::cells(&painter, &self.area, limits, map, |[i, j]| {
            let coarser =
                [1, 2, 4, 8].into_iter().map(|s| [i / s * s, j / s * s]).find(|&[i, j]| fitted(i, j).is_some());
            coarser.and_then(|place| self.value(self.map.point(&place)))
        });
        if self.small {
            painter.rect_stroke(self.area.rect, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
        } else {
            let [across, up] = [0, 1].map(|axis| self.axis(axis));
            plane::axes(&painter, &self.area, [&across, &up], tokens);
            plane::scale(ui, &self.area, map, limits, self.quantity.unit());
        }
        if let Some(best) = self.map.best(self.quantity).filter(|_| !self.small && self.frame.is_none()) {
            let places = self.map.places(best);
            let at = self.area.at([places[0] as f64, places[1] as f64]);
            let arm = 4.0;
            for (color, width) in [(Color32::from_black_alpha(170), 3.5), (Color32::WHITE, 1.5)] {
                let stroke = Stroke::new(width, color);
                painter.line_segment([at - egui::vec2(arm, arm), at + egui::vec2(arm, arm)], stroke);
                painter.line_segment([at - egui::vec2(arm, -arm), at + egui::vec2(arm, -arm)], stroke);
            }
        }
        let set = [0, 1].map(|axis| self.map.place_of(axis, &session.config));
        if let [Some(x), Some(y)] = set {
            plane::ring(&painter, self.area.at([x, y]), if self.small { 3.5 } else { 6.0 }, Color32::WHITE);
        }
    }

    fn axis(&self, axis: usize) -> PlaneAxis {
        let Some(axis) = self.map.grid.get(axis) else {
            return PlaneAxis { name: String::new(), numbers: Vec::new() };
        };
        let field = crate::config::Field::of_key(&axis.key);
        let unit = match field.map(|field| &field.kind) {
            Some(crate::config::FieldKind::Number(number)) if !number.unit.is_empty() => format!(", {}", number.unit),
            _ => String::new(),
        };
        let numbers = axis.values.iter().enumerate().map(|(k, value)| (k as f64, value.clone())).collect();
        PlaneAxis { name: format!("{}{unit}", axis.key), numbers }
    }

    fn curve(&self, ui: &Ui, session: &Session, (lo, hi): (f64, f64), tokens: &Tokens) {
        let (rect, painter) = (self.area.rect, ui.painter().with_clip_rect(ui.clip_rect()));
        let room = 0.06 * (hi - lo);
        let (lo, hi) = (lo - room, hi + room);
        let y = |value: f64| rect.max.y - ((value - lo) / (hi - lo)) as f32 * rect.height();
        let x = |point: usize| self.area.at([point as f64, 0.0]).x;
        let step = round_step((hi - lo) / f64::from((rect.height() / 34.0).clamp(1.0, 8.0)));
        let lines = ((lo / step).ceil() as i64..).map(|k| k as f64 * step).take_while(|value| *value <= hi).take(20);
        let small = theme::mono(10.0);
        for value in lines {
            painter.hline(rect.x_range(), y(value), Stroke::new(1.0, tokens.stroke));
            if !self.small {
                let at = pos2(rect.min.x - 5.0, y(value));
                painter.text(at, Align2::RIGHT_CENTER, tick(value, hi - lo), small.clone(), tokens.dim);
            }
        }
        let known: Vec<(usize, f64, f64)> =
            (0..self.map.points()).filter_map(|point| self.spread(point).map(|(mean, sd)| (point, mean, sd))).collect();
        for pair in known.windows(2).filter(|pair| pair[0].2 > 0.0 || pair[1].2 > 0.0) {
            let corner = |&(point, mean, sd): &(usize, f64, f64), sign: f64| pos2(x(point), y(mean + sign * sd));
            let band =
                vec![corner(&pair[0], 1.0), corner(&pair[1], 1.0), corner(&pair[1], -1.0), corner(&pair[0], -1.0)];
            painter.add(egui::Shape::convex_polygon(band, tokens.accent.gamma_multiply(0.22), Stroke::NONE));
        }
        let line = known.iter().map(|&(point, mean, _)| pos2(x(point), y(mean))).collect();
        painter.add(egui::Shape::line(line, Stroke::new(2.0, tokens.accent)));
        for &(point, mean, _) in &known {
            painter.circle_filled(pos2(x(point), y(mean)), if self.small { 1.5 } else { 3.0 }, tokens.accent);
        }
        if let Some(set) = self.map.place_of(0, &session.config) {
            let at = self.area.at([set, 0.0]).x;
            painter.vline(at, rect.y_range(), Stroke::new(1.5, tokens.text));
            if !self.small {
                painter.text(pos2(at + 4.0, rect.min.y + 2.0), Align2::LEFT_TOP, "in force", small, tokens.text);
            }
        }
        if self.small {
            painter.rect_stroke(rect, 0.0, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Outside);
        } else {
            let up = PlaneAxis { name: self.title(), numbers: Vec::new() };
            plane::axes(&painter, &self.area, [&self.axis(0), &up], tokens);
        }
    }

    fn title(&self) -> String {
        match self.quantity.unit() {
            "" => self.quantity.title().to_owned(),
            unit => format!("{}, {unit}", self.quantity.title()),
        }
    }
}
