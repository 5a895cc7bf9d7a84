//! The strip under the maps: what is under the pointer, in a place of its own so that it covers no picture.

use super::picture::Content;
use super::{Shared, State};
use crate::app::figure;
use crate::app::map_image::{Orientation, level};
use crate::app::map_plane::Plane;
use crate::app::theme::{self, Tokens};
use crate::radar::{AxisKind, View};
use crate::session::{Compare, Session, ThirdAxis};
use egui::{Align2, FontId, Rect, Ui, vec2};

/// Draws the strip.
pub(super) fn show(ui: &Ui, shared: &mut Shared<'_>, state: &mut State, rect: Rect) {
    let session = shared.session;
    let tokens = Tokens::of(ui);
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    painter.hline(rect.x_range(), rect.min.y, egui::Stroke::new(1.0, tokens.stroke));
    let views = session.data.dataset.iter().flat_map(|dataset| &dataset.info().views);
    let pointed = state.hovered.and_then(|(view, pixel)| Some((view, pixel, views.clone().nth(view)?)));
    let (lines, font, color) = match (state.told.take(), pointed) {
        (Some(told), _) => (vec![told.to_owned()], FontId::proportional(theme::CAPTION), tokens.warn),
        (None, Some((index, pixel, view))) => {
            (lines(session, state, view, index, pixel), theme::mono(theme::CAPTION), tokens.text)
        }
        (None, None) => (vec![hint(session)], FontId::proportional(theme::CAPTION), tokens.dim),
    };
    let mut job = egui::text::LayoutJob::simple(lines.join("\n"), font, color, rect.width() - 16.0);
    job.wrap.max_rows = 2;
    job.wrap.max_width -= SWITCH.x + 8.0;
    painter.galley(rect.min + vec2(8.0, 4.0), painter.layout_job(job), color);
    let response = ui.interact(rect, ui.scope_id().with("read-out"), egui::Sense::hover());
    let told = pointed.is_some().then(|| lines.join("\n"));
    response.widget_info(|| figure::spoken("Cell under the pointer", told.as_deref()));
    switch(ui, shared, rect, &tokens);
    if session.view.neighbours {
        let below = rect.with_min_y(rect.min.y + super::grid::READOUT);
        nine(ui, state, pointed.map(|(view, pixel, _)| (view, pixel)), below, &tokens);
    }
}

/// Size of the switch of the nine cells.
const SWITCH: egui::Vec2 = vec2(34.0, 16.0);

fn switch(ui: &Ui, shared: &mut Shared<'_>, rect: Rect, tokens: &Tokens) {
    let on = shared.session.view.neighbours;
    let rect = Rect::from_min_size(rect.right_top() + vec2(-SWITCH.x - 8.0, 4.0), SWITCH);
    let response = ui.interact(rect, ui.scope_id().with("nine cells"), egui::Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, on, "3 × 3 cells"));
    let ground = match (on, response.hovered()) {
        (true, _) => tokens.accent.gamma_multiply(0.3),
        (false, true) => tokens.raised,
        (false, false) => tokens.panel,
    };
    let color = if on || response.hovered() { tokens.text } else { tokens.dim };
    ui.painter().rect(rect, 3.0, ground, egui::Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Inside);
    ui.painter().text(rect.center(), Align2::CENTER_CENTER, "3 × 3", FontId::proportional(10.0), color);
    if response.on_hover_text("The values of the nine cells round the cursor, in the unit shown.").clicked() {
        shared.set_view(|view| view.neighbours = !on);
    }
}

/// The cells round the cursor of both maps, as they lie in the array's picture, the cursor's own in the middle.
fn nine(ui: &Ui, state: &State, cell: Option<(usize, [usize; 2])>, rect: Rect, tokens: &Tokens) {
    const CELL: egui::Vec2 = vec2(58.0, 14.0);
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let maps = cell.map_or([None, None], |(view, pixel)| state.pictures.around(view, pixel));
    for (k, (name, values)) in ["H_ori", "H_sim"].into_iter().zip(maps).enumerate() {
        let corner = rect.min + vec2(8.0 + k as f32 * (3.0 * CELL.x + 64.0), 0.0);
        let unit = state.pictures.unit(Content::Ori);
        painter.text(corner, Align2::LEFT_TOP, name, FontId::proportional(theme::CAPTION), tokens.dim);
        painter.text(corner + vec2(0.0, CELL.y), Align2::LEFT_TOP, unit, FontId::proportional(9.0), tokens.dim);
        let grid = Rect::from_min_size(corner + vec2(46.0, 0.0), 3.0 * CELL);
        let values = values.unwrap_or_default();
        let text = |value: Option<f64>| match (value, cell) {
            (Some(value), _) if value.is_nan() => "NaN".to_owned(),
            (Some(value), Some((view, _))) => level(value, state.pictures.floor(view, Content::Ori)).replace(' ', ""),
            _ => "—".to_owned(),
        };
        for (row, column) in (0..9).map(|i| (i / 3, i % 3)) {
            let at = Rect::from_min_size(grid.min + vec2(column as f32 * CELL.x, row as f32 * CELL.y), CELL);
            let middle = (row, column) == (1, 1);
            if middle {
                let stroke = egui::Stroke::new(1.0, tokens.accent);
                painter.rect_stroke(at, 2.0, stroke, egui::StrokeKind::Inside);
            }
            let color = if middle { tokens.text } else { tokens.dim };
            let text = text(values[row][column]);
            painter.text(
                at.right_center() - vec2(4.0, 0.0),
                Align2::RIGHT_CENTER,
                text,
                theme::mono(theme::CAPTION),
                color,
            );
        }
        let response = ui.interact(grid, ui.scope_id().with(("nine", k)), egui::Sense::hover());
        let told = values.map(|row| row.map(text).join(" ")).join("\n");
        response.widget_info(|| figure::spoken(&format!("Nine cells of {name}"), Some(&told)));
    }
}

