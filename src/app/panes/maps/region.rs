//! Boxes of cells: those that a label marks, drawn with the mouse, and those that a finding points at.

use super::{MapExtent, State, overlay, unit_at};
use crate::app::map_image::Orientation;
use crate::app::theme::Tokens;
use crate::labels::CellRegion;
use crate::radar::View;
use crate::session::Session;
use egui::{FontId, Painter, Pos2, Rect, Stroke, Ui, vec2};

/// A box of cells that is pointed at, until the frame changes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Highlight {
    frame: usize,
    view: usize,
    lo: Vec<usize>,
    hi: Vec<usize>,
    /// What was seen of the view before.
    before: MapExtent,
}

/// What a box that is drawn is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BoxOf {
    /// The cells that a label is about.
    Label,
    /// Cells that the fit is not to see: a box of them,
    Eraser,
    /// those under a brush,
    Brush,
    /// the whole connected echo that is clicked.
    Echo,
}

impl BoxOf {
    /// The ways to erase, and their names.
    pub(super) const ERASERS: [(Self, &'static str, &'static str); 3] = [
        (Self::Eraser, "Box", "Drag a box over the cells."),
        (Self::Brush, "Brush", "Paint over the cells; the next stroke joins the ones before, until Esc."),
        (
            Self::Echo,
            "Echo",
            "Click an echo: all of it goes, as far as cells as strong as H_ori's mask reach from there. Until Esc.",
        ),
    ];

    /// Whether it takes cells away from the fit.
    pub(super) fn erases(self) -> bool {
        self != Self::Label
    }
}

/// Half the width of the brush, cells of the picture.
const BRUSH: i64 = 2;

/// Whether the mouse draws a box of cells.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Marking {
    /// The next drag draws, with or without Ctrl.
    pub(super) armed: Option<BoxOf>,
    /// Where the drag began, and what for.
    from: Option<(DragStart, BoxOf)>,
    /// Where the pointer is.
    to: [f64; 2],
    /// What was painted in this stroke: flat indices.
    painted: std::collections::BTreeSet<usize>,
}

/// What a drag on a map comes to.
pub(super) enum Drawn {
    /// Nothing: it is no box.
    Nothing,
    /// A box that is not done, or none.
    Begun,
    /// What the fit is not to see, so far.
    Erased(CellRegion),
    /// The same, single cells.
    Painted(Vec<usize>),
    /// A cell whose echo it is not to see.
    Echo(usize),
    /// What a label is about.
    Marked(CellRegion),
}

/// Where a drag began. The three columns draw the same views: the drag is that of one of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DragStart {
    column: egui::Id,
    view: usize,
    /// Picture coordinates.
    at: [f64; 2],
}

impl State {
    /// The next drag on a map draws a box of cells; again to leave it.
    pub(super) fn draw_box(&mut self, what: BoxOf) {
        self.marking.armed = (self.marking.armed != Some(what)).then_some(what);
    }

    /// Points at cells and zooms the map to them.
    pub(super) fn show_cells(&mut self, session: &Session, view: usize, lo: &[usize], hi: &[usize]) {
        let Some(v) = session.data.dataset.as_ref().and_then(|dataset| dataset.info().views.get(view)) else { return };
        let o = Orientation::of(v, session.view.cube);
        let Some([min, max]) = grid_box(v, o, lo, hi).map(|cells| o.shown_box(v, cells)) else { return };
        let frame = session.data.frame_index;
        self.leave_highlight(None);
        let before = self.windows.get(view).copied().unwrap_or_default();
        self.highlight = Some(Highlight { frame, view, lo: lo.to_vec(), hi: hi.to_vec(), before });
        if let Some(window) = self.windows.get_mut(view) {
            for axis in 0..2 {
                // The cells take a third of the map, so that what is around them is seen too.
                let span = ((max[axis] - min[axis]) * 3.0).clamp(0.25, 1.0);
                let low = (0.5 * (min[axis] + max[axis]) - 0.5 * span).clamp(0.0, 1.0 - span);
                (window.min[axis], window.max[axis]) = (low, low + span);
            }
        }
    }

