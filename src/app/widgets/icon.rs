//! Icons of a few strokes: no font of the window has them, and they take the colour of the words beside them.

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke};

/// Side of the square that the marks of an icon lie in.
pub(crate) const GRID: f32 = 16.0;

/// What an icon is drawn with, in a square of [`GRID`], x to the right, y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Mark {
    /// A line through these places.
    Line(&'static [[f32; 2]]),
    /// A circle about a place.
    Ring([f32; 2], f32),
    /// A filled circle about a place.
    Dot([f32; 2], f32),
    /// A box from its upper left to its lower right corner.
    Box([f32; 4]),
    /// A filled box.
    Bar([f32; 4]),
}

/// The marks of an icon.
pub(crate) type Icon = &'static [Mark];

/// Draws an icon into the middle of `rect`, `size` points wide and high.
pub(crate) fn draw(painter: &Painter, rect: Rect, size: f32, icon: Icon, color: Color32) {
    let scale = size / GRID;
    let corner = rect.center() - egui::Vec2::splat(0.5 * size);
    let at = |[x, y]: [f32; 2]| -> Pos2 { corner + scale * egui::vec2(x, y) };
    let stroke = Stroke::new(1.2, color);
    let area = |[x0, y0, x1, y1]: [f32; 4]| Rect::from_min_max(at([x0, y0]), at([x1, y1]));
    for &mark in icon {
        painter.add(match mark {
            Mark::Line(places) => Shape::line(places.iter().copied().map(at).collect(), stroke),
            Mark::Ring(center, radius) => Shape::circle_stroke(at(center), scale * radius, stroke),
            Mark::Dot(center, radius) => Shape::circle_filled(at(center), scale * radius, color),
            Mark::Box(corners) => Shape::rect_stroke(area(corners), 1.0, stroke, egui::StrokeKind::Middle),
            Mark::Bar(corners) => Shape::rect_filled(area(corners), 0.0, color),
        });
    }
}

/// The box around all marks, in the icon's own square.
#[cfg(test)]
pub(crate) fn extent(icon: Icon) -> Rect {
    let around = |[x, y]: [f32; 2], by: f32| Rect::from_center_size(Pos2::new(x, y), egui::Vec2::splat(2.0 * by));
    let of = |mark: &Mark| match *mark {
        Mark::Line(places) => places.iter().fold(Rect::NOTHING, |all, &place| all.union(around(place, 0.0))),
        Mark::Ring(center, radius) | Mark::Dot(center, radius) => around(center, radius),
        Mark::Box([x0, y0, x1, y1]) | Mark::Bar([x0, y0, x1, y1]) => {
            Rect::from_min_max(Pos2::new(x0, y0), Pos2::new(x1, y1))
        }
    };
    icon.iter().map(of).fold(Rect::NOTHING, Rect::union)
}