fn hint(session: &Session) -> String {
    let flip = if session.view.compare == Compare::Flip { " · Shift flips H_ori and H_sim" } else { "" };
    format!("Point at a map for its values · wheel zooms · double click or Z: one map alone · F: person or whole{flip}")
}

/// Where a cell is, and what is there.
fn lines(session: &Session, state: &State, view: &View, index: usize, pixel: [usize; 2]) -> Vec<String> {
    let (o, pictures) = (Orientation::of(view, session.view.cube), &state.pictures);
    let [across, up] = o.bins_of_pixel(view, pixel);
    let (first, second) = if o.vertical == 0 { (up, across) } else { (across, up) };
    let mut place = vec![format!("{}[{}, {}]", view.array, first.round(), second.round())];
    for (axis, bin) in [(o.vertical, up), (o.horizontal, across)] {
        let a = &view.axes[axis];
        place.push(format!("{} {:.3} {}", a.shown_name(), a.shown_at(bin), a.shown_unit()));
    }
    place.extend(other(view, o, up, across));
    if let Some(axis) = o.collapsed {
        let a = &view.axes[axis];
        place.push(match o.third {
            ThirdAxis::Largest => format!("largest over {}", a.shown_name()),
            ThirdAxis::Mean => format!("mean over {}", a.shown_name()),
            ThirdAxis::Bin(bin) => format!("{} {:.3} {}", a.shown_name(), a.shown_at(bin as f64), a.shown_unit()),
        });
    }
    let unit = pictures.unit(Content::Ori);
    let mut values = Vec::new();
    for (k, (name, value)) in ["H_ori", "H_sim"].into_iter().zip(pictures.values(index, pixel)).enumerate() {
        values.push(match value {
            Some((stored, _)) if stored.is_nan() => format!("{name} NaN (filled before the fit)"),
            Some((stored, shown)) => {
                let rank = pictures.rank(index, k, stored).map_or_else(String::new, |rank| format!(" P{rank:.1}"));
                format!("{name} {stored:.4e}  {} {unit}{rank}", level(shown, pictures.floor(index, Content::Ori)))
            }
            None => format!("{name} —"),
        });
    }
    if session.view.compare == Compare::Difference
        && let [Some((_, ori)), Some((_, sim))] = pictures.values(index, pixel)
    {
        let floor = pictures.limits(index, Content::Ori).0;
        values.push(format!("Δ {:.2} {}", sim.max(floor) - ori.max(floor), pictures.unit(Content::Difference)));
    }
    if let Some([ori, sim, inside]) = pictures.mask_at(index, pixel) {
        let mask = match (ori, sim) {
            _ if !inside => "outside the EM region",
            (true, true) => "in both masks",
            (true, false) => "in H_ori's mask only",
            (false, true) => "in H_sim's mask only",
            (false, false) => "in no mask",
        };
        values.push(mask.into());
    }
    vec![place.join("   "), values.join("   ")]
}

/// A cell in the coordinates that its map is not in, in the map's own plane: range and angle, or metres.
fn other(view: &View, o: Orientation, up: f64, across: f64) -> Option<String> {
    let (v, h) = (&view.axes[o.vertical], &view.axes[o.horizontal]);
    let (up, across) = (v.value_at(up), h.value_at(across));
    match Plane::other(v, h) {
        Plane::Cells => None,
        Plane::BirdsEye => {
            let [depth, side] = match h.kind {
                AxisKind::Elevation => ["depth", "z"],
                AxisKind::Cone => ["depth", "y"],
                _ => ["x", "y"],
            };
            Some(format!("{depth} {:.3} m   {side} {:.3} m", up * across.cos(), up * across.sin()))
        }
        Plane::Polar => {
            let name = if h.kind == AxisKind::Y { "azimuth" } else { "elevation" };
            Some(format!("range {:.3} m   {name} {:.2}°", up.hypot(across), across.atan2(up).to_degrees()))
        }
    }
}