    /// Takes back the zoom to cells that are pointed at on another frame than `frame`.
    pub(super) fn leave_highlight(&mut self, frame: Option<usize>) {
        if let Some(left) = self.highlight.take_if(|highlight| Some(highlight.frame) != frame)
            && let Some(window) = self.windows.get_mut(left.view)
        {
            *window = left.before;
        }
    }

    /// Draws what is pointed at and what the label marks.
    pub(super) fn draw_regions(
        &self,
        painter: &Painter,
        session: &Session,
        index: usize,
        view: &View,
        to_screen: &dyn Fn([f64; 2]) -> Pos2,
        tokens: &Tokens,
    ) {
        let o = Orientation::of(view, session.view.cube);
        let is_box = |(begun, what): &(DragStart, BoxOf)| begun.view == index && *what != BoxOf::Brush;
        if let Some((begun, _)) = self.marking.from.filter(is_box) {
            let corners = [begun.at, self.marking.to].map(|at| o.to_grid(view, at).map(|x| x.clamp(0.0, 1.0)));
            let line = overlay::outline(view, o, overlay::grid_box(corners[0], corners[1]), to_screen);
            painter.line(line, Stroke::new(1.5, tokens.accent));
        }
        for cells in session.fit.erased().iter().filter(|cells| cells.view == index) {
            if !cells.cells.is_empty() {
                shade(painter, (view, o), &cells.cells, to_screen);
            }
            let [lo, hi] = [|b: &[usize; 2]| b[0], |b: &[usize; 2]| b[1].saturating_sub(1)]
                .map(|end: fn(&[usize; 2]) -> usize| cells.bins.iter().map(end).collect::<Vec<_>>());
            outline(painter, (view, o), &lo, &hi, to_screen, "erased", tokens);
        }
        let label = session.labels.label(session.data.frame_index);
        if let Some(region) = label.region.as_ref().filter(|region| region.view == view.array) {
            let text = if label.tags.is_empty() { "marked".into() } else { label.tags.to_string() };
            outline(painter, (view, o), &region.lo, &region.hi, to_screen, &text, tokens);
        }
        if let Some(h) = self.highlight.as_ref().filter(|h| h.view == index && h.frame == session.data.frame_index) {
            outline(painter, (view, o), &h.lo, &h.hi, to_screen, "here", tokens);
        }
    }

    /// A drag with Ctrl, or any drag while armed, draws a box of cells, and does not pan meanwhile.
    pub(super) fn mark(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        plot: Rect,
        index: usize,
        (view, o): (&View, Orientation),
    ) -> Drawn {
        let window = self.windows.get(index).copied().unwrap_or_default();
        let pointer = response.interact_pointer_pos();
        let what = self.marking.armed.or_else(|| ui.input(|i| i.modifiers.command).then_some(BoxOf::Label));
        if what == Some(BoxOf::Echo) {
            let at = response.clicked().then(|| response.interact_pointer_pos()).flatten();
            let cell = at.and_then(|at| cell_at(view, o, unit_at(plot, window, at)));
            if response.hovered() {
                ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
            }
            return cell.map_or(Drawn::Begun, Drawn::Echo);
        }
        if response.drag_started()
            && let (Some(what), Some(origin)) = (what, ui.input(|i| i.pointer.press_origin()))
        {
            let begun = DragStart { column: response.id, view: index, at: unit_at(plot, window, origin) };
            self.marking.from = Some((begun, what));
            self.marking.painted.clear();
        }
        if self.marking.armed.is_some() && response.hovered() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
        }
        let Some((DragStart { at: from, .. }, what)) =
            self.marking.from.filter(|(begun, _)| begun.column == response.id)
        else {
            return Drawn::Nothing;
        };
        let to = pointer.map_or(from, |pointer| unit_at(plot, window, pointer));
        let before = std::mem::replace(&mut self.marking.to, to);
        let dragged = response.dragged();
        if what == BoxOf::Brush {
            let fresh = if self.marking.painted.is_empty() { from } else { before };
            let was = self.marking.painted.len();
            paint(&mut self.marking.painted, (view, o), fresh, to);
            if !dragged {
                // The brush stays in the hand.
                let armed = self.marking.armed;
                self.marking = Marking { armed, ..Marking::default() };
                return Drawn::Begun;
            }
            let more = self.marking.painted.len() > was;
            return if more { Drawn::Painted(self.marking.painted.iter().copied().collect()) } else { Drawn::Begun };
        }
        if !dragged {
            self.marking = Marking::default();
        }
        let cells = region(view, o, from, to);
        match (what, cells) {
            (BoxOf::Eraser, Some(cells)) if dragged => Drawn::Erased(cells),
            (BoxOf::Label, Some(cells)) if !dragged => Drawn::Marked(cells),
            _ => Drawn::Begun,
        }
    }
}

/// The cell of the map at a point of the picture, where the picture has one cell a pixel: of a cube the shown bin, or its middle.
fn cell_at(view: &View, o: Orientation, at: [f64; 2]) -> Option<usize> {
    let region = region(view, o, at, at)?;
    let shape = view.shape();
    let index = |k: usize| if region.lo[k] == region.hi[k] { region.lo[k] } else { third_bin(o, shape[k]) };
    Some((0..shape.len()).fold(0, |flat, k| flat * shape[k] + index(k)))
}

fn third_bin(o: Orientation, bins: usize) -> usize {
    match o.third {
        crate::session::ThirdAxis::Bin(bin) => bin.min(bins.saturating_sub(1)),
        _ => bins / 2,
    }
}

/// Adds the cells under the brush on its way between two points of the picture: of a cube all bins of the axis that is not drawn.
fn paint(
    painted: &mut std::collections::BTreeSet<usize>,
    (view, o): (&View, Orientation),
    from: [f64; 2],
    to: [f64; 2],
) {
    let ends = [from, to].map(|at| o.bins_from_unit(view, at));
    let way: f64 = (0..2).map(|k| (ends[1][k] - ends[0][k]).abs()).fold(0.0, f64::max);
    let steps = way.ceil().max(1.0);
    let shape = view.shape();
    for step in 0..=steps as usize {
        let t = step as f64 / steps;
        let at: [i64; 2] = std::array::from_fn(|k| (ends[0][k] + t * (ends[1][k] - ends[0][k])).round() as i64);
        for (i, j) in (-BRUSH..=BRUSH).flat_map(|i| (-BRUSH..=BRUSH).map(move |j| (i, j))) {
            if i * i + j * j > BRUSH * BRUSH + 1 {
                continue;
            }
            let mut cells = vec![0];
            for (axis, &bins) in shape.iter().enumerate() {
                let place = [(o.horizontal, at[0] + i), (o.vertical, at[1] + j)].into_iter().find(|(k, _)| *k == axis);
                cells = match place {
                    Some((_, bin)) if (0..bins as i64).contains(&bin) => {
                        cells.iter().map(|flat| flat * bins + bin as usize).collect()
                    }
                    Some(_) => Vec::new(),
                    None => cells.iter().flat_map(|flat| (0..bins).map(move |bin| flat * bins + bin)).collect(),
                };
            }
            painted.extend(cells);
        }
    }
}

/// Darkens single cells, row by row of the picture.
fn shade(painter: &Painter, (view, o): (&View, Orientation), cells: &[usize], to_screen: &dyn Fn([f64; 2]) -> Pos2) {
    let shape = view.shape();
    let mut places: Vec<(usize, usize)> = cells
        .iter()
        .map(|&cell| {
            let bins = crate::radar::unravel(cell, &shape);
            (bins[o.vertical], bins[o.horizontal])
        })
        .collect();
    places.sort_unstable();
    places.dedup();
    for run in places.chunk_by(|a, b| a.0 == b.0 && a.1 + 1 == b.1) {
        let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
        let corner = |row: f64, column: f64| o.grid_from_bins(view, [column, row]);
        let row = first.0 as f64;
        let cells = overlay::grid_box(corner(row - 0.5, first.1 as f64 - 0.5), corner(row + 0.5, last.1 as f64 + 0.5));
        let line = overlay::outline(view, o, cells, to_screen);
        painter.add(egui::Shape::convex_polygon(line, egui::Color32::from_black_alpha(150), Stroke::NONE));
    }
}

/// The cells between two points of the picture.
fn region(view: &View, o: Orientation, from: [f64; 2], to: [f64; 2]) -> Option<CellRegion> {
    let corners = [from, to].map(|at| o.bins_from_unit(view, at));
    let mut lo = vec![0; view.axes.len()];
    let mut hi: Vec<usize> = view.axes.iter().map(|axis| axis.bins.saturating_sub(1)).collect();
    for (k, axis) in [o.horizontal, o.vertical].into_iter().enumerate() {
        let last = *hi.get(axis)?;
        let ends = corners.map(|bins| ((bins[k] + 0.5).floor().max(0.0) as usize).min(last));
        *lo.get_mut(axis)? = ends[0].min(ends[1]);
        *hi.get_mut(axis)? = ends[0].max(ends[1]);
    }
    Some(CellRegion { view: view.array.clone(), lo, hi })
}

/// Corners of a box of cells in the grid of cells, lower first; `None` where the box is not of this view.
fn grid_box(view: &View, o: Orientation, lo: &[usize], hi: &[usize]) -> Option<[[f32; 2]; 2]> {
    if lo.len() != view.axes.len() || hi.len() != view.axes.len() {
        return None;
    }
    let corner = |bins: &[usize], by: f64| -> Vec<f64> { bins.iter().map(|&bin| bin as f64 + by).collect() };
    let place = |bins: Vec<f64>| o.grid_from_bins(view, [bins[o.horizontal], bins[o.vertical]]);
    Some(overlay::grid_box(place(corner(lo, -0.5)), place(corner(hi, 0.5))))
}

fn outline(
    painter: &Painter,
    (view, o): (&View, Orientation),
    lo: &[usize],
    hi: &[usize],
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    text: &str,
    tokens: &Tokens,
) {
    let Some(cells) = grid_box(view, o, lo, hi) else { return };
    let line = overlay::outline(view, o, cells, to_screen);
    let rect = Rect::from_points(&line);
    painter.line(line.clone(), Stroke::new(3.5, egui::Color32::from_black_alpha(120)));
    painter.line(line, Stroke::new(1.5, egui::Color32::WHITE));
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(10.0), egui::Color32::WHITE);
    let size = galley.size();
    let corner = rect.left_top() + vec2(-2.0, -3.0 - size.y);
    painter.rect_filled(Rect::from_min_size(corner, size + vec2(6.0, 1.0)), 2.0, tokens.accent.gamma_multiply(0.85));
    painter.galley(corner + vec2(3.0, 0.0), galley, egui::Color32::WHITE);
}

#[cfg(test)]
mod tests {
    #![expect(clippy::panic, reason = "tests")]
    use super::*;
    use crate::radar::{Axis, AxisKind, PointSpread, Quantity, Spacing};
    use crate::session::CubeView;

    fn view() -> View {
        let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        View {
            array: "hm".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread::default(),
            pose: crate::geometry::Pose::default(),
            axes: vec![axis(AxisKind::DepthH, 40, 4.0, 0.0), axis(AxisKind::Y, 20, 1.0, -1.0)],
            region: None,
        }
    }

    /// What is drawn with the mouse is shown where it was drawn.
    #[test]
    fn a_drawn_box_comes_back_where_it_was_drawn() {
        let view = view();
        let o = Orientation::of(&view, CubeView::default());
        for (from, to) in [([0.101, 0.201], [0.349, 0.399]), ([0.349, 0.399], [0.101, 0.201])] {
            let Some(region) = region(&view, o, from, to) else { panic!("a region") };
            assert_eq!((region.view.as_str(), region.lo.len()), ("hm", 2));
            let Some([min, max]) = grid_box(&view, o, &region.lo, &region.hi) else { panic!("a box") };
            let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
            assert!(
                near(min[0], 0.1) && near(max[0], 0.35) && near(min[1], 0.2) && near(max[1], 0.4),
                "{min:?} {max:?}"
            );
        }
    }

    #[test]
    fn a_box_of_another_view_is_not_drawn() {
        assert_eq!(grid_box(&view(), Orientation::of(&view(), CubeView::default()), &[1], &[2]), None);
    }
}
